//! What a drive has besides the cascade: set-point filters, balancing, compensations, limits. Closed forms, and exact convolutions.

use crate::rig::{Random, Rig, input, machines, mvc_x};
use sollwert::drive::{AxisSignals, flags};
use sollwert::machine::{
    Balancing, DriveData, Filter, FilterShape, JerkFilter, JerkFilterKind as Kind, PositionSource,
};
use std::f64::consts::TAU;

const LOW_PASS: Filter = Filter {
    shape: FilterShape::Pt2,
    frequency_hz: 180.0,
    damping_ratio: 0.8,
    numerator_frequency_hz: 1.0,
    numerator_damping_ratio: 0.0,
};

fn jerk_filter(kind: Kind, time_s: f64, time_add_s: f64) -> JerkFilter {
    JerkFilter { kind, time_s, time_add_s, frequency_hz: 12.5, damping_ratio: 0.0 }
}

/// No limit and no dry friction: linear, so that steady states are closed forms.
fn linear(rig: Rig) -> Rig {
    rig.friction(0.0, 0.0).with(|data| {
        (data.mechanics.gravity_n_m, data.mechanics.gravity_sin_n_m, data.mechanics.gravity_cos_n_m) = (0.0, 0.0, 0.0);
        data.velocity_feedforward_ratio = 1.0;
    })
}

/// The last signals of a ramp and of a parabola of 1 s, and the velocity of the ramp and acceleration of the parabola.
fn ramp(rig: &Rig) -> (AxisSignals, f64) {
    let v = 0.3 * rig.data.speed_setpoint_max_lu_s;
    (rig.follow(1.0, |t_s| v * t_s).pop().expect("signals"), v)
}
fn parabola(rig: &Rig) -> (AxisSignals, f64) {
    let a = 0.8 * rig.data.speed_setpoint_max_lu_s;
    (rig.follow(1.0, |t_s| 0.5 * a * t_s * t_s).pop().expect("signals"), a)
}

/// e_fol = a (T_p - T_v/2 + B Tn/Kp - d_pos + `more_s`) / Kv: closed form 7.2 with what an option adds to it.
fn assert_acceleration_lag(what: &str, rig: &Rig, more_s: f64) {
    let (last, a) = parabola(rig);
    let data = &rig.data;
    let friction_s =
        data.mechanics.viscous_friction_n_m_s_per_rad * data.speed_reset_time_s / data.speed_gain_n_m_s_per_rad;
    let lag_s = rig.position_period_s() - rig.speed_period_s() / 2.0 + friction_s - data.setpoint_delay_s + more_s;
    let got_s = last.control_deviation_lu * data.position_gain_per_s / a;
    // As form 7.2: rounding of x_set over T_p.
    assert!((got_s - lag_s).abs() < 1e-8 * rig.position_period_s(), "{what}: lag {got_s} s, expected {lag_s} s");
}

/// Bilinear transform that is exact at w: a delay at low frequency is that of the continuous filter times p / tan p, p = w T / 2.
fn warp(frequency_hz: f64, period_s: f64) -> f64 {
    let p = TAU * frequency_hz * period_s / 2.0;
    p / p.tan()
}

fn walk(count: u32, scale_lu: f64) -> Vec<f64> {
    let (mut random, mut at_lu) = (Random(11), 0.3);
    let mut points = vec![at_lu; 3];
    points.extend((0..count).map(|_| {
        at_lu += scale_lu * random.signed();
        at_lu
    }));
    points
}

/// Mean of the last `count` points, the first one before the beginning.
fn averaged(points: &[f64], count: usize) -> Vec<f64> {
    let at = |k: usize, back: usize| points[k.saturating_sub(back)];
    (0..points.len()).map(|k| (0..count).map(|back| at(k, back)).sum::<f64>() / count as f64).collect()
}

/// MD32402 = 2 and 4: the same motion as the plain axis with the convolved set-points, in feed-forward, too.
#[test]
fn moving_averages_are_convolutions() {
    for (name, rig) in machines() {
        let rig = rig.friction(0.5, 0.8).with(|data| {
            data.velocity_feedforward_ratio = 0.9;
            data.torque_feedforward_ratio = 0.5;
            data.setpoint_delay_s = 1.3e-3;
        });
        let period_s = rig.position_period_s();
        let scale_lu = 1e-4 * rig.data.speed_setpoint_max_lu_s;
        let points = walk(600, scale_lu);
        for (kind, first, second) in [(Kind::MovingAverage, 7, 1), (Kind::DoubleMovingAverage, 7, 4)] {
            let times = [first, second].map(|count| f64::from(count) * period_s);
            let filtered = rig.clone().with(|data| data.options.jerk_filter = jerk_filter(kind, times[0], times[1]));
            let convolved = averaged(&averaged(&points, first as usize), second as usize);
            let got = filtered.run(points.iter().map(|point| input(*point)));
            let expected = rig.run(convolved.iter().map(|point| input(*point)));
            for (k, (a, b)) in got.iter().zip(&expected).enumerate() {
                // Sums of some ten values in another order, amplified by Kv T_p < 1 only.
                let apart_lu = (a.position_actual_lu - b.position_actual_lu).abs();
                assert!(apart_lu < 1e-9 * scale_lu.max(1e-3), "{name}, {kind:?}, k {k}: apart {apart_lu:e}");
                assert_eq!(a.position_setpoint_lu, points[k], "{name}: x_set is that of the interpolator");
            }
        }
    }
}

/// A step arrives whole; a ramp comes late by the delay of the filter, and full feed-forward leaves no deviation behind it.
#[test]
fn jerk_filters_at_rest_and_on_a_ramp() {
    let rig = linear(mvc_x());
    let period_s = rig.position_period_s();
    let low = jerk_filter(Kind::SecondOrder, 8e-3, 0.0);
    let stop = jerk_filter(Kind::BandStop, 8e-3, 0.0);
    for (filter, delay_s) in [
        (low, 8e-3 * warp(1.0 / (4e-3 * TAU), period_s)),
        (stop, 2.0 / (TAU * 12.5) * warp(12.5, period_s)),
        (jerk_filter(Kind::MovingAverage, 9e-3, 0.0), 4.0 * period_s),
        (jerk_filter(Kind::DoubleMovingAverage, 9e-3, 5e-3), 6.0 * period_s),
    ] {
        let rig = rig.clone().with(|data| data.options.jerk_filter = filter);
        let (last, v) = ramp(&rig);
        let late_s = (last.position_setpoint_lu - last.position_reference_lu) / v;
        assert!((late_s - delay_s).abs() < 1e-12, "{filter:?}: {late_s} s late, expected {delay_s} s");
        assert!(last.control_deviation_lu.abs() < 1e-11 * v, "{filter:?}: {:e}", last.control_deviation_lu);
        let stepped = rig.follow(1.5, |t_s| if t_s < 0.01 { 0.5 } else { 1.0 });
        // r th rounds, but nothing moves.
        assert_eq!(stepped[9].position_reference_lu, 0.5, "{filter:?}: at rest from the start");
        assert_eq!(stepped[9].position_actual_lu, stepped[0].position_actual_lu, "{filter:?}: at rest from the start");
        let last = stepped.last().expect("signals");
        assert!((last.position_actual_lu - 1.0).abs() < 1e-12, "{filter:?}: ends at {}", last.position_actual_lu);
        assert_acceleration_lag("a filter in both paths changes no lag behind it", &rig, 0.0);
    }
    // MD32414 = 0: the blocked frequency does not pass.
    let rig = rig.with(|data| data.options.jerk_filter = stop);
    let blocked = rig.follow(4.0, |t_s| (TAU * 12.5 * t_s).sin());
    let passed_lu = blocked[3000..].iter().map(|s| s.position_reference_lu.abs()).fold(0.0, f64::max);
    assert!(passed_lu < 1e-12, "{passed_lu:e} of the blocked frequency passes");
}

/// MD32402 = 5: symmetric weights with the sum 1 delay a ramp and a slow sine by half their length, and leave little above the cut-off.
#[test]
fn a_fir_low_pass_delays_everything_alike() {
    let rig = linear(mvc_x());
    let period_s = rig.position_period_s();
    let fir = JerkFilter { frequency_hz: 25.0, ..jerk_filter(Kind::FirLowPass, 41e-3, 0.0) };
    let rig = rig.with(|data| data.options.jerk_filter = fir);
    let delay_s = 20.0 * period_s;
    let (last, v) = ramp(&rig);
    let late_s = (last.position_setpoint_lu - last.position_reference_lu) / v;
    assert!((late_s - delay_s).abs() < 1e-12, "{late_s} s late");
    assert!(last.control_deviation_lu.abs() < 1e-11 * v);
    for (frequency_hz, least, most) in [(3.0, 0.9, 1.0), (100.0, 0.0, 0.01), (300.0, 0.0, 0.01)] {
        let sine = |t_s: f64| (TAU * frequency_hz * t_s).sin();
        let signals = rig.follow(1.0, sine);
        let gain = signals[500..].iter().map(|s| s.position_reference_lu.abs()).fold(0.0, f64::max);
        assert!(gain >= least && gain <= most, "{frequency_hz} Hz: {gain}");
        // No phase but that of the delay: what is left is the delayed sine times one number, which may be negative.
        let delayed = |k: usize| sine(k as f64 * period_s - delay_s);
        let at = (500..900).max_by(|a, b| delayed(*a).abs().total_cmp(&delayed(*b).abs())).unwrap();
        let ratio = signals[at].position_reference_lu / delayed(at);
        for (k, signal) in signals.iter().enumerate().take(900).skip(500) {
            let apart = signal.position_reference_lu - ratio * delayed(k);
            assert!(apart.abs() < 1e-9, "{frequency_hz} Hz, {k}: {apart:e}");
        }
    }
    let rests = rig.run((0..60).map(|_| input(0.3)));
    assert!(rests.iter().all(|s| s.position_reference_lu == 0.3), "at rest it keeps its bits");
}

/// FFW_MODE 1, 2: x_ref is a geometric sequence after a step, late by T on a ramp, and the lag in acceleration is that of a dead
/// time T (the reference is as much slower).
#[test]
fn balancing_of_first_order() {
    let time_s = 2.6e-3;
    let rig = linear(mvc_x()).with(|data| {
        data.setpoint_delay_s = time_s;
        data.options.balancing = Balancing::Pt1;
    });
    let rest_ratio = time_s / (time_s + rig.position_period_s());
    let stepped = rig.run((0..40).map(|k| input(if k == 0 { 0.0 } else { 0.01 })));
    for (k, signals) in stepped.iter().enumerate() {
        let expected_lu = 0.01 * (1.0 - rest_ratio.powi(k as i32));
        assert!((signals.position_reference_lu - expected_lu).abs() < 1e-16, "k {k}");
    }
    let (last, v) = ramp(&rig);
    let late_s = (last.position_setpoint_lu - last.position_reference_lu) / v;
    assert!((late_s - time_s).abs() < 1e-12, "{late_s} s late");
    assert!(last.control_deviation_lu.abs() < 1e-11 * v);
    assert_acceleration_lag("pt1", &rig, 0.0);
}

/// p1414, p1433: in acceleration a filter of the speed set-point, or the reference model, adds its own delay to the lag; the filter
/// of the current set-point (p1656) adds none, because the integral carries it.
#[test]
fn filters_of_the_speed_loop_in_acceleration() {
    let rig = linear(mvc_x());
    let period_s = rig.speed_period_s();
    let pt1 = Filter { shape: FilterShape::Pt1, ..LOW_PASS };
    let general = Filter {
        shape: FilterShape::SecondOrder,
        numerator_frequency_hz: 300.0,
        numerator_damping_ratio: 0.2,
        ..LOW_PASS
    };
    let slow_s = 1.0 / (TAU * 180.0);
    let general_s = (2.0 * 0.8 / (TAU * 180.0) - 2.0 * 0.2 / (TAU * 300.0)) * warp(300.0, period_s);
    for (filter, delay_s) in
        [(pt1, slow_s * warp(180.0, period_s)), (LOW_PASS, 1.6 * slow_s * warp(180.0, period_s)), (general, general_s)]
    {
        let with = |change: fn(&mut DriveData, Filter)| rig.clone().with(|data| change(data, filter));
        assert_acceleration_lag("speed filter", &with(|data, filter| data.options.speed_filter = filter), delay_s);
        let model = with(|data, filter| data.options.reference_model = filter);
        assert_acceleration_lag("reference model", &model, delay_s);
        let current = with(|data, filter| data.options.current_filters = [filter; 4]);
        if filter.shape != FilterShape::Pt1 {
            continue;
        }
        let fast = current.with(|data| data.options.current_filters[0].frequency_hz = 1500.0);
        let fast = fast.with(|data| data.options.current_filters[1..].fill(Filter::default()));
        assert_acceleration_lag("current filter", &fast, 0.0);
    }
}

/// p1520, p1521: the torque stays inside both, the smaller of torque and current limit holds, the axis arrives without windup.
#[test]
fn torque_limits_on_either_side() {
    let rig = linear(mvc_x()).with(|data| {
        data.velocity_feedforward_ratio = 0.0;
        (data.options.torque_upper_n_m, data.options.torque_lower_n_m) = (3.0, -5.0);
    });
    let signals = rig.follow(2.0, |t_s| if t_s < 0.01 { 0.0 } else { 60.0 });
    let (mut upper, mut lower) = (0, 0);
    for s in &signals {
        assert!((-5.0..=3.0).contains(&s.torque_reference_n_m), "{}", s.torque_reference_n_m);
        upper += u32::from(s.torque_reference_n_m == 3.0 && s.flags & flags::CURRENT_LIMIT != 0);
        lower += u32::from(s.torque_reference_n_m == -5.0 && s.flags & flags::CURRENT_LIMIT != 0);
    }
    assert!(upper > 20 && lower > 5, "both limits hold for a while: {upper}, {lower}");
    assert!((signals.last().expect("signals").position_actual_lu - 60.0).abs() < 1e-9);
    // While the upper limit holds the axis accelerates with what is left of it: J dw = Kt ∫i - B dth.
    let (a, b) = (&signals[30], &signals[31]);
    let mechanics = &rig.data.mechanics;
    let turned_rad = (b.position_actual_lu - a.position_actual_lu) / mechanics.transmission_lu_per_rad;
    let impulse = rig.data.motor.torque_constant_n_m_per_a * b.current_mean_a * rig.position_period_s();
    let left = impulse - mechanics.viscous_friction_n_m_s_per_rad * turned_rad;
    let gained = mechanics.inertia_kg_m2 * (b.motor_speed_rad_s - a.motor_speed_rad_s);
    assert!((gained - left).abs() < 1e-5 * left, "{gained} for {left}");
    // i follows i_ref with the lag of the back-EMF ramp over its own reset time, less than 1 %.
    assert!((b.current_mean_a * rig.data.motor.torque_constant_n_m_per_a - 3.0).abs() < 0.03);
    let tighter = rig.with(|data| data.options.torque_upper_n_m = 1e6).follow(0.05, |t_s| 1e3 * t_s.signum());
    let limit_n_m = 28.0 * 1.3;
    assert!(tighter.iter().all(|s| s.torque_reference_n_m <= limit_n_m));
}

/// Play: measured at the motor the load is half the play behind, on either side; MD32450 puts it where the set-point is.
#[test]
fn backlash_and_its_compensation() {
    let width_lu = 0.03;
    for compensation_lu in [0.0, width_lu] {
        let rig = linear(mvc_x()).with(|data| {
            data.mechanics.backlash_lu = width_lu;
            data.encoder.position_source = PositionSource::Motor;
            data.options.backlash_compensation_lu = compensation_lu;
        });
        let there_and_back = |t_s: f64| 20.0 * (1.0 - (2.0 * t_s - 1.0).abs());
        let signals = rig.follow(1.0, there_and_back);
        for (k, side) in [(480, 1.0), (980, -1.0)] {
            let s = &signals[k];
            let late_lu = s.position_reference_lu - s.position_actual_lu;
            let expected_lu = side * 0.5 * (width_lu - compensation_lu);
            assert!((late_lu - expected_lu).abs() < 1e-9, "{side}, {compensation_lu}: {late_lu}");
        }
    }
    // A scale at the load sees no play of its own once the flanks touch.
    let rig = linear(mvc_x()).with(|data| data.mechanics.backlash_lu = width_lu);
    let (last, v) = ramp(&rig);
    assert!(last.control_deviation_lu.abs() < 1e-9 * v);
}

/// MD32520, MD32540: the pulse stands in the velocity command, fades geometrically, and with the area 2 Tc Tn/Kp |r| it takes away what
/// a reversal would shift the axis by (closed form 7.6, position loop open).
#[test]
fn friction_pulse_at_reversal() {
    for (name, rig) in machines() {
        let rig = rig.with(|data| {
            (data.mechanics.gravity_sin_n_m, data.mechanics.gravity_cos_n_m) = (0.0, 0.0);
            data.velocity_feedforward_ratio = 1.0;
            data.position_gain_per_s = 1e-9;
        });
        let data = &rig.data;
        let period_s = rig.position_period_s();
        let shift_lu = 2.0 * data.mechanics.coulomb_friction_n_m * data.speed_reset_time_s
            / data.speed_gain_n_m_s_per_rad
            * data.mechanics.transmission_lu_per_rad.abs();
        let time_s = 12e-3;
        let decay_ratio = (-period_s / time_s).exp();
        let amplitude_lu_s = shift_lu * (1.0 - decay_ratio) / period_s;
        let compensated = rig.clone().with(|data| {
            data.options.friction_pulse_lu_s = amplitude_lu_s;
            data.options.friction_pulse_time_s = time_s;
        });
        let travel_lu = 0.05 * data.speed_setpoint_max_lu_s;
        let motion = |t_s: f64| travel_lu * (1.0 - (TAU * 1.5 * t_s).cos());
        let frictionless = rig.clone().friction(0.0, 0.0).follow(1.0, motion);
        let shift_share = |rig: &Rig| {
            let signals = rig.follow(1.0, motion);
            let apart_lu = |t_s: f64| {
                let k = (t_s / period_s).round() as usize;
                signals[k].position_actual_lu - frictionless[k].position_actual_lu
            };
            (apart_lu(5.0 / 6.0) - apart_lu(0.5)).abs() / shift_lu
        };
        assert!((shift_share(&rig) - 1.0).abs() < 1e-3, "{name}: the reversal at 2/3 s shifts");
        assert!(shift_share(&compensated) < 2e-3, "{name}: {} is left", shift_share(&compensated));
        // v_cmd - v_ff is the pulse alone, as Kv is nearly nothing.
        let signals = compensated.follow(0.5, motion);
        let reversal = (1.0 / 3.0 / period_s).floor() as usize + 1;
        let first = signals[reversal..reversal + 3]
            .iter()
            .position(|s| (s.velocity_command_lu_s - s.velocity_feedforward_lu_s).abs() > 0.5 * amplitude_lu_s);
        let first = reversal + first.expect("a pulse at the reversal");
        for k in 0..20 {
            let s = &signals[first + k];
            let pulse_lu_s = s.velocity_command_lu_s - s.velocity_feedforward_lu_s;
            let expected_lu_s = -amplitude_lu_s * decay_ratio.powi(k as i32);
            assert!((pulse_lu_s - expected_lu_s).abs() < 1e-5 * amplitude_lu_s, "{name}, k {k}: {pulse_lu_s}");
        }
    }
}

/// MD32640 (DSC): the lag at constant velocity is the same.
#[test]
fn stiffness_control_on_a_ramp() {
    for weight_ratio in [0.0, 1.0] {
        let rig = linear(mvc_x()).with(|data| {
            data.options.stiffness_control = true;
            data.velocity_feedforward_ratio = weight_ratio;
        });
        let (last, v) = ramp(&rig);
        let expected_lu = (1.0 - weight_ratio) * v / rig.data.position_gain_per_s;
        assert!((last.control_deviation_lu - expected_lu).abs() < 1e-11 * v, "{}", last.control_deviation_lu);
    }
}
