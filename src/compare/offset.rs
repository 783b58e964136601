//! The time offset between two traces of the same motion.
//!
//! In: what moves in both, channel by channel, on any time bases. Out: [`Alignment`]: reference time = trace time + offset (+ drift), the
//! overlap and how sure it is. Two steps:
//!
//! 1. coarse, over all shifts: mean velocities on a common grid (differences of positions at its edges), correlated by FFT and divided by
//!    the energy of the overlap, so that a standstill counts for nothing and a trace that starts later finds its place;
//! 2. fine: least squares of `trace(t) - reference(t + offset + drift t) - zero` by Gauss-Newton, with weights that drop to 0 for
//!    what does not belong together (a dwell that is longer in one of them), which gives a fraction of a sample. What is left is weighed with
//!    the slope of the reference over some samples on either side of the place, not at it: noise of the reference is in its value and in its
//!    slope at the place together, and would pull the offset towards where the interpolation smooths (errors in variables; an instrument).
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
    /// Standard error of the offset, were what is left noise; 1 ns at least.
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
/// No offset is told better, however well the samples agree: no file has times that are.
const FINEST_S: f64 = 1e-9;
/// Tukey's constant: 95 % efficient for noise that is normal.
const TUKEY: f64 = 4.685;
/// Of what tells the offset the weights must leave this share; otherwise they are made wider, so often at most.
const KEPT_MIN_SHARE: f64 = 0.02;
const WIDER_ROUNDS_MAX: usize = 40;
/// Samples of the reference from a place to where its slope is taken on either side: the cubic at the place reaches two.
const BESIDE_SAMPLES: f64 = 4.0;
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

/// Sums of the normal equations of one round: r = what is left, g = slope of the reference at the place, z = its slope over some samples on
/// either side, t = time from the pivot; each times the weight w.
#[derive(Clone, Copy, Default)]
struct Normal {
    w: f64,
    r: f64,
    rr: f64,
    z: f64,
    zt: f64,
    g: f64,
    gt: f64,
    zz: f64,
    zg: f64,
    zgt: f64,
    zgtt: f64,
    zr: f64,
    zrt: f64,
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

/// One sample of a channel: what is left, slopes of the reference at and around its place, time from the pivot.
struct Row {
    r: f64,
    g: f64,
    z: f64,
    t: f64,
}

/// One channel at the present alignment. The zero of the channel is eliminated: all sums are about the weighted means.
fn normal_equations(channel: &Channel<'_>, at: &Alignment) -> Normal {
    let n = channel.trace.len();
    let stride = n.div_ceil(FINE_SAMPLES_MAX).max(1);
    let reference = channel.reference;
    let beside_s = if reference.held { 0.0 } else { BESIDE_SAMPLES * reference.step_s().unwrap_or(0.0) };
    let (mut cursor, mut before, mut behind) = (reference.cursor(), reference.cursor(), reference.cursor());
    let mut rows: Vec<Row> = Vec::with_capacity(n / stride + 1);
    let (mut zg, mut zz) = (0.0, 0.0);
    for i in (0..n).step_by(stride) {
        let t = channel.trace.time_s(i);
        let place_s = at.reference_s(t);
        let (value, slope) = cursor.value_and_slope(place_s);
        let r = (channel.trace.values[i] - value) / channel.scale;
        if r.is_finite() && slope.is_finite() {
            let wide = (behind.value(place_s + beside_s) - before.value(place_s - beside_s)) / (2.0 * beside_s);
            // At the ends, beside gaps and without a step there is only the slope at the place.
            let z = if wide.is_finite() { wide } else { slope } / channel.scale;
            let g = slope / channel.scale;
            zg += z * g;
            zz += z * z;
            rows.push(Row { r, g, z, t: t - at.pivot_s });
        }
    }
    if rows.len() < 8 {
        return Normal::default();
    }
    // What swings as fast as the samples beside say has no slope over them.
    let tells = zg > 0.5 * zz;
    if !tells {
        rows.iter_mut().for_each(|row| row.z = row.g);
    }
    let mut sorted: Vec<f64> = rows.iter().map(|row| row.r).collect();
    let half = sorted.len() / 2;
    let centre = *sorted.select_nth_unstable_by(half, f64::total_cmp).1;
    // What is typical is judged where something moves: rests agree whatever the offset.
    let moving = 0.1 * rows.iter().map(|row| row.z.abs()).fold(0.0, f64::max);
    let mut moved: Vec<f64> =
        rows.iter().filter(|row| row.z.abs() > moving).map(|row| (row.r - centre).abs()).collect();
    if moved.len() < 8 {
        return Normal::default();
    }
    let half = moved.len() / 2;
    // Never below rounding: what agrees exactly must not shut out everything else.
    let floor = 1e-12 * (1.0 + centre.abs());
    let mut sigma = (SIGMA_PER_MEDIAN * *moved.select_nth_unstable_by(half, f64::total_cmp).1).max(floor);
    let count = rows.len() as f64;
    let (z, zz) = rows.iter().fold((0.0, 0.0), |(z, zz), row| (z + row.z, zz + row.z * row.z));
    let told = KEPT_MIN_SHARE * (zz - z * z / count);
    // Stretches of one speed agree exactly whatever the offset: what remains must tell it.
    for _ in 0..WIDER_ROUNDS_MAX {
        let sum = weighted(&rows, centre, sigma);
        if sum.w > 0.0 && sum.zz - sum.z * sum.z / sum.w >= told {
            return sum;
        }
        sigma *= 4.0;
    }
    weighted(&rows, centre, sigma)
}

/// Sums with Tukey's weights.
fn weighted(rows: &[Row], centre: f64, sigma: f64) -> Normal {
    let mut sum = Normal::default();
    for &Row { r, g, z, t } in rows {
        let u = (r - centre) / (TUKEY * sigma);
        if u.abs() >= 1.0 {
            continue;
        }
        let w = (1.0 - u * u).powi(2);
        sum.w += w;
        sum.r += w * r;
        sum.rr += w * r * r;
        sum.z += w * z;
        sum.zt += w * z * t;
        sum.g += w * g;
        sum.gt += w * g * t;
        sum.zz += w * z * z;
        sum.zg += w * z * g;
        sum.zgt += w * z * g * t;
        sum.zgtt += w * z * g * t * t;
        sum.zr += w * z * r;
        sum.zrt += w * z * r * t;
        sum.samples += 1;
    }
    sum
}

/// Step of offset and drift, and the standard error of the offset; `None` without motion.
fn solve(fit: &[Normal], drift: bool) -> Option<(f64, f64, f64)> {
    // Rows: z, z t; columns: g, g t.
    let (mut zz, mut zg, mut z_gt, mut zt_g, mut zt_gt, mut zr, mut zt_r, mut rr) =
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut weight, mut samples) = (0.0, 0_usize);
    for n in fit.iter().filter(|n| n.w > 0.0) {
        zz += n.zz - n.z * n.z / n.w;
        zg += n.zg - n.z * n.g / n.w;
        z_gt += n.zgt - n.z * n.gt / n.w;
        zt_g += n.zgt - n.zt * n.g / n.w;
        zt_gt += n.zgtt - n.zt * n.gt / n.w;
        zr += n.zr - n.z * n.r / n.w;
        zt_r += n.zrt - n.zt * n.r / n.w;
        rr += n.rr - n.r * n.r / n.w;
        weight += n.w;
        samples += n.samples;
    }
    let moves = zg > 0.0 && zz > 0.0;
    if !moves || samples < 8 {
        return None;
    }
    let (step_s, step_ratio) = if drift {
        let determinant = zg * zt_gt - z_gt * zt_g;
        let separate = determinant > 1e-12 * zg * zt_gt;
        if !separate {
            return None;
        }
        ((zr * zt_gt - zt_r * z_gt) / determinant, (zt_r * zg - zr * zt_g) / determinant)
    } else {
        (zr / zg, 0.0)
    };
    let left = (rr - step_s * zr - step_ratio * zt_r).max(0.0) / weight;
    let steps_ok = step_s.is_finite() && step_ratio.is_finite();
    steps_ok.then(|| (step_s, step_ratio, ((left * zz).sqrt() / zg).max(FINEST_S)))
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
