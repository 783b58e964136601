//! Whether the set-points that `follow` is given keep to the limits of their axes.
//!
//! In: every set-point of an axis with its backward differences. Out: bits of `monitoring` for the row, and one warning an axis: what was exceeded, by how
//! much, how often, from when on. Stops nothing: a table may be anything, and the drives show what they make of it. Does not know paths.

use crate::base::units::deg_from_rad;
use crate::base::{AxisId, AxisKind, Diagnostic, PerAxis};
use crate::drive::monitoring;
use crate::interpolator::AxisSetpoint;
use crate::machine::{Axis, Machine};

/// What is more than its limit only by this share is rounding of the table.
const ROUNDING_SHARE: f64 = 1e-3;

/// Velocity, acceleration, jerk, travel.
const QUANTITIES: usize = 4;

/// Their bits in `monitoring`.
const BITS: [u32; QUANTITIES] = [
    monitoring::SETPOINT_VELOCITY,
    monitoring::SETPOINT_ACCELERATION,
    monitoring::SETPOINT_JERK,
    monitoring::SETPOINT_TRAVEL,
];

/// What one axis has exceeded.
#[derive(Clone, Copy, Debug, Default)]
struct Exceeded {
    rows: u64,
    first_s: f64,
    /// The largest: mm or rad, and their rates.
    most_lu: f64,
}

/// What all axes have exceeded.
#[derive(Clone, Debug)]
pub(super) struct SetpointLimits {
    seen: PerAxis<[Exceeded; QUANTITIES]>,
}

impl SetpointLimits {
    pub(super) fn new() -> Self {
        Self { seen: PerAxis::splat([Exceeded::default(); QUANTITIES]) }
    }

    /// A set-point at `time_s`: the bits of what it exceeds.
    pub(super) fn see(&mut self, machine: &Machine, axis: AxisId, sent: &AxisSetpoint, time_s: f64) -> u32 {
        let (data, seen) = (machine.axis(axis), &mut self.seen[axis]);
        let mut bits = 0;
        for (((value_lu, limit_lu), seen), bit) in values(data, sent).into_iter().zip(limits(data)).zip(seen).zip(BITS)
        {
            if value_lu > limit_lu * (1.0 + ROUNDING_SHARE) {
                if seen.rows == 0 {
                    seen.first_s = time_s;
                }
                seen.rows += 1;
                seen.most_lu = seen.most_lu.max(value_lu);
                bits |= bit;
            }
        }
        bits
    }

    /// A warning for each axis that has exceeded a limit.
    pub(super) fn warnings(&self, machine: &Machine) -> Vec<Diagnostic> {
        machine.axis_ids().filter_map(|axis| warning(machine.axis(axis), &self.seen[axis])).collect()
    }
}

/// How much an axis is asked for; outside the travel by how much.
fn values(axis: &Axis, sent: &AxisSetpoint) -> [f64; QUANTITIES] {
    let outside_lu = axis
        .travel_lu
        .map_or(0.0, |[low_lu, high_lu]| (low_lu - sent.position_lu).max(sent.position_lu - high_lu).max(0.0));
    [sent.velocity_lu_s.abs(), sent.acceleration_lu_s2.abs(), sent.jerk_lu_s3.abs(), outside_lu]
}

/// How much it may be asked for.
fn limits(axis: &Axis) -> [f64; QUANTITIES] {
    let limits = &axis.limits;
    [limits.velocity_max_lu_s, limits.acceleration_max_lu_s2, limits.jerk_max_lu_s3, 0.0]
}

fn warning(axis: &Axis, seen: &[Exceeded; QUANTITIES]) -> Option<Diagnostic> {
    let (unit, border): (&str, fn(f64) -> f64) = match axis.kind {
        AxisKind::Linear => ("mm", |value_lu| value_lu),
        AxisKind::Rotary => ("deg", deg_from_rad),
    };
    let said: Vec<String> = ["/s", "/s²", "/s³", ""]
        .into_iter()
        .zip(["velocity", "acceleration", "jerk", "travel"])
        .zip(seen.iter().zip(limits(axis)))
        .filter(|(_, (seen, _))| seen.rows > 0)
        .map(|((per, what), (seen, limit_lu))| {
            let (most, limit) = (border(seen.most_lu), border(limit_lu));
            let size = match what {
                "travel" => format!("{most:.4} {unit} outside its travel"),
                _ => format!("{what} {most:.4} {unit}{per} where {limit:.4} {unit}{per} is allowed"),
            };
            format!("{size} (rows: {}, the first at {:.4} s)", seen.rows, seen.first_s)
        })
        .collect();
    let message = format!("the set-points ask of {} more than its limits: {}", axis.name, said.join("; "));
    let help = "backward differences of the table; a control would not send this. The drives follow it all the same";
    (!said.is_empty()).then(|| Diagnostic::warning("F0013", message).help(help))
}
