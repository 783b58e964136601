//! `sollwert moves`: what the interpreter makes of a program.
//!
//! In: program, machine. Out: one line or one JSON object a move, streamed. Does not smooth or plan.

use super::failure::Failure;
use super::inputs::{MachineChoice, Surroundings};
use super::output::{show, written};
use crate::base::{AxisKind, AxisVector, Diagnostic, PartPoint, Severity, units};
use crate::interpreter::{Interpreter, Listing, Move, MoveKind, Setup, feed_per_minute, kind_name};
use crate::machine::Machine;
use clap::Args;
use serde_json::{Map, Value, json};
use std::io::Write;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Example:\n  sollwert moves part.mpf -m spinner_mvc850 | head")]
pub(super) struct MovesArguments {
    /// NC program
    program: PathBuf,
    #[command(flatten)]
    machine: MachineChoice,
    #[command(flatten)]
    surroundings: Surroundings,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn moves(arguments: &MovesArguments) -> Result<(), Failure> {
    let loaded = arguments.machine.load()?;
    let setup = Setup { lists_only: true, ..arguments.surroundings.open(&arguments.program, &loaded.machine)? };
    let mut interpreter = Interpreter::new(setup, &loaded.machine);
    let mut listing = Listing::new(&loaded.machine);
    // Streamed: the program may have ten million blocks. A closed pipe is the reader's way to say "enough".
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    let mut done = Ok(());
    let mut first = true;
    let mut start = home(&loaded.machine);
    if arguments.json {
        done = out.write_all(b"{\"format\": 1, \"moves\": [");
    }
    let alarm = loop {
        match interpreter.next_move() {
            Ok(Some(next)) if done.is_ok() => {
                let text = if arguments.json {
                    let separator = if std::mem::take(&mut first) { "\n " } else { ",\n " };
                    format!("{separator}{}", json_of(&next, std::mem::replace(&mut start, next.end), &loaded.machine))
                } else {
                    listing.line(&next) + "\n"
                };
                done = out.write_all(text.as_bytes());
            }
            Ok(_) => break None,
            Err(alarm) => break Some(alarm),
        }
    };
    let (errors, warnings): (Vec<_>, Vec<_>) =
        interpreter.take_warnings().into_iter().partition(|finding| finding.severity == Severity::Error);
    if arguments.json {
        let list = |findings: &[Diagnostic]| -> Value {
            findings.iter().map(|finding| json!(crate::kernel::Warning::from(finding))).collect()
        };
        let ended = alarm.as_ref().map_or(String::new(), |alarm| {
            format!(", \"alarm\": {}", json!(crate::kernel::Warning::from(alarm.as_ref())))
        });
        done = done.and_then(|()| {
            writeln!(out, "\n], \"warnings\": {}, \"errors\": {}{ended}}}", list(&warnings), list(&errors))
        });
    }
    done = done.and_then(|()| out.flush());
    drop(out);
    show(&warnings);
    show(&errors);
    if let Some(alarm) = &alarm {
        show([alarm.as_ref()]);
    }
    written(done)?;
    if alarm.is_some() || !errors.is_empty() { Err(Failure::told()) } else { Ok(()) }
}

/// `feed_mm_min` is null for rapids, and deg/min where only rotary axes move.
fn json_of(next: &Move, start: PartPoint, machine: &Machine) -> Value {
    let mut end = Map::new();
    for id in machine.axis_ids() {
        let axis = machine.axis(id);
        let value_lu = next.end.0[id];
        end.insert(
            axis.name.clone(),
            json!(if axis.kind == AxisKind::Rotary { units::deg_from_rad(value_lu) } else { value_lu }),
        );
    }
    let mut fields = Map::new();
    fields.insert("line".into(), json!(next.block.line));
    fields.insert("block".into(), json!(next.block.number));
    fields.insert("kind".into(), json!(kind_name(&next.kind)));
    fields.insert("end".into(), Value::Object(end));
    fields.insert("feed_mm_min".into(), json!(feed_per_minute(machine, start, next)));
    match &next.kind {
        MoveKind::Arc(arc) => {
            let names: Vec<&str> = arc.plane.iter().map(|id| machine.axis(*id).name.as_str()).collect();
            fields.insert("plane".into(), json!(names));
            fields.insert("centre_mm".into(), json!(arc.centre_mm));
            fields.insert("radius_mm".into(), json!(arc.radius_mm));
            fields.insert("sweep_deg".into(), json!(units::deg_from_rad(arc.sweep_rad)));
        }
        MoveKind::SpatialArc(arc) => {
            let named = |vector: &AxisVector| by_name(machine, vector, false);
            fields.insert("directions".into(), json!(arc.directions.each_ref().map(named)));
            fields.insert("centre_mm".into(), named(&arc.centre_mm));
            fields.insert("radius_mm".into(), json!(arc.radius_mm));
            fields.insert("sweep_deg".into(), json!(units::deg_from_rad(arc.sweep_rad)));
        }
        MoveKind::Spline(geometry) | MoveKind::Polynomial(geometry) => {
            let pieces = geometry.pieces.iter().map(|piece| {
                let rows: Vec<Value> = piece.numerator_lu.iter().map(|row| by_name(machine, row, true)).collect();
                json!({
                    "parameter_end": piece.parameter_end_ratio,
                    "numerator": rows,
                    "denominator": piece.denominator_ratio,
                })
            });
            fields.insert("pieces".into(), pieces.collect());
        }
        MoveKind::Dwell { time_s } => {
            fields.insert("time_s".into(), json!(time_s));
        }
        _ => {}
    }
    Value::Object(fields)
}

/// Components by axis, rotary ones in degrees.
fn by_name(machine: &Machine, vector: &AxisVector, with_rotary: bool) -> Value {
    let axes = machine.axis_ids().map(|id| (machine.axis(id), vector[id]));
    let shown = axes.filter(|(axis, _)| with_rotary || axis.kind == AxisKind::Linear).map(|(axis, value_lu)| {
        let rotary = axis.kind == AxisKind::Rotary;
        (axis.name.clone(), json!(if rotary { units::deg_from_rad(value_lu) } else { value_lu }))
    });
    Value::Object(shown.collect())
}

/// Where the axes stand before the first move.
fn home(machine: &Machine) -> PartPoint {
    let mut posture = PartPoint::default();
    for id in machine.axis_ids() {
        posture.0[id] = machine.axis(id).home_lu;
    }
    posture
}
