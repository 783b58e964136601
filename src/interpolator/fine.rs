//! The fine interpolator: from t_s to the position cycle of an axis (MD33000).
//!
//! In: two neighbouring set-points of an axis. Out: the set-point at each position cycle from the first one on, the second one
//! excluded. The next set-point is planned already, so that no delay is added.
//!
//! * cubic: the Hermite polynomial through position and velocity of both, with its derivatives;
//! * linear: the chord; its slope; the mean acceleration over the cycle; no jerk.
//!
//! At the set-point itself, and where both periods are equal, the set-point passes unchanged.
//! Does not look further than one cycle of the interpolator.

use super::AxisSetpoint;
use crate::machine::{FineInterpolation, Machine};

/// From t_s to one position cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FineInterpolator {
    law: FineInterpolation,
    steps: u64,
    period_s: f64,
}

impl FineInterpolator {
    /// For an axis with a position cycle of `position_cycle_ticks`, a whole fraction of t_s.
    pub fn new(machine: &Machine, position_cycle_ticks: u64) -> Self {
        let time_base = &machine.cycle.time_base;
        let steps = (time_base.ticks_per_setpoint() / position_cycle_ticks.max(1)).max(1);
        Self { law: machine.cycle.fine_interpolation, steps, period_s: time_base.setpoint_period_s() }
    }

    /// Position cycles in one cycle of the interpolator.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Set-point `step` position cycles after `from`; `to` is one t_s after `from`.
    pub fn at(&self, from: &AxisSetpoint, to: &AxisSetpoint, step: u64) -> AxisSetpoint {
        if step == 0 {
            return *from;
        }
        let x = step as f64 / self.steps as f64;
        match self.law {
            FineInterpolation::Linear => self.linear(from, to, x),
            FineInterpolation::Cubic => self.cubic(from, to, x),
        }
    }

    fn linear(&self, from: &AxisSetpoint, to: &AxisSetpoint, share: f64) -> AxisSetpoint {
        let way_lu = to.position_lu - from.position_lu;
        AxisSetpoint {
            position_lu: from.position_lu + share * way_lu,
            velocity_lu_s: way_lu / self.period_s,
            acceleration_lu_s2: (to.velocity_lu_s - from.velocity_lu_s) / self.period_s,
            jerk_lu_s3: 0.0,
        }
    }

    /// `p0 + h (v0 x + b x² + c x³)` with x = t/h, from p1, v1 at x = 1.
    fn cubic(&self, from: &AxisSetpoint, to: &AxisSetpoint, share: f64) -> AxisSetpoint {
        let (x, h) = (share, self.period_s);
        let (v0, v1) = (from.velocity_lu_s, to.velocity_lu_s);
        let slope = (to.position_lu - from.position_lu) / h;
        let b = 3.0 * slope - 2.0 * v0 - v1;
        let c = v0 + v1 - 2.0 * slope;
        AxisSetpoint {
            position_lu: from.position_lu + h * x * (v0 + x * (b + x * c)),
            velocity_lu_s: v0 + x * (2.0 * b + x * 3.0 * c),
            acceleration_lu_s2: (2.0 * b + 6.0 * c * x) / h,
            jerk_lu_s3: 6.0 * c / (h * h),
        }
    }
}
