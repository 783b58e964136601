//! What a run of a program needs besides the machine: the program, and what lies around it.
//!
//! In: what the caller found. Out: [`Setup`]. Does not open anything: where sub-programs are looked for is said here, when they are is
//! the business of the call.

use crate::program::{ProgramSource, Shipped};
use std::path::PathBuf;

/// The main program and its surroundings.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The main program.
    pub program: ProgramSource,
    /// Folders in which sub-programs are looked for after that of the main program, in order.
    pub directories: Vec<PathBuf>,
    /// Programs inside the binary: searched last.
    pub shipped: Shipped,
    /// Definition files (GUD), executed before the program.
    pub definitions: Vec<ProgramSource>,
    /// Skip levels that are active, one bit each: bit 0 is `/` and `/0`.
    pub skip_levels: u16,
    /// Nothing will move: what only the motion lacks (F) is a finding that does not end the program, so that a listing or a check goes on
    /// to its end.
    pub lists_only: bool,
}

impl From<ProgramSource> for Setup {
    fn from(program: ProgramSource) -> Self {
        Self {
            program,
            directories: Vec::new(),
            shipped: &[],
            definitions: Vec::new(),
            skip_levels: 0,
            lists_only: false,
        }
    }
}

impl From<&ProgramSource> for Setup {
    fn from(program: &ProgramSource) -> Self {
        program.clone().into()
    }
}

impl From<&Setup> for Setup {
    fn from(setup: &Setup) -> Self {
        setup.clone()
    }
}
