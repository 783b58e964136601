//! What has no law: motions without a speed, motions and waits that take for ever. And what is counted of those that have one.
//!
//! In: what is known of a piece that was pushed. Out: an alarm, or nothing. Does not plan.

use super::{Entry, Motion, Planner};
use crate::base::Diagnostic;
use crate::feed::TimeLaw;
use crate::feed::continuous::Flowing;
use crate::feed::limits::{AxisRules, Ends, PieceLimits};
use crate::feed::modes::ModeRules;
use crate::geometry::Curve;
use crate::interpreter::Feed;
use crate::kinematics::{JointPath, JointState};
use crate::program::BlockRef;
use crate::smoothing::PieceKind;

/// The axes of a motion, for alarms that name one.
pub(super) struct Axes<'a> {
    pub modes: &'a ModeRules,
    pub rules: &'a AxisRules,
    pub ends: &'a Ends,
}

impl Axes<'_> {
    /// The axis with a limit of 0, in words.
    fn blocked(&self) -> Option<String> {
        self.modes.blocked_axis(self.rules, &self.ends.start)
    }

    /// The axis whose coordinates are no numbers or further than any machine, in words.
    fn endless(&self, path: &JointPath) -> Option<String> {
        let machine = self.modes.machine();
        let broken = |axis| {
            let of = |state: &JointState| state.first[axis] + state.second[axis] + state.third[axis];
            !(of(&self.ends.start).is_finite() && of(&self.ends.end).is_finite())
        };
        let farthest = match &path.contour.kind {
            PieceKind::Block(Curve::Polynomial(curve)) => {
                machine.axis_ids().find(|axis| !curve.stays_within(*axis, REACH_MAX_LU))
            }
            _ => None,
        };
        let axis = farthest.or_else(|| machine.axis_ids().find(|axis| broken(*axis)))?;
        Some(format!("axis {} would go further than any machine", machine.axis(axis).name))
    }

    /// The axis whose limit alone makes the motion longer than [`PIECE_TIME_MAX_S`], in words.
    fn slow(&self, length_lu: f64) -> Option<String> {
        let states = [&self.ends.start, &self.ends.end];
        states.into_iter().find_map(|state| self.modes.slow_axis(self.rules, state, length_lu / PIECE_TIME_MAX_S))
    }
}

/// As [`check_motion`], under `continuous`.
pub(super) fn check_flow(flow: &Flowing, length_lu: f64, path: &JointPath, axes: &Axes) -> Result<(), Box<Diagnostic>> {
    let [first_lu_s, last_lu_s] = flow.ends_lu_s();
    let numbers = [length_lu, first_lu_s, last_lu_s];
    let blocked = axes.blocked();
    if blocked.is_none() && numbers.iter().all(|number| number.is_finite() && *number > 0.0) {
        return check_time(length_lu / first_lu_s.max(last_lu_s), path, || axes.slow(length_lu));
    }
    Err(no_speed(path, blocked, axes))
}

/// A motion or wait longer than this is an alarm: 1e6 s are 11 days.
const PIECE_TIME_MAX_S: f64 = 1e6;

/// No machine reaches as far.
const REACH_MAX_LU: f64 = 1e12;

/// The alarm of a motion whose length or limits are not numbers, or which takes for ever: without numbers there is no law, and to
/// leave the piece out would make the axes jump over it. Checked machines and programs within their bounds do not give the first; a
/// feed of 1e-7 mm/min or a position of 1e15 mm gives the second.
pub(super) fn check_motion(
    limits: &PieceLimits,
    length_lu: f64,
    path: &JointPath,
    axes: &Axes,
) -> Result<(), Box<Diagnostic>> {
    let dynamics = &limits.bounds.dynamics;
    let numbers = [
        length_lu,
        limits.cap.velocity_lu_s,
        limits.ramp_cap.velocity_lu_s,
        dynamics.acceleration_lu_s2,
        dynamics.jerk_lu_s3.unwrap_or(1.0),
    ];
    if numbers.iter().all(|number| number.is_finite() && *number > 0.0) {
        return check_time(length_lu / limits.cap.velocity_lu_s, path, || axes.slow(length_lu));
    }
    Err(no_speed(path, axes.blocked(), axes))
}

fn no_speed(path: &JointPath, blocked: Option<String>, axes: &Axes) -> Box<Diagnostic> {
    let line = path.contour.block.line;
    let message = format!("the motion of line {line} has no speed that every axis allows");
    if let Some(blocked) = blocked {
        return Box::new(
            Diagnostic::error("P0001", format!("{message}: {blocked}"))
                .help("look at the limits of that axis in the machine file, with its dynamics sets"),
        );
    }
    let named = axes.endless(path).map_or(message.clone(), |endless| format!("{message}: {endless}"));
    Box::new(
        Diagnostic::error("P0001", named)
            .help("look for coordinates far outside the machine, or a circle of hardly any radius"),
    )
}

/// The alarm of a motion or wait that lasts `time_s` at least; `slow` names the axis that holds it, if one does.
pub(super) fn check_time(
    time_s: f64,
    path: &JointPath,
    slow: impl FnOnce() -> Option<String>,
) -> Result<(), Box<Diagnostic>> {
    if time_s <= PIECE_TIME_MAX_S {
        return Ok(());
    }
    let line = path.contour.block.line;
    let message = format!("the block in line {line} takes {time_s:.3e} s, more than 11 days");
    Err(Box::new(match slow() {
        Some(slow) => Diagnostic::error("P0002", format!("{message}: {slow}"))
            .help("look at VELOLIM, ACC and JERKLIM of that axis, and at its limits in the machine file"),
        None => Diagnostic::error("P0002", message)
            .help("check its feed, its end position and its dwell, and the velocity limits of the machine"),
    }))
}

/// The alarm of a path that the override holds for ever.
pub(super) fn held(block: BlockRef) -> Diagnostic {
    let message = format!("the feed override is 0 from line {} on, and nothing raises it again", block.line);
    Diagnostic::error("P0005", message)
        .help("look at the synchronised actions on $AC_OVR, and at the last change of --override")
}

impl Planner {
    /// What is told at the end: blends that creep, the time for which a feed holds.
    pub(super) fn count(&mut self, front: &Entry, law: &TimeLaw) {
        if matches!((&front.motion, &front.path.contour.kind), (Motion::Moves { .. }, PieceKind::Blend(..))) {
            self.crept.crossed(&self.rules.of(&front.path.contour.modes), &front.path, law.duration_s());
        }
        let moves = matches!(front.motion, Motion::Moves { .. } | Motion::Flows(_) | Motion::Threads(_));
        if moves && front.path.contour.feed != Feed::Rapid {
            self.cutting_s += law.duration_s();
        }
    }
}
