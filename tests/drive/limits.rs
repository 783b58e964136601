//! Limits, flags, feed-forward switch, load, divergence, snapshots, rates: models/drive.md sections 3, 4, 6 and 8.

use crate::rig::{Random, axis, input, mvc_x, mvc_y, ucp_a, ucp_z};
use sollwert::drive::{Drive, DriveInput, Start, flags};
use std::f64::consts::TAU;

/// A jump that saturates all three limits. Compared with an axis that never was at the current limit, the overshoot must not
/// grow: the integrators have not wound up.
#[test]
fn saturation_recovers_without_windup() {
    let jump = |k: u32| if k < 5 { 0.0 } else { 50.0 };
    for rig in [mvc_x(), mvc_y()] {
        // Slow enough a position loop that the linear axis does not overshoot: what does, is windup.
        let rig = rig.with(|data| {
            data.position_gain_per_s = 15.0;
            data.current_max_a = 10.0;
            data.voltage_max_v = 35.0;
            data.speed_setpoint_max_lu_s = 150.0;
        });
        let signals = rig.run((0..2000).map(|k| input(jump(k))));
        for flag in [flags::SPEED_CLAMP, flags::CURRENT_LIMIT, flags::VOLTAGE_LIMIT] {
            assert!(signals.iter().any(|s| s.flags & flag != 0), "limit {flag} must be met");
        }
        let overshoot_lu = signals.iter().map(|s| s.position_actual_lu).fold(f64::MIN, f64::max) - 50.0;
        assert!(overshoot_lu < 0.02, "overshoot {overshoot_lu} mm");
        assert!(signals[1999].following_error_lu.abs() < 0.01);
        assert_eq!(signals[1999].flags & !flags::STUCK, 0, "the limits are left again");
        // Limits hold on every wire.
        for s in rig.run_each((0..500).map(|k| input(jump(k)))) {
            assert!(s.velocity_command_lu_s.abs() <= 150.0);
            assert!(s.current_reference_a.abs() <= 10.0 * (1.0 + f64::EPSILON) && s.voltage_v.abs() <= 35.0);
            assert_eq!(s.flags & flags::SPEED_CLAMP != 0, s.velocity_command_lu_s.abs() == 150.0);
            assert_eq!(s.flags & flags::VOLTAGE_LIMIT != 0, s.voltage_v.abs() == 35.0);
        }
    }
}

/// All three limits in one tick, the torque held by p1520 (at 22 V the motor does not reach the clamped speed): each is told by its own flag, each holds, and the axis arrives without windup.
#[test]
fn torque_limit_and_clamps_together() {
    let rig = mvc_x().with(|data| {
        (data.speed_setpoint_max_lu_s, data.voltage_max_v) = (100.0, 22.0);
        (data.options.torque_upper_n_m, data.options.torque_lower_n_m) = (6.0, -30.0);
    });
    let signals = rig.follow(1.5, |t_s| if t_s < 0.01 { 0.0 } else { 60.0 });
    let (speed, torque, voltage) = (flags::SPEED_CLAMP, flags::CURRENT_LIMIT, flags::VOLTAGE_LIMIT);
    for s in &signals {
        assert!((-30.0..=6.0).contains(&s.torque_reference_n_m) && s.voltage_v.abs() <= 22.0, "{s:?}");
        assert!(s.velocity_command_lu_s.abs() <= 100.0, "{s:?}");
        let at_torque = s.torque_reference_n_m == 6.0 || s.torque_reference_n_m == -30.0;
        assert_eq!(s.flags & torque != 0, at_torque, "{s:?}");
        assert_eq!(s.flags & speed != 0, s.velocity_command_lu_s.abs() == 100.0, "{s:?}");
        assert_eq!(s.flags & voltage != 0, s.voltage_v.abs() == 22.0, "{s:?}");
    }
    assert!(signals.iter().any(|s| s.flags & (speed | torque | voltage) == speed | torque | voltage));
    let furthest_lu = signals.iter().fold(0.0_f64, |most, s| most.max(s.position_actual_lu));
    assert!(furthest_lu < 60.5, "{furthest_lu}");
    assert!((signals.last().expect("signals").position_actual_lu - 60.0).abs() < 0.01);
}

/// A torque limit of ±Kt i on either side is a current limit i: the same bits.
#[test]
fn a_torque_limit_is_a_current_limit() {
    let jump = |t_s: f64| if t_s < 0.01 { 0.0 } else { 20.0 };
    let by_current = mvc_x().with(|data| data.current_max_a = 4.0);
    let by_torque = mvc_x().with(|data| {
        let most_n_m = 4.0 * data.motor.torque_constant_n_m_per_a;
        (data.options.torque_upper_n_m, data.options.torque_lower_n_m) = (most_n_m, -most_n_m);
    });
    assert_eq!(by_current.follow(0.5, jump), by_torque.follow(0.5, jump));
}

/// Locked against a load above the current limit for a second, the axis is carried off; once the load is gone it comes back
/// without delay: the integral has waited at the limit.
#[test]
fn a_load_above_the_current_limit_does_not_wind_up() {
    let rig = mvc_x().with(|data| data.current_max_a = 5.0);
    let loaded = |k: u32| (100..600).contains(&k);
    let signals = rig.run((0..2000).map(|k| DriveInput { load_n_m: if loaded(k) { 7.2 } else { 0.0 }, ..input(0.0) }));
    assert!(signals[599].position_actual_lu < -1.0, "6.5 N m cannot hold 7.2 with 0.6 of friction");
    assert_eq!(signals[599].flags & flags::CURRENT_LIMIT, flags::CURRENT_LIMIT);
    assert!((signals[300].gravity_torque_n_m - 7.2).abs() < 1e-15, "gravity includes the load");
    let overshoot_lu = signals[600..].iter().map(|s| s.position_actual_lu).fold(f64::MIN, f64::max);
    assert!(signals[1999].following_error_lu.abs() < 0.01 && overshoot_lu < 1.0, "overshoot {overshoot_lu}");
}

/// FFWOF is a feed-forward of weight 0, and the balancing delay stays.
#[test]
fn feedforward_switched_off() {
    let with = mvc_x().with(|data| {
        data.velocity_feedforward_ratio = 1.0;
        data.torque_feedforward_ratio = 1.0;
        data.setpoint_delay_s = 1.7e-3;
        data.feedforward_delay_s = 0.6e-3;
    });
    let without = with.clone().with(|data| {
        data.velocity_feedforward_ratio = 0.0;
        data.torque_feedforward_ratio = 0.0;
    });
    let setpoint = |k: u32| input(5.0 * (TAU * 3.0 * f64::from(k) * 1e-3).sin());
    let off = with.run((0..300).map(|k| DriveInput { feedforward_active: false, ..setpoint(k) }));
    assert_eq!(off, without.run((0..300).map(setpoint)));
    // On again in the middle of a motion: the delay lines are filled, the terms at once those of an axis that never was off.
    let on = with.run((0..300).map(setpoint));
    let again = with.run((0..300).map(|k| DriveInput { feedforward_active: k >= 150, ..setpoint(k) }));
    assert_eq!(again[149].velocity_feedforward_lu_s, 0.0);
    for k in 150..300 {
        assert_eq!(again[k].velocity_feedforward_lu_s, on[k].velocity_feedforward_lu_s);
        assert_eq!(again[k].torque_feedforward_n_m, on[k].torque_feedforward_n_m);
        assert_eq!(again[k].position_reference_lu, on[k].position_reference_lu);
    }
}

/// The wires of section 3 against the formulas, delays with a fraction.
#[test]
fn setpoint_preparation() {
    let rig = ucp_a().with(|data| {
        data.velocity_feedforward_ratio = 0.9;
        data.torque_feedforward_ratio = 0.8;
        data.feedforward_inertia_kg_m2 = 0.003;
        data.setpoint_delay_s = 2.75 * 2e-3;
        data.feedforward_delay_s = 1.25 * 2e-3;
    });
    let x = |k: i64| if k < 0 { 0.2 } else { 0.2 + 1e-6 * (k * k) as f64 };
    let v = |k: i64| (x(k) - x(k - 1)) / 2e-3;
    let a = |k: i64| (v(k) - v(k - 1)) / 2e-3;
    let signals = rig.run((0..50).map(|k| input(x(k))));
    for (k, s) in signals.iter().enumerate() {
        let k = k as i64;
        let expected_v = 0.9 * (0.75 * v(k - 1) + 0.25 * v(k - 2));
        let expected_t = 0.8 * 0.003 * (0.75 * a(k - 1) + 0.25 * a(k - 2)) * 120.0;
        assert!((s.position_reference_lu - (0.25 * x(k - 2) + 0.75 * x(k - 3))).abs() < 1e-15, "k {k}");
        assert!((s.velocity_feedforward_lu_s - expected_v).abs() < 1e-13, "k {k}");
        assert!((s.torque_feedforward_n_m - expected_t).abs() < 1e-11, "k {k}");
        assert_eq!(s.control_deviation_lu, s.position_reference_lu - s.position_measured_lu);
        assert_eq!(s.following_error_lu, s.position_setpoint_lu - s.position_actual_lu);
    }
}

#[test]
fn encoders_count_in_quanta() {
    let rig = mvc_x().with(|data| {
        data.encoder.position_resolution_lu = 1e-3;
        data.encoder.motor_resolution_rad = TAU / 4096.0;
    });
    for s in rig.run((0..500).map(|k| input(0.05 * f64::from(k)))) {
        let counts = s.position_measured_lu / 1e-3;
        assert!((counts - counts.round()).abs() < 1e-9);
        assert!((s.position_measured_lu - s.position_actual_lu).abs() <= 0.5e-3 + 1e-12);
    }
}

/// `step` and `step_each` are the same motion; the mean current is that of the samples of the period before.
#[test]
fn position_rate_and_current_rate_agree() {
    let rig = mvc_x().with(|data| data.velocity_feedforward_ratio = 1.0);
    let setpoint = |k: u32| input(5.0 * (TAU * 3.0 * f64::from(k) * 1e-3).sin());
    let slow = rig.run((0..300).map(setpoint));
    let fast = rig.run_each((0..300).map(setpoint));
    assert_eq!(fast.len(), 300 * 16);
    assert_eq!(slow[0].current_mean_a, slow[0].current_a);
    for (k, s) in slow.iter().enumerate() {
        assert_eq!(*s, fast[16 * k]);
        if k > 0 {
            let mean_a = fast[16 * (k - 1)..16 * k].iter().map(|s| s.current_a).sum::<f64>() / 16.0;
            assert!((s.current_mean_a - mean_a).abs() < 1e-13);
        }
    }
}

#[test]
fn equal_runs_give_equal_bits_and_a_clone_is_a_snapshot() {
    let rig = ucp_a().friction(0.7, 1.0).with(|data| data.setpoint_delay_s = 3.3e-3);
    let mut random = Random(17);
    let setpoints: Vec<f64> = (0..1000)
        .scan(0.1, |x, _| {
            *x += 1e-3 * random.signed();
            Some(*x)
        })
        .collect();
    let all = rig.run(setpoints.iter().map(|x| input(*x)));
    assert_eq!(all, rig.run(setpoints.iter().map(|x| input(*x))));
    let mut drive = rig.drive(setpoints[0]);
    for x in &setpoints[..500] {
        drive.step(input(*x));
    }
    let mut copy = drive.clone();
    for x in &setpoints[500..] {
        drive.step(input(-*x));
    }
    let rest: Vec<_> = setpoints[500..].iter().map(|x| copy.step(input(*x))).collect();
    assert_eq!(all[500..], rest);
}

/// Nothing panics, and it shows: a set-point that is not a number, and a sampled loop that is unstable.
#[test]
fn divergence_is_seen() {
    let mut drive = mvc_x().drive(0.0);
    drive.step(input(1.0));
    assert!(drive.is_finite());
    drive.step(input(f64::NAN));
    assert!(!drive.is_finite());
    drive.step(input(1.0));
    assert!(!drive.is_finite(), "it stays diverged");
    let mut drive = mvc_x().drive(0.0);
    drive.step(input(f64::INFINITY));
    drive.step(input(f64::INFINITY));
    assert!(!drive.is_finite());

    let unstable = mvc_x().with(|data| {
        data.current_gain_v_per_a = 1e5;
        data.voltage_max_v = f64::INFINITY;
        data.current_max_a = f64::INFINITY;
    });
    let mut drive = unstable.drive(0.0);
    let diverged = (0..10_000).position(|_| {
        drive.step(input(1.0));
        !drive.is_finite()
    });
    assert!(diverged.is_some());
    // With a voltage limit the same loop only rattles.
    let mut drive = unstable.with(|data| data.voltage_max_v = 245.0).drive(0.0);
    for _ in 0..1000 {
        drive.step(input(1.0));
        assert!(drive.is_finite());
    }
}

/// Any positive data, sane or not: no panic, no endless search, and either numbers or a drive that says it has none.
#[test]
fn wild_parameters_neither_panic_nor_hang() {
    for seed in 0..400 {
        let mut random = Random(seed);
        let mut wild = |middle: f64| middle * 10_f64.powf(4.0 * random.signed());
        let rig = mvc_x().with(|data| {
            data.position_gain_per_s = wild(50.0);
            data.speed_gain_n_m_s_per_rad = wild(2.0);
            data.speed_reset_time_s = wild(0.01);
            data.current_gain_v_per_a = wild(20.0);
            data.current_reset_time_s = wild(0.002);
            data.current_max_a = wild(30.0);
            data.voltage_max_v = wild(200.0);
            data.motor.resistance_ohm = wild(1.0);
            data.motor.inductance_h = wild(5e-3);
            data.motor.back_emf_v_s_per_rad = wild(0.4);
            data.motor.torque_constant_n_m_per_a = wild(1.2);
            data.mechanics.inertia_kg_m2 = wild(0.01);
            data.mechanics.coulomb_friction_n_m = wild(1.0);
            data.mechanics.breakaway_friction_n_m = data.mechanics.coulomb_friction_n_m * (1.0 + wild(0.1));
            data.mechanics.gravity_n_m = wild(1.0);
            data.setpoint_delay_s = wild(1e-3);
        });
        let mut drive = rig.cold().drive(0.0);
        let mut setpoint_lu = 0.0;
        for k in 0..200 {
            setpoint_lu += if k % 50 < 25 { wild(1e-3) } else { 0.0 };
            let s = drive.step(input(setpoint_lu));
            let numbers = s.position_actual_lu.is_finite() && s.current_a.is_finite() && s.voltage_v.is_finite();
            assert!(numbers || !drive.is_finite(), "seed {seed}, k {k}: {s:?}");
        }
    }
}

#[test]
fn an_axis_without_drive_data_is_ideal() {
    let rig = ucp_z();
    let mut drive = Drive::new(&axis(None), &rig.time_base, Start::Held, 1.0);
    assert!(matches!(drive, Drive::Ideal(_)));
    drive.step(input(1.0));
    let s = drive.step(input(1.5));
    // Backward difference over t_s = 2 ms.
    assert!((s.velocity_actual_lu_s - 250.0).abs() < 1e-9);
    let positions = [s.position_setpoint_lu, s.position_reference_lu, s.position_actual_lu, s.position_measured_lu];
    assert_eq!(positions, [1.5; 4]);
    assert_eq!((s.control_deviation_lu, s.following_error_lu, s.flags), (0.0, 0.0, 0));
    let mut ticks = 0;
    drive.step_each(input(1.5), |tick, s| {
        assert_eq!((tick, s.velocity_actual_lu_s), (0, 0.0));
        ticks += 1;
    });
    assert_eq!(ticks, 1);
    let mut drive = Drive::new(&axis(Some(rig.data.clone())), &rig.time_base, Start::Held, 1.0);
    assert!(matches!(drive, Drive::Cascade(_)));
    assert_eq!(drive.step(input(1.0)).flags, flags::STUCK);
}
