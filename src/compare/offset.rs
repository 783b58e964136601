//! The time offset between two traces of the same motion.
//!
//! In: what moves in both, channel by channel, on any time bases. Out: [`Alignment`]: reference time = trace time + offset (+ drift), the
//! overlap and how sure it is. Two steps:
//!
//! 1. coarse, over all shifts: mean velocities on a common grid (differences of positions at its edges), correlated by FFT and divided by
//!    the energy of the overlap, so that a standstill counts for nothing and a trace that starts later finds its place;
//! 2. fine: least squares of `trace(t) - reference(t + offset + drift t) - zero` by Gauss-Newton, with weights that drop to 0 for
//!    what does not belong together (a dwell that is longer in one of them), which gives a fraction of a sample.
//!
//! Does not choose the channels and does not stretch one trace to the other.

use super::series::Series;
use rustfft::algorithm::Radix4;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};

/// The same quantity in both traces.
#[derive(Clone, Copy, Debug)]
pub struct Channel<'a> {
    /// In the trace.
    pub trace: Series<'a>,
    /// In the reference.
    pub reference: Series<'a>,
    /// What makes channels of different units comparable: differences are divided by it. Above 0.
    pub scale: f64,
}

/// How the time of the reference follows from that of the trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Reference time - trace time at trace time 0 (at its middle with a drift: `pivot_s`). Above 0 where the reference is late.
    pub offset_s: f64,
    /// How much faster the clock of the reference runs; 0 unless asked for.
    pub drift_ratio: f64,
    /// Trace time at which the offset holds exactly.
    pub pivot_s: f64,
    /// Standard error of the offset, were what is left noise.
    pub uncertainty_s: f64,
    /// Correlation of the velocities on the common grid at this offset, 1 = alike.
    pub correlation_ratio: f64,
}

impl Alignment {
    /// No shift at all.
    pub fn none() -> Self {
        Self::given(0.0)
    }

    /// A shift that is known.
    pub fn given(offset_s: f64) -> Self {
        Self { offset_s, drift_ratio: 0.0, pivot_s: 0.0, uncertainty_s: 0.0, correlation_ratio: f64::NAN }
    }

    /// Reference time that belongs to a trace time.
    pub fn reference_s(&self, trace_s: f64) -> f64 {
        trace_s + self.offset_s + self.drift_ratio * (trace_s - self.pivot_s)
    }

    /// Trace time that belongs to a reference time.
    pub fn trace_s(&self, reference_s: f64) -> f64 {
        let from_pivot = reference_s - self.offset_s - self.pivot_s;
        self.pivot_s + from_pivot / (1.0 + self.drift_ratio)
    }
}

/// Bins of the common grid at most, over the longer of the two.
const BINS_MAX: f64 = 524_288.0;
/// Of the energy of the shorter motion, at least this much must lie in the overlap.
const OVERLAP_ENERGY_MIN_SHARE: f64 = 0.25;
/// Peaks as good as the best within this much: the one with more overlap wins, so that a cycle that repeats is not shifted by one.
const TIE_SHARE: f64 = 0.002;
/// Samples that the fine step looks at, at most, a channel.
const FINE_SAMPLES_MAX: usize = 100_000;
const FINE_ROUNDS_MAX: usize = 40;
/// How far the fine step may go from the coarse one, besides some bins.
const REACH_S: f64 = 0.02;
/// Steps of the offset below this end the fine step: far below any clock.
const FINE_STEP_S: f64 = 1e-10;
/// Tukey's constant: 95 % efficient for noise that is normal.
const TUKEY: f64 = 4.685;
/// Standard deviation of a normal variable over the middle of its magnitude.
const SIGMA_PER_MEDIAN: f64 = 1.4826;

/// Finds the alignment; `None` where nothing moves in both, or nothing fits.
pub fn align(channels: &[Channel<'_>], drift: bool) -> Option<Alignment> {
    let coarse = coarse(channels)?;
    Some(refine(channels, coarse, drift))
}

/// A coarse result with the width of its grid.
struct Coarse {
    offset_s: f64,
    correlation_ratio: f64,
    bin_s: f64,
}

/// Mean velocities of all channels on one grid.
struct Binned {
    start_s: f64,
    channels: Vec<Vec<f64>>,
    /// `energy[i]` = sum of squares of all channels in the bins before i.
    energy: Vec<f64>,
}

impl Binned {
    fn new<'a>(series: impl Iterator<Item = (Series<'a>, f64)> + Clone, bin_s: f64) -> Option<Self> {
        let spans = series.clone().filter_map(|(s, _)| s.span_s());
        let (start_s, end_s) = spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        let bins = (((end_s - start_s) / bin_s).floor() as usize).max(1);
        let velocities = |(s, scale): (Series<'a>, f64)| {
            let mut cursor = s.cursor();
            let mut last = cursor.value(start_s);
            let bin = |i: usize| {
                let next = cursor.value(start_s + (i + 1) as f64 * bin_s);
                let step = (next - last) / (bin_s * scale);
                last = next;
                if step.is_finite() { step } else { 0.0 }
            };
            (0..bins).map(bin).collect::<Vec<f64>>()
        };
        let channels: Vec<Vec<f64>> = series.map(velocities).collect();
        let mut energy = Vec::with_capacity(bins + 1);
        let mut sum = 0.0;
        energy.push(sum);
        for i in 0..bins {
            sum += channels.iter().map(|channel| channel[i] * channel[i]).sum::<f64>();
            energy.push(sum);
        }
        Some(Self { start_s, channels, energy })
    }

    fn bins(&self) -> usize {
        self.energy.len() - 1
    }

    fn total(&self) -> f64 {
        self.energy[self.bins()]
    }
}

fn coarse(channels: &[Channel<'_>]) -> Option<Coarse> {
    let length = |s: &Series<'_>| s.span_s().map_or(0.0, |(from, to)| to - from);
    let both = || channels.iter().flat_map(|c| [c.trace, c.reference]);
    let longest_s = both().map(|s| length(&s)).fold(0.0, f64::max);
    let step_s = both().filter_map(|s| s.step_s()).fold(0.0, f64::max);
    let bin_s = step_s.max(longest_s / BINS_MAX);
    if !(bin_s.is_finite() && bin_s > 0.0) {
        return None;
    }
    let a = Binned::new(channels.iter().map(|c| (c.trace, c.scale)), bin_s)?;
    let b = Binned::new(channels.iter().map(|c| (c.reference, c.scale)), bin_s)?;
    if !(a.total() > 0.0 && b.total() > 0.0) {
        return None;
    }
    let product = correlate(&a, &b);
    let (shift, correlation_ratio) = best_shift(&a, &b, &product)?;
    Some(Coarse { offset_s: b.start_s - a.start_s + shift as f64 * bin_s, correlation_ratio, bin_s })
}

/// `c[k]` = sum over i of a[i] b[i + k], for k from 0; negative k stand at the end, modulo the length.
fn correlate(a: &Binned, b: &Binned) -> Vec<f64> {
    let length = (a.bins() + b.bins()).next_power_of_two();
    // Not the planner: it would choose by the processor's instructions, and the last bits of a result with them.
    let (forward, backward) = (Radix4::new(length, FftDirection::Forward), Radix4::new(length, FftDirection::Inverse));
    let mut sum = vec![Complex::new(0.0, 0.0); length];
    for (one, other) in a.channels.iter().zip(&b.channels) {
        // Two real signals in one transform: z = x + i y, from which X = (Z[k] + Z*[-k]) / 2 and i Y = (Z[k] - Z*[-k]) / 2.
        let mut both = vec![Complex::new(0.0, 0.0); length];
        both.iter_mut().zip(one).for_each(|(z, x)| z.re = *x);
        both.iter_mut().zip(other).for_each(|(z, y)| z.im = *y);
        forward.process(&mut both);
        for (k, s) in sum.iter_mut().enumerate() {
            let (z, mirrored) = (both[k], both[(length - k) % length].conj());
            let (x, iy) = ((z + mirrored) * 0.5, (z - mirrored) * 0.5);
            *s += x.conj() * Complex::new(iy.im, -iy.re);
        }
    }
    backward.process(&mut sum);
    sum.iter().map(|value| value.re / length as f64).collect()
}

/// The shift with the best correlation in its overlap.
fn best_shift(a: &Binned, b: &Binned, product: &[f64]) -> Option<(i64, f64)> {
    let (na, nb) = (a.bins() as i64, b.bins() as i64);
    let least = OVERLAP_ENERGY_MIN_SHARE * a.total().min(b.total());
    let score = |k: i64| -> Option<(f64, f64)> {
        let (from, to) = (0.max(-k), na.min(nb - k));
        if from >= to {
            return None;
        }
        let of_a = a.energy[to as usize] - a.energy[from as usize];
        let of_b = b.energy[(to + k) as usize] - b.energy[(from + k) as usize];
        let shared = (of_a * of_b).sqrt();
        if of_a.min(of_b) < least || shared <= 0.0 {
            return None;
        }
        let c = product[k.rem_euclid(product.len() as i64) as usize];
        Some((c / shared, shared))
    };
    let mut best: Option<(i64, f64)> = None;
    for k in -(na - 1)..nb {
        if let Some((ratio, _)) = score(k)
            && best.is_none_or(|(_, top)| ratio > top)
        {
            best = Some((k, ratio));
        }
    }
    let (_, top) = best.filter(|(_, ratio)| *ratio > 0.0)?;
    let mut chosen: Option<(i64, f64, f64)> = None;
    for k in -(na - 1)..nb {
        let Some((ratio, shared)) = score(k) else { continue };
        let beside = |k: i64| score(k).map_or(f64::MIN, |(ratio, _)| ratio);
        let peak = ratio >= top * (1.0 - TIE_SHARE) && ratio >= beside(k - 1) && ratio >= beside(k + 1);
        if peak && chosen.is_none_or(|(_, _, most)| shared > most * (1.0 + TIE_SHARE)) {
            chosen = Some((k, ratio, shared));
        }
    }
    chosen.map(|(k, ratio, _)| (k, ratio))
}

/// Sums of the normal equations of one round.
#[derive(Clone, Copy, Default)]
struct Normal {
    /// Sums of w, w g, w g², w g t, w t g t, w r, w r g, w r g t over the samples, with g = slope of the reference, t = time from the pivot.
    w: f64,
    wg: f64,
    wgg: f64,
    wgt: f64,
    wggt: f64,
    wggtt: f64,
    wr: f64,
    wrg: f64,
    wrgt: f64,
    wrr: f64,
    samples: usize,
}

/// Least squares from a coarse offset; leaves it where there is nothing to refine.
fn refine(channels: &[Channel<'_>], coarse: Coarse, drift: bool) -> Alignment {
    let spans = channels.iter().filter_map(|c| c.trace.span_s());
    let (from_s, to_s) = spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((0.0, 0.0));
    let mut found = Alignment {
        offset_s: coarse.offset_s,
        drift_ratio: 0.0,
        pivot_s: if drift { 0.5 * (from_s + to_s) } else { 0.0 },
        uncertainty_s: f64::NAN,
        correlation_ratio: coarse.correlation_ratio,
    };
    // The grid is right to a bin, with noise to a few; beyond this the fine step has lost its way.
    let reach_s = REACH_S + 20.0 * coarse.bin_s + if drift { 1e-3 * (to_s - from_s) } else { 0.0 };
    let mut best = found;
    for round in 0..FINE_ROUNDS_MAX {
        let fit = channels.iter().map(|c| normal_equations(c, &found)).collect::<Vec<_>>();
        // The drift joins when the offset is near.
        let Some((step_s, step_ratio, error_s)) = solve(&fit, drift && round >= 3) else { break };
        found.offset_s += step_s;
        found.drift_ratio += step_ratio;
        found.uncertainty_s = error_s;
        // Written so that NaN is lost too.
        let near = (found.offset_s - coarse.offset_s).abs() <= reach_s;
        if !near {
            return best;
        }
        best = found;
        if step_s.abs() < FINE_STEP_S && round > 4 {
            break;
        }
    }
    best
}

/// One channel at the present alignment. The zero of the channel is eliminated: all sums are about the weighted means.
fn normal_equations(channel: &Channel<'_>, at: &Alignment) -> Normal {
    let n = channel.trace.len();
    let stride = n.div_ceil(FINE_SAMPLES_MAX).max(1);
    let mut cursor = channel.reference.cursor();
    let mut rows: Vec<(f64, f64, f64)> = Vec::with_capacity(n / stride + 1);
    for i in (0..n).step_by(stride) {
        let t = channel.trace.time_s(i);
        let (value, slope) = cursor.value_and_slope(at.reference_s(t));
        let r = (channel.trace.values[i] - value) / channel.scale;
        if r.is_finite() && slope.is_finite() {
            rows.push((r, slope / channel.scale, t - at.pivot_s));
        }
    }
    if rows.len() < 8 {
        return Normal::default();
    }
    let mut sorted: Vec<f64> = rows.iter().map(|row| row.0).collect();
    let half = sorted.len() / 2;
    let centre = *sorted.select_nth_unstable_by(half, f64::total_cmp).1;
    // What is typical is judged where something moves: rests agree whatever the offset.
    let moving = 0.1 * rows.iter().map(|row| row.1.abs()).fold(0.0, f64::max);
    let mut moved: Vec<f64> =
        rows.iter().filter(|row| row.1.abs() > moving).map(|row| (row.0 - centre).abs()).collect();
    if moved.len() < 8 {
        return Normal::default();
    }
    let half = moved.len() / 2;
    // Never below rounding: what agrees exactly must not shut out everything else.
    let floor = 1e-12 * (1.0 + centre.abs());
    let sigma = (SIGMA_PER_MEDIAN * *moved.select_nth_unstable_by(half, f64::total_cmp).1).max(floor);
    let mut sum = Normal::default();
    for (r, g, t) in rows {
        let u = (r - centre) / (TUKEY * sigma);
        if u.abs() >= 1.0 {
            continue;
        }
        let w = (1.0 - u * u).powi(2);
        let gt = g * t;
        sum.w += w;
        sum.wg += w * g;
        sum.wgg += w * g * g;
        sum.wgt += w * gt;
        sum.wggt += w * g * gt;
        sum.wggtt += w * gt * gt;
        sum.wr += w * r;
        sum.wrg += w * r * g;
        sum.wrgt += w * r * gt;
        sum.wrr += w * r * r;
        sum.samples += 1;
    }
    sum
}

/// Step of offset and drift, and the standard error of the offset; `None` without motion.
fn solve(fit: &[Normal], drift: bool) -> Option<(f64, f64, f64)> {
    let (mut gg, mut ggt, mut ggtt, mut rg, mut rgt, mut rr) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut weight, mut samples) = (0.0, 0_usize);
    for n in fit.iter().filter(|n| n.w > 0.0) {
        gg += n.wgg - n.wg * n.wg / n.w;
        ggt += n.wggt - n.wg * n.wgt / n.w;
        ggtt += n.wggtt - n.wgt * n.wgt / n.w;
        rg += n.wrg - n.wr * n.wg / n.w;
        rgt += n.wrgt - n.wr * n.wgt / n.w;
        rr += n.wrr - n.wr * n.wr / n.w;
        weight += n.w;
        samples += n.samples;
    }
    let moves = gg > 0.0;
    if !moves || samples < 8 {
        return None;
    }
    let (step_s, step_ratio) = if drift {
        let determinant = gg * ggtt - ggt * ggt;
        let separate = determinant > 1e-12 * gg * ggtt;
        if !separate {
            return None;
        }
        ((rg * ggtt - rgt * ggt) / determinant, (rgt * gg - rg * ggt) / determinant)
    } else {
        (rg / gg, 0.0)
    };
    let left = (rr - step_s * rg - step_ratio * rgt).max(0.0) / weight;
    let steps_ok = step_s.is_finite() && step_ratio.is_finite();
    steps_ok.then(|| (step_s, step_ratio, (left / gg).sqrt()))
}

/// Delay of one channel on top of an alignment (above 0: the reference is late), with its standard error; `None` where the signal does not
/// move enough to tell, or the delay is beyond `reach_s`.
pub fn residual_delay(channel: &Channel<'_>, at: &Alignment, reach_s: f64) -> Option<(f64, f64)> {
    let mut found = *at;
    let mut error_s = f64::NAN;
    for round in 0..FINE_ROUNDS_MAX {
        let (step_s, _, error) = solve(&[normal_equations(channel, &found)], false)?;
        found.offset_s += step_s.clamp(-0.5 * reach_s, 0.5 * reach_s);
        error_s = error;
        let near = (found.offset_s - at.offset_s).abs() <= reach_s;
        if !near {
            return None;
        }
        if step_s.abs() < FINE_STEP_S && round > 2 {
            break;
        }
    }
    Some((found.offset_s - at.offset_s, error_s))
}
