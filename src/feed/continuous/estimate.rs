//! The first estimate of b, from which the first tangents are laid.
//!
//! In: intervals. Out: the highest b that the bend allows at constant speed, the highest at the end of a start from rest, and about the
//! fastest rise along the path ([`Pace`]).
//! Does not keep limits: the problem does.

use super::interval::{Derivatives, Interval};
use crate::base::Portable;

/// Rounds for the time of an interval.
const PACE_ROUNDS: usize = 3;

/// About the fastest rise of the speed along the path: the bend is left out.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    acceleration: f64,
}

impl Pace {
    /// Goes on from the moving end of the interval of a start, with b there; backwards from that of a stop.
    pub fn from_rest(interval: &Interval, b_lu2_s2: f64) -> Self {
        Self { acceleration: 0.5 * ray_exponent(interval) * b_lu2_s2 / interval.length_lu() }
    }

    /// Goes on from a state that moves.
    pub fn moving(slope_lu_s2: f64) -> Self {
        Self { acceleration: 0.5 * slope_lu_s2.max(0.0) }
    }

    /// b at the far end of an interval if it is `from` at the near one, at most `cap`.
    pub fn next(&mut self, interval: &Interval, from_lu2_s2: f64, cap_lu2_s2: f64) -> f64 {
        let (from, cap) = (from_lu2_s2, cap_lu2_s2);
        let (mut acceleration, mut jerk) = (f64::INFINITY, f64::INFINITY);
        for bound in &interval.bounds.axes {
            let share = interval.states.iter().fold(0.0_f64, |most, state| most.max(state.first[bound.axis].abs()));
            acceleration = acceleration.min(bound.acceleration_lu_s2 / share);
            jerk = jerk.min(bound.jerk_lu_s3.unwrap_or(f64::INFINITY) / share);
        }
        let (h, v) = (interval.length_lu(), from.sqrt());
        let (mut reached, mut faster) = (v, self.acceleration);
        for _ in 0..PACE_ROUNDS {
            let time_s = 2.0 * h / (v + reached);
            faster = (self.acceleration + jerk * time_s).min(acceleration);
            reached = v + 0.5 * (self.acceleration + faster) * time_s;
        }
        let b = reached * reached;
        if b < cap {
            self.acceleration = faster;
            return b;
        }
        // Held from here on; where the cap rises the speed may go on rising with it.
        self.acceleration = (0.5 * (cap - from) / h).clamp(0.0, acceleration);
        cap
    }
}

/// Highest b that the bend allows at constant speed.
pub(super) fn bend_cap(interval: &Interval, state: &Derivatives) -> f64 {
    let mut b = f64::INFINITY;
    for bound in &interval.bounds.axes {
        let axis = bound.axis;
        b = b.min(interval.reserve_ratio * bound.acceleration_lu_s2 / state.second[axis].abs());
        if let Some(jerk) = bound.jerk_lu_s3 {
            b = b.min((interval.reserve_ratio * jerk / state.third[axis].abs()).portable_powf(2.0 / 3.0));
        }
    }
    b
}

/// Highest b at the moving end of the interval of a start or stop.
pub(super) fn ray_cap(interval: &Interval) -> f64 {
    let h = interval.length_lu();
    let most = |derivative: fn(&Derivatives) -> &crate::base::AxisVector, axis| {
        interval.states.iter().fold(0.0_f64, |most, state| most.max(derivative(state)[axis].abs()))
    };
    let mut b = interval.cap.velocity_lu_s.powi(2);
    let exponent = ray_exponent(interval);
    for bound in &interval.bounds.axes {
        let axis = bound.axis;
        let [first, second, third] =
            [most(|state| &state.first, axis), most(|state| &state.second, axis), most(|state| &state.third, axis)];
        b = b.min(interval.reserve_ratio * bound.acceleration_lu_s2 / (second + 0.5 * exponent * first / h));
        if let Some(jerk) = bound.jerk_lu_s3 {
            // √b (q''' b + 3/2 q'' 4/3 b/h + 1/2 q' 4/9 b/h²)
            let demand = third + 2.0 * second / h + 2.0 / 9.0 * first / (h * h);
            b = b.min((interval.reserve_ratio * jerk / demand).portable_powf(2.0 / 3.0));
        }
    }
    b
}

/// Exponent of b at a rest: constant jerk, constant acceleration under BRISK.
pub(super) fn ray_exponent(interval: &Interval) -> f64 {
    if interval.bounds.jerk_limited { 4.0 / 3.0 } else { 1.0 }
}
