//! POLY: polynomials of a block from PO[axis]=(end, a2, a3, a4, a5), PO[]=(end, b2, ...) and PL.
//!
//! In: start, end and coefficients of all axes. Out: one piece. With p from 0 to PL and the denominator `D(p) = 1 + b1 p + b2 p² + ...`,
//! whose value at PL is the first number of PO[]:
//!
//! ```text
//! linear axes:  X(p) = ( a0 + a1 p + a2 p² + ... ) / D(p),   a0 = start,   a1 so that X(PL) = end
//! rotary axes:  the same without D
//! ```
//!
//! So `PO[X]=(0,-10) PO[Y]=(10) PO[]=(2,1)` is a quarter circle from X10 Y0. An axis without PO goes linearly in p, an axis that is
//! not in the block stands. Does not look at words.

use super::{PLAIN, PolynomialGeometry, PolynomialPiece};
use crate::base::{AxisVector, PerAxis};
use std::sync::Arc;

/// Coefficients of one axis: PO with the powers 2 to 5.
pub type AxisPolynomial = [f64; 4];

/// A denominator that goes below this share of its greatest value counts as 0.
const DENOMINATOR_MIN_RATIO: f64 = 1e-3;

/// Places at which the denominator is looked at.
const LOOKS: u32 = 256;

/// The block; `None` where the denominator is 0 in it, or a linear way under it would need degree 6.
pub fn polynomial(
    [start, end]: [AxisVector; 2],
    coefficients: &PerAxis<Option<AxisPolynomial>>,
    denominator: Option<(f64, AxisPolynomial)>,
    parameter_end_ratio: f64,
    linear: &PerAxis<bool>,
) -> Option<Arc<PolynomialGeometry>> {
    let width = parameter_end_ratio;
    let d = denominator.map_or(PLAIN, |(at_end, powers)| divisor(at_end, &powers, width));
    if !stays_positive(&d, width) {
        return None;
    }
    let d_end = value(&d, width);
    let mut numerator_lu = [AxisVector::zero(); 6];
    for (i, divided) in linear.as_slice().iter().enumerate() {
        let (q0, q1) = (start.as_slice()[i], end.as_slice()[i]);
        let mut own = [q0, 0.0, 0.0, 0.0, 0.0, 0.0];
        if let Some(powers) = &coefficients.as_slice()[i] {
            own[2..].copy_from_slice(powers);
            let wanted = if *divided { q1 * d_end } else { q1 };
            own[1] = (wanted - value(&own, width)) / width;
        } else if *divided {
            own = times_line(&d, q0, (q1 - q0) / width)?;
        } else {
            own[1] = (q1 - q0) / width;
        }
        for (row, coefficient) in numerator_lu.iter_mut().zip(own) {
            row.as_mut_slice()[i] = coefficient;
        }
    }
    let piece = PolynomialPiece { parameter_end_ratio, numerator_lu, denominator_ratio: d };
    Some(Arc::new(PolynomialGeometry { pieces: vec![piece] }))
}

/// D from its value at the end and its powers from 2.
fn divisor(at_end: f64, powers: &AxisPolynomial, width: f64) -> [f64; 6] {
    let mut d = [1.0, 0.0, powers[0], powers[1], powers[2], powers[3]];
    d[1] = (at_end - value(&d, width)) / width;
    d
}

fn value(c: &[f64; 6], p: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, coefficient| sum * p + coefficient)
}

/// (q0 + slope p) D(p).
fn times_line(d: &[f64; 6], q0: f64, slope: f64) -> Option<[f64; 6]> {
    if slope != 0.0 && d[5] != 0.0 {
        return None;
    }
    let mut product = d.map(|coefficient| coefficient * q0);
    for power in 1..6 {
        product[power] += d[power - 1] * slope;
    }
    Some(product)
}

/// D has no zero from 0 to the end, nor comes near one.
fn stays_positive(d: &[f64; 6], width: f64) -> bool {
    let values: Vec<f64> = (0..=LOOKS).map(|i| value(d, width * f64::from(i) / f64::from(LOOKS))).collect();
    let most = values.iter().copied().fold(0.0, f64::max);
    values.iter().all(|value| *value > DENOMINATOR_MIN_RATIO * most)
}
