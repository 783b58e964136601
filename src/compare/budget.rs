//! Where the error comes from: of the program, of the interpolator, of the drives.
//!
//! In: a recording with its program and machine. Out: [`Budget`]: three errors in um along the path, each with its worst NC lines.
//!
//! * Chord: distance of a programmed straight block from the smooth curve that runs through the programmed points, L² k / 8 in the middle of
//!   the block, with the mean k of the circles through its ends and the point before and behind. It is an estimate: the program does not say
//!   which curve was meant. Where the path turns by more than [`CORNER_DEG`] at an end, or the neighbour is more than ten times as long, the
//!   corner is taken as meant and the block as straight. Circles, splines and polynomials are exact.
//! * Interpolator: distance of the set-points from the programmed contour: blends, compressor, splines.
//! * Drives: distance of the actual path from the path of the set-points (the contour error).
//!
//! The program is interpreted again, without tools and zero offsets that do not travel in a recording: where it does not lead to the
//! set-points, or calls sub-programs, the first two are left out and the reason is said. Only X, Y, Z count; not for turned tables.

use super::comparison::OwnContour;
use super::contour::follow;
use super::geometry::{SETPOINT_STEMS, Track, track};
use super::lines::{Lines, ProgramLine};
use super::path::{Line, Match, minus, norm};
use super::statistics::{Figures, Gathering};
use crate::base::units::{UM_PER_MM, rad_from_deg};
use crate::base::{AxisVector, Diagnostic, PartPoint};
use crate::geometry::{Arc as CircleArc, PolynomialCurve, SpatialArc};
use crate::interpreter::{Interpreter, Move, MoveKind, Setup};
use crate::machine::{KinematicsSettings, Machine};
use crate::program::ProgramSource;
use crate::trace::Trace;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The three parts.
#[derive(Clone, Debug, Default)]
pub struct Budget {
    /// Of the program.
    pub chord: Option<Part>,
    /// Of the interpolator.
    pub interpolator: Option<Part>,
    /// Of the drives.
    pub drives: Option<Part>,
    /// Why a part is missing.
    pub missing: Vec<Diagnostic>,
}

/// One part.
#[derive(Clone, Debug)]
pub struct Part {
    /// Figures in um: over the samples, of the chords over the blocks.
    pub figures: Figures,
    /// Lines with the largest error, the worst first: program, line, um.
    pub worst: Vec<(ProgramLine, f64)>,
    /// The error over time, for plots: seconds and um.
    pub course: Vec<(f64, f64)>,
}

/// Turning angle above which a corner is meant.
pub const CORNER_DEG: f64 = 20.0;
/// Lines that are listed.
const WORST_MAX: usize = 20;
/// Moves at most: a longer program is not held against its recording.
const MOVES_MAX: usize = 2_000_000;
/// Points of one curve at most.
const POINTS_MAX: usize = 20_000;
/// Set-points that are farther than this from the program are on another path.
const OFF_MM: f64 = 5.0;

/// The budget of a trace. `own`: its contour error, if it has one.
pub fn budget(trace: &Trace, machine: Option<&Machine>, own: Option<&OwnContour>) -> Budget {
    let mut budget = Budget::default();
    let lines = Lines::of(trace);
    if let Some(own) = own {
        budget.drives = part(&own.track, &own.contour.matches, &lines);
    }
    match programmed(trace, machine) {
        Ok(path) => from_program(&mut budget, trace, machine, &path, &lines),
        Err(reason) => budget.missing.push(left_out(&reason)),
    }
    budget
}

fn left_out(reason: &str) -> Diagnostic {
    Diagnostic::note("T0111", format!("error budget without program and interpolator: {reason}"))
}

/// What the program asks for, as points.
#[derive(Default)]
struct Programmed {
    /// Points along all moves, `(move, point)`.
    points: Vec<(usize, [f64; 3])>,
    /// Of each move: its line, whether it is a straight block with a feed, and its end.
    moves: Vec<(u32, bool, [f64; 3])>,
    program: Arc<str>,
    start_mm: [f64; 3],
}

fn programmed(trace: &Trace, machine: Option<&Machine>) -> Result<Programmed, String> {
    let machine = machine.ok_or("no machine file travelled with the trace")?;
    if !matches!(machine.kinematics, KinematicsSettings::Cartesian) {
        return Err("the machine turns the part or the tool".to_owned());
    }
    let program = match trace.programs.as_slice() {
        [] => return Err("no program travelled with the trace".to_owned()),
        [program] => program,
        _ => return Err("the program calls sub-programs".to_owned()),
    };
    let bytes = program.bytes.held().ok_or("the program is too long")?;
    let source = ProgramSource::from_bytes(&program.name, bytes.to_vec());
    let setup = Setup { lists_only: true, ..Setup::from(source) };
    let mut interpreter = Interpreter::new(setup, machine);
    let mut path = Programmed { program: program.name.clone(), ..Programmed::default() };
    let mut at = PartPoint::default();
    for axis in machine.axis_ids() {
        at.0[axis] = machine.axis(axis).home_lu;
    }
    let geometry = ["X", "Y", "Z"].map(|name| machine.axis_by_name(name));
    path.start_mm = geometry.map(|axis| axis.map_or(0.0, |axis| at.0[axis]));
    let xyz = |point: &AxisVector| geometry.map(|axis| axis.map_or(0.0, |axis| point[axis]));
    path.points.push((0, path.start_mm));
    let linear = machine.linear_mask();
    loop {
        // What came before an alarm was executed.
        let Ok(Some(next)) = interpreter.next_move() else { return Ok(path) };
        if path.moves.len() >= MOVES_MAX {
            return Err(format!("the program has more than {MOVES_MAX} moves"));
        }
        if next.modes.tool.as_ref().is_some_and(|tool| tool.length.norm() > 0.0) {
            return Err("the program uses tools with lengths, which do not travel in a recording".to_owned());
        }
        sample(&mut path, &next, at, &linear, &xyz);
        at = next.end;
    }
}

/// Points of one move: its end, and of a curve enough between that chords are below a hundredth of a micrometre or [`POINTS_MAX`].
fn sample(
    path: &mut Programmed,
    next: &Move,
    start: PartPoint,
    linear: &crate::base::PerAxis<bool>,
    xyz: &dyn Fn(&AxisVector) -> [f64; 3],
) {
    let number = path.moves.len();
    let end_mm = xyz(&next.end.0);
    let count = |length_mm: f64, bend_per_mm: f64| {
        // Chord c of a circle: c² k / 8 = 1e-5 mm.
        let chord_mm = (8e-5 / bend_per_mm.max(1e-6)).sqrt();
        ((length_mm / chord_mm).ceil() as usize).clamp(1, POINTS_MAX)
    };
    let mut push = |n: usize, length_lu: f64, at: &dyn Fn(f64) -> PartPoint| {
        for k in 1..n {
            path.points.push((number, xyz(&at(length_lu * k as f64 / n as f64).0)));
        }
    };
    match &next.kind {
        MoveKind::Arc(geometry) => {
            let arc = CircleArc::new(start, next.end, geometry, linear);
            push(count(arc.length_lu(), arc.curvature_per_mm()), arc.length_lu(), &|s| arc.at(s).position);
        }
        MoveKind::SpatialArc(geometry) => {
            let arc = SpatialArc::new(start, next.end, geometry, linear);
            push(count(arc.length_lu(), 1.0 / arc.radius_mm().max(1e-3)), arc.length_lu(), &|s| arc.at(s).position);
        }
        MoveKind::Spline(geometry) | MoveKind::Polynomial(geometry) => {
            let curve = PolynomialCurve::new(start, next.end, geometry, linear);
            let length_lu = curve.length_lu();
            push(((length_lu / 0.02).ceil() as usize).clamp(16, POINTS_MAX), length_lu, &|s| curve.at(s).position);
        }
        _ => {}
    }
    path.points.push((number, end_mm));
    path.moves.push((next.block.line, matches!(next.kind, MoveKind::Line), end_mm));
}

fn from_program(budget: &mut Budget, trace: &Trace, machine: Option<&Machine>, path: &Programmed, lines: &Lines) {
    let Some(setpoints) = track(trace, machine, &SETPOINT_STEMS) else {
        budget.missing.push(left_out("there are no set-points that move"));
        return;
    };
    // The line's clock counts points: the follower begins at the first.
    let points = path.points.iter().enumerate().map(|(i, (_, point_mm))| (i as f64, *point_mm));
    let line = Line::new(points, 1e-9);
    let matches = follow(&setpoints, &line, 0.0, None);
    let farthest_mm = matches.iter().flatten().map(|found| found.distance_mm).fold(0.0, f64::max);
    let found = matches.iter().flatten().count();
    if farthest_mm > OFF_MM || 2 * found < matches.len() {
        budget.missing.push(left_out(&format!(
            "the set-points are up to {farthest_mm:.3} mm beside the program (zero offsets, tools and overlaid motions do not travel in a recording)"
        )));
        return;
    }
    budget.interpolator = part(&setpoints, &matches, lines);
    budget.chord = chords(path, &setpoints, &matches, lines);
}

/// Errors of a track as a part of the budget.
fn part(track: &Track, matches: &[Option<Match>], lines: &Lines) -> Option<Part> {
    let samples = matches.iter().enumerate().filter_map(|(k, found)| {
        let time_s = track.time_s(k);
        found.map(|found| (time_s, found.distance_mm * UM_PER_MM, lines.at(time_s)))
    });
    gathered(samples)
}

fn gathered<'a>(samples: impl Iterator<Item = (f64, f64, Option<&'a ProgramLine>)>) -> Option<Part> {
    let mut gathering = Gathering::default();
    let mut worst: BTreeMap<ProgramLine, f64> = BTreeMap::new();
    let mut course = Vec::new();
    for (time_s, error_um, line) in samples {
        gathering.push(time_s, error_um);
        course.push((time_s, error_um));
        if let Some(line) = line {
            let most = worst.entry(line.clone()).or_insert(0.0);
            *most = most.max(error_um);
        }
    }
    let mut worst: Vec<(ProgramLine, f64)> = worst.into_iter().collect();
    worst.sort_by(|a, b| b.1.total_cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    worst.truncate(WORST_MAX);
    Some(Part { figures: gathering.finish()?, worst, course })
}

/// Chord errors of the straight blocks. Their course holds while the block is executed.
fn chords(path: &Programmed, setpoints: &Track, matches: &[Option<Match>], lines: &Lines) -> Option<Part> {
    let errors_um = chord_errors_um(path);
    let blocks = path.moves.iter().zip(&errors_um).filter(|((_, straight, _), _)| *straight);
    let program_line = |line: u32| (path.program.clone(), line);
    let named: Vec<(ProgramLine, f64)> =
        blocks.map(|((line, ..), error_um)| (program_line(*line), *error_um)).collect();
    let mut part = gathered(named.iter().map(|(line, error_um)| (0.0, *error_um, Some(line))))?;
    let by_line: BTreeMap<&ProgramLine, f64> = named.iter().map(|(line, error_um)| (line, *error_um)).collect();
    part.course.clear();
    for k in (0..matches.len()).filter(|k| matches[*k].is_some()) {
        let time_s = setpoints.time_s(k);
        let error_um = lines.at(time_s).and_then(|line| by_line.get(line)).copied().unwrap_or(0.0);
        part.course.push((time_s, error_um));
    }
    Some(part)
}

/// L² k / 8 of every straight move; 0 for all others, and where a corner is meant.
fn chord_errors_um(path: &Programmed) -> Vec<f64> {
    let start = |i: usize| i.checked_sub(1).map_or(path.start_mm, |before| path.moves[before].2);
    let way = |i: usize| minus(path.moves[i].2, start(i));
    // Turning angle and curvature at the corner between move i and the next.
    let corner = |i: usize| -> Option<f64> {
        if !(path.moves[i].1 && path.moves.get(i + 1)?.1) {
            return None;
        }
        let (a, b) = (way(i), way(i + 1));
        let (la, lb) = (norm(a), norm(b));
        if !(la > 1e-9 && lb > 1e-9) || la > 10.0 * lb || lb > 10.0 * la {
            return None;
        }
        let cosine = (super::path::dot(a, b) / (la * lb)).clamp(-1.0, 1.0);
        let turn_rad = cosine.acos();
        // Circle through three points: k = 2 sin(turn) / distance of the outer two.
        let outer_mm = norm(minus(path.moves[i + 1].2, start(i)));
        (turn_rad < rad_from_deg(CORNER_DEG)).then(|| 2.0 * turn_rad.sin() / outer_mm)
    };
    let curvature = |i: usize| {
        let both = [i.checked_sub(1).and_then(corner), corner(i)];
        let known = both.iter().flatten().count();
        if known == 0 { 0.0 } else { both.iter().flatten().sum::<f64>() / known as f64 }
    };
    let error_um = |i: usize| {
        if !path.moves[i].1 {
            return 0.0;
        }
        let length_mm = norm(way(i));
        length_mm * length_mm * curvature(i) / 8.0 * UM_PER_MM
    };
    (0..path.moves.len()).map(error_um).collect()
}
