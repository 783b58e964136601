//! The wire that runs backwards: from the position controllers to the block end that waits for them.
//!
//! In: which block ends wait, the signals of every position tick. Out: [`InPosition`], which carries the position tick at which all axes
//! were first seen in their window; the path goes on at the first set-point tick after it. That depends on ticks alone: how far
//! preparation has come does not matter. Axes without a drive are always in position. A drive that never arrives raises its own alarm (positioning
//! monitoring); axes that arrive in turn and leave again are [`Apart`] after [`WAITS_MAX`] times the longest time that one of them has for it.

use crate::base::{AXES_MAX, AxisId, PerAxis, Tick, TimeBase};
use crate::drive::{AxisSignals, monitoring};
use crate::interpolator::ExactStopWait;
use crate::interpreter::ExactStop;
use crate::machine::{Machine, POSITIONING_TIME_MAX_S};

/// A block end waits for so many times the longest MD36020 of the axes, and not for longer than an hour. Within one such time each axis has been in its
/// window, or is an alarm; the others are for axes that leave it again before the last one is there.
pub(super) const WAITS_MAX: f64 = 10.0;

/// All axes are in position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InPosition {
    /// Position tick at which they were seen.
    pub seen: Tick,
    /// First set-point tick after it: there the next block begins.
    pub acts: Tick,
}

/// The axes have been in their windows in turn, but never all at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Apart {
    /// How long the block end has waited.
    pub(super) waited_s: f64,
    pub(super) window: ExactStop,
    /// How often each axis has left its window again.
    pub(super) left: PerAxis<u32>,
    /// Those that are not in it now.
    pub(super) outside: PerAxis<bool>,
}

/// Listens to the drives while a block end waits.
#[derive(Clone, Debug)]
pub(super) struct InPositionWire {
    time_base: TimeBase,
    /// Axes with a drive.
    driven: PerAxis<bool>,
    /// As last seen, by axis.
    inside: PerAxis<bool>,
    /// How often an axis has left its window in this wait.
    left: PerAxis<u32>,
    /// The longest wait.
    longest_s: f64,
    message: Option<InPosition>,
}

impl InPositionWire {
    pub(super) fn new(machine: &Machine, driven: PerAxis<bool>) -> Self {
        let drives = machine
            .axes
            .iter()
            .zip(driven.as_slice())
            .filter_map(|(axis, driven)| axis.drive.as_ref().filter(|_| *driven));
        let longest_s = drives.map(|drive| drive.monitoring.positioning_time_s).fold(0.0, f64::max);
        Self {
            time_base: machine.cycle.time_base,
            driven,
            inside: PerAxis::splat(false),
            left: PerAxis::splat(0),
            longest_s: (WAITS_MAX * longest_s).min(POSITIONING_TIME_MAX_S),
            message: None,
        }
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
        let inside = signals.monitoring & window != 0;
        self.left[axis] += u32::from(self.inside[axis] && !inside);
        self.inside[axis] = inside;
        let all = AxisId::first(AXES_MAX).all(|axis| self.inside[axis] || !self.driven[axis] || wait.elsewhere[axis]);
        if all && self.message.is_none() {
            let period = self.time_base.ticks_per_setpoint();
            self.message = Some(InPosition { seen: tick, acts: Tick((tick.0 / period + 1) * period) });
        }
    }

    /// The block end that waits since `wait.since` has waited for too long at `tick`.
    pub(super) fn apart(&self, tick: Tick, wait: &ExactStopWait) -> Option<Apart> {
        let waited_s = self.time_base.seconds(tick.0.saturating_sub(wait.since.0));
        let outside = |axis| self.driven[axis] && !self.inside[axis] && !wait.elsewhere[axis];
        (waited_s > self.longest_s && self.message.is_none()).then(|| Apart {
            waited_s,
            window: wait.window,
            left: self.left,
            outside: PerAxis::from_fn(outside),
        })
    }

    /// The message that acts at or before `tick`; after it the wire listens anew.
    pub(super) fn take(&mut self, tick: Tick) -> Option<InPosition> {
        let message = self.message.take_if(|message| message.acts <= tick)?;
        self.inside = PerAxis::splat(false);
        self.left = PerAxis::splat(0);
        Some(message)
    }
}
