//! Whether a profile keeps its limits between the places at which it was planned, and what holds it where.
//!
//! In: a chain and its profile. Out: the greatest use of any limit in each interval, sampled at eighths with a parabola through each three neighbours;
//! tighter reserves where that is too much ([`tighten`]); the [`Limit`] that holds an interval.
//! Does not plan.

use super::chain::{Chain, Look, PathPoint, Profile};
use super::estimate::ray_exponent;
use super::interval::{AxisBound, Derivatives, Interval};
use crate::base::Portable;
use crate::feed::{Limit, LimitKind};

/// How far below the share that would just do.
const TIGHTER_RATIO: f64 = 0.995;

/// A limit that is used so far at the eighths of an interval holds between them.
const HELD_RATIO: f64 = 0.9995;

/// A junction holds the speed where b comes this near to what it allows; of equals the junction is the weaker reason.
const JUNCTION_SHARE: f64 = 0.999;

/// A speed that is this near to what it may be, by its square, is reached: to a thousandth, as in the figure `programmed_feed_share`.
const REACHED_RATIO: f64 = 0.998;

/// A profile that uses a limit this many times is not slowed down but given up.
const SLOWED_MAX_RATIO: f64 = 4.0;

/// Above this use of a limit the curve itself is looked at, at its quarters.
const NEAR_RATIO: f64 = 0.5;

/// Where demands there are further than this from what the ends and the middle make one expect, of the limit, at its eighths: by cubics between the
/// quarters an eighth of it would be missed.
const MISSED_MAX_RATIO: f64 = 0.004;

/// Places of an interval that are looked at where the eighths are not enough.
const PLACES_MAX: usize = 65;

impl Profile {
    /// State inside an interval, `share` of its length from its start.
    pub fn inside(&self, chain: &Chain, index: usize, share: f64) -> (PathPoint, f64) {
        let (point, bend) = (self.points[index], self.bends_per_s2[index]);
        let x = share * chain.intervals[index].length_lu();
        let b = point.speed_squared_lu2_s2 + x * (point.slope_lu_s2 + 0.5 * x * bend);
        (PathPoint { speed_squared_lu2_s2: b, slope_lu_s2: point.slope_lu_s2 + x * bend }, bend)
    }

    /// State inside the interval of a start or a stop, `share` of its length from the rest.
    fn near_rest(&self, chain: &Chain, index: usize, share: f64) -> (PathPoint, f64) {
        let interval = &chain.intervals[index];
        let (way_lu, power) = (share * interval.length_lu(), ray_exponent(interval));
        let [from, to] = [index, index + 1].map(|border| self.points[border].speed_squared_lu2_s2);
        let (b_end, sign) = if from <= 0.0 { (to, 1.0) } else { (from, -1.0) };
        let b = b_end * share.portable_powf(power);
        let point = PathPoint { speed_squared_lu2_s2: b, slope_lu_s2: sign * power * b / way_lu };
        (point, power * (power - 1.0) * b / way_lu.powi(2))
    }

    /// b stays above 0 between the ends of an interval: the parabola may dip below it where the path slows down at the start and speeds up at the end.
    fn goes_on(&self, chain: &Chain, index: usize) -> bool {
        let (from, bend) = (self.points[index], self.bends_per_s2[index]);
        let to_slope = from.slope_lu_s2 + bend * chain.intervals[index].length_lu();
        let dips = bend > 0.0 && from.slope_lu_s2 < 0.0 && to_slope > 0.0;
        !dips || from.speed_squared_lu2_s2 > 0.5 * from.slope_lu_s2 * from.slope_lu_s2 / bend
    }

    /// What holds the speed in an interval, and how much of it is used: of the limits what is used most at its middle, of the junctions at its ends what is
    /// reached; of a speed the square counts.
    pub fn limit(&self, chain: &Chain, index: usize) -> (f64, Limit) {
        let interval = &chain.intervals[index];
        let rests = [index, index + 1].map(|border| self.points[border].speed_squared_lu2_s2 <= 0.0);
        let (point, bend) =
            if rests == [false; 2] { self.inside(chain, index, 0.5) } else { self.near_rest(chain, index, 0.5) };
        // A speed that is not reached holds nothing: between two ramps no axis may use much of its limits either.
        let speed = point.speed_squared_lu2_s2 / interval.cap.velocity_lu_s.powi(2);
        let mut most = (if speed >= REACHED_RATIO { speed } else { 0.0 }, interval.cap.limit);
        let mut offer = |used: f64, limit: Limit| {
            if used > most.0 {
                most = (used, limit);
            }
        };
        for (used, limit) in used(interval, &interval.states[1], &point, bend) {
            offer(used / interval.reserve_ratio, limit);
        }
        for border in [index, index + 1] {
            if let Some(junction) = chain.junctions.get(border) {
                let b = self.points[border].speed_squared_lu2_s2;
                offer(JUNCTION_SHARE * b / junction.speed_squared_lu2_s2, junction.limit);
            }
        }
        most
    }
}

/// How far acceleration and jerk are used at a place, each by the axis that uses it most.
pub(super) fn used(interval: &Interval, state: &Derivatives, point: &PathPoint, bend_per_s2: f64) -> [(f64, Limit); 2] {
    let b = point.speed_squared_lu2_s2.max(0.0);
    let mut most = [(0.0, interval.cap.limit); 2];
    for bound in &interval.bounds.axes {
        let [acceleration, jerk] = demands(bound, state, point, bend_per_s2);
        let jerk_limit = bound.jerk_lu_s3.unwrap_or(f64::INFINITY);
        let uses = [
            (acceleration.abs() / bound.acceleration_lu_s2, LimitKind::Acceleration),
            (jerk.abs() * b.sqrt() / jerk_limit, interval.bounds.jerk_kind),
        ];
        for (most, (use_ratio, kind)) in most.iter_mut().zip(uses) {
            if use_ratio > most.0 {
                *most = (use_ratio, Limit { kind, axis: Some(bound.axis) });
            }
        }
    }
    most
}

/// Acceleration of an axis, and its jerk over √b (`chain`).
fn demands(bound: &AxisBound, state: &Derivatives, point: &PathPoint, bend_per_s2: f64) -> [f64; 2] {
    let (b, slope) = (point.speed_squared_lu2_s2, point.slope_lu_s2);
    let [first, second, third] = [&state.first, &state.second, &state.third].map(|derivative| derivative[bound.axis]);
    [second * b + 0.5 * first * slope, third * b + 1.5 * second * slope + 0.5 * first * bend_per_s2]
}

/// How much of its limits an interval uses at most, on the curve itself where it comes near them; NaN where b is not positive or a demand no
/// number.
fn used_inside(chain: &Chain, profile: &Profile, index: usize, look: &Look<'_>) -> f64 {
    let interval = &chain.intervals[index];
    if !profile.goes_on(chain, index) {
        return f64::NAN;
    }
    if interval.is_straight() {
        return used_straight(interval, profile, chain, index);
    }
    let expected = interval.eighths(None);
    let rough = most_used(interval, profile, chain, index, &expected);
    // What was found to exceed a limit once stays in view: with less of it the rough figure says less, not the curve.
    if (rough < NEAR_RATIO && !interval.tightened) || rough.is_nan() {
        return rough;
    }
    let at = |eighth: usize| look(index, interval.start_lu + 0.125 * eighth as f64 * interval.length_lu());
    let mut states = interval.eighths(Some([at(2), at(6)]));
    let misses = |place: &usize| missed(chain, profile, index, *place, [&states[*place], &expected[*place]]);
    if [2, 6].iter().map(misses).any(|ratio| ratio > MISSED_MAX_RATIO || ratio.is_nan()) {
        let between = states;
        for eighth in [1, 3, 5, 7] {
            states[eighth] = at(eighth);
        }
        let misses = |place: &usize| missed(chain, profile, index, *place, [&states[*place], &between[*place]]);
        if [1, 3, 5, 7].iter().map(misses).any(|ratio| ratio > MISSED_MAX_RATIO || ratio.is_nan()) {
            // A curve that turns within a part of the interval may have its peak between the eighths.
            let place = |i: usize| {
                let share = i as f64 / (PLACES_MAX - 1) as f64;
                look(index, interval.start_lu + share * interval.length_lu())
            };
            let states: [Derivatives; PLACES_MAX] = std::array::from_fn(place);
            return most_used(interval, profile, chain, index, &states);
        }
    }
    most_used(interval, profile, chain, index, &states)
}

/// How far the demands of an eighth of an interval are apart for two opinions on its derivatives, of what is allowed.
fn missed(chain: &Chain, profile: &Profile, index: usize, place: usize, states: [&Derivatives; 2]) -> f64 {
    let interval = &chain.intervals[index];
    let (point, bend) = profile.inside(chain, index, 0.125 * place as f64);
    let v = point.speed_squared_lu2_s2.max(0.0).sqrt();
    let mut most = 0.0_f64;
    for bound in &interval.bounds.axes {
        let [one, other] = states.map(|state| demands(bound, state, &point, bend));
        let jerk = bound.jerk_lu_s3.unwrap_or(f64::INFINITY);
        most = most.max((one[0] - other[0]).abs() / bound.acceleration_lu_s2);
        most = most.max((one[1] - other[1]).abs() * v / jerk);
    }
    most
}

/// The same on a straight stretch: the acceleration is greatest at an end, the jerk where b is.
fn used_straight(interval: &Interval, profile: &Profile, chain: &Chain, index: usize) -> f64 {
    let bend = profile.bends_per_s2[index];
    let points = [0.0, 0.5, 1.0].map(|share| profile.inside(chain, index, share).0);
    if points.iter().any(|point| !positive(point)) {
        return f64::NAN;
    }
    let ends = [points[0], points[2]];
    let mut b = ends.iter().fold(0.0_f64, |most, point| most.max(point.speed_squared_lu2_s2));
    let slope = points[0].slope_lu_s2;
    if bend < 0.0 && slope > 0.0 && points[2].slope_lu_s2 < 0.0 {
        // The vertex of the parabola lies inside.
        b = points[0].speed_squared_lu2_s2 - 0.5 * slope * slope / bend;
    }
    let slope = ends.iter().fold(0.0_f64, |most, point| most.max(point.slope_lu_s2.abs()));
    let mut most = 0.0_f64;
    for bound in &interval.bounds.axes {
        let first = interval.states[0].first[bound.axis].abs();
        most = most.max(0.5 * first * slope / bound.acceleration_lu_s2);
        most = most.max(0.5 * first * bend.abs() * b.sqrt() / bound.jerk_lu_s3.unwrap_or(f64::INFINITY));
    }
    most
}

/// `states`: at equal distances, up to [`PLACES_MAX`] of them.
fn most_used(interval: &Interval, profile: &Profile, chain: &Chain, index: usize, states: &[Derivatives]) -> f64 {
    let count = states.len().min(PLACES_MAX);
    let share = |i: usize| i as f64 / (count - 1) as f64;
    let mut places = [(PathPoint { speed_squared_lu2_s2: 0.0, slope_lu_s2: 0.0 }, 0.0); PLACES_MAX];
    let places = &mut places[..count];
    places.iter_mut().enumerate().for_each(|(i, place)| *place = profile.inside(chain, index, share(i)));
    if places.iter().any(|(point, _)| !positive(point)) {
        return f64::NAN;
    }
    let mut most = 0.0_f64;
    for bound in &interval.bounds.axes {
        let (mut accelerations, mut jerks) = ([0.0; PLACES_MAX], [0.0; PLACES_MAX]);
        let (accelerations, jerks) = (&mut accelerations[..count], &mut jerks[..count]);
        for (i, ((point, bend), state)) in places.iter().zip(states).enumerate() {
            let [acceleration, jerk] = demands(bound, state, point, *bend);
            accelerations[i] = acceleration;
            jerks[i] = jerk * point.speed_squared_lu2_s2.sqrt();
        }
        if accelerations.iter().chain(jerks.iter()).any(|demand| !demand.is_finite()) {
            return f64::NAN;
        }
        most = most.max(summit(accelerations) / bound.acceleration_lu_s2);
        if let Some(jerk) = bound.jerk_lu_s3 {
            most = most.max(summit(jerks) / jerk);
        }
    }
    most
}

/// Greatest amount of a function that is known at equal distances: between them by parabolas.
fn summit(values: &[f64]) -> f64 {
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

/// The same profile from rest to rest, slower by what its limits are used too far: with time stretched by λ accelerations fall with λ², jerks with λ³.
pub(super) fn slowed(
    chain: &Chain,
    mut profile: Profile,
    range: &std::ops::Range<usize>,
    look: &Look<'_>,
) -> Option<Profile> {
    let at_rest = [0, range.end].map(|index| used_at_rest(chain, &profile, index, look));
    let most = range
        .clone()
        .map(|index| used_inside(chain, &profile, index, look))
        .chain(at_rest)
        .fold(0.0_f64, |most, used| if used.is_nan() { used } else { most.max(used) });
    if most.is_nan() || most > SLOWED_MAX_RATIO {
        return None;
    }
    let ratio = HELD_RATIO / most.max(HELD_RATIO);
    for point in &mut profile.points {
        point.speed_squared_lu2_s2 *= ratio;
        point.slope_lu_s2 *= ratio;
    }
    profile.bends_per_s2.iter_mut().for_each(|bend| *bend *= ratio);
    Some(profile)
}

/// True if every limit holds inside every interval too; else the limits of those where it does not are tightened.
pub(super) fn tighten(chain: &mut Chain, profile: &Profile, range: &std::ops::Range<usize>, look: &Look<'_>) -> bool {
    let mut holds = true;
    for index in range.clone() {
        let most = used_inside(chain, profile, index, look);
        if most <= HELD_RATIO {
            continue;
        }
        holds = false;
        let ratio = if most.is_nan() { 0.5 } else { (TIGHTER_RATIO / most).max(0.5) };
        chain.intervals[index].tighten(ratio);
    }
    let starts = (range.start == 1).then_some(0);
    for index in starts.into_iter().chain([range.end]) {
        let most = used_at_rest(chain, profile, index, look);
        if most > HELD_RATIO || most.is_nan() {
            holds = false;
            let ratio = if most.is_nan() { 0.5 } else { (TIGHTER_RATIO / most).max(0.5) };
            chain.intervals[index].tighten(ratio);
        }
    }
    holds
}

/// How much of its limits the interval of a start (the first) or a stop uses at most, where b goes with a power of the way from the rest.
fn used_at_rest(chain: &Chain, profile: &Profile, index: usize, look: &Look<'_>) -> f64 {
    let Some(interval) = chain.intervals.get(index).filter(|interval| !interval.is_straight()) else { return 0.0 };
    let rough = most_used_at_rest(chain, profile, index, &interval.eighths(None));
    if (rough < NEAR_RATIO && !interval.tightened) || rough.is_nan() {
        return rough;
    }
    let mut eighths = interval.eighths(None);
    for eighth in [1, 2, 3, 5, 6, 7] {
        eighths[eighth] = look(index, interval.start_lu + 0.125 * eighth as f64 * interval.length_lu());
    }
    most_used_at_rest(chain, profile, index, &eighths)
}

fn most_used_at_rest(chain: &Chain, profile: &Profile, index: usize, states: &[Derivatives; 9]) -> f64 {
    let interval = &chain.intervals[index];
    let starts = profile.points[index].speed_squared_lu2_s2 <= 0.0;
    let mut most = 0.0_f64;
    for eighth in 1..=8 {
        let state = &states[if starts { eighth } else { 8 - eighth }];
        let (point, bend) = profile.near_rest(chain, index, 0.125 * eighth as f64);
        let b = point.speed_squared_lu2_s2;
        for bound in &interval.bounds.axes {
            let [acceleration, jerk] = demands(bound, state, &point, bend);
            let jerk_ratio = jerk.abs() * b.sqrt() / bound.jerk_lu_s3.unwrap_or(f64::INFINITY);
            let ratios = [acceleration.abs() / bound.acceleration_lu_s2, jerk_ratio];
            // `max` would pass over what is no number.
            if ratios.iter().any(|ratio| ratio.is_nan()) {
                return f64::NAN;
            }
            most = ratios.into_iter().fold(most, f64::max);
        }
    }
    most
}

fn positive(point: &PathPoint) -> bool {
    point.speed_squared_lu2_s2 > 0.0
}
