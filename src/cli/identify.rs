//! `sollwert identify`: the parameters of drives from traces of them; programs to record; the control calibrated.
//!
//! In: traces of any known format, the machine. Out: a table or JSON with intervals and refusals, with `-o` the machine file with the values in it.
//! Does not compute anything. `--plan` and `--smoothing` are in `identify_control`.

use super::failure::Failure;
use super::identify_control::{calibration, planning};
use super::identify_page::page;
use super::identify_tables::{document, tables};
use super::inputs::{MachineChoice, Surroundings, TraceNames, refuse_same_file};
use super::output::{ProgressLine, print, print_json, show};
use crate::base::{AxisId, Diagnostic, SourceText};
use crate::identify::{AxisResult, IdentifyOptions, identify as identify_axes, machine_text};
use crate::kernel::Warning;
use crate::machine::{Loaded, Machine, parse};
use crate::recorder::WholeFile;
use crate::trace::{Trace, import};
use clap::Args;
use serde_json::json;
use std::io::Write as _;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  sollwert identify --plan -m my_machine.toml -o plan
  sollwert identify trace.xml --axis-name 1=X -m my_machine.toml -o identified.toml
  sollwert identify slow.mcap fast.mcap -m my_machine.toml --axis X --json
  sollwert identify --smoothing trace.mcap part.mpf -m my_machine.toml -o calibrated.toml --report page.html

What a trace must hold, and how the values and their 95 % intervals are found, is in docs/identify.md. What the
traces cannot tell is refused, with what to record instead. Torque constant, transmission and cycles are
those of the machine file.")]
pub(super) struct IdentifyArguments {
    /// Traces: recordings, or what a control exported; several are used together. With --smoothing: a trace and its program, then others
    #[arg(required_unless_present = "plan", value_name = "TRACE")]
    pub(super) traces: Vec<PathBuf>,
    /// Write NC programs to run while the machine is traced, and say which signals to trace
    #[arg(long, conflicts_with = "smoothing")]
    plan: bool,
    /// Calibrate the control on the set-points of a program, or of several: TRACE PROGRAM [TRACE PROGRAM ...]
    #[arg(long)]
    smoothing: bool,
    /// With --smoothing: another traced program, not used for the fit; may be given several times
    #[arg(long, num_args = 2, value_names = ["TRACE", "PROGRAM"], requires = "smoothing")]
    pub(super) validate: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) machine: MachineChoice,
    /// Axis; may be given several times; default: every axis of the traces that the machine has
    #[arg(long = "axis", value_name = "AXIS")]
    pub(super) axes: Vec<String>,
    #[command(flatten)]
    names: TraceNames,
    #[command(flatten)]
    pub(super) surroundings: Surroundings,
    /// Least squares only: no fit of the simulated axis
    #[arg(long)]
    linear: bool,
    /// Machine file to write, with the values, their intervals as comments, and everything else as it was; with --plan a folder
    #[arg(short, long, value_name = "MACHINE.toml")]
    pub(super) output: Option<PathBuf>,
    /// Page to write: values with their intervals, refusals, friction over speed; with --smoothing feed over the path
    #[arg(long, value_name = "PAGE.html", conflicts_with = "plan")]
    pub(super) report: Option<PathBuf>,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

/// Fields of an axis that are read.
const SIGNALS: [&str; 15] = [
    "position_setpoint",
    "position_measured",
    "position_actual",
    "position_reference",
    "control_deviation",
    "following_error",
    "velocity_setpoint",
    "velocity_command",
    "velocity_feedforward",
    "torque_feedforward",
    "torque_reference",
    "current",
    "current_mean",
    "motor_speed_reference",
    "motor_speed",
];

pub(super) fn identify(arguments: &IdentifyArguments) -> Result<(), Failure> {
    if arguments.plan {
        return planning(arguments);
    }
    if arguments.smoothing {
        return calibration(arguments);
    }
    let inputs = || arguments.traces.iter().map(PathBuf::as_path);
    for output in arguments.output.iter().chain(&arguments.report) {
        refuse_same_file(inputs(), output)?;
    }
    let loaded = arguments.machine.load_or_recorded(&arguments.traces)?;
    let machine = &loaded.machine;
    let options = IdentifyOptions { axes: axes(&arguments.axes, machine)?, linear_only: arguments.linear };
    let mut traces = Vec::new();
    for path in inputs() {
        traces.push(read(path, &SIGNALS, arguments, machine)?);
    }
    let line = std::cell::RefCell::new(ProgressLine::new());
    let results = identify_axes(&traces, machine, &options, &mut |axis| {
        line.borrow_mut().update(|| format!("axis {axis}"));
    })
    .map_err(Failure::unreadable)?;
    drop(line);
    let notes = notes(&results, machine);
    show(&notes);
    if let Some(output) = &arguments.output {
        write(output, &loaded, &results)?;
    }
    if let Some(report) = &arguments.report {
        write_whole(report, &page(&results, machine, &arguments.traces))?;
    }
    if arguments.json {
        let mut document = document(&results, machine, &arguments.traces);
        document["warnings"] = notes.iter().map(Warning::from).map(|warning| json!(warning)).collect();
        if let Some(output) = &arguments.output {
            document["output"] = json!(output.display().to_string());
        }
        if let Some(report) = &arguments.report {
            document["report"] = json!(report.display().to_string());
        }
        print_json(&document)?;
    } else {
        print(&tables(&results, machine))?;
        if let Some(output) = &arguments.output {
            print(&format!("\nmachine file: {}\n", output.display()))?;
        }
        if let Some(report) = &arguments.report {
            print(&format!("page: {}\n", report.display()))?;
        }
    }
    if results.iter().all(|result| result.estimates.is_empty()) { Err(Failure::told()) } else { Ok(()) }
}

/// Reads some fields of a trace.
pub(super) fn read(
    path: &Path,
    signals: &[&str],
    arguments: &IdentifyArguments,
    machine: &Machine,
) -> Result<Trace, Failure> {
    let only: Vec<String> = signals.iter().map(|&signal| signal.to_owned()).collect();
    let trace = arguments
        .names
        .with_options(Some(machine), &only, |options| import(path, options).map_err(Failure::unreadable))?;
    show(&trace.notes);
    Ok(trace)
}

pub(super) fn axes(names: &[String], machine: &Machine) -> Result<Vec<AxisId>, Failure> {
    let find = |name: &String| {
        machine.axis_by_name(name).ok_or_else(|| {
            let known: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            let finding = Diagnostic::error("T0202", format!("the machine has no axis `{name}`"));
            Failure::unreadable(finding.help(format!("its axes are {}", known.join(", "))))
        })
    };
    names.iter().map(find).collect()
}

/// What a person should know of all axes.
fn notes(results: &[AxisResult], machine: &Machine) -> Vec<Diagnostic> {
    let mut notes: Vec<Diagnostic> = results.iter().flat_map(|result| result.notes.clone()).collect();
    let guessed = |result: &&AxisResult| {
        let axis = machine.axis_by_name(&result.axis).map(|id| machine.axis(id));
        axis.and_then(|axis| axis.drive.as_ref()).is_some_and(|drive| !drive.identified)
    };
    let names: Vec<&str> =
        results.iter().filter(|r| !r.estimates.is_empty()).filter(guessed).map(|r| r.axis.as_str()).collect();
    if !names.is_empty() {
        let message = format!(
            "torque constant, transmission and cycles of {} are taken from a machine file that calls its drive representative",
            names.join(", ")
        );
        notes.push(
            Diagnostic::warning("T0205", message)
                .help("inertia and friction are as right as the torque constant: take it from the motor (p0316)"),
        );
    }
    notes
}

fn write(output: &Path, loaded: &Loaded, results: &[AxisResult]) -> Result<(), Failure> {
    let text = machine_text(&loaded.text_as_used, &loaded.machine, results).map_err(Failure::unreadable)?;
    // What is written can be read again, or is not written.
    if let Err(findings) = parse(&SourceText::new(output.display().to_string(), text.as_str()), &[]) {
        return Err(Failure::found_wrong(findings));
    }
    write_whole(output, &text)
}

/// Writes a text under its name when it is complete.
pub(super) fn write_whole(output: &Path, text: &str) -> Result<(), Failure> {
    let (whole, mut target) = WholeFile::create(output).map_err(Failure::unreadable)?;
    target.write_all(text.as_bytes()).map_err(|error| Failure::unreadable(whole.fault(&error)))?;
    whole.commit(target).map(|_| ()).map_err(Failure::unreadable)
}
