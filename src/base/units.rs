//! Conversion factors between the customary units at the borders and the units inside. They stand here and nowhere else.
//!
//! Inside: mm, rad, s on the path side; rad, N m, kg m², A, V on the motor side. Names end in the unit:
//!
//! | suffix | unit |
//! |---|---|
//! | `_mm`, `_mm_s`, `_mm_s2`, `_mm_s3` | length, velocity, acceleration, jerk along the path or of a linear axis |
//! | `_rad`, `_rad_s`, `_rad_s2`, `_rad_s3` | the same for a rotary axis or a motor |
//! | `_lu`, `_lu_s`, `_lu_s2`, `_lu_s3` | "length unit of the axis": mm for a linear axis, rad for a rotary one |
//! | `_s`, `_ms`, `_us`, `_ns` | time |
//! | `_hz` | frequency: borders and filters |
//! | `_deg`, `_deg_s`, `_rpm`, `_rot`, `_rot_s2`, `_rot_s3` | customary units of rotation: borders only |
//! | `_um`, `_m`, `_m_min`, `_m_s2`, `_m_s3`, `_mm_min`, `_inch`, `_mh` | other customary units: borders only |
//! | `_n_m`, `_kg_m2`, `_a`, `_v`, `_ohm`, `_h` | torque, inertia, current, voltage, resistance, inductance |
//! | `_n`, `_kg` | force and mass of a linear motor, whose radian is a metre |
//! | `_lu2_s2` | square of a speed |
//! | `_per_s`, `_per_s2`, `_per_mm` | 1/s, 1/s², 1/mm (curvature) |
//! | `_share`, `_ratio`, `_percent`, `_db` | dimensionless; a ratio of amplitudes in decibel: borders only |
//!
//! Products and quotients are written out: `_n_m_s_per_rad`, `_v_per_a`. `tests/tidy.rs` reads the list from this table.

use std::f64::consts::{PI, TAU};

/// Seconds in a minute.
pub const S_PER_MIN: f64 = 60.0;
/// Millimetres in a metre.
pub const MM_PER_M: f64 = 1000.0;
/// Millimetres in an inch.
pub const MM_PER_INCH: f64 = 25.4;
/// Radians in a degree.
pub const RAD_PER_DEG: f64 = PI / 180.0;
/// Degrees in a radian.
pub const DEG_PER_RAD: f64 = 180.0 / PI;
/// Radians in a revolution.
pub const RAD_PER_REV: f64 = TAU;
/// Micrometres in a millimetre.
pub const UM_PER_MM: f64 = 1000.0;
/// Milliseconds in a second.
pub const MS_PER_S: f64 = 1000.0;
/// Microseconds in a second.
pub const US_PER_S: f64 = 1e6;
/// Nanoseconds in a second.
pub const NS_PER_S: f64 = 1e9;
/// Nanoseconds in a millisecond.
pub const NS_PER_MS: f64 = 1e6;
/// Millihenry in a henry.
pub const MH_PER_H: f64 = 1000.0;

/// 1 -> 100 %.
pub fn percent_from_ratio(value_ratio: f64) -> f64 {
    100.0 * value_ratio
}

/// 100 % -> 1.
pub fn ratio_from_percent(value_percent: f64) -> f64 {
    value_percent / 100.0
}

/// Ratio of amplitudes -> decibel.
pub fn db_from_ratio(amplitude_ratio: f64) -> f64 {
    20.0 * amplitude_ratio.log10()
}

/// m/min -> mm/s.
pub fn mm_s_from_m_min(velocity_m_min: f64) -> f64 {
    velocity_m_min * MM_PER_M / S_PER_MIN
}

/// mm/min -> mm/s.
pub fn mm_s_from_mm_min(velocity_mm_min: f64) -> f64 {
    velocity_mm_min / S_PER_MIN
}

/// mm/s -> mm/min.
pub fn mm_min_from_mm_s(velocity_mm_s: f64) -> f64 {
    velocity_mm_s * S_PER_MIN
}

/// m/s², m/s³ -> mm/s², mm/s³.
pub fn mm_from_m(value_m: f64) -> f64 {
    value_m * MM_PER_M
}

/// rad/s -> rev/min.
pub fn rpm_from_rad_s(speed_rad_s: f64) -> f64 {
    speed_rad_s / RAD_PER_REV * S_PER_MIN
}

/// rad -> revolutions, with any power of 1/s.
pub fn rot_from_rad(value_rad: f64) -> f64 {
    value_rad / RAD_PER_REV
}

/// rev/min -> rad/s.
pub fn rad_s_from_rpm(speed_rpm: f64) -> f64 {
    speed_rpm * RAD_PER_REV / S_PER_MIN
}

/// rev, rev/s², rev/s³ -> rad, rad/s², rad/s³.
pub fn rad_from_rot(value_rot: f64) -> f64 {
    value_rot * RAD_PER_REV
}

/// deg, deg/s, ... -> rad, rad/s, ...
pub fn rad_from_deg(angle_deg: f64) -> f64 {
    angle_deg * RAD_PER_DEG
}

/// rad, rad/s, ... -> deg, deg/s, ...
pub fn deg_from_rad(angle_rad: f64) -> f64 {
    angle_rad * DEG_PER_RAD
}

/// µm -> mm.
pub fn mm_from_um(length_um: f64) -> f64 {
    length_um / UM_PER_MM
}

/// µm -> m.
pub fn m_from_um(length_um: f64) -> f64 {
    length_um / UM_PER_MM / MM_PER_M
}

/// mm -> inch.
pub fn inch_from_mm(length_mm: f64) -> f64 {
    length_mm / MM_PER_INCH
}

/// inch -> mm.
pub fn mm_from_inch(length_inch: f64) -> f64 {
    length_inch * MM_PER_INCH
}

/// ms -> s.
pub fn s_from_ms(time_ms: f64) -> f64 {
    time_ms / MS_PER_S
}

/// µs -> s.
pub fn s_from_us(time_us: f64) -> f64 {
    time_us / US_PER_S
}

/// mH -> H.
pub fn h_from_mh(inductance_mh: f64) -> f64 {
    inductance_mh / MH_PER_H
}
