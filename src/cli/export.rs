//! `sollwert export`: any importable trace as CSV, Parquet, a recording or an Operate session.
//!
//! In: a trace of any known format. Out: a file on the disk, complete or not there at all; what the import repaired or is not sure
//! of on stderr. Does not resample.

use super::failure::Failure;
use super::inputs::{TraceReading, refuse_same_file};
use super::output::{print, print_json, show};
use crate::base::Diagnostic;
use crate::kernel::Warning;
use crate::trace::{ColumnNames, ExportForm, ExportOutcome, Written, export_trace};
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  sollwert export part.mcap -o part.csv
  sollwert export trace.xml --axis-name 7=A -o trace.parquet
  sollwert export part.mcap -m spinner_mvc850 -o part.xml      for the viewer of the control

The format of the trace is found by its content: recordings, SINUMERIK Operate traces, Edge / Data
Recorder JSON (also zipped), CSV of any dialect, TwinCAT Scope CSV, LinuxCNC halscope and halsampler.")]
pub(super) struct ExportArguments {
    /// Recording, or trace of a control
    trace: PathBuf,
    /// File to write: .csv, .parquet, .mcap or .xml
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// What to write, where the ending of the name does not say it
    #[arg(long = "as", value_enum, value_name = "FORM")]
    form: Option<FormChoice>,
    /// Names of the columns: as in the trace, or ours where there is one
    #[arg(long, value_enum, default_value = "original")]
    names: NamesChoice,
    /// Signals to export, such as X.position_setpoint_mm,following_error; default: all
    #[arg(long, value_name = "SIGNALS", value_delimiter = ',')]
    signals: Vec<String>,
    #[command(flatten)]
    reading: TraceReading,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum FormChoice {
    Csv,
    Parquet,
    Mcap,
    OperateXml,
}

#[derive(Clone, Copy, ValueEnum)]
enum NamesChoice {
    Original,
    Ours,
}

impl ExportArguments {
    fn form(&self) -> Result<ExportForm, Failure> {
        match self.form {
            Some(FormChoice::Csv) => Ok(ExportForm::Csv),
            Some(FormChoice::Parquet) => Ok(ExportForm::Parquet),
            Some(FormChoice::Mcap) => Ok(ExportForm::Recording),
            Some(FormChoice::OperateXml) => Ok(ExportForm::OperateXml),
            None => ExportForm::by_ending(&self.output).ok_or_else(|| {
                let message = format!("`{}` does not say what to write", self.output.display());
                let help = "give -o a name that ends in .csv, .parquet, .mcap or .xml, or use --as";
                Failure::unreadable(Diagnostic::error("C0002", message).help(help))
            }),
        }
    }
}

pub(super) fn export(arguments: &ExportArguments) -> Result<(), Failure> {
    let form = arguments.form()?;
    refuse_same_file([arguments.trace.as_path()], &arguments.output)?;
    let names = match arguments.names {
        NamesChoice::Original => ColumnNames::Original,
        NamesChoice::Ours => ColumnNames::Ours,
    };
    let outcome = arguments.reading.with_options(&arguments.signals, |options| {
        export_trace(&arguments.trace, form, names, options, &arguments.output).map_err(Failure::unreadable)
    })?;
    report(&outcome, arguments)
}

fn report(outcome: &ExportOutcome, arguments: &ExportArguments) -> Result<(), Failure> {
    show(&outcome.notes);
    let output = arguments.output.display();
    let Written { rows, columns, bytes } = outcome.written;
    if arguments.json {
        let warnings: Vec<Warning> = outcome.notes.iter().map(Warning::from).collect();
        return print_json(&json!({
            "format": 1,
            "source": outcome.origin.description,
            "output": output.to_string(),
            "rows": rows,
            "columns": columns,
            "bytes": bytes,
            "warnings": warnings,
        }));
    }
    print(&format!("{rows} rows of {columns} columns: {output}\n"))
}
