//! Text of a machine file from keys with their sources, and keys from a text.
//!
//! In: paths and values. Out: TOML in the order of the catalogue, the source of every value beside it. Knows nothing of machine data.

use super::import::{Origin, Sourced};
use crate::machine::catalogue::tables;
use std::collections::BTreeMap;
use toml_edit::{DocumentMut, Item, Table};

/// Degrees of a turn.
pub(super) const TURN_DEG: f64 = 360.0;
/// Where comments stand, if the values are short.
const COMMENT_COLUMN: usize = 45;

/// A number as the file has it: the shortest that reads back, with a point.
pub(super) fn number(value: f64) -> String {
    if value.is_infinite() {
        return if value > 0.0 { "inf".to_owned() } else { "-inf".to_owned() };
    }
    let large = value != 0.0 && !(1e-4..1e9).contains(&value.abs());
    let text = if large { format!("{value:e}") } else { value.to_string() };
    if text.contains(['.', 'e']) { text } else { format!("{text}.0") }
}

/// The file.
pub(super) fn text(values: &BTreeMap<String, Sourced>) -> String {
    let mut text = String::from("# Made by `sollwert machine import`; beside each value where it comes from.\n");
    let mut axes: Vec<(f64, &str)> = Vec::new();
    for key in values.keys().filter_map(|key| key.strip_prefix("axes.")) {
        let name = key.split('.').next().unwrap_or(key);
        if axes.last().is_none_or(|(_, last)| *last != name) {
            let index = values.get(&format!("axes.{name}.index")).and_then(|index| index.value.parse().ok());
            axes.push((index.unwrap_or(f64::INFINITY), name));
        }
    }
    axes.sort_by(|one, other| one.0.total_cmp(&other.0));
    for table in tables().iter().filter(|table| !table.path.contains('*')) {
        section(&mut text, table.path, table.keys.iter().map(|key| key.name), values);
    }
    for (_, name) in axes {
        for table in tables().iter().filter(|table| table.path.contains('*')) {
            let path = table.path.replacen('*', name, 1);
            let sets = ["norm", "position", "rough", "semifinish", "finish"];
            let paths: Vec<String> = match path.contains('*') {
                true => sets.iter().map(|set| path.replacen('*', set, 1)).collect(),
                false => vec![path],
            };
            for path in paths {
                section(&mut text, &path, table.keys.iter().map(|key| key.name), values);
            }
        }
    }
    text
}

fn section<'k>(text: &mut String, path: &str, keys: impl Iterator<Item = &'k str>, values: &BTreeMap<String, Sourced>) {
    let mut open = path.is_empty();
    for key in keys {
        let full = if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
        let Some(sourced) = values.get(&full) else { continue };
        if !open {
            *text += &format!("\n[{path}]\n");
            open = true;
        }
        let line = format!("{key} = {}", sourced.value);
        let doubt = match sourced.origin {
            Origin::Derived => "derived: ",
            Origin::Carried => "comment of the listing ",
            Origin::Datum | Origin::Base | Origin::Assumed => "",
        };
        *text += &format!("{line:<COMMENT_COLUMN$} # {doubt}{}\n", sourced.source.replace(['\n', '\r'], " "));
    }
}

/// Every key of a file with its value as written; arrays in one piece.
pub(super) fn flat(text: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    if let Ok(document) = text.parse::<DocumentMut>() {
        table("", document.as_table(), &mut found, 0);
    }
    found
}

/// A machine file has at most five levels.
const DEPTH_MAX: usize = 8;

fn table(path: &str, table_item: &Table, found: &mut Vec<(String, String)>, depth: usize) {
    for (key, item) in table_item {
        let full = if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
        match item {
            Item::Table(inner) if depth < DEPTH_MAX => table(&full, inner, found, depth + 1),
            Item::Value(value) => {
                let mut bare = value.clone();
                bare.decor_mut().clear();
                // A value over several lines loses its comments and becomes one line.
                let lines: Vec<String> = bare
                    .to_string()
                    .lines()
                    .map(|line| line.split('#').next().unwrap_or(line).trim().to_owned())
                    .collect();
                found.push((full, lines.join(" ").trim().to_owned()));
            }
            _ => {}
        }
    }
}
