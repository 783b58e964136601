//! Words of feed, dynamics, spindles and positioning axes.
//!
//! In: words of a block. Out: modal state, positioning moves. Developer "feed" builds this.

use super::block::{Collected, not_built};
use super::run::Interpreter;
use crate::program::syntax::{Address, Expr, IndexedValue, Typed};
use crate::program::words::{FeedCorrection, FeedShape, FeedType, IndexedAddress, Procedure};
use crate::program::{Columns, Outcome};

impl Interpreter {
    /// G93, G94, G95, G96, G97 and their kin.
    pub(super) fn feed_type(&mut self, feed_type: FeedType, columns: &Columns) -> Outcome<()> {
        if feed_type == FeedType::PerMinute { Ok(()) } else { Err(not_built("this kind of feed", columns)) }
    }

    /// FNORM, FLIN, FCUB.
    pub(super) fn feed_shape(&mut self, shape: FeedShape, columns: &Columns) -> Outcome<()> {
        if shape == FeedShape::Constant { Ok(()) } else { Err(not_built("FLIN and FCUB", columns)) }
    }

    /// CFC, CFTCP, CFIN.
    pub(super) fn feed_correction(&mut self, _correction: FeedCorrection, _columns: &Columns) -> Outcome<()> {
        Ok(())
    }

    /// RTLION, RTLIOF.
    pub(super) fn rapid_linear(&mut self, linear: bool, columns: &Columns) -> Outcome<()> {
        if linear { Ok(()) } else { Err(not_built("RTLIOF", columns)) }
    }

    /// DYNPREC.
    pub(super) fn dynamics_precision(&mut self, columns: &Columns) -> Outcome<()> {
        Err(not_built("DYNPREC", columns))
    }

    /// FB, LIMS, OVR, OVRRAP, H, S of other spindles, M of other spindles.
    pub(super) fn feed_address(
        &mut self,
        _address: Address,
        _typed: Typed,
        columns: &Columns,
        _block: &mut Collected,
    ) -> Outcome<()> {
        Err(not_built("this address", columns))
    }

    /// ACC, VELOLIM, JERKLIM, FL, FA, FGREF, OVRA, POS, POSA, SPOS, SPOSA.
    pub(super) fn feed_indexed(
        &mut self,
        _address: IndexedAddress,
        _index: Option<&Expr>,
        _values: &IndexedValue,
        columns: &Columns,
        _block: &mut Collected,
    ) -> Outcome<()> {
        Err(not_built("this word", columns))
    }

    /// FGROUP, WAITP, WAITS, SOFTA, SPCON, SETMS, POSP.
    pub(super) fn feed_procedure(
        &mut self,
        _procedure: Procedure,
        _given: &[Option<Expr>],
        columns: &Columns,
        _block: &mut Collected,
    ) -> Outcome<()> {
        Err(not_built("this word", columns))
    }
}
