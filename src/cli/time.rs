//! `sollwert time`: set-points only, no recording.
//!
//! In: programs, machine. Out: figures as tables or one JSON document. Does not simulate drives.

use super::failure::Failure;
use super::inputs::{MachineChoice, Surroundings};
use super::output::{ProgressLine, print, print_json, show};
use super::run::{Style, figures_text};
use crate::kernel::{self, RunOptions, RunOutcome};
use crate::machine::Loaded;
use crate::recorder::SignalChoice;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Example:\n  sollwert time op10.mpf op20.mpf -m spinner_mvc850 --json")]
pub(super) struct TimeArguments {
    /// NC programs
    #[arg(required = true)]
    programs: Vec<PathBuf>,
    #[command(flatten)]
    machine: MachineChoice,
    #[command(flatten)]
    surroundings: Surroundings,
    /// Threads: 1 runs preparation inside the cycle; the result is the same
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..))]
    threads: u16,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn time(arguments: &TimeArguments) -> Result<(), Failure> {
    let machine = arguments.machine.load_to_run()?;
    let mut documents = Vec::new();
    let mut alarmed = false;
    for program in &arguments.programs {
        let outcome = one(program, &machine, arguments)?;
        show(&outcome.warnings);
        if let Some(alarm) = &outcome.alarm {
            show([alarm]);
            alarmed = true;
        }
        if arguments.json {
            documents.push(serde_json::to_value(&outcome.summary).unwrap_or_else(|_| json!({})));
        } else {
            print(&figures_text(&outcome.summary, &Style { json: false, drives: false }))?;
            print("\nwithout waits for the axes to be in position: `sollwert run` simulates the drives\n")?;
        }
    }
    if arguments.json {
        match documents.as_slice() {
            [one] => print_json(one)?,
            many => print_json(&json!({"format": 1, "programs": many}))?,
        }
    }
    if alarmed { Err(Failure::told()) } else { Ok(()) }
}

fn one(path: &Path, machine: &Loaded, arguments: &TimeArguments) -> Result<RunOutcome, Failure> {
    let setup = arguments.surroundings.open(path, &machine.machine)?;
    let options = RunOptions {
        machine,
        setup,
        drives: false,
        recording: None,
        mantissa_bits: None,
        signals: SignalChoice::all(),
        threads: arguments.threads.into(),
        pace_ratio: None,
    };
    let mut line = ProgressLine::new();
    let outcome =
        kernel::run(options, &mut |at| line.update(|| format!("{:.1} s simulated, {} blocks", at.time_s, at.blocks)));
    outcome.map_err(|error| Failure::unreadable(error.0))
}
