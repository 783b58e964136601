//! Polynomial blends: from one curve to another of any shape, rotary axes included.
//!
//! In: two curves that meet, how much of each may be taken, what every axis may deviate by. Out: [`Transition`]: a chain of
//! polynomials of degree 5 of the path length, which goes on from the first curve and into the second one with the same direction
//! and the same curvature.
//!
//! The blend takes the length T of both curves. With s from -T to T it is compared with the programmed curves at the same s: that
//! difference is not less than the distance from the contour, and it is what axes deviate by. Between two lines it is greatest in
//! the middle, where it is `3/16 T (V - U)`; for other curves it is sampled.
//!
//! [`common`] blends all axes over one T. [`per_axis`] (lines only) gives every axis the T_j that its own tolerance allows: the axes
//! leave their lines at different places.
//!
//! [`enough`] is the T beyond which a longer blend does not make the corner faster.
//!
//! Does not know path modes: that is `corner`.

use super::dynamics::{Dynamics, LENGTH_MIN_LU};
use crate::base::{AxisVector, PartPoint, PerAxis};
use crate::geometry::{Curve, Line, PolynomialCurve};
use crate::interpreter::{PolynomialGeometry, PolynomialPiece};
use std::sync::Arc;

/// Samples of the deviation from one end of a blend to the other.
const SAMPLES: usize = 32;

/// Rounds of the search for T, and the share of the tolerance that is near enough.
const ROUNDS: usize = 20;
const NEAR_ENOUGH_RATIO: f64 = 0.9;

/// Kept below the tolerance for what samples may miss between them.
const SAMPLE_RESERVE_RATIO: f64 = 0.99;

/// Where a blend goes slower than this through its parameter between two samples it may be slower still; and rounds of the search there, each of which leaves
/// two thirds.
const SLOW_RATIO: f64 = 0.3;
const VALLEY_ROUNDS: usize = 40;

/// Axes whose T_j differ by less than this share leave their lines at one place: a stretch between, as short as rounding makes it, is no use to anyone
/// and has a jerk of its own.
const STRETCH_MIN_RATIO: f64 = 1e-3;

/// Deviation in the middle of a blend between lines, over T |V - U|.
const MIDDLE_RATIO: f64 = 3.0 / 16.0;

/// Greatest second and third derivative of a blend between lines, over |V - U|/T and |V - U|/T².
const BEND_RATIOS: [f64; 2] = [0.75, 1.5];

/// Rounds of the search for the T that the dynamics need.
const DYNAMICS_ROUNDS: usize = 12;

/// What axes may deviate by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tolerances {
    /// All linear axes together; infinite: not limited.
    pub contour_mm: f64,
    /// Every axis alone; infinite: not limited.
    pub axis_lu: PerAxis<f64>,
}

/// A blend.
pub(super) struct Transition {
    /// From the cut end of the first curve to the cut start of the second.
    pub curve: Curve,
    /// T.
    pub length_lu: f64,
    /// Distance of its middle from the point where the curves meet, linear axes.
    pub deviation_mm: f64,
}

/// Two curves that meet.
pub(super) struct Pair<'a> {
    pub before: &'a Curve,
    pub after: &'a Curve,
    pub linear: &'a PerAxis<bool>,
}

impl Tolerances {
    /// Greatest share of a tolerance that a deviation takes.
    pub(super) fn share(&self, deviation: &AxisVector, linear: &PerAxis<bool>) -> f64 {
        // No deviation is none, also of a tolerance of 0; a NaN must not pass for small.
        let taken = |deviation: f64, tolerance: f64| if deviation == 0.0 { 0.0 } else { deviation.abs() / tolerance };
        let together = taken(deviation.masked(linear).norm(), self.contour_mm);
        let each = deviation.as_slice().iter().zip(self.axis_lu.as_slice());
        let alone = each.map(|(deviation, tolerance)| taken(*deviation, *tolerance));
        let greater = |most: f64, share: f64| if share.is_nan() { f64::INFINITY } else { most.max(share) };
        alone.fold(greater(0.0, together), greater)
    }
}

impl Pair<'_> {
    /// Least way over change of the parameter along the blend over T, of the axes whose way is that of the path: 1 at the ends, 0 in a cusp, cos(theta/2)
    /// between two lines.
    pub(super) fn slowest_ratio(&self, t_lu: f64) -> f64 {
        let counted = if self.before.rotary_only() { self.linear.map(|linear| !linear) } else { *self.linear };
        slowest_ratio(&self.polynomial(t_lu), 2.0 * t_lu, &counted)
    }

    /// Programmed position at s from the meeting point, negative before it.
    fn programmed(&self, s_lu: f64) -> AxisVector {
        if s_lu < 0.0 {
            self.before.at(self.before.length_lu() + s_lu).position.0
        } else {
            self.after.at(s_lu).position.0
        }
    }

    /// The polynomial over all axes, its parameter from 0 to 2 T.
    fn polynomial(&self, t_lu: f64) -> [AxisVector; 6] {
        let start = self.before.at(self.before.length_lu() - t_lu);
        let end = self.after.at(t_lu);
        hermite(2.0 * t_lu, [start.position.0, start.first, start.second], [end.position.0, end.first, end.second])
    }

    /// Greatest share of the tolerances that the blend over T takes.
    fn share(&self, t_lu: f64, tolerances: &Tolerances) -> f64 {
        let polynomial = self.polynomial(t_lu);
        let mut greatest: f64 = 0.0;
        for i in 1..SAMPLES {
            let u = 2.0 * t_lu * i as f64 / SAMPLES as f64;
            let deviation = value(&polynomial, u) - self.programmed(u - t_lu);
            let share = tolerances.share(&deviation, self.linear);
            greatest = greatest.max(share);
        }
        greatest
    }
}

/// The shortest T up to `t_max_lu` at which the axes can pass at the feed; `t_max_lu` where there is none.
pub(super) fn enough(pair: &Pair<'_>, t_max_lu: f64, dynamics: &Dynamics) -> f64 {
    if let (Curve::Line(first), Curve::Line(second)) = (pair.before, pair.after) {
        let turn = *second.direction() - *first.direction();
        let [second, third] = BEND_RATIOS.map(|ratio| turn * ratio);
        return dynamics.needed_lu(&second, &third).min(t_max_lu);
    }
    let passes = |t_lu: f64| {
        let polynomial = pair.polynomial(t_lu);
        (0..=SAMPLES).all(|i| {
            let [second, third] = bends(&polynomial, 2.0 * t_lu * i as f64 / SAMPLES as f64);
            dynamics.share(&second, &third) <= 1.0
        })
    };
    if !passes(t_max_lu) {
        return t_max_lu;
    }
    let (mut low, mut high) = (LENGTH_MIN_LU.min(t_max_lu), t_max_lu);
    for _ in 0..DYNAMICS_ROUNDS {
        let middle = 0.5 * (low + high);
        if passes(middle) { high = middle } else { low = middle }
    }
    high
}

/// The blend over the largest T up to `t_max_lu` that keeps the tolerances. `None`: there is none. `ends` gives the exact points
/// where the curves are cut.
pub(super) fn common(
    pair: &Pair<'_>,
    t_max_lu: f64,
    tolerances: &Tolerances,
    ends: impl Fn(f64) -> [PartPoint; 2],
) -> Option<Transition> {
    let t_lu = largest(pair, t_max_lu, tolerances)?;
    let numerator_lu = pair.polynomial(t_lu);
    let middle = value(&numerator_lu, t_lu) - pair.programmed(0.0);
    let piece = piece(2.0 * t_lu, numerator_lu);
    let curve = chained(vec![piece], ends(t_lu), pair.linear)?;
    Some(Transition { curve, length_lu: t_lu, deviation_mm: middle.masked(pair.linear).norm() })
}

fn largest(pair: &Pair<'_>, t_max_lu: f64, tolerances: &Tolerances) -> Option<f64> {
    let share = |t_lu: f64| pair.share(t_lu, tolerances) / SAMPLE_RESERVE_RATIO;
    let (mut low, mut high) = (0.0, t_max_lu);
    let mut t_lu = t_max_lu;
    for round in 0..ROUNDS {
        let taken = share(t_lu);
        if taken <= 1.0 {
            if round == 0 || taken >= NEAR_ENOUGH_RATIO {
                return Some(t_lu);
            }
            low = t_lu;
            t_lu = 0.5 * (low + high);
        } else {
            high = t_lu;
            // Deviations grow at least as T does; a little less, so that rounding does not keep it above.
            t_lu = if low > 0.0 { 0.5 * (low + high) } else { t_lu * (0.999 / taken).max(1e-3) };
        }
    }
    (low > 0.0).then_some(low)
}

/// Every axis over its own T_j, as large as its tolerance and `t_max_lu` allow.
pub(super) fn per_axis(
    [first, second]: [&Line; 2],
    t_max_lu: f64,
    axis_lu: &PerAxis<f64>,
    linear: &PerAxis<bool>,
    ends: impl Fn(f64) -> [PartPoint; 2],
) -> Option<Transition> {
    let (u, v, corner) = (*first.direction(), *second.direction(), first.end().0);
    let turn = v - u;
    let reach = PerAxis::from_fn(|axis| {
        let turn = turn[axis].abs();
        if turn > 0.0 { (axis_lu[axis] / (MIDDLE_RATIO * turn)).min(t_max_lu) } else { 0.0 }
    });
    let t_lu = reach.as_slice().iter().fold(0.0_f64, |most, t_lu| most.max(*t_lu));
    // An axis that turns and must not deviate leaves a corner.
    let stuck = turn.as_slice().iter().zip(reach.as_slice()).any(|(turn, t_lu)| {
        let blends = *t_lu > 0.0;
        *turn != 0.0 && !blends
    });
    if stuck || !(t_lu > 0.0 && t_lu.is_finite()) {
        return None;
    }
    let reach = joined(reach, STRETCH_MIN_RATIO * t_lu);
    let t_lu = reach.as_slice().iter().fold(0.0_f64, |most, t_lu| most.max(*t_lu));
    let mut places: Vec<f64> = reach.as_slice().iter().flat_map(|t_lu| [-*t_lu, *t_lu]).collect();
    places.sort_by(f64::total_cmp);
    places.dedup();
    let own = PerAxis::from_fn(|axis| {
        let t_lu = reach[axis];
        let at = |s_lu: f64, slope: f64| [corner[axis] + s_lu * slope, slope, 0.0];
        if t_lu > 0.0 { hermite_one(2.0 * t_lu, at(-t_lu, u[axis]), at(t_lu, v[axis])) } else { [0.0; 6] }
    });
    let pieces = places.windows(2).map(|stretch| {
        let (start, middle) = (stretch[0], 0.5 * (stretch[0] + stretch[1]));
        let mut numerator_lu = [AxisVector::zero(); 6];
        for axis in crate::base::AxisId::first(crate::base::AXES_MAX) {
            let coefficients = if middle.abs() < reach[axis] {
                shifted(&own[axis], start + reach[axis])
            } else {
                let slope = if middle < 0.0 { u[axis] } else { v[axis] };
                [corner[axis] + start * slope, slope, 0.0, 0.0, 0.0, 0.0]
            };
            for (vector, coefficient) in numerator_lu.iter_mut().zip(coefficients) {
                vector[axis] = coefficient;
            }
        }
        piece(stretch[1] - start, numerator_lu)
    });
    let pieces: Vec<PolynomialPiece> = pieces.collect();
    let deviation = PerAxis::from_fn(|axis| MIDDLE_RATIO * reach[axis] * turn[axis]);
    let curve = chained(pieces, ends(t_lu), linear)?;
    Some(Transition { curve, length_lu: t_lu, deviation_mm: deviation.masked(linear).norm() })
}

/// Every T_j that is longer than another one by no more than `near_lu` as long as that one: no axis deviates by more than before.
fn joined(reach: PerAxis<f64>, near_lu: f64) -> PerAxis<f64> {
    let mut sorted: Vec<f64> = reach.as_slice().iter().copied().filter(|t_lu| *t_lu > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    let mut firsts: Vec<f64> = Vec::new();
    for t_lu in sorted {
        if firsts.last().is_none_or(|first| t_lu - first > near_lu) {
            firsts.push(t_lu);
        }
    }
    reach.map(|t_lu| firsts.iter().rev().copied().find(|first| *first <= t_lu).unwrap_or(t_lu))
}

fn chained(pieces: Vec<PolynomialPiece>, [start, end]: [PartPoint; 2], linear: &PerAxis<bool>) -> Option<Curve> {
    let curve = PolynomialCurve::new(start, end, &Arc::new(PolynomialGeometry { pieces }), linear);
    (curve.length_lu() > 0.0).then_some(Curve::from(curve))
}

/// A polynomial, not divided.
pub(super) fn piece(parameter_end: f64, numerator_lu: [AxisVector; 6]) -> PolynomialPiece {
    PolynomialPiece {
        parameter_end_ratio: parameter_end,
        numerator_lu,
        denominator_ratio: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    }
}

/// Coefficients of degree 5 from value, first and second derivative at 0 and at `h`.
pub(super) fn hermite(h: f64, start: [AxisVector; 3], end: [AxisVector; 3]) -> [AxisVector; 6] {
    let mut coefficients = [AxisVector::zero(); 6];
    for axis in crate::base::AxisId::first(crate::base::AXES_MAX) {
        let one = hermite_one(h, start.map(|vector| vector[axis]), end.map(|vector| vector[axis]));
        for (vector, coefficient) in coefficients.iter_mut().zip(one) {
            vector[axis] = coefficient;
        }
    }
    coefficients
}

fn hermite_one(h: f64, [p, m, a]: [f64; 3], [q, n, b]: [f64; 3]) -> [f64; 6] {
    let way = q - p - h * (m + 0.5 * h * a);
    let slope = h * (n - m - h * a);
    let bend = h * h * (b - a);
    let (h3, h4, h5) = (h.powi(3), h.powi(4), h.powi(5));
    [
        p,
        m,
        0.5 * a,
        (10.0 * way - 4.0 * slope + 0.5 * bend) / h3,
        (-15.0 * way + 7.0 * slope - bend) / h4,
        (6.0 * way - 3.0 * slope + 0.5 * bend) / h5,
    ]
}

fn value(coefficients: &[AxisVector; 6], u: f64) -> AxisVector {
    coefficients.iter().rev().fold(AxisVector::zero(), |sum, coefficient| sum * u + *coefficient)
}

/// Second and third derivative to u.
fn bends(c: &[AxisVector; 6], u: f64) -> [AxisVector; 2] {
    let second = c[2] * 2.0 + (c[3] * 6.0 + (c[4] * 12.0 + c[5] * (20.0 * u)) * u) * u;
    let third = c[3] * 6.0 + (c[4] * 24.0 + c[5] * (60.0 * u)) * u;
    [second, third]
}

/// The least |p'| on \[0, h\]: of samples and, where the curve is slow, of the valleys between them, whose square is about a parabola.
fn slowest_ratio(c: &[AxisVector; 6], h: f64, counted: &PerAxis<bool>) -> f64 {
    let speed_ratio = |u: f64| {
        let slope = c[1] + (c[2] * 2.0 + (c[3] * 3.0 + (c[4] * 4.0 + c[5] * (5.0 * u)) * u) * u) * u;
        slope.masked(counted).norm()
    };
    let step = h / SAMPLES as f64;
    let samples: [f64; SAMPLES + 1] = std::array::from_fn(|i| speed_ratio(step * i as f64));
    let mut slowest = samples.iter().copied().fold(f64::INFINITY, f64::min);
    for i in (1..SAMPLES).filter(|i| samples[*i] < SLOW_RATIO && samples[*i] <= samples[i - 1].min(samples[i + 1])) {
        let (mut low, mut high) = (step * (i - 1) as f64, step * (i + 1) as f64);
        for _ in 0..VALLEY_ROUNDS {
            let [left, right] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            if speed_ratio(left) < speed_ratio(right) { high = right } else { low = left }
        }
        slowest = slowest.min(speed_ratio(0.5 * (low + high)));
    }
    slowest
}

/// Coefficients of p(u + by).
fn shifted(coefficients: &[f64; 6], by: f64) -> [f64; 6] {
    let mut c = *coefficients;
    for low in 0..5 {
        for k in (low..5).rev() {
            c[k] += by * c[k + 1];
        }
    }
    c
}
