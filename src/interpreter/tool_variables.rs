//! Tool data in programs: $TC_DP, $TC_TP2, $P_TOOL and their kin.
//!
//! In: names, indices, values. Out: data of edges (mm), the active tool. What a program writes is used from the next T, D or plane on. A
//! write to a tool or an edge that is not there makes it. Parameters of an edge without effect here are kept and read back; other tool
//! management ($TC_MPP, $TC_MOP and so on) is not acted on.

use super::evaluate::{evaluate, integers};
use super::run::Interpreter;
use super::value::Value;
use crate::base::diagnostics::nearest;
use crate::machine::{EDGE_MAX, Tool, ToolEdge};
use crate::program::syntax::{Expr, SystemName};
use crate::program::{Columns, Fault, NotActedOn, Outcome, codes};
use std::sync::Arc;

/// Parameters of an edge: $TC_DP1 to $TC_DP25.
const PARAMETERS: u32 = 25;
/// Most tools that a program may make.
const TOOLS_MAX: usize = 10_000;
/// Largest length that a tool may have.
const LENGTH_MAX_MM: f64 = 1e6;

impl Interpreter {
    /// Value of a variable of tools; `None`: it is none.
    pub(super) fn tool_variable(&self, system: &SystemName, columns: &Columns) -> Option<Outcome<Value>> {
        let indices = system.indices.as_slice();
        if let Some(parameter) = edge_parameter(&system.name) {
            return Some(self.edge_datum(parameter, indices, columns));
        }
        let active = || self.tools.active_edge();
        Some(Ok(match &*system.name {
            "$P_TOOL" => Value::Int(i32::try_from(self.tools.edge).unwrap_or(i32::MAX)),
            "$P_TOOLNO" => {
                let tool = self.tools.active.as_ref();
                let number = tool.map_or(0, |name| match self.tools.table.find(name) {
                    Some(tool) => tool.number,
                    None => name.parse().unwrap_or(0),
                });
                Value::Int(i32::try_from(number).unwrap_or(i32::MAX))
            }
            "$P_TOOLR" => Value::Real(active().map_or(0.0, |edge| edge.total_radius_mm())),
            "$P_TOOLL" => match self.one_of(indices, 3, &system.name, columns) {
                Ok(place) => Value::Real(active().map_or(0.0, |edge| edge.total_length_mm()[place - 1])),
                Err(fault) => return Some(Err(fault)),
            },
            "$P_AD" => match self.one_of(indices, PARAMETERS as usize, &system.name, columns) {
                Ok(number) => Value::Real(active().map_or(0.0, |edge| parameter_mm(edge, number as u32))),
                Err(fault) => return Some(Err(fault)),
            },
            _ => return None,
        }))
    }

    /// Writes a variable of tools; `None`: it is none.
    pub(super) fn set_tool_variable(
        &mut self,
        system: &SystemName,
        value: &Value,
        columns: &Columns,
        value_columns: &Columns,
    ) -> Option<Outcome<()>> {
        if let Some(parameter) = edge_parameter(&system.name) {
            return Some(self.set_edge_datum(parameter, &system.indices, value, columns, value_columns));
        }
        if &*system.name == "$TC_TP2" {
            return Some(self.set_tool_name(&system.indices, value, columns, value_columns));
        }
        if !system.name.starts_with("$TC_") {
            return None;
        }
        if let Some(entry) = NotActedOn::find("$TC_") {
            self.report_word(entry, columns);
        }
        Some(Ok(()))
    }

    fn edge_datum(&self, parameter: u32, indices: &[Expr], columns: &Columns) -> Outcome<Value> {
        let (number, edge) = self.tool_and_edge(indices, columns)?;
        let Some(tool) = self.tools.table.find(&number.to_string()) else {
            let names: Vec<String> = self.tools.table.names().collect();
            let near = nearest(&number.to_string(), names.iter().map(String::as_str))
                .map(|near| format!("did you mean `{near}`?"));
            return Err(Fault::new(codes::UNKNOWN_TOOL, columns.clone(), format!("there is no tool {number}"))
                .label("unknown tool")
                .maybe_help(near));
        };
        match tool.edges.get(&edge) {
            Some(edge) => Ok(Value::Real(parameter_mm(edge, parameter))),
            None => Err(Fault::new(codes::UNKNOWN_TOOL, columns.clone(), format!("tool {number} has no edge D{edge}"))
                .label("unknown edge")),
        }
    }

    fn set_edge_datum(
        &mut self,
        parameter: u32,
        indices: &[Expr],
        value: &Value,
        columns: &Columns,
        value_columns: &Columns,
    ) -> Outcome<()> {
        let (number, edge) = self.tool_and_edge(indices, columns)?;
        let value_mm = value.number(value_columns)?;
        if value_mm.is_nan() || value_mm.abs() > LENGTH_MAX_MM {
            return Err(Fault::new(codes::OUT_OF_RANGE, value_columns.clone(), format!("{value_mm} is no tool datum"))
                .label(format!("expected up to {LENGTH_MAX_MM}")));
        }
        let tool = self.tool_to_change(number, columns)?;
        set_parameter_mm(tool.edges.entry(edge).or_default(), parameter, value_mm);
        Ok(())
    }

    /// $TC_TP2[t]: the name of a tool.
    fn set_tool_name(
        &mut self,
        indices: &[Expr],
        value: &Value,
        columns: &Columns,
        value_columns: &Columns,
    ) -> Outcome<()> {
        let [number] = integers(indices, self)?[..] else { return Err(wrong_indices(columns, "[tool]")) };
        let Some(name) = value.text() else {
            return Err(Fault::new(codes::TYPE_MISMATCH, value_columns.clone(), "the name of a tool is a text")
                .label("expected a text"));
        };
        let number = positive(number, columns)?;
        self.tool_to_change(number, columns)?.name = Some(name);
        Ok(())
    }

    fn tool_to_change(&mut self, number: u32, columns: &Columns) -> Outcome<&mut Tool> {
        let table = Arc::make_mut(&mut self.tools.table);
        let place = match table.tools.iter().position(|tool| tool.number == number) {
            Some(place) => place,
            None if table.tools.len() >= TOOLS_MAX => {
                return Err(Fault::new(codes::TOO_MUCH_MEMORY, columns.clone(), "too many tools")
                    .label(format!("at most {TOOLS_MAX}")));
            }
            None => {
                table.tools.push(Tool { number, name: None, edges: std::collections::BTreeMap::new() });
                table.tools.len() - 1
            }
        };
        Ok(&mut table.tools[place])
    }

    fn tool_and_edge(&self, indices: &[Expr], columns: &Columns) -> Outcome<(u32, u32)> {
        let [number, edge] = integers(indices, self)?[..] else { return Err(wrong_indices(columns, "[tool,edge]")) };
        Ok((positive(number, columns)?, positive(edge, columns)?.min(EDGE_MAX)))
    }

    /// The one index, from 1 to `most`.
    fn one_of(&self, indices: &[Expr], most: usize, name: &str, columns: &Columns) -> Outcome<usize> {
        let number = match indices {
            [index] => evaluate(index, self)?.integer(&index.columns)?,
            _ => 0,
        };
        usize::try_from(number).ok().filter(|number| (1..=most).contains(number)).ok_or_else(|| {
            Fault::new(codes::BAD_INDEX, columns.clone(), format!("{name} needs one index"))
                .label(format!("expected 1 to {most}"))
        })
    }
}

fn positive(number: i32, columns: &Columns) -> Outcome<u32> {
    u32::try_from(number).ok().filter(|number| *number > 0).ok_or_else(|| {
        Fault::new(codes::BAD_INDEX, columns.clone(), format!("there is no tool or edge {number}"))
            .label("expected a number from 1")
    })
}

fn wrong_indices(columns: &Columns, form: &str) -> Box<Fault> {
    Fault::new(codes::BAD_INDEX, columns.clone(), "tool data need the tool they belong to")
        .label(format!("expected the form {form}"))
}

/// n of $TC_DPn.
fn edge_parameter(name: &str) -> Option<u32> {
    let number = name.strip_prefix("$TC_DP")?.parse().ok()?;
    (1..=PARAMETERS).contains(&number).then_some(number)
}

/// Lengths and radii are mm; the type is a number.
fn parameter_mm(edge: &ToolEdge, number: u32) -> f64 {
    match number {
        1 => f64::from(edge.kind),
        3..=5 => edge.length_mm[number as usize - 3],
        6 => edge.radius_mm,
        12..=14 => edge.wear_length_mm[number as usize - 12],
        15 => edge.wear_radius_mm,
        21..=23 => edge.base_length_mm[number as usize - 21],
        _ => edge.others.get(&number).copied().unwrap_or(0.0),
    }
}

fn set_parameter_mm(edge: &mut ToolEdge, number: u32, value_mm: f64) {
    match number {
        1 => edge.kind = value_mm.round().clamp(0.0, f64::from(u32::MAX)) as u32,
        3..=5 => edge.length_mm[number as usize - 3] = value_mm,
        6 => edge.radius_mm = value_mm,
        12..=14 => edge.wear_length_mm[number as usize - 12] = value_mm,
        15 => edge.wear_radius_mm = value_mm,
        21..=23 => edge.base_length_mm[number as usize - 21] = value_mm,
        _ => _ = edge.others.insert(number, value_mm),
    }
}
