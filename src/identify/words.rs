//! Which words a motion was driven with: all combinations fitted side by side, the better half of them round after round.
//!
//! In: a fit with the numbers of the file, the windows to begin with. Out: the combination that leaves the least over, with its numbers. A word acts
//! on some stretches of the path and a number on others, so that the right combination is seen to be right after a few steps of its numbers; most of the
//! time goes into few combinations. Combinations that move the programs in the very same way are one. Does not fit to the end.

use super::choose::{Candidate, NEAR, PASSES, SAME_SHARE, knobs_of_time};
use super::knobs::Switch;
use super::search::{Aim, Fit};
use crate::base::AxisId;
use crate::base::units::percent_from_ratio;
use crate::machine::Machine;
use rayon::prelude::*;

/// All combinations of words beside the time law, those of the machine first, those with few others before those with many.
fn combinations(machine: &Machine, other_words: usize) -> Vec<(usize, Machine)> {
    let mut all = vec![(other_words, machine.clone())];
    for switch in Switch::WORDS {
        for place in 0..all.len() {
            let (others, machine) = &all[place];
            let more: Vec<(usize, Machine)> =
                switch.others(machine).into_iter().map(|other| (others + 1, other)).collect();
            all.extend(more);
        }
    }
    all.sort_by_key(|(others, _)| *others);
    all
}

/// The windows that each combination begins with: that of the file, and the one that suits the numbers of the file best.
fn first_windows(file: usize, costs: &[(usize, f64)]) -> Vec<usize> {
    let now = costs.iter().find(|(blocks, _)| *blocks == file).map_or(f64::INFINITY, |(_, cost)| *cost);
    let best = costs.iter().min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    let mut windows = vec![file];
    windows.extend(best.filter(|(_, cost)| *cost < (1.0 - SAME_SHARE) * now).map(|(blocks, _)| *blocks));
    windows
}

/// Candidates that move the programs differently.
fn unlike<'a>(start: &Fit<'a>, other_words: usize, windows: &[usize]) -> Vec<Candidate<'a>> {
    let with = |(words, machine): (usize, Machine)| {
        let under = move |blocks: &usize| (words, Machine { look_ahead_blocks: *blocks, ..machine.clone() });
        windows.iter().map(under).collect::<Vec<_>>()
    };
    let machines: Vec<(usize, Machine)> =
        combinations(&start.machine, other_words).into_iter().flat_map(with).collect();
    let planned = |(other_words, machine): (usize, Machine)| {
        let fit = Fit { machine, ..start.clone() };
        let residuals = fit.residuals(&fit.values, Aim::Both)?;
        let cost = residuals.iter().map(|r| r * r).sum();
        Some((Candidate { fit, cost, other_words }, residuals))
    };
    let planned: Vec<Option<(Candidate<'a>, Vec<f64>)>> = machines.into_par_iter().map(planned).collect();
    let mut seen: Vec<Vec<f64>> = Vec::new();
    let mut candidates = Vec::new();
    for (candidate, residuals) in planned.into_iter().flatten() {
        if !seen.contains(&residuals) {
            candidates.push(candidate);
            seen.push(residuals);
        }
    }
    candidates
}

/// The combination of words that leaves the least over.
pub(super) fn tournament<'a>(
    start: &Fit<'a>,
    other_words: usize,
    windows: &[(usize, f64)],
    axes: &[AxisId],
    progress: &mut dyn FnMut(&str),
) -> Option<Candidate<'a>> {
    let windows = first_windows(start.machine.look_ahead_blocks, windows);
    let mut candidates = unlike(start, other_words, &windows);
    let step = |candidate: &mut Candidate<'a>, axes: Option<&[AxisId]>, passes: usize| {
        if axes.is_some() {
            candidate.step_window();
        }
        candidate.run(&knobs_of_time(&candidate.fit.machine.clone(), axes), passes);
    };
    // One jerk for all axes first: it finds its way from further off.
    let mut axes_of_round = None;
    loop {
        candidates.par_iter_mut().for_each(|candidate| step(candidate, axes_of_round, PASSES.0));
        candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let best = candidates.first()?.clone();
        progress(&format!(
            "words: {} combinations, the best leaves {:.2} % over",
            candidates.len(),
            percent_from_ratio(best.cost.sqrt())
        ));
        if best.done() || candidates.len() == 1 {
            break;
        }
        candidates.truncate(candidates.len().div_ceil(2));
        axes_of_round = Some(axes);
    }
    // Those near the best one have as many steps again: the one that is nearest to the file is taken of those that are as good then.
    let least = candidates.first()?.cost;
    candidates.retain(|candidate| candidate.cost <= NEAR * least);
    candidates.par_iter_mut().for_each(|candidate| step(candidate, Some(axes), 2 * PASSES.0));
    let best = candidates.iter().min_by(|a, b| a.cost.total_cmp(&b.cost))?.clone();
    candidates
        .into_iter()
        .filter(|candidate| candidate.as_good_as(&best))
        .min_by(|a, b| a.other_words.cmp(&b.other_words).then(a.cost.total_cmp(&b.cost)))
}
