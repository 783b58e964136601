//! From internal units to messages: rad -> deg, s -> min, mm -> m, and the bytes of protobuf.
//!
//! In: the wires of a tick. Out: encoded messages, appended to a buffer that is used again. Axis messages are encoded from the
//! table of `schema`; a test holds them against the generated types. Does not know files.

use super::batch::Record;
use super::event::EventRecord;
use super::schema::proto::foxglove::{Pose, PoseInFrame, Quaternion, Vector3};
use super::schema::proto::google::protobuf::Timestamp;
use super::schema::proto::sollwert::{Event, Path, Programmed, Spindle};
use super::schema::{AXIS_FIELD_COUNT, AXIS_FIELDS, FLAGS_FIELD, FieldUnit, MONITORING_FIELD, POSE_FRAME};
use crate::base::units::{MM_PER_M, NS_PER_S, deg_from_rad, mm_min_from_mm_s, rot_from_rad, rpm_from_rad_s};
use crate::base::{AxisKind, AxisVector, PerAxis};
use crate::drive::{AxisSignals, SpindleSignals};
use crate::interpolator::{AxisSetpoint, PathSample};
use crate::interpreter::ProgrammedBlock;
use crate::machine::Machine;
use crate::program::{BlockRef, ProgramId};
use prost::Message;
use std::sync::Arc;

/// Bits of the mantissa that an `f64` stores.
const MANTISSA_BITS: u8 = 52;

/// How many mantissa bits are kept: fewer bits compress better.
#[derive(Clone, Copy, Debug)]
pub(super) struct Precision {
    dropped_bits: u8,
}

impl Precision {
    /// `None` keeps every bit.
    pub(super) fn new(mantissa_bits: Option<u8>) -> Self {
        Self { dropped_bits: mantissa_bits.map_or(0, |bits| MANTISSA_BITS.saturating_sub(bits)) }
    }

    /// The nearest number with so many bits, ties to even. A number that would round to infinity is kept.
    pub(super) fn round(self, value: f64) -> f64 {
        if self.dropped_bits == 0 || !value.is_finite() {
            return value;
        }
        let bits = value.to_bits();
        let unit = 1_u64 << self.dropped_bits;
        let odd = (bits >> self.dropped_bits) & 1;
        // A carry runs from the mantissa into the exponent, which is what rounding up to a power of two means.
        let rounded = f64::from_bits((bits + (unit / 2 - 1) + odd) & !(unit - 1));
        if rounded.is_finite() { rounded } else { value }
    }
}

/// Bytes of a key at most: numbers of fields of this message stay below 2^11.
const KEY_BYTES_MAX: usize = 2;

/// Bytes of a field at most: its key and a double, or a key and a 32-bit number.
const FIELD_BYTES_MAX: usize = KEY_BYTES_MAX + 8;

/// A field of one axis as it is written.
#[derive(Clone, Copy, Debug)]
struct WrittenField {
    /// Place in [`AXIS_FIELDS`].
    index: usize,
    key: [u8; KEY_BYTES_MAX],
    key_bytes: usize,
    form: Form,
}

/// What stands behind the key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// Eight bytes.
    Double,
    /// Eight bytes, and an angle: rad inside.
    Angle,
    /// A number of bits.
    Bits,
}

impl WrittenField {
    fn new(index: usize, kind: AxisKind) -> Self {
        let form = match (index, AXIS_FIELDS[index].unit, kind) {
            (FLAGS_FIELD | MONITORING_FIELD, ..) => Form::Bits,
            (_, FieldUnit::AxisLength, AxisKind::Rotary) => Form::Angle,
            _ => Form::Double,
        };
        // Wire type 1 has eight bytes, wire type 0 is a number of any length.
        let key = (index as u32 + 1) << 3 | u32::from(form != Form::Bits);
        let (low, high) = ((key & 0x7f) as u8, (key >> 7) as u8);
        let (key, key_bytes) = if high == 0 { ([low, 0], 1) } else { ([low | 0x80, high], 2) };
        Self { index, key, key_bytes, form }
    }
}

/// Encodes messages of one axis.
#[derive(Clone, Debug)]
pub(super) struct AxisEncoder {
    fields: Vec<WrittenField>,
    precision: Precision,
}

impl AxisEncoder {
    /// `fields`: places in [`AXIS_FIELDS`].
    pub(super) fn new(kind: AxisKind, fields: impl Iterator<Item = usize>, precision: Precision) -> Self {
        Self { fields: fields.map(|index| WrittenField::new(index, kind)).collect(), precision }
    }

    /// Appends the chosen fields whose bit is set in `due`. Put together in one place and appended once: this is most of what a recording is made of.
    pub(super) fn encode(&self, setpoint: &AxisSetpoint, signals: &AxisSignals, due: u32, buffer: &mut Vec<u8>) {
        let mut bytes = [0_u8; AXIS_FIELD_COUNT * FIELD_BYTES_MAX];
        let mut end = 0;
        for field in self.fields.iter().filter(|field| due & (1 << field.index) != 0) {
            bytes[end..end + KEY_BYTES_MAX].copy_from_slice(&field.key);
            end += field.key_bytes;
            let inside = || (AXIS_FIELDS[field.index].value)(setpoint, signals);
            let value = match field.form {
                Form::Double => inside(),
                Form::Angle => deg_from_rad(inside()),
                Form::Bits => {
                    let bits = if field.index == FLAGS_FIELD { signals.flags } else { signals.monitoring };
                    end = push_varint(bits, &mut bytes, end);
                    continue;
                }
            };
            bytes[end..end + 8].copy_from_slice(&self.precision.round(value).to_le_bytes());
            end += 8;
        }
        buffer.extend_from_slice(&bytes[..end]);
    }
}

/// Seven bits a byte, the lowest first. Returns where the next byte goes.
fn push_varint(mut value: u32, bytes: &mut [u8], mut end: usize) -> usize {
    while value >= 0x80 {
        bytes[end] = value as u8 | 0x80;
        (value, end) = (value >> 7, end + 1);
    }
    bytes[end] = value as u8;
    end + 1
}

/// Encodes everything else; keeps its messages, so that their texts are allocated once.
#[derive(Clone, Debug)]
pub(super) struct RunEncoder {
    axis_names: PerAxis<Arc<str>>,
    /// In the machine's order.
    axis_kinds: Vec<AxisKind>,
    programs: Vec<(ProgramId, Arc<str>)>,
    precision: Precision,
    /// Bits of `SPINDLE_FIELDS`.
    spindle_fields: u32,
    path: Path,
    pose: PoseInFrame,
}

impl RunEncoder {
    pub(super) fn new(machine: &Machine, precision: Precision, spindle_fields: u32) -> Self {
        let name = |i: usize| machine.axes.get(i).map_or("", |axis| axis.name.as_str());
        let pose = PoseInFrame { frame_id: Some(POSE_FRAME.to_owned()), ..PoseInFrame::default() };
        Self {
            axis_names: PerAxis::from_fn(|axis| Arc::from(name(axis.index()))),
            axis_kinds: machine.axes.iter().map(|axis| axis.kind).collect(),
            programs: Vec::new(),
            precision,
            spindle_fields,
            path: Path::default(),
            pose,
        }
    }

    /// From now on blocks of this program are told by its name.
    pub(super) fn add_program(&mut self, id: ProgramId, name: &Arc<str>) {
        self.programs.push((id, name.clone()));
    }

    /// Appends the message of any record but those of axes and programs.
    pub(super) fn encode(&mut self, record: &Record, time_ns: u64, buffer: &mut Vec<u8>) {
        match record {
            Record::Path { sample, contour_error_mm, .. } => self.encode_path(sample, *contour_error_mm, buffer),
            Record::Pose { position_mm, quaternion_xyzw, .. } => {
                self.encode_pose(time_ns, *position_mm, *quaternion_xyzw, buffer);
            }
            Record::Spindle { signals, .. } => self.encode_spindle(signals, buffer),
            Record::Event { block, event, .. } => {
                let message = self.event_message(*block, event);
                message.encode_raw(buffer);
            }
            Record::Programmed { block, .. } => self.programmed_message(block).encode_raw(buffer),
            Record::Axis { .. } | Record::Program { .. } => {}
        }
    }

    fn program_name(&self, id: ProgramId) -> Option<&Arc<str>> {
        self.programs.iter().find(|(known, _)| *known == id).map(|(_, name)| name)
    }

    fn encode_path(&mut self, sample: &PathSample, contour_error_mm: Option<f64>, buffer: &mut Vec<u8>) {
        let round = |value: f64| self.precision.round(value);
        // Only rotary axes move: deg under the names of mm, as docs/recording.md says.
        let length = |value_lu: f64| if sample.rotary_only { deg_from_rad(value_lu) } else { value_lu };
        let feed = |value_lu_s: f64| round(mm_min_from_mm_s(length(value_lu_s)));
        let mut path = std::mem::take(&mut self.path);
        set_text(&mut path.program, self.program_name(sample.block.program).map(|name| &**name));
        set_text(&mut path.limit_axis, sample.limit.axis.map(|axis| &*self.axis_names[axis]));
        set_text(&mut path.limit_kind, Some(sample.limit.kind.name()));
        path.block = Some(sample.block.number);
        path.line = Some(sample.block.line);
        path.s_mm = Some(round(sample.path_length_mm));
        path.feed_mm_min = Some(feed(sample.feed_lu_s));
        path.programmed_feed_mm_min = sample.programmed_feed_lu_s.map(feed);
        path.acceleration_mm_s2 = Some(round(length(sample.acceleration_lu_s2)));
        path.jerk_mm_s3 = Some(round(length(sample.jerk_lu_s3)));
        path.override_ratio = Some(round(sample.override_ratio));
        path.buffered_blocks = Some(sample.buffered_blocks);
        path.contour_error_mm = contour_error_mm.map(round);
        path.rotary_only = Some(sample.rotary_only);
        path.encode_raw(buffer);
        self.path = path;
    }

    fn encode_spindle(&self, signals: &SpindleSignals, buffer: &mut Vec<u8>) {
        let chosen =
            |field: u32, value: f64| (self.spindle_fields & (1 << field) != 0).then(|| self.precision.round(value));
        let SpindleSignals { setpoint, angle_actual_rad, speed_actual_rad_s } = signals;
        // In the order of `SPINDLE_FIELDS`.
        let message = Spindle {
            angle_setpoint_deg: chosen(0, deg_from_rad(setpoint.angle_rad)),
            angle_actual_deg: chosen(1, deg_from_rad(*angle_actual_rad)),
            speed_setpoint_rpm: chosen(2, rpm_from_rad_s(setpoint.speed_rad_s)),
            speed_actual_rpm: chosen(3, rpm_from_rad_s(*speed_actual_rad_s)),
            acceleration_setpoint_rot_s2: chosen(4, rot_from_rad(setpoint.acceleration_rad_s2)),
        };
        message.encode_raw(buffer);
    }

    fn encode_pose(&mut self, time_ns: u64, position_mm: [f64; 3], quaternion_xyzw: [f64; 4], buffer: &mut Vec<u8>) {
        let second_ns = NS_PER_S as u64;
        let [x, y, z] = position_mm.map(|value_mm| Some(self.precision.round(value_mm / MM_PER_M)));
        let [qx, qy, qz, qw] = quaternion_xyzw.map(|value| Some(self.precision.round(value)));
        // Both casts fit: simulated seconds stay far below 2^63, nanoseconds of a second below 2^30.
        self.pose.timestamp =
            Some(Timestamp { seconds: (time_ns / second_ns) as i64, nanos: (time_ns % second_ns) as i32 });
        self.pose.pose = Some(Pose {
            position: Some(Vector3 { x, y, z }),
            orientation: Some(Quaternion { x: qx, y: qy, z: qz, w: qw }),
        });
        self.pose.encode_raw(buffer);
    }

    fn programmed_message(&self, block: &ProgrammedBlock) -> Programmed {
        let values = |vector: &AxisVector| -> Vec<f64> {
            let axes = self.axis_kinds.iter().zip(vector.as_slice());
            let shown = axes.map(|(kind, value_lu)| match kind {
                AxisKind::Linear => *value_lu,
                AxisKind::Rotary => deg_from_rad(*value_lu),
            });
            shown.map(|value| self.precision.round(value)).collect()
        };
        let without_tool = block.tool_length.as_slice().iter().all(|length| *length == 0.0);
        Programmed {
            program: self.program_name(block.block.program).map(|name| name.to_string()),
            block: Some(block.block.number),
            line: Some(block.block.line),
            motion: Some(block.motion.word().to_owned()),
            points: block.points.iter().flat_map(|point| values(&point.0)).collect(),
            tool_length_mm: if without_tool { Vec::new() } else { values(&block.tool_length) },
        }
    }

    fn event_message(&self, block: Option<BlockRef>, event: &EventRecord) -> Event {
        let mut message = Event::default();
        if let Some(block) = block {
            message.program = self.program_name(block.program).map(|name| name.to_string());
            message.block = Some(block.number);
            message.line = Some(block.line);
        }
        let (kind, text) = match event {
            EventRecord::BlockStart => ("block_start", String::new()),
            EventRecord::MFunction(number) => {
                message.m_function = Some(*number);
                ("m", format!("M{number}"))
            }
            EventRecord::SpindleSpeed { speed_rpm } => {
                message.speed_rpm = Some(*speed_rpm);
                ("s", format!("S{speed_rpm}"))
            }
            EventRecord::Tool(tool) => ("t", format!("T{tool}")),
            EventRecord::Edge(number) => {
                message.edge = Some(*number);
                ("d", format!("D{number}"))
            }
            EventRecord::Message(text) => ("msg", text.to_string()),
            EventRecord::Trace(starts) => ("trace", if *starts { "start" } else { "stop" }.to_owned()),
            EventRecord::HFunction(value) => ("h", format!("H{value}")),
            EventRecord::Spindle(text) => ("spindle", text.to_string()),
            EventRecord::ProgramOpened(name) => ("program", name.to_string()),
            EventRecord::Corner { angle_rad, tolerance_mm, transition_length_mm, feed_mm_s } => {
                message.angle_deg = Some(deg_from_rad(*angle_rad));
                message.tolerance_mm = Some(*tolerance_mm);
                message.transition_length_mm = Some(*transition_length_mm);
                message.feed_mm_s = Some(*feed_mm_s);
                ("corner", String::new())
            }
            EventRecord::Warning { code, message: text } => {
                message.code = Some((*code).to_owned());
                ("warning", text.to_string())
            }
            EventRecord::Alarm { code, message: text } => {
                message.code = Some((*code).to_owned());
                ("alarm", text.to_string())
            }
        };
        message.kind = Some(kind.to_owned());
        message.text = (!text.is_empty() || kind == "msg").then_some(text);
        message
    }
}

/// Writes a text into a place that may already hold one, without a new allocation.
fn set_text(place: &mut Option<String>, text: Option<&str>) {
    match text {
        Some(text) => {
            let place = place.get_or_insert_with(String::new);
            place.clear();
            place.push_str(text);
        }
        None => *place = None,
    }
}
