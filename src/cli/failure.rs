//! How a sub-command ends without success: exit code, findings, and the JSON document that a script waits for.
//!
//! In: what went wrong. Out: findings on stderr, with `--json` one document on stdout, the exit code. Decides no code by itself: who
//! makes a [`Failure`] knows whether the work found something wrong or could not be done.

use super::output::{print_json, show};
use crate::base::Diagnostic;
use crate::kernel::Warning;
use serde_json::json;
use std::process::ExitCode;

/// Exit code 1: the work found something wrong.
const FOUND_WRONG: u8 = 1;
/// Exit code 2: wrong usage, unreadable input, or output that cannot be written.
const UNREADABLE: u8 = 2;

/// An end without success.
pub(super) struct Failure {
    code: u8,
    findings: Vec<Diagnostic>,
    /// The findings and the JSON document are printed already, or cannot be.
    told: bool,
}

impl Failure {
    /// The input is wrong in what it says.
    pub(super) fn found_wrong(findings: Vec<Diagnostic>) -> Self {
        Self { code: FOUND_WRONG, findings, told: false }
    }

    /// Wrong usage, input that cannot be read, output that cannot be written.
    pub(super) fn unreadable(finding: Diagnostic) -> Self {
        Self { code: UNREADABLE, findings: vec![finding], told: false }
    }

    /// Wrong arguments on the command line.
    pub(super) fn wrong_usage(findings: Vec<Diagnostic>) -> Self {
        Self { code: UNREADABLE, findings, told: false }
    }

    /// The work found something wrong, and has said so in its own document.
    pub(super) fn told() -> Self {
        Self { code: FOUND_WRONG, findings: Vec::new(), told: true }
    }

    /// stdout itself cannot be written.
    pub(super) fn stdout(error: &std::io::Error) -> Self {
        let finding = Diagnostic::error("C0004", format!("the output cannot be written: {error}"))
            .help("make room, or send stdout somewhere else");
        Self { code: UNREADABLE, findings: vec![finding], told: true }
    }

    /// Says what is not said yet.
    pub(super) fn tell(self, json: bool) -> ExitCode {
        show(&self.findings);
        let mut code = self.code;
        if json && !self.told {
            let errors: Vec<Warning> = self.findings.iter().map(Warning::from).collect();
            if let Err(failure) = print_json(&json!({"format": 1, "errors": errors})) {
                show(&failure.findings);
                code = failure.code;
            }
        }
        ExitCode::from(code)
    }
}
