//! The programmed path of a run: points, blocks, and the tube around them.
//!
//! In: blocks. Out: the points between which curves are fitted, the check that a polynomial stays in the tolerance, and the blocks with
//! the stretch of their polynomial as their curve.
//!
//! A block is as many chords as `chords` says. A polynomial is compared with the chord at the same place along it, so that neither is further from
//! the other than the tolerance. Between two points the difference of the two is the polynomial less its chord, which is not more than
//! `h²/8 max |q''|`, plus what lies between the differences at the points; where that is too coarse, it is less than its greatest
//! Bernstein coefficient. What an arc rises above its chord is added. All are bounds, not samples.
//!
//! Does not find the polynomial.

use super::super::smoother::Held;
use super::super::transition::{Tolerances, hermite, piece};
use super::chords::Chords;
use crate::base::{AxisVector, PartPoint, PerAxis};
use crate::geometry::{Curve, CurveState, Line, PolynomialCurve};
use crate::interpreter::{PolynomialGeometry, PolynomialPiece};
use std::collections::VecDeque;
use std::sync::Arc;

/// A point of the programmed path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub position: AxisVector,
    /// Chord length from the start of the run.
    pub along_lu: f64,
    /// A block ends here.
    pub ends_block: bool,
    /// From the start of its block.
    place_lu: f64,
    /// Share of the tolerance that the chord up to here takes: 0 for a straight block.
    pub sag_share: f64,
}

/// A polynomial over several chords: its parameter is the chord length from its first point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    /// How many chords.
    pub chords: usize,
    pub numerator_lu: [AxisVector; 6],
}

/// Blocks that are being made one curve, from the place up to which curves have been handed over.
#[derive(Clone, Debug)]
pub(super) struct Track {
    pub tolerances: Tolerances,
    pub linear: PerAxis<bool>,
    /// The first one is where the next span begins.
    pub points: VecDeque<Point>,
    pub blocks: VecDeque<Held>,
    /// Where the curves handed over end.
    end: PartPoint,
    /// Pieces of the first block whose end has not been reached.
    pieces: Vec<PolynomialPiece>,
    /// Something has been handed over.
    pub begun: bool,
}

impl Track {
    pub(super) fn new(start: PartPoint, tolerances: Tolerances, linear: &PerAxis<bool>) -> Self {
        let first = Point { position: start.0, along_lu: 0.0, ends_block: true, place_lu: 0.0, sag_share: 0.0 };
        Self {
            tolerances,
            linear: *linear,
            points: VecDeque::from([first]),
            blocks: VecDeque::new(),
            end: start,
            pieces: Vec::new(),
            begun: false,
        }
    }

    /// Appends a block with the points that stand for it; how many.
    pub(super) fn add(&mut self, block: Held, chords: &Chords) -> usize {
        let (length_lu, sag_share) = (block.curve.length_lu(), chords.sag_share);
        let count = chords.places_lu.len() + 1;
        for (i, place_lu) in chords.places_lu.iter().copied().chain([length_lu]).enumerate() {
            let ends_block = i + 1 == count;
            let position = if ends_block { block.curve.end().0 } else { block.curve.at(place_lu).position.0 };
            let before = self.points.back().map_or((AxisVector::zero(), 0.0), |last| (last.position, last.along_lu));
            let along_lu = before.1 + (position - before.0).masked(&self.linear).norm();
            self.points.push_back(Point { position, along_lu, ends_block, place_lu, sag_share });
        }
        self.blocks.push_back(block);
        count
    }

    /// How many chords wait.
    pub(super) fn chords(&self) -> usize {
        self.points.len() - 1
    }

    /// Greatest share of the tolerance that a polynomial over `span.chords` chords from point `first` may take, or more; above 1 it
    /// may be any number above 1.
    pub(super) fn share_of(&self, first: usize, span: &Span) -> f64 {
        let Some(start) = self.points.get(first) else { return f64::INFINITY };
        let last = (first + span.chords).min(self.points.len() - 1);
        let h = self.points[last].along_lu - start.along_lu;
        let bend = most_second(&span.numerator_lu, h);
        let mut before_share = self.share(&(span.numerator_lu[0] - start.position));
        let mut from_lu = 0.0;
        let mut greatest: f64 = 0.0;
        for i in first + 1..=last {
            let point = &self.points[i];
            let to_lu = point.along_lu - start.along_lu;
            let after_share = self.share(&(value(&span.numerator_lu, to_lu) - point.position));
            let width_lu = to_lu - from_lu;
            let ends = before_share.max(after_share);
            let mut share = ends + self.share(&(bend * (0.125 * width_lu * width_lu)));
            if share + point.sag_share > 1.0 && ends < 1.0 {
                let chord = [self.points[i - 1].position, point.position];
                share = self.finer(&shifted(&span.numerator_lu, from_lu), chord, width_lu);
            }
            greatest = greatest.max(share + point.sag_share);
            if greatest.is_nan() || greatest > 1.0 {
                return f64::INFINITY;
            }
            (before_share, from_lu) = (after_share, to_lu);
        }
        greatest
    }

    /// The bound by Bernstein coefficients over one chord.
    fn finer(&self, coefficients: &[AxisVector; 6], [start, end]: [AxisVector; 2], width_lu: f64) -> f64 {
        let way = end - start;
        let shares = bernstein(coefficients, width_lu).into_iter().enumerate();
        let shares = shares.map(|(k, coefficient)| self.share(&(coefficient - start - way * (k as f64 / 5.0))));
        shares.fold(0.0, f64::max)
    }

    /// Share of the tolerance that a deviation takes; a NaN is more than any.
    pub(super) fn share(&self, deviation: &AxisVector) -> f64 {
        self.tolerances.share(deviation, &self.linear)
    }

    /// Hands over a span: its chords leave the track.
    pub(super) fn advance(&mut self, span: &Span, last: bool, ready: &mut VecDeque<Held>) {
        let count = span.chords.min(self.chords());
        let start_lu = self.points[0].along_lu;
        let whole_lu = self.points[count].along_lu - start_lu;
        let is_last = last && count == self.chords();
        let (mut from_lu, mut from_shared_lu) = (0.0, 0.0);
        let shared = self.shared(span, whole_lu, is_last);
        for i in 1..=count {
            let Point { along_lu, ends_block, .. } = self.points[i];
            if !ends_block {
                continue;
            }
            let to_lu = if i == count { whole_lu } else { along_lu - start_lu };
            if let Some(shared) = &shared {
                let to_shared_lu = if i == count { f64::INFINITY } else { shared.length_at_lu(to_lu) };
                let curve = Curve::from(shared.clone()).trimmed(from_shared_lu, to_shared_lu);
                from_shared_lu = to_shared_lu;
                self.hand_over(curve, ready);
            } else {
                self.pieces.push(piece(to_lu - from_lu, shifted(&span.numerator_lu, from_lu)));
                self.end_pieces(is_last && i == count, ready);
            }
            from_lu = to_lu;
        }
        if from_lu < whole_lu {
            self.pieces.push(piece(whole_lu - from_lu, shifted(&span.numerator_lu, from_lu)));
        }
        self.points.drain(..count);
    }

    /// The curve of a whole span, where it begins with a block and every chord is one: they share its table.
    fn shared(&self, span: &Span, whole_lu: f64, last: bool) -> Option<PolynomialCurve> {
        let mut chords = self.points.range(1..=span.chords.min(self.chords()));
        if !self.pieces.is_empty() || !chords.all(|point| point.ends_block) {
            return None;
        }
        let end = value(&span.numerator_lu, whole_lu);
        let end = if last { self.points.back().map_or(end, |point| point.position) } else { end };
        let geometry = Arc::new(PolynomialGeometry { pieces: vec![piece(whole_lu, span.numerator_lu)] });
        let curve = PolynomialCurve::new(self.end, PartPoint(end), &geometry, &self.linear);
        (curve.length_lu() > 0.0).then_some(curve)
    }

    /// The pieces of a block that lies in several spans become its curve.
    fn end_pieces(&mut self, last: bool, ready: &mut VecDeque<Held>) {
        let pieces = std::mem::take(&mut self.pieces);
        let end = pieces.last().map_or(self.end.0, |piece| value(&piece.numerator_lu, piece.parameter_end_ratio));
        let end = if last { self.points.back().map_or(end, |point| point.position) } else { end };
        let curve =
            PolynomialCurve::new(self.end, PartPoint(end), &Arc::new(PolynomialGeometry { pieces }), &self.linear);
        let curve = if curve.length_lu() > 0.0 {
            Curve::from(curve)
        } else {
            Curve::Line(Line::new(self.end, PartPoint(end), &self.linear))
        };
        self.hand_over(curve, ready);
    }

    /// Hands over some chords as they are programmed, from where the curve is.
    pub(super) fn as_programmed(&mut self, chords: usize, ready: &mut VecDeque<Held>) {
        for _ in 0..chords.min(self.chords()) {
            let [start, end] = [0, 1].map(|index| self.points[index]);
            let line = self.blocks.front().is_none_or(|block| matches!(block.curve, Curve::Line(_)));
            if line && end.ends_block && self.pieces.is_empty() {
                self.hand_over(Curve::Line(Line::new(self.end, PartPoint(end.position), &self.linear)), ready);
            } else {
                let numerator_lu = if line { self.straight(&start, &end) } else { self.bent(&start, &end) };
                self.pieces.push(piece(end.along_lu - start.along_lu, numerator_lu));
                if end.ends_block {
                    self.end_pieces(false, ready);
                }
            }
            self.points.pop_front();
        }
    }

    /// Where the curves end.
    fn reached(&self) -> AxisVector {
        self.pieces.last().map_or(self.end.0, |piece| value(&piece.numerator_lu, piece.parameter_end_ratio))
    }

    fn straight(&self, start: &Point, end: &Point) -> [AxisVector; 6] {
        let from = self.reached();
        let mut numerator_lu = [AxisVector::zero(); 6];
        numerator_lu[0] = from;
        numerator_lu[1] = (end.position - from) * (1.0 / (end.along_lu - start.along_lu));
        numerator_lu
    }

    /// A chord of an arc, with the direction and the curvature of the arc at both ends: over [`Chords`] the two are 1e-9 apart.
    fn bent(&self, start: &Point, end: &Point) -> [AxisVector; 6] {
        let Some(block) = self.blocks.front() else { return self.straight(start, end) };
        let from_lu = if start.ends_block { 0.0 } else { start.place_lu };
        let width_lu = end.along_lu - start.along_lu;
        let ratio = (end.place_lu - from_lu) / width_lu;
        let [first, last] = [from_lu, end.place_lu].map(|place_lu| block.curve.at(place_lu));
        let slopes = |state: &CurveState| [state.first * ratio, state.second * (ratio * ratio)];
        let ([m, a], [n, b]) = (slopes(&first), slopes(&last));
        hermite(width_lu, [self.reached(), m, a], [end.position, n, b])
    }

    fn hand_over(&mut self, curve: Curve, ready: &mut VecDeque<Held>) {
        let Some(mut block) = self.blocks.pop_front() else { return };
        self.end = curve.end();
        block.programmed = Some(Box::new(std::mem::replace(&mut block.curve, curve)));
        self.begun = true;
        ready.push_back(block);
    }
}

/// Greatest second derivative on [0, h], component by component: Bernstein coefficients of it.
fn most_second(c: &[AxisVector; 6], h: f64) -> AxisVector {
    let power = [c[2] * 2.0, c[3] * (6.0 * h), c[4] * (12.0 * h * h), c[5] * (20.0 * h * h * h)];
    let bezier = [
        power[0],
        power[0] + power[1] * (1.0 / 3.0),
        power[0] + power[1] * (2.0 / 3.0) + power[2] * (1.0 / 3.0),
        power[0] + power[1] + power[2] + power[3],
    ];
    let mut most = AxisVector::zero();
    for coefficient in bezier {
        for (most, component) in most.as_mut_slice().iter_mut().zip(coefficient.as_slice()) {
            *most = most.max(component.abs());
        }
    }
    most
}

/// The polynomial at u.
pub(super) fn value(coefficients: &[AxisVector; 6], u: f64) -> AxisVector {
    coefficients.iter().rev().fold(AxisVector::zero(), |sum, coefficient| sum * u + *coefficient)
}

/// Coefficients of the polynomial of u + by.
pub(super) fn shifted(coefficients: &[AxisVector; 6], by: f64) -> [AxisVector; 6] {
    let mut c = *coefficients;
    if by != 0.0 {
        for low in 0..5 {
            for k in (low..5).rev() {
                let above = c[k + 1];
                c[k] += above * by;
            }
        }
    }
    c
}

/// Bernstein coefficients of a polynomial of degree 5 on [0, h].
fn bernstein(coefficients: &[AxisVector; 6], h_lu: f64) -> [AxisVector; 6] {
    // Binomial(k, i) / binomial(5, i).
    const RATIOS: [[f64; 6]; 6] = [
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 0.2, 0.0, 0.0, 0.0, 0.0],
        [1.0, 0.4, 0.1, 0.0, 0.0, 0.0],
        [1.0, 0.6, 0.3, 0.1, 0.0, 0.0],
        [1.0, 0.8, 0.6, 0.4, 0.2, 0.0],
        [1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
    ];
    RATIOS.map(|row| {
        let mut power = 1.0;
        row.iter().zip(coefficients).fold(AxisVector::zero(), |sum, (ratio, coefficient)| {
            let next = sum + *coefficient * (ratio * power);
            power *= h_lu;
            next
        })
    })
}
