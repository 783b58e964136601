//! Traces of an axis -> the parameters of its drive, each with a 95 % interval, or the reason why the trace cannot tell it.
//!
//! In: traces of any known format ([`Trace`](crate::trace::Trace)), the machine with what is taken as known (torque constant, transmission, cycles). Out:
//! [`AxisResult`]s: [`Estimate`]s and [`Refusal`]s, keyed like the machine file. What a trace must hold, the method and its formulas stand in
//! docs/identify.md, in the order of the files here: `record` reads one axis of a trace, `motion` filters it without a shift in time,
//! `plausible` and `choice` leave unfit traces out, `normal` solves least squares in blocks (intervals from leaving blocks out), `friction` and `staged` fit the
//! mechanics, `beyond` looks at what their law does not have, `aliasing`
//! mends a current that was sampled on its sawtooth, `feedforward` and `speed_loop` the controllers, `refine` simulates the axis itself. `plan` and
//! `plan_control` write the programs to record. `profile`, `path`, `knobs`,
//! `search`, `shape`, `words`, `choose`, `contradict` and `control` calibrate the control: corner smoothing and time law from the set-points of programs.
//! Does not tune anything, and takes nothing from a machine file that it says it has identified.

mod aliasing;
mod axis;
mod beyond;
mod choice;
mod choose;
mod contradict;
mod control;
mod feedforward;
mod friction;
mod knobs;
mod motion;
mod normal;
mod path;
mod plan;
mod plan_control;
mod plausible;
mod profile;
mod record;
mod refine;
mod search;
mod shape;
mod speed_loop;
mod staged;
mod wire;
mod words;
mod write;

pub use axis::{IdentifyOptions, identify};
pub use control::{Agreement, ControlEstimate, ControlResult, FeedOverPath, TracedProgram, calibrate};
pub(crate) use normal::student_t;
pub use plan::{PLANNED_SIGNALS, PlannedProgram, PlannedSignal, plan};
pub(crate) use record::unwrap;
pub use wire::{AxisResult, Estimate, Figure, Means, Parameter, Refusal, TorqueSource};
pub use write::machine_text;
