//! The file behind a trace: plain, packed (zip, gzip) or a folder of chained files, and which format its content is.
//!
//! In: a path. Out: [`Source`] with its parts in the order of their names, each readable from its beginning as often as wanted; the
//! [`TraceFormat`]. The ending of a name decides nothing. Does not interpret the content any further.

use super::text::{TOO_LONG, TextReader};
use super::wire::TraceFormat;
use crate::base::Diagnostic;
use crate::base::diagnostics::Place;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes that are looked at to know what a file is.
const SNIFF_BYTES: u64 = 64 * 1024;
/// Unpacked bytes of a zip that are fine whatever its size.
const UNPACKED_FREE_BYTES: u64 = 64 << 20;
/// Beyond, so many bytes may come out of one: tables of numbers reach 20.
const UNPACKED_RATIO_MAX: u64 = 200;
/// Files of a chain.
const PARTS_MAX: usize = 10_000;
/// Bytes of a line that a finding shows.
const SHOWN_BYTES: usize = 160;

/// Told how far the reading is: bytes done, bytes in all.
#[derive(Clone, Copy, Default)]
pub struct Progress<'a>(pub Option<&'a dyn Fn(u64, u64)>);

impl std::fmt::Debug for Progress<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("Progress")
    }
}

/// A file, or several that belong together.
#[derive(Debug)]
pub(super) struct Source<'a> {
    pub(super) shown: String,
    parts: Vec<Part>,
    progress: Progress<'a>,
    total: u64,
}

#[derive(Debug)]
struct Part {
    shown: Arc<str>,
    path: PathBuf,
    packing: Packing,
}

/// How a part lies in its file.
#[derive(Clone, Copy, Debug)]
enum Packing {
    /// It is the file.
    Plain,
    /// It is all that the file unpacks to.
    Gzip,
    /// Place in a zip archive.
    Zip(usize),
}

/// A part that is being read.
pub(super) type PartReader<'a> = TextReader<Box<dyn Read + 'a>>;

impl<'a> Source<'a> {
    pub(super) fn open(path: &Path, progress: Progress<'a>) -> Result<Self, Diagnostic> {
        let shown = path.display().to_string();
        let unreadable = |error: &io::Error| unreadable(&shown, error);
        let about = std::fs::metadata(path).map_err(|error| unreadable(&error))?;
        let files = if about.is_dir() { folder(path).map_err(|error| unreadable(&error))? } else { vec![path.into()] };
        let mut parts = Vec::new();
        let mut total = 0;
        for file in files {
            total += std::fs::metadata(&file).map_err(|error| unreadable(&error))?.len();
            let mut mark = [0; 4];
            let read =
                File::open(&file).and_then(|mut file| file.read(&mut mark)).map_err(|error| unreadable(&error))?;
            if read == 4 && mark == *b"PK\x03\x04" {
                parts.extend(archive(&file)?);
                continue;
            }
            let packing = if mark.starts_with(&[0x1f, 0x8b, 8]) { Packing::Gzip } else { Packing::Plain };
            parts.push(Part { shown: Arc::from(file.display().to_string()), path: file, packing });
        }
        if parts.is_empty() || parts.len() > PARTS_MAX {
            let message = format!("{shown} holds {} files that could be a trace", parts.len());
            return Err(Diagnostic::error("T0002", message).help("name the file itself"));
        }
        Ok(Self { shown, parts, progress, total })
    }

    /// A recording is read by its index: not out of an archive.
    pub(super) fn refuse_packed(&self) -> Result<(), Diagnostic> {
        match self.parts.first() {
            Some(part) if !matches!(part.packing, Packing::Plain) => {
                let message = format!("{} is a recording in an archive", part.shown);
                Err(Diagnostic::error("T0018", message).help("unpack it, and name the recording"))
            }
            _ => Ok(()),
        }
    }

    pub(super) fn part_count(&self) -> usize {
        self.parts.len()
    }

    /// Name of a part for findings.
    pub(super) fn part_name(&self, part: usize) -> &Arc<str> {
        &self.parts[part].shown
    }

    /// The text of a part from its beginning.
    pub(super) fn read(&self, part: usize) -> Result<PartReader<'a>, Diagnostic> {
        Ok(TextReader::new(self.bytes(part)?))
    }

    fn bytes(&self, part: usize) -> Result<Box<dyn Read + 'a>, Diagnostic> {
        let Part { shown, path, packing } = &self.parts[part];
        let file = File::open(path).map_err(|error| unreadable(shown, &error))?;
        let before: u64 = self.parts[..part].iter().filter_map(|part| part.path.metadata().ok()).map(|m| m.len()).sum();
        let entry = match packing {
            Packing::Zip(entry) => entry,
            Packing::Plain => {
                let done = before;
                return Ok(Box::new(Counted { reader: file, done, total: self.total, progress: self.progress }));
            }
            Packing::Gzip => {
                let limit = unpacked_max(file.metadata().map_or(0, |about| about.len()));
                let packed = Counted { reader: file, done: before, total: self.total, progress: self.progress };
                let packed = io::BufReader::new(packed);
                return Ok(Box::new(Bounded { reader: flate2::bufread::MultiGzDecoder::new(packed), left: limit }));
            }
        };
        let fault = |error: zip::result::ZipError| damaged_archive(shown, &error.to_string());
        let mut archive = zip::ZipArchive::new(file).map_err(fault)?;
        // The entry must own the file, so its place in the file is taken and unpacked here.
        let (start, packed_bytes, method) = {
            let entry = archive.by_index_raw(*entry).map_err(fault)?;
            (entry.data_start().unwrap_or(0), entry.compressed_size(), entry.compression())
        };
        let mut file = File::open(path).map_err(|error| unreadable(shown, &error))?;
        io::Seek::seek(&mut file, io::SeekFrom::Start(start)).map_err(|error| unreadable(shown, &error))?;
        let counted = Counted { reader: file, done: start, total: self.total, progress: self.progress };
        let packed = counted.take(packed_bytes);
        match method {
            zip::CompressionMethod::Stored => Ok(Box::new(packed)),
            zip::CompressionMethod::Deflated => {
                let unpacked = flate2::read::DeflateDecoder::new(packed);
                Ok(Box::new(Bounded { reader: unpacked, left: unpacked_max(packed_bytes) }))
            }
            other => {
                Err(damaged_archive(shown, &format!("it is packed with {other}, which this program does not read")))
            }
        }
    }

    /// First bytes of the first part as they are in the file.
    fn head(&self) -> Result<Vec<u8>, Diagnostic> {
        let mut head = Vec::new();
        let silent = Source { shown: String::new(), parts: Vec::new(), progress: Progress(None), total: 0 };
        let part = &self.parts[0];
        let alone = Source {
            parts: vec![Part { shown: part.shown.clone(), path: part.path.clone(), packing: part.packing }],
            ..silent
        };
        let read = alone.bytes(0)?.take(SNIFF_BYTES).read_to_end(&mut head);
        read.map_err(|error| unreadable(&part.shown, &error))?;
        Ok(head)
    }

    /// What the content is.
    pub(super) fn format(&self) -> Result<TraceFormat, Diagnostic> {
        let head = self.head()?;
        let shown = &self.parts[0].shown;
        if head.is_empty() {
            return Err(Diagnostic::error("T0003", format!("{shown} is empty")).help("export the trace again"));
        }
        if head.starts_with(mcap::MAGIC) {
            return Ok(TraceFormat::Recording);
        }
        let mut text = String::new();
        let mut decoder = TextReader::new(head.as_slice());
        // The head may end in the middle of a character: what was decoded before is enough.
        let _ = decoder.read_to_string(&mut text);
        super::sniff::format_of(&text, shown)
    }

    /// A part cannot be read on; a line that is too long is shown.
    pub(super) fn unreadable_at(&self, part: usize, byte: u64, error: &io::Error) -> Diagnostic {
        let finding = unreadable(self.part_name(part), error);
        let place = if error.to_string() == TOO_LONG { self.place(part, byte, "here") } else { None };
        match place {
            Some(place) => finding.at(place),
            None => finding,
        }
    }

    /// The line that holds a byte of the decoded text, with the byte marked. Reads the part again: only for findings.
    pub(super) fn place(&self, part: usize, byte: u64, label: &str) -> Option<Place> {
        let silent = Progress(None);
        let quiet = Source { shown: String::new(), parts: Vec::new(), progress: silent, total: 0 };
        let here = &self.parts[part];
        let copy = Part { shown: here.shown.clone(), path: here.path.clone(), packing: here.packing };
        let mut reader = Source { parts: vec![copy], ..quiet }.read(0).ok()?;
        let mut line = String::new();
        let mut number = 0_u32;
        loop {
            let start = reader.consumed();
            number = number.saturating_add(1);
            match reader.line(&mut line) {
                Ok(true) => {}
                Ok(false) => return None,
                Err(_) => return Some(marked(here.shown.clone(), number, &line, 0, label)),
            }
            if byte < reader.consumed() {
                return Some(marked(here.shown.clone(), number, &line, (byte - start) as usize, label));
            }
        }
    }
}

/// A place in a line that may be very long.
fn marked(file: Arc<str>, line: u32, text: &str, column: usize, label: &str) -> Place {
    let border = |mut at: usize| {
        at = at.min(text.len());
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    let column = border(column);
    let from = border(column.saturating_sub(SHOWN_BYTES / 2));
    let to = border(column + SHOWN_BYTES / 2);
    let columns = column - from..column - from;
    Place { file, line, line_text: text[from..to].to_owned(), columns, label: label.to_owned() }
}

/// Files of a folder in the order of their names; hidden ones are none.
fn folder(path: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path)?.take(PARTS_MAX + 1) {
        let entry = entry?;
        let hidden = entry.file_name().to_string_lossy().starts_with('.');
        if entry.file_type()?.is_file() && !hidden {
            files.push(entry.path());
        }
    }
    files.sort_by_key(|file| natural_key(&file.display().to_string()));
    Ok(files)
}

fn archive(path: &Path) -> Result<Vec<Part>, Diagnostic> {
    let shown = path.display().to_string();
    let fault = |error: zip::result::ZipError| damaged_archive(&shown, &error.to_string());
    let file = File::open(path).map_err(|error| unreadable(&shown, &error))?;
    let archive = zip::ZipArchive::new(file).map_err(fault)?;
    let mut names: Vec<(usize, String)> = (0..archive.len())
        .filter_map(|place| Some((place, archive.name_for_index(place)?.ok()?.into_owned())))
        .collect();
    names.retain(|(_, name)| !name.ends_with('/') && !name.starts_with("__MACOSX"));
    names.sort_by_key(|(_, name)| natural_key(name));
    let part = |(place, name): (usize, String)| Part {
        shown: Arc::from(format!("{shown}:{name}")),
        path: path.to_owned(),
        packing: Packing::Zip(place),
    };
    Ok(names.into_iter().map(part).collect())
}

/// Numbers in names are compared as numbers: part 10 comes after part 9.
fn natural_key(name: &str) -> Vec<(u64, String)> {
    let mut key = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let letters = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let (text, tail) = rest.split_at(letters);
        let digits = tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len());
        key.push((0, text.to_owned()));
        key.push((tail[..digits].parse().unwrap_or(u64::MAX), String::new()));
        rest = &tail[digits..];
    }
    key
}

pub(super) fn unreadable(shown: &str, error: &io::Error) -> Diagnostic {
    if error.to_string() == TOO_LONG {
        return Diagnostic::error("T0005", format!("{shown} has {TOO_LONG}")).help("this is no trace");
    }
    Diagnostic::error("T0001", format!("{shown} cannot be read: {error}")).help("check the name of the file")
}

fn damaged_archive(shown: &str, reason: &str) -> Diagnostic {
    Diagnostic::error("T0018", format!("the archive {shown} cannot be unpacked: {reason}"))
        .help("unpack it with another program, and name the file that was in it")
}

/// Tells the progress of a reader.
struct Counted<'a, R> {
    reader: R,
    done: u64,
    total: u64,
    progress: Progress<'a>,
}

impl<R: Read> Read for Counted<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.reader.read(buffer)?;
        self.done += count as u64;
        if let Progress(Some(tell)) = self.progress {
            tell(self.done.min(self.total), self.total);
        }
        Ok(count)
    }
}

/// So many bytes may come out of packed ones.
fn unpacked_max(packed_bytes: u64) -> u64 {
    UNPACKED_FREE_BYTES.saturating_add(packed_bytes.saturating_mul(UNPACKED_RATIO_MAX))
}

/// Ends a zip bomb.
struct Bounded<R> {
    reader: R,
    left: u64,
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.reader.read(buffer)?;
        match self.left.checked_sub(count as u64) {
            Some(left) => self.left = left,
            None => {
                let reason =
                    format!("more than {UNPACKED_RATIO_MAX} bytes come out of one: this is no table of numbers");
                return Err(io::Error::other(reason));
            }
        }
        Ok(count)
    }
}
