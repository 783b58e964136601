//! The error budget: chords, blends and drives against closed forms.

use crate::made::{signal, trace};
use sollwert::compare::{budget, machine_of};
use sollwert::trace::{TimeGrid, Trace};
use std::fmt::Write as _;

/// A recording of `program` whose set-points pass through `points` at 1 s each, with straight lines of 100 samples between.
fn recorded(program: &str, points: &[[f64; 2]]) -> Trace {
    let n = 100 * (points.len() - 1) + 1;
    let times = TimeGrid::Uniform { start_ns: 0.0, step_ns: 1e7, count: n };
    let at = |t: f64, axis: usize| {
        let i = (t.floor() as usize).min(points.len() - 2);
        points[i][axis] + (t - i as f64) * (points[i + 1][axis] - points[i][axis])
    };
    let mut made = trace(vec![
        signal("X.position_setpoint_mm", "mm", &times, |t| at(t, 0)),
        signal("Y.position_setpoint_mm", "mm", &times, |t| at(t, 1)),
    ]);
    let machine = include_str!("../../machines/spinner_mvc850.toml");
    made.machine = Some(("spinner_mvc850.toml".into(), machine.into()));
    let source = sollwert::program::ProgramSource::from_bytes("part.mpf", program.as_bytes());
    made.programs = vec![source.opened(sollwert::program::ProgramId(0))];
    made
}

#[test]
fn chords_of_a_circle_are_off_by_their_sagitta() {
    let radius_mm = 50.0;
    let count = 60;
    let mut program = String::from("N1 G1 X50 Y0 F1000\n");
    let mut points = vec![[0.0, 0.0], [radius_mm, 0.0]];
    for k in 1..=count {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(count);
        let point = [radius_mm * angle.cos(), radius_mm * angle.sin()];
        let _ = writeln!(program, "G1 X{:.9} Y{:.9}", point[0], point[1]);
        points.push(point);
    }
    let made = recorded(&program, &points);
    let found = budget(&made, machine_of(&made).as_ref(), None);
    assert!(found.missing.is_empty(), "{:?}", found.missing);
    let chord = found.chord.expect("chords");
    // R (1 - cos(pi / n)).
    let sagitta_um = 1000.0 * radius_mm * (1.0 - (std::f64::consts::PI / f64::from(count)).cos());
    assert!((chord.figures.max - sagitta_um).abs() < 0.01 * sagitta_um, "{} {sagitta_um}", chord.figures.max);
    // The first block leads to the circle: it is straight, and its corner is meant.
    assert!((chord.figures.bias - sagitta_um * f64::from(count) / f64::from(count + 1)).abs() < 0.01 * sagitta_um);
    // The set-points are the program.
    assert!(found.interpolator.expect("set-points").figures.max < 1e-3);
}

#[test]
fn a_cut_corner_is_an_error_of_the_interpolator_in_its_line() {
    let made = recorded("G1 X20 F1000\nG1 Y20\n", &[[0.0, 0.0], [19.9, 0.0], [20.0, 0.1], [20.0, 20.0]]);
    let found = budget(&made, machine_of(&made).as_ref(), None);
    // Middle of a chamfer of 0.1 by 0.1: 0.05 from either leg.
    let interpolator = found.interpolator.expect("set-points");
    assert!((interpolator.figures.max - 50.0).abs() < 0.5, "{:?}", interpolator.figures);
    assert_eq!(found.chord.expect("blocks").figures.max, 0.0);
}

#[test]
fn another_path_than_the_program_is_said_and_not_judged() {
    let made = recorded("G1 X20 F1000\nG1 Y20\n", &[[0.0, 0.0], [0.0, 50.0], [-40.0, 50.0]]);
    let found = budget(&made, machine_of(&made).as_ref(), None);
    assert!(found.interpolator.is_none() && found.chord.is_none() && found.missing.len() == 1, "{:?}", found.missing);
    let without = trace(made.signals.clone());
    assert!(budget(&without, None, None).missing[0].message.contains("machine file"));
}
