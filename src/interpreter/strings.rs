//! Functions of texts and axes: TOUPPER, STRLEN, INDEX, SUBSTR, NUMBER, SPRINT, AXNAME and their kin.
//!
//! In: a function and its arguments. Out: its value, or `None` for the functions of numbers. Places in a text count from 0, and what is
//! not found is at -1. A text read as a number is what the language takes for one.

use super::evaluate::evaluate;
use super::run::Interpreter;
use super::value::{Value, trimmed};
use crate::base::AxisId;
use crate::program::syntax::{Expr, ExprKind};
use crate::program::words::Function;
use crate::program::{Columns, Fault, Outcome, TEXT_MAX, codes};
use std::fmt::Write;
use std::sync::Arc;

/// Not found.
const NOWHERE: i32 = -1;
/// Widest field of SPRINT.
const WIDTH_MAX: usize = 200;

impl Interpreter {
    /// A value as text: an axis has none.
    pub(super) fn text_of(&self, value: &Value, columns: &Columns) -> Outcome<Arc<str>> {
        value.text().ok_or_else(|| {
            Fault::new(codes::TYPE_MISMATCH, columns.clone(), "this value has no text")
                .label("expected a text or a number")
                .help("AXSTRING gives the name of an axis")
        })
    }

    /// Name of an axis in programs.
    pub(super) fn axis_name(&self, axis: AxisId) -> &str {
        &self.machine.axis(axis).name
    }

    /// An expression that names an axis.
    pub(super) fn axis_of(&self, expression: &Expr) -> Outcome<AxisId> {
        let no_axis = |text| {
            Fault::new(codes::UNKNOWN_AXIS, expression.columns.clone(), text)
                .label("expected the name of an axis")
                .help(format!("the axes of this machine are {}", self.dialect.axis_list()))
        };
        let value = evaluate(expression, self).map_err(|fault| {
            // A name that is nothing at all: an axis was meant, not a variable.
            if fault.code == codes::UNDECLARED { no_axis("this is no axis of the machine") } else { fault }
        });
        match value? {
            Value::Axis(Some(axis)) => Ok(axis),
            Value::Axis(None) => {
                Err(Fault::new(codes::TYPE_MISMATCH, expression.columns.clone(), "no axis is stored here")
                    .label("expected an axis"))
            }
            _ => Err(no_axis("this is no axis")),
        }
    }
}

/// The value of a function that works on texts or axes.
pub(super) fn text_function(
    function: Function,
    arguments: &[Expr],
    context: &Interpreter,
    columns: &Columns,
) -> Option<Outcome<Value>> {
    let call = TextCall { arguments, context, columns };
    Some(match function {
        Function::ToUpper => call.text(0).map(|text| Value::Text(text.to_uppercase().into())),
        Function::ToLower => call.text(0).map(|text| Value::Text(text.to_lowercase().into())),
        Function::StrLen => call.text(0).map(|text| Value::Int(length(&text))),
        Function::Index => call.find(|characters, wanted| characters.iter().position(|c| wanted.starts_with(*c))),
        Function::Rindex => call.find(|characters, wanted| characters.iter().rposition(|c| wanted.starts_with(*c))),
        Function::Match => call.place_of_text(),
        Function::Mindex => call.find(|characters, wanted| characters.iter().position(|c| wanted.contains(*c))),
        Function::Substr => call.part(),
        Function::Number => call.number_of_text(),
        Function::IsNumber => call.text(0).map(|text| Value::Bool(read_number(&text).is_some())),
        Function::AxName => call.axis_of_text(),
        Function::AxString => context.axis_of(&arguments[0]).map(|axis| Value::Text(context.axis_name(axis).into())),
        Function::IsAxis => call.integer(0).map(|number| {
            let place = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
            Value::Bool(place.and_then(|place| context.geometry.get(place)).is_some_and(Option::is_some))
        }),
        Function::IsVar => call.is_variable(),
        Function::Sprint => call.formatted(),
        Function::Ctrans
        | Function::Cfine
        | Function::Crot
        | Function::Crots
        | Function::Cscale
        | Function::Cmirror => context.frame_function(function, arguments, columns),
        _ => return None,
    })
}

struct TextCall<'a> {
    arguments: &'a [Expr],
    context: &'a Interpreter,
    columns: &'a Columns,
}

impl TextCall<'_> {
    fn value(&self, place: usize) -> Outcome<Value> {
        evaluate(&self.arguments[place], self.context)
    }

    /// A text; a CHAR is a text of one character.
    fn text(&self, place: usize) -> Outcome<Arc<str>> {
        match self.value(place)? {
            Value::Text(text) => Ok(text),
            Value::Char(character) => Ok(character.to_string().into()),
            Value::Int(code) if is_character(&self.arguments[place], code) => {
                Ok(char::from_u32(code.unsigned_abs()).unwrap_or(' ').to_string().into())
            }
            _ => Err(Fault::new(
                codes::TYPE_MISMATCH,
                self.arguments[place].columns.clone(),
                "a number stands where a text is needed",
            )
            .label("expected a text")
            .help("join it to a text: \"\"<<value")),
        }
    }

    fn integer(&self, place: usize) -> Outcome<i32> {
        self.value(place)?.integer(&self.arguments[place].columns)
    }

    fn find(&self, search: impl Fn(&[char], &str) -> Option<usize>) -> Outcome<Value> {
        let characters: Vec<char> = self.text(0)?.chars().collect();
        let found = search(&characters, &self.text(1)?);
        Ok(Value::Int(found.map_or(NOWHERE, |place| place as i32)))
    }

    /// MATCH(text, wanted): where the whole of `wanted` stands.
    fn place_of_text(&self) -> Outcome<Value> {
        let (text, wanted) = (self.text(0)?, self.text(1)?);
        let place = text.find(&*wanted).map(|at| length(&text[..at]));
        Ok(Value::Int(place.unwrap_or(NOWHERE)))
    }

    /// SUBSTR(text, from) or SUBSTR(text, from, count).
    fn part(&self) -> Outcome<Value> {
        let text = self.text(0)?;
        let from = self.integer(1)?;
        let count = if self.arguments.len() > 2 { self.integer(2)? } else { i32::from(TEXT_MAX) };
        match (usize::try_from(from), usize::try_from(count)) {
            (Ok(from), Ok(count)) => Ok(Value::Text(text.chars().skip(from).take(count).collect::<String>().into())),
            _ => Err(Fault::new(codes::OUT_OF_RANGE, self.columns.clone(), "a place or length below 0")
                .label("expected 0 or more")),
        }
    }

    fn number_of_text(&self) -> Outcome<Value> {
        let text = self.text(0)?;
        read_number(&text).map(Value::Real).ok_or_else(|| {
            Fault::new(codes::OUT_OF_DOMAIN, self.columns.clone(), format!("`{}` is no number", text.escape_debug()))
                .label("expected a text such as \"12.5\" or \"-1EX3\"")
                .help("ISNUMBER asks before")
        })
    }

    fn axis_of_text(&self) -> Outcome<Value> {
        let text = self.text(0)?;
        match self.context.dialect.axis(text.trim()) {
            Some(axis) => Ok(Value::Axis(Some(axis))),
            None => Err(Fault::new(
                codes::UNKNOWN_AXIS,
                self.columns.clone(),
                format!("the machine has no axis `{}`", text.escape_debug()),
            )
            .label("unknown axis")
            .help(format!("the axes of this machine are {}", self.context.dialect.axis_list()))),
        }
    }

    /// ISVAR("NAME"), ISVAR("NAME[1]"), ISVAR("R1"), ISVAR("$P_EP[X]").
    fn is_variable(&self) -> Outcome<Value> {
        let text = self.text(0)?.to_ascii_uppercase();
        let name = text.split(['[', ' ']).next().unwrap_or_default();
        let is_parameter = name.strip_prefix('R').is_some_and(|rest| {
            !rest.is_empty() && rest.bytes().all(|byte| byte.is_ascii_digit()) || text.starts_with("R[")
        });
        let is_system = crate::program::SystemVariable::find(name).is_some();
        Ok(Value::Bool(is_parameter || is_system || self.context.variables.is_declared(name)))
    }

    /// SPRINT("format", values...): %D %F %E %G %S %C %B %X with width and decimals, %% for the sign itself.
    fn formatted(&self) -> Outcome<Value> {
        let format = self.text(0)?;
        let mut values = self.arguments.iter().skip(1);
        let mut text = String::new();
        let mut rest = format.chars().peekable();
        while let Some(character) = rest.next() {
            if character != '%' {
                text.push(character);
                continue;
            }
            let mut specification = String::new();
            while let Some(next) = rest.peek().filter(|next| next.is_ascii_digit() || matches!(next, '.' | '-' | '+')) {
                specification.push(*next);
                rest.next();
            }
            match rest.next().map(|letter| letter.to_ascii_uppercase()) {
                Some('%') => text.push('%'),
                Some(letter) => {
                    let Some(value) = values.next() else {
                        return Err(Fault::new(codes::EXPECTED_VALUE, self.columns.clone(), "SPRINT lacks a value")
                            .label(format!("expected one for %{letter}")));
                    };
                    self.field(&mut text, &specification, letter, value)?;
                }
                None => text.push('%'),
            }
        }
        if text.chars().count() > usize::from(TEXT_MAX) {
            return Err(Fault::new(codes::TEXT_TOO_LONG, self.columns.clone(), "this text is too long")
                .label(format!("at most {TEXT_MAX} characters")));
        }
        Ok(Value::Text(text.into()))
    }

    fn field(&self, text: &mut String, specification: &str, letter: char, value: &Expr) -> Outcome<()> {
        let left = specification.starts_with('-');
        let mut numbers = specification.trim_start_matches(['-', '+']).split('.');
        let width = numbers.next().and_then(|width| width.parse().ok()).unwrap_or(0).min(WIDTH_MAX);
        let decimals: Option<usize> = numbers.next().and_then(|decimals| decimals.parse().ok());
        let decimals = decimals.map(|decimals| decimals.min(WIDTH_MAX));
        let evaluated = evaluate(value, self.context)?;
        let columns = &value.columns;
        let shown = match letter {
            'D' => evaluated.integer(columns)?.to_string(),
            'X' => format!("{:X}", evaluated.integer(columns)?),
            'B' => u8::from(evaluated.truth(columns)?).to_string(),
            'F' => format!("{:.*}", decimals.unwrap_or(6), evaluated.number(columns)?),
            'E' => exponential(evaluated.number(columns)?, decimals.unwrap_or(6)),
            'G' => trimmed(evaluated.number(columns)?),
            'C' | 'S' => match evaluated {
                Value::Int(code) if letter == 'C' => char::from_u32(code.unsigned_abs()).unwrap_or(' ').to_string(),
                other => self.context.text_of(&other, columns)?.to_string(),
            },
            _ => {
                return Err(Fault::new(
                    codes::OUT_OF_DOMAIN,
                    self.columns.clone(),
                    format!("SPRINT has no format %{}", letter.escape_debug()),
                )
                .label("expected %D, %F, %E, %G, %S, %C, %B or %X"));
            }
        };
        // Writing to a String cannot fail.
        let _ = if left { write!(text, "{shown:<width$}") } else { write!(text, "{shown:>width$}") };
        Ok(())
    }
}

/// A number that stands for a character: only where the expression is no plain number.
fn is_character(expression: &Expr, code: i32) -> bool {
    (0..=255).contains(&code) && !matches!(expression.kind, ExprKind::Real(_))
}

fn length(text: &str) -> i32 {
    text.chars().count() as i32
}

/// `1.5e3` with a sign and at least two digits in the exponent: 1.500000e+03.
fn exponential(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$e}");
    match text.split_once('e') {
        Some((mantissa, exponent)) => {
            let (sign, digits) = match exponent.strip_prefix('-') {
                Some(digits) => ('-', digits),
                None => ('+', exponent),
            };
            format!("{mantissa}e{sign}{digits:0>2}")
        }
        None => text,
    }
}

/// What the language takes for a number: sign, digits with a point, EX exponent; 'HFF' and 'B101' too.
fn read_number(text: &str) -> Option<f64> {
    let text = text.trim();
    let (negative, digits) = match text.as_bytes().first()? {
        b'-' => (true, &text[1..]),
        b'+' => (false, &text[1..]),
        _ => (false, text),
    };
    let upper = digits.to_ascii_uppercase();
    let (mantissa, exponent) = match upper.split_once("EX") {
        Some((mantissa, exponent)) => (mantissa, exponent),
        None => (upper.as_str(), "0"),
    };
    let has_digit = mantissa.bytes().any(|byte| byte.is_ascii_digit());
    let is_plain = mantissa.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    let exponent_digits = exponent.trim_start_matches(['-', '+']);
    let exponent_is_plain = !exponent_digits.is_empty() && exponent_digits.bytes().all(|byte| byte.is_ascii_digit());
    if !(has_digit && is_plain && exponent_is_plain) {
        return None;
    }
    let value: f64 = format!("{mantissa}e{exponent}").parse().ok()?;
    value.is_finite().then_some(if negative { -value } else { value })
}
