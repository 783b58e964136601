//! One curve of the contour, whatever its shape.
//!
//! In: a [`Line`], [`Arc`], [`SpatialArc`], [`PolynomialCurve`], [`HermiteBlend`] or [`QuinticBlend`]. Out: position and derivatives at
//! any arc length, exact ends, parts of it.
//!
//! The parameter s is the arc length of the linear axes in mm; rotary axes are functions of the same s and do not count. Where no
//! linear axis moves, s is sqrt(sum of squares) of the rotary travel in rad ([`Curve::rotary_only`]).
//!
//! Does not hold the block, the feed or the neighbours of a curve: that is the contour's.

use super::{Arc, HermiteBlend, Line, PolynomialCurve, QuinticBlend, SpatialArc};
use crate::base::{AxisVector, PartPoint, PerAxis};

/// Motion shorter than this is none: a picometre, far below the resolution of any control (1 nm to 1 µm) and far above the
/// rounding of coordinates (1e-13 mm at 1 m). Rotary axes: the same number in rad.
pub const DISPLACEMENT_MIN_LU: f64 = 1e-9;

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub enum Curve {
    /// Straight in all axes. Dense programs have little else, and curves are moved a lot: the larger ones are boxed.
    Line(Line),
    /// Circle or helix.
    Arc(Box<Arc>),
    /// Circle or helix in a plane that no two axes span.
    SpatialArc(Box<SpatialArc>),
    /// Spline or polynomial.
    Polynomial(Box<PolynomialCurve>),
    /// Corner blend, the published cubic.
    Blend(Box<HermiteBlend>),
    /// Corner blend without a step of curvature.
    Quintic(Box<QuinticBlend>),
}

/// A curve at one place, with derivatives to s (lu per mm, per mm², per mm³; per rad where only rotary axes move).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveState {
    /// q(s).
    pub position: PartPoint,
    /// q'(s).
    pub first: AxisVector,
    /// q''(s).
    pub second: AxisVector,
    /// q'''(s).
    pub third: AxisVector,
}

impl From<Arc> for Curve {
    fn from(arc: Arc) -> Self {
        Self::Arc(Box::new(arc))
    }
}

impl From<SpatialArc> for Curve {
    fn from(arc: SpatialArc) -> Self {
        Self::SpatialArc(Box::new(arc))
    }
}

impl From<PolynomialCurve> for Curve {
    fn from(curve: PolynomialCurve) -> Self {
        Self::Polynomial(Box::new(curve))
    }
}

impl From<HermiteBlend> for Curve {
    fn from(blend: HermiteBlend) -> Self {
        Self::Blend(Box::new(blend))
    }
}

impl From<QuinticBlend> for Curve {
    fn from(blend: QuinticBlend) -> Self {
        Self::Quintic(Box::new(blend))
    }
}

impl Curve {
    /// Length of the parameter range.
    pub fn length_lu(&self) -> f64 {
        match self {
            Self::Line(line) => line.length_lu(),
            Self::Arc(arc) => arc.length_lu(),
            Self::SpatialArc(arc) => arc.length_lu(),
            Self::Polynomial(curve) => curve.length_lu(),
            Self::Blend(blend) => blend.length_lu(),
            Self::Quintic(blend) => blend.length_lu(),
        }
    }

    /// True where no linear axis moves: s is then in rad.
    pub fn rotary_only(&self) -> bool {
        match self {
            Self::Line(line) => line.rotary_only(),
            Self::Arc(arc) => arc.rotary_only(),
            Self::SpatialArc(arc) => arc.rotary_only(),
            Self::Polynomial(curve) => curve.rotary_only(),
            Self::Blend(_) | Self::Quintic(_) => false,
        }
    }

    /// First point, bit by bit as programmed.
    pub fn start(&self) -> PartPoint {
        match self {
            Self::Line(line) => line.start(),
            Self::Arc(arc) => arc.start(),
            Self::SpatialArc(arc) => arc.start(),
            Self::Polynomial(curve) => curve.start(),
            Self::Blend(blend) => blend.start(),
            Self::Quintic(blend) => blend.start(),
        }
    }

    /// Last point, bit by bit as programmed.
    pub fn end(&self) -> PartPoint {
        match self {
            Self::Line(line) => line.end(),
            Self::Arc(arc) => arc.end(),
            Self::SpatialArc(arc) => arc.end(),
            Self::Polynomial(curve) => curve.end(),
            Self::Blend(blend) => blend.end(),
            Self::Quintic(blend) => blend.end(),
        }
    }

    /// The curve at s, clamped to its ends, where the position is that of [`start`](Self::start) and [`end`](Self::end) exactly.
    pub fn at(&self, s_lu: f64) -> CurveState {
        match self {
            Self::Line(line) => line.at(s_lu),
            Self::Arc(arc) => arc.at(s_lu),
            Self::SpatialArc(arc) => arc.at(s_lu),
            Self::Polynomial(curve) => curve.at(s_lu),
            Self::Blend(blend) => blend.at(s_lu),
            Self::Quintic(blend) => blend.at(s_lu),
        }
    }

    /// The part between two places, clamped to the ends. An end that is not cut keeps its exact point.
    pub fn trimmed(&self, start_lu: f64, end_lu: f64) -> Self {
        let length_lu = self.length_lu();
        // `max` before `min`: a NaN becomes an end of the curve.
        let start_lu = start_lu.max(0.0).min(length_lu);
        let end_lu = end_lu.max(start_lu).min(length_lu);
        if start_lu == 0.0 && end_lu == length_lu {
            return self.clone();
        }
        match self {
            Self::Line(line) => Self::Line(line.shortened(start_lu, length_lu - end_lu)),
            Self::Arc(arc) => arc.trimmed(start_lu, end_lu).into(),
            Self::SpatialArc(arc) => arc.trimmed(start_lu, end_lu).into(),
            Self::Polynomial(curve) => curve.trimmed(start_lu, end_lu).into(),
            Self::Blend(blend) => blend.trimmed(start_lu, end_lu).into(),
            Self::Quintic(blend) => blend.trimmed(start_lu, end_lu).into(),
        }
    }
}

/// Length of a displacement over some axes; exact scaling keeps the squares inside the range of f64 for any finite input.
pub(super) fn length_over(displacement: &AxisVector, axes: &PerAxis<bool>) -> f64 {
    let masked = displacement.masked(axes);
    let squares = masked.dot(&masked);
    if squares > 1e-200 && squares < 1e200 {
        return squares.sqrt();
    }
    let largest = masked.as_slice().iter().fold(0.0_f64, |largest, component| largest.max(component.abs()));
    if largest == 0.0 || !largest.is_finite() {
        largest
    } else {
        masked.map(|component| component / largest).norm() * largest
    }
}

/// Length of the parameter of a motion, and whether it is one of rotary axes alone: `linear_mm` is the length of its linear
/// part. Linear travel below the resolution is carried along by the rotary axes.
pub(super) fn parameter_length(linear_mm: f64, displacement: &AxisVector, linear: &PerAxis<bool>) -> (f64, bool) {
    if linear_mm >= DISPLACEMENT_MIN_LU {
        return (linear_mm, false);
    }
    let rotary_rad = length_over(displacement, &linear.map(|is_linear| !is_linear));
    if rotary_rad > linear_mm { (rotary_rad, true) } else { (linear_mm, false) }
}
