//! Keys that take more than one machine datum: modes, cycles, travel, gears, feed-forward, encoders; and what is assumed where data are silent.
//!
//! In: the draft with its single keys. Out: the rest of the keys. Rules: MD32620 decides which delay holds (MD32810 with modes 1 and 3, MD32800
//! with 2 and 4) and 0 switches both feed-forwards off; without it 3 is assumed, and said; MD31060 / MD31050 is motor turns per load turn; MD32100 = -1 turns the sign of the
//! transmission; a pulse of friction compensation counts if MD32500 is 1. A drive needs motor data: without, the axis is ideal.

use super::axes::FoundAxis;
use super::data::Scope;
use super::import::{Draft, Origin, key_row, table_and_key};
use super::rows::Unit;
use super::write;
use crate::base::units::{MS_PER_S, UM_PER_MM};
use crate::base::{AxisKind, Diagnostic};
use crate::machine::keys::{Absent, Key, MotorKind};

/// Words of group 10 by their number in MD20150[9].
pub(super) const PATH_MODES: [&str; 7] = ["G60", "G64", "G641", "G642", "G643", "G644", "G645"];
/// Words of the jerk filter by MD32402.
pub(super) const JERK_FILTERS: [&str; 5] =
    ["second_order", "moving_average", "band_stop", "double_moving_average", "fir_low_pass"];
/// Words of MD20482, hundreds.
pub(super) const COMPRESSOR_BLOCKS: [&str; 4] = ["lines", "arcs", "rapids", "all"];
/// A travel limit of this or more is none: the control writes 1e8.
pub(super) const NO_TRAVEL_LIMIT: f64 = 99_999_999.0;

/// A machine file that says nothing has this mode too.
const ASSUMED_MODE: &str = "assumed: no MD32620, taken as 3";

/// The control: cycles, modes.
pub(super) fn control(draft: &mut Draft<'_>, axes: &[FoundAxis]) {
    let nobody = [String::new()];
    if let Some((mode, source)) = draft.listing.number(Scope::Channel, "GCODE_RESET_VALUES", &nobody, 9)
        && let Some(word) = (mode as usize).checked_sub(1).and_then(|place| PATH_MODES.get(place))
    {
        draft.put_word("feed.default_path_mode", word, Origin::Datum, &source);
    }
    if let Some((mode, source)) = draft.listing.number(Scope::Channel, "GCODE_RESET_VALUES", &nobody, 20) {
        let word = if mode == 2.0 { "SOFT" } else { "BRISK" };
        draft.put_word("feed.default_acceleration_mode", word, Origin::Datum, &source);
    }
    if let Some((mode, source)) = draft.listing.number(Scope::Channel, "COMPRESSOR_MODE", &nobody, 0) {
        let hundreds = (mode as u32 / 100 % 10) as usize;
        if let Some(word) = COMPRESSOR_BLOCKS.get(hundreds) {
            draft.put_word("smoothing.compressor_blocks", word, Origin::Datum, &source);
        }
    }
    least(draft, axes, "MAX_ACCEL_OVL_FACTOR", "feed.overload_factor");
    let linear: Vec<FoundAxis> = axes.iter().filter(|axis| axis.kind == AxisKind::Linear).cloned().collect();
    least(draft, &linear, "PATH_TRANS_POS_TOL", "smoothing.transition_tolerance_mm");
    // Without the setting datum the tolerance of the axes is that of the contour.
    if !draft.values.contains_key("smoothing.contour_tolerance_mm") {
        least(draft, &linear, "COMPRESS_POS_TOL", "smoothing.contour_tolerance_mm");
    }
    let fine: Vec<(f64, String)> =
        axes.iter().filter_map(|axis| draft.listing.number(Scope::Axis, "FIPO_TYPE", &axis.theirs, 0)).collect();
    if let Some((kind, source)) = fine.first() {
        let word = if *kind == 1.0 { "linear" } else { "cubic" };
        draft.put_word("cycle.fine_interpolation", word, Origin::Datum, source);
    }
    let clock = draft.listing.number(Scope::General, "SYSCLOCK_CYCLE_TIME", &nobody, 0);
    let ratio = draft.listing.number(Scope::General, "IPO_SYSCLOCK_TIME_RATIO", &nobody, 0);
    if let (Some((clock_s, source)), Some((ratio, _))) = (clock, ratio) {
        let source = format!("{source} times MD10070");
        draft.put_number("cycle.t_cyl_ms", clock_s * ratio * MS_PER_S, Origin::Derived, &source, None);
    }
    spindle(draft);
}

/// The least value of the axes, which is the one that holds on a path.
fn least(draft: &mut Draft<'_>, axes: &[FoundAxis], name: &str, key: &str) {
    let of_axes: Vec<(f64, String)> =
        axes.iter().filter_map(|axis| draft.listing.number(Scope::Axis, name, &axis.theirs, 0)).collect();
    let Some((value, source)) = of_axes.iter().min_by(|one, other| one.0.total_cmp(&other.0)) else { return };
    let differ = of_axes.iter().any(|(other, _)| other != value);
    let source = if differ { format!("{source}, the least of the axes") } else { source.clone() };
    draft.put_number(key, *value, Origin::Datum, &source, None);
}

/// The first spindle, where it is said whether feeds wait for it (MD35500; with MD35150 = 0 its speed counts as reached at once).
fn spindle(draft: &mut Draft<'_>) {
    for axis in draft.listing.axes() {
        let axis = [axis];
        let number = draft.listing.number(Scope::Axis, "SPIND_ASSIGN_TO_MACHAX", &axis, 0);
        let waits = draft.listing.number(Scope::Axis, "SPIND_ON_SPEED_AT_IPO_START", &axis, 0);
        let Some((waits, waits_source)) = waits.filter(|_| number.is_some_and(|(number, _)| number == 1.0)) else {
            continue;
        };
        let tolerance = draft.listing.number(Scope::Axis, "SPIND_DES_VELO_TOL", &axis, 0);
        let any_speed = tolerance.as_ref().is_some_and(|(tolerance, _)| *tolerance == 0.0);
        if waits == 0.0 || any_speed {
            let source = tolerance.as_ref().filter(|_| waits != 0.0).map_or(&waits_source, |(_, source)| source);
            draft.put_flag("spindle.feed_starts_at_once", true, Origin::Datum, source);
        }
        let highest = [("SPIND_VELO_LIMIT", 0), ("GEAR_STEP_MAX_VELO_LIMIT", 1)]
            .into_iter()
            .filter_map(|(name, place)| draft.listing.number(Scope::Axis, name, &axis, place))
            .min_by(|one, other| one.0.total_cmp(&other.0));
        if let Some((value, source)) = highest {
            draft.put_number("spindle.speed_max_rpm", value, Origin::Datum, &source, None);
        }
        let stages = [1, 0].into_iter();
        let acceleration = stages
            .filter_map(|stage| draft.listing.number(Scope::Axis, "GEAR_STEP_SPEEDCTRL_ACCEL", &axis, stage))
            .next();
        if let Some((value, source)) = acceleration {
            draft.put_number("spindle.acceleration_rot_s2", value, Origin::Datum, &source, None);
        }
        let scalars = [
            ("SPIND_DES_VELO_TOL", 0, "spindle.speed_tolerance"),
            ("SPIND_POSCTRL_VELO", 0, "spindle.positioning_speed_rpm"),
            ("GEAR_STEP_POSCTRL_ACCEL", 1, "spindle.positioning_acceleration_rot_s2"),
        ];
        for (name, place, key) in scalars.into_iter().skip(usize::from(any_speed)) {
            if let Some((value, source)) = draft.listing.number(Scope::Axis, name, &axis, place) {
                draft.put_number(key, value, Origin::Datum, &source, None);
            }
        }
        if let Some((flag, source)) = draft.listing.number(Scope::Axis, "SPIND_STOPPED_AT_IPO_START", &axis, 0) {
            draft.put_flag("spindle.feed_waits_for_stop", flag != 0.0, Origin::Datum, &source);
        }
    }
}

/// What belongs to one axis, its drive apart.
pub(super) fn axis(draft: &mut Draft<'_>, axis: &FoundAxis) {
    let datum =
        |draft: &mut Draft<'_>, name: &str, index: u32| draft.listing.number(Scope::Axis, name, &axis.theirs, index);
    let modulo = datum(draft, "ROT_IS_MODULO", 0);
    if let Some((flag, source)) = modulo.as_ref().filter(|_| axis.kind == AxisKind::Rotary) {
        draft.put_flag(&axis.key("modulo"), *flag != 0.0, Origin::Datum, source);
    }
    let is_modulo = axis.kind == AxisKind::Rotary && modulo.is_some_and(|(flag, _)| flag != 0.0);
    let limits = (datum(draft, "POS_LIMIT_MINUS", 0), datum(draft, "POS_LIMIT_PLUS", 0));
    if let (Some((low, source)), Some((high, _))) = limits
        && !is_modulo
        && low < high
        && low > -NO_TRAVEL_LIMIT
        && high < NO_TRAVEL_LIMIT
    {
        let key = axis.key(if axis.kind == AxisKind::Linear { "travel_mm" } else { "travel_deg" });
        let text = format!("[{}, {}]", write::number(low), write::number(high));
        draft.put(&key, text, Origin::Datum, format!("{source}, MD36110"));
        let home = axis.key(if axis.kind == AxisKind::Linear { "home_mm" } else { "home_deg" });
        if !(low..=high).contains(&0.0) {
            draft.put_number(
                &home,
                0.5 * (low + high),
                Origin::Assumed,
                "assumed: the middle of the travel, 0 is outside",
                None,
            );
        }
    }
    transmission(draft, axis);
    feedforward(draft, axis);
    modes(draft, axis);
    encoder(draft, axis);
}

fn transmission(draft: &mut Draft<'_>, axis: &FoundAxis) {
    let direction = draft.listing.number(Scope::Axis, "AX_MOTION_DIR", &axis.theirs, 0);
    let sign = if direction.is_some_and(|(direction, _)| direction < 0.0) { -1.0 } else { 1.0 };
    let motor = draft.listing.number(Scope::Axis, "DRIVE_AX_RATIO_NUMERA", &axis.theirs, 0);
    let load = draft.listing.number(Scope::Axis, "DRIVE_AX_RATIO_DENOM", &axis.theirs, 0);
    let gear_sign = if axis.kind == AxisKind::Rotary { sign } else { 1.0 };
    if let (Some((motor, source)), Some((load, _))) = (motor, load)
        && load != 0.0
    {
        draft.put_number(
            &axis.key("mechanics.gear_ratio"),
            gear_sign * motor / load,
            Origin::Datum,
            &format!("{source} / MD31050"),
            None,
        );
    }
    if axis.kind == AxisKind::Linear
        && let Some((pitch_mm, source)) = draft.listing.number(Scope::Axis, "LEADSCREW_PITCH", &axis.theirs, 0)
        && !draft.values.contains_key(&axis.key("mechanics.pinion_diameter_mm"))
    {
        draft.put_number(&axis.key("mechanics.pitch_mm"), sign * pitch_mm, Origin::Datum, &source, None);
    }
}

/// MD32620 and what hangs on it.
fn feedforward(draft: &mut Draft<'_>, axis: &FoundAxis) {
    let weight_key = axis.key("drive.torque_feedforward");
    let Some((mode, source)) = draft.listing.number(Scope::Axis, "FFW_MODE", &axis.theirs, 0) else {
        let hangs_on_it = ["AX_INERTIA", "AX_MASS", "EQUIV_SPEEDCTRL_TIME"];
        if hangs_on_it.iter().any(|name| draft.listing.spot(Scope::Axis, name, &axis.theirs, 0).is_some()) {
            draft.put_word(&axis.key("drive.feedforward_balancing"), "dead_time", Origin::Assumed, ASSUMED_MODE);
            inertia_and_delay(draft, axis, 1.0, "EQUIV_SPEEDCTRL_TIME");
        }
        return;
    };
    let torque = mode == 2.0 || mode == 4.0;
    if mode == 0.0 {
        draft.put_number(&axis.key("drive.velocity_feedforward"), 0.0, Origin::Datum, &source, None);
        draft.put_number(&weight_key, 0.0, Origin::Datum, &source, None);
        return;
    }
    let word = if mode >= 3.0 { "dead_time" } else { "pt1" };
    draft.put_word(&axis.key("drive.feedforward_balancing"), word, Origin::Datum, &source);
    let weight = if torque { 1.0 } else { 0.0 };
    // The control has no weight beside the inertia: a comment of ours may split their product.
    draft.put_number(&weight_key, weight, if torque { Origin::Derived } else { Origin::Datum }, &source, None);
    let weight = if torque { draft.number_of(&weight_key).filter(|weight| *weight > 0.0).unwrap_or(1.0) } else { 1.0 };
    inertia_and_delay(draft, axis, weight, if torque { "EQUIV_CURRCTRL_TIME" } else { "EQUIV_SPEEDCTRL_TIME" });
}

/// What the torque feed-forward is told, and the delay that holds in the mode. The other delay stays unused, and is listed so.
fn inertia_and_delay(draft: &mut Draft<'_>, axis: &FoundAxis, weight: f64, delay: &str) {
    for (name, key) in [("AX_INERTIA", "drive.feedforward_inertia_kg_m2"), ("AX_MASS", "drive.feedforward_mass_kg")] {
        if let Some((value, source)) = draft.listing.number(Scope::Axis, name, &axis.theirs, 0)
            && value > 0.0
        {
            draft.put_number(&axis.key(key), value / weight, Origin::Datum, &source, None);
        }
    }
    if let Some((time_s, source)) = draft.listing.number(Scope::Axis, delay, &axis.theirs, 0) {
        let spot = draft.listing.spot(Scope::Axis, "FFW_MODE", &axis.theirs, 0);
        let key = axis.key("drive.setpoint_delay_ms");
        draft.put_number(&key, Unit::Time.to_key(axis.kind, time_s), Origin::Datum, &source, spot.as_ref());
    }
}

/// Switches with what they switch.
fn modes(draft: &mut Draft<'_>, axis: &FoundAxis) {
    if let Some((flag, source)) = draft.listing.number(Scope::Axis, "STIFFNESS_CONTROL_ENABLE", &axis.theirs, 0) {
        draft.put_flag(&axis.key("drive.stiffness_control"), flag != 0.0, Origin::Datum, &source);
    }
    let enabled = draft.listing.number(Scope::Axis, "AX_JERK_ENABLE", &axis.theirs, 0);
    let mode = draft.listing.number(Scope::Axis, "AX_JERK_MODE", &axis.theirs, 0);
    let time = draft.listing.number(Scope::Axis, "AX_JERK_TIME", &axis.theirs, 0);
    if let Some((enabled, source)) = enabled {
        let word = mode.and_then(|(mode, _)| JERK_FILTERS.get((mode as usize).checked_sub(1)?).copied());
        // A time of 0 is a filter that does nothing: the control takes a time up to its position cycle so.
        let idle = word != Some("band_stop") && time.is_some_and(|(time_s, _)| time_s == 0.0);
        let word = if enabled == 0.0 || idle { "off" } else { word.unwrap_or("second_order") };
        draft.put_word(&axis.key("drive.jerk_filter"), word, Origin::Datum, &source);
    }
    let pulse = draft.listing.number(Scope::Axis, "FRICT_COMP_CONST_MAX", &axis.theirs, 0);
    let switch = draft.listing.number(Scope::Axis, "FRICT_COMP_ENABLE", &axis.theirs, 0);
    if let (Some((pulse, source)), Some((switch, _))) = (pulse, switch) {
        let key =
            if axis.kind == AxisKind::Linear { "friction_compensation_mm_s" } else { "friction_compensation_deg_s" };
        let value = if switch == 0.0 { 0.0 } else { Unit::Pulse.to_key(axis.kind, pulse) };
        draft.put_number(&axis.key(&format!("drive.{key}")), value, Origin::Datum, &source, None);
    }
    if let Some((flag, source)) = draft.listing.number(Scope::Axis, "FRICT_COMP_ADAPT_ENABLE", &axis.theirs, 0) {
        draft.put_flag(&axis.key("drive.friction_adaptation"), flag != 0.0, Origin::Datum, &source);
    }
    let nobody = [String::new()];
    let cycle = draft.listing.number(Scope::General, "POSCTRL_CYCLE_TIME", &nobody, 0).or_else(|| {
        let (clock_s, source) = draft.listing.number(Scope::General, "SYSCLOCK_CYCLE_TIME", &nobody, 0)?;
        let ratio = draft.listing.number(Scope::General, "POSCTRL_SYSCLOCK_TIME_RATIO", &nobody, 0);
        Some((clock_s * ratio.map_or(1.0, |(ratio, _)| ratio), format!("{source} times MD10060")))
    });
    if let Some((cycle_s, source)) = cycle {
        draft.put_number(&axis.key("drive.position_cycle_ms"), cycle_s * MS_PER_S, Origin::Derived, &source, None);
    }
}

/// The active position encoder: the second one, if there are two and it is direct.
fn encoder(draft: &mut Draft<'_>, axis: &FoundAxis) {
    let datum = |draft: &mut Draft<'_>, name: &str, index: u32| {
        draft.listing.number(Scope::Axis, name, &axis.theirs, index).map(|(value, _)| value)
    };
    let Some((count, source)) = draft.listing.number(Scope::Axis, "NUM_ENCS", &axis.theirs, 0) else { return };
    let direct: Vec<bool> =
        (0..2).map(|place| datum(draft, "ENC_IS_DIRECT", place).is_some_and(|flag| flag != 0.0)).collect();
    let place = u32::from(count >= 2.0 && direct.get(1) == Some(&true));
    let at_load = direct.get(place as usize) == Some(&true);
    let word = if at_load { "load" } else { "motor" };
    draft.put_word(&axis.key("encoder.position_source"), word, Origin::Datum, &format!("{source}, MD31040[{place}]"));
    let multiplier = datum(draft, "ENC_PULSE_MULT", place).unwrap_or(1.0);
    let scale = datum(draft, "ENC_IS_LINEAR", place).is_some_and(|flag| flag != 0.0);
    let lines = datum(draft, "ENC_RESOL", place);
    let grid_mm = datum(draft, "ENC_GRID_POINT_DIST", place);
    match (axis.kind, scale, at_load) {
        (AxisKind::Linear, true, true) => {
            if let Some(grid_mm) = grid_mm {
                let quantum_um = grid_mm * UM_PER_MM / multiplier;
                draft.put_number(
                    &axis.key("encoder.position_resolution_um"),
                    quantum_um,
                    Origin::Datum,
                    "MD31010 / MD31025",
                    None,
                );
            }
        }
        (AxisKind::Rotary, false, true) => {
            if let Some(lines) = lines.filter(|lines| *lines > 0.0) {
                let quantum_deg = write::TURN_DEG / (lines * multiplier);
                draft.put_number(
                    &axis.key("encoder.position_resolution_deg"),
                    quantum_deg,
                    Origin::Datum,
                    "MD31020, MD31025",
                    None,
                );
            }
        }
        _ => {}
    }
}

/// An axis without a speed controller has no drive: what data say about it is left out, and said once.
pub(super) fn finish(draft: &mut Draft<'_>, axes: &[FoundAxis]) {
    let mut ideal = Vec::new();
    for axis in axes {
        let base = draft
            .options
            .base
            .as_ref()
            .is_some_and(|(_, text)| write::flat(text).iter().any(|(key, _)| key.starts_with(&axis.key("drive."))));
        let has = ["drive.speed_gain_n_m_s_per_rad", "drive.speed_gain_n_s_per_m"]
            .iter()
            .any(|key| draft.values.contains_key(&axis.key(key)));
        if has || base {
            continue;
        }
        for table in ["drive.", "motor.", "mechanics.", "encoder."] {
            let start = axis.key(table);
            draft.values.retain(|key, _| !key.starts_with(&start));
        }
        ideal.push(axis.ours.as_str());
    }
    if !ideal.is_empty() {
        let message =
            format!("no drive parameters (p1460 and so on) for {}: ideal there (actual = set-point)", ideal.join(", "));
        let help = "import the drive parameters too, name their axis with --drive X=OBJECT, or take the drive of another machine with -m";
        draft.warnings.push(Diagnostic::warning("M0310", message).help(help));
    }
    // A fine window wider than the coarse one, or keys of the other motor, are for the checks of the file to say.
    for axis in axes {
        let linear_motor = draft.word_of(&axis.key("motor.kind")) == Some("linear");
        if linear_motor {
            for key in ["mechanics.pitch_mm", "mechanics.gear_ratio", "drive.feedforward_inertia_kg_m2"] {
                draft.values.remove(&axis.key(key));
            }
        } else {
            draft.values.remove(&axis.key("drive.feedforward_mass_kg"));
        }
    }
}

/// Values for required keys that nothing gave.
pub(super) fn assume(draft: &mut Draft<'_>, axes: &[FoundAxis]) {
    draft.put("format", "1".to_owned(), Origin::Datum, "version of the file format".to_owned());
    let options = draft.options;
    let name = options.name.as_ref().or(options.stand_in.as_ref()).map_or("imported machine", String::as_str);
    let origin = if draft.options.name.is_some() { Origin::Datum } else { Origin::Assumed };
    draft.put_word("name", name, origin, "name of the import");
    draft.put_word("control", "SINUMERIK", Origin::Assumed, "machine data are those of a SINUMERIK");
    let mut lacking = vec![("cycle.t_cyl_ms".to_owned(), 4.0)];
    for axis in axes {
        let (velocity, acceleration, jerk) = match axis.kind {
            AxisKind::Linear => (("velocity_max_m_min", 10.0), "acceleration_max_m_s2", "jerk_max_m_s3"),
            AxisKind::Rotary => (("velocity_max_rpm", 10.0), "acceleration_max_rot_s2", "jerk_max_rot_s3"),
        };
        lacking.extend([(axis.key(velocity.0), velocity.1), (axis.key(acceleration), 1.0), (axis.key(jerk), 20.0)]);
        let linear_motor = draft.word_of(&axis.key("motor.kind")) == Some("linear");
        if draft.values.keys().any(|key| key.starts_with(&axis.key("drive."))) {
            draft.put_flag(
                &axis.key("drive.identified"),
                false,
                Origin::Assumed,
                "data of the control, not of a trace",
            );
            lacking.extend(drive_stand_ins(axis, linear_motor));
        }
    }
    let of_mode = |axis: &FoundAxis| {
        let key = axis.key("drive.feedforward_balancing");
        let is_assumed = draft.values.get(&key).is_some_and(|sourced| sourced.source == ASSUMED_MODE);
        is_assumed.then(|| format!("{key} = dead_time (no MD32620: taken as 3)"))
    };
    let mut assumed: Vec<String> = axes.iter().filter_map(of_mode).collect();
    for (key, value) in lacking {
        let needed = key_row(&key).is_some_and(needed) || key.ends_with("gear_ratio") || key.ends_with("pitch_mm");
        if needed && !draft.values.contains_key(&key) {
            draft.put_number(&key, value, Origin::Assumed, "assumed: the data do not say", None);
            assumed.push(format!("{key} = {}", write::number(value)));
        }
    }
    if !assumed.is_empty() {
        let message = format!("assumed, because the data do not say: {}", assumed.join(", "));
        let help = "friction comes from a trace (`sollwert identify`), the rest from the motor's data sheet or another machine (-m)";
        draft.warnings.push(Diagnostic::warning("M0310", message).help(help));
    }
    debug_assert!(draft.values.keys().all(|key| table_and_key(key).is_some()));
}

fn needed(row: &Key) -> bool {
    row.absent == Absent::Required
}

/// Stand-ins of a drive: no friction, which no machine datum holds, and middling values of the class for the rest.
fn drive_stand_ins(axis: &FoundAxis, linear_motor: bool) -> Vec<(String, f64)> {
    let motor = if linear_motor { MotorKind::Linear } else { MotorKind::Rotary };
    let stand_ins = [
        ("drive.position_cycle_ms", 2.0),
        ("drive.speed_cycle_us", 125.0),
        ("drive.current_cycle_us", 125.0),
        ("drive.position_gain_per_s", 50.0),
        ("drive.speed_reset_time_ms", 10.0),
        ("drive.current_gain_v_per_a", 20.0),
        ("drive.current_reset_time_ms", 2.0),
        ("drive.current_max_a", 40.0),
        ("drive.voltage_max_v", 245.0),
        ("motor.resistance_ohm", 0.5),
        ("motor.inductance_mh", 5.0),
        ("motor.back_emf_v_s_per_rad", 0.5),
        ("motor.torque_constant_n_m_per_a", 1.5),
        ("motor.back_emf_v_s_per_m", 30.0),
        ("motor.force_constant_n_per_a", 90.0),
        ("mechanics.inertia_kg_m2", 0.01),
        ("mechanics.mass_kg", 100.0),
        ("mechanics.viscous_friction_n_m_s_per_rad", 0.0),
        ("mechanics.coulomb_friction_n_m", 0.0),
        ("mechanics.viscous_friction_n_s_per_m", 0.0),
        ("mechanics.coulomb_friction_n", 0.0),
        ("mechanics.gear_ratio", 1.0),
        ("mechanics.pitch_mm", 10.0),
    ];
    let fits = |key: &str| {
        let row = key_row(&axis.key(key));
        row.is_some_and(|row| row.fits(Some(axis.kind), Some(motor)))
            && !(axis.kind == AxisKind::Rotary && key.ends_with("pitch_mm"))
            && !(linear_motor && (key.ends_with("gear_ratio") || key.ends_with("pitch_mm")))
    };
    stand_ins.into_iter().filter(|(key, _)| fits(key)).map(|(key, value)| (axis.key(key), value)).collect()
}
