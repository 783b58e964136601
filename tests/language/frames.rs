//! Frames: what a program with TRANS, ROT, SCALE, MIRROR and zero offsets comes to, by hand-derived positions.

use crate::nc_machine::{run, run_bytes, xyzbc};
use sollwert::base::{AxisId, AxisVector, PerAxis};
use sollwert::interpreter::{Component, Frame, GeometryAxes, MoveKind};
use std::f64::consts::PI;

/// The end of the last move in X, Y, Z.
fn end(text: &str) -> [f64; 3] {
    let result = run(text);
    assert!(result.alarm.is_none(), "{text}: {}", result.alarm().render(false));
    let end = result.moves.last().unwrap().end.0;
    [0, 1, 2].map(|index| end[AxisId::new(index)])
}

fn assert_end(text: &str, expected_mm: [f64; 3]) {
    let end_mm = end(text);
    for (a, b) in end_mm.iter().zip(expected_mm) {
        assert!((a - b).abs() < 1e-9, "{text}: {end_mm:?}, expected {expected_mm:?}");
    }
}

#[test]
fn a_quarter_turn_about_each_axis() {
    // About Z, X goes to Y and Y to -X; about X, Y goes to Z; about Y, Z goes to X.
    assert_end("ROT Z90\nG0 X10 Y2 Z3", [-2.0, 10.0, 3.0]);
    assert_end("ROT X90\nG0 X10 Y2 Z3", [10.0, -3.0, 2.0]);
    assert_end("ROT Y90\nG0 X10 Y2 Z3", [3.0, 2.0, -10.0]);
    assert_end("G17 ROT RPL=90\nG0 X10 Y2 Z3", [-2.0, 10.0, 3.0]);
    assert_end("G18\nROT RPL=90\nG0 X10 Y2 Z3", [3.0, 2.0, -10.0]);
    assert_end("G19\nROT RPL=90\nG0 X10 Y2 Z3", [10.0, -3.0, 2.0]);
}

#[test]
fn three_angles_turn_about_z_then_the_new_y_then_the_new_x() {
    // R_z(90) R_y(90) of e_x: R_y takes it to -e_z, R_z leaves it there. The other order would end at +Y.
    assert_end("ROT Y90 Z90\nG0 X10", [0.0, 0.0, -10.0]);
    // R_z(90) R_x(90) of e_y: R_x takes it to e_z.
    assert_end("ROT X90 Z90\nG0 Y10", [0.0, 0.0, 10.0]);
    // One after another inside the other is the same.
    let at_once = end("ROT X20 Y30 Z40\nG0 X10 Y20 Z-30");
    assert_end("ROT Z40\nAROT Y30\nAROT X20\nG0 X10 Y20 Z-30", at_once);
}

#[test]
fn additive_words_act_inside_and_plain_words_replace() {
    assert_end("TRANS X100 Y50\nAROT Z90\nATRANS X10\nG0 X1 Y0", [100.0, 61.0, 0.0]);
    assert_end("ROT Z90\nTRANS X10\nG0 X1 Y1", [11.0, 1.0, 0.0]);
    assert_end("TRANS X10\nROT\nG0 X1", [1.0, 0.0, 0.0]);
    assert_end("TRANS X10\nASCALE X2 Y3\nG0 X1 Y1", [12.0, 3.0, 0.0]);
    // What is added inside a scale is scaled; inside a mirror, mirrored.
    assert_end("SCALE X2\nATRANS X10\nG0 X1", [22.0, 0.0, 0.0]);
    assert_end("TRANS X10\nAMIRROR X0\nATRANS X1\nG0 X2", [7.0, 0.0, 0.0]);
    assert_end("MIRROR X0\nAMIRROR X0\nG0 X2", [2.0, 0.0, 0.0]);
    // The programming manual's example of G58 and G59: X15, X25, X30.
    assert_end("TRANS X10 Y10 Z10\nATRANS X5 Y5\nG0 X0 Y0 Z0", [15.0, 15.0, 10.0]);
    assert_end("TRANS X10 Y10 Z10\nATRANS X5 Y5\nG58 X20\nG0 X0 Y0 Z0", [25.0, 15.0, 10.0]);
    assert_end("TRANS X10 Y10 Z10\nATRANS X5 Y5\nG58 X20\nG59 X10 Y10\nG0 X0 Y0 Z0", [30.0, 20.0, 10.0]);
}

#[test]
fn solid_angles_put_the_first_axis_into_its_old_plane() {
    // ROTS X Y: the new X axis stays in the old Z-X plane, turned by 30 degrees about Y.
    let (sin, cos) = (PI / 6.0).sin_cos();
    assert_end("ROTS X20 Y30\nG0 X10", [10.0 * cos, 0.0, -10.0 * sin]);
    // The new plane cuts the old Y-Z plane in the line at 20 degrees to Y: that line has no part along the normal.
    let normal = end("ROTS X20 Y30\nG0 Z1");
    let (sin, cos) = (PI / 9.0).sin_cos();
    assert!((normal[1] * cos + normal[2] * sin).abs() < 1e-12 && normal[2] > 0.0, "{normal:?}");
    // One angle is ROT.
    assert_end("ROTS X20\nG0 X1 Y2 Z3", end("ROT X20\nG0 X1 Y2 Z3"));
    assert_eq!(run("ROTS X1 Y2 Z3").alarm().code, "E0510");
}

#[test]
fn a_frame_change_does_not_move_the_machine() {
    assert_end("G0 X10 Y20\nTRANS X5\nG0 Y1", [10.0, 1.0, 0.0]);
    // X stands at 10 in the machine. In the frame turned by 90 degrees that is Y-10; X there is Y in the machine.
    assert_end("G0 X10 Y20\nROT Z90\nG0 X1", [10.0, 1.0, 0.0]);
    // Turned by 180 degrees each axis still has its own.
    assert_end("G0 X10 Y20\nROT Z180\nG0 X1", [-1.0, 20.0, 0.0]);
    // G91 makes the change good (SD42440 = 1): from X10 in the new frame.
    assert_end("G0 X10\nTRANS X5\nG91 X1", [16.0, 0.0, 0.0]);
    assert_end("G0 X10\nROT Z90\nG91 X1\nY2", [-2.0, 11.0, 0.0]);
    assert_end("TRANS X5\nG0 X10\nG53 X1\nG0 X10", [15.0, 0.0, 0.0]);
    assert_end("TRANS X5\nG0 X10\nSUPA G0 X1", [1.0, 0.0, 0.0]);
}

#[test]
fn circles_turn_and_mirror_with_the_frame() {
    let arc = |text: &str| {
        let result = run(&format!("F1000\n{text}"));
        assert!(result.alarm.is_none(), "{text}: {}", result.alarm().render(false));
        match result.moves.last().unwrap().kind.clone() {
            MoveKind::Arc(arc) => arc,
            kind => panic!("{text}: {kind:?}"),
        }
    };
    let plain = arc("G3 X10 Y10 I10 J0");
    // From 180 degrees forwards to 90.
    assert!((plain.sweep_rad - 1.5 * PI).abs() < 1e-9);
    let mirrored = arc("MIRROR X0\nG3 X10 Y10 I10 J0");
    assert!((mirrored.sweep_rad + plain.sweep_rad).abs() < 1e-12);
    let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-12;
    assert!(near(mirrored.centre_mm, [-10.0, 0.0]));
    let turned = arc("ROT Z90\nG3 X10 Y10 I10 J0");
    assert!(turned.sweep_rad == plain.sweep_rad && near(turned.centre_mm, [0.0, 10.0]));
    let scaled = arc("SCALE X2 Y2\nG3 X10 Y10 I10 J0");
    assert!((scaled.radius_mm - 20.0).abs() < 1e-12 && near(scaled.centre_mm, [20.0, 0.0]));
    // Turned by 90 degrees about X, the X-Y plane becomes X-Z: G18 counts from Z to X, so that the sense is the other.
    let upright = arc("ROT X90\nG3 X10 Y10 I10 J0");
    assert_eq!(upright.plane, [AxisId::new(2), AxisId::new(0)]);
    assert_eq!(upright.sweep_rad, -plain.sweep_rad);
    assert_eq!(run("F1000\nSCALE X2\nG3 X10 Y10 I10 J0").alarm().code, "E0509");
    let result = run("F1000\nROT X30\nG3 X10 Y10 I10 J0");
    let MoveKind::SpatialArc(arc) = &result.moves.last().unwrap().kind else { panic!("{:?}", result.moves) };
    let normal_mm = [0, 1, 2].map(|index| arc.directions[1][AxisId::new(index)]);
    assert!((normal_mm[1] - (PI / 6.0).cos()).abs() < 1e-12 && (normal_mm[2] - 0.5).abs() < 1e-12, "{normal_mm:?}");
    // Start and end lie on it.
    for end in result.moves.iter().map(|next| next.end.0) {
        let from_centre = end - arc.centre_mm;
        assert!((from_centre.norm() - arc.radius_mm).abs() < 1e-9);
    }
}

#[test]
fn the_fast_path_and_the_long_way_agree_in_a_turned_frame() {
    let fast = end("ROT X10 Y20 Z30\nATRANS X1 Y2 Z3\nG0 X5\nY6\nZ7\nG91\nX1\nY-2\nG90\nX3");
    let long = end("ROT X10 Y20 Z30\nATRANS X1 Y2 Z3\nG0 X=5\nY=6\nZ=7\nX=IC(1)\nY=IC(-2)\nX=3");
    assert!(fast.iter().zip(long).all(|(a, b)| (a - b).abs() < 1e-12), "{fast:?} and {long:?}");
}

#[test]
fn what_is_no_frame_is_refused() {
    for (text, code) in [
        ("SCALE X0", "E0510"),
        ("RPL=30", "E0510"),
        ("TRANS RPL=30", "E0510"),
        ("ROT RPL=30 Z20", "E0510"),
        ("TRANS X1 ROT Z20", "E0205"),
        ("ROT Z90 I1", "E0207"),
    ] {
        assert_eq!(run(text).alarm().code, code, "{text}");
    }
    assert_eq!(run_bytes(b"ROT B10", &xyzbc()).alarm().code, "E0510");
    // Every other axis is translated, scaled and mirrored by itself.
    let result = run_bytes(b"TRANS C10\nAMIRROR C0\nG0 C5", &xyzbc());
    assert!((result.moves.last().unwrap().end.0[AxisId::new(4)] - 5.0_f64.to_radians()).abs() < 1e-12);
}

#[test]
fn the_work_area_is_kept() {
    assert_eq!(run("G25 X-10 Y-10\nG26 X10 Y10\nG0 X10 Y-10\nX10.001").alarm().code, "E0511");
    let alarm = run("G26 X10\nTRANS X5\nG0 X6").alarm().clone();
    assert_eq!((alarm.code, alarm.line()), ("E0511", 3));
    assert!(alarm.message.contains("11 mm") && alarm.message.contains("10 mm"), "{}", alarm.message);
    assert!(run("G26 X10\nWALIMOF\nG0 X20").alarm.is_none());
    assert_eq!(run("G26 X10\nWALIMOF\nG0 X20\nWALIMON\nX5\nX11").alarm().line(), 6);
    // Half a circle from X0 to X0 about Y5 reaches X5.
    assert_eq!(run("G26 X4.9\nG3 X0 Y10 CR=5 F1000").alarm().code, "E0511");
    assert!(run("G26 X4.9\nG2 X0 Y10 CR=5 F1000").alarm.is_none());
}

fn xyz_axes() -> GeometryAxes {
    [0, 1, 2].map(|index| Some(AxisId::new(index)))
}

fn random_frame(random: &mut crate::random::Random) -> Frame {
    let mut frame = Frame::rotation(xyz_axes(), [0, 1, 2].map(|_| random.between(-4.0, 4.0)));
    for axis in AxisId::first(4) {
        frame.set_component_lu(axis, Component::Translation, random.between(-100.0, 100.0));
        frame.set_component_lu(axis, Component::Fine, random.between(-1.0, 1.0));
        frame.set_component_lu(axis, Component::Scale, random.between(0.3, 3.0));
        frame.set_component_lu(axis, Component::Mirror, f64::from(random.between(0.0, 1.0) > 0.5));
    }
    frame
}

fn random_point(random: &mut crate::random::Random) -> AxisVector {
    PerAxis::from_fn(|axis| if axis.index() < 4 { random.between(-100.0, 100.0) } else { 0.0 })
}

fn assert_near(a: &AxisVector, b: &AxisVector, what: &str) {
    assert!((*a - *b).norm() < 1e-9 * (1.0 + a.norm()), "{what}: {a:?} and {b:?}");
}

#[test]
fn inverse_chain_and_components_agree_with_points() {
    let mut random = crate::random::Random::new(20_260_101);
    for round in 0..2000 {
        let what = format!("round {round}");
        let (a, b, c) = (random_frame(&mut random), random_frame(&mut random), random_frame(&mut random));
        let p = random_point(&mut random);
        assert_near(&a.inward(&a.outward(&p)), &p, &what);
        assert_near(&a.inverse().outward(&a.outward(&p)), &p, &what);
        assert_near(&a.chained(&b).outward(&p), &a.outward(&b.outward(&p)), &what);
        assert_near(&a.chained(&b).chained(&c).outward(&p), &a.chained(&b.chained(&c)).outward(&p), &what);
        // Without unequal scales the components that a chain reads out make the chain again.
        let mut even = a.clone();
        AxisId::first(3).for_each(|axis| even.set_component_lu(axis, Component::Scale, 1.5));
        let chain = even.chained(&b);
        let mut again = Frame::identity(xyz_axes());
        for axis in AxisId::first(4) {
            for component in
                [Component::Translation, Component::Fine, Component::Rotation, Component::Scale, Component::Mirror]
            {
                again.set_component_lu(axis, component, chain.component_lu(axis, component));
            }
        }
        assert_near(&again.outward(&p), &chain.outward(&p), &what);
    }
}

#[test]
fn angles_are_read_in_their_ranges() {
    // Y beyond 90 degrees is Y' = 180 - Y with X and Z half a turn further.
    let turned = Frame::rotation(xyz_axes(), [0.1, 2.0, 0.3]).chained(&Frame::rotation(xyz_axes(), [1e-3, 0.0, 0.0]));
    let [a, b, c] = [0, 1, 2].map(|index| turned.component_lu(AxisId::new(index), Component::Rotation));
    assert!((b - (PI - 2.0)).abs() < 1e-12 && (c - (0.3 - PI)).abs() < 1e-12 && (a - (0.101 - PI)).abs() < 1e-12);
    // At Y = 90 degrees X and Z turn about one line: all of it is Z.
    let up = Frame::rotation(xyz_axes(), [0.2, PI / 2.0, 0.0]).chained(&Frame::rotation(xyz_axes(), [0.3, 0.0, 0.0]));
    let [a, b, c] = [0, 1, 2].map(|index| up.component_lu(AxisId::new(index), Component::Rotation));
    assert!(a == 0.0 && (b - PI / 2.0).abs() < 1e-12 && (c + 0.5).abs() < 1e-12, "{a} {b} {c}");
}
