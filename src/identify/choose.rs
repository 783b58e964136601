//! Time along the path: words, look-ahead window and numbers together.
//!
//! In: a [`Fit`] whose shape is done. Out: the same with the words, the window and the numbers that leave the least over; which words and windows the
//! motion tells. First the words of the file, with numbers and window fitted to them to the end. If these leave something over, all combinations of
//! words are fitted side by side from the numbers of the file, a few steps at a time, and after each round the better half stays ([`words`](super::words)).
//! One word at a time would not do: two that are wrong together hide each other, and numbers that were fitted to a wrong word are no place to begin from.

use super::knobs::{Knob, Switch};
use super::search::{Aim, Fit, STEP_MAX};
use super::words::tournament;
use crate::base::AxisId;
use crate::base::units::percent_from_ratio;
use crate::machine::{CornerRule, Machine, TimeLawKind};
use rayon::prelude::*;

/// Steps of a fit at most: in a round of words, and to its end.
pub(super) const PASSES: (usize, usize) = (3, 40);
/// A time law that leaves more than this many times the square of what is left over without it after the steps of a round is given up.
pub(super) const NEAR: f64 = 4.0;
/// Rounds over the windows beside the one found.
const ROUNDS: usize = 4;
/// RMS of ln(feed) that is as good as none: where no word need be tried (numbers of each axis make up for a wrong word to 0.2 % on the program of the fit, and miss
/// another one by 3 %), and where a fit ends.
const LITTLE_LEFT: f64 = 1.5e-3;
/// The same under the law of the least time, whose plans are a thousandth of their time from what they might be, and change in steps with their numbers.
const LITTLE_LEFT_CONTINUOUS: f64 = 2.5e-3;
const NONE_LEFT: f64 = 1e-4;
/// Another word must leave less than this share of the cost over.
const BETTER_SHARE: f64 = 0.8;
/// Share of the cost by which two windows differ that are one.
pub(super) const SAME_SHARE: f64 = 1e-3;
/// RMS of ln(feed) from which two words drive differently.
pub(super) const DIFFERS: f64 = 1e-3;
/// Windows that are tried first.
const WINDOWS: [usize; 10] = [1, 2, 4, 8, 16, 32, 64, 128, 256, 1000];
/// Windows between two of those that are tried at once.
const BETWEEN: usize = 4;

/// What the motion tells about the window.
pub(super) enum Window {
    /// From, to.
    Between(usize, usize),
    /// This many and more move the same.
    AtLeast(usize),
}

/// A fit and what it leaves over.
#[derive(Clone)]
pub(super) struct Candidate<'a> {
    pub(super) fit: Fit<'a>,
    pub(super) cost: f64,
    /// Words that are not those of the file.
    pub(super) other_words: usize,
}

/// The last window that holds, from one that does on along some others and between the last two of them; whether there is one that does not.
fn last_of(from: usize, along: impl Iterator<Item = usize>, holds: impl Fn(usize) -> bool) -> (usize, bool) {
    let mut good = from;
    for blocks in along {
        if holds(blocks) {
            good = blocks;
            continue;
        }
        let mut bad = blocks;
        while good.abs_diff(bad) > 1 {
            let middle = good.midpoint(bad);
            *(if holds(middle) { &mut good } else { &mut bad }) = middle;
        }
        return (good, true);
    }
    (good, false)
}

fn other_law(law: TimeLawKind) -> TimeLawKind {
    match law {
        TimeLawKind::SevenPhase => TimeLawKind::Continuous,
        TimeLawKind::Continuous => TimeLawKind::SevenPhase,
    }
}

fn with_law(machine: &Machine, law: TimeLawKind) -> Machine {
    let mut machine = machine.clone();
    machine.feed.time_law = law;
    machine
}

impl<'a> Candidate<'a> {
    /// `None` where the machine ends in an alarm.
    pub(super) fn new(fit: Fit<'a>) -> Option<Self> {
        let cost = fit.cost(Aim::Both)?;
        Some(Self { fit, cost, other_words: 0 })
    }

    pub(super) fn done(&self) -> bool {
        self.cost.sqrt() <= if self.is_continuous() { LITTLE_LEFT_CONTINUOUS } else { LITTLE_LEFT }
    }

    fn is_continuous(&self) -> bool {
        self.fit.machine.feed.time_law == TimeLawKind::Continuous
    }

    pub(super) fn run(&mut self, knobs: &[Knob], passes: usize) {
        if let Some(cost) = self.fit.run(knobs, Aim::Both, passes, NONE_LEFT * NONE_LEFT) {
            self.cost = cost;
        }
    }

    /// As good as another one, as far as a motion tells.
    pub(super) fn as_good_as(&self, other: &Self) -> bool {
        self.done() || BETTER_SHARE * self.cost < other.cost
    }

    /// Takes the one of some windows that leaves the least over, if that is less than now.
    pub(super) fn take_window(&mut self, costs: &[(usize, f64)]) -> bool {
        let Some((blocks, cost)) = least(costs).map(|best| costs[best]) else { return false };
        let takes = cost < (1.0 - SAME_SHARE) * self.cost && blocks != self.fit.machine.look_ahead_blocks;
        if takes {
            self.fit.machine.look_ahead_blocks = blocks;
            self.cost = cost;
        }
        takes
    }

    /// Half and twice the window, and those beside it.
    pub(super) fn step_window(&mut self) -> bool {
        let now = self.fit.machine.look_ahead_blocks;
        let mut windows = vec![(now / 2).max(1), now.saturating_sub(1).max(1), now + 1, 2 * now];
        windows.dedup();
        windows.retain(|blocks| *blocks != now);
        let costs = costs_of(&self.fit, &windows);
        self.take_window(&costs)
    }
}

/// The shares across the path that leave the least over, of a grid over their ranges.
fn begun_at_shares<'a>(of: &Candidate<'a>) -> Option<Candidate<'a>> {
    let grid = |knob: Knob| {
        let (low, high) = knob.free_range();
        let parts = ((high - low) / STEP_MAX).ceil().max(1.0);
        (0..=parts as usize).map(move |k| knob.value(low + (high - low) * k as f64 / parts))
    };
    let pairs: Vec<(f64, f64)> = grid(Knob::RadialAcceleration)
        .flat_map(|acceleration| grid(Knob::RadialJerk).map(move |jerk| (acceleration, jerk)))
        .collect();
    let begun = pairs.into_par_iter().filter_map(|(acceleration, jerk)| {
        let mut fit = of.fit.clone();
        fit.values.retain(|(knob, _)| !matches!(knob, Knob::RadialAcceleration | Knob::RadialJerk));
        fit.values.extend([(Knob::RadialAcceleration, acceleration), (Knob::RadialJerk, jerk)]);
        let cost = fit.cost(Aim::Both)?;
        Some(Candidate { fit, cost, other_words: of.other_words })
    });
    let begun: Vec<Candidate<'a>> = begun.collect();
    begun.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// Knobs of time under the words of `machine`: one jerk for all axes, or one for each of `axes`.
pub(super) fn knobs_of_time(machine: &Machine, axes: Option<&[AxisId]>) -> Vec<Knob> {
    let mut knobs = Vec::new();
    // The law of the least time knows the true sums of the axes, no shares.
    if machine.feed.time_law != TimeLawKind::Continuous {
        knobs.extend([Knob::RadialAcceleration, Knob::RadialJerk]);
    }
    match axes {
        Some(axes) => {
            knobs.extend(axes.iter().map(|id| Knob::TransitionJerk(Some(*id))));
            knobs.extend(axes.iter().map(|id| Knob::Jerk(Some(*id))));
        }
        None => knobs.extend([Knob::TransitionJerk(None), Knob::Jerk(None)]),
    }
    knobs.push(match machine.feed.corner_rule {
        CornerRule::FollowUp => Knob::FollowUp,
        CornerRule::Overload => Knob::Overload,
    });
    knobs
}

/// The search in progress.
pub(super) struct Search<'a, 'b> {
    pub(super) best: Candidate<'a>,
    /// Axes that the programs move.
    axes: Vec<AxisId>,
    /// The machine as in the file, and what is known of its shape.
    start: Fit<'a>,
    progress: &'b mut dyn FnMut(&str),
}

impl<'a, 'b> Search<'a, 'b> {
    /// `None` where the machine as it is ends in an alarm.
    pub(super) fn new(fit: Fit<'a>, axes: Vec<AxisId>, progress: &'b mut dyn FnMut(&str)) -> Option<Self> {
        Some(Self { best: Candidate::new(fit.clone())?, axes, start: fit, progress })
    }

    /// Knobs that the result rests on.
    pub(super) fn knobs(&self) -> Vec<Knob> {
        let time = knobs_of_time(&self.best.fit.machine, Some(&self.axes));
        let mut knobs: Vec<Knob> = Knob::SHAPE.into_iter().chain(time).collect();
        for share in [Knob::RadialAcceleration, Knob::RadialJerk] {
            if !knobs.contains(&share) {
                knobs.push(share);
            }
        }
        knobs
    }

    /// The whole search.
    pub(super) fn run(&mut self) {
        self.say("time along the path");
        let mut own = self.best.clone();
        self.fitted(&mut own);
        self.best = own;
        if self.best.done() {
            return;
        }
        let law = self.start.machine.feed.time_law;
        let quick = self.quick(other_law(law));
        // Which law is asked first decides about time alone: the other one is asked, too, unless the first leaves nothing over.
        let other_first = quick.as_ref().is_some_and(|quick| quick.cost < 0.5 * self.best.cost);
        if !other_first {
            let start = self.start.clone();
            self.words(&start);
        }
        if let Some(mut quick) = quick.filter(|quick| !self.best.done() && quick.cost < NEAR * self.best.cost) {
            self.fitted(&mut quick);
            let numbers = quick.fit.clone();
            if !self.best.as_good_as(&quick) {
                self.best = quick;
            }
            self.words(&numbers);
        }
        if other_first {
            let start = self.start.clone();
            self.words(&start);
        }
    }

    /// A time law after the steps of a round.
    fn quick(&mut self, law: TimeLawKind) -> Option<Candidate<'a>> {
        let machine = with_law(&self.start.machine, law);
        self.say(&format!("{} {}", Switch::TimeLaw.key(), Switch::TimeLaw.word(&machine)));
        let mut quick = Candidate::new(Fit { machine, ..self.start.clone() })?;
        quick.other_words = 1;
        let mut elsewhere = quick.clone();
        let knobs = knobs_of_time(&quick.fit.machine.clone(), None);
        quick.run(&knobs, PASSES.0);
        if elsewhere.take_window(&costs_of(&quick.fit, &WINDOWS))
            || elsewhere.take_window(&costs_of(&elsewhere.fit, &WINDOWS))
        {
            elsewhere.cost = elsewhere.fit.cost(Aim::Both)?;
            elsewhere.run(&knobs, PASSES.0);
            if elsewhere.cost < quick.cost {
                quick = elsewhere;
            }
        }
        self.tell("a few steps of it", &quick);
        Some(quick)
    }

    /// All combinations of the other words.
    fn words(&mut self, start: &Fit<'a>) {
        if self.best.done() {
            return;
        }
        self.say(&format!("words of {}", Switch::TimeLaw.word(&start.machine)));
        let windows = window_costs(start);
        let other_words = usize::from(start.machine.feed.time_law != self.start.machine.feed.time_law);
        let winner = tournament(start, other_words, &windows, &self.axes, &mut |what| (self.progress)(what));
        let Some(mut winner) = winner else { return };
        self.fitted(&mut winner);
        if !self.best.as_good_as(&winner) {
            self.best = winner;
        }
    }

    fn say(&mut self, what: &str) {
        let percent = percent_from_ratio(self.best.cost.sqrt());
        (self.progress)(&format!("{what} ({percent:.2} % is left over)"));
    }

    fn tell(&mut self, what: &str, of: &Candidate<'_>) {
        let percent = percent_from_ratio(of.cost.sqrt());
        (self.progress)(&format!("{what} ({percent:.2} % is left over)"));
    }

    /// Numbers and window under the words of a candidate, to the end: one jerk for all axes, then a jerk for each axis (and the shape, where the path does not
    /// tell it alone), then the window.
    fn fitted(&mut self, of: &mut Candidate<'a>) {
        let words = &of.fit.machine.clone();
        if self.few_numbers(of) {
            return;
        }
        of.run(&knobs_of_time(words, None), 2 * PASSES.0);
        let shape = if of.fit.has_paths() { &[][..] } else { &Knob::SHAPE };
        let all: Vec<Knob> = shape.iter().copied().chain(knobs_of_time(words, Some(&self.axes))).collect();
        for _ in 0..ROUNDS {
            self.tell("axis by axis", of);
            of.run(&all, 2 * PASSES.0);
            if of.done() || !self.other_window(of, &all) {
                break;
            }
        }
        self.tell("to the end", of);
        // Its plans cost ten times as much, and what they still gain is their own grain.
        let passes = if of.done() && of.is_continuous() { PASSES.0 } else { PASSES.1 };
        of.run(&all, passes);
        self.around(of, &all);
        self.windows_beside(of, &all);
    }

    /// Few numbers first, those of the axes as in the file: a share and the jerks that it is a share of make up for each other, so that where the share alone
    /// explains everything, other jerks would explain it almost as well. True: next to nothing is left over.
    fn few_numbers(&mut self, of: &mut Candidate<'a>) -> bool {
        // Its numbers are those of the axes.
        if of.is_continuous() {
            return false;
        }
        self.tell("few numbers", of);
        let knobs = knobs_of_time(&of.fit.machine.clone(), Some(&[]));
        let Some(mut few) = begun_at_shares(of) else { return false };
        few.run(&knobs, PASSES.1);
        let explains = few.done();
        if explains {
            *of = few;
        }
        explains
    }

    /// Where a fit stands in a bend of limits that take turns, the stretches that are explained already lead on: those that are far off count little for a while.
    fn around(&mut self, of: &mut Candidate<'a>, knobs: &[Knob]) {
        if of.done() {
            return;
        }
        self.tell("what is far off counts less", of);
        let mut trial = of.clone();
        trial.fit.by_logarithm = true;
        trial.run(knobs, 2 * PASSES.0);
        trial.fit.by_logarithm = false;
        trial.run(knobs, PASSES.1);
        if trial.cost < of.cost {
            *of = trial;
        }
    }

    /// Takes the window that suits the present numbers best, if it leaves less over with numbers fitted to it: numbers make up for a part of a wrong window, and
    /// a window for a part of wrong numbers.
    fn other_window(&mut self, of: &mut Candidate<'a>, knobs: &[Knob]) -> bool {
        self.tell("look-ahead window", of);
        let mut trial = of.clone();
        if !trial.take_window(&window_costs(&of.fit)) {
            return false;
        }
        trial.run(knobs, PASSES.0);
        let takes = trial.cost < BETTER_SHARE * of.cost;
        if takes {
            *of = trial;
        }
        takes
    }

    /// Windows beside the present one and that of the file, each with numbers fitted to it: numbers that were fitted under a wrong one make up for a part of it, so that
    /// with them no other looks better.
    fn windows_beside(&mut self, of: &mut Candidate<'a>, knobs: &[Knob]) {
        for _ in 0..ROUNDS {
            if of.done() {
                return;
            }
            self.tell("windows beside", of);
            let now = of.fit.machine.look_ahead_blocks;
            let mut beside = vec![self.start.machine.look_ahead_blocks, now.saturating_sub(1).max(1), now + 1];
            beside.sort_unstable();
            beside.dedup();
            beside.retain(|blocks| *blocks != now);
            // One that moves the program in the same way needs no fit.
            let mut best: Option<Candidate<'a>> = None;
            for (blocks, cost) in costs_of(&of.fit, &beside) {
                if (cost / of.cost - 1.0).abs() < SAME_SHARE {
                    continue;
                }
                let mut trial = Candidate { cost, ..of.clone() };
                trial.fit.machine.look_ahead_blocks = blocks;
                trial.run(knobs, 2 * PASSES.0);
                if best.as_ref().is_none_or(|best| trial.cost < best.cost) {
                    best = Some(trial);
                }
            }
            let Some(best) = best.filter(|best| best.cost < BETTER_SHARE * of.cost) else { return };
            *of = best;
            of.run(knobs, PASSES.1);
        }
    }

    /// Windows that move as the present one does.
    pub(super) fn told_window(&mut self) -> Window {
        let now = self.best.fit.machine.look_ahead_blocks;
        let most = WINDOWS[WINDOWS.len() - 1].max(2 * now);
        let limit = 1.05 * self.best.cost + DIFFERS * DIFFERS;
        let of = |blocks: usize| costs_of(&self.best.fit, &[blocks]).iter().any(|(_, cost)| *cost < limit);
        let below = (1..now).rev().take(1).chain(WINDOWS.into_iter().rev().filter(|blocks| blocks + 1 < now));
        let above = [now + 1].into_iter().chain(WINDOWS.into_iter().filter(|blocks| *blocks > now + 1));
        let (low, _) = last_of(now, below, of);
        match last_of(now, above.chain((most > WINDOWS[WINDOWS.len() - 1]).then_some(most)), of) {
            (_, false) => Window::AtLeast(low),
            (high, true) => Window::Between(low, high),
        }
    }

    /// The machine whose other words are looked at: those of the corner rule begin where its steps are now.
    fn machine_for(&self, switch: Switch) -> Machine {
        let mut machine = self.best.fit.machine.clone();
        if switch == Switch::CornerRule {
            let step = [Knob::FollowUp, Knob::Overload]
                .into_iter()
                .filter(|knob| self.best.fit.values.iter().any(|v| v.0 == *knob));
            step.for_each(|knob| knob.set(&mut machine, self.best.fit.value(knob)));
        }
        machine
    }

    /// Which switches are told: the other words all drive differently. What only one of the corner rules has is fitted first.
    pub(super) fn told(&self) -> Vec<(Switch, bool)> {
        let limit = (DIFFERS * DIFFERS).max(self.best.cost);
        let mut others = Vec::new();
        for switch in Switch::TIME {
            for machine in switch.others(&self.machine_for(switch)) {
                let mut other = Fit { machine, ..self.best.fit.clone() };
                if switch == Switch::CornerRule {
                    let step = knobs_of_time(&other.machine, None).pop();
                    other.run(&step.into_iter().collect::<Vec<_>>(), Aim::Both, PASSES.0, NONE_LEFT * NONE_LEFT);
                }
                others.push((switch, other.machine_with(&other.values)));
            }
        }
        let machines: Vec<Machine> = others.iter().map(|(_, machine)| machine.clone()).collect();
        let differences = self.best.fit.differences_of(&machines, Aim::Both);
        let differs = |switch: Switch| {
            let of = others.iter().zip(&differences).filter(|((other, _), _)| *other == switch);
            of.clone().all(|(_, square)| square.is_none_or(|square| square > limit))
        };
        Switch::TIME.into_iter().map(|switch| (switch, differs(switch))).collect()
    }
}

/// Costs of some windows at the present numbers.
pub(super) fn costs_of(fit: &Fit<'_>, windows: &[usize]) -> Vec<(usize, f64)> {
    let with = |blocks: &usize| Machine { look_ahead_blocks: *blocks, ..fit.machine.clone() };
    let machines: Vec<Machine> = windows.iter().map(with).collect();
    let costs = fit.costs(&machines, Aim::Both);
    windows.iter().copied().zip(costs).filter_map(|(blocks, cost)| Some((blocks, cost?))).collect()
}

/// Costs of the usual windows and of all of those around the best one, in order.
fn window_costs(fit: &Fit<'_>) -> Vec<(usize, f64)> {
    let mut windows = WINDOWS.to_vec();
    windows.push(fit.machine.look_ahead_blocks);
    windows.sort_unstable();
    windows.dedup();
    let mut costs = costs_of(fit, &windows);
    // A window that ends in an alarm has no cost.
    let mut tried = windows;
    loop {
        let Some(best) = least(&costs) else { return costs };
        let below = best.checked_sub(1).map_or(costs[best].0, |k| costs[k].0);
        let above = costs.get(best + 1).map_or(costs[best].0, |next| next.0);
        let inside: Vec<usize> = (below + 1..above).filter(|blocks| !tried.contains(blocks)).collect();
        if inside.is_empty() {
            return costs;
        }
        let stride = inside.len().div_ceil(BETWEEN);
        let more: Vec<usize> = inside.into_iter().step_by(stride).collect();
        costs.extend(costs_of(fit, &more));
        tried.extend(more);
        costs.sort_by_key(|(blocks, _)| *blocks);
    }
}

/// Place of the least cost; the smallest window of equal ones.
fn least(costs: &[(usize, f64)]) -> Option<usize> {
    (0..costs.len()).min_by(|a, b| costs[*a].1.total_cmp(&costs[*b].1).then(a.cmp(b)))
}
