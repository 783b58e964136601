//! Knobs turned until the planned motion is the traced one.
//!
//! In: traced programs on equal stretches of their paths ([`Target`]), a machine. Out: values of the knobs, the cost that is left, intervals. The cost of
//! time is the mean square of the difference of ln(feed) over the path, and that of ln(cycle time) and of the sideways
//! distances beside it; that of shape the sideways distances alone. Levenberg-Marquardt on the free numbers of the knobs, with a light pull to where they began: what the motion does not tell
//! stays there. Columns of differences are planned side by side. Does not choose words.

use super::knobs::Knob;
use super::normal::{Blocks, Solution};
use super::profile::{CELLS, PathProfile};
use crate::base::AxisId;
use crate::interpreter::Setup;
use crate::machine::Machine;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::sync::Arc;

/// A traced program.
pub(super) struct Target {
    pub(super) profile: PathProfile,
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

/// Step of a free number for the differences: wide enough to see through the grain of the set-point cycle.
const STEP: f64 = 0.02;
/// Longest step of a free number in one pass: the law is bent.
const STEP_MAX: f64 = 0.8;
/// Sideways distances are counted in this: alone, and beside ln(feed): 1 um there is as much as 1 % of feed.
const SIDEWAYS_MM: (f64, f64) = (1e-3, 0.1);
/// Pull to where a knob began, in RMS of ln(feed) for a free number that is off by 1.
const PULL: f64 = 2e-4;
/// Share of the mean feed below which feeds count as alike: the ends of a motion are no matter of ratios.
const FLOOR_SHARE: f64 = 0.05;
/// Damping: at the start, least, most, and what a failure and a success make of it.
const DAMPING: (f64, f64, f64) = (1e-3, 1e-7, 1e3);
const WORSE: f64 = 6.0;
const BETTER: f64 = 0.2;
/// A pass that gains less than this share of the cost was the last.
const GAIN_SHARE: f64 = 1e-3;
/// Stretches of a block.
const BLOCK: usize = 60;
/// What a free number moved by 1 does at least, in RMS, for the knob to count.
const DOES_SOMETHING: f64 = 2e-3;
/// Condition from which two settings count as one.
const ALIKE: f64 = 40.0;

/// A fit in progress.
#[derive(Clone)]
pub(super) struct Fit<'a> {
    /// The machine as in the file, with the words that are tried.
    pub(super) machine: Machine,
    pub(super) targets: &'a [Target],
    /// Values of all knobs that have been moved.
    pub(super) values: Vec<(Knob, f64)>,
    pub(super) plans: usize,
}

impl Fit<'_> {
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
            let planned = PathProfile::planned(&machine, &target.setup, &target.axes)?;
            if aim == Aim::Both {
                let floor = FLOOR_SHARE * target.profile.feeds_mm_s.iter().sum::<f64>() / CELLS as f64;
                let weight = share / (CELLS as f64).sqrt();
                let feeds = planned.feeds_mm_s.iter().zip(&target.profile.feeds_mm_s);
                all.extend(feeds.map(|(a, b)| weight * ((a + floor) / (b + floor)).ln()));
                all.push(share * (planned.time_s / target.profile.time_s).ln());
            }
            let unit_mm = if aim == Aim::Both { SIDEWAYS_MM.1 } else { SIDEWAYS_MM.0 };
            let weight = share / ((CELLS + 1) as f64).sqrt() / unit_mm;
            all.extend(planned.sideways_mm(&target.profile).iter().map(|off| off * weight));
        }
        all.iter().all(|r| r.is_finite()).then_some(all)
    }

    fn residuals(&self, values: &[(Knob, f64)], aim: Aim) -> Option<Vec<f64>> {
        self.residuals_of(self.machine_with(values), aim)
    }

    /// Cost at the present values on other machines, planned side by side.
    pub(super) fn costs(&mut self, machines: &[Machine], aim: Aim) -> Vec<Option<f64>> {
        self.plans += machines.len() * self.targets.len();
        let with_values = |machine: &Machine| {
            let mut machine = machine.clone();
            self.values.iter().for_each(|(knob, value)| knob.set(&mut machine, *value));
            self.residuals_of(machine, aim).map(|residuals| square(&residuals))
        };
        machines.par_iter().map(with_values).collect()
    }

    /// Mean squares of what machines with other words do otherwise, at the present values; `None` after an alarm.
    pub(super) fn differences(&mut self, others: &[Machine], aim: Aim) -> Vec<Option<f64>> {
        self.plans += (others.len() + 1) * self.targets.len();
        let Some(base) = self.residuals(&self.values, aim) else { return vec![None; others.len()] };
        let difference = |other: &Machine| {
            let mut machine = other.clone();
            self.values.iter().for_each(|(knob, value)| knob.set(&mut machine, *value));
            let moved = self.residuals_of(machine, aim)?;
            Some(base.iter().zip(&moved).map(|(a, b)| (a - b) * (a - b)).sum())
        };
        others.par_iter().map(difference).collect()
    }

    /// Columns d residuals / d free number.
    fn columns(&mut self, base: &[f64], knobs: &[Knob], aim: Aim) -> Vec<Option<Vec<f64>>> {
        self.plans += knobs.len() * self.targets.len();
        let column = |knob: &Knob| {
            let now = knob.free(self.value(*knob));
            // Towards the middle of the range where there is an end of it.
            let step = if knob.value(now + STEP) > knob.value(now) * (1.0 + STEP / 1e3) { STEP } else { -STEP };
            let values = self.with(&[(*knob, knob.value(now + step))]);
            let moved = self.residuals(&values, aim)?;
            Some(base.iter().zip(&moved).map(|(a, b)| (b - a) / step).collect())
        };
        knobs.par_iter().map(column).collect()
    }

    /// Cost at the present values.
    pub(super) fn cost(&mut self, aim: Aim) -> Option<f64> {
        self.plans += self.targets.len();
        self.residuals(&self.values, aim).map(|residuals| square(&residuals))
    }

    /// Turns `knobs` until the cost is least, or below `enough`. Returns it, without the pull.
    pub(super) fn run(&mut self, knobs: &[Knob], aim: Aim, passes: usize, enough: f64) -> Option<f64> {
        self.plans += self.targets.len();
        let origin: Vec<f64> = knobs.iter().map(|knob| knob.free(knob.get(&self.machine))).collect();
        let pull = |free: &[f64]| free.iter().zip(&origin).map(|(f, o)| (PULL * (f - o)).powi(2)).sum::<f64>();
        let mut free: Vec<f64> = knobs.iter().map(|knob| knob.free(self.value(*knob))).collect();
        let mut base = self.residuals(&self.values, aim)?;
        let mut damping = DAMPING.0;
        for _ in 0..passes {
            let before = square(&base) + pull(&free);
            if square(&base) < enough {
                break;
            }
            let columns = self.columns(&base, knobs, aim);
            let (gram, gradient) = normal(&columns, &base, &free, &origin);
            let mut better = None;
            while better.is_none() && damping < DAMPING.2 {
                let damped = &gram + DMatrix::from_diagonal(&gram.diagonal().map(|d| damping * (d + PULL * PULL)));
                let Some(step) = damped.cholesky().map(|factor| factor.solve(&gradient)) else { break };
                let trial: Vec<f64> = (free.iter().zip(&step).zip(knobs))
                    .map(|((f, s), knob)| knob.free(knob.value(f - s.clamp(-STEP_MAX, STEP_MAX))))
                    .collect();
                let values = self.with(&knobs.iter().zip(&trial).map(|(k, f)| (*k, k.value(*f))).collect::<Vec<_>>());
                self.plans += self.targets.len();
                better = self
                    .residuals(&values, aim)
                    .filter(|r| square(r) + pull(&trial) < before)
                    .map(|residuals| (values, residuals, trial));
                damping = if better.is_some() { (damping * BETTER).max(DAMPING.1) } else { damping * WORSE };
            }
            let Some((values, residuals, trial)) = better else { break };
            (self.values, base, free) = (values, residuals, trial);
            if before - square(&base) - pull(&free) < GAIN_SHARE * before {
                break;
            }
        }
        Some(square(&base))
    }

    /// Normal equations in blocks at the present values: for each knob its place in the solution, or why it is not in it.
    pub(super) fn solution(&mut self, knobs: &[Knob], aim: Aim) -> (Option<Solution>, Vec<Result<usize, Idle>>) {
        self.plans += self.targets.len();
        let Some(base) = self.residuals(&self.values, aim) else {
            return (None, knobs.iter().map(|_| Err(Idle::Still)).collect());
        };
        let columns = self.columns(&base, knobs, aim);
        let moving: Vec<usize> = (0..knobs.len())
            .filter(|k| columns[*k].as_ref().is_some_and(|column| square(column).sqrt() > DOES_SOMETHING))
            .collect();
        let mut blocks = Blocks::new(moving.len());
        let numbers = self.targets.iter().enumerate().flat_map(|(place, target)| {
            let columns = if target.profile.places_mm.is_empty() { 0 } else { target.axes.len() };
            let feeds = (0..=CELLS).map(move |row| (place, 0, row / BLOCK));
            let path = (0..(CELLS + 1) * columns).map(move |row| (place, 1, row / (BLOCK * columns)));
            let feeds = feeds.filter(move |_| aim == Aim::Both);
            feeds.chain(path)
        });
        let mut open = None;
        for ((k, r), number) in base.iter().enumerate().zip(numbers) {
            if open.is_some_and(|open| open != number) {
                blocks.close();
            }
            open = Some(number);
            let row: Vec<f64> = moving.iter().filter_map(|place| columns[*place].as_ref()).map(|c| c[k]).collect();
            blocks.push_in(number.2, &row, -r);
        }
        let apart = told_apart(&blocks, moving.len());
        let of = |knob: usize| {
            let column = moving.iter().position(|place| *place == knob).ok_or(Idle::Still)?;
            apart.iter().position(|place| *place == column).ok_or(Idle::Alike)
        };
        (blocks.solve(&apart), (0..knobs.len()).map(of).collect())
    }
}

/// Why a knob is not told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Idle {
    /// It moves nothing.
    Still,
    /// It moves what others move.
    Alike,
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

/// Columns that are told apart, the first ones first: shares and jerks may act as one product.
fn told_apart(blocks: &Blocks, width: usize) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    for column in 0..width {
        let trial: Vec<usize> = kept.iter().copied().chain([column]).collect();
        if blocks.solve(&trial).is_some_and(|solution| solution.condition < ALIKE) {
            kept = trial;
        }
    }
    kept
}
