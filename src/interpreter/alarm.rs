//! SETAL: an alarm that the program raises itself.
//!
//! In: number and text. Out: the alarm that ends the program, or a warning. The control's classes: 60000 to 69999 are alarms of cycles and
//! users; those of 62000 to 62999 and of 67000 to 67999 are only shown, all others stop the program. Alarm texts of the HMI are not known
//! here: what is shown is the number and the text of the call.

use super::run::Interpreter;
use crate::program::syntax::Expr;
use crate::program::{Columns, Fault, Outcome, codes};
use std::ops::RangeInclusive;

/// Numbers that a program may raise.
const NUMBERS: RangeInclusive<i32> = 60_000..=69_999;
/// Numbers that are shown and stop nothing: of cycles and of users.
const SHOWN: [RangeInclusive<i32>; 2] = [62_000..=62_999, 67_000..=67_999];

impl Interpreter {
    /// SETAL(number, text).
    pub(super) fn raise_alarm(&mut self, given: &[Option<Expr>], columns: &Columns) -> Outcome<()> {
        let (number, text) = match given {
            [Some(number)] => (number, None),
            [Some(number), text] => (number, text.as_ref()),
            _ => {
                return Err(Fault::new(codes::EXPECTED_VALUE, columns.clone(), "SETAL takes a number and a text")
                    .label("expected SETAL(number, \"text\")"));
            }
        };
        let number_columns = &number.columns;
        let number = super::evaluate::evaluate(number, self)?.integer(number_columns)?;
        let text = match text {
            Some(text) => self.text_of(&super::evaluate::evaluate(text, self)?, &text.columns)?,
            None => "".into(),
        };
        if !NUMBERS.contains(&number) {
            return Err(Fault::new(
                codes::OUT_OF_RANGE,
                number_columns.clone(),
                format!("SETAL cannot raise alarm {number}"),
            )
            .label(format!("expected {} to {}", NUMBERS.start(), NUMBERS.end())));
        }
        let message = if text.is_empty() { format!("alarm {number}") } else { format!("alarm {number}: {text}") };
        if !SHOWN.iter().any(|range| range.contains(&number)) {
            return Err(Fault::new(codes::RAISED, columns.clone(), message).label("the program raises it"));
        }
        if self.memory.first_shown(number) {
            let fault = Fault::new(codes::RAISED_AND_SHOWN, columns.clone(), message);
            self.warn(*fault.label("the program goes on"));
        }
        Ok(())
    }
}
