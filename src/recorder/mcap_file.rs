//! An MCAP file, record by record, without seeking: what stands in it is whole up to its last chunk at any time.
//!
//! In: attachments, metadata and [`RawChunk`]s in the order of the file. Out: bytes in a [`Target`]; with [`McapFile::finish`] the index and the
//! end mark. Written as the format's specification (mcap.dev/spec) has it, with all checksums and indexes. A chunk is packed as a whole and in one call,
//! which is what makes it quick. Does not know what messages mean.

use super::target::Target;
use mcap::MAGIC;
use mcap::records::op;
use std::collections::BTreeMap;
use std::io::{self, Write};
use zstd::zstd_safe::CParameter;

/// Bytes of opcode and length in front of a record.
const HEAD_BYTES: usize = 9;

/// A chunk before it is packed.
#[derive(Clone, Debug, Default)]
pub(super) struct RawChunk {
    /// Its records.
    records: Vec<u8>,
    /// Time in ns and place of every message, by channel.
    index: Vec<Vec<(u64, u64)>>,
    bounds_ns: Option<(u64, u64)>,
}

impl RawChunk {
    /// Bytes so far.
    pub(super) fn bytes(&self) -> usize {
        self.records.len()
    }

    /// Empties it, and keeps its memory.
    pub(super) fn clear(&mut self) {
        self.records.clear();
        self.index.iter_mut().for_each(Vec::clear);
        self.bounds_ns = None;
    }

    /// Records that are no messages: schemas and channels.
    pub(super) fn declare(&mut self, records: &[u8]) {
        self.records.extend_from_slice(records);
    }

    /// A message; `encode` appends its data.
    pub(super) fn message(&mut self, channel: u16, sequence: u32, time_ns: u64, encode: impl FnOnce(&mut Vec<u8>)) {
        let place = self.records.len();
        let channel_index = usize::from(channel);
        if self.index.len() <= channel_index {
            self.index.resize_with(channel_index + 1, Vec::new);
        }
        self.index[channel_index].push((time_ns, place as u64));
        self.bounds_ns = Some(match self.bounds_ns {
            None => (time_ns, time_ns),
            Some((start, end)) => (start.min(time_ns), end.max(time_ns)),
        });
        let mut head = [0; HEAD_BYTES + 22];
        head[0] = op::MESSAGE;
        head[9..11].copy_from_slice(&channel.to_le_bytes());
        head[11..15].copy_from_slice(&sequence.to_le_bytes());
        head[15..23].copy_from_slice(&time_ns.to_le_bytes());
        head[23..31].copy_from_slice(&time_ns.to_le_bytes());
        self.records.extend_from_slice(&head);
        encode(&mut self.records);
        let length = (self.records.len() - place - HEAD_BYTES) as u64;
        self.records[place + 1..place + HEAD_BYTES].copy_from_slice(&length.to_le_bytes());
    }
}

/// A record in the making.
pub(super) struct RecordBytes<'a> {
    bytes: &'a mut Vec<u8>,
    start: usize,
}

impl<'a> RecordBytes<'a> {
    /// Appends to `bytes`.
    pub(super) fn begin(bytes: &'a mut Vec<u8>, opcode: u8) -> Self {
        let start = bytes.len();
        bytes.push(opcode);
        bytes.extend_from_slice(&[0; 8]);
        Self { bytes, start }
    }

    pub(super) fn u8(self, value: u8) -> Self {
        self.raw(&[value])
    }

    pub(super) fn u16(self, value: u16) -> Self {
        self.raw(&value.to_le_bytes())
    }

    pub(super) fn u32(self, value: u32) -> Self {
        self.raw(&value.to_le_bytes())
    }

    pub(super) fn u64(self, value: u64) -> Self {
        self.raw(&value.to_le_bytes())
    }

    /// Bytes with their number in front.
    pub(super) fn sized(self, bytes: &[u8]) -> Self {
        self.u32(bytes.len() as u32).raw(bytes)
    }

    pub(super) fn text(self, text: &str) -> Self {
        self.sized(text.as_bytes())
    }

    /// Pairs of texts.
    pub(super) fn map(self, map: &BTreeMap<String, String>) -> Self {
        let bytes = map.iter().map(|(key, value)| 8 + key.len() + value.len()).sum::<usize>();
        map.iter().fold(self.u32(bytes as u32), |record, (key, value)| record.text(key).text(value))
    }

    fn raw(self, bytes: &[u8]) -> Self {
        self.bytes.extend_from_slice(bytes);
        self
    }

    /// `more_bytes` of the record are written behind it by other means.
    fn end_with(self, more_bytes: u64) {
        let length = (self.bytes.len() - self.start - HEAD_BYTES) as u64 + more_bytes;
        self.bytes[self.start + 1..self.start + HEAD_BYTES].copy_from_slice(&length.to_le_bytes());
    }

    pub(super) fn end(self) {
        self.end_with(0);
    }
}

/// Records of one sort that go into the summary.
#[derive(Default)]
struct Group {
    records: Vec<u8>,
    count: u32,
}

impl Group {
    fn add(&mut self, opcode: u8, fill: impl FnOnce(RecordBytes) -> RecordBytes) {
        fill(RecordBytes::begin(&mut self.records, opcode)).end();
        self.count += 1;
    }
}

/// Schemas and channels as records: for the first chunk, and for the summary.
#[derive(Clone, Debug, Default)]
pub(super) struct Declarations {
    pub(super) schemas: Vec<u8>,
    pub(super) schema_count: u16,
    pub(super) channels: Vec<u8>,
    pub(super) channel_count: u32,
}

/// An attachment without its data.
pub(super) struct AttachmentHead<'a> {
    pub(super) time_ns: u64,
    pub(super) name: &'a str,
    pub(super) media_type: &'a str,
    pub(super) bytes: u64,
}

/// How chunks are packed: zstd at a level, with what suits numbers of eight bytes, each behind a key of one or two.
///
/// * Matches of five bytes pay: sign, exponent and the top of a mantissa, the next key, and zeros below the bits that are kept.
/// * A chunk repeats what stands one tick before, some kilobytes away: a table that fits into the nearest cache finds it.
/// * Of whole numbers most bytes are noise. Larger steps and no Huffman code pack them half as fast again, and the file is some 7 % larger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ZstdTuning {
    pub(super) level: i32,
    /// All 52 bits of the mantissa are kept.
    pub(super) whole_numbers: bool,
}

impl ZstdTuning {
    fn packer(self) -> io::Result<zstd::bulk::Compressor<'static>> {
        let mut packer = zstd::bulk::Compressor::new(self.level)?;
        let (hash_log, step) = if self.whole_numbers { (12, 2) } else { (13, 0) };
        packer.set_parameter(CParameter::MinMatch(5))?;
        packer.set_parameter(CParameter::HashLog(hash_log))?;
        packer.set_parameter(CParameter::TargetLength(step))?;
        Ok(packer)
    }
}

/// An open file.
pub(super) struct McapFile {
    target: Target,
    /// Of all bytes so far.
    checksum: crc32fast::Hasher,
    position: u64,
    /// `None`: chunks are not packed.
    packer: Option<zstd::bulk::Compressor<'static>>,
    packed: Vec<u8>,
    /// A record at work.
    record: Vec<u8>,
    declarations: Declarations,
    chunks: Group,
    attachments: Group,
    metadata: Group,
    bounds_ns: Option<(u64, u64)>,
    message_counts: BTreeMap<u16, u64>,
}

impl McapFile {
    /// Writes the head. `packing`: `None` packs nothing.
    pub(super) fn create(target: Target, library: &str, packing: Option<ZstdTuning>) -> io::Result<Self> {
        let mut file = Self {
            target,
            checksum: crc32fast::Hasher::new(),
            position: 0,
            packer: packing.map(ZstdTuning::packer).transpose()?,
            packed: Vec::new(),
            record: Vec::new(),
            declarations: Declarations::default(),
            chunks: Group::default(),
            attachments: Group::default(),
            metadata: Group::default(),
            bounds_ns: None,
            message_counts: BTreeMap::new(),
        };
        file.write(MAGIC)?;
        file.write_record(op::HEADER, |record| record.text("").text(library))?;
        Ok(file)
    }

    /// What the summary says of topics.
    pub(super) fn declare(&mut self, declarations: Declarations) {
        self.declarations = declarations;
    }

    /// Messages so far.
    pub(super) fn messages(&self) -> u64 {
        self.message_counts.values().sum()
    }

    /// Pushes everything to the operating system.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.target.flush()
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.checksum.update(bytes);
        self.position += bytes.len() as u64;
        self.target.write_all(bytes)
    }

    fn write_record(&mut self, opcode: u8, fill: impl FnOnce(RecordBytes) -> RecordBytes) -> io::Result<()> {
        let mut record = std::mem::take(&mut self.record);
        record.clear();
        fill(RecordBytes::begin(&mut record, opcode)).end();
        let written = self.write(&record);
        self.record = record;
        written
    }

    /// An attachment, stretch by stretch: `pass` hands its data to its argument, which says whether to go on.
    pub(super) fn attach(
        &mut self,
        head: &AttachmentHead,
        pass: impl FnOnce(&mut dyn FnMut(&[u8]) -> bool) -> io::Result<()>,
    ) -> io::Result<()> {
        let start = self.position;
        let mut record = std::mem::take(&mut self.record);
        record.clear();
        RecordBytes::begin(&mut record, op::ATTACHMENT)
            .u64(head.time_ns)
            .u64(0)
            .text(head.name)
            .text(head.media_type)
            .u64(head.bytes)
            .end_with(head.bytes + 4);
        self.write(&record)?;
        let mut checksum = crc32fast::Hasher::new();
        checksum.update(&record[HEAD_BYTES..]);
        self.record = record;
        let (mut written, mut left) = (Ok(()), head.bytes);
        pass(&mut |bytes| {
            checksum.update(bytes);
            left = left.wrapping_sub(bytes.len() as u64);
            written = self.write(bytes);
            written.is_ok()
        })?;
        written?;
        if left != 0 {
            return Err(io::Error::other(format!("{} has changed its length", head.name)));
        }
        self.write(&checksum.finalize().to_le_bytes())?;
        let length = self.position - start;
        self.attachments.add(op::ATTACHMENT_INDEX, |record| {
            let record = record.u64(start).u64(length).u64(head.time_ns).u64(0).u64(head.bytes);
            record.text(head.name).text(head.media_type)
        });
        Ok(())
    }

    /// A metadata record.
    pub(super) fn write_metadata(&mut self, name: &str, map: &BTreeMap<String, String>) -> io::Result<()> {
        let start = self.position;
        self.write_record(op::METADATA, |record| record.text(name).map(map))?;
        let length = self.position - start;
        self.metadata.add(op::METADATA_INDEX, |record| record.u64(start).u64(length).text(name));
        Ok(())
    }

    /// Packs a chunk and writes it with its index, and pushes it to the operating system. An empty one is left out.
    pub(super) fn write_chunk(&mut self, chunk: &RawChunk) -> io::Result<()> {
        if chunk.records.is_empty() {
            return Ok(());
        }
        let mut packed = std::mem::take(&mut self.packed);
        let mut packed_bytes = 0;
        let compression = match &mut self.packer {
            None => "",
            Some(packer) => {
                // Grows to the largest chunk and stays: filling it with zeros each time is a fiftieth of the work.
                let bound = zstd::zstd_safe::compress_bound(chunk.records.len());
                if packed.len() < bound {
                    packed.resize(bound, 0);
                }
                packed_bytes = packer.compress_to_buffer(&chunk.records, &mut packed[..])?;
                "zstd"
            }
        };
        let data = if compression.is_empty() { &chunk.records[..] } else { &packed[..packed_bytes] };
        let written = self.write_packed(chunk, compression, data);
        self.packed = packed;
        written?;
        self.flush()
    }

    fn write_packed(&mut self, chunk: &RawChunk, compression: &str, data: &[u8]) -> io::Result<()> {
        let chunk_start = self.position;
        let (start_ns, end_ns) = chunk.bounds_ns.unwrap_or((0, 0));
        let unpacked_bytes = chunk.records.len() as u64;
        let mut record = std::mem::take(&mut self.record);
        record.clear();
        RecordBytes::begin(&mut record, op::CHUNK)
            .u64(start_ns)
            .u64(end_ns)
            .u64(unpacked_bytes)
            .u32(crc32fast::hash(&chunk.records))
            .text(compression)
            .u64(data.len() as u64)
            .end_with(data.len() as u64);
        self.write(&record)?;
        self.record = record;
        self.write(data)?;
        let index_start = self.position;
        let mut offsets = Vec::new();
        for (channel, index) in (0_u16..).zip(&chunk.index).filter(|(_, index)| !index.is_empty()) {
            offsets.extend_from_slice(&channel.to_le_bytes());
            offsets.extend_from_slice(&self.position.to_le_bytes());
            *self.message_counts.entry(channel).or_default() += index.len() as u64;
            self.write_record(op::MESSAGE_INDEX, |record| {
                let record = record.u16(channel).u32(16 * index.len() as u32);
                index.iter().fold(record, |record, (time_ns, place)| record.u64(*time_ns).u64(*place))
            })?;
        }
        if let Some((start, end)) = chunk.bounds_ns {
            let (before, after) = self.bounds_ns.unwrap_or((start, end));
            self.bounds_ns = Some((before.min(start), after.max(end)));
        }
        let index_bytes = self.position - index_start;
        self.chunks.add(op::CHUNK_INDEX, |record| {
            let record = record.u64(start_ns).u64(end_ns).u64(chunk_start).u64(index_start - chunk_start);
            let record = record.sized(&offsets).u64(index_bytes).text(compression);
            record.u64(data.len() as u64).u64(unpacked_bytes)
        });
        Ok(())
    }

    /// Writes index and end mark, and waits for the disk. Returns the size of the file.
    pub(super) fn finish(mut self) -> io::Result<u64> {
        let checksum = self.checksum.clone().finalize();
        self.write_record(op::DATA_END, |record| record.u32(checksum))?;
        let summary_start = self.position;
        self.checksum = crc32fast::Hasher::new();
        let groups = [
            (op::SCHEMA, std::mem::take(&mut self.declarations.schemas)),
            (op::CHANNEL, std::mem::take(&mut self.declarations.channels)),
            (op::STATISTICS, self.statistics()),
            (op::CHUNK_INDEX, std::mem::take(&mut self.chunks.records)),
            (op::ATTACHMENT_INDEX, std::mem::take(&mut self.attachments.records)),
            (op::METADATA_INDEX, std::mem::take(&mut self.metadata.records)),
        ];
        let mut offsets = Vec::new();
        for (opcode, records) in groups.iter().filter(|(_, records)| !records.is_empty()) {
            let start = self.position;
            self.write(records)?;
            let length = records.len() as u64;
            RecordBytes::begin(&mut offsets, op::SUMMARY_OFFSET).u8(*opcode).u64(start).u64(length).end();
        }
        let offsets_start = self.position;
        self.write(&offsets)?;
        let mut footer = Vec::new();
        RecordBytes::begin(&mut footer, op::FOOTER).u64(summary_start).u64(offsets_start).end_with(4);
        self.write(&footer)?;
        let checksum = self.checksum.clone().finalize();
        self.write(&checksum.to_le_bytes())?;
        self.write(MAGIC)?;
        self.target.complete()?;
        Ok(self.target.bytes())
    }

    fn statistics(&self) -> Vec<u8> {
        let mut record = Vec::new();
        let (start_ns, end_ns) = self.bounds_ns.unwrap_or((0, 0));
        let counts: Vec<u8> = self
            .message_counts
            .iter()
            .flat_map(|(channel, count)| channel.to_le_bytes().into_iter().chain(count.to_le_bytes()))
            .collect();
        RecordBytes::begin(&mut record, op::STATISTICS)
            .u64(self.messages())
            .u16(self.declarations.schema_count)
            .u32(self.declarations.channel_count)
            .u32(self.attachments.count)
            .u32(self.metadata.count)
            .u32(self.chunks.count)
            .u64(start_ns)
            .u64(end_ns)
            .sized(&counts)
            .end();
        record
    }
}
