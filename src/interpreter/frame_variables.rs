//! Frames in expressions: CTRANS and its kin, variables of type FRAME, $P_UIFR, $P_PFRAME and the other frames of the control.
//!
//! In: names, indices, values. Out: frames, components of frames (mm, deg, factors; 1 or 0 for the mirror). Lengths in expressions are
//! mm, whatever G70 says.
//!
//! * $P_UIFR[n] and $P_UBFR are data management: what is written there takes effect with the next G500, G54 or its kin. $P_IFRAME,
//!   $P_BFRAME and $P_PFRAME are in force: what is written there takes effect at once. Nothing of it moves the machine.
//! * [axis,TR], FI, RT, SC, MI name a component, to read and to write.

use super::evaluate::{evaluate, number};
use super::frame::{Component, Frame};
use super::frame_words::check_scale;
use super::run::Interpreter;
use super::value::Value;
use super::zero_offsets::SETTABLE_MAX;
use crate::base::units::{deg_from_rad, rad_from_deg};
use crate::base::{AxisId, AxisKind};
use crate::program::syntax::{Expr, ExprKind, SystemName};
use crate::program::words::Function;
use crate::program::{Columns, Fault, Outcome, codes};
use std::sync::Arc;

/// Largest component of a frame in an expression: beyond it a typing error is certain.
const COMPONENT_MAX_LU: f64 = 1e7;

/// A frame of the control.
#[derive(Clone, Copy)]
enum Place {
    /// $P_UIFR.
    Settable(u16),
    /// $P_UBFR.
    Basic,
    /// $P_IFRAME.
    ActiveSettable,
    /// $P_BFRAME.
    ActiveBasic,
    /// $P_PFRAME.
    Programmable,
    /// $P_ACTFRAME.
    Total,
}

/// `[axis, TR]`.
type Selected = Option<(AxisId, Component)>;

impl Interpreter {
    /// CTRANS, CFINE, CROT, CROTS, CSCALE, CMIRROR.
    pub(super) fn frame_function(&self, function: Function, given: &[Expr], columns: &Columns) -> Outcome<Value> {
        let mut frame = Frame::identity(self.geometry);
        if function == Function::Cmirror {
            for axis in given {
                frame.set_component_lu(self.axis_of(axis)?, Component::Mirror, 1.0);
            }
            return Ok(Value::Frame(Arc::new(frame)));
        }
        let component = match function {
            Function::Ctrans => Component::Translation,
            Function::Cfine => Component::Fine,
            Function::Cscale => Component::Scale,
            _ => Component::Rotation,
        };
        let mut angles_rad = [None; 3];
        for pair in given.chunks(2) {
            let [axis, value] = pair else {
                return Err(Fault::new(codes::BAD_FRAME, columns.clone(), "an axis without its value")
                    .label("expected pairs such as CTRANS(X, 10, Y, 20)"));
            };
            let id = self.axis_of(axis)?;
            let value_lu = self.component_lu(id, component, number(value, self)?, &axis.columns, &value.columns)?;
            frame.set_component_lu(id, component, value_lu);
            if let Some(place) = frame.place(id) {
                angles_rad[place] = Some(value_lu);
            }
        }
        if function == Function::Crots {
            frame = Frame::solid_angles(self.geometry, angles_rad).ok_or_else(|| {
                Fault::new(codes::BAD_FRAME, columns.clone(), "these solid angles do not span a plane")
                    .label("expected one or two angles")
            })?;
        }
        Ok(Value::Frame(Arc::new(frame)))
    }

    /// Value of a variable of frames; `None`: it is none.
    pub(super) fn frame_variable(&self, system: &SystemName, columns: &Columns) -> Option<Outcome<Value>> {
        if &*system.name == "$P_UIFRNUM" {
            return Some(Ok(Value::Int(i32::from(self.modal.frames.number()))));
        }
        let found = self.frame_place(system, columns)?;
        Some(found.map(|(place, selected)| self.shown_frame(self.frame_at(place), selected)))
    }

    /// Writes a variable of frames; `None`: it is none.
    pub(super) fn set_frame_variable(
        &mut self,
        system: &SystemName,
        value: &Value,
        name_columns: &Columns,
        value_columns: &Columns,
    ) -> Option<Outcome<()>> {
        let found = self.frame_place(system, name_columns)?;
        Some(found.and_then(|(place, selected)| {
            let frame = self.changed_frame(self.frame_at(place), selected, value, name_columns, value_columns)?;
            match place {
                Place::Settable(number) => Arc::make_mut(&mut self.zero_offsets).set_settable(number, frame),
                Place::Basic => {
                    Arc::make_mut(&mut self.zero_offsets).set_basic(frame);
                    self.basic_is_pending = true;
                }
                Place::ActiveSettable => {
                    let number = self.modal.frames.number();
                    self.frames_mut().set_settable(number, frame);
                }
                Place::ActiveBasic => self.frames_mut().set_basic(frame),
                Place::Programmable => self.frames_mut().set_programmable(frame),
                Place::Total => {
                    return Err(Fault::new(codes::OUT_OF_DOMAIN, name_columns.clone(), "$P_ACTFRAME can only be read")
                        .label("not writable")
                        .help("write $P_PFRAME, $P_IFRAME or $P_BFRAME"));
                }
            }
            Ok(())
        }))
    }

    /// A variable of type FRAME, or a component of one; `dimensions`: of the array.
    pub(super) fn user_frame(
        &self,
        name: &str,
        dimensions: usize,
        indices: &[Expr],
        columns: &Columns,
    ) -> Outcome<Value> {
        let (element, selected) = self.split_indices(dimensions, indices, columns)?;
        match self.variables.get(name, &element, columns)? {
            Value::Frame(frame) => Ok(self.shown_frame((*frame).clone(), selected)),
            other => Ok(other),
        }
    }

    /// Writes a variable of type FRAME, or a component of one.
    pub(super) fn set_user_frame(
        &mut self,
        name: &str,
        dimensions: usize,
        indices: &[Expr],
        value: &Value,
        columns: (&Columns, &Columns),
    ) -> Outcome<()> {
        let (element, selected) = self.split_indices(dimensions, indices, columns.0)?;
        let old = match self.variables.get(name, &element, columns.0)? {
            Value::Frame(frame) => (*frame).clone(),
            _ => Frame::identity(self.geometry),
        };
        let frame = self.changed_frame(old, selected, value, columns.0, columns.1)?;
        self.variables.set(name, &element, &Value::Frame(Arc::new(frame)), columns)
    }

    /// Where an axis stands in the workpiece: mm, rad.
    pub(super) fn workpiece_position_lu(&self, axis: AxisId) -> f64 {
        self.work_position_lu(None)[axis]
    }

    /// Where the machine axis stands: mm, rad.
    pub(super) fn machine_position_lu(&self, axis: AxisId) -> f64 {
        let length_lu = self.modal.tool.as_ref().map_or(0.0, |tool| tool.length[axis]);
        self.position.0[axis] + length_lu
    }

    fn split_indices(&self, dimensions: usize, indices: &[Expr], columns: &Columns) -> Outcome<(Vec<i32>, Selected)> {
        let (element, rest) = indices.split_at(dimensions.min(indices.len()));
        Ok((super::evaluate::integers(element, self)?, self.selected(rest, columns)?))
    }

    fn frame_at(&self, place: Place) -> Frame {
        let frames = &self.modal.frames;
        match place {
            Place::Settable(number) => self.zero_offsets.settable(number, self.geometry),
            Place::Basic => self.zero_offsets.basic(self.geometry),
            Place::ActiveSettable => frames.settable().clone(),
            Place::ActiveBasic => frames.basic().clone(),
            Place::Programmable => frames.programmable().clone(),
            Place::Total => frames.total().frame.clone(),
        }
    }

    fn frame_place(&self, system: &SystemName, columns: &Columns) -> Option<Outcome<(Place, Selected)>> {
        let indices = system.indices.as_slice();
        let place = match &*system.name {
            "$P_UIFR" => {
                return Some(self.settable_number(indices, columns).and_then(|number| {
                    Ok((Place::Settable(number), self.selected(indices.get(1..).unwrap_or_default(), columns)?))
                }));
            }
            "$P_UBFR" => Place::Basic,
            "$P_IFRAME" => Place::ActiveSettable,
            "$P_BFRAME" => Place::ActiveBasic,
            "$P_PFRAME" => Place::Programmable,
            "$P_ACTFRAME" => Place::Total,
            _ => return None,
        };
        Some(self.selected(indices, columns).map(|selected| (place, selected)))
    }

    fn settable_number(&self, indices: &[Expr], columns: &Columns) -> Outcome<u16> {
        let number = match indices.first() {
            Some(index) => evaluate(index, self)?.integer(&index.columns)?,
            None => -1,
        };
        u16::try_from(number).ok().filter(|number| *number <= SETTABLE_MAX).ok_or_else(|| {
            Fault::new(codes::BAD_INDEX, columns.clone(), "$P_UIFR needs the number of a settable frame")
                .label(format!("expected 0 to {SETTABLE_MAX}: 1 is G54, 5 is G505"))
        })
    }

    /// `[axis, TR]`, or nothing.
    fn selected(&self, indices: &[Expr], columns: &Columns) -> Outcome<Selected> {
        match indices {
            [] => Ok(None),
            [axis, component] => Ok(Some((self.axis_of(axis)?, component_named(component)?))),
            _ => Err(Fault::new(codes::BAD_INDEX, columns.clone(), "a component of a frame has an axis and a name")
                .label("expected a form such as [X,TR]")),
        }
    }

    fn shown_frame(&self, frame: Frame, selected: Selected) -> Value {
        let Some((axis, component)) = selected else { return Value::Frame(Arc::new(frame)) };
        let value_lu = frame.component_lu(axis, component);
        match component {
            Component::Translation | Component::Fine => Value::Real(self.shown(axis, value_lu)),
            Component::Rotation => Value::Real(deg_from_rad(value_lu)),
            Component::Scale => Value::Real(value_lu),
            Component::Mirror => Value::Int(i32::from(value_lu != 0.0)),
        }
    }

    fn changed_frame(
        &self,
        mut frame: Frame,
        selected: Selected,
        value: &Value,
        name_columns: &Columns,
        value_columns: &Columns,
    ) -> Outcome<Frame> {
        let Some((axis, component)) = selected else {
            return match value {
                Value::Frame(new) => Ok((**new).clone()),
                _ => Err(Fault::new(codes::TYPE_MISMATCH, value_columns.clone(), "this is no frame")
                    .label("expected a frame such as CTRANS(X, 10)")),
            };
        };
        let shown = value.number(value_columns)?;
        let value_lu = self.component_lu(axis, component, shown, name_columns, value_columns)?;
        frame.set_component_lu(axis, component, value_lu);
        Ok(frame)
    }

    /// A component in internal units, if it is possible.
    fn component_lu(
        &self,
        axis: AxisId,
        component: Component,
        shown: f64,
        axis_columns: &Columns,
        value_columns: &Columns,
    ) -> Outcome<f64> {
        let value_lu = match component {
            Component::Rotation => {
                let place = self.geometry.iter().position(|known| *known == Some(axis)).ok_or_else(|| {
                    let message = format!("frames do not turn about `{}`", self.axis_name(axis));
                    Fault::new(codes::BAD_FRAME, axis_columns.clone(), message).label("expected X, Y or Z")
                })?;
                self.check_turnable(place, axis_columns)?;
                rad_from_deg(shown)
            }
            Component::Scale => {
                check_scale(shown, value_columns)?;
                shown
            }
            Component::Translation | Component::Fine if self.machine.axis(axis).kind == AxisKind::Rotary => {
                rad_from_deg(shown)
            }
            Component::Translation | Component::Fine | Component::Mirror => shown,
        };
        if value_lu.abs() <= COMPONENT_MAX_LU {
            return Ok(value_lu);
        }
        Err(Fault::new(codes::OUT_OF_RANGE, value_columns.clone(), "this value is too large for a frame")
            .label("expected at most 1EX7"))
    }
}

/// TR, FI, RT, SC, MI.
fn component_named(expression: &Expr) -> Outcome<Component> {
    let name = match &expression.kind {
        ExprKind::Variable { name, indices } if indices.is_empty() => &**name,
        _ => "",
    };
    Ok(match name {
        "TR" => Component::Translation,
        "FI" => Component::Fine,
        "RT" => Component::Rotation,
        "SC" => Component::Scale,
        "MI" => Component::Mirror,
        _ => {
            return Err(Fault::new(codes::BAD_INDEX, expression.columns.clone(), "this is no component of a frame")
                .label("expected TR, FI, RT, SC or MI"));
        }
    })
}
