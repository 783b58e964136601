//! `sollwert export`: a recording as CSV.
//!
//! In: a recording. Out: a CSV on the disk, complete or not there at all. Does not resample or convert units.

use super::failure::Failure;
use super::inputs::refuse_same_file;
use super::output::{print, print_json};
use crate::base::Diagnostic;
use crate::recorder::{ExportReport, Recording, export as export_recording};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Example:\n  sollwert export part.mcap -o part.csv")]
pub(super) struct ExportArguments {
    /// Recording
    recording: PathBuf,
    /// File to write; .csv (.parquet is not built yet)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn export(arguments: &ExportArguments) -> Result<(), Failure> {
    refuse_same_file([arguments.recording.as_path()], &arguments.output)?;
    if !arguments.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) {
        let message = format!("`{}` is not a .csv file; other formats are not built yet", arguments.output.display());
        let finding = Diagnostic::error("C0002", message).help("give -o a name that ends in .csv");
        return Err(Failure::unreadable(finding));
    }
    let report = Recording::open(&arguments.recording)
        .and_then(|recording| export_recording(&recording, &arguments.output))
        .map_err(Failure::unreadable)?;
    let output = arguments.output.display();
    if arguments.json {
        let ExportReport { rows, columns, bytes } = report;
        print_json(
            &json!({"format": 1, "output": output.to_string(), "rows": rows, "columns": columns, "bytes": bytes}),
        )
    } else {
        print(&format!("{} rows of {} columns: {output}\n", report.rows, report.columns))
    }
}
