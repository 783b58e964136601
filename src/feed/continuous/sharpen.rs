//! Finer intervals where a plan loses time because they are too long.
//!
//! In: a layout with its profile, and what the limits cost in that plan (`interior_point`). Out: the same with some intervals in parts, and the
//! faster profile on them. b'' is the same all along an interval: where q''' grows within it, as it does four times in every blend, or √b on a
//! ramp, the jerk reaches its limit at one end only. How much time that costs the multipliers of the plan tell to first order: the price of the
//! limit times what the other places leave of it. With intervals that are fine enough for any profile every blend would cost several times as
//! much to plan.
//! Does not know rows or multipliers.

use super::chain::{Chain, PathPoint, Profile, Start};
use super::interval::{Interval, cap};
use super::layout::{self, Layout};
use super::{Continuous, Piece, look};

/// What intervals that are too long may cost together, of the time of a plan; so far it pays to plan again. The last plan of a path is not made again.
const COST_RATIO: f64 = 1e-3;
const COST_MAX_RATIO: f64 = 2.0 * COST_RATIO;
const LAST_COST_MAX_RATIO: f64 = COST_RATIO;

/// Where a plan became so much faster than was expected, of its time, first order says too little: a profile may go from one limit to the opposite one
/// and back where there was no room for that. There half of the cost and more is worth another plan.
const SURPRISE_RATIO: f64 = 2e-3;
const LEFT_SHARE: f64 = 0.4;

/// So often at most, and in so many parts at once.
const PASSES_MAX: u32 = 5;
const PARTS_MAX: usize = 4;

/// An interval that takes less than this stays whole: what is gained there no axis sees.
const SHORTEST_S: f64 = 4e-5;

/// Where so much of the time hangs on the limits of one interval, if they were wider by 1, it is put in parts once whatever first order says: its profile may
/// be the best of its kind, and another kind faster that only shorter intervals can follow. Counted is this share of it. Again it is put in parts where what
/// hangs on it is this many times its own time: a place through which all before and after it must pass; but not in a plan after which another one
/// looks further. Where one limit holds a whole path it is between a third (jerk) and a half (acceleration) of it.
const HEAVY_PRICE: f64 = 0.003;
const HEAVY_SHARE: f64 = 0.1;
const NARROW_RATIO: f64 = 5.0;

/// A limit that another part of the interval would not need counts as so much wider there at most.
const WIDER_MAX_RATIO: f64 = 1.0;

/// A speed whose price is less does not hold the interval.
const PRICE_MIN: f64 = 1e-7;

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
        let mut surprises = false;
        for pass in 0..PASSES_MAX {
            let (layout, profile) = &best;
            let costs = self.costs(layout, profile, pieces, start, pass == 0);
            let cost: f64 = costs.iter().sum();
            let cost_max_ratio = if self.planning.is_last { LAST_COST_MAX_RATIO } else { COST_MAX_RATIO };
            if cost <= cost_max_ratio && !surprises {
                break;
            }
            let parts = parts(&costs, COST_RATIO.min(LEFT_SHARE * cost));
            if parts.iter().all(|parts| *parts == 1) {
                break;
            }
            let before_s = profile.time_s(&layout.chain);
            let Some(next) = self.finer(layout, profile, &parts, pieces, start) else { break };
            let gained = 1.0 - next.1.time_s(&next.0.chain) / before_s;
            if gained.is_nan() || gained < 0.0 {
                break;
            }
            surprises = gained > cost + SURPRISE_RATIO;
            best = next;
        }
        best
    }

    /// The plan with intervals in parts, from the one before. Of the last plan of a path, where that way ends before the solution, also from nothing and with
    /// half of the parts: no later plan would find what is lost.
    fn finer(
        &mut self,
        layout: &Layout,
        profile: &Profile,
        parts: &[usize],
        pieces: &[Piece<'_>],
        start: Start,
    ) -> Option<(Layout, Profile)> {
        let mut attempt = |parts: &[usize], hints: &[PathPoint]| {
            let mut finer = layout.clone();
            finer.divide(parts, pieces);
            self.planning.handed_out = layout::handed_out(&finer.places);
            let planned = self.planning.plan(&mut finer.chain, start, hints, &look(pieces, &finer.owners));
            (planned.map(|profile| (finer, profile)), self.planning.is_solved())
        };
        let (first, solved) = attempt(parts, &profile.divided(&layout.chain, parts));
        let is_last = pieces.last().is_some_and(|last| last.rests_after);
        if !is_last || (solved && first.is_some()) {
            return first;
        }
        let fewer: Vec<usize> = parts.iter().map(|parts| parts.div_ceil(2)).collect();
        let time_s = |plan: &(Layout, Profile)| plan.1.time_s(&plan.0.chain);
        let first_s = first.as_ref().map_or(f64::INFINITY, time_s);
        for (parts, hints) in [(parts, Vec::new()), (&fewer[..], profile.divided(&layout.chain, &fewer))] {
            let (next, solved) = attempt(parts, &hints);
            if let Some(next) = next.filter(|next| solved && time_s(next) <= first_s) {
                return Some(next);
            }
        }
        // What is known of the costs is not that of this plan.
        self.planning.forget_solution();
        first
    }

    /// What each interval costs because it is not in parts, of the time of the plan; after a plan of this layout. Nothing where the next plan comes
    /// before it, or where an interval is a short piece or several: what these would gain is not worth their number. `first`: nothing is known yet of how a
    /// finer plan is.
    fn costs(&self, layout: &Layout, profile: &Profile, pieces: &[Piece<'_>], start: Start, first: bool) -> Vec<f64> {
        let Layout { chain, owners, .. } = layout;
        let range = chain.control_range(start);
        let near = range.end.min(self.planning.near(chain, profile));
        let mut costs = vec![0.0; chain.intervals.len()];
        let whole_s = profile.time_s(chain);
        for index in range.start..near {
            let interval = &chain.intervals[index];
            let v = profile.points[index].speed_squared_lu2_s2.sqrt();
            let Some(prices) =
                self.planning.prices(index - range.start, first).filter(|_| interval.length_lu() > SHORTEST_S * v)
            else {
                continue;
            };
            let tighter = (interval.base_reserve_ratio() / interval.reserve_ratio - 1.0).min(WIDER_MAX_RATIO);
            let slower = if interval.is_straight() || prices.cap < PRICE_MIN {
                0.0
            } else {
                slower(interval, &pieces[owners[index]])
            };
            let mut cost = prices.unused + prices.limits * tighter + prices.cap * slower;
            let is_narrow =
                || self.planning.is_last && prices.limits > NARROW_RATIO * profile.interval_s(chain, index) / whole_s;
            if prices.limits > HEAVY_PRICE && (first || is_narrow()) {
                cost = cost.max(HEAVY_SHARE * prices.limits);
            }
            costs[index] = if cost.is_finite() { cost } else { 0.0 };
        }
        for (place, piece) in layout.places.iter().zip(pieces) {
            if place.part_lu.is_some() || (place.intervals.len() == 1 && piece.flow.brief.is_some()) {
                costs[place.intervals.clone()].fill(0.0);
            }
        }
        costs
    }
}

/// By how much more b could be at the places of an interval than all along it, in the mean.
fn slower(interval: &Interval, piece: &Piece<'_>) -> f64 {
    let rules = piece.flow.rules.throughout(piece.path);
    let wider = |state| {
        let place = cap(rules, piece.path, &[state], 0.0).velocity_lu_s;
        ((place / interval.cap.velocity_lu_s).powi(2) - 1.0).clamp(0.0, WIDER_MAX_RATIO)
    };
    let [from, middle, to] = &interval.states;
    0.25 * wider(from) + 0.5 * wider(middle) + 0.25 * wider(to)
}

/// In how many parts each interval is put: the fewest that together cost no more than `left_ratio`. An interval in n parts costs an n-th of what it did, so that
/// of all ways to the same cost that with n ~ √cost has the fewest parts.
fn parts(costs: &[f64], left_ratio: f64) -> Vec<usize> {
    let roots: f64 = costs.iter().map(|cost| cost.sqrt()).sum();
    let part = |cost: &f64| {
        let wanted = cost.sqrt() * roots / left_ratio;
        let doubled = std::iter::successors(Some(1), |parts| Some(2 * parts)).take_while(|parts| *parts <= PARTS_MAX);
        doubled
            .take_while(|parts| *parts == 1 || *parts as f64 <= std::f64::consts::SQRT_2 * wanted)
            .last()
            .unwrap_or(1)
    };
    costs.iter().map(part).collect()
}

impl Profile {
    /// With b'' as it is, about.
    fn time_s(&self, chain: &Chain) -> f64 {
        (0..chain.intervals.len()).map(|index| self.interval_s(chain, index)).sum()
    }

    fn interval_s(&self, chain: &Chain, index: usize) -> f64 {
        let v = |index: usize| self.points[index].speed_squared_lu2_s2.max(0.0).sqrt();
        2.0 * chain.intervals[index].length_lu() / (v(index) + v(index + 1))
    }

    /// The states at the borders when intervals are put in parts.
    fn divided(&self, chain: &Chain, parts: &[usize]) -> Vec<PathPoint> {
        let places = parts.iter().enumerate().flat_map(|(index, parts)| {
            (0..*parts).map(move |part| self.inside(chain, index, part as f64 / *parts as f64).0)
        });
        places.chain(self.points.last().copied()).collect()
    }
}
