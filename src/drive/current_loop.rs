//! Current controller: PI with voltage limit and conditional anti-windup (models/drive.md section 4, step 3).
//!
//! In: current error. Out: [`VoltageCommand`], held for a current cycle. Field weakening and the transformation to two phases
//! are not modelled: one rms phase stands for the motor.

use super::limit::limited;
use crate::machine::DriveData;

/// Output of the current controller.
#[derive(Clone, Copy, Debug)]
pub(super) struct VoltageCommand {
    /// u.
    pub(super) voltage_v: f64,
    /// The voltage limit holds.
    pub(super) clamped: bool,
}

/// The boxes "PI Kpi, Tni" and "clamp ±u_max".
#[derive(Clone, Copy, Debug)]
pub(super) struct CurrentLoop {
    /// Kpi.
    pub(super) gain_v_per_a: f64,
    /// Kpi T_i / Tni.
    pub(super) integral_gain_v_per_a: f64,
    /// u_max.
    pub(super) voltage_max_v: f64,
    /// Ii.
    pub(super) integral_v: f64,
}

impl CurrentLoop {
    pub(super) fn new(data: &DriveData, period_s: f64, integral_v: f64) -> Self {
        Self {
            gain_v_per_a: data.current_gain_v_per_a,
            integral_gain_v_per_a: data.current_gain_v_per_a * period_s / data.current_reset_time_s,
            voltage_max_v: data.voltage_max_v,
            integral_v,
        }
    }

    /// One current cycle.
    #[inline(always)]
    pub(super) fn step(&mut self, current_error_a: f64) -> VoltageCommand {
        let increment_v = self.integral_gain_v_per_a * current_error_a;
        let wanted_v = self.gain_v_per_a * current_error_a + (self.integral_v + increment_v);
        let voltage_v = limited(wanted_v, self.voltage_max_v);
        let clamped = wanted_v.abs() > self.voltage_max_v;
        // Anti-windup as in the speed loop.
        let integrates = !clamped | (current_error_a * wanted_v < 0.0);
        self.integral_v += if integrates { increment_v } else { 0.0 };
        VoltageCommand { voltage_v, clamped }
    }

    /// What the box remembers from cycle to cycle.
    pub(super) fn memory<'a>(&'a mut self, list: &mut Vec<&'a mut f64>) {
        // Without an integral part (Tni infinite) the integral is a constant.
        if self.integral_gain_v_per_a != 0.0 {
            list.push(&mut self.integral_v);
        }
    }

    /// The integral is a number.
    pub(super) fn is_finite(&self) -> bool {
        self.integral_v.is_finite()
    }
}
