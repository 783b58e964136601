//! Tools and zero offsets as a run finds them: what `tools.toml` says, checked.
//!
//! In: nothing (plain data). Out: [`Workshop`], [`ToolTable`], [`Tool`], [`ToolEdge`], [`ZeroOffset`]. Lengths are those of the
//! control's tool parameters ($TC_DP3 and so on): which axis each belongs to depends on the working plane and is decided later.

use crate::base::{AxisVector, PerAxis};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Highest number of an edge.
pub const EDGE_MAX: u32 = 32_000;

/// What a workshop file holds.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Workshop {
    /// The tools; `None` if the file has no table of them.
    pub tools: Option<ToolTable>,
    /// Settable frames by number (0: G500, 1: G54, 5: G505).
    pub settable: BTreeMap<u16, ZeroOffset>,
    /// Basic frame.
    pub basic: Option<ZeroOffset>,
}

/// All tools.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolTable {
    /// True: T selects, M6 changes. False: T changes (MD22550).
    pub change_with_m6: bool,
    /// Tools in the order of the file.
    pub tools: Vec<Tool>,
}

/// A tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Tool {
    /// T number; 0 if it has a name only.
    pub number: u32,
    /// Name, for T="name".
    pub name: Option<Arc<str>>,
    /// Edges by D number.
    pub edges: BTreeMap<u32, ToolEdge>,
}

/// A tool edge.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct ToolEdge {
    /// $TC_DP1: type of the tool, such as 120 for an end mill.
    pub kind: u32,
    /// $TC_DP3, 4, 5: lengths L1 to L3.
    pub length_mm: [f64; 3],
    /// $TC_DP6: radius.
    pub radius_mm: f64,
    /// $TC_DP12, 13, 14: what is added to the lengths.
    pub wear_length_mm: [f64; 3],
    /// $TC_DP15: what is added to the radius.
    pub wear_radius_mm: f64,
    /// $TC_DP21, 22, 23: lengths of the adapter, added too.
    pub base_length_mm: [f64; 3],
    /// $TC_DPn that a program has written and that have no effect here, by n.
    pub others: BTreeMap<u32, f64>,
}

/// A settable frame, before it knows which axes turn.
#[derive(Clone, Debug, PartialEq)]
pub struct ZeroOffset {
    /// Coarse translation.
    pub translation_lu: AxisVector,
    /// Fine translation.
    pub fine_lu: AxisVector,
    /// Angles about axes (only linear axes turn).
    pub rotation_rad: AxisVector,
    /// Scale factors.
    pub scale_ratio: AxisVector,
    /// Mirrored axes.
    pub mirror: PerAxis<bool>,
}

impl Default for ToolTable {
    fn default() -> Self {
        Self { change_with_m6: true, tools: Vec::new() }
    }
}

impl Default for ZeroOffset {
    fn default() -> Self {
        Self {
            translation_lu: AxisVector::zero(),
            fine_lu: AxisVector::zero(),
            rotation_rad: AxisVector::zero(),
            scale_ratio: PerAxis::splat(1.0),
            mirror: PerAxis::splat(false),
        }
    }
}

impl ToolTable {
    /// The tool with that number (as text) or name, case-blind.
    pub fn find(&self, number_or_name: &str) -> Option<&Tool> {
        let by_name = |tool: &&Tool| tool.name.as_ref().is_some_and(|name| name.eq_ignore_ascii_case(number_or_name));
        let number = number_or_name.parse::<u32>().ok().filter(|number| *number > 0);
        let by_number = |tool: &&Tool| Some(tool.number) == number;
        self.tools.iter().find(by_number).or_else(|| self.tools.iter().find(by_name))
    }

    /// Numbers and names, for help texts.
    pub fn names(&self) -> impl Iterator<Item = String> + '_ {
        self.tools.iter().map(Tool::title)
    }
}

impl Tool {
    /// Its name, or its number.
    pub fn title(&self) -> String {
        self.name.as_ref().map_or_else(|| self.number.to_string(), |name| name.to_string())
    }
}

impl ToolEdge {
    /// L1 to L3 with wear and adapter.
    pub fn total_length_mm(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.length_mm[k] + self.wear_length_mm[k] + self.base_length_mm[k])
    }

    /// Radius with wear.
    pub fn total_radius_mm(&self) -> f64 {
        self.radius_mm + self.wear_radius_mm
    }
}
