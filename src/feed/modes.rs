//! Limits of the axes for the modes of each piece.
//!
//! In: the machine, the [`Modes`] of a piece. Out: [`AxisRules`], shared by all pieces under the same modes: made again only when a
//! word has changed the acceleration mode, the dynamics set, or what is programmed about the axes. Does not look at curves.

use super::limits::AxisRules;
use crate::interpreter::{Modes, ProgrammedLimits};
use crate::kinematics::JointState;
use crate::machine::{AccelerationMode, AxisLimits, DynamicsMode, Machine};
use std::sync::Arc;

/// The rules of the modes that were asked for last.
#[derive(Clone, Debug)]
pub(super) struct ModeRules {
    machine: Arc<Machine>,
    last: Option<(Key, Arc<AxisRules>)>,
}

/// What the limits depend on.
#[derive(Clone, Debug)]
struct Key {
    acceleration_mode: AccelerationMode,
    dynamics: DynamicsMode,
    programmed: Option<Arc<ProgrammedLimits>>,
}

impl ModeRules {
    pub(super) fn new(machine: &Machine) -> Self {
        Self { machine: Arc::new(machine.clone()), last: None }
    }

    /// The machine.
    pub(super) fn machine(&self) -> &Arc<Machine> {
        &self.machine
    }

    /// The first axis that takes part in a path that begins with `start` and has a limit of 0 or none, in words; `None` where all
    /// can move. The check of a machine file lets none of these through.
    pub(super) fn blocked_axis(&self, rules: &AxisRules, start: &JointState) -> Option<String> {
        let moving = self.machine.axis_ids().zip(&rules.axes).filter(|(id, _)| start.first[*id] != 0.0);
        let named = moving.flat_map(|(id, limits)| {
            let AxisLimits { velocity_max_lu_s, acceleration_max_lu_s2, jerk_max_lu_s3, transition_jerk_max_lu_s3 } =
                *limits;
            [
                (id, velocity_max_lu_s, "velocity"),
                (id, acceleration_max_lu_s2, "acceleration"),
                (id, jerk_max_lu_s3, "jerk"),
                (id, transition_jerk_max_lu_s3, "transition jerk"),
            ]
        });
        let mut blocked = named.filter(|(_, limit, _)| limit.is_nan() || *limit <= 0.0);
        blocked.next().map(|(id, _, what)| format!("axis {} has no {what}", self.machine.axis(id).name))
    }

    /// The first axis that does not allow `speed_lu_s` along a path that goes on as in `state`, in words.
    pub(super) fn slow_axis(&self, rules: &AxisRules, state: &JointState, speed_lu_s: f64) -> Option<String> {
        let demands = self.machine.axis_ids().zip(&rules.axes).flat_map(|(id, limits)| {
            let demand = |derivative: f64, power: i32| derivative.abs() * speed_lu_s.powi(power);
            [
                (id, demand(state.first[id], 1) > limits.velocity_max_lu_s, "velocity"),
                (id, demand(state.second[id], 2) > limits.acceleration_max_lu_s2, "acceleration"),
                (id, demand(state.third[id], 3) > limits.jerk_max_lu_s3, "jerk"),
            ]
        });
        let mut slow = demands.filter(|(_, exceeded, _)| *exceeded);
        slow.next().map(|(id, _, what)| format!("the {what} of axis {} holds it", self.machine.axis(id).name))
    }

    /// The rules under `modes`.
    pub(super) fn of(&mut self, modes: &Modes) -> Arc<AxisRules> {
        if let Some((key, rules)) = &self.last
            && key.holds(modes)
        {
            return rules.clone();
        }
        let rules = Arc::new(AxisRules::new(&self.machine, modes));
        let Modes { acceleration_mode, dynamics, programmed, .. } = modes;
        let key = Key { acceleration_mode: *acceleration_mode, dynamics: *dynamics, programmed: programmed.clone() };
        self.last = Some((key, rules.clone()));
        rules
    }
}

impl Key {
    fn holds(&self, modes: &Modes) -> bool {
        let programmed = match (&self.programmed, &modes.programmed) {
            (None, None) => true,
            (Some(before), Some(now)) => Arc::ptr_eq(before, now),
            _ => false,
        };
        programmed && self.acceleration_mode == modes.acceleration_mode && self.dynamics == modes.dynamics
    }
}
