//! The writer's thread: batches in, an MCAP file out.
//!
//! In: [`Order`]s in the order of the cycle. Out: bytes, chunk by chunk, and the batches back for another turn. A chunk ends where
//! a batch says so (every simulated second, at an alarm) or at 1 MiB, never by the clock on the wall; every finished chunk is
//! pushed to the operating system at once. Knows neither paths nor the cycle. Only an [`Order::Finish`] makes the file whole: a
//! run that ends in any other way leaves a file without an index, which every reader refuses and `recover` rescues.

use super::batch::{Batch, Order, Record};
use super::encode::{AxisEncoder, Precision, RunEncoder};
use super::schema::{
    AXIS_TOPIC_PREFIX, EVENT, EVENT_TOPIC, LINEAR_AXIS, PATH, PATH_TOPIC, POSE_IN_FRAME, PROGRAMMED, PROGRAMMED_TOPIC,
    ROTARY_AXIS, SchemaText, TOOL_TOPICS,
};
use super::setup::{
    Compression, INPUTS_METADATA, MACHINE_MEDIA_TYPE, PROGRAM_MEDIA_TYPE, RecordingSetup, SUMMARY_METADATA,
    input_metadata,
};
use super::target::Target;
use crate::base::{AxisKind, Diagnostic, PerAxis, Tick, TimeBase};
use crate::program::OpenedProgram;
use crossbeam_channel::{Receiver, Sender};
use mcap::records::{AttachmentHeader, MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, McapError, McapResult, WriteOptions};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// Uncompressed bytes after which a chunk ends.
const CHUNK_BYTES: u64 = 1024 * 1024;
/// Bytes of a message record around its data: opcode, length, channel, sequence, two times.
const MESSAGE_OVERHEAD_BYTES: u64 = 1 + 8 + 2 + 4 + 8 + 8;
/// zstd: the fastest level of the regular ones.
const ZSTD_LEVEL: u32 = 1;

/// What a finished recording holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordingSummary {
    /// Size of the file.
    pub bytes: u64,
    /// Messages of all topics.
    pub messages: u64,
}

/// Options of every file that this room writes. Compression on the calling thread and no seeking: the same bytes each time, and
/// a file that is whole up to its last finished chunk.
pub(crate) fn write_options(compression: Compression) -> WriteOptions {
    WriteOptions::new()
        .compression(match compression {
            Compression::Zstd => Some(mcap::Compression::Zstd),
            Compression::None => None,
        })
        .compression_level(ZSTD_LEVEL)
        .compression_threads(0)
        .disable_seeking(true)
        .chunk_size(None)
        .library(concat!("sollwert ", env!("CARGO_PKG_VERSION")))
}

/// A topic with its counter.
#[derive(Clone, Copy, Debug)]
struct Channel {
    id: u16,
    next_sequence: u32,
}

/// An open recording.
pub(super) struct RecordingWriter {
    mcap: mcap::Writer<NoSeek<Target>>,
    name: String,
    time_base: TimeBase,
    axis_encoders: PerAxis<Option<AxisEncoder>>,
    axis_channels: PerAxis<Option<Channel>>,
    path: Channel,
    event: Channel,
    programmed: Option<Channel>,
    poses: [Option<Channel>; TOOL_TOPICS.len()],
    run_encoder: RunEncoder,
    /// Data of the message at work.
    buffer: Vec<u8>,
    chunk_bytes: u64,
    messages: u64,
    /// The tick that `time_ns` belongs to: most messages share their tick with the one before.
    tick: Tick,
    time_ns: u64,
}

impl RecordingWriter {
    /// Writes all that stands before the first message.
    pub(super) fn create(target: Target, name: String, setup: &RecordingSetup) -> Result<Self, Diagnostic> {
        let fail = |error: McapError| write_fault(&name, &error);
        let mut mcap = write_options(setup.compression).create(NoSeek::new(target)).map_err(fail)?;
        match write_prelude(&mut mcap, setup).and_then(|()| add_channels(&mut mcap, setup)) {
            Ok(channels) => Ok(Self::assemble(mcap, name, setup, channels)),
            Err(error) => {
                let diagnostic = write_fault(&name, &error);
                drop(mcap.into_inner());
                Err(diagnostic)
            }
        }
    }

    fn assemble(mcap: mcap::Writer<NoSeek<Target>>, name: String, setup: &RecordingSetup, channels: Channels) -> Self {
        let precision = Precision::new(setup.mantissa_bits);
        let mut run_encoder = RunEncoder::new(setup.machine, precision);
        for program in setup.programs {
            run_encoder.add_program(program.id, &program.name);
        }
        let signals = setup.signals.on(setup.machine);
        let axis_encoders = PerAxis::from_fn(|id| {
            let axis = setup.machine.axes.get(id.index())?;
            Some(AxisEncoder::new(axis.kind, signals.fields(id).collect(), precision))
        });
        Self {
            mcap,
            name,
            time_base: setup.machine.cycle.time_base,
            axis_encoders,
            axis_channels: channels.axes,
            path: channels.path,
            event: channels.event,
            programmed: channels.programmed,
            poses: channels.poses,
            run_encoder,
            buffer: Vec::new(),
            chunk_bytes: 0,
            messages: 0,
            tick: Tick(0),
            time_ns: 0,
        }
    }

    /// Works until the front end is done or gone. The first fault is put into `fault` at once, so that the cycle sees it.
    pub(super) fn run(
        mut self,
        orders: &Receiver<Order>,
        returned: &Sender<Batch>,
        fault: &OnceLock<Diagnostic>,
    ) -> Result<RecordingSummary, Diagnostic> {
        while let Ok(order) = orders.recv() {
            match order {
                Order::Write(mut batch) => {
                    let written = if fault.get().is_none() { self.write(&batch) } else { Ok(()) };
                    if let Err(error) = written {
                        // The only one who sets it is this thread.
                        let _ = fault.set(write_fault(&self.name, &error));
                    }
                    batch.records.clear();
                    batch.close_chunk = false;
                    // Nobody takes batches back while the recorder is being finished.
                    let _ = returned.try_send(batch);
                }
                Order::Finish(summary) => {
                    return match fault.get() {
                        Some(fault) => {
                            drop(self.mcap.into_inner());
                            Err(fault.clone())
                        }
                        None => self.finish(summary),
                    };
                }
            }
        }
        self.abandon(fault)
    }

    fn write(&mut self, batch: &Batch) -> McapResult<()> {
        for record in &batch.records {
            self.write_record(record)?;
        }
        if batch.close_chunk { self.close_chunk() } else { Ok(()) }
    }

    fn write_record(&mut self, record: &Record) -> McapResult<()> {
        if record.tick() != self.tick {
            self.tick = record.tick();
            self.time_ns = self.time_base.time_ns(self.tick);
        }
        let channel = match record {
            Record::Axis { axis, .. } => self.axis_channels[*axis].as_mut(),
            Record::Path { .. } => Some(&mut self.path),
            Record::Event { .. } => Some(&mut self.event),
            Record::Programmed { .. } => self.programmed.as_mut(),
            Record::Pose { which, .. } => self.poses[which.index()].as_mut(),
            Record::Program { program, .. } => {
                self.run_encoder.add_program(program.id, &program.name);
                let time_ns = self.time_ns;
                self.chunk_bytes = 0;
                attach_program(&mut self.mcap, program, time_ns)?;
                return write_metadata(&mut self.mcap, INPUTS_METADATA, input_metadata(program)?);
            }
        };
        let Some(channel) = channel else { return Ok(()) };
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.next_sequence,
            log_time: self.time_ns,
            publish_time: self.time_ns,
        };
        channel.next_sequence = channel.next_sequence.wrapping_add(1);
        self.buffer.clear();
        match record {
            Record::Axis { axis, setpoint, signals, due, .. } => {
                if let Some(encoder) = &self.axis_encoders[*axis] {
                    encoder.encode(setpoint, signals, *due, &mut self.buffer);
                }
            }
            other => self.run_encoder.encode(other, self.time_ns, &mut self.buffer),
        }
        self.mcap.write_to_known_channel(&header, &self.buffer)?;
        self.messages += 1;
        self.chunk_bytes += MESSAGE_OVERHEAD_BYTES + self.buffer.len() as u64;
        if self.chunk_bytes >= CHUNK_BYTES { self.close_chunk() } else { Ok(()) }
    }

    fn close_chunk(&mut self) -> McapResult<()> {
        self.chunk_bytes = 0;
        self.mcap.flush()
    }

    /// Writes the figures of the run and the index: the file is whole.
    fn finish(mut self, summary: BTreeMap<String, String>) -> Result<RecordingSummary, Diagnostic> {
        let finished = write_metadata(&mut self.mcap, SUMMARY_METADATA, summary).and_then(|()| self.mcap.finish());
        let mut target = self.mcap.into_inner().into_inner();
        let complete = finished.and_then(|_| Ok(target.complete()?));
        complete.map_err(|error| write_fault(&self.name, &error))?;
        Ok(RecordingSummary { bytes: target.bytes(), messages: self.messages })
    }

    /// The front end is gone without a word: keep what is there, but write no index, so that nobody takes the file for whole.
    fn abandon(mut self, fault: &OnceLock<Diagnostic>) -> Result<RecordingSummary, Diagnostic> {
        if fault.get().is_none() {
            // Nobody is left to be told of a failure.
            let _ = self.mcap.flush();
        }
        drop(self.mcap.into_inner());
        Err(fault.get().cloned().unwrap_or_else(|| {
            Diagnostic::error("R0003", format!("the recording {} was not finished", self.name))
                .help("`sollwert recover` makes a whole file of it")
        }))
    }
}

/// Attachments and metadata, on the disk before anything else.
fn write_prelude(mcap: &mut mcap::Writer<NoSeek<Target>>, setup: &RecordingSetup) -> McapResult<()> {
    for program in setup.programs {
        attach_program(mcap, program, 0)?;
    }
    mcap.attach(&Attachment {
        log_time: 0,
        create_time: 0,
        name: setup.machine_file_name.to_owned(),
        media_type: MACHINE_MEDIA_TYPE.to_owned(),
        data: Cow::Borrowed(setup.machine_text.as_bytes()),
    })?;
    for (name, metadata) in setup.metadata()? {
        write_metadata(mcap, name, metadata)?;
    }
    mcap.flush()
}

/// Stretch by stretch: a program may be larger than the memory.
fn attach_program(mcap: &mut mcap::Writer<NoSeek<Target>>, program: &OpenedProgram, time_ns: u64) -> McapResult<()> {
    let header = AttachmentHeader {
        log_time: time_ns,
        create_time: 0,
        name: program.name.to_string(),
        media_type: PROGRAM_MEDIA_TYPE.to_owned(),
    };
    mcap.start_attachment(program.bytes.length() as u64, header)?;
    let mut written = Ok(());
    program.bytes.pass(0, |bytes| {
        written = mcap.put_attachment_bytes(bytes);
        written.is_ok()
    })?;
    written?;
    mcap.finish_attachment()
}

fn write_metadata(
    mcap: &mut mcap::Writer<NoSeek<Target>>,
    name: &str,
    metadata: BTreeMap<String, String>,
) -> McapResult<()> {
    mcap.write_metadata(&Metadata { name: name.to_owned(), metadata })
}

/// Topics of a recording.
struct Channels {
    axes: PerAxis<Option<Channel>>,
    path: Channel,
    event: Channel,
    programmed: Option<Channel>,
    poses: [Option<Channel>; TOOL_TOPICS.len()],
}

/// Declares the topics, in the order of the machine's axes. They go into the first chunk, and again into the summary.
fn add_channels(mcap: &mut mcap::Writer<NoSeek<Target>>, setup: &RecordingSetup) -> McapResult<Channels> {
    let signals = setup.signals.on(setup.machine);
    let mut axes = PerAxis::splat(None);
    for id in setup.machine.axis_ids().filter(|id| signals.axis(*id)) {
        let axis = setup.machine.axis(id);
        let schema = match axis.kind {
            AxisKind::Linear => LINEAR_AXIS,
            AxisKind::Rotary => ROTARY_AXIS,
        };
        let fields: Vec<usize> = signals.fields(id).collect();
        let topic = format!("{AXIS_TOPIC_PREFIX}{}", axis.name);
        axes[id] = Some(add_channel(mcap, &topic, schema, &setup.axis_channel(axis, &fields))?);
    }
    let nothing = BTreeMap::new();
    let path = add_channel(mcap, PATH_TOPIC, PATH, &nothing)?;
    let event = add_channel(mcap, EVENT_TOPIC, EVENT, &nothing)?;
    let mut poses = [None; TOOL_TOPICS.len()];
    for (index, topic) in TOOL_TOPICS.into_iter().enumerate().filter(|(index, _)| signals.pose(*index)) {
        poses[index] = Some(add_channel(mcap, topic, POSE_IN_FRAME, &nothing)?);
    }
    let programmed = match setup.programmed {
        true => Some(add_channel(mcap, PROGRAMMED_TOPIC, PROGRAMMED, &nothing)?),
        false => None,
    };
    Ok(Channels { axes, path, event, programmed, poses })
}

fn add_channel(
    mcap: &mut mcap::Writer<NoSeek<Target>>,
    topic: &str,
    schema: SchemaText,
    metadata: &BTreeMap<String, String>,
) -> McapResult<Channel> {
    let schema_id = mcap.add_schema(schema.name, "protobuf", schema.descriptors)?;
    let id = mcap.add_channel(schema_id, topic, "protobuf", metadata)?;
    Ok(Channel { id, next_sequence: 0 })
}

/// A fault while writing, said with the name of the file.
pub(crate) fn write_fault(name: &str, error: &McapError) -> Diagnostic {
    let reason = match error {
        McapError::Io(error) => error.to_string(),
        other => other.to_string(),
    };
    Diagnostic::error("R0002", format!("the recording {name} cannot be written: {reason}"))
        .help("make room or choose another place; what was written before stays readable with `sollwert recover`")
}

/// A shared place for the first fault of the writer's thread.
pub(super) type Fault = Arc<OnceLock<Diagnostic>>;
