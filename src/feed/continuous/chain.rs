//! Intervals from where the path is to where it can rest, as a problem for the interior-point method, and its solution.
//!
//! In: a [`Chain`] of [`Interval`]s with the state at its start. Out: its [`Profile`]: b = v² and its slope at every border, b'' in every interval, from
//! which speed, acceleration and jerk follow at each place (models/feed-planning.md section 1):
//!
//! ```text
//! v = √b    a = b'/2    j = √b b''/2
//! |q'' b + q' b'/2| <= A       |q''' b + 3/2 q'' b' + 1/2 q' b''| <= J/√b
//! ```
//!
//! J/√b is convex in b: its tangent at an earlier solution `b̂` lies below it, `J/√b̂ (3/2 - b/(2 b̂))`, so that every solution of the linear
//! problem obeys the true limit, and the next tangent is a better one. From rest the path starts with constant jerk: `s = j t³/6`, so that b goes
//! with s^(4/3) (with s under BRISK): at the end of the first interval, h long, `b' = 4/3 b/h`, and the largest b there is that of the largest
//! jerk. A stop is the same backwards.
//! Does not know pieces, windows or time laws.

use super::grid::{Derivatives, Interval};
use super::interior_point::{Outcome, Problem, Solver, Transition};
use crate::feed::Limit;

/// State on the path: b = v² and b' = 2 a.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PathPoint {
    pub speed_squared_lu2_s2: f64,
    pub slope_lu_s2: f64,
}

/// How the chain begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Start {
    /// At rest: the first interval is that of the start.
    Rest,
    /// Moving.
    At(PathPoint),
}

/// What is planned at once. The last interval is that of the stop.
#[derive(Clone, Debug, Default)]
pub(super) struct Chain {
    pub intervals: Vec<Interval>,
    /// Highest b at the start of each interval, from junctions; infinite where there is none.
    pub junctions: Vec<Junction>,
}

/// What a border between pieces allows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Junction {
    pub speed_squared_lu2_s2: f64,
    pub limit: Limit,
}

/// The solution: borders of all intervals, and b'' between them.
#[derive(Clone, Debug, Default)]
pub(super) struct Profile {
    /// One more than intervals; at a rest b and b' are 0.
    pub points: Vec<PathPoint>,
    /// b'' (1/s²) of every interval; 0 for those of start and stop.
    pub bends_per_s2: Vec<f64>,
}

/// Solutions within this share of the time are one.
const GAP_MAX_RATIO: f64 = 2e-4;

/// Rounds of tangents.
const ROUNDS_MAX: u32 = 3;

/// Where b is by no more than this away from its estimate the tangent is good enough: it misses 3/8 of the square of it.
const STRAY_MAX_SHARE: f64 = 0.12;

/// Attempts with tighter limits where those between the places do not hold.
const ATTEMPTS_MAX: u32 = 6;

/// How far below the share that would just do.
const TIGHTER_RATIO: f64 = 0.995;

/// By how much limits give way, of what planning does not use of them anyway.
const LOOSER_RATIOS: [f64; 3] = [0.0, 2e-4, 1.5e-3];

/// Share of the estimate to begin with.
const START_RATIO: f64 = 0.95;

/// b stays above this share of its estimate.
const LOWEST_RATIO: f64 = 1e-6;

/// Rounds for the time of an interval in the first estimate.
const PACE_ROUNDS: usize = 3;

/// Derivatives on the curve of an interval, by its number and s from the start of its piece.
pub(super) type Look<'a> = dyn Fn(usize, f64) -> Derivatives + 'a;

/// A limit that is used so far at the eighths of an interval holds between them.
const HELD_RATIO: f64 = 0.9995;

/// Above this use of a limit the curve itself is looked at.
const NEAR_RATIO: f64 = 0.9;

/// Memory for planning, used again and again.
#[derive(Clone, Debug, Default)]
pub(super) struct Planning {
    problem: Problem,
    solver: Solver,
    /// b̂ at the borders.
    estimate: Vec<f64>,
    caps: Vec<f64>,
}

/// Exponent of b at a rest: constant jerk, constant acceleration under BRISK.
fn ray_exponent(interval: &Interval) -> f64 {
    if interval.bounds.jerk_limited { 4.0 / 3.0 } else { 1.0 }
}

impl Chain {
    fn control_range(&self, start: Start) -> std::ops::Range<usize> {
        usize::from(start == Start::Rest)..self.intervals.len().saturating_sub(1)
    }
}

impl Planning {
    /// The fastest profile of a chain from `start`; `None` if none was found that keeps every limit. `hint`: states at the first borders on a way
    /// that is known to keep them, if there is one. Limits are tightened in the chain where the first attempts exceed them between two
    /// places; `look` gives the derivatives on the curve of an interval.
    pub fn plan(&mut self, chain: &mut Chain, start: Start, hint: &[PathPoint], look: &Look<'_>) -> Option<Profile> {
        let range = chain.control_range(start);
        if range.is_empty() || !self.prepare(chain, start, hint) {
            return None;
        }
        let mut attempts = 0;
        for round in 0.. {
            if !self.solve(chain, start, &range) {
                return None;
            }
            let profile = self.profile(chain, start);
            if round + 1 < ROUNDS_MAX && self.strays(&profile, &range) {
                self.take_estimate(&profile, &range);
                continue;
            }
            if tighten(chain, &profile, &range, look) {
                return Some(profile);
            }
            attempts += 1;
            if attempts > ATTEMPTS_MAX {
                return None;
            }
            self.take_estimate(&profile, &range);
        }
        None
    }

    /// Caps and first estimates; false where a number is none.
    fn prepare(&mut self, chain: &Chain, start: Start, hint: &[PathPoint]) -> bool {
        let Range { first, last } = Range::of(chain, start);
        let intervals = &chain.intervals;
        self.caps.clear();
        self.caps.extend((first..=last).map(|i| {
            let before = i.checked_sub(1).map_or(f64::INFINITY, |i| intervals[i].cap.velocity_lu_s);
            let own = intervals[i].cap.velocity_lu_s.min(before);
            (own * own).min(chain.junctions[i].speed_squared_lu2_s2)
        }));
        let count = last - first;
        if start == Start::Rest {
            self.caps[0] = self.caps[0].min(ray_cap(&intervals[0]));
        }
        self.caps[count] = self.caps[count].min(ray_cap(&intervals[last]));
        self.estimate.clear();
        for i in first..=last {
            let mut b = self.caps[i - first];
            let sides = [i.checked_sub(1).map(|i| (&intervals[i], 2)), Some((&intervals[i], 0))];
            for (interval, place) in sides.into_iter().flatten() {
                b = b.min(bend_cap(interval, &interval.states[place]));
            }
            self.estimate.push(b);
        }
        let known = hint.iter().skip(first).map(|point| point.speed_squared_lu2_s2).take_while(|b| *b > 0.0);
        let mut hinted = 0;
        for (estimate, known) in self.estimate.iter_mut().zip(known) {
            *estimate = known;
            hinted += 1;
        }
        if let Start::At(point) = start {
            self.estimate[0] = point.speed_squared_lu2_s2;
            hinted = hinted.max(1);
        }
        let mut pace = Pace::default();
        for k in hinted.max(1)..=count {
            self.estimate[k] = pace.next(&intervals[first + k - 1], self.estimate[k - 1], self.estimate[k]);
        }
        let mut pace = Pace::default();
        for k in (hinted..count).rev() {
            self.estimate[k] = pace.next(&intervals[first + k], self.estimate[k + 1], self.estimate[k]);
        }
        self.estimate.iter().chain(&self.caps).all(|b| *b > 0.0 && !b.is_nan())
            && self.estimate.iter().all(|b| b.is_finite())
    }

    fn take_estimate(&mut self, profile: &Profile, range: &std::ops::Range<usize>) {
        for (estimate, point) in self.estimate.iter_mut().zip(&profile.points[range.start..=range.end]) {
            *estimate = point.speed_squared_lu2_s2;
        }
    }

    /// Anywhere the solution is far from where the tangents were laid.
    fn strays(&self, profile: &Profile, range: &std::ops::Range<usize>) -> bool {
        let points = &profile.points[range.start..=range.end];
        let far = |(estimate, point): (&f64, &PathPoint)| {
            (point.speed_squared_lu2_s2 / estimate - 1.0).abs() > STRAY_MAX_SHARE
        };
        self.estimate.iter().zip(points).any(far)
    }

    /// The linear problem around the estimate.
    fn pose(&mut self, chain: &Chain, start: Start) {
        let Range { first, last } = Range::of(chain, start);
        let count = last - first;
        let intervals = &chain.intervals;
        let Self { problem, estimate, caps, .. } = self;
        problem.clear();
        let scale = |k: usize| Scale::new(estimate[k], intervals[first + k.min(count - 1)].length_lu());
        let stop_lu = intervals[last].length_lu();
        let mut total = 0.0;
        for k in 0..=count {
            let before_lu = if k > 0 {
                intervals[first + k - 1].length_lu()
            } else if start == Start::Rest {
                6.0 * intervals[0].length_lu()
            } else {
                0.0
            };
            let after_lu = if k < count { intervals[first + k].length_lu() } else { 6.0 * stop_lu };
            let cost = 0.5 * (before_lu + after_lu) / estimate[k].sqrt();
            total += cost;
            problem.costs_ratio.push(cost);
        }
        problem.costs_ratio.iter_mut().for_each(|cost| *cost /= total);
        for k in 0..=count {
            let mut node = NodeRows { problem, scale: scale(k), fixed: k == 0 && start != Start::Rest };
            node.state(caps[k], k.checked_sub(1).map(|k| &intervals[first + k]), &intervals[first + k]);
            if k < count {
                let interval = &intervals[first + k];
                node.interval(interval, [estimate[k], estimate[k + 1]]);
                let transition = scale(k).to(&scale(k + 1), interval.length_lu());
                if k + 1 == count {
                    let exponent = ray_exponent(&intervals[last]);
                    let (feedback, closed) = scale(k + 1).onto_stop(&transition, exponent / stop_lu);
                    problem.without_control(feedback);
                    problem.transitions.push(closed);
                } else {
                    problem.transitions.push(transition);
                }
            }
            problem.end_node();
        }
    }

    /// Solves the problem around the estimate. From a state that uses its limits to the full nothing may be possible but for rounding: the reserve
    /// gives way a little.
    fn solve(&mut self, chain: &Chain, start: Start, range: &std::ops::Range<usize>) -> bool {
        let looser: &[f64] = if start == Start::Rest { &[0.0] } else { &LOOSER_RATIOS };
        looser.iter().any(|by_ratio| {
            self.pose(chain, start);
            self.start_solver(chain, range);
            self.fix_start(chain, start);
            self.problem.loosen(*by_ratio);
            self.solver.solve(&mut self.problem, GAP_MAX_RATIO) == Outcome::Solved
        })
    }

    /// A little below the estimate, with the slopes that it has.
    fn start_solver(&mut self, chain: &Chain, range: &std::ops::Range<usize>) {
        let (first, count) = (range.start, range.len());
        let estimate = &self.estimate;
        let length_lu = |k: usize| chain.intervals[first + k].length_lu();
        let slope = |k: usize| {
            let (low, high) = (k.saturating_sub(1), (k + 1).min(count));
            (estimate[high] - estimate[low]) / (low..high).map(length_lu).sum::<f64>()
        };
        // Without bends: what is missing in the transitions does less harm than a wild bend where the grid is fine.
        let states = (0..=count).map(|k| {
            let scale = Scale::new(estimate[k], length_lu(k.min(count - 1)));
            ([START_RATIO, START_RATIO * slope(k) / scale.slope], 0.0)
        });
        self.solver.start(states);
    }

    /// The exact first state, or a point of the ray that it lies on.
    fn fix_start(&mut self, chain: &Chain, start: Start) {
        let scale = Scale::new(self.estimate[0], chain.intervals[usize::from(start == Start::Rest)].length_lu());
        let state = match start {
            Start::At(point) => scale.scaled(&point),
            Start::Rest => {
                let ray =
                    [1.0, ray_exponent(&chain.intervals[0]) / chain.intervals[0].length_lu() * scale.b / scale.slope];
                self.problem.start_ray_ratio = Some(ray);
                ray.map(|component| 0.9 * component)
            }
        };
        self.solver.set_first(state);
    }

    fn profile(&self, chain: &Chain, start: Start) -> Profile {
        let Range { first, last } = Range::of(chain, start);
        let count = last - first;
        let rest = PathPoint { speed_squared_lu2_s2: 0.0, slope_lu_s2: 0.0 };
        let mut profile = Profile::default();
        if start == Start::Rest {
            profile.points.push(rest);
            profile.bends_per_s2.push(0.0);
        }
        for k in 0..=count {
            let length_lu = chain.intervals[first + k.min(count - 1)].length_lu();
            let scale = Scale::new(self.estimate[k], length_lu);
            let [b, slope] = self.solver.state_ratio(k);
            profile.points.push(PathPoint { speed_squared_lu2_s2: b * scale.b, slope_lu_s2: slope * scale.slope });
        }
        for k in 0..count {
            let (before, after) = (profile.points[first + k], profile.points[first + k + 1]);
            profile
                .bends_per_s2
                .push((after.slope_lu_s2 - before.slope_lu_s2) / chain.intervals[first + k].length_lu());
        }
        profile.points.push(rest);
        profile.bends_per_s2.push(0.0);
        profile
    }
}

/// Nodes of the problem: borders `first` to `last` of the chain, before the intervals of the same number.
struct Range {
    first: usize,
    last: usize,
}

impl Range {
    fn of(chain: &Chain, start: Start) -> Self {
        let range = chain.control_range(start);
        Self { first: range.start, last: range.end }
    }
}

/// Units of a node: b, b' and b'' that count as 1.
#[derive(Clone, Copy, Debug)]
struct Scale {
    b: f64,
    slope: f64,
    bend: f64,
}

impl Scale {
    fn new(b: f64, length_lu: f64) -> Self {
        Self { b, slope: b / length_lu, bend: b / (length_lu * length_lu) }
    }

    fn scaled(&self, point: &PathPoint) -> [f64; 2] {
        [point.speed_squared_lu2_s2 / self.b, point.slope_lu_s2 / self.slope]
    }

    /// b+ = b + h b' + h²/2 b'',  b'+ = b' + h b''.
    fn to(&self, next: &Self, length_lu: f64) -> Transition {
        let h = length_lu;
        Transition {
            state_ratio: [self.b / next.b, h * self.slope / next.b, 0.0, self.slope / next.slope],
            control_ratio: [0.5 * h * h * self.bend / next.b, h * self.bend / next.slope],
        }
    }

    /// The control that leads onto the ray `b' = -rate b` of a stop, as feedback, and the transition with it.
    fn onto_stop(&self, transition: &Transition, rate_per_lu: f64) -> ([f64; 2], Transition) {
        let [a00, a01, a10, a11] = transition.state_ratio;
        let [b0, b1] = transition.control_ratio;
        let e = [rate_per_lu * self.b, self.slope];
        let along = e[0] * b0 + e[1] * b1;
        let k = [-(e[0] * a00 + e[1] * a10) / along, -(e[0] * a01 + e[1] * a11) / along];
        let state_ratio = [a00 + b0 * k[0], a01 + b0 * k[1], a10 + b1 * k[0], a11 + b1 * k[1]];
        (k, Transition { state_ratio, control_ratio: [0.0; 2] })
    }
}

/// Rows of one node and the interval after it.
struct NodeRows<'a> {
    problem: &'a mut Problem,
    scale: Scale,
    /// The state is given: limits of it alone are no rows.
    fixed: bool,
}

impl NodeRows<'_> {
    /// `b b + slope b' + bend b'' <= bound`.
    fn push(&mut self, [b, slope, bend]: [f64; 3], bound: f64) {
        let Scale { b: b_unit, slope: slope_unit, bend: bend_unit } = self.scale;
        self.problem.limit([b * b_unit, slope * slope_unit, bend * bend_unit], bound);
    }

    /// Limits of the state alone.
    fn state(&mut self, cap: f64, before: Option<&Interval>, after: &Interval) {
        if self.fixed {
            return;
        }
        self.push([1.0 / cap, 0.0, 0.0], 1.0);
        self.push([-1.0 / self.scale.b, 0.0, 0.0], -LOWEST_RATIO);
        self.acceleration(after, &after.states[0]);
        if let Some(before) = before
            && (before.states[2].second != after.states[0].second || before.states[2].first != after.states[0].first)
        {
            self.acceleration(before, &before.states[2]);
        }
    }

    fn acceleration(&mut self, interval: &Interval, state: &Derivatives) {
        for bound in &interval.bounds.axes {
            let limit = interval.reserve_ratio * bound.acceleration_lu_s2;
            let (b, slope) = (state.second[bound.axis] / limit, 0.5 * state.first[bound.axis] / limit);
            if b != 0.0 || slope != 0.0 {
                self.push([b, slope, 0.0], 1.0);
                self.push([-b, -slope, 0.0], 1.0);
            }
        }
    }

    /// Limits between this node and the next; `estimates`: b̂ of both.
    fn interval(&mut self, interval: &Interval, estimates: [f64; 2]) {
        let h = interval.length_lu();
        // b + h b'/2 is what b bends towards between the two: where it lies between bounds, b does.
        if !self.fixed {
            let cap = interval.cap.velocity_lu_s * interval.cap.velocity_lu_s;
            self.push([1.0 / cap, 0.5 * h / cap, 0.0], 1.0);
            let lowest = self.scale.b;
            self.push([-1.0 / lowest, -0.5 * h / lowest, 0.0], -LOWEST_RATIO);
        }
        for bound in &interval.bounds.axes {
            let Some(jerk) = bound.jerk_lu_s3 else { continue };
            let axis = bound.axis;
            let middle = 0.5 * (estimates[0] + estimates[1]);
            for (place, estimate) in [(0, estimates[0]), (1, middle), (2, estimates[1])] {
                let state = &interval.states[place];
                let limit = interval.reserve_ratio * jerk / estimate.sqrt();
                let (b, slope, bend) =
                    (state.third[axis] / limit, 1.5 * state.second[axis] / limit, 0.5 * state.first[axis] / limit);
                if b == 0.0 && slope == 0.0 && bend == 0.0 {
                    continue;
                }
                let x = 0.5 * place as f64 * h;
                let tangent = 0.5 / estimate;
                for sign in [1.0, -1.0] {
                    let (b, slope, bend) = (sign * b + tangent, sign * slope, sign * bend);
                    self.push([b, b * x + slope, 0.5 * b * x * x + slope * x + bend], 1.5);
                }
            }
        }
    }
}

/// About the fastest rise of the speed along the path: the bend is left out.
#[derive(Clone, Copy, Debug, Default)]
struct Pace {
    acceleration: f64,
}

impl Pace {
    /// b at the far end of an interval if it is `from` at the near one, at most `cap`.
    fn next(&mut self, interval: &Interval, from: f64, cap: f64) -> f64 {
        let (mut acceleration, mut jerk) = (f64::INFINITY, f64::INFINITY);
        for bound in &interval.bounds.axes {
            let share = interval.states.iter().fold(0.0_f64, |most, state| most.max(state.first[bound.axis].abs()));
            acceleration = acceleration.min(bound.acceleration_lu_s2 / share);
            jerk = jerk.min(bound.jerk_lu_s3.unwrap_or(f64::INFINITY) / share);
        }
        let (h, v) = (interval.length_lu(), from.sqrt());
        let (mut reached, mut faster) = (v, self.acceleration);
        for _ in 0..PACE_ROUNDS {
            let time_s = 2.0 * h / (v + reached);
            faster = (self.acceleration + jerk * time_s).min(acceleration);
            reached = v + 0.5 * (self.acceleration + faster) * time_s;
        }
        let b = reached * reached;
        if b < cap {
            self.acceleration = faster;
            return b;
        }
        // Held from here on; where the cap rises the speed may go on rising with it.
        self.acceleration = (0.5 * (cap - from) / h).clamp(0.0, acceleration);
        cap
    }
}

/// Highest b that the bend allows at constant speed.
fn bend_cap(interval: &Interval, state: &Derivatives) -> f64 {
    let mut b = f64::INFINITY;
    for bound in &interval.bounds.axes {
        let axis = bound.axis;
        b = b.min(interval.reserve_ratio * bound.acceleration_lu_s2 / state.second[axis].abs());
        if let Some(jerk) = bound.jerk_lu_s3 {
            b = b.min((interval.reserve_ratio * jerk / state.third[axis].abs()).powf(2.0 / 3.0));
        }
    }
    b
}

/// Highest b at the moving end of the interval of a start or stop.
fn ray_cap(interval: &Interval) -> f64 {
    let h = interval.length_lu();
    let most = |derivative: fn(&Derivatives) -> &crate::base::AxisVector, axis| {
        interval.states.iter().fold(0.0_f64, |most, state| most.max(derivative(state)[axis].abs()))
    };
    let mut b = interval.cap.velocity_lu_s.powi(2);
    let exponent = ray_exponent(interval);
    for bound in &interval.bounds.axes {
        let axis = bound.axis;
        let [first, second, third] =
            [most(|state| &state.first, axis), most(|state| &state.second, axis), most(|state| &state.third, axis)];
        b = b.min(interval.reserve_ratio * bound.acceleration_lu_s2 / (second + 0.5 * exponent * first / h));
        if let Some(jerk) = bound.jerk_lu_s3 {
            // √b (q''' b + 3/2 q'' 4/3 b/h + 1/2 q' 4/9 b/h²)
            let demand = third + 2.0 * second / h + 2.0 / 9.0 * first / (h * h);
            b = b.min((interval.reserve_ratio * jerk / demand).powf(2.0 / 3.0));
        }
    }
    b
}

impl Profile {
    /// State inside an interval, `share` of its length from its start.
    fn inside(&self, chain: &Chain, index: usize, share: f64) -> (PathPoint, f64) {
        let (point, bend) = (self.points[index], self.bends_per_s2[index]);
        let x = share * chain.intervals[index].length_lu();
        let b = point.speed_squared_lu2_s2 + x * (point.slope_lu_s2 + 0.5 * x * bend);
        (PathPoint { speed_squared_lu2_s2: b, slope_lu_s2: point.slope_lu_s2 + x * bend }, bend)
    }

    /// What holds the speed in an interval, and how far its limit is used at the middle; of the ends what is used most there.
    pub fn limit(&self, chain: &Chain, index: usize) -> Limit {
        let interval = &chain.intervals[index];
        let mut most = (0.0, interval.cap.limit);
        let mut offer = |used: f64, limit: Limit| {
            if used > most.0 {
                most = (used, limit);
            }
        };
        for (place, share) in [0.0, 0.5, 1.0].into_iter().enumerate() {
            let (point, bend) = self.inside(chain, index, share);
            let b = point.speed_squared_lu2_s2.max(0.0);
            if place == 1 {
                offer(b / interval.cap.velocity_lu_s.powi(2), interval.cap.limit);
                let used = Used::at(interval, &interval.states[place], &point, bend);
                offer(used.acceleration.0 / interval.reserve_ratio, used.acceleration.1);
                offer(used.jerk.0 / interval.reserve_ratio, used.jerk.1);
            } else if let Some(junction) = chain.junctions.get(index + place / 2) {
                offer(0.999 * b / junction.speed_squared_lu2_s2, junction.limit);
            }
        }
        most.1
    }
}

/// How far the limits are used at a place.
struct Used {
    acceleration: (f64, Limit),
    jerk: (f64, Limit),
}

impl Used {
    fn at(interval: &Interval, state: &Derivatives, point: &PathPoint, bend_per_s2: f64) -> Self {
        let (b, slope) = (point.speed_squared_lu2_s2, point.slope_lu_s2);
        let none = (0.0, interval.cap.limit);
        let mut used = Self { acceleration: none, jerk: none };
        for bound in &interval.bounds.axes {
            let axis = bound.axis;
            let (first, second, third) = (state.first[axis], state.second[axis], state.third[axis]);
            let acceleration = (second * b + 0.5 * first * slope).abs() / bound.acceleration_lu_s2;
            if acceleration > used.acceleration.0 || acceleration.is_nan() {
                used.acceleration =
                    (acceleration, Limit { kind: crate::feed::LimitKind::Acceleration, axis: Some(axis) });
            }
            let Some(limit) = bound.jerk_lu_s3 else { continue };
            let jerk = (third * b + 1.5 * second * slope + 0.5 * first * bend_per_s2).abs() * b.max(0.0).sqrt() / limit;
            if jerk > used.jerk.0 || jerk.is_nan() {
                used.jerk = (jerk, Limit { kind: interval.bounds.jerk_kind, axis: Some(axis) });
            }
        }
        used
    }
}

/// How much of its limits an interval uses at most, on the curve itself where it comes near them; NaN where b is not positive.
fn used_inside(chain: &Chain, profile: &Profile, index: usize, look: &Look<'_>) -> f64 {
    let interval = &chain.intervals[index];
    let rough = most_used(interval, profile, chain, index, &interval.eighths(None));
    if rough < NEAR_RATIO || rough.is_nan() || interval.is_straight() {
        return rough;
    }
    let places = [0.25, 0.75].map(|share| interval.start_lu + share * interval.length_lu());
    most_used(interval, profile, chain, index, &interval.eighths(Some(places.map(|s_lu| look(index, s_lu)))))
}

fn most_used(interval: &Interval, profile: &Profile, chain: &Chain, index: usize, states: &[Derivatives; 9]) -> f64 {
    let places: [(PathPoint, f64); 9] = std::array::from_fn(|i| profile.inside(chain, index, 0.125 * i as f64));
    if places.iter().any(|(point, _)| !(point.speed_squared_lu2_s2 > 0.0)) {
        return f64::NAN;
    }
    let mut most = 0.0_f64;
    for bound in &interval.bounds.axes {
        let axis = bound.axis;
        let (mut accelerations, mut jerks) = ([0.0; 9], [0.0; 9]);
        for (i, ((point, bend), state)) in places.iter().zip(states).enumerate() {
            let (b, slope) = (point.speed_squared_lu2_s2, point.slope_lu_s2);
            let (first, second, third) = (state.first[axis], state.second[axis], state.third[axis]);
            accelerations[i] = second * b + 0.5 * first * slope;
            jerks[i] = (third * b + 1.5 * second * slope + 0.5 * first * bend) * b.sqrt();
        }
        most = most.max(summit(&accelerations) / bound.acceleration_lu_s2);
        if let Some(jerk) = bound.jerk_lu_s3 {
            most = most.max(summit(&jerks) / jerk);
        }
    }
    most
}

/// Greatest amount of a function that is known at equal distances: between them by parabolas.
fn summit(values: &[f64; 9]) -> f64 {
    let mut most = values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    for triple in values.windows(3) {
        let [left, middle, right] = [triple[0], triple[1], triple[2]];
        let (slope, bend) = (0.5 * (right - left), left - 2.0 * middle + right);
        // The vertex lies between the outer two, on the same side of 0.
        if slope.abs() < bend.abs() && bend * middle < 0.0 {
            most = most.max((middle - 0.5 * slope * slope / bend).abs());
        }
    }
    most
}

/// True if every limit holds inside every interval too; else the limits of those where it does not are tightened.
fn tighten(chain: &mut Chain, profile: &Profile, range: &std::ops::Range<usize>, look: &Look<'_>) -> bool {
    let mut holds = true;
    for index in range.clone() {
        let most = used_inside(chain, profile, index, look);
        if most <= HELD_RATIO {
            continue;
        }
        holds = false;
        let ratio = if most.is_nan() { 0.5 } else { (TIGHTER_RATIO / most).max(0.5) };
        chain.intervals[index].reserve_ratio *= ratio;
    }
    holds
}
