//! The control as a whole: corner smoothing and time law, from the set-points of programs on traces.
//!
//! In: traces and their programs, the machine; pairs not used for the fit. Out: [`ControlResult`]: keys of the machine file, each with the range of what is as good, words,
//! and how well cycle time, feed and path agree before and after, on the programs of the fit and on the others. The programs are planned here
//! again and again: first the shape of the corners (alpha, tolerance ratios, curve) is fitted to the path alone, then with it what is left open about time
//! (radial shares, transition jerk and jerk of each axis, corner rule with its step, look-ahead window, time law) to the feed along it. Does not touch
//! velocities and accelerations of the axes: those are machine data.

use super::choose::{Search, Window};
use super::contradict::{contradiction, nothing_fits};
use super::knobs::{Knob, Switch};
use super::path::PathOfTrace;
use super::plausible::other_kind;
use super::profile::{PathProfile, linear_axes, shared_axes};
use super::search::{Aim, Fit, Target, Told};
use super::shape::{quick, shape};
use crate::base::units::{MM_PER_INCH, MM_PER_M, percent_from_ratio};
use crate::base::{AxisId, Diagnostic};
use crate::interpreter::Setup;
use crate::machine::Machine;
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
    /// Key; a factor on a key of an axis says so.
    pub key: String,
    /// For people.
    pub title: &'static str,
    /// Best value.
    pub value: f64,
    /// Lower end of what makes the same motion; the end of the range where raising or lowering it further changes nothing.
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
    /// RMS of the distance of the paths; NaN where the trace has the feed alone.
    pub path_rms_mm: f64,
}

/// Feed over a path, at equal shares of it.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedOverPath {
    /// Length of the path.
    pub length_mm: f64,
    /// On the trace.
    pub traced_mm_s: Vec<f64>,
    /// Planned with the machine file as it was.
    pub before_mm_s: Vec<f64>,
    /// Planned as fitted.
    pub after_mm_s: Vec<f64>,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct ControlResult {
    /// Values with intervals.
    pub estimates: Vec<ControlEstimate>,
    /// Keys that this program cannot tell, and why.
    pub refusals: Vec<(String, String)>,
    /// Words that fit best.
    pub choices: Vec<(&'static str, String)>,
    /// Programs that were fitted: the first ones of `agreements`.
    pub fitted: usize,
    /// With the machine file as it was, and as fitted: the programs of the fit first, then those not used.
    pub agreements: Vec<(Agreement, Agreement)>,
    /// Feeds of the same programs, for a picture.
    pub feeds: Vec<FeedOverPath>,
    /// `--set` arguments that make the fitted machine of the old one.
    pub sets: Vec<String>,
    /// Programs planned.
    pub plans: usize,
}

/// Paths that differ by more than this share of their length are not of one program.
const LENGTH_SHARE: f64 = 0.03;
/// And so are paths that lie apart by more than this share of it.
const APART_SHARE: f64 = 0.01;
/// An interval in free numbers (about a share of the value) beyond which a value is refused.
const WIDE: f64 = 0.5;

/// Calibrates the control on traced programs, and looks at others.
pub fn calibrate(
    fitted: &[TracedProgram<'_>],
    unseen: &[TracedProgram<'_>],
    machine: &Machine,
    progress: &mut dyn FnMut(&str),
) -> Result<ControlResult, Diagnostic> {
    let (targets, moved) = targets(fitted, machine)?;
    let mut result = ControlResult {
        estimates: Vec::new(),
        refusals: Vec::new(),
        choices: Vec::new(),
        fitted: fitted.len(),
        agreements: Vec::new(),
        feeds: Vec::new(),
        sets: Vec::new(),
        plans: 0,
    };
    let mut fit = Fit::new(quick(machine), &targets);
    progress("shape of the corners");
    let told_shape = shape(&mut fit, progress);
    fit.machine.feed.time_law = machine.feed.time_law;
    if let Some(finding) = another_path(&fit) {
        return Err(finding);
    }
    let mut search = Search::new(fit, moved, progress).ok_or_else(|| refused(ALARM))?;
    search.run();
    words(&mut result, &mut search, told_shape);
    let knobs = search.knobs();
    let mut fit = search.best.fit;
    take(&mut result, &mut fit, &knobs);
    let after = fit.machine_with(&fit.values);
    sets(&mut result, machine, &after);
    result.plans = fit.plans();
    let (old, new) = (Arc::new(machine.clone()), Arc::new(after));
    for pair in fitted.iter().chain(unseen) {
        let (target, axes, _) = target(pair, machine)?;
        let one = |machine: &Arc<Machine>| {
            PathProfile::planned(machine, &pair.setup, &axes, target.time_s).ok_or_else(|| refused(ALARM))
        };
        let (before, after) = (one(&old)?, one(&new)?);
        result.agreements.push((agreement(&before, &target), agreement(&after, &target)));
        result.feeds.push(FeedOverPath {
            length_mm: target.length_mm,
            traced_mm_s: target.coarse_feeds_mm_s(),
            before_mm_s: before.coarse_feeds_mm_s(),
            after_mm_s: after.coarse_feeds_mm_s(),
        });
    }
    match nothing_fits(&result.agreements[..fitted.len()]) {
        Some(finding) => Err(finding),
        None => Ok(result),
    }
}

const ALARM: &str = "a program ends in an alarm on this machine, or does not end";

/// The programs of the fit, each along the path of its trace, and the axes that they move.
fn targets(fitted: &[TracedProgram<'_>], machine: &Machine) -> Result<(Vec<Target>, Vec<AxisId>), Diagnostic> {
    let mut targets = Vec::new();
    let mut moved: Vec<AxisId> = Vec::new();
    for pair in fitted {
        let (profile, axes, rows) = target(pair, machine)?;
        let before = PathProfile::planned(&Arc::new(machine.clone()), &pair.setup, &axes, profile.time_s)
            .ok_or_else(|| refused(ALARM))?;
        if (before.length_mm / profile.length_mm - 1.0).abs() > LENGTH_SHARE {
            let inches = (before.length_mm / profile.length_mm / MM_PER_INCH - 1.0).abs() < LENGTH_SHARE;
            let hint =
                if inches { ": the positions of the trace are in inches, say so in its row of units" } else { "" };
            return Err(refused(&format!(
                "the path of the trace is {:.3} mm long, that of the program {:.3} mm{hint}",
                profile.length_mm, before.length_mm
            )));
        }
        if let Some(finding) = contradiction(&profile, &before, &axes, machine) {
            return Err(finding);
        }
        let apart_mm = before.sideways_rms_mm(&profile);
        if apart_mm > APART_SHARE * profile.length_mm {
            return Err(refused(&format!("the paths of trace and program are {apart_mm:.3} mm apart")));
        }
        for (column, id) in axes.iter().enumerate() {
            let places = || before.places_mm.iter().map(|place| place[column]);
            let span_mm = places().fold(f64::NEG_INFINITY, f64::max) - places().fold(f64::INFINITY, f64::min);
            if span_mm > MOVED_MM && !moved.contains(id) {
                moved.push(*id);
            }
        }
        let path = rows.and_then(|rows| PathOfTrace::new(&rows, &pair.setup, machine, &axes));
        targets.push(Target { profile, path, setup: pair.setup.clone(), axes });
    }
    if targets.is_empty() { Err(refused("no program is given")) } else { Ok((targets, moved)) }
}

/// A path that lies further off than half of all rounding of corners moves it: another program.
fn another_path(fit: &Fit<'_>) -> Option<Diagnostic> {
    let (left_um, rounding_um) = fit.path_left_um()?;
    (left_um > ALIKE_UM && left_um > rounding_um).then(|| {
        refused(&format!(
            "with the best rounding of corners the paths of trace and program are {left_um:.0} um apart (RMS), half of the rounding moves them by {rounding_um:.0} um: \
             it is the trace of another program, or of other offsets, tools or units"
        ))
    })
}

/// RMS below which paths are alike whatever rounding explains: five steps of a scale of 1 um.
const ALIKE_UM: f64 = 5.0;

/// An axis that moves less tells nothing.
const MOVED_MM: f64 = 0.1;

/// Words and window: what is told, and what is not.
fn words(result: &mut ControlResult, search: &mut Search<'_, '_>, told_shape: bool) {
    let told = [(Switch::Shape, told_shape)].into_iter().chain(search.told());
    for (switch, told) in told {
        let word = switch.word(&search.best.fit.machine);
        if told {
            result.choices.push((switch.key(), word.to_owned()));
        } else {
            let reason = format!("every word for it makes the same motion of this program; {word} was used");
            result.refusals.push((switch.key().to_owned(), reason));
        }
    }
    let blocks = search.best.fit.machine.look_ahead_blocks;
    let key = "look_ahead.blocks".to_owned();
    match search.told_window() {
        Window::Between(low, high) => result.estimates.push(ControlEstimate {
            key,
            title: "blocks that the look-ahead sees",
            value: blocks as f64,
            low: low as f64,
            high: high as f64,
        }),
        Window::AtLeast(low) => {
            result.refusals.push((key, format!("{low} blocks and more move this program the same; {blocks} was used")));
        }
    }
}

/// Estimates and refusals of numbers.
fn take(result: &mut ControlResult, fit: &mut Fit<'_>, knobs: &[Knob]) {
    let told = fit.told(knobs, Aim::Both);
    let common = |knob: &Knob| match knob {
        // A factor on one axis comes on top of that on all of them.
        Knob::TransitionJerk(Some(_)) => fit.value(Knob::TransitionJerk(None)),
        Knob::Jerk(Some(_)) => fit.value(Knob::Jerk(None)),
        _ => 1.0,
    };
    for (place, knob) in knobs.iter().enumerate() {
        let value = fit.value(*knob);
        let used = common(knob) * value;
        let key = knob.key(&fit.machine);
        let halves = [0, 1].map(|side| told.as_ref().and_then(|told: &[Told; 2]| told[side].half(&[(place, 1.0)])));
        if halves == [None, None] {
            let nothing = "nothing in this program is held back by it";
            let reason = if knob.is_of_shape() { "no corner of this program shows it" } else { nothing };
            result.refusals.push((key, reason.to_owned()));
            continue;
        }
        if halves.iter().flatten().all(|half| *half > WIDE) {
            let twin =
                told.iter().flatten().find_map(|told| told.twin(place)).map(|twin| knobs[twin].key(&fit.machine));
            let percent = percent_from_ratio(halves.iter().flatten().copied().fold(f64::INFINITY, f64::min));
            let reason = match twin {
                Some(twin) => {
                    format!("it acts here as `{twin}` does, and cannot be separated from it; {used:.3} was used")
                }
                None => format!("this program tells it to ±{percent:.0} % only; {used:.3} was used"),
            };
            result.refusals.push((key, reason));
            continue;
        }
        // Open where it is told from the other side only.
        let free = knob.free(value);
        let end = |half: Option<f64>, side: f64| {
            let half = half.filter(|half| *half <= WIDE).unwrap_or(f64::INFINITY);
            common(knob) * knob.value(free + side * half)
        };
        let (low, high) = (end(halves[0], -1.0), end(halves[1], 1.0));
        result.estimates.push(ControlEstimate { key, title: knob.title(), value: used, low, high });
    }
    if let Some(told) = &told {
        products(result, fit, knobs, told);
    }
}

/// Share of the jerk across the path times transition jerk, where that is told better than the two of them: the blend law of published controls knows
/// only the product.
fn products(result: &mut ControlResult, fit: &Fit<'_>, knobs: &[Knob], told: &[Told; 2]) {
    let Some(share_place) = knobs.iter().position(|knob| *knob == Knob::RadialJerk) else { return };
    let share = fit.value(Knob::RadialJerk);
    let machine = fit.machine_with(&fit.values);
    for (place, knob) in knobs.iter().enumerate() {
        let Knob::TransitionJerk(Some(id)) = knob else { continue };
        // The share moves as its logit.
        let halves = [&[(share_place, 1.0 - share), (place, 1.0)][..], &[(share_place, 1.0 - share)], &[(place, 1.0)]];
        let half = |sum: &[(usize, f64)]| told.iter().filter_map(|side| side.half(sum)).fold(0.0, f64::max);
        let [product, of_share, of_jerk] = halves.map(half);
        if product <= 0.0 || product > WIDE || product > 0.5 * of_share.max(of_jerk) {
            continue;
        }
        let axis = machine.axis(*id);
        let value = share * axis.limits.transition_jerk_max_lu_s3 / MM_PER_M;
        result.estimates.push(ControlEstimate {
            key: format!("smoothing.radial_jerk_share * axes.{}.transition_jerk_max_m_s3", axis.name),
            title: "jerk across the path, m/s³: the product is told better than its factors",
            value,
            low: value * (-product).exp(),
            high: value * product.exp(),
        });
    }
}

/// The changes as `--set` arguments.
fn sets(result: &mut ControlResult, before: &Machine, after: &Machine) {
    for switch in [Switch::Shape].into_iter().chain(Switch::TIME) {
        if switch.word(after) != switch.word(before) {
            result.sets.push(format!("{}={}", switch.key(), switch.word(after)));
        }
    }
    if after.look_ahead_blocks != before.look_ahead_blocks {
        result.sets.push(format!("look_ahead.blocks={}", after.look_ahead_blocks));
    }
    let numbers =
        [Knob::Alpha, Knob::Ratio, Knob::RatioReversal, Knob::RadialAcceleration, Knob::RadialJerk, Knob::Overload];
    let moved = numbers.into_iter().filter(|knob| knob.get(after) != knob.get(before));
    let of_axes = [Knob::TransitionJerk(None), Knob::Jerk(None), Knob::FollowUp];
    result.sets.extend(moved.chain(of_axes).flat_map(|knob| knob.sets(before, after)));
    result.sets.sort();
    result.sets.dedup();
}

fn refused(reason: &str) -> Diagnostic {
    Diagnostic::error("T0208", format!("the control cannot be calibrated: {reason}"))
        .help("trace the set-points of the whole program, and give the same program with its zero offsets and tools")
}

/// What a trace says of its program, the axes whose path is held against it, and their set-points.
type Traced = (PathProfile, Vec<AxisId>, Option<Vec<Vec<f64>>>);

fn target(pair: &TracedProgram<'_>, machine: &Machine) -> Result<Traced, Diagnostic> {
    let axes = shared_axes(pair.trace, machine);
    let name = &pair.trace.name;
    for axis in axes.iter().map(|id| machine.axis(*id)) {
        let signal = pair.trace.axis_signal(&axis.name, "position_setpoint");
        if let Some(refused) = signal.and_then(|signal| other_kind(pair.trace, signal, axis)) {
            return Err(refused);
        }
    }
    if axes.len() >= 2 {
        let rows = PathProfile::rows(pair.trace, machine, &axes);
        return rows
            .and_then(|rows| PathProfile::of_rows(&rows).map(|profile| (profile, axes, Some(rows.0))))
            .ok_or_else(|| refused(&format!("the set-points of `{name}` do not move, or have gaps")));
    }
    let count = axes.len();
    PathProfile::of_feed(pair.trace).map(|profile| (profile, linear_axes(machine), None)).ok_or_else(|| {
        refused(&format!(
            "`{name}` has position set-points of {count} linear axes of this machine, and no feed along the path"
        ))
    })
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
