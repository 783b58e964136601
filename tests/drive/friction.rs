//! Rest, breakaway and gravity: models/drive.md sections 4, 5 and 8.

use crate::rig::{input, mvc_x, mvc_y, ucp_a, ucp_z};
use sollwert::drive::flags;
use std::f64::consts::TAU;

#[test]
fn a_held_vertical_axis_stays_exactly_still() {
    for rig in [ucp_z(), ucp_a(), ucp_z().friction(1.4, 2.0)] {
        let signals = rig.run_each((0..500).map(|_| input(0.3)));
        let first = signals[0];
        for s in &signals {
            assert_eq!(s.position_actual_lu.to_bits(), first.position_actual_lu.to_bits());
            assert_eq!((s.motor_speed_rad_s, s.flags), (0.0, flags::STUCK));
        }
        let data = &rig.data;
        assert!((first.current_a * data.motor.torque_constant_n_m_per_a - first.gravity_torque_n_m).abs() < 1e-14);
    }
}

#[test]
fn a_held_vertical_axis_without_friction_stays_within_rounding() {
    let signals = ucp_z().friction(0.0, 0.0).run_each((0..500).map(|_| input(0.3)));
    for s in &signals {
        assert!((s.position_actual_lu - 0.3).abs() < 1e-13, "{}", s.position_actual_lu);
        assert_eq!(s.flags, 0, "an axis without dry friction does not stick");
    }
}

#[test]
fn a_cold_vertical_axis_sags_and_recovers() {
    let rig = ucp_z().cold();
    let signals = rig.run_each((0..1000).map(|_| input(10.0)));
    let lowest_lu = signals.iter().map(|s| s.position_actual_lu).fold(f64::MAX, f64::min);
    // Falls before the integrator has gathered 4 N m: some hundredths of a millimetre, and comes back.
    assert!(lowest_lu < 10.0 - 1e-3 && lowest_lu > 10.0 - 0.2, "lowest {lowest_lu}");
    // It may come to rest off target by what the integrator still creeps through.
    let last = signals.last().expect("signals");
    assert!((last.position_actual_lu - 10.0).abs() < 2e-3, "{}", last.position_actual_lu);
    // The first tick falls with (g0 - Tc) / J.
    let data = &rig.data;
    let expected_rad_s = -(4.0 - 1.4) / data.mechanics.inertia_kg_m2 * rig.current_period_s();
    assert!((signals[1].motor_speed_rad_s / expected_rad_s - 1.0).abs() < 1e-4, "{}", signals[1].motor_speed_rad_s);
}

#[test]
fn a_cold_vertical_axis_holds_if_friction_holds_it() {
    let signals = ucp_z().friction(1.4, 4.5).cold().run_each((0..200).map(|_| input(10.0)));
    assert!(signals.iter().all(|s| s.position_actual_lu.to_bits() == signals[0].position_actual_lu.to_bits()));
    assert!(signals.iter().all(|s| s.flags == flags::STUCK));
}

/// At a constant set-point with Ts > Tc the integrator makes the axis hunt: it moves, stops, waits. It must not chatter: between
/// two rests the speed has one sign, and the number of rests is that of the integrator's charging times, not of the ticks.
#[test]
fn stick_slip_without_chatter() {
    let rig = mvc_y().friction(1.2, 2.4);
    let signals = rig.run_each((0..3000).map(|k| input(if k == 0 { 0.0 } else { 0.01 })));
    let breakaways = signals.windows(2).filter(|two| two[0].flags & flags::STUCK > two[1].flags & flags::STUCK).count();
    let moving: Vec<f64> = signals.iter().map(|s| s.motor_speed_rad_s).filter(|w| *w != 0.0).collect();
    let sign_changes = moving.windows(2).filter(|two| two[0] * two[1] < 0.0).count();
    // A charge of the integrator takes at least Tn (Ts - Tc) / (Kp w_ref) with w_ref = Kv 0.01 mm / r.
    let data = &rig.data;
    let w_ref = data.position_gain_per_s * 0.01 / data.mechanics.transmission_lu_per_rad;
    let charge_s = data.speed_reset_time_s * 1.2 / (data.speed_gain_n_m_s_per_rad * w_ref);
    let most = (3.0 / charge_s).ceil() as usize;
    assert!((5..=most).contains(&breakaways), "{breakaways} breakaways, at most {most} can be");
    assert!(sign_changes <= breakaways, "{sign_changes} changes of sign in {breakaways} slips");
    // Creep under a constant deviation always ends in breakaway: never still for longer than the whole charge from -Ts to +Ts.
    let mut still = 0;
    for s in &signals {
        still = if s.flags & flags::STUCK != 0 { still + 1 } else { 0 };
        let deviation_lu = s.control_deviation_lu.abs().max(1e-4);
        let w_ref = data.position_gain_per_s * deviation_lu / data.mechanics.transmission_lu_per_rad;
        let longest_s = data.speed_reset_time_s * 2.0 * 2.4 / (data.speed_gain_n_m_s_per_rad * w_ref) + 0.01;
        assert!(f64::from(still) * rig.current_period_s() < longest_s, "stuck at a deviation of {deviation_lu}");
    }
}

#[test]
fn rest_keeps_the_position_to_the_last_bit() {
    let rig = mvc_x().friction(0.6, 0.9);
    let signals = rig.run_each((0..2000).map(|k| input(3.0 * (TAU * 0.7 * f64::from(k) * 1e-3).sin())));
    let mut rests = 0;
    for two in signals.windows(2) {
        if two[0].flags & flags::STUCK != 0 && two[1].flags & flags::STUCK != 0 {
            rests += 1;
            assert_eq!(two[0].position_actual_lu.to_bits(), two[1].position_actual_lu.to_bits());
        }
        // Stuck means: friction balances what motor and gravity bring, within ±Ts.
        if two[0].flags & flags::STUCK != 0 {
            let drive_n_m = 1.30 * two[0].current_a - two[0].gravity_torque_n_m;
            assert_eq!(two[0].friction_torque_n_m, drive_n_m);
            assert!(drive_n_m.abs() <= 0.9);
        } else if two[0].motor_speed_rad_s != 0.0 {
            let expected_n_m = 0.6_f64.copysign(two[0].motor_speed_rad_s) + 0.010 * two[0].motor_speed_rad_s;
            assert!((two[0].friction_torque_n_m - expected_n_m).abs() < 1e-15);
        }
    }
    assert!(rests > 10, "the reversals must hold rests, not {rests} ticks of it");
}

#[test]
fn gravity_of_a_tilting_table_follows_the_angle() {
    let signals = ucp_a().run((0..500).map(|k| input(0.8 * (1.0 - (TAU * 0.2 * f64::from(k) * 2e-3).cos()))));
    assert!(signals.last().expect("signals").position_actual_lu > 0.5);
    for s in &signals {
        let x = s.position_actual_lu;
        assert!((s.gravity_torque_n_m - (1.1 * x.sin() + 0.25 * x.cos())).abs() < 1e-15);
    }
}
