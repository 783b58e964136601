//! A machine, a run with signals in closed form, and ways to look into the bytes of a recording that do not pass through our
//! own reader.

#[path = "../test_machine/mod.rs"]
mod test_machine;

use sollwert::base::{AxisId, AxisKind, Tick};
use sollwert::drive::AxisSignals;
use sollwert::feed::{Limit, LimitKind};
use sollwert::interpolator::{AxisSetpoint, PathSample};
use sollwert::machine::Machine;
use sollwert::program::{BlockRef, OpenedProgram, ProgramId};
use sollwert::recorder::{EventRecord, Recorder, RecordingSetup, ToolPose};
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// Set-points every 2 ms, ticks of 0.25 ms.
pub const TICKS_PER_SETPOINT: u64 = 8;
/// Ticks of a position cycle of 1 ms.
pub const POSITION_TICKS: u64 = 4;
/// Ticks of a simulated second.
pub const TICKS_PER_S: u64 = 4000;
/// A machine file; the recorder does not read it.
pub const MACHINE_TEXT: &str = "format = 1\nname = \"Test machine, ä\"\n";
/// Figures of a run; `recording` must not get into the file.
pub const SUMMARY: &str = r#"{"format": 1, "program": "folder_of_someone/main.mpf", "cycle_time_s": 0.1, "limits": {"feed": 0.25, "X.jerk": 0.75}, "recording": "folder_of_someone/out.mcap"}"#;

/// Linear X with a drive, linear Y without one, rotary C with a drive.
pub fn machine() -> Machine {
    let mut sets = vec!["cycle.f_s=0.25".to_owned(), "axes.Z.index=6".to_owned(), "axes.Z.machine_axis=AX6".to_owned()];
    for axis in ["X", "Y", "Z"] {
        sets.extend(["speed", "current"].map(|cycle| format!("axes.{axis}.drive.{cycle}_cycle_us=250")));
    }
    let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
    let mut machine = test_machine::shipped("spinner_mvc850", &sets);
    machine.axes[1].drive = None;
    // A recording without a spindle; `choice` has one.
    machine.spindle = None;
    (machine.axes[2].name, machine.axes[2].kind) = ("C".to_owned(), AxisKind::Rotary);
    machine
}

pub fn programs() -> Vec<OpenedProgram> {
    vec![program(0, "main.mpf", b"N10 G1 X10 F1000\nN20 SUB\nN30 M30\n")]
}

pub fn program(id: u16, name: &str, bytes: &[u8]) -> OpenedProgram {
    OpenedProgram { id: ProgramId(id), name: Arc::from(name), bytes: bytes.into() }
}

/// Value of signal `number` of an axis at a tick: all different, irregular in their bits, one in seven exactly zero.
pub fn signal(tick: Tick, axis: AxisId, number: u64) -> f64 {
    if (tick.0 / POSITION_TICKS + number).is_multiple_of(7) {
        return 0.0;
    }
    let phase = tick.0 as f64 * 1e-3 + number as f64 * 0.7 + axis.index() as f64;
    (number as f64 - 8.5) * phase.sin()
}

pub fn setpoint(tick: Tick, axis: AxisId) -> AxisSetpoint {
    AxisSetpoint {
        position_lu: signal(tick, axis, 0),
        velocity_lu_s: signal(tick, axis, 6),
        acceleration_lu_s2: signal(tick, axis, 7),
        jerk_lu_s3: signal(tick, axis, 8),
    }
}

/// Signal n is field n of the message, 0-based.
pub fn signals(tick: Tick, axis: AxisId) -> AxisSignals {
    let s = |number| signal(tick, axis, number);
    AxisSignals {
        position_setpoint_lu: s(0),
        position_reference_lu: s(1),
        position_actual_lu: s(2),
        position_measured_lu: s(3),
        control_deviation_lu: s(4),
        following_error_lu: s(5),
        velocity_command_lu_s: s(9),
        velocity_feedforward_lu_s: s(10),
        velocity_actual_lu_s: s(11),
        motor_speed_reference_rad_s: s(12),
        motor_speed_rad_s: s(13),
        torque_reference_n_m: s(14),
        torque_feedforward_n_m: s(15),
        friction_torque_n_m: s(16),
        gravity_torque_n_m: s(17),
        current_reference_a: s(18),
        current_a: s(19),
        current_mean_a: s(20),
        voltage_v: s(21),
        flags: (tick.0 / POSITION_TICKS % 16) as u32,
        contour_deviation_lu: s(23),
        monitoring: (tick.0 / POSITION_TICKS % 32) as u32,
    }
}

pub fn path_sample(tick: Tick) -> PathSample {
    let k = tick.0 / TICKS_PER_SETPOINT;
    let block = BlockRef { program: ProgramId(0), line: (k % 3 + 1) as u32, number: k / 100 + 1 };
    let rapid = k.is_multiple_of(5);
    PathSample {
        block,
        path_length_mm: k as f64 * 0.1,
        feed_lu_s: 50.0,
        programmed_feed_lu_s: (!rapid).then_some(60.0),
        override_ratio: 1.0 + (k % 3) as f64 / 4.0,
        acceleration_lu_s2: 1.0 / 3.0,
        jerk_lu_s3: -2.0,
        limit: Limit { kind: LimitKind::Jerk, axis: k.is_multiple_of(2).then(|| AxisId::new(2)) },
        buffered_blocks: (k % 9) as u32,
        rotary_only: k % 4 == 3,
    }
}

/// The calls of a run of so many ticks (the start included), as the kernel would make them. The slow axis C has every second
/// position cycle.
pub fn record_run(recorder: &mut Recorder, machine: &Machine, ticks: u64) {
    for tick in (0..=ticks).step_by(POSITION_TICKS as usize).map(Tick) {
        record_tick(recorder, machine, tick);
    }
}

pub fn record_tick(recorder: &mut Recorder, machine: &Machine, tick: Tick) {
    if tick.0.is_multiple_of(TICKS_PER_SETPOINT) {
        let sample = path_sample(tick);
        if tick.0.is_multiple_of(100 * TICKS_PER_SETPOINT) {
            recorder.event(tick, Some(sample.block), EventRecord::BlockStart);
        }
        recorder.path(tick, &sample, Some(0.001));
    }
    for axis in machine.axis_ids() {
        if axis.index() < 2 || tick.0.is_multiple_of(2 * POSITION_TICKS) {
            recorder.axis(tick, axis, &setpoint(tick, axis), &signals(tick, axis));
        }
    }
    if tick.0.is_multiple_of(TICKS_PER_S / 100) {
        let along_mm = tick.0 as f64;
        recorder.pose(tick, ToolPose::Setpoint, [along_mm, 0.0, -1.0], [0.0, 0.0, 0.0, 1.0]);
        recorder.pose(tick, ToolPose::Actual, [along_mm + 0.5, 0.0, -1.0], [0.0, 0.0, 0.0, 1.0]);
    }
}

/// Bytes of a finished recording of so many ticks.
pub fn recorded(setup: &RecordingSetup, ticks: u64) -> Vec<u8> {
    let sink = Sink::default();
    let mut recorder = Recorder::to_writer(sink.clone(), setup).unwrap();
    record_run(&mut recorder, setup.machine, ticks);
    recorder.finish(SUMMARY).unwrap();
    sink.bytes()
}

/// A place in memory that the test can look at while the recorder writes.
#[derive(Clone, Default)]
pub struct Sink {
    pub bytes: Arc<Mutex<Vec<u8>>>,
    /// Bytes that fit; then the disk is full.
    pub room: Option<usize>,
    /// Waits so long in every call.
    pub delay: std::time::Duration,
}

impl Sink {
    pub fn bytes(&self) -> Vec<u8> {
        self.bytes.lock().unwrap().clone()
    }
}

impl Write for Sink {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        std::thread::sleep(self.delay);
        let mut bytes = self.bytes.lock().unwrap();
        let room = self.room.map_or(buffer.len(), |room| room.saturating_sub(bytes.len()).min(buffer.len()));
        if room == 0 && !buffer.is_empty() {
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        bytes.extend_from_slice(&buffer[..room]);
        Ok(room)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A file of this test run.
pub fn temporary(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("recorder");
    std::fs::create_dir_all(&folder).unwrap();
    folder.join(name)
}

/// Writes a file of this test run.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = temporary(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// A message as the mcap crate reads it.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    pub topic: String,
    pub sequence: u32,
    pub time_ns: u64,
    pub data: Vec<u8>,
}

/// All messages, by the mcap crate and not by our reader.
pub fn seen(bytes: &[u8]) -> Vec<Seen> {
    let stream = mcap::MessageStream::new(bytes).unwrap();
    stream
        .map(|message| {
            let message = message.unwrap();
            assert_eq!(message.log_time, message.publish_time);
            Seen {
                topic: message.channel.topic.clone(),
                sequence: message.sequence,
                time_ns: message.log_time,
                data: message.data.into_owned(),
            }
        })
        .collect()
}

/// Opcode, first byte and end of every top-level record.
pub fn frames(bytes: &[u8]) -> Vec<(u8, usize, usize)> {
    let mut frames = Vec::new();
    let mut at = mcap::MAGIC.len();
    while at + mcap::MAGIC.len() < bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        frames.push((bytes[at], at, at + 9 + length));
        at += 9 + length;
    }
    frames
}
