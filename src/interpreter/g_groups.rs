//! $P_GG: the number of the active G function in its group (programming manual, list of G functions).
//!
//! In: modal state. Out: a number from 1. Groups whose functions this kernel does not tell apart answer with their first member.

use super::modal::Motion;
use super::run::Interpreter;
use crate::machine::{AccelerationMode, DynamicsMode, PathMode};
use crate::program::words::{
    Compressor, CurveWord, ExactStop, FeedShape, FeedType, Measure, Plane, SplineEnd, ThreadWord,
};
use crate::program::{Columns, Fault, Outcome, codes};

/// Number of G groups.
const GROUPS: i32 = 64;

impl Interpreter {
    /// The active member of a group.
    pub(super) fn active_g_function(&self, group: i32, columns: &Columns) -> Outcome<i32> {
        let modal = &self.modal;
        Ok(match group {
            1 => self.motion_number(),
            6 => match modal.plane {
                Plane::G17 => 1,
                Plane::G18 => 2,
                Plane::G19 => 3,
            },
            8 => i32::from(self.zero_offset_number()) + 1,
            10 => path_mode_number(modal.path_mode),
            12 => match modal.exact_stop {
                ExactStop::Fine => 1,
                ExactStop::Coarse => 2,
                ExactStop::Setpoint => 3,
            },
            13 => match modal.measure {
                Measure::InchGeometry => 1,
                Measure::Metric => 2,
                Measure::Inch => 3,
            },
            14 => {
                if modal.absolute {
                    1
                } else {
                    2
                }
            }
            15 => self.feed_type_number(),
            19 => spline_end_number(self.curves.begin),
            20 => spline_end_number(self.curves.finish),
            21 => acceleration_number(modal.acceleration_mode),
            24 => {
                if modal.feedforward_active {
                    2
                } else {
                    1
                }
            }
            30 => match modal.compressor {
                Compressor::Off => 1,
                Compressor::On => 2,
                Compressor::Curvature => 3,
                Compressor::Cad => 4,
                Compressor::Surface => 5,
            },
            37 => match modal.feed_modes.shape {
                FeedShape::Constant => 1,
                FeedShape::Linear => 2,
                FeedShape::Cubic => 3,
            },
            45 => 1 + i32::from(self.curves.with_path),
            55 => 1 + i32::from(modal.feed_modes.rapid_by_axis),
            59 => dynamics_number(modal.dynamics),
            group if (1..=GROUPS).contains(&group) => 1,
            _ => {
                return Err(Fault::new(codes::BAD_INDEX, columns.clone(), format!("there is no G group {group}"))
                    .label(format!("expected 1 to {GROUPS}")));
            }
        })
    }

    /// Member of group 1.
    fn motion_number(&self) -> i32 {
        match self.modal.motion {
            Motion::Rapid => 1,
            Motion::Line => 2,
            Motion::Clockwise => 3,
            Motion::CounterClockwise => 4,
            Motion::Curve(CurveWord::ThreePoints) => 5,
            Motion::Curve(CurveWord::Akima) => 6,
            Motion::Curve(CurveWord::BSpline) => 7,
            Motion::Curve(CurveWord::Cubic) => 8,
            Motion::Curve(CurveWord::Polynomial) => 9,
            Motion::Thread(ThreadWord::Constant) => 10,
            Motion::Thread(ThreadWord::Tap) => 11,
            Motion::Thread(ThreadWord::Retract) => 12,
            Motion::Thread(ThreadWord::Rising) => 16,
            Motion::Thread(ThreadWord::Falling) => 17,
            Motion::Curve(CurveWord::Tangential) => 15,
        }
    }

    /// Member of group 15.
    fn feed_type_number(&self) -> i32 {
        match self.modal.feed_modes.feed_type {
            FeedType::InverseTime => 1,
            FeedType::PerMinute => 2,
            FeedType::PerRevolution => 3,
            FeedType::CuttingSpeedPerRevolution => 4,
            FeedType::SpeedPerRevolution => 5,
            FeedType::Time => 6,
            FeedType::CuttingSpeedPerMinute => 7,
            FeedType::SpeedPerMinute => 8,
            FeedType::PerMinuteKept => 9,
            FeedType::PerRevolutionKept => 10,
            FeedType::CuttingSpeed => 11,
            FeedType::Speed => 12,
            FeedType::SpeedPerRevolutionFree => 13,
        }
    }

    /// 0 for G500, 1 for G54 and so on.
    fn zero_offset_number(&self) -> u16 {
        self.modal.frames.number()
    }
}

/// Member of group 21.
fn acceleration_number(mode: AccelerationMode) -> i32 {
    match mode {
        AccelerationMode::Brisk => 1,
        AccelerationMode::Soft => 2,
        AccelerationMode::Drive => 3,
    }
}

/// Member of group 59.
fn dynamics_number(mode: DynamicsMode) -> i32 {
    match mode {
        DynamicsMode::Norm => 1,
        DynamicsMode::Position => 2,
        DynamicsMode::Rough => 3,
        DynamicsMode::SemiFinish => 4,
        DynamicsMode::Finish => 5,
        DynamicsMode::Precision => 6,
    }
}

/// Member of groups 19 and 20.
fn spline_end_number(end: SplineEnd) -> i32 {
    match end {
        SplineEnd::Natural => 1,
        SplineEnd::Tangential => 2,
        SplineEnd::Auto => 3,
    }
}

/// Member of group 10.
fn path_mode_number(mode: PathMode) -> i32 {
    match mode {
        PathMode::ExactStop => 1,
        PathMode::G64 => 2,
        PathMode::G641 => 3,
        PathMode::G642 => 4,
        PathMode::G643 => 5,
        PathMode::G644 => 6,
        PathMode::G645 => 7,
    }
}
