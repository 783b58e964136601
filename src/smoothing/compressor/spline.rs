//! COMPCAD and COMPSURF: the smoothest spline of degree 5 inside the tolerance.
//!
//! In: the points of a run. Out: polynomials, each over several chords, that go on into each other up to the fourth derivative.
//!
//! Knots are programmed points, with COMPCAD as far apart as the path bends little between them. The spline q minimises
//!
//! ```text
//! sum over data  weight |p - q|²   +   sum over spans  stiffness  integral |q'''|² ds
//! ```
//!
//! with the lengths that the points stand for as weights: the third derivative is what jerk limits weigh. The stiffness is the power of
//! 6 of a length, the stiff length, below which the program's details are taken out. A span becomes stiffer while the deviation about it
//! is below a share of the tolerance and softer where it is above, a few rounds in turn; a span that is soft already and deviates still
//! is cut in two. The stiff length changes slowly along the path: the third derivative would step with it. What passes is bounded, not
//! sampled (`track`).
//!
//! A window of some dozen spans is solved at a time and its first half handed over; what was handed over before holds the first
//! coefficients fast. What points do to the curve decays within a few spans, so that the second half is enough to look ahead.
//!
//! COMPCAD keeps the stiffness of one window for the next and lets it grow as far as the tolerance allows. COMPSURF begins every
//! window with the same stiffness, which follows from the tolerance alone, has a knot at every point, looks twice as far ahead and makes
//! the same rounds everywhere: the curve at a place follows from the points near it, whichever way and from wherever the path comes, so that
//! neighbouring passes over a surface come out alike.
//!
//! Where nothing keeps the tolerance the blocks stay as programmed. Does not know blocks: that is `track`.

use super::super::smoother::Held;
use super::track::Track;
use super::window::{Part, Window};
use crate::base::AxisVector;
use std::collections::VecDeque;

/// Rounds in which spans become stiffer or softer, and rounds that only make them softer.
const ROUNDS: usize = 4;
const SOFTER_ROUNDS: usize = 10;

/// The square of the length within which a spline is stiff at first, over the tolerance times 1 mm.
const START_TOLERANCES: f64 = 40.0;

/// How the two modes differ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Style {
    /// Chords of one span.
    chords_max: usize,
    /// Tolerances that the path may rise above the chord of a span.
    rise_max_ratio: f64,
    /// Share of the tolerance that data are to deviate by.
    target_share: f64,
    /// The stiffness goes on from window to window.
    remembers: bool,
    /// Spans of a window, and how many of them are only looked at.
    window_spans: usize,
    ahead_spans: usize,
}

/// COMPCAD.
pub(super) const CAD: Style = Style {
    chords_max: 12,
    rise_max_ratio: 5.0,
    target_share: 0.6,
    remembers: true,
    window_spans: 48,
    ahead_spans: 24,
};

/// COMPSURF.
pub(super) const SURFACE: Style = Style {
    chords_max: 1,
    rise_max_ratio: 1.0,
    target_share: 0.3,
    remembers: false,
    window_spans: 96,
    ahead_spans: 48,
};

/// The spline of a run.
#[derive(Clone, Debug)]
pub(super) struct Spline {
    style: Style,
    /// Spans that wait, closed ones; their knots do not move.
    parts: VecDeque<Part>,
    /// Chords of the span that still grows.
    open: usize,
    /// Chords of `parts`.
    closed: usize,
    /// The five knots before the first waiting one.
    history_lu: [f64; 5],
    /// Coefficients that are decided: one at the start of a run, else five.
    fixed: Vec<AxisVector>,
    /// Spans at the start whose knots are in decided coefficients.
    frozen: usize,
}

impl Spline {
    pub(super) fn new(style: Style, start: AxisVector, along_lu: f64) -> Self {
        Self {
            style,
            parts: VecDeque::new(),
            open: 0,
            closed: 0,
            history_lu: [along_lu; 5],
            fixed: vec![start],
            frozen: 0,
        }
    }

    /// Begins anew at the first point of the track.
    fn restart(&mut self, track: &Track) {
        let Some(start) = track.points.front() else { return };
        let chords = self.closed;
        let parts = std::mem::take(&mut self.parts);
        let open = self.open;
        *self = Self::new(self.style, start.position, start.along_lu);
        (self.parts, self.open, self.closed) = (parts, open, chords);
    }

    /// Takes the chord that ends in a point of the track.
    pub(super) fn push(&mut self, track: &Track, last: usize) {
        self.open += 1;
        if self.open > 1 && !self.may_be_one(track, last) {
            self.close(self.open - 1);
            self.open = 1;
        }
    }

    fn close(&mut self, chords: usize) {
        let before = self.parts.back().map(|part| part.stiff_lu);
        self.parts.push_back(Part { chords, stiff_lu: before.unwrap_or(0.0) });
        self.closed += chords;
    }

    /// The open chords bend so little that one span will do.
    fn may_be_one(&self, track: &Track, last: usize) -> bool {
        if self.open > self.style.chords_max || last < self.open {
            return false;
        }
        let (first, end) = (&track.points[last - self.open], &track.points[last]);
        let width_lu = end.along_lu - first.along_lu;
        let way = end.position - first.position;
        track.points.range(last - self.open + 1..last).all(|point| {
            let share = (point.along_lu - first.along_lu) / width_lu;
            track.share(&(point.position - first.position - way * share)) <= self.style.rise_max_ratio
        })
    }

    /// Hands over what is decided; at the end of a run all of it.
    pub(super) fn hand_over(&mut self, track: &mut Track, ending: bool, ready: &mut VecDeque<Held>) {
        if ending && self.open > 0 {
            self.close(self.open);
            self.open = 0;
        }
        while !self.parts.is_empty() && (ending || self.parts.len() >= self.style.window_spans) {
            let count = self.parts.len().min(self.style.window_spans);
            let last = ending && count == self.parts.len();
            let wanted = if last { count } else { count.saturating_sub(self.style.ahead_spans).max(1) };
            let solved = self.solve(track, count, last, wanted);
            match solved {
                Some((window, passed)) if passed > 0 => self.commit(track, &window, passed, last, ready),
                _ => {
                    let chords = self.parts.pop_front().map_or(1, |part| part.chords);
                    self.closed -= chords;
                    track.as_programmed(chords, ready);
                    self.restart(track);
                }
            }
        }
    }

    /// Solves a window; how many spans at its start keep the tolerance, of those `wanted`.
    fn solve(&self, track: &Track, count: usize, last: bool, wanted: usize) -> Option<(Window, usize)> {
        let mut parts: Vec<Part> = self.parts.range(..count).copied().collect();
        let start_lu = stiff_at_start(track);
        for part in &mut parts {
            if !self.style.remembers || part.stiff_lu <= 0.0 {
                part.stiff_lu = start_lu;
            }
        }
        let mut window = Window::new(&self.history_lu, track, parts, last);
        for round in 1..=ROUNDS + SOFTER_ROUNDS {
            window.solve(&self.fixed)?;
            window.measure(track);
            let passed = if round < ROUNDS { 0 } else { window.passed(track, wanted) };
            if passed >= wanted || round == ROUNDS + SOFTER_ROUNDS {
                return Some((window, passed));
            }
            if let Some(parts) = window.adapt(self.style.target_share, round < ROUNDS, self.frozen) {
                window = Window::new(&self.history_lu, track, parts, last);
            }
        }
        None
    }

    /// Hands over the spans at the start of a window; the others wait with the knots that they have got.
    fn commit(&mut self, track: &mut Track, window: &Window, passed: usize, last: bool, ready: &mut VecDeque<Held>) {
        let mut replaced: usize = window.parts().iter().map(|part| part.chords).sum();
        while let Some(part) = self.parts.pop_front() {
            replaced = replaced.saturating_sub(part.chords);
            if replaced == 0 {
                break;
            }
        }
        for part in window.parts()[passed..].iter().rev() {
            self.parts.push_front(*part);
        }
        let all = last && passed == window.parts().len();
        let mut knots_lu = self.history_lu.to_vec();
        for index in 0..passed {
            let span = window.span(index);
            knots_lu.push(track.points[0].along_lu);
            self.closed -= span.chords;
            track.advance(&span, all && index + 1 == passed, ready);
        }
        if let Some(history) = knots_lu.last_chunk::<5>() {
            self.history_lu = *history;
        }
        self.fixed = window.coefficients(passed);
        self.frozen = 5;
    }
}

/// The stiff length at first: a path that bends over a millimetre just keeps the tolerance.
fn stiff_at_start(track: &Track) -> f64 {
    (START_TOLERANCES * track.tolerances.contour_mm.min(1.0)).sqrt()
}
