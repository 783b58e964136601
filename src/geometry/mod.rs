//! Curves in part space, parametrised by arc length of the linear axes, with derivatives up to the third.
//!
//! In: points and shapes. Out: [`Curve`]. Does not know speed or axes' limits.

mod curve;
pub use curve::Curve;
