//! Definition files: global user variables (GUD).
//!
//! In: the definition files of the [`Setup`](super::Setup). Out: variables that every program knows. A definition file holds `DEF NCK` and
//! `DEF CHAN` (one channel: both are the same here), comments and an M17 or M30 at its end; anything else in it is an error.

use super::run::Interpreter;
use crate::program::syntax::{Address, ExprKind, Statement, Word, WordKind};
use crate::program::{Fault, Outcome, ProgramSource, Window, codes, parse};

/// What ends a definition file.
const ENDS: [i32; 3] = [2, 17, 30];

impl Interpreter {
    /// Executes the definition files, before the first block of the program.
    pub(super) fn define_globals(&mut self) -> Outcome<()> {
        let setup = self.setup.clone();
        let main = self.source.clone();
        let (current, next) = (self.current, self.next);
        self.in_definitions = true;
        for file in &setup.definitions {
            // A finding names the file in which it is: after an error nothing goes on anyway.
            self.source = file.clone();
            self.definition_file(file)?;
        }
        self.in_definitions = false;
        self.source = main;
        (self.current, self.next) = (current, next);
        self.variables.make_global();
        Ok(())
    }

    /// True while a program is executed, false in a definition file.
    pub(super) fn globals_defined_here(&self) -> bool {
        !self.in_definitions
    }

    fn definition_file(&mut self, file: &ProgramSource) -> Outcome<()> {
        let mut cursor = file.first();
        let mut window = Window::default();
        while let Some((bytes, next)) = file.line(&mut window, cursor)? {
            self.current = cursor;
            cursor = next;
            let text = file.decode(&bytes).into_owned();
            match parse(&text, &self.dialect)?.statement {
                Statement::Define(definition) => self.define(&definition)?,
                Statement::Words(words) if words.iter().all(is_end) => {}
                _ => {
                    let end = text.trim_end().len() as u32;
                    return Err(Fault::new(codes::BAD_BLOCK, 0..end, "a definition file holds definitions only")
                        .label("expected DEF")
                        .help("move this block into a program"));
                }
            }
        }
        Ok(())
    }
}

fn is_end(word: &Word) -> bool {
    matches!(&word.kind, WordKind::Address(Address::M, value) if matches!(value.value.kind, ExprKind::Int(number) if ENDS.contains(&number)))
}
