//! Every key of `[axes.*.drive]`: name, unit, range, default, machine data, meaning.
//!
//! In: nothing. Out: the rows that `catalogue` lists. Symbols in brackets are those of models/drive.md section 2.

use super::choices::words;
use super::drive_options::{Balancing, FilterShape, JerkFilterKind};
use super::keys::{Absent, Accepts, Key, Range};
use Absent::{Means, No, Number as Value, Required, Word};
use Accepts::{Choice, Flag, Number, Whole};

const POSITIVE: Accepts = Number(Range::Positive);
/// Delays in ms: a second is far beyond any control, and a delay line takes memory for every cycle of it.
const DELAY: Accepts = Number(Range::Within(0.0, 1000.0));
/// Times of filters in ms.
const FILTER_TIME: Accepts = Number(Range::UpTo(0.0, 1000.0));
/// Cycles of the inner loops in µs: below one no drive works, and a run would take for ever.
const LOOP_CYCLE: Accepts = Number(Range::Within(1.0, 1e6));
const NOT_NEGATIVE: Accepts = Number(Range::NotNegative);
const OR_INFINITE: Accepts = Number(Range::PositiveOrInfinite);
const ANY: Accepts = Number(Range::Any);
const DAMPING: Accepts = Number(Range::UpTo(0.0, 10.0));
const NUMERATOR_DAMPING: Accepts = Number(Range::Within(0.0, 10.0));
/// As p1520 allows it to be 0: no torque in that direction.
const UPPER: Accepts = Number(Range::Within(0.0, 1e12));
const LOWER: Accepts = Number(Range::Within(-1e12, 0.0));

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
    Key::new(
        "positioning_time_ms",
        "ms",
        OR_INFINITE,
        Value(1000.0),
        "time from the end of a motion to exact stop fine; inf = an hour, behind which nothing is waited for",
    )
    .md("MD36020"),
    Key::new("standstill_um", "µm", OR_INFINITE, Value(200.0), "deviation allowed at standstill; inf = not monitored")
        .linear("standstill_deg")
        .md("MD36030"),
    Key::new("standstill_deg", "deg", OR_INFINITE, Value(0.2), "deviation allowed at standstill; inf = not monitored")
        .rotary("standstill_um")
        .md("MD36030"),
    Key::new(
        "standstill_delay_ms",
        "ms",
        NOT_NEGATIVE,
        Value(400.0),
        "time from the end of a motion to standstill monitoring",
    )
    .md("MD36040"),
    Key::new(
        "contour_monitoring_um",
        "µm",
        OR_INFINITE,
        Value(1000.0),
        "contour monitoring: deviation allowed between axis and its model; inf = not monitored",
    )
    .linear("contour_monitoring_deg")
    .md("MD36400"),
    Key::new(
        "contour_monitoring_deg",
        "deg",
        OR_INFINITE,
        Value(1.0),
        "contour monitoring: deviation allowed between axis and its model; inf = not monitored",
    )
    .rotary("contour_monitoring_um")
    .md("MD36400"),
    Key::new(
        "speed_limit_time_ms",
        "ms",
        NOT_NEGATIVE,
        Means("not monitored"),
        "how long the speed set-point may be at speed_setpoint_max",
    )
    .md("MD36220"),
    Key::new("clamping_um", "µm", OR_INFINITE, Value(500.0), "deviation allowed while the axis is clamped; inf = not monitored")
        .linear("clamping_deg")
        .md("MD36050"),
    Key::new("clamping_deg", "deg", OR_INFINITE, Value(0.5), "deviation allowed while the axis is clamped; inf = not monitored")
        .rotary("clamping_um")
        .md("MD36050"),
    Key::new("clamp_m_function", "", Whole(0, 99_999_999), Means("never clamped"), "M function that clamps the axis"),
    Key::new("release_m_function", "", Whole(0, 99_999_999), Means("never clamped"), "M function that releases it"),
    Key::new(
        "emergency_stop_time_ms",
        "ms",
        FILTER_TIME,
        Value(50.0),
        "time in which an alarm brings the speed set-point to 0",
    )
    .md("MD36610"),
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
    .turning("feedforward_mass_kg")
    .md("MD32650"),
    Key::new(
        "feedforward_mass_kg",
        "kg",
        NOT_NEGATIVE,
        Means("mechanics.mass_kg"),
        "[J_ff] mass that the torque feed-forward works with",
    )
    .pushing("feedforward_inertia_kg_m2")
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
        .turning("speed_gain_n_s_per_m")
        .md("p1460, MD1407"),
    Key::new("speed_gain_n_s_per_m", "N·s/m", POSITIVE, Required, "[Kp] gain of the speed controller")
        .pushing("speed_gain_n_m_s_per_rad")
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
    Key::new(
        "feedforward_balancing",
        "",
        Choice(words::<Balancing>),
        Word("dead_time"),
        "how the set-point waits for setpoint_delay_ms: dead_time is FFW_MODE 3 and 4, pt1 is 1 and 2",
    )
    .md("MD32620"),
    Key::new("stiffness_control", "", Flag, No, "DSC: the position controller works in the speed cycle").md("MD32640"),
    Key::new("jerk_filter", "", Choice(words::<JerkFilterKind>), Word("off"), "filter of the position set-point")
        .md("MD32400, MD32402"),
    Key::new("jerk_filter_time_ms", "ms", FILTER_TIME, Value(1.0), "time of an average, delay of the second order, length of the FIR low-pass")
        .md("MD32410"),
    Key::new("jerk_filter_time_add_ms", "ms", FILTER_TIME, Value(1.0), "time of the second average").md("MD32411"),
    Key::new("jerk_filter_frequency_hz", "Hz", POSITIVE, Value(10.0), "frequency of the band-stop, cut-off of the FIR low-pass").md("MD32412"),
    Key::new(
        "jerk_filter_damping",
        "",
        NUMERATOR_DAMPING,
        Value(0.0),
        "numerator damping of the band-stop, 0 blocks completely",
    )
    .md("MD32414"),
    Key::new(
        "reference_model_frequency_hz",
        "Hz",
        NOT_NEGATIVE,
        Value(0.0),
        "reference model of the speed loop, seen by its integral part; 0 = off",
    )
    .md("p1433"),
    Key::new("reference_model_damping", "", DAMPING, Value(1.0), "its damping").md("p1434"),
    Key::new(
        "torque_upper_n_m",
        "N·m",
        UPPER,
        Means("Kt times current_max_a"),
        "upper torque limit, at the motor shaft",
    )
    .turning("force_upper_n")
    .md("p1520"),
    Key::new("force_upper_n", "N", UPPER, Means("force constant times current_max_a"), "upper force limit")
        .pushing("torque_upper_n_m")
        .md("p1520"),
    Key::new(
        "torque_lower_n_m",
        "N·m",
        LOWER,
        Means("minus Kt times current_max_a"),
        "lower torque limit, at the motor shaft",
    )
    .turning("force_lower_n")
    .md("p1521"),
    Key::new("force_lower_n", "N", LOWER, Means("minus force constant times current_max_a"), "lower force limit")
        .pushing("torque_lower_n_m")
        .md("p1521"),
    Key::new(
        "friction_compensation_mm_s",
        "mm/s",
        ANY,
        Value(0.0),
        "pulse on the velocity command at a reversal; 0 = off",
    )
    .linear("friction_compensation_deg_s")
    .md("MD32500, MD32520"),
    Key::new(
        "friction_compensation_deg_s",
        "deg/s",
        ANY,
        Value(0.0),
        "pulse on the velocity command at a reversal; 0 = off",
    )
    .rotary("friction_compensation_mm_s")
    .md("MD32500, MD32520"),
    Key::new(
        "friction_compensation_time_ms",
        "ms",
        FILTER_TIME,
        Value(10.0),
        "time constant with which the pulse fades",
    )
    .md("MD32540"),
    Key::new(
        "friction_adaptation",
        "",
        Flag,
        No,
        "the pulse depends on the acceleration: up with it to the first, full to the second, down to the third, lowest above",
    )
    .md("MD32510"),
    Key::new("friction_compensation_min_mm_s", "mm/s", ANY, Value(0.0), "pulse above the third acceleration")
        .linear("friction_compensation_min_deg_s")
        .md("MD32530"),
    Key::new("friction_compensation_min_deg_s", "deg/s", ANY, Value(0.0), "pulse above the third acceleration")
        .rotary("friction_compensation_min_mm_s")
        .md("MD32530"),
    Key::new("friction_acceleration_1_m_s2", "m/s²", POSITIVE, Value(0.02), "first acceleration of the adaptation")
        .linear("friction_acceleration_1_rot_s2")
        .md("MD32550"),
    Key::new("friction_acceleration_2_m_s2", "m/s²", POSITIVE, Value(0.05), "second acceleration of the adaptation")
        .linear("friction_acceleration_2_rot_s2")
        .md("MD32560"),
    Key::new("friction_acceleration_3_m_s2", "m/s²", POSITIVE, Value(0.1), "third acceleration of the adaptation")
        .linear("friction_acceleration_3_rot_s2")
        .md("MD32570"),
    Key::new("friction_acceleration_1_rot_s2", "rot/s²", POSITIVE, Value(0.02), "first acceleration of the adaptation")
        .rotary("friction_acceleration_1_m_s2")
        .md("MD32550"),
    Key::new("friction_acceleration_2_rot_s2", "rot/s²", POSITIVE, Value(0.05), "second acceleration of the adaptation")
        .rotary("friction_acceleration_2_m_s2")
        .md("MD32560"),
    Key::new("friction_acceleration_3_rot_s2", "rot/s²", POSITIVE, Value(0.1), "third acceleration of the adaptation")
        .rotary("friction_acceleration_3_m_s2")
        .md("MD32570"),
    Key::new(
        "backlash_compensation_um",
        "µm",
        ANY,
        Value(0.0),
        "correction of the measured position at a reversal; 0 = off",
    )
    .linear("backlash_compensation_deg")
    .md("MD32450"),
    Key::new(
        "backlash_compensation_deg",
        "deg",
        ANY,
        Value(0.0),
        "correction of the measured position at a reversal; 0 = off",
    )
    .rotary("backlash_compensation_um")
    .md("MD32450"),
    Key::new("speed_filter", "", Choice(words::<FilterShape>), Word("off"), "filter of the speed set-point")
        .md("p1414, p1415"),
    Key::new(
        "speed_filter_frequency_hz",
        "Hz",
        POSITIVE,
        Value(1999.0),
        "filter of the speed set-point: corner of a PT1, else frequency of the denominator",
    )
    .md("p1416, p1417"),
    Key::new(
        "speed_filter_damping",
        "",
        DAMPING,
        Value(0.7),
        "filter of the speed set-point: damping of the denominator",
    )
    .md("p1418"),
    Key::new(
        "speed_filter_numerator_frequency_hz",
        "Hz",
        POSITIVE,
        Value(1999.0),
        "filter of the speed set-point: frequency that the second order blocks",
    )
    .md("p1419"),
    Key::new(
        "speed_filter_numerator_damping",
        "",
        NUMERATOR_DAMPING,
        Value(0.7),
        "filter of the speed set-point: damping of the numerator, 0 blocks completely",
    )
    .md("p1420"),
    Key::new("current_filter_1", "", Choice(words::<FilterShape>), Word("off"), "filter 1 of the current set-point")
        .md("p1656.0, p1657"),
    Key::new(
        "current_filter_1_frequency_hz",
        "Hz",
        POSITIVE,
        Value(1999.0),
        "filter 1 of the current set-point: corner of a PT1, else frequency of the denominator",
    )
    .md("p1658"),
    Key::new(
        "current_filter_1_damping",
        "",
        DAMPING,
        Value(0.7),
        "filter 1 of the current set-point: damping of the denominator",
    )
    .md("p1659"),
    Key::new(
        "current_filter_1_numerator_frequency_hz",
        "Hz",
        POSITIVE,
        Value(1999.0),
        "filter 1 of the current set-point: frequency that the second order blocks",
    )
    .md("p1660"),
    Key::new(
        "current_filter_1_numerator_damping",
        "",
        NUMERATOR_DAMPING,
        Value(0.7),
        "filter 1 of the current set-point: damping of the numerator, 0 blocks completely",
    )
    .md("p1661"),
    Key::new("current_filter_2", "", Choice(words::<FilterShape>), Word("off"), "filter 2 of the current set-point")
        .md("p1656.1, p1662"),
    Key::new(
        "current_filter_2_frequency_hz",
        "Hz",
        POSITIVE,
        Value(1999.0),
        "filter 2 of the current set-point: corner of a PT1, else frequency of the denominator",
    )
    .md("p1663"),
    Key::new(
        "current_filter_2_damping",
        "",
        DAMPING,
        Value(0.7),
        "filter 2 of the current set-point: damping of the denominator",
    )
    .md("p1664"),
    Key::new(
        "current_filter_2_numerator_frequency_hz",
        "Hz",
        POSITIVE,
        Value(1999.0),
        "filter 2 of the current set-point: frequency that the second order blocks",
    )
    .md("p1665"),
    Key::new(
        "current_filter_2_numerator_damping",
        "",
        NUMERATOR_DAMPING,
        Value(0.7),
        "filter 2 of the current set-point: damping of the numerator, 0 blocks completely",
    )
    .md("p1666"),
    Key::new("current_filter_3", "", Choice(words::<FilterShape>), Word("off"), "filter 3 of the current set-point")
        .md("p1656.2, p1667"),
    Key::new(
        "current_filter_3_frequency_hz",
        "Hz",
        POSITIVE,
        Value(1999.0),
        "filter 3 of the current set-point: corner of a PT1, else frequency of the denominator",
    )
    .md("p1668"),
    Key::new(
        "current_filter_3_damping",
        "",
        DAMPING,
        Value(0.7),
        "filter 3 of the current set-point: damping of the denominator",
    )
    .md("p1669"),
    Key::new(
        "current_filter_3_numerator_frequency_hz",
        "Hz",
        POSITIVE,
        Value(1999.0),
        "filter 3 of the current set-point: frequency that the second order blocks",
    )
    .md("p1670"),
    Key::new(
        "current_filter_3_numerator_damping",
        "",
        NUMERATOR_DAMPING,
        Value(0.7),
        "filter 3 of the current set-point: damping of the numerator, 0 blocks completely",
    )
    .md("p1671"),
    Key::new("current_filter_4", "", Choice(words::<FilterShape>), Word("off"), "filter 4 of the current set-point")
        .md("p1656.3, p1672"),
    Key::new(
        "current_filter_4_frequency_hz",
        "Hz",
        POSITIVE,
        Value(1999.0),
        "filter 4 of the current set-point: corner of a PT1, else frequency of the denominator",
    )
    .md("p1673"),
    Key::new(
        "current_filter_4_damping",
        "",
        DAMPING,
        Value(0.7),
        "filter 4 of the current set-point: damping of the denominator",
    )
    .md("p1674"),
    Key::new(
        "current_filter_4_numerator_frequency_hz",
        "Hz",
        POSITIVE,
        Value(1999.0),
        "filter 4 of the current set-point: frequency that the second order blocks",
    )
    .md("p1675"),
    Key::new(
        "current_filter_4_numerator_damping",
        "",
        NUMERATOR_DAMPING,
        Value(0.7),
        "filter 4 of the current set-point: damping of the numerator, 0 blocks completely",
    )
    .md("p1676"),
];
