//! From the bytes of a message to numbers in the units of the file.
//!
//! In: the data of one message, the sort of its topic. Out: [`Content`]. Fields that this version does not know are passed over,
//! so that newer recordings stay readable. Does not read files.

use super::schema::proto::foxglove::PoseInFrame;
use super::schema::proto::sollwert::{Event, Path, Programmed, Sample, Spindle};
use super::schema::{
    AXIS_FIELD_COUNT, AXIS_TOPIC_PREFIX, EVENT, EVENT_TOPIC, FLAGS_FIELD, LINEAR_AXIS, MONITORING_FIELD, PATH,
    PATH_TOPIC, POSE_IN_FRAME, PROGRAMMED, PROGRAMMED_TOPIC, ROTARY_AXIS, SAMPLE, SIGNAL_TOPIC_PREFIX, SPINDLE,
    SPINDLE_TOPIC, TOOL_TOPICS, ToolPose,
};
use crate::base::AxisKind;
use prost::Message as _;
use prost::encoding::{DecodeContext, WireType, decode_key, skip_field};

/// Sort of a topic, by its name and its schema.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TopicKind {
    /// Signals of an axis.
    Axis {
        /// Name of the axis.
        name: String,
        /// Decides the unit of positions.
        kind: AxisKind,
    },
    /// The path.
    Path,
    /// Events.
    Event,
    /// The master spindle.
    Spindle,
    /// What the program asks of the path.
    Programmed,
    /// A pose of the tool.
    Pose(ToolPose),
    /// A signal of an imported trace that is none of an axis.
    Signal {
        /// Name in the file that it came from.
        original: String,
    },
    /// Anything that this program does not write.
    Other,
}

impl TopicKind {
    pub(super) fn of(topic: &str, schema: &str) -> Self {
        let axis = topic.strip_prefix(AXIS_TOPIC_PREFIX).map(str::to_owned);
        match (axis, topic) {
            (Some(name), _) if schema == LINEAR_AXIS.name => Self::Axis { name, kind: AxisKind::Linear },
            (Some(name), _) if schema == ROTARY_AXIS.name => Self::Axis { name, kind: AxisKind::Rotary },
            (None, topic) if schema == SAMPLE.name && topic.starts_with(SIGNAL_TOPIC_PREFIX) => {
                Self::Signal { original: topic[SIGNAL_TOPIC_PREFIX.len()..].to_owned() }
            }
            (None, PATH_TOPIC) if schema == PATH.name => Self::Path,
            (None, EVENT_TOPIC) if schema == EVENT.name => Self::Event,
            (None, SPINDLE_TOPIC) if schema == SPINDLE.name => Self::Spindle,
            (None, PROGRAMMED_TOPIC) if schema == PROGRAMMED.name => Self::Programmed,
            (None, topic) if schema == POSE_IN_FRAME.name && topic == TOOL_TOPICS[0] => Self::Pose(ToolPose::Setpoint),
            (None, topic) if schema == POSE_IN_FRAME.name && topic == TOOL_TOPICS[1] => Self::Pose(ToolPose::Actual),
            _ => Self::Other,
        }
    }
}

/// Signals of an axis at one instant, in mm or deg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisSample {
    values: [f64; AXIS_FIELD_COUNT],
    present: u32,
}

impl AxisSample {
    /// Value of a field, by its place in `AXIS_FIELDS` (see `axis_field`); `None` if it was not recorded.
    pub fn get(&self, field: usize) -> Option<f64> {
        (field < AXIS_FIELD_COUNT && self.present & (1 << field) != 0).then(|| self.values[field])
    }

    pub(super) fn decode(mut data: &[u8]) -> Result<Self, prost::DecodeError> {
        let mut sample = Self { values: [0.0; AXIS_FIELD_COUNT], present: 0 };
        while !data.is_empty() {
            if let Some((field, value, rest)) = double_field(data) {
                sample.values[field] = value;
                sample.present |= 1 << field;
                data = rest;
                continue;
            }
            let (tag, wire) = decode_key(&mut data)?;
            let field = tag as usize - 1;
            let value = match (field, wire) {
                (FLAGS_FIELD | MONITORING_FIELD, WireType::Varint) => {
                    let mut bits = 0_u32;
                    prost::encoding::uint32::merge(wire, &mut bits, &mut data, DecodeContext::default())?;
                    f64::from(bits)
                }
                _ => {
                    skip_field(wire, tag, &mut data, DecodeContext::default())?;
                    continue;
                }
            };
            sample.values[field] = value;
            sample.present |= 1 << field;
        }
        Ok(sample)
    }
}

/// A field of wire type 1 that this program writes, at the beginning of `data`: its place, its value, what follows. In one piece: this is most of
/// what a recording is made of. `None`: anything else, or too few bytes, which the general way tells.
#[inline]
fn double_field(data: &[u8]) -> Option<(usize, f64, &[u8])> {
    let (first, rest) = data.split_first()?;
    let (key, rest) = match (*first, rest) {
        (low @ 0..=0x7f, rest) => (u32::from(low), rest),
        (low, [high @ 0..=0x7f, rest @ ..]) => (u32::from(low & 0x7f) | u32::from(*high) << 7, rest),
        _ => return None,
    };
    let field = (key >> 3).checked_sub(1)? as usize;
    let known = key & 7 == 1 && field < AXIS_FIELD_COUNT && !matches!(field, FLAGS_FIELD | MONITORING_FIELD);
    let (bytes, rest) = rest.split_first_chunk().filter(|_| known)?;
    Some((field, f64::from_le_bytes(*bytes), rest))
}

/// A decoded message.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// Signals of an axis.
    Axis(AxisSample),
    /// The path.
    Path(Box<Path>),
    /// An event.
    Event(Box<Event>),
    /// The master spindle.
    Spindle(Box<Spindle>),
    /// What the program asks of the path.
    Programmed(Box<Programmed>),
    /// A pose of the tool, in metres.
    Pose(ToolPose, Box<PoseInFrame>),
    /// A sample of a signal of an imported trace.
    Sample(Sample),
    /// Data of a topic that this program does not know.
    Other(Vec<u8>),
}

impl Content {
    pub(super) fn decode(kind: &TopicKind, data: &[u8]) -> Result<Self, prost::DecodeError> {
        Ok(match kind {
            TopicKind::Axis { .. } => Self::Axis(AxisSample::decode(data)?),
            TopicKind::Path => Self::Path(Box::new(Path::decode(data)?)),
            TopicKind::Event => Self::Event(Box::new(Event::decode(data)?)),
            TopicKind::Spindle => Self::Spindle(Box::new(Spindle::decode(data)?)),
            TopicKind::Programmed => Self::Programmed(Box::new(Programmed::decode(data)?)),
            TopicKind::Pose(which) => Self::Pose(*which, Box::new(PoseInFrame::decode(data)?)),
            TopicKind::Signal { .. } => Self::Sample(Sample::decode(data)?),
            TopicKind::Other => Self::Other(data.to_vec()),
        })
    }
}
