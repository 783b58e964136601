//! The words of a machine file and what they stand for, each pair in one place.
//!
//! In: nothing. Out: [`Choice`] for every setting that is one of some words. Does not say which of them are available yet: that
//! is `later`.

use super::checked::{
    AccelerationMode, ArcLimits, BlendLaw, BlendLimits, BlendShape, CompressorBlocks, CornerRule, CurvatureJump,
    FineInterpolation, PathMode, TimeLawKind,
};
use crate::base::AxisKind;

/// A setting that is written as one of some words.
pub trait Choice: Copy + PartialEq + 'static {
    /// Words and meanings, the usual one first.
    const WORDS: &'static [(&'static str, Self)];

    /// The word for this value, as a machine file has it.
    fn word(self) -> &'static str {
        Self::WORDS.iter().find(|(_, value)| *value == self).map_or("", |(word, _)| word)
    }
}

/// The words of a setting.
pub(super) fn words<T: Choice>() -> Vec<&'static str> {
    T::WORDS.iter().map(|(word, _)| *word).collect()
}

impl Choice for FineInterpolation {
    const WORDS: &'static [(&'static str, Self)] = &[("cubic", Self::Cubic), ("linear", Self::Linear)];
}

impl Choice for TimeLawKind {
    const WORDS: &'static [(&'static str, Self)] =
        &[("seven-phase", Self::SevenPhase), ("continuous", Self::Continuous)];
}

impl Choice for PathMode {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("G60", Self::ExactStop),
        ("G64", Self::G64),
        ("G641", Self::G641),
        ("G642", Self::G642),
        ("G643", Self::G643),
        ("G644", Self::G644),
        ("G645", Self::G645),
    ];
}

impl Choice for AccelerationMode {
    const WORDS: &'static [(&'static str, Self)] = &[("SOFT", Self::Soft), ("BRISK", Self::Brisk)];
}

impl Choice for CornerRule {
    const WORDS: &'static [(&'static str, Self)] = &[("follow_up", Self::FollowUp), ("overload", Self::Overload)];
}

impl Choice for CurvatureJump {
    const WORDS: &'static [(&'static str, Self)] = &[("signed", Self::Signed), ("printed", Self::Printed)];
}

impl Choice for ArcLimits {
    const WORDS: &'static [(&'static str, Self)] = &[("worst", Self::Worst), ("printed", Self::Printed)];
}

impl Choice for BlendLaw {
    const WORDS: &'static [(&'static str, Self)] =
        &[("limits", Self::Limits), ("entry", Self::Entry), ("published", Self::Published)];
}

impl Choice for BlendShape {
    const WORDS: &'static [(&'static str, Self)] = &[("hermite3", Self::Hermite3), ("quintic", Self::Quintic)];
}

impl Choice for BlendLimits {
    const WORDS: &'static [(&'static str, Self)] = &[("axis", Self::Axis), ("path", Self::Path)];
}

impl Choice for CompressorBlocks {
    const WORDS: &'static [(&'static str, Self)] =
        &[("lines", Self::Lines), ("arcs", Self::Arcs), ("rapids", Self::Rapids), ("all", Self::All)];
}

impl Choice for AxisKind {
    const WORDS: &'static [(&'static str, Self)] = &[("linear", Self::Linear), ("rotary", Self::Rotary)];
}

/// `[kinematics] type`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum KinematicsType {
    Cartesian,
    TableTable,
    HeadTable,
}

impl Choice for KinematicsType {
    const WORDS: &'static [(&'static str, Self)] =
        &[("cartesian", Self::Cartesian), ("table-table", Self::TableTable), ("head-table", Self::HeadTable)];
}

/// `kinematics.rotary[].carries`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Carries {
    Part,
    Tool,
}

impl Choice for Carries {
    const WORDS: &'static [(&'static str, Self)] = &[("part", Self::Part), ("tool", Self::Tool)];
}
