//! The fractional delay D of models/drive.md section 3.
//!
//! In: one sample a position cycle. Out: the sample of `delay_s` ago, linear between two cycles. Memory is taken once, at
//! construction. Does not interpolate better than linearly: that is what the balancing of a control does.

use nalgebra::Complex;

/// Longest delay in position cycles (17 minutes at 1 ms); machine files are limited to a second. A longer one is cut to this.
const CYCLES_MAX: f64 = 1_048_576.0;

/// A delay line: D(s)\[k\] = (1-f) s\[k-n\] + f s\[k-n-1\] with d = (n+f) T_p.
#[derive(Clone, Debug)]
pub(super) struct DelayLine {
    /// Ring of the last n + 2 samples, in the unit of the signal.
    samples: Box<[f64]>,
    /// Place of the newest sample.
    newest: usize,
    /// f.
    fraction_ratio: f64,
}

impl DelayLine {
    /// All samples before the first one are `before` (in the unit of the signal).
    pub(super) fn new(delay_s: f64, period_s: f64, before: f64) -> Self {
        let cycles = (delay_s / period_s).clamp(0.0, CYCLES_MAX);
        let whole = cycles.floor();
        Self { samples: vec![before; whole as usize + 2].into_boxed_slice(), newest: 0, fraction_ratio: cycles - whole }
    }

    /// Takes s\[k\], gives D(s)\[k\].
    #[inline(always)]
    pub(super) fn step(&mut self, sample: f64) -> f64 {
        let length = self.samples.len();
        // No delay: what is in the ring is never asked for.
        if length == 2 && self.fraction_ratio == 0.0 {
            return sample;
        }
        self.newest = if self.newest + 1 == length { 0 } else { self.newest + 1 };
        self.samples[self.newest] = sample;
        // The ring holds s[k] ... s[k-n-1]: the oldest is the next place, the one before it in time-order follows.
        let older = if self.newest + 1 == length { 0 } else { self.newest + 1 };
        let newer = if older + 1 == length { 0 } else { older + 1 };
        let f = self.fraction_ratio;
        // f = 0 must give the sample itself, also where the older one is not finite.
        if f == 0.0 { self.samples[newer] } else { (1.0 - f) * self.samples[newer] + f * self.samples[older] }
    }

    /// Response to a sine with one cycle of delay being `q` = 1/z: ((1-f) + f q) q^n.
    pub(super) fn response(&self, q: Complex<f64>) -> Complex<f64> {
        let whole = (self.samples.len() - 2) as u32;
        (q * self.fraction_ratio + (1.0 - self.fraction_ratio)) * q.powu(whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_comes_out_late_by_the_delay() {
        for delay_s in [0.0, 0.4e-3, 1e-3, 1.2e-3, 3e-3, 4.75e-3] {
            let mut line = DelayLine::new(delay_s, 1e-3, 0.0);
            for k in 0..40 {
                let t_s = k as f64 * 1e-3;
                let expected = (t_s - delay_s).max(0.0) * 7.0;
                let got = line.step(t_s * 7.0);
                assert!((got - expected).abs() < 1e-15, "delay {delay_s}, k {k}: {got} for {expected}");
            }
        }
    }
}
