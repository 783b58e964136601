//! The affine model of the residuals around a set of gains, as sums over blocks of time.
//!
//! In: residuals of a base and of the base with each gain moved. Out: [`Normal`] with J'J, J'r and r'r of every block; [`Step`], the change of
//! gains that makes the mean square least. A preference for theory (its width is [`PREFERENCE_STEPS`] steps of a search) weighs as much as
//! the scatter of blocks leaves room for: where courses tell a gain it does nothing. Simulates nothing.

use super::gains::{Gain, Gains};
use super::group::{BLOCK_S, Group, Residual, Slot};

/// Width of the preference for theory.
const PREFERENCE_STEPS: f64 = 3.0;
/// Sweeps of the small bounded problem.
const SWEEPS: usize = 400;

/// Sums over one block: J'J, J'r, r'r.
#[derive(Clone)]
pub(super) struct Block {
    pub square: Vec<f64>,
    pub slope: Vec<f64>,
    /// Of each component.
    pub errors: Vec<f64>,
}

/// Normal equations, block by block, each course with the same weight.
#[derive(Clone)]
pub(super) struct Normal {
    pub count: usize,
    pub blocks: Vec<Block>,
}

impl Normal {
    /// `[course][candidate]`: the first candidate has these gains, candidate j + 1 has slot j moved by its difference step.
    pub fn around(group: &Group<'_>, gains: &[Gains], residuals: &[&[Residual]]) -> Self {
        let steps = difference_steps(group, gains);
        let count = steps.len();
        let mut blocks = Vec::new();
        for course in residuals {
            let Some(base) = course.first().filter(|base| !base.of.is_empty()) else { continue };
            let ticks = base.of.len() / base.components;
            let weight = 1.0 / (ticks * residuals.len()) as f64;
            let length = ((BLOCK_S / base.period_s) as usize).max(1) * base.components;
            for start in (0..base.of.len()).step_by(length) {
                blocks.push(block(course, &steps, start..(start + length).min(base.of.len()), weight));
            }
        }
        Self { count, blocks }
    }

    /// Sums of all blocks.
    pub fn sums(&self) -> (Vec<f64>, Vec<f64>) {
        let (mut square, mut slope) = (vec![0.0; self.count * self.count], vec![0.0; self.count]);
        for block in &self.blocks {
            square.iter_mut().zip(&block.square).for_each(|(sum, part)| *sum += part);
            slope.iter_mut().zip(&block.slope).for_each(|(sum, part)| *sum += part);
        }
        (square, slope)
    }

    /// r'r of one component, or of all.
    fn error(&self, component: Option<usize>) -> f64 {
        let of_block = |block: &Block| match component {
            Some(component) => block.errors.get(component).copied().unwrap_or(0.0),
            None => block.errors.iter().sum(),
        };
        self.blocks.iter().map(of_block).sum()
    }
}

fn block(course: &[Residual], steps: &[f64], range: std::ops::Range<usize>, weight: f64) -> Block {
    let count = steps.len();
    let base = &course[0];
    let mut block =
        Block { square: vec![0.0; count * count], slope: vec![0.0; count], errors: vec![0.0; base.components] };
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
    block
}

/// Steps of the differences: away from the nearest bound; the delay not across a whole position cycle, where its effect bends.
pub(super) fn difference_steps(group: &Group<'_>, gains: &[Gains]) -> Vec<f64> {
    let step = |slot: &Slot| {
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

/// What a step is chosen from.
pub(super) struct Step {
    count: usize,
    /// Preference: weight and distance of the present value from theory.
    pub weights: Vec<f64>,
    pub away: Vec<f64>,
    /// Room to the bounds.
    room: Vec<[f64; 2]>,
}

impl Step {
    pub fn new(group: &Group<'_>, normal: &Normal, gains: &[Gains], theory: &[Gains]) -> Self {
        // Of the axis itself: a rotary axis has other numbers than a linear one of its group.
        let scatter = |slot: &Slot| normal.error(group.component(slot)) / normal.blocks.len().max(1) as f64;
        let width = |slot: &Slot| {
            let steps = if slot.gain == Gain::Torque { 2.0 * PREFERENCE_STEPS } else { PREFERENCE_STEPS };
            (steps * slot.gain.step(slot.range)).max(f64::MIN_POSITIVE)
        };
        let room = |slot: &Slot| slot.range.map(|bound| bound - group.value(gains, slot));
        Self {
            count: normal.count,
            weights: group.slots.iter().map(|slot| scatter(slot) / (width(slot) * width(slot))).collect(),
            away: group.slots.iter().map(|slot| group.value(gains, slot) - group.value(theory, slot)).collect(),
            room: group.slots.iter().map(room).collect(),
        }
    }

    /// The step that makes ½ d'Hd + g'd least inside the bounds: coordinate by coordinate, which converges for a convex problem.
    pub fn solve(&self, normal: &Normal) -> Vec<f64> {
        let count = self.count;
        let (square, slope) = normal.sums();
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
                let new = wanted.clamp(self.room[i][0], self.room[i][1].max(self.room[i][0]));
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
