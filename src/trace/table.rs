//! Rows -> CSV.
//!
//! In: heads and rows. Out: one header, one line a row: `time_s` and a column a signal; what has not changed is held, what is not
//! sampled at an instant is empty, and so is a gap. Numbers in the shortest form that reads back. Memory: one row.

use super::export::{ColumnNames, Written, output_fault};
use super::sink::{Head, Layout, Sink};
use super::wire::TraceEvent;
use crate::base::Diagnostic;
use crate::recorder::{push_number, push_text};
use std::io::Write;

/// Writes a table.
pub(super) struct Table<W> {
    output: W,
    names: ColumnNames,
    columns: Vec<Column>,
    line: Vec<u8>,
    written: Written,
}

struct Column {
    held: bool,
    words: Option<Vec<String>>,
    text: Vec<u8>,
}

impl<W: Write> Table<W> {
    pub(super) fn new(output: W, names: ColumnNames) -> Self {
        Self { output, names, columns: Vec::new(), line: Vec::new(), written: Written::default() }
    }

    /// The writer, and what went through it.
    pub(super) fn finish(self) -> (W, Written) {
        (self.output, self.written)
    }

    fn put(&mut self) -> Result<(), Diagnostic> {
        self.written.bytes += self.line.len() as u64;
        self.output.write_all(&self.line).map_err(|error| output_fault(&error))
    }
}

impl<W: Write> Sink for Table<W> {
    fn begin(&mut self, heads: &[Head]) -> Result<(), Diagnostic> {
        let mut header = String::from("time_s");
        for name in self.names.of(heads) {
            header.push(',');
            push_text(&mut header, &name);
        }
        header.push('\n');
        self.columns = heads
            .iter()
            .map(|head| Column {
                held: head.layout == Layout::Held,
                words: head.words.then(Vec::new),
                text: Vec::new(),
            })
            .collect();
        self.written.columns = heads.len() + 1;
        self.line = header.into_bytes();
        self.put()
    }

    fn word(&mut self, signal: usize, word: &str) {
        if let Some(words) = self.columns.get_mut(signal).and_then(|column| column.words.as_mut()) {
            let mut text = String::new();
            push_text(&mut text, word);
            words.push(text);
        }
    }

    fn row(&mut self, time_s: f64, cells: &[(usize, f64)]) -> Result<(), Diagnostic> {
        for column in self.columns.iter_mut().filter(|column| !column.held) {
            column.text.clear();
        }
        for (place, value) in cells {
            let Some(column) = self.columns.get_mut(*place) else { continue };
            column.text.clear();
            match &column.words {
                _ if value.is_nan() => {}
                None => push_number(&mut column.text, *value),
                Some(words) => {
                    let word = words.get(*value as usize).map_or("", String::as_str);
                    column.text.extend_from_slice(word.as_bytes());
                }
            }
        }
        self.line.clear();
        push_number(&mut self.line, time_s);
        for column in &self.columns {
            self.line.push(b',');
            self.line.extend_from_slice(&column.text);
        }
        self.line.push(b'\n');
        self.written.rows += 1;
        self.put()
    }

    fn event(&mut self, _: TraceEvent) -> Result<(), Diagnostic> {
        // A table has no place for events.
        Ok(())
    }
}
