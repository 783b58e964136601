//! Demands along any curve, from samples that are dense where they change.
//!
//! In: a piece of path whose curve is smooth, the limits of the axes. Out: [`Scan`]: |q'|, |q''|, |q'''| of every axis at places in
//! order, their greatest over any stretch ([`Scan::worst`]), and the speed that they allow at each place.
//!
//! An interval is cut in two until the derivatives in its middle are those between its ends to [`MISSED_RATIO`] of the greatest
//! demand there (or of what would bind at all). A parabola that passes this test rises above its samples by a quarter of that at
//! most; [`RESERVE_RATIO`] is added for curves that are no parabola. This is a reserve, not a proof;
//! the tests check the limits by differences of set-points.
//! Does not choose where to change the speed: that is `split`.

use super::limits::{AxisRules, FeedCap};
use super::worst::Worst;
use crate::base::Portable;
use crate::base::{AXES_MAX, AxisId, AxisVector, PerAxis};
use crate::kinematics::{JointPath, JointState};

/// What linear interpolation between neighbours may miss of a demand.
const MISSED_RATIO: f64 = 0.02;

/// Reserve on the greatest sampled demand.
const RESERVE_RATIO: f64 = 1.03;

/// A demand that would hold the speed to this many times the one that is held for other reasons does not bind.
const UNBOUND_RATIO: f64 = 1.5;

/// An axis with a smaller part of the path's derivative does not take part in it.
const MOVES_MIN_RATIO: f64 = 1e-9;

/// Intervals between two nodes of the curve to begin with, and how often one may be cut.
const INTERVALS: usize = 4;
const CUTS_MAX: u32 = 16;

/// Places of one scan; where a curve asks for more, the rest stays coarse.
const PLACES_MAX: usize = 5000;

/// Derivatives at one place.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// From the start of the piece.
    pub s_lu: f64,
    state: JointState,
}

/// Samples of one piece, ends included.
#[derive(Clone, Debug)]
pub(super) struct Scan {
    places: Vec<Place>,
}

/// How demands are weighed: per axis, over what the axis allows for them at constant speed.
struct Scale<'a> {
    rules: &'a AxisRules,
    /// What is programmed.
    feed: FeedCap,
}

impl Scan {
    /// Samples `path`, whose curve has no step in direction or curvature inside; `feed` is what is programmed.
    pub(super) fn new(rules: &AxisRules, path: &JointPath, feed: FeedCap) -> Self {
        let scale = Scale { rules, feed };
        let length_lu = path.length_lu();
        let nodes = path.nodes_lu();
        let look = |s_lu: f64| Place { s_lu, state: path.at(s_lu) };
        let mut places = vec![look(0.0)];
        for end_lu in nodes.into_iter().chain([length_lu]) {
            let Some(start_lu) = places.last().map(|place| place.s_lu) else { break };
            for i in 1..=INTERVALS {
                let s_lu =
                    if i == INTERVALS { end_lu } else { start_lu + (end_lu - start_lu) * i as f64 / INTERVALS as f64 };
                let Some(before) = places.last().cloned() else { break };
                refine(&scale, &look, before, look(s_lu), &mut places);
            }
        }
        Self { places }
    }

    /// In order.
    pub(super) fn places(&self) -> &[Place] {
        &self.places
    }

    /// Greatest demands from one place to another, with the reserve for what lies between them. With `path_of` every linear axis of it
    /// that moves there has the acceleration and jerk of the whole path, not its share (`limits = "path"`).
    pub(super) fn worst(&self, first: usize, last: usize, path_of: Option<&PerAxis<bool>>) -> Worst {
        let [mut d1, mut d2, mut d3] = [AxisVector::zero(); 3];
        for place in self.places.get(first..=last).unwrap_or(&[]) {
            let state = &place.state;
            for (most, next) in [(&mut d1, state.first), (&mut d2, state.second), (&mut d3, state.third)] {
                let path = path_of.map(|linear| (linear, next.masked(linear).norm()));
                for axis in AxisId::first(AXES_MAX) {
                    let share = match path {
                        Some((linear, whole)) if linear[axis] && next[axis].abs() > MOVES_MIN_RATIO * whole => whole,
                        _ => next[axis].abs(),
                    };
                    // A NaN stays, so that the planner refuses it.
                    if share > most[axis] || share.is_nan() {
                        most[axis] = share;
                    }
                }
            }
        }
        Worst::new(d1 * RESERVE_RATIO, d2 * RESERVE_RATIO, d3 * RESERVE_RATIO)
    }

    /// Highest constant speed at each place, the feed where nothing else binds.
    pub(super) fn speeds_lu_s(&self, rules: &AxisRules, feed: FeedCap) -> Vec<f64> {
        let scale = Scale { rules, feed };
        self.places.iter().map(|place| scale.speed_lu_s(&place.state)).collect()
    }
}

/// Puts the places after `from` up to `to` into `places`, as many as it takes.
fn refine(scale: &Scale<'_>, look: &impl Fn(f64) -> Place, from: Place, to: Place, places: &mut Vec<Place>) {
    let mut from = from;
    let mut waiting = vec![(to, 0)];
    while let Some((to, cuts)) = waiting.pop() {
        let middle = look(0.5 * (from.s_lu + to.s_lu));
        let enough = cuts >= CUTS_MAX || places.len() + waiting.len() >= PLACES_MAX;
        if enough || scale.between(&from.state, &middle.state, &to.state) {
            places.push(middle);
            places.push(to.clone());
            from = to;
        } else {
            waiting.push((to, cuts + 1));
            waiting.push((middle, cuts + 1));
        }
    }
}

impl Scale<'_> {
    /// Demand of an axis for the second and third derivative, per v² and v³.
    fn demands(&self, state: &JointState, axis: AxisId) -> [f64; 2] {
        let limits = &self.rules.axes[axis.index()];
        let second = state.second[axis] / (self.rules.radial_acceleration_share * limits.acceleration_max_lu_s2);
        let third = state.third[axis] / (self.rules.radial_jerk_share * limits.jerk_max_lu_s3);
        [second, if self.rules.jerk_limited { third } else { 0.0 }]
    }

    /// The middle is what is between its neighbours.
    fn between(&self, from: &JointState, middle: &JointState, to: &JointState) -> bool {
        let reference_lu_s = UNBOUND_RATIO * self.driven_lu_s(middle).min(self.driven_lu_s(from));
        let mut most = [reference_lu_s.powi(-2), reference_lu_s.powi(-3)];
        let mut missed = [0.0_f64; 2];
        for axis in AxisId::first(self.rules.axes.len()) {
            let [a, m, b] = [from, middle, to].map(|state| self.demands(state, axis));
            for order in 0..2 {
                missed[order] = missed[order].max((m[order] - 0.5 * (a[order] + b[order])).abs());
                most[order] = most[order].max(m[order].abs()).max(a[order].abs()).max(b[order].abs());
            }
        }
        missed[0] <= MISSED_RATIO * most[0] && missed[1] <= MISSED_RATIO * most[1]
    }

    /// Highest speed without regard to the bend.
    fn driven_lu_s(&self, state: &JointState) -> f64 {
        self.rules.driven(self.feed, |axis| state.first[axis].abs()).velocity_lu_s
    }

    fn speed_lu_s(&self, state: &JointState) -> f64 {
        let mut speed_lu_s = self.driven_lu_s(state);
        for axis in AxisId::first(self.rules.axes.len()) {
            let [second, third] = self.demands(state, axis);
            speed_lu_s = speed_lu_s.min(1.0 / second.abs().sqrt()).min(1.0 / third.abs().portable_cbrt());
        }
        speed_lu_s
    }
}
