//! Contour -> JointPath: part space to joint space, and the pose of the tool for a posture of the axes.
//!
//! In: [`ContourPiece`](crate::smoothing::ContourPiece)s. Out: [`JointPath`]: q(s) with q', q'', q''' of every axis. Without an
//! active transformation (TRAORI is a later issue) machine space is part space, axis by axis. Does not know speed.

mod chain;
mod joint_path;
mod wire;

pub use chain::{Direction, Kinematics, Quaternion, ToolPose};
pub use wire::*;
