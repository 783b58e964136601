//! Headers and calls of sub-programs, and repeated parts: PROC, EXTERN, NAME(...), L12, CALL, PCALL, MCALL, EXTCALL, RET, REPEAT.
//!
//! In: a [`Lexer`] behind the first word. Out: [`Statement`]. Does not look sub-programs up: whether one exists is known at run time,
//! as on the control.

use super::codes::{self, Columns, Fault, Outcome};
use super::dialect::Dialect;
use super::expression::{arguments, expected, expression, unused_expression};
use super::lexer::{Lexer, Token};
use super::statements::{check_name, destination, keyword, variable_type};
use super::syntax::{Call, Callee, Expr, ExprKind, Header, Parameter, RepeatBlocks, Return, Statement, VariableType};
use super::words::{self, Role};
use std::sync::Arc;

/// Parameters of a sub-program (the control allows 127).
const PARAMETERS_MAX: usize = 127;
/// Words behind the parameters of PROC that say nothing to a simulation.
const ATTRIBUTES: [&str; 11] = [
    "DISPLOF",
    "DISPLON",
    "SBLOF",
    "SBLON",
    "ACTBLOCNO",
    "PREPRO",
    "IPTRLOCK",
    "IPTRUNLOCK",
    "ICYCOF",
    "ICYCON",
    "ASUP",
];

/// PROC NAME(REAL A, VAR INT B=1) SAVE DISPLOF.
pub(super) fn procedure(lexer: &mut Lexer) -> Outcome<Statement> {
    let mut header = header(lexer, false)?;
    loop {
        let mut ahead = *lexer;
        let Some(word) = ahead.name() else { break };
        let is_save = word.eq_ignore_ascii_case("SAVE");
        if !is_save && !ATTRIBUTES.iter().any(|known| known.eq_ignore_ascii_case(word)) {
            break;
        }
        header.save |= is_save;
        *lexer = ahead;
    }
    Ok(Statement::Procedure(Arc::new(header)))
}

/// EXTERN NAME(REAL, VAR INT).
pub(super) fn external(lexer: &mut Lexer) -> Outcome<Statement> {
    Ok(Statement::External(Arc::new(header(lexer, true)?)))
}

fn header(lexer: &mut Lexer, external: bool) -> Outcome<Header> {
    let start = lexer.position();
    let Some(name) = lexer.name() else { return Err(expected(lexer, "the name of a sub-program")) };
    let mut found = Header {
        name: name.to_ascii_uppercase().into(),
        columns: lexer.columns_from(start),
        parameters: Vec::new(),
        save: false,
    };
    if !lexer.take("(") || lexer.take(")") {
        return Ok(found);
    }
    loop {
        let parameter = parameter(lexer, external)?;
        if let Some(twice) = found.parameters.iter().find(|known| !external && known.name == parameter.name) {
            let message = format!("two parameters are called `{}`", twice.name);
            return Err(Fault::new(codes::REDECLARED, parameter.columns, message).label("named again"));
        }
        found.parameters.push(parameter);
        if lexer.take(")") {
            return Ok(found);
        }
        if !lexer.take(",") || found.parameters.len() >= PARAMETERS_MAX {
            return Err(expected(lexer, "`,` or `)`"));
        }
    }
}

fn parameter(lexer: &mut Lexer, external: bool) -> Outcome<Parameter> {
    let by_reference = keyword(lexer, "VAR");
    // `STRING[]`: as long as what is given.
    let mut variable_type = match unsized_text(lexer) {
        Some(text) => text,
        None => variable_type(lexer)?,
    };
    let start = lexer.position();
    let name = lexer.name();
    let columns = lexer.columns_from(start);
    if !external {
        let Some(name) = name else { return Err(expected(lexer, "the name of the parameter")) };
        check_parameter(name, &columns)?;
    }
    let mut dimensions = Vec::new();
    if lexer.take("[") {
        dimensions = arguments(lexer, "]", false)?;
        if dimensions.is_empty() {
            dimensions.push(None);
        }
        if dimensions.len() > super::statements::DIMENSIONS_MAX {
            return Err(
                Fault::new(codes::BAD_INDEX, columns, "an array has at most three dimensions").label("too many")
            );
        }
    }
    if let VariableType::Text(length) = &mut variable_type {
        *length = (*length).max(1);
    }
    let default = if lexer.take("=") { Some(expression(lexer)?) } else { None };
    let name = name.unwrap_or_default().to_ascii_uppercase().into();
    Ok(Parameter { name, columns, variable_type, by_reference, dimensions, default })
}

fn unsized_text(lexer: &mut Lexer) -> Option<VariableType> {
    let mut ahead = *lexer;
    let found = ahead.name().is_some_and(|name| name.eq_ignore_ascii_case("STRING")) && ahead.take("[");
    (found && ahead.take("]")).then(|| {
        *lexer = ahead;
        VariableType::Text(super::statements::TEXT_MAX)
    })
}

/// Parameters may be named as axes are: X in the sub-program is then the parameter in expressions, and the axis as an address.
fn check_parameter(name: &str, columns: &Columns) -> Outcome<()> {
    if name.len() == 1 && name.as_bytes()[0].is_ascii_alphabetic() {
        return Ok(());
    }
    check_name(name, columns)
}

/// The call of a sub-program by its name, if the word in front can be one: `NAME`, `NAME(1, 2)`, `NAME P3`, `L12 P=R1`.
pub(super) fn call_by_name(
    name: &str,
    columns: Columns,
    lexer: &mut Lexer,
    dialect: &Dialect,
) -> Outcome<Option<Call>> {
    let can_be_called = match name.as_bytes() {
        [b'L' | b'l', digits @ ..] if !digits.is_empty() && digits.iter().all(u8::is_ascii_digit) => true,
        [b'$', ..] | [_] => false,
        [letter, digit, ..] if letter.is_ascii_alphabetic() && digit.is_ascii_digit() => false,
        _ => dialect.axis(name).is_none() && matches!(words::role(name), None | Some(Role::FunctionNotBuilt(_))),
    };
    let mut ahead = *lexer;
    let follows = ahead.at_end() || ahead.take("(") || passes(&mut ahead)?.is_some();
    if !can_be_called || !follows {
        return Ok(None);
    }
    call(Callee::Name(name.to_ascii_uppercase().into()), columns, lexer).map(Some)
}

/// Arguments and P behind the name.
fn call(callee: Callee, columns: Columns, lexer: &mut Lexer) -> Outcome<Call> {
    let arguments = if lexer.take("(") { arguments(lexer, ")", false)? } else { Vec::new() };
    let passes = passes(lexer)?;
    Ok(Call { callee, columns, arguments, passes, section: None })
}

/// `P3`, `P 3` or `P=R1`.
fn passes(lexer: &mut Lexer) -> Outcome<Option<Expr>> {
    let mut ahead = *lexer;
    let start = ahead.position();
    let Some(digits) = ahead.name().and_then(|name| name.strip_prefix(['P', 'p'])) else { return Ok(None) };
    if digits.is_empty() && ahead.take("=") {
        *lexer = ahead;
        return expression(lexer).map(Some);
    }
    let number = match digits {
        "" if ahead.next_is_digit() => ahead.digits(),
        digits => digits.parse().ok(),
    };
    let Some(number) = number.and_then(|number| i32::try_from(number).ok()) else { return Ok(None) };
    *lexer = ahead;
    Ok(Some(Expr { columns: lexer.columns_from(start), kind: ExprKind::Int(number) }))
}

/// CALL "NAME", CALL NAMES[2], CALL "NAME" BLOCK A TO B, CALL BLOCK A TO B.
pub(super) fn call_by_text(lexer: &mut Lexer) -> Outcome<Statement> {
    let start = lexer.position();
    let own = keyword(lexer, "BLOCK");
    let callee = if own { Callee::Own } else { Callee::Text(expression(lexer)?) };
    let columns = lexer.columns_from(start);
    let mut section = None;
    if own || keyword(lexer, "BLOCK") {
        let first = destination(lexer)?;
        if !keyword(lexer, "TO") {
            return Err(expected(lexer, "TO and the last block"));
        }
        section = Some((first, destination(lexer)?));
    }
    let passes = passes(lexer)?;
    Ok(Statement::Call(Box::new(Call { callee, columns, arguments: Vec::new(), passes, section })))
}

/// EXTCALL "NAME", EXTCALL("NAME").
pub(super) fn call_of_file(lexer: &mut Lexer) -> Outcome<Statement> {
    let start = lexer.position();
    let callee = Callee::Text(expression(lexer)?);
    let columns = lexer.columns_from(start);
    let call = Call { callee, columns, arguments: Vec::new(), passes: None, section: None };
    Ok(Statement::Call(Box::new(call)))
}

/// PCALL /_N_SPF_DIR/NAME(1, 2).
pub(super) fn call_by_path(lexer: &mut Lexer) -> Outcome<Statement> {
    let start = lexer.position();
    let Some(path) = lexer.path() else { return Err(expected(lexer, "the path of a sub-program")) };
    let callee = Callee::Path(path.to_ascii_uppercase().into());
    let columns = lexer.columns_from(start);
    call(callee, columns, lexer).map(|call| Statement::Call(Box::new(call)))
}

/// MCALL NAME(1, 2), MCALL.
pub(super) fn modal_call(lexer: &mut Lexer) -> Outcome<Statement> {
    if lexer.at_end() {
        return Ok(Statement::ModalCall(None));
    }
    let start = lexer.position();
    let Some(name) = lexer.name() else { return Err(expected(lexer, "the name of a sub-program")) };
    let columns = lexer.columns_from(start);
    if let Some(Role::NotActedOn(entry)) = words::role(name) {
        if lexer.take("(") {
            arguments(lexer, ")", true)?;
        }
        return Ok(Statement::NotActedOn(entry, columns));
    }
    let call = call(Callee::Name(name.to_ascii_uppercase().into()), columns, lexer)?;
    Ok(Statement::ModalCall(Some(Arc::new(call))))
}

/// CALLPATH("/_N_WKS_DIR/_N_PARTS_WPD"), CALLPATH().
pub(super) fn call_path(lexer: &mut Lexer) -> Outcome<Statement> {
    if lexer.at_end() {
        return Ok(Statement::CallPath(None));
    }
    if !lexer.take("(") {
        return Err(expected(lexer, "`(`"));
    }
    Ok(Statement::CallPath(arguments(lexer, ")", false)?.into_iter().next().flatten()))
}

/// RET, RET("LABEL"), RET("LABEL", 0, 2).
pub(super) fn return_statement(lexer: &mut Lexer, columns: Columns) -> Outcome<Statement> {
    let mut given = if lexer.take("(") { arguments(lexer, ")", false)?.into_iter() } else { Vec::new().into_iter() };
    let mut next = || given.next().flatten();
    let (target, behind, levels, from_start) = (next(), next(), next(), next());
    Ok(Statement::Return(Box::new(Return { target, behind, levels, from_start, columns })))
}

/// REPEAT FIRST P=3, REPEAT FIRST LAST P=3, REPEATB FIRST P=3.
pub(super) fn repeat_blocks(lexer: &mut Lexer, one_block: bool) -> Outcome<Statement> {
    let start = lexer.position();
    let first = destination(lexer)?;
    let mut last = None;
    let mut times = passes(lexer)?;
    if !one_block && times.is_none() && matches!(lexer.peek(), Token::Name(_) | Token::Text(_)) {
        last = Some(destination(lexer)?);
        times = passes(lexer)?;
    }
    let columns = lexer.columns_from(start);
    Ok(Statement::RepeatBlocks(Box::new(RepeatBlocks { first, last, one_block, passes: times, columns })))
}

/// ISOCALL calls a program of another language.
pub(super) fn iso_call(lexer: &mut Lexer, columns: Columns) -> Outcome<Statement> {
    if !lexer.at_end() {
        unused_expression(lexer)?;
    }
    Err(Fault::new(codes::NOT_BUILT, columns, "ISOCALL calls a program in ISO mode, which is not built")
        .label("not built")
        .help("write the sub-program in SINUMERIK mode, and call it by its name"))
}
