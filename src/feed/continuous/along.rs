//! The speed of a plan along its way.
//!
//! In: a chain with its profile, ways from a place on it that do not fall. Out: b = v² there. Does not know pieces.

use super::chain::{Chain, Profile};
use super::estimate::ray_exponent;
use super::interval::Interval;
use crate::base::Portable;

/// A walk along a plan.
pub(super) struct Along<'a> {
    chain: &'a Chain,
    profile: &'a Profile,
    index: usize,
    /// Way to the start of interval `index`.
    begin_lu: f64,
    /// Beyond it the speed stays as it is there.
    held_from_lu: f64,
}

impl<'a> Along<'a> {
    /// From a place `offset_lu` after the start of interval `first`.
    pub fn new(chain: &'a Chain, profile: &'a Profile, first: usize, offset_lu: f64) -> Self {
        Self { chain, profile, index: first, begin_lu: -offset_lu, held_from_lu: f64::INFINITY }
    }

    /// The same without what comes after the start of an interval: as fast as there, from the beginning if that lies before it.
    pub fn held_from(self, index: usize) -> Self {
        let lengths_lu = self.chain.intervals.get(self.index..index).unwrap_or(&[]).iter().map(Interval::length_lu);
        Self { held_from_lu: (self.begin_lu + lengths_lu.sum::<f64>()).max(0.0), ..self }
    }

    /// b at a way; `None` beyond the end, and at rest.
    pub fn at(&mut self, way_lu: f64) -> Option<f64> {
        let way_lu = way_lu.min(self.held_from_lu);
        loop {
            let end_lu = self.begin_lu + self.chain.intervals.get(self.index)?.length_lu();
            if way_lu <= end_lu || self.index + 1 == self.chain.intervals.len() {
                break;
            }
            (self.index, self.begin_lu) = (self.index + 1, end_lu);
        }
        let interval = &self.chain.intervals[self.index];
        let share = ((way_lu - self.begin_lu) / interval.length_lu()).clamp(0.0, 1.0);
        let points = self.profile.points.get(self.index..self.index + 2)?;
        let [from, to] = [points[0].speed_squared_lu2_s2, points[1].speed_squared_lu2_s2];
        let b = if from <= 0.0 {
            to * share.portable_powf(ray_exponent(interval))
        } else if to <= 0.0 {
            from * (1.0 - share).portable_powf(ray_exponent(interval))
        } else {
            self.profile.inside(self.chain, self.index, share).0.speed_squared_lu2_s2
        };
        (b > 0.0).then_some(b)
    }
}
