//! What happens where two blocks meet.
//!
//! In: the two blocks and the machine's `[smoothing]`. Out: [`Junction`]: pass, stop, or a blend with its T and epsilon
//! (models/local-smoothing.md section 1) [Essid 2019]. The path mode of the block that ends in the corner decides.
//!
//! G642 rounds within the contour tolerance. G641 rounds with the same curve, which begins at most the rounding distance before
//! the corner: the control does not specify the shape there. G643, G644 and G645 round as G642 until they have shapes of their own.
//!
//! Does not cut the blocks: that is the smoother's.

use super::Corner;
use crate::base::{AxisVector, PerAxis};
use crate::geometry::{Curve, DISPLACEMENT_MIN_LU, HermiteBlend, Line};
use crate::interpreter::{Feed, Modes};
use crate::machine::{Machine, PathMode, SmoothingSettings};

/// Turning angles below this are rounding of programmed points: no blend and no `corners` entry.
pub(super) const CORNER_ANGLE_MIN_RAD: f64 = 1e-3;

/// cos(theta/2) below which the path stops in the corner (turning angles above 178.85 deg). The smallest radius of the blend is
/// 0.6 cos² T / sin: here 6e-5 T, a few nanometres for a usual T, so that the blend cannot be told from the cusp into which it
/// degenerates, and crossing it at the speed that its curvature allows lasts longer than the stop.
const REVERSAL_COS_MIN: f64 = 0.01;

/// Direction cosines below this are rounding of coordinates: such an axis neither moves nor reverses.
const DIRECTION_MIN_RATIO: f64 = 1e-9;

/// One of the two blocks at a junction.
pub(super) struct Side<'a> {
    /// The whole block as programmed.
    pub curve: &'a Curve,
    pub feed: &'a Feed,
    pub modes: &'a Modes,
}

/// What happens where two blocks meet.
// Lives on the stack for one call: a box would buy an allocation a corner.
#[allow(clippy::large_enum_variant)]
pub(super) enum Junction {
    /// Continuous path, geometry unchanged.
    Pass,
    /// As `Pass`, but the program asked for a blend.
    Unrounded(Reason),
    /// The path rests here.
    Stop,
    /// A blend takes the place of both blocks' ends.
    Blend(HermiteBlend, Corner),
}

/// Why a corner is not rounded although the program asks for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reason {
    /// One of the blocks is an arc.
    Arc,
    /// One of the blocks is a spline or a polynomial.
    Polynomial,
    /// One of the blocks moves a rotary axis.
    Rotary,
}

/// The rules for junctions of one machine.
#[derive(Clone, Debug)]
pub(super) struct Rules {
    settings: SmoothingSettings,
    linear: PerAxis<bool>,
}

impl Rules {
    pub(super) fn new(machine: &Machine) -> Self {
        Self { settings: machine.smoothing.clone(), linear: machine.linear_mask() }
    }

    /// Axes whose travel counts as path length.
    pub(super) fn linear(&self) -> &PerAxis<bool> {
        &self.linear
    }

    /// The junction between two blocks. `free_mm` is what is left of the first one behind a blend at its own start.
    pub(super) fn junction(&self, before: &Side<'_>, after: &Side<'_>, free_mm: f64) -> Junction {
        let mode = before.modes.path_mode;
        // The path parameter changes from mm to rad or back: no speed is common to both blocks but 0.
        let unit_changes = before.curve.rotary_only() != after.curve.rotary_only();
        if mode == PathMode::ExactStop || unit_changes {
            return Junction::Stop;
        }
        // What has no length has no corner either: such a block goes on whole, and feed refuses it.
        let measurable = before.curve.length_lu().is_finite() && after.curve.length_lu().is_finite();
        if mode == PathMode::G64 || !measurable {
            return Junction::Pass;
        }
        let wanted_mm = self.wanted_mm(before, after);
        let angle_rad = turning_angle(&before.curve.at(f64::INFINITY).first, &after.curve.at(0.0).first);
        // A tolerance or distance of 0 is G64. A NaN is no corner.
        if !(wanted_mm > 0.0 && angle_rad >= CORNER_ANGLE_MIN_RAD) {
            return Junction::Pass;
        }
        let (Curve::Line(first), Curve::Line(second)) = (before.curve, after.curve) else {
            let polynomial = |side: &Side<'_>| matches!(side.curve, Curve::Polynomial(_));
            let reason = if polynomial(before) || polynomial(after) { Reason::Polynomial } else { Reason::Arc };
            return Junction::Unrounded(reason);
        };
        if self.moves_rotary(first) || self.moves_rotary(second) {
            return Junction::Unrounded(Reason::Rotary);
        }
        if (angle_rad / 2.0).cos() < REVERSAL_COS_MIN {
            return Junction::Stop;
        }
        let half_mm = 0.5 * first.length_lu().min(second.length_lu());
        let mut t = wanted_mm.min(half_mm).min(free_mm);
        // Blocks of equal length lose both halves but for a rounding error: no curve may be left that is shorter than any motion.
        if free_mm - t < DISPLACEMENT_MIN_LU {
            t = free_mm;
        }
        self.blend([first, second], angle_rad, t)
    }

    fn blend(&self, [first, second]: [&Line; 2], angle_rad: f64, transition_length_mm: f64) -> Junction {
        let (t, alpha) = (transition_length_mm, self.settings.alpha_ratio);
        let [u, v] = [first, second].map(|line| line.direction().masked(&self.linear));
        let Some(blend) = HermiteBlend::new(first.end(), &u, &v, t, alpha) else { return Junction::Pass };
        // Of the clamped T, so that the tolerance only gets smaller.
        let tolerance_mm = 0.25 * t * (4.0 - alpha) * (angle_rad / 2.0).sin();
        Junction::Blend(blend, Corner { angle_rad, tolerance_mm, transition_length_mm: t })
    }

    /// T before clamping.
    fn wanted_mm(&self, before: &Side<'_>, after: &Side<'_>) -> f64 {
        if before.modes.path_mode == PathMode::G641 {
            return self.rounding_distance_mm(before, after);
        }
        let [u, v] =
            [before.curve.at(f64::INFINITY).first, after.curve.at(0.0).first].map(|first| first.masked(&self.linear));
        let beta =
            if reverses(&u, &v) { self.settings.tolerance_reversal_ratio } else { self.settings.tolerance_ratio };
        let epsilon = beta * self.contour_tolerance_mm(before);
        // |V - U| = 2 sin(theta/2); a straight joint gives an infinite T, and is no corner.
        8.0 * epsilon / ((4.0 - self.settings.alpha_ratio) * (v - u).norm())
    }

    fn contour_tolerance_mm(&self, before: &Side<'_>) -> f64 {
        before.modes.contour_tolerance_mm.unwrap_or(self.settings.contour_tolerance_mm)
    }

    /// ADISPOS between two rapids, else ADIS. A block's modes carry the one that is its own: next to one rapid, ADIS stands in
    /// the other block.
    fn rounding_distance_mm(&self, before: &Side<'_>, after: &Side<'_>) -> f64 {
        let modes = if *before.feed == Feed::Rapid && *after.feed != Feed::Rapid { after.modes } else { before.modes };
        modes.rounding_distance_mm.or(self.settings.rounding_distance_mm).unwrap_or(0.0)
    }

    fn moves_rotary(&self, line: &Line) -> bool {
        let (start, end) = (line.start().0, line.end().0);
        start.masked(&self.linear.map(|is| !is)) != end.masked(&self.linear.map(|is| !is))
    }
}

/// Angle between two directions of any length: 2 atan2(|V - U|, |V + U|), exact near 0 and near 180 deg.
fn turning_angle(incoming: &AxisVector, outgoing: &AxisVector) -> f64 {
    let u = *incoming * (1.0 / incoming.norm());
    let v = *outgoing * (1.0 / outgoing.norm());
    2.0 * (v - u).norm().atan2((v + u).norm())
}

/// Some axis changes its sense; one that starts or stops moving does not count.
fn reverses(incoming: &AxisVector, outgoing: &AxisVector) -> bool {
    let moves = |ratio: f64| ratio.abs() > DIRECTION_MIN_RATIO;
    incoming.as_slice().iter().zip(outgoing.as_slice()).any(|(u, v)| moves(*u) && moves(*v) && u.signum() != v.signum())
}
