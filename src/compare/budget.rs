//! Where the error comes from: of the program, of the interpolator, of the drives.
//!
//! In: a trace, what the program asks of the path (a recording tells it block by block; of a control's trace the recording that it is compared
//! with). Out: [`Budget`]: three errors in um along the path, each with its worst NC lines.
//!
//! * Chord: distance of a programmed straight block from the smooth curve that runs through the programmed points, L² k / 8 in the middle of
//!   the block, with the mean k of the circles through its ends and the point before and behind. It is an estimate: the program does not say
//!   which curve was meant. Where the path turns by more than [`CORNER_DEG`](super::programmed::CORNER_DEG) at an end, or the neighbour is more
//!   than ten times as long, the corner is taken as meant and the block as straight. Circles, splines and polynomials are exact.
//! * Interpolator: distance of the set-points from the programmed contour (RND and CHF are part of it): blends, compressor, fine interpolation.
//! * Drives: distance of the actual path from the path of the set-points (the contour error).
//!
//! A set-point of a recording is held against the blocks around the one that is executed, so that no neighbouring pass can hide an error;
//! those of a control's trace are followed along the path. Axes that move on their own (POS, RTLIOF) have no contour and count in no part.
//! Only the tip counts, not the direction of the tool.

use super::comparison::OwnContour;
use super::contour::follow;
use super::geometry::{SETPOINT_STEMS, TICK_SLACK_S, Track, track};
use super::lines::{Lines, ProgramLine};
use super::path::{Follower, Line, Match};
use super::programmed::{ProgrammedLine, program_line};
use super::statistics::{Figures, Gathering};
use crate::base::Diagnostic;
use crate::base::units::UM_PER_MM;
use crate::machine::Machine;
use crate::trace::{ProgrammedPath, Trace};
use std::collections::BTreeMap;

/// The three parts.
#[derive(Clone, Debug, Default)]
pub struct Budget {
    /// Of the program.
    pub chord: Option<Part>,
    /// Of the interpolator.
    pub interpolator: Option<Part>,
    /// Of the drives.
    pub drives: Option<Part>,
    /// The program is that of the other file.
    pub program_of_other: bool,
    /// Why a part is missing, or what of it is.
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

/// What a budget is drawn up from, besides the trace.
#[derive(Clone, Copy, Debug, Default)]
pub struct BudgetGround<'a> {
    /// Machine of the trace, or of the other file where it has none.
    pub machine: Option<&'a Machine>,
    /// Contour error of the trace, if it has one.
    pub own: Option<&'a OwnContour>,
    /// NC lines over the time of the trace; those of the trace itself where there are none.
    pub lines: Option<&'a Lines>,
    /// The other file of a comparison.
    pub other: Option<&'a ProgrammedPath>,
}

/// Lines that are listed.
const WORST_MAX: usize = 20;
/// Set-points of a control that are farther than this from the program are on another path.
const OFF_MM: f64 = 5.0;
/// Rounding of coordinates: a line that is off by less has no error to list.
pub(super) const ROUNDING_UM: f64 = 1e-6;
/// Blocks that begin at one instant at most, to be looked through for their first.
const TOGETHER_MAX: usize = 1000;

/// The budget of a trace.
pub fn budget(trace: &Trace, ground: &BudgetGround<'_>) -> Budget {
    let mut budget = Budget::default();
    let found;
    let lines = match ground.lines {
        Some(lines) => lines,
        None => {
            found = Lines::of(trace);
            &found
        }
    };
    if let Some(own) = ground.own {
        let course = samples(&own.track, &own.contour.matches);
        budget.drives = gathered(course.map(|(k, error_um)| {
            let time_s = own.track.time_s(k);
            (time_s, error_um, lines.at(time_s).cloned())
        }));
    }
    if let Err(reason) = from_program(&mut budget, trace, ground) {
        budget.missing.push(left_out(&reason));
    }
    budget
}

fn left_out(reason: &str) -> Diagnostic {
    Diagnostic::note("T0111", format!("error budget without program and interpolator: {reason}"))
}

fn from_program(budget: &mut Budget, trace: &Trace, ground: &BudgetGround<'_>) -> Result<(), String> {
    let machine = ground.machine.ok_or("no machine file travelled with the trace")?;
    let other = ground.other.filter(|path| !path.is_empty() && trace.programmed.is_empty());
    let path = other.unwrap_or(&trace.programmed);
    if path.is_empty() {
        return Err("the file does not tell what the program asks for; recordings of `sollwert run` do".to_owned());
    }
    let setpoints = track(trace, Some(machine), &SETPOINT_STEMS, true).ok_or("there are no set-points that move")?;
    let programmed = ProgrammedLine::new(path, machine, setpoints.in_part);
    let line = programmed.line();
    let matches = if other.is_some() {
        let matches = follow(&setpoints, &line, 0.0, None);
        on_the_path(&matches)?;
        matches
    } else {
        along_blocks(&setpoints, &line, &programmed, path)
    };
    if path.is_truncated() || programmed.blocks() < path.len() {
        let message =
            format!("the program is long: only its first {} blocks enter the error budget", programmed.blocks());
        budget.missing.push(Diagnostic::note("T0111", message));
    }
    budget.program_of_other = other.is_some();
    let place = |k: usize, clock: f64| {
        let block = programmed.block_at(clock);
        (!programmed.is_free(block)).then_some((setpoints.time_s(k), block))
    };
    let clock = |k: usize| matches.get(k).and_then(Option::as_ref).map(|found| found.time_s);
    let named = |block: usize| path.block(block).map(|view| program_line(&view));
    budget.interpolator = gathered(samples(&setpoints, &matches).filter_map(|(k, error_um)| {
        let (time_s, block) = place(k, clock(k)?)?;
        Some((time_s, error_um, named(block)))
    }));
    let chords_um: Vec<f64> = (0..programmed.blocks()).map(|block| programmed.chord_error_um(block)).collect();
    let straight = (0..programmed.blocks()).filter(|block| programmed.is_straight(*block));
    budget.chord = gathered(straight.map(|block| (0.0, chords_um[block], named(block)))).map(|mut part| {
        let course = (0..matches.len()).filter_map(|k| place(k, clock(k)?));
        part.course = course.map(|(time_s, block)| (time_s, chords_um[block])).collect();
        part
    });
    Ok(())
}

/// A control's set-points must lead along the program.
fn on_the_path(matches: &[Option<Match>]) -> Result<(), String> {
    let farthest_mm = matches.iter().flatten().map(|found| found.distance_mm).fold(0.0, f64::max);
    let found = matches.iter().flatten().count();
    if farthest_mm > OFF_MM || 2 * found < matches.len() {
        return Err(format!(
            "the set-points are up to {farthest_mm:.3} mm beside the program of the other file (another zero offset, tool or program?)"
        ));
    }
    Ok(())
}

/// Every set-point of a recording against the block that is executed, those that begin with it, and their neighbours.
fn along_blocks(
    setpoints: &Track,
    line: &Line,
    programmed: &ProgrammedLine,
    path: &ProgrammedPath,
) -> Vec<Option<Match>> {
    let Some(mut follower) = Follower::new(line, 0.0) else { return vec![None; setpoints.points_mm.len()] };
    let begins_s = |block: usize| path.block(block).map_or(f64::NAN, |view| view.time_s);
    let mut last = usize::MAX;
    let mut matches = Vec::with_capacity(setpoints.points_mm.len());
    for (k, point_mm) in setpoints.points_mm.iter().enumerate() {
        let block = path.index_at(setpoints.time_s(k) + TICK_SLACK_S).unwrap_or(0);
        if block >= programmed.blocks() {
            matches.push(None);
            continue;
        }
        if block != last {
            let together = (0..TOGETHER_MAX)
                .take_while(|i| block.checked_sub(i + 1).is_some_and(|before| begins_s(before) == begins_s(block)));
            let first = block - together.count();
            let [from, to] = programmed.clock(first.saturating_sub(1), block + 2);
            follower.restrict(from, to);
            last = block;
        }
        matches.push(follower.next(*point_mm).filter(|found| !found.beyond_end));
    }
    matches
}

/// Number and error of every sample that belongs somewhere.
fn samples<'a>(track: &'a Track, matches: &'a [Option<Match>]) -> impl Iterator<Item = (usize, f64)> + 'a {
    let count = track.points_mm.len();
    let found = matches.iter().enumerate().take(count);
    found.filter_map(|(k, found)| Some((k, found.as_ref()?.distance_mm * UM_PER_MM)))
}

fn gathered(samples: impl Iterator<Item = (f64, f64, Option<ProgramLine>)>) -> Option<Part> {
    let mut gathering = Gathering::default();
    let mut worst: BTreeMap<ProgramLine, f64> = BTreeMap::new();
    let mut course = Vec::new();
    for (time_s, error_um, line) in samples {
        gathering.push(time_s, error_um);
        course.push((time_s, error_um));
        if let Some(line) = line {
            let most = worst.entry(line).or_insert(0.0);
            *most = most.max(error_um);
        }
    }
    let mut worst: Vec<(ProgramLine, f64)> = worst.into_iter().collect();
    worst.retain(|(_, error_um)| *error_um >= ROUNDING_UM);
    worst.sort_by(|a, b| b.1.total_cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    worst.truncate(WORST_MAX);
    Some(Part { figures: gathering.finish()?, worst, course })
}
