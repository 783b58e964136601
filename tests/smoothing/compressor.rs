//! The compressor: tolerance at and between points, continuity, numbers, time, from outside.

use super::support::*;
use sollwert::base::AxisVector;
use sollwert::feed::Planner;
use sollwert::geometry::Curve;
use sollwert::interpreter::{Compressor, Event, Feed, Move, MoveKind};
use sollwert::kinematics::Kinematics;
use sollwert::machine::PathMode;
use sollwert::smoothing::{ContourPiece, PieceKind};

const KINDS: [Compressor; 4] = [Compressor::On, Compressor::Curvature, Compressor::Cad, Compressor::Surface];

/// A smooth curve in space, cut into short chords of varying length; points as a post processor writes them.
fn surface_path(seed: u64, count: usize, decimals: i32) -> Vec<Vec<f64>> {
    let mut random = Random(seed);
    let waves: Vec<[f64; 3]> =
        (0..6).map(|_| [random.unit() * 6.0, 0.02 + 0.1 * random.unit(), 6.0 * random.unit()]).collect();
    let digit = 10f64.powi(decimals);
    let at = |t: f64| -> Vec<f64> {
        let wave = |w: &[f64; 3]| w[0] * ((w[1] * t + w[2]).sin() - w[2].sin());
        let raw = [t + wave(&waves[0]), wave(&waves[1]) + wave(&waves[2]), 0.3 * (wave(&waves[3]) + wave(&waves[4]))];
        raw.iter().map(|component| (component * digit).round() / digit).collect()
    };
    let mut t = 0.0;
    (0..count)
        .map(|_| {
            t += 0.15 + 0.25 * random.unit();
            at(t)
        })
        .collect()
}

fn compressed(points: &[Vec<f64>], compressor: Compressor, tolerance_mm: f64) -> Vec<Move> {
    let mut moves = polyline(points);
    for moved in &mut moves {
        moved.modes.compressor = compressor;
        moved.modes.contour_tolerance_mm = Some(tolerance_mm);
    }
    moves
}

fn curves(pieces: &[ContourPiece]) -> Vec<&Curve> {
    pieces.iter().filter_map(ContourPiece::curve).collect()
}

fn polynomials(pieces: &[ContourPiece]) -> usize {
    curves(pieces).iter().filter(|curve| matches!(curve, Curve::Polynomial(_))).count()
}

#[test]
fn smooth_paths_become_smooth_curves_within_the_tolerance() {
    for compressor in KINDS {
        for seed in 1..=12 {
            let what = format!("{compressor:?}, seed {seed}");
            let points = surface_path(seed, 120, 4);
            let moves = compressed(&points, compressor, 0.01);
            let pieces = contour(&moves);
            check_contour(&moves, &pieces, &what);
            assert!(polynomials(&pieces) > 110, "{what}: {} of {}", polynomials(&pieces), pieces.len());
            let numbers: Vec<u64> = pieces.iter().map(|piece| piece.block.number).collect();
            assert!(numbers.windows(2).all(|pair| pair[0] <= pair[1]), "{what}: {numbers:?}");
            let mut chain = vec![vec![0.0; 3]];
            chain.extend(points.clone());
            let mut nearest = vec![f64::INFINITY; chain.len()];
            for piece in &pieces {
                let Some(curve) = piece.curve() else { continue };
                let i = piece.block.number as usize;
                let around: Vec<AxisVector> =
                    (i.saturating_sub(1)..=(i + 1).min(points.len())).map(|i| vector(&chain[i])).collect();
                for q in samples(curve) {
                    let distance = around
                        .windows(2)
                        .map(|pair| distance_to_segment(q, pair[0], pair[1]))
                        .fold(f64::INFINITY, f64::min);
                    assert!(distance <= 0.01, "{what}: {distance} off the programmed line at block {i}");
                    for j in [i - 1, i] {
                        nearest[j] = nearest[j].min((q - vector(&chain[j])).norm());
                    }
                }
            }
            for (i, distance) in nearest.iter().enumerate() {
                assert!(*distance <= 0.01, "{what}: point {i} missed by {distance}");
            }
            // Direction, and but for COMPON curvature, go on from curve to curve; by finite differences of positions, too.
            for pair in curves(&pieces).windows(2) {
                let [Curve::Polynomial(a), Curve::Polynomial(b)] = pair else { continue };
                let kink = (a.at(f64::INFINITY).first - b.at(0.0).first).norm();
                assert!(kink < 1e-9, "{what}: a kink of {kink}");
                let step = (a.at(f64::INFINITY).second - b.at(0.0).second).norm();
                if compressor != Compressor::On {
                    assert!(step < 1e-6, "{what}: a step of curvature of {step}");
                }
                let h = 1e-4;
                let [l, p, r] = [a.at(a.length_lu() - h), b.at(0.0), b.at(h)].map(|state| state.position.0);
                let turn = ((r - p) - (p - l)).norm() / h;
                assert!(turn < 1e-2, "{what}: {turn}");
            }
        }
    }
}

#[test]
fn compon_has_steps_of_curvature_and_compcad_takes_the_rounding_out() {
    let points = surface_path(3, 200, 3);
    let roughness = |compressor: Compressor| {
        let pieces = contour(&compressed(&points, compressor, 0.01));
        let (mut steps, mut jumps): (f64, f64) = (0.0, 0.0);
        for pair in curves(&pieces).windows(2) {
            let [Curve::Polynomial(a), Curve::Polynomial(b)] = pair else { continue };
            steps = steps.max((a.at(f64::INFINITY).second - b.at(0.0).second).norm());
            jumps += (a.at(0.0).second - b.at(0.0).second).norm();
        }
        (steps, jumps)
    };
    let [on, curvature, cad, surface] = KINDS.map(roughness);
    assert!(on.0 > 1e-4 && curvature.0 < 1e-6 && cad.0 < 1e-6 && surface.0 < 1e-6, "{on:?} {curvature:?} {cad:?}");
    assert!(cad.1 < 0.7 * curvature.1 && surface.1 < cad.1, "{curvature:?} {cad:?} {surface:?}");
}

fn time_of(moves: &[Move]) -> f64 {
    let machine = machine();
    let (kinematics, mut planner) = (Kinematics::new(&machine), Planner::new(&machine));
    let mut time_s = 0.0;
    for piece in contour(moves) {
        planner.push(kinematics.to_joint(piece)).expect("a piece that can be driven");
        while let Some(planned) = planner.pop() {
            time_s += planned.law.duration_s();
        }
    }
    planner.finish();
    while let Some(planned) = planner.pop() {
        time_s += planned.law.duration_s();
    }
    time_s
}

#[test]
fn a_compressed_path_is_driven_faster() {
    for seed in 1..=4 {
        let points = surface_path(seed, 200, 5);
        let plain = time_of(&compressed(&points, Compressor::Off, 0.01));
        let cad = time_of(&compressed(&points, Compressor::Cad, 0.01));
        assert!(cad < plain, "seed {seed}: {cad} s with, {plain} s without");
    }
}

#[test]
fn a_run_ends_where_the_program_says_so() {
    let points: Vec<Vec<f64>> = (1..=20)
        .map(|i| {
            let a = f64::from(i) * 0.05;
            vec![10.0 * a.sin(), 10.0 - 10.0 * a.cos()]
        })
        .collect();
    let with = |change: &dyn Fn(&mut Move)| {
        let mut moves = compressed(&points, Compressor::Curvature, 0.05);
        change(&mut moves[9]);
        let pieces = contour(&moves);
        (polynomials(&pieces), moves, pieces)
    };
    let (whole, ..) = with(&|_| ());
    assert_eq!(whole, 20);
    let (_, moves, pieces) = with(&|moved| moved.events = vec![Event::MFunction(8)]);
    check_contour(&moves, &pieces, "M8");
    let begins = pieces.iter().find(|piece| !piece.events.is_empty()).expect("M8");
    assert_eq!(begins.block.number, 10);
    // What is no short G1 goes on as it is.
    let (_, _, pieces) = with(&|moved| {
        moved.kind = MoveKind::Rapid;
        moved.feed = Feed::Rapid;
    });
    let compressed_10 = |piece: &ContourPiece| {
        piece.block.number == 10 && matches!(&piece.kind, PieceKind::Block(Curve::Polynomial(_)))
    };
    assert!(!pieces.iter().any(compressed_10));
    let (_, _, pieces) = with(&|moved| moved.modes.path_mode = PathMode::ExactStop);
    assert!(pieces.iter().any(|piece| piece.block.number == 10 && piece.stop_at_end));
}

#[test]
fn corners_and_long_blocks_stay() {
    // A square of short blocks: the corners are rounded by the path mode, nothing else is touched.
    let mut points = Vec::new();
    for i in 1..=10 {
        points.push(vec![f64::from(i), 0.0]);
    }
    for i in 1..=10 {
        points.push(vec![10.0, f64::from(i)]);
    }
    let moves = compressed(&points, Compressor::Cad, 0.01);
    let pieces = contour(&moves);
    check_contour(&moves, &pieces, "square");
    assert_eq!(corners(&pieces).len(), 1);
    let distance = |q: AxisVector| {
        distance_to_segment(q, vector(&[0.0]), vector(&[10.0])).min(distance_to_segment(
            q,
            vector(&[10.0]),
            vector(&[10.0, 10.0]),
        ))
    };
    for curve in curves(&pieces) {
        assert!(samples(curve).map(distance).fold(0.0, f64::max) <= 0.01);
    }
    // Blocks of 25 mm are longer than the machine's 20 mm.
    let points: Vec<Vec<f64>> = (1..=6)
        .map(|i| {
            let a = f64::from(i) * 0.02;
            vec![1250.0 * a.sin(), 1250.0 - 1250.0 * a.cos()]
        })
        .collect();
    assert_eq!(polynomials(&contour(&compressed(&points, Compressor::Cad, 1.0))), 0);
}

#[test]
fn memory_does_not_grow_with_the_run() {
    let points = surface_path(5, 400, 4);
    let moves = compressed(&points, Compressor::Surface, 0.01);
    let mut smoother = sollwert::smoothing::Smoother::new(&machine());
    let mut begun = 0;
    for (i, next) in moves.iter().enumerate() {
        smoother.push(next.clone(), &mut |piece| begun += piece.blocks_begun as usize);
        assert!(i + 1 - begun <= 8, "{} blocks are held back after {}", i + 1 - begun, i + 1);
    }
}
