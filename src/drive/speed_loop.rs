//! Speed controller: PI with torque feed-forward, torque limit and conditional anti-windup (models/drive.md section 4, step 2).
//!
//! In: speed error, torque feed-forward. Out: [`TorqueCommand`], held for a speed cycle.

use super::limit::limited;
use crate::machine::DriveData;

/// Output of the speed controller.
#[derive(Clone, Copy, Debug)]
pub(super) struct TorqueCommand {
    /// t_ref.
    pub(super) torque_n_m: f64,
    /// i_ref.
    pub(super) current_a: f64,
    /// The current limit holds.
    pub(super) clamped: bool,
}

/// The boxes "PI Kp, Tn", "clamp ±Kt i_max" and "/Kt".
#[derive(Clone, Debug)]
pub(super) struct SpeedLoop {
    /// Kp.
    gain_n_m_s_per_rad: f64,
    /// Kp T_v / Tn.
    integral_gain_n_m_s_per_rad: f64,
    /// Kt i_max.
    torque_max_n_m: f64,
    /// Kt.
    torque_constant_n_m_per_a: f64,
    /// Iv.
    integral_n_m: f64,
}

impl SpeedLoop {
    pub(super) fn new(data: &DriveData, period_s: f64, integral_n_m: f64) -> Self {
        let kt = data.motor.torque_constant_n_m_per_a;
        Self {
            gain_n_m_s_per_rad: data.speed_gain_n_m_s_per_rad,
            // Tn = infinity: no integral part, the product is 0.
            integral_gain_n_m_s_per_rad: data.speed_gain_n_m_s_per_rad * period_s / data.speed_reset_time_s,
            torque_max_n_m: kt * data.current_max_a,
            torque_constant_n_m_per_a: kt,
            integral_n_m,
        }
    }

    /// One speed cycle.
    #[inline]
    pub(super) fn step(&mut self, speed_error_rad_s: f64, torque_feedforward_n_m: f64) -> TorqueCommand {
        let increment_n_m = self.integral_gain_n_m_s_per_rad * speed_error_rad_s;
        let proportional_n_m = self.gain_n_m_s_per_rad * speed_error_rad_s;
        // Backward Euler: the new error is already in the integral.
        let wanted_n_m = proportional_n_m + self.integral_n_m + increment_n_m + torque_feedforward_n_m;
        let torque_n_m = limited(wanted_n_m, self.torque_max_n_m);
        let clamped = wanted_n_m.abs() > self.torque_max_n_m;
        // Anti-windup: at the limit the integral only moves away from it.
        let integrates = !clamped || speed_error_rad_s * wanted_n_m < 0.0;
        self.integral_n_m += if integrates { increment_n_m } else { 0.0 };
        TorqueCommand { torque_n_m, current_a: torque_n_m / self.torque_constant_n_m_per_a, clamped }
    }

    /// The integral is a number.
    pub(super) fn is_finite(&self) -> bool {
        self.integral_n_m.is_finite()
    }
}
