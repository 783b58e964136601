//! An axis without drive data: actual = set-point.
//!
//! In: set-points. Out: [`AxisSignals`] with zero deviations. Torque, current and voltage stay 0: nothing is known of them.

use super::axis_drive::DriveInput;
use super::wire::AxisSignals;
use crate::base::TimeBase;

/// A drive that follows without error.
#[derive(Clone, Debug)]
pub struct IdealDrive {
    period_s: f64,
    position_before_lu: f64,
}

impl IdealDrive {
    /// At rest at `position_lu`; steps once an interpolator cycle t_s.
    pub fn new(time_base: &TimeBase, position_lu: f64) -> Self {
        Self { period_s: time_base.setpoint_period_s(), position_before_lu: position_lu }
    }

    /// One cycle. The velocity is the backward difference of the position.
    pub fn step(&mut self, input: DriveInput) -> AxisSignals {
        let position_lu = input.position_setpoint_lu;
        let velocity_lu_s = (position_lu - self.position_before_lu) / self.period_s;
        self.position_before_lu = position_lu;
        AxisSignals {
            position_setpoint_lu: position_lu,
            position_reference_lu: position_lu,
            position_actual_lu: position_lu,
            position_measured_lu: position_lu,
            velocity_command_lu_s: velocity_lu_s,
            velocity_actual_lu_s: velocity_lu_s,
            ..AxisSignals::default()
        }
    }

    /// False once a set-point was not a number.
    pub fn is_finite(&self) -> bool {
        self.position_before_lu.is_finite()
    }
}
