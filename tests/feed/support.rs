//! Machines, paths and random numbers for the tests of feed and interpolator.
//!
//! In: points and modes. Out: planned pieces and set-points, driven as the kernel drives them. Does not check anything.
#![allow(dead_code)]

#[path = "../test_machine/mod.rs"]
mod test_machine;

#[path = "../random/mod.rs"]
mod random;
pub use random::Random;
use sollwert::base::{AxisId, PartPoint, PerAxis, TimeBase};
use sollwert::feed::{OverrideSchedule, PlannedPiece, Planner};
use sollwert::interpolator::{Interpolator, Setpoint};
use sollwert::interpreter::{ArcGeometry, Feed, Modes, Move, MoveKind};
use sollwert::kinematics::{JointPath, Kinematics};
use sollwert::machine::*;
use sollwert::program::{BlockRef, ProgramId};
use sollwert::smoothing::Smoother;

/// The published machine of [Essid 2019, table 2]: 3 axes, 20 m/min, 1 m/s², 15 m/s³, transition jerk 10 m/s³, t_s = 1 ms.
pub fn spinner() -> Machine {
    with_axes(&["X", "Y", "Z"])
}

/// A shipped machine.
pub fn test_machine_shipped(name: &str) -> Machine {
    test_machine::shipped(name, &[])
}

fn with_axes(axes: &[&str]) -> Machine {
    let mut machine = test_machine::with_axes(axes, &[]);
    // Without drives a machine has one tick a set-point; four leave room for a position cycle.
    machine.cycle.time_base = TimeBase::new((1_000_000, 1), 4);
    machine
}

/// The Spinner with a rotary axis A: 15 rpm, 0.83 rot/s², 5 rot/s³.
pub fn with_rotary() -> Machine {
    let mut machine = with_axes(&["X", "Y", "Z", "A"]);
    machine.axes[3].follow_up_tolerance_lu = 1e-4;
    machine
}

pub fn point(values: &[f64]) -> PartPoint {
    PartPoint(PerAxis::from_fn(|axis| values.get(axis.index()).copied().unwrap_or(0.0)))
}

pub fn modes(path_mode: PathMode) -> Modes {
    Modes { contour_tolerance_mm: Some(0.1), ..Modes::new(path_mode) }
}

/// A program of moves from the machine's home.
#[derive(Clone)]
pub struct Program {
    pub modes: Modes,
    pub feed: Feed,
    pub moves: Vec<Move>,
}

impl Program {
    pub fn new(path_mode: PathMode, feed_mm_min: f64) -> Self {
        Self { modes: modes(path_mode), feed: Feed::Path { feed_lu_s: feed_mm_min / 60.0 }, moves: Vec::new() }
    }

    pub fn push(&mut self, kind: MoveKind, end: PartPoint) {
        let number = self.moves.len() as u64 + 1;
        let block = BlockRef { program: ProgramId(0), line: number as u32, number };
        let feed = if kind == MoveKind::Rapid { Feed::Rapid } else { self.feed.clone() };
        self.moves.push(Move { block, kind, end, feed, modes: self.modes.clone(), corner: None, events: Vec::new() });
    }

    pub fn end(&self) -> PartPoint {
        self.moves.last().map_or_else(|| point(&[]), |last| last.end)
    }

    pub fn line(&mut self, values: &[f64]) {
        self.push(MoveKind::Line, point(values));
    }

    pub fn rapid(&mut self, values: &[f64]) {
        self.push(MoveKind::Rapid, point(values));
    }

    pub fn dwell(&mut self, time_s: f64) {
        self.push(MoveKind::Dwell { time_s }, self.end());
    }

    /// Arc in XY about a centre, by a signed angle; Z moves along by `pitch_mm`.
    pub fn arc(&mut self, centre_mm: [f64; 2], sweep_rad: f64, pitch_mm: f64) {
        let start = self.end();
        let (x, y) = (AxisId::new(0), AxisId::new(1));
        let (dx, dy) = (start.0[x] - centre_mm[0], start.0[y] - centre_mm[1]);
        let (sin, cos) = sweep_rad.sin_cos();
        let mut end = start;
        end.0[x] = centre_mm[0] + dx * cos - dy * sin;
        end.0[y] = centre_mm[1] + dx * sin + dy * cos;
        end.0[AxisId::new(2)] += pitch_mm;
        let arc = ArcGeometry { plane: [x, y], centre_mm, radius_mm: dx.hypot(dy), sweep_rad };
        self.push(MoveKind::Arc(arc), end);
    }

    pub fn polyline(path_mode: PathMode, feed_mm_min: f64, points: &[[f64; 2]]) -> Self {
        let mut program = Self::new(path_mode, feed_mm_min);
        for p in points {
            program.line(p);
        }
        program
    }

    /// Path pieces, all at once.
    pub fn paths(&self, machine: &Machine) -> Vec<JointPath> {
        let mut smoother = Smoother::new(machine);
        let kinematics = Kinematics::new(machine);
        let mut paths = Vec::new();
        for next in &self.moves {
            smoother.push(next.clone(), &mut |piece| paths.push(kinematics.to_joint(piece)));
        }
        smoother.finish(&mut |piece| paths.push(kinematics.to_joint(piece)));
        paths
    }

    /// Planned pieces; a path is handed over only when the planner asks for more.
    pub fn planned(&self, machine: &Machine) -> Vec<PlannedPiece> {
        plan(machine, self.paths(machine))
    }

    pub fn setpoints(&self, machine: &Machine) -> Vec<Setpoint> {
        sample(machine, self.planned(machine))
    }
}

pub fn plan(machine: &Machine, paths: Vec<JointPath>) -> Vec<PlannedPiece> {
    plan_with(Planner::new(machine), paths)
}

/// With changes of the feed override, as `--override` takes them.
pub fn plan_under(machine: &Machine, overrides: &str, paths: Vec<JointPath>) -> Vec<PlannedPiece> {
    plan_with(Planner::new(machine).with_overrides(&OverrideSchedule::parse(overrides).unwrap()), paths)
}

fn plan_with(mut planner: Planner, paths: Vec<JointPath>) -> Vec<PlannedPiece> {
    let mut paths = paths.into_iter();
    let mut planned = Vec::new();
    loop {
        while let Some(piece) = planner.pop() {
            planned.push(piece);
        }
        match paths.next() {
            Some(path) => planner.push(path).unwrap(),
            None => break,
        }
    }
    planner.finish();
    while let Some(piece) = planner.pop() {
        planned.push(piece);
    }
    planned
}

pub fn sample(machine: &Machine, planned: Vec<PlannedPiece>) -> Vec<Setpoint> {
    let mut interpolator = Interpolator::new(machine);
    let mut planned = planned.into_iter();
    let mut next = || planned.next();
    (0..).map_while(|k| interpolator.sample(k, &mut next)).collect()
}

pub fn total_s(planned: &[PlannedPiece]) -> f64 {
    planned.iter().map(|piece| piece.law.duration_s()).sum()
}

impl Random {
    /// Evenly over the orders of magnitude.
    pub fn logarithmic(&mut self, low: f64, high: f64) -> f64 {
        (self.between(low.ln(), high.ln())).exp()
    }

    /// A walk of `count` segments: long and short, turning sharply, reversing or hardly at all.
    pub fn walk(&mut self, count: usize, shortest_mm: f64, longest_mm: f64) -> Vec<[f64; 2]> {
        let (mut at, mut direction_rad) = ([0.0, 0.0], self.between(0.0, 6.3));
        (0..count)
            .map(|_| {
                let length_mm = self.logarithmic(shortest_mm, longest_mm);
                at = [at[0] + length_mm * direction_rad.cos(), at[1] + length_mm * direction_rad.sin()];
                direction_rad += match (self.unit() * 5.0) as u32 {
                    0 => self.between(-3.1, 3.1),
                    1 => self.between(-1e-3, 1e-3),
                    2 => std::f64::consts::FRAC_PI_2,
                    3 => self.between(-0.3, 0.3),
                    _ => 0.0,
                };
                at
            })
            .collect()
    }
}
