//! All findings of a program in one pass.
//!
//! In: a program and a machine. Out: diagnostics in order of lines, each once. First every line is parsed, also those that are
//! never executed; then the program is run, up to a budget, for what shows only at run time. Does not simulate motion.

use super::flow::unbalanced;
use super::run::Interpreter;
use super::setup::Setup;
use super::variables::undeclared;
use crate::base::diagnostics::nearest;
use crate::base::{Diagnostic, Severity};
use crate::machine::Machine;
use crate::program::syntax::{Block, Destination, Expr, Initial, Jump, Statement, Target, WordKind};
use crate::program::{Columns, Cursor, Dialect, Fault, ProgramSource, codes, parse, visit_names};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Moves after which the run of the check ends: a program may loop for ever on purpose.
const MOVES_MAX: u64 = 20_000_000;

/// All diagnostics of `source` on `machine`.
pub fn check(setup: impl Into<Setup>, machine: &Machine) -> Vec<Diagnostic> {
    let setup = Setup { lists_only: true, ..setup.into() };
    let source = &setup.program;
    let mut found = every_line(source, &Dialect::new(machine));
    let is_sound = found.is_empty();
    if is_sound {
        found = names_and_partners(source, &Dialect::new(machine));
    }
    run(&setup, machine, is_sound, &mut found);
    found.sort_by_key(|diagnostic| (diagnostic.line(), columns_of(diagnostic)));
    let mut seen = BTreeSet::new();
    found.retain(|diagnostic| {
        seen.insert((diagnostic.line(), diagnostic.code, columns_of(diagnostic), diagnostic.message.clone()))
    });
    found
}

fn columns_of(diagnostic: &Diagnostic) -> usize {
    diagnostic.place.as_ref().map_or(0, |place| place.columns.start)
}

fn lines(source: &ProgramSource) -> impl Iterator<Item = Cursor> {
    let mut cursor = source.first();
    std::iter::from_fn(move || {
        let (_, next) = source.line_bytes(cursor)?;
        Some(std::mem::replace(&mut cursor, next))
    })
}

fn placed(source: &ProgramSource, cursor: Cursor, fault: Fault) -> Diagnostic {
    fault.at(source.shared_name(), cursor.line, source.line_text(cursor).into_owned())
}

/// Syntax: one finding a line at most.
fn every_line(source: &ProgramSource, dialect: &Dialect) -> Vec<Diagnostic> {
    let parsed = lines(source).filter_map(|cursor| Some((cursor, parse(&source.line_text(cursor), dialect).err()?)));
    parsed.map(|(cursor, fault)| placed(source, cursor, *fault)).collect()
}

/// Names of components of frames stand in brackets only.
const COMPONENTS: [&str; 5] = ["TR", "FI", "RT", "SC", "MI"];

/// Names without DEF and control words without partner. Only for programs whose every line can be read: a typo in a DEF or an ENDIF
/// would be reported twice.
fn names_and_partners(source: &ProgramSource, dialect: &Dialect) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for unmatched in source.structure().all_unmatched() {
        let end = source.line_text(unmatched.cursor).trim_end().len() as u32;
        found.push(placed(source, unmatched.cursor, *unbalanced(unmatched.word, unmatched.missing, 0..end)));
    }
    let mut defined: BTreeSet<Arc<str>> = BTreeSet::new();
    for cursor in lines(source) {
        if let Ok(Block { statement: Statement::Define(definition), .. }) = parse(&source.line_text(cursor), dialect) {
            defined.extend(definition.variables.into_iter().map(|variable| variable.name));
        }
    }
    let mut reported: BTreeSet<Arc<str>> = BTreeSet::new();
    for cursor in lines(source) {
        let Ok(block) = parse(&source.line_text(cursor), dialect) else { continue };
        let mut visit = |name: &Arc<str>, columns: &Columns| {
            let known = COMPONENTS.contains(&&**name) || dialect.axis(name).is_some();
            if !known && !defined.contains(name) && reported.insert(name.clone()) {
                let near = nearest(name, defined.iter().map(|known| &**known));
                found.push(placed(source, cursor, *undeclared(name, near, columns)));
            }
        };
        visit_statement(&block.statement, &mut visit);
    }
    found
}

fn visit_statement(statement: &Statement, visit: &mut impl FnMut(&Arc<str>, &Columns)) {
    match statement {
        Statement::Words(words) => {
            for word in words {
                match &word.kind {
                    WordKind::Address(_, value) => visit_names(&value.value, visit),
                    WordKind::Message(Some(text)) => visit_names(text, visit),
                    WordKind::Assign(target, value) => {
                        visit_target(target, &word.columns, visit);
                        visit_names(value, visit);
                    }
                    WordKind::Fill(target, initial) => {
                        visit_target(target, &word.columns, visit);
                        visit_initial(initial, visit);
                    }
                    _ => {}
                }
            }
        }
        Statement::Define(definition) => {
            for variable in &definition.variables {
                variable.dimensions.iter().for_each(|size| visit_names(size, visit));
                visit_initial(&variable.initial, visit);
            }
        }
        Statement::If(condition) | Statement::While(condition) | Statement::Until(condition) => {
            visit_names(condition, visit)
        }
        Statement::IfJump(condition, jump) => {
            visit_names(condition, visit);
            visit_jump(jump, visit);
        }
        Statement::For(for_loop) => {
            visit_target(&for_loop.counter, &for_loop.counter_columns, visit);
            visit_names(&for_loop.first, visit);
            visit_names(&for_loop.last, visit);
        }
        Statement::Jump(jump) => visit_jump(jump, visit),
        Statement::Case(case) => {
            visit_names(&case.selector, visit);
            for (value, jump) in &case.branches {
                visit_names(value, visit);
                visit_jump(jump, visit);
            }
        }
        _ => {}
    }
}

fn visit_target(target: &Target, columns: &Columns, visit: &mut impl FnMut(&Arc<str>, &Columns)) {
    match target {
        Target::Parameter(index) => visit_names(index, visit),
        Target::Variable { name, indices } => {
            let end = columns.end.min(columns.start + name.len() as u32);
            visit(name, &(columns.start..end));
            indices.iter().for_each(|index| visit_names(index, visit));
        }
        Target::System(system) => system.indices.iter().for_each(|index| visit_names(index, visit)),
    }
}

fn visit_initial(initial: &Initial, visit: &mut impl FnMut(&Arc<str>, &Columns)) {
    let mut each = |value: &Expr| visit_names(value, visit);
    match initial {
        Initial::None => {}
        Initial::One(value) => each(value),
        Initial::Set(values) => values.iter().flatten().for_each(each),
        Initial::Repeat(value, count) => {
            each(value);
            count.iter().for_each(each);
        }
    }
}

fn visit_jump(jump: &Jump, visit: &mut impl FnMut(&Arc<str>, &Columns)) {
    if let Some(Destination::Text(text)) = &jump.destination {
        visit_names(text, visit);
    }
}

/// Executes the program for what only shows then.
fn run(setup: &Setup, machine: &Machine, is_sound: bool, found: &mut Vec<Diagnostic>) {
    let mut interpreter = Interpreter::new(setup.clone(), machine);
    for _ in 0..MOVES_MAX {
        match interpreter.next_move() {
            Ok(Some(_)) => {}
            Ok(None) => {
                found.extend(interpreter.take_warnings());
                return;
            }
            Err(alarm) => {
                found.extend(interpreter.take_warnings());
                // A typo in ENDIF leaves IF without a partner: that is one error, not two.
                let is_consequence = !is_sound && alarm.code == codes::UNBALANCED;
                let is_known = found.iter().any(|known| {
                    known.severity == Severity::Error && known.line() == alarm.line() && known.code == alarm.code
                });
                if !is_consequence && !is_known {
                    found.push(*alarm);
                }
                return;
            }
        }
    }
    found.extend(interpreter.take_warnings());
    let message = format!("the check executed {MOVES_MAX} moves and did not reach the end of the program");
    found.push(Diagnostic::note(codes::CHECK_STOPPED, message));
}
