//! Values of expressions and what they are converted to.
//!
//! In: values. Out: [`Value`], conversions with a finding where there is none. REAL to INT rounds half away from zero (the
//! control's rule for assignments: a fraction of 0.5 or more is rounded up). Comparison of REAL is relative (1e-12). A CHAR is a number
//! where numbers are needed and a text of one character where texts are.

use super::frame::Frame;
use crate::base::AxisId;
use crate::program::{Columns, Fault, Outcome, codes};
use std::cmp::Ordering;
use std::sync::Arc;

/// Relative difference up to which two REAL values are equal on the control (programming manual, comparison operators).
const EQUAL_RATIO: f64 = 1e-12;

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// BOOL.
    Bool(bool),
    /// INT.
    Int(i32),
    /// CHAR; the character 0 ends a text.
    Char(char),
    /// REAL.
    Real(f64),
    /// STRING.
    Text(Arc<str>),
    /// AXIS; `None` before the first assignment.
    Axis(Option<AxisId>),
    /// FRAME.
    Frame(Arc<Frame>),
}

impl Value {
    /// As a number; texts have none.
    pub fn number(&self, columns: &Columns) -> Outcome<f64> {
        match self {
            Self::Bool(value) => Ok(f64::from(u8::from(*value))),
            Self::Int(value) => Ok(f64::from(*value)),
            Self::Char(character) => Ok(f64::from(u32::from(*character))),
            Self::Real(value) => Ok(*value),
            Self::Text(_) => {
                Err(Fault::new(codes::TYPE_MISMATCH, columns.clone(), "a text stands where a number is needed")
                    .label("expected a number"))
            }
            Self::Axis(_) => {
                Err(Fault::new(codes::TYPE_MISMATCH, columns.clone(), "an axis stands where a number is needed")
                    .label("expected a number"))
            }
            Self::Frame(_) => {
                Err(Fault::new(codes::TYPE_MISMATCH, columns.clone(), "a frame stands where a number is needed")
                    .label("expected a number")
                    .help("[X,TR] behind its name gives a component"))
            }
        }
    }

    /// As an integer of 32 bits, rounded.
    pub fn integer(&self, columns: &Columns) -> Outcome<i32> {
        let value = self.number(columns)?;
        let rounded = value.round();
        if (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&rounded) {
            return Ok(rounded as i32);
        }
        Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), format!("{value} does not fit an INT"))
            .label("expected -2147483648 to 2147483647"))
    }

    /// True unless zero.
    pub fn truth(&self, columns: &Columns) -> Outcome<bool> {
        Ok(self.number(columns)? != 0.0)
    }

    /// As text, for `<<` and MSG; an axis has none without AXSTRING.
    pub fn text(&self) -> Option<Arc<str>> {
        match self {
            Self::Text(text) => Some(text.clone()),
            Self::Bool(value) => Some(Arc::from(if *value { "1" } else { "0" })),
            Self::Int(value) => Some(value.to_string().into()),
            Self::Char('\0') => Some("".into()),
            Self::Char(character) => Some(character.to_string().into()),
            Self::Real(value) => Some(trimmed(*value).into()),
            Self::Axis(_) | Self::Frame(_) => None,
        }
    }

    /// Order of two values; texts compare with texts and characters only.
    pub fn compare(&self, other: &Self, columns: &Columns) -> Outcome<Ordering> {
        match (self, other) {
            (Self::Text(a), Self::Text(b)) => Ok(a.cmp(b)),
            (Self::Text(_), Self::Char(_)) | (Self::Char(_), Self::Text(_)) => Ok(self.text().cmp(&other.text())),
            (Self::Int(a), Self::Int(b)) => Ok(a.cmp(b)),
            (Self::Axis(a), Self::Axis(b)) => Ok(a.cmp(b)),
            // Frames are equal or not; there is no order.
            (Self::Frame(a), Self::Frame(b)) => Ok(if a == b { Ordering::Equal } else { Ordering::Less }),
            _ => {
                let (a, b) = (self.number(columns)?, other.number(columns)?);
                if (a - b).abs() <= EQUAL_RATIO * a.abs().max(b.abs()) {
                    return Ok(Ordering::Equal);
                }
                Ok(a.partial_cmp(&b).unwrap_or(Ordering::Equal))
            }
        }
    }
}

/// A number with at most six decimals and no trailing zeros: "12.5", "-0.003", "0".
pub fn trimmed(value: f64) -> String {
    let mut text = format!("{value:.6}");
    if text.contains('.') {
        text.truncate(text.trim_end_matches('0').trim_end_matches('.').len());
    }
    if text == "-0" { "0".to_owned() } else { text }
}
