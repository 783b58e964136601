//! Reads a workshop file: tools and zero offsets.
//!
//! In: TOML text, the axes of the machine. Out: [`Workshop`], or all that is wrong with the file at once. One file may hold both tables.
//!
//! ```toml
//! format = 1
//! change_with_m6 = true            # false: T changes the tool by itself (MD22550 = 0); default true
//!
//! [[tools]]
//! number = 1
//! name = "MILL_D10"                # optional; a tool without number has a name
//! [[tools.edges]]                  # D1; further edges: number = 2 and so on
//! number = 1                       # default: the next free number
//! kind = 120                       # $TC_DP1, optional
//! length_mm = [120.0, 0.0, 0.0]    # L1, L2, L3 ($TC_DP3 to 5); one number is L1
//! radius_mm = 5.0                  # $TC_DP6
//! wear_length_mm = [-0.02, 0, 0]   # $TC_DP12 to 14, added
//! wear_radius_mm = -0.01           # $TC_DP15, added
//! base_length_mm = [0, 0, 0]       # $TC_DP21 to 23, added
//!
//! [frames.G54]                     # G500, G54 to G57, G505 to G599, or basic
//! translation = { X_mm = 100.0, Y_mm = 50.0, C_deg = 15.0 }
//! fine = { X_mm = 0.02 }
//! rotation = { Z_deg = 30.0 }      # about X, Y, Z; order Z, Y', X''
//! scale = { X_ratio = 2.0 }
//! mirror = ["X"]
//! ```

use super::Machine;
use super::document::{Entry, Mark, Node, Texts, Value, read};
use super::load::{LoadError, read_file};
use super::section::Findings;
use super::tools::{EDGE_MAX, Tool, ToolEdge, ToolTable, Workshop, ZeroOffset};
use crate::base::diagnostics::{Diagnostic, SourceText, nearest};
use crate::base::units::rad_from_deg;
use crate::base::{AxisId, AxisKind, AxisVector};
use std::collections::BTreeMap;
use std::path::Path;

const TOP_KEYS: &[&str] = &["format", "change_with_m6", "tools", "frames"];
const TOOL_KEYS: &[&str] = &["number", "name", "edges"];
const EDGE_KEYS: &[&str] =
    &["number", "kind", "length_mm", "radius_mm", "wear_length_mm", "wear_radius_mm", "base_length_mm"];
const FRAME_KEYS: &[&str] = &["translation", "fine", "rotation", "scale", "mirror"];
/// Longest length of a tool and largest offset: far beyond any machine.
const LENGTH_MAX_MM: f64 = 1e6;
/// Largest angle of a file.
const ANGLE_MAX_DEG: f64 = 1e6;
const SCALE_MAX_RATIO: f64 = 1e6;
const SCALE_MIN_RATIO: f64 = 1e-6;
/// Highest T number and tool type.
const NUMBER_MAX: u32 = 99_999_999;

/// Reads and checks a workshop file.
#[allow(clippy::result_large_err, reason = "once a run")]
pub fn load_workshop(path: &Path, machine: &Machine) -> Result<Workshop, LoadError> {
    let name = path.display().to_string();
    let text = read_file(path).map_err(|reason| {
        let message = format!("cannot read the tools or zero offsets {name}: {reason}");
        LoadError::Unreadable(Diagnostic::error("M0001", message).help("give the path of a TOML file"))
    })?;
    read_workshop(&SourceText::new(name, text), machine).map_err(LoadError::Invalid)
}

/// Checks the text of a workshop file.
pub fn read_workshop(source: &SourceText, machine: &Machine) -> Result<Workshop, Vec<Diagnostic>> {
    let text = source.text.strip_prefix('\u{feff}').unwrap_or(&source.text);
    let texts = Texts { sources: vec![SourceText::new(source.name.clone(), text)] };
    let (root, syntax_errors) = read(&texts.sources[0], 0);
    if !syntax_errors.is_empty() {
        return Err(syntax_errors);
    }
    let findings = Findings::new(&texts);
    let workshop = Reader { findings: &findings, machine }.workshop(&root);
    let failed = findings.any_error();
    if failed { Err(findings.into_sorted()) } else { Ok(workshop) }
}

struct Reader<'f> {
    findings: &'f Findings<'f>,
    machine: &'f Machine,
}

impl Reader<'_> {
    fn workshop(&self, root: &Node) -> Workshop {
        let entries = self.table(root, "the file", TOP_KEYS);
        match find(entries, "format") {
            Some(entry) if self.whole(&entry.node, "format", 1, 1).is_some() => {}
            Some(_) => {}
            None => self.error(&root.mark, "", "M0004", "format is missing".into(), "begin the file with format = 1"),
        }
        let mut workshop = Workshop::default();
        if let Some(entry) = find(entries, "tools") {
            workshop.tools = Some(self.tools(&entry.node));
        }
        if let Some(entry) = find(entries, "change_with_m6") {
            let change_with_m6 = self.flag(&entry.node, "change_with_m6");
            workshop.tools.get_or_insert_with(ToolTable::default).change_with_m6 = change_with_m6;
        }
        if let Some(entry) = find(entries, "frames") {
            for frame in entry.node.entries().unwrap_or_default() {
                self.frame(frame, &mut workshop);
            }
            if entry.node.entries().is_none() {
                self.wrong_type(&entry.node, "frames", "tables such as [frames.G54]");
            }
        }
        workshop
    }

    fn tools(&self, node: &Node) -> ToolTable {
        let mut table = ToolTable::default();
        for item in self.list(node, "tools", "[[tools]]") {
            let entries = self.table(item, "a tool", TOOL_KEYS);
            let number = find(entries, "number").and_then(|entry| self.whole(&entry.node, "number", 1, NUMBER_MAX));
            let name = find(entries, "name").and_then(|entry| self.text(&entry.node, "name"));
            if number.is_none() && name.is_none() {
                let help = "write number = 1, or name = \"MILL\", or both";
                self.error(&item.mark, "", "M0004", "a tool without number and without name".into(), help);
            }
            let edges = find(entries, "edges").map(|entry| self.edges(&entry.node)).unwrap_or_default();
            let tool = Tool { number: number.unwrap_or(0), name: name.map(Into::into), edges };
            let taken = table.tools.iter().any(|other| {
                (tool.number > 0 && tool.number == other.number)
                    || tool.name.as_ref().is_some_and(|name| other.name.as_ref() == Some(name))
            });
            if taken {
                let message = format!("the tool {} is there twice", tool.title());
                self.error(&item.mark, "again", "M0008", message, "give each tool its own number and name");
            }
            table.tools.push(tool);
        }
        table
    }

    fn edges(&self, node: &Node) -> BTreeMap<u32, ToolEdge> {
        let mut edges = BTreeMap::new();
        for item in self.list(node, "edges", "[[tools.edges]]") {
            let entries = self.table(item, "an edge", EDGE_KEYS);
            let next = edges.last_key_value().map_or(1, |(number, _)| number + 1);
            let number = match find(entries, "number") {
                Some(entry) => self.whole(&entry.node, "number", 1, EDGE_MAX).unwrap_or(next),
                None => next,
            };
            let lengths = |key: &str| find(entries, key).map_or([0.0; 3], |entry| self.lengths_mm(&entry.node, key));
            let radius =
                |key: &str| find(entries, key).map_or(0.0, |entry| self.number(&entry.node, key, LENGTH_MAX_MM));
            let edge = ToolEdge {
                kind: find(entries, "kind")
                    .and_then(|entry| self.whole(&entry.node, "kind", 0, NUMBER_MAX))
                    .unwrap_or(0),
                length_mm: lengths("length_mm"),
                radius_mm: radius("radius_mm"),
                wear_length_mm: lengths("wear_length_mm"),
                wear_radius_mm: radius("wear_radius_mm"),
                base_length_mm: lengths("base_length_mm"),
                others: BTreeMap::new(),
            };
            if edges.insert(number, edge).is_some() {
                let message = format!("the edge D{number} is there twice");
                self.error(&item.mark, "again", "M0008", message, "give each edge of a tool its own number");
            }
        }
        edges
    }

    fn frame(&self, entry: &Entry, workshop: &mut Workshop) {
        let Some(number) = frame_number(&entry.key) else {
            let help = "frames are called G500, G54 to G57, G505 to G599, or basic";
            let message = format!("there is no frame `{}`", entry.key);
            self.error(&entry.key_mark, "unknown frame", "M0003", message, help);
            return;
        };
        let entries = self.table(&entry.node, "a frame", FRAME_KEYS);
        let mut offset = ZeroOffset::default();
        for part in entries {
            match part.key.as_str() {
                "translation" => self.per_axis(&part.node, Quantity::Position, &mut offset.translation_lu),
                "fine" => self.per_axis(&part.node, Quantity::Position, &mut offset.fine_lu),
                "rotation" => self.per_axis(&part.node, Quantity::Angle, &mut offset.rotation_rad),
                "scale" => self.per_axis(&part.node, Quantity::Scale, &mut offset.scale_ratio),
                "mirror" => {
                    for item in self.list(&part.node, "mirror", "[\"X\"]") {
                        if let Some(id) = self.text(item, "mirror").and_then(|name| self.axis(&name, &item.mark)) {
                            offset.mirror[id] = true;
                        }
                    }
                }
                _ => {}
            }
        }
        match number {
            None => workshop.basic = Some(offset),
            Some(number) => {
                workshop.settable.insert(number, offset);
            }
        }
    }

    /// `{ X_mm = 10.0, C_deg = 5.0 }`.
    fn per_axis(&self, node: &Node, quantity: Quantity, values_lu: &mut AxisVector) {
        let Some(entries) = node.entries() else {
            return self.wrong_type(node, "this part of a frame", "a table such as { X_mm = 10.0 }");
        };
        for entry in entries {
            let (name, unit) = entry.key.rsplit_once('_').unwrap_or((&entry.key, ""));
            let Some(id) = self.axis(name, &entry.key_mark) else { continue };
            let kind = self.machine.axis(id).kind;
            let wanted = match (quantity, kind) {
                (Quantity::Scale, _) => "ratio",
                (Quantity::Position, AxisKind::Linear) => "mm",
                (Quantity::Position, AxisKind::Rotary) | (Quantity::Angle, _) => "deg",
            };
            if unit != wanted {
                let message = format!("`{}` does not say its unit", entry.key);
                self.error(&entry.key_mark, "which unit?", "M0003", message, &format!("write {name}_{wanted}"));
                continue;
            }
            if matches!(quantity, Quantity::Angle) && !(matches!(name, "X" | "Y" | "Z") && kind == AxisKind::Linear) {
                let message = format!("frames do not turn about {name}");
                self.error(&entry.key_mark, "", "M0008", message, "expected X, Y or Z");
                continue;
            }
            values_lu[id] = match wanted {
                "mm" => self.number(&entry.node, &entry.key, LENGTH_MAX_MM),
                "deg" => rad_from_deg(self.number(&entry.node, &entry.key, ANGLE_MAX_DEG)),
                _ => self.scale_ratio(&entry.node, &entry.key),
            };
        }
    }

    fn scale_ratio(&self, node: &Node, key: &str) -> f64 {
        let scale_ratio = self.number(node, key, SCALE_MAX_RATIO);
        if scale_ratio.abs() < SCALE_MIN_RATIO {
            self.error(&node.mark, "out of range", "M0006", format!("{key} must not be 0"), "1.0 changes nothing");
            return 1.0;
        }
        scale_ratio
    }

    fn axis(&self, name: &str, mark: &Mark) -> Option<AxisId> {
        let found = self.machine.axis_by_name(name);
        if found.is_none() {
            let names: Vec<&str> = self.machine.axis_ids().map(|id| self.machine.axis(id).name.as_ref()).collect();
            let help = format!("its axes are {}", names.join(", "));
            self.error(mark, "no such axis", "M0011", format!("the machine has no axis {name}"), &help);
        }
        found
    }

    /// Entries of a table; reports keys that are not among `keys`.
    fn table<'n>(&self, node: &'n Node, what: &str, keys: &[&'static str]) -> &'n [Entry] {
        let Some(entries) = node.entries() else {
            self.wrong_type(node, what, "a table");
            return &[];
        };
        for entry in entries.iter().filter(|entry| !keys.contains(&entry.key.as_str())) {
            let help = match nearest(&entry.key, keys.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("the keys of {what} are {}", keys.join(", ")),
            };
            self.error(&entry.key_mark, "unknown key", "M0003", format!("unknown key `{}`", entry.key), &help);
        }
        entries
    }

    fn list<'n>(&self, node: &'n Node, what: &str, example: &str) -> &'n [Node] {
        match &node.value {
            Value::List(items) => items,
            _ => {
                self.wrong_type(node, what, &format!("a list such as {example}"));
                &[]
            }
        }
    }

    /// One number is the first of three.
    fn lengths_mm(&self, node: &Node, key: &str) -> [f64; 3] {
        match &node.value {
            Value::List(items) if (1..=3).contains(&items.len()) => {
                let mut lengths_mm = [0.0; 3];
                for (length_mm, item) in lengths_mm.iter_mut().zip(items) {
                    *length_mm = self.number(item, key, LENGTH_MAX_MM);
                }
                lengths_mm
            }
            Value::Number { .. } => [self.number(node, key, LENGTH_MAX_MM), 0.0, 0.0],
            _ => {
                self.wrong_type(node, key, "one to three numbers in mm, such as [120.0, 0.0, 0.0]");
                [0.0; 3]
            }
        }
    }

    fn number(&self, node: &Node, key: &str, magnitude_max: f64) -> f64 {
        match &node.value {
            Value::Number { value, .. } if value.abs() <= magnitude_max => *value,
            Value::Number { text, .. } => {
                let message = format!("{key} = {text} is out of range");
                self.error(&node.mark, "out of range", "M0006", message, &format!("allowed: up to {magnitude_max}"));
                0.0
            }
            _ => {
                self.wrong_type(node, key, "a number");
                0.0
            }
        }
    }

    fn whole(&self, node: &Node, key: &str, least: u32, most: u32) -> Option<u32> {
        match &node.value {
            Value::Number { value, .. }
                if value.fract() == 0.0 && (f64::from(least)..=f64::from(most)).contains(value) =>
            {
                Some(*value as u32)
            }
            Value::Number { text, .. } => {
                let help = format!("allowed: {least} to {most}, whole");
                self.error(&node.mark, "out of range", "M0006", format!("{key} = {text} is out of range"), &help);
                None
            }
            _ => {
                self.wrong_type(node, key, "a whole number");
                None
            }
        }
    }

    fn text(&self, node: &Node, key: &str) -> Option<String> {
        match &node.value {
            Value::Text(text) if !text.is_empty() => Some(text.clone()),
            _ => {
                self.wrong_type(node, key, "a text in \"quotes\"");
                None
            }
        }
    }

    fn flag(&self, node: &Node, key: &str) -> bool {
        if let Value::Flag(flag) = node.value {
            return flag;
        }
        self.wrong_type(node, key, "true or false");
        true
    }

    fn wrong_type(&self, node: &Node, what: &str, expected: &str) {
        let message = format!("{what} must be {expected}, found {}", node.value.describe());
        self.findings.report(&node.mark, &format!("expected {expected}"), Diagnostic::error("M0005", message));
    }

    fn error(&self, mark: &Mark, label: &str, code: &'static str, message: String, help: &str) {
        self.findings.report(mark, label, Diagnostic::error(code, message).help(help));
    }
}

/// What the numbers of a part of a frame are.
#[derive(Clone, Copy)]
enum Quantity {
    Position,
    Angle,
    Scale,
}

fn find<'n>(entries: &'n [Entry], key: &str) -> Option<&'n Entry> {
    entries.iter().find(|entry| entry.key == key)
}

/// `basic` is `Some(None)`.
#[allow(clippy::option_option, reason = "no frame, the basic frame, or a number")]
fn frame_number(name: &str) -> Option<Option<u16>> {
    if name.eq_ignore_ascii_case("basic") {
        return Some(None);
    }
    let number: u16 = name.strip_prefix(['G', 'g'])?.parse().ok()?;
    match number {
        500 => Some(Some(0)),
        54..=57 => Some(Some(number - 53)),
        505..=599 => Some(Some(number - 500)),
        _ => None,
    }
}
