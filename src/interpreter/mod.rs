//! Block -> [`Move`]: executes the program. Modal state, expressions, control flow, frames.
//!
//! In: [`crate::program`] blocks, the machine's axis names and defaults. Out: a stream of [`Move`]s in the basic coordinate
//! system, one at a time, and diagnostics. Does not know corners, speeds or time.

mod wire;
pub use wire::*;
