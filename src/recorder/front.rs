//! The recorder as the cycle sees it: a few copies a tick, no allocation, no lock, no system call.
//!
//! In: the wires of every tick, in order. Out: batches to the writer's thread. When the disk is slower than the run, the cycle
//! waits for a free batch: memory stays bounded. Does not convert units, encode or write.

use super::batch::{BATCH_RECORDS, BATCHES, Batch, Order, Record};
use super::event::EventRecord;
use super::schema::ToolPose;
use super::setup::{RecordingSetup, SUMMARY_METADATA};
use super::target::Target;
use super::writer::{Fault, RecordingSummary, RecordingWriter, write_fault};
use crate::base::units::NS_PER_S;
use crate::base::{AXES_MAX, AxisId, Diagnostic, PerAxis, Tick, TimeBase};
use crate::drive::{AxisSignals, SpindleSignals};
use crate::interpolator::{AxisSetpoint, PathSample};
use crate::interpreter::Event;
use crate::program::{BlockRef, OpenedProgram, ProgramId};
use crossbeam_channel::{Receiver, Sender, bounded};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;

/// Takes down every signal.
///
/// Messages stand in the file in the order of the calls: call in order of ticks. A recording that is dropped without
/// [`Recorder::finish`] is left unfinished, as after a killed run.
pub struct Recorder {
    /// `None` once the last order is given.
    orders: Option<Sender<Order>>,
    returned: Receiver<Batch>,
    thread: Option<JoinHandle<Result<RecordingSummary, Diagnostic>>>,
    fault: Fault,
    name: String,
    batch: Batch,
    time_base: TimeBase,
    /// First tick of the next simulated second: the chunk ends before it.
    border: Tick,
    recorded_axes: PerAxis<bool>,
    attached: Vec<ProgramId>,
    axis_decimators: PerAxis<AxisDecimator>,
    path_decimator: Decimator,
    records_spindle: bool,
    spindle_decimator: Decimator,
}

impl Recorder {
    /// Records to a file, in place: what a killed run leaves is found under this name.
    pub fn to_file(path: &Path, setup: &RecordingSetup) -> Result<Self, Diagnostic> {
        let name = path.display().to_string();
        let target = Target::file(path).map_err(|error| write_fault(&name, &error.into()))?;
        Self::start(target, name, setup)
    }

    /// Records to any writer.
    pub fn to_writer(writer: impl Write + Send + 'static, setup: &RecordingSetup) -> Result<Self, Diagnostic> {
        Self::start(Target::writer(writer), "stream".to_owned(), setup)
    }

    fn start(target: Target, name: String, setup: &RecordingSetup) -> Result<Self, Diagnostic> {
        if let Some(bits) = setup.mantissa_bits.filter(|bits| !(1..=52).contains(bits)) {
            let message = format!("--record-precision {bits} is out of range: an f64 has 52 mantissa bits");
            return Err(Diagnostic::error("R0021", message).help("give 1 to 52; 36 keep 7e-9 mm in 1000 mm"));
        }
        let fault: Fault = Arc::new(OnceLock::new());
        let writer = RecordingWriter::create(target, name.clone(), setup, fault.clone())?;
        let (orders, orders_out) = bounded(BATCHES);
        let (returned_in, returned) = bounded(BATCHES);
        for _ in 1..BATCHES {
            // Never full: it holds all batches there are.
            let _ = returned_in.try_send(Batch::empty());
        }
        let thread = std::thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || writer.run(&orders_out, &returned_in))
            .map_err(|error| Diagnostic::error("R0002", format!("the recorder's thread does not start: {error}")))?;
        let signals = setup.signals.on(setup.machine);
        let time_base = setup.machine.cycle.time_base;
        let every = setup.decimation.get();
        Ok(Self {
            orders: Some(orders),
            returned,
            thread: Some(thread),
            fault,
            name,
            batch: Batch::empty(),
            time_base,
            border: second_after(&time_base, Tick(0)),
            recorded_axes: PerAxis::from_fn(|axis| axis.index() < setup.machine.axes.len() && signals.axis(axis)),
            attached: setup.programs.iter().map(|program| program.id).collect(),
            axis_decimators: PerAxis::from_fn(|axis| AxisDecimator::new(&signals.groups(axis), every)),
            path_decimator: Decimator::new(every),
            records_spindle: signals.spindle().0 != 0,
            spindle_decimator: Decimator::new(every.saturating_mul(signals.spindle().1)),
        })
    }

    /// The signals of one axis.
    pub fn axis(&mut self, tick: Tick, axis: AxisId, setpoint: &AxisSetpoint, signals: &AxisSignals) {
        if !self.recorded_axes[axis] {
            return;
        }
        let due = self.axis_decimators[axis].due(tick, setpoint, signals);
        if due != 0 {
            self.push(Record::Axis { tick, axis, setpoint: *setpoint, signals: *signals, due });
        }
    }

    /// The path at a set-point; the contour error where drives are simulated.
    pub fn path(&mut self, tick: Tick, sample: &PathSample, contour_error_mm: Option<f64>) {
        let record = Record::Path { tick, sample: *sample, contour_error_mm };
        if let Some(record) = self.path_decimator.pass(record) {
            self.push(record);
        }
    }

    /// The master spindle at a set-point; recorded where the machine file has one and it is chosen.
    pub fn spindle(&mut self, tick: Tick, signals: &SpindleSignals) {
        if !self.records_spindle {
            return;
        }
        if let Some(record) = self.spindle_decimator.pass(Record::Spindle { tick, signals: *signals }) {
            self.push(record);
        }
    }

    /// Where the tool is, in the frame of the part.
    pub fn pose(&mut self, tick: Tick, which: ToolPose, position_mm: [f64; 3], quaternion_xyzw: [f64; 4]) {
        self.push(Record::Pose { tick, which, position_mm, quaternion_xyzw });
    }

    /// Something that happens. After an alarm everything is pushed to the disk.
    pub fn event(&mut self, tick: Tick, block: Option<BlockRef>, event: EventRecord) {
        let alarm = matches!(event, EventRecord::Alarm { .. });
        self.push(Record::Event { tick, block, event });
        if alarm {
            self.send(true);
        }
    }

    /// An event of the interpreter; a program that it opens is attached.
    pub fn program_event(&mut self, tick: Tick, block: BlockRef, event: &Event) {
        if let Event::ProgramOpened(program) = event {
            self.attach_program(tick, program);
        }
        match event {
            Event::Programmed(block) => self.push(Record::Programmed { tick, block: block.clone() }),
            Event::Position(_)
            | Event::Synchronised(_)
            | Event::CancelSynchronised(_)
            | Event::SpindleWait
            | Event::SpindleAcceleration { .. } => {}
            Event::SpindlePosition(positioning) if positioning.text.is_empty() => {}
            _ => self.event(tick, Some(block), event.into()),
        }
    }

    /// Attaches a program that was found only at run time. A program that is attached already is not attached again.
    pub fn attach_program(&mut self, tick: Tick, program: &OpenedProgram) {
        if !self.attached.contains(&program.id) {
            self.attached.push(program.id);
            self.push(Record::Program { tick, program: program.clone() });
        }
    }

    /// The first fault of the writer, such as a full disk: nothing is recorded after it. Costs one atomic read.
    pub fn check(&self) -> Result<(), Diagnostic> {
        self.fault.get().map_or(Ok(()), |fault| Err(fault.clone()))
    }

    /// Writes the figures of the run (the document of `run --json`) and the index, and waits for the disk.
    pub fn finish(mut self, summary_json: &str) -> Result<RecordingSummary, Diagnostic> {
        let axes = AxisId::first(AXES_MAX);
        let mut last: Vec<Record> = axes.filter_map(|axis| self.axis_decimators[axis].rest(axis)).collect();
        last.extend(self.path_decimator.rest());
        last.extend(self.spindle_decimator.rest());
        last.sort_by_key(Record::tick);
        for record in last {
            self.push(record);
        }
        self.send(false);
        if let Some(orders) = self.orders.take() {
            // If the thread is gone, joining it says why.
            let _ = orders.send(Order::Finish(summary_metadata(summary_json)));
        }
        self.join()
    }

    fn join(&mut self) -> Result<RecordingSummary, Diagnostic> {
        let joined = self.thread.take().and_then(|thread| thread.join().ok());
        joined.unwrap_or_else(|| {
            Err(Diagnostic::error("R0002", format!("the recorder's thread of {} broke down", self.name))
                .help("please report this; `sollwert recover` rescues what was written"))
        })
    }

    fn push(&mut self, record: Record) {
        if record.tick() >= self.border {
            self.send(true);
            self.border = second_after(&self.time_base, record.tick());
        }
        self.batch.records.push(record);
        if self.batch.records.len() >= BATCH_RECORDS {
            self.send(false);
        }
    }

    /// Hands the batch over and takes a free one, waiting for it if the writer is behind.
    fn send(&mut self, close_chunk: bool) {
        if self.batch.records.is_empty() && !close_chunk {
            return;
        }
        let Ok(mut batch) = self.returned.recv() else {
            // The thread is gone; `finish` says why.
            self.batch.records.clear();
            return;
        };
        std::mem::swap(&mut batch, &mut self.batch);
        batch.close_chunk = close_chunk;
        if let Some(orders) = &self.orders {
            let _ = orders.send(Order::Write(batch));
        }
    }
}

impl Drop for Recorder {
    /// A run that ends without `finish` (an error, a panic elsewhere) keeps all that it recorded, without an index.
    fn drop(&mut self) {
        if self.orders.is_some() {
            self.send(true);
            self.orders = None;
            // The file is unfinished, which is what this says; nobody is left to hear more.
            let _ = self.join();
        }
    }
}

/// Lets every n-th record pass, beginning with the first, and keeps the last one.
#[derive(Clone, Debug)]
struct Decimator {
    every: u32,
    waiting: u32,
    last: Option<Record>,
}

impl Decimator {
    fn new(every: u32) -> Self {
        Self { every, waiting: 0, last: None }
    }

    fn pass(&mut self, record: Record) -> Option<Record> {
        if self.waiting == 0 {
            self.waiting = self.every - 1;
            self.last = None;
            return Some(record);
        }
        self.waiting -= 1;
        self.last = Some(record);
        None
    }

    /// The last record, if it did not pass: an end posture is never lost.
    fn rest(&mut self) -> Option<Record> {
        self.last.take()
    }
}

/// Says which fields of an axis are due at a sample, and keeps the last values of those that were not.
#[derive(Clone, Debug)]
struct AxisDecimator {
    /// Every so many samples these fields.
    groups: Vec<(u64, u32)>,
    samples: u64,
    /// The last sample, with the fields of it that were not due.
    last: Option<(Tick, AxisSetpoint, AxisSignals, u32)>,
}

impl AxisDecimator {
    fn new(groups: &[(u32, u32)], decimation: u32) -> Self {
        let times = |every: u32| u64::from(every) * u64::from(decimation);
        Self { groups: groups.iter().map(|(every, fields)| (times(*every), *fields)).collect(), samples: 0, last: None }
    }

    fn due(&mut self, tick: Tick, setpoint: &AxisSetpoint, signals: &AxisSignals) -> u32 {
        let (mut due, mut left) = (0, 0);
        for (every, fields) in &self.groups {
            let place = if self.samples.is_multiple_of(*every) { &mut due } else { &mut left };
            *place |= fields;
        }
        self.samples += 1;
        self.last = (left != 0).then_some((tick, *setpoint, *signals, left));
        due
    }

    /// What is left of the last sample: an end posture is never lost.
    fn rest(&mut self, axis: AxisId) -> Option<Record> {
        let (tick, setpoint, signals, due) = self.last.take()?;
        Some(Record::Axis { tick, axis, setpoint, signals, due })
    }
}

/// First tick of the simulated second after the one that `tick` lies in.
fn second_after(time_base: &TimeBase, tick: Tick) -> Tick {
    let second_ns = NS_PER_S as u64;
    let border_ns = (time_base.time_ns(tick) / second_ns + 1).saturating_mul(second_ns);
    // The quotient is right to a tick or two; the exact clock decides.
    let mut border = (border_ns as f64 / NS_PER_S / time_base.tick_period_s()) as u64;
    while border > 0 && time_base.time_ns(Tick(border - 1)) >= border_ns {
        border -= 1;
    }
    while time_base.time_ns(Tick(border)) < border_ns {
        border += 1;
    }
    Tick(border)
}

/// The document key by key, every value as JSON. The key `recording` and the folders before file names are left out: a recording
/// knows no path.
fn summary_metadata(summary_json: &str) -> BTreeMap<String, String> {
    let Ok(serde_json::Value::Object(document)) = serde_json::from_str(summary_json) else {
        return BTreeMap::from([(SUMMARY_METADATA.to_owned(), summary_json.to_owned())]);
    };
    let mut figures = BTreeMap::new();
    for (key, value) in document {
        let value = match (key.as_str(), value) {
            ("recording", _) => continue,
            ("program", serde_json::Value::String(name)) => without_folders(&name).into(),
            ("machine", serde_json::Value::String(name)) if name.ends_with(".toml") => without_folders(&name).into(),
            (_, value) => value,
        };
        figures.insert(key, value.to_string());
    }
    figures
}

fn without_folders(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}
