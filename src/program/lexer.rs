//! Characters of one line -> tokens.
//!
//! In: a decoded line. Out: numbers, names, texts and symbols with their columns, one at a time. What a letter with digits is
//! (an address with its value, an R parameter, a label) depends on where it stands: the parser says which form it expects.

use super::codes::{self, Columns, Fault, Outcome};

/// A reader of one line. Cheap to copy: looking ahead is reading on with a copy.
#[derive(Clone, Copy, Debug)]
pub struct Lexer<'a> {
    text: &'a str,
    at: usize,
}

/// A number as written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// Without point and exponent, and within 32 bits.
    Int(i32),
    /// Anything else.
    Real(f64),
}

/// A token of an expression.
#[derive(Clone, Debug, PartialEq)]
pub enum Token<'a> {
    /// 1, .5, 1EX3, 'HFF', 'B101'.
    Number(Number),
    /// "text", without its quotes.
    Text(&'a str),
    /// Letters, digits, `_`, `$`; begins with no digit.
    Name(&'a str),
    /// One of the operators and brackets.
    Symbol(&'static str),
    /// End of the line, or a comment.
    End,
}

/// Two-character symbols first.
const SYMBOLS: [&str; 18] =
    ["==", "<>", "<=", ">=", "<<", "<", ">", "=", "+", "-", "*", "/", "(", ")", "[", "]", ",", ":"];

impl<'a> Lexer<'a> {
    /// At the start of `text`.
    pub fn new(text: &'a str) -> Self {
        Self { text, at: 0 }
    }

    /// Byte where the next token begins, after blanks.
    pub fn position(&mut self) -> usize {
        self.skip_blanks();
        self.at
    }

    /// Columns from `start` to the end of the last token.
    pub fn columns_from(&self, start: usize) -> Columns {
        start as u32..self.at as u32
    }

    /// Columns of the next token, or of the next character where there is none.
    pub fn columns_of_next(&self) -> Columns {
        let mut ahead = *self;
        let start = ahead.position();
        if ahead.token().is_err() || ahead.at == start {
            ahead.at = start + ahead.text[start..].chars().next().map_or(0, char::len_utf8);
        }
        start as u32..ahead.at as u32
    }

    /// True at the end of the line or before a comment.
    pub fn at_end(&mut self) -> bool {
        self.skip_blanks();
        matches!(self.byte(0), None | Some(b';'))
    }

    /// The next byte after blanks; `None` at the end of the line.
    pub fn peek_byte(&mut self) -> Option<u8> {
        self.skip_blanks();
        self.byte(0)
    }

    /// Takes `symbol` if it comes next and is not the beginning of a longer one.
    pub fn take(&mut self, symbol: &str) -> bool {
        let mut ahead = *self;
        let found = matches!(ahead.token(), Ok(Token::Symbol(found)) if found == symbol);
        if found {
            *self = ahead;
        }
        found
    }

    /// True if a digit comes next, also after blanks.
    pub fn next_is_digit(&mut self) -> bool {
        self.peek_byte().is_some_and(|byte| byte.is_ascii_digit())
    }

    /// True if the byte just before is a digit or a point: what follows was perhaps meant to belong to the number.
    pub fn is_behind_digit(&self) -> bool {
        let before = self.at.checked_sub(1).and_then(|at| self.text.as_bytes().get(at));
        before.is_some_and(|byte| byte.is_ascii_digit() || *byte == b'.')
    }

    /// Takes one byte that the caller has seen.
    pub fn skip_byte(&mut self) {
        self.at += 1;
    }

    /// Takes a run of decimal digits right here; `None` if there is none or it does not fit.
    pub fn digits(&mut self) -> Option<u64> {
        let start = self.at;
        while self.byte(0).is_some_and(|byte| byte.is_ascii_digit()) {
            self.at += 1;
        }
        self.text[start..self.at].parse().ok()
    }

    /// Takes a name: letters, digits, `_` and a leading `$`; `None` if none begins here.
    pub fn name(&mut self) -> Option<&'a str> {
        self.skip_blanks();
        let start = self.at;
        let first = self.byte(0)?;
        if !(first.is_ascii_alphabetic() || first == b'_' || first == b'$') {
            return None;
        }
        self.at += 1;
        while self.byte(0).is_some_and(|byte| byte.is_ascii_alphanumeric() || byte == b'_') {
            self.at += 1;
        }
        Some(&self.text[start..self.at])
    }

    /// Takes a path: everything up to a blank, a bracket or a comment; a text in quotes as it is. `None` if nothing is there.
    pub fn path(&mut self) -> Option<&'a str> {
        self.skip_blanks();
        if self.byte(0) == Some(b'"') {
            return self.quoted(b'"').ok();
        }
        let start = self.at;
        while self.byte(0).is_some_and(|byte| byte.is_ascii_alphanumeric() || b"/\\_.:$-".contains(&byte)) {
            self.at += 1;
        }
        (self.at > start).then(|| &self.text[start..self.at])
    }

    /// Goes back to byte `position`, which must have been given by [`Self::position`] or lie inside an ASCII token.
    pub fn rewind(&mut self, position: usize) {
        self.at = position;
    }

    /// The next token without taking it; `End` where no token can be read.
    pub fn peek(&self) -> Token<'a> {
        let mut ahead = *self;
        ahead.token().unwrap_or(Token::End)
    }

    /// Takes the next token.
    pub fn token(&mut self) -> Outcome<Token<'a>> {
        self.skip_blanks();
        let Some(first) = self.byte(0) else { return Ok(Token::End) };
        let next_is_digit = self.byte(1).is_some_and(|byte| byte.is_ascii_digit());
        if first == b';' {
            return Ok(Token::End);
        }
        if first.is_ascii_digit() || (first == b'.' && next_is_digit) {
            return self.number().map(Token::Number);
        }
        if first == b'"' {
            return self.quoted(b'"').map(Token::Text);
        }
        if first == b'\'' {
            return self.based_number().map(Token::Number);
        }
        if let Some(name) = self.name() {
            return Ok(Token::Name(name));
        }
        for symbol in SYMBOLS {
            if self.text[self.at..].starts_with(symbol) {
                self.at += symbol.len();
                return Ok(Token::Symbol(symbol));
            }
        }
        let character = self.text[self.at..].chars().next().unwrap_or(' ');
        let columns = self.at as u32..(self.at + character.len_utf8()) as u32;
        Err(Fault::new(
            codes::BAD_CHARACTER,
            columns,
            format!("the character `{}` has no meaning here", character.escape_default()),
        )
        .label("unexpected"))
    }

    /// Takes an unsigned number: digits with an optional point and an exponent EX.
    pub fn number(&mut self) -> Outcome<Number> {
        self.skip_blanks();
        let start = self.at;
        let mut is_whole = true;
        while let Some(byte) = self.byte(0) {
            match byte {
                b'0'..=b'9' => self.at += 1,
                b'.' if is_whole => {
                    is_whole = false;
                    self.at += 1;
                }
                _ => break,
            }
        }
        let mantissa = &self.text[start..self.at];
        if let Some(exponent) = self.exponent() {
            return self.finite(start, format!("{mantissa}e{exponent}").parse());
        }
        if is_whole && let Ok(whole) = mantissa.parse() {
            return Ok(Number::Int(whole));
        }
        self.finite(start, mantissa.parse())
    }

    /// `EX` with its digits, if they follow right here. `E` alone is an address.
    fn exponent(&mut self) -> Option<&'a str> {
        let rest = &self.text.as_bytes()[self.at..];
        if rest.len() < 3 || !rest[..2].eq_ignore_ascii_case(b"EX") {
            return None;
        }
        let sign = usize::from(matches!(rest[2], b'+' | b'-'));
        let digits = rest[2 + sign..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        if digits == 0 {
            return None;
        }
        let start = self.at + 2;
        self.at = start + sign + digits;
        Some(&self.text[start..self.at])
    }

    fn finite(&self, start: usize, parsed: Result<f64, std::num::ParseFloatError>) -> Outcome<Number> {
        match parsed {
            Ok(value) if value.is_finite() => Ok(Number::Real(value)),
            _ => Err(Fault::new(codes::BAD_NUMBER, self.columns_from(start), "this number is too large")
                .label("expected a number below 1.8EX308")),
        }
    }

    /// 'HFF' or 'B101': 32 bits.
    fn based_number(&mut self) -> Outcome<Number> {
        let start = self.at;
        let inside = self.quoted(b'\'')?;
        let radix = match inside.as_bytes().first().map(u8::to_ascii_uppercase) {
            Some(b'H') => 16,
            Some(b'B') => 2,
            Some(b'D') => 10,
            _ => 0,
        };
        let digits = inside.get(1..).filter(|digits| digits.bytes().all(|byte| byte.is_ascii_alphanumeric()));
        match digits.filter(|_| radix > 0).and_then(|digits| u32::from_str_radix(digits, radix).ok()) {
            Some(bits) => Ok(Number::Int(bits.cast_signed())),
            None => Err(Fault::new(codes::BAD_NUMBER, self.columns_from(start), "this number cannot be read")
                .label("expected a form such as 'HFF' or 'B101', at most 32 bits")),
        }
    }

    fn quoted(&mut self, quote: u8) -> Outcome<&'a str> {
        let start = self.at;
        let inside = start + 1;
        match self.text[inside..].bytes().position(|byte| byte == quote) {
            Some(length) => {
                self.at = inside + length + 1;
                Ok(&self.text[inside..inside + length])
            }
            None => {
                let columns = start as u32..self.text.trim_end().len() as u32;
                Err(Fault::new(codes::OPEN_STRING, columns, "this text is not closed")
                    .label(format!("expected a closing {}", char::from(quote))))
            }
        }
    }

    /// Blanks, and control characters that editors and old transmissions leave (tab, carriage return, end of file).
    fn skip_blanks(&mut self) {
        while matches!(self.byte(0), Some(b' ' | b'\t' | b'\r' | 0x0b | 0x0c | 0x1a)) {
            self.at += 1;
        }
    }

    fn byte(&self, ahead: usize) -> Option<u8> {
        self.text.as_bytes().get(self.at + ahead).copied()
    }
}
