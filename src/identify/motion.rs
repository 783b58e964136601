//! Speed, acceleration and torque of an axis behind one filter that shifts nothing in time.
//!
//! In: [`AxisRecord`] with position and torque. Out: [`Motion`]: filtered series at the middle of each position cycle, and which rows may be
//! used. The momentum of a rigid axis over one cycle is exact in the mean torque:
//!
//! ```text
//! J (w[k] - w[k-1]) / T = τ̄[k] - B w̄[k] - Tc sgn w - Tg         τ̄ mean torque of cycle k, w̄ = (x[k] - x[k-1]) / (r T)
//! w[k] = (x[k-2] - 8 x[k-1] + 8 x[k+1] - x[k+2]) / (12 r T)
//! ```
//! All of it goes through the same symmetric window (Hann, ±10 ms), so that the equation stays true. Rows near a standstill are left
//! out: there dry friction is not Tc sgn w. Does not fit anything.

use super::record::AxisRecord;
use std::f64::consts::TAU;

/// Half width of the window: passes what moves an axis (-3 dB at 36 Hz) and averages a quantum of 1 µm at 1 ms down.
const HALF_WINDOW_S: f64 = 10e-3;
/// Cycles of the window at least, on one side.
const HALF_WINDOW_ROWS_MIN: usize = 4;
/// Rows slower than this share of the highest speed are left out.
const SLOW_SHARE: f64 = 0.02;

/// Filtered series; row k stands at the middle of the cycle that ends at tick k.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    pub(super) period_s: f64,
    /// w.
    pub(super) speed_rad_s: Vec<f64>,
    /// w'.
    pub(super) acceleration_rad_s2: Vec<f64>,
    /// x.
    pub(super) position_lu: Vec<f64>,
    /// τ̄.
    pub(super) torque_n_m: Vec<f64>,
    /// The axis moves, and has done so in one direction over the whole window.
    pub(super) moves: Vec<bool>,
    /// What the quantum of the scale makes of the acceleration, variance.
    pub(super) quantum_rad2_s4: f64,
    /// Highest speed, without the topmost rows.
    pub(super) speed_max_rad_s: f64,
}

/// Weights of a Hann window with `half` rows on each side, sum 1.
pub(super) fn window(half: usize) -> Vec<f64> {
    let length = (2 * half + 2) as f64;
    let weights: Vec<f64> = (1..=2 * half + 1).map(|k| 0.5 - 0.5 * (TAU * k as f64 / length).cos()).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

/// Convolution with a symmetric window; NaN where it reaches beyond the ends or over a gap.
pub(super) fn filtered(values: &[f64], window: &[f64]) -> Vec<f64> {
    let half = window.len() / 2;
    let mut filtered = vec![f64::NAN; values.len()];
    for (k, stretch) in values.windows(window.len()).enumerate() {
        filtered[k + half] = stretch.iter().zip(window).map(|(value, weight)| value * weight).sum();
    }
    filtered
}

/// Rows of the window on one side.
pub(super) fn half_window_rows(period_s: f64) -> usize {
    ((HALF_WINDOW_S / period_s).round() as usize).max(HALF_WINDOW_ROWS_MIN)
}

/// w at the ticks.
fn tick_speed_rad_s(position: &[f64], r: f64, period_s: f64) -> Vec<f64> {
    let mut speed = vec![f64::NAN; position.len()];
    for (k, x) in position.windows(5).enumerate() {
        speed[k + 2] = (x[0] - 8.0 * x[1] + 8.0 * x[3] - x[4]) / (12.0 * r * period_s);
    }
    speed
}

/// Differences of neighbours over the period; the first is NaN.
fn differences(values: &[f64], per: f64) -> Vec<f64> {
    let mut all = vec![f64::NAN; values.len().min(1)];
    all.extend(values.windows(2).map(|pair| (pair[1] - pair[0]) / per));
    all
}

/// Means of neighbours; the first is NaN.
fn midpoints(values: &[f64]) -> Vec<f64> {
    let mut all = vec![f64::NAN; values.len().min(1)];
    all.extend(values.windows(2).map(|pair| (pair[0] + pair[1]) / 2.0));
    all
}

impl Motion {
    /// `None` without position or torque.
    pub(super) fn of(record: &AxisRecord, r: f64) -> Option<Self> {
        let (position, torque) = (record.position_lu.as_ref()?, record.torque.as_ref()?);
        Some(Self::from_series(position, &torque.values_n_m, torque.source.is_folded(), record.period_s, r))
    }

    /// `folded`: the torque is a sample at the tick, not the mean of the cycle.
    pub(super) fn from_series(position: &[f64], torque: &[f64], folded: bool, period_s: f64, r: f64) -> Self {
        let half = half_window_rows(period_s);
        let window = window(half);
        let smooth = |values: &[f64]| filtered(values, &window);
        let speed = smooth(&differences(position, r * period_s));
        let acceleration = smooth(&differences(&tick_speed_rad_s(position, r, period_s), period_s));
        let torque = if folded { smooth(&midpoints(torque)) } else { smooth(torque) };
        let speed_max_rad_s = highest(&speed);
        let moves = moving(&speed, SLOW_SHARE * speed_max_rad_s, half);
        let usable = |k: usize| speed[k].is_finite() && acceleration[k].is_finite() && torque[k].is_finite();
        Self {
            period_s,
            position_lu: smooth(&midpoints(position)),
            moves: (0..speed.len()).map(|k| moves[k] && usable(k)).collect(),
            speed_rad_s: speed,
            acceleration_rad_s2: acceleration,
            torque_n_m: torque,
            quantum_rad2_s4: quantum(position)
                .map_or(0.0, |quantum| quantum_variance_rad2_s4(quantum, r, period_s, &window)),
            speed_max_rad_s,
        }
    }

    /// w''; NaN at the ends.
    pub(super) fn jerk_rad_s3(&self, k: usize) -> f64 {
        let a = |k: usize| self.acceleration_rad_s2.get(k).copied().unwrap_or(f64::NAN);
        (a(k + 1) - a(k.wrapping_sub(1))) / (2.0 * self.period_s)
    }

    /// w'''; NaN at the ends.
    pub(super) fn snap_rad_s4(&self, k: usize) -> f64 {
        let a = |k: usize| self.acceleration_rad_s2.get(k).copied().unwrap_or(f64::NAN);
        (a(k + 1) - 2.0 * a(k) + a(k.wrapping_sub(1))) / self.period_s.powi(2)
    }
}

/// The speed that one row in a thousand exceeds.
fn highest(speed: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = speed.iter().map(|w| w.abs()).filter(|w| w.is_finite()).collect();
    sizes.sort_by(f64::total_cmp);
    let place = (sizes.len() * 999 / 1000).min(sizes.len().saturating_sub(1));
    sizes.get(place).copied().unwrap_or(0.0)
}

/// Rows around which the axis is faster than `slow` in one direction, `half` rows to each side.
fn moving(speed: &[f64], slow: f64, half: usize) -> Vec<bool> {
    let mut last_still = None::<usize>;
    let mut before = vec![0_usize; speed.len()];
    let breaks: Vec<bool> = (0..speed.len())
        .map(|k| speed[k].is_nan() || speed[k].abs() <= slow || (k > 0 && speed[k - 1] * speed[k] < 0.0))
        .collect();
    for (k, still) in breaks.iter().enumerate() {
        if *still {
            last_still = Some(k);
        }
        before[k] = last_still.map_or(k, |last| k - last);
    }
    let mut next_still = None::<usize>;
    let mut moves = vec![false; speed.len()];
    for k in (0..speed.len()).rev() {
        if breaks[k] {
            next_still = Some(k);
        }
        let after = next_still.map_or(speed.len() - 1 - k, |next| next - k);
        moves[k] = before[k] > half && after > half;
    }
    moves
}

/// The step of a scale, if the positions stand on one.
pub(super) fn quantum(position: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = position.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|s| *s > 1e-9).collect();
    steps.sort_by(f64::total_cmp);
    let least = *steps.get(steps.len() / 100)?;
    let near =
        |step: &&f64| ((**step / least) - (**step / least).round()).abs() < 0.01 * (**step / least).max(1.0).sqrt();
    let whole = steps.iter().filter(|step| **step < 50.0 * least).filter(near).count();
    let looked_at = steps.iter().filter(|step| **step < 50.0 * least).count();
    (looked_at > 20 && whole as f64 > 0.98 * looked_at as f64 && least > 1e-7).then_some(least)
}

/// Variance of the filtered acceleration that a quantum of the scale makes: of white noise of q²/12 behind the same differences and window.
fn quantum_variance_rad2_s4(quantum: f64, r: f64, period_s: f64, window: &[f64]) -> f64 {
    let mut impulse = vec![0.0; 2 * window.len() + 16];
    let middle = impulse.len() / 2;
    impulse[middle] = 1.0;
    let behind = filtered(&differences(&tick_speed_rad_s(&impulse, r, period_s), period_s), window);
    let square: f64 = behind.iter().filter(|value| value.is_finite()).map(|value| value * value).sum();
    square * quantum * quantum / 12.0
}
