//! Tests of the command as it stands: the built program, its documents, and the files it reads and writes.

mod bad_limits;
mod command;
mod explain;
mod readme;
