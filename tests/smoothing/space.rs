//! Blends in space: arcs of different planes, helices, splines and rotary axes that meet in corners. From outside: pieces meet, the
//! direction and (but for the published cubic) the curvature go on, every axis and the contour keep their tolerances.

use super::support::*;
use sollwert::base::{AxisId, AxisVector, PerAxis};
use sollwert::geometry::{Arc as CircularArc, Curve, Line, PolynomialCurve, SpatialArc};
use sollwert::interpreter::{
    ArcGeometry, Move, MoveKind, PolynomialGeometry, PolynomialPiece, ProgrammedLimits, SpatialArcGeometry,
};
use sollwert::machine::{BlendShape, Machine, PathMode};
use sollwert::smoothing::{ContourPiece, PieceKind};
use std::sync::Arc;

const Z: AxisId = AxisId::new(2);
const C: AxisId = AxisId::new(3);
const MODES: [PathMode; 4] = [PathMode::G642, PathMode::G643, PathMode::G644, PathMode::G645];

fn linear() -> PerAxis<bool> {
    PerAxis::from_fn(|axis| axis.index() < 3)
}

/// One more block of a random kind from where the path is.
fn block(random: &mut Random, number: u64, from: AxisVector) -> Move {
    let between = |random: &mut Random, low: f64, high: f64| low + (high - low) * random.unit();
    let size = between(random, 2.0, 20.0);
    let turn_c = if random.unit() < 0.4 { between(random, -0.3, 0.3) } else { 0.0 };
    let mut end = from;
    end[C] += turn_c;
    let kind = match (random.unit() * 5.0) as u32 {
        0 => {
            for axis in [X, Y, Z] {
                end[axis] += between(random, -size, size);
            }
            MoveKind::Line
        }
        1 | 2 => {
            // A circle or helix in one of the three planes.
            let plane = [[X, Y], [Z, X], [Y, Z]][(random.unit() * 3.0) as usize % 3];
            let (angle, sweep_rad) = (between(random, 0.0, 6.2), between(random, -2.5, 2.5));
            let centre_mm = [from[plane[0]] - size * angle.cos(), from[plane[1]] - size * angle.sin()];
            end[plane[0]] = centre_mm[0] + size * (angle + sweep_rad).cos();
            end[plane[1]] = centre_mm[1] + size * (angle + sweep_rad).sin();
            if random.unit() < 0.5 {
                let across = [X, Y, Z].into_iter().find(|axis| !plane.contains(axis)).expect("a third axis");
                end[across] += between(random, -5.0, 5.0);
            }
            MoveKind::Arc(ArcGeometry { plane, centre_mm, radius_mm: size, sweep_rad })
        }
        3 => {
            // A circle of a tilted plane.
            let (a, b) = (between(random, 0.2, 1.2), between(random, 0.2, 1.2));
            let first = vector(&[a.cos() * b.cos(), a.sin() * b.cos(), -b.sin()]);
            let second = vector(&[-a.sin(), a.cos(), 0.0]);
            let (angle, sweep_rad) = (between(random, 0.0, 6.2), between(random, -2.5, 2.5));
            let outward = |angle: f64| first * angle.cos() + second * angle.sin();
            let to = from - outward(angle) * size + outward(angle + sweep_rad) * size;
            for axis in [X, Y, Z] {
                end[axis] = to[axis];
            }
            let centre = from - outward(angle) * size;
            let centre_mm = PerAxis::from_fn(|axis| if axis == C { 0.0 } else { centre[axis] });
            let geometry = SpatialArcGeometry { directions: [first, second], centre_mm, radius_mm: size, sweep_rad };
            MoveKind::SpatialArc(Box::new(geometry))
        }
        _ => {
            // A cubic that is no line anywhere.
            let mut numerator_lu = [AxisVector::zero(); 6];
            numerator_lu[0] = from;
            for axis in [X, Y, Z] {
                let slope = between(random, 0.5, 1.0) * if random.unit() < 0.5 { 1.0 } else { -1.0 };
                numerator_lu[1][axis] = slope;
                numerator_lu[2][axis] = between(random, -0.01, 0.01);
                numerator_lu[3][axis] = between(random, -0.001, 0.001);
            }
            numerator_lu[1][C] = turn_c / size;
            end = numerator_lu[1] * size + numerator_lu[2] * size.powi(2) + numerator_lu[3] * size.powi(3) + from;
            let denominator_ratio = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            let piece = PolynomialPiece { parameter_end_ratio: size, numerator_lu, denominator_ratio };
            MoveKind::Spline(Arc::new(PolynomialGeometry { pieces: vec![piece] }))
        }
    };
    let mut moved = line(number, end.as_slice());
    moved.kind = kind;
    moved
}

/// The programmed curves, made anew.
fn programmed(moves: &[Move]) -> Vec<Curve> {
    let mut from = point(&[]);
    let linear = linear();
    moves
        .iter()
        .map(|moved| {
            let (start, end) = (from, moved.end);
            from = end;
            match &moved.kind {
                MoveKind::Arc(geometry) => Curve::from(CircularArc::new(start, end, geometry, &linear)),
                MoveKind::SpatialArc(geometry) => Curve::from(SpatialArc::new(start, end, geometry, &linear)),
                MoveKind::Spline(geometry) => Curve::from(PolynomialCurve::new(start, end, geometry, &linear)),
                _ => Curve::Line(Line::new(start, end, &linear)),
            }
        })
        .collect()
}

/// What the programmed contour around a corner allows.
struct Allowed<'a> {
    before: &'a Curve,
    after: &'a Curve,
    reach: f64,
    linear: f64,
    rotary: f64,
}

impl Allowed<'_> {
    /// The greater share of both tolerances by which `q` misses the programmed place where that is least.
    fn share(&self, q: AxisVector) -> f64 {
        let at = |s: f64| {
            let length = self.before.length_lu();
            let there = if s < 0.0 { self.before.at(length + s) } else { self.after.at(s) };
            let missed = q - there.position.0;
            (missed.masked(&linear()).norm() / self.linear).max(missed[C].abs() / self.rotary)
        };
        let step = self.reach / 100.0;
        let place = |i: i32| f64::from(i) * step;
        let coarse: Vec<f64> = (-100..=100).map(|i| at(place(i))).collect();
        // Every valley of the samples, refined: the greater of two distances has a narrow one where an axis is quick.
        let refined = |i: i32| {
            let (mut low, mut high) = (place(i - 1), place(i + 1));
            for _ in 0..40 {
                let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
                if at(a) < at(b) { high = b } else { low = a }
            }
            at(0.5 * (low + high))
        };
        let valley = |i: &usize| coarse[i - 1] >= coarse[*i] && coarse[*i] <= coarse[i + 1];
        (1..200).filter(valley).map(|i| refined(i as i32 - 100)).fold(f64::INFINITY, f64::min)
    }
}

fn control(shape: BlendShape) -> Machine {
    let mut machine = machine();
    machine.smoothing.shape = shape;
    machine
}

fn check_continuous(pieces: &[ContourPiece], what: &str) {
    let moving: Vec<&ContourPiece> = pieces.iter().filter(|piece| piece.curve().is_some()).collect();
    for pair in moving.windows(2) {
        let blended = pair.iter().any(|piece| matches!(piece.kind, PieceKind::Blend(..)));
        let [Some(before), Some(after)] = [pair[0].curve(), pair[1].curve()] else { continue };
        if pair[0].stop_at_end || !blended || [before, after].iter().any(|curve| matches!(curve, Curve::Blend(_))) {
            continue;
        }
        let (end, start) = (before.at(f64::INFINITY), after.at(0.0));
        assert!((end.first - start.first).norm() < 1e-9, "{what}: a kink after {:?}", pair[0].block);
        let bend = (end.second - start.second).norm();
        let scale = 1.0 + 1.0 / before.length_lu().min(after.length_lu());
        assert!(bend < 1e-8 * scale, "{what}: a step of {bend} after {:?}", pair[0].block);
    }
}

#[test]
fn blends_of_any_curves_go_on_smoothly_within_every_tolerance() {
    let mut seen = 0;
    for shape in [BlendShape::Hermite3, BlendShape::Quintic] {
        for mode in MODES {
            for seed in 0..8 {
                let mut random = Random(1000 + seed);
                let mut moves: Vec<Move> = Vec::new();
                let rho = 10f64.powf(2.0 * random.unit() - 2.5);
                let otol = 10f64.powf(2.0 * random.unit() - 4.0);
                for number in 1..=12 {
                    let from = moves.last().map_or(AxisVector::zero(), |moved| moved.end.0);
                    let mut moved = block(&mut random, number, from);
                    moved.modes.path_mode = mode;
                    moved.modes.contour_tolerance_mm = Some(rho);
                    let limits = ProgrammedLimits { orientation_tolerance_rad: Some(otol), ..Default::default() };
                    moved.modes.programmed = Some(Arc::new(limits));
                    moves.push(moved);
                }
                let what = format!("{shape:?} {mode:?} seed {seed}");
                let machine = control(shape);
                let pieces = run(&machine, &moves).0;
                check_contour(&moves, &pieces, &what);
                check_continuous(&pieces, &what);
                let programmed = programmed(&moves);
                for piece in &pieces {
                    let PieceKind::Blend(curve, corner) = &piece.kind else { continue };
                    let i = piece.block.number as usize;
                    let (before, after) = (&programmed[i - 1], &programmed[i]);
                    let box_of_axes = f64::sqrt(3.0);
                    let linear = match mode {
                        PathMode::G642 | PathMode::G645 => rho,
                        PathMode::G643 => rho * box_of_axes,
                        _ => 0.1 * box_of_axes,
                    };
                    let rotary = if mode == PathMode::G644 { f64::to_radians(0.1) } else { otol };
                    let reach = 1.3 * corner.transition_length_mm;
                    let allowed = Allowed { before, after, reach, linear, rotary };
                    let share = samples(curve).step_by(40).map(|q| allowed.share(q)).fold(0.0, f64::max);
                    assert!(share <= 1.0 + 1e-6, "{what}, block {i}: {share} of {linear} mm or {rotary} rad");
                    seen += 1;
                }
            }
        }
    }
    assert!(seen > 300, "{seen} blends");
}

/// Corners that almost turn back and almost go straight on, short and very short blocks, blocks of length 0.
#[test]
fn odd_corners_and_blocks_are_passed_without_a_gap() {
    for shape in [BlendShape::Hermite3, BlendShape::Quintic] {
        for mode in MODES {
            for seed in 0..20 {
                let mut random = Random(5000 + seed);
                let (mut heading, mut at) = (0.0_f64, vec![0.0; 4]);
                let mut points = Vec::new();
                for _ in 0..60 {
                    let choice = random.unit();
                    let turn = match (choice * 6.0) as u32 {
                        0 => std::f64::consts::PI - 10f64.powf(-5.0 * random.unit()),
                        1 => 10f64.powf(-6.0 * random.unit()),
                        2 => 1e-3 * (1.0 + 1e-6 * (random.unit() - 0.5)),
                        3 => std::f64::consts::PI,
                        _ => 6.0 * random.unit() - 3.0,
                    };
                    heading += if random.unit() < 0.5 { turn } else { -turn };
                    let length = if random.unit() < 0.15 { 0.0 } else { 10f64.powf(5.5 * random.unit() - 4.0) };
                    // Below that the direction of a block is the rounding of its ends.
                    let length = if seed % 2 == 0 { length } else { 1e-3 * length };
                    at[0] += length * heading.cos();
                    at[1] += length * heading.sin();
                    if random.unit() < 0.2 {
                        at[3] += 0.2 * (random.unit() - 0.5);
                    }
                    points.push(at.clone());
                }
                let mut moves = polyline(&points);
                moves.iter_mut().for_each(|moved| moved.modes.path_mode = mode);
                let what = format!("{shape:?} {mode:?} seed {seed}");
                let pieces = run(&control(shape), &moves).0;
                if seed % 2 == 0 {
                    check_contour(&moves, &pieces, &what);
                }
                let curves: Vec<&Curve> = pieces.iter().filter_map(ContourPiece::curve).collect();
                assert!(curves.windows(2).all(|pair| pair[0].end() == pair[1].start()), "{what}: a gap");
                for piece in &pieces {
                    let Some(curve) = piece.curve() else { continue };
                    for s in [0.0, 0.3, 0.5, 0.9, 1.0].map(|share| share * curve.length_lu()) {
                        let state = curve.at(s);
                        let numbers = [state.position.0, state.first, state.second, state.third];
                        let finite = numbers.iter().all(|vector| vector.as_slice().iter().all(|x| x.is_finite()));
                        assert!(finite, "{what}: {:?} at {s}: {state:?}", piece.block);
                    }
                }
            }
        }
    }
}

/// The tip turns back but for 2 degrees, and C has to go on meanwhile: a blend of microns would be crossed in half a minute.
#[test]
fn a_blend_that_takes_longer_than_a_stop_is_none() {
    for shape in [BlendShape::Hermite3, BlendShape::Quintic] {
        let centre_mm = [-0.166_558, -0.025_364];
        let (start, end) = ([0.0, 0.0], [-0.208_026, -0.188_659]);
        let angle = |p: [f64; 2]| (p[1] - centre_mm[1]).atan2(p[0] - centre_mm[0]);
        let sweep_rad = -(angle(start) - angle(end)).rem_euclid(std::f64::consts::TAU);
        let radius_mm = f64::hypot(end[0] - centre_mm[0], end[1] - centre_mm[1]);
        let mut moves = vec![line(1, &end), line(2, &[-0.1940, -0.1927, 0.0, -0.0702_f64.to_radians()])];
        moves[0].kind = MoveKind::Arc(ArcGeometry { plane: [X, Y], centre_mm, radius_mm, sweep_rad });
        moves.iter_mut().for_each(|moved| moved.modes.contour_tolerance_mm = Some(0.075));
        assert_eq!(kinds(&run(&control(shape), &moves).0), "l|l|", "{shape:?}");
        // The same corner, less sharp, is rounded.
        moves[1].end = point(&[-0.2, 0.2, 0.0, -0.0702_f64.to_radians()]);
        assert_eq!(kinds(&run(&control(shape), &moves).0), "lbl|", "{shape:?}");
    }
}

/// An arc that runs into a line turns back further on, where it does not in the corner (178.3 deg): the blend has a cusp, and the path stops. A few micrometres beside it there is none.
#[test]
fn a_blend_with_a_cusp_is_none() {
    for shape in [BlendShape::Hermite3, BlendShape::Quintic] {
        for (beside_mm, wanted) in [(-5e-3, "bl|"), (0.0, "|l|"), (2e-3, "bl|")] {
            let (centre_mm, start) = ([-1.137_45, 2.653_044], [-0.9823, 2.7093]);
            let end = [-1.145_854, 2.488_231];
            let mut moves = vec![line(1, &start), line(2, &end), line(3, &[-1.199_154, 2.492_531 + beside_mm])];
            let angle = |p: [f64; 2]| (p[1] - centre_mm[1]).atan2(p[0] - centre_mm[0]);
            let sweep_rad = (angle(end) - angle(start)).rem_euclid(std::f64::consts::TAU);
            let radius_mm = f64::hypot(end[0] - centre_mm[0], end[1] - centre_mm[1]);
            moves[1].kind = MoveKind::Arc(ArcGeometry { plane: [X, Y], centre_mm, radius_mm, sweep_rad });
            moves.iter_mut().for_each(|moved| moved.modes.contour_tolerance_mm = Some(0.045));
            let kinds = kinds(&run(&control(shape), &moves).0);
            assert!(kinds.ends_with(wanted), "{shape:?}, {beside_mm} mm beside it: {kinds}");
        }
    }
}
