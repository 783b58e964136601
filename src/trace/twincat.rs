//! TwinCAT Scope CSV -> rows.
//!
//! In: a text of the scope's export. Out: heads and rows for a [`Sink`]. A head line is a key and the values of the channels; where the key
//! stands again, a group of channels begins that has a time column of its own: pairs of time and value, or one time for several values.
//! The letter behind the first word separates. Values are taken as they stand: the scope has applied scale and offset.
//!
//! Groups run on clocks of their own: line k of a group at 4 ms is four times as late as that of one at 1 ms. Lines are merged as they come;
//! memory holds what the faster groups have not yet reached, at most [`WAITING_MAX`] values.

use super::columns::named_head;
use super::delimited::{cells, number};
use super::faults::{Faults, TIME_MAX_S};
use super::import::{About, ImportOptions};
use super::naming::{NamedHead, Naming};
use super::scope::Lines;
use super::sink::{Head, Layout, Sink};
use super::source::Source;
use super::wire::{Clock, Origin, TraceFormat};
use crate::base::Diagnostic;
use crate::base::units::MS_PER_S;
use std::collections::{BTreeMap, VecDeque};

/// Lines of a head, and channels.
const HEAD_LINES_MAX: usize = 200;
const CHANNELS_MAX: usize = 10_000;
/// Values that wait for slower groups, 16 bytes each.
const WAITING_MAX: usize = 30_000_000;

/// A channel.
struct Channel {
    named: NamedHead,
    /// Its column, with and without the columns of time.
    column: usize,
    bare_column: usize,
    /// Column of its time.
    time_column: usize,
    period_s: Option<f64>,
    waiting: VecDeque<(f64, f64)>,
    last_s: f64,
}

/// What the head says.
struct Layouts {
    channels: Vec<Channel>,
    time_columns: usize,
    metadata: BTreeMap<String, String>,
}

/// Reads a TwinCAT Scope CSV.
pub(super) fn read_twincat(
    source: &Source,
    part: usize,
    options: &ImportOptions,
    sink: &mut dyn Sink,
) -> Result<About, Diagnostic> {
    let mut lines = Lines::new(source, part)?;
    let mut head: Vec<Vec<String>> = Vec::new();
    let mut separator = '\t';
    let first_row = loop {
        if !lines.advance()? || head.len() > HEAD_LINES_MAX {
            return Err(lines.nothing());
        }
        if head.is_empty() {
            separator = separator_of(&lines.line);
        }
        let row = row_of(&lines.line, separator);
        // Keys are words: the first line that begins with a number, or with an empty cell before one, has samples.
        let begin = row.iter().find(|cell| !cell.is_empty());
        if begin.is_some_and(|cell| number(cell, separator != ',').is_some()) {
            break row;
        }
        head.push(row);
    };
    let mut naming = Naming::new(TraceFormat::TwinCatCsv, options);
    let Layouts { channels, time_columns, metadata } = layouts(&head, &mut naming);
    if channels.is_empty() {
        return Err(lines.nothing());
    }
    let heads: Vec<Head> = channels
        .iter()
        .map(|channel| Head { layout: Layout::Own, period_s: channel.period_s, ..channel.named.head.clone() })
        .collect();
    sink.begin(&heads)?;
    let bare = first_row.len() == channels.len();
    let mut merge = Merge { channels, bare, rows: 0, waiting: 0, emitted_s: f64::NEG_INFINITY, cells: Vec::new() };
    let mut faults = Faults::default();
    if bare && time_columns > 0 && merge.channels.iter().any(|channel| channel.period_s.is_none()) {
        faults.count("T0015", "the file has neither times nor `SampleTime[ms]`: 1 ms is assumed", lines.at);
    }
    let mut row = first_row;
    loop {
        merge.take(&row, separator, lines.at, &mut faults);
        merge.hand_over(sink)?;
        if merge.waiting > WAITING_MAX {
            let message = format!("{} has groups whose times lie too far apart to be merged", source.part_name(part));
            return Err(Diagnostic::error("T0017", message).help("export them into files of their own"));
        }
        if !lines.advance()? || lines.line.trim() == "EOF" {
            break;
        }
        row = row_of(&lines.line, separator);
    }
    merge.finish(sink)?;
    if merge.emitted_s == f64::NEG_INFINITY {
        return Err(lines.nothing());
    }
    let notes = lines.notes(&faults, &mut naming);
    let start_utc = metadata.get("Starttime of export").and_then(|ticks| utc_of_ticks(ticks.parse().ok()?));
    let format = TraceFormat::TwinCatCsv;
    let origin = Origin { format, description: format.title().to_owned(), start_utc };
    Ok(About { origin, metadata: BTreeMap::from([("twincat".to_owned(), metadata)]), notes })
}

/// What stands behind the first word.
fn separator_of(line: &str) -> char {
    let rest = line.trim_start().trim_start_matches('"');
    let rest = rest.trim_start_matches("Name").trim_start_matches("File").trim_start_matches('"');
    rest.chars().next().filter(|c| matches!(c, '\t' | ';' | ',' | ':' | ' ')).unwrap_or('\t')
}

/// Cells of a line; blanks separate only outside of quotation marks.
fn row_of(line: &str, separator: char) -> Vec<String> {
    if separator != ' ' {
        return cells(line, separator);
    }
    let mut row = vec![String::new()];
    let mut quoted = false;
    for c in line.chars() {
        match (c, row.last_mut()) {
            ('"', _) => quoted = !quoted,
            (' ', _) if !quoted => row.push(String::new()),
            (_, Some(cell)) => cell.push(c),
            (_, None) => {}
        }
    }
    row
}

/// Channels, and what the head says of the file.
fn layouts(head: &[Vec<String>], naming: &mut Naming) -> Layouts {
    let mut metadata = BTreeMap::new();
    // The head of the channels begins at the last line whose key is `Name`.
    let begin = head.iter().rposition(|row| row.first().is_some_and(|key| key == "Name")).unwrap_or(0);
    for row in &head[..begin] {
        if let [key, value, ..] = row.as_slice() {
            metadata.insert(key.clone(), value.clone());
        }
    }
    let about = head.get(begin..).unwrap_or(&[]);
    let line = |key: &str| about.iter().find(|row| row.first().is_some_and(|own| own == key));
    let value =
        |key: &str, column: usize| line(key)?.get(column).filter(|text| !text.is_empty() && *text != key).cloned();
    // A channel may be called `Name`; no type is called `Data-Type`.
    let keys = line("Data-Type").or_else(|| line("SampleTime[ms]")).or_else(|| line("Name"));
    let key = keys.and_then(|row| row.first()).cloned().unwrap_or_default();
    let width = keys.map_or(0, Vec::len);
    let filled = |row: &Vec<String>| row.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
    // Blanks in names, where blanks separate: nothing tells which name is whose.
    let names_fit = line("Name").is_some_and(|row| filled(row) <= width);
    let given = |column: usize| value("Name", column).filter(|_| names_fit);
    let is_key = |column: usize| keys.and_then(|row| row.get(column)).is_some_and(|cell| *cell == key);
    let (mut named, mut places) = (Vec::new(), Vec::new());
    let mut time_columns = Vec::new();
    for column in 0..width {
        if is_key(column) {
            time_columns.push(column);
            continue;
        }
        let unnamed = || value(&key, column).map(|_| format!("channel {}", named.len() + 1));
        let Some(name) = value("SymbolName", column).or_else(|| given(column)).or_else(unnamed) else { continue };
        if named.len() >= CHANNELS_MAX {
            break;
        }
        // One symbol may be drawn several times, scaled: then the channels have names of their own.
        let taken = |name: &String| named.iter().any(|other: &NamedHead| other.head.original == *name);
        let name = if taken(&name) { given(column).unwrap_or(name) } else { name };
        let name = if taken(&name) { format!("{name} ({})", named.len() + 1) } else { name };
        // `dV (Voltage)`, `(None)`.
        let unit = value("Unit", column).map(|text| text.split('(').next().unwrap_or("").trim().to_owned());
        let mut entry = named_head(&name, unit.as_deref().filter(|unit| !unit.is_empty()), false, naming);
        entry.head.clock = Clock::Servo;
        let period = value("SampleTime[ms]", column).and_then(|text| number(&text, true));
        let period_s = period.filter(|period| *period > 0.0).map(|period_ms| period_ms / MS_PER_S);
        places.push((column, time_columns.last().copied().unwrap_or(0), period_s));
        named.push(entry);
    }
    naming.settle(&mut named);
    let channel = |(i, (named, (column, time_column, period_s)))| Channel {
        named,
        column,
        bare_column: i,
        time_column,
        period_s,
        waiting: VecDeque::new(),
        last_s: f64::NEG_INFINITY,
    };
    let channels = named.into_iter().zip(places).enumerate().map(channel).collect();
    Layouts { channels, time_columns: time_columns.len(), metadata }
}

/// Lines as they come -> rows in order of time.
struct Merge {
    channels: Vec<Channel>,
    /// The lines have no times.
    bare: bool,
    rows: u64,
    waiting: usize,
    emitted_s: f64,
    cells: Vec<(usize, f64)>,
}

impl Merge {
    fn take(&mut self, row: &[String], separator: char, at: u64, faults: &mut Faults) {
        let read = |place: usize| row.get(place).and_then(|text| number(text, separator != ','));
        for channel in &mut self.channels {
            let (time_s, value) = if self.bare {
                (Some(self.rows as f64 * channel.period_s.unwrap_or(1.0 / MS_PER_S)), read(channel.bare_column))
            } else {
                (read(channel.time_column).map(|time_ms| time_ms / MS_PER_S), read(channel.column))
            };
            // NaN: the cell is empty, the channel has ended.
            let time_s = time_s.filter(|time_s| time_s.abs() < TIME_MAX_S);
            let Some(time_s) = time_s else {
                // The others need not wait for the channel any more.
                channel.last_s = f64::INFINITY;
                continue;
            };
            let Some(value) = value.filter(|value| !value.is_nan()) else {
                channel.last_s = channel.last_s.max(time_s);
                continue;
            };
            if time_s <= channel.newest_s() || time_s <= self.emitted_s {
                faults.count("T0009", "a sample is not later than the one before and is left out", at);
                continue;
            }
            channel.last_s = time_s;
            channel.waiting.push_back((time_s, value * channel.named.factor));
            self.waiting += 1;
        }
        self.rows += 1;
    }

    /// What all channels that still run have passed.
    fn hand_over(&mut self, sink: &mut dyn Sink) -> Result<(), Diagnostic> {
        let running = self.channels.iter().filter(|channel| channel.last_s.is_finite());
        let passed_s = running.map(|channel| channel.last_s).fold(f64::INFINITY, f64::min);
        if passed_s == f64::INFINITY { Ok(()) } else { self.hand_over_to(passed_s, sink) }
    }

    fn hand_over_to(&mut self, passed_s: f64, sink: &mut dyn Sink) -> Result<(), Diagnostic> {
        loop {
            let due = self.channels.iter().filter_map(|channel| Some(channel.waiting.front()?.0));
            let Some(now_s) = due.min_by(f64::total_cmp).filter(|now_s| *now_s <= passed_s) else { return Ok(()) };
            self.cells.clear();
            for (place, channel) in self.channels.iter_mut().enumerate() {
                if let Some((_, value)) = channel.waiting.front().filter(|(time_s, _)| *time_s == now_s) {
                    self.cells.push((place, *value));
                    channel.waiting.pop_front();
                }
            }
            self.waiting -= self.cells.len();
            self.emitted_s = now_s;
            sink.row(now_s, &self.cells)?;
        }
    }

    fn finish(&mut self, sink: &mut dyn Sink) -> Result<(), Diagnostic> {
        self.hand_over_to(f64::INFINITY, sink)
    }
}

impl Channel {
    fn newest_s(&self) -> f64 {
        self.waiting.back().map_or(f64::NEG_INFINITY, |(time_s, _)| *time_s)
    }
}

/// 100 ns since 1601 as ISO 8601.
fn utc_of_ticks(ticks: u64) -> Option<String> {
    const DAYS_1601_TO_MARCH_2000: i64 = 145_791;
    let (seconds, fraction) = (ticks / 10_000_000, ticks % 10_000_000);
    let (day, second) = ((seconds / 86_400) as i64 - DAYS_1601_TO_MARCH_2000, seconds % 86_400);
    // Years begin in March, so that the leap day is the last; 400 years have 146,097 days.
    let era = day.div_euclid(146_097);
    let of_era = day.rem_euclid(146_097);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * of_year + 2) / 153;
    let date = of_year - (153 * month + 2) / 5 + 1;
    let year = 2000 + 400 * era + year_of_era + i64::from(month >= 10);
    let month = if month < 10 { month + 3 } else { month - 9 };
    let (hour, minute) = (second / 3600, second / 60 % 60);
    let plausible = (1900..=9999).contains(&year);
    plausible.then(|| {
        format!("{year:04}-{month:02}-{date:02}T{hour:02}:{minute:02}:{:02}.{:03}Z", second % 60, fraction / 10_000)
    })
}
