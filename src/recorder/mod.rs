//! Signals -> MCAP, and back: schema, writer thread, reader, recover, CSV export. The format is described in docs/recording.md.
//!
//! In: the wires of every tick. Out: a recording with its own schemas, program and machine inside. A recording depends on its
//! inputs alone: no time of day, no path, no host. Does not decide what is simulated or when the cycle runs.

mod batch;
mod choice;
mod contents;
mod decode;
mod encode;
mod event;
mod export;
mod front;
mod mcap_file;
mod packing;
mod reader;
mod records;
mod recover;
pub mod schema;
mod setup;
mod target;
mod writer;

pub use choice::{RecordRate, SignalChoice};
pub use contents::AttachmentInfo;
pub use decode::{AxisSample, Content, TopicKind};
pub use event::EventRecord;
pub use export::{ExportReport, export, export_csv};
pub(crate) use export::{push_number, push_text};
pub use front::Recorder;
pub use reader::{Message, Messages, Recording, Topic};
pub use recover::{RECOVERED_METADATA, RecoverReport, recover};
pub use schema::{AXIS_FIELD_COUNT, AXIS_FIELDS, PATH_FIELDS, SPINDLE_FIELDS, ToolPose, axis_field, spindle_values};
pub use setup::{
    ABOUT_METADATA, AXES_METADATA, CYCLE_METADATA, Compression, INPUTS_METADATA, MACHINE_MEDIA_TYPE,
    PROGRAM_MEDIA_TYPE, RecordingSetup, SUMMARY_METADATA, UNITS_METADATA,
};
pub(crate) use target::{Target, WholeFile};
pub use writer::RecordingSummary;
pub(crate) use writer::{write_fault, write_options};
