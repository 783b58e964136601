//! Axes that move on their own, and how long the path waits for them.
//!
//! In: the events of a piece when it is fixed, and the time at which it begins. Out: an [`AxisMotion`] for every axis that sets out,
//! from rest to rest in at most seven phases; the time and the axis that a wait is for. Times are sums of planned durations, so that
//! no wire leads back from the interpolator. An axis that is sent on before it has arrived starts its new way when it has: both ways
//! never overlap. Does not touch the path.

use super::limits::axis_limits;
use super::profile::{Bounds, SpeedCap, Stretch, seven_phases};
use super::ramp::Dynamics;
use super::{AxisMotion, Limit, LimitKind};
use crate::base::{AxisId, PerAxis};
use crate::geometry::DISPLACEMENT_MIN_LU;
use crate::interpreter::{AxisPositioning, Event, Modes, ProgrammedLimits};
use crate::machine::{DynamicsMode, Machine, PathMode};
use std::sync::Arc;

/// When each axis has arrived, since the start of the program.
#[derive(Clone, Debug)]
pub(super) struct Arrivals {
    arrival_s: PerAxis<f64>,
}

impl Arrivals {
    pub(super) fn new() -> Self {
        Self { arrival_s: PerAxis::splat(0.0) }
    }

    /// The motions that begin with a piece at `start_s`.
    pub(super) fn set_out(&mut self, machine: &Machine, events: &[Event], start_s: f64) -> Vec<AxisMotion> {
        let mut motions = Vec::new();
        for event in events {
            let Event::Position(positioning) = event else { continue };
            for axis in positioning.axes.iter() {
                if let Some(motion) = self.motion(machine, axis, &positioning.programmed, start_s) {
                    motions.push(motion);
                }
            }
        }
        motions
    }

    fn motion(
        &mut self,
        machine: &Machine,
        positioning: &AxisPositioning,
        programmed: &Option<Arc<ProgrammedLimits>>,
        start_s: f64,
    ) -> Option<AxisMotion> {
        let AxisPositioning { axis, start_lu, end_lu, feed_lu_s, jerk_limited } = *positioning;
        let way_lu = end_lu - start_lu;
        if way_lu.abs() < DISPLACEMENT_MIN_LU || !way_lu.is_finite() {
            return None;
        }
        let delay_s = (self.arrival_s[axis] - start_s).max(0.0);
        let mut modes = Modes::new(PathMode::ExactStop);
        modes.dynamics = DynamicsMode::Norm;
        modes.programmed.clone_from(programmed);
        let limits = axis_limits(machine, axis, &modes);
        let limit = |kind| Limit { kind, axis: Some(axis) };
        let fastest = SpeedCap { velocity_lu_s: limits.velocity_max_lu_s, limit: limit(LimitKind::Velocity) };
        let feed = SpeedCap { velocity_lu_s: feed_lu_s.unwrap_or(f64::INFINITY), limit: limit(LimitKind::Feed) };
        let bounds = Bounds {
            cruise: fastest.min(feed),
            dynamics: Dynamics {
                acceleration_lu_s2: limits.acceleration_max_lu_s2,
                jerk_lu_s3: jerk_limited.then_some(limits.jerk_max_lu_s3),
            },
            acceleration: limit(LimitKind::Acceleration),
            jerk: limit(LimitKind::Jerk),
        };
        let rest = SpeedCap { velocity_lu_s: 0.0, limit: limit(LimitKind::Positioning) };
        let law = seven_phases(&Stretch { length_lu: way_lu.abs(), entry: rest, exit: rest }, &bounds);
        let motion = AxisMotion { axis, way_lu, delay_s, law };
        self.arrival_s[axis] = start_s + motion.arrival_s();
        Some(motion)
    }

    /// How long a wait for `axes` lasts that begins at `start_s`, and the axis that arrives last.
    pub(super) fn wait(&self, machine: &Machine, axes: &PerAxis<bool>, start_s: f64) -> (f64, Limit) {
        let mut last: (f64, Option<AxisId>) = (0.0, None);
        for id in machine.axis_ids().filter(|id| axes[*id]) {
            let wait_s = self.arrival_s[id] - start_s;
            if wait_s > last.0 {
                last = (wait_s, Some(id));
            }
        }
        (last.0, Limit { kind: LimitKind::Positioning, axis: last.1 })
    }
}
