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
            // Points of the programmed line, too, are near the curve: no chord is left out.
            let curve: Vec<AxisVector> = pieces.iter().filter_map(ContourPiece::curve).flat_map(samples_16).collect();
            for (i, pair) in chain.windows(2).enumerate() {
                let middle = (vector(&pair[0]) + vector(&pair[1])) * 0.5;
                let near = curve.iter().map(|q| (*q - middle).norm()).fold(f64::INFINITY, f64::min);
                assert!(near <= 0.01 + 0.02, "{what}: the middle of chord {i} is {near} from the curve");
            }
            check_borders(&pieces, compressor, &what);
        }
    }
}

fn samples_16(curve: &Curve) -> impl Iterator<Item = AxisVector> + '_ {
    (0..16).map(|i| curve.at(curve.length_lu() * f64::from(i) / 16.0).position.0)
}

/// Direction goes on from block to block; but for COMPON curvature, too; with COMPCAD and COMPSURF the third derivative.
fn check_borders(pieces: &[ContourPiece], compressor: Compressor, what: &str) {
    for pair in curves(pieces).windows(2) {
        let [Curve::Polynomial(a), Curve::Polynomial(b)] = pair else { continue };
        let (end, start) = (a.at(f64::INFINITY), b.at(0.0));
        let kink = (end.first - start.first).norm();
        assert!(kink < 1e-9, "{what}: a kink of {kink}");
        let step = (end.second - start.second).norm();
        assert!(compressor == Compressor::On || step < 1e-9, "{what}: a step of curvature of {step}");
        let step = (end.third - start.third).norm();
        let smoothest = matches!(compressor, Compressor::Cad | Compressor::Surface);
        assert!(!smoothest || step < 1e-7, "{what}: the third derivative steps by {step}");
        let h = 1e-4;
        let [l, p, r] = [a.at(a.length_lu() - h), start, b.at(h)].map(|state| state.position.0);
        let turn = ((r - p) - (p - l)).norm() / h;
        assert!(turn < 1e-2, "{what}: {turn}");
    }
}

/// Greatest step of curvature and of the third derivative at block borders, how many borders have such a step, the greatest third
/// derivative, how many programmed points are on the curve.
struct Roughness {
    curvature_steps: f64,
    third_steps: f64,
    borders: usize,
    third: f64,
    points_met: usize,
}

fn roughness(points: &[Vec<f64>], compressor: Compressor, tolerance_mm: f64) -> Roughness {
    let pieces = contour(&compressed(points, compressor, tolerance_mm));
    let mut found = Roughness { curvature_steps: 0.0, third_steps: 0.0, borders: 0, third: 0.0, points_met: 0 };
    let curves = curves(&pieces);
    for pair in curves.windows(2) {
        let (end, start) = (pair[0].at(f64::INFINITY), pair[1].at(0.0));
        found.curvature_steps = found.curvature_steps.max((end.second - start.second).norm());
        let step = (end.third - start.third).norm();
        found.third_steps = found.third_steps.max(step);
        found.borders += usize::from(step > 1e-7);
    }
    // Away from the ends, where a fit sees one side only.
    for curve in &curves[20..curves.len() - 20] {
        for i in 0..=16 {
            found.third = found.third.max(curve.at(curve.length_lu() * f64::from(i) / 16.0).third.norm());
        }
    }
    for (curve, point) in curves.iter().zip(points) {
        found.points_met += usize::from((curve.end().0 - vector(point)).norm() < 1e-9);
    }
    found
}

#[test]
fn every_mode_has_what_another_has_not() {
    for seed in 1..=3 {
        let points = surface_path(seed, 400, 3);
        let [on, curvature, cad, surface] = KINDS.map(|kind| roughness(&points, kind, 0.01));
        // COMPON: curvature steps; the others: it does not.
        assert!(on.curvature_steps > 1e-4, "{seed}: {}", on.curvature_steps);
        for other in [&curvature, &cad, &surface] {
            assert!(other.curvature_steps < 1e-9, "{seed}: {}", other.curvature_steps);
        }
        // COMPON and COMPCURV go through programmed points where a polynomial ends, and their third derivative steps there.
        for (mode, what) in [(&on, "on"), (&curvature, "curvature")] {
            assert!(mode.third_steps > 1e-5 && mode.points_met >= mode.borders, "{seed} {what}: {}", mode.points_met);
            // One polynomial spans many blocks.
            assert!(mode.borders < 40, "{seed} {what}: {} polynomials for 400 blocks", mode.borders);
        }
        // COMPCAD and COMPSURF take the rounding out: no programmed point is met but by chance.
        for (mode, what) in [(&cad, "cad"), (&surface, "surface")] {
            assert!(mode.third_steps < 1e-7 && mode.points_met < 3, "{seed} {what}: {}", mode.points_met);
        }
        // The waves of the path have third derivatives of about 0.1³ times 6 at most.
        assert!(cad.third < 0.02 && surface.third < 0.02, "{seed}: {} {}", cad.third, surface.third);
    }
}

/// The curve of a path from `start`, densely.
fn driven(start: &[f64], points: &[Vec<f64>], compressor: Compressor) -> Vec<AxisVector> {
    let mut moves = compressed(&[&[start.to_vec()], points].concat(), compressor, 0.01);
    // To the start without the compressor.
    moves[0].modes.compressor = Compressor::Off;
    moves[0].modes.path_mode = PathMode::ExactStop;
    let pieces = contour(&moves);
    curves(&pieces).into_iter().skip(1).flat_map(samples_16).collect()
}

/// Greatest distance of the middle half of one curve from another.
fn apart(one: &[AxisVector], other: &[AxisVector]) -> f64 {
    let middle = one[one.len() / 4..3 * one.len() / 4].iter().step_by(7);
    let distances = middle
        .map(|q| other.windows(2).map(|pair| distance_to_segment(*q, pair[0], pair[1])).fold(f64::INFINITY, f64::min));
    distances.fold(0.0, f64::max)
}

#[test]
fn compsurf_comes_out_alike_whichever_way_and_from_wherever_the_path_comes() {
    let (mut sums, mut worst) = ([0.0; 2], [0.0_f64; 2]);
    for seed in 1..=6 {
        let points = surface_path(seed, 400, 3);
        let mut back = points.clone();
        back.reverse();
        let (last, rest) = back.split_first().expect("points");
        for (index, kind) in [Compressor::Cad, Compressor::Surface].into_iter().enumerate() {
            let whole = driven(&[0.0, 0.0, 0.0], &points, kind);
            let reversed = driven(last, rest, kind);
            let later = driven(&points[40], &points[41..], kind);
            let difference = apart(&whole, &reversed).max(apart(&whole, &later));
            sums[index] += difference;
            worst[index] = worst[index].max(difference);
        }
    }
    // Compared with a tolerance of 0.01 mm and points rounded to 0.001 mm.
    assert!(worst[1] < 1e-3, "COMPSURF {worst:?}");
    assert!(sums[0] > 2.0 * sums[1], "COMPCAD does what COMPSURF does: {sums:?}");
}

#[test]
fn noise_is_taken_out_of_a_straight_line() {
    // Half a tolerance of noise every 0.2 mm: curvature of the program's polyline is noise alone, up to 4 * 0.002 / 0.2².
    let mut random = Random(7);
    let points: Vec<Vec<f64>> = (1..=400).map(|i| vec![0.2 * f64::from(i), 0.004 * (random.unit() - 0.5)]).collect();
    for compressor in [Compressor::Cad, Compressor::Surface] {
        let rough = roughness(&points, compressor, 0.01);
        assert!(rough.third < 5e-3, "{compressor:?}: {}", rough.third);
        assert!(
            roughness(&points, compressor, 0.0005).third > rough.third,
            "{compressor:?}: the tolerance says nothing"
        );
    }
}

#[test]
fn a_helix_with_a_rotary_axis_keeps_both_tolerances() {
    let digits = |value: f64| (value * 1e3).round() / 1e3;
    let points: Vec<Vec<f64>> = (1..=300)
        .map(|i| {
            let a = f64::from(i) * 0.02;
            let c = 0.3 * (2.0 * a).sin();
            vec![digits(15.0 * a.sin()), digits(15.0 - 15.0 * a.cos()), digits(2.0 * a), c]
        })
        .collect();
    let orientation_rad = 0.1_f64.to_radians();
    for compressor in KINDS {
        let moves = compressed(&points, compressor, 0.01);
        let pieces = contour(&moves);
        check_contour(&moves, &pieces, "helix");
        assert!(polynomials(&pieces) > 290, "{compressor:?}: {}", polynomials(&pieces));
        for (i, piece) in pieces.iter().enumerate() {
            let Some(curve) = piece.curve() else { continue };
            let number = piece.block.number as usize;
            let [from, to] = [number - 1, number].map(|j| if j == 0 { vector(&[]) } else { vector(&points[j - 1]) });
            for q in samples(curve) {
                // Nearest place on the programmed chord and its neighbours: there C is off by less than OTOL and what C turns
                // within a tolerance of the path.
                let (linear_q, mut best) = (vector(&q.as_slice()[..3]), (f64::INFINITY, 0.0));
                for j in number.saturating_sub(2)..(number + 1).min(points.len()) {
                    let [a, b] = [j.checked_sub(1).map_or(vector(&[]), |j| vector(&points[j])), vector(&points[j])];
                    let [la, lb] = [a, b].map(|p| vector(&p.as_slice()[..3]));
                    let share = ((linear_q - la).dot(&(lb - la)) / (lb - la).dot(&(lb - la))).clamp(0.0, 1.0);
                    let distance = (linear_q - la - (lb - la) * share).norm();
                    if distance < best.0 {
                        best = (distance, (q - a - (b - a) * share).as_slice()[3].abs());
                    }
                }
                assert!(best.0 <= 0.01, "{compressor:?}: {} mm off at block {i}, {from:?} {to:?}", best.0);
                assert!(
                    best.1 <= orientation_rad + 0.01 * 0.6 / 15.0,
                    "{compressor:?}: {} rad off at block {i}",
                    best.1
                );
            }
        }
    }
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

/// Two compressed blocks with a corner between them: where the first one is all of the tolerance away from its points, half of it is no room for a blend, but a
/// part of it is. The corner stayed, as in G64.
#[test]
fn a_corner_beside_a_compressed_block_that_uses_the_tolerance_is_rounded() {
    let points: Vec<Vec<f64>> =
        [[-0.42494, -3.12392, 0.0], [-0.83839, -7.91188, 0.21753], [-0.06771, -14.41088, 0.76147]]
            .map(Vec::from)
            .into();
    let moves = compressed(&points, Compressor::Curvature, 0.05);
    let pieces = contour(&moves);
    check_contour(&moves, &pieces, "corner");
    assert_eq!(corners(&pieces).len(), 1);
    let mut ends = vec![vector(&[0.0])];
    ends.extend(points.iter().map(|point| vector(point)));
    let distance = |q: AxisVector| {
        ends.windows(2).map(|pair| distance_to_segment(q, pair[0], pair[1])).fold(f64::INFINITY, f64::min)
    };
    for curve in curves(&pieces) {
        assert!(samples(curve).map(distance).fold(0.0, f64::max) <= 0.05);
    }
}

#[test]
fn memory_does_not_grow_with_the_run() {
    for compressor in KINDS {
        let points = surface_path(5, 3000, 4);
        let moves = compressed(&points, compressor, 0.01);
        let mut smoother = sollwert::smoothing::Smoother::new(&machine());
        let mut begun = 0;
        for (i, next) in moves.iter().enumerate() {
            smoother.push(next.clone(), &mut |piece| begun += piece.blocks_begun as usize);
            // 48 spans of 12 blocks, and one.
            assert!(i + 1 - begun <= 600, "{compressor:?}: {} blocks are held back after {}", i + 1 - begun, i + 1);
        }
    }
}
