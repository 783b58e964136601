//! The door: finds out what a file is by its content and calls the importer.
//!
//! In: a path, [`ImportOptions`]. Out: a [`Trace`] in memory, or its rows one after another for a sink. Errors say what the file is
//! taken for and what is wrong with it. Does not look at the ending of the name.

use super::csv::read_csv;
use super::edge::read_edge;
use super::measuring::read_measuring;
use super::operate::read_operate;
use super::recording::import_recording;
use super::scope::{read_halsampler, read_halscope};
use super::sink::{Memory, Sink};
use super::source::{Progress, Source};
use super::twincat::read_twincat;
use super::wire::{AxisSignal, Origin, Trace, TraceFormat};
use crate::base::Diagnostic;
use crate::machine::Machine;
use crate::recorder::Recording;
use std::collections::BTreeMap;
use std::path::Path;

/// What the user says about a trace.
#[derive(Clone, Debug, Default)]
pub struct ImportOptions<'a> {
    /// Names and kinds of the axes behind the numbers that a control writes (`index`, `machine_axis`).
    pub machine: Option<&'a Machine>,
    /// `--axis-name 7=A`: number of the machine axis, and its name. Comes before the machine.
    pub axis_names: Vec<(u32, String)>,
    /// `--map CONTROLLER=OURS`: more rows for the signal map. They come before the built-in ones.
    pub signal_map: Vec<(String, String)>,
    /// `--time NAME`: the time column of a CSV.
    pub time_column: Option<String>,
    /// Signals to keep, by any of their names or by field without axis (`position_setpoint`); empty keeps all. A long recording
    /// with all its signals does not fit into memory.
    pub only: Vec<String>,
    /// Keep what the program asks of the path as well, of a recording.
    pub programmed: bool,
    /// Told how far the reading is.
    pub progress: Progress<'a>,
}

impl ImportOptions<'_> {
    /// Whether a signal of ours is asked for.
    pub(super) fn wants(&self, name: &str) -> bool {
        let signal = AxisSignal::parse(name);
        let fits = |only: &String| {
            only == name || signal.is_some_and(|signal| only == signal.stem() || *only == signal.name_without_unit())
        };
        self.only.is_empty() || self.only.iter().any(fits)
    }
}

/// What an importer knows of a trace besides its rows.
#[derive(Debug, Default)]
pub(super) struct About {
    pub(super) origin: Origin,
    pub(super) metadata: BTreeMap<String, BTreeMap<String, String>>,
    pub(super) notes: Vec<Diagnostic>,
}

/// Reads a trace of any known format into memory.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Trace, Diagnostic> {
    let source = Source::open(path, options.progress)?;
    let format = source.format()?;
    if format == TraceFormat::Recording {
        source.refuse_packed()?;
        return import_recording(&Recording::open(path)?, options);
    }
    let mut memory = Memory::new(&options.only);
    let about = read_rows(&source, format, options, &mut memory)?;
    let (signals, mut events) = memory.finish();
    events.sort_by(|one, other| one.time_s.total_cmp(&other.time_s));
    Ok(Trace {
        name: source.shown.clone(),
        origin: about.origin,
        signals,
        events,
        metadata: about.metadata,
        notes: about.notes,
        ..Trace::default()
    })
}

/// Reads a trace of any format but a recording, row by row.
pub(super) fn read_rows(
    source: &Source,
    format: TraceFormat,
    options: &ImportOptions,
    sink: &mut dyn Sink,
) -> Result<About, Diagnostic> {
    let mut about = match format {
        TraceFormat::OperateXml => read_operate(source, 0, options, sink)?,
        TraceFormat::EdgeJson => read_edge(source, options, sink)?,
        TraceFormat::Csv => read_csv(source, 0, options, sink)?,
        TraceFormat::TwinCatCsv => read_twincat(source, 0, options, sink)?,
        TraceFormat::Halscope => read_halscope(source, 0, options, sink)?,
        TraceFormat::Halsampler => read_halsampler(source, 0, options, sink)?,
        TraceFormat::MeasuringXml => read_measuring(source, 0, options, sink)?,
        TraceFormat::Recording => {
            let message = format!("{} is a recording, which is not read row by row", source.shown);
            return Err(Diagnostic::error("T0018", message).help("name the recording itself"));
        }
    };
    if source.part_count() > 1 && format != TraceFormat::EdgeJson {
        let message = format!("only `{}` is read of {} files", source.part_name(0), source.part_count());
        about.notes.push(Diagnostic::warning("T0018", message).help("unpack them, and read them one by one"));
    }
    Ok(about)
}
