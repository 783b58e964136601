//! `sollwert identify --plan` and `--smoothing`: programs to record, and the control calibrated on a traced program.
//!
//! In: the machine; a trace and its program. Out: NC programs in a folder with the signals to trace; a table or JSON of the control's settings with
//! intervals, and with `-o` the machine file. Does not compute anything.

use super::failure::Failure;
use super::identify::{IdentifyArguments, axes, read, write_whole};
use super::identify_control_page::page;
use super::inputs::refuse_same_file;
use super::output::{ProgressLine, print, print_json, show, table};
use crate::base::units::percent_from_ratio;
use crate::base::{Diagnostic, SourceText};
use crate::identify::{Agreement, ControlResult, PLANNED_SIGNALS, PlannedProgram, TracedProgram, calibrate, plan};
use crate::machine::{Loaded, parse};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Writes the programs.
pub(super) fn planning(arguments: &IdentifyArguments) -> Result<(), Failure> {
    if !arguments.traces.is_empty() {
        return Err(wrong("--plan takes no trace", "write `sollwert identify --plan -m MACHINE -o FOLDER`"));
    }
    let loaded = arguments.machine.load()?;
    let programs = plan(&loaded.machine, &axes(&arguments.axes, &loaded.machine)?);
    let folder = arguments.output.clone().unwrap_or_else(|| PathBuf::from("."));
    std::fs::create_dir_all(&folder).map_err(|error| {
        let finding = Diagnostic::error("T0206", format!("cannot make the folder `{}`: {error}", folder.display()));
        Failure::unreadable(finding.help("name another one with -o"))
    })?;
    for program in &programs {
        write_whole(&folder.join(&program.name), &program.text)?;
    }
    if arguments.json { print_json(&plan_document(&programs, &folder)) } else { print(&plan_text(&programs, &folder)) }
}

fn plan_document(programs: &[PlannedProgram], folder: &Path) -> Value {
    let program = |program: &PlannedProgram| {
        json!({
            "file": folder.join(&program.name).display().to_string(),
            "axes": program.axes,
            "trace_s": program.trace_s,
            "purpose": program.purpose,
        })
    };
    let signals: Vec<Value> = PLANNED_SIGNALS
        .iter()
        .map(|signal| json!({"signal": signal.ours, "operate": signal.operate, "edge": signal.edge, "tells": signal.tells}))
        .collect();
    json!({"format": 1, "programs": programs.iter().map(program).collect::<Vec<_>>(), "signals": signals})
}

fn plan_text(programs: &[PlannedProgram], folder: &Path) -> String {
    let mut rows = vec![["program", "trace", "for"].map(str::to_owned).to_vec()];
    rows.extend(programs.iter().map(|program| {
        let file = folder.join(&program.name).display().to_string();
        vec![file, format!("{:.0} s", program.trace_s), program.purpose.clone()]
    }));
    let mut text = table(&rows);
    text += "\nSignals to trace for each axis, at the position cycle, the most needed first:\n";
    let mut rows = vec![["signal", "Operate", "Edge", "tells"].map(str::to_owned).to_vec()];
    rows.extend(
        PLANNED_SIGNALS
            .iter()
            .map(|signal| [signal.ours, signal.operate, signal.edge, signal.tells].map(str::to_owned).to_vec()),
    );
    text += &table(&rows);
    text + "\n$AN_SLTRACE=1 starts the trace and =2 stops it. Check travel, clamping and the tool before you run them.\n\
            Here: sollwert run PROGRAM -m MACHINE -o TRACE.mcap, then sollwert identify TRACE.mcap -m MACHINE\n"
}

fn wrong(message: &str, help: &str) -> Failure {
    Failure::unreadable(Diagnostic::error("T0207", message.to_owned()).help(help))
}

/// Calibrates the control.
pub(super) fn calibration(arguments: &IdentifyArguments) -> Result<(), Failure> {
    if !arguments.traces.len().is_multiple_of(2) || arguments.traces.is_empty() {
        return Err(wrong(
            "--smoothing takes a trace and its program, or several such pairs",
            "write `sollwert identify --smoothing TRACE PROGRAM -m MACHINE`; pairs not used for the fit with --validate TRACE PROGRAM",
        ));
    }
    let inputs = arguments.traces.iter().chain(&arguments.validate).map(PathBuf::as_path);
    for output in arguments.output.iter().chain(&arguments.report) {
        refuse_same_file(inputs.clone(), output)?;
    }
    let loaded = arguments.machine.load_to_run()?;
    let machine = &loaded.machine;
    let fitted = arguments.traces.len() / 2;
    let pairs = || arguments.traces.chunks_exact(2).chain(arguments.validate.chunks_exact(2));
    let mut read_pairs = Vec::new();
    for (trace, program) in pairs().map(|pair| (&pair[0], &pair[1])) {
        let setup = arguments.surroundings.open(program, machine)?;
        read_pairs.push((read(trace, &["position_setpoint", "path.feed_mm_min"], arguments, machine)?, setup));
    }
    let traced: Vec<TracedProgram<'_>> =
        read_pairs.iter().map(|(trace, setup)| TracedProgram { trace, setup: setup.clone() }).collect();
    let line = std::cell::RefCell::new(ProgressLine::new());
    let (used, unseen) = traced.split_at(fitted);
    let result = calibrate(used, unseen, machine, &mut |what| line.borrow_mut().update(|| what.to_owned()));
    drop(line);
    let result = result.map_err(|finding| Failure::found_wrong(vec![finding]))?;
    if let Some(output) = &arguments.output {
        let text = SourceText::new(loaded.name.clone(), loaded.text_as_used.as_str());
        let calibrated = parse(&text, &result.sets).map_err(Failure::found_wrong)?;
        show(&calibrated.warnings);
        write_whole(output, &calibrated.text_as_used)?;
    }
    let files: Vec<String> = pairs().map(|pair| pair[1].display().to_string()).collect();
    if let Some(report) = &arguments.report {
        write_whole(report, &page(&machine.name, &result, &files))?;
    }
    if arguments.json {
        let mut document = control_document(&result, &files, &loaded);
        if let Some(output) = &arguments.output {
            document["output"] = json!(output.display().to_string());
        }
        if let Some(report) = &arguments.report {
            document["report"] = json!(report.display().to_string());
        }
        print_json(&document)
    } else {
        print(&control_text(&result, &files))?;
        if let Some(output) = &arguments.output {
            print(&format!("\nmachine file: {}\n", output.display()))?;
        }
        match &arguments.report {
            Some(report) => print(&format!("page: {}\n", report.display())),
            None => Ok(()),
        }
    }
}

fn control_document(result: &ControlResult, files: &[String], loaded: &Loaded) -> Value {
    let estimates: serde_json::Map<String, Value> = result
        .estimates
        .iter()
        .map(|e| (e.key.clone(), json!({"value": e.value, "unit": "", "low": e.low, "high": e.high})))
        .collect();
    let refused: serde_json::Map<String, Value> =
        result.refusals.iter().map(|(key, reason)| (key.clone(), json!({"reason": reason}))).collect();
    let choices: serde_json::Map<String, Value> =
        result.choices.iter().map(|(key, word)| ((*key).to_owned(), json!(word))).collect();
    let of = |agreement: &Agreement| {
        json!({
            "cycle_time_s": [agreement.traced_s, agreement.planned_s],
            "feed_rms_percent": percent_from_ratio(agreement.feed_rms_share),
            "path_rms_mm": agreement.path_rms_mm,
        })
    };
    let programs: Vec<Value> = result
        .agreements
        .iter()
        .zip(files)
        .enumerate()
        .map(|(place, ((before, after), file))| {
            json!({"program": file, "used": place < result.fitted, "before": of(before), "after": of(after)})
        })
        .collect();
    json!({
        "format": 1,
        "machine": loaded.machine.name,
        "control": estimates,
        "choices": choices,
        "refused": refused,
        "programs": programs,
        "sets": result.sets,
        "plans": result.plans,
    })
}

pub(super) fn control_text(result: &ControlResult, files: &[String]) -> String {
    let mut rows = vec![["setting", "value", "as good: from", "to", ""].map(str::to_owned).to_vec()];
    rows.extend(result.estimates.iter().map(|e| {
        let number = |value: f64| format!("{value:.4}");
        vec![e.key.clone(), number(e.value), number(e.low), number(e.high), e.title.to_owned()]
    }));
    rows.extend(result.choices.iter().map(|(key, word)| vec![(*key).to_owned(), word.clone()]));
    let mut text = table(&rows);
    if !result.refusals.is_empty() {
        text += "  not to be told from this program:\n";
        for (key, reason) in &result.refusals {
            text += &format!("  - {key}: {reason}\n");
        }
    }
    let mut rows = vec![
        ["program", "traced", "planned before", "after", "feed RMS before", "after", "path RMS after"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for (place, ((before, after), file)) in result.agreements.iter().zip(files).enumerate() {
        let percent = |share: f64| format!("{:.2} %", percent_from_ratio(share));
        let time = |agreement: &Agreement| {
            format!(
                "{:.3} s ({:+.2} %)",
                agreement.planned_s,
                percent_from_ratio(agreement.planned_s / agreement.traced_s - 1.0)
            )
        };
        rows.push(vec![
            format!("{file}{}", if place < result.fitted { "" } else { " (not used)" }),
            format!("{:.3} s", before.traced_s),
            time(before),
            time(after),
            percent(before.feed_rms_share),
            percent(after.feed_rms_share),
            if after.path_rms_mm.is_finite() { format!("{:.5} mm", after.path_rms_mm) } else { "-".to_owned() },
        ]);
    }
    text + "\n" + &table(&rows) + &format!("  {} plans of the program\n", result.plans)
}
