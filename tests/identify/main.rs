//! The room `identify`: what it finds on traces whose truth is known, how right its intervals are, and what it refuses.

#[path = "../random/mod.rs"]
mod random;
#[path = "../test_machine/mod.rs"]
mod test_machine;

mod chain;
mod command;
mod control;
mod machines;
mod made;
mod other_plant;
mod other_plant_tells;
mod refusals;
mod speed_loop;
mod stranger;
mod trust;
