//! `sollwert tune`: feed-forward gains from programs or measured traces.
//!
//! In: programs and traces, machine. Out: gains with errors before and after, as tables or one JSON document; a machine file, machine data for
//! the control, a page. Does not identify the drive: what the machine file says of it is believed.

use super::failure::Failure;
use super::inputs::{MachineChoice, Surroundings, TraceNames, refuse_same_file};
use super::output::{ProgressLine, print, print_json, show};
use super::tune_page::page;
use super::tune_tables::tables;
use crate::base::Diagnostic;
use crate::kernel::{Warning, drive_warnings};
use crate::machine::{Loaded, Machine};
use crate::trace::import;
use crate::tune::{
    Course, Gain, Measure, Objective, TuneOptions, Tuned, course_of_program, course_of_trace, document, machine_data,
    machine_text, tune as tune_gains,
};
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[derive(Args)]
#[command(after_help = "Example:
  sollwert tune pocket.mpf circle.mpf -m spinner_mvc850 --validate corners.mpf --objective contour -o tuned.toml
  sollwert tune measured.xml -m my_machine.toml --axis-name 1=X --report tuned.html

Programs are planned once and then only drives are simulated. A trace (.mcap, .xml, .json, .csv ...) with position set-points and
control deviation, following error or actual position is tuned on its measured errors: the model adds what other gains change.
Programs behind --validate are never used for tuning; the figures say what the new gains do to them.")]
pub(super) struct TuneArguments {
    /// NC programs, or traces with set-points and errors
    #[arg(required = true)]
    courses: Vec<PathBuf>,
    #[command(flatten)]
    machine: MachineChoice,
    /// Program or trace that is never used for tuning; may be given several times
    #[arg(long, value_name = "PROGRAM")]
    validate: Vec<PathBuf>,
    /// What is to be small: the deviation that the controller sees, the whole lag, or the distance of the tool from the path
    #[arg(long, value_enum, default_value = "deviation")]
    objective: ObjectiveChoice,
    /// How it is measured
    #[arg(long, value_enum, default_value = "rms")]
    measure: MeasureChoice,
    /// Gains that may change
    #[arg(long, value_enum, value_delimiter = ',', default_value = "velocity,torque,delay")]
    gains: Vec<GainChoice>,
    /// Bounds of a gain in the unit of its key, such as velocity=0.9..1.1; else 0.5..1.5, torque 0..2, delay 0..4 ms or twice what is usual
    #[arg(long = "bound", value_name = "GAIN=LOW..HIGH")]
    bounds: Vec<String>,
    /// Axis to tune, such as X; all that move without it; may be given several times
    #[arg(long = "axis", value_name = "AXIS")]
    axes: Vec<String>,
    /// Machine file to write: the one read, with the new gains, comments kept
    #[arg(short, long, value_name = "MACHINE.toml")]
    output: Option<PathBuf>,
    /// Machine data to write for the control (N32610 $MA_VELO_FFW_WEIGHT[0,AX1]=...)
    #[arg(long, value_name = "FILE")]
    machine_data: Option<PathBuf>,
    /// Page to write: figures, and maps of the objective around the new gains
    #[arg(long, value_name = "PAGE.html")]
    report: Option<PathBuf>,
    #[command(flatten)]
    surroundings: Surroundings,
    #[command(flatten)]
    names: TraceNames,
    /// Threads; the result is the same
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum ObjectiveChoice {
    Deviation,
    Following,
    Contour,
}

#[derive(Clone, Copy, ValueEnum)]
enum MeasureChoice {
    Rms,
    Peak,
}

#[derive(Clone, Copy, ValueEnum)]
enum GainChoice {
    Velocity,
    Torque,
    Delay,
    Friction,
    FrictionTime,
}

impl GainChoice {
    fn gain(self) -> Gain {
        match self {
            Self::Velocity => Gain::Velocity,
            Self::Torque => Gain::Torque,
            Self::Delay => Gain::Delay,
            Self::Friction => Gain::Friction,
            Self::FrictionTime => Gain::FrictionTime,
        }
    }
}

pub(super) fn tune(arguments: &TuneArguments) -> Result<(), Failure> {
    let outputs = [&arguments.output, &arguments.machine_data, &arguments.report];
    for output in outputs.into_iter().flatten() {
        let inputs = arguments.courses.iter().chain(&arguments.validate).map(PathBuf::as_path);
        // The machine file itself may be written anew, by its own option only.
        let machine = arguments.machine.path().filter(|_| Some(output) != arguments.output.as_ref());
        refuse_same_file(inputs.chain(machine), output)?;
    }
    let options = options(arguments)?;
    let loaded = arguments.machine.load_to_run()?;
    for axis in &options.axes {
        if loaded.machine.axis_by_name(axis).is_none() {
            let names: Vec<&str> = loaded.machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            let finding = Diagnostic::error("U0002", format!("--axis {axis}: the machine has no such axis"));
            return Err(Failure::unreadable(finding.help(format!("its axes are {}", names.join(", ")))));
        }
    }
    let tuned = in_threads(arguments, || {
        let mut line = ProgressLine::new();
        let courses = courses(arguments, &loaded, &mut line)?;
        let found = tune_gains(&loaded.machine, courses, &options, &mut |what| line.update(|| what.to_owned()));
        found.map_err(|finding| Failure::found_wrong(vec![finding]))
    })?;
    let mut warnings = loaded.warnings.clone();
    warnings.extend(drive_warnings(&loaded.machine, true));
    warnings.extend(tuned.warnings.iter().cloned());
    show(&warnings);
    write_outputs(arguments, &loaded, &tuned, &options)?;
    if arguments.json {
        let mut json = document(&loaded.machine.name, &tuned, &options);
        let name = |path: &Option<PathBuf>| path.as_ref().map(|path| path.display().to_string());
        json["machine_file"] = json!(name(&arguments.output));
        json["machine_data"] = json!(name(&arguments.machine_data));
        json["page"] = json!(name(&arguments.report));
        json["warnings"] = json!(warnings.iter().map(Warning::from).collect::<Vec<_>>());
        return print_json(&json);
    }
    print(&tables(&tuned, &options))
}

/// On a pool of its own, if a number of threads is given.
fn in_threads<T: Send>(
    arguments: &TuneArguments,
    work: impl FnOnce() -> Result<T, Failure> + Send,
) -> Result<T, Failure> {
    let Some(threads) = arguments.threads else { return work() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build().map_err(|error| {
        let finding = Diagnostic::error("C0002", format!("{threads} threads cannot be had: {error}"));
        Failure::unreadable(finding.help("ask for fewer with --threads"))
    })?;
    pool.install(work)
}

fn options(arguments: &TuneArguments) -> Result<TuneOptions, Failure> {
    let gains: Vec<Gain> = arguments.gains.iter().map(|gain| gain.gain()).collect();
    let mut bounds: Vec<(Gain, [f64; 2])> = Vec::new();
    for text in &arguments.bounds {
        let (gain, ends) = bound(text)?;
        let (why, help) = if !gains.contains(&gain) {
            ("that gain does not change", "add it to --gains, or leave the bounds out")
        } else if bounds.iter().any(|(bounded, _)| *bounded == gain) {
            ("that gain has bounds already", "give one --bound for each gain")
        } else {
            bounds.push((gain, ends));
            continue;
        };
        return Err(Failure::unreadable(Diagnostic::error("C0002", format!("`--bound {text}`: {why}")).help(help)));
    }
    Ok(TuneOptions {
        objective: match arguments.objective {
            ObjectiveChoice::Deviation => Objective::Deviation,
            ObjectiveChoice::Following => Objective::Following,
            ObjectiveChoice::Contour => Objective::Contour,
        },
        measure: match arguments.measure {
            MeasureChoice::Rms => Measure::Rms,
            MeasureChoice::Peak => Measure::Peak,
        },
        gains,
        bounds,
        axes: arguments.axes.clone(),
        landscape: arguments.report.is_some(),
    })
}

/// `velocity=0.9..1.1`.
fn bound(text: &str) -> Result<(Gain, [f64; 2]), Failure> {
    let read = || {
        let (word, range) = text.split_once('=')?;
        let gain = Gain::ALL.into_iter().find(|gain| gain.word() == word.trim())?;
        let (low, high) = range.split_once("..")?;
        let ends = [low.trim().parse::<f64>().ok()?, high.trim().parse::<f64>().ok()?];
        (ends[0] < ends[1] && ends[0] >= 0.0 && ends[1] <= 1000.0).then_some((gain, ends))
    };
    read().ok_or_else(|| {
        let finding = Diagnostic::error("C0002", format!("`--bound {text}` are no bounds of a gain"));
        Failure::unreadable(
            finding
                .help("write --bound velocity=0.9..1.1; gains are velocity, torque, delay (ms), friction, friction-time (ms); not below 0"),
        )
    })
}

/// Programs and traces, those for tuning first.
fn courses(arguments: &TuneArguments, loaded: &Loaded, line: &mut ProgressLine) -> Result<Vec<Course>, Failure> {
    let machine = Arc::new(loaded.machine.clone());
    let all =
        arguments.courses.iter().map(|path| (path, false)).chain(arguments.validate.iter().map(|path| (path, true)));
    all.map(|(path, validates)| {
        if is_trace(path) {
            return of_trace(path, &machine, arguments, validates);
        }
        let setup = arguments.surroundings.open(path, &machine)?;
        let name = path.display().to_string();
        let mut tell = |time_s: f64| line.update(|| format!("{name}: {time_s:.1} s planned"));
        course_of_program(&name, setup, &machine, validates, &mut tell)
            .map_err(|alarm| Failure::found_wrong(vec![alarm]))
    })
    .collect()
}

/// By its extension: what no control calls a program.
fn is_trace(path: &Path) -> bool {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    matches!(extension.as_deref(), Some("mcap" | "csv" | "xml" | "json" | "zip" | "parquet" | "halscope" | "log"))
}

fn of_trace(path: &Path, machine: &Machine, arguments: &TuneArguments, validates: bool) -> Result<Course, Failure> {
    let trace = arguments
        .names
        .with_options(Some(machine), &[], |options| import(path, options).map_err(Failure::unreadable))?;
    show(&trace.notes);
    course_of_trace(&trace, machine, validates).map_err(Failure::unreadable)
}

fn write_outputs(
    arguments: &TuneArguments,
    loaded: &Loaded,
    tuned: &Tuned,
    options: &TuneOptions,
) -> Result<(), Failure> {
    let text = machine_text(loaded, tuned).map_err(Failure::found_wrong)?;
    if let Some(path) = &arguments.output {
        write(path, &text)?;
    }
    if let Some(path) = &arguments.machine_data {
        write(path, &machine_data(&text, &loaded.name, tuned).map_err(Failure::found_wrong)?)?;
    }
    if let Some(path) = &arguments.report {
        write(path, &page(&loaded.machine.name, tuned, options))?;
    }
    Ok(())
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(|error| {
        let finding = Diagnostic::error("C0004", format!("`{}` cannot be written: {error}", path.display()));
        Failure::unreadable(finding.help("give a path in a folder that can be written"))
    })
}
