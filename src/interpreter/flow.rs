//! Control flow: IF, loops, CASE, DEF. Jumps are in `jump`, calls in `call`.
//!
//! In: a statement. Out: the next line, variables. Loops keep nothing but their variables: a jump out of a loop or into it leaves
//! nothing behind. Partners and labels come from the program's [`crate::program::structure::Structure`].

use super::evaluate::{evaluate, integers, number};
use super::run::Interpreter;
use super::value::Value;
use crate::program::syntax::{Case, Definition, Expr, ForLoop, Initial, Statement, Target};
use crate::program::{Columns, Cursor, Fault, Outcome, codes, is_synchronised};
use std::cmp::Ordering;

/// A part of a program that is executed several times, or apart from the rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Repeat {
    /// Its first line.
    pub first: Cursor,
    /// The line behind its last one.
    pub behind: Cursor,
    /// This pass included.
    pub passes_left: i32,
    /// What comes after the last pass.
    pub then: Passed,
}

/// What comes after a repeated part.
#[derive(Clone, Copy, Debug)]
pub(super) enum Passed {
    /// This line.
    GoOn(Cursor),
    /// The end of the program.
    Leave,
}

impl Interpreter {
    /// Executes a statement.
    pub(super) fn execute(&mut self, statement: &Statement) -> Outcome<()> {
        match statement {
            Statement::Words(words) => self.words(words),
            Statement::Define(definition) => self.define(definition),
            Statement::If(condition) => {
                let partner = self.partner()?;
                if !self.truth(condition)? {
                    self.go_behind(partner)?;
                }
                Ok(())
            }
            Statement::IfJump(branches) => {
                for (condition, jump) in branches {
                    if self.truth(condition)? {
                        return self.jump(jump);
                    }
                }
                Ok(())
            }
            // The branch before ELSE has been executed.
            Statement::Else => self.partner().and_then(|end| self.go_behind(end)),
            Statement::EndIf => self.partner().map(|_| ()),
            Statement::For(for_loop) => self.enter_for(for_loop),
            Statement::EndFor => self.next_pass(),
            Statement::While(condition) => {
                let end = self.partner()?;
                if !self.truth(condition)? {
                    self.go_behind(end)?;
                }
                Ok(())
            }
            Statement::EndWhile => self.partner().map(|start| self.next = start),
            Statement::Loop | Statement::Repeat => self.partner().map(|_| ()),
            Statement::EndLoop => self.partner().and_then(|start| self.go_behind(start)),
            Statement::Until(condition) => {
                let start = self.partner()?;
                if !self.truth(condition)? {
                    self.go_behind(start)?;
                }
                Ok(())
            }
            Statement::Jump(jump) => self.jump(jump),
            Statement::Case(case) => self.case(case),
            Statement::RepeatBlocks(wanted) => self.repeat_blocks(wanted),
            // Its parameters were defined by the call.
            Statement::Procedure(_) => Ok(()),
            Statement::External(header) => self.external(header),
            Statement::Call(call) => self.call(call),
            Statement::ModalCall(call) => self.modal_call(call.as_deref()),
            Statement::CallPath(path) => self.set_call_path(path.as_ref()),
            Statement::Return(wanted) => self.return_from(wanted),
            Statement::Synchronised(action) => self.synchronise(action),
            Statement::Cancel(numbers) => self.cancel_synchronised(numbers),
            // MCALL of a cycle that is not made, or another synchronised action.
            Statement::NotActedOn(entry, columns) => {
                if !is_synchronised(entry.word) {
                    self.modal_call = None;
                }
                self.report_word(entry, columns);
                Ok(())
            }
        }
    }

    fn set_call_path(&mut self, path: Option<&Expr>) -> Outcome<()> {
        let path = match path {
            Some(path) => Some(self.text_of(&evaluate(path, self)?, &path.columns)?.to_string()),
            None => None,
        };
        self.library.set_call_path(path);
        Ok(())
    }

    fn truth(&self, condition: &Expr) -> Outcome<bool> {
        evaluate(condition, self)?.truth(&condition.columns)
    }

    /// Line of the partner of the control word in this line.
    fn partner(&self) -> Outcome<Cursor> {
        let line = self.current.line;
        let structure = self.source.structure()?;
        structure.partner(line).filter(|_| structure.unmatched(line).is_none()).ok_or_else(|| {
            let end = self.source.line_text(self.current).trim_end().len() as u32;
            match structure.unmatched(line) {
                Some(unmatched) => unbalanced(unmatched.word, unmatched.missing, 0..end),
                None => unbalanced("this word", "its partner", 0..end),
            }
        })
    }

    /// Goes on behind a line.
    pub(super) fn go_behind(&mut self, cursor: Cursor) -> Outcome<()> {
        let line = self.source.line(&mut self.window, cursor)?;
        self.next = line.map_or(cursor, |(_, next)| next);
        Ok(())
    }

    fn enter_for(&mut self, for_loop: &ForLoop) -> Outcome<()> {
        let end = self.partner()?;
        let first = evaluate(&for_loop.first, self)?;
        self.assign(&for_loop.counter, &first, &for_loop.counter_columns, &for_loop.first.columns)?;
        if self.counter_is_past(for_loop)? {
            self.go_behind(end)?;
        }
        Ok(())
    }

    /// ENDFOR: counts up and goes back, unless the last value is passed.
    fn next_pass(&mut self) -> Outcome<()> {
        let start = self.partner()?;
        let block = self.block_at(start)?;
        let Statement::For(for_loop) = &block.statement else { return Ok(()) };
        let counted = match self.read(&for_loop.counter, &for_loop.counter_columns)? {
            Value::Int(value) if value < i32::MAX => Value::Int(value + 1),
            value => Value::Real(value.number(&for_loop.counter_columns)? + 1.0),
        };
        self.assign(&for_loop.counter, &counted, &for_loop.counter_columns, &for_loop.counter_columns)?;
        if !self.counter_is_past(for_loop)? {
            self.go_behind(start)?;
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

    /// Alarm 12161 of the control: here the variable is made all the same. Only of the main program, once a run.
    fn warn_of_late_definition(&mut self, definition: &Definition) {
        let is_late = self.main_begun && !self.in_definitions && self.levels.is_empty();
        if let Some(first) = definition.variables.first().filter(|_| is_late)
            && self.first_report(codes::LATE_DEFINITION)
        {
            let fault =
                Fault::new(codes::LATE_DEFINITION, first.columns.clone(), "this DEF stands behind an executable block")
                    .label("too late for the control")
                    .help("move all DEF to the start of the program");
            self.warn(*fault);
        }
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
        self.warn_of_late_definition(definition);
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
