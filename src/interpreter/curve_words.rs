//! Words of curves: CIP, CT, splines, POLY, polar coordinates.
//!
//! In: words of a block. Out: what motion makes of them. Developer "geom" builds this.

use super::block::{Collected, not_built};
use super::run::Interpreter;
use crate::program::syntax::{Address, Expr, Form, IndexedValue, Typed};
use crate::program::words::{CurveWord, PoleOrigin, SplineEnd};
use crate::program::{Columns, Outcome};

impl Interpreter {
    /// CIP, CT, ASPLINE, BSPLINE, CSPLINE, POLY.
    pub(super) fn curve(&mut self, _word: CurveWord, columns: &Columns, _block: &mut Collected) -> Outcome<()> {
        Err(not_built("this curve", columns))
    }

    /// BAUTO, BNAT, BTAN.
    pub(super) fn spline_start(&mut self, _end: SplineEnd, _columns: &Columns) -> Outcome<()> {
        Ok(())
    }

    /// EAUTO, ENAT, ETAN.
    pub(super) fn spline_finish(&mut self, _end: SplineEnd, _columns: &Columns) -> Outcome<()> {
        Ok(())
    }

    /// UPATH, SPATH.
    pub(super) fn path_parameter(&mut self, _with_path: bool, _columns: &Columns) -> Outcome<()> {
        Ok(())
    }

    /// G110, G111, G112.
    pub(super) fn pole(&mut self, _origin: PoleOrigin, columns: &Columns, _block: &mut Collected) -> Outcome<()> {
        Err(not_built("polar coordinates", columns))
    }

    /// AR, AP, RP, I1, J1, K1, PW, SD, PL.
    pub(super) fn curve_address(
        &mut self,
        _address: Address,
        _typed: Typed,
        _form: Form,
        columns: &Columns,
        _block: &mut Collected,
    ) -> Outcome<()> {
        Err(not_built("this address", columns))
    }

    /// PO[axis]=(...), PO[]=(...).
    pub(super) fn polynomial(
        &mut self,
        _index: Option<&Expr>,
        _values: &IndexedValue,
        columns: &Columns,
        _block: &mut Collected,
    ) -> Outcome<()> {
        Err(not_built("polynomials", columns))
    }
}
