//! Where the axes stand, in the workpiece system and in the basic one.
//!
//! In: axis words, the frames in force. Out: end points in the basic system, circles as the frames turn and mirror them.
//!
//! What holds when a frame changes:
//!
//! * The machine stands still. The position in the workpiece system is the one that leads, through the new frames, to where the axes
//!   stand.
//! * An axis without a word in a block keeps its position in the basic system, unless the frames turn it together with an axis that
//!   has one: then it keeps its position in the workpiece system.
//! * An incremental word counts from the position that was programmed last for its axis, in the workpiece system of then, so that it
//!   also makes good the change of the frames (SD42440 = 1, the control's default).
//! * In a block with G53, G153 or SUPA an incremental word counts from where the axis stands.

use super::active_frames::{ActiveFrames, Total};
use super::motion::{AxisWord, MotionWords, PlainWork, bounded, way_round};
use super::run::Interpreter;
use super::wire::{ArcGeometry, MoveKind, SpatialArcGeometry};
use crate::base::{AxisId, AxisVector, PartPoint};
use crate::program::syntax::Form;
use crate::program::words::Suppression;
use crate::program::{Columns, Fault, Outcome, codes};
use std::sync::Arc;

/// Relative difference up to which two directions or lengths are the same.
const SAME_RATIO: f64 = 1e-9;

/// The position in the workpiece system, and for what it was calculated.
#[derive(Clone, Debug)]
pub(super) struct KnownPlace {
    frames: Arc<ActiveFrames>,
    position: PartPoint,
    work_lu: AxisVector,
}

impl KnownPlace {
    /// Calculates it.
    pub fn new(frames: Arc<ActiveFrames>, position: PartPoint) -> Self {
        Self { work_lu: frames.total().frame.inward(&position.0), frames, position }
    }

    /// The position in the workpiece system.
    pub fn work_lu(&self) -> AxisVector {
        self.work_lu
    }
}

impl Interpreter {
    /// Where the axes stand in the workpiece system of a block.
    pub(super) fn work_position_lu(&self, suppression: Option<Suppression>) -> AxisVector {
        if suppression.is_none()
            && Arc::ptr_eq(&self.known_place.frames, &self.modal.frames)
            && self.known_place.position == self.position
        {
            return self.known_place.work_lu;
        }
        self.modal.frames.of_block(suppression).frame.inward(&self.position.0)
    }

    /// What the frames of a block come to.
    pub(super) fn frames_of(&self, suppression: Option<Suppression>) -> &Total {
        self.modal.frames.of_block(suppression)
    }

    /// All axes at the end of a block with these words.
    pub(super) fn end_point(&self, words: &MotionWords) -> Outcome<PartPoint> {
        let total = self.frames_of(words.suppression);
        let mut end = self.position;
        let mut work_lu = None;
        for id in self.machine.axis_ids() {
            let Some(word) = &words.axes[id] else { continue };
            let value_lu = bounded(self.axis_target_lu(id, word, words.suppression)?, &word.columns)?;
            match total.turning_place(id) {
                None => end.0[id] = total.axis_outward(id, value_lu),
                Some(_) => {
                    work_lu.get_or_insert_with(|| self.work_position_lu(words.suppression))[id] = value_lu;
                }
            }
        }
        if let Some(work_lu) = work_lu {
            turn_outward(total, &work_lu, |id| words.axes[id].is_some(), &mut end);
        }
        for id in self.machine.axis_ids() {
            if let Some(word) = &words.axes[id] {
                bounded(end.0[id], &word.columns)?;
            }
        }
        Ok(end)
    }

    /// Where a word sends its axis, in the workpiece system of the block.
    pub(super) fn axis_target_lu(&self, id: AxisId, word: &AxisWord, suppression: Option<Suppression>) -> Outcome<f64> {
        let axis = self.machine.axis(id);
        let value_lu = self.modal.position_lu(axis.kind, word.typed);
        let incremental = match word.form {
            Form::Modal => !self.modal.absolute,
            Form::Incremental => true,
            Form::Absolute => false,
            Form::Shortest | Form::Positive | Form::Negative if axis.modulo => {
                let total = self.frames_of(suppression);
                let now_lu = self.position.0[id];
                let end_lu = now_lu + way_round(total.axis_outward(id, value_lu) - now_lu, word.form);
                return Ok(total.axis_inward(id, end_lu));
            }
            Form::Shortest => false,
            // ACP and ACN have no meaning for an axis with ends.
            Form::Positive | Form::Negative => return Err(no_direction(word, &axis.name)),
        };
        if !incremental {
            return Ok(value_lu);
        }
        let base_lu =
            if suppression.is_some() { self.work_position_lu(suppression)[id] } else { self.programmed_lu[id] };
        Ok(base_lu + value_lu)
    }

    /// The axes have gone from `start` to where they stand by these words: from here incremental words count.
    pub(super) fn note_programmed(&mut self, words: &MotionWords, start: PartPoint) {
        let start_lu = self.frames_of(None).frame.inward(&start.0);
        let end = self.position;
        let work_lu = self.work_position_lu(None);
        for id in self.machine.axis_ids() {
            let incremental =
                |word: &AxisWord| word.form == Form::Incremental || (word.form == Form::Modal && !self.modal.absolute);
            match &words.axes[id] {
                // What has not been made good before stays pending.
                Some(word) if words.suppression.is_some() && incremental(word) => {
                    self.programmed_lu[id] += work_lu[id] - start_lu[id];
                }
                Some(_) => self.programmed_lu[id] = work_lu[id],
                None => {}
            }
        }
        self.known_place = KnownPlace { frames: self.modal.frames.clone(), position: end, work_lu };
    }

    /// As `note_programmed`, for a block of the fast path.
    pub(super) fn know_place(&mut self, end: PartPoint, work: PlainWork) {
        self.position = end;
        self.programmed_lu = work.programmed_lu;
        let Some(work_lu) = work.turned_lu else { return };
        if !Arc::ptr_eq(&self.known_place.frames, &self.modal.frames) {
            self.known_place.frames = self.modal.frames.clone();
        }
        self.known_place.position = end;
        self.known_place.work_lu = work_lu;
    }

    /// A circle of the workpiece system as a move: turned, scaled and mirrored by the frames of the block. `start_lu`: where it
    /// starts, in the workpiece system.
    pub(super) fn placed_arc(
        &self,
        arc: ArcGeometry,
        start_lu: &AxisVector,
        suppression: Option<Suppression>,
        columns: &Columns,
    ) -> Outcome<MoveKind> {
        let total = self.frames_of(suppression);
        let mut centre_lu = *start_lu;
        let mut directions = [AxisVector::zero(), AxisVector::zero()];
        for (index, id) in arc.plane.into_iter().enumerate() {
            centre_lu[id] = arc.centre_mm[index];
            directions[index][id] = 1.0;
        }
        let directions = directions.map(|direction| total.frame.direction_outward(&direction));
        let centre_lu = total.frame.outward(&centre_lu);
        let scale_ratio = equal_scale(&directions, columns)?;
        let radius_mm = arc.radius_mm * scale_ratio;
        let axes = directions.map(|direction| along_axis(&direction, scale_ratio));
        if let [Some((first, forward)), Some((second, forward_too))] = axes {
            let (plane, in_order) = self.plane_of(first, second);
            let centre_mm = plane.map(|id| centre_lu[id]);
            let counter_clockwise = (forward == forward_too) == in_order;
            let sweep_rad = if counter_clockwise { arc.sweep_rad } else { -arc.sweep_rad };
            return Ok(MoveKind::Arc(ArcGeometry { plane, centre_mm, radius_mm, sweep_rad }));
        }
        let mut centre_mm = AxisVector::zero();
        for id in total.frame.axes().into_iter().flatten() {
            centre_mm[id] = centre_lu[id];
        }
        let directions = directions.map(|direction| direction * (1.0 / scale_ratio));
        let spatial = SpatialArcGeometry { directions, centre_mm, radius_mm, sweep_rad: arc.sweep_rad };
        Ok(MoveKind::SpatialArc(Box::new(spatial)))
    }

    /// Two axes as the plane that G17, G18 or G19 makes of them, and whether they stand in its order.
    fn plane_of(&self, first: AxisId, second: AxisId) -> ([AxisId; 2], bool) {
        let place = |axis| self.geometry.iter().position(|known| *known == Some(axis)).unwrap_or(0);
        if (place(first) + 1) % 3 == place(second) { ([first, second], true) } else { ([second, first], false) }
    }
}

/// Positions of the geometry axes that depend on a programmed one; the others stay where they are.
pub(super) fn turn_outward(
    total: &Total,
    work_lu: &AxisVector,
    is_programmed: impl Fn(AxisId) -> bool,
    end: &mut PartPoint,
) {
    let axes = total.frame.axes();
    for (row, id) in axes.iter().enumerate() {
        let Some(id) = id else { continue };
        let cells = total.frame.matrix()[row];
        let depends = axes.iter().zip(cells).any(|(other, cell)| cell != 0.0 && other.is_some_and(&is_programmed));
        if depends {
            end.0[*id] = total.row_outward(row, work_lu);
        }
    }
}

/// Length of both images of the unit vectors of a plane; a circle stays one only where they are equal and at right angles.
fn equal_scale(directions: &[AxisVector; 2], columns: &Columns) -> Outcome<f64> {
    let [first, second] = directions.map(|direction| direction.norm());
    if (first - second).abs() <= SAME_RATIO * first
        && directions[0].dot(&directions[1]).abs() <= SAME_RATIO * first * second
    {
        return Ok(first);
    }
    Err(Fault::new(codes::UNEQUAL_SCALE, columns.clone(), "the frames would make an ellipse of this circle")
        .label("not a circle any more")
        .help("give SCALE the same factor for both axes of the plane"))
}

/// The axis that a direction follows, and whether forwards.
fn along_axis(direction: &AxisVector, length: f64) -> Option<(AxisId, bool)> {
    let found = AxisId::first(crate::base::AXES_MAX).find(|id| direction[*id].abs() >= length * (1.0 - SAME_RATIO))?;
    let mut across = *direction;
    across[found] = 0.0;
    (across.norm() <= length * SAME_RATIO).then_some((found, direction[found] > 0.0))
}

fn no_direction(word: &AxisWord, name: &str) -> Box<Fault> {
    let message = format!("ACP and ACN need an endless axis, and `{name}` is none");
    Fault::new(codes::MODULO, word.columns.clone(), message).label("expected AC or IC")
}
