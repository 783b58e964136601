//! Arguments that several sub-commands share, and what they load.
//!
//! In: `-m`, `--set`, paths. Out: machine and program, or findings on stderr and an exit code. Does not run anything.

use super::output::show;
use super::{FOUND_WRONG, UNREADABLE};
use crate::base::Diagnostic;
use crate::machine::{DEFAULT_MACHINE, LoadError, Loaded, load, unsupported};
use crate::program::ProgramSource;
use clap::Args;
use std::path::{Path, PathBuf};

/// `-m` and `--set`.
#[derive(Args)]
pub(super) struct MachineChoice {
    /// Machine file, or the name of a shipped machine
    #[arg(short, long, value_name = "MACHINE")]
    machine: Option<String>,
    /// Change one value for this run, such as axes.X.drive.velocity_feedforward=0.95
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

impl MachineChoice {
    /// Loads the machine; findings are shown, errors end with their exit code.
    pub(super) fn load(&self) -> Result<Loaded, u8> {
        let name = match &self.machine {
            Some(name) => name.as_str(),
            None => {
                let note = format!("no machine given: the three-axis machine `{DEFAULT_MACHINE}` is used");
                show([&Diagnostic::note("M0000", note)
                    .help("name one with -m; `sollwert machine list` shows the shipped ones")]);
                DEFAULT_MACHINE
            }
        };
        load(name, &self.sets).map_err(|error| match error {
            LoadError::Unreadable(finding) => {
                show([&finding]);
                UNREADABLE
            }
            LoadError::Invalid(findings) => {
                show(&findings);
                FOUND_WRONG
            }
        })
    }

    /// As `load`, and refuses by name what this version cannot simulate yet.
    pub(super) fn load_to_run(&self) -> Result<Loaded, u8> {
        let loaded = self.load()?;
        let refused = unsupported(&loaded.machine);
        if refused.is_empty() {
            return Ok(loaded);
        }
        show(&refused);
        Err(FOUND_WRONG)
    }
}

/// Opens a program.
pub(super) fn open_program(path: &Path) -> Result<ProgramSource, u8> {
    ProgramSource::from_file(path).map_err(|finding| {
        show([&finding]);
        UNREADABLE
    })
}

/// An output must not be the input: opening it would destroy what is to be read.
pub(super) fn refuse_same_file(input: &Path, output: &Path) -> Result<(), u8> {
    let same = match (input.canonicalize(), output.canonicalize()) {
        (Ok(input), Ok(output)) => input == output,
        _ => input == output,
    };
    if same {
        let finding = Diagnostic::error("C0001", format!("`{}` is both input and output", output.display()));
        show([&finding.help("give another name to -o")]);
        return Err(UNREADABLE);
    }
    Ok(())
}

/// `x.mpf` -> `x.mcap` in the current folder.
pub(super) fn default_recording(program: &Path) -> PathBuf {
    PathBuf::from(program.file_name().unwrap_or_else(|| "trace".as_ref())).with_extension("mcap")
}
