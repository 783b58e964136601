//! Short pieces, several to an interval.
//!
//! In: the pieces that a plan reaches. Out: [`Stretch`]es: a piece that is cut by its own grid, or several pieces in a row as one interval. A path of
//! dense points is planned in steps of time this way, not of blocks. Pieces go together where the curve goes on with its curvature and the
//! rate of it, or where lines turn so little that the greatest share of each axis says what all of them need, and where the same limits hold.
//!
//! How long an interval may be depends on the speed, which is not known yet: it is estimated from the slow places ([`border_speeds`]).
//! Does not plan.

use super::Piece;
use super::chain::PathPoint;
use super::grid::constant_speed_lu_s;
use super::interval::{Bounds, Derivatives, FASTER_MAX_RATIO, Interval, Tangent};
use crate::base::PerAxis;
use crate::feed::limits::AxisRules;
use crate::geometry::Curve;
use crate::kinematics::JointPath;
use std::sync::Arc;

/// How far the shares of the axes may differ between lines of one interval.
const TURN_MAX_RATIO: f64 = 0.02;

/// Steps of direction, of curvature and of its rate at the joints of one interval: rounding, and shares of acceleration and jerk.
const KINK_MAX_RATIO: f64 = 1e-7;
const STEP_MAX_RATIO: [f64; 2] = [0.003, 0.02];

/// How far rounding may carry a speed squared above what is allowed, and the smallest part that an interval is cut into for its first state.
const CAP_ROUNDING_RATIO: f64 = 1e-9;
const FITTING_MIN_RATIO: f64 = 1.0 / 1024.0;

/// Pieces before and after one that are looked at for slow places near it.
pub(super) const NEAR_PIECES: usize = 16;

/// Pieces of one interval at most.
const PIECES_MAX: usize = 64;

/// A piece that may be one interval, or a part of one.
#[derive(Clone, Debug)]
pub(super) struct Brief {
    pub interval: Interval,
    /// Highest constant speed on all of it.
    pub speed_lu_s: f64,
}

/// A part of the path that a plan appends to its chain.
pub(super) enum Stretch {
    /// One piece by its own grid.
    Cut,
    /// So many pieces as one interval.
    Group(usize, Box<Interval>),
}

impl Stretch {
    /// How many pieces it is.
    pub fn pieces(&self) -> usize {
        match self {
            Self::Cut => 1,
            Self::Group(count, _) => *count,
        }
    }
}

impl Brief {
    /// The piece, if it is smooth and takes no longer than an interval may; `ends`: its first and last derivatives, `places_lu_s`: the highest constant
    /// speeds there.
    pub fn new(
        rules: &AxisRules,
        path: &JointPath,
        tangent: &Tangent,
        ends: [Derivatives; 2],
        places_lu_s: [f64; 2],
    ) -> Option<Self> {
        let curve = path.contour.curve().filter(|_| path.is_contour())?;
        let length_lu = path.length_lu();
        let rules = rules.throughout(path);
        let speed_at = |state: &Derivatives| constant_speed_lu_s(rules, path, state);
        let mut speed_lu_s = places_lu_s[0];
        let fits = |speed_lu_s: f64| length_lu <= speed_lu_s * tangent.step_s;
        let straight = matches!(curve, Curve::Line(_));
        let bounds = Arc::new(Bounds::new(rules, false));
        let mut states = [ends[0]; 3];
        if !straight {
            let one_piece = match curve {
                Curve::Polynomial(curve) => curve.knots_lu().next().is_none(),
                _ => true,
            };
            speed_lu_s = speed_lu_s.min(places_lu_s[1]);
            if !one_piece || !fits(speed_lu_s) {
                return None;
            }
            states = [ends[0], Derivatives::from(path.at(0.5 * length_lu)), ends[1]];
            speed_lu_s = speed_lu_s.min(speed_at(&states[1]));
        }
        if !fits(speed_lu_s) || !(straight || bounds.smooth(speed_lu_s, states.each_ref())) {
            return None;
        }
        let interval = Interval::new(rules, path, [0.0, length_lu], states, bounds, straight);
        Some(Self { interval, speed_lu_s })
    }
}

/// The stretches of `pieces[from..]`. `speeds_lu_s`: [`border_speeds`] of the same; `cut_first`: the first piece is not part of an interval, as the last one
/// never is; `entry`: the state that the first piece begins with, if it moves.
pub(super) fn stretches(
    pieces: &[Piece<'_>],
    from: usize,
    speeds_lu_s: &[f64],
    cut_first: bool,
    entry: Option<PathPoint>,
) -> Vec<Stretch> {
    let mut stretches = Vec::new();
    let mut first = from;
    while first < pieces.len() {
        let last = first + 1 == pieces.len();
        let count =
            if last || (cut_first && first == 0) { 0 } else { together(pieces, first, &speeds_lu_s[first - from..]) };
        let (stretch, count) = match joined(pieces, first, count) {
            Some((interval, _)) if first == 0 && entry.is_some_and(|entry| !fits(&entry, &interval)) => {
                (Stretch::Cut, 1)
            }
            Some((interval, count)) => (Stretch::Group(count, Box::new(interval)), count),
            None => (Stretch::Cut, 1),
        };
        stretches.push(stretch);
        first += count;
    }
    stretches
}

/// All of an interval may begin with a state: there, and half of it later, the speed is within what it allows.
fn fits(entry: &PathPoint, interval: &Interval) -> bool {
    let length_lu = interval.length_lu();
    let b = entry.speed_squared_lu2_s2 + 0.5 * length_lu * entry.slope_lu_s2.max(0.0);
    b <= interval.cap.velocity_lu_s.powi(2) * (1.0 + CAP_ROUNDING_RATIO)
}

/// How much of an interval may begin with a state: there, and half of it later, going on as it does, the speed squared is within what feed and axes
/// allow. With less than all of it the interval has to be cut. `cap_lu_s`: highest speed all along a share of it.
pub(super) fn fitting_ratio(entry: &PathPoint, length_lu: f64, cap_lu_s: impl Fn(f64) -> f64) -> f64 {
    let (b, slope) = (entry.speed_squared_lu2_s2, entry.slope_lu_s2);
    let fits = |ratio: &f64| {
        let cap = cap_lu_s(*ratio).powi(2) * (1.0 + CAP_ROUNDING_RATIO);
        b.max(b + 0.5 * ratio * length_lu * slope) <= cap
    };
    let halves = std::iter::successors(Some(1.0), |ratio| Some(0.5 * ratio));
    // One that is too fast for any of it goes on as it is.
    halves.take_while(|ratio| *ratio >= FITTING_MIN_RATIO).find(fits).unwrap_or(1.0)
}

/// Speeds at the starts of `pieces[from..]` and at the end, about: from `entry_lu_s` they rise, before the stop at the end they fall, and so they do
/// behind and before each slow place.
pub(super) fn border_speeds(pieces: &[Piece<'_>], from: usize, entry_lu_s: f64) -> Vec<f64> {
    let pieces = &pieces[from..];
    let cap = |index: usize| {
        let (Some(before), Some(piece)) = (index.checked_sub(1).map(|before| &pieces[before]), pieces.get(index))
        else {
            return f64::INFINITY;
        };
        before.flow.ends_lu_s[1].min(piece.flow.ends_lu_s[0]).min(piece.junction.velocity_lu_s)
    };
    let mut speeds_lu_s: Vec<f64> = (0..=pieces.len()).map(cap).collect();
    let (first, last) = (0, pieces.len());
    speeds_lu_s[first] = entry_lu_s;
    speeds_lu_s[last] = 0.0;
    let mut slow = (entry_lu_s, 0.0);
    for index in 0..last {
        slow = rise(slow, &pieces[index], &mut speeds_lu_s[index + 1]);
    }
    let mut slow = (0.0, 0.0);
    for index in (0..last).rev() {
        slow = rise(slow, &pieces[index], &mut speeds_lu_s[index]);
    }
    speeds_lu_s
}

/// Highest speed at the end of a piece, about: from there the path must come down to the slow places that follow, and to its rest.
pub(super) fn speed_after_lu_s(pieces: &[Piece<'_>], index: usize) -> f64 {
    let tangent = &pieces[index].flow.tangent;
    let mut speed_lu_s = pieces[index].flow.ends_lu_s[1];
    let mut way_lu = 0.0;
    for next in pieces[index + 1..].iter().take(NEAR_PIECES) {
        let here_lu_s = next.junction.velocity_lu_s.min(next.flow.ends_lu_s[0]);
        speed_lu_s = speed_lu_s.min(tangent.reached_lu_s(here_lu_s, way_lu));
        way_lu += next.path.length_lu();
        let end_lu_s = if next.rests_after { 0.0 } else { next.flow.ends_lu_s[1] };
        speed_lu_s = speed_lu_s.min(tangent.reached_lu_s(end_lu_s, way_lu));
        if next.rests_after || way_lu > tangent.stop_lu(speed_lu_s) {
            break;
        }
    }
    speed_lu_s
}

/// The same at its start, from what is before it.
pub(super) fn speed_before_lu_s(pieces: &[Piece<'_>], index: usize, starts_at_rest: bool) -> f64 {
    let Piece { flow, junction, .. } = &pieces[index];
    let tangent = &flow.tangent;
    let mut speed_lu_s = flow.ends_lu_s[0].min(junction.velocity_lu_s);
    let mut way_lu = 0.0;
    for (number, before) in pieces[..index].iter().enumerate().rev().take(NEAR_PIECES) {
        speed_lu_s = speed_lu_s.min(tangent.reached_lu_s(before.flow.ends_lu_s[1], way_lu));
        way_lu += before.path.length_lu();
        let start_lu_s = match number {
            0 if starts_at_rest => 0.0,
            0 => f64::INFINITY,
            _ => before.junction.velocity_lu_s,
        };
        speed_lu_s = speed_lu_s.min(tangent.reached_lu_s(start_lu_s.min(before.flow.ends_lu_s[0]), way_lu));
        if way_lu > tangent.stop_lu(speed_lu_s) {
            break;
        }
    }
    speed_lu_s
}

/// From a slow place, with its speed and the way since, over a piece: the speed beyond it is at most what is reached. The slow place after it.
fn rise((slow_lu_s, way_lu): (f64, f64), piece: &Piece<'_>, speed_lu_s: &mut f64) -> (f64, f64) {
    let way_lu = way_lu + piece.path.length_lu();
    let reached_lu_s = piece.flow.tangent.reached_lu_s(slow_lu_s, way_lu);
    if reached_lu_s < *speed_lu_s {
        *speed_lu_s = reached_lu_s;
        return (slow_lu_s, way_lu);
    }
    (*speed_lu_s, 0.0)
}

/// How many pieces from `first` on may be one interval by time, limits and joints; 0: not even one. The last piece never is one of them.
fn together(pieces: &[Piece<'_>], first: usize, speeds_lu_s: &[f64]) -> usize {
    let mut time_s = 0.0;
    let (mut slowest_lu_s, mut fastest_lu_s) = (speeds_lu_s[0], speeds_lu_s[0]);
    let most = (pieces.len() - 1 - first).min(PIECES_MAX);
    for count in 0..most {
        let piece = &pieces[first + count];
        let Some(brief) = &piece.flow.brief else { return count };
        if piece.rests_after || (count > 0 && !join(&pieces[first], &pieces[first + count - 1], piece)) {
            return count;
        }
        let [from, to] = [speeds_lu_s[count], speeds_lu_s[count + 1]].map(|speed| speed.min(brief.speed_lu_s));
        (slowest_lu_s, fastest_lu_s) = (slowest_lu_s.min(from).min(to), fastest_lu_s.max(from).max(to));
        time_s += 2.0 * brief.interval.length_lu() / (from + to);
        if time_s > piece.flow.tangent.step_s || fastest_lu_s > FASTER_MAX_RATIO * slowest_lu_s {
            return count;
        }
    }
    most
}

/// The curve and its limits go on from one piece to the next, in an interval that begins with `first`.
fn join(first: &Piece<'_>, before: &Piece<'_>, piece: &Piece<'_>) -> bool {
    let (Some(a), Some(b), Some(whole)) = (&before.flow.brief, &piece.flow.brief, &first.flow.brief) else {
        return false;
    };
    if !Arc::ptr_eq(&before.flow.rules, &piece.flow.rules)
        || before.path.contour.feed != piece.path.contour.feed
        || a.interval.straight != b.interval.straight
    {
        return false;
    }
    let (end, start) = (&a.interval.states[2], &b.interval.states[0]);
    if a.interval.straight {
        return (start.first - whole.interval.states[0].first).norm() <= TURN_MAX_RATIO;
    }
    let v = a.speed_lu_s.min(b.speed_lu_s);
    let goes_on = |bound: &super::interval::AxisBound| {
        let axis = bound.axis;
        let second = (start.second[axis] - end.second[axis]).abs() * v * v / bound.acceleration_lu_s2;
        let third = bound.jerk_lu_s3.map_or(0.0, |jerk| (start.third[axis] - end.third[axis]).abs() * v.powi(3) / jerk);
        second <= STEP_MAX_RATIO[0] && third <= STEP_MAX_RATIO[1]
    };
    (start.first - end.first).norm() <= KINK_MAX_RATIO && a.interval.bounds.axes.iter().all(goes_on)
}

/// `count` pieces from `first` on as one interval, or as many of them as are smooth enough.
fn joined(pieces: &[Piece<'_>], first: usize, mut count: usize) -> Option<(Interval, usize)> {
    while count > 1 {
        if let Some(interval) = one_interval(&pieces[first..first + count]) {
            return Some((interval, count));
        }
        count /= 2;
    }
    let brief = pieces[first].flow.brief.as_ref().filter(|_| count == 1)?;
    Some((brief.interval.clone(), 1))
}

fn one_interval(pieces: &[Piece<'_>]) -> Option<Interval> {
    let briefs = || pieces.iter().filter_map(|piece| piece.flow.brief.as_ref());
    let (first, last) = (briefs().next()?, briefs().next_back()?);
    let length_lu = pieces.iter().map(|piece| piece.path.length_lu()).sum::<f64>();
    let mut interval = Interval { start_lu: 0.0, end_lu: length_lu, ..first.interval.clone() };
    for (piece, brief) in pieces.iter().zip(briefs()).skip(1) {
        interval.cap = interval.cap.min(brief.interval.cap).min(piece.junction);
    }
    if interval.straight {
        let most = |axis| briefs().map(|brief| brief.interval.states[0].first[axis].abs()).fold(0.0, f64::max);
        let state = Derivatives { first: PerAxis::from_fn(most), ..first.interval.states[0] };
        interval.states = [state; 3];
        return Some(interval);
    }
    let (piece, s_lu) = place(pieces.iter().map(|piece| piece.path), 0.5 * length_lu)?;
    interval.states = [first.interval.states[0], Derivatives::from(piece.at(s_lu)), last.interval.states[2]];
    let smooth = interval.bounds.smooth(interval.cap.velocity_lu_s, interval.states.each_ref());
    smooth.then_some(interval)
}

/// The piece in which the place `s_lu` from the start of the first lies, and its place there.
pub(super) fn place<'a>(paths: impl Iterator<Item = &'a JointPath>, s_lu: f64) -> Option<(&'a JointPath, f64)> {
    let mut left_lu = s_lu;
    let mut found = None;
    for path in paths {
        found = Some((path, left_lu));
        if left_lu <= path.length_lu() {
            break;
        }
        left_lu -= path.length_lu();
    }
    found
}
