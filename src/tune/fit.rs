//! Gauss-Newton in the gains, and how certain they are.
//!
//! In: a group and a start. Out: gains with the least mean square, 95 % intervals. The residuals are affine in the gains between stick events, so
//! that one simulation with each gain moved gives all derivatives. A preference for theory (its width is [`PREFERENCE_STEPS`] steps of a search)
//! weighs as much as the scatter of blocks of residuals leaves room for: where courses tell a gain it does nothing. Intervals: block
//! bootstrap, because residuals are strongly correlated.

use super::gains::{Gain, Gains};
use super::group::{BLOCK_S, Group, Residual, Score};

/// Passes from each start.
const PASSES: usize = 2;
/// Shares of a step that are tried.
const STEP_SHARES: [f64; 3] = [1.0, 0.5, 0.25];
/// Width of the preference for theory.
const PREFERENCE_STEPS: f64 = 3.0;
/// Resamplings.
const RESAMPLES: usize = 400;
/// Sweeps of the small bounded problem.
const SWEEPS: usize = 400;
/// An interval wider than this share of the preference tells nothing of its own.
const TELLING_SHARE: f64 = 0.5;

/// 95 % interval of a slot, inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Certainty {
    pub low: f64,
    pub high: f64,
    pub certain: bool,
}

/// Sums over one block: J'J, J'r, r'r.
struct Block {
    square: Vec<f64>,
    slope: Vec<f64>,
    /// Of each component.
    errors: Vec<f64>,
}

/// Normal equations, block by block, each course with the same weight.
struct Normal {
    count: usize,
    blocks: Vec<Block>,
}

impl Normal {
    /// `[course][candidate]`: candidate 0 is the base, candidate j + 1 has slot j moved by `steps[j]`.
    fn new(residuals: &[Vec<Residual>], steps: &[f64]) -> Self {
        let count = steps.len();
        let mut blocks = Vec::new();
        for course in residuals {
            let Some(base) = course.first().filter(|base| !base.of.is_empty()) else { continue };
            let ticks = base.of.len() / base.components;
            let weight = 1.0 / (ticks * residuals.len()) as f64;
            let length = ((BLOCK_S / base.period_s) as usize).max(1) * base.components;
            for start in (0..base.of.len()).step_by(length) {
                let range = start..(start + length).min(base.of.len());
                let mut block = Block {
                    square: vec![0.0; count * count],
                    slope: vec![0.0; count],
                    errors: vec![0.0; base.components],
                };
                let mut derivatives = vec![0.0; count];
                for at in range {
                    let error = base.of[at];
                    for (j, step) in steps.iter().enumerate() {
                        derivatives[j] = (course[j + 1].of[at] - error) / step;
                    }
                    for i in 0..count {
                        block.slope[i] += weight * derivatives[i] * error;
                        for j in 0..=i {
                            block.square[i * count + j] += weight * derivatives[i] * derivatives[j];
                        }
                    }
                    block.errors[at % base.components] += weight * error * error;
                }
                for i in 0..count {
                    for j in 0..i {
                        block.square[j * count + i] = block.square[i * count + j];
                    }
                }
                blocks.push(block);
            }
        }
        Self { count, blocks }
    }

    /// Sums of the blocks named.
    fn sums(&self, blocks: impl Iterator<Item = usize>) -> (Vec<f64>, Vec<f64>) {
        let (mut square, mut slope) = (vec![0.0; self.count * self.count], vec![0.0; self.count]);
        for block in blocks.filter_map(|block| self.blocks.get(block)) {
            square.iter_mut().zip(&block.square).for_each(|(sum, part)| *sum += part);
            slope.iter_mut().zip(&block.slope).for_each(|(sum, part)| *sum += part);
        }
        (square, slope)
    }

    /// Of one component, or of all.
    fn error(&self, component: Option<usize>) -> f64 {
        let of_block = |block: &Block| match component {
            Some(component) => block.errors.get(component).copied().unwrap_or(0.0),
            None => block.errors.iter().sum(),
        };
        self.blocks.iter().map(of_block).sum()
    }
}

/// What a step is chosen from.
struct Step<'n> {
    normal: &'n Normal,
    /// Preference: weight and distance of the present value from theory.
    weights: Vec<f64>,
    away: Vec<f64>,
    /// Room to the bounds.
    room: Vec<[f64; 2]>,
}

impl Step<'_> {
    /// The step that makes ½ d'Hd + g'd least inside the bounds: coordinate by coordinate, which converges for a convex problem.
    fn solve(&self, square: &[f64], slope: &[f64]) -> Vec<f64> {
        let count = self.normal.count;
        let mut step = vec![0.0; count];
        for _ in 0..SWEEPS {
            let mut moved = 0.0_f64;
            for i in 0..count {
                let own = square[i * count + i] + self.weights[i];
                if own <= 0.0 {
                    continue;
                }
                let others: f64 = (0..count).filter(|j| *j != i).map(|j| square[i * count + j] * step[j]).sum();
                let wanted = -(slope[i] + self.weights[i] * self.away[i] + others) / own;
                let new = wanted.clamp(self.room[i][0], self.room[i][1]);
                moved = moved.max((new - step[i]).abs() / (self.room[i][1] - self.room[i][0]).max(f64::MIN_POSITIVE));
                step[i] = new;
            }
            if moved < 1e-10 {
                break;
            }
        }
        step
    }
}

/// Steps of the differences: away from the nearest bound; the delay not across a whole position cycle, where its effect bends.
fn steps(group: &Group<'_>, gains: &[Gains]) -> Vec<f64> {
    let step = |slot: &super::group::Slot| {
        let (value, size) = (group.value(gains, slot), slot.gain.step(slot.range));
        let up = match slot.gain {
            Gain::Delay => {
                let cycle_s = slot.members.first().map_or(1.0, |member| {
                    group.machine.cycle.time_base.seconds(group.members[*member].data.position_cycle_ticks)
                });
                (value / cycle_s).fract() * cycle_s + size < cycle_s
            }
            _ => true,
        };
        let up = (up && value + size <= slot.range[1]) || value - size < slot.range[0];
        if up { size } else { -size }
    };
    group.slots.iter().map(step).collect()
}

fn normal(group: &Group<'_>, gains: &[Gains]) -> Normal {
    let steps = steps(group, gains);
    let mut candidates = vec![gains.to_vec()];
    for (slot, step) in group.slots.iter().zip(&steps) {
        let mut moved = gains.to_vec();
        let value = group.value(gains, slot) + step;
        for member in &slot.members {
            moved[*member] = moved[*member].with(slot.gain, value);
        }
        candidates.push(moved);
    }
    Normal::new(&group.residuals(&candidates), &steps)
}

fn step_from<'n>(group: &Group<'_>, normal: &'n Normal, gains: &[Gains], theory: &[Gains]) -> Step<'n> {
    // Of the axis itself: a rotary axis has other numbers than a linear one of its group.
    let scatter = |slot: &super::group::Slot| normal.error(group.component(slot)) / normal.blocks.len().max(1) as f64;
    let width = |slot: &super::group::Slot| {
        let steps = if slot.gain == Gain::Torque { 2.0 * PREFERENCE_STEPS } else { PREFERENCE_STEPS };
        (steps * slot.gain.step(slot.range)).max(f64::MIN_POSITIVE)
    };
    Step {
        normal,
        weights: group.slots.iter().map(|slot| scatter(slot) / (width(slot) * width(slot))).collect(),
        away: group.slots.iter().map(|slot| group.value(gains, slot) - group.value(theory, slot)).collect(),
        room: group
            .slots
            .iter()
            .map(|slot| [slot.range[0], slot.range[1]].map(|bound| bound - group.value(gains, slot)))
            .collect(),
    }
}

/// The least mean square near a start, and its score.
pub(super) fn gauss_newton(group: &Group<'_>, start: &[Gains], theory: &[Gains]) -> (Vec<Gains>, Score) {
    let mut gains = start.to_vec();
    for slot in &group.slots {
        let inside = group.value(&gains, slot);
        group.put(&mut gains, slot, inside);
    }
    let mut best = group.scores(std::slice::from_ref(&gains))[0];
    for _ in 0..PASSES {
        let normal = normal(group, &gains);
        let step = step_from(group, &normal, &gains, theory);
        let (square, slope) = normal.sums(0..normal.blocks.len());
        let whole = step.solve(&square, &slope);
        let candidates: Vec<Vec<Gains>> = STEP_SHARES
            .iter()
            .map(|share| {
                let mut moved = gains.clone();
                for (slot, part) in group.slots.iter().zip(&whole) {
                    let inside = group.value(&gains, slot) + share * part;
                    group.put(&mut moved, slot, inside);
                }
                moved
            })
            .collect();
        let scores = group.scores(&candidates);
        let found =
            (0..candidates.len()).min_by(|one, other| scores[*one].mean_square.total_cmp(&scores[*other].mean_square));
        match found {
            Some(place) if scores[place].mean_square < best.mean_square => {
                best = scores[place];
                gains.clone_from(&candidates[place]);
            }
            _ => break,
        }
    }
    (gains, best)
}

/// Intervals of the slots around `gains`.
pub(super) fn certainty(group: &Group<'_>, gains: &[Gains], theory: &[Gains]) -> Vec<Certainty> {
    let normal = normal(group, gains);
    let mut step = step_from(group, &normal, gains, theory);
    // Without bounds: an interval that ends at one would look more certain than it is.
    step.room.iter_mut().for_each(|room| *room = [-1e3, 1e3]);
    let (all_square, all_slope) = normal.sums(0..normal.blocks.len());
    let centre = step.solve(&all_square, &all_slope);
    let mut random = 0x9E37_79B9_7F4A_7C15_u64;
    let mut found: Vec<Vec<f64>> = vec![Vec::with_capacity(RESAMPLES); normal.count];
    let blocks = normal.blocks.len().max(1);
    for _ in 0..RESAMPLES {
        let chosen: Vec<usize> = (0..blocks).map(|_| below(&mut random, blocks)).collect();
        let (square, slope) = normal.sums(chosen.into_iter());
        for (values, part) in found.iter_mut().zip(step.solve(&square, &slope)) {
            values.push(part);
        }
    }
    let widening = widening(blocks);
    let certainty = |(place, slot): (usize, &super::group::Slot)| {
        let values = &mut found[place].clone();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values.get(((values.len() - 1) as f64 * share).round() as usize).copied().unwrap_or(0.0);
        let value = group.value(gains, slot);
        // Around the value that is written: what the last linear step says beside it is rounding and stick events.
        let (low, high) = (value + at(0.025) - centre[place], value + at(0.975) - centre[place]);
        let wider = |end: f64| value + widening * (end - value);
        let own = all_square[place * normal.count + place];
        let certain = own > step.weights[place] && high - low < TELLING_SHARE * (slot.range[1] - slot.range[0]);
        Certainty { low: wider(low.min(value)), high: wider(high.max(value)), certain }
    };
    group.slots.iter().enumerate().map(certainty).collect()
}

/// A bootstrap of few blocks is too narrow: Student's quantile [Abramowitz 1964, 26.7.5] over that of the normal distribution, and the scatter
/// with n - 1.
fn widening(blocks: usize) -> f64 {
    const NORMAL: f64 = 1.959_964;
    let freedom = blocks.max(2) as f64 - 1.0;
    let student = NORMAL + (2.372_3 + 2.822_5 / freedom) / freedom;
    student / NORMAL * ((freedom + 1.0) / freedom).sqrt()
}

/// xorshift64*, below a count.
fn below(state: &mut u64, count: usize) -> usize {
    *state ^= *state >> 12;
    *state ^= *state << 25;
    *state ^= *state >> 27;
    ((state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) as usize) % count.max(1)
}
