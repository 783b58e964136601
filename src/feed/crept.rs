//! Blends that `seven-phase` crosses more slowly than a stop in the corner would take.
//!
//! In: blends with their laws. Out: one warning about all of them. The law holds the feed of the sharpest bend over the whole blend
//! (models/local-smoothing.md section 3), and where the path almost turns back that is next to nothing: the radius goes with the square of the cosine of half the
//! turning angle. Does not plan.

use super::junction::STOP;
use super::limits::{AxisRules, FeedCap};
use super::profile::{Bounds, SpeedCap, Stretch, seven_phases};
use super::ramp::Dynamics;
use super::{Limit, LimitKind};
use crate::base::Diagnostic;
use crate::geometry::Curve;
use crate::kinematics::JointPath;
use crate::machine::AxisLimits;
use crate::program::BlockRef;

/// So many times the time of a stop, and so much more than it, are worth telling.
const CREPT_RATIO: f64 = 3.0;
const LOST_MIN_S: f64 = 0.05;

/// The blends of a run that were told of, or will be.
#[derive(Clone, Debug, Default)]
pub(super) struct Crept {
    blends: u64,
    lost_s: f64,
    worst: Option<Worst>,
}

#[derive(Clone, Copy, Debug)]
struct Worst {
    block: BlockRef,
    crossed_s: f64,
    stop_s: f64,
}

impl Crept {
    /// A blend, and the time that it takes.
    pub(super) fn crossed(&mut self, rules: &AxisRules, path: &JointPath, crossed_s: f64) {
        let Some(curve) = path.contour.curve().filter(|_| crossed_s > LOST_MIN_S) else { return };
        let stop_s = stop_s(rules, path, curve);
        if !(crossed_s > CREPT_RATIO * stop_s && crossed_s - stop_s > LOST_MIN_S) {
            return;
        }
        self.blends += 1;
        self.lost_s += crossed_s - stop_s;
        if self.worst.is_none_or(|worst| crossed_s > worst.crossed_s) {
            self.worst = Some(Worst { block: path.contour.block, crossed_s, stop_s });
        }
    }

    /// What a person should know about all of them, with the block that ends in the worst corner.
    pub(super) fn warning(&self) -> Option<(BlockRef, Diagnostic)> {
        let Worst { block, crossed_s, stop_s } = self.worst?;
        let Self { blends, lost_s, .. } = self;
        let line = block.line;
        let worst =
            format!("at the end of line {line}: {crossed_s:.2} s, where a stop in the corner would take {stop_s:.2} s");
        let message = match blends {
            1 => format!("the law seven-phase creeps through the blend {worst}"),
            _ => format!(
                "the law seven-phase creeps through {blends} blends, {lost_s:.2} s longer than stops in their corners would take; the worst {worst}"
            ),
        };
        let help =
            "give --set feed.time_law=continuous, whose speed follows the bend, or program an exact stop (G9) there";
        Some((block, Diagnostic::warning("P0010", message).help(help)))
    }
}

/// A stop half way, about: from rest to rest over each half, along the direction at its end of the blend.
fn stop_s(rules: &AxisRules, path: &JointPath, curve: &Curve) -> f64 {
    let limit = Limit { kind: LimitKind::LookAhead, axis: None };
    let velocity_lu_s = match rules.feed_cap(&path.contour.feed, curve) {
        FeedCap::Programmed(cap) => cap.velocity_lu_s,
        FeedCap::Rapid => f64::INFINITY,
    };
    let half = |s_lu: f64| {
        let first = path.at(s_lu).first;
        let least = |of: fn(&AxisLimits) -> f64| {
            1.0 / rules.largest(|axis, limits| first[axis].abs() / of(limits)).demand_ratio
        };
        let dynamics = Dynamics {
            acceleration_lu_s2: least(|limits| limits.acceleration_max_lu_s2),
            jerk_lu_s3: rules.jerk_limited.then(|| least(|limits| limits.jerk_max_lu_s3)),
        };
        let velocity_lu_s = velocity_lu_s.min(least(|limits| limits.velocity_max_lu_s));
        let cruise = SpeedCap { velocity_lu_s, limit };
        let stretch = Stretch { length_lu: 0.5 * curve.length_lu(), entry: STOP, exit: STOP };
        seven_phases(&stretch, &Bounds { cruise, dynamics, acceleration: limit, jerk: limit }).duration_s()
    };
    half(0.0) + half(curve.length_lu())
}
