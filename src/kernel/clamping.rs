//! Clamped axes: a deviation from the place of the clamp is alarm 26000 (MD36050).
//!
//! In: the M functions of pieces as they begin, the rows of every position tick. Out: the alarm. The clamp holds from the set-point of its M function on,
//! at the place that the axis then measures; its holding torque is not modelled: the drive goes on controlling. Does not watch axes without a drive.

use super::alarms::unclamped;
use super::cycle::AxisRow;
use crate::base::{AxisId, Diagnostic, PerAxis};
use crate::interpolator::Begun;
use crate::interpreter::Event;
use crate::machine::Machine;

/// Whether an axis is clamped.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Clamp {
    Open,
    /// From the next position tick on.
    Closing,
    /// Where it was measured.
    Closed {
        at_lu: f64,
    },
}

/// All clamps.
#[derive(Clone, Debug)]
pub(super) struct Clamping {
    clamps: PerAxis<Clamp>,
    /// Any axis has M functions.
    any: bool,
}

impl Clamping {
    /// All open.
    pub(super) fn new(machine: &Machine) -> Self {
        let any = machine.axis_ids().any(|axis| functions(machine, axis).is_some());
        Self { clamps: PerAxis::splat(Clamp::Open), any }
    }

    /// Pieces that begin.
    pub(super) fn begin(&mut self, machine: &Machine, begun: &[Begun]) {
        if !self.any {
            return;
        }
        for event in begun.iter().flat_map(|begun| &begun.events) {
            let Event::MFunction(number) = event else { continue };
            for axis in machine.axis_ids() {
                match functions(machine, axis) {
                    Some([clamp, _]) if clamp == *number => self.clamps[axis] = Clamp::Closing,
                    Some([_, release]) if release == *number => self.clamps[axis] = Clamp::Open,
                    _ => {}
                }
            }
        }
    }

    /// A row of a position tick.
    pub(super) fn watch(&mut self, machine: &Machine, line: u32, row: &AxisRow) -> Option<Diagnostic> {
        if !self.any {
            return None;
        }
        let measured_lu = row.signals.position_measured_lu;
        match self.clamps[row.axis] {
            Clamp::Open => None,
            Clamp::Closing => {
                self.clamps[row.axis] = Clamp::Closed { at_lu: measured_lu };
                None
            }
            Clamp::Closed { at_lu } => {
                let drive = machine.axis(row.axis).drive.as_ref()?;
                let away_lu = (measured_lu - at_lu).abs();
                (away_lu > drive.monitoring.clamping_lu).then(|| unclamped(machine, line, row, away_lu))
            }
        }
    }
}

fn functions(machine: &Machine, axis: AxisId) -> Option<[u32; 2]> {
    machine.axis(axis).drive.as_ref()?.monitoring.clamp_m_functions
}
