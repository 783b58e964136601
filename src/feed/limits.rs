//! What the axes allow on one piece: its highest speed, its tangential acceleration and jerk, and which axis sets each.
//!
//! In: the curve of a piece with its derivatives, its feed, the limits of the axes ([`AxisRules`]). Out: [`PieceLimits`]. With
//! speed v along the path an axis sees the velocity `q' v`, the acceleration `q'' v² + q' a` and the jerk
//! `q''' v³ + 3 q'' v a + q' j`: for every axis the sums stay inside its limits wherever v, a and j stay inside those found here.
//! Does not look at neighbours: what a junction allows is [`junction`](super::junction)'s.

use super::feed_override::OVERRIDE_MAX_RATIO;
use super::group::FeedGroup;
use super::profile::{Bounds, SpeedCap, Stretch, seven_phases};
use super::ramp::Dynamics;
use super::worst::Worst;
use super::{Limit, LimitKind, blend_limits, printed_arc};
use crate::base::Portable;
use crate::base::{AxisId, PerAxis};
use crate::geometry::{Curve, HermiteBlend};
use crate::interpreter::{Feed, Modes, ProgrammedLimits};
use crate::kinematics::{JointPath, JointState};
use crate::machine::{
    AccelerationMode, ArcLimits, AxisLimits, BlendLaw, BlendLimits, CornerRule, CurvatureJump, FeedSettings, Machine,
};
use crate::smoothing::ContourPiece;

/// The jerk that is left on an arc is split in these many parts between its two uses.
const JERK_SHARES: u32 = 16;

/// Everything of the machine that speed depends on, under the modes of a block.
#[derive(Clone, Debug)]
pub(super) struct AxisRules {
    /// Limits of every axis, in order: those of the dynamics set, with ACC, VELOLIM and JERKLIM.
    pub axes: Vec<AxisLimits>,
    /// Highest velocity of every axis in a feed motion: FL holds as well.
    pub feed_velocities_max_lu_s: Vec<f64>,
    /// Step of velocity that each axis may make at a corner.
    pub corner_steps_lu_s: Vec<f64>,
    /// R_A.
    pub radial_acceleration_share: f64,
    /// R_J.
    pub radial_jerk_share: f64,
    /// Feed inside a blend.
    pub blend_law: BlendLaw,
    /// Inside a blend every axis counts with all of the path's acceleration and jerk: the older model.
    pub path_limits: bool,
    /// Which axes are linear.
    pub linear: PerAxis<bool>,
    /// How a change of curvature is measured.
    pub curvature_jump: CurvatureJump,
    /// Limits of arcs.
    pub arc_limits: ArcLimits,
    /// t_s.
    pub setpoint_period_s: f64,
    /// SOFT.
    pub jerk_limited: bool,
    /// OVR and OVRRAP.
    pub override_ratio: f64,
    /// So many times the feed under it the path may still be, because the override was higher a moment ago.
    pub leaving_ratio: f64,
    /// Neither OVR nor the switch acts: G63.
    pub override_fixed: bool,
    /// OVRRAP; at most 1, because the axes cannot do more.
    pub rapid_override_ratio: f64,
    /// FGROUP.
    pub group: Option<FeedGroup>,
    /// DRIVE: the two ways to keep the acceleration low at high speed.
    pub drive: Option<Box<DriveRules>>,
}

/// DRIVE on an axis that has less acceleration at high speed (MD35220, MD35230): either the speed stays below the one from which that
/// is so, or the acceleration is the lower one from end to end. A piece takes the quicker of the two. The control lowers it only
/// while the speed is high: it is a little quicker.
#[derive(Clone, Debug)]
pub(super) struct DriveRules {
    pub slow: AxisRules,
    pub weak: AxisRules,
}

/// Programmed feed of a piece.
#[derive(Clone, Copy, Debug)]
pub(super) enum FeedCap {
    /// As fast as the axes can.
    Rapid,
    /// At most this, along s.
    Programmed(SpeedCap),
}

/// Largest of a demand per axis, in shares of what the axis allows, and the axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand {
    /// Demand over limit.
    pub demand_ratio: f64,
    /// Whose it is.
    pub axis: AxisId,
}

/// Limits of a piece that moves.
#[derive(Clone, Copy, Debug)]
pub(super) struct PieceLimits {
    /// Highest speed anywhere on the piece, alone.
    pub cap: SpeedCap,
    /// Highest speed at its end; higher than `cap` where the law inside is one of its own (`blend_law = "published"`).
    pub exit_cap: SpeedCap,
    /// Up to here the speed may change; above it must be the same all along (blends only).
    pub ramp_cap: SpeedCap,
    /// Tangential acceleration and jerk and what sets them.
    pub bounds: Bounds,
}

/// The ends of a piece that moves, as its neighbours see them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    /// Where it begins.
    pub start: JointState,
    /// Where it ends.
    pub end: JointState,
    /// A blend: its change of curvature at the ends is there by construction.
    pub blend: bool,
    /// No linear axis moves: s is in rad.
    pub rotary_only: bool,
}

/// By how much the share of an axis may be greater between three places of a curve.
const SHARE_BETWEEN_RATIO: f64 = 1.3;

/// Which jerk of an axis holds.
type JerkMax = fn(&AxisLimits) -> f64;

impl AxisRules {
    /// The limits that hold under `modes`.
    pub(super) fn new(machine: &Machine, modes: &Modes) -> Self {
        let none = ProgrammedLimits::default();
        let programmed = modes.programmed.as_deref().unwrap_or(&none);
        let axes: Vec<AxisLimits> = machine.axis_ids().map(|id| axis_limits(machine, id, modes)).collect();
        let mut rules = Self::with_axes(machine, programmed, axes);
        rules.jerk_limited = modes.acceleration_mode == AccelerationMode::Soft;
        rules.drive =
            (modes.acceleration_mode == AccelerationMode::Drive).then(|| rules.drive_rules(machine)).flatten();
        rules
    }

    /// The same with this override on top of OVR; both together do no more than the control allows. Where it has just been changed the path may still
    /// be as fast as under `fastest_ratio`.
    pub(super) fn overridden(&self, override_ratio: f64, fastest_ratio: f64) -> Self {
        let mut rules = self.clone();
        if rules.override_fixed {
            return rules;
        }
        let programmed_ratio = rules.override_ratio;
        let [ratio, fastest] =
            [override_ratio, fastest_ratio].map(|ratio| (programmed_ratio * ratio).min(OVERRIDE_MAX_RATIO));
        (rules.override_ratio, rules.leaving_ratio) = (ratio, (fastest / ratio).max(1.0));
        if let Some(drive) = &mut rules.drive {
            drive.slow = drive.slow.overridden(override_ratio, fastest_ratio);
            drive.weak = drive.weak.overridden(override_ratio, fastest_ratio);
        }
        rules
    }

    /// F of a piece under an override on top of OVR; infinite for a rapid.
    pub(super) fn feed_under_lu_s(&self, path: &JointPath, override_ratio: f64) -> f64 {
        let Some(curve) = path.contour.curve() else { return f64::INFINITY };
        let FeedCap::Programmed(cap) = self.feed_cap(&path.contour.feed, curve) else { return f64::INFINITY };
        let ratio = if self.override_fixed { self.override_ratio } else { self.override_ratio * override_ratio };
        cap.velocity_lu_s / self.override_ratio * ratio.min(OVERRIDE_MAX_RATIO)
    }

    /// What the axes may do depends on how fast they are.
    pub(super) fn weakens(&self) -> bool {
        self.drive.is_some()
    }

    fn with_axes(machine: &Machine, programmed: &ProgrammedLimits, axes: Vec<AxisLimits>) -> Self {
        let setpoint_period_s = machine.cycle.time_base.setpoint_period_s();
        let FeedSettings { corner_rule, overload_ratio, curvature_jump, arc_limits, .. } = machine.feed;
        let corner_step = |(axis, limits): (&crate::machine::Axis, &AxisLimits)| {
            let a = limits.acceleration_max_lu_s2;
            match corner_rule {
                // models/feed-prediction-and-surface.md section 2 [Lavernhe 2008].
                CornerRule::FollowUp => (8.0 * a * axis.follow_up_tolerance_lu).sqrt(),
                CornerRule::Overload => overload_ratio * a * setpoint_period_s,
            }
        };
        let linear = machine.linear_mask();
        let group = programmed.feed_group.map(|members| FeedGroup::new(&linear, members, programmed));
        let feed_velocity = |(id, limits): (AxisId, &AxisLimits)| {
            let synchronous = group.as_ref().map_or(!linear[id], |group| !group.contains(id));
            let limit_lu_s = programmed.synchronous_max_lu_s[id].filter(|_| synchronous).unwrap_or(f64::INFINITY);
            limits.velocity_max_lu_s.min(limit_lu_s)
        };
        Self {
            feed_velocities_max_lu_s: machine.axis_ids().zip(&axes).map(feed_velocity).collect(),
            corner_steps_lu_s: machine.axes.iter().zip(&axes).map(corner_step).collect(),
            axes,
            radial_acceleration_share: machine.smoothing.radial_acceleration_share,
            radial_jerk_share: machine.smoothing.radial_jerk_share,
            blend_law: machine.smoothing.blend_law,
            path_limits: machine.smoothing.limits == BlendLimits::Path,
            linear,
            curvature_jump,
            arc_limits,
            setpoint_period_s,
            jerk_limited: true,
            override_ratio: if programmed.override_acts { programmed.override_ratio } else { 1.0 },
            leaving_ratio: 1.0,
            override_fixed: !programmed.override_acts,
            rapid_override_ratio: programmed.rapid_override_ratio.min(1.0),
            group,
            drive: None,
        }
    }

    /// The rules that hold from end to end of a piece, whatever its speed: under DRIVE the full acceleration where F keeps every axis
    /// below the velocity from which it is lower, the lower one elsewhere.
    pub(super) fn throughout(&self, path: &JointPath) -> &Self {
        let (Some(drive), Some(curve)) = (&self.drive, path.contour.curve()) else { return self };
        let FeedCap::Programmed(cap) = self.feed_cap(&path.contour.feed, curve) else { return &drive.weak };
        let states = [0.0, 0.5, 1.0].map(|share| path.at(share * path.length_lu()));
        let between_ratio = if path.is_straight() { 1.0 } else { SHARE_BETWEEN_RATIO };
        let share = |axis: AxisId| {
            // s is the way of the linear axes: none of them moves faster.
            if path.is_contour() && self.linear[axis] {
                return 1.0;
            }
            between_ratio * states.iter().fold(0.0_f64, |most, state| most.max(state.first[axis].abs()))
        };
        let mut axes = AxisId::first(self.axes.len()).zip(&drive.slow.axes);
        let fastest_lu_s = cap.velocity_lu_s * self.leaving_ratio;
        if axes.all(|(id, limits)| share(id) * fastest_lu_s <= limits.velocity_max_lu_s) { self } else { &drive.weak }
    }

    /// `None` where no axis has less acceleration at high speed.
    fn drive_rules(&self, machine: &Machine) -> Option<Box<DriveRules>> {
        let (mut slow, mut weak) = (self.clone(), self.clone());
        let mut reduces = false;
        for (id, axis) in machine.axis_ids().zip(&machine.axes) {
            let reduction = axis.acceleration_reduction;
            if reduction.velocity_ratio >= 1.0 || reduction.reduction_ratio <= 0.0 {
                continue;
            }
            reduces = true;
            let limit_lu_s = reduction.velocity_ratio * axis.limits.velocity_max_lu_s;
            let slowed = |velocity_lu_s: &mut f64| *velocity_lu_s = velocity_lu_s.min(limit_lu_s);
            slowed(&mut slow.axes[id.index()].velocity_max_lu_s);
            slowed(&mut slow.feed_velocities_max_lu_s[id.index()]);
            weak.axes[id.index()].acceleration_max_lu_s2 *= 1.0 - reduction.reduction_ratio;
        }
        reduces.then(|| Box::new(DriveRules { slow, weak }))
    }

    /// The axis for which `ratio(axis, its limits)` is largest, the first of equal ones.
    pub(super) fn largest(&self, ratio: impl Fn(AxisId, &AxisLimits) -> f64) -> Demand {
        let mut largest = Demand { demand_ratio: 0.0, axis: AxisId::new(0) };
        for (axis, limits) in AxisId::first(self.axes.len()).zip(&self.axes) {
            let demand_ratio = ratio(axis, limits);
            if demand_ratio > largest.demand_ratio {
                largest = Demand { demand_ratio, axis };
            }
        }
        largest
    }

    /// How much of the path's acceleration or jerk an axis counts inside a blend, for the component of a unit vector: that
    /// component, or under `limits = "path"` all of it if the axis moves in the blend at all.
    pub(super) fn blend_component(&self, blend: &HermiteBlend, component: f64, axis: AxisId) -> f64 {
        if self.path_limits && self.linear[axis] { if blend.moves(axis) { 1.0 } else { 0.0 } } else { component.abs() }
    }

    /// Limits of a piece on its curve.
    /// `worst` are the greatest demands along a curve that has no closed form for them.
    pub(super) fn piece(&self, piece: &ContourPiece, curve: &Curve, ends: &Ends, worst: Option<&Worst>) -> PieceLimits {
        let limits = self.on_curve(piece, curve, ends, worst);
        let Some(drive) = &self.drive else { return limits };
        let mut slow = drive.slow.on_curve(piece, curve, ends, worst);
        if slow.cap.velocity_lu_s >= limits.cap.velocity_lu_s {
            return limits;
        }
        // What holds the speed down is what the axis cannot accelerate above it.
        if slow.cap.limit.kind == LimitKind::Velocity {
            let limit = Limit { kind: LimitKind::Acceleration, ..slow.cap.limit };
            (slow.cap.limit, slow.ramp_cap.limit, slow.bounds.cruise.limit) = (limit, limit, limit);
        }
        let weak = drive.weak.on_curve(piece, curve, ends, worst);
        let length_lu = curve.length_lu();
        if weak.alone_s(length_lu) < slow.alone_s(length_lu) { weak } else { slow }
    }

    fn on_curve(&self, piece: &ContourPiece, curve: &Curve, ends: &Ends, worst: Option<&Worst>) -> PieceLimits {
        let feed = self.feed_cap(&piece.feed, curve);
        let jerk_limited = self.jerk_limited;
        let in_block: JerkMax = |limits| limits.jerk_max_lu_s3;
        let in_blend: JerkMax = |limits| limits.transition_jerk_max_lu_s3;
        if let Some(worst) = worst {
            return self.curved(worst, if ends.blend { in_blend } else { in_block }, feed, jerk_limited);
        }
        match curve {
            Curve::Line(_) => self.line(&ends.start, feed, jerk_limited),
            Curve::Arc(arc) => self.arc(&Worst::on_arc(arc), &ends.start, feed, jerk_limited),
            Curve::SpatialArc(arc) => self.arc(&Worst::on_spatial_arc(arc), &ends.start, feed, jerk_limited),
            // Unknown demands allow nothing: the planner refuses the piece.
            Curve::Polynomial(_) | Curve::Quintic(_) => self.curved(&Worst::unknown(), in_block, feed, jerk_limited),
            Curve::Blend(blend) => blend_limits::limits(self, blend, feed, jerk_limited),
        }
    }

    /// F along s, with OVR.
    pub(super) fn feed_cap(&self, feed: &Feed, curve: &Curve) -> FeedCap {
        let programmed_lu_s = match feed {
            Feed::Rapid => return FeedCap::Rapid,
            Feed::Path { feed_lu_s } => *feed_lu_s,
            Feed::Varying { feeds_lu_s } => feeds_lu_s.iter().copied().fold(f64::INFINITY, f64::min),
        };
        let along_lu_s = match &self.group {
            Some(group) => programmed_lu_s / group.way_ratio(curve),
            None => programmed_lu_s,
        };
        let kind = if self.override_ratio < 1.0 { LimitKind::Override } else { LimitKind::Feed };
        let velocity_lu_s = along_lu_s * self.override_ratio;
        FeedCap::Programmed(SpeedCap { velocity_lu_s, limit: Limit { kind, axis: None } })
    }

    /// The feed and what the velocities of the axes allow; `share` is the largest |q'| of an axis on the piece.
    pub(super) fn driven(&self, feed: FeedCap, share: impl Fn(AxisId) -> f64) -> SpeedCap {
        match feed {
            FeedCap::Programmed(cap) => cap.min(self.axes_cap(false, share)),
            FeedCap::Rapid => {
                let cap = self.axes_cap(true, share);
                if self.rapid_override_ratio >= 1.0 {
                    return cap;
                }
                let limit = Limit { kind: LimitKind::Override, axis: None };
                SpeedCap { velocity_lu_s: cap.velocity_lu_s * self.rapid_override_ratio, limit }
            }
        }
    }

    /// What the velocities of the axes alone allow where each moves with this share of the speed.
    pub(super) fn axes_cap(&self, rapid: bool, share: impl Fn(AxisId) -> f64) -> SpeedCap {
        let most = self.largest(|axis, limits| {
            let velocity_max_lu_s =
                if rapid { limits.velocity_max_lu_s } else { self.feed_velocities_max_lu_s[axis.index()] };
            share(axis) / velocity_max_lu_s
        });
        most.cap(LimitKind::Velocity, 1)
    }

    /// A line: every axis sees its share of v, a and j.
    fn line(&self, state: &JointState, feed: FeedCap, jerk_limited: bool) -> PieceLimits {
        let share = |axis: AxisId| state.first[axis].abs();
        let acceleration = self.largest(|axis, limits| share(axis) / limits.acceleration_max_lu_s2);
        let jerk = self.largest(|axis, limits| share(axis) / limits.jerk_max_lu_s3);
        let cap = self.driven(feed, share);
        PieceLimits::new(cap, cap, acceleration, jerk, jerk_limited)
    }

    /// An arc or helix, by the rule of the machine.
    fn arc(&self, worst: &Worst, start: &JointState, feed: FeedCap, jerk_limited: bool) -> PieceLimits {
        match self.arc_limits {
            ArcLimits::Worst => self.curved(worst, |limits| limits.jerk_max_lu_s3, feed, jerk_limited),
            ArcLimits::Printed => printed_arc::limits(self, worst, start, feed, jerk_limited),
        }
    }

    /// An arc or helix: the worst direction met on it (models/arcs.md section 4), with the radial shares of models/local-smoothing.md
    /// section 2, so that the sums over tangent and normal hold and not only each term.
    /// The same for any other curve.
    fn curved(&self, worst: &Worst, jerk_max: JerkMax, feed: FeedCap, jerk_limited: bool) -> PieceLimits {
        let (ra, rj) = (self.radial_acceleration_share, self.radial_jerk_share);
        let radial = self.largest(|axis, limits| worst.second(axis) / (ra * limits.acceleration_max_lu_s2));
        let turning = self.largest(|axis, limits| worst.third(axis) / (rj * jerk_max(limits)));
        let mut cap = self.driven(feed, |axis| worst.first(axis));
        cap = cap.min(radial.cap(LimitKind::RadialAcceleration, 2));
        if jerk_limited {
            cap = cap.min(turning.cap(LimitKind::RadialJerk, 3));
        }
        let acceleration =
            self.largest(|axis, limits| worst.first(axis) / ((1.0 - ra) * limits.acceleration_max_lu_s2));
        if !jerk_limited {
            return PieceLimits::new(cap, cap, acceleration, acceleration, jerk_limited);
        }
        let left = |axis: AxisId, limits: &AxisLimits| jerk_max(limits) - cap.velocity_lu_s.powi(3) * worst.third(axis);
        self.share_jerk(worst, cap, acceleration, left)
    }

    /// Splits the jerk that turning leaves between `3 v a |q''|` and `j |q'|`: among some splits that one which reaches the cap
    /// from rest in the shortest time. `left` is positive for every axis: turning takes R_J of the jerk at most.
    fn share_jerk(
        &self,
        worst: &Worst,
        cap: SpeedCap,
        acceleration: Demand,
        left: impl Fn(AxisId, &AxisLimits) -> f64,
    ) -> PieceLimits {
        let v = cap.velocity_lu_s;
        let coupled = self.largest(|axis, limits| 3.0 * v * worst.second(axis) / left(axis, limits));
        let candidate = |share: u32| {
            let x = f64::from(share) / f64::from(JERK_SHARES);
            // Lowest acceleration, so highest demand, of the two.
            let a = acceleration.demand_ratio.max(coupled.demand_ratio / x).recip();
            let jerk = self
                .largest(|axis, limits| worst.first(axis) / (left(axis, limits) - 3.0 * v * a * worst.second(axis)));
            let mut limits = PieceLimits::new(cap, cap, Demand { demand_ratio: 1.0 / a, ..acceleration }, jerk, true);
            if coupled.demand_ratio / x > acceleration.demand_ratio {
                limits.bounds.acceleration = coupled.limit(LimitKind::Jerk);
            }
            (limits.bounds.dynamics.ramp(0.0, v).duration_s(), limits)
        };
        let (mut least_s, mut best) = candidate(1);
        for share in 2..JERK_SHARES {
            let (time_s, limits) = candidate(share);
            if time_s < least_s {
                (least_s, best) = (time_s, limits);
            }
        }
        best
    }
}

impl Demand {
    /// The speed at which a demand that goes with its `power` reaches the limit. An axis without demand does not bind.
    pub(super) fn cap(&self, kind: LimitKind, power: u8) -> SpeedCap {
        let limit = self.limit(kind);
        let velocity_lu_s = match power {
            2 => 1.0 / self.demand_ratio.sqrt(),
            3 => 1.0 / self.demand_ratio.portable_cbrt(),
            _ => 1.0 / self.demand_ratio,
        };
        SpeedCap { velocity_lu_s, limit }
    }

    pub(super) fn limit(&self, kind: LimitKind) -> Limit {
        Limit { kind, axis: Some(self.axis) }
    }
}

impl PieceLimits {
    /// `acceleration` and `jerk` are demands per unit of a and j.
    pub(super) fn new(
        cap: SpeedCap,
        ramp_cap: SpeedCap,
        acceleration: Demand,
        jerk: Demand,
        jerk_limited: bool,
    ) -> Self {
        let dynamics = Dynamics {
            acceleration_lu_s2: 1.0 / acceleration.demand_ratio,
            jerk_lu_s3: jerk_limited.then_some(1.0 / jerk.demand_ratio),
        };
        let bounds = Bounds {
            cruise: ramp_cap,
            dynamics,
            acceleration: acceleration.limit(LimitKind::Acceleration),
            jerk: jerk.limit(LimitKind::Jerk),
        };
        Self { cap, exit_cap: cap, ramp_cap, bounds }
    }

    /// About what is left for changes of speed on a curve, to judge how much way one takes.
    pub(super) fn rough_dynamics(rules: &AxisRules, worst: &Worst) -> Dynamics {
        let (ra, rj) = (rules.radial_acceleration_share, rules.radial_jerk_share);
        let a = rules.largest(|axis, limits| worst.first(axis) / ((1.0 - ra) * limits.acceleration_max_lu_s2));
        let j = rules.largest(|axis, limits| worst.first(axis) / ((1.0 - rj) * limits.jerk_max_lu_s3));
        Dynamics {
            acceleration_lu_s2: 1.0 / a.demand_ratio,
            jerk_lu_s3: rules.jerk_limited.then_some(1.0 / j.demand_ratio),
        }
    }

    /// Time from rest to rest.
    fn alone_s(&self, length_lu: f64) -> f64 {
        let rest = SpeedCap { velocity_lu_s: 0.0, limit: self.cap.limit };
        let bounds = Bounds { cruise: self.ramp_cap, ..self.bounds };
        seven_phases(&Stretch { length_lu, entry: rest, exit: rest }, &bounds).duration_s()
    }

    /// Highest speed at the end of `length_lu` if it is `from` at its start, and what sets it; the same for braking to exactly
    /// `from`.
    pub(super) fn reach(&self, from: SpeedCap, length_lu: f64) -> SpeedCap {
        self.capped(from, self.bounds.dynamics.reachable(from.velocity_lu_s, length_lu))
    }

    /// Highest speed from which one can brake within `length_lu` to any speed not above it, from `to` on.
    pub(super) fn brake(&self, to: SpeedCap, length_lu: f64) -> SpeedCap {
        self.capped(to, self.bounds.dynamics.brakeable(to.velocity_lu_s, length_lu))
    }

    fn capped(&self, from: SpeedCap, velocity_lu_s: f64) -> SpeedCap {
        if self.ramp_cap.velocity_lu_s <= from.velocity_lu_s {
            return from;
        }
        let limit = self.ramp_limit(from.velocity_lu_s, velocity_lu_s);
        SpeedCap { velocity_lu_s, limit }.min(self.ramp_cap)
    }

    /// What bounds the quickest ramp from one speed to another: the axis whose acceleration is reached, else that of the jerk.
    fn ramp_limit(&self, from_lu_s: f64, to_lu_s: f64) -> Limit {
        if self.bounds.dynamics.ramp(from_lu_s, to_lu_s).hold_time_s > 0.0 {
            self.bounds.acceleration
        } else {
            self.bounds.jerk
        }
    }
}

/// Limits of one axis under the modes of a block: its dynamics set, ACC, VELOLIM, JERKLIM.
pub(super) fn axis_limits(machine: &Machine, id: AxisId, modes: &Modes) -> AxisLimits {
    let axis = machine.axis(id);
    let limits = *axis.dynamics.get(modes.dynamics).unwrap_or(&axis.limits);
    let Some(programmed) = &modes.programmed else { return limits };
    let (velocity, jerk) = (programmed.velocity_ratio[id], programmed.jerk_ratio[id]);
    AxisLimits {
        velocity_max_lu_s: limits.velocity_max_lu_s * velocity,
        acceleration_max_lu_s2: limits.acceleration_max_lu_s2 * programmed.acceleration_ratio[id],
        jerk_max_lu_s3: limits.jerk_max_lu_s3 * jerk,
        transition_jerk_max_lu_s3: limits.transition_jerk_max_lu_s3 * jerk,
    }
}
