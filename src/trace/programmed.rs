//! What the program of a recording asks of the path, block by block.
//!
//! In: messages of `/programmed` in order, names and kinds of the axes. Out: [`ProgrammedPath`]: points of all axes in one list, a row for
//! every block. Memory: 8 bytes a value, at most [`VALUES_MAX`] of them; what is beyond is left out, and the path says so. Does not turn
//! axes into points in space: that is comparison.

use crate::base::units::rad_from_deg;
use crate::base::{AXES_MAX, AxisKind};
use crate::recorder::schema::proto::sollwert::Programmed;
use std::sync::Arc;

/// Values of all points: 480 MB.
const VALUES_MAX: usize = 60_000_000;
/// Tools and programs at most.
const NAMES_MAX: usize = 4096;

/// The contour that a program asks for, before corners are rounded and blocks compressed.
#[derive(Clone, Debug, Default)]
pub struct ProgrammedPath {
    /// Axes in the order of the values.
    axes: Vec<(String, AxisKind)>,
    blocks: Vec<ProgrammedRow>,
    /// mm or rad, axis by axis, point by point.
    values: Vec<f64>,
    /// Lengths of the tools: position of the axes minus position of the tip.
    tools: Vec<[f64; AXES_MAX]>,
    programs: Vec<Arc<str>>,
    truncated: bool,
}

/// One block of a [`ProgrammedPath`].
#[derive(Clone, Copy, Debug)]
struct ProgrammedRow {
    time_s: f64,
    /// Place of its first point.
    first_point: u32,
    line: u32,
    program: u16,
    tool: u16,
    motion: Motion,
}

/// How the points of a block are driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// G0.
    Rapid,
    /// A straight block with a feed.
    Line,
    /// A curve.
    Curve,
    /// Every axis on its own: no contour.
    Positioning,
}

/// One block as [`ProgrammedPath::block`] shows it.
#[derive(Clone, Copy, Debug)]
pub struct ProgrammedView<'a> {
    /// When it begins.
    pub time_s: f64,
    /// File name of its program.
    pub program: &'a Arc<str>,
    /// Line in it.
    pub line: u32,
    /// How it is driven.
    pub motion: Motion,
    /// Points of all axes, `[points][axes]`, mm or rad, tip of the tool.
    pub values: &'a [f64],
    /// Position of the axes minus position of the tip, `[axes]`, mm.
    pub tool_length_mm: &'a [f64],
}

impl ProgrammedPath {
    /// Of a machine with these axes.
    pub fn new(axes: Vec<(String, AxisKind)>) -> Self {
        Self { axes, ..Self::default() }
    }

    /// Takes the next message. A message that does not fit (points that are not of all axes, no points, values that are not finite) is passed over.
    pub fn push(&mut self, time_s: f64, message: &Programmed) {
        let width = self.axes.len();
        let whole = width > 0 && !message.points.is_empty() && message.points.len().is_multiple_of(width);
        if !whole || !message.points.iter().all(|value| value.is_finite()) {
            return;
        }
        let first_point = u32::try_from(self.values.len() / width).ok();
        let (Some(first_point), true) = (first_point, self.values.len() + message.points.len() <= VALUES_MAX) else {
            self.truncated = true;
            return;
        };
        let program = place(&mut self.programs, |known| **known == *message.program(), || message.program().into());
        let mut length = [0.0; AXES_MAX];
        length.iter_mut().zip(&message.tool_length_mm).for_each(|(own, told)| *own = *told);
        let tool = place(&mut self.tools, |known| *known == length, || length);
        let (Some(program), Some(tool)) = (program, tool) else {
            self.truncated = true;
            return;
        };
        let motion = match message.motion() {
            "rapid" => Motion::Rapid,
            "line" => Motion::Line,
            "positioning" => Motion::Positioning,
            _ => Motion::Curve,
        };
        self.blocks.push(ProgrammedRow { time_s, first_point, line: message.line(), program, tool, motion });
        let kinds = self.axes.iter().map(|(_, kind)| *kind).cycle();
        self.values.extend(message.points.iter().zip(kinds).map(|(value, kind)| match kind {
            AxisKind::Linear => *value,
            AxisKind::Rotary => rad_from_deg(*value),
        }));
    }

    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.blocks.len()
    }

    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// The program is longer than what is held in memory: the end is missing.
    pub fn is_truncated(&self) -> bool {
        self.truncated
    }

    /// Names of the axes in the order of the values.
    pub fn axes(&self) -> impl Iterator<Item = &str> {
        self.axes.iter().map(|(name, _)| name.as_str())
    }

    /// A block; `None` beyond the last.
    pub fn block(&self, index: usize) -> Option<ProgrammedView<'_>> {
        let row = self.blocks.get(index)?;
        let width = self.axes.len();
        let end = self.blocks.get(index + 1).map_or(self.values.len(), |next| next.first_point as usize * width);
        Some(ProgrammedView {
            time_s: row.time_s,
            program: self.programs.get(usize::from(row.program))?,
            line: row.line,
            motion: row.motion,
            values: self.values.get(row.first_point as usize * width..end)?,
            tool_length_mm: self.tools.get(usize::from(row.tool)).map_or(&[], |length| &length[..width.min(AXES_MAX)]),
        })
    }

    /// The last block that has begun at a time; `None` before the first.
    pub fn index_at(&self, time_s: f64) -> Option<usize> {
        self.blocks.partition_point(|row| row.time_s <= time_s).checked_sub(1)
    }

    /// Whether any tool has a length.
    pub fn has_tools(&self) -> bool {
        self.tools.iter().flatten().any(|length| *length != 0.0)
    }
}

/// Place of an entry in a list, which grows where it is new; `None` where the list is full.
fn place<T>(list: &mut Vec<T>, is_it: impl Fn(&T) -> bool, make: impl FnOnce() -> T) -> Option<u16> {
    // Most blocks are of the program and the tool of the one before.
    let found = list.iter().rposition(is_it);
    let found = found.or_else(|| {
        (list.len() < NAMES_MAX).then(|| {
            list.push(make());
            list.len() - 1
        })
    })?;
    u16::try_from(found).ok()
}
