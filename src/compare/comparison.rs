//! A trace against a reference: the whole comparison.
//!
//! In: two traces ([`prepare`] forms the deviations that they have only the parts of), [`CompareOptions`]. Out: [`Comparison`]. Two views of
//! every pair of signals: in time (reference time = trace time + offset), and along the path (both at the same place, whatever the feed).
//! Differences are trace - reference at the samples of the trace; the reference is read between its samples by a cubic, states are held, gaps
//! stay gaps. Does not print and does not judge: [`check_limits`](super::check_limits) does.

use super::budget::{Budget, BudgetGround, budget};
use super::contour::{Contour, Features, PLANES, contour, features};
use super::geometry::{ACTUAL_STEMS, SETPOINT_STEMS, Track, machine_of, track};
use super::lines::{LineTimes, Lines, line_times};
use super::offset::{Alignment, Channel, align, residual_delay};
use super::pairs::{Pair, derived, moving, pairs, setpoint_delay_s};
use super::path::Match;
use super::series::{Series, noise_of};
use super::statistics::{Figures, Gathering};
use crate::base::Diagnostic;
use crate::base::units::percent_from_ratio;
use crate::trace::{Signal, Trace};

/// What the user asks for.
#[derive(Clone, Debug, Default)]
pub struct CompareOptions {
    /// `--map A=B`: A of the trace with B of the reference.
    pub map: Vec<(String, String)>,
    /// Fit a drift of the clocks too.
    pub drift: bool,
    /// Take this offset and look for none.
    pub offset_s: Option<f64>,
    /// Plane of the contour error in a plane; default XY.
    pub plane: Option<String>,
    /// Take the mean off every difference: the zeros are known to differ.
    pub without_bias: bool,
    /// Say where the errors come from, on both sides.
    pub budget: bool,
}

/// Everything that is said about two traces.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The trace and the reference.
    pub sides: [Side; 2],
    /// How their times belong together; `None`: nothing moves in both, times are taken as they are.
    pub alignment: Option<Alignment>,
    /// Signals by which they were aligned.
    pub aligned_by: Vec<String>,
    /// Pairs with their figures.
    pub pairs: Vec<PairFigures>,
    /// Trace against reference in space.
    pub contour: Option<PathComparison>,
    /// Time that each NC line takes in both, along the path; the largest differences first.
    pub lines: Vec<LineTimes>,
    /// What is doubtful or worth knowing.
    pub notes: Vec<Diagnostic>,
}

/// One of the two, by itself.
#[derive(Clone, Debug)]
pub struct Side {
    /// File.
    pub name: String,
    /// What it is.
    pub description: String,
    /// Duration; see `cycle_time_of`.
    pub cycle_time_s: Option<f64>,
    /// Where that comes from.
    pub cycle_time_basis: &'static str,
    /// Delay of the set-point against which the control forms its deviation, where the signals tell: axis, delay, standard error.
    pub setpoint_delays_s: Vec<(String, f64, f64)>,
    /// Its actual path against set-points.
    pub own: Option<OwnContour>,
    /// Where its error comes from, if it was asked for.
    pub budget: Option<Budget>,
}

/// The actual path of one side against the path of the set-points.
#[derive(Clone, Debug)]
pub struct OwnContour {
    /// What is held against what: `position_actual`, `position_setpoint`, and of which file the latter.
    pub against: String,
    /// Contour error.
    pub contour: Contour,
    /// Circles and corners.
    pub features: Features,
    /// The actual path, for plots.
    pub track: Track,
}

/// The path of the trace against that of the reference.
#[derive(Clone, Debug)]
pub struct PathComparison {
    /// What is held against what.
    pub against: String,
    /// True: tool tip in the part by the machine's kinematics.
    pub in_part: bool,
    /// Plane of the error in a plane.
    pub plane: &'static str,
    /// Contour error of the trace's actual path.
    pub contour: Contour,
    /// The path of the trace, for plots.
    pub track: Track,
}

/// Figures of one pair.
#[derive(Clone, Debug)]
pub struct PairFigures {
    /// Name in the trace (that of `--map`, ours, or the original).
    pub name: String,
    /// Name in the reference.
    pub reference_name: String,
    /// Unit of both.
    pub unit: String,
    /// Why they are a pair.
    pub reason: String,
    /// Differences at equal times; `None` where the two do not overlap.
    pub in_time: Option<Figures>,
    /// Differences at equal places, while the tool moves.
    pub along_path: Option<Figures>,
    /// What was taken off the differences because the zeros differ; 0 otherwise.
    pub zero: f64,
    /// Delay beyond the common offset (above 0: the reference is later), with its standard error.
    pub delay_s: Option<(f64, f64)>,
    /// Each side by itself: root mean square.
    pub side_rms: [f64; 2],
    /// Largest magnitude.
    pub side_max: [f64; 2],
}

/// Delays of single signals are looked for up to this.
const DELAY_REACH_S: f64 = 0.1;
/// A delay that is less sure than this is none.
const DELAY_ERROR_MAX_S: f64 = 1e-3;

/// Adds the deviations of which a trace has only the parts (following error, control deviation).
pub fn prepare(trace: &mut Trace) {
    let made = derived(trace);
    trace.signals.extend(made);
}

/// Compares. An unknown name in the options is an error; everything else that does not fit is a note.
pub fn compare(trace: &Trace, reference: &Trace, options: &CompareOptions) -> Result<Comparison, Diagnostic> {
    let plane = plane_of(options.plane.as_deref())?;
    let mut notes = Vec::new();
    let pairs = pairs(trace, reference, &options.map)?;
    if pairs.is_empty() {
        notes.push(no_pairs(trace, reference));
    }
    let (channels, aligned_by) = moving(trace, reference, &pairs);
    let alignment = alignment(&channels, options, &mut notes);
    let machine = machine_of(reference).or_else(|| machine_of(trace));
    let at = alignment.unwrap_or_else(Alignment::none);
    // The same tool on both sides: with its length only where both tell it.
    let tools = !trace.programmed.is_empty() && !reference.programmed.is_empty();
    let actual = [trace, reference].map(|side| track(side, machine.as_ref(), &ACTUAL_STEMS, tools));
    let setpoints = [trace, reference].map(|side| track(side, machine.as_ref(), &SETPOINT_STEMS, tools));
    let contour = path_comparison(&actual, &at, plane);
    let matches = contour.as_ref().map(|found| (&found.track, found.contour.matches.as_slice()));
    let figures = pairs.iter().map(|pair| pair_figures(pair, &at, matches, options.without_bias)).collect();
    let executed = [Lines::of(trace).or(Lines::of(reference), at), Lines::of(reference)];
    let lines =
        contour.as_ref().map_or_else(Vec::new, |found| line_times(&executed[0], &found.track, &found.contour.matches));
    if let Some(found) = &contour
        && found.contour.matched_share < 0.9
    {
        notes.push(apart(found.contour.matched_share));
    }
    let own = [own_contour(&actual[0], &setpoints, 0, &at, plane), own_contour(&actual[1], &setpoints, 1, &at, plane)];
    let bases = cycle_times(trace, reference);
    let [own_a, own_b] = own;
    let [a, b] = bases;
    let [lines_a, lines_b] = &executed;
    let budget_of = |side: &Trace, own: &Option<OwnContour>, lines: &Lines, other: &Trace| {
        options.budget.then(|| {
            let own_machine = machine_of(side);
            let machine = own_machine.as_ref().or(machine.as_ref());
            let other = Some(&other.programmed);
            budget(side, &BudgetGround { machine, own: own.as_ref(), lines: Some(lines), other })
        })
    };
    let budget_a = budget_of(trace, &own_a, lines_a, reference);
    let budget_b = budget_of(reference, &own_b, lines_b, trace);
    let sides = [side(trace, a, own_a, budget_a), side(reference, b, own_b, budget_b)];
    Ok(Comparison { sides, alignment, aligned_by, pairs: figures, contour, lines, notes })
}

fn plane_of(name: Option<&str>) -> Result<usize, Diagnostic> {
    let Some(name) = name else { return Ok(2) };
    let upper = name.to_ascii_uppercase();
    let sorted = |text: &str| {
        let mut letters: Vec<char> = text.chars().collect();
        letters.sort_unstable();
        letters
    };
    PLANES
        .iter()
        .position(|plane| sorted(plane) == sorted(&upper))
        .ok_or_else(|| Diagnostic::error("T0102", format!("`{name}` is no plane")).help("write XY, ZX or YZ"))
}

/// Less of the motion of both at the same time is said.
const PARTLY_BELOW_PERCENT: f64 = 60.0;

fn alignment(channels: &[Channel<'_>], options: &CompareOptions, notes: &mut Vec<Diagnostic>) -> Option<Alignment> {
    if let Some(offset_s) = options.offset_s {
        return Some(Alignment::given(offset_s));
    }
    let found = align(channels, options.drift);
    match &found {
        None => notes.push(
            Diagnostic::warning("T0103", "nothing moves in both traces: the times are taken as they are")
                .help("give --offset SECONDS, or --map two signals that move"),
        ),
        Some(at) if at.correlation_ratio < 0.8 => notes.push(
            Diagnostic::warning(
                "T0104",
                format!("the motions hardly agree (correlation {:.2}): the offset may be wrong", at.correlation_ratio),
            )
            .help("are these traces of the same program? Give --offset SECONDS if you know it"),
        ),
        Some(at) => notes.extend(partly(channels, at)),
    }
    found
}

/// Said where most of the motion of both has no counterpart: a simulation with other waiting times agrees in one of its moves only.
fn partly(channels: &[Channel<'_>], at: &Alignment) -> Option<Diagnostic> {
    let travel = |series: &Series<'_>, from_s: f64, to_s: f64| -> f64 {
        let inside = |i: &usize| (from_s..=to_s).contains(&series.time_s(*i));
        let steps = (1..series.len()).filter(inside).map(|i| (series.values[i] - series.values[i - 1]).abs());
        steps.filter(|step| step.is_finite()).sum()
    };
    let (mut shared, mut whole) = ([0.0; 2], [0.0; 2]);
    for channel in channels {
        let (Some(one), Some(other)) = (channel.trace.span_s(), channel.reference.span_s()) else { continue };
        let (from_s, to_s) = (one.0.max(at.trace_s(other.0)), one.1.min(at.trace_s(other.1)));
        shared[0] += travel(&channel.trace, from_s, to_s) / channel.scale;
        shared[1] += travel(&channel.reference, at.reference_s(from_s), at.reference_s(to_s)) / channel.scale;
        whole[0] += travel(&channel.trace, f64::MIN, f64::MAX) / channel.scale;
        whole[1] += travel(&channel.reference, f64::MIN, f64::MAX) / channel.scale;
    }
    let percent = [0, 1].map(|i| if whole[i] > 0.0 { percent_from_ratio(shared[i] / whole[i]) } else { 100.0 });
    let most = percent[0].max(percent[1]);
    (most < PARTLY_BELOW_PERCENT).then(|| {
        let message = format!(
            "the traces agree best where only {:.0} % of the motion of the trace and {:.0} % of that of the reference lie at the same time: figures in time are of that part",
            percent[0], percent[1]
        );
        let help = "other waiting times? The view along the path does not mind them; --offset SECONDS compares another part";
        Diagnostic::warning("T0104", message).help(help)
    })
}

fn no_pairs(trace: &Trace, reference: &Trace) -> Diagnostic {
    let some = |trace: &Trace| {
        let names: Vec<&str> = trace.signals.iter().take(8).map(|s| s.shown_name()).collect();
        names.join(", ")
    };
    Diagnostic::warning("T0105", format!("{} and {} have no signal in common", trace.name, reference.name))
        .help(format!("name pairs with --map A=B; A is one of {}; B one of {}", some(trace), some(reference)))
}

fn apart(matched_share: f64) -> Diagnostic {
    let percent = percent_from_ratio(1.0 - matched_share);
    Diagnostic::warning(
        "T0106",
        format!(
            "{percent:.0} % of the trace lies beyond the ends of the reference's path and does not count in the contour error"
        ),
    )
}

fn path_comparison(actual: &[Option<Track>; 2], at: &Alignment, plane: usize) -> Option<PathComparison> {
    let (one, other) = (actual[0].as_ref()?, actual[1].as_ref()?);
    let start_s = at.reference_s(one.time_s(0));
    let contour = contour(one, &other.line(None), &other.line(Some(plane)), start_s, plane)?;
    Some(PathComparison {
        against: format!("{} of the trace, {} of the reference", one.stem, other.stem),
        in_part: one.in_part && other.in_part,
        plane: PLANES[plane],
        contour,
        track: one.clone(),
    })
}

/// The actual path of side `which` against its own set-points, or those of the other side where it has none.
fn own_contour(
    actual: &Option<Track>,
    setpoints: &[Option<Track>; 2],
    which: usize,
    at: &Alignment,
    plane: usize,
) -> Option<OwnContour> {
    let actual = actual.as_ref().filter(|track| track.stem != "position_setpoint")?;
    let (commanded, own) = match (&setpoints[which], &setpoints[1 - which]) {
        (Some(own), _) => (own, true),
        (None, Some(other)) => (other, false),
        (None, None) => return None,
    };
    let first_s = actual.time_s(0);
    let start_s = match (own, which) {
        (true, _) => first_s,
        (false, 0) => at.reference_s(first_s),
        (false, _) => at.trace_s(first_s),
    };
    own_contour_of(actual, commanded, start_s, plane, if own { "" } else { " of the other file" })
}

/// An actual path against a commanded one.
pub(super) fn own_contour_of(
    actual: &Track,
    commanded: &Track,
    start_s: f64,
    plane: usize,
    whose: &str,
) -> Option<OwnContour> {
    let line = commanded.line(None);
    let contour = contour(actual, &line, &commanded.line(Some(plane)), start_s, plane)?;
    let features = features(&line, actual, &contour.matches);
    let against = format!("{} against {}{whose}", actual.stem, commanded.stem);
    Some(OwnContour { against, contour, features, track: actual.clone() })
}

/// A single trace by itself, as one side of a comparison: its duration, contour error, circles and corners. For reports.
pub fn examine(trace: &Trace, plane: Option<&str>) -> Result<Side, Diagnostic> {
    let plane = plane_of(plane)?;
    let machine = machine_of(trace);
    let actual = track(trace, machine.as_ref(), &ACTUAL_STEMS, true);
    let setpoints = track(trace, machine.as_ref(), &SETPOINT_STEMS, true);
    let own = match (&actual, &setpoints) {
        (Some(actual), Some(commanded)) if actual.stem != "position_setpoint" => {
            own_contour_of(actual, commanded, actual.time_s(0), plane, "")
        }
        _ => None,
    };
    let basis = match recorded_cycle_time_s(trace) {
        Some(time_s) => (Some(time_s), RECORDED),
        None => motion_of(trace, &MOTION_STEMS),
    };
    let ground = BudgetGround { machine: machine.as_ref(), own: own.as_ref(), ..BudgetGround::default() };
    let budget = budget(trace, &ground);
    Ok(side(trace, basis, own, Some(budget)))
}

fn side(
    trace: &Trace,
    (cycle_time_s, cycle_time_basis): (Option<f64>, &'static str),
    own: Option<OwnContour>,
    budget: Option<Budget>,
) -> Side {
    let delay =
        |axis: &str| setpoint_delay_s(trace, axis).map(|(delay_s, error_s)| (axis.to_owned(), delay_s, error_s));
    Side {
        name: trace.name.clone(),
        description: trace.origin.description.clone(),
        cycle_time_s,
        cycle_time_basis,
        setpoint_delays_s: trace.axes().into_iter().filter_map(delay).collect(),
        own,
        budget,
    }
}

const RECORDED: &str = "cycle time of the run";
const MOTION: &str = "first to last motion";
const LENGTH: &str = "length of the trace: no position moves";

/// Cycle times of both on the same basis: that of the runs where both recordings have it, otherwise the time from the first motion to the last.
fn cycle_times(trace: &Trace, reference: &Trace) -> [(Option<f64>, &'static str); 2] {
    match (recorded_cycle_time_s(trace), recorded_cycle_time_s(reference)) {
        (Some(a), Some(b)) => [(Some(a), RECORDED), (Some(b), RECORDED)],
        _ => {
            // The same field of both: an actual value comes to rest later than its set-point.
            let both = |stem: &&str| [trace, reference].iter().all(|side| motion_time_s(side, stem).is_some());
            let common: Vec<&str> = MOTION_STEMS.iter().copied().filter(both).collect();
            let stems = if common.is_empty() { MOTION_STEMS.as_slice() } else { &common[..1] };
            [motion_of(trace, stems), motion_of(reference, stems)]
        }
    }
}

/// Fields that say when an axis moves, the best first.
const MOTION_STEMS: [&str; 4] = ["position_setpoint", "position_actual", "position_measured", "position_reference"];

fn recorded_cycle_time_s(trace: &Trace) -> Option<f64> {
    trace.summary.as_ref()?.get("cycle_time_s")?.as_f64()
}

fn span_s(trace: &Trace) -> Option<f64> {
    trace.span_s().map(|(from, to)| to - from)
}

/// Time from the first to the last motion of any axis, by the first of the fields that moves; the length of a trace in which none does.
fn motion_of(trace: &Trace, stems: &[&str]) -> (Option<f64>, &'static str) {
    match stems.iter().find_map(|stem| motion_time_s(trace, stem)) {
        Some(time_s) => (Some(time_s), MOTION),
        None => (span_s(trace), LENGTH),
    }
}

fn motion_time_s(trace: &Trace, stem: &str) -> Option<f64> {
    let of_stem = |signal: &&Signal| signal.axis_signal().is_some_and(|own| own.stem() == stem);
    let spans = trace.signals.iter().filter(of_stem).filter_map(motion_span_s);
    let (from_s, to_s) = spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    Some(to_s - from_s)
}

/// When a position leaves its first value, and when it comes to its last.
fn motion_span_s(signal: &Signal) -> Option<(f64, f64)> {
    /// A tenth of a micrometre, or of a thousandth of a degree, is no motion.
    const STILL: f64 = 1e-4;
    let still = (10.0 * noise_of(&signal.values)).max(STILL);
    let finite = |value: &&f64| value.is_finite();
    let (first, last) = (*signal.values.iter().find(finite)?, *signal.values.iter().rfind(finite)?);
    let from = signal.values.iter().position(|value| (value - first).abs() > still)?.saturating_sub(1);
    let to = signal.values.iter().rposition(|value| (value - last).abs() > still)? + 1;
    let series = Series::of(signal);
    Some((series.time_s(from), series.time_s(to.min(signal.len() - 1))))
}

/// Figures of a pair in both views. `matches`: the path of the trace and where its samples belong on that of the reference.
fn pair_figures(
    pair: &Pair<'_>,
    at: &Alignment,
    matches: Option<(&Track, &[Option<Match>])>,
    without_bias: bool,
) -> PairFigures {
    let (a, b) = (Series::of(pair.trace), Series::of(pair.reference));
    let free_zero = pair.free_zero || without_bias;
    let gather = |zero: f64| {
        let mut gathering = Gathering::default();
        let mut cursor = b.cursor();
        for i in 0..a.len() {
            let time_s = a.time_s(i);
            gathering.push_pair(time_s, [a.values[i], cursor.value(at.reference_s(time_s))], zero);
        }
        gathering.finish()
    };
    let mut in_time = gather(0.0);
    let mut zero = 0.0;
    if free_zero && let Some(figures) = &in_time {
        zero = figures.bias;
        in_time = gather(zero);
    }
    let along_path = matches.and_then(|(track, matches)| along_path(&a, &b, track, matches, zero));
    let scale = 1.0;
    let channel = Channel { trace: a, reference: b, scale };
    let delay_s = residual_delay(&channel, at, DELAY_REACH_S).filter(|(_, error_s)| *error_s < DELAY_ERROR_MAX_S);
    PairFigures {
        name: pair.name.clone(),
        reference_name: pair.reference.shown_name().to_owned(),
        unit: pair.trace.unit.clone(),
        reason: pair.reason.clone(),
        in_time,
        along_path,
        zero,
        delay_s,
        side_rms: [a.values, b.values].map(|values| magnitude(values).0),
        side_max: [a.values, b.values].map(|values| magnitude(values).1),
    }
}

/// Differences where both are at the same place, at the samples of the track that make way.
fn along_path(a: &Series<'_>, b: &Series<'_>, track: &Track, matches: &[Option<Match>], zero: f64) -> Option<Figures> {
    let mut gathering = Gathering::default();
    let (mut of_a, mut of_b) = (a.cursor(), b.cursor());
    let still_mm = (6.0 * track.noise_mm).max(1e-6);
    let mut last_mm = f64::NEG_INFINITY;
    for (k, found) in matches.iter().enumerate() {
        let Some(found) = found else { continue };
        if (found.s_mm - last_mm).abs() < still_mm {
            continue;
        }
        last_mm = found.s_mm;
        let time_s = track.time_s(k);
        gathering.push_pair(time_s, [of_a.value(time_s), of_b.value(found.time_s)], zero);
    }
    gathering.finish()
}

/// Root mean square and largest magnitude of what is finite.
fn magnitude(values: &[f64]) -> (f64, f64) {
    let (mut squares, mut max, mut n): (f64, f64, f64) = (0.0, 0.0, 0.0);
    for value in values.iter().filter(|value| value.is_finite()) {
        squares += value * value;
        max = max.max(value.abs());
        n += 1.0;
    }
    (if n > 0.0 { (squares / n).sqrt() } else { f64::NAN }, max)
}
