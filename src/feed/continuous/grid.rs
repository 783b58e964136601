//! A piece of path as intervals of s, fine enough that what the axes allow hardly changes from one place to the next.
//!
//! In: a [`JointPath`], the limits of its axes, how fast it is about at its ends. Out: a [`Grid`]: [`Interval`]s in order, each with q', q'',
//! q''' at its start, middle and end, the speed that feed and axis velocities allow, and the share of the other limits that planning may use. An
//! interval is cut in two until the middle is what its ends make one expect ([`MISSED_RATIO`] of the greatest demand), and until it takes no longer
//! than a part of a jerk phase where the speed may have to change. At a rest stands a short interval for the start, whose law is one of
//! constant jerk.
//! Does not plan the speed; the limits between the places are checked after planning (`held`).

use crate::base::{AxisId, AxisVector};
use crate::feed::LimitKind;
use crate::feed::junction::STOP;
use crate::feed::limits::AxisRules;
use crate::feed::profile::SpeedCap;
use crate::geometry::Curve;
use crate::kinematics::{JointPath, JointState};
use crate::machine::AxisLimits;
use std::sync::Arc;

/// What the mean of the ends of an interval may miss of its middle, of the greatest demand.
const MISSED_RATIO: f64 = 0.07;

/// A demand that would hold the speed to this many times the one that is held for other reasons does not bind.
const UNBOUND_RATIO: f64 = 1.2;

/// Time of an interval, as share of the shortest jerk phase from no acceleration to the greatest, and its bounds.
const STEP_SHARE: f64 = 0.25;
const STEP_MIN_S: f64 = 5e-4;
const STEP_MAX_S: f64 = 0.02;

/// At a rest it takes at most this share of the least time for the piece.
const SHORT_STEP_SHARE: f64 = 0.04;

/// Within an interval the speed grows by this factor at most.
const FASTER_MAX_RATIO: f64 = 1.35;

/// Away from the ends of a piece an interval takes at most this share of the time to the nearer end.
const GROWTH_SHARE: f64 = 0.3;

/// The middle alone says too little about a curve.
const POLYNOMIAL_CUTS: u32 = 1;
const MAPPED_CUTS: u32 = 1;
const BLEND_CUTS: u32 = 2;

/// Where a piece is looked at for its slow places.
const SLOW_PLACES_SHARE: [f64; 3] = [0.3, 0.5, 0.7];

/// Cuts of an interval at most, and intervals of a piece beyond which it stays coarse.
const CUTS_MAX: u32 = 40;
const INTERVALS_MAX: usize = 20_000;

/// The interval at a rest is at most this share of its piece.
const REST_SHARE: f64 = 0.15;

/// Beside a knot of a spline its derivatives are taken this share of the range inside.
const BESIDE_RATIO: f64 = 1e-9;

/// Share of the limits that planning uses: what lies between the places of a curve may take the rest.
const LINE_RESERVE_RATIO: f64 = 0.998;
const CURVE_RESERVE_RATIO: f64 = 0.992;

/// Reserve of axis velocities, of the change of |q'| over an interval.
const VELOCITY_RESERVE_RATIO: f64 = 0.05;

/// An axis below this share of the greatest demands of all never comes near its limits.
const IDLE_SHARE: f64 = 1e-3;

/// q', q'', q''' at one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Derivatives {
    pub first: AxisVector,
    pub second: AxisVector,
    pub third: AxisVector,
}

/// What one axis allows.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisBound {
    pub axis: AxisId,
    pub acceleration_lu_s2: f64,
    /// `None` under BRISK.
    pub jerk_lu_s3: Option<f64>,
}

/// Limits of the axes that take part in a piece.
#[derive(Clone, Debug)]
pub(super) struct Bounds {
    pub axes: Vec<AxisBound>,
    /// Name of the jerk limit: inside a blend it is the transition jerk.
    pub jerk_kind: LimitKind,
    pub jerk_limited: bool,
}

/// A stretch of a piece.
#[derive(Clone, Debug)]
pub(super) struct Interval {
    /// From the start of the piece.
    pub start_lu: f64,
    pub end_lu: f64,
    /// At its start, middle and end, taken inside.
    pub states: [Derivatives; 3],
    /// Feed and axis velocities.
    pub cap: SpeedCap,
    /// Share of acceleration and jerk that planning uses.
    pub reserve_ratio: f64,
    /// The reserve was made tighter since.
    pub tightened: bool,
    pub bounds: Arc<Bounds>,
    straight: bool,
}

/// All intervals of a piece.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub intervals: Vec<Interval>,
    /// The first, the last interval is that of a start from rest, of a stop.
    pub rests: [bool; 2],
    /// The way that a stop from its highest speed takes, about.
    pub stop_lu: f64,
}

/// How a piece begins or ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum End {
    /// At rest.
    Rest,
    /// At this speed at most.
    Speed(f64),
}

/// What of a piece is cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    /// From the start of the piece.
    pub from_lu: f64,
    pub to_lu: f64,
    pub ends: [End; 2],
    /// So long the speed may change at the start, whatever the ends are.
    pub settling_s: f64,
}

impl Stretch {
    /// All of a piece, from rest to rest.
    pub fn whole(path: &JointPath) -> Self {
        Self { from_lu: 0.0, to_lu: path.length_lu(), ends: [End::Rest; 2], settling_s: 0.0 }
    }
}

impl Interval {
    pub fn length_lu(&self) -> f64 {
        self.end_lu - self.start_lu
    }

    /// Derivatives at its eighths, ends included: `looked` at the quarters between the three places or, without, by the parabola through them;
    /// between those by the cubic through their neighbours.
    pub fn eighths(&self, looked: Option<[Derivatives; 2]>) -> [Derivatives; 9] {
        let [from, middle, to] = self.states;
        let near_end = |near, next, far| Derivatives::mixed([near, next, far, far], [0.375, 0.75, -0.125, 0.0]);
        let inside = |states| Derivatives::mixed(states, [-0.0625, 0.5625, 0.5625, -0.0625]);
        let [q1, q3] = looked.unwrap_or_else(|| [near_end(&from, &middle, &to), near_end(&to, &middle, &from)]);
        [
            from,
            near_end(&from, &q1, &middle),
            q1,
            inside([&from, &q1, &middle, &q3]),
            middle,
            inside([&q1, &middle, &q3, &to]),
            q3,
            near_end(&to, &q3, &middle),
            to,
        ]
    }

    /// The derivatives are the same all along.
    pub fn is_straight(&self) -> bool {
        self.straight
    }

    /// A part of it.
    pub fn part(&self, path: &JointPath, start_lu: f64, end_lu: f64) -> Self {
        let states = [start_lu, 0.5 * (start_lu + end_lu), end_lu].map(|s_lu| {
            if s_lu <= self.start_lu {
                self.states[0]
            } else if s_lu >= self.end_lu {
                self.states[2]
            } else {
                Derivatives::from(path.at(s_lu))
            }
        });
        Self { start_lu, end_lu, states, bounds: self.bounds.clone(), ..*self }
    }
}

impl Derivatives {
    fn mixed(states: [&Self; 4], weights: [f64; 4]) -> Self {
        let mix = |of: fn(&Self) -> AxisVector| {
            states.iter().zip(weights).fold(AxisVector::zero(), |sum, (state, weight)| sum + of(state) * weight)
        };
        Self { first: mix(|state| state.first), second: mix(|state| state.second), third: mix(|state| state.third) }
    }
}

impl From<JointState> for Derivatives {
    fn from(state: JointState) -> Self {
        Self { first: state.first, second: state.second, third: state.third }
    }
}

/// Limits and curve of a piece while it is cut.
struct Cutter<'a> {
    rules: &'a AxisRules,
    path: &'a JointPath,
    blend: bool,
    /// The stretch that is cut, from the start of the piece.
    from_lu: f64,
    to_lu: f64,
    ends: [End; 2],
    /// So long the speed may change at the start, whatever the ends are.
    settling_s: f64,
    /// A straight piece has the same derivatives everywhere.
    straight: Option<Derivatives>,
    bounds: Arc<Bounds>,
    /// About the tangential acceleration and jerk.
    acceleration_lu_s2: f64,
    jerk_lu_s3: f64,
    step_s: f64,
    top_lu_s: f64,
    intervals: Vec<Interval>,
}

impl Grid {
    /// Cuts a stretch of `path`, which moves and has no step of direction or curvature inside.
    pub fn of_stretch(rules: &AxisRules, path: &JointPath, blend: bool, stretch: &Stretch) -> Self {
        Cutter::new(throughout(rules, path), path, blend, stretch).cut()
    }
}

/// One set of rules for the whole piece.
fn throughout<'a>(rules: &'a AxisRules, path: &JointPath) -> &'a AxisRules {
    path.contour.curve().map_or(rules, |curve| rules.throughout(&rules.feed_cap(&path.contour.feed, curve)))
}

/// Highest constant speed at a place: feed and axis velocities, and the bend.
fn constant_speed_lu_s(rules: &AxisRules, path: &JointPath, state: &Derivatives) -> f64 {
    let mut speed_lu_s = cap(rules, path, &[state]).velocity_lu_s;
    for (axis, limits) in AxisId::first(rules.axes.len()).zip(&rules.axes) {
        speed_lu_s = speed_lu_s.min((limits.acceleration_max_lu_s2 / state.second[axis].abs()).sqrt());
        if rules.jerk_limited {
            speed_lu_s = speed_lu_s.min((limits.jerk_max_lu_s3 / state.third[axis].abs()).cbrt());
        }
    }
    speed_lu_s
}

/// About the highest speeds at both ends of a piece: from its slow places on they grow with constant jerk.
pub(super) fn end_speeds_lu_s(rules: &AxisRules, path: &JointPath) -> [f64; 2] {
    let rules = throughout(rules, path);
    let length_lu = path.length_lu();
    let state_at = |s_lu: f64| Derivatives::from(path.at(s_lu));
    let speed_at = |s_lu: f64| constant_speed_lu_s(rules, path, &state_at(s_lu));
    if path.is_straight() {
        return [speed_at(0.0); 2];
    }
    let mut ends_lu_s = [speed_at(0.0), speed_at(length_lu)];
    let start = state_at(0.0);
    let jerk = rules.largest(|axis, limits| start.first[axis].abs() / limits.jerk_max_lu_s3);
    let jerk_lu_s3 = if rules.jerk_limited { 1.0 / jerk.demand_ratio } else { f64::INFINITY };
    for share in SLOW_PLACES_SHARE {
        let s_lu = share * length_lu;
        let speed_lu_s = speed_at(s_lu);
        for (end_lu_s, distance_lu) in ends_lu_s.iter_mut().zip([s_lu, length_lu - s_lu]) {
            *end_lu_s = end_lu_s.min(speed_lu_s + 0.5 * jerk_lu_s3 * (6.0 * distance_lu / jerk_lu_s3).cbrt().powi(2));
        }
    }
    ends_lu_s
}

fn cap(rules: &AxisRules, path: &JointPath, states: &[&Derivatives]) -> SpeedCap {
    let share = |axis: AxisId| {
        let most = states.iter().fold(0.0_f64, |most, state| most.max(state.first[axis].abs()));
        let [from, middle, to] = states else { return most };
        // Between the three places by the parabola through them, and by as much more as the third derivative may add.
        let [left, middle, right] = [from, middle, to].map(|state| state.first[axis]);
        let (slope, bend) = (0.5 * (right - left), left - 2.0 * middle + right);
        let most = if slope.abs() < bend.abs() { most.max((middle - 0.5 * slope * slope / bend).abs()) } else { most };
        most + VELOCITY_RESERVE_RATIO * (right - left).abs().max(bend.abs())
    };
    match path.contour.curve() {
        Some(curve) => rules.driven(rules.feed_cap(&path.contour.feed, curve), share),
        None => STOP,
    }
}

impl<'a> Cutter<'a> {
    fn new(rules: &'a AxisRules, path: &'a JointPath, blend: bool, stretch: &Stretch) -> Self {
        let Stretch { from_lu, to_lu, ends, settling_s } = *stretch;
        let length_lu = to_lu - from_lu;
        let start = Derivatives::from(path.at(from_lu));
        let straight = path.is_straight().then_some(start);
        let jerk_limited = rules.jerk_limited;
        let jerk_of =
            |limits: &AxisLimits| if blend { limits.transition_jerk_max_lu_s3 } else { limits.jerk_max_lu_s3 };
        let bound = |(axis, limits): (AxisId, &AxisLimits)| AxisBound {
            axis,
            acceleration_lu_s2: limits.acceleration_max_lu_s2,
            jerk_lu_s3: jerk_limited.then_some(jerk_of(limits)),
        };
        let axes: Vec<AxisBound> = AxisId::first(rules.axes.len()).zip(&rules.axes).map(bound).collect();
        let acceleration = rules.largest(|axis, limits| start.first[axis].abs() / limits.acceleration_max_lu_s2);
        let jerk = rules.largest(|axis, limits| start.first[axis].abs() / jerk_of(limits));
        let (acceleration_lu_s2, jerk_lu_s3) = (1.0 / acceleration.demand_ratio, 1.0 / jerk.demand_ratio);
        let phase_s = if jerk_limited { acceleration_lu_s2 / jerk_lu_s3 } else { STEP_MAX_S };
        // From rest to rest in four phases of constant jerk, or in two of constant acceleration: the least that the piece can take.
        let alone_s = if jerk_limited {
            (32.0 * length_lu / jerk_lu_s3).cbrt()
        } else {
            2.0 * (length_lu / acceleration_lu_s2).sqrt()
        };
        let rests = ends.contains(&End::Rest);
        let step_max_s = if rests { STEP_MAX_S.min(SHORT_STEP_SHARE * alone_s) } else { STEP_MAX_S };
        let step_s = (STEP_SHARE * phase_s).max(STEP_MIN_S).min(step_max_s);
        Self {
            rules,
            path,
            blend,
            from_lu,
            to_lu,
            ends,
            settling_s,
            straight,
            bounds: Arc::new(Bounds {
                axes,
                jerk_kind: if blend { LimitKind::TransitionJerk } else { LimitKind::Jerk },
                jerk_limited,
            }),
            acceleration_lu_s2,
            jerk_lu_s3,
            step_s,
            top_lu_s: cap(rules, path, &[&start]).velocity_lu_s,
            intervals: Vec::new(),
        }
    }

    fn cut(mut self) -> Grid {
        let mut borders = vec![self.from_lu];
        let rests = self.ends.map(|end| end == End::Rest);
        if rests[0] {
            borders.push(self.from_lu + self.rest_lu());
        }
        let inside = [borders[borders.len() - 1], self.to_lu - if rests[1] { self.rest_lu() } else { 0.0 }];
        let knots: Vec<f64> = match self.path.contour.curve() {
            Some(Curve::Polynomial(curve)) if self.path.is_contour() => curve.knots_lu().collect(),
            _ if self.path.is_contour() => Vec::new(),
            _ => self.path.nodes_lu(),
        };
        borders.extend(knots.into_iter().filter(|s_lu| *s_lu > inside[0] && *s_lu < inside[1]));
        if rests[1] {
            borders.push(self.to_lu - self.rest_lu());
        }
        borders.push(self.to_lu);
        for range in borders.windows(2) {
            self.cut_range(range[0], range[1]);
        }
        self.drop_idle_axes();
        let half_lu = 0.5 * (self.to_lu - self.from_lu);
        let v = self.ends.iter().fold(self.top_lu_s, |v, end| v.min(self.reached_lu_s(*end, half_lu)));
        let ramp_s = v / self.acceleration_lu_s2
            + if self.bounds.jerk_limited { self.acceleration_lu_s2 / self.jerk_lu_s3 } else { 0.0 };
        Grid { intervals: self.intervals, rests, stop_lu: 0.5 * v * ramp_s }
    }

    /// Length of the interval at a rest.
    fn rest_lu(&self) -> f64 {
        let t = self.step_s;
        let lu = if self.bounds.jerk_limited {
            self.jerk_lu_s3 * t.powi(3) / 6.0
        } else {
            self.acceleration_lu_s2 * t * t / 2.0
        };
        lu.min(REST_SHARE * (self.to_lu - self.from_lu))
    }

    fn cut_range(&mut self, start_lu: f64, end_lu: f64) {
        let inside = BESIDE_RATIO * (end_lu - start_lu);
        let at_start = self.look(if start_lu > 0.0 { start_lu + inside } else { 0.0 });
        let at_end = self.look(if end_lu < self.path.length_lu() { end_lu - inside } else { end_lu });
        let rest = (self.ends[0] == End::Rest && start_lu == self.from_lu)
            || (self.ends[1] == End::Rest && end_lu == self.to_lu && start_lu > self.from_lu);
        let mut from = (start_lu, at_start);
        let mut waiting = vec![((end_lu, at_end), 0)];
        let cuts_min = self.cuts_min();
        while let Some((to, cuts)) = waiting.pop() {
            let middle_lu = 0.5 * (from.0 + to.0);
            let middle = self.look(middle_lu);
            let enough = cuts >= CUTS_MAX || self.intervals.len() + waiting.len() >= INTERVALS_MAX;
            if rest
                || enough
                || (cuts >= cuts_min && self.quick(from.0, to.0, &middle) && self.smooth(&from.1, &middle, &to.1))
            {
                self.push(from, middle, to);
                from = to;
            } else {
                waiting.push((to, cuts + 1));
                waiting.push(((middle_lu, middle), cuts + 1));
            }
        }
    }

    /// Cuts without which the middle says too little: in a blend q''' goes from 0 over a summit to 0 in the middle.
    fn cuts_min(&self) -> u32 {
        match self.path.contour.curve() {
            _ if !self.path.is_contour() => MAPPED_CUTS,
            Some(Curve::Line(_) | Curve::Arc(_) | Curve::SpatialArc(_)) | None => 0,
            Some(Curve::Polynomial(_)) if !self.blend => POLYNOMIAL_CUTS,
            Some(_) => BLEND_CUTS,
        }
    }

    fn push(&mut self, from: (f64, Derivatives), middle: Derivatives, to: (f64, Derivatives)) {
        let cap = cap(self.rules, self.path, &[&from.1, &middle, &to.1]);
        let reserve_ratio = if self.straight.is_some() { LINE_RESERVE_RATIO } else { CURVE_RESERVE_RATIO };
        self.top_lu_s = self.top_lu_s.max(cap.velocity_lu_s);
        self.intervals.push(Interval {
            start_lu: from.0,
            end_lu: to.0,
            states: [from.1, middle, to.1],
            cap,
            reserve_ratio,
            tightened: false,
            bounds: self.bounds.clone(),
            straight: self.straight.is_some(),
        });
    }

    fn look(&self, s_lu: f64) -> Derivatives {
        self.straight.unwrap_or_else(|| Derivatives::from(self.path.at(s_lu)))
    }

    /// The interval takes no longer than it may.
    fn quick(&self, start_lu: f64, end_lu: f64, middle: &Derivatives) -> bool {
        let middle_lu = 0.5 * (start_lu + end_lu);
        let held_lu_s = constant_speed_lu_s(self.rules, self.path, middle);
        let distances = [middle_lu - self.from_lu, self.to_lu - middle_lu];
        let mut speed_lu_s = held_lu_s;
        let half_lu = 0.5 * (end_lu - start_lu);
        let mut near_s = f64::INFINITY;
        let mut ramp_s = self.settling_s;
        for (end, distance_lu) in self.ends.iter().zip(distances) {
            let reached_lu_s = self.reached_lu_s(*end, distance_lu);
            let nearer_lu_s = self.reached_lu_s(*end, distance_lu - half_lu);
            let further_lu_s = self.reached_lu_s(*end, distance_lu + half_lu).min(held_lu_s);
            if further_lu_s > FASTER_MAX_RATIO * nearer_lu_s {
                return false;
            }
            speed_lu_s = speed_lu_s.min(reached_lu_s);
            near_s = near_s.min(distance_lu / held_lu_s);
            let from_lu_s = if let End::Speed(v) = end { v.min(held_lu_s) } else { 0.0 };
            ramp_s = ramp_s.max((held_lu_s - from_lu_s) / self.acceleration_lu_s2 + self.step_s / STEP_SHARE);
        }
        let away_s = GROWTH_SHARE * (near_s - ramp_s).max(0.0);
        end_lu - start_lu <= speed_lu_s * self.step_s.max(away_s)
    }

    /// About the speed that is reached at a distance from an end.
    fn reached_lu_s(&self, end: End, distance_lu: f64) -> f64 {
        let from_lu_s = match end {
            End::Speed(v) => v,
            End::Rest => 0.0,
        };
        let by_acceleration = (from_lu_s * from_lu_s + 2.0 * self.acceleration_lu_s2 * distance_lu).sqrt();
        if !self.bounds.jerk_limited {
            return by_acceleration;
        }
        // s = j t³/6, v = j t²/2
        let by_jerk = from_lu_s + 0.5 * self.jerk_lu_s3 * (6.0 * distance_lu / self.jerk_lu_s3).cbrt().powi(2);
        by_acceleration.min(by_jerk)
    }

    /// The middle is what is between its neighbours.
    fn smooth(&self, from: &Derivatives, middle: &Derivatives, to: &Derivatives) -> bool {
        if self.straight.is_some() {
            return true;
        }
        let reference_lu_s = UNBOUND_RATIO * cap(self.rules, self.path, &[middle]).velocity_lu_s;
        let mut most = [reference_lu_s.powi(-2), reference_lu_s.powi(-3)];
        let mut missed = [0.0_f64; 2];
        for bound in &self.bounds.axes {
            let axis = bound.axis;
            let demands = [from, middle, to].map(|state| {
                let jerk = bound.jerk_lu_s3.map_or(0.0, |jerk| state.third[axis] / jerk);
                [state.second[axis] / bound.acceleration_lu_s2, jerk]
            });
            for order in 0..2 {
                let [a, m, b] = demands.map(|demand| demand[order]);
                missed[order] = missed[order].max((m - 0.5 * (a + b)).abs());
                most[order] = most[order].max(m.abs()).max(a.abs()).max(b.abs());
            }
        }
        missed[0] <= MISSED_RATIO * most[0] && missed[1] <= 2.0 * MISSED_RATIO * most[1]
    }

    /// Takes out the axes whose demands are next to nothing all along.
    fn drop_idle_axes(&mut self) {
        let demand = |bound: &AxisBound| {
            let mut most = [0.0_f64; 3];
            for state in self.intervals.iter().flat_map(|interval| &interval.states) {
                let shares = [&state.first, &state.second, &state.third].map(|derivative| derivative[bound.axis].abs());
                most.iter_mut().zip(shares).for_each(|(most, share)| *most = most.max(share));
            }
            let jerk = bound.jerk_lu_s3.unwrap_or(f64::INFINITY);
            let v = self.top_lu_s;
            let (a, j) = (bound.acceleration_lu_s2, jerk);
            [
                most[0] / a,
                most[0] / j,
                v * v * most[1] / a,
                (v.powi(3) * most[2]) / j,
                v * self.acceleration_lu_s2 * most[1] / j,
            ]
        };
        let demands: Vec<[f64; 5]> = self.bounds.axes.iter().map(demand).collect();
        let top = |order: usize| demands.iter().fold(0.0_f64, |top, demand| top.max(demand[order]));
        let tops = [top(0), top(1), 1.0, 1.0, 1.0];
        let idle = |demand: &[f64; 5]| demand.iter().zip(tops).all(|(demand, top)| *demand <= IDLE_SHARE * top);
        let mut kept = demands.iter().map(|demand| !idle(demand));
        let mut axes = self.bounds.axes.clone();
        axes.retain(|_| kept.next().unwrap_or(true));
        let bounds = Arc::new(Bounds { axes, ..(*self.bounds).clone() });
        for interval in &mut self.intervals {
            interval.bounds = bounds.clone();
        }
    }
}
