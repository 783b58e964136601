//! Tests of the room `kernel`: whole runs, and what each limit costs.

mod runs;
mod what_if;
