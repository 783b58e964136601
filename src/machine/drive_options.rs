//! What a drive may have besides the cascade: filters, compensations, limits. Each is off unless the file asks for it.
//!
//! In: `[axes.*.drive]`. Out: [`DriveOptions`] in internal units. Checks that frequencies lie below half the
//! sampling frequency of their loop.

use super::axis::{by_kind, lu};
use super::choices::Choice;
use super::mechanics::by_motor;
use super::section::Section;
use crate::base::AxisKind;
use crate::base::diagnostics::Diagnostic;
use crate::base::units::{RAD_PER_REV, mm_from_m, mm_from_um, rad_from_rot, s_from_ms};

/// Filters of the current set-point (p1656 has four).
pub const CURRENT_FILTERS: usize = 4;

/// FFW_MODE, MD32620: how the position set-point waits for the feed-forward.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Balancing {
    /// Modes 3 and 4: a dead time.
    #[default]
    DeadTime,
    /// Modes 1 and 2: a filter of first order.
    Pt1,
}

impl Choice for Balancing {
    const WORDS: &'static [(&'static str, Self)] = &[("dead_time", Self::DeadTime), ("pt1", Self::Pt1)];
}

/// Shape of a set-point filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum FilterShape {
    /// A wire.
    #[default]
    Off,
    /// 1 / (1 + s/w).
    Pt1,
    /// 1 / (1 + 2 D s/w + (s/w)²).
    Pt2,
    /// (1 + 2 Dz s/wz + (s/wz)²) / (1 + 2 D s/w + (s/w)²).
    SecondOrder,
}

impl Choice for FilterShape {
    const WORDS: &'static [(&'static str, Self)] =
        &[("off", Self::Off), ("pt1", Self::Pt1), ("pt2", Self::Pt2), ("second_order", Self::SecondOrder)];
}

/// A set-point filter.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Filter {
    /// Its law.
    pub shape: FilterShape,
    /// w / 2π, of the denominator.
    pub frequency_hz: f64,
    /// D, of the denominator.
    pub damping_ratio: f64,
    /// wz / 2π: the frequency that is blocked.
    pub numerator_frequency_hz: f64,
    /// Dz: 0 blocks completely.
    pub numerator_damping_ratio: f64,
}

/// MD32402.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum JerkFilterKind {
    /// MD32400 = 0.
    #[default]
    Off,
    /// 1.
    SecondOrder,
    /// 2.
    MovingAverage,
    /// 3.
    BandStop,
    /// 4.
    DoubleMovingAverage,
    /// 5.
    FirLowPass,
}

impl Choice for JerkFilterKind {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("off", Self::Off),
        ("second_order", Self::SecondOrder),
        ("moving_average", Self::MovingAverage),
        ("band_stop", Self::BandStop),
        ("double_moving_average", Self::DoubleMovingAverage),
        ("fir_low_pass", Self::FirLowPass),
    ];
}

/// Jerk filter of the set-point.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct JerkFilter {
    /// Its law.
    pub kind: JerkFilterKind,
    /// MD32410.
    pub time_s: f64,
    /// MD32411: the second average.
    pub time_add_s: f64,
    /// MD32412.
    pub frequency_hz: f64,
    /// MD32414.
    pub damping_ratio: f64,
}

impl JerkFilter {
    /// Second order: damping 1 as in the control, and a delay of a ramp by MD32410, so that w = 2 / T.
    pub fn low_pass(&self) -> Filter {
        let frequency_hz = 2.0 / self.time_s / RAD_PER_REV;
        Filter { shape: FilterShape::Pt2, frequency_hz, damping_ratio: 1.0, ..Filter::default() }
    }

    /// Band-stop: denominator at the blocking frequency with damping 1.
    pub fn band_stop(&self) -> Filter {
        Filter {
            shape: FilterShape::SecondOrder,
            frequency_hz: self.frequency_hz,
            damping_ratio: 1.0,
            numerator_frequency_hz: self.frequency_hz,
            numerator_damping_ratio: self.damping_ratio,
        }
    }
}

/// Where the position is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum PositionSource {
    /// MD31040 = 1: a scale at the load.
    #[default]
    Load,
    /// MD31040 = 0: the motor encoder.
    Motor,
}

impl Choice for PositionSource {
    const WORDS: &'static [(&'static str, Self)] = &[("load", Self::Load), ("motor", Self::Motor)];
}

/// How the pulse at a reversal depends on the acceleration there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionAdaptation {
    /// MD32530.
    pub lowest_lu_s: f64,
    /// MD32550, MD32560, MD32570: not falling.
    pub accelerations_lu_s2: [f64; 3],
}

/// All of it; the default is everything off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveOptions {
    /// MD32620.
    pub balancing: Balancing,
    /// MD32640: the position controller works in the drive (DSC).
    pub stiffness_control: bool,
    /// MD32400.
    pub jerk_filter: JerkFilter,
    /// p1414 ff.
    pub speed_filter: Filter,
    /// p1656 ff.
    pub current_filters: [Filter; CURRENT_FILTERS],
    /// p1433, p1434: a PT2, or off.
    pub reference_model: Filter,
    /// p1520; may be infinite.
    pub torque_upper_n_m: f64,
    /// p1521; may be minus infinity.
    pub torque_lower_n_m: f64,
    /// MD32520; 0 = off.
    pub friction_pulse_lu_s: f64,
    /// MD32510; `None`: the pulse is always the same.
    pub friction_adaptation: Option<FrictionAdaptation>,
    /// MD32540.
    pub friction_pulse_time_s: f64,
    /// MD32450; 0 = off.
    pub backlash_compensation_lu: f64,
}

impl Default for DriveOptions {
    fn default() -> Self {
        Self {
            balancing: Balancing::default(),
            stiffness_control: false,
            jerk_filter: JerkFilter::default(),
            speed_filter: Filter::default(),
            current_filters: [Filter::default(); CURRENT_FILTERS],
            reference_model: Filter::default(),
            torque_upper_n_m: f64::INFINITY,
            torque_lower_n_m: f64::NEG_INFINITY,
            friction_pulse_lu_s: 0.0,
            friction_adaptation: None,
            friction_pulse_time_s: 1.0,
            backlash_compensation_lu: 0.0,
        }
    }
}

macro_rules! filter_keys {
    ($name:literal) => {
        [
            $name,
            concat!($name, "_frequency_hz"),
            concat!($name, "_damping"),
            concat!($name, "_numerator_frequency_hz"),
            concat!($name, "_numerator_damping"),
        ]
    };
}
/// Keys of a filter: shape, frequency, damping, numerator frequency, numerator damping.
type FilterKeys = [&'static str; 5];

const SPEED_FILTER: FilterKeys = filter_keys!("speed_filter");
const CURRENT_FILTER: [FilterKeys; CURRENT_FILTERS] = [
    filter_keys!("current_filter_1"),
    filter_keys!("current_filter_2"),
    filter_keys!("current_filter_3"),
    filter_keys!("current_filter_4"),
];

/// Reads the keys; the cycles are those of position and speed loop.
pub(super) fn options(drive: &Section<'_>, position_cycle_s: f64, speed_cycle_s: f64) -> DriveOptions {
    let kind = drive.kind().unwrap_or(AxisKind::Linear);
    let pulse = by_kind(kind, "friction_compensation_mm_s", "friction_compensation_deg_s");
    let upper = by_motor(drive, "torque_upper_n_m", "force_upper_n");
    let lower = by_motor(drive, "torque_lower_n_m", "force_lower_n");
    let model_hz = drive.number("reference_model_frequency_hz");
    below_half_rate(drive, "reference_model_frequency_hz", model_hz, speed_cycle_s);
    DriveOptions {
        balancing: drive.choice("feedforward_balancing"),
        stiffness_control: drive.flag("stiffness_control"),
        jerk_filter: jerk_filter(drive, position_cycle_s),
        speed_filter: filter(drive, &SPEED_FILTER, speed_cycle_s),
        current_filters: CURRENT_FILTER.map(|keys| filter(drive, &keys, speed_cycle_s)),
        reference_model: Filter {
            shape: if model_hz > 0.0 { FilterShape::Pt2 } else { FilterShape::Off },
            frequency_hz: model_hz,
            damping_ratio: drive.number("reference_model_damping"),
            ..Filter::default()
        },
        torque_upper_n_m: drive.optional_number(upper).unwrap_or(f64::INFINITY),
        torque_lower_n_m: drive.optional_number(lower).unwrap_or(f64::NEG_INFINITY),
        friction_pulse_lu_s: lu(kind, drive.number(pulse)),
        friction_adaptation: friction_adaptation(drive, kind),
        friction_pulse_time_s: s_from_ms(drive.number("friction_compensation_time_ms")),
        backlash_compensation_lu: small_lu(drive, "backlash_compensation_um", "backlash_compensation_deg"),
    }
}

/// A length in µm or an angle in degrees.
pub(super) fn small_lu(section: &Section<'_>, linear_um: &'static str, rotary_deg: &'static str) -> f64 {
    match section.kind().unwrap_or(AxisKind::Linear) {
        AxisKind::Linear => mm_from_um(section.number(linear_um)),
        AxisKind::Rotary => lu(AxisKind::Rotary, section.number(rotary_deg)),
    }
}

fn friction_adaptation(drive: &Section<'_>, kind: AxisKind) -> Option<FrictionAdaptation> {
    let lowest = by_kind(kind, "friction_compensation_min_mm_s", "friction_compensation_min_deg_s");
    let accelerations_lu_s2 = match kind {
        AxisKind::Linear => {
            ["friction_acceleration_1_m_s2", "friction_acceleration_2_m_s2", "friction_acceleration_3_m_s2"]
                .map(|key| mm_from_m(drive.number(key)))
        }
        AxisKind::Rotary => {
            ["friction_acceleration_1_rot_s2", "friction_acceleration_2_rot_s2", "friction_acceleration_3_rot_s2"]
                .map(|key| rad_from_rot(drive.number(key)))
        }
    };
    let adaptation = FrictionAdaptation { lowest_lu_s: lu(kind, drive.number(lowest)), accelerations_lu_s2 };
    if !drive.flag("friction_adaptation") {
        return None;
    }
    let [first, second, third] = accelerations_lu_s2;
    if first > second || second > third {
        let message =
            format!("{}: the three accelerations of the adaptation must not fall", drive.full("friction_adaptation"));
        let help = "give friction_acceleration_1, _2 and _3 in rising order";
        drive.report_at("friction_adaptation", "", Diagnostic::error("M0008", message).help(help));
    }
    Some(adaptation)
}

fn jerk_filter(drive: &Section<'_>, position_cycle_s: f64) -> JerkFilter {
    let filter = JerkFilter {
        kind: drive.choice("jerk_filter"),
        time_s: s_from_ms(drive.number("jerk_filter_time_ms")),
        time_add_s: s_from_ms(drive.number("jerk_filter_time_add_ms")),
        frequency_hz: drive.number("jerk_filter_frequency_hz"),
        damping_ratio: drive.number("jerk_filter_damping"),
    };
    match filter.kind {
        JerkFilterKind::SecondOrder => {
            below_half_rate(drive, "jerk_filter_time_ms", filter.low_pass().frequency_hz, position_cycle_s);
        }
        JerkFilterKind::BandStop | JerkFilterKind::FirLowPass => {
            below_half_rate(drive, "jerk_filter_frequency_hz", filter.frequency_hz, position_cycle_s);
        }
        _ => {}
    }
    filter
}

fn filter(drive: &Section<'_>, keys: &FilterKeys, cycle_s: f64) -> Filter {
    let [shape, frequency, damping, numerator_frequency, numerator_damping] = *keys;
    let filter = Filter {
        shape: drive.choice(shape),
        frequency_hz: drive.number(frequency),
        damping_ratio: drive.number(damping),
        numerator_frequency_hz: drive.number(numerator_frequency),
        numerator_damping_ratio: drive.number(numerator_damping),
    };
    if filter.shape != FilterShape::Off {
        below_half_rate(drive, frequency, filter.frequency_hz, cycle_s);
    }
    if filter.shape == FilterShape::SecondOrder {
        below_half_rate(drive, numerator_frequency, filter.numerator_frequency_hz, cycle_s);
    }
    filter
}

/// A sampled filter knows nothing above half its sampling frequency.
fn below_half_rate(drive: &Section<'_>, key: &str, frequency_hz: f64, cycle_s: f64) {
    let half_hz = 0.5 / cycle_s;
    if frequency_hz >= half_hz {
        let message = format!(
            "{}: {frequency_hz:.6} Hz is not below half the sampling frequency of its loop, {half_hz:.6} Hz",
            drive.full(key)
        );
        let help = "lower the frequency (a longer time), shorten the cycle of the loop, or switch the filter off";
        drive.report_at(key, "", Diagnostic::error("M0008", message).help(help));
    }
}
