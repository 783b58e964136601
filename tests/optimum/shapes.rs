//! Closed forms, and the shipped programs.

use crate::outside::used;
use crate::support::{Program, spinner};
use sollwert::kernel::{PieceSource, Preparation};
use sollwert::machine::{Machine, PathMode};
use sollwert::optimum::{Collector, Optimum};
use sollwert::program::ProgramSource;
use std::path::Path;

/// What the limits may be exceeded by between the places that a motion gives.
pub const EXCEEDED_SHARE: f64 = 1e-4;

pub fn fastest(program: &Program, machine: &Machine) -> Optimum {
    let mut collector = Collector::new(machine);
    for piece in program.planned(machine) {
        collector.push(&piece);
    }
    collector.solve(&mut |_, _| {}).expect("an optimum")
}

/// The optimum of a shipped program, and the time of the control.
pub fn shipped(program: &str, machine: &str, sets: &[&str]) -> (Machine, Optimum, f64) {
    let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
    let machine = sollwert::machine::load(machine, &sets).expect("a machine").machine;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("programs").join(program);
    let mut preparation = Preparation::new(ProgramSource::from_file(&path).expect("a program"), &machine);
    let mut collector = Collector::new(&machine);
    let mut control_s = 0.0;
    while let Some(piece) = preparation.next_piece() {
        control_s += piece.law.duration_s();
        collector.push(&piece);
    }
    (machine, collector.solve(&mut |_, _| {}).expect("an optimum"), control_s)
}

/// Seconds from rest to rest on a line: seven phases (models/local-smoothing.md section 5), long enough for each.
fn seven_phases_s(length: f64, v: f64, a: f64, j: f64) -> f64 {
    let ramp_s = if v <= a * a / j { 2.0 * (v / j).sqrt() } else { v / a + a / j };
    assert!(length >= v * ramp_s);
    2.0 * ramp_s + (length - v * ramp_s) / v
}

#[test]
fn a_line_takes_its_seven_phases() {
    for (feed_mm_min, length) in [(10_000.0, 100.0), (1_500.0, 10.0), (30_000.0, 400.0)] {
        let mut program = Program::new(PathMode::ExactStop, feed_mm_min);
        program.line(&[length]);
        let v = (feed_mm_min / 60.0_f64).min(20_000.0 / 60.0);
        let expected = seven_phases_s(length, v, 1000.0, 15_000.0);
        let machine = spinner();
        let optimum = fastest(&program, &machine);
        let off = optimum.time_s / expected - 1.0;
        eprintln!("line {length}: {off:e} after {} rounds on {} points", optimum.rounds, optimum.grid_points);
        assert!((-1e-6..2e-3).contains(&off), "{length} mm take {} s instead of {expected} s", optimum.time_s);
        let used = used(&optimum, &machine);
        assert!(used.largest() < 1.0 + EXCEEDED_SHARE, "{used:?}");
    }
}

/// Without a limit of jerk: trapezoids.
#[test]
fn brisk_is_a_trapezoid() {
    let mut program = Program::new(PathMode::ExactStop, 6000.0);
    program.modes.acceleration_mode = sollwert::machine::AccelerationMode::Brisk;
    program.line(&[50.0]);
    let machine = spinner();
    let optimum = fastest(&program, &machine);
    let expected = 50.0 / 100.0 + 100.0 / 1000.0;
    assert!((optimum.time_s / expected - 1.0).abs() < 2e-3, "{} s instead of {expected} s", optimum.time_s);
}

#[test]
fn dwells_and_rests_count() {
    let mut program = Program::new(PathMode::ExactStop, 10_000.0);
    program.line(&[100.0]);
    program.dwell(0.5);
    program.line(&[0.0]);
    let optimum = fastest(&program, &spinner());
    let expected = 2.0 * seven_phases_s(100.0, 10_000.0 / 60.0, 1000.0, 15_000.0) + 0.5;
    assert!((optimum.time_s / expected - 1.0).abs() < 2e-3, "{} s instead of {expected} s", optimum.time_s);
    assert_eq!((optimum.rest_s, optimum.motions.len()), (0.5, 2));
}

#[test]
fn shipped_programs_keep_their_limits_and_are_no_slower_than_the_control() {
    for (program, machine) in [
        ("corners.mpf", "spinner_mvc850"),
        ("spline.mpf", "huron_kx10"),
        ("circle.mpf", "spinner_mvc850"),
        ("circle.mpf", "xyzbc"),
    ] {
        let (checked, optimum, control_s) = shipped(program, machine, &[]);
        let used = used(&optimum, &checked);
        let Optimum { time_s, grid_points, rounds, .. } = &optimum;
        eprintln!(
            "{program} on {machine}: {control_s:.4} s, optimum {time_s:.4} s, {grid_points} points, {rounds} rounds"
        );
        assert!(used.largest() < 1.0 + EXCEEDED_SHARE, "{program} on {machine}: {used:?}");
        assert!(
            optimum.time_s < control_s * 1.002,
            "{program} on {machine}: {} s, the control {control_s} s",
            optimum.time_s
        );
    }
}
