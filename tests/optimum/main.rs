//! The fastest motion along a path: against closed forms, an independent solver, and its own limits seen from outside.
//!
//! In: moves and machines. Out: failures. The independent times are those of tools/optimum_reference.py (time domain, scipy), kept in
//! `reference.csv`. Does not look into the grid: a motion is what its places say.

#[path = "../feed/support.rs"]
mod support;

mod outside;
mod reference;
mod shapes;
