//! What happens where two blocks meet.
//!
//! In: the two blocks and the machine's `[smoothing]`. Out: [`Junction`]: pass, stop, or a blend with its T and epsilon. The path
//! mode of the block that ends in the corner decides:
//!
//! | mode | where | how far | curve |
//! |---|---|---|---|
//! | G64 | nowhere | | |
//! | G641 | corners | ADIS or ADISPOS of both blocks | as G642 |
//! | G642 | corners | beta times CTOL, no axis further than its ATOL | models/local-smoothing.md section 1 [Essid 2019] |
//! | G643 | corners | every axis over its own range, as its ATOL or CTOL allows | polynomials, one range an axis |
//! | G644 | corners | until the axes can pass at the feed (`dynamics`), as far as the machine's axis tolerance allows; CTOL and ATOL do not count | one polynomial |
//! | G645 | as G642, and tangential joints with a step of curvature | there: `transition_tolerance_mm` | as G642; a polynomial |
//!
//! With `shape = "quintic"` the blend of G641, G642 and G645 between lines is one without a step of curvature, and rotary axes go along
//! with it; `models/local-smoothing.md` section 1 has the published one. Where an arc or another curve takes part (with the published
//! shape also a rotary axis), a polynomial takes its place; rotary axes keep OTOL. G643 has one range for all axes there. A blend never takes more than half of a block. Between two rapids G642, G643 and
//! G645 have their tolerances times STOLF; next to one rapid they do not.
//!
//! Does not cut the blocks: that is the smoother's.

use super::Corner;
use super::dynamics::Dynamics;
use super::transition::{Pair, Tolerances, Transition, common, enough, per_axis};
use crate::base::{AxisVector, PartPoint, PerAxis};
use crate::geometry::{Curve, CurveState, DISPLACEMENT_MIN_LU, HermiteBlend, Line, QuinticShape};
use crate::interpreter::{Feed, Modes};
use crate::machine::{BlendShape, Machine, PathMode, SmoothingSettings};
use std::sync::Arc;

/// Turning angles below this are rounding of programmed points: no blend and no `corners` entry.
pub(super) const CORNER_ANGLE_MIN_RAD: f64 = 1e-3;

/// cos(theta/2) below which the path stops in the corner (turning angles above 178.85 deg). The smallest radius of the blend is
/// 0.6 cos² T / sin: here 6e-5 T, a few nanometres for a usual T, so that the blend cannot be told from the cusp into which it
/// degenerates, and crossing it at the speed that its curvature allows lasts longer than the stop.
const REVERSAL_COS_MIN: f64 = 0.01;

/// cos(theta/2) below which a polynomial that carries rotary axes is compared with a stop (turning angles above 139 deg).
const SHARP_COS_MAX: f64 = 0.35;

/// Direction cosines below this are rounding of coordinates: such an axis neither moves nor reverses.
const DIRECTION_MIN_RATIO: f64 = 1e-9;

/// Steps of curvature below this are none: a radius of a kilometre beside a line.
const CURVATURE_STEP_MIN_PER_MM: f64 = 1e-6;

/// The same as share of the greater curvature: rounding of a fitted curve.
const CURVATURE_STEP_MIN_RATIO: f64 = 1e-6;

/// One of the two blocks at a junction.
pub(super) struct Side<'a> {
    /// The whole block as programmed.
    pub curve: &'a Curve,
    /// Taken from its start already.
    pub head_lu: f64,
    pub feed: &'a Feed,
    pub modes: &'a Modes,
}

/// What happens where two blocks meet.
// Lives on the stack for one call: a box would buy an allocation a corner.
#[allow(clippy::large_enum_variant)]
pub(super) enum Junction {
    /// Continuous path, geometry unchanged.
    Pass,
    /// As `Pass`, but the program asked for a blend, and there is no curve that keeps the tolerance.
    Unrounded,
    /// The path rests here.
    Stop,
    /// A blend takes the place of both blocks' ends.
    Blend(Curve, Corner),
}

/// The rules for junctions of one machine.
#[derive(Clone, Debug)]
pub(super) struct Rules {
    settings: SmoothingSettings,
    linear: PerAxis<bool>,
    machine: Arc<Machine>,
}

impl Rules {
    pub(super) fn new(machine: &Machine) -> Self {
        let (settings, linear) = (machine.smoothing.clone(), machine.linear_mask());
        Self { settings, linear, machine: Arc::new(machine.clone()) }
    }

    /// Axes whose travel counts as path length.
    pub(super) fn linear(&self) -> &PerAxis<bool> {
        &self.linear
    }

    /// The junction between two blocks. `free_lu` is what is left of the first one behind a blend at its own start.
    pub(super) fn junction(&self, before: &Side<'_>, after: &Side<'_>, free_lu: f64) -> Junction {
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
        let (u, v) = (before.curve.at(f64::INFINITY), after.curve.at(0.0));
        let angle_rad = turning_angle(&u.first, &v.first);
        let half_lu = 0.5 * before.curve.length_lu().min(after.curve.length_lu());
        let room = Room { half_lu, free_lu };
        // A NaN is no corner.
        let turns = angle_rad >= CORNER_ANGLE_MIN_RAD;
        if !turns {
            let lines = matches!((before.curve, after.curve), (Curve::Line(_), Curve::Line(_)));
            let apart = before.curve.end() != after.curve.start();
            if mode != PathMode::G645 || lines || apart || !steps(&u, &v) {
                return Junction::Pass;
            }
            let tolerances = self.tolerances(self.settings.transition_tolerance_mm, before.modes, 1.0);
            return self.polynomial(before, after, angle_rad, &room, &tolerances).unwrap_or(Junction::Pass);
        }
        // A tolerance or distance of 0 is G64.
        let wanted = self.wanted_lu(before, after, &u.first, &v.first) > 0.0;
        if !wanted {
            return Junction::Pass;
        }
        if self.turns_back(before.curve, &u.first, &v.first) {
            return Junction::Stop;
        }
        let lines = match (before.curve, after.curve) {
            (Curve::Line(first), Curve::Line(second)) => Some([first, second]),
            _ => None,
        };
        let linear_only = lines.filter(|lines| !lines.iter().any(|line| self.moves_rotary(line)));
        // An axis that POSA has sent elsewhere is on its way: no polynomial can follow it.
        let apart = before.curve.end() != after.curve.start();
        let joined = match (mode, lines, linear_only) {
            (PathMode::G643 | PathMode::G644, ..) | (_, _, None) if apart => Some(Junction::Pass),
            (PathMode::G643, Some(lines), _) => self.block_internal(lines, before, after, angle_rad, &room),
            (_, Some(lines), _) if self.settings.shape == BlendShape::Quintic && self.has_corner(&u, &v) => {
                self.quintic(lines, before, after, angle_rad, &room)
            }
            (PathMode::G644, ..) => self.dynamic(before, after, angle_rad, &room, [&u, &v]),
            (_, _, Some(lines)) => Some(self.published(lines, before, after, angle_rad, &room)),
            _ => self.general(before, after, angle_rad, &room, [&u.first, &v.first]),
        };
        joined.unwrap_or(Junction::Unrounded)
    }

    /// The published blend.
    fn published(
        &self,
        lines: [&Line; 2],
        before: &Side<'_>,
        after: &Side<'_>,
        angle_rad: f64,
        room: &Room,
    ) -> Junction {
        let [u, v] = lines.map(|line| line.direction().masked(&self.linear));
        let alpha = self.settings.alpha_ratio;
        let t = room.clamped(self.wanted_lu(before, after, &u, &v));
        let Some(blend) = HermiteBlend::new(lines[0].end(), &u, &v, t, alpha) else { return Junction::Pass };
        // Of the clamped T, so that the tolerance only gets smaller.
        let tolerance_mm = 0.25 * t * (4.0 - alpha) * (angle_rad / 2.0).sin();
        Junction::Blend(Curve::Blend(blend), Corner { angle_rad, tolerance_mm, transition_length_mm: t })
    }

    /// The blend without a step of curvature, rotary axes along.
    fn quintic(
        &self,
        lines: [&Line; 2],
        before: &Side<'_>,
        after: &Side<'_>,
        angle_rad: f64,
        room: &Room,
    ) -> Option<Junction> {
        let [u, v] = lines.map(Line::direction);
        let shape = QuinticShape::new(u, v, &self.linear)?;
        let within = |tolerances: &Tolerances| {
            1.0 / tolerances.share(&(*shape.inward() * shape.deviation_ratio()), &self.linear)
        };
        let wanted_lu = match before.modes.path_mode {
            PathMode::G641 => self.rounding_distance_mm(before, after),
            PathMode::G644 => {
                let [second, third] = shape.greatest_bends();
                let dynamics = Dynamics::new(&self.machine, before, after, lines.map(|line| line.at(0.0)).each_ref());
                dynamics.needed_lu(&second, &third).min(within(&self.machine_tolerances()))
            }
            _ => within(&self.contour_tolerances(before, after, [u, v])),
        };
        let t = room.clamped(wanted_lu);
        let blend = shape.blend(lines[0].end(), t)?;
        // Of the clamped T, so that the tolerance only gets smaller.
        let tolerance_mm = t * shape.deviation_ratio();
        Some(Junction::Blend(Curve::Quintic(blend), Corner { angle_rad, tolerance_mm, transition_length_mm: t }))
    }

    /// G644: as far as the axes need, as their tolerances allow.
    fn dynamic(
        &self,
        before: &Side<'_>,
        after: &Side<'_>,
        angle_rad: f64,
        room: &Room,
        ends: [&CurveState; 2],
    ) -> Option<Junction> {
        let dynamics = Dynamics::new(&self.machine, before, after, ends);
        let pair = Pair { before: before.curve, after: after.curve, linear: &self.linear };
        let room = room.up_to(enough(&pair, room.clamped(f64::INFINITY), &dynamics));
        self.polynomial(before, after, angle_rad, &room, &self.machine_tolerances())
    }

    /// G643 between lines.
    fn block_internal(
        &self,
        lines: [&Line; 2],
        before: &Side<'_>,
        after: &Side<'_>,
        angle_rad: f64,
        room: &Room,
    ) -> Option<Junction> {
        let tolerances = self.axis_tolerances(before, after);
        let t_max_lu = room.clamped(f64::INFINITY);
        let blend = per_axis(lines, t_max_lu, &tolerances, &self.linear, |t| cuts(before, after, t, room.free_lu))?;
        Some(blended(blend, angle_rad))
    }

    /// G641, G642, G643 and G645 where an arc, another curve or a rotary axis takes part.
    fn general(
        &self,
        before: &Side<'_>,
        after: &Side<'_>,
        angle_rad: f64,
        room: &Room,
        [u, v]: [&AxisVector; 2],
    ) -> Option<Junction> {
        let none = Tolerances { contour_mm: f64::INFINITY, axis_lu: PerAxis::splat(f64::INFINITY) };
        match before.modes.path_mode {
            PathMode::G641 => {
                let distance = room.up_to(self.rounding_distance_mm(before, after));
                self.polynomial(before, after, angle_rad, &distance, &none)
            }
            PathMode::G643 => {
                let tolerances = Tolerances { axis_lu: self.axis_tolerances(before, after), ..none };
                self.polynomial(before, after, angle_rad, room, &tolerances)
            }
            _ => {
                let tolerances = self.contour_tolerances(before, after, [u, v]);
                self.polynomial(before, after, angle_rad, room, &tolerances)
            }
        }
    }

    fn polynomial(
        &self,
        before: &Side<'_>,
        after: &Side<'_>,
        angle_rad: f64,
        room: &Room,
        tolerances: &Tolerances,
    ) -> Option<Junction> {
        let pair = Pair { before: before.curve, after: after.curve, linear: &self.linear };
        let t_max_lu = room.clamped(f64::INFINITY);
        let blend = common(&pair, t_max_lu, tolerances, |t| cuts(before, after, t, room.free_lu))?;
        let (u, v) = (before.curve.at(f64::INFINITY), after.curve.at(0.0));
        let [along, onward] = [u.first, v.first].map(|direction| direction.masked(&self.linear));
        // The tip almost turns back: what rotary axes have to do on the way is pressed into almost no length.
        let carries = u.first != along || v.first != onward;
        let sharp = carries && (turning_angle(&along, &onward) / 2.0).cos() < SHARP_COS_MAX;
        if sharp && Dynamics::new(&self.machine, before, after, [&u, &v]).stop_is_quicker(&blend.curve) {
            return Some(Junction::Stop);
        }
        Some(blended(blend, angle_rad))
    }

    /// T of the published blend before it is cut to the room that there is; 0 where nothing is to be rounded.
    fn wanted_lu(&self, before: &Side<'_>, after: &Side<'_>, u: &AxisVector, v: &AxisVector) -> f64 {
        match before.modes.path_mode {
            PathMode::G641 => self.rounding_distance_mm(before, after),
            PathMode::G643 if self.contour_tolerance_mm(before, after) > 0.0 => f64::INFINITY,
            PathMode::G643 => 0.0,
            PathMode::G644 => f64::INFINITY,
            _ => {
                let [u, v] = [u.masked(&self.linear), v.masked(&self.linear)];
                let epsilon = self.beta(&u, &v) * self.contour_tolerance_mm(before, after);
                // |V - U| = 2 sin(theta/2); a straight joint gives an infinite T, and is no corner.
                let shape = 4.0 - self.settings.alpha_ratio;
                let t = 8.0 * epsilon / (shape * (v - u).norm());
                let Some(limits) = &before.modes.programmed else { return t };
                // ATOL of an axis: its share of the deviation in the middle.
                let factor = self.rapid_factor(before, after);
                let turns = (v - u).map(f64::abs);
                let alone = limits.axis_tolerance_lu.as_slice().iter().zip(turns.as_slice());
                alone.fold(t, |t, (tolerance, turn)| match tolerance {
                    Some(tolerance) => t.min(8.0 * tolerance * factor / (shape * turn)),
                    None => t,
                })
            }
        }
    }

    fn beta(&self, u: &AxisVector, v: &AxisVector) -> f64 {
        if reverses(&u.masked(&self.linear), &v.masked(&self.linear)) {
            self.settings.tolerance_reversal_ratio
        } else {
            self.settings.tolerance_ratio
        }
    }

    /// Those of G642: beta times CTOL, with ATOL of every axis and OTOL of the rotary ones.
    fn contour_tolerances(&self, before: &Side<'_>, after: &Side<'_>, [u, v]: [&AxisVector; 2]) -> Tolerances {
        let contour_mm = self.beta(u, v) * self.contour_tolerance_mm(before, after);
        self.tolerances(contour_mm, before.modes, self.rapid_factor(before, after))
    }

    fn contour_tolerance_mm(&self, before: &Side<'_>, after: &Side<'_>) -> f64 {
        let own = before.modes.contour_tolerance_mm.unwrap_or(self.settings.contour_tolerance_mm);
        own * self.rapid_factor(before, after)
    }

    /// STOLF between two rapids.
    fn rapid_factor(&self, before: &Side<'_>, after: &Side<'_>) -> f64 {
        if !(*before.feed == Feed::Rapid && *after.feed == Feed::Rapid) {
            return 1.0;
        }
        let programmed = before.modes.programmed.as_ref().and_then(|limits| limits.rapid_tolerance_ratio);
        programmed.unwrap_or(self.settings.rapid_tolerance_ratio)
    }

    /// A contour tolerance, with ATOL of every axis and OTOL of the rotary ones.
    fn tolerances(&self, contour_mm: f64, modes: &Modes, factor: f64) -> Tolerances {
        let limits = modes.programmed.as_deref();
        let rotary_rad = limits.and_then(|limits| limits.orientation_tolerance_rad);
        let rotary_rad = rotary_rad.unwrap_or(self.settings.orientation_tolerance_rad);
        let axis_lu = PerAxis::from_fn(|axis| match limits.and_then(|limits| limits.axis_tolerance_lu[axis]) {
            Some(tolerance_lu) => tolerance_lu * factor,
            None if self.linear[axis] => f64::INFINITY,
            None => rotary_rad * factor,
        });
        Tolerances { contour_mm, axis_lu }
    }

    /// Tolerances of the compressor.
    pub(super) fn own_tolerances(&self, modes: &Modes) -> Tolerances {
        let contour_mm = modes.contour_tolerance_mm.unwrap_or(self.settings.contour_tolerance_mm);
        self.tolerances(contour_mm, modes, 1.0)
    }

    /// MD20170.
    pub(super) fn compressor_length_max_mm(&self) -> f64 {
        self.settings.compressor_length_max_mm
    }

    /// SD42470.
    pub(super) fn compressor_corner_rad(&self) -> f64 {
        self.settings.compressor_corner_rad
    }

    /// Of every axis alone: ATOL, else CTOL or OTOL.
    fn axis_tolerances(&self, before: &Side<'_>, after: &Side<'_>) -> PerAxis<f64> {
        let contour_mm = self.contour_tolerance_mm(before, after);
        let own = |tolerance_lu: f64| if tolerance_lu.is_finite() { tolerance_lu } else { contour_mm };
        self.tolerances(contour_mm, before.modes, self.rapid_factor(before, after)).axis_lu.map(own)
    }

    /// Those of the machine, of every axis alone.
    fn machine_tolerances(&self) -> Tolerances {
        let settings = &self.settings;
        let own = |linear: bool| {
            if linear { settings.contour_tolerance_mm } else { settings.orientation_tolerance_rad }
        };
        Tolerances { contour_mm: f64::INFINITY, axis_lu: self.linear.map(own) }
    }

    /// ADISPOS between two rapids, else ADIS. A block's modes carry the one that is its own: next to one rapid, ADIS stands in
    /// the other block.
    fn rounding_distance_mm(&self, before: &Side<'_>, after: &Side<'_>) -> f64 {
        let modes = if *before.feed == Feed::Rapid && *after.feed != Feed::Rapid { after.modes } else { before.modes };
        modes.rounding_distance_mm.or(self.settings.rounding_distance_mm).unwrap_or(0.0)
    }

    /// The axes that count as path length turn back.
    fn turns_back(&self, curve: &Curve, u: &AxisVector, v: &AxisVector) -> bool {
        let counted = if curve.rotary_only() { self.linear.map(|is| !is) } else { self.linear };
        let angle_rad = turning_angle(&u.masked(&counted), &v.masked(&counted));
        (angle_rad / 2.0).cos() < REVERSAL_COS_MIN
    }

    /// The linear axes have a corner.
    fn has_corner(&self, u: &CurveState, v: &CurveState) -> bool {
        turning_angle(&u.first.masked(&self.linear), &v.first.masked(&self.linear)) >= CORNER_ANGLE_MIN_RAD
    }

    fn moves_rotary(&self, line: &Line) -> bool {
        let (start, end) = (line.start().0, line.end().0);
        start.masked(&self.linear.map(|is| !is)) != end.masked(&self.linear.map(|is| !is))
    }
}

/// What a blend may take of the blocks.
struct Room {
    /// Half of the shorter block.
    half_lu: f64,
    /// What is left of the first block.
    free_lu: f64,
}

impl Room {
    /// A wanted T, cut to the blocks.
    fn clamped(&self, wanted_lu: f64) -> f64 {
        let t = wanted_lu.min(self.half_lu).min(self.free_lu);
        // Blocks of equal length lose both halves but for a rounding error: no curve may be left that is shorter than any motion.
        if self.free_lu - t < DISPLACEMENT_MIN_LU { self.free_lu } else { t }
    }

    fn up_to(&self, wanted_lu: f64) -> Self {
        Self { half_lu: self.half_lu.min(wanted_lu), ..*self }
    }
}

/// Where the blocks are cut, to the last bit of the parts that are left.
fn cuts(before: &Side<'_>, after: &Side<'_>, t_lu: f64, free_lu: f64) -> [PartPoint; 2] {
    let length_lu = before.curve.length_lu();
    let start = match before.curve {
        // The blends take the whole block: this one begins where the last one ended.
        curve if free_lu - t_lu <= 0.0 => {
            if let Curve::Line(line) = curve {
                line.shortened(before.head_lu, 0.0).start()
            } else {
                curve.trimmed(before.head_lu, length_lu).start()
            }
        }
        Curve::Line(line) => line.shortened(0.0, t_lu).end(),
        curve => curve.trimmed(0.0, length_lu - t_lu).end(),
    };
    let end = match after.curve {
        Curve::Line(line) => line.shortened(t_lu, 0.0).start(),
        curve => curve.trimmed(t_lu, curve.length_lu()).start(),
    };
    [start, end]
}

fn blended(blend: Transition, angle_rad: f64) -> Junction {
    let Transition { curve, length_lu, deviation_mm } = blend;
    Junction::Blend(curve, Corner { angle_rad, tolerance_mm: deviation_mm, transition_length_mm: length_lu })
}

/// Angle between two directions of any length: 2 atan2(|V - U|, |V + U|), exact near 0 and near 180 deg.
fn turning_angle(incoming: &AxisVector, outgoing: &AxisVector) -> f64 {
    let u = *incoming * (1.0 / incoming.norm());
    let v = *outgoing * (1.0 / outgoing.norm());
    2.0 * (v - u).norm().atan2((v + u).norm())
}

/// The curvature, or the second derivative of a rotary axis, is another one.
fn steps(end: &CurveState, start: &CurveState) -> bool {
    let bend = end.second.norm().max(start.second.norm());
    (start.second - end.second).norm() > CURVATURE_STEP_MIN_PER_MM.max(CURVATURE_STEP_MIN_RATIO * bend)
}

/// Some axis changes its sense; one that starts or stops moving does not count.
fn reverses(incoming: &AxisVector, outgoing: &AxisVector) -> bool {
    let moves = |ratio: f64| ratio.abs() > DIRECTION_MIN_RATIO;
    incoming.as_slice().iter().zip(outgoing.as_slice()).any(|(u, v)| moves(*u) && moves(*v) && u.signum() != v.signum())
}
