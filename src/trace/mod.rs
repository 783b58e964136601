//! Any recording or controller export -> [`Trace`]: named signals on their own time grids. What comes from where, and which signal
//! of ours each one is, stands in docs/traces.md.
//!
//! In: a file, found out by its content and not by its name; names of axes. Out: [`Trace`], with what was repaired or doubtful as
//! notes. A signal keeps its own grid and its full original name; nothing is interpolated unless [`Signal::resampled`] is asked.
//! Does not align or compare traces.

mod columns;
mod csv;
mod delimited;
mod edge;
mod edge_low;
mod edge_payload;
mod export;
mod faults;
mod import;
mod instants;
mod measuring;
mod naming;
mod operate;
mod operate_frame;
mod operate_writer;
#[cfg(feature = "parquet")]
mod parquet_table;
mod programmed;
mod recording;
mod resample;
mod rows;
mod scope;
mod signal_map;
mod sink;
mod sniff;
mod source;
mod table;
mod text;
mod time_column;
mod to_recording;
mod twincat;
mod unit_words;
mod wire;

pub use export::{ColumnNames, ExportForm, ExportOutcome, Written, export_trace};
pub use import::{ImportOptions, import};
pub use programmed::{Motion, ProgrammedPath, ProgrammedView};
pub use resample::Method;
pub use signal_map::{Quantity, Rule, SIGNAL_MAP, rule_for};
pub use source::Progress;
pub use wire::{
    AxisSignal, Clock, Meaning, Origin, Signal, TimeGrid, Trace, TraceEvent, TraceFormat, Zero, axis_signal_name,
};
