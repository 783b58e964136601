//! NC text: bytes -> lines -> tokens -> [`Block`]s and diagnostics with spans.
//!
//! In: the bytes of a program file, the axis names of the machine. Out: one [`Block`] a line, parsed when it is reached, or a
//! [`Fault`] with its columns; the [`structure::Structure`] of labels and control words. Does not execute anything: expressions
//! and control words stay syntax here.

pub mod archive;
mod call_syntax;
mod calls;
mod characters;
pub mod codes;
mod dialect;
mod expression;
mod g_functions;
mod lexer;
pub mod library;
mod not_acted_on;
mod not_built;
mod parser;
pub mod plain;
mod print;
mod print_calls;
pub mod source;
mod statements;
pub mod structure;
mod synchronised;
pub mod syntax;
mod system_variables;
pub mod text;
pub mod visit;
mod word_kinds;
mod word_table;
pub mod words;

pub use codes::{Columns, Fault, Outcome};
pub use dialect::{Dialect, taken_axis_names};
pub use library::{Library, Shipped, UnitId};
pub use parser::{is_synchronised, parse, whole_number};
pub use print::print;
pub use source::{Cursor, Line, ProgramSource, Window};
pub use statements::{TEXT_MAX, block_number, visit_names};
pub use synchronised::{Cadence, Synchronised};
pub use syntax::{Block, VariableType};
pub use system_variables::{SYSTEM_VARIABLES, SystemVariable};
pub use text::ProgramText;
pub use visit::{mentions_main_run, visit_expressions};
pub use words::{NOT_ACTED_ON, NotActedOn, did_you_mean, known_words};

use std::sync::Arc;

/// Number of a program file within a run, in order of first opening: 0 is the main program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct ProgramId(pub u16);

/// Where a motion comes from: every wire downstream carries it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub struct BlockRef {
    /// Program file.
    pub program: ProgramId,
    /// Line in that file, from 1.
    pub line: u32,
    /// Running number of the executed block, from 1 (loops count every pass).
    pub number: u64,
}

/// A program as opened: what a recording attaches.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenedProgram {
    /// Its number.
    pub id: ProgramId,
    /// File name without folders.
    pub name: Arc<str>,
    /// Bytes as they are on the disk.
    pub bytes: ProgramText,
}
