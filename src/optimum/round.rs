//! One round: the convex problem around a motion.
//!
//! In: a grid, the squares of the speed b̂ of the round before. Out: the fastest motion of the convex problem. Its limit of jerk, written as
//! share of the axis limit, is `g <= b̂^(-1/2) (3/2 - b / (2 b̂))`, the tangent of b^(-1/2): below it wherever b is. The time ∫ b^(-1/2) ds is
//! taken to the second order about b̂, which is exact where the rounds end. Does not repeat itself.

use super::cone::Problem;
use super::grid::{BETWEEN_RATIO, Grid, POINTS_RATIO, PathPoint};
use super::profile::{Profile, Weights, weights};

/// Boole's rule: with the ends and the middle alone a cubic that waves through them would cost no time.
const BOOLE: [(f64, f64); 5] =
    [(0.0, 7.0 / 90.0), (0.25, 32.0 / 90.0), (0.5, 12.0 / 90.0), (0.75, 32.0 / 90.0), (1.0, 7.0 / 90.0)];

/// A b̂ below this share of those at the ends of its interval is not used as it is.
const SQUARE_MIN_RATIO: f64 = 1e-6;

/// The unknowns are b / b̂ and b' l / b̂ with the length l of an interval: near 1.
struct Scale {
    squares: Vec<f64>,
    lengths_lu: Vec<f64>,
}

/// The fastest motion of the problem about `before`; `None` if it cannot be solved.
pub(super) fn solve(grid: &Grid, before: &Profile) -> Option<Profile> {
    let places = grid.square_max.len();
    let scale = Scale::new(grid, before);
    let mut problem = Problem::new(2 * places);
    ends(&mut problem, grid, &scale);
    for (place, square_max) in grid.square_max.iter().enumerate() {
        if square_max.is_finite() {
            problem.at_most(&[(2 * place, 1.0)], square_max / scale.squares[place]);
        }
    }
    for (index, interval) in grid.intervals.iter().enumerate() {
        for (i, point) in interval.points.iter().enumerate() {
            let at = weights(POINTS_RATIO[i], interval.length_lu);
            let square = square_at(grid, before, index, POINTS_RATIO[i]);
            let row = |weights: [f64; 4]| scale.row(index, weights);
            if i == 1 && point.square_max.is_finite() {
                problem.at_most(&row(at[0].map(|w| w / point.square_max)), 1.0);
            }
            // At its end only where the next interval does not look at the same point.
            let last = grid.intervals.get(index + 1).is_none_or(|next| next.piece != interval.piece);
            if i < 2 || last {
                accelerations(&mut problem, point, &at, &row);
            }
            jerks(&mut problem, point, &at, square, &row);
        }
        for (ratio, square_max) in BETWEEN_RATIO.into_iter().zip(interval.square_max_between) {
            if square_max.is_finite() {
                let at = weights(ratio, interval.length_lu)[0];
                problem.at_most(&scale.row(index, at.map(|w| w / square_max)), 1.0);
            }
        }
        for (ratio, share) in BOOLE {
            let square = square_at(grid, before, index, ratio);
            let weight = share * interval.length_lu / square.sqrt();
            let at = weights(ratio, interval.length_lu)[0].map(|w| w / square);
            problem.cost(&scale.row(index, at), -1.25 * weight, 0.75 * weight);
        }
    }
    let found = problem.solve()?;
    let squares = (0..places).map(|i| found[2 * i] * scale.squares[i]).collect();
    let slopes = (0..places).map(|i| found[2 * i + 1] * scale.squares[i] / scale.lengths_lu[i]).collect();
    Some(Profile { squares, slopes })
}

/// b̂ at a share of an interval.
fn square_at(grid: &Grid, before: &Profile, index: usize, ratio: f64) -> f64 {
    let least = SQUARE_MIN_RATIO * before.squares[index].max(before.squares[index + 1]);
    before.at(grid, index, ratio)[0].max(least)
}

/// b' where the constant jerk from and to a rest meets the grid, and the time that it takes.
fn ends(problem: &mut Problem, grid: &Grid, scale: &Scale) {
    let last = grid.square_max.len() - 1;
    for (place, rest, sign) in [(0, &grid.rests[0], 1.0), (last, &grid.rests[1], -1.0)] {
        let slope = sign * rest.exponent_ratio * scale.lengths_lu[place] / rest.length_lu;
        problem.equal(&[(2 * place + 1, 1.0), (2 * place, -slope)], 0.0);
    }
    for (place, rest) in [(0, &grid.rests[0]), (last, &grid.rests[1])] {
        let weight = rest.weight() / scale.squares[place].sqrt();
        problem.cost(&[(2 * place, 1.0)], -1.25 * weight, 0.75 * weight);
    }
}

fn accelerations(problem: &mut Problem, point: &PathPoint, at: &Weights, row: &impl Fn([f64; 4]) -> [(usize, f64); 4]) {
    for [d1, d2] in &point.accelerations {
        let demand: [f64; 4] = std::array::from_fn(|k| d2 * at[0][k] + d1 * at[1][k] / 2.0);
        problem.at_most(&row(demand), 1.0);
        problem.at_most(&row(demand.map(|w| -w)), 1.0);
    }
}

fn jerks(
    problem: &mut Problem,
    point: &PathPoint,
    at: &Weights,
    square: f64,
    row: &impl Fn([f64; 4]) -> [(usize, f64); 4],
) {
    let root = square.sqrt();
    for [d1, d2, d3] in &point.jerks {
        let demand: [f64; 4] =
            std::array::from_fn(|k| root * (d3 * at[0][k] + 1.5 * d2 * at[1][k] + 0.5 * d1 * at[2][k]));
        for sign in [1.0, -1.0] {
            let tangent: [f64; 4] = std::array::from_fn(|k| sign * demand[k] + at[0][k] / (2.0 * square));
            problem.at_most(&row(tangent), 1.5);
        }
    }
}

impl Scale {
    fn new(grid: &Grid, before: &Profile) -> Self {
        let length_lu = |place: usize| {
            let near = [place.checked_sub(1), Some(place)].into_iter().flatten().filter_map(|i| grid.intervals.get(i));
            near.map(|interval| interval.length_lu).fold(0.0, f64::max)
        };
        Self { squares: before.squares.clone(), lengths_lu: (0..before.squares.len()).map(length_lu).collect() }
    }

    /// Weights of b0, b0', b1, b1' of an interval as a row.
    fn row(&self, index: usize, weights: [f64; 4]) -> [(usize, f64); 4] {
        let [a, b] = [self.squares[index], self.squares[index + 1]];
        let slopes = [a / self.lengths_lu[index], b / self.lengths_lu[index + 1]];
        [
            (2 * index, weights[0] * a),
            (2 * index + 1, weights[1] * slopes[0]),
            (2 * index + 2, weights[2] * b),
            (2 * index + 3, weights[3] * slopes[1]),
        ]
    }
}
