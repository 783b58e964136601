//! Between importers and what becomes of a trace: heads of signals first, then rows in order of time.
//!
//! In: what an importer reads. Out: [`Sink`] calls, so that a file of any length can be turned into another without being held; and
//! [`Memory`], the sink that makes signals of the rows. Does not read or write files.

use super::wire::{Clock, Meaning, Signal, TimeGrid, TraceEvent};
use crate::base::Diagnostic;
use std::sync::Arc;

/// What is known of a signal before its first value.
#[derive(Clone, Debug, Default)]
pub(super) struct Head {
    pub(super) name: Option<String>,
    pub(super) original: String,
    pub(super) unit: String,
    pub(super) clock: Clock,
    pub(super) discrete: bool,
    /// The values are places of words that [`Sink::word`] tells.
    pub(super) words: bool,
    pub(super) meaning: Meaning,
    pub(super) layout: Layout,
    /// Distance of its samples, if the file says so.
    pub(super) period_s: Option<f64>,
}

/// What it means that a row has no value of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(super) enum Layout {
    /// There is none at this instant: a gap.
    #[default]
    Dense,
    /// It has not changed.
    Held,
    /// Its own instants are others.
    Own,
}

/// Takes a trace row by row.
pub(super) trait Sink {
    /// All signals, once, before the first row.
    fn begin(&mut self, heads: &[Head]) -> Result<(), Diagnostic>;
    /// The next word of a signal with words: numbers follow the order of the calls.
    fn word(&mut self, signal: usize, word: &str);
    /// Values at one instant: places of signals, each at most once. Times increase strictly. NaN begins a gap.
    fn row(&mut self, time_s: f64, cells: &[(usize, f64)]) -> Result<(), Diagnostic>;
    /// Something that happened; in order of time among the events.
    fn event(&mut self, event: TraceEvent) -> Result<(), Diagnostic>;
}

/// Values that a trace in memory may have: 8 bytes each, and as much again while they come in.
const VALUES_MAX: usize = 300_000_000;
/// Values that may be added where a file leaves out what has not changed: beyond, only the changes are kept.
const FILLED_MAX: usize = 64_000_000;
/// Times of a file may miss its grid by this share of a period: they are printed with few digits.
const OFF_GRID_SHARE: f64 = 0.01;
/// A period must be so much larger than the last bit of the times.
const RESOLUTION: f64 = 64.0 * f64::EPSILON;
/// Tolerance of times that make a grid where no period is known: the last digit of most files is a microsecond or less.
const TIME_TOLERANCE_S: f64 = 0.6e-6;

/// Collects a trace in memory.
#[derive(Default)]
pub(super) struct Memory {
    columns: Vec<Column>,
    instants: Vec<f64>,
    values: usize,
    filled: usize,
    /// Names to keep; empty: all.
    only: Vec<String>,
    pub(super) events: Vec<TraceEvent>,
}

struct Column {
    head: Head,
    wanted: bool,
    labels: Vec<String>,
    /// Rows of the values; unused for [`Layout::Dense`], which has one value a row.
    rows: Vec<u32>,
    values: Vec<f64>,
}

impl Memory {
    /// Keeps only signals with one of these names, or with one of these fields.
    pub(super) fn new(only: &[String]) -> Self {
        Self { only: only.to_vec(), ..Self::default() }
    }

    /// The signals, each on its own grid.
    pub(super) fn finish(mut self) -> (Vec<Signal>, Vec<TraceEvent>) {
        let columns = std::mem::take(&mut self.columns);
        let dense = TimeGrid::from_times(self.instants.clone(), TIME_TOLERANCE_S);
        let signals = columns.into_iter().filter(|column| column.wanted).map(|column| {
            let Column { head, labels, rows, mut values, .. } = column;
            let (times, values) = match head.layout {
                Layout::Dense => {
                    values.resize(self.instants.len(), f64::NAN);
                    (dense.clone(), values)
                }
                Layout::Held | Layout::Own => {
                    let times: Vec<f64> = rows.iter().map(|row| self.instants[*row as usize]).collect();
                    self.own_grid(&head, times, values)
                }
            };
            Signal {
                name: head.name,
                original: head.original,
                unit: head.unit,
                clock: head.clock,
                times,
                values,
                labels,
                discrete: head.discrete,
                meaning: head.meaning,
            }
        });
        let signals: Vec<Signal> = signals.collect();
        (signals, self.events)
    }

    /// Puts samples with holes on their uniform grid: what is left out is held, or missing.
    fn own_grid(&mut self, head: &Head, times: Vec<f64>, values: Vec<f64>) -> (TimeGrid, Vec<f64>) {
        let (Some(period_s), Some(&first), Some(&last)) = (head.period_s, times.first(), times.last()) else {
            return (TimeGrid::from_times(times, TIME_TOLERANCE_S), values);
        };
        if period_s <= first.abs().max(last.abs()) * RESOLUTION {
            return (TimeGrid::from_times(times, TIME_TOLERANCE_S), values);
        }
        let slot = |time_s: f64| (time_s - first) / period_s;
        let off_grid = |time_s: &f64| (slot(*time_s) - slot(*time_s).round()).abs() > OFF_GRID_SHARE;
        let count = slot(last).round() + 1.0;
        let room = (FILLED_MAX.saturating_sub(self.filled) + values.len()) as f64;
        let joined = |pair: &[f64]| slot(pair[1]).round() <= slot(pair[0]).round();
        if count > room || times.iter().any(off_grid) || times.windows(2).any(joined) {
            return irregular(head, period_s, &times, &values);
        }
        let count = count as usize;
        self.filled += count - values.len().min(count);
        let mut full = Vec::with_capacity(count);
        for (time_s, value) in times.iter().zip(&values) {
            let place = slot(*time_s).round() as usize;
            let held = if head.layout == Layout::Held { full.last().copied() } else { None };
            full.resize(place.max(full.len()), held.unwrap_or(f64::NAN));
            full.push(*value);
        }
        let whole = |time_ns: f64| if (time_ns - time_ns.round()).abs() < 1e-3 { time_ns.round() } else { time_ns };
        let start_ns = whole(first * crate::base::units::NS_PER_S);
        let step_ns = whole(period_s * crate::base::units::NS_PER_S);
        (TimeGrid::Uniform { start_ns, step_ns, count: full.len() }, full)
    }
}

/// Samples at their own times. A held value gets a second sample just before the next change, so that a straight line between two
/// samples is right; where a sample of another layout is missing, NaN says so.
fn irregular(head: &Head, period_s: f64, times: &[f64], values: &[f64]) -> (TimeGrid, Vec<f64>) {
    let (mut all_times, mut all_values) = (Vec::with_capacity(times.len()), Vec::with_capacity(values.len()));
    for (place, (time_s, value)) in times.iter().zip(values).enumerate() {
        if let Some(before) = place.checked_sub(1)
            && time_s - times[before] > 1.5 * period_s
        {
            let held = head.layout == Layout::Held;
            all_times.push(if held { time_s - period_s } else { times[before] + period_s });
            all_values.push(if held { values[before] } else { f64::NAN });
        }
        all_times.push(*time_s);
        all_values.push(*value);
    }
    (TimeGrid::Explicit(Arc::from(all_times)), all_values)
}

impl Sink for Memory {
    fn begin(&mut self, heads: &[Head]) -> Result<(), Diagnostic> {
        let wants = |head: &Head| {
            let probe = Signal {
                name: head.name.clone(),
                original: head.original.clone(),
                unit: String::new(),
                clock: Clock::Other,
                times: TimeGrid::Explicit(Arc::from([])),
                values: Vec::new(),
                labels: Vec::new(),
                discrete: false,
                meaning: Meaning::default(),
            };
            let stem = probe.axis_signal().map(|signal| signal.stem());
            self.only.is_empty() || self.only.iter().any(|only| probe.is_named(only) || stem == Some(only.as_str()))
        };
        let column = |head: &Head| Column {
            wanted: wants(head),
            head: head.clone(),
            labels: Vec::new(),
            rows: Vec::new(),
            values: Vec::new(),
        };
        self.columns = heads.iter().map(column).collect();
        Ok(())
    }

    fn word(&mut self, signal: usize, word: &str) {
        if let Some(column) = self.columns.get_mut(signal) {
            column.labels.push(word.to_owned());
        }
    }

    fn row(&mut self, time_s: f64, cells: &[(usize, f64)]) -> Result<(), Diagnostic> {
        let row = self.instants.len();
        if self.values > VALUES_MAX || row >= u32::MAX as usize {
            let message = format!("the trace has more than {VALUES_MAX} values: it does not fit into memory");
            return Err(Diagnostic::error("T0017", message)
                .help("choose signals, or turn the file into a shorter one with `sollwert export` first"));
        }
        self.instants.push(time_s);
        for (place, value) in cells {
            let Some(column) = self.columns.get_mut(*place).filter(|column| column.wanted) else { continue };
            if column.head.layout == Layout::Dense {
                self.values += row - column.values.len().min(row);
                column.values.resize(row, f64::NAN);
            } else {
                column.rows.push(row as u32);
            }
            column.values.push(*value);
            self.values += 1;
        }
        Ok(())
    }

    fn event(&mut self, event: TraceEvent) -> Result<(), Diagnostic> {
        self.events.push(event);
        Ok(())
    }
}
