//! Integrals of a matrix exponential over any time, for the exact step of a linear plant.
//!
//! In: a small matrix A, a bound on its size, a duration h. Out: F(h) = ∫ exp(A s) ds and G(h) = one row of ∫ F(s) ds. With them
//! z' = A z + b gives z(h) = z + F(h) z'(0), and the integral of that row's component is h z + G(h) z'(0). Needs no inverse of A.
//! Does not know what the components of z are. Also such a motion as a function of time ([`Course`]), and the search for the instant at which it
//! meets a condition. Plain loops: as iterators these small products are calls, and an event of an axis is made of thousands of them.

/// Bound on |A| h for the series; a longer step is halved until it holds, then doubled again.
const SERIES_NORM_MAX: f64 = 0.25;
/// Terms of the series: the first one left out is below 0.25^13 / 14!, 2e-19 of the first.
const SERIES_TERMS: usize = 13;
/// Bound on |A| h for a motion as one series: the first term left out is below 0.41^13 / 14!, 1e-16 of the first.
const COURSE_NORM_MAX: f64 = 0.41;
/// More halvings than any finite ratio of step and time constant needs; it only ends the loop on infinite input.
const HALVINGS_MAX: u32 = 2200;
/// Newton steps and bisections in the search for an instant. Bisection alone needs 52 to the last bit.
const SEARCH_STEPS_MAX: u32 = 64;
/// Terms of such a series below this share of the first are left out.
const LAST_TERM: f64 = f64::EPSILON / 64.0;

/// Rows of a square matrix.
pub(super) type Matrix<const N: usize> = [[f64; N]; N];

/// A b.
#[allow(clippy::needless_range_loop, reason = "rows and columns of a product, as they are written")]
#[inline(always)]
fn product<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    let mut c = [[0.0; N]; N];
    for row in 0..N {
        for column in 0..N {
            let mut sum = a[row][0] * b[0][column];
            for k in 1..N {
                sum += a[row][k] * b[k][column];
            }
            c[row][column] = sum;
        }
    }
    c
}

/// A z.
#[allow(clippy::needless_range_loop, reason = "rows and columns of a product, as they are written")]
#[inline(always)]
fn times<const N: usize>(a: &Matrix<N>, z: &[f64; N]) -> [f64; N] {
    let mut all = [0.0; N];
    for row in 0..N {
        for column in 0..N {
            all[row] += a[row][column] * z[column];
        }
    }
    all
}

/// F(h) and G(h) of row `integrated`: series for a short step, then doubling. `norm_per_s` bounds A after the diagonal scaling that
/// balances it. Every entry keeps its relative accuracy, also the tiny ones (angle by voltage is of order h³), which a matrix
/// exponential of the whole system with its inputs would round against its ones.
#[allow(clippy::needless_range_loop, reason = "rows and columns of products, as they are written")]
pub(super) fn integrals<const N: usize>(
    a: &Matrix<N>,
    norm_per_s: f64,
    integrated: usize,
    duration_s: f64,
) -> (Matrix<N>, [f64; N]) {
    let mut h = duration_s;
    let mut halvings = 0;
    while norm_per_s * h > SERIES_NORM_MAX && halvings < HALVINGS_MAX {
        h *= 0.5;
        halvings += 1;
    }

    // F = Σ A^k h^(k+1)/(k+1)!, G = Σ (row of A^k) h^(k+2)/(k+2)!
    let mut term: Matrix<N> = [[0.0; N]; N];
    let mut g = [0.0; N];
    for (n, row) in term.iter_mut().enumerate() {
        row[n] = h;
    }
    g[integrated] = 0.5 * h * h;
    let mut f = term;
    for k in 1..SERIES_TERMS {
        let scale_s = h / (k + 1) as f64;
        term = product(a, &term);
        for row in &mut term {
            for entry in row {
                *entry *= scale_s;
            }
        }
        let mut settled = true;
        for row in 0..N {
            for column in 0..N {
                let sum = f[row][column] + term[row][column];
                settled &= sum == f[row][column];
                f[row][column] = sum;
            }
            let sum = g[row] + term[integrated][row] * h / (k + 2) as f64;
            settled &= sum == g[row];
            g[row] = sum;
        }
        // Later terms are smaller still. The first N may be 0 in an entry that the others reach.
        if k > N && settled {
            break;
        }
    }

    // F(2h) = F + E F and G(2h) = G + h (row of F) + G E with E = exp(A h) = 1 + A F.
    for _ in 0..halvings {
        let mut e = product(a, &f);
        for (n, row) in e.iter_mut().enumerate() {
            row[n] += 1.0;
        }
        let later = product(&e, &f);
        let before = g;
        for column in 0..N {
            let mut turned = before[0] * e[0][column];
            for k in 1..N {
                turned += before[k] * e[k][column];
            }
            g[column] = before[column] + h * f[integrated][column] + turned;
        }
        for row in 0..N {
            for column in 0..N {
                f[row][column] += later[row][column];
            }
        }
        h *= 2.0;
    }
    (f, g)
}

/// z(t) - z(0) of a motion z' = A z + b, to be looked at many times: one power series where the time allows it, otherwise F(t).
pub(super) struct Course<'a, const N: usize> {
    a: &'a Matrix<N>,
    norm_per_s: f64,
    rates: [f64; N],
    /// Of A^k z'(0) t^(k+1) / (k+1)!, from k = 0; empty when the time is too long for it.
    terms: [[f64; N]; SERIES_TERMS],
    count: usize,
}

/// Where such a motion is.
pub(super) struct Instant<const N: usize> {
    /// z(t) - z(0).
    pub(super) change: [f64; N],
    /// z'(t).
    pub(super) rates: [f64; N],
    /// z''(t).
    pub(super) bends: [f64; N],
}

impl<'a, const N: usize> Course<'a, N> {
    /// From `rates` = z'(0), for times up to `limit_s`; `norm_per_s` as for [`integrals`].
    #[allow(clippy::needless_range_loop, reason = "several arrays side by side")]
    pub(super) fn new(a: &'a Matrix<N>, norm_per_s: f64, rates: [f64; N], limit_s: f64) -> Self {
        let mut new = Self { a, norm_per_s, rates, terms: [[0.0; N]; SERIES_TERMS], count: 0 };
        let size = norm_per_s * limit_s;
        if size > COURSE_NORM_MAX || !size.is_finite() {
            return new;
        }
        let (mut term, mut scale) = (rates, 1.0);
        while new.count < SERIES_TERMS && (new.count <= N || scale > LAST_TERM) {
            new.terms[new.count] = term;
            new.count += 1;
            let next = 1.0 / (new.count + 1) as f64;
            scale *= size * next;
            term = times(a, &term);
            for n in 0..N {
                term[n] *= next;
            }
        }
        new
    }

    #[allow(clippy::needless_range_loop, reason = "several arrays side by side")]
    #[inline]
    pub(super) fn at(&self, time_s: f64) -> Instant<N> {
        let mut change = [0.0; N];
        if self.count == 0 {
            let (f, _) = integrals(self.a, self.norm_per_s, 0, time_s);
            change = times(&f, &self.rates);
        } else {
            for term in self.terms[..self.count].iter().rev() {
                for n in 0..N {
                    change[n] = change[n] * time_s + term[n];
                }
            }
            for n in 0..N {
                change[n] *= time_s;
            }
        }
        // The rates change linearly with the state.
        let mut rates = times(self.a, &change);
        for n in 0..N {
            rates[n] += self.rates[n];
        }
        let bends = times(self.a, &rates);
        Instant { change, rates, bends }
    }
}

/// Zero of a function that is positive at `low_s` and not at `high_s`: Newton, kept inside the bracket by bisection. `function`
/// gives value and slope.
pub(super) fn falling_zero(mut low_s: f64, mut high_s: f64, function: impl Fn(f64) -> (f64, f64)) -> f64 {
    let mut time_s = 0.5 * (low_s + high_s);
    for _ in 0..SEARCH_STEPS_MAX {
        let (value, slope) = function(time_s);
        if value > 0.0 {
            low_s = time_s;
        } else {
            high_s = time_s;
        }
        let newton_s = time_s - value / slope;
        let next_s = if newton_s > low_s && newton_s < high_s { newton_s } else { 0.5 * (low_s + high_s) };
        if (next_s - time_s).abs() <= f64::EPSILON * high_s {
            return next_s;
        }
        time_s = next_s;
    }
    time_s
}
