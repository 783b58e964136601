//! NC text: bytes -> lines -> tokens -> [`Block`]s and diagnostics with spans.
//!
//! Does not execute anything: expressions and control words stay syntax here.

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
    pub bytes: Arc<[u8]>,
}
