//! The wire out of optimum.
//!
//! In: nothing (plain data). Out: [`Optimum`] with the speed along the path. Does not solve.

use crate::kinematics::JointPath;

/// The fastest motion along a path.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Optimum {
    /// Time from start to end, waits included.
    pub time_s: f64,
    /// Of it, time at rest: dwells and waits.
    pub rest_s: f64,
    /// Intervals of the grid.
    pub grid_points: usize,
    /// Problems that were solved.
    pub rounds: usize,
    /// Lines in which motions begin for which the solver found nothing: the control's motion stands in their place.
    pub unsolved_lines: Vec<u32>,
    /// The motions between rests, in order.
    pub motions: Vec<OptimalMotion>,
}

/// A motion from rest to rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OptimalMotion {
    /// The path, in order.
    pub path: Vec<JointPath>,
    /// The least time that is known: the motion at `places` takes up to a thousandth more where the control drives it faster than they say.
    pub time_s: f64,
    /// Speed at places, in order; between two of them v² is the cubic with these values and slopes, before the first and after the last
    /// one the motion has constant jerk (constant acceleration where the jerk is not limited) from rest and to rest.
    pub places: Vec<SpeedPlace>,
}

/// Speed at a place of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedPlace {
    /// From the start of the motion.
    pub place_lu: f64,
    /// ds/dt.
    pub velocity_lu_s: f64,
    /// d²s/dt².
    pub acceleration_lu_s2: f64,
}

/// Why there is no optimum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoOptimum {
    /// The path between two rests is longer than what is solved at once.
    TooLong {
        /// Pieces of path between the rests.
        pieces: usize,
        /// As many are solved.
        pieces_max: usize,
    },
    /// Built without the feature `optimal`.
    NotBuilt,
}
