//! Any trace into another form: CSV, Parquet, a recording, an Operate session.
//!
//! In: a path of any importable trace, the form, a path to write. Out: the file, which appears when it is complete, and an
//! [`ExportOutcome`]. Streams, so that memory does not grow with the length; only the Operate session needs the whole trace,
//! because it tells the number of points first. Does not resample.

use super::import::{About, ImportOptions, import, read_rows};
use super::operate_writer::write_operate;
use super::recording::TRACE_METADATA;
use super::rows::{stream_recording, stream_trace};
use super::sink::{Head, Sink};
use super::source::Source;
use super::table::Table;
use super::to_recording::ToRecording;
use super::wire::{Origin, Signal, Trace, TraceFormat};
use crate::base::Diagnostic;
use crate::recorder::{Recording, Target, WholeFile};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Forms that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ExportForm {
    /// One row an instant.
    Csv,
    /// The same as columns.
    Parquet,
    /// A recording.
    Recording,
    /// SINUMERIK Operate trace session.
    OperateXml,
}

impl ExportForm {
    /// By the ending of a name; `None` if it says nothing.
    pub fn by_ending(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "csv" => Some(Self::Csv),
            "parquet" => Some(Self::Parquet),
            "mcap" => Some(Self::Recording),
            "xml" => Some(Self::OperateXml),
            _ => None,
        }
    }
}

/// Which names the columns of a table get.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum ColumnNames {
    /// As in the file that is exported.
    #[default]
    Original,
    /// Ours where there is one.
    Ours,
}

impl ColumnNames {
    /// A name a column; a name that comes twice gets a number.
    pub(super) fn of(self, heads: &[Head]) -> Vec<String> {
        let mut names: Vec<String> = Vec::with_capacity(heads.len());
        let mut taken = std::collections::BTreeSet::from(["time_s".to_owned()]);
        for head in heads {
            let name = match (&head.name, self) {
                (Some(name), Self::Ours) => name,
                _ => &head.original,
            };
            let mut free = name.clone();
            let mut number = 2_u32;
            while !taken.insert(free.clone()) {
                free = format!("{name} ({number})");
                number += 1;
            }
            names.push(free);
        }
        names
    }
}

/// What went into a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Written {
    /// Rows of a table, messages of a recording, records of a session.
    pub rows: u64,
    /// Columns with the time; topics of a recording; signals of a session.
    pub columns: usize,
    /// Size of the file.
    pub bytes: u64,
}

/// What an export did.
#[derive(Clone, Debug, Default)]
pub struct ExportOutcome {
    /// What was written.
    pub written: Written,
    /// Where the trace came from.
    pub origin: Origin,
    /// What the import repaired or is not sure of.
    pub notes: Vec<Diagnostic>,
}

/// Turns a trace into another form.
pub fn export_trace(
    input: &Path,
    form: ExportForm,
    names: ColumnNames,
    options: &ImportOptions,
    output: &Path,
) -> Result<ExportOutcome, Diagnostic> {
    let source = Source::open(input, options.progress)?;
    let format = source.format()?;
    let from_recording = format == TraceFormat::Recording;
    if from_recording {
        source.refuse_packed()?;
    }
    let everything = names == ColumnNames::Original && options.only.is_empty();
    if from_recording && form == ExportForm::Recording {
        let message = format!("{} is a recording already", source.shown);
        return Err(Diagnostic::error("T0020", message).help("export it to .csv, .parquet or .xml"));
    }
    if from_recording && form == ExportForm::Csv && everything && is_simulated(&Recording::open(input)?) {
        // The recorder's own table: text, faster.
        let report = crate::recorder::export(&Recording::open(input)?, output)?;
        let written = Written { rows: report.rows, columns: report.columns, bytes: report.bytes };
        return Ok(ExportOutcome { written, origin: recording_origin(), notes: Vec::new() });
    }
    let (file, target) = WholeFile::create(output)?;
    let job = Job { source: &source, input, format, options };
    let (target, mut outcome) = match form {
        ExportForm::Csv => job.table(target, names)?,
        ExportForm::Parquet => job.parquet(target, names)?,
        ExportForm::Recording => job.recording(target)?,
        ExportForm::OperateXml => job.operate(target)?,
    };
    outcome.written.bytes = file.commit(target)?;
    Ok(outcome)
}

/// A recording of a run, not of an imported trace.
fn is_simulated(recording: &Recording) -> bool {
    recording.metadata(TRACE_METADATA).is_none()
}

fn recording_origin() -> Origin {
    let format = TraceFormat::Recording;
    Origin { format, description: format.title().to_owned(), start_utc: None }
}

/// A trace to be read.
struct Job<'a> {
    source: &'a Source<'a>,
    input: &'a Path,
    format: TraceFormat,
    options: &'a ImportOptions<'a>,
}

type Done = Result<(Target, ExportOutcome), Diagnostic>;

impl Job<'_> {
    /// Every row of the trace.
    fn rows(&self, sink: &mut dyn Sink) -> Result<About, Diagnostic> {
        if self.format != TraceFormat::Recording {
            return match self.options.only.is_empty() {
                true => read_rows(self.source, self.format, self.options, sink),
                false => self.chosen(sink),
            };
        }
        if self.options.only.is_empty() {
            stream_recording(&Recording::open(self.input)?, sink)?;
            return Ok(About { origin: recording_origin(), ..About::default() });
        }
        self.chosen(sink)
    }

    /// A choice of signals: through memory.
    fn chosen(&self, sink: &mut dyn Sink) -> Result<About, Diagnostic> {
        let trace = self.imported()?;
        stream_trace(&trace, sink)?;
        Ok(About { origin: trace.origin, metadata: trace.metadata, notes: trace.notes })
    }

    /// The trace with the signals that are asked for; a name that is none of its signals is said.
    fn imported(&self) -> Result<Trace, Diagnostic> {
        let mut trace = import(self.input, self.options)?;
        let is_there = |name: &String| {
            let has = |signal: &Signal| signal.axis_signal().is_some_and(|own| own.stem() == name);
            trace.signals.iter().any(|signal| signal.is_named(name) || has(signal))
        };
        let missing: Vec<&str> = self.options.only.iter().filter(|name| !is_there(name)).map(String::as_str).collect();
        if missing.is_empty() {
            return Ok(trace);
        }
        let message = format!("{} has no signal {}", self.source.shown, missing.join(", "));
        let help = "the names are those of the columns of a whole export, ours, or a field such as following_error";
        if trace.signals.is_empty() {
            return Err(Diagnostic::error("T0019", message).help(help));
        }
        trace.notes.push(Diagnostic::warning("T0019", message).help(help));
        Ok(trace)
    }

    fn table(&self, target: Target, names: ColumnNames) -> Done {
        let mut table = Table::new(BufWriter::with_capacity(256 * 1024, target), names);
        let about = self.rows(&mut table)?;
        let (buffered, written) = table.finish();
        let target = buffered.into_inner().map_err(|error| output_fault(error.error()))?;
        Ok((target, outcome(about, written)))
    }

    #[cfg(feature = "parquet")]
    fn parquet(&self, target: Target, names: ColumnNames) -> Done {
        let mut table = super::parquet_table::ParquetTable::new(target, names);
        let about = self.rows(&mut table)?;
        let (target, written) = table.finish()?;
        Ok((target, outcome(about, written)))
    }

    #[cfg(not(feature = "parquet"))]
    fn parquet(&self, _: Target, _: ColumnNames) -> Done {
        let finding = Diagnostic::error("T0020", "this sollwert was built without Parquet");
        Err(finding.help("build it with the feature `parquet`, or export to .csv"))
    }

    fn recording(&self, target: Target) -> Done {
        let mut recording = ToRecording::new(target, &self.source.shown);
        let about = self.rows(&mut recording)?;
        let (target, written) = recording.finish(&about)?;
        Ok((target, outcome(about, written)))
    }

    fn operate(&self, target: Target) -> Done {
        let trace = self.imported()?;
        let mut buffered = BufWriter::with_capacity(256 * 1024, target);
        let mut notes = trace.notes.clone();
        let written = write_operate(&trace, self.options, &mut buffered, &mut notes)?;
        buffered.flush().map_err(|error| output_fault(&error))?;
        let target = buffered.into_inner().map_err(|error| output_fault(error.error()))?;
        Ok((target, ExportOutcome { written, origin: trace.origin, notes }))
    }
}

fn outcome(about: About, written: Written) -> ExportOutcome {
    ExportOutcome { written, origin: about.origin, notes: about.notes }
}

/// The output cannot be written.
pub(super) fn output_fault(error: &io::Error) -> Diagnostic {
    Diagnostic::error("R0004", format!("the output cannot be written: {error}"))
        .help("make room or choose another place")
}
