//! COMPON and COMPCURV: polynomials from programmed point to programmed point.
//!
//! In: the points of a run. Out: polynomials, each over as many chords as the tolerance allows, that begin and end in programmed points.
//! There the curve has the direction, and with COMPCURV the curvature, of the polynomial that fits the points best on either side,
//! over as many points as the polynomial before spans: the longer the curves, the less of the rounding of the program is left in
//! them. With COMPON the curves are of degree 3 and their curvature steps; with COMPCURV they are of degree 5 and it does not.
//!
//! Where not even one chord keeps the tolerance it stays as programmed. Does not move points: that is `spline`.

use super::super::smoother::Held;
use super::super::transition::hermite;
use super::track::{Span, Track};
use crate::base::AxisVector;
use std::collections::VecDeque;

/// Chords of a span that are tried, most first.
const SPANS: [usize; 12] = [64, 48, 32, 24, 16, 12, 8, 6, 4, 3, 2, 1];

/// Chords that a fit looks at on either side of a node: as many as the span has, but not less.
const SIDE_MIN: usize = 2;
const SIDE_MAX: usize = 64;
const POINTS_MAX: usize = 2 * SIDE_MAX + 1;

/// Chords that are known before a span is chosen.
const AHEAD: usize = 2 * SIDE_MAX;

/// The curve in a point.
#[derive(Clone, Copy, Debug)]
struct Node {
    position: AxisVector,
    first: AxisVector,
    second: AxisVector,
}

/// The curve of a run.
#[derive(Clone, Debug)]
pub(super) struct Nodes {
    /// Curvature goes on, too.
    curvature: bool,
    /// Where the next span begins; `None` at the start of the run.
    start: Option<Node>,
    /// The point before that, for fits.
    before: Option<(AxisVector, f64)>,
    /// Index into [`SPANS`] of the first one to try.
    from: usize,
}

impl Nodes {
    pub(super) fn new(curvature: bool) -> Self {
        Self { curvature, start: None, before: None, from: 0 }
    }

    /// Hands over what is decided; at the end of a run all of it.
    pub(super) fn hand_over(&mut self, track: &mut Track, ending: bool, ready: &mut VecDeque<Held>) {
        while track.chords() > if ending { 0 } else { AHEAD } {
            match self.longest(track) {
                Some((span, end)) => {
                    self.before = track.points.get(span.chords - 1).map(|point| (point.position, point.along_lu));
                    let last = ending && span.chords == track.chords();
                    track.advance(&span, last, ready);
                    self.start = Some(end);
                }
                None => {
                    self.before = None;
                    track.as_programmed(1, ready);
                    self.start = None;
                }
            }
        }
    }

    /// The longest span that keeps the tolerance, with the node at its end.
    fn longest(&mut self, track: &Track) -> Option<(Span, Node)> {
        for (index, wanted) in SPANS.into_iter().enumerate().skip(self.from) {
            let chords = wanted.min(track.chords());
            let start = match self.start {
                Some(start) => start,
                None => self.node(track, 0, chords)?,
            };
            let end = self.node(track, chords, chords)?;
            let span = Span { chords, numerator_lu: self.polynomial(track, &start, &end, chords) };
            if track.share_of(0, &span) <= 1.0 {
                // The next one may be longer again.
                self.from = index.saturating_sub(2);
                // What the polynomial arrives at, so that rounding is not handed on.
                return Some((span, end));
            }
        }
        self.from = 0;
        None
    }

    fn polynomial(&self, track: &Track, start: &Node, end: &Node, chords: usize) -> [AxisVector; 6] {
        let h = track.points[chords].along_lu - track.points[0].along_lu;
        let (p, m, q, n) = (start.position, start.first, end.position, end.first);
        if self.curvature {
            return hermite(h, [p, m, start.second], [q, n, end.second]);
        }
        let chord = (q - p) * (1.0 / h);
        let second = (chord * 3.0 - m * 2.0 - n) * (1.0 / h);
        let third = (m + n - chord * 2.0) * (1.0 / (h * h));
        [p, m, second, third, AxisVector::zero(), AxisVector::zero()]
    }

    /// The curve in a point: direction and curvature of the polynomial that fits the points around it best.
    fn node(&self, track: &Track, index: usize, span: usize) -> Option<Node> {
        let point = track.points.get(index)?;
        let side = span.clamp(SIDE_MIN, SIDE_MAX);
        let low = index.saturating_sub(side);
        let high = (index + side).min(track.points.len() - 1);
        let before = self.before.filter(|_| index < side);
        let known = before.into_iter();
        let around = known.chain(track.points.range(low..=high).map(|point| (point.position, point.along_lu)));
        let (mut places, mut offsets, mut count) = ([0.0; POINTS_MAX], [AxisVector::zero(); POINTS_MAX], 0);
        for (position, along_lu) in around.take(POINTS_MAX) {
            (places[count], offsets[count]) = (along_lu - point.along_lu, position - point.position);
            count += 1;
        }
        // From one side only, high degrees say more of the rounding than of the curve.
        let ends = index == 0 && self.before.is_none() || index + 1 == track.points.len();
        let degree = if ends { 3 } else { 4 } - if self.curvature { 0 } else { 1 };
        let weights = fit(&places[..count], degree.min(count - 1));
        let [mut first, mut second] = [AxisVector::zero(); 2];
        for (i, offset) in offsets[..count].iter().enumerate() {
            first += *offset * weights[0][i];
            second += *offset * weights[1][i];
        }
        Some(Node { position: point.position, first, second })
    }
}

/// Weights of values at `places` in the first and second derivative at 0 of the polynomial that fits them best, by polynomials that
/// are orthogonal over the places.
fn fit(places: &[f64], degree: usize) -> [[f64; POINTS_MAX]; 2] {
    let mut weights = [[0.0; POINTS_MAX]; 2];
    let (mut values, mut values_before) = ([1.0; POINTS_MAX], [0.0; POINTS_MAX]);
    let (mut at_zero, mut at_zero_before) = ([1.0, 0.0, 0.0], [0.0; 3]);
    let mut norm_before = 1.0;
    for k in 0..=degree {
        let norm: f64 = places.iter().zip(&values).map(|(_, value)| value * value).sum();
        for (row, derivative) in weights.iter_mut().zip([at_zero[1], at_zero[2]]) {
            for (weight, value) in row.iter_mut().zip(&values[..places.len()]) {
                *weight += derivative * value / norm;
            }
        }
        let centre = places.iter().zip(&values).map(|(place, value)| place * value * value).sum::<f64>() / norm;
        let back = if k == 0 { 0.0 } else { norm / norm_before };
        let mut following = [0.0; POINTS_MAX];
        for (i, place) in places.iter().enumerate() {
            following[i] = (place - centre) * values[i] - back * values_before[i];
        }
        let [value, first, second] = at_zero;
        let next_at_zero = [
            -centre * value - back * at_zero_before[0],
            value - centre * first - back * at_zero_before[1],
            2.0 * first - centre * second - back * at_zero_before[2],
        ];
        (values_before, values) = (values, following);
        (at_zero_before, at_zero) = (at_zero, next_at_zero);
        norm_before = norm;
    }
    weights
}
