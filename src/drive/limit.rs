//! The clamp at the output of a controller.
//!
//! In: a value and a symmetric bound (may be infinite). Out: the bounded value. NaN passes through, so that a diverged axis is
//! seen by [`AxisDrive::is_finite`](super::AxisDrive::is_finite) and not hidden behind a limit, as `f64::max` would.

/// `value` within ±`bound`, in the unit of both. Unlike `f64::clamp` it never panics.
#[inline(always)]
pub(super) fn limited(value: f64, bound: f64) -> f64 {
    let below = if value > bound { bound } else { value };
    if below < -bound { -bound } else { below }
}
