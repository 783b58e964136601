//! Low-frequency data of a data recorder: values with the counter of the position cycle at which they were read.
//!
//! In: `SignalListLFData` of the header, elements of LFData, which of the signals are texts. Out: heads, and the cells that belong to a row of
//! HFData: each value once, at the first row at or after its counter. Numbers, truth values and texts that are numbers are values; of a
//! signal of texts (`value_type` String: the name of a tool) every value is a word. Does not read files.

use super::columns::taken_apart;
use super::faults::Faults;
use super::naming::{NamedHead, Naming};
use super::sink::{Head, Layout, Sink};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Signals, and values that wait for their row.
const SIGNALS_MAX: usize = 1000;
const WAITING_MAX: usize = 1_000_000;
/// Different words of a signal.
const WORDS_MAX: usize = 100_000;
/// Counters wrap here.
const COUNTER_WRAP: f64 = 2_147_483_648.0;

/// The low-frequency signals of a chain of files.
#[derive(Debug, Default)]
pub(super) struct LowSignals {
    /// Place in `signals` by address.
    places: BTreeMap<String, usize>,
    signals: Vec<LowSignal>,
    waiting: VecDeque<(f64, usize, f64)>,
    /// By how many cycles the latest value missed its row.
    late: f64,
}

#[derive(Debug)]
struct LowSignal {
    column: usize,
    factor: f64,
    /// Words by number, of a signal of texts.
    words: Option<BTreeMap<String, usize>>,
}

/// Whether an element of LFData says that its value is a text.
pub(super) fn text_address(entry: &Value) -> Option<&str> {
    let address = address(entry)?;
    let text = entry.get("value").is_some_and(Value::is_string);
    let said = entry.get("value_type").and_then(Value::as_str).map(str::to_lowercase);
    let words = match said.as_deref() {
        Some("string" | "char" | "localizedtext" | "text") => text,
        Some(_) => false,
        None => text && entry.get("value").and_then(number).is_none(),
    };
    words.then_some(address)
}

fn address(entry: &Value) -> Option<&str> {
    entry.get("address").or_else(|| entry.get("Address")).and_then(Value::as_str)
}

impl LowSignals {
    /// Heads of the signals that the header lists; `first` is the column of the first, `texts` are the addresses of texts.
    pub(super) fn begin(
        &mut self,
        header: &Value,
        first: usize,
        texts: &BTreeSet<String>,
        naming: &mut Naming,
    ) -> Vec<Head> {
        let list = header.get("SignalListLFData").and_then(Value::as_array);
        let mut heads: Vec<NamedHead> = Vec::new();
        for entry in list.into_iter().flatten().take(SIGNALS_MAX) {
            let text = |key: &str| entry.get(key).and_then(Value::as_str).filter(|text| !text.is_empty());
            let names = ["path", "address", "Address", "id", "Name"];
            let Some(name) = names.into_iter().find_map(text) else { continue };
            let (_, parts) = taken_apart(name);
            let mut head = naming.head(name, &parts, None);
            for name in names.into_iter().filter_map(text) {
                self.places.entry(name.to_owned()).or_insert(heads.len());
                head.head.words |= texts.contains(name);
            }
            let words = head.head.words.then(BTreeMap::new);
            self.signals.push(LowSignal { column: first + heads.len(), factor: head.factor, words });
            heads.push(head);
        }
        naming.settle(&mut heads);
        let held = |named: NamedHead| Head { layout: Layout::Held, discrete: true, ..named.head };
        heads.into_iter().map(held).collect()
    }

    /// Takes the values of an element.
    pub(super) fn take(&mut self, element: &Value, faults: &mut Faults, sink: &mut dyn Sink) {
        let one = std::slice::from_ref(element);
        for entry in element.as_array().map_or(one, Vec::as_slice) {
            let place = address(entry).and_then(|address| self.places.get(address));
            let Some(signal) = place.and_then(|place| self.signals.get_mut(*place)) else {
                faults.count("T0008", "a value of LFData belongs to no signal of the header and is left out", 0);
                continue;
            };
            let counter = ["HFProbeCounter", "HfProbeCounter"].into_iter().find_map(|key| number(entry.get(key)?));
            let value = match &mut signal.words {
                Some(words) => word(entry.get("value"), words, |text| sink.word(signal.column, text)),
                None => entry.get("value").and_then(number).map(|value| value * signal.factor),
            };
            let Some(value) = value else {
                faults.count("T0008", "a value of LFData is not of the sort of its signal and is left out", 0);
                continue;
            };
            if self.waiting.len() >= WAITING_MAX {
                faults.count("T0008", "values of LFData come long before their rows and are left out", 0);
                continue;
            }
            // Without a counter it belongs to the next row.
            self.waiting.push_back((counter.unwrap_or(f64::NEG_INFINITY), signal.column, value));
        }
    }

    /// Cells of the row at `counter`; of several values of one signal the last.
    pub(super) fn hand_over(&mut self, counter: f64, cells: &mut Vec<(usize, f64)>) {
        let high = cells.len();
        while let Some((at, column, value)) = self.waiting.front().copied() {
            // Over the wrap, half of it ahead is behind; NaN for a value without a counter.
            let ahead = (at - counter + COUNTER_WRAP / 2.0).rem_euclid(COUNTER_WRAP) - COUNTER_WRAP / 2.0;
            if ahead > 0.0 {
                break;
            }
            self.late = self.late.max(-ahead);
            self.waiting.pop_front();
            match cells[high..].iter_mut().find(|cell| cell.0 == column) {
                Some(cell) => cell.1 = value,
                None => cells.push((column, value)),
            }
        }
    }

    /// By how many cycles the latest value missed its row, if that is more than a few.
    pub(super) fn late_by(&self) -> Option<u64> {
        (self.late > 5.0).then_some(self.late as u64)
    }
}

/// Number of a word; a new one is told.
fn word(value: Option<&Value>, words: &mut BTreeMap<String, usize>, tell: impl FnOnce(&str)) -> Option<f64> {
    let text = match value? {
        Value::String(text) => text.clone(),
        Value::Null => return None,
        other => other.to_string(),
    };
    if let Some(known) = words.get(&text) {
        return Some(*known as f64);
    }
    if words.len() >= WORDS_MAX {
        return None;
    }
    tell(&text);
    words.insert(text, words.len());
    Some((words.len() - 1) as f64)
}

/// A number, a truth value, or a text that is a number.
fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => number.as_f64(),
        Value::Bool(truth) => Some(f64::from(u8::from(*truth))),
        Value::String(text) => text.trim().parse().ok(),
        _ => None,
    }
    .filter(|value| value.is_finite())
}
