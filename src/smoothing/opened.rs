//! The texts of the programs that a path comes from.
//!
//! In: program files as they are opened ([`Event`]s). Out: the line of a block, marked, for those that have something to say about it.
//! Does not read files.

use crate::base::Diagnostic;
use crate::base::diagnostics::Place;
use crate::interpreter::Event;
use crate::program::{BlockRef, OpenedProgram, ProgramSource};

/// Programs opened so far.
#[derive(Clone, Debug, Default)]
pub struct OpenedPrograms {
    programs: Vec<OpenedProgram>,
}

impl OpenedPrograms {
    /// Remembers the texts that will be quoted.
    pub fn watch(&mut self, events: &[Event]) {
        for event in events {
            if let Event::ProgramOpened(program) = event {
                self.programs.push(program.clone());
            }
        }
    }

    /// A finding of a later stage, with the line of its block marked.
    pub fn marked(&self, finding: Diagnostic, block: BlockRef) -> Diagnostic {
        match self.place(block) {
            Some(place) => finding.at(Place { label: "this motion".to_owned(), ..place }),
            None => finding,
        }
    }

    /// The line of a block, marked.
    pub fn place(&self, block: BlockRef) -> Option<Place> {
        let program = self.programs.iter().rev().find(|program| program.id == block.program)?;
        let source = ProgramSource::from_bytes(&program.name, program.bytes.clone());
        let line_text = source.text_of_line(block.line)?.trim_end().to_owned();
        let columns = 0..line_text.len();
        Some(Place { file: program.name.clone(), line: block.line, line_text, columns, label: "ends here".to_owned() })
    }
}
