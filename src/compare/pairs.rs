//! Which signals belong together.
//!
//! In: two traces, pairs that the user gives. Out: [`Pair`]s, each with the reason, and signals that are formed first because one side has
//! only their parts. In this order: `--map A=B`; the same name of ours; the same original name. What is a word or a count (program, line,
//! limit) is no pair: its difference means nothing. Does not align.

use super::offset::{Alignment, Channel, align, residual_delay};
use super::series::{Series, noise_of};
use crate::base::Diagnostic;
use crate::base::diagnostics::nearest;
use crate::trace::{AxisSignal, Signal, Trace, Zero, axis_signal_name};

/// Two signals that are compared.
#[derive(Clone, Debug)]
pub struct Pair<'a> {
    /// Name in tables and JSON: that in the trace.
    pub name: String,
    /// In the trace.
    pub trace: &'a Signal,
    /// In the reference.
    pub reference: &'a Signal,
    /// Why they are a pair, for people.
    pub reason: String,
    /// A constant difference means nothing: the zeros differ.
    pub free_zero: bool,
}

/// Fields of `path.*` whose difference is a figure.
const PATH_SIGNALS: [&str; 5] =
    ["path.feed_mm_min", "path.acceleration_mm_s2", "path.jerk_mm_s3", "path.contour_error_mm", "path.s_mm"];

/// Forms the pairs. A name of `--map` that is not there is an error that says what there is.
pub fn pairs<'a>(
    trace: &'a Trace,
    reference: &'a Trace,
    map: &[(String, String)],
) -> Result<Vec<Pair<'a>>, Diagnostic> {
    let mut found: Vec<Pair<'a>> = Vec::new();
    for (a, b) in map {
        let one = trace.signal(a).ok_or_else(|| unknown(a, trace))?;
        let other = reference.signal(b).ok_or_else(|| unknown(b, reference))?;
        found.push(pair(a.clone(), one, other, format!("--map {a}={b}")));
    }
    for signal in trace.signals.iter().filter(|signal| compares(signal)) {
        let taken = |name: &str| found.iter().any(|pair| pair.name == name || std::ptr::eq(pair.trace, signal));
        let name = signal.shown_name();
        if taken(name) {
            continue;
        }
        if let Some(own) = &signal.name
            && let Some(other) = reference.signals.iter().find(|s| s.name.as_ref() == Some(own) && compares(s))
        {
            found.push(pair(own.clone(), signal, other, reason(signal, other)));
        } else if let Some(other) = reference.signals.iter().find(|s| s.original == signal.original && compares(s)) {
            found.push(pair(name.to_owned(), signal, other, "same name in both files".to_owned()));
        }
    }
    Ok(found)
}

fn pair<'a>(name: String, trace: &'a Signal, reference: &'a Signal, reason: String) -> Pair<'a> {
    let free_zero = [trace, reference].iter().any(|signal| signal.meaning.zero == Zero::Encoder);
    Pair { name, trace, reference, reason, free_zero }
}

fn reason(a: &Signal, b: &Signal) -> String {
    let from = |signal: &Signal| {
        let own = signal.name.as_deref() == Some(signal.original.as_str());
        (!own).then(|| format!("{} stands for it", signal.original))
    };
    let mut words = vec!["same signal".to_owned()];
    words.extend(from(a));
    words.extend(from(b).filter(|_| a.original != b.original));
    words.join("; ")
}

/// Whether a difference of this signal is a figure.
fn compares(signal: &Signal) -> bool {
    if signal.discrete || !signal.labels.is_empty() || signal.is_empty() {
        return false;
    }
    match &signal.name {
        Some(name) if name.starts_with("path.") => PATH_SIGNALS.contains(&name.as_str()),
        _ => signal.values.iter().any(|value| value.is_finite()),
    }
}

fn unknown(name: &str, trace: &Trace) -> Diagnostic {
    let names: Vec<&str> = trace.signals.iter().map(Signal::shown_name).collect();
    let help = match nearest(name, names.iter().copied()) {
        Some(near) => format!("`{near}` is there"),
        None => {
            let first: Vec<&str> = names.iter().copied().take(12).collect();
            format!(
                "there are {} signals: {}{}",
                names.len(),
                first.join(", "),
                if names.len() > 12 { ", ..." } else { "" }
            )
        }
    };
    Diagnostic::error("T0101", format!("{} has no signal `{name}`", trace.name)).help(help)
}

/// Signals of position that tell the time offset, with the field that they are of; the field with most moving axes, set-points first.
pub fn moving<'a>(trace: &'a Trace, reference: &'a Trace, pairs: &[Pair<'a>]) -> (Vec<Channel<'a>>, Vec<String>) {
    const STEMS: [&str; 4] = ["position_setpoint", "position_reference", "position_measured", "position_actual"];
    let mut best: (Vec<(&Signal, &Signal)>, Vec<String>) = (Vec::new(), Vec::new());
    for stem in STEMS {
        let both = trace.axes().into_iter().filter_map(|axis| {
            let found = (trace.axis_signal(axis, stem)?, reference.axis_signal(axis, stem)?);
            (moves(found.0) && moves(found.1)).then_some((found, format!("{axis}.{stem}")))
        });
        let (signals, names): (Vec<_>, Vec<_>) = both.unzip();
        if signals.len() > best.0.len() {
            best = (signals, names);
        }
    }
    if best.0.is_empty() {
        // No common position: whatever is a pair and moves.
        for pair in pairs.iter().filter(|pair| moves(pair.trace) && moves(pair.reference)) {
            best.0.push((pair.trace, pair.reference));
            best.1.push(pair.name.clone());
        }
    }
    let range = |signal: &Signal| {
        let finite = signal.values.iter().filter(|v| v.is_finite());
        let (low, high) = finite.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
        (high - low).max(f64::MIN_POSITIVE)
    };
    // The same scale for all signals of one unit: what moves little counts little.
    let scale = |unit: &str| {
        let same = best.0.iter().filter(|(a, _)| a.unit == unit).map(|(a, _)| range(a));
        same.fold(f64::MIN_POSITIVE, f64::max)
    };
    let channel = |(a, b): &(&'a Signal, &'a Signal)| Channel {
        trace: Series::of(a),
        reference: Series::of(b),
        scale: scale(&a.unit),
    };
    (best.0.iter().map(channel).collect(), best.1)
}

/// Whether a signal goes anywhere, beyond its noise.
fn moves(signal: &Signal) -> bool {
    let mut finite = signal.values.iter().copied().filter(|v| v.is_finite());
    let Some(first) = finite.next() else { return false };
    let floor = (20.0 * noise_of(&signal.values)).max(1e-9 * first.abs()).max(1e-12);
    finite.any(|value| (value - first).abs() > floor)
}

/// Deviations that a side does not have, although it has their parts: [following error, control deviation] of an axis. What is formed, and
/// from what, stands in its remark.
///
/// A control forms its deviation against the delayed set-point. Where the file has such a deviation, it is taken. Where it has a reference
/// (the delayed set-point), the deviation is reference - measured. Where it has neither, the delay is not known, and none is formed.
pub fn derived(trace: &Trace) -> Vec<Signal> {
    let mut made = Vec::new();
    for axis in trace.axes() {
        let get = |stem: &str| trace.axis_signal(axis, stem);
        let actual = get("position_actual").or_else(|| get("position_measured"));
        if get("following_error").is_none()
            && let (Some(setpoint), Some(actual)) = (get("position_setpoint"), actual)
        {
            made.extend(difference(axis, "following_error", setpoint, actual));
        }
        if get("control_deviation").is_none()
            && let (Some(reference), Some(measured)) = (get("position_reference"), get("position_measured").or(actual))
        {
            made.extend(difference(axis, "control_deviation", reference, measured));
        }
    }
    made
}

fn difference(axis: &str, stem: &str, from: &Signal, taken_off: &Signal) -> Option<Signal> {
    let kind = AxisSignal::parse(from.name.as_deref()?)?.kind;
    let name = axis_signal_name(axis, kind, stem)?;
    let mut cursor = Series::of(taken_off).cursor();
    let own = Series::of(from);
    let values = (0..own.len()).map(|i| from.values[i] - cursor.value(own.time_s(i))).collect();
    let mut meaning = from.meaning.clone();
    if [from, taken_off].iter().any(|signal| signal.meaning.zero == Zero::Encoder) {
        meaning.zero = Zero::Encoder;
    }
    meaning.remark = format!("formed here: {} - {}", from.shown_name(), taken_off.shown_name());
    Some(Signal {
        original: format!("{} - {}", from.original, taken_off.original),
        name: Some(name),
        unit: from.unit.clone(),
        clock: from.clock,
        times: from.times.clone(),
        values,
        labels: Vec::new(),
        discrete: false,
        meaning,
    })
}

/// The delay of the set-point against which a control forms its deviation: deviation(t) = set-point(t - delay) - measured(t). Found from the
/// three signals of one axis, with its standard error; `None` where one is missing or the axis does not move.
pub fn setpoint_delay_s(trace: &Trace, axis: &str) -> Option<(f64, f64)> {
    /// No control balances with more than this.
    const DELAY_MAX_S: f64 = 0.1;
    let setpoint = trace.axis_signal(axis, "position_setpoint").filter(|s| moves(s))?;
    let deviation = trace.axis_signal(axis, "control_deviation")?;
    let measured =
        trace.axis_signal(axis, "position_measured").or_else(|| trace.axis_signal(axis, "position_actual"))?;
    let mut cursor = Series::of(measured).cursor();
    let own = Series::of(deviation);
    let sum: Vec<f64> = (0..own.len()).map(|i| deviation.values[i] + cursor.value(own.time_s(i))).collect();
    let channel = Channel { trace: Series { values: &sum, ..own }, reference: Series::of(setpoint), scale: 1.0 };
    // The set-point is early: the sum at t is the set-point at t - delay.
    let coarse = align(&[channel], false).filter(|found| found.offset_s.abs() < DELAY_MAX_S);
    let start = coarse.unwrap_or_else(Alignment::none);
    let (more_s, error_s) = residual_delay(&channel, &start, DELAY_MAX_S)?;
    Some((-(start.offset_s + more_s), error_s))
}
