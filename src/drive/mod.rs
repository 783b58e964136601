//! Setpoint -> AxisSignals: the cascade of one axis, models/drive.md. One file per box of the control diagram.
//!
//! In: position set-points, one a position cycle. Out: [`AxisSignals`]. Does not know other axes, paths or programs.
//!
//! ```text
//! x_set ─┬─ delay ── x_ref ─(+)─ position_loop ── w_ref ─(+)─ speed_loop ── i_ref ─(+)─ current_loop ── u ── plant ─┬─ i, w, th
//!        │                   └── encoder ◄─── th          └── encoder ◄── w          └──────── i ◄────────────────┘
//!        └─ feedforward: v_ff into the position loop's output, t_ff into the speed loop's output
//! ```
//!
//! What a SINUMERIK axis has besides is off unless asked for: `jerk_filter` before all, `filter` around the speed loop, `reversal`,
//! `backlash`, `pitch_error` of a screw, and `second_mass`, a load behind a spring. `axis_drive` wires the boxes; `linear_model` and `frequency` are what the boxes do to a sine; `choice` lets the kernel treat an axis without drive data (`ideal`) alike; `plain` is
//! the short way of an axis without all that, `batch` steps many drives at once, `block` by `block`; `spindle` is how the master spindle
//! lags. `docs/drive.md` has picture, law and code side by side.

mod axis_drive;
mod backlash;
mod batch;
mod block;
mod choice;
mod current_loop;
mod delay;
mod encoder;
mod feedforward;
mod filter;
mod frequency;
mod ideal;
mod integral;
mod jerk_filter;
mod lanes;
mod limit;
mod linear_model;
mod monitor;
mod outer_lanes;
mod pitch_error;
mod plain;
mod plant;
mod position_loop;
mod reversal;
mod second_mass;
mod speed_loop;
mod spindle;
mod transition;
mod wire;

pub use axis_drive::{AxisDrive, DriveInput};
pub use batch::{DriveBatch, Steps};
pub use block::Instructions;
pub use choice::Drive;
pub use frequency::{FrequencyResponses, GainMargin, LOWEST_HZ, LoopResponse, PhaseMargin, Point, frequency_responses};
pub use ideal::IdealDrive;
pub use plant::{Piece, Plant, PlantState};
pub use second_mass::{TwoMass, TwoMassPiece, TwoMassState};
pub use spindle::{SpindleLag, SpindleSignals};
pub use wire::*;
