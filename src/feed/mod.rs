//! JointPath -> TimeLaw: the speed along the path, so that every limit of every axis holds.
//!
//! In: [`JointPath`](crate::kinematics::JointPath)s in order. Out: [`PlannedPiece`]s in order, each fixed for good once it is handed out. Sees at most
//! `look_ahead.blocks` motion blocks beyond the one that it fixes. Does not sample.

mod blend_limits;
mod continuous;
mod crept;
mod feed_override;
mod group;
mod junction;
mod limits;
mod modes;
mod planner;
mod positioning;
mod printed_arc;
pub mod profile;
mod programmed;
mod published;
pub mod ramp;
mod rules;
mod scan;
mod spindle;
mod split;
mod synchronised;
mod thread;
mod varying;
mod wire;
mod worst;

pub use feed_override::{OverrideChange, OverrideSchedule};
pub use planner::Planner;
pub use programmed::ProgrammedTime;
pub use rules::{AxisCaps, PathRules, PieceRules};
pub use wire::*;
