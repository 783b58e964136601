//! Program file: lines, one after another.
//!
//! In: a file or bytes (UTF-8 with or without byte-order mark, else Windows-1252, of which Latin-1 is a part; LF or CRLF). Out:
//! [`ProgramSource`], which hands out one line after another through a [`Window`] on the text, so that a program of any length
//! takes the memory of one window. A [`Cursor`] is a byte offset with its line number. The character set is decided once, for the
//! file as a whole, in a pass before the first line. Does not look at words.

use super::OpenedProgram;
use super::archive::{Section, sections};
use super::characters::{BYTE_ORDER_MARK, Utf8Check, no_program, windows_1252};
use super::codes::{self, Fault, Outcome};
use super::structure::Structure;
use super::text::ProgramText;
use crate::base::Diagnostic;
use std::borrow::Cow;
use std::io;
use std::ops::{Deref, Range};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Bytes of a text on the disk that are in memory at a time.
const WINDOW_BYTES: usize = 128 * 1024;
/// Longest line of a text on the disk.
const LINE_BYTES_MAX: usize = 4 * 1024 * 1024;

/// A program as opened. Cheap to clone.
#[derive(Clone, Debug)]
pub struct ProgramSource {
    file: Arc<ProgramFile>,
    section: usize,
    structure: Arc<OnceLock<Outcome<Structure>>>,
}

/// A file with all its programs.
#[derive(Debug)]
struct ProgramFile {
    name: Arc<str>,
    /// `None`: never a file.
    path: Option<PathBuf>,
    text: ProgramText,
    is_utf8: bool,
    /// At least one.
    sections: Vec<Section>,
}

/// A line of a program: where it begins, and its number from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Cursor {
    /// Line number, from 1.
    pub line: u32,
    /// Byte offset of its first byte in the file.
    pub offset: usize,
}

/// The stretch of a text in memory; a reader of lines keeps one and hands it in again.
#[derive(Clone, Debug, Default)]
pub struct Window {
    start: usize,
    bytes: Option<Arc<[u8]>>,
}

/// Bytes of a line without its line end.
#[derive(Clone)]
pub struct Line {
    bytes: Arc<[u8]>,
    range: Range<usize>,
}

impl std::fmt::Debug for Line {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        String::from_utf8_lossy(self).fmt(formatter)
    }
}

impl Deref for Line {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes[self.range.clone()]
    }
}

impl ProgramSource {
    /// Opens a file. An unreadable file is wrong usage, not a wrong program: the caller exits with 2.
    pub fn from_file(path: &Path) -> Result<Self, Diagnostic> {
        let unreadable = |why: &str, help: &str| {
            let message = format!("the program `{}` cannot be read: {why}", path.display());
            Diagnostic::error(codes::UNREADABLE, message).help(help)
        };
        let failed = |error: io::Error| {
            unreadable(&error.to_string(), "give the path of an NC program, or the name of a shipped one")
        };
        let text = ProgramText::open(path).map_err(failed)?;
        let (head, _) = text.stretch(0, WINDOW_BYTES).map_err(failed)?;
        if let Some((what, help)) = no_program(&head) {
            return Err(unreadable(&format!("it is {what}"), help));
        }
        Self::new(&path.to_string_lossy(), Some(path.to_owned()), text).map_err(failed)
    }

    /// Takes bytes as they are on the disk, or a text that is opened already.
    pub fn from_bytes(name: &str, bytes: impl Into<ProgramText>) -> Self {
        let text: ProgramText = bytes.into();
        Self::new(name, None, text).unwrap_or_else(|_| Self::empty(name))
    }

    fn new(name: &str, path: Option<PathBuf>, text: ProgramText) -> io::Result<Self> {
        let (head, _) = text.stretch(0, BYTE_ORDER_MARK.len())?;
        let start = if head.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
        let mut check = Utf8Check::default();
        text.pass(start, |bytes| {
            check.take(bytes);
            true
        })?;
        let sections = sections(&text, start)?;
        let is_utf8 = check.is_utf8();
        Ok(Self::of(ProgramFile { name: name.into(), path, text, is_utf8, sections }))
    }

    /// What is left of a text that cannot be read.
    fn empty(name: &str) -> Self {
        let nothing: Arc<[u8]> = Arc::from(&[][..]);
        let first = Cursor { line: 1, offset: 0 };
        let section = Section { name: "".into(), extension: "".into(), folders: Vec::new(), first, end: 0 };
        let (text, sections) = (nothing.into(), vec![section]);
        Self::of(ProgramFile { name: name.into(), path: None, text, is_utf8: true, sections })
    }

    fn of(file: ProgramFile) -> Self {
        // An archive may hold its sub-programs first.
        let main = file.sections.iter().position(|section| matches!(&*section.extension, "" | "MPF"));
        let (section, file) = (main.unwrap_or(0), Arc::new(file));
        Self { file, section, structure: Arc::default() }
    }

    /// Name as given, with its folders.
    pub fn name(&self) -> &str {
        &self.file.name
    }

    /// Name as given, shared.
    pub fn shared_name(&self) -> Arc<str> {
        self.file.name.clone()
    }

    /// Name without folders.
    pub fn file_name(&self) -> &str {
        self.name().rsplit(['/', '\\']).next().unwrap_or_default()
    }

    /// Folder of the file; `None` for a text that never was a file.
    pub fn folder(&self) -> Option<&Path> {
        let folder = self.file.path.as_deref()?.parent()?;
        Some(if folder.as_os_str().is_empty() { Path::new(".") } else { folder })
    }

    /// Where the file is; `None` for a text that never was a file.
    pub fn path(&self) -> Option<&Path> {
        self.file.path.as_deref()
    }

    /// Bytes of the whole file.
    pub fn text(&self) -> &ProgramText {
        &self.file.text
    }

    /// The file under the number of a program.
    pub fn opened(&self, id: super::ProgramId) -> OpenedProgram {
        OpenedProgram { id, name: self.file_name().into(), bytes: self.file.text.clone() }
    }

    /// True if both are programs of one file.
    pub fn is_same_file(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.file, &other.file)
    }

    /// All programs of the file, in order: an archive holds several.
    pub fn sections(&self) -> &[Section] {
        &self.file.sections
    }

    /// Which of the programs of the file this one is.
    pub fn section(&self) -> &Section {
        &self.file.sections[self.section]
    }

    /// Another program of the file.
    pub fn at_section(&self, section: usize) -> Option<Self> {
        (section < self.file.sections.len()).then(|| Self { section, structure: Arc::default(), ..self.clone() })
    }

    /// The first line.
    pub fn first(&self) -> Cursor {
        self.section().first
    }

    /// The line at `cursor`, and the cursor of the next line; `None` after the last line. A text on the disk that cannot be read
    /// any more, or has changed, is a finding.
    pub fn line(&self, window: &mut Window, cursor: Cursor) -> Outcome<Option<(Line, Cursor)>> {
        if let Some(found) = self.line_in(window, cursor) {
            return Ok(found);
        }
        let mut length = WINDOW_BYTES;
        loop {
            let (bytes, start) = self.file.text.stretch(cursor.offset, length).map_err(|error| self.lost(&error))?;
            *window = Window { start, bytes: Some(bytes) };
            if let Some(found) = self.line_in(window, cursor) {
                return Ok(found);
            }
            if length >= LINE_BYTES_MAX {
                return Err(Fault::new(codes::BAD_BLOCK, 0..0, "this line is too long to be a block")
                    .label(format!("expected a line end within {LINE_BYTES_MAX} bytes")));
            }
            length = (4 * length).min(LINE_BYTES_MAX);
        }
    }

    /// As `line`, from what the window holds; the outer `None` where it does not hold the line as a whole.
    fn line_in(&self, window: &Window, cursor: Cursor) -> Option<Option<(Line, Cursor)>> {
        let end = self.section().end;
        if cursor.offset >= end {
            return Some(None);
        }
        let bytes = window.bytes.as_ref()?;
        let from = cursor.offset.checked_sub(window.start)?;
        let until = bytes.len().min(end - window.start);
        let rest = bytes.get(from..until)?;
        let length = find_byte(rest, b'\n');
        if length == rest.len() && window.start + until < end {
            return None;
        }
        let next = Cursor { line: cursor.line.saturating_add(1), offset: cursor.offset + (length + 1).min(rest.len()) };
        let shown = rest[..length].strip_suffix(b"\r").map_or(length, <[u8]>::len);
        Some(Some((Line { bytes: bytes.clone(), range: from..from + shown }, next)))
    }

    fn lost(&self, error: &io::Error) -> Box<Fault> {
        Fault::new(codes::LOST, 0..0, format!("the program `{}` cannot be read any further: {error}", self.name()))
            .help("leave the file alone until the run is over")
    }

    /// The decoded line at `cursor`; empty after the last line and where it cannot be read.
    pub fn line_text(&self, cursor: Cursor) -> String {
        match self.line(&mut Window::default(), cursor) {
            Ok(Some((line, _))) => self.decode(&line).into_owned(),
            _ => String::new(),
        }
    }

    /// The decoded line of that number, from 1: searched from the start of the file.
    pub fn text_of_line(&self, line: u32) -> Option<String> {
        let whole = self.at_section(self.file.sections.iter().rposition(|section| section.first.line <= line)?)?;
        let mut window = Window::default();
        let mut cursor = whole.first();
        loop {
            let (bytes, next) = whole.line(&mut window, cursor).ok()??;
            if cursor.line == line {
                return Some(self.decode(&bytes).into_owned());
            }
            cursor = next;
        }
    }

    /// Text of bytes of this file.
    pub fn decode<'a>(&self, bytes: &'a [u8]) -> Cow<'a, str> {
        match std::str::from_utf8(bytes) {
            // Also in a Windows-1252 file most lines are plain ASCII, which is the same in both.
            Ok(text) if self.file.is_utf8 || bytes.is_ascii() => Cow::Borrowed(text),
            _ => Cow::Owned(bytes.iter().map(|byte| windows_1252(*byte)).collect()),
        }
    }

    /// Labels and partners of structured blocks. The program is scanned once, when somebody first asks.
    pub fn structure(&self) -> Outcome<&Structure> {
        self.structure.get_or_init(|| Structure::scan(self)).as_ref().map_err(Clone::clone)
    }
}

/// Index of the first `wanted` in `bytes`, or their length. Eight bytes at a time: this is where streaming spends its time.
pub(super) fn find_byte(bytes: &[u8], wanted: u8) -> usize {
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
