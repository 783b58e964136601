//! Knobs turned until the planned motion is the traced one.
//!
//! In: traced programs on equal stretches of their paths ([`Target`]), a machine. Out: values of the knobs, the cost that is left, intervals. The cost of
//! time is the mean square of the difference of ln(feed) over the path, and that of ln(cycle time) and of the sideways
//! distances beside it; that of shape the sideways distances alone. Levenberg-Marquardt on the free numbers of the knobs, with a light pull to where they began: what the motion does not tell
//! stays there. Columns of differences are planned side by side. Does not choose words.

use super::knobs::Knob;
use super::path::PathOfTrace;
use super::profile::{CELLS, PathProfile};
use crate::base::AxisId;
use crate::interpreter::Setup;
use crate::machine::Machine;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A traced program.
pub(super) struct Target {
    pub(super) profile: PathProfile,
    /// Its set-points beside the path; `None` where that cannot be had without time.
    pub(super) path: Option<PathOfTrace>,
    pub(super) setup: Setup,
    pub(super) axes: Vec<AxisId>,
}

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Aim {
    /// The path alone.
    Shape,
    /// Feed and cycle time, and the path beside them.
    Both,
}

/// Steps of a free number for the differences: wide enough to see through the grain of the set-point cycle; where that leads no further, wider ones see past the
/// bends of limits that take turns, and narrower ones along them.
const STEPS: [f64; 3] = [0.02, 0.06, 0.007];
/// The same for what is told: wide enough to see where a limit ceases to hold.
const SIDE_STEP: f64 = 0.1;
/// Longest step of a free number in one pass: the law is bent.
pub(super) const STEP_MAX: f64 = 0.8;
/// Sideways distances are counted in this: alone, and beside ln(feed): 1 um there is as much as 1 % of feed.
const SIDEWAYS_MM: (f64, f64) = (1e-3, 0.1);
const UM_MM: f64 = 1e-3;
/// Pull to where a knob began, in RMS of ln(feed) for a free number that is off by 1.
const PULL: f64 = 2e-4;
/// Share of the mean feed below which feeds count as alike: the ends of a motion are no matter of ratios.
const FLOOR_SHARE: f64 = 0.2;
/// Damping: at the start, least, most, and what a failure and a success make of it.
const DAMPING: (f64, f64, f64) = (1e-3, 1e-7, 1e3);
const WORSE: f64 = 10.0;
const BETTER: f64 = 0.1;
/// A pass that gains less than this share of the cost was the last with its differences; one with carried columns asks for new ones below the other share.
const GAIN_SHARE: f64 = 1e-2;
const SLOW_SHARE: f64 = 0.1;
/// Pairs of dampings that are tried at most.
const TRIES: usize = 4;
/// What a free number moved by 1 does at least, in RMS, for the knob to count.
const DOES_SOMETHING: f64 = 2e-3;
/// RMS of ln(feed) that two plans of one control may differ by: a few set-point cycles in the time of a short stretch.
const GRAIN: f64 = 1e-3;
/// Correlation from which two settings count as one.
const ALIKE: f64 = 0.9;

/// A fit in progress.
#[derive(Clone)]
pub(super) struct Fit<'a> {
    /// The machine as in the file, with the words that are tried.
    pub(super) machine: Machine,
    pub(super) targets: &'a [Target],
    /// Values of all knobs that have been moved.
    pub(super) values: Vec<(Knob, f64)>,
    /// Differences of feed beyond the grain count by their logarithm: a few stretches that are far off do not hold the others.
    pub(super) by_logarithm: bool,
    /// Programs planned, by this fit and by those cloned from it.
    pub(super) plans: Arc<AtomicUsize>,
}

impl<'a> Fit<'a> {
    pub(super) fn new(machine: Machine, targets: &'a [Target]) -> Self {
        Self { machine, targets, values: Vec::new(), by_logarithm: false, plans: Arc::default() }
    }

    /// The shape of the corners is told by the paths of all programs alone.
    pub(super) fn has_paths(&self) -> bool {
        self.targets.iter().all(|target| target.path.is_some())
    }

    /// RMS of the sideways distances in um, and by how much the path moves with half of the tolerances; `None` where the paths are not known without time.
    pub(super) fn path_left_um(&self) -> Option<(f64, f64)> {
        let machine = self.machine_with(&self.values);
        let mut halved = machine.clone();
        halved.smoothing.tolerance_ratio *= 0.5;
        halved.smoothing.tolerance_reversal_ratio *= 0.5;
        let of = |machine: Machine| self.has_paths().then(|| self.residuals_of(machine, Aim::Shape)).flatten();
        let (left, moved) = (of(machine)?, of(halved)?);
        let moved: f64 = left.iter().zip(&moved).map(|(a, b)| (a - b) * (a - b)).sum();
        Some((square(&left).sqrt() * SIDEWAYS_MM.0 / UM_MM, moved.sqrt() * SIDEWAYS_MM.0 / UM_MM))
    }

    /// Programs planned until now.
    pub(super) fn plans(&self) -> usize {
        self.plans.load(Ordering::Relaxed)
    }

    pub(super) fn machine_with(&self, values: &[(Knob, f64)]) -> Machine {
        let mut machine = self.machine.clone();
        for (knob, value) in values {
            knob.set(&mut machine, *value);
        }
        machine
    }

    pub(super) fn value(&self, knob: Knob) -> f64 {
        self.values
            .iter()
            .find(|(known, _)| *known == knob)
            .map_or_else(|| knob.get(&self.machine), |(_, value)| *value)
    }

    fn with(&self, moved: &[(Knob, f64)]) -> Vec<(Knob, f64)> {
        let kept = self.values.iter().filter(|(knob, _)| moved.iter().all(|(other, _)| other != knob));
        kept.copied().chain(moved.iter().copied()).collect()
    }

    /// Residuals of given values; their sum of squares is the cost. `None` after an alarm.
    fn residuals_of(&self, machine: Machine, aim: Aim) -> Option<Vec<f64>> {
        let machine = Arc::new(machine);
        let mut all = Vec::new();
        let share = 1.0 / (self.targets.len() as f64).sqrt();
        for target in self.targets {
            if let (Aim::Shape, Some(path)) = (aim, &target.path) {
                all.extend(path.off_mm(&machine)?.iter().map(|off| off * share / SIDEWAYS_MM.0));
                continue;
            }
            self.plans.fetch_add(1, Ordering::Relaxed);
            let planned = PathProfile::planned(&machine, &target.setup, &target.axes, target.profile.time_s)?;
            if aim == Aim::Both {
                let floor = FLOOR_SHARE * target.profile.feeds_mm_s.iter().sum::<f64>() / CELLS as f64;
                let weight = share / (CELLS as f64).sqrt();
                let feeds = planned.feeds_mm_s.iter().zip(&target.profile.feeds_mm_s);
                let counts = |off: f64| if self.by_logarithm { GRAIN * (off / GRAIN).asinh() } else { off };
                all.extend(feeds.map(|(a, b)| weight * counts(((a + floor) / (b + floor)).ln())));
                all.push(share * (planned.time_s / target.profile.time_s).ln());
            }
            let unit_mm = if aim == Aim::Both { SIDEWAYS_MM.1 } else { SIDEWAYS_MM.0 };
            let weight = share / ((CELLS + 1) as f64).sqrt() / unit_mm;
            all.extend(planned.sideways_mm(&target.profile).iter().map(|off| off * weight));
        }
        all.iter().all(|r| r.is_finite()).then_some(all)
    }

    pub(super) fn residuals(&self, values: &[(Knob, f64)], aim: Aim) -> Option<Vec<f64>> {
        self.residuals_of(self.machine_with(values), aim)
    }

    /// Cost at the present values on other machines, planned side by side.
    pub(super) fn costs(&self, machines: &[Machine], aim: Aim) -> Vec<Option<f64>> {
        let with_values = |machine: &Machine| {
            let mut machine = machine.clone();
            self.values.iter().for_each(|(knob, value)| knob.set(&mut machine, *value));
            self.residuals_of(machine, aim).map(|residuals| square(&residuals))
        };
        machines.par_iter().map(with_values).collect()
    }

    /// Mean squares of what machines with other words do otherwise, at the present values; `None` after an alarm.
    pub(super) fn differences(&self, others: &[Machine], aim: Aim) -> Vec<Option<f64>> {
        let with_values = |other: &Machine| {
            let mut machine = other.clone();
            self.values.iter().for_each(|(knob, value)| knob.set(&mut machine, *value));
            machine
        };
        self.differences_of(&others.iter().map(with_values).collect::<Vec<_>>(), aim)
    }

    /// The same of machines as they are.
    pub(super) fn differences_of(&self, others: &[Machine], aim: Aim) -> Vec<Option<f64>> {
        let Some(base) = self.residuals(&self.values, aim) else { return vec![None; others.len()] };
        let difference = |machine: &Machine| {
            let moved = self.residuals_of(machine.clone(), aim)?;
            Some(base.iter().zip(&moved).map(|(a, b)| (a - b) * (a - b)).sum())
        };
        others.par_iter().map(difference).collect()
    }

    /// Columns d residuals / d free number.
    fn columns(&self, base: &[f64], knobs: &[Knob], aim: Aim, wide: f64) -> Vec<Option<Vec<f64>>> {
        let step = |knob: &Knob| {
            let now = knob.free(self.value(*knob));
            // Towards the middle of the range where there is an end of it within the step.
            if knob.free(knob.value(now + wide)) > now + wide / 2.0 { wide } else { -wide }
        };
        let steps: Vec<f64> = knobs.iter().map(step).collect();
        let of = |knob: &Knob| knobs.iter().position(|known| known == knob).map_or(wide, |place| steps[place]);
        self.slopes(base, knobs, aim, of)
    }

    /// The same with given steps; `None` for a knob that stands at an end of its range, and after an alarm.
    fn slopes(
        &self,
        base: &[f64],
        knobs: &[Knob],
        aim: Aim,
        step: impl Fn(&Knob) -> f64 + Sync,
    ) -> Vec<Option<Vec<f64>>> {
        let column = |knob: &Knob| {
            let now = knob.free(self.value(*knob));
            let moved = knob.value(now + step(knob));
            let by = knob.free(moved) - now;
            if by.abs() < 0.5 * step(knob).abs() {
                return None;
            }
            let residuals = self.residuals(&self.with(&[(*knob, moved)]), aim)?;
            Some(base.iter().zip(&residuals).map(|(a, b)| (b - a) / by).collect())
        };
        knobs.par_iter().map(column).collect()
    }

    /// Cost at the present values.
    pub(super) fn cost(&self, aim: Aim) -> Option<f64> {
        self.residuals(&self.values, aim).map(|residuals| square(&residuals))
    }

    /// Turns `knobs` until the cost is least, or below `enough`. Returns it, without the pull. Columns are planned where they must be, and between two
    /// such passes carried on by what each step shows (Broyden): a step costs a plan or two instead of one a knob.
    pub(super) fn run(&mut self, knobs: &[Knob], aim: Aim, passes: usize, enough: f64) -> Option<f64> {
        let origin: Vec<f64> = knobs.iter().map(|knob| knob.free(knob.get(&self.machine))).collect();
        let pull = |free: &[f64]| free.iter().zip(&origin).map(|(f, o)| (PULL * (f - o)).powi(2)).sum::<f64>();
        let mut free: Vec<f64> = knobs.iter().map(|knob| knob.free(self.value(*knob))).collect();
        let mut base = self.residuals(&self.values, aim)?;
        let mut damping = DAMPING.0;
        let mut columns: Option<Vec<Option<Vec<f64>>>> = None;
        let (mut fresh, mut wide) = (false, 0);
        for _ in 0..passes {
            let Some(step) = STEPS.get(wide) else { break };
            let before = square(&base) + pull(&free);
            if square(&base) < enough {
                break;
            }
            let slopes = match columns.take() {
                Some(carried) => carried,
                None => {
                    fresh = true;
                    self.columns(&base, knobs, aim, *step)
                }
            };
            let step = self.step(
                knobs,
                aim,
                &slopes,
                Place { base: &base, free: &free, origin: &origin, before },
                damping,
                fresh,
            );
            let Some((values, residuals, trial, eased)) = step else {
                wide += usize::from(fresh);
                damping = DAMPING.0;
                continue;
            };
            damping = eased;
            let gained = before - square(&residuals) - pull(&trial);
            let moved: Vec<f64> = trial.iter().zip(&free).map(|(new, old)| new - old).collect();
            // The path is quick to plan again, and too bent in its three numbers for columns that are carried on.
            columns = (aim != Aim::Shape).then(|| carried(slopes, &base, &residuals, &moved));
            (self.values, base, free) = (values, residuals, trial);
            if gained < if fresh { GAIN_SHARE } else { SLOW_SHARE } * before {
                wide += usize::from(fresh);
                columns = None;
            } else if gained > SLOW_SHARE * before {
                wide = 0;
            }
            fresh = false;
        }
        Some(square(&base))
    }

    /// The better of two steps of unlike damping, with more of it until one helps: values, residuals, free numbers, and the damping from here on.
    fn step(
        &self,
        knobs: &[Knob],
        aim: Aim,
        columns: &[Option<Vec<f64>>],
        at: Place<'_>,
        damping: f64,
        fresh: bool,
    ) -> Option<Step> {
        let pull = |free: &[f64]| free.iter().zip(at.origin).map(|(f, o)| (PULL * (f - o)).powi(2)).sum::<f64>();
        let (gram, gradient) = normal(columns, at.base, at.free, at.origin);
        let trial = |damping: f64| {
            let damped = &gram + DMatrix::from_diagonal(&gram.diagonal().map(|d| damping * (d + PULL * PULL)));
            let step = inside(&damped, &gradient, at.free, knobs)?;
            let free = (at.free.iter().zip(&step).zip(knobs))
                .map(|((f, s), knob)| knob.free(knob.value(f - s.clamp(-STEP_MAX, STEP_MAX))))
                .collect::<Vec<f64>>();
            let values = self.with(&knobs.iter().zip(&free).map(|(k, f)| (*k, k.value(*f))).collect::<Vec<_>>());
            let residuals = self.residuals(&values, aim)?;
            Some((square(&residuals) + pull(&free), (values, residuals, free, damping)))
        };
        let (mut damping, mut tries) = (damping, if fresh { TRIES } else { 1 });
        let mut found = None;
        while found.is_none() && tries > 0 && damping < DAMPING.2 {
            let both: Vec<Option<(f64, Step)>> = [damping, damping * WORSE].par_iter().map(|d| trial(*d)).collect();
            let best = both.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
            found = best.filter(|(cost, _)| *cost < at.before).map(|(_, step)| step);
            damping *= WORSE * WORSE;
            tries -= 1;
        }
        found.map(|(values, residuals, free, used)| (values, residuals, free, (used * BETTER).max(DAMPING.1)))
    }

    /// What the motion tells about each knob at the present values, below them and above; `None` after an alarm.
    pub(super) fn told(&self, knobs: &[Knob], aim: Aim) -> Option<[Told; 2]> {
        let base = self.residuals(&self.values, aim)?;
        let left = square(&base).sqrt().hypot(GRAIN);
        let mut sides = Vec::new();
        for side in [-SIDE_STEP, SIDE_STEP] {
            let columns = self.slopes(&base, knobs, aim, |_| side);
            let does = |column: &Option<Vec<f64>>| column.as_ref().is_some_and(|c| square(c).sqrt() > DOES_SOMETHING);
            let moving: Vec<usize> = (0..knobs.len()).filter(|k| does(&columns[*k])).collect();
            let picked: Vec<Option<Vec<f64>>> = moving.iter().map(|k| columns[*k].clone()).collect();
            let still = vec![0.0; moving.len()];
            let factor = normal(&picked, &base, &still, &still).0.cholesky()?;
            let place = |knob: usize| moving.iter().position(|k| *k == knob);
            sides.push(Told { places: (0..knobs.len()).map(place).collect(), inverse: factor.inverse(), left });
        }
        sides.try_into().ok()
    }
}

/// What a motion tells about knobs on one side of their values: every set of free numbers whose motion differs from the best one by no more than what that
/// leaves over is as good. What is left over is no noise, so that more of the same would not average it out. A limit that holds nothing back when it is
/// raised is told from below only.
pub(super) struct Told {
    /// Place of each knob; `None` where it moves nothing.
    places: Vec<Option<usize>>,
    inverse: DMatrix<f64>,
    left: f64,
}

impl Told {
    /// Half of the width of a sum of free numbers with weights; `None` where one of them moves nothing.
    pub(super) fn half(&self, sum: &[(usize, f64)]) -> Option<f64> {
        let mut direction = DVector::zeros(self.inverse.nrows());
        for (knob, weight) in sum {
            direction[(*self.places.get(*knob)?)?] += weight;
        }
        Some(self.left * direction.dot(&(&self.inverse * &direction)).max(0.0).sqrt())
    }

    /// The knob that acts most alike, if hardly anything tells the two apart.
    pub(super) fn twin(&self, knob: usize) -> Option<usize> {
        let own = (*self.places.get(knob)?)?;
        let alike = |other: usize| {
            self.inverse[(own, other)].abs() / (self.inverse[(own, own)] * self.inverse[(other, other)]).sqrt()
        };
        let others = self.places.iter().enumerate().filter_map(|(k, place)| Some((k, (*place)?)));
        let best = others.filter(|(k, _)| *k != knob).max_by(|a, b| alike(a.1).total_cmp(&alike(b.1)))?;
        (alike(best.1) > ALIKE).then_some(best.0)
    }
}

/// The step of the normal equations that stays inside the ranges: what would leave its range goes to the end of it, and the others are solved again with that. Cut
/// off alone, it would leave the others where they belong only together with it.
fn inside(damped: &DMatrix<f64>, gradient: &DVector<f64>, free: &[f64], knobs: &[Knob]) -> Option<Vec<f64>> {
    let p = knobs.len();
    let mut held: Vec<Option<f64>> = vec![None; p];
    loop {
        let open: Vec<usize> = (0..p).filter(|k| held[*k].is_none()).collect();
        let moved = |k: usize| held[k].unwrap_or(0.0);
        if open.is_empty() {
            return Some((0..p).map(moved).collect());
        }
        let right = DVector::from_fn(open.len(), |i, _| {
            gradient[open[i]] - (0..p).map(|k| damped[(open[i], k)] * moved(k)).sum::<f64>()
        });
        let left = DMatrix::from_fn(open.len(), open.len(), |i, j| damped[(open[i], open[j])]);
        let solved = left.cholesky()?.solve(&right);
        let mut step: Vec<f64> = (0..p).map(moved).collect();
        let mut leaves = false;
        for (k, by) in open.iter().zip(&solved) {
            let end = knobs[*k].free(knobs[*k].value(free[*k] - by));
            step[*k] = *by;
            if (free[*k] - by - end).abs() > 1e-9 {
                (held[*k], leaves) = (Some(free[*k] - end), true);
            }
        }
        if !leaves {
            return Some(step);
        }
    }
}

/// Where a step begins.
#[derive(Clone, Copy)]
struct Place<'a> {
    base: &'a [f64],
    free: &'a [f64],
    origin: &'a [f64],
    before: f64,
}

/// Values, residuals, free numbers, damping.
type Step = (Vec<(Knob, f64)>, Vec<f64>, Vec<f64>, f64);

/// The columns with what a step has shown: the smallest change that explains it (Broyden).
fn carried(columns: Vec<Option<Vec<f64>>>, old: &[f64], new: &[f64], moved: &[f64]) -> Vec<Option<Vec<f64>>> {
    let size = square(moved);
    if size <= 0.0 {
        return columns;
    }
    let mut missing: Vec<f64> = new.iter().zip(old).map(|(new, old)| new - old).collect();
    for (column, moved) in columns.iter().zip(moved) {
        let Some(column) = column else { continue };
        missing.iter_mut().zip(column).for_each(|(missing, slope)| *missing -= slope * moved);
    }
    let add = |(column, moved): (Option<Vec<f64>>, &f64)| {
        let share = moved / size;
        column.map(|column| column.iter().zip(&missing).map(|(slope, missing)| slope + share * missing).collect())
    };
    columns.into_iter().zip(moved).map(add).collect()
}

fn square(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

/// JᵀJ and Jᵀr with the pull.
fn normal(columns: &[Option<Vec<f64>>], base: &[f64], free: &[f64], origin: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
    let dot = |a: &Option<Vec<f64>>, b: &[f64]| {
        a.as_ref().map_or(0.0, |column| column.iter().zip(b).map(|(a, b)| a * b).sum::<f64>())
    };
    let p = columns.len();
    let gram = DMatrix::from_fn(p, p, |i, j| {
        columns[j].as_ref().map_or(0.0, |other| dot(&columns[i], other)) + if i == j { PULL * PULL } else { 0.0 }
    });
    let gradient = DVector::from_fn(p, |i, _| dot(&columns[i], base) + PULL * PULL * (free[i] - origin[i]));
    (gram, gradient)
}
