//! The control as a whole: corner smoothing and time law, from the set-points of a program on a trace.
//!
//! In: a trace and its program, the machine; pairs not used for the fit. Out: [`ControlResult`]: keys of the machine file with 95 % intervals, choices,
//! and how well cycle time, feed and path agree before and after, on the program and on the others. The program is planned here again and again:
//! first the shape of the corners (alpha, tolerance ratios) is fitted to the path alone, then what is left open about time (radial shares,
//! transition jerk, jerk, corner rule) to the feed along it, for every time law and blend law. Does not touch velocities and accelerations of the
//! axes: those are machine data.

use super::normal::{Blocks, Solution};
use super::profile::{CELLS, PathProfile, shared_axes};
use crate::base::units::{MM_PER_M, RAD_PER_REV, deg_from_rad, percent_from_ratio};
use crate::base::{AxisId, AxisKind, Diagnostic};
use crate::interpreter::Setup;
use crate::machine::{Axis, AxisLimits, BlendLaw, Choice, DynamicsMode, Machine, TimeLawKind};
use crate::trace::Trace;
use std::sync::Arc;

/// A program with its trace.
pub struct TracedProgram<'a> {
    /// The trace.
    pub trace: &'a Trace,
    /// The program, and what lies around it.
    pub setup: Setup,
}

/// A number of the machine file.
#[derive(Clone, Debug, PartialEq)]
pub struct ControlEstimate {
    /// Key; a factor on a key of every axis stands with `*`.
    pub key: &'static str,
    /// For people.
    pub title: &'static str,
    /// Best value.
    pub value: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Agreement of a planned motion with a traced one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// On the trace, from the first to the last motion.
    pub traced_s: f64,
    /// Planned.
    pub planned_s: f64,
    /// RMS of the differences of feed over the path, as a share of the mean programmed feed.
    pub feed_rms_share: f64,
    /// RMS of the distance of the paths.
    pub path_rms_mm: f64,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct ControlResult {
    /// Values with intervals.
    pub estimates: Vec<ControlEstimate>,
    /// Keys that this program cannot tell, and why.
    pub refusals: Vec<(&'static str, String)>,
    /// Words that fit best.
    pub choices: Vec<(&'static str, String)>,
    /// With the machine file as it was, and as fitted: the program itself first, then those not used.
    pub agreements: Vec<(Agreement, Agreement)>,
    /// `--set` arguments that make the fitted machine of the old one.
    pub sets: Vec<String>,
    /// Programs planned.
    pub plans: usize,
}

/// What is fitted, and how it gets into a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Knob {
    Alpha,
    Ratio,
    RatioReversal,
    RadialAcceleration,
    RadialJerk,
    TransitionJerk,
    Jerk,
    FollowUp,
}

/// Knobs of the path, and of the time.
const SHAPE: [Knob; 3] = [Knob::Alpha, Knob::Ratio, Knob::RatioReversal];
const TIME: [Knob; 5] = [Knob::RadialAcceleration, Knob::RadialJerk, Knob::TransitionJerk, Knob::Jerk, Knob::FollowUp];
/// Relative step of the differences.
const STEP_SHARE: f64 = 0.03;
/// Passes of a fit while choices are compared, and in the end.
const PASSES: (usize, usize) = (4, 10);
/// Stretches of a block.
const BLOCK: usize = 60;
/// Weight of the cycle time against one stretch of the path.
const TIME_WEIGHT: f64 = 30.0;
/// Paths that differ by more than this share of their length are not of one program.
const LENGTH_SHARE: f64 = 0.03;
/// And so are paths that lie apart by more than this share of it.
const APART_SHARE: f64 = 0.01;
/// Condition from which two settings count as one.
const ALIKE: f64 = 40.0;
/// An interval as a share of its value beyond which a value is refused.
const WIDE_SHARE: f64 = 0.5;

impl Knob {
    fn key(self) -> &'static str {
        match self {
            Self::Alpha => "smoothing.alpha",
            Self::Ratio => "smoothing.tolerance_ratio",
            Self::RatioReversal => "smoothing.tolerance_ratio_reversal",
            Self::RadialAcceleration => "smoothing.radial_acceleration_share",
            Self::RadialJerk => "smoothing.radial_jerk_share",
            Self::TransitionJerk => "axes.*.transition_jerk_max factor",
            Self::Jerk => "axes.*.jerk_max factor",
            Self::FollowUp => "axes.*.follow_up_tolerance factor",
        }
    }

    fn title(self) -> &'static str {
        match self {
            Self::Alpha => "end tangents of a corner",
            Self::Ratio => "executed over programmed tolerance",
            Self::RatioReversal => "the same where an axis reverses",
            Self::RadialAcceleration => "share of acceleration across the path",
            Self::RadialJerk => "share of jerk across the path",
            Self::TransitionJerk => "transition jerk, times that of the file",
            Self::Jerk => "jerk, times that of the file",
            Self::FollowUp => "step of speed at corners, times that of the file",
        }
    }

    fn range(self) -> (f64, f64) {
        match self {
            Self::Alpha => (0.5, 3.9),
            Self::Ratio | Self::RatioReversal => (0.05, 1.0),
            Self::RadialAcceleration | Self::RadialJerk => (0.02, 0.95),
            Self::TransitionJerk | Self::Jerk => (0.1, 10.0),
            Self::FollowUp => (0.05, 20.0),
        }
    }

    fn get(self, machine: &Machine) -> f64 {
        match self {
            Self::Alpha => machine.smoothing.alpha_ratio,
            Self::Ratio => machine.smoothing.tolerance_ratio,
            Self::RatioReversal => machine.smoothing.tolerance_reversal_ratio,
            Self::RadialAcceleration => machine.smoothing.radial_acceleration_share,
            Self::RadialJerk => machine.smoothing.radial_jerk_share,
            Self::TransitionJerk | Self::Jerk | Self::FollowUp => 1.0,
        }
    }

    fn set(self, machine: &mut Machine, value: f64) {
        match self {
            Self::Alpha => machine.smoothing.alpha_ratio = value,
            Self::Ratio => machine.smoothing.tolerance_ratio = value,
            Self::RatioReversal => machine.smoothing.tolerance_reversal_ratio = value,
            Self::RadialAcceleration => machine.smoothing.radial_acceleration_share = value,
            Self::RadialJerk => machine.smoothing.radial_jerk_share = value,
            Self::FollowUp => machine.axes.iter_mut().for_each(|axis| axis.follow_up_tolerance_lu *= value),
            Self::TransitionJerk | Self::Jerk => scale_jerk(machine, self == Self::Jerk, value),
        }
    }
}

/// Every jerk of one kind, of every axis and every kind of machining.
fn scale_jerk(machine: &mut Machine, plain: bool, factor: f64) {
    for axis in &mut machine.axes {
        let scaled = |limits: AxisLimits| {
            let mut limits = limits;
            if plain {
                limits.jerk_max_lu_s3 *= factor;
            } else {
                limits.transition_jerk_max_lu_s3 *= factor;
            }
            limits
        };
        axis.limits = scaled(axis.limits);
        for mode in DynamicsMode::ALL {
            // DYNPREC may be that of DYNFINISH: to give it limits of its own changes nothing.
            if let Some(limits) = axis.dynamics.get(mode).copied() {
                axis.dynamics.set(mode, scaled(limits));
            }
        }
    }
}

/// One fit in progress.
struct Fit<'a> {
    /// The machine as in the file, with the choices that are tried.
    machine: Machine,
    target: &'a PathProfile,
    setup: &'a Setup,
    axes: &'a [AxisId],
    /// Values of all knobs that have been moved.
    values: Vec<(Knob, f64)>,
    plans: usize,
}

impl Fit<'_> {
    fn machine_with(&self, values: &[(Knob, f64)]) -> Machine {
        let mut machine = self.machine.clone();
        for (knob, value) in values {
            knob.set(&mut machine, *value);
        }
        machine
    }

    fn profile(&mut self, values: &[(Knob, f64)]) -> Option<PathProfile> {
        self.plans += 1;
        PathProfile::planned(&Arc::new(self.machine_with(values)), self.setup, self.axes)
    }

    fn residuals(&mut self, values: &[(Knob, f64)], shape: bool) -> Option<Vec<f64>> {
        let profile = self.profile(values)?;
        if shape {
            return Some(profile.sideways_mm(self.target));
        }
        let size = self.target.feeds_mm_s.iter().sum::<f64>() / CELLS as f64;
        let differences = profile.feeds_mm_s.iter().zip(&self.target.feeds_mm_s).map(|(a, b)| (b - a) / size);
        let mut residuals: Vec<f64> = differences.collect();
        residuals.push(-TIME_WEIGHT * (self.target.time_s - profile.time_s) / self.target.time_s);
        Some(residuals)
    }

    fn value(&self, knob: Knob) -> f64 {
        self.values
            .iter()
            .find(|(known, _)| *known == knob)
            .map_or_else(|| knob.get(&self.machine), |(_, value)| *value)
    }

    fn with(&self, moved: &[(Knob, f64)]) -> Vec<(Knob, f64)> {
        let kept = self.values.iter().filter(|(knob, _)| moved.iter().all(|(other, _)| other != knob));
        kept.copied().chain(moved.iter().copied()).collect()
    }

    /// Moves `knobs` until the residuals are least. Returns their sum of squares, the last solution, and the knobs in it.
    fn run(&mut self, knobs: &[Knob], shape: bool, passes: usize) -> Option<(f64, Option<Solution>, Vec<Knob>)> {
        // The sign of shape residuals is planned minus traced; of the others traced minus planned.
        let sign = if shape { -1.0 } else { 1.0 };
        let mut base = self.residuals(&self.values.clone(), shape)?;
        let cost = |residuals: &[f64]| residuals.iter().map(|r| r * r).sum::<f64>();
        let (mut last, mut moved) = (None, Vec::new());
        for pass in 0..passes {
            let (blocks, active) = self.linearised(&base, knobs, shape, sign)?;
            let columns = told_apart(&blocks, active.len());
            moved = columns.iter().map(|column| active[*column]).collect();
            last = blocks.solve(&columns);
            let Some(solution) = &last else { break };
            if pass + 1 == passes {
                break;
            }
            let before = cost(&base);
            let mut share = 1.0;
            let mut better = None;
            while better.is_none() && share > 0.1 {
                let step = |(j, knob): (usize, &Knob)| {
                    let (low, high) = knob.range();
                    let now = self.value(*knob);
                    // No pass more than halves or doubles a value: the law is bent.
                    let wanted = now + share * solution.theta[j];
                    (*knob, wanted.clamp(0.5 * now, 2.0 * now).clamp(low, high))
                };
                let values = self.with(&moved.iter().enumerate().map(step).collect::<Vec<_>>());
                better = self.residuals(&values, shape).filter(|r| cost(r) < before).map(|r| (values, r));
                share /= 3.0;
            }
            let Some((values, residuals)) = better else { break };
            let gained = before - cost(&residuals);
            (self.values, base) = (values, residuals);
            if gained < 1e-3 * before {
                break;
            }
        }
        Some((cost(&base), last, moved))
    }

    /// Normal equations of the knobs that do anything.
    fn linearised(&mut self, base: &[f64], knobs: &[Knob], shape: bool, sign: f64) -> Option<(Blocks, Vec<Knob>)> {
        let (mut columns, mut active) = (Vec::new(), Vec::new());
        for knob in knobs {
            let now = self.value(*knob);
            let (low, high) = knob.range();
            let wanted = (now * (1.0 + STEP_SHARE)).min(high);
            let to = if wanted - now < 0.5 * STEP_SHARE * now { (now * (1.0 - STEP_SHARE)).max(low) } else { wanted };
            let values = self.with(&[(*knob, to)]);
            let Some(moved) = self.residuals(&values, shape) else { continue };
            let column: Vec<f64> = base.iter().zip(&moved).map(|(a, b)| sign * (a - b) / (to - now)).collect();
            let size = column.iter().map(|c| c * c).sum::<f64>().sqrt() * now.abs();
            // What 100 % of change does to all of the path together.
            if size > if shape { 1e-3 } else { 0.05 } {
                columns.push(column);
                active.push(*knob);
            }
        }
        let mut blocks = Blocks::new(active.len());
        let per_cell = if shape { self.axes.len() } else { 1 };
        for (k, y) in base.iter().enumerate() {
            let row: Vec<f64> = columns.iter().map(|column| column[k]).collect();
            blocks.push_in(k / (BLOCK * per_cell), &row, sign * y);
        }
        Some((blocks, active))
    }
}

/// Columns that are told apart, the first ones first: shares and jerks may act as one product.
fn told_apart(blocks: &Blocks, width: usize) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    for column in 0..width {
        let trial: Vec<usize> = kept.iter().copied().chain([column]).collect();
        if blocks.solve(&trial).is_some_and(|solution| solution.condition < ALIKE) {
            kept = trial;
        }
    }
    kept
}

/// Calibrates the control on one traced program, and looks at others.
pub fn calibrate(
    fitted: &TracedProgram<'_>,
    unseen: &[TracedProgram<'_>],
    machine: &Machine,
    progress: &mut dyn FnMut(&str),
) -> Result<ControlResult, Diagnostic> {
    let axes = shared_axes(fitted.trace, machine);
    let target = target(fitted, machine, &axes)?;
    let mut result = ControlResult {
        estimates: Vec::new(),
        refusals: Vec::new(),
        choices: Vec::new(),
        agreements: Vec::new(),
        sets: Vec::new(),
        plans: 0,
    };
    let mut fit = Fit {
        machine: machine.clone(),
        target: &target,
        setup: &fitted.setup,
        axes: &axes,
        values: Vec::new(),
        plans: 0,
    };
    let before = fit.profile(&[]).ok_or_else(|| refused("the program ends in an alarm on this machine"))?;
    if (before.length_mm / target.length_mm - 1.0).abs() > LENGTH_SHARE {
        return Err(refused(&format!(
            "the path of the trace is {:.3} mm long, that of the program {:.3} mm",
            target.length_mm, before.length_mm
        )));
    }
    let apart_mm = before.sideways_rms_mm(&target);
    if apart_mm > APART_SHARE * target.length_mm {
        return Err(refused(&format!("the paths of trace and program are {apart_mm:.3} mm apart")));
    }
    progress("shape of the corners");
    let shape = fit.run(&SHAPE, true, PASSES.1);
    let best = best_choice(&mut fit, machine, progress)?;
    progress("time along the path");
    let time = fit.run(&TIME, false, PASSES.1);
    for (done, knobs, shape) in [(shape, &SHAPE[..], true), (time, &TIME[..], false)] {
        take(&mut result, &fit, done, knobs, shape);
    }
    for (key, word, was) in best {
        if word != was {
            result.sets.push(format!("{key}={word}"));
        }
        result.choices.push((key, word));
    }
    sets(&mut result, &fit);
    let after = Arc::new(fit.machine_with(&fit.values));
    result.plans = fit.plans;
    let old = Arc::new(machine.clone());
    for pair in std::iter::once(fitted).chain(unseen) {
        let axes = shared_axes(pair.trace, machine);
        let target = self::target(pair, machine, &axes)?;
        let one = |machine: &Arc<Machine>| {
            let planned = PathProfile::planned(machine, &pair.setup, &axes);
            planned
                .map(|planned| agreement(&planned, &target))
                .ok_or_else(|| refused("a program ends in an alarm on this machine"))
        };
        result.agreements.push((one(&old)?, one(&after)?));
    }
    Ok(result)
}

fn refused(reason: &str) -> Diagnostic {
    Diagnostic::error("T0208", format!("the control cannot be calibrated: {reason}"))
        .help("trace the set-points of the whole program, and give the same program with its zero offsets and tools")
}

fn target(pair: &TracedProgram<'_>, machine: &Machine, axes: &[AxisId]) -> Result<PathProfile, Diagnostic> {
    if axes.len() < 2 {
        return Err(refused(&format!(
            "`{}` has position set-points of {} linear axes of this machine",
            pair.trace.name,
            axes.len()
        )));
    }
    PathProfile::of_trace(pair.trace, machine, axes)
        .ok_or_else(|| refused(&format!("the set-points of `{}` do not move, or have gaps", pair.trace.name)))
}

fn agreement(planned: &PathProfile, target: &PathProfile) -> Agreement {
    let traced = target.feeds_mm_s.iter().copied().fold(0.0, f64::max);
    let feed = if planned.programmed_mm_s > 0.0 { planned.programmed_mm_s } else { traced };
    Agreement {
        traced_s: target.time_s,
        planned_s: planned.time_s,
        feed_rms_share: planned.feed_rms_mm_s(target) / feed,
        path_rms_mm: planned.sideways_rms_mm(target),
    }
}

/// A machine, and what was found for it.
type Tried = (Machine, Vec<(Knob, f64)>);

/// Tries every time law and blend law, and keeps the best in `fit`: key, word, and the word of the file.
fn best_choice(
    fit: &mut Fit<'_>,
    machine: &Machine,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<(&'static str, String, String)>, Diagnostic> {
    let mut best: Option<(f64, Tried)> = None;
    for time_law in [TimeLawKind::SevenPhase, TimeLawKind::Continuous] {
        for blend_law in [BlendLaw::Limits, BlendLaw::Entry] {
            progress(&format!("{}, blend law {}", time_law.word(), blend_law.word()));
            let mut tried = machine.clone();
            (tried.feed.time_law, tried.smoothing.blend_law) = (time_law, blend_law);
            let values = fit.values.clone();
            let mut one =
                Fit { machine: tried, values, target: fit.target, setup: fit.setup, axes: fit.axes, plans: fit.plans };
            let done = one.run(&TIME, false, PASSES.0);
            fit.plans = one.plans;
            if let Some((cost, ..)) = done
                && best.as_ref().is_none_or(|(least, _)| cost < *least)
            {
                best = Some((cost, (one.machine, one.values)));
            }
        }
    }
    let (_, (chosen, values)) = best.ok_or_else(|| refused("no time law drives this program without an alarm"))?;
    let words = vec![
        ("feed.time_law", chosen.feed.time_law.word().to_owned(), machine.feed.time_law.word().to_owned()),
        (
            "smoothing.blend_law",
            chosen.smoothing.blend_law.word().to_owned(),
            machine.smoothing.blend_law.word().to_owned(),
        ),
    ];
    (fit.machine, fit.values) = (chosen, values);
    Ok(words)
}

/// Estimates and refusals of one fit.
fn take(
    result: &mut ControlResult,
    fit: &Fit<'_>,
    done: Option<(f64, Option<Solution>, Vec<Knob>)>,
    knobs: &[Knob],
    shape: bool,
) {
    let (_, solution, active) = done.unwrap_or((0.0, None, Vec::new()));
    for knob in knobs {
        let place = active.iter().position(|known| known == knob);
        let what = if shape {
            "no corner of this program shows it"
        } else {
            "nothing in this program is held back by it, or it is not told apart from the values above"
        };
        let (Some(place), Some(solution)) = (place, &solution) else {
            result.refusals.push((knob.key(), what.to_owned()));
            continue;
        };
        let value = fit.value(*knob);
        // The step that is left, and the grain of the differences.
        let half = solution.value(place).1 + solution.theta[place].abs() + 2e-3 * value.abs();
        if half > WIDE_SHARE * value.abs() {
            let percent = percent_from_ratio(half / value.abs());
            result
                .refusals
                .push((knob.key(), format!("this program tells it to ±{percent:.0} % only; {value:.3} was used")));
        } else {
            let (low, high) = (value - half, value + half);
            result.estimates.push(ControlEstimate { key: knob.key(), title: knob.title(), value, low, high });
        }
    }
}

/// The changes as `--set` arguments.
fn sets(result: &mut ControlResult, fit: &Fit<'_>) {
    for (knob, value) in &fit.values {
        match knob {
            Knob::TransitionJerk | Knob::Jerk | Knob::FollowUp => {
                let after = fit.machine_with(&fit.values);
                result.sets.extend(after.axes.iter().flat_map(|axis| axis_sets(*knob, axis)));
            }
            _ => result.sets.push(format!("{}={value:.5}", knob.key())),
        }
    }
    result.sets.sort();
    result.sets.dedup();
}

/// The jerks of an axis, or its step of speed, as they are now.
fn axis_sets(knob: Knob, axis: &Axis) -> Vec<String> {
    let linear = axis.kind == AxisKind::Linear;
    let name = &axis.name;
    if knob == Knob::FollowUp {
        let value = axis.follow_up_tolerance_lu;
        let (key, value) = if linear { ("_mm", value) } else { ("_deg", deg_from_rad(value)) };
        return vec![format!("axes.{name}.follow_up_tolerance{key}={value:.6}")];
    }
    let both = |table: &str, limits: &AxisLimits| {
        let unit = if linear { "m_s3" } else { "rot_s3" };
        let border = |jerk: f64| if linear { jerk / MM_PER_M } else { jerk / RAD_PER_REV };
        let (jerk, transition) = (border(limits.jerk_max_lu_s3), border(limits.transition_jerk_max_lu_s3));
        // Both: a transition jerk that is not given follows the other.
        [
            format!("axes.{name}.{table}jerk_max_{unit}={jerk:.6}"),
            format!("axes.{name}.{table}transition_jerk_max_{unit}={transition:.6}"),
        ]
    };
    let mut sets = both("", &axis.limits).to_vec();
    for mode in DynamicsMode::ALL {
        let own = axis.dynamics.get(mode).filter(|limits| {
            mode != DynamicsMode::Precision || axis.dynamics.get(DynamicsMode::Finish) != Some(*limits)
        });
        sets.extend(own.iter().flat_map(|limits| both(&format!("dynamics.{}.", mode.word()), limits)));
    }
    sets
}
