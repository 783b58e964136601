//! What has no law: motions without a speed, motions and waits that take for ever.
//!
//! In: what is known of a piece that was pushed. Out: an alarm, or nothing. Does not plan.

use crate::base::Diagnostic;
use crate::feed::continuous::Flowing;
use crate::feed::limits::PieceLimits;
use crate::kinematics::JointPath;
use crate::program::BlockRef;

/// As [`check_motion`], under `continuous`.
pub(super) fn check_flow(
    flow: &Flowing,
    length_lu: f64,
    path: &JointPath,
    blocked: Option<String>,
) -> Result<(), Box<Diagnostic>> {
    let [first_lu_s, last_lu_s] = flow.ends_lu_s();
    let numbers = [length_lu, first_lu_s, last_lu_s];
    if blocked.is_none() && numbers.iter().all(|number| number.is_finite() && *number > 0.0) {
        return check_time(length_lu / first_lu_s.max(last_lu_s), path);
    }
    Err(no_speed(path, blocked))
}

/// A motion or wait longer than this is an alarm: 1e6 s are 11 days.
const PIECE_TIME_MAX_S: f64 = 1e6;

/// The alarm of a motion whose length or limits are not numbers, or which takes for ever: without numbers there is no law, and to
/// leave the piece out would make the axes jump over it. Checked machines and programs within their bounds do not give the first; a
/// feed of 1e-7 mm/min or a position of 1e15 mm gives the second.
pub(super) fn check_motion(
    limits: &PieceLimits,
    length_lu: f64,
    path: &JointPath,
    blocked: Option<String>,
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
        return check_time(length_lu / limits.cap.velocity_lu_s, path);
    }
    Err(no_speed(path, blocked))
}

fn no_speed(path: &JointPath, blocked: Option<String>) -> Box<Diagnostic> {
    let line = path.contour.block.line;
    let message = format!("the motion of line {line} has no speed that every axis allows");
    Box::new(match blocked {
        Some(blocked) => Diagnostic::error("P0001", format!("{message}: {blocked}"))
            .help("look at the limits of that axis in the machine file, with its dynamics sets"),
        None => Diagnostic::error("P0001", message)
            .help("look for coordinates far outside the machine, or a circle of hardly any radius"),
    })
}

/// The alarm of a motion or wait that lasts `time_s` at least.
pub(super) fn check_time(time_s: f64, path: &JointPath) -> Result<(), Box<Diagnostic>> {
    if time_s <= PIECE_TIME_MAX_S {
        return Ok(());
    }
    let line = path.contour.block.line;
    let message = format!("the block in line {line} takes {time_s:.3e} s, more than 11 days");
    Err(Box::new(
        Diagnostic::error("P0002", message)
            .help("check its feed, its end position and its dwell, and the velocity limits of the machine"),
    ))
}

/// The alarm of a path that the override holds for ever.
pub(super) fn held(block: BlockRef) -> Diagnostic {
    let message = format!("the feed override is 0 from line {} on, and nothing raises it again", block.line);
    Diagnostic::error("P0005", message)
        .help("look at the synchronised actions on $AC_OVR, and at the last change of --override")
}
