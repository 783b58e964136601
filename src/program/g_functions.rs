//! The G functions by number.
//!
//! In: a number. Out: its [`GFunction`] and group, or why there is none. Words of a G group that have a name stand in `words`.

use super::not_acted_on::NotActedOn;
use super::word_kinds::{ExactStop, FeedType, PoleOrigin, Suppression, ThreadWord};
use super::words::{Role, role};
use crate::machine::PathMode;

/// G functions that are acted on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GFunction {
    /// G0.
    Rapid,
    /// G1.
    Line,
    /// G2.
    Clockwise,
    /// G3.
    CounterClockwise,
    /// G33, G34, G35, G331, G332.
    Thread(ThreadWord),
    /// G4.
    Dwell,
    /// G9.
    ExactStopOnce,
    /// G63: this block taps with a compensating chuck.
    TapWithChuck,
    /// G17, G18, G19.
    Plane(Plane),
    /// G53, G153 (SUPA is a keyword).
    SuppressFrames(Suppression),
    /// G58, G59: programmable axial offset, coarse (true) or fine.
    AxialOffset(bool),
    /// G110, G111, G112.
    Pole(PoleOrigin),
    /// G25 (false), G26 (true): lower or upper limit of the work area or the spindle speed.
    Limit(bool),
    /// G601, G602, G603.
    ExactStopWindow(ExactStop),
    /// G93 to G97 and their kin.
    FeedType(FeedType),
    /// G500, G54 to G57, G505 to G599.
    ZeroOffset(u16),
    /// G60, G64, G641 to G645.
    PathMode(PathMode),
    /// G70, G71, G700, G710.
    Measure(Measure),
    /// G90 (true), G91.
    Absolute(bool),
    /// Known, and already so.
    Silent(u8),
    /// Known, warned about; its group.
    NotActedOn(&'static NotActedOn, u8),
}

/// Working plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// X, Y.
    G17,
    /// Z, X.
    G18,
    /// Y, Z.
    G19,
}

/// Unit of lengths in the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// G71, G710: mm.
    Metric,
    /// G70: positions in inch; feeds and tolerances stay metric.
    InchGeometry,
    /// G700: feeds and tolerances in inch too.
    Inch,
}

impl GFunction {
    /// Its G group: two of one group cannot stand in one block. 0: no group (G4, G9, G63, suppression).
    pub fn group(&self) -> u8 {
        match self {
            Self::Rapid | Self::Line | Self::Clockwise | Self::CounterClockwise | Self::Thread(_) => 1,
            Self::Dwell | Self::ExactStopOnce | Self::TapWithChuck | Self::SuppressFrames(_) => 0,
            Self::AxialOffset(_) | Self::Pole(_) | Self::Limit(_) => 3,
            Self::ExactStopWindow(_) => 12,
            Self::FeedType(_) => 15,
            Self::Plane(_) => 6,
            Self::ZeroOffset(_) => 8,
            Self::PathMode(_) => 10,
            Self::Measure(_) => 13,
            Self::Absolute(_) => 14,
            Self::Silent(group) | Self::NotActedOn(_, group) => *group,
        }
    }
}

/// The G function of that number; `Err` with the reason for a known one that is not built, `Err("")` for an unknown one.
pub fn g_function(number: u32) -> Result<GFunction, &'static str> {
    Ok(match number {
        0 => GFunction::Rapid,
        1 => GFunction::Line,
        2 => GFunction::Clockwise,
        3 => GFunction::CounterClockwise,
        4 => GFunction::Dwell,
        9 => GFunction::ExactStopOnce,
        63 => GFunction::TapWithChuck,
        17 => GFunction::Plane(Plane::G17),
        18 => GFunction::Plane(Plane::G18),
        19 => GFunction::Plane(Plane::G19),
        25 => GFunction::Limit(false),
        26 => GFunction::Limit(true),
        33 => GFunction::Thread(ThreadWord::Constant),
        34 => GFunction::Thread(ThreadWord::Rising),
        35 => GFunction::Thread(ThreadWord::Falling),
        331 => GFunction::Thread(ThreadWord::Tap),
        332 => GFunction::Thread(ThreadWord::Retract),
        53 => GFunction::SuppressFrames(Suppression::Settable),
        153 => GFunction::SuppressFrames(Suppression::Basic),
        58 => GFunction::AxialOffset(true),
        59 => GFunction::AxialOffset(false),
        110 => GFunction::Pole(PoleOrigin::Position),
        111 => GFunction::Pole(PoleOrigin::Zero),
        112 => GFunction::Pole(PoleOrigin::Pole),
        54..=57 => GFunction::ZeroOffset((number - 53) as u16),
        500 => GFunction::ZeroOffset(0),
        505..=599 => GFunction::ZeroOffset((number - 500) as u16),
        60 => GFunction::PathMode(PathMode::ExactStop),
        64 => GFunction::PathMode(PathMode::G64),
        641 => GFunction::PathMode(PathMode::G641),
        642 => GFunction::PathMode(PathMode::G642),
        643 => GFunction::PathMode(PathMode::G643),
        644 => GFunction::PathMode(PathMode::G644),
        645 => GFunction::PathMode(PathMode::G645),
        70 => GFunction::Measure(Measure::InchGeometry),
        71 | 710 => GFunction::Measure(Measure::Metric),
        700 => GFunction::Measure(Measure::Inch),
        90 => GFunction::Absolute(true),
        91 => GFunction::Absolute(false),
        40 => GFunction::Silent(7),
        290 => GFunction::Silent(47),
        450 | 451 => GFunction::Silent(18),
        601 => GFunction::ExactStopWindow(ExactStop::Fine),
        602 => GFunction::ExactStopWindow(ExactStop::Coarse),
        603 => GFunction::ExactStopWindow(ExactStop::Setpoint),
        93 => GFunction::FeedType(FeedType::InverseTime),
        931 => GFunction::FeedType(FeedType::Time),
        94 => GFunction::FeedType(FeedType::PerMinute),
        95 => GFunction::FeedType(FeedType::PerRevolution),
        942 => GFunction::FeedType(FeedType::PerMinuteKept),
        952 => GFunction::FeedType(FeedType::PerRevolutionKept),
        96 => GFunction::FeedType(FeedType::CuttingSpeedPerRevolution),
        961 => GFunction::FeedType(FeedType::CuttingSpeedPerMinute),
        962 => GFunction::FeedType(FeedType::CuttingSpeed),
        97 => GFunction::FeedType(FeedType::SpeedPerRevolution),
        971 => GFunction::FeedType(FeedType::SpeedPerMinute),
        972 => GFunction::FeedType(FeedType::Speed),
        973 => GFunction::FeedType(FeedType::SpeedPerRevolutionFree),
        _ => return other_g_function(number),
    })
}

fn other_g_function(number: u32) -> Result<GFunction, &'static str> {
    let group = match number {
        41 | 42 => 7,
        _ => 57,
    };
    match role(&format!("G{number}")) {
        Some(Role::NotActedOn(entry)) => Ok(GFunction::NotActedOn(entry, group)),
        Some(Role::NotBuilt(reason)) => Err(reason),
        _ => Err(""),
    }
}
