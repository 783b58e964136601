//! Several programs in one file: `%_N_NAME_MPF` and `;$PATH=/_N_...` of an archive, `O1234` of an ISO tape.
//!
//! In: the bytes of a file, one pass over its line starts. Out: [`Section`]s, at least one; line numbers count from the start of the
//! file. The first section is the program that is run; what stands before the first header belongs to it if it is more than
//! comments. `%MPF12` and `%SPF12`, the headers of older controls, are the programs MPF12 and L12; a `%` alone is no header. Does
//! not read words.

use super::source::{Cursor, find_byte};
use super::text::ProgramText;
use std::io;
use std::sync::Arc;

/// Programs in one file.
const SECTIONS_MAX: usize = 10_000;
/// Longest header that is read.
const HEADER_BYTES: usize = 1024;
/// Text before the first header that is searched for anything but comments.
const PREFACE_BYTES: usize = 64 * 1024;

/// One program of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Section {
    /// Name in capitals without `_N_` and extension; empty for a program without header.
    pub name: Arc<str>,
    /// `MPF`, `SPF` and so on, in capitals; empty without header.
    pub extension: Arc<str>,
    /// Folders of `;$PATH=`, in capitals, outermost first: `WKS.DIR`, `PART.WPD`.
    pub folders: Vec<String>,
    /// First line.
    pub first: Cursor,
    /// Offset behind its last byte.
    pub end: usize,
}

/// Finds the programs of a text that begins at `start`.
pub(super) fn sections(text: &ProgramText, start: usize) -> io::Result<Vec<Section>> {
    let tape = text.stretch(start, HEADER_BYTES).map(|(bytes, at)| is_tape(&bytes[start - at..]))?;
    let mut headers = Vec::new();
    let mut line_start = true;
    let mut cursor = Cursor { line: 1, offset: start };
    text.pass(start, |bytes| {
        let mut at = 0;
        while at < bytes.len() {
            let marks = bytes[at] == b'%' || (tape && matches!(bytes[at], b'O' | b'o'));
            if line_start && marks {
                headers.push(cursor);
            }
            let length = find_byte(&bytes[at..], b'\n');
            line_start = at + length < bytes.len();
            let taken = if line_start { length + 1 } else { length };
            at += taken;
            cursor.offset += taken;
            cursor.line = cursor.line.saturating_add(u32::from(line_start));
        }
        headers.len() < SECTIONS_MAX
    })?;
    let whole = Section {
        name: "".into(),
        extension: "".into(),
        folders: Vec::new(),
        first: Cursor { line: 1, offset: start },
        end: text.length(),
    };
    let mut found: Vec<Section> = Vec::new();
    for header in headers {
        let (bytes, at) = text.stretch(header.offset, HEADER_BYTES)?;
        let bytes = &bytes[header.offset - at..];
        let Some(mut section) = read_header(&bytes[..bytes.len().min(HEADER_BYTES)], header) else { continue };
        section.end = text.length();
        match found.last_mut() {
            Some(before) => before.end = header.offset,
            None if has_content(text, start, header.offset)? => {
                found.push(Section { end: header.offset, ..whole.clone() });
            }
            None => {}
        }
        found.push(section);
    }
    if found.is_empty() {
        found.push(whole);
    }
    Ok(found)
}

/// Name, extension and path of a header; `None` for a `%` that is none.
fn read_header(bytes: &[u8], header: Cursor) -> Option<Section> {
    let end = find_byte(bytes, b'\n');
    let line = String::from_utf8_lossy(&bytes[..end]).trim().to_ascii_uppercase();
    let (name, extension) = if line.starts_with("%_N_") {
        split_name(line.split_whitespace().next().unwrap_or_default().trim_start_matches('%'))
    } else if let Some((name, extension @ ("MPF" | "SPF"))) =
        line.strip_prefix('%').and_then(|line| line.rsplit_once('_'))
    {
        (name.to_owned(), extension.to_owned())
    } else if let Some(number) = line.strip_prefix("%SPF").and_then(number_text) {
        (format!("L{number}"), "SPF".to_owned())
    } else if let Some(number) = line.strip_prefix("%MPF").and_then(number_text) {
        (format!("MPF{number}"), "MPF".to_owned())
    } else {
        // An O number stands alone or before a comment in brackets; it is no block of this language, and is passed over.
        let number = tape_number(line.as_bytes())?;
        let first = Cursor { line: header.line + 1, offset: header.offset + (end + 1).min(bytes.len()) };
        return Some(section(format!("O{number}"), "MPF".to_owned(), Vec::new(), first));
    };
    let path = bytes.get(end + 1..).map(|rest| String::from_utf8_lossy(&rest[..find_byte(rest, b'\n')]).into_owned());
    let folders = path.as_deref().and_then(|line| {
        let line = line.trim().to_ascii_uppercase();
        line.strip_prefix(";$PATH=").map(folders_of)
    });
    Some(section(name, extension, folders.unwrap_or_default(), header))
}

fn section(name: String, extension: String, folders: Vec<String>, first: Cursor) -> Section {
    Section { name: name.into(), extension: extension.into(), folders, first, end: 0 }
}

/// `/_N_WKS_DIR/_N_PART_WPD` -> `WKS.DIR`, `PART.WPD`.
pub(super) fn folders_of(path: &str) -> Vec<String> {
    let folders = path.split('/').map(str::trim).filter(|folder| !folder.is_empty());
    folders
        .map(|folder| {
            let (name, extension) = split_name(folder);
            if extension.is_empty() { name } else { format!("{name}.{extension}") }
        })
        .collect()
}

/// Name and extension of a file, in capitals: `_N_PLATE_SPF`, `plate.spf` and `PLATE_SPF` are all PLATE and SPF.
pub(super) fn split_name(file_name: &str) -> (String, String) {
    const EXTENSIONS: [&str; 8] = ["SPF", "MPF", "DIR", "WPD", "INI", "DEF", "GUD", "ARC"];
    let upper = file_name.trim().to_ascii_uppercase();
    let name = upper.strip_prefix("_N_").unwrap_or(&upper);
    if let Some((name, extension)) = name.rsplit_once('.') {
        return (name.to_owned(), extension.to_owned());
    }
    match name.rsplit_once('_') {
        Some((name, extension)) if EXTENSIONS.contains(&extension) && !name.is_empty() => {
            (name.to_owned(), extension.to_owned())
        }
        _ => (name.to_owned(), String::new()),
    }
}

fn number_text(text: &str) -> Option<&str> {
    let digits = text.trim();
    (!digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit())).then_some(digits)
}

/// `O1234`, alone or before a comment.
fn tape_number(line: &[u8]) -> Option<String> {
    let digits = line.strip_prefix(b"O").or_else(|| line.strip_prefix(b"o"))?;
    let count = digits.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let rest = digits[count..].trim_ascii_start();
    let alone = matches!(rest.first(), None | Some(b'(' | b';' | b'\r'));
    (count > 0 && alone).then(|| String::from_utf8_lossy(&digits[..count]).into_owned())
}

/// True if the first line that is neither empty nor a comment nor a `%` is an O number.
fn is_tape(head: &[u8]) -> bool {
    let first = head.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii).find(|line| !is_preface(line));
    first.and_then(tape_number).is_some()
}

fn is_preface(line: &[u8]) -> bool {
    matches!(line.first(), None | Some(b';' | b'%'))
}

fn has_content(text: &ProgramText, start: usize, end: usize) -> io::Result<bool> {
    if end - start > PREFACE_BYTES {
        return Ok(true);
    }
    let (bytes, at) = text.stretch(start, end - start)?;
    Ok(!bytes[start - at..end - at].split(|byte| *byte == b'\n').all(|line| is_preface(line.trim_ascii())))
}
