//! The figures of a run, counted cycle by cycle.
//!
//! In: set-points, begun pieces, drive signals. Out: [`Figures`], in internal units; `summary` brings them to the border. What each
//! figure counts is stated at its field. Fixed memory but for the first [`CORNERS_LISTED`] corners.

use crate::base::{AxisId, PerAxis};
use crate::drive::AxisSignals;
use crate::feed::Limit;
use crate::interpolator::{Begun, Setpoint};
use crate::interpreter::ExactStop;
use crate::machine::PathMode;
use crate::program::BlockRef;
use crate::smoothing::Corner;

/// Corners listed one by one; all are counted, and all are events of the recording.
pub const CORNERS_LISTED: usize = 10_000;
/// Limits that a run meets, at most, before the list of them has to grow: three kinds of each of eight axes, and some of the path.
const LIMITS_USUAL: usize = 64;
/// A feed this near the programmed one counts as programmed feed.
const PROGRAMMED_FEED_BAND: f64 = 1e-3;

/// Running figures.
#[derive(Clone, Debug)]
pub struct Figures {
    /// Set-points after the start posture: cycle time in cycles.
    pub setpoints: u64,
    /// Motion blocks executed.
    pub blocks: u64,
    /// Executed path of the linear axes, rapids included.
    pub path_length_mm: f64,
    /// Time at programmed feed: length/F of every piece (with FGROUP and OVR), rapids at the axes' limits, dwells as programmed.
    pub cam_time_s: f64,
    /// Set-points within 0.1 % of the programmed F.
    pub at_programmed_feed: u64,
    /// Set-points per limit that holds at their tick, each limit once, in order of first appearance.
    pub limits: Vec<(Limit, u64)>,
    /// The first corners, in path order.
    pub corners: Vec<(BlockRef, Corner, f64)>,
    /// All corners.
    pub corners_total: u64,
    /// Blocks that end in an exact stop which waits for the axes (G601, G602).
    pub exact_stops: u64,
    /// Per axis.
    pub axes: PerAxis<AxisFigures>,
}

/// Figures of one axis; `lu` is mm or rad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisFigures {
    /// Largest analytic value at a set-point.
    pub velocity_max_lu_s: f64,
    /// Largest analytic value at a set-point.
    pub acceleration_max_lu_s2: f64,
    /// Largest analytic value at a set-point.
    pub jerk_max_lu_s3: f64,
    /// Over all position ticks.
    pub control_deviation_lu: PeakAndSquares,
    /// Over all position ticks.
    pub following_error_lu: PeakAndSquares,
}

/// Largest magnitude and root mean square of a signal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PeakAndSquares {
    peak: f64,
    squares: f64,
    count: u64,
}

impl PeakAndSquares {
    fn add(&mut self, value: f64) {
        self.peak = self.peak.max(value.abs());
        self.squares += value * value;
        self.count += 1;
    }

    /// Largest magnitude.
    pub fn max(&self) -> f64 {
        self.peak
    }

    /// Root mean square, 0 without samples.
    pub fn rms(&self) -> f64 {
        if self.count == 0 { 0.0 } else { (self.squares / self.count as f64).sqrt() }
    }
}

impl Default for Figures {
    /// All zero.
    fn default() -> Self {
        Self {
            setpoints: 0,
            blocks: 0,
            path_length_mm: 0.0,
            cam_time_s: 0.0,
            at_programmed_feed: 0,
            limits: Vec::with_capacity(LIMITS_USUAL),
            corners: Vec::with_capacity(CORNERS_LISTED),
            corners_total: 0,
            exact_stops: 0,
            axes: PerAxis::default(),
        }
    }
}

impl Figures {
    /// Counts a piece that begins.
    pub(super) fn piece(&mut self, begun: &Begun) {
        self.blocks += u64::from(begun.blocks_begun);
        let stops = begun.stop_at_end && begun.path_mode == PathMode::ExactStop;
        self.exact_stops += u64::from(stops && begun.length_lu > 0.0 && begun.exact_stop != ExactStop::Setpoint);
        if !begun.rotary_only {
            self.path_length_mm += begun.length_lu;
        }
        self.cam_time_s += begun.programmed_time_s;
        if let Some(corner) = begun.corner {
            self.corners_total += 1;
            if self.corners.len() < CORNERS_LISTED {
                self.corners.push((begun.block, corner, begun.entry_feed_lu_s));
            }
        }
    }

    /// Counts a set-point; number 0 is the start posture and takes no time.
    pub(super) fn setpoint(&mut self, setpoint: &Setpoint) {
        for axis in AxisId::first(crate::base::AXES_MAX) {
            let (sent, seen) = (&setpoint.axes[axis], &mut self.axes[axis]);
            seen.velocity_max_lu_s = seen.velocity_max_lu_s.max(sent.velocity_lu_s.abs());
            seen.acceleration_max_lu_s2 = seen.acceleration_max_lu_s2.max(sent.acceleration_lu_s2.abs());
            seen.jerk_max_lu_s3 = seen.jerk_max_lu_s3.max(sent.jerk_lu_s3.abs());
        }
        if setpoint.tick.0 == 0 {
            return;
        }
        self.setpoints += 1;
        // A handful of limits hold in a whole run: searching them is quicker than a tree, and room for them is made beforehand.
        match self.limits.iter_mut().find(|(limit, _)| *limit == setpoint.path.limit) {
            Some((_, count)) => *count += 1,
            None => self.limits.push((setpoint.path.limit, 1)),
        }
        if let Some(programmed_lu_s) = setpoint.path.programmed_feed_lu_s {
            let off = (setpoint.path.feed_lu_s - programmed_lu_s).abs();
            self.at_programmed_feed += u64::from(off <= PROGRAMMED_FEED_BAND * programmed_lu_s);
        }
    }

    /// Counts one axis at one position tick.
    pub(super) fn drive(&mut self, axis: AxisId, signals: &AxisSignals) {
        let seen = &mut self.axes[axis];
        seen.control_deviation_lu.add(signals.control_deviation_lu);
        seen.following_error_lu.add(signals.following_error_lu);
    }
}
