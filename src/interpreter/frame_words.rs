//! Words of frames: TRANS and its kin, G54 and its kin, G58, G59, RPL.
//!
//! In: words of a block. Out: the frames in force. Axis words are offsets, angles or factors here, and the block does not move.
//!
//! * TRANS, ROT, ROTS, SCALE and MIRROR replace the whole programmable frame; alone they delete it.
//! * ATRANS, AROT, AROTS, ASCALE and AMIRROR act inside the programmable frame: programmable : new. What ATRANS adds is fine
//!   translation (programming manual, G58 and G59).
//! * G58 sets the coarse, G59 the fine translation of its axes and leaves the rest.
//! * MIRROR mirrors the axes that are named, whatever their value (MD10612 = 1); a read component is of the axis that was named
//!   (MD10610 = 0).

use super::active_frames::ActiveFrames;
use super::block::Collected;
use super::frame::{Component, Frame};
use super::motion::MotionWords;
use super::run::Interpreter;
use crate::base::units::rad_from_deg;
use crate::program::syntax::{Form, Typed};
use crate::program::words::{FrameWord, Plane};
use crate::program::{Columns, Fault, Outcome, codes};
use std::sync::Arc;

/// What a block asks of the frames, besides its axis words.
#[derive(Default)]
pub(super) struct FrameRequest {
    /// TRANS and its kin.
    word: Option<(FrameWord, Columns)>,
    /// RPL.
    plane_rotation: Option<(Typed, Columns)>,
    /// G58 (coarse: true), G59.
    axial_offset: Option<(bool, Columns)>,
    /// G25 (upper: false), G26.
    limit: Option<(bool, Columns)>,
}

impl FrameRequest {
    /// True if the axis words of the block are no positions.
    pub fn any(&self) -> bool {
        self.word.is_some() || self.axial_offset.is_some() || self.limit.is_some()
    }
}

impl Interpreter {
    /// TRANS and its kin: acts when the block has been read.
    pub(super) fn frame_word(&mut self, word: FrameWord, columns: &Columns, block: &mut Collected) -> Outcome<()> {
        match block.frame.word.replace((word, columns.clone())) {
            None => Ok(()),
            Some(_) => Err(second_frame(columns)),
        }
    }

    /// G58 (coarse), G59 (fine): offset of single axes.
    pub(super) fn axial_offset(&mut self, coarse: bool, columns: &Columns, block: &mut Collected) -> Outcome<()> {
        block.frame.axial_offset = Some((coarse, columns.clone()));
        Ok(())
    }

    /// RPL: angle of ROT in the plane.
    pub(super) fn plane_rotation(&mut self, typed: Typed, columns: &Columns, block: &mut Collected) -> Outcome<()> {
        block.frame.plane_rotation = Some((typed, columns.clone()));
        Ok(())
    }

    /// G25 and G26: act when the block has been read.
    pub(super) fn limit(&mut self, upper: bool, columns: &Columns, block: &mut Collected) -> Outcome<()> {
        block.frame.limit = Some((upper, columns.clone()));
        Ok(())
    }

    /// G54 and its kin: the settable frame as the data management has it now.
    pub(super) fn zero_offset(&mut self, number: u16) {
        if std::mem::take(&mut self.basic_is_pending) {
            let basic = self.zero_offsets.basic(self.geometry);
            self.frames_mut().set_basic(basic);
        }
        let settable = self.zero_offsets.settable(number, self.geometry);
        self.frames_mut().set_settable(number, settable);
    }

    /// Executes what a block asks of the frames.
    pub(super) fn frame_request(&mut self, block: &mut Collected) -> Outcome<()> {
        let request = std::mem::take(&mut block.frame);
        if !request.any() {
            return match request.plane_rotation {
                None => Ok(()),
                Some((_, columns)) => {
                    Err(Fault::new(codes::BAD_FRAME, columns, "RPL without ROT or AROT")
                        .label("expected ROT before it"))
                }
            };
        }
        let words = std::mem::take(&mut block.motion);
        let word = request.word.as_ref().map(|(_, columns)| columns.clone());
        let offset = request.axial_offset.as_ref().map(|(_, columns)| columns.clone());
        let limit = request.limit.as_ref().map(|(_, columns)| columns.clone());
        let mut asked = [word, offset, limit].into_iter().flatten();
        let first = asked.next().unwrap_or(0..0);
        if let Some(second) = asked.next() {
            return Err(second_frame(&second));
        }
        if words.has_circle_words() {
            return Err(Fault::new(codes::BAD_BLOCK, first, "a frame and a circle in one block")
                .label("expected a block of its own"));
        }
        self.check_forms(&words)?;
        if let Some((word, columns)) = request.word {
            self.programmable_frame(word, &words, request.plane_rotation, &columns)
        } else if let Some((coarse, _)) = request.axial_offset {
            self.offset_axes(coarse, &words);
            Ok(())
        } else {
            let upper = request.limit.is_some_and(|(upper, _)| upper);
            self.set_limits(upper, &words, block, &first)
        }
    }

    fn check_forms(&self, words: &MotionWords) -> Outcome<()> {
        let odd = |word: &&super::motion::AxisWord| !matches!(word.form, Form::Modal | Form::Absolute);
        match words.axes.as_slice().iter().flatten().find(odd) {
            None => Ok(()),
            Some(word) => Err(Fault::new(codes::BAD_FRAME, word.columns.clone(), "this is no position of an axis")
                .label("expected a plain value")),
        }
    }

    fn programmable_frame(
        &mut self,
        word: FrameWord,
        words: &MotionWords,
        plane_rotation: Option<(Typed, Columns)>,
        columns: &Columns,
    ) -> Outcome<()> {
        let is_rotation = matches!(word, FrameWord::Rot | FrameWord::AddRot);
        if let Some((_, columns)) = plane_rotation.as_ref().filter(|_| !is_rotation) {
            return Err(
                Fault::new(codes::BAD_FRAME, columns.clone(), "RPL without ROT or AROT").label("only for ROT and AROT")
            );
        }
        let new = match word {
            FrameWord::Trans | FrameWord::AddTrans => self.translation(words),
            FrameWord::Rot | FrameWord::AddRot => self.rotation(words, plane_rotation)?,
            FrameWord::RotSolid | FrameWord::AddRotSolid => self.solid_rotation(words, columns)?,
            FrameWord::Scale | FrameWord::AddScale => self.scale(words)?,
            FrameWord::Mirror | FrameWord::AddMirror => self.mirror(words),
        };
        let frames = self.frames_mut();
        let programmable = match word {
            FrameWord::AddTrans => {
                let mut programmable = frames.programmable().clone();
                programmable.add_fine(&programmable.direction_outward(&new.offset_lu()));
                programmable
            }
            FrameWord::AddRot | FrameWord::AddRotSolid | FrameWord::AddScale | FrameWord::AddMirror => {
                frames.programmable().chained(&new)
            }
            FrameWord::Trans | FrameWord::Rot | FrameWord::RotSolid | FrameWord::Scale | FrameWord::Mirror => new,
        };
        frames.set_programmable(programmable);
        Ok(())
    }

    fn offset_axes(&mut self, coarse: bool, words: &MotionWords) {
        let new = self.translation(words);
        let component = if coarse { Component::Translation } else { Component::Fine };
        let mut programmable = self.modal.frames.programmable().clone();
        for id in self.machine.axis_ids().filter(|id| words.axes[*id].is_some()) {
            programmable.set_component_lu(id, component, new.component_lu(id, Component::Translation));
        }
        self.frames_mut().set_programmable(programmable);
    }

    fn translation(&self, words: &MotionWords) -> Frame {
        let mut frame = Frame::identity(self.geometry);
        for id in self.machine.axis_ids() {
            if let Some(word) = &words.axes[id] {
                let offset_lu = self.modal.position_lu(self.machine.axis(id).kind, word.typed);
                frame.set_component_lu(id, Component::Translation, offset_lu);
            }
        }
        frame
    }

    fn rotation(&self, words: &MotionWords, plane_rotation: Option<(Typed, Columns)>) -> Outcome<Frame> {
        let mut angles_rad = self.angles_rad(words)?.map(|angle_rad| angle_rad.unwrap_or(0.0));
        if let Some((typed, columns)) = plane_rotation {
            if words.any() {
                return Err(Fault::new(codes::BAD_FRAME, columns, "RPL and an axis in one ROT")
                    .label("expected one of the two"));
            }
            let about = match self.modal.plane {
                Plane::G17 => 2,
                Plane::G18 => 1,
                Plane::G19 => 0,
            };
            self.check_turnable(about, &columns)?;
            angles_rad[about] = rad_from_deg(typed.0);
        }
        Ok(Frame::rotation(self.geometry, angles_rad))
    }

    fn solid_rotation(&self, words: &MotionWords, columns: &Columns) -> Outcome<Frame> {
        Frame::solid_angles(self.geometry, self.angles_rad(words)?).ok_or_else(|| {
            Fault::new(codes::BAD_FRAME, columns.clone(), "these solid angles do not span a plane")
                .label("expected one or two angles")
        })
    }

    /// Angles about X, Y and Z.
    fn angles_rad(&self, words: &MotionWords) -> Outcome<[Option<f64>; 3]> {
        let mut angles_rad = [None; 3];
        for id in self.machine.axis_ids() {
            let Some(word) = &words.axes[id] else { continue };
            let Some(place) = self.geometry.iter().position(|known| *known == Some(id)) else {
                let message = format!("frames do not turn about `{}`", self.machine.axis(id).name);
                return Err(Fault::new(codes::BAD_FRAME, word.columns.clone(), message).label("expected X, Y or Z"));
            };
            self.check_turnable(place, &word.columns)?;
            angles_rad[place] = Some(rad_from_deg(word.typed.0));
        }
        Ok(angles_rad)
    }

    /// A frame turns two axes about the third: both must be there.
    pub(super) fn check_turnable(&self, about: usize, columns: &Columns) -> Outcome<()> {
        let missing = (0..3).find(|place| *place != about && self.geometry[*place].is_none());
        match missing {
            None => Ok(()),
            Some(place) => {
                let name = ["X", "Y", "Z"][place];
                let message = format!("the machine has no linear axis {name} that could turn");
                Err(Fault::new(codes::BAD_FRAME, columns.clone(), message).label("this rotation needs it"))
            }
        }
    }

    fn scale(&self, words: &MotionWords) -> Outcome<Frame> {
        let mut frame = Frame::identity(self.geometry);
        for id in self.machine.axis_ids() {
            let Some(word) = &words.axes[id] else { continue };
            let scale_ratio = word.typed.0;
            check_scale(scale_ratio, &word.columns)?;
            frame.set_component_lu(id, Component::Scale, scale_ratio);
        }
        Ok(frame)
    }

    fn mirror(&self, words: &MotionWords) -> Frame {
        let mut frame = Frame::identity(self.geometry);
        for id in self.machine.axis_ids().filter(|id| words.axes[*id].is_some()) {
            frame.set_component_lu(id, Component::Mirror, 1.0);
        }
        frame
    }

    /// The frames in force, to change.
    pub(super) fn frames_mut(&mut self) -> &mut ActiveFrames {
        Arc::make_mut(&mut self.modal.frames)
    }
}

/// A scale factor that does not flatten the part.
pub(super) fn check_scale(scale_ratio: f64, columns: &Columns) -> Outcome<()> {
    if scale_ratio.is_finite() && (SCALE_MIN_RATIO..=SCALE_MAX_RATIO).contains(&scale_ratio.abs()) {
        return Ok(());
    }
    Err(Fault::new(codes::BAD_FRAME, columns.clone(), format!("a scale factor of {scale_ratio} is not possible"))
        .label("expected a factor other than 0"))
}

fn second_frame(columns: &Columns) -> Box<Fault> {
    Fault::new(codes::TWICE, columns.clone(), "a second frame or limit in this block")
        .label("expected a block of its own")
}

/// Smallest and largest scale: what lies beyond is a typing error, and squares would lose digits.
const SCALE_MIN_RATIO: f64 = 1e-6;
const SCALE_MAX_RATIO: f64 = 1e6;
