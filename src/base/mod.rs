//! Vocabulary of the house: units, axes, spaces, clock, diagnostics.
//!
//! Every room may use these; they use no room.

pub mod axes;
pub mod clock;
pub mod diagnostics;
pub mod portable;
pub mod space;
pub mod units;

pub use axes::{AXES_MAX, AxisId, AxisKind, PerAxis};
pub use clock::{Tick, TimeBase};
pub use diagnostics::{Diagnostic, Severity, SourceText, Span};
pub use portable::Portable;
pub use space::{AxisVector, MachinePoint, PartPoint};
