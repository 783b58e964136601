//! T, D and M6 with a tool table: which edge is active, and what its length does.
//!
//! In: tool and edge words, the working plane. Out: the active [`ToolOffset`], and where the tip of it is while the axes stand.
//!
//! * T selects, M6 changes; with `change_with_m6 = false` T changes (MD22550). A change makes D1 active, unless the block says another
//!   D (MD20270 = 1). D0 has no length and no radius.
//! * L1 belongs to the infeed axis of the plane: G17 Z, Y, X; G18 Y, X, Z; G19 X, Z, Y. For turning tools (types 500 to 599):
//!   G17 Y, X, Z; G18 X, Z, Y; G19 Z, Y, X. Another plane with an active tool deals the lengths out anew.
//! * The axes stand when the edge changes: the tip is elsewhere. An axis without a word stays where it stands; an incremental word
//!   counts from the position programmed last and so makes the change good (SD42442 = 1).
//! * What a program writes to $TC_DP is used from the next T, D or plane on.
//! * Without a tool table the length of every tool is 0 (a warning once a run). With one, a tool that it does not have is an alarm.

use super::block::Collected;
use super::run::Interpreter;
use super::wire::{Event, ToolOffset};
use crate::base::AxisVector;
use crate::base::diagnostics::nearest;
use crate::machine::{ToolEdge, ToolTable};
use crate::program::words::Plane;
use crate::program::{Columns, Fault, Outcome, codes};
use std::sync::Arc;

/// T0: no tool.
const NO_TOOL: &str = "0";
/// D0: no length and no radius, whatever the tool.
const NO_EDGE: u32 = 0;
/// The edge that a tool change makes active.
const FIRST_EDGE: u32 = 1;
/// Types of turning tools.
const TURNING: std::ops::RangeInclusive<u32> = 500..=599;

/// Tools of a run.
#[derive(Clone, Debug)]
pub(super) struct ToolState {
    /// Data of all tools.
    pub table: Arc<ToolTable>,
    /// True if the table came from a file: it is complete then.
    is_given: bool,
    /// T word that waits for M6.
    selected: Option<Arc<str>>,
    /// The tool in the spindle; `None`: none.
    pub active: Option<Arc<str>>,
    /// Active edge.
    pub edge: u32,
    /// Plane for which the lengths were dealt out.
    plane: Plane,
}

impl ToolState {
    /// No tool in the spindle.
    pub fn new(given: Option<Arc<ToolTable>>) -> Self {
        Self {
            is_given: given.is_some(),
            table: given.unwrap_or_default(),
            selected: None,
            active: None,
            edge: NO_EDGE,
            plane: Plane::G17,
        }
    }

    /// Data of the active edge.
    pub fn active_edge(&self) -> Option<&ToolEdge> {
        self.table.find(self.active.as_ref()?)?.edges.get(&self.edge)
    }
}

impl Interpreter {
    /// T: selects, and says whether it also changes.
    pub(super) fn select_tool(&mut self, name: &Arc<str>, columns: &Columns) -> Outcome<bool> {
        let known = &**name == NO_TOOL || self.tools.table.find(name).is_some();
        if !known && self.tools.is_given {
            let names: Vec<String> = self.tools.table.names().collect();
            // A number near another is no typing error of it.
            let is_number = name.bytes().all(|byte| byte.is_ascii_digit());
            let near = nearest(name, names.iter().map(String::as_str)).filter(|_| !is_number);
            let near = near.map(|near| format!("did you mean `{near}`?"));
            let help = near.unwrap_or_else(|| format!("the table has {}", shortened(&names)));
            return Err(Fault::new(
                codes::UNKNOWN_TOOL,
                columns.clone(),
                format!("the tool table has no tool `{name}`"),
            )
            .label("unknown tool")
            .help(help));
        }
        if !known {
            self.report_tool("tool", name, columns);
        }
        self.tools.selected = Some(name.clone());
        Ok(!self.tools.table.change_with_m6)
    }

    /// T, D, M6 and the plane of a block, before its motion.
    pub(super) fn tool_words(&mut self, block: &mut Collected, events: &mut Vec<Event>) -> Outcome<()> {
        let tip_moved = self.change_and_apply(block)?;
        if block.tool_change {
            let tool_events = std::mem::take(&mut block.tool_events);
            self.emit_function(tool_events, true);
        } else if tip_moved {
            // Later rooms learn from a move without motion that the tip is elsewhere.
            let is_of_tool = |event: &Event| matches!(event, Event::Tool(_) | Event::Edge(_));
            let of_tool = events.iter().filter(|event| is_of_tool(event)).cloned().collect();
            events.retain(|event| !is_of_tool(event));
            self.emit_function(of_tool, false);
        }
        Ok(())
    }

    /// True if the tip of the tool is elsewhere afterwards.
    pub(super) fn change_and_apply(&mut self, block: &mut Collected) -> Outcome<bool> {
        let changes = block.tool_change || block.tool_loads;
        let edge = block.edge.take();
        if changes {
            self.change_tool();
        }
        match &edge {
            Some((edge, columns)) => self.select_edge(*edge, columns)?,
            None if changes && self.tools.is_given && self.tools.active.is_some() => {
                self.report_missing_edge();
            }
            None => {}
        }
        Ok((changes || edge.is_some() || self.tool_is_stale()) && self.apply_tool())
    }

    /// D1 of a tool that has none.
    fn report_missing_edge(&mut self) {
        if self.tools.active_edge().is_none() {
            let end = self.source.line_text(self.current).trim_end().len() as u32;
            self.report_tool("edge", &format!("D{FIRST_EDGE}"), &(0..end));
        }
    }

    /// The selected tool comes into the spindle, with D1.
    fn change_tool(&mut self) {
        if let Some(selected) = self.tools.selected.take() {
            self.tools.active = Some(selected).filter(|name| &**name != NO_TOOL);
        }
        self.tools.edge = if self.tools.active.is_some() { FIRST_EDGE } else { NO_EDGE };
    }

    /// D.
    fn select_edge(&mut self, edge: u32, columns: &Columns) -> Outcome<()> {
        self.tools.edge = edge;
        if edge == NO_EDGE || self.tools.active_edge().is_some() {
            return Ok(());
        }
        let tool = self.tools.active.as_ref().and_then(|name| self.tools.table.find(name));
        match (tool, self.tools.is_given) {
            (Some(tool), true) => {
                let edges: Vec<String> = tool.edges.keys().map(|edge| format!("D{edge}")).collect();
                let has =
                    if edges.is_empty() { "it has none".to_owned() } else { format!("it has {}", shortened(&edges)) };
                let message = format!("the tool {} has no edge D{edge}", tool.title());
                Err(Fault::new(codes::UNKNOWN_TOOL, columns.clone(), message).label("unknown edge").help(has))
            }
            _ => {
                self.report_tool("edge", &format!("D{edge}"), columns);
                Ok(())
            }
        }
    }

    /// Brings length and radius up to date; true if the tip of the tool is elsewhere now.
    fn apply_tool(&mut self) -> bool {
        self.tools.plane = self.modal.plane;
        let offset = self.tools.active_edge().map(|edge| ToolOffset {
            tool: self.tools.active.clone().unwrap_or_else(|| NO_TOOL.into()),
            edge: self.tools.edge,
            length: self.dealt_out(edge),
            radius_mm: edge.total_radius_mm(),
        });
        if self.modal.tool.as_deref() == offset.as_ref() {
            return false;
        }
        let length = |tool: Option<&ToolOffset>| tool.map_or(AxisVector::zero(), |tool| tool.length);
        let moved = length(self.modal.tool.as_deref()) - length(offset.as_ref());
        self.modal.tool = offset.map(Arc::new);
        if moved == AxisVector::zero() {
            return false;
        }
        self.position.0 += moved;
        true
    }

    /// True if the plane has changed since the lengths were dealt out.
    fn tool_is_stale(&self) -> bool {
        self.modal.tool.is_some() && self.tools.plane != self.modal.plane
    }

    /// Lengths of an edge as components of the axes.
    fn dealt_out(&self, edge: &ToolEdge) -> AxisVector {
        let places = match (self.modal.plane, TURNING.contains(&edge.kind)) {
            (Plane::G17, false) => [2, 1, 0],
            (Plane::G18, false) => [1, 0, 2],
            (Plane::G19, false) => [0, 2, 1],
            (Plane::G17, true) => [1, 0, 2],
            (Plane::G18, true) => [0, 2, 1],
            (Plane::G19, true) => [2, 1, 0],
        };
        let mut length = AxisVector::zero();
        for (place, length_mm) in places.into_iter().zip(edge.total_length_mm()) {
            if let Some(axis) = self.geometry[place] {
                length[axis] = length_mm;
            }
        }
        length
    }

    /// No data: reports the first tool or edge that is selected, once a run.
    fn report_tool(&mut self, what: &str, name: &str, columns: &Columns) {
        if self.first_report(codes::NO_TOOL_DATA) {
            let message = format!("{what} `{name}` has no data: length and radius of every tool count as 0");
            let fault = Fault::new(codes::NO_TOOL_DATA, columns.clone(), message)
                .label("no data")
                .help("give a tool table with -t; further tools without data are not reported");
            self.warn(*fault);
        }
    }
}

/// A list that fits a line.
fn shortened(names: &[String]) -> String {
    const SHOWN_MAX: usize = 12;
    let more = if names.len() > SHOWN_MAX { ", ..." } else { "" };
    format!("{}{more}", names.iter().take(SHOWN_MAX).cloned().collect::<Vec<_>>().join(", "))
}
