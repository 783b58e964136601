//! Curves from outside: closed forms, independent quadrature, finite differences, exact ends.

use sollwert::base::{AxisId, AxisVector, PartPoint, PerAxis};
use sollwert::geometry::{Arc, Curve, HermiteBlend, Line};
use sollwert::interpreter::ArcGeometry;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const X: AxisId = AxisId::new(0);
const Y: AxisId = AxisId::new(1);
const Z: AxisId = AxisId::new(2);
const B: AxisId = AxisId::new(3);

/// Three linear axes and a rotary one.
fn linear() -> PerAxis<bool> {
    PerAxis::from_fn(|axis| axis.index() < 3)
}

fn vector(components: &[f64]) -> AxisVector {
    PerAxis::from_fn(|axis| components.get(axis.index()).copied().unwrap_or(0.0))
}

fn point(components: &[f64]) -> PartPoint {
    PartPoint(vector(components))
}

/// Blend in XY with its bisector along no axis.
fn blend(angle_rad: f64, transition_length_mm: f64, alpha_ratio: f64) -> HermiteBlend {
    let direction = |angle_rad: f64| vector(&[angle_rad.cos(), angle_rad.sin()]);
    let corner = point(&[3.0, -7.0, 1.0]);
    HermiteBlend::new(corner, &direction(0.3), &direction(0.3 + angle_rad), transition_length_mm, alpha_ratio)
        .expect("a corner")
}

/// Composite Simpson on `panels` panels: an independent, stupid quadrature.
fn simpson(from: f64, to: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    let h = (to - from) / panels as f64;
    (0..panels)
        .map(|i| {
            let a = from + i as f64 * h;
            h / 6.0 * (f(a) + 4.0 * f(a + 0.5 * h) + f(a + h))
        })
        .sum()
}

fn close(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value:e}, expected {expected:e} +- {tolerance:e}");
}

/// The Hermite cubic as printed (models/local-smoothing.md section 1), from its coefficients: S and S' at u.
fn printed(blend: &HermiteBlend, angle_rad: f64, u: f64) -> (AxisVector, AxisVector) {
    let (t, alpha) = (blend.transition_length_mm(), blend.alpha_ratio());
    let direction = |angle_rad: f64| vector(&[angle_rad.cos(), angle_rad.sin()]);
    let (incoming, outgoing) = (direction(0.3), direction(0.3 + angle_rad));
    let a = (incoming + outgoing) * ((alpha - 2.0) * t);
    let b = (incoming * (3.0 - 2.0 * alpha) + outgoing * (3.0 - alpha)) * t;
    let c = incoming * (alpha * t);
    let s = blend.corner().0 - incoming * t + c * u + b * (u * u) + a * (u * u * u);
    (s, c + b * (2.0 * u) + a * (3.0 * u * u))
}

#[test]
fn blend_has_the_closed_forms_of_the_model() {
    for alpha in [1.5, 2.0, 2.5, 2.9] {
        for angle in [0.001, 0.2, 1.0, FRAC_PI_2, 2.0, 3.0] {
            let (t, half) = (0.7, angle / 2.0);
            let blend = blend(angle, t, alpha);
            let (start, middle) = (blend.shape(0.0), blend.shape(0.5));
            let near =
                |value: f64, expected: f64, what: &str| close(value, expected, 1e-12 * (1.0 + expected.abs()), what);
            near(start.sigma_mm, alpha * t, "sigma(0)");
            near(middle.sigma_mm, (3.0 - alpha / 2.0) * t * half.cos(), "sigma(1/2)");
            near(start.curvature_per_mm, (6.0 - 2.0 * alpha) * angle.sin() / (alpha * alpha * t), "k(0)");
            let mid = 2.0 * alpha * half.sin() / (t * (3.0 - alpha / 2.0).powi(2) * half.cos().powi(2));
            near(middle.curvature_per_mm, mid, "k(1/2)");
            near(middle.curvature_slope_per_mm_mm, 0.0, "dk/ds(1/2)");
            // T = 8 eps / ((4 - alpha)|V - U|) makes the mid-point deviation eps.
            let epsilon = t * (4.0 - alpha) * 2.0 * half.sin() / 8.0;
            let at_middle = blend.at(blend.length_lu() / 2.0).position.0;
            near((at_middle - blend.corner().0).norm(), epsilon, "deviation in the middle");
        }
    }
}

#[test]
fn blend_is_the_printed_cubic() {
    for angle in [0.01, 0.7, 1.9, 2.9] {
        let blend = blend(angle, 0.35, 2.5);
        for i in 0..=40 {
            let u = i as f64 / 40.0;
            let (s, first) = printed(&blend, angle, u);
            let state = blend.at(blend.arc_length_at_u_lu(u));
            assert!((state.position.0 - s).norm() < 1e-13, "angle {angle}, u {u}");
            assert!((state.first - first * (1.0 / first.norm())).norm() < 1e-11, "angle {angle}, u {u}");
            close(blend.shape(u).sigma_mm, first.norm(), 1e-13, "sigma");
            close(blend.u_at(blend.arc_length_at_u_lu(u)), u, 1e-12, "u(s(u))");
        }
    }
}

#[test]
fn arc_length_agrees_with_an_independent_quadrature() {
    // Simpson with panels so fine that its own error is below 1e-13 for the sharpest corner taken here.
    for degrees in [0.1, 1.0, 30.0, 90.0, 120.0, 150.0, 170.0, 178.0, 178.8] {
        let angle = f64::to_radians(degrees);
        let blend = blend(angle, 1.0, 2.5);
        let sigma = |u: f64| printed(&blend, angle, u).1.norm();
        let half = simpson(0.0, 0.5, 40_000, sigma);
        close(blend.length_lu(), 2.0 * half, 2e-12, &format!("length at {degrees} deg"));
        for u in [0.1, 0.37, 0.49, 0.4999, 0.51, 0.8] {
            let s = simpson(0.0, f64::min(u, 0.5), 40_000, sigma) + simpson(0.5, f64::max(u, 0.5), 40_000, sigma);
            close(blend.arc_length_at_u_lu(u), s, 2e-12, &format!("s({u}) at {degrees} deg"));
            let back = blend.arc_length_at_u_lu(blend.u_at(s));
            close(back, s, 1e-12, &format!("s(u(s)) at {degrees} deg"));
        }
    }
}

/// Central differences of position, first and second derivative against first, second and third.
fn check_derivatives(curve: &Curve, step: f64, tolerance: f64, what: &str) {
    let length = curve.length_lu();
    for i in 1..40 {
        let s = step + (length - 2.0 * step) * i as f64 / 40.0;
        let (before, here, after) = (curve.at(s - step), curve.at(s), curve.at(s + step));
        let pairs = [
            (after.position.0 - before.position.0, here.first),
            (after.first - before.first, here.second),
            (after.second - before.second, here.third),
        ];
        for (order, (difference, derivative)) in pairs.into_iter().enumerate() {
            let error = (difference * (0.5 / step) - derivative).norm();
            let scale = 1.0 + derivative.norm();
            assert!(error < tolerance * scale, "{what}: derivative {} at s = {s}: off by {error:e}", order + 1);
        }
    }
}

#[test]
fn derivatives_agree_with_finite_differences() {
    for degrees in [0.5, 20.0, 60.0, 90.0, 130.0] {
        let curve = Curve::from(blend(f64::to_radians(degrees), 1.0, 2.5));
        check_derivatives(&curve, 1e-5, 1e-4, &format!("blend {degrees} deg"));
    }
    let helix = ArcGeometry { plane: [X, Y], centre_mm: [1.0, 2.0], radius_mm: 5.0, sweep_rad: -4.0 };
    let end = point(&[1.0 + 5.0 * f64::cos(-4.0), 2.0 + 5.0 * f64::sin(-4.0), 3.0, 0.4]);
    let arc = Arc::new(point(&[6.0, 2.0, 0.0, 0.0]), end, &helix, &linear());
    check_derivatives(&Curve::from(arc), 1e-4, 1e-7, "helix");
    let line = Line::new(point(&[1.0, 2.0, 3.0, 4.0]), point(&[-3.0, 5.0, 9.0, 4.5]), &linear());
    check_derivatives(&Curve::Line(line), 1e-4, 1e-9, "line");
}

#[test]
fn shape_derivatives_agree_with_finite_differences() {
    for degrees in [5.0, 60.0, 120.0] {
        let (blend, h) = (blend(f64::to_radians(degrees), 0.4, 2.5), 1e-5);
        for i in 1..20 {
            let u = i as f64 / 20.0;
            let (before, here, after) = (blend.shape(u - h), blend.shape(u), blend.shape(u + h));
            let central = |a: f64, b: f64| (b - a) / (2.0 * h);
            let first = central(before.sigma_mm, after.sigma_mm);
            close(here.sigma_first_mm, first, 1e-6, "sigma'");
            let second = central(before.sigma_first_mm, after.sigma_first_mm);
            close(here.sigma_second_mm, second, 1e-5 * (1.0 + second.abs()), "sigma''");
            let slope = central(before.curvature_per_mm, after.curvature_per_mm) / here.sigma_mm;
            close(here.curvature_slope_per_mm_mm, slope, 1e-5 * (1.0 + slope.abs()), "dk/ds");
            let turn = (after.tangent - before.tangent) * (0.5 / h) * (1.0 / here.sigma_mm);
            close((turn - here.normal * here.curvature_per_mm).norm(), 0.0, 1e-5 * (1.0 + turn.norm()), "dT/ds = k N");
        }
    }
}

#[test]
fn curvature_slope_peaks_where_the_model_says() {
    // models/local-smoothing.md section 3: peak over its value at u = 0, and where.
    for (degrees, ratio, place) in [(10.0, 2.2, 0.26), (30.0, 2.5, 0.29), (60.0, 4.1, 0.32), (90.0, 10.8, 0.37)] {
        let blend = blend(f64::to_radians(degrees), 1.0, 2.5);
        let at_start = blend.shape(0.0).curvature_slope_per_mm_mm.abs();
        let (peak, u) = (0..=1000)
            .map(|i| i as f64 / 2000.0)
            .map(|u| (blend.shape(u).curvature_slope_per_mm_mm.abs(), u))
            .fold((0.0, 0.0), |best, here| if here.0 > best.0 { here } else { best });
        close(peak / at_start, ratio, 0.06, &format!("ratio at {degrees} deg"));
        close(u, place, 0.02, &format!("place at {degrees} deg"));
    }
}

#[test]
fn blend_works_in_space() {
    // U and V in no coordinate plane: the curve must stay in their plane and be symmetric about W.
    let incoming = vector(&[2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0]);
    let outgoing = vector(&[-1.0 / 3.0, 2.0 / 3.0, -2.0 / 3.0]);
    let corner = point(&[100.0, 200.0, 300.0]);
    let blend = HermiteBlend::new(corner, &incoming, &outgoing, 0.5, 2.5).expect("a corner");
    let normal = vector(&[-2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0]);
    let length = blend.length_lu();
    for i in 0..=100 {
        let s = length * i as f64 / 100.0;
        let (state, mirrored) = (blend.at(s), blend.at(length - s));
        close((state.position.0 - corner.0).dot(&normal), 0.0, 1e-12, "in the plane");
        close(state.first.norm(), 1.0, 1e-14, "unit tangent");
        let difference = (state.position.0 - corner.0).norm() - (mirrored.position.0 - corner.0).norm();
        close(difference, 0.0, 1e-12, "symmetric");
    }
    assert!((blend.at(0.0).first - incoming).norm() < 1e-13);
    assert!((blend.at(length).first - outgoing).norm() < 1e-13);
    close(blend.angle_rad(), incoming.dot(&outgoing).acos(), 1e-14, "angle");
}

#[test]
fn ends_are_exact_and_parts_fit() {
    let start = point(&[0.1, 0.2, 0.3, 0.4]);
    let end = point(&[10.3, -7.7, 1.1, 2.2]);
    let radius = f64::hypot(10.2, 7.9) / 2.0;
    let half = ArcGeometry { plane: [X, Y], centre_mm: [5.2, -3.75], radius_mm: radius, sweep_rad: PI };
    let curves = [
        Curve::Line(Line::new(start, end, &linear())),
        Curve::from(Arc::new(start, end, &half, &linear())),
        Curve::from(blend(1.2, 0.3, 2.5)),
    ];
    for curve in &curves {
        let length = curve.length_lu();
        assert_eq!(curve.at(0.0).position, curve.start());
        assert_eq!(curve.at(length).position, curve.end());
        assert_eq!(curve.at(-1.0), curve.at(0.0));
        assert_eq!(curve.at(length + 1.0), curve.at(length));
        assert_eq!(&curve.trimmed(0.0, length), curve);
        let (a, b) = (0.3 * length, 0.85 * length);
        let part = curve.trimmed(a, b);
        close(part.length_lu(), b - a, 1e-12, "length of a part");
        assert_eq!(part.at(0.0).position, part.start());
        assert_eq!(part.at(part.length_lu()).position, part.end());
        for i in 0..=20 {
            let s = part.length_lu() * i as f64 / 20.0;
            let (inside, whole) = (part.at(s), curve.at(a + s));
            assert!((inside.position.0 - whole.position.0).norm() < 1e-12, "{curve:?} at {s}");
            assert!((inside.first - whole.first).norm() < 1e-10);
            assert!((inside.third - whole.third).norm() < 1e-8 * (1.0 + whole.third.norm()));
        }
        // The end is approached without a jump, and a part of a part is a part.
        let near = (curve.at(length * (1.0 - 1e-12)).position.0 - curve.end().0).norm();
        assert!(near < 1e-10, "a jump of {near:e} at the end");
        let again = part.trimmed(0.1 * length, 0.2 * length);
        assert!((again.start().0 - curve.at(0.4 * length).position.0).norm() < 1e-12);
    }
    assert_eq!(curves[0].start(), start);
    assert_eq!(curves[0].end(), end);
    assert_eq!(curves[1].start(), start);
    assert_eq!(curves[1].end(), end);
}

#[test]
fn helix_and_full_circle() {
    // Two turns, radius 3, pitch 5 a turn, rotary axis carried along.
    let (radius, rise) = (3.0, 10.0);
    let helix = ArcGeometry { plane: [X, Y], centre_mm: [10.0, 0.0], radius_mm: radius, sweep_rad: 2.0 * TAU };
    let (start, end) = (point(&[13.0, 0.0, 1.0, 0.5]), point(&[13.0, 0.0, 11.0, 1.5]));
    let arc = Arc::new(start, end, &helix, &linear());
    let in_plane = radius * 2.0 * TAU;
    close(arc.length_lu(), f64::hypot(in_plane, rise), 1e-12, "length");
    let pitch = rise / (2.0 * TAU);
    close(arc.curvature_per_mm(), radius / (radius * radius + pitch * pitch), 1e-15, "curvature");
    for i in 0..=64 {
        let share = i as f64 / 64.0;
        let state = arc.at(arc.length_lu() * share);
        let angle = 2.0 * TAU * share;
        let expected = vector(&[10.0 + radius * angle.cos(), radius * angle.sin(), 1.0 + rise * share, 0.5 + share]);
        assert!((state.position.0 - expected).norm() < 1e-12, "at {share}");
        let speed = state.first.masked(&linear()).norm();
        close(speed, 1.0, 1e-12, "unit speed of the linear axes");
        close(state.second.norm(), arc.curvature_per_mm(), 1e-13, "curvature");
    }
    // A full circle clockwise in the Z-X plane (G18), end = start.
    let circle = ArcGeometry { plane: [Z, X], centre_mm: [0.0, -4.0], radius_mm: 4.0, sweep_rad: -TAU };
    let at = point(&[0.0, 9.0, 0.0]);
    let arc = Arc::new(at, at, &circle, &linear());
    close(arc.length_lu(), TAU * 4.0, 1e-13, "circumference");
    close(arc.signed_curvature_per_mm(), -0.25, 1e-15, "sense");
    let quarter = arc.at(arc.length_lu() / 4.0);
    // From the top (Z = 0, X = centre + 4) clockwise, that is from the second axis towards the first: to Z = +4.
    assert!((quarter.position.0 - vector(&[-4.0, 9.0, 4.0])).norm() < 1e-12);
}

#[test]
fn arc_meets_ends_that_miss_the_circle() {
    // End point 0.4 µm off the circle, as a post-processor with three decimals writes it.
    let geometry = ArcGeometry { plane: [X, Y], centre_mm: [0.0, 0.0], radius_mm: 10.0, sweep_rad: FRAC_PI_2 };
    let end = point(&[0.0003, 10.0002]);
    let arc = Arc::new(point(&[10.0001, 0.0]), end, &geometry, &linear());
    assert_eq!(arc.at(arc.length_lu()).position, end);
    let step = arc.length_lu() * 1e-9;
    let jump = (end.0 - arc.at(arc.length_lu() - step).position.0).norm();
    close(jump, step, 1e-12, "no jump at the end");
    check_derivatives(&Curve::from(arc), 1e-4, 1e-7, "arc beside its circle");
}

#[test]
fn rotary_axes_are_carried_along() {
    let mixed = Line::new(point(&[0.0, 0.0, 0.0, 0.0]), point(&[3.0, 4.0, 0.0, 1.0]), &linear());
    assert!(!mixed.rotary_only());
    close(mixed.length_lu(), 5.0, 1e-15, "rotary travel does not count");
    close(mixed.direction()[B], 0.2, 1e-16, "rad per mm");
    let only = Line::new(point(&[1.0, 1.0, 1.0, 0.0]), point(&[1.0, 1.0, 1.0, -2.0]), &linear());
    assert!(only.rotary_only());
    close(only.length_lu(), 2.0, 0.0, "rad");
    close(only.direction()[B], -1.0, 0.0, "unit speed");
    // Rounding noise of a linear axis must not become the path length.
    let noise = Line::new(point(&[0.3, 0.0, 0.0, 0.0]), point(&[0.1 + 0.2, 0.0, 0.0, 1.0]), &linear());
    assert!(noise.rotary_only());
    assert_eq!(noise.end(), point(&[0.1 + 0.2, 0.0, 0.0, 1.0]));
}

#[test]
fn degenerate_input_gives_no_nan() {
    let here = point(&[1.0, 2.0, 3.0, 4.0]);
    let dot = ArcGeometry { plane: [X, Y], centre_mm: [1.0, 2.0], radius_mm: 0.0, sweep_rad: 0.0 };
    let tiny = point(&[1.0, 2.0 + 1e-15, 3.0, 4.0]);
    let curves = [
        Curve::Line(Line::new(here, here, &linear())),
        Curve::Line(Line::new(here, tiny, &linear())),
        Curve::Line(Line::new(point(&[0.0]), point(&[1e-300]), &linear())),
        Curve::Line(Line::new(point(&[-1e300]), point(&[1e300, 1e300]), &linear())),
        Curve::from(Arc::new(here, here, &dot, &linear())),
        Curve::from(Arc::new(here, here, &ArcGeometry { sweep_rad: TAU, ..dot }, &linear())),
        Curve::from(Arc::new(here, point(&[1.0, 2.0, 9.0, 4.0]), &dot, &linear())),
        Curve::from(Arc::new(here, point(&[1.0, 2.0, 3.0, 5.0]), &dot, &linear())),
        Curve::from(blend(1e-6, 1e-9, 2.5)),
        Curve::from(blend(PI - 1e-6, 1e6, 2.5)),
    ];
    for curve in &curves {
        let length = curve.length_lu();
        assert!(length.is_finite() && length >= 0.0, "{curve:?}");
        for s in [0.0, 0.3 * length, length, -1.0, f64::INFINITY, f64::NAN] {
            let state = curve.trimmed(s, length).at(s);
            for values in [state.position.0, state.first, state.second, state.third] {
                assert!(values.as_slice().iter().all(|v| v.is_finite()), "{curve:?} at {s}: {values:?}");
            }
        }
    }
    let (x, back) = (vector(&[1.0]), vector(&[-1.0]));
    assert!(HermiteBlend::new(here, &x, &x, 1.0, 2.5).is_none());
    assert!(HermiteBlend::new(here, &x, &back, 1.0, 2.5).is_none());
    let y = vector(&[0.0, 1.0]);
    for t in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(HermiteBlend::new(here, &x, &y, t, 2.5).is_none());
    }
    for alpha in [0.0, 4.0, f64::NAN] {
        assert!(HermiteBlend::new(here, &x, &y, 1.0, alpha).is_none());
    }
}
