//! Tool data in programs: $TC_DP, $P_TOOL and their kin. Developer "frames" builds this.

use super::run::Interpreter;
use super::value::Value;
use crate::program::syntax::SystemName;
use crate::program::{Columns, NotActedOn, Outcome};

impl Interpreter {
    /// Value of a variable of tools; `None`: it is none.
    pub(super) fn tool_variable(&self, _system: &SystemName, _columns: &Columns) -> Option<Outcome<Value>> {
        None
    }

    /// Writes a variable of tools; `None`: it is none.
    pub(super) fn set_tool_variable(
        &mut self,
        system: &SystemName,
        _value: &Value,
        columns: &Columns,
        _value_columns: &Columns,
    ) -> Option<Outcome<()>> {
        if !system.name.starts_with("$TC_") {
            return None;
        }
        if let Some(entry) = NotActedOn::find("$TC_") {
            self.report_word(entry, columns);
        }
        Some(Ok(()))
    }
}
