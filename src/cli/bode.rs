//! `sollwert machine bode`: frequency responses of the loops of an axis.
//!
//! In: a machine and axes. Out: margins and bandwidths as a table, everything as JSON, curves as a page. Nothing is simulated.

use super::bode_page::page;
use super::failure::Failure;
use super::inputs::{refuse_same_file, refused};
use super::output::{print, print_json, show, table};
use crate::base::{AxisKind, Diagnostic, units};
use crate::drive::{FrequencyResponses, LOWEST_HZ, LoopResponse, Point, frequency_responses};
use crate::machine::{Axis, DriveData, Machine, load};
use clap::Args;
use serde_json::{Map, Value, json};
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  sollwert machine bode spinner_mvc850 --axis X
  sollwert machine bode my_machine.toml --axis X --set axes.X.drive.position_gain_per_s=80 -o bode.html

The loops are those of the discrete model at their own cycles, filters, DSC, delays, feed-forward and a second
mass included. Left out is what is not linear: dry friction, gravity, limits, encoder quanta, play, screw errors.")]
pub(super) struct BodeArguments {
    /// Machine file, or the name of a shipped machine
    machine: String,
    /// Axis; may be given several times; default: all axes with a drive
    #[arg(long = "axis", value_name = "AXIS")]
    axes: Vec<String>,
    /// Change one value first, such as axes.X.drive.position_gain_per_s=80
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Lowest frequency of the curves
    #[arg(long, value_name = "HZ", default_value_t = LOWEST_HZ)]
    from_hz: f64,
    /// Write the curves as a page to look at
    #[arg(short, long, value_name = "PAGE.html")]
    output: Option<PathBuf>,
    /// One JSON document on stdout, curves included
    #[arg(long)]
    pub(super) json: bool,
}

/// What no linear model has.
pub(super) const LEFT_OUT: [&str; 6] = [
    "dry friction and stick",
    "gravity",
    "limits of speed, torque, current and voltage, with their anti-windup",
    "encoder quanta",
    "play and its compensation",
    "screw errors, their compensation and the friction pulse",
];

/// One axis and its responses.
pub(super) struct AxisResponses {
    pub(super) name: String,
    pub(super) kind: AxisKind,
    pub(super) responses: FrequencyResponses,
}

impl AxisResponses {
    /// The three loops, from the outside in, with their names.
    pub(super) fn loops(&self) -> [(&'static str, &LoopResponse); 3] {
        let FrequencyResponses { position, speed, current, .. } = &self.responses;
        [("position", position), ("speed", speed), ("current", current)]
    }
}

pub(super) fn bode(arguments: &BodeArguments) -> Result<(), Failure> {
    let loaded = load(&arguments.machine, &arguments.sets).map_err(refused)?;
    show(&loaded.warnings);
    if !(arguments.from_hz > 0.0 && arguments.from_hz.is_finite()) {
        let message = format!("--from-hz {} is no frequency above 0", arguments.from_hz);
        return Err(Failure::wrong_usage(vec![Diagnostic::error("C0002", message).help("give one such as 0.1")]));
    }
    let axes = chosen(&loaded.machine, &arguments.axes)?;
    let time_base = loaded.machine.cycle.time_base;
    let all: Vec<AxisResponses> = axes
        .into_iter()
        .map(|(axis, drive)| AxisResponses {
            name: axis.name.clone(),
            kind: axis.kind,
            responses: frequency_responses(drive, &time_base, arguments.from_hz),
        })
        .collect();
    if let Some(output) = &arguments.output {
        refuse_same_file([std::path::Path::new(&arguments.machine)], output)?;
        std::fs::write(output, page(&loaded.machine.name, &all)).map_err(|error| {
            let message = format!("`{}` cannot be written: {error}", output.display());
            Failure::unreadable(
                Diagnostic::error("C0004", message).help("give -o a path in a folder that can be written"),
            )
        })?;
    }
    if arguments.json {
        let axes: Map<String, Value> = all.iter().map(|axis| (axis.name.clone(), document(axis))).collect();
        let page = arguments.output.as_ref().map(|output| output.display().to_string());
        return print_json(&json!({
            "format": 1, "machine": loaded.machine.name, "axes": axes, "left_out": LEFT_OUT, "page": page,
        }));
    }
    let mut text = format!("{}: loops of the discrete model\n", loaded.machine.name);
    text += &table(&rows(&all));
    text += &format!("Left out: {}.\n", LEFT_OUT.join("; "));
    if let Some(output) = &arguments.output {
        text += &format!("Curves: {}\n", output.display());
    }
    print(&text)
}

/// The axes by name, each with its drive.
fn chosen<'m>(machine: &'m Machine, names: &[String]) -> Result<Vec<(&'m Axis, &'m DriveData)>, Failure> {
    let with_drive = || machine.axes.iter().filter_map(|axis| axis.drive.as_ref().map(|drive| (axis, drive)));
    let known: Vec<&str> = with_drive().map(|(axis, _)| axis.name.as_str()).collect();
    let help = match known.as_slice() {
        [] => "the machine has no axis with [axes.*.drive], motor and mechanics".to_owned(),
        known => format!("axes with a drive: {}", known.join(", ")),
    };
    let wrong = |message: String| Failure::wrong_usage(vec![Diagnostic::error("C0002", message).help(help.clone())]);
    if names.is_empty() {
        return if known.is_empty() {
            Err(wrong("no axis has a drive".to_owned()))
        } else {
            Ok(with_drive().collect())
        };
    }
    names
        .iter()
        .map(|name| {
            let id = machine.axis_by_name(name).ok_or_else(|| wrong(format!("there is no axis {name}")))?;
            let axis = machine.axis(id);
            let drive = axis.drive.as_ref().ok_or_else(|| wrong(format!("axis {name} is ideal: it has no drive")))?;
            Ok((axis, drive))
        })
        .collect()
}

fn rows(all: &[AxisResponses]) -> Vec<Vec<String>> {
    let head = ["axis, loop", "cycle", "crossover", "phase margin", "gain margin", "-3 dB", "peak", "stable"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for axis in all {
        for (name, of_loop) in axis.loops() {
            let or_none = |text: Option<String>| text.unwrap_or_else(|| "none".to_owned());
            let gain = of_loop.gain_margin.map(|m| format!("{:.1} dB", units::db_from_ratio(m.margin_ratio)));
            rows.push(vec![
                format!("{} {name}", axis.name),
                format!("{} µs", round(of_loop.period_s * units::US_PER_S)),
                or_none(of_loop.phase_margin.map(|m| hertz(m.crossover_hz))),
                or_none(of_loop.phase_margin.map(|m| format!("{:.1}°", m.margin_deg))),
                or_none(gain),
                or_none(of_loop.bandwidth_hz.map(hertz)),
                peak(of_loop),
                if of_loop.spectral_radius_ratio < 1.0 { "yes" } else { "NO" }.to_owned(),
            ]);
        }
    }
    rows
}

/// A peak above 0 dB, in words.
pub(super) fn peak(of_loop: &LoopResponse) -> String {
    let peak_db = units::db_from_ratio(of_loop.peak.response.norm());
    // What a person would read as 0.00 dB is none.
    if peak_db < 0.005 { "none".to_owned() } else { format!("{peak_db:.2} dB at {}", hertz(of_loop.peak.frequency_hz)) }
}

fn hertz(frequency_hz: f64) -> String {
    format!("{} Hz", round(frequency_hz))
}

/// Four significant digits.
pub(super) fn round(value: f64) -> String {
    let digits = (3.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

fn document(axis: &AxisResponses) -> Value {
    let mut document = Map::new();
    for (name, of_loop) in axis.loops() {
        document.insert(name.to_owned(), of_loop_document(of_loop));
    }
    let FrequencyResponses { setpoint, deviation, compliance, .. } = &axis.responses;
    document.insert("setpoint_to_position".to_owned(), curve(setpoint, 1.0));
    document.insert("setpoint_to_deviation".to_owned(), curve(deviation, 1.0));
    let (key, scale) = match axis.kind {
        AxisKind::Linear => ("torque_to_position_um_per_n_m", units::UM_PER_MM),
        AxisKind::Rotary => ("torque_to_position_deg_per_n_m", units::DEG_PER_RAD),
    };
    document.insert(key.to_owned(), curve(compliance, scale));
    Value::Object(document)
}

fn of_loop_document(of_loop: &LoopResponse) -> Value {
    let db = units::db_from_ratio;
    json!({
        "cycle_us": of_loop.period_s * units::US_PER_S,
        "crossover_hz": of_loop.phase_margin.map(|m| m.crossover_hz),
        "phase_margin_deg": of_loop.phase_margin.map(|m| m.margin_deg),
        "gain_margin_db": of_loop.gain_margin.map(|m| db(m.margin_ratio)),
        "gain_margin_hz": of_loop.gain_margin.map(|m| m.crossover_hz),
        "gain_reduction_db": of_loop.gain_reduction.map(|m| db(m.margin_ratio)),
        "gain_reduction_hz": of_loop.gain_reduction.map(|m| m.crossover_hz),
        "bandwidth_hz": of_loop.bandwidth_hz,
        "peak_db": db(of_loop.peak.response.norm()),
        "peak_hz": of_loop.peak.frequency_hz,
        "spectral_radius": of_loop.spectral_radius_ratio,
        "stable": of_loop.spectral_radius_ratio < 1.0,
        "open": curve(&of_loop.open, 1.0),
        "closed": curve(&of_loop.closed, 1.0),
    })
}

/// Amplitude (a ratio, or scaled to the unit of the key) and unwrapped phase.
fn curve(points: &[Point], scale: f64) -> Value {
    let frequencies: Vec<f64> = points.iter().map(|point| point.frequency_hz).collect();
    let amplitudes: Vec<f64> = points.iter().map(|point| point.response.norm() * scale).collect();
    json!({"frequency_hz": frequencies, "amplitude": amplitudes, "phase_deg": unwrapped_deg(points)})
}

/// Phase without jumps of 360°, beginning between -360° and 0° or near 0°.
pub(super) fn unwrapped_deg(points: &[Point]) -> Vec<f64> {
    let mut turns = 0.0;
    let mut before: Option<f64> = None;
    points
        .iter()
        .map(|point| {
            let phase_deg = units::deg_from_rad(point.response.arg());
            match before {
                // A lag of more than half a turn at the start is a lag: -190° and not 170°.
                None if phase_deg > 90.0 => turns = -1.0,
                Some(last) if phase_deg - last > 180.0 => turns -= 1.0,
                Some(last) if phase_deg - last < -180.0 => turns += 1.0,
                _ => {}
            }
            before = Some(phase_deg);
            phase_deg + units::deg_from_rad(units::RAD_PER_REV) * turns
        })
        .collect()
}
