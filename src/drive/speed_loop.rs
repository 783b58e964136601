//! Speed controller: PI with torque feed-forward, torque limit and conditional anti-windup (models/drive.md section 4, step 2).
//!
//! In: speed reference and measured speed, torque feed-forward. Out: [`TorqueCommand`], held for a speed cycle. With a reference model
//! (p1433) the integral part sees the reference as the model of the closed loop follows it, so that it need not overshoot. Filters
//! stand on either side: that of the speed set-point (p1414), those of the current set-point behind the limit (p1656).

use super::filter::{Chain, Section};
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
    /// Kt i_max, or p1520 where that is less.
    torque_upper_n_m: f64,
    /// -Kt i_max, or p1521.
    torque_lower_n_m: f64,
    /// Kt.
    torque_constant_n_m_per_a: f64,
    /// Iv.
    integral_n_m: f64,
    /// p1414.
    speed_filter: Chain,
    /// p1433.
    reference_model: Option<Section>,
    /// p1656.
    current_filter: Chain,
}

impl SpeedLoop {
    pub(super) fn new(data: &DriveData, period_s: f64, integral_n_m: f64) -> Self {
        let kt = data.motor.torque_constant_n_m_per_a;
        Self {
            gain_n_m_s_per_rad: data.speed_gain_n_m_s_per_rad,
            // Tn = infinity: no integral part, the product is 0.
            integral_gain_n_m_s_per_rad: data.speed_gain_n_m_s_per_rad * period_s / data.speed_reset_time_s,
            torque_upper_n_m: data.options.torque_upper_n_m.min(kt * data.current_max_a),
            torque_lower_n_m: data.options.torque_lower_n_m.max(-kt * data.current_max_a),
            torque_constant_n_m_per_a: kt,
            integral_n_m,
            speed_filter: Chain::new(&[data.options.speed_filter], period_s, 0.0),
            reference_model: Section::new(&data.options.reference_model, period_s, 0.0),
            current_filter: Chain::new(&data.options.current_filters, period_s, integral_n_m / kt),
        }
    }

    /// One speed cycle.
    #[inline]
    pub(super) fn step(
        &mut self,
        reference_rad_s: f64,
        measured_rad_s: f64,
        torque_feedforward_n_m: f64,
    ) -> TorqueCommand {
        let reference_rad_s = self.speed_filter.step(reference_rad_s);
        let speed_error_rad_s = reference_rad_s - measured_rad_s;
        let integral_error_rad_s = match &mut self.reference_model {
            Some(model) => model.step(reference_rad_s) - measured_rad_s,
            None => speed_error_rad_s,
        };
        let increment_n_m = self.integral_gain_n_m_s_per_rad * integral_error_rad_s;
        let proportional_n_m = self.gain_n_m_s_per_rad * speed_error_rad_s;
        // Backward Euler: the new error is already in the integral.
        let wanted_n_m = proportional_n_m + self.integral_n_m + increment_n_m + torque_feedforward_n_m;
        // Written so that NaN passes through, as in `limit`.
        let above = wanted_n_m > self.torque_upper_n_m;
        let below = wanted_n_m < self.torque_lower_n_m;
        let torque_n_m = if above { self.torque_upper_n_m } else { wanted_n_m };
        let torque_n_m = if below { self.torque_lower_n_m } else { torque_n_m };
        let clamped = above || below;
        // Anti-windup: at the limit the integral only moves away from it.
        let side = if above { 1.0 } else { -1.0 };
        let integrates = !clamped || integral_error_rad_s * side < 0.0;
        self.integral_n_m += if integrates { increment_n_m } else { 0.0 };
        let current_a = self.current_filter.step(torque_n_m / self.torque_constant_n_m_per_a);
        TorqueCommand { torque_n_m, current_a, clamped }
    }

    /// What the box remembers from cycle to cycle.
    pub(super) fn memory<'a>(&'a mut self, list: &mut Vec<&'a mut f64>) {
        list.push(&mut self.integral_n_m);
        self.speed_filter.memory(list);
        if let Some(model) = &mut self.reference_model {
            model.memory(list);
        }
        self.current_filter.memory(list);
    }

    /// The integral is a number.
    pub(super) fn is_finite(&self) -> bool {
        self.integral_n_m.is_finite()
    }
}
