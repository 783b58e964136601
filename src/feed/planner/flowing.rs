//! The law of the front piece under `continuous`, with the changes of the feed override in it.
//!
//! In: the window, the override and its changes. Out: the [`TimeLaw`] of the front piece. A law in which the override changes is driven up to the
//! set-point of the change and planned again from the state there; one that 0 % has brought to rest inside the piece waits there.
//! Does not plan: [`Continuous`] does.

use super::{Entry, Motion, PLANNED_PIECES_MAX, Planner};
use crate::feed::continuous::{Change, Continuous, Piece, Sight};
use crate::feed::feed_override::OverrideCourse;
use crate::feed::profile::standstill;
use crate::feed::synchronised::{Seen, SynchronisedActions};
use crate::feed::{Limit, LimitKind, Phase, TimeLaw};
use crate::kinematics::JointPath;
use std::collections::VecDeque;

/// So near the end of a piece, in cycles, a change is one at its end.
const NEAR_END_SHARE: f64 = 1e-3;

/// A time this share before a set-point is that of the set-point.
const SAME_TIME_RATIO: f64 = 1e-9;

/// Standing still for longer than this counts as for ever, and so long at a time synchronised actions look at a path that stands.
const HELD_MAX_S: f64 = 3600.0;
const WATCHED_S: f64 = 1.0;

/// The window as a plan needs it.
struct Window<'a> {
    entries: &'a mut VecDeque<Entry>,
    admitted: usize,
    ends_path: bool,
    /// The path rests somewhere in it.
    rests: bool,
}

impl Window<'_> {
    /// The pieces that move, up to a rest at most.
    fn pieces(&mut self) -> Vec<Piece<'_>> {
        self.first_pieces(usize::MAX).0
    }

    /// The first `count` of them.
    fn first_pieces(&mut self, count: usize) -> (Vec<Piece<'_>>, Sight) {
        let (admitted, ends_path) = (self.admitted, self.ends_path);
        let mut pieces: Vec<Piece<'_>> = Vec::new();
        for (index, entry) in self.entries.range_mut(..admitted).take(PLANNED_PIECES_MAX).enumerate() {
            if pieces.len() >= count {
                return (pieces, Sight::Part { rests: self.rests });
            }
            let Entry { path, motion, corner, rests_after, .. } = entry;
            if index > 0 && corner.velocity_lu_s == 0.0 {
                if let Some(last) = pieces.last_mut() {
                    last.rests_after = true;
                }
                break;
            }
            let rests_after = *rests_after || (ends_path && index + 1 == admitted);
            match motion {
                Motion::Flows(flow) => {
                    let flow = flow.look(path);
                    pieces.push(Piece { path, flow, junction: *corner, rests_after });
                }
                _ => {
                    if let Some(last) = pieces.last_mut() {
                        last.rests_after |= rests_after;
                    }
                }
            }
            if rests_after {
                break;
            }
        }
        (pieces, Sight::All)
    }

    /// Plans with as much of the window as a plan needs: what lies beyond it costs nothing, however long the window is.
    fn plan(&mut self, continuous: &mut Continuous) {
        let mut count = continuous.looks_at();
        loop {
            let (mut pieces, sight) = self.first_pieces(count);
            if continuous.plan(&mut pieces, sight) {
                return;
            }
            count = count.saturating_mul(2);
        }
    }

    fn front_is_held(&mut self, continuous: &Continuous) -> bool {
        self.pieces().first().is_some_and(|front| continuous.is_held(front))
    }
}

impl Planner {
    /// The law of the front piece under `continuous`; `None` where it does not move.
    pub(super) fn flow(&mut self) -> Option<TimeLaw> {
        let ends_path = self.window_ends_path();
        let rests = ends_path || self.rests > 0;
        let Self { continuous, entries, admitted, overrides, actions, held, elapsed_s, .. } = self;
        let continuous = continuous.as_mut()?;
        let front = entries.front()?;
        if !matches!(front.motion, Motion::Flows(_)) {
            return None;
        }
        let (length_lu, block) = (front.path.length_lu(), front.path.contour.block);
        let mut course = Course::new(overrides, actions, &front.path, *elapsed_s);
        let mut window = Window { entries, admitted: *admitted, ends_path, rests };
        let mut planned = false;
        loop {
            course.overrides.advance(course.now_s);
            planned |= course.take_override(continuous, &mut window);
            if !planned && !continuous.holds_front() {
                window.plan(continuous);
            }
            if continuous.override_ratio() == 0.0 && window.front_is_held(continuous) {
                if !course.wait(continuous.front_start_lu()) {
                    *held = Some((block, false));
                    break;
                }
                planned = false;
                continue;
            }
            let law = continuous.front_law().unwrap_or_default();
            planned = !course.drive(continuous, &mut window, &law);
            if planned {
                continue;
            }
            let end_lu = continuous.front_end_lu().unwrap_or(length_lu);
            let rests_inside = end_lu < length_lu;
            continuous.pass_front(rests_inside.then_some(end_lu));
            if !rests_inside {
                break;
            }
        }
        Some(TimeLaw::new(course.phases))
    }

    /// Synchronised actions look at a piece that stands.
    pub(super) fn stand_by(&mut self, path: &JointPath, law: &TimeLaw) {
        let start_s = self.elapsed_s;
        let mut course = Course::new(&mut self.overrides, &mut self.actions, path, start_s);
        let end_s = start_s + law.duration_s();
        while course.path.is_some() && course.now_s < end_s {
            course.watch(law, start_s, end_s);
            course.now_s = course.overrides.next_s().min(end_s);
            course.overrides.advance(course.now_s);
        }
    }
}

/// The law so far.
struct Course<'a> {
    overrides: &'a mut OverrideCourse,
    actions: &'a mut SynchronisedActions,
    /// The front piece, where synchronised actions look at it.
    path: Option<JointPath>,
    /// Since the start of the program.
    now_s: f64,
    phases: Vec<Phase>,
    /// After a change that could not be planned: how long to wait before the next attempt.
    retry_s: f64,
    /// G63: no override acts on the front piece, 0 % neither.
    fixed: bool,
}

impl<'a> Course<'a> {
    fn new(
        overrides: &'a mut OverrideCourse,
        actions: &'a mut SynchronisedActions,
        path: &JointPath,
        now_s: f64,
    ) -> Self {
        let watches = actions.any() || overrides.synchronised_ratio() != (1.0, false);
        let fixed = path.contour.modes.programmed.as_ref().is_some_and(|limits| !limits.override_acts);
        let path = watches.then(|| path.clone());
        Self { overrides, actions, path, now_s, phases: Vec::new(), retry_s: 0.0, fixed }
    }

    /// What acts on the front piece now.
    fn override_ratio(&self) -> f64 {
        if self.fixed { 1.0 } else { self.overrides.ratio() }
    }

    /// Synchronised actions look at the set-points of a law that begins at `begin_s`, up to the first one after which $AC_OVR changes or something else
    /// does, and not beyond `end_s`.
    fn watch(&mut self, law: &TimeLaw, begin_s: f64, end_s: f64) {
        let (ratio, decided) = self.overrides.synchronised_ratio();
        let Some(path) = self.path.as_ref().filter(|_| !decided) else { return };
        let (next_s, setpoint_period_s) = (self.overrides.next_s(), self.overrides.setpoint_period_s());
        let mut k = (self.now_s / setpoint_period_s * (1.0 - SAME_TIME_RATIO)).ceil().max(0.0) as u64;
        k = k.max(self.actions.next_k);
        loop {
            let time_s = self.overrides.setpoint_s(k);
            if time_s > end_s || time_s >= next_s {
                return;
            }
            let seen = Seen { path, state: law.at(time_s - begin_s), time_s, setpoint_period_s };
            let after_ratio = self.actions.override_ratio(&seen);
            k += 1;
            self.actions.next_k = k;
            if after_ratio != ratio {
                return self.overrides.synchronise(k, after_ratio);
            }
        }
    }

    /// True if the path is now planned under another override than before.
    fn take_override(&mut self, continuous: &mut Continuous, window: &mut Window<'_>) -> bool {
        let override_ratio = self.override_ratio();
        if continuous.override_ratio() == override_ratio {
            return false;
        }
        let change = continuous.change(&mut window.pieces(), override_ratio);
        self.retry_s = match change {
            Change::NotYet => self.overrides.setpoint_period_s().max(2.0 * self.retry_s),
            Change::Planned | Change::Nothing => 0.0,
        };
        change == Change::Planned
    }

    /// Follows a law to its end; false: up to a change, after which there is a new one.
    fn drive(&mut self, continuous: &mut Continuous, window: &mut Window<'_>, law: &TimeLaw) -> bool {
        let near_end_s = NEAR_END_SHARE * self.overrides.setpoint_period_s();
        let (begin_s, mut at_s) = (self.now_s, 0.0);
        loop {
            let waits = continuous.override_ratio() != self.override_ratio();
            let retry_s = if waits { self.retry_s } else { f64::INFINITY };
            let left_s = law.duration_s() - at_s;
            self.watch(law, begin_s, self.now_s + left_s.min(retry_s));
            let next_s = (self.overrides.next_s() - self.now_s).min(retry_s).max(0.0);
            if next_s >= left_s - near_end_s {
                self.phases.extend(law.phases());
                self.now_s += left_s;
                return true;
            }
            at_s += next_s;
            self.now_s += next_s;
            self.overrides.advance(self.now_s);
            continuous.stand(&law.at(at_s));
            if self.take_override(continuous, window) {
                self.phases.extend(law.until(at_s));
                return false;
            }
        }
    }

    /// Stands at a place until the override is above 0; false: that does not come.
    fn wait(&mut self, at_lu: f64) -> bool {
        let limit = Limit { kind: LimitKind::Override, axis: None };
        let known = self.phases.len();
        let [held_max_s, watched_s] = if self.path.is_some() { [HELD_MAX_S, WATCHED_S] } else { [f64::MAX; 2] };
        let last_s = self.now_s + held_max_s;
        while self.overrides.ratio() == 0.0 {
            let end_s = (self.now_s + watched_s).min(last_s);
            let stands = standstill(end_s - self.now_s, limit);
            let law = TimeLaw::new(stands.phases().iter().map(|phase| Phase { start_lu: at_lu, ..*phase }));
            self.watch(&law, self.now_s, end_s);
            let next_s = self.overrides.next_s();
            let until_s = next_s.min(end_s);
            if until_s >= last_s {
                self.phases.truncate(known);
                return false;
            }
            self.phases.extend(law.until(until_s - self.now_s));
            self.now_s = until_s;
            self.overrides.advance(until_s);
        }
        true
    }
}
