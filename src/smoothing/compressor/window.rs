//! One window of the smoothing spline: its equations, what it deviates by, how stiff its spans should be.
//!
//! In: points of a run, knots, coefficients that are decided. Out: the coefficients, the spans that keep the tolerance. Does not move
//! along the path: that is `spline`.

use super::basis::{Banded, Basis, KNOTS, basis, bending, values};
use super::track::{Span, Track};
use crate::base::AxisVector;
use crate::base::Portable;

/// Share of the tolerance above which a span is made softer in the last rounds, and the share that a span counts with whose bound
/// does not hold.
const SOFTER_SHARE: f64 = 0.85;
const FAILED_SHARE: f64 = 1.7;

/// Greatest change of the stiff length in one round.
const STIFFER_MAX_RATIO: f64 = 1.5;
const SOFTER_MAX_RATIO: f64 = 0.5;

/// How fast the stiff length may change along the path: where it steps, the third derivative steps by the 6th power.
const STIFF_SLOPE_RATIO: f64 = 0.03;

/// The stiff length over the width of a span: beyond, equations lose their digits; below, points are as good as interpolated.
const STIFF_MAX_RATIO: f64 = 8.0;
const STIFF_MIN_RATIO: f64 = 0.01;

/// A span that is softer than this and deviates still is cut.
const SOFT_RATIO: f64 = 0.22;

/// Chords that the curve rises above by less than this share of the tolerance are no target themselves; by twice as much, half of
/// the weight is theirs.
const CHORD_SHARE: f64 = 0.35;

/// A chord longer than this share of its span is a target itself, with this weight, so that the span is held in its middle.
const LONG_CHORD_RATIO: f64 = 0.35;
const LONG_CHORD_WEIGHT_RATIO: f64 = 0.3;

/// A span of the spline.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub chords: usize,
    /// The length within which the spline is stiff.
    pub stiff_lu: f64,
}

/// One window.
pub(super) struct Window {
    parts: Vec<Part>,
    bases: Vec<Basis>,
    widths_lu: Vec<f64>,
    /// Normal equations of the data, positions from `origin`.
    normal: Banded,
    right: Vec<AxisVector>,
    origin: AxisVector,
    data: Vec<Datum>,
    coefficients: Vec<AxisVector>,
    /// Greatest share of the tolerance that data take, span by span.
    shares: Vec<f64>,
    /// The end of the run, from `origin`: the last coefficient.
    end: Option<AxisVector>,
}

/// A point that the spline is drawn to.
#[derive(Clone, Copy)]
struct Datum {
    part: usize,
    values: [f64; 6],
    position: AxisVector,
    sag_share: f64,
}

impl Window {
    /// `ends`: the window ends where the run does.
    pub(super) fn new(history_lu: &[f64; 5], track: &Track, parts: Vec<Part>, ends: bool) -> Self {
        let origin = track.points[0].position;
        let mut knots_lu = history_lu.to_vec();
        knots_lu.push(track.points[0].along_lu);
        let mut last = 0;
        for part in &parts {
            last = (last + part.chords).min(track.points.len() - 1);
            knots_lu.push(track.points[last].along_lu);
        }
        let end_lu = track.points[last].along_lu;
        knots_lu.extend([end_lu; 5]);
        let bases = knots_lu.windows(KNOTS).filter_map(|knots| knots.first_chunk().map(basis)).collect();
        let widths_lu = knots_lu[5..].windows(2).take(parts.len()).map(|pair| pair[1] - pair[0]).collect();
        let size = parts.len() + 5;
        let mut window = Self {
            bases,
            widths_lu,
            normal: Banded::zero(size),
            right: vec![AxisVector::zero(); size],
            origin,
            data: Vec::new(),
            coefficients: vec![AxisVector::zero(); size],
            shares: vec![0.0; parts.len()],
            end: ends.then(|| track.points[last].position - origin),
            parts,
        };
        window.gather(track);
        window
    }

    pub(super) fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// What data there are, and their normal equations.
    fn gather(&mut self, track: &Track) {
        let mut at = 0;
        for part in 0..self.parts.len() {
            let first = at;
            let width_lu = self.widths_lu[part];
            for _ in 0..self.parts[part].chords {
                let (from, Some(to)) = (track.points[at], track.points.get(at + 1)) else { return };
                let chord_lu = to.along_lu - from.along_lu;
                let middle_ratio = middle_weight(track, at, chord_lu > LONG_CHORD_RATIO * width_lu);
                let after_lu = track.points.get(at + 2).map_or(0.0, |next| next.along_lu - to.along_lu);
                let start_lu = track.points[first].along_lu;
                let x = |along_lu: f64| (along_lu - start_lu) / width_lu;
                if middle_ratio > 0.0 {
                    let middle = (from.position + to.position) * 0.5;
                    let weight_lu = chord_lu * middle_ratio;
                    self.datum(part, x(0.5 * (from.along_lu + to.along_lu)), middle, weight_lu, to.sag_share);
                }
                let weight_lu = 0.5 * (chord_lu * (1.0 - middle_ratio) + after_lu);
                self.datum(part, x(to.along_lu), to.position, weight_lu, to.sag_share);
                at += 1;
            }
        }
    }

    fn datum(&mut self, part: usize, x: f64, position: AxisVector, weight_lu: f64, sag_share: f64) {
        let values = values(&self.bases[part], x);
        let position = position - self.origin;
        let products = values.map(|a| values.map(|b| a * b));
        self.normal.add(part, &products, weight_lu);
        for (right, value) in self.right[part..].iter_mut().zip(values) {
            *right += position * (weight_lu * value);
        }
        self.data.push(Datum { part, values, position, sag_share });
    }

    /// Solves the equations; `fixed` are the coefficients at the start that are decided.
    pub(super) fn solve(&mut self, fixed: &[AxisVector]) -> Option<()> {
        let mut matrix = self.normal.clone();
        for (index, part) in self.parts.iter().enumerate() {
            let factor = part.stiff_lu.powi(6) / self.widths_lu[index].powi(5);
            matrix.add(index, &bending(&self.bases[index]), factor);
        }
        let mut right = self.right.clone();
        for (index, coefficient) in fixed.iter().enumerate().take(right.len()) {
            matrix.fix(index, &(*coefficient - self.origin), &mut right);
        }
        if let Some(end) = &self.end {
            matrix.fix(right.len() - 1, end, &mut right);
        }
        matrix.solve(&mut right)?;
        self.coefficients = right;
        Some(())
    }

    /// What the data deviate by.
    pub(super) fn measure(&mut self, track: &Track) {
        self.shares.fill(0.0);
        for datum in &self.data {
            let mut deviation = -datum.position;
            for (coefficient, value) in self.coefficients[datum.part..].iter().zip(datum.values) {
                deviation += *coefficient * value;
            }
            let share = track.share(&deviation) + datum.sag_share;
            let most = &mut self.shares[datum.part];
            *most = most.max(share);
        }
    }

    /// How many spans at the start keep the tolerance, of those `wanted`.
    pub(super) fn passed(&mut self, track: &Track, wanted: usize) -> usize {
        let mut first = 0;
        let mut passed = None;
        // The spans after it share coefficients that are decided with it.
        let shared = wanted..(wanted + 5).min(self.parts.len());
        if self.shares.get(shared).is_some_and(|shares| shares.iter().any(|share| *share > 1.0)) {
            passed = Some(0);
        }
        for index in 0..wanted.min(self.parts.len()) {
            let span = self.span(index);
            if self.shares[index] > 1.0 || track.share_of(first, &span) > 1.0 {
                self.shares[index] = self.shares[index].max(FAILED_SHARE);
                passed = passed.or(Some(index));
            }
            first += span.chords;
        }
        passed.unwrap_or(wanted)
    }

    /// Makes spans stiffer (`both`) or softer, so that data deviate by `target_share`. New spans, where some have to be cut; not the
    /// first `frozen` ones.
    pub(super) fn adapt(&mut self, target_share: f64, both: bool, frozen: usize) -> Option<Vec<Part>> {
        let count = self.parts.len();
        let mut cut = false;
        for index in 0..count {
            let around = &self.shares[index.saturating_sub(1)..(index + 2).min(count)];
            let share = around.iter().fold(0.0_f64, |most, share| most.max(*share));
            let factor = (target_share / share).portable_powf(1.0 / 6.0).clamp(SOFTER_MAX_RATIO, STIFFER_MAX_RATIO);
            let factor = if both {
                factor
            } else if share > SOFTER_SHARE {
                factor.min(1.0)
            } else {
                1.0
            };
            let width_lu = self.widths_lu[index];
            let part = &mut self.parts[index];
            part.stiff_lu = (part.stiff_lu * factor).clamp(STIFF_MIN_RATIO * width_lu, STIFF_MAX_RATIO * width_lu);
            let soft = part.stiff_lu <= SOFT_RATIO * width_lu;
            cut |= index >= frozen && soft && part.chords > 1 && self.shares[index] > 1.0;
        }
        let limit = |before_lu: f64, (part, width_lu): (&mut Part, &f64)| {
            part.stiff_lu = part.stiff_lu.min(before_lu + STIFF_SLOPE_RATIO * width_lu);
            part.stiff_lu
        };
        self.parts.iter_mut().zip(&self.widths_lu).fold(f64::INFINITY, limit);
        self.parts.iter_mut().zip(&self.widths_lu).rev().fold(f64::INFINITY, limit);
        cut.then(|| self.halved(frozen))
    }

    /// The spans that deviate too far in two.
    fn halved(&self, frozen: usize) -> Vec<Part> {
        let mut parts = Vec::with_capacity(self.parts.len() + 8);
        for (index, part) in self.parts.iter().enumerate() {
            if index >= frozen && part.chords > 1 && self.shares[index] > 1.0 {
                let half = part.chords / 2;
                parts.push(Part { chords: half, ..*part });
                parts.push(Part { chords: part.chords - half, ..*part });
            } else {
                parts.push(*part);
            }
        }
        parts
    }

    /// A span as a polynomial of the chord length from its start.
    pub(super) fn span(&self, index: usize) -> Span {
        let c = &self.coefficients[index..index + 6];
        let mut numerator_lu = [AxisVector::zero(); 6];
        for (coefficient, basis) in c.iter().zip(&self.bases[index]) {
            // From the first coefficient: no digits are lost.
            let offset = *coefficient - c[0];
            for (sum, factor) in numerator_lu.iter_mut().zip(basis) {
                *sum += offset * *factor;
            }
        }
        numerator_lu[0] += c[0] + self.origin;
        let mut width = 1.0;
        for coefficient in &mut numerator_lu[1..] {
            width *= self.widths_lu[index];
            *coefficient = *coefficient * (1.0 / width);
        }
        Span { chords: self.parts[index].chords, numerator_lu }
    }

    /// The coefficients of the span at `index` that its predecessor shares.
    pub(super) fn coefficients(&self, index: usize) -> Vec<AxisVector> {
        self.coefficients[index..].iter().take(5).map(|coefficient| *coefficient + self.origin).collect()
    }
}

/// Share of the weight of the chord from point `at` that its middle has.
fn middle_weight(track: &Track, at: usize, long: bool) -> f64 {
    let [p, q] = [at, at + 1].map(|index| track.points[index]);
    let h = q.along_lu - p.along_lu;
    let direction = (q.position - p.position) * (1.0 / h);
    let before = at.checked_sub(1).and_then(|before| track.points.get(before)).map(|o| (p, o));
    let after = track.points.get(at + 2).map(|r| (r, &q));
    let rise_share = |(end, start): (&super::track::Point, &super::track::Point)| {
        let k = end.along_lu - start.along_lu;
        let turn = (end.position - start.position) * (1.0 / k) - direction;
        track.share(&(turn * (h * h / (4.0 * (h + k)))))
    };
    let before_share = before.map_or(0.0, |(end, start)| rise_share((&end, start)));
    let after_share = after.map_or(0.0, |(end, start)| rise_share((end, start)));
    let risen = (before_share.max(after_share) - CHORD_SHARE) / CHORD_SHARE;
    let weight_ratio = 0.5 * risen.clamp(0.0, 1.0);
    if long { weight_ratio.max(LONG_CHORD_WEIGHT_RATIO) } else { weight_ratio }
}
