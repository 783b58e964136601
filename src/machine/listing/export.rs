//! From a machine to a listing of machine data.
//!
//! In: a loaded machine. Out: text: general data, those of channel 1, of every axis, drive parameters; after them, as comments, every key
//! that does not come back from the data to the last bit, found by importing the data again. Data with digits that the machine file does
//! not hold (MD20482), and those that configure encoders, are not written as data: a listing may be loaded into a control.

use super::export_axis::{axis_lines, drive_lines, feedforward_lines};
use super::import::{ImportOptions, import_listing};
use super::rows::{ROWS, Row};
use super::special::PATH_MODES;
use super::{CARRIED, ListingFile, five_axis};
use super::{data::Scope, write};
use crate::base::AxisKind;
use crate::base::units::s_from_ms;
use crate::machine::load::Loaded;
use std::collections::BTreeMap;

/// The keys of a machine file as written.
pub(super) struct Keys(BTreeMap<String, String>);

impl Keys {
    pub fn number(&self, key: &str) -> Option<f64> {
        self.0.get(key)?.parse().ok()
    }

    pub fn word(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(|word| word.trim_matches('"'))
    }

    pub fn flag(&self, key: &str) -> Option<bool> {
        self.0.get(key)?.parse().ok()
    }

    pub fn text(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(String::as_str)
    }

    fn has_table(&self, path: &str) -> bool {
        self.0.range(path.to_owned()..).next().is_some_and(|(key, _)| key.starts_with(path))
    }
}

/// An axis on the way out.
pub(super) struct OutAxis<'m> {
    pub ours: &'m str,
    /// `AX1`.
    pub id: String,
    pub number: u32,
    pub kind: AxisKind,
}

impl OutAxis<'_> {
    pub fn key(&self, key: &str) -> String {
        format!("axes.{}.{key}", self.ours)
    }
}

/// The listing.
pub fn export_listing(loaded: &Loaded) -> String {
    let keys = Keys(write::flat(&loaded.text_as_used).into_iter().collect());
    let machine = &loaded.machine;
    let axes: Vec<OutAxis<'_>> = machine
        .axes
        .iter()
        .map(|axis| OutAxis { ours: &axis.name, id: format!("AX{}", axis.index), number: axis.index, kind: axis.kind })
        .collect();
    let mut lines = vec!["METRIC".to_owned(), "CHANDATA(1)".to_owned()];
    control(&mut lines, &keys, &axes);
    five_axis::export(&mut lines, machine);
    for axis in &axes {
        lines.push(format!("; {} is {}", axis.id, axis.ours));
        axis_lines(&mut lines, &keys, axis);
    }
    for axis in axes.iter().filter(|axis| keys.has_table(&axis.key("drive."))) {
        lines.push(format!("{CARRIED}drive {}", axis.ours));
        drive_lines(&mut lines, &keys, axis);
    }
    let data = lines.join("\n") + "\n";
    let carried = carried(&keys, &data);
    let mut text = format!("; Machine data of {}, written by sollwert.\n", machine.name.replace(['\n', '\r'], " "));
    if machine.axes.iter().any(|axis| axis.drive.as_ref().is_some_and(|drive| !drive.identified)) {
        text += "; Its drives are representative, not measured: look at p parameters and gains before they go into a control.\n";
    }
    text += &data;
    if !carried.is_empty() {
        text += "; What no machine datum holds, for `sollwert machine import`; a control passes over it.\n";
        text += &carried;
    }
    text + "M17\n"
}

/// Feed-forward, its delay and friction compensation of some axes, and nothing else: what a tuning changes.
pub fn export_feedforward(loaded: &Loaded, axes: &[&str]) -> String {
    let keys = Keys(write::flat(&loaded.text_as_used).into_iter().collect());
    let mut lines = vec!["METRIC".to_owned(), "CHANDATA(1)".to_owned()];
    for axis in loaded.machine.axes.iter().filter(|axis| axes.contains(&axis.name.as_str())) {
        let id = format!("AX{}", axis.index);
        lines.push(format!("; {id} is {}", axis.name));
        feedforward_lines(&mut lines, &keys, &OutAxis { ours: &axis.name, id, number: axis.index, kind: axis.kind });
    }
    lines.join("\n") + "\nM17\n"
}

/// Keys that the data alone do not bring back.
fn carried(keys: &Keys, data: &str) -> String {
    let file = ListingFile { name: "export".to_owned(), bytes: data.as_bytes().to_vec() };
    let back = import_listing(&[file], &ImportOptions::default()).map(|imported| imported.values).unwrap_or_default();
    let same = |key: &str, value: &str| {
        let Some(other) = back.get(key).filter(|other| other.origin == super::import::Origin::Datum) else {
            return false;
        };
        match (value.parse::<f64>(), other.value.parse::<f64>()) {
            (Ok(one), Ok(other)) => one.to_bits() == other.to_bits(),
            _ => value.replace(' ', "") == other.value.replace(' ', ""),
        }
    };
    let left = keys.0.iter().filter(|(key, value)| key.as_str() != "format" && !same(key, value));
    left.map(|(key, value)| format!("{CARRIED}{key} = {value}\n")).collect()
}

fn control(lines: &mut Vec<String>, keys: &Keys, axes: &[OutAxis<'_>]) {
    for axis in axes {
        if let Some(name) = keys.word(&axis.key("machine_axis"))
            && *name != axis.id
        {
            lines.push(format!("N10000 $MN_AXCONF_MACHAX_NAME_TAB[{}]=\"{name}\"", axis.number.saturating_sub(1)));
        }
    }
    let cycles = axes.iter().filter_map(|axis| keys.number(&axis.key("drive.position_cycle_ms")));
    if let Some(cycle_ms) = cycles.min_by(f64::total_cmp) {
        lines.push(format!("N10061 $MN_POSCTRL_CYCLE_TIME={}", number(s_from_ms(cycle_ms))));
    }
    for row in ROWS.iter().filter(|row| row.scope != Scope::Axis) {
        if let Some(value) = keys.number(row.linear) {
            lines.push(assignment(row, "", row.unit.to_datum(AxisKind::Linear, value)));
        }
    }
    for (place, axis) in axes.iter().enumerate() {
        lines.push(format!("N20070 $MC_AXCONF_MACHAX_USED[{place}]={}", axis.number));
        lines.push(format!("N20080 $MC_AXCONF_CHANAX_NAME_TAB[{place}]=\"{}\"", axis.ours));
    }
    let mode = keys.word("feed.default_path_mode").and_then(|word| PATH_MODES.iter().position(|known| *known == word));
    if let Some(place) = mode {
        lines.push(format!("N20150 $MC_GCODE_RESET_VALUES[9]={}", place + 1));
    }
    if let Some(word) = keys.word("feed.default_acceleration_mode") {
        lines.push(format!("N20150 $MC_GCODE_RESET_VALUES[20]={}", if word == "SOFT" { 2 } else { 1 }));
    }
}

/// `N32300 $MA_MAX_AX_ACCEL[0,AX1]=6`.
pub(super) fn assignment(row: &Row, axis: &str, value: f64) -> String {
    let inside = match (row.plain, axis.is_empty()) {
        (true, true) => String::new(),
        (true, false) => format!("[{axis}]"),
        (false, true) => format!("[{}]", row.index),
        (false, false) => format!("[{},{axis}]", row.index),
    };
    format!("N{} {}{}{inside}={}", row.number, row.scope.prefix(), row.name, number(value))
}

/// A number as the control writes it.
pub(super) fn number(value: f64) -> String {
    let large = value != 0.0 && !(1e-6..1e10).contains(&value.abs());
    if large { format!("{value:e}").replace('e', "EX") } else { value.to_string() }
}
