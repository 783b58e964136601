//! TimeLaw -> Setpoint: positions of all axes at k * t_s, by exact evaluation of the curve.
//!
//! In: [`PlannedPiece`](crate::feed::PlannedPiece)s in order. Out: a [`Setpoint`] per cycle. A cycle may cross many pieces; the rest of a cycle is carried
//! into the next piece, so that no block is rounded to whole cycles.

mod fine;
mod overlay;
mod sampler;
mod spindle_course;
mod wire;

pub use fine::FineInterpolator;
pub use sampler::{Begun, Interpolator};
pub use wire::*;
