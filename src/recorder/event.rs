//! What `/event` can tell.
//!
//! In: events of the interpreter, corners of smoothing, findings. Out: [`EventRecord`], which is cheap to hand to the writer.
//! Does not format: that is done on the writer's thread.

use crate::base::{Diagnostic, Severity};
use crate::interpreter::Event;
use std::sync::Arc;

/// Something that happens at an instant.
#[derive(Clone, Debug, PartialEq)]
pub enum EventRecord {
    /// The first set-point of a block.
    BlockStart,
    /// M function.
    MFunction(u32),
    /// S word.
    SpindleSpeed {
        /// Speed.
        speed_rpm: f64,
    },
    /// T word, number or name.
    Tool(Arc<str>),
    /// D word.
    Edge(u32),
    /// MSG("..."); empty clears.
    Message(Arc<str>),
    /// A program file was opened for the first time.
    ProgramOpened(Arc<str>),
    /// A corner blend begins: an entry of `corners`.
    Corner {
        /// Turning angle, 0 = straight.
        angle_rad: f64,
        /// epsilon as executed.
        tolerance_mm: f64,
        /// T.
        transition_length_mm: f64,
        /// Feed at the entry of the blend.
        feed_mm_s: f64,
    },
    /// $AN_SLTRACE: a trace starts (true) or stops.
    Trace(bool),
    /// H function.
    HFunction(f64),
    /// S, M or SPOS of a spindle, as text.
    Spindle(Arc<str>),
    /// Worth knowing: the run goes on.
    Warning {
        /// Stable code.
        code: &'static str,
        /// What.
        message: Arc<str>,
    },
    /// The run stops here. Everything recorded so far is pushed to the disk.
    Alarm {
        /// Stable code.
        code: &'static str,
        /// What.
        message: Arc<str>,
    },
}

impl From<&Event> for EventRecord {
    fn from(event: &Event) -> Self {
        match event {
            Event::ProgramOpened(program) => Self::ProgramOpened(program.name.clone()),
            Event::MFunction(number) => Self::MFunction(*number),
            Event::SpindleSpeed { speed_rpm } => Self::SpindleSpeed { speed_rpm: *speed_rpm },
            Event::Tool(tool) => Self::Tool(tool.clone()),
            Event::Edge(number) => Self::Edge(*number),
            Event::Message(text) => Self::Message(text.clone()),
            Event::Trace(starts) => Self::Trace(*starts),
            Event::HFunction(value) => Self::HFunction(*value),
            Event::Spindle(text) => Self::Spindle(text.clone()),
            Event::SpindlePosition(positioning) => Self::Spindle(positioning.text.clone()),
            // The axes, the override and the spindle themselves are on record.
            Event::Position(_)
            | Event::Synchronised(_)
            | Event::CancelSynchronised(_)
            | Event::SpindleWait
            | Event::SpindleAcceleration { .. }
            | Event::Programmed(_) => Self::BlockStart,
        }
    }
}

impl From<&Diagnostic> for EventRecord {
    /// An error is an alarm, everything else a warning.
    fn from(finding: &Diagnostic) -> Self {
        let (code, message) = (finding.code, Arc::from(finding.message.as_str()));
        match finding.severity {
            Severity::Error => Self::Alarm { code, message },
            Severity::Warning | Severity::Note => Self::Warning { code, message },
        }
    }
}
