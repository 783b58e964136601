//! The shape of corners: end tangents, tolerance ratios and the curve, from the path alone.
//!
//! In: a [`Fit`] with the numbers of the file. Out: the same with the shape that leaves the least over; whether the path tells the curve. Begun from the
//! numbers of the file; if these do not end where nothing is left over, from the best places of a grid over all of them, and with each curve.
//! Does not look at the feed.

use super::knobs::{Knob, Switch};
use super::search::{Aim, Fit, STEP_MAX};
use crate::machine::Machine;
use rayon::prelude::*;

/// Steps at most, and those after which one of several starts is chosen.
const PASSES: usize = 25;
const FIRST_PASSES: usize = 3;
/// RMS of the sideways distances in um that is as good as none.
const NONE_LEFT: f64 = 1e-3;
/// Places of the grid from which a fit is begun.
const BEGINS: usize = 3;
/// Another curve must leave less than this share of the cost over.
const BETTER_SHARE: f64 = 0.5;

/// Fits the corners. Returns whether the curve is told.
pub(super) fn shape(fit: &mut Fit<'_>, progress: &mut dyn FnMut(&str)) -> bool {
    let enough = NONE_LEFT * NONE_LEFT;
    let own = fit.run(&Knob::SHAPE, Aim::Shape, PASSES, enough).unwrap_or(f64::INFINITY);
    let mut costs = vec![(own, fit.clone())];
    progress(&format!("shape of the corners ({:.3} um are left over)", own.sqrt()));
    let others = Switch::Shape.others(&fit.machine);
    if own < enough {
        let differences = fit.differences(&others, Aim::Shape);
        return differences.iter().all(|square| square.is_none_or(|square| square > enough));
    }
    for machine in std::iter::once(fit.machine.clone()).chain(others) {
        let found = searched(&Fit { machine, values: Vec::new(), ..fit.clone() });
        found.iter().for_each(|(cost, fit)| {
            progress(&format!(
                "{} {} ({:.3} um are left over)",
                Switch::Shape.key(),
                Switch::Shape.word(&fit.machine),
                cost.sqrt()
            ));
        });
        costs.extend(found);
    }
    let own_word = Switch::Shape.word(&fit.machine);
    let least = |own: bool| {
        let of = costs.iter().filter(move |(_, fit)| (Switch::Shape.word(&fit.machine) == own_word) == own);
        of.min_by(|a, b| a.0.total_cmp(&b.0)).cloned()
    };
    let (Some(own), other) = (least(true), least(false)) else { return false };
    let Some(other) = other else {
        *fit = own.1;
        return true;
    };
    let takes = other.0 < BETTER_SHARE * own.0;
    let told = takes || own.0 < BETTER_SHARE * other.0;
    *fit = if takes { other.1 } else { own.1 };
    told
}

/// Fits begun from the best places of a grid as wide as the ranges of the numbers, as fine as the longest step of a fit.
fn searched<'a>(start: &Fit<'a>) -> Vec<(f64, Fit<'a>)> {
    let grid = |knob: Knob| {
        let (low, high) = knob.free_range();
        let parts = ((high - low) / STEP_MAX).ceil().max(1.0);
        (0..=parts as usize).map(|k| knob.value(low + (high - low) * k as f64 / parts)).collect::<Vec<f64>>()
    };
    let mut starts = Vec::new();
    for alpha in grid(Knob::Alpha) {
        // Both ratios alike.
        starts.extend(grid(Knob::Ratio).into_iter().map(|ratio| [alpha, ratio, ratio]));
    }
    let begun = |values: [f64; 3]| {
        let values: Vec<(Knob, f64)> = Knob::SHAPE.into_iter().zip(values).collect();
        let fit = Fit { values, ..start.clone() };
        fit.cost(Aim::Shape).map(|cost| (cost, fit))
    };
    let mut begun: Vec<(f64, Fit<'a>)> = starts.into_par_iter().filter_map(begun).collect();
    begun.sort_by(|a, b| a.0.total_cmp(&b.0));
    begun.truncate(BEGINS);
    let further = |passes: usize| {
        move |(_, mut fit): (f64, Fit<'a>)| {
            fit.run(&Knob::SHAPE, Aim::Shape, passes, NONE_LEFT * NONE_LEFT).map(|cost| (cost, fit))
        }
    };
    let mut begun: Vec<(f64, Fit<'a>)> = begun.into_par_iter().filter_map(further(FIRST_PASSES)).collect();
    begun.sort_by(|a, b| a.0.total_cmp(&b.0));
    begun.truncate(1);
    begun.into_iter().filter_map(further(PASSES)).collect()
}

/// The machine with the law that is quick to plan, for a path that does not depend on it.
pub(super) fn quick(machine: &Machine) -> Machine {
    let mut machine = machine.clone();
    machine.feed.time_law = crate::machine::TimeLawKind::SevenPhase;
    machine
}
