//! F a revolution while the spindle changes its speed: the feed follows the ramp.
//!
//! In: pieces with G95 behind a rest of the path, the ramp of the spindle. Out: the same pieces in stretches, each with F times the mean speed of the spindle over it.
//!
//! From a rest on the time is known, and with it the angle that the spindle has turned through wherever the path is, if the path keeps to F: at the angle θ
//! behind the rest the speed is `n(θ)² = n0² + 2 α θ`. The ramp is cut where the speed has changed by [`STEP_SHARE`] of itself (by more
//! where a stretch would take less than [`CYCLES_MIN`] cycles: near the rest of a spindle), so that the feed is off by half of that; each stretch takes
//! the time that the spindle takes for its angle, the change of speed from the one before included ([`Change`]), so that the path does not fall behind
//! stretch by stretch; under `continuous`, whose speed has no steps, the faster end of a stretch counts. The path accelerates from
//! rest first: the first stretch holds that way whole, and the ramp counts from the speed that the spindle has by its end.
//! With the next rest, or another unit of F, it ends, and a rest begins it anew. Blends have one feed.
//! The set-point of the speed counts, not the actual one, which is `lag_ms` later. Under G96 F is that of the wanted speed.

use super::{Entry, Motion, Planner};
use crate::feed::split::{self, Part};
use crate::interpreter::{Event, Feed};
use crate::kinematics::JointPath;
use crate::machine::AxisLimits;
use crate::smoothing::PieceKind;

/// Change of the speed over a stretch, as a share of it.
const STEP_SHARE: f64 = 0.008;

/// Stretches of a ramp at most. Some hundred below the speed at which a share takes a few cycles, and 290 for each decade above it.
const STRETCHES_MAX: usize = 4000;

/// Cycles that a stretch takes at least.
const CYCLES_MIN: f64 = 4.0;

/// Of the time of a stretch, what is left of it at least when the change of speed is taken off.
const LEFT_SHARE_MIN: f64 = 0.5;

/// A larger change over a stretch, near the rest of a spindle, is driven in steps under `continuous`, too.
const SMOOTH_SHARE_MAX: f64 = 0.08;

/// Rounds in which the time of the start is found.
const START_ROUNDS: usize = 4;

/// A ramp behind a rest of the path.
#[derive(Clone, Copy, Debug)]
pub(in crate::feed) struct Ramp {
    /// Speed where it begins: at the rest, or where the path has come to speed behind it.
    pub speed_rad_s: f64,
    /// Where it goes to, positive.
    pub target_rad_s: f64,
    /// Positive.
    pub acceleration_rad_s2: f64,
    /// What the path has used up of it; below 0 while it accelerates.
    pub turned_rad: f64,
}

impl Ramp {
    /// The same behind the way in which the path comes to speed; `None`: the ramp is over by then.
    fn behind_start(self, lead_lu_rad: f64, change: Change) -> Option<Self> {
        let Change { acceleration_lu_s2, jerk_lu_s3 } = change;
        // A path that asks nothing of any axis has no start either.
        if !acceleration_lu_s2.is_finite() || jerk_lu_s3.is_some_and(|jerk| !jerk.is_finite()) {
            return Some(self);
        }
        let sense = self.change_rad_s().signum();
        let (mut time_s, mut now_rad_s) = (0.0, self.speed_rad_s);
        // The speed depends on the time, and the time on the speed: it settles at once, because axes accelerate faster than spindles.
        for _ in 0..START_ROUNDS {
            now_rad_s = self.speed_rad_s + sense * self.acceleration_rad_s2 * time_s;
            if sense * (self.target_rad_s - now_rad_s) <= 0.0 {
                return None;
            }
            let (v, a) = (lead_lu_rad * now_rad_s, acceleration_lu_s2);
            time_s = match jerk_lu_s3 {
                Some(j) if v * j < a * a => 2.0 * (v / j).sqrt(),
                Some(j) => v / a + a / j,
                None => v / a,
            };
        }
        let turned_rad = -0.5 * now_rad_s * time_s;
        Some(Self { speed_rad_s: now_rad_s, turned_rad, ..self })
    }

    fn change_rad_s(&self) -> f64 {
        self.target_rad_s - self.speed_rad_s
    }

    /// The angle at which it has a speed.
    fn angle_rad(&self, speed_rad_s: f64) -> f64 {
        (speed_rad_s * speed_rad_s - self.speed_rad_s * self.speed_rad_s).abs() / (2.0 * self.acceleration_rad_s2)
    }

    /// The speed at an angle.
    fn speed_at_rad_s(&self, angle_rad: f64) -> f64 {
        let square = self.speed_rad_s * self.speed_rad_s
            + self.change_rad_s().signum() * 2.0 * self.acceleration_rad_s2 * angle_rad;
        square.max(0.0).sqrt()
    }

    /// When it has turned by an angle, counted from where it begins.
    fn time_s(&self, angle_rad: f64) -> f64 {
        let end_rad = self.angle_rad(self.target_rad_s);
        let ramp_s =
            (self.speed_at_rad_s(angle_rad.clamp(0.0, end_rad)) - self.speed_rad_s).abs() / self.acceleration_rad_s2;
        ramp_s + (angle_rad - end_rad).max(0.0) / self.target_rad_s
    }

    /// Mean speed between two angles. Over the way on which the path comes to speed it is the one at its end.
    fn mean_rad_s(&self, from_rad: f64, to_rad: f64) -> f64 {
        let from_rad = from_rad.max(0.0);
        let time_s = self.time_s(to_rad) - self.time_s(from_rad);
        if time_s > 0.0 {
            (to_rad - from_rad) / time_s
        } else {
            self.speed_at_rad_s(to_rad.clamp(0.0, self.angle_rad(self.target_rad_s)))
        }
    }

    /// Angles at which stretches begin; the last one is the end.
    fn levels(&self, setpoint_period_s: f64) -> Vec<f64> {
        let least_rad_s = CYCLES_MIN * setpoint_period_s * self.acceleration_rad_s2;
        let sense = self.change_rad_s().signum();
        let (mut now_rad_s, mut levels) = (self.speed_rad_s, Vec::new());
        while levels.len() < STRETCHES_MAX {
            levels.push(self.angle_rad(now_rad_s));
            let step_rad_s = (STEP_SHARE * now_rad_s).max(least_rad_s);
            let left_rad_s = sense * (self.target_rad_s - now_rad_s);
            if left_rad_s <= step_rad_s {
                break;
            }
            // The last two are alike.
            now_rad_s += sense * if left_rad_s < 2.0 * step_rad_s { 0.5 * left_rad_s } else { step_rad_s };
        }
        levels.push(self.angle_rad(self.target_rad_s));
        levels
    }
}

/// How quickly the axes let the path change its speed, along the direction of the path.
#[derive(Clone, Copy, Debug)]
struct Change {
    acceleration_lu_s2: f64,
    /// `None`: the acceleration may step.
    jerk_lu_s3: Option<f64>,
}

impl Change {
    /// Time that a change of speed loses against one at once, over a stretch at `to_lu_s`: half of what it takes, in the share that the speed changes by.
    fn lost_s(self, by_lu_s: f64, to_lu_s: f64) -> f64 {
        let (dv, a) = (by_lu_s.abs(), self.acceleration_lu_s2);
        let takes_s = match self.jerk_lu_s3 {
            Some(j) if dv * j < a * a => 2.0 * (dv / j).sqrt(),
            Some(j) => dv / a + a / j,
            None => dv / a,
        };
        let lost_s = 0.5 * takes_s * dv / to_lu_s;
        if lost_s.is_finite() { lost_s } else { 0.0 }
    }
}

impl Planner {
    /// The path rests now: pieces with F a revolution that follow in the window follow the spindle.
    pub(super) fn follow_ramp(&mut self) {
        let front_rests = self.entries.front().is_some_and(|front| front.corner.velocity_lu_s == 0.0);
        if !(self.rests_now || front_rests) {
            return;
        }
        let Some(ramp) = self.spindle.ramp(self.elapsed_s) else { return };
        let target_rad_s = ramp.target_rad_s;
        let follows = |entry: &Entry| match entry.motion {
            Motion::Nothing => !entry.path.contour.events.iter().any(changes_spindle),
            Motion::Moves { .. } | Motion::Flows(_) => counts(&entry.path, target_rad_s),
            _ => false,
        };
        let mut count = self.entries.iter().take_while(|entry| follows(entry)).count();
        if let Some(rest) = self.entries.iter().take(count).position(|entry| entry.rests_after) {
            count = rest + 1;
        }
        let first = self.entries.iter().take(count).find(|entry| counts(&entry.path, target_rad_s));
        let first = first.map(|entry| entry.path.clone());
        let Some(ramp) = first.and_then(|first| self.started(ramp, &first)) else { return };
        let behind = self.entries.split_off(count);
        let (last, last_thread) = (self.last.take(), self.last_thread.take());
        let originals = std::mem::take(&mut self.entries);
        let admitted = self.admitted.min(count);
        let beyond = self.admitted - admitted;
        self.ramp = Some(ramp);
        let mut admitted_now = 0;
        for (index, entry) in originals.into_iter().enumerate() {
            let before = self.entries.len();
            let stretches = self.ramp_stretches(entry.path.clone());
            // What could be driven can be driven slower; if not, it stays as it is.
            if stretches.into_iter().try_for_each(|stretch| self.push_stretch(stretch)).is_err() {
                self.entries.truncate(before);
                self.entries.push_back(entry);
            }
            if index < admitted {
                admitted_now = self.entries.len();
            }
        }
        if !behind.is_empty() {
            self.ramp = None;
        }
        (self.last, self.last_thread) = (last, last_thread);
        self.entries.extend(behind);
        self.admitted = admitted_now + beyond;
        self.changed_from = 0;
    }

    /// The ramp behind the start of the first piece.
    fn started(&mut self, ramp: Ramp, path: &JointPath) -> Option<Ramp> {
        let Feed::Path { feed_lu_s } = path.contour.feed else { return None };
        ramp.behind_start(feed_lu_s / ramp.target_rad_s, self.change(path))
    }

    fn change(&mut self, path: &JointPath) -> Change {
        let rules = self.rules.of(&path.contour.modes);
        let first = path.at(0.0).first;
        let lowest = |limit: fn(&AxisLimits) -> f64| {
            1.0 / rules.largest(|axis, limits| first[axis].abs() / limit(limits)).demand_ratio
        };
        let jerk_lu_s3 = rules.jerk_limited.then(|| lowest(|limits| limits.jerk_max_lu_s3));
        Change { acceleration_lu_s2: lowest(|limits| limits.acceleration_max_lu_s2), jerk_lu_s3 }
    }

    /// A piece that is pushed behind a rest whose time is known.
    pub(super) fn ramp_stretches(&mut self, path: JointPath) -> Vec<JointPath> {
        let Some(mut ramp) = self.ramp else { return vec![path] };
        let Some(length_lu) = path.contour.curve().map(crate::geometry::Curve::length_lu).filter(|lu| *lu != 0.0)
        else {
            // An M function takes no time, a wait does.
            let takes_time = !matches!(path.contour.kind, PieceKind::Wait { time_s: 0.0, .. });
            if takes_time || path.contour.stop_at_end || path.contour.events.iter().any(changes_spindle) {
                self.ramp = None;
            }
            return vec![path];
        };
        let feed_lu_s = match path.contour.feed {
            Feed::Path { feed_lu_s } if counts(&path, ramp.target_rad_s) && length_lu.is_finite() => feed_lu_s,
            _ => {
                self.ramp = None;
                return vec![path];
            }
        };
        if path.contour.events.iter().any(changes_spindle) {
            self.ramp = None;
            return vec![path];
        }
        let lead_lu_rad = feed_lu_s / ramp.target_rad_s;
        let from_rad = ramp.turned_rad;
        ramp.turned_rad += length_lu / lead_lu_rad;
        let goes_on = !path.contour.stop_at_end && ramp.turned_rad < ramp.angle_rad(ramp.target_rad_s);
        self.ramp = goes_on.then_some(ramp);
        let change = self.change(&path);
        let smooth = self.continuous.is_some();
        let course = Course { ramp, change, lead_lu_rad, setpoint_period_s: self.setpoint_period_s, smooth };
        cut(path, &course, from_rad)
    }
}

/// What the stretches of a piece are made by.
struct Course {
    ramp: Ramp,
    change: Change,
    lead_lu_rad: f64,
    setpoint_period_s: f64,
    /// The speed goes from stretch to stretch without steps, below the feeds of both: `continuous`.
    smooth: bool,
}

impl Course {
    /// Feed between two angles. In steps: the one with which the path turns with the spindle, the change from the stretch before included. Smooth: that of the
    /// faster end, where the speed touches it.
    fn feed_lu_s(&self, from_rad: f64, to_rad: f64) -> f64 {
        let Self { ramp, change, lead_lu_rad, smooth, .. } = self;
        let mean_lu_s = lead_lu_rad * ramp.mean_rad_s(from_rad, to_rad);
        let end_rad = ramp.angle_rad(ramp.target_rad_s);
        // The way to the first speed is in the ramp already; at full speed F is exact.
        if from_rad < 0.0 || from_rad >= end_rad {
            return mean_lu_s;
        }
        let [first, last] = [from_rad, to_rad].map(|at_rad| ramp.speed_at_rad_s(at_rad.min(end_rad)));
        let faster_rad_s = first.max(last);
        if *smooth && (last - first).abs() < SMOOTH_SHARE_MAX * faster_rad_s {
            return lead_lu_rad * faster_rad_s;
        }
        let time_s = ramp.time_s(to_rad) - ramp.time_s(from_rad);
        let step_lu_s = (lead_lu_rad * (last - first).abs()).min(mean_lu_s);
        let lost_s = change.lost_s(step_lu_s, mean_lu_s);
        // A stretch that is hardly longer than its change of speed stays late.
        mean_lu_s * time_s / (time_s - lost_s).max(LEFT_SHARE_MIN * time_s)
    }
}

/// The stretches of a piece that begins `from_rad` behind the rest.
fn cut(path: JointPath, course: &Course, from_rad: f64) -> Vec<JointPath> {
    let Course { ramp, lead_lu_rad, setpoint_period_s, .. } = course;
    let length_lu = path.length_lu();
    let end_rad = from_rad + length_lu / lead_lu_rad;
    let stretch = |mut path: JointPath, from_rad: f64, to_rad: f64| {
        path.contour.feed = Feed::Path { feed_lu_s: course.feed_lu_s(from_rad, to_rad) };
        // It is what it is now.
        path.contour.modes.revolution_rad_s = None;
        path
    };
    if !matches!(path.contour.kind, PieceKind::Block(_)) {
        return vec![stretch(path, from_rad, end_rad)];
    }
    let levels = ramp.levels(*setpoint_period_s);
    let before = levels.partition_point(|angle_rad| *angle_rad <= from_rad).saturating_sub(1);
    let mut borders_rad = vec![from_rad];
    for angle_rad in levels[before..].iter().skip(1) {
        let speed_rad_s = ramp.speed_at_rad_s(*angle_rad);
        // Too near to an end it is not worth a stretch of its own.
        let room_rad = (CYCLES_MIN * setpoint_period_s * speed_rad_s).min(0.5 * (end_rad - from_rad));
        let first_rad = if from_rad > 0.0 { from_rad + room_rad } else { from_rad };
        if *angle_rad > first_rad && *angle_rad + room_rad < end_rad {
            borders_rad.push(*angle_rad);
        }
    }
    if borders_rad.len() < 2 {
        return vec![stretch(path, from_rad, end_rad)];
    }
    let ends_rad = borders_rad.iter().skip(1).copied().chain([end_rad]);
    let place_lu = |angle_rad: f64| if angle_rad == end_rad { length_lu } else { (angle_rad - from_rad) * lead_lu_rad };
    let part = |(from, to): (&f64, f64)| Part {
        path: stretch(split::cut(&path, place_lu(*from), place_lu(to)), *from, to),
        worst: None,
    };
    let parts = borders_rad.iter().zip(ends_rad).map(part).collect();
    split::named(parts, &path.contour, length_lu).into_iter().map(|part| part.path).collect()
}

/// F counts revolutions of the spindle at this speed.
fn counts(path: &JointPath, target_rad_s: f64) -> bool {
    path.contour.modes.revolution_rad_s == Some(target_rad_s) && matches!(path.contour.feed, Feed::Path { .. })
}

/// S, M3 and their kin.
fn changes_spindle(event: &Event) -> bool {
    super::with_spindle::turns(event) || matches!(event, Event::SpindleSpeed { .. } | Event::SpindleAcceleration { .. })
}
