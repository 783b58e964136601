//! Time along the path: words, look-ahead window and numbers together.
//!
//! In: a [`Fit`] whose shape is done. Out: the same with the words, the window and the numbers that leave the least over; which words and windows the
//! motion tells. A word is tried with the numbers fitted to it, one word at a time, round after round until none helps; the window is searched
//! over whole numbers between the fits. If much is left over, the fit begins again from other numbers.

use super::knobs::{Knob, Switch};
use super::search::{Aim, Fit};
use crate::base::AxisId;
use crate::base::units::percent_from_ratio;
use crate::machine::{CornerRule, Machine, TimeLawKind};

/// Steps of a fit while words are compared, and of a fit.
const PASSES: (usize, usize) = (6, 40);
/// Steps after which a time law is given up, if it leaves more than this many times the square of the best one.
const FIRST_STEPS: usize = 3;
const NEAR: f64 = 2.0;
/// Another word is fitted axis by axis if it leaves less than this many times the square of the present one without.
const NEAR_AGAIN: f64 = 64.0;
/// Rounds over all words.
const ROUNDS: usize = 4;
/// RMS of ln(feed) that is as good as none: where no word need be tried (numbers of each axis make up for a wrong word to 0.2 % on the program of the fit, and miss
/// another one by 3 %), and where a fit ends; and that from which other starts are tried.
const LITTLE_LEFT: f64 = 1.5e-3;
const NONE_LEFT: f64 = 1e-3;
const MUCH_LEFT: f64 = 0.01;
/// Another word must leave less than this share of the cost over.
const BETTER_SHARE: f64 = 0.8;
/// Share of the cost by which two windows differ that are one.
const SAME_SHARE: f64 = 1e-3;
/// RMS of ln(feed) from which two words drive differently.
const DIFFERS: f64 = 1e-3;
/// Windows that are tried first.
const WINDOWS: [usize; 10] = [1, 2, 4, 8, 16, 32, 64, 128, 256, 1000];
/// A window that leaves less than this share of the cost over explains more of the motion than numbers do.
const FAR_BETTER_SHARE: f64 = 0.5;
/// Windows between two of those that are tried at once.
const BETWEEN: usize = 4;
/// Other numbers to begin from: radial shares of acceleration and jerk, factors on transition jerk and jerk.
const STARTS: [[f64; 4]; 6] = [
    [0.5, 0.5, 1.0, 1.0],
    [0.5, 0.5, 2.5, 2.5],
    [0.3, 0.3, 0.4, 0.4],
    [0.7, 0.3, 1.0, 2.5],
    [0.2, 0.7, 2.5, 0.6],
    [0.5, 0.15, 3.0, 1.0],
];

/// What the motion tells about the window.
pub(super) enum Window {
    /// From, to.
    Between(usize, usize),
    /// This many and more move the same.
    AtLeast(usize),
}

/// The search in progress.
pub(super) struct Search<'a, 'b> {
    pub(super) fit: Fit<'a>,
    cost: f64,
    /// Axes that the programs move.
    axes: Vec<AxisId>,
    /// The numbers of the present words are those of each axis.
    per_axis: bool,
    /// Window of the file.
    file_blocks: usize,
    progress: &'b mut dyn FnMut(&str),
}

impl<'a, 'b> Search<'a, 'b> {
    /// `None` where the machine as it is ends in an alarm.
    pub(super) fn new(fit: Fit<'a>, axes: Vec<AxisId>, progress: &'b mut dyn FnMut(&str)) -> Option<Self> {
        let file_blocks = fit.machine.look_ahead_blocks;
        let mut search = Self { fit, cost: f64::INFINITY, axes, per_axis: false, file_blocks, progress };
        search.cost = search.fit.cost(Aim::Both)?;
        Some(search)
    }

    /// Knobs under the words of `machine`: of time with one jerk for all axes, or those of the shape too and a jerk for each axis. The path of
    /// set-points a cycle apart is a polyline that depends on the feed: what the shape is worth is known when the feed is.
    fn knobs_of(&self, machine: &Machine, per_axis: bool) -> Vec<Knob> {
        let shape = if per_axis { &Knob::SHAPE[..] } else { &[] };
        shape.iter().copied().chain(self.knobs_of_time(machine, per_axis)).collect()
    }

    fn knobs_of_time(&self, machine: &Machine, per_axis: bool) -> Vec<Knob> {
        let step = match machine.feed.corner_rule {
            CornerRule::FollowUp => Knob::FollowUp,
            CornerRule::Overload => Knob::Overload,
        };
        let mut knobs = Vec::new();
        // The law of the least time knows the true sums of the axes, no shares.
        if machine.feed.time_law != TimeLawKind::Continuous {
            knobs.extend([Knob::RadialAcceleration, Knob::RadialJerk]);
        }
        if per_axis {
            knobs.extend(self.axes.iter().map(|id| Knob::TransitionJerk(Some(*id))));
            knobs.extend(self.axes.iter().map(|id| Knob::Jerk(Some(*id))));
        } else {
            knobs.extend([Knob::TransitionJerk(None), Knob::Jerk(None)]);
        }
        knobs.push(step);
        knobs
    }

    /// Knobs that the result rests on.
    pub(super) fn knobs(&self) -> Vec<Knob> {
        let mut knobs = self.knobs_of(&self.fit.machine, true);
        for share in [Knob::RadialAcceleration, Knob::RadialJerk] {
            if !knobs.contains(&share) {
                knobs.push(share);
            }
        }
        knobs
    }

    /// The whole search.
    pub(super) fn run(&mut self) {
        self.time_law();
        self.fitted();
        self.rounds();
        if self.left() > MUCH_LEFT {
            self.begin_elsewhere();
        }
    }

    /// The time law that comes nearest after a few passes from the numbers of the file: numbers fitted to the wrong one are no place to begin from.
    fn time_law(&mut self) {
        self.say("time along the path");
        let mut machines = vec![self.fit.machine.clone()];
        machines.extend(Switch::TimeLaw.others(&self.fit.machine));
        let start = self.fit.clone();
        for machine in machines {
            if self.done() {
                return;
            }
            self.say(&format!("{} {}", Switch::TimeLaw.key(), Switch::TimeLaw.word(&machine)));
            let knobs = self.knobs_of(&machine, false);
            let mut trial = Fit { machine, plans: self.fit.plans, ..start.clone() };
            // Numbers fitted under a window that is far off make up for it, and no window fits them any more: a far better one comes first.
            let costs = window_costs(&mut trial);
            let now = costs.iter().find(|(blocks, _)| *blocks == trial.machine.look_ahead_blocks).map(|now| now.1);
            if let Some((blocks, cost)) = least(&costs).map(|best| costs[best])
                && now.is_none_or(|now| cost < FAR_BETTER_SHARE * now)
            {
                trial.machine.look_ahead_blocks = blocks;
            }
            let enough = NONE_LEFT * NONE_LEFT;
            let mut cost = trial.run(&knobs, Aim::Both, FIRST_STEPS, enough);
            // One that does not come near in a few steps is the wrong one.
            if cost.is_some_and(|cost| cost < NEAR * self.cost) {
                cost = trial.run(&knobs, Aim::Both, PASSES.0, enough);
            }
            self.fit.plans = trial.plans;
            if let Some(cost) = cost.filter(|cost| *cost < self.cost) {
                (self.fit, self.cost) = (trial, cost);
            }
        }
    }

    /// RMS of ln(feed) that is left over.
    fn left(&self) -> f64 {
        self.cost.sqrt()
    }

    fn done(&self) -> bool {
        self.left() <= LITTLE_LEFT
    }

    fn say(&mut self, what: &str) {
        let percent = percent_from_ratio(self.left());
        (self.progress)(&format!("{what} ({percent:.2} % is left over)"));
    }

    fn refine(&mut self, per_axis: bool) {
        let knobs = self.knobs_of(&self.fit.machine, per_axis);
        if let Some(cost) = self.fit.run(&knobs, Aim::Both, PASSES.1, NONE_LEFT * NONE_LEFT) {
            self.cost = cost;
        }
    }

    /// Numbers and window under the present words, to the end.
    fn fitted(&mut self) {
        self.say("time along the path");
        self.refine(false);
        self.window();
        if self.left() > NONE_LEFT {
            // Twelve numbers at once find their way from near the end of it only.
            self.say("time along the path, with the shape");
            let knobs: Vec<Knob> =
                Knob::SHAPE.into_iter().chain(self.knobs_of_time(&self.fit.machine, false)).collect();
            if let Some(cost) = self.fit.run(&knobs, Aim::Both, PASSES.1, NONE_LEFT * NONE_LEFT) {
                self.cost = cost;
            }
        }
        if self.left() > NONE_LEFT {
            self.say("time along the path, axis by axis");
            self.per_axis = true;
            self.refine(true);
            if self.window() {
                self.refine(true);
            }
            self.windows_beside();
        }
    }

    /// Windows beside the present one and that of the file, each with numbers fitted to it: numbers that were fitted under a wrong one make up for a part of it, so that
    /// with them no other looks better.
    fn windows_beside(&mut self) {
        for _ in 0..ROUNDS {
            if self.done() {
                return;
            }
            self.say("windows beside");
            let now = self.fit.machine.look_ahead_blocks;
            let mut beside = vec![self.file_blocks, now.saturating_sub(1).max(1), now + 1];
            beside.sort_unstable();
            beside.dedup();
            beside.retain(|blocks| *blocks != now);
            let (knobs, limit) = (self.knobs_of(&self.fit.machine, true), self.cost);
            // One that moves the program in the same way needs no fit.
            let differs = |cost: f64| (cost / limit - 1.0).abs() > SAME_SHARE;
            let mut best: Option<(f64, Fit<'a>)> = None;
            for (blocks, cost) in costs_of(&mut self.fit, &beside) {
                if !differs(cost) {
                    continue;
                }
                let machine = Machine { look_ahead_blocks: blocks, ..self.fit.machine.clone() };
                let mut trial = Fit { machine, ..self.fit.clone() };
                let cost = trial.run(&knobs, Aim::Both, PASSES.0, NONE_LEFT * NONE_LEFT);
                self.fit.plans = trial.plans;
                if let Some(cost) = cost
                    && best.as_ref().is_none_or(|(least, _)| cost < *least)
                {
                    best = Some((cost, trial));
                }
            }
            let Some((cost, trial)) = best.filter(|(cost, _)| *cost < BETTER_SHARE * self.cost) else { return };
            let plans = self.fit.plans;
            (self.fit, self.cost) = (trial, cost);
            self.fit.plans = plans;
            self.refine(true);
        }
    }

    /// Words: in each round all of them are tried, and the best is taken, until none helps.
    fn rounds(&mut self) {
        for _ in 0..ROUNDS {
            if self.done() || !self.round() {
                return;
            }
        }
    }

    fn round(&mut self) -> bool {
        let others: Vec<(Switch, Machine)> = Switch::TIME
            .into_iter()
            .flat_map(|switch| switch.others(&self.fit.machine).into_iter().map(move |other| (switch, other)))
            .collect();
        let machines: Vec<Machine> = others.iter().map(|(_, machine)| machine.clone()).collect();
        let differences = self.fit.differences(&machines, Aim::Both);
        let mut best: Option<(f64, Fit<'a>)> = None;
        for ((switch, other), difference) in others.into_iter().zip(differences) {
            // What moves less than is left over explains none of it.
            if difference.is_none_or(|square| square < 0.1 * self.cost) {
                continue;
            }
            self.say(&format!("{} {}", switch.key(), switch.word(&other)));
            let knobs = self.knobs_of(&other, false);
            let mut trial = Fit { machine: other, ..self.fit.clone() };
            trial.values.retain(|(knob, _)| !matches!(knob, Knob::FollowUp | Knob::Overload) || knobs.contains(knob));
            let mut afresh = trial.clone();
            afresh.values.retain(|(knob, _)| knob.is_of_shape());
            let [present, file] =
                [trial.cost(Aim::Both), afresh.cost(Aim::Both)].map(|cost| cost.unwrap_or(f64::INFINITY));
            if file < present {
                trial.values = afresh.values;
            }
            let mut cost = trial.run(&knobs, Aim::Both, PASSES.0, NONE_LEFT * NONE_LEFT);
            // The present word has had a jerk for each axis: one that comes near without may have them, too.
            if self.per_axis && cost.is_some_and(|cost| cost < NEAR_AGAIN * self.cost) {
                let knobs = self.knobs_of(&trial.machine.clone(), true);
                cost = trial.run(&knobs, Aim::Both, PASSES.0, NONE_LEFT * NONE_LEFT);
            }
            self.fit.plans = trial.plans;
            if let Some(cost) = cost
                && best.as_ref().is_none_or(|(least, _)| cost < *least)
            {
                best = Some((cost, trial));
            }
        }
        let Some((cost, trial)) = best else { return false };
        let plans = self.fit.plans;
        let before = (std::mem::replace(&mut self.fit, trial), std::mem::replace(&mut self.cost, cost));
        self.fit.plans = plans;
        self.fitted();
        if self.cost < BETTER_SHARE * before.1 {
            return true;
        }
        let plans = self.fit.plans;
        (self.fit, self.cost) = before;
        self.fit.plans = plans;
        false
    }

    /// The least that fits begun from other numbers leave over.
    fn begin_elsewhere(&mut self) {
        let mut best: Option<(f64, Fit<'a>)> = None;
        for (place, [acceleration, jerk, transition, plain]) in STARTS.into_iter().enumerate() {
            self.say(&format!("start {} of {}", place + 2, STARTS.len() + 1));
            let mut trial = self.fit.clone();
            trial.values.retain(|(knob, _)| knob.is_of_shape());
            trial.values.extend([
                (Knob::RadialAcceleration, acceleration),
                (Knob::RadialJerk, jerk),
                (Knob::TransitionJerk(None), transition),
                (Knob::Jerk(None), plain),
            ]);
            let knobs = self.knobs_of(&self.fit.machine, false);
            let cost = trial.run(&knobs, Aim::Both, PASSES.0 + 4, NONE_LEFT * NONE_LEFT);
            self.fit.plans = trial.plans;
            if let Some(cost) = cost
                && best.as_ref().is_none_or(|(least, _)| cost < *least)
            {
                best = Some((cost, trial));
            }
        }
        let Some((cost, trial)) = best else { return };
        let plans = self.fit.plans;
        let before = (std::mem::replace(&mut self.fit, trial), std::mem::replace(&mut self.cost, cost));
        self.fit.plans = plans;
        self.fitted();
        self.rounds();
        if self.cost >= before.1 {
            let plans = self.fit.plans;
            (self.fit, self.cost) = before;
            self.fit.plans = plans;
        }
    }

    /// Takes the window that leaves the least over, and fits again; that of the file stays where it is as good.
    fn window(&mut self) -> bool {
        if self.left() <= NONE_LEFT {
            return false;
        }
        self.say("look-ahead window");
        let costs = window_costs(&mut self.fit);
        let Some((blocks, cost)) = least(&costs).map(|best| costs[best]) else { return false };
        let now = costs.iter().find(|(blocks, _)| *blocks == self.fit.machine.look_ahead_blocks);
        let takes = now.is_none_or(|(_, now)| cost < 0.999 * now);
        if takes {
            self.fit.machine.look_ahead_blocks = blocks;
            self.cost = cost;
            self.refine(false);
        }
        takes
    }

    /// Windows that move as the present one does.
    pub(super) fn told_window(&mut self) -> Window {
        let now = self.fit.machine.look_ahead_blocks;
        let most = WINDOWS[WINDOWS.len() - 1].max(2 * now);
        let limit = 1.05 * self.cost + DIFFERS * DIFFERS;
        let mut tried = vec![most, now + 1];
        tried.extend((1..now).rev().take(1).chain(WINDOWS.into_iter().rev().filter(|blocks| blocks + 1 < now)));
        let costs = costs_of(&mut self.fit, &tried);
        let of =
            |blocks: usize| costs.iter().find(|(tried, _)| *tried == blocks).is_some_and(|(_, cost)| *cost < limit);
        let below = tried[2..].iter().take_while(|blocks| of(**blocks)).last();
        let low = below.copied().unwrap_or(now);
        match (of(most), of(now + 1)) {
            (true, _) => Window::AtLeast(low),
            (false, true) => Window::Between(low, now + 1),
            (false, false) => Window::Between(low, now),
        }
    }

    /// The machine whose other words are looked at: those of the corner rule begin where its steps are now.
    fn machine_for(&self, switch: Switch) -> Machine {
        let mut machine = self.fit.machine.clone();
        if switch == Switch::CornerRule {
            let step = [Knob::FollowUp, Knob::Overload]
                .into_iter()
                .filter(|knob| self.fit.values.iter().any(|v| v.0 == *knob));
            step.for_each(|knob| knob.set(&mut machine, self.fit.value(knob)));
        }
        machine
    }

    /// Which switches are told: the other words all drive differently.
    pub(super) fn told(&mut self) -> Vec<(Switch, bool)> {
        let limit = (DIFFERS * DIFFERS).max(self.cost);
        let mut told = Vec::new();
        for switch in Switch::TIME {
            let differences = self.fit.differences(&switch.others(&self.machine_for(switch)), Aim::Both);
            told.push((switch, differences.iter().all(|square| square.is_none_or(|square| square > limit))));
        }
        told
    }
}

/// Costs of some windows at the present numbers.
fn costs_of(fit: &mut Fit<'_>, windows: &[usize]) -> Vec<(usize, f64)> {
    let with = |blocks: &usize| Machine { look_ahead_blocks: *blocks, ..fit.machine.clone() };
    let machines: Vec<Machine> = windows.iter().map(with).collect();
    let costs = fit.costs(&machines, Aim::Both);
    windows.iter().copied().zip(costs).filter_map(|(blocks, cost)| Some((blocks, cost?))).collect()
}

/// Costs of the usual windows and of all of those around the best one, in order.
fn window_costs(fit: &mut Fit<'_>) -> Vec<(usize, f64)> {
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
