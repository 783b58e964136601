//! Moves -> Contour: joins moves to a path, and rounds corners as the path mode says.
//!
//! In: [`Move`](crate::interpreter::Move)s in order. Out: [`ContourPiece`]s in order, streamed. Does not know speed.

mod compressor;
mod corner;
mod curve_corners;
mod dynamics;
mod insert;
mod opened;
mod programmed;
mod smoother;
mod transition;
mod unrounded;
mod wire;

pub use opened::OpenedPrograms;
pub use smoother::Smoother;
pub use wire::*;
