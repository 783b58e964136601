//! The cycle: owns the stages, the look-ahead block buffer and the loop.
//!
//! In: a [`Machine`](crate::machine::Machine) and a program. Out: per cycle of t_s a [`CycleOutput`] with every wire, at the end the [`RunSummary`].
//! [`Kernel::cycle`] steps one t_s; a clone of the kernel is a snapshot of its whole state. [`run`] is the loop with threads, pace and
//! recording around it. Does not print.

mod alarms;
mod braking;
mod clamping;
mod contour_error;
mod cycle;
mod figures;
mod follow;
mod in_position;
mod inner_rows;
mod preparation;
mod reading;
mod record;
mod run;
mod setpoint_limits;
mod setpoint_table;
mod summary;
mod threads;
mod what_if;

pub use braking::Braking;
pub use cycle::{AxisRow, CycleOutput, Kernel, Status};
pub use figures::Figures;
pub use follow::{FollowOptions, FollowOutcome, follow};
pub use in_position::InPosition;
pub use preparation::{Findings, PieceSource, Preparation};
pub use run::{Deadlines, Progress, RunError, RunOptions, RunOutcome, run};
pub use setpoint_table::{SetpointTable, row_period_s};
pub use summary::{CornerSummary, OverrideSummary, RunSummary, Warning, drive_warnings};
pub use what_if::{Saving, WhatIf, what_if};
