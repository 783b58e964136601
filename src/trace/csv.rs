//! CSV of any dialect -> rows: our own exports, tables of other programs, flattened recorder data.
//!
//! In: a text, `--time`. Out: heads and rows for a [`Sink`], and a note that says how the table was understood: separator, decimal
//! sign, encoding, units row, time column and its unit. Memory: the first lines and one row.

use super::columns::{Column, describe_columns};
use super::delimited::{Dialect, LOOK_AHEAD_LINES, cells};
use super::faults::{Faults, against_time};
use super::import::{About, ImportOptions};
use super::naming::Naming;
use super::sink::Sink;
use super::source::{PartReader, Source};
use super::time_column::{NOT_LATER, Refused, TimeColumn};
use super::wire::{Origin, TraceFormat};
use crate::base::Diagnostic;
use std::collections::BTreeMap;

/// Different words of one column: beyond, the column is no signal.
const WORDS_MAX: usize = 100_000;

/// Reads a table into a sink.
pub(super) fn read_csv(
    source: &Source,
    part: usize,
    options: &ImportOptions,
    sink: &mut dyn Sink,
) -> Result<About, Diagnostic> {
    let mut reader = source.read(part)?;
    let shown = source.part_name(part).clone();
    let mut first_lines = Vec::new();
    let mut starts = Vec::new();
    while first_lines.len() < LOOK_AHEAD_LINES {
        let mut line = String::new();
        let at = reader.consumed();
        starts.push(at);
        if !reader.line(&mut line).map_err(|error| source.unreadable_at(part, at, &error))? {
            break;
        }
        first_lines.push(line);
    }
    let Some(dialect) = Dialect::find(&first_lines) else {
        let message = format!("{shown} is no table of numbers: no separator makes rows of numbers of its lines");
        return Err(Diagnostic::error("T0016", message).help("known are semicolon, tabulator, comma and blanks"));
    };
    let table = Reading { source, part, dialect, first_lines, starts };
    table.read(reader, options, sink)
}

struct Reading<'a> {
    source: &'a Source<'a>,
    part: usize,
    dialect: Dialect,
    first_lines: Vec<String>,
    /// Byte at which each of the first lines begins.
    starts: Vec<u64>,
}

impl Reading<'_> {
    fn row_cells(&self, line: usize) -> Vec<String> {
        let mut row = self.first_lines.get(line).map_or_else(Vec::new, |text| cells(text, self.dialect.separator));
        row.resize(self.dialect.columns, String::new());
        row
    }

    /// Names of the columns.
    fn names(&self) -> Vec<String> {
        let mut names = self.dialect.header.map_or_else(Vec::new, |line| self.row_cells(line));
        names.resize(self.dialect.columns, String::new());
        for (place, name) in names.iter_mut().enumerate() {
            if name.is_empty() {
                *name = format!("column {}", place + 1);
            }
        }
        names
    }

    fn read(&self, mut reader: PartReader, options: &ImportOptions, sink: &mut dyn Sink) -> Result<About, Diagnostic> {
        let shown = self.source.part_name(self.part).clone();
        let names = self.names();
        let units = self.dialect.units.map(|line| self.row_cells(line));
        let sample: Vec<Vec<String>> = (self.dialect.data..self.first_lines.len()).map(|l| self.row_cells(l)).collect();
        let time = TimeColumn::find(&names, units.as_deref(), &sample, &self.dialect, options, &shown);
        let time = time.map_err(|Refused { finding, row }| {
            let at = row.and_then(|row| self.starts.get(self.dialect.data + row));
            match at.and_then(|at| self.source.place(self.part, *at, "this row is not later than the one before")) {
                Some(place) => finding.at(place),
                None => finding,
            }
        })?;
        let mut naming = Naming::new(TraceFormat::Csv, options);
        let columns = describe_columns(&names, units.as_deref(), &sample, &self.dialect, &time, &mut naming);
        let heads: Vec<_> = columns.iter().map(|column| column.head.clone()).collect();
        sink.begin(&heads)?;
        let faults = Faults::default();
        let mut rows = Rows { dialect: &self.dialect, time, columns, cells: Vec::new(), faults, count: 0, sink };
        for line in self.dialect.data..self.first_lines.len() {
            rows.take(&self.first_lines[line], self.starts[line])?;
        }
        let mut line = String::new();
        loop {
            let at = reader.consumed();
            if !reader.line(&mut line).map_err(|error| self.source.unreadable_at(self.part, at, &error))? {
                break;
            }
            rows.take(&line, at)?;
        }
        let Rows { time, faults, count, .. } = rows;
        if count == 0 {
            let message = format!("{shown} has no row with a time and a number");
            return Err(Diagnostic::error("T0003", message));
        }
        let (late, at) = faults.of("T0009", NOT_LATER);
        if let Some(finding) = against_time(late, count, &shown) {
            return Err(match self.source.place(self.part, at, "the first one") {
                Some(place) => finding.at(place),
                None => finding,
            });
        }
        self.about(naming, &time, &faults, reader.encoding_remark(), &shown)
    }

    fn about(
        &self,
        mut naming: Naming,
        time: &TimeColumn,
        faults: &Faults,
        encoding: Option<String>,
        shown: &str,
    ) -> Result<About, Diagnostic> {
        let encoding = encoding.unwrap_or_else(|| "UTF-8".to_owned());
        let message = format!("{shown} is read as {}; {}; {encoding}", self.dialect.description(), time.description);
        let mut notes = vec![Diagnostic::note("T0016", message)];
        notes.append(&mut naming.notes);
        let finding = |code: &'static str, message: String, byte: u64| {
            let finding = Diagnostic::warning(code, message);
            match self.source.place(self.part, byte, "the first one") {
                Some(place) => finding.at(place),
                None => finding,
            }
        };
        notes.extend(faults.findings(finding));
        let head_end = self.dialect.header.unwrap_or(self.dialect.data);
        let head: BTreeMap<String, String> = self.first_lines[..head_end]
            .iter()
            .enumerate()
            .filter(|(_, line)| !line.trim().is_empty())
            .map(|(number, line)| (format!("line {}", number + 1), line.clone()))
            .collect();
        let metadata = if head.is_empty() { BTreeMap::new() } else { BTreeMap::from([("head".to_owned(), head)]) };
        let format = TraceFormat::Csv;
        Ok(About {
            origin: Origin { format, description: format.title().to_owned(), start_utc: None },
            metadata,
            notes,
        })
    }
}

/// Rows on their way.
struct Rows<'a> {
    dialect: &'a Dialect,
    time: TimeColumn,
    columns: Vec<Column>,
    cells: Vec<(usize, f64)>,
    faults: Faults,
    count: u64,
    sink: &'a mut dyn Sink,
}

impl Rows<'_> {
    fn take(&mut self, line: &str, at: u64) -> Result<(), Diagnostic> {
        let row = cells(line, self.dialect.separator);
        if row.iter().all(String::is_empty) || row.first().is_some_and(|cell| cell.starts_with("EOF")) {
            return Ok(());
        }
        if row.len() != self.dialect.columns {
            let few = row.len() < self.dialect.columns;
            let message = if few { "a row has too few cells: the rest is a gap" } else { "a row has too many cells" };
            self.faults.count("T0008", message, at);
        }
        let Some(time_s) = self.time.next(&row, self.dialect, at, &mut self.faults) else { return Ok(()) };
        self.cells.clear();
        for place in 0..self.columns.len() {
            let text = row.get(self.columns[place].cell).map_or("", String::as_str);
            if let Some(value) = self.value(text, place, at) {
                self.cells.push((place, value));
            }
        }
        self.count += 1;
        self.sink.row(time_s, &self.cells)
    }

    /// `None`: nothing at this instant.
    fn value(&mut self, text: &str, place: usize, at: u64) -> Option<f64> {
        let column = &mut self.columns[place];
        if text.is_empty() {
            return (!column.sparse).then_some(f64::NAN);
        }
        if column.head.words {
            if let Some(known) = column.words.get(text) {
                return Some(*known as f64);
            }
            if column.words.len() >= WORDS_MAX {
                self.faults.count("T0010", "a column has too many different words", at);
                return Some(f64::NAN);
            }
            self.sink.word(place, text);
            column.words.insert(text.to_owned(), column.words.len());
            return Some((column.words.len() - 1) as f64);
        }
        match self.dialect.number(text) {
            Some(value) if value.is_finite() => Some(value * column.factor),
            _ => {
                self.faults.count("T0010", "a cell is no number: a gap", at);
                Some(f64::NAN)
            }
        }
    }
}
