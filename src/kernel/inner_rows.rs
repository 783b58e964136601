//! Rows of an axis between its position ticks: `--record-rate speed` and `current`.
//!
//! In: the drive of an axis and the rate that is asked for. Out: the signals of its inner cycles, with their ticks. Does not sort them among those of
//! other axes, and does not record.

use crate::base::Tick;
use crate::drive::{AxisSignals, Drive, DriveInput};
use crate::machine::DriveData;
use crate::recorder::RecordRate;

/// Rows of an axis between its position ticks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InnerRows {
    /// Current cycle.
    current_ticks: u64,
    /// A row every so many current cycles; 0: at the position tick alone.
    every: u32,
}

impl InnerRows {
    /// At the rate that is asked for; none without a drive.
    pub(super) fn new(drive: Option<&DriveData>, rate: RecordRate) -> Self {
        let Some(drive) = drive else { return Self::default() };
        let current_ticks = drive.current_cycle_ticks;
        let every = match rate {
            RecordRate::Position => 0,
            RecordRate::Speed => (drive.speed_cycle_ticks / current_ticks.max(1)) as u32,
            RecordRate::Current => 1,
        };
        Self { current_ticks, every }
    }

    /// One position cycle. Returns the signals at its `tick`, and gives `each` those of the rows behind it, with their ticks.
    pub(super) fn step(
        &self,
        drive: &mut Drive,
        input: DriveInput,
        tick: Tick,
        mut each: impl FnMut(Tick, AxisSignals),
    ) -> AxisSignals {
        if self.every == 0 {
            return drive.step(input);
        }
        let mut first = AxisSignals::default();
        drive.step_each(input, |n, signals| {
            if n == 0 {
                first = *signals;
            } else if n.is_multiple_of(self.every) {
                each(Tick(tick.0 + u64::from(n) * self.current_ticks), *signals);
            }
        });
        first
    }
}
