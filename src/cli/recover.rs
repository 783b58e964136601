//! `sollwert recover`: what an interrupted run left.

use super::UNREADABLE;
use super::inputs::refuse_same_file;
use super::output::{print, show};
use crate::recorder::recover as recover_recording;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Example:\n  sollwert recover killed.mcap -o rescued.mcap")]
pub(super) struct RecoverArguments {
    /// Damaged recording; it is not changed
    recording: PathBuf,
    /// Whole recording to write
    #[arg(short, long, value_name = "OUT.mcap")]
    output: PathBuf,
}

pub(super) fn recover(arguments: &RecoverArguments) -> Result<(), u8> {
    refuse_same_file(&arguments.recording, &arguments.output)?;
    match recover_recording(&arguments.recording, &arguments.output) {
        Ok(report) => {
            print(&format!("{report}\n{}\n", arguments.output.display()));
            Ok(())
        }
        Err(finding) => {
            show([&finding]);
            Err(UNREADABLE)
        }
    }
}
