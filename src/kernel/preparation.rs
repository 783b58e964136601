//! Program to planned pieces: the stages that run ahead of the cycle, chained.
//!
//! In: a program and a machine. Out: [`PlannedPiece`]s in order, final. How far it is ahead of the cycle is counted in blocks by the
//! planner, never in time, so that threads change nothing. An alarm of the interpreter or of feed stops preparation; everything before
//! it is planned to rest and handed out first, as on the control.

use super::reading::{Reader, Reading, Step};
use crate::base::{Diagnostic, TimeBase};
use crate::feed::{OverrideSchedule, PlannedPiece, Planner};
use crate::interpreter::{MainRun, Move, Setup};
use crate::kinematics::Kinematics;
use crate::machine::Machine;
use crate::smoothing::{ContourPiece, OpenedPrograms};

/// A path that ends this share of its time after a set-point ends on it, as for the interpolator.
const SAME_TIME_RATIO: f64 = 1e-9;

/// Where the cycle gets its pieces from: preparation itself, or a channel to the thread it runs on.
pub trait PieceSource {
    /// The next piece in path order; `None` once the program has ended or an alarm has stopped it.
    fn next_piece(&mut self) -> Option<PlannedPiece>;

    /// How long block ends have waited for the axes so far; told before the piece after such an end is asked for.
    fn waited(&mut self, waited_s: f64) {
        let _ = waited_s;
    }

    /// What preparation had to say on the way to the pieces handed out; complete once `next_piece` has returned `None`.
    fn take_findings(&mut self) -> Findings;
}

/// Warnings and the alarm of preparation.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// In order of appearance.
    pub warnings: Vec<Diagnostic>,
    /// What stopped the program, if anything did.
    pub alarm: Option<Diagnostic>,
}

/// Interpreter, smoothing, kinematics and feed in a row.
#[derive(Clone)]
pub struct Preparation<R = Reading> {
    reader: R,
    opened: OpenedPrograms,
    kinematics: Kinematics,
    planner: Planner,
    warnings: Vec<Diagnostic>,
    alarm: Option<Diagnostic>,
    finished: bool,
    time_base: TimeBase,
    /// An axis of the machine has a drive.
    machine_drives: bool,
    /// The interpreter waits for the time at which the path rests.
    stopped: bool,
    /// Time of all waits for the axes, as told.
    waited_s: f64,
}

impl Preparation {
    /// At the start of `program`, axes at home.
    pub fn new(program: impl Into<Setup>, machine: &Machine) -> Self {
        Self {
            reader: Reading::new(program, machine),
            opened: OpenedPrograms::default(),
            kinematics: Kinematics::new(machine),
            planner: Planner::new(machine),
            warnings: Vec::new(),
            alarm: None,
            finished: false,
            time_base: machine.cycle.time_base,
            machine_drives: machine.axes.iter().any(|axis| axis.drive.is_some()),
            stopped: false,
            waited_s: 0.0,
        }
    }

    /// With an `Event::Programmed` for every motion block: what the program asks of the path, for a recording.
    pub fn telling_programmed(self) -> Self {
        Self { reader: self.reader.telling_programmed(), ..self }
    }

    /// Keeps the moves, for those who want to plan them again.
    pub(super) fn keeping_moves(self) -> Self {
        Self { reader: self.reader.keeping_moves(), ..self }
    }

    /// The moves since the last call.
    pub(super) fn take_moves(&mut self) -> Vec<Move> {
        self.reader.take_moves()
    }

    /// The same, with the contour from somewhere else that `elsewhere` takes the reader to.
    pub(super) fn reading_from<R, E>(
        self,
        elsewhere: impl FnOnce(Reading) -> Result<R, E>,
    ) -> Result<Preparation<R>, E> {
        let Self { reader, opened, kinematics, planner, warnings, alarm, finished, .. } = self;
        let Self { time_base, machine_drives, stopped, waited_s, .. } = self;
        let reader = elsewhere(reader)?;
        Ok(Preparation {
            reader,
            opened,
            kinematics,
            planner,
            warnings,
            alarm,
            finished,
            time_base,
            machine_drives,
            stopped,
            waited_s,
        })
    }
}

impl<R: Reader> Preparation<R> {
    /// With changes of the feed override at run time.
    pub fn with_overrides(self, schedule: &OverrideSchedule) -> Self {
        Self { planner: self.planner.with_overrides(schedule), ..self }
    }

    /// With drives: block ends wait for the axes, and [`PieceSource::waited`] tells how long.
    pub fn waiting_in_position(self, drives: bool) -> Self {
        let driven = drives && self.machine_drives;
        Self { planner: self.planner.waiting_in_position(driven), ..self }
    }

    /// Executes one more block of the program and plans what follows from it.
    fn extend(&mut self) {
        let Self { reader, opened, kinematics, planner, .. } = self;
        let mut refused = None;
        let mut plan = |piece: ContourPiece| {
            // Nothing may follow a piece that was refused: the axes would jump over it.
            if refused.is_none() {
                opened.watch(&piece.events);
                let block = piece.block;
                refused = planner.push(kinematics.to_joint(piece)).err().map(|alarm| (block, alarm));
            }
        };
        let Step { warnings, alarm, ends, stops } = reader.step(&mut plan);
        (self.alarm, self.finished, self.stopped) = (alarm, ends, stops);
        if let Some((block, alarm)) = refused {
            // It stands before any alarm of the interpreter, which is ahead.
            self.alarm = Some(self.opened.marked(*alarm, block));
            self.finished = true;
        }
        self.warnings.extend(warnings);
        if self.finished {
            self.planner.finish();
        }
    }

    /// Where the path rests that has been handed out: at the first set-point at or after its end. Counted from planned durations and
    /// from the waits that the cycle has told, which the planner adds, so that it does not depend on how far the cycle is.
    fn main_run(&self) -> MainRun {
        let (elapsed_s, cutting_time_s) = self.planner.elapsed_s();
        let period_s = self.time_base.setpoint_period_s();
        let k = (elapsed_s / period_s * (1.0 - SAME_TIME_RATIO)).ceil().max(0.0) as u64;
        MainRun { time_s: self.time_base.time_s(self.time_base.setpoint_tick(k)), cutting_time_s }
    }

    /// Warnings since the last call, in the order in which blocks gave rise to them.
    pub(super) fn take_warnings(&mut self) -> Vec<Diagnostic> {
        std::mem::take(&mut self.warnings)
    }

    /// The next piece; `None` at the end, and where preparation waits to be told how long block ends have waited ([`Preparation::stopped`]).
    pub(super) fn piece_ahead(&mut self) -> Option<PlannedPiece> {
        loop {
            if let Some(piece) = self.planner.pop() {
                if let Some((block, alarm)) = self.planner.take_alarm() {
                    self.alarm = Some(self.opened.marked(alarm, block));
                    self.finished = true;
                    self.planner.finish();
                }
                return Some(piece);
            }
            if self.planner.awaits() {
                return None;
            }
            if self.finished {
                while let Some((block, warning)) = self.planner.take_warning() {
                    self.warnings.push(self.opened.marked(warning, block));
                }
                return None;
            }
            if self.stopped {
                return None;
            }
            self.extend();
        }
    }

    /// Preparation waits to be told how long block ends have waited: all pieces up to there have been handed out.
    pub(super) fn stopped(&self) -> bool {
        self.planner.awaits() || (self.stopped && !self.finished)
    }

    /// Goes on. What has been waited by now must be known.
    pub(super) fn go_on(&mut self) {
        if self.planner.awaits() {
            return self.planner.tell_waited(self.waited_s);
        }
        self.stopped = false;
        self.reader.tell_main_run(self.main_run());
    }
}

impl<R: Reader> PieceSource for Preparation<R> {
    fn next_piece(&mut self) -> Option<PlannedPiece> {
        loop {
            match self.piece_ahead() {
                None if self.stopped() => self.go_on(),
                next => return next,
            }
        }
    }

    fn waited(&mut self, waited_s: f64) {
        self.waited_s = waited_s;
    }

    fn take_findings(&mut self) -> Findings {
        Findings { warnings: self.take_warnings(), alarm: self.alarm.take() }
    }
}
