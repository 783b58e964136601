//! A signal at other instants.
//!
//! In: a [`Signal`], instants in increasing order, a [`Method`]. Out: one value an instant; NaN outside the signal and in its gaps,
//! because a gap stays a gap. Does not filter: a signal that is taken at fewer instants than it has is not smoothed first, so that
//! what is faster than the new grid is folded down.

use super::wire::{Signal, TimeGrid};

/// How to find a value between two samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Method {
    /// Straight line between the two neighbours.
    Linear,
    /// The last sample at or before the instant, the last one of all until its end.
    Hold,
    /// Cubic through the four nearest samples (Lagrange on their own times, so the samples may be irregular); linear beside a gap
    /// and in the first and last interval. Can overshoot at a step.
    Cubic,
}

impl Method {
    /// For people and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Hold => "hold",
            Self::Cubic => "cubic",
        }
    }
}

impl Signal {
    /// What does the signal no harm: hold for whole numbers and words, linear otherwise.
    pub fn natural_method(&self) -> Method {
        if self.discrete || !self.labels.is_empty() { Method::Hold } else { Method::Linear }
    }

    /// Values at `times_s`, which must increase.
    pub fn resampled(&self, times_s: &[f64], method: Method) -> Vec<f64> {
        let mut walk = Walk::new(self);
        times_s.iter().map(|time_s| walk.at(*time_s, method)).collect()
    }

    /// Values on a grid.
    pub fn resampled_on(&self, grid: &TimeGrid, method: Method) -> Vec<f64> {
        let mut walk = Walk::new(self);
        grid.iter().map(|time_s| walk.at(time_s, method)).collect()
    }

    /// The value at one instant.
    pub fn value_at(&self, time_s: f64, method: Method) -> f64 {
        Walk::new(self).at(time_s, method)
    }
}

/// Steps of a walk before it looks for the place by halving.
const STEPS_MAX: usize = 8;
/// An instant within this share of a sampling interval of a sample is that sample: times are rounded in every file.
const SAME_INSTANT_SHARE: f64 = 1e-6;

/// Walks along a signal: instants in order find their place in a few steps.
struct Walk<'a> {
    signal: &'a Signal,
    place: usize,
}

impl<'a> Walk<'a> {
    fn new(signal: &'a Signal) -> Self {
        Self { signal, place: 0 }
    }

    fn at(&mut self, time_s: f64, method: Method) -> f64 {
        let Some(place) = self.find(time_s) else { return f64::NAN };
        let (times, values) = (&self.signal.times, &self.signal.values);
        let Some(&before) = values.get(place) else { return f64::NAN };
        let (t0, t1) = (times.time_s(place), times.time_s(place + 1));
        let into_share = (time_s - t0) / (t1 - t0);
        if into_share.is_nan() {
            // The last sample: nothing is known after its instant.
            return if is_near(time_s, t0) { before } else { f64::NAN };
        }
        if method == Method::Hold || into_share < SAME_INSTANT_SHARE {
            // A sample that is a hair ahead is the one that is meant.
            return if into_share > 1.0 - SAME_INSTANT_SHARE { value(values, place + 1) } else { before };
        }
        if into_share > 1.0 - SAME_INSTANT_SHARE {
            return value(values, place + 1);
        }
        let after = value(values, place + 1);
        let linear = before + into_share * (after - before);
        match method {
            Method::Cubic => self.cubic(time_s, place).unwrap_or(linear),
            Method::Linear | Method::Hold => linear,
        }
    }

    /// The last sample at or before the instant; `None` before the first.
    fn find(&mut self, time_s: f64) -> Option<usize> {
        let times = &self.signal.times;
        if matches!(times, TimeGrid::Explicit(_)) && times.time_s(self.place) <= time_s {
            for _ in 0..STEPS_MAX {
                // NaN, beyond the end, compares false and ends the walk.
                if times.time_s(self.place + 1) <= time_s {
                    self.place += 1;
                } else {
                    return Some(self.place);
                }
            }
        }
        match times.index_at(time_s) {
            Some(place) => self.place = place,
            None if is_near(time_s, times.time_s(0)) => self.place = 0,
            None => return None,
        }
        Some(self.place)
    }

    /// Lagrange through the samples at `place - 1 ... place + 2`; `None` where one of them is missing.
    fn cubic(&self, time_s: f64, place: usize) -> Option<f64> {
        let first = place.checked_sub(1)?;
        let values = self.signal.values.get(first..first + 4)?;
        let t: [f64; 4] = std::array::from_fn(|k| self.signal.times.time_s(first + k));
        let mut sum = 0.0;
        for (k, value) in values.iter().enumerate() {
            let others = (0..4).filter(|other| *other != k);
            sum += value * others.map(|other| (time_s - t[other]) / (t[k] - t[other])).product::<f64>();
        }
        sum.is_finite().then_some(sum)
    }
}

fn value(values: &[f64], place: usize) -> f64 {
    values.get(place).copied().unwrap_or(f64::NAN)
}

/// Two times that differ only by rounding.
fn is_near(time_s: f64, other_s: f64) -> bool {
    (time_s - other_s).abs() <= 1e-9 + 4.0 * f64::EPSILON * other_s.abs()
}
