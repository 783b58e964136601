//! System variables that stand still in a simulation, and those that a program keeps for itself.
//!
//! In: a name with indices. Out: its value, or `None` for the names that live elsewhere. There is no clock of the day, no PLC, one channel
//! and one spindle: what depends on them is a fixed value that docs/system-variables.md names, or what the program wrote last.

use super::run::Interpreter;
use super::value::Value;
use crate::base::units::{S_PER_MIN, deg_from_rad};
use crate::program::syntax::{ExprKind, SystemName};
use crate::program::{Block, Columns, Fault, NotActedOn, Outcome, codes, visit_expressions};

/// R parameters of the channel (MD28050).
const R_COUNT: i32 = super::variables::R_MAX + 1;
/// Answer of $P_OTOL and its kin where nothing is programmed.
const NOT_PROGRAMMED: f64 = -1.0;

/// Variables that keep what the program writes, with their kind.
const KEPT: &[(&str, Kept)] = &[
    ("$A_DBB", Kept { whole: Some((0, 255)), indexed: true }),
    ("$A_DBW", Kept { whole: Some((-32768, 65535)), indexed: true }),
    ("$A_DBD", Kept { whole: Some((i32::MIN, i32::MAX)), indexed: true }),
    ("$A_DBR", Kept { whole: None, indexed: true }),
    ("$A_INA", Kept { whole: None, indexed: true }),
    ("$A_OUTA", Kept { whole: None, indexed: true }),
    ("$AC_ACTUAL_PARTS", Kept { whole: None, indexed: false }),
    ("$AC_REQUIRED_PARTS", Kept { whole: None, indexed: false }),
    ("$AC_TOTAL_PARTS", Kept { whole: None, indexed: false }),
    ("$AC_SPECIAL_PARTS", Kept { whole: None, indexed: false }),
];

/// How a kept variable looks.
#[derive(Clone, Copy)]
struct Kept {
    /// Least and greatest value of a whole number; `None`: REAL.
    whole: Option<(i32, i32)>,
    indexed: bool,
}

impl Interpreter {
    /// Value of a variable that stands still or is kept.
    pub(super) fn constant_variable(&self, system: &SystemName, columns: &Columns) -> Outcome<Option<Value>> {
        let SystemName { name, indices } = system;
        if let Some((name, kept)) = find_kept(name) {
            let element = if kept.indexed { self.element(name, indices, columns)? } else { 0 };
            let value = self.memory.kept(name, element);
            return Ok(Some(if kept.whole.is_some() { Value::Int(value as i32) } else { Value::Real(value) }));
        }
        let programmed = self.modal.programmed.as_deref();
        let travel = |place: usize| -> Outcome<Value> {
            let axis = self.index_axis(indices, columns)?;
            let travel_lu = self.machine.axis(axis).travel_lu;
            Ok(Value::Real(travel_lu.map_or(0.0, |travel_lu| self.shown(axis, travel_lu[place]))))
        };
        Ok(Some(match &**name {
            "$P_CHANNO" | "$P_NUM_SPINDLES" => Value::Int(1),
            "$P_SEARCHL" | "$P_TC" => Value::Int(0),
            "$P_LIFTFAST" | "$P_ACTID" => Value::Bool(false),
            "$P_OFFN" => Value::Real(0.0),
            "$P_OTOL" => Value::Real(
                programmed.and_then(|limits| limits.orientation_tolerance_rad).map_or(NOT_PROGRAMMED, deg_from_rad),
            ),
            "$P_STOLF" => {
                Value::Real(programmed.and_then(|limits| limits.rapid_tolerance_ratio).unwrap_or(NOT_PROGRAMMED))
            }
            "$P_ATOL" => {
                let axis = self.index_axis(indices, columns)?;
                let tolerance_lu = programmed.and_then(|limits| limits.axis_tolerance_lu[axis]);
                Value::Real(tolerance_lu.map_or(NOT_PROGRAMMED, |tolerance_lu| self.shown(axis, tolerance_lu)))
            }
            "$A_YEAR" => Value::Int(2000),
            "$A_MONTH" | "$A_DAY" => Value::Int(1),
            "$A_HOUR" | "$A_MINUTE" | "$A_SECOND" | "$A_MSECOND" => Value::Int(0),
            "$AC_ACT_PROG_NET_TIME" => Value::Real(self.main_run.time_s),
            "$AC_OLD_PROG_NET_TIME" | "$AC_VACTB" | "$AC_VACTW" | "$AC_DTEB" | "$AC_DTEW" => Value::Real(0.0),
            "$AN_POWERON_TIME" | "$AN_SETUP_TIME" => Value::Real(self.main_run.time_s / S_PER_MIN),
            "$AA_VACTM" | "$AA_VACTB" | "$AA_VACTW" | "$AA_DTEB" | "$AA_DTEW" => {
                self.index_axis(indices, columns)?;
                Value::Real(0.0)
            }
            "$AA_SOFTENDN" => travel(0)?,
            "$AA_SOFTENDP" => travel(1)?,
            _ => return Ok(None),
        }))
    }

    /// Reports once that there is no PLC, if a variable is one of it.
    pub(super) fn report_plc(&mut self, name: &str, columns: &Columns) {
        if is_plc(name)
            && let Some(entry) = NotActedOn::find("$A_")
        {
            self.report_word(entry, columns);
        }
    }

    /// The same for what a block reads.
    pub(super) fn report_plc_reads(&mut self, block: &Block) {
        let mut found = None;
        visit_expressions(&block.statement, &mut |expression| {
            if let ExprKind::System(system) = &expression.kind
                && is_plc(&system.name)
            {
                found.get_or_insert((system.name.clone(), expression.columns.clone()));
            }
        });
        if let Some((name, columns)) = found {
            self.report_plc(&name, &columns);
        }
    }

    /// Keeps what a program writes; `None`: not one of these.
    pub(super) fn keep_variable(
        &mut self,
        system: &SystemName,
        value: &Value,
        name_columns: &Columns,
        value_columns: &Columns,
    ) -> Option<Outcome<()>> {
        let (name, kept) = find_kept(&system.name)?;
        let number = || -> Outcome<(i32, f64)> {
            let element = if kept.indexed { self.element(name, &system.indices, name_columns)? } else { 0 };
            let Some((least, greatest)) = kept.whole else { return Ok((element, value.number(value_columns)?)) };
            let whole = value.integer(value_columns)?;
            if (least..=greatest).contains(&whole) {
                return Ok((element, f64::from(whole)));
            }
            Err(Fault::new(codes::OUT_OF_RANGE, value_columns.clone(), format!("{whole} does not fit {name}"))
                .label(format!("expected {least} to {greatest}")))
        };
        Some(number().map(|(element, number)| self.memory.keep(name, element, number)))
    }

    /// $MN_ and $MC_ that follow from what this kernel is.
    pub(super) fn fixed_machine_datum(&self, system: &SystemName, columns: &Columns) -> Outcome<Option<Value>> {
        let SystemName { name, indices } = system;
        let element = || self.element(name, indices, columns).map(|element| element.unsigned_abs() as usize);
        Ok(Some(match &**name {
            "$MN_SCALING_SYSTEM_IS_METRIC" => Value::Bool(true),
            "$MC_CHAN_NAME" => Value::Text("CHAN1".into()),
            "$MC_MM_NUM_R_PARAM" => Value::Int(R_COUNT),
            "$MC_MM_IPO_BUFFER_SIZE" => Value::Int(i32::try_from(self.machine.look_ahead_blocks).unwrap_or(i32::MAX)),
            "$MC_AXCONF_GEOAX_NAME_TAB" => {
                let axis = self.geometry.get(element()?).copied().flatten();
                Value::Text(axis.map_or("", |axis| self.axis_name(axis)).into())
            }
            "$MC_AXCONF_CHANAX_NAME_TAB" => {
                Value::Text(self.machine.axes.get(element()?).map_or("", |axis| axis.name.as_str()).into())
            }
            _ => return Ok(None),
        }))
    }
}

/// True for what a PLC would set or see.
fn is_plc(name: &str) -> bool {
    name.starts_with("$A_IN") || name.starts_with("$A_OUT") || name.starts_with("$A_DB")
}

fn find_kept(name: &str) -> Option<(&'static str, Kept)> {
    KEPT.iter().find(|(known, _)| *known == name).copied()
}
