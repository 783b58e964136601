//! Whole programs through the kernel, judged from outside: the tests know the program text, the machine's limits and the set-points
//! that come out, and nothing of how they were planned. Every rule is stated here a second time, from its definition.
//!
//! Random programs are NC text made from a seed; a failure prints the seed, and `program(seed, ..)` gives the text again.

mod closed_forms;
mod contour;
mod corners;
mod curves;
mod drives;
mod figures;
mod in_position;
mod limits;
#[path = "../random/mod.rs"]
mod random;
mod rates;
mod recording;
mod replay;
mod text;
mod trace;
mod window;
