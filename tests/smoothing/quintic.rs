//! `shape = "quintic"`: no step of curvature anywhere on a rounded path, and tolerances seen from outside.

use super::support::*;
use sollwert::base::{AxisId, AxisVector};
use sollwert::geometry::Curve;
use sollwert::interpreter::{Move, ProgrammedLimits};
use sollwert::machine::{BlendShape, Machine, PathMode};
use sollwert::smoothing::{ContourPiece, PieceKind};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

const C: AxisId = AxisId::new(3);

fn quintic() -> Machine {
    let mut machine = machine();
    machine.smoothing.shape = BlendShape::Quintic;
    machine
}

fn rounded(moves: &[Move]) -> Vec<ContourPiece> {
    run(&quintic(), moves).0
}

fn blends(pieces: &[ContourPiece]) -> Vec<&Curve> {
    let blend = |piece: &'_ ContourPiece| matches!(piece.kind, PieceKind::Blend(..));
    pieces.iter().filter(|piece| blend(piece)).filter_map(ContourPiece::curve).collect()
}

/// Direction and curvature of all axes go on from piece to piece wherever the path does not rest; `turn` is what flat joints may turn.
fn check_smooth(pieces: &[ContourPiece], turn: f64, what: &str) {
    let moving: Vec<&ContourPiece> = pieces.iter().filter(|piece| piece.curve().is_some()).collect();
    for pair in moving.windows(2) {
        if pair[0].stop_at_end {
            continue;
        }
        let [Some(before), Some(after)] = [pair[0].curve(), pair[1].curve()] else { continue };
        let (end, start) = (before.at(f64::INFINITY), after.at(0.0));
        assert!((end.first - start.first).norm() <= turn, "{what}: a kink after {:?}", pair[0].block);
        let bend = 1.0 / before.length_lu().min(after.length_lu());
        assert!(
            (end.second - start.second).norm() < 1e-9 * bend,
            "{what}: a step of curvature after {:?}",
            pair[0].block
        );
    }
}

#[test]
fn random_polylines_have_no_step_of_curvature_and_keep_the_tolerance() {
    for seed in 0..40 {
        let mut random = Random(seed);
        let mut points = random.polyline(3, 60);
        let rho = 10f64.powf(3.0 * random.unit() - 3.0);
        let mut moves = polyline(&points);
        moves.iter_mut().for_each(|moved| moved.modes.contour_tolerance_mm = Some(rho));
        let pieces = rounded(&moves);
        let what = format!("seed {seed}");
        check_contour(&moves, &pieces, &what);
        check_smooth(&pieces, 1e-3, &what);
        points.insert(0, vec![0.0; 3]);
        let mut rounded_corners = 0;
        for piece in &pieces {
            let PieceKind::Blend(curve, corner) = &piece.kind else { continue };
            rounded_corners += 1;
            let i = piece.block.number as usize;
            let [a, p, b] = [i - 1, i, i + 1].map(|i| vector(&points[i]));
            let from_lines = |q: AxisVector| distance_to_segment(q, a, p).min(distance_to_segment(q, p, b));
            let farthest = samples(curve).map(from_lines).fold(0.0, f64::max);
            assert!(farthest <= 0.8 * rho * (1.0 + 1e-9), "{what}: {farthest} > {rho} at {i}");
            // The corner itself is what the path keeps away from most: epsilon, and never more than beta times CTOL.
            let missed = samples(curve).map(|q| (q - p).norm()).fold(f64::INFINITY, f64::min);
            close(missed, corner.tolerance_mm, 1e-9 * (1.0 + missed), &what);
            assert!(missed <= 0.8 * rho * (1.0 + 1e-9), "{what}: {missed} > {rho} at {i}");
        }
        assert!(rounded_corners > 10, "{what}");
    }
}

#[test]
fn the_whole_tolerance_is_used_where_blocks_are_long() {
    for degrees in [0.2, 5.0, 30.0, 60.0, 89.0, 120.0, 150.0, 175.0, 178.8] {
        let turn = f64::to_radians(degrees);
        let mut moves = polyline(&[vec![5e3, 0.0], vec![5e3 + 5e3 * turn.cos(), 5e3 * turn.sin()]]);
        moves.iter_mut().for_each(|moved| moved.modes.contour_tolerance_mm = Some(0.1));
        let pieces = rounded(&moves);
        assert_eq!(kinds(&pieces), "lbl|", "{degrees}");
        let curve = blends(&pieces)[0];
        let missed = samples(curve).map(|q| (q - vector(&[5e3])).norm()).fold(f64::INFINITY, f64::min);
        let beta = if turn > FRAC_PI_2 { 0.6 } else { 0.8 };
        close(missed, beta * 0.1, 1e-6, &format!("{degrees} deg"));
        check_smooth(&pieces, 1e-9, &format!("{degrees} deg"));
    }
}

#[test]
fn rotary_axes_go_along_within_their_tolerance_without_a_step() {
    for (otol, atol) in [(1e-4, None), (1e-1, Some(2e-5)), (1e-1, None)] {
        for turn in [0.3, FRAC_PI_2, 2.5] {
            let (sin, cos) = f64::sin_cos(turn);
            let mut moves =
                polyline(&[vec![20.0, 0.0, 0.0, 0.5], vec![20.0 + 20.0 * cos, 20.0 * sin, 3.0, 0.0], vec![0.0; 4]]);
            let mut limits = ProgrammedLimits { orientation_tolerance_rad: Some(otol), ..Default::default() };
            limits.axis_tolerance_lu[C] = atol;
            moves.iter_mut().for_each(|moved| {
                moved.modes.programmed = Some(Arc::new(limits.clone()));
                moved.modes.contour_tolerance_mm = Some(0.1);
            });
            let pieces = rounded(&moves);
            let what = format!("{otol} {atol:?} {turn}");
            assert_eq!(kinds(&pieces), "lblbl|", "{what}");
            check_contour(&moves, &pieces, &what);
            check_smooth(&pieces, 1e-9, &what);
            let curve = blends(&pieces)[0];
            // The programmed C is 0.5 at the corner and less on both sides.
            let highest = samples(curve).map(|q| q[C]).fold(0.0, f64::max);
            let allowed = atol.unwrap_or(otol);
            assert!(0.5 - highest <= allowed * (1.0 + 1e-9), "{what}: {}", 0.5 - highest);
            let corner = vector(&[20.0]);
            let linear = |q: AxisVector| AxisVector::from_fn(|axis| if axis == C { 0.0 } else { q[axis] });
            let missed = samples(curve).map(|q| (linear(q) - corner).norm()).fold(f64::INFINITY, f64::min);
            assert!(missed <= 0.08 * (1.0 + 1e-9), "{what}: {missed}");
            // One of both is used up, or half of the block is.
            let used = (missed / 0.06).max((0.5 - highest) / allowed);
            assert!(used > 0.4, "{what}: {used}");
        }
    }
}

#[test]
fn short_blocks_are_all_blend_and_stay_smooth() {
    // A fine polygon: every block is cut in half by the blends at both of its ends.
    let points: Vec<Vec<f64>> = (1..=60)
        .map(|i| {
            let angle = PI * f64::from(i) / 30.0;
            vec![angle.cos() - 1.0, angle.sin()]
        })
        .collect();
    let moves = polyline(&points);
    let pieces = rounded(&moves);
    check_contour(&moves, &pieces, "polygon");
    check_smooth(&pieces, 1e-9, "polygon");
    assert_eq!(blends(&pieces).len(), 59);
    assert!(pieces.len() <= 62, "{}", kinds(&pieces));
}

#[test]
fn a_distance_is_kept_as_programmed() {
    let mut moves = polyline(&[vec![20.0, 0.0], vec![20.0, 20.0], vec![21.0, 20.0]]);
    moves.iter_mut().for_each(|moved| {
        moved.modes.path_mode = PathMode::G641;
        moved.modes.rounding_distance_mm = Some(0.7);
    });
    let pieces = rounded(&moves);
    let lengths: Vec<f64> = corners(&pieces).iter().map(|corner| corner.transition_length_mm).collect();
    assert_eq!(lengths, [0.7, 0.5]);
    close(pieces[0].curve().unwrap().length_lu(), 19.3, 1e-12, "the line is cut there");
    check_smooth(&pieces, 1e-9, "ADIS");
}
