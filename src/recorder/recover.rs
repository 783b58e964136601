//! Makes a whole file of what an interrupted run or a bad disk left.
//!
//! In: a damaged recording. Out: a new file with all messages of the complete and undamaged chunks, of the readable part of a
//! chunk that is cut off at the end, attachments and metadata; and a [`RecoverReport`]. A chunk whose checksum is wrong is left
//! out whole: nothing tells which of its messages are right. Does not repair values, and never writes over its input.

use super::contents::{Contents, attachment_data, read_attachment_info};
use super::reader::stop_diagnostic;
use super::records::{ChunkHead, Damage, DamageKind, Frame, RawMessage, Records, Stop, Unpacker, inner_record};
use super::setup::Compression;
use super::target::{Target, WholeFile};
use super::writer::write_options;
use crate::base::Diagnostic;
use crate::base::units::NS_PER_S;
use mcap::records::{MessageHeader, Metadata, op};
use mcap::write::NoSeek;
use mcap::{Attachment, McapError, McapResult};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Metadata record that a recovered file has.
pub const RECOVERED_METADATA: &str = "recovered";

/// What was rescued.
#[derive(Clone, Debug, PartialEq)]
pub struct RecoverReport {
    /// Messages in the new file.
    pub messages: u64,
    /// Simulated time of the last of them; 0 without messages.
    pub end_s: f64,
    /// Chunks that were complete and undamaged.
    pub chunks: u64,
    /// Messages out of a chunk that is cut off at the end of the file (they count in `messages`).
    pub messages_of_cut_chunk: u64,
    /// Damaged chunks, attachments and metadata that were left out.
    pub left_out: u64,
    /// Messages left out because nothing says what they are.
    pub messages_undeclared: u64,
    /// Attachments in the new file.
    pub attachments: u64,
    /// The input was a whole recording.
    pub was_whole: bool,
    /// What was wrong, in the order of the file, one sentence each (the first hundred).
    pub findings: Vec<String>,
    /// Size of the new file.
    pub bytes: u64,
}

/// Most findings that a report tells one by one.
const FINDINGS_MAX: usize = 100;

/// Reads `input`, writes what can be rescued to `output`.
pub fn recover(input: &Path, output: &Path) -> Result<RecoverReport, Diagnostic> {
    if same_file(input, output) {
        let message = format!("{} cannot be recovered onto itself", input.display());
        return Err(Diagnostic::error("R0015", message).help("give another name with -o"));
    }
    let mut records = Records::open(input)?;
    let contents = Contents::scan(&mut records).map_err(|stop| stop_diagnostic(input, &stop))?;
    let (file, target) = WholeFile::create(output)?;
    let mcap = write_options(Compression::Zstd).create(NoSeek::new(target));
    let mut rescue = Rescue::new(mcap.map_err(|error| file.fault(&io_error(error)))?, contents);
    let read = rescue.run(&mut records);
    let (mut report, target) = rescue.finish();
    let target = match (read, target) {
        (Err(Fault::Read(stop)), _) => return Err(stop_diagnostic(input, &stop)),
        (Err(Fault::Write(error)), _) | (Ok(()), Err(error)) => return Err(file.fault(&io_error(error))),
        (Ok(()), Ok(target)) => target,
    };
    if report.messages == 0 && report.attachments == 0 {
        let message = format!("nothing in {} can be rescued", input.display());
        let finding = report.findings.first().map_or("it holds no message", String::as_str);
        return Err(Diagnostic::error("R0016", message).help(format!("{finding}; run the program again")));
    }
    let unharmed = report.was_whole && report.left_out == 0 && report.messages_undeclared == 0;
    if unharmed && file.is_replaced() {
        // Packed anew the same records take other bytes.
        drop(target);
        drop(file);
        report.bytes = copy(input, output)?;
    } else {
        report.bytes = file.commit(target)?;
    }
    Ok(report)
}

/// The input as it is, byte for byte.
fn copy(input: &Path, output: &Path) -> Result<u64, Diagnostic> {
    let (file, mut target) = WholeFile::create(output)?;
    let copied = fs::File::open(input).and_then(|mut source| std::io::copy(&mut source, &mut target));
    copied.map_err(|error| file.fault(&error))?;
    file.commit(target)
}

/// True if both paths lead to one existing file.
pub(super) fn same_file(a: &Path, b: &Path) -> bool {
    match (fs::canonicalize(a), fs::canonicalize(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}

fn io_error(error: McapError) -> std::io::Error {
    match error {
        McapError::Io(error) => error,
        other => std::io::Error::other(other.to_string()),
    }
}

/// Why a rescue stops.
enum Fault {
    Read(Stop),
    Write(McapError),
}

impl From<McapError> for Fault {
    fn from(error: McapError) -> Self {
        Self::Write(error)
    }
}

struct Rescue {
    mcap: mcap::Writer<NoSeek<Target>>,
    contents: Contents,
    /// Number in the new file of each channel that has been declared there; `None`: its declaration makes no sense.
    channels: BTreeMap<u16, Option<u16>>,
    unpacker: Unpacker,
    body: Vec<u8>,
    report: RecoverReport,
    end_ns: u64,
    /// Chunks of the index that were met, so that none is read twice.
    read_until: u64,
}

impl Rescue {
    fn new(mcap: mcap::Writer<NoSeek<Target>>, contents: Contents) -> Self {
        let report = RecoverReport {
            messages: 0,
            end_s: 0.0,
            chunks: 0,
            messages_of_cut_chunk: 0,
            left_out: 0,
            messages_undeclared: 0,
            attachments: 0,
            was_whole: contents.damage.is_none(),
            findings: Vec::new(),
            bytes: 0,
        };
        let (channels, unpacker) = (BTreeMap::new(), Unpacker::default());
        Self { mcap, contents, channels, unpacker, body: Vec::new(), report, end_ns: 0, read_until: 0 }
    }

    /// Walks over the file; after damage that hides where the next record begins, goes on at the next chunk of the index.
    fn run(&mut self, records: &mut Records) -> Result<(), Fault> {
        records.seek(mcap::MAGIC.len() as u64).map_err(Fault::Read)?;
        let starts: BTreeSet<u64> = self.contents.indexed_chunks.iter().copied().collect();
        if let Some(damage) = &self.contents.damage {
            self.report.findings.push(damage.sentence());
        }
        loop {
            let damage = match self.walk(records) {
                Ok(()) => return Ok(()),
                Err(Fault::Read(Stop::Damage(damage))) => damage,
                Err(fault) => return Err(fault),
            };
            if self.contents.damage.as_ref() != Some(&damage) {
                self.note(&damage);
            }
            let next = starts.range(self.read_until.max(damage.offset + 1)..).next();
            match next.filter(|start| **start < records.size()) {
                Some(start) => records.seek(*start).map_err(Fault::Read)?,
                None => return self.take_cut_chunk(records, &damage),
            }
        }
    }

    fn walk(&mut self, records: &mut Records) -> Result<(), Fault> {
        while let Some(frame) = records.next().map_err(Fault::Read)? {
            let taken = match frame.opcode {
                op::CHUNK => self.take_chunk(records, &frame),
                op::ATTACHMENT => self.take_attachment(records, &frame),
                op::METADATA => self.take_metadata(records, &frame),
                op::DATA_END => return Ok(()),
                // In a file with chunks, a message outside of them is what a wrong length made of other bytes.
                op::MESSAGE | op::SCHEMA | op::CHANNEL if self.contents.chunks == 0 => {
                    self.take_loose_record(records, &frame)
                }
                _ => records.skip(&frame).map_err(Fault::Read),
            };
            self.read_until = frame.end();
            match taken {
                // The record is bad, its length is not: the next one can be found.
                Err(Fault::Read(Stop::Damage(damage))) => {
                    self.report.left_out += 1;
                    self.note(&damage);
                    records.seek(frame.end()).map_err(Fault::Read)?;
                }
                other => other?,
            }
        }
        Ok(())
    }

    fn note(&mut self, damage: &Damage) {
        if self.report.findings.len() < FINDINGS_MAX {
            self.report.findings.push(damage.sentence());
        }
    }

    fn take_chunk(&mut self, records: &mut Records, frame: &Frame) -> Result<(), Fault> {
        let mut body = std::mem::take(&mut self.body);
        let taken = records.body(frame, &mut body).map_err(Fault::Read).and_then(|()| {
            let head = ChunkHead::parse(&body).ok_or_else(|| bad_chunk(frame.offset, "its fields do not fit in it"))?;
            self.unpacker.unpack(frame.offset, &head).map_err(|damage| Fault::Read(damage.into()))?;
            self.take_records(frame.offset)?;
            self.report.chunks += 1;
            Ok(self.mcap.flush()?)
        });
        self.body = body;
        taken
    }

    /// What can be read of a chunk that the end of the file cuts off.
    fn take_cut_chunk(&mut self, records: &mut Records, damage: &Damage) -> Result<(), Fault> {
        if !matches!(damage.kind, DamageKind::CutOff { .. })
            || records.opcode_at(damage.offset).map_err(Fault::Read)? != op::CHUNK
        {
            return Ok(());
        }
        let mut body = Vec::new();
        records.cut_body(damage.offset, &mut body).map_err(Fault::Read)?;
        let Some(head) = ChunkHead::parse(&body) else { return Ok(()) };
        if self.unpacker.unpack_part(damage.offset, &head).is_err() {
            return Ok(());
        }
        let before = self.report.messages;
        let taken = self.take_records(damage.offset);
        self.report.messages_of_cut_chunk = self.report.messages - before;
        match taken {
            Err(Fault::Write(error)) => Err(Fault::Write(error)),
            Ok(()) | Err(Fault::Read(_)) => Ok(()),
        }
    }

    /// Copies the unpacked records: declarations are remembered, messages written.
    fn take_records(&mut self, offset: u64) -> Result<(), Fault> {
        let mut chunk = Vec::new();
        self.unpacker.swap(&mut chunk);
        let mut at = 0;
        while let Some(record) = inner_record(&chunk[at..]) {
            at += record.size;
            self.take_record(offset, record.opcode, record.body)?;
        }
        self.unpacker.swap(&mut chunk);
        Ok(())
    }

    fn take_record(&mut self, offset: u64, opcode: u8, body: &[u8]) -> Result<(), Fault> {
        match opcode {
            op::SCHEMA | op::CHANNEL => {
                self.contents.declare(opcode, body);
                // At the same place as in the input, so that a rescued beginning is the beginning byte for byte.
                let id = body.first_chunk().map_or(0, |id| u16::from_le_bytes(*id));
                if opcode == op::SCHEMA { self.declare_schema(id).map(|_| ()) } else { self.channel(id).map(|_| ()) }
            }
            op::MESSAGE => {
                let message = RawMessage::parse(body).ok_or_else(|| bad_chunk(offset, "a message is too short"))?;
                self.write(&message)
            }
            _ => Ok(()),
        }
    }

    fn take_loose_record(&mut self, records: &mut Records, frame: &Frame) -> Result<(), Fault> {
        let mut body = std::mem::take(&mut self.body);
        let taken = records
            .body(frame, &mut body)
            .map_err(Fault::Read)
            .and_then(|()| self.take_record(frame.offset, frame.opcode, &body));
        self.body = body;
        taken
    }

    fn write(&mut self, message: &RawMessage) -> Result<(), Fault> {
        let channel = self.channel(message.channel)?;
        let Some(channel_id) = channel else {
            self.report.messages_undeclared += 1;
            return Ok(());
        };
        let header = MessageHeader {
            channel_id,
            sequence: message.sequence,
            log_time: message.log_time_ns,
            publish_time: message.publish_time_ns,
        };
        self.mcap.write_to_known_channel(&header, message.data)?;
        self.end_ns = self.end_ns.max(message.log_time_ns);
        self.report.messages += 1;
        Ok(())
    }

    /// Number of a channel in the new file, where it is declared when it is first met.
    fn channel(&mut self, id: u16) -> Result<Option<u16>, Fault> {
        if let Some(channel) = self.channels.get(&id) {
            return Ok(*channel);
        }
        let channel = self.declare_channel(id)?;
        if channel.is_some() || self.contents.channels.contains_key(&id) {
            self.channels.insert(id, channel);
        }
        Ok(channel)
    }

    /// Declares a channel under its old number; `None` if nothing says what it is.
    fn declare_channel(&mut self, id: u16) -> Result<Option<u16>, Fault> {
        let Some(schema_id) = self.contents.channels.get(&id).map(|channel| channel.schema_id) else { return Ok(None) };
        if schema_id != 0 && self.declare_schema(schema_id)?.is_none() {
            return Ok(None);
        }
        let Some(channel) = self.contents.channels.get(&id) else { return Ok(None) };
        let (topic, encoding) = (&channel.topic, &channel.message_encoding);
        unless_write_failed(self.mcap.add_channel_with_id(id, schema_id, topic, encoding, &channel.metadata))
    }

    fn declare_schema(&mut self, id: u16) -> Result<Option<u16>, Fault> {
        let Some(schema) = self.contents.schemas.get(&id) else { return Ok(None) };
        let header = &schema.header;
        unless_write_failed(self.mcap.add_schema_with_id(header.id, &header.name, &header.encoding, &schema.data))
    }

    fn take_attachment(&mut self, records: &mut Records, frame: &Frame) -> Result<(), Fault> {
        let info = read_attachment_info(records, frame, &mut self.body).map_err(Fault::Read)?;
        let data = attachment_data(records, &info).map_err(Fault::Read)?;
        self.mcap.attach(&Attachment {
            log_time: info.time_ns,
            create_time: 0,
            name: info.name,
            media_type: info.media_type,
            data: Cow::Owned(data),
        })?;
        self.report.attachments += 1;
        Ok(())
    }

    fn take_metadata(&mut self, records: &mut Records, frame: &Frame) -> Result<(), Fault> {
        let mut body = std::mem::take(&mut self.body);
        let read = records.body(frame, &mut body).map_err(Fault::Read);
        let parsed = read.and_then(|()| match mcap::parse_record(op::METADATA, &body) {
            Ok(mcap::records::Record::Metadata(metadata)) => Ok(metadata),
            _ => Err(Fault::Read(Damage::malformed(frame.offset, "the metadata", "it does not fit").into())),
        });
        self.body = body;
        Ok(self.mcap.write_metadata(&parsed?)?)
    }

    /// Writes what was rescued as metadata, and the index.
    fn finish(mut self) -> (RecoverReport, McapResult<Target>) {
        self.report.end_s = self.end_ns as f64 / NS_PER_S;
        let mut finished = Ok(());
        if !self.report.was_whole || self.report.left_out > 0 {
            let facts = [
                ("messages", self.report.messages.to_string()),
                ("end_s", self.report.end_s.to_string()),
                ("left_out", self.report.left_out.to_string()),
                ("messages_undeclared", self.report.messages_undeclared.to_string()),
            ];
            let metadata = facts.map(|(key, value)| (key.to_owned(), value)).into();
            finished = self.mcap.write_metadata(&Metadata { name: RECOVERED_METADATA.to_owned(), metadata });
        }
        let finished = finished.and_then(|()| self.mcap.finish().map(|_| ()));
        let target = self.mcap.into_inner().into_inner();
        (self.report, finished.map(|()| target))
    }
}

/// `None` if the declaration contradicts itself, which is the fault of the input.
fn unless_write_failed(declared: McapResult<u16>) -> Result<Option<u16>, Fault> {
    match declared {
        Ok(id) => Ok(Some(id)),
        Err(error @ (McapError::Io(_) | McapError::AttemptedWriteAfterFailure)) => Err(Fault::Write(error)),
        Err(_) => Ok(None),
    }
}

fn bad_chunk(offset: u64, reason: &str) -> Fault {
    Fault::Read(Damage::malformed(offset, "the chunk", reason).into())
}
