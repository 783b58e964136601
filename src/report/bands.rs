//! A signal in as many bytes as the page has for it.
//!
//! In: a signal, the stretch of time of the page, a budget. Out: JSON: every sample where they fit, otherwise smallest and largest value of
//! equal stretches of time (the deepest level of the min/max pyramid; the page forms the coarser ones), so that no peak is hidden. Does not
//! smooth and does not interpolate.

use super::encode::{Rounding, Steps};
use crate::compare::Series;
use crate::trace::TimeGrid;
use serde_json::{Value, json};

/// Smallest and largest value of equal stretches of time; NaN where there is no sample.
#[derive(Clone, Debug)]
pub struct Band {
    /// Beginning of the first stretch.
    pub start_s: f64,
    /// Length of each.
    pub width_s: f64,
    /// Smallest values.
    pub low_values: Vec<f64>,
    /// Largest values.
    pub high_values: Vec<f64>,
}

impl Band {
    /// No sample yet. At least one stretch.
    pub fn new(start_s: f64, end_s: f64, count: usize) -> Self {
        let count = count.max(1);
        let width_s = ((end_s - start_s) / count as f64).max(f64::MIN_POSITIVE);
        Self { start_s, width_s, low_values: vec![f64::NAN; count], high_values: vec![f64::NAN; count] }
    }

    /// Takes a sample; samples outside and values that are not finite are left out.
    pub fn push(&mut self, time_s: f64, value: f64) {
        let place = (time_s - self.start_s) / self.width_s;
        if !(value.is_finite() && place >= 0.0) {
            return;
        }
        // The end belongs to the last stretch.
        let i = (place as usize).min(self.low_values.len() - 1);
        if place > self.low_values.len() as f64 + 1e-6 {
            return;
        }
        // `min` of NaN and a number is the number.
        self.low_values[i] = self.low_values[i].min(value);
        self.high_values[i] = self.high_values[i].max(value);
    }

    fn json(&self) -> Value {
        let steps = Steps::covering(self.low_values.iter().chain(&self.high_values), 2);
        json!({
            "kind": "band", "start": self.start_s, "width": self.width_s, "count": self.low_values.len(), "step": steps.step(),
            "lo": steps.pack(&self.low_values, Rounding::Down), "hi": steps.pack(&self.high_values, Rounding::Up),
        })
    }
}

/// A series within a budget of bytes. `place`: time of a sample on the time of the page.
pub fn packed(series: &Series<'_>, place: &dyn Fn(f64) -> f64, span_s: (f64, f64), budget_bytes: usize) -> Value {
    let n = series.len();
    if is_constant(series) {
        return constant(series, place);
    }
    let uniform = matches!(series.times, TimeGrid::Uniform { .. });
    let value_bytes = [4, 3, 2].into_iter().find(|bytes| n * (bytes + if uniform { 0 } else { 3 }) <= budget_bytes);
    if let Some(bytes) = value_bytes {
        return every_sample(series, place, bytes, uniform);
    }
    let mut band = Band::new(span_s.0, span_s.1, budget_bytes / 4);
    for i in 0..n {
        band.push(place(series.time_s(i)), series.values[i]);
    }
    let mut document = band.json();
    document["samples"] = json!(n);
    document
}

/// Whether a series has one value all the time, without gaps: its two ends say everything.
pub fn is_constant(series: &Series<'_>) -> bool {
    let values = &series.values[..series.len()];
    values.len() > 2 && values.first().is_some_and(|first| first.is_finite() && values.iter().all(|v| v == first))
}

fn constant(series: &Series<'_>, place: &dyn Fn(f64) -> f64) -> Value {
    let n = series.len();
    let ends = [series.values[0], series.values[n - 1]];
    let (start_s, end_s) = (place(series.time_s(0)), place(series.time_s(n - 1)));
    let steps = Steps::covering(ends.iter(), 2);
    json!({
        "kind": "samples", "count": 2, "samples": n, "step": 0.0, "start": start_s, "width": end_s - start_s,
        "values": steps.pack(&ends, Rounding::Nearest),
    })
}

fn every_sample(series: &Series<'_>, place: &dyn Fn(f64) -> f64, bytes: usize, uniform: bool) -> Value {
    let n = series.len();
    let values = &series.values[..n];
    let steps = Steps::covering(values.iter(), bytes);
    let mut document = json!({
        "kind": "samples", "count": n, "samples": n, "step": steps.step(), "values": steps.pack(values, Rounding::Nearest),
    });
    if uniform {
        let start_s = if n > 0 { place(series.time_s(0)) } else { 0.0 };
        let end_s = if n > 0 { place(series.time_s(n - 1)) } else { 0.0 };
        document["start"] = json!(start_s);
        document["width"] = json!(if n > 1 { (end_s - start_s) / (n - 1) as f64 } else { 1.0 });
    } else {
        let times_s: Vec<f64> = (0..n).map(|i| place(series.time_s(i))).collect();
        document["times"] = Steps::covering(times_s.iter(), 3).pack(&times_s, Rounding::Nearest);
    }
    document
}
