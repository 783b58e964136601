//! What a chain of intervals says to the interior-point method: units, transitions, limits.
//!
//! In: intervals and the estimate b̂ at their borders. Out: [`Scale`]s and rows ([`NodeRows`]). The formulas stand at `chain`. Limits that cannot bind
//! are left out: of straight stretches all axes but one, elsewhere those that stay far from their limits whatever the leading axes do
//! ([`Reach`]).
//! Does not solve.

use super::chain::{Chain, PathPoint, Start};
use super::interior_point::{Label, Problem, Transition};
use super::interval::{AxisBound, Derivatives, Interval};

/// How far above its estimate b is thought to come.
const REACH_RATIO: f64 = 1.5;

/// An axis that can use less than this of a limit does not need it.
const NEAR_RATIO: f64 = 0.9;

/// b stays above this share of its estimate.
const LOWEST_RATIO: f64 = 1e-6;

/// Nodes of the problem: borders `first` to `last` of the chain, before the intervals of the same number.
pub(super) struct Range {
    pub first: usize,
    pub last: usize,
}

impl Range {
    pub fn of(chain: &Chain, start: Start) -> Self {
        let range = chain.control_range(start);
        Self { first: range.start, last: range.end }
    }
}

/// Units of a node: b, b' and b'' that count as 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    pub b_lu2_s2: f64,
    pub slope_lu_s2: f64,
    pub bend_per_s2: f64,
}

impl Scale {
    pub fn new(b_lu2_s2: f64, length_lu: f64) -> Self {
        let b = b_lu2_s2;
        Self { b_lu2_s2, slope_lu_s2: b / length_lu, bend_per_s2: b / (length_lu * length_lu) }
    }

    pub fn scaled(&self, point: &PathPoint) -> [f64; 2] {
        [point.speed_squared_lu2_s2 / self.b_lu2_s2, point.slope_lu_s2 / self.slope_lu_s2]
    }

    /// b+ = b + h b' + h²/2 b'',  b'+ = b' + h b''.
    pub fn to(&self, next: &Self, length_lu: f64) -> Transition {
        let h = length_lu;
        Transition {
            state_ratio: [
                self.b_lu2_s2 / next.b_lu2_s2,
                h * self.slope_lu_s2 / next.b_lu2_s2,
                0.0,
                self.slope_lu_s2 / next.slope_lu_s2,
            ],
            control_ratio: [0.5 * h * h * self.bend_per_s2 / next.b_lu2_s2, h * self.bend_per_s2 / next.slope_lu_s2],
        }
    }

    /// The control that leads onto the ray `b' = -rate b` of a stop, as feedback, and the transition with it.
    pub fn onto_stop(&self, transition: &Transition, rate_per_mm: f64) -> ([f64; 2], Transition) {
        let [a00, a01, a10, a11] = transition.state_ratio;
        let [b0, b1] = transition.control_ratio;
        let e = [rate_per_mm * self.b_lu2_s2, self.slope_lu_s2];
        let along = e[0] * b0 + e[1] * b1;
        let k = [-(e[0] * a00 + e[1] * a10) / along, -(e[0] * a01 + e[1] * a11) / along];
        let state_ratio = [a00 + b0 * k[0], a01 + b0 * k[1], a10 + b1 * k[0], a11 + b1 * k[1]];
        (k, Transition { state_ratio, control_ratio: [0.0; 2] })
    }
}

/// Rows of one node and the interval after it.
pub(super) struct NodeRows<'a> {
    pub problem: &'a mut Problem,
    pub scale: Scale,
    /// The state is given: limits of it alone are no rows.
    pub fixed: bool,
    /// b̂.
    pub estimate_lu2_s2: f64,
    /// Lowest b here and at the next node.
    pub floors_lu2_s2: [f64; 2],
}

impl NodeRows<'_> {
    /// `b b + slope b' + bend b'' <= bound`.
    fn push(&mut self, label: Label, [b, slope, bend]: [f64; 3], bound: f64) {
        let Scale { b_lu2_s2: b_unit, slope_lu_s2: slope_unit, bend_per_s2: bend_unit } = self.scale;
        self.problem.limit(label, [b * b_unit, slope * slope_unit, bend * bend_unit], bound);
    }

    /// The same for a limit that does not give way.
    fn hold(&mut self, row: [f64; 3], bound: f64) {
        self.push(Label::Cap, row, bound);
        self.problem.hold_last();
    }

    /// Limits of the state alone.
    pub fn state(&mut self, cap_lu2_s2: f64, before: Option<&Interval>, after: &Interval) {
        if self.fixed {
            return;
        }
        self.hold([1.0 / cap_lu2_s2, 0.0, 0.0], 1.0);
        let floor = self.floors_lu2_s2[0] / self.scale.b_lu2_s2;
        self.push(Label::State, [-1.0 / self.scale.b_lu2_s2, 0.0, 0.0], -LOWEST_RATIO.max(floor));
        let Some(before) = before else {
            self.acceleration(after, 0, 0.0, after.reserve_ratio);
            return;
        };
        let (end, start) = (&before.states[2], &after.states[0]);
        if end.first == start.first && end.second == start.second {
            // One place of one curve: the tighter reserve of the two holds.
            self.acceleration(after, 0, 0.0, after.reserve_ratio.min(before.reserve_ratio));
        } else {
            self.acceleration(after, 0, 0.0, after.reserve_ratio);
            self.acceleration(before, 2, 0.0, before.reserve_ratio);
        }
    }

    /// Limits of the acceleration with the derivatives of one of the three places of an interval, `ahead_lu` after this node.
    fn acceleration(&mut self, interval: &Interval, place: usize, ahead_lu: f64, reserve_ratio: f64) {
        let state = &interval.states[place];
        let reach = Reach::of(interval, state, self.estimate_lu2_s2);
        for bound in leading(interval, |bound| bound.acceleration_lu_s2) {
            if !reach.accelerates(bound, state) {
                continue;
            }
            let limit = reserve_ratio * bound.acceleration_lu_s2;
            let (b, slope) = (state.second[bound.axis] / limit, 0.5 * state.first[bound.axis] / limit);
            if b != 0.0 || slope != 0.0 {
                let row = ahead([b, slope, 0.0], ahead_lu);
                self.push(Label::State, row, 1.0);
                self.push(Label::State, row.map(|x| -x), 1.0);
            }
        }
    }

    /// Limits between this node and the next; `estimates`: b̂ of both.
    pub fn interval(&mut self, interval: &Interval, estimates_lu2_s2: [f64; 2]) {
        let (h, estimates) = (interval.length_lu(), estimates_lu2_s2);
        // b + h b'/2 is what b bends towards between the two: where it lies between bounds, b does.
        if !self.fixed {
            let cap = interval.cap.velocity_lu_s * interval.cap.velocity_lu_s;
            self.hold([1.0 / cap, 0.5 * h / cap, 0.0], 1.0);
            let lowest = self.scale.b_lu2_s2;
            let floor = self.floors_lu2_s2[0].min(self.floors_lu2_s2[1]) / lowest;
            self.push(Label::State, [-1.0 / lowest, -0.5 * h / lowest, 0.0], -LOWEST_RATIO.max(floor));
        }
        if !interval.is_straight() {
            self.acceleration(interval, 1, 0.5 * h, interval.reserve_ratio);
        }
        let middle = 0.5 * (estimates[0] + estimates[1]);
        let places = [(0, estimates[0]), (1, middle), (2, estimates[1])];
        let reaches = places.map(|(place, estimate)| Reach::of(interval, &interval.states[place], estimate));
        for bound in leading(interval, |bound| bound.jerk_lu_s3.unwrap_or(f64::INFINITY)) {
            let Some(jerk) = bound.jerk_lu_s3 else { continue };
            let axis = bound.axis;
            for (place, estimate) in places {
                if !reaches[place].jerks(bound, &interval.states[place]) {
                    continue;
                }
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
                    self.push(
                        Label::Place(place as u8),
                        ahead([sign * b + tangent, sign * slope, sign * bend], x),
                        1.5,
                    );
                }
            }
        }
    }
}

/// A row for the state `x` after a node, as a row for the state there: `b + x b' + x²/2 b''`, `b' + x b''`.
fn ahead([b, slope, bend]: [f64; 3], x: f64) -> [f64; 3] {
    [b, b * x + slope, 0.5 * b * x * x + slope * x + bend]
}

/// What can happen at a place, about: more than that the axes that lead do not allow. Limits of others that stay far from it are no rows;
/// whether they hold is looked at afterwards.
#[derive(Clone, Copy, Debug)]
struct Reach {
    /// Every limit is a row: all are alike, or one of them was found to be exceeded.
    all: bool,
    b: f64,
    acceleration: f64,
    jerk: f64,
}

impl Reach {
    fn of(interval: &Interval, state: &Derivatives, estimate: f64) -> Self {
        let b = REACH_RATIO * estimate;
        let (mut acceleration, mut jerk) = (f64::INFINITY, f64::INFINITY);
        let all = interval.is_straight() || interval.tightened;
        if !all {
            for bound in &interval.bounds.axes {
                let (first, second) = (state.first[bound.axis].abs(), state.second[bound.axis].abs());
                acceleration = acceleration.min((bound.acceleration_lu_s2 + second * b) / first);
            }
            for bound in &interval.bounds.axes {
                let bend = Self { all, b, acceleration, jerk: 0.0 }.jerk_demand(bound, state);
                let limit = bound.jerk_lu_s3.unwrap_or(f64::INFINITY);
                jerk = jerk.min((limit + bend) / state.first[bound.axis].abs());
            }
        }
        Self { all, b, acceleration, jerk }
    }

    fn jerk_demand(&self, bound: &AxisBound, state: &Derivatives) -> f64 {
        let axis = bound.axis;
        let bend =
            self.b.sqrt() * (state.third[axis].abs() * self.b + 3.0 * state.second[axis].abs() * self.acceleration);
        if self.jerk > 0.0 { bend + state.first[axis].abs() * self.jerk } else { bend }
    }

    /// The axis may come near its acceleration.
    fn accelerates(&self, bound: &AxisBound, state: &Derivatives) -> bool {
        let (first, second) = (state.first[bound.axis].abs(), state.second[bound.axis].abs());
        self.all || (second * self.b + first * self.acceleration) / bound.acceleration_lu_s2 >= NEAR_RATIO
    }

    /// The axis may come near its jerk.
    fn jerks(&self, bound: &AxisBound, state: &Derivatives) -> bool {
        let limit = bound.jerk_lu_s3.unwrap_or(f64::INFINITY);
        self.all || self.jerk_demand(bound, state) / limit >= NEAR_RATIO
    }
}

/// The axes whose limits can bind: on a straight stretch, where every axis sees the same but for a factor, the one with the greatest.
fn leading(interval: &Interval, limit: impl Fn(&AxisBound) -> f64) -> &[AxisBound] {
    let axes = &interval.bounds.axes[..];
    if !interval.is_straight() {
        return axes;
    }
    let used = |bound: &AxisBound| interval.states[0].first[bound.axis].abs() / limit(bound);
    let most = (0..axes.len()).reduce(|most, next| if used(&axes[next]) > used(&axes[most]) { next } else { most });
    most.map_or(axes, |most| &axes[most..=most])
}
