//! The time offset: known shifts, sub-sample, with noise, standstill, another start, a drift.

use crate::made::{grid, normal, signal, smooth, steps, trace};
use crate::random::Random;
use sollwert::compare::{Alignment, Channel, CompareOptions, Series, align, compare, residual_delay};

fn aligned(a: &sollwert::trace::Signal, b: &sollwert::trace::Signal, drift: bool) -> Alignment {
    let channel = Channel { trace: Series::of(a), reference: Series::of(b), scale: 1.0 };
    align(&[channel], drift).expect("an alignment")
}

#[test]
fn a_known_shift_is_found_to_a_thousandth_of_a_sample() {
    let times = grid(0.001, 9000);
    let a = signal("X.position_setpoint_mm", "mm", &times, steps);
    for shift_s in [0.0, 0.0123456, -0.7654321, 0.5] {
        let b = signal("X.position_setpoint_mm", "mm", &times, |t| steps(t - shift_s));
        let found = aligned(&a, &b, false);
        // The reference is late by the shift. A cubic through samples of a motion with third derivatives up to 1e6 mm/s³ is right to
        // about h⁴ x'''' / 384: far below a micrometre, at 100 mm/s far below a microsecond.
        assert!((found.offset_s - shift_s).abs() < 1e-6, "{shift_s}: {found:?}");
        assert!(found.correlation_ratio > 0.999, "{found:?}");
    }
}

#[test]
fn other_sampling_and_another_start_do_not_matter() {
    let a = signal("X.position_setpoint_mm", "mm", &grid(0.002, 1500), |t| steps(t + 1.8));
    let b = signal("X.position_setpoint_mm", "mm", &grid(0.0005, 20_000), |t| steps(t - 0.25));
    // a(t) = steps(t + 1.8) = b(t + 2.05); a sees 3 s of the 10 s only.
    let found = aligned(&a, &b, false);
    assert!((found.offset_s - 2.05).abs() < 2e-6, "{found:?}");
}

#[test]
fn noise_moves_the_offset_by_its_standard_error() {
    let times = grid(0.001, 9000);
    let sigma_mm = 0.02;
    let mut normalised = Vec::new();
    for seed in 1..=20 {
        let mut random = Random::new(seed);
        let a = signal("X.position_actual_mm", "mm", &times, |t| steps(t) + sigma_mm * normal(&mut random));
        let b = signal("X.position_setpoint_mm", "mm", &times, |t| steps(t - 0.0314));
        let found = aligned(&a, &b, false);
        // Cramer-Rao: sigma over the root of the sum of squares of the velocity.
        let squares: f64 = times.iter().map(|t| ((steps(t + 1e-4) - steps(t - 1e-4)) / 2e-4).powi(2)).sum();
        let error_s = sigma_mm / squares.sqrt();
        assert!((found.offset_s - 0.0314).abs() < 5.0 * error_s, "seed {seed}: {found:?}, standard error {error_s}");
        assert!((0.7..1.4).contains(&(found.uncertainty_s / error_s)), "seed {seed}: {found:?}, {error_s}");
        normalised.push(((found.offset_s - 0.0314) / error_s).powi(2));
    }
    // Mean of 20 squares of a standard normal variable: 1 within 0.95; efficient, and not better than possible.
    let mean = normalised.iter().sum::<f64>() / 20.0;
    assert!((0.3..2.5).contains(&mean), "{mean}");
}

/// Noise of the reference is in its values and in its slopes: taken together they would pull the offset by a hundred microseconds here,
/// always to the same side, ten times its standard error. The phase between the two grids stays the same in all samples.
#[test]
fn noise_of_the_reference_does_not_pull_the_offset() {
    let (shift_s, sigma_mm) = (0.718281, 0.02);
    let a_times = grid(0.004, 2200);
    let (mut sum_s, mut squares) = (0.0, 0.0);
    for seed in 1..=20 {
        let mut random = Random::new(seed);
        let a = signal("X.position_actual_mm", "mm", &a_times, |t| steps(t) + sigma_mm * normal(&mut random));
        let b = signal("X.position_actual_mm", "mm", &grid(0.002, 5000), |t| {
            steps(t - shift_s) + sigma_mm * normal(&mut random)
        });
        let found = aligned(&a, &b, false);
        sum_s += found.offset_s - shift_s;
        squares += ((found.offset_s - shift_s) / found.uncertainty_s).powi(2);
    }
    // The mean of 20 is uncertain by its standard error over the root of 20; the mean of 20 squares is 1 within 0.95.
    let energy: f64 = a_times.iter().map(|t| ((steps(t + 1e-4) - steps(t - 1e-4)) / 2e-4).powi(2)).sum();
    let error_s = sigma_mm * 2.0_f64.sqrt() / energy.sqrt() / 20.0_f64.sqrt();
    assert!((sum_s / 20.0).abs() < 4.0 * error_s, "{} s, standard error {error_s} s", sum_s / 20.0);
    assert!((0.3..2.5).contains(&(squares / 20.0)), "{}", squares / 20.0);
}

/// Two drives with other accelerations to the same speed, seen while they move: most samples agree exactly over the stretch of one speed,
/// whatever the offset; only the ramps tell it. By symmetry of the ramps the middles of the moves belong together.
#[test]
fn a_stretch_of_one_speed_does_not_hide_the_ramps() {
    // 100 mm/s over 200 mm; ramps last `ramp_s`, the middle of the move is at 4 s.
    let moved = |t: f64, ramp_s: f64| {
        let speed = 100.0;
        let end = 2.0 + ramp_s;
        let t = (t - (4.0 - 0.5 * end)).clamp(0.0, end);
        let left = end - t;
        match t {
            t if t < ramp_s => 0.5 * speed / ramp_s * t * t,
            t if t > end - ramp_s => 200.0 - 0.5 * speed / ramp_s * left * left,
            t => speed * (t - 0.5 * ramp_s),
        }
    };
    let a = signal("C.position_setpoint_mm", "mm", &grid(0.002, 1051), |t| moved(t + 2.95, 0.1));
    let b = signal("C.position_setpoint_mm", "mm", &grid(0.002, 1500), |t| moved(t + 2.95 - 0.1237, 0.3));
    let found = aligned(&a, &b, false);
    // Ramps of other lengths tell it to a fraction of a sample, and the standard error covers what is missing.
    let error_s = (found.offset_s - 0.1237).abs();
    assert!(error_s < 5e-4 && error_s < 3.0 * found.uncertainty_s, "{found:?}");
    // What agrees to the last bit is not told better than a nanosecond.
    let found = aligned(&b, &b, false);
    assert!(found.offset_s.abs() < 1e-9 && found.uncertainty_s >= 1e-9, "{found:?}");
}

/// Three moves with long rests between in the trace, short ones in the reference: one move of each falls together, which is said.
#[test]
fn a_part_of_the_motion_that_falls_together_is_said() {
    let moves = |t: f64, rest_s: f64| {
        (0..3).map(|k| 50.0 * smooth((t - 1.0 - f64::from(k) * (0.8 + rest_s)) / 0.8)).sum::<f64>()
    };
    // The last move of the longer one ends just before its end, so that it alone can meet the first of the other.
    let times = grid(0.002, 7500);
    let made = |rest_s: f64| trace(vec![signal("X.position_setpoint_mm", "mm", &times, |t| moves(t, rest_s))]);
    let told = |a: f64, b: f64| {
        let comparison = compare(&made(a), &made(b), &CompareOptions::default()).expect("figures");
        comparison.notes.iter().filter(|note| note.code == "T0104").map(|note| note.message.clone()).collect::<Vec<_>>()
    };
    assert_eq!(told(3.0, 3.0), Vec::<String>::new());
    let notes = told(5.5, 3.0);
    assert!(notes.len() == 1 && notes[0].contains("33 % of the motion of the trace"), "{notes:?}");
}

#[test]
fn a_longer_dwell_in_one_of_them_does_not_drag_the_rest_along() {
    let times = grid(0.001, 9000);
    let a = signal("X.position_setpoint_mm", "mm", &times, steps);
    // From 6.5 s on the reference is 0.4 s later: the last move is the smaller part.
    let b = signal("X.position_setpoint_mm", "mm", &times, |t| {
        let t = t - 0.1;
        steps(if t < 6.5 { t } else { (t - 0.4).max(6.5) })
    });
    let found = aligned(&a, &b, false);
    assert!((found.offset_s - 0.1).abs() < 5e-6, "{found:?}");
}

#[test]
fn a_drift_of_the_clocks_is_found_where_it_is_asked_for() {
    let a = signal("X.position_setpoint_mm", "mm", &grid(0.001, 9000), steps);
    // The reference's clock runs 200 ppm fast: it shows 1.0002 t + 0.05.
    let b = signal("X.position_setpoint_mm", "mm", &grid(0.001, 9100), |t| steps((t - 0.05) / 1.0002));
    let found = aligned(&a, &b, true);
    assert!((found.drift_ratio - 2e-4).abs() < 1e-7, "{found:?}");
    for t in [0.0, 4.0, 9.0] {
        assert!((found.reference_s(t) - (1.0002 * t + 0.05)).abs() < 1e-6, "{found:?}");
        assert!((found.trace_s(found.reference_s(t)) - t).abs() < 1e-12);
    }
}

#[test]
fn what_rests_has_no_offset() {
    let times = grid(0.001, 3000);
    let mut random = Random::new(7);
    let a = signal("X.position_setpoint_mm", "mm", &times, |_| 5.0);
    let moving = signal("X.position_setpoint_mm", "mm", &times, steps);
    let channel = |a, b| Channel { trace: Series::of(a), reference: Series::of(b), scale: 1.0 };
    assert_eq!(align(&[channel(&a, &moving)], false), None);
    assert_eq!(align(&[], false), None);
    let gaps = signal("X.position_setpoint_mm", "mm", &times, |_| f64::NAN);
    assert_eq!(align(&[channel(&gaps, &moving)], false), None);
    let noise = signal("X.position_setpoint_mm", "mm", &times, |_| 0.001 * normal(&mut random));
    // Noise against a motion: some offset may come out, but never a good correlation.
    let found = align(&[channel(&noise, &moving)], false);
    assert!(found.is_none_or(|found| found.correlation_ratio < 0.5), "{found:?}");
}

#[test]
fn gaps_are_no_motion() {
    let times = grid(0.001, 9000);
    let a =
        signal("X.position_setpoint_mm", "mm", &times, |t| if (3.0..3.3).contains(&t) { f64::NAN } else { steps(t) });
    let b = signal("X.position_setpoint_mm", "mm", &times, |t| steps(t - 0.2));
    let found = aligned(&a, &b, false);
    assert!((found.offset_s - 0.2).abs() < 1e-6, "{found:?}");
}

#[test]
fn the_lag_of_a_sine_is_its_delay() {
    let times = grid(0.001, 4000);
    let w = std::f64::consts::TAU * 1.5;
    let a = signal("X.position_setpoint_mm", "mm", &times, |t| 10.0 * (w * t).sin());
    let b = signal("X.position_actual_mm", "mm", &times, |t| 10.0 * (w * (t - 0.0037)).sin() + 2.0);
    let channel = Channel { trace: Series::of(&a), reference: Series::of(&b), scale: 1.0 };
    let (delay_s, _) = residual_delay(&channel, &Alignment::none(), 0.1).expect("a delay");
    assert!((delay_s - 0.0037).abs() < 1e-7, "{delay_s}");
}
