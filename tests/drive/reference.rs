//! Against tools/drive_reference.py: scipy's DOP853 with events, written from the model text.
//!
//! Tolerances: the reference integrates with a relative tolerance of 1e-12 a tick and finds events to about 4e-16 s; its table has
//! 13 digits. Errors of a tick do not add up (the loops forget them), but an event that moves by dt moves the position by w' dt²
//! only. What remains is some 1e-12 of each signal's range; 1e-11 of the range is asked for.
//! Measured: at most 5e-13. models/drive.md section 5 gives 1e-8 mm and more for a plant that does not split its ticks.

use crate::rig::{self, Rig, input};
use sollwert::drive::{AxisSignals, DriveInput, flags};
use sollwert::machine::{ErrorTable, FrictionAdaptation, PositionSource};
use std::f64::consts::TAU;

const REFERENCE: &str = include_str!("reference.csv");
const TOLERANCE_SHARE: f64 = 1e-11;

/// As [`REFERENCE`], in front of each set its parameters.
const TWO_MASS_SETS: &str = include_str!("two_mass_sets.csv");

/// Compares every kept row; flags must be equal.
fn compare(case: &str, signals: &[AxisSignals]) {
    compare_in(REFERENCE, case, signals);
}

fn compare_in(reference: &str, case: &str, signals: &[AxisSignals]) {
    let rows: Vec<Vec<f64>> = reference
        .lines()
        .filter_map(|line| line.strip_prefix(case)?.strip_prefix(','))
        .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
        .collect();
    assert!(rows.len() >= 30, "{case}: only {} rows", rows.len());
    let names = ["x", "x_meas", "e_fol", "w", "i", "i_avg", "u", "t_ref", "t_fric"];
    let mut worst = [0.0_f64; 9];
    for row in &rows {
        let s = &signals[row[0] as usize];
        let got = [
            s.position_actual_lu,
            s.position_measured_lu,
            s.control_deviation_lu,
            s.motor_speed_rad_s,
            s.current_a,
            s.current_mean_a,
            s.voltage_v,
            s.torque_reference_n_m,
            s.friction_torque_n_m,
        ];
        for (worst, (got, expected)) in worst.iter_mut().zip(got.iter().zip(&row[1..])) {
            *worst = worst.max((got - expected).abs());
        }
        assert_eq!(f64::from(s.flags), row[10], "{case}: flags at k = {}", row[0]);
    }
    for (column, name) in names.iter().enumerate() {
        let range = rows.iter().map(|row| row[column + 1].abs()).fold(0.0, f64::max);
        assert!(worst[column] <= TOLERANCE_SHARE * range, "{case}: {name} is off by {:e} of {range:e}", worst[column]);
    }
}

fn setpoints(count: u32, setpoint_lu: impl Fn(f64) -> f64) -> impl Iterator<Item = DriveInput> {
    (0..count).map(move |k| input(setpoint_lu(f64::from(k))))
}

#[test]
fn reversals_with_both_feedforwards() {
    let rig = rig::mvc_x().with(|data| {
        data.velocity_feedforward_ratio = 1.0;
        data.setpoint_delay_s = 1.2e-3;
        data.torque_feedforward_ratio = 0.5;
        data.feedforward_delay_s = 0.3e-3;
    });
    compare("reversal", &rig.run(setpoints(161, |k| 2.0 * (TAU * 8.0 * k * 1e-3).sin())));
}

#[test]
fn stick_slip_on_a_slow_ramp() {
    let rig = rig::mvc_y().friction(1.2, 3.6).with(|data| data.speed_reset_time_s = 0.004);
    let signals = rig.run(setpoints(401, |k| if k < 2.0 { 0.0 } else { 0.01 + 0.0002 * k }));
    let breakaways = signals.windows(2).filter(|two| two[0].flags & flags::STUCK > two[1].flags & flags::STUCK).count();
    assert!(breakaways >= 6, "the case must hold stick-slip, not {breakaways} slips");
    compare("stick_slip", &signals);
}

#[test]
fn hunting_at_a_constant_setpoint() {
    let rig = rig::mvc_y().friction(1.2, 3.6).with(|data| data.speed_reset_time_s = 0.004);
    compare("hunting", &rig.run(setpoints(461, |k| if k < 2.0 { 0.0 } else { 0.01 })));
}

#[test]
fn saturation_of_a_vertical_axis_under_load() {
    let rig = rig::ucp_z().with(|data| {
        data.voltage_max_v = 35.0;
        data.speed_setpoint_max_lu_s = 250.0;
        data.current_max_a = 20.0;
    });
    let inputs = (0..121).map(|k| DriveInput {
        load_n_m: if (70..90).contains(&k) { 3.0 } else { 0.0 },
        ..input(if k < 5 { 0.0 } else { 20.0 })
    });
    compare("saturation", &rig.run(inputs));
}

#[test]
fn tilting_table_with_quantised_encoders_from_a_cold_start() {
    let rig: Rig = rig::ucp_a().friction(0.7, 0.9).cold().with(|data| {
        data.mechanics.transmission_lu_per_rad = -1.0 / 120.0;
        data.velocity_feedforward_ratio = 1.0;
        data.encoder.position_resolution_lu = 2e-6;
        data.encoder.motor_resolution_rad = 2e-4;
    });
    compare("tilt", &rig.run(setpoints(131, |k| 0.3 + 0.05 * (1.0 - (TAU * 4.0 * k * 2e-3).cos()))));
}

/// Reversals with play, its compensation, and a friction pulse that follows the acceleration through all four of its pieces.
#[test]
fn reversals_with_play_and_an_adapted_pulse() {
    let accelerations_lu_s2 = [200.0, 600.0, 1200.0];
    let rig = rig::mvc_y().with(|data| {
        data.velocity_feedforward_ratio = 1.0;
        data.encoder.position_source = PositionSource::Motor;
        data.mechanics.backlash_lu = 0.02;
        data.options.backlash_compensation_lu = 0.015;
        data.options.friction_pulse_lu_s = 6.0;
        data.options.friction_pulse_time_s = 0.012;
        data.options.friction_adaptation = Some(FrictionAdaptation { lowest_lu_s: 1.5, accelerations_lu_s2 });
    });
    let points: Vec<f64> = (0..801).map(f64::from).map(|k| 2e-6 * k * k * (TAU * 6.0 * k * 1e-3).sin()).collect();
    let velocity = |k: usize| (points[k] - points[k - 1]) / 1e-3;
    let reversals = (2..points.len()).filter(|k| velocity(*k) * velocity(k - 1) < 0.0);
    let mut met = [0; 4];
    for k in reversals {
        let a = (velocity(k) - velocity(k - 1)).abs() / 1e-3;
        met[accelerations_lu_s2.iter().filter(|limit| a > **limit).count()] += 1;
    }
    assert!(met.iter().all(|count| *count > 0), "{met:?}");
    compare("reversal_pulse", &rig.run(points.iter().map(|point| input(*point))));
}

#[test]
fn two_masses_with_stops_and_breakaways() {
    let rig = rig::mvc_x().friction(0.6, 0.9).with(|data| {
        data.velocity_feedforward_ratio = 1.0;
        data.mechanics.gravity_n_m = 0.5;
        data.mechanics.load_inertia_kg_m2 = 0.0051;
        data.mechanics.coupling_stiffness_n_m_per_rad = 1000.0;
        data.mechanics.coupling_damping_n_m_s_per_rad = 0.03;
    });
    let inputs = (0..301).map(|k| DriveInput {
        load_n_m: if (150..170).contains(&k) { 1.0 } else { 0.0 },
        ..input(0.3 * (TAU * 5.0 * f64::from(k) * 1e-3).sin())
    });
    compare("two_mass", &rig.run(inputs));
}

#[test]
fn a_screw_with_errors_measured_at_the_motor() {
    let table = |step_lu: f64, errors_lu: &[f64]| {
        Some(ErrorTable { start_lu: -4.0, step_lu, errors_lu: errors_lu.to_vec(), periodic: false })
    };
    let rig = rig::mvc_x().with(|data| {
        data.velocity_feedforward_ratio = 1.0;
        data.encoder.position_source = PositionSource::Motor;
        data.mechanics.load_inertia_kg_m2 = 0.004;
        data.mechanics.coupling_stiffness_n_m_per_rad = 6000.0;
        data.mechanics.coupling_damping_n_m_s_per_rad = 0.05;
        data.pitch_error = table(1.5, &[2e-3, 5e-3, -3e-3, 1e-3, 4e-3, 0.0]);
        data.encoder_compensation = table(3.0, &[2e-3, -2e-3, 3e-3]);
    });
    compare("screw", &rig.run(setpoints(401, |k| -5.0 + 6.0 * (1.0 - (TAU * 2.0 * k * 1e-3).cos()))));
}

/// Axes drawn at random by the script: resonance 30 Hz to 1 kHz, any share of the load, measured at either end.
#[test]
fn second_masses_drawn_at_random() {
    let sets = TWO_MASS_SETS.lines().filter_map(|line| line.strip_prefix("parameters,set"));
    let mut count = 0;
    for line in sets {
        let (name, numbers) = line.split_once(',').expect("a name and its parameters");
        let values: Vec<f64> = numbers.split(',').map(|cell| cell.parse().expect("a number")).collect();
        let [j, jl, c, d, b, tc, ts, g0, kvff, at_motor, kp, tn] = values[..] else {
            panic!("twelve parameters: {line}")
        };
        let rig = rig::mvc_x().friction(tc, ts).with(|data| {
            data.velocity_feedforward_ratio = kvff;
            data.speed_gain_n_m_s_per_rad = kp;
            data.speed_reset_time_s = tn;
            data.encoder.position_source = if at_motor == 1.0 { PositionSource::Motor } else { PositionSource::Load };
            let mechanics = &mut data.mechanics;
            (mechanics.inertia_kg_m2, mechanics.load_inertia_kg_m2) = (j, jl);
            (mechanics.coupling_stiffness_n_m_per_rad, mechanics.coupling_damping_n_m_s_per_rad) = (c, d);
            (mechanics.viscous_friction_n_m_s_per_rad, mechanics.gravity_n_m) = (b, g0);
        });
        let inputs = (0..81).map(|k| DriveInput {
            load_n_m: if (40..55).contains(&k) { 0.5 } else { 0.0 },
            ..input(0.4 * (TAU * 9.0 * f64::from(k) * 1e-3).sin())
        });
        compare_in(TWO_MASS_SETS, &format!("set{name}"), &rig.run(inputs));
        count += 1;
    }
    assert_eq!(count, 4);
}
