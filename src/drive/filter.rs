//! Filters of second order for speed and current set-points, and for the set-point of the axis (p1414 ff., p1656 ff., MD32412).
//!
//! In: one sample a cycle. Out: the filtered sample; the gain at rest is 1. A continuous filter is brought into discrete time by the
//! bilinear transform, stretched so that one frequency (the blocking one, or that of a low-pass) is met exactly. Does not
//! check its frequencies: below half the sampling frequency, which `machine` sees to.

use crate::base::units::RAD_PER_REV;
use crate::machine::{Filter, FilterShape};
use nalgebra::Complex;

/// One discrete section: y = b0 x + b1 x\[k-1\] + b2 x\[k-2\] - a1 y\[k-1\] - a2 y\[k-2\], transposed so that it keeps two values.
#[derive(Clone, Debug)]
pub(super) struct Section {
    /// b0, b1, b2.
    forward_ratio: [f64; 3],
    /// a1, a2.
    back_ratio: [f64; 2],
    /// The input that has been for ever: the filter works on the difference to it, so that an axis at rest keeps its bits.
    resting: f64,
    /// In the unit of the signal.
    memory: [f64; 2],
}

impl Section {
    /// `resting` (in the unit of the signal) has been the input for ever. `None`: the filter is off.
    pub(super) fn new(filter: &Filter, period_s: f64, resting: f64) -> Option<Self> {
        let (numerator, denominator, fixed_hz) = match filter.shape {
            FilterShape::Off => return None,
            FilterShape::Pt1 => ((None, 0.0), (None, 1.0), filter.frequency_hz),
            FilterShape::Pt2 => {
                ((None, 0.0), (Some(filter.frequency_hz), 2.0 * filter.damping_ratio), filter.frequency_hz)
            }
            FilterShape::SecondOrder => (
                (Some(filter.numerator_frequency_hz), 2.0 * filter.numerator_damping_ratio),
                (Some(filter.frequency_hz), 2.0 * filter.damping_ratio),
                filter.numerator_frequency_hz,
            ),
        };
        let fixed_rad_s = RAD_PER_REV * fixed_hz;
        // s = k (1 - q)/(1 + q) with q = 1/z meets the continuous response at the frequency from which k is made.
        let k_rad_s = fixed_rad_s / libm::tan(fixed_rad_s * period_s / 2.0);
        // (s/w)² + c s/w + 1, or c s/w + 1 for w = None (then w is the fixed frequency), times (1 + q)².
        let polynomial = |(frequency_hz, linear): (Option<f64>, f64)| -> [f64; 3] {
            let stretch = k_rad_s / (RAD_PER_REV * frequency_hz.unwrap_or(fixed_hz));
            let square = frequency_hz.map_or(0.0, |_| stretch * stretch);
            let slope = linear * stretch;
            [square + slope + 1.0, 2.0 - 2.0 * square, square - slope + 1.0]
        };
        let (b, a) = (polynomial(numerator), polynomial(denominator));
        Some(Self {
            forward_ratio: b.map(|value| value / a[0]),
            back_ratio: [a[1] / a[0], a[2] / a[0]],
            resting,
            memory: [0.0; 2],
        })
    }

    /// Takes a sample, gives the filtered one.
    #[inline]
    pub(super) fn step(&mut self, sample: f64) -> f64 {
        let [b0, b1, b2] = self.forward_ratio;
        let [a1, a2] = self.back_ratio;
        let above = sample - self.resting;
        let filtered = b0 * above + self.memory[0];
        self.memory[0] = b1 * above - a1 * filtered + self.memory[1];
        self.memory[1] = b2 * above - a2 * filtered;
        self.resting + filtered
    }

    /// What the section remembers from cycle to cycle.
    pub(super) fn memory<'a>(&'a mut self, list: &mut Vec<&'a mut f64>) {
        list.extend(&mut self.memory);
    }

    /// Response to a sine with one cycle of delay being `q` = 1/z.
    pub(super) fn response(&self, q: Complex<f64>) -> Complex<f64> {
        let [b0, b1, b2] = self.forward_ratio;
        let [a1, a2] = self.back_ratio;
        (q * (q * b2 + b1) + b0) / (q * (q * a2 + a1) + 1.0)
    }
}

/// Sections one after the other; none is a wire.
#[derive(Clone, Debug)]
pub(super) struct Chain(Box<[Section]>);

impl Chain {
    /// Those of `filters` that are on; `resting` as for [`Section::new`].
    pub(super) fn new(filters: &[Filter], period_s: f64, resting: f64) -> Self {
        Self(filters.iter().filter_map(|filter| Section::new(filter, period_s, resting)).collect())
    }

    /// Takes a sample, gives the filtered one.
    #[inline(always)]
    pub(super) fn step(&mut self, sample: f64) -> f64 {
        self.0.iter_mut().fold(sample, |sample, section| section.step(sample))
    }

    /// A wire.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// What its sections remember from cycle to cycle.
    pub(super) fn memory<'a>(&'a mut self, list: &mut Vec<&'a mut f64>) {
        self.0.iter_mut().for_each(|section| section.memory(list));
    }
}
