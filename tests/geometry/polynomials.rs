//! Splines, polynomials and arcs in any plane, from outside: closed forms, finite differences, exact ends, what is no curve.

use crate::random::Random;
use sollwert::base::{AxisId, AxisVector, PartPoint, PerAxis};
use sollwert::geometry::{Curve, CurveState, PolynomialCurve, SpatialArc};
use sollwert::interpreter::{PolynomialGeometry, PolynomialPiece, SpatialArcGeometry};
use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};
use std::sync::Arc;

const ONE: [f64; 6] = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Three linear axes and a rotary one.
fn linear() -> PerAxis<bool> {
    PerAxis::from_fn(|axis| axis.index() < 3)
}

fn vector(components: &[f64]) -> AxisVector {
    PerAxis::from_fn(|axis| components.get(axis.index()).copied().unwrap_or(0.0))
}

fn close(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value:e}, expected {expected:e} +- {tolerance:e}");
}

/// Coefficients of u^0, u^1, ... as points of the first axes.
fn piece(end: f64, coefficients: &[&[f64]], denominator: [f64; 6]) -> PolynomialPiece {
    let mut numerator_lu = [AxisVector::zero(); 6];
    for (to, from) in numerator_lu.iter_mut().zip(coefficients) {
        *to = vector(from);
    }
    PolynomialPiece { parameter_end_ratio: end, numerator_lu, denominator_ratio: denominator }
}

/// Written out, on purpose another way than Horner's scheme.
fn value(piece: &PolynomialPiece, u: f64) -> AxisVector {
    let power = |i: usize| u.powi(i as i32);
    let numerator = (0..6).fold(AxisVector::zero(), |sum, i| sum + piece.numerator_lu[i] * power(i));
    let d: f64 = (0..6).map(|i| piece.denominator_ratio[i] * power(i)).sum();
    PerAxis::from_fn(|axis| if linear()[axis] { numerator[axis] / d } else { numerator[axis] })
}

fn curve(pieces: Vec<PolynomialPiece>) -> PolynomialCurve {
    let (first, last) = (&pieces[0], &pieces[pieces.len() - 1]);
    let (start, end) = (PartPoint(value(first, 0.0)), PartPoint(value(last, last.parameter_end_ratio)));
    PolynomialCurve::new(start, end, &Arc::new(PolynomialGeometry { pieces }), &linear())
}

/// P0, P1, P2 with weights 1, w, 1.
fn conic([p0, p1, p2]: [[f64; 2]; 3], w: f64) -> PolynomialPiece {
    let bernstein = |i: usize| {
        let (a, b, c) = (p0[i], w * p1[i], p2[i]);
        [a, 2.0 * (b - a), a - 2.0 * b + c]
    };
    let (x, y) = (bernstein(0), bernstein(1));
    let rows: Vec<[f64; 2]> = (0..3).map(|i| [x[i], y[i]]).collect();
    let rows: Vec<&[f64]> = rows.iter().map(|row| &row[..]).collect();
    piece(1.0, &rows, [1.0, 2.0 * (w - 1.0), 2.0 * (1.0 - w), 0.0, 0.0, 0.0])
}

#[test]
fn a_rational_quarter_circle_is_the_circle() {
    let r = 7.0;
    let quarter = curve(vec![conic([[r, 0.0], [r, r], [0.0, r]], SQRT_2 / 2.0)]);
    close(quarter.length_lu(), r * FRAC_PI_2, 1e-12, "length");
    for i in 0..=50 {
        let s = quarter.length_lu() * f64::from(i) / 50.0;
        let (sin, cos) = (s / r).sin_cos();
        let state = quarter.at(s);
        let expected = [
            (state.position.0, [r * cos, r * sin], 1e-12),
            (state.first, [-sin, cos], 1e-12),
            (state.second, [-cos / r, -sin / r], 1e-11),
            (state.third, [sin / r / r, -cos / r / r], 1e-11),
        ];
        for (order, (found, [x, y], tolerance)) in expected.into_iter().enumerate() {
            assert!((found - vector(&[x, y])).norm() < tolerance, "order {order} at {s}: {found:?}");
        }
    }
}

#[test]
fn a_parabola_has_the_length_of_the_closed_form() {
    // y = c x² from 0 to b: b/2 sqrt(1 + 4c²b²) + asinh(2cb)/(4c).
    for (b, c) in [(1.0, 1.0), (100.0, 0.01), (3.0, 50.0), (1e-3, 1e3), (1.0, 1e5)] {
        let parabola = curve(vec![piece(1.0, &[&[0.0, 0.0], &[b, 0.0], &[0.0, c * b * b]], ONE)]);
        let m: f64 = 2.0 * c * b;
        let length = b / 2.0 * (1.0 + m * m).sqrt() + m.asinh() / (4.0 * c);
        close(parabola.length_lu(), length, 1e-11 * length, &format!("length of {c} x² to {b}"));
        // At any x the arc length up to it is the same formula: so the place at that length is x.
        for i in 1..20 {
            let x = b * f64::from(i) / 20.0;
            let m = 2.0 * c * x;
            let s = x / 2.0 * (1.0 + m * m).sqrt() + m.asinh() / (4.0 * c);
            close(parabola.at(s).position.0[AxisId::new(0)], x, 1e-11 * length, "x(s)");
            let bend = 2.0 * c / (1.0 + m * m).powf(1.5);
            close(parabola.at(s).second.norm(), bend, 1e-8 * (1.0 + bend), "curvature");
        }
    }
}

fn check_derivatives(at: &dyn Fn(f64) -> CurveState, length: f64, what: &str) {
    let step = 1e-4 * length;
    for i in 1..40 {
        let s = length * f64::from(i) / 40.0 + 3e-3 * length;
        if s + step > length {
            continue;
        }
        let (before, here, after) = (at(s - step), at(s), at(s + step));
        let pairs = [
            (after.position.0 - before.position.0, here.first),
            (after.first - before.first, here.second),
            (after.second - before.second, here.third),
        ];
        for (order, (difference, derivative)) in pairs.into_iter().enumerate() {
            let error = (difference * (0.5 / step) - derivative).norm();
            let scale = 1e-3 * (1.0 + derivative.norm() + here.third.norm());
            assert!(error < scale, "{what}: derivative {} at s = {s}: off by {error:e}", order + 1);
        }
        close(here.first.masked(&linear()).norm(), 1.0, 1e-9, "unit speed of the linear axes");
    }
}

#[test]
fn derivatives_are_those_of_the_positions() {
    for seed in 0..30 {
        let mut random = Random::new(900 + seed);
        let end = random.between(0.5, 4.0);
        let rows: Vec<Vec<f64>> = (0..6)
            .map(|i| (0..4).map(|_| random.between(-1.0, 1.0) * 5.0 / (1.0 + f64::from(i) * end.powi(i))).collect())
            .collect();
        let mut rows: Vec<&[f64]> = rows.iter().map(|row| &row[..]).collect();
        // Away from cusps: one axis goes on.
        let straight = [20.0, 3.0, 1.0, 0.5];
        rows[1] = &straight;
        let mut denominator = ONE;
        if seed % 2 == 1 {
            denominator[1] = random.between(-0.1, 0.2) / end;
            denominator[2] = random.between(-0.1, 0.2) / end / end;
        }
        let piece = piece(end, &rows, denominator);
        let curve = curve(vec![piece.clone()]);
        check_derivatives(&|s| curve.at(s), curve.length_lu(), &format!("seed {seed}"));
        assert_eq!(curve.at(0.0).position, PartPoint(value(&piece, 0.0)));
        assert_eq!(curve.at(curve.length_lu()).position, PartPoint(value(&piece, end)));
        // Simpson on differences of positions: an independent length.
        let n = 20_000;
        let points: Vec<AxisVector> = (0..=n).map(|i| value(&piece, end * f64::from(i) / f64::from(n))).collect();
        let chords: f64 = points.windows(2).map(|pair| (pair[1] - pair[0]).masked(&linear()).norm()).sum();
        let coarse: f64 = points
            .iter()
            .step_by(2)
            .zip(points.iter().skip(2).step_by(2))
            .map(|(a, b)| (*b - *a).masked(&linear()).norm())
            .sum();
        // Chords are too short by c h²: Richardson's extrapolation leaves h⁴.
        let length = chords + (chords - coarse) / 3.0;
        close(curve.length_lu(), length, 1e-9 * length, &format!("length, seed {seed}"));
    }
}

#[test]
fn parts_are_the_whole_between_their_ends() {
    let rows: [&[f64]; 4] =
        [&[0.0, 1.0, 2.0, 0.1], &[10.0, 0.0, 3.0, 0.2], &[0.0, 8.0, 0.0, 0.0], &[-3.0, 1.0, 1.0, 0.3]];
    let whole = Curve::from(curve(vec![piece(1.5, &rows, ONE)]));
    let length = whole.length_lu();
    for (from, to) in [(0.0, 0.4), (0.2, 0.9), (0.5, 1.0), (0.123, 0.124)] {
        let part = whole.trimmed(from * length, to * length).trimmed(0.0, f64::INFINITY);
        close(part.length_lu(), (to - from) * length, 1e-14 * length, "length of a part");
        for i in 0..=10 {
            let s = part.length_lu() * f64::from(i) / 10.0;
            let (own, of_whole) = (part.at(s), whole.at(from * length + s));
            assert!((own.position.0 - of_whole.position.0).norm() < 1e-12, "{from} to {to}");
            assert!((own.third - of_whole.third).norm() < 1e-8 * (1.0 + own.third.norm()), "{from} to {to}");
        }
        let again = part.trimmed(0.25 * part.length_lu(), 0.75 * part.length_lu());
        let place = from * length + 0.5 * part.length_lu();
        assert!((again.at(0.5 * again.length_lu()).position.0 - whole.at(place).position.0).norm() < 1e-12);
    }
    // Parts that meet meet to the last bit.
    let (left, right) = (whole.trimmed(0.0, 3.0), whole.trimmed(3.0, length));
    assert_eq!(left.end(), right.start());
    assert_eq!((left.start(), right.end()), (whole.start(), whole.end()));
}

#[test]
fn a_cusp_is_a_break_and_has_numbers_beside_it() {
    // x = t², y = t³ for t = u - 1: length ((4 + 9t²)^1.5 - 8)/27 on each side.
    let rows: [&[f64]; 4] = [&[1.0, -1.0], &[-2.0, 3.0], &[1.0, -3.0], &[0.0, 1.0]];
    let cusp = curve(vec![piece(2.0, &rows, ONE)]);
    let side = (13.0_f64.powf(1.5) - 8.0) / 27.0;
    close(cusp.length_lu(), 2.0 * side, 1e-10, "length");
    let breaks = cusp.breaks_lu();
    assert_eq!(breaks.len(), 1, "{breaks:?}");
    close(breaks[0], side, 1e-10, "place of the cusp");
    for s in [0.0, side - 1e-6, side - 1e-12, breaks[0], side + 1e-12, side + 0.1, 2.0 * side] {
        let state = cusp.at(s);
        for values in [state.position.0, state.first, state.second, state.third] {
            assert!(values.as_slice().iter().all(|v| v.is_finite()), "at {s}");
        }
        close(state.first.norm(), 1.0, 1e-9, "unit speed");
    }
    let whole = Curve::from(cusp);
    let (left, right) = (whole.trimmed(0.0, breaks[0]), whole.trimmed(breaks[0], f64::INFINITY));
    let (into, out_of) = (left.at(f64::INFINITY).first, right.at(0.0).first);
    assert!((into + out_of).norm() < 0.01, "the direction turns round: {into:?} {out_of:?}");
    // At an end it is the same: from rest, x = u², y = u³.
    let from_rest = curve(vec![piece(1.0, &[&[0.0], &[0.0], &[1.0], &[0.0, 1.0]], ONE)]);
    close(from_rest.length_lu(), side, 1e-10, "length from a cusp");
    assert!(from_rest.at(0.0).third.norm().is_finite());
    assert!(from_rest.breaks_lu().is_empty());
}

#[test]
fn pieces_follow_each_other_and_steps_are_told() {
    // Two lines with a corner, then a smooth piece of the same cubic cut in two.
    let corner = curve(vec![piece(1.0, &[&[0.0], &[3.0]], ONE), piece(2.0, &[&[3.0, 0.0], &[0.0, 2.0]], ONE)]);
    close(corner.length_lu(), 7.0, 1e-12, "two lines");
    assert_eq!(corner.breaks_lu(), [3.0]);
    assert!((corner.at(5.0).position.0 - vector(&[3.0, 2.0])).norm() < 1e-12);
    let rows: [&[f64]; 4] = [&[0.0, 0.0], &[10.0, 0.0], &[0.0, 8.0], &[0.0, -4.0]];
    // The same at u + 1.
    let later: [&[f64]; 4] = [&[10.0, 4.0], &[10.0, 4.0], &[0.0, -4.0], &[0.0, -4.0]];
    let (whole, two) =
        (curve(vec![piece(2.0, &rows, ONE)]), curve(vec![piece(1.0, &rows, ONE), piece(1.0, &later, ONE)]));
    close(two.length_lu(), whole.length_lu(), 1e-10, "cut in two");
    assert!(two.breaks_lu().is_empty());
    for i in 0..=20 {
        let s = whole.length_lu() * f64::from(i) / 20.0;
        assert!((whole.at(s).position.0 - two.at(s).position.0).norm() < 1e-9);
    }
}

#[test]
fn what_does_not_move_or_is_no_curve_is_told_by_its_length() {
    let still = curve(vec![piece(1.0, &[&[1.0, 2.0, 3.0, 4.0]], ONE)]);
    assert_eq!(still.length_lu(), 0.0);
    assert_eq!(still.at(0.5).position, PartPoint(vector(&[1.0, 2.0, 3.0, 4.0])));
    // Only the rotary axis: 0.5 u + u², in rad.
    let rotary = curve(vec![piece(1.0, &[&[1.0], &[0.0, 0.0, 0.0, 0.5], &[0.0, 0.0, 0.0, 1.0]], ONE)]);
    assert!(rotary.rotary_only());
    close(rotary.length_lu(), 1.5, 1e-12, "rad");
    close(rotary.at(0.5).position.0[AxisId::new(3)], 0.5, 1e-12, "the angle is the length");
    let refused = [
        // The rotary axis would jump where the linear ones rest.
        vec![piece(1.0, &[&[0.0], &[1.0]], ONE), piece(1.0, &[&[1.0], &[0.0, 0.0, 0.0, 1.0]], ONE)],
        // A pole in the middle.
        vec![piece(1.0, &[&[1.0, 1.0], &[1.0]], [1.0, -2.0, 0.0, 0.0, 0.0, 0.0])],
        vec![piece(1.0, &[&[f64::NAN], &[1.0]], ONE), piece(1.0, &[&[0.0], &[f64::NAN]], ONE)],
        vec![piece(f64::INFINITY, &[&[0.0], &[1.0]], ONE)],
        vec![piece(0.0, &[&[0.0], &[1.0]], ONE), piece(1.0, &[&[0.0], &[1.0]], ONE)],
        vec![piece(1.0, &[&[0.0], &[1e200], &[1e300]], ONE)],
    ];
    for (case, pieces) in refused.into_iter().enumerate() {
        let curve = curve(pieces);
        assert!(!curve.length_lu().is_finite(), "case {case}: {}", curve.length_lu());
        for s in [0.0, 1.0, f64::NAN, f64::INFINITY] {
            let _ = Curve::from(curve.clone()).trimmed(s, 2.0).at(s);
        }
    }
}

#[test]
fn an_arc_in_any_plane_is_the_turned_circle() {
    // The plane of (1, 1, 0)/√2 and (-1, 1, 2)/√6, normal (1, -1, 1)/√3.
    let (d1, d2) = (vector(&[1.0, 1.0, 0.0]) * (1.0 / SQRT_2), vector(&[-1.0, 1.0, 2.0]) * (1.0 / 6.0_f64.sqrt()));
    let normal = vector(&[1.0, -1.0, 1.0]) * (1.0 / 3.0_f64.sqrt());
    let (centre, r, sweep, pitch) = (vector(&[3.0, -1.0, 2.0]), 5.0, -2.5 * PI, 1.2);
    let rotary = vector(&[0.0, 0.0, 0.0, 0.7]);
    // From the angle 0.4, with the rotary axis and the way along the normal in step with the angle.
    let expected = |share: f64| {
        let angle = 0.4 + sweep * share;
        centre + (d1 * angle.cos() + d2 * angle.sin()) * r + normal * (pitch * share) + rotary * share
    };
    let geometry = SpatialArcGeometry { directions: [d1, d2], centre_mm: centre, radius_mm: r, sweep_rad: sweep };
    let arc = SpatialArc::new(PartPoint(expected(0.0)), PartPoint(expected(1.0)), &geometry, &linear());
    close(arc.length_lu(), (r * sweep).hypot(pitch), 1e-12, "length of the helix");
    for i in 0..=40 {
        let share = f64::from(i) / 40.0;
        let at = arc.at(share * arc.length_lu());
        assert!((at.position.0 - expected(share)).norm() < 1e-12, "{share}");
    }
    check_derivatives(&|s| arc.at(s), arc.length_lu(), "spatial arc");
    let whole = Curve::from(arc);
    let part = whole.trimmed(4.0, 21.0);
    for s in [0.0, 3.0, 17.0] {
        assert!((part.at(s).position.0 - whole.at(4.0 + s).position.0).norm() < 1e-12);
        assert!((part.at(s).third - whole.at(4.0 + s).third).norm() < 1e-12);
    }
    // Nothing to do, and only the rotary axis.
    let dot = SpatialArcGeometry { radius_mm: 0.0, sweep_rad: 0.0, ..geometry };
    let here = PartPoint(centre);
    assert_eq!(SpatialArc::new(here, here, &dot, &linear()).length_lu(), 0.0);
    let turned = SpatialArc::new(here, PartPoint(centre + rotary), &dot, &linear());
    assert!(turned.rotary_only());
    close(turned.length_lu(), 0.7, 1e-12, "rad");
}
