//! The path of a program, cut where it rests.
//!
//! In: [`PlannedPiece`]s in order. Out: [`Part`]s: motions from rest to rest with the limits of their pieces, and waits. Splines are cut
//! where their direction or curvature steps. Does not solve.

use super::{NoOptimum, Optimum};
use crate::feed::{PathRules, PieceRules, PlannedPiece, TimeLaw};
use crate::geometry::Curve;
use crate::kinematics::JointPath;
use crate::machine::Machine;
use crate::smoothing::{ContourPiece, PieceKind};
use std::sync::Arc;

/// Takes the path of a program.
#[derive(Clone, Debug)]
pub struct Collector {
    rules: PathRules,
    parts: Vec<Part>,
    /// Pieces since the last rest.
    motion: Vec<Piece>,
}

/// A motion from rest to rest, or a time at rest.
#[derive(Clone, Debug)]
pub(super) enum Part {
    Moves(Vec<Piece>),
    Rests { time_s: f64 },
}

/// A smooth piece of path.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub path: JointPath,
    pub length_lu: f64,
    pub rules: PieceRules,
    /// As the control drives it: the law of the whole piece, and where in it this one begins.
    pub driven: (Arc<TimeLaw>, f64),
}

impl Collector {
    /// At rest at the start of a path on `machine`.
    pub fn new(machine: &Machine) -> Self {
        Self { rules: PathRules::new(machine), parts: Vec::new(), motion: Vec::new() }
    }

    /// The next piece of the path.
    pub fn push(&mut self, planned: &PlannedPiece) {
        let path = &planned.path;
        // A thread goes as its spindle does.
        let free = path.contour.modes.thread.is_none();
        if path.contour.curve().is_some() && free {
            let law = Arc::new(planned.law.clone());
            let mut from_lu = 0.0;
            for part in smooth(path) {
                let length_lu = part.length_lu();
                self.add(part, (law.clone(), from_lu));
                from_lu += length_lu;
            }
        } else if planned.law.duration_s() > 0.0 {
            self.rest();
            self.parts.push(Part::Rests { time_s: planned.law.duration_s() });
        }
        if path.contour.stop_at_end {
            self.rest();
        }
    }

    fn rest(&mut self) {
        self.rules.rest();
        self.end_motion();
    }

    fn end_motion(&mut self) {
        if !self.motion.is_empty() {
            self.parts.push(Part::Moves(std::mem::take(&mut self.motion)));
        }
    }

    fn add(&mut self, path: JointPath, driven: (Arc<TimeLaw>, f64)) {
        let Some(rules) = self.rules.piece(&path) else { return };
        if rules.junction_lu_s <= 0.0 {
            self.end_motion();
        }
        self.motion.push(Piece { length_lu: path.length_lu(), path, rules, driven });
    }

    /// The path ends here: the fastest motion along it. `progress` hears how many of how many pieces are done.
    pub fn solve(mut self, progress: &mut dyn FnMut(usize, usize)) -> Result<Optimum, NoOptimum> {
        self.rest();
        solve(self.parts, progress)
    }
}

impl Piece {
    /// v² and its slope along s as the control drives it.
    #[cfg(feature = "optimal")]
    pub(super) fn driven_at(&self, s_lu: f64) -> [f64; 2] {
        let (law, from_lu) = &self.driven;
        let place_lu = from_lu + s_lu;
        let phases = law.phases();
        let index = phases.partition_point(|phase| phase.start_lu <= place_lu).saturating_sub(1);
        let Some(phase) = phases.get(index) else { return [0.0; 2] };
        let (mut low_s, mut high_s) = (0.0, phase.duration_s);
        for _ in 0..HALVINGS {
            let middle_s = 0.5 * (low_s + high_s);
            if phase.at(middle_s).position_lu < place_lu { low_s = middle_s } else { high_s = middle_s }
        }
        let state = phase.at(0.5 * (low_s + high_s));
        [state.velocity_lu_s * state.velocity_lu_s, 2.0 * state.acceleration_lu_s2]
    }
}

/// Of a phase, to find the time at which it is at a place.
#[cfg(feature = "optimal")]
const HALVINGS: usize = 50;

/// The parts of a piece on which direction and curvature are continuous.
fn smooth(path: &JointPath) -> Vec<JointPath> {
    let Some(Curve::Polynomial(curve)) = path.contour.curve() else { return vec![path.clone()] };
    let breaks_lu = curve.breaks_lu();
    if breaks_lu.is_empty() {
        return vec![path.clone()];
    }
    let borders: Vec<f64> = [0.0].into_iter().chain(breaks_lu).chain([curve.length_lu()]).collect();
    let part = |range: &[f64]| {
        let contour = &path.contour;
        let kind = match &contour.kind {
            PieceKind::Block(curve) => PieceKind::Block(curve.trimmed(range[0], range[1])),
            PieceKind::Blend(curve, corner) => PieceKind::Blend(curve.trimmed(range[0], range[1]), *corner),
            waits => waits.clone(),
        };
        JointPath { contour: ContourPiece { kind, ..contour.clone() }, ..path.clone() }
    };
    borders.windows(2).map(part).collect()
}

#[cfg(not(feature = "optimal"))]
fn solve(_: Vec<Part>, _: &mut dyn FnMut(usize, usize)) -> Result<Optimum, NoOptimum> {
    Err(NoOptimum::NotBuilt)
}

#[cfg(feature = "optimal")]
fn solve(parts: Vec<Part>, progress: &mut dyn FnMut(usize, usize)) -> Result<Optimum, NoOptimum> {
    super::section::solve(parts, progress)
}
