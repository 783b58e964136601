//! The drives alone, fed with a table of position set-points.
//!
//! In: [`SetpointTable`]. Out: axis rows, as the running kernel records them. Velocity, acceleration and jerk of the set-point are
//! backward differences here: a table has no analytic ones. Does not plan or interpolate.

use super::alarms::{diverged, monitored};
use super::cycle::AxisRow;
use super::figures::Figures;
use super::inner_rows::InnerRows;
use super::record::{FollowRow, record_alarm, record_follow};
use super::setpoint_limits::SetpointLimits;
use super::setpoint_table::{SetpointTable, row_ticks};
use super::summary::{RunSummary, Warning, drive_warnings};
use crate::base::{Diagnostic, MachinePoint, PerAxis, Severity, Tick};
use crate::drive::{Drive, DriveInput, Start};
use crate::interpolator::AxisSetpoint;
use crate::kinematics::Kinematics;
use crate::machine::{Loaded, Machine};
use crate::recorder::{RecordRate, Recorder, RecordingSetup, SignalChoice};
use serde_json::{Value, json};
use std::path::Path;

/// How to follow.
pub struct FollowOptions<'a> {
    /// The machine, as loaded.
    pub machine: &'a Loaded,
    /// Axes start balanced or with empty integrators.
    pub start: Start,
    /// Where to record; `None`: figures only.
    pub recording: Option<&'a Path>,
    /// Signals to record.
    pub signals: SignalChoice,
    /// Mantissa bits to keep in the recording; `None`: all.
    pub mantissa_bits: Option<u8>,
}

/// What came of it.
pub struct FollowOutcome {
    /// Position periods simulated.
    pub rows: usize,
    /// Figures per axis, at the border.
    pub summary: Value,
    /// Warnings in order.
    pub warnings: Vec<Diagnostic>,
    /// What ended the run early.
    pub alarm: Option<Diagnostic>,
}

/// Follows `table`; records it. Errors: the recording cannot be written.
pub fn follow(table: &SetpointTable, options: &FollowOptions<'_>) -> Result<FollowOutcome, Diagnostic> {
    let machine = &options.machine.machine;
    let mut recorder = match options.recording {
        None => None,
        Some(path) => {
            let mut setup = RecordingSetup::new(machine, &options.machine.name, &options.machine.text_as_used, &[]);
            setup.signals = options.signals;
            setup.decimation = options.signals.decimation();
            setup.mantissa_bits = options.mantissa_bits;
            Some(Recorder::to_file(path, &setup)?)
        }
    };
    let mut follower = Follower::new(machine, table, options);
    let mut alarm = None;
    while follower.next_row < table.rows && alarm.is_none() {
        match follower.step(table) {
            Ok(row) => {
                if let Some(recorder) = &mut recorder {
                    record_follow(recorder, &machine.cycle.time_base, row_ticks(machine), &row)?;
                }
            }
            Err(diverged) => alarm = Some(diverged),
        }
    }
    let rows = follower.next_row;
    let mut warnings = options.machine.warnings.clone();
    if !table.timed {
        let period_s = machine.cycle.time_base.seconds(row_ticks(machine));
        let message = format!("no column time_s: the rows are taken to stand {period_s} s apart, the position cycle");
        warnings.push(Diagnostic::warning("F0012", message));
    }
    warnings.extend(drive_warnings(machine, true));
    warnings.extend(follower.limits.warnings(machine));
    let stopped = machine.axis_ids().filter_map(|axis| follower.stopped[axis].take());
    warnings.extend(stopped.map(|alarm| Diagnostic { severity: Severity::Warning, ..alarm }));
    let summary = summary(machine, &follower.figures, rows, &warnings, alarm.as_ref());
    if let Some(mut recorder) = recorder {
        if let Some(alarm) = &alarm {
            record_alarm(&mut recorder, Tick(rows.saturating_sub(1) as u64 * row_ticks(machine)), None, alarm);
        }
        recorder.finish(&summary.to_string())?;
    }
    Ok(FollowOutcome { rows, summary, warnings, alarm })
}

fn summary(
    machine: &Machine,
    figures: &Figures,
    rows: usize,
    warnings: &[Diagnostic],
    alarm: Option<&Diagnostic>,
) -> Value {
    let list: Vec<Warning> = warnings.iter().map(Warning::from).collect();
    let mut document = json!({
        "format": 1,
        "machine": machine.name,
        "rows": rows,
        "duration_s": machine.cycle.time_base.seconds(rows.saturating_sub(1) as u64 * row_ticks(machine)),
        "axes": RunSummary::new(machine, "", figures, true).axes,
        "warnings": list,
    });
    if let Some(alarm) = alarm {
        document["alarm"] = json!(Warning::from(alarm));
    }
    document
}

/// The drives and the row that comes next.
struct Follower<'a> {
    machine: &'a Machine,
    kinematics: Kinematics,
    drives: Vec<Drive>,
    figures: Figures,
    sent: PerAxis<f64>,
    actual: PerAxis<f64>,
    setpoints: PerAxis<AxisSetpoint>,
    rows: Vec<AxisRow>,
    /// By axis.
    inner: Vec<InnerRows>,
    /// An axis gives more than one row a position cycle.
    sorts_rows: bool,
    /// What the set-points have exceeded.
    limits: SetpointLimits,
    /// For what a control would have stopped an axis first.
    stopped: PerAxis<Option<Diagnostic>>,
    next_row: usize,
}

impl<'a> Follower<'a> {
    /// Axes without a column stand at home.
    fn new(machine: &'a Machine, table: &SetpointTable, options: &FollowOptions<'_>) -> Self {
        let (start, rate) = (options.start, options.signals.rate());
        let mut sent = PerAxis::from_fn(|axis| machine.axes.get(axis.index()).map_or(0.0, |axis| axis.home_lu));
        for (axis, positions) in &table.positions {
            sent[*axis] = positions[0];
        }
        let time_base = &machine.cycle.time_base;
        Self {
            machine,
            kinematics: Kinematics::new(machine),
            drives: machine.axis_ids().map(|id| Drive::new(machine.axis(id), time_base, start, sent[id])).collect(),
            figures: Figures::default(),
            sent,
            actual: sent,
            setpoints: PerAxis::default(),
            rows: Vec::with_capacity(machine.axes.len()),
            inner: machine.axes.iter().map(|axis| InnerRows::new(axis.drive.as_ref(), rate)).collect(),
            sorts_rows: rate != RecordRate::Position,
            limits: SetpointLimits::new(),
            stopped: PerAxis::from_fn(|_| None),
            next_row: 0,
        }
    }

    /// Steps every axis whose position cycle begins at this row. Errors: the alarm of a drive that has left all bounds.
    fn step(&mut self, table: &SetpointTable) -> Result<FollowRow<'_>, Diagnostic> {
        let (machine, row) = (self.machine, self.next_row);
        let step_ticks = row_ticks(machine);
        let tick = Tick(row as u64 * step_ticks);
        for (axis, positions) in &table.positions {
            self.sent[*axis] = positions[row];
        }
        self.rows.clear();
        for axis in machine.axis_ids() {
            let period_ticks = machine.axis(axis).drive.as_ref().map_or(step_ticks, |drive| drive.position_cycle_ticks);
            if !tick.0.is_multiple_of(period_ticks) {
                continue;
            }
            let period_s = machine.cycle.time_base.seconds(period_ticks);
            let setpoint = differentiate(&self.setpoints[axis], self.sent[axis], period_s, row == 0);
            let load_n_m = table.loads.iter().find(|(loaded, _)| *loaded == axis).map_or(0.0, |(_, loads)| loads[row]);
            let drive = &mut self.drives[axis.index()];
            let input = DriveInput { position_setpoint_lu: setpoint.position_lu, load_n_m, feedforward_active: true };
            let row_at = |tick, signals| AxisRow { tick, axis, setpoint, signals };
            let mut signals = if row + 1 == table.rows {
                drive.step(input)
            } else {
                let rows = &mut self.rows;
                self.inner[axis.index()].step(drive, input, tick, |tick, signals| rows.push(row_at(tick, signals)))
            };
            if !drive.is_finite() {
                return Err(diverged(machine, axis, tick));
            }
            signals.monitoring |= self.limits.see(machine, axis, &setpoint, machine.cycle.time_base.time_s(tick));
            self.setpoints[axis] = setpoint;
            self.actual[axis] = signals.position_actual_lu;
            self.figures.drive(axis, &signals);
            let now = row_at(tick, signals);
            self.rows.push(now);
            if self.stopped[axis].is_none() {
                self.stopped[axis] = monitored(machine, None, &now);
            }
        }
        if self.sorts_rows {
            self.rows.sort_unstable_by_key(|row| (row.tick, row.axis));
        }
        self.next_row += 1;
        let tools = [self.sent, self.actual].map(|posture| self.kinematics.tool_pose(&MachinePoint(posture)));
        Ok(FollowRow { tick, rows: &self.rows, tools })
    }
}

/// Backward differences of the set-point, 0 at the first row.
fn differentiate(last: &AxisSetpoint, position_lu: f64, period_s: f64, first: bool) -> AxisSetpoint {
    if first {
        return AxisSetpoint { position_lu, ..Default::default() };
    }
    let velocity_lu_s = (position_lu - last.position_lu) / period_s;
    let acceleration_lu_s2 = (velocity_lu_s - last.velocity_lu_s) / period_s;
    let jerk_lu_s3 = (acceleration_lu_s2 - last.acceleration_lu_s2) / period_s;
    AxisSetpoint { position_lu, velocity_lu_s, acceleration_lu_s2, jerk_lu_s3 }
}
