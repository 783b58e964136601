//! Arcs: centres, radii, planes, helices, tolerances. Geometry is checked from outside, on the emitted move.

use crate::nc_machine::{run, xyz};
use proptest::prelude::*;
use sollwert::base::{AxisId, PartPoint};
use sollwert::interpreter::{ArcGeometry, Move, MoveKind};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn arcs(moves: &[Move]) -> Vec<(PartPoint, Move, ArcGeometry)> {
    let mut start = PartPoint::default();
    let mut found = Vec::new();
    for shown in moves {
        if let MoveKind::Arc(arc) = shown.kind {
            found.push((start, shown.clone(), arc));
        }
        start = shown.end;
    }
    found
}

/// Start and end lie on the circle, and the swept angle leads from one to the other.
fn assert_consistent(start: PartPoint, end: PartPoint, arc: &ArcGeometry) {
    let polar = |point: PartPoint| {
        let [u, v] = [point.0[arc.plane[0]] - arc.centre_mm[0], point.0[arc.plane[1]] - arc.centre_mm[1]];
        (u.hypot(v), v.atan2(u))
    };
    let (start_radius, start_angle) = polar(start);
    let (end_radius, end_angle) = polar(end);
    let tolerance = 1e-9 * (1.0 + arc.radius_mm);
    assert!(
        (start_radius - arc.radius_mm).abs() < tolerance && (end_radius - arc.radius_mm).abs() < tolerance,
        "{arc:?}"
    );
    let left = (start_angle + arc.sweep_rad - end_angle).rem_euclid(TAU);
    let angle_tolerance = 1e-6;
    assert!(left < angle_tolerance || TAU - left < angle_tolerance, "{arc:?} leaves {left}");
}

#[test]
fn quarter_half_and_full_circles() {
    let text = "G1 X10 Y0 F1\nG3 X0 Y10 I-10 J0\nG2 X10 Y0 J-10\nG3 X-10 Y0 CR=10\nG2 X-10 Y0 I10\nG3 I10\nG2 X0 Y10 CR=-10\nG3 X10 Y0 I=AC(0) J=AC(0)";
    let result = run(text);
    assert!(result.alarm.is_none(), "{}", result.alarm().render(false));
    let found = arcs(&result.moves);
    let sweeps: Vec<_> = found.iter().map(|(_, _, arc)| arc.sweep_rad / FRAC_PI_2).collect();
    for (sweep, wanted) in sweeps.iter().zip([1.0, -1.0, 2.0, -4.0, 4.0, -3.0, 3.0]) {
        assert!((sweep - wanted).abs() < 1e-9, "{sweeps:?}");
    }
    for (start, shown, arc) in &found {
        assert_consistent(*start, shown.end, arc);
        assert!((arc.radius_mm - 10.0).abs() < 1e-9);
    }
}

#[test]
fn planes_turn_from_their_first_axis_to_their_second() {
    // G18 turns from Z to X, G19 from Y to Z.
    let text = "G1 Z10 F1\nG18 G3 X10 Z0 K-10 I0\nG19 G1 Y10 X0 Z0\nG3 Y0 Z10 J-10 K0";
    let found = arcs(&run(text).moves);
    let axis = AxisId::new;
    assert_eq!((found[0].2.plane, found[1].2.plane), ([axis(2), axis(0)], [axis(1), axis(2)]));
    assert!(found.iter().all(|(_, _, arc)| arc.centre_mm[0].hypot(arc.centre_mm[1]) < 1e-12));
    assert!(found.iter().all(|(_, _, arc)| (arc.sweep_rad - FRAC_PI_2).abs() < 1e-12));
}

#[test]
fn a_helix_moves_the_third_axis_and_turn_adds_circles() {
    let found = arcs(&run("G1 X10 F1\nG3 X10 Y0 Z-5 I-10 TURN=2\nG3 X-10 Z0 I-10 TURN=1").moves);
    assert!((found[0].2.sweep_rad - 3.0 * TAU).abs() < 1e-12 && found[0].1.end.0[AxisId::new(2)] == -5.0);
    assert!((found[1].2.sweep_rad - (PI + TAU)).abs() < 1e-12);
}

#[test]
fn frames_and_inches_apply_to_centres() {
    let found = arcs(
        &run("TRANS X100 Y50\nG1 X10 Y0 F1\nG3 X0 Y10 I=AC(0) J=AC(0)\nG700 TRANS\nG1 X1 Y0\nG2 X0 Y-1 I-1 J0").moves,
    );
    assert_eq!(found[0].2.centre_mm, [100.0, 50.0]);
    assert!((found[1].2.radius_mm - 25.4).abs() < 1e-12);
}

#[test]
fn a_rounded_centre_is_moved_onto_the_circle() {
    // The programmed radii differ by half a micrometre at three digits.
    let found = arcs(&run("G1 X1.732 Y1 F1\nG3 X1 Y1.732 I-1.732 J-1\nG1 X0 Y0\nG3 X1.3 Y1.3005 I0 J1.3").moves);
    assert_eq!(found.len(), 2);
    for (start, shown, arc) in &found {
        assert_consistent(*start, shown.end, arc);
    }
    let [x, y] = found[1].2.centre_mm;
    assert!(x.hypot(y - 1.3) < 5e-4, "the centre moves by less than the rounding: {x} {y}");
}

#[test]
fn wrong_arcs_are_alarms_that_name_both_radii() {
    let cases = [
        ("G1 X10 F1\nG3 X0 Y11 I-10", "E0504", "10.0000 mm at the start, 11.0000 mm at the end"),
        ("G1 X10 F1\nG3 X0 Y10", "E0503", "without centre and without radius"),
        ("G1 X10 F1\nG3 X0 Y10 CR=5", "E0505", "half the way is 7.071 mm"),
        ("G1 X10 F1\nG3 CR=5", "E0505", "full circle"),
        ("G1 X10 F1\nG3 X0 Y10 I-10 CR=10", "E0207", "centre and radius"),
        ("G1 X10 F1 I5", "E0207", "without G2 or G3"),
        ("G2 X2 I1", "E0501", "no F"),
        ("G1 X10 F1\nG3 X9.9999 Y0 I-50", "E0504", "not on the circle"),
    ];
    for (text, code, message) in cases {
        let result = run(text);
        let alarm = result.alarm();
        assert!(alarm.code == code && alarm.message.contains(message), "{text}: {} {}", alarm.code, alarm.message);
    }
}

#[test]
fn the_end_may_miss_by_the_tolerance() {
    assert!(run("G1 X10 F1\nG3 X0 Y10.009 I-10").alarm.is_none());
    assert!(run("G1 X10 F1\nG3 X0 Y10.011 I-10").alarm.is_some());
    // A radius too short by less than the tolerance is a half circle.
    let result = run("G1 X10 F1\nG3 X-10 Y0 CR=9.995");
    let (start, shown, arc) = arcs(&result.moves)[0].clone();
    assert_consistent(start, shown.end, &arc);
    assert!((arc.radius_mm - 10.0).abs() < 1e-9 && (arc.sweep_rad - PI).abs() < 1e-9);
}

#[test]
fn the_axis_across_the_plane_has_no_centre() {
    let result = run("G1 X10 F1\nG3 X0 Y10 I-10 K0\nG2 X10 Y0 J-10 K3");
    assert!(result.alarm.is_none());
    assert_eq!(result.warnings.iter().map(|warning| warning.line()).collect::<Vec<_>>(), [3]);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    /// Arcs given with the three digits of a CAM program are accepted, close, and stay within a micrometre or so of what was meant.
    #[test]
    fn programmed_arcs_close(radius in 0.05_f64..100.0, start in 0.0..TAU, sweep in 0.02_f64..6.2, ccw: bool, by_radius: bool) {
        let at = |angle: f64| [radius * angle.cos(), radius * angle.sin()];
        let signed = if ccw { sweep } else { -sweep };
        let ([xs, ys], [xe, ye]) = (at(start), at(start + signed));
        let g = if ccw { 3 } else { 2 };
        prop_assume!(radius * (TAU - sweep).min(sweep) > 0.5);
        let form = if by_radius {
            format!("CR={:.3}", if sweep > PI { -radius } else { radius })
        } else {
            format!("I{:.3} J{:.3}", -xs, -ys)
        };
        let text = format!("G1 X{xs:.3} Y{ys:.3} F1\nG{g} X{xe:.3} Y{ye:.3} {form}");
        let result = crate::nc_machine::run_bytes(text.as_bytes(), &xyz());
        prop_assert!(result.alarm.is_none(), "{text}\n{}", result.alarm().message);
        let found = arcs(&result.moves);
        let (from, shown, arc) = &found[0];
        assert_consistent(*from, shown.end, arc);
        prop_assert!(arc.sweep_rad.signum() == signed.signum() && arc.sweep_rad.abs() <= TAU + 1e-9);
        if !by_radius {
            // The middle of the arc is where it was meant. A short chord magnifies the rounding of the end points.
            let [xm, ym] = at(start + signed / 2.0);
            let own = (from.0[arc.plane[1]] - arc.centre_mm[1]).atan2(from.0[arc.plane[0]] - arc.centre_mm[0]) + arc.sweep_rad / 2.0;
            let [x, y] = [arc.centre_mm[0] + arc.radius_mm * own.cos(), arc.centre_mm[1] + arc.radius_mm * own.sin()];
            prop_assert!((x - xm).hypot(y - ym) < 0.05 + 0.002, "{text}: off by {}", (x - xm).hypot(y - ym));
        }
    }
}
