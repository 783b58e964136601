//! A law that always exists: one piece from rest to rest, slowly.
//!
//! In: the intervals of a piece, or of what is left of it. Out: a seven-phase [`TimeLaw`] with the greatest demands of the whole piece: at the highest speed the bend takes half of
//! what each axis allows, and changes of speed take the rest. Used where no plan was found from a state of rest.

use super::grid::Grid;
use super::interval::Interval;
use crate::base::Portable;
use crate::feed::profile::{Bounds, SpeedCap, Stretch, seven_phases};
use crate::feed::ramp::Dynamics;
use crate::feed::{Limit, LimitKind, Phase, TimeLaw};

/// The law of a piece alone.
pub(super) fn alone(grid: &Grid) -> TimeLaw {
    let [Some(begin), Some(last)] = [grid.intervals.first(), grid.intervals.last()] else { return TimeLaw::default() };
    let limit = Limit { kind: LimitKind::LookAhead, axis: None };
    let cap = grid.intervals.iter().map(slow).fold(f64::INFINITY, f64::min);
    let (mut acceleration, mut jerk) = (f64::INFINITY, f64::INFINITY);
    for interval in &grid.intervals {
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
