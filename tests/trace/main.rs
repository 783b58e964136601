//! Traces: import of every format, resampling, export. Files are made here, from the formats as described in docs/traces.md.

#[path = "../random/mod.rs"]
mod random;
#[path = "../recorder/support.rs"]
#[allow(dead_code)]
mod recorded;

mod edge;
mod export;
mod measuring;
mod mutations;
mod operate;
mod operate_session;
mod recording;
mod resample;
mod scopes;
mod signal_map;
mod tables;
