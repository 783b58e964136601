//! What the columns of a table are.
//!
//! In: names, units, first rows. Out: heads with factors. Names of ours, of our set-point tables (`X_mm`), of Siemens (paths and
//! `ENC_POS|1`), TwinCAT (`Axes.X.ActPos`) and LinuxCNC (`joint.0.pos-cmd`) are known in any table. Does not read rows.

use super::delimited::Dialect;
use super::naming::{AxisMark, Named, NamedHead, Naming, operate_name};
use super::recording::{SPINDLE_PREFIX, path_unit, spindle_unit};
use super::signal_map::rule_for;
use super::sink::{Head, Layout};
use super::time_column::TimeColumn;
use super::unit_words::{unit_and_factor, unit_in_name};
use super::wire::{AxisSignal, Clock, TraceFormat, axis_signal_name};
use crate::base::AxisKind;
use crate::recorder::{AXIS_FIELDS, PATH_FIELDS, SPINDLE_FIELDS};
use std::collections::BTreeMap;

/// A column that becomes a signal.
pub(super) struct Column {
    pub(super) head: Head,
    /// Value in the unit of the head = number * factor.
    pub(super) factor: f64,
    /// Place in the row.
    pub(super) cell: usize,
    /// An empty cell is no gap: its instants are others.
    pub(super) sparse: bool,
    /// Words by number.
    pub(super) words: BTreeMap<String, usize>,
}

/// Describes all columns but that of the time.
pub(super) fn describe_columns(
    names: &[String],
    units: Option<&[String]>,
    sample: &[Vec<String>],
    dialect: &Dialect,
    time: &TimeColumn,
    naming: &mut Naming,
) -> Vec<Column> {
    // Our own export writes the names of a controller above values in our units.
    let own_export = names.first().is_some_and(|name| name == "time_s") && units.is_none();
    let period_s = time.period_s(sample, dialect);
    let cells: Vec<usize> = (0..names.len()).filter(|cell| Some(*cell) != time.cell).collect();
    let mut heads: Vec<NamedHead> = Vec::new();
    for cell in &cells {
        let said = units.and_then(|units| units.get(*cell)).map(String::as_str).filter(|unit| !unit.is_empty());
        heads.push(named_head(&names[*cell], said, own_export, naming));
    }
    naming.settle(&mut heads);
    let column = |(cell, named): (&usize, NamedHead)| {
        let NamedHead { mut head, factor, .. } = named;
        let shape = Shape::of(sample, *cell, dialect);
        head.words = shape.words;
        head.discrete |= shape.whole && is_status(&head);
        head.layout = if shape.stride > 1 { Layout::Own } else { Layout::Dense };
        head.clock = if shape.stride > 1 { Clock::Interpolator } else { head.clock };
        head.period_s = period_s.map(|period_s| period_s * shape.stride as f64);
        Column { head, factor, cell: *cell, sparse: shape.stride > 1, words: BTreeMap::new() }
    };
    cells.iter().zip(heads).map(column).collect()
}

/// Head of a column by its name, with the unit that the table says.
pub(super) fn named_head(name: &str, said: Option<&str>, own_export: bool, naming: &mut Naming) -> NamedHead {
    let bare = strip_unit(name);
    let said = said.or_else(|| unit_in_name(name));
    if let Some(own) = own_name(bare) {
        let unit = own_unit(&own).to_owned();
        let mut named = naming.head(name, &Named::default(), None);
        (named.head.name, named.factor) = (named.head.name.or(Some(own)), 1.0);
        named.head.unit = unit;
        return named;
    }
    let (format, parts) = taken_apart(bare);
    let mut named = naming.head_of(format, name, &parts);
    if own_export {
        named.factor = 1.0;
    } else if let Some((unit, factor)) = said.and_then(unit_and_factor) {
        // What the table says comes before what the controller usually writes.
        if named.head.unit.is_empty() || named.head.unit == unit {
            (named.head.unit, named.factor) = (unit.to_owned(), factor);
        }
    } else if let Some(said) = said.filter(|_| named.head.unit.is_empty()) {
        named.head.unit = said.trim_matches(['[', ']', '(', ')']).to_owned();
    }
    if rule_for(format, &parts.stem).is_some() && format != TraceFormat::Csv {
        named.head.clock = Clock::Servo;
    }
    named
}

/// Whether whole numbers of this signal are states, not measurements that happen to be whole.
fn is_status(head: &Head) -> bool {
    head.unit.is_empty() || head.unit == "bits"
}

fn strip_unit(name: &str) -> &str {
    let name = name.trim();
    match name.rfind(['[', '(']) {
        Some(start) if unit_in_name(name).is_some() && name.ends_with([']', ')']) => name[..start].trim_end(),
        _ => name,
    }
}

/// One of our names: `X.position_setpoint_mm`, `path.feed_mm_min`, `X_mm` of a table of set-points.
fn own_name(name: &str) -> Option<String> {
    if AxisSignal::parse(name).is_some() {
        return Some(name.to_owned());
    }
    if let Some(field) = name.strip_prefix("path.") {
        return PATH_FIELDS.contains(&field).then(|| name.to_owned());
    }
    if let Some(field) = name.strip_prefix(SPINDLE_PREFIX) {
        return SPINDLE_FIELDS.contains(&field).then(|| name.to_owned());
    }
    let (axis, unit) = name.rsplit_once('_')?;
    let is_axis = axis.starts_with(|c: char| c.is_ascii_uppercase()) && axis.len() <= 3;
    match unit {
        "mm" if is_axis => axis_signal_name(axis, AxisKind::Linear, "position_setpoint"),
        "deg" if is_axis => axis_signal_name(axis, AxisKind::Rotary, "position_setpoint"),
        _ => None,
    }
}

fn own_unit(name: &str) -> &'static str {
    match AxisSignal::parse(name) {
        Some(signal) => AXIS_FIELDS[signal.field].unit_name(signal.kind),
        None if name.starts_with(SPINDLE_PREFIX) => spindle_unit(name),
        None => path_unit(name),
    }
}

/// Format and parts of a controller's name.
pub(super) fn taken_apart(name: &str) -> (TraceFormat, Named) {
    if name.contains("nckServoData") || name.contains("/!") {
        return (TraceFormat::OperateXml, operate_name(name));
    }
    if let Some((stem, axis)) = name.rsplit_once('|') {
        let axis = axis.trim().parse().map_or(AxisMark::None, AxisMark::Number);
        return (TraceFormat::EdgeJson, Named { stem: stem.trim().to_owned(), axis });
    }
    if let Some(rest) = name.strip_prefix("joint.").or_else(|| name.strip_prefix("axis."))
        && let Some((axis, stem)) = rest.split_once('.')
    {
        let axis = axis.parse().map_or_else(|_| AxisMark::Name(axis.to_uppercase()), AxisMark::Number);
        return (TraceFormat::Halscope, Named { stem: stem.to_owned(), axis });
    }
    if let Some((path, stem)) = name.rsplit_once('.')
        && rule_for(TraceFormat::TwinCatCsv, stem).is_some()
    {
        let axis = path.rsplit('.').next().unwrap_or(path).trim();
        let axis = axis.strip_prefix("Axis ").unwrap_or(axis).replace(' ', "_");
        return (TraceFormat::TwinCatCsv, Named { stem: stem.to_owned(), axis: AxisMark::Name(axis) });
    }
    (TraceFormat::Csv, Named { stem: name.to_owned(), axis: AxisMark::None })
}

/// What the first rows say of a column.
struct Shape {
    words: bool,
    whole: bool,
    /// Rows from value to value.
    stride: usize,
}

impl Shape {
    fn of(sample: &[Vec<String>], cell: usize, dialect: &Dialect) -> Self {
        let texts: Vec<&str> = sample.iter().map(|row| row.get(cell).map_or("", String::as_str)).collect();
        let filled: Vec<(usize, &str)> =
            texts.iter().copied().enumerate().filter(|(_, text)| !text.is_empty()).collect();
        let numbers: Vec<f64> = filled.iter().filter_map(|(_, text)| dialect.number(text)).collect();
        let steps: Vec<usize> = filled.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
        let stride = steps.first().copied().filter(|first| steps.len() > 2 && steps.iter().all(|step| step == first));
        Self {
            words: 2 * numbers.len() < filled.len(),
            whole: !numbers.is_empty() && numbers.iter().all(|value| value.fract() == 0.0),
            stride: stride.unwrap_or(1),
        }
    }
}
