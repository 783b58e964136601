//! What a recording holds: topics, message types, and every field of an axis with its names, its unit and the wire it taps.
//!
//! In: the .proto files, compiled by `build.rs`. Out: [`AXIS_FIELDS`], the one table that encoder, reader, CSV export and the
//! choice of signals share; [`proto`], the message types; the descriptors that travel in the file. Does not write or read files.

use crate::base::AxisKind;
use crate::drive::AxisSignals;
use crate::interpolator::AxisSetpoint;

/// Message types as generated from the .proto files.
#[allow(clippy::all, clippy::pedantic, missing_docs)]
pub mod proto {
    include!(concat!(env!("OUT_DIR"), "/messages.rs"));
}

/// Version of the recording's layout, as `format` in its metadata.
pub const RECORDING_FORMAT: u32 = 1;
/// Topic of the path.
pub const PATH_TOPIC: &str = "/path";
/// Topic of the events.
pub const EVENT_TOPIC: &str = "/event";
/// Topic of the master spindle, where the machine file has `[spindle]`.
pub const SPINDLE_TOPIC: &str = "/spindle";
/// Topic of what the program asks for.
pub const PROGRAMMED_TOPIC: &str = "/programmed";
/// Topics of the tool poses, by [`ToolPose`].
pub const TOOL_TOPICS: [&str; 2] = ["/tool/setpoint", "/tool/actual"];
/// What the topics of the axes begin with; the name of the axis follows.
pub const AXIS_TOPIC_PREFIX: &str = "/axis/";
/// What the topics of other signals of imported traces begin with; the name in the file follows.
pub const SIGNAL_TOPIC_PREFIX: &str = "/signal/";
/// Frame of the tool poses: the basic coordinate system, in which the part stands still.
pub const POSE_FRAME: &str = "part";

/// Which of the two tool poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ToolPose {
    /// Where the set-points put the tool.
    Setpoint,
    /// Where the simulated axes put it.
    Actual,
}

impl ToolPose {
    /// Place in [`TOOL_TOPICS`].
    pub fn index(self) -> usize {
        match self {
            Self::Setpoint => 0,
            Self::Actual => 1,
        }
    }
}

/// A message type with the descriptors that a reader needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SchemaText {
    /// Full protobuf name.
    pub name: &'static str,
    /// A serialised `google.protobuf.FileDescriptorSet`.
    pub descriptors: &'static [u8],
}

/// Schema of a linear axis.
pub const LINEAR_AXIS: SchemaText = SchemaText { name: "sollwert.LinearAxis", descriptors: AXIS_DESCRIPTORS };
/// Schema of a rotary axis.
pub const ROTARY_AXIS: SchemaText = SchemaText { name: "sollwert.RotaryAxis", descriptors: AXIS_DESCRIPTORS };
/// Schema of the path.
pub const PATH: SchemaText =
    SchemaText { name: "sollwert.Path", descriptors: include_bytes!(concat!(env!("OUT_DIR"), "/path.fds")) };
/// Schema of the events.
pub const EVENT: SchemaText =
    SchemaText { name: "sollwert.Event", descriptors: include_bytes!(concat!(env!("OUT_DIR"), "/event.fds")) };
/// Schema of the master spindle.
pub const SPINDLE: SchemaText =
    SchemaText { name: "sollwert.Spindle", descriptors: include_bytes!(concat!(env!("OUT_DIR"), "/spindle.fds")) };
/// Schema of what the program asks for.
pub const PROGRAMMED: SchemaText = SchemaText {
    name: "sollwert.Programmed",
    descriptors: include_bytes!(concat!(env!("OUT_DIR"), "/programmed.fds")),
};
/// Schema of the signals of imported traces that are none of an axis.
pub const SAMPLE: SchemaText =
    SchemaText { name: "sollwert.Sample", descriptors: include_bytes!(concat!(env!("OUT_DIR"), "/sample.fds")) };
/// Schema of the tool poses.
pub const POSE_IN_FRAME: SchemaText = SchemaText {
    name: "foxglove.PoseInFrame",
    descriptors: include_bytes!(concat!(env!("OUT_DIR"), "/pose_in_frame.fds")),
};

const AXIS_DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/axis.fds"));

/// Number of fields of an axis message.
pub const AXIS_FIELD_COUNT: usize = 25;

/// Place of `flags` in [`AXIS_FIELDS`], which is an integer.
pub const FLAGS_FIELD: usize = 22;

/// Place of `monitoring` in [`AXIS_FIELDS`], which is an integer.
pub const MONITORING_FIELD: usize = 24;

/// Fields of `sollwert.Path` in the order of the columns of an export.
pub const PATH_FIELDS: [&str; 14] = [
    "program",
    "block",
    "line",
    "s_mm",
    "feed_mm_min",
    "programmed_feed_mm_min",
    "acceleration_mm_s2",
    "jerk_mm_s3",
    "limit_axis",
    "limit_kind",
    "buffered_blocks",
    "contour_error_mm",
    "rotary_only",
    "override_ratio",
];

/// Fields of `sollwert.Spindle`, in the order of the message and of the columns of an export.
pub const SPINDLE_FIELDS: [&str; 5] = [
    "angle_setpoint_deg",
    "angle_actual_deg",
    "speed_setpoint_rpm",
    "speed_actual_rpm",
    "acceleration_setpoint_rot_s2",
];

/// Values of a message in the order of [`SPINDLE_FIELDS`].
pub fn spindle_values(message: &proto::sollwert::Spindle) -> [Option<f64>; SPINDLE_FIELDS.len()] {
    [
        message.angle_setpoint_deg,
        message.angle_actual_deg,
        message.speed_setpoint_rpm,
        message.speed_actual_rpm,
        message.acceleration_setpoint_rot_s2,
    ]
}

/// Who makes a signal: decides which signals exist without drives, or on an axis whose drive the machine file does not describe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalSource {
    /// The interpolator: always there.
    Interpolator,
    /// The position of the load: on an ideal axis it equals the set-point.
    Position,
    /// Controllers, motor and mechanics: only where there is a drive.
    Drive,
}

/// Unit of a field inside and in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldUnit {
    /// mm or rad inside, mm or deg in the file, with any power of 1/s.
    AxisLength,
    /// The same on both sides: rad/s, N m, A, V, bits.
    Same,
}

/// One field of an axis message. Its protobuf number is its place in [`AXIS_FIELDS`] + 1.
#[derive(Clone, Copy, Debug)]
pub struct AxisField {
    /// Name without unit, as `--record` takes it.
    pub stem: &'static str,
    /// Name in `sollwert.LinearAxis`.
    pub linear: &'static str,
    /// Name in `sollwert.RotaryAxis`.
    pub rotary: &'static str,
    /// Unit as written in metadata, for a linear axis.
    pub linear_unit: &'static str,
    /// Unit as written in metadata, for a rotary axis.
    pub rotary_unit: &'static str,
    /// Conversion at the border.
    pub unit: FieldUnit,
    /// Who makes it.
    pub source: SignalSource,
    /// The wire that it taps, in internal units.
    pub value: fn(&AxisSetpoint, &AxisSignals) -> f64,
}

impl AxisField {
    /// Name in the messages of an axis of this kind.
    pub fn name(&self, kind: AxisKind) -> &'static str {
        match kind {
            AxisKind::Linear => self.linear,
            AxisKind::Rotary => self.rotary,
        }
    }

    /// Unit in the messages of an axis of this kind.
    pub fn unit_name(&self, kind: AxisKind) -> &'static str {
        match kind {
            AxisKind::Linear => self.linear_unit,
            AxisKind::Rotary => self.rotary_unit,
        }
    }
}

/// Place in [`AXIS_FIELDS`] of a field, by its name with or without unit.
pub fn axis_field(name: &str) -> Option<usize> {
    AXIS_FIELDS.iter().position(|field| field.stem == name || field.linear == name || field.rotary == name)
}

/// A field in lengths of the axis: `$stem`, the suffix of its derivative, the unit of its derivative.
macro_rules! length_field {
    ($stem:literal, $suffix:literal, $per:literal, $source:ident, $value:expr) => {
        AxisField {
            stem: $stem,
            linear: concat!($stem, "_mm", $suffix),
            rotary: concat!($stem, "_deg", $suffix),
            linear_unit: concat!("mm", $per),
            rotary_unit: concat!("deg", $per),
            unit: FieldUnit::AxisLength,
            source: SignalSource::$source,
            value: $value,
        }
    };
}

/// A field of the motor side: the same name and unit for every axis.
macro_rules! motor_field {
    ($stem:literal, $name:literal, $unit:literal, $value:expr) => {
        AxisField {
            stem: $stem,
            linear: $name,
            rotary: $name,
            linear_unit: $unit,
            rotary_unit: $unit,
            unit: FieldUnit::Same,
            source: SignalSource::Drive,
            value: $value,
        }
    };
}

/// Every field of `/axis/<NAME>`, in the order of the .proto file.
pub const AXIS_FIELDS: [AxisField; AXIS_FIELD_COUNT] = [
    length_field!("position_setpoint", "", "", Interpolator, |s, _| s.position_lu),
    length_field!("position_reference", "", "", Position, |_, d| d.position_reference_lu),
    length_field!("position_actual", "", "", Position, |_, d| d.position_actual_lu),
    length_field!("position_measured", "", "", Position, |_, d| d.position_measured_lu),
    length_field!("control_deviation", "", "", Position, |_, d| d.control_deviation_lu),
    length_field!("following_error", "", "", Position, |_, d| d.following_error_lu),
    length_field!("velocity_setpoint", "_s", "/s", Interpolator, |s, _| s.velocity_lu_s),
    length_field!("acceleration_setpoint", "_s2", "/s^2", Interpolator, |s, _| s.acceleration_lu_s2),
    length_field!("jerk_setpoint", "_s3", "/s^3", Interpolator, |s, _| s.jerk_lu_s3),
    length_field!("velocity_command", "_s", "/s", Drive, |_, d| d.velocity_command_lu_s),
    length_field!("velocity_feedforward", "_s", "/s", Drive, |_, d| d.velocity_feedforward_lu_s),
    length_field!("velocity_actual", "_s", "/s", Position, |_, d| d.velocity_actual_lu_s),
    motor_field!("motor_speed_reference", "motor_speed_reference_rad_s", "rad/s", |_, d| d.motor_speed_reference_rad_s),
    motor_field!("motor_speed", "motor_speed_rad_s", "rad/s", |_, d| d.motor_speed_rad_s),
    motor_field!("torque_reference", "torque_reference_n_m", "N m", |_, d| d.torque_reference_n_m),
    motor_field!("torque_feedforward", "torque_feedforward_n_m", "N m", |_, d| d.torque_feedforward_n_m),
    motor_field!("friction_torque", "friction_torque_n_m", "N m", |_, d| d.friction_torque_n_m),
    motor_field!("gravity_torque", "gravity_torque_n_m", "N m", |_, d| d.gravity_torque_n_m),
    motor_field!("current_reference", "current_reference_a", "A", |_, d| d.current_reference_a),
    motor_field!("current", "current_a", "A", |_, d| d.current_a),
    motor_field!("current_mean", "current_mean_a", "A", |_, d| d.current_mean_a),
    motor_field!("voltage", "voltage_v", "V", |_, d| d.voltage_v),
    motor_field!("flags", "flags", "bits", |_, d| f64::from(d.flags)),
    length_field!("contour_deviation", "", "", Drive, |_, d| d.contour_deviation_lu),
    motor_field!("monitoring", "monitoring", "bits", |_, d| f64::from(d.monitoring)),
];
