//! Curves in part space, parametrised by arc length of the linear axes, with derivatives up to the third.
//!
//! In: points and shapes. Out: [`Curve`]. Does not know speed or axes' limits.

mod arc;
mod blend;
mod curve;
mod line;
mod quadrature;

pub use arc::Arc;
pub use blend::{BlendPoint, HermiteBlend};
pub use curve::{Curve, CurveState, DISPLACEMENT_MIN_LU};
pub use line::Line;
