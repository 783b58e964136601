//! Gauss-Legendre quadrature with eight nodes.
//!
//! In: a smooth function and an interval. Out: its integral, exact for polynomials up to degree 15. For a function analytic inside
//! the ellipse with foci at the ends of the interval and semi-axes' sum rho (interval scaled to [-1, 1]) the error is of the order
//! rho^-16. Does not adapt: the caller cuts the range so that rho is large enough.

/// Nodes of the rule.
pub(super) const NODES: usize = 8;

/// Positive nodes on [-1, 1] with their weights.
const POSITIVE: [(f64, f64); NODES / 2] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Integral from `start_ratio` to `end_ratio` of the function that `f` evaluates at all nodes at once.
pub(super) fn integral(start_ratio: f64, end_ratio: f64, f: impl Fn(&[f64; NODES]) -> [f64; NODES]) -> f64 {
    let middle = 0.5 * (start_ratio + end_ratio);
    let half = 0.5 * (end_ratio - start_ratio);
    let mut places = [0.0; NODES];
    for (i, (node, _)) in POSITIVE.iter().enumerate() {
        places[2 * i] = middle - half * node;
        places[2 * i + 1] = middle + half * node;
    }
    let values = f(&places);
    POSITIVE.iter().zip(values.chunks_exact(2)).map(|((_, weight), pair)| weight * (pair[0] + pair[1])).sum::<f64>()
        * half
}
