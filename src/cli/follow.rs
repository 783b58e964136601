//! `sollwert follow`: the drives alone, fed with given position set-points.
//!
//! In: a CSV or a recording, machine. Out: a recording, figures. Does not plan, interpolate or resample.

use super::failure::Failure;
use super::inputs::{MachineChoice, default_recording, refuse_same_file};
use super::output::{print, print_json, show};
use super::recorded::Recorded;
use crate::base::{Diagnostic, SourceText};
use crate::drive::Start;
use crate::kernel::{FollowOptions, FollowOutcome, SetpointTable, follow as follow_setpoints};
use crate::machine::Loaded;
use crate::recorder::Recording;
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Example:\n  sollwert follow setpoints.csv -m spinner_mvc850 -o followed.mcap

The CSV has a header time_s,X_mm,Y_mm,A_deg ... and one row a position period;
a column X_load_n_m is an outside torque at the motor shaft.")]
pub(super) struct FollowArguments {
    /// Set-points: .csv, or a recording .mcap
    setpoints: PathBuf,
    #[command(flatten)]
    machine: MachineChoice,
    /// Recording to write; default: the name of the set-points with _followed.mcap, in the current folder
    #[arg(short, long, value_name = "TRACE.mcap")]
    output: Option<PathBuf>,
    /// Axes start balanced, or with empty integrators (brake released)
    #[arg(long, value_enum, default_value = "held")]
    start: StartChoice,
    #[command(flatten)]
    recorded: Recorded,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum StartChoice {
    Held,
    Cold,
}

pub(super) fn follow(arguments: &FollowArguments) -> Result<(), Failure> {
    let machine = arguments.machine.load()?;
    let recording = arguments.output.clone().unwrap_or_else(|| {
        let stem = default_recording(&arguments.setpoints).with_extension("");
        PathBuf::from(format!("{}_followed.mcap", stem.display()))
    });
    refuse_same_file([arguments.setpoints.as_path()].into_iter().chain(arguments.machine.path()), &recording)?;
    let signals = arguments.recorded.signals(&machine)?;
    let table = read_setpoints(&arguments.setpoints, &machine)?;
    let options = FollowOptions {
        machine: &machine,
        start: match arguments.start {
            StartChoice::Held => Start::Held,
            StartChoice::Cold => Start::Cold,
        },
        recording: Some(&recording),
        signals,
        mantissa_bits: arguments.recorded.record_precision,
    };
    let outcome = follow_setpoints(&table, &options).map_err(Failure::unreadable)?;
    report(&outcome, &recording, arguments.json)
}

fn report(outcome: &FollowOutcome, recording: &Path, json: bool) -> Result<(), Failure> {
    show(&outcome.warnings);
    if json {
        let mut document = outcome.summary.clone();
        document["recording"] = serde_json::json!(recording.display().to_string());
        print_json(&document)?;
    } else {
        print(&format!("{} rows followed: {}\n", outcome.rows, recording.display()))?;
    }
    match &outcome.alarm {
        Some(alarm) => {
            show([alarm]);
            Err(Failure::told())
        }
        None => Ok(()),
    }
}

/// A CSV, or the position set-points of a recording.
fn read_setpoints(path: &Path, machine: &Loaded) -> Result<SetpointTable, Failure> {
    let name = path.display().to_string();
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap")) {
        let recording = Recording::open(path).map_err(Failure::unreadable)?;
        return SetpointTable::from_recording(&recording, &machine.machine).map_err(Failure::unreadable);
    }
    let bytes = std::fs::read(path)
        .map_err(|error| Failure::unreadable(Diagnostic::error("F0009", format!("cannot read `{name}`: {error}"))))?;
    let text = String::from_utf8(bytes).map_err(|_| {
        Failure::unreadable(
            Diagnostic::error("F0010", format!("`{name}` is not UTF-8 text")).help("save the CSV as UTF-8"),
        )
    })?;
    SetpointTable::from_csv(&SourceText::new(name, text), &machine.machine)
        .map_err(|finding| Failure::found_wrong(vec![finding]))
}
