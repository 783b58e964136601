//! What a file holds besides its messages, found in one walk over its records: chunks are passed over, not unpacked.
//!
//! In: an open file, whole or damaged. Out: [`Contents`]; damage is part of it, not an error. Memory does not grow with the
//! length of the recording.

use super::records::{ChunkHead, Damage, DamageKind, FRAME_HEAD_BYTES, Frame, Records, Stop, u32_at, u64_at};
use mcap::records::{Channel, Metadata, Record, SchemaHeader, op};
use std::collections::BTreeMap;

/// Bytes of a chunk or attachment that are read to know what it is.
const HEAD_BYTES: u64 = 64 * 1024;
/// Longest record that is read whole in this walk.
const RECORD_LIMIT_BYTES: u64 = 1 << 28;
/// A footer with its head.
const FOOTER_RECORD_BYTES: u64 = FRAME_HEAD_BYTES + 20;
/// Bytes of a footer that its checksum covers.
const FOOTER_CHECKED_BYTES: usize = 16;

/// An attachment, without its data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttachmentInfo {
    /// File name.
    pub name: String,
    /// Media type.
    pub media_type: String,
    /// Simulated time at which it was attached.
    pub time_ns: u64,
    /// Bytes of its data.
    pub bytes: u64,
    /// Where it stands.
    pub(super) frame: Frame,
}

/// A message type as declared in the file.
#[derive(Clone, Debug)]
pub(super) struct SchemaRecord {
    pub(super) header: SchemaHeader,
    pub(super) data: Vec<u8>,
}

/// Everything but the messages.
#[derive(Clone, Debug, Default)]
pub(super) struct Contents {
    pub(super) schemas: BTreeMap<u16, SchemaRecord>,
    pub(super) channels: BTreeMap<u16, Channel>,
    pub(super) attachments: Vec<AttachmentInfo>,
    pub(super) metadata: Vec<Metadata>,
    pub(super) message_counts: BTreeMap<u16, u64>,
    /// Complete chunks.
    pub(super) chunks: u64,
    /// Latest time that a complete chunk names.
    pub(super) end_ns: Option<u64>,
    /// Where the chunks begin that the index names, in order: after damage, reading goes on there.
    pub(super) indexed_chunks: Vec<u64>,
    /// What stopped the walk.
    pub(super) damage: Option<Damage>,
}

impl Contents {
    /// Walks over the file from its first record.
    pub(super) fn scan(records: &mut Records) -> Result<Self, Stop> {
        let mut walk = Walk::default();
        match walk.run(records) {
            Ok(()) => Ok(walk.contents),
            Err(Stop::Damage(damage)) => {
                walk.contents.damage = Some(damage);
                match walk.read_index_from_end(records) {
                    Err(Stop::Io(reason)) => Err(Stop::Io(reason)),
                    // Without an index the declarations in the chunks must do.
                    Ok(()) | Err(Stop::Damage(_)) => Ok(walk.contents),
                }
            }
            Err(stop) => Err(stop),
        }
    }

    /// Takes in a declaration; those in chunks and those in the summary are the same. False if it makes no sense.
    pub(super) fn declare(&mut self, opcode: u8, body: &[u8]) -> bool {
        match mcap::parse_record(opcode, body) {
            Ok(Record::Schema { header, data }) => {
                self.schemas.insert(header.id, SchemaRecord { header, data: data.into_owned() });
                true
            }
            Ok(Record::Channel(channel)) => {
                self.channels.insert(channel.id, channel);
                true
            }
            _ => false,
        }
    }
}

#[derive(Default)]
struct Walk {
    contents: Contents,
    /// Checksum over the summary section; runs from the end of the data on.
    summary: Option<crc32fast::Hasher>,
    body: Vec<u8>,
}

impl Walk {
    fn run(&mut self, records: &mut Records) -> Result<(), Stop> {
        let Some(first) = records.next()? else { return Ok(()) };
        if first.opcode != op::HEADER {
            return Err(Damage::malformed(first.offset, "the first record", "it is not the header").into());
        }
        self.parse(records, &first)?;
        while let Some(frame) = records.next()? {
            self.take(records, &frame)?;
        }
        Ok(())
    }

    /// Damage in the middle hides where the next record begins: a file that has its end has an index that knows.
    fn read_index_from_end(&mut self, records: &mut Records) -> Result<(), Stop> {
        let Some(footer_at) = records.size().checked_sub(FOOTER_RECORD_BYTES + mcap::MAGIC.len() as u64) else {
            return Ok(());
        };
        records.seek(footer_at)?;
        let Some(footer) = records.next()?.filter(|frame| frame.opcode == op::FOOTER) else { return Ok(()) };
        records.body(&footer, &mut self.body)?;
        let Some(summary_at) = u64_at(&self.body, 0).filter(|at| (1..footer_at).contains(at)) else { return Ok(()) };
        records.seek(summary_at)?;
        self.summary = Some(crc32fast::Hasher::new());
        while let Some(frame) = records.next()? {
            self.take_summary(records, &frame)?;
        }
        Ok(())
    }

    fn take(&mut self, records: &mut Records, frame: &Frame) -> Result<(), Stop> {
        if self.summary.is_some() {
            return self.take_summary(records, frame);
        }
        match frame.opcode {
            op::CHUNK => self.take_chunk(records, frame),
            op::ATTACHMENT => self.take_attachment(records, frame),
            op::METADATA | op::SCHEMA | op::CHANNEL => self.parse(records, frame),
            op::DATA_END => {
                self.summary = Some(crc32fast::Hasher::new());
                records.skip(frame)
            }
            _ => records.skip(frame),
        }
    }

    /// Records behind the data: their checksum stands in the footer.
    fn take_summary(&mut self, records: &mut Records, frame: &Frame) -> Result<(), Stop> {
        check_length(frame)?;
        records.body(frame, &mut self.body)?;
        let Some(hasher) = &mut self.summary else { return Ok(()) };
        hasher.update(&[frame.opcode]);
        hasher.update(&frame.length.to_le_bytes());
        if frame.opcode != op::FOOTER {
            hasher.update(&self.body);
            return self.interpret(frame);
        }
        let (Some(covered), Some(saved)) =
            (self.body.get(..FOOTER_CHECKED_BYTES), u32_at(&self.body, FOOTER_CHECKED_BYTES))
        else {
            return Err(Damage::malformed(frame.offset, "the footer", "it is too short").into());
        };
        hasher.update(covered);
        let calculated = hasher.clone().finalize();
        if saved != 0 && saved != calculated {
            let kind = DamageKind::Checksum { saved, calculated, of: "the index" };
            return Err(Damage { offset: frame.offset, kind }.into());
        }
        Ok(())
    }

    fn take_chunk(&mut self, records: &mut Records, frame: &Frame) -> Result<(), Stop> {
        records.body_head(frame, HEAD_BYTES, &mut self.body)?;
        let Some(head) = ChunkHead::parse(&self.body) else {
            return Err(Damage::malformed(frame.offset, "the head of the chunk", "its fields do not fit in it").into());
        };
        self.contents.chunks += 1;
        self.contents.end_ns = self.contents.end_ns.max(Some(head.end_ns));
        Ok(())
    }

    fn take_attachment(&mut self, records: &mut Records, frame: &Frame) -> Result<(), Stop> {
        self.contents.attachments.push(read_attachment_info(records, frame, &mut self.body)?);
        Ok(())
    }

    fn parse(&mut self, records: &mut Records, frame: &Frame) -> Result<(), Stop> {
        check_length(frame)?;
        records.body(frame, &mut self.body)?;
        self.interpret(frame)
    }

    fn interpret(&mut self, frame: &Frame) -> Result<(), Stop> {
        let malformed = || Stop::from(Damage::malformed(frame.offset, "the record", "its fields do not fit in it"));
        match frame.opcode {
            op::SCHEMA | op::CHANNEL => {
                return if self.contents.declare(frame.opcode, &self.body) { Ok(()) } else { Err(malformed()) };
            }
            op::METADATA | op::STATISTICS | op::CHUNK_INDEX | op::HEADER => {
                match mcap::parse_record(frame.opcode, &self.body).map_err(|_| malformed())? {
                    Record::Metadata(metadata) => self.contents.metadata.push(metadata),
                    Record::Statistics(counts) => self.contents.message_counts = counts.channel_message_counts,
                    Record::ChunkIndex(index) => self.contents.indexed_chunks.push(index.chunk_start_offset),
                    _ => {}
                }
            }
            _ => {}
        }
        Ok(())
    }
}

fn check_length(frame: &Frame) -> Result<(), Stop> {
    if frame.length > RECORD_LIMIT_BYTES {
        let reason = format!("it says that it has {} bytes", frame.length);
        return Err(Damage::malformed(frame.offset, "the record", reason).into());
    }
    Ok(())
}

/// Reads the head of an attachment and passes over its data.
pub(super) fn read_attachment_info(
    records: &mut Records,
    frame: &Frame,
    body: &mut Vec<u8>,
) -> Result<AttachmentInfo, Stop> {
    records.body_head(frame, HEAD_BYTES, body)?;
    parse_attachment(frame, body).ok_or_else(|| {
        Damage::malformed(frame.offset, "the head of the attachment", "its fields do not fit in it").into()
    })
}

fn parse_attachment(frame: &Frame, body: &[u8]) -> Option<AttachmentInfo> {
    let (name, at) = text_at(body, 16)?;
    let (media_type, at) = text_at(body, at)?;
    let bytes = u64_at(body, at)?;
    // The data and its checksum must fill the record exactly.
    let expected = (at as u64).checked_add(8)?.checked_add(bytes)?.checked_add(4)?;
    (expected == frame.length).then(|| AttachmentInfo {
        name,
        media_type,
        time_ns: u64_at(body, 0).unwrap_or(0),
        bytes,
        frame: *frame,
    })
}

fn text_at(body: &[u8], at: usize) -> Option<(String, usize)> {
    let start = at + 4;
    let end = start.checked_add(u32_at(body, at)? as usize)?;
    Some((String::from_utf8(body.get(start..end)?.to_vec()).ok()?, end))
}

/// Reads the data of an attachment and checks its checksum.
pub(super) fn attachment_data(records: &mut Records, info: &AttachmentInfo) -> Result<Vec<u8>, Stop> {
    let mut body = Vec::new();
    let frame = &info.frame;
    records.seek(frame.offset + FRAME_HEAD_BYTES)?;
    records.body(frame, &mut body)?;
    let checked = body.len().saturating_sub(4);
    let saved = u32_at(&body, checked).unwrap_or(0);
    let calculated = crc32fast::hash(&body[..checked]);
    if saved != 0 && saved != calculated {
        let kind = DamageKind::Checksum { saved, calculated, of: "the attachment" };
        return Err(Damage { offset: frame.offset, kind }.into());
    }
    body.truncate(checked);
    // `parse_attachment` has seen to it that the record is at least so long.
    let data_bytes = usize::try_from(info.bytes).unwrap_or(usize::MAX).min(body.len());
    Ok(body.split_off(body.len() - data_bytes))
}
