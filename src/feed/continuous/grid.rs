//! A piece of path as intervals of s, fine enough that what the axes allow hardly changes from one place to the next.
//!
//! In: a [`JointPath`], the limits of its axes, how fast it is about at its ends. Out: a [`Grid`]: [`Interval`]s in order, each with q', q'',
//! q''' at its start, middle and end, the speed that feed and axis velocities allow, and the share of the other limits that planning may use. An
//! interval is cut in two until the middle is what its ends make one expect ([`Bounds::smooth`]), and until it takes no longer
//! than a part of a jerk phase where the speed may have to change. At a rest stands a short interval for the start, whose law is one of
//! constant jerk.
//! Does not plan the speed; the limits between the places are checked after planning (`held`).

use super::interval::{Bounds, Derivatives, FASTER_MAX_RATIO, Interval, STEP_MAX_S, STEP_SHARE, Tangent, cap};
use crate::base::AxisId;
use crate::base::Portable;
use crate::feed::limits::AxisRules;
use crate::geometry::Curve;
use crate::kinematics::JointPath;
use std::sync::Arc;

/// At a rest it takes at most this share of the least time for the piece.
const SHORT_STEP_SHARE: f64 = 0.04;

/// Away from the ends of a piece an interval takes at most this share of the time to the nearer end.
const GROWTH_SHARE: f64 = 0.3;

/// The middle alone says too little about a curve; polynomials are cut at their nodes anyway, once at least.
const POLYNOMIAL_CUTS: u32 = 0;
const POLYNOMIAL_BLEND_CUTS: u32 = 1;
const MAPPED_CUTS: u32 = 1;
const BLEND_CUTS: u32 = 2;

/// Where a piece is looked at for its slow places.
const SLOW_PLACES_SHARE: [f64; 3] = [0.3, 0.5, 0.7];

/// Cuts of an interval at most, and intervals of a piece beyond which it stays coarse.
const CUTS_MAX: u32 = 40;
const INTERVALS_MAX: usize = 20_000;

/// An interval that is no longer than this share of its piece stays whole: places on it are not known any better (`geometry::arc_length`). Around a step of
/// curvature that stands at no knot, as in the middle of a blend that all but turns back, it would be cut until nothing is left.
const SHORTEST_SHARE: f64 = 1e-9;

/// Within an interval the jerk that the axes allow along the tangent changes by this factor at most: where a slow axis takes over from a fast one the
/// profile does so, too. Chosen: a factor of 1.4, as in a bend between two like axes, must not cut.
const STEADY_MAX_RATIO: f64 = 2.0;

/// The interval at a rest is at most this share of its piece.
const REST_SHARE: f64 = 0.15;

/// At its moving end the speed is at most this share of the highest there: what is left of the ramp has its own intervals.
const REST_SPEED_SHARE: f64 = 0.3;

/// How often it is halved to find a smooth one.
const REST_CUTS_MAX: usize = 16;

/// Intervals are short up to this share beyond the way that a change is expected to take.
const SETTLED_SHARE: f64 = 0.3;

/// There an interval takes this share of the usual time.
const SETTLING_STEP_RATIO: f64 = 0.5;

/// Knots nearer to each other than this share of the piece are one.
const KNOT_MIN_SHARE: f64 = 1e-7;

/// Beside a knot of a spline its derivatives are taken this share of the range inside.
const BESIDE_RATIO: f64 = 1e-9;

/// All intervals of a piece.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub intervals: Vec<Interval>,
    /// The first, the last interval is that of a start from rest, of a stop.
    pub rests: [bool; 2],
    /// The way that a stop from its highest speed takes, about.
    pub stop_lu: f64,
    /// It was made for this speed at its end while nothing was known of what comes after it.
    pub open_lu_s: Option<f64>,
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
    /// At its start the speed still changes.
    pub settling: Settling,
}

/// A change of the speed at the start of a stretch, whatever its ends allow.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Settling {
    /// The way that it takes, about; 0: there is none.
    pub way_lu: f64,
    /// The speed that it begins with.
    pub speed_lu_s: f64,
}

impl Settling {
    /// No more than the speed on the way down, some way after its start; `None` well beyond its end.
    pub fn speed_at(&self, way_lu: f64) -> Option<f64> {
        let left_share = 1.0 - way_lu / self.way_lu;
        (left_share > -SETTLED_SHARE).then(|| self.speed_lu_s * left_share.max(0.0))
    }

    /// What is left of it some way after its start.
    pub fn after(&self, way_lu: f64) -> Self {
        match self.speed_at(way_lu) {
            Some(speed_lu_s) if speed_lu_s > 0.0 => Self { way_lu: self.way_lu - way_lu, speed_lu_s },
            _ => Self::default(),
        }
    }
}

impl Stretch {
    /// All of a piece.
    pub fn whole(path: &JointPath, ends: [End; 2]) -> Self {
        Self { from_lu: 0.0, to_lu: path.length_lu(), ends, settling: Settling::default() }
    }

    fn length_lu(&self) -> f64 {
        self.to_lu - self.from_lu
    }
}

/// Limits and curve of a piece while it is cut.
struct Cutter<'a> {
    rules: &'a AxisRules,
    path: &'a JointPath,
    blend: bool,
    /// What is cut.
    stretch: Stretch,
    /// A straight piece has the same derivatives everywhere.
    straight: Option<Derivatives>,
    bounds: Arc<Bounds>,
    tangent: Tangent,
    top_lu_s: f64,
    /// Knots too near to another border for an interval of their own.
    passed_lu: Vec<f64>,
    intervals: Vec<Interval>,
}

impl Grid {
    /// Cuts a stretch of `path`, which moves and has no step of direction or curvature inside.
    pub fn new(rules: &AxisRules, path: &JointPath, blend: bool, stretch: Stretch) -> Self {
        Cutter::new(rules.throughout(path), path, blend, stretch).cut()
    }
}

/// Highest constant speed at a place: feed and axis velocities, and the bend.
pub(super) fn constant_speed_lu_s(rules: &AxisRules, path: &JointPath, state: &Derivatives) -> f64 {
    let mut speed_lu_s = cap(rules, path, &[state], 0.0).velocity_lu_s;
    for (axis, limits) in AxisId::first(rules.axes.len()).zip(&rules.axes) {
        speed_lu_s = speed_lu_s.min((limits.acceleration_max_lu_s2 / state.second[axis].abs()).sqrt());
        if rules.jerk_limited {
            speed_lu_s = speed_lu_s.min((limits.jerk_max_lu_s3 / state.third[axis].abs()).portable_cbrt());
        }
    }
    speed_lu_s
}

/// About the highest speeds at both ends of a piece that begins with `start`: from its slow places on they grow with constant jerk. `places_lu_s`: the
/// highest constant ones there.
pub(super) fn end_speeds_lu_s(
    rules: &AxisRules,
    path: &JointPath,
    start: Derivatives,
    places_lu_s: [f64; 2],
) -> [f64; 2] {
    if path.is_straight() {
        return places_lu_s;
    }
    let rules = rules.throughout(path);
    let length_lu = path.length_lu();
    let speed_at = |s_lu: f64| constant_speed_lu_s(rules, path, &Derivatives::from(path.at(s_lu)));
    let mut ends_lu_s = places_lu_s;
    let jerk = rules.largest(|axis, limits| start.first[axis].abs() / limits.jerk_max_lu_s3);
    let jerk_lu_s3 = if rules.jerk_limited { 1.0 / jerk.demand_ratio } else { f64::INFINITY };
    for share in SLOW_PLACES_SHARE {
        let s_lu = share * length_lu;
        let speed_lu_s = speed_at(s_lu);
        for (end_lu_s, distance_lu) in ends_lu_s.iter_mut().zip([s_lu, length_lu - s_lu]) {
            *end_lu_s =
                end_lu_s.min(speed_lu_s + 0.5 * jerk_lu_s3 * (6.0 * distance_lu / jerk_lu_s3).portable_cbrt().powi(2));
        }
    }
    ends_lu_s
}

impl<'a> Cutter<'a> {
    fn new(rules: &'a AxisRules, path: &'a JointPath, blend: bool, stretch: Stretch) -> Self {
        let length_lu = stretch.length_lu();
        let start = Derivatives::from(path.at(stretch.from_lu));
        let straight = path.is_straight().then_some(start);
        let end = straight.unwrap_or_else(|| Derivatives::from(path.at(stretch.to_lu)));
        let tangent = Tangent::between(rules, blend, [&start.first, &end.first]);
        // From rest to rest in four phases of constant jerk, or in two of constant acceleration: the least that the piece can take.
        let alone_s = if tangent.jerk_limited {
            (32.0 * length_lu / tangent.jerk_lu_s3).portable_cbrt()
        } else {
            2.0 * (length_lu / tangent.acceleration_lu_s2).sqrt()
        };
        let rests = stretch.ends.contains(&End::Rest);
        let step_max_s = if rests { STEP_MAX_S.min(SHORT_STEP_SHARE * alone_s) } else { STEP_MAX_S };
        Self {
            rules,
            path,
            blend,
            stretch,
            straight,
            bounds: Arc::new(Bounds::new(rules, blend)),
            tangent: Tangent { step_s: tangent.step_s.min(step_max_s), ..tangent },
            top_lu_s: cap(rules, path, &[&start], 0.0).velocity_lu_s,
            passed_lu: Vec::new(),
            intervals: Vec::new(),
        }
    }

    fn cut(mut self) -> Grid {
        let Stretch { from_lu, to_lu, ends, .. } = self.stretch;
        let mut borders = vec![from_lu];
        let rests = ends.map(|end| end == End::Rest);
        if rests[0] {
            borders.push(from_lu + self.rest_lu(from_lu, 1.0));
        }
        let stop_lu = if rests[1] { self.rest_lu(to_lu, -1.0) } else { 0.0 };
        let inside = [borders[borders.len() - 1], to_lu - stop_lu];
        let knots: Vec<f64> = match self.path.contour.curve() {
            // Also where the quadrature had to be cut: there the curve changes most, if only over a thousandth of it.
            Some(Curve::Polynomial(curve)) if self.path.is_contour() => curve.nodes_lu().collect(),
            _ if self.path.is_contour() => Vec::new(),
            _ => self.path.nodes_lu(),
        };
        // Knots that are one but for rounding make no interval: nothing happens between them, and a number divided by their distance is none.
        let knot_min_lu = KNOT_MIN_SHARE * self.path.length_lu();
        for s_lu in knots {
            let before_lu = borders[borders.len() - 1];
            if s_lu > before_lu + knot_min_lu && s_lu < inside[1] - knot_min_lu {
                borders.push(s_lu);
            } else if s_lu > from_lu && s_lu < to_lu {
                self.passed_lu.push(s_lu);
            }
        }
        if rests[1] {
            borders.push(to_lu - stop_lu);
        }
        borders.push(to_lu);
        for range in borders.windows(2) {
            self.cut_range(range[0], range[1]);
        }
        self.drop_idle_axes();
        let half_lu = 0.5 * self.stretch.length_lu();
        let v = ends.iter().fold(self.top_lu_s, |v, end| v.min(self.reached_lu_s(*end, half_lu)));
        let way_lu = self.tangent.stop_lu(v);
        Grid { intervals: self.intervals, rests, stop_lu: way_lu, open_lu_s: None }
    }

    /// Length of the interval at a rest, from there in this direction; shorter where the curve changes fast.
    fn rest_lu(&self, rest_lu: f64, direction: f64) -> f64 {
        let Tangent { acceleration_lu_s2, jerk_lu_s3, step_s: t, jerk_limited } = self.tangent;
        let held_lu_s = constant_speed_lu_s(self.rules, self.path, &self.look(rest_lu));
        let lu = if jerk_limited {
            let t = t.min((2.0 * REST_SPEED_SHARE * held_lu_s / jerk_lu_s3).sqrt());
            jerk_lu_s3 * t.powi(3) / 6.0
        } else {
            let t = t.min(REST_SPEED_SHARE * held_lu_s / acceleration_lu_s2);
            acceleration_lu_s2 * t * t / 2.0
        };
        let longest_lu = lu.min(REST_SHARE * self.stretch.length_lu());
        let smooth = |length_lu: &f64| {
            let [from, middle, to] = [0.0, 0.5, 1.0].map(|share| self.look(rest_lu + direction * share * length_lu));
            self.smooth(&from, &middle, &to)
        };
        let mut shorter =
            std::iter::successors(Some(longest_lu), |length_lu| Some(0.5 * length_lu)).take(REST_CUTS_MAX);
        shorter.find(smooth).unwrap_or(longest_lu)
    }

    fn cut_range(&mut self, start_lu: f64, end_lu: f64) {
        let inside = BESIDE_RATIO * (end_lu - start_lu);
        let near = |s_lu: f64, place_lu: f64| (s_lu - place_lu).abs() <= KNOT_MIN_SHARE * self.path.length_lu();
        let last = self.passed_lu.iter().copied().filter(|s_lu| near(*s_lu, start_lu)).reduce(f64::max);
        let first = self.passed_lu.iter().copied().filter(|s_lu| near(*s_lu, end_lu)).reduce(f64::min);
        let at_start = match last.map_or(start_lu, |s_lu| s_lu.max(start_lu)) {
            start_lu if start_lu > 0.0 => self.look(start_lu + inside),
            _ => self.look(0.0),
        };
        let at_end = match first.map_or(end_lu, |s_lu| s_lu.min(end_lu)) {
            end_lu if end_lu < self.path.length_lu() => self.look(end_lu - inside),
            _ => self.look(end_lu),
        };
        let Stretch { from_lu, to_lu, ends, .. } = self.stretch;
        let rest = (ends[0] == End::Rest && start_lu == from_lu)
            || (ends[1] == End::Rest && end_lu == to_lu && start_lu > from_lu);
        let mut from = (start_lu, at_start);
        let mut waiting = vec![((end_lu, at_end), 0)];
        let cuts_min = self.cuts_min();
        while let Some((to, cuts)) = waiting.pop() {
            let middle_lu = 0.5 * (from.0 + to.0);
            let middle = self.look(middle_lu);
            let short = to.0 - from.0 <= SHORTEST_SHARE * self.path.length_lu();
            let enough = short || cuts >= CUTS_MAX || self.intervals.len() + waiting.len() >= INTERVALS_MAX;
            if rest
                || enough
                || (cuts >= cuts_min
                    && self.quick(from.0, to.0, &middle)
                    && self.steady(&from.1, &to.1)
                    && self.smooth(&from.1, &middle, &to.1))
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
            Some(Curve::Polynomial(_)) => {
                if self.blend {
                    POLYNOMIAL_BLEND_CUTS
                } else {
                    POLYNOMIAL_CUTS
                }
            }
            Some(_) => BLEND_CUTS,
        }
    }

    fn push(&mut self, from: (f64, Derivatives), middle: Derivatives, to: (f64, Derivatives)) {
        let states = [from.1, middle, to.1];
        let interval =
            Interval::new(self.rules, self.path, [from.0, to.0], states, self.bounds.clone(), self.straight.is_some());
        self.top_lu_s = self.top_lu_s.max(interval.cap.velocity_lu_s);
        self.intervals.push(interval);
    }

    fn look(&self, s_lu: f64) -> Derivatives {
        self.straight.unwrap_or_else(|| Derivatives::from(self.path.at(s_lu)))
    }

    /// The interval takes no longer than it may.
    fn quick(&self, start_lu: f64, end_lu: f64, middle: &Derivatives) -> bool {
        let middle_lu = 0.5 * (start_lu + end_lu);
        let held_lu_s = constant_speed_lu_s(self.rules, self.path, middle);
        let distances = [middle_lu - self.stretch.from_lu, self.stretch.to_lu - middle_lu];
        let mut speed_lu_s = held_lu_s;
        let half_lu = 0.5 * (end_lu - start_lu);
        let mut near_s = f64::INFINITY;
        let mut ramp_s = 0.0_f64;
        let mut step_s = self.tangent.step_s;
        for (end, distance_lu) in self.stretch.ends.iter().zip(distances) {
            let reached_lu_s = self.reached_lu_s(*end, distance_lu);
            let nearer_lu_s = self.reached_lu_s(*end, distance_lu - half_lu);
            let further_lu_s = self.reached_lu_s(*end, distance_lu + half_lu).min(held_lu_s);
            if further_lu_s > FASTER_MAX_RATIO * nearer_lu_s {
                return false;
            }
            speed_lu_s = speed_lu_s.min(reached_lu_s);
            near_s = near_s.min(distance_lu / held_lu_s);
            let from_lu_s = if let End::Speed(v) = end { v.min(held_lu_s) } else { 0.0 };
            let phase_s = self.tangent.step_s / STEP_SHARE;
            ramp_s = ramp_s.max((held_lu_s - from_lu_s) / self.tangent.acceleration_lu_s2 + phase_s);
            if let Some(ramp) = self.tangent.short_ramp(from_lu_s, held_lu_s)
                && distance_lu - half_lu <= ramp.way_lu
            {
                step_s = step_s.min(ramp.step_s);
            }
        }
        let mut away_s = GROWTH_SHARE * (near_s - ramp_s).max(0.0);
        if let Some(settling_lu_s) = self.stretch.settling.speed_at(distances[0]) {
            (speed_lu_s, step_s, away_s) = (speed_lu_s.max(settling_lu_s), SETTLING_STEP_RATIO * step_s, 0.0);
        }
        end_lu - start_lu <= speed_lu_s * step_s.max(away_s)
    }

    /// The jerk that the axes allow along the tangent is about the same at both ends of an interval.
    fn steady(&self, from: &Derivatives, to: &Derivatives) -> bool {
        if self.straight.is_some() {
            return true;
        }
        let demand = |state: &Derivatives| {
            self.rules.largest(|axis, limits| state.first[axis].abs() / limits.jerk_max_lu_s3).demand_ratio
        };
        let (from, to) = (demand(from), demand(to));
        from.max(to) <= STEADY_MAX_RATIO * from.min(to)
    }

    /// About the speed that is reached at a distance from an end.
    fn reached_lu_s(&self, end: End, distance_lu: f64) -> f64 {
        let from_lu_s = match end {
            End::Speed(v) => v,
            End::Rest => 0.0,
        };
        self.tangent.reached_lu_s(from_lu_s, distance_lu)
    }

    /// The middle is what is between its neighbours.
    fn smooth(&self, from: &Derivatives, middle: &Derivatives, to: &Derivatives) -> bool {
        self.straight.is_some()
            || self.bounds.smooth(cap(self.rules, self.path, &[middle], 0.0).velocity_lu_s, [from, middle, to])
    }

    /// Takes out the axes whose demands are next to nothing all along.
    fn drop_idle_axes(&mut self) {
        let states = self.intervals.iter().flat_map(|interval| &interval.states);
        let bounds = Arc::new(self.bounds.without_idle(states, self.top_lu_s, self.tangent.acceleration_lu_s2));
        for interval in &mut self.intervals {
            interval.bounds = bounds.clone();
        }
    }
}
