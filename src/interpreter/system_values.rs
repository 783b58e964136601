//! Values of system variables.
//!
//! In: a name with indices. Out: its value in the control's unit (mm, deg, mm/min, rpm, s), or a finding. Which names there are, and
//! which of them need the main run, is [`crate::program::SYSTEM_VARIABLES`]. Tools and frames are in files of their own.
//!
//! A variable of the main run is read when the path has come to rest (the interpreter hands over `StopPreparation` before the block):
//! positions are then those of the last end point, exactly; times are what preparation has said by [`MainRun`]. In `moves` and `check`
//! there is no main run, and all times are 0.

use super::evaluate::integers;
use super::feed_state::FeedBase;
use super::run::Interpreter;
use super::value::Value;
use super::wire::Event;
use crate::base::diagnostics::nearest;
use crate::base::units::{MM_PER_M, RAD_PER_REV, S_PER_MIN, deg_from_rad, inch_from_mm, mm_min_from_mm_s};
use crate::base::{AxisId, AxisKind};
use crate::machine::DriveData;
use crate::program::syntax::{Expr, SystemName};
use crate::program::words::Measure;
use crate::program::{Columns, Fault, Outcome, SYSTEM_VARIABLES, SystemVariable, codes};
use std::collections::{BTreeMap, BTreeSet};

/// Elements of $AC_MARKER, $AC_PARAM, $AC_TIMER, $A_OUT and so on.
const ELEMENTS_MAX: i32 = 1000;

/// What a program keeps in system variables of the channel.
#[derive(Clone, Debug, Default)]
pub(super) struct ChannelMemory {
    markers: BTreeMap<i32, i32>,
    parameters: BTreeMap<i32, f64>,
    outputs: BTreeMap<(bool, i32), bool>,
    /// Value written, and the time of the main run then; a stopped clock has no time.
    timers: BTreeMap<i32, (f64, Option<f64>)>,
    /// PLC data and counters, by name and index.
    kept: BTreeMap<(&'static str, i32), f64>,
    /// Alarms of SETAL that have been shown.
    shown_alarms: BTreeSet<i32>,
}

impl ChannelMemory {
    /// What was written last; 0 before.
    pub(super) fn kept(&self, name: &'static str, element: i32) -> f64 {
        self.kept.get(&(name, element)).copied().unwrap_or(0.0)
    }

    /// Keeps a value.
    pub(super) fn keep(&mut self, name: &'static str, element: i32, value: f64) {
        self.kept.insert((name, element), value);
    }

    /// True the first time that this alarm is to be shown.
    pub(super) fn first_shown(&mut self, number: i32) -> bool {
        self.shown_alarms.insert(number)
    }
}

impl Interpreter {
    /// Value of a system variable.
    pub(super) fn system_variable(&self, system: &SystemName, columns: &Columns) -> Outcome<Value> {
        let SystemName { name, indices } = system;
        if let Some(value) = self.frame_variable(system, columns) {
            return value;
        }
        if let Some(value) = self.tool_variable(system, columns) {
            return value;
        }
        if name.starts_with("$MA_") || name.starts_with("$MC_") || name.starts_with("$MN_") || name.starts_with("$SC_")
        {
            return self.machine_datum(system, columns);
        }
        let axis = || self.index_axis(indices, columns);
        let element = || self.element(name, indices, columns);
        Ok(match &**name {
            "$P_F" => Value::Real(self.programmed_f()),
            "$P_S" => Value::Real(self.modal.spindle_speed_rpm),
            "$P_EP" | "$AA_IW" => Value::Real(self.shown(axis()?, self.workpiece_position_lu(axis()?))),
            "$AA_IB" => Value::Real(self.shown(axis()?, self.position.0[axis()?])),
            "$P_EPM" | "$AA_IM" => Value::Real(self.shown(axis()?, self.machine_position_lu(axis()?))),
            "$P_GG" => Value::Int(self.active_g_function(element()?, columns)?),
            "$P_CTOL" => Value::Real(self.modal.contour_tolerance_mm.unwrap_or(-1.0)),
            "$P_AXN1" => Value::Axis(self.geometry[0]),
            "$P_AXN2" => Value::Axis(self.geometry[1]),
            "$P_AXN3" => Value::Axis(self.geometry[2]),
            "$P_SIM" => Value::Bool(true),
            "$P_SEARCH" | "$P_ISTEST" | "$P_DRYRUN" => Value::Bool(false),
            "$P_MSNUM" => Value::Int(1),
            "$P_PROG" => self.program_at_level(element()?, columns)?,
            "$P_STACK" => Value::Int(self.level()),
            "$P_SUBPAR" => self.parameter_given(element()?),
            "$AC_TIME" | "$AC_TIMEC" => Value::Real(0.0),
            "$AC_CYCLE_TIME" | "$AC_OPERATING_TIME" => Value::Real(self.main_run.time_s),
            "$AC_CUTTING_TIME" => Value::Real(self.main_run.cutting_time_s),
            "$AC_TIMER" => Value::Real(self.timer_s(element()?)),
            "$AC_MARKER" => Value::Int(self.memory.markers.get(&element()?).copied().unwrap_or(0)),
            "$AC_PARAM" => Value::Real(self.memory.parameters.get(&element()?).copied().unwrap_or(0.0)),
            "$A_IN" | "$A_OUT" => {
                let output = &**name == "$A_OUT";
                Value::Bool(self.memory.outputs.get(&(output, element()?)).copied().unwrap_or(false))
            }
            _ => match self.constant_variable(system, columns)? {
                Some(value) => value,
                None => return Err(self.unknown_system_variable(name, columns)),
            },
        })
    }

    /// Writes a system variable; `name_columns` of the variable, then of the value.
    pub(super) fn set_system_variable(
        &mut self,
        system: &SystemName,
        value: &Value,
        name_columns: &Columns,
        value_columns: &Columns,
    ) -> Outcome<()> {
        let SystemName { name, indices } = system;
        if let Some(done) = self.set_frame_variable(system, value, name_columns, value_columns) {
            return done;
        }
        if let Some(done) = self.set_tool_variable(system, value, name_columns, value_columns) {
            return done;
        }
        match SystemVariable::find(name) {
            None => return Err(self.unknown_system_variable(name, name_columns)),
            Some(variable) if !variable.writable => {
                return Err(Fault::new(
                    codes::OUT_OF_DOMAIN,
                    name_columns.clone(),
                    format!("`{name}` can only be read"),
                )
                .label("not writable"));
            }
            Some(_) => {}
        }
        self.report_plc(name, name_columns);
        if &**name == "$AN_SLTRACE" {
            return self.set_trace(value, value_columns);
        }
        if let Some(done) = self.keep_variable(system, value, name_columns, value_columns) {
            return done;
        }
        let element = self.element(name, indices, name_columns)?;
        match &**name {
            "$AC_MARKER" => _ = self.memory.markers.insert(element, value.integer(value_columns)?),
            "$AC_PARAM" => _ = self.memory.parameters.insert(element, value.number(value_columns)?),
            "$A_OUT" | "$A_IN" => {
                let output = &**name == "$A_OUT";
                _ = self.memory.outputs.insert((output, element), value.truth(value_columns)?);
            }
            "$AC_TIMER" => {
                let start = value.number(value_columns)?;
                let entry =
                    if start < 0.0 { (self.timer_s(element), None) } else { (start, Some(self.main_run.time_s)) };
                self.memory.timers.insert(element, entry);
            }
            _ => return Err(self.unknown_system_variable(name, name_columns)),
        }
        Ok(())
    }

    /// $AN_SLTRACE: 1 starts, 2 stops.
    fn set_trace(&mut self, value: &Value, columns: &Columns) -> Outcome<()> {
        match value.integer(columns)? {
            1 => self.trace_events.push(Event::Trace(true)),
            2 => self.trace_events.push(Event::Trace(false)),
            0 => {}
            other => {
                return Err(Fault::new(
                    codes::OUT_OF_RANGE,
                    columns.clone(),
                    format!("$AN_SLTRACE = {other} means nothing"),
                )
                .label("expected 1 to start or 2 to stop the trace"));
            }
        }
        Ok(())
    }

    fn timer_s(&self, element: i32) -> f64 {
        match self.memory.timers.get(&element) {
            None => 0.0,
            Some((start_s, None)) => *start_s,
            Some((start_s, Some(since_s))) => start_s + self.main_run.time_s - since_s,
        }
    }

    /// mm, or deg.
    pub(super) fn shown(&self, axis: AxisId, value_lu: f64) -> f64 {
        match self.machine.axis(axis).kind {
            AxisKind::Linear => value_lu,
            AxisKind::Rotary => deg_from_rad(value_lu),
        }
    }

    /// The index that is an axis.
    pub(super) fn index_axis(&self, indices: &[Expr], columns: &Columns) -> Outcome<AxisId> {
        match indices {
            [one] => self.axis_of(one),
            // $MA_MAX_AX_ACCEL[0, X]: the element of the axis' datum comes first.
            [_, axis] => self.axis_of(axis),
            _ => Err(Fault::new(codes::BAD_INDEX, columns.clone(), "this variable needs an axis in its brackets")
                .label("expected a form such as [X]")),
        }
    }

    /// The one index that is a number.
    pub(super) fn element(&self, name: &str, indices: &[Expr], columns: &Columns) -> Outcome<i32> {
        match integers(indices, self)?.as_slice() {
            [element] if (0..ELEMENTS_MAX).contains(element) => Ok(*element),
            [element] => Err(Fault::new(codes::BAD_INDEX, columns.clone(), format!("there is no {name}[{element}]"))
                .label(format!("expected 0 to {}", ELEMENTS_MAX - 1))),
            _ => Err(Fault::new(codes::BAD_INDEX, columns.clone(), format!("{name} needs one index"))
                .label("expected a form such as [1]")),
        }
    }

    /// $MA_, $MC_, $MN_, $SC_: what the machine file says, in the units of the control.
    fn machine_datum(&self, system: &SystemName, columns: &Columns) -> Outcome<Value> {
        let SystemName { name, indices } = system;
        if let Some(value) = self.fixed_machine_datum(system, columns)? {
            return Ok(value);
        }
        let machine = &self.machine;
        match &**name {
            "$MC_CURV_EFFECT_ON_PATH_ACCEL" => return Ok(Value::Real(machine.smoothing.radial_acceleration_share)),
            "$MC_CURV_EFFECT_ON_PATH_JERK" => return Ok(Value::Real(machine.smoothing.radial_jerk_share)),
            "$MN_IPO_CYCLE_TIME" => return Ok(Value::Real(machine.cycle.time_base.setpoint_period_s())),
            "$SC_SMOOTH_CONTUR_TOL" => return Ok(Value::Real(machine.smoothing.contour_tolerance_mm)),
            "$MN_AXCONF_MACHAX_NAME_TAB" => {
                let element = self.element(name, indices, columns)?;
                let axis = machine.axes.get(element.unsigned_abs() as usize);
                let shown =
                    |axis: &crate::machine::Axis| axis.machine_axis.clone().unwrap_or_else(|| axis.name.clone());
                return Ok(Value::Text(axis.map_or_else(String::new, shown).into()));
            }
            _ if SystemVariable::find(name).is_none() => return Err(self.unknown_system_variable(name, columns)),
            _ => {}
        }
        let id = self.index_axis(indices, columns)?;
        let axis = machine.axis(id);
        let per_minute = |velocity_lu_s: f64| match axis.kind {
            AxisKind::Linear => mm_min_from_mm_s(velocity_lu_s),
            AxisKind::Rotary => velocity_lu_s / RAD_PER_REV * S_PER_MIN,
        };
        let per_second = |value_lu: f64| match axis.kind {
            AxisKind::Linear => value_lu / MM_PER_M,
            AxisKind::Rotary => value_lu / RAD_PER_REV,
        };
        let limit = |place: usize| axis.travel_lu.map_or(0.0, |travel_lu| self.shown(id, travel_lu[place]));
        let drive = |datum: fn(&DriveData) -> f64| match &axis.drive {
            Some(drive) => Ok(datum(drive)),
            None => Err(Fault::new(
                codes::OUT_OF_DOMAIN,
                columns.clone(),
                format!("the machine file says nothing of the drive of {}", axis.name),
            )
            .label("no such datum")),
        };
        Ok(match &**name {
            "$MA_MAX_AX_VELO" => Value::Real(per_minute(axis.limits.velocity_max_lu_s)),
            "$MA_MAX_AX_ACCEL" => Value::Real(per_second(axis.limits.acceleration_max_lu_s2)),
            "$MA_MAX_AX_JERK" => Value::Real(per_second(axis.limits.jerk_max_lu_s3)),
            "$MA_PATH_TRANS_JERK_LIM" => Value::Real(per_second(axis.limits.transition_jerk_max_lu_s3)),
            "$MA_POS_LIMIT_MINUS" => Value::Real(limit(0)),
            "$MA_POS_LIMIT_PLUS" => Value::Real(limit(1)),
            "$MA_IS_ROT_AX" => Value::Bool(axis.kind == AxisKind::Rotary),
            "$MA_ROT_IS_MODULO" => Value::Bool(axis.modulo),
            // 1 (m/min)/mm = 1000/60 1/s.
            "$MA_POSCTRL_GAIN" => Value::Real(drive(|drive| drive.position_gain_per_s)? * S_PER_MIN / MM_PER_M),
            "$MA_VELO_FFW_WEIGHT" => Value::Real(drive(|drive| drive.velocity_feedforward_ratio)?),
            "$MA_AX_INERTIA" => Value::Real(drive(|drive| drive.feedforward_inertia_kg_m2)?),
            "$MA_STOP_LIMIT_COARSE" => Value::Real(self.shown(id, drive(|drive| drive.in_position_coarse_lu)?)),
            "$MA_STOP_LIMIT_FINE" => Value::Real(self.shown(id, drive(|drive| drive.in_position_fine_lu)?)),
            _ => return Err(self.unknown_system_variable(name, columns)),
        })
    }

    pub(super) fn unknown_system_variable(&self, name: &str, columns: &Columns) -> Box<Fault> {
        let is_datum = ["$MA_", "$MC_", "$MN_", "$SA_", "$SC_", "$SN_"].iter().any(|prefix| name.starts_with(prefix));
        if is_datum && SystemVariable::find(name).is_none() {
            let message = format!("the machine file has no datum for `{name}`");
            let near = nearest(name, SYSTEM_VARIABLES.iter().map(|variable| variable.name));
            let help = near.map_or_else(
                || "docs/system-variables.md lists the data that it has".to_owned(),
                |near| format!("did you mean `{near}`?"),
            );
            return Fault::new(codes::UNKNOWN_SYSTEM_VARIABLE, columns.clone(), message)
                .label("no such datum")
                .help(help);
        }
        let near = nearest(name, SYSTEM_VARIABLES.iter().map(|variable| variable.name));
        let help = near.map(|near| format!("did you mean `{near}`?"));
        Fault::new(
            codes::UNKNOWN_SYSTEM_VARIABLE,
            columns.clone(),
            format!("the system variable `{name}` is not known here"),
        )
        .label("not one of those that a simulation has")
        .maybe_help(help.or_else(|| Some("docs/system-variables.md lists them".to_owned())))
    }

    /// F as programmed: mm/min, mm a revolution (inch with G700), 1/min with G93, s with G931.
    fn programmed_f(&self) -> f64 {
        let last_time_s = self.modal.feed_modes.last_time_s;
        match self.modal.feed_modes.base {
            FeedBase::InverseTime => last_time_s.map_or(0.0, |time_s| S_PER_MIN / time_s),
            FeedBase::Time => last_time_s.unwrap_or(0.0),
            FeedBase::Minute | FeedBase::Revolution => {
                let per_minute = self.modal.feed.map_or(0.0, |feed| mm_min_from_mm_s(feed.linear_mm_s));
                if self.modal.measure == Measure::Inch { inch_from_mm(per_minute) } else { per_minute }
            }
        }
    }

    /// $P_PROG[level].
    fn program_at_level(&self, level: i32, columns: &Columns) -> Outcome<Value> {
        if let Some(name) = self.program_name_at(level.unsigned_abs() as usize) {
            return Ok(Value::Text(name.into()));
        }
        Err(Fault::new(codes::BAD_INDEX, columns.clone(), format!("no program is active at level {level}"))
            .label("expected a level in use"))
    }

    /// 0 in the main program.
    fn level(&self) -> i32 {
        self.levels.len() as i32
    }

    /// $P_SUBPAR[n].
    fn parameter_given(&self, number: i32) -> Value {
        Value::Bool(self.is_parameter_given(number.unsigned_abs() as usize))
    }
}
