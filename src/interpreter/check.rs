//! All findings of a program in one pass.
//!
//! In: a program, its surroundings and a machine. Out: diagnostics of it and of the sub-programs that its calls name, in order of files
//! and lines, each once. First every line is parsed, also those that are
//! never executed; then the program is run, up to a budget, for what shows only at run time. Does not simulate motion.

use super::call::missing;
use super::flow::unbalanced;
use super::run::{Interpreter, priority_fault};
use super::setup::Setup;
use super::variables::undeclared;
use crate::base::diagnostics::nearest;
use crate::base::{Diagnostic, Severity};
use crate::machine::Machine;
use crate::program::plain::plain_block;
use crate::program::structure::Structure;
use crate::program::syntax::{
    Block, Call, Callee, Destination, Expr, ExprKind, Initial, Jump, Statement, Target, WordKind,
};
use crate::program::visit::priority_trap;
use crate::program::{
    Columns, Cursor, Dialect, Fault, Library, Line, ProgramSource, UnitId, Window, codes, parse, visit_names,
};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Moves after which the run of the check ends: a program may loop for ever on purpose.
const MOVES_MAX: u64 = 20_000_000;

/// Programs that are looked at: a folder may hold more, and each may call the others.
const PROGRAMS_MAX: usize = 1000;

/// All diagnostics of a program and of the sub-programs that its calls name, on `machine`.
pub fn check(setup: impl Into<Setup>, machine: &Machine) -> Vec<Diagnostic> {
    let setup = Setup { lists_only: true, ..setup.into() };
    let dialect = Dialect::new(machine);
    let mut library = Library::new(setup.program.clone(), setup.directories.clone(), setup.shipped);
    let units = reachable(&mut library, &dialect);
    let mut found = Vec::new();
    let mut is_sound = true;
    for unit in &units {
        let source = library.source(*unit).clone();
        let typos = every_line(&source, &dialect);
        let missing = calls(*unit, &mut library, &dialect);
        // A typo in ENDIF looks like a call: what it leaves without a partner is its consequence.
        let misspelt = missing.iter().any(|finding| finding.code == codes::UNKNOWN_WORD);
        if typos.is_empty() {
            let others = names_and_partners(&source, &setup, &dialect);
            found.extend(others.into_iter().filter(|finding| !(misspelt && finding.code == codes::UNBALANCED)));
        }
        found.extend(missing);
        found.extend(traps(&source, &dialect));
        is_sound &= typos.is_empty() && !misspelt;
        found.extend(typos);
    }
    run(&setup, machine, is_sound, &mut found);
    let order = |diagnostic: &Diagnostic| {
        let file = diagnostic.place.as_ref().map(|place| &*place.file);
        units.iter().position(|unit| Some(library.source(*unit).name()) == file)
    };
    found.sort_by_key(|diagnostic| (order(diagnostic), diagnostic.line(), columns_of(diagnostic)));
    let mut seen = BTreeSet::new();
    found.retain(|diagnostic| {
        let (file, columns) = (order(diagnostic), columns_of(diagnostic));
        seen.insert((file, diagnostic.line(), diagnostic.code, columns, diagnostic.message.clone()))
    });
    found
}

/// The main program and all that its calls lead to, in order of discovery. A name that is computed leads nowhere.
fn reachable(library: &mut Library, dialect: &Dialect) -> Vec<UnitId> {
    let mut units = vec![UnitId(0)];
    let mut next = 0;
    while let Some(unit) = units.get(next).copied() {
        next += 1;
        each_call(&library.source(unit).clone(), dialect, &mut |_, call| {
            if let Some(name) = literal_name(call)
                && let Ok(Some(found)) = library.find(&name, unit)
                && units.len() < PROGRAMS_MAX
                && !units.contains(&found.unit)
            {
                units.push(found.unit);
            }
        });
    }
    units
}

fn each_call(source: &ProgramSource, dialect: &Dialect, visit: &mut impl FnMut(Cursor, &Call)) {
    for (cursor, line) in lines(source) {
        // Most lines end here, and cost little.
        if plain_block(&line, dialect).is_some() {
            continue;
        }
        match parse(&source.decode(&line), dialect).map(|block| block.statement) {
            Ok(Statement::Call(call)) => visit(cursor, &call),
            Ok(Statement::ModalCall(Some(call))) => visit(cursor, &call),
            _ => {}
        }
    }
}

fn literal_name(call: &Call) -> Option<Arc<str>> {
    match &call.callee {
        Callee::Name(name) | Callee::Path(name) => Some(name.clone()),
        Callee::Text(Expr { kind: ExprKind::Text(name), .. }) => Some(name.clone()),
        _ => None,
    }
}

/// Calls of sub-programs that are not there, or with more values than they take.
fn calls(unit: UnitId, library: &mut Library, dialect: &Dialect) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let source = library.source(unit).clone();
    each_call(&source, dialect, &mut |cursor, call| {
        let Some(name) = literal_name(call) else { return };
        let fault = match library.find(&name, unit) {
            Ok(Some(called)) => too_many(call, &library.source(called.unit).clone(), dialect),
            Ok(None) => {
                let names = library.names();
                let may_be_word = matches!(call.callee, Callee::Name(_));
                Some(missing(&name, may_be_word, names.iter().map(String::as_str), &call.columns))
            }
            Err(_) => None,
        };
        found.extend(fault.map(|fault| placed(&source, cursor, *fault)));
    });
    found
}

fn too_many(call: &Call, called: &ProgramSource, dialect: &Dialect) -> Option<Box<Fault>> {
    let first = lines(called)
        .map(|(_, line)| parse(&called.decode(&line), dialect))
        .find(|parsed| !matches!(parsed, Ok(Block { statement: Statement::Words(words), .. }) if words.is_empty()));
    let taken = match first {
        Some(Ok(Block { statement: Statement::Procedure(header), .. })) => header.parameters.len(),
        Some(Err(_)) => return None,
        _ => 0,
    };
    let given = call.arguments.len();
    (given > taken).then(|| {
        let message = format!("this sub-program takes {taken} values");
        Fault::new(codes::BAD_ARGUMENT, call.columns.clone(), message).label(format!("{given} given here"))
    })
}

fn columns_of(diagnostic: &Diagnostic) -> usize {
    diagnostic.place.as_ref().map_or(0, |place| place.columns.start)
}

fn lines(source: &ProgramSource) -> impl Iterator<Item = (Cursor, Line)> {
    let mut cursor = source.first();
    let mut window = Window::default();
    std::iter::from_fn(move || {
        // Running the program says why it cannot be read.
        let (line, next) = source.line(&mut window, cursor).ok()??;
        Some((std::mem::replace(&mut cursor, next), line))
    })
}

fn placed(source: &ProgramSource, cursor: Cursor, fault: Fault) -> Diagnostic {
    fault.at(source.shared_name(), cursor.line, source.line_text(cursor))
}

/// Syntax: one finding a line at most.
fn every_line(source: &ProgramSource, dialect: &Dialect) -> Vec<Diagnostic> {
    let parsed =
        lines(source).filter_map(|(cursor, line)| Some((cursor, parse(&source.decode(&line), dialect).err()?)));
    parsed.map(|(cursor, fault)| placed(source, cursor, *fault)).collect()
}

/// Conditions that are read otherwise than they look.
fn traps(source: &ProgramSource, dialect: &Dialect) -> Vec<Diagnostic> {
    let found = lines(source).filter_map(|(cursor, line)| {
        let block =
            if plain_block(&line, dialect).is_some() { None } else { parse(&source.decode(&line), dialect).ok() };
        let mut finding = placed(source, cursor, *priority_fault(priority_trap(&block?.statement)?));
        finding.severity = Severity::Warning;
        Some(finding)
    });
    found.collect()
}

/// Names of components of frames stand in brackets only.
const COMPONENTS: [&str; 5] = ["TR", "FI", "RT", "SC", "MI"];

/// Names without DEF and control words without partner. Only for programs whose every line can be read: a typo in a DEF or an ENDIF
/// would be reported twice.
fn names_and_partners(source: &ProgramSource, setup: &Setup, dialect: &Dialect) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for unmatched in source.structure().into_iter().flat_map(Structure::all_unmatched) {
        let end = source.line_text(unmatched.cursor).trim_end().len() as u32;
        found.push(placed(source, unmatched.cursor, *unbalanced(unmatched.word, unmatched.missing, 0..end)));
    }
    let mut defined: BTreeSet<Arc<str>> = BTreeSet::new();
    for source in setup.definitions.iter().chain([source]) {
        for (_, line) in lines(source) {
            match parse(&source.decode(&line), dialect).map(|block| block.statement) {
                Ok(Statement::Define(definition)) => {
                    defined.extend(definition.variables.into_iter().map(|variable| variable.name));
                }
                Ok(Statement::Procedure(header)) => {
                    defined.extend(header.parameters.iter().map(|parameter| parameter.name.clone()));
                }
                _ => {}
            }
        }
    }
    let mut reported: BTreeSet<Arc<str>> = BTreeSet::new();
    for (cursor, line) in lines(source) {
        let Ok(block) = parse(&source.decode(&line), dialect) else { continue };
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
        Statement::IfJump(branches) => {
            for (condition, jump) in branches {
                visit_names(condition, visit);
                visit_jump(jump, visit);
            }
        }
        Statement::Call(call) => visit_call(call, visit),
        Statement::ModalCall(Some(call)) => visit_call(call, visit),
        Statement::RepeatBlocks(repeat) => repeat.passes.iter().for_each(|passes| visit_names(passes, visit)),
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

fn visit_call(call: &Call, visit: &mut impl FnMut(&Arc<str>, &Columns)) {
    if let Callee::Text(name) = &call.callee {
        visit_names(name, visit);
    }
    call.arguments.iter().flatten().chain(&call.passes).for_each(|value| visit_names(value, visit));
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
                    known.severity == Severity::Error
                        && known.line() == alarm.line()
                        && known.code == alarm.code
                        && known.place.as_ref().map(|place| &place.file)
                            == alarm.place.as_ref().map(|place| &place.file)
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
