//! `sollwert run`: replay a program, record everything.
//!
//! In: program, machine, options. Out: a recording, figures as table or JSON, findings. Does not compute any of them.

use super::failure::Failure;
use super::inputs::{MachineChoice, Panel, Surroundings, default_recording, refuse_same_file};
use super::output::{ProgressLine, print, print_json, show, table};
use super::recorded::Recorded;
use super::report::write_of_recording;
use crate::base::Diagnostic;
use crate::kernel::{self, RunOptions, RunOutcome, RunSummary};
use crate::recorder::SignalChoice;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Example:\n  sollwert run programs/spline.mpf -m machines/spinner_mvc850.toml -o spline.mcap")]
pub(super) struct RunArguments {
    /// NC program (UTF-8, Latin-1 or Windows-1252)
    program: PathBuf,
    #[command(flatten)]
    machine: MachineChoice,
    #[command(flatten)]
    surroundings: Surroundings,
    #[command(flatten)]
    panel: Panel,
    /// Recording to write; default: the program's name with .mcap, in the current folder
    #[arg(short, long, value_name = "TRACE.mcap")]
    output: Option<PathBuf>,
    /// Page with plots, path and figures to write as well (`sollwert report` of the recording)
    #[arg(long, value_name = "R.html")]
    report: Option<PathBuf>,
    /// Set-points only: every axis is ideal
    #[arg(long)]
    no_drives: bool,
    /// Simulated seconds per second of real time, 1 = real time; default: as fast as possible
    #[arg(long, value_name = "X", value_parser = positive)]
    pace: Option<f64>,
    #[command(flatten)]
    recorded: Recorded,
    /// Go on behind the last set-point until every axis is in position; the set-point stands, and figures do not count it
    #[arg(long)]
    record_to_rest: bool,
    /// Threads: 1 runs everything in one, 2 the cycle beside its preparation, 3 the reading of the program as well; the result is the same
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..))]
    threads: u16,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("expected a number above 0, such as 1 for real time".into()),
    }
}

pub(super) fn run(arguments: &RunArguments) -> Result<(), Failure> {
    let machine = arguments.machine.load_to_run()?;
    let setup = arguments.surroundings.open(&arguments.program, &machine.machine)?;
    let recording = arguments.output.clone().unwrap_or_else(|| default_recording(&arguments.program));
    let inputs = [arguments.program.as_path()].into_iter().chain(arguments.machine.path());
    refuse_same_file(inputs.chain(arguments.surroundings.workshop_files()), &recording)?;
    check_page(arguments, &recording)?;
    let mut signals = arguments.recorded.signals(&machine)?.until_rest(arguments.record_to_rest);
    if arguments.no_drives {
        // Without drives every wire behind the set-point is a copy of it: only what was computed is recorded.
        signals = signals.and(&SignalChoice::setpoints());
    }
    let options = RunOptions {
        machine: &machine,
        setup,
        overrides: arguments.panel.overrides()?,
        drives: !arguments.no_drives,
        recording: Some(&recording),
        mantissa_bits: arguments.recorded.record_precision,
        signals,
        threads: arguments.threads.into(),
        pace_ratio: arguments.pace,
    };
    let mut line = ProgressLine::new();
    let outcome = kernel::run(options, &mut |at| {
        line.update(|| format!("{:.1} s simulated, {} blocks, line {}", at.time_s, at.blocks, at.line));
    });
    drop(line);
    let outcome = outcome.map_err(|error| Failure::unreadable(error.0))?;
    // The page first: the document on stdout names it only when it is there. A run that an alarm ended has one, too.
    let page = arguments.report.as_ref().map(|page| write_of_recording(&recording, page).map(|_| page)).transpose()?;
    let style = Style { json: arguments.json, drives: !arguments.no_drives, page: page.cloned() };
    report(&outcome, Some(&recording), &style)
}

/// The page must not be an input or the recording.
fn check_page(arguments: &RunArguments, recording: &std::path::Path) -> Result<(), Failure> {
    let Some(page) = &arguments.report else { return Ok(()) };
    let inputs = [arguments.program.as_path(), recording].into_iter().chain(arguments.machine.path());
    if page == recording {
        let finding = Diagnostic::error("C0001", format!("`{}` is both recording and page", page.display()));
        return Err(Failure::unreadable(finding.help("give another name to --report")));
    }
    refuse_same_file(inputs.chain(arguments.surroundings.workshop_files()), page)
}

/// How to show an outcome.
pub(super) struct Style {
    pub(super) json: bool,
    pub(super) drives: bool,
    /// The page that was written.
    pub(super) page: Option<PathBuf>,
}

/// Findings to stderr, figures to stdout; exit code 1 on an alarm.
pub(super) fn report(outcome: &RunOutcome, recording: Option<&PathBuf>, style: &Style) -> Result<(), Failure> {
    show(&outcome.warnings);
    if let Some(alarm) = &outcome.alarm {
        show([alarm]);
    }
    if let Some(deadlines) = outcome.deadlines.filter(|deadlines| deadlines.missed > 0) {
        let message = format!(
            "{} cycles began more than one t_s late, the latest {:.1} ms",
            deadlines.missed,
            deadlines.latest_s * crate::base::units::MS_PER_S
        );
        show([&Diagnostic::note("K0004", message)]);
    }
    if style.json {
        let mut document = document(&outcome.summary, recording);
        if let Some(page) = &style.page {
            document["report"] = json!(page.display().to_string());
        }
        print_json(&document)?;
    } else {
        print(&figures_text(&outcome.summary, style))?;
        if let (Some(path), Some(recorded)) = (recording, &outcome.recording) {
            print(&format!(
                "\nrecorded {} messages, {:.1} MB: {}\n",
                recorded.messages,
                recorded.bytes as f64 / 1e6,
                path.display()
            ))?;
        }
        if let Some(page) = &style.page {
            print(&format!("page: {}\n", page.display()))?;
        }
    }
    if outcome.alarm.is_some() { Err(Failure::told()) } else { Ok(()) }
}

/// The summary with the name of the recording, which the recording itself must not hold.
pub(super) fn document(summary: &RunSummary, recording: Option<&PathBuf>) -> serde_json::Value {
    let mut document = serde_json::to_value(summary).unwrap_or_else(|_| json!({}));
    if let Some(path) = recording {
        document["recording"] = json!(path.display().to_string());
    }
    document
}

/// Figures for people.
pub(super) fn figures_text(summary: &RunSummary, style: &Style) -> String {
    let cell = |text: &str| text.to_owned();
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let mut rows = vec![
        vec![cell("cycle time"), format!("{:.3} s", summary.cycle_time_s)],
        vec![cell("at programmed feed (CAM time)"), format!("{:.3} s", summary.cam_time_s)],
    ];
    if let Some(ratio) = summary.time_ratio {
        rows.push(vec![cell("cycle time / CAM time"), format!("{ratio:.3}")]);
    }
    rows.push(vec![cell("share of time at programmed feed"), percent(summary.programmed_feed_share)]);
    rows.push(vec![cell("path length"), format!("{:.3} mm", summary.path_length_mm)]);
    rows.push(vec![cell("blocks"), summary.blocks.to_string()]);
    rows.push(vec![cell("set-points"), summary.setpoints.to_string()]);
    rows.push(vec![cell("blended corners"), summary.corners_total.to_string()]);
    let mut text = format!("{} on {}\n\n{}", summary.program, summary.machine, table(&rows));
    if let Some(alarm) = &summary.alarm {
        text += &format!("\nended early by alarm {} in line {}: {}\n", alarm.code, alarm.line, alarm.message);
    }
    let mut limits: Vec<(&String, &f64)> = summary.limits.iter().collect();
    limits.sort_by(|a, b| b.1.total_cmp(a.1));
    let limits: Vec<Vec<String>> =
        limits.into_iter().map(|(name, share)| vec![name.clone(), percent(*share)]).collect();
    text += &format!("\nwhat limits the feed (share of the cycle time)\n{}", table(&limits));
    text += &format!("\naxes{}\n{}", representative_mark(summary), axes_table(summary, style.drives));
    text
}

fn representative_mark(summary: &RunSummary) -> &'static str {
    let representative = summary.warnings.iter().any(|warning| warning.code == "D0002");
    if representative { " (deviations and following errors: representative drive, not identified)" } else { "" }
}

fn axes_table(summary: &RunSummary, drives: bool) -> String {
    let mut head = vec![String::new(), "velocity max".into(), "acceleration max".into(), "jerk max".into()];
    if drives {
        head.extend(["control deviation max".into(), "rms".into(), "following error max".into(), "rms".into()]);
    }
    let mut rows = vec![head];
    for (name, figures) in &summary.axes {
        let value = |prefix: &str| {
            let field = figures.as_object().and_then(|fields| fields.iter().find(|(key, _)| key.starts_with(prefix)));
            field.and_then(|(key, value)| Some((key.as_str(), value.as_f64()?)))
        };
        let show = |prefix: &str, digits: usize| {
            value(prefix).map_or(String::new(), |(key, value)| format!("{value:.digits$} {}", unit_of(key, prefix)))
        };
        let mut row = vec![name.clone(), show("velocity_max_", 2), show("acceleration_max_", 1), show("jerk_max_", 0)];
        if drives {
            for prefix in
                ["control_deviation_max_", "control_deviation_rms_", "following_error_max_", "following_error_rms_"]
            {
                row.push(show(prefix, 5));
            }
        }
        rows.push(row);
    }
    table(&rows)
}

/// `velocity_max_mm_s` -> `mm/s`: the unit at the end of a key, as people write it.
fn unit_of(key: &str, prefix: &str) -> String {
    let unit = &key[prefix.len()..];
    unit.replacen("_s", "/s", 1).replace("s2", "s²").replace("s3", "s³")
}
