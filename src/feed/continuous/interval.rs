//! A stretch of path between two places of a plan.
//!
//! In: q', q'', q''' at its start, middle and end ([`Derivatives`]), the limits of its axes ([`Bounds`]). Out: what lies between, by interpolation.
//! Does not know how long a stretch should be: `grid` and `group` do.

use crate::base::Portable;
use crate::base::{AxisId, AxisVector};
use crate::feed::LimitKind;
use crate::feed::junction::STOP;
use crate::feed::limits::AxisRules;
use crate::feed::profile::SpeedCap;
use crate::kinematics::{JointPath, JointState};
use crate::machine::AxisLimits;
use std::sync::Arc;

/// Time of an interval, as share of the shortest jerk phase from no acceleration to the greatest, and its bounds.
pub(super) const STEP_SHARE: f64 = 0.25;
const STEP_MIN_S: f64 = 5e-4;
pub(super) const STEP_MAX_S: f64 = 0.02;

/// An interval in a short ramp takes this long at least.
const RAMP_STEP_MIN_S: f64 = 5e-5;

/// A ramp whose speed grows by less than this share is not worth finer intervals.
const RAMP_MIN_SHARE: f64 = 0.1;

/// Within an interval the speed grows by this factor at most.
pub(super) const FASTER_MAX_RATIO: f64 = 1.18;

/// What the mean of the ends of an interval may miss of its middle, of the greatest demand.
const MISSED_RATIO: f64 = 0.07;

/// A demand that would hold the speed to this many times the one that is held for other reasons does not bind.
const UNBOUND_RATIO: f64 = 1.2;

/// Share of the limits that planning uses: what lies between the places of a curve may take the rest.
const LINE_RESERVE_RATIO: f64 = 0.998;
const CURVE_RESERVE_RATIO: f64 = 0.992;

/// An axis below this share of the greatest demands of all never comes near its limits.
const IDLE_SHARE: f64 = 1e-3;

/// Reserve of axis velocities, of the change of |q'| over an interval.
const VELOCITY_RESERVE_RATIO: f64 = 0.05;

/// q', q'', q''' at one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Derivatives {
    pub first: AxisVector,
    pub second: AxisVector,
    pub third: AxisVector,
}

/// What one axis allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AxisBound {
    pub axis: AxisId,
    pub acceleration_lu_s2: f64,
    /// `None` under BRISK.
    pub jerk_lu_s3: Option<f64>,
}

/// Limits of the axes that take part in a piece.
#[derive(Clone, Debug, PartialEq)]
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
    pub straight: bool,
}

impl Interval {
    /// From `range_lu[0]` to `range_lu[1]` of `path`, with the derivatives at start, middle and end.
    pub fn new(
        rules: &AxisRules,
        path: &JointPath,
        range_lu: [f64; 2],
        states: [Derivatives; 3],
        bounds: Arc<Bounds>,
        straight: bool,
    ) -> Self {
        Self {
            start_lu: range_lu[0],
            end_lu: range_lu[1],
            cap: cap(rules, path, &[&states[0], &states[1], &states[2]], range_lu[1] - range_lu[0]),
            states,
            reserve_ratio: if straight { LINE_RESERVE_RATIO } else { CURVE_RESERVE_RATIO },
            tightened: false,
            bounds,
            straight,
        }
    }

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

    /// The share that planning begins with.
    pub fn base_reserve_ratio(&self) -> f64 {
        if self.straight { LINE_RESERVE_RATIO } else { CURVE_RESERVE_RATIO }
    }

    /// A part of it, with the limits that it has by itself.
    pub fn part_by_itself(&self, rules: &AxisRules, path: &JointPath, start_lu: f64, end_lu: f64) -> Self {
        let part = self.part(path, start_lu, end_lu);
        Self {
            cap: cap(rules, path, &[&part.states[0], &part.states[1], &part.states[2]], part.length_lu()),
            reserve_ratio: self.base_reserve_ratio(),
            ..part
        }
    }

    /// Planning uses less of its limits from now on.
    pub fn tighten(&mut self, ratio: f64) {
        self.reserve_ratio *= ratio;
        self.tightened = true;
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

/// A short change of the speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ramp {
    /// How far it goes at most.
    pub way_lu: f64,
    /// Time of an interval in it.
    pub step_s: f64,
}

/// About what a motion may do along its tangent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tangent {
    pub acceleration_lu_s2: f64,
    pub jerk_lu_s3: f64,
    /// Time of an interval at most.
    pub step_s: f64,
    pub jerk_limited: bool,
}

impl Tangent {
    /// With the direction of one place.
    pub fn new(rules: &AxisRules, blend: bool, first: &AxisVector) -> Self {
        let acceleration = rules.largest(|axis, limits| first[axis].abs() / limits.acceleration_max_lu_s2);
        let jerk = rules.largest(|axis, limits| first[axis].abs() / jerk_of(limits, blend));
        let (acceleration_lu_s2, jerk_lu_s3) = (1.0 / acceleration.demand_ratio, 1.0 / jerk.demand_ratio);
        let jerk_limited = rules.jerk_limited;
        let phase_s = if jerk_limited { acceleration_lu_s2 / jerk_lu_s3 } else { STEP_MAX_S };
        let step_s = (STEP_SHARE * phase_s).clamp(STEP_MIN_S, STEP_MAX_S);
        Self { acceleration_lu_s2, jerk_lu_s3, step_s, jerk_limited }
    }

    /// Of a piece with these directions at its ends: what both of them allow, so that it is cut the same in either direction.
    pub fn between(rules: &AxisRules, blend: bool, ends: [&AxisVector; 2]) -> Self {
        let [from, to] = ends.map(|first| Self::new(rules, blend, first));
        Self {
            acceleration_lu_s2: from.acceleration_lu_s2.min(to.acceleration_lu_s2),
            jerk_lu_s3: from.jerk_lu_s3.min(to.jerk_lu_s3),
            step_s: from.step_s.min(to.step_s),
            jerk_limited: from.jerk_limited,
        }
    }

    /// The speed that is reached some way after `from_lu_s`.
    pub fn reached_lu_s(&self, from_lu_s: f64, way_lu: f64) -> f64 {
        let by_acceleration = (from_lu_s * from_lu_s + 2.0 * self.acceleration_lu_s2 * way_lu).sqrt();
        if !self.jerk_limited {
            return by_acceleration;
        }
        // s = j t³/6, v = j t²/2
        let by_jerk = from_lu_s + 0.5 * self.jerk_lu_s3 * (6.0 * way_lu / self.jerk_lu_s3).portable_cbrt().powi(2);
        by_acceleration.min(by_jerk)
    }

    /// A rise of the speed whose intervals must be shorter than the usual ones; its duration is that of two phases of constant jerk, or of one of constant
    /// acceleration. `None`: it is slow enough, or not worth it.
    pub fn short_ramp(&self, from_lu_s: f64, to_lu_s: f64) -> Option<Ramp> {
        let change_lu_s = to_lu_s - from_lu_s;
        let phase_s = if self.jerk_limited {
            (change_lu_s / self.jerk_lu_s3).sqrt()
        } else {
            change_lu_s / self.acceleration_lu_s2
        };
        let step_s = (STEP_SHARE * phase_s).max(RAMP_STEP_MIN_S);
        let worth = change_lu_s > RAMP_MIN_SHARE * to_lu_s && step_s < self.step_s;
        worth.then_some(Ramp { way_lu: (from_lu_s + to_lu_s) * phase_s, step_s })
    }

    /// The way from a speed to a stop.
    pub fn stop_lu(&self, speed_lu_s: f64) -> f64 {
        let ramp_s = speed_lu_s / self.acceleration_lu_s2
            + if self.jerk_limited { self.acceleration_lu_s2 / self.jerk_lu_s3 } else { 0.0 };
        0.5 * speed_lu_s * ramp_s
    }
}

fn jerk_of(limits: &AxisLimits, blend: bool) -> f64 {
    if blend { limits.transition_jerk_max_lu_s3 } else { limits.jerk_max_lu_s3 }
}

impl Bounds {
    /// Of all axes.
    pub fn new(rules: &AxisRules, blend: bool) -> Self {
        let bound = |(axis, limits): (AxisId, &AxisLimits)| AxisBound {
            axis,
            acceleration_lu_s2: limits.acceleration_max_lu_s2,
            jerk_lu_s3: rules.jerk_limited.then_some(jerk_of(limits, blend)),
        };
        Self {
            axes: AxisId::first(rules.axes.len()).zip(&rules.axes).map(bound).collect(),
            jerk_kind: if blend { LimitKind::TransitionJerk } else { LimitKind::Jerk },
            jerk_limited: rules.jerk_limited,
        }
    }

    /// Without the axes whose demands are next to nothing at all `states`, up to this speed and this acceleration along the path.
    pub fn without_idle<'a>(
        &self,
        states: impl Iterator<Item = &'a Derivatives> + Clone,
        top_lu_s: f64,
        acceleration_lu_s2: f64,
    ) -> Self {
        let v = top_lu_s;
        let demand = |bound: &AxisBound, state: &Derivatives| {
            let [first, second, third] =
                [&state.first, &state.second, &state.third].map(|derivative| derivative[bound.axis].abs());
            let (a, j) = (bound.acceleration_lu_s2, bound.jerk_lu_s3.unwrap_or(f64::INFINITY));
            [first / a, first / j, v * v * second / a, v.powi(3) * third / j, v * acceleration_lu_s2 * second / j]
        };
        // Each place by itself: where an axis begins to move another one leads.
        let idle = |bound: &AxisBound| {
            states.clone().all(|state| {
                let top =
                    |order: usize| self.axes.iter().map(|bound| demand(bound, state)[order]).fold(0.0_f64, f64::max);
                let tops = [top(0), top(1), 1.0, 1.0, 1.0];
                demand(bound, state).iter().zip(tops).all(|(demand, top)| *demand <= IDLE_SHARE * top)
            })
        };
        let axes = self.axes.iter().filter(|bound| !idle(bound)).copied().collect();
        Self { axes, ..*self }
    }

    /// The middle is what is between its neighbours, as far as it matters at a speed of `speed_lu_s`.
    pub fn smooth(&self, speed_lu_s: f64, [from, middle, to]: [&Derivatives; 3]) -> bool {
        let reference_lu_s = UNBOUND_RATIO * speed_lu_s;
        let mut most = [reference_lu_s.powi(-2), reference_lu_s.powi(-3)];
        let mut missed = [0.0_f64; 2];
        for bound in &self.axes {
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
}

/// Feed and axis velocities, all along what lies between the places, `length_lu` from the first to the last of three.
pub(super) fn cap(rules: &AxisRules, path: &JointPath, states: &[&Derivatives], length_lu: f64) -> SpeedCap {
    let share = |axis: AxisId| {
        let most = states.iter().fold(0.0_f64, |most, state| most.max(state.first[axis].abs()));
        let [from, middle, to] = states else { return most };
        // Between the three places by the parabola through them and by the cubics of each half, whose slopes are known, and by as much more as the
        // third derivative may add.
        let [left, centre, right] = [from, middle, to].map(|state| state.first[axis]);
        let (slope, bend) = (0.5 * (right - left), left - 2.0 * centre + right);
        let most = if slope.abs() < bend.abs() { most.max((centre - 0.5 * slope * slope / bend).abs()) } else { most };
        let half = |from: &Derivatives, to: &Derivatives| {
            let slopes = [from, to].map(|state| 0.5 * length_lu * state.second[axis]);
            most_of_cubic([from.first[axis], to.first[axis]], slopes)
        };
        let most = most.max(half(from, middle)).max(half(middle, to));
        most + VELOCITY_RESERVE_RATIO * (right - left).abs().max(bend.abs())
    };
    match path.contour.curve() {
        Some(curve) => rules.driven(rules.feed_cap(&path.contour.feed, curve), share),
        None => STOP,
    }
}

/// Greatest amount on \[0, 1\] of the cubic with these values and slopes at its ends.
fn most_of_cubic([start, end]: [f64; 2], [from, to]: [f64; 2]) -> f64 {
    let square = 3.0 * (end - start) - 2.0 * from - to;
    let cube = 2.0 * (start - end) + from + to;
    // 3 cube x² + 2 square x + from = 0, without a difference of equals.
    let root = (square * square - 3.0 * cube * from).max(0.0).sqrt();
    let sum = -(square + root.copysign(square));
    let value = |x: f64| start + x * (from + x * (square + x * cube));
    [sum / (3.0 * cube), from / sum]
        .into_iter()
        .filter(|x| (0.0..=1.0).contains(x))
        .fold(start.abs().max(end.abs()), |most, x| most.max(value(x).abs()))
}
