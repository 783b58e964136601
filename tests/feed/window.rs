//! The look-ahead: what a window may know, that it can always stop, and that its bookkeeping changes nothing.

use crate::support::{Program, Random, plan, spinner, total_s};
use sollwert::feed::{PlannedPiece, Planner};
use sollwert::kinematics::JointPath;
use sollwert::machine::{Machine, PathMode};
use sollwert::smoothing::PieceKind;

fn speeds(planned: &[PlannedPiece]) -> Vec<f64> {
    planned.iter().map(|piece| piece.law.at(0.0).velocity_lu_s).collect()
}

fn windowed(blocks: usize) -> Machine {
    let mut machine = spinner();
    machine.look_ahead_blocks = blocks;
    machine
}

/// Random programs: blends, unrounded corners, exact stops, arcs and dwells.
fn programs() -> impl Iterator<Item = (u64, Program)> {
    (0..40).map(|seed| {
        let mut random = Random::new(seed);
        let mode = [PathMode::G642, PathMode::G64, PathMode::ExactStop][seed as usize % 3];
        let shortest_mm = [0.01, 0.3][seed as usize % 2];
        let walk = random.walk(60, shortest_mm, [2.0, 50.0][seed as usize / 2 % 2]);
        let mut program = Program::polyline(mode, random.logarithmic(300.0, 12_000.0), &walk);
        if seed % 4 == 0 {
            let end = program.end().0;
            let (x, y) = (end.as_slice()[0], end.as_slice()[1]);
            program.arc([x + 3.0, y], -2.0, 0.0);
            program.dwell(0.05);
            program.line(&[x, y - 20.0]);
        }
        (seed, program)
    })
}

/// Hands all pieces over at once: the window must see no more for it, and a piece's law must not depend on it.
#[test]
fn pieces_beyond_the_window_are_not_seen() {
    for (seed, program) in programs() {
        let machine = windowed(5);
        let one_by_one = program.planned(&machine);
        let mut planner = Planner::new(&machine);
        for path in program.paths(&machine) {
            planner.push(path).unwrap();
        }
        let early: Vec<PlannedPiece> = std::iter::from_fn(|| planner.pop()).collect();
        planner.finish();
        let all: Vec<_> = early.into_iter().chain(std::iter::from_fn(|| planner.pop())).collect();
        assert_eq!(all.len(), one_by_one.len(), "seed {seed}");
        for (a, b) in all.iter().zip(&one_by_one) {
            assert_eq!(a.law, b.law, "seed {seed} line {}", a.path.contour.block.line);
            assert!(a.buffered_blocks <= 5 || a.buffered_blocks >= b.buffered_blocks);
        }
    }
}

/// Without a rest inside, a piece is fixed exactly when so many blocks are known beyond it.
#[test]
fn a_piece_waits_for_a_full_window() {
    let points: Vec<[f64; 2]> = (1..=20).map(|i| [f64::from(i), f64::from(i % 2)]).collect();
    let machine = windowed(8);
    let mut paths = Program::polyline(PathMode::G642, 3000.0, &points).paths(&machine);
    // The last one ends at rest.
    paths.pop();
    let mut planner = Planner::new(&machine);
    let (mut known, mut fixed) = (0, 0);
    for path in paths {
        known += path.contour.blocks_begun;
        planner.push(path).unwrap();
        while let Some(piece) = planner.pop() {
            fixed += piece.path.contour.blocks_begun;
            assert_eq!(piece.buffered_blocks, 8);
            assert_eq!(known, fixed + 8);
        }
    }
    assert_eq!(fixed, 19 - 8);
}

/// Whatever was fixed, the rest of what the window held suffices to stop: a path cut off there still has a law for every piece.
#[test]
fn it_can_always_stop_inside_the_window() {
    for (seed, program) in programs() {
        for window in [0, 1, 2, 5] {
            let machine = windowed(window);
            let paths = program.paths(&machine);
            let mut planner = Planner::new(&machine);
            let mut paths = paths.into_iter();
            for _ in 0..paths.len() / 2 {
                if let Some(path) = paths.next() {
                    planner.push(path).unwrap();
                }
                while planner.pop().is_some() {}
            }
            // The program ends here instead.
            planner.finish();
            let rest: Vec<_> = std::iter::from_fn(|| planner.pop()).collect();
            for piece in &rest {
                continuous_inside(piece, seed);
            }
            if let Some(last) = rest.last() {
                let end = last.law.at(last.law.duration_s());
                assert!(end.velocity_lu_s.abs() < 1e-9, "seed {seed} window {window}: {}", end.velocity_lu_s);
            }
        }
    }
}

/// A law whose ramps did not fit would have been squeezed: its jerk tells.
fn continuous_inside(piece: &PlannedPiece, seed: u64) {
    let limits = spinner().axes[0].limits;
    for phase in piece.law.phases() {
        // The weakest direction of two equal axes is at most sqrt(2) times faster than one axis.
        let most = limits.jerk_max_lu_s3 * 2.0_f64.sqrt() * 1.001;
        assert!(phase.jerk_lu_s3.abs() <= most, "seed {seed}: jerk {}", phase.jerk_lu_s3);
    }
}

/// A window as long as the path finds what two passes over the whole path find.
#[test]
fn a_window_beyond_the_path_gives_the_global_solution() {
    for (seed, program) in programs() {
        let long = program.planned(&windowed(1000));
        let longer = program.planned(&windowed(100_000));
        assert_eq!(speeds(&long), speeds(&longer), "seed {seed}");
        for (before, after) in long.iter().zip(&long[1..]) {
            let left = before.law.at(before.law.duration_s()).velocity_lu_s;
            let entered = after.law.at(0.0).velocity_lu_s;
            assert!((left - entered).abs() <= 1e-9 * entered.max(1e-3), "seed {seed}: {left} {entered}");
        }
    }
}

/// The time never gets shorter because less is seen. (A ramp from rest may end faster than one from a low speed, because both end
/// without acceleration: a thousandth is left for that.)
#[test]
fn a_shorter_window_is_never_faster() {
    for (seed, program) in programs() {
        let times: Vec<f64> =
            [1, 2, 3, 5, 8, 20, 100].map(|window| total_s(&program.planned(&windowed(window)))).to_vec();
        for (shorter, longer) in times.iter().zip(&times[1..]) {
            assert!(*longer <= shorter * (1.0 + 1e-3), "seed {seed}: {times:?}");
        }
    }
}

/// The backward pass ends where nothing changes. Handing over one piece after another and asking each time must give the very
/// same as a new planner that is told everything up to there in one go: the kept speeds are those of a pass from scratch.
#[test]
fn the_kept_speeds_are_those_of_a_pass_from_scratch() {
    for (seed, program) in programs().step_by(3) {
        let machine = windowed(12);
        let paths = program.paths(&machine);
        let mut kept = Planner::new(&machine);
        let mut popped = 0;
        for (i, path) in paths.iter().enumerate() {
            kept.push(path.clone()).unwrap();
            while kept.pop().is_some() {
                popped += 1;
            }
            let rest = |mut planner: Planner| {
                planner.finish();
                std::iter::from_fn(move || planner.pop()).collect::<Vec<_>>()
            };
            let mut fresh = Planner::new(&machine);
            for path in &paths[..=i] {
                fresh.push(path.clone()).unwrap();
            }
            let (a, b) = (rest(kept.clone()), rest(fresh));
            for (a, b) in a.iter().zip(&b[popped..]) {
                assert_eq!(a.law, b.law, "seed {seed} piece {i}");
            }
        }
    }
}

/// A polyline takes as long backwards as forwards.
#[test]
fn a_path_takes_as_long_in_reverse() {
    for seed in 0..20 {
        let mut random = Random::new(100 + seed);
        let mut walk = random.walk(40, 0.3, 30.0);
        walk.insert(0, [0.0, 0.0]);
        let machine = windowed(1000);
        let time_s = |points: &[[f64; 2]]| {
            let shifted: Vec<[f64; 2]> =
                points[1..].iter().map(|p| [p[0] - points[0][0], p[1] - points[0][1]]).collect();
            total_s(&Program::polyline(PathMode::G642, 6000.0, &shifted).planned(&machine))
        };
        let forwards_s = time_s(&walk);
        walk.reverse();
        let backwards_s = time_s(&walk);
        assert!((forwards_s - backwards_s).abs() <= 2e-3 * forwards_s, "seed {seed}: {forwards_s} {backwards_s}");
    }
}

/// Nothing gets stuck or turns into NaN on lengths far below anything a machine resolves.
#[test]
fn microscopic_pieces_pass() {
    for mode in [PathMode::G64, PathMode::G642, PathMode::ExactStop] {
        let mut points = vec![[1.0, 0.0]];
        for i in 0..50 {
            points.push([1.0 + f64::from(i) * 1.1e-9, f64::from(i % 3) * 1e-9]);
        }
        points.push([20.0, 3.0]);
        let planned = Program::polyline(mode, 3000.0, &points).planned(&windowed(8));
        assert!(planned.iter().all(|piece| piece.law.duration_s().is_finite()));
        assert!(total_s(&planned) < 20.0, "{mode:?}: {}", total_s(&planned));
    }
}

/// Blocks so short that their blends touch: the speed still rises to the programmed feed and falls to rest.
#[test]
fn a_chain_of_blends_reaches_the_feed() {
    let points: Vec<[f64; 2]> =
        (1..=400).map(|i| f64::from(i) * 0.005).map(|a| [100.0 * a.sin(), 100.0 - 100.0 * a.cos()]).collect();
    let planned = Program::polyline(PathMode::G642, 1500.0, &points).planned(&windowed(100));
    let blends = planned.iter().filter(|piece| matches!(piece.path.contour.kind, PieceKind::Blend(..))).count();
    assert!(blends >= 398, "{blends}");
    let fastest = speeds(&planned).into_iter().fold(0.0, f64::max);
    assert!((fastest - 25.0).abs() < 1e-9, "{fastest}");
}

/// A copy of the planner goes on exactly like the original.
#[test]
fn a_clone_goes_on_the_same() {
    let (_, program) = programs().nth(4).unwrap_or_else(|| panic!("no program"));
    let machine = windowed(6);
    let paths: Vec<JointPath> = program.paths(&machine);
    let mut planner = Planner::new(&machine);
    for path in &paths[..20] {
        planner.push(path.clone()).unwrap();
    }
    while planner.pop().is_some() {}
    let finish = |mut planner: Planner| {
        for path in &paths[20..] {
            planner.push(path.clone()).unwrap();
        }
        planner.finish();
        std::iter::from_fn(move || planner.pop()).collect::<Vec<_>>()
    };
    assert_eq!(finish(planner.clone()), finish(planner));
    assert_eq!(plan(&machine, paths.clone()).len(), paths.len());
}
