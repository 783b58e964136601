//! The wire out of the interpolator.
//!
//! In: nothing (plain data). Out: [`Setpoint`] and its parts. Does not sample.

use crate::base::{AxisVector, PerAxis, Tick};
use crate::feed::Limit;
use crate::interpreter::ExactStop;
use crate::program::BlockRef;

/// Set-point of one axis; `lu` is mm or rad.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct AxisSetpoint {
    /// Position.
    pub position_lu: f64,
    /// Analytic velocity at the tick.
    pub velocity_lu_s: f64,
    /// Analytic acceleration at the tick.
    pub acceleration_lu_s2: f64,
    /// Analytic jerk at the tick.
    pub jerk_lu_s3: f64,
}

/// What the interpolator sends in one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setpoint {
    /// When.
    pub tick: Tick,
    /// All axes.
    pub axes: PerAxis<AxisSetpoint>,
    /// The path at that instant.
    pub path: PathSample,
    /// FFWON in force.
    pub feedforward_active: bool,
    /// Length of the active tool: position of the axes minus position of the tip.
    pub tool_length: AxisVector,
    /// The master spindle.
    pub spindle: SpindleSetpoint,
}

/// Set-point of the master spindle; right-handed (M3) is positive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpindleSetpoint {
    /// Angle, all revolutions counted.
    pub angle_rad: f64,
    /// Speed.
    pub speed_rad_s: f64,
    /// Acceleration.
    pub acceleration_rad_s2: f64,
}

/// State of the path at a set-point: the topic `/path`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathSample {
    /// NC block.
    pub block: BlockRef,
    /// Path length of the linear axes since the start of the program.
    pub path_length_mm: f64,
    /// Path feed of the linear axes (of the rotary axes, rad/s, where no linear axis moves).
    pub feed_lu_s: f64,
    /// Programmed feed; `None` for rapids and standstill.
    pub programmed_feed_lu_s: Option<f64>,
    /// Feed override at run time; 1: the programmed feed.
    pub override_ratio: f64,
    /// Path acceleration.
    pub acceleration_lu_s2: f64,
    /// Path jerk.
    pub jerk_lu_s3: f64,
    /// What holds the motion back.
    pub limit: Limit,
    /// Motion blocks in the look-ahead.
    pub buffered_blocks: u32,
    /// True where only rotary axes move: the `_lu` above are rad.
    pub rotary_only: bool,
}

/// A block end that stands until the axes are in position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactStopWait {
    /// The first set-point at the end of the block.
    pub since: Tick,
    /// The window that the axes must be in.
    pub window: ExactStop,
    /// Axes on their own way, which the block does not wait for.
    pub elsewhere: PerAxis<bool>,
}
