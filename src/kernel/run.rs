//! The loop around the kernel: threads, recording, pace, progress.
//!
//! In: [`RunOptions`]. Out: [`RunOutcome`]; the recording on the disk. Stages, joined by bounded channels: reading | preparation | cycle |
//! recorder. `threads` = 1 runs reading and preparation inside the cycle; the result is the same to the byte. Does not print.

use super::cycle::{Kernel, Status};
use super::preparation::{PieceSource, Preparation};
use super::record::{record_alarm, record_braking, record_cycle};
use super::summary::{RunSummary, drive_warnings};
use super::threads::{PreparationThread, ReadingThread};
use crate::base::diagnostics::Place;
use crate::base::{Diagnostic, Tick};
use crate::feed::OverrideSchedule;
use crate::interpreter::Setup;
use crate::machine::{Loaded, Machine, TimeLawKind, unsupported};
use crate::program::{BlockRef, ProgramId};
use crate::recorder::{Recorder, RecordingSetup, RecordingSummary, SignalChoice};
use crate::smoothing::OpenedPrograms;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What to run.
pub struct RunOptions<'a> {
    /// The machine, as loaded.
    pub machine: &'a Loaded,
    /// The main program, and what lies around it.
    pub setup: Setup,
    /// Changes of the feed override at run time.
    pub overrides: OverrideSchedule,
    /// Simulate the drives; otherwise every axis is ideal.
    pub drives: bool,
    /// Where to record; `None`: figures only.
    pub recording: Option<&'a Path>,
    /// Mantissa bits to keep in the recording; `None`: all.
    pub mantissa_bits: Option<u8>,
    /// Signals to record.
    pub signals: SignalChoice,
    /// 1: preparation in the cycle's thread; 2: in one of its own; more: the reading of the program in another one.
    pub threads: usize,
    /// Simulated seconds per second of the wall clock; `None`: as fast as possible.
    pub pace_ratio: Option<f64>,
}

/// Where a run stands, for a person who waits.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Simulated time.
    pub time_s: f64,
    /// Line of the main program or of a sub-program.
    pub line: u32,
    /// Blocks executed.
    pub blocks: u64,
}

/// What came of it.
pub struct RunOutcome {
    /// Figures at the border, warnings and alarm included.
    pub summary: RunSummary,
    /// Warnings in order.
    pub warnings: Vec<Diagnostic>,
    /// What ended the program early.
    pub alarm: Option<Diagnostic>,
    /// Cycles that began late under `pace_ratio`, and how late the latest was.
    pub deadlines: Option<Deadlines>,
    /// The recording.
    pub recording: Option<RecordingSummary>,
}

/// Real-time behaviour of a paced run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deadlines {
    /// Cycles that began later than one t_s after their time.
    pub missed: u64,
    /// Latest start.
    pub latest_s: f64,
}

/// A run that could not be made.
#[derive(Debug)]
pub struct RunError(pub Diagnostic);

/// Runs `options.setup` to its end. Errors: the machine asks for what is not built yet ([`unsupported`]), no thread is to be had, the
/// recording cannot be written.
pub fn run(options: RunOptions<'_>, progress: &mut dyn FnMut(Progress)) -> Result<RunOutcome, RunError> {
    if let Some(refused) = unsupported(&options.machine.machine).into_iter().next() {
        return Err(RunError(refused));
    }
    let machine = Arc::new(options.machine.machine.clone());
    tracing::info!(program = options.setup.program.file_name(), machine = %machine.name, threads = options.threads, drives = options.drives, "run starts");
    if !options.overrides.changes().is_empty() && machine.feed.time_law == TimeLawKind::SevenPhase {
        return Err(RunError(override_refused()));
    }
    let preparation = Preparation::new(options.setup.clone(), &machine)
        .with_overrides(&options.overrides)
        .waiting_in_position(options.drives);
    let preparation = if options.recording.is_some() { preparation.telling_programmed() } else { preparation };
    if options.threads > 1 {
        let spawned = if options.threads > 2 {
            preparation.reading_from(ReadingThread::spawn).and_then(PreparationThread::spawn)
        } else {
            PreparationThread::spawn(preparation)
        };
        let source = spawned
            .map_err(|error| RunError(Diagnostic::error("K0001", format!("no thread for preparation: {error}"))))?;
        let kernel = Kernel::with_source(machine, source, options.drives).asked_for(&options.signals);
        drive_loop(kernel, options, progress)
    } else {
        let kernel = Kernel::with_source(machine, preparation, options.drives).asked_for(&options.signals);
        drive_loop(kernel, options, progress)
    }
}

/// A law that begins and ends every piece without acceleration cannot change the feed inside one.
fn override_refused() -> Diagnostic {
    let message =
        "--override needs the time law `continuous`: under `seven-phase` the feed cannot change inside a block";
    Diagnostic::error("K0008", message).help("leave --override out, or run with --set feed.time_law=continuous")
}

fn drive_loop<S: PieceSource>(
    mut kernel: Kernel<S>,
    options: RunOptions<'_>,
    progress: &mut dyn FnMut(Progress),
) -> Result<RunOutcome, RunError> {
    let machine = kernel.machine().clone();
    let mut recorder = open_recorder(&options, &machine)?;
    if recorder.is_none() {
        kernel = kernel.without_poses();
    }
    let mut pacer = options.pace_ratio.map(|ratio| Pacer::new(ratio, &machine));
    let (mut drive_alarm, mut opened) = (None, OpenedPrograms::default());
    while drive_alarm.is_none() {
        let cycled = kernel.cycle();
        kernel.output().begun.iter().for_each(|begun| opened.watch(&begun.events));
        match cycled {
            Ok(Status::Running) => {}
            Ok(Status::Finished) => break,
            // What the cycle gave up to the alarm is recorded all the same.
            Err(alarm) => {
                let block = kernel.output().setpoint.map(|setpoint| setpoint.path.block);
                drive_alarm = Some(placed(alarm, &opened, block));
            }
        }
        if let Some(pacer) = &mut pacer {
            pacer.wait();
        }
        let output = kernel.output();
        if let Some(recorder) = &mut recorder {
            record_cycle(recorder, &machine, output).map_err(RunError)?;
        }
        if let Some(setpoint) =
            output.setpoint.as_ref().filter(|setpoint| setpoint.tick.0.is_multiple_of(PROGRESS_TICKS))
        {
            progress(Progress {
                time_s: machine.cycle.time_base.time_s(setpoint.tick),
                line: setpoint.path.block.line,
                blocks: kernel.figures().blocks,
            });
        }
    }
    if let (Some(alarm), Some(recorder)) = (&drive_alarm, &mut recorder) {
        record_stop(&mut kernel, alarm, recorder)?;
    }
    conclude(kernel, &options, drive_alarm, recorder, pacer.map(|pacer| pacer.deadlines))
}

/// The alarm of a drive at its line, in the main program or in one that it has opened, whose name the message then tells.
fn placed(alarm: Diagnostic, opened: &OpenedPrograms, block: Option<BlockRef>) -> Diagnostic {
    let Some((block, place)) = block.and_then(|block| Some((block, opened.place(block)?))) else { return alarm };
    let message = match block.program {
        ProgramId(0) => alarm.message.clone(),
        _ => format!("{}, in the sub-program {}", alarm.message, place.file),
    };
    Diagnostic { message, ..alarm }.at(Place { label: String::new(), ..place })
}

/// The alarm of a drive, and how the axes brake after it.
fn record_stop<S: PieceSource>(
    kernel: &mut Kernel<S>,
    alarm: &Diagnostic,
    recorder: &mut Recorder,
) -> Result<(), RunError> {
    let tick = kernel.output().rows.last().map_or(Tick(0), |row| row.tick);
    record_alarm(recorder, tick, kernel.output().setpoint.map(|setpoint| setpoint.path.block), alarm);
    let Some(mut braking) = kernel.brake() else { return Ok(()) };
    loop {
        let goes_on = kernel.brake_on(&mut braking);
        record_braking(recorder, kernel.machine(), kernel.output()).map_err(RunError)?;
        if !goes_on {
            return Ok(());
        }
    }
}

/// Progress is offered at every multiple of this many ticks; the receiver decides how often it draws.
const PROGRESS_TICKS: u64 = 4096;

fn open_recorder(options: &RunOptions<'_>, machine: &Arc<Machine>) -> Result<Option<Recorder>, RunError> {
    let Some(path) = options.recording else { return Ok(None) };
    let main = options.setup.program.opened(ProgramId(0));
    let programs = std::slice::from_ref(&main);
    let mut setup = RecordingSetup::new(machine, &options.machine.name, &options.machine.text_as_used, programs);
    setup.mantissa_bits = options.mantissa_bits;
    setup.signals = options.signals;
    setup.decimation = options.signals.decimation();
    setup.programmed = true;
    Recorder::to_file(path, &setup).map(Some).map_err(RunError)
}

/// Findings, figures, and the end of the recording.
fn conclude<S: PieceSource>(
    mut kernel: Kernel<S>,
    options: &RunOptions<'_>,
    drive_alarm: Option<Diagnostic>,
    recorder: Option<Recorder>,
    deadlines: Option<Deadlines>,
) -> Result<RunOutcome, RunError> {
    let machine = kernel.machine().clone();
    let findings = kernel.take_findings();
    let mut warnings = options.machine.warnings.clone();
    warnings.extend(drive_warnings(&machine, options.drives));
    warnings.extend(findings.warnings);
    if kernel.figures().blocks == 0 && drive_alarm.is_none() && findings.alarm.is_none() {
        warnings.push(Diagnostic::warning("K0007", "the program moves no axis"));
    }
    if kernel.figures().exact_stops > 0 && !options.drives {
        let message = "an exact stop (G601, G602) ends when its set-point arrives: waiting until the axes are in position needs the drives, \
                       which are left out here; `sollwert run` waits";
        warnings.push(Diagnostic::warning("K0002", message));
    }
    let alarm_recorded = drive_alarm.is_some();
    let alarm = drive_alarm.or(findings.alarm);
    if let Some(alarm) = &alarm {
        tracing::error!(code = alarm.code, line = alarm.line(), message = %alarm.message, "alarm");
    }
    let mut summary = RunSummary::new(&machine, options.setup.program.file_name(), kernel.figures(), options.drives);
    summary.add_overrides(&options.overrides);
    summary.add_warnings(&warnings);
    if let Some(alarm) = &alarm {
        summary.set_alarm(alarm);
    }
    let recording = match recorder {
        None => None,
        Some(mut recorder) => {
            if let Some(alarm) = alarm.as_ref().filter(|_| !alarm_recorded) {
                let setpoint = machine.cycle.time_base.setpoint_tick(kernel.figures().setpoints);
                let tick = kernel.output().rows.last().map_or(setpoint, |row| row.tick.max(setpoint));
                record_alarm(&mut recorder, tick, None, alarm);
            }
            let document = serde_json::to_string(&summary)
                .map_err(|error| RunError(Diagnostic::error("K0003", format!("figures do not serialise: {error}"))))?;
            Some(recorder.finish(&document).map_err(RunError)?)
        }
    };
    tracing::info!(
        setpoints = summary.setpoints,
        cycle_time_s = summary.cycle_time_s,
        blocks = summary.blocks,
        "run ends"
    );
    Ok(RunOutcome { summary, warnings, alarm, deadlines, recording })
}

/// Holds the loop to the wall clock.
struct Pacer {
    start: Instant,
    cycle_s: f64,
    cycles: u64,
    deadlines: Deadlines,
}

impl Pacer {
    fn new(pace_ratio: f64, machine: &Machine) -> Self {
        let cycle_s = machine.cycle.time_base.setpoint_period_s() / pace_ratio;
        Self { start: Instant::now(), cycle_s, cycles: 0, deadlines: Deadlines::default() }
    }

    fn wait(&mut self) {
        let due_s = self.cycles as f64 * self.cycle_s;
        let late_s = self.start.elapsed().as_secs_f64() - due_s;
        if late_s < 0.0 {
            std::thread::sleep(Duration::from_secs_f64(-late_s));
        } else if late_s > self.cycle_s {
            self.deadlines.missed += 1;
        }
        self.deadlines.latest_s = self.deadlines.latest_s.max(late_s);
        self.cycles += 1;
    }
}
