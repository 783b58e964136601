//! q(s) of a piece of path seen from turned tables and heads: against the pose of the tool (another formula, other code), a closed form
//! in complex numbers, and difference quotients.

use crate::random::Random;
use sollwert::base::{AxisId, AxisVector, MachinePoint, PartPoint, PerAxis};
use sollwert::geometry::{Curve, Line};
use sollwert::interpreter::{ArcGeometry, Feed, Modes, ToolOffset};
use sollwert::kinematics::{JointPath, JointState, Kinematics, Transformation};
use sollwert::machine::{KinematicsSettings, Machine, PathMode, RotaryJoint};
use sollwert::program::BlockRef;
use sollwert::smoothing::{ContourPiece, PieceKind};
use std::f64::consts::{FRAC_PI_8, TAU};
use std::sync::Arc;

fn vector(components: &[f64]) -> AxisVector {
    PerAxis::from_fn(|axis| components.get(axis.index()).copied().unwrap_or(0.0))
}

fn linear() -> PerAxis<bool> {
    PerAxis::from_fn(|axis| axis.index() < 3)
}

fn kinematics(table: Vec<RotaryJoint>, head: Vec<RotaryJoint>) -> Kinematics {
    let axes = crate::test_machine::with_axes(&["X", "Y", "Z", "A", "B", "C"], &[]);
    Kinematics::new(&Machine { kinematics: KinematicsSettings::Rotary { table, head }, ..axes })
}

/// A path of the tip in the part under a chain.
fn path(kinematics: &Kinematics, curve: Curve, tool_length: AxisVector) -> JointPath {
    let mut modes = Modes::new(PathMode::G64);
    modes.tool = Some(Arc::new(ToolOffset { tool: "T1".into(), edge: 1, length: tool_length, radius_mm: 0.0 }));
    let piece = ContourPiece {
        block: BlockRef::default(),
        kind: PieceKind::Block(curve),
        feed: Feed::Rapid,
        modes,
        events: Vec::new(),
        blocks_begun: 1,
        block_length_lu: None,
        stop_at_end: true,
    };
    let transformation = Some(Arc::new(Transformation::new(kinematics.clone())));
    JointPath { transformation, ..kinematics.to_joint(piece) }
}

/// One to four joints about any lines, in the table or the head.
fn random_chain(random: &mut Random) -> Kinematics {
    let (mut table, mut head) = (Vec::new(), Vec::new());
    for place in 0..1 + random.below(3) as usize {
        let raw: [f64; 3] = std::array::from_fn(|_| random.between(-1.0, 1.0));
        let norm = raw.iter().map(|c| c * c).sum::<f64>().sqrt().max(1e-3);
        let point_mm = std::array::from_fn(|_| random.between(-200.0, 200.0));
        let joint = RotaryJoint { axis: AxisId::new(3 + place), direction: raw.map(|c| c / norm), point_mm };
        if random.below(2) == 0 { table.push(joint) } else { head.push(joint) }
    }
    kinematics(table, head)
}

fn random_point(random: &mut Random) -> PartPoint {
    let posture: Vec<f64> =
        (0..6).map(|i| if i < 3 { random.between(-90.0, 90.0) } else { random.between(-3.0, 3.0) }).collect();
    PartPoint(vector(&posture))
}

/// A line or a helix, rotary axes moving along.
fn random_curve(random: &mut Random) -> Curve {
    let (start, mut end) = (random_point(random), random_point(random));
    if random.below(2) == 0 {
        return Curve::Line(Line::new(start, end, &linear()));
    }
    let (x, y) = (AxisId::new(0), AxisId::new(1));
    let centre_mm = [random.between(-50.0, 50.0), random.between(-50.0, 50.0)];
    let (dx, dy) = (start.0[x] - centre_mm[0], start.0[y] - centre_mm[1]);
    let sweep_rad = random.between(-7.0, 7.0);
    let (sin, cos) = sweep_rad.sin_cos();
    end.0[x] = centre_mm[0] + dx * cos - dy * sin;
    end.0[y] = centre_mm[1] + dx * sin + dy * cos;
    let arc = ArcGeometry { plane: [x, y], centre_mm, radius_mm: dx.hypot(dy), sweep_rad };
    Curve::from(sollwert::geometry::Arc::new(start, end, &arc, &linear()))
}

#[test]
fn the_tool_is_where_the_contour_says() {
    let mut random = Random::new(1);
    for case in 0..200 {
        let kinematics = random_chain(&mut random);
        let curve = random_curve(&mut random);
        let length = vector(&[random.between(-20.0, 20.0), random.between(-20.0, 20.0), random.between(0.0, 250.0)]);
        let path = path(&kinematics, curve.clone(), length);
        assert_eq!(path.length_lu(), curve.length_lu());
        for share in [0.0, 0.1, 0.37, 0.8, 1.0] {
            let s_lu = share * path.length_lu();
            let (tip, axes) = (curve.at(s_lu), path.at(s_lu));
            let pose = kinematics.tip_pose(&axes.position, &length);
            for i in 0..3 {
                let (is, ought) = (pose.position_mm[i], tip.position.0[AxisId::new(i)]);
                assert!((is - ought).abs() < 1e-11, "case {case}, axis {i} at {share}: {is}, not {ought}");
            }
            for i in 3..6 {
                let axis = AxisId::new(i);
                assert_eq!(axes.position.0[axis], tip.position.0[axis], "a rotary axis is where it is programmed");
                assert_eq!(axes.first[axis], tip.first[axis]);
            }
        }
        let way = path.at(path.length_lu()).position.0 - path.at(0.0).position.0;
        assert_eq!(path.displacement_lu(), way);
    }
}

/// A line z = z0 + d s in the part, on a table that turns by w a mm: the machine sees e^(i w s) z, with derivatives by Leibniz.
#[test]
fn a_line_seen_from_a_turning_table() {
    let turned = |angle: f64, [x, y]: [f64; 2]| {
        let (sin, cos) = angle.sin_cos();
        [x * cos - y * sin, x * sin + y * cos]
    };
    let table = vec![RotaryJoint { axis: AxisId::new(5), direction: [0.0, 0.0, 1.0], point_mm: [0.0; 3] }];
    let kinematics = kinematics(table, Vec::new());
    let mut random = Random::new(2);
    for _ in 0..100 {
        let start = [random.between(-50.0, 50.0), random.between(-50.0, 50.0)];
        let end = [random.between(-50.0, 50.0), random.between(-50.0, 50.0)];
        let angles = [random.between(-9.0, 9.0), random.between(-9.0, 9.0)];
        let point = |p: [f64; 2], angle: f64| PartPoint(vector(&[p[0], p[1], 7.0, 0.0, 0.0, angle]));
        let line = Line::new(point(start, angles[0]), point(end, angles[1]), &linear());
        let length_mm = (end[0] - start[0]).hypot(end[1] - start[1]);
        let path = path(&kinematics, Curve::Line(line), vector(&[0.0, 0.0, 100.0]));
        let d = [0, 1].map(|i| (end[i] - start[i]) / length_mm);
        let w = (angles[1] - angles[0]) / length_mm;
        for share in [0.0, 0.21, 0.5, 0.99] {
            let s = share * length_mm;
            let z = [0, 1].map(|i| start[i] + d[i] * s);
            // i z is z turned by a quarter.
            let i = |[x, y]: [f64; 2]| [-y, x];
            let sum = |a: f64, p: [f64; 2], b: f64, q: [f64; 2]| [a * p[0] + b * q[0], a * p[1] + b * q[1]];
            let ought =
                [z, sum(w, i(z), 1.0, d), sum(-w * w, z, 2.0 * w, i(d)), sum(-w * w * w, i(z), -3.0 * w * w, d)];
            let JointState { position: MachinePoint(position), first, second, third } = path.at(s);
            for (n, (is, ought)) in [position, first, second, third].iter().zip(ought).enumerate() {
                let ought = turned(angles[0] + w * s, ought);
                let scale = 1e-13 * (1.0 + w.abs()).powi(n as i32) * 100.0;
                for k in 0..2 {
                    let is = is[AxisId::new(k)];
                    assert!((is - ought[k]).abs() < scale, "derivative {n}: {is}, not {}", ought[k]);
                }
                assert!((is[AxisId::new(2)] - [107.0, 0.0, 0.0, 0.0][n]).abs() < 1e-12, "Z stands");
            }
        }
    }
}

/// Each derivative is the slope of the one before it: central differences of fourth order.
#[test]
fn derivatives_are_slopes() {
    let mut random = Random::new(3);
    for case in 0..200 {
        let kinematics = random_chain(&mut random);
        let curve = random_curve(&mut random);
        let path = path(&kinematics, curve, vector(&[3.0, -8.0, 120.0]));
        let h = 2e-4 * path.length_lu();
        for share in [0.05, 0.41, 0.93] {
            let s = share * path.length_lu();
            let states = [-2.0, -1.0, 1.0, 2.0].map(|step| path.at(s + step * h));
            let here = path.at(s);
            let orders: [fn(&JointState) -> AxisVector; 4] =
                [|state| state.position.0, |state| state.first, |state| state.second, |state| state.third];
            for n in 1..4 {
                let [a, b, c, d] = states.map(|state| orders[n - 1](&state));
                let slope = (a - d + (c - b) * 8.0) * (1.0 / (12.0 * h));
                let is = orders[n](&here);
                // Rounding of the order below over h, and the fifth derivative times h^4 / 30: turns are below 1 rad a mm.
                let scale: f64 = orders[n - 1](&here).norm() / path.length_lu() + is.norm();
                let error = (slope - is).norm();
                assert!(
                    error < 1e-7 * scale.max(1e-9),
                    "case {case} derivative {n} at {share}: off by {error}, {scale}"
                );
            }
        }
    }
}

/// Between two nodes the joints turn by an eighth of half a turn at most, however often they turn in all; without a transformation a line
/// has no nodes.
#[test]
fn nodes_follow_the_turns() {
    let table = vec![RotaryJoint { axis: AxisId::new(5), direction: [0.0, 0.0, 1.0], point_mm: [0.0; 3] }];
    let kinematics = kinematics(table, Vec::new());
    let ends = [vector(&[10.0]), vector(&[30.0, 0.0, 0.0, 0.0, 0.0, 20.0 * TAU])].map(PartPoint);
    let turned = path(&kinematics, Curve::Line(Line::new(ends[0], ends[1], &linear())), AxisVector::zero());
    assert!(!turned.is_contour());
    let nodes = turned.nodes_lu();
    let angle = |s: f64| turned.at(s).position.0[AxisId::new(5)];
    let borders: Vec<f64> = [0.0].into_iter().chain(nodes.iter().copied()).chain([turned.length_lu()]).collect();
    for pair in borders.windows(2) {
        let turn = angle(pair[1]) - angle(pair[0]);
        assert!(turn > 0.0 && turn <= FRAC_PI_8 * (1.0 + 1e-9), "{pair:?}: {turn} rad");
    }
    let plain = JointPath { transformation: None, ..turned };
    assert!(plain.is_contour() && plain.nodes_lu().is_empty());
}
