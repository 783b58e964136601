//! The machine: from the file as written to a checked [`Machine`] in internal units.
//!
//! In: TOML text (`file`), `--set KEY=VALUE` overrides. Out: [`Machine`], immutable, every value inside its range.
//! Does not know programs, paths or recordings.

mod checked;
pub use checked::*;
