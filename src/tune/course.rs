//! What is driven: position set-points of all axes, at the position cycle of each.
//!
//! In: a program (through the kernel, without drives, once), or a trace with set-points and a measured error. Out: [`Course`]. Exact stops do
//! not wait for the axes here: the set-points depend on no gain. Of a long program the first [`COURSE_MAX_S`] count.

use crate::base::units::{MS_PER_S, RAD_PER_REV, deg_from_rad, rad_from_deg};
use crate::base::{AxisId, AxisKind, Diagnostic, MachinePoint, PerAxis};
use crate::identify::unwrap;
use crate::interpolator::{AxisSetpoint, FineInterpolator};
use crate::interpreter::Setup;
use crate::kernel::{Kernel, Status};
use crate::machine::{Axis, Machine};
use crate::trace::{Method, Signal, Trace, Zero};
use std::borrow::Cow;
use std::sync::Arc;

/// Longest course: gains need reversals and accelerations, not hours.
pub const COURSE_MAX_S: f64 = 120.0;
/// Errors of a trace, the most exact first.
const ERRORS: [&str; 4] = ["control_deviation", "following_error", "position_actual", "position_measured"];
/// A recorded feed-forward may be so much earlier or later than the set-point.
const SWITCH_REACH_S: f64 = 0.01;
/// Of the fastest set-point: what is slower does not tell whether feed-forward is on.
const MOVES_SHARE: f64 = 0.05;
/// Of the feed-forward that the speed asks for: what is less is none.
const OFF_SHARE: f64 = 0.1;

/// Set-points of one program or trace.
#[derive(Clone, Debug)]
pub struct Course {
    /// As the user named it.
    pub name: String,
    /// Never used for tuning.
    pub validates: bool,
    /// From a trace: its errors are measured ones.
    pub measured: bool,
    /// Time.
    pub duration_s: f64,
    /// What the program gave rise to.
    pub warnings: Vec<Diagnostic>,
    pub(super) axes: Vec<AxisCourse>,
    /// Postures at t_s, of all axes of the machine.
    pub(super) postures: Vec<MachinePoint>,
    /// Feed-forward in the cycle that begins at each of them.
    pub(super) active: Vec<bool>,
}

/// One axis of it.
#[derive(Clone, Debug)]
pub(super) struct AxisCourse {
    pub axis: AxisId,
    /// Position cycles in t_s.
    pub steps: usize,
    /// Set-points at the position cycle; the last one stands at the last posture.
    pub positions_lu: Vec<f64>,
    pub moves: bool,
    /// Error of the trace, with the gains of the machine: control deviation, else set-point minus actual.
    pub measured_lu: Option<Measured>,
    /// Measured minus simulated, with the gains of the machine; the same for both errors.
    pub offset_lu: Vec<f64>,
    /// The error is that of an encoder with a zero of its own: its mean means nothing.
    pub own_zero: bool,
}

#[derive(Clone, Debug)]
pub(super) enum Measured {
    Deviation(Vec<f64>),
    Following(Vec<f64>),
}

impl Course {
    /// Its beginning, the whole if it is shorter.
    pub fn beginning(mut self, duration_s: f64) -> Self {
        let period_s = self.duration_s / (self.postures.len().max(2) - 1) as f64;
        let rows = ((duration_s / period_s.max(f64::MIN_POSITIVE)) as usize).clamp(1, self.postures.len().max(1));
        if rows < self.postures.len() {
            self.postures.truncate(rows);
            self.active.truncate(rows);
            for axis in &mut self.axes {
                axis.positions_lu.truncate((rows - 1) * axis.steps + 1);
                axis.moves = axis.positions_lu.windows(2).any(|pair| pair[0] != pair[1]);
                match &mut axis.measured_lu {
                    Some(Measured::Deviation(values) | Measured::Following(values)) => {
                        values.truncate(axis.positions_lu.len());
                    }
                    None => {}
                }
            }
            self.duration_s = (rows - 1) as f64 * period_s;
        }
        self
    }
}

/// Set-points of a program. Errors: the alarm that ends it.
pub fn course_of_program(
    name: &str,
    setup: Setup,
    machine: &Arc<Machine>,
    validates: bool,
    tell: &mut dyn FnMut(f64),
) -> Result<Course, Diagnostic> {
    let mut kernel = Kernel::new(machine.clone(), setup, false);
    let mut sent: Vec<Vec<AxisSetpoint>> = vec![Vec::new(); machine.axes.len()];
    let mut active = Vec::new();
    let period_s = machine.cycle.time_base.setpoint_period_s();
    while (active.len() as f64) * period_s < COURSE_MAX_S && kernel.cycle()? == Status::Running {
        let output = kernel.output();
        for row in &output.rows {
            sent[row.axis.index()].push(row.setpoint);
        }
        active.push(output.setpoint.is_some_and(|setpoint| setpoint.feedforward_active));
        if active.len().is_multiple_of(4096) {
            tell(active.len() as f64 * period_s);
        }
    }
    let mut findings = kernel.take_findings();
    if let Some(alarm) = findings.alarm {
        return Err(alarm);
    }
    findings.warnings.extend(cut(name, active.len() as f64 * period_s >= COURSE_MAX_S));
    let axes = machine
        .axis_ids()
        .filter_map(|axis| {
            let data = machine.axis(axis).drive.as_ref()?;
            let fine = FineInterpolator::new(machine, data.position_cycle_ticks);
            let steps = fine.steps();
            let mut positions_lu = Vec::with_capacity(active.len() * steps as usize);
            for pair in sent[axis.index()].windows(2) {
                positions_lu.extend((0..steps).map(|step| fine.at(&pair[0], &pair[1], step).position_lu));
            }
            positions_lu.extend(sent[axis.index()].last().map(|last| last.position_lu));
            Some(axis_course(axis, steps as usize, positions_lu))
        })
        .collect();
    let posture = |k: usize| {
        MachinePoint(PerAxis::from_fn(|axis| {
            sent.get(axis.index()).and_then(|of_axis| of_axis.get(k)).map_or(0.0, |setpoint| setpoint.position_lu)
        }))
    };
    let postures: Vec<MachinePoint> = (0..active.len()).map(posture).collect();
    Ok(Course {
        name: name.to_owned(),
        validates,
        measured: false,
        duration_s: postures.len().saturating_sub(1) as f64 * period_s,
        warnings: findings.warnings,
        axes,
        postures,
        active,
    })
}

/// Set-points between samples are straight lines, and with them the feed-forward of the simulation steps.
fn too_slow(machine: &Machine, axis: AxisId, signal: &Signal, name: &str) -> Option<Diagnostic> {
    const SAME_RATE: f64 = 1.5;
    let of_axis = machine.axis(axis);
    let cycle_s = machine.cycle.time_base.seconds(of_axis.drive.as_ref()?.position_cycle_ticks);
    let last = signal.len() - 1;
    let sample_s = (signal.times.time_s(last) - signal.times.time_s(0)) / last as f64;
    (sample_s > SAME_RATE * cycle_s).then(|| {
        let [sample_ms, cycle_ms] = [sample_s, cycle_s].map(|time_s| time_s * MS_PER_S);
        let message = format!(
            "`{name}`: set-points of {} every {sample_ms:.3} ms, and its position cycle is {cycle_ms:.3} ms: between them they are straight lines",
            of_axis.name
        );
        let help = "record in the position cycle; torque feed-forward tuned on this is uncertain beyond its interval";
        Diagnostic::warning("U0006", message).help(help)
    })
}

/// Says that the rest does not count.
fn cut(name: &str, is_cut: bool) -> Option<Diagnostic> {
    is_cut.then(|| {
        let message = format!("`{name}`: its first {COURSE_MAX_S} s are used, the rest is not looked at");
        Diagnostic::note("U0005", message)
            .help("gains need accelerations and reversals of every axis: give the part that has them")
    })
}

fn axis_course(axis: AxisId, steps: usize, positions_lu: Vec<f64>) -> AxisCourse {
    let moves = positions_lu.windows(2).any(|pair| pair[0] != pair[1]);
    AxisCourse { axis, steps, positions_lu, moves, measured_lu: None, offset_lu: Vec::new(), own_zero: false }
}

/// Set-points and errors of a trace. Errors: signals that are missing, gaps.
pub fn course_of_trace(trace: &Trace, machine: &Machine, validates: bool) -> Result<Course, Diagnostic> {
    let find = |axis: AxisId, stem: &str| -> Option<&Signal> {
        trace.signal(&format!("{}.{stem}", machine.axis(axis).name)).filter(|signal| signal.len() > 1)
    };
    let found: Vec<(AxisId, &Signal)> =
        machine.axis_ids().filter_map(|axis| Some((axis, find(axis, "position_setpoint")?))).collect();
    let errors = |axis: AxisId| ERRORS.iter().find_map(|stem| find(axis, stem).map(|signal| (*stem, signal)));
    let used = found.iter().flat_map(|(axis, signal)| [Some(*signal), errors(*axis).map(|(_, signal)| signal)]);
    // A late signal shows what belongs to an earlier time.
    let span = |signal: &Signal| [0, signal.len() - 1].map(|row| signal.times.time_s(row) - signal.meaning.delay_s);
    let spans: Vec<[f64; 2]> = used.flatten().map(span).collect();
    let start_s = spans.iter().map(|span| span[0]).fold(f64::NEG_INFINITY, f64::max);
    let end_s = spans.iter().map(|span| span[1]).fold(f64::INFINITY, f64::min);
    let period_s = machine.cycle.time_base.setpoint_period_s();
    let steps = ((end_s - start_s).min(COURSE_MAX_S) / period_s + 1e-6).floor();
    if found.is_empty() || steps.is_nan() || steps < 1.0 {
        let message =
            format!("`{}` holds no position set-points of the axes of this machine in one stretch", trace.name);
        let help = "record position set-point and control deviation (or actual position) of each axis; --axis-name 7=A names axes";
        return Err(Diagnostic::error("U0001", message).help(help));
    }
    let mut axes = Vec::new();
    for (axis, signal) in &found {
        let Some(data) = machine.axis(*axis).drive.as_ref() else { continue };
        let ratio = (machine.cycle.time_base.ticks_per_setpoint() / data.position_cycle_ticks.max(1)).max(1);
        let cycle_s = period_s / ratio as f64;
        let times: Vec<f64> = (0..=steps as usize * ratio as usize).map(|k| start_s + k as f64 * cycle_s).collect();
        let of_axis = machine.axis(*axis);
        let setpoints = resampled(&going_on(signal, of_axis), &times, of_axis.kind, &trace.name)?;
        let mut course = axis_course(*axis, ratio as usize, setpoints);
        if let Some((stem, signal)) = errors(*axis) {
            let is_position = stem.starts_with("position_");
            let going_on = if is_position { going_on(signal, of_axis) } else { Cow::Borrowed(signal) };
            let values = resampled(&going_on, &times, of_axis.kind, &trace.name)?;
            course.measured_lu = Some(match stem {
                "control_deviation" => Measured::Deviation(values),
                "following_error" => Measured::Following(values),
                _ => {
                    course.own_zero = signal.meaning.zero == Zero::Encoder;
                    let lag = course.positions_lu.iter().zip(&values).map(|(sent, actual)| sent - actual);
                    let mut lag: Vec<f64> = lag.collect();
                    if of_axis.modulo {
                        // The two may have begun on either side of 360 deg.
                        let apart = lag.first().map_or(0.0, |first| (first / RAD_PER_REV).round() * RAD_PER_REV);
                        lag.iter_mut().for_each(|lag| *lag -= apart);
                    }
                    Measured::Following(lag)
                }
            });
        }
        if course.moves && course.measured_lu.is_none() {
            let name = &machine.axis(*axis).name;
            let message = format!("`{}` has set-points of {name}, and no error of it", trace.name);
            let help = "record its control deviation, following error or actual position as well";
            return Err(Diagnostic::error("U0001", message).help(help));
        }
        axes.push(course);
    }
    let mut warnings: Vec<Diagnostic> = cut(&trace.name, end_s - start_s > COURSE_MAX_S).into_iter().collect();
    warnings.extend(found.iter().filter_map(|(axis, signal)| too_slow(machine, *axis, signal, &trace.name)));
    let rows = steps as usize + 1;
    let posture = |k: usize| {
        MachinePoint(PerAxis::from_fn(|axis| {
            let of_axis = axes.iter().find(|course| course.axis == axis);
            let home_lu = machine.axes.get(axis.index()).map_or(0.0, |axis| axis.home_lu);
            of_axis.and_then(|course| course.positions_lu.get(k * course.steps).copied()).unwrap_or(home_lu)
        }))
    };
    let postures = (0..rows).map(posture).collect();
    let name = trace.name.clone();
    let feedforward = |axis: AxisId| find(axis, "velocity_feedforward");
    let row_times: Vec<f64> = (0..rows).map(|k| start_s + k as f64 * period_s).collect();
    let active = switched(machine, &axes, feedforward, &row_times);
    Ok(Course { name, validates, measured: true, duration_s: steps * period_s, warnings, axes, postures, active })
}

/// Positions of a modulo axis go on behind 360 deg, so that samples between two of a trace are not those of a turn back.
fn going_on<'t>(signal: &'t Signal, axis: &Axis) -> Cow<'t, Signal> {
    if !axis.modulo {
        return Cow::Borrowed(signal);
    }
    let mut signal = signal.clone();
    unwrap(&mut signal.values, deg_from_rad(RAD_PER_REV));
    Cow::Owned(signal)
}

/// Feed-forward at every row, as a recorded velocity feed-forward tells while axes move; on where none does. At rest nothing tells: it is as
/// it was, and before the first move as in it.
fn switched<'t>(
    machine: &Machine,
    axes: &[AxisCourse],
    feedforward: impl Fn(AxisId) -> Option<&'t Signal>,
    times: &[f64],
) -> Vec<bool> {
    let mut told: Vec<Option<bool>> = vec![None; times.len()];
    let period_s = times.get(1).map_or(1.0, |second| second - times[0]);
    let reach = (SWITCH_REACH_S / period_s).ceil() as usize;
    for course in axes {
        let axis = machine.axis(course.axis);
        let weight = axis.drive.as_ref().map_or(0.0, |data| data.velocity_feedforward_ratio);
        let Some(signal) = feedforward(course.axis).filter(|_| weight > 0.0) else { continue };
        let recorded: Vec<f64> =
            at_times(signal, times).iter().map(|value| from_border(axis.kind, *value).abs()).collect();
        let sent: Vec<f64> = course.positions_lu.iter().step_by(course.steps).copied().collect();
        let wanted: Vec<f64> = sent.windows(2).map(|pair| weight * (pair[1] - pair[0]).abs() / period_s).collect();
        let fast = MOVES_SHARE * wanted.iter().copied().fold(0.0, f64::max);
        for (row, wanted) in wanted.iter().enumerate().filter(|(_, wanted)| **wanted > fast) {
            let near = &recorded[row.saturating_sub(reach)..(row + reach + 1).min(recorded.len())];
            // Where the feed-forward waits for the drive it is smaller for some cycles: only what is near nothing is off.
            let largest = near.iter().copied().fold(f64::NAN, f64::max);
            if largest.is_finite() {
                told[row] = Some(told[row].unwrap_or(false) || largest > OFF_SHARE * wanted);
            }
        }
    }
    let mut state = told.iter().flatten().next().copied().unwrap_or(true);
    let hold = |told: &Option<bool>| {
        state = told.unwrap_or(state);
        state
    };
    told.iter().map(hold).collect()
}

/// Values at our times; a late signal is looked up later.
fn at_times(signal: &Signal, times: &[f64]) -> Vec<f64> {
    let late: Vec<f64> = times.iter().map(|time_s| time_s + signal.meaning.delay_s).collect();
    signal.resampled(&late, Method::Linear)
}

fn from_border(kind: AxisKind, value: f64) -> f64 {
    if kind == AxisKind::Rotary { rad_from_deg(value) } else { value }
}

fn resampled(signal: &Signal, times: &[f64], kind: AxisKind, name: &str) -> Result<Vec<f64>, Diagnostic> {
    let mut values = at_times(signal, times);
    if let Some(row) = values.iter().position(|value| value.is_nan()) {
        let message = format!("`{name}`: `{}` has a gap at {:.6} s", signal.original, times[row]);
        return Err(Diagnostic::error("U0001", message).help("export a part without gaps"));
    }
    values.iter_mut().for_each(|value| *value = from_border(kind, *value));
    Ok(values)
}
