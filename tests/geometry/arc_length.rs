//! The path parameter is arc length to 1e-9: every kind of curve against another quadrature, nasty ones among them.

use crate::random::Random;
use sollwert::base::{AxisId, AxisVector, PartPoint, PerAxis};
use sollwert::geometry::{Arc, Curve, HermiteBlend, PolynomialCurve, SpatialArc};
use sollwert::interpreter::{ArcGeometry, PolynomialGeometry, PolynomialPiece, SpatialArcGeometry};

const ONE: [f64; 6] = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Three linear axes and a rotary one.
fn linear() -> PerAxis<bool> {
    PerAxis::from_fn(|axis| axis.index() < 3)
}

fn vector(components: &[f64]) -> AxisVector {
    PerAxis::from_fn(|axis| components.get(axis.index()).copied().unwrap_or(0.0))
}

/// Adaptive Simpson with one extrapolation, to `error`: not the quadrature of the program.
fn adaptive(f: &dyn Fn(f64) -> f64, a: f64, b: f64, error: f64, depth: u32) -> f64 {
    let (h, m) = (b - a, 0.5 * (a + b));
    let [fa, fl, fm, fr, fb] = [a, 0.75 * a + 0.25 * b, m, 0.25 * a + 0.75 * b, b].map(f);
    let (whole, halves) = (h / 6.0 * (fa + 4.0 * fm + fb), h / 12.0 * (fa + 4.0 * fl + 2.0 * fm + 4.0 * fr + fb));
    let off = (halves - whole) / 15.0;
    if depth == 0 || off.abs() <= error {
        return halves + off;
    }
    adaptive(f, a, m, error, depth - 1) + adaptive(f, m, b, error, depth - 1)
}

/// q and dq/du of a piece, written out by powers.
fn value(piece: &PolynomialPiece, u: f64) -> [AxisVector; 2] {
    let power = |i: i32| u.powi(i);
    let sum = |slope: bool, of: &dyn Fn(usize) -> f64| -> f64 {
        (0..6)
            .map(|i| {
                if !slope {
                    of(i) * power(i as i32)
                } else if i > 0 {
                    i as f64 * of(i) * power(i as i32 - 1)
                } else {
                    0.0
                }
            })
            .sum()
    };
    let denominator = |i: usize| piece.denominator_ratio[i];
    let [d, d_u] = [sum(false, &denominator), sum(true, &denominator)];
    let at = |axis: AxisId| {
        let numerator = |i: usize| piece.numerator_lu[i][axis];
        let [n, n_u] = [sum(false, &numerator), sum(true, &numerator)];
        if linear()[axis] { [n / d, (n_u * d - n * d_u) / (d * d)] } else { [n, n_u] }
    };
    [PerAxis::from_fn(|axis| at(axis)[0]), PerAxis::from_fn(|axis| at(axis)[1])]
}

fn piece(end: f64, coefficients: &[[f64; 3]], denominator: [f64; 6]) -> PolynomialPiece {
    let mut numerator_lu = [AxisVector::zero(); 6];
    for (to, from) in numerator_lu.iter_mut().zip(coefficients) {
        *to = vector(from);
    }
    PolynomialPiece { parameter_end_ratio: end, numerator_lu, denominator_ratio: denominator }
}

/// x = (u-c)², y = (u-c)³ + slow (u-c): almost a cusp at c, or one.
fn cusp(c: f64, slow: f64) -> PolynomialPiece {
    let rows = [
        [c * c, -c * c * c - slow * c, 1.0],
        [-2.0 * c, 3.0 * c * c + slow, 0.0],
        [1.0, -3.0 * c, 0.0],
        [0.0, 1.0, 0.0],
    ];
    piece(1.0, &rows, ONE)
}

/// A conic with weights 1, w, 1 far away from the origin.
fn conic(w: f64, away: f64, size: f64) -> PolynomialPiece {
    let points = [[away, away, 0.0], [away + size, away, 0.0], [away + size, away + size, 0.5 * size]];
    let row = |i: usize, x: usize| {
        let (a, b, c) = (points[0][x], w * points[1][x], points[2][x]);
        [a, 2.0 * (b - a), a - 2.0 * b + c][i]
    };
    let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|x| row(i, x)));
    piece(1.0, &rows, [1.0, 2.0 * (w - 1.0), 2.0 * (1.0 - w), 0.0, 0.0, 0.0])
}

fn nasty() -> Vec<(String, Vec<PolynomialPiece>)> {
    let mut cases = Vec::new();
    for slow in [0.0, 1e-9, 1e-6, 1e-4, 1e-2, -1e-3] {
        for c in [0.5, 0.3712, 0.01] {
            cases.push((format!("cusp {c} {slow}"), vec![cusp(c, slow)]));
        }
    }
    for w in [0.01, 0.7, 40.0] {
        for (away, size) in [(0.0, 1.0), (1e3, 10.0), (2e3, 1e-2)] {
            cases.push((format!("conic {w} {away} {size}"), vec![conic(w, away, size)]));
        }
    }
    for seed in 0..20 {
        let mut random = Random::new(seed);
        // A chain of pieces of very different sizes, each from where the last one ended.
        let mut from = AxisVector::zero();
        let mut pieces = Vec::new();
        for _ in 0..[1, 30][seed as usize % 2] {
            let (end, size) = (10f64.powf(random.between(-2.0, 2.0)), 10f64.powf(random.between(-3.0, 2.0)));
            let rows: Vec<[f64; 3]> =
                (0..6).map(|i| [0; 3].map(|_| size * random.between(-1.0, 1.0) / f64::powi(end, i))).collect();
            let mut one = piece(end, &rows, ONE);
            one.numerator_lu[0] = from;
            from = value(&one, end)[0];
            pieces.push(one);
        }
        cases.push((format!("random {seed}"), pieces));
    }
    cases
}

#[test]
fn polynomials_are_measured_to_1e_9_and_say_how_well() {
    for (what, pieces) in nasty() {
        let ends: Vec<f64> = pieces.iter().map(|piece| piece.parameter_end_ratio).collect();
        let (start, end) = (value(&pieces[0], 0.0)[0], value(&pieces[pieces.len() - 1], ends[ends.len() - 1])[0]);
        let geometry = std::sync::Arc::new(PolynomialGeometry { pieces: pieces.clone() });
        let curve = PolynomialCurve::new(PartPoint(start), PartPoint(end), &geometry, &linear());
        let length = curve.length_lu();
        assert!(length > 0.0, "{what}: no length");
        // Far from the origin a quotient is known to its rounding only.
        let noise = 1e-13 * start.norm();
        let bound = curve.length_error_max_lu();
        assert!(bound < 1e-9 * length + noise, "{what}: {:e}", bound / length);
        let mut measured = 0.0;
        for one in &pieces {
            let speed = |u: f64| value(one, u)[1].masked(&linear()).norm();
            let mut before = 0.0;
            for i in 1..=12 {
                let u = one.parameter_end_ratio * f64::from(i) / 12.0;
                measured += adaptive(&speed, before, u, 1e-14 * length, 40);
                before = u;
                let missed = (curve.at(measured).position.0 - value(one, u)[0]).norm();
                // Positions themselves are known to their rounding.
                let rounding = 4e-15 * value(one, u)[0].norm();
                assert!(missed < 1e-9 * length + rounding, "{what}: {missed:e} of {length} at {i}");
            }
        }
        let off = (measured - length).abs();
        assert!(off < 1e-9 * length, "{what}: {:e}", off / length);
        let rounding = 1e-11 * length + 4e-15 * start.norm();
        assert!(off <= curve.length_error_max_lu() + rounding, "{what}: {off:e} beyond the bound");
    }
}

/// Arc length from positions alone: chords, extrapolated twice.
fn chords(curve: &Curve, from: f64, to: f64, n: usize) -> f64 {
    let sum = |n: usize| -> f64 {
        let at = |i: usize| curve.at(from + (to - from) * i as f64 / n as f64).position.0.masked(&linear());
        (0..n).map(|i| (at(i + 1) - at(i)).norm()).sum()
    };
    let [a, b, c] = [n, 2 * n, 4 * n].map(sum);
    let [first, second] = [b + (b - a) / 3.0, c + (c - b) / 3.0];
    second + (second - first) / 15.0
}

#[test]
fn arcs_and_helices_are_measured_by_their_positions() {
    let plane = [AxisId::new(0), AxisId::new(1)];
    for (radius, sweep, pitch, turn_c) in
        [(1.0, 1.0, 0.0, 0.0), (1e-4, -6.0, 1e-5, 0.3), (50.0, 20.0, 7.0, -2.0), (3e3, 1e-4, 0.0, 1.0)]
    {
        let on = |angle: f64| [radius * angle.cos(), radius * angle.sin()];
        let (from, to) = (on(0.4), on(0.4 + sweep));
        let start = PartPoint(vector(&[from[0], from[1], 0.0, 0.0]));
        let end = PartPoint(vector(&[to[0], to[1], pitch, turn_c]));
        let geometry = ArcGeometry { plane, centre_mm: [0.0; 2], radius_mm: radius, sweep_rad: sweep };
        let arc = Curve::from(Arc::new(start, end, &geometry, &linear()));
        // The same circle turned about X.
        let (sin, cos) = f64::sin_cos(0.6);
        let directions = [vector(&[1.0]), vector(&[0.0, cos, sin])];
        let normal = vector(&[0.0, -sin, cos]);
        let place = |xy: [f64; 2], z: f64| directions[0] * xy[0] + directions[1] * xy[1] + normal * z;
        let geometry =
            SpatialArcGeometry { directions, centre_mm: AxisVector::zero(), radius_mm: radius, sweep_rad: sweep };
        let (start, end) = (PartPoint(place(from, 0.0)), PartPoint(place(to, pitch)));
        let tilted = Curve::from(SpatialArc::new(start, end, &geometry, &linear()));
        for curve in [arc, tilted] {
            for [a, b] in [[0.0, 1.0], [0.2, 0.7]] {
                let [from, to] = [a, b].map(|share| share * curve.length_lu());
                let off = chords(&curve, from, to, 1000) / (to - from) - 1.0;
                // A difference of positions of radius r is known to its rounding.
                let rounding = 1e-11 + 1e-14 * radius / curve.length_lu() * 4000.0;
                assert!(off.abs() < rounding, "{radius} {sweep} {pitch}: {off:e}");
            }
        }
    }
}

#[test]
fn published_blends_are_measured_to_1e_9_whatever_their_angle_and_size() {
    for degrees in [0.01, 1.0, 45.0, 90.0, 150.0, 178.8, 179.5, 179.9] {
        for t in [1e-7, 1.0, 1e4] {
            let angle = f64::to_radians(degrees);
            let direction = |angle: f64| vector(&[angle.cos(), angle.sin()]);
            let [u, v] = [direction(0.3), direction(0.3 + angle)];
            let blend = HermiteBlend::new(PartPoint::default(), &u, &v, t, 2.5).expect("a corner");
            // models/local-smoothing.md section 1 with T = 1.
            let speed = |x: f64| {
                let (a, b, c) = ((u + v) * 0.5, u * -2.0 + v * 0.5, u * 2.5);
                (a * (3.0 * x * x) + b * (2.0 * x) + c).norm()
            };
            for x in [0.1, 0.4, 0.499, 0.5, 0.7, 1.0] {
                let first = adaptive(&speed, 0.0, f64::min(x, 0.5), 1e-15, 40);
                let second = if x > 0.5 { adaptive(&speed, 0.5, x, 1e-15, 40) } else { 0.0 };
                let measured = (first + second) * t;
                let off = (blend.arc_length_at_u_lu(x) - measured) / blend.length_lu();
                assert!(off.abs() < 1e-10, "{degrees} deg, T {t}, u {x}: {off:e}");
                let back = blend.arc_length_at_u_lu(blend.u_at(measured)) - measured;
                assert!(back.abs() < 1e-10 * blend.length_lu(), "{degrees} deg, T {t}, u {x}: back {back:e}");
            }
        }
    }
}
