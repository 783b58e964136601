//! What a person or a script sees: findings, tables, JSON, progress.
//!
//! In: diagnostics, documents, rows. Out: text on stdout and stderr. A closed pipe (`sollwert moves x | head`) ends output quietly.

use super::failure::Failure;
use crate::base::{Diagnostic, Severity};
use serde::Serialize;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

/// Shows findings on stderr, coloured on a terminal unless NO_COLOR is set.
pub(super) fn show<'a>(findings: impl IntoIterator<Item = &'a Diagnostic>) {
    let colour = stderr_colour();
    let mut stderr = std::io::stderr().lock();
    let mut first_error = None;
    for finding in findings {
        // Nothing is left to do when stderr is gone.
        let _ = writeln!(stderr, "{}", finding.render(colour));
        if finding.severity == Severity::Error {
            first_error = first_error.or(Some(finding.code));
        }
    }
    if let Some(code) = first_error {
        let _ = writeln!(stderr, "`sollwert explain {code}` says more about this.");
    }
}

/// Colour on stderr: on a terminal, unless NO_COLOR is set.
pub(super) fn stderr_colour() -> bool {
    std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// Prints a text to stdout.
pub(super) fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    written(stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()))
}

/// A closed pipe is the reader's way to say "enough"; any other fault of stdout is one.
pub(super) fn written(done: std::io::Result<()>) -> Result<(), Failure> {
    match done {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(Failure::stdout(&error)),
        _ => Ok(()),
    }
}

/// Prints one JSON document to stdout.
pub(super) fn print_json(document: &impl Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(document).map_err(|error| {
        Failure::unreadable(Diagnostic::error("K0003", format!("the figures do not serialise: {error}")))
    })?;
    print(&(text + "\n"))
}

/// A table for people: columns padded to their widest cell; the first column left, the others right.
pub(super) fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::from(" ");
        for (column, cell) in row.iter().enumerate() {
            let pad = " ".repeat(widths[column] - cell.chars().count());
            line += &if column == 0 { format!(" {cell}{pad}") } else { format!("  {pad}{cell}") };
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

/// A line on stderr that follows the work, on a terminal only, and only if the work takes more than a second.
pub(super) struct ProgressLine {
    started: Instant,
    bar: Option<indicatif::ProgressBar>,
    wanted: bool,
}

impl ProgressLine {
    pub(super) fn new() -> Self {
        Self { started: Instant::now(), bar: None, wanted: std::io::stderr().is_terminal() }
    }

    pub(super) fn update(&mut self, message: impl FnOnce() -> String) {
        if !self.wanted || self.started.elapsed() < Duration::from_secs(1) {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let bar = indicatif::ProgressBar::new_spinner();
            bar.enable_steady_tick(Duration::from_millis(120));
            bar
        });
        bar.set_message(message());
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
