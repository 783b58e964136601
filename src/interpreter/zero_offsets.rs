//! Zero offsets in the data management: settable frames $P_UIFR[n] (G500, G54 and so on) and the basic frame $P_UBFR.
//!
//! In: frames. Out: [`ZeroOffsets`]. What is stored here takes effect with the next G54 (or its kin) that names it; which frames are in
//! force is the business of `active_frames`.

use super::frame::{Frame, GeometryAxes};
use std::collections::BTreeMap;

/// Highest number of a settable frame: G599.
pub const SETTABLE_MAX: u16 = 99;

/// Frames by number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ZeroOffsets {
    basic: Option<Frame>,
    settable: BTreeMap<u16, Frame>,
}

impl ZeroOffsets {
    /// $P_UBFR.
    pub fn basic(&self, axes: GeometryAxes) -> Frame {
        self.basic.clone().unwrap_or_else(|| Frame::identity(axes))
    }

    /// `$P_UIFR[number]`: 0 is G500, 1 is G54, 5 is G505.
    pub fn settable(&self, number: u16, axes: GeometryAxes) -> Frame {
        self.settable.get(&number).cloned().unwrap_or_else(|| Frame::identity(axes))
    }

    /// Sets $P_UBFR.
    pub fn set_basic(&mut self, frame: Frame) {
        self.basic = Some(frame);
    }

    /// Sets `$P_UIFR[number]`, up to [`SETTABLE_MAX`].
    pub fn set_settable(&mut self, number: u16, frame: Frame) {
        if number <= SETTABLE_MAX {
            self.settable.insert(number, frame);
        }
    }
}
