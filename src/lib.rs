//! # sollwert: a virtual NC kernel
//!
//! *Sollwert* is German for set-point. The crate reads a SINUMERIK NC program and a machine description and does, cycle by
//! cycle, what the control and the drives of that machine would do; every signal is recorded.
//!
//! ## The block diagram
//!
//! The folder list below is the block diagram: data flows down the list, and a room uses only rooms above it
//! (`tests/tidy.rs` checks that).
//!
//! ```text
//!   NC text                                                      machine file
//!      |                                                              |
//!  +---v-----+ Block +-------------+ Move +-----------+ Contour  +----v----+
//!  | program |------>| interpreter |----->| smoothing |---+      | machine |---> every room
//!  +---------+       +-------------+      +-----------+   |      +---------+
//!                                                         v
//!  +--------------+ TimeLaw +------+ JointPath +------------+
//!  | interpolator |<--------| feed |<----------| kinematics |        preparation: at most
//!  +--------------+         +------+           +------------+        look_ahead.blocks ahead
//!      | Setpoint, every t_s
//!      v
//!  +-------+ AxisSignals, every position cycle +----------+
//!  | drive |---------------------------------->| recorder |---> MCAP
//!  +-------+                                   +----------+
//!      `---------------- kernel: the loop ---------'
//! ```
//!
//! ## Follow one block
//!
//! `N330 G0 X-10.46 Y-22.721 Z16. S10345 D1 M3 M7` in a program on a disk:
//!
//! 1. [`program`] decodes the bytes, finds the line and makes a [`program::Block`]: block number, words, spans. A typo becomes a
//!    [`base::diagnostics::Diagnostic`] with the place marked, and reading goes on with the next line.
//! 2. [`interpreter`] executes it: modal state, expressions, frames. Out comes an [`interpreter::Move`]: a rapid to an end point
//!    in all axes (mm, rad), plus the events S, D, M3, M7 that belong to its start. Control flow ends here: what follows sees a
//!    plain sequence.
//! 3. [`smoothing`] looks at the corner between this move and the next, and rounds it if the path mode says so. Out come
//!    [`smoothing::ContourPiece`]s: curves ([`geometry`]) with the block that they came from.
//! 4. [`kinematics`] turns the contour in part space into a [`kinematics::JointPath`] q(s) of the axes.
//! 5. [`feed`] finds the speeds that every axis allows, looks ahead `look_ahead.blocks` blocks, and fixes the time law of the
//!    piece: at most seven phases of constant jerk, each of which knows which limit holds it.
//! 6. [`interpolator`] samples it at k * t_s: a [`interpolator::Setpoint`] with position, velocity, acceleration and jerk of
//!    every axis, the NC line and the limit that holds at that instant.
//! 7. [`drive`] follows it: position, speed and current loops, motor and mechanics of every axis, down to the current cycle.
//! 8. [`recorder`] writes all of it to MCAP on a thread of its own; [`kernel`] owns the loop.
//!
//! The rooms below the kernel read what it recorded, and what controls recorded: [`trace`], [`compare`], [`identify`] (parameters of a
//! drive from traces of it), [`report`].
//!
//! Beside the cycle, [`optimum`] takes the pieces that feed has planned and finds the least time for the same path under the same
//! limits (`sollwert time --optimal`).
//!
//! ## As a library
//!
//! The command is one user of [`kernel::Kernel`]; this is another. A clone of the kernel is a snapshot of its whole state.
//!
//! ```
//! use sollwert::kernel::{Kernel, Status};
//! use sollwert::program::ProgramSource;
//! use std::sync::Arc;
//!
//! let machine = Arc::new(sollwert::machine::load("spinner_mvc850", &[]).unwrap().machine);
//! let x = machine.axis_by_name("X").unwrap();
//! let program = ProgramSource::from_bytes("square.mpf", "G642 CTOL=0.05\nG1 X10 F3000\nY10\nX0\nY0\nM30\n".as_bytes());
//! let mut kernel = Kernel::new(machine, program, true);
//! let mut lag_max_mm = 0.0_f64;
//! while kernel.cycle().unwrap() == Status::Running {
//!     for row in kernel.output().rows.iter().filter(|row| row.axis == x) {
//!         lag_max_mm = lag_max_mm.max(row.signals.following_error_lu.abs());
//!     }
//! }
//! assert_eq!(kernel.figures().corners_total, 3);
//! // At 50 mm/s the balancing delay of 1.2 ms alone makes 0.06 mm; the acceleration adds a little.
//! assert!(lag_max_mm > 0.05 && lag_max_mm < 0.1);
//! ```
//!
//! ## Positions along the pipeline
//!
//! | name | space | where |
//! |---|---|---|
//! | programmed position | workpiece frame (WCS), as typed | inside `interpreter` |
//! | end point of a move | [`base::space::PartPoint`]: basic frame (BCS), after all frames, tool tip | `interpreter` -> `kinematics` |
//! | position set-point | [`base::space::MachinePoint`]: one value an axis (MCS) | `kinematics` -> `drive` |
//! | position reference | set-point after the balancing delay | inside `drive` |
//! | actual, measured position | load side; as the encoder gives it | `drive` -> `recorder` |
//!
//! ## Time
//!
//! One integer clock ([`base::clock::TimeBase`]): a tick is a common divisor of all periods of the machine. Seconds are computed
//! from ticks, never summed up. Threads change nothing: how far preparation is ahead is counted in blocks and ticks.

pub mod base;
pub mod machine;
pub mod program;
pub mod interpreter;
pub mod geometry;
pub mod smoothing;
pub mod kinematics;
pub mod feed;
pub mod optimum;
pub mod interpolator;
pub mod drive;
pub mod recorder;
pub mod kernel;
pub mod trace;
pub mod compare;
pub mod identify;
pub mod tune;
pub mod report;
pub mod cli;
