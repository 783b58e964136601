//! What each datum costs: the time that a program would save if it were 10 % larger.
//!
//! In: a program, a machine. Out: [`WhatIf`]: data of the machine (and the programmed feed) with the time that each would save, and the lines
//! where it holds the motion back. The program is planned once; what holds in each move says which data matter where (`datum`). For each of these only
//! the stretches around those moves (`places`) are planned again, from rest to rest, once as they are and once with the datum raised. Of a program
//! in which a datum binds in many places some are planned, evenly spread, and the saving is that of all in proportion to the time for which it binds.
//!
//! The path is that of the program as it ran: what a program does depending on its own time ($AC_TIME) does not change. Does not print.

mod datum;
mod places;

use super::preparation::{PieceSource, Preparation};
use crate::feed::{Phase, PlannedPiece, Planner};
use crate::interpreter::{Event, Move, MoveKind, Setup};
use crate::kinematics::Kinematics;
use crate::machine::Machine;
use crate::smoothing::{ContourPiece, Smoother};
use datum::{Datum, behind, beside};
use places::{Stretch, Timing};

/// Moves that are kept, some hundred bytes each.
const MOVES_MAX: usize = 3_000_000;

/// Moves that are planned again for one datum, at most; above this some stretches stand for all.
const SAMPLE_MOVES_MAX: usize = 20_000;

/// A datum that binds for a smaller share of the time is left out.
const BINDS_SHARE_MIN: f64 = 1e-4;

/// Lines that are named for one datum.
const LINES_MAX: usize = 10_000;

/// The data of a program, the one that saves most first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WhatIf {
    /// Every datum that holds the motion back somewhere.
    pub savings: Vec<Saving>,
    /// Moves of the program.
    pub moves: usize,
    /// Moves planned again, all stretches of all data together.
    pub moves_planned_again: usize,
    /// The program has more moves than are looked at: these are the first ones.
    pub cut_short: bool,
}

/// What one datum costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Saving {
    /// Key of the machine file; `F`: the programmed feed.
    pub key: String,
    /// Machine data of the control, empty without one.
    pub machine_data: String,
    /// In words.
    pub words: String,
    /// By how much it is raised.
    pub change_percent: f64,
    /// Time saved.
    pub saves_s: f64,
    /// Time for which it holds the motion back.
    pub binds_s: f64,
    /// Lines of the main program in which it does, each with the time; in order.
    pub lines: Vec<(u32, f64)>,
}

/// Where a datum binds.
#[derive(Clone, Debug)]
struct Binding {
    datum: Datum,
    /// Moves in order, with the time; 0 where the datum matters and is not the limit that holds.
    moves: Vec<(usize, f64)>,
}

/// A program that has been planned once.
struct Run<'a> {
    machine: &'a Machine,
    moves: Vec<Move>,
    timing: Timing,
    bindings: Vec<Binding>,
    cut_short: bool,
    planned_again: usize,
    /// The move with which the spindle was told another speed last.
    commanded: Option<usize>,
}

/// Ranks the data of `machine` for a program. `progress` hears how many of how many data are done.
pub fn what_if(setup: Setup, machine: &Machine, progress: &mut dyn FnMut(usize, usize)) -> WhatIf {
    let mut run = Run::new(setup, machine);
    let total_s = run.timing.starts_s.last().copied().unwrap_or(0.0);
    let bindings = std::mem::take(&mut run.bindings);
    let mut savings = Vec::new();
    for (done, binding) in bindings.iter().enumerate() {
        progress(done, bindings.len());
        if binding.binds_s() >= BINDS_SHARE_MIN * total_s {
            savings.push(run.saving(binding));
        }
    }
    savings.sort_by(|a, b| b.saves_s.total_cmp(&a.saves_s));
    WhatIf { savings, moves: run.moves.len(), moves_planned_again: run.planned_again, cut_short: run.cut_short }
}

impl Binding {
    fn binds_s(&self) -> f64 {
        self.moves.iter().map(|(_, time_s)| time_s).sum()
    }
}

impl<'a> Run<'a> {
    /// Plans the whole program.
    fn new(setup: Setup, machine: &'a Machine) -> Self {
        let mut preparation = Preparation::new(setup, machine).keeping_moves();
        let mut run = Self {
            machine,
            moves: Vec::new(),
            timing: Timing::default(),
            bindings: Vec::new(),
            cut_short: false,
            planned_again: 0,
            commanded: None,
        };
        let mut times_s: Vec<f64> = Vec::new();
        let mut at = 0;
        while let Some(piece) = preparation.next_piece() {
            run.moves.extend(preparation.take_moves());
            if run.moves.len() > MOVES_MAX {
                run.cut_short = true;
                break;
            }
            let contour = &piece.path.contour;
            // Pieces come in the order of their moves.
            while at + 1 < run.moves.len() && run.moves[at].block.number < contour.block.number {
                at += 1;
            }
            times_s.resize(times_s.len().max(at + 1), 0.0);
            run.timing.rests_after.resize(times_s.len(), false);
            if contour.curve().is_none() {
                run.stand(&piece, at);
                continue;
            }
            times_s[at] += piece.law.duration_s();
            run.timing.rests_after[at] |= contour.stop_at_end;
            if contour.events.iter().any(commands_spindle) {
                run.commanded = Some(at);
            }
            for datum in beside(machine, &piece) {
                bind(&mut run.bindings, datum, at, 0.0);
            }
            // What a junction costs is the way up from it; the way down to it is as long.
            let faster = |phase: &&Phase| phase.at(phase.duration_s).velocity_lu_s > phase.velocity_lu_s;
            let rise_s: f64 = piece.law.phases().iter().take_while(faster).map(|phase| phase.duration_s).sum();
            for datum in piece.junction.into_iter().flat_map(|limit| behind(machine, &piece, limit)) {
                bind(&mut run.bindings, datum, at, rise_s);
            }
            for phase in piece.law.phases() {
                for datum in behind(machine, &piece, phase.limit) {
                    bind(&mut run.bindings, datum, at, phase.duration_s);
                }
            }
        }
        run.moves.extend(preparation.take_moves());
        times_s.resize(run.moves.len(), 0.0);
        run.timing.rests_after.resize(run.moves.len(), false);
        run.timing.starts_s = std::iter::once(0.0)
            .chain(times_s.iter().scan(0.0, |sum_s, time_s| {
                *sum_s += time_s;
                Some(*sum_s)
            }))
            .collect();
        run
    }

    /// The path stands: no datum of an axis makes that shorter, and it is no part of the time that is compared.
    fn stand(&mut self, piece: &PlannedPiece, at: usize) {
        if piece.law.duration_s() <= 0.0 {
            return;
        }
        let moves = !matches!(self.moves[at].kind, MoveKind::Function { .. } | MoveKind::Dwell { .. });
        if !moves {
            self.timing.rests_after[at] = true;
            return;
        }
        // A feed that waits for its spindle waits before its move: what is saved since the spindle was told is waited for here.
        if let Some(before) = at.checked_sub(1) {
            self.timing.rests_after[before] = true;
        }
        let commanded = self.commanded.take().unwrap_or(at);
        for binding in &mut self.bindings {
            binding.moves.retain(|(index, _)| *index < commanded || *index >= at);
        }
    }

    fn saving(&mut self, binding: &Binding) -> Saving {
        let Binding { datum, moves } = binding;
        let (raised, change_percent) = datum.raised(self.machine);
        let indices: Vec<usize> = moves.iter().map(|(index, _)| *index).collect();
        let stretches = self.timing.stretches(&indices);
        let planned: usize = stretches.iter().map(|stretch| stretch.planned[1] + 1 - stretch.planned[0]).sum();
        let every = planned.div_ceil(SAMPLE_MOVES_MAX).max(1);
        let (mut saves_s, mut sampled_s) = (0.0, 0.0);
        for stretch in stretches.iter().step_by(every) {
            let bound = |(index, _): &&(usize, f64)| (stretch.counted[0]..=stretch.counted[1]).contains(index);
            sampled_s += moves.iter().filter(bound).map(|(_, time_s)| time_s).sum::<f64>();
            // A motion that is refused with the datum raised says nothing about its time.
            if let (Some(before_s), Some(after_s)) = (self.before_s(*stretch), self.time_s(*stretch, &raised, *datum)) {
                saves_s += before_s - after_s;
            }
        }
        if every > 1 && sampled_s > 0.0 {
            saves_s *= binding.binds_s() / sampled_s;
        }
        Saving {
            key: datum.key(self.machine),
            machine_data: datum.machine_data(self.machine).to_owned(),
            words: datum.words(self.machine),
            change_percent,
            saves_s,
            binds_s: binding.binds_s(),
            lines: self.lines(moves),
        }
    }

    /// Time of what is counted, as it is.
    fn before_s(&mut self, stretch: Stretch) -> Option<f64> {
        let [first, last] = stretch.planned;
        let starts_s = &self.timing.starts_s;
        let whole = (first == 0 || self.timing.rests_after[first - 1])
            && (last + 1 == self.moves.len() || self.timing.rests_after[last]);
        if whole {
            return Some(starts_s[stretch.counted[1] + 1] - starts_s[stretch.counted[0]]);
        }
        // Of a piece cut out of a motion both plans begin at the same false rest.
        self.time_s(stretch, self.machine, Datum::LookAhead)
    }

    /// Time of what is counted of a stretch, with its moves as `datum` makes them, planned from rest to rest on `machine`.
    fn time_s(&mut self, stretch: Stretch, machine: &Machine, datum: Datum) -> Option<f64> {
        let [first, last] = stretch.planned;
        self.planned_again += last + 1 - first;
        let counted = stretch.counted.map(|index| self.moves[index].block.number);
        let mut smoother = Smoother::new(machine);
        let kinematics = Kinematics::new(machine);
        let mut planner = Planner::new(machine);
        let mut refused = false;
        let mut time_s = 0.0;
        if let Some(before) = first.checked_sub(1).and_then(|index| self.moves.get(index)) {
            // Stands where the stretch begins.
            let kind = MoveKind::Function { stops: true };
            let start = Move { kind, events: Vec::new(), corner: None, ..before.clone() };
            smoother.push(start, &mut |piece| refused |= planner.push(kinematics.to_joint(piece)).is_err());
        }
        let take = |planner: &mut Planner, time_s: &mut f64| {
            while let Some(piece) = planner.pop() {
                let contour = &piece.path.contour;
                if contour.curve().is_some() && (counted[0]..=counted[1]).contains(&contour.block.number) {
                    *time_s += piece.law.duration_s();
                }
            }
        };
        for next in &self.moves[first..=last] {
            let next = datum.applied(next.clone());
            let mut plan = |piece: ContourPiece| refused |= planner.push(kinematics.to_joint(piece)).is_err();
            smoother.push(next, &mut plan);
            take(&mut planner, &mut time_s);
        }
        smoother.finish(&mut |piece| refused |= planner.push(kinematics.to_joint(piece)).is_err());
        planner.finish();
        take(&mut planner, &mut time_s);
        (!refused).then_some(time_s)
    }

    /// Lines of the main program.
    fn lines(&self, moves: &[(usize, f64)]) -> Vec<(u32, f64)> {
        let main = self.moves.first().map(|first| first.block.program);
        let mut lines: Vec<(u32, f64)> = Vec::new();
        let mut all: Vec<(u32, f64)> = moves
            .iter()
            .filter(|(index, time_s)| *time_s > 0.0 && Some(self.moves[*index].block.program) == main)
            .map(|(index, time_s)| (self.moves[*index].block.line, *time_s))
            .collect();
        all.sort_by_key(|entry| entry.0);
        for (line, time_s) in all {
            match lines.last_mut() {
                Some((last, sum_s)) if *last == line => *sum_s += time_s,
                _ => lines.push((line, time_s)),
            }
        }
        lines.truncate(LINES_MAX);
        lines
    }
}

fn commands_spindle(event: &Event) -> bool {
    matches!(event, Event::SpindleSpeed { .. } | Event::MFunction(3 | 4))
}

fn bind(bindings: &mut Vec<Binding>, datum: Datum, index: usize, time_s: f64) {
    let at = bindings.iter().position(|binding| binding.datum == datum).unwrap_or_else(|| {
        bindings.push(Binding { datum, moves: Vec::new() });
        bindings.len() - 1
    });
    match bindings[at].moves.last_mut() {
        Some((last, sum_s)) if *last == index => *sum_s += time_s,
        _ => bindings[at].moves.push((index, time_s)),
    }
}
