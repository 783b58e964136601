//! Words of corners and tolerances: RND and its kin, OTOL, ATOL, STOLF, CYCLE832.
//!
//! In: words of a block. Out: modal state and what stands in the corner. A negative tolerance deletes it: the machine's holds again.
//! RND=0, CHF=0 and CHR=0 leave out, in their block, what RNDM inserts. FRC and FRCM count in the unit of F (per
//! revolution: at the spindle speed when they are read; under G93 they have no effect), and 0 takes them back.
//!
//! CYCLE832 does what the cycle of the control does with G functions: SOFT, COMPCAD (COMPSURF where Top Surface is asked for),
//! G645, UPATH, the dynamics of the machining type, CTOL and, where the tens digit says so, OTOL. Deselected it goes back to
//! DYNNORM and deletes both tolerances; G645 and the compressor stay, as with the cycle of machine makers.
//!
//! Does not look at the corner: that is smoothing's.

use super::block::Collected;
use super::evaluate::{evaluate, number};
use super::feed_state::FeedBase;
use super::run::Interpreter;
use super::wire::{Compressor, CornerInsert, CornerShape, MoveKind, ProgrammedLimits};
use crate::base::Portable;
use crate::base::units::{S_PER_MIN, rad_from_deg};
use crate::base::{AxisId, AxisKind, AxisVector, PerAxis};
use crate::machine::{AccelerationMode, DynamicsMode, PathMode};
use crate::program::syntax::{Address, Expr, ExprKind, IndexedValue, Typed};
use crate::program::words::{Plane, Suppression};
use crate::program::{Columns, Fault, Outcome, codes};
use std::sync::Arc;

/// Names of machining types that the control knows, for CYCLE832.
const MACHINING_TYPES: &[(&str, i32)] = &[
    ("_OFF", 0),
    ("_FINISH", 1),
    ("_SEMIFIN", 2),
    ("_ROUGH", 3),
    ("_PRECISION", 4),
    ("_ORI_FINISH", 11),
    ("_ORI_SEMIFIN", 12),
    ("_ORI_ROUGH", 13),
    ("_ORI_PRECISION", 14),
    ("_TOP_SURFACE_SMOOTH_OFF", 1_000_000),
    ("_TOP_SURFACE_SMOOTH_ON", 2_000_000),
];

/// Relative difference up to which two lengths are the same.
const SAME_SCALE_RATIO: f64 = 1e-12;

/// Most parameters of CYCLE832.
const CYCLE832_PARAMETERS: usize = 4;

/// What a block says about the corner at its end.
#[derive(Clone, Debug, Default)]
pub(super) struct CornerWords {
    /// RND, CHF or CHR; `Some(None)`: the value 0.
    shape: Option<Option<CornerShape>>,
    /// FRC; `Some(None)`: the value 0.
    feed_mm_s: Option<Option<f64>>,
    columns: Columns,
}

impl CornerWords {
    /// RND, CHF or CHR is programmed.
    pub(super) fn has_shape(&self) -> bool {
        self.shape.is_some()
    }

    /// Where it stands.
    pub(super) fn columns(&self) -> Columns {
        self.columns.clone()
    }
}

/// What RNDM and FRCM have said.
#[derive(Clone, Copy, Debug, Default)]
pub struct ModalCorner {
    /// RNDM; `None`: off.
    pub radius_mm: Option<f64>,
    /// FRCM; `None`: off.
    pub feed_mm_s: Option<f64>,
}

impl Interpreter {
    /// OTOL, STOLF, RND, RNDM, CHF, CHR, FRC, FRCM.
    pub(super) fn path_address(
        &mut self,
        address: Address,
        typed: Typed,
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        match address {
            Address::OrientationTolerance => {
                let tolerance_rad = (typed.0 >= 0.0).then(|| rad_from_deg(typed.0));
                self.set_tolerance(|limits| limits.orientation_tolerance_rad = tolerance_rad);
            }
            Address::RapidToleranceFactor => {
                let factor = (typed.0 >= 0.0).then_some(typed.0);
                self.set_tolerance(|limits| limits.rapid_tolerance_ratio = factor);
            }
            Address::CornerFeed => block.corner.feed_mm_s = Some(self.corner_feed(typed, columns)?),
            Address::CornerFeedModal => self.modal.corner.feed_mm_s = self.corner_feed(typed, columns)?,
            Address::FilletModal => {
                self.modal.corner.radius_mm =
                    Some(self.corner_mm(typed, columns)?).filter(|radius_mm| *radius_mm > 0.0);
            }
            _ => {
                if block.corner.shape.is_some() {
                    return Err(Fault::new(codes::BAD_BLOCK, columns.clone(), "two of RND, CHF and CHR in one block")
                        .label("expected one of them"));
                }
                let length_mm = self.corner_mm(typed, columns)?;
                block.corner.columns = columns.clone();
                block.corner.shape = Some((length_mm > 0.0).then_some(match address {
                    Address::Chamfer => CornerShape::ChamferBase { length_mm },
                    Address::ChamferLeg => CornerShape::ChamferLeg { length_mm },
                    _ => CornerShape::Fillet { radius_mm: length_mm },
                }));
            }
        }
        Ok(())
    }

    /// ATOL[axis].
    pub(super) fn axis_tolerance(
        &mut self,
        index: Option<&Expr>,
        values: &IndexedValue,
        columns: &Columns,
    ) -> Outcome<()> {
        let axis = self.tolerance_axis(index, columns)?;
        let IndexedValue::One(value) = values else {
            return Err(Fault::new(codes::TYPE_MISMATCH, columns.clone(), "ATOL takes one value").label("a list"));
        };
        let typed = Typed(number(&value.value, self)?);
        let tolerance_lu = (typed.0 >= 0.0).then(|| match self.machine.axis(axis).kind {
            AxisKind::Linear => self.modal.length_mm(typed),
            AxisKind::Rotary => rad_from_deg(typed.0),
        });
        self.set_tolerance(|limits| limits.axis_tolerance_lu[axis] = tolerance_lu);
        Ok(())
    }

    /// CYCLE832.
    pub(super) fn high_speed_settings(&mut self, given: &[Option<Expr>], columns: &Columns) -> Outcome<()> {
        if given.len() > CYCLE832_PARAMETERS {
            return Err(Fault::new(codes::BAD_BLOCK, columns.clone(), "CYCLE832 with too many parameters")
                .label("expected tolerance, machining type and orientation tolerance"));
        }
        let parameter = |index: usize| match given.get(index).and_then(Option::as_ref) {
            Some(expr) => self.cycle_parameter(expr).map(Some),
            None => Ok(None),
        };
        let (tolerance, machining, orientation) = (parameter(0)?, parameter(1)?, parameter(2)?);
        let machining = machining.unwrap_or(0.0);
        let digit = |unit: f64| (machining / unit).floor().rem_euclid(10.0) as u32;
        let dynamics = match digit(1.0) {
            0 => {
                self.modal.dynamics = DynamicsMode::Norm;
                self.modal.contour_tolerance_mm = None;
                self.set_tolerance(|limits| limits.orientation_tolerance_rad = None);
                return Ok(());
            }
            1 => Some(DynamicsMode::Finish),
            2 => Some(DynamicsMode::SemiFinish),
            3 => Some(DynamicsMode::Rough),
            4 => None,
            _ => {
                return Err(Fault::new(
                    codes::OUT_OF_RANGE,
                    columns.clone(),
                    format!("CYCLE832 has no type {machining}"),
                )
                .label("expected a last digit from 0 to 4")
                .help("0 = off, 1 = finish, 2 = semi-finish, 3 = rough, 4 = precision"));
            }
        };
        match dynamics {
            Some(dynamics) => self.modal.dynamics = dynamics,
            None => self.dynamics_precision(columns)?,
        }
        self.modal.acceleration_mode = AccelerationMode::Soft;
        self.modal.compressor = if digit(1e6) == 0 { Compressor::Cad } else { Compressor::Surface };
        self.modal.path_mode = PathMode::G645;
        self.path_parameter(true, columns)?;
        // No tolerance, or one of 0: that of the machine.
        self.modal.contour_tolerance_mm =
            tolerance.filter(|tolerance| *tolerance > 0.0).map(|tolerance| self.modal.length_mm(Typed(tolerance)));
        let orientation = orientation.filter(|angle| digit(10.0) == 1 && *angle > 0.0);
        self.set_tolerance(|limits| limits.orientation_tolerance_rad = orientation.map(rad_from_deg));
        Ok(())
    }

    /// What stands in the corner at the end of a move of this kind.
    pub(super) fn corner_insert(
        &self,
        kind: &MoveKind,
        words: &CornerWords,
        suppression: Option<Suppression>,
    ) -> Option<Box<CornerInsert>> {
        let fillet = |radius_mm| CornerShape::Fillet { radius_mm };
        let shape = words.shape.unwrap_or(self.modal.corner.radius_mm.map(fillet))?;
        if !matches!(kind, MoveKind::Rapid | MoveKind::Line | MoveKind::Arc(_) | MoveKind::SpatialArc(_)) {
            return None;
        }
        let indices = match self.modal.plane {
            Plane::G17 => [0, 1],
            Plane::G18 => [2, 0],
            Plane::G19 => [1, 2],
        };
        let linear = |id: &AxisId| self.machine.axis(*id).kind == AxisKind::Linear;
        let [Some(first), Some(second)] = indices.map(|index| self.geometry[index].filter(linear)) else { return None };
        let frame = &self.frames_of(suppression).frame;
        let along = |axis: AxisId| PerAxis::from_fn(|other| f64::from(u8::from(other == axis)));
        let turned = [first, second].map(|axis| frame.direction_outward(&along(axis)));
        let scales = turned.map(|direction| direction.norm());
        // Of unequal scales there is no circle; the program's length stands then.
        let scale_ratio = if (scales[0] - scales[1]).abs() < SAME_SCALE_RATIO { scales[0] } else { 1.0 };
        let (plane, tilted) = match self.plane_of_directions(&turned) {
            Some(plane) => (plane, false),
            None => ([first, second], true),
        };
        let unit = |k: usize| turned[k] * (1.0 / scales[k]);
        let directions = tilted.then(|| [unit(0), unit(1)]);
        let feed_mm_s = words.feed_mm_s.unwrap_or(self.modal.corner.feed_mm_s);
        Some(Box::new(CornerInsert { shape: scaled(shape, scale_ratio), plane, directions, feed_mm_s }))
    }

    /// The two geometry axes in whose plane both directions lie, in the order of G17, G18 and G19.
    fn plane_of_directions(&self, directions: &[AxisVector; 2]) -> Option<[AxisId; 2]> {
        [[0, 1], [2, 0], [1, 2]].into_iter().find_map(|[a, b]| {
            let [first, second] = [self.geometry[a]?, self.geometry[b]?];
            let inside = |direction: &AxisVector| {
                let flat = direction[first].portable_hypot(direction[second]);
                (direction.norm() - flat).abs() < SAME_SCALE_RATIO * flat
            };
            directions.iter().all(inside).then_some([first, second])
        })
    }

    /// A length that may be 0.
    fn corner_mm(&self, typed: Typed, columns: &Columns) -> Outcome<f64> {
        if typed.0 >= 0.0 && typed.0.is_finite() {
            return Ok(self.modal.position_lu(AxisKind::Linear, typed));
        }
        Err(Fault::new(
            codes::OUT_OF_RANGE,
            columns.clone(),
            format!("a radius or length of {} is not possible", typed.0),
        )
        .label("expected 0 or more"))
    }

    /// FRC, FRCM; 0 is none.
    fn corner_feed(&self, typed: Typed, columns: &Columns) -> Outcome<Option<f64>> {
        if typed.0 == 0.0 {
            return Ok(None);
        }
        if typed.0 < super::block::FEED_MIN {
            return Err(Fault::new(codes::BAD_FEED, columns.clone(), format!("feed {} is not possible", typed.0))
                .label("expected 0 or more"));
        }
        Ok(match self.modal.feed_modes.base {
            FeedBase::Minute => Some(self.modal.programmed_feed(typed).linear_mm_s),
            FeedBase::Revolution => Some(self.modal.length_mm(typed) * self.modal.spindle_speed_rpm.abs() / S_PER_MIN)
                .filter(|feed_mm_s| *feed_mm_s > 0.0),
            // A time is that of a whole block.
            FeedBase::InverseTime | FeedBase::Time => None,
        })
    }

    /// The axis that stands in brackets: a name, or a variable of type AXIS.
    fn tolerance_axis(&self, index: Option<&Expr>, columns: &Columns) -> Outcome<AxisId> {
        let Some(index) = index else {
            return Err(Fault::new(codes::EXPECTED_VALUE, columns.clone(), "ATOL without an axis")
                .label("expected ATOL[axis]=value"));
        };
        match &index.kind {
            ExprKind::Variable { name, indices }
                if indices.is_empty()
                    && self.machine.axis_by_name(name).is_none()
                    && !self.variables.is_declared(name) =>
            {
                Err(Fault::new(codes::UNKNOWN_AXIS, index.columns.clone(), format!("the machine has no axis `{name}`"))
                    .label("expected an axis of the machine"))
            }
            _ => self.axis_of(index),
        }
    }

    fn set_tolerance(&mut self, set: impl FnOnce(&mut ProgrammedLimits)) {
        let limits = self.modal.programmed.get_or_insert_with(Arc::default);
        set(Arc::make_mut(limits));
        if **limits == ProgrammedLimits::default() {
            self.modal.programmed = None;
        }
    }

    /// A parameter of CYCLE832: its constants have names.
    fn cycle_parameter(&self, expr: &Expr) -> Outcome<f64> {
        evaluate(&self.with_constants(expr), self)?.number(&expr.columns)
    }

    /// The expression with the control's constants in the place of names that the program has not defined; its depth is bounded by
    /// the parser.
    fn with_constants(&self, expr: &Expr) -> Expr {
        let kind = match &expr.kind {
            ExprKind::Variable { name, indices } if indices.is_empty() => {
                let constant = MACHINING_TYPES.iter().find(|(known, _)| *known == &**name);
                match constant {
                    Some((_, value)) if !self.variables.is_declared(name) => ExprKind::Int(*value),
                    _ => expr.kind.clone(),
                }
            }
            ExprKind::Binary(binary, pair) => {
                ExprKind::Binary(*binary, Box::new((self.with_constants(&pair.0), self.with_constants(&pair.1))))
            }
            kind => kind.clone(),
        };
        Expr { kind, ..expr.clone() }
    }
}

/// The shape as a frame scales it.
fn scaled(shape: CornerShape, ratio: f64) -> CornerShape {
    match shape {
        CornerShape::Fillet { radius_mm } => CornerShape::Fillet { radius_mm: radius_mm * ratio },
        CornerShape::ChamferBase { length_mm } => CornerShape::ChamferBase { length_mm: length_mm * ratio },
        CornerShape::ChamferLeg { length_mm } => CornerShape::ChamferLeg { length_mm: length_mm * ratio },
    }
}
