//! The drives in the loop, from recordings of real programs: closed forms 1, 2 and 7 of models/drive.md section 7, the definitions
//! of the deviations, the mean current, the contour error and the fine interpolator.

use crate::trace::{Trace, trace};

const SPINNER: [&str; 2] = ["-m", "spinner_mvc850"];

/// Rows in which the set-point moves at constant speed for at least `settled` rows before.
fn steady(trace: &Trace, axis: &str, field: &str, settled: usize) -> Vec<usize> {
    let values = trace.column(axis, field);
    (settled..values.len())
        .filter(|k| values[*k] != 0.0 && values[k - settled..*k].iter().all(|v| (v - values[*k]).abs() < 1e-9))
        .collect()
}

/// 7.1: (1 - kvff) v / Kv, and the whole lag is that and the balancing delay.
#[test]
fn form_1_constant_speed() {
    for (kvff, set) in [(1.0, "axes.X.drive.velocity_feedforward=1"), (0.9, "axes.X.drive.velocity_feedforward=0.9")] {
        let trace = trace(&format!("form_1_{kvff}"), "G1 X300 F6000\nM30\n", &[&SPINNER[..], &["--set", set]].concat());
        // e^(-50 / s * 0.7 s) of the transient is left.
        let rows = steady(&trace, "X", "velocity_setpoint", 700);
        assert!(rows.len() > 1000);
        let (v, gain, delay_s) = (100.0, 50.0, 1.2e-3);
        for k in rows {
            let deviation = trace.column("X", "control_deviation")[k];
            assert!((deviation - (1.0 - kvff) * v / gain).abs() < 1e-9, "kvff {kvff}: {deviation}");
            let lag = trace.column("X", "following_error")[k];
            assert!((lag - ((1.0 - kvff) * v / gain + v * delay_s)).abs() < 1e-9, "kvff {kvff}: {lag}");
        }
    }
}

/// 7.2: a (T_p - T_v/2 + B Tn/Kp - d_pos + d_ff) / Kv in the ramp of a rapid.
#[test]
fn form_2_constant_acceleration() {
    let sets = ["--set", "axes.X.velocity_max_m_min=80", "--set", "axes.X.drive.speed_setpoint_max_mm_s=3000"];
    let more = ["--set", "axes.X.drive.voltage_max_v=1000", "--set", "axes.X.drive.current_max_a=200"];
    let delay = ["--set", "axes.X.drive.feedforward_delay_ms=0.2"];
    let trace = trace("form_2", "G0 X400\nX-400\nM30\n", &[&SPINNER[..], &sets, &more, &delay].concat());
    let rows = steady(&trace, "X", "acceleration_setpoint", 250);
    assert!(rows.len() > 500, "{}", rows.len());
    let friction_s = 0.010 * 10e-3 / 2.0;
    let lag_s = 1e-3 - 125e-6 / 2.0 + friction_s - 1.2e-3 + 0.2e-3;
    let velocity = trace.column("X", "velocity_actual");
    for k in rows {
        let a = trace.column("X", "acceleration_setpoint")[k];
        // Where the motor has just reversed, the friction has too: that is another transient.
        if velocity[k - 250..=k].iter().any(|v| v * velocity[k] <= 0.0) {
            continue;
        }
        let deviation = trace.column("X", "control_deviation")[k];
        let wanted = a * lag_s / 50.0;
        assert!((deviation - wanted).abs() < 1e-4 * a.abs() * 1e-3 / 50.0 + 1e-9, "{deviation} {wanted}");
    }
}

/// Section 3 of the contract, at every row: deviation = reference - measured, following error = set-point - actual, reference = the
/// set-point 1.2 ms ago (a fifth of the way between the last two rows but one).
#[test]
fn deviations_are_those_of_the_contract() {
    let trace = trace("definitions", include_str!("../../programs/corners.mpf"), &SPINNER);
    for axis in ["X", "Y", "Z"] {
        let column = |field: &str| trace.column(axis, field);
        let sent = column("position_setpoint");
        for k in 0..sent.len() {
            let ago = |n: usize| sent[k.saturating_sub(n)];
            let close = |a: f64, b: f64, what: &str| assert!((a - b).abs() < 1e-12, "{axis} row {k} {what}: {a} {b}");
            close(column("position_reference")[k], 0.8 * ago(1) + 0.2 * ago(2), "reference");
            close(
                column("control_deviation")[k],
                column("position_reference")[k] - column("position_measured")[k],
                "deviation",
            );
            close(column("following_error")[k], sent[k] - column("position_actual")[k], "following error");
        }
    }
    let summary = trace.recording.summary().unwrap();
    for (key, field) in [("control_deviation", "control_deviation"), ("following_error", "following_error")] {
        let column = trace.column("X", field);
        let rms = (column.iter().map(|v| v * v).sum::<f64>() / column.len() as f64).sqrt();
        let max = column.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        assert_eq!(summary["axes"]["X"][format!("{key}_max_mm")].as_f64().unwrap(), max);
        assert!((summary["axes"]["X"][format!("{key}_rms_mm")].as_f64().unwrap() - rms).abs() < 1e-15);
    }
}

/// 7.7 at the position rate: while the sign of the speed stays, friction and gravity integrate in closed form (Tc t + B theta + g0 t),
/// and the mean current gives the impulse of the motor, but for the sawtooth of one current cycle: Kt * change of i * T_i / 2.
#[test]
fn impulse_of_the_motor() {
    let trace = trace("impulse", "G1 Z400 F15000\nM30\n", &SPINNER);
    let column = |field: &str| trace.column("Z", field);
    let (kt, inertia, viscous, coulomb, gravity) = (1.30, 0.0095, 0.010, 1.0, 3.0);
    let (period_s, cycle_s, r) = (1e-3, 62.5e-6, 12.0 / std::f64::consts::TAU);
    let (speed, current) = (column("motor_speed"), column("current"));
    let moving: Vec<usize> = (0..speed.len()).filter(|k| speed[*k] > 1.0).collect();
    let (from, to) = (moving[0], moving[moving.len() - 1]);
    assert!(to > from + 1000);
    let mut impulse = 0.0;
    for k in from..to {
        // The mean at a row is that of the period that ends there.
        impulse += kt * column("current_mean")[k + 1] * period_s;
        let angle = (column("position_actual")[k + 1] - column("position_actual")[from]) / r;
        let time_s = (k + 1 - from) as f64 * period_s;
        let spent = coulomb * time_s + viscous * angle + gravity * time_s + inertia * (speed[k + 1] - speed[from]);
        let sawtooth = kt * (current[k + 1] - current[from]) * cycle_s / 2.0;
        // What is left is the curvature of i inside a cycle.
        assert!((impulse + sawtooth - spent).abs() < 2e-5, "row {k}: {impulse} {spent} {sawtooth}");
    }
    let share = (impulse - kt * (from + 1..=to).map(|k| current[k]).sum::<f64>() * period_s).abs();
    assert!(share < 0.2 * impulse, "sampled current is biased, not unrelated");
}

/// The contour error of every row against the distance to all chords of the set-points so far.
#[test]
fn contour_error_is_the_distance_to_the_path_of_the_setpoints() {
    let trace = trace("contour", include_str!("../../programs/corners.mpf"), &SPINNER);
    let position = |field: &str, k: usize| ["X", "Y", "Z"].map(|axis| trace.column(axis, field)[k]);
    let mut worst = 0.0_f64;
    for k in 0..trace.rows.len() {
        let p = position("position_actual", k);
        let mut nearest = f64::INFINITY;
        for n in 0..k.max(1) {
            let (a, b) = (position("position_setpoint", n), position("position_setpoint", (n + 1).min(k)));
            let way: [f64; 3] = std::array::from_fn(|i| b[i] - a[i]);
            let squared: f64 = way.iter().map(|w| w * w).sum();
            let along: f64 = (0..3).map(|i| (p[i] - a[i]) * way[i]).sum();
            let share = if squared > 0.0 { (along / squared).clamp(0.0, 1.0) } else { 0.0 };
            let off = (0..3).map(|i| (p[i] - a[i] - share * way[i]).powi(2)).sum::<f64>().sqrt();
            nearest = nearest.min(off);
        }
        let recorded = trace.rows[k].contour_error_mm;
        assert!((recorded - nearest).abs() < 1e-12, "row {k}: {recorded} {nearest}");
        worst = worst.max(recorded);
    }
    assert!(worst > 1e-4 && worst < 0.05, "{worst}");
}

/// Mikron: t_s = 4 ms, X at 2 ms. A row in between: of a cubic, through positions and velocities of both; of a line, the mean.
#[test]
fn rows_between_setpoints() {
    for law in ["cubic", "linear"] {
        let set = format!("cycle.fine_interpolation=\"{law}\"");
        let text = "G642 CTOL=0.1\nG1 X40 Y10 F6000\nX60 Y50\nM30\n";
        let trace = trace(&format!("fine_{law}"), text, &["-m", "mikron_ucp710", "--set", &set]);
        for axis in ["X", "Y"] {
            let (q, v) = (trace.column(axis, "position_setpoint"), trace.column(axis, "velocity_setpoint"));
            let mut largest = 0.0_f64;
            for k in (1..q.len() - 1).step_by(2) {
                let mean = 0.5 * (q[k - 1] + q[k + 1]);
                let bulge = if law == "cubic" { 4e-3 * (v[k - 1] - v[k + 1]) / 8.0 } else { 0.0 };
                assert!((q[k] - mean - bulge).abs() < 1e-12, "{law} {axis} row {k}");
                largest = largest.max(bulge.abs());
            }
            assert!(law == "linear" || largest > 1e-4);
            // Second differences at 2 ms: of the cubic they keep the axis' acceleration, of the line they are twice it at the joints.
            let a_max = if axis == "X" { 2500.0 } else { 3000.0 };
            let a = (1..q.len() - 1).map(|k| (q[k + 1] - 2.0 * q[k] + q[k - 1]) / 4e-6).map(f64::abs);
            let a = a.fold(0.0, f64::max);
            assert!(a <= a_max * if law == "cubic" { 1.05 } else { 2.0 }, "{law} {axis}: {a}");
        }
    }
}
