//! Words of curves: CIP, CT, splines, POLY, polar coordinates.
//!
//! In: words of a block. Out: what `curve_motion` and `spline_blocks` make curves of. UPATH and SPATH are noted and change nothing: all
//! axes of a spline or polynomial have the parameter of the path (UPATH).

use super::block::Collected;
use super::curve_state::CurveWords;
use super::evaluate::{evaluate, number};
use super::modal::Motion;
use super::motion::AxisWord;
use super::run::Interpreter;
use super::value::Value;
use crate::base::Portable;
use crate::base::{AxisId, AxisKind};
use crate::program::syntax::{Address, AddressValue, Expr, ExprKind, Form, IndexedValue, Typed};
use crate::program::words::{CurveWord, PoleOrigin, SplineEnd};
use crate::program::{Columns, Fault, Outcome, codes};

/// PW.
const WEIGHT_MAX_RATIO: f64 = 3.0;

/// PL.
const INTERVAL_MAX_RATIO: f64 = 1e6;

/// End point and a2 to a5.
const COEFFICIENTS_MAX: usize = 5;

impl Interpreter {
    /// CIP, CT, ASPLINE, BSPLINE, CSPLINE, POLY.
    pub(super) fn curve(&mut self, word: CurveWord, columns: &Columns, block: &mut Collected) -> Outcome<()> {
        if self.modal.motion != Motion::Curve(word) {
            self.close_spline(None);
            self.curves.degree = words_of(block, columns).degree.unwrap_or(3);
        }
        self.modal.motion = Motion::Curve(word);
        Ok(())
    }

    /// BAUTO, BNAT, BTAN: for the splines that begin from here on.
    pub(super) fn spline_start(&mut self, end: SplineEnd, _columns: &Columns) -> Outcome<()> {
        self.curves.begin = end;
        Ok(())
    }

    /// EAUTO, ENAT, ETAN: for the spline that is open, and those after it.
    pub(super) fn spline_finish(&mut self, end: SplineEnd, _columns: &Columns) -> Outcome<()> {
        self.curves.finish = end;
        Ok(())
    }

    /// UPATH, SPATH.
    pub(super) fn path_parameter(&mut self, with_path: bool, _columns: &Columns) -> Outcome<()> {
        self.curves.with_path = with_path;
        Ok(())
    }

    /// G110, G111, G112: acts when the block has been read.
    pub(super) fn pole(&mut self, origin: PoleOrigin, columns: &Columns, block: &mut Collected) -> Outcome<()> {
        block.pole = Some((origin, columns.clone()));
        Ok(())
    }

    /// AR, AP, RP, I1, J1, K1, PW, SD, PL.
    pub(super) fn curve_address(
        &mut self,
        address: Address,
        typed: Typed,
        form: Form,
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        let words = words_of(block, columns);
        let word = || AxisWord { typed, form, columns: columns.clone() };
        match address {
            Address::Intermediate(index) => words.intermediate[usize::from(index).min(2)] = Some(word()),
            Address::OpeningAngle => {
                between("AR", typed.0, [f64::MIN_POSITIVE, 360.0], columns)?;
                words.opening_angle = Some((typed, columns.clone()));
            }
            Address::PolarAngle => words.polar_angle = Some(word()),
            Address::PolarRadius => words.polar_radius = Some(word()),
            Address::PointWeight => {
                words.weight_ratio = Some(between("PW", typed.0, [0.0, WEIGHT_MAX_RATIO], columns)?);
            }
            Address::ParameterLength => {
                words.interval_ratio = Some(between("PL", typed.0, [0.0, INTERVAL_MAX_RATIO], columns)?);
            }
            Address::SplineDegree => {
                if typed.0 != 2.0 && typed.0 != 3.0 {
                    return Err(Fault::new(
                        codes::OUT_OF_RANGE,
                        columns.clone(),
                        format!("SD={} is no degree", typed.0),
                    )
                    .label("expected 2 or 3"));
                }
                self.curves.degree = typed.0 as usize;
                words.degree = Some(typed.0 as usize);
            }
            _ => {}
        }
        Ok(())
    }

    /// PO[axis]=(end, a2, ...), PO[]=(end, b2, ...).
    pub(super) fn polynomial(
        &mut self,
        index: Option<&Expr>,
        values: &IndexedValue,
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        let (end, higher) = self.coefficients(values, columns)?;
        let Some(index) = index else {
            if end.form != Form::Modal {
                return Err(Fault::new(codes::TYPE_MISMATCH, columns.clone(), "the denominator is no axis")
                    .label("expected a plain value"));
            }
            words_of(block, columns).denominator = Some((end.typed.0, higher));
            return Ok(());
        };
        let axis = self.indexed_axis(index, columns)?;
        if block.motion.axes[axis].is_some() {
            return Err(Fault::new(codes::TWICE, columns.clone(), "this axis is programmed twice in the block")
                .label("programmed again"));
        }
        block.motion.axes[axis] = Some(end);
        words_of(block, columns).polynomials[axis] = Some(higher);
        Ok(())
    }

    fn coefficients(&self, values: &IndexedValue, columns: &Columns) -> Outcome<(AxisWord, [f64; 4])> {
        let given: Vec<Option<&AddressValue>> = match values {
            IndexedValue::One(value) => vec![Some(value)],
            IndexedValue::List(values) => values.iter().map(Option::as_ref).collect(),
        };
        if given.len() > COEFFICIENTS_MAX {
            return Err(Fault::new(codes::BAD_CURVE, columns.clone(), "a polynomial of more than degree 5")
                .label("expected the end point and at most four coefficients"));
        }
        let Some(Some(end)) = given.first() else {
            return Err(Fault::new(codes::EXPECTED_VALUE, columns.clone(), "PO without an end point")
                .label("expected PO[X]=(end, a2, a3)"));
        };
        let mut higher = [0.0; 4];
        for (to, from) in higher.iter_mut().zip(&given[1..]) {
            if let Some(from) = from {
                *to = number(&from.value, self)?;
            }
        }
        let typed = Typed(number(&end.value, self)?);
        Ok((AxisWord { typed, form: end.form, columns: columns.clone() }, higher))
    }

    /// The axis in square brackets: its name, or an expression of type AXIS.
    fn indexed_axis(&self, index: &Expr, columns: &Columns) -> Outcome<AxisId> {
        let unknown = || {
            Fault::new(codes::UNKNOWN_AXIS, columns.clone(), "PO of something that is no axis")
                .label("expected an axis of the machine")
        };
        let name = match &index.kind {
            ExprKind::Variable { name, indices } if indices.is_empty() => Some(name),
            _ => None,
        };
        if let Some(axis) = name.and_then(|name| self.machine.axis_by_name(name)) {
            return Ok(axis);
        }
        match evaluate(index, self) {
            Ok(Value::Axis(Some(axis))) => Ok(axis),
            Ok(_) => Err(unknown()),
            // A name that is neither an axis nor a variable.
            Err(_) if name.is_some() => Err(unknown()),
            Err(fault) => Err(fault),
        }
    }

    /// Sets the pole if the block asks for it; its axis words are no positions then.
    pub(super) fn pole_request(&mut self, block: &mut Collected) -> Outcome<()> {
        let Some((origin, columns)) = block.pole.take() else { return Ok(()) };
        let words = std::mem::take(&mut block.motion);
        let (_, plane) = self.plane(&columns)?;
        let mut pole_lu = match origin {
            PoleOrigin::Position => self.work_position_lu(None),
            PoleOrigin::Zero => crate::base::AxisVector::zero(),
            PoleOrigin::Pole => self.curves.pole_lu,
        };
        let curve = words.curve.as_deref();
        let angle = curve.and_then(|curve| curve.polar_angle.as_ref());
        let radius = curve.and_then(|curve| curve.polar_radius.as_ref());
        if let (Some(angle), Some(radius)) = (angle, radius) {
            let (sin, cos) = crate::base::units::rad_from_deg(angle.typed.0).portable_sin_cos();
            let radius_mm = self.modal.position_lu(AxisKind::Linear, radius.typed);
            pole_lu[plane[0]] += radius_mm * cos;
            pole_lu[plane[1]] += radius_mm * sin;
        } else if angle.is_some() || radius.is_some() {
            return Err(Fault::new(codes::BAD_CURVE, columns, "a pole in polar coordinates needs AP and RP")
                .label("expected both"));
        }
        for axis in plane {
            if let Some(word) = &words.axes[axis] {
                pole_lu[axis] += self.modal.position_lu(AxisKind::Linear, word.typed);
            }
        }
        self.curves.pole_lu = pole_lu;
        self.curves.polar_radius_mm = None;
        self.curves.polar_angle_rad = 0.0;
        Ok(())
    }
}

fn words_of<'a>(block: &'a mut Collected, columns: &Columns) -> &'a mut CurveWords {
    block.motion.curve.get_or_insert_with(|| Box::new(CurveWords::new(columns.clone())))
}

fn between(word: &str, value: f64, [low, high]: [f64; 2], columns: &Columns) -> Outcome<f64> {
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    let low = if low == f64::MIN_POSITIVE { 0.0 } else { low };
    Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), format!("{word}={value} is not possible"))
        .label(format!("expected {low} to {high}")))
}
