//! Rack, torque motor and linear motor against the screw axis that they are equivalent to; errors of screws and their compensation.

use crate::rig::{Rig, input, mvc_x, test_machine};
use sollwert::drive::AxisSignals;
use sollwert::machine::{DriveData, ErrorTable, Machine, PositionSource};
use std::f64::consts::{PI, TAU};

/// The Spinner's X from a changed file.
fn spinner(sets: &[&str]) -> Machine {
    test_machine::shipped("spinner_mvc850", sets)
}

fn data(machine: &Machine) -> DriveData {
    machine.axes[0].drive.clone().expect("a drive")
}

/// A linear axis whose motor is itself: the text of the Spinner's X as F = 2π/pitch T, m = J / r², and so on.
fn linear_motor() -> (Rig, Rig) {
    let rotary = mvc_x().friction(0.6, 0.9).with(|data| {
        data.velocity_feedforward_ratio = 0.9;
        data.torque_feedforward_ratio = 0.7;
        data.mechanics.gravity_n_m = 0.4;
        data.mechanics.load_inertia_kg_m2 = 0.003;
        data.mechanics.coupling_stiffness_n_m_per_rad = 4000.0;
        data.mechanics.coupling_damping_n_m_s_per_rad = 0.05;
        data.options.torque_upper_n_m = 20.0;
        data.options.torque_lower_n_m = -22.0;
        data.encoder.motor_resolution_rad = 1e-5;
    });
    // Metres of the load a radian of the screw's motor.
    let r = 12e-3 / TAU;
    let text = format!(
        "format = 1\nname = \"linear motor\"\n[cycle]\nt_cyl_ms = 1.0\n[axes.X]\nvelocity_max_m_min = 20.0\n\
         acceleration_max_m_s2 = 1.0\njerk_max_m_s3 = 15.0\n[axes.X.drive]\nposition_cycle_ms = 1.0\nspeed_cycle_us = 125.0\n\
         current_cycle_us = 62.5\nposition_gain_per_s = 50.0\nvelocity_feedforward = 0.9\ntorque_feedforward = 0.7\n\
         speed_setpoint_max_mm_s = 400.0\nspeed_gain_n_s_per_m = {:?}\nspeed_reset_time_ms = 10.0\ncurrent_gain_v_per_a = 22.0\n\
         current_reset_time_ms = 2.0\ncurrent_max_a = 28.0\nvoltage_max_v = 245.0\nforce_upper_n = {:?}\nforce_lower_n = {:?}\n\
         [axes.X.motor]\nkind = \"linear\"\nresistance_ohm = 0.75\ninductance_mh = 6.5\nback_emf_v_s_per_m = {:?}\n\
         force_constant_n_per_a = {:?}\n[axes.X.mechanics]\nmass_kg = {:?}\nviscous_friction_n_s_per_m = {:?}\n\
         coulomb_friction_n = {:?}\nbreakaway_friction_n = {:?}\ngravity_n = {:?}\nload_mass_kg = {:?}\n\
         coupling_stiffness_n_per_um = {:?}\ncoupling_damping_n_s_per_m = {:?}\n[axes.X.encoder]\nmotor_resolution_um = {:?}\n",
        2.0 / r / r,
        20.0 / r,
        -22.0 / r,
        0.43 / r,
        1.30 / r,
        0.0085 / r / r,
        0.010 / r / r,
        0.6 / r,
        0.9 / r,
        0.4 / r,
        0.003 / r / r,
        4000.0 / r / r * 1e-6,
        0.05 / r / r,
        1e-5 * r * 1e6,
    );
    let source = sollwert::base::SourceText::new("linear.toml", text.as_str());
    let loaded = sollwert::machine::parse(&source, &[]).unwrap_or_else(|found| panic!("{found:?}"));
    let linear = Rig {
        data: data(&loaded.machine),
        time_base: loaded.machine.cycle.time_base,
        start: sollwert::drive::Start::Held,
    };
    (rotary, linear)
}

/// The same motion, current and voltage as on the screw; force and speed are those of the screw over r.
#[test]
fn a_linear_motor_is_a_screw_of_any_pitch() {
    let (rotary, linear) = linear_motor();
    let motion = |t_s: f64| 5.0 * (TAU * 1.5 * t_s).sin() + if t_s > 0.4 { 1.0 } else { 0.0 };
    let (a, b) = (rotary.follow(0.8, motion), linear.follow(0.8, motion));
    let r = 12e-3 / TAU;
    let saturated = a.iter().filter(|s| s.flags & 2 != 0).count();
    assert!(saturated > 3 && a.iter().any(|s| s.flags & 8 != 0), "the run must hold limits and rest");
    // The speed is counted in quanta on both: a count that falls the other way by rounding is a quantum of 2e-5 mm for a moment.
    for (k, (a, b)) in a.iter().zip(&b).enumerate() {
        let near = |what: &str, a: f64, b: f64, tolerance: f64| {
            assert!((a - b).abs() < tolerance, "k {k}: {what} {a} {b}");
        };
        near("x", a.position_actual_lu, b.position_actual_lu, 2e-5);
        near("i", a.current_a, b.current_a, 2e-1);
        near("w", a.motor_speed_rad_s * r, b.motor_speed_rad_s, 1e-3);
        near("t_grav", a.gravity_torque_n_m / r, b.gravity_torque_n_m, 1e-9);
        near("t_ref limit", a.torque_reference_n_m / r, b.torque_reference_n_m, 2e2);
    }
    // Without quanta to rounding.
    let ideal = |rig: Rig| rig.with(|data| data.encoder.motor_resolution_rad = 0.0).follow(0.8, motion);
    for (a, b) in ideal(rotary).iter().zip(&ideal(linear)) {
        assert!((a.position_actual_lu - b.position_actual_lu).abs() < 1e-9);
        assert!((a.current_a - b.current_a).abs() < 1e-6 && (a.voltage_v - b.voltage_v).abs() < 1e-5);
    }
}

/// From a file: r of rack and pinion is half the pitch circle over the gear ratio; the motion that of the screw of the same r.
#[test]
fn rack_and_pinion() {
    let rack = ["axes.X.mechanics.pinion_diameter_mm=80", "axes.X.mechanics.gear_ratio=-25"];
    let text = sollwert::machine::shipped().iter().find(|(name, _)| *name == "spinner_mvc850").expect("shipped").1;
    let text = text.replace("pitch_mm = ", "# pitch_mm = ");
    let source = sollwert::base::SourceText::new("rack.toml", text.as_str());
    // Y and Z keep no pitch either: give them one.
    let sets: Vec<String> = rack
        .into_iter()
        .chain(["axes.Y.mechanics.pitch_mm=12", "axes.Z.mechanics.pitch_mm=12"])
        .map(str::to_owned)
        .collect();
    let machine = sollwert::machine::parse(&source, &sets).unwrap_or_else(|found| panic!("{found:?}")).machine;
    let got = data(&machine).mechanics.transmission_lu_per_rad;
    assert!((got - 40.0 / -25.0).abs() < 1e-15, "{got}");
    let pitch = format!("axes.X.mechanics.pitch_mm={:?}", 80.0 * PI);
    let screw = spinner(&[&pitch, "axes.X.mechanics.gear_ratio=-25"]);
    assert!((data(&screw).mechanics.transmission_lu_per_rad - got).abs() < 1e-15);
}

/// A torque motor: gear ratio 1. Behind a gear of ratio g the same load needs inertia, gain and friction over g² or g.
#[test]
fn a_torque_motor_is_a_gear_of_ratio_one() {
    let geared = crate::rig::ucp_a().friction(0.7, 0.9);
    let g = 120.0;
    let direct = geared.clone().with(|data| {
        let (mechanics, motor) = (&mut data.mechanics, &mut data.motor);
        mechanics.transmission_lu_per_rad = 1.0;
        mechanics.inertia_kg_m2 *= g * g;
        mechanics.viscous_friction_n_m_s_per_rad *= g * g;
        data.speed_gain_n_m_s_per_rad *= g * g;
        for torque in [
            &mut mechanics.coulomb_friction_n_m,
            &mut mechanics.breakaway_friction_n_m,
            &mut mechanics.gravity_sin_n_m,
            &mut mechanics.gravity_cos_n_m,
            &mut motor.back_emf_v_s_per_rad,
            &mut motor.torque_constant_n_m_per_a,
        ] {
            *torque *= g;
        }
    });
    let motion = |t_s: f64| 0.2 * (TAU * 0.7 * t_s).sin();
    for (a, b) in geared.follow(2.0, motion).iter().zip(&direct.follow(2.0, motion)) {
        assert!((a.position_actual_lu - b.position_actual_lu).abs() < 1e-11);
        assert!((a.current_a - b.current_a).abs() < 1e-8);
        assert!((a.motor_speed_rad_s / g - b.motor_speed_rad_s).abs() < 1e-10);
        assert_eq!(a.flags, b.flags);
    }
}

fn table(periodic: bool) -> ErrorTable {
    let errors_lu = if periodic { vec![0.0, 6e-3, -4e-3, 0.0] } else { vec![2e-3, 6e-3, -4e-3, 1e-3] };
    ErrorTable { start_lu: 5.0, step_lu: 10.0, errors_lu, periodic }
}

/// The table by hand.
fn error_lu(table: &ErrorTable, x_lu: f64) -> f64 {
    let points = table.errors_lu.len() as f64 - 1.0;
    let mut n = (x_lu - table.start_lu) / table.step_lu;
    if table.periodic {
        n -= points * (n / points).floor();
    }
    let n = n.clamp(0.0, points);
    let k = (n.floor() as usize).min(table.errors_lu.len() - 2);
    table.errors_lu[k] + (n - k as f64) * (table.errors_lu[k + 1] - table.errors_lu[k])
}

/// With full feed-forward at constant velocity the measured position is the reference. Measured at the motor the load is off by the
/// error of the screw; the same table as compensation (MD32700) takes it away; a scale at the load never sees it, and shows its own
/// compensation. At the start the axis measures its first set-point.
#[test]
fn screw_errors_and_their_compensation() {
    for periodic in [false, true] {
        let with = |source: PositionSource, screw: bool, compensated: bool| {
            mvc_x().friction(0.0, 0.0).with(|data| {
                data.velocity_feedforward_ratio = 1.0;
                data.encoder.position_source = source;
                data.pitch_error = screw.then(|| table(periodic));
                data.encoder_compensation = compensated.then(|| table(periodic));
            })
        };
        let run = |rig: Rig| -> Vec<AxisSignals> {
            rig.run((0..1700_u32).map(|k| input(-20.0 + 0.05 * (f64::from(k) - 100.0).max(0.0))))
        };
        for (source, screw, compensated) in [
            (PositionSource::Motor, true, false),
            (PositionSource::Motor, true, true),
            (PositionSource::Motor, false, true),
            (PositionSource::Load, true, false),
            (PositionSource::Load, false, true),
        ] {
            let what = format!("periodic {periodic}, {source:?}, screw {screw}, compensation {compensated}");
            let signals = run(with(source, screw, compensated));
            assert!((signals[0].position_measured_lu + 20.0).abs() < 1e-14, "{what}: starts where it measures");
            assert_eq!(signals[50].position_actual_lu.to_bits(), signals[0].position_actual_lu.to_bits(), "{what}");
            for k in [0, 50, 600, 650, 800, 900, 1000, 1100, 1290, 1550, 1650] {
                let s = &signals[k];
                // Nominal position of the screw, from the measured one.
                let mut nominal_lu = s.position_measured_lu;
                for _ in 0..60 {
                    let added = if compensated { error_lu(&table(periodic), nominal_lu) } else { 0.0 };
                    nominal_lu = s.position_measured_lu - added;
                }
                let at_motor = source == PositionSource::Motor;
                let off_lu = if screw && at_motor { error_lu(&table(periodic), nominal_lu) } else { 0.0 };
                let expected_lu = nominal_lu + off_lu;
                assert!((s.position_actual_lu - expected_lu).abs() < 1e-12, "{what}, k {k}: {}", s.position_actual_lu);
                if screw && compensated {
                    assert!((s.position_actual_lu - s.position_measured_lu).abs() < 1e-12, "{what}: compensated");
                }
                // The kinks of the table disturb the loop (slope 1e-3 times 50 mm/s); between them it settles.
                assert!(s.control_deviation_lu.abs() < 1e-3, "{what}, k {k}: {}", s.control_deviation_lu);
            }
            // dx/dt is what the positions say, between two kinks.
            let rate_lu_s = (signals[1551].position_actual_lu - signals[1549].position_actual_lu) / 2e-3;
            assert!((signals[1550].velocity_actual_lu_s / rate_lu_s - 1.0).abs() < 1e-6, "{what}");
        }
    }
}
