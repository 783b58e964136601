//! `sollwert report`: a trace as a page to look at.
//!
//! In: a trace of any known format. Out: one HTML file that needs nothing else. Does not compute figures.

use super::compare::Reading;
use super::failure::Failure;
use super::inputs::refuse_same_file;
use super::output::{print, print_json};
use crate::base::Diagnostic;
use crate::compare::{examine, prepare};
use crate::report::{self, Sheet};
use crate::trace::{ImportOptions, Trace, import};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  sollwert report spline.mcap -o spline.html
  sollwert report trace.xml --axis-name 7=A")]
pub(super) struct ReportArguments {
    /// Trace: a recording, or what a control exported
    trace: PathBuf,
    #[command(flatten)]
    reading: Reading,
    /// Page to write; default: the name of the trace with .html, in the current folder
    #[arg(short, long, value_name = "REPORT.html")]
    output: Option<PathBuf>,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn report(arguments: &ReportArguments) -> Result<(), Failure> {
    let name = arguments.trace.file_name().unwrap_or_else(|| "report".as_ref());
    let output = arguments.output.clone().unwrap_or_else(|| PathBuf::from(name).with_extension("html"));
    refuse_same_file([arguments.trace.as_path()], &output)?;
    let machine = arguments.reading.machine(&[&arguments.trace])?;
    let trace = arguments.reading.import(&arguments.trace, machine.as_ref())?;
    let bytes = write(trace, &output)?;
    if arguments.json {
        return print_json(&json!({"format": 1, "output": output.display().to_string(), "bytes": bytes}));
    }
    print(&format!("page of {:.1} MB: {}\n", bytes as f64 / 1e6, output.display()))
}

fn write(mut trace: Trace, output: &Path) -> Result<u64, Failure> {
    if trace.signals.iter().all(|signal| signal.is_empty()) {
        let finding = Diagnostic::error("T0109", format!("{} holds no sample: there is nothing to draw", trace.name));
        return Err(Failure::unreadable(finding.help("was the recording interrupted before its first second?")));
    }
    prepare(&mut trace);
    let side = examine(&trace, None).map_err(Failure::unreadable)?;
    report::write(&Sheet { trace: &trace, side: &side, reference: None }, output).map_err(Failure::unreadable)
}

/// The page of a recording that has just been written: it is read back.
pub(super) fn write_of_recording(recording: &Path, output: &Path) -> Result<u64, Failure> {
    write(import(recording, &ImportOptions::default()).map_err(Failure::unreadable)?, output)
}
