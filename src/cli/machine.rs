//! `sollwert machine`: machine files.
//!
//! In: a machine file or the name of a shipped one. Out: verdict, overview, schema or text. Does not run anything.

use super::bode::{BodeArguments, bode};
use super::failure::Failure;
use super::inputs::{MachineChoice, refused};
use super::machine_data::{ExportArguments, ImportArguments, export, import};
use super::output::{print, print_json, show, table};
use crate::base::{AxisKind, Diagnostic, units};
use crate::machine::{Axis, LoadError, Loaded, load, schema, shipped};
use clap::{Args, Subcommand};
use serde_json::json;

#[derive(Args)]
pub(super) struct MachineArguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Read a machine file, report everything that is wrong with it
    #[command(after_help = "Example:\n  sollwert machine check my_machine.toml")]
    Check {
        /// Machine file, or the name of a shipped machine
        machine: String,
        /// Change one value first, such as feed.time_law=seven-phase
        #[arg(long = "set", value_name = "KEY=VALUE")]
        sets: Vec<String>,
        /// One JSON document on stdout
        #[arg(long)]
        json: bool,
    },
    /// The JSON Schema of machine files, for editors
    #[command(after_help = "Example:\n  sollwert machine schema > machine.schema.json")]
    Schema {
        /// Accepted as everywhere: a schema is JSON anyway
        #[arg(long)]
        json: bool,
    },
    /// The shipped machines
    #[command(after_help = "Example:\n  sollwert machine list")]
    List {
        /// One JSON document on stdout
        #[arg(long)]
        json: bool,
    },
    /// Frequency responses of the loops of an axis: margins, bandwidths, curves
    Bode(BodeArguments),
    /// A machine file from SINUMERIK machine data: listings, drive parameters, archives
    Import(ImportArguments),
    /// SINUMERIK machine data of a machine, as a listing
    Export(ExportArguments),
    /// The text of a machine file with --set applied: a shipped one is a good start for your own
    #[command(after_help = "Example:\n  sollwert machine show -m spinner_mvc850 > my_machine.toml")]
    Show {
        #[command(flatten)]
        machine: MachineChoice,
        /// One JSON document on stdout, with the text in it
        #[arg(long)]
        json: bool,
    },
}

impl MachineArguments {
    /// Whether a JSON document is wanted.
    pub(super) fn json(&self) -> bool {
        match &self.action {
            Action::Bode(arguments) => arguments.json,
            Action::Import(arguments) => arguments.json,
            Action::Export(arguments) => arguments.json,
            Action::Check { json, .. }
            | Action::Schema { json }
            | Action::List { json }
            | Action::Show { json, .. } => *json,
        }
    }
}

pub(super) fn machine(arguments: &MachineArguments) -> Result<(), Failure> {
    match &arguments.action {
        Action::Check { machine, sets, json } => check(machine, sets, *json),
        Action::Schema { .. } => print_json(&schema()),
        Action::List { json } => list(*json),
        Action::Bode(arguments) => bode(arguments),
        Action::Import(arguments) => import(arguments),
        Action::Export(arguments) => export(arguments),
        Action::Show { machine, json } => {
            let loaded = machine.load()?;
            if *json {
                print_json(&json!({"format": 1, "machine": loaded.machine.name, "text": loaded.text_as_used}))
            } else {
                print(&loaded.text_as_used)
            }
        }
    }
}

fn check(name: &str, sets: &[String], json: bool) -> Result<(), Failure> {
    match load(name, sets) {
        Ok(loaded) => {
            show(&loaded.warnings);
            if json { print_json(&verdict(name, &[], &loaded.warnings)) } else { print(&overview(&loaded)) }
        }
        Err(LoadError::Invalid(findings)) => {
            show(&findings);
            if json {
                print_json(&verdict(name, &findings, &[]))?;
            } else {
                print(&format!("{name}: {} to mend\n", findings.len()))?;
            }
            Err(Failure::told())
        }
        Err(error) => Err(refused(error)),
    }
}

fn verdict(name: &str, errors: &[Diagnostic], warnings: &[Diagnostic]) -> serde_json::Value {
    let list = |findings: &[Diagnostic]| findings.iter().map(crate::kernel::Warning::from).collect::<Vec<_>>();
    json!({"format": 1, "machine": name, "errors": list(errors), "warnings": list(warnings)})
}

/// What the file says, in the units of its keys, so that a wrong decimal point meets the eye.
fn overview(loaded: &Loaded) -> String {
    let machine = &loaded.machine;
    let mut rows = vec![["axis", "velocity", "acceleration", "jerk", "travel", "drive"].map(str::to_owned).to_vec()];
    rows.extend(machine.axes.iter().map(axis_row));
    format!(
        "{} ({}), set-points every {:.4} ms, look-ahead {} blocks\n{}",
        machine.name,
        machine.control,
        machine.cycle.time_base.setpoint_period_s() * units::MS_PER_S,
        machine.look_ahead_blocks,
        table(&rows)
    )
}

fn axis_row(axis: &Axis) -> Vec<String> {
    let limits = &axis.limits;
    let travel = |unit: &str, scale: f64| {
        axis.travel_lu.map_or("endless".into(), |[low, high]| format!("{:.0}..{:.0} {unit}", low * scale, high * scale))
    };
    let drive = match &axis.drive {
        None => "ideal",
        Some(drive) if drive.identified => "identified",
        Some(_) => "representative",
    };
    let numbers = match axis.kind {
        AxisKind::Linear => [
            format!("{:.1} m/min", limits.velocity_max_lu_s * units::S_PER_MIN / units::MM_PER_M),
            format!("{:.2} m/s²", limits.acceleration_max_lu_s2 / units::MM_PER_M),
            format!("{:.1} m/s³", limits.jerk_max_lu_s3 / units::MM_PER_M),
            travel("mm", 1.0),
        ],
        AxisKind::Rotary => [
            format!("{:.1} rpm", limits.velocity_max_lu_s * units::S_PER_MIN / units::RAD_PER_REV),
            format!("{:.2} rot/s²", limits.acceleration_max_lu_s2 / units::RAD_PER_REV),
            format!("{:.1} rot/s³", limits.jerk_max_lu_s3 / units::RAD_PER_REV),
            travel("deg", units::DEG_PER_RAD),
        ],
    };
    [axis.name.clone()].into_iter().chain(numbers).chain([drive.to_owned()]).collect()
}

fn list(as_json: bool) -> Result<(), Failure> {
    let mut rows = Vec::new();
    for (name, _) in shipped() {
        match load(name, &[]) {
            Ok(loaded) => {
                let axes: Vec<&str> = loaded.machine.axes.iter().map(|axis| axis.name.as_str()).collect();
                rows.push((*name, loaded.machine.name.clone(), axes.join(" ")));
            }
            Err(LoadError::Unreadable(finding)) => show([&finding]),
            Err(LoadError::Invalid(findings)) => show(&findings),
        }
    }
    if as_json {
        let list: Vec<_> =
            rows.iter().map(|(name, title, axes)| json!({"name": name, "title": title, "axes": axes})).collect();
        print_json(&json!({"format": 1, "machines": list}))
    } else {
        print(&table(
            &rows.into_iter().map(|(name, title, axes)| vec![name.to_owned(), title, axes]).collect::<Vec<_>>(),
        ))
    }
}
