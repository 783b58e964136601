//! `sollwert check`: all diagnostics of a program.
//!
//! In: program, machine. Out: findings on stderr, a count or JSON on stdout. Does not plan or simulate.

use super::FOUND_WRONG;
use super::inputs::{MachineChoice, open_program};
use super::output::{print, print_json, show};
use crate::base::Severity;
use crate::interpreter;
use crate::kernel::Warning;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Example:\n  sollwert check part.mpf -m xyzbc")]
pub(super) struct CheckArguments {
    /// NC program
    program: PathBuf,
    #[command(flatten)]
    machine: MachineChoice,
    /// One JSON document on stdout
    #[arg(long)]
    json: bool,
}

pub(super) fn check(arguments: &CheckArguments) -> Result<(), u8> {
    let machine = arguments.machine.load()?;
    let program = open_program(&arguments.program)?;
    let findings = interpreter::check(&program, &machine.machine);
    let errors = findings.iter().filter(|finding| finding.severity == Severity::Error).count();
    show(&findings);
    if arguments.json {
        let of = |wanted: Severity| -> Vec<Warning> {
            findings.iter().filter(|finding| finding.severity == wanted).map(Warning::from).collect()
        };
        print_json(&json!({
            "format": 1, "program": program.file_name(), "machine": machine.machine.name,
            "errors": of(Severity::Error), "warnings": of(Severity::Warning), "notes": of(Severity::Note),
        }));
    } else {
        print(&format!(
            "{}: {}, {}\n",
            program.file_name(),
            count(errors, "error"),
            count(findings.len() - errors, "warning")
        ));
    }
    if errors > 0 { Err(FOUND_WRONG) } else { Ok(()) }
}

fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}
