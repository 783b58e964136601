//! Control flow: IF, loops, jumps, DEF.
//!
//! In: a statement. Out: the next line, variables. Loops keep nothing but their variables: a jump out of a loop or into it leaves
//! nothing behind. Partners and labels come from the program's [`crate::program::structure::Structure`].

use super::evaluate::{evaluate, integers, number};
use super::run::Interpreter;
use super::value::Value;
use crate::base::diagnostics::nearest;
use crate::program::structure::number_of;
use crate::program::syntax::{
    Case, Definition, Destination, Direction, Expr, ForLoop, Initial, Jump, Statement, Target,
};
use crate::program::{Columns, Cursor, Fault, Outcome, block_number, codes, parse};
use std::cmp::Ordering;

/// Answers kept of searches for block numbers: computed targets may be without number.
const FOUND_NUMBERS_MAX: usize = 4096;
/// Lines that are searched in the time that a block takes.
const SEARCHED_LINES_PER_BLOCK: u32 = 64;

impl Interpreter {
    /// Executes a statement.
    pub(super) fn execute(&mut self, statement: &Statement) -> Outcome<()> {
        match statement {
            Statement::Words(words) => self.words(words),
            Statement::Define(definition) => self.define(definition),
            Statement::If(condition) => {
                let partner = self.partner()?;
                if !self.truth(condition)? {
                    self.go_behind(partner);
                }
                Ok(())
            }
            Statement::IfJump(condition, jump) => {
                if self.truth(condition)? {
                    self.jump(jump)?;
                }
                Ok(())
            }
            // The branch before ELSE has been executed.
            Statement::Else => self.partner().map(|end| self.go_behind(end)),
            Statement::EndIf => self.partner().map(|_| ()),
            Statement::For(for_loop) => self.enter_for(for_loop),
            Statement::EndFor => self.next_pass(),
            Statement::While(condition) => {
                let end = self.partner()?;
                if !self.truth(condition)? {
                    self.go_behind(end);
                }
                Ok(())
            }
            Statement::EndWhile => self.partner().map(|start| self.next = start),
            Statement::Loop | Statement::Repeat => self.partner().map(|_| ()),
            Statement::EndLoop => self.partner().map(|start| self.go_behind(start)),
            Statement::Until(condition) => {
                let start = self.partner()?;
                if !self.truth(condition)? {
                    self.go_behind(start);
                }
                Ok(())
            }
            Statement::Jump(jump) => self.jump(jump),
            Statement::Case(case) => self.case(case),
            Statement::NotActedOn(entry, columns) => {
                self.report_word(entry, columns);
                Ok(())
            }
        }
    }

    fn truth(&self, condition: &Expr) -> Outcome<bool> {
        evaluate(condition, self)?.truth(&condition.columns)
    }

    /// Line of the partner of the control word in this line.
    fn partner(&self) -> Outcome<Cursor> {
        let line = self.current.line;
        let structure = self.source.structure();
        structure.partner(line).filter(|_| structure.unmatched(line).is_none()).ok_or_else(|| {
            let end = self.source.line_text(self.current).trim_end().len() as u32;
            match structure.unmatched(line) {
                Some(unmatched) => unbalanced(unmatched.word, unmatched.missing, 0..end),
                None => unbalanced("this word", "its partner", 0..end),
            }
        })
    }

    /// Goes on behind a line.
    fn go_behind(&mut self, cursor: Cursor) {
        self.next = self.source.line_bytes(cursor).map_or(cursor, |(_, next)| next);
    }

    fn enter_for(&mut self, for_loop: &ForLoop) -> Outcome<()> {
        let end = self.partner()?;
        let first = evaluate(&for_loop.first, self)?;
        self.assign(&for_loop.counter, &first, &for_loop.counter_columns, &for_loop.first.columns)?;
        if self.counter_is_past(for_loop)? {
            self.go_behind(end);
        }
        Ok(())
    }

    /// ENDFOR: counts up and goes back, unless the last value is passed.
    fn next_pass(&mut self) -> Outcome<()> {
        let start = self.partner()?;
        let Ok(block) = parse(&self.source.line_text(start), &self.dialect) else { return Ok(()) };
        let Statement::For(for_loop) = &block.statement else { return Ok(()) };
        let counted = match self.read(&for_loop.counter, &for_loop.counter_columns)? {
            Value::Int(value) if value < i32::MAX => Value::Int(value + 1),
            value => Value::Real(value.number(&for_loop.counter_columns)? + 1.0),
        };
        self.assign(&for_loop.counter, &counted, &for_loop.counter_columns, &for_loop.counter_columns)?;
        if !self.counter_is_past(for_loop)? {
            self.go_behind(start);
        }
        Ok(())
    }

    fn counter_is_past(&self, for_loop: &ForLoop) -> Outcome<bool> {
        let counter = self.read(&for_loop.counter, &for_loop.counter_columns)?;
        let last = evaluate(&for_loop.last, self)?;
        Ok(counter.compare(&last, &for_loop.last.columns)? == Ordering::Greater)
    }

    fn case(&mut self, case: &Case) -> Outcome<()> {
        let selector = evaluate(&case.selector, self)?;
        for (value, jump) in &case.branches {
            if evaluate(value, self)?.compare(&selector, &value.columns)? == Ordering::Equal {
                return self.jump(jump);
            }
        }
        case.default.as_ref().map_or(Ok(()), |jump| self.jump(jump))
    }

    fn jump(&mut self, jump: &Jump) -> Outcome<()> {
        let Some(destination) = &jump.destination else {
            self.next = self.source.first();
            return Ok(());
        };
        let (name, number) = match destination {
            Destination::Number(number) => (format!("N{number}"), Some(*number)),
            Destination::Name(name) => {
                self.computed(self.variables.text(name).unwrap_or_else(|| name.clone()).as_ref())
            }
            Destination::Text(text) => self.computed(&self.text_of(&evaluate(text, self)?, &text.columns)?),
        };
        let found = match number {
            Some(number) => self.find_number(number, jump.direction),
            None => self.source.structure().label(&name, self.current.line, jump.direction),
        };
        match found {
            Some(cursor) => self.next = cursor,
            None if jump.direction == Direction::BothQuiet => {}
            None => return Err(self.no_target(&name, jump)),
        }
        Ok(())
    }

    /// A text as a destination: `N90` is a block number, anything else a label.
    fn computed(&self, text: &str) -> (String, Option<u64>) {
        let name = text.trim().trim_end_matches(':').to_ascii_uppercase();
        let number = block_number(&name);
        (name, number)
    }

    fn no_target(&self, name: &str, jump: &Jump) -> Box<Fault> {
        let structure = self.source.structure();
        let towards = match jump.direction {
            Direction::Forward => " towards the end of the program",
            Direction::Backward => " towards the start of the program",
            _ => "",
        };
        let help = if structure.label(name, self.current.line, Direction::Both).is_some() {
            Some("it stands in the other direction: GOTO searches both ways".to_owned())
        } else {
            nearest(name, structure.label_names()).map(|near| format!("did you mean `{near}`?"))
        };
        Fault::new(codes::NO_TARGET, jump.columns.clone(), format!("there is no `{name}`{towards}"))
            .label("jump destination not found")
            .maybe_help(help)
    }

    /// Searches a block number as the control does, and remembers the answer.
    fn find_number(&mut self, number: u64, direction: Direction) -> Option<Cursor> {
        let key = (self.current.line, direction, number);
        if let Some(known) = self.found_numbers.get(&key) {
            return *known;
        }
        let following = self.next;
        let found = match direction {
            Direction::Forward => self.search_number(number, following, u32::MAX, true),
            Direction::Backward => self.search_number(number, self.source.first(), self.current.line, false),
            _ => {
                let forward = self.search_number(number, following, u32::MAX, true);
                forward.or_else(|| self.search_number(number, self.source.first(), self.current.line, true))
            }
        };
        if self.found_numbers.len() < FOUND_NUMBERS_MAX {
            self.found_numbers.insert(key, found);
        }
        found
    }

    /// First or last line with the block number, from `cursor` up to and including `last_line`.
    fn search_number(&mut self, number: u64, mut cursor: Cursor, last_line: u32, first: bool) -> Option<Cursor> {
        let mut found = None;
        let mut lines = 0;
        while let Some((line, next)) = self.source.line_bytes(cursor).filter(|_| cursor.line <= last_line) {
            lines += 1;
            if number_of(line) == Some(number) {
                found = Some(cursor);
                if first {
                    break;
                }
            }
            cursor = next;
        }
        // Searching takes time too: a loop that searches without end must be found out.
        self.idle_blocks = self.idle_blocks.saturating_add(lines / SEARCHED_LINES_PER_BLOCK);
        found
    }

    pub(super) fn define(&mut self, definition: &Definition) -> Outcome<()> {
        if definition.global && self.globals_defined_here() {
            let columns = definition.variables.first().map_or(0..0, |variable| variable.columns.clone());
            return Err(Fault::new(
                codes::BAD_BLOCK,
                columns,
                "NCK and CHAN variables are defined in definition files",
            )
            .label("global in a program")
            .help("leave NCK or CHAN away, or give the file with --gud"));
        }
        for variable in &definition.variables {
            let dimensions = integers(&variable.dimensions, self)?;
            let at = (self.current.line, &variable.columns);
            self.variables.define(&variable.name, definition.variable_type, &dimensions, at)?;
            match &variable.initial {
                Initial::None => {}
                Initial::One(value) if dimensions.is_empty() => {
                    let result = evaluate(value, self)?;
                    self.variables.set(&variable.name, &[], &result, (&variable.columns, &value.columns))?;
                }
                initial => self.fill(&variable.name, &[], initial, &variable.columns)?,
            }
        }
        Ok(())
    }

    /// SET and REP: several elements of an array from the one with `indices` on.
    pub(super) fn fill(&mut self, name: &str, indices: &[i32], initial: &Initial, columns: &Columns) -> Outcome<()> {
        let range = self.variables.fill_range(name, indices, columns)?;
        match initial {
            Initial::None => {}
            Initial::One(value) => {
                let result = evaluate(value, self)?;
                for place in range {
                    self.variables.set_place(name, place, &result, &value.columns)?;
                }
            }
            Initial::Repeat(value, count) => {
                let result = evaluate(value, self)?;
                let count = match count {
                    Some(count) => number(count, self)?.max(0.0) as usize,
                    None => usize::MAX,
                };
                for place in range.take(count) {
                    self.variables.set_place(name, place, &result, &value.columns)?;
                }
            }
            Initial::Set(values) => {
                if values.len() > range.len() {
                    return Err(Fault::new(
                        codes::BAD_INDEX,
                        columns.clone(),
                        format!("SET has {} values for {} elements", values.len(), range.len()),
                    )
                    .label("too many values"));
                }
                for (place, value) in range.zip(values) {
                    if let Some(value) = value {
                        let result = evaluate(value, self)?;
                        self.variables.set_place(name, place, &result, &value.columns)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Stores a value; `columns` of the target, then of the value.
    pub(super) fn assign(
        &mut self,
        target: &Target,
        value: &Value,
        target_columns: &Columns,
        value_columns: &Columns,
    ) -> Outcome<()> {
        match target {
            Target::Parameter(index) => {
                let number = evaluate(index, self)?.integer(&index.columns)?;
                self.variables.set_parameter(number, value.number(value_columns)?, &index.columns)
            }
            Target::Variable { name, indices } => {
                if let Some(dimensions) = self.variables.frame_dimensions(name) {
                    let columns = (target_columns, value_columns);
                    return self.set_user_frame(name, dimensions, indices, value, columns);
                }
                let indices = integers(indices, self)?;
                self.variables.set(name, &indices, value, (target_columns, value_columns))
            }
            Target::System(system) => self.set_system_variable(system, value, target_columns, value_columns),
        }
    }

    fn read(&self, target: &Target, columns: &Columns) -> Outcome<Value> {
        match target {
            Target::Parameter(index) => {
                let number = evaluate(index, self)?.integer(&index.columns)?;
                self.variables.parameter(number, columns).map(Value::Real)
            }
            Target::Variable { name, indices } => self.variables.get(name, &integers(indices, self)?, columns),
            Target::System(system) => self.system_variable(system, columns),
        }
    }
}

/// The finding for a control word without its partner.
pub(super) fn unbalanced(word: &str, missing: &str, columns: Columns) -> Box<Fault> {
    Fault::new(codes::UNBALANCED, columns, format!("{word} without {missing}")).label(format!("expected {missing}"))
}
