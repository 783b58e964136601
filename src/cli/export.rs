//! `sollwert export`: a recording as CSV.
//!
//! In: a recording. Out: a CSV on the disk, complete or not there at all. Does not resample or convert units.

use super::inputs::refuse_same_file;
use super::output::{print, print_json, show};
use super::{FOUND_WRONG, UNREADABLE};
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
    json: bool,
}

pub(super) fn export(arguments: &ExportArguments) -> Result<(), u8> {
    refuse_same_file(&arguments.recording, &arguments.output)?;
    if !arguments.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) {
        let message = format!("`{}` is not a .csv file; other formats are not built yet", arguments.output.display());
        show([&crate::base::Diagnostic::error("C0002", message).help("give -o a name that ends in .csv")]);
        return Err(UNREADABLE);
    }
    let exported =
        Recording::open(&arguments.recording).and_then(|recording| export_recording(&recording, &arguments.output));
    match exported {
        Ok(report) => {
            let output = arguments.output.display();
            if arguments.json {
                let ExportReport { rows, columns, bytes } = report;
                print_json(
                    &json!({"format": 1, "output": output.to_string(), "rows": rows, "columns": columns, "bytes": bytes}),
                );
            } else {
                print(&format!("{} rows of {} columns: {output}\n", report.rows, report.columns));
            }
            Ok(())
        }
        Err(finding) => {
            show([&finding]);
            Err(if arguments.recording.exists() { FOUND_WRONG } else { UNREADABLE })
        }
    }
}
