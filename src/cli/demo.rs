//! `sollwert demo`: a program and a machine to look at, written into a folder, and run.

use super::failure::Failure;
use super::inputs::{open_program, refused};
use super::output::print;
use super::run::{Style, report};
use crate::base::Diagnostic;
use crate::feed::OverrideSchedule;
use crate::kernel::{self, RunOptions};
use crate::machine::{DEFAULT_MACHINE, load, shipped};
use crate::recorder::SignalChoice;
use clap::Args;
use std::path::{Path, PathBuf};

/// The program of the demo; inside the binary, so that an installed `sollwert` works in an empty folder.
const PROGRAM: &str = include_str!("../../programs/spline.mpf");

#[derive(Args)]
#[command(after_help = "Example:\n  sollwert demo --folder try")]
pub(super) struct DemoArguments {
    /// Where to write; made if it does not exist. A program or machine that is there already is kept, and run
    #[arg(long, default_value = "sollwert-demo")]
    folder: PathBuf,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn demo(arguments: &DemoArguments) -> Result<(), Failure> {
    let folder = &arguments.folder;
    std::fs::create_dir_all(folder).map_err(|error| refuse(folder, &error))?;
    let machine_text = shipped().iter().find(|(name, _)| *name == DEFAULT_MACHINE).map_or("", |(_, text)| *text);
    let program_path = folder.join("spline.mpf");
    let machine_path = folder.join(format!("{DEFAULT_MACHINE}.toml"));
    write_new(&program_path, PROGRAM)?;
    write_new(&machine_path, machine_text)?;
    let machine = load(&machine_path.to_string_lossy(), &[]).map_err(refused)?;
    let program = open_program(&program_path)?;
    let recording = folder.join("spline.mcap");
    let options = RunOptions {
        machine: &machine,
        setup: program.into(),
        overrides: OverrideSchedule::none(),
        drives: true,
        recording: Some(&recording),
        mantissa_bits: None,
        signals: SignalChoice::all(),
        threads: 2,
        pace_ratio: None,
    };
    let outcome = kernel::run(options, &mut |_| {}).map_err(|error| Failure::unreadable(error.0))?;
    report(&outcome, Some(&recording), &Style { json: arguments.json, drives: true, page: None })?;
    if arguments.json {
        return Ok(());
    }
    print(&format!(
        "\nNow change {} or {} and run again:\n  sollwert run {} -m {} -o {}\n  sollwert export {} -o spline.csv\n",
        program_path.display(),
        machine_path.display(),
        program_path.display(),
        machine_path.display(),
        recording.display(),
        recording.display()
    ))
}

/// Writes a file unless it is there: a user's change is never overwritten.
fn write_new(path: &Path, text: &str) -> Result<(), Failure> {
    if path.exists() {
        return Ok(());
    }
    std::fs::write(path, text).map_err(|error| refuse(path, &error))
}

fn refuse(path: &Path, error: &std::io::Error) -> Failure {
    Failure::unreadable(
        Diagnostic::error("C0003", format!("cannot write `{}`: {error}", path.display()))
            .help("give --folder a folder that you may write to"),
    )
}
