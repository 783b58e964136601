//! Reads a recording back.
//!
//! In: a path. Out: [`Recording`] with topics, attachments, metadata; [`Messages`], streamed chunk by chunk, every chunk checked
//! before its first message is given out. A damaged file is refused with a [`Diagnostic`] that says where it is damaged and what
//! `recover` can rescue. Memory holds one chunk, whatever the length.

use super::contents::{AttachmentInfo, Contents, attachment_data};
use super::decode::{Content, TopicKind};
use super::records::{ChunkHead, Damage, FRAME_HEAD_BYTES, Frame, RawMessage, Records, Stop, Unpacker, inner_record};
use super::schema::{AXIS_FIELDS, RECORDING_FORMAT, SPINDLE_FIELDS};
use super::setup::{ABOUT_METADATA, MACHINE_MEDIA_TYPE, PROGRAM_MEDIA_TYPE, SUMMARY_METADATA};
use crate::base::units::NS_PER_S;
use crate::base::{AxisKind, Diagnostic};
use crate::program::{OpenedProgram, ProgramId};
use mcap::records::op;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A topic of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Number of the channel in the file.
    pub channel: u16,
    /// Name, such as `/axis/X`.
    pub name: String,
    /// Name of the message type.
    pub schema: String,
    /// What it is to this program.
    pub kind: TopicKind,
    /// Messages on it.
    pub messages: u64,
    /// Recorded fields of an axis, by their place in `AXIS_FIELDS`, of the spindle in `SPINDLE_FIELDS`; empty for other topics.
    pub fields: Vec<usize>,
}

/// A message with its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Place of its topic in [`Recording::topics`].
    pub topic: usize,
    /// Number within its topic, from 0.
    pub sequence: u32,
    /// Simulated time.
    pub time_ns: u64,
    /// What it says.
    pub content: Content,
}

/// A whole recording on the disk.
#[derive(Clone, Debug)]
pub struct Recording {
    path: PathBuf,
    topics: Vec<Topic>,
    attachments: Vec<AttachmentInfo>,
    metadata: BTreeMap<String, BTreeMap<String, String>>,
}

impl Recording {
    /// Opens a recording and reads everything but its messages.
    pub fn open(path: &Path) -> Result<Self, Diagnostic> {
        let mut records = Records::open(path)?;
        let contents = Contents::scan(&mut records).map_err(|stop| stop_diagnostic(path, &stop))?;
        if let Some(damage) = &contents.damage {
            return Err(damaged(path, damage, &contents, records.size()));
        }
        let recording = Self {
            path: path.to_owned(),
            topics: topics(&contents),
            attachments: contents.attachments,
            metadata: merged(contents.metadata),
        };
        recording.check_format()?;
        Ok(recording)
    }

    fn check_format(&self) -> Result<(), Diagnostic> {
        let Some(format) = self.metadata(ABOUT_METADATA).and_then(|about| about.get("format")) else { return Ok(()) };
        if *format == RECORDING_FORMAT.to_string() {
            return Ok(());
        }
        let message = format!(
            "{} is a recording of format {format}; this program reads format {RECORDING_FORMAT}",
            self.path.display()
        );
        Err(Diagnostic::error("R0014", message).help("read it with a newer version of sollwert"))
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Topics in the order of their channels: axes in machine order, path, events, poses.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Axes with name, kind and topic, in order.
    pub fn axes(&self) -> impl Iterator<Item = (&str, AxisKind, &Topic)> {
        self.topics.iter().filter_map(|topic| match &topic.kind {
            TopicKind::Axis { name, kind } => Some((name.as_str(), *kind, topic)),
            _ => None,
        })
    }

    /// Messages of all topics.
    pub fn message_count(&self) -> u64 {
        self.topics.iter().map(|topic| topic.messages).sum()
    }

    /// Attachments in order.
    pub fn attachments(&self) -> &[AttachmentInfo] {
        &self.attachments
    }

    /// Data of an attachment.
    pub fn attachment(&self, info: &AttachmentInfo) -> Result<Vec<u8>, Diagnostic> {
        let mut records = Records::open(&self.path)?;
        attachment_data(&mut records, info).map_err(|stop| stop_diagnostic(&self.path, &stop))
    }

    /// A metadata record; records of the same name are joined.
    pub fn metadata(&self, name: &str) -> Option<&BTreeMap<String, String>> {
        self.metadata.get(name)
    }

    /// Names of the metadata records.
    pub fn metadata_names(&self) -> impl Iterator<Item = &str> {
        self.metadata.keys().map(String::as_str)
    }

    /// The machine file as used: name and text. `None` in a recording without one.
    pub fn machine_text(&self) -> Result<Option<(String, String)>, Diagnostic> {
        let Some(info) = self.attachments.iter().find(|info| info.media_type == MACHINE_MEDIA_TYPE) else {
            return Ok(None);
        };
        let text = String::from_utf8(self.attachment(info)?).map_err(|_| {
            Diagnostic::error("R0012", format!("the machine file in {} is not text", self.path.display()))
        })?;
        Ok(Some((info.name.clone(), text)))
    }

    /// The programs in order of first opening: the first is the main program.
    pub fn programs(&self) -> Result<Vec<OpenedProgram>, Diagnostic> {
        let programs = self.attachments.iter().filter(|info| info.media_type == PROGRAM_MEDIA_TYPE);
        let numbered = programs.zip(0..=u16::MAX);
        numbered
            .map(|(info, id)| {
                let bytes = self.attachment(info)?.into();
                Ok(OpenedProgram { id: ProgramId(id), name: Arc::from(info.name.as_str()), bytes })
            })
            .collect()
    }

    /// The figures of the run, as `run --json` gave them; `None` if the run did not finish.
    pub fn summary(&self) -> Option<serde_json::Value> {
        let figures = self.metadata(SUMMARY_METADATA)?;
        let value =
            |text: &String| serde_json::from_str(text).unwrap_or_else(|_| serde_json::Value::from(text.as_str()));
        Some(figures.iter().map(|(key, text)| (key.clone(), value(text))).collect())
    }

    /// All messages in the order of the file.
    pub fn messages(&self) -> Result<Messages, Diagnostic> {
        Messages::open(self)
    }
}

fn topics(contents: &Contents) -> Vec<Topic> {
    let mut topics: Vec<Topic> = contents
        .channels
        .values()
        .map(|channel| {
            let schema = contents.schemas.get(&channel.schema_id).map_or("", |schema| schema.header.name.as_str());
            let kind = TopicKind::of(&channel.topic, schema);
            Topic {
                channel: channel.id,
                name: channel.topic.clone(),
                schema: schema.to_owned(),
                fields: recorded_fields(&kind, &channel.metadata),
                kind,
                messages: contents.message_counts.get(&channel.id).copied().unwrap_or(0),
            }
        })
        .collect();
    topics.sort_by_key(|topic| topic.channel);
    topics
}

/// The fields that the channel says it has; all fields where it does not say.
fn recorded_fields(kind: &TopicKind, metadata: &BTreeMap<String, String>) -> Vec<usize> {
    let listed = metadata.get("fields");
    let said = |name: &str| listed.is_none_or(|fields| fields.split(',').any(|field| field == name));
    match kind {
        TopicKind::Axis { kind, .. } => {
            AXIS_FIELDS.iter().enumerate().filter(|(_, field)| said(field.name(*kind))).map(|(i, _)| i).collect()
        }
        TopicKind::Spindle => (0..SPINDLE_FIELDS.len()).filter(|field| said(SPINDLE_FIELDS[*field])).collect(),
        _ => Vec::new(),
    }
}

fn merged(records: Vec<mcap::records::Metadata>) -> BTreeMap<String, BTreeMap<String, String>> {
    let mut merged: BTreeMap<String, BTreeMap<String, String>> = BTreeMap::new();
    for record in records {
        merged.entry(record.name).or_default().extend(record.metadata);
    }
    merged
}

/// Messages of a recording, one chunk in memory at a time. Ends after the first error.
pub struct Messages {
    path: PathBuf,
    records: Records,
    /// Kind and place in `topics`, by channel number.
    topics: BTreeMap<u16, (usize, TopicKind)>,
    unpacker: Unpacker,
    /// Body of the record at work: packed chunk, or a message outside of chunks.
    body: Vec<u8>,
    /// Unpacked records of the chunk at work, and the next one in them.
    chunk: Vec<u8>,
    chunk_at: usize,
    chunk_offset: u64,
    done: bool,
}

impl Messages {
    fn open(recording: &Recording) -> Result<Self, Diagnostic> {
        let kinds = recording.topics.iter().enumerate();
        Ok(Self {
            path: recording.path.clone(),
            records: Records::open(&recording.path)?,
            topics: kinds.map(|(i, topic)| (topic.channel, (i, topic.kind.clone()))).collect(),
            unpacker: Unpacker::default(),
            body: Vec::new(),
            chunk: Vec::new(),
            chunk_at: 0,
            chunk_offset: 0,
            done: false,
        })
    }

    /// The next message with its topic, not yet decoded: borrows from the chunk at work.
    pub(super) fn next_raw(&mut self) -> Result<Option<(usize, &TopicKind, RawMessage<'_>)>, Diagnostic> {
        if self.done {
            return Ok(None);
        }
        match self.find_message() {
            Ok(Some(place)) => {
                let body = &self.chunk[place];
                let Some(message) = RawMessage::parse(body) else {
                    return Err(self.refuse_message("it is too short"));
                };
                let Some((topic, kind)) = self.topics.get(&message.channel) else {
                    let reason = format!("its channel {} is not declared", message.channel);
                    return Err(self.refuse_message(&reason));
                };
                Ok(Some((*topic, kind, message)))
            }
            Ok(None) => {
                self.done = true;
                Ok(None)
            }
            Err(stop) => {
                self.done = true;
                Err(stop_diagnostic(&self.path, &stop))
            }
        }
    }

    /// A fault of the message that was found last.
    pub(super) fn refuse_message(&self, reason: &str) -> Diagnostic {
        let damage = Damage::malformed(self.chunk_offset, "a message in the chunk", reason);
        stop_diagnostic(&self.path, &Stop::Damage(damage))
    }

    /// Where in `chunk` the body of the next message lies.
    fn find_message(&mut self) -> Result<Option<std::ops::Range<usize>>, Stop> {
        loop {
            while self.chunk_at < self.chunk.len() {
                let Some(record) = inner_record(&self.chunk[self.chunk_at..]) else {
                    let reason = "its last record goes on beyond its end";
                    return Err(Damage::malformed(self.chunk_offset, "the chunk", reason).into());
                };
                let start = self.chunk_at + FRAME_HEAD_BYTES as usize;
                self.chunk_at += record.size;
                if record.opcode == op::MESSAGE {
                    return Ok(Some(start..self.chunk_at));
                }
            }
            let Some(frame) = self.records.next()? else { return Ok(None) };
            self.load(&frame)?;
        }
    }

    fn load(&mut self, frame: &Frame) -> Result<(), Stop> {
        match frame.opcode {
            op::CHUNK => {
                self.records.body(frame, &mut self.body)?;
                let Some(head) = ChunkHead::parse(&self.body) else {
                    return Err(Damage::malformed(frame.offset, "the head of the chunk", "it does not fit").into());
                };
                self.unpacker.unpack(frame.offset, &head)?;
                self.unpacker.swap(&mut self.chunk);
            }
            op::MESSAGE => {
                // A file without chunks: treat the message as a chunk of one record.
                self.records.body(frame, &mut self.body)?;
                self.chunk.clear();
                self.chunk.push(op::MESSAGE);
                self.chunk.extend_from_slice(&frame.length.to_le_bytes());
                self.chunk.extend_from_slice(&self.body);
            }
            _ => return self.records.skip(frame),
        }
        self.chunk_at = 0;
        self.chunk_offset = frame.offset;
        Ok(())
    }

    fn decode_next(&mut self) -> Result<Option<Message>, Diagnostic> {
        let decoded = match self.next_raw()? {
            None => return Ok(None),
            Some((topic, kind, raw)) => Content::decode(kind, raw.data).map(|content| Message {
                topic,
                sequence: raw.sequence,
                time_ns: raw.log_time_ns,
                content,
            }),
        };
        decoded.map(Some).map_err(|error| self.refuse_message(&error.to_string()))
    }
}

impl Iterator for Messages {
    type Item = Result<Message, Diagnostic>;

    fn next(&mut self) -> Option<Self::Item> {
        let next = self.decode_next().transpose();
        self.done |= matches!(next, Some(Err(_)));
        next
    }
}

/// The diagnostic for a fault in the middle of reading.
pub(super) fn stop_diagnostic(path: &Path, stop: &Stop) -> Diagnostic {
    let shown = path.display();
    match stop {
        Stop::Io(reason) => Diagnostic::error("R0010", format!("{shown} cannot be read: {reason}")),
        Stop::Damage(damage) => {
            Diagnostic::error("R0012", format!("{shown} is damaged: {}", damage.sentence())).help(recover_help(path))
        }
    }
}

/// The diagnostic for a file that is not whole.
fn damaged(path: &Path, damage: &Damage, contents: &Contents, size_bytes: u64) -> Diagnostic {
    let shown = path.display();
    let rescue = match contents.end_ns {
        Some(end_ns) => format!(
            "{} complete chunk{} with {:.3} s can be rescued: {}",
            contents.chunks,
            if contents.chunks == 1 { "" } else { "s" },
            end_ns as f64 / NS_PER_S,
            recover_help(path)
        ),
        None => format!("it holds no complete chunk, only what of one came to the disk: {}", recover_help(path)),
    };
    let message = format!("{shown} is not a whole recording ({size_bytes} bytes): {}", damage.sentence());
    Diagnostic::error("R0013", message).help(rescue)
}

fn recover_help(path: &Path) -> String {
    format!("run `sollwert recover {} -o RESCUED.mcap`", path.display())
}
