//! The contour that a program asks for as points in space.
//!
//! In: the programmed path of a recording, the machine. Out: [`ProgrammedLine`]: points where the tip of the tool is meant to be (X, Y, Z of the
//! slides on a Cartesian machine, the tip in the part where part or tool turn, as a [`Track`](super::geometry::Track) has it), with the
//! block of each. Straight in all axes is no line in the part: such a block gets points in between. Does not compare.

use super::geometry::Tips;
use super::path::{Line, minus, norm};
use crate::base::units::{UM_PER_MM, rad_from_deg};
use crate::base::{AxisId, AxisVector, MachinePoint};
use crate::machine::Machine;
use crate::trace::{Motion, ProgrammedPath, ProgrammedView};

/// Turning angle above which a corner is meant.
pub const CORNER_DEG: f64 = 20.0;
/// A neighbour that is so many times as long makes a corner.
const LENGTH_RATIO_MAX: f64 = 10.0;
/// Points at most: about 1 GB as a line.
const POINTS_MAX: usize = 20_000_000;
/// Points between two of the program at most.
const BETWEEN_MAX: f64 = 2000.0;
/// A turning point leaves the chord by at most this.
const SAGITTA_MM: f64 = 2e-5;

/// Points in space along a program.
pub(super) struct ProgrammedLine {
    points_mm: Vec<[f64; 3]>,
    /// Place of the first point of every block, and the number of points.
    first_points: Vec<usize>,
    motions: Vec<Motion>,
}

impl ProgrammedLine {
    /// Of the blocks that there is room for; `in_part`: tips in the part by the kinematics of the machine.
    pub(super) fn new(path: &ProgrammedPath, machine: &Machine, in_part: bool) -> Self {
        let tips = Tips::new(machine);
        let places = tips.places(path.axes());
        let turns: Vec<AxisId> = machine.axis_ids().filter(|id| !machine.linear_mask()[*id]).collect();
        let geometry = ["X", "Y", "Z"].map(|name| machine.axis_by_name(name));
        let mut line = Self { points_mm: Vec::new(), first_points: vec![0], motions: Vec::new() };
        for i in 0..path.len() {
            let Some(block) = path.block(i) else { break };
            let length = vector(block.tool_length_mm, &places);
            // The axes stand the length of the tool away from where its tip is meant to be.
            let postures = block.values.chunks_exact(places.len().max(1));
            let postures = postures.map(|values| MachinePoint(vector(values, &places) + length));
            if in_part {
                line.add_turning(postures, &turns, |posture| tips.in_part(posture, &length));
            } else {
                line.points_mm
                    .extend(postures.map(|posture| geometry.map(|axis| axis.map_or(0.0, |axis| posture.0[axis]))));
            }
            line.first_points.push(line.points_mm.len());
            line.motions.push(block.motion);
            if line.points_mm.len() > POINTS_MAX {
                break;
            }
        }
        line
    }

    fn add_turning(
        &mut self,
        postures: impl Iterator<Item = MachinePoint>,
        turns: &[AxisId],
        tip: impl Fn(&MachinePoint) -> [f64; 3],
    ) {
        let mut last: Option<(MachinePoint, [f64; 3])> = None;
        for posture in postures {
            let point_mm = tip(&posture);
            if let Some((from, from_mm)) = &last {
                let way = posture.0 - from.0;
                let turn_rad: f64 = turns.iter().map(|axis| way[*axis].abs()).sum();
                // A point at radius r that turns by a leaves its chord by r a² / 8.
                let radius_mm = norm(point_mm).max(norm(*from_mm)) + norm(minus(point_mm, *from_mm));
                let parts =
                    (turn_rad * (radius_mm / (8.0 * SAGITTA_MM)).sqrt()).ceil().clamp(1.0, BETWEEN_MAX) as usize;
                let between = |k: usize| MachinePoint(from.0 + way * (k as f64 / parts as f64));
                self.points_mm.extend((1..parts).map(|k| tip(&between(k))));
            }
            self.points_mm.push(point_mm);
            last = Some((posture, point_mm));
        }
    }

    /// Number of blocks.
    pub(super) fn blocks(&self) -> usize {
        self.motions.len()
    }

    /// The points as a line; its clock counts points.
    pub(super) fn line(&self) -> Line {
        Line::new(self.points_mm.iter().enumerate().map(|(i, point_mm)| (i as f64, *point_mm)), 1e-9)
    }

    /// First and last point of a stretch of blocks, as the line's clock shows them.
    pub(super) fn clock(&self, from_block: usize, to_block: usize) -> [f64; 2] {
        let last = self.blocks().saturating_sub(1);
        let from = self.first_points.get(from_block.min(last)).copied().unwrap_or(0);
        let to = self.first_points.get(to_block.min(last) + 1).copied().unwrap_or(0);
        [from as f64, to.saturating_sub(1) as f64]
    }

    /// The block of a place on the line.
    pub(super) fn block_at(&self, clock: f64) -> usize {
        // A place between two points belongs to the block of the second.
        let point = (clock - 1e-9).ceil().max(0.0) as usize;
        self.first_points
            .partition_point(|first| *first <= point)
            .saturating_sub(1)
            .min(self.blocks().saturating_sub(1))
    }

    /// Whether every axis is on its own in a block.
    pub(super) fn is_free(&self, block: usize) -> bool {
        self.motions.get(block) == Some(&Motion::Positioning)
    }

    /// Whether a block is straight with a feed.
    pub(super) fn is_straight(&self, block: usize) -> bool {
        self.motions.get(block) == Some(&Motion::Line)
    }

    fn ends_mm(&self, block: usize) -> Option<[[f64; 3]; 2]> {
        let (from, to) = (*self.first_points.get(block)?, *self.first_points.get(block + 1)?);
        Some([*self.points_mm.get(from)?, *self.points_mm.get(to.checked_sub(1)?)?])
    }

    /// L² k / 8 of a straight block; 0 for all others, and where a corner is meant.
    pub(super) fn chord_error_um(&self, block: usize) -> f64 {
        let Some([start_mm, end_mm]) = self.ends_mm(block).filter(|_| self.is_straight(block)) else { return 0.0 };
        let both =
            [block.checked_sub(1).and_then(|before| self.curvature_per_mm(before)), self.curvature_per_mm(block)];
        let known = both.iter().flatten().count();
        if known == 0 {
            return 0.0;
        }
        let length_mm = norm(minus(end_mm, start_mm));
        length_mm * length_mm * both.iter().flatten().sum::<f64>() / known as f64 / 8.0 * UM_PER_MM
    }

    /// Of the circle through the ends of a straight block and the end of the next; `None` where a corner is meant.
    fn curvature_per_mm(&self, block: usize) -> Option<f64> {
        if !(self.is_straight(block) && self.is_straight(block + 1)) {
            return None;
        }
        let ([start_mm, middle_mm], [_, end_mm]) = (self.ends_mm(block)?, self.ends_mm(block + 1)?);
        let (a, b) = (minus(middle_mm, start_mm), minus(end_mm, middle_mm));
        let (la, lb) = (norm(a), norm(b));
        if !(la > 1e-9 && lb > 1e-9) || la > LENGTH_RATIO_MAX * lb || lb > LENGTH_RATIO_MAX * la {
            return None;
        }
        let turn_rad = (super::path::dot(a, b) / (la * lb)).clamp(-1.0, 1.0).acos();
        // Circle through three points: k = 2 sin(turn) / distance of the outer two.
        (turn_rad < rad_from_deg(CORNER_DEG)).then(|| 2.0 * turn_rad.sin() / norm(minus(end_mm, start_mm)))
    }
}

/// Program and line of a block.
pub(super) fn program_line(block: &ProgrammedView<'_>) -> super::lines::ProgramLine {
    (block.program.clone(), block.line)
}

fn vector(values: &[f64], places: &[Option<AxisId>]) -> AxisVector {
    let mut vector = AxisVector::zero();
    for (value_lu, place) in values.iter().zip(places) {
        if let Some(axis) = place {
            vector[*axis] = *value_lu;
        }
    }
    vector
}
