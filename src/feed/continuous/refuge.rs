//! A law that always exists: one piece from rest to rest, slowly.
//!
//! In: the intervals of a piece, or of what is left of it. Out: a [`TimeLaw`] of seven phases with the greatest demands of the whole piece: at the highest speed the bend takes half of
//! what each axis allows, and changes of speed take the rest. Where one place is much slower than the others, as in a blend that all but turns back, it has a law of its own, with
//! a rest before and after it: else the whole piece would creep. Used where no plan was found from a state of rest.

use super::grid::Grid;
use super::interval::Interval;
use crate::base::Portable;
use crate::feed::profile::{Bounds, SpeedCap, Stretch, seven_phases};
use crate::feed::ramp::Dynamics;
use crate::feed::{Limit, LimitKind, Phase, TimeLaw};

/// So often a piece is put in parts at its slowest place, and the parts again.
const DEPTH_MAX: u32 = 64;

/// The law of a piece alone.
pub(super) fn alone(grid: &Grid) -> TimeLaw {
    quicker(&grid.intervals, DEPTH_MAX)
}

/// The quicker one: a law for all of it, or one for the slowest place, one for what is before it and one for what is after it.
fn quicker(intervals: &[Interval], depth: u32) -> TimeLaw {
    let whole = rest_to_rest(intervals);
    let slowest = (0..intervals.len()).min_by(|a, b| slow(&intervals[*a]).total_cmp(&slow(&intervals[*b])));
    let Some(slowest) = slowest.filter(|_| intervals.len() > 1 && depth > 0) else { return whole };
    let parts = [&intervals[..slowest], &intervals[slowest..=slowest], &intervals[slowest + 1..]];
    let laws = parts.iter().filter(|part| !part.is_empty()).map(|part| quicker(part, depth - 1));
    let parted = TimeLaw::new(laws.flat_map(|law| law.phases().to_vec()));
    if parted.duration_s() < whole.duration_s() { parted } else { whole }
}

fn rest_to_rest(intervals: &[Interval]) -> TimeLaw {
    let [Some(begin), Some(last)] = [intervals.first(), intervals.last()] else { return TimeLaw::default() };
    let limit = Limit { kind: LimitKind::LookAhead, axis: None };
    let cap = intervals.iter().map(slow).fold(f64::INFINITY, f64::min);
    let (mut acceleration, mut jerk) = (f64::INFINITY, f64::INFINITY);
    for interval in intervals {
        for bound in &interval.bounds.axes {
            let [first, second, _] = most(interval, bound.axis);
            acceleration = acceleration.min(0.5 * bound.acceleration_lu_s2 / first);
            let Some(limit) = bound.jerk_lu_s3 else { continue };
            // |3 q'' v a| and |q' j| take a quarter each; the bend has half.
            acceleration = acceleration.min(0.25 * limit / (3.0 * cap * second));
            jerk = jerk.min(0.25 * limit / first);
        }
    }
    let jerk_limited = last.bounds.jerk_limited;
    let bounds = Bounds {
        cruise: SpeedCap { velocity_lu_s: cap, limit },
        dynamics: Dynamics { acceleration_lu_s2: acceleration, jerk_lu_s3: jerk_limited.then_some(jerk) },
        acceleration: limit,
        jerk: limit,
    };
    let rest = SpeedCap { velocity_lu_s: 0.0, limit };
    let law = seven_phases(&Stretch { length_lu: last.end_lu - begin.start_lu, entry: rest, exit: rest }, &bounds);
    TimeLaw::new(law.phases().iter().map(|phase| Phase { start_lu: begin.start_lu + phase.start_lu, ..*phase }))
}

/// Highest speed at which the bend takes half of the limits.
fn slow(interval: &Interval) -> f64 {
    let mut v = interval.cap.velocity_lu_s;
    for bound in &interval.bounds.axes {
        let [_, second, third] = most(interval, bound.axis);
        v = v.min((0.5 * bound.acceleration_lu_s2 / second).sqrt());
        if let Some(jerk) = bound.jerk_lu_s3 {
            v = v.min((0.5 * jerk / third).portable_cbrt());
        }
    }
    v
}

fn most(interval: &Interval, axis: crate::base::AxisId) -> [f64; 3] {
    let mut most = [0.0_f64; 3];
    for state in &interval.states {
        let shares = [&state.first, &state.second, &state.third].map(|derivative| derivative[axis].abs());
        most.iter_mut().zip(shares).for_each(|(most, share)| *most = most.max(share));
    }
    // Between the places.
    most.map(|share| 1.1 * share)
}
