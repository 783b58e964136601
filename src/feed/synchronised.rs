//! Synchronised actions on the feed override, set-point by set-point.
//!
//! In: the actions that begin and end with pieces, what each set-point shows ([`Seen`]). Out: $AC_OVR after it. As on the control it is 100 % in every cycle in
//! which no action writes it; of several the one with the highest number counts. Does not sample and does not plan.

use super::PathState;
use crate::base::PerAxis;
use crate::interpreter::{Condition, Event, SynchronisedAction, Watched};
use crate::kinematics::JointPath;
use crate::program::Cadence;
use std::collections::BTreeMap;
use std::sync::Arc;

/// An action that has begun.
#[derive(Clone, Debug)]
struct Active {
    action: Arc<SynchronisedAction>,
    /// Its condition at the set-point before.
    was_true: bool,
    /// It has happened: the end of WHEN, the start of FROM.
    happened: bool,
}

/// All actions, and how far they have been watched.
#[derive(Clone, Debug, Default)]
pub(super) struct SynchronisedActions {
    modal: BTreeMap<u32, Active>,
    /// Those that end with the block.
    block: Vec<Active>,
    /// The next set-point that has not been looked at.
    pub next_k: u64,
    /// Start of the block, and its way before the piece at hand.
    block_start_s: f64,
    block_way_lu: f64,
}

/// A set-point.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    pub path: &'a JointPath,
    pub state: PathState,
    pub time_s: f64,
    pub setpoint_period_s: f64,
}

impl SynchronisedActions {
    /// A piece begins.
    pub fn begin(&mut self, path: &JointPath, time_s: f64) {
        if path.contour.blocks_begun > 0 {
            self.block.clear();
            (self.block_start_s, self.block_way_lu) = (time_s, 0.0);
        }
        for event in &path.contour.events {
            match event {
                Event::Synchronised(action) => {
                    let active = Active { action: action.clone(), was_true: false, happened: false };
                    match action.id {
                        Some(id) => drop(self.modal.insert(id, active)),
                        None => self.block.push(active),
                    }
                }
                Event::CancelSynchronised(ids) => ids.iter().for_each(|id| drop(self.modal.remove(id))),
                _ => {}
            }
        }
    }

    /// A piece has been handed out.
    pub fn pass(&mut self, path: &JointPath) {
        self.block_way_lu += path.length_lu();
    }

    /// Anything to watch.
    pub fn any(&self) -> bool {
        !self.modal.is_empty() || !self.block.is_empty()
    }

    /// $AC_OVR after a set-point.
    pub fn override_ratio(&mut self, seen: &Seen<'_>) -> f64 {
        let progress = [self.block_start_s, self.block_way_lu];
        let all = self.block.iter_mut().chain(self.modal.values_mut());
        all.filter_map(|active| active.happens(seen, progress).then_some(active.action.override_ratio))
            .last()
            .unwrap_or(1.0)
    }
}

impl Active {
    fn happens(&mut self, seen: &Seen<'_>, progress: [f64; 2]) -> bool {
        let holds = holds(&self.action.condition, seen, progress);
        let was_true = std::mem::replace(&mut self.was_true, holds);
        let happened = self.happened;
        self.happened |= holds;
        match self.action.cadence {
            Cadence::Always => true,
            Cadence::Whenever => holds,
            Cadence::When => holds && !happened,
            Cadence::Every => holds && !was_true,
            Cadence::From => self.happened,
        }
    }
}

fn holds(condition: &Condition, seen: &Seen<'_>, progress: [f64; 2]) -> bool {
    match condition {
        Condition::Constant(value) => *value,
        Condition::Compare(watched, relation, value) => relation.holds(watched_value(*watched, seen, progress), *value),
        Condition::Not(inner) => !holds(inner, seen, progress),
        Condition::All(both) => both.iter().all(|condition| holds(condition, seen, progress)),
        Condition::Any(both) => both.iter().any(|condition| holds(condition, seen, progress)),
    }
}

fn watched_value(watched: Watched, seen: &Seen<'_>, [block_start_s, block_way_lu]: [f64; 2]) -> f64 {
    let Seen { path, state, time_s, setpoint_period_s } = *seen;
    let done_lu = block_way_lu + state.position_lu;
    let whole_lu = path.contour.block_length_lu.unwrap_or(block_way_lu + path.length_lu()).max(done_lu);
    match watched {
        Watched::Position(axis) => positions(path, state.position_lu)[axis],
        Watched::BlockTime => time_s - block_start_s,
        Watched::BlockCycles => ((time_s - block_start_s) / setpoint_period_s).round(),
        Watched::PathShare if whole_lu > 0.0 => done_lu / whole_lu,
        Watched::PathShare => 1.0,
        Watched::WayDone => done_lu,
        Watched::WayLeft => whole_lu - done_lu,
        Watched::PathVelocity => state.velocity_lu_s,
    }
}

fn positions(path: &JointPath, s_lu: f64) -> PerAxis<f64> {
    let posture = path.at(s_lu).position;
    PerAxis::from_fn(|axis| posture.0[axis])
}
