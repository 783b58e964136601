//! Tests of the rooms `program` and `interpreter`: from text to moves.

#[path = "../nc_machine/mod.rs"]
mod nc_machine;
#[path = "../random/mod.rs"]
mod random;

mod arcs;
mod corners;
mod curves;
mod definition_files;
mod examples;
mod expressions;
mod feed_words;
mod files;
mod flow;
mod frames;
mod mistakes;
mod modes;
mod parser;
mod print;
mod shipped;
mod spindles;
mod subprograms;
mod tools;
mod variables;
