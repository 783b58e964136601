//! The law of the front piece under `continuous`, with the changes of the feed override in it.
//!
//! In: the window, the override and its changes. Out: the [`TimeLaw`] of the front piece. A law in which the override changes is driven up to the
//! set-point of the change and planned again from the state there; one that 0 % has brought to rest inside the piece waits there.
//! Does not plan: [`Continuous`] does.

use super::{Entry, Motion, PLANNED_PIECES_MAX, Planner};
use crate::feed::continuous::{Change, Continuous, Piece};
use crate::feed::feed_override::OverrideCourse;
use crate::feed::profile::standstill;
use crate::feed::{Limit, LimitKind, Phase, TimeLaw};
use std::collections::VecDeque;

/// So near the end of a piece, in cycles, a change is one at its end.
const NEAR_END_SHARE: f64 = 1e-3;

/// Standing still for longer than this counts as for ever.
const HELD_MAX_S: f64 = 1e6;

/// The window as a plan needs it.
struct Window<'a> {
    entries: &'a mut VecDeque<Entry>,
    admitted: usize,
    ends_path: bool,
}

impl Window<'_> {
    /// The pieces that move, up to a rest at most.
    fn pieces(&mut self) -> Vec<Piece<'_>> {
        let (admitted, ends_path) = (self.admitted, self.ends_path);
        let mut pieces: Vec<Piece<'_>> = Vec::new();
        for (index, entry) in self.entries.range_mut(..admitted).take(PLANNED_PIECES_MAX).enumerate() {
            let Entry { path, motion, corner, rests_after, .. } = entry;
            if index > 0 && corner.velocity_lu_s == 0.0 {
                if let Some(last) = pieces.last_mut() {
                    last.rests_after = true;
                }
                break;
            }
            let rests_after = *rests_after || (ends_path && index + 1 == admitted);
            match motion {
                Motion::Flows(flow) => pieces.push(Piece { path, flow, junction: *corner, rests_after }),
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
        pieces
    }

    fn front_is_held(&mut self, continuous: &Continuous) -> bool {
        self.pieces().first().is_some_and(|front| continuous.is_held(front))
    }
}

impl Planner {
    /// The law of the front piece under `continuous`; `None` where it does not move.
    pub(super) fn flow(&mut self) -> Option<TimeLaw> {
        let ends_path = self.window_ends_path();
        let Self { continuous, entries, admitted, overrides, elapsed_s, .. } = self;
        let continuous = continuous.as_mut()?;
        let front = entries.front()?;
        if !matches!(front.motion, Motion::Flows(_)) {
            return None;
        }
        let length_lu = front.path.length_lu();
        let mut window = Window { entries, admitted: *admitted, ends_path };
        let mut course = Course { overrides, now_s: *elapsed_s, phases: Vec::new(), retry_s: 0.0 };
        let mut planned = false;
        loop {
            course.overrides.advance(course.now_s);
            planned |= course.take_override(continuous, &mut window);
            if !planned && !continuous.holds_front() {
                continuous.plan(&mut window.pieces());
            }
            if continuous.override_ratio() == 0.0 && window.front_is_held(continuous) {
                course.wait(continuous.front_start_lu());
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
}

/// The law so far.
struct Course<'a> {
    overrides: &'a mut OverrideCourse,
    /// Since the start of the program.
    now_s: f64,
    phases: Vec<Phase>,
    /// After a change that could not be planned: how long to wait before the next attempt.
    retry_s: f64,
}

impl Course<'_> {
    /// True if the path is now planned under another override than before.
    fn take_override(&mut self, continuous: &mut Continuous, window: &mut Window<'_>) -> bool {
        let override_ratio = self.overrides.ratio();
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
        let mut at_s = 0.0;
        loop {
            let waits = continuous.override_ratio() != self.overrides.ratio();
            let retry_s = if waits { self.retry_s } else { f64::INFINITY };
            let next_s = (self.overrides.next_s() - self.now_s).min(retry_s).max(0.0);
            let left_s = law.duration_s() - at_s;
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

    /// Stands at a place until the override changes.
    fn wait(&mut self, at_lu: f64) {
        let time_s = (self.overrides.next_s() - self.now_s).clamp(0.0, HELD_MAX_S);
        let limit = Limit { kind: LimitKind::Override, axis: None };
        self.phases.extend(standstill(time_s, limit).phases().iter().map(|phase| Phase { start_lu: at_lu, ..*phase }));
        self.now_s += time_s;
    }
}
