//! Axes that are tuned together, and the whole of a tuning.
//!
//! In: machine, courses, options. Out: [`Tuned`]. The axes that move the tool are one group with one delay, whatever the objective: delays of
//! their own would bend every path between them. Every other axis is its own group. An angle of a rotary axis in the group counts with
//! [`LEVER_MM`]. New gains are taken only if they are better on the courses for tuning by more than chance: a paired
//! look at blocks of [`BLOCK_S`] decides, and 2 % (contour: 10 %) are the least, so that tuning does not chase single friction events.

use super::certainty::{Certainty, certainty};
use super::contour::{Tool, moves_tool};
use super::course::{AxisCourse, Course};
use super::figures::{CourseFigures, Sensitivity, course_figures, sensitivities};
use super::fit::{Point, gauss_newton, points, scan};
use super::gains::{Gain, Gains, range};
use super::landscape::{Map, maps};
use super::notes::{apart, outside};
use super::search::search;
use super::simulate::{Job, calibrate, responses};
use super::{Measure, Objective, TuneOptions};
use crate::base::{AxisId, AxisKind, Diagnostic};
use crate::machine::{DriveData, Machine};
use rayon::prelude::*;

/// Residuals further apart than this count as independent of each other.
pub(super) const BLOCK_S: f64 = 0.25;
/// Improvement in standard errors of its mean over blocks that is not chance.
const CERTAIN_ERRORS: f64 = 1.65;
/// RMS after over before above which a change is not worth it: it is lost on the next program. Most of a contour error is what friction does at
/// reversals: an improvement there of less than a tenth has made other programs worse.
const WORTH_RATIO: f64 = 0.98;
const WORTH_CONTOUR_RATIO: f64 = 0.9;
/// What an angle moves: the radius of a part, so that mm and rad can stand in one sum.
const LEVER_MM: f64 = 100.0;

/// What came of it.
#[derive(Clone, Debug)]
pub struct Tuned {
    /// In order of the machine.
    pub axes: Vec<TunedAxis>,
    /// Courses for tuning first, then those for validation.
    pub courses: Vec<CourseFigures>,
    /// ±10 %, one at a time.
    pub sensitivities: Vec<Sensitivity>,
    /// Maps around the optimum, if asked for.
    pub landscapes: Vec<Landscape>,
    /// What a person should know.
    pub warnings: Vec<Diagnostic>,
    /// Drives simulated over a course.
    pub simulations: usize,
}

/// Gains of an axis.
#[derive(Clone, Debug)]
pub struct TunedAxis {
    /// Which.
    pub axis: AxisId,
    /// Its name.
    pub name: String,
    /// Linear or rotary.
    pub kind: AxisKind,
    /// Each gain that was free.
    pub gains: Vec<TunedGain>,
    /// Axes that share the delay, this one included; one name without any.
    pub together: Vec<String>,
}

/// One gain, in the unit of its key.
#[derive(Clone, Debug)]
pub struct TunedGain {
    /// Which.
    pub gain: Gain,
    /// Before.
    pub before: f64,
    /// After.
    pub value: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// It stands at a bound.
    pub at_bound: bool,
    /// The courses say something about it; else it is what theory or the machine says.
    pub certain: bool,
}

/// A map with its axis.
#[derive(Clone, Debug)]
pub struct Landscape {
    /// Name of the axis.
    pub axis: String,
    /// The map.
    pub map: Map,
}

/// An axis of a group.
pub(super) struct Member {
    pub axis: AxisId,
    pub data: DriveData,
    pub ranges: Vec<(Gain, [f64; 2])>,
}

/// A number that is searched: a gain of one member, or of all.
pub(super) struct Slot {
    pub gain: Gain,
    pub members: Vec<usize>,
    pub range: [f64; 2],
    /// The bounds are the user's: what the machine has must be inside them too.
    pub binds: bool,
}

/// Axes tuned together.
pub(super) struct Group<'a> {
    pub machine: &'a Machine,
    pub courses: &'a [Course],
    pub tool: &'a Tool,
    /// Of every course.
    pub paths_mm: &'a [Vec<[f64; 3]>],
    pub members: Vec<Member>,
    pub slots: Vec<Slot>,
    pub objective: Objective,
    pub measure: Measure,
    pub simulations: std::sync::atomic::AtomicUsize,
}

/// How good a set of gains is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Score {
    /// Mean of the courses.
    pub mean_square: f64,
    pub peak: f64,
}

/// Residuals of one candidate on one course: `components` numbers a tick.
pub(super) struct Residual {
    pub of: Vec<f64>,
    pub components: usize,
    pub period_s: f64,
}

impl Residual {
    /// Sum of squares, number of ticks, largest amount.
    pub fn figures(&self) -> (f64, usize, f64) {
        let squares = self.of.chunks(self.components).map(|tick| tick.iter().map(|part| part * part).sum::<f64>());
        let (sum, largest) = squares.fold((0.0, 0.0_f64), |(sum, largest), square| (sum + square, largest.max(square)));
        (sum, self.of.len() / self.components, largest.sqrt())
    }
}

impl Group<'_> {
    /// Gains as the machine has them.
    pub fn before(&self) -> Vec<Gains> {
        self.members.iter().map(|member| Gains::of(&member.data)).collect()
    }

    /// Gains as theory has them, inside the bounds.
    pub fn theory(&self) -> Vec<Gains> {
        let time_base = &self.machine.cycle.time_base;
        let mut all: Vec<Gains> = self
            .members
            .iter()
            .map(|member| {
                let free: Vec<Gain> = member.ranges.iter().map(|(gain, _)| *gain).collect();
                let position_s = time_base.seconds(member.data.position_cycle_ticks);
                let speed_s = time_base.seconds(member.data.speed_cycle_ticks);
                Gains::of_theory(&member.data, position_s, speed_s, &free)
            })
            .collect();
        for slot in &self.slots {
            let mean =
                slot.members.iter().map(|member| all[*member].get(slot.gain)).sum::<f64>() / slot.members.len() as f64;
            self.put(&mut all, slot, mean);
        }
        all
    }

    /// The value of a slot.
    pub fn value(&self, gains: &[Gains], slot: &Slot) -> f64 {
        slot.members.first().map_or(0.0, |member| gains[*member].get(slot.gain))
    }

    /// Sets a slot, inside its bounds.
    pub fn put(&self, gains: &mut [Gains], slot: &Slot, inside: f64) {
        for member in &slot.members {
            gains[*member] = gains[*member].with(slot.gain, inside.clamp(slot.range[0], slot.range[1]));
        }
    }

    /// Residuals, `[course][candidate]`; data sets that several candidates share are simulated once.
    pub fn residuals(&self, candidates: &[Vec<Gains>]) -> Vec<Vec<Residual>> {
        let mut distinct: Vec<Vec<Gains>> = vec![Vec::new(); self.members.len()];
        let mut places: Vec<Vec<usize>> = Vec::with_capacity(candidates.len());
        for candidate in candidates {
            let of_candidate = candidate.iter().enumerate().map(|(member, gains)| {
                let known = &mut distinct[member];
                known.iter().position(|other| other == gains).unwrap_or_else(|| {
                    known.push(*gains);
                    known.len() - 1
                })
            });
            places.push(of_candidate.collect());
        }
        let mut jobs = Vec::new();
        for course in self.courses {
            for (member, gains) in self.members.iter().zip(&distinct) {
                let place = course.axes.iter().position(|axis| axis.axis == member.axis).unwrap_or(usize::MAX);
                jobs.push(Job { course, place, data: gains.iter().map(|gains| gains.applied(&member.data)).collect() });
            }
        }
        let count: usize = jobs.iter().map(|job| job.data.len()).sum();
        self.simulations.fetch_add(count, std::sync::atomic::Ordering::Relaxed);
        let simulated = responses(self.machine, &jobs);
        let of_course = |number: usize| &simulated[number * self.members.len()..(number + 1) * self.members.len()];
        let all: Vec<(usize, &Vec<usize>)> =
            (0..self.courses.len()).flat_map(|number| places.iter().map(move |place| (number, place))).collect();
        let residual = |(number, place): &(usize, &Vec<usize>)| {
            self.residual(*number, &self.courses[*number], of_course(*number), place)
        };
        let mut residuals: Vec<Residual> = all.par_iter().map(residual).collect();
        let mut by_course = Vec::with_capacity(self.courses.len());
        for _ in self.courses {
            let rest = residuals.split_off(candidates.len().min(residuals.len()));
            by_course.push(std::mem::replace(&mut residuals, rest));
        }
        by_course
    }

    fn residual(
        &self,
        number: usize,
        course: &Course,
        simulated: &[Vec<super::simulate::Response>],
        place: &[usize],
    ) -> Residual {
        let setpoint_s = self.machine.cycle.time_base.setpoint_period_s();
        let found = self.members.iter().enumerate().filter_map(|(member, known)| {
            let of_axis = course.axes.iter().find(|axis| axis.axis == known.axis)?;
            Some((of_axis, simulated[member].get(place[member])?))
        });
        if self.objective == Objective::Contour {
            let lags: Vec<(AxisId, usize, &[f64])> = found
                .map(|(of_axis, response)| (of_axis.axis, of_axis.steps, response.following_lu.as_slice()))
                .collect();
            let of = self.tool.errors_mm(course, &self.paths_mm[number], &lags);
            return Residual { of, components: 3, period_s: setpoint_s };
        }
        let found: Vec<(&AxisCourse, &[f64])> = found
            .map(|(of_axis, response)| match self.objective {
                Objective::Following => (of_axis, response.following_lu.as_slice()),
                _ => (of_axis, response.deviation_lu.as_slice()),
            })
            .collect();
        let (of, steps) = self.rows(&found);
        Residual { of, components: self.members.len(), period_s: setpoint_s / steps as f64 }
    }

    /// Errors of all members, a number of each in a row, at the position cycle of the slowest; 0 where a trace lacks an axis. And the rows in t_s.
    fn rows(&self, found: &[(&AxisCourse, &[f64])]) -> (Vec<f64>, usize) {
        let steps = found.iter().map(|(of_axis, _)| of_axis.steps).min().unwrap_or(1).max(1);
        let rows = found.iter().map(|(of_axis, of)| of.len() * steps / of_axis.steps.max(1)).min().unwrap_or(0);
        let count = self.members.len();
        let mut all = vec![0.0; rows * count];
        for (of_axis, of) in found {
            let Some(member) = self.members.iter().position(|member| member.axis == of_axis.axis) else { continue };
            let rotary = self.machine.axis(of_axis.axis).kind == AxisKind::Rotary;
            let weight = if rotary && count > 1 { LEVER_MM } else { 1.0 };
            for (row, error_lu) in of.iter().step_by(of_axis.steps / steps).take(rows).enumerate() {
                if let Some(place) = all.get_mut(row * count + member) {
                    *place = weight * error_lu;
                }
            }
        }
        (all, steps)
    }

    /// The component of a residual that belongs to a slot alone, if there is one.
    pub fn component(&self, slot: &Slot) -> Option<usize> {
        match slot.members.as_slice() {
            [only] if self.objective != Objective::Contour => Some(*only),
            _ => None,
        }
    }

    /// Scores of candidates.
    pub fn scores(&self, candidates: &[Vec<Gains>]) -> Vec<Score> {
        let residuals = self.residuals(candidates);
        (0..candidates.len()).map(|candidate| score(residuals.iter().map(|course| &course[candidate]))).collect()
    }

    /// What is to be small.
    pub fn figure(&self, score: &Score) -> f64 {
        match self.measure {
            Measure::Rms => score.mean_square,
            // Equal peaks are told apart by the rest.
            Measure::Peak => score.peak + 1e-3 * score.mean_square.sqrt(),
        }
    }

    /// Rounded as written to a file.
    fn rounded(&self, gains: &[Gains]) -> Vec<Gains> {
        let mut rounded = gains.to_vec();
        for slot in &self.slots {
            let kind = slot
                .members
                .first()
                .map_or(AxisKind::Linear, |member| self.machine.axis(self.members[*member].axis).kind);
            let inside = slot.gain.rounded(kind, self.value(gains, slot));
            self.put(&mut rounded, slot, inside);
        }
        rounded
    }

    /// Whether new gains are better than old ones by more than chance.
    fn better(&self, old: &Point, new: &Point) -> bool {
        if self.measure == Measure::Peak {
            return self.figure(&new.score) < self.figure(&old.score);
        }
        let worth = if self.objective == Objective::Contour { WORTH_CONTOUR_RATIO } else { WORTH_RATIO };
        let of_blocks = |point: &Point| -> Vec<f64> {
            point.normal.blocks.iter().map(|block| block.errors.iter().sum::<f64>()).collect()
        };
        let differences: Vec<f64> = of_blocks(old).iter().zip(of_blocks(new)).map(|(old, new)| old - new).collect();
        let count = differences.len().max(2) as f64;
        let mean = differences.iter().sum::<f64>() / count;
        let variance = differences.iter().map(|one| (one - mean) * (one - mean)).sum::<f64>() / (count - 1.0);
        new.score.mean_square < worth * worth * old.score.mean_square
            && mean > CERTAIN_ERRORS * (variance / count).sqrt()
    }

    /// Gains inside the bounds; `binding`: only inside those that the user gave.
    fn inside(&self, mut gains: Vec<Gains>, binding: bool) -> Vec<Gains> {
        for slot in self.slots.iter().filter(|slot| slot.binds || !binding) {
            for member in &slot.members {
                let own = gains[*member].get(slot.gain).clamp(slot.range[0], slot.range[1]);
                gains[*member] = gains[*member].with(slot.gain, own);
            }
        }
        gains
    }

    /// The least mean square, from both starts and over the bounds; then the peak, and what is not affine.
    fn found(&self, starts: Vec<Vec<Gains>>, theory: &[Gains]) -> Option<(Point, Point)> {
        let (before, mut best) = gauss_newton(self, starts, theory)?;
        if let Some(elsewhere) = scan(self, &best.gains, &best.score)
            && let Some((_, other)) = gauss_newton(self, vec![elsewhere], theory)
            && other.score.mean_square < best.score.mean_square
        {
            best = other;
        }
        let pulses = self.slots.iter().any(|slot| matches!(slot.gain, Gain::Friction | Gain::FrictionTime));
        if self.measure == Measure::Peak || pulses {
            let gains = search(self, best.gains.clone(), best.score);
            if gains != best.gains {
                best = points(self, vec![gains], theory).pop()?;
            }
        }
        Some((before, best))
    }

    /// New gains, and how certain they are.
    fn tuned(&self) -> (Vec<Gains>, Vec<Certainty>, Option<&'static str>) {
        // The usual bounds are for the search: gains of the machine outside them may stay.
        let before = self.inside(self.before(), true);
        let theory = self.theory();
        // Axes that had delays of their own start with one: that of the first.
        let mut start = self.inside(before.clone(), false);
        self.slots.iter().for_each(|slot| self.put(&mut start, slot, self.value(&before, slot)));
        let is_elsewhere = start != before;
        let starts = if theory == start { vec![start] } else { vec![start, theory.clone()] };
        let Some((mut old, new)) = self.found(starts, &theory) else { return (before, Vec::new(), None) };
        if is_elsewhere && let Some(point) = points(self, vec![before.clone()], &theory).pop() {
            old = point;
        }
        let found = self.rounded(&new.gains);
        let new_certainty = certainty(self, &new, &theory);
        // A common delay that the paths do not tell runs along the ridge of 7.3, and is wrong on the next program.
        let untold = self.objective == Objective::Contour
            && new_certainty
                .iter()
                .zip(&self.slots)
                .any(|(certainty, slot)| slot.gain == Gain::Delay && !certainty.certain);
        let kept = if found == before {
            Some(if before == self.before() {
                "the best gains found are those of the machine"
            } else {
                "the best gains found are those of the machine, brought inside the bounds of --bound"
            })
        } else if untold {
            Some("the paths do not tell the common delay, and without it the other gains say nothing: kept")
        } else if !self.better(&old, &new) {
            Some("no gains are better than those of the machine by more than chance, and by enough to last: kept")
        } else {
            None
        };
        // Of gains that stay the interval is that of the best ones, and holds them.
        let gains = if kept.is_some() { before } else { found };
        let extended = |(slot, certainty): (&Slot, Certainty)| {
            let value = self.value(&gains, slot);
            Certainty { low: certainty.low.min(value), high: certainty.high.max(value), ..certainty }
        };
        let certainty = self.slots.iter().zip(new_certainty).map(extended).collect();
        (gains, certainty, kept)
    }
}

/// Over courses.
pub(super) fn score<'r>(residuals: impl Iterator<Item = &'r Residual>) -> Score {
    let (mut sum, mut courses, mut peak) = (0.0, 0, 0.0_f64);
    for residual in residuals {
        let (square, ticks, largest) = residual.figures();
        sum += square / ticks.max(1) as f64;
        courses += 1;
        peak = peak.max(largest);
    }
    Score { mean_square: sum / f64::from(courses.max(1)), peak }
}

/// Tunes. Errors: nothing to tune.
pub fn tune(
    machine: &Machine,
    mut courses: Vec<Course>,
    options: &TuneOptions,
    tell: &mut dyn FnMut(&str),
) -> Result<Tuned, Diagnostic> {
    calibrate(machine, &mut courses);
    courses.sort_by_key(|course| course.validates);
    let training = courses.iter().filter(|course| !course.validates).count();
    let tool = Tool::new(machine);
    let paths_mm: Vec<Vec<[f64; 3]>> = courses.iter().map(|course| tool.path_mm(course)).collect();
    let (mut warnings, mut axes, mut landscapes, mut simulations) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for course in &courses {
        warnings.extend(course.warnings.iter().cloned());
    }
    let mut after: Vec<(AxisId, Gains)> = Vec::new();
    let groups = groups(machine, &courses[..training], options)?;
    for (number, members) in groups.iter().enumerate() {
        let names: Vec<&str> = members.iter().map(|axis| machine.axis(*axis).name.as_str()).collect();
        tell(&format!("{} ({} of {})", names.join(", "), number + 1, groups.len()));
        let own_objective = match options.objective {
            Objective::Contour if !members.iter().all(|axis| moves_tool(machine, *axis)) => Objective::Deviation,
            objective => objective,
        };
        let group = group(machine, &courses[..training], &tool, &paths_mm, members, own_objective, options);
        let (gains, certainty, kept) = group.tuned();
        warnings.extend(outside(&group));
        if let Some(why) = kept {
            warnings.push(Diagnostic::note("U0003", format!("{}: {why}", names.join(", "))));
        }
        axes.extend(tuned_axes(&group, &gains, &certainty));
        after.extend(members.iter().copied().zip(gains.iter().copied()));
        if options.landscape {
            landscapes.extend(maps(&group, &gains));
        }
        simulations += group.simulations.load(std::sync::atomic::Ordering::Relaxed);
    }
    axes.sort_by_key(|axis| axis.axis);
    for axis in &axes {
        for gain in axis.gains.iter().filter(|gain| !gain.certain) {
            let message = format!("{}: the courses do not tell {}", axis.name, gain.gain.key(axis.kind));
            let help = "it is as theory has it, or as it was: tune on a course with more acceleration and reversals of this axis";
            warnings.push(Diagnostic::note("U0004", message).help(help));
        }
    }
    warnings.extend(apart(machine, &after));
    tell("figures");
    let figures = course_figures(machine, &courses, &tool, &paths_mm, &after, options.objective);
    let sensitivities = sensitivities(machine, &courses[..training], &tool, &paths_mm, &after, options.objective);
    Ok(Tuned { axes, courses: figures, sensitivities, landscapes, warnings, simulations })
}

/// Axes with a drive that move, one group or one each.
fn groups(machine: &Machine, training: &[Course], options: &TuneOptions) -> Result<Vec<Vec<AxisId>>, Diagnostic> {
    let wanted = |axis: &AxisId| {
        let name = &machine.axis(*axis).name;
        options.axes.is_empty() || options.axes.iter().any(|wanted| wanted == name)
    };
    let moving: Vec<AxisId> = machine
        .axis_ids()
        .filter(wanted)
        .filter(|axis| {
            training.iter().flat_map(|course| &course.axes).any(|of_axis| of_axis.axis == *axis && of_axis.moves)
        })
        .collect();
    if moving.is_empty() {
        let message = "no axis with a drive moves: there is nothing to tune";
        return Err(Diagnostic::error("U0002", message)
            .help("name a program that moves axes with [axes.*.drive]; --axis names them"));
    }
    let (together, alone): (Vec<AxisId>, Vec<AxisId>) = moving.into_iter().partition(|axis| moves_tool(machine, *axis));
    let mut groups: Vec<Vec<AxisId>> = if together.is_empty() { Vec::new() } else { vec![together] };
    groups.extend(alone.into_iter().map(|axis| vec![axis]));
    Ok(groups)
}

fn group<'a>(
    machine: &'a Machine,
    courses: &'a [Course],
    tool: &'a Tool,
    paths_mm: &'a [Vec<[f64; 3]>],
    axes: &[AxisId],
    objective: Objective,
    options: &TuneOptions,
) -> Group<'a> {
    let members: Vec<Member> = axes
        .iter()
        .filter_map(|id| {
            let axis = machine.axis(*id);
            let data = axis.drive.clone()?;
            let position_cycle_s = machine.cycle.time_base.seconds(data.position_cycle_ticks);
            let pulses = options.gains.contains(&Gain::Friction) || data.options.friction_pulse_lu_s > 0.0;
            let idle = |gain: &Gain| match gain {
                Gain::Torque => data.feedforward_inertia_kg_m2 == 0.0,
                // A pulse of 0 has no time.
                Gain::FrictionTime => !pulses,
                _ => false,
            };
            let free = Gain::ALL.into_iter().filter(|gain| options.gains.contains(gain) && !idle(gain));
            // Without friction there is nothing to compensate.
            let ranges = free
                .map(|gain| (gain, range(options, gain, axis, &data, position_cycle_s)))
                .filter(|(_, range)| range[1] > range[0])
                .collect();
            Some(Member { axis: *id, data, ranges })
        })
        .collect();
    let binds = |gain: &Gain| options.bounds.iter().any(|(bounded, _)| bounded == gain);
    let mut slots: Vec<Slot> = Vec::new();
    for (place, member) in members.iter().enumerate() {
        for (gain, range) in &member.ranges {
            let shared = *gain == Gain::Delay;
            match slots.iter_mut().find(|slot| shared && slot.gain == Gain::Delay) {
                Some(slot) => slot.members.push(place),
                None => slots.push(Slot { gain: *gain, members: vec![place], range: *range, binds: binds(gain) }),
            }
        }
    }
    let measure = options.measure;
    Group { machine, courses, tool, paths_mm, members, slots, objective, measure, simulations: Default::default() }
}

fn tuned_axes(group: &Group<'_>, gains: &[Gains], certainty: &[Certainty]) -> Vec<TunedAxis> {
    let before = group.before();
    let name = |member: usize| group.machine.axis(group.members[member].axis).name.clone();
    let of_member = |(place, member): (usize, &Member)| {
        let kind = group.machine.axis(member.axis).kind;
        let mut together = vec![name(place)];
        let mut of_axis = Vec::new();
        for (slot, certainty) in group.slots.iter().zip(certainty).filter(|(slot, _)| slot.members.contains(&place)) {
            let shown = |inside: f64| slot.gain.shown(kind, inside);
            let inside = gains[place].get(slot.gain);
            let margin = 1e-6 * (slot.range[1] - slot.range[0]);
            if slot.members.len() > 1 {
                together = slot.members.iter().map(|member| name(*member)).collect();
            }
            of_axis.push(TunedGain {
                gain: slot.gain,
                before: shown(before[place].get(slot.gain)),
                value: shown(inside),
                low: shown(certainty.low),
                high: shown(certainty.high),
                at_bound: slot.range.iter().any(|bound| (inside - bound).abs() <= margin),
                certain: certainty.certain,
            });
        }
        of_axis.sort_by_key(|tuned| tuned.gain as usize);
        TunedAxis { axis: member.axis, name: name(place), kind, gains: of_axis, together }
    };
    group.members.iter().enumerate().map(of_member).collect()
}
