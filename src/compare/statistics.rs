//! Figures of a list of differences.
//!
//! In: differences with their times, and the two values where they are known. Out: [`Figures`]. Values that are not finite are left out.
//! Does not weigh: every sample counts the same.

/// What is said about a difference of two signals, or about a distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// Samples that counted.
    pub samples: usize,
    /// Root mean square, zero (bias) included.
    pub rms: f64,
    /// Largest magnitude.
    pub max: f64,
    /// Trace time at which it is reached first.
    pub max_at_s: f64,
    /// 95 % of the magnitudes lie below or at it.
    pub p95: f64,
    /// Mean.
    pub bias: f64,
    /// Correlation of the two signals, 1 = alike; `None` where one of them rests.
    pub correlation_ratio: Option<f64>,
}

/// Gathers samples of a difference.
#[derive(Clone, Debug, Default)]
pub struct Gathering {
    magnitudes: Vec<f64>,
    sum: f64,
    squares: f64,
    max: f64,
    max_at_s: f64,
    pairs: Moments,
}

/// Sums for the correlation, about the first pair so that a large zero costs no digits.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    first: Option<(f64, f64)>,
    a: f64,
    b: f64,
    aa: f64,
    bb: f64,
    ab: f64,
    n: f64,
}

impl Gathering {
    /// Takes a difference.
    pub fn push(&mut self, time_s: f64, value: f64) {
        if !value.is_finite() {
            return;
        }
        if value.abs() > self.max || self.magnitudes.is_empty() {
            (self.max, self.max_at_s) = (value.abs(), time_s);
        }
        self.sum += value;
        self.squares += value * value;
        self.magnitudes.push(value.abs());
    }

    /// Takes two values whose difference counts.
    pub fn push_pair(&mut self, time_s: f64, values: [f64; 2], zero: f64) {
        let [a, b] = values;
        if !(a.is_finite() && b.is_finite()) {
            return;
        }
        self.push(time_s, a - b - zero);
        let m = &mut self.pairs;
        let (a0, b0) = *m.first.get_or_insert((a, b));
        let (a, b) = (a - a0, b - b0);
        m.a += a;
        m.b += b;
        m.aa += a * a;
        m.bb += b * b;
        m.ab += a * b;
        m.n += 1.0;
    }

    /// The figures; `None` without a sample.
    pub fn finish(mut self) -> Option<Figures> {
        let n = self.magnitudes.len();
        if n == 0 {
            return None;
        }
        let place = (0.95 * n as f64).ceil() as usize;
        let p95 = *self.magnitudes.select_nth_unstable_by(place.clamp(1, n) - 1, f64::total_cmp).1;
        Some(Figures {
            samples: n,
            rms: (self.squares / n as f64).sqrt(),
            max: self.max,
            max_at_s: self.max_at_s,
            p95,
            bias: self.sum / n as f64,
            correlation_ratio: self.pairs.correlation(),
        })
    }
}

impl Moments {
    fn correlation(&self) -> Option<f64> {
        let n = self.n;
        let (aa, bb) = (self.aa - self.a * self.a / n, self.bb - self.b * self.b / n);
        let ab = self.ab - self.a * self.b / n;
        // A signal that rests has rounding left, and a correlation of rounding means nothing.
        let moves = aa > 1e-18 * self.aa && bb > 1e-18 * self.bb && aa > 0.0 && bb > 0.0;
        moves.then(|| (ab / (aa * bb).sqrt()).clamp(-1.0, 1.0))
    }
}
