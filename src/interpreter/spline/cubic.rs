//! CSPLINE: the cubic spline with continuous curvature.
//!
//! In: points in order. Out: a cubic for every interval. With the intervals h, the chords' slopes d and the second derivatives M
//!
//! ```text
//! h_i-1 M_i-1 + 2 (h_i-1 + h_i) M_i + h_i M_i+1 = 6 (d_i - d_i-1)
//! ```
//!
//! and at the ends: M = 0 (BNAT, ENAT); the slope given, `2 h_0 M_0 + h_0 M_1 = 6 (d_0 - t)` (BTAN, ETAN); or the third derivative
//! continuous in the point next to the end, so that its two blocks are one cubic (BAUTO, EAUTO; with three points alone one parabola,
//! with two a line).
//!
//! All points act on all blocks, but what happens n points away by less than 2^-n (0.27^n for equal intervals). A block is therefore
//! made when [`LAG_CUBIC`] points beyond it are known, in windows that begin with the second derivative at which the last one ended.
//! Does not look at words.

use super::{EndCondition, PolynomialGeometry, chord_lu, one_piece};
use crate::base::{AxisVector, PerAxis};
use std::collections::VecDeque;
use std::sync::Arc;

/// Points that must be known beyond the end of a block: 0.27^48 is 1e-27, and the worst case 2^-48 is 4e-15.
pub const LAG_CUBIC: usize = 48;

/// A CSPLINE whose points arrive one by one.
#[derive(Clone, Debug)]
pub struct CubicSpline {
    linear: PerAxis<bool>,
    begin: Begin,
    /// From the start of the block that is solved next.
    points: VecDeque<AxisVector>,
    made: VecDeque<Arc<PolynomialGeometry>>,
}

/// What holds at the first point of a window.
#[derive(Clone, Copy, Debug)]
enum Begin {
    Condition(EndCondition),
    /// Second derivative.
    Known(AxisVector),
}

/// `before M_i-1 + own M_i + after M_i+1 = right`.
struct Row {
    before: f64,
    own: f64,
    after: f64,
    right: AxisVector,
}

impl CubicSpline {
    /// Begins at `start`.
    pub fn new(start: AxisVector, begin: EndCondition, linear: PerAxis<bool>) -> Self {
        let begin = Begin::Condition(begin);
        Self { linear, begin, points: VecDeque::from([start]), made: VecDeque::new() }
    }

    /// The next point, different from the one before.
    pub fn push(&mut self, point: AxisVector) {
        self.points.push_back(point);
        // A window of twice the lag, of which the first half is exact.
        if self.points.len() > 2 * LAG_CUBIC + 1 {
            self.solve(&EndCondition::Natural, LAG_CUBIC);
        }
    }

    /// The next block, if enough is known.
    pub fn ready(&mut self) -> Option<Arc<PolynomialGeometry>> {
        self.made.pop_front()
    }

    /// The next of the last blocks: no more points follow.
    pub fn finish(&mut self, end: &EndCondition) -> Option<Arc<PolynomialGeometry>> {
        if self.made.is_empty() && self.points.len() > 1 {
            self.solve(end, self.points.len() - 1);
        }
        self.made.pop_front()
    }

    /// Makes the first `blocks` blocks.
    fn solve(&mut self, end: &EndCondition, blocks: usize) {
        let points = self.points.make_contiguous();
        let widths: Vec<f64> = points.windows(2).map(|pair| chord_lu(&pair[0], &pair[1], &self.linear)).collect();
        let slopes: Vec<AxisVector> =
            points.windows(2).zip(&widths).map(|(pair, width)| (pair[1] - pair[0]) * (1.0 / width)).collect();
        let seconds = second_derivatives(&widths, &slopes, &self.begin, end);
        for i in 0..blocks {
            let (h, m0, m1) = (widths[i], seconds[i], seconds[i + 1]);
            let first = slopes[i] - (m0 * 2.0 + m1) * (h / 6.0);
            let third = (m1 - m0) * (1.0 / (6.0 * h));
            let zero = AxisVector::zero();
            self.made.push_back(one_piece([points[i], first, m0 * 0.5, third, zero, zero], h));
        }
        self.begin = Begin::Known(seconds[blocks]);
        self.points.drain(..blocks);
    }
}

/// M at every point.
fn second_derivatives(widths: &[f64], slopes: &[AxisVector], begin: &Begin, end: &EndCondition) -> Vec<AxisVector> {
    let last = widths.len();
    let zero = AxisVector::zero();
    let auto_begin = matches!(begin, Begin::Condition(EndCondition::Auto));
    let auto_end = *end == EndCondition::Auto;
    if last == 2 && auto_begin && auto_end {
        // The parabola through three points.
        let bend = (slopes[1] - slopes[0]) * (2.0 / (widths[0] + widths[1]));
        return vec![bend; 3];
    }
    let is_zero = |right: AxisVector| Row { before: 0.0, own: 1.0, after: 0.0, right };
    let first = match begin {
        Begin::Known(second) => is_zero(*second),
        Begin::Condition(EndCondition::Tangent(tangent)) => {
            let h = widths[0];
            Row { before: 0.0, own: 2.0 * h, after: h, right: (slopes[0] - *tangent) * 6.0 }
        }
        Begin::Condition(EndCondition::Natural | EndCondition::Auto) => is_zero(zero),
    };
    let final_row = match end {
        EndCondition::Tangent(tangent) => {
            let h = widths[last - 1];
            Row { before: h, own: 2.0 * h, after: 0.0, right: (*tangent - slopes[last - 1]) * 6.0 }
        }
        EndCondition::Natural | EndCondition::Auto => is_zero(zero),
    };
    let mut rows = vec![first];
    for i in 1..last {
        let (h0, h1) = (widths[i - 1], widths[i]);
        let right = (slopes[i] - slopes[i - 1]) * 6.0;
        let mut row = Row { before: h0, own: 2.0 * (h0 + h1), after: h1, right };
        // M_0 = ((h_0 + h_1) M_1 - h_0 M_2) / h_1, and likewise at the end.
        if i == 1 && auto_begin {
            row.own += h0 * (h0 + h1) / h1;
            row.after -= h0 * h0 / h1;
            row.before = 0.0;
        }
        if i == last - 1 && auto_end && last > 1 {
            row.own += h1 * (h0 + h1) / h0;
            row.before -= h1 * h1 / h0;
            row.after = 0.0;
        }
        rows.push(row);
    }
    rows.push(final_row);
    let mut seconds = eliminated(&rows);
    if last > 1 && auto_begin {
        let (h0, h1) = (widths[0], widths[1]);
        seconds[0] = (seconds[1] * (h0 + h1) - seconds[2] * h0) * (1.0 / h1);
    }
    if last > 1 && auto_end {
        let (h0, h1) = (widths[last - 2], widths[last - 1]);
        seconds[last] = (seconds[last - 1] * (h0 + h1) - seconds[last - 2] * h1) * (1.0 / h0);
    }
    seconds
}

/// Thomas' algorithm; the rows are diagonally dominant.
fn eliminated(rows: &[Row]) -> Vec<AxisVector> {
    let mut above: Vec<(f64, AxisVector)> = Vec::with_capacity(rows.len());
    for row in rows {
        let (after, right) = above.last().copied().unwrap_or((0.0, AxisVector::zero()));
        let own = row.own - row.before * after;
        above.push((row.after / own, (row.right - right * row.before) * (1.0 / own)));
    }
    let mut values = vec![AxisVector::zero(); rows.len()];
    let mut below = AxisVector::zero();
    for (value, (after, right)) in values.iter_mut().zip(&above).rev() {
        below = *right - below * *after;
        *value = below;
    }
    values
}
