//! Limits of the axes for the modes of each piece.
//!
//! In: the machine, the [`Modes`] of a piece. Out: [`AxisRules`], shared by all pieces under the same modes: made again only when a
//! word has changed the acceleration mode, the dynamics set, or what is programmed about the axes. Does not look at curves.

use super::limits::AxisRules;
use crate::interpreter::{Modes, ProgrammedLimits};
use crate::machine::{AccelerationMode, DynamicsMode, Machine};
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
