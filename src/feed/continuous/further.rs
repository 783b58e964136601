//! An estimate for a plan that stops further on than the one before.
//!
//! In: a longer chain, and what is left of the plan before. Out: b at its borders, about. Keeps no limits: the problem does.

use super::Continuous;
use super::chain::{Chain, PathPoint};
use super::interval::Interval;

impl Continuous {
    /// About the way to stop at the end of a longer chain: as planned before at first, and more and more as planned before that much earlier. Where the way
    /// before has hardly any room left its tangents tell too little of how hard the path can brake near the old end, and those of a rough estimate
    /// too.
    pub(super) fn stop_further_on(&self, chain: &Chain) -> Vec<PathPoint> {
        let way_lu = |intervals: &[Interval]| intervals.iter().map(Interval::length_lu).sum::<f64>();
        let old_lu = way_lu(&self.chain.intervals[self.first..]) - self.offset_lu();
        let longer_lu = way_lu(&chain.intervals) - old_lu;
        let mut at_lu = 0.0;
        let borders = chain.intervals.iter().map(|interval| {
            let here_lu = at_lu;
            at_lu += interval.length_lu();
            here_lu
        });
        let estimate = |here_lu: f64| {
            let [here, before] = [here_lu, here_lu - longer_lu].map(|way_lu| self.planned_lu2_s2(way_lu));
            let share = (here_lu / old_lu).min(1.0);
            PathPoint { speed_squared_lu2_s2: here + share * (before - here).max(0.0), slope_lu_s2: 0.0 }
        };
        borders.map(estimate).collect()
    }

    /// b some way from here as planned before; beyond its end 0.
    fn planned_lu2_s2(&self, way_lu: f64) -> f64 {
        let mut left_lu = way_lu.max(0.0) + self.offset_lu();
        let last = self.chain.intervals.len().saturating_sub(1);
        for index in self.first..=last {
            let length_lu = self.chain.intervals.get(index).map_or(0.0, Interval::length_lu);
            if left_lu <= length_lu {
                let share = left_lu / length_lu;
                // At the stop b goes with a power of the way that is left; a straight line is near enough.
                return match index == last {
                    true => (1.0 - share) * self.profile.points[index].speed_squared_lu2_s2,
                    false => self.profile.inside(&self.chain, index, share).0.speed_squared_lu2_s2,
                };
            }
            left_lu -= length_lu;
        }
        0.0
    }
}
