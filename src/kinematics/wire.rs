//! The wire out of kinematics: motion of the machine axes along the path.
//!
//! In: nothing (plain data). Out: [`JointPath`], [`JointState`]. Does not know speed.

use super::Transformation;
use crate::base::{AxisVector, MachinePoint};
use crate::smoothing::ContourPiece;
use std::sync::Arc;

/// A piece of the contour as motion of the machine axes, parametrised by path length s of the part-space curve.
#[derive(Clone, Debug, PartialEq)]
pub struct JointPath {
    /// The piece that it maps.
    pub contour: ContourPiece,
    /// What the axes do for the tool to go along it; `None`: axis by axis what the contour says.
    pub transformation: Option<Arc<Transformation>>,
}

/// Posture of the axes at one place of a path, with derivatives to s (lu per mm of path, per mm², per mm³; per rad where only
/// rotary axes move).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointState {
    /// q(s).
    pub position: MachinePoint,
    /// q'(s).
    pub first: AxisVector,
    /// q''(s).
    pub second: AxisVector,
    /// q'''(s).
    pub third: AxisVector,
}
