//! Machine data and drive parameters that are one key each, with the unit on either side.
//!
//! In: nothing. Out: [`ROWS`], [`PARAMETERS`]. What takes more than one datum (names, gears, encoders, modes) is in `axes`, `special`
//! and `drives`. Numbers, names and units are those of the list manuals (facts: one archive of a 5-axis mill read with them).

use super::data::Scope;
use crate::base::AxisKind;
use crate::base::units::{DEG_PER_RAD, MM_PER_M, MS_PER_S, RAD_PER_REV, S_PER_MIN, UM_PER_MM};

/// From the unit of the control to that of the key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Unit {
    /// The same.
    Same,
    /// mm/min -> m/min; rev/min stay.
    Velocity,
    /// (m/min)/mm -> 1/s; a turn is the same: (1000 deg/min)/deg.
    Gain,
    /// s -> ms.
    Time,
    /// mm -> µm; deg stay.
    Small,
    /// mm/min -> mm/s; rev/min -> deg/s.
    Pulse,
}

impl Unit {
    /// Numerator and denominator: exact where a single factor would not be.
    fn quotient(self, kind: AxisKind) -> (f64, f64) {
        match (self, kind) {
            (Self::Same, _) | (Self::Velocity | Self::Small, AxisKind::Rotary) => (1.0, 1.0),
            (Self::Velocity, AxisKind::Linear) => (1.0, MM_PER_M),
            (Self::Gain, _) => (MM_PER_M, S_PER_MIN),
            (Self::Time, _) => (MS_PER_S, 1.0),
            (Self::Small, AxisKind::Linear) => (UM_PER_MM, 1.0),
            (Self::Pulse, AxisKind::Linear) => (1.0, S_PER_MIN),
            (Self::Pulse, AxisKind::Rotary) => (RAD_PER_REV * DEG_PER_RAD, S_PER_MIN),
        }
    }

    /// From the control.
    pub fn to_key(self, kind: AxisKind, value: f64) -> f64 {
        let (numerator, denominator) = self.quotient(kind);
        value * numerator / denominator
    }

    /// To the control.
    pub fn to_datum(self, kind: AxisKind, value: f64) -> f64 {
        let (numerator, denominator) = self.quotient(kind);
        value * denominator / numerator
    }
}

/// A machine datum that is a key.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub number: u32,
    pub name: &'static str,
    pub scope: Scope,
    pub index: u32,
    /// Whether it is written without index: `[AX1]`.
    pub plain: bool,
    /// Dotted path from the top of the file, or from the axis, of a linear axis.
    pub linear: &'static str,
    /// The same of a rotary axis.
    pub rotary: &'static str,
    pub unit: Unit,
}

impl Row {
    /// The key on an axis of this kind.
    pub fn key(&self, kind: AxisKind) -> &'static str {
        match kind {
            AxisKind::Linear => self.linear,
            AxisKind::Rotary => self.rotary,
        }
    }
}

const fn general(number: u32, name: &'static str, key: &'static str, unit: Unit) -> Row {
    Row { number, name, scope: Scope::General, index: 0, plain: true, linear: key, rotary: key, unit }
}

const fn channel(number: u32, name: &'static str, plain: bool, key: &'static str) -> Row {
    Row { scope: Scope::Channel, plain, ..general(number, name, key, Unit::Same) }
}

const fn setting(number: u32, name: &'static str, key: &'static str) -> Row {
    Row { scope: Scope::ChannelSetting, ..general(number, name, key, Unit::Same) }
}

const fn axis(number: u32, name: &'static str, linear: &'static str, rotary: &'static str, unit: Unit) -> Row {
    Row { number, name, scope: Scope::Axis, index: 0, plain: true, linear, rotary, unit }
}

const fn acceleration(number: u32, name: &'static str, linear: &'static str, rotary: &'static str) -> Row {
    axis(number, name, linear, rotary, Unit::Same)
}

const fn first(row: Row) -> Row {
    Row { plain: false, ..row }
}

/// One datum, one key.
pub(super) const ROWS: &[Row] = &[
    general(10071, "IPO_CYCLE_TIME", "cycle.t_cyl_ms", Unit::Time),
    channel(20170, "COMPRESS_BLOCK_PATH_LIMIT", true, "smoothing.compressor_length_max_mm"),
    channel(20560, "G0_TOLERANCE_FACTOR", true, "smoothing.rapid_tolerance_ratio"),
    channel(20602, "CURV_EFFECT_ON_PATH_ACCEL", false, "smoothing.radial_acceleration_share"),
    channel(20603, "CURV_EFFECT_ON_PATH_JERK", false, "smoothing.radial_jerk_share"),
    channel(28060, "MM_IPO_BUFFER_SIZE", true, "look_ahead.blocks"),
    setting(42465, "SMOOTH_CONTUR_TOL", "smoothing.contour_tolerance_mm"),
    setting(42466, "SMOOTH_ORI_TOL", "smoothing.orientation_tolerance_deg"),
    setting(42470, "CRIT_SPLINE_ANGLE", "smoothing.compressor_corner_deg"),
    axis(32000, "MAX_AX_VELO", "velocity_max_m_min", "velocity_max_rpm", Unit::Velocity),
    first(axis(32300, "MAX_AX_ACCEL", "acceleration_max_m_s2", "acceleration_max_rot_s2", Unit::Same)),
    first(axis(32431, "MAX_AX_JERK", "jerk_max_m_s3", "jerk_max_rot_s3", Unit::Same)),
    first(axis(32432, "PATH_TRANS_JERK_LIM", "transition_jerk_max_m_s3", "transition_jerk_max_rot_s3", Unit::Same)),
    first(axis(32200, "POSCTRL_GAIN", "drive.position_gain_per_s", "drive.position_gain_per_s", Unit::Gain)),
    axis(32410, "AX_JERK_TIME", "drive.jerk_filter_time_ms", "drive.jerk_filter_time_ms", Unit::Time),
    axis(32411, "AX_JERK_TIME_ADD", "drive.jerk_filter_time_add_ms", "drive.jerk_filter_time_add_ms", Unit::Time),
    axis(32412, "AX_JERK_FREQ", "drive.jerk_filter_frequency_hz", "drive.jerk_filter_frequency_hz", Unit::Same),
    axis(32414, "AX_JERK_DAMP", "drive.jerk_filter_damping", "drive.jerk_filter_damping", Unit::Same),
    first(axis(32450, "BACKLASH", "drive.backlash_compensation_um", "drive.backlash_compensation_deg", Unit::Small)),
    first(axis(
        32540,
        "FRICT_COMP_TIME",
        "drive.friction_compensation_time_ms",
        "drive.friction_compensation_time_ms",
        Unit::Time,
    )),
    first(axis(32610, "VELO_FFW_WEIGHT", "drive.velocity_feedforward", "drive.velocity_feedforward", Unit::Same)),
    axis(36000, "STOP_LIMIT_COARSE", "drive.in_position_coarse_um", "drive.in_position_coarse_deg", Unit::Small),
    axis(36010, "STOP_LIMIT_FINE", "drive.in_position_fine_um", "drive.in_position_fine_deg", Unit::Small),
    axis(36020, "POSITIONING_TIME", "drive.positioning_time_ms", "drive.positioning_time_ms", Unit::Time),
    axis(36030, "STANDSTILL_POS_TOL", "drive.standstill_um", "drive.standstill_deg", Unit::Small),
    axis(36040, "STANDSTILL_DELAY_TIME", "drive.standstill_delay_ms", "drive.standstill_delay_ms", Unit::Time),
    first(axis(
        32530,
        "FRICT_COMP_CONST_MIN",
        "drive.friction_compensation_min_mm_s",
        "drive.friction_compensation_min_deg_s",
        Unit::Pulse,
    )),
    first(acceleration(
        32550,
        "FRICT_COMP_ACCEL1",
        "drive.friction_acceleration_1_m_s2",
        "drive.friction_acceleration_1_rot_s2",
    )),
    first(acceleration(
        32560,
        "FRICT_COMP_ACCEL2",
        "drive.friction_acceleration_2_m_s2",
        "drive.friction_acceleration_2_rot_s2",
    )),
    first(acceleration(
        32570,
        "FRICT_COMP_ACCEL3",
        "drive.friction_acceleration_3_m_s2",
        "drive.friction_acceleration_3_rot_s2",
    )),
    axis(36050, "CLAMP_POS_TOL", "drive.clamping_um", "drive.clamping_deg", Unit::Small),
    first(axis(36220, "CTRLOUT_LIMIT_TIME", "drive.speed_limit_time_ms", "drive.speed_limit_time_ms", Unit::Time)),
    axis(36610, "AX_EMERGENCY_STOP_TIME", "drive.emergency_stop_time_ms", "drive.emergency_stop_time_ms", Unit::Time),
    axis(36400, "CONTOUR_TOL", "drive.contour_monitoring_um", "drive.contour_monitoring_deg", Unit::Small),
];

/// Data with a value for each set of dynamics, and the key inside `dynamics.*`, linear and rotary.
pub(super) const DYNAMICS_ROWS: [(u32, &str, &str, &str); 3] = [
    (32300, "MAX_AX_ACCEL", "acceleration_max_m_s2", "acceleration_max_rot_s2"),
    (32431, "MAX_AX_JERK", "jerk_max_m_s3", "jerk_max_rot_s3"),
    (32432, "PATH_TRANS_JERK_LIM", "transition_jerk_max_m_s3", "transition_jerk_max_rot_s3"),
];
/// Index of a set in those data: DYNNORM, DYNPOS, DYNROUGH, DYNSEMIFIN, DYNFINISH.
pub(super) const DYNAMICS_SETS: [(u32, &str); 4] = [(1, "position"), (2, "rough"), (3, "semifinish"), (4, "finish")];

/// A drive parameter that is a key.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parameter {
    pub number: u32,
    pub index: u32,
    /// Dotted path from the axis, with a rotary motor.
    pub turning: &'static str,
    /// With a linear motor; empty: the same.
    pub pushing: &'static str,
}

impl Parameter {
    /// The key with this motor.
    pub fn key(&self, linear_motor: bool) -> &'static str {
        if linear_motor && !self.pushing.is_empty() { self.pushing } else { self.turning }
    }
}

const fn parameter(number: u32, turning: &'static str) -> Parameter {
    Parameter { number, index: 0, turning, pushing: "" }
}

const fn by_motor(number: u32, turning: &'static str, pushing: &'static str) -> Parameter {
    Parameter { number, index: 0, turning, pushing }
}

/// One parameter, one key, in the same unit.
pub(super) const PARAMETERS: &[Parameter] = &[
    Parameter { index: 1, ..parameter(115, "drive.speed_cycle_us") },
    parameter(115, "drive.current_cycle_us"),
    by_motor(316, "motor.torque_constant_n_m_per_a", "motor.force_constant_n_per_a"),
    parameter(350, "motor.resistance_ohm"),
    parameter(356, "motor.inductance_mh"),
    parameter(640, "drive.current_max_a"),
    parameter(1417, "drive.speed_filter_frequency_hz"),
    parameter(1418, "drive.speed_filter_damping"),
    parameter(1419, "drive.speed_filter_numerator_frequency_hz"),
    parameter(1420, "drive.speed_filter_numerator_damping"),
    parameter(1433, "drive.reference_model_frequency_hz"),
    parameter(1434, "drive.reference_model_damping"),
    by_motor(1460, "drive.speed_gain_n_m_s_per_rad", "drive.speed_gain_n_s_per_m"),
    parameter(1462, "drive.speed_reset_time_ms"),
    by_motor(1520, "drive.torque_upper_n_m", "drive.force_upper_n"),
    by_motor(1521, "drive.torque_lower_n_m", "drive.force_lower_n"),
    parameter(1658, "drive.current_filter_1_frequency_hz"),
    parameter(1659, "drive.current_filter_1_damping"),
    parameter(1660, "drive.current_filter_1_numerator_frequency_hz"),
    parameter(1661, "drive.current_filter_1_numerator_damping"),
    parameter(1663, "drive.current_filter_2_frequency_hz"),
    parameter(1664, "drive.current_filter_2_damping"),
    parameter(1665, "drive.current_filter_2_numerator_frequency_hz"),
    parameter(1666, "drive.current_filter_2_numerator_damping"),
    parameter(1668, "drive.current_filter_3_frequency_hz"),
    parameter(1669, "drive.current_filter_3_damping"),
    parameter(1670, "drive.current_filter_3_numerator_frequency_hz"),
    parameter(1671, "drive.current_filter_3_numerator_damping"),
    parameter(1673, "drive.current_filter_4_frequency_hz"),
    parameter(1674, "drive.current_filter_4_damping"),
    parameter(1675, "drive.current_filter_4_numerator_frequency_hz"),
    parameter(1676, "drive.current_filter_4_numerator_damping"),
    parameter(1715, "drive.current_gain_v_per_a"),
    parameter(1717, "drive.current_reset_time_ms"),
];
/// Type of the filters of the current set-point, with the key of the shape.
pub(super) const CURRENT_FILTER_TYPES: [(u32, &str); 4] = [
    (1657, "drive.current_filter_1"),
    (1662, "drive.current_filter_2"),
    (1667, "drive.current_filter_3"),
    (1672, "drive.current_filter_4"),
];
