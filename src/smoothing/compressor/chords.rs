//! The chords that stand for a block while it is being compressed.
//!
//! In: a block, the tolerances, the chords beside it. Out: [`Chords`]: one for a line, as many for an arc as keep it close, some for
//! a line that touches an arc. Does not hold them: that is `track`.

use super::super::transition::Tolerances;
use crate::base::PerAxis;
use crate::geometry::Curve;

/// Share of the tolerance that an arc may rise above its chords.
const SAG_SHARE: f64 = 0.1;

/// Angle that an arc may turn by over one chord.
const TURN_MAX_RAD: f64 = 0.3;

/// An arc that needs more chords is not short for its tolerance.
const ARC_CHORDS_MAX: f64 = 96.0;

/// From an arc on, chords of a line grow by this factor.
const GROWTH_RATIO: f64 = 2.0;

/// How a block is cut.
#[derive(Clone, Debug, Default)]
pub(super) struct Chords {
    /// Where, from its start; in order, without its ends.
    pub places_lu: Vec<f64>,
    /// Share of the tolerance that the block is off its chords.
    pub sag_share: f64,
    /// Length of one chord of an arc.
    pub arc_chord_lu: Option<f64>,
}

impl Chords {
    /// `None`: the block needs too many.
    pub(super) fn new(curve: &Curve, tolerances: &Tolerances, linear: &PerAxis<bool>) -> Option<Self> {
        if matches!(curve, Curve::Line(_)) {
            return Some(Self::default());
        }
        // The same all along a circle and a helix.
        let bend_per_mm = curve.at(0.0).second.masked(linear).norm();
        let length_lu = curve.length_lu();
        let sag_mm = |chord_lu: f64| 0.125 * bend_per_mm * chord_lu * chord_lu;
        // It rises in every direction of its plane.
        let axes = linear.as_slice().iter().zip(tolerances.axis_lu.as_slice()).filter(|(linear, _)| **linear);
        let tolerance_mm = axes.fold(tolerances.contour_mm, |least, (_, own_lu)| least.min(*own_lu));
        let share = |rise_mm: f64| rise_mm / tolerance_mm;
        let by_sag = (share(sag_mm(length_lu)) / SAG_SHARE).sqrt();
        let count = by_sag.max(length_lu * bend_per_mm / TURN_MAX_RAD).ceil().max(1.0);
        let few = count <= ARC_CHORDS_MAX;
        if !few {
            return None;
        }
        let chord_lu = length_lu / count;
        Some(Self {
            places_lu: (1..count as usize).map(|i| chord_lu * i as f64).collect(),
            sag_share: share(sag_mm(chord_lu)),
            arc_chord_lu: Some(chord_lu),
        })
    }

    /// Cuts a line that touches arcs with chords of these lengths: so that the curvature of the arc can run out on it.
    pub(super) fn grade(&mut self, length_lu: f64, [before_lu, after_lu]: [Option<f64>; 2]) {
        if self.arc_chord_lu.is_some() {
            return;
        }
        let reach_lu = if before_lu.is_some() && after_lu.is_some() { 0.5 * length_lu } else { length_lu };
        let growing = |first_lu: Option<f64>| {
            let chords = std::iter::successors(first_lu, |chord_lu| Some(chord_lu * GROWTH_RATIO));
            let ends = chords.scan(0.0, |at_lu, chord_lu| {
                *at_lu += chord_lu;
                Some((*at_lu, chord_lu))
            });
            // What is left is no shorter than the chord beside it.
            ends.take_while(|(at_lu, chord_lu)| at_lu + chord_lu <= reach_lu).map(|(at_lu, _)| at_lu)
        };
        self.places_lu = growing(before_lu).collect();
        let from_end: Vec<f64> = growing(after_lu).map(|at_lu| length_lu - at_lu).collect();
        self.places_lu.extend(from_end.into_iter().rev());
    }
}
