//! Contour -> JointPath: part space to joint space, and the pose of the tool for a posture of the axes.
//!
//! In: [`ContourPiece`](crate::smoothing::ContourPiece)s. Out: [`JointPath`]: q(s) with q', q'', q''' of every axis. Without a
//! [`Transformation`] machine space is part space, axis by axis; with one the contour is what the tool does in the part, and X, Y and Z
//! follow the turned tables and heads. No word of the language switches one on yet (TRAORI is a later issue): only a caller of the
//! library can. Does not know speed.

mod chain;
mod joint_path;
mod transformation;
mod wire;

pub use chain::{Direction, Kinematics, Quaternion, ToolPose};
pub use transformation::Transformation;
pub use wire::*;
