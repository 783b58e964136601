//! What limits the feed over time, and which NC line is executed when: runs of equal state.
//!
//! In: `path.limit_axis`, `path.limit_kind`, lines of a trace. Out: JSON. Where there are more runs than the page has room for, each of
//! equal stretches of time gets the state that holds longest in it, and the page says so. Does not read programs.

use super::encode::{Rounding, Steps};
use crate::compare::Lines;
use crate::trace::Trace;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Runs at most.
const RUNS_MAX: usize = 10_000;

/// Runs of states.
#[derive(Clone, Debug, Default)]
pub struct Strip {
    /// Beginning of each run.
    starts_s: Vec<f64>,
    /// Its state, a place in `names`.
    states: Vec<usize>,
    names: Vec<String>,
}

impl Strip {
    fn push(&mut self, time_s: f64, name: &str, places: &mut BTreeMap<String, usize>) {
        let state = match places.get(name) {
            Some(state) => *state,
            None => {
                self.names.push(name.to_owned());
                places.insert(name.to_owned(), self.names.len() - 1);
                self.names.len() - 1
            }
        };
        if self.states.last() != Some(&state) {
            self.starts_s.push(time_s);
            self.states.push(state);
        }
    }

    /// What limits the feed in a trace: `X.jerk`, `feed`, ... Empty where the trace does not know.
    pub fn of_limits(trace: &Trace) -> Self {
        let mut strip = Self::default();
        let Some(kind) = trace.signal("path.limit_kind") else { return strip };
        let axis = trace.signal("path.limit_axis").filter(|axis| axis.len() == kind.len());
        let mut places = BTreeMap::new();
        for i in 0..kind.len() {
            let Some(kind_name) = kind.label(i) else { continue };
            let name = match axis.and_then(|axis| axis.label(i)) {
                Some(axis_name) => format!("{axis_name}.{kind_name}"),
                None => kind_name.to_owned(),
            };
            strip.push(kind.times.time_s(i), &name, &mut places);
        }
        strip
    }

    /// NC lines over time: names are `PROGRAM\nLINE`.
    pub fn of_lines(lines: &Lines) -> Self {
        let mut strip = Self::default();
        let mut places = BTreeMap::new();
        for (time_s, (program, line)) in lines.starts() {
            strip.push(*time_s, &format!("{program}\n{line}"), &mut places);
        }
        strip
    }

    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.states.is_empty()
    }

    /// Time for which each state holds, in the order of the names, until `end_s`.
    fn durations_s(&self, end_s: f64) -> Vec<f64> {
        let mut sums = vec![0.0; self.names.len()];
        for (i, state) in self.states.iter().enumerate() {
            let until_s = self.starts_s.get(i + 1).copied().unwrap_or(end_s);
            sums[*state] += (until_s - self.starts_s[i]).max(0.0);
        }
        sums
    }

    /// At most [`RUNS_MAX`] runs.
    fn thinned(&self, end_s: f64) -> (Self, bool) {
        let Some(first_s) = self.starts_s.first().copied().filter(|_| self.states.len() > RUNS_MAX) else {
            return (self.clone(), false);
        };
        let width_s = (end_s - first_s) / RUNS_MAX as f64;
        let mut thin = Self { names: self.names.clone(), ..Self::default() };
        let mut run = 0;
        for bin in 0..RUNS_MAX {
            let (from_s, to_s) = (first_s + bin as f64 * width_s, first_s + (bin + 1) as f64 * width_s);
            let mut longest = (f64::MIN, 0);
            while run < self.states.len() {
                let until_s = self.starts_s.get(run + 1).copied().unwrap_or(end_s);
                let held_s = until_s.min(to_s) - self.starts_s[run].max(from_s);
                if held_s > longest.0 {
                    longest = (held_s, self.states[run]);
                }
                if until_s > to_s || run + 1 == self.states.len() {
                    break;
                }
                run += 1;
            }
            if thin.states.last() != Some(&longest.1) {
                thin.starts_s.push(from_s);
                thin.states.push(longest.1);
            }
        }
        (thin, true)
    }

    /// For the page: only the names that a run has. `with_durations`: also for how long each holds.
    pub fn json(&self, end_s: f64, with_durations: bool) -> Value {
        let (runs, thinned) = self.thinned(end_s);
        let mut used = vec![usize::MAX; self.names.len()];
        let mut kept: Vec<usize> = Vec::new();
        for state in &runs.states {
            if used[*state] == usize::MAX {
                used[*state] = kept.len();
                kept.push(*state);
            }
        }
        let states: Vec<usize> = runs.states.iter().map(|state| used[*state]).collect();
        let durations_s = self.durations_s(end_s);
        let durations: Vec<f64> = kept.iter().filter(|_| with_durations).map(|state| durations_s[*state]).collect();
        json!({
            "count": runs.states.len(),
            "runs": self.states.len(),
            "thinned": thinned,
            "end": end_s,
            "names": kept.iter().map(|state| self.names[*state].as_str()).collect::<Vec<_>>(),
            "durations": durations,
            "starts": Steps::covering(runs.starts_s.iter(), 4).pack(&runs.starts_s, Rounding::Nearest),
            "states": {"low": 0.0, "step": 1.0, "bytes": 3, "data": whole(&states)},
        })
    }
}

/// Whole numbers in the code of the page.
fn whole(states: &[usize]) -> String {
    let bytes: Vec<u8> =
        states.iter().flat_map(|state| (*state as u32 + 1).to_le_bytes().into_iter().take(3)).collect();
    super::encode::base64(&bytes)
}
