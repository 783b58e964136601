//! Which NC line is executed when, and how long each line takes in two traces.
//!
//! In: `path.line` and `path.program` of a trace, or its block starts; matched samples of a path. Out: [`Lines`], [`LineTimes`]. A line
//! that is executed several times counts once, with the sum. Does not read programs.

use super::geometry::Track;
use super::offset::Alignment;
use super::path::Match;
use crate::trace::Trace;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Place in a program.
pub type ProgramLine = (Arc<str>, u32);

/// Lines over time; empty where a trace does not tell.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    /// Beginning of each stretch and its line, in order of time.
    starts: Vec<(f64, ProgramLine)>,
}

impl Lines {
    /// Of a trace.
    pub fn of(trace: &Trace) -> Self {
        let from_path = Self::of_path(trace);
        if from_path.starts.is_empty() { Self::of_events(trace) } else { from_path }
    }

    fn of_path(trace: &Trace) -> Self {
        let mut starts: Vec<(f64, ProgramLine)> = Vec::new();
        let Some(line) = trace.signal("path.line") else { return Self::default() };
        let program = trace.signal("path.program").filter(|program| program.len() == line.len());
        let mut names: BTreeMap<&str, Arc<str>> = BTreeMap::new();
        let mut last = (f64::NAN, "");
        for i in 0..line.len() {
            let value = line.values[i];
            let name = program.and_then(|program| program.label(i)).unwrap_or("");
            if value.is_finite() && (value, name) != last {
                last = (value, name);
                let name = names.entry(name).or_insert_with(|| Arc::from(name)).clone();
                starts.push((line.times.time_s(i) - line.meaning.delay_s, (name, value as u32)));
            }
        }
        Self { starts }
    }

    fn of_events(trace: &Trace) -> Self {
        let starts = trace.events.iter().filter(|e| e.event.kind.as_deref() == Some("block_start"));
        let place = |e: &crate::trace::TraceEvent| {
            let name = Arc::from(e.event.program.as_deref().unwrap_or(""));
            Some((e.time_s, (name, e.event.line?)))
        };
        Self { starts: starts.filter_map(place).collect() }
    }

    /// These, or those of the reference brought to the time of the trace where there are none.
    pub fn or(self, reference: Self, at: Alignment) -> Self {
        if !self.starts.is_empty() {
            return self;
        }
        let mut starts = reference.starts;
        starts.iter_mut().for_each(|(time_s, _)| *time_s = at.trace_s(*time_s));
        Self { starts }
    }

    /// The line at a time.
    pub fn at(&self, time_s: f64) -> Option<&ProgramLine> {
        let i = self.starts.partition_point(|(start_s, _)| *start_s <= time_s).checked_sub(1)?;
        self.starts.get(i).map(|(_, line)| line)
    }

    /// Beginning of each stretch and its line, in order of time.
    pub fn starts(&self) -> &[(f64, ProgramLine)] {
        &self.starts
    }

    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.starts.is_empty()
    }
}

/// What an NC line takes in both, and how far the paths are apart on it.
#[derive(Clone, Debug, PartialEq)]
pub struct LineTimes {
    /// Program, as the trace names it.
    pub program: Arc<str>,
    /// Line.
    pub line: u32,
    /// Time in the trace.
    pub trace_s: f64,
    /// Time that the reference takes for the same stretch of path.
    pub reference_s: f64,
    /// Largest distance of the two paths.
    pub contour_error_max_mm: f64,
}

/// Times per line from a track and where its samples belong; the largest differences of time first.
pub fn line_times(lines: &Lines, track: &Track, matches: &[Option<Match>]) -> Vec<LineTimes> {
    let mut sums: BTreeMap<ProgramLine, LineTimes> = BTreeMap::new();
    for k in 0..matches.len().saturating_sub(1) {
        let (Some(here), Some(next)) = (&matches[k], &matches[k + 1]) else { continue };
        let time_s = track.time_s(k);
        let Some(line) = lines.at(time_s) else { continue };
        let entry = sums.entry(line.clone()).or_insert_with(|| LineTimes {
            program: line.0.clone(),
            line: line.1,
            trace_s: 0.0,
            reference_s: 0.0,
            contour_error_max_mm: 0.0,
        });
        entry.trace_s += track.time_s(k + 1) - time_s;
        entry.reference_s += next.time_s - here.time_s;
        entry.contour_error_max_mm = entry.contour_error_max_mm.max(here.distance_mm);
    }
    let mut times: Vec<LineTimes> = sums.into_values().collect();
    let difference_s = |t: &LineTimes| (t.trace_s - t.reference_s).abs();
    times.sort_by(|a, b| difference_s(b).total_cmp(&difference_s(a)).then(a.line.cmp(&b.line)));
    times
}
