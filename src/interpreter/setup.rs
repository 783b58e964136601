//! What a run of a program needs besides the machine: the program, and what lies around it.
//!
//! In: what the caller found. Out: [`Setup`]. Does not open anything: where sub-programs are looked for is said here, when they are is
//! the business of the call.

use super::frame::{Frame, GeometryAxes};
use super::zero_offsets::ZeroOffsets;
use crate::base::{AxisId, AxisKind};
use crate::machine::{Machine, ToolTable, Workshop};
use crate::program::{ProgramSource, Shipped};
use std::path::PathBuf;
use std::sync::Arc;

/// The main program and its surroundings.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The main program.
    pub program: ProgramSource,
    /// Folders in which sub-programs are looked for after that of the main program, in order.
    pub directories: Vec<PathBuf>,
    /// Programs inside the binary: searched last.
    pub shipped: Shipped,
    /// Definition files (GUD), executed before the program.
    pub definitions: Vec<ProgramSource>,
    /// Tool table; `None`: every tool has length 0.
    pub tools: Option<Arc<ToolTable>>,
    /// $P_UIFR and $P_UBFR at program start.
    pub zero_offsets: Arc<ZeroOffsets>,
    /// Skip levels that are active, one bit each: bit 0 is `/` and `/0`.
    pub skip_levels: u16,
    /// The switch of the spindle override at the control panel; 1: S as programmed.
    pub spindle_override_ratio: f64,
    /// Nothing will move: what only the motion lacks (F) is a finding that does not end the program, so that a listing or a check goes on
    /// to its end.
    pub lists_only: bool,
}

impl From<ProgramSource> for Setup {
    fn from(program: ProgramSource) -> Self {
        Self {
            program,
            directories: Vec::new(),
            shipped: &[],
            definitions: Vec::new(),
            skip_levels: 0,
            spindle_override_ratio: 1.0,
            lists_only: false,
            zero_offsets: Arc::default(),
            tools: None,
        }
    }
}

impl From<&ProgramSource> for Setup {
    fn from(program: &ProgramSource) -> Self {
        program.clone().into()
    }
}

impl From<&Setup> for Setup {
    fn from(setup: &Setup) -> Self {
        setup.clone()
    }
}

impl Setup {
    /// Takes over the tools and zero offsets of a workshop file; what it does not name stays.
    pub fn add_workshop(&mut self, workshop: Workshop, machine: &Machine) {
        if let Some(tools) = workshop.tools {
            self.tools = Some(Arc::new(tools));
        }
        let axes = geometry_axes(machine);
        let offsets = Arc::make_mut(&mut self.zero_offsets);
        if let Some(basic) = &workshop.basic {
            offsets.set_basic(Frame::from_offset(axes, basic));
        }
        for (number, offset) in &workshop.settable {
            offsets.set_settable(*number, Frame::from_offset(axes, offset));
        }
    }
}

/// X, Y and Z of a machine, where they are linear.
pub(super) fn geometry_axes(machine: &Machine) -> GeometryAxes {
    let linear = |id: &AxisId| machine.axis(*id).kind == AxisKind::Linear;
    ["X", "Y", "Z"].map(|name| machine.axis_by_name(name).filter(linear))
}
