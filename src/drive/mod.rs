//! Setpoint -> AxisSignals: the cascade of one axis, models/drive.md. One file per box of the control diagram.
//!
//! In: position set-points, one a position cycle. Out: [`AxisSignals`]. Does not know other axes, paths or programs.

mod wire;
pub use wire::*;
