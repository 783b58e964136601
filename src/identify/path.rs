//! The path of a program without its time: how far the set-points of a trace lie beside it.
//!
//! In: set-points of a trace, the moves of its program, a machine. Out: the sideways distance of each set-point from the planned curve itself.
//! Nothing is planned in time, and no set-points are laid a straight line or a cubic through: that would cut bends by as much as shapes of corners
//! differ, and by another amount at another feed. Does not know speed.

use super::profile::CELLS;
use crate::base::AxisId;
use crate::interpreter::{Event, Interpreter, MainRun, Move, MoveKind, Setup};
use crate::kinematics::{JointPath, Kinematics};
use crate::machine::Machine;
use crate::smoothing::Smoother;

/// Set-points that are held against the path, at most: so many a stretch.
const POINTS_A_CELL: f64 = 4.0;
/// Steps of the search for the foot of a set-point on the path.
const FOOT_STEPS: usize = 3;
/// Moves of a program at most.
const MOVES_MAX: usize = 5_000_000;
/// Paths whose lengths differ by more than this share are not the same.
const LENGTH_SHARE: f64 = 0.03;
/// Below it an axis does not move, mm for each mm of path.
const STILL: f64 = 1e-9;

/// Set-points of a trace, and what the interpreter made of its program.
pub(super) struct PathOfTrace {
    points: Vec<Vec<f64>>,
    /// Way along the trace to each of them, and its share of the whole.
    ways_mm: Vec<f64>,
    shares: Vec<f64>,
    axes: Vec<AxisId>,
    moves: Vec<Move>,
}

impl PathOfTrace {
    /// `None` where the program has another path here than on the trace: its moves depend on time, or it ends in an alarm.
    pub(super) fn new(rows: &[Vec<f64>], setup: &Setup, machine: &Machine, axes: &[AxisId]) -> Option<Self> {
        let mut way_mm = 0.0;
        let mut ways = vec![0.0];
        for pair in rows.windows(2) {
            way_mm += distance(&pair[0], &pair[1]);
            ways.push(way_mm);
        }
        let step_mm = way_mm / (POINTS_A_CELL * CELLS as f64);
        let (mut points, mut ways_mm) = (Vec::new(), Vec::new());
        for (row, way) in rows.iter().zip(ways) {
            if ways_mm.last().is_none_or(|last| way - last > step_mm) {
                points.push(row.clone());
                ways_mm.push(way);
            }
        }
        let shares = (0..points.len()).map(|k| {
            let before = k.checked_sub(1).map_or(0.0, |k| ways_mm[k]);
            (ways_mm[k] - before) / way_mm
        });
        let shares = shares.collect();
        let moves = moves(setup, machine)?;
        let of = Self { points, ways_mm, shares, axes: axes.to_vec(), moves };
        let length_mm = of.path(machine).length_mm;
        ((length_mm / way_mm - 1.0).abs() < LENGTH_SHARE).then_some(of)
    }

    fn path(&self, machine: &Machine) -> Path {
        let kinematics = Kinematics::new(machine);
        let mut smoother = Smoother::new(machine);
        let mut path = Path { pieces: Vec::new(), length_mm: 0.0, traced: true };
        let mut take = |piece| path.take(kinematics.to_joint(piece), &self.axes);
        self.moves.iter().for_each(|next| smoother.push(next.clone(), &mut take));
        smoother.finish(&mut take);
        path
    }

    /// Distances of the set-points from the path on this machine, each times the root of its share of the way: the sum of squares is the mean
    /// square. Both begin at the same place, whatever the zero offsets.
    pub(super) fn off_mm(&self, machine: &Machine) -> Option<Vec<f64>> {
        let path = self.path(machine);
        let first = self.points.first()?;
        let (begin, _) = path.at(0.0, 0, &self.axes)?;
        let shift: Vec<f64> = first.iter().zip(&begin).map(|(a, b)| a - b).collect();
        let (mut way_mm, mut piece, mut before_mm) = (0.0, 0, 0.0);
        let mut all = Vec::with_capacity(self.points.len() * first.len());
        for ((point, traced_mm), share) in self.points.iter().zip(&self.ways_mm).zip(&self.shares) {
            let step_mm = traced_mm - before_mm;
            before_mm = *traced_mm;
            let target: Vec<f64> = point.iter().zip(&shift).map(|(point, shift)| point - shift).collect();
            // Half of the traced way at least: behind a sharp corner the nearest place would otherwise stay in front of it.
            let (low, high) = (way_mm + 0.5 * step_mm, way_mm + 2.0 * step_mm);
            way_mm += step_mm;
            let mut off = Vec::new();
            for step in 0..=FOOT_STEPS {
                piece = path.piece(way_mm, piece);
                let (place, slope) = path.at(way_mm, piece, &self.axes)?;
                off = target.iter().zip(&place).map(|(a, b)| a - b).collect();
                let along = off.iter().zip(&slope).map(|(off, slope)| off * slope).sum::<f64>();
                let square = slope.iter().map(|slope| slope * slope).sum::<f64>();
                if square < STILL {
                    break;
                }
                if step == FOOT_STEPS {
                    off.iter_mut().zip(&slope).for_each(|(off, slope)| *off -= along / square * slope);
                } else {
                    way_mm = (way_mm + along / square).clamp(low, high).clamp(0.0, path.length_mm);
                }
            }
            all.extend(off.iter().map(|off| off * share.sqrt()));
        }
        Some(all)
    }
}

/// What the interpreter makes of a program, as if no time went by.
fn moves(setup: &Setup, machine: &Machine) -> Option<Vec<Move>> {
    let mut interpreter = Interpreter::new(setup.clone(), machine);
    let mut moves = Vec::new();
    while let Some(next) = interpreter.next_move().ok()? {
        if next.kind == MoveKind::StopPreparation {
            interpreter.tell_main_run(MainRun::default());
        }
        moves.push(next);
        if moves.len() > MOVES_MAX {
            return None;
        }
    }
    Some(moves)
}

/// Pieces that move the axes looked at, with the way at which each begins.
struct Path {
    pieces: Vec<(f64, JointPath)>,
    length_mm: f64,
    /// Until the program says otherwise all of it is on the trace.
    traced: bool,
}

impl Path {
    fn take(&mut self, piece: JointPath, axes: &[AxisId]) {
        for event in &piece.contour.events {
            let Event::Trace(starts) = event else { continue };
            if *starts {
                self.pieces.clear();
                self.length_mm = 0.0;
            }
            self.traced = *starts;
        }
        let length_mm = piece.length_lu();
        let moves = axes.iter().any(|axis| piece.at(length_mm / 2.0).first[*axis].abs() > STILL);
        if self.traced && length_mm > 0.0 && moves {
            self.pieces.push((self.length_mm, piece));
            self.length_mm += length_mm;
        }
    }

    /// The piece at a way; the search begins at `from`.
    fn piece(&self, way_mm: f64, from: usize) -> usize {
        let mut place = from.min(self.pieces.len().saturating_sub(1));
        while self.pieces.get(place + 1).is_some_and(|(begin_mm, _)| *begin_mm <= way_mm) {
            place += 1;
        }
        while place > 0 && self.pieces[place].0 > way_mm {
            place -= 1;
        }
        place
    }

    /// Place and slope.
    fn at(&self, way_mm: f64, piece: usize, axes: &[AxisId]) -> Option<(Vec<f64>, Vec<f64>)> {
        let (begin_mm, path) = self.pieces.get(piece)?;
        let state = path.at(way_mm - begin_mm);
        Some(axes.iter().map(|axis| (state.position.0[*axis], state.first[*axis])).unzip())
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (b - a).powi(2)).sum::<f64>().sqrt()
}
