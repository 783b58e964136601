//! A block of the syntax tree as text again: what is printed parses to the same tree.
//!
//! In: a [`Block`] and the axis names. Out: one line. It is not the line as typed: comments, blanks, superfluous brackets and the way
//! a number was written are gone, and so are the arguments of words that are not acted on. Brackets stand only where the priorities of
//! the operators need them.

use super::dialect::Dialect;
use super::parser::is_synchronised;
use super::synchronised::Synchronised;
use super::syntax::{
    Address, AddressValue, Block, Case, DefinedVariable, Definition, Destination, Expr, ExprKind, ForLoop, Form,
    IndexedValue, Initial, Jump, Statement, SystemName, Target, Unary, VariableType, Word, WordKind,
};
use super::syntax::{Binary, BlockNumber, Direction};
use super::words::{GFunction, IndexedAddress, Role, g_function, spelling};
use std::fmt::Write;

/// Numbers of G functions have at most three digits.
const G_NUMBER_MAX: u32 = 999;
/// Binds tighter than every operator with two operands.
const PRIORITY_MAX: u8 = u8::MAX;

/// The block as a line, without a line end.
pub fn print(block: &Block, dialect: &Dialect) -> String {
    let mut printer = Printer { dialect, text: String::new() };
    printer.block(block);
    printer.text
}

pub(super) struct Printer<'d> {
    dialect: &'d Dialect,
    pub(super) text: String,
}

impl Printer<'_> {
    fn block(&mut self, block: &Block) {
        match block.skip {
            Some(0) => self.word("/"),
            Some(level) => self.word(&format!("/{level}")),
            None => {}
        }
        if let Some(BlockNumber { number, main }) = block.number {
            self.word(&format!("{}{number}", if main { ':' } else { 'N' }));
        }
        if let Some(label) = &block.label {
            self.word(&format!("{label}:"));
        }
        self.statement(&block.statement);
    }

    fn statement(&mut self, statement: &Statement) {
        match statement {
            Statement::Words(words) => words.iter().for_each(|word| self.block_word(word)),
            Statement::Define(definition) => self.define(definition),
            Statement::If(condition) => self.with("IF", condition),
            Statement::IfJump(branches) => {
                for (condition, jump) in branches {
                    self.with("IF", condition);
                    self.jump(jump);
                }
            }
            Statement::Else => self.word("ELSE"),
            Statement::EndIf => self.word("ENDIF"),
            Statement::For(for_loop) => self.for_loop(for_loop),
            Statement::EndFor => self.word("ENDFOR"),
            Statement::While(condition) => self.with("WHILE", condition),
            Statement::EndWhile => self.word("ENDWHILE"),
            Statement::Loop => self.word("LOOP"),
            Statement::EndLoop => self.word("ENDLOOP"),
            Statement::Repeat => self.word("REPEAT"),
            Statement::Until(condition) => self.with("UNTIL", condition),
            Statement::Jump(jump) => self.jump(jump),
            Statement::Case(case) => self.case(case),
            Statement::RepeatBlocks(repeat) => self.repeat_blocks(repeat),
            Statement::Procedure(header) => self.header("PROC", header),
            Statement::External(header) => self.header("EXTERN", header),
            Statement::Call(call) => self.call(call),
            Statement::ModalCall(call) => {
                self.word("MCALL");
                call.iter().for_each(|call| self.call(call));
            }
            Statement::CallPath(path) => self.call_path(path.as_ref()),
            Statement::Return(wanted) => self.return_statement(wanted),
            Statement::Synchronised(action) => self.synchronised(action),
            Statement::Cancel(numbers) => {
                self.word("CANCEL(");
                for (index, number) in numbers.iter().enumerate() {
                    if index > 0 {
                        self.text.push(',');
                    }
                    self.expression(number);
                }
                self.text.push(')');
            }
            Statement::NotActedOn(entry, _) => {
                if !is_synchronised(entry.word) {
                    self.word("MCALL");
                }
                self.word(entry.word);
            }
        }
    }

    fn synchronised(&mut self, action: &Synchronised) {
        if let Some(id) = action.id {
            self.word(&format!("ID={id}"));
        }
        if let Some(condition) = &action.condition {
            self.with(action.cadence.word(), condition);
        }
        self.word("DO");
        self.word("$AC_OVR=");
        self.expression(&action.override_percent);
    }

    fn for_loop(&mut self, for_loop: &ForLoop) {
        self.word("FOR");
        self.begin_word();
        self.target(&for_loop.counter);
        self.text.push('=');
        self.expression(&for_loop.first);
        self.with("TO", &for_loop.last);
    }

    fn case(&mut self, case: &Case) {
        self.with("CASE", &case.selector);
        self.word("OF");
        for (value, jump) in &case.branches {
            self.begin_word();
            self.expression(value);
            self.jump(jump);
        }
        if let Some(default) = &case.default {
            self.word("DEFAULT");
            self.jump(default);
        }
    }

    fn jump(&mut self, jump: &Jump) {
        self.word(match jump.direction {
            Direction::Forward => "GOTOF",
            Direction::Backward => "GOTOB",
            Direction::Both => "GOTO",
            Direction::BothQuiet => "GOTOC",
            Direction::Start => "GOTOS",
        });
        jump.destination.iter().for_each(|destination| self.destination(destination));
    }

    pub(super) fn destination(&mut self, destination: &Destination) {
        match destination {
            Destination::Name(name) => self.word(name),
            Destination::Number(number) => self.word(&format!("N{number}")),
            Destination::Text(text) => {
                self.begin_word();
                self.expression(text);
            }
        }
    }

    fn define(&mut self, definition: &Definition) {
        // NCK or CHAN: to a simulation with one channel they are the same.
        self.word(if definition.global { "DEF NCK" } else { "DEF" });
        self.word(definition.variable_type.name());
        if let VariableType::Text(length) = definition.variable_type {
            self.put(format_args!("[{length}]"));
        }
        for (index, variable) in definition.variables.iter().enumerate() {
            if index > 0 {
                self.text.push(',');
            }
            let DefinedVariable { name, columns: _, dimensions, initial } = variable;
            self.word(name);
            self.indices(dimensions);
            if *initial != Initial::None {
                self.text.push('=');
                self.initial(initial);
            }
        }
    }

    fn initial(&mut self, initial: &Initial) {
        match initial {
            Initial::None => {}
            Initial::One(value) => self.expression(value),
            Initial::Set(values) => {
                self.text.push_str("SET(");
                self.list(values, Self::expression);
                self.text.push(')');
            }
            Initial::Repeat(value, count) => {
                self.text.push_str("REP(");
                self.expression(value);
                if let Some(count) = count {
                    self.text.push(',');
                    self.expression(count);
                }
                self.text.push(')');
            }
        }
    }

    fn block_word(&mut self, word: &Word) {
        match &word.kind {
            WordKind::G(function) => self.g_function(*function),
            WordKind::Address(address, value) => self.address(*address, value),
            WordKind::Keyword(keyword) => self.spelled(Role::Keyword(*keyword)),
            WordKind::Indexed { address, index, values } => self.indexed(*address, index.as_ref(), values),
            WordKind::Procedure(procedure, arguments) => {
                self.spelled(Role::Procedure(*procedure));
                self.text.push('(');
                self.list(arguments, Self::expression);
                self.text.push(')');
            }
            WordKind::Message(text) => {
                self.word("MSG(");
                text.iter().for_each(|text| self.expression(text));
                self.text.push(')');
            }
            WordKind::Assign(target, value) => {
                self.begin_word();
                self.target(target);
                self.text.push('=');
                self.expression(value);
            }
            WordKind::Fill(target, initial) => {
                self.begin_word();
                self.target(target);
                self.text.push('=');
                self.initial(initial);
            }
            // Which of them it was does not matter: they do nothing.
            WordKind::Silent => self.spelled(Role::Silent),
            WordKind::NotActedOn(entry) => self.word(entry.word),
        }
    }

    fn g_function(&mut self, function: GFunction) {
        if let GFunction::NotActedOn(entry, _) = function {
            return self.word(entry.word);
        }
        // G numbers are many and names are few: searched where they stand, in one table.
        let number = (0..=G_NUMBER_MAX).find(|number| g_function(*number) == Ok(function));
        number.iter().for_each(|number| self.word(&format!("G{number}")));
    }

    fn address(&mut self, address: Address, value: &AddressValue) {
        let letter = |letter: char| letter.to_string();
        let name = match address {
            Address::Axis(axis) => self.dialect.name(axis).unwrap_or_default().to_owned(),
            Address::Centre(index) => letter(['I', 'J', 'K'][usize::from(index.min(2))]),
            Address::Feed => letter('F'),
            Address::SpindleSpeed => letter('S'),
            Address::Tool => letter('T'),
            Address::Edge => letter('D'),
            Address::M => letter('M'),
            Address::H => letter('H'),
            Address::SpindleSpeedOf(spindle) => format!("S{spindle}"),
            Address::MOf(spindle) => format!("M{spindle}"),
            named => spelling(Role::Address(named)).unwrap_or_default().to_owned(),
        };
        self.word(&name);
        let is_plain = matches!(value.value.kind, ExprKind::Int(i32::MIN..) | ExprKind::Real(_))
            && value.value.kind != ExprKind::Int(i32::MIN);
        if !(name.len() == 1 && is_plain && value.form == Form::Modal) {
            self.text.push('=');
        }
        self.address_value(value);
    }

    fn address_value(&mut self, value: &AddressValue) {
        let form = match value.form {
            Form::Modal => return self.expression(&value.value),
            Form::Absolute => "AC",
            Form::Incremental => "IC",
            Form::Shortest => "DC",
            Form::Positive => "ACP",
            Form::Negative => "ACN",
        };
        self.put(format_args!("{form}("));
        self.expression(&value.value);
        self.text.push(')');
    }

    fn indexed(&mut self, address: IndexedAddress, index: Option<&Expr>, values: &IndexedValue) {
        self.spelled(Role::Indexed(address));
        let needs_index = !matches!(address, IndexedAddress::SpindlePosition | IndexedAddress::SpindlePositionAsync);
        if index.is_some() || needs_index {
            self.text.push('[');
            index.into_iter().for_each(|index| self.expression(index));
            self.text.push(']');
        }
        self.text.push('=');
        match values {
            IndexedValue::One(value) => self.address_value(value),
            IndexedValue::List(values) => {
                self.text.push('(');
                self.list(values, Self::address_value);
                self.text.push(')');
            }
        }
    }

    fn target(&mut self, target: &Target) {
        match target {
            Target::Parameter(index) => self.parameter(index),
            Target::Variable { name, indices } | Target::System(SystemName { name, indices }) => {
                self.text.push_str(name);
                self.indices(indices);
            }
        }
    }

    fn parameter(&mut self, index: &Expr) {
        match index.kind {
            ExprKind::Int(number @ 0..) => self.put(format_args!("R{number}")),
            _ => {
                self.text.push_str("R[");
                self.expression(index);
                self.text.push(']');
            }
        }
    }

    pub(super) fn expression(&mut self, expression: &Expr) {
        self.operand(expression, 0);
    }

    /// An expression in brackets if it binds less tightly than `priority`.
    fn operand(&mut self, expression: &Expr, priority: u8) {
        match &expression.kind {
            ExprKind::Bool(value) => self.text.push_str(if *value { "TRUE" } else { "FALSE" }),
            // Its amount is no whole number of 32 bits.
            ExprKind::Int(i32::MIN) => self.text.push_str("'H80000000'"),
            ExprKind::Int(value) => self.put(format_args!("{value}")),
            ExprKind::Real(value) => {
                let text = value.to_string();
                self.text.push_str(&text);
                if !text.contains('.') {
                    self.text.push('.');
                }
            }
            ExprKind::Text(text) => self.put(format_args!("\"{text}\"")),
            ExprKind::Parameter(index) => self.parameter(index),
            ExprKind::Variable { name, indices } | ExprKind::System(SystemName { name, indices }) => {
                self.text.push_str(name);
                self.indices(indices);
            }
            ExprKind::Unary(operator, operand) => {
                self.text.push_str(match operator {
                    Unary::Minus => "-",
                    Unary::Plus => "+",
                    Unary::Not => "NOT ",
                    Unary::BitNot => "B_NOT ",
                });
                self.operand(operand, PRIORITY_MAX);
            }
            ExprKind::Binary(operator, operands) => self.binary(*operator, operands, priority),
            ExprKind::Call(function, arguments) => {
                self.text.push_str(spelling(Role::Function(*function)).unwrap_or_default());
                self.text.push('(');
                self.each(arguments);
                self.text.push(')');
            }
        }
    }

    fn binary(&mut self, operator: Binary, operands: &(Expr, Expr), priority: u8) {
        let own = operator.priority();
        if own < priority {
            self.text.push('(');
        }
        self.operand(&operands.0, own);
        self.text.push_str(match operator {
            Binary::Chain => ":",
            Binary::Multiply => "*",
            Binary::Divide => "/",
            Binary::IntegerDivide => " DIV ",
            Binary::Modulo => " MOD ",
            Binary::Add => "+",
            Binary::Subtract => "-",
            Binary::BitAnd => " B_AND ",
            Binary::BitXor => " B_XOR ",
            Binary::BitOr => " B_OR ",
            Binary::And => " AND ",
            Binary::Xor => " XOR ",
            Binary::Or => " OR ",
            Binary::Join => "<<",
            Binary::Equal => "==",
            Binary::Unequal => "<>",
            Binary::Greater => ">",
            Binary::Less => "<",
            Binary::GreaterEqual => ">=",
            Binary::LessEqual => "<=",
        });
        // Operators of one priority are read from left to right.
        self.operand(&operands.1, own + 1);
        if own < priority {
            self.text.push(')');
        }
    }

    fn indices(&mut self, indices: &[Expr]) {
        if indices.is_empty() {
            return;
        }
        self.text.push('[');
        self.each(indices);
        self.text.push(']');
    }

    fn each(&mut self, expressions: &[Expr]) {
        for (index, expression) in expressions.iter().enumerate() {
            if index > 0 {
                self.text.push(',');
            }
            self.expression(expression);
        }
    }

    /// Values with commas between them; a gap is nothing.
    pub(super) fn list<T>(&mut self, values: &[Option<T>], print: impl Fn(&mut Self, &T)) {
        for (index, value) in values.iter().enumerate() {
            if index > 0 {
                self.text.push(',');
            }
            value.iter().for_each(|value| print(self, value));
        }
    }

    pub(super) fn with(&mut self, word: &str, expression: &Expr) {
        self.word(word);
        self.begin_word();
        self.expression(expression);
    }

    fn spelled(&mut self, role: Role) {
        self.word(spelling(role).unwrap_or_default());
    }

    pub(super) fn word(&mut self, word: &str) {
        self.begin_word();
        self.text.push_str(word);
    }

    pub(super) fn begin_word(&mut self) {
        if !self.text.is_empty() {
            self.text.push(' ');
        }
    }

    pub(super) fn put(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a String cannot fail.
        let _ = self.text.write_fmt(text);
    }
}
