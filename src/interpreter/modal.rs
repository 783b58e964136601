//! What the program has said and what still holds: modal G functions, feed, frames.
//!
//! In: words, as `block` hands them over. Out: factors and modes for the motion of a block. No positions here.

use super::active_frames::ActiveFrames;
use super::feed_state::FeedModes;
use super::path_words::ModalCorner;
use super::wire::{Compressor, ExactStop, Modes, ProgrammedLimits, Thread, ToolOffset};
use crate::base::AxisKind;
use crate::base::units::S_PER_MIN;
use crate::base::units::{mm_from_inch, mm_s_from_mm_min, rad_from_deg};
use crate::machine::{AccelerationMode, DynamicsMode, FeedSettings, PathMode};
use crate::program::syntax::Typed;
use crate::program::words::{CurveWord, Measure, Plane, ThreadWord};
use std::sync::Arc;

/// G group 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// G0.
    Rapid,
    /// G1.
    Line,
    /// G2.
    Clockwise,
    /// G3.
    CounterClockwise,
    /// CIP, CT, splines, POLY.
    Curve(CurveWord),
    /// G33 and its kin.
    Thread(ThreadWord),
}

/// F word, ready for both kinds of motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgrammedFeed {
    /// Where a linear axis moves.
    pub linear_mm_s: f64,
    /// Where only rotary axes move.
    pub rotary_rad_s: f64,
}

/// Modal state.
#[derive(Clone, Debug)]
pub struct Modal {
    /// G0 to G3.
    pub motion: Motion,
    /// G17 to G19.
    pub plane: Plane,
    /// G90.
    pub absolute: bool,
    /// G70, G71, G700, G710.
    pub measure: Measure,
    /// G60, G64, G641, G642.
    pub path_mode: PathMode,
    /// CTOL.
    pub contour_tolerance_mm: Option<f64>,
    /// ADIS.
    pub rounding_distance_mm: Option<f64>,
    /// ADISPOS.
    pub rapid_rounding_distance_mm: Option<f64>,
    /// RNDM and FRCM.
    pub corner: ModalCorner,
    /// G601, G602, G603.
    pub exact_stop: ExactStop,
    /// COMPOF, COMPON and so on.
    pub compressor: Compressor,
    /// SOFT, BRISK or DRIVE.
    pub acceleration_mode: AccelerationMode,
    /// DYNNORM and so on.
    pub dynamics: DynamicsMode,
    /// ACC, VELOLIM and so on.
    pub programmed: Option<Arc<ProgrammedLimits>>,
    /// Active edge of the active tool.
    pub tool: Option<Arc<ToolOffset>>,
    /// FFWON or FFWOF.
    pub feedforward_active: bool,
    /// G33 and its kin: of the block in execution.
    pub thread: Option<Arc<Thread>>,
    /// F of G34 and G35, mm a revolution in a revolution; 0 before the first.
    pub lead_change_mm: f64,
    /// DITS and DITE, along the axis of the lead; `None`: as the axes can.
    pub thread_runs_mm: [Option<f64>; 2],
    /// F; `None` before the first.
    pub feed: Option<ProgrammedFeed>,
    /// What else the feed, spindle and positioning words have said.
    pub feed_modes: FeedModes,
    /// S; 0 before the first.
    pub spindle_speed_rpm: f64,
    /// Basic, settable and programmable frame.
    pub frames: Arc<ActiveFrames>,
}

impl Modal {
    /// State at program start: G1 G17 G90 G94 G71, and what the machine file says.
    pub fn new(settings: &FeedSettings, frames: ActiveFrames) -> Self {
        Self {
            motion: Motion::Line,
            plane: Plane::G17,
            absolute: true,
            measure: Measure::Metric,
            path_mode: settings.default_path_mode,
            contour_tolerance_mm: None,
            rounding_distance_mm: None,
            rapid_rounding_distance_mm: None,
            corner: ModalCorner::default(),
            exact_stop: ExactStop::Fine,
            compressor: Compressor::Off,
            acceleration_mode: settings.default_acceleration_mode,
            dynamics: DynamicsMode::Norm,
            programmed: None,
            tool: None,
            feedforward_active: true,
            thread: None,
            lead_change_mm: 0.0,
            thread_runs_mm: [None; 2],
            feed: None,
            feed_modes: FeedModes::default(),
            spindle_speed_rpm: 0.0,
            frames: Arc::new(frames),
        }
    }

    /// SAVE: G functions and frames of `saved` hold again; feed, spindle, tool and the other addresses stay.
    pub fn restore(&mut self, saved: Self) {
        let now = std::mem::replace(self, saved);
        self.feed_modes.keep_spindles(now.feed_modes);
        self.feed = now.feed;
        self.spindle_speed_rpm = now.spindle_speed_rpm;
        self.tool = now.tool;
        self.programmed = now.programmed;
        self.contour_tolerance_mm = now.contour_tolerance_mm;
        self.rounding_distance_mm = now.rounding_distance_mm;
        self.rapid_rounding_distance_mm = now.rapid_rounding_distance_mm;
        self.corner = now.corner;
    }

    /// Modes for the wire; `exact_stop` = G9 in this block.
    pub fn modes(&self, exact_stop: bool) -> Modes {
        let rapid = self.motion == Motion::Rapid;
        Modes {
            path_mode: if exact_stop { PathMode::ExactStop } else { self.path_mode },
            contour_tolerance_mm: self.contour_tolerance_mm,
            rounding_distance_mm: if rapid { self.rapid_rounding_distance_mm } else { self.rounding_distance_mm },
            exact_stop: self.exact_stop,
            compressor: self.compressor,
            acceleration_mode: self.acceleration_mode,
            dynamics: self.dynamics,
            programmed: self.programmed.clone(),
            tool: self.tool.clone(),
            feedforward_active: self.feedforward_active,
            thread: self.thread.clone(),
            cutting: None,
            revolution_rad_s: None,
        }
    }

    /// A typed position in internal units. G70 and G700: linear axes in inch; rotary axes always in degrees.
    pub fn position_lu(&self, kind: AxisKind, typed: Typed) -> f64 {
        match (kind, self.measure) {
            (AxisKind::Rotary, _) => rad_from_deg(typed.0),
            (AxisKind::Linear, Measure::Metric) => typed.0,
            (AxisKind::Linear, Measure::InchGeometry | Measure::Inch) => mm_from_inch(typed.0),
        }
    }

    /// A typed length that is no position (CTOL, ADIS): inch with G700 only.
    pub fn length_mm(&self, typed: Typed) -> f64 {
        if self.measure == Measure::Inch { mm_from_inch(typed.0) } else { typed.0 }
    }

    /// A typed feed: mm/min (inch/min with G700), and deg/min where only rotary axes move.
    pub fn programmed_feed(&self, typed: Typed) -> ProgrammedFeed {
        ProgrammedFeed {
            linear_mm_s: mm_s_from_mm_min(self.length_mm(typed)),
            rotary_rad_s: rad_from_deg(typed.0) / S_PER_MIN,
        }
    }
}
