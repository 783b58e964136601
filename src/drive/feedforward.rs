//! Set-point preparation: balancing delay, velocity and torque feed-forward (models/drive.md section 3).
//!
//! In: the set-point of a position cycle. Out: [`Terms`]: reference position, velocity feed-forward, torque feed-forward.
//! Differences are backward ones: no look-ahead. The
//! reference waits for the feed-forward by a dead time (FFW_MODE 3, 4) or in a filter of first order (1, 2).

use super::delay::DelayLine;
use crate::machine::{Balancing, DriveData};
use nalgebra::Complex;

/// What the loops get in one position cycle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Terms {
    /// x_ref.
    pub(super) reference_lu: f64,
    /// v_ff (VFFWS).
    pub(super) velocity_lu_s: f64,
    /// t_ff (TFFWS).
    pub(super) torque_n_m: f64,
    /// v_raw.
    pub(super) set_velocity_lu_s: f64,
}

/// The box between x_set and x_ref.
#[derive(Clone, Debug)]
enum Balance {
    DeadTime(DelayLine),
    /// T y' = x - y as backward Euler has it: a ramp comes out late by exactly T.
    Pt1 {
        share_ratio: f64,
        reference_lu: f64,
    },
}

impl Balance {
    fn new(data: &DriveData, period_s: f64, position_lu: f64) -> Self {
        let time_s = data.setpoint_delay_s;
        match data.options.balancing {
            Balancing::DeadTime => Self::DeadTime(DelayLine::new(time_s, period_s, position_lu)),
            Balancing::Pt1 => Self::Pt1 { share_ratio: period_s / (time_s + period_s), reference_lu: position_lu },
        }
    }

    #[inline(always)]
    fn step(&mut self, setpoint_lu: f64) -> f64 {
        match self {
            Self::DeadTime(line) => line.step(setpoint_lu),
            Self::Pt1 { share_ratio, reference_lu } => {
                *reference_lu += *share_ratio * (setpoint_lu - *reference_lu);
                *reference_lu
            }
        }
    }

    fn response(&self, q: Complex<f64>) -> Complex<f64> {
        match self {
            Self::DeadTime(line) => line.response(q),
            Self::Pt1 { share_ratio, .. } => *share_ratio / (-q * (1.0 - share_ratio) + 1.0),
        }
    }
}

/// The boxes "d/dt", "d²/dt²" and "delay".
#[derive(Clone, Debug)]
pub(super) struct Feedforward {
    period_s: f64,
    /// kvff.
    velocity_weight_ratio: f64,
    /// ktff J_ff / r.
    torque_by_acceleration_n_m_s2_per_lu: f64,
    setpoint_before_lu: f64,
    velocity_before_lu_s: f64,
    setpoint_balance: Balance,
    velocity_delay: DelayLine,
    acceleration_delay: DelayLine,
}

impl Feedforward {
    /// At rest at `position_lu` for all times before.
    pub(super) fn new(data: &DriveData, period_s: f64, position_lu: f64) -> Self {
        let inertia_kg_m2 = data.torque_feedforward_ratio * data.feedforward_inertia_kg_m2;
        Self {
            period_s,
            velocity_weight_ratio: data.velocity_feedforward_ratio,
            torque_by_acceleration_n_m_s2_per_lu: inertia_kg_m2 / data.mechanics.transmission_lu_per_rad,
            setpoint_before_lu: position_lu,
            velocity_before_lu_s: 0.0,
            setpoint_balance: Balance::new(data, period_s, position_lu),
            velocity_delay: DelayLine::new(data.feedforward_delay_s, period_s, 0.0),
            acceleration_delay: DelayLine::new(data.feedforward_delay_s, period_s, 0.0),
        }
    }

    /// From set-point to x_ref, v_ff and t_ff, for a sine with one cycle of delay being `q` = 1/z and feed-forward active.
    pub(super) fn responses(&self, q: Complex<f64>) -> [Complex<f64>; 3] {
        let difference = (-q + 1.0) / self.period_s;
        let velocity = difference * self.velocity_delay.response(q);
        let acceleration = difference * difference * self.acceleration_delay.response(q);
        [
            self.setpoint_balance.response(q),
            velocity * self.velocity_weight_ratio,
            acceleration * self.torque_by_acceleration_n_m_s2_per_lu,
        ]
    }

    /// One position cycle. `active = false` (FFWOF): both weights are 0 in this cycle; the delay lines go on, so that FFWON
    /// finds them filled, and the balancing delay stays.
    #[inline(always)]
    pub(super) fn terms(&mut self, setpoint_lu: f64, active: bool) -> Terms {
        let velocity_lu_s = (setpoint_lu - self.setpoint_before_lu) / self.period_s;
        let acceleration_lu_s2 = (velocity_lu_s - self.velocity_before_lu_s) / self.period_s;
        self.setpoint_before_lu = setpoint_lu;
        self.velocity_before_lu_s = velocity_lu_s;

        let set_velocity_lu_s = velocity_lu_s;
        let reference_lu = self.setpoint_balance.step(setpoint_lu);
        let velocity_lu_s = self.velocity_delay.step(velocity_lu_s) * self.velocity_weight_ratio;
        let torque_n_m = self.acceleration_delay.step(acceleration_lu_s2) * self.torque_by_acceleration_n_m_s2_per_lu;
        if active {
            Terms { reference_lu, velocity_lu_s, torque_n_m, set_velocity_lu_s }
        } else {
            Terms { reference_lu, velocity_lu_s: 0.0, torque_n_m: 0.0, set_velocity_lu_s }
        }
    }
}
