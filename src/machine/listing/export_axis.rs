//! Machine data of an axis, and its drive parameters.
//!
//! In: the keys of the axis. Out: lines of a listing. The counterpart of `scalar`, `special` and `drives`.

use super::data::Scope;
use super::drives::FILTER_SHAPES;
use super::export::{Keys, OutAxis, assignment, number};
use super::rows::{CURRENT_FILTER_TYPES, DYNAMICS_ROWS, DYNAMICS_SETS, PARAMETERS, ROWS, Unit};
use super::special::{JERK_FILTERS, NO_TRAVEL_LIMIT};
use super::write::TURN_DEG;
use crate::base::AxisKind;
use crate::base::units::{MM_PER_M, S_PER_MIN, rad_s_from_rpm, s_from_ms};

/// Largest numerator and denominator of a gear.
const GEAR_MAX: f64 = 100_000.0;

/// `$MA_...`.
pub(super) fn axis_lines(lines: &mut Vec<String>, keys: &Keys, axis: &OutAxis<'_>) {
    let id = &axis.id;
    let rotary = axis.kind == AxisKind::Rotary;
    lines.push(format!("N30300 $MA_IS_ROT_AX[{id}]={}", u8::from(rotary)));
    if let Some(modulo) = keys.flag(&axis.key("modulo")) {
        lines.push(format!("N30310 $MA_ROT_IS_MODULO[{id}]={}", u8::from(modulo)));
    }
    transmission(lines, keys, axis);
    for row in ROWS.iter().filter(|row| row.scope == Scope::Axis) {
        if let Some(value) = keys.number(&axis.key(row.key(axis.kind))) {
            lines.push(assignment(row, id, row.unit.to_datum(axis.kind, value)));
        }
    }
    dynamics(lines, keys, axis);
    if let Some(factor) = keys.number("feed.overload_factor") {
        lines.push(format!("N32310 $MA_MAX_ACCEL_OVL_FACTOR[0,{id}]={}", number(factor)));
    }
    if let Some(tolerance) = keys.number("smoothing.transition_tolerance_mm").filter(|_| !rotary) {
        lines.push(format!("N33120 $MA_PATH_TRANS_POS_TOL[{id}]={}", number(tolerance)));
    }
    if let Some(word) = keys.word("cycle.fine_interpolation") {
        lines.push(format!("N33000 $MA_FIPO_TYPE[{id}]={}", if word == "linear" { 1 } else { 2 }));
    }
    feedforward(lines, keys, axis);
    modes(lines, keys, axis);
    travel(lines, keys, axis);
}

fn transmission(lines: &mut Vec<String>, keys: &Keys, axis: &OutAxis<'_>) {
    let id = &axis.id;
    let pitch = keys.number(&axis.key("mechanics.pitch_mm"));
    let gear = keys.number(&axis.key("mechanics.gear_ratio"));
    if let Some(pitch) = pitch {
        lines.push(format!("N31030 $MA_LEADSCREW_PITCH[{id}]={}", number(pitch.abs())));
    }
    if let Some((motor, load)) = gear.and_then(|gear| fraction(gear.abs())) {
        lines.push(format!("N31050 $MA_DRIVE_AX_RATIO_DENOM[0,{id}]={load}"));
        lines.push(format!("N31060 $MA_DRIVE_AX_RATIO_NUMERA[0,{id}]={motor}"));
    }
    if pitch.unwrap_or(1.0) * gear.unwrap_or(1.0) < 0.0 {
        lines.push(format!("N32100 $MA_AX_MOTION_DIR[{id}]=-1"));
    }
}

/// The quotient of two whole numbers that is the ratio to the last bit, if there is one: continued fractions.
fn fraction(ratio: f64) -> Option<(u32, u32)> {
    let (mut numerators, mut denominators) = ((1.0, ratio.floor()), (0.0, 1.0));
    let mut rest = ratio - ratio.floor();
    for _ in 0..40 {
        let (numerator, denominator) = (numerators.1, denominators.1);
        if numerator > GEAR_MAX || denominator > GEAR_MAX {
            return None;
        }
        if numerator / denominator == ratio {
            return (numerator >= 1.0).then_some((numerator as u32, denominator as u32));
        }
        if rest <= 0.0 {
            return None;
        }
        let turned = 1.0 / rest;
        let whole = turned.floor();
        rest = turned - whole;
        numerators = (numerators.1, whole * numerators.1 + numerators.0);
        denominators = (denominators.1, whole * denominators.1 + denominators.0);
    }
    None
}

fn dynamics(lines: &mut Vec<String>, keys: &Keys, axis: &OutAxis<'_>) {
    for (number_of_datum, name, linear, rotary) in DYNAMICS_ROWS {
        let key = if axis.kind == AxisKind::Linear { linear } else { rotary };
        let of_axis = keys.number(&axis.key(key));
        for (index, set) in DYNAMICS_SETS {
            let in_set = |key: &str| keys.number(&axis.key(&format!("dynamics.{set}.{key}")));
            // Without a transition jerk of its own a set has its jerk there too.
            let jerk = if axis.kind == AxisKind::Linear { DYNAMICS_ROWS[1].2 } else { DYNAMICS_ROWS[1].3 };
            let of_set = in_set(key).or_else(|| in_set(jerk).filter(|_| name == DYNAMICS_ROWS[2].1));
            if let Some(value) = of_set.or(of_axis) {
                lines.push(format!("N{number_of_datum} $MA_{name}[{index},{}]={}", axis.id, number(value)));
            }
        }
    }
}

fn feedforward(lines: &mut Vec<String>, keys: &Keys, axis: &OutAxis<'_>) {
    let id = &axis.id;
    let drive = |key: &str| keys.number(&axis.key(&format!("drive.{key}")));
    let (velocity, torque) = (drive("velocity_feedforward"), drive("torque_feedforward").unwrap_or(0.0));
    if velocity.is_none() && torque == 0.0 {
        return;
    }
    let pt1 = keys.word(&axis.key("drive.feedforward_balancing")) == Some("pt1");
    let mode = match (torque > 0.0, velocity.unwrap_or(1.0) > 0.0, pt1) {
        (true, _, false) => 4,
        (true, _, true) => 2,
        (false, true, false) => 3,
        (false, true, true) => 1,
        (false, false, _) => 0,
    };
    lines.push(format!("N32620 $MA_FFW_MODE[{id}]={mode}"));
    let weight = if torque > 0.0 { torque } else { 1.0 };
    // Without the key the feed-forward works with the whole inertia; the control has to be told.
    let whole = keys.number(&axis.key("mechanics.inertia_kg_m2")).filter(|_| torque > 0.0);
    if let Some(inertia) = drive("feedforward_inertia_kg_m2").or(whole) {
        lines.push(format!("N32650 $MA_AX_INERTIA[{id}]={}", product(inertia, weight)));
    }
    if let Some(mass) = drive("feedforward_mass_kg") {
        lines.push(format!("N32652 $MA_AX_MASS[{id}]={}", product(mass, weight)));
    }
    if let Some(delay_ms) = drive("setpoint_delay_ms") {
        let (datum, name) = match torque > 0.0 {
            true => (32800, "EQUIV_CURRCTRL_TIME"),
            false => (32810, "EQUIV_SPEEDCTRL_TIME"),
        };
        lines.push(format!("N{datum} $MA_{name}[0,{id}]={}", number(s_from_ms(delay_ms))));
    }
}

/// A product without the digits that only rounding made.
fn product(value: f64, weight: f64) -> String {
    let exact = value * weight;
    number(format!("{exact:.11e}").parse().unwrap_or(exact))
}

/// MD32610 and what belongs to it, and the pulse of friction compensation.
pub(super) fn feedforward_lines(lines: &mut Vec<String>, keys: &Keys, axis: &OutAxis<'_>) {
    if let Some(row) = ROWS.iter().find(|row| row.number == 32610)
        && let Some(weight) = keys.number(&axis.key(row.key(axis.kind)))
    {
        lines.push(assignment(row, &axis.id, weight));
    }
    feedforward(lines, keys, axis);
    pulse(lines, keys, axis);
    if let Some(row) = ROWS.iter().find(|row| row.number == 32540)
        && let Some(time_ms) = keys.number(&axis.key(row.key(axis.kind)))
    {
        lines.push(assignment(row, &axis.id, row.unit.to_datum(axis.kind, time_ms)));
    }
}

fn modes(lines: &mut Vec<String>, keys: &Keys, axis: &OutAxis<'_>) {
    let id = &axis.id;
    if let Some(flag) = keys.flag(&axis.key("drive.stiffness_control")) {
        lines.push(format!("N32640 $MA_STIFFNESS_CONTROL_ENABLE[0,{id}]={}", u8::from(flag)));
    }
    if let Some(word) = keys.word(&axis.key("drive.jerk_filter")) {
        let mode = JERK_FILTERS.iter().position(|known| *known == word);
        lines.push(format!("N32400 $MA_AX_JERK_ENABLE[{id}]={}", u8::from(mode.is_some())));
        if let Some(place) = mode {
            lines.push(format!("N32402 $MA_AX_JERK_MODE[{id}]={}", place + 1));
        }
    }
    pulse(lines, keys, axis);
}

fn pulse(lines: &mut Vec<String>, keys: &Keys, axis: &OutAxis<'_>) {
    let id = &axis.id;
    let pulse =
        if axis.kind == AxisKind::Linear { "friction_compensation_mm_s" } else { "friction_compensation_deg_s" };
    if let Some(value) = keys.number(&axis.key(&format!("drive.{pulse}"))) {
        lines.push(format!("N32500 $MA_FRICT_COMP_ENABLE[{id}]={}", u8::from(value != 0.0)));
        lines.push(format!(
            "N32520 $MA_FRICT_COMP_CONST_MAX[0,{id}]={}",
            number(Unit::Pulse.to_datum(axis.kind, value))
        ));
    }
    if let Some(flag) = keys.flag(&axis.key("drive.friction_adaptation")) {
        lines.push(format!("N32510 $MA_FRICT_COMP_ADAPT_ENABLE[0,{id}]={}", u8::from(flag)));
    }
}

fn travel(lines: &mut Vec<String>, keys: &Keys, axis: &OutAxis<'_>) {
    let key = if axis.kind == AxisKind::Linear { "travel_mm" } else { "travel_deg" };
    let ends: Vec<f64> = keys
        .text(&axis.key(key))
        .map(|text| text.trim_matches(['[', ']']).split(',').filter_map(|end| end.trim().parse().ok()).collect())
        .unwrap_or_default();
    let (low, high) = match ends.as_slice() {
        [low, high] => (*low, *high),
        _ => (-NO_TRAVEL_LIMIT - 1.0, NO_TRAVEL_LIMIT + 1.0),
    };
    lines.push(format!("N36100 $MA_POS_LIMIT_MINUS[{}]={}", axis.id, number(low)));
    lines.push(format!("N36110 $MA_POS_LIMIT_PLUS[{}]={}", axis.id, number(high)));
}

/// `p1460[0]=5`.
pub(super) fn drive_lines(lines: &mut Vec<String>, keys: &Keys, axis: &OutAxis<'_>) {
    let linear_motor = keys.word(&axis.key("motor.kind")) == Some("linear");
    let of_axis = |key: &str| keys.number(&axis.key(key));
    let mut parameters: Vec<(u32, u32, f64)> = vec![(300, 0, if linear_motor { 4.0 } else { 2.0 })];
    for parameter in PARAMETERS {
        if let Some(value) = of_axis(parameter.key(linear_motor)) {
            // No integral part is a reset time of 0.
            parameters.push((parameter.number, parameter.index, if value.is_infinite() { 0.0 } else { value }));
        }
    }
    let root_of_3 = 3.0_f64.sqrt();
    let back_emf = match linear_motor {
        true => of_axis("motor.back_emf_v_s_per_m").map(|value| value * root_of_3),
        false => of_axis("motor.back_emf_v_s_per_rad").map(|value| value * root_of_3 * rad_s_from_rpm(1000.0)),
    };
    parameters.extend(back_emf.map(|value| (317, 0, value)));
    let voltage = of_axis("drive.voltage_max_v").filter(|value| value.is_finite());
    parameters.extend(voltage.map(|value| (210, 0, value * 6.0_f64.sqrt())));
    if let Some(inertia) = of_axis(if linear_motor { "mechanics.mass_kg" } else { "mechanics.inertia_kg_m2" }) {
        parameters.extend([(341, 0, inertia), (342, 0, 1.0), (1498, 0, 0.0)]);
    }
    parameters.extend(speed_limit(keys, axis, linear_motor).map(|value| (1082, 0, value)));
    filters(keys, axis, &mut parameters);
    parameters.sort_by_key(|(number, index, _)| (*number, *index));
    lines.extend(parameters.iter().map(|(name, index, value)| format!("p{name:04}[{index}]={}", number(*value))));
}

fn speed_limit(keys: &Keys, axis: &OutAxis<'_>, linear_motor: bool) -> Option<f64> {
    let gear = keys.number(&axis.key("mechanics.gear_ratio")).unwrap_or(1.0).abs();
    let rotary = keys.number(&axis.key("drive.speed_setpoint_max_deg_s")).map(|value| value * gear / TURN_DEG);
    let linear = keys.number(&axis.key("drive.speed_setpoint_max_mm_s")).and_then(|value| match linear_motor {
        true => Some(value / MM_PER_M),
        false => keys.number(&axis.key("mechanics.pitch_mm")).map(|pitch_mm| value * gear / pitch_mm.abs()),
    });
    rotary.or(linear).filter(|value| value.is_finite()).map(|per_s| per_s * S_PER_MIN)
}

fn filters(keys: &Keys, axis: &OutAxis<'_>, parameters: &mut Vec<(u32, u32, f64)>) {
    let kind = |key: &str| {
        let word = keys.word(&axis.key(key))?;
        Some(FILTER_SHAPES.iter().position(|known| *known == word).map(|place| place as f64))
    };
    if let Some(kind) = kind("drive.speed_filter") {
        parameters.push((1414, 0, if kind.is_some() { 1.0 } else { 0.0 }));
        parameters.extend(kind.map(|kind| (1415, 0, kind)));
    }
    let mut active = None;
    for (bit, (number, key)) in CURRENT_FILTER_TYPES.iter().enumerate() {
        if let Some(kind) = kind(key) {
            *active.get_or_insert(0) |= u32::from(kind.is_some()) << bit;
            parameters.extend(kind.map(|kind| (*number, 0, kind)));
        }
    }
    parameters.extend(active.map(|bits| (1656, 0, f64::from(bits))));
}
