//! The door: finds out what a file is by its content and calls the importer.
//!
//! In: a path, [`ImportOptions`]. Out: a [`Trace`]. Errors say what the file is taken for and what is wrong with it. Does not look
//! at the ending of the name.

use super::recording::import_recording;
use super::wire::Trace;
use crate::base::Diagnostic;
use crate::machine::Machine;
use crate::recorder::Recording;
use std::path::Path;

/// What the user says about a trace.
#[derive(Clone, Debug, Default)]
pub struct ImportOptions<'a> {
    /// Names and kinds of the axes behind the numbers that a control writes (`index`, `machine_axis`).
    pub machine: Option<&'a Machine>,
    /// `--axis-name 7=A`: number of the machine axis, and its name. Comes before the machine.
    pub axis_names: Vec<(u32, String)>,
    /// `--map CONTROLLER=OURS`: more rows for the signal map. They come before the built-in ones.
    pub signal_map: Vec<(String, String)>,
    /// `--time NAME`: the time column of a CSV.
    pub time_column: Option<String>,
    /// Signals to keep, by any of their names or by field without axis (`position_setpoint`); empty keeps all. A long recording
    /// with all its signals does not fit into memory.
    pub only: Vec<String>,
}

impl ImportOptions<'_> {
    /// Whether a signal of ours is asked for.
    pub(super) fn wants(&self, name: &str) -> bool {
        let stem = super::wire::AxisSignal::parse(name).map(|signal| signal.stem());
        self.only.is_empty() || self.only.iter().any(|only| only == name || Some(only.as_str()) == stem)
    }
}

/// Reads a trace of any known format.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Trace, Diagnostic> {
    import_recording(&Recording::open(path)?, options)
}
