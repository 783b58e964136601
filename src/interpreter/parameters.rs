//! Types of VAR parameters, and which parameters of a call were given.
//!
//! In: a parameter and the variable handed over. Out: its type in the sub-program, or a finding. The values are bound in `call`.

use super::variables::Whole;
use crate::program::syntax::Parameter;
use crate::program::{Columns, Fault, Outcome, VariableType, codes};

/// A text handed over by VAR keeps its own length.
pub(super) fn whole_type(parameter: &Parameter, whole: &Whole) -> VariableType {
    match (parameter.variable_type, whole.variable_type()) {
        (VariableType::Text(_), own @ VariableType::Text(_)) => own,
        (wanted, _) => wanted,
    }
}

/// A VAR parameter and the variable given for it have one type.
pub(super) fn check_type(whole: &Whole, parameter: &Parameter, columns: &Columns) -> Outcome<()> {
    let (given, wanted) = (whole.variable_type().name(), parameter.variable_type.name());
    if given == wanted {
        return Ok(());
    }
    let message = format!("the VAR parameter `{}` is {wanted}, this variable is {given}", parameter.name);
    Err(Fault::new(codes::BAD_ARGUMENT, columns.clone(), message)
        .label(format!("expected a variable of type {wanted}")))
}

/// The bit of a parameter, from 0; calls have far fewer than 128.
pub(super) fn bit(at: usize) -> u128 {
    u32::try_from(at).ok().and_then(|at| 1_u128.checked_shl(at)).unwrap_or(0)
}
