//! `sollwert machine import` and `machine export`: SINUMERIK machine data in and out.
//!
//! In: listings, archives; or a machine. Out: a machine file and where each value comes from; or a listing. Converts nothing itself.

use super::failure::Failure;
use super::inputs::{refuse_same_file, refused};
use super::output::{print, print_json, show, table};
use crate::base::Diagnostic;
use crate::kernel::Warning;
use crate::machine::{
    AxisChoice, ImportOptions, Imported, ListingFile, Origin, Sourced, export_listing, import_listing, load,
};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Largest file: archives with all cycles and pictures stay well below.
const FILE_BYTES_MAX: u64 = 1 << 29;
/// Rows of data not used that a person wants to see.
const UNKNOWN_SHOWN: usize = 12;

#[derive(Args)]
#[command(after_help = "Example:
  sollwert machine import NC.arc -o my_machine.toml
  sollwert machine import initial.ini drives.tea --drive X=PS000011 -m spinner_mvc850 -o my_machine.toml

Reads listings (N32300 $MA_MAX_AX_ACCEL[0,AX1]=6), drive parameters (p1460[0]=5) and archives (@@MMCIBN).
Every line of the new file says where its value comes from; what was assumed is a warning.")]
pub(super) struct ImportArguments {
    /// Listings and archives; of a datum that stands twice the last one counts
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Machine that fills what the data do not say: a file, or the name of a shipped one
    #[arg(short, long, value_name = "MACHINE")]
    machine: Option<String>,
    /// Name of an axis in programs, such as AX1=X; takes a spindle or gantry axis, too; may be given several times
    #[arg(long = "axis", value_name = "THEIRS=OURS")]
    axes: Vec<String>,
    /// Drive object of an axis by its name or its member, such as X=PS000011; may be given several times
    #[arg(long = "drive", value_name = "AXIS=OBJECT")]
    drives: Vec<String>,
    /// Name of the machine
    #[arg(long, value_name = "TEXT")]
    name: Option<String>,
    /// Machine file to write; without it the text goes to stdout
    #[arg(short, long, value_name = "MACHINE.toml")]
    output: Option<PathBuf>,
    /// One JSON document on stdout: the text, and the source of every value
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Args)]
#[command(after_help = "Example:
  sollwert machine export my_machine.toml -o my_machine.ini

What no machine datum holds stands behind the data in comments, so that `machine import` brings all of it back.")]
pub(super) struct ExportArguments {
    /// Machine file, or the name of a shipped machine
    machine: String,
    /// Change one value first, such as axes.X.drive.velocity_feedforward=0.95
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Listing to write; without it the text goes to stdout
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// One JSON document on stdout, with the text in it
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn import(arguments: &ImportArguments) -> Result<(), Failure> {
    if let Some(output) = &arguments.output {
        refuse_same_file(arguments.files.iter().map(PathBuf::as_path), output)?;
    }
    let files = arguments.files.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
    let base = match &arguments.machine {
        Some(name) => {
            let loaded = load(name, &[]).map_err(refused)?;
            Some((loaded.name.to_string(), loaded.text_as_used))
        }
        None => None,
    };
    let stem =
        arguments.output.as_ref().and_then(|path| path.file_stem()).map(|stem| stem.to_string_lossy().into_owned());
    let options = ImportOptions {
        axes: pairs(&arguments.axes, "--axis", false)?,
        drives: pairs(&arguments.drives, "--drive", true)?,
        name: arguments.name.clone(),
        stand_in: stem.filter(|_| base.is_none()),
        base,
    };
    let imported = import_listing(&files, &options).map_err(|findings| {
        let unreadable = findings.iter().all(|finding| matches!(finding.code, "M0301" | "M0302" | "M0303"));
        if unreadable { Failure::wrong_usage(findings) } else { Failure::found_wrong(findings) }
    })?;
    show(&imported.warnings);
    if let Some(output) = &arguments.output {
        write(output, &imported.text)?;
    }
    if arguments.json {
        print_json(&document(&imported))
    } else if let Some(output) = &arguments.output {
        print(&overview(&imported, output))
    } else {
        print(&imported.text)
    }
}

pub(super) fn export(arguments: &ExportArguments) -> Result<(), Failure> {
    let loaded = load(&arguments.machine, &arguments.sets).map_err(refused)?;
    show(&loaded.warnings);
    let text = export_listing(&loaded);
    if let Some(output) = &arguments.output {
        refuse_same_file([Path::new(&arguments.machine)], output)?;
        write(output, &text)?;
    }
    match (&arguments.output, arguments.json) {
        (_, true) => print_json(&json!({"format": 1, "machine": loaded.machine.name, "text": text})),
        (Some(output), false) => {
            let data = text.lines().filter(|line| line.contains('=') && !line.starts_with(';')).count();
            print(&format!("{}: {data} machine data and drive parameters\n", output.display()))
        }
        (None, false) => print(&text),
    }
}

/// `THEIRS=OURS`, or the other way round.
fn pairs(texts: &[String], option: &str, turned: bool) -> Result<Vec<AxisChoice>, Failure> {
    let pair = |text: &String| match text.split_once('=') {
        Some((one, other)) if !one.trim().is_empty() && !other.trim().is_empty() => {
            let (theirs, ours) = if turned { (other, one) } else { (one, other) };
            Ok(AxisChoice { theirs: theirs.trim().to_owned(), ours: ours.trim().to_owned() })
        }
        _ => {
            let finding = Diagnostic::error("C0002", format!("`{option} {text}`: there is no name on both sides of ="));
            Err(Failure::unreadable(finding.help("write --axis AX1=X, or --drive X=PS000011")))
        }
    };
    texts.iter().map(pair).collect()
}

fn read(path: &Path) -> Result<ListingFile, Failure> {
    let unreadable = |reason: String| {
        let message = format!("`{}` cannot be read: {reason}", path.display());
        Failure::unreadable(Diagnostic::error("M0301", message).help("name a listing of machine data, or an archive"))
    };
    let size = std::fs::metadata(path).map_err(|error| unreadable(error.to_string()))?.len();
    if size > FILE_BYTES_MAX {
        return Err(unreadable(format!("{size} bytes are no machine data")));
    }
    let bytes = std::fs::read(path).map_err(|error| unreadable(error.to_string()))?;
    let name = path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
    Ok(ListingFile { name, bytes })
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(|error| {
        let finding = Diagnostic::error("C0004", format!("`{}` cannot be written: {error}", path.display()));
        Failure::unreadable(finding.help("choose another place with -o"))
    })
}

fn count(imported: &Imported, origins: &[Origin]) -> usize {
    imported.values.values().filter(|value| origins.contains(&value.origin)).count()
}

/// Where the values come from, and what was left.
fn overview(imported: &Imported, output: &Path) -> String {
    let mut text = format!("{}\n", output.display());
    let rows = [
        ("from machine data and drive parameters", &[Origin::Datum][..]),
        ("derived from such by a rule", &[Origin::Derived]),
        ("from comments of the listing", &[Origin::Carried]),
        ("from the other machine", &[Origin::Base]),
        ("assumed", &[Origin::Assumed]),
    ];
    let rows: Vec<Vec<String>> = rows
        .iter()
        .map(|(words, origins)| vec![format!("keys {words}"), count(imported, origins).to_string()])
        .filter(|row| row[1] != "0")
        .collect();
    text += &table(&rows);
    let left: usize = imported.unknown.iter().map(|unknown| unknown.count).sum();
    if left > 0 {
        text += &format!("{left} assignments of {} data have no counterpart; most often:\n", imported.unknown.len());
        let shown: Vec<Vec<String>> = imported
            .unknown
            .iter()
            .take(UNKNOWN_SHOWN)
            .map(|unknown| vec![unknown.datum.clone(), unknown.count.to_string()])
            .collect();
        text += &table(&shown);
    }
    text
}

fn document(imported: &Imported) -> serde_json::Value {
    let word = |origin: Origin| match origin {
        Origin::Datum => "datum",
        Origin::Carried => "comment",
        Origin::Derived => "derived",
        Origin::Base => "machine",
        Origin::Assumed => "assumed",
    };
    let value = |(key, sourced): (&String, &Sourced)| json!({"key": key, "value": sourced.value, "origin": word(sourced.origin), "source": sourced.source});
    let unknown = |unknown: &crate::machine::Unknown| json!({"datum": unknown.datum, "count": unknown.count});
    json!({
        "format": 1,
        "machine": imported.loaded.machine.name,
        "values": imported.values.iter().map(value).collect::<Vec<_>>(),
        "unknown": imported.unknown.iter().map(unknown).collect::<Vec<_>>(),
        "warnings": imported.warnings.iter().map(Warning::from).collect::<Vec<_>>(),
        "text": imported.text,
    })
}
