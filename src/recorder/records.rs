//! The records of an MCAP file one after another, with their places in bytes.
//!
//! In: a file, whole or damaged. Out: [`Frame`]s, their bodies, unpacked chunks; where something is wrong, a [`Damage`] that says
//! what and where. Trusts nothing that it reads: a length is held against the size of the file before memory is taken for it.
//! Does not interpret messages.

use crate::base::Diagnostic;
use mcap::MAGIC;
use mcap::records::op;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Opcode and length before the body of a record.
pub(super) const FRAME_HEAD_BYTES: u64 = 1 + 8;
/// An unpacked chunk is at most so large; ours have 1 MiB.
const CHUNK_LIMIT_BYTES: u64 = 1 << 28;

/// A record of the file: its place, not its contents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Frame {
    /// Where its opcode stands.
    pub(super) offset: u64,
    pub(super) opcode: u8,
    /// Bytes of its body.
    pub(super) length: u64,
}

impl Frame {
    /// First byte after the record.
    pub(super) fn end(&self) -> u64 {
        self.offset + FRAME_HEAD_BYTES + self.length
    }
}

/// What is wrong with a file, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Damage {
    /// Byte from the start of the file.
    pub(super) offset: u64,
    pub(super) kind: DamageKind,
}

/// Sorts of damage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum DamageKind {
    /// The file ends before its index: a run was killed, or a copy was cut off.
    Unfinished,
    /// A record goes on beyond the end of the file.
    CutOff { length: u64, left: u64 },
    /// A checksum does not fit.
    Checksum { saved: u32, calculated: u32, of: &'static str },
    /// The bytes make no sense.
    Malformed { of: &'static str, reason: String },
}

impl Damage {
    pub(super) fn malformed(offset: u64, of: &'static str, reason: impl Into<String>) -> Self {
        Self { offset, kind: DamageKind::Malformed { of, reason: reason.into() } }
    }

    /// One sentence for people.
    pub(super) fn sentence(&self) -> String {
        let at = self.offset;
        match &self.kind {
            DamageKind::Unfinished => format!("it ends at byte {at} without an index"),
            DamageKind::CutOff { length, left } => {
                format!("the record at byte {at} should have {length} bytes, but the file ends after {left} of them")
            }
            DamageKind::Checksum { saved, calculated, of } => {
                format!("the checksum of {of} at byte {at} is wrong: {calculated:08x} instead of {saved:08x}")
            }
            DamageKind::Malformed { of, reason } => format!("{of} at byte {at} makes no sense: {reason}"),
        }
    }
}

/// Why reading stopped.
#[derive(Clone, Debug)]
pub(super) enum Stop {
    /// The contents are damaged.
    Damage(Damage),
    /// The operating system refused.
    Io(String),
}

impl From<Damage> for Stop {
    fn from(damage: Damage) -> Self {
        Self::Damage(damage)
    }
}

/// An open file at the border between two records.
#[derive(Debug)]
pub(super) struct Records {
    reader: BufReader<File>,
    position: u64,
    size: u64,
    finished: bool,
}

impl Records {
    /// Opens a file and checks that it begins as MCAP does.
    pub(super) fn open(path: &Path) -> Result<Self, Diagnostic> {
        let shown = path.display();
        let unreadable = |error: io::Error| {
            Diagnostic::error("R0010", format!("{shown} cannot be read: {error}")).help("check the name of the file")
        };
        let file = File::open(path).map_err(unreadable)?;
        let about = file.metadata().map_err(unreadable)?;
        if about.is_dir() {
            return Err(Diagnostic::error("R0010", format!("{shown} is a folder, not a recording")));
        }
        let size = about.len();
        let mut reader = BufReader::with_capacity(64 * 1024, file);
        let mut magic = [0; MAGIC.len()];
        if size == 0 {
            return Err(Diagnostic::error("R0011", format!("{shown} is empty"))
                .help("the run that should have written it did not start, or the disk was full"));
        }
        if size < MAGIC.len() as u64 || reader.read_exact(&mut magic).is_err() || magic != *MAGIC {
            return Err(Diagnostic::error(
                "R0011",
                format!("{shown} is not an MCAP file: it does not begin with the MCAP mark"),
            )
            .help("recordings are made by `sollwert run PROGRAM -o NAME.mcap`"));
        }
        Ok(Self { reader, position: MAGIC.len() as u64, size, finished: false })
    }

    /// Size of the file.
    pub(super) fn size(&self) -> u64 {
        self.size
    }

    /// Goes to a record that is known to begin at `offset`.
    pub(super) fn seek(&mut self, offset: u64) -> Result<(), Stop> {
        self.reader.seek(SeekFrom::Start(offset)).map_err(io_stop)?;
        self.position = offset;
        self.finished = false;
        Ok(())
    }

    /// The next record; `None` after the mark at the end of a whole file. The body must be read or skipped before the next call.
    pub(super) fn next(&mut self) -> Result<Option<Frame>, Stop> {
        let offset = self.position;
        if self.finished {
            return self.end_mark(offset);
        }
        let left = self.size.saturating_sub(offset);
        if left == 0 {
            return Err(Damage { offset, kind: DamageKind::Unfinished }.into());
        }
        let mut head = [0; FRAME_HEAD_BYTES as usize];
        if left < FRAME_HEAD_BYTES {
            return Err(Damage { offset, kind: DamageKind::CutOff { length: FRAME_HEAD_BYTES, left } }.into());
        }
        self.read(&mut head)?;
        let length = u64_at(&head, 1).unwrap_or(0);
        let left = left - FRAME_HEAD_BYTES;
        if head[0] == 0 {
            return Err(Damage::malformed(offset, "the record", "there is no record of sort 0").into());
        }
        if length > left {
            return Err(Damage { offset, kind: DamageKind::CutOff { length, left } }.into());
        }
        self.finished = head[0] == op::FOOTER;
        Ok(Some(Frame { offset, opcode: head[0], length }))
    }

    fn end_mark(&mut self, offset: u64) -> Result<Option<Frame>, Stop> {
        let mut magic = [0; MAGIC.len()];
        if self.size.saturating_sub(offset) < MAGIC.len() as u64 {
            return Err(Damage { offset, kind: DamageKind::Unfinished }.into());
        }
        self.read(&mut magic)?;
        if magic != *MAGIC {
            return Err(Damage::malformed(offset, "the mark at the end", "these are not the bytes of MCAP").into());
        }
        if self.position != self.size {
            return Err(Damage::malformed(self.position, "the file", "it goes on after its end").into());
        }
        Ok(None)
    }

    /// Reads the whole body into `body`.
    pub(super) fn body(&mut self, frame: &Frame, body: &mut Vec<u8>) -> Result<(), Stop> {
        body.clear();
        // `next` has checked that the file holds so many bytes; a file that shrinks meanwhile ends the reading below.
        body.resize(frame.length as usize, 0);
        self.read(body)
    }

    /// Reads the first bytes of the body, at most `most`, and skips the rest.
    pub(super) fn body_head(&mut self, frame: &Frame, most: u64, body: &mut Vec<u8>) -> Result<(), Stop> {
        let head = Frame { length: frame.length.min(most), ..*frame };
        self.body(&head, body)?;
        self.skip_bytes(frame.length - head.length)
    }

    /// Reads what is left of the file from just behind the head of a record that goes on beyond the end.
    pub(super) fn cut_body(&mut self, offset: u64, body: &mut Vec<u8>) -> Result<(), Stop> {
        body.clear();
        let start = offset + FRAME_HEAD_BYTES;
        self.reader.seek(SeekFrom::Start(start)).map_err(io_stop)?;
        let left = self.size.saturating_sub(start);
        Read::take(&mut self.reader, left.min(CHUNK_LIMIT_BYTES)).read_to_end(body).map_err(io_stop)?;
        self.position = self.size;
        Ok(())
    }

    /// Opcode of the record at `offset`, whatever else is wrong with it.
    pub(super) fn opcode_at(&mut self, offset: u64) -> Result<u8, Stop> {
        let mut opcode = [0];
        self.reader.seek(SeekFrom::Start(offset)).map_err(io_stop)?;
        self.reader.read_exact(&mut opcode).map_err(io_stop)?;
        Ok(opcode[0])
    }

    /// Passes over the body.
    pub(super) fn skip(&mut self, frame: &Frame) -> Result<(), Stop> {
        self.skip_bytes(frame.length)
    }

    fn skip_bytes(&mut self, count: u64) -> Result<(), Stop> {
        match i64::try_from(count) {
            Ok(step) => self.reader.seek_relative(step).map_err(io_stop)?,
            Err(_) => return self.seek(self.position.saturating_add(count)),
        }
        self.position += count;
        Ok(())
    }

    fn read(&mut self, bytes: &mut [u8]) -> Result<(), Stop> {
        let offset = self.position;
        self.reader.read_exact(bytes).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => Damage { offset, kind: DamageKind::Unfinished }.into(),
            _ => io_stop(error),
        })?;
        self.position += bytes.len() as u64;
        Ok(())
    }
}

fn io_stop(error: io::Error) -> Stop {
    Stop::Io(error.to_string())
}

/// Head of a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ChunkHead<'a> {
    pub(super) start_ns: u64,
    pub(super) end_ns: u64,
    unpacked_bytes: u64,
    checksum: u32,
    compression: &'a str,
    /// The packed records, as far as they are there.
    packed: &'a [u8],
    whole: bool,
}

impl<'a> ChunkHead<'a> {
    /// Reads the head of a chunk whose body may be cut off.
    pub(super) fn parse(body: &'a [u8]) -> Option<Self> {
        let name_bytes = u32_at(body, 28)? as usize;
        let packed_at = 40_usize.checked_add(name_bytes)?;
        let compression = std::str::from_utf8(body.get(32..32 + name_bytes)?).ok()?;
        let packed_bytes = u64_at(body, 32 + name_bytes)?;
        let there = body.get(packed_at..)?;
        let packed = usize::try_from(packed_bytes).ok().and_then(|count| there.get(..count));
        Some(Self {
            start_ns: u64_at(body, 0)?,
            end_ns: u64_at(body, 8)?,
            unpacked_bytes: u64_at(body, 16)?,
            checksum: u32_at(body, 24)?,
            compression,
            packed: packed.unwrap_or(there),
            whole: packed.is_some(),
        })
    }
}

/// Unpacks chunks; keeps its buffer.
#[derive(Default)]
pub(super) struct Unpacker {
    records: Vec<u8>,
}

impl Unpacker {
    /// The records of a whole chunk, its checksum checked.
    pub(super) fn unpack(&mut self, offset: u64, head: &ChunkHead) -> Result<&[u8], Damage> {
        if !head.whole {
            return Err(Damage::malformed(offset, "the chunk", "it says that it is longer than it is"));
        }
        self.fill(offset, head, true)?;
        let calculated = crc32fast::hash(&self.records);
        if self.records.len() as u64 != head.unpacked_bytes {
            let reason = format!("{} bytes instead of {}", self.records.len(), head.unpacked_bytes);
            return Err(Damage::malformed(offset, "the chunk", reason));
        }
        if head.checksum != 0 && head.checksum != calculated {
            let kind = DamageKind::Checksum { saved: head.checksum, calculated, of: "the chunk" };
            return Err(Damage { offset, kind });
        }
        Ok(&self.records)
    }

    /// As many records as can be had of a chunk that is cut off at the end of the file.
    pub(super) fn unpack_part(&mut self, offset: u64, head: &ChunkHead) -> Result<&[u8], Damage> {
        self.fill(offset, head, false)?;
        Ok(&self.records)
    }

    /// Hands the unpacked records over and takes a buffer for the next.
    pub(super) fn swap(&mut self, buffer: &mut Vec<u8>) {
        std::mem::swap(&mut self.records, buffer);
    }

    fn fill(&mut self, offset: u64, head: &ChunkHead, whole: bool) -> Result<(), Damage> {
        self.records.clear();
        if head.unpacked_bytes > CHUNK_LIMIT_BYTES {
            let reason = format!("it says that it holds {} bytes", head.unpacked_bytes);
            return Err(Damage::malformed(offset, "the chunk", reason));
        }
        let unpacked = match head.compression {
            "" => Read::take(head.packed, head.unpacked_bytes).read_to_end(&mut self.records),
            "zstd" => zstd::stream::read::Decoder::with_buffer(head.packed)
                .and_then(|decoder| decoder.take(head.unpacked_bytes).read_to_end(&mut self.records)),
            other => {
                let reason = format!("it is packed with `{other}`, which this program does not read");
                return Err(Damage::malformed(offset, "the chunk", reason));
            }
        };
        match unpacked {
            Err(error) if whole => Err(Damage::malformed(offset, "the chunk", error.to_string())),
            // The end of the packed bytes is an error for the unpacker; what it gave before is right.
            _ => Ok(()),
        }
    }
}

/// A record inside a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct InnerRecord<'a> {
    pub(super) opcode: u8,
    pub(super) body: &'a [u8],
    /// Bytes that it takes in all.
    pub(super) size: usize,
}

/// The record that begins `bytes`; `None` if it is not all there.
pub(super) fn inner_record(bytes: &[u8]) -> Option<InnerRecord<'_>> {
    let length = usize::try_from(u64_at(bytes, 1)?).ok()?;
    let end = length.checked_add(FRAME_HEAD_BYTES as usize)?;
    Some(InnerRecord { opcode: bytes[0], body: bytes.get(FRAME_HEAD_BYTES as usize..end)?, size: end })
}

/// A message as it stands in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RawMessage<'a> {
    pub(super) channel: u16,
    pub(super) sequence: u32,
    pub(super) log_time_ns: u64,
    pub(super) publish_time_ns: u64,
    pub(super) data: &'a [u8],
}

impl<'a> RawMessage<'a> {
    pub(super) fn parse(body: &'a [u8]) -> Option<Self> {
        Some(Self {
            channel: u16::from_le_bytes(*body.first_chunk()?),
            sequence: u32_at(body, 2)?,
            log_time_ns: u64_at(body, 6)?,
            publish_time_ns: u64_at(body, 14)?,
            data: body.get(22..)?,
        })
    }
}

/// Little-endian number at a place; `None` beyond the end.
pub(super) fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|chunk| u32::from_le_bytes(*chunk))
}

/// Little-endian number at a place; `None` beyond the end.
pub(super) fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    bytes.get(at..)?.first_chunk().map(|chunk| u64::from_le_bytes(*chunk))
}
