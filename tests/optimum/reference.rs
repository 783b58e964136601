//! Against tools/optimum_reference.py.
//!
//! The reference has 300 steps of time a case; its own time with 150 steps tells how far it is from the limit of many. Ours may differ by
//! what both leave out: 1 % is asked for, as in the task of this figure. Measured: see the test's output.

use crate::outside::used;
use crate::shapes::{EXCEEDED_SHARE, fastest};
use crate::support::{Program, point, spinner};
use sollwert::base::{AxisVector, PerAxis};
use sollwert::interpreter::{Feed, MoveKind, PolynomialGeometry, PolynomialPiece};
use sollwert::machine::PathMode;
use std::f64::consts::TAU;
use std::sync::Arc;

const REFERENCE: &str = include_str!("reference.csv");

/// Least time of a case with the most steps.
fn reference_s(case: &str) -> f64 {
    let rows = REFERENCE.lines().filter_map(|line| line.strip_prefix(case)?.strip_prefix(','));
    let times: Vec<(u32, f64)> = rows
        .map(|row| row.split_once(',').expect("steps, time"))
        .map(|(steps, time)| (steps.parse().expect("steps"), time.parse().expect("a time")))
        .collect();
    let [(150, coarse), (300, fine)] = times[..] else { panic!("{case}: {times:?}") };
    assert!((coarse / fine - 1.0).abs() < 5e-3, "{case}: the reference itself is not settled: {coarse}, {fine}");
    fine
}

fn compare(case: &str, program: &Program) {
    let machine = spinner();
    let optimum = fastest(program, &machine);
    let expected = reference_s(case);
    let off = optimum.time_s / expected - 1.0;
    eprintln!("{case}: {:.5} s, reference {expected:.5} s, {off:+.2e}", optimum.time_s);
    assert!(off.abs() < 0.01, "{case}: {} s, the reference {expected} s", optimum.time_s);
    let used = used(&optimum, &machine);
    assert!(used.largest() < 1.0 + EXCEEDED_SHARE, "{case}: {used:?}");
}

#[test]
fn straight_lines() {
    let mut program = Program::new(PathMode::G64, 10_000.0);
    program.line(&[100.0]);
    compare("line", &program);
    let mut program = Program::new(PathMode::G64, 30_000.0);
    program.line(&[30.0, 40.0]);
    compare("diagonal", &program);
}

#[test]
fn a_line_with_a_slow_middle() {
    let mut program = Program::new(PathMode::G64, 6000.0);
    program.line(&[40.0]);
    program.feed = Feed::Path { feed_lu_s: 20.0 };
    program.line(&[60.0]);
    program.feed = Feed::Path { feed_lu_s: 100.0 };
    program.line(&[100.0]);
    compare("slow_middle", &program);
}

#[test]
fn full_circles() {
    for (case, radius, feed) in [("circle_at_feed", 20.0, 3000.0), ("circle_at_limits", 5.0, 10_000.0)] {
        let mut program = Program::new(PathMode::G64, feed);
        // The circle begins at the origin, in the direction of +Y.
        program.arc([-radius, 0.0], TAU, 0.0);
        compare(case, &program);
    }
}

#[test]
fn a_cubic() {
    let mut program = Program::new(PathMode::G64, 30_000.0);
    let vector = |x: f64, y: f64| -> AxisVector { point(&[x, y]).0 };
    let nothing: AxisVector = PerAxis::splat(0.0);
    let numerator_lu = [nothing, vector(100.0, 100.0), vector(0.0, -400.0), vector(0.0, 300.0), nothing, nothing];
    let denominator_ratio = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let piece = PolynomialPiece { parameter_end_ratio: 1.0, numerator_lu, denominator_ratio };
    program.push(MoveKind::Polynomial(Arc::new(PolynomialGeometry { pieces: vec![piece] })), point(&[100.0, 0.0]));
    compare("cubic", &program);
}
