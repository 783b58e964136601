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

/// The boxes "PI Kp, Tn" and "clamp ±Kt i_max".
#[derive(Clone, Copy, Debug)]
pub(super) struct SpeedLaw {
    /// Kp.
    pub(super) gain_n_m_s_per_rad: f64,
    /// Kp T_v / Tn.
    pub(super) integral_gain_n_m_s_per_rad: f64,
    /// Kt i_max, or p1520 where that is less.
    pub(super) torque_upper_n_m: f64,
    /// -Kt i_max, or p1521.
    pub(super) torque_lower_n_m: f64,
    /// Iv.
    pub(super) integral_n_m: f64,
}

/// The law between its filters, and "/Kt".
#[derive(Clone, Debug)]
pub(super) struct SpeedLoop {
    pub(super) law: SpeedLaw,
    /// Kt.
    pub(super) torque_constant_n_m_per_a: f64,
    /// p1414.
    speed_filter: Chain,
    /// p1433.
    reference_model: Option<Section>,
    /// p1656.
    current_filter: Chain,
}

impl SpeedLaw {
    /// One speed cycle: t_ref, and whether a limit holds.
    #[inline(always)]
    pub(super) fn step(
        &mut self,
        speed_error_rad_s: f64,
        integral_error_rad_s: f64,
        torque_feedforward_n_m: f64,
    ) -> (f64, bool) {
        let increment_n_m = self.integral_gain_n_m_s_per_rad * integral_error_rad_s;
        let proportional_n_m = self.gain_n_m_s_per_rad * speed_error_rad_s;
        // Backward Euler: the new error is already in the integral.
        let wanted_n_m = proportional_n_m + self.integral_n_m + increment_n_m + torque_feedforward_n_m;
        // Written so that NaN passes through, as in `limit`.
        let above = wanted_n_m > self.torque_upper_n_m;
        let below = wanted_n_m < self.torque_lower_n_m;
        let torque_n_m = if above { self.torque_upper_n_m } else { wanted_n_m };
        let torque_n_m = if below { self.torque_lower_n_m } else { torque_n_m };
        let clamped = above | below;
        // Anti-windup: at the limit the integral only moves away from it.
        let side = if above { 1.0 } else { -1.0 };
        let integrates = !clamped | (integral_error_rad_s * side < 0.0);
        self.integral_n_m += if integrates { increment_n_m } else { 0.0 };
        (torque_n_m, clamped)
    }
}

impl SpeedLoop {
    pub(super) fn new(data: &DriveData, period_s: f64, integral_n_m: f64) -> Self {
        let kt = data.motor.torque_constant_n_m_per_a;
        Self {
            law: SpeedLaw {
                gain_n_m_s_per_rad: data.speed_gain_n_m_s_per_rad,
                // Tn = infinity: no integral part, the product is 0.
                integral_gain_n_m_s_per_rad: data.speed_gain_n_m_s_per_rad * period_s / data.speed_reset_time_s,
                torque_upper_n_m: data.options.torque_upper_n_m.min(kt * data.current_max_a),
                torque_lower_n_m: data.options.torque_lower_n_m.max(-kt * data.current_max_a),
                integral_n_m,
            },
            torque_constant_n_m_per_a: kt,
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
        let (torque_n_m, clamped) = self.law.step(speed_error_rad_s, integral_error_rad_s, torque_feedforward_n_m);
        let current_a = self.current_filter.step(torque_n_m / self.torque_constant_n_m_per_a);
        TorqueCommand { torque_n_m, current_a, clamped }
    }

    /// What the box remembers from cycle to cycle.
    pub(super) fn memory<'a>(&'a mut self, list: &mut Vec<&'a mut f64>) {
        // Without an integral part (Tn infinite) the integral is a constant.
        if self.law.integral_gain_n_m_s_per_rad != 0.0 {
            list.push(&mut self.law.integral_n_m);
        }
        self.speed_filter.memory(list);
        if let Some(model) = &mut self.reference_model {
            model.memory(list);
        }
        self.current_filter.memory(list);
    }

    /// Neither filter nor reference model: the law is all there is.
    pub(super) fn is_plain(&self) -> bool {
        self.speed_filter.is_empty() && self.reference_model.is_none() && self.current_filter.is_empty()
    }

    /// The integral is a number.
    pub(super) fn is_finite(&self) -> bool {
        self.law.integral_n_m.is_finite()
    }
}
