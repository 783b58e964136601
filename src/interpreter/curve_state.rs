//! What words of curves leave behind: for the block, and modal.
//!
//! In: nothing (plain data). Out: [`CurveWords`] of a block, [`CurveState`] of the program. Does not move.

use super::motion::AxisWord;
use crate::base::{AxisVector, PerAxis};
use crate::program::Columns;
use crate::program::syntax::Typed;
use crate::program::words::SplineEnd;

/// Words of curves in one block.
#[derive(Clone, Debug)]
pub(super) struct CurveWords {
    /// I1, J1, K1.
    pub intermediate: [Option<AxisWord>; 3],
    /// AR.
    pub opening_angle: Option<(Typed, Columns)>,
    /// AP.
    pub polar_angle: Option<AxisWord>,
    /// RP.
    pub polar_radius: Option<AxisWord>,
    /// PW.
    pub weight_ratio: Option<f64>,
    /// PL.
    pub interval_ratio: Option<f64>,
    /// SD.
    pub degree: Option<usize>,
    /// PO[axis]: a2 to a5 as typed.
    pub polynomials: PerAxis<Option<[f64; 4]>>,
    /// PO[]: the value at the end, b2 to b5.
    pub denominator: Option<(f64, [f64; 4])>,
    /// Marked bytes of the first of them.
    pub columns: Columns,
}

impl CurveWords {
    /// None yet.
    pub fn new(columns: Columns) -> Self {
        Self {
            intermediate: [None, None, None],
            opening_angle: None,
            polar_angle: None,
            polar_radius: None,
            weight_ratio: None,
            interval_ratio: None,
            degree: None,
            polynomials: PerAxis::splat(None),
            denominator: None,
            columns,
        }
    }

    /// True if they make the block move.
    pub fn moves(&self) -> bool {
        self.polar_angle.is_some()
            || self.polar_radius.is_some()
            || self.opening_angle.is_some()
            || self.intermediate.iter().any(Option::is_some)
            || self.polynomials.as_slice().iter().any(Option::is_some)
    }
}

/// Modal state of curves.
#[derive(Clone, Debug)]
pub(super) struct CurveState {
    /// G group 19.
    pub begin: SplineEnd,
    /// G group 20.
    pub finish: SplineEnd,
    /// SD.
    pub degree: usize,
    /// UPATH.
    pub with_path: bool,
    /// Pole of polar coordinates, in the workpiece system.
    pub pole_lu: AxisVector,
    /// RP that was programmed last.
    pub polar_radius_mm: Option<f64>,
    /// AP that was programmed last.
    pub polar_angle_rad: f64,
}

impl Default for CurveState {
    fn default() -> Self {
        Self {
            begin: SplineEnd::Natural,
            finish: SplineEnd::Natural,
            degree: 3,
            with_path: false,
            pole_lu: AxisVector::zero(),
            polar_radius_mm: None,
            polar_angle_rad: 0.0,
        }
    }
}
