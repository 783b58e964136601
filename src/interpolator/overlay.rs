//! Axes on their own way, laid over the path.
//!
//! In: [`AxisMotion`]s when they set out. Out: what they add to the set-points of a cycle. The path stands where such an axis will
//! arrive; what is left of its way is taken off there. Time inside a motion counts from the piece that it began with, as for the piece
//! itself. Fixed memory: an axis has one way at a time, and the next one is taken up when the one before has ended.

use super::AxisSetpoint;
use crate::base::{AxisId, PerAxis, TimeBase};
use crate::feed::AxisMotion;
use crate::machine::Machine;

/// All axes on their own way.
#[derive(Clone, Debug)]
pub(super) struct Overlay {
    time_base: TimeBase,
    ways: PerAxis<Ways>,
    /// Any of them is under way.
    busy: bool,
}

/// The way of an axis, and the one that follows.
#[derive(Clone, Debug, Default)]
struct Ways {
    now: Option<Way>,
    next: Option<Way>,
}

#[derive(Clone, Debug)]
struct Way {
    motion: AxisMotion,
    entry_k: u64,
    carry_s: f64,
}

impl Overlay {
    pub(super) fn new(machine: &Machine) -> Self {
        Self { time_base: machine.cycle.time_base, ways: PerAxis::from_fn(|_| Ways::default()), busy: false }
    }

    /// A motion begins with the piece that began `carry_s` before set-point `k`.
    pub(super) fn set_out(&mut self, motion: AxisMotion, k: u64, carry_s: f64) {
        let ways = &mut self.ways[motion.axis];
        let way = Way { motion, entry_k: k, carry_s };
        if ways.now.is_none() {
            ways.now = Some(way);
        } else {
            ways.next = Some(way);
        }
        self.busy = true;
    }

    /// True for an axis that is under way.
    pub(super) fn under_way(&self) -> PerAxis<bool> {
        PerAxis::from_fn(|axis| self.ways[axis].now.is_some())
    }

    /// Adds the ways to the set-points of cycle `k`.
    pub(super) fn add(&mut self, k: u64, axes: &mut PerAxis<AxisSetpoint>) {
        if !self.busy {
            return;
        }
        self.busy = false;
        for axis in AxisId::first(crate::base::AXES_MAX) {
            let ways = &mut self.ways[axis];
            let setpoint = &mut axes[axis];
            let waiting = ways.next.as_ref().filter(|_| ways.now.is_some());
            // The path stands at the end of the last of them.
            let behind_lu = waiting.map_or(0.0, |way| way.motion.way_lu);
            let Some(way) = &ways.now else { continue };
            let time_s = way.carry_s + self.time_base.seconds((k - way.entry_k) * self.time_base.ticks_per_setpoint());
            let sense = way.motion.way_lu.signum();
            let state = way.motion.law.at(time_s - way.motion.delay_s);
            let (under_way, begun) = (time_s < way.motion.arrival_s(), time_s > way.motion.delay_s);
            if under_way {
                setpoint.position_lu += sense * state.position_lu - way.motion.way_lu - behind_lu;
                if begun {
                    setpoint.velocity_lu_s += sense * state.velocity_lu_s.max(0.0);
                    setpoint.acceleration_lu_s2 += sense * state.acceleration_lu_s2;
                    setpoint.jerk_lu_s3 += sense * state.jerk_lu_s3;
                }
                self.busy = true;
            } else {
                ways.now = ways.next.take();
                if let Some(next) = &ways.now {
                    let since_s =
                        next.carry_s + self.time_base.seconds((k - next.entry_k) * self.time_base.ticks_per_setpoint());
                    let state = next.motion.law.at(since_s - next.motion.delay_s);
                    let sense = next.motion.way_lu.signum();
                    setpoint.position_lu += sense * state.position_lu - next.motion.way_lu;
                    setpoint.velocity_lu_s += sense * state.velocity_lu_s.max(0.0);
                    setpoint.acceleration_lu_s2 += sense * state.acceleration_lu_s2;
                    setpoint.jerk_lu_s3 += sense * state.jerk_lu_s3;
                    self.busy = true;
                }
            }
        }
    }
}
