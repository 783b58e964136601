//! ASPLINE: the local cubic spline of Akima. Tangents are continuous, curvature is not; a point acts on three blocks to either side.
//!
//! In: points in order. Out: a cubic for every interval. With the slopes `d_i = (P_i+1 - P_i) / h_i` of the chords the tangent in P_i is
//!
//! ```text
//! t_i = ( |d_i+1 - d_i| d_i-1 + |d_i-1 - d_i-2| d_i ) / ( |d_i+1 - d_i| + |d_i-1 - d_i-2| )
//! ```
//!
//! and the mean of the two chords where both differences vanish. The amounts are those of the linear axes together (of the rotary axes
//! where only these move): one weight for all axes, so that the curve turns with its points. Beyond the ends two chords are added, each
//! as different from its neighbour as that one from the next (EAUTO); ENAT and ETAN set the tangent at the end itself.
//! Does not look at words.

use super::{EndCondition, PolynomialGeometry, chord_lu, hermite};
use crate::base::{AxisVector, PerAxis};
use std::collections::VecDeque;
use std::sync::Arc;

/// Points that must be known beyond the end of a block.
pub const LAG_AKIMA: usize = 2;

/// Differences of slopes below this are rounding of coordinates.
const SAME_SLOPE_RATIO: f64 = 1e-9;

/// An ASPLINE whose points arrive one by one.
#[derive(Clone, Debug)]
pub struct AkimaSpline {
    linear: PerAxis<bool>,
    begin: EndCondition,
    /// The last points: two before the block that is made next, if there are so many, and all after.
    points: VecDeque<AxisVector>,
    /// Place of the block that is made next among them.
    next: usize,
    begun: bool,
}

impl AkimaSpline {
    /// Begins at `start`.
    pub fn new(start: AxisVector, begin: EndCondition, linear: PerAxis<bool>) -> Self {
        Self { linear, begin, points: VecDeque::from([start]), next: 0, begun: true }
    }

    /// The next point, different from the one before.
    pub fn push(&mut self, point: AxisVector) {
        self.points.push_back(point);
    }

    /// The next block, if enough is known.
    pub fn ready(&mut self) -> Option<Arc<PolynomialGeometry>> {
        (self.next + 1 + LAG_AKIMA < self.points.len()).then(|| self.make(&EndCondition::Auto))
    }

    /// The next of the last blocks: no more points follow.
    pub fn finish(&mut self, end: &EndCondition) -> Option<Arc<PolynomialGeometry>> {
        (self.next + 1 < self.points.len()).then(|| self.make(end))
    }

    fn make(&mut self, end: &EndCondition) -> Arc<PolynomialGeometry> {
        let i = self.next;
        let width = chord_lu(&self.points[i], &self.points[i + 1], &self.linear);
        let tangents = [self.tangent(i, end), self.tangent(i + 1, end)];
        let made = hermite([self.points[i], self.points[i + 1]], tangents, width);
        self.next += 1;
        if self.next > 2 {
            self.points.pop_front();
            self.next -= 1;
            self.begun = false;
        }
        made
    }

    /// d_i; beyond the ends by the rule of the module's head.
    fn slope(&self, i: isize) -> AxisVector {
        let last = self.points.len() as isize - 2;
        let inside = |i: isize| {
            let i = i.clamp(0, last) as usize;
            let (from, to) = (&self.points[i], &self.points[i + 1]);
            (*to - *from) * (1.0 / chord_lu(from, to, &self.linear))
        };
        if i < 0 {
            inside(0) + (inside(0) - inside(1)) * (-i) as f64
        } else if i > last {
            inside(last) + (inside(last) - inside(last - 1)) * (i - last) as f64
        } else {
            inside(i)
        }
    }

    fn tangent(&self, i: usize, end: &EndCondition) -> AxisVector {
        let last = self.points.len() - 1;
        // No curvature at an end: 2 t_0 + t_1 = 3 d_0.
        let natural = |slope: AxisVector, other: AxisVector| (slope * 3.0 - other) * 0.5;
        // One block alone: both ends may ask for each other's tangent.
        let single = last == 1;
        if i == 0 && self.begun {
            match self.begin {
                EndCondition::Tangent(tangent) => return tangent,
                EndCondition::Natural if single && *end == EndCondition::Natural => return self.slope(0),
                EndCondition::Natural => return natural(self.slope(0), self.tangent(1, end)),
                EndCondition::Auto => {}
            }
        }
        if i == last {
            match end {
                EndCondition::Tangent(tangent) => return *tangent,
                EndCondition::Natural if single && self.begin == EndCondition::Natural => return self.slope(0),
                EndCondition::Natural => return natural(self.slope(last as isize - 1), self.tangent(last - 1, end)),
                EndCondition::Auto => {}
            }
        }
        let at = i as isize;
        let [a, b, c, d] = [at - 2, at - 1, at, at + 1].map(|i| self.slope(i));
        let amount = |difference: AxisVector| {
            let linear = difference.masked(&self.linear).norm();
            let moves_linear = b.masked(&self.linear).norm() > 0.0 || c.masked(&self.linear).norm() > 0.0;
            if moves_linear { linear } else { difference.norm() }
        };
        let (before, after) = (amount(b - a), amount(d - c));
        let sum = before + after;
        if sum < SAME_SLOPE_RATIO { (b + c) * 0.5 } else { b * (after / sum) + c * (before / sum) }
    }
}
