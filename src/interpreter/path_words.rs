//! Words of corners and tolerances: RND and its kin, OTOL, ATOL, STOLF, CYCLE832.
//!
//! In: words of a block. Out: modal state and what stands in the corner. Developer "smooth" builds this.

use super::block::{Collected, not_built};
use super::run::Interpreter;
use crate::program::syntax::{Address, Expr, IndexedValue, Typed};
use crate::program::{Columns, Outcome};

impl Interpreter {
    /// OTOL, STOLF, RND, RNDM, CHF, CHR, FRC, FRCM.
    pub(super) fn path_address(
        &mut self,
        _address: Address,
        _typed: Typed,
        columns: &Columns,
        _block: &mut Collected,
    ) -> Outcome<()> {
        Err(not_built("this address", columns))
    }

    /// ATOL[axis].
    pub(super) fn axis_tolerance(
        &mut self,
        _index: Option<&Expr>,
        _values: &IndexedValue,
        columns: &Columns,
    ) -> Outcome<()> {
        Err(not_built("ATOL", columns))
    }

    /// CYCLE832.
    pub(super) fn high_speed_settings(&mut self, _given: &[Option<Expr>], columns: &Columns) -> Outcome<()> {
        Err(not_built("CYCLE832", columns))
    }
}
