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
//! What a SINUMERIK axis has besides is off unless asked for: `jerk_filter` before all, `filter` around the speed loop, `reversal` and
//! `backlash`. `axis_drive` wires the boxes; `choice` lets the kernel treat an axis without drive data (`ideal`) alike. `docs/drive.md` has
//! picture, law and code side by side.

mod axis_drive;
mod backlash;
mod choice;
mod current_loop;
mod delay;
mod encoder;
mod feedforward;
mod filter;
mod ideal;
mod jerk_filter;
mod limit;
mod monitor;
mod plant;
mod position_loop;
mod reversal;
mod speed_loop;
mod transition;
mod wire;

pub use axis_drive::{AxisDrive, DriveInput};
pub use choice::Drive;
pub use ideal::IdealDrive;
pub use plant::{Piece, Plant, PlantState};
pub use wire::*;
