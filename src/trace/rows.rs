//! A trace, or a recording, as rows for a sink.
//!
//! In: a [`Recording`], streamed; a [`Trace`] in memory. Out: heads and rows in order of time. Does not resample: a signal has a value
//! only in rows of its own instants, and is held between them where that is what it means.

use super::recording::{Labels, field_heads, path_value, retold_heads, sample_value};
use super::sink::{Head, Layout, Sink};
use super::wire::{Clock, Trace};
use crate::base::Diagnostic;
use crate::base::units::NS_PER_S;
use crate::recorder::{Content, Message, Recording, TopicKind, spindle_values};

/// Streams a recording: axes and path are held, one row an instant.
pub(super) fn stream_recording(recording: &Recording, sink: &mut dyn Sink) -> Result<(), Diagnostic> {
    let mut heads: Vec<Head> = Vec::new();
    let mut first = vec![None; recording.topics().len()];
    for (topic, entry) in recording.topics().iter().enumerate() {
        let fields = field_heads(&entry.kind, &entry.fields);
        if entry.messages > 0 && !fields.is_empty() {
            first[topic] = Some(heads.len());
            heads.extend(fields);
        }
    }
    retold_heads(recording, &mut heads);
    if heads.is_empty() {
        let message = format!("{} holds neither axes nor a path", recording.path().display());
        return Err(Diagnostic::error("R0018", message).help("only recordings of sollwert can be exported"));
    }
    let mut labels: Vec<Labels> = heads.iter().map(|_| Labels::default()).collect();
    sink.begin(&heads)?;
    let mut cells: Vec<(usize, f64)> = Vec::new();
    let mut now_ns = None;
    for message in recording.messages()? {
        let Message { topic, time_ns, content, .. } = message?;
        let Some(first) = first.get(topic).copied().flatten() else { continue };
        if now_ns != Some(time_ns) {
            flush(now_ns, &mut cells, sink)?;
            now_ns = Some(time_ns);
        }
        match (&content, &recording.topics()[topic].kind) {
            (Content::Axis(sample), TopicKind::Axis { .. }) => {
                let fields = recording.topics()[topic].fields.iter().enumerate();
                cells.extend(fields.map(|(k, field)| (first + k, sample.get(*field).unwrap_or(f64::NAN))));
            }
            (Content::Spindle(spindle), _) => {
                let (values, fields) = (spindle_values(spindle), recording.topics()[topic].fields.iter().enumerate());
                let value = |field: usize| values.get(field).copied().flatten().unwrap_or(f64::NAN);
                cells.extend(fields.map(|(k, field)| (first + k, value(*field))));
            }
            (Content::Sample(sample), _) => {
                let known = labels[first].len();
                let value = sample_value(sample, &mut labels[first]);
                if let Some(word) = labels[first].word(known) {
                    sink.word(first, word);
                }
                cells.push((first, value));
            }
            (Content::Path(path), _) => {
                let count = crate::recorder::PATH_FIELDS.len();
                for (k, column) in (first..first + count).enumerate() {
                    let known = labels[column].len();
                    let value = path_value(path, k, &mut labels[column]);
                    if let Some(word) = labels[column].word(known) {
                        sink.word(column, word);
                    }
                    cells.push((column, value));
                }
            }
            _ => {}
        }
    }
    flush(now_ns, &mut cells, sink)
}

fn flush(now_ns: Option<u64>, cells: &mut Vec<(usize, f64)>, sink: &mut dyn Sink) -> Result<(), Diagnostic> {
    if let (Some(time_ns), false) = (now_ns, cells.is_empty()) {
        sink.row(time_ns as f64 / NS_PER_S, cells)?;
    }
    cells.clear();
    Ok(())
}

/// Times that differ by less are one instant.
const SAME_INSTANT_S: f64 = 1e-9;

/// Hands a trace over row by row.
pub(super) fn stream_trace(trace: &Trace, sink: &mut dyn Sink) -> Result<(), Diagnostic> {
    let head = |signal: &super::wire::Signal| Head {
        name: signal.name.clone(),
        original: signal.original.clone(),
        unit: signal.unit.clone(),
        clock: signal.clock,
        discrete: signal.discrete,
        words: !signal.labels.is_empty(),
        meaning: signal.meaning.clone(),
        layout: if signal.clock == Clock::Interpolator { Layout::Own } else { Layout::Held },
        period_s: signal.times.period_s(),
    };
    let heads: Vec<Head> = trace.signals.iter().map(head).collect();
    sink.begin(&heads)?;
    for (place, signal) in trace.signals.iter().enumerate() {
        signal.labels.iter().for_each(|word| sink.word(place, word));
    }
    let mut next = vec![0_usize; trace.signals.len()];
    let mut cells = Vec::new();
    loop {
        let due = trace.signals.iter().zip(&next).map(|(signal, at)| signal.times.time_s(*at));
        // NaN, beyond the end, is never the least.
        let Some(now_s) = due.filter(|time| !time.is_nan()).min_by(f64::total_cmp) else { return Ok(()) };
        cells.clear();
        for (place, signal) in trace.signals.iter().enumerate() {
            if signal.times.time_s(next[place]) <= now_s + SAME_INSTANT_S {
                cells.push((place, signal.values.get(next[place]).copied().unwrap_or(f64::NAN)));
                next[place] += 1;
            }
        }
        sink.row(now_s, &cells)?;
    }
}
