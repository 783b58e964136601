//! What is refused, and that the message names key, value, unit and allowed range.

use crate::{EXAMPLE, MINIMAL, parse, shown, with};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use sollwert::base::{Diagnostic, Severity};
use sollwert::machine;

/// The errors of a file, which must have some.
fn errors(text: &str) -> Vec<Diagnostic> {
    let found = parse(text).err().unwrap_or_else(|| panic!("accepted:\n{text}"));
    found.into_iter().filter(|finding| finding.severity == Severity::Error).collect()
}

/// The only error of a file, rendered.
fn only_error(text: &str) -> String {
    let found = errors(text);
    assert_eq!(found.len(), 1, "{}", shown(&found));
    found[0].render(false)
}

fn assert_says(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "{word:?} is not in\n{message}");
    }
}

#[test]
fn a_negative_jerk() {
    let message = only_error(&with(EXAMPLE, "\njerk_max_m_s3 = 15.0", "\njerk_max_m_s3 = -15.0"));
    assert_says(&message, &["axes.X.jerk_max_m_s3 = -15.0 m/s³", "greater than 0 m/s³", "test.toml:45:17", "MD32431"]);
}

#[test]
fn a_misspelt_key() {
    let message = only_error(&with(EXAMPLE, "pitch_mm = 12.0", "ptich_mm = 12.0"));
    assert_says(&message, &["unknown key axes.X.mechanics.ptich_mm", "did you mean pitch_mm?"]);
}

/// A table, the line to break, what to write, and what the message says.
const OUT_OF_RANGE: &[(&str, &str, &[&str])] = &[
    ("t_cyl_ms = 8.0", "t_cyl_ms = 0.0", &["cycle.t_cyl_ms = 0.0 ms", "greater than 0 ms and at most 1000 ms"]),
    ("f_s = 0.125", "f_s = 1.25", &["cycle.f_s = 1.25", "at most 1"]),
    ("f_s = 0.125", "f_s = 0", &["cycle.f_s = 0 ", "greater than 0"]),
    ("blocks = 8", "blocks = 0", &["look_ahead.blocks = 0", "from 1 to"]),
    ("blocks = 8", "blocks = 1.5", &["look_ahead.blocks = 1.5", "whole number"]),
    ("overload_factor = 1.2", "overload_factor = nan", &["feed.overload_factor = nan", "greater than 0"]),
    ("alpha = 2.5", "alpha = 4.0", &["smoothing.alpha = 4.0", "less than 4"]),
    ("radial_jerk_share = 0.2", "radial_jerk_share = 1.0", &["smoothing.radial_jerk_share = 1.0", "less than 1"]),
    (
        "velocity_max_m_min = 20.0",
        "velocity_max_m_min = inf",
        &["axes.X.velocity_max_m_min = inf m/min", "greater than 0"],
    ),
    ("velocity_max_m_min = 20.0", "velocity_max_m_min = 1e999", &["axes.X.velocity_max_m_min = 1e999 m/min"]),
    (
        "acceleration_max_m_s2 = 1.0",
        "acceleration_max_m_s2 = 1e300",
        &["axes.X.acceleration_max_m_s2 = 1e300 m/s²", "1e12"],
    ),
    (
        "travel_mm = [-425.0, 425.0]",
        "travel_mm = [425.0, -425.0]",
        &["axes.X.travel_mm = [425, -425] mm", "lower < upper"],
    ),
    ("travel_mm = [-425.0, 425.0]", "travel_mm = [1.0]", &["axes.X.travel_mm has 1 numbers, expected 2"]),
    (
        "position_gain_per_s = 50.0",
        "position_gain_per_s = 0.0",
        &["position_gain_per_s = 0.0 1/s", "greater than 0 1/s"],
    ),
    ("setpoint_delay_ms = 1.2", "setpoint_delay_ms = -1", &["setpoint_delay_ms = -1 ms", "0 ms to 1000 ms"]),
    ("setpoint_delay_ms = 1.2", "setpoint_delay_ms = inf", &["setpoint_delay_ms = inf ms", "0 ms to 1000 ms"]),
    ("current_max_a = 28.0", "current_max_a = 0", &["current_max_a = 0 A", "or inf"]),
    (
        "speed_reset_time_ms = 10.0",
        "speed_reset_time_ms = 0",
        &["speed_reset_time_ms = 0 ms", "inf = no integral part"],
    ),
    ("resistance_ohm = 0.75", "resistance_ohm = inf", &["axes.X.motor.resistance_ohm = inf ohm", "greater than 0"]),
    ("inductance_mh = 6.5", "inductance_mh = -6.5", &["axes.X.motor.inductance_mh = -6.5 mH"]),
    ("back_emf_v_s_per_rad = 0.43", "back_emf_v_s_per_rad = -0.1", &["= -0.1 V·s/rad", "0 V·s/rad or more"]),
    ("pitch_mm = 12.0", "pitch_mm = 0.0", &["axes.X.mechanics.pitch_mm = 0.0 mm", "not 0 mm"]),
    ("gear_ratio = 1.0", "gear_ratio = 0", &["axes.X.mechanics.gear_ratio = 0", "not 0"]),
    ("inertia_kg_m2 = 0.0085               # everything", "inertia_kg_m2 = 0 #", &["inertia_kg_m2 = 0 kg·m²"]),
    ("viscous_friction_n_m_s_per_rad = 0.010", "viscous_friction_n_m_s_per_rad = -1", &["= -1 N·m·s/rad"]),
    ("breakaway_friction_n_m = 0.6", "breakaway_friction_n_m = 0.5", &["= 0.5 N·m", "coulomb_friction_n_m = 0.6 N·m"]),
    ("gravity_sin_n_m = 0.0", "gravity_sin_n_m = 1.0", &["gravity_sin_n_m", "use gravity_n_m"]),
    ("gravity_n_m = 0.0", "gravity_n_m = nan", &["axes.X.mechanics.gravity_n_m = nan N·m", "finite"]),
    ("setpoint_delay_ms = 1.2", "setpoint_delay_ms = 1e9", &["setpoint_delay_ms = 1e9 ms", "0 ms to 1000 ms"]),
    ("feedforward_delay_ms = 0.0", "feedforward_delay_ms = 1e9", &["feedforward_delay_ms = 1e9 ms", "0 ms to 1000 ms"]),
    ("motor_resolution_rad = 0.0", "motor_resolution_rad = -1e-6", &["motor_resolution_rad = -1e-6 rad"]),
];

#[test]
fn every_value_outside_its_range() {
    for (from, to, words) in OUT_OF_RANGE {
        assert_says(&only_error(&with(EXAMPLE, from, to)), words);
    }
}

/// The loops of the example run at 1 ms and 125 µs: 500 Hz and 4000 Hz are half their rates.
#[test]
fn a_filter_above_half_the_rate_of_its_loop() {
    let add = |lines: &str| with(EXAMPLE, "current_max_a = 28.0", &format!("current_max_a = 28.0\n{lines}"));
    for (lines, key) in [
        ("speed_filter = \"pt1\"\nspeed_filter_frequency_hz = 4000.0", "speed_filter_frequency_hz"),
        ("current_filter_3 = \"pt2\"\ncurrent_filter_3_frequency_hz = 4100.0", "current_filter_3_frequency_hz"),
        ("reference_model_frequency_hz = 5e3", "reference_model_frequency_hz"),
        ("jerk_filter = \"band_stop\"\njerk_filter_frequency_hz = 500.0", "jerk_filter_frequency_hz"),
        ("jerk_filter = \"second_order\"\njerk_filter_time_ms = 0.6", "jerk_filter_time_ms"),
    ] {
        let message = only_error(&add(lines));
        assert_says(&message, &[key, "not below half the sampling frequency"]);
    }
    let off = add("speed_filter_frequency_hz = 4000.0\njerk_filter_frequency_hz = 900.0");
    assert!(parse(&off).is_ok(), "a filter that is off has no frequency");
}

#[test]
fn infinity_is_allowed_where_it_means_no_limit() {
    let keys = [
        ("speed_setpoint_max_mm_s = 400.0", "speed_setpoint_max_mm_s = inf"),
        ("current_max_a = 28.0", "current_max_a = inf"),
        ("voltage_max_v = 245.0", "voltage_max_v = inf"),
        ("speed_reset_time_ms = 10.0", "speed_reset_time_ms = inf"),
        ("current_reset_time_ms = 2.0", "current_reset_time_ms = +inf"),
    ];
    for (from, to) in keys {
        let text = with(EXAMPLE, from, to);
        assert!(parse(&text).is_ok(), "{to} is refused");
    }
    assert!(parse(&with(EXAMPLE, "pitch_mm = 12.0", "pitch_mm = -12.0")).is_ok(), "a negative pitch is refused");
}

#[test]
fn cycles_that_are_no_whole_multiples_name_both_values() {
    let position = only_error(&with(EXAMPLE, "position_cycle_ms = 1.0", "position_cycle_ms = 0.75"));
    assert_says(&position, &["cycle.f_s * cycle.t_cyl_ms = 1 ms", "axes.X.drive.position_cycle_ms = 0.75 ms"]);
    let slower = only_error(&with(EXAMPLE, "position_cycle_ms = 1.0", "position_cycle_ms = 2.0"));
    assert_says(&slower, &["= 1 ms must be a whole multiple of", "position_cycle_ms = 2 ms"]);
    let speed = only_error(&with(EXAMPLE, "speed_cycle_us = 125.0", "speed_cycle_us = 187.5"));
    assert_says(&speed, &["axes.X.drive.position_cycle_ms = 1 ms", "axes.X.drive.speed_cycle_us = 187.5 µs"]);
    let current = only_error(&with(EXAMPLE, "current_cycle_us = 62.5", "current_cycle_us = 41.667"));
    assert_says(&current, &["speed_cycle_us = 125 µs", "current_cycle_us = 41.667 µs", "current_cycle_us = 41.6666"]);
}

#[test]
fn a_third_of_a_cycle_is_a_whole_ratio() {
    // 250 µs / 83.333... µs = 3 (models/drive.md section 8); t_s = 1 ms is 4 * 3 = 12 ticks of 83.333 µs.
    let text = with(EXAMPLE, "speed_cycle_us = 125.0", "speed_cycle_us = 250.0");
    let text = with(&text, "current_cycle_us = 62.5", "current_cycle_us = 83.3333333333333");
    let machine = parse(&text).unwrap_or_else(|found| panic!("{}", shown(&found))).machine;
    let drive = machine.axes[0].drive.as_ref().expect("a drive");
    assert_eq!((drive.position_cycle_ticks, drive.speed_cycle_ticks, drive.current_cycle_ticks), (12, 3, 1));
    assert_eq!(machine.cycle.time_base.time_ns(sollwert::base::Tick(12)), 1_000_000);
    // f_s = 1/12 with ten digits, t_cyl = 12 ms: t_s is 1 ms exactly, also after a day.
    let text = with(&with(EXAMPLE, "f_s = 0.125", "f_s = 0.08333333333"), "t_cyl_ms = 8.0", "t_cyl_ms = 12");
    let time_base = parse(&text).unwrap_or_else(|found| panic!("{}", shown(&found))).machine.cycle.time_base;
    assert_eq!(time_base.time_ns(time_base.setpoint_tick(86_400_000)), 86_400_000_000_000);
}

#[test]
fn absurd_ratios_are_refused_without_overflow() {
    let text = with(EXAMPLE, "current_cycle_us = 62.5", "current_cycle_us = 1e-9");
    assert_says(&only_error(&text), &["current_cycle_us = 1e-9 µs", "allowed: 1 µs to 1000000 µs"]);
    assert_says(&only_error(&with(MINIMAL, "t_cyl_ms = 2.0", "t_cyl_ms = 1e-9")), &["t_s = ", "0.001 ms to 1000 ms"]);
    let digits = "t_cyl_ms = 3.141592653589793\nf_s = 0.5772156649015329";
    assert_says(&only_error(&with(MINIMAL, "t_cyl_ms = 2.0", digits)), &["cycle.t_cyl_ms", "too many digits"]);
}

#[test]
fn missing_keys_and_tables_are_named_with_their_unit() {
    let message = only_error(&with(MINIMAL, "jerk_max_m_s3 = 50.0\n", ""));
    assert_says(&message, &["[axes.X] has no jerk_max_m_s3 (m/s³)", "test.toml:7:7"]);
    let message = only_error(&with(MINIMAL, "t_cyl_ms = 2.0\n", ""));
    assert_says(&message, &["[cycle] has no t_cyl_ms (ms)"]);
    assert_says(&only_error(&with(MINIMAL, "format = 1\n", "")), &["has no format"]);
    assert_says(&only_error(&with(MINIMAL, "format = 1", "format = 2")), &["format = 2"]);
    let no_axes = &MINIMAL[..MINIMAL.find("[axes").expect("axes")];
    assert_says(&only_error(no_axes), &["the machine has no axes", "[axes.X]"]);
    assert_says(&shown(&errors("")), &["has no format", "has no name", "[cycle] has no t_cyl_ms", "no axes"]);
}

#[test]
fn half_a_drive() {
    let start = EXAMPLE.find("[axes.X.motor]").expect("motor");
    let end = EXAMPLE.find("[axes.X.mechanics]").expect("mechanics");
    let message = only_error(&format!("{}{}", &EXAMPLE[..start], &EXAMPLE[end..]));
    assert_says(&message, &["[axes.X.drive] needs [axes.X.motor] as well", "ideal axis"]);
    let encoder_alone = format!("{MINIMAL}\n[axes.X.encoder]\nmotor_resolution_rad = 0.0\n");
    assert_says(&shown(&errors(&encoder_alone)), &["[axes.X.encoder] needs [axes.X.drive]"]);
}

#[test]
fn wrong_types() {
    let message = only_error(&with(MINIMAL, "= 30.0", "= \"30.0\""));
    assert_says(&message, &["expected a number, found the text \"30.0\"", "write 30.0 without quotes"]);
    assert_says(&only_error(&with(MINIMAL, "= 30.0", "= \"30,5\"")), &["write 30.5, with a decimal point"]);
    assert_says(&only_error(&with(MINIMAL, "\"smallest\"", "1")), &["name: expected a text"]);
    assert_says(&only_error(&with(MINIMAL, "\"smallest\"", "\" \"")), &["name is an empty text"]);
    assert_says(&only_error(&with(EXAMPLE, "identified = false", "identified = 0")), &["expected true or false"]);
    let message = only_error(&format!("feed = 3\n{MINIMAL}"));
    assert_says(&message, &["feed must be a table, found the number 3"]);
}

#[test]
fn unknown_words_say_which_there_are() {
    let message = only_error(&with(EXAMPLE, "\"follow_up\"", "\"follow-up\""));
    assert_says(&message, &["feed.corner_rule = \"follow-up\"", "did you mean \"follow_up\"?", "\"overload\""]);
}

#[test]
fn rotary_keys_on_a_linear_axis_and_the_other_way() {
    let message = only_error(&with(MINIMAL, "velocity_max_m_min = 30.0", "velocity_max_rpm = 30.0"));
    assert_says(&message, &["velocity_max_rpm belongs to a rotary axis", "use velocity_max_m_min"]);
    let message = only_error(&with(EXAMPLE, "speed_setpoint_max_mm_s = 400.0", "speed_setpoint_max_deg_s = 400.0"));
    assert_says(&message, &["belongs to a rotary axis", "use speed_setpoint_max_mm_s"]);
    let rotary = with(MINIMAL, "[axes.X]", "[axes.C]\nkind = \"rotary\"");
    let found = shown(&errors(&rotary));
    assert_says(&found, &["use velocity_max_rpm", "use acceleration_max_rot_s2", "use jerk_max_rot_s3"]);
    assert_says(
        &only_error(&with(MINIMAL, "[axes.X]", "[axes.X]\nmodulo = true")),
        &["modulo belongs to a rotary axis"],
    );
    let (name, mikron) = machine::shipped()[2];
    assert_eq!(name, "mikron_ucp710");
    let message = only_error(&with(mikron, "gear_ratio = 120.0", "pitch_mm = 120.0"));
    assert_says(&message, &["pitch_mm belongs to a linear axis", "use gear_ratio"]);
    assert_says(&only_error(&with(mikron, "gear_ratio = 120.0", "#")), &["[axes.A.mechanics] has no gear_ratio"]);
    let endless = with(mikron, "modulo = true", "modulo = true\ntravel_deg = [-1, 1]");
    assert_says(&only_error(&endless), &["an endless axis has no travel"]);
}

#[test]
fn axis_names() {
    for (name, words) in [
        ("G", "G is a path condition"),
        ("M1", "M is a machine function"),
        ("R", "R parameter"),
        ("x", "write [axes.X]"),
        ("Xy", "capital letter"),
        ("X_Y", "capital letter"),
        ("1", "capital letter"),
        ("\"Ä\"", "capital letter"),
        ("\"\"", "capital letter"),
    ] {
        assert_says(&only_error(&with(MINIMAL, "[axes.X]", &format!("[axes.{name}]"))), &[words]);
    }
    for name in ["X", "Z2", "X1", "U", "C", "XY", "ELX", "SP_1"] {
        assert!(parse(&with(MINIMAL, "[axes.X]", &format!("[axes.{name}]"))).is_ok(), "{name} is refused");
    }
}

#[test]
fn numbers_and_names_are_given_once() {
    let axis = |name: &str, key: &str| {
        format!("\n[axes.{name}]\n{key}\nvelocity_max_m_min = 1\nacceleration_max_m_s2 = 1\njerk_max_m_s3 = 1\n")
    };
    let text = format!("{MINIMAL}{}{}", axis("Y", "index = 4"), axis("Z", "index = 4"));
    assert_says(&only_error(&text), &["axes.Y and axes.Z both have index = 4"]);
    let text = format!("{MINIMAL}{}{}", axis("Y", "machine_axis = \"A\""), axis("Z", "machine_axis = \"A\""));
    assert_says(&only_error(&text), &["both have machine_axis = \"A\""]);
    let many: String = "ABCEOPQU".chars().map(|name| axis(&name.to_string(), "")).collect();
    assert_says(&only_error(&format!("{MINIMAL}{many}")), &["9 axes, at most 8"]);
}

#[test]
fn kinematics_name_rotary_axes_that_exist() {
    let (_, mikron) = machine::shipped()[2];
    let missing = only_error(&with(mikron, "{ axis = \"C\"", "{ axis = \"B\""));
    assert_says(&missing, &["axis = \"B\": the machine has no such axis"]);
    assert_says(&only_error(&with(mikron, "{ axis = \"C\"", "{ axis = \"X\"")), &["\"X\" is a linear axis"]);
    assert_says(&only_error(&with(mikron, "{ axis = \"C\"", "{ axis = \"A\"")), &["names the axis A twice"]);
    let none = with(mikron, "direction = [-1, 0, 0]", "direction = [0, 0.0, -0.0]");
    assert_says(&only_error(&none), &["kinematics.rotary[0].direction = [0, 0, 0] is no direction"]);
    assert_says(
        &only_error(&with(mikron, "direction = [-1, 0, 0]", "direction = [nan, 0, 1]")),
        &["direction[0] = nan"],
    );
    let tool = with(mikron, "direction = [-1, 0, 0]", "direction = [-1, 0, 0], carries = \"tool\"");
    assert_says(&only_error(&tool), &["carries the tool", "head-table"]);
    let silent = with(mikron, "\"table-table\"", "\"head-table\"");
    assert_says(&shown(&errors(&silent)), &["rotary[0] does not say what the axis carries"]);
    let cartesian = with(mikron, "\"table-table\"", "\"cartesian\"");
    assert_says(&only_error(&cartesian), &["kinematics.rotary needs type"]);
    let no_list = format!("{MINIMAL}\n[kinematics]\ntype = \"table-table\"\n");
    assert_says(&shown(&errors(&no_list)), &["needs one or two rotary axes", "there is no Y", "there is no Z"]);
    let long = with(mikron, "direction = [-1, 0, 0]", "direction = [-1e12, 0, 0]");
    let machine = parse(&long).unwrap_or_else(|found| panic!("{}", shown(&found))).machine;
    let machine::KinematicsSettings::Rotary { table, .. } = machine.kinematics else { panic!("no rotary axes") };
    assert_eq!(table[0].direction, [-1.0, 0.0, 0.0]);
}

#[test]
fn all_faults_of_a_file_are_found_at_once_in_its_order() {
    let text = with(MINIMAL, "t_cyl_ms = 2.0", "t_cyl_ms = -2.0\nf_x = 1");
    let text = with(&text, "jerk_max_m_s3 = 50.0", "jerk_max_m_s3 = 0\npitch_mm = 3");
    let found = errors(&text);
    let lines: Vec<u32> = found.iter().map(Diagnostic::line).collect();
    assert_eq!(lines, [5, 6, 11, 12], "{}", shown(&found));
    assert_says(&found[3].render(false), &["it belongs to [axes.X.mechanics]"]);
}

#[test]
fn a_file_that_is_no_toml_marks_each_place() {
    let text = with(MINIMAL, "name = \"smallest\"", "name = \"smallest");
    let text = with(&text, "t_cyl_ms = 2.0", "t_cyl_ms = = 2.0");
    let text = with(&text, "jerk_max_m_s3 = 50.0", "jerk_max_m_s3 = -50.0");
    let found = errors(&text);
    let lines: Vec<u32> = found.iter().map(Diagnostic::line).collect();
    assert!(lines.contains(&2) && lines.contains(&5) && lines.contains(&10), "{}", shown(&found));
    let twice = format!("{MINIMAL}jerk_max_m_s3 = 1.0\n");
    assert_says(&shown(&errors(&twice)), &["duplicate key", "test.toml:11"]);
}

#[test]
fn home_outside_the_travel_is_a_warning() {
    let loaded = parse(&with(MINIMAL, "[axes.X]", "[axes.X]\ntravel_mm = [5, 10]")).expect("a machine");
    assert_says(&shown(&loaded.warnings), &["warning", "axes.X.home_mm = 0 mm", "5 .. 10 mm"]);
}

#[test]
fn a_drive_that_cannot_reach_its_velocity_is_a_warning() {
    let clamp = with(EXAMPLE, "speed_setpoint_max_mm_s = 400.0", "speed_setpoint_max_mm_s = 300.0");
    assert_says(&shown(&parse(&clamp).expect("a machine").warnings), &["speed_setpoint_max clamps"]);
    // 333.3 mm/s / (12 mm / 2π) = 174.5 rad/s; * 1.5 V s/rad = 262 V.
    let emf = with(EXAMPLE, "back_emf_v_s_per_rad = 0.43", "back_emf_v_s_per_rad = 1.5");
    assert_says(&shown(&parse(&emf).expect("a machine").warnings), &["262 V", "245 V"]);
}

#[test]
fn dynamics_sets_are_kept() {
    let sets = "\n[axes.X.dynamics.finish]\njerk_max_m_s3 = 5\n\n[axes.X.dynamics.rough]\nvelocity_max_m_min = 15\n";
    let loaded = parse(&format!("{MINIMAL}{sets}")).unwrap_or_else(|found| panic!("{}", shown(&found)));
    let axis = &loaded.machine.axes[0];
    let finish = axis.dynamics.get(machine::DynamicsMode::Finish).expect("finish");
    assert_eq!((finish.jerk_max_lu_s3, finish.transition_jerk_max_lu_s3), (5e3, 5e3));
    assert_eq!(finish.velocity_max_lu_s, axis.limits.velocity_max_lu_s);
    assert_eq!(axis.dynamics.get(machine::DynamicsMode::Rough).expect("rough").velocity_max_lu_s, 250.0);
    assert_eq!(axis.dynamics.get(machine::DynamicsMode::Norm), None);
    assert_eq!(axis.dynamics.get(machine::DynamicsMode::Precision).expect("as finish").jerk_max_lu_s3, 5e3);
    let wrong = format!("{MINIMAL}\n[axes.X.dynamics.finnish]\njerk_max_m_s3 = 5\n");
    assert_says(&only_error(&wrong), &["unknown dynamics set axes.X.dynamics.finnish", "did you mean finish?"]);
    let wrong = format!("{MINIMAL}\n[axes.X.dynamics.finish]\njerk_max_m_s3 = -5\n");
    assert_says(&only_error(&wrong), &["axes.X.dynamics.finish.jerk_max_m_s3 = -5 m/s³"]);
}

#[test]
fn published_models_under_the_continuous_law_are_refused_by_name() {
    let later = [
        ("\"worst\"", "\"printed\"", "feed.arc_limits = \"printed\""),
        ("blend_law = \"limits\"", "blend_law = \"published\"", "smoothing.blend_law = \"published\""),
        ("blend_law = \"limits\"", "blend_law = \"entry\"", "smoothing.blend_law = \"entry\""),
        ("limits = \"axis\"", "limits = \"path\"", "smoothing.limits = \"path\""),
    ];
    for (from, to, name) in later {
        let text = with(EXAMPLE, from, to);
        let loaded = parse(&text).unwrap_or_else(|found| panic!("{}", shown(&found)));
        assert_eq!(loaded.warnings.len(), 1);
        assert_eq!(loaded.warnings[0].severity, Severity::Warning);
        assert!(loaded.warnings[0].message.contains(name) && loaded.warnings[0].place.is_some());
        let refused = machine::unsupported(&loaded.machine);
        assert!(refused.len() == 1 && refused[0].severity == Severity::Error && refused[0].message.contains(name));
        assert!(refused[0].help.is_some());
        let now = with(&text, "time_law = \"continuous\"", "time_law = \"seven-phase\"");
        assert_eq!(machine::unsupported(&parse(&now).expect("a machine").machine), []);
    }
    for mode in ["G60", "G64", "G641", "G642"] {
        let machine = parse(&with(EXAMPLE, "\"G642\"", &format!("\"{mode}\""))).expect(mode).machine;
        assert_eq!(machine::unsupported(&machine), [], "{mode}");
    }
}

#[test]
fn no_machine_of_that_name() {
    let Err(machine::LoadError::Unreadable(diagnostic)) = machine::load("spinner_mvc580", &[]) else {
        panic!("read or invalid")
    };
    assert_says(&diagnostic.render(false), &["spinner_mvc580", "did you mean spinner_mvc850?", "xyzbc"]);
    // A folder is no file.
    assert!(matches!(machine::load("src", &[]), Err(machine::LoadError::Unreadable(_))));
}

/// A place in a text, cut to a character border.
fn border(text: &str, share: f64) -> usize {
    let mut place = (text.len() as f64 * share) as usize;
    while !text.is_char_boundary(place) {
        place -= 1;
    }
    place
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, rng_seed: RngSeed::Fixed(2), ..ProptestConfig::default() })]

    /// Any change of a file gives a machine or an explanation with a place, and never a panic.
    #[test]
    fn any_mutation_is_answered(
        machine in 0..5_usize,
        edits in prop::collection::vec((0.0..1.0_f64, 0..12_usize, prop_oneof![
            "[-+0-9.eE]{1,6}", "[\\[\\]{}=\",#.\n]{1,3}", "(nan|inf|-inf|true|0|-1|1e300|1e-300|\"\"|\\[\\]|\\{\\})", "\\PC{0,4}",
        ]), 1..4),
    ) {
        let mut text = machine::shipped()[machine].1.to_owned();
        for (share, length, new) in edits {
            let start = border(&text, share);
            let mut end = (start + length).min(text.len());
            while !text.is_char_boundary(end) {
                end += 1;
            }
            text.replace_range(start..end, &new);
        }
        if let Err(found) = parse(&text) {
            prop_assert!(found.iter().any(|finding| finding.severity == Severity::Error));
            prop_assert!(found.iter().all(|finding| finding.place.is_some()));
            let _ = shown(&found);
        }
    }

    /// Any value in any numeric key: what is accepted is finite, or infinite where that means no limit.
    #[test]
    fn any_number_anywhere(line in 0..400_usize, value in prop_oneof![
        any::<f64>(), -1e3..1e3_f64, Just(f64::NAN), Just(f64::INFINITY), Just(0.0), Just(1e-12), Just(1e12),
    ]) {
        let text = machine::shipped()[2].1;
        let lines: Vec<&str> = text.lines().collect();
        let line = line % lines.len();
        if let Some((key, _)) = lines[line].split_once(" = ") {
            let changed = lines.iter().enumerate().map(|(i, old)| {
                if i == line { format!("{key} = {value:e}\n") } else { format!("{old}\n") }
            });
            let changed: String = changed.collect::<String>().replace("NaN", "nan");
            if let Ok(loaded) = parse(&changed) {
                for axis in &loaded.machine.axes {
                    let limits = [axis.limits.velocity_max_lu_s, axis.limits.acceleration_max_lu_s2, axis.limits.jerk_max_lu_s3];
                    prop_assert!(limits.iter().all(|limit| limit.is_finite() && *limit > 0.0));
                    let drive = axis.drive.as_ref().expect("a drive");
                    prop_assert!(drive.mechanics.transmission_lu_per_rad.is_finite());
                    prop_assert!(drive.mechanics.transmission_lu_per_rad != 0.0);
                    prop_assert!(drive.current_cycle_ticks > 0);
                }
                prop_assert!(loaded.machine.cycle.time_base.setpoint_period_s() > 0.0);
            }
        }
    }
}
