//! Moves, machines and judgements that the tests of the room share.

#[path = "../test_machine/mod.rs"]
mod test_machine;

use sollwert::base::{AxisId, AxisVector, PartPoint, PerAxis};
use sollwert::geometry::Curve;
use sollwert::interpreter::{Feed, Modes, Move, MoveKind};
use sollwert::machine::{Machine, PathMode};
use sollwert::program::{BlockRef, ProgramId};
use sollwert::smoothing::{ContourPiece, Corner, PieceKind, Smoother};

pub const X: AxisId = AxisId::new(0);
pub const Y: AxisId = AxisId::new(1);

/// X, Y, Z linear and C rotary, with the smoothing of the Spinner MVC 850.
pub fn machine() -> Machine {
    test_machine::with_axes(&["X", "Y", "Z", "C"], &[])
}

pub fn vector(components: &[f64]) -> AxisVector {
    PerAxis::from_fn(|axis| components.get(axis.index()).copied().unwrap_or(0.0))
}

pub fn point(components: &[f64]) -> PartPoint {
    PartPoint(vector(components))
}

pub fn modes(path_mode: PathMode) -> Modes {
    Modes::new(path_mode)
}

pub fn line(number: u64, end: &[f64]) -> Move {
    let block = BlockRef { program: ProgramId(0), line: number as u32, number };
    let feed = Feed::Path { feed_lu_s: 50.0 };
    Move {
        block,
        kind: MoveKind::Line,
        end: point(end),
        feed,
        modes: modes(PathMode::G642),
        corner: None,
        events: Vec::new(),
    }
}

pub fn polyline(points: &[Vec<f64>]) -> Vec<Move> {
    points.iter().enumerate().map(|(i, end)| line(i as u64 + 1, end)).collect()
}

pub fn run(machine: &Machine, moves: &[Move]) -> (Vec<ContourPiece>, Smoother) {
    let mut smoother = Smoother::new(machine);
    let mut pieces = Vec::new();
    for next in moves {
        smoother.push(next.clone(), &mut |piece| pieces.push(piece));
    }
    smoother.finish(&mut |piece| pieces.push(piece));
    (pieces, smoother)
}

pub fn contour(moves: &[Move]) -> Vec<ContourPiece> {
    run(&machine(), moves).0
}

pub fn corners(pieces: &[ContourPiece]) -> Vec<Corner> {
    let corner = |piece: &ContourPiece| if let PieceKind::Blend(_, corner) = piece.kind { Some(corner) } else { None };
    pieces.iter().filter_map(corner).collect()
}

pub fn kinds(pieces: &[ContourPiece]) -> String {
    pieces
        .iter()
        .map(|piece| match (&piece.kind, piece.stop_at_end) {
            (PieceKind::WaitPositioned { .. }, _) => "p",
            (PieceKind::Block(_), false) => "l",
            (PieceKind::Block(_), true) => "l|",
            (PieceKind::Blend(..), false) => "b",
            (PieceKind::Blend(..), true) => "b|",
            (PieceKind::Wait { .. }, _) => "w",
        })
        .collect()
}

pub fn close(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value:e}, expected {expected:e} +- {tolerance:e}");
}

/// SplitMix64: seeded, no dependency, the same on every machine.
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Polyline with steps over five decades of length; some straight on, some back, some on a grid of equal steps.
    pub fn polyline(&mut self, dimensions: usize, count: usize) -> Vec<Vec<f64>> {
        let mut at = vec![0.0; dimensions];
        let mut step: Vec<f64> = vec![1.0; dimensions];
        (0..count)
            .map(|_| {
                let choice = self.unit();
                if choice < 0.7 {
                    let scale = 10f64.powf(4.0 * self.unit() - 3.0);
                    step = (0..dimensions).map(|_| scale * (2.0 * self.unit() - 1.0)).collect();
                } else if choice < 0.75 {
                    step = step.iter().map(|d| -d).collect();
                } else if choice < 0.9 {
                    step.rotate_left(1);
                }
                for (a, d) in at.iter_mut().zip(&step) {
                    *a += d;
                }
                at.clone()
            })
            .collect()
    }
}

/// Samples a curve densely.
pub fn samples(curve: &Curve) -> impl Iterator<Item = AxisVector> + '_ {
    (0..=400).map(|i| curve.at(curve.length_lu() * f64::from(i) / 400.0).position.0)
}

pub fn distance_to_segment(p: AxisVector, a: AxisVector, b: AxisVector) -> f64 {
    let along = b - a;
    let share = ((p - a).dot(&along) / along.dot(&along)).clamp(0.0, 1.0);
    (p - a - along * share).norm()
}

/// What must hold for every contour: pieces meet exactly, tangents agree where nothing stops and something was rounded, every
/// motion block counts once.
pub fn check_contour(moves: &[Move], pieces: &[ContourPiece], what: &str) {
    let curves: Vec<(&ContourPiece, &Curve)> = pieces.iter().filter_map(|p| p.curve().map(|c| (p, c))).collect();
    for pair in curves.windows(2) {
        let ((first, before), (second, after)) = (pair[0], pair[1]);
        assert_eq!(before.end(), after.start(), "{what}: a gap at {:?}", first.block);
        let blended = matches!(first.kind, PieceKind::Blend(..)) || matches!(second.kind, PieceKind::Blend(..));
        if blended {
            let turn = (before.at(before.length_lu()).first - after.at(0.0).first).norm();
            assert!(turn < 1e-9, "{what}: a kink of {turn:e} at {:?}", first.block);
        }
    }
    for (piece, curve) in &curves {
        assert!(curve.length_lu() > 1e-10, "{what}: a piece of {} mm, {:?}", curve.length_lu(), piece.kind);
    }
    let motions =
        moves.iter().filter(|m| !matches!(m.kind, MoveKind::Dwell { .. } | MoveKind::Function { .. })).count();
    assert_eq!(pieces.iter().map(|p| p.blocks_begun as usize).sum::<usize>(), motions, "{what}: blocks");
    if let Some((last, curve)) = curves.last() {
        assert!(last.stop_at_end, "{what}: the last piece does not stop");
        assert_eq!(curve.end(), moves.last().expect("moves").end, "{what}: the end");
    }
}
