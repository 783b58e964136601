//! Every key of `[axes.*]` and the tables inside it: name, unit, range, default, machine data, meaning.
//!
//! In: nothing. Out: the rows that `catalogue` lists. Symbols in brackets are those of models/drive.md section 2.

use super::choices::words;
use super::keys::{Absent, Accepts, Key, Range};
use crate::base::AxisKind;
use Absent::{Means, No, Number as Value, Required, Word};
use Accepts::{Choice, Flag, Interval, Number, Text, Whole};

const POSITIVE: Accepts = Number(Range::Positive);
/// Delays in ms: a second is far beyond any control, and a delay line takes memory for every cycle of it.
const DELAY: Accepts = Number(Range::Within(0.0, 1000.0));
/// Cycles of the inner loops in µs: below one no drive works, and a run would take for ever.
const LOOP_CYCLE: Accepts = Number(Range::Within(1.0, 1e6));
const NOT_NEGATIVE: Accepts = Number(Range::NotNegative);
const OR_INFINITE: Accepts = Number(Range::PositiveOrInfinite);
const ANY: Accepts = Number(Range::Any);

/// Most machine axes of a control (SINUMERIK 840D: 31).
const AXIS_INDEX_MAX: u32 = 31;

pub(super) const AXIS: &[Key] = &[
    Key::new("machine_axis", "", Text, Means("none"), "name of the machine axis in machine data and trace signals"),
    Key::new(
        "index",
        "",
        Whole(1, AXIS_INDEX_MAX),
        Means("place in the file"),
        "number of the machine axis; the axes are ordered by it",
    ),
    Key::new("kind", "", Choice(words::<AxisKind>), Word("linear"), "linear or rotary: decides the units of the axis")
        .md("MD30300"),
    Key::new("velocity_max_m_min", "m/min", POSITIVE, Required, "velocity limit")
        .linear("velocity_max_rpm")
        .md("MD32000"),
    Key::new("acceleration_max_m_s2", "m/s²", POSITIVE, Required, "acceleration limit")
        .linear("acceleration_max_rot_s2")
        .md("MD32300"),
    Key::new("jerk_max_m_s3", "m/s³", POSITIVE, Required, "jerk limit").linear("jerk_max_rot_s3").md("MD32431"),
    Key::new("transition_jerk_max_m_s3", "m/s³", POSITIVE, Means("the axis jerk"), "jerk limit inside a blend")
        .linear("transition_jerk_max_rot_s3")
        .md("MD32432"),
    Key::new("velocity_max_rpm", "rpm", POSITIVE, Required, "velocity limit")
        .rotary("velocity_max_m_min")
        .md("MD32000"),
    Key::new("acceleration_max_rot_s2", "rot/s²", POSITIVE, Required, "acceleration limit")
        .rotary("acceleration_max_m_s2")
        .md("MD32300"),
    Key::new("jerk_max_rot_s3", "rot/s³", POSITIVE, Required, "jerk limit").rotary("jerk_max_m_s3").md("MD32431"),
    Key::new("transition_jerk_max_rot_s3", "rot/s³", POSITIVE, Means("the axis jerk"), "jerk limit inside a blend")
        .rotary("transition_jerk_max_m_s3")
        .md("MD32432"),
    Key::new("follow_up_tolerance_mm", "mm", POSITIVE, Value(0.01), "e of the corner rule sqrt(8 A e)")
        .linear("follow_up_tolerance_deg"),
    Key::new("follow_up_tolerance_deg", "deg", POSITIVE, Value(0.01), "e of the corner rule sqrt(8 A e)")
        .rotary("follow_up_tolerance_mm"),
    Key::new("travel_mm", "mm", Interval, Means("no limit"), "software limits")
        .linear("travel_deg")
        .md("MD36110, MD36100"),
    Key::new("travel_deg", "deg", Interval, Means("no limit"), "software limits")
        .rotary("travel_mm")
        .md("MD36110, MD36100"),
    Key::new("home_mm", "mm", ANY, Value(0.0), "where the axis stands at program start").linear("home_deg"),
    Key::new("home_deg", "deg", ANY, Value(0.0), "where the axis stands at program start").rotary("home_mm"),
    Key::new(
        "acceleration_reduction_velocity_ratio",
        "",
        Number(Range::UpTo(0.0, 1.0)),
        Value(1.0),
        "DRIVE: share of the velocity limit above which the acceleration is lower",
    )
    .md("MD35220"),
    Key::new(
        "acceleration_reduction_ratio",
        "",
        Number(Range::Within(0.0, 0.95)),
        Value(0.0),
        "DRIVE: share of the acceleration that is taken off there",
    )
    .md("MD35230"),
    Key::new("modulo", "", Flag, No, "endless rotary axis, without travel").rotary("").md("MD30310"),
];

pub(super) const DYNAMICS: &[Key] = &[
    Key::new("velocity_max_m_min", "m/min", POSITIVE, Means("that of the axis"), "velocity limit")
        .linear("velocity_max_rpm")
        .md("MD32000"),
    Key::new("acceleration_max_m_s2", "m/s²", POSITIVE, Means("that of the axis"), "acceleration limit")
        .linear("acceleration_max_rot_s2")
        .md("MD32300"),
    Key::new("jerk_max_m_s3", "m/s³", POSITIVE, Means("that of the axis"), "jerk limit")
        .linear("jerk_max_rot_s3")
        .md("MD32431"),
    Key::new("transition_jerk_max_m_s3", "m/s³", POSITIVE, Means("that of the axis"), "jerk limit inside a blend")
        .linear("transition_jerk_max_rot_s3")
        .md("MD32432"),
    Key::new("velocity_max_rpm", "rpm", POSITIVE, Means("that of the axis"), "velocity limit")
        .rotary("velocity_max_m_min")
        .md("MD32000"),
    Key::new("acceleration_max_rot_s2", "rot/s²", POSITIVE, Means("that of the axis"), "acceleration limit")
        .rotary("acceleration_max_m_s2")
        .md("MD32300"),
    Key::new("jerk_max_rot_s3", "rot/s³", POSITIVE, Means("that of the axis"), "jerk limit")
        .rotary("jerk_max_m_s3")
        .md("MD32431"),
    Key::new("transition_jerk_max_rot_s3", "rot/s³", POSITIVE, Means("that of the axis"), "jerk limit inside a blend")
        .rotary("transition_jerk_max_m_s3")
        .md("MD32432"),
];

pub(super) const DRIVE: &[Key] = &[
    Key::new("identified", "", Flag, No, "false: representative values, and every figure that depends on them says so"),
    Key::new("in_position_coarse_um", "µm", POSITIVE, Value(40.0), "exact-stop window, coarse")
        .linear("in_position_coarse_deg")
        .md("MD36000"),
    Key::new("in_position_fine_um", "µm", POSITIVE, Value(10.0), "exact-stop window, fine")
        .linear("in_position_fine_deg")
        .md("MD36010"),
    Key::new("in_position_coarse_deg", "deg", POSITIVE, Value(0.04), "exact-stop window, coarse")
        .rotary("in_position_coarse_um")
        .md("MD36000"),
    Key::new("in_position_fine_deg", "deg", POSITIVE, Value(0.01), "exact-stop window, fine")
        .rotary("in_position_fine_um")
        .md("MD36010"),
    Key::new("position_cycle_ms", "ms", POSITIVE, Required, "[T_p] t_s is a whole multiple of it").md("MD10061"),
    Key::new("speed_cycle_us", "µs", LOOP_CYCLE, Required, "[T_v] the position cycle is a whole multiple of it")
        .md("p0115[1], MD1001"),
    Key::new("current_cycle_us", "µs", LOOP_CYCLE, Required, "[T_i] the speed cycle is a whole multiple of it")
        .md("p0115[0], MD1000"),
    Key::new("position_gain_per_s", "1/s", POSITIVE, Required, "[Kv] 1 (m/min)/mm = 16.667 1/s").md("MD32200"),
    Key::new(
        "velocity_feedforward",
        "",
        NOT_NEGATIVE,
        Value(1.0),
        "[kvff] weight of the velocity feed-forward, 0 = off",
    )
    .md("MD32610"),
    Key::new("torque_feedforward", "", NOT_NEGATIVE, Value(0.0), "[ktff] weight of the torque feed-forward, 0 = off"),
    Key::new(
        "feedforward_inertia_kg_m2",
        "kg·m²",
        NOT_NEGATIVE,
        Means("mechanics.inertia_kg_m2"),
        "[J_ff] inertia that the torque feed-forward works with",
    )
    .md("MD32650"),
    Key::new("setpoint_delay_ms", "ms", DELAY, Value(0.0), "[d_pos] balancing delay of the position set-point")
        .md("MD32810, MD32800"),
    Key::new("feedforward_delay_ms", "ms", DELAY, Value(0.0), "[d_ff] delay of both feed-forward signals"),
    Key::new("speed_setpoint_max_mm_s", "mm/s", OR_INFINITE, Means("inf"), "[v_max] clamp of the speed set-point")
        .linear("speed_setpoint_max_deg_s")
        .md("MD36210, p1082"),
    Key::new("speed_setpoint_max_deg_s", "deg/s", OR_INFINITE, Means("inf"), "[v_max] clamp of the speed set-point")
        .rotary("speed_setpoint_max_mm_s")
        .md("MD36210, p1082"),
    Key::new("speed_gain_n_m_s_per_rad", "N·m·s/rad", POSITIVE, Required, "[Kp] gain of the speed controller")
        .md("p1460, MD1407"),
    Key::new(
        "speed_reset_time_ms",
        "ms",
        OR_INFINITE,
        Required,
        "[Tn] reset time of the speed controller; inf = no integral part",
    )
    .md("p1462, MD1409"),
    Key::new("current_gain_v_per_a", "V/A", POSITIVE, Required, "[Kpi] gain of the current controller")
        .md("p1715, MD1120"),
    Key::new(
        "current_reset_time_ms",
        "ms",
        OR_INFINITE,
        Required,
        "[Tni] reset time of the current controller; inf = no integral part",
    )
    .md("p1717, MD1121"),
    Key::new("current_max_a", "A", OR_INFINITE, Required, "[i_max] current limit; the torque limit is Kt times it")
        .md("p0640"),
    Key::new("voltage_max_v", "V", OR_INFINITE, Required, "[u_max] voltage limit, phase rms: about U_dc / sqrt 6"),
];

pub(super) const MOTOR: &[Key] = &[
    Key::new("resistance_ohm", "ohm", POSITIVE, Required, "[R] phase resistance").md("p0350"),
    Key::new("inductance_mh", "mH", POSITIVE, Required, "[L] rotating-field inductance").md("p0356"),
    Key::new("back_emf_v_s_per_rad", "V·s/rad", NOT_NEGATIVE, Required, "[Ke] back-EMF per phase rms, about Kt / 3")
        .md("p0317"),
    Key::new("torque_constant_n_m_per_a", "N·m/A", POSITIVE, Required, "[Kt] torque per A rms").md("p0316"),
];

pub(super) const MECHANICS: &[Key] = &[
    Key::new("pitch_mm", "mm", Number(Range::NotZero), Required, "load motion per turn of the screw; may be negative")
        .linear("gear_ratio")
        .md("MD31030"),
    Key::new(
        "gear_ratio",
        "",
        Number(Range::NotZero),
        Means("1; required on a rotary axis"),
        "motor turns per turn of the screw or of the rotary axis; may be negative",
    )
    .md("MD31060 / MD31050"),
    Key::new("inertia_kg_m2", "kg·m²", POSITIVE, Required, "[J] everything, at the motor shaft")
        .md("p0341 * p0342 + p1498"),
    Key::new(
        "viscous_friction_n_m_s_per_rad",
        "N·m·s/rad",
        NOT_NEGATIVE,
        Required,
        "[B] viscous friction, at the motor shaft",
    ),
    Key::new("coulomb_friction_n_m", "N·m", NOT_NEGATIVE, Required, "[Tc] dry friction in motion, at the motor shaft"),
    Key::new(
        "breakaway_friction_n_m",
        "N·m",
        NOT_NEGATIVE,
        Means("coulomb_friction_n_m"),
        "[Ts] dry friction at rest, at least coulomb_friction_n_m",
    ),
    Key::new("gravity_n_m", "N·m", ANY, Value(0.0), "[g0] constant load torque at the motor: a vertical axis"),
    Key::new(
        "gravity_sin_n_m",
        "N·m",
        ANY,
        Value(0.0),
        "[gs] load torque with the sine of the axis angle: a tilting table",
    ),
    Key::new(
        "gravity_cos_n_m",
        "N·m",
        ANY,
        Value(0.0),
        "[gc] load torque with the cosine of the axis angle: a tilting table",
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
    .md("p0408"),
];
