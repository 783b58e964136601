//! models/drive.md section 7, numbers 1 to 4, 6 and 8.

use crate::rig::{Rig, input, machines, mvc_x};
use sollwert::base::TimeBase;
use sollwert::drive::flags;
use std::f64::consts::TAU;

/// A velocity in the middle of each machine's range.
fn velocity_lu_s(rig: &Rig) -> f64 {
    0.3 * rig.data.speed_setpoint_max_lu_s
}

/// 7.1: at constant velocity e_fol = (1 - kvff) v / Kv, whatever friction and gravity: the integrator carries them.
/// After 1 s the slowest pole (about -Kv, e^-33) has died out. Gravity that turns with the angle is a ramp to the integrator and
/// leaves a rest, so that the tilting table runs with constant gravity here.
#[test]
fn form_1_velocity_lag() {
    for (name, rig) in machines() {
        for weight_ratio in [0.0, 0.4, 1.0] {
            for side in [1.0, -1.0] {
                let rig = rig.clone().with(|data| {
                    data.velocity_feedforward_ratio = weight_ratio;
                    data.mechanics.gravity_n_m = 1.5;
                    (data.mechanics.gravity_sin_n_m, data.mechanics.gravity_cos_n_m) = (0.0, 0.0);
                });
                let v = side * velocity_lu_s(&rig);
                let last = rig.follow(1.0, |t_s| v * t_s).pop().expect("signals");
                let expected_lu = (1.0 - weight_ratio) * v / rig.data.position_gain_per_s;
                // Rounding of x_set (about 100 lu) against x, divided by nothing: some 1e-13 lu, and e^-33 of the transient.
                let error_lu = (last.control_deviation_lu - expected_lu).abs();
                assert!(error_lu < 1e-11 * v.abs(), "{name}, kvff {weight_ratio}, v {v}: off by {error_lu:e}");
                assert_eq!(last.flags, 0, "{name}");
            }
        }
    }
}

/// 7.2: kvff = 1, constant acceleration, no stop: e_fol = a (T_p - T_v/2 + B Tn/Kp - d_pos + d_ff) / Kv at the position ticks.
#[test]
fn form_2_acceleration_lag() {
    for (name, rig) in machines() {
        for (setpoint_delay_s, feedforward_delay_s) in [(0.0, 0.0), (1.2e-3, 0.0), (0.7e-3, 2.3e-3), (5e-3, 0.4e-3)] {
            let rig = rig.clone().with(|data| {
                data.velocity_feedforward_ratio = 1.0;
                data.setpoint_delay_s = setpoint_delay_s;
                data.feedforward_delay_s = feedforward_delay_s;
                (data.mechanics.gravity_sin_n_m, data.mechanics.gravity_cos_n_m) = (0.0, 0.0);
            });
            let duration_s = 1.0;
            let a = 0.8 * rig.data.speed_setpoint_max_lu_s / duration_s;
            let last = rig.follow(duration_s, |t_s| 0.5 * a * t_s * t_s).pop().expect("signals");
            let data = &rig.data;
            let friction_s =
                data.mechanics.viscous_friction_n_m_s_per_rad * data.speed_reset_time_s / data.speed_gain_n_m_s_per_rad;
            let lag_s = rig.position_period_s() - rig.speed_period_s() / 2.0 + friction_s - setpoint_delay_s
                + feedforward_delay_s;
            let expected_lu = a * lag_s / data.position_gain_per_s;
            // x_set is rounded at 1e-14 of its size (160 lu after 1 s), and that is divided by T_p Kv: some 1e-9 of a T_p / Kv.
            let scale_lu = a * rig.position_period_s() / data.position_gain_per_s;
            let error_share = (last.control_deviation_lu - expected_lu).abs() / scale_lu;
            assert!(
                error_share < 3e-9,
                "{name}, d_pos {setpoint_delay_s}, d_ff {feedforward_delay_s}: {error_share:e}"
            );
        }
    }
}

/// 7.2 in full where B > 0. The torque that viscous friction asks for grows, the speed loop gives it in steps of T_v, and between two speed ticks the
/// speed is no straight line: the lag gets (B/J) ∫ (t - T_v/2)(s(t) - t/T_v) dt over a speed cycle, s(t) the share of a step that the current has made by
/// then. A current loop that settles in one current cycle (R = Ke = 0, Kpi = L/T_i) makes s = min(t/T_i, 1), which leaves
/// (B T_v²/J) (-1/12 + 1/(4 n_v) - 1/(6 n_v²)). Terms of the order (B T_v/J)² are left out: 1e-6 here.
#[test]
fn form_2_with_the_staircase_of_viscous_friction() {
    for current_ticks in [1_u32, 2, 4, 16] {
        let mut rig = mvc_x().friction(0.0, 0.0).with(|data| {
            data.velocity_feedforward_ratio = 1.0;
            (data.position_cycle_ticks, data.speed_cycle_ticks) = (u64::from(current_ticks), u64::from(current_ticks));
            data.current_cycle_ticks = 1;
            (data.motor.resistance_ohm, data.motor.back_emf_v_s_per_rad) = (1e-9, 0.0);
            data.current_gain_v_per_a = data.motor.inductance_h * f64::from(current_ticks) * 1e3;
            data.current_reset_time_s = f64::INFINITY;
            (data.voltage_max_v, data.current_max_a) = (f64::INFINITY, f64::INFINITY);
        });
        rig.time_base = TimeBase::new((1_000_000, 1), u64::from(current_ticks));
        let a = 300.0;
        let last = rig.follow(1.0, |t_s| 0.5 * a * t_s * t_s).pop().expect("signals");
        let (data, t, n) = (&rig.data, rig.speed_period_s(), f64::from(current_ticks));
        let b = data.mechanics.viscous_friction_n_m_s_per_rad;
        let staircase_s = b * t * t / data.mechanics.inertia_kg_m2 * (-1.0 / 12.0 + 0.25 / n - 1.0 / (6.0 * n * n));
        let lag_s = t / 2.0 + b * data.speed_reset_time_s / data.speed_gain_n_m_s_per_rad + staircase_s;
        let off_s = last.control_deviation_lu * data.position_gain_per_s / a - lag_s;
        assert!(off_s.abs() < 3e-7 * t, "{current_ticks}: {off_s:e} s, of which the staircase is {staircase_s:e}");
        assert!(current_ticks < 16 || staircase_s < -7e-5 * t, "the term must show");
    }
}

/// With the current loops of the machines the term lies between that of a current loop without delay, -B T_v²/(12 J), and nothing.
#[test]
fn the_staircase_is_small_and_makes_the_lag_smaller() {
    for (name, rig) in machines() {
        let rig = rig.friction(0.0, 0.0).with(|data| {
            data.velocity_feedforward_ratio = 1.0;
            data.speed_cycle_ticks = data.position_cycle_ticks;
            (data.mechanics.gravity_sin_n_m, data.mechanics.gravity_cos_n_m) = (0.0, 0.0);
        });
        let a = 0.6 * rig.data.speed_setpoint_max_lu_s;
        let last = rig.follow(1.0, |t_s| 0.5 * a * t_s * t_s).pop().expect("signals");
        let (data, t) = (&rig.data, rig.speed_period_s());
        let b = data.mechanics.viscous_friction_n_m_s_per_rad;
        let form_s = t / 2.0 + b * data.speed_reset_time_s / data.speed_gain_n_m_s_per_rad;
        let off_s = last.control_deviation_lu * data.position_gain_per_s / a - form_s;
        let most_s = b * t * t / (12.0 * data.mechanics.inertia_kg_m2);
        assert!(off_s < 1e-9 * t && off_s > -1.001 * most_s, "{name}: {off_s:e} of {most_s:e}");
    }
}

/// 7.3: d_pos <= T_p, d_ff = 0: the same motion as d_pos = 0 with kvff - Kv d_pos. Only the displayed deviation differs.
#[test]
fn form_3_delay_is_feedforward() {
    for (name, rig) in machines() {
        let period_s = rig.position_period_s();
        for delay_share in [0.25, 1.0] {
            let amplitude_lu = 0.1 * velocity_lu_s(&rig);
            let motion = |t_s: f64| amplitude_lu * (1.0 - (TAU * 1.5 * t_s).cos());
            let delay_s = delay_share * period_s;
            let delayed = rig.clone().with(|data| {
                data.velocity_feedforward_ratio = 0.9;
                data.setpoint_delay_s = delay_s;
            });
            let traded =
                rig.clone().with(|data| data.velocity_feedforward_ratio = 0.9 - data.position_gain_per_s * delay_s);
            let (delayed, traded) = (delayed.follow(1.0, motion), traded.follow(1.0, motion));
            let apart_lu =
                largest(delayed.iter().zip(&traded).map(|(a, b)| a.position_actual_lu - b.position_actual_lu));
            let shown_lu =
                largest(delayed.iter().zip(&traded).map(|(a, b)| a.control_deviation_lu - b.control_deviation_lu));
            // Rounding of x_set differences over T_p, fed through both routes: 1e-12 of the travel.
            assert!(apart_lu < 1e-11 * amplitude_lu, "{name}, {delay_share} T_p: motions differ by {apart_lu:e}");
            assert!(shown_lu > 1e-4 * amplitude_lu, "{name}: the deviation must tell the two apart");
        }
    }
}

/// 7.4: after a small step eps from rest without preload, breakaway at t = Tn (Ts / (Kp w_ref) - 1), w_ref = Kv eps / r.
/// The integral moves in steps of T_v, and the current follows within a few ms (its loop has the closed-loop time L / Kpi).
#[test]
fn form_4_breakaway_time() {
    for (name, rig) in machines() {
        let rig = rig.with(|data| {
            (data.mechanics.gravity_sin_n_m, data.mechanics.gravity_cos_n_m) = (0.0, 0.0);
            data.mechanics.breakaway_friction_n_m = 1.5 * data.mechanics.coulomb_friction_n_m;
        });
        let data = &rig.data;
        let ts = data.mechanics.breakaway_friction_n_m;
        for share in [0.05, 0.3] {
            let w_ref = share * ts / data.speed_gain_n_m_s_per_rad;
            let step_lu = w_ref * data.mechanics.transmission_lu_per_rad / data.position_gain_per_s;
            let expected_s = data.speed_reset_time_s * (ts / (data.speed_gain_n_m_s_per_rad * w_ref) - 1.0);
            let signals = rig.run_each((0..1000).map(|k| input(if k == 0 { 0.0 } else { step_lu })));
            let first = signals.iter().position(|s| s.flags & flags::STUCK == 0).expect("breaks away") as f64;
            let got_s = first * rig.current_period_s() - rig.position_period_s();
            let current_lag_s = data.motor.inductance_h / data.current_gain_v_per_a;
            let slack_s = rig.speed_period_s() + rig.current_period_s() + 4.0 * current_lag_s;
            assert!(
                (got_s - expected_s).abs() < slack_s,
                "{name}: breakaway after {got_s} s, expected {expected_s} s within {slack_s} s"
            );
        }
    }
}

/// 7.6: a reversal leaves a quadrant glitch: bounded by 2 Tc Tn/Kp |r| (that is what the integrator needs with the position loop
/// open). With the loop closed the model text calls 0.5 to 0.6 of it typical; these machines and this motion give 0.62 to 0.63, so the
/// share is only asked to lie in 0.4 to 0.75: a plausibility range around a rule of thumb, not a closed form.
#[test]
fn form_6_quadrant_glitch() {
    for (name, rig) in machines() {
        let rig = rig.with(|data| {
            (data.mechanics.gravity_sin_n_m, data.mechanics.gravity_cos_n_m) = (0.0, 0.0);
            data.velocity_feedforward_ratio = 1.0;
        });
        let data = &rig.data;
        let bound_lu = 2.0 * data.mechanics.coulomb_friction_n_m * data.speed_reset_time_s
            / data.speed_gain_n_m_s_per_rad
            * data.mechanics.transmission_lu_per_rad.abs();
        let amplitude_lu = 0.05 * data.speed_setpoint_max_lu_s;
        let motion = |t_s: f64| amplitude_lu * (1.0 - (TAU * 1.5 * t_s).cos());
        // Friction alone: the difference to the same axis without.
        let glitch_lu = |rig: &Rig| -> Vec<f64> {
            let with = rig.follow(2.0, motion);
            let without = rig.clone().friction(0.0, 0.0).follow(2.0, motion);
            with.iter().zip(&without).map(|(a, b)| a.position_actual_lu - b.position_actual_lu).collect()
        };
        let closed = glitch_lu(&rig);
        let closed_share = largest(closed[closed.len() / 2..].iter().copied()) / bound_lu;
        assert!((0.4..0.75).contains(&closed_share), "{name}: {closed_share} of the bound");
        // A vanishing Kv opens the position loop: each reversal (every 1/3 s) then shifts the axis by the whole bound for good.
        let open = glitch_lu(&rig.clone().with(|data| data.position_gain_per_s = 1e-9));
        let at_lu = |t_s: f64| open[(t_s / rig.position_period_s()).round() as usize];
        for reversal_s in [1.0, 4.0 / 3.0, 5.0 / 3.0] {
            let shift_share = (at_lu(reversal_s + 1.0 / 6.0) - at_lu(reversal_s - 1.0 / 6.0)).abs() / bound_lu;
            assert!((shift_share - 1.0).abs() < 1e-3, "{name}: position loop open, {shift_share} of the bound");
        }
    }
}

/// 7.8: -x_set gives -x; r -> -r leaves x unchanged (without gravity and load). Both hold to the last bit.
#[test]
fn form_8_symmetry() {
    for (name, rig) in machines() {
        let rig = rig.friction(0.7, 1.1).with(|data| {
            data.velocity_feedforward_ratio = 0.9;
            data.torque_feedforward_ratio = 0.5;
            data.setpoint_delay_s = 1.3e-3;
            (data.mechanics.gravity_sin_n_m, data.mechanics.gravity_cos_n_m) = (0.0, 0.0);
        });
        let amplitude_lu = 0.05 * rig.data.speed_setpoint_max_lu_s;
        let motion = |t_s: f64| amplitude_lu * (TAU * 1.5 * t_s).sin() + amplitude_lu * (TAU * 0.4 * t_s).sin();
        let plain = rig.follow(2.0, motion);
        let mirrored = rig.follow(2.0, |t_s| -motion(t_s));
        let turned = rig.clone().with(|data| data.mechanics.transmission_lu_per_rad *= -1.0).follow(2.0, motion);
        assert!(plain.iter().any(|s| s.flags & flags::STUCK != 0), "{name}: the motion must hold a stop");
        for ((a, b), c) in plain.iter().zip(&mirrored).zip(&turned) {
            assert_eq!(a.position_actual_lu, -b.position_actual_lu, "{name}");
            assert_eq!(a.current_a, -b.current_a, "{name}");
            assert_eq!(a.position_actual_lu, c.position_actual_lu, "{name}");
            assert_eq!(a.motor_speed_rad_s, -c.motor_speed_rad_s, "{name}");
        }
    }
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.map(f64::abs).fold(0.0, f64::max)
}
