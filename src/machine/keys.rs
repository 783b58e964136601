//! What a key of a machine file is: unit, range, default, machine data, meaning.
//!
//! In: nothing (plain data). Out: [`Key`], [`TableKeys`], [`Range`]. The reader, the JSON Schema and the user's table of keys are
//! all made from these, so that they cannot disagree. The keys themselves are listed in `catalogue`.

use super::choices::Choice;
use crate::base::AxisKind;

/// Largest magnitude of a value: far beyond any machine, and far enough from overflow after conversion.
pub const MAGNITUDE_MAX: f64 = 1e12;
/// Smallest magnitude of a value that is not 0: a quotient of two values stays finite.
pub const MAGNITUDE_MIN: f64 = 1e-12;

/// What turns or pushes an axis: decides in which units its drive is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum MotorKind {
    /// Behind screw, rack or gear, or a torque motor: N·m, kg·m², rad.
    #[default]
    Rotary,
    /// The motor is the axis: N, kg, m.
    Linear,
}

impl Choice for MotorKind {
    const WORDS: &'static [(&'static str, Self)] = &[("rotary", Self::Rotary), ("linear", Self::Linear)];
}

/// Numbers that a key accepts. NaN never; infinity only where it means "no limit".
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    /// Any finite number.
    Any,
    /// Greater than 0.
    Positive,
    /// Greater than 0, or `inf` for "no limit".
    PositiveOrInfinite,
    /// 0 or more.
    NotNegative,
    /// Any finite number but 0.
    NotZero,
    /// Between two numbers, the ends excluded.
    Between(f64, f64),
    /// Greater than the first, at most the second.
    UpTo(f64, f64),
    /// From the first to the second, both included.
    Within(f64, f64),
}

impl Range {
    /// Whether the number is allowed.
    pub fn holds(&self, value: f64) -> bool {
        let sized = value == 0.0 || (MAGNITUDE_MIN..=MAGNITUDE_MAX).contains(&value.abs());
        match *self {
            Self::Any => sized,
            Self::Positive => sized && value > 0.0,
            Self::PositiveOrInfinite => value == f64::INFINITY || sized && value > 0.0,
            Self::NotNegative => sized && value >= 0.0,
            Self::NotZero => sized && value != 0.0,
            Self::Between(low, high) => sized && value > low && value < high,
            Self::UpTo(low, high) => sized && value > low && value <= high,
            Self::Within(low, high) => sized && (low..=high).contains(&value),
        }
    }

    /// The range in words, with the unit after each number.
    pub fn describe(&self, unit: &str) -> String {
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        match *self {
            Self::Any => format!("a finite number (magnitude 1e-12 to 1e12{unit}, or 0)"),
            Self::Positive => format!("greater than 0{unit} (1e-12 to 1e12)"),
            Self::PositiveOrInfinite => format!("greater than 0{unit} (1e-12 to 1e12), or inf"),
            Self::NotNegative => format!("0{unit} or more (at most 1e12)"),
            Self::NotZero => format!("positive or negative, not 0{unit} (magnitude 1e-12 to 1e12)"),
            Self::Between(low, high) => format!("greater than {low}{unit} and less than {high}{unit}"),
            Self::UpTo(low, high) => format!("greater than {low}{unit} and at most {high}{unit}"),
            Self::Within(low, high) => format!("{low}{unit} to {high}{unit}"),
        }
    }
}

/// What the value of a key must be.
#[derive(Clone, Copy, Debug)]
pub enum Accepts {
    /// A number in the unit of the key.
    Number(Range),
    /// A whole number between two others, both included.
    Whole(u32, u32),
    /// `true` or `false`.
    Flag,
    /// A text that is not empty.
    Text,
    /// One of some words.
    Choice(fn() -> Vec<&'static str>),
    /// `[lower, upper]`, lower < upper.
    Interval,
    /// `[x, y, z]`.
    Vector,
    /// A list of numbers, at least two and at most this many.
    Values(u32),
    /// The array `kinematics.rotary`.
    Joints,
}

/// What holds when the key is missing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Absent {
    /// An error: no value would be honest.
    Required,
    /// This number.
    Number(f64),
    /// This word.
    Word(&'static str),
    /// `false`.
    No,
    /// Said in words.
    Means(&'static str),
}

/// One key.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// As written in the file; ends in the unit.
    pub name: &'static str,
    /// Unit for people, empty without one.
    pub unit: &'static str,
    /// What it accepts.
    pub accepts: Accepts,
    /// What holds when it is missing.
    pub absent: Absent,
    /// Kind of axis that it belongs to; `None`: both, or not about an axis.
    pub kind: Option<AxisKind>,
    /// Kind of motor that it belongs to; `None`: both, or not about a motor.
    pub motor: Option<MotorKind>,
    /// The key to use on an axis or with a motor of the other kind, empty without one.
    pub counterpart: &'static str,
    /// Machine data or drive parameter of the control, empty without one.
    pub machine_data: &'static str,
    /// Meaning, one sentence without a full stop.
    pub help: &'static str,
}

/// A table of the file and its keys.
#[derive(Clone, Copy, Debug)]
pub struct TableKeys {
    /// Dotted path, `*` for the name of an axis or a dynamics set; empty for the top of the file.
    pub path: &'static str,
    /// Its keys.
    pub keys: &'static [Key],
    /// Tables inside it.
    pub tables: &'static [&'static str],
}

impl Key {
    pub(super) const fn new(
        name: &'static str,
        unit: &'static str,
        accepts: Accepts,
        absent: Absent,
        help: &'static str,
    ) -> Self {
        Self { name, unit, accepts, absent, kind: None, motor: None, counterpart: "", machine_data: "", help }
    }

    pub(super) const fn md(mut self, machine_data: &'static str) -> Self {
        self.machine_data = machine_data;
        self
    }

    pub(super) const fn linear(mut self, counterpart: &'static str) -> Self {
        self.kind = Some(AxisKind::Linear);
        self.counterpart = counterpart;
        self
    }

    pub(super) const fn rotary(mut self, counterpart: &'static str) -> Self {
        self.kind = Some(AxisKind::Rotary);
        self.counterpart = counterpart;
        self
    }

    /// For rotary motors; `counterpart` is the key of a linear one.
    pub(super) const fn turning(mut self, counterpart: &'static str) -> Self {
        self.motor = Some(MotorKind::Rotary);
        // Beside a counterpart on the other kind of axis there is none for the other motor.
        if !counterpart.is_empty() {
            self.counterpart = counterpart;
        }
        self
    }

    /// For linear motors; `counterpart` is the key of a rotary one.
    pub(super) const fn pushing(mut self, counterpart: &'static str) -> Self {
        self.kind = Some(AxisKind::Linear);
        self.motor = Some(MotorKind::Linear);
        self.counterpart = counterpart;
        self
    }

    /// Whether an axis of this kind with this kind of motor has the key; `None`: not known.
    pub fn fits(&self, kind: Option<AxisKind>, motor: Option<MotorKind>) -> bool {
        (self.kind.is_none() || kind.is_none() || self.kind == kind)
            && (self.motor.is_none() || motor.is_none() || self.motor == motor)
    }

    /// The allowed values in words.
    pub fn describe_range(&self) -> String {
        match self.accepts {
            Accepts::Number(range) => range.describe(self.unit),
            Accepts::Whole(least, most) if least == most => least.to_string(),
            Accepts::Whole(least, most) => format!("a whole number from {least} to {most}"),
            Accepts::Flag => "true or false".to_owned(),
            Accepts::Text => "a text, not empty".to_owned(),
            Accepts::Choice(names) => quoted_list(&names()),
            Accepts::Interval => format!("[lower, upper] in {}, lower < upper", self.unit),
            Accepts::Vector if self.unit.is_empty() => "[x, y, z], not all 0".to_owned(),
            Accepts::Vector => format!("[x, y, z] in {}", self.unit),
            Accepts::Values(most) => format!("[number, number, ...] in {}, 2 to {most} of them", self.unit),
            Accepts::Joints => "[{ axis, direction, point_mm }, ...], one or two".to_owned(),
        }
    }

    /// What holds without the key, in words.
    pub fn describe_absent(&self) -> String {
        match self.absent {
            Absent::Required => "required".to_owned(),
            Absent::Number(value) => format!("{value}"),
            Absent::Word(word) => format!("\"{word}\""),
            Absent::No => "false".to_owned(),
            Absent::Means(words) => words.to_owned(),
        }
    }
}

/// `"a", "b" or "c"`.
pub(super) fn quoted_list(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => quoted.concat(),
    }
}
