//! The time law of a thread: the path follows the spindle (G33, G34, G35), or leads it (G331, G332).
//!
//! In: a straight piece with its [`Thread`], what its axes can do, the spindle. Out: its [`TimeLaw`], or that the spindle is too fast ([`TooFast`]).
//!
//! * Cut: with tau from the moment at which the spindle passes the start angle the path is `v0 tau + a tau² / 2`: v0 the rise a radian times the speed, a its
//!   change a radian times the square of the speed (0 for G33). The axis cannot be there from rest at once: it sets out earlier, so that its run-in meets
//!   that line with the speed and acceleration of the line. Where the axis is on the line depends on the angle alone, whatever the speed and the
//!   acceleration. The run-out is the same mirrored: it ends at the end of the block, at rest. Both lie inside the thread.
//! * DITS and DITE make run-in and run-out as long as they say, with less acceleration and jerk. Where they are shorter than the limits of the axes allow the limits
//!   hold (the control overloads the axis and shows alarm 22280): the planner says so.
//! * A block that goes on from a thread begins on its own line; only the last one runs out.
//! * Tap: from rest to rest, within axes, S and the acceleration of the spindle.
//! * A block that is too short for run-in and run-out is driven from rest to rest, never on the line: the planner says so.
//!
//! The feed override does not act on threads, as on the control. Does not know how the spindle comes to its speed.

use super::limits::{AxisRules, Ends, FeedCap, PieceLimits};
use super::profile::{Bounds, SpeedCap, Stretch, seven_phases, standstill};
use super::{Limit, LimitKind, Phase, TimeLaw};
use crate::base::AxisId;
use crate::base::units::RAD_PER_REV;
use crate::interpreter::{Thread, ThreadCoupling};
use crate::machine::AxisLimits;

/// Rounds of a bisection to the last bit.
const BISECTIONS: usize = 100;

/// Speeds above their limits by less are rounding.
const ROUNDING_RATIO: f64 = 1e-9;

/// What holds a thread: its lead and the speed of the spindle.
const FEED: Limit = Limit { kind: LimitKind::Feed, axis: None };

/// A thread in the window.
#[derive(Clone, Debug)]
pub(super) struct ThreadPiece {
    pub thread: Thread,
    /// It goes on from the thread before, without a rest.
    pub goes_on: bool,
    length_lu: f64,
    /// Of the axes along the path; its cruise is what their velocities allow.
    bounds: Bounds,
}

/// The spindle when a thread is planned: from `ready_s` on its speed is constant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turning {
    pub now_s: f64,
    pub ready_s: f64,
    /// At `ready_s`.
    pub angle_rad: f64,
    /// With its sign; 0: it is not simulated (SETMS), and nothing waits for its angle.
    pub speed_rad_s: f64,
    /// Highest acceleration; `None`: no limit.
    pub acceleration_rad_s2: Option<f64>,
}

/// The thread that a block goes on from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Before {
    pub thread: Thread,
    pub length_lu: f64,
    pub ends: Ends,
}

/// The spindle is too fast for an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct TooFast {
    /// Highest possible speed, as a share of the programmed one.
    pub speed_share: f64,
    /// What holds.
    pub limit: Limit,
}

/// What the spindle asks of the path at a place.
#[derive(Clone, Copy, Debug)]
struct Line {
    velocity_lu_s: f64,
    acceleration_lu_s2: f64,
}

/// From rest to a line: three phases of constant jerk.
#[derive(Clone, Copy, Debug)]
struct Run {
    /// Duration, acceleration at the start, jerk.
    phases: [(f64, f64, f64); 3],
    duration_s: f64,
    length_lu: f64,
    /// On the line from its start to where the run meets it.
    meets_s: f64,
}

impl ThreadPiece {
    /// Of a piece from its first to its last state. Errors: an axis cannot follow.
    pub fn new(
        thread: Thread,
        length_lu: f64,
        ends: &Ends,
        rules: &AxisRules,
        before: Option<&Before>,
    ) -> Result<Self, TooFast> {
        let rules = rules.drive.as_ref().map_or(rules, |drive| &drive.weak);
        let share = |axis: AxisId| ends.start.first[axis].abs();
        let free = SpeedCap { velocity_lu_s: f64::INFINITY, limit: FEED };
        let velocity = rules.driven(FeedCap::Programmed(free), share);
        let demand = |limit: fn(&AxisLimits) -> f64| rules.largest(|axis, limits| share(axis) / limit(limits));
        let acceleration = demand(|limits| limits.acceleration_max_lu_s2);
        let jerk = demand(|limits| limits.jerk_max_lu_s3);
        let PieceLimits { bounds, .. } = PieceLimits::new(velocity, velocity, acceleration, jerk, rules.jerk_limited);
        let piece = Self { thread, goes_on: before.is_some(), length_lu, bounds };
        let speed_rad_s = thread.speed_rad_s;
        let [first, last] = [0.0, length_lu].map(|s_lu| line_at(&thread, s_lu, speed_rad_s));
        let fastest_lu_s = first.velocity_lu_s.max(last.velocity_lu_s);
        let mut least = TooFast { speed_share: velocity.velocity_lu_s / fastest_lu_s, limit: velocity.limit };
        if thread.is_cut() {
            // The acceleration goes with the square of the speed.
            let ratio = bounds.dynamics.acceleration_lu_s2 / first.acceleration_lu_s2.abs();
            least = least.or(TooFast { speed_share: ratio.sqrt(), limit: bounds.acceleration });
        }
        if let Some(before) = before {
            least = least.or(junction(rules, before, ends, first.velocity_lu_s)).or(piece.run_out_share(speed_rad_s));
        }
        if least.speed_share < 1.0 - ROUNDING_RATIO { Err(least) } else { Ok(piece) }
    }

    /// Revolutions of the spindle over the piece, in rad, with the sense of a tap.
    pub fn turn_rad(&self) -> f64 {
        let rise_lu = self.thread.rise_mm / RAD_PER_REV;
        match self.thread.coupling {
            ThreadCoupling::Tap { sense_ratio } => sense_ratio * self.length_lu / rise_lu,
            ThreadCoupling::Cut { .. } => 0.0,
        }
    }

    /// Turn of the spindle a unit of path.
    pub fn turn_rad_per_lu(&self) -> f64 {
        self.turn_rad() / self.length_lu
    }

    /// Length of the path.
    pub fn length_lu(&self) -> f64 {
        self.length_lu
    }

    /// The law from now on; `leaves`: the path rests at the end. The second value: run-in and run-out have room.
    pub fn law(&self, turning: &Turning, leaves: bool) -> (TimeLaw, bool) {
        let start_angle_rad = match self.thread.coupling {
            ThreadCoupling::Tap { .. } => return (self.tap(turning), true),
            ThreadCoupling::Cut { start_angle_rad } => start_angle_rad.unwrap_or(0.0),
        };
        let speed_rad_s = if turning.speed_rad_s == 0.0 { self.thread.speed_rad_s } else { turning.speed_rad_s.abs() };
        let [first, last] = [0.0, self.length_lu].map(|s_lu| line_at(&self.thread, s_lu, speed_rad_s));
        let whole_s = 2.0 * self.length_lu / (first.velocity_lu_s + last.velocity_lu_s);
        let [run_in_lu, run_out_lu] = self.thread.runs_mm;
        let entering = if self.goes_on { Some(None) } else { self.run(first, run_in_lu).map(Some) };
        let mirrored = Line { acceleration_lu_s2: -last.acceleration_lu_s2, ..last };
        let leaving = if leaves { self.run(mirrored, run_out_lu).map(Some) } else { Some(None) };
        let (Some(entering), Some(leaving)) = (entering, leaving) else {
            return (self.unsynchronised(turning, first), false);
        };
        let on_line_s = |run: &Option<Run>| run.as_ref().map_or(0.0, |run| run.meets_s);
        let line_s = whole_s - on_line_s(&entering) - on_line_s(&leaving);
        if line_s < 0.0 {
            return (self.unsynchronised(turning, first), false);
        }
        let mut phases = Vec::with_capacity(8);
        if let Some(run) = &entering {
            // The run takes longer than the line does for the same way: by so much it begins before the start angle.
            let lead_s = run.duration_s - run.meets_s;
            phases.extend(standing(turning.start_s(start_angle_rad, lead_s) - turning.now_s));
            phases.extend(run.forward(&self.bounds));
        }
        let tau = on_line_s(&entering);
        phases.push(Phase {
            duration_s: line_s,
            start_lu: tau * (first.velocity_lu_s + tau * first.acceleration_lu_s2 / 2.0),
            velocity_lu_s: first.velocity_lu_s + tau * first.acceleration_lu_s2,
            acceleration_lu_s2: first.acceleration_lu_s2,
            jerk_lu_s3: 0.0,
            rate_per_s2: 0.0,
            limit: FEED,
        });
        if let Some(run) = &leaving {
            phases.extend(run.backward(&self.bounds, self.length_lu));
        }
        (TimeLaw::new(phases), true)
    }

    /// G331, G332.
    fn tap(&self, turning: &Turning) -> TimeLaw {
        let rise_lu = self.thread.rise_mm / RAD_PER_REV;
        let feed = SpeedCap { velocity_lu_s: rise_lu * self.thread.speed_rad_s, limit: FEED };
        let mut bounds = Bounds { cruise: feed.min(self.bounds.cruise), ..self.bounds };
        let spindle_lu_s2 = turning.acceleration_rad_s2.map_or(f64::INFINITY, |limit| rise_lu * limit);
        if spindle_lu_s2 < bounds.dynamics.acceleration_lu_s2 {
            bounds.dynamics.acceleration_lu_s2 = spindle_lu_s2;
            bounds.acceleration = SPINDLE;
        }
        self.at_rest(turning, bounds)
    }

    /// Too short: from rest to rest.
    fn unsynchronised(&self, turning: &Turning, first: Line) -> TimeLaw {
        let cruise = SpeedCap { velocity_lu_s: first.velocity_lu_s, limit: FEED };
        self.at_rest(turning, Bounds { cruise, ..self.bounds })
    }

    fn at_rest(&self, turning: &Turning, bounds: Bounds) -> TimeLaw {
        let rest = SpeedCap { velocity_lu_s: 0.0, limit: FEED };
        let law = seven_phases(&Stretch { length_lu: self.length_lu, entry: rest, exit: rest }, &bounds);
        TimeLaw::new(standing(turning.ready_s - turning.now_s).into_iter().chain(law.phases().iter().copied()))
    }

    /// The runs that are programmed shorter than the limits of the axes allow, with what they need: programmed and needed.
    pub fn short_runs_lu(&self, leaves: bool) -> [Option<[f64; 2]>; 2] {
        let [first, last] = [0.0, self.length_lu].map(|s_lu| line_at(&self.thread, s_lu, self.thread.speed_rad_s));
        let mirrored = Line { acceleration_lu_s2: -last.acceleration_lu_s2, ..last };
        let short = |line: Line, run_lu: Option<f64>| {
            let least_lu = self.run(line, None)?.length_lu;
            run_lu.filter(|run_lu| *run_lu < least_lu).map(|run_lu| [run_lu, least_lu])
        };
        let [run_in_lu, run_out_lu] = self.thread.runs_mm;
        [short(first, run_in_lu.filter(|_| !self.goes_on)), short(mirrored, run_out_lu.filter(|_| leaves))]
    }

    /// From rest to a line, from its start on, as long as programmed or as short as possible; `None`: it is left behind for good.
    fn run(&self, line: Line, run_lu: Option<f64>) -> Option<Run> {
        let shortest = self.shortest_run(line)?;
        let Some(run_lu) = run_lu.filter(|run_lu| *run_lu > shortest.length_lu && run_lu.is_finite()) else {
            return Some(shortest);
        };
        // With a share of the acceleration and its square of the jerk the run takes its inverse in time, and in way where the line is straight.
        let slower = |share: f64| {
            let mut piece = self.clone();
            piece.bounds.dynamics.acceleration_lu_s2 *= share;
            piece.bounds.dynamics.jerk_lu_s3 = piece.bounds.dynamics.jerk_lu_s3.map(|jerk| jerk * share * share);
            piece.shortest_run(line)
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            match slower(middle) {
                Some(run) if run.length_lu <= run_lu => high = middle,
                _ => low = middle,
            }
        }
        slower(high)
    }

    fn shortest_run(&self, line: Line) -> Option<Run> {
        let length = |tau: f64| tau * (line.velocity_lu_s + tau * line.acceleration_lu_s2 / 2.0);
        let run_to =
            |tau: f64| self.run_to(line.velocity_lu_s + tau * line.acceleration_lu_s2, line.acceleration_lu_s2, tau);
        let ahead = |tau: f64| run_to(tau).map(|run| length(tau) - run.length_lu);
        let mut high_s = run_to(0.0)?.duration_s;
        let mut rounds = 0;
        while ahead(high_s)? < 0.0 {
            (high_s, rounds) = (2.0 * high_s, rounds + 1);
            if rounds > BISECTIONS {
                return None;
            }
        }
        let mut low_s = 0.0;
        for _ in 0..BISECTIONS {
            let middle_s = 0.5 * (low_s + high_s);
            if ahead(middle_s)? < 0.0 { low_s = middle_s } else { high_s = middle_s }
        }
        run_to(high_s)
    }

    /// From rest to a speed with an acceleration; `None`: that acceleration is out of reach.
    fn run_to(&self, velocity_lu_s: f64, acceleration_lu_s2: f64, meets_s: f64) -> Option<Run> {
        let (v, b, a) = (velocity_lu_s, acceleration_lu_s2, self.bounds.dynamics.acceleration_lu_s2);
        let phases = match self.bounds.dynamics.jerk_lu_s3 {
            None => [(0.0, 0.0, 0.0), (v / a, a, 0.0), (0.0, 0.0, 0.0)],
            Some(j) => {
                // The peak that ends at v without a phase of constant acceleration: p² / (2 J) + (p² - b²) / (2 J) = v.
                let peak = (j * v + b * b / 2.0).max(0.0).sqrt().min(a);
                let gained = (2.0 * peak * peak - b * b) / (2.0 * j);
                [(peak / j, 0.0, j), ((v - gained).max(0.0) / peak, peak, 0.0), ((peak - b) / j, peak, -j)]
            }
        };
        if v <= 0.0 || phases.iter().any(|(duration_s, ..)| duration_s.is_nan() || *duration_s < 0.0) {
            return None;
        }
        let mut run = Run { phases, duration_s: 0.0, length_lu: 0.0, meets_s };
        let mut speed_lu_s = 0.0;
        for (t, a, j) in phases {
            run.length_lu += t * (speed_lu_s + t * (a / 2.0 + t * j / 6.0));
            speed_lu_s += t * (a + t * j / 2.0);
            run.duration_s += t;
        }
        Some(run)
    }

    /// Highest speed from which the piece has room to run out.
    fn run_out_share(&self, speed_rad_s: f64) -> TooFast {
        let fits = |share: f64| {
            let last = line_at(&self.thread, self.length_lu, share * speed_rad_s);
            let first = line_at(&self.thread, 0.0, share * speed_rad_s);
            let mirrored = Line { acceleration_lu_s2: -last.acceleration_lu_s2, ..last };
            let whole_s = 2.0 * self.length_lu / (first.velocity_lu_s + last.velocity_lu_s);
            self.run(mirrored, self.thread.runs_mm[1]).is_some_and(|run| run.meets_s <= whole_s)
        };
        let limit = self.bounds.acceleration;
        if fits(1.0) {
            return TooFast { speed_share: 1.0, limit };
        }
        TooFast { speed_share: highest(fits), limit }
    }

    /// Highest speed of the spindle with which run-in and run-out have room, as a share of the programmed one.
    pub fn room_share(&self, leaves: bool) -> f64 {
        highest(|share| {
            let thread = Thread { speed_rad_s: share * self.thread.speed_rad_s, ..self.thread };
            let still =
                Turning { now_s: 0.0, ready_s: 0.0, angle_rad: 0.0, speed_rad_s: 0.0, acceleration_rad_s2: None };
            Self { thread, ..self.clone() }.law(&still, leaves).1
        })
    }
}

impl TooFast {
    /// The one that holds more; of equal ones the first.
    fn or(self, other: Self) -> Self {
        if other.speed_share < self.speed_share { other } else { self }
    }
}

impl Turning {
    /// When a run begins that sets out `lead_s` before the spindle passes an angle.
    fn start_s(&self, angle_rad: f64, lead_s: f64) -> f64 {
        if self.speed_rad_s == 0.0 {
            return self.ready_s;
        }
        let (sense, speed_rad_s) = (self.speed_rad_s.signum(), self.speed_rad_s.abs());
        let earliest_rad = self.angle_rad + self.speed_rad_s * lead_s;
        self.ready_s + (sense * (angle_rad - earliest_rad)).rem_euclid(RAD_PER_REV) / speed_rad_s
    }
}

impl Run {
    /// From rest at the start of the piece.
    fn forward(&self, bounds: &Bounds) -> impl Iterator<Item = Phase> {
        let (mut start_lu, mut velocity_lu_s) = (0.0, 0.0);
        let bounds = *bounds;
        self.phases.into_iter().map(move |(duration_s, acceleration_lu_s2, jerk_lu_s3)| {
            let limit = if jerk_lu_s3 == 0.0 { bounds.acceleration } else { bounds.jerk };
            let phase =
                Phase { duration_s, start_lu, velocity_lu_s, acceleration_lu_s2, jerk_lu_s3, rate_per_s2: 0.0, limit };
            let end = phase.at(duration_s);
            (start_lu, velocity_lu_s) = (end.position_lu, end.velocity_lu_s);
            phase
        })
    }

    /// The same mirrored: to rest at the end of the piece.
    fn backward(&self, bounds: &Bounds, end_lu: f64) -> impl Iterator<Item = Phase> {
        let forward: Vec<Phase> = self.forward(bounds).collect();
        forward.into_iter().rev().map(move |phase| {
            let end = phase.at(phase.duration_s);
            Phase {
                start_lu: end_lu - end.position_lu,
                velocity_lu_s: end.velocity_lu_s,
                acceleration_lu_s2: -end.acceleration_lu_s2,
                ..phase
            }
        })
    }
}

/// The spindle holds.
const SPINDLE: Limit = Limit { kind: LimitKind::Spindle, axis: None };

/// A wait for the spindle.
fn standing(time_s: f64) -> Vec<Phase> {
    standstill(time_s.max(0.0), SPINDLE).phases().to_vec()
}

/// What the spindle asks for at a place of a thread.
fn line_at(thread: &Thread, s_lu: f64, speed_rad_s: f64) -> Line {
    let turns_s = speed_rad_s / RAD_PER_REV;
    Line {
        velocity_lu_s: thread.rise_at_mm(s_lu) * turns_s,
        acceleration_lu_s2: thread.rise_change_mm * turns_s * turns_s,
    }
}

/// The step of velocity where one thread goes over into the next: no axis may make more than at any other corner.
fn junction(rules: &AxisRules, before: &Before, ends: &Ends, after_lu_s: f64) -> TooFast {
    let before_lu_s = line_at(&before.thread, before.length_lu, before.thread.speed_rad_s).velocity_lu_s;
    let step = |axis: AxisId| (ends.start.first[axis] * after_lu_s - before.ends.end.first[axis] * before_lu_s).abs();
    let largest = rules.largest(|axis, _| step(axis) / rules.corner_steps_lu_s[axis.index()]);
    TooFast { speed_share: 1.0 / largest.demand_ratio, limit: largest.limit(LimitKind::Corner) }
}

/// The highest share up to 1 that fits; 0 where none does.
fn highest(fits: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if fits(middle) { low = middle } else { high = middle }
    }
    low
}
