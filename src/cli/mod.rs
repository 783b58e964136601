//! The command. One file per sub-command: read arguments, call one library function, print.
//!
//! In: command line. Out: tables or one JSON document on stdout, findings and progress on stderr, exit code 0 (done), 1 (the work
//! found something wrong) or 2 (wrong usage, unreadable input, output that cannot be written). No physics here.

mod bode;
mod bode_page;
mod check;
mod compare;
mod compare_tables;
mod demo;
mod explain;
mod export;
mod failure;
mod follow;
mod identify;
mod identify_control;
mod identify_control_page;
mod identify_page;
mod identify_tables;
mod inputs;
mod machine;
mod machine_data;
mod moves;
mod output;
mod recorded;
mod recover;
mod report;
mod run;
mod time;
mod tune;
mod tune_page;
mod tune_tables;
mod what_if;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// A virtual NC kernel: replays SINUMERIK NC programs cycle by cycle on a machine's limits and records every signal.
#[derive(Parser)]
#[command(name = "sollwert", version, max_term_width = 110, after_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Say on stderr what happens at the borders: start, alarm, end
    #[arg(short, long, global = true)]
    verbose: bool,
}

const EXAMPLES: &str = "Examples:
  sollwert demo                                          something to look at
  sollwert run part.mpf -m spinner_mvc850 -o part.mcap   replay, record everything
  sollwert time part.mpf -m my_machine.toml              what limits the feed
  sollwert machine check my_machine.toml                 is the machine file right?

-m takes a path or the name of a shipped machine; `sollwert machine list` names them.
--json prints one JSON document to stdout and nothing else there, also when the work fails.
Exit codes: 0 done; 1 something is wrong with the program, the machine or the set-points;
2 wrong usage, unreadable input, or output that cannot be written.";

#[derive(Subcommand)]
enum Command {
    /// Replay a program: set-points, drives, recording
    Run(run::RunArguments),
    /// Set-points only, fast: cycle time, and the share of time of each feed limit
    Time(time::TimeArguments),
    /// All diagnostics of a program
    Check(check::CheckArguments),
    /// What the interpreter makes of a program, one line a move
    Moves(moves::MovesArguments),
    /// The drives alone, fed with given position set-points
    Follow(follow::FollowArguments),
    /// Two traces, aligned: figures per signal, contour error, circles, corners; limits decide the exit code
    Compare(compare::CompareArguments),
    /// Traces of a machine: friction, inertia, feed-forward, delays, gains of its drives, with confidence
    Identify(identify::IdentifyArguments),
    /// A trace as a page to look at: plots, path, tables, program
    Report(report::ReportArguments),
    /// Feed-forward gains and their delay, from programs or measured traces
    Tune(tune::TuneArguments),
    /// A recording as CSV
    Export(export::ExportArguments),
    /// Rescue what an interrupted run left
    Recover(recover::RecoverArguments),
    /// Machine files: check, list, show, schema, frequency responses; SINUMERIK machine data in and out
    Machine(machine::MachineArguments),
    /// What a code such as E0104 means, and what to do
    Explain(explain::ExplainArguments),
    /// Write a program and a machine to look at, and run them
    Demo(demo::DemoArguments),
}

/// Reads the command line, does the work, returns the exit code.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if arguments.verbose {
        tracing_subscriber::fmt().with_writer(std::io::stderr).with_ansi(output::stderr_colour()).without_time().init();
    }
    let (done, json) = match &arguments.command {
        Command::Run(arguments) => (run::run(arguments), arguments.json),
        Command::Time(arguments) => (time::time(arguments), arguments.json),
        Command::Check(arguments) => (check::check(arguments), arguments.json),
        Command::Moves(arguments) => (moves::moves(arguments), arguments.json),
        Command::Follow(arguments) => (follow::follow(arguments), arguments.json),
        Command::Compare(arguments) => (compare::compare(arguments), arguments.json),
        Command::Identify(arguments) => (identify::identify(arguments), arguments.json),
        Command::Report(arguments) => (report::report(arguments), arguments.json),
        Command::Tune(arguments) => (tune::tune(arguments), arguments.json),
        Command::Export(arguments) => (export::export(arguments), arguments.json),
        Command::Recover(arguments) => (recover::recover(arguments), arguments.json),
        Command::Machine(arguments) => (machine::machine(arguments), arguments.json()),
        Command::Explain(arguments) => (explain::explain(arguments), arguments.json),
        Command::Demo(arguments) => (demo::demo(arguments), arguments.json),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.tell(json),
    }
}
