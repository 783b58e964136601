//! Tests of the rooms `geometry` and `kinematics`: curves, their arc length, and q(s) of paths.

#[path = "../random/mod.rs"]
mod random;
#[path = "../test_machine/mod.rs"]
mod test_machine;

mod arc_length;
mod curves;
mod fillet;
mod kinematics;
mod polynomials;
mod quintic;
mod transformation;
