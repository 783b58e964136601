//! The master spindle at each set-point.
//!
//! In: [`SpindleMotion`]s with the pieces that bring them. Out: a [`SpindleSetpoint`]. Times count from the piece that brought the motion, as for the
//! piece itself; a spindle that follows the path (G331) is turned on by the path that is done. Does not plan.

use super::SpindleSetpoint;
use crate::base::TimeBase;
use crate::feed::{PathState, SpindleMotion, SpindlePhase};

/// The motion in force.
#[derive(Clone, Debug)]
pub(super) struct SpindleCourse {
    time_base: TimeBase,
    motion: Option<SpindleMotion>,
    entry_k: u64,
    carry_s: f64,
}

impl SpindleCourse {
    pub(super) fn new(time_base: TimeBase) -> Self {
        Self { time_base, motion: None, entry_k: 0, carry_s: 0.0 }
    }

    /// A piece that began `carry_s` before set-point `k` brings another motion.
    pub(super) fn take(&mut self, motion: Option<SpindleMotion>, k: u64, carry_s: f64) {
        if motion.is_some() {
            (self.motion, self.entry_k, self.carry_s) = (motion, k, carry_s);
        }
    }

    /// At set-point `k`, with the path at `path`.
    pub(super) fn at(&self, k: u64, path: &PathState) -> SpindleSetpoint {
        let Some(motion) = &self.motion else { return SpindleSetpoint::default() };
        let cycles = k.saturating_sub(self.entry_k);
        let time_s = self.carry_s + self.time_base.seconds(cycles * self.time_base.ticks_per_setpoint());
        let phase = SpindlePhase::of(&motion.phases, time_s);
        let turn = motion.follows_rad_per_lu.unwrap_or(0.0);
        SpindleSetpoint {
            angle_rad: phase.angle_rad + turn * path.position_lu,
            speed_rad_s: phase.speed_rad_s + turn * path.velocity_lu_s,
            acceleration_rad_s2: phase.acceleration_rad_s2 + turn * path.acceleration_lu_s2,
        }
    }
}
