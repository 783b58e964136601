//! What the axes allow inside a corner blend (models/local-smoothing.md sections 2 and 3) [Essid 2019].
//!
//! In: a [`HermiteBlend`], the limits of the axes and the shares R_A and R_J. Out: [`PieceLimits`]: the highest constant feed through
//! the blend, and the tangential acceleration and jerk that are left to change the speed where it is lower than that.
//!
//! With the unit tangent T, the unit normal N and the curvature k an axis sees `v² k N` of acceleration and
//! `v³ k' N - v³ k² T` of jerk at constant feed. Under `blend_law = "entry"` the feed obeys (c) and (e) of section 2 at u = 0 only,
//! as published; under `"limits"` everywhere, and (d) as well. The speed may change (with a = 0 at both ends) while it is at most
//! [`RAMP_SPEED_RATIO`] of the feed that is safe everywhere: what the cubes leave of (d) and (e) goes to `j T` and
//! `3 v a k N`. Without that a chain of blends that touch (short segments) would have one speed from end to end.
//!
//! The step of `v² k N` at the ends of the blend (it is not zero for the published curve) is not limited: section 3 has no such
//! rule, and none is added here.

use super::LimitKind;
use super::limits::{AxisRules, Demand, FeedCap, PieceLimits};
use super::profile::SpeedCap;
use crate::base::Portable;
use crate::base::{AxisId, AxisVector};
use crate::geometry::{BlendPoint, HermiteBlend};
use crate::machine::BlendLaw;

/// Share of the safe feed up to which the speed may change inside a blend: half of the jerk is then left.
const RAMP_SPEED_RATIO: f64 = 0.8;

/// Distance of samples, in a measure that crowds towards the middle as the curve does.
const SAMPLE_STEP: f64 = 0.1;

/// A sharper bend is sampled like this one (c of the geometry): below it the feed is next to nothing anyway.
const SHARPEST_COSINE: f64 = 1e-6;

/// What the samples may miss of a greatest demand; what the search between two samples may miss. Tests compare with a far finer
/// sampling.
const SAMPLE_RESERVE_RATIO: f64 = 1.05;
const SEARCH_RESERVE_RATIO: f64 = 1.0 + 1e-4;

/// Rounds of the golden-section search between two samples; each leaves 0.618 of the interval.
const SEARCH_ROUNDS: usize = 14;

/// Demands per power of v and a that are watched along the blend, with their letters in section 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Watch {
    /// (c): v² k |N|.
    Radial,
    /// (e) at constant feed: v³ |k'| |N|.
    Normal,
    /// (d) at constant feed: v³ k² |T|.
    Tangential,
    /// (e): v a 3 k |N|.
    Coupled,
}

const WATCHED: [Watch; 4] = [Watch::Radial, Watch::Normal, Watch::Tangential, Watch::Coupled];

/// Limits of a blend.
pub(super) fn limits(rules: &AxisRules, blend: &HermiteBlend, feed: FeedCap, jerk_limited: bool) -> PieceLimits {
    let scan = Scan::new(rules, blend);
    let samples = scan.sample();
    let (ra, rj) = (rules.radial_acceleration_share, rules.radial_jerk_share);
    let acceleration = rules.largest(|axis, limits| scan.tangent(axis) / ((1.0 - ra) * limits.acceleration_max_lu_s2));
    let jerk = rules.largest(|axis, limits| scan.tangent(axis) / ((1.0 - rj) * limits.transition_jerk_max_lu_s3));
    let coupled = greatest(&samples, Watch::Coupled);
    let safe = scan.safe_feed(&samples);
    let geometric = match rules.blend_law {
        BlendLaw::Limits => safe,
        // "published" has the same entry; what follows it is `published`'s.
        BlendLaw::Entry | BlendLaw::Published => scan.entry_feed(),
    };
    let driven = rules.driven(feed, |axis| scan.tangent(axis));
    let cap = driven.min(geometric);
    let ramp_cap = cap.min(SpeedCap { velocity_lu_s: RAMP_SPEED_RATIO * safe.velocity_lu_s, limit: safe.limit });
    let v = ramp_cap.velocity_lu_s;
    // At the safe feed (d) and (e) use all of their shares at most; at v the cube of the ratio of it.
    let left = 1.0 - (v / safe.velocity_lu_s).powi(3);
    let over_left =
        |demand: Demand, factor: f64| Demand { demand_ratio: demand.demand_ratio * factor / left, ..demand };
    let jerk = over_left(jerk, 1.0);
    let coupled = over_left(coupled, v * SAMPLE_RESERVE_RATIO);
    let mut limits = PieceLimits::new(cap, ramp_cap, acceleration, jerk, jerk_limited);
    if jerk_limited && coupled.demand_ratio > acceleration.demand_ratio {
        limits = PieceLimits::new(cap, ramp_cap, coupled, jerk, jerk_limited);
        limits.bounds.acceleration = coupled.limit(LimitKind::RadialJerk);
    }
    if jerk_limited && rules.blend_law == BlendLaw::Published {
        limits.exit_cap = driven;
    }
    limits
}

/// Demands along one blend.
struct Scan<'a> {
    rules: &'a AxisRules,
    blend: &'a HermiteBlend,
    /// Directions of T and N in the middle: the blend is symmetric about them.
    along: AxisVector,
    inward: AxisVector,
    half_angle_rad: f64,
    /// w = b sinh(place * range), w = 2u - 1.
    width_ratio: f64,
    range_ratio: f64,
}

impl<'a> Scan<'a> {
    fn new(rules: &'a AxisRules, blend: &'a HermiteBlend) -> Self {
        let middle = blend.shape(0.5);
        // |S'| has its nearest zeros at w = ± i b with b about 1.4 cos(theta/2): that is how narrow the bend is.
        let half_angle_rad = blend.angle_rad() / 2.0;
        let width_ratio = 1.4 * half_angle_rad.portable_cos().max(SHARPEST_COSINE);
        let range_ratio = (1.0 / width_ratio).portable_asinh();
        Self { rules, blend, along: middle.tangent, inward: middle.normal, half_angle_rad, width_ratio, range_ratio }
    }

    /// What counts of the largest |T| of an axis.
    fn tangent(&self, axis: AxisId) -> f64 {
        self.rules.blend_component(self.blend, self.turned(axis), axis)
    }

    /// Largest |T| of an axis: T turns from half the angle before its middle direction to half the angle after it.
    fn turned(&self, axis: AxisId) -> f64 {
        let (along, inward) = (self.along[axis].abs(), self.inward[axis].abs());
        let (sin, cos) = self.half_angle_rad.portable_sin_cos();
        if inward * cos <= along * sin { along.portable_hypot(inward) } else { along * cos + inward * sin }
    }

    /// The blend at a place from -1 to 1.
    fn point(&self, place_ratio: f64) -> BlendPoint {
        let w = self.width_ratio * (place_ratio * self.range_ratio).portable_sinh();
        self.blend.shape(0.5 * (1.0 + w))
    }

    /// The demands from place -1 to 1 at equal distances.
    fn sample(&self) -> Vec<[Demand; WATCHED.len()]> {
        let steps = (self.range_ratio / SAMPLE_STEP).ceil().max(4.0) as usize;
        let look = |point: &BlendPoint| WATCHED.map(|watch| self.demand(watch, point));
        let mut samples = vec![look(&self.point(0.0)); 2 * steps + 1];
        for i in 1..=steps {
            let point = self.point(i as f64 / steps as f64);
            samples[steps + i] = look(&point);
            samples[steps - i] = look(&self.mirrored(&point));
        }
        samples
    }

    /// The point as far before the middle as `point` is after it.
    fn mirrored(&self, point: &BlendPoint) -> BlendPoint {
        let (t, n) = (point.tangent, point.normal);
        let tangent = self.along * (2.0 * t.dot(&self.along)) - t;
        let normal = self.inward * (2.0 * n.dot(&self.inward)) - n;
        BlendPoint { tangent, normal, ..*point }
    }

    fn component(&self, component: f64, axis: AxisId) -> f64 {
        self.rules.blend_component(self.blend, component, axis)
    }

    fn demand(&self, watch: Watch, point: &BlendPoint) -> Demand {
        let (ra, rj) = (self.rules.radial_acceleration_share, self.rules.radial_jerk_share);
        let k = point.curvature_per_mm.abs();
        let k_slope = point.curvature_slope_per_mm_mm.abs();
        self.rules.largest(|axis, limits| {
            let [t, n] = [point.tangent[axis], point.normal[axis]].map(|part| self.component(part, axis));
            let (a_max, j_max) = (limits.acceleration_max_lu_s2, limits.transition_jerk_max_lu_s3);
            match watch {
                Watch::Radial => k * n / (ra * a_max),
                Watch::Normal => k_slope * n / (rj * j_max),
                Watch::Tangential => k * k * t / ((1.0 - rj) * j_max),
                Watch::Coupled => 3.0 * k * n / (rj * j_max),
            }
        })
    }

    /// Section 3: (c) and (e) at u = 0.
    fn entry_feed(&self) -> SpeedCap {
        let entry = self.blend.shape(0.0);
        let cap = |watch| geometric_cap(watch, self.demand(watch, &entry));
        cap(Watch::Radial).min(cap(Watch::Normal))
    }

    /// The highest constant feed at which (c), (d) and (e) hold all along.
    fn safe_feed(&self, samples: &[[Demand; WATCHED.len()]]) -> SpeedCap {
        let geometric = [Watch::Radial, Watch::Normal, Watch::Tangential];
        let sampled = geometric.map(|watch| geometric_cap(watch, greatest(samples, watch)));
        let lowest_lu_s = sampled.iter().fold(f64::INFINITY, |low, cap| low.min(cap.velocity_lu_s));
        let mut safe = sampled[0];
        for (watch, cap) in geometric.into_iter().zip(sampled) {
            safe = safe.min(cap);
            // One that the samples put higher than their error cannot be the lowest.
            if cap.velocity_lu_s <= lowest_lu_s * SAMPLE_RESERVE_RATIO {
                safe = safe.min(geometric_cap(watch, self.greatest_between(samples, watch)));
            }
        }
        safe
    }

    /// The greatest demand, next to any sample that may be the nearest to it, with the reserve for what the search misses.
    fn greatest_between(&self, samples: &[[Demand; WATCHED.len()]], watch: Watch) -> Demand {
        let sampled = greatest(samples, watch);
        let ratio = |i: usize| samples.get(i).map_or(0.0, |sample| sample[watch as usize].demand_ratio);
        let step = 2.0 / (samples.len() - 1) as f64;
        let mut found = sampled;
        for i in 0..samples.len() {
            let peak = ratio(i) >= ratio(i + 1) && ratio(i) >= ratio(i.wrapping_sub(1));
            if peak && ratio(i) * SAMPLE_RESERVE_RATIO >= sampled.demand_ratio {
                let near = self.searched(watch, i as f64 * step - 1.0, step);
                if near.demand_ratio > found.demand_ratio {
                    found = near;
                }
            }
        }
        Demand { demand_ratio: found.demand_ratio * SEARCH_RESERVE_RATIO, ..found }
    }

    /// The greatest demand within a step of a place, by golden section.
    fn searched(&self, watch: Watch, place_ratio: f64, step_ratio: f64) -> Demand {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let (mut low, mut high) = ((place_ratio - step_ratio).max(-1.0), (place_ratio + step_ratio).min(1.0));
        let mut greatest = self.demand(watch, &self.point(place_ratio));
        let mut look = |place_ratio: f64| {
            let demand = self.demand(watch, &self.point(place_ratio));
            if demand.demand_ratio > greatest.demand_ratio {
                greatest = demand;
            }
            demand.demand_ratio
        };
        let (mut a, mut b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        let (mut at_a, mut at_b) = (look(a), look(b));
        for _ in 0..SEARCH_ROUNDS {
            if at_a > at_b {
                (high, b, at_b) = (b, a, at_a);
                a = high - GOLDEN * (high - low);
                at_a = look(a);
            } else {
                (low, a, at_a) = (a, b, at_b);
                b = low + GOLDEN * (high - low);
                at_b = look(b);
            }
        }
        greatest
    }
}

/// The greatest of the sampled demands.
fn greatest(samples: &[[Demand; WATCHED.len()]], watch: Watch) -> Demand {
    let demands = samples.iter().map(|sample| sample[watch as usize]);
    demands.fold(Demand { demand_ratio: 0.0, axis: AxisId::new(0) }, |most, next| {
        if next.demand_ratio > most.demand_ratio { next } else { most }
    })
}

/// The feed at which a geometric demand reaches its limit.
fn geometric_cap(watch: Watch, demand: Demand) -> SpeedCap {
    match watch {
        Watch::Radial => demand.cap(LimitKind::RadialAcceleration, 2),
        Watch::Tangential => demand.cap(LimitKind::TransitionJerk, 3),
        _ => demand.cap(LimitKind::RadialJerk, 3),
    }
}
