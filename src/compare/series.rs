//! A signal between its samples.
//!
//! In: a signal of a trace, or any times and values; NaN where there is none. Out: value and slope at any time by a cubic through the neighbours, or
//! the last sample for what is held. A gap stays a gap: beside a NaN there is no value. Does not resample a whole signal.

use crate::trace::{Signal, TimeGrid};

/// One signal on its time base. A value that is NaN is a gap.
#[derive(Clone, Copy, Debug)]
pub struct Series<'a> {
    /// Times of the samples, `[n]`.
    pub times: &'a TimeGrid,
    /// Values of the samples, `[n]`, in the unit that the caller knows.
    pub values: &'a [f64],
    /// Taken off every time: what the signal is late by its nature.
    pub delay_s: f64,
    /// True: a sample holds until the next one (states). False: a cubic runs through the samples.
    pub held: bool,
}

impl<'a> Series<'a> {
    /// A signal that runs smoothly through its samples. The shorter of the two lists counts.
    pub fn smooth(times: &'a TimeGrid, values: &'a [f64]) -> Self {
        Self { times, values, delay_s: 0.0, held: false }
    }

    /// A signal of a trace, on the time of the signal of ours that it stands for.
    pub fn of(signal: &'a Signal) -> Self {
        Self {
            times: &signal.times,
            values: &signal.values,
            delay_s: signal.meaning.delay_s,
            held: signal.discrete || !signal.labels.is_empty(),
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.times.len().min(self.values.len())
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Time of a sample.
    pub fn time_s(&self, index: usize) -> f64 {
        self.times.time_s(index) - self.delay_s
    }

    /// First and last time; `None` without samples.
    pub fn span_s(&self) -> Option<(f64, f64)> {
        let last = self.len().checked_sub(1)?;
        Some((self.time_s(0), self.time_s(last)))
    }

    /// Distance of the samples, the middle one of an irregular grid; `None` below two samples.
    pub fn step_s(&self) -> Option<f64> {
        self.times.period_s()
    }

    /// A reader whose times go up mostly: each look-up begins where the last one ended.
    pub fn cursor(&self) -> Cursor<'a> {
        Cursor { series: *self, at: 0 }
    }
}

/// Reads a [`Series`] at times that mostly increase, O(1) each.
#[derive(Clone, Copy, Debug)]
pub struct Cursor<'a> {
    series: Series<'a>,
    at: usize,
}

/// Steps that a cursor walks before it searches.
const WALK_STEPS: usize = 16;
/// A time within this of the ends of a signal is on it: times are rounded in every file.
const SAME_INSTANT_S: f64 = 1e-9;

impl Cursor<'_> {
    /// Value and slope (per second) at a time; NaN outside of the samples and in gaps.
    pub fn value_and_slope(&mut self, time_s: f64) -> (f64, f64) {
        let Some(i) = self.interval(time_s) else { return (f64::NAN, f64::NAN) };
        let values = self.series.values;
        if self.series.held {
            return (values[i], 0.0);
        }
        if i + 1 >= self.series.len() {
            return (values[i], self.node_slope(i));
        }
        // Cubic Hermite with slopes of the parabolas through three neighbours.
        let x0 = self.series.time_s(i);
        let h = self.series.time_s(i + 1) - x0;
        let (y0, y1) = (values[i], values[i + 1]);
        let (m0, m1) = (self.node_slope(i), self.node_slope(i + 1));
        if h <= 0.0 {
            return (y1, m1);
        }
        let u = ((time_s - x0) / h).clamp(0.0, 1.0);
        let d = (y1 - y0) / h;
        let (a, b) = (m0 + m1 - 2.0 * d, 3.0 * d - 2.0 * m0 - m1);
        (y0 + h * u * (m0 + u * (b + u * a)), m0 + u * (2.0 * b + 3.0 * u * a))
    }

    /// Value at a time; NaN outside of the samples and in gaps.
    pub fn value(&mut self, time_s: f64) -> f64 {
        self.value_and_slope(time_s).0
    }

    /// The sample at or before a time; `None` outside.
    pub fn interval(&mut self, time_s: f64) -> Option<usize> {
        let last = self.series.len().checked_sub(1)?;
        let inside =
            time_s >= self.series.time_s(0) - SAME_INSTANT_S && time_s <= self.series.time_s(last) + SAME_INSTANT_S;
        if !inside {
            // NaN too.
            return None;
        }
        let mut at = self.at.min(last);
        if self.series.time_s(at) <= time_s {
            for _ in 0..WALK_STEPS {
                if at >= last || self.series.time_s(at + 1) > time_s {
                    self.at = at;
                    return Some(at);
                }
                at += 1;
            }
        }
        self.at = self.series.times.index_at(time_s + self.series.delay_s).unwrap_or(0).min(last);
        Some(self.at)
    }

    /// Slope at a sample, from it and its neighbours; a neighbour that is missing or NaN is left out.
    fn node_slope(&self, i: usize) -> f64 {
        let values = self.series.values;
        let chord = |a: usize, b: usize| {
            let h = self.series.times.time_s(b) - self.series.times.time_s(a);
            (h, (values[b] - values[a]) / h)
        };
        let before = i.checked_sub(1).map(|j| chord(j, i)).filter(|(h, d)| *h > 0.0 && d.is_finite());
        let after = Some(i + 1).filter(|j| *j < self.series.len()).map(|j| chord(i, j));
        let after = after.filter(|(h, d)| *h > 0.0 && d.is_finite());
        match (before, after) {
            (Some((h0, d0)), Some((h1, d1))) => (h1 * d0 + h0 * d1) / (h0 + h1),
            (Some((_, d)), None) | (None, Some((_, d))) => d,
            (None, None) => 0.0,
        }
    }
}

/// Standard deviation of the noise of a smooth signal, from the middle of the third differences: a motion with bounded jerk has hardly any
/// over a few samples. 0 for fewer than four samples. Looks at up to 20,000 places, evenly spread.
pub fn noise_of(values: &[f64]) -> f64 {
    /// Root of the sum of squares of 1, -3, 3, -1.
    const THIRD_DIFFERENCE_GAIN: f64 = 4.472_135_954_999_58;
    /// Middle of the magnitude of a normal variable of standard deviation 1.
    const NORMAL_MEDIAN: f64 = 0.674_489_750_196_082;
    let places = values.len().saturating_sub(3);
    if places == 0 {
        return 0.0;
    }
    let stride = places.div_ceil(20_000);
    let difference = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
    let mut differences: Vec<f64> =
        (0..places).step_by(stride).map(|i| difference(&values[i..i + 4])).filter(|d| d.is_finite()).collect();
    if differences.is_empty() {
        return 0.0;
    }
    let middle = differences.len() / 2;
    let median = *differences.select_nth_unstable_by(middle, f64::total_cmp).1;
    median / (THIRD_DIFFERENCE_GAIN * NORMAL_MEDIAN)
}
