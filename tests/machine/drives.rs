//! Rejections of models/drive.md section 8, key by key, and what a drive file may say besides: linear motors, rack, second mass, tables.

use crate::{EXAMPLE, parse, shown, with};
use sollwert::base::{Diagnostic, SourceText};
use sollwert::machine::{self, Machine};

/// Greater than 0, and finite.
const POSITIVE: &[&str] = &[
    "drive.position_cycle_ms",
    "drive.speed_cycle_us",
    "drive.current_cycle_us",
    "drive.position_gain_per_s",
    "drive.speed_gain_n_m_s_per_rad",
    "drive.current_gain_v_per_a",
    "motor.resistance_ohm",
    "motor.inductance_mh",
    "motor.torque_constant_n_m_per_a",
    "mechanics.inertia_kg_m2",
];
/// Greater than 0, or infinite.
const POSITIVE_OR_INFINITE: &[&str] = &[
    "drive.speed_setpoint_max_mm_s",
    "drive.speed_reset_time_ms",
    "drive.current_reset_time_ms",
    "drive.current_max_a",
    "drive.voltage_max_v",
];
/// 0 or more, and finite.
const NOT_NEGATIVE: &[&str] = &[
    "drive.velocity_feedforward",
    "drive.torque_feedforward",
    "drive.feedforward_inertia_kg_m2",
    "drive.setpoint_delay_ms",
    "drive.feedforward_delay_ms",
    "motor.back_emf_v_s_per_rad",
    "mechanics.viscous_friction_n_m_s_per_rad",
    "mechanics.coulomb_friction_n_m",
    "mechanics.load_inertia_kg_m2",
    "mechanics.coupling_damping_n_m_s_per_rad",
    "encoder.position_resolution_um",
    "encoder.motor_resolution_rad",
];

fn loaded(text: &str, sets: &[String]) -> Result<Machine, String> {
    machine::parse(&SourceText::new("test.toml", text), sets)
        .map(|loaded| loaded.machine)
        .map_err(|found| shown(&found))
}

/// Every key of the cascade with every value that section 8 forbids: refused, and the key named.
#[test]
fn section_8_rejections_name_their_key() {
    let cases = [
        (POSITIVE, &["nan", "inf", "-inf", "0", "-1"][..]),
        (POSITIVE_OR_INFINITE, &["nan", "-inf", "0", "-1"][..]),
        (NOT_NEGATIVE, &["nan", "inf", "-inf", "-1"][..]),
        (&["mechanics.pitch_mm", "mechanics.gear_ratio"], &["nan", "inf", "-inf", "0"][..]),
        (&["mechanics.gravity_n_m"], &["nan", "inf", "-inf"][..]),
    ];
    for (keys, values) in cases {
        for key in keys {
            for value in values {
                let message = loaded(EXAMPLE, &[format!("axes.X.{key}={value}")]).expect_err(key);
                assert!(message.contains(&format!("axes.X.{key}")), "{key} = {value}:\n{message}");
            }
        }
    }
    let (_, mikron) = machine::shipped()[2];
    for (key, values) in [
        ("mechanics.gravity_sin_n_m", &["nan", "inf", "-inf"][..]),
        ("mechanics.gravity_cos_n_m", &["nan", "inf", "-inf"]),
        ("mechanics.gear_ratio", &["nan", "inf", "0"]),
        ("drive.speed_setpoint_max_deg_s", &["nan", "0", "-1"]),
        ("encoder.position_resolution_deg", &["nan", "inf", "-1"]),
    ] {
        for value in values {
            let message = loaded(mikron, &[format!("axes.A.{key}={value}")]).expect_err(key);
            assert!(message.contains(&format!("axes.A.{key}")), "{key} = {value}:\n{message}");
        }
    }
    for key in POSITIVE_OR_INFINITE {
        assert!(loaded(EXAMPLE, &[format!("axes.X.{key}=inf")]).is_ok(), "{key} = inf is refused");
    }
}

const LINEAR_MOTOR: &str = "\
format = 1
name = \"linear motor\"
[cycle]
t_cyl_ms = 2.0
[axes.X]
velocity_max_m_min = 100.0
acceleration_max_m_s2 = 15.0
jerk_max_m_s3 = 500.0
[axes.X.drive]
position_cycle_ms = 2.0
speed_cycle_us = 125.0
current_cycle_us = 125.0
position_gain_per_s = 100.0
speed_gain_n_s_per_m = 30000.0
speed_reset_time_ms = 8.0
current_gain_v_per_a = 20.0
current_reset_time_ms = 2.0
current_max_a = 30.0
voltage_max_v = 245.0
[axes.X.motor]
kind = \"linear\"
resistance_ohm = 1.5
inductance_mh = 15.0
back_emf_v_s_per_m = 40.0
force_constant_n_per_a = 120.0
[axes.X.mechanics]
mass_kg = 350.0
viscous_friction_n_s_per_m = 200.0
coulomb_friction_n = 150.0
";

#[test]
fn a_linear_motor_speaks_of_newtons_and_metres() {
    let with_mass = [
        "axes.X.mechanics.load_mass_kg=100".to_owned(),
        "axes.X.mechanics.coupling_stiffness_n_per_um=80".to_owned(),
        "axes.X.encoder.motor_resolution_um=0.1".to_owned(),
    ];
    let machine = loaded(LINEAR_MOTOR, &with_mass).unwrap_or_else(|found| panic!("{found}"));
    let drive = machine.axes[0].drive.as_ref().expect("a drive");
    let mechanics = &drive.mechanics;
    assert_eq!((mechanics.transmission_lu_per_rad, mechanics.inertia_kg_m2), (1000.0, 350.0));
    assert_eq!((mechanics.load_inertia_kg_m2, mechanics.breakaway_friction_n_m), (100.0, 150.0));
    assert!((mechanics.coupling_stiffness_n_m_per_rad / 80e6 - 1.0).abs() < 1e-15);
    assert!((drive.encoder.motor_resolution_rad / 1e-7 - 1.0).abs() < 1e-15);
    assert_eq!(drive.feedforward_inertia_kg_m2, 350.0, "J_ff is the mass unless given");
    for (from, to, words) in [
        ("mass_kg = 350.0", "inertia_kg_m2 = 350.0", &["inertia_kg_m2 belongs to a rotary motor", "use mass_kg"][..]),
        ("mass_kg = 350.0", "", &["[axes.X.mechanics] has no mass_kg (kg)"]),
        ("mass_kg = 350.0", "mass_kg = 350.0\npitch_mm = 10", &["pitch_mm belongs to a rotary motor", "remove it"]),
        ("speed_gain_n_s_per_m", "speed_gain_n_m_s_per_rad", &["use speed_gain_n_s_per_m"]),
        ("kind = \"linear\"", "kind = \"liner\"", &["did you mean \"linear\"?"]),
        ("coulomb_friction_n = 150.0", "coulomb_friction_n = 150\nbreakaway_friction_n = 1", &["= 1 N is less than"]),
    ] {
        let message = loaded(&with(LINEAR_MOTOR, from, to), &[]).expect_err(to);
        words.iter().for_each(|word| assert!(message.contains(word), "{word:?} is not in\n{message}"));
    }
    let message = loaded(EXAMPLE, &["axes.X.motor.force_constant_n_per_a=1".to_owned()]).expect_err("refused");
    assert!(message.contains("belongs to a linear motor") && message.contains("use torque_constant"), "{message}");
    let (_, mikron) = machine::shipped()[2];
    let message = loaded(mikron, &["axes.A.motor.kind=linear".to_owned()]).expect_err("refused");
    assert!(message.contains("on a rotary axis") && message.contains("torque motor"), "{message}");
}

#[test]
fn transmissions_second_mass_and_tables_that_do_not_fit() {
    for (sets, words) in [
        (&["mechanics.pinion_diameter_mm=80"][..], &["pinion_diameter_mm and pitch_mm exclude each other"][..]),
        (&["mechanics.load_inertia_kg_m2=0.004"], &["has no coupling_stiffness_n_m_per_rad", "for a rigid axis"]),
        (
            &["mechanics.load_inertia_kg_m2=0.0085", "mechanics.coupling_stiffness_n_m_per_rad=100"],
            &["load_inertia_kg_m2 = 0.0085 is not less than inertia_kg_m2 = 0.0085"],
        ),
        (&["mechanics.pitch_error_um=[0.0, 5.0]"], &["has no pitch_error_step_mm"]),
        (&["encoder.compensation_um=[0.0]", "encoder.compensation_step_mm=1"], &["has 1 numbers, allowed: 2 to 5000"]),
        (&["encoder.compensation_um=[0.0, nan]", "encoder.compensation_step_mm=1"], &["compensation_um[1] = nan µm"]),
        (&["encoder.compensation_step_mm=1"], &["compensation_step_mm stands without", "add compensation_um"]),
        (&["encoder.compensation_um=[0.0, 600.0]", "encoder.compensation_step_mm=1"], &["by more than half of"]),
        (
            &[
                "mechanics.pitch_error_um=[0, 1]",
                "mechanics.pitch_error_step_mm=1",
                "mechanics.pitch_error_periodic=true",
            ],
            &["its last point is not the first"],
        ),
    ] {
        let sets: Vec<String> = sets.iter().map(|set| format!("axes.X.{set}")).collect();
        let message = loaded(EXAMPLE, &sets).expect_err(&sets[0]);
        words.iter().for_each(|word| assert!(message.contains(word), "{word:?} is not in\n{message}"));
    }
    let message = shown(&parse(&with(EXAMPLE, "pitch_mm = 12.0 ", "# ")).expect_err("no pitch"));
    assert!(message.contains("has no pitch_mm") && message.contains("pinion_diameter_mm"), "{message}");
    let sets = ["axes.X.encoder.compensation_um=[0.0, 5, -2.5]", "axes.X.encoder.compensation_step_mm=100"];
    let machine = loaded(EXAMPLE, &sets.map(str::to_owned)).unwrap_or_else(|found| panic!("{found}"));
    let table = machine.axes[0].drive.as_ref().and_then(|drive| drive.encoder_compensation.as_ref()).expect("a table");
    assert_eq!((table.start_lu, table.step_lu, table.errors_lu.as_slice()), (0.0, 100.0, &[0.0, 0.005, -0.0025][..]));
}

/// A spring that no loop sees is told of, and its key named; one that a loop may see is not.
#[test]
fn a_second_mass_that_is_as_good_as_rigid() {
    // Half and half: the resonance is 4 times 16 kHz at 3.4e8 N·m/rad.
    for (stiffness, told) in [("1e12", true), ("4e8", true), ("3e8", false), ("1e4", false)] {
        let sets = ["load_inertia_kg_m2=0.00425".to_owned(), format!("coupling_stiffness_n_m_per_rad={stiffness}")];
        let sets = sets.map(|set| format!("axes.X.mechanics.{set}"));
        let loaded = machine::parse(&SourceText::new("test.toml", EXAMPLE), &sets)
            .unwrap_or_else(|found| panic!("{}", shown(&found)));
        let found = loaded.warnings.iter().find(|warning| warning.code == "M0105");
        assert_eq!(found.is_some(), told, "{stiffness}");
        let names_key = |found: &Diagnostic| found.message.contains("axes.X.mechanics.coupling_stiffness_n_m_per_rad");
        assert!(found.is_none_or(names_key), "{found:?}");
    }
}

/// Without a time for positioning a block that waits for an axis that never arrives would never end: an hour is the longest.
#[test]
fn nothing_waits_for_longer_than_an_hour() {
    for (time, wanted_s) in [("250", 0.25), ("inf", 3600.0), ("1e12", 3600.0)] {
        let set = format!("axes.X.drive.positioning_time_ms={time}");
        let loaded = machine::parse(&SourceText::new("test.toml", EXAMPLE), &[set])
            .unwrap_or_else(|found| panic!("{}", shown(&found)));
        let drive = loaded.machine.axes[0].drive.as_ref().expect("a drive");
        assert_eq!(drive.monitoring.positioning_time_s, wanted_s, "{time}");
    }
}
