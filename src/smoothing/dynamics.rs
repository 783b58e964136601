//! How far a corner must be rounded so that the axes can pass it at the programmed feed: G644.
//!
//! In: the machine, the two blocks. Out: [`Dynamics`]: the feed that both blocks have at the corner, and what of its acceleration and
//! jerk each axis may spend on the bend. A blend of length T passed at the feed F asks for `F² |q''|` and `F³ |q'''|`; between two lines
//! these fall with T and T², so that there is a shortest T at which the corner costs no time. The control says that G644 does not use
//! the tolerance up where the dynamics do not need it; how it measures that is not published.
//!
//! Does not plan the feed: where even the tolerance is not enough, the planner slows down.

use super::corner::Side;
use super::smoother::lower;
use crate::base::Portable;
use crate::base::{AxisId, AxisVector, PerAxis};
use crate::geometry::{Curve, CurveState};
use crate::interpreter::{Feed, Modes};
use crate::machine::{AccelerationMode, Machine, TimeLawKind};

/// A blend is no shorter than this: a feed so low that less would do is no reason for a bend that no control resolves.
pub(super) const LENGTH_MIN_LU: f64 = 1e-4;

/// Samples along a sharp blend.
const CROSSING_SAMPLES: usize = 128;

/// Feed at a corner and what the axes can do there.
#[derive(Clone, Debug)]
pub(super) struct Dynamics {
    /// The lower feed of the two blocks, no more than the velocities of the axes allow on either.
    speed_lu_s: f64,
    /// For the bend; infinite where an axis has no limit.
    acceleration_lu_s2: PerAxis<f64>,
    jerk_lu_s3: PerAxis<f64>,
    /// About what it takes to come to rest from the feed and to go on.
    stop_s: f64,
}

impl Dynamics {
    /// At the corner from `before` to `after`, whose states there are `ends`.
    pub(super) fn new(machine: &Machine, before: &Side<'_>, after: &Side<'_>, ends: [&CurveState; 2]) -> Self {
        let modes = before.modes;
        let mut speed_lu_s = match lower(before.feed, after.feed) {
            Feed::Rapid => f64::INFINITY,
            Feed::Path { feed_lu_s } => feed_lu_s * over(modes),
            Feed::Varying { feeds_lu_s } => feeds_lu_s.iter().copied().fold(f64::INFINITY, f64::min) * over(modes),
        };
        // The planner divides acceleration and jerk between path and bend, but for the law that needs no shares.
        let shared = machine.feed.time_law != TimeLawKind::Continuous;
        let share = |share: f64| if shared { share } else { 1.0 };
        let acceleration_share = share(machine.smoothing.radial_acceleration_share);
        let jerk_share = share(machine.smoothing.radial_jerk_share);
        let mut dynamics = Self {
            speed_lu_s,
            acceleration_lu_s2: PerAxis::splat(f64::INFINITY),
            jerk_lu_s3: PerAxis::splat(f64::INFINITY),
            stop_s: 0.0,
        };
        let (mut braking_lu_s2, mut braking_lu_s3) = (f64::INFINITY, f64::INFINITY);
        for id in machine.axis_ids() {
            let limits = limits(machine, id, modes);
            let along = ends[0].first[id].abs().max(ends[1].first[id].abs());
            if along > 0.0 {
                speed_lu_s = speed_lu_s.min(limits.velocity_lu_s / along);
                braking_lu_s2 = braking_lu_s2.min(limits.acceleration_lu_s2 / along);
                braking_lu_s3 = braking_lu_s3.min(limits.jerk_lu_s3 / along);
            }
            dynamics.acceleration_lu_s2[id] = acceleration_share * limits.acceleration_lu_s2;
            if modes.acceleration_mode == AccelerationMode::Soft {
                dynamics.jerk_lu_s3[id] = jerk_share * limits.jerk_lu_s3;
            }
        }
        dynamics.speed_lu_s = speed_lu_s;
        dynamics.stop_s = 2.0 * (speed_lu_s / braking_lu_s2 + braking_lu_s2 / braking_lu_s3);
        dynamics
    }

    /// The shortest T of a blend that has, for T = 1, these greatest derivatives of each axis, and that falls off as between lines.
    pub(super) fn needed_lu(&self, second: &AxisVector, third: &AxisVector) -> f64 {
        let v = self.speed_lu_s;
        let needed = |axis: AxisId| {
            let bend = v * v * second[axis].abs() / self.acceleration_lu_s2[axis];
            let turn = v * (v * third[axis].abs() / self.jerk_lu_s3[axis]).sqrt();
            bend.max(turn)
        };
        AxisId::first(crate::base::AXES_MAX).map(needed).fold(LENGTH_MIN_LU, f64::max)
    }

    /// To come to rest in the corner takes less time than to cross the curve at the speed that its sharpest place allows.
    pub(super) fn stop_is_quicker(&self, curve: &Curve) -> bool {
        let length_lu = curve.length_lu();
        let demand = |i: usize| {
            let state = curve.at(length_lu * i as f64 / CROSSING_SAMPLES as f64);
            let slowness = |axis: AxisId| {
                let bend = (state.second[axis].abs() / self.acceleration_lu_s2[axis]).sqrt();
                bend.max((state.third[axis].abs() / self.jerk_lu_s3[axis]).portable_cbrt())
            };
            AxisId::first(crate::base::AXES_MAX).map(slowness).fold(0.0, f64::max)
        };
        let slowest_s_per_lu = (0..=CROSSING_SAMPLES).map(demand).fold(0.0, f64::max);
        length_lu * slowest_s_per_lu > self.stop_s
    }

    /// Greatest share of what an axis may spend that these derivatives take at the feed.
    pub(super) fn share(&self, second: &AxisVector, third: &AxisVector) -> f64 {
        let v = self.speed_lu_s;
        let share = |axis: AxisId| {
            let bend = v * v * second[axis].abs() / self.acceleration_lu_s2[axis];
            let turn = v * v * v * third[axis].abs() / self.jerk_lu_s3[axis];
            bend.max(turn)
        };
        AxisId::first(crate::base::AXES_MAX).map(share).fold(0.0, f64::max)
    }
}

/// OVR.
fn over(modes: &Modes) -> f64 {
    modes.programmed.as_ref().map_or(1.0, |limits| limits.override_ratio)
}

/// What one axis may do.
struct Limits {
    velocity_lu_s: f64,
    acceleration_lu_s2: f64,
    jerk_lu_s3: f64,
}

/// Those of the dynamics set, with ACC, VELOLIM and JERKLIM.
fn limits(machine: &Machine, id: AxisId, modes: &Modes) -> Limits {
    let axis = machine.axis(id);
    let limits = axis.dynamics.get(modes.dynamics).unwrap_or(&axis.limits);
    let ratio = |of: fn(&crate::interpreter::ProgrammedLimits) -> &PerAxis<f64>| {
        modes.programmed.as_deref().map_or(1.0, |limits| of(limits)[id])
    };
    Limits {
        velocity_lu_s: limits.velocity_max_lu_s * ratio(|limits| &limits.velocity_ratio),
        acceleration_lu_s2: limits.acceleration_max_lu_s2 * ratio(|limits| &limits.acceleration_ratio),
        jerk_lu_s3: limits.transition_jerk_max_lu_s3 * ratio(|limits| &limits.jerk_ratio),
    }
}
