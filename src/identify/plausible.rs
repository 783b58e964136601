//! Whether a trace can be of this axis, in the units that it says.
//!
//! In: a record, the axis with its drive; what was found. Out: what cannot be, in words, or `None`; values that rest on it are refused. A speed, a current or an inertia far beyond
//! what the machine file allows is another axis, another machine, or a unit that is not the one named: an inch for a millimetre is a factor of 25.4, a milliampere
//! for an ampere 1000. Does not correct anything: which of them it is only a person knows.

use super::record::AxisRecord;
use super::wire::{AxisResult, Estimate, Parameter};
use crate::base::units::{deg_from_rad, mm_from_inch, mm_min_from_mm_s};
use crate::base::{AxisKind, Diagnostic};
use crate::machine::{Axis, DriveData, DynamicsMode};
use crate::trace::{Signal, Trace};

/// Beyond this many times what the machine file allows, no tolerance of a machine file is meant. Every unit that is taken for another is further off.
const FAR_RATIO: f64 = 3.0;
/// Torque for the highest acceleration over that of the current limit: a drive has some of it left for friction, and no axis is laid out for more than it can do.
const TORQUE_RATIO: f64 = 1.5;
/// Weight of a feed-forward that no control has: 1 is all of the speed.
const WEIGHT_MAX_RATIO: f64 = 2.0;
/// Way over which a speed is the mean: the quantum of a scale over one cycle is a speed, too.
const SPEED_S: f64 = 0.02;
/// A ratio this near to that of an inch is said to be one.
const INCH_SHARE: f64 = 0.1;

/// What to do.
pub(super) const UNITS: &str = "check that the trace is of this axis (--axis-name), in mm or deg, s, A and N m (a row of units, or --map, tells others), and that -m is its machine";

/// A signal of lengths in the unit of the other kind of axis: its numbers mean something else.
pub(super) fn other_kind(trace: &Trace, signal: &Signal, axis: &Axis) -> Option<Diagnostic> {
    let is_angle = signal.unit.starts_with("deg");
    let is_way = signal.unit.starts_with("mm");
    let (kind, right) = match axis.kind {
        AxisKind::Linear if is_angle => ("linear", "mm"),
        AxisKind::Rotary if is_way => ("rotary", "deg"),
        _ => return None,
    };
    let [name, original, unit] = [&trace.name, &signal.original, &signal.unit];
    let message = format!("`{name}`: `{original}` is in {unit}, and {} is a {kind} axis of this machine", axis.name);
    let help = format!(
        "if the numbers are in {right}, name the column so (--map); else give the axis its name (--axis-name) or the machine of the trace (-m)"
    );
    Some(Diagnostic::error("T0209", message).help(help))
}

/// What a record contradicts.
pub(super) fn contradiction(record: &AxisRecord, axis: &Axis, data: &DriveData) -> Option<String> {
    too_fast(record, axis).or_else(|| too_much_current(record, data))
}

fn too_fast(record: &AxisRecord, axis: &Axis) -> Option<String> {
    let rows = ((SPEED_S / record.period_s).ceil() as usize).max(1);
    let positions = record.setpoint_lu.as_ref().or(record.position_lu.as_ref())?;
    let ways = positions.iter().zip(positions.get(rows..)?).map(|(from, to)| (to - from).abs());
    let speed_lu_s = ways.filter(|way| way.is_finite()).fold(0.0, f64::max) / (rows as f64 * record.period_s);
    let modes = DynamicsMode::ALL.iter().filter_map(|mode| axis.dynamics.get(*mode));
    let allowed_lu_s = modes.map(|limits| limits.velocity_max_lu_s).fold(axis.limits.velocity_max_lu_s, f64::max);
    (speed_lu_s > FAR_RATIO * allowed_lu_s).then(|| {
        let (unit, of): (_, fn(f64) -> f64) = match axis.kind {
            AxisKind::Linear => ("mm/min", mm_min_from_mm_s),
            AxisKind::Rotary => ("deg/s", deg_from_rad),
        };
        let [traced, allowed] = [speed_lu_s, allowed_lu_s].map(of);
        format!("the trace moves {} at {traced:.0} {unit}, the machine file allows {allowed:.0} {unit}", axis.name)
    })
}

fn too_much_current(record: &AxisRecord, data: &DriveData) -> Option<String> {
    let kt = data.motor.torque_constant_n_m_per_a;
    let torques = record.torque.as_ref()?.values_n_m.iter().copied();
    let current_a =
        torques.filter(|torque| torque.is_finite()).fold(0.0_f64, |most, torque| most.max(torque.abs())) / kt;
    (current_a > FAR_RATIO * data.current_max_a).then(|| {
        format!("the trace has {current_a:.0} A, the drive of the machine file at most {:.0} A", data.current_max_a)
    })
}

/// An inertia with which the motor could not reach the acceleration of its axis.
pub(super) fn too_heavy(inertia_kg_m2: Option<f64>, axis: &Axis, data: &DriveData) -> Option<String> {
    let inertia_kg_m2 = inertia_kg_m2?;
    let acceleration_rad_s2 = axis.limits.acceleration_max_lu_s2 / data.mechanics.transmission_lu_per_rad.abs();
    let most_n_m = data.motor.torque_constant_n_m_per_a * data.current_max_a;
    let torque_n_m = inertia_kg_m2 * acceleration_rad_s2;
    (torque_n_m > TORQUE_RATIO * most_n_m).then(|| {
        let ratio = inertia_kg_m2 / data.mechanics.inertia_kg_m2;
        let inch = if (ratio / mm_from_inch(1.0) - 1.0).abs() < INCH_SHARE { ", as inches taken for mm make it" } else { "" };
        format!(
            "the inertia would be {inertia_kg_m2:.3e}, {ratio:.3} times that of the machine file{inch}: the acceleration of the axis would take {torque_n_m:.0} N m of a motor with {most_n_m:.0} N m"
        )
    })
}

/// A weight of the feed-forward that cannot be: speeds and positions of the trace are not in the units that they say.
pub(super) fn controllers(estimates: &mut Vec<Estimate>, result: &mut AxisResult) {
    let weight = estimates.iter().find(|estimate| estimate.parameter == Parameter::VelocityFeedforward);
    let Some(weight) = weight.map(|weight| weight.value).filter(|weight| weight.abs() > WEIGHT_MAX_RATIO) else {
        return;
    };
    let reason = format!(
        "the velocity feed-forward would be {weight:.3} times the speed of the set-point: positions and speeds of this trace are not in the units that they say"
    );
    for parameter in [Parameter::VelocityFeedforward, Parameter::PositionGain, Parameter::FeedforwardDelay] {
        estimates.retain(|estimate| estimate.parameter != parameter);
        result.refuse(parameter, reason.as_str(), UNITS);
    }
}
