//! `sollwert recover`: what an interrupted run left.
//!
//! In: a damaged recording. Out: a whole one, and what was rescued. Does not change its input.

use super::failure::Failure;
use super::inputs::refuse_same_file;
use super::output::{print, print_json};
use crate::recorder::{RecoverReport, recover as recover_recording};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Example:\n  sollwert recover killed.mcap -o rescued.mcap")]
pub(super) struct RecoverArguments {
    /// Damaged recording; it is not changed
    recording: PathBuf,
    /// Whole recording to write
    #[arg(short, long, value_name = "OUT.mcap")]
    output: PathBuf,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

pub(super) fn recover(arguments: &RecoverArguments) -> Result<(), Failure> {
    refuse_same_file([arguments.recording.as_path()], &arguments.output)?;
    let report = recover_recording(&arguments.recording, &arguments.output).map_err(Failure::unreadable)?;
    let output = arguments.output.display();
    if arguments.json {
        print_json(&json!({
            "format": 1, "output": output.to_string(), "messages": report.messages, "end_s": report.end_s,
            "was_whole": report.was_whole, "chunks": report.chunks, "attachments": report.attachments,
            "left_out": report.left_out, "findings": report.findings, "bytes": report.bytes,
        }))
    } else {
        print(&format!("{}{output}\n", text(&report)))
    }
}

fn text(report: &RecoverReport) -> String {
    let mut text = String::new();
    if report.was_whole {
        text += "the recording was whole: the copy holds all of it\n";
    }
    text += &format!(
        "rescued {} messages up to {:.3} s of simulated time, {} complete chunks, {} attachments\n",
        report.messages, report.end_s, report.chunks, report.attachments
    );
    if report.messages_of_cut_chunk > 0 {
        text += &format!("{} of them out of the chunk that is cut off at the end\n", report.messages_of_cut_chunk);
    }
    for finding in &report.findings {
        text += &format!("  {finding}\n");
    }
    text
}
