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

use super::estimate::{Pace, bend_cap, ray_cap, ray_exponent};
use super::held::{slowed, tighten};
use super::interior_point::{Label, Outcome, Problem, Solver};
use super::interval::{Derivatives, Interval};
use super::rows::{NodeRows, Range, Scale};
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
    /// Lowest b at the first borders; there may be none at all.
    pub floors_lu2_s2: Vec<f64>,
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

/// Of the time: how near to the fastest profile a solution is from which only the next tangents are taken, and one that is a plan. A speed that is held
/// comes as near to its limit.
const GAP_MAX_RATIO: f64 = 2e-4;
const PLAN_GAP_MAX_RATIO: f64 = 1e-8;

/// Rounds of tangents.
const ROUNDS_MAX: u32 = 8;

/// Where b is by no more than this away from its estimate the tangent is good enough: it misses 3/8 of the square of it.
const STRAY_MAX_SHARE: f64 = 0.12;

/// Of a plan that ends in a stop which is not the program's, the last part is not kept: this many times the way from its last summit.
const DISTURBED_RATIO: f64 = 1.6;

/// A speed squared that differs by less is the same, and below this share of it the path is slower.
const LEVEL_RATIO: f64 = 1.0 + 1e-6;
const DIP_RATIO: f64 = 0.75;

/// Where the mean braking from a place to the end is less than this share of the hardest there is, the path slows down there for reasons of its own: of a
/// stop with constant jerk the mean falls to two thirds from the middle of the ramp to its start, and from there on with the way.
const SOFT_RATIO: f64 = 0.25;

/// Attempts with tighter limits where those between the places do not hold.
const ATTEMPTS_MAX: u32 = 8;

/// By how much limits give way, of what planning does not use of them anyway.
const LOOSER_RATIOS: [f64; 3] = [0.0, 2e-4, 1.5e-3];

/// Steps of the solver after which a problem counts as unsolvable.
const STEPS_MAX: u32 = 80;
const HURRIED_STEPS_MAX: u32 = 40;

/// Share of the estimate to begin with.
const START_RATIO: f64 = 0.95;

/// Derivatives on the curve of an interval, by its number and s from the start of its piece.
pub(super) type Look<'a> = dyn Fn(usize, f64) -> Derivatives + 'a;

/// Memory for planning, used again and again.
#[derive(Clone, Debug, Default)]
pub(super) struct Planning {
    problem: Problem,
    solver: Solver,
    /// Whether there is a profile is to be found out quickly: what is found only with effort counts as none.
    pub hurries: bool,
    /// The path rests at the end of the chain: no later plan will do it better.
    pub is_last: bool,
    /// So many intervals will be handed out before the next plan, whatever this one is.
    pub handed_out: usize,
    solved: bool,
    /// b̂ at the borders.
    estimate: Vec<f64>,
    caps: Vec<f64>,
}

impl Profile {
    /// The border where the path begins to brake for its end: before it the path is clearly slower again, or it is the fastest of all, as far as the end
    /// can be felt. Of a slow place just before the end, which the end makes slower still, nothing says how fast the path could go through it; of a fast
    /// one far before it nothing says that it is the end for which the path slows down.
    pub fn summit(&self, chain: &Chain) -> usize {
        let b = |index: usize| self.points[index].speed_squared_lu2_s2;
        let mut summit = self.points.len().saturating_sub(1);
        let (mut way_lu, mut hardest_lu_s2) = (0.0, 0.0_f64);
        for index in (0..summit).rev() {
            way_lu += chain.intervals[index].length_lu();
            let braking_lu_s2 = b(index) / way_lu;
            hardest_lu_s2 = hardest_lu_s2.max(braking_lu_s2);
            if b(index) < DIP_RATIO * b(summit) || braking_lu_s2 < SOFT_RATIO * hardest_lu_s2 {
                break;
            }
            if b(index) > LEVEL_RATIO * b(summit) {
                summit = index;
            }
        }
        summit
    }

    /// How many intervals of a plan that ends in a stop in the middle of the path stay.
    pub fn kept(&self, chain: &Chain) -> usize {
        let length_lu =
            |range: std::ops::Range<usize>| chain.intervals[range].iter().map(Interval::length_lu).sum::<f64>();
        let count = chain.intervals.len();
        let kept_lu = length_lu(0..count) - DISTURBED_RATIO * length_lu(self.summit(chain).min(count)..count);
        let mut way_lu = 0.0;
        let ends = chain.intervals.iter().map(|interval| {
            way_lu += interval.length_lu();
            way_lu
        });
        ends.take_while(|end_lu| *end_lu <= kept_lu).count()
    }
}

/// What the limits of an interval cost, of the time, after a plan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prices {
    /// If the jerk were used all along (`interior_point`).
    pub unused: f64,
    /// If acceleration and jerk were wider by 1, and the square of the speed at its ends.
    pub limits: f64,
    pub cap: f64,
}

impl Chain {
    pub fn control_range(&self, start: Start) -> std::ops::Range<usize> {
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
        let mut before = None;
        for round in 0.. {
            self.solved = self.solve(chain, start, &range);
            if !self.solved {
                // A profile of earlier tangents obeys the true limits too: it is only slower.
                return before.filter(|profile| tighten(chain, profile, &range, look));
            }
            let mut profile = self.profile(chain, start);
            if round + 1 < ROUNDS_MAX && self.strays(chain, &profile, &range) {
                self.take_estimate(&profile, &range);
                before = Some(profile);
                continue;
            }
            let steps_max = self.steps_max();
            self.solved = self.solver.refine(&mut self.problem, PLAN_GAP_MAX_RATIO, steps_max) == Outcome::Solved;
            if self.solved {
                profile = self.profile(chain, start);
            }
            if tighten(chain, &profile, &range, look) {
                return Some(profile);
            }
            attempts += 1;
            if attempts > ATTEMPTS_MAX {
                return if start == Start::Rest { slowed(chain, profile, &range, look) } else { None };
            }
            self.take_estimate(&profile, &range);
            self.cap_rests(chain, start);
            before = None;
        }
        None
    }

    /// The last plan is the solution of its last problem, not one of an earlier round.
    pub fn is_solved(&self) -> bool {
        self.solved
    }

    /// There are no prices until the next plan.
    pub fn forget_solution(&mut self) {
        self.solved = false;
    }

    /// Of the interval after a node of the last plan; `None` if that was not the solution of its last problem.
    pub fn prices(&self, node: usize, pinched: bool) -> Option<Prices> {
        let is_cap = |label| label == Label::Cap;
        self.solved.then(|| Prices {
            unused: self.problem.unused_ratio(node, pinched),
            limits: self.problem.price_ratio(node, |label| !is_cap(label)),
            cap: self.problem.price_ratio(node, is_cap) + self.problem.price_ratio(node + 1, is_cap),
        })
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
        self.cap_rests(chain, start);
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
        let mut pace = match start {
            _ if hinted > 1 => Pace::default(),
            Start::Rest => Pace::from_rest(&intervals[0], self.estimate[0]),
            Start::At(point) => Pace::moving(point.slope_lu_s2),
        };
        for k in hinted.max(1)..=count {
            self.estimate[k] = pace.next(&intervals[first + k - 1], self.estimate[k - 1], self.estimate[k]);
        }
        let mut pace = Pace::from_rest(&intervals[last], self.estimate[count]);
        for k in (hinted..count).rev() {
            self.estimate[k] = pace.next(&intervals[first + k], self.estimate[k + 1], self.estimate[k]);
        }
        self.estimate.iter().chain(&self.caps).all(|b| *b > 0.0 && !b.is_nan())
            && self.estimate.iter().all(|b| b.is_finite())
    }

    /// What the intervals of start and stop allow at their moving ends.
    fn cap_rests(&mut self, chain: &Chain, start: Start) {
        let at_start = (start == Start::Rest).then(|| chain.intervals.first()).flatten();
        let ends = [self.caps.len().saturating_sub(1), 0];
        for (place, interval) in ends.into_iter().zip([chain.intervals.last(), at_start]) {
            if let (Some(cap), Some(interval)) = (self.caps.get_mut(place), interval) {
                *cap = cap.min(ray_cap(interval));
            }
        }
    }

    fn take_estimate(&mut self, profile: &Profile, range: &std::ops::Range<usize>) {
        for (estimate, point) in self.estimate.iter_mut().zip(&profile.points[range.start..=range.end]) {
            *estimate = point.speed_squared_lu2_s2;
        }
    }

    /// Anywhere the solution is far from where the tangents were laid.
    fn strays(&self, chain: &Chain, profile: &Profile, range: &std::ops::Range<usize>) -> bool {
        let points = &profile.points[range.start..=range.end];
        let far = |(estimate, point): (&f64, &PathPoint)| {
            (point.speed_squared_lu2_s2 / estimate - 1.0).abs() > STRAY_MAX_SHARE
        };
        // What lies far ahead is planned again, with this solution for an estimate.
        let near = (self.near(chain, profile) + 1).saturating_sub(range.start);
        self.estimate.iter().zip(points).take(near).any(far)
    }

    /// Intervals from the start of a plan that will be gone along as it says: the others are planned again.
    pub fn near(&self, chain: &Chain, profile: &Profile) -> usize {
        if self.is_last { chain.intervals.len() } else { profile.kept(chain).max(self.handed_out) }
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
            let floor = |k: usize| chain.floors_lu2_s2.get(first + k).copied().unwrap_or(0.0);
            let mut node = NodeRows {
                problem,
                floors_lu2_s2: [floor(k), floor(k + 1)],
                scale: scale(k),
                fixed: k == 0 && start != Start::Rest,
                estimate_lu2_s2: estimate[k],
            };
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
        let looser = match start {
            Start::Rest => &LOOSER_RATIOS[..1],
            Start::At(_) if self.hurries => &LOOSER_RATIOS[2..],
            Start::At(_) => &LOOSER_RATIOS,
        };
        let steps_max = self.steps_max();
        looser.iter().any(|by_ratio| {
            self.pose(chain, start);
            self.start_solver(chain, range);
            self.fix_start(chain, start);
            self.problem.loosen(*by_ratio);
            self.solver.solve(&mut self.problem, GAP_MAX_RATIO, steps_max) == Outcome::Solved
        })
    }

    fn steps_max(&self) -> u32 {
        if self.hurries { HURRIED_STEPS_MAX } else { STEPS_MAX }
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
            ([START_RATIO, START_RATIO * slope(k) / scale.slope_lu_s2], 0.0)
        });
        self.solver.start(states);
    }

    /// The exact first state, or a point of the ray that it lies on.
    fn fix_start(&mut self, chain: &Chain, start: Start) {
        let scale = Scale::new(self.estimate[0], chain.intervals[usize::from(start == Start::Rest)].length_lu());
        let state = match start {
            Start::At(point) => scale.scaled(&point),
            Start::Rest => {
                let ray = [
                    1.0,
                    ray_exponent(&chain.intervals[0]) / chain.intervals[0].length_lu() * scale.b_lu2_s2
                        / scale.slope_lu_s2,
                ];
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
            profile
                .points
                .push(PathPoint { speed_squared_lu2_s2: b * scale.b_lu2_s2, slope_lu_s2: slope * scale.slope_lu_s2 });
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
