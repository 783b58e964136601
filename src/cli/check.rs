//! `sollwert check`: all diagnostics of a program.
//!
//! In: program, machine. Out: findings on stderr, a count or JSON on stdout. Does not plan or simulate.

use super::failure::Failure;
use super::inputs::{MachineChoice, Surroundings};
use super::output::{print, print_json, show};
use crate::base::{Diagnostic, Severity};
use crate::interpreter;
use crate::kernel::Warning;
use clap::Args;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Example:\n  sollwert check part.mpf -m xyzbc")]
pub(super) struct CheckArguments {
    /// NC program
    program: PathBuf,
    #[command(flatten)]
    machine: MachineChoice,
    #[command(flatten)]
    surroundings: Surroundings,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn check(arguments: &CheckArguments) -> Result<(), Failure> {
    let machine = arguments.machine.load()?;
    let setup = arguments.surroundings.open(&arguments.program, &machine.machine)?;
    let program = &setup.program;
    let findings = interpreter::check(&setup, &machine.machine);
    let errors = findings.iter().filter(|finding| finding.severity == Severity::Error).count();
    show(&shortened(&findings));
    if arguments.json {
        let of = |wanted: Severity| -> Vec<Warning> {
            findings.iter().filter(|finding| finding.severity == wanted).map(Warning::from).collect()
        };
        print_json(&json!({
            "format": 1, "program": program.file_name(), "machine": machine.machine.name,
            "errors": of(Severity::Error), "warnings": of(Severity::Warning), "notes": of(Severity::Note),
        }))?;
    } else {
        print(&format!(
            "{}: {}, {}\n",
            program.file_name(),
            count(errors, "error"),
            count(findings.iter().filter(|finding| finding.severity == Severity::Warning).count(), "warning")
        ))?;
    }
    if errors > 0 { Err(Failure::told()) } else { Ok(()) }
}

/// How often the same finding is shown: a word that is not built yet may stand in every line.
const SAME_SHOWN_MAX: usize = 3;

/// For people: of findings that say the same the first few, and how many more there are. JSON has all.
fn shortened(findings: &[Diagnostic]) -> Vec<Diagnostic> {
    let mut seen: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for finding in findings {
        *seen.entry((finding.code, &finding.message)).or_default() += 1;
    }
    let mut shown_of: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    let mut shown = Vec::new();
    for finding in findings {
        let key = (finding.code, finding.message.as_str());
        let (total, number) = (seen[&key], shown_of.entry(key).or_default());
        *number += 1;
        if *number < SAME_SHOWN_MAX || total <= SAME_SHOWN_MAX {
            shown.push(finding.clone());
        } else if *number == SAME_SHOWN_MAX {
            let more = total - SAME_SHOWN_MAX;
            let note =
                format!("and the same {}", if more == 1 { "once more".into() } else { format!("{more} times more") });
            let help = finding.help.as_ref().map_or(note.clone(), |help| format!("{help}; {note}"));
            shown.push(finding.clone().help(help));
        }
    }
    shown
}

fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}
