//! Five names for one curve are not five modes: each mode has a property, seen on the driven contour, that no other mode has.

use super::support::*;
use sollwert::base::AxisVector;
use sollwert::geometry::Curve;
use sollwert::interpreter::{ArcGeometry, Feed, Move, MoveKind, ProgrammedLimits};
use sollwert::machine::{BlendShape, Machine, PathMode};
use sollwert::smoothing::{ContourPiece, PieceKind};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

const MODES: [PathMode; 5] = [PathMode::G641, PathMode::G642, PathMode::G643, PathMode::G644, PathMode::G645];

/// What all programs here say, whether the mode listens or not.
const ADIS: f64 = 0.8;
const CTOL: f64 = 0.05;

/// MD33100 of every axis, MD33120.
const AXIS_TOLERANCE: f64 = 0.1;
const TRANSITION_TOLERANCE: f64 = 0.005;

fn control(shape: BlendShape) -> Machine {
    let mut machine = machine();
    machine.smoothing.shape = shape;
    assert_eq!(machine.smoothing.contour_tolerance_mm, AXIS_TOLERANCE);
    assert_eq!(machine.smoothing.transition_tolerance_mm, TRANSITION_TOLERANCE);
    machine
}

fn program(points: &[Vec<f64>], mode: PathMode) -> Vec<Move> {
    let mut moves = polyline(points);
    for moved in &mut moves {
        moved.modes.path_mode = mode;
        moved.modes.contour_tolerance_mm = Some(CTOL);
        moved.modes.rounding_distance_mm = Some(ADIS);
    }
    moves
}

/// A contour as it is driven.
struct Driven(Vec<ContourPiece>);

impl Driven {
    fn new(machine: &Machine, moves: &[Move]) -> Self {
        Self(run(machine, moves).0)
    }

    /// Distance from a point: the nearest of dense samples, refined between its neighbours.
    fn distance(&self, from: &[f64]) -> f64 {
        let from = vector(from);
        let to = |curve: &Curve, s: f64| (curve.at(s).position.0 - from).norm();
        let nearest = |curve: &Curve| {
            let step = curve.length_lu() / 500.0;
            let at = (0..=500).map(|i| to(curve, f64::from(i) * step)).enumerate();
            let (i, _) = at.min_by(|a, b| a.1.total_cmp(&b.1)).expect("samples");
            let (mut low, mut high) = ((i as f64 - 1.0).max(0.0) * step, (i as f64 + 1.0).min(500.0) * step);
            for _ in 0..60 {
                let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
                if to(curve, a) < to(curve, b) { high = b } else { low = a }
            }
            to(curve, low)
        };
        self.0.iter().filter_map(ContourPiece::curve).map(nearest).fold(f64::INFINITY, f64::min)
    }

    /// How far this contour gets from another one.
    fn farthest_from(&self, other: &Self) -> f64 {
        let blends = self.0.iter().filter(|piece| matches!(piece.kind, PieceKind::Blend(..)));
        let places = blends.filter_map(ContourPiece::curve).flat_map(|curve| samples(curve).step_by(10));
        places.map(|q| other.distance(&q.as_slice()[..3])).fold(0.0, f64::max)
    }

    /// The greatest step of the second derivative from piece to piece, per length.
    fn step_of_curvature(&self) -> f64 {
        let curves: Vec<&Curve> = self.0.iter().filter_map(ContourPiece::curve).collect();
        let step = |pair: &[&Curve]| (pair[1].at(0.0).second - pair[0].at(f64::INFINITY).second).norm();
        curves.windows(2).map(step).fold(0.0, f64::max)
    }
}

/// Corner at (60 cos, 60 sin) of `heading`, turning by `turn`, 50 mm on both sides and more.
fn bend(heading: f64, turn: f64) -> Vec<Vec<f64>> {
    let at = |length: f64, angle: f64| [length * angle.cos(), length * angle.sin()];
    let (corner, leg) = (at(60.0, heading), at(60.0, heading + turn));
    vec![corner.to_vec(), vec![corner[0] + leg[0], corner[1] + leg[1]]]
}

/// The contour is the programmed one up to ADIS before the corner, and soon after not any more: whatever the angle, the tolerance, the
/// axes and the feed. Of a short block half is left.
fn leaves_at_a_distance(shape: BlendShape, mode: PathMode) -> bool {
    let machine = control(shape);
    [20.0, 60.0, 90.0, 140.0].map(f64::to_radians).iter().all(|turn| {
        let driven = Driven::new(&machine, &program(&bend(0.0, *turn), mode));
        let before = |way: f64| [60.0 - way, 0.0];
        let after = |way: f64| [60.0 + way * turn.cos(), way * turn.sin()];
        let kept = [before(1.001 * ADIS), after(1.001 * ADIS)].iter().all(|point| driven.distance(point) < 1e-9);
        let left = [before(0.7 * ADIS), after(0.7 * ADIS)].iter().all(|point| driven.distance(point) > 1e-6);
        let short = vec![vec![60.0, 0.0], vec![60.0 + turn.cos(), turn.sin()]];
        let cut = Driven::new(&machine, &program(&short, mode));
        let half = cut.distance(&before(0.501)) < 1e-9 && cut.distance(&before(0.35)) > 1e-6;
        kept && left && half
    })
}

/// The corner is missed by beta times CTOL, however the axes lie.
fn misses_corners_by_the_contour_tolerance(shape: BlendShape, mode: PathMode) -> bool {
    let machine = control(shape);
    [(0.0, 0.6), (0.4, 0.6), (0.2, 0.9), (0.1, 1.3), (0.9, 1.3)].iter().all(|(heading, turn): &(f64, f64)| {
        let points = bend(*heading, *turn);
        let missed = Driven::new(&machine, &program(&points, mode)).distance(&points[0]);
        // Past 90 deg X turns back.
        let beta = if heading + turn > FRAC_PI_2 { 0.6 } else { 0.8 };
        (missed - beta * CTOL).abs() < 1e-6
    })
}

/// A line along X to (60, 0) that an arc of 20 mm continues to the left.
fn tangential(mode: PathMode) -> Vec<Move> {
    let (sin, cos) = f64::sin_cos(1.2);
    let mut moves = program(&[vec![60.0, 0.0], vec![60.0 + 20.0 * sin, 20.0 - 20.0 * cos]], mode);
    let geometry = ArcGeometry { plane: [X, Y], centre_mm: [60.0, 20.0], radius_mm: 20.0, sweep_rad: 1.2 };
    moves[1].kind = MoveKind::Arc(geometry);
    moves
}

/// Corners as the contour tolerance says, and where the direction goes on the contour is the programmed one.
fn keeps_tangential_transitions(shape: BlendShape, mode: PathMode) -> bool {
    let driven = Driven::new(&control(shape), &tangential(mode));
    let joints = [[60.0, 0.0], [59.5, 0.0], [60.0 + 20.0 * f64::sin(0.02), 20.0 - 20.0 * f64::cos(0.02)]];
    misses_corners_by_the_contour_tolerance(shape, mode) && joints.iter().all(|joint| driven.distance(joint) < 1e-9)
}

/// Corners as the contour tolerance says, and where the direction goes on but the curvature does not, the contour leaves the programmed
/// one by no more than MD33120, so that the curvature goes on as well.
fn rounds_tangential_transitions(shape: BlendShape, mode: PathMode) -> bool {
    let driven = Driven::new(&control(shape), &tangential(mode));
    let missed = driven.farthest_from(&Driven::new(&control(shape), &tangential(PathMode::G64)));
    misses_corners_by_the_contour_tolerance(shape, mode)
        && missed > 0.1 * TRANSITION_TOLERANCE
        && missed <= TRANSITION_TOLERANCE
        && driven.step_of_curvature() < 1e-7
}

/// In the corner every axis has used up its own tolerance, at once and over its own range.
fn gives_every_axis_its_own_tolerance(shape: BlendShape, mode: PathMode) -> bool {
    let machine = control(shape);
    [[0.1, 0.02], [0.01, 0.07]].iter().all(|[x, y]| {
        let mut moves = program(&bend(0.0, FRAC_PI_2), mode);
        let mut limits = ProgrammedLimits::default();
        (limits.axis_tolerance_lu[X], limits.axis_tolerance_lu[Y]) = (Some(*x), Some(*y));
        moves[0].modes.programmed = Some(Arc::new(limits));
        let driven = Driven::new(&machine, &moves);
        // X lacks its tolerance where Y is ahead by its own; X has left its line 16/3 x before the corner.
        let [reach_x, reach_y] = [16.0 / 3.0 * x, 16.0 / 3.0 * y];
        driven.distance(&[60.0 - x, *y]) < 1e-6
            && driven.distance(&[60.0, 1.001 * reach_x.max(reach_y)]) < 1e-9
            && driven.distance(&[60.0 - 1.001 * reach_x.max(reach_y), 0.0]) < 1e-9
    })
}

/// The contour keeps nearer to the corner the lower the feed and the quicker the axes are; it uses the axis tolerance where these need
/// it, and CTOL says nothing.
fn rounds_as_far_as_the_dynamics_need(shape: BlendShape, mode: PathMode) -> bool {
    let machine = control(shape);
    let mut slow = machine.clone();
    slow.axes[1].limits.acceleration_max_lu_s2 /= 20.0;
    slow.axes[1].limits.transition_jerk_max_lu_s3 /= 20.0;
    let missed = |machine: &Machine, turn: f64, feed_lu_s: f64, ctol: f64| {
        let points = bend(0.0, turn);
        let mut moves = program(&points, mode);
        for moved in &mut moves {
            moved.feed = Feed::Path { feed_lu_s };
            moved.modes.contour_tolerance_mm = Some(ctol);
        }
        Driven::new(machine, &moves).distance(&points[0])
    };
    [0.5, FRAC_PI_2].iter().all(|turn| {
        let by_feed = [1.0, 2.0, 4.0, 80.0].map(|feed| missed(&machine, *turn, feed, CTOL));
        let grows = by_feed.windows(2).all(|pair| pair[1] > 1.2 * pair[0]);
        // All of the tolerance of the axis that turns most; between them the axes span a box.
        let most = by_feed[3] > 0.9 * AXIS_TOLERANCE && by_feed[3] <= AXIS_TOLERANCE * f64::sqrt(2.0) * (1.0 + 1e-9);
        let weak = missed(&slow, *turn, 1.0, CTOL) > 1.2 * by_feed[0];
        let deaf = [1e-3, 3.0].iter().all(|ctol| missed(&machine, *turn, 2.0, *ctol) == by_feed[1]);
        grows && most && weak && deaf
    })
}

#[test]
fn each_mode_has_a_property_that_no_other_has() {
    type Property = fn(BlendShape, PathMode) -> bool;
    let properties: [(PathMode, &str, Property); 5] = [
        (PathMode::G641, "distance", leaves_at_a_distance),
        (PathMode::G642, "contour tolerance at corners only", keeps_tangential_transitions),
        (PathMode::G643, "axis by axis", gives_every_axis_its_own_tolerance),
        (PathMode::G644, "dynamics", rounds_as_far_as_the_dynamics_need),
        (PathMode::G645, "contour tolerance, steps of curvature too", rounds_tangential_transitions),
    ];
    for shape in [BlendShape::Hermite3, BlendShape::Quintic] {
        for (owner, name, holds) in properties {
            for mode in MODES {
                assert_eq!(holds(shape, mode), mode == owner, "{name}, {mode:?}, {shape:?}");
            }
        }
    }
}

/// Second and third derivative by differences of positions: what a corner at this feed asks of the axes.
#[test]
fn g644_rounds_until_the_axes_can_pass_at_the_feed_and_no_further() {
    for shape in [BlendShape::Hermite3, BlendShape::Quintic] {
        let machine = control(shape);
        let limits = &machine.axes[0].limits;
        let (share_a, share_j) = (machine.smoothing.radial_acceleration_share, machine.smoothing.radial_jerk_share);
        for turn in [0.1, 0.5, FRAC_PI_2, 2.2] {
            for feed_lu_s in [1.0, 5.0] {
                let mut moves = program(&bend(0.3, turn), PathMode::G644);
                moves.iter_mut().for_each(|moved| moved.feed = Feed::Path { feed_lu_s });
                let pieces = Driven::new(&machine, &moves).0;
                let curve = pieces[1].curve().expect("a blend");
                let step = curve.length_lu() / 1000.0;
                let q = |i: i32| curve.at(f64::from(i) * step).position.0;
                let mut most: f64 = 0.0;
                for i in 10..=990 {
                    let second = (q(i + 10) - q(i) * 2.0 + q(i - 10)) * (10.0 * step).powi(-2);
                    let third = (q(i + 10) - q(i - 10)) - (q(i + 5) - q(i - 5)) * 2.0;
                    let third = third * (0.5 / (5.0 * step).powi(3));
                    for axis in [X, Y] {
                        let bend = feed_lu_s.powi(2) * second[axis].abs() / (share_a * limits.acceleration_max_lu_s2);
                        let jerk = feed_lu_s.powi(3) * third[axis].abs() / (share_j * limits.transition_jerk_max_lu_s3);
                        most = most.max(bend).max(jerk);
                    }
                }
                let what = format!("{shape:?} {turn} {feed_lu_s}: {most}");
                let tolerance: f64 = corners(&pieces)[0].tolerance_mm;
                let bound_by_tolerance = tolerance > 0.9 * AXIS_TOLERANCE;
                assert!(bound_by_tolerance || most > 0.5, "{what}: rounder than needed");
                // The cubic of the general blend is passed by arc length, not by its own parameter: sharper where it is shorter.
                let sharp = if shape == BlendShape::Quintic { 1.02 } else { 1.6 };
                assert!(bound_by_tolerance || turn > 1.0 || most < sharp, "{what}: sharper than needed");
            }
        }
    }
}

/// Second derivative of both ends, as an arc and a spline have it, in the plane: `turn` = 0 goes on tangentially.
fn curves_that_meet() -> Vec<(&'static str, Vec<Move>)> {
    // The cubic q(u) = (60 + u, b u²/2 + c u³/6), u to 10, bends at once; the one before ends with a bend of its own.
    let spline = |start: [f64; 2], slope: f64, bend: f64, third: f64, number: u64| {
        let end = [start[0] + 10.0, start[1] + 10.0 * slope + 50.0 * bend + 1000.0 / 6.0 * third];
        let rows = [
            vector(&[start[0], start[1]]),
            vector(&[1.0, slope]),
            vector(&[0.0, 0.5 * bend]),
            vector(&[0.0, third / 6.0]),
            AxisVector::zero(),
            AxisVector::zero(),
        ];
        let piece = sollwert::interpreter::PolynomialPiece {
            parameter_end_ratio: 10.0,
            numerator_lu: rows,
            denominator_ratio: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        };
        let mut moved = line(number, &end);
        moved.kind = MoveKind::Spline(Arc::new(sollwert::interpreter::PolynomialGeometry { pieces: vec![piece] }));
        (moved, end, slope + 10.0 * bend + 50.0 * third)
    };
    let (after_line, ..) = spline([60.0, 0.0], 0.0, 0.05, 0.0, 2);
    let (first, end, slope) = spline([60.0, 0.0], 0.0, 0.0, 0.004, 2);
    let (second, ..) = spline(end, slope, -0.06, 0.002, 3);
    let (bent, end_bent, slope_bent) = spline([60.0, 0.0], 0.0, 0.0, 0.006, 2);
    let straight_on = line(3, &[end_bent[0] + 20.0, end_bent[1] + 20.0 * slope_bent]);
    vec![
        ("line and spline", vec![line(1, &[60.0, 0.0]), after_line]),
        ("spline and spline", vec![line(1, &[60.0, 0.0]), first, second]),
        ("spline and line", vec![line(1, &[60.0, 0.0]), bent, straight_on]),
    ]
}

#[test]
fn g645_rounds_steps_of_curvature_of_splines_too() {
    for (name, moves) in curves_that_meet() {
        for shape in [BlendShape::Hermite3, BlendShape::Quintic] {
            for mode in MODES {
                let mut moves = moves.clone();
                for moved in &mut moves {
                    moved.modes.path_mode = mode;
                    moved.modes.rounding_distance_mm = Some(ADIS);
                    moved.modes.contour_tolerance_mm = Some(CTOL);
                }
                let driven = Driven::new(&control(shape), &moves);
                check_contour(&moves, &driven.0, name);
                let mut bare = moves.clone();
                bare.iter_mut().for_each(|moved| moved.modes.path_mode = PathMode::G64);
                let missed = driven.farthest_from(&Driven::new(&control(shape), &bare));
                if mode == PathMode::G645 {
                    assert!(driven.step_of_curvature() < 1e-7, "{name}: {}", driven.step_of_curvature());
                    assert!(missed > 1e-4 && missed <= TRANSITION_TOLERANCE, "{name}: {missed}");
                } else {
                    assert!(driven.step_of_curvature() > 0.01 && missed == 0.0, "{name}, {mode:?}: {missed}");
                }
            }
        }
    }
}
