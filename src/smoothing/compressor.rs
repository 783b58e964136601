//! COMPON, COMPCURV, COMPCAD, COMPSURF: runs of short straight blocks become smooth curves.
//!
//! In: blocks in order. Out: the same blocks in order, one curve a block, so that block numbers, feeds and events stay. A block
//! goes on as it is where the compressor is off, and where it is no short G1: rapids, arcs, exact stop, blocks of rotary axes
//! alone, blocks longer than `compressor_length_max_mm`. A run ends where one of these stands, where a block has something to put
//! out, where the modes change, at corners of `compressor_corner_deg` or more, and where the blocks are too long for their turn to
//! be a curve within the tolerance.
//!
//! In a run every programmed point gets a position, a direction and a curvature from the points around it: by a polynomial through
//! them (COMPON, COMPCURV), or by least squares over more of them (COMPCAD, COMPSURF), which takes the rounding of the program
//! out. The ends of a run stay where they are. Between two points stands the polynomial of degree 5 that has both (COMPON: of
//! degree 3, direction only). Its deviation from the programmed line is less than the greatest difference of its Bernstein
//! coefficients: where that is above CTOL, OTOL or ATOL, a straight line takes its place.
//!
//! Memory: the points of one window. Does not round what corners are left: that is `corner`.

use super::corner::Rules;
use super::smoother::Held;
use super::transition::{Tolerances, hermite, piece};
use crate::base::{AxisVector, PartPoint, PerAxis};
use crate::geometry::{Curve, Line, PolynomialCurve};
use crate::interpreter::{Compressor, Feed, Modes, PolynomialGeometry};
use crate::machine::PathMode;
use std::collections::VecDeque;
use std::sync::Arc;

/// Points on either side that a fit looks at, and its degree.
const INTERPOLATED: Window = Window { side: 2, degree: 4, smooths: false };
const SURFACE: Window = Window { side: 3, degree: 3, smooths: true };
const TOP_SURFACE: Window = Window { side: 4, degree: 3, smooths: true };

/// Most points of a window.
const POINTS_MAX: usize = 9;

/// Share of the tolerance that a point may be moved by.
const MOVED_SHARE: f64 = 0.4;

/// Share of the tolerance that the curve between two points may rise above its chord, as estimated from the turn.
const RISE_SHARE: f64 = 0.5;

#[derive(Clone, Copy, Debug)]
struct Window {
    side: usize,
    degree: usize,
    smooths: bool,
}

/// The compressor: blocks in, blocks out.
#[derive(Clone, Debug, Default)]
pub(super) struct Compression {
    run: Option<Run>,
    ready: VecDeque<Held>,
}

/// Blocks that are being made one curve.
#[derive(Clone, Debug)]
struct Run {
    compressor: Compressor,
    tolerances: Tolerances,
    /// Programmed points with their chord length from the start of the run, as far as they are needed.
    points: VecDeque<(PartPoint, f64)>,
    /// Where the first block stands among the points.
    at: usize,
    blocks: VecDeque<Held>,
    /// Something has been handed over already: the first point is not the start of the run.
    begun: bool,
    start: Option<Node>,
}

/// The curve in a programmed point.
#[derive(Clone, Copy, Debug)]
struct Node {
    position: PartPoint,
    first: AxisVector,
    second: AxisVector,
}

impl Compression {
    /// Takes a block.
    pub(super) fn push(&mut self, block: Held, rules: &Rules) {
        let Some(line) = eligible(&block, rules) else {
            self.flush(rules);
            self.ready.push_back(block);
            return;
        };
        if !self.run.as_ref().is_some_and(|run| run.goes_on(&block, line, rules)) {
            self.flush(rules);
        }
        let run = self.run.get_or_insert_with(|| Run::new(&block.head.modes, line.start(), rules));
        run.add(block);
        let side = window(run.compressor).side;
        while run.blocks.len() > side {
            self.ready.extend(run.next(false, rules.linear()));
        }
    }

    /// The next block that is done.
    pub(super) fn pop(&mut self) -> Option<Held> {
        self.ready.pop_front()
    }

    /// Nothing waits in a run, and this block would not.
    pub(super) fn passes(&self, block: &Held) -> bool {
        self.run.is_none() && block.head.modes.compressor == Compressor::Off
    }

    /// Ends the run.
    pub(super) fn flush(&mut self, rules: &Rules) {
        let Some(mut run) = self.run.take() else { return };
        if !run.begun && run.blocks.len() == 1 {
            self.ready.extend(run.blocks);
            return;
        }
        while !run.blocks.is_empty() {
            self.ready.extend(run.next(true, rules.linear()));
        }
    }
}

/// The line of a block that may be compressed.
fn eligible<'a>(block: &'a Held, rules: &Rules) -> Option<&'a Line> {
    let modes = &block.head.modes;
    let Curve::Line(line) = &block.curve else { return None };
    let asked = modes.compressor != Compressor::Off && modes.path_mode != PathMode::ExactStop;
    let short = line.length_lu() <= rules.compressor_length_max_mm();
    (asked && short && !line.rotary_only() && block.head.feed != Feed::Rapid).then_some(line)
}

fn window(compressor: Compressor) -> Window {
    match compressor {
        Compressor::Off | Compressor::On | Compressor::Curvature => INTERPOLATED,
        Compressor::Cad => SURFACE,
        Compressor::Surface => TOP_SURFACE,
    }
}

impl Run {
    fn new(modes: &Modes, start: PartPoint, rules: &Rules) -> Self {
        Self {
            compressor: modes.compressor,
            tolerances: rules.own_tolerances(modes),
            points: VecDeque::from([(start, 0.0)]),
            at: 0,
            blocks: VecDeque::new(),
            begun: false,
            start: None,
        }
    }

    /// The block continues the curve.
    fn goes_on(&self, block: &Held, line: &Line, rules: &Rules) -> bool {
        let Some(last) = self.blocks.back() else { return false };
        let Curve::Line(before) = &last.curve else { return false };
        if !block.head.events.is_empty() || block.head.modes != last.head.modes || before.end() != line.start() {
            return false;
        }
        let [u, v] = [before, line].map(|line| line.direction().masked(rules.linear()));
        let turn_rad = 2.0 * (v - u).norm().atan2((v + u).norm());
        let (h, k) = (before.length_lu(), line.length_lu());
        let rise_mm = turn_rad * h.max(k).powi(2) / (4.0 * (h + k));
        turn_rad < rules.compressor_corner_rad() && rise_mm <= RISE_SHARE * self.tolerances.contour_mm
    }

    fn add(&mut self, block: Held) {
        let along_lu = self.points.back().map_or(0.0, |(_, along_lu)| *along_lu);
        self.points.push_back((block.curve.end(), along_lu + block.curve.length_lu()));
        self.blocks.push_back(block);
    }

    /// The first block as a curve. `ending`: no more points follow.
    fn next(&mut self, ending: bool, linear: &PerAxis<bool>) -> Option<Held> {
        let mut block = self.blocks.pop_front()?;
        let start = match self.start {
            Some(start) => start,
            None => self.node(self.at, !self.begun, linear)?,
        };
        let last = ending && self.blocks.is_empty();
        let end = self.node(self.at + 1, last, linear)?;
        let (from, to) = (self.points.get(self.at)?, self.points.get(self.at + 1)?);
        let curve = self.curve(&start, &end, [from.0, to.0], to.1 - from.1, linear);
        block.curve = curve.unwrap_or_else(|| Curve::Line(Line::new(start.position, end.position, linear)));
        self.begun = true;
        self.start = Some(end);
        self.at += 1;
        while self.at > window(self.compressor).side {
            self.points.pop_front();
            self.at -= 1;
        }
        Some(block)
    }

    /// The polynomial between two nodes, if it keeps the tolerances about the programmed line.
    fn curve(
        &self,
        start: &Node,
        end: &Node,
        programmed: [PartPoint; 2],
        h_lu: f64,
        linear: &PerAxis<bool>,
    ) -> Option<Curve> {
        let [p, q] = [start.position.0, end.position.0];
        let (m, n) = (start.first, end.first);
        let coefficients = if self.compressor == Compressor::On {
            let chord = (q - p) * (1.0 / h_lu);
            let second = (chord * 3.0 - m * 2.0 - n) * (1.0 / h_lu);
            let third = (m + n - chord * 2.0) * (1.0 / (h_lu * h_lu));
            [p, m, second, third, AxisVector::zero(), AxisVector::zero()]
        } else {
            hermite(h_lu, [p, m, start.second], [q, n, end.second])
        };
        let way = programmed[1].0 - programmed[0].0;
        let keeps = bernstein(&coefficients, h_lu).iter().enumerate().all(|(k, coefficient)| {
            let deviation = *coefficient - programmed[0].0 - way * (k as f64 / 5.0);
            self.tolerances.share(&deviation, linear) <= 1.0
        });
        if !keeps {
            return None;
        }
        let geometry = Arc::new(PolynomialGeometry { pieces: vec![piece(h_lu, coefficients)] });
        let curve = PolynomialCurve::new(start.position, end.position, &geometry, linear);
        (curve.length_lu() > 0.0).then_some(Curve::Polynomial(curve))
    }

    /// The curve in a point; `fixed`: it stays where it is.
    fn node(&self, index: usize, fixed: bool, linear: &PerAxis<bool>) -> Option<Node> {
        let Window { side, degree, smooths } = window(self.compressor);
        let (programmed, at_lu) = *self.points.get(index)?;
        let low = index.saturating_sub(side);
        let high = (index + side).min(self.points.len() - 1);
        let count = (high - low + 1).min(POINTS_MAX);
        let mut places = [0.0; POINTS_MAX];
        for (place, (_, along_lu)) in places.iter_mut().zip(self.points.range(low..=high)) {
            *place = along_lu - at_lu;
        }
        let weights = fit(&places[..count], degree.min(count - 1));
        let mut sums = [AxisVector::zero(); 3];
        for (i, (point, _)) in self.points.range(low..=high).enumerate() {
            // Relative to the point itself: no digits are lost.
            let offset = point.0 - programmed.0;
            for (sum, weights) in sums.iter_mut().zip(&weights) {
                *sum += offset * weights[i];
            }
        }
        let [moved, first, second] = sums;
        let position = if fixed || !smooths {
            programmed
        } else {
            let share = self.tolerances.share(&moved, linear);
            let factor = if share > MOVED_SHARE { MOVED_SHARE / share } else { 1.0 };
            // Points at the same place but for rounding have no fit.
            if share.is_finite() { PartPoint(programmed.0 + moved * factor) } else { programmed }
        };
        Some(Node { position, first, second })
    }
}

/// Weights of values at `places` in value, first and second derivative at 0 of the polynomial that fits them best, by polynomials
/// that are orthogonal over the places.
fn fit(places: &[f64], degree: usize) -> [[f64; POINTS_MAX]; 3] {
    let mut weights = [[0.0; POINTS_MAX]; 3];
    let (mut values, mut values_before) = ([1.0; POINTS_MAX], [0.0; POINTS_MAX]);
    let (mut at_zero, mut at_zero_before) = ([1.0, 0.0, 0.0], [0.0; 3]);
    let mut norm_before = 1.0;
    for k in 0..=degree {
        let norm: f64 = places.iter().zip(&values).map(|(_, value)| value * value).sum();
        for (row, derivative) in weights.iter_mut().zip(at_zero) {
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
