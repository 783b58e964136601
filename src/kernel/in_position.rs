//! The wire that runs backwards: from the position controllers to the block end that waits for them.
//!
//! In: which block ends wait, the signals of every position tick. Out: [`InPosition`], which carries the position tick at which all axes
//! were first seen in their window; the path goes on at the first set-point tick after it. That depends on ticks alone: how far
//! preparation has come does not matter. Axes without a drive are always in position. Does not give up: a drive that never arrives
//! raises its own alarm (positioning monitoring).

use crate::base::{AXES_MAX, AxisId, PerAxis, Tick, TimeBase};
use crate::drive::{AxisSignals, monitoring};
use crate::interpolator::ExactStopWait;
use crate::interpreter::ExactStop;

/// All axes are in position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InPosition {
    /// Position tick at which they were seen.
    pub seen: Tick,
    /// First set-point tick after it: there the next block begins.
    pub acts: Tick,
}

/// Listens to the drives while a block end waits.
#[derive(Clone, Debug)]
pub(super) struct InPositionWire {
    time_base: TimeBase,
    /// Axes with a drive.
    driven: PerAxis<bool>,
    /// As last seen, by axis.
    inside: PerAxis<bool>,
    message: Option<InPosition>,
}

impl InPositionWire {
    pub(super) fn new(time_base: TimeBase, driven: PerAxis<bool>) -> Self {
        Self { time_base, driven, inside: PerAxis::splat(false), message: None }
    }

    /// False if there is no drive to wait for.
    pub(super) fn connected(&self) -> bool {
        self.driven.as_slice().contains(&true)
    }

    /// An axis at a position tick, while a block end waits since the set-point at `wait.since`.
    pub(super) fn hear(&mut self, tick: Tick, axis: AxisId, wait: &ExactStopWait, signals: &AxisSignals) {
        let window = match wait.window {
            ExactStop::Coarse => monitoring::IN_POSITION_COARSE,
            ExactStop::Fine | ExactStop::Setpoint => monitoring::IN_POSITION_FINE,
        };
        if tick < wait.since {
            return;
        }
        self.inside[axis] = signals.monitoring & window != 0;
        let all = AxisId::first(AXES_MAX).all(|axis| self.inside[axis] || !self.driven[axis] || wait.elsewhere[axis]);
        if all && self.message.is_none() {
            let period = self.time_base.ticks_per_setpoint();
            self.message = Some(InPosition { seen: tick, acts: Tick((tick.0 / period + 1) * period) });
        }
    }

    /// The message that acts at or before `tick`; after it the wire listens anew.
    pub(super) fn take(&mut self, tick: Tick) -> Option<InPosition> {
        let message = self.message.take_if(|message| message.acts <= tick)?;
        self.inside = PerAxis::splat(false);
        Some(message)
    }
}
