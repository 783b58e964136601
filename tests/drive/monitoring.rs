//! What the control watches (docs/drive.md section 9): the contour deviation in closed form, windows and times recomputed from the signals.

use crate::rig::{Rig, input, machines, mvc_x};
use sollwert::drive::{AxisSignals, flags, monitoring};

fn smooth(rig: Rig) -> Rig {
    rig.with(|data| (data.mechanics.gravity_sin_n_m, data.mechanics.gravity_cos_n_m) = (0.0, 0.0))
}

/// The model has the lag of form 7.1 exactly: at constant speed nothing is left, with any feed-forward, friction and gravity.
#[test]
fn at_constant_speed_there_is_no_contour_deviation() {
    for (name, rig) in machines() {
        for weight_ratio in [0.0, 0.4, 1.0] {
            let rig = smooth(rig.clone()).with(|data| {
                data.velocity_feedforward_ratio = weight_ratio;
                data.setpoint_delay_s = 1.3e-3;
                data.mechanics.gravity_n_m = 1.5;
            });
            let v = -0.3 * rig.data.speed_setpoint_max_lu_s;
            let signals = rig.follow(1.0, |t_s| v * t_s);
            let last = signals.last().expect("signals");
            assert!(last.contour_deviation_lu.abs() < 1e-11 * v.abs(), "{name}: {:e}", last.contour_deviation_lu);
            let most = signals.iter().fold(0.0_f64, |most, s| most.max(s.contour_deviation_lu.abs()));
            assert!(most > 1e-6 * v.abs(), "{name}: the start of a motion that jumps to its speed must show");
        }
    }
}

/// Form 7.2 less the lag of the model, a (T_p - d_pos + d_ff) / Kv: a (B Tn/Kp - T_v/2) / Kv is left, whatever the delays.
#[test]
fn in_a_ramp_the_speed_loop_shows() {
    for (name, rig) in machines() {
        for (setpoint_delay_s, feedforward_delay_s) in [(0.0, 0.0), (1.2e-3, 0.0), (0.7e-3, 2.3e-3)] {
            let rig = smooth(rig.clone()).with(|data| {
                data.velocity_feedforward_ratio = 1.0;
                data.setpoint_delay_s = setpoint_delay_s;
                data.feedforward_delay_s = feedforward_delay_s;
            });
            let a = 0.8 * rig.data.speed_setpoint_max_lu_s;
            let last = rig.follow(1.0, |t_s| 0.5 * a * t_s * t_s).pop().expect("signals");
            let data = &rig.data;
            let friction_s =
                data.mechanics.viscous_friction_n_m_s_per_rad * data.speed_reset_time_s / data.speed_gain_n_m_s_per_rad;
            let expected_lu = a * (friction_s - rig.speed_period_s() / 2.0) / data.position_gain_per_s;
            let scale_lu = a * rig.position_period_s() / data.position_gain_per_s;
            let error_share = (last.contour_deviation_lu - expected_lu).abs() / scale_lu;
            assert!(error_share < 3e-9, "{name}: {:e} for {expected_lu:e}", last.contour_deviation_lu);
        }
    }
}

/// DSC: the model's controller works in the speed cycle, too.
#[test]
fn under_dsc_constant_speed_leaves_nothing_either() {
    let rig = mvc_x().with(|data| {
        data.options.stiffness_control = true;
        data.velocity_feedforward_ratio = 0.5;
    });
    let last = rig.follow(1.0, |t_s| 100.0 * t_s).pop().expect("signals");
    assert!(last.contour_deviation_lu.abs() < 1e-9, "{:e}", last.contour_deviation_lu);
}

/// The bits of every row against their definition, on a motion with a stop in which the axis overshoots, sticks and is late.
#[test]
fn bits_are_what_the_documentation_says() {
    let rig = mvc_x().friction(3.0, 4.5).with(|data| {
        (data.speed_reset_time_s, data.position_gain_per_s) = (40e-3, 30.0);
        (data.in_position_coarse_lu, data.in_position_fine_lu) = (0.02, 0.002);
        data.monitoring.contour_lu = 0.05;
        (data.monitoring.positioning_time_s, data.monitoring.standstill_delay_s) = (0.15, 0.1);
        data.monitoring.standstill_lu = 0.004;
    });
    let (data, period_s) = (&rig.data, rig.position_period_s());
    let position = |t_s: f64| if t_s < 0.2 { 60.0 * t_s } else { 12.0 };
    let signals = rig.follow(1.2, position);
    let (mut rested, mut arrived, mut seen) = (0_u32, true, 0);
    let mut before_lu = 0.0;
    for (k, s) in signals.iter().enumerate() {
        let away_lu = (s.position_setpoint_lu - s.position_measured_lu).abs();
        let rests = s.position_setpoint_lu == before_lu;
        before_lu = s.position_setpoint_lu;
        (rested, arrived) = if rests { (rested + 1, arrived || away_lu <= 0.002) } else { (0, false) };
        let since_s = f64::from(rested) * period_s;
        let wanted = [
            (rests && away_lu <= 0.02, monitoring::IN_POSITION_COARSE),
            (rests && away_lu <= 0.002, monitoring::IN_POSITION_FINE),
            (s.contour_deviation_lu.abs() > data.monitoring.contour_lu, monitoring::CONTOUR),
            (rests && !arrived && since_s > 0.15, monitoring::POSITIONING),
            (rests && since_s > 0.1 && away_lu > 0.004, monitoring::STANDSTILL),
        ];
        let bits = wanted.iter().map(|(holds, bit)| if *holds { *bit } else { 0 }).sum::<u32>();
        assert_eq!(s.monitoring, bits, "row {k}: {s:?}");
        seen |= bits;
    }
    assert_eq!(seen, 31, "every bit must be met");
}

/// MD36220: the bit comes when the speed set-point has been at its limit for longer than the time, and goes with it.
#[test]
fn the_speed_limit_is_seen_after_its_time() {
    let rig = mvc_x().with(|data| {
        data.speed_setpoint_max_lu_s = 100.0;
        data.monitoring.speed_limit_time_s = 0.05;
    });
    let signals = rig.follow(1.0, |t_s| if t_s < 0.1 { 0.0 } else { 20.0 });
    let mut limited = 0_u32;
    let mut seen = 0;
    for (k, s) in signals.iter().enumerate() {
        limited = if s.flags & flags::SPEED_CLAMP != 0 { limited + 1 } else { 0 };
        let wanted = f64::from(limited) * rig.position_period_s() > 0.05;
        assert_eq!(s.monitoring & monitoring::SPEED_LIMIT != 0, wanted, "row {k}");
        seen += u32::from(wanted);
    }
    assert!(seen > 50, "{seen}");
    let free = mvc_x().with(|data| data.speed_setpoint_max_lu_s = 100.0);
    assert!(free.follow(1.0, |_| 20.0).iter().all(|s| s.monitoring & monitoring::SPEED_LIMIT == 0));
}

/// After an alarm the speed set-point is a straight ramp to 0, whatever the position, and the axis comes to rest.
#[test]
fn an_axis_brakes_on_a_ramp() {
    let rig = mvc_x();
    let period_s = rig.position_period_s();
    let mut drive = rig.drive(0.0);
    let mut last = AxisSignals::default();
    for k in 0..400 {
        last = drive.step(input(100.0 * f64::from(k) * period_s));
    }
    let from = last.velocity_command_lu_s;
    assert!((from - 100.0).abs() < 0.1);
    drive.brake(from, 0.05);
    for k in 1..=120 {
        let s = drive.step(input(1000.0));
        let wanted = from * (1.0 - f64::from(k) * period_s / 0.05).max(0.0);
        assert!((s.velocity_command_lu_s - wanted).abs() < 1e-9, "{k}: {} {wanted}", s.velocity_command_lu_s);
        last = s;
    }
    assert!(last.velocity_actual_lu_s.abs() < 0.5, "{}", last.velocity_actual_lu_s);
}

/// The deviation itself, with the model written down once more.
#[test]
fn the_deviation_is_that_of_the_written_model() {
    let rig = mvc_x().friction(2.0, 2.0).with(|data| {
        data.speed_setpoint_max_lu_s = 90.0;
        data.velocity_feedforward_ratio = 0.7;
    });
    let signals: Vec<AxisSignals> = rig.follow(1.0, |t_s| 20.0 * (7.0 * t_s).sin());
    let (gain, period_s) = (rig.data.position_gain_per_s, rig.position_period_s());
    let mut model_lu = 0.0;
    for s in &signals {
        assert!((s.contour_deviation_lu - (model_lu - s.position_measured_lu)).abs() < 1e-12);
        let command = gain * (s.position_reference_lu - model_lu) + s.velocity_feedforward_lu_s;
        model_lu += period_s * command.clamp(-90.0, 90.0);
    }
    assert!(signals.iter().any(|s| s.velocity_command_lu_s.abs() == 90.0), "the clamp must be met");
}
