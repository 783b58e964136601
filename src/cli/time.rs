//! `sollwert time`: set-points only, no recording.
//!
//! In: programs, machine. Out: figures as tables or one JSON document. Does not simulate drives.

use super::failure::Failure;
use super::inputs::{MachineChoice, Panel, Surroundings};
use super::output::{ProgressLine, print, print_json, show};
use super::run::{Style, figures_text};
use super::what_if;
use crate::base::Diagnostic;
use crate::kernel::{self, PieceSource, Preparation, RunOptions, RunOutcome, WhatIf};
use crate::machine::Loaded;
use crate::optimum::{Collector, NoOptimum, Optimum};
use crate::program::ProgramSource;
use crate::recorder::SignalChoice;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(
    after_help = "Example:\n  sollwert time op10.mpf op20.mpf -m spinner_mvc850 --json\n  sollwert time op10.mpf -m huron_kx10 --optimal --what-if"
)]
pub(super) struct TimeArguments {
    /// NC programs
    #[arg(required = true)]
    programs: Vec<PathBuf>,
    #[command(flatten)]
    machine: MachineChoice,
    #[command(flatten)]
    surroundings: Surroundings,
    #[command(flatten)]
    panel: Panel,
    /// The least time in which the same path can be driven under the same limits, and the control's share of it
    #[arg(long)]
    optimal: bool,
    /// What each machine datum costs: the time that 10 % more of it would save, and where it holds the motion back
    #[arg(long)]
    what_if: bool,
    /// Threads: 1 runs everything in one, 2 the cycle beside its preparation, 3 the reading of the program as well; the result is the same
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..))]
    threads: u16,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn time(arguments: &TimeArguments) -> Result<(), Failure> {
    let overrides = arguments.panel.overrides()?;
    if !overrides.changes().is_empty() && (arguments.optimal || arguments.what_if) {
        return Err(Failure::unreadable(
            Diagnostic::error(
                "C0008",
                "--optimal and --what-if ask about the programmed feed: they do not go with --override",
            )
            .help("leave one of the two out"),
        ));
    }
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
        let optimum = if arguments.optimal { Some(fastest(program, &machine, arguments)?) } else { None };
        let costs = if arguments.what_if { Some(costs(program, &machine, arguments)?) } else { None };
        if arguments.json {
            let mut document = serde_json::to_value(&outcome.summary).unwrap_or_else(|_| json!({}));
            if let Some(optimum) = &optimum {
                document["optimal"] = optimum_json(optimum, outcome.summary.cycle_time_s);
            }
            if let Some((costs, _)) = &costs {
                document["what_if"] = what_if::json_of(costs);
            }
            documents.push(document);
        } else {
            print(&figures_text(&outcome.summary, &Style { json: false, drives: false, page: None }))?;
            if let Some(optimum) = &optimum {
                print(&optimum_text(optimum, outcome.summary.cycle_time_s))?;
            }
            if let Some((costs, source)) = &costs {
                print(&what_if::text_of(costs, source))?;
            }
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
        overrides: arguments.panel.overrides()?,
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

/// What each datum costs, with the program for the numbers of its blocks.
fn costs(path: &Path, machine: &Loaded, arguments: &TimeArguments) -> Result<(WhatIf, ProgramSource), Failure> {
    let setup = arguments.surroundings.open(path, &machine.machine)?;
    let source = setup.program.clone();
    let mut line = ProgressLine::new();
    let mut show = |done: usize, total: usize| line.update(|| format!("what if: {done} of {total} data"));
    Ok((kernel::what_if(setup, &machine.machine, &mut show), source))
}

/// The fastest motion along the path that the control drives.
fn fastest(path: &Path, machine: &Loaded, arguments: &TimeArguments) -> Result<Optimum, Failure> {
    let setup = arguments.surroundings.open(path, &machine.machine)?;
    let mut preparation = Preparation::new(setup, &machine.machine);
    let mut collector = Collector::new(&machine.machine);
    while let Some(piece) = preparation.next_piece() {
        collector.push(&piece);
    }
    let mut line = ProgressLine::new();
    let solved =
        collector.solve(&mut |done, total| line.update(|| format!("optimum: {done} of {total} pieces of path")));
    drop(line);
    let optimum = solved.map_err(|reason| Failure::unreadable(no_optimum(path, reason)))?;
    let unsolved = optimum.unsolved_lines.iter().map(|line| {
        let name = path.display();
        let message = format!("{name}: no optimum is found for the motion that begins in line {line}");
        Diagnostic::warning("P0012", message)
            .help("the control's own motion stands in its place: the true optimum is no slower")
    });
    show(&unsolved.collect::<Vec<_>>());
    Ok(optimum)
}

fn no_optimum(path: &Path, reason: NoOptimum) -> Diagnostic {
    let name = path.display();
    match reason {
        NoOptimum::TooLong { pieces, pieces_max } => {
            let message = format!(
                "{name}: the optimum is found for {pieces_max} pieces of path between two rests at most, and here are {pieces}"
            );
            Diagnostic::error("P0011", message).help("cut the program into parts that begin and end at rest")
        }
        NoOptimum::NotBuilt => Diagnostic::error("P0013", "this `sollwert` was built without `--optimal`")
            .help("build it with the feature `optimal`, which is on by default"),
    }
}

fn optimum_json(optimum: &Optimum, cycle_time_s: f64) -> serde_json::Value {
    json!({
        "time_s": optimum.time_s,
        "share": share(optimum, cycle_time_s),
        "grid_points": optimum.grid_points,
        "rounds": optimum.rounds,
        "unsolved_lines": optimum.unsolved_lines,
    })
}

/// 1 where the control is as fast as the axes allow.
fn share(optimum: &Optimum, cycle_time_s: f64) -> f64 {
    if cycle_time_s > 0.0 { optimum.time_s / cycle_time_s } else { 1.0 }
}

fn optimum_text(optimum: &Optimum, cycle_time_s: f64) -> String {
    let percent = 100.0 * share(optimum, cycle_time_s);
    let decimals = if cycle_time_s < 10.0 { 3 } else { 1 };
    format!("\n{cycle_time_s:.decimals$} s, optimum {:.decimals$} s ({percent:.0} %)\n", optimum.time_s)
}
