//! How certain gains are: 95 % intervals from the scatter of the courses.
//!
//! In: the affine model around the gains, block by block. Out: [`Certainty`] of every slot. Residuals are strongly correlated in time, so that
//! blocks of time count, not samples: the gains are solved again without each pair of blocks in turn (delete-a-group jackknife [Efron 1982]),
//! and the scatter of these gives the width, with the distance of what the affine models around the end and its neighbours predict: stick events
//! make them differ. Few blocks tell most of a gain (accelerations, reversals): the degrees of freedom for Student's
//! quantile are those of the blocks by what they weigh for that gain, so that a gain that two blocks tell is not called certain. The
//! intervals hold the scatter of the courses, not an error of the model.

use super::fit::Point;
use super::gains::Gains;
use super::group::{Group, Slot};
use super::normal::{Block, Step};
use crate::identify::student_t;
use nalgebra::{DMatrix, DVector};

/// An interval wider than this share of the bounds tells nothing of its own.
const TELLING_SHARE: f64 = 0.5;
/// Fewest degrees of freedom: Student's quantile is 4.3 there.
const FREEDOM_MIN: f64 = 2.0;

/// Fewer blocks have no scatter.
const BLOCKS_MIN: usize = 3;

/// Blocks that are left out together: a move accelerates in one and brakes in the next, at one feed and in one direction, and says the same twice.
const MOVE_BLOCKS: usize = 2;

/// Neighbouring blocks as one.
struct Together {
    square: DMatrix<f64>,
    slope: DVector<f64>,
}

impl Together {
    fn of(blocks: &[Block], count: usize) -> Self {
        let (mut square, mut slope) = (DMatrix::zeros(count, count), DVector::zeros(count));
        for block in blocks {
            square += DMatrix::from_row_slice(count, count, &block.square);
            slope += DVector::from_column_slice(&block.slope);
        }
        Self { square, slope }
    }
}

/// 95 % interval of a slot, inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Certainty {
    pub low: f64,
    pub high: f64,
    pub certain: bool,
}

/// Intervals of the slots around the gains of a point.
pub(super) fn certainty(group: &Group<'_>, point: &Point, theory: &[Gains]) -> Vec<Certainty> {
    let normal = &point.normal;
    let step = Step::new(group, normal, &point.gains, theory);
    let (square, slope) = normal.sums();
    let count = normal.count;
    let weights = DMatrix::from_diagonal(&DVector::from_column_slice(&step.weights));
    let curve = DMatrix::from_row_slice(count, count, &square) + &weights;
    let untold = || {
        let all = |slot: &Slot| Certainty { low: slot.range[0], high: slot.range[1], certain: false };
        group.slots.iter().map(all).collect()
    };
    let Some(inverse) = scaled_inverse(&curve).filter(|_| normal.blocks.len() >= BLOCKS_MIN) else { return untold() };
    let slope = DVector::from_column_slice(&slope) + &weights * DVector::from_column_slice(&step.away);
    let centre = -(&inverse * &slope);
    let left_out: Vec<Together> = normal.blocks.chunks(MOVE_BLOCKS).map(|blocks| Together::of(blocks, count)).collect();
    let blocks = left_out.len().max(1) as f64;
    let mut variance = vec![0.0; count];
    let mut shares: Vec<(f64, f64)> = vec![(0.0, 0.0); count];
    for Together { square: own, slope: own_slope } in &left_out {
        let Some(without) = scaled_inverse(&(&curve - own)) else { return untold() };
        let moved = -(without * (&slope - own_slope)) - &centre;
        let told = &inverse * own * &inverse;
        for place in 0..count {
            variance[place] += moved[place] * moved[place] * (blocks - 1.0) / blocks;
            let share = told[(place, place)].max(0.0);
            shares[place] = (shares[place].0 + share, shares[place].1 + share * share);
        }
    }
    let certainty = |(place, slot): (usize, &Slot)| {
        let (sum, squares) = shares[place];
        let freedom = (sum * sum / squares.max(f64::MIN_POSITIVE) - 1.0).clamp(FREEDOM_MIN, 1e6);
        let half = student_t(freedom) * (variance[place] + point.spread[place]).sqrt();
        let value = group.value(&point.gains, slot);
        let certain = square[place * count + place] > step.weights[place]
            && 2.0 * half < TELLING_SHARE * (slot.range[1] - slot.range[0]);
        Certainty { low: value - half, high: value + half, certain }
    };
    group.slots.iter().enumerate().map(certainty).collect()
}

/// Of a positive definite matrix whose rows have units of their own.
fn scaled_inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = DVector::from_iterator(matrix.nrows(), matrix.diagonal().iter().map(|own| 1.0 / own.sqrt()));
    if !scale.iter().all(|scale| scale.is_finite()) {
        return None;
    }
    let scale = DMatrix::from_diagonal(&scale);
    let inverse = (&scale * matrix * &scale).cholesky()?.inverse();
    Some(&scale * inverse * &scale)
}
