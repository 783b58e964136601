//! Direction of a move at its ends.
//!
//! In: a move with its start and end in the basic system. Out: its tangent: of unit length over the linear axes (over all where only
//! rotary axes move). CT, BTAN and ETAN need it. Does not know words.

use super::wire::{MoveKind, PolynomialGeometry, PolynomialPiece};
use crate::base::{AxisVector, PartPoint, PerAxis};

/// Ways shorter than this have no direction: rounding of coordinates.
const WAY_MIN_LU: f64 = 1e-9;

/// Direction of a move where it begins (`at_end: false`) or ends; `None` without a way.
pub(super) fn direction(
    kind: &MoveKind,
    [start, end]: [&PartPoint; 2],
    at_end: bool,
    linear: &PerAxis<bool>,
) -> Option<AxisVector> {
    let point = if at_end { end } else { start };
    let way = end.0 - start.0;
    let along = match kind {
        MoveKind::Rapid | MoveKind::Line => way,
        MoveKind::Arc(arc) => {
            let [first, second] = arc.plane;
            let mut along = way * (1.0 / arc.sweep_rad.abs());
            let turn = arc.sweep_rad.signum();
            along[first] = -turn * (point.0[second] - arc.centre_mm[1]);
            along[second] = turn * (point.0[first] - arc.centre_mm[0]);
            along
        }
        MoveKind::SpatialArc(arc) => {
            let [d1, d2] = &arc.directions;
            let across = way - *d1 * way.dot(d1) - *d2 * way.dot(d2);
            let out = point.0 - arc.centre_mm;
            let turn = arc.sweep_rad.signum();
            *d2 * (turn * out.dot(d1)) - *d1 * (turn * out.dot(d2)) + across * (1.0 / arc.sweep_rad.abs())
        }
        MoveKind::Spline(geometry) | MoveKind::Polynomial(geometry) => of_polynomials(geometry, at_end, linear)?,
        _ => return None,
    };
    unit(along, linear)
}

/// Unit length over the linear axes, or over all where these stand.
fn unit(along: AxisVector, linear: &PerAxis<bool>) -> Option<AxisVector> {
    let linear_lu = along.masked(linear).norm();
    let length_lu = if linear_lu > WAY_MIN_LU { linear_lu } else { along.norm() };
    (length_lu > WAY_MIN_LU).then(|| along * (1.0 / length_lu))
}

/// The first derivative to the parameter that is not 0, at the start or the end of the pieces that move.
fn of_polynomials(geometry: &PolynomialGeometry, at_end: bool, linear: &PerAxis<bool>) -> Option<AxisVector> {
    let pieces = &geometry.pieces;
    (0..pieces.len()).find_map(|i| of_piece(&pieces[if at_end { pieces.len() - 1 - i } else { i }], at_end, linear))
}

fn of_piece(piece: &PolynomialPiece, at_end: bool, linear: &PerAxis<bool>) -> Option<AxisVector> {
    // At a zero of the speed a little beside it tells the direction.
    [0.0, 1e-6, 1e-3].into_iter().find_map(|inside| {
        let u = piece.parameter_end_ratio * if at_end { 1.0 - inside } else { inside };
        let derivative = first_derivative(piece, u, linear);
        (derivative.norm() > WAY_MIN_LU).then_some(derivative)
    })
}

fn first_derivative(piece: &PolynomialPiece, u: f64, linear: &PerAxis<bool>) -> AxisVector {
    let [mut value, mut slope] = [AxisVector::zero(); 2];
    for coefficient in piece.numerator_lu.iter().rev() {
        slope = slope * u + value;
        value = value * u + *coefficient;
    }
    let (mut d, mut d_slope) = (0.0, 0.0);
    for coefficient in piece.denominator_ratio.iter().rev() {
        d_slope = d_slope * u + d;
        d = d * u + coefficient;
    }
    PerAxis::from_fn(|axis| if linear[axis] { (slope[axis] - value[axis] / d * d_slope) / d } else { slope[axis] })
}
