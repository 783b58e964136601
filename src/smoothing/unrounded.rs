//! Corners that the program wants rounded and that are not: said once each.
//!
//! In: program files as they are opened, blocks that end in such a corner. Out: one warning a reason, with the line marked. Does
//! not change the contour.

use super::corner::Reason;
use crate::base::Diagnostic;
use crate::base::diagnostics::Place;
use crate::interpreter::Event;
use crate::program::{BlockRef, OpenedProgram, ProgramSource};

/// Warnings not yet taken, and what has been said.
#[derive(Clone, Debug, Default)]
pub(super) struct Unrounded {
    programs: Vec<OpenedProgram>,
    said: Vec<Reason>,
    warnings: Vec<Diagnostic>,
}

impl Unrounded {
    /// Remembers the texts that warnings will quote.
    pub(super) fn watch(&mut self, events: &[Event]) {
        for event in events {
            if let Event::ProgramOpened(program) = event {
                self.programs.push(program.clone());
            }
        }
    }

    /// A corner at the end of `block` is passed as in G64.
    pub(super) fn report(&mut self, reason: Reason, block: BlockRef) {
        if self.said.contains(&reason) {
            return;
        }
        self.said.push(reason);
        let (code, why) = match reason {
            Reason::Arc => ("S0001", "one of its blocks is an arc"),
            Reason::Polynomial => ("S0003", "one of its blocks is a spline or a polynomial"),
            Reason::Rotary => ("S0002", "one of its blocks moves a rotary axis"),
        };
        let message = format!("the corner at the end of line {} is passed as in G64, because {why}", block.line);
        let help =
            "corners between straight blocks of linear axes are rounded; reported once, for the first such corner";
        let warning = Diagnostic::warning(code, message).help(help);
        self.warnings.push(match self.place(block) {
            Some(place) => warning.at(place),
            None => warning,
        });
    }

    /// Warnings since the last call.
    pub(super) fn take(&mut self) -> Vec<Diagnostic> {
        std::mem::take(&mut self.warnings)
    }

    /// The line of a block, marked.
    pub(super) fn place(&self, block: BlockRef) -> Option<Place> {
        let program = self.programs.iter().rev().find(|program| program.id == block.program)?;
        let source = ProgramSource::from_bytes(&program.name, program.bytes.clone());
        let line_text = source.text_of_line(block.line)?.trim_end().to_owned();
        let columns = 0..line_text.len();
        Some(Place { file: program.name.clone(), line: block.line, line_text, columns, label: "ends here".to_owned() })
    }
}
