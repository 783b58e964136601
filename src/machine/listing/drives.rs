//! Drive parameters: which drive object moves which axis, and what its parameters are as keys.
//!
//! In: the drive objects of the listing (members `PS0000nn` of an archive, sections of a file). Out: keys of `drive`, `motor`,
//! `mechanics`. An object belongs to the axis that the user or a comment names, else to the one whose name its own name (p0199) holds:
//! `AXX_00` is X, `SERVO_Y1` is Y. Data set 0 counts. Inertia: p0341 p0342 + p1498; where p1498 is 0 the control has not been told the
//! load, and MD32650, if larger, is the better guess; so it is where p0341 is missing.

use super::axes::FoundAxis;
use super::data::{DriveObject, Scope};
use super::import::{Draft, Origin};
use super::rows::{CURRENT_FILTER_TYPES, PARAMETERS};
use super::write;
use crate::base::units::{RAD_PER_REV, S_PER_MIN, rad_s_from_rpm};
use crate::base::{AxisKind, Diagnostic};

/// Beginnings of names of drive objects, longest first.
const BEGINNINGS: [&str; 8] = ["ACHSE_", "SERVO_", "DRIVE_", "ACHSE", "SERVO", "DRIVE", "AX_", "AX"];
/// p0317 is for this speed.
const VOLTAGE_CONSTANT_RPM: f64 = 1000.0;
/// p0210 up to here is the voltage of the mains, above the DC link.
const MAINS_MAX_V: f64 = 500.0;
/// DC link behind a rectifier, over the mains.
const RECTIFIED_RATIO: f64 = 1.35;
/// Words of p1415 and, from 1, of the types of the current filters.
pub(super) const FILTER_SHAPES: [&str; 3] = ["pt1", "pt2", "second_order"];

/// Attaches and reads them all.
pub(super) fn all(draft: &mut Draft<'_>, axes: &[FoundAxis]) {
    let mut objects = std::mem::take(&mut draft.listing.drives);
    let mut left = Vec::new();
    for object in &mut objects {
        if !object.moves() {
            continue;
        }
        match axis_of(draft, object, axes) {
            Some(axis) => read(draft, axis, object),
            None => left.push(format!("{} {}", object.file.rsplit('/').next().unwrap_or_default(), object.name())),
        }
    }
    if !left.is_empty() {
        let message = format!("drives that belong to no axis of the machine by their name: {}", left.join(", "));
        draft
            .warnings
            .push(Diagnostic::note("M0311", message).help("--drive X=OBJECT attaches one, by its name or its member"));
    }
    draft.listing.drives = objects;
}

fn axis_of<'a>(draft: &mut Draft<'_>, object: &DriveObject, axes: &'a [FoundAxis]) -> Option<&'a FoundAxis> {
    let (name, file) = (object.name().to_ascii_uppercase(), object.file.to_ascii_uppercase());
    let chosen = draft.options.drives.iter().find(|choice| {
        let theirs = choice.theirs.to_ascii_uppercase();
        name == theirs || file.rsplit('/').next().is_some_and(|member| member.contains(&theirs))
    });
    if let Some(choice) = chosen {
        return axes.iter().find(|axis| axis.ours.eq_ignore_ascii_case(&choice.ours));
    }
    if draft.options.drives.iter().any(|choice| choice.ours.eq_ignore_ascii_case(&name)) {
        return None;
    }
    if let Some(module) = object.module {
        // MD30110 names the drive of an axis; without it drives have the numbers of their axes.
        return axes.iter().find(|axis| {
            let output = draft.listing.number(Scope::Axis, "CTRLOUT_MODULE_NR", &axis.theirs, 0);
            output.map_or(axis.number, |(number, _)| number as u32) == module
        });
    }
    let wanted = object.axis.clone().unwrap_or_else(|| bare(&name).to_owned());
    axes.iter().find(|axis| {
        let taken = draft.options.drives.iter().any(|choice| choice.ours.eq_ignore_ascii_case(&axis.ours));
        !taken
            && (axis.ours.eq_ignore_ascii_case(&wanted)
                || axis.theirs.iter().any(|theirs| theirs.eq_ignore_ascii_case(&wanted)))
    })
}

/// Without the beginning that all drives have, and without a number at the end.
fn bare(name: &str) -> &str {
    let rest = BEGINNINGS.iter().find_map(|beginning| name.strip_prefix(beginning)).unwrap_or(name);
    match rest.rsplit_once('_') {
        Some((first, digits)) if !first.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit()) => first,
        _ => rest,
    }
}

fn read(draft: &mut Draft<'_>, axis: &FoundAxis, object: &mut DriveObject) {
    let linear_motor = object.take(300, 0).is_some_and(|(code, _)| code == 4.0 || (400.0..500.0).contains(&code));
    draft.put_word(&axis.key("motor.kind"), if linear_motor { "linear" } else { "rotary" }, Origin::Datum, "p0300");
    for parameter in PARAMETERS {
        if let Some((value, source)) = object.take(parameter.number, parameter.index) {
            let spot = object.parameters.get(&(parameter.number, parameter.index)).map(|datum| datum.spot.clone());
            // p1462 = 0 and p1717 = 0 switch the integral part off.
            let off = value == 0.0 && matches!(parameter.number, 1462 | 1717);
            let value = if off { f64::INFINITY } else { value };
            draft.put_number(&axis.key(parameter.key(linear_motor)), value, Origin::Datum, &source, spot.as_ref());
        }
    }
    motor(draft, axis, object, linear_motor);
    inertia(draft, axis, object, linear_motor);
    filters(draft, axis, object);
    speed_limit(draft, axis, object, linear_motor);
    if object.take(180, 0).is_some_and(|(sets, _)| sets > 1.0) {
        let message = format!("{}: the drive has several data sets (p0180), the first is taken", axis.ours);
        draft.warnings.push(Diagnostic::note("M0311", message));
    }
}

fn motor(draft: &mut Draft<'_>, axis: &FoundAxis, object: &mut DriveObject, linear_motor: bool) {
    if let Some((constant, source)) = object.take(317, 0) {
        // Line-to-line rms at 1000 rpm, or at 1 m/s.
        let per_phase = constant / 3.0_f64.sqrt();
        let (key, value) = match linear_motor {
            true => ("motor.back_emf_v_s_per_m", per_phase),
            false => ("motor.back_emf_v_s_per_rad", per_phase / rad_s_from_rpm(VOLTAGE_CONSTANT_RPM)),
        };
        draft.put_number(&axis.key(key), value, Origin::Datum, &source, None);
    }
    if let Some((supply_v, source)) = object.take(210, 0) {
        let link_v = if supply_v <= MAINS_MAX_V { RECTIFIED_RATIO * supply_v } else { supply_v };
        let source = format!("{source}: DC link / sqrt 6");
        draft.put_number(&axis.key("drive.voltage_max_v"), link_v / 6.0_f64.sqrt(), Origin::Derived, &source, None);
    }
}

fn inertia(draft: &mut Draft<'_>, axis: &FoundAxis, object: &mut DriveObject, linear_motor: bool) {
    let motor = object.take(341, 0).map(|(value, _)| value);
    let ratio = object.take(342, 0).map_or(1.0, |(value, _)| value);
    let load = object.take(1498, 0).map_or(0.0, |(value, _)| value);
    let (key, name) = match linear_motor {
        true => ("mechanics.mass_kg", "AX_MASS"),
        false => ("mechanics.inertia_kg_m2", "AX_INERTIA"),
    };
    let whole = draft.listing.number(Scope::Axis, name, &axis.theirs, 0);
    let Some(motor) = motor else {
        // The control has been told the whole; of the load alone it is at least known that there is no less.
        let told = whole.filter(|(whole, _)| *whole > load);
        let load = (load > 0.0).then(|| (load, "p1498, the load alone: no p0341".to_owned()));
        if let Some((value, source)) = told.or(load) {
            draft.put_number(&axis.key(key), value, Origin::Derived, &source, None);
        }
        return;
    };
    let of_drive = motor * ratio + load;
    match whole {
        Some((whole, source)) if load == 0.0 && whole > of_drive => {
            let source = format!("{source}; p0341 p0342 = {} is the motor alone", write::number(of_drive));
            draft.put_number(&axis.key(key), whole, Origin::Derived, &source, None);
        }
        _ => {
            let origin = if load > 0.0 { Origin::Datum } else { Origin::Derived };
            draft.put_number(&axis.key(key), of_drive, origin, "p0341 p0342 + p1498", None);
        }
    }
}

fn filters(draft: &mut Draft<'_>, axis: &FoundAxis, object: &mut DriveObject) {
    let shape = |number: f64, first: f64| FILTER_SHAPES.get((number - first) as usize).copied();
    if let Some((active, source)) = object.take(1414, 0) {
        let kind = object.take(1415, 0).map_or(0.0, |(kind, _)| kind);
        let on = active as u32 & 1 == 1;
        // p1416 is a time in ms where the filter is a PT1.
        let pt1_time = object.take(1416, 0);
        if kind == 0.0
            && on
            && let Some((time_ms, source)) = pt1_time.filter(|(time_ms, _)| *time_ms > 0.0)
        {
            let frequency_hz = crate::base::units::MS_PER_S / (RAD_PER_REV * time_ms);
            draft.put_number(&axis.key("drive.speed_filter_frequency_hz"), frequency_hz, Origin::Datum, &source, None);
        }
        let word = if on { shape(kind, 0.0) } else { None };
        draft.put_word(&axis.key("drive.speed_filter"), word.unwrap_or("off"), Origin::Datum, &source);
    }
    if let Some((active, source)) = object.take(1656, 0) {
        for (bit, (number, key)) in CURRENT_FILTER_TYPES.iter().enumerate() {
            let kind = object.take(*number, 0).map_or(1.0, |(kind, _)| kind);
            let on = active as u32 >> bit & 1 == 1;
            let word = if on { shape(kind, 0.0) } else { None };
            draft.put_word(&axis.key(key), word.unwrap_or("off"), Origin::Datum, &source);
        }
    }
}

/// p1082 in rpm of the motor, or in m/min of a linear one, on the load side.
fn speed_limit(draft: &mut Draft<'_>, axis: &FoundAxis, object: &mut DriveObject, linear_motor: bool) {
    let Some((limit, source)) = object.take(1082, 0) else { return };
    let per_s = limit / S_PER_MIN;
    let gear = draft.number_of(&axis.key("mechanics.gear_ratio")).unwrap_or(1.0).abs();
    let (key, value) = match (axis.kind, linear_motor) {
        (AxisKind::Rotary, _) => ("drive.speed_setpoint_max_deg_s", Some(per_s * write::TURN_DEG / gear)),
        (AxisKind::Linear, true) => ("drive.speed_setpoint_max_mm_s", Some(per_s * crate::base::units::MM_PER_M)),
        (AxisKind::Linear, false) => {
            let pitch_mm = draft.number_of(&axis.key("mechanics.pitch_mm"));
            ("drive.speed_setpoint_max_mm_s", pitch_mm.map(|pitch_mm| per_s * pitch_mm.abs() / gear))
        }
    };
    if let Some(value) = value {
        draft.put_number(&axis.key(key), value, Origin::Datum, &source, None);
    }
}
