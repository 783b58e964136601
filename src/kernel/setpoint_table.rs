//! Position set-points from a CSV.
//!
//! In: CSV text with the header `time_s,X_mm,Y_mm,A_deg` (or the names of an export, `X.position_setpoint_mm`), one row a position
//! period; `X_load_n_m` is an outside torque at the motor shaft. Out: [`SetpointTable`] in mm and rad. Does not resample.

use crate::base::{AxisId, AxisKind, Diagnostic, SourceText, Tick, units};
use crate::machine::Machine;
use crate::recorder::{Content, Recording, TopicKind, axis_field};

/// Rows of position set-points, one a position period of the fastest axis.
#[derive(Clone, Debug, PartialEq)]
pub struct SetpointTable {
    /// Columns found: which axis, and its positions in mm or rad.
    pub positions: Vec<(AxisId, Vec<f64>)>,
    /// Outside torque per axis, N m at the motor shaft; axes without a column have none.
    pub loads: Vec<(AxisId, Vec<f64>)>,
    /// Number of rows, at least 1.
    pub rows: usize,
    /// The source says at which times its rows stand; otherwise the position cycle is assumed.
    pub timed: bool,
}

/// Time steps may differ from the position cycle by this share: exports round to microseconds.
const PERIOD_TOLERANCE: f64 = 1e-3;

impl SetpointTable {
    /// Reads the CSV. Errors mark the line: unknown column, not a number, time steps that are not the position cycle.
    pub fn from_csv(source: &SourceText, machine: &Machine) -> Result<Self, Diagnostic> {
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(source.text.as_bytes());
        let header = reader.headers().map_err(|error| unreadable(source, &error))?.clone();
        check_separator(source, &header)?;
        let columns = columns(source, &header, machine)?;
        let mut values: Vec<Vec<f64>> = vec![Vec::new(); columns.len()];
        for record in reader.records() {
            let record = record.map_err(|error| unreadable(source, &error))?;
            let offset = record.position().map_or(0, |position| position.byte() as usize);
            if record.len() != columns.len() {
                let message = format!("a row has {} fields, the header {}", record.len(), columns.len());
                return Err(Diagnostic::error("F0003", message).at(source.place(line_at(source, offset), "")));
            }
            for (text, column) in record.iter().zip(&mut values) {
                match text.parse::<f64>() {
                    Ok(value) if value.is_finite() => column.push(value),
                    _ => {
                        let line = line_at(source, offset);
                        let from = source.text[line.clone()].find(text).map_or(line.start, |at| line.start + at);
                        let place = source.place(from..from + text.len(), "expected a finite number");
                        return Err(Diagnostic::error("F0002", format!("`{text}` is not a number")).at(place));
                    }
                }
            }
        }
        Self::assemble(source, machine, &columns, values)
    }

    /// The position set-points of a recording that was made with the same position cycles.
    pub fn from_recording(recording: &Recording, machine: &Machine) -> Result<Self, Diagnostic> {
        let name = recording.path().display().to_string();
        let field = axis_field("position_setpoint");
        let mut samples: Vec<Sampled> = Vec::new();
        let mut by_topic = vec![None; recording.topics().len()];
        for (topic, known) in recording.topics().iter().enumerate() {
            let TopicKind::Axis { name, kind } = &known.kind else { continue };
            if let Some(axis) = machine.axis_by_name(name) {
                by_topic[topic] = Some(samples.len());
                let scale_ratio = if *kind == AxisKind::Rotary { units::RAD_PER_DEG } else { 1.0 };
                samples.push(Sampled { axis, scale_ratio, rows: Vec::new() });
            }
        }
        for message in recording.messages()? {
            let message = message?;
            if let (Some(place), Content::Axis(sample), Some(field)) =
                (by_topic[message.topic], &message.content, field)
                && let Some(value) = sample.get(field)
            {
                let column = &mut samples[place];
                column.rows.push((message.time_ns, value * column.scale_ratio));
            }
        }
        Self::from_samples(&name, machine, samples)
    }

    /// Rows at the fastest position cycle; a slower axis is held.
    fn from_samples(name: &str, machine: &Machine, samples: Vec<Sampled>) -> Result<Self, Diagnostic> {
        let time_base = &machine.cycle.time_base;
        let end_ns = samples.iter().filter_map(|column| column.rows.last()).map(|(time_ns, _)| *time_ns).max();
        let Some(end_ns) = end_ns else {
            let message = format!("`{name}` holds no position set-points of an axis of this machine");
            return Err(Diagnostic::error("F0004", message));
        };
        let row_ns = |row: u64| time_base.time_ns(Tick(row * row_ticks(machine)));
        let mut table = Self { positions: Vec::new(), loads: Vec::new(), rows: 0, timed: true };
        while row_ns(table.rows as u64) <= end_ns {
            table.rows += 1;
        }
        for Sampled { axis, rows: values, .. } in samples.into_iter().filter(|column| !column.rows.is_empty()) {
            let mut column = Vec::with_capacity(table.rows);
            let mut at = 0;
            for row in 0..table.rows as u64 {
                while at + 1 < values.len() && values[at + 1].0 <= row_ns(row) {
                    at += 1;
                }
                column.push(values[at].1);
            }
            table.positions.push((axis, column));
        }
        Ok(table)
    }

    fn assemble(
        source: &SourceText,
        machine: &Machine,
        columns: &[Column],
        values: Vec<Vec<f64>>,
    ) -> Result<Self, Diagnostic> {
        let timed = columns.iter().any(|column| matches!(column, Column::Time));
        let rows = values.first().map_or(0, Vec::len);
        let mut table = Self { positions: Vec::new(), loads: Vec::new(), rows, timed };
        if table.rows == 0 {
            return Err(Diagnostic::error(
                "F0001",
                format!("`{}` has no rows: there is nothing to follow", source.name),
            ));
        }
        for (column, mut values) in columns.iter().zip(values) {
            match *column {
                Column::Time => check_period(source, machine, &values)?,
                Column::Position { axis, scale_ratio } => {
                    values.iter_mut().for_each(|value| *value *= scale_ratio);
                    table.positions.push((axis, values));
                }
                Column::Load { axis } => table.loads.push((axis, values)),
            }
        }
        if table.positions.is_empty() {
            let message = format!("`{}` has no column of an axis of this machine", source.name);
            let help = "name the columns X_mm, A_deg ... and time_s; X_load_n_m is an outside torque";
            return Err(Diagnostic::error("F0004", message).help(help));
        }
        Ok(table)
    }
}

/// Seconds between rows: the shortest position cycle.
pub fn row_period_s(machine: &Machine) -> f64 {
    machine.cycle.time_base.seconds(row_ticks(machine))
}

/// Ticks between rows: the shortest position cycle.
pub(super) fn row_ticks(machine: &Machine) -> u64 {
    let cycles = machine.axes.iter().filter_map(|axis| axis.drive.as_ref()).map(|drive| drive.position_cycle_ticks);
    cycles.min().unwrap_or(machine.cycle.time_base.ticks_per_setpoint())
}

/// Positions of one axis out of a recording.
struct Sampled {
    axis: AxisId,
    /// From the unit of the recording to mm or rad.
    scale_ratio: f64,
    /// Time in ns, position in mm or rad.
    rows: Vec<(u64, f64)>,
}

#[derive(Clone, Copy)]
enum Column {
    Time,
    Position { axis: AxisId, scale_ratio: f64 },
    Load { axis: AxisId },
}

fn columns(source: &SourceText, header: &csv::StringRecord, machine: &Machine) -> Result<Vec<Column>, Diagnostic> {
    let mut known: Vec<String> = vec!["time_s".into()];
    let mut meanings = vec![Column::Time];
    for axis in machine.axis_ids() {
        let data = machine.axis(axis);
        let (unit, scale_ratio) = match data.kind {
            AxisKind::Linear => ("mm", 1.0),
            AxisKind::Rotary => ("deg", units::RAD_PER_DEG),
        };
        for suffix in ["_", ".position_setpoint_"] {
            known.push(format!("{}{suffix}{unit}", data.name));
            meanings.push(Column::Position { axis, scale_ratio });
        }
        known.push(format!("{}_load_n_m", data.name));
        meanings.push(Column::Load { axis });
    }
    let mut seen = std::collections::BTreeSet::new();
    header
        .iter()
        .map(|name| {
            let name = name.trim_start_matches('\u{feff}');
            let from = source.text.find(name).unwrap_or(0);
            let place = |label: &str| source.place(from..from + name.len(), label);
            let Some(at) = known.iter().position(|known| known.eq_ignore_ascii_case(name)) else {
                let finding = Diagnostic::error("F0005", format!("unknown column `{name}`"))
                    .at(place("expected time_s, an axis or a load"));
                let near = crate::base::diagnostics::nearest(name, known.iter().map(String::as_str));
                return Err(match near {
                    Some(near) => finding.help(format!("did you mean `{near}`?")),
                    None => finding.help(format!("columns of this machine: {}", known.join(", "))),
                });
            };
            if !seen.insert(at) {
                return Err(Diagnostic::error("F0006", format!("column `{name}` stands twice")).at(place("")));
            }
            Ok(meanings[at])
        })
        .collect()
}

/// A header in one piece that holds another separator: spreadsheets of many countries write `;` and decimal commas.
fn check_separator(source: &SourceText, header: &csv::StringRecord) -> Result<(), Diagnostic> {
    let Some(separator) =
        [(';', "`;`"), ('\t', "tabs")].iter().find(|(mark, _)| header.iter().any(|name| name.contains(*mark)))
    else {
        return Ok(());
    };
    let end = source.text.find(['\n', '\r']).unwrap_or(source.text.len());
    Err(Diagnostic::error("F0011", format!("the columns of `{}` are separated by {}", source.name, separator.1))
        .at(source.place(0..end, "expected commas"))
        .help("export it with commas between the columns and points in the numbers"))
}

/// The rows must stand at the position cycle of the fastest axis.
fn check_period(source: &SourceText, machine: &Machine, times_s: &[f64]) -> Result<(), Diagnostic> {
    let period_s = machine.cycle.time_base.seconds(row_ticks(machine));
    for (row, pair) in times_s.windows(2).enumerate() {
        let step_s = pair[1] - pair[0];
        if (step_s - period_s).abs() > PERIOD_TOLERANCE * period_s {
            let line = row + 3;
            let message = format!("rows stand {step_s} s apart, the position cycle of this machine is {period_s} s");
            let start = source.text.split_inclusive('\n').take(line - 1).map(str::len).sum();
            return Err(Diagnostic::error("F0007", message)
                .at(source.place(line_at(source, start), "this step"))
                .help("resample the set-points, or change axes.*.drive.position_cycle_ms"));
        }
    }
    Ok(())
}

fn unreadable(source: &SourceText, error: &csv::Error) -> Diagnostic {
    Diagnostic::error("F0008", format!("`{}` is not readable as CSV: {error}", source.name))
}

fn line_at(source: &SourceText, offset: usize) -> std::ops::Range<usize> {
    let start = offset.min(source.text.len());
    let end = source.text[start..].find(['\n', '\r']).map_or(source.text.len(), |i| start + i);
    start..end
}
