//! What a junction between two pieces allows.
//!
//! In: the ends of two neighbours. Out: the highest speed from one to the other, and why. Two rules: at a corner that is left
//! unrounded (G64) no axis may step its velocity by more than its corner step (models/feed-prediction-and-surface.md section 2
//! [Lavernhe 2008]); where the direction is continuous and the curvature is not, no axis may step its acceleration by more than
//! its transition jerk makes in one cycle (models/arcs.md section 5 [Gassara 2013]). The ends of blends are exempt from the second
//! rule: their change of curvature is there by construction, and the published feeds rest on that.
//! Does not look further than the junction: braking is the planner's.

use super::limits::{AxisRules, Ends};
use super::profile::SpeedCap;
use super::{Limit, LimitKind, TimeLaw};
use crate::base::AxisVector;
use crate::machine::CurvatureJump;
use std::sync::Arc;

/// Directions that differ by less are one direction: suits points rounded to 0.01 mm (models/arcs.md section 2).
const TANGENT_RAD: f64 = 1e-3;

/// The path rests here.
pub(super) const STOP: SpeedCap = SpeedCap { velocity_lu_s: 0.0, limit: Limit { kind: LimitKind::Corner, axis: None } };

/// Nothing binds here.
pub(super) const FREE: SpeedCap =
    SpeedCap { velocity_lu_s: f64::INFINITY, limit: Limit { kind: LimitKind::Feed, axis: None } };

/// A junction is reached with this share of its speed: plans keep a little off it.
const REACHED_SHARE: f64 = 0.998;

/// The limit of a junction that a motion from it begins with.
pub(super) fn holding(junction: SpeedCap, law: &TimeLaw) -> Option<Limit> {
    let moves = junction.velocity_lu_s > 0.0 && junction.velocity_lu_s.is_finite();
    (moves && law.at(0.0).velocity_lu_s >= REACHED_SHARE * junction.velocity_lu_s).then_some(junction.limit)
}

/// Highest speed from `before` to `after`: where their modes differ, both have to allow it.
pub(super) fn cap(rules: [&Arc<AxisRules>; 2], before: &Ends, after: &Ends) -> SpeedCap {
    let cap = cap_under(rules[0], before, after);
    if Arc::ptr_eq(rules[0], rules[1]) { cap } else { cap.min(cap_under(rules[1], before, after)) }
}

fn cap_under(rules: &AxisRules, before: &Ends, after: &Ends) -> SpeedCap {
    if before.rotary_only != after.rotary_only {
        // Speed changes its unit: mm/s on one side, rad/s on the other.
        return STOP;
    }
    let turn = after.start.first - before.end.first;
    let corner = rules.largest(|axis, _| turn[axis].abs() / rules.corner_steps_lu_s[axis.index()]);
    let corner = corner.cap(LimitKind::Corner, 1);
    if before.blend || after.blend || turn.norm() > TANGENT_RAD {
        return corner;
    }
    let jump = match rules.curvature_jump {
        CurvatureJump::Signed => after.start.second - before.end.second,
        CurvatureJump::Printed => printed_jump(&before.end.second, &after.start.second),
    };
    let step = |limit_lu_s3: f64| limit_lu_s3 * rules.setpoint_period_s;
    let jump = rules.largest(|axis, limits| jump[axis].abs() / step(limits.transition_jerk_max_lu_s3));
    corner.min(jump.cap(LimitKind::TransitionJerk, 2))
}

/// The difference of the amounts of two curvatures, along the greater one: the divisor as printed, which is too small for arcs of
/// opposite sense.
fn printed_jump(before: &AxisVector, after: &AxisVector) -> AxisVector {
    let (k1, k2) = (before.norm(), after.norm());
    let (greater, k) = if k2 > k1 { (after, k2) } else { (before, k1) };
    if k > 0.0 { *greater * ((k2 - k1).abs() / k) } else { AxisVector::zero() }
}
