//! Jumps and repeated parts: GOTO and its kin, REPEAT label, REPEATB, CALL BLOCK.
//!
//! In: destinations. Out: the next line. Labels come from the program's [`crate::program::structure::Structure`], which is scanned once;
//! block numbers are searched as on the control, and the answer is remembered: no jump scans the file twice. Of several equal labels
//! the nearest one counts. Decisions:
//!
//! * REPEAT searches its label towards the start of the program first, then towards the end. Without a second label the part ends
//!   with the block ENDLABEL, if that stands between label and REPEAT (or anywhere behind a label that stands behind REPEAT), else
//!   before REPEAT. The blocks of both labels belong to it.
//! * A jump out of a repeated part ends its repetition.

use super::call::LEVELS_MAX;
use super::evaluate::evaluate;
use super::flow::{Passed, Repeat};
use super::run::Interpreter;
use crate::base::diagnostics::nearest;
use crate::program::structure::number_of;
use crate::program::syntax::{Destination, Direction, Jump, RepeatBlocks};
use crate::program::{Columns, Cursor, Fault, Outcome, block_number, codes};
use std::sync::Arc;

/// Answers kept of searches for block numbers: computed targets may be without number.
const FOUND_NUMBERS_MAX: usize = 4096;
/// Lines that are searched in the time that a block takes.
const SEARCHED_LINES_PER_BLOCK: u32 = 64;
/// The label that ends a repeated part.
const END_LABEL: &str = "ENDLABEL";

impl Interpreter {
    pub(super) fn jump(&mut self, jump: &Jump) -> Outcome<()> {
        let Some(destination) = &jump.destination else {
            self.repeats.clear();
            self.next = self.source.first();
            return Ok(());
        };
        let name = self.destination(destination)?;
        match self.find_text(&name, jump.direction)? {
            Some(cursor) => self.jump_to(cursor),
            None if jump.direction == Direction::BothQuiet => {}
            None => return Err(self.no_target(&name, jump.direction, &jump.columns)),
        }
        Ok(())
    }

    /// Goes on there; repeated parts that do not hold the place are over.
    pub(super) fn jump_to(&mut self, cursor: Cursor) {
        while let Some(repeat) = self.repeats.last()
            && !(repeat.first.line..repeat.behind.line).contains(&cursor.line)
        {
            self.repeats.pop();
        }
        self.next = cursor;
    }

    /// A destination as text: a label in capitals, or `N90`.
    fn destination(&self, destination: &Destination) -> Outcome<Arc<str>> {
        let text = match destination {
            Destination::Number(number) => return Ok(format!("N{number}").into()),
            Destination::Name(name) => self.variables.text(name).unwrap_or_else(|| name.clone()),
            Destination::Text(text) => self.text_of(&evaluate(text, self)?, &text.columns)?,
        };
        Ok(text.trim().trim_end_matches(':').to_ascii_uppercase().into())
    }

    /// Searches a label, or the block number of `N90` and `:90`.
    pub(super) fn find_text(&mut self, name: &str, direction: Direction) -> Outcome<Option<Cursor>> {
        let number = name.strip_prefix(':').map_or_else(|| block_number(name), |digits| digits.parse().ok());
        match number {
            Some(number) => self.find_number(number, direction),
            None => Ok(self.source.structure()?.label(name, self.current.line, direction)),
        }
    }

    pub(super) fn no_target(&self, name: &str, direction: Direction, columns: &Columns) -> Box<Fault> {
        let structure = match self.source.structure() {
            Ok(structure) => structure,
            Err(fault) => return fault,
        };
        let towards = match direction {
            Direction::Forward => " towards the end of the program",
            Direction::Backward => " towards the start of the program",
            _ => "",
        };
        let help = if structure.label(name, self.current.line, Direction::Both).is_some() {
            Some("it stands in the other direction: GOTO searches both ways".to_owned())
        } else {
            nearest(name, structure.label_names()).map(|near| format!("did you mean `{near}`?"))
        };
        Fault::new(codes::NO_TARGET, columns.clone(), format!("there is no `{name}`{towards}"))
            .label("jump destination not found")
            .maybe_help(help)
    }

    /// Searches a block number as the control does, and remembers the answer.
    fn find_number(&mut self, number: u64, direction: Direction) -> Outcome<Option<Cursor>> {
        let key = (self.current.line, direction, number);
        if let Some(known) = self.known.found_numbers.get(&key) {
            return Ok(*known);
        }
        let (first, here, following) = (self.source.first(), self.current.line, self.next);
        let found = match direction {
            Direction::Forward => self.search_number(number, following, u32::MAX, true)?,
            Direction::Backward => self.search_number(number, first, here, false)?,
            _ => match self.search_number(number, following, u32::MAX, true)? {
                None => self.search_number(number, first, here, true)?,
                found => found,
            },
        };
        if self.known.found_numbers.len() < FOUND_NUMBERS_MAX {
            self.known.found_numbers.insert(key, found);
        }
        Ok(found)
    }

    /// First or last line with the block number, from `cursor` up to and including `last_line`.
    fn search_number(
        &mut self,
        number: u64,
        mut cursor: Cursor,
        last_line: u32,
        first: bool,
    ) -> Outcome<Option<Cursor>> {
        let mut found = None;
        let mut lines = 0;
        // A window of its own: the program goes on where it was.
        let mut window = self.window.clone();
        while let Some((line, next)) = self.source.line(&mut window, cursor)?.filter(|_| cursor.line <= last_line) {
            lines += 1;
            if number_of(&line) == Some(number) {
                found = Some(cursor);
                if first {
                    break;
                }
            }
            cursor = next;
        }
        // Searching takes time too: a loop that searches without end must be found out.
        self.idle_blocks = self.idle_blocks.saturating_add(lines / SEARCHED_LINES_PER_BLOCK);
        Ok(found)
    }

    /// REPEAT label, REPEATB label.
    pub(super) fn repeat_blocks(&mut self, wanted: &RepeatBlocks) -> Outcome<()> {
        let passes = self.passes(wanted.passes.as_ref(), 0)?;
        let first = self.first_of_part(&wanted.first, &wanted.columns)?;
        let behind = if wanted.one_block {
            self.line_behind(first)?
        } else {
            match &wanted.last {
                Some(last) => self.end_of_part(last, first, &wanted.columns)?,
                None => self.natural_end(first, &wanted.columns)?,
            }
        };
        let then = Passed::GoOn(self.next);
        self.begin_part(Repeat { first, behind, passes_left: passes, then }, &wanted.columns)
    }

    /// CALL BLOCK first TO last.
    pub(super) fn call_own_section(
        &mut self,
        first: &Destination,
        last: &Destination,
        passes: i32,
        columns: &Columns,
    ) -> Outcome<()> {
        let first = self.first_of_part(first, columns)?;
        let behind = self.end_of_part(last, first, columns)?;
        let then = Passed::GoOn(self.next);
        self.begin_part(Repeat { first, behind, passes_left: passes, then }, columns)
    }

    /// CALL "NAME" BLOCK first TO last, in the program that has just been entered.
    pub(super) fn limit_to_section(&mut self, first: &Destination, last: &Destination) -> Outcome<()> {
        let columns = Columns::default();
        let first = self.first_of_part(first, &columns)?;
        let behind = self.end_of_part(last, first, &columns)?;
        self.begin_part(Repeat { first, behind, passes_left: 1, then: Passed::Leave }, &columns)
    }

    fn begin_part(&mut self, repeat: Repeat, columns: &Columns) -> Outcome<()> {
        if self.repeats.len() >= LEVELS_MAX {
            return Err(Fault::new(
                codes::CALL_DEPTH,
                columns.clone(),
                format!("more than {LEVELS_MAX} repeated parts inside one another"),
            )
            .label("one too many"));
        }
        if repeat.passes_left > 0 && repeat.first.line < repeat.behind.line {
            self.next = repeat.first;
            self.repeats.push(repeat);
        }
        Ok(())
    }

    fn first_of_part(&mut self, first: &Destination, columns: &Columns) -> Outcome<Cursor> {
        let name = self.destination(first)?;
        if let Some(found) = self.find_text(&name, Direction::Backward)? {
            return Ok(found);
        }
        match self.find_text(&name, Direction::Forward)? {
            Some(found) => Ok(found),
            None => Err(self.no_target(&name, Direction::Both, columns)),
        }
    }

    /// Behind the block of the last label, which stands at or behind the first one.
    fn end_of_part(&mut self, last: &Destination, first: Cursor, columns: &Columns) -> Outcome<Cursor> {
        let name = self.destination(last)?;
        let here = (self.current, self.next);
        (self.current, self.next) = (Cursor { line: first.line.saturating_sub(1), ..first }, first);
        let found = self.find_text(&name, Direction::Forward);
        (self.current, self.next) = here;
        match found? {
            Some(found) => self.line_behind(found),
            None => Err(self.no_target(&name, Direction::Forward, columns)),
        }
    }

    /// Behind ENDLABEL, or the line of REPEAT.
    fn natural_end(&mut self, first: Cursor, columns: &Columns) -> Outcome<Cursor> {
        let here = self.current;
        let end = self.source.structure()?.label(END_LABEL, first.line.saturating_sub(1), Direction::Forward);
        match end {
            Some(end) if first.line > here.line || end.line < here.line => self.line_behind(end),
            _ if first.line < here.line => Ok(here),
            _ => Err(Fault::new(codes::NO_TARGET, columns.clone(), "this part has no end")
                .label("stands behind REPEAT, without ENDLABEL")
                .help("write ENDLABEL: behind the last block, or a second label into REPEAT")),
        }
    }

    fn line_behind(&mut self, cursor: Cursor) -> Outcome<Cursor> {
        let mut window = self.window.clone();
        Ok(self.source.line(&mut window, cursor)?.map_or(cursor, |(_, next)| next))
    }

    /// True if the next line is the end of a repeated part: what follows is set.
    pub(super) fn part_ends(&mut self) -> Outcome<bool> {
        let Some(repeat) = self.repeats.last_mut().filter(|repeat| repeat.behind == self.next) else {
            return Ok(false);
        };
        self.idle_blocks = self.idle_blocks.saturating_add(1);
        repeat.passes_left -= 1;
        if repeat.passes_left > 0 {
            self.next = repeat.first;
            return Ok(true);
        }
        match self.repeats.pop().map(|repeat| repeat.then) {
            Some(Passed::GoOn(next)) => self.next = next,
            _ => self.end()?,
        }
        Ok(true)
    }
}
