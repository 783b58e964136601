//! The shipped machines: values against the published tables, converted by hand.

use crate::{EXAMPLE, MINIMAL, parse, shown};
use sollwert::base::{AxisKind, Tick};
use sollwert::machine::{self, BlendLaw, FineInterpolation, KinematicsSettings, Machine, PathMode, TimeLawKind};
use std::f64::consts::{FRAC_1_SQRT_2, PI};

fn shipped(name: &str) -> Machine {
    let loaded = machine::load(name, &[]).unwrap_or_else(|error| panic!("{}", shown(error.diagnostics())));
    assert!(loaded.warnings.is_empty(), "{name} warns: {}", shown(&loaded.warnings));
    loaded.machine
}

fn near(actual: f64, expected: f64) {
    assert!((actual - expected).abs() <= 1e-12 * expected.abs().max(1e-3), "{actual} is not {expected}");
}

/// Limits of an axis: V, A, J, transition jerk in mm or rad, s.
fn limits(machine: &Machine, axis: &str) -> [f64; 4] {
    let limits = machine.axis(machine.axis_by_name(axis).expect(axis)).limits;
    [limits.velocity_max_lu_s, limits.acceleration_max_lu_s2, limits.jerk_max_lu_s3, limits.transition_jerk_max_lu_s3]
}

fn assert_limits(machine: &Machine, axis: &str, expected: [f64; 4]) {
    for (actual, expected) in limits(machine, axis).into_iter().zip(expected) {
        near(actual, expected);
    }
}

#[test]
fn all_are_there_and_can_be_run_now() {
    let names: Vec<&str> = machine::shipped().iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["spinner_mvc850", "huron_kx10", "mikron_ucp710", "huron_kx8_five", "xyzbc"]);
    assert!(names.contains(&machine::DEFAULT_MACHINE));
    for name in names {
        let machine = shipped(name);
        assert_eq!(machine::unsupported(&machine), [], "{name}");
        assert_eq!(machine.feed.time_law, TimeLawKind::SevenPhase);
        assert_eq!(machine.representative_drives().count(), machine.axes.len(), "{name}: no drive is identified");
        assert_eq!(machine.ideal_axes().count(), 0);
        let with_ending = machine::load(&format!("{name}.toml"), &[]).expect(name);
        assert_eq!((&*with_ending.name, with_ending.machine), (format!("{name}.toml").as_str(), machine));
    }
    assert!(shipped(machine::DEFAULT_MACHINE).axes.iter().all(|axis| axis.kind == AxisKind::Linear));
}

#[test]
fn every_value_has_its_source_beside_it() {
    for (name, text) in machine::shipped() {
        for line in text.lines().filter(|line| line.contains(" = ")) {
            assert!(line.contains('#') || line == "rotary = [", "{name}: no source: {line}");
        }
    }
}

#[test]
fn spinner_as_in_essid_2019_table_2() {
    let machine = shipped("spinner_mvc850");
    // 20 m/min = 333.33 mm/s, 1 m/s² = 1000 mm/s², 15 and 10 m/s³.
    for axis in ["X", "Y"] {
        assert_limits(&machine, axis, [1000.0 / 3.0, 1000.0, 15e3, 10e3]);
    }
    assert_limits(&machine, "Z", [250.0, 800.0, 12e3, 8e3]);
    assert_eq!(machine.look_ahead_blocks, 8);
    near(machine.cycle.time_base.setpoint_period_s(), 1e-3);
    assert_eq!((machine.cycle.control_cycle_s, machine.cycle.sampling_ratio), (8e-3, 0.125));
    assert_eq!(machine.cycle.fine_interpolation, FineInterpolation::Cubic);
    // T_p = 1 ms, T_v = 125 µs, T_i = 62.5 µs: 16 current cycles of one tick in t_s.
    assert_eq!(machine.cycle.time_base.ticks_per_setpoint(), 16);
    for axis in &machine.axes {
        let drive = axis.drive.as_ref().expect("a drive");
        assert_eq!((drive.position_cycle_ticks, drive.speed_cycle_ticks, drive.current_cycle_ticks), (16, 2, 1));
    }
    assert_eq!((machine.smoothing.radial_acceleration_share, machine.smoothing.radial_jerk_share), (0.2, 0.2));
    assert_eq!((machine.feed.default_path_mode, machine.smoothing.contour_tolerance_mm), (PathMode::G642, 0.1));
    let x = machine.axes[0].drive.as_ref().expect("a drive");
    near(x.mechanics.transmission_lu_per_rad, 12.0 / (2.0 * PI));
    near(x.motor.inductance_h, 6.5e-3);
    near(x.in_position_coarse_lu, 0.04);
    near(x.setpoint_delay_s, 1.2e-3);
    near(x.speed_reset_time_s, 0.010);
    let z = machine.axes[2].drive.as_ref().expect("a drive").mechanics;
    assert_eq!(
        (z.inertia_kg_m2, z.coulomb_friction_n_m, z.breakaway_friction_n_m, z.gravity_n_m),
        (0.0095, 1.0, 1.0, 3.0)
    );
}

#[test]
fn kx10_as_in_gassara_2013_table_2() {
    let machine = shipped("huron_kx10");
    assert_limits(&machine, "X", [500.0, 3000.0, 50e3, 50e3]);
    assert_limits(&machine, "Y", [500.0, 3000.0, 50e3, 50e3]);
    assert_limits(&machine, "Z", [300.0, 3000.0, 50e3, 50e3]);
    near(machine.cycle.time_base.setpoint_period_s(), 2e-3);
    assert_eq!(machine.look_ahead_blocks, 100);
    assert_eq!((machine.feed.default_path_mode, machine.smoothing.rounding_distance_mm), (PathMode::G641, Some(0.5)));
}

#[test]
fn ucp710_as_in_beudaert_2011_table_1() {
    let machine = shipped("mikron_ucp710");
    assert_limits(&machine, "X", [500.0, 2500.0, 5e3, 5e3]);
    assert_limits(&machine, "Y", [500.0, 3000.0, 5e3, 5e3]);
    assert_limits(&machine, "Z", [500.0, 2100.0, 50e3, 50e3]);
    // 15 rpm = π/2 rad/s, 0.83 rot/s² = 5.2150 rad/s², 5 rot/s³ = 10 π rad/s³.
    assert_limits(&machine, "A", [PI / 2.0, 5.215_043_804_959_056, 10.0 * PI, 10.0 * PI]);
    assert_limits(&machine, "C", [2.0 * PI / 3.0, 5.215_043_804_959_056, 200.0 * PI, 200.0 * PI]);
    // t_s = 4 ms; C: T_p 4 ms, T_v 250 µs, T_i 62.5 µs; X: T_p 2 ms, T_v = T_i = 125 µs. Tick = 62.5 µs.
    assert_eq!(machine.cycle.time_base.ticks_per_setpoint(), 64);
    assert_eq!(machine.cycle.time_base.time_ns(Tick(2)), 125_000);
    let ticks = |name: &str| {
        let drive = machine.axis(machine.axis_by_name(name).expect(name)).drive.as_ref().expect("a drive");
        (drive.position_cycle_ticks, drive.speed_cycle_ticks, drive.current_cycle_ticks)
    };
    assert_eq!((ticks("X"), ticks("A"), ticks("C")), ((32, 2, 2), (32, 2, 2), (64, 4, 1)));
    let a = &machine.axes[3];
    near(a.travel_lu.expect("travel")[1], 2.0 * PI / 3.0);
    let drive = a.drive.as_ref().expect("a drive");
    near(drive.mechanics.transmission_lu_per_rad, 1.0 / 120.0);
    near(drive.speed_setpoint_max_lu_s, 95.0 * PI / 180.0);
    near(drive.in_position_coarse_lu, 0.04 * PI / 180.0);
    assert!(machine.axes[4].modulo && machine.axes[4].travel_lu.is_none());
    let KinematicsSettings::Rotary { table, head } = &machine.kinematics else { panic!("no rotary axes") };
    let directions: Vec<[f64; 3]> = table.iter().map(|joint| joint.direction).collect();
    assert_eq!((directions.as_slice(), head.len()), ([[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]].as_slice(), 0));
}

#[test]
fn kx8_as_in_lavernhe_2008_table_i() {
    let machine = shipped("huron_kx8_five");
    for (axis, jerk) in [("X", 40e3), ("Y", 80e3), ("Z", 100e3)] {
        assert_limits(&machine, axis, [2500.0 / 3.0, 5000.0, jerk, jerk]);
    }
    // 50 rev/min = 5.236 rad/s, 3 rev/s² = 18.85 rad/s².
    for axis in ["A", "C"] {
        assert_limits(&machine, axis, [5.0 * PI / 3.0, 6.0 * PI, 200.0 * PI, 200.0 * PI]);
    }
    near(machine.cycle.time_base.setpoint_period_s(), 3e-3);
    let KinematicsSettings::Rotary { table, .. } = &machine.kinematics else { panic!("no rotary axes") };
    near(table[0].direction[1], FRAC_1_SQRT_2);
    near(table[0].direction.iter().map(|x| x * x).sum::<f64>().sqrt(), 1.0);
}

#[test]
fn xyzbc_reaches_the_tool_change_of_the_example_program() {
    let machine = shipped("xyzbc");
    for (name, target_mm) in [("X", -365.0), ("Y", 224.0), ("Z", 610.0)] {
        let axis = machine.axis(machine.axis_by_name(name).expect(name));
        let [lower, upper] = axis.travel_lu.expect("travel");
        assert!(lower <= target_mm && target_mm <= upper, "SUPA G0 {name}{target_mm} is outside the travel");
        assert_eq!(axis.home_lu, target_mm);
    }
    let KinematicsSettings::Rotary { table, head } = &machine.kinematics else { panic!("no rotary axes") };
    assert_eq!((machine.axis(head[0].axis).name.as_str(), head[0].direction), ("B", [0.0, 1.0, 0.0]));
    assert_eq!((machine.axis(table[0].axis).name.as_str(), table[0].direction), ("C", [0.0, 0.0, 1.0]));
    assert_limits(&machine, "B", [PI, 4.0 * PI, 120.0 * PI, 120.0 * PI]);
}

#[test]
fn the_documented_example_is_accepted_as_it_is() {
    let loaded = parse(EXAMPLE).unwrap_or_else(|found| panic!("{}", shown(&found)));
    let machine = &loaded.machine;
    assert_eq!(machine.feed.time_law, TimeLawKind::Continuous);
    assert!(loaded.warnings.is_empty(), "{}", shown(&loaded.warnings));
    assert!(machine::unsupported(machine).is_empty());
    assert_eq!((&*loaded.name, loaded.text_as_used.as_str()), ("test.toml", EXAMPLE));
    assert_eq!(machine.axes[0].machine_axis.as_deref(), Some("AX1"));
}

#[test]
fn a_minimal_machine_has_the_documented_defaults() {
    let loaded = parse(MINIMAL).unwrap_or_else(|found| panic!("{}", shown(&found)));
    assert_eq!(loaded.warnings, []);
    let machine = loaded.machine;
    assert_eq!(machine::unsupported(&machine), []);
    assert_eq!(machine.smoothing.blend_law, BlendLaw::Limits);
    assert_eq!((machine.smoothing.alpha_ratio, machine.smoothing.contour_tolerance_mm), (2.5, 0.1));
    assert_eq!((machine.feed.default_path_mode, machine.feed.overload_ratio), (PathMode::G642, 1.2));
    assert_eq!(machine.kinematics, KinematicsSettings::Cartesian);
    let axis = &machine.axes[0];
    assert_eq!((axis.index, axis.home_lu, axis.travel_lu), (1, 0.0, None));
    assert_eq!(axis.limits.transition_jerk_max_lu_s3, 50e3);
    assert_eq!(axis.drive, None);
    assert_eq!(machine.ideal_axes().count(), 1);
    near(machine.cycle.time_base.setpoint_period_s(), 2e-3);
}

#[test]
fn axes_are_ordered_by_index() {
    let more = "\n[axes.Z]\nindex = 1\nvelocity_max_m_min = 1\nacceleration_max_m_s2 = 1\njerk_max_m_s3 = 1\n";
    let machine = parse(&format!("{MINIMAL}{more}")).expect("a machine").machine;
    let order: Vec<(&str, u32)> = machine.axes.iter().map(|axis| (axis.name.as_str(), axis.index)).collect();
    assert_eq!(order, [("Z", 1), ("X", 2)]);
}

#[test]
fn a_byte_order_mark_and_crlf_change_nothing() {
    let windows = format!("\u{feff}{}", EXAMPLE.replace('\n', "\r\n"));
    assert_eq!(parse(&windows).expect("a machine").machine, parse(EXAMPLE).expect("a machine").machine);
}
