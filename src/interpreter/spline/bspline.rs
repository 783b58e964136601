//! BSPLINE: points are control points, with weights (PW), degree 2 or 3 (SD) and intervals (PL).
//!
//! In: control points in order. Out: for every block the rational pieces of its share of the curve. The curve begins in the first control
//! point (where the block before ended, weight 1) and ends in the last one, tangential to the polygon (end knots with multiplicity):
//! the words BNAT, BTAN and so on mean nothing to it.
//!
//! n blocks of degree p make n - p + 1 spans of the knots, so that a block is no span. Block i drives from the Greville abscissa
//! `xi_i-1` to `xi_i`, `xi_i = (t_i+1 + ... + t_i+p) / p`: the place where control point i pulls most. For SD=3 these are the knots, but
//! for the first and the last two blocks, which share a span; for SD=2 the middles of the spans. Of two equal points with SD=2 the
//! first one's block ends in the knot between the two: the curve has a corner there, and that is no place inside of a block. The length
//! of span j (from 0) is the PL of block j + 2, so that the PL of the first block, and with SD=3 that of the last one, has no effect.
//! How the control shares a span between the blocks is not known; the curve does not depend on it.
//!
//! With fewer blocks than the degree, the degree is their number. Does not look at words.

use super::{PLAIN, PolynomialGeometry, PolynomialPiece};
use crate::base::{AxisVector, PerAxis};
use std::collections::VecDeque;
use std::sync::Arc;

/// Points that must be known beyond the end of a block: the knots near the end are others.
pub const LAG_BSPLINE: usize = 4;

/// A control point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlPoint {
    /// All axes.
    pub position: AxisVector,
    /// PW, 0 to 3.
    pub weight_ratio: f64,
    /// PL of its block.
    pub interval_ratio: f64,
}

/// A BSPLINE whose points arrive one by one.
#[derive(Clone, Debug)]
pub struct BSpline {
    linear: PerAxis<bool>,
    degree: usize,
    /// The last control points.
    points: VecDeque<ControlPoint>,
    /// Number of the first of them.
    offset: usize,
    /// Number of the block that is made next, from 1.
    next: usize,
}

/// A homogeneous point times a polynomial of the local parameter: position x weight of the linear axes, position of the others, weight.
#[derive(Clone, Copy)]
struct Weighted {
    positions: [AxisVector; 4],
    weights: [f64; 4],
}

impl BSpline {
    /// Begins at `start`; `degree` is SD, 2 or 3.
    pub fn new(start: AxisVector, degree: usize, linear: PerAxis<bool>) -> Self {
        let first = ControlPoint { position: start, weight_ratio: 1.0, interval_ratio: 1.0 };
        Self { linear, degree: degree.clamp(1, 3), points: VecDeque::from([first]), offset: 0, next: 1 }
    }

    /// PW of the first control point.
    pub fn weigh_start(&mut self, weight_ratio: f64) {
        if let Some(first) = self.points.front_mut().filter(|_| self.offset == 0) {
            first.weight_ratio = weight_ratio;
        }
    }

    /// The next control point.
    pub fn push(&mut self, point: ControlPoint) {
        self.points.push_back(point);
    }

    /// The next block, if enough is known; `Err` where the weights leave no curve.
    pub fn ready(&mut self) -> Option<Result<Arc<PolynomialGeometry>, NoWeight>> {
        (self.next + LAG_BSPLINE <= self.last()).then(|| self.make(None))
    }

    /// The next of the last blocks: no more points follow.
    pub fn finish(&mut self) -> Option<Result<Arc<PolynomialGeometry>, NoWeight>> {
        (self.next <= self.last()).then(|| self.make(Some(self.last())))
    }

    /// Number of the last control point.
    fn last(&self) -> usize {
        self.offset + self.points.len() - 1
    }

    fn point(&self, number: usize) -> &ControlPoint {
        // Numbers outside do not occur; the ends are the nearest that there is.
        let index = number.saturating_sub(self.offset).min(self.points.len() - 1);
        &self.points[index]
    }

    /// Knot `index` minus that of `reference`, with the end at control point `end` if it is known: t_p is the start of the first span.
    fn knot(&self, p: usize, index: usize, reference: usize, end: Option<usize>) -> f64 {
        let limited = |index: usize| end.map_or(index, |end| index.min(end + 1)).max(p);
        let (index, reference) = (limited(index), limited(reference));
        // Span j from t_p+j to t_p+j+1 has the interval of block j + 2.
        let way = |from: usize, to: usize| (from..to).map(|knot| self.point(knot - p + 2).interval_ratio).sum::<f64>();
        if index >= reference { way(reference, index) } else { -way(index, reference) }
    }

    /// The next control point is the same, and neither is one of the ends: with SD=2 the corner of the curve lies between them.
    fn is_doubled(&self, number: usize, end: Option<usize>) -> bool {
        let inside = number > 0 && end.is_none_or(|end| number + 1 < end);
        inside && self.point(number).position == self.point(number + 1).position
    }

    fn make(&mut self, end: Option<usize>) -> Result<Arc<PolynomialGeometry>, NoWeight> {
        let p = self.degree.min(end.unwrap_or(usize::MAX));
        let block = self.next;
        // The span whose start all parameters count from.
        let base = (block + 1).max(p);
        let base = end.map_or(base, |end| base.min(end));
        let knot = |index: usize| self.knot(p, index, base, end);
        let border = |i: usize| {
            if p == 2 && self.is_doubled(i, end) {
                return knot(i + 2);
            }
            (i + 1..=i + p).map(knot).sum::<f64>() / p as f64
        };
        let (from, to) = (border(block - 1), border(block));
        let mut pieces = Vec::new();
        // Spans that the block touches: t_k to t_k+1.
        for k in block.max(p)..=(block + p) {
            if end.is_some_and(|end| k > end) {
                break;
            }
            let (a, b) = (knot(k).max(from), knot(k + 1).min(to));
            if b > a {
                pieces.push(self.piece(p, k, [a, b], &knot)?);
            }
        }
        self.next += 1;
        while self.offset + 8 < self.next {
            self.points.pop_front();
            self.offset += 1;
        }
        Ok(Arc::new(PolynomialGeometry { pieces }))
    }

    /// De Boor's algorithm with polynomials of u = t - a in place of numbers.
    fn piece(
        &self,
        p: usize,
        k: usize,
        [a, b]: [f64; 2],
        knot: &impl Fn(usize) -> f64,
    ) -> Result<PolynomialPiece, NoWeight> {
        let weights: Vec<f64> = (0..=p).map(|j| self.point(k - p + j).weight_ratio).collect();
        let equal = weights.iter().all(|weight| *weight == weights[0]) && weights[0] > 0.0;
        let mut d: Vec<Weighted> = (0..=p)
            .map(|j| Weighted::new(self.point(k - p + j), &self.linear, if equal { 1.0 } else { weights[j] }))
            .collect();
        for r in 1..=p {
            for j in (r..=p).rev() {
                let (low, high) = (knot(k - p + j), knot(k + 1 + j - r));
                d[j] = Weighted::between(&d[j - 1], &d[j], (a - low) / (high - low), 1.0 / (high - low));
            }
        }
        let Weighted { positions, weights: w } = d[p];
        if !equal && lowest(&w, b - a) < WEIGHT_MIN_RATIO {
            return Err(NoWeight);
        }
        let zero = AxisVector::zero();
        Ok(PolynomialPiece {
            parameter_end_ratio: b - a,
            numerator_lu: [positions[0], positions[1], positions[2], positions[3], zero, zero],
            denominator_ratio: if equal { PLAIN } else { [w[0], w[1], w[2], w[3], 0.0, 0.0] },
        })
    }
}

/// The weights leave the curve without a place somewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoWeight;

/// A curve whose denominator goes below this is not driven: points of weight 0 at an end, or too many in a row.
const WEIGHT_MIN_RATIO: f64 = 1e-4;

/// A lower bound of a cubic from 0 to `width`: of its Bézier ordinates the inner ones count in full only where they are lower.
fn lowest(c: &[f64; 4], width: f64) -> f64 {
    // Dense samples: a cubic of positive weights bends little between 64 places.
    (0..=64)
        .map(|i| {
            let u = width * f64::from(i) / 64.0;
            c[0] + u * (c[1] + u * (c[2] + u * c[3]))
        })
        .fold(f64::INFINITY, f64::min)
}

impl Weighted {
    fn new(point: &ControlPoint, linear: &PerAxis<bool>, weight: f64) -> Self {
        let position = point.position;
        let scaled = PerAxis::from_fn(|axis| if linear[axis] { position[axis] * weight } else { position[axis] });
        let zero = AxisVector::zero();
        Self { positions: [scaled, zero, zero, zero], weights: [weight, 0.0, 0.0, 0.0] }
    }

    /// (1 - x) first + x second with x = at + slope u.
    fn between(first: &Self, second: &Self, at: f64, slope: f64) -> Self {
        let mut sum = *first;
        for i in 0..4 {
            let step = second.positions[i] - first.positions[i];
            let weight_step = second.weights[i] - first.weights[i];
            sum.positions[i] += step * at;
            sum.weights[i] += weight_step * at;
            if i < 3 {
                sum.positions[i + 1] += step * slope;
                sum.weights[i + 1] += weight_step * slope;
            }
        }
        sum
    }
}
