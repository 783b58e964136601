//! Program to contour: interpreter and smoothing, a block at a time.
//!
//! In: a program and a machine. Out: [`ContourPiece`]s in order, and what each block had to say. Does not know speed.

use crate::base::Diagnostic;
use crate::interpreter::{Interpreter, MainRun, Move, MoveKind, Setup};
use crate::machine::Machine;
use crate::smoothing::{ContourPiece, Smoother};

/// Where preparation gets the contour from: the interpreter itself, or a channel to the thread it runs on.
pub trait Reader {
    /// Executes one more block of the program; hands over the pieces that it decides.
    fn step(&mut self, piece: &mut impl FnMut(ContourPiece)) -> Step;

    /// Tells what the main run is at, after a step that stops.
    fn tell_main_run(&mut self, main_run: MainRun);
}

/// What a block had to say besides its pieces.
#[derive(Debug, Default)]
pub struct Step {
    pub warnings: Vec<Diagnostic>,
    pub alarm: Option<Diagnostic>,
    /// The program has ended: with its end, or with the alarm.
    pub ends: bool,
    /// The interpreter waits for the time at which the path rests.
    pub stops: bool,
}

impl Step {
    /// It has nothing to say.
    pub fn is_plain(&self) -> bool {
        self.warnings.is_empty() && self.alarm.is_none() && !self.ends && !self.stops
    }
}

/// Interpreter and smoothing in a row.
#[derive(Clone)]
pub struct Reading {
    interpreter: Interpreter,
    smoother: Smoother,
    /// What the interpreter made of the program since the last call of `take_moves`; `None`: not kept.
    moves: Option<Vec<Move>>,
}

impl Reading {
    /// At the start of `program`, axes at home.
    pub fn new(program: impl Into<Setup>, machine: &Machine) -> Self {
        Self { interpreter: Interpreter::new(program, machine), smoother: Smoother::new(machine), moves: None }
    }

    /// With an `Event::Programmed` for every motion block.
    pub fn telling_programmed(self) -> Self {
        Self { smoother: self.smoother.telling_programmed(), ..self }
    }

    /// Keeps the moves.
    pub fn keeping_moves(self) -> Self {
        Self { moves: Some(Vec::new()), ..self }
    }

    /// The moves since the last call.
    pub fn take_moves(&mut self) -> Vec<Move> {
        self.moves.as_mut().map(std::mem::take).unwrap_or_default()
    }
}

impl Reader for Reading {
    fn step(&mut self, piece: &mut impl FnMut(ContourPiece)) -> Step {
        let moved = self.interpreter.next_move();
        let stops = matches!(&moved, Ok(Some(next)) if next.kind == MoveKind::StopPreparation);
        if let (Some(moves), Ok(Some(next))) = (&mut self.moves, &moved) {
            moves.push(next.clone());
        }
        let mut step = Step { stops, ..Step::default() };
        match moved {
            Ok(Some(next)) => self.smoother.push(next, piece),
            ended => {
                step.alarm = ended.err().map(|alarm| *alarm);
                step.ends = true;
                self.smoother.finish(piece);
            }
        }
        step.warnings = self.interpreter.take_warnings();
        step.warnings.extend(self.smoother.take_warnings());
        step
    }

    fn tell_main_run(&mut self, main_run: MainRun) {
        self.interpreter.tell_main_run(main_run);
    }
}
