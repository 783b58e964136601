//! The fastest profile of a chain of intervals under linear limits: a primal-dual interior-point method that knows the chain.
//!
//! In: a [`Problem`]: for every interval how the state `x = (b, b')` at its start and the control `u = b''` give the state at its
//! end, the limits `a . (x, u) <= d` that hold there, and the cost. Out: states and controls in [`Solver`]. All numbers are scaled by the caller to
//! the order of 1.
//!
//! Minimised is `sum c_i / sqrt(b_i)`, the time: convex where b > 0. Each step of Mehrotra's predictor-corrector method is a linear-quadratic
//! problem along the chain, solved by a Riccati recursion over 2 x 2 matrices, so that its cost goes with the number of intervals
//! [Mehrotra 1992]. The states need not obey the chain to begin with.
//!
//! The last interval has no control of its own (`b = 0` in its transition): the state at the end lies on a ray. The first state is
//! given, or any point of a ray.
//! Does not know what b, limits and intervals mean.

use super::limit_lanes::{Block, LANES, Prediction, Sums, greater, sum};
use multiversion::multiversion;

/// What a limit belongs to; a label of the caller's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Label {
    /// One of the places of an interval at which its control is held.
    Place(u8),
    /// Of the state.
    State,
    /// The highest of the first component of the state.
    Cap,
    /// There is no limit.
    None,
}

/// What is known of a limit besides its numbers; of a lane without a limit nothing.
#[derive(Clone, Copy, Debug)]
struct Title {
    label: Label,
    /// Never gives way.
    holds: bool,
}

/// From the state at the start of an interval to that at its end: `x+ = A x + B u`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Transition {
    /// A by rows.
    pub state_ratio: [f64; 4],
    /// B; zeros: the interval has no control.
    pub control_ratio: [f64; 2],
}

/// What is to be solved.
#[derive(Clone, Debug, Default)]
pub(super) struct Problem {
    blocks: Vec<Block>,
    /// What the limits are called, in the order of the lanes of all blocks.
    titles: Vec<Title>,
    /// Blocks of node i are `ends[i - 1] .. ends[i]`.
    ends: Vec<usize>,
    /// Limits so far.
    limits: usize,
    /// c of every node.
    pub costs_ratio: Vec<f64>,
    /// Of every interval.
    pub transitions: Vec<Transition>,
    /// The first state is a point of this ray; `None`: it is given.
    pub start_ray_ratio: Option<[f64; 2]>,
}

impl Problem {
    /// Forgets everything but its memory.
    pub fn clear(&mut self) {
        self.blocks.clear();
        self.titles.clear();
        self.ends.clear();
        self.limits = 0;
        self.costs_ratio.clear();
        self.transitions.clear();
        self.start_ray_ratio = None;
    }

    /// A limit of the node at hand and the interval after it.
    pub fn limit(&mut self, label: Label, a_ratio: [f64; 3], bound_ratio: f64) {
        let begun = self.blocks.len() * LANES;
        if self.titles.len() == begun {
            self.blocks.push(Block::default());
        }
        let lane = self.titles.len() % LANES;
        if let Some(block) = self.blocks.last_mut() {
            block.set(lane, a_ratio, bound_ratio);
        }
        self.titles.push(Title { label, holds: false });
        self.limits += 1;
    }

    /// Limits of the node at hand so far, to be rewritten in place where the interval after it has no control.
    pub fn without_control(&mut self, feedback_ratio: [f64; 2]) {
        let start = self.ends.last().copied().unwrap_or(0);
        for block in &mut self.blocks[start..] {
            block.put_control(feedback_ratio);
        }
    }

    /// The last limit never gives way.
    pub fn hold_last(&mut self) {
        if let Some(title) = self.titles.last_mut() {
            title.holds = true;
        }
    }

    /// Every limit that may give way counts as so much wider.
    pub fn loosen(&mut self, by_ratio: f64) {
        for (block, titles) in self.blocks.iter_mut().zip(self.titles.chunks(LANES)) {
            for (lane, title) in titles.iter().enumerate() {
                if !title.holds {
                    block.loosen(lane, by_ratio);
                }
            }
        }
    }

    /// The limits of the node at hand are complete.
    pub fn end_node(&mut self) {
        // Lanes without a limit are no limits either way.
        self.titles.resize(self.blocks.len() * LANES, Title { label: Label::None, holds: true });
        self.ends.push(self.blocks.len());
    }

    /// Label, factor of the control, slack and multiplier of the limits of a node.
    fn limits_of(&self, node: usize) -> impl Iterator<Item = Held> {
        let start = node.checked_sub(1).map_or(0, |before| self.ends[before]);
        (start..self.ends[node]).flat_map(move |index| {
            (0..LANES).map(move |lane| {
                let (control, slack, multiplier) = self.blocks[index].held(lane);
                Held { label: self.titles[index * LANES + lane].label, control, slack, multiplier }
            })
        })
    }

    /// Sum of the multipliers of a node with this label, after a solution: by how much the cost falls if those limits become wider by 1.
    pub fn price_ratio(&self, node: usize, label: impl Fn(Label) -> bool) -> f64 {
        self.limits_of(node).filter(|limit| label(limit.label)).map(|limit| limit.multiplier).sum()
    }

    /// By how much the cost would fall, about, if the control after a node could be another one at each of the three places that hold it: to first
    /// order. What pushes to one side gains with what each place leaves unused, no more than all of the limit; where one place pushes up and
    /// another one down (`pinched`: that counts too) they hold the state between them, and each would go by a whole limit.
    pub fn unused_ratio(&self, node: usize, pinched: bool) -> f64 {
        let held = || self.limits_of(node).filter(|limit| matches!(limit.label, Label::Place(_)));
        let most = held().filter(|limit| limit.multiplier > 0.0).map(|limit| limit.control.abs()).fold(0.0, f64::max);
        if most == 0.0 {
            return 0.0;
        }
        let at = |place: u8| held().filter(move |limit| limit.label == Label::Place(place));
        let prices = [0, 1, 2].map(|place| at(place).map(|limit| limit.multiplier * limit.control).sum::<f64>());
        let [up, down] = [1.0, -1.0].map(|sign| prices.iter().map(|price| (sign * price).max(0.0)).sum::<f64>());
        let free = |place: u8| {
            let limits = at(place).filter(|limit| limit.control * (up - down) > 0.0);
            limits.map(|limit| limit.slack / limit.control.abs()).fold(1.0 / most, f64::min)
        };
        (up - down).abs() * (0.25 * free(0) + 0.5 * free(1) + 0.25 * free(2))
            + if pinched { up.min(down) / most } else { 0.0 }
    }
}

/// A limit after a solution.
#[derive(Clone, Copy, Debug)]
struct Held {
    label: Label,
    /// Factor of the control.
    control: f64,
    slack: f64,
    multiplier: f64,
}

/// Work of one node.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    state: [f64; 2],
    control: f64,
    state_step: [f64; 2],
    control_step: f64,
    /// Steps of state and control in the affine direction.
    affine: [f64; 3],
    /// Missing in the transition to the next node.
    gap: [f64; 2],
    /// Hessian: 00, 01, 11, 0u, 1u, uu.
    hessian: [f64; 6],
    /// Gradient of cost and limits: without centring; what centring and the correction of second order add.
    force: [f64; 3],
    inward: [f64; 3],
    correction: [f64; 3],
    /// Value function of the recursion: 00, 01, 11.
    value: [f64; 3],
    /// Of the control: its own curvature, and its coupling with the state.
    control_curvature: f64,
    control_coupling: [f64; 2],
    feedback: [f64; 2],
    feedforward: f64,
}

/// How an attempt ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Within the tolerance of the optimum, limits kept.
    Solved,
    /// No such point was found.
    Failed,
}

/// Memory of the method, used again and again.
#[derive(Clone, Debug, Default)]
pub(super) struct Solver {
    nodes: Vec<Node>,
}

/// How much of the way to the nearest limit a step goes.
const STEP_SHARE: f64 = 0.99;

/// Slack that a row starts with at least.
const SLACK_START_MIN: f64 = 0.05;

/// Limits are met to this; the transitions to rounding, by a last step that nothing but them asks for.
const RESIDUAL_MAX: f64 = 1e-6;

/// Steps shorter than this, so many in a row, lead nowhere.
const STALL_STEP: f64 = 0.2;
const STALLS_MAX: u32 = 2;

/// What is good enough there.
const STALLED_GAP_MAX_RATIO: f64 = 0.02;

/// Added to the curvature where nothing else is.
const CURVATURE_MIN: f64 = 1e-12;

impl Solver {
    /// State of a node.
    pub fn state_ratio(&self, node: usize) -> [f64; 2] {
        self.nodes[node].state
    }

    /// Starts from these states and the controls after them.
    pub fn start(&mut self, states_ratio: impl IntoIterator<Item = ([f64; 2], f64)>) {
        self.nodes.clear();
        self.nodes.extend(states_ratio.into_iter().map(|(state, control)| Node { state, control, ..Node::default() }));
    }

    /// The first state, which stays as it is or on its ray.
    pub fn set_first(&mut self, state_ratio: [f64; 2]) {
        if let Some(first) = self.nodes.first_mut() {
            first.state = state_ratio;
        }
    }

    /// Solves to a cost within `gap_max_ratio` of the least, absolute, in `steps_max` steps.
    pub fn solve(&mut self, problem: &mut Problem, gap_max_ratio: f64, steps_max: u32) -> Outcome {
        if self.nodes.len() != problem.transitions.len() + 1 || problem.limits == 0 {
            return Outcome::Failed;
        }
        self.first_slacks(problem);
        self.refine(problem, gap_max_ratio, steps_max)
    }

    /// Goes on from a solution, to a better one.
    pub fn refine(&mut self, problem: &mut Problem, gap_max_ratio: f64, steps_max: u32) -> Outcome {
        let count = problem.limits as f64;
        let (mut stalls, mut step) = (0, 0.0);
        for _ in 0..steps_max {
            let (gap, residual) = self.advance(problem, step);
            if !gap.is_finite() {
                return Outcome::Failed;
            }
            if gap <= gap_max_ratio && residual <= RESIDUAL_MAX {
                self.close(problem);
                return Outcome::Solved;
            }
            self.factorise(problem);
            self.backward(problem, None);
            let predicted = self.predict(problem);
            let centring = (predicted.gap_after(gap) / gap).powi(3).min(1.0) * gap / count;
            self.backward(problem, Some(centring));
            let (primal, dual) = self.correct(problem, centring);
            let share = STEP_SHARE.max(1.0 - gap);
            step = (share * primal.min(dual)).min(1.0);
            // Where hardly anything is free the multipliers grow without bound, and the steps vanish: a point that keeps the limits will do.
            let usable = gap <= STALLED_GAP_MAX_RATIO && residual <= RESIDUAL_MAX;
            stalls = if usable && step < STALL_STEP { stalls + 1 } else { 0 };
            if stalls >= STALLS_MAX {
                self.close(problem);
                return Outcome::Solved;
            }
        }
        Outcome::Failed
    }

    fn first_slacks(&self, problem: &mut Problem) {
        let product = 3.0 * problem.costs_ratio.iter().sum::<f64>() / problem.limits as f64;
        let Problem { blocks, ends, .. } = problem;
        let mut first = 0;
        for (node, end) in self.nodes.iter().zip(ends.iter()) {
            for block in &mut blocks[first..*end] {
                block.begin(&node.state, node.control, SLACK_START_MIN, product);
            }
            first = *end;
        }
    }

    /// Goes a step along the direction; then residuals, weights, Hessians and forces of the limits there: the complementarity gap, and the
    /// greatest residual.
    fn advance(&mut self, problem: &mut Problem, step: f64) -> (f64, f64) {
        for node in &mut self.nodes {
            node.state[0] += step * node.state_step[0];
            node.state[1] += step * node.state_step[1];
            node.control += step * node.control_step;
        }
        let mut residual = 0.0_f64;
        for i in 0..problem.transitions.len() {
            let (x, u, next) = (self.nodes[i].state, self.nodes[i].control, self.nodes[i + 1].state);
            let reached = problem.transitions[i].apply(&x, u);
            let gap = [reached[0] - next[0], reached[1] - next[1]];
            residual = residual.max(gap[0].abs()).max(gap[1].abs());
            self.nodes[i].gap = gap;
        }
        let (total, missing) = advance_limits(&mut self.nodes, problem, step);
        (total, greater(residual, missing))
    }

    /// Makes the states follow the transitions to rounding, with the least change in the metric of the limits at the present point.
    fn close(&mut self, problem: &Problem) {
        self.nodes.iter_mut().for_each(|node| node.force = [0.0; 3]);
        self.factorise(problem);
        self.backward(problem, None);
        for i in 0..self.nodes.len() {
            step_on(&mut self.nodes, &problem.transitions, i);
            let node = &mut self.nodes[i];
            node.state[0] += node.state_step[0];
            node.state[1] += node.state_step[1];
            node.control += node.control_step;
        }
    }

    /// Riccati recursion from the end.
    fn factorise(&mut self, problem: &Problem) {
        let count = problem.transitions.len();
        let h = self.nodes[count].hessian;
        let mut p = [h[0], h[1], h[2]];
        self.nodes[count].value = p;
        for (node, transition) in self.nodes[..count].iter_mut().zip(&problem.transitions).rev() {
            let [a00, a01, a10, a11] = transition.state_ratio;
            let [b0, b1] = transition.control_ratio;
            let h = node.hessian;
            let pa =
                [p[0] * a00 + p[1] * a10, p[0] * a01 + p[1] * a11, p[1] * a00 + p[2] * a10, p[1] * a01 + p[2] * a11];
            let q =
                [h[0] + a00 * pa[0] + a10 * pa[2], h[1] + a00 * pa[1] + a10 * pa[3], h[2] + a01 * pa[1] + a11 * pa[3]];
            if transition.has_control() {
                let pb = [p[0] * b0 + p[1] * b1, p[1] * b0 + p[2] * b1];
                let curvature = h[5] + b0 * pb[0] + b1 * pb[1];
                let coupling = [h[3] + b0 * pa[0] + b1 * pa[2], h[4] + b0 * pa[1] + b1 * pa[3]];
                let k = [-coupling[0] / curvature, -coupling[1] / curvature];
                (node.control_curvature, node.control_coupling, node.feedback) = (curvature, coupling, k);
                p = [q[0] + coupling[0] * k[0], q[1] + coupling[0] * k[1], q[2] + coupling[1] * k[1]];
            } else {
                (node.control_curvature, node.control_coupling, node.feedback) = (1.0, [0.0; 2], [0.0; 2]);
                p = q;
            }
            node.value = p;
        }
    }

    /// Newton's direction from the end to the start, and the first step of the states. `centring`: the product of slack and multiplier that it aims
    /// at, with the correction of second order that [`Self::predict`] has found; `None`: the affine direction.
    fn backward(&mut self, problem: &Problem, centring: Option<f64>) {
        let count = problem.transitions.len();
        let mut p = [0.0; 2];
        for i in (0..=count).rev() {
            let next = if i < count { self.nodes[i + 1].value } else { [0.0; 3] };
            let node = &mut self.nodes[i];
            let mut g = node.force;
            if let Some(centring) = centring {
                let added = node.inward.iter().zip(node.correction).map(|(inward, second)| centring * inward - second);
                g.iter_mut().zip(added).for_each(|(g, added)| *g += added);
            }
            if i == count {
                p = [g[0], g[1]];
                continue;
            }
            let transition = &problem.transitions[i];
            let [a00, a01, a10, a11] = transition.state_ratio;
            let [b0, b1] = transition.control_ratio;
            let e = node.gap;
            let v = [p[0] + next[0] * e[0] + next[1] * e[1], p[1] + next[1] * e[0] + next[2] * e[1]];
            p = [g[0] + a00 * v[0] + a10 * v[1], g[1] + a01 * v[0] + a11 * v[1]];
            node.feedforward = 0.0;
            if transition.has_control() {
                node.feedforward = -(g[2] + b0 * v[0] + b1 * v[1]) / node.control_curvature;
                p[0] += node.control_coupling[0] * node.feedforward;
                p[1] += node.control_coupling[1] * node.feedforward;
            }
        }
        self.nodes[0].state_step =
            problem.start_ray_ratio.map_or([0.0; 2], |ray| along_ray(ray, &self.nodes[0].value, &p));
    }

    /// The affine direction: how far it leads, and what it changes to second order.
    fn predict(&mut self, problem: &mut Problem) -> Prediction {
        predict_limits(&mut self.nodes, problem)
    }

    /// The corrected direction: the steps at which the first slack and the first multiplier would vanish.
    fn correct(&mut self, problem: &mut Problem, centring: f64) -> (f64, f64) {
        let [primal, dual] = correct_limits(&mut self.nodes, problem, centring);
        (1.0 / greater(f64::MIN_POSITIVE, primal), 1.0 / greater(f64::MIN_POSITIVE, dual))
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn advance_limits(nodes: &mut [Node], problem: &mut Problem, step: f64) -> (f64, f64) {
    let Problem { blocks, ends, costs_ratio, .. } = problem;
    let (mut total, mut residual) = ([0.0; LANES], [0.0; LANES]);
    let mut first = 0;
    for ((node, end), cost) in nodes.iter_mut().zip(ends.iter()).zip(costs_ratio.iter()) {
        let mut sums = Sums::default();
        for block in &mut blocks[first..*end] {
            block.advance(step, &node.state, node.control, &mut sums, &mut total, &mut residual);
        }
        first = *end;
        let b = node.state[0].max(f64::MIN_POSITIVE);
        let root = b.sqrt();
        let (force, h) = (sums.force(), sums.hessian());
        node.force = [force[0] - 0.5 * cost / (b * root), force[1], force[2]];
        node.hessian =
            [h[0] + 0.75 * cost / (b * b * root), h[1], h[2] + CURVATURE_MIN, h[3], h[4], h[5] + CURVATURE_MIN];
    }
    (sum(&total), residual.into_iter().fold(0.0, greater))
}

#[multiversion(targets("x86_64+avx2"))]
fn predict_limits(nodes: &mut [Node], problem: &mut Problem) -> Prediction {
    let Problem { blocks, ends, transitions, .. } = problem;
    let mut prediction = Prediction::default();
    let mut first = 0;
    for i in 0..nodes.len() {
        step_on(nodes, transitions, i);
        let node = &mut nodes[i];
        node.affine = [node.state_step[0], node.state_step[1], node.control_step];
        let (mut inward, mut correction) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for block in &mut blocks[first..ends[i]] {
            block.predict(&node.state_step, node.control_step, &mut prediction, &mut inward, &mut correction);
        }
        first = ends[i];
        node.inward = inward.each_ref().map(sum);
        node.correction = correction.each_ref().map(sum);
    }
    prediction
}

#[multiversion(targets("x86_64+avx2"))]
fn correct_limits(nodes: &mut [Node], problem: &mut Problem, centring: f64) -> [f64; 2] {
    let Problem { blocks, ends, transitions, .. } = problem;
    let (mut primal, mut dual) = ([0.0; LANES], [0.0; LANES]);
    let mut first = 0;
    for i in 0..nodes.len() {
        step_on(nodes, transitions, i);
        let node = &nodes[i];
        let step = [node.state_step[0], node.state_step[1], node.control_step];
        for block in &mut blocks[first..ends[i]] {
            block.correct(&node.affine, &step, centring, &mut primal, &mut dual);
        }
        first = ends[i];
    }
    [primal, dual].map(|lanes| lanes.into_iter().fold(0.0, greater))
}

/// Steps of the control of node `i` and of the state after it.
#[inline(always)]
fn step_on(nodes: &mut [Node], transitions: &[Transition], i: usize) {
    let Some(transition) = transitions.get(i) else {
        nodes[i].control_step = 0.0;
        return;
    };
    let node = &mut nodes[i];
    let dx = node.state_step;
    node.control_step = node.feedback[0] * dx[0] + node.feedback[1] * dx[1] + node.feedforward;
    let reached = transition.apply(&dx, node.control_step);
    let gap = node.gap;
    nodes[i + 1].state_step = [reached[0] + gap[0], reached[1] + gap[1]];
}

impl Transition {
    #[inline(always)]
    fn apply(&self, state: &[f64; 2], control: f64) -> [f64; 2] {
        let ([a00, a01, a10, a11], [b0, b1]) = (self.state_ratio, self.control_ratio);
        [a00 * state[0] + a01 * state[1] + b0 * control, a10 * state[0] + a11 * state[1] + b1 * control]
    }

    fn has_control(&self) -> bool {
        self.control_ratio != [0.0; 2]
    }
}

/// The step along the ray that is best for the value function.
fn along_ray(ray: [f64; 2], value: &[f64; 3], gradient: &[f64; 2]) -> [f64; 2] {
    let curvature = value[0] * ray[0] * ray[0] + 2.0 * value[1] * ray[0] * ray[1] + value[2] * ray[1] * ray[1];
    let step = -(ray[0] * gradient[0] + ray[1] * gradient[1]) / curvature;
    [ray[0] * step, ray[1] * step]
}
