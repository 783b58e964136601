//! The greatest demands of every axis along a curve: |q'|, |q''|, |q'''|.
//!
//! In: an [`Arc`] or [`SpatialArc`], for which they have closed forms, or samples of any other curve (`scan`). Out: [`Worst`]. Does
//! not know limits.

use crate::base::Portable;
use crate::base::{AxisId, AxisVector, PerAxis};
use crate::geometry::{Arc, SpatialArc};
use std::f64::consts::{FRAC_PI_2, PI};

/// Largest |q'|, |q''| and |q'''| of each axis along a curve.
#[derive(Clone, Debug)]
pub(super) struct Worst {
    first: AxisVector,
    second: AxisVector,
    third: AxisVector,
}

impl Worst {
    /// As they are.
    pub(super) fn new(first: AxisVector, second: AxisVector, third: AxisVector) -> Self {
        Self { first, second, third }
    }

    /// Of a curve that nobody has looked at: no numbers.
    pub(super) fn unknown() -> Self {
        let nothing = AxisVector::splat(f64::NAN);
        Self::new(nothing, nothing, nothing)
    }

    /// Over an arc: axis-parallel directions between its ends included.
    pub(super) fn on_arc(arc: &Arc) -> Self {
        let (a, b) = (arc.angle_start_rad(), arc.angle_end_rad());
        let (low, high) = (a.min(b), a.max(b));
        // |cos| is 1 at multiples of pi, |sin| a quarter turn further.
        let meets = |offset_rad: f64| ((low - offset_rad) / PI).ceil() * PI + offset_rad <= high;
        let cos_ratio = if meets(0.0) { 1.0 } else { a.portable_cos().abs().max(b.portable_cos().abs()) };
        let sin_ratio = if meets(FRAC_PI_2) { 1.0 } else { a.portable_sin().abs().max(b.portable_sin().abs()) };
        let (r, w) = (arc.radius_mm().abs(), arc.turn_rate_per_mm().abs());
        let [x, y] = arc.plane();
        let mut worst = Self::new(arc.at(0.0).first.map(f64::abs), AxisVector::zero(), AxisVector::zero());
        for (axis, along, across) in [(x, sin_ratio, cos_ratio), (y, cos_ratio, sin_ratio)] {
            worst.first[axis] = r * w * along;
            worst.second[axis] = r * w.powi(2) * across;
            worst.third[axis] = r * w.powi(3) * along;
        }
        worst
    }

    /// Over an arc in any plane: an axis sees a cosine of the angle.
    pub(super) fn on_spatial_arc(arc: &SpatialArc) -> Self {
        let [from, to] = arc.angles_rad();
        let (r, w) = (arc.radius_mm().abs(), arc.turn_rate_per_mm());
        let [d1, d2] = arc.directions();
        // Component of the outward direction: size cos(angle - phase); of the direction along the arc a quarter turn further.
        let waves = PerAxis::from_fn(|axis| {
            let phase_rad = d2[axis].portable_atan2(d1[axis]);
            let size = d1[axis].portable_hypot(d2[axis]);
            let across = cosine_range(from - phase_rad, to - phase_rad);
            let along = cosine_range(from + FRAC_PI_2 - phase_rad, to + FRAC_PI_2 - phase_rad);
            [across, along].map(|range| range.map(|cosine| size * cosine))
        });
        let largest = |range: &[f64; 2]| range[0].abs().max(range[1].abs());
        let slope = arc.slope();
        Self::new(
            PerAxis::from_fn(|axis| largest(&waves[axis][1].map(|along| slope[axis] + r * w * along))),
            waves.map(|[across, _]| r * w * w * largest(&across)),
            waves.map(|[_, along]| r * w.abs().powi(3) * largest(&along)),
        )
    }

    pub(super) fn first(&self, axis: AxisId) -> f64 {
        self.first[axis]
    }

    pub(super) fn second(&self, axis: AxisId) -> f64 {
        self.second[axis]
    }

    pub(super) fn third(&self, axis: AxisId) -> f64 {
        self.third[axis]
    }
}

/// Lowest and highest cosine between two angles.
fn cosine_range(from_rad: f64, to_rad: f64) -> [f64; 2] {
    let (low, high) = (from_rad.min(to_rad), from_rad.max(to_rad));
    // cos is 1 at even multiples of pi and -1 at odd ones.
    let meets = |offset_rad: f64| ((low - offset_rad) / (2.0 * PI)).ceil() * 2.0 * PI + offset_rad <= high;
    let (a, b) = (low.portable_cos(), high.portable_cos());
    [if meets(PI) { -1.0 } else { a.min(b) }, if meets(0.0) { 1.0 } else { a.max(b) }]
}
