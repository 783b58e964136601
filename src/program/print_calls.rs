//! Calls and headers of sub-programs as text again.
//!
//! In: their syntax. Out: what parses to the same. EXTCALL is printed as CALL, which it is here; words behind PROC that do nothing are
//! gone.

use super::print::Printer;
use super::syntax::{Call, Callee, Expr, Header, RepeatBlocks, Return, VariableType};

impl Printer<'_> {
    pub(super) fn header(&mut self, word: &str, header: &Header) {
        self.word(word);
        self.word(&header.name);
        if !header.parameters.is_empty() {
            self.text.push('(');
            for (index, parameter) in header.parameters.iter().enumerate() {
                if index > 0 {
                    self.text.push(',');
                }
                self.text.push_str(if parameter.by_reference { "VAR " } else { "" });
                self.text.push_str(parameter.variable_type.name());
                if let VariableType::Text(length) = parameter.variable_type {
                    self.put(format_args!("[{length}]"));
                }
                self.put(format_args!(" {}", parameter.name));
                if !parameter.dimensions.is_empty() {
                    self.text.push('[');
                    self.list(&parameter.dimensions, Self::expression);
                    self.text.push(']');
                }
                if let Some(default) = &parameter.default {
                    self.text.push('=');
                    self.expression(default);
                }
            }
            self.text.push(')');
        }
        if header.save {
            self.word("SAVE");
        }
    }

    pub(super) fn call(&mut self, call: &Call) {
        match &call.callee {
            Callee::Name(name) => self.word(name),
            Callee::Path(path) => {
                self.word("PCALL");
                self.word(path);
            }
            Callee::Text(name) => self.with("CALL", name),
            Callee::Own => self.word("CALL"),
        }
        if let Some((first, last)) = &call.section {
            self.word("BLOCK");
            self.destination(first);
            self.word("TO");
            self.destination(last);
        }
        if !call.arguments.is_empty() {
            self.text.push('(');
            self.list(&call.arguments, Self::expression);
            self.text.push(')');
        }
        self.passes(call.passes.as_ref());
    }

    fn passes(&mut self, passes: Option<&Expr>) {
        if let Some(passes) = passes {
            self.word("P=");
            self.expression(passes);
        }
    }

    pub(super) fn call_path(&mut self, path: Option<&Expr>) {
        self.word("CALLPATH(");
        path.into_iter().for_each(|path| self.expression(path));
        self.text.push(')');
    }

    pub(super) fn return_statement(&mut self, wanted: &Return) {
        self.word("RET");
        let mut given = vec![&wanted.target, &wanted.behind, &wanted.levels, &wanted.from_start];
        while given.last().is_some_and(|value| value.is_none()) {
            given.pop();
        }
        if given.is_empty() {
            return;
        }
        self.text.push('(');
        for (index, value) in given.into_iter().enumerate() {
            if index > 0 {
                self.text.push(',');
            }
            value.iter().for_each(|value| self.expression(value));
        }
        self.text.push(')');
    }

    pub(super) fn repeat_blocks(&mut self, repeat: &RepeatBlocks) {
        self.word(if repeat.one_block { "REPEATB" } else { "REPEAT" });
        self.destination(&repeat.first);
        repeat.last.iter().for_each(|last| self.destination(last));
        self.passes(repeat.passes.as_ref());
    }
}
