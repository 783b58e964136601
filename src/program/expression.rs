//! Tokens -> expressions, by priority climbing.
//!
//! In: a [`Lexer`] that stands before an expression. Out: [`Expr`]. Depth and size of an expression are bounded, so that no input
//! exhausts the stack here or where it is evaluated. Does not look names up: whether a variable exists is known at run time.

use super::codes::{self, Fault, Outcome};
use super::lexer::{Lexer, Number, Token};
use super::syntax::{Binary, Expr, ExprKind, SystemName, Unary};
use super::words::{self, Role};

/// Brackets, indices and signs inside one another.
const DEPTH_MAX: u32 = 64;
/// Operators and operands of one expression: a chain of operators is as deep as it is long.
const SIZE_MAX: u32 = 1000;

/// Reads one expression after another from a lexer.
pub struct ExprParser<'l, 'a> {
    lexer: &'l mut Lexer<'a>,
    depth: u32,
    size: u32,
    /// Names with brackets need not be functions: arguments of calls that are not acted on.
    any_call: bool,
}

/// Reads an expression.
pub fn expression(lexer: &mut Lexer) -> Outcome<Expr> {
    ExprParser { lexer, depth: 0, size: 0, any_call: false }.binary(0)
}

/// Reads an expression whose value nobody will ask for.
pub fn unused_expression(lexer: &mut Lexer) -> Outcome<Expr> {
    ExprParser { lexer, depth: 0, size: 0, any_call: true }.binary(0)
}

/// Reads expressions separated by commas up to `close`; gaps are `None`. The opening bracket has been taken.
pub fn arguments(lexer: &mut Lexer, close: &str, any_call: bool) -> Outcome<Vec<Option<Expr>>> {
    ExprParser { lexer, depth: 0, size: 0, any_call }.arguments(close)
}

/// Reads indices in square brackets, if there are any.
pub fn indices(lexer: &mut Lexer) -> Outcome<Vec<Expr>> {
    ExprParser { lexer, depth: 0, size: 0, any_call: false }.indices()
}

/// The finding "expected ..." at the next token.
pub fn expected(lexer: &Lexer, what: &str) -> Box<Fault> {
    let message = match lexer.peek() {
        Token::End => format!("expected {what}, and the block ends"),
        Token::Number(_) => format!("expected {what}, found a number"),
        Token::Text(_) => format!("expected {what}, found a text"),
        Token::Name(name) => format!("expected {what}, found `{name}`"),
        Token::Symbol(symbol) => format!("expected {what}, found `{symbol}`"),
    };
    let label_misplaced = lexer.peek() == Token::Symbol(":");
    Fault::new(codes::EXPECTED_SYMBOL, lexer.columns_of_next(), message)
        .label(format!("expected {what}"))
        .maybe_help(label_misplaced.then(|| "a label stands at the start of the block: `NAME:`".to_owned()))
}

impl ExprParser<'_, '_> {
    /// Operators that bind tighter than `priority`.
    fn binary(&mut self, priority: u8) -> Outcome<Expr> {
        let start = self.lexer.position();
        let mut left = self.unary()?;
        while let Some(operator) = binary_operator(&self.lexer.peek()).filter(|operator| operator.priority() > priority)
        {
            self.lexer.token()?;
            self.grow(start)?;
            let right = self.binary(operator.priority())?;
            let kind = ExprKind::Binary(operator, Box::new((left, right)));
            left = Expr { columns: self.lexer.columns_from(start), kind };
        }
        Ok(left)
    }

    fn unary(&mut self) -> Outcome<Expr> {
        let start = self.lexer.position();
        let operator = match self.lexer.peek() {
            Token::Symbol("-") => Unary::Minus,
            Token::Symbol("+") => Unary::Plus,
            Token::Name(name) if name.eq_ignore_ascii_case("NOT") => Unary::Not,
            Token::Name(name) if name.eq_ignore_ascii_case("B_NOT") => Unary::BitNot,
            _ => return self.primary(),
        };
        self.lexer.token()?;
        self.descend(start)?;
        let operand = self.unary()?;
        self.depth -= 1;
        let kind = match (operator, operand.kind) {
            (Unary::Minus, ExprKind::Int(value)) if value != i32::MIN => ExprKind::Int(-value),
            (Unary::Minus, ExprKind::Real(value)) => ExprKind::Real(-value),
            (operator, kind) => ExprKind::Unary(operator, Box::new(Expr { columns: operand.columns, kind })),
        };
        Ok(Expr { columns: self.lexer.columns_from(start), kind })
    }

    fn primary(&mut self) -> Outcome<Expr> {
        let start = self.lexer.position();
        self.grow(start)?;
        let before = *self.lexer;
        let kind = match self.lexer.token()? {
            Token::Number(Number::Int(value)) => ExprKind::Int(value),
            Token::Number(Number::Real(value)) => ExprKind::Real(value),
            Token::Text(text) => ExprKind::Text(text.into()),
            Token::Symbol("(") => {
                self.descend(start)?;
                let inner = self.binary(0)?;
                self.close(")", start)?;
                self.depth -= 1;
                return Ok(Expr { columns: self.lexer.columns_from(start), kind: inner.kind });
            }
            Token::Name(name) => self.named(name, start)?,
            Token::Symbol(symbol @ ("=" | "==")) => {
                return Err(Fault::new(
                    codes::EXPECTED_VALUE,
                    before.columns_of_next(),
                    format!("expected a value, found `{symbol}`"),
                )
                .label("expected a number, a variable or a bracket"));
            }
            _ => {
                let fault = expected(&before, "a value");
                let fault = Box::new(Fault { code: codes::EXPECTED_VALUE, ..*fault });
                return Err(fault.help("write a number, a variable or a bracket here, or take the word before it away"));
            }
        };
        Ok(Expr { columns: self.lexer.columns_from(start), kind })
    }

    fn named(&mut self, name: &str, start: usize) -> Outcome<ExprKind> {
        if let Some(parameter) = self.parameter(name, start)? {
            return Ok(parameter);
        }
        let role = words::role(name);
        let is_call = self.lexer.peek() == Token::Symbol("(");
        let role = role.filter(|role| is_call || !words::is_free_name(*role));
        if let Some(Role::Function(function)) = role {
            return self.call(function, name, start);
        }
        if self.lexer.peek() == Token::Symbol("(") {
            return self.other_call(name, role, start);
        }
        if self.any_call {
            let indices = self.indices()?;
            return Ok(ExprKind::Variable { name: name.to_ascii_uppercase().into(), indices });
        }
        if name.eq_ignore_ascii_case("TRUE") {
            return Ok(ExprKind::Bool(true));
        }
        if name.eq_ignore_ascii_case("FALSE") {
            return Ok(ExprKind::Bool(false));
        }
        if name.eq_ignore_ascii_case("PI") {
            return Ok(ExprKind::Real(std::f64::consts::PI));
        }
        let columns = self.lexer.columns_from(start);
        if name.starts_with('$') {
            let indices = self.indices()?;
            return Ok(ExprKind::System(SystemName { name: name.to_ascii_uppercase().into(), indices }));
        }
        match role {
            None | Some(Role::FunctionNotBuilt(_)) => {
                let indices = self.indices()?;
                Ok(ExprKind::Variable { name: name.to_ascii_uppercase().into(), indices })
            }
            Some(Role::NotBuilt(reason)) => Err(not_built(name, reason, columns)),
            Some(_) => {
                Err(Fault::new(codes::EXPECTED_VALUE, columns, format!("expected a value, found the word `{name}`"))
                    .label("expected a number, a variable or a bracket"))
            }
        }
    }

    /// R5, $R5, R[expression].
    fn parameter(&mut self, name: &str, start: usize) -> Outcome<Option<ExprKind>> {
        let bare = name.strip_prefix('$').unwrap_or(name);
        let Some(digits) = bare.strip_prefix(['R', 'r']) else { return Ok(None) };
        if digits.is_empty() && self.lexer.take("[") {
            self.descend(start)?;
            let index = self.binary(0)?;
            self.close("]", start)?;
            self.depth -= 1;
            return Ok(Some(ExprKind::Parameter(Box::new(index))));
        }
        match digits.parse() {
            Ok(number) if digits.bytes().all(|byte| byte.is_ascii_digit()) => {
                let kind = ExprKind::Int(number);
                Ok(Some(ExprKind::Parameter(Box::new(Expr { columns: self.lexer.columns_from(start), kind }))))
            }
            _ => Ok(None),
        }
    }

    fn call(&mut self, function: words::Function, name: &str, start: usize) -> Outcome<ExprKind> {
        if !self.lexer.take("(") {
            return Err(expected(self.lexer, &format!("`(` after {name}")));
        }
        let arguments = self.arguments(")")?;
        let columns = self.lexer.columns_from(start);
        let count = arguments.len();
        let (fewest, most) = function.arity();
        let arguments: Option<Vec<Expr>> = arguments.into_iter().collect();
        if let Some(arguments) = arguments.filter(|_| (fewest..=most).contains(&count)) {
            return Ok(ExprKind::Call(function, arguments));
        }
        let takes = if fewest == most { fewest.to_string() } else { format!("{fewest} to {most}") };
        Err(Fault::new(codes::EXPECTED_VALUE, columns, format!("{name} takes {takes} values"))
            .label(format!("{count} given here")))
    }

    fn other_call(&mut self, name: &str, role: Option<Role>, start: usize) -> Outcome<ExprKind> {
        let columns = self.lexer.columns_from(start);
        if self.any_call {
            self.lexer.token()?;
            self.arguments(")")?;
            return Ok(ExprKind::Int(0));
        }
        match role {
            Some(Role::NotBuilt(reason) | Role::FunctionNotBuilt(reason)) => Err(not_built(name, reason, columns)),
            _ => Err(Fault::new(codes::UNKNOWN_WORD, columns, format!("there is no function `{name}`"))
                .label("expected a function such as SIN or SQRT")
                .maybe_help(words::did_you_mean(name))),
        }
    }

    fn arguments(&mut self, close: &str) -> Outcome<Vec<Option<Expr>>> {
        let start = self.lexer.position();
        self.descend(start)?;
        let mut arguments = Vec::new();
        if self.lexer.take(close) {
            self.depth -= 1;
            return Ok(arguments);
        }
        loop {
            let gap = matches!(self.lexer.peek(), Token::Symbol(symbol) if symbol == "," || symbol == close);
            if gap {
                self.grow(start)?;
            }
            arguments.push(if gap { None } else { Some(self.binary(0)?) });
            if self.lexer.take(close) {
                self.depth -= 1;
                return Ok(arguments);
            }
            if !self.lexer.take(",") {
                return Err(expected(self.lexer, &format!("`,` or `{close}`")));
            }
        }
    }

    fn indices(&mut self) -> Outcome<Vec<Expr>> {
        let start = self.lexer.position();
        if !self.lexer.take("[") {
            return Ok(Vec::new());
        }
        let indices = self.arguments("]")?;
        let columns = self.lexer.columns_from(start);
        match indices.into_iter().collect::<Option<Vec<_>>>().filter(|indices| !indices.is_empty()) {
            Some(indices) => Ok(indices),
            None => Err(Fault::new(codes::EXPECTED_VALUE, columns, "an index is missing").label("expected a number")),
        }
    }

    fn close(&mut self, symbol: &str, _start: usize) -> Outcome<()> {
        if self.lexer.take(symbol) { Ok(()) } else { Err(expected(self.lexer, &format!("an operator or `{symbol}`"))) }
    }

    fn descend(&mut self, start: usize) -> Outcome<()> {
        self.depth += 1;
        if self.depth > DEPTH_MAX { Err(self.too_deep(start)) } else { Ok(()) }
    }

    fn grow(&mut self, start: usize) -> Outcome<()> {
        self.size += 1;
        if self.size > SIZE_MAX { Err(self.too_deep(start)) } else { Ok(()) }
    }

    fn too_deep(&self, start: usize) -> Box<Fault> {
        Fault::new(codes::TOO_DEEP, self.lexer.columns_from(start), "this expression is too long or nested too deeply")
            .label(format!("at most {DEPTH_MAX} levels and {SIZE_MAX} values"))
            .help("split it with R parameters or variables")
    }
}

/// The finding for a known word that is not built.
pub fn not_built(word: &str, reason: &str, columns: codes::Columns) -> Box<Fault> {
    Fault::new(codes::NOT_BUILT, columns, format!("`{word}`: {reason}")).label("not built yet")
}

fn binary_operator(token: &Token) -> Option<Binary> {
    const NAMED: [(&str, Binary); 8] = [
        ("DIV", Binary::IntegerDivide),
        ("MOD", Binary::Modulo),
        ("B_AND", Binary::BitAnd),
        ("B_XOR", Binary::BitXor),
        ("B_OR", Binary::BitOr),
        ("AND", Binary::And),
        ("XOR", Binary::Xor),
        ("OR", Binary::Or),
    ];
    match token {
        Token::Symbol(symbol) => Some(match *symbol {
            ":" => Binary::Chain,
            "*" => Binary::Multiply,
            "/" => Binary::Divide,
            "+" => Binary::Add,
            "-" => Binary::Subtract,
            "<<" => Binary::Join,
            "==" => Binary::Equal,
            "<>" => Binary::Unequal,
            ">" => Binary::Greater,
            "<" => Binary::Less,
            ">=" => Binary::GreaterEqual,
            "<=" => Binary::LessEqual,
            _ => return None,
        }),
        Token::Name(name) => {
            NAMED.iter().find(|(word, _)| name.eq_ignore_ascii_case(word)).map(|(_, operator)| *operator)
        }
        _ => None,
    }
}
