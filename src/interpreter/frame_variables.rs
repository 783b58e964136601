//! Frames in expressions: CTRANS and its kin, $P_UIFR, $P_PFRAME. Developer "frames" builds this.

use super::run::Interpreter;
use super::value::Value;
use crate::base::AxisId;
use crate::program::syntax::{Expr, SystemName};
use crate::program::words::Function;
use crate::program::{Columns, Fault, Outcome, codes};

impl Interpreter {
    /// CTRANS, CFINE, CROT, CROTS, CSCALE, CMIRROR.
    pub(super) fn frame_function(&self, _function: Function, _given: &[Expr], columns: &Columns) -> Outcome<Value> {
        Err(Fault::new(codes::NOT_BUILT, columns.clone(), "frames in expressions: not built yet")
            .label("not built yet"))
    }

    /// Value of a variable of frames; `None`: it is none.
    pub(super) fn frame_variable(&self, _system: &SystemName, _columns: &Columns) -> Option<Outcome<Value>> {
        None
    }

    /// Writes a variable of frames; `None`: it is none.
    pub(super) fn set_frame_variable(
        &mut self,
        _system: &SystemName,
        _value: &Value,
        _name_columns: &Columns,
        _value_columns: &Columns,
    ) -> Option<Outcome<()>> {
        None
    }

    /// Where an axis stands in the workpiece: mm, rad.
    pub(super) fn workpiece_position_lu(&self, axis: AxisId) -> f64 {
        self.position.0[axis] - self.modal.translation_lu[axis]
    }

    /// Where the machine axis stands: mm, rad.
    pub(super) fn machine_position_lu(&self, axis: AxisId) -> f64 {
        let length_lu = self.modal.tool.as_ref().map_or(0.0, |tool| tool.length[axis]);
        self.position.0[axis] + length_lu
    }
}
