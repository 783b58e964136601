//! Tests of the room `kernel`: whole runs, and what each limit costs.

mod drives;
mod runs;
mod waits;
mod what_if;
