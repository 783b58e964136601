//! Any recording or controller export -> [`Trace`]: named signals on their own time grids. What comes from where, and which signal
//! of ours each one is, stands in docs/traces.md.
//!
//! In: a file, found out by its content and not by its name; names of axes. Out: [`Trace`], with what was repaired or doubtful as
//! notes. A signal keeps its own grid and its full original name; nothing is interpolated unless [`Signal::resampled`] is asked.
//! Does not align or compare traces.

mod import;
mod recording;
mod resample;
mod wire;

pub use import::{ImportOptions, import};
pub use resample::Method;
pub use wire::{
    AxisSignal, Clock, Meaning, Origin, Signal, TimeGrid, Trace, TraceEvent, TraceFormat, Zero, axis_signal_name,
};
