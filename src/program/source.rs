//! Program file: bytes, character set, lines.
//!
//! In: bytes of a file (UTF-8 with or without byte-order mark, else Windows-1252, of which Latin-1 is a part; LF or CRLF).
//! Out: [`ProgramSource`], which hands out one decoded line after another. The text is never decoded as a whole: a [`Cursor`]
//! is a byte offset with its line number. Does not look at words.

use super::codes;
use super::structure::Structure;
use crate::base::Diagnostic;
use std::borrow::Cow;
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// A program as opened. Cheap to clone.
#[derive(Clone, Debug)]
pub struct ProgramSource {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    name: Arc<str>,
    bytes: Arc<[u8]>,
    /// First byte after the byte-order mark.
    start: usize,
    /// End of this program: an archive may carry another `%_N_` header after it.
    end: usize,
    is_utf8: bool,
    structure: OnceLock<Structure>,
}

/// A line of a program: where it begins, and its number from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Cursor {
    /// Line number, from 1.
    pub line: u32,
    /// Byte offset of its first byte in the file.
    pub offset: usize,
}

const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

impl ProgramSource {
    /// Reads a file. An unreadable file is wrong usage, not a wrong program: the caller exits with 2.
    pub fn from_file(path: &Path) -> Result<Self, Diagnostic> {
        match std::fs::read(path) {
            Ok(bytes) => match no_program(&bytes) {
                Some((what, help)) => {
                    let message = format!("the program `{}` cannot be read: it is {what}", path.display());
                    Err(Diagnostic::error(codes::UNREADABLE, message).help(help))
                }
                None => Ok(Self::from_bytes(&path.to_string_lossy(), bytes)),
            },
            Err(error) => Err(Diagnostic::error(
                codes::UNREADABLE,
                format!("the program `{}` cannot be read: {error}", path.display()),
            )
            .help("give the path of an NC program, or the name of a shipped one")),
        }
    }

    /// Takes bytes as they are on the disk.
    pub fn from_bytes(name: &str, bytes: impl Into<Arc<[u8]>>) -> Self {
        let bytes: Arc<[u8]> = bytes.into();
        let start = if bytes.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
        let end = end_of_first_program(&bytes, start);
        let is_utf8 = std::str::from_utf8(&bytes[start..]).is_ok();
        Self { inner: Arc::new(Inner { name: name.into(), bytes, start, end, is_utf8, structure: OnceLock::new() }) }
    }

    /// Name as given, with its folders.
    pub fn name(&self) -> &str {
        &self.inner.name
    }

    /// Name as given, shared.
    pub fn shared_name(&self) -> Arc<str> {
        self.inner.name.clone()
    }

    /// Name without folders.
    pub fn file_name(&self) -> &str {
        self.name().rsplit(['/', '\\']).next().unwrap_or_default()
    }

    /// Bytes as they are on the disk.
    pub fn bytes(&self) -> &Arc<[u8]> {
        &self.inner.bytes
    }

    /// The first line.
    pub fn first(&self) -> Cursor {
        Cursor { line: 1, offset: self.inner.start }
    }

    /// Bytes of the line at `cursor` without its line end, and the cursor of the next line; `None` after the last line.
    pub fn line_bytes(&self, cursor: Cursor) -> Option<(&[u8], Cursor)> {
        let rest = self.inner.bytes.get(cursor.offset..self.inner.end)?;
        if rest.is_empty() {
            return None;
        }
        let length = find_byte(rest, b'\n');
        let next = Cursor { line: cursor.line.saturating_add(1), offset: cursor.offset + (length + 1).min(rest.len()) };
        let line = &rest[..length];
        Some((line.strip_suffix(b"\r").unwrap_or(line), next))
    }

    /// The decoded line at `cursor`; empty after the last line.
    pub fn line_text(&self, cursor: Cursor) -> Cow<'_, str> {
        self.line_bytes(cursor).map_or(Cow::Borrowed(""), |(bytes, _)| self.decode(bytes))
    }

    /// Text of bytes of this file.
    pub fn decode<'a>(&self, bytes: &'a [u8]) -> Cow<'a, str> {
        match std::str::from_utf8(bytes) {
            // Also in a Windows-1252 file most lines are plain ASCII, which is the same in both.
            Ok(text) if self.inner.is_utf8 || bytes.is_ascii() => Cow::Borrowed(text),
            _ => Cow::Owned(bytes.iter().map(|byte| windows_1252(*byte)).collect()),
        }
    }

    /// Labels and partners of structured blocks. The file is scanned once, when somebody first asks.
    pub fn structure(&self) -> &Structure {
        self.inner.structure.get_or_init(|| Structure::scan(self))
    }
}

/// Index of the first `wanted` in `bytes`, or their length. Eight bytes at a time: this is where streaming spends its time.
fn find_byte(bytes: &[u8], wanted: u8) -> usize {
    const LOW: u64 = 0x0101_0101_0101_0101;
    const HIGH: u64 = 0x8080_8080_8080_8080;
    let pattern = LOW * u64::from(wanted);
    let (chunks, _) = bytes.as_chunks::<8>();
    for (i, chunk) in chunks.iter().enumerate() {
        let x = u64::from_le_bytes(*chunk) ^ pattern;
        let hit = x.wrapping_sub(LOW) & !x & HIGH;
        if hit != 0 {
            return i * 8 + hit.trailing_zeros() as usize / 8;
        }
    }
    let done = chunks.len() * 8;
    bytes[done..].iter().position(|byte| *byte == wanted).map_or(bytes.len(), |i| done + i)
}

/// An archive holds several programs, each under a `%_N_NAME_MPF` header: this one ends where the second header begins.
fn end_of_first_program(bytes: &[u8], start: usize) -> usize {
    let mut offset = start;
    let mut content_seen = false;
    while offset < bytes.len() {
        let rest = &bytes[offset..];
        match rest[0] {
            b'%' if content_seen && rest.len() > 3 && rest[1..4].eq_ignore_ascii_case(b"_N_") => return offset,
            b'%' | b';' | b'\r' | b'\n' => {}
            _ => content_seen = true,
        }
        offset += find_byte(rest, b'\n') + 1;
    }
    bytes.len()
}

/// One character of Windows-1252. The five bytes that it leaves open are the control characters of Latin-1.
fn windows_1252(byte: u8) -> char {
    const FROM_0X80: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘',
        '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
    ];
    match byte {
        0x80..=0x9f => FROM_0X80[usize::from(byte - 0x80)],
        _ => char::from(byte),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_at_any_place_of_eight_bytes() {
        for length in 0..40 {
            let mut text = vec![b'x'; length];
            assert_eq!(find_byte(&text, b'\n'), length);
            text.extend_from_slice(b"\nrest\n");
            assert_eq!(find_byte(&text, b'\n'), length);
        }
    }
}

/// Bytes looked at to tell text from data.
const HEAD_BYTES: usize = 4096;

/// What a file is that cannot be an NC program, and what to do: text in two-byte characters, or no text at all.
fn no_program(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
        return Some(("UTF-16 text", "save it as UTF-8, Latin-1 or Windows-1252"));
    }
    let head = &bytes[..bytes.len().min(HEAD_BYTES)];
    head.contains(&0).then_some(("no text: it holds zero bytes", "give the path of an NC program"))
}
