//! `sollwert follow`: the drives alone, fed with given position set-points.
//!
//! In: a CSV, a recording or the trace of a control, machine. Out: a recording, figures. Does not plan. Set-points of a trace are brought to the
//! position cycle by straight lines; those of a CSV or a recording must have it already.

use super::failure::Failure;
use super::inputs::{MachineChoice, TraceNames, default_recording, refuse_same_file};
use super::output::{print, print_json, show};
use super::recorded::Recorded;
use crate::base::units::rad_from_deg;
use crate::base::{AxisKind, Diagnostic, SourceText};
use crate::drive::Start;
use crate::kernel::{FollowOptions, FollowOutcome, SetpointTable, follow as follow_setpoints, row_period_s};
use crate::machine::{Loaded, Machine};
use crate::recorder::Recording;
use crate::trace::{Method, Signal, Trace, import};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Example:\n  sollwert follow setpoints.csv -m spinner_mvc850 -o followed.mcap

The CSV has a header time_s,X_mm,Y_mm,A_deg ... and one row a position period;
a column X_load_n_m is an outside torque at the motor shaft. Any other trace that `export` reads will
do too: its position set-points are brought to the position cycle.")]
pub(super) struct FollowArguments {
    /// Set-points: .csv, a recording .mcap, or the trace of a control
    setpoints: PathBuf,
    #[command(flatten)]
    machine: MachineChoice,
    #[command(flatten)]
    names: TraceNames,
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
    let table = read_setpoints(&arguments.setpoints, &machine, &arguments.names)?;
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

/// A CSV of set-points, or the position set-points of a recording or a trace.
fn read_setpoints(path: &Path, machine: &Loaded, names: &TraceNames) -> Result<SetpointTable, Failure> {
    let name = path.display().to_string();
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap")) {
        let recording = Recording::open(path).map_err(Failure::unreadable)?;
        return SetpointTable::from_recording(&recording, &machine.machine).map_err(Failure::unreadable);
    }
    if path.is_file() && !is_setpoint_csv(path) {
        let only = ["position_setpoint".to_owned()];
        return names.with_options(Some(&machine.machine), &only, |options| {
            let trace = import(path, options).map_err(Failure::unreadable)?;
            show(&trace.notes);
            from_trace(&trace, &machine.machine).map_err(|finding| Failure::found_wrong(vec![finding]))
        });
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

/// Position cycles that are followed at most: a day at 1 ms.
const ROWS_MAX: f64 = 1e8;

/// Whether the first line has the names of set-points and of nothing else: `time_s,X_mm,A_deg`, or those of our export.
fn is_setpoint_csv(path: &Path) -> bool {
    use std::io::Read;
    let mut head = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(4096).read_to_end(&mut head));
    let text = String::from_utf8_lossy(&head);
    let first = text.lines().next().unwrap_or("");
    let is_xml = first.trim_start().starts_with(['<', '{']);
    // What is nearly such a table is one too: its reader says best what is wrong.
    let known = first.split([',', ';']).any(|name| {
        let name = name.trim();
        name == "time_s" || name.ends_with("_mm") || name.ends_with("_deg") || name.ends_with("_load_n_m")
    });
    read.is_err() || text.trim().is_empty() || (!is_xml && known && !first.contains("/!"))
}

/// Set-points of a trace at the position cycle of the machine, over the time in which every axis has one.
fn from_trace(trace: &Trace, machine: &Machine) -> Result<SetpointTable, Diagnostic> {
    let of_axis = |id| Some((id, trace.axis_signal(&machine.axis(id).name, "position_setpoint")?));
    let found: Vec<(_, &Signal)> = machine.axis_ids().filter_map(of_axis).collect();
    let starts = found.iter().filter_map(|(_, signal)| signal.times.start_s());
    let ends = found.iter().filter_map(|(_, signal)| signal.times.end_s());
    let (Some(start_s), Some(end_s)) = (starts.max_by(f64::total_cmp), ends.min_by(f64::total_cmp)) else {
        let message = format!("`{}` holds no position set-points of an axis of this machine", trace.name);
        return Err(
            Diagnostic::error("F0004", message).help("name its axes with --axis-name 7=A, or its signals with --map")
        );
    };
    let period_s = row_period_s(machine);
    let steps = ((end_s - start_s) / period_s + 1e-6).floor();
    if !(0.0..ROWS_MAX).contains(&steps) {
        let message = format!("the set-points of `{}` have {steps:.0} position cycles in common", trace.name);
        return Err(Diagnostic::error("T0023", message).help("all axes must have set-points at the same time"));
    }
    let rows = steps as usize + 1;
    let times: Vec<f64> = (0..rows).map(|row| start_s + row as f64 * period_s).collect();
    let mut positions = Vec::new();
    for (axis, signal) in found {
        let mut values = signal.resampled(&times, Method::Linear);
        if let Some(row) = values.iter().position(|value| value.is_nan()) {
            let message = format!("`{}` has a gap at {:.6} s: a drive cannot follow it", signal.original, times[row]);
            return Err(Diagnostic::error("T0023", message).help("export the part without gaps, and follow that"));
        }
        if machine.axis(axis).kind == AxisKind::Rotary {
            values.iter_mut().for_each(|value| *value = rad_from_deg(*value));
        }
        positions.push((axis, values));
    }
    Ok(SetpointTable { positions, loads: Vec::new(), rows, timed: true })
}
