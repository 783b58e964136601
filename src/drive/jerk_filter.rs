//! Jerk filter of the set-point: MD32400 to MD32414, in front of position controller and feed-forward.
//!
//! In: x_set, once a position cycle. Out: the filtered set-point, which the controller follows. The filter delays: by half its
//! time (a moving average), by its time (second order). The following error is counted from the set-point in front of it.

use super::filter::Section;
use crate::machine::{Filter, FilterShape, JerkFilter as Data, JerkFilterKind};
use nalgebra::Complex;

/// Mean of the last samples.
#[derive(Clone, Debug)]
pub(super) struct MovingAverage {
    /// Ring, in the unit of the signal.
    samples: Box<[f64]>,
    oldest: usize,
}

impl MovingAverage {
    /// Over `time_s`, rounded to whole cycles and at least one.
    fn new(time_s: f64, period_s: f64, resting: f64) -> Self {
        // The catalogue bounds the time to a second; the second bound is for a caller without one.
        let count = (time_s / period_s).round().clamp(1.0, 1_048_576.0) as usize;
        Self { samples: vec![resting; count].into_boxed_slice(), oldest: 0 }
    }

    fn step(&mut self, sample: f64) -> f64 {
        self.samples[self.oldest] = sample;
        self.oldest = if self.oldest + 1 == self.samples.len() { 0 } else { self.oldest + 1 };
        // Differences to the newest: a set-point at rest keeps its bits, and no running sum drifts.
        let below: f64 = self.samples.iter().map(|before| before - sample).sum();
        sample + below / self.samples.len() as f64
    }

    /// Mean of 1, q, q², ...
    fn response(&self, q: Complex<f64>) -> Complex<f64> {
        let sum = (0..self.samples.len()).fold(Complex::new(0.0, 0.0), |sum, _| sum * q + 1.0);
        sum / self.samples.len() as f64
    }
}

/// The box between interpolator and axis.
#[derive(Clone, Debug)]
pub(super) enum JerkFilter {
    /// MD32400 = 0.
    Off,
    /// MD32402 = 1 or 3.
    Section(Section),
    /// MD32402 = 2.
    Average(MovingAverage),
    /// MD32402 = 4.
    Double(MovingAverage, MovingAverage),
}

impl JerkFilter {
    pub(super) fn new(data: &Data, period_s: f64, position_lu: f64) -> Self {
        let section = |filter: Filter| Section::new(&filter, period_s, position_lu).map_or(Self::Off, Self::Section);
        let average = |time_s| MovingAverage::new(time_s, period_s, position_lu);
        match data.kind {
            JerkFilterKind::Off => Self::Off,
            JerkFilterKind::SecondOrder => section(data.low_pass()),
            JerkFilterKind::BandStop => section(Filter { shape: FilterShape::SecondOrder, ..data.band_stop() }),
            JerkFilterKind::MovingAverage => Self::Average(average(data.time_s)),
            JerkFilterKind::DoubleMovingAverage => Self::Double(average(data.time_s), average(data.time_add_s)),
        }
    }

    /// One position cycle.
    #[inline]
    pub(super) fn step(&mut self, setpoint_lu: f64) -> f64 {
        match self {
            Self::Off => setpoint_lu,
            Self::Section(section) => section.step(setpoint_lu),
            Self::Average(average) => average.step(setpoint_lu),
            Self::Double(first, second) => second.step(first.step(setpoint_lu)),
        }
    }

    /// Response to a sine with one cycle of delay being `q` = 1/z.
    pub(super) fn response(&self, q: Complex<f64>) -> Complex<f64> {
        match self {
            Self::Off => Complex::new(1.0, 0.0),
            Self::Section(section) => section.response(q),
            Self::Average(average) => average.response(q),
            Self::Double(first, second) => first.response(q) * second.response(q),
        }
    }
}
