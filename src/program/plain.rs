//! The fast path for what a CAM program is made of: `N10 G1 X1.5 Y-.2 Z3. F2000`.
//!
//! In: bytes of a line, with or without a comment. Out: [`PlainBlock`], or `None` for every line that holds anything else: the parser then reads it. What is
//! accepted here means the same as there (a test compares both on random lines). No allocation.

use super::dialect::Dialect;
use super::syntax::Typed;
use crate::base::{AxisId, PerAxis};

/// A block of G0 or G1, axis words with plain numbers, and F.
#[derive(Clone, Debug, PartialEq)]
pub struct PlainBlock {
    /// G0 (true) or G1 (false), if there is one.
    pub rapid: Option<bool>,
    /// Values of axis words, as typed.
    pub axes: PerAxis<Option<Typed>>,
    /// F word, as typed.
    pub feed: Option<Typed>,
}

/// Decimal places up to which a quotient of two exact integers is correctly rounded: 10^22 and 2^53 are exact.
const PLACES_MAX: usize = 15;
const POWERS: [f64; PLACES_MAX + 1] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// Reads a line if it is plain. A line without any word is not.
pub fn plain_block(line: &[u8], dialect: &Dialect) -> Option<PlainBlock> {
    let mut block = PlainBlock { rapid: None, axes: PerAxis::splat(None), feed: None };
    let mut at = blanks(line, 0);
    if matches!(line.get(at), Some(b'N' | b'n')) {
        let start = at + 1;
        at = digits(line, start);
        // Longer numbers are the parser's business.
        if at == start || at - start > PLACES_MAX {
            return None;
        }
    }
    let mut any = false;
    loop {
        at = blanks(line, at);
        let Some(letter) = line.get(at) else { return any.then_some(block) };
        at += 1;
        match letter {
            b';' => return any.then_some(block),
            b'G' | b'g' => {
                let start = at;
                at = digits(line, at);
                let rapid = match &line[start..at] {
                    b"0" | b"00" => true,
                    b"1" | b"01" => false,
                    _ => return None,
                };
                if block.rapid.replace(rapid).is_some() || ends_badly(line, at) {
                    return None;
                }
            }
            b'F' | b'f' => {
                let value = number(line, &mut at)?;
                if block.feed.replace(value).is_some() {
                    return None;
                }
            }
            _ => {
                let axis: AxisId = dialect.letter(*letter)?;
                let value = number(line, &mut at)?;
                if block.axes[axis].replace(value).is_some() {
                    return None;
                }
            }
        }
        any = true;
    }
}

fn blanks(line: &[u8], mut at: usize) -> usize {
    while matches!(line.get(at), Some(b' ' | b'\t')) {
        at += 1;
    }
    at
}

fn digits(line: &[u8], mut at: usize) -> usize {
    while line.get(at).is_some_and(u8::is_ascii_digit) {
        at += 1;
    }
    at
}

/// What makes a number something else: an extended address, an exponent, a second point.
fn ends_badly(line: &[u8], at: usize) -> bool {
    match line.get(at) {
        None => false,
        // `X1 =` is an extended address; `X1EX3` has an exponent.
        Some(b' ' | b'\t') => line.get(blanks(line, at)) == Some(&b'='),
        Some(b'E' | b'e') => line.get(at + 1).is_some_and(|byte| byte.eq_ignore_ascii_case(&b'X')),
        Some(byte) => !(byte.is_ascii_alphabetic() || *byte == b';'),
    }
}

fn number(line: &[u8], at: &mut usize) -> Option<Typed> {
    let negative = line.get(*at) == Some(&b'-');
    if negative || line.get(*at) == Some(&b'+') {
        *at += 1;
    }
    let mut mantissa = 0_u64;
    let mut count = 0;
    let mut places = 0;
    let mut point = false;
    while let Some(byte) = line.get(*at) {
        match byte {
            b'0'..=b'9' => {
                mantissa = mantissa * 10 + u64::from(byte - b'0');
                count += 1;
                places += usize::from(point);
                if count > PLACES_MAX {
                    return None;
                }
            }
            b'.' if !point => point = true,
            _ => break,
        }
        *at += 1;
    }
    if count == 0 || ends_badly(line, *at) {
        return None;
    }
    let value = mantissa as f64 / POWERS[places];
    // A negative zero becomes zero, as the parser has it.
    Some(Typed(if negative { 0.0 - value } else { value }))
}
