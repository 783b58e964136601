//! `[axes.*.drive]`: from the file to checked drive data in SI units; `motor`, `mechanics` and `encoder` come from `mechanics`.
//!
//! In: the section of an axis. Out: [`DriveData`] and the cycles of its loops, in seconds: they become ticks in `clock`. A missing
//! drive is an ideal axis; half a drive is an error. Model: models/drive.md section 2; what is rejected: section 8.

use super::axis::{by_kind, lu};
use super::checked::{AxisLimits, DriveData, MechanicsData, MonitoringData};
use super::clock::LoopCycles;
use super::drive_options::{options, small_lu};
use super::mechanics::{Mechanics, by_motor, encoder, mechanics, motor, motor_kind};
use super::section::Section;
use crate::base::AxisKind;
use crate::base::diagnostics::Diagnostic;
use crate::base::units::{mm_from_um, s_from_ms, s_from_us};
use std::f64::consts::TAU;

/// The tables that are needed together.
const TABLES: [&str; 3] = ["drive", "motor", "mechanics"];

/// A resonance of motor and load above this share of the sampling frequency of the current loop is told of: `drive::second_mass` has as many stretches
/// in a tick as follow its swings up to there.
const RESONANCE_SHARE_MAX: f64 = 4.0;

/// A block that ends in position waits no longer, so that every run ends.
pub const POSITIONING_TIME_MAX_S: f64 = 3600.0;

/// The drive of an axis; `None` for an ideal axis, and after a report of half a drive.
pub(super) fn drive<'f>(axis: &Section<'f>, limits: &AxisLimits) -> Option<(DriveData, LoopCycles<'f>)> {
    let present: Vec<&str> = TABLES.into_iter().filter(|name| axis.has(name)).collect();
    if present.is_empty() && !axis.has("encoder") {
        return None;
    }
    for missing in TABLES.into_iter().filter(|name| !axis.has(name)) {
        let first = present.first().copied().unwrap_or("encoder");
        let message = format!("[{}] needs [{}] as well", axis.full(first), axis.full(missing));
        let help = "drive, motor and mechanics belong together: give all three, or none for an ideal axis \
                    (actual = set-point)";
        let mark = axis.entry(first).map_or(&axis.mark, |entry| &entry.key_mark);
        axis.report(mark, "not complete", Diagnostic::error("M0004", message).help(help));
    }
    let axis = &axis.clone().with_motor(motor_kind(axis));
    // What is there is checked even if the rest is missing, so that one pass finds all.
    let (data, cycles) = controllers(axis);
    if present.len() < TABLES.len() {
        return None;
    }
    check_velocity_reached(axis, limits, &data);
    Some((data, cycles))
}

fn controllers<'f>(axis: &Section<'f>) -> (DriveData, LoopCycles<'f>) {
    let Mechanics { data: mechanics, pitch_error } = mechanics(axis);
    let (encoder, encoder_compensation) = encoder(axis);
    let drive = axis.table_reported_if_missing("drive", "axes.*.drive");
    let kind = drive.kind().unwrap_or(AxisKind::Linear);
    let window = |linear, rotary| match kind {
        AxisKind::Linear => mm_from_um(drive.number(linear)),
        AxisKind::Rotary => lu(kind, drive.number(rotary)),
    };
    let in_position_coarse_lu = window("in_position_coarse_um", "in_position_coarse_deg");
    let in_position_fine_lu = window("in_position_fine_um", "in_position_fine_deg");
    let position_cycle_s = s_from_ms(drive.number("position_cycle_ms"));
    let speed_cycle_s = s_from_us(drive.number("speed_cycle_us"));
    let speed_key = by_kind(kind, "speed_setpoint_max_mm_s", "speed_setpoint_max_deg_s");
    let data = DriveData {
        identified: drive.flag("identified"),
        in_position_coarse_lu,
        in_position_fine_lu,
        monitoring: MonitoringData {
            positioning_time_s: s_from_ms(drive.number("positioning_time_ms")).min(POSITIONING_TIME_MAX_S),
            standstill_lu: small_lu(&drive, "standstill_um", "standstill_deg"),
            standstill_delay_s: s_from_ms(drive.number("standstill_delay_ms")),
            contour_lu: small_lu(&drive, "contour_monitoring_um", "contour_monitoring_deg"),
            speed_limit_time_s: drive.optional_number("speed_limit_time_ms").map_or(f64::INFINITY, s_from_ms),
            clamping_lu: small_lu(&drive, "clamping_um", "clamping_deg"),
            clamp_m_functions: clamp_m_functions(&drive),
            stop_time_s: s_from_ms(drive.number("emergency_stop_time_ms")),
        },
        // Ticks are known when all axes have been read: `clock` fills them in.
        position_cycle_ticks: 0,
        speed_cycle_ticks: 0,
        current_cycle_ticks: 0,
        position_gain_per_s: drive.number("position_gain_per_s"),
        velocity_feedforward_ratio: drive.number("velocity_feedforward"),
        torque_feedforward_ratio: drive.number("torque_feedforward"),
        feedforward_inertia_kg_m2: drive
            .optional_number(by_motor(axis, "feedforward_inertia_kg_m2", "feedforward_mass_kg"))
            .unwrap_or(mechanics.inertia_kg_m2),
        setpoint_delay_s: s_from_ms(drive.number("setpoint_delay_ms")),
        feedforward_delay_s: s_from_ms(drive.number("feedforward_delay_ms")),
        speed_setpoint_max_lu_s: lu(kind, drive.optional_number(speed_key).unwrap_or(f64::INFINITY)),
        speed_gain_n_m_s_per_rad: drive.number(by_motor(axis, "speed_gain_n_m_s_per_rad", "speed_gain_n_s_per_m")),
        speed_reset_time_s: s_from_ms(drive.number("speed_reset_time_ms")),
        current_gain_v_per_a: drive.number("current_gain_v_per_a"),
        current_reset_time_s: s_from_ms(drive.number("current_reset_time_ms")),
        current_max_a: drive.number("current_max_a"),
        voltage_max_v: drive.number("voltage_max_v"),
        motor: motor(axis),
        mechanics,
        pitch_error,
        encoder,
        encoder_compensation,
        options: options(&drive, position_cycle_s, speed_cycle_s),
    };
    if in_position_fine_lu > in_position_coarse_lu {
        let key = by_kind(kind, "in_position_fine_um", "in_position_fine_deg");
        let message = format!("{} is wider than the coarse window", drive.full(key));
        drive.report_at(key, "", Diagnostic::warning("M0104", message).help("the fine window is the smaller one"));
    }
    let current_cycle_s = s_from_us(drive.number("current_cycle_us"));
    check_resonance(axis, &data.mechanics, current_cycle_s);
    let cycles = LoopCycles { position_cycle_s, speed_cycle_s, current_cycle_s, drive };
    (data, cycles)
}

/// One of them without the other is an error.
fn clamp_m_functions(drive: &Section<'_>) -> Option<[u32; 2]> {
    let keys = ["clamp_m_function", "release_m_function"];
    let functions = keys.map(|key| drive.whole(key));
    let [clamps, releases] = keys.map(|key| drive.has(key));
    let same = functions[0].is_some() && functions[0] == functions[1];
    if clamps != releases || same {
        let key = if clamps { keys[0] } else { keys[1] };
        let message =
            format!("{} needs clamp_m_function and release_m_function, two different M functions", drive.full(key));
        drive.report_at(key, "", Diagnostic::error("M0008", message).help("such as 10 to clamp and 11 to release"));
    }
    let [Some(clamp), Some(release)] = functions else { return None };
    Some([clamp, release])
}

/// A resonance that no loop can see: the numbers of such a spring are a slip of the pen, or a rigid axis.
fn check_resonance(axis: &Section<'_>, mechanics: &MechanicsData, current_cycle_s: f64) {
    let MechanicsData { inertia_kg_m2, load_inertia_kg_m2, coupling_stiffness_n_m_per_rad, .. } = *mechanics;
    let per_inertia = 1.0 / load_inertia_kg_m2 + 1.0 / (inertia_kg_m2 - load_inertia_kg_m2);
    let resonance_hz = (coupling_stiffness_n_m_per_rad * per_inertia).sqrt() / TAU;
    if load_inertia_kg_m2 > 0.0 && resonance_hz * current_cycle_s > RESONANCE_SHARE_MAX && resonance_hz.is_finite() {
        let key = by_motor(axis, "coupling_stiffness_n_m_per_rad", "coupling_stiffness_n_per_um");
        let load = by_motor(axis, "load_inertia_kg_m2", "load_mass_kg");
        let message = format!(
            "axes.{}.mechanics.{key}: motor and load swing at {resonance_hz:.0} Hz, and the current loop samples at {:.0} Hz",
            axis_name(axis),
            1.0 / current_cycle_s
        );
        let help =
            format!("such an axis is rigid: remove {load}, or give the stiffness of the resonance that was measured");
        axis.report_at("mechanics", "", Diagnostic::warning("M0105", message).help(help));
    }
}

/// A drive that cannot reach the velocity of its axis never follows a rapid: worth a word.
fn check_velocity_reached(axis: &Section<'_>, limits: &AxisLimits, drive: &DriveData) {
    let velocity = limits.velocity_max_lu_s;
    if drive.speed_setpoint_max_lu_s < velocity {
        let message =
            format!("axes.{}: speed_setpoint_max clamps the drive below velocity_max of the axis", axis_name(axis));
        let help = "the axis cannot follow its set-points at full velocity: raise the clamp or lower the velocity";
        axis.report_at("drive", "", Diagnostic::warning("M0103", message).help(help));
    }
    let speed_rad_s = velocity / drive.mechanics.transmission_lu_per_rad.abs();
    let back_emf_v = drive.motor.back_emf_v_s_per_rad * speed_rad_s;
    if back_emf_v > drive.voltage_max_v {
        let message = format!(
            "axes.{}: at velocity_max the back-EMF is {back_emf_v:.0} V, more than voltage_max_v = {} V",
            axis_name(axis),
            drive.voltage_max_v
        );
        let help = "the motor cannot turn that fast: check gear ratio, pitch and back_emf_v_s_per_rad";
        axis.report_at("drive", "", Diagnostic::warning("M0103", message).help(help));
    }
}

fn axis_name<'s>(axis: &'s Section<'_>) -> &'s str {
    axis.path.rsplit('.').next().unwrap_or(&axis.path)
}
