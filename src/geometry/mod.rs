//! Curves in part space, parametrised by arc length of the linear axes, with derivatives up to the third.
//!
//! In: points and shapes. Out: [`Curve`]. Does not know speed or axes' limits.

mod arc;
mod arc_length;
mod blend;
mod curve;
mod fillet;
mod line;
mod polynomial;
mod quadrature;
mod quintic;
mod rational;
mod spatial_arc;

pub use arc::Arc;
pub use blend::{BlendPoint, HermiteBlend};
pub use curve::{Curve, CurveState, DISPLACEMENT_MIN_LU};
pub use fillet::{ArcCorner, Fillet, Junction, NoFillet, PlaneArc, ROUNDING_DISTANCE_MAX_MM, Sense};
pub use line::Line;
pub use polynomial::PolynomialCurve;
pub use quintic::{QuinticBlend, QuinticShape};
pub use spatial_arc::SpatialArc;
