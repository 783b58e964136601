//! `[axes.*.motor]`, `mechanics` and `encoder`: what the drive moves, and what measures it.
//!
//! In: the section of an axis. Out: [`MotorData`], [`Mechanics`], [`EncoderData`] with SI units at the motor. A linear motor is kept in
//! the same fields: its radian is a metre, so that N·m read N, kg·m² kg and rad/s m/s, and the transmission is 1000 mm per "radian".

use super::checked::{EncoderData, MechanicsData, MotorData};
use super::drive_options::small_lu;
use super::error_table::{ErrorTable, TableNames, error_table};
use super::keys::MotorKind;
use super::section::Section;
use crate::base::AxisKind;
use crate::base::diagnostics::Diagnostic;
use crate::base::units::{MM_PER_M, RAD_PER_REV, h_from_mh, m_from_um};

/// What is between motor and load.
pub(super) struct Mechanics {
    pub data: MechanicsData,
    pub pitch_error: Option<ErrorTable>,
}

const PITCH_ERROR: TableNames = TableNames {
    values: ["pitch_error_um", "pitch_error_deg"],
    start: ["pitch_error_start_mm", "pitch_error_start_deg"],
    step: ["pitch_error_step_mm", "pitch_error_step_deg"],
    periodic: "pitch_error_periodic",
};
const COMPENSATION: TableNames = TableNames {
    values: ["compensation_um", "compensation_deg"],
    start: ["compensation_start_mm", "compensation_start_deg"],
    step: ["compensation_step_mm", "compensation_step_deg"],
    periodic: "compensation_periodic",
};

/// The key for this kind of motor.
pub(super) fn by_motor(section: &Section<'_>, rotary: &'static str, linear: &'static str) -> &'static str {
    match section.motor() {
        MotorKind::Rotary => rotary,
        MotorKind::Linear => linear,
    }
}

/// What `motor.kind` says, before any table is read; anything but a linear motor of a linear axis counts as rotary.
pub(super) fn motor_kind(axis: &Section<'_>) -> MotorKind {
    let linear = axis
        .entry("motor")
        .and_then(|entry| entry.node.at(&["kind"]))
        .is_some_and(|node| matches!(&node.value, super::document::Value::Text(word) if word == "linear"));
    if linear && axis.kind() != Some(AxisKind::Rotary) { MotorKind::Linear } else { MotorKind::Rotary }
}

pub(super) fn motor(axis: &Section<'_>) -> MotorData {
    let motor = axis.table_reported_if_missing("motor", "axes.*.motor");
    let kind: MotorKind = motor.choice("kind");
    if kind != motor.motor() {
        let message = format!("{} = \"linear\" on a rotary axis", motor.full("kind"));
        let help = "a torque motor is a rotary motor with gear_ratio = 1";
        motor.report_at("kind", "", Diagnostic::error("M0008", message).help(help));
    }
    MotorData {
        resistance_ohm: motor.number("resistance_ohm"),
        inductance_h: h_from_mh(motor.number("inductance_mh")),
        back_emf_v_s_per_rad: motor.number(by_motor(&motor, "back_emf_v_s_per_rad", "back_emf_v_s_per_m")),
        torque_constant_n_m_per_a: motor.number(by_motor(
            &motor,
            "torque_constant_n_m_per_a",
            "force_constant_n_per_a",
        )),
    }
}

pub(super) fn mechanics(axis: &Section<'_>) -> Mechanics {
    let mechanics = axis.table_reported_if_missing("mechanics", "axes.*.mechanics");
    let [coulomb, breakaway] = match mechanics.motor() {
        MotorKind::Rotary => ["coulomb_friction_n_m", "breakaway_friction_n_m"],
        MotorKind::Linear => ["coulomb_friction_n", "breakaway_friction_n"],
    };
    let coulomb_friction_n_m = mechanics.number(coulomb);
    let breakaway_friction_n_m = mechanics.optional_number(breakaway).unwrap_or(coulomb_friction_n_m);
    if breakaway_friction_n_m < coulomb_friction_n_m {
        let unit = by_motor(&mechanics, "N·m", "N");
        let message = format!(
            "{} = {breakaway_friction_n_m} {unit} is less than {coulomb} = {coulomb_friction_n_m} {unit}",
            mechanics.full(breakaway)
        );
        let help = "friction at rest is at least that in motion; without the key it is the same";
        mechanics.report_at(breakaway, "", Diagnostic::error("M0008", message).help(help));
    }
    let (gravity_sin_n_m, gravity_cos_n_m) = turning_gravity(&mechanics);
    let inertia_kg_m2 = mechanics.number(by_motor(&mechanics, "inertia_kg_m2", "mass_kg"));
    let (load_inertia_kg_m2, coupling_stiffness_n_m_per_rad) = second_mass(&mechanics, inertia_kg_m2);
    let data = MechanicsData {
        transmission_lu_per_rad: transmission(&mechanics),
        inertia_kg_m2,
        viscous_friction_n_m_s_per_rad: mechanics.number(by_motor(
            &mechanics,
            "viscous_friction_n_m_s_per_rad",
            "viscous_friction_n_s_per_m",
        )),
        coulomb_friction_n_m,
        breakaway_friction_n_m,
        gravity_n_m: mechanics.number(by_motor(&mechanics, "gravity_n_m", "gravity_n")),
        gravity_sin_n_m,
        gravity_cos_n_m,
        backlash_lu: small_lu(&mechanics, "backlash_um", "backlash_deg"),
        load_inertia_kg_m2,
        coupling_stiffness_n_m_per_rad,
        coupling_damping_n_m_s_per_rad: mechanics.number(by_motor(
            &mechanics,
            "coupling_damping_n_m_s_per_rad",
            "coupling_damping_n_s_per_m",
        )),
    };
    Mechanics { data, pitch_error: error_table(&mechanics, &PITCH_ERROR) }
}

/// gs and gc: not on a linear axis.
fn turning_gravity(mechanics: &Section<'_>) -> (f64, f64) {
    if mechanics.motor() == MotorKind::Linear {
        return (0.0, 0.0);
    }
    for key in ["gravity_sin_n_m", "gravity_cos_n_m"] {
        if mechanics.kind() != Some(AxisKind::Rotary) && mechanics.number(key).abs() > 0.0 {
            let message = format!("{} turns with the axis angle, and a linear axis has none", mechanics.full(key));
            mechanics.report_at(key, "", Diagnostic::error("M0008", message).help("use gravity_n_m"));
        }
    }
    (mechanics.number("gravity_sin_n_m"), mechanics.number("gravity_cos_n_m"))
}

/// Jl and c: a part of the inertia, behind a spring.
fn second_mass(mechanics: &Section<'_>, inertia_kg_m2: f64) -> (f64, f64) {
    let (load, stiffness, whole) = match mechanics.motor() {
        MotorKind::Rotary => ("load_inertia_kg_m2", "coupling_stiffness_n_m_per_rad", "inertia_kg_m2"),
        MotorKind::Linear => ("load_mass_kg", "coupling_stiffness_n_per_um", "mass_kg"),
    };
    let load_inertia_kg_m2 = mechanics.number(load);
    let given = mechanics.optional_number(stiffness);
    if load_inertia_kg_m2 >= inertia_kg_m2 {
        let message = format!(
            "{} = {load_inertia_kg_m2} is not less than {whole} = {inertia_kg_m2}, which is motor and load together",
            mechanics.full(load)
        );
        let help = format!("{whole} stays everything; {load} is the part of it behind the spring");
        mechanics.report_at(load, "", Diagnostic::error("M0008", message).help(help));
    }
    if load_inertia_kg_m2 > 0.0 && given.is_none() && !mechanics.has(stiffness) {
        mechanics.missing(stiffness, &format!("add {stiffness} = ..., or remove {load} for a rigid axis"));
    }
    let given = given.unwrap_or(f64::INFINITY);
    (load_inertia_kg_m2, if mechanics.motor() == MotorKind::Linear { given / m_from_um(1.0) } else { given })
}

/// r = pitch / (2π) / gear ratio, pinion diameter / 2 / gear ratio, or 1 / gear ratio (models/drive.md section 2, in rad instead of
/// deg); 1000 mm per metre of a linear motor.
fn transmission(mechanics: &Section<'_>) -> f64 {
    if mechanics.motor() == MotorKind::Linear {
        return MM_PER_M;
    }
    let gear_ratio = mechanics.optional_number("gear_ratio");
    if mechanics.kind() == Some(AxisKind::Rotary) {
        if !mechanics.has("gear_ratio") && !mechanics.has("pitch_mm") {
            let help =
                "add gear_ratio = ..., motor turns per turn of the axis (1: torque motor); it may be negative, not 0";
            mechanics.missing("gear_ratio", help);
        }
        return 1.0 / gear_ratio.unwrap_or(f64::NAN);
    }
    let (pitch_mm, pinion_mm) =
        (mechanics.optional_number("pitch_mm"), mechanics.optional_number("pinion_diameter_mm"));
    if mechanics.has("pitch_mm") && mechanics.has("pinion_diameter_mm") {
        let message = format!("{} and pitch_mm exclude each other", mechanics.full("pinion_diameter_mm"));
        let help = "pitch_mm is for a screw, pinion_diameter_mm for rack and pinion";
        mechanics.report_at("pinion_diameter_mm", "", Diagnostic::error("M0008", message).help(help));
    } else if !mechanics.has("pitch_mm") && !mechanics.has("pinion_diameter_mm") {
        let help = "add pitch_mm = ... for a screw or pinion_diameter_mm = ... for rack and pinion";
        mechanics.missing("pitch_mm", help);
    }
    let per_rad_mm = pitch_mm.map(|pitch_mm| pitch_mm / RAD_PER_REV).or(pinion_mm.map(|diameter_mm| 0.5 * diameter_mm));
    per_rad_mm.unwrap_or(f64::NAN) / gear_ratio.unwrap_or(1.0)
}

pub(super) fn encoder(axis: &Section<'_>) -> (EncoderData, Option<ErrorTable>) {
    let encoder = axis.table("encoder", "axes.*.encoder");
    let data = EncoderData {
        position_resolution_lu: small_lu(&encoder, "position_resolution_um", "position_resolution_deg"),
        // The radian of a linear motor is a metre.
        motor_resolution_rad: match encoder.motor() {
            MotorKind::Rotary => encoder.number("motor_resolution_rad"),
            MotorKind::Linear => m_from_um(encoder.number("motor_resolution_um")),
        },
        position_source: encoder.choice("position_source"),
    };
    (data, error_table(&encoder, &COMPENSATION))
}
