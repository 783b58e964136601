//! Statements that fill a block: DEF, IF, FOR, WHILE, LOOP, REPEAT, CASE and jumps.
//!
//! In: a [`Lexer`] behind the first word. Out: [`Statement`]. What stands behind the statement is the caller's business.
//! Partners (IF and its ENDIF) are found by `structure`, not here.

use super::calls;
use super::codes::{self, Columns, Fault, Outcome};
use super::expression::{arguments, expected, expression, indices};
use super::lexer::{Lexer, Number, Token};
use super::syntax::{
    Case, DefinedVariable, Definition, Destination, Direction, Expr, ExprKind, ForLoop, Initial, Jump, Statement,
    Target, VariableType,
};
use super::words::{self, Control, Role};
use std::sync::Arc;

/// Longest text of the control, and of a STRING without a length.
pub const TEXT_MAX: u16 = 400;
/// Longest name of a variable.
const NAME_MAX: usize = 31;
/// Dimensions of an array.
pub(super) const DIMENSIONS_MAX: usize = 3;
/// Jumps in one IF block.
const BRANCHES_MAX: usize = 100;

/// Reads the statement that `control` opens; its word stands at `columns`.
pub fn statement(control: Control, lexer: &mut Lexer, columns: Columns) -> Outcome<Statement> {
    Ok(match control {
        Control::Define => Statement::Define(definition(lexer)?),
        Control::If => if_statement(lexer)?,
        Control::Else => Statement::Else,
        Control::EndIf => Statement::EndIf,
        Control::For => Statement::For(Box::new(for_loop(lexer)?)),
        Control::EndFor => Statement::EndFor,
        Control::While => Statement::While(expression(lexer)?),
        Control::EndWhile => Statement::EndWhile,
        Control::Loop => Statement::Loop,
        Control::EndLoop => Statement::EndLoop,
        Control::Repeat if lexer.at_end() => Statement::Repeat,
        Control::Repeat => calls::repeat_blocks(lexer, false)?,
        Control::RepeatBlock => calls::repeat_blocks(lexer, true)?,
        Control::Procedure => calls::procedure(lexer)?,
        Control::External => calls::external(lexer)?,
        Control::Return => calls::return_statement(lexer, columns)?,
        Control::Call => calls::call_by_text(lexer)?,
        Control::PathCall => calls::call_by_path(lexer)?,
        Control::ModalCall => calls::modal_call(lexer)?,
        Control::FileCall => calls::call_of_file(lexer)?,
        Control::IsoCall => calls::iso_call(lexer, columns)?,
        Control::CallPath => calls::call_path(lexer)?,
        Control::Until => Statement::Until(expression(lexer)?),
        Control::Jump(direction) => Statement::Jump(jump(direction, lexer)?),
        Control::Case => Statement::Case(Box::new(case(lexer)?)),
    })
}

/// IF condition, or IF condition GOTOF label, also several of these in one block: the first that is true leads away.
fn if_statement(lexer: &mut Lexer) -> Outcome<Statement> {
    let condition = expression(lexer)?;
    let Some(direction) = jump_word(lexer) else { return Ok(Statement::If(condition)) };
    let mut branches = vec![(condition, jump(direction, lexer)?)];
    loop {
        if let Some(direction) = jump_word(lexer) {
            // IF a GOTOF b GOTOF c: what is reached is not under the condition.
            let columns = lexer.columns_of_next();
            branches.push((Expr { columns, kind: ExprKind::Bool(true) }, jump(direction, lexer)?));
        } else if branches.len() < BRANCHES_MAX && keyword(lexer, "IF") {
            let condition = expression(lexer)?;
            let Some(direction) = jump_word(lexer) else { return Err(expected(lexer, "GOTOF or another jump")) };
            branches.push((condition, jump(direction, lexer)?));
        } else {
            return Ok(Statement::IfJump(branches));
        }
    }
}

/// GOTOF and its kin, if one of them comes next.
fn jump_word(lexer: &mut Lexer) -> Option<Direction> {
    let mut ahead = *lexer;
    match ahead.name().and_then(words::role) {
        Some(Role::Control(Control::Jump(direction))) => {
            *lexer = ahead;
            Some(direction)
        }
        _ => None,
    }
}

fn jump(direction: Direction, lexer: &mut Lexer) -> Outcome<Jump> {
    let start = lexer.position();
    if direction == Direction::Start {
        return Ok(Jump { direction, destination: None, columns: lexer.columns_of_next() });
    }
    let destination = destination(lexer)?;
    Ok(Jump { direction, destination: Some(destination), columns: lexer.columns_from(start) })
}

/// A label, `N90`, `:90`, or a text that is computed.
pub(super) fn destination(lexer: &mut Lexer) -> Outcome<Destination> {
    let mut ahead = *lexer;
    if ahead.peek_byte() == Some(b':') {
        ahead.skip_byte();
    }
    let destination = match ahead.token()? {
        Token::Number(Number::Int(number)) if number >= 0 => Destination::Number(u64::from(number.unsigned_abs())),
        Token::Name(name) => match (block_number(name), ahead.peek()) {
            (Some(number), _) => Destination::Number(number),
            (None, Token::Symbol("<<" | "[" | "(")) => {
                ahead = *lexer;
                Destination::Text(expression(&mut ahead)?)
            }
            (None, _) => Destination::Name(name.to_ascii_uppercase().into()),
        },
        Token::Text(_) => {
            ahead = *lexer;
            Destination::Text(expression(&mut ahead)?)
        }
        _ => return Err(expected(lexer, "a label or a block number")),
    };
    *lexer = ahead;
    Ok(destination)
}

/// `N90` -> 90.
pub fn block_number(name: &str) -> Option<u64> {
    let digits = name.strip_prefix(['N', 'n'])?;
    if digits.bytes().all(|byte| byte.is_ascii_digit()) { digits.parse().ok() } else { None }
}

pub(super) fn keyword(lexer: &mut Lexer, word: &str) -> bool {
    let mut ahead = *lexer;
    let found = ahead.name().is_some_and(|name| name.eq_ignore_ascii_case(word));
    if found {
        *lexer = ahead;
    }
    found
}

fn for_loop(lexer: &mut Lexer) -> Outcome<ForLoop> {
    let start = lexer.position();
    let mut counter = *lexer;
    let target = match expression(&mut counter).map(|counter| counter.kind) {
        Ok(ExprKind::Parameter(index)) => Target::Parameter(*index),
        Ok(ExprKind::Variable { name, indices }) => Target::Variable { name, indices },
        _ => return Err(expected(lexer, "the variable that counts")),
    };
    *lexer = counter;
    let counter_columns = lexer.columns_from(start);
    if !lexer.take("=") {
        return Err(expected(lexer, "`=`"));
    }
    let first = expression(lexer)?;
    if !keyword(lexer, "TO") {
        return Err(expected(lexer, "TO"));
    }
    Ok(ForLoop { counter: target, counter_columns, first, last: expression(lexer)? })
}

fn case(lexer: &mut Lexer) -> Outcome<Case> {
    let selector = expression(lexer)?;
    if !keyword(lexer, "OF") {
        return Err(expected(lexer, "OF"));
    }
    let mut branches = Vec::new();
    let mut default = None;
    while !lexer.at_end() && default.is_none() {
        let value = if keyword(lexer, "DEFAULT") { None } else { Some(expression(lexer)?) };
        let Some(direction) = jump_word(lexer) else { return Err(expected(lexer, "GOTOF or another jump")) };
        let target = jump(direction, lexer)?;
        match value {
            Some(value) => branches.push((value, target)),
            None => default = Some(target),
        }
    }
    Ok(Case { selector, branches, default })
}

fn definition(lexer: &mut Lexer) -> Outcome<Definition> {
    let global = keyword(lexer, "NCK") || keyword(lexer, "CHAN");
    attributes(lexer)?;
    let variable_type = variable_type(lexer)?;
    let mut variables = vec![defined_variable(lexer)?];
    while lexer.take(",") {
        variables.push(defined_variable(lexer)?);
    }
    // Limits of the value may also stand behind it.
    attributes(lexer)?;
    Ok(Definition { global, variable_type, variables })
}

/// Attributes of a definition that a simulation passes over: protection, synchronisation, physical unit, limits.
const ATTRIBUTES: [(&str, bool); 15] = [
    ("SYNR", false),
    ("SYNW", false),
    ("SYNRW", false),
    ("APR", true),
    ("APW", true),
    ("APX", true),
    ("APRP", true),
    ("APWP", true),
    ("APRB", true),
    ("APWB", true),
    ("PHU", true),
    ("LLI", true),
    ("ULI", true),
    ("IPO", false),
    ("PRLOC", false),
];

fn attributes(lexer: &mut Lexer) -> Outcome<()> {
    while let Some((_, has_value)) = ATTRIBUTES.iter().find(|(word, _)| keyword(lexer, word)) {
        if *has_value {
            expression(lexer)?;
        }
    }
    Ok(())
}

pub(super) fn variable_type(lexer: &mut Lexer) -> Outcome<VariableType> {
    let before = *lexer;
    let name = lexer.name().unwrap_or_default().to_ascii_uppercase();
    Ok(match name.as_str() {
        "BOOL" => VariableType::Bool,
        "CHAR" => VariableType::Char,
        "INT" => VariableType::Int,
        "REAL" => VariableType::Real,
        "STRING" => VariableType::Text(text_length(lexer)?),
        "AXIS" => VariableType::Axis,
        "FRAME" => VariableType::Frame,
        _ => return Err(expected(&before, "a type: BOOL, CHAR, INT, REAL, STRING[n], AXIS or FRAME")),
    })
}

fn text_length(lexer: &mut Lexer) -> Outcome<u16> {
    let start = lexer.position();
    if !lexer.take("[") {
        return Ok(TEXT_MAX);
    }
    let length = match expression(lexer)?.kind {
        ExprKind::Int(length) => u16::try_from(length).ok().filter(|length| (1..=TEXT_MAX).contains(length)),
        _ => None,
    };
    if !lexer.take("]") {
        return Err(expected(lexer, "`]`"));
    }
    length.ok_or_else(|| {
        Fault::new(codes::OUT_OF_RANGE, lexer.columns_from(start), "this length of a STRING is not possible")
            .label(format!("expected 1 to {TEXT_MAX}"))
    })
}

fn defined_variable(lexer: &mut Lexer) -> Outcome<DefinedVariable> {
    let start = lexer.position();
    let Some(name) = lexer.name() else { return Err(expected(lexer, "the name of a variable")) };
    let columns = lexer.columns_from(start);
    check_name(name, &columns)?;
    let dimensions = indices(lexer)?;
    if dimensions.len() > DIMENSIONS_MAX {
        return Err(Fault::new(codes::BAD_INDEX, lexer.columns_from(start), "an array has at most three dimensions")
            .label("too many"));
    }
    let initial = match lexer.take("=") {
        true if dimensions.is_empty() => initial(lexer)?,
        true => bare_list(lexer).map_or_else(|| initial(lexer), Ok)?,
        false => Initial::None,
    };
    Ok(DefinedVariable { name: Arc::from(name.to_ascii_uppercase()), columns, dimensions, initial })
}

/// `(a, b, c)` behind the equals sign of an array: in a DEF the word SET may be left out. One value in brackets is an expression.
fn bare_list(lexer: &mut Lexer) -> Option<Initial> {
    let mut ahead = *lexer;
    if !ahead.take("(") {
        return None;
    }
    let values = arguments(&mut ahead, ")", false).ok().filter(|values| values.len() > 1)?;
    *lexer = ahead;
    Some(Initial::Set(values))
}

/// A value, SET(...) or REP(...).
pub(super) fn initial(lexer: &mut Lexer) -> Outcome<Initial> {
    let mut ahead = *lexer;
    let name = ahead.name().unwrap_or_default();
    let (is_set, is_rep) = (name.eq_ignore_ascii_case("SET"), name.eq_ignore_ascii_case("REP"));
    if !(is_set || is_rep) || !ahead.take("(") {
        return Ok(Initial::One(expression(lexer)?));
    }
    let start = lexer.position();
    *lexer = ahead;
    let mut values = arguments(lexer, ")", false)?;
    if is_set {
        return Ok(Initial::Set(values));
    }
    let count = if values.len() == 2 { values.pop().flatten() } else { None };
    match (values.pop().flatten(), values.is_empty()) {
        (Some(value), true) => Ok(Initial::Repeat(value, count)),
        _ => Err(Fault::new(codes::EXPECTED_VALUE, lexer.columns_from(start), "REP takes a value and how often")
            .label("expected REP(value, count)")),
    }
}

/// Names of variables begin with two letters or underscores and are not words of the language.
pub(super) fn check_name(name: &str, columns: &Columns) -> Outcome<()> {
    let letter = |byte: u8| byte.is_ascii_alphabetic() || byte == b'_';
    let starts_well = match name.as_bytes() {
        [first] => letter(*first),
        [first, second, ..] => letter(*first) && letter(*second),
        [] => false,
    };
    if !starts_well {
        return Err(Fault::new(
            codes::REDECLARED,
            columns.clone(),
            format!("`{name}` cannot be the name of a variable"),
        )
        .label("expected two letters or underscores at its start")
        .maybe_help(name.starts_with(['R', 'r']).then(|| "R parameters need no DEF".to_owned())));
    }
    if name.len() > NAME_MAX {
        return Err(Fault::new(
            codes::REDECLARED,
            columns.clone(),
            format!("the name of a variable has at most {NAME_MAX} characters"),
        )
        .label(format!("{} here", name.len())));
    }
    if name.len() == 1 || words::role(name).is_some_and(|role| !words::is_free_name(role)) {
        return Err(Fault::new(codes::REDECLARED, columns.clone(), format!("`{name}` is a word of the language"))
            .label("expected a name of its own"));
    }
    Ok(())
}

/// Used by checks: the variables that an expression names.
pub fn visit_names(expression: &Expr, visit: &mut impl FnMut(&Arc<str>, &Columns)) {
    match &expression.kind {
        ExprKind::Variable { name, indices } => {
            visit(name, &expression.columns);
            indices.iter().for_each(|index| visit_names(index, visit));
        }
        ExprKind::Parameter(index) => visit_names(index, visit),
        ExprKind::Unary(_, operand) => visit_names(operand, visit),
        ExprKind::Binary(_, operands) => {
            visit_names(&operands.0, visit);
            visit_names(&operands.1, visit);
        }
        ExprKind::Call(_, arguments) => arguments.iter().for_each(|argument| visit_names(argument, visit)),
        ExprKind::System(system) => system.indices.iter().for_each(|index| visit_names(index, visit)),
        ExprKind::Bool(_) | ExprKind::Int(_) | ExprKind::Real(_) | ExprKind::Text(_) => {}
    }
}
