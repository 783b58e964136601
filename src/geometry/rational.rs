//! One polynomial piece at one value of its parameter.
//!
//! In: a [`PolynomialPiece`] and u. Out: q and its derivatives to u up to the third, and the speed along the axes that count. Does not
//! know arc length.

use crate::base::{AxisVector, PerAxis};
use crate::interpreter::PolynomialPiece;

/// q(u) and derivatives to u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Derivatives {
    pub position: AxisVector,
    pub first: AxisVector,
    pub second: AxisVector,
    pub third: AxisVector,
}

/// True for a piece without a denominator.
pub(super) fn is_plain(piece: &PolynomialPiece) -> bool {
    piece.denominator_ratio == [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
}

/// q(u) with derivatives; axes of `linear` are divided by the denominator.
pub(super) fn derivatives(piece: &PolynomialPiece, linear: &PerAxis<bool>, u: f64) -> Derivatives {
    let n = &piece.numerator_lu;
    // Horner's scheme for the polynomial and its derivatives at once: each row is the derivative of the one above over k!.
    let mut rows = [n[5], AxisVector::zero(), AxisVector::zero(), AxisVector::zero()];
    for coefficient in n[..5].iter().rev() {
        rows[3] = rows[3] * u + rows[2];
        rows[2] = rows[2] * u + rows[1];
        rows[1] = rows[1] * u + rows[0];
        rows[0] = rows[0] * u + *coefficient;
    }
    let whole = Derivatives { position: rows[0], first: rows[1], second: rows[2] * 2.0, third: rows[3] * 6.0 };
    if is_plain(piece) { whole } else { divided(&whole, denominator(piece, u), linear) }
}

/// D(u) and its first three derivatives.
fn denominator(piece: &PolynomialPiece, u: f64) -> [f64; 4] {
    let d = &piece.denominator_ratio;
    let mut rows = [d[5], 0.0, 0.0, 0.0];
    for coefficient in d[..5].iter().rev() {
        rows[3] = rows[3] * u + rows[2];
        rows[2] = rows[2] * u + rows[1];
        rows[1] = rows[1] * u + rows[0];
        rows[0] = rows[0] * u + coefficient;
    }
    [rows[0], rows[1], 2.0 * rows[2], 6.0 * rows[3]]
}

/// The quotient rule on N = q D, up to the third derivative.
fn divided(n: &Derivatives, [d0, d1, d2, d3]: [f64; 4], linear: &PerAxis<bool>) -> Derivatives {
    let mut q = *n;
    for (i, _) in linear.as_slice().iter().enumerate().filter(|(_, is_linear)| **is_linear) {
        let at = |vector: &AxisVector| vector.as_slice()[i];
        let p = at(&n.position) / d0;
        let p1 = (at(&n.first) - p * d1) / d0;
        let p2 = (at(&n.second) - 2.0 * p1 * d1 - p * d2) / d0;
        let p3 = (at(&n.third) - 3.0 * p2 * d1 - 3.0 * p1 * d2 - p * d3) / d0;
        q.position.as_mut_slice()[i] = p;
        q.first.as_mut_slice()[i] = p1;
        q.second.as_mut_slice()[i] = p2;
        q.third.as_mut_slice()[i] = p3;
    }
    q
}

/// |dq/du| over the axes that count, at several places: what a quadrature asks for.
pub(super) fn speeds<const N: usize>(
    piece: &PolynomialPiece,
    linear: &PerAxis<bool>,
    counted: &PerAxis<bool>,
    places: &[f64; N],
) -> [f64; N] {
    if !is_plain(piece) {
        return places.map(|u| speed(piece, linear, counted, u));
    }
    // Axis by axis over all places, so that the places go through the processor side by side.
    let n = &piece.numerator_lu;
    let mut squares = [0.0; N];
    for (i, _) in counted.as_slice().iter().enumerate().filter(|(_, counts)| **counts) {
        let c = n.each_ref().map(|vector| vector.as_slice()[i]);
        let (c2, c3, c4, c5) = (2.0 * c[2], 3.0 * c[3], 4.0 * c[4], 5.0 * c[5]);
        for (square, u) in squares.iter_mut().zip(places) {
            let slope = c[1] + u * (c2 + u * (c3 + u * (c4 + u * c5)));
            *square += slope * slope;
        }
    }
    squares.map(f64::sqrt)
}

/// |dq/du| over the axes that count.
pub(super) fn speed(piece: &PolynomialPiece, linear: &PerAxis<bool>, counted: &PerAxis<bool>, u: f64) -> f64 {
    let n = &piece.numerator_lu;
    let plain = is_plain(piece);
    let (d0, d1) = if plain {
        (1.0, 0.0)
    } else {
        let [d0, d1, ..] = denominator(piece, u);
        (d0, d1)
    };
    let mut squares = 0.0;
    for (i, _) in counted.as_slice().iter().enumerate().filter(|(_, counts)| **counts) {
        let c = n.each_ref().map(|vector| vector.as_slice()[i]);
        let slope = c[1] + u * (2.0 * c[2] + u * (3.0 * c[3] + u * (4.0 * c[4] + u * 5.0 * c[5])));
        let slope = if plain || !linear.as_slice()[i] {
            slope
        } else {
            let value = c[0] + u * (c[1] + u * (c[2] + u * (c[3] + u * (c[4] + u * c[5]))));
            (slope - value / d0 * d1) / d0
        };
        squares += slope * slope;
    }
    squares.sqrt()
}
