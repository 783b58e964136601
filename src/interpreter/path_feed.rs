//! The feed of a motion: from F, its unit, the spindle and the length of the block.
//!
//! In: modal state, start and end of a motion and its kind. Out: [`Feed`] along the path. Decisions:
//!
//! * G93 and G931 count for one block: its length over its time. The length is that of the FGROUP axes (without FGROUP: the linear
//!   axes, or the rotary ones where they move alone), so that the block lasts exactly that long where the axes allow it.
//! * G95 takes the programmed spindle speed, within G25 S and G26 S: a spindle that stands is an error, because on the control the
//!   axes would wait for it.
//! * G96: S = v / (2 pi r), with r the distance of the X axis from its zero in the basic system. Over a block F of a revolution
//!   follows the speed in [`STRETCHES`] stretches of equal length.
//! * FLIN goes from the F of the block before to that of this block, in equal steps along the path. FCUB goes between the same two with
//!   no slope at either end; the spline of the control also looks at the blocks around it. Both act with G94; with G93 the time of a
//!   block decides, and they have no effect.
//!
//! Does not limit: that is feed's.

use super::feed_state::FeedBase;
use super::modal::{Motion, ProgrammedFeed};
use super::motion::{MotionWords, rotary_alone};
use super::run::Interpreter;
use super::wire::{CuttingSpeed, Feed, MoveKind, PolynomialGeometry, PolynomialPiece};
use crate::base::Portable;
use crate::base::units::{S_PER_MIN, rad_s_from_rpm};
use crate::base::{AxisVector, PartPoint, PerAxis};
use crate::program::words::FeedShape;
use crate::program::{Fault, Outcome, codes};
use std::sync::Arc;

/// Stretches of equal feed in a block whose feed changes.
pub(super) const STRETCHES: u32 = 32;

/// Chords in which the length of a polynomial is measured.
const CHORDS: u32 = 64;

/// A motion whose feed is asked for.
#[derive(Clone, Copy)]
pub(super) struct Way<'a> {
    pub start: PartPoint,
    pub end: PartPoint,
    pub kind: &'a MoveKind,
}

impl Interpreter {
    /// Feed of a motion. Errors: no F, a spindle that stands.
    pub(super) fn feed_of(&mut self, way: Way<'_>, words: &MotionWords) -> Outcome<Feed> {
        if self.modal.motion == Motion::Rapid {
            return Ok(Feed::Rapid);
        }
        if let Some(thread) = &self.modal.thread {
            return Ok(super::thread::thread_feed(thread, self.way_length(way)));
        }
        if let Some(time_s) = words.block_time_s {
            let feed_lu_s = self.way_length(way) / time_s;
            // A block that leads nowhere takes no time either.
            return Ok(if feed_lu_s > 0.0 { Feed::Path { feed_lu_s } } else { Feed::Rapid });
        }
        let timed = matches!(self.modal.feed_modes.base, FeedBase::InverseTime | FeedBase::Time);
        let Some(feed) = words.block_feed.or(self.modal.feed).filter(|_| !timed) else {
            let (label, help) = if timed {
                ("expected F in this block", "with G93 and G931 every block with a motion has an F of its own")
            } else {
                ("expected F in this block or before it", "write F with mm/min, or G0 for a rapid")
            };
            return self.without_feed(
                Fault::new(codes::NO_FEED, words.columns(), "a feed motion, and no F has been programmed")
                    .label(label)
                    .help(help),
            );
        };
        let rotary = self.counts_angle(way);
        let pick = move |feed: ProgrammedFeed| if rotary { feed.rotary_rad_s } else { feed.linear_mm_s };
        let found = match self.modal.feed_modes.base {
            FeedBase::Revolution => match self.feed_of_revolution(way, words, pick(feed)) {
                Ok(feed) => feed,
                Err(fault) => return self.without_feed(fault),
            },
            _ => self.shaped(feed, pick, words.block_feed.is_some()),
        };
        if self.modal.feed_modes.cutting
            && let Some(speed_rpm) = self.speed_rpm_at(way, 1.0)
        {
            self.keep_speed(speed_rpm);
        }
        Ok(found)
    }

    /// Where moves are only listed, a feed that is missing is reported once, and the motion shown without one.
    fn without_feed(&mut self, fault: Box<Fault>) -> Outcome<Feed> {
        if !self.setup.lists_only {
            return Err(fault);
        }
        if self.first_report(codes::NO_FEED) {
            self.report(*fault);
        }
        Ok(Feed::Rapid)
    }

    /// Feed of the fast path: G94 with FNORM.
    pub(super) fn plain_feed(&self, start: PartPoint, end: PartPoint) -> Feed {
        let Some(feed) = self.modal.feed.filter(|_| self.modal.motion != Motion::Rapid) else { return Feed::Rapid };
        let rotary = self.counts_angle(Way { start, end, kind: &MoveKind::Line });
        Feed::Path { feed_lu_s: if rotary { feed.rotary_rad_s } else { feed.linear_mm_s } }
    }

    /// Feed of moves that stand still.
    pub(super) fn standing_feed(&self) -> Feed {
        match (self.modal.motion, self.modal.feed) {
            (Motion::Rapid, _) | (_, None) => Feed::Rapid,
            (_, Some(feed)) => Feed::Path { feed_lu_s: feed.linear_mm_s },
        }
    }

    /// F is an angle: only rotary axes move, and none that FGROUP names.
    fn counts_angle(&self, way: Way<'_>) -> bool {
        if !matches!(way.kind, MoveKind::Line | MoveKind::Rapid) {
            return false;
        }
        let grouped = self
            .feed_group()
            .is_some_and(|group| self.machine.axis_ids().any(|id| group[id] && way.start.0[id] != way.end.0[id]));
        !grouped && rotary_alone(&self.machine, way.start, way.end)
    }

    fn feed_group(&self) -> Option<PerAxis<bool>> {
        self.modal.programmed.as_ref()?.feed_group
    }

    /// G95: F times the speed of the spindle.
    fn feed_of_revolution(&self, way: Way<'_>, words: &MotionWords, feed: f64) -> Outcome<Feed> {
        let modes = &self.modal.feed_modes;
        let stands = |message: &str, help: &str| {
            Fault::new(codes::NO_FEED, words.columns(), message).label("F counts revolutions here").help(help)
        };
        if !modes.spindle_turns {
            let help =
                "write M3 or M4 before it, or G94 and F with mm/min; the control would wait here for the spindle";
            return Err(stands("F counts revolutions, and the spindle stands", help));
        }
        let speed = |share: f64| self.speed_rpm_at(way, share).filter(|speed_rpm| *speed_rpm > 0.0);
        let (Some(first_rpm), Some(last_rpm)) = (speed(0.0), speed(1.0)) else {
            return Err(stands("F counts revolutions, and no spindle speed is programmed", "write S before it"));
        };
        // From one side of the axis of rotation to the other the speed is not that of the ends.
        if first_rpm == last_rpm && speed(0.5) == Some(first_rpm) && matches!(way.kind, MoveKind::Line) {
            return Ok(Feed::Path { feed_lu_s: feed * first_rpm });
        }
        Ok(varying(|share| feed * speed(share).unwrap_or(first_rpm)))
    }

    /// Speed of the master spindle at a share of the way; `None` before the first S.
    fn speed_rpm_at(&self, way: Way<'_>, share: f64) -> Option<f64> {
        let modes = &self.modal.feed_modes;
        if !modes.cutting {
            return Some(modes.limited_rpm(self.modal.spindle_speed_rpm)).filter(|speed_rpm| *speed_rpm > 0.0);
        }
        Some(modes.cutting_rpm(modes.cutting_speed_mm_s?, self.radius_mm(way, share)))
    }

    /// Distance of the transverse axis (X) from the axis of rotation at a share of the way.
    fn radius_mm(&self, way: Way<'_>, share: f64) -> f64 {
        let Some(x) = self.geometry[0] else { return 0.0 };
        let (from, to) = (way.start.0[x], way.end.0[x]);
        match way.kind {
            MoveKind::Arc(arc) if arc.plane.contains(&x) => {
                let [a, b] = arc.plane;
                let offset = [way.start.0[a] - arc.centre_mm[0], way.start.0[b] - arc.centre_mm[1]];
                let angle_rad = offset[1].portable_atan2(offset[0]) + share * arc.sweep_rad;
                let place = if x == a { 0 } else { 1 };
                arc.centre_mm[place]
                    + arc.radius_mm * if place == 0 { angle_rad.portable_cos() } else { angle_rad.portable_sin() }
            }
            _ => from + share * (to - from),
        }
    }

    /// G96 as later rooms need it.
    pub(super) fn cutting_speed(&self) -> Option<Arc<CuttingSpeed>> {
        let modes = &self.modal.feed_modes;
        let (speed_mm_s, axis) = (modes.cutting_speed_mm_s.filter(|_| modes.cutting)?, self.geometry[0]?);
        if !modes.master_is_simulated() {
            return None;
        }
        let speed_mm_s = speed_mm_s * modes.override_ratio();
        let limits_rad_s = modes.cutting_limits_rpm().map(rad_s_from_rpm);
        Some(CuttingSpeed { speed_mm_s, axis, limits_rad_s }.into())
    }

    /// G95 as later rooms need it: the speed that F counts with.
    pub(super) fn revolution_speed(&self) -> Option<f64> {
        let modes = &self.modal.feed_modes;
        let counts = modes.base == FeedBase::Revolution && modes.master_is_simulated() && self.modal.thread.is_none();
        let speed_rpm = modes.limited_rpm(self.modal.spindle_speed_rpm);
        (counts && speed_rpm > 0.0).then(|| rad_s_from_rpm(speed_rpm))
    }

    /// Speed of the spindle where the axes stand, under G96.
    pub(super) fn cutting_rpm_here(&self) -> Option<f64> {
        self.speed_rpm_at(Way { start: self.position, end: self.position, kind: &MoveKind::Line }, 0.0)
    }

    /// FNORM, FLIN, FCUB.
    fn shaped(&mut self, feed: ProgrammedFeed, pick: impl Fn(ProgrammedFeed) -> f64, block_feed: bool) -> Feed {
        let modes = &mut self.modal.feed_modes;
        let to_lu_s = pick(feed);
        let from_lu_s = if block_feed { to_lu_s } else { modes.before.replace(feed).map_or(to_lu_s, pick) };
        let step_lu_s = to_lu_s - from_lu_s;
        match modes.shape {
            FeedShape::Linear if step_lu_s != 0.0 => varying(|share| from_lu_s + share * step_lu_s),
            FeedShape::Cubic if step_lu_s != 0.0 => {
                varying(|share| from_lu_s + share * share * (3.0 - 2.0 * share) * step_lu_s)
            }
            _ => Feed::Path { feed_lu_s: to_lu_s },
        }
    }

    /// Length over which F counts: of the FGROUP axes, else of the linear ones, else of the rotary ones.
    fn way_length(&self, way: Way<'_>) -> f64 {
        let linear = self.machine.linear_mask();
        if let Some(group) = self.feed_group() {
            let radius = |id| self.modal.programmed.as_ref().map_or(1.0, |limits| limits.reference_radius_mm[id]);
            let weight = |id| if linear[id] { 1.0 } else { radius(id) };
            let weights = PerAxis::from_fn(|id| if group[id] { weight(id) } else { 0.0 });
            let length = length_of(way, &weights);
            if length > 0.0 {
                return length;
            }
        }
        let length = length_of(way, &linear.map(|is| if is { 1.0 } else { 0.0 }));
        if length > 0.0 { length } else { length_of(way, &linear.map(|is| if is { 0.0 } else { 1.0 })) }
    }
}

/// The feed in the middle of each stretch.
fn varying(feed_lu_s: impl Fn(f64) -> f64) -> Feed {
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(STRETCHES);
    Feed::Varying { feeds_lu_s: (0..STRETCHES).map(|i| feed_lu_s(middle(i))).collect() }
}

fn weighted(vector: AxisVector, weights: &AxisVector) -> f64 {
    vector.as_slice().iter().zip(weights.as_slice()).map(|(v, w)| (v * w).powi(2)).sum::<f64>().sqrt()
}

/// Length of the way, its axes weighted.
fn length_of(way: Way<'_>, weights: &AxisVector) -> f64 {
    let straight = way.end.0 - way.start.0;
    match way.kind {
        MoveKind::Arc(arc) => {
            let [a, b] = arc.plane;
            let mut across = straight;
            (across[a], across[b]) = (0.0, 0.0);
            // An axis of the plane alone: as the path of both, which feed does not exceed.
            let turn_mm = arc.radius_mm * arc.sweep_rad * weights[a].max(weights[b]);
            turn_mm.portable_hypot(weighted(across, weights))
        }
        MoveKind::SpatialArc(arc) => {
            let [first, second] = arc.directions;
            let across = straight - first * straight.dot(&first) - second * straight.dot(&second);
            (arc.radius_mm * arc.sweep_rad).portable_hypot(weighted(across, weights))
        }
        MoveKind::Spline(geometry) | MoveKind::Polynomial(geometry) => polynomial_length(geometry, weights),
        _ => weighted(straight, weights),
    }
}

/// Sums of chords, extrapolated from two finenesses: the error of one falls with the square of the step.
fn polynomial_length(geometry: &PolynomialGeometry, weights: &AxisVector) -> f64 {
    let chords = |piece: &PolynomialPiece, count: u32| {
        let point = |i: u32| polynomial_point(piece, piece.parameter_end_ratio * f64::from(i) / f64::from(count));
        (0..count).map(|i| weighted(point(i + 1) - point(i), weights)).sum::<f64>()
    };
    let length = |piece: &PolynomialPiece| (4.0 * chords(piece, CHORDS) - chords(piece, CHORDS / 2)) / 3.0;
    geometry.pieces.iter().map(length).sum()
}

/// The linear axes are divided; where a rotary axis is not, its share in a length is none (FGROUP with weights counts it whole).
fn polynomial_point(piece: &PolynomialPiece, u: f64) -> AxisVector {
    let numerator = piece.numerator_lu.iter().rev().fold(AxisVector::zero(), |sum, c| sum * u + *c);
    let denominator = piece.denominator_ratio.iter().rev().fold(0.0, |sum, c| sum * u + c);
    if denominator == 0.0 { numerator } else { numerator * (1.0 / denominator) }
}

/// F of G93 in 1/min as a time.
pub(super) fn inverse_time_s(feed_per_min: f64) -> f64 {
    S_PER_MIN / feed_per_min
}
