//! The compressor with arcs and rapids, and what is left of the tolerance for blends beside it: from outside.

use super::support::*;
use sollwert::base::{AxisId, AxisVector};
use sollwert::geometry::Curve;
use sollwert::interpreter::{ArcGeometry, Compressor, Feed, Move, MoveKind};
use sollwert::machine::{BlendShape, CompressorBlocks, Machine, PathMode};
use sollwert::smoothing::{ContourPiece, PieceKind};

const KINDS: [Compressor; 4] = [Compressor::On, Compressor::Curvature, Compressor::Cad, Compressor::Surface];
const TOLERANCE_MM: f64 = 0.02;
const Z: AxisId = AxisId::new(2);

fn taking(blocks: CompressorBlocks) -> Machine {
    let mut machine = machine();
    machine.smoothing.compressor_blocks = blocks;
    machine
}

/// A chain of lines and arcs that touch; where the curvature steps it steps by 1/r.
struct Chain {
    at: AxisVector,
    heading_rad: f64,
    moves: Vec<Move>,
}

impl Chain {
    fn new() -> Self {
        Self { at: vector(&[]), heading_rad: 0.3, moves: Vec::new() }
    }

    fn push(&mut self, kind: MoveKind, end: AxisVector) {
        let mut next = line(self.moves.len() as u64 + 1, end.as_slice());
        next.kind = kind;
        next.modes.contour_tolerance_mm = Some(TOLERANCE_MM);
        self.at = end;
        self.moves.push(next);
    }

    fn line(&mut self, length_mm: f64) {
        let (sin, cos) = self.heading_rad.sin_cos();
        self.push(MoveKind::Line, self.at + vector(&[length_mm * cos, length_mm * sin]));
    }

    fn arc(&mut self, radius_mm: f64, sweep_rad: f64, climb_mm: f64) {
        let (sin, cos) = self.heading_rad.sin_cos();
        let left_mm = radius_mm.copysign(sweep_rad);
        let centre_mm = [self.at[X] - left_mm * sin, self.at[Y] + left_mm * cos];
        self.heading_rad += sweep_rad;
        let (sin, cos) = self.heading_rad.sin_cos();
        let end = vector(&[centre_mm[0] + left_mm * sin, centre_mm[1] - left_mm * cos, self.at[Z] + climb_mm]);
        self.push(MoveKind::Arc(ArcGeometry { plane: [X, Y], centre_mm, radius_mm, sweep_rad }), end);
    }

    /// Arcs climb by up to `climb_mm`: a corner where a helix begins.
    fn random(seed: u64, climb_mm: f64) -> Self {
        let (mut random, mut chain) = (Random(seed), Self::new());
        for _ in 0..40 {
            let radius_mm = 1.0 + 7.0 * random.unit();
            let sweep_rad = (0.2 + 0.9 * random.unit()) * if random.unit() < 0.5 { 1.0 } else { -1.0 };
            match (random.unit() * 4.0) as u32 {
                0 => chain.line(0.2 + 4.0 * random.unit()),
                1 => chain.arc(radius_mm, sweep_rad, climb_mm * random.unit()),
                2 => chain.arc(radius_mm, sweep_rad, 0.0),
                _ => {
                    for _ in 0..8 {
                        chain.line(0.1 + 0.3 * random.unit());
                        chain.heading_rad += 0.02 * random.unit();
                    }
                }
            }
        }
        chain
    }
}

/// Distance of a point from a programmed block, by its closed form; where it is off the arc's ends, from the nearer one.
fn distance_to(q: AxisVector, start: AxisVector, block: &Move) -> f64 {
    let MoveKind::Arc(arc) = &block.kind else { return distance_to_segment(q, start, block.end.0) };
    // Along the helix at the angle of the point: not less than the distance, and equal in the plane.
    let angle = |p: AxisVector| (p[Y] - arc.centre_mm[1]).atan2(p[X] - arc.centre_mm[0]);
    let full = std::f64::consts::TAU.copysign(arc.sweep_rad);
    let mut swept_rad = (angle(q) - angle(start)) % full;
    if swept_rad * full < 0.0 {
        swept_rad += full;
    }
    let share = swept_rad / arc.sweep_rad;
    if share > 1.0 {
        return (q - start).norm().min((q - block.end.0).norm());
    }
    let (sin, cos) = (angle(start) + swept_rad).sin_cos();
    let [x, y] = [arc.centre_mm[0] + arc.radius_mm * cos, arc.centre_mm[1] + arc.radius_mm * sin];
    (q - vector(&[x, y, start[Z] + share * (block.end.0[Z] - start[Z])])).norm()
}

fn compressed(moves: &[Move], compressor: Compressor, machine: &Machine) -> (Vec<Move>, Vec<ContourPiece>) {
    let mut moves = moves.to_vec();
    moves.iter_mut().for_each(|next| next.modes.compressor = compressor);
    let pieces = run(machine, &moves).0;
    (moves, pieces)
}

fn curves(pieces: &[ContourPiece]) -> Vec<&Curve> {
    pieces.iter().filter_map(ContourPiece::curve).collect()
}

/// Start of block i.
fn start_of(moves: &[Move], i: usize) -> AxisVector {
    i.checked_sub(1).map_or(vector(&[]), |before| moves[before].end.0)
}

/// Every place of the contour is near its block or a neighbour of it, every programmed point near the contour; the greatest distance.
fn check_tolerance(moves: &[Move], pieces: &[ContourPiece], tolerance_mm: f64, what: &str) -> f64 {
    let mut greatest: f64 = 0.0;
    let mut nearest = vec![f64::INFINITY; moves.len()];
    for piece in pieces {
        let Some(curve) = piece.curve() else { continue };
        let own = piece.block.number as usize - 1;
        let near = own.saturating_sub(1)..(own + 2).min(moves.len());
        for q in samples(curve) {
            let off = near.clone().map(|i| distance_to(q, start_of(moves, i), &moves[i])).fold(f64::INFINITY, f64::min);
            assert!(off <= tolerance_mm, "{what}: {off} off the programmed path at block {}", own + 1);
            greatest = greatest.max(off);
            for i in near.clone() {
                nearest[i] = nearest[i].min((q - moves[i].end.0).norm());
            }
        }
    }
    for (i, off) in nearest.iter().enumerate() {
        // What lies between two samples of an arc of some millimetres, and the tolerance.
        assert!((off.powi(2) - 0.01_f64.powi(2)).max(0.0).sqrt() <= tolerance_mm, "{what}: point {i} missed by {off}");
    }
    greatest
}

fn greatest_steps(pieces: &[ContourPiece]) -> [f64; 2] {
    let mut steps = [0.0_f64; 2];
    for pair in curves(pieces).windows(2) {
        let (end, start) = (pair[0].at(f64::INFINITY), pair[1].at(0.0));
        steps[0] = steps[0].max((end.first - start.first).norm());
        steps[1] = steps[1].max((end.second - start.second).norm());
    }
    steps
}

#[test]
fn arcs_and_lines_become_one_curve_within_the_tolerance() {
    let machine = taking(CompressorBlocks::Arcs);
    for compressor in KINDS {
        for seed in 1..=3 {
            let what = format!("{compressor:?}, seed {seed}");
            let (moves, pieces) = compressed(&Chain::random(seed, 0.3).moves, compressor, &machine);
            check_contour(&moves, &pieces, &what);
            check_tolerance(&moves, &pieces, TOLERANCE_MM, &what);
            let numbers: Vec<u64> = pieces.iter().map(|piece| piece.block.number).collect();
            assert!(numbers.windows(2).all(|pair| pair[0] <= pair[1]), "{what}: {numbers:?}");
            let arcs = curves(&pieces).iter().filter(|curve| matches!(curve, Curve::Arc(_))).count();
            // Where a helix begins the path has a corner: a block between two of them is left alone.
            assert!(arcs <= 3, "{what}: {arcs} arcs are left as they are");
        }
    }
}

#[test]
fn steps_of_curvature_between_lines_and_arcs_are_smoothed_away() {
    let machine = taking(CompressorBlocks::All);
    for seed in 1..=4 {
        let moves = Chain::random(seed, 0.0).moves;
        let plain = greatest_steps(&compressed(&moves, Compressor::Off, &machine).1);
        assert!(plain[1] > 0.3, "seed {seed}: {plain:?}");
        for compressor in KINDS {
            let what = format!("{compressor:?}, seed {seed}");
            let (moves, pieces) = compressed(&moves, compressor, &machine);
            check_contour(&moves, &pieces, &what);
            let [kink, step] = greatest_steps(&pieces);
            assert!(kink < 1e-9, "{what}: a kink of {kink}");
            // Under COMPON the curvature steps, but by less than the arcs do.
            let allowed = if compressor == Compressor::On { 0.6 * plain[1] } else { 1e-9 };
            assert!(step < allowed, "{what}: a step of {step}, {} as programmed", plain[1]);
        }
    }
}

#[test]
fn rapids_have_their_own_tolerance() {
    let points: Vec<Vec<f64>> = (1..=80).map(|i| vec![0.3 * f64::from(i), 4.0 * (0.15 * f64::from(i)).sin()]).collect();
    let mut moves = polyline(&points);
    for next in &mut moves {
        next.kind = MoveKind::Rapid;
        next.feed = Feed::Rapid;
        next.modes.contour_tolerance_mm = Some(TOLERANCE_MM);
    }
    let polynomials =
        |pieces: &[ContourPiece]| curves(pieces).iter().filter(|curve| matches!(curve, Curve::Polynomial(_))).count();
    for compressor in KINDS {
        for blocks in [CompressorBlocks::Lines, CompressorBlocks::Arcs] {
            assert_eq!(polynomials(&compressed(&moves, compressor, &taking(blocks)).1), 0, "{blocks:?}");
        }
        let mut off = Vec::new();
        for factor in [1.0, 4.0] {
            let mut machine = taking(CompressorBlocks::Rapids);
            machine.smoothing.rapid_tolerance_ratio = factor;
            let (moves, pieces) = compressed(&moves, compressor, &machine);
            assert_eq!(polynomials(&pieces), 80, "{compressor:?}");
            off.push(check_tolerance(
                &moves,
                &pieces,
                factor * TOLERANCE_MM,
                &format!("{compressor:?}, STOLF {factor}"),
            ));
        }
        // Four times the tolerance is used where there is something to gain.
        assert!(off[1] > TOLERANCE_MM && off[0] <= TOLERANCE_MM, "{compressor:?}: {off:?}");
        // A run is of one kind: G1 in the middle of it keeps the tolerance of G1.
        let mut machine = taking(CompressorBlocks::All);
        machine.smoothing.rapid_tolerance_ratio = 4.0;
        let mut mixed = moves.clone();
        for next in &mut mixed[15..25] {
            (next.kind, next.feed) = (MoveKind::Line, Feed::Path { feed_lu_s: 50.0 });
        }
        let (mixed, pieces) = compressed(&mixed, compressor, &machine);
        let fed: Vec<ContourPiece> = pieces.into_iter().filter(|p| (17..=24).contains(&p.block.number)).collect();
        for q in curves(&fed).into_iter().flat_map(samples) {
            let off = (14..26).map(|i| distance_to(q, start_of(&mixed, i), &mixed[i])).fold(f64::INFINITY, f64::min);
            assert!(off <= TOLERANCE_MM, "{compressor:?}: {off}");
        }
    }
}

#[test]
fn lines_alone_are_taken_unless_the_machine_says_so() {
    assert_eq!(machine().smoothing.compressor_blocks, CompressorBlocks::Lines);
    let moves = Chain::random(3, 0.0).moves;
    for compressor in KINDS {
        let (moves, pieces) = compressed(&moves, compressor, &machine());
        for piece in &pieces {
            let arc = matches!(moves[piece.block.number as usize - 1].kind, MoveKind::Arc(_));
            if arc && let PieceKind::Block(curve) = &piece.kind {
                assert!(matches!(curve, Curve::Arc(_)), "{compressor:?}: block {}", piece.block.number);
            }
        }
    }
}

/// Short lines with noise, corners among them, and C going along; C jumps its way in single blocks now and then.
fn cornered(seed: u64, mode: PathMode) -> Vec<Move> {
    let mut random = Random(seed);
    let (mut at, mut c, mut heading_rad) = ([0.0, 0.0], 0.0, 0.0_f64);
    let points: Vec<Vec<f64>> = (0..120)
        .map(|i| {
            heading_rad += match i % 12 {
                11 => (0.65 + 1.6 * random.unit()) * if random.unit() < 0.5 { 1.0 } else { -1.0 },
                _ => 0.05 * (random.unit() - 0.3),
            };
            let step_mm = 0.1 + 0.5 * random.unit();
            at = [at[0] + step_mm * heading_rad.cos(), at[1] + step_mm * heading_rad.sin()];
            c += if random.unit() < 0.03 { 0.2 } else { 0.01 * (random.unit() - 0.4) };
            let [x, y, turn] = [0.6 * TOLERANCE_MM, 0.6 * TOLERANCE_MM, 2e-3].map(|most| most * (random.unit() - 0.5));
            vec![at[0] + x, at[1] + y, 0.0, c + turn]
        })
        .collect();
    let mut moves = polyline(&points);
    for next in &mut moves {
        next.modes.path_mode = mode;
        next.modes.contour_tolerance_mm = Some(TOLERANCE_MM);
    }
    moves
}

/// Least share of both tolerances by which a posture is off the programmed lines around its block.
fn off_share(q: AxisVector, moves: &[Move], near: std::ops::Range<usize>, rotary_rad: f64) -> f64 {
    let share = |i: usize| {
        let (start, end) = (start_of(moves, i), moves[i].end.0);
        let at = |u: f64| {
            let off = (q - start - (end - start) * u).as_slice().to_vec();
            off[..3].iter().map(|x| x * x).sum::<f64>().sqrt() / TOLERANCE_MM
        };
        let both = |u: f64| at(u).max((q - start - (end - start) * u).as_slice()[3].abs() / rotary_rad);
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            if both(a) < both(b) { high = b } else { low = a }
        }
        both(0.5 * (low + high))
    };
    near.map(share).fold(f64::INFINITY, f64::min)
}

#[test]
fn compressor_and_blend_together_keep_the_tolerance() {
    let machine = machine();
    let rotary_rad = machine.smoothing.orientation_tolerance_rad;
    let mut blends = 0;
    for mode in [PathMode::G642, PathMode::G643, PathMode::G645] {
        for compressor in KINDS {
            for seed in 1..=2 {
                let what = format!("{mode:?} {compressor:?}, seed {seed}");
                let (moves, pieces) = compressed(&cornered(seed, mode), compressor, &machine);
                check_contour(&moves, &pieces, &what);
                blends += corners(&pieces).len();
                // Every axis of G643 alone: sqrt 2 of them together, beside the compressor.
                let allowed = if mode == PathMode::G643 { std::f64::consts::SQRT_2 } else { 1.0 };
                for piece in &pieces {
                    let Some(curve) = piece.curve() else { continue };
                    let own = piece.block.number as usize - 1;
                    let near = own.saturating_sub(1)..(own + 2).min(moves.len());
                    for q in samples(curve).step_by(40) {
                        let share = off_share(q, &moves, near.clone(), rotary_rad);
                        assert!(share <= allowed, "{what}: {share} of the tolerance at block {}", own + 1);
                    }
                }
            }
        }
    }
    assert!(blends > 200, "{blends}");
}

#[test]
fn a_point_that_the_compressor_moved_is_not_moved_beyond_the_tolerance_by_the_blend() {
    // Found by tests/proof: C turns back in a corner of blocks so short that the corner is noise; the curve of the first one ends off
    // its point, the second one stays a line, and the corner between them is rounded.
    let mut machine = machine();
    machine.smoothing.shape = BlendShape::Quintic;
    let point = vec![0.1743, -0.1449, 0.0, 0.6529_f64.to_radians()];
    let moves = polyline(&[point.clone(), vec![0.3949, -0.0288, 0.0, 0.2382_f64.to_radians()]]);
    let (_, pieces) = compressed(&moves, Compressor::Cad, &machine);
    assert_eq!(corners(&pieces).len(), 1, "{}", kinds(&pieces));
    let missed = |q: AxisVector| {
        let off = q - vector(&point);
        let linear_mm = vector(&off.as_slice()[..3]).norm();
        let rotary_rad = off.as_slice()[3].abs();
        let settings = &machine.smoothing;
        (linear_mm / settings.contour_tolerance_mm).max(rotary_rad / settings.orientation_tolerance_rad)
    };
    let least = curves(&pieces).into_iter().flat_map(samples).map(missed).fold(f64::INFINITY, f64::min);
    assert!(least <= 1.0, "missed by {least} tolerances");
}
