//! What is a corner where the linear axes have none: of a rotary axis that goes along, and inside a curve.

use super::support::*;
use sollwert::base::AxisVector;
use sollwert::interpreter::{Move, MoveKind, PolynomialGeometry, PolynomialPiece, ProgrammedLimits};
use sollwert::machine::PathMode;
use sollwert::smoothing::PieceKind;
use std::sync::Arc;

const C: usize = 3;
const ROUNDING: [PathMode; 5] = [PathMode::G641, PathMode::G642, PathMode::G643, PathMode::G644, PathMode::G645];

fn driven(points: &[Vec<f64>], mode: PathMode) -> Vec<Move> {
    let mut moves = polyline(points);
    for moved in &mut moves {
        moved.modes.path_mode = mode;
        moved.modes.contour_tolerance_mm = Some(0.05);
        moved.modes.rounding_distance_mm = Some(1.0);
        let limits = ProgrammedLimits { orientation_tolerance_rad: Some(1e-3), ..ProgrammedLimits::default() };
        moved.modes.programmed = Some(Arc::new(limits));
    }
    moves
}

/// X in equal steps, C in degrees along it.
fn straight(step_mm: f64, degrees: impl Fn(f64) -> f64) -> Vec<Vec<f64>> {
    (1..=60).map(f64::from).map(|i| vec![step_mm * i, 0.0, 0.0, degrees(step_mm * i).to_radians()]).collect()
}

/// The way back visits the same points.
fn reversed(points: &[Vec<f64>]) -> Vec<Vec<f64>> {
    points.iter().rev().skip(1).cloned().collect()
}

#[test]
fn a_step_of_a_rotary_axis_is_a_corner_both_ways() {
    for mode in ROUNDING {
        let there = vec![vec![100.0, 0.0, 0.0, 0.0], vec![200.0, 0.0, 0.0, 0.0175], vec![210.0, 0.0, 0.0, 0.0175]];
        let mut points = there.clone();
        points.push(vec![210.0, 50.0, 0.0, 0.0175]);
        points.push(vec![210.0, 0.0, 0.0, 0.0175]);
        points.extend(reversed(&there));
        let moves = driven(&points, mode);
        let pieces = contour(&moves);
        check_contour(&moves, &pieces, &format!("{mode:?}"));
        // Both corners of C there, the corner to the stop in between, both corners of C back.
        assert_eq!(kinds(&pieces), "lblblbl|lblbll|".replace("ll|", "l|"), "{mode:?}");
        let blends: Vec<_> = pieces.iter().filter(|piece| matches!(piece.kind, PieceKind::Blend(..))).collect();
        for blend in blends {
            let curve = blend.curve().expect("a curve");
            let missed = |q: AxisVector| {
                let [x, c] = [q.as_slice()[0], q.as_slice()[C]];
                (c - 0.0175 * ((x - 100.0) / 100.0).clamp(0.0, 1.0)).abs()
            };
            let most = samples(curve).map(missed).fold(0.0, f64::max);
            // G641 and G644 have no OTOL.
            assert!(
                most <= 1e-3 + 1e-12 || !matches!(mode, PathMode::G642 | PathMode::G643 | PathMode::G645),
                "{mode:?}: {most}"
            );
        }
    }
}

#[test]
fn rounding_of_programmed_points_is_no_corner_and_a_curve_of_a_rotary_axis_is_none_before_it_bends() {
    let thousandths = |degrees: f64| (degrees * 1000.0).round() / 1000.0;
    for mode in ROUNDING {
        for step_mm in [0.01, 0.1, 1.0, 20.0] {
            // A straight line, rounded to 0.001 deg.
            for slope in [0.0007, 0.0123, 0.31] {
                let moves = driven(&straight(step_mm, |x| thousandths(slope * x)), mode);
                let pieces = contour(&moves);
                assert!(corners(&pieces).is_empty(), "{mode:?}: {step_mm} mm, {slope} deg/mm: {}", kinds(&pieces));
            }
        }
        // The orientation of a five-axis program in short blocks bends less than its points are rounded.
        let dense = driven(&straight(0.1, |x| thousandths(5.0 * (0.1 * x).sin())), mode);
        assert!(corners(&contour(&dense)).is_empty(), "{mode:?}");
        // The same in blocks of 10 mm has a corner between any two.
        let sparse = driven(&straight(10.0, |x| thousandths(5.0 * (0.1 * x).sin())), mode);
        assert!(corners(&contour(&sparse)).len() >= 55, "{mode:?}");
    }
}

fn polynomial(x: [f64; 2], y: f64, mode: PathMode) -> Move {
    let mut numerator_lu = [AxisVector::zero(); 6];
    numerator_lu[1] = vector(&[x[0], y]);
    numerator_lu[2] = vector(&[x[1]]);
    let piece =
        PolynomialPiece { parameter_end_ratio: 1.0, numerator_lu, denominator_ratio: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0] };
    let mut moved = line(1, &[x[0] + x[1], y]);
    moved.kind = MoveKind::Polynomial(Arc::new(PolynomialGeometry { pieces: vec![piece] }));
    moved.modes.path_mode = mode;
    moved
}

#[test]
fn outside_g64_a_curve_rests_where_it_turns_back_inside() {
    for mode in ROUNDING.into_iter().chain([PathMode::ExactStop, PathMode::G64]) {
        let moves = [polynomial([20.0, -30.0], 0.0, mode)];
        let pieces = contour(&moves);
        check_contour(&moves, &pieces, &format!("{mode:?}"));
        let expected = if mode == PathMode::G64 { "l|" } else { "l|l|" };
        assert_eq!(kinds(&pieces), expected, "{mode:?}");
        if mode != PathMode::G64 {
            let at = pieces[0].curve().expect("a curve").end().0.as_slice()[0];
            close(at, 10.0 / 3.0, 1e-9, "turns back");
            let whole = pieces[0].block_length_lu.expect("a part");
            close(whole, 10.0 / 3.0 + 10.0 / 3.0 + 10.0, 1e-9, "the whole block");
        }
        // A curve that bends, however sharply, has no corner.
        assert_eq!(kinds(&contour(&[polynomial([20.0, -30.0], 0.5, mode)])), "l|", "{mode:?}");
    }
}

#[test]
fn a_tolerance_of_0_is_said() {
    for (mode, said) in [
        (PathMode::G641, false),
        (PathMode::G642, true),
        (PathMode::G643, true),
        (PathMode::G644, false),
        (PathMode::G645, true),
        (PathMode::G64, false),
    ] {
        let mut moves = polyline(&[vec![10.0], vec![10.0, 10.0]]);
        for moved in &mut moves {
            moved.modes.path_mode = mode;
            moved.modes.contour_tolerance_mm = Some(0.0);
            moved.modes.rounding_distance_mm = Some(0.0);
        }
        let (_, mut smoother) = run(&machine(), &moves);
        let codes: Vec<_> = smoother.take_warnings().iter().map(|warning| warning.code).collect();
        assert_eq!(codes.contains(&"S0001"), said, "{mode:?}: {codes:?}");
    }
}
