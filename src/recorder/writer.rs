//! The writer's thread: batches in, chunks of an MCAP file out.
//!
//! In: [`Order`]s in the order of the cycle. Out: encoded chunks for the thread that packs and writes them (`packing`), and the batches back for
//! another turn. A chunk ends where a batch says so (every simulated second, at an alarm) or at 1 MiB, never by the clock on the wall;
//! every finished chunk is pushed to the operating system at once. Knows neither paths nor the cycle. Only an [`Order::Finish`] makes
//! the file whole: a run that ends in any other way leaves a file without an index, which every reader refuses and `recover` rescues.

use super::batch::{Batch, Order, Record};
use super::encode::{AxisEncoder, Precision, RunEncoder};
use super::mcap_file::{AttachmentHead, Declarations, McapFile, RawChunk, RecordBytes, ZstdTuning};
use super::packing::{Packing, Piece, attach_program};
use super::schema::{
    AXIS_TOPIC_PREFIX, EVENT, EVENT_TOPIC, LINEAR_AXIS, PATH, PATH_TOPIC, POSE_IN_FRAME, PROGRAMMED, PROGRAMMED_TOPIC,
    ROTARY_AXIS, SPINDLE, SPINDLE_TOPIC, SchemaText, TOOL_TOPICS,
};
use super::setup::{Compression, MACHINE_MEDIA_TYPE, RecordingSetup};
use super::target::Target;
use crate::base::{AxisKind, Diagnostic, PerAxis, Tick, TimeBase};
use crossbeam_channel::{Receiver, Sender};
use mcap::records::op;
use mcap::{McapError, WriteOptions};
use std::collections::BTreeMap;
use std::io;
use std::sync::{Arc, OnceLock};

/// Uncompressed bytes after which a chunk ends.
const CHUNK_BYTES: usize = 1024 * 1024;
/// zstd: the fastest level of the regular ones.
const ZSTD_LEVEL: u32 = 1;
/// What a file says of its maker.
const LIBRARY: &str = concat!("sollwert ", env!("CARGO_PKG_VERSION"));

/// What a finished recording holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordingSummary {
    /// Size of the file.
    pub bytes: u64,
    /// Messages of all topics.
    pub messages: u64,
}

/// Options of files that are made of others (`recover`, imported traces). Compression on the calling thread and no seeking: the same bytes each time, and
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
        .library(LIBRARY)
}

/// A topic with its counter.
#[derive(Clone, Copy, Debug)]
struct Channel {
    id: u16,
    next_sequence: u32,
}

/// An open recording.
pub(super) struct RecordingWriter {
    packing: Packing,
    fault: Fault,
    name: String,
    time_base: TimeBase,
    axis_encoders: PerAxis<Option<AxisEncoder>>,
    topics: Topics,
    run_encoder: RunEncoder,
    /// The chunk at work.
    chunk: RawChunk,
    /// The tick that `time_ns` belongs to: most messages share their tick with the one before.
    tick: Tick,
    time_ns: u64,
}

impl RecordingWriter {
    /// Writes all that stands before the first message. A later fault is put into `fault`.
    pub(super) fn create(
        target: Target,
        name: String,
        setup: &RecordingSetup,
        fault: Fault,
    ) -> Result<Self, Diagnostic> {
        let packing = match setup.compression {
            Compression::Zstd => {
                Some(ZstdTuning { level: ZSTD_LEVEL as i32, whole_numbers: setup.mantissa_bits.is_none() })
            }
            Compression::None => None,
        };
        let (topics, declarations) = topics(setup);
        let mut chunk = RawChunk::default();
        chunk.declare(&declarations.schemas);
        chunk.declare(&declarations.channels);
        let prelude = McapFile::create(target, LIBRARY, packing).and_then(|mut file| {
            write_prelude(&mut file, setup)?;
            file.declare(declarations);
            Ok(file)
        });
        let file = prelude.map_err(|error| write_fault(&name, &error.into()))?;
        let precision = Precision::new(setup.mantissa_bits);
        let mut run_encoder = RunEncoder::new(setup.machine, precision, setup.signals.on(setup.machine).spindle().0);
        for program in setup.programs {
            run_encoder.add_program(program.id, &program.name);
        }
        let signals = setup.signals.on(setup.machine);
        let axis_encoders = PerAxis::from_fn(|id| {
            let axis = setup.machine.axes.get(id.index())?;
            Some(AxisEncoder::new(axis.kind, signals.fields(id), precision))
        });
        Ok(Self {
            packing: Packing::start(file, name.clone(), fault.clone())?,
            fault,
            name,
            time_base: setup.machine.cycle.time_base,
            axis_encoders,
            topics,
            run_encoder,
            chunk,
            tick: Tick(0),
            time_ns: 0,
        })
    }

    /// Works until the front end is done or gone.
    pub(super) fn run(
        mut self,
        orders: &Receiver<Order>,
        returned: &Sender<Batch>,
    ) -> Result<RecordingSummary, Diagnostic> {
        while let Ok(order) = orders.recv() {
            match order {
                Order::Write(mut batch) => {
                    // After a fault nothing is recorded.
                    if self.fault.get().is_none() {
                        self.write(&batch);
                    }
                    batch.records.clear();
                    batch.close_chunk = false;
                    // Nobody takes batches back while the recorder is being finished.
                    let _ = returned.try_send(batch);
                }
                Order::Finish(summary) => {
                    self.close_chunk();
                    self.packing.send(Piece::Finish(summary));
                    return self.packing.finish().ok_or_else(|| self.unfinished());
                }
            }
        }
        // The front end is gone without a word: keep what is there, but write no index, so that nobody takes the file for whole.
        self.close_chunk();
        let _ = self.packing.finish();
        Err(self.unfinished())
    }

    fn unfinished(&self) -> Diagnostic {
        self.fault.get().cloned().unwrap_or_else(|| {
            Diagnostic::error("R0003", format!("the recording {} was not finished", self.name))
                .help("`sollwert recover` makes a whole file of it")
        })
    }

    fn write(&mut self, batch: &Batch) {
        for record in &batch.records {
            self.write_record(record);
        }
        if batch.close_chunk {
            self.close_chunk();
        }
    }

    fn write_record(&mut self, record: &Record) {
        if record.tick() != self.tick {
            self.tick = record.tick();
            self.time_ns = self.time_base.time_ns(self.tick);
        }
        let Self { topics, run_encoder, axis_encoders, chunk, time_ns, .. } = self;
        let time_ns = *time_ns;
        let channel = match record {
            Record::Axis { axis, .. } => topics.axes[*axis].as_mut(),
            Record::Path { .. } => Some(&mut topics.path),
            Record::Event { .. } => Some(&mut topics.event),
            Record::Programmed { .. } => topics.programmed.as_mut(),
            Record::Spindle { .. } => topics.spindle.as_mut(),
            Record::Pose { which, .. } => topics.poses[which.index()].as_mut(),
            Record::Program { program, .. } => {
                run_encoder.add_program(program.id, &program.name);
                self.close_chunk();
                self.packing.send(Piece::Program { program: program.clone(), time_ns });
                return;
            }
        };
        let Some(channel) = channel else { return };
        let sequence = channel.next_sequence;
        channel.next_sequence = sequence.wrapping_add(1);
        chunk.message(channel.id, sequence, time_ns, |buffer| match record {
            Record::Axis { axis, setpoint, signals, due, .. } => {
                if let Some(encoder) = &axis_encoders[*axis] {
                    encoder.encode(setpoint, signals, *due, buffer);
                }
            }
            other => run_encoder.encode(other, time_ns, buffer),
        });
        if chunk.bytes() >= CHUNK_BYTES {
            self.close_chunk();
        }
    }

    fn close_chunk(&mut self) {
        if self.chunk.bytes() > 0 {
            self.packing.swap(&mut self.chunk);
        }
    }
}

/// Attachments and metadata, on the disk before anything else.
fn write_prelude(file: &mut McapFile, setup: &RecordingSetup) -> io::Result<()> {
    for program in setup.programs {
        attach_program(file, program, 0)?;
    }
    let text = setup.machine_text.as_bytes();
    let (name, bytes) = (setup.machine_file_name, text.len() as u64);
    let machine = AttachmentHead { time_ns: 0, name, media_type: MACHINE_MEDIA_TYPE, bytes };
    file.attach(&machine, |each| {
        each(text);
        Ok(())
    })?;
    for (name, metadata) in setup.metadata()? {
        file.write_metadata(name, &metadata)?;
    }
    file.flush()
}

/// Topics of a recording.
struct Topics {
    axes: PerAxis<Option<Channel>>,
    path: Channel,
    event: Channel,
    spindle: Option<Channel>,
    programmed: Option<Channel>,
    poses: [Option<Channel>; TOOL_TOPICS.len()],
}

/// Declares the topics, in the order of the machine's axes.
fn topics(setup: &RecordingSetup) -> (Topics, Declarations) {
    let mut declarations = Declarations::default();
    let mut schemas = Vec::new();
    let mut add = |topic: &str, schema: SchemaText, metadata: &BTreeMap<String, String>| {
        add_channel(&mut declarations, &mut schemas, topic, schema, metadata)
    };
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
        axes[id] = Some(add(&topic, schema, &setup.axis_channel(axis, &fields)));
    }
    let nothing = BTreeMap::new();
    let path = add(PATH_TOPIC, PATH, &nothing);
    let event = add(EVENT_TOPIC, EVENT, &nothing);
    let spindle = (signals.spindle().0 != 0 && !setup.programs.is_empty())
        .then(|| add(SPINDLE_TOPIC, SPINDLE, &RecordingSetup::spindle_channel(signals.spindle().0)));
    let mut poses = [None; TOOL_TOPICS.len()];
    for (index, topic) in TOOL_TOPICS.into_iter().enumerate().filter(|(index, _)| signals.pose(*index)) {
        poses[index] = Some(add(topic, POSE_IN_FRAME, &nothing));
    }
    let programmed = setup.programmed.then(|| add(PROGRAMMED_TOPIC, PROGRAMMED, &nothing));
    (Topics { axes, path, event, spindle, programmed, poses }, declarations)
}

/// Numbers of schemas and channels count from 1; a schema is declared once.
fn add_channel(
    declarations: &mut Declarations,
    schemas: &mut Vec<&'static str>,
    topic: &str,
    schema: SchemaText,
    metadata: &BTreeMap<String, String>,
) -> Channel {
    let place = schemas.iter().position(|name| *name == schema.name).unwrap_or_else(|| {
        schemas.push(schema.name);
        declarations.schema_count += 1;
        RecordBytes::begin(&mut declarations.schemas, op::SCHEMA)
            .u16(declarations.schema_count)
            .text(schema.name)
            .text("protobuf")
            .sized(schema.descriptors)
            .end();
        schemas.len() - 1
    });
    declarations.channel_count += 1;
    let id = declarations.channel_count as u16;
    RecordBytes::begin(&mut declarations.channels, op::CHANNEL)
        .u16(id)
        .u16(place as u16 + 1)
        .text(topic)
        .text("protobuf")
        .map(metadata)
        .end();
    Channel { id, next_sequence: 0 }
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
