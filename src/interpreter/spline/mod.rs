//! Curves from points: ASPLINE, BSPLINE, CSPLINE, and POLY from its coefficients.
//!
//! In: points of all axes, the lengths of their parameter intervals, what holds at the ends. Out: one [`PolynomialGeometry`] a block.
//! Pure: words, frames and the order of blocks are `curve_words`'. Parameters of ASPLINE and CSPLINE are the chords of the linear
//! axes (of the rotary axes where only these move), so that a turned program gives the turned curve.
//!
//! A spline is made while its points arrive: a block is ready when [`LAG_AKIMA`], [`LAG_BSPLINE`] or [`LAG_CUBIC`] further points are
//! known, or the spline has ended. Memory does not grow with the number of points.

mod akima;
mod bspline;
mod cubic;
mod poly;

pub use akima::{AkimaSpline, LAG_AKIMA};
pub use bspline::{BSpline, ControlPoint, LAG_BSPLINE, NoWeight};
pub use cubic::{CubicSpline, LAG_CUBIC};
pub use poly::{AxisPolynomial, polynomial};

use super::wire::{PolynomialGeometry, PolynomialPiece};
use crate::base::{AxisVector, PerAxis};
use std::sync::Arc;

/// Denominator of a plain polynomial.
pub const PLAIN: [f64; 6] = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// What holds at the start or the end of a spline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EndCondition {
    /// BAUTO, EAUTO: from the points next to it.
    Auto,
    /// BNAT, ENAT: no curvature.
    Natural,
    /// BTAN, ETAN: derivative to the parameter.
    Tangent(AxisVector),
}

/// Length of the parameter interval between two points: the chord.
pub fn chord_lu(from: &AxisVector, to: &AxisVector, linear: &PerAxis<bool>) -> f64 {
    let travel = *to - *from;
    let linear_mm = travel.masked(linear).norm();
    if linear_mm > 0.0 { linear_mm } else { travel.norm() }
}

/// The cubic with these points and slopes at 0 and `width`.
fn hermite([p0, p1]: [AxisVector; 2], [m0, m1]: [AxisVector; 2], width: f64) -> Arc<PolynomialGeometry> {
    let secant = (p1 - p0) * (1.0 / width);
    let zero = AxisVector::zero();
    let second = (secant * 3.0 - m0 * 2.0 - m1) * (1.0 / width);
    let third = (m0 + m1 - secant * 2.0) * (1.0 / (width * width));
    one_piece([p0, m0, second, third, zero, zero], width)
}

fn one_piece(numerator_lu: [AxisVector; 6], parameter_end_ratio: f64) -> Arc<PolynomialGeometry> {
    let piece = PolynomialPiece { parameter_end_ratio, numerator_lu, denominator_ratio: PLAIN };
    Arc::new(PolynomialGeometry { pieces: vec![piece] })
}
