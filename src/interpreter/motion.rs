//! Axis words -> end point, line, rapid or arc.
//!
//! In: the axis and circle words of a block, the modal state. Out: a [`super::Move`] in the basic coordinate system; frames are
//! `placement`'s. Checks travel at programmed end points (a warning: the control would stop with alarm 10720).

use super::arc::{ArcShape, ProgrammedArc, arc_geometry};
use super::block::FEED_MIN;
use super::curve_state::CurveWords;
use super::modal::{Motion, ProgrammedFeed};
use super::path_feed::Way;
use super::placement::turn_outward;
use super::run::Interpreter;
use super::spline_blocks::{LastMotion, PointWords};
use super::value::trimmed;
use super::wire::{Event, MoveKind};
use crate::base::units::deg_from_rad;
use crate::base::{AxisId, AxisKind, AxisVector, PartPoint, PerAxis};
use crate::machine::Machine;
use crate::program::plain::PlainBlock;
use crate::program::syntax::{Form, Typed};
use crate::program::words::{CurveWord, Plane, Suppression};
use crate::program::{Columns, Fault, NotActedOn, Outcome, codes};
use std::f64::consts::{PI, TAU};

/// Angles nearer than this are the same for DC, ACP and ACN: below any digit that a program carries.
const SAME_ANGLE_RAD: f64 = 1e-9;

/// Largest position, centre and radius (mm, rad): ten kilometres. Beyond it a typing error is certain, and squares would lose digits.
const LENGTH_MAX_LU: f64 = 1e7;

/// An axis word (or I, J, K) as typed.
#[derive(Clone, Debug)]
pub(super) struct AxisWord {
    /// mm, inch or degrees.
    pub typed: Typed,
    /// AC, IC, ...
    pub form: Form,
    /// Marked bytes.
    pub columns: Columns,
}

/// What a block says about motion.
#[derive(Clone, Debug)]
pub(super) struct MotionWords {
    /// Axis words.
    pub axes: PerAxis<Option<AxisWord>>,
    /// I, J, K.
    pub centre: [Option<AxisWord>; 3],
    /// CR.
    pub radius: Option<(Typed, Columns)>,
    /// TURN.
    pub turns: u32,
    /// AR, AP, RP, I1, J1, K1, PW, PL, PO.
    pub curve: Option<Box<CurveWords>>,
    /// G9.
    pub exact_stop: bool,
    /// FB.
    pub block_feed: Option<ProgrammedFeed>,
    /// F or FB under G93 or G931: time of the block.
    pub block_time_s: Option<f64>,
    /// SUPA, G53, G153.
    pub suppression: Option<Suppression>,
    /// SF.
    pub start_angle: Option<(Typed, Columns)>,
}

impl Default for MotionWords {
    fn default() -> Self {
        Self {
            axes: PerAxis::from_fn(|_| None),
            centre: [None, None, None],
            radius: None,
            turns: 0,
            curve: None,
            exact_stop: false,
            suppression: None,
            start_angle: None,
            block_feed: None,
            block_time_s: None,
        }
    }
}

impl MotionWords {
    /// True if the block moves.
    pub fn any(&self) -> bool {
        self.axes.as_slice().iter().any(Option::is_some)
            || self.has_circle_words()
            || self.curve.as_ref().is_some_and(|curve| curve.moves())
    }

    /// SUPA, G53, G153: the one that suppresses most holds.
    pub fn suppress(&mut self, which: Suppression) {
        self.suppression = self.suppression.max(Some(which));
    }

    /// True with I, J, K or CR.
    pub fn has_circle_words(&self) -> bool {
        self.centre.iter().any(Option::is_some) || self.radius.is_some()
    }

    /// Columns of all words of the motion.
    pub fn columns(&self) -> Columns {
        let axes =
            self.axes.as_slice().iter().flatten().chain(self.centre.iter().flatten()).map(|word| word.columns.clone());
        let all = axes.chain(self.radius.iter().map(|(_, columns)| columns.clone()));
        all.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end)).unwrap_or(0..0)
    }
}

/// What a plain block leaves behind in the workpiece system.
pub(super) struct PlainWork {
    /// Where each axis was sent last.
    pub programmed_lu: AxisVector,
    /// The whole position, where the frames turn.
    pub turned_lu: Option<AxisVector>,
}

impl Interpreter {
    /// Moves; takes `events` along if it does.
    pub(super) fn motion(&mut self, words: &MotionWords, events: &mut Vec<Event>) -> Outcome<()> {
        let resolved = self.resolved(words)?;
        let words = resolved.as_ref().unwrap_or(words);
        let start = self.position;
        let end = self.end_point(words)?;
        let circle = matches!(self.modal.motion, Motion::Clockwise | Motion::CounterClockwise | Motion::Thread(_));
        if !circle && words.has_circle_words() {
            return Err(Fault::new(codes::BAD_BLOCK, words.columns(), "I, J, K or CR without G2 or G3")
                .label("only for circles"));
        }
        let named = PerAxis::from_fn(|id| words.axes[id].is_some());
        self.wait_for_moving(named);
        let kind = match self.modal.motion {
            Motion::Rapid => MoveKind::Rapid,
            Motion::Line => MoveKind::Line,
            Motion::Thread(word) => self.thread(word, words, end)?,
            Motion::Clockwise | Motion::CounterClockwise => self.arc(words)?,
            Motion::Curve(CurveWord::ThreePoints) => self.three_points(words)?,
            Motion::Curve(CurveWord::Tangential) => self.tangential(words)?,
            Motion::Curve(CurveWord::Polynomial) => self.polynomial_block(words)?,
            // The curve is known later.
            Motion::Curve(_) => MoveKind::Line,
        };
        self.check_work_area(words, &kind, &end)?;
        self.check_travel(words, end);
        self.position = end;
        self.note_programmed(words, start);
        if kind == MoveKind::Rapid && self.rapid_by_axis(words.exact_stop) {
            self.position = start;
            self.rapid_axes(end, named, std::mem::take(events));
            return Ok(());
        }
        let feed = self.feed_of(Way { start, end, kind: &kind }, words)?;
        let events = std::mem::take(events);
        if let Motion::Curve(word @ (CurveWord::Akima | CurveWord::BSpline | CurveWord::Cubic)) = self.modal.motion {
            let point = PointWords::new(words.curve.as_deref());
            return self.spline_block(word, start, point, feed, words.exact_stop, events);
        }
        let straight = matches!(kind, MoveKind::Rapid | MoveKind::Line);
        let last = LastMotion { start, kind: (!straight).then(|| kind.clone()) };
        self.emit(kind, feed, words.exact_stop, events);
        self.modal.thread = None;
        if !straight || start != end {
            self.last_motion = last;
        }
        Ok(())
    }

    /// The fast path: a straight move without anything remarkable. False if the block needs the long way.
    pub(super) fn plain_move(&mut self, block: &PlainBlock) -> bool {
        let motion = match block.rapid {
            Some(true) => Motion::Rapid,
            Some(false) => Motion::Line,
            None => self.modal.motion,
        };
        let feed = match block.feed {
            Some(typed) if typed.0 >= FEED_MIN => Some(self.modal.programmed_feed(typed)),
            Some(_) => return false,
            None => self.modal.feed,
        };
        let feed_known = motion == Motion::Rapid || (motion == Motion::Line && feed.is_some());
        let straight = feed_known && self.modal.feed_modes.plain;
        if !straight {
            return false;
        }
        let start = self.position;
        let Some((end, work)) = self.plain_end(block) else { return false };
        self.know_place(end, work);
        self.number += 1;
        self.modal.motion = motion;
        self.modal.feed = feed;
        if block.axes.as_slice().iter().any(Option::is_some) {
            let kind = if motion == Motion::Rapid { MoveKind::Rapid } else { MoveKind::Line };
            let feed = self.plain_feed(start, end);
            self.emit(kind, feed, false, Vec::new());
            if start != end {
                self.last_motion = LastMotion { start, kind: None };
            }
        }
        true
    }

    /// All axes at the end of a plain block, and in the workpiece system; `None` beyond the travel.
    fn plain_end(&mut self, block: &PlainBlock) -> Option<(PartPoint, PlainWork)> {
        let total = self.modal.frames.total();
        let machine = &self.machine;
        let mut end = self.position;
        let mut programmed_lu = self.programmed_lu;
        let mut turned_lu = None;
        for id in machine.axis_ids() {
            let Some(typed) = block.axes[id] else { continue };
            let mut value_lu = self.modal.position_lu(machine.axis(id).kind, typed);
            if !self.modal.absolute {
                value_lu += self.programmed_lu[id];
            }
            programmed_lu[id] = value_lu;
            match total.turning_place(id) {
                None => end.0[id] = total.axis_outward(id, value_lu),
                Some(_) => turned_lu.get_or_insert_with(|| self.work_position_lu(None))[id] = value_lu,
            }
        }
        if let Some(work_lu) = &turned_lu {
            turn_outward(total, work_lu, |id| block.axes[id].is_some(), &mut end);
        }
        let fits = |id: AxisId| {
            let end_lu = end.0[id];
            self.beyond_travel(id, &end).is_none()
                && end_lu.abs() <= LENGTH_MAX_LU
                && self.work_area.violated_lu(id, end_lu).is_none()
        };
        let moved = |id: &AxisId| block.axes[*id].is_some() || end.0[*id] != self.position.0[*id];
        machine.axis_ids().filter(moved).all(fits).then_some((end, PlainWork { programmed_lu, turned_lu }))
    }

    /// The limit that an axis violates at `end`, and by how much.
    fn beyond_travel(&self, id: AxisId, end: &PartPoint) -> Option<(f64, f64)> {
        outside(self.machine.axis(id).travel_lu, self.machine_end_lu(id, end))
    }

    /// Position of a machine axis when the tool tip is at `end`.
    fn machine_end_lu(&self, id: AxisId, end: &PartPoint) -> f64 {
        end.0[id] + self.modal.tool.as_ref().map_or(0.0, |tool| tool.length[id])
    }

    /// A circle, calculated in the workpiece system and placed by the frames.
    fn arc(&mut self, words: &MotionWords) -> Outcome<MoveKind> {
        let columns = words.columns();
        let (indices, plane) = self.plane(&columns)?;
        let start_lu = self.work_position_lu(words.suppression);
        let start_mm = plane.map(|id| start_lu[id]);
        let mut end_mm = start_mm;
        for (end_mm, id) in end_mm.iter_mut().zip(plane) {
            if let Some(word) = &words.axes[id] {
                *end_mm = bounded(self.axis_target_lu(id, word, words.suppression)?, &word.columns)?;
            }
        }
        let across = 3 - indices[0] - indices[1];
        if let Some(word) = words.centre[across].as_ref().filter(|word| word.typed.0 != 0.0)
            && let Some(entry) = NotActedOn::find("I/J/K")
        {
            self.report_word(entry, &word.columns);
        }
        let in_plane = indices.map(|index| words.centre[index].as_ref());
        let has_centre = in_plane.iter().any(Option::is_some);
        let shape = match &words.radius {
            Some((_, radius_columns)) if has_centre => {
                return Err(Fault::new(codes::BAD_BLOCK, radius_columns.clone(), "centre and radius in one block")
                    .label("expected one of the two"));
            }
            Some((typed, radius_columns)) => ArcShape::Radius {
                radius_mm: bounded(self.modal.position_lu(AxisKind::Linear, *typed), radius_columns)?,
            },
            None if has_centre => {
                let centre = |k: usize| match in_plane[k] {
                    Some(word) => bounded(self.centre_mm(word, start_mm[k]), &word.columns),
                    None => Ok(start_mm[k]),
                };
                ArcShape::Centre { centre_mm: [centre(0)?, centre(1)?] }
            }
            None => {
                return Err(Fault::new(
                    codes::ARC_WITHOUT_CENTRE,
                    columns,
                    "G2 or G3 without centre and without radius",
                )
                .label("expected I, J, K or CR")
                .help("G2 and G3 are modal: write G1 for a straight line"));
            }
        };
        let counter_clockwise = self.modal.motion == Motion::CounterClockwise;
        let arc = ProgrammedArc { plane, start_mm, end_mm, shape, counter_clockwise, extra_turns: words.turns };
        let placed = arc_geometry(&arc, &columns)?;
        self.placed_arc(placed, &start_lu, words.suppression, &columns)
    }

    /// I, J, K count from the start of the arc, whatever G90 says; AC() makes them positions.
    pub(super) fn centre_mm(&self, word: &AxisWord, start_mm: f64) -> f64 {
        let typed_mm = self.modal.position_lu(AxisKind::Linear, word.typed);
        if word.form == Form::Absolute { typed_mm } else { start_mm + typed_mm }
    }

    /// The axes of the working plane: their places among X, Y, Z, and the axes.
    pub(super) fn plane(&self, columns: &Columns) -> Outcome<([usize; 2], [AxisId; 2])> {
        let (indices, name) = match self.modal.plane {
            Plane::G17 => ([0, 1], "G17 (X, Y)"),
            Plane::G18 => ([2, 0], "G18 (Z, X)"),
            Plane::G19 => ([1, 2], "G19 (Y, Z)"),
        };
        match indices.map(|index| self.geometry[index].filter(|id| self.machine.axis(*id).kind == AxisKind::Linear)) {
            [Some(first), Some(second)] => Ok((indices, [first, second])),
            _ => Err(Fault::new(
                codes::ARC_PLANE,
                columns.clone(),
                format!("the machine does not have the axes of {name}"),
            )
            .label("no circle here")),
        }
    }

    /// One warning per axis and run.
    pub(super) fn check_travel(&mut self, words: &MotionWords, end: PartPoint) {
        let machine = self.machine.clone();
        for id in machine.axis_ids() {
            let axis = machine.axis(id);
            // Frames that turn also move axes without a word.
            let columns = match &words.axes[id] {
                Some(word) => word.columns.clone(),
                None if end.0[id] != self.position.0[id] => words.columns(),
                None => continue,
            };
            let Some((limit_lu, beyond_lu)) = self.beyond_travel(id, &end) else { continue };
            if self.travel_warned[id] {
                continue;
            }
            self.travel_warned[id] = true;
            let (shown, unit): (fn(f64) -> f64, _) = match axis.kind {
                AxisKind::Linear => (|length_mm| length_mm, "mm"),
                AxisKind::Rotary => (deg_from_rad, "deg"),
            };
            let name = &axis.name;
            let (end, limit, beyond) =
                (trimmed(shown(self.machine_end_lu(id, &end))), trimmed(shown(limit_lu)), trimmed(shown(beyond_lu)));
            let message =
                format!("{name} goes to {end} {unit}, {beyond} {unit} beyond its travel limit of {limit} {unit}");
            let fault = Fault::new(codes::TRAVEL, columns, message)
                .label("outside the travel")
                .help("the control would raise alarm 10720; the simulation goes on, and further positions of this axis are not reported");
            self.warn(*fault);
        }
    }
}

/// A length or angle that can be calculated with.
pub(super) fn bounded(value_lu: f64, columns: &Columns) -> Outcome<f64> {
    if value_lu.abs() <= LENGTH_MAX_LU {
        return Ok(value_lu);
    }
    Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), "this value is too large for an axis")
        .label("expected at most 1EX7"))
}

/// The limit that a position violates, and by how much.
fn outside(travel_lu: Option<[f64; 2]>, position_lu: f64) -> Option<(f64, f64)> {
    let [low_lu, high_lu] = travel_lu?;
    if position_lu < low_lu {
        return Some((low_lu, low_lu - position_lu));
    }
    (position_lu > high_lu).then_some((high_lu, position_lu - high_lu))
}

/// Way of an endless axis to a position `difference_rad` away.
pub(super) fn way_round(difference_rad: f64, form: Form) -> f64 {
    let mut forward_rad = difference_rad.rem_euclid(TAU);
    if forward_rad < SAME_ANGLE_RAD || TAU - forward_rad < SAME_ANGLE_RAD {
        forward_rad = 0.0;
    }
    match form {
        Form::Negative if forward_rad > 0.0 => forward_rad - TAU,
        Form::Shortest if forward_rad > PI => forward_rad - TAU,
        _ => forward_rad,
    }
}

/// True if rotary axes move from `start` to `end` and no linear one does: F is then an angle per minute.
pub(super) fn rotary_alone(machine: &Machine, start: PartPoint, end: PartPoint) -> bool {
    let moves = |kind: AxisKind| machine.axis_ids().any(|id| machine.axis(id).kind == kind && start.0[id] != end.0[id]);
    moves(AxisKind::Rotary) && !moves(AxisKind::Linear)
}
