//! The frames in force: basic, settable (G54 and its kin) and programmable (TRANS, ROT, ...), and what they come to together.
//!
//! In: a frame of one of the three kinds. Out: [`Total`]: the chain basic : settable : programmable, or the shorter one that a block
//! with G53, G153 or SUPA has. Does not know where the axes stand, and keeps no data management ($P_UIFR).

use super::frame::{Frame, GeometryAxes, Matrix};
use crate::base::{AxisId, AxisVector, PerAxis};
use crate::program::words::Suppression;

/// Frames in force.
#[derive(Clone, Debug)]
pub struct ActiveFrames {
    /// $P_BFRAME.
    basic: Frame,
    /// $P_IFRAME.
    settable: Frame,
    /// $P_PFRAME.
    programmable: Frame,
    /// $P_UIFRNUM: 0 with G500.
    number: u16,
    total: Total,
    /// What G53 leaves.
    without_settable: Total,
    /// What G153 and SUPA leave.
    nothing: Total,
}

/// A chain of frames, ready for many points.
#[derive(Clone, Debug)]
pub struct Total {
    /// The chain.
    pub frame: Frame,
    /// Translation of every axis.
    pub offset_lu: AxisVector,
    /// Scale with the sign of mirror and half turns, of axes that depend on no other.
    factor_ratio: AxisVector,
    /// True if every axis has the factor 1 and nothing turns.
    pub only_translates: bool,
    /// True if no axis depends on another.
    pub keeps_axes: bool,
}

impl Total {
    fn new(frame: Frame) -> Self {
        let factor_ratio = PerAxis::from_fn(|axis| match frame.place(axis) {
            Some(place) => frame.matrix()[place][place],
            None => frame.factor_ratio(axis),
        });
        Self {
            factor_ratio,
            offset_lu: frame.offset_lu(),
            only_translates: frame.only_translates(),
            keeps_axes: frame.keeps_axes(),
            frame,
        }
    }

    /// Position of an axis that depends on no other, in the basic system.
    pub fn axis_outward(&self, axis: AxisId, value_lu: f64) -> f64 {
        if self.only_translates {
            return value_lu + self.offset_lu[axis];
        }
        self.factor_ratio[axis] * value_lu + self.offset_lu[axis]
    }

    /// Position of an axis that depends on no other, in the workpiece system.
    pub fn axis_inward(&self, axis: AxisId, position_lu: f64) -> f64 {
        (position_lu - self.offset_lu[axis]) / self.factor_ratio[axis]
    }

    /// Place of an axis among X, Y, Z if its position depends on the others.
    pub fn turning_place(&self, axis: AxisId) -> Option<usize> {
        if self.keeps_axes { None } else { self.frame.place(axis) }
    }

    /// Position of the geometry axis at `row` in the basic system.
    pub fn row_outward(&self, row: usize, work_lu: &AxisVector) -> f64 {
        let axes = self.frame.axes();
        let cells: &Matrix = self.frame.matrix();
        let turned: f64 = axes.iter().zip(cells[row]).filter_map(|(axis, cell)| Some(cell * work_lu[(*axis)?])).sum();
        turned + axes[row].map_or(0.0, |axis| self.offset_lu[axis])
    }
}

impl ActiveFrames {
    /// No frames.
    pub fn new(axes: GeometryAxes) -> Self {
        let none = Frame::identity(axes);
        let total = Total::new(none.clone());
        Self {
            basic: none.clone(),
            settable: none.clone(),
            programmable: none,
            number: 0,
            without_settable: total.clone(),
            nothing: total.clone(),
            total,
        }
    }

    /// What a block has.
    pub fn of_block(&self, suppression: Option<Suppression>) -> &Total {
        match suppression {
            None => &self.total,
            Some(Suppression::Settable) => &self.without_settable,
            Some(Suppression::Basic | Suppression::All) => &self.nothing,
        }
    }

    /// All of them.
    pub fn total(&self) -> &Total {
        &self.total
    }

    /// $P_BFRAME.
    pub fn basic(&self) -> &Frame {
        &self.basic
    }

    /// $P_IFRAME.
    pub fn settable(&self) -> &Frame {
        &self.settable
    }

    /// $P_PFRAME.
    pub fn programmable(&self) -> &Frame {
        &self.programmable
    }

    /// Number of the settable frame: 0 with G500, 1 with G54.
    pub fn number(&self) -> u16 {
        self.number
    }

    /// Sets the basic frame.
    pub fn set_basic(&mut self, basic: Frame) {
        self.basic = basic;
        self.without_settable = Total::new(self.basic.clone());
        self.chain();
    }

    /// G54 and its kin, G500.
    pub fn set_settable(&mut self, number: u16, settable: Frame) {
        self.number = number;
        self.settable = settable;
        self.chain();
    }

    /// TRANS and its kin.
    pub fn set_programmable(&mut self, programmable: Frame) {
        self.programmable = programmable;
        self.chain();
    }

    fn chain(&mut self) {
        self.total = Total::new(self.basic.chained(&self.settable).chained(&self.programmable));
    }
}
