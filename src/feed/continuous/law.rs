//! Profile -> time law of a piece.
//!
//! In: intervals with the b at their borders. Out: [`Phase`]s. Where b is a parabola in s, `s'' = b'/2` is linear in s: the phase has the closed form
//! of a hyperbolic or circular motion. A start from rest and a stop are phases of constant jerk (constant acceleration under BRISK).
//! Does not look at limits.

use super::chain::{Chain, PathPoint, Profile};
use super::layout::Place;
use crate::base::Portable;
use crate::feed::{Limit, Phase, TimeLaw};

/// Below this |z| the series of the duration is exact.
const SERIES_MAX_RATIO: f64 = 0.02;

/// The law of a piece. `limits`: what holds each interval.
pub(super) fn law(chain: &Chain, profile: &Profile, place: &Place, limits: impl Fn(usize) -> Limit) -> TimeLaw {
    if let Some([from_lu, to_lu]) = place.part_lu {
        let index = place.intervals.start;
        let length_lu = chain.intervals[index].length_lu();
        let points = [from_lu, to_lu].map(|way_lu| profile.inside(chain, index, way_lu / length_lu).0);
        return TimeLaw::new([phase(0.0, to_lu - from_lu, points, profile.bends_per_s2[index], limits(index))]);
    }
    TimeLaw::new(place.intervals.clone().map(|index| {
        let interval = &chain.intervals[index];
        let points = [profile.points[index], profile.points[index + 1]];
        let (start_lu, length_lu, limit) = (interval.start_lu, interval.length_lu(), limits(index));
        if points.iter().any(|point| point.speed_squared_lu2_s2 <= 0.0) {
            return rest_phase(start_lu, length_lu, points, interval.bounds.jerk_limited, limit);
        }
        phase(start_lu, length_lu, points, profile.bends_per_s2[index], limit)
    }))
}

/// Between two places where the path moves.
fn phase(start_lu: f64, length_lu: f64, points: [PathPoint; 2], bend_per_s2: f64, limit: Limit) -> Phase {
    let [v0, v1] = points.map(|point| point.speed_squared_lu2_s2.sqrt());
    let rate_per_s2 = 0.5 * bend_per_s2;
    Phase {
        duration_s: duration_s(length_lu, v0 + v1, rate_per_s2),
        start_lu,
        velocity_lu_s: v0,
        acceleration_lu_s2: 0.5 * points[0].slope_lu_s2,
        jerk_lu_s3: 0.0,
        rate_per_s2,
        limit,
    }
}

/// With `s'' = a + k s` the ends of a phase obey `h = (v0 + v1) tanh(√k T/2)/√k`.
fn duration_s(length_lu: f64, speeds_lu_s: f64, rate_per_s2: f64) -> f64 {
    let x = length_lu / speeds_lu_s;
    let z = rate_per_s2 * x * x;
    if z.abs() <= SERIES_MAX_RATIO {
        // atanh(√z)/√z
        let tail = 1.0 / 11.0 + z * (1.0 / 13.0 + z / 15.0);
        return 2.0 * x * (1.0 + z * (1.0 / 3.0 + z * (0.2 + z * (1.0 / 7.0 + z * (1.0 / 9.0 + z * tail)))));
    }
    let root = z.abs().sqrt();
    let angle = if z > 0.0 { root.min(1.0 - f64::EPSILON).portable_atanh() } else { root.portable_atan() };
    2.0 * x * angle / root
}

/// From rest to the speed at the end of an interval, or the other way round.
fn rest_phase(start_lu: f64, length_lu: f64, points: [PathPoint; 2], jerk_limited: bool, limit: Limit) -> Phase {
    let speed_lu_s = points[0].speed_squared_lu2_s2.max(points[1].speed_squared_lu2_s2).sqrt();
    let starts = points[0].speed_squared_lu2_s2 <= 0.0;
    let velocity_lu_s = if starts { 0.0 } else { speed_lu_s };
    let phase = Phase {
        duration_s: 0.0,
        start_lu,
        velocity_lu_s,
        acceleration_lu_s2: 0.0,
        jerk_lu_s3: 0.0,
        rate_per_s2: 0.0,
        limit,
    };
    if !jerk_limited {
        let duration_s = 2.0 * length_lu / speed_lu_s;
        let acceleration_lu_s2 = speed_lu_s / duration_s;
        return Phase {
            duration_s,
            acceleration_lu_s2: if starts { acceleration_lu_s2 } else { -acceleration_lu_s2 },
            ..phase
        };
    }
    // s = j t³/6, v = j t²/2
    let duration_s = 3.0 * length_lu / speed_lu_s;
    let jerk_lu_s3 = 6.0 * length_lu / duration_s.powi(3);
    let acceleration_lu_s2 = if starts { 0.0 } else { -jerk_lu_s3 * duration_s };
    Phase { duration_s, acceleration_lu_s2, jerk_lu_s3, ..phase }
}
