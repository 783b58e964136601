//! Arguments that several sub-commands share, and what they load.
//!
//! In: `-m`, `--set`, paths. Out: machine and program, or findings on stderr and an exit code. Does not run anything.

use super::failure::Failure;
use super::output::{ProgressLine, show};
use crate::base::diagnostics::nearest;
use crate::base::units::{percent_from_ratio, ratio_from_percent};
use crate::base::{Diagnostic, SourceText};
use crate::feed::OverrideSchedule;
use crate::interpreter::Setup;
use crate::machine::{DEFAULT_MACHINE, LoadError, Loaded, Machine, load, load_workshop, parse, unsupported};
use crate::program::{ProgramSource, taken_axis_names};
use crate::recorder::{AXIS_FIELDS, Recording, axis_field};
use crate::trace::{ImportOptions, Progress};
use clap::Args;
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// `-m` and `--set`.
#[derive(Args)]
pub(super) struct MachineChoice {
    /// Machine file, or the name of a shipped machine; default: spinner_mvc850, a three-axis mill
    #[arg(short, long, value_name = "MACHINE")]
    machine: Option<String>,
    /// Change one value for this run, such as axes.X.drive.velocity_feedforward=0.95
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

impl MachineChoice {
    /// Loads the machine; findings are shown, errors end with their exit code.
    pub(super) fn load(&self) -> Result<Loaded, Failure> {
        let name = match &self.machine {
            Some(name) => name.as_str(),
            None => {
                let note = format!("no machine given: the three-axis machine `{DEFAULT_MACHINE}` is used");
                show([&Diagnostic::note("M0000", note)
                    .help("name one with -m; `sollwert machine list` shows the shipped ones")]);
                DEFAULT_MACHINE
            }
        };
        let loaded = load(name, &self.sets).map_err(refused)?;
        let taken = taken_axis_names(&loaded.machine);
        if taken.is_empty() { Ok(loaded) } else { Err(Failure::found_wrong(taken)) }
    }

    /// As `load`, but without `-m` a machine that travelled with a recording comes before the default one.
    pub(super) fn load_or_recorded(&self, traces: &[PathBuf]) -> Result<Loaded, Failure> {
        let recorded = || traces.iter().find_map(|path| Recording::open(path).ok()?.machine_text().ok()?);
        match (&self.machine, recorded()) {
            (None, Some((name, text))) => {
                let note = format!("no machine given: that of the recording, `{name}`, is used");
                show([&Diagnostic::note("M0000", note).help("name another one with -m")]);
                let loaded = parse(&SourceText::new(name, text), &self.sets);
                loaded.map_err(|findings| refused(LoadError::Invalid(findings)))
            }
            _ => self.load(),
        }
    }

    /// The machine file, if it is one that can be overwritten.
    pub(super) fn path(&self) -> Option<&Path> {
        self.machine.as_deref().map(Path::new)
    }

    /// As `load`, and refuses by name what this version cannot simulate yet.
    pub(super) fn load_to_run(&self) -> Result<Loaded, Failure> {
        let loaded = self.load()?;
        let refused = unsupported(&loaded.machine);
        if refused.is_empty() { Ok(loaded) } else { Err(Failure::found_wrong(refused)) }
    }
}

/// How a trace of a control is to be read.
#[derive(Args)]
pub(super) struct TraceReading {
    /// Machine file or shipped machine: names and kinds of the axes behind the numbers in the trace
    #[arg(short, long, value_name = "MACHINE")]
    machine: Option<String>,
    #[command(flatten)]
    names: TraceNames,
}

impl TraceReading {
    /// Calls `act` with the options; progress is shown while it works.
    pub(super) fn with_options<T>(
        &self,
        only: &[String],
        act: impl FnOnce(&ImportOptions) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let loaded = match &self.machine {
            Some(name) => Some(load(name, &[]).map_err(refused)?),
            None => None,
        };
        self.names.with_options(loaded.as_ref().map(|loaded| &loaded.machine), only, act)
    }
}

/// What the names in a trace mean.
#[derive(Args)]
pub(super) struct TraceNames {
    /// Name of a machine axis by its number in the trace, such as 7=A; may be given several times
    #[arg(long = "axis-name", value_name = "NUMBER=NAME")]
    axis_names: Vec<String>,
    /// Which of our signals a signal of the trace is, such as "ENC2_POS=position_actual"; may be given several times
    #[arg(long = "map", value_name = "CONTROLLER=OURS")]
    signal_map: Vec<String>,
    /// The time column of a CSV: NAME, NAME:SECONDS (what one of its units is), or the distance of the rows in s
    #[arg(long = "time", value_name = "NAME")]
    time_column: Option<String>,
}

impl TraceNames {
    /// Calls `act` with the options; progress is shown while it works.
    pub(super) fn with_options<T>(
        &self,
        machine: Option<&Machine>,
        only: &[String],
        act: impl FnOnce(&ImportOptions) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let progress = RefCell::new(ProgressLine::new());
        let tell = |done: u64, total: u64| {
            let share_percent = percent_from_ratio(done as f64 / total.max(1) as f64);
            progress.borrow_mut().update(|| format!("{share_percent:.0} % read"));
        };
        act(&ImportOptions {
            machine,
            axis_names: self.axis_names.iter().map(|text| axis_name(text)).collect::<Result<_, _>>()?,
            signal_map: self.signal_map.iter().map(|text| map_row(text)).collect::<Result<_, _>>()?,
            time_column: self.time_column.clone(),
            only: only.to_vec(),
            programmed: false,
            progress: Progress(Some(&tell)),
        })
    }
}

/// `7=A`.
pub(super) fn axis_name(text: &str) -> Result<(u32, String), Failure> {
    let parts = text.split_once('=').map(|(number, name)| (number.trim().parse(), name.trim()));
    match parts {
        Some((Ok(number), name)) if !name.is_empty() && !name.contains('.') => Ok((number, name.to_owned())),
        _ => {
            let message = format!("`--axis-name {text}` names no axis");
            Err(Failure::unreadable(Diagnostic::error("T0019", message).help("write --axis-name 7=A")))
        }
    }
}

/// `CONTROLLER=OURS`; the last `=` counts, because names of controllers may hold one.
fn map_row(text: &str) -> Result<(String, String), Failure> {
    let refuse =
        |message: String, help: String| Err(Failure::unreadable(Diagnostic::error("T0019", message).help(help)));
    let Some((theirs, ours)) = text.rsplit_once('=').filter(|(theirs, ours)| !theirs.is_empty() && !ours.is_empty())
    else {
        return refuse(format!("`--map {text}` maps nothing"), "write --map CONTROLLER=OURS".to_owned());
    };
    let stem = ours.rsplit('.').next().unwrap_or(ours);
    if !ours.starts_with("path.") && axis_field(stem).is_none() {
        let known = AXIS_FIELDS.iter().map(|field| field.stem);
        let near = nearest(stem, known).map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
        return refuse(
            format!("`{ours}` is none of our signals"),
            format!("write a field such as position_setpoint, or X.position_setpoint_mm{near}"),
        );
    }
    Ok((theirs.to_owned(), ours.to_owned()))
}

/// What happens at the control panel while a program runs.
#[derive(Args)]
pub(super) struct Panel {
    /// Feed override from a time on, in % of F: 2.5=50,4=120 is 50 % from 2.5 s of the program and 120 % from 4 s; 0 to 200, 0 stops. Rapids are left alone
    #[arg(long = "override", value_name = "TIME=PERCENT,...")]
    overrides: Option<String>,
}

impl Panel {
    /// The turns of the switch.
    pub(super) fn overrides(&self) -> Result<OverrideSchedule, Failure> {
        let Some(text) = &self.overrides else { return Ok(OverrideSchedule::none()) };
        OverrideSchedule::parse(text).map_err(Failure::unreadable)
    }
}

/// What lies around a program.
#[derive(Args)]
pub(super) struct Surroundings {
    /// Folder in which sub-programs are looked for, after that of the program; may be given several times
    #[arg(short = 'I', long = "include", value_name = "FOLDER")]
    include: Vec<PathBuf>,
    /// File with definitions of global user variables (GUD), instead of those beside the program; may be given several times
    #[arg(long = "gud", value_name = "FILE.DEF")]
    definitions: Vec<PathBuf>,
    /// Skip levels to activate, such as 0,3: blocks with / or /3 are not executed
    #[arg(long = "skip", value_name = "LEVELS", value_delimiter = ',', value_parser = clap::value_parser!(u8).range(0..=9))]
    skip: Vec<u8>,
    /// Switch of the spindle override at the control panel, in % of S
    #[arg(long, value_name = "PERCENT", default_value_t = 100.0, value_parser = spindle_percent)]
    spindle_override: f64,
    /// Tool table (docs/workshop-file.md); without one the length of every tool is 0
    #[arg(short, long, value_name = "TOOLS.toml")]
    tools: Option<PathBuf>,
    /// Zero offsets (G54 and so on) of the same form; may also stand in the file of the tools
    #[arg(short = 'z', long, value_name = "OFFSETS.toml")]
    offsets: Option<PathBuf>,
}

/// MD12060 and MD12070 of most machines.
fn spindle_percent(text: &str) -> Result<f64, String> {
    let percent = text.trim_end_matches('%').parse::<f64>().ok().filter(|percent| (1.0..=200.0).contains(percent));
    percent.ok_or_else(|| "expected 1 to 200 %".to_owned())
}

impl Surroundings {
    /// Opens a program with what lies around it.
    pub(super) fn open(&self, program: &Path, machine: &Machine) -> Result<Setup, Failure> {
        let mut definitions = self.definitions.clone();
        if definitions.is_empty() {
            definitions = definitions_beside(program);
            if !definitions.is_empty() {
                let names: Vec<_> = definitions.iter().map(|path| format!("`{}`", path.display())).collect();
                let note = format!("global user variables are taken from {}", names.join(", "));
                show([&Diagnostic::note("C0006", note).help("name other definition files with --gud")]);
            }
        }
        let open = |path: &PathBuf| ProgramSource::from_file(path).map_err(Failure::unreadable);
        let mut setup = Setup {
            directories: self.include.clone(),
            shipped: SHIPPED_PROGRAMS,
            definitions: definitions.iter().map(open).collect::<Result<_, _>>()?,
            spindle_override_ratio: ratio_from_percent(self.spindle_override),
            skip_levels: self.skip.iter().fold(0, |levels, level| levels | 1 << level),
            ..Setup::from(open_program(program)?)
        };
        for path in self.workshop_files() {
            setup.add_workshop(load_workshop(path, machine).map_err(refused)?, machine);
        }
        Ok(setup)
    }

    /// Files of tools and zero offsets.
    pub(super) fn workshop_files(&self) -> impl Iterator<Item = &Path> {
        self.tools.iter().chain(&self.offsets).map(PathBuf::as_path)
    }
}

/// Definition files beside a program, as the control names them, in the order in which it reads them: SGUD.DEF, MGUD.DEF, UGUD.DEF,
/// GUD4.DEF to GUD9.DEF, also as _N_SGUD_DEF and so on.
fn definitions_beside(program: &Path) -> Vec<PathBuf> {
    let folder = match program.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut found: Vec<_> =
        entries.flatten().filter_map(|entry| Some((definition_rank(&entry.path())?, entry.path()))).collect();
    found.sort();
    found.into_iter().map(|(_, path)| path).collect()
}

/// Place in the order of definition files; `None` for any other file.
fn definition_rank(path: &Path) -> Option<usize> {
    let name = path.file_name()?.to_str()?.to_ascii_uppercase();
    let bare = match name.strip_suffix(".DEF") {
        Some(bare) => bare.strip_prefix("_N_").unwrap_or(bare),
        None => name.strip_prefix("_N_")?.strip_suffix("_DEF")?,
    };
    ["SGUD", "MGUD", "UGUD", "GUD4", "GUD5", "GUD6", "GUD7", "GUD8", "GUD9"].iter().position(|known| *known == bare)
}

/// A machine that is not there.
pub(super) fn refused(error: LoadError) -> Failure {
    match error {
        LoadError::Unreadable(finding) => Failure::unreadable(finding),
        // A bad --set is a fault of the command line, not of the machine file.
        LoadError::Invalid(findings) if findings.iter().all(|finding| finding.code == "M0010") => {
            Failure::wrong_usage(findings)
        }
        LoadError::Invalid(findings) => Failure::found_wrong(findings),
    }
}

/// The shipped programs; inside the binary, so that an installed `sollwert` works in an empty folder.
pub(super) const SHIPPED_PROGRAMS: &[(&str, &str)] = &[
    ("circle.mpf", include_str!("../../programs/circle.mpf")),
    ("corners.mpf", include_str!("../../programs/corners.mpf")),
    ("pocket.mpf", include_str!("../../programs/pocket.mpf")),
    ("spline.mpf", include_str!("../../programs/spline.mpf")),
    ("tapping.mpf", include_str!("../../programs/tapping.mpf")),
    ("thread.mpf", include_str!("../../programs/thread.mpf")),
];

/// Opens a program, or a shipped one by its name where no file of that name exists.
pub(super) fn open_program(path: &Path) -> Result<ProgramSource, Failure> {
    if !path.exists()
        && let Some((name, text)) = SHIPPED_PROGRAMS
            .iter()
            .find(|(name, _)| Path::new(name) == path || path == Path::new(name).with_extension(""))
    {
        return Ok(ProgramSource::from_bytes(name, text.as_bytes()));
    }
    ProgramSource::from_file(path).map_err(Failure::unreadable)
}

/// An output must not be an input: opening it would destroy what is to be read.
pub(super) fn refuse_same_file<'a>(inputs: impl IntoIterator<Item = &'a Path>, output: &Path) -> Result<(), Failure> {
    if inputs.into_iter().any(|input| is_same_file(input, output)) {
        let finding = Diagnostic::error("C0001", format!("`{}` is both input and output", output.display()));
        return Err(Failure::unreadable(finding.help("give another name to -o")));
    }
    Ok(())
}

/// Two names of one file: the same path, a link, or a second hard link.
fn is_same_file(one: &Path, other: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        if let (Ok(one), Ok(other)) = (one.metadata(), other.metadata()) {
            return (one.dev(), one.ino()) == (other.dev(), other.ino());
        }
    }
    match (one.canonicalize(), other.canonicalize()) {
        (Ok(one), Ok(other)) => one == other,
        _ => one == other,
    }
}

/// `x.mpf` -> `x.mcap` in the current folder.
pub(super) fn default_recording(program: &Path) -> PathBuf {
    PathBuf::from(program.file_name().unwrap_or_else(|| "trace".as_ref())).with_extension("mcap")
}
