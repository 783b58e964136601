//! Pose of the tool against published examples, and q(s) of a contour piece.

use sollwert::base::{AxisId, AxisVector, MachinePoint, PartPoint, PerAxis};
use sollwert::geometry::{Curve, Line};
use sollwert::interpreter::{Feed, Modes};
use sollwert::kinematics::{Kinematics, ToolPose};
use sollwert::machine::{KinematicsSettings, Machine, PathMode, RotaryJoint};
use sollwert::program::BlockRef;
use sollwert::smoothing::{ContourPiece, PieceKind};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_6, TAU};

/// First and second rotary axis of every machine here.
const ROTARY: [AxisId; 2] = [AxisId::new(3), AxisId::new(4)];

/// X, Y, Z and two rotary axes on the given chain.
fn machine(rotary: [&str; 2], kinematics: KinematicsSettings) -> Machine {
    Machine { kinematics, ..crate::test_machine::with_axes(&["X", "Y", "Z", rotary[0], rotary[1]], &[]) }
}

fn joint(place: usize, direction: [f64; 3], point_mm: [f64; 3]) -> RotaryJoint {
    RotaryJoint { axis: ROTARY[place], direction, point_mm }
}

/// A [-1,0,0], C [0,0,-1]: R_x(-A) R_z(-C) of models/five-axis.md section 2.
fn mikron() -> Kinematics {
    let table = vec![joint(0, [-1.0, 0.0, 0.0], [0.0; 3]), joint(1, [0.0, 0.0, -1.0], [0.0; 3])];
    Kinematics::new(&machine(["A", "C"], KinematicsSettings::Rotary { table, head: Vec::new() }))
}

fn vector(components: &[f64]) -> AxisVector {
    PerAxis::from_fn(|axis| components.get(axis.index()).copied().unwrap_or(0.0))
}

fn posture(components: [f64; 5]) -> MachinePoint {
    MachinePoint(vector(&components))
}

fn close(value: [f64; 3], expected: [f64; 3], tolerance: f64, what: &str) {
    let error = (0..3).map(|i| (value[i] - expected[i]).abs()).fold(0.0, f64::max);
    assert!(error <= tolerance, "{what}: {value:?}, expected {expected:?}");
}

/// v turned about `direction` by Rodrigues' formula.
fn turned(v: [f64; 3], direction: [f64; 3], angle_rad: f64) -> [f64; 3] {
    let (sin, cos) = angle_rad.sin_cos();
    let [a, b, c] = direction;
    let cross = [b * v[2] - c * v[1], c * v[0] - a * v[2], a * v[1] - b * v[0]];
    let along = (a * v[0] + b * v[1] + c * v[2]) * (1.0 - cos);
    std::array::from_fn(|i| v[i] * cos + cross[i] * sin + direction[i] * along)
}

/// v turned by a quaternion: v + 2 w (q x v) + 2 q x (q x v).
fn by_quaternion(v: [f64; 3], [x, y, z, w]: [f64; 4]) -> [f64; 3] {
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let once = cross([x, y, z], v);
    let twice = cross([x, y, z], once);
    std::array::from_fn(|i| v[i] + 2.0 * (w * once[i] + twice[i]))
}

fn check_rotation(pose: &ToolPose) {
    let q = pose.orientation_quaternion_xyzw;
    let norm = q.iter().map(|c| c * c).sum::<f64>();
    assert!((norm - 1.0).abs() < 1e-15, "{pose:?}");
    close(by_quaternion([0.0, 0.0, 1.0], q), pose.axis, 1e-15, "the quaternion turns +Z into the axis");
}

#[test]
fn mikron_example() {
    // models/five-axis.md section 2: p = (10, 0, 20), A = 30 deg, C = 90 deg.
    let (y, z) = (20.0 * 0.5 - 10.0 * 0.75f64.sqrt(), 10.0 * 0.5 + 20.0 * 0.75f64.sqrt());
    assert!((y - 1.339_746_0).abs() < 1e-7 && (z - 22.320_508_1).abs() < 1e-7, "the printed figures");
    let pose = mikron().tool_pose(&posture([0.0, y, z, FRAC_PI_6, FRAC_PI_2]));
    close(pose.position_mm, [10.0, 0.0, 20.0], 1e-13, "position");
    close(pose.axis, [0.5, 0.0, 0.75f64.sqrt()], 1e-15, "axis");
    check_rotation(&pose);
}

#[test]
fn mikron_axis_for_any_angles() {
    // (i, j, k) = (sinA sinC, -sinA cosC, cosA) and M = R_x(-A) R_z(-C) p.
    let kinematics = mikron();
    for i in 0..200 {
        let (a, c) = (f64::from(i) * 0.37 - 20.0, f64::from(i) * 1.1 - 100.0);
        let p = [3.0 + a, -7.0, 0.5 * c];
        let m = turned(turned(p, [0.0, 0.0, 1.0], -c), [1.0, 0.0, 0.0], -a);
        let pose = kinematics.tool_pose(&posture([m[0], m[1], m[2], a, c]));
        close(pose.position_mm, p, 1e-12, "position");
        close(pose.axis, [a.sin() * c.sin(), -a.sin() * c.cos(), a.cos()], 1e-13, "axis");
        check_rotation(&pose);
    }
}

#[test]
fn table_at_45_degrees() {
    // models/feed-prediction-and-surface.md section 1: cos A = 2 u_z - 1, whatever C.
    let table = vec![joint(0, [0.0, 0.5f64.sqrt(), 0.5f64.sqrt()], [0.0; 3]), joint(1, [0.0, 0.0, 1.0], [0.0; 3])];
    let kinematics = Kinematics::new(&machine(["A", "C"], KinematicsSettings::Rotary { table, head: Vec::new() }));
    for i in 0..100 {
        let (a, c) = (f64::from(i) * 0.0628 - 3.1, f64::from(i) * 0.5);
        let axis = kinematics.tool_pose(&posture([1.0, 2.0, 3.0, a, c])).axis;
        assert!((a.cos() - (2.0 * axis[2] - 1.0)).abs() < 1e-14, "A = {a}, C = {c}: {axis:?}");
    }
}

#[test]
fn table_with_offsets() {
    // P_m = Pa + R_a(A) (Pc - Pa + R_c(C) (P - Pc)), models/feed-prediction-and-surface.md section 1.
    let (pa, pc) = ([5.0, -3.0, 40.0], [5.5, -2.0, 10.0]);
    let (a_direction, c_direction) = ([0.0, 0.6, 0.8], [0.0, 0.0, 1.0]);
    let table = vec![joint(0, a_direction, pa), joint(1, c_direction, pc)];
    let kinematics = Kinematics::new(&machine(["A", "C"], KinematicsSettings::Rotary { table, head: Vec::new() }));
    let (a, c, p) = (0.9, -2.2, [12.0, 34.0, -5.0]);
    let inner = turned([p[0] - pc[0], p[1] - pc[1], p[2] - pc[2]], c_direction, c);
    let outer = turned([pc[0] - pa[0] + inner[0], pc[1] - pa[1] + inner[1], pc[2] - pa[2] + inner[2]], a_direction, a);
    let pose = kinematics.tool_pose(&posture([pa[0] + outer[0], pa[1] + outer[1], pa[2] + outer[2], a, c]));
    close(pose.position_mm, p, 1e-13, "position");
    let axis = turned(turned([0.0, 0.0, 1.0], a_direction, -a), c_direction, -c);
    close(pose.axis, axis, 1e-15, "axis");
    check_rotation(&pose);
}

#[test]
fn head_and_table() {
    // Head B with its pivot 150 mm above the tip, table C: the tip swings out while X, Y, Z stand still.
    let chain = KinematicsSettings::Rotary {
        table: vec![joint(1, [0.0, 0.0, 1.0], [0.0; 3])],
        head: vec![joint(0, [0.0, 1.0, 0.0], [0.0, 0.0, 150.0])],
    };
    let kinematics = Kinematics::new(&machine(["B", "C"], chain));
    let pose = kinematics.tool_pose(&posture([10.0, 20.0, 30.0, FRAC_PI_2, 0.0]));
    close(pose.position_mm, [10.0 - 150.0, 20.0, 30.0 + 150.0], 1e-12, "position");
    close(pose.axis, [1.0, 0.0, 0.0], 1e-15, "axis");
    // The part turns with the table, by +60 deg: seen from it, the tool turns by -60 deg.
    let pose = kinematics.tool_pose(&posture([10.0, 0.0, 30.0, 0.0, FRAC_PI_3]));
    close(pose.position_mm, [5.0, -10.0 * 0.75f64.sqrt(), 30.0], 1e-14, "position");
    check_rotation(&pose);
}

#[test]
fn quaternion_is_continuous_over_many_turns() {
    let kinematics = mikron();
    let at = |c: f64| kinematics.tool_pose(&posture([0.0, 0.0, 0.0, 0.3, c])).orientation_quaternion_xyzw;
    let steps = 2000;
    for i in 0..steps {
        let angle = |i: i32| 3.0 * TAU * f64::from(i) / f64::from(steps);
        let (q, next) = (at(angle(i)), at(angle(i + 1)));
        let jump = (0..4).map(|k| (next[k] - q[k]).abs()).fold(0.0, f64::max);
        assert!(jump < 0.01, "a jump of {jump} at step {i}");
    }
}

#[test]
fn machine_without_rotary_joints() {
    let kinematics = Kinematics::new(&machine(["A", "C"], KinematicsSettings::Cartesian));
    let pose = kinematics.tool_pose(&posture([1.0, 2.0, 3.0, 0.4, 0.5]));
    assert_eq!(pose.position_mm, [1.0, 2.0, 3.0]);
    assert_eq!(pose.axis, [0.0, 0.0, 1.0]);
    assert_eq!(pose.orientation_quaternion_xyzw, [0.0, 0.0, 0.0, 1.0]);
}

#[test]
fn joint_path_is_the_contour_axis_by_axis() {
    let kinematics = mikron();
    let modes = Modes::new(PathMode::G64);
    let piece = |kind: PieceKind| ContourPiece {
        block: BlockRef::default(),
        kind,
        feed: Feed::Rapid,
        modes: modes.clone(),
        events: Vec::new(),
        blocks_begun: 1,
        block_length_lu: None,
        stop_at_end: true,
    };
    let (start, end) = (PartPoint::default(), PartPoint(vector(&[3.0, 4.0, 0.0, 0.0, 1.0])));
    let line = Line::new(start, end, &PerAxis::from_fn(|axis| axis.index() < 3));
    let path = kinematics.to_joint(piece(PieceKind::Block(Curve::Line(line))));
    assert_eq!(path.length_lu(), 5.0);
    assert_eq!(path.at(5.0).position, MachinePoint(end.0));
    assert_eq!(path.at(2.5).first, vector(&[0.6, 0.8, 0.0, 0.0, 0.2]));
    let wait = kinematics.to_joint(piece(PieceKind::Wait { time_s: 1.0, at: end }));
    assert_eq!(wait.length_lu(), 0.0);
    assert_eq!(wait.at(1.0).position, MachinePoint(end.0));
    assert_eq!(wait.at(1.0).first, AxisVector::zero());
}
