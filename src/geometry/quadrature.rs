//! Gauss-Legendre quadrature with eight nodes.
//!
//! In: a smooth function and an interval. Out: its integral, exact for polynomials up to degree 15. For a function analytic inside
//! the ellipse with foci at the ends of the interval and semi-axes' sum rho (interval scaled to [-1, 1]) the error is of the order
//! rho^-16. Does not adapt: the caller cuts the range so that rho is large enough.

/// Positive nodes on [-1, 1] with their weights.
const NODES: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Integral of `f` from `start_ratio` to `end_ratio`.
pub(super) fn integral(start_ratio: f64, end_ratio: f64, f: impl Fn(f64) -> f64) -> f64 {
    let middle = 0.5 * (start_ratio + end_ratio);
    let half = 0.5 * (end_ratio - start_ratio);
    NODES.iter().map(|(node, weight)| weight * (f(middle - half * node) + f(middle + half * node))).sum::<f64>() * half
}
