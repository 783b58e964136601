//! Which signals go into a recording: `--record X.current,Y.*`.
//!
//! In: the words of the user, the machine's axes. Out: [`SignalChoice`]. `/path` and `/event` are always recorded: without them
//! no sample knows its line. A choice also says how often: at which rate of the drives, every how many samples. Does not thin out.

use super::schema::{AXIS_FIELD_COUNT, AXIS_FIELDS, SPINDLE_FIELDS, SignalSource, TOOL_TOPICS};
use crate::base::diagnostics::nearest;
use crate::base::{AxisId, Diagnostic, PerAxis, SourceText, Span};
use crate::machine::Machine;
use std::num::NonZeroU32;

/// Which cycle of an axis gives samples: `--record-rate`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum RecordRate {
    /// T_p.
    #[default]
    Position,
    /// T_v.
    Speed,
    /// T_i.
    Current,
}

impl RecordRate {
    /// Words of `--record-rate`, in order of the rates.
    pub const WORDS: [&'static str; 3] = ["position", "speed", "current"];

    /// By its word.
    pub fn from_word(word: &str) -> Option<Self> {
        match word {
            "position" => Some(Self::Position),
            "speed" => Some(Self::Speed),
            "current" => Some(Self::Current),
            _ => None,
        }
    }

    /// As in metadata.
    pub fn word(self) -> &'static str {
        Self::WORDS[self as usize]
    }
}

/// A set of axis fields and tool poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SignalChoice {
    /// Bit i: field i of `AXIS_FIELDS`.
    fields: PerAxis<u32>,
    /// By `ToolPose::index`.
    poses: [bool; TOOL_TOPICS.len()],
    /// Every how many samples of its axis a field is recorded.
    every: PerAxis<[u16; AXIS_FIELD_COUNT]>,
    spindle: SpindleChoice,
    rate: RecordRate,
    decimation: NonZeroU32,
    until_rest: bool,
}

/// What of the master spindle is recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct SpindleChoice {
    /// Bit i: field i of `SPINDLE_FIELDS`.
    fields: u32,
    /// Every how many set-points.
    every: u16,
}

impl SpindleChoice {
    fn of(fields: u32) -> Self {
        Self { fields, every: 1 }
    }
}

/// Fields of an axis that people look at on a control's trace: `usual`.
const USUAL_FIELDS: [&str; 8] = [
    "position_setpoint",
    "position_actual",
    "control_deviation",
    "following_error",
    "velocity_setpoint",
    "velocity_actual",
    "torque_reference",
    "current",
];

/// Bits of all fields of the spindle.
const SPINDLE_ALL: u32 = (1 << SPINDLE_FIELDS.len()) - 1;

/// Bits of all fields.
const ALL_FIELDS: u32 = (1 << AXIS_FIELD_COUNT) - 1;

impl Default for SignalChoice {
    fn default() -> Self {
        Self::all()
    }
}

impl SignalChoice {
    /// Everything.
    pub fn all() -> Self {
        Self { spindle: SpindleChoice::of(SPINDLE_ALL), ..Self::of(ALL_FIELDS, [true; TOOL_TOPICS.len()]) }
    }

    /// The same fields of every axis, every sample; no spindle.
    fn of(fields: u32, poses: [bool; TOOL_TOPICS.len()]) -> Self {
        Self {
            fields: PerAxis::splat(fields),
            poses,
            every: PerAxis::splat([1; AXIS_FIELD_COUNT]),
            spindle: SpindleChoice::of(0),
            rate: RecordRate::Position,
            decimation: NonZeroU32::MIN,
            until_rest: false,
        }
    }

    /// The same signals, at another rate.
    pub fn at_rate(self, rate: RecordRate) -> Self {
        Self { rate, ..self }
    }

    /// The same signals, every n-th sample of axes and path only; what a word says of its signals (`/10`) comes on top.
    pub fn decimated(self, decimation: NonZeroU32) -> Self {
        Self { decimation, ..self }
    }

    /// The same signals, up to the place where all axes have come to rest behind the last set-point (`true`), or up to that set-point.
    pub fn until_rest(self, until_rest: bool) -> Self {
        Self { until_rest, ..self }
    }

    /// Whether the recording goes on until the axes are at rest.
    pub fn ends_at_rest(&self) -> bool {
        self.until_rest
    }

    /// At which rate the axes are recorded.
    pub fn rate(&self) -> RecordRate {
        self.rate
    }

    /// Every how many samples of axes and path are recorded.
    pub fn decimation(&self) -> NonZeroU32 {
        self.decimation
    }

    /// Chosen fields of an axis by how often they are recorded: every so many samples, and bits of the fields.
    pub fn groups(&self, axis: AxisId) -> Vec<(u32, u32)> {
        let mut groups: Vec<(u32, u32)> = Vec::new();
        for field in self.fields(axis) {
            let every = u32::from(self.every[axis][field]);
            match groups.iter_mut().find(|(known, _)| *known == every) {
                Some((_, fields)) => *fields |= 1 << field,
                None => groups.push((every, 1 << field)),
            }
        }
        groups
    }

    /// What exists without drives: position, velocity, acceleration and jerk of the set-points, the tool at the set-point, and the spindle.
    pub fn setpoints() -> Self {
        let axes = Self::of(fields_of(|source| source == SignalSource::Interpolator), [true, false]);
        Self { spindle: SpindleChoice::of(SPINDLE_ALL), ..axes }
    }

    /// What both choices hold, as often as this one says.
    pub fn and(&self, other: &Self) -> Self {
        Self {
            fields: PerAxis::from_fn(|axis| self.fields[axis] & other.fields[axis]),
            poses: std::array::from_fn(|i| self.poses[i] && other.poses[i]),
            spindle: SpindleChoice { fields: self.spindle.fields & other.spindle.fields, ..self.spindle },
            ..*self
        }
    }

    /// True if any field of the axis is chosen.
    pub fn axis(&self, axis: AxisId) -> bool {
        self.fields[axis] != 0
    }

    /// Places in [`AXIS_FIELDS`] of the chosen fields of an axis, in order.
    pub fn fields(&self, axis: AxisId) -> impl Iterator<Item = usize> + use<> {
        let bits = self.fields[axis];
        (0..AXIS_FIELD_COUNT).filter(move |field| bits & (1 << field) != 0)
    }

    /// True if the tool pose at this place of `TOOL_TOPICS` is chosen.
    pub fn pose(&self, index: usize) -> bool {
        self.poses[index]
    }

    /// What of the spindle is chosen: bits of `SPINDLE_FIELDS`, 0 for nothing, and every how many set-points.
    pub fn spindle(&self) -> (u32, u32) {
        (self.spindle.fields, u32::from(self.spindle.every))
    }

    /// What of this choice the machine can give: an axis whose drive the machine file does not describe has no motor.
    pub fn on(&self, machine: &Machine) -> Self {
        let mut fields = PerAxis::splat(0);
        for axis in machine.axis_ids() {
            fields[axis] = self.fields[axis] & existing_fields(machine, axis);
        }
        let spindle = if machine.spindle.is_some() { self.spindle } else { SpindleChoice::of(0) };
        Self { fields, spindle, ..*self }
    }

    /// Reads a list of words between commas. A word is `AXIS.FIELD`, where `*` stands for any axis, or for any part of a field
    /// name (with or without its unit); `AXIS` alone means all of its fields; `/10` behind it means every tenth sample, and of several
    /// words for one signal the most frequent counts; `tool`, `tool.setpoint` and `tool.actual` are the
    /// poses; `spindle` and `spindle.FIELD` are the master spindle; `usual` is what people look at (eight fields of every axis, those of a drive where there
    /// is one); `path` and `event` may be named, and are recorded in any case.
    pub fn parse(text: &str, machine: &Machine) -> Result<Self, Diagnostic> {
        let source = SourceText::new("--record", text);
        let mut choice = Self::of(0, [false; TOOL_TOPICS.len()]);
        let mut start = 0;
        for part in text.split(',') {
            let word = part.trim();
            let at = start + (part.len() - part.trim_start().len());
            choice.add(word, machine).map_err(|fault| fault.place_in(&source, at..at + word.len()))?;
            start += part.len() + 1;
        }
        Ok(choice)
    }

    fn add(&mut self, word: &str, machine: &Machine) -> Result<(), Unknown> {
        match word.to_ascii_lowercase().as_str() {
            "" => return Err(Unknown::new("a signal is missing here", "write AXIS.FIELD, such as X.current or X.*")),
            "path" | "path.*" | "event" | "event.*" => return Ok(()),
            "tool" | "tool.*" => self.poses = [true; TOOL_TOPICS.len()],
            "tool.setpoint" => self.poses[0] = true,
            "tool.actual" => self.poses[1] = true,
            _ => return self.add_axis_word(word, machine),
        }
        Ok(())
    }

    fn add_axis_word(&mut self, word: &str, machine: &Machine) -> Result<(), Unknown> {
        let (word, every) = match word.split_once('/') {
            Some((word, times)) => (word.trim_end(), every(times.trim_start())?),
            None => (word, 1),
        };
        if word.eq_ignore_ascii_case("usual") {
            let usual = bits(AXIS_FIELDS.iter().map(|field| USUAL_FIELDS.contains(&field.stem)));
            machine.axis_ids().for_each(|axis| self.add_fields(axis, usual & existing_fields(machine, axis), every));
            return Ok(());
        }
        let (axis_name, pattern) = word.split_once('.').unwrap_or((word, "*"));
        if axis_name.eq_ignore_ascii_case("spindle") {
            return self.add_spindle(pattern, every, machine);
        }
        let axes: Vec<AxisId> = match axis_name {
            "*" => machine.axis_ids().collect(),
            name => vec![machine.axis_by_name(name).ok_or_else(|| unknown_axis(name, machine))?],
        };
        let named = fields_named(pattern);
        if named == 0 {
            return Err(unknown_field(pattern));
        }
        let mut found = false;
        for axis in axes {
            let fields = named & existing_fields(machine, axis);
            found |= fields != 0;
            self.add_fields(axis, fields, every);
        }
        if found {
            return Ok(());
        }
        Err(Unknown::new(
            format!("`{word}` does not exist on this machine: the axis has no drive"),
            "give the axis `drive`, `motor` and `mechanics` in the machine file, or leave the signal out",
        ))
    }
}

impl SignalChoice {
    /// Bits of fields; of two words for one field the more frequent counts.
    fn add_fields(&mut self, axis: AxisId, fields: u32, every: u16) {
        for (field, times) in self.every[axis].iter_mut().enumerate().filter(|(field, _)| fields & (1 << field) != 0) {
            let known = self.fields[axis] & (1 << field) != 0;
            *times = if known { every.min(*times) } else { every };
        }
        self.fields[axis] |= fields;
    }

    fn add_spindle(&mut self, pattern: &str, every: u16, machine: &Machine) -> Result<(), Unknown> {
        let lower = pattern.to_ascii_lowercase();
        // With or without its unit.
        let stem =
            |field: &'static str| field.rsplit_once('_').map_or(field, |(stem, _)| stem.trim_end_matches("_rot"));
        let matches = |name: &str| matches_pattern(lower.as_bytes(), name.as_bytes());
        let named = bits(SPINDLE_FIELDS.iter().map(|field| matches(field) || matches(stem(field))));
        if named == 0 {
            let stems = SPINDLE_FIELDS.map(stem).join(", ");
            let message = format!("`{pattern}` is not a field of the spindle");
            return Err(Unknown::new(message, format!("fields of the spindle: {stems}")));
        }
        if machine.spindle.is_none() {
            return Err(Unknown::new(
                "the spindle is not simulated on this machine",
                "give the machine file `acceleration_rot_s2` in `[spindle]`, or leave the signal out",
            ));
        }
        let before = self.spindle;
        let every = if before.fields == 0 { every } else { every.min(before.every) };
        self.spindle = SpindleChoice { fields: before.fields | named, every };
        Ok(())
    }
}

/// A word that names nothing.
struct Unknown {
    message: String,
    help: String,
}

impl Unknown {
    fn new(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { message: message.into(), help: help.into() }
    }

    fn place_in(self, source: &SourceText, span: Span) -> Diagnostic {
        Diagnostic::error("R0020", self.message).at(source.place(span, "")).help(self.help)
    }
}

/// The number behind `/`.
fn every(text: &str) -> Result<u16, Unknown> {
    text.parse::<u16>().ok().filter(|every| *every > 0).ok_or_else(|| {
        Unknown::new(
            format!("`{text}` is not a number of samples from 1 to {}", u16::MAX),
            "write X.current/10 for every tenth sample of a signal",
        )
    })
}

fn unknown_axis(name: &str, machine: &Machine) -> Unknown {
    let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
    let known = names.join(", ");
    let words = names.iter().copied().chain(["tool", "path", "event", "spindle", "usual"]);
    let help = match nearest(name, words) {
        Some(word) => format!("did you mean `{word}`? Axes of this machine: {known}"),
        None => format!("axes of this machine: {known}"),
    };
    Unknown::new(format!("`{name}` is neither an axis of this machine nor `tool`, `spindle`, `path` or `event`"), help)
}

fn unknown_field(pattern: &str) -> Unknown {
    let known = AXIS_FIELDS.iter().flat_map(|field| [field.stem, field.linear, field.rotary]);
    let help = match nearest(pattern, known) {
        Some(word) => format!("did you mean `{word}`?"),
        None => {
            let stems: Vec<&str> = AXIS_FIELDS.iter().map(|field| field.stem).collect();
            format!("fields of an axis: {}", stems.join(", "))
        }
    };
    Unknown::new(format!("`{pattern}` is not a field of an axis"), help)
}

/// Fields that the axis has.
fn existing_fields(machine: &Machine, axis: AxisId) -> u32 {
    match machine.axis(axis).drive {
        Some(_) => ALL_FIELDS,
        None => fields_of(|source| source != SignalSource::Drive),
    }
}

fn fields_of(keep: impl Fn(SignalSource) -> bool) -> u32 {
    bits(AXIS_FIELDS.iter().map(|field| keep(field.source)))
}

fn fields_named(pattern: &str) -> u32 {
    let pattern = pattern.to_ascii_lowercase();
    let matches = |name: &str| matches_pattern(pattern.as_bytes(), name.as_bytes());
    bits(AXIS_FIELDS.iter().map(|field| matches(field.stem) || matches(field.linear) || matches(field.rotary)))
}

fn bits(chosen: impl Iterator<Item = bool>) -> u32 {
    chosen.enumerate().map(|(i, chosen)| u32::from(chosen) << i).sum()
}

/// Shell-like match: `*` stands for any run of bytes. Greedy with one way back, so that its time is at most the product of the
/// lengths whatever the user types.
fn matches_pattern(pattern: &[u8], name: &[u8]) -> bool {
    let (mut p, mut n) = (0, 0);
    let mut back: Option<(usize, usize)> = None;
    while n < name.len() {
        if pattern.get(p) == Some(&b'*') {
            back = Some((p, n));
            p += 1;
        } else if pattern.get(p) == Some(&name[n]) {
            (p, n) = (p + 1, n + 1);
        } else if let Some((star, taken)) = back {
            back = Some((star, taken + 1));
            (p, n) = (star + 1, taken + 1);
        } else {
            return false;
        }
    }
    pattern[p..].iter().all(|byte| *byte == b'*')
}
