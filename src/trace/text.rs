//! Bytes of a file as UTF-8 text, whatever they were.
//!
//! In: any reader. Out: [`TextReader`], a `BufRead` of valid UTF-8 with counted bytes: UTF-8 with or without a mark, UTF-16 with a
//! mark, and single bytes that are not UTF-8 taken as Windows-1252, counted. One item (a tag, a line) may be so long and no longer.
//! Does not take lines apart.

use std::io::{self, BufRead, Read};

/// Longest tag or line: real ones have a few thousand bytes.
const ITEM_BYTES_MAX: u64 = 4 << 20;
const BUFFER_BYTES: usize = 128 * 1024;

/// The error text that says that an item is too long.
pub(super) const TOO_LONG: &str = "a tag, text or line that is too long";
/// Bytes that are kept of a line that is too long.
const SHOWN_OF_TOO_LONG: usize = 200;

/// Windows-1252 where it differs from Latin-1: 0x80 to 0x9f; undefined places keep their number.
const WINDOWS_1252: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘', '’',
    '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    Unknown,
    Utf8,
    Utf16 { little_endian: bool },
}

/// Reads text.
pub(super) struct TextReader<R> {
    reader: R,
    encoding: Encoding,
    /// Bytes read and not yet decoded: the beginning of a character.
    raw: Vec<u8>,
    text: Vec<u8>,
    at: usize,
    /// Decoded bytes that were consumed.
    consumed: u64,
    item_start: u64,
    item_bytes_max: u64,
    ended: bool,
    /// Bytes that were taken as Windows-1252.
    replaced: u64,
}

impl<R: Read> TextReader<R> {
    pub(super) fn new(reader: R) -> Self {
        Self {
            reader,
            encoding: Encoding::Unknown,
            raw: Vec::new(),
            text: Vec::new(),
            at: 0,
            consumed: 0,
            item_start: 0,
            item_bytes_max: ITEM_BYTES_MAX,
            ended: false,
            replaced: 0,
        }
    }

    /// For a text that is not read tag by tag or line by line.
    pub(super) fn unlimited(self) -> Self {
        Self { item_bytes_max: u64::MAX, ..self }
    }

    /// Another length of one item.
    pub(super) fn with_item_limit(self, item_bytes_max: u64) -> Self {
        Self { item_bytes_max, ..self }
    }

    /// From here on a new tag or line is counted.
    pub(super) fn begin_item(&mut self) {
        self.item_start = self.consumed;
    }

    /// Decoded bytes so far.
    pub(super) fn consumed(&self) -> u64 {
        self.consumed
    }

    /// What was not UTF-8, for people; `None` if all was.
    pub(super) fn encoding_remark(&self) -> Option<String> {
        match self.encoding {
            Encoding::Utf16 { .. } => Some("the text is UTF-16".to_owned()),
            _ if self.replaced > 0 => {
                Some(format!("{} bytes are not UTF-8 and are taken as Windows-1252 (Latin-1)", self.replaced))
            }
            _ => None,
        }
    }

    /// One line without its end; false at the end of the file.
    pub(super) fn line(&mut self, line: &mut String) -> io::Result<bool> {
        self.begin_item();
        line.clear();
        let mut bytes = std::mem::take(line).into_bytes();
        loop {
            let available = match self.fill_buf() {
                Ok(available) => available,
                Err(error) => {
                    // What begins a line that is too long shows where it is.
                    bytes.truncate(SHOWN_OF_TOO_LONG);
                    *line = String::from_utf8_lossy(&bytes).into_owned();
                    return Err(error);
                }
            };
            if available.is_empty() {
                break;
            }
            let (part, used, ends) = match available.iter().position(|byte| *byte == b'\n') {
                Some(end) => (&available[..end], end + 1, true),
                None => (available, available.len(), false),
            };
            bytes.extend_from_slice(part);
            self.consume(used);
            if ends {
                break;
            }
        }
        let some = self.consumed > self.item_start;
        while bytes.last() == Some(&b'\r') {
            bytes.pop();
        }
        // The text is UTF-8 throughout: the buffer ends at borders of characters.
        *line = String::from_utf8(bytes).map_err(|error| io::Error::other(error.to_string()))?;
        Ok(some)
    }

    fn refill(&mut self) -> io::Result<()> {
        self.text.clear();
        self.at = 0;
        while self.text.is_empty() && !self.ended {
            let held = self.raw.len();
            self.raw.resize(held + BUFFER_BYTES, 0);
            let read = loop {
                match self.reader.read(&mut self.raw[held..]) {
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    other => break other?,
                }
            };
            self.raw.truncate(held + read);
            self.ended = read == 0;
            if self.encoding == Encoding::Unknown {
                if self.raw.len() < 3 && !self.ended {
                    continue;
                }
                self.find_encoding();
            }
            match self.encoding {
                Encoding::Utf16 { little_endian } => self.decode_utf16(little_endian),
                _ => self.decode_utf8(),
            }
        }
        Ok(())
    }

    fn find_encoding(&mut self) {
        let (encoding, mark) = match self.raw.as_slice() {
            [0xef, 0xbb, 0xbf, ..] => (Encoding::Utf8, 3),
            [0xff, 0xfe, ..] => (Encoding::Utf16 { little_endian: true }, 2),
            [0xfe, 0xff, ..] => (Encoding::Utf16 { little_endian: false }, 2),
            [b'<', 0, ..] => (Encoding::Utf16 { little_endian: true }, 0),
            [0, b'<', ..] => (Encoding::Utf16 { little_endian: false }, 0),
            _ => (Encoding::Utf8, 0),
        };
        self.encoding = encoding;
        self.raw.drain(..mark);
    }

    fn decode_utf8(&mut self) {
        let mut from = 0;
        loop {
            match std::str::from_utf8(&self.raw[from..]) {
                Ok(_) => {
                    self.text.extend_from_slice(&self.raw[from..]);
                    from = self.raw.len();
                    break;
                }
                Err(error) => {
                    let valid = from + error.valid_up_to();
                    self.text.extend_from_slice(&self.raw[from..valid]);
                    from = valid;
                    if error.error_len().is_none() && !self.ended {
                        break;
                    }
                    let Some(byte) = self.raw.get(from) else { break };
                    let character = match byte {
                        0x80..=0x9f => WINDOWS_1252[usize::from(byte - 0x80)],
                        byte => char::from(*byte),
                    };
                    self.text.extend_from_slice(character.encode_utf8(&mut [0; 4]).as_bytes());
                    self.replaced += 1;
                    from += 1;
                }
            }
        }
        self.raw.drain(..from);
    }

    fn decode_utf16(&mut self, little_endian: bool) {
        let unit = |pair: &[u8]| {
            let pair = [pair[0], pair[1]];
            if little_endian { u16::from_le_bytes(pair) } else { u16::from_be_bytes(pair) }
        };
        let mut whole = self.raw.len() / 2 * 2;
        // A pair of surrogates that is cut stays for the next turn.
        if !self.ended && whole >= 2 && (0xd800..0xdc00).contains(&unit(&self.raw[whole - 2..whole])) {
            whole -= 2;
        }
        let units = self.raw[..whole].chunks_exact(2).map(unit);
        for character in char::decode_utf16(units) {
            let character = character.unwrap_or(char::REPLACEMENT_CHARACTER);
            self.text.extend_from_slice(character.encode_utf8(&mut [0; 4]).as_bytes());
        }
        self.raw.drain(..whole);
    }
}

impl<R: Read> Read for TextReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let available = self.fill_buf()?;
        let count = available.len().min(buffer.len());
        buffer[..count].copy_from_slice(&available[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl<R: Read> BufRead for TextReader<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.consumed - self.item_start > self.item_bytes_max {
            return Err(io::Error::other(TOO_LONG));
        }
        if self.at == self.text.len() && !self.ended {
            self.refill()?;
        }
        Ok(&self.text[self.at..])
    }

    fn consume(&mut self, count: usize) {
        self.at += count;
        self.consumed += count as u64;
    }
}
