//! Jerk filter of the set-point: MD32400 to MD32414, in front of position controller and feed-forward.
//!
//! The FIR low-pass (MD32402 = 5), whose weights the manuals do not print, is a sinc up to its cut-off frequency (MD32412) under a Hamming window over
//! its time (MD32410), sum 1: symmetric, so that it delays every motion by half its length less half a cycle, whatever the frequency.
//!
//! In: x_set, once a position cycle. Out: the filtered set-point, which the controller follows. The filter delays: by half its
//! time (a moving average), by its time (second order). The following error is counted from the set-point in front of it.

use super::filter::Section;
use crate::machine::{Filter, FilterShape, JerkFilter as Data, JerkFilterKind};
use nalgebra::Complex;
use std::f64::consts::TAU;

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

    /// Samples from the newest to the oldest, with their places.
    fn weighted(&mut self, sample: f64, weights: &[f64]) -> f64 {
        self.samples[self.oldest] = sample;
        let newest = self.oldest;
        let count = self.samples.len();
        self.oldest = if self.oldest + 1 == count { 0 } else { self.oldest + 1 };
        // Differences to the newest, as above.
        let off: f64 = weights
            .iter()
            .enumerate()
            .map(|(age, weight)| weight * (self.samples[(newest + count - age) % count] - sample))
            .sum();
        sample + off
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
    /// MD32402 = 5: the last samples and their weights, the newest first.
    Fir(MovingAverage, Box<[f64]>),
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
            JerkFilterKind::FirLowPass => {
                let samples = average(data.time_s);
                let weights = low_pass_weights(samples.samples.len(), data.frequency_hz * period_s);
                Self::Fir(samples, weights)
            }
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
            Self::Fir(samples, weights) => samples.weighted(setpoint_lu, weights),
        }
    }

    /// Response to a sine with one cycle of delay being `q` = 1/z.
    pub(super) fn response(&self, q: Complex<f64>) -> Complex<f64> {
        match self {
            Self::Off => Complex::new(1.0, 0.0),
            Self::Section(section) => section.response(q),
            Self::Average(average) => average.response(q),
            Self::Double(first, second) => first.response(q) * second.response(q),
            Self::Fir(_, weights) => weights.iter().rev().fold(Complex::new(0.0, 0.0), |sum, weight| sum * q + weight),
        }
    }
}

/// Sinc under a Hamming window; `cutoff_ratio` is the frequency over the sampling frequency.
fn low_pass_weights(count: usize, cutoff_ratio: f64) -> Box<[f64]> {
    let middle = (count as f64 - 1.0) / 2.0;
    let weight = |i: usize| {
        let from_middle = i as f64 - middle;
        let x = TAU * cutoff_ratio * from_middle;
        let sinc = if x == 0.0 { 1.0 } else { libm::sin(x) / x };
        let window = if count > 1 { 0.54 - 0.46 * libm::cos(TAU * i as f64 / (count as f64 - 1.0)) } else { 1.0 };
        sinc * window
    };
    let sum: f64 = (0..count).map(weight).sum();
    (0..count).map(|i| weight(i) / sum).collect()
}
