//! Program to planned pieces: the stages that run ahead of the cycle, chained.
//!
//! In: a program and a machine. Out: [`PlannedPiece`]s in order, final. How far it is ahead of the cycle is counted in blocks by the
//! planner, never in time, so that threads change nothing. An alarm of the interpreter or of feed stops preparation; everything before
//! it is planned to rest and handed out first, as on the control.

use crate::base::Diagnostic;
use crate::base::diagnostics::Place;
use crate::feed::{PlannedPiece, Planner};
use crate::interpreter::Interpreter;
use crate::kinematics::Kinematics;
use crate::machine::Machine;
use crate::program::ProgramSource;
use crate::smoothing::{ContourPiece, Smoother};

/// Longest time of one block: the 11 days are beyond any program, and a recording of them is beyond any disk.
const BLOCK_TIME_MAX_S: f64 = 1e6;

/// Where the cycle gets its pieces from: preparation itself, or a channel to the thread it runs on.
pub trait PieceSource {
    /// The next piece in path order; `None` once the program has ended or an alarm has stopped it.
    fn next_piece(&mut self) -> Option<PlannedPiece>;

    /// What preparation had to say, complete once `next_piece` has returned `None`.
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
pub struct Preparation {
    interpreter: Interpreter,
    smoother: Smoother,
    kinematics: Kinematics,
    planner: Planner,
    program: ProgramSource,
    alarm: Option<Diagnostic>,
    finished: bool,
    /// A block was refused: nothing after it is handed out.
    refused: bool,
}

impl Preparation {
    /// At the start of `program`, axes at home.
    pub fn new(program: ProgramSource, machine: &Machine) -> Self {
        Self {
            interpreter: Interpreter::new(program.clone(), machine),
            smoother: Smoother::new(machine),
            kinematics: Kinematics::new(machine),
            planner: Planner::new(machine),
            program,
            alarm: None,
            finished: false,
            refused: false,
        }
    }

    /// Executes one more block of the program and plans what follows from it.
    fn extend(&mut self) {
        let moved = self.interpreter.next_move();
        let Self { smoother, kinematics, planner, .. } = self;
        let mut refused = None;
        let mut plan = |piece: ContourPiece| {
            // Nothing may follow a piece that was refused: the axes would jump over it.
            if refused.is_none() {
                let block = piece.block;
                refused = planner.push(kinematics.to_joint(piece)).err().map(|alarm| (block, alarm));
            }
        };
        match moved {
            Ok(Some(next)) => smoother.push(next, &mut plan),
            ended => {
                self.alarm = ended.err().map(|alarm| *alarm);
                self.finished = true;
                smoother.finish(&mut plan);
            }
        }
        if let Some((block, alarm)) = refused {
            // It stands before any alarm of the interpreter, which is ahead.
            self.alarm = Some(self.smoother.marked(*alarm, block));
            self.finished = true;
        }
        if self.finished {
            self.planner.finish();
        }
    }
}

impl Preparation {
    /// The alarm of a block that takes for ever: a feed of 1e-7 mm/min, a position of 1e15 mm, a slip in a dwell.
    fn too_long(&self, piece: &PlannedPiece) -> Diagnostic {
        let block = piece.path.contour.block;
        let message =
            format!("the block in line {} takes {:.3e} s, more than 11 days", block.line, piece.law.duration_s());
        let finding = Diagnostic::error("K0006", message)
            .help("check its feed, its end position and its dwell, and the velocity limits of the machine");
        // Sub-programs are not opened yet: every block is one of the main program.
        let mut cursor = self.program.first();
        while cursor.line < block.line
            && let Some((_, next)) = self.program.line_bytes(cursor)
        {
            cursor = next;
        }
        let line_text = self.program.line_text(cursor).into_owned();
        let (file, columns) = (self.program.shared_name(), 0..line_text.len());
        finding.at(Place { file, line: block.line, line_text, columns, label: "takes this long".to_owned() })
    }
}

impl PieceSource for Preparation {
    fn next_piece(&mut self) -> Option<PlannedPiece> {
        loop {
            if self.refused {
                return None;
            }
            if let Some(piece) = self.planner.pop() {
                if piece.law.duration_s() <= BLOCK_TIME_MAX_S {
                    return Some(piece);
                }
                self.refused = true;
                self.alarm = Some(self.too_long(&piece));
                return None;
            }
            if self.finished {
                return None;
            }
            self.extend();
        }
    }

    fn take_findings(&mut self) -> Findings {
        let mut warnings = self.interpreter.take_warnings();
        warnings.extend(self.smoother.take_warnings());
        Findings { warnings, alarm: self.alarm.take() }
    }
}
