//! Every key of `[axes.*.motor]`, `mechanics` and `encoder`: name, unit, range, default, machine data, meaning.
//!
//! In: nothing. Out: the rows that `catalogue` lists. Symbols in brackets are those of models/drive.md section 2. A key of a rotary
//! motor (N·m, kg·m², rad) has one of a linear motor (N, kg, m) beside it.

use super::choices::words;
use super::drive_options::PositionSource;
use super::keys::{Absent, Accepts, Key, MotorKind, Range};
use Absent::{Means, No, Number as Value, Required, Word};
use Accepts::{Choice, Flag, Number, Values};

const POSITIVE: Accepts = Number(Range::Positive);
const NOT_NEGATIVE: Accepts = Number(Range::NotNegative);
const ANY: Accepts = Number(Range::Any);
/// MD38000 allows 5000 points.
const POINTS: Accepts = Values(5000);

pub(super) const MOTOR: &[Key] = &[
    Key::new(
        "kind",
        "",
        Choice(words::<MotorKind>),
        Word("rotary"),
        "rotary: screw, rack, gear or torque motor; linear: the motor is the axis, in N, kg and m",
    )
    .md("p0300"),
    Key::new("resistance_ohm", "ohm", POSITIVE, Required, "[R] phase resistance").md("p0350"),
    Key::new("inductance_mh", "mH", POSITIVE, Required, "[L] rotating-field inductance").md("p0356"),
    Key::new("back_emf_v_s_per_rad", "V·s/rad", NOT_NEGATIVE, Required, "[Ke] back-EMF per phase rms, about Kt / 3")
        .turning("back_emf_v_s_per_m")
        .md("p0317"),
    Key::new("back_emf_v_s_per_m", "V·s/m", NOT_NEGATIVE, Required, "[Ke] back-EMF per phase rms, about Kt / 3")
        .pushing("back_emf_v_s_per_rad")
        .md("p0317"),
    Key::new("torque_constant_n_m_per_a", "N·m/A", POSITIVE, Required, "[Kt] torque per A rms")
        .turning("force_constant_n_per_a")
        .md("p0316"),
    Key::new("force_constant_n_per_a", "N/A", POSITIVE, Required, "[Kt] force per A rms")
        .pushing("torque_constant_n_m_per_a")
        .md("p0316"),
];

pub(super) const MECHANICS: &[Key] = &[
    Key::new(
        "pitch_mm",
        "mm",
        Number(Range::NotZero),
        Means("pinion_diameter_mm is given, or it is an error"),
        "load motion per turn of the screw; may be negative",
    )
    .linear("gear_ratio")
    .turning("")
    .md("MD31030"),
    Key::new(
        "pinion_diameter_mm",
        "mm",
        Number(Range::NotZero),
        Means("pitch_mm is given"),
        "rack and pinion: pitch circle of the pinion, instead of a screw; may be negative",
    )
    .linear("gear_ratio")
    .turning("")
    .md("MD31030 = pi times it"),
    Key::new(
        "gear_ratio",
        "",
        Number(Range::NotZero),
        Means("1; required on a rotary axis"),
        "motor turns per turn of the screw, of the pinion or of the rotary axis (1: torque motor); may be negative",
    )
    .turning("")
    .md("MD31060 / MD31050"),
    Key::new("inertia_kg_m2", "kg·m²", POSITIVE, Required, "[J] everything, at the motor shaft")
        .turning("mass_kg")
        .md("p0341 * p0342 + p1498"),
    Key::new("mass_kg", "kg", POSITIVE, Required, "[J] everything that moves")
        .pushing("inertia_kg_m2")
        .md("p0341 + p1498"),
    Key::new(
        "viscous_friction_n_m_s_per_rad",
        "N·m·s/rad",
        NOT_NEGATIVE,
        Required,
        "[B] viscous friction, at the motor shaft",
    )
    .turning("viscous_friction_n_s_per_m"),
    Key::new("viscous_friction_n_s_per_m", "N·s/m", NOT_NEGATIVE, Required, "[B] viscous friction")
        .pushing("viscous_friction_n_m_s_per_rad"),
    Key::new("coulomb_friction_n_m", "N·m", NOT_NEGATIVE, Required, "[Tc] dry friction in motion, at the motor shaft")
        .turning("coulomb_friction_n"),
    Key::new("coulomb_friction_n", "N", NOT_NEGATIVE, Required, "[Tc] dry friction in motion")
        .pushing("coulomb_friction_n_m"),
    Key::new(
        "breakaway_friction_n_m",
        "N·m",
        NOT_NEGATIVE,
        Means("coulomb_friction_n_m"),
        "[Ts] dry friction at rest, at least coulomb_friction_n_m",
    )
    .turning("breakaway_friction_n"),
    Key::new(
        "breakaway_friction_n",
        "N",
        NOT_NEGATIVE,
        Means("coulomb_friction_n"),
        "[Ts] dry friction at rest, at least coulomb_friction_n",
    )
    .pushing("breakaway_friction_n_m"),
    Key::new("gravity_n_m", "N·m", ANY, Value(0.0), "[g0] constant load torque at the motor: a vertical axis")
        .turning("gravity_n"),
    Key::new("gravity_n", "N", ANY, Value(0.0), "[g0] constant load: a vertical axis").pushing("gravity_n_m"),
    Key::new(
        "gravity_sin_n_m",
        "N·m",
        ANY,
        Value(0.0),
        "[gs] load torque with the sine of the axis angle: a tilting table",
    )
    .turning(""),
    Key::new(
        "gravity_cos_n_m",
        "N·m",
        ANY,
        Value(0.0),
        "[gc] load torque with the cosine of the axis angle: a tilting table",
    )
    .turning(""),
    Key::new(
        "load_inertia_kg_m2",
        "kg·m²",
        NOT_NEGATIVE,
        Value(0.0),
        "second mass: share of inertia_kg_m2 behind a spring, at the motor shaft; 0 = a rigid axis",
    )
    .turning("load_mass_kg"),
    Key::new(
        "load_mass_kg",
        "kg",
        NOT_NEGATIVE,
        Value(0.0),
        "second mass: share of mass_kg behind a spring; 0 = rigid",
    )
    .pushing("load_inertia_kg_m2"),
    Key::new(
        "coupling_stiffness_n_m_per_rad",
        "N·m/rad",
        POSITIVE,
        Means("no second mass"),
        "second mass: stiffness between motor and load, at the motor shaft",
    )
    .turning("coupling_stiffness_n_per_um"),
    Key::new(
        "coupling_stiffness_n_per_um",
        "N/µm",
        POSITIVE,
        Means("no second mass"),
        "second mass: stiffness between motor and load",
    )
    .pushing("coupling_stiffness_n_m_per_rad"),
    Key::new(
        "coupling_damping_n_m_s_per_rad",
        "N·m·s/rad",
        NOT_NEGATIVE,
        Value(0.0),
        "second mass: damping between motor and load, at the motor shaft",
    )
    .turning("coupling_damping_n_s_per_m"),
    Key::new(
        "coupling_damping_n_s_per_m",
        "N·s/m",
        NOT_NEGATIVE,
        Value(0.0),
        "second mass: damping between motor and load",
    )
    .pushing("coupling_damping_n_m_s_per_rad"),
    Key::new("backlash_um", "µm", NOT_NEGATIVE, Value(0.0), "play between motor and load, 0 = none")
        .linear("backlash_deg"),
    Key::new("backlash_deg", "deg", NOT_NEGATIVE, Value(0.0), "play between motor and load, 0 = none")
        .rotary("backlash_um"),
    Key::new(
        "pitch_error_um",
        "µm",
        POINTS,
        Means("none"),
        "error of the screw at equidistant points: how much further the load is than pitch and motor angle say",
    )
    .linear("pitch_error_deg"),
    Key::new("pitch_error_start_mm", "mm", ANY, Value(0.0), "position of the first point of the error of the screw")
        .linear("pitch_error_start_deg"),
    Key::new("pitch_error_step_mm", "mm", POSITIVE, Means("needed with pitch_error_um"), "distance of its points")
        .linear("pitch_error_step_deg"),
    Key::new(
        "pitch_error_deg",
        "deg",
        POINTS,
        Means("none"),
        "error of the gear at equidistant points: how much further the load is than gear ratio and motor angle say",
    )
    .rotary("pitch_error_um"),
    Key::new("pitch_error_start_deg", "deg", ANY, Value(0.0), "position of the first point of the error of the gear")
        .rotary("pitch_error_start_mm"),
    Key::new("pitch_error_step_deg", "deg", POSITIVE, Means("needed with pitch_error_deg"), "distance of its points")
        .rotary("pitch_error_step_mm"),
    Key::new(
        "pitch_error_periodic",
        "",
        Flag,
        No,
        "the error repeats: its last point is the first again; else the ends hold outside",
    ),
];

pub(super) const ENCODER: &[Key] = &[
    Key::new(
        "position_resolution_um",
        "µm",
        NOT_NEGATIVE,
        Value(0.0),
        "[q_pos] quantum of the position scale, 0 = ideal",
    )
    .linear("position_resolution_deg")
    .md("MD31010"),
    Key::new(
        "position_resolution_deg",
        "deg",
        NOT_NEGATIVE,
        Value(0.0),
        "[q_pos] quantum of the position scale, 0 = ideal",
    )
    .rotary("position_resolution_um")
    .md("MD31010"),
    Key::new(
        "motor_resolution_rad",
        "rad",
        NOT_NEGATIVE,
        Value(0.0),
        "[q_mot] quantum of the motor encoder, 0 = ideal",
    )
    .turning("motor_resolution_um")
    .md("p0408"),
    Key::new(
        "motor_resolution_um",
        "µm",
        NOT_NEGATIVE,
        Value(0.0),
        "[q_mot] quantum of the scale that the drive takes the speed from, 0 = ideal",
    )
    .pushing("motor_resolution_rad")
    .md("p0407"),
    Key::new(
        "position_source",
        "",
        Choice(words::<PositionSource>),
        Word("load"),
        "where the position is measured: load = scale, motor = motor encoder",
    )
    .md("MD31040"),
    Key::new(
        "compensation_um",
        "µm",
        POINTS,
        Means("MD32700 = 0: off"),
        "leadscrew error compensation: added to the measured position at equidistant points, linear in between",
    )
    .linear("compensation_deg")
    .md("MD32700, MD38000, $AA_ENC_COMP"),
    Key::new("compensation_start_mm", "mm", ANY, Value(0.0), "position of its first point")
        .linear("compensation_start_deg")
        .md("$AA_ENC_COMP_MIN"),
    Key::new("compensation_step_mm", "mm", POSITIVE, Means("needed with compensation_um"), "distance of its points")
        .linear("compensation_step_deg")
        .md("$AA_ENC_COMP_STEP"),
    Key::new(
        "compensation_deg",
        "deg",
        POINTS,
        Means("MD32700 = 0: off"),
        "leadscrew error compensation: added to the measured position at equidistant points, linear in between",
    )
    .rotary("compensation_um")
    .md("MD32700, MD38000, $AA_ENC_COMP"),
    Key::new("compensation_start_deg", "deg", ANY, Value(0.0), "position of its first point")
        .rotary("compensation_start_mm")
        .md("$AA_ENC_COMP_MIN"),
    Key::new("compensation_step_deg", "deg", POSITIVE, Means("needed with compensation_deg"), "distance of its points")
        .rotary("compensation_step_mm")
        .md("$AA_ENC_COMP_STEP"),
    Key::new(
        "compensation_periodic",
        "",
        Flag,
        No,
        "the compensation repeats: its last point is the first again; else the ends hold outside",
    )
    .md("$AA_ENC_COMP_IS_MODULO"),
];
