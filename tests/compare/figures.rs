//! Pairs, figures in time, zeros, derived deviations, limits.

use crate::made::{grid, signal, steps, trace};
use sollwert::compare::{CompareOptions, Gathering, check_limits, compare, document, parse_limit, prepare};
use sollwert::trace::Zero;

#[test]
fn figures_of_a_ramp_are_those_of_the_ramp() {
    let mut gathering = Gathering::default();
    for k in 0..=1000 {
        gathering.push(f64::from(k), f64::from(k) / 1000.0 - 0.25);
    }
    gathering.push(5000.0, f64::NAN);
    let figures = gathering.finish().expect("figures");
    // Of x - 1/4 on 0..1: mean 1/4, mean square 1/3 - 1/4 + 1/16; 95 % of |x - 1/4| below 0.7.
    assert_eq!(figures.samples, 1001);
    assert!((figures.bias - 0.25).abs() < 1e-12 && (figures.rms - (1.0_f64 / 3.0 - 0.25 + 0.0625).sqrt()).abs() < 1e-3);
    assert_eq!((figures.max, figures.max_at_s), (0.75, 1000.0));
    assert!((figures.p95 - 0.70).abs() < 1.5e-3, "{}", figures.p95);
    assert_eq!(Gathering::default().finish(), None);
}

/// The moves of `steps` begin at 1.0 s and end at 7.2 s; a rest before and behind does not count, of a rotary axis as of a linear one.
#[test]
fn a_cycle_lasts_from_the_first_to_the_last_motion_of_any_axis() {
    let times = grid(0.001, 9000);
    let own = |name: &str, delay_s: f64| {
        trace(vec![
            signal("X.position_setpoint_mm", "mm", &times, |_| 12.0),
            signal(name, "deg", &times, |t| 30.0 + steps(t - delay_s)),
        ])
    };
    let (a, b) = (own("C.position_setpoint_deg", 0.0), own("C.position_setpoint_deg", 1.3));
    let comparison = compare(&a, &b, &CompareOptions::default()).expect("figures");
    for side in &comparison.sides {
        // A smooth step of 12 deg in 0.4 s is above a ten-thousandth after 4 ms.
        assert!((side.cycle_time_s.expect("a motion") - 6.2).abs() < 0.02, "{:?}", side.cycle_time_s);
        assert_eq!(side.cycle_time_basis, "first to last motion");
    }
    let still = own("C.torque_reference_n_m", 0.0);
    let side = sollwert::compare::examine(&still, None).expect("a plane");
    assert!(side.cycle_time_basis.starts_with("length of the trace"), "{}", side.cycle_time_basis);
    assert_eq!(side.cycle_time_s, Some(8.999));
}

#[test]
fn a_lag_is_a_difference_of_speed_times_delay_and_a_delay() {
    let times = grid(0.001, 9000);
    let make = |delay_s: f64| {
        trace(vec![
            signal("X.position_setpoint_mm", "mm", &times, steps),
            signal("X.position_actual_mm", "mm", &times, |t| steps(t - delay_s)),
        ])
    };
    let (a, b) = (make(0.004), make(0.007));
    let comparison = compare(&a, &b, &CompareOptions::default()).expect("figures");
    let at = comparison.alignment.expect("an offset");
    assert!(at.offset_s.abs() < 1e-7, "set-points are equal: {at:?}");
    let pair = comparison.pairs.iter().find(|p| p.name == "X.position_actual_mm").expect("a pair");
    let (delay_s, _) = pair.delay_s.expect("a delay");
    assert!((delay_s - 0.003).abs() < 1e-6, "{delay_s}");
    // Fastest: 21 mm in 0.7 s is not it, 12 mm in 0.4 s: 1.875 * 30 = 56 mm/s; -7 in 0.25: 52; -30 in 0.9: 62.5; 5 in 0.2: 47.
    let most = pair.in_time.expect("overlap").max;
    assert!((most - 62.5 * 0.003).abs() < 2e-3, "{most}");
}

#[test]
fn zeros_of_encoders_are_taken_off_and_said() {
    let times = grid(0.001, 9000);
    let mut a = signal("X.position_measured_mm", "mm", &times, |t| steps(t) - 800.0);
    a.meaning.zero = Zero::Encoder;
    let b = signal("X.position_measured_mm", "mm", &times, steps);
    let comparison = compare(&trace(vec![a]), &trace(vec![b]), &CompareOptions::default()).expect("figures");
    let pair = &comparison.pairs[0];
    assert!((pair.zero + 800.0).abs() < 1e-9 && pair.in_time.expect("overlap").max < 1e-9, "{pair:?}");
}

#[test]
fn a_known_delay_of_a_signal_is_no_difference() {
    let times = grid(0.001, 9000);
    let setpoint = |t: f64| signal("X.position_setpoint_mm", "mm", &grid(0.001, 9000), move |s| steps(s - t));
    let mut late = signal("X.torque_reference_n_m", "N m", &times, |t| steps(t - 0.004));
    late.meaning.delay_s = 0.004;
    let own = signal("X.torque_reference_n_m", "N m", &times, steps);
    let comparison =
        compare(&trace(vec![setpoint(0.0), late]), &trace(vec![setpoint(0.0), own]), &CompareOptions::default())
            .expect("figures");
    let pair = comparison.pairs.iter().find(|p| p.name == "X.torque_reference_n_m").expect("a pair");
    assert!(pair.in_time.expect("overlap").max < 1e-5, "{pair:?}");
}

#[test]
fn deviations_are_formed_from_their_parts_and_the_delay_in_a_control_is_found() {
    let times = grid(0.002, 4500);
    // As in a control: the deviation is formed against the set-point three samples ago.
    let mut a = trace(vec![
        signal("X.position_setpoint_mm", "mm", &times, steps),
        signal("X.position_measured_mm", "mm", &times, |t| steps(t - 0.0065)),
        signal("X.control_deviation_mm", "mm", &times, |t| steps(t - 0.006) - steps(t - 0.0065)),
    ]);
    let mut b = trace(vec![
        signal("X.position_setpoint_mm", "mm", &times, steps),
        signal("X.position_reference_mm", "mm", &times, |t| steps(t - 0.006)),
        signal("X.position_measured_mm", "mm", &times, |t| steps(t - 0.0065)),
    ]);
    prepare(&mut a);
    prepare(&mut b);
    let comparison = compare(&a, &b, &CompareOptions::default()).expect("figures");
    let names: Vec<&str> = comparison.pairs.iter().map(|p| p.name.as_str()).collect();
    assert!(names.contains(&"X.control_deviation_mm") && names.contains(&"X.following_error_mm"), "{names:?}");
    for pair in &comparison.pairs {
        assert!(pair.in_time.expect("overlap").max < 1e-3, "{pair:?}");
    }
    let (axis, delay_s, _) = &comparison.sides[0].setpoint_delays_s[0];
    assert!(axis == "X" && (delay_s - 0.006).abs() < 1e-5, "{delay_s}");
}

#[test]
fn pairs_of_the_user_come_first_and_unknown_names_are_told_with_the_nearest() {
    let times = grid(0.001, 9000);
    let a = trace(vec![signal("X.position_setpoint_mm", "mm", &times, steps)]);
    let mut odd = signal("ENC_POS|1", "mm", &times, |t| steps(t - 0.125));
    odd.name = None;
    let b = trace(vec![odd]);
    let map = |a: &str, b: &str| CompareOptions { map: vec![(a.into(), b.into())], ..CompareOptions::default() };
    let comparison = compare(&a, &b, &map("X.position_setpoint", "ENC_POS|1")).expect("figures");
    assert_eq!(comparison.pairs[0].name, "X.position_setpoint");
    assert!(comparison.pairs[0].reason.contains("--map"), "{:?}", comparison.pairs[0]);
    let at = comparison.alignment.expect("an offset");
    assert!((at.offset_s - 0.125).abs() < 1e-6, "{at:?}");
    let error = compare(&a, &b, &map("X.position_setpiont_mm", "ENC_POS|1")).expect_err("a typo");
    assert!(error.help.as_deref().is_some_and(|help| help.contains("X.position_setpoint_mm")), "{error:?}");
}

#[test]
fn limits_hold_or_not_and_a_missing_figure_breaks_its_limit() {
    let times = grid(0.001, 9000);
    let a = trace(vec![signal("X.position_setpoint_mm", "mm", &times, |t| steps(t) + 0.01)]);
    let b = trace(vec![signal("X.position_setpoint_mm", "mm", &times, steps)]);
    let document = document(&compare(&a, &b, &CompareOptions::default()).expect("figures"));
    let rules = [
        "X.position_setpoint_mm.max=0.02",
        "X.position_setpoint_mm.bias=0.005",
        "contour_error_max_mm=1",
        "X.position_setpoint_mm.rms_path=1",
    ];
    let rules: Vec<_> = rules.iter().map(|text| parse_limit(text).expect("a rule")).collect();
    let checks = check_limits(&document, &rules).expect("names that exist");
    let holds: Vec<bool> = checks.iter().map(|check| check.holds()).collect();
    // A shift of X alone along X is no contour error, but the ends differ; the paths exist.
    assert_eq!(holds[..2], [true, false], "{checks:?}");
    assert!((checks[1].found.expect("a bias") - 0.01).abs() < 1e-6);
    let typo = parse_limit("X.position_setpoint_mm.mxa=1").expect("a rule");
    let error = check_limits(&document, &[typo]).expect_err("no such figure");
    assert!(error.help.as_deref().is_some_and(|help| help.contains(".max")), "{error:?}");
    for text in ["X.max", "=1", "a=-1", "a=nan", "a=x"] {
        assert!(parse_limit(text).is_err() || text == "=1", "{text}");
    }
}

#[test]
fn the_document_has_the_keys_of_the_contract() {
    let times = grid(0.001, 9000);
    let make = || trace(vec![signal("X.position_setpoint_mm", "mm", &times, steps)]);
    let document = document(&compare(&make(), &make(), &CompareOptions::default()).expect("figures"));
    for key in ["format", "offset_s", "signals", "contour_error_rms_mm", "contour_error_max_mm", "cycle_time_s"] {
        assert!(document.get(key).is_some_and(|value| !value.is_null()), "{key}: {document}");
    }
    let figures = &document["signals"]["X.position_setpoint_mm"];
    for key in ["rms", "max", "p95"] {
        assert!(figures[key].as_f64().is_some_and(|value| value < 1e-9), "{key}: {figures}");
    }
    assert_eq!(figures["unit"], "mm");
    assert_eq!(document["cycle_time_s"].as_array().map(Vec::len), Some(2));
}
