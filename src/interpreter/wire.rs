//! The wire out of the interpreter: a small machine-independent vocabulary of moves, as a canonical listing shows it.
//!
//! In: nothing (plain data). Out: [`Move`].

use crate::base::{AxisId, PartPoint};
use crate::machine::{AccelerationMode, PathMode};
use crate::program::{BlockRef, OpenedProgram};
use std::sync::Arc;

/// One executed block that moves, waits or does something.
#[derive(Clone, Debug, PartialEq)]
pub struct Move {
    /// Where it comes from.
    pub block: BlockRef,
    /// What it does.
    pub kind: MoveKind,
    /// All axes at its end, after all frames, without tool length (mm, rad). Equals the start for waits and functions.
    pub end: PartPoint,
    /// Programmed feed.
    pub feed: Feed,
    /// Modes in force.
    pub modes: Modes,
    /// What happens at its start, in order of output. Empty for most blocks (an empty `Vec` does not allocate).
    pub events: Vec<Event>,
}

/// What a move does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MoveKind {
    /// G0: straight line at the axes' limits.
    Rapid,
    /// G1.
    Line,
    /// G2, G3, also as helix.
    Arc(ArcGeometry),
    /// G4: stands still.
    Dwell {
        /// Length of the wait.
        time_s: f64,
    },
    /// No motion: only its events.
    Function {
        /// The path must come to rest before it (M0, M1, M2, M30, M6).
        stops: bool,
    },
}

/// An arc or helix that starts where the move before ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArcGeometry {
    /// First and second axis of the plane (G17: X, Y; G18: Z, X; G19: Y, Z).
    pub plane: [AxisId; 2],
    /// Centre in these two axes, absolute, after frames; start and end lie on the circle to rounding.
    pub centre_mm: [f64; 2],
    /// Radius.
    pub radius_mm: f64,
    /// Swept angle, positive from the first axis towards the second (G3), full circles included. All other axes move linearly with it.
    pub sweep_rad: f64,
}

/// Feed of a move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feed {
    /// As fast as the axes can.
    Rapid,
    /// Along the path of the linear axes, mm/s; of the rotary axes, rad/s, where no linear axis moves.
    Path {
        /// F word.
        feed_lu_s: f64,
    },
}

/// Modes that later rooms act on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Modes {
    /// How the end of this block meets the next (G9 is `ExactStop` for its one block).
    pub path_mode: PathMode,
    /// CTOL; `None`: the machine's `contour_tolerance_mm`.
    pub contour_tolerance_mm: Option<f64>,
    /// ADIS (or ADISPOS for rapids); `None`: the machine's default.
    pub rounding_distance_mm: Option<f64>,
    /// SOFT or BRISK.
    pub acceleration_mode: AccelerationMode,
    /// FFWON or FFWOF; starts on, as the machine file's weights say (MD32630 and docs).
    pub feedforward_active: bool,
}

/// What is output at the start of a block.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A program file was opened for the first time.
    ProgramOpened(OpenedProgram),
    /// M function.
    MFunction(u32),
    /// Spindle speed word.
    SpindleSpeed {
        /// S word.
        speed_rpm: f64,
    },
    /// Tool word, number or name as text.
    Tool(Arc<str>),
    /// Tool edge.
    Edge(u32),
    /// MSG("..."); empty clears.
    Message(Arc<str>),
}
