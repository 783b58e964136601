//! What travels from the cycle to the writer's thread: records by value, in batches that are used again and again.
//!
//! In: the wires of a tick. Out: [`Batch`]. Units are those inside; conversion is left to the writer's thread.

use super::event::EventRecord;
use super::schema::ToolPose;
use crate::base::{AxisId, Tick};
use crate::drive::{AxisSignals, SpindleSignals};
use crate::interpolator::{AxisSetpoint, PathSample};
use crate::interpreter::ProgrammedBlock;
use crate::program::{BlockRef, OpenedProgram};
use std::sync::Arc;

/// Records in a batch: about two simulated centiseconds of five axes at 1 kHz, so that the channel is touched seldom.
pub(super) const BATCH_RECORDS: usize = 512;
/// Batches on the way at most. When all are, the cycle waits for the disk.
pub(super) const BATCHES: usize = 16;

/// One message to be.
#[derive(Clone, Debug)]
pub(super) enum Record {
    /// `due`: bits of the fields that are recorded at this tick.
    Axis {
        tick: Tick,
        axis: AxisId,
        setpoint: AxisSetpoint,
        signals: AxisSignals,
        due: u32,
    },
    Path {
        tick: Tick,
        sample: PathSample,
        contour_error_mm: Option<f64>,
    },
    Spindle {
        tick: Tick,
        signals: SpindleSignals,
    },
    Pose {
        tick: Tick,
        which: ToolPose,
        position_mm: [f64; 3],
        quaternion_xyzw: [f64; 4],
    },
    Event {
        tick: Tick,
        block: Option<BlockRef>,
        event: EventRecord,
    },
    Programmed {
        tick: Tick,
        block: Arc<ProgrammedBlock>,
    },
    Program {
        tick: Tick,
        program: OpenedProgram,
    },
}

impl Record {
    pub(super) fn tick(&self) -> Tick {
        match self {
            Self::Axis { tick, .. }
            | Self::Path { tick, .. }
            | Self::Spindle { tick, .. }
            | Self::Pose { tick, .. }
            | Self::Event { tick, .. }
            | Self::Programmed { tick, .. }
            | Self::Program { tick, .. } => *tick,
        }
    }
}

/// Records in order, and whether the chunk ends after them.
#[derive(Debug)]
pub(super) struct Batch {
    pub(super) records: Vec<Record>,
    /// Close the chunk and push it to the disk.
    pub(super) close_chunk: bool,
}

impl Batch {
    pub(super) fn empty() -> Self {
        Self { records: Vec::with_capacity(BATCH_RECORDS), close_chunk: false }
    }
}

/// What the writer's thread is told.
pub(super) enum Order {
    Write(Batch),
    /// The figures of the run, as metadata by name; then the index. Without it the file stays unfinished.
    Finish(std::collections::BTreeMap<String, String>),
}
