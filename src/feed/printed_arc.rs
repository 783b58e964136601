//! Limits of an arc as the paper prints them (models/arcs.md section 4, rule "printed") [Gassara 2013].
//!
//! In: an arc with its greatest demands and its start, the limits of the axes. Out: [`PieceLimits`]. Velocity and jerk are those of the
//! worst direction met on the arc; the acceleration, tangential and centripetal, is the one that the axes have at the entry of the block,
//! towards the centre:
//!
//! ```text
//! A_t = A_n = min_j A_j / |n_j|      n: unit vector to the centre at the start; no limit where n_j = 0
//! V_An = sqrt(R A_n),  V_Jt = cbrt(J_t R²)
//! ```
//!
//! All of A and J may go to either use: without the shares R_A and R_J of `arc_limits = "worst"`, and with the direction of the start
//! alone, an axis may see more than its limit. That is the point: to compare with the print. An axis outside the plane of a
//! helix, for which nothing is printed, has the acceleration of its share of the path.

use super::LimitKind;
use super::limits::{AxisRules, FeedCap, PieceLimits};
use super::worst::Worst;
use crate::base::AxisId;
use crate::kinematics::JointState;
use crate::machine::AxisLimits;

/// The limits of an arc that begins with `start`.
pub(super) fn limits(
    rules: &AxisRules,
    worst: &Worst,
    start: &JointState,
    feed: FeedCap,
    jerk_limited: bool,
) -> PieceLimits {
    // q'' = k n with the curvature k > 0.
    let k = start.second.norm();
    let entry = |axis: AxisId, limits: &AxisLimits| {
        let across = if k > 0.0 { start.second[axis].abs() / k } else { 0.0 };
        // The acceleration of an axis that does not take part in the circle goes with its share of the path.
        let share = if worst.second(axis) > 0.0 { across } else { worst.first(axis) };
        share / limits.acceleration_max_lu_s2
    };
    let acceleration = rules.largest(entry);
    let jerk = rules.largest(|axis, limits| worst.first(axis) / limits.jerk_max_lu_s3);
    let centripetal = rules.largest(|axis, limits| start.second[axis].abs() / limits.acceleration_max_lu_s2);
    let turning = rules.largest(|axis, limits| worst.third(axis) / limits.jerk_max_lu_s3);
    let driven = rules.driven(feed, |axis| worst.first(axis));
    let mut cap = driven.min(centripetal.cap(LimitKind::RadialAcceleration, 2));
    if jerk_limited {
        cap = cap.min(turning.cap(LimitKind::RadialJerk, 3));
    }
    PieceLimits::new(cap, cap, acceleration, jerk, jerk_limited)
}
