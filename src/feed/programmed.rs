//! What the program asks for: the feed along a piece, and the time that a CAM system expects of it.
//!
//! In: the machine, pieces of path. Out: the programmed feed along s ([`ProgrammedTime::feed_lu_s`]): F, or with FGROUP the speed of
//! the path at which the group has F; and the time at that feed ([`ProgrammedTime::time_s`]): length / F with the OVR that the program
//! has set, rapids at the velocity of the axis that takes longest, with OVRRAP. Does not know what the axes can do beyond that.

use super::group::FeedGroup;
use crate::base::PerAxis;
use crate::interpreter::{Feed, ProgrammedLimits};
use crate::kinematics::JointPath;
use crate::machine::Machine;
use crate::smoothing::ContourPiece;

/// The machine data that a programmed time needs.
#[derive(Clone, Debug)]
pub struct ProgrammedTime {
    linear: PerAxis<bool>,
    rapid_velocities_lu_s: PerAxis<f64>,
}

impl ProgrammedTime {
    /// Of `machine`.
    pub fn new(machine: &Machine) -> Self {
        let mut rapid_velocities_lu_s = PerAxis::splat(f64::INFINITY);
        for axis in machine.axis_ids() {
            rapid_velocities_lu_s[axis] = machine.axis(axis).limits.velocity_max_lu_s;
        }
        Self { linear: machine.linear_mask(), rapid_velocities_lu_s }
    }

    /// Programmed feed along s, without OVR; `None` for a rapid or a wait.
    pub fn feed_lu_s(&self, path: &JointPath) -> Option<f64> {
        let curve = path.contour.curve()?;
        let feed_lu_s = programmed_lu_s(&path.contour)?;
        let group = self.group(&path.contour);
        Some(group.map_or(feed_lu_s, |group| feed_lu_s / group.way_ratio(curve)))
    }

    /// Time at the programmed feed; `None` for a wait, which takes what it takes.
    pub fn time_s(&self, path: &JointPath) -> Option<f64> {
        let contour = &path.contour;
        let curve = contour.curve()?;
        let none = ProgrammedLimits::default();
        let programmed = contour.modes.programmed.as_deref().unwrap_or(&none);
        let Some(feed_lu_s) = programmed_lu_s(contour) else {
            return Some(self.rapid_s(path) / programmed.rapid_override_ratio.min(1.0));
        };
        let way_lu = self.group(contour).map_or(path.length_lu(), |group| group.way_lu(curve));
        Some(way_lu / (feed_lu_s * programmed.override_ratio))
    }

    fn group(&self, piece: &ContourPiece) -> Option<FeedGroup> {
        let programmed = piece.modes.programmed.as_deref()?;
        Some(FeedGroup::new(&self.linear, programmed.feed_group?, programmed))
    }

    /// A rapid at the velocity of the axis that takes longest.
    fn rapid_s(&self, path: &JointPath) -> f64 {
        let travel = path.displacement_lu();
        let pairs = travel.as_slice().iter().zip(self.rapid_velocities_lu_s.as_slice());
        pairs.map(|(way, velocity)| way.abs() / velocity).fold(0.0, f64::max)
    }
}

/// F of a piece that moves with one.
fn programmed_lu_s(piece: &ContourPiece) -> Option<f64> {
    match &piece.feed {
        Feed::Rapid => None,
        Feed::Path { feed_lu_s } => Some(*feed_lu_s),
        Feed::Varying { feeds_lu_s } => feeds_lu_s.first().copied(),
    }
}
