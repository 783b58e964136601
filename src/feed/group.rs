//! FGROUP: F holds along the path of the axes of the group.
//!
//! In: the group with FGREF, a curve. Out: how long the way of the group is for a unit of s, and along the whole curve. On a line, and on an arc with both axes
//! of its plane in the group or neither, that is one number; elsewhere the greatest on the curve is taken, so that the feed of the
//! group is nowhere above F (the control follows it along the curve). A rotary axis counts with FGREF times its angle. Where no
//! axis of the group moves, F holds along s, as without FGROUP.

use crate::base::Portable;
use crate::base::{AxisId, AxisVector, PerAxis};
use crate::geometry::{Arc, Curve, DISPLACEMENT_MIN_LU};
use crate::interpreter::ProgrammedLimits;

/// Places at which a curve that is neither line nor arc is looked at.
const PLACES: u32 = 32;

/// The axes of the group.
#[derive(Clone, Debug)]
pub(super) struct FeedGroup {
    members: PerAxis<bool>,
    /// mm of path for one unit of the axis: 1 for a linear axis, FGREF (mm/rad) for a rotary one; 0 outside the group.
    weights: AxisVector,
}

impl FeedGroup {
    pub(super) fn new(linear: &PerAxis<bool>, members: PerAxis<bool>, programmed: &ProgrammedLimits) -> Self {
        let weight = |id: AxisId| if linear[id] { 1.0 } else { programmed.reference_radius_mm[id] };
        Self { members, weights: PerAxis::from_fn(|id| if members[id] { weight(id) } else { 0.0 }) }
    }

    pub(super) fn contains(&self, id: AxisId) -> bool {
        self.members[id]
    }

    /// Way of the group for a unit of s, the greatest on the curve; 1 where the group does not move.
    pub(super) fn way_ratio(&self, curve: &Curve) -> f64 {
        let ratio = match curve {
            Curve::Line(_) => self.along(&curve.at(0.0).first),
            Curve::Arc(arc) => self.on_arc(arc),
            _ => {
                let step_lu = curve.length_lu() / f64::from(PLACES);
                let places = (0..=PLACES).map(|i| self.along(&curve.at(f64::from(i) * step_lu).first));
                places.fold(0.0, f64::max)
            }
        };
        if ratio * curve.length_lu() < DISPLACEMENT_MIN_LU { 1.0 } else { ratio }
    }

    /// Way of the group along the curve; that of the curve where the group does not move.
    pub(super) fn way_lu(&self, curve: &Curve) -> f64 {
        let step_lu = curve.length_lu() / f64::from(PLACES);
        let middles = (0..PLACES).map(|i| self.along(&curve.at((f64::from(i) + 0.5) * step_lu).first));
        let way_lu = match curve {
            Curve::Line(_) => self.way_ratio(curve) * curve.length_lu(),
            _ => middles.sum::<f64>() * step_lu,
        };
        if way_lu < DISPLACEMENT_MIN_LU { curve.length_lu() } else { way_lu }
    }

    fn along(&self, first: &AxisVector) -> f64 {
        let pairs = first.as_slice().iter().zip(self.weights.as_slice());
        pairs.map(|(share, weight)| (share * weight).powi(2)).sum::<f64>().sqrt()
    }

    fn on_arc(&self, arc: &Arc) -> f64 {
        let first = arc.at(0.0).first;
        let [a, b] = arc.plane();
        if self.members[a] == self.members[b] {
            return self.along(&first);
        }
        // One of the two axes: at worst it alone moves in the plane.
        let mut outside = first;
        (outside[a], outside[b]) = (0.0, 0.0);
        (arc.radius_mm() * arc.turn_rate_per_mm()).portable_hypot(self.along(&outside))
    }
}
