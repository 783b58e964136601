//! The simulated axis itself, fitted to the trace: output-error refinement.
//!
//! In: records with set-points, the drive with everything known about its controllers, the values of least squares. Out: better values, or
//! `None` with a verdict why not. Gauss-Newton with damping on torque and position at the ticks:
//!
//! ```text
//! r = [(τ - τ_sim)/σ_τ, (x - x_sim - zero)/σ_x]        J, B, Tc, g0 and, if no trace told them, Kp and Tn are free
//! ```
//! both behind the window of `motion`.
//! The quantum of the scale is in the model, derivatives are differences over 2 %, simulated without it (with it they
//! show which quantum is hit, and the fit stops a tenth away from the gains of the speed loop), and kvff and
//! d_pos are never free together: both come from the recorded wires or from the machine file. Where the simulated axis leaves clearly more
//! over than the law of `friction`, its controllers are not those of the machine, and least squares stay.

use super::feedforward::left_out;
use super::friction::Mechanics;
use super::motion::{filtered, half_window_rows, quantum, window};
use super::normal::{Blocks, Solution};
use super::record::AxisRecord;
use super::wire::{AxisResult, Estimate, Means, Parameter, TorqueSource};
use crate::base::TimeBase;
use crate::base::units::percent_from_ratio;
use crate::drive::{AxisDrive, DriveInput, Start};
use crate::machine::{Axis, DriveData, Machine};

/// Relative step of the differences.
const STEP_SHARE: f64 = 0.02;
/// Passes at most.
const PASSES: usize = 12;
/// Share of its interval that a value may still have to go.
const ARRIVED_SHARE: f64 = 0.1;
/// Rows of all records at most: a minute at 1 ms.
const ROWS_MAX: usize = 60_000;
/// The simulated axis may leave this much more over than the law does.
const LEFT_OVER_RATIO: f64 = 1.25;
/// Share of the torque that may be left over besides: sampling and rounding.
const LEFT_OVER_SHARE: f64 = 0.005;
/// What hitting other quanta than the axis did makes of a value: found on 20 repetitions of a synthetic trace.
const GRAIN_SHARE: f64 = 5e-3;
/// Interval of a gain of the speed loop, as a share of it, up to which it is told.
const GAIN_SHARE: f64 = 0.2;
/// A block.
const BLOCK_S: f64 = 0.25;
/// Rest in front of a motion that a simulation can start from: at the start of a trace, and behind another motion, which must have settled.
const REST_S: f64 = 0.01;
const SETTLED_S: f64 = 0.2;

/// What is fitted.
struct Problem<'a> {
    records: &'a [AxisRecord],
    axis: &'a Axis,
    data: DriveData,
    time_base: &'a TimeBase,
    free: Vec<Parameter>,
}

/// Residuals of one record: torque in N m, position in lu.
struct Residuals {
    torque: Vec<f64>,
    position: Vec<f64>,
}

/// The refined values, or `None`.
pub(super) fn refine(
    records: &[AxisRecord],
    machine: &Machine,
    axis: &Axis,
    known: &DriveData,
    start: &Mechanics,
    result: &mut AxisResult,
) -> Option<Vec<Estimate>> {
    let cycle_s = machine.cycle.time_base.seconds(known.position_cycle_ticks);
    let (fit, reasons) = fit_to_simulate(records, cycle_s);
    let why = no_start(start).or(if fit.is_empty() { reasons.first().map(|(_, reason)| *reason) } else { None });
    if let Some(reason) = why {
        if !start.estimates.is_empty() {
            result.verdicts.push(format!("no output-error refinement: {reason}"));
        }
        return None;
    }
    for (record, reason) in reasons {
        left_out(std::slice::from_ref(record), reason, "the output-error refinement", result);
    }
    let records = fit.as_slice();
    let free = free_parameters(result, start);
    let mut data = known.clone();
    set(&mut data, &start.estimates.iter().map(|e| (e.parameter, e.value)).collect::<Vec<_>>());
    if let Some(quantum) = records.iter().find_map(|record| quantum(record.position_lu.as_ref()?)) {
        data.encoder.position_resolution_lu = quantum;
    }
    let mut problem = Problem { records, axis, data, time_base: &machine.cycle.time_base, free };
    let (solution, left_n_m) = problem.solve()?;
    let torque_rms_n_m = problem.torque_rms();
    if left_n_m > LEFT_OVER_RATIO * start.rms_n_m + LEFT_OVER_SHARE * torque_rms_n_m {
        let percent = percent_from_ratio(left_n_m / torque_rms_n_m);
        let law_percent = percent_from_ratio(start.rms_n_m / torque_rms_n_m);
        result.verdicts.push(format!(
            "the simulated axis leaves {percent:.1} % of the torque over, the law of friction and inertia {law_percent:.1} %: \
             its controllers are not quite those of this machine, and the values of least squares stay"
        ));
        return None;
    }
    result.verdicts.push(format!(
        "the simulated axis follows the trace: {:.2} % of the torque is left over",
        percent_from_ratio(left_n_m / torque_rms_n_m)
    ));
    Some(problem.estimates(&solution, start, result))
}

/// Why there is nothing to start a simulation from.
fn no_start(start: &Mechanics) -> Option<&'static str> {
    if start.value(Parameter::Inertia).is_none() || start.value(Parameter::Coulomb).is_none() {
        return Some("inertia or Coulomb friction is missing to start from");
    }
    start.misfit.then_some(
        "the trace does not follow the model of a rigid axis with Coulomb and viscous friction closely enough",
    )
}

/// The records that a simulation can be held against, from their rest on, and why the others cannot.
fn fit_to_simulate(records: &[AxisRecord], cycle_s: f64) -> (Vec<AxisRecord>, Vec<(&AxisRecord, &'static str)>) {
    let (mut fit, mut reasons, mut rows) = (Vec::new(), Vec::new(), 0);
    for record in records {
        let complete = record.setpoint_lu.is_some() && record.position_lu.is_some() && record.torque.is_some();
        let rest = rest_row(record);
        let reason = if !complete {
            "set-point, position and torque are not in the trace"
        } else if (record.period_s / cycle_s - 1.0).abs() > 1e-3 {
            "the trace is not at the position cycle"
        } else if rows + record.count > ROWS_MAX {
            "the traces are longer than a minute at 1 ms"
        } else if let Some(row) = rest {
            rows += record.count;
            fit.push(record.simulated_from(row));
            continue;
        } else {
            "the trace has no rest of 0.2 s to start a simulation from, or has gaps behind it"
        };
        reasons.push((record, reason));
    }
    (fit, reasons)
}

/// The row from which a simulation can begin: the first one where the trace begins at rest, else one in the first rest that is long enough for the
/// axis to have settled. `None` where there is none, or a gap behind it.
fn rest_row(record: &AxisRecord) -> Option<usize> {
    let setpoint = record.setpoint_lu.as_deref()?;
    let rows = |seconds: f64| ((seconds / record.period_s) as usize).max(2);
    let still = |from: usize, rows: usize| {
        setpoint.get(from..from + rows).is_some_and(|rest| rest.iter().all(|value| (value - rest[0]).abs() < 1e-9))
    };
    let from = if still(0, rows(REST_S)) {
        0
    } else {
        let (settled, mut since) = (rows(SETTLED_S), 0);
        let end = (1..setpoint.len()).find(|k| {
            if (setpoint[*k] - setpoint[*k - 1]).abs() >= 1e-9 || !setpoint[*k].is_finite() {
                since = *k;
            }
            *k - since >= settled
        })?;
        end - rows(REST_S)
    };
    setpoint[from..].iter().all(|value| value.is_finite()).then_some(from)
}

fn free_parameters(result: &AxisResult, start: &Mechanics) -> Vec<Parameter> {
    let mut free = vec![Parameter::Inertia, Parameter::Coulomb];
    for parameter in [Parameter::Viscous, Parameter::Gravity] {
        if start.value(parameter).is_some() {
            free.push(parameter);
        }
    }
    // No trace as fast as the speed loop: the motion may tell its gains.
    if result.refusal(Parameter::SpeedGain).is_some() {
        free.extend([Parameter::SpeedGain, Parameter::SpeedResetTime]);
    }
    free
}

fn get(data: &DriveData, parameter: Parameter) -> f64 {
    match parameter {
        Parameter::Inertia => data.mechanics.inertia_kg_m2,
        Parameter::Viscous => data.mechanics.viscous_friction_n_m_s_per_rad,
        Parameter::Coulomb => data.mechanics.coulomb_friction_n_m,
        Parameter::Gravity => data.mechanics.gravity_n_m,
        Parameter::SpeedGain => data.speed_gain_n_m_s_per_rad,
        _ => data.speed_reset_time_s,
    }
}

fn set(data: &mut DriveData, values: &[(Parameter, f64)]) {
    for (parameter, value) in values {
        match parameter {
            Parameter::Inertia => data.mechanics.inertia_kg_m2 = value.max(1e-9),
            Parameter::Viscous => data.mechanics.viscous_friction_n_m_s_per_rad = value.max(0.0),
            Parameter::Coulomb => {
                let above_n_m = data.mechanics.breakaway_friction_n_m - data.mechanics.coulomb_friction_n_m;
                data.mechanics.coulomb_friction_n_m = value.max(0.0);
                data.mechanics.breakaway_friction_n_m = value.max(0.0) + above_n_m.max(0.0);
            }
            Parameter::Gravity => data.mechanics.gravity_n_m = *value,
            Parameter::GravitySin => data.mechanics.gravity_sin_n_m = *value,
            Parameter::GravityCos => data.mechanics.gravity_cos_n_m = *value,
            Parameter::SpeedGain => data.speed_gain_n_m_s_per_rad = value.max(1e-9),
            Parameter::SpeedResetTime => data.speed_reset_time_s = value.max(1e-6),
            _ => {}
        }
    }
}

impl Problem<'_> {
    /// Simulates all records; `None` where the axis leaves all bounds.
    fn residuals(&self, data: &DriveData) -> Option<Vec<Residuals>> {
        let axis = Axis { drive: Some(data.clone()), ..self.axis.clone() };
        let kt = data.motor.torque_constant_n_m_per_a;
        let mut all = Vec::new();
        for record in self.records {
            let (setpoint, position, torque) =
                (record.setpoint_lu.as_ref()?, record.position_lu.as_ref()?, record.torque.as_ref()?);
            let mut drive = AxisDrive::new(&axis, self.time_base, Start::Held, *setpoint.first()?)?;
            let mut residuals = Residuals { torque: Vec::with_capacity(record.count), position: Vec::new() };
            for (k, value) in setpoint.iter().enumerate() {
                let input = DriveInput { position_setpoint_lu: *value, load_n_m: 0.0, feedforward_active: true };
                let signals = drive.step(input);
                let simulated = match torque.source {
                    TorqueSource::MeanCurrent | TorqueSource::FineCurrent => kt * signals.current_mean_a,
                    TorqueSource::Current => kt * signals.current_a,
                    TorqueSource::TorqueReference => signals.torque_reference_n_m,
                };
                residuals.torque.push(torque.values_n_m.get(k)? - simulated);
                residuals.position.push(position.get(k)? - signals.position_measured_lu);
            }
            if !drive.is_finite() {
                return None;
            }
            // The zero of an encoder means nothing.
            let finite: Vec<f64> = residuals.position.iter().copied().filter(|value| value.is_finite()).collect();
            let zero = finite.iter().sum::<f64>() / finite.len().max(1) as f64;
            residuals.position.iter_mut().for_each(|value| *value -= zero);
            // The quanta of trace and simulation are not hit at the same instants: what that does is faster than the window.
            let window = window(half_window_rows(record.period_s));
            residuals.torque = filtered(&residuals.torque, &window);
            residuals.position = filtered(&residuals.position, &window);
            all.push(residuals);
        }
        Some(all)
    }

    /// RMS of torque and position.
    fn sizes(&self, residuals: &[Residuals]) -> (f64, f64) {
        let rms = |of: fn(&Residuals) -> &Vec<f64>| {
            let values = || residuals.iter().flat_map(of).filter(|value| value.is_finite());
            (values().map(|value| value * value).sum::<f64>() / values().count().max(1) as f64).sqrt()
        };
        (rms(|r| &r.torque).max(1e-12), rms(|r| &r.position).max(1e-12))
    }

    fn torque_rms(&self) -> f64 {
        let torques =
            || self.records.iter().filter_map(|record| record.torque.as_ref()).flat_map(|torque| &torque.values_n_m);
        let finite = || torques().filter(|value| value.is_finite());
        (finite().map(|value| value * value).sum::<f64>() / finite().count().max(1) as f64).sqrt()
    }

    /// Normal equations at the present values.
    fn linearised(&self, base: &[Residuals], sizes: (f64, f64)) -> Option<Blocks> {
        let mut smooth = self.data.clone();
        smooth.encoder.position_resolution_lu = 0.0;
        let ideal = self.residuals(&smooth)?;
        let mut columns = Vec::new();
        for parameter in &self.free {
            let value = get(&self.data, *parameter);
            let floor = match parameter {
                Parameter::Gravity | Parameter::Viscous => STEP_SHARE * self.small(*parameter),
                _ => 0.0,
            };
            let step = (STEP_SHARE * value.abs()).max(floor);
            let mut moved = smooth.clone();
            set(&mut moved, &[(*parameter, value + step)]);
            columns.push((step, self.residuals(&moved)?));
        }
        let mut blocks = Blocks::new(self.free.len());
        for (place, record) in self.records.iter().enumerate() {
            let per_block = ((BLOCK_S / record.period_s).round() as usize).max(1);
            for k in 0..record.count {
                let mut push = |of: fn(&Residuals) -> &Vec<f64>, size: f64| {
                    let y = of(&base[place])[k] / size;
                    let slope = |(step, moved): &(f64, Vec<Residuals>)| {
                        (of(&ideal[place])[k] - of(&moved[place])[k]) / step / size
                    };
                    let row: Vec<f64> = columns.iter().map(slope).collect();
                    if y.is_finite() && row.iter().all(|value| value.is_finite()) {
                        blocks.push_in(k / per_block, &row, y);
                    }
                };
                push(|r| &r.torque, sizes.0);
                push(|r| &r.position, sizes.1);
            }
            blocks.close();
        }
        Some(blocks)
    }

    /// A size of a parameter that may be 0: what makes a torque like that of the dry friction.
    fn small(&self, parameter: Parameter) -> f64 {
        let coulomb = self.data.mechanics.coulomb_friction_n_m.max(1e-6);
        if parameter == Parameter::Gravity { coulomb } else { coulomb / 100.0 }
    }

    /// Passes until nothing changes; the last linearisation and the torque left over.
    fn solve(&mut self) -> Option<(Solution, f64)> {
        let mut base = self.residuals(&self.data)?;
        let cost = |residuals: &[Residuals], sizes: (f64, f64)| -> f64 {
            let square = |values: &[f64], size: f64| {
                values.iter().filter(|v| v.is_finite()).map(|v| (v / size).powi(2)).sum::<f64>()
            };
            residuals.iter().map(|r| square(&r.torque, sizes.0) + square(&r.position, sizes.1)).sum()
        };
        let columns: Vec<usize> = (0..self.free.len()).collect();
        let mut last = self.linearised(&base, self.sizes(&base))?.solve(&columns)?;
        for _ in 0..PASSES {
            // Weights are those of the present residuals: at the start a wrong gain is most of them.
            let sizes = self.sizes(&base);
            let before = cost(&base, sizes);
            let mut share = 1.0;
            let mut moved = None;
            // Half the step until it helps.
            while moved.is_none() && share > 0.05 {
                let mut data = self.data.clone();
                let values: Vec<(Parameter, f64)> = self
                    .free
                    .iter()
                    .enumerate()
                    .map(|(j, p)| (*p, get(&self.data, *p) + share * last.theta[j]))
                    .collect();
                let possible = values
                    .iter()
                    .all(|(p, value)| matches!(p, Parameter::Gravity | Parameter::Viscous) || *value > 0.0);
                set(&mut data, &values);
                moved = possible
                    .then(|| self.residuals(&data))
                    .flatten()
                    .filter(|r| cost(r, sizes) < before)
                    .map(|r| (data, r));
                share /= 2.0;
            }
            let Some((data, residuals)) = moved else { break };
            (self.data, base) = (data, residuals);
            last = self.linearised(&base, self.sizes(&base))?.solve(&columns)?;
            // What is left to go is little beside what is not known.
            if columns.iter().all(|j| last.theta[*j].abs() < ARRIVED_SHARE * last.value(*j).1) {
                break;
            }
        }
        // Weights are those of the final residuals: the interval belongs to them.
        let sizes = self.sizes(&base);
        let solution = self.linearised(&base, sizes)?.solve(&columns)?;
        Some((solution, sizes.0))
    }

    fn estimates(&self, solution: &Solution, start: &Mechanics, result: &mut AxisResult) -> Vec<Estimate> {
        let mut found = Vec::new();
        for (j, parameter) in self.free.iter().enumerate() {
            let (_, noise) = solution.value(j);
            let value = get(&self.data, *parameter);
            let first = start.estimates.iter().find(|estimate| estimate.parameter == *parameter);
            // What the last pass would still change, and the grain of the differences, belong to the interval.
            // Gravity may be 0: dry friction is the size of it.
            let size = if *parameter == Parameter::Gravity { self.data.mechanics.coulomb_friction_n_m } else { value };
            let half = noise.hypot(GRAIN_SHARE * size) + solution.theta[j].abs();
            // The simulated axis has the same law, and lacks the same terms.
            let room = start.room.iter().find(|(known, _)| known == parameter).map_or([0.0; 2], |(_, room)| *room);
            let estimate = Estimate::around(*parameter, value, half, Means::OutputError).reaching(room);
            match (parameter, first) {
                (_, Some(first)) if half > first.half() => found.push(*first),
                (Parameter::SpeedGain | Parameter::SpeedResetTime, _) => {
                    if half <= GAIN_SHARE * value {
                        found.push(estimate);
                    } else {
                        let percent = percent_from_ratio(half / value);
                        let remedy =
                            "record speed set-point, speed and torque set-point of the drive at its speed cycle";
                        result.refusals.retain(|refusal| refusal.parameter != *parameter);
                        result.refuse(*parameter, format!("the motion tells it to ±{percent:.0} % only"), remedy);
                    }
                }
                _ => found.push(estimate),
            }
        }
        for first in &start.estimates {
            if found.iter().all(|estimate| estimate.parameter != first.parameter) {
                found.push(*first);
            }
        }
        found
    }
}
