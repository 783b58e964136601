//! F a revolution while the spindle changes its speed: the feed follows the ramp.
//!
//! In: pieces with G95 behind a rest of the path, the ramp of the spindle. Out: the same pieces in stretches, each with F times the mean speed of the spindle over it.
//!
//! From a rest on the time is known, and with it the angle that the spindle has turned through wherever the path is, if the path keeps to F: at the angle θ
//! behind the rest the speed is `n(θ)² = n0² + 2 α θ`. The ramp is cut where the speed has changed by [`STEP_SHARE`] of the one that it goes to (by more
//! where a stretch would take less than [`CYCLES_MIN`] cycles), so that the feed is off by half of that. The path accelerates from
//! rest first: the first stretch holds that way whole, and the ramp counts from the speed that the spindle has by its end.
//! With the next rest, or another unit of F, it ends, and a rest begins it anew. Blends have one feed.
//! The set-point of the speed counts, not the actual one, which is `lag_ms` later. Under G96 F is that of the wanted speed.

use super::{Entry, Motion, Planner};
use crate::feed::split::{self, Part};
use crate::interpreter::{Event, Feed};
use crate::kinematics::JointPath;
use crate::machine::AxisLimits;
use crate::smoothing::PieceKind;

/// Change of the speed over a stretch, as a share of the speed that the ramp goes to.
const STEP_SHARE: f64 = 0.01;

/// Cycles that a stretch takes at least.
const CYCLES_MIN: f64 = 4.0;

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
    fn behind_start(self, lead_lu_rad: f64, acceleration_lu_s2: f64, jerk_lu_s3: Option<f64>) -> Option<Self> {
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

    /// Angles at which stretches begin, with the speed that counts from there on; the last one is the end.
    fn levels(&self, setpoint_period_s: f64) -> Vec<(f64, f64)> {
        let change_rad_s = self.change_rad_s();
        let least_rad_s =
            (STEP_SHARE * self.target_rad_s).max(CYCLES_MIN * setpoint_period_s * self.acceleration_rad_s2);
        // At most 1 / STEP_SHARE for a rise; a fall from far above is bounded too.
        let steps = (change_rad_s.abs() / least_rad_s).ceil().clamp(1.0, 1000.0) as u32;
        let step_rad_s = change_rad_s / f64::from(steps);
        let level = |step: u32| {
            let from_rad_s = self.speed_rad_s + f64::from(step) * step_rad_s;
            (self.angle_rad(from_rad_s), from_rad_s + step_rad_s / 2.0)
        };
        (0..steps).map(level).chain([(self.angle_rad(self.target_rad_s), self.target_rad_s)]).collect()
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
        let rules = self.rules.of(&path.contour.modes);
        let first = path.at(0.0).first;
        let lowest = |limit: fn(&AxisLimits) -> f64| {
            1.0 / rules.largest(|axis, limits| first[axis].abs() / limit(limits)).demand_ratio
        };
        let jerk_lu_s3 = rules.jerk_limited.then(|| lowest(|limits| limits.jerk_max_lu_s3));
        ramp.behind_start(feed_lu_s / ramp.target_rad_s, lowest(|limits| limits.acceleration_max_lu_s2), jerk_lu_s3)
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
        cut(path, &ramp, from_rad, lead_lu_rad, self.setpoint_period_s)
    }
}

/// The stretches of a piece that begins `from_rad` behind the rest.
fn cut(path: JointPath, ramp: &Ramp, from_rad: f64, lead_lu_rad: f64, setpoint_period_s: f64) -> Vec<JointPath> {
    let length_lu = path.length_lu();
    let stretch = |mut path: JointPath, speed_rad_s: f64| {
        path.contour.feed = Feed::Path { feed_lu_s: lead_lu_rad * speed_rad_s };
        // It is what it is now.
        path.contour.modes.revolution_rad_s = None;
        path
    };
    let end_rad = from_rad + length_lu / lead_lu_rad;
    let whole = |path| {
        let [first, last] =
            [from_rad, end_rad].map(|at| ramp.speed_at_rad_s(at.clamp(0.0, ramp.angle_rad(ramp.target_rad_s))));
        vec![stretch(path, 0.5 * (first + last))]
    };
    if !matches!(path.contour.kind, PieceKind::Block(_)) {
        return whole(path);
    }
    let room_rad = CYCLES_MIN * setpoint_period_s * ramp.target_rad_s;
    let levels = ramp.levels(setpoint_period_s);
    let before = levels.partition_point(|(angle_rad, _)| *angle_rad <= from_rad).saturating_sub(1);
    let mut borders: Vec<(f64, f64)> = Vec::new();
    for (angle_rad, speed_rad_s) in &levels[before..] {
        let from_lu = if borders.is_empty() { 0.0 } else { (angle_rad - from_rad) * lead_lu_rad };
        // Too near to the end it is not worth a stretch of its own.
        if borders.is_empty() || *angle_rad + room_rad.min(0.5 * (end_rad - from_rad)) < end_rad {
            borders.push((from_lu, *speed_rad_s));
        }
    }
    if borders.len() < 2 {
        let speed_rad_s = borders.first().map_or(ramp.target_rad_s, |(_, speed_rad_s)| *speed_rad_s);
        return vec![stretch(path, speed_rad_s)];
    }
    let ends = borders.iter().skip(1).map(|(from_lu, _)| *from_lu).chain([length_lu]);
    let part = |((from_lu, speed_rad_s), end_lu): (&(f64, f64), f64)| Part {
        path: stretch(split::cut(&path, *from_lu, end_lu), *speed_rad_s),
        worst: None,
    };
    let parts = borders.iter().zip(ends).map(part).collect();
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
