//! G641 to G645: what distinguishes them, and that each keeps its tolerance when looked at from outside.

use super::support::*;
use sollwert::base::{AxisId, AxisVector};
use sollwert::geometry::Curve;
use sollwert::interpreter::{ArcGeometry, Feed, Move, MoveKind, ProgrammedLimits};
use sollwert::machine::PathMode;
use sollwert::smoothing::{ContourPiece, PieceKind};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

const MODES: [PathMode; 4] = [PathMode::G642, PathMode::G643, PathMode::G644, PathMode::G645];

fn with_mode(mut moves: Vec<Move>, mode: PathMode, tolerance_mm: f64) -> Vec<Move> {
    for moved in &mut moves {
        moved.modes.path_mode = mode;
        moved.modes.contour_tolerance_mm = Some(tolerance_mm);
    }
    moves
}

fn bend(turn: f64, mode: PathMode, tolerance_mm: f64) -> Vec<Move> {
    with_mode(polyline(&[vec![50.0, 0.0], vec![50.0 + 50.0 * turn.cos(), 50.0 * turn.sin()]]), mode, tolerance_mm)
}

fn blends(pieces: &[ContourPiece]) -> Vec<&Curve> {
    let blend = |piece: &'_ ContourPiece| matches!(piece.kind, PieceKind::Blend(..));
    pieces.iter().filter(|piece| blend(piece)).filter_map(ContourPiece::curve).collect()
}

fn length_of(moves: &[Move]) -> f64 {
    corners(&contour(moves))[0].transition_length_mm
}

#[test]
fn every_mode_has_a_transition_of_its_own() {
    let turn = f64::to_radians(30.0);
    let turns = [1.0 - turn.cos(), turn.sin()];
    // |V - U| = 2 sin(15 deg), beta = 0.8, alpha = 2.5.
    let published = 8.0 * 0.8 * 0.1 / (1.5 * 2.0 * f64::sin(turn / 2.0));
    close(length_of(&bend(turn, PathMode::G642, 0.1)), published, 1e-12, "G642");
    close(length_of(&bend(turn, PathMode::G645, 0.1)), published, 1e-12, "G645");
    // Of every axis 3/16 T |turn|: the greater range is that of X, which turns least.
    close(length_of(&bend(turn, PathMode::G643, 0.1)), 16.0 * 0.1 / (3.0 * turns[0]), 1e-9, "G643");
    // The machine's 0.1 mm, whatever CTOL says; Y binds.
    for tolerance_mm in [0.001, 0.1, 3.0] {
        let found = length_of(&bend(turn, PathMode::G644, tolerance_mm));
        close(found / (16.0 * 0.1 / (3.0 * turns[1])), 0.95, 0.051, "G644");
    }
}

#[test]
fn g643_leaves_the_line_axis_by_axis() {
    let turn = f64::to_radians(30.0);
    let pieces = contour(&bend(turn, PathMode::G643, 0.1));
    let curve = blends(&pieces)[0];
    let reach_y = 16.0 * 0.1 / (3.0 * turn.sin());
    for i in 0..=1000 {
        let q = curve.at(curve.length_lu() * f64::from(i) / 1000.0).position.0;
        let outside_y = q[X] < 50.0 - reach_y - 0.1;
        assert!(!outside_y || q[Y].abs() < 1e-12, "Y has left its line at X = {}", q[X]);
    }
    // Long before Y, X has begun to slow down: the path is a straight line there, but X is not where G642 would have it per Y.
    assert!(curve.start().0[X] < 50.0 - 3.0 * reach_y, "{:?}", curve.start());
    // Deviation of each axis in the middle: its whole tolerance.
    let middle = samples(curve).map(|q| (q - vector(&[50.0, 0.0])).norm()).fold(f64::INFINITY, f64::min);
    assert!(middle <= 0.1 * f64::sqrt(2.0) + 1e-9 && middle > 0.1, "{middle}");
}

/// Whatever the ranges of the axes differ by, no piece of the blend is as short as rounding; the corner is no further away than
/// both axes together may deviate.
#[test]
fn g643_has_no_splinters_where_ranges_are_almost_equal() {
    for exponent in 1..=15 {
        for sign in [-1.0, 1.0] {
            let turn = FRAC_PI_2 + sign * 10.0_f64.powi(-exponent);
            let pieces = contour(&bend(turn, PathMode::G643, 0.1));
            let Curve::Polynomial(curve) = blends(&pieces)[0] else { panic!("a polynomial") };
            let mut borders: Vec<f64> = [0.0, curve.length_lu()].into_iter().chain(curve.nodes_lu()).collect();
            borders.sort_by(f64::total_cmp);
            let shortest = borders.windows(2).map(|pair| pair[1] - pair[0]).filter(|lu| *lu > 0.0);
            let shortest = shortest.fold(f64::INFINITY, f64::min);
            assert!(shortest > 2e-4 * curve.length_lu(), "{turn}: {shortest} of {}", curve.length_lu());
            let curve = blends(&pieces)[0];
            let nearest = samples(curve).map(|q| (q - vector(&[50.0, 0.0])).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest <= 0.1 * f64::sqrt(2.0) + 1e-9, "{turn}: {nearest}");
        }
    }
}

#[test]
fn polynomial_blends_have_no_step_of_curvature() {
    for mode in [PathMode::G643, PathMode::G644] {
        let moves = bend(1.0, mode, 0.1);
        let pieces = contour(&moves);
        check_contour(&moves, &pieces, "bend");
        let curve = blends(&pieces)[0];
        for s in [0.0, curve.length_lu()] {
            assert!(curve.at(s).second.norm() < 1e-9, "{mode:?}: {:?}", curve.at(s).second);
        }
    }
    // The published blend has one: that is why they are different modes.
    let pieces = contour(&bend(1.0, PathMode::G642, 0.1));
    assert!(blends(&pieces)[0].at(0.0).second.norm() > 0.01);
}

#[test]
fn atol_of_an_axis_holds_for_that_axis() {
    for mode in [PathMode::G642, PathMode::G643, PathMode::G645] {
        let mut moves = bend(FRAC_PI_2, mode, 0.1);
        let mut limits = ProgrammedLimits::default();
        limits.axis_tolerance_lu[Y] = Some(0.004);
        moves[0].modes.programmed = Some(Arc::new(limits));
        let pieces = contour(&moves);
        let curve = blends(&pieces)[0];
        if mode == PathMode::G643 {
            // Where the programmed path is in the corner, X lacks its 0.1 mm and Y is ahead by its 0.004 mm.
            let passes = samples(curve).map(|q| (q - vector(&[49.9, 0.004])).norm()).fold(f64::INFINITY, f64::min);
            assert!(passes < 2e-3, "{passes}");
        } else {
            let middle = curve.at(curve.length_lu() / 2.0).position.0;
            assert!(middle[Y] <= 0.004 + 1e-9 && middle[Y] > 0.0039, "{mode:?}: {middle:?}");
        }
    }
}

#[test]
fn tolerance_holds_from_outside_in_every_mode() {
    for mode in MODES {
        for seed in 0..25 {
            let what = format!("{mode:?}, seed {seed}");
            let mut random = Random(seed);
            let mut points = random.polyline(3, 50);
            let rho = if mode == PathMode::G644 { 0.1 } else { 10f64.powf(3.0 * random.unit() - 3.0) };
            let moves = with_mode(polyline(&points), mode, rho);
            let pieces = contour(&moves);
            check_contour(&moves, &pieces, &what);
            points.insert(0, vec![0.0; 3]);
            // Tolerances of three axes at once are a box.
            let allowed = if matches!(mode, PathMode::G642 | PathMode::G645) { rho } else { rho * f64::sqrt(3.0) };
            for piece in &pieces {
                let PieceKind::Blend(curve, _) = &piece.kind else { continue };
                let i = piece.block.number as usize;
                let [a, p, b] = [i - 1, i, i + 1].map(|i| vector(&points[i]));
                let farthest = samples(curve)
                    .map(|q| distance_to_segment(q, a, p).min(distance_to_segment(q, p, b)))
                    .fold(0.0, f64::max);
                assert!(farthest <= allowed, "{what}: {farthest} > {allowed} at {i}");
            }
        }
    }
}

/// X 50, then a left arc of 20 mm about (50, 20) or, with a corner of `turn`, about another centre.
fn line_and_arc(turn: f64, radius_mm: f64, sense: f64) -> (Vec<Move>, [f64; 2]) {
    let heading = turn + sense * FRAC_PI_2;
    let centre_mm = [50.0 + radius_mm * heading.cos(), radius_mm * heading.sin()];
    let sweep_rad = sense * 1.2;
    let from = (-centre_mm[1]).atan2(50.0 - centre_mm[0]) + sweep_rad;
    let end = [centre_mm[0] + radius_mm * from.cos(), centre_mm[1] + radius_mm * from.sin()];
    let mut moves = polyline(&[vec![50.0, 0.0], end.to_vec()]);
    moves[1].kind = MoveKind::Arc(ArcGeometry { plane: [X, Y], centre_mm, radius_mm, sweep_rad });
    (moves, centre_mm)
}

#[test]
fn corners_with_arcs_keep_the_tolerance() {
    for mode in MODES {
        for turn in [-2.0, -0.5, 0.3, 1.5, 2.8] {
            for sense in [1.0, -1.0] {
                let (moves, centre) = line_and_arc(turn, 20.0, sense);
                let moves = with_mode(moves, mode, 0.05);
                let pieces = contour(&moves);
                let what = format!("{mode:?} {turn} {sense}");
                assert_eq!(kinds(&pieces), "lbl|", "{what}");
                check_contour(&moves, &pieces, &what);
                let allowed = match mode {
                    PathMode::G642 | PathMode::G645 => 0.05,
                    PathMode::G643 => 0.05 * f64::sqrt(2.0),
                    _ => 0.1 * f64::sqrt(2.0),
                };
                let curve = blends(&pieces)[0];
                let from_line = |q: AxisVector| distance_to_segment(q, vector(&[0.0]), vector(&[50.0]));
                let from_arc = |q: AxisVector| ((q - vector(&centre)).norm() - 20.0).abs();
                let farthest = samples(curve).map(|q| from_line(q).min(from_arc(q))).fold(0.0, f64::max);
                assert!(farthest <= allowed && farthest > 0.05 * allowed, "{what}: {farthest}");
                // Same curvature as the arc where it goes on into it.
                let step = (pieces[1].curve().unwrap().at(f64::INFINITY).second
                    - pieces[2].curve().unwrap().at(0.0).second)
                    .norm();
                assert!(step < 1e-7, "{what}: {step}");
            }
        }
    }
}

#[test]
fn g645_alone_rounds_steps_of_curvature() {
    for mode in MODES {
        let (moves, centre) = line_and_arc(0.0, 20.0, 1.0);
        let moves = with_mode(moves, mode, 0.05);
        let pieces = contour(&moves);
        if mode != PathMode::G645 {
            assert_eq!(kinds(&pieces), "ll|", "{mode:?}");
            continue;
        }
        assert_eq!(kinds(&pieces), "lbl|");
        check_contour(&moves, &pieces, "transition");
        let curve = blends(&pieces)[0];
        let distance = |q: AxisVector| {
            let arc = ((q - vector(&centre)).norm() - 20.0).abs();
            if q[X] < 50.0 { arc.min(q[Y].abs()) } else { arc }
        };
        let farthest = samples(curve).map(distance).fold(0.0, f64::max);
        assert!(farthest <= 0.005 && farthest > 0.0005, "{farthest}");
        close(curve.at(0.0).second.norm(), 0.0, 1e-9, "curvature of the line");
        close(curve.at(f64::INFINITY).second.norm(), 1.0 / 20.0, 1e-9, "curvature of the arc");
        // In between it has no step: by finite differences.
        let step = curve.length_lu() / 400.0;
        for i in 0..400 {
            let [a, b] = [i, i + 1].map(|i| curve.at(f64::from(i) * step).second);
            assert!((a - b).norm() < 0.002, "{} at {i}", (a - b).norm());
        }
    }
}

#[test]
fn rotary_axes_move_along_within_otol() {
    for mode in MODES {
        let mut moves = with_mode(polyline(&[vec![20.0, 0.0, 0.0, 0.5], vec![20.0, 20.0, 0.0, 0.0]]), mode, 0.1);
        let limits = ProgrammedLimits { orientation_tolerance_rad: Some(1e-4), ..Default::default() };
        moves[0].modes.programmed = Some(Arc::new(limits));
        let pieces = contour(&moves);
        assert_eq!(kinds(&pieces), "lbl|", "{mode:?}");
        check_contour(&moves, &pieces, "rotary");
        let c = AxisId::new(3);
        let curve = blends(&pieces)[0];
        let highest = samples(curve).map(|q| q[c]).fold(0.0, f64::max);
        let allowed = if mode == PathMode::G644 { f64::to_radians(0.1) } else { 1e-4 };
        assert!(0.5 - highest <= allowed + 1e-12 && 0.5 - highest > 0.5e-4, "{mode:?}: {}", 0.5 - highest);
    }
}

#[test]
fn stolf_counts_between_two_rapids_only() {
    let with = |rapid: [bool; 2], mode: PathMode| {
        let mut moves = bend(FRAC_PI_2, mode, 0.1);
        for (moved, rapid) in moves.iter_mut().zip(rapid) {
            let limits = ProgrammedLimits { rapid_tolerance_ratio: Some(3.0), ..Default::default() };
            moved.modes.programmed = Some(Arc::new(limits));
            if rapid {
                moved.kind = MoveKind::Rapid;
                moved.feed = Feed::Rapid;
            }
        }
        length_of(&moves)
    };
    let own = length_of(&bend(FRAC_PI_2, PathMode::G642, 0.1));
    close(with([true, true], PathMode::G642), 3.0 * own, 1e-12, "G0 G0");
    for rapid in [[true, false], [false, true], [false, false]] {
        close(with(rapid, PathMode::G642), own, 1e-12, "next to G1");
    }
}

#[test]
fn a_distance_rounds_arcs_and_rotary_axes_alike() {
    let (mut moves, _) = line_and_arc(1.0, 20.0, -1.0);
    for moved in &mut moves {
        moved.modes.path_mode = PathMode::G641;
        moved.modes.rounding_distance_mm = Some(0.7);
    }
    close(length_of(&moves), 0.7, 0.0, "ADIS");
    let pieces = contour(&moves);
    close(pieces[0].curve().unwrap().length_lu(), 49.3, 1e-12, "the line is cut there");
}
