//! Block -> [`Move`]: executes the program. Modal state, expressions, control flow, frames.
//!
//! In: [`crate::program`] blocks, the machine's axis names and defaults. Out: a stream of [`Move`]s in the basic coordinate
//! system, one at a time, and diagnostics. Does not know corners, speeds or time.
//!
//! Decisions where the language leaves room:
//!
//! * Words of a block take effect from left to right (assignments, G functions), then feed, frame, M6, motion, M0/M1/M2/M30.
//! * A block with axis words is a move, also where it leads to where the axes stand: it has a line in the listing, and G9 or G60 stops
//!   in it. It takes no time, so that a loop of such blocks alone counts as endless.
//! * G53 leaves the basic frame in force for its block, G153 and SUPA no frame.
//! * G70 converts positions, arcs and frames; G700 also F, CTOL and ADIS. Rotary axes are never converted.
//! * With G91 or IC() an axis also makes good a change of frames since its last motion (SD42440 = 1, the control's default).
//! * Absolute positions of an endless axis are taken as they are; DC, ACP and ACN choose the way round.
//! * Blocks with `/` to `/9` are executed, unless their level is among the active skip levels of the [`Setup`].
//! * G601, G602 and G603 travel in the modes; the kernel waits for the axes where drives are simulated. FFWON is active from the start (MD32630 = 0: always as the machine file says).

mod active_frames;
mod alarm;
mod arc;
mod block;
mod call;
mod check;
mod curve_motion;
mod curve_state;
mod curve_words;
mod definitions;
mod direction;
mod evaluate;
mod feed_state;
mod feed_words;
mod flow;
mod frame;
mod frame_variables;
mod frame_words;
mod g_groups;
mod jump;
mod listing;
mod listing_curves;
mod modal;
mod motion;
mod path_feed;
mod parameters;
mod path_words;
mod placement;
mod positioning;
mod run;
mod setup;
mod spindle_position;
mod spindle_words;
pub mod spline;
mod spline_blocks;
mod strings;
mod synchronised;
mod system_constants;
mod system_values;
mod thread;
mod tool_variables;
mod tool_words;
mod value;
mod variables;
mod wire;
mod work_area;
mod zero_offsets;

pub use crate::program::{ProgramSource, known_words};
pub use active_frames::{ActiveFrames, Total};
pub use check::check;
pub use frame::{Component, Frame, GeometryAxes, Matrix};
pub use listing::{Listing, feed_per_minute, format_move, kind_name, listing};
pub use run::Interpreter;
pub use setup::Setup;
pub use wire::*;
pub use zero_offsets::{SETTABLE_MAX, ZeroOffsets};
