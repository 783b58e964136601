//! Integrals of a matrix exponential over any time, for the exact step of a linear plant.
//!
//! In: a small matrix A, a bound on its size, a duration h. Out: F(h) = ∫ exp(A s) ds and G(h) = one row of ∫ F(s) ds. With them
//! z' = A z + b gives z(h) = z + F(h) z'(0), and the integral of that row's component is h z + G(h) z'(0). Needs no inverse of A.
//! Does not know what the components of z are. Also the search for the instant at which such a motion meets a condition.

/// Bound on |A| h for the series; a longer step is halved until it holds, then doubled again.
const SERIES_NORM_MAX: f64 = 0.25;
/// Terms of the series: the first one left out is below 0.25^13 / 14!, 2e-19 of the first.
const SERIES_TERMS: u32 = 13;
/// More halvings than any finite ratio of step and time constant needs; it only ends the loop on infinite input.
const HALVINGS_MAX: u32 = 2200;
/// Newton steps and bisections in the search for an instant. Bisection alone needs 52 to the last bit.
const SEARCH_STEPS_MAX: u32 = 64;

/// Rows of a square matrix.
pub(super) type Matrix<const N: usize> = [[f64; N]; N];

/// A b.
#[inline]
pub(super) fn product<const N: usize>(a: Matrix<N>, b: Matrix<N>) -> Matrix<N> {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| (1..N).fold(a[row][0] * b[0][column], |sum, k| sum + a[row][k] * b[k][column]))
    })
}

/// F(h) and G(h) of row `integrated`: series for a short step, then doubling. `norm_per_s` bounds A after the diagonal scaling that
/// balances it. Every entry keeps its relative accuracy, also the tiny ones (angle by voltage is of order h³), which a matrix
/// exponential of the whole system with its inputs would round against its ones.
pub(super) fn integrals<const N: usize>(
    a: Matrix<N>,
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
        let scale_s = h / f64::from(k + 1);
        term = product(a, term).map(|row| row.map(|value| value * scale_s));
        let before = (f, g);
        for row in 0..N {
            for column in 0..N {
                f[row][column] += term[row][column];
            }
            g[row] += term[integrated][row] * h / f64::from(k + 2);
        }
        // Later terms are smaller still. The first N may be 0 in an entry that the others reach.
        if k as usize > N && (f, g) == before {
            break;
        }
    }

    // F(2h) = F + E F and G(2h) = G + h (row of F) + G E with E = exp(A h) = 1 + A F.
    for _ in 0..halvings {
        let mut e = product(a, f);
        for (n, row) in e.iter_mut().enumerate() {
            row[n] += 1.0;
        }
        let later = product(e, f);
        g = std::array::from_fn(|column| {
            let turned = (1..N).fold(g[0] * e[0][column], |sum, k| sum + g[k] * e[k][column]);
            g[column] + h * f[integrated][column] + turned
        });
        for row in 0..N {
            for column in 0..N {
                f[row][column] += later[row][column];
            }
        }
        h *= 2.0;
    }
    (f, g)
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
