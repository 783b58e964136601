//! Where the sub-programs of a program are found.
//!
//! In: the main program, folders, shipped programs. Out: [`ProgramSource`]s by name. Does not execute.

use std::path::PathBuf;

/// What a program is run with, apart from the machine.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Surroundings {
    /// Folders in which sub-programs are searched, after the program's own.
    pub folders: Vec<PathBuf>,
    /// Programs inside the binary: name and text. Searched last.
    pub shipped: &'static [(&'static str, &'static str)],
    /// Blocks that are skipped.
    pub skip: SkipLevels,
}

/// Skip levels (`/0` to `/9`) that are active: such blocks are passed over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SkipLevels(u16);

impl SkipLevels {
    /// The same with `level` (0 to 9) active.
    pub fn with(self, level: u8) -> Self {
        Self(self.0 | 1 << level.min(9))
    }

    /// True if blocks of that level are skipped.
    pub fn is_active(self, level: u8) -> bool {
        self.0 & 1 << level.min(9) != 0
    }
}
