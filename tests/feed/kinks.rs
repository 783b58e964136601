//! Corners that are easily overlooked: of a rotary axis that goes along a straight line, and inside a spline or polynomial. From outside: the positions
//! that are sent keep every limit of every axis by differences, under both laws, wherever the mode is not G64.

use crate::support::{Program, point, sample, spinner, total_s, with_rotary};
use sollwert::base::AxisVector;
use sollwert::interpolator::Setpoint;
use sollwert::interpreter::{Feed, MoveKind, PolynomialGeometry, PolynomialPiece};
use sollwert::machine::{Machine, PathMode, TimeLawKind};
use std::sync::Arc;

const LAWS: [TimeLawKind; 2] = [TimeLawKind::SevenPhase, TimeLawKind::Continuous];
const ROUNDING: [PathMode; 5] = [PathMode::G641, PathMode::G642, PathMode::G643, PathMode::G644, PathMode::G645];

fn under(machine: Machine, law: TimeLawKind) -> Machine {
    let mut machine = machine;
    machine.feed.time_law = law;
    machine.look_ahead_blocks = 50;
    machine
}

fn program(mode: PathMode, feed_mm_min: f64) -> Program {
    let mut program = Program::new(mode, feed_mm_min);
    program.modes.rounding_distance_mm = Some(5.0);
    program
}

/// Greatest velocity, acceleration and jerk of any axis over its limit, from rest to rest.
fn greatest(machine: &Machine, setpoints: &[Setpoint]) -> [f64; 3] {
    let t_s = machine.cycle.time_base.setpoint_period_s();
    let mut greatest: [f64; 3] = [0.0; 3];
    for axis in machine.axis_ids() {
        let limits = &machine.axis(axis).limits;
        let last = setpoints.len() as isize - 1;
        let q = |k: isize| setpoints[k.clamp(0, last) as usize].axes[axis].position_lu;
        for k in -3..=last {
            let v = (q(k + 1) - q(k)) / t_s;
            let a = (q(k + 2) - 2.0 * q(k + 1) + q(k)) / t_s.powi(2);
            // Rounding of the place on the path: 1e-12 mm, a few times.
            let j = (q(k + 3) - 3.0 * q(k + 2) + 3.0 * q(k + 1) - q(k)).abs() - 1e-11;
            let jerk_lu_s3 = limits.jerk_max_lu_s3.max(limits.transition_jerk_max_lu_s3);
            let shares = [v.abs() / limits.velocity_max_lu_s, a.abs() / limits.acceleration_max_lu_s2];
            greatest[0] = greatest[0].max(shares[0]);
            greatest[1] = greatest[1].max(shares[1]);
            greatest[2] = greatest[2].max(j / t_s.powi(3) / jerk_lu_s3);
        }
    }
    greatest
}

fn keeps(machine: &Machine, program: &Program, case: &str) -> f64 {
    let planned = program.planned(machine);
    let time_s = total_s(&planned);
    let setpoints = sample(machine, planned);
    let axes = setpoints[setpoints.len() - 1].axes;
    assert!(machine.axis_ids().all(|axis| axes[axis].position_lu == program.end().0[axis]), "{case}: the end");
    let [v, a, j] = greatest(machine, &setpoints);
    assert!(v <= 1.0 + 1e-9 && a <= 1.0 + 1e-6 && j <= 1.0 + 1e-3, "{case}: v {v}, a {a}, j {j} times the limit");
    time_s
}

/// Appends moves.
type Shape<'a> = &'a dyn Fn(&mut Program);

/// A straight line on which A turns back, starts and goes in steps: the linear axes have no corner, and 1 rad beside 1 mm is none.
#[test]
fn a_rotary_axis_that_goes_along_keeps_its_limits() {
    let one_deg = 1_f64.to_radians();
    let back = |program: &mut Program| {
        program.line(&[100.0, 0.0, 0.0, one_deg]);
        program.line(&[200.0, 0.0, 0.0, 0.0]);
    };
    let starts = |program: &mut Program| {
        program.line(&[100.0]);
        program.arc([100.0, 50.0], 1.5, 0.0);
        let at = program.end().0;
        let values = at.as_slice();
        let onward = [values[0] + 50.0 * 1.5_f64.cos(), values[1] + 50.0 * 1.5_f64.sin(), 0.0, 2.0 * one_deg];
        program.line(&onward);
    };
    let waves = |program: &mut Program| {
        for i in 0..15 {
            program.line(&[10.0 * f64::from(i), 0.0, 0.0, 2.0 * one_deg * (0.5 * f64::from(i)).sin()]);
        }
    };
    let shapes: [(&str, Shape<'_>); 3] = [("back", &back), ("starts", &starts), ("waves", &waves)];
    for law in LAWS {
        let machine = under(with_rotary(), law);
        for mode in ROUNDING {
            for (name, shape) in shapes {
                let mut program = program(mode, 20_000.0);
                shape(&mut program);
                keeps(&machine, &program, &format!("{name} {law:?} {mode:?}"));
            }
        }
    }
}

/// `x` and `y` by powers of u from 1 on, u from 0 to 1.
fn curve(program: &mut Program, x: &[f64], y: &[f64]) {
    let start = program.end().0;
    let mut numerator_lu = [AxisVector::zero(); 6];
    numerator_lu[0] = start;
    let mut end = start;
    for (power, row) in numerator_lu.iter_mut().skip(1).enumerate() {
        let part = |values: &[f64]| values.get(power).copied().unwrap_or(0.0);
        *row = point(&[part(x), part(y)]).0;
        end += *row;
    }
    let denominator_ratio = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let piece = PolynomialPiece { parameter_end_ratio: 1.0, numerator_lu, denominator_ratio };
    program.push(MoveKind::Polynomial(Arc::new(PolynomialGeometry { pieces: vec![piece] })), point(end.as_slice()));
}

/// There and back, farther back than there, a cusp, and two turns in one block.
const CURVES: [[&[f64]; 2]; 4] =
    [[&[20.0, -20.0], &[]], [&[10.0, -30.0], &[]], [&[-20.0, 20.0], &[15.0, -30.0, 20.0]], [&[30.0, -90.0, 64.0], &[]]];

#[test]
fn a_curve_that_turns_back_rests_there_in_every_mode_but_g64() {
    for law in LAWS {
        let machine = under(spinner(), law);
        for mode in ROUNDING.into_iter().chain([PathMode::ExactStop]) {
            for (n, [x, y]) in CURVES.into_iter().enumerate() {
                let mut program = program(mode, 3000.0);
                curve(&mut program, x, y);
                let constant_s = keeps(&machine, &program, &format!("curve {n} {law:?} {mode:?}"));
                // F in stretches, one of which may end where the curve turns back.
                program.moves[0].feed = Feed::Varying { feeds_lu_s: [50.0, 40.0, 30.0, 20.0].into() };
                let varying_s = keeps(&machine, &program, &format!("curve {n} {law:?} {mode:?} varying"));
                assert!(varying_s >= constant_s * (1.0 - 1e-6), "curve {n} {law:?} {mode:?}: {varying_s} {constant_s}");
            }
        }
    }
}

/// G64 does not rest: the axis steps there by what the corner rule allows, and by no more.
#[test]
fn under_g64_the_corner_rule_holds_inside_a_curve() {
    for law in LAWS {
        let machine = under(spinner(), law);
        let t_s = machine.cycle.time_base.setpoint_period_s();
        for [x, y] in CURVES {
            let mut program = program(PathMode::G64, 3000.0);
            curve(&mut program, x, y);
            let [_, a, _] = greatest(&machine, &program.setpoints(&machine));
            let axis = &machine.axes[0];
            let limit_lu_s2 = axis.limits.acceleration_max_lu_s2;
            let step_lu_s = (8.0 * limit_lu_s2 * axis.follow_up_tolerance_lu).sqrt();
            let greatest_ratio = 1.0 + step_lu_s / t_s / limit_lu_s2;
            // The curvature of a cusp makes the path slow beside it.
            let steps = a > 1.5 || !y.is_empty();
            assert!(steps && a <= greatest_ratio, "{law:?}: {a}, {greatest_ratio}");
        }
    }
}
