//! Circles through points: the least-squares circle, the ring about a centre, the narrowest ring.
//!
//! In: points in a plane. Out: centre and radius, widths, mm. Knows neither machines nor norms.

use std::f64::consts::TAU;

/// Directions in which the points farthest out and farthest in are kept for the narrowest ring.
const DIRECTIONS: usize = 360;
/// Steps of each search by golden section: the range shrinks to 1e-5 of itself.
const GOLDEN_STEPS: usize = 24;
/// The golden section.
const GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;

/// Width of the narrowest ring that holds all points (minimum zone). `near_mm`: a centre near to its own, such as that of the
/// least-squares circle; the deviations are small against the radius. To 1 % of the width about `near_mm`.
///
/// From a centre moved by c the distance of a point in direction u changes by -u c, to second order in c over the radius: the width is a
/// convex function of c, and two nested searches find its minimum.
pub(super) fn minimum_zone(points_mm: &[[f64; 2]], near_mm: [f64; 2]) -> f64 {
    let about = ring(points_mm, near_mm);
    let mut outermost = [f64::NEG_INFINITY; DIRECTIONS];
    let mut innermost = [f64::INFINITY; DIRECTIONS];
    for p in points_mm {
        let (x, y) = (p[0] - near_mm[0], p[1] - near_mm[1]);
        let place = (y.atan2(x).rem_euclid(TAU) / TAU * DIRECTIONS as f64) as usize % DIRECTIONS;
        let radius_mm = x.hypot(y);
        outermost[place] = outermost[place].max(radius_mm);
        innermost[place] = innermost[place].min(radius_mm);
    }
    let kept: Vec<[f64; 4]> = (0..DIRECTIONS)
        .filter(|i| innermost[*i].is_finite())
        .map(|i| {
            let (sin, cos) = ((i as f64 + 0.5) / DIRECTIONS as f64 * TAU).sin_cos();
            [cos, sin, outermost[i], innermost[i]]
        })
        .collect();
    let width = |x: f64, y: f64| {
        let moved = kept.iter().fold((f64::MAX, f64::MIN), |(least, most), [cos, sin, outer, inner]| {
            let by = cos * x + sin * y;
            (least.min(inner - by), most.max(outer - by))
        });
        moved.1 - moved.0
    };
    if kept.len() < 4 || !(about.is_finite() && about > 0.0) {
        return about;
    }
    let best_y = |x: f64| lowest(&|y| width(x, y), about);
    let x = lowest(&|x| width(x, best_y(x)), about);
    about.min(ring(points_mm, [near_mm[0] + x, near_mm[1] + best_y(x)]))
}

/// Where a convex function between -`reach` and `reach` is least.
fn lowest(function: &dyn Fn(f64) -> f64, reach: f64) -> f64 {
    let (mut low, mut high) = (-reach, reach);
    let inner = |low: f64, high: f64| [high - GOLDEN_RATIO * (high - low), low + GOLDEN_RATIO * (high - low)];
    let [mut a, mut b] = inner(low, high);
    let (mut at_a, mut at_b) = (function(a), function(b));
    for _ in 0..GOLDEN_STEPS {
        if at_a <= at_b {
            (high, b, at_b) = (b, a, at_a);
            a = inner(low, high)[0];
            at_a = function(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = inner(low, high)[1];
            at_b = function(b);
        }
    }
    0.5 * (low + high)
}

/// Width of the ring about a centre that holds all points.
pub(super) fn ring(points_mm: &[[f64; 2]], centre_mm: [f64; 2]) -> f64 {
    let radii = points_mm.iter().map(|p| (p[0] - centre_mm[0]).hypot(p[1] - centre_mm[1]));
    let (least, most) = radii.fold((f64::MAX, f64::MIN), |(a, b), r| (a.min(r), b.max(r)));
    (most - least).max(0.0)
}

/// Least-squares circle: algebraic first, then Gauss-Newton on the distances. `points` from anywhere; at least half a turn is needed for
/// a sound result. `None` for fewer than five points or points on a line.
pub fn fit_circle(points_mm: &[[f64; 2]]) -> Option<([f64; 2], f64)> {
    let n = points_mm.len() as f64;
    if points_mm.len() < 5 {
        return None;
    }
    let mean: [f64; 2] = std::array::from_fn(|i| points_mm.iter().map(|p| p[i]).sum::<f64>() / n);
    let (mut uu, mut vv, mut uv, mut uz, mut vz, mut zz) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for p in points_mm {
        let (u, v) = (p[0] - mean[0], p[1] - mean[1]);
        let z = u * u + v * v;
        uu += u * u;
        vv += v * v;
        uv += u * v;
        uz += u * z;
        vz += v * z;
        zz += z;
    }
    let determinant = uu * vv - uv * uv;
    // Written so that NaN is none too.
    let bent = determinant > 1e-12 * (uu + vv).powi(2);
    if !bent {
        return None;
    }
    let mut c = [0.5 * (uz * vv - vz * uv) / determinant, 0.5 * (vz * uu - uz * uv) / determinant];
    let mut r = (c[0] * c[0] + c[1] * c[1] + zz / n).sqrt();
    for _ in 0..20 {
        // Sums of the normal equations in (centre, radius), with unit vectors from the centre.
        let mut m = nalgebra::Matrix3::<f64>::zeros();
        let mut g = nalgebra::Vector3::<f64>::zeros();
        for p in points_mm {
            let d = [p[0] - mean[0] - c[0], p[1] - mean[1] - c[1]];
            let length = d[0].hypot(d[1]);
            if length == 0.0 {
                continue;
            }
            let row = nalgebra::Vector3::new(d[0] / length, d[1] / length, 1.0);
            m += row * row.transpose();
            g += row * (length - r);
        }
        let step = m.lu().solve(&g)?;
        c = [c[0] + step[0], c[1] + step[1]];
        r += step[2];
        if step.norm() < 1e-12 * r {
            break;
        }
    }
    (r.is_finite() && r > 0.0).then_some(([mean[0] + c[0], mean[1] + c[1]], r))
}
