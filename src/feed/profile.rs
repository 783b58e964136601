//! The time law of one piece: up, cruise, down, in at most seven phases.
//!
//! In: the length of the piece, the speeds at its ends, and what bounds it ([`Bounds`]). Out: a [`TimeLaw`] whose length is that
//! of the piece and whose every phase says what holds it back: a jerk phase the axis whose jerk bounds it, a phase of constant
//! acceleration the axis whose acceleration does, a cruise what set its speed. Does not decide the speeds at the ends.

use super::ramp::{Dynamics, Ramp, same_speed};
use super::{Limit, Phase, TimeLaw};

/// A speed and what sets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedCap {
    /// Highest speed.
    pub velocity_lu_s: f64,
    /// Why not more.
    pub limit: Limit,
}

impl SpeedCap {
    /// The lower one of two caps; of equal ones the first.
    pub fn min(self, other: Self) -> Self {
        if other.velocity_lu_s < self.velocity_lu_s { other } else { self }
    }
}

/// What bounds a piece between its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Highest speed of a cruise.
    pub cruise: SpeedCap,
    /// Tangential acceleration and jerk.
    pub dynamics: Dynamics,
    /// What sets the acceleration.
    pub acceleration: Limit,
    /// What sets the jerk.
    pub jerk: Limit,
}

/// A piece between two junctions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Length of the path.
    pub length_lu: f64,
    /// Speed at its start, and what sets it.
    pub entry: SpeedCap,
    /// Speed at its end, and what sets it.
    pub exit: SpeedCap,
}

/// The fastest law over a stretch without acceleration at its ends (models/arcs.md section 6).
pub fn seven_phases(stretch: &Stretch, bounds: &Bounds) -> TimeLaw {
    let Stretch { length_lu, entry, exit } = *stretch;
    let (v0, v1) = (entry.velocity_lu_s, exit.velocity_lu_s);
    let dynamics = &bounds.dynamics;
    let junction = if v1 > v0 { exit } else { entry };
    let mut peak = SpeedCap { velocity_lu_s: bounds.cruise.velocity_lu_s.max(v0).max(v1), ..bounds.cruise };
    if junction.velocity_lu_s >= peak.velocity_lu_s {
        peak = junction;
    }
    let ramps_lu = |vp: f64| dynamics.ramp_length_lu(v0, vp) + dynamics.ramp_length_lu(vp, v1);
    if ramps_lu(peak.velocity_lu_s) > length_lu {
        let velocity_lu_s = dynamics.peak(v0, v1, length_lu).min(peak.velocity_lu_s);
        // Where there is no room for a peak, what holds the higher junction holds the piece.
        let limit = if same_speed(junction.velocity_lu_s, velocity_lu_s) { junction.limit } else { bounds.jerk };
        peak = SpeedCap { velocity_lu_s, limit };
    }
    let vp = peak.velocity_lu_s;
    let (mut up, mut down) = (dynamics.ramp(v0, vp), dynamics.ramp(vp, v1));
    let used_lu = ramps_lu(vp);
    let rest_lu = length_lu - used_lu;
    if rest_lu < 0.0 {
        // The speeds are rounded, and a ramp's length goes with the root of its difference of speed: the ramps give way, so that
        // the law ends where the piece does.
        let ratio = length_lu / used_lu;
        (up, down) = (up.scaled(ratio), down.scaled(ratio));
    }
    let mut builder = Builder { bounds, phases: [idle(peak.limit); 7], count: 0 };
    builder.ramp(0.0, v0, vp, up);
    let down_lu = (vp + v1) / 2.0 * down.duration_s();
    if rest_lu > 0.0 && vp > 0.0 {
        let start_lu = (v0 + vp) / 2.0 * up.duration_s();
        builder.add(Phase { duration_s: rest_lu / vp, start_lu, velocity_lu_s: vp, ..idle(peak.limit) });
    }
    // Counted from the end, so that the end is met to the last bit.
    builder.ramp(length_lu - down_lu, vp, v1, down);
    TimeLaw::new(builder.phases.into_iter().take(builder.count))
}

/// Standing still for a time.
pub fn standstill(time_s: f64, limit: Limit) -> TimeLaw {
    TimeLaw::new([Phase { duration_s: time_s, ..idle(limit) }])
}

/// A phase of no length at rest.
fn idle(limit: Limit) -> Phase {
    Phase {
        duration_s: 0.0,
        start_lu: 0.0,
        velocity_lu_s: 0.0,
        acceleration_lu_s2: 0.0,
        jerk_lu_s3: 0.0,
        rate_per_s2: 0.0,
        limit,
    }
}

struct Builder<'a> {
    bounds: &'a Bounds,
    phases: [Phase; 7],
    count: usize,
}

impl Builder<'_> {
    fn add(&mut self, phase: Phase) {
        self.phases[self.count] = phase;
        self.count += 1;
    }

    /// The three phases of a ramp that starts at `start_lu`.
    fn ramp(&mut self, start_lu: f64, from_lu_s: f64, to_lu_s: f64, ramp: Ramp) {
        let Ramp { jerk_time_s, hold_time_s } = ramp;
        if jerk_time_s + hold_time_s <= 0.0 {
            return;
        }
        let acceleration_lu_s2 = (to_lu_s - from_lu_s) / (jerk_time_s + hold_time_s);
        let jerk_lu_s3 = if jerk_time_s > 0.0 { acceleration_lu_s2 / jerk_time_s } else { 0.0 };
        let first = Phase {
            duration_s: jerk_time_s,
            start_lu,
            velocity_lu_s: from_lu_s,
            acceleration_lu_s2: 0.0,
            jerk_lu_s3,
            rate_per_s2: 0.0,
            limit: self.bounds.jerk,
        };
        let reached = first.at(jerk_time_s);
        let hold = Phase {
            duration_s: hold_time_s,
            start_lu: reached.position_lu,
            velocity_lu_s: reached.velocity_lu_s,
            acceleration_lu_s2,
            jerk_lu_s3: 0.0,
            rate_per_s2: 0.0,
            limit: self.bounds.acceleration,
        };
        let reached = hold.at(hold_time_s);
        let last = Phase {
            start_lu: reached.position_lu,
            velocity_lu_s: reached.velocity_lu_s,
            acceleration_lu_s2,
            jerk_lu_s3: -jerk_lu_s3,
            ..first
        };
        self.add(first);
        self.add(hold);
        self.add(last);
    }
}
