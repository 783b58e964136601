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
//! G645 have their tolerances times STOLF; next to one rapid they do not. Where the compressor has moved a block, a blend has what is left
//! of the tolerance.
//!
//! Threads are not rounded: the path rests before and after them, and goes on where one G33 follows another.
//!
//! Does not cut the blocks: that is the smoother's.

use super::Corner;
use super::dynamics::Dynamics;
use super::transition::{Pair, Tolerances, common, enough, per_axis};
use crate::base::Portable;
use crate::base::{AxisVector, PartPoint, PerAxis};
use crate::geometry::{Curve, CurveState, DISPLACEMENT_MIN_LU, HermiteBlend, Line, QuinticShape};
use crate::interpreter::{Feed, Modes, ThreadCoupling};
use crate::machine::{BlendShape, Machine, PathMode, SmoothingSettings};
use std::sync::Arc;

/// Turning angles of the linear axes (where only rotary axes move, theirs) below this are rounding of programmed points: no blend and
/// no `corners` entry.
pub(super) const CORNER_ANGLE_MIN_RAD: f64 = 1e-3;

/// Steps of dq/ds of a rotary axis that goes along, times the length of the shorter block: up to this they are rounding of programmed points. Points of a
/// straight line, rounded to 0.001 deg, make steps of 0.002 deg; the rest is for lengths that are rounded as well. A slope is no angle:
/// how much of a turn it makes would hang on 1 rad and 1 mm being alike.
const ROTARY_ROUNDING_RAD: f64 = 3e-3 * std::f64::consts::PI / 180.0;

/// cos(theta/2) below which the path stops in the corner (turning angles above 178.85 deg); of polynomials, which may have a cusp at other angles, their
/// slowest place. The smallest radius of the blend is
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

/// Where the compressor has left less than this share of the tolerances in half of a block the blend takes less of it, down to the last of these: at its ends a
/// compressed block is where it was programmed.
const LEFT_SHARE_MIN: f64 = 0.1;
const REACH_RATIOS: [f64; 4] = [1.0, 0.25, 0.0625, 0.015625];

/// Places at which what the compressor moved is looked at, over the part of a block that a blend may take; and what is kept for
/// what they miss between them.
const MOVED_SAMPLES: usize = 8;
const MOVED_RESERVE_RATIO: f64 = 1.05;

/// A thread that is cut on without a new start angle.
fn goes_on(before: &Modes, after: &Modes) -> bool {
    let cuts = before.thread.as_ref().is_some_and(|thread| thread.is_cut());
    let on = ThreadCoupling::Cut { start_angle_rad: None };
    cuts && after.thread.as_ref().is_some_and(|thread| thread.coupling == on)
}

/// One of the two blocks at a junction.
pub(super) struct Side<'a> {
    /// The whole block.
    pub curve: &'a Curve,
    /// What the program says, where the compressor made the curve of it.
    pub programmed: Option<&'a Curve>,
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
        if before.modes.thread.is_some() || after.modes.thread.is_some() {
            return if goes_on(before.modes, after.modes) { Junction::Pass } else { Junction::Stop };
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
        let mut joint = Joint { before, after, ends: [&u, &v], angle_rad, room, left_share: 1.0 };
        let shorter_lu = 2.0 * half_lu;
        let turns = is_corner([&u.first, &v.first], before.curve.rotary_only(), shorter_lu, &self.linear);
        if !turns && mode != PathMode::G645 {
            return Junction::Pass;
        }
        for reach_ratio in REACH_RATIOS {
            let reach_lu = reach_ratio * half_lu;
            let moved_share = self.moved_share(before, reach_lu, true).max(self.moved_share(after, reach_lu, false));
            (joint.room.half_lu, joint.left_share) = (reach_lu, 1.0 - moved_share);
            if joint.left_share >= LEFT_SHARE_MIN {
                break;
            }
        }
        if turns { self.corner(&joint) } else { self.tangential(&joint) }
    }

    /// G645 where the direction goes on.
    fn tangential(&self, joint: &Joint<'_>) -> Junction {
        let (before, after, [u, v]) = (joint.before, joint.after, joint.ends);
        let lines = matches!((before.curve, after.curve), (Curve::Line(_), Curve::Line(_)));
        let apart = before.curve.end() != after.curve.start();
        if lines || apart || !steps(u, v) {
            return Junction::Pass;
        }
        let contour_mm = self.settings.transition_tolerance_mm * joint.left_share;
        let tolerances = self.tolerances(contour_mm, before.modes, joint.left_share);
        self.polynomial(joint, &joint.room, &tolerances).unwrap_or(Junction::Pass)
    }

    fn corner(&self, joint: &Joint<'_>) -> Junction {
        let (before, after, [u, v]) = (joint.before, joint.after, joint.ends);
        // A tolerance or distance of 0 is G64; of a tolerance it is said. A NaN is 0 by 0: no turn, and no tolerance for it.
        let wanted = self.wanted_lu(joint, &u.first, &v.first) > 0.0;
        if !wanted {
            let by_distance = before.modes.path_mode == PathMode::G641;
            return if by_distance { Junction::Pass } else { Junction::Unrounded };
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
        let joined = match (before.modes.path_mode, lines, linear_only) {
            (PathMode::G643 | PathMode::G644, ..) | (_, _, None) if apart => Some(Junction::Pass),
            (PathMode::G643, Some(lines), _) => self.block_internal(lines, joint),
            (_, Some(lines), _) if self.settings.shape == BlendShape::Quintic && self.has_corner(u, v) => {
                self.quintic(lines, joint)
            }
            (PathMode::G644, ..) => self.dynamic(joint),
            (_, _, Some(lines)) => Some(self.published(lines, joint)),
            _ => self.general(joint),
        };
        joined.unwrap_or(Junction::Unrounded)
    }

    /// Share of the tolerances that the compressor has used within `reach_lu` of an end of a block.
    fn moved_share(&self, side: &Side<'_>, reach_lu: f64, at_end: bool) -> f64 {
        let Some(programmed) = side.programmed else { return 0.0 };
        let tolerances = self.own_tolerances(side.modes, side.feed);
        let (length_lu, programmed_lu) = (side.curve.length_lu(), programmed.length_lu());
        let shares = (0..=MOVED_SAMPLES).map(|i| {
            let inside_ratio = reach_lu / length_lu * i as f64 / MOVED_SAMPLES as f64;
            let ratio = if at_end { 1.0 - inside_ratio } else { inside_ratio };
            let [moved, asked] = [side.curve.at(ratio * length_lu), programmed.at(ratio * programmed_lu)];
            tolerances.share(&(moved.position.0 - asked.position.0), &self.linear)
        });
        (shares.fold(0.0, f64::max) * MOVED_RESERVE_RATIO).min(1.0)
    }

    /// The published blend.
    fn published(&self, lines: [&Line; 2], joint: &Joint<'_>) -> Junction {
        let [u, v] = lines.map(|line| line.direction().masked(&self.linear));
        let alpha = self.settings.alpha_ratio;
        let t = joint.room.clamped(self.wanted_lu(joint, &u, &v));
        let Some(blend) = HermiteBlend::new(lines[0].end(), &u, &v, t, alpha) else { return Junction::Pass };
        // Of the clamped T, so that the tolerance only gets smaller.
        let tolerance_mm = 0.25 * t * (4.0 - alpha) * (joint.angle_rad / 2.0).portable_sin();
        joint.blended(Curve::from(blend), tolerance_mm, t)
    }

    /// The blend without a step of curvature, rotary axes along.
    fn quintic(&self, lines: [&Line; 2], joint: &Joint<'_>) -> Option<Junction> {
        let [u, v] = lines.map(Line::direction);
        let shape = QuinticShape::new(u, v, &self.linear)?;
        let within = |tolerances: &Tolerances| {
            1.0 / tolerances.share(&(*shape.inward() * shape.deviation_ratio()), &self.linear)
        };
        let wanted_lu = match joint.before.modes.path_mode {
            PathMode::G641 => self.rounding_distance_mm(joint),
            PathMode::G644 => {
                let [second, third] = shape.greatest_bends();
                let ends = lines.map(|line| line.at(0.0));
                let dynamics = Dynamics::new(&self.machine, joint.before, joint.after, ends.each_ref());
                dynamics.needed_lu(&second, &third).min(within(&self.machine_tolerances(joint)))
            }
            _ => within(&self.contour_tolerances(joint, [u, v])),
        };
        let t = joint.room.clamped(wanted_lu);
        let blend = shape.blend(lines[0].end(), t)?;
        // Of the clamped T, so that the tolerance only gets smaller.
        Some(joint.blended(Curve::from(blend), t * shape.deviation_ratio(), t))
    }

    /// G644: as far as the axes need, as their tolerances allow.
    fn dynamic(&self, joint: &Joint<'_>) -> Option<Junction> {
        let dynamics = Dynamics::new(&self.machine, joint.before, joint.after, joint.ends);
        let pair = Pair { before: joint.before.curve, after: joint.after.curve, linear: &self.linear };
        let room = joint.room.up_to(enough(&pair, joint.room.clamped(f64::INFINITY), &dynamics));
        self.polynomial(joint, &room, &self.machine_tolerances(joint))
    }

    /// G643 between lines.
    fn block_internal(&self, lines: [&Line; 2], joint: &Joint<'_>) -> Option<Junction> {
        let tolerances = self.axis_tolerances(joint);
        let t_max_lu = joint.room.clamped(f64::INFINITY);
        let blend = per_axis(lines, t_max_lu, &tolerances, &self.linear, |t| joint.cuts(t))?;
        Some(joint.blended(blend.curve, blend.deviation_mm, blend.length_lu))
    }

    /// G641, G642, G643 and G645 where an arc, another curve or a rotary axis takes part.
    fn general(&self, joint: &Joint<'_>) -> Option<Junction> {
        let none = Tolerances { contour_mm: f64::INFINITY, axis_lu: PerAxis::splat(f64::INFINITY) };
        match joint.before.modes.path_mode {
            PathMode::G641 => {
                let distance = joint.room.up_to(self.rounding_distance_mm(joint));
                self.polynomial(joint, &distance, &none)
            }
            PathMode::G643 => {
                let tolerances = Tolerances { axis_lu: self.axis_tolerances(joint), ..none };
                self.polynomial(joint, &joint.room, &tolerances)
            }
            _ => {
                let tolerances = self.contour_tolerances(joint, joint.ends.map(|state| &state.first));
                self.polynomial(joint, &joint.room, &tolerances)
            }
        }
    }

    fn polynomial(&self, joint: &Joint<'_>, room: &Room, tolerances: &Tolerances) -> Option<Junction> {
        let pair = Pair { before: joint.before.curve, after: joint.after.curve, linear: &self.linear };
        let blend = common(&pair, room.clamped(f64::INFINITY), tolerances, |t| joint.cuts(t))?;
        // Curves may turn back further on even where they do not in the corner.
        if pair.slowest_ratio(blend.length_lu) < REVERSAL_COS_MIN {
            return Some(Junction::Stop);
        }
        let [u, v] = joint.ends;
        let [along, onward] = [u.first, v.first].map(|direction| direction.masked(&self.linear));
        // The tip almost turns back: what rotary axes have to do on the way is pressed into almost no length.
        let carries = u.first != along || v.first != onward;
        let sharp = carries && (turning_angle(&along, &onward) / 2.0).portable_cos() < SHARP_COS_MAX;
        if sharp && Dynamics::new(&self.machine, joint.before, joint.after, joint.ends).stop_is_quicker(&blend.curve) {
            return Some(Junction::Stop);
        }
        Some(joint.blended(blend.curve, blend.deviation_mm, blend.length_lu))
    }

    /// T of the published blend before it is cut to the room that there is; 0 where nothing is to be rounded.
    fn wanted_lu(&self, joint: &Joint<'_>, u: &AxisVector, v: &AxisVector) -> f64 {
        let modes = joint.before.modes;
        match modes.path_mode {
            PathMode::G641 => self.rounding_distance_mm(joint),
            PathMode::G643 if self.contour_tolerance_mm(joint) > 0.0 => f64::INFINITY,
            PathMode::G643 => 0.0,
            PathMode::G644 => f64::INFINITY,
            _ => {
                let [u, v] = [u.masked(&self.linear), v.masked(&self.linear)];
                let epsilon = self.beta(&u, &v).min(joint.left_share) * self.contour_tolerance_mm(joint);
                // |V - U| = 2 sin(theta/2); a straight joint gives an infinite T, and is no corner.
                let shape = 4.0 - self.settings.alpha_ratio;
                let t = 8.0 * epsilon / (shape * (v - u).norm());
                let Some(limits) = &modes.programmed else { return t };
                // ATOL of an axis: its share of the deviation in the middle.
                let factor = self.rapid_factor(joint) * joint.left_share;
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
    fn contour_tolerances(&self, joint: &Joint<'_>, [u, v]: [&AxisVector; 2]) -> Tolerances {
        let contour_mm = self.beta(u, v).min(joint.left_share) * self.contour_tolerance_mm(joint);
        self.tolerances(contour_mm, joint.before.modes, self.rapid_factor(joint) * joint.left_share)
    }

    fn contour_tolerance_mm(&self, joint: &Joint<'_>) -> f64 {
        let own = joint.before.modes.contour_tolerance_mm.unwrap_or(self.settings.contour_tolerance_mm);
        own * self.rapid_factor(joint)
    }

    /// STOLF between two rapids.
    fn rapid_factor(&self, joint: &Joint<'_>) -> f64 {
        let rapids = *joint.before.feed == Feed::Rapid && *joint.after.feed == Feed::Rapid;
        if rapids { self.rapid_tolerance_ratio(joint.before.modes) } else { 1.0 }
    }

    fn rapid_tolerance_ratio(&self, modes: &Modes) -> f64 {
        let programmed = modes.programmed.as_ref().and_then(|limits| limits.rapid_tolerance_ratio);
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

    /// Tolerances of the compressor; of rapids times STOLF.
    pub(super) fn own_tolerances(&self, modes: &Modes, feed: &Feed) -> Tolerances {
        let factor = if *feed == Feed::Rapid { self.rapid_tolerance_ratio(modes) } else { 1.0 };
        let contour_mm = modes.contour_tolerance_mm.unwrap_or(self.settings.contour_tolerance_mm);
        self.tolerances(contour_mm * factor, modes, factor)
    }

    pub(super) fn settings(&self) -> &SmoothingSettings {
        &self.settings
    }

    /// Of every axis alone: ATOL, else CTOL or OTOL.
    fn axis_tolerances(&self, joint: &Joint<'_>) -> PerAxis<f64> {
        let contour_mm = self.contour_tolerance_mm(joint) * joint.left_share;
        let own = |tolerance_lu: f64| if tolerance_lu.is_finite() { tolerance_lu } else { contour_mm };
        let factor = self.rapid_factor(joint) * joint.left_share;
        self.tolerances(contour_mm, joint.before.modes, factor).axis_lu.map(own)
    }

    /// Those of the machine, of every axis alone.
    fn machine_tolerances(&self, joint: &Joint<'_>) -> Tolerances {
        let settings = &self.settings;
        let own = |linear: bool| {
            let own_lu = if linear { settings.contour_tolerance_mm } else { settings.orientation_tolerance_rad };
            own_lu * joint.left_share
        };
        Tolerances { contour_mm: f64::INFINITY, axis_lu: self.linear.map(own) }
    }

    /// ADISPOS between two rapids, else ADIS. A block's modes carry the one that is its own: next to one rapid, ADIS stands in
    /// the other block.
    fn rounding_distance_mm(&self, joint: &Joint<'_>) -> f64 {
        let (before, after) = (joint.before, joint.after);
        let modes = if *before.feed == Feed::Rapid && *after.feed != Feed::Rapid { after.modes } else { before.modes };
        modes.rounding_distance_mm.or(self.settings.rounding_distance_mm).unwrap_or(0.0)
    }

    /// The axes that count as path length turn back.
    fn turns_back(&self, curve: &Curve, u: &AxisVector, v: &AxisVector) -> bool {
        let counted = if curve.rotary_only() { self.linear.map(|is| !is) } else { self.linear };
        let angle_rad = turning_angle(&u.masked(&counted), &v.masked(&counted));
        (angle_rad / 2.0).portable_cos() < REVERSAL_COS_MIN
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

/// A place where two blocks meet.
struct Joint<'a> {
    before: &'a Side<'a>,
    after: &'a Side<'a>,
    /// The end of the first block, the start of the second one.
    ends: [&'a CurveState; 2],
    /// The path turns by so much.
    angle_rad: f64,
    room: Room,
    /// Share of the tolerances that the compressor has left.
    left_share: f64,
}

impl Joint<'_> {
    fn blended(&self, curve: Curve, tolerance_mm: f64, transition_length_mm: f64) -> Junction {
        Junction::Blend(curve, Corner { angle_rad: self.angle_rad, tolerance_mm, transition_length_mm })
    }

    /// Where the blocks are cut, to the last bit of the parts that are left.
    fn cuts(&self, t_lu: f64) -> [PartPoint; 2] {
        let length_lu = self.before.curve.length_lu();
        let start = match self.before.curve {
            // The blends take the whole block: this one begins where the last one ended.
            curve if self.room.free_lu - t_lu <= 0.0 => {
                if let Curve::Line(line) = curve {
                    line.shortened(self.before.head_lu, 0.0).start()
                } else {
                    curve.trimmed(self.before.head_lu, length_lu).start()
                }
            }
            Curve::Line(line) => line.shortened(0.0, t_lu).end(),
            curve => curve.trimmed(0.0, length_lu - t_lu).end(),
        };
        let end = match self.after.curve {
            Curve::Line(line) => line.shortened(t_lu, 0.0).start(),
            curve => curve.trimmed(t_lu, curve.length_lu()).start(),
        };
        [start, end]
    }
}

/// The path has a corner between two directions, where the shorter of the two curves is that long. The same in both senses.
pub(super) fn is_corner([u, v]: [&AxisVector; 2], rotary_only: bool, shorter_lu: f64, linear: &PerAxis<bool>) -> bool {
    let rotary = linear.map(|is| !is);
    let counted = if rotary_only { &rotary } else { linear };
    // A NaN is no corner.
    if turning_angle(&u.masked(counted), &v.masked(counted)) >= CORNER_ANGLE_MIN_RAD {
        return true;
    }
    let along = (*v - *u).masked(&rotary);
    !rotary_only && along.as_slice().iter().any(|step| step.abs() * shorter_lu > ROTARY_ROUNDING_RAD)
}

/// Angle between two directions of any length: 2 atan2(|V - U|, |V + U|), exact near 0 and near 180 deg.
fn turning_angle(incoming: &AxisVector, outgoing: &AxisVector) -> f64 {
    let u = *incoming * (1.0 / incoming.norm());
    let v = *outgoing * (1.0 / outgoing.norm());
    2.0 * (v - u).norm().portable_atan2((v + u).norm())
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
