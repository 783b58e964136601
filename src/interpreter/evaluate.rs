//! Expression -> [`Value`].
//!
//! In: an [`Expr`] and the variables. Out: its value, or a finding with its place. Angles in degrees. INT and REAL mix as on the
//! control: `/` is always REAL, DIV and MOD truncate. An INT result outside 32 bits goes on as REAL; only storing it in an INT is
//! an alarm. AND, OR, XOR take both sides (no short cut).

use super::run::Interpreter;
use super::strings::text_function;
use super::value::Value;
use crate::base::Portable;
use crate::base::units::{deg_from_rad, rad_from_deg};
use crate::program::syntax::{Binary, Expr, ExprKind, Unary};
use crate::program::words::Function;
use crate::program::{Columns, Fault, Outcome, TEXT_MAX, codes};
use std::cmp::Ordering;
use std::sync::Arc;

/// Evaluates `expression`.
pub fn evaluate(expression: &Expr, context: &Interpreter) -> Outcome<Value> {
    let columns = &expression.columns;
    match &expression.kind {
        ExprKind::Bool(value) => Ok(Value::Bool(*value)),
        ExprKind::Int(value) => Ok(Value::Int(*value)),
        ExprKind::Real(value) => Ok(Value::Real(*value)),
        ExprKind::Text(text) => Ok(Value::Text(text.clone())),
        ExprKind::Parameter(index) => {
            let number = evaluate(index, context)?.integer(&index.columns)?;
            context.variables.parameter(number, columns).map(Value::Real)
        }
        ExprKind::Variable { name, indices } => variable(name, indices, context, columns),
        ExprKind::System(system) => context.system_variable(system, columns),
        ExprKind::Unary(operator, operand) => unary(*operator, evaluate(operand, context)?, columns),
        ExprKind::Binary(operator, operands) => {
            let (left, right) = (evaluate(&operands.0, context)?, evaluate(&operands.1, context)?);
            binary(*operator, &left, &right, operands, context, columns)
        }
        ExprKind::Call(function, arguments) => call(*function, arguments, context, columns),
    }
}

/// Evaluates to a number.
pub fn number(expression: &Expr, context: &Interpreter) -> Outcome<f64> {
    // The plain number of most words needs no detour over `Value`.
    match expression.kind {
        ExprKind::Real(value) => Ok(value),
        ExprKind::Int(value) => Ok(f64::from(value)),
        _ => evaluate(expression, context)?.number(&expression.columns),
    }
}

/// Evaluates a list of indices.
pub fn integers(expressions: &[Expr], context: &Interpreter) -> Outcome<Vec<i32>> {
    expressions.iter().map(|index| evaluate(index, context)?.integer(&index.columns)).collect()
}

/// A variable, a character of one, or the name of an axis.
fn variable(name: &Arc<str>, indices: &[Expr], context: &Interpreter, columns: &Columns) -> Outcome<Value> {
    if indices.is_empty()
        && !context.variables.is_declared(name)
        && let Some(axis) = context.dialect.axis(name)
    {
        return Ok(Value::Axis(Some(axis)));
    }
    if let Some(dimensions) = context.variables.frame_dimensions(name) {
        return context.user_frame(name, dimensions, indices, columns);
    }
    let indices = integers(indices, context)?;
    context.variables.get(name, &indices, columns)
}

fn finite(value: f64, columns: &Columns) -> Outcome<Value> {
    if value.is_finite() {
        return Ok(Value::Real(value));
    }
    Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), "the result is too large for a REAL").label("overflow"))
}

/// An integer result, or REAL where it does not fit 32 bits.
fn whole(value: i64) -> Value {
    i32::try_from(value).map_or(Value::Real(value as f64), Value::Int)
}

fn unary(operator: Unary, operand: Value, columns: &Columns) -> Outcome<Value> {
    match (operator, operand) {
        (Unary::Minus, Value::Int(value)) => Ok(whole(-i64::from(value))),
        (Unary::Minus, operand) => Ok(Value::Real(-operand.number(columns)?)),
        (Unary::Plus, operand) => {
            operand.number(columns)?;
            Ok(operand)
        }
        (Unary::Not, operand) => Ok(Value::Bool(!operand.truth(columns)?)),
        (Unary::BitNot, operand) => Ok(Value::Int(!operand.integer(columns)?)),
    }
}

fn binary(
    operator: Binary,
    left: &Value,
    right: &Value,
    operands: &(Expr, Expr),
    context: &Interpreter,
    columns: &Columns,
) -> Outcome<Value> {
    let (left_columns, right_columns) = (&operands.0.columns, &operands.1.columns);
    let numbers = || Ok::<_, Box<Fault>>((left.number(left_columns)?, right.number(right_columns)?));
    let integers = || Ok::<_, Box<Fault>>((left.integer(left_columns)?, right.integer(right_columns)?));
    let truths = || Ok::<_, Box<Fault>>((left.truth(left_columns)?, right.truth(right_columns)?));
    let compared = |wanted: fn(Ordering) -> bool| left.compare(right, columns).map(|order| Value::Bool(wanted(order)));
    match operator {
        Binary::Add | Binary::Subtract | Binary::Multiply => {
            if let (Value::Int(a), Value::Int(b)) = (left, right) {
                let (a, b) = (i64::from(*a), i64::from(*b));
                return Ok(whole(match operator {
                    Binary::Add => a + b,
                    Binary::Subtract => a - b,
                    _ => a * b,
                }));
            }
            let (a, b) = numbers()?;
            let result = match operator {
                Binary::Add => a + b,
                Binary::Subtract => a - b,
                _ => a * b,
            };
            finite(result, columns)
        }
        Binary::Divide | Binary::IntegerDivide | Binary::Modulo => {
            let (a, b) = numbers()?;
            divide(operator, a, b, left, right, (columns, right_columns))
        }
        Binary::BitAnd => integers().map(|(a, b)| Value::Int(a & b)),
        Binary::BitXor => integers().map(|(a, b)| Value::Int(a ^ b)),
        Binary::BitOr => integers().map(|(a, b)| Value::Int(a | b)),
        Binary::And => truths().map(|(a, b)| Value::Bool(a && b)),
        Binary::Xor => truths().map(|(a, b)| Value::Bool(a != b)),
        Binary::Or => truths().map(|(a, b)| Value::Bool(a || b)),
        Binary::Chain => chain(left, right, columns),
        Binary::Join => join(left, right, context, columns),
        Binary::Equal => compared(Ordering::is_eq),
        Binary::Unequal => compared(Ordering::is_ne),
        Binary::Greater => compared(Ordering::is_gt),
        Binary::Less => compared(Ordering::is_lt),
        Binary::GreaterEqual => compared(Ordering::is_ge),
        Binary::LessEqual => compared(Ordering::is_le),
    }
}

fn divide(
    operator: Binary,
    a: f64,
    b: f64,
    left: &Value,
    right: &Value,
    columns: (&Columns, &Columns),
) -> Outcome<Value> {
    if b == 0.0 {
        return Err(Fault::new(codes::DIVISION_BY_ZERO, columns.1.clone(), "division by zero").label("this is 0"));
    }
    let both_whole = !matches!((left, right), (Value::Real(_), _) | (_, Value::Real(_)));
    match operator {
        Binary::Divide => finite(a / b, columns.0),
        Binary::IntegerDivide => {
            let quotient = (a / b).trunc();
            if quotient.abs() <= f64::from(i32::MAX) {
                Ok(Value::Int(quotient as i32))
            } else {
                finite(quotient, columns.0)
            }
        }
        _ if both_whole => Ok(whole((a % b) as i64)),
        _ => finite(a % b, columns.0),
    }
}

/// `:` joins frames.
fn chain(left: &Value, right: &Value, columns: &Columns) -> Outcome<Value> {
    if let (Value::Frame(outer), Value::Frame(inner)) = (left, right) {
        return Ok(Value::Frame(Arc::new(outer.chained(inner))));
    }
    Err(Fault::new(codes::TYPE_MISMATCH, columns.clone(), "`:` chains frames").label("expected frames on both sides"))
}

fn join(left: &Value, right: &Value, context: &Interpreter, columns: &Columns) -> Outcome<Value> {
    let text = format!("{}{}", context.text_of(left, columns)?, context.text_of(right, columns)?);
    if text.chars().count() > usize::from(TEXT_MAX) {
        return Err(Fault::new(
            codes::TEXT_TOO_LONG,
            columns.clone(),
            format!("a text has at most {TEXT_MAX} characters"),
        )
        .label("this one would be longer"));
    }
    Ok(Value::Text(text.into()))
}

fn call(function: Function, arguments: &[Expr], context: &Interpreter, columns: &Columns) -> Outcome<Value> {
    if let Some(result) = text_function(function, arguments, context, columns) {
        return result;
    }
    let mut values = [0.0; 3];
    for (value, argument) in values.iter_mut().zip(arguments) {
        *value = number(argument, context)?;
    }
    let [a, b, c] = values;
    let outside = |needed: &str| {
        let name = format!("{function:?}").to_ascii_uppercase();
        Err(Fault::new(codes::OUT_OF_DOMAIN, columns.clone(), format!("{name} of {a} does not exist"))
            .label(format!("expected {needed}")))
    };
    let result = match function {
        Function::Sin => sine(a),
        Function::Cos => sine(a + 90.0),
        Function::Tan if sine(a + 90.0) == 0.0 => return outside("an angle whose cosine is not 0"),
        Function::Tan => sine(a) / sine(a + 90.0),
        Function::Asin | Function::Acos if !(-1.0..=1.0).contains(&a) => return outside("a value from -1 to 1"),
        Function::Asin => deg_from_rad(a.portable_asin()),
        Function::Acos => deg_from_rad(a.portable_acos()),
        Function::Atan2 => deg_from_rad(a.portable_atan2(b)),
        Function::Sqrt if a < 0.0 => return outside("a value from 0"),
        Function::Sqrt => a.sqrt(),
        Function::Pot => a * a,
        Function::Abs => a.abs(),
        Function::Trunc => return Ok(whole_if_it_fits(a.trunc())),
        Function::Round => return Ok(whole_if_it_fits(a.round())),
        Function::RoundUp => return Ok(whole_if_it_fits(a.ceil())),
        Function::Ln if a <= 0.0 => return outside("a value above 0"),
        Function::Ln => a.portable_ln(),
        Function::Exp => a.portable_exp(),
        Function::MinVal => a.min(b),
        Function::MaxVal => a.max(b),
        Function::Bound if a > b => return outside("the lower bound first, then the upper"),
        Function::Bound => c.clamp(a, b),
        // All others work on texts, axes and frames: they have been dealt with.
        _ => return outside("another function"),
    };
    finite(result, columns)
}

fn whole_if_it_fits(value: f64) -> Value {
    if value.abs() <= f64::from(i32::MAX) { Value::Int(value as i32) } else { Value::Real(value) }
}

/// Sine of an angle in degrees, exact at multiples of 90.
fn sine(angle_deg: f64) -> f64 {
    let turn_deg = angle_deg.rem_euclid(360.0);
    // Into the first quadrant, where the reduced angle is exact.
    let (sign, half_deg) = if turn_deg < 180.0 { (1.0, turn_deg) } else { (-1.0, turn_deg - 180.0) };
    let acute_deg = if half_deg > 90.0 { 180.0 - half_deg } else { half_deg };
    match acute_deg {
        0.0 => 0.0,
        90.0 => sign,
        _ => sign * rad_from_deg(acute_deg).portable_sin(),
    }
}
