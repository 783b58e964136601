//! A straight line in all axes.
//!
//! In: start and end. Out: [`Line`]: q(s) = start + s * direction. Does not change its direction when it is shortened.

use super::CurveState;
use super::curve::{length_over, parameter_length};
use crate::base::{AxisVector, PartPoint, PerAxis};

/// Straight in all axes, linear and rotary together.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    start: PartPoint,
    end: PartPoint,
    direction: AxisVector,
    length_lu: f64,
    rotary_only: bool,
}

impl Line {
    /// From `start` to `end`; `linear` says which axes count as path length. A line without displacement has length 0 and
    /// direction 0.
    pub fn new(start: PartPoint, end: PartPoint, linear: &PerAxis<bool>) -> Self {
        let displacement = end.0 - start.0;
        let (length_lu, rotary_only) = parameter_length(length_over(&displacement, linear), &displacement, linear);
        let direction = if length_lu > 0.0 { displacement.map(|d| d / length_lu) } else { AxisVector::zero() };
        Self { start, end, direction, length_lu, rotary_only }
    }

    /// dq/ds: unit length over the linear axes (over the rotary axes where only these move).
    pub fn direction(&self) -> &AxisVector {
        &self.direction
    }

    /// Length of the parameter range.
    pub fn length_lu(&self) -> f64 {
        self.length_lu
    }

    /// True where no linear axis moves: lengths are then in rad.
    pub fn rotary_only(&self) -> bool {
        self.rotary_only
    }

    /// First point.
    pub fn start(&self) -> PartPoint {
        self.start
    }

    /// Last point.
    pub fn end(&self) -> PartPoint {
        self.end
    }

    /// The line at s, clamped to its ends.
    pub fn at(&self, s_lu: f64) -> CurveState {
        let position = if s_lu >= self.length_lu {
            self.end
        } else if s_lu > 0.0 {
            PartPoint(self.start.0 + self.direction * s_lu)
        } else {
            self.start
        };
        CurveState { position, first: self.direction, second: AxisVector::zero(), third: AxisVector::zero() }
    }

    /// Without the first `head_lu` and the last `tail_lu`. Each cut is measured from its own end, so that a cut point does not
    /// depend on the other end of the line: a blend that computes `corner - T * direction` meets it to the last bit.
    pub fn shortened(&self, head_lu: f64, tail_lu: f64) -> Self {
        let head_lu = head_lu.max(0.0).min(self.length_lu);
        let tail_lu = tail_lu.max(0.0).min(self.length_lu - head_lu);
        let mut part = self.clone();
        part.length_lu = self.length_lu - head_lu - tail_lu;
        if head_lu > 0.0 {
            part.start = PartPoint(self.start.0 + self.direction * head_lu);
        }
        if tail_lu > 0.0 {
            part.end = PartPoint(self.end.0 + self.direction * -tail_lu);
        }
        part
    }
}
