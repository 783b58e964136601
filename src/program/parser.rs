//! One line -> one [`Block`].
//!
//! In: a decoded line and the axis names. Out: the block, or the first finding in it: the next line is read afresh, so that one
//! typo is one error. This file reads the frame of a block (skip level, number, label) and its words; statements that fill a block
//! are read in `statements`. Does not execute.

use super::calls::call_by_name;
use super::codes::{self, Columns, Fault, Outcome};
use super::dialect::Dialect;
use super::expression::{arguments, expected, expression, indices, not_built, unused_expression};
use super::lexer::{Lexer, Number, Token};
use super::statements::{initial, statement};
use super::synchronised::{cancelled, synchronised};
use super::syntax::{
    Address, AddressValue, Block, BlockNumber, Expr, ExprKind, Form, IndexedValue, Initial, Statement, SystemName,
    Target, Word, WordKind,
};
use super::visit::reads_main_run;
use super::words::{self, IndexedAddress, NotActedOn, Role};

/// Values that PO may have: the end point and coefficients.
const COEFFICIENTS_MAX: usize = 8;
/// Highest number of a tool, an edge or an M function.
const INTEGER_MAX: f64 = 2_147_483_647.0;

/// Parses a line.
pub fn parse(text: &str, dialect: &Dialect) -> Outcome<Block> {
    let mut block = parse_words(text, dialect)?;
    if text.contains('$') {
        block.reads_main_run = reads_main_run(&block.statement);
    }
    Ok(block)
}

fn parse_words(text: &str, dialect: &Dialect) -> Outcome<Block> {
    let mut lexer = Lexer::new(text);
    let empty = Statement::Words(Vec::new());
    let mut block = Block { skip: None, number: None, label: None, statement: empty, reads_main_run: false };
    if lexer.peek_byte() == Some(b'%') {
        // Header of a transmission or archive: `%_N_NAME_MPF`.
        return Ok(block);
    }
    block.skip = skip_level(&mut lexer);
    block.number = block_number(&mut lexer)?;
    if block.skip.is_none() {
        block.skip = skip_level(&mut lexer);
    }
    block.label = label(&mut lexer);
    let start = lexer.position();
    let before = lexer;
    if let Some(name) = lexer.name() {
        let columns = lexer.columns_from(start);
        match words::role(name) {
            Some(Role::Control(control)) => {
                block.statement = statement(control, &mut lexer, columns)?;
                return end_of_block(lexer, block);
            }
            Some(Role::NotActedOn(entry)) if SYNCHRONISED.contains(&entry.word) => {
                block.statement = match synchronised(entry, columns.clone(), lexer) {
                    Some(action) => Statement::Synchronised(Box::new(action)),
                    None => Statement::NotActedOn(entry, columns),
                };
                return Ok(block);
            }
            Some(Role::NotActedOn(entry)) if entry.word == "CANCEL" => {
                let mut ahead = lexer;
                if let Some(numbers) = cancelled(&mut ahead) {
                    block.statement = Statement::Cancel(numbers);
                    return Ok(block);
                }
            }
            _ => {
                if let Some(call) = call_by_name(name, columns, &mut lexer, dialect)? {
                    block.statement = Statement::Call(Box::new(call));
                    return end_of_block(lexer, block);
                }
            }
        }
    }
    lexer = before;
    block.statement = Statement::Words(block_words(&mut lexer, dialect)?);
    Ok(block)
}

/// Letters that are addresses on every machine; N only at the start of the block, which is said where it is read.
const ADDRESS_LETTERS: &[u8] = b"DFGHIJKLMNPRST";

/// Words that open a synchronised action: the rest of the line belongs to it.
const SYNCHRONISED: [&str; 7] = ["ID", "IDS", "WHEN", "WHENEVER", "EVERY", "FROM", "DO"];

/// True for a word that opens a synchronised action.
pub fn is_synchronised(word: &str) -> bool {
    SYNCHRONISED.contains(&word)
}

fn end_of_block(mut lexer: Lexer, block: Block) -> Outcome<Block> {
    if lexer.at_end() {
        return Ok(block);
    }
    let columns = lexer.columns_of_next();
    let is_equals = lexer.token()? == Token::Symbol("=");
    let help =
        if is_equals { "did you mean `==`? A comparison is written so" } else { "write it into a block of its own" };
    Err(Fault::new(codes::TRAILING_TEXT, columns, "the statement ends before this")
        .label("expected the end of the block")
        .help(help))
}

/// `/` or `/0` to `/9`.
fn skip_level(lexer: &mut Lexer) -> Option<u8> {
    if lexer.peek_byte() != Some(b'/') {
        return None;
    }
    lexer.skip_byte();
    Some(lexer.digits().map_or(0, |level| level.min(9) as u8))
}

/// `N10` or `:10`.
fn block_number(lexer: &mut Lexer) -> Outcome<Option<BlockNumber>> {
    let before = *lexer;
    let main = match lexer.peek_byte() {
        Some(b':') => true,
        Some(b'N' | b'n') => false,
        _ => return Ok(None),
    };
    let start = lexer.position();
    lexer.skip_byte();
    if !main && !lexer.next_is_digit() {
        // A word that begins with N, such as NORM.
        *lexer = before;
        return Ok(None);
    }
    lexer.position();
    match lexer.digits() {
        Some(number) => Ok(Some(BlockNumber { number, main })),
        None => Err(Fault::new(codes::BAD_NUMBER, lexer.columns_from(start), "this block number cannot be read")
            .label("expected digits")),
    }
}

/// `NAME:`.
fn label(lexer: &mut Lexer) -> Option<std::sync::Arc<str>> {
    let before = *lexer;
    let name = lexer.name();
    if let Some(name) = name
        && name.len() > 1
        && lexer.peek_byte() == Some(b':')
        // `GOTOF :90` leads to a main block.
        && !matches!(words::role(name), Some(Role::Control(_)))
    {
        lexer.skip_byte();
        return Some(name.to_ascii_uppercase().into());
    }
    *lexer = before;
    None
}

fn block_words(lexer: &mut Lexer, dialect: &Dialect) -> Outcome<Vec<Word>> {
    let mut found = Vec::new();
    while !lexer.at_end() {
        let start = lexer.position();
        let behind_digit = lexer.is_behind_digit();
        let kind = WordParser { lexer, dialect, start, behind_digit }.word()?;
        found.push(Word { columns: lexer.columns_from(start), kind });
    }
    Ok(found)
}

/// Reads one word.
struct WordParser<'l, 'a, 'd> {
    lexer: &'l mut Lexer<'a>,
    dialect: &'d Dialect,
    start: usize,
    /// The byte before it is a digit or a point.
    behind_digit: bool,
}

impl<'a> WordParser<'_, 'a, '_> {
    fn word(&mut self) -> Outcome<WordKind> {
        let Some(name) = self.lexer.name() else {
            let mut ahead = *self.lexer;
            let is_comma = ahead.token()? == Token::Symbol(",");
            let help = (is_comma && self.behind_digit).then(|| "the decimal sign is a point".to_owned());
            let is_bracket = self.lexer.peek() == Token::Symbol("(");
            let comment =
                is_bracket.then(|| "a comment begins with `;`: brackets are comments in other dialects".to_owned());
            return Err(expected(self.lexer, "a word such as G1 or X10").maybe_help(help.or(comment)));
        };
        match name.as_bytes() {
            [b'$', ..] => self.system_variable(name),
            [letter] => self.letter(*letter),
            [letter, second, ..] if second.is_ascii_digit() && letter.is_ascii_alphabetic() => {
                self.letter_with_digits(name)
            }
            _ => self.named(name),
        }
    }

    fn columns(&self) -> Columns {
        self.lexer.columns_from(self.start)
    }

    /// `X-10`, `X 10`, `X=...`, `R[...]=`: one letter, and no digit right behind it.
    fn letter(&mut self, letter: u8) -> Outcome<WordKind> {
        let name = char::from(letter).to_ascii_uppercase();
        if name == 'R' && self.lexer.take("[") {
            let index = expression(self.lexer)?;
            if !self.lexer.take("]") {
                return Err(expected(self.lexer, "an operator or `]`"));
            }
            return self.assignment(Target::Parameter(index));
        }
        if self.lexer.take("[") {
            let columns = self.columns();
            return Err(not_built(&format!("{name}[...]"), "indexed addresses are not built yet", columns));
        }
        self.check_letter(letter)?;
        let value = if self.lexer.take("=") { self.address_value()? } else { self.plain_number(letter)? };
        self.address(letter, value)
    }

    /// `X10`, `G1X10`, `M1=3`, `R5=...`: one letter, and digits right behind it.
    fn letter_with_digits(&mut self, name: &'a str) -> Outcome<WordKind> {
        let letter = name.as_bytes()[0];
        let all_digits = name[1..].bytes().all(|byte| byte.is_ascii_digit());
        if all_digits && self.lexer.peek() == Token::Symbol("=") {
            return self.extended(name);
        }
        self.lexer.rewind(self.start + 1);
        if letter.eq_ignore_ascii_case(&b'R') {
            self.lexer.number()?;
            return Err(Fault::new(
                codes::EXPECTED_VALUE,
                self.columns(),
                format!("the R parameter `{name}` gets no value"),
            )
            .label("expected `=` and a value"));
        }
        self.check_letter(letter)?;
        let value = self.plain_number(letter)?;
        self.address(letter, value)
    }

    /// A letter that is no address is the error, not what stands behind it: `X1O` has an O for a 0.
    fn check_letter(&self, letter: u8) -> Outcome<()> {
        let letter = letter.to_ascii_uppercase();
        if ADDRESS_LETTERS.contains(&letter) || self.dialect.letter(letter).is_some() {
            return Ok(());
        }
        let columns = self.start as u32..self.start as u32 + 1;
        let mut fault = self.unknown_axis(&char::from(letter).to_string(), columns);
        if letter == b'O' && self.behind_digit {
            fault.help = Some("did you mean the digit 0?".to_owned());
        }
        Err(fault)
    }

    /// `X1=`, `S2=`, `R5=`: letter and number, then an equals sign.
    fn extended(&mut self, name: &str) -> Outcome<WordKind> {
        let letter = name.as_bytes()[0].to_ascii_uppercase();
        let name_columns = self.columns();
        let number: Option<u32> = name[1..].parse().ok();
        if letter == b'R' {
            let index = number.and_then(|number| i32::try_from(number).ok()).unwrap_or(i32::MAX);
            return self.assignment(Target::Parameter(Expr { columns: name_columns, kind: ExprKind::Int(index) }));
        }
        self.lexer.take("=");
        if let Some(axis) = self.dialect.axis(name) {
            return Ok(WordKind::Address(Address::Axis(axis), self.address_value()?));
        }
        match (letter, words::role(name)) {
            (_, Some(Role::NotBuilt(reason))) => Err(not_built(name, reason, name_columns)),
            (_, Some(Role::Address(address))) => Ok(WordKind::Address(address, self.address_value()?)),
            (b'S' | b'M' | b'T' | b'D' | b'H', _) => {
                let value = self.address_value()?;
                match (letter, number) {
                    (b'S', Some(number @ 1..)) => Ok(WordKind::Address(Address::SpindleSpeedOf(number), value)),
                    (b'M', Some(number @ 1..)) => Ok(WordKind::Address(Address::MOf(number), value)),
                    _ => self.address(letter, value),
                }
            }
            _ => Err(self.unknown_axis(name, name_columns)),
        }
    }

    /// The number behind a letter without an equals sign.
    fn plain_number(&mut self, letter: u8) -> Outcome<AddressValue> {
        let start = self.lexer.position();
        let negative = self.lexer.take("-");
        if !negative {
            self.lexer.take("+");
        }
        if !matches!(self.lexer.peek(), Token::Number(_)) || self.lexer.peek_byte() == Some(b'\'') {
            let mut help = None;
            if matches!(self.lexer.peek(), Token::Name(_) | Token::Symbol("(")) {
                help = Some(format!("a value that is not a plain number needs `=`: {}=...", char::from(letter)));
            }
            let fault = expected(self.lexer, &format!("a number after `{}`", char::from(letter)));
            return Err(Box::new(Fault { code: codes::EXPECTED_VALUE, ..*fault }).maybe_help(help));
        }
        let sign = if negative { -1.0 } else { 1.0 };
        let kind = match self.lexer.number()? {
            Number::Int(value) if negative => ExprKind::Int(-value),
            Number::Int(value) => ExprKind::Int(value),
            // A negative zero becomes zero.
            Number::Real(value) => ExprKind::Real(sign * value + 0.0),
        };
        Ok(AddressValue { form: Form::Modal, value: Expr { columns: self.lexer.columns_from(start), kind } })
    }

    /// What follows an equals sign: an expression, or AC(...) and its kin.
    fn address_value(&mut self) -> Outcome<AddressValue> {
        let mut ahead = *self.lexer;
        let form = match ahead.name().map(str::to_ascii_uppercase).as_deref() {
            Some("AC") => Form::Absolute,
            Some("IC") => Form::Incremental,
            Some("DC") => Form::Shortest,
            Some("ACP") => Form::Positive,
            Some("ACN") => Form::Negative,
            Some("QU") => Form::Modal,
            _ => return Ok(AddressValue { form: Form::Modal, value: expression(self.lexer)? }),
        };
        *self.lexer = ahead;
        if !self.lexer.take("(") {
            return Err(expected(self.lexer, "`(`"));
        }
        let value = expression(self.lexer)?;
        if self.lexer.take(")") {
            return Ok(AddressValue { form, value });
        }
        Err(expected(self.lexer, "an operator or `)`"))
    }

    /// A one-letter address with its value.
    fn address(&self, letter: u8, value: AddressValue) -> Outcome<WordKind> {
        let letter = letter.to_ascii_uppercase();
        if let Some(axis) = self.dialect.letter(letter) {
            return Ok(WordKind::Address(Address::Axis(axis), value));
        }
        let address = match letter {
            b'G' => return self.g_function(&value),
            b'F' => Address::Feed,
            b'S' => Address::SpindleSpeed,
            b'T' => Address::Tool,
            b'D' => Address::Edge,
            b'M' => Address::M,
            b'I' => Address::Centre(0),
            b'J' => Address::Centre(1),
            b'K' => Address::Centre(2),
            b'H' => Address::H,
            b'L' | b'P' => {
                return Err(Fault::new(codes::BAD_BLOCK, self.columns(), "the call of a sub-program stands alone")
                    .label("not here")
                    .help("write it into a block of its own, with P behind it: L12 P3"));
            }
            b'N' => {
                return Err(Fault::new(
                    codes::BAD_BLOCK,
                    self.columns(),
                    "the block number stands at the start of the block",
                )
                .label("not here"));
            }
            _ => return Err(self.unknown_axis(&char::from(letter).to_string(), self.columns())),
        };
        Ok(WordKind::Address(address, value))
    }

    fn unknown_axis(&self, name: &str, columns: Columns) -> Box<Fault> {
        Fault::new(codes::UNKNOWN_AXIS, columns, format!("the machine has no axis `{name}`"))
            .label("unknown axis")
            .help(format!("the axes of this machine are {}", self.dialect.axis_list()))
    }

    fn g_function(&self, value: &AddressValue) -> Outcome<WordKind> {
        let columns = self.columns();
        let ExprKind::Int(number) = value.value.kind else {
            return Err(Fault::new(codes::UNKNOWN_G, columns, "a G function is a whole number")
                .label("expected a form such as G1"));
        };
        let number = u32::try_from(number).unwrap_or(u32::MAX);
        match words::g_function(number) {
            Ok(function) => Ok(WordKind::G(function)),
            Err("") => {
                Err(Fault::new(codes::UNKNOWN_G, columns, format!("there is no G function G{number}")).label("unknown"))
            }
            Err(reason) => Err(not_built(&format!("G{number}"), reason, columns)),
        }
    }

    fn assignment(&mut self, target: Target) -> Outcome<WordKind> {
        if !self.lexer.take("=") {
            return Err(expected(self.lexer, "`=`"));
        }
        match initial(self.lexer)? {
            Initial::One(value) => Ok(WordKind::Assign(target, value)),
            filling => Ok(WordKind::Fill(target, filling)),
        }
    }

    fn system_variable(&mut self, name: &str) -> Outcome<WordKind> {
        let columns = self.columns();
        if name.len() == 1 {
            return Err(Fault::new(codes::UNKNOWN_SYSTEM_VARIABLE, columns, "`$` alone is no name")
                .label("expected the name of a system variable"));
        }
        let upper = name.to_ascii_uppercase();
        if let Some(digits) = upper.strip_prefix("$R") {
            if digits.is_empty() && self.lexer.take("[") {
                let index = expression(self.lexer)?;
                if !self.lexer.take("]") {
                    return Err(expected(self.lexer, "an operator or `]`"));
                }
                return self.assignment(Target::Parameter(index));
            }
            if let Ok(number) = digits.parse() {
                return self.assignment(Target::Parameter(Expr { columns, kind: ExprKind::Int(number) }));
            }
        }
        let indices = indices(self.lexer)?;
        self.assignment(Target::System(SystemName { name: upper.into(), indices }))
    }

    /// A word of two letters or more.
    fn named(&mut self, name: &str) -> Outcome<WordKind> {
        let columns = self.columns();
        let next = self.lexer.peek();
        if let Some(axis) = self.dialect.axis(name) {
            if !self.lexer.take("=") {
                return Err(expected(self.lexer, &format!("`=` after the axis `{name}`")));
            }
            return Ok(WordKind::Address(Address::Axis(axis), self.address_value()?));
        }
        let is_call = next == Token::Symbol("(");
        match words::role(name).filter(|role| is_call || !words::is_free_name(*role)) {
            Some(Role::Keyword(keyword)) => Ok(WordKind::Keyword(keyword)),
            Some(Role::Address(address)) => {
                if !self.lexer.take("=") {
                    return Err(expected(self.lexer, &format!("`=` after {name}")));
                }
                Ok(WordKind::Address(address, self.address_value()?))
            }
            Some(Role::Indexed(address)) => self.indexed(address, name),
            Some(Role::Procedure(procedure)) => {
                let given = if self.lexer.take("(") { arguments(self.lexer, ")", false)? } else { Vec::new() };
                Ok(WordKind::Procedure(procedure, given))
            }
            Some(Role::Message) => self.message(),
            Some(Role::Silent) => {
                self.pass_over_value()?;
                Ok(WordKind::Silent)
            }
            Some(Role::NotActedOn(entry)) => self.pass_over(entry),
            Some(Role::Control(_)) => {
                Err(Fault::new(codes::BAD_BLOCK, columns, format!("`{name}` must be the first word of its block"))
                    .label("not here")
                    .help("write it into a block of its own"))
            }
            Some(Role::Function(_) | Role::Syntax) => {
                Err(Fault::new(codes::BAD_BLOCK, columns, format!("`{name}` cannot begin a word"))
                    .label("expected an address or a word"))
            }
            None | Some(Role::FunctionNotBuilt(_)) if matches!(next, Token::Symbol("=" | "[")) => {
                let indices = indices(self.lexer)?;
                self.assignment(Target::Variable { name: name.to_ascii_uppercase().into(), indices })
            }
            Some(Role::NotBuilt(reason) | Role::FunctionNotBuilt(reason)) => Err(not_built(name, reason, columns)),
            None => Err(self.unknown_word(name, columns)),
        }
    }

    /// `ACC[X]=50`, `SPOS=90`, `PO[X]=(10, 2.5)`, `PO[]=(1, 0.2)`.
    fn indexed(&mut self, address: IndexedAddress, name: &str) -> Outcome<WordKind> {
        let mut index = None;
        if self.lexer.take("[") {
            if !self.lexer.take("]") {
                index = Some(expression(self.lexer)?);
                if !self.lexer.take("]") {
                    return Err(expected(self.lexer, "an operator or `]`"));
                }
            }
        } else if !matches!(address, IndexedAddress::SpindlePosition | IndexedAddress::SpindlePositionAsync) {
            return Err(expected(self.lexer, &format!("`[` and an axis after {name}")));
        }
        if !self.lexer.take("=") {
            return Err(expected(self.lexer, &format!("`=` after {name}[...]")));
        }
        let values = if address == IndexedAddress::Polynomial && self.lexer.take("(") {
            IndexedValue::List(self.coefficients()?)
        } else {
            IndexedValue::One(self.address_value()?)
        };
        Ok(WordKind::Indexed { address, index, values })
    }

    /// `a, b, c)`: the end point may be AC() or IC().
    fn coefficients(&mut self) -> Outcome<Vec<Option<AddressValue>>> {
        let mut values = Vec::new();
        loop {
            let gap = matches!(self.lexer.peek(), Token::Symbol("," | ")"));
            values.push(if gap { None } else { Some(self.address_value()?) });
            if self.lexer.take(")") {
                return Ok(values);
            }
            if !self.lexer.take(",") || values.len() > COEFFICIENTS_MAX {
                return Err(expected(self.lexer, "`,` or `)`"));
            }
        }
    }

    fn message(&mut self) -> Outcome<WordKind> {
        if !self.lexer.take("(") {
            return Err(expected(self.lexer, "`(` after MSG"));
        }
        let mut given = arguments(self.lexer, ")", false)?.into_iter();
        Ok(WordKind::Message(given.next().flatten()))
    }

    fn pass_over(&mut self, entry: &'static NotActedOn) -> Outcome<WordKind> {
        self.pass_over_value()?;
        Ok(WordKind::NotActedOn(entry))
    }

    /// Index, arguments and value of a word that is not acted on.
    fn pass_over_value(&mut self) -> Outcome<()> {
        if self.lexer.take("[") {
            arguments(self.lexer, "]", true)?;
        }
        if self.lexer.take("(") {
            arguments(self.lexer, ")", true)?;
        } else if self.lexer.take("=") {
            unused_expression(self.lexer)?;
        }
        Ok(())
    }

    fn unknown_word(&mut self, name: &str, columns: Columns) -> Box<Fault> {
        let help = missing_equals_sign(name).or_else(|| words::did_you_mean(name));
        let is_call = self.lexer.peek() == Token::Symbol("(");
        let otherwise = if is_call {
            "a sub-program is called in a block of its own".to_owned()
        } else {
            format!("an assignment needs `=`: {name}=...")
        };
        Fault::new(codes::UNKNOWN_WORD, columns, format!("unknown word `{name}`"))
            .label("not a word of the language")
            .maybe_help(help.or(Some(otherwise)))
    }
}

/// Help for `CR5`: an address of several letters with its number right behind it.
fn missing_equals_sign(name: &str) -> Option<String> {
    let address = name.trim_end_matches(|letter: char| letter.is_ascii_digit());
    let number = &name[address.len()..];
    let is_address = !number.is_empty() && matches!(words::role(address), Some(Role::Address(_)));
    is_address.then(|| format!("an address of several letters needs `=`: {address}={number}"))
}

/// The whole number of an address such as M or T, if the value is one and not negative.
pub fn whole_number(value: f64) -> Option<u32> {
    ((0.0..=INTEGER_MAX).contains(&value) && value.fract() == 0.0).then_some(value as u32)
}
