//! Splines over many blocks: from points of the program to moves, in order.
//!
//! In: end points of blocks in ASPLINE, BSPLINE or CSPLINE. Out: the moves of these blocks in the queue of the interpreter, whose kind
//! is fixed as soon as the spline is known there. A move of a spline waits in the queue until then, and with it what follows: at most
//! some hundred blocks (`spline`). The spline ends where a block moves in another way, or where the path stops (M0, M6, G4, STOPRE).
//! M, S, T and H between its blocks do not end it.
//!
//! The first point is where the block before ended. Points of ASPLINE and CSPLINE that repeat the one before are no points. A control
//! point of a BSPLINE counts as often as it is programmed; only its first block may name the start, to give it a weight.

use super::curve_state::CurveWords;
use super::direction::direction;
use super::run::Interpreter;
use super::spline::{AkimaSpline, BSpline, ControlPoint, CubicSpline, EndCondition, NoWeight, chord_lu};
use super::wire::{Event, Feed, MoveKind, PolynomialGeometry};
use crate::base::{AxisVector, PartPoint, PerAxis};
use crate::program::words::{CurveWord, SplineEnd};
use crate::program::{Columns, Fault, Outcome, codes};
use std::collections::VecDeque;
use std::sync::Arc;

/// Moves and functions in the queue at which a spline is ended in any case: a program that only outputs M functions would fill it.
const WAITING_MAX: usize = 10_000;

/// A spline whose end is not known yet.
#[derive(Clone, Debug)]
pub(super) struct OpenSpline {
    kind: Points,
    word: CurveWord,
    degree: usize,
    last: PartPoint,
    /// Where the block that is made next begins.
    from: PartPoint,
    /// Numbers of the moves in the queue, counted from the start of the program, and where they were programmed to end.
    waiting: VecDeque<(u64, PartPoint)>,
}

#[derive(Clone, Debug)]
enum Points {
    Akima(AkimaSpline),
    B(BSpline),
    Cubic(CubicSpline),
}

/// What a block gives besides its end point.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointWords {
    /// PW.
    pub weight_ratio: f64,
    /// PL.
    pub interval_ratio: f64,
}

/// The last move that had a way.
#[derive(Clone, Debug, Default)]
pub(super) struct LastMotion {
    /// Where it began.
    pub start: PartPoint,
    /// What it was; `None`: straight.
    pub kind: Option<MoveKind>,
}

impl PointWords {
    /// PW and PL, 1 where they are not programmed.
    pub fn new(words: Option<&CurveWords>) -> Self {
        Self {
            weight_ratio: words.and_then(|words| words.weight_ratio).unwrap_or(1.0),
            interval_ratio: words.and_then(|words| words.interval_ratio).unwrap_or(1.0),
        }
    }
}

impl OpenSpline {
    fn made(&mut self, finish: Option<&EndCondition>) -> Option<Result<Arc<PolynomialGeometry>, NoWeight>> {
        match (&mut self.kind, finish) {
            (Points::Akima(spline), None) => spline.ready().map(Ok),
            (Points::Akima(spline), Some(end)) => spline.finish(end).map(Ok),
            (Points::Cubic(spline), None) => spline.ready().map(Ok),
            (Points::Cubic(spline), Some(end)) => spline.finish(end).map(Ok),
            (Points::B(spline), None) => spline.ready(),
            (Points::B(spline), Some(_)) => spline.finish(),
        }
    }

    /// True if the move with this number waits for the spline.
    pub fn holds(&self, number: u64) -> bool {
        self.waiting.front().is_some_and(|(waiting, _)| *waiting == number)
    }
}

impl Interpreter {
    /// A block in ASPLINE, BSPLINE or CSPLINE from where the axes stood before (`start`) to where they stand now.
    pub(super) fn spline_block(
        &mut self,
        word: CurveWord,
        start: PartPoint,
        point: PointWords,
        feed: Feed,
        exact_stop: bool,
        events: Vec<Event>,
    ) -> Outcome<()> {
        let linear = self.machine.linear_mask();
        let degree = self.curves.degree;
        if self.open_spline.as_ref().is_some_and(|open| open.word != word || open.degree != degree) {
            self.close_spline(None);
        }
        let end = self.position;
        let fresh = self.open_spline.is_none();
        let mut open = match self.open_spline.take() {
            Some(open) => open,
            None => self.opened_spline(word, start, &linear),
        };
        if chord_lu(&open.last.0, &end.0, &linear) == 0.0 && (fresh || !matches!(open.kind, Points::B(_))) {
            if let Points::B(spline) = &mut open.kind {
                spline.weigh_start(point.weight_ratio);
            }
            self.open_spline = Some(open);
            // It has no way, but its events and its line.
            self.emit_in_spline(MoveKind::Line, feed, exact_stop, events);
            return Ok(());
        }
        match &mut open.kind {
            Points::Akima(spline) => spline.push(end.0),
            Points::Cubic(spline) => spline.push(end.0),
            Points::B(spline) => spline.push(ControlPoint {
                position: end.0,
                weight_ratio: point.weight_ratio,
                interval_ratio: point.interval_ratio,
            }),
        }
        open.last = end;
        open.waiting.push_back((self.handed_over_count + self.queue.len() as u64, end));
        self.open_spline = Some(open);
        self.emit_in_spline(MoveKind::Line, feed, exact_stop, events);
        self.settle_spline(None)
    }

    fn opened_spline(&self, word: CurveWord, start: PartPoint, linear: &PerAxis<bool>) -> OpenSpline {
        let begin = match self.curves.begin {
            SplineEnd::Auto => EndCondition::Auto,
            SplineEnd::Natural => EndCondition::Natural,
            SplineEnd::Tangential => self.direction_behind(&start).map_or(EndCondition::Natural, EndCondition::Tangent),
        };
        let degree = self.curves.degree;
        let kind = match word {
            CurveWord::Akima => Points::Akima(AkimaSpline::new(start.0, begin, *linear)),
            CurveWord::BSpline => Points::B(BSpline::new(start.0, degree, *linear)),
            _ => Points::Cubic(CubicSpline::new(start.0, begin, *linear)),
        };
        OpenSpline { kind, word, degree, last: start, from: start, waiting: VecDeque::new() }
    }

    /// Direction in which the last move arrived at `here`.
    pub(super) fn direction_behind(&self, here: &PartPoint) -> Option<AxisVector> {
        let kind = self.last_motion.kind.as_ref().unwrap_or(&MoveKind::Line);
        direction(kind, [&self.last_motion.start, here], true, &self.machine.linear_mask())
    }

    /// Gives their curve to the moves for which it is known; with `finish` to all.
    fn settle_spline(&mut self, finish: Option<&EndCondition>) -> Outcome<()> {
        let Some(mut open) = self.open_spline.take() else { return Ok(()) };
        while let Some(made) = open.made(finish) {
            let Some((number, programmed)) = open.waiting.pop_front() else { break };
            let geometry = made.map_err(|NoWeight| no_weight())?;
            let Some(index) = number.checked_sub(self.handed_over_count) else { continue };
            let Some(waiting) = self.queue.get_mut(index as usize) else { continue };
            waiting.corner = None;
            let last = finish.is_some() && open.waiting.is_empty();
            let end = match &open.kind {
                Points::B(_) if !last => end_of(&geometry, &self.machine.linear_mask()).map_or(open.from, PartPoint),
                _ => programmed,
            };
            waiting.end = end;
            let from = std::mem::replace(&mut open.from, end);
            if geometry.pieces.is_empty() {
                continue;
            }
            waiting.kind = MoveKind::Spline(geometry);
            // A block whose control points are all the same stands, and has no direction to go on in.
            if direction(&waiting.kind, [&from, &end], true, &self.machine.linear_mask()).is_some() {
                self.last_motion = LastMotion { start: from, kind: Some(waiting.kind.clone()) };
            }
        }
        if finish.is_none() {
            self.open_spline = Some(open);
        }
        Ok(())
    }

    /// Ends the spline that is open, if one is. `following`: the move behind it, with its end.
    pub(super) fn close_spline(&mut self, following: Option<(&MoveKind, &PartPoint)>) {
        let Some(open) = &self.open_spline else { return };
        let end = match self.curves.finish {
            SplineEnd::Auto => EndCondition::Auto,
            SplineEnd::Natural => EndCondition::Natural,
            SplineEnd::Tangential => following
                .and_then(|(kind, end)| direction(kind, [&open.last, end], false, &self.machine.linear_mask()))
                .map_or(EndCondition::Natural, EndCondition::Tangent),
        };
        if let Err(fault) = self.settle_spline(Some(&end)) {
            self.open_spline = None;
            self.spline_fault.get_or_insert(fault);
        }
    }

    /// Called for every move that is emitted: ends the spline that it does not belong to.
    pub(super) fn leave_spline(&mut self, kind: &MoveKind) {
        if self.open_spline.is_none() {
            return;
        }
        let end = self.position;
        match kind {
            MoveKind::Function { stops: false } if self.queue.len() < WAITING_MAX => {}
            MoveKind::Rapid | MoveKind::Line | MoveKind::Arc(_) | MoveKind::SpatialArc(_) | MoveKind::Polynomial(_) => {
                self.close_spline(Some((kind, &end)));
            }
            _ => self.close_spline(None),
        }
    }
}

fn no_weight() -> Box<Fault> {
    let columns: Columns = 0..0;
    Fault::new(codes::BAD_CURVE, columns, "the weights of this B spline leave no curve")
        .label("before this block")
        .help("give the last control point, and at least one of three points in a row, a weight PW above 0")
}

/// The point where the pieces end.
fn end_of(geometry: &PolynomialGeometry, linear: &PerAxis<bool>) -> Option<AxisVector> {
    let piece = geometry.pieces.last()?;
    let u = piece.parameter_end_ratio;
    let value = piece.numerator_lu.iter().rev().fold(AxisVector::zero(), |sum, row| sum * u + *row);
    let d = piece.denominator_ratio.iter().rev().fold(0.0, |sum, coefficient| sum * u + coefficient);
    Some(PerAxis::from_fn(|axis| if linear[axis] { value[axis] / d } else { value[axis] }))
}
