//! Words of frames: TRANS and its kin, G58, G59, RPL, work area.
//!
//! In: words of a block. Out: the programmable frame. Developer "frames" builds the rest of it here.

use super::block::{Collected, not_built};
use super::run::Interpreter;
use crate::program::syntax::Typed;
use crate::program::words::FrameWord;
use crate::program::{Columns, Fault, Outcome, codes};

impl Interpreter {
    /// TRANS replaces the whole translation, ATRANS adds to it; axis words are offsets here.
    pub(super) fn frame(&mut self, frame: FrameWord, block: &mut Collected, columns: &Columns) -> Outcome<()> {
        let words = std::mem::take(&mut block.motion);
        if words.has_circle_words() {
            return Err(Fault::new(codes::BAD_BLOCK, columns.clone(), "a frame and a circle in one block")
                .label("expected a block of its own"));
        }
        match frame {
            FrameWord::Trans | FrameWord::AddTrans => {}
            // Alone they delete the programmable frame, as TRANS alone does.
            FrameWord::Rot | FrameWord::Scale | FrameWord::Mirror if !words.any() => {}
            _ => return Err(not_built("rotated, scaled and mirrored frames", columns)),
        }
        if frame != FrameWord::AddTrans {
            self.modal.translation_lu = crate::base::AxisVector::zero();
        }
        let machine = self.machine.clone();
        for id in machine.axis_ids() {
            if let Some(word) = &words.axes[id] {
                self.modal.translation_lu[id] += self.modal.position_lu(machine.axis(id).kind, word.typed);
            }
        }
        Ok(())
    }

    /// G58 (coarse), G59 (fine): offset of single axes.
    pub(super) fn axial_offset(&mut self, _coarse: bool, columns: &Columns, _block: &mut Collected) -> Outcome<()> {
        Err(not_built("G58 and G59", columns))
    }

    /// RPL: angle of ROT in the plane.
    pub(super) fn plane_rotation(&mut self, _typed: Typed, columns: &Columns, _block: &mut Collected) -> Outcome<()> {
        Err(not_built("RPL", columns))
    }

    /// WALIMON, WALIMOF.
    pub(super) fn work_area(&mut self, _on: bool, _columns: &Columns) -> Outcome<()> {
        Ok(())
    }

    /// G25 and G26 with axes: the block has been read when this acts. With S they limit the spindle.
    pub(super) fn limit(&mut self, _upper: bool, columns: &Columns, _block: &mut Collected) -> Outcome<()> {
        Err(not_built("G25 and G26", columns))
    }
}
