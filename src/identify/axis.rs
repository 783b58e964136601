//! One axis, from its traces to its result: the order of the work.
//!
//! In: traces, the machine, names of axes. Out: one [`AxisResult`] an axis, in the order of the machine. Values leave here in the units of their
//! keys. Does not read files.

use super::aliasing::folding;
use super::choice::{Chosen, chosen};
use super::feedforward::{controllers, left_out};
use super::friction::{Mechanics, one_shot};
use super::plausible::{self, UNITS};
use super::record::{AxisRecord, read};
use super::refine::refine;
use super::speed_loop::speed_loop;
use super::staged::staged;
use super::wire::{AxisResult, Estimate, Figure, Means, Parameter, TorqueSource};
use crate::base::units::{MS_PER_S, percent_from_ratio};
use crate::base::{AxisId, Diagnostic};
use crate::machine::{Axis, DriveData, Machine};
use crate::trace::Trace;

/// What to identify, and how.
#[derive(Clone, Debug, Default)]
pub struct IdentifyOptions {
    /// Axes; empty: every axis that the traces have and the machine knows.
    pub axes: Vec<AxisId>,
    /// Leave the output-error refinement out.
    pub linear_only: bool,
}

/// Identifies the axes. Errors: a trace that cannot be used, no axis in common.
pub fn identify(
    traces: &[Trace],
    machine: &Machine,
    options: &IdentifyOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<AxisResult>, Diagnostic> {
    let asked: Vec<AxisId> = if options.axes.is_empty() { machine.axis_ids().collect() } else { options.axes.clone() };
    let mut results = Vec::new();
    for id in asked {
        let axis = machine.axis(id);
        let known = traces.iter().any(|trace| trace.axes().contains(&axis.name.as_str()));
        if known || !options.axes.is_empty() {
            progress(&axis.name);
            results.push(one_axis(traces, machine, axis, options)?);
        }
    }
    if results.is_empty() {
        let known: Vec<String> = traces.iter().flat_map(Trace::axes).map(str::to_owned).collect();
        let message = match known.as_slice() {
            [] => "the traces have no signal of an axis".to_owned(),
            _ => format!("the traces have the axes {}, the machine has none of them", known.join(", ")),
        };
        return Err(Diagnostic::error("T0201", message)
            .help("name the axes of the trace with --axis-name 7=X, or give the machine that they belong to with -m"));
    }
    Ok(results)
}

fn one_axis(
    traces: &[Trace],
    machine: &Machine,
    axis: &Axis,
    options: &IdentifyOptions,
) -> Result<AxisResult, Diagnostic> {
    let mut result = AxisResult::new(&axis.name);
    let Some(data) = &axis.drive else {
        for parameter in Parameter::ALL {
            result.refuse(
                parameter,
                "the machine file has no drive for this axis: cycles, transmission and torque constant are not known",
                "give [axes.*.drive], motor and mechanics; values that are not known may be guesses",
            );
        }
        return Ok(result);
    };
    let cycle_s = machine.cycle.time_base.seconds(data.position_cycle_ticks);
    let (mut records, mut unreadable) = (Vec::new(), Vec::new());
    for trace in traces {
        match read(trace, axis, data, cycle_s) {
            Ok(record) => records.extend(record),
            Err(finding) => unreadable.push(finding),
        }
    }
    if records.is_empty()
        && let Some(finding) = unreadable.pop()
    {
        return Err(finding);
    }
    result.verdicts.extend(unreadable.into_iter().map(|finding| format!("{}: left out", finding.message)));
    let mut contradictions = Vec::new();
    records.retain(|record| {
        let reason = plausible::contradiction(record, axis, data);
        contradictions.extend(reason.iter().map(|reason| format!("`{}`: {reason}", record.trace)));
        reason.is_none()
    });
    if records.is_empty() {
        let (reason, remedy) = contradictions.pop().map_or_else(|| nothing_of(traces, axis), |reason| (reason, UNITS));
        return Ok(all_refused(result, &reason, remedy));
    }
    result.verdicts.extend(contradictions.into_iter().map(|reason| format!("{reason}: left out")));
    result.verdicts.extend(unknown_of(traces, axis));
    for record in &records {
        if let Some([from_s, length_s]) = record.gap_s {
            let name = &record.trace;
            result.verdicts.push(format!(
                "`{name}` has no samples for {length_s:.3} s from {from_s:.3} s on: what lies around is left out"
            ));
        }
    }
    let mut found = controllers(&records, axis, data, cycle_s, &mut result);
    plausible::controllers(&mut found, &mut result);
    let speed_cycle_s = machine.cycle.time_base.seconds(data.speed_cycle_ticks);
    found.extend(speed_loop(&records, data, speed_cycle_s, &mut result));
    // A simulation of the controllers has what the traces told of them.
    let told = with_estimates(data, &found);
    let told =
        DriveData { identified: data.identified || found.iter().any(|e| e.parameter == Parameter::SpeedGain), ..told };
    let (mechanics, records) = mechanics(&records, machine, axis, &told, &mut result);
    if let Some(reason) = plausible::too_heavy(mechanics.value(Parameter::Inertia), axis, data) {
        return Ok(all_refused(result, &reason, UNITS));
    }
    let refined = if options.linear_only {
        None
    } else {
        let known = with_estimates(data, &found);
        refine(&records, machine, axis, &known, &mechanics, &mut result)
    };
    match refined {
        Some(refined) => {
            result.others.extend(mechanics.estimates);
            found.extend(refined);
        }
        None => found.extend(mechanics.estimates),
    }
    finish(&mut result, found);
    Ok(result)
}

/// Nothing is told of an axis, and why.
fn all_refused(mut result: AxisResult, reason: &str, remedy: &str) -> AxisResult {
    result.refusals.clear();
    result.others.clear();
    result.figures.clear();
    for parameter in Parameter::ALL {
        result.refuse(parameter, reason, remedy);
    }
    result
}

/// Signals of an axis that are not known.
fn unknown_of(traces: &[Trace], axis: &Axis) -> Option<String> {
    let start = format!("{}.", axis.name);
    let unknown = |signal: &&crate::trace::Signal| signal.name.is_none() && signal.original.starts_with(&start);
    let signals = traces.iter().flat_map(|trace| &trace.signals).filter(unknown);
    let names: Vec<&str> = signals.map(|signal| signal.original.as_str()).take(NAMES_MAX).collect();
    (!names.is_empty()).then(|| format!("not known, and not used: {} (--map tells what they are)", names.join(", ")))
}

/// Names of signals that are told at most.
const NAMES_MAX: usize = 8;

/// Why no trace has anything of an axis.
fn nothing_of(traces: &[Trace], axis: &Axis) -> (String, &'static str) {
    let name = &axis.name;
    let of_axis = |trace: &Trace| trace.axes().contains(&name.as_str());
    if traces.iter().any(of_axis) {
        let reason = format!("{name} has less than two samples of a position, a current or a torque");
        return (reason, "record position and current over a motion (`sollwert identify --plan`)");
    }
    let others: Vec<&str> =
        traces.iter().flat_map(|trace| &trace.signals).map(|signal| signal.original.as_str()).collect();
    let reason = match others.len() {
        0 => "no trace has a signal of this axis, nor of any other".to_owned(),
        count => {
            let more = if count > NAMES_MAX { ", ..." } else { "" };
            format!("no trace has a signal of this axis: there are {}{more}", others[..count.min(NAMES_MAX)].join(", "))
        }
    };
    (
        reason,
        "record this axis, or name it with --axis-name 7=X and its signals with --map; lengths are in mm, or in what a row of units says",
    )
}

/// The drive with what was found about its controllers.
fn with_estimates(data: &DriveData, found: &[Estimate]) -> DriveData {
    let mut data = data.clone();
    for estimate in found {
        let value = estimate.value;
        match estimate.parameter {
            Parameter::PositionGain => data.position_gain_per_s = value,
            Parameter::VelocityFeedforward => data.velocity_feedforward_ratio = value,
            Parameter::TorqueFeedforward => data.torque_feedforward_ratio = value,
            Parameter::SetpointDelay => data.setpoint_delay_s = value,
            Parameter::FeedforwardDelay => data.feedforward_delay_s = value,
            Parameter::SpeedGain => data.speed_gain_n_m_s_per_rad = value,
            Parameter::SpeedResetTime => data.speed_reset_time_s = value,
            Parameter::Inertia => data.mechanics.inertia_kg_m2 = value,
            Parameter::Viscous => data.mechanics.viscous_friction_n_m_s_per_rad = value.max(0.0),
            Parameter::Coulomb => {
                let breakaway = data.mechanics.breakaway_friction_n_m / data.mechanics.coulomb_friction_n_m;
                data.mechanics.coulomb_friction_n_m = value.max(0.0);
                // As much above it as before; equal where there was none.
                let ratio = if breakaway.is_finite() { breakaway.max(1.0) } else { 1.0 };
                data.mechanics.breakaway_friction_n_m = value.max(0.0) * ratio;
            }
            Parameter::Gravity => data.mechanics.gravity_n_m = value,
            Parameter::GravitySin => data.mechanics.gravity_sin_n_m = value,
            Parameter::GravityCos => data.mechanics.gravity_cos_n_m = value,
        }
    }
    data
}

/// Inertia, friction, gravity, and the records that they rest on.
fn mechanics(
    records: &[AxisRecord],
    machine: &Machine,
    axis: &Axis,
    data: &DriveData,
    result: &mut AxisResult,
) -> (Mechanics, Vec<AxisRecord>) {
    let r = data.mechanics.transmission_lu_per_rad;
    let cycle_s = machine.cycle.time_base.seconds(data.position_cycle_ticks);
    let Chosen { records: of_best, motions, others, source: best } = chosen(records, r, axis.kind, cycle_s);
    for (record, why) in &others {
        left_out(std::slice::from_ref(record), why, "the mechanics", result);
    }
    result.torque_source = best;
    let (Some(source), false) = (best, motions.is_empty()) else {
        let (reason, remedy) = if best.is_none() {
            (
                "no trace has a current or a torque",
                "record the current (Operate: ActCurr; Edge: CURRENT), best as its mean over the position cycle",
            )
        } else {
            (
                "no trace has position and torque together",
                "record the position in the same trace (Operate: ActPos2ndEnc; Edge: ENC_POS)",
            )
        };
        for parameter in &Parameter::ALL[..6] {
            result.refuse(*parameter, reason, remedy);
        }
        return (Mechanics::default(), of_best);
    };
    result.verdicts.push(format!("torque from: {}; position from: {}", source.title(), of_best[0].position_from));
    let mut found = one_shot(&motions, axis, result);
    if source.is_folded() {
        unfold(&mut found, &of_best, machine, axis, data, source, result);
    }
    let turns = found.value(Parameter::GravitySin).is_some();
    // The correction for sampling is that of least squares: the staged inertia would stand beside it without.
    let comparable = |estimate: &Estimate| !(source.is_folded() && estimate.parameter == Parameter::Inertia);
    result.others.extend(staged(&motions, turns).into_iter().filter(comparable));
    let mut push = |key, title: &str, value, unit| {
        result.figures.push(Figure { key, title: title.to_owned(), value, unit });
    };
    push("moving_s", "time in motion that was used", found.moving_s, "s");
    push("condition_ratio", "condition of the least squares", found.condition, "");
    (found, of_best)
}

/// Inertia that may be wrong by sampling without being refused.
const FOLDING_SHARE: f64 = 0.4;
/// How well the correction is known, with controllers that were measured and with guessed ones.
const FOLDING_KNOWN_SHARE: (f64, f64) = (0.25, 1.0);

/// Mends an inertia from samples of the current, or refuses it.
fn unfold(
    found: &mut Mechanics,
    records: &[AxisRecord],
    machine: &Machine,
    axis: &Axis,
    data: &DriveData,
    source: TorqueSource,
    result: &mut AxisResult,
) {
    const REMEDY: &str = "record the mean of the current over the position cycle (our recordings: current_mean), or trace the drive at its current cycle";
    let Some(place) = found.estimates.iter().position(|estimate| estimate.parameter == Parameter::Inertia) else {
        return;
    };
    let by_set = records.iter().all(|record| record.setpoint_lu.is_some());
    let cycle_s = machine.cycle.time_base.seconds(data.position_cycle_ticks);
    let at_cycle = records.iter().all(|record| (record.period_s / cycle_s - 1.0).abs() < 1e-3);
    let known = with_estimates(data, &found.estimates);
    let torque_reference = source == TorqueSource::TorqueReference;
    let folding = (by_set && at_cycle)
        .then(|| folding(records, axis, &known, &machine.cycle.time_base, torque_reference))
        .flatten();
    let (Some(folding), sampled) = (folding, found.estimates[place]) else {
        found.estimates.remove(place);
        let reason = "the current is a sample on the sawtooth of the position cycle, and what that does to the inertia cannot be told \
                      without set-points at the position cycle";
        result.refuse(Parameter::Inertia, reason, REMEDY);
        return;
    };
    let off = folding.inertia_ratio - 1.0;
    let percent = percent_from_ratio(off);
    if off.abs() > FOLDING_SHARE {
        found.estimates.remove(place);
        result.refuse(
            Parameter::Inertia,
            format!("sampling the current once a cycle makes the inertia wrong by {percent:.0} %"),
            REMEDY,
        );
        return;
    }
    let share = if data.identified { FOLDING_KNOWN_SHARE.0 } else { FOLDING_KNOWN_SHARE.1 };
    let mended = sampled.scaled(1.0 / folding.inertia_ratio);
    found.estimates[place] = mended.widened(share * off.abs() * mended.value.abs());
    for estimate in &mut found.estimates {
        if let Some((_, shift)) = folding.shifts.iter().find(|(parameter, _)| *parameter == estimate.parameter) {
            *estimate = estimate.widened(*shift);
        }
    }
    result.verdicts.push(format!(
        "the current is one sample a position cycle, on its sawtooth: an axis with the controllers of the machine file reads {percent:+.1} % of \
         inertia from such samples, which is taken out, and the interval is wider for it"
    ));
}

/// Six decimals of a trace: of a gain, and of a delay.
const ROUNDING_SHARE: f64 = 1e-6;
const ROUNDING_MS: f64 = 1e-4;

/// Units of the keys, order of the tables, and a reason for everything that is not there.
fn finish(result: &mut AxisResult, found: Vec<Estimate>) {
    let bordered = |estimate: Estimate| match estimate.parameter {
        Parameter::SetpointDelay | Parameter::FeedforwardDelay | Parameter::SpeedResetTime => estimate.scaled(MS_PER_S),
        _ => estimate,
    };
    // A law that holds exactly in the trace is known to what the decimals of a trace are worth.
    let rounding = |estimate: Estimate| match estimate.parameter {
        _ if !matches!(estimate.means, Means::Lags | Means::ControlLaw) => estimate,
        Parameter::SetpointDelay | Parameter::FeedforwardDelay => estimate.widened(ROUNDING_MS),
        _ => estimate.widened(ROUNDING_SHARE * estimate.value.abs()),
    };
    let order = |parameter: Parameter| Parameter::ALL.iter().position(|known| *known == parameter);
    result.estimates = found.into_iter().map(bordered).map(rounding).collect();
    result.estimates.sort_by_key(|estimate| order(estimate.parameter));
    result.refusals.retain(|refusal| result.estimates.iter().all(|known| known.parameter != refusal.parameter));
    result.refusals.sort_by_key(|refusal| order(refusal.parameter));
}
