//! `sollwert compare`: two traces, aligned; figures per signal and in space.
//!
//! In: two traces of any known format, options. Out: tables or JSON, with `-o` a page with both; exit code 1 where a limit does not hold.
//! Does not compute any figure.

use super::compare_tables::tables;
use super::failure::Failure;
use super::inputs::{axis_name, refuse_same_file, refused};
use super::output::{ProgressLine, print, print_json, show};
use super::report::signals_of_file;
use crate::base::units::percent_from_ratio;
use crate::base::{Diagnostic, SourceText};
use crate::compare::{
    CompareOptions, LimitCheck, check_limits, compare as compare_traces, document, parse_limit, prepare,
};
use crate::machine::{self, Machine};
use crate::recorder::Recording;
use crate::report::{self, Sheet};
use crate::trace::{ImportOptions, Progress, Trace, import};
use clap::Args;
use serde_json::json;
use std::cell::RefCell;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  sollwert compare machine.xml simulated.mcap --axis-name 7=A -o report.html
  sollwert compare new.mcap old.mcap --limit contour_error_max_mm=0.002 --limit X.position_setpoint_mm.max=0.005")]
pub(super) struct CompareArguments {
    /// Trace: a recording, or what a control exported
    trace: PathBuf,
    /// What it is held against
    reference: PathBuf,
    #[command(flatten)]
    reading: Reading,
    /// Signal A of the trace with signal B of the reference; may be given several times
    #[arg(long = "map", value_name = "A=B")]
    maps: Vec<String>,
    /// Limit of a figure, such as X.position_setpoint_mm.max=0.005 or contour_error_max_mm=0.01; exit code 1 where it is exceeded
    #[arg(long = "limit", value_name = "NAME=VALUE")]
    limits: Vec<String>,
    /// Take this offset (reference time - trace time) instead of looking for it
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    offset: Option<f64>,
    /// Fit a drift of the two clocks as well
    #[arg(long)]
    drift: bool,
    /// Plane of the contour error in a plane: XY, ZX or YZ
    #[arg(long, value_name = "PLANE")]
    plane: Option<String>,
    /// Say where the errors come from: chords of the program, interpolator, drives
    #[arg(long)]
    budget: bool,
    /// Take the mean off every difference: the zeros are known to differ
    #[arg(long)]
    without_bias: bool,
    /// Page with plots and tables to write
    #[arg(short, long, value_name = "REPORT.html")]
    output: Option<PathBuf>,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

/// How traces are read.
#[derive(Args)]
pub(super) struct Reading {
    /// Machine file or shipped machine: names of the axes behind the numbers of a control; default: that of the recording
    #[arg(short, long, value_name = "MACHINE")]
    machine: Option<String>,
    /// Name of a machine axis by its number; may be given several times
    #[arg(long = "axis-name", value_name = "7=A")]
    axis_names: Vec<String>,
    /// Time column of a CSV
    #[arg(long, value_name = "NAME")]
    time: Option<String>,
}

impl Reading {
    /// The machine that names the axes: that of `-m`, or that of a recording among the files.
    pub(super) fn machine(&self, files: &[&Path]) -> Result<Option<Machine>, Failure> {
        if let Some(name) = &self.machine {
            return Ok(Some(machine::load(name, &[]).map_err(refused)?.machine));
        }
        let texts = files.iter().filter_map(|path| Recording::open(path).ok()?.machine_text().ok()?);
        let machine = |(name, text): (String, String)| machine::parse(&SourceText::new(name, text), &[]).ok();
        Ok(texts.into_iter().find_map(machine).map(|loaded| loaded.machine))
    }

    /// Options of the import.
    pub(super) fn options<'a>(&self, machine: Option<&'a Machine>) -> Result<ImportOptions<'a>, Failure> {
        let axis_names = self.axis_names.iter().map(|text| axis_name(text)).collect::<Result<_, _>>()?;
        Ok(ImportOptions { machine, axis_names, time_column: self.time.clone(), ..ImportOptions::default() })
    }

    /// Reads a trace, or only some signals of it, and shows what the import has to say.
    pub(super) fn import(&self, path: &Path, machine: Option<&Machine>, only: Vec<String>) -> Result<Trace, Failure> {
        let line = RefCell::new(ProgressLine::new());
        let tell = |done: u64, total: u64| {
            let share_percent = percent_from_ratio(done as f64 / total.max(1) as f64);
            line.borrow_mut().update(|| format!("{}: {share_percent:.0} % read", path.display()));
        };
        let options =
            ImportOptions { only, programmed: true, progress: Progress(Some(&tell)), ..self.options(machine)? };
        let trace = import(path, &options).map_err(Failure::unreadable)?;
        show(&trace.notes);
        Ok(trace)
    }
}

pub(super) fn compare(arguments: &CompareArguments) -> Result<(), Failure> {
    let files = [arguments.trace.as_path(), arguments.reference.as_path()];
    if let Some(output) = &arguments.output {
        refuse_same_file(files, output)?;
    }
    let rules = arguments.limits.iter().map(|text| parse_limit(text).map_err(Failure::unreadable));
    let rules = rules.collect::<Result<Vec<_>, _>>()?;
    let options = CompareOptions {
        map: arguments.maps.iter().map(|text| parse_map(text)).collect::<Result<_, _>>()?,
        drift: arguments.drift,
        offset_s: arguments.offset,
        plane: arguments.plane.clone(),
        without_bias: arguments.without_bias,
        budget: arguments.budget || arguments.output.is_some(),
    };
    let machine = arguments.reading.machine(&files)?;
    // Of a recording that does not fit into memory, those that --map names are read whatever else there is.
    let only = |file, mapped: Vec<&String>| -> Result<Vec<String>, Failure> {
        let mut only = signals_of_file(file)?;
        if !only.is_empty() {
            only.extend(mapped.into_iter().cloned());
        }
        Ok(only)
    };
    let mapped = [options.map.iter().map(|pair| &pair.0).collect(), options.map.iter().map(|pair| &pair.1).collect()];
    let [of_trace, of_reference] = mapped;
    let mut trace = arguments.reading.import(files[0], machine.as_ref(), only(files[0], of_trace)?)?;
    let mut reference = arguments.reading.import(files[1], machine.as_ref(), only(files[1], of_reference)?)?;
    prepare(&mut trace);
    prepare(&mut reference);
    let comparison = compare_traces(&trace, &reference, &options).map_err(Failure::unreadable)?;
    show(&comparison.notes);
    let mut document = document(&comparison);
    let checks = check_limits(&document, &rules).map_err(Failure::unreadable)?;
    if arguments.json {
        if !checks.is_empty() {
            document["limits"] = checks.iter().map(check_json).collect();
        }
        if let Some(output) = &arguments.output {
            document["report"] = json!(output.display().to_string());
        }
        print_json(&document)?;
    } else {
        print(&tables(&comparison, &checks, &trace))?;
    }
    if let Some(output) = &arguments.output {
        let sheet = Sheet { trace: &trace, side: &comparison.sides[0], reference: Some((&reference, &comparison)) };
        let bytes = report::write(&sheet, output).map_err(Failure::unreadable)?;
        if !arguments.json {
            print(&format!("\npage of {:.1} MB: {}\n", bytes as f64 / 1e6, output.display()))?;
        }
    }
    if checks.iter().all(LimitCheck::holds) { Ok(()) } else { Err(Failure::told()) }
}

fn check_json(check: &LimitCheck) -> serde_json::Value {
    json!({"name": check.rule.name, "limit": check.rule.value, "value": check.found, "holds": check.holds()})
}

fn parse_map(text: &str) -> Result<(String, String), Failure> {
    // Names of signals may hold `=`, though none that is known does: the first one parts.
    let parts = text.split_once('=').map(|(a, b)| (a.trim().to_owned(), b.trim().to_owned()));
    parts.filter(|(a, b)| !a.is_empty() && !b.is_empty()).ok_or_else(|| {
        let finding = Diagnostic::error("T0110", format!("`--map {text}` is not A=B"));
        Failure::unreadable(finding.help("write a signal of the trace, `=`, and a signal of the reference"))
    })
}
