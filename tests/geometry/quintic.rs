//! The curvature-continuous blend from outside: its definition integrated anew, lengths from positions alone, ends, derivatives.

use sollwert::base::{AxisId, AxisVector, PartPoint, PerAxis};
use sollwert::geometry::{Curve, QuinticBlend, QuinticShape};
use std::f64::consts::PI;

const Z: AxisId = AxisId::new(2);
const B: AxisId = AxisId::new(3);

/// Turning angles from almost straight to almost back.
const DEGREES: [f64; 14] = [0.06, 0.5, 1.7, 5.0, 17.0, 30.0, 57.0, 60.0, 90.0, 120.0, 150.0, 170.0, 179.0, 179.9];

fn linear() -> PerAxis<bool> {
    PerAxis::from_fn(|axis| axis.index() < 3)
}

fn vector(components: &[f64]) -> AxisVector {
    PerAxis::from_fn(|axis| components.get(axis.index()).copied().unwrap_or(0.0))
}

fn close(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value:e}, expected {expected:e} +- {tolerance:e}");
}

fn heading(angle_rad: f64) -> AxisVector {
    vector(&[angle_rad.cos(), angle_rad.sin()])
}

fn shape(angle_rad: f64) -> QuinticShape {
    QuinticShape::new(&heading(0.3), &heading(0.3 + angle_rad), &linear()).expect("a corner")
}

fn corner() -> PartPoint {
    PartPoint(vector(&[3.0, -7.0, 1.0]))
}

fn blend(angle_rad: f64, transition_length_mm: f64) -> QuinticBlend {
    shape(angle_rad).blend(corner(), transition_length_mm).expect("a size")
}

/// Composite Simpson: an independent, stupid quadrature.
fn simpson(from: f64, to: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    let h = (to - from) / panels as f64;
    (0..panels)
        .map(|i| {
            let a = from + i as f64 * h;
            h / 6.0 * (f(a) + 4.0 * f(a + 0.5 * h) + f(a + h))
        })
        .sum()
}

/// The direction's angle against the bisector, from the definition.
fn turned(angle_rad: f64, w: f64) -> f64 {
    0.5 * angle_rad * (15.0 * w - 10.0 * w.powi(3) + 3.0 * w.powi(5)) / 8.0
}

#[test]
fn the_blend_is_its_definition_integrated() {
    for degrees in DEGREES {
        let angle = f64::to_radians(degrees);
        let half = angle / 2.0;
        let t = 0.7;
        let blend = blend(angle, t);
        let x_end = simpson(0.0, 1.0, 4000, |w| turned(angle, w).cos());
        let rest = simpson(0.0, 1.0, 4000, |w| (half - turned(angle, w)).sin());
        // The end lies on the line at T: L x(1) = T cos h.
        let l = t * half.cos() / x_end;
        close(blend.length_lu() / (2.0 * l), 1.0, 1e-13, &format!("length at {degrees}"));
        // eps = T D with D = (x sin h - y cos h)/x, and x sin h - y cos h = ∫ sin(h - phi).
        let d = rest / x_end;
        close(shape(angle).deviation_ratio() / d, 1.0, 1e-11, &format!("D at {degrees}"));
        let middle = blend.at(blend.length_lu() / 2.0).position.0 - corner().0;
        close(middle.norm(), t * d, 1e-13, &format!("deviation at {degrees}"));
        for i in 0..=24 {
            let w = f64::from(i) / 12.0 - 1.0;
            let state = blend.at(l * (w + 1.0));
            let phi = turned(angle, w) + 0.3 + half;
            assert!((state.first - heading(phi)).norm() < 1e-12, "direction at {degrees}, {w}");
            let turned_by = |a: f64| turned(angle, a) + 0.3 + half;
            let way = vector(&[
                l * simpson(-1.0, w, 4000, |a| turned_by(a).cos()),
                l * simpson(-1.0, w, 4000, |a| turned_by(a).sin()),
            ]);
            let missed = state.position.0 - (corner().0 - heading(0.3) * t + way);
            assert!(missed.norm() < 3e-14, "position at {degrees}, {w}: {:e}", missed.norm());
        }
    }
}

#[test]
fn deviation_of_small_and_of_great_angles_has_its_limits() {
    for angle in [1e-3, 1e-2] {
        close(shape(angle).deviation_ratio() / (0.3125 * f64::sin(angle / 2.0)), 1.0, angle * angle, "5/16 sin h");
    }
    close(shape(PI - 1e-6).deviation_ratio(), 1.0, 1e-6, "the lines are left at once");
}

/// Arc length from positions alone: chords, extrapolated twice.
fn measured(curve: &QuinticBlend, to: f64) -> f64 {
    let chords = |n: usize| -> f64 {
        let at = |i: usize| curve.at(to * i as f64 / n as f64).position.0;
        (0..n).map(|i| (at(i + 1) - at(i)).norm()).sum()
    };
    let [a, b, c] = [500, 1000, 2000].map(chords);
    let [first, second] = [b + (b - a) / 3.0, c + (c - b) / 3.0];
    second + (second - first) / 15.0
}

#[test]
fn the_parameter_is_arc_length() {
    for degrees in DEGREES {
        for t in [1e-6, 1.0, 1e3] {
            let blend = QuinticBlend::clone(&self::blend(f64::to_radians(degrees), t));
            // Positions near (3, -7) carry 1e-15 of rounding each; a blend at the origin has its own scale.
            let at_origin = shape(f64::to_radians(degrees)).blend(PartPoint::default(), t).expect("a size");
            close(at_origin.length_lu(), blend.length_lu(), 0.0, "wherever it is");
            for part in [1.0, 0.37] {
                let s = part * at_origin.length_lu();
                close(measured(&at_origin, s) / s, 1.0, 1e-10, &format!("{degrees} deg, T {t}, {part} of it"));
            }
        }
    }
}

#[test]
fn ends_have_no_curvature_and_derivatives_are_differences() {
    for degrees in DEGREES {
        let blend = blend(f64::to_radians(degrees), 1.0);
        let length = blend.length_lu();
        for s in [0.0, length] {
            let state = blend.at(s);
            let scale = 1.0 / length;
            assert!(state.second.norm() < 1e-12 * scale, "curvature at the end");
            assert!(state.third.norm() < 1e-11 * scale * scale, "dk/ds at the end");
        }
        assert_eq!(blend.at(0.0).position, blend.start());
        assert_eq!(blend.at(f64::INFINITY).position, blend.end());
        let (step, curve) = (1e-4 * length, Curve::from(blend));
        for i in 1..50 {
            let s = length * f64::from(i) / 50.0;
            let (before, here, after) = (curve.at(s - step), curve.at(s), curve.at(s + step));
            let pairs = [
                (after.position.0 - before.position.0, here.first, 1.0),
                (after.first - before.first, here.second, 1.0 / length),
                (after.second - before.second, here.third, 1.0 / (length * length)),
            ];
            for (order, (difference, derivative, scale)) in pairs.into_iter().enumerate() {
                let error = (difference * (0.5 / step) - derivative).norm() / scale;
                assert!(error < 1e-5, "{degrees} deg: derivative {} at {i}: off by {error:e}", order + 1);
            }
        }
    }
}

#[test]
fn a_blend_in_space_carries_rotary_axes_in_proportion() {
    let incoming = vector(&[0.6, 0.0, 0.8, 0.02]);
    let outgoing = vector(&[0.0, 1.0, 0.0, -0.05]);
    let shape = QuinticShape::new(&incoming, &outgoing, &linear()).expect("a corner");
    let blend = shape.blend(corner(), 2.0).expect("a size");
    assert!((blend.start().0 - (corner().0 - incoming * 2.0)).norm() < 1e-14);
    assert!((blend.end().0 - (corner().0 + outgoing * 2.0)).norm() < 1e-14);
    let normal = vector(&[-0.8, 0.0, 0.6]);
    for i in 0..=100 {
        let s = blend.length_lu() * f64::from(i) / 100.0;
        let state = blend.at(s);
        close(state.first.masked(&linear()).norm(), 1.0, 1e-13, "arc length of the linear axes");
        let from_corner = state.position.0 - corner().0;
        close(from_corner.masked(&linear()).dot(&normal), 0.0, 1e-13, "in the plane");
        // from_corner = a U + b V over the linear axes; X and Z give a, Y gives b.
        let (a, b) = (from_corner[Z] / 0.8, from_corner[AxisId::new(1)]);
        close(from_corner[B], 0.02 * a - 0.05 * b, 1e-14, "B");
        close(state.first[B], 0.02 * state.first[Z] / 0.8 - 0.05 * state.first[AxisId::new(1)], 1e-14, "dB/ds");
    }
    // Direction and curvature of all axes are those of the lines.
    assert!((blend.at(0.0).first - incoming).norm() < 1e-14 && blend.at(0.0).second.norm() < 1e-13);
    assert!((blend.at(f64::INFINITY).first - outgoing).norm() < 1e-14);
}

#[test]
fn parts_are_the_whole() {
    let whole = Curve::from(blend(1.9, 0.4));
    let length = whole.length_lu();
    let part = whole.trimmed(0.2 * length, 0.9 * length).trimmed(0.1 * length, 0.6 * length);
    close(part.length_lu(), 0.5 * length, 1e-15, "length");
    for i in 0..=20 {
        let s = 0.5 * length * f64::from(i) / 20.0;
        let (a, b) = (part.at(s), whole.at(0.3 * length + s));
        assert!((a.position.0 - b.position.0).norm() < 1e-14 && (a.third - b.third).norm() < 1e-9, "{i}");
    }
    assert_eq!(part.start(), part.at(0.0).position);
}

#[test]
fn no_blend_where_there_is_none() {
    let (x, y) = (heading(0.0), heading(1.0));
    assert!(QuinticShape::new(&x, &x, &linear()).is_none());
    assert!(QuinticShape::new(&x, &(x * -1.0), &linear()).is_none());
    assert!(QuinticShape::new(&x, &vector(&[f64::NAN]), &linear()).is_none());
    assert!(QuinticShape::new(&vector(&[1.0]), &vector(&[1.0, 0.0, 0.0, 0.7]), &linear()).is_none());
    for t in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(QuinticShape::new(&x, &y, &linear()).expect("a corner").blend(corner(), t).is_none());
    }
}
