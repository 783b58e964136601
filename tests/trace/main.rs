//! Traces: import of every format, resampling, export. Files are made here, from the formats as described in docs/traces.md.

#[path = "../recorder/support.rs"]
#[allow(dead_code)]
mod recorded;

mod recording;
mod resample;
