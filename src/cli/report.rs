//! `sollwert report`: a trace as a page to look at.
//!
//! In: a trace of any known format. Out: one HTML file that needs nothing else. Does not compute figures.

use super::failure::Failure;
use super::inputs::{TraceReading, refuse_same_file};
use super::output::{print, print_json, show};
use crate::base::Diagnostic;
use crate::compare::{examine, prepare};
use crate::recorder::{AXIS_FIELDS, PATH_FIELDS, Recording, Topic, TopicKind};
use crate::report::{self, Sheet};
use crate::trace::{ImportOptions, Trace, import};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  sollwert report spline.mcap -o spline.html
  sollwert report trace.xml --axis-name 7=A")]
pub(super) struct ReportArguments {
    /// Trace: a recording, or what a control exported
    trace: PathBuf,
    #[command(flatten)]
    reading: TraceReading,
    /// Page to write; default: the name of the trace with .html, in the current folder
    #[arg(short, long, value_name = "REPORT.html")]
    output: Option<PathBuf>,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn report(arguments: &ReportArguments) -> Result<(), Failure> {
    let name = arguments.trace.file_name().unwrap_or_else(|| "report".as_ref());
    let output = arguments.output.clone().unwrap_or_else(|| PathBuf::from(name).with_extension("html"));
    refuse_same_file([arguments.trace.as_path()], &output)?;
    let only = signals_of_file(&arguments.trace)?;
    let trace = arguments.reading.with_options(&only, |options| {
        let options = ImportOptions { programmed: true, ..options.clone() };
        import(&arguments.trace, &options).map_err(Failure::unreadable)
    })?;
    show(&trace.notes);
    let bytes = write(trace, &output)?;
    if arguments.json {
        return print_json(&json!({"format": 1, "output": output.display().to_string(), "bytes": bytes}));
    }
    print(&format!("page of {:.1} MB: {}\n", bytes as f64 / 1e6, output.display()))
}

fn write(mut trace: Trace, output: &Path) -> Result<u64, Failure> {
    if trace.signals.iter().all(|signal| signal.is_empty()) {
        let finding = Diagnostic::error("T0109", format!("{} holds no sample: there is nothing to draw", trace.name));
        return Err(Failure::unreadable(finding.help("was the recording interrupted before its first second?")));
    }
    prepare(&mut trace);
    let side = examine(&trace, None).map_err(Failure::unreadable)?;
    report::write(&Sheet { trace: &trace, side: &side, reference: None }, output).map_err(Failure::unreadable)
}

/// The page of a recording that has just been written: it is read back.
pub(super) fn write_of_recording(recording: &Path, output: &Path) -> Result<u64, Failure> {
    let only = signals_that_fit(&Recording::open(recording).map_err(Failure::unreadable)?)?;
    let options = ImportOptions { only, programmed: true, ..ImportOptions::default() };
    write(import(recording, &options).map_err(Failure::unreadable)?, output)
}

/// The signals of a file that fit into memory; empty = all, also for what is no recording.
pub(super) fn signals_of_file(path: &Path) -> Result<Vec<String>, Failure> {
    Recording::open(path).map_or_else(|_| Ok(Vec::new()), |recording| signals_that_fit(&recording))
}

/// Values in memory at most, 8 bytes each.
const VALUES_MAX: u64 = 90_000_000;
/// What a page keeps of a recording that does not fit: without the rest, and without the second line, and the third.
const KEPT: [&[&str]; 3] = [
    &["position_setpoint", "position_actual", "path.line", "path.program", "path.feed_mm_min"],
    &[
        "control_deviation",
        "path.limit_axis",
        "path.limit_kind",
        "path.contour_error_mm",
        "path.programmed_feed_mm_min",
    ],
    &["following_error", "velocity_setpoint", "acceleration_setpoint", "jerk_setpoint", "torque_reference", "current"],
];

/// The signals of a recording that fit into memory, for the import; empty = all. Memory must not grow with the length of a run.
fn signals_that_fit(recording: &Recording) -> Result<Vec<String>, Failure> {
    let values = |only: Option<&[&str]>| -> u64 {
        let of_topic = |topic: &Topic| match &topic.kind {
            TopicKind::Axis { .. } => {
                let kept =
                    topic.fields.iter().filter(|f| only.is_none_or(|only| only.contains(&AXIS_FIELDS[**f].stem)));
                topic.messages.saturating_mul(kept.count() as u64)
            }
            TopicKind::Path => {
                let kept =
                    PATH_FIELDS.iter().filter(|f| only.is_none_or(|only| only.contains(&format!("path.{f}").as_str())));
                topic.messages.saturating_mul(kept.count() as u64)
            }
            // The spindle is left out with the other signals that are not named.
            TopicKind::Spindle if only.is_none() => topic.messages.saturating_mul(topic.fields.len() as u64),
            _ => 0,
        };
        recording.topics().iter().map(of_topic).sum()
    };
    if values(None) <= VALUES_MAX {
        return Ok(Vec::new());
    }
    for lines in (1..=KEPT.len()).rev() {
        let only = KEPT[..lines].concat();
        if values(Some(&only)) <= VALUES_MAX {
            let message = format!("the recording is long: only {} are read", only.join(", "));
            show([&Diagnostic::note("T0112", message)
                .help("record fewer signals with --record, or less often, to choose them")]);
            return Ok(only.into_iter().map(str::to_owned).collect());
        }
    }
    let finding = Diagnostic::error("T0113", "the recording is too long to be held in memory".to_owned());
    Err(Failure::unreadable(
        finding.help("record fewer signals with --record, or less often, or `sollwert export` a part"),
    ))
}
