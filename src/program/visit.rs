//! Every expression of a statement.
//!
//! In: a [`Statement`]. Out: its expressions, one after another, innermost included. Does not evaluate.

use super::codes::Columns;
use super::syntax::{
    Binary, Call, Callee, Case, Definition, Destination, Expr, ExprKind, IndexedValue, Initial, Jump, Statement,
    SystemName, Target, Word, WordKind,
};
use super::system_variables::SystemVariable;

/// Calls `visit` for every expression of a statement, those inside others included, and for the targets of assignments.
pub fn visit_expressions(statement: &Statement, visit: &mut impl FnMut(&Expr)) {
    match statement {
        Statement::Words(words) => words.iter().for_each(|word| visit_word(word, visit)),
        Statement::Define(definition) => visit_definition(definition, visit),
        Statement::If(condition) | Statement::While(condition) | Statement::Until(condition) => {
            visit_expression(condition, visit);
        }
        Statement::IfJump(branches) => {
            for (condition, jump) in branches {
                visit_expression(condition, visit);
                visit_jump(jump, visit);
            }
        }
        Statement::Call(call) => visit_call(call, visit),
        Statement::ModalCall(Some(call)) => visit_call(call, visit),
        Statement::CallPath(path) => path.iter().for_each(|path| visit_expression(path, visit)),
        Statement::RepeatBlocks(repeat) => repeat.passes.iter().for_each(|passes| visit_expression(passes, visit)),
        Statement::Return(wanted) => {
            let given = [&wanted.target, &wanted.behind, &wanted.levels, &wanted.from_start];
            given.into_iter().flatten().for_each(|value| visit_expression(value, visit));
        }
        Statement::For(for_loop) => {
            visit_target(&for_loop.counter, visit);
            visit_expression(&for_loop.first, visit);
            visit_expression(&for_loop.last, visit);
        }
        Statement::Jump(jump) => visit_jump(jump, visit),
        Statement::Case(case) => visit_case(case, visit),
        _ => {}
    }
}

/// True if an expression reads a variable of the main run, or one that this program does not know.
pub fn mentions_main_run(expression: &Expr) -> bool {
    let mut found = false;
    visit_expression(expression, &mut |expression| {
        if let ExprKind::System(SystemName { name, .. }) = &expression.kind {
            found |= SystemVariable::find(name).is_none_or(|variable| variable.main_run);
        }
    });
    found
}

/// True if a statement reads a variable of the main run.
pub fn reads_main_run(statement: &Statement) -> bool {
    let mut found = false;
    visit_expressions(statement, &mut |expression| {
        if let ExprKind::System(SystemName { name, .. }) = &expression.kind {
            found |= SystemVariable::find(name).is_some_and(|variable| variable.main_run);
        }
    });
    found
}

/// A comparison whose operand is an AND, OR or XOR without brackets, or a second comparison: `A == 1 AND B == 2` compares `A` with
/// `1 AND B`. The control takes it without a word; what is marked is the whole of it.
pub fn priority_trap(statement: &Statement) -> Option<Columns> {
    let mut found = None;
    visit_expressions(statement, &mut |expression| {
        if let ExprKind::Binary(operator, operands) = &expression.kind
            && operator.compares()
            && [&operands.0, &operands.1].into_iter().any(bare_condition)
        {
            // The outermost one is met first.
            found.get_or_insert(expression.columns.clone());
        }
    });
    found
}

/// A condition without brackets of its own: with them its columns would begin before those of its first operand.
fn bare_condition(operand: &Expr) -> bool {
    let ExprKind::Binary(operator, operands) = &operand.kind else { return false };
    let is_condition = operator.compares() || matches!(operator, Binary::And | Binary::Or | Binary::Xor);
    is_condition && operand.columns.start == operands.0.columns.start
}

fn visit_word(word: &Word, visit: &mut impl FnMut(&Expr)) {
    match &word.kind {
        WordKind::Address(_, value) => visit_expression(&value.value, visit),
        WordKind::Indexed { index, values, .. } => {
            index.iter().for_each(|index| visit_expression(index, visit));
            match values {
                IndexedValue::One(value) => visit_expression(&value.value, visit),
                IndexedValue::List(values) => {
                    values.iter().flatten().for_each(|value| visit_expression(&value.value, visit));
                }
            }
        }
        WordKind::Procedure(_, given) => given.iter().flatten().for_each(|value| visit_expression(value, visit)),
        WordKind::Message(text) => text.iter().for_each(|text| visit_expression(text, visit)),
        WordKind::Assign(target, value) => {
            visit_target(target, visit);
            visit_expression(value, visit);
        }
        WordKind::Fill(target, initial) => {
            visit_target(target, visit);
            visit_initial(initial, visit);
        }
        _ => {}
    }
}

fn visit_definition(definition: &Definition, visit: &mut impl FnMut(&Expr)) {
    for variable in &definition.variables {
        variable.dimensions.iter().for_each(|size| visit_expression(size, visit));
        visit_initial(&variable.initial, visit);
    }
}

fn visit_initial(initial: &Initial, visit: &mut impl FnMut(&Expr)) {
    match initial {
        Initial::None => {}
        Initial::One(value) => visit_expression(value, visit),
        Initial::Set(values) => values.iter().flatten().for_each(|value| visit_expression(value, visit)),
        Initial::Repeat(value, count) => {
            visit_expression(value, visit);
            count.iter().for_each(|count| visit_expression(count, visit));
        }
    }
}

fn visit_case(case: &Case, visit: &mut impl FnMut(&Expr)) {
    visit_expression(&case.selector, visit);
    for (value, jump) in &case.branches {
        visit_expression(value, visit);
        visit_jump(jump, visit);
    }
    case.default.iter().for_each(|jump| visit_jump(jump, visit));
}

fn visit_call(call: &Call, visit: &mut impl FnMut(&Expr)) {
    if let Callee::Text(name) = &call.callee {
        visit_expression(name, visit);
    }
    call.arguments.iter().flatten().chain(&call.passes).for_each(|value| visit_expression(value, visit));
}

fn visit_jump(jump: &Jump, visit: &mut impl FnMut(&Expr)) {
    if let Some(Destination::Text(text)) = &jump.destination {
        visit_expression(text, visit);
    }
}

/// Indices of the place that is written; the place itself is not read.
fn visit_target(target: &Target, visit: &mut impl FnMut(&Expr)) {
    match target {
        Target::Parameter(index) => visit_expression(index, visit),
        Target::Variable { indices, .. } | Target::System(SystemName { indices, .. }) => {
            indices.iter().for_each(|index| visit_expression(index, visit));
        }
    }
}

fn visit_expression(expression: &Expr, visit: &mut impl FnMut(&Expr)) {
    visit(expression);
    match &expression.kind {
        ExprKind::Parameter(index) => visit_expression(index, visit),
        ExprKind::Variable { indices, .. } | ExprKind::System(SystemName { indices, .. }) => {
            indices.iter().for_each(|index| visit_expression(index, visit));
        }
        ExprKind::Unary(_, operand) => visit_expression(operand, visit),
        ExprKind::Binary(_, operands) => {
            visit_expression(&operands.0, visit);
            visit_expression(&operands.1, visit);
        }
        ExprKind::Call(_, arguments) => arguments.iter().for_each(|argument| visit_expression(argument, visit)),
        ExprKind::Bool(_) | ExprKind::Int(_) | ExprKind::Real(_) | ExprKind::Text(_) => {}
    }
}
