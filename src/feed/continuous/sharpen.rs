//! Finer intervals where a plan leaves limits unused because the path bends differently from one end of an interval to the other.
//!
//! In: a layout with its profile. Out: the same with some intervals in two, and the faster profile on them. b'' is the same all along an
//! interval: where q''' grows within it, as it does four times in every blend, the jerk reaches its limit at one end only. How far, only a
//! profile tells; with intervals that are fine enough for any profile every blend would cost several times as much.
//! Does not look at straight stretches: what is unused there is a change of sign of the jerk.

use super::chain::{Chain, Profile, Start};
use super::held;
use super::layout::Layout;
use super::{Continuous, Piece, look};

/// An interval whose jerk comes this near to its limit,
const NEAR_RATIO: f64 = 0.9;

/// and which somewhere uses no more than this share of any limit, is too long.
const UNUSED_RATIO: f64 = 0.75;

/// So often at most, while it gains more than this share of the time.
const PASSES_MAX: u32 = 3;
const GAIN_MIN_RATIO: f64 = 4e-3;

/// Share of a plan, from its start, that is worth it, if it does not end where the path rests: the rest is planned again.
const NEAR_SHARE: f64 = 0.6;

impl Continuous {
    /// Makes a new plan finer where that makes it faster.
    pub(super) fn sharpened(
        &mut self,
        layout: Layout,
        profile: Profile,
        pieces: &[Piece<'_>],
        start: Start,
    ) -> (Layout, Profile) {
        let mut best = (layout, profile);
        if !best.0.chain.floors_lu2_s2.is_empty() {
            return best;
        }
        for _ in 0..PASSES_MAX {
            let (layout, profile) = &best;
            let range = layout.chain.control_range(start);
            let share = if self.planning.is_last { 1.0 } else { NEAR_SHARE };
            let near = range.start + (share * range.len() as f64).ceil() as usize;
            let mut cut: Vec<bool> = (0..layout.chain.intervals.len())
                .map(|index| range.contains(&index) && index < near && unused(&layout.chain, profile, index))
                .collect();
            for place in layout.places.iter().filter(|place| place.part_lu.is_some()) {
                cut[place.intervals.clone()].fill(false);
            }
            if !cut.contains(&true) {
                break;
            }
            let before_s = profile.time_s(&layout.chain);
            let mut finer = layout.clone();
            finer.halve(&cut, pieces);
            let hints = profile.halved(&layout.chain, &cut).points;
            let planned = self.planning.plan(&mut finer.chain, start, &hints, &look(pieces, &finer.owners));
            let Some(next) = planned else { break };
            let gained_s = before_s - next.time_s(&finer.chain);
            if gained_s > 0.0 {
                best = (finer, next);
            }
            // NaN ends it too.
            if gained_s.is_nan() || gained_s <= GAIN_MIN_RATIO * before_s {
                break;
            }
        }
        best
    }
}

/// At one place the jerk is at its limit, at another one nothing is.
fn unused(chain: &Chain, profile: &Profile, index: usize) -> bool {
    let interval = &chain.intervals[index];
    if interval.is_straight() || !interval.bounds.jerk_limited {
        return false;
    }
    let (mut jerk_most, mut least) = (0.0_f64, f64::INFINITY);
    for (place, share) in [0.0, 0.5, 1.0].into_iter().enumerate() {
        let (point, bend) = profile.inside(chain, index, share);
        let [acceleration, jerk] =
            held::used(interval, &interval.states[place], &point, bend).map(|(used, _)| used / interval.reserve_ratio);
        let feed = point.speed_squared_lu2_s2 / interval.cap.velocity_lu_s.powi(2);
        jerk_most = jerk_most.max(jerk);
        least = least.min(feed.max(acceleration).max(jerk));
    }
    jerk_most > NEAR_RATIO && least < UNUSED_RATIO
}

impl Profile {
    /// With b'' as it is, about.
    fn time_s(&self, chain: &Chain) -> f64 {
        let v = |index: usize| self.points[index].speed_squared_lu2_s2.max(0.0).sqrt();
        chain.intervals.iter().enumerate().map(|(i, interval)| 2.0 * interval.length_lu() / (v(i) + v(i + 1))).sum()
    }

    /// The same with some intervals in two.
    fn halved(&self, chain: &Chain, cut: &[bool]) -> Self {
        let mut halved = Self::default();
        for (index, cut) in cut.iter().enumerate() {
            halved.points.push(self.points[index]);
            halved.bends_per_s2.push(self.bends_per_s2[index]);
            if *cut {
                halved.points.push(self.inside(chain, index, 0.5).0);
                halved.bends_per_s2.push(self.bends_per_s2[index]);
            }
        }
        halved.points.extend(self.points.last());
        halved
    }
}
