//! One axis of one trace on one time grid, in internal units.
//!
//! In: a [`Trace`], the axis with its drive. Out: [`AxisRecord`] at the position cycle, and [`FineRecord`] where the trace is faster than
//! that. A signal that is not there is `None`, a value that is not there NaN. Does not filter. Rows of a faster trace are taken at the position
//! ticks, its current is averaged over each position cycle.

use super::plausible::other_kind;
use super::wire::TorqueSource;
use crate::base::units::rad_from_deg;
use crate::base::{AxisKind, Diagnostic};
use crate::machine::{Axis, DriveData};
use crate::trace::{Clock, Method, Signal, TimeGrid, Trace};
use std::f64::consts::TAU;

/// Samples of one axis at its position cycle (or at the slower cycle of the trace).
#[derive(Clone, Debug)]
pub(super) struct AxisRecord {
    /// Name of the trace.
    pub(super) trace: String,
    /// Distance of the rows.
    pub(super) period_s: f64,
    /// Rows.
    pub(super) count: usize,
    /// Start and length of the longest time without samples.
    pub(super) gap_s: Option<[f64; 2]>,
    /// x_set.
    pub(super) setpoint_lu: Option<Vec<f64>>,
    /// x_meas.
    pub(super) position_lu: Option<Vec<f64>>,
    /// What `position_lu` was made of.
    pub(super) position_from: &'static str,
    /// x_ref, recorded or deviation plus measured position.
    pub(super) reference_lu: Option<Vec<f64>>,
    /// e_fol.
    pub(super) deviation_lu: Option<Vec<f64>>,
    /// e_trk.
    pub(super) following_lu: Option<Vec<f64>>,
    /// v_ff.
    pub(super) velocity_feedforward_lu_s: Option<Vec<f64>>,
    /// v_cmd.
    pub(super) velocity_command_lu_s: Option<Vec<f64>>,
    /// Set-point speed at the input of the position controller, of a control's trace.
    pub(super) filtered_velocity_lu_s: Option<Vec<f64>>,
    /// t_ff.
    pub(super) torque_feedforward_n_m: Option<Vec<f64>>,
    /// Torque of the motor.
    pub(super) torque: Option<Torque>,
    /// Rows as fast as the speed loop.
    pub(super) fine: Option<FineRecord>,
}

impl AxisRecord {
    /// Set-point, position and torque from a row on: what a simulation is held against.
    pub(super) fn simulated_from(&self, row: usize) -> Self {
        let cut = |values: &Option<Vec<f64>>| values.as_ref().map(|values| values[row.min(values.len())..].to_vec());
        let torque = |torque: &Torque| {
            let from = row.min(torque.values_n_m.len());
            Torque { values_n_m: torque.values_n_m[from..].to_vec(), source: torque.source }
        };
        Self {
            trace: self.trace.clone(),
            period_s: self.period_s,
            count: self.count.saturating_sub(row),
            gap_s: self.gap_s,
            setpoint_lu: cut(&self.setpoint_lu),
            position_lu: cut(&self.position_lu),
            position_from: self.position_from,
            reference_lu: None,
            deviation_lu: None,
            following_lu: None,
            velocity_feedforward_lu_s: None,
            velocity_command_lu_s: None,
            filtered_velocity_lu_s: None,
            torque_feedforward_n_m: None,
            torque: self.torque.as_ref().map(torque),
            fine: None,
        }
    }
}

/// Torque of the motor, row by row.
#[derive(Clone, Debug)]
pub(super) struct Torque {
    pub(super) values_n_m: Vec<f64>,
    pub(super) source: TorqueSource,
}

/// What the speed loop saw, at the cycle of the trace.
#[derive(Clone, Debug)]
pub(super) struct FineRecord {
    pub(super) period_s: f64,
    pub(super) speed_reference_rad_s: Vec<f64>,
    pub(super) speed_rad_s: Vec<f64>,
    pub(super) torque_reference_n_m: Vec<f64>,
    pub(super) torque_feedforward_n_m: Option<Vec<f64>>,
}

/// Sampling periods without a sample from which on nothing stands between two of them.
const GAP_PERIODS: f64 = 3.0;

/// Rows of one axis at most: some hours at 1 ms.
const ROWS_MAX: usize = 20_000_000;

/// One signal after another, brought to the grid.
struct Reader<'a> {
    trace: &'a Trace,
    axis: &'a Axis,
    times: Vec<f64>,
    grid: TimeGrid,
}

impl Reader<'_> {
    fn signal(&self, stem: &str) -> Option<&Signal> {
        self.trace.axis_signal(&self.axis.name, stem).filter(|signal| !signal.is_empty())
    }

    /// Values in SI at the motor.
    fn raw(&self, stem: &str) -> Option<Vec<f64>> {
        let signal = self.signal(stem)?;
        let on_grid = matches!(self.grid, TimeGrid::Uniform { .. }) && signal.times == self.grid;
        let values = if on_grid && signal.values.len() == self.times.len() {
            signal.values.clone()
        } else {
            // A signal of the position controller stands in the file when it changes; any other is a sample of something smooth.
            let method = if signal.clock == Clock::Servo { Method::Hold } else { Method::Linear };
            let times: Vec<f64> = self.times.iter().map(|time_s| time_s + signal.meaning.delay_s).collect();
            let mut values = signal.resampled(&times, method);
            for [from_s, to_s] in gaps(signal) {
                let (first, last) =
                    (times.partition_point(|time_s| *time_s <= from_s), times.partition_point(|time_s| *time_s < to_s));
                values.iter_mut().take(last).skip(first).for_each(|value| *value = f64::NAN);
            }
            values
        };
        values.iter().any(|value| value.is_finite()).then_some(values)
    }

    /// Values in lengths of the axis.
    fn length(&self, stem: &str) -> Option<Vec<f64>> {
        let mut values = self.raw(stem)?;
        if self.axis.kind == AxisKind::Rotary {
            values.iter_mut().for_each(|value| *value = rad_from_deg(*value));
        }
        if self.axis.modulo && stem.starts_with("position_") {
            unwrap(&mut values, TAU);
        }
        Some(values)
    }
}

/// A modulo axis goes on behind a turn instead of beginning again.
pub(crate) fn unwrap(angles: &mut [f64], turn: f64) {
    let (mut turns, mut before) = (0.0, f64::NAN);
    for angle in angles.iter_mut().filter(|angle| angle.is_finite()) {
        let raw = *angle;
        if before.is_finite() {
            turns -= ((raw - before) / turn).round();
        }
        before = raw;
        *angle = raw + turns * turn;
    }
}

/// Times without samples, of a signal that is sampled (one of the position controller may stand in the file when it changes).
fn gaps(signal: &Signal) -> Vec<[f64; 2]> {
    let (TimeGrid::Explicit(times), Some(period_s)) = (&signal.times, signal.times.period_s()) else {
        return Vec::new();
    };
    if signal.clock == Clock::Servo {
        return Vec::new();
    }
    times.windows(2).filter(|pair| pair[1] - pair[0] > GAP_PERIODS * period_s).map(|pair| [pair[0], pair[1]]).collect()
}

/// The signal whose grid is that of the axis: one of its positions, of the position controller if there is a choice.
fn timed<'t>(trace: &'t Trace, axis: &Axis) -> Option<&'t Signal> {
    let of = |stem: &&str| trace.axis_signal(&axis.name, stem).filter(|signal| signal.len() > 1);
    let stems = [
        "position_setpoint",
        "position_measured",
        "position_actual",
        "following_error",
        "current",
        "current_mean",
        "torque_reference",
    ];
    let signals: Vec<&Signal> = stems.iter().filter_map(of).collect();
    let servo = signals.iter().find(|signal| signal.clock != Clock::Interpolator);
    servo.or(signals.first()).copied()
}

/// Reads one axis; `Ok(None)` if the trace has nothing of it.
pub(super) fn read(
    trace: &Trace,
    axis: &Axis,
    data: &DriveData,
    cycle_s: f64,
) -> Result<Option<AxisRecord>, Diagnostic> {
    let Some(signal) = timed(trace, axis) else { return Ok(None) };
    let lengths = ["position_setpoint", "position_measured", "position_actual", "following_error"];
    let other = lengths.iter().filter_map(|stem| trace.axis_signal(&axis.name, stem));
    if let Some(refused) = other.filter_map(|signal| other_kind(trace, signal, axis)).next() {
        return Err(refused);
    }
    let grid = &signal.times;
    let (Some(start_s), Some(end_s), Some(period_s)) = (grid.start_s(), grid.end_s(), grid.period_s()) else {
        return Ok(None);
    };
    let rows = ((end_s - start_s) / period_s).round() + 1.0;
    if !(2.0..=ROWS_MAX as f64).contains(&rows) {
        let message = format!("`{}`: {rows:.0} samples of axis {} at {period_s:e} s", trace.name, axis.name);
        return Err(Diagnostic::error("T0203", message).help(
            "the times of this trace are no grid that an identification can use: export it at one sampling period",
        ));
    }
    let times = (0..rows as usize).map(|k| start_s + k as f64 * period_s).collect();
    let reader = Reader { trace, axis, times, grid: grid.clone() };
    let longest = gaps(signal).into_iter().max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])));
    let gap_s = longest.map(|[from_s, to_s]| [from_s, to_s - from_s]);
    Ok(Some(AxisRecord { gap_s, ..at_position_cycle(&reader, data, period_s, cycle_s) }))
}

fn at_position_cycle(reader: &Reader<'_>, data: &DriveData, period_s: f64, cycle_s: f64) -> AxisRecord {
    let ratio = (cycle_s / period_s).round();
    let finer = ratio >= 2.0 && (cycle_s / period_s - ratio).abs() < 1e-3;
    let every = if finer { ratio as usize } else { 1 };
    let thin = |values: Vec<f64>| values.into_iter().step_by(every).collect::<Vec<f64>>();
    let length = |stem: &str| reader.length(stem).map(thin);
    let motor = |stem: &str| reader.raw(stem).map(thin);
    let setpoint_lu = length("position_setpoint");
    let following_lu = length("following_error");
    let (position_lu, position_from) = position(reader, &length, setpoint_lu.as_ref(), following_lu.as_ref());
    let deviation_lu = length("control_deviation");
    let sum = |deviation: &Vec<f64>| position_lu.as_ref().map(|position| added(deviation, position));
    let reference_lu = length("position_reference").or_else(|| deviation_lu.as_ref().and_then(sum));
    let r = data.mechanics.transmission_lu_per_rad;
    let from_motor = || motor("motor_speed_reference").map(|speed| speed.iter().map(|w| w * r).collect());
    let own = reader.trace.origin.format == crate::trace::TraceFormat::Recording;
    AxisRecord {
        trace: reader.trace.name.clone(),
        period_s: if finer { cycle_s } else { period_s },
        count: reader.times.len().div_ceil(every),
        gap_s: None,
        velocity_command_lu_s: length("velocity_command").or_else(from_motor),
        velocity_feedforward_lu_s: length("velocity_feedforward"),
        // In our recordings that is the analytic velocity of the interpolator, before any filter.
        filtered_velocity_lu_s: if own { None } else { length("velocity_setpoint") },
        torque_feedforward_n_m: motor("torque_feedforward"),
        torque: torque(reader, data, every),
        fine: if finer { fine(reader, period_s) } else { None },
        setpoint_lu,
        position_lu,
        position_from,
        reference_lu,
        deviation_lu,
        following_lu,
    }
}

fn added(one: &[f64], other: &[f64]) -> Vec<f64> {
    one.iter().zip(other).map(|(one, other)| one + other).collect()
}

/// The position of the axis from the best signal there is.
fn position(
    reader: &Reader<'_>,
    length: &dyn Fn(&str) -> Option<Vec<f64>>,
    setpoint: Option<&Vec<f64>>,
    following: Option<&Vec<f64>>,
) -> (Option<Vec<f64>>, &'static str) {
    for (stem, title) in [("position_measured", "measured position"), ("position_actual", "actual position")] {
        if reader.signal(stem).is_some_and(|signal| signal.clock != Clock::Interpolator) {
            return (length(stem), title);
        }
    }
    if let (Some(setpoint), Some(following)) = (setpoint, following) {
        let position = setpoint.iter().zip(following).map(|(setpoint, error)| setpoint - error).collect();
        return (Some(position), "set-point minus following error");
    }
    (length("position_measured"), "position at the interpolator cycle")
}

/// The torque of the motor from the best signal there is.
fn torque(reader: &Reader<'_>, data: &DriveData, every: usize) -> Option<Torque> {
    let kt = data.motor.torque_constant_n_m_per_a;
    let of_current = |values: Vec<f64>, source| Torque { values_n_m: values.iter().map(|i| kt * i).collect(), source };
    if let Some(values) = reader.raw("current_mean") {
        return Some(of_current(values.into_iter().step_by(every).collect(), TorqueSource::MeanCurrent));
    }
    if let Some(values) = reader.raw("current") {
        if every == 1 {
            return Some(of_current(values, TorqueSource::Current));
        }
        // The mean belongs to the cycle that ends at a tick.
        let mut means = vec![values[0]];
        means.extend(values.chunks_exact(every).map(|cycle| cycle.iter().sum::<f64>() / every as f64));
        means.truncate(reader.times.len().div_ceil(every));
        return Some(of_current(means, TorqueSource::FineCurrent));
    }
    let values = reader.raw("torque_reference")?;
    Some(Torque { values_n_m: values.into_iter().step_by(every).collect(), source: TorqueSource::TorqueReference })
}

fn fine(reader: &Reader<'_>, period_s: f64) -> Option<FineRecord> {
    Some(FineRecord {
        period_s,
        speed_reference_rad_s: reader.raw("motor_speed_reference")?,
        speed_rad_s: reader.raw("motor_speed")?,
        torque_reference_n_m: reader.raw("torque_reference")?,
        torque_feedforward_n_m: reader.raw("torque_feedforward"),
    })
}
