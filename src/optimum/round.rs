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

/// Linear and quadratic cost of b / b̂: those of b^(-1/2) about 1, and ones with their least at 3.
const NEAR_COST: (f64, f64) = (-1.25, 0.75);
const FAR_COST: (f64, f64) = (-1.2, 0.4);

/// A round takes no more than this from b: the quadratic cost says nothing of a standstill.
const SLOWER_MIN_RATIO: f64 = 0.1;

/// Nor does it multiply b by more.
const FASTER_MAX_RATIO: f64 = 5.0;

/// A b̂ below this share of those at the ends of its interval is not used as it is.
const SQUARE_MIN_RATIO: f64 = 1e-6;

/// What the unknowns are measured in: b and b' at every place, b'' at the start and the end of every interval. (With b and b' alone, b'' of a
/// short interval is a small difference times a large factor, and the solver runs out of digits.)
struct Scale {
    squares: Vec<f64>,
    slopes: Vec<f64>,
    bends: Vec<f64>,
}

/// The fastest motion of the problem about `before`, which keeps all limits; `None` if it cannot be solved. `far`: before may be far from the
/// optimum, and the cost says that more speed is better up to three times b̂.
pub(super) fn solve(grid: &Grid, before: &Profile, far: bool) -> Option<Profile> {
    let places = grid.square_max.len();
    let scale = Scale::new(grid, before);
    let mut problem = Problem::new(2 * places + 2 * grid.intervals.len());
    ends(&mut problem, grid, &scale, if far { FAR_COST } else { NEAR_COST });
    for (index, interval) in grid.intervals.iter().enumerate() {
        goes_on(&mut problem, &scale, index, interval.length_lu);
    }
    let (linear, quadratic) = if far { FAR_COST } else { NEAR_COST };
    for (place, square_max) in grid.square_max.iter().enumerate() {
        problem.at_most(&[(2 * place, -1.0)], -SLOWER_MIN_RATIO);
        // A right side of 1e10 beside one of 1 would cost the solver its digits.
        problem.at_most(&[(2 * place, 1.0)], (square_max / scale.squares[place]).min(FASTER_MAX_RATIO));
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
            if i == 0 || i == 2 && last {
                accelerations(&mut problem, point, &at, &row);
            }
            jerks(&mut problem, point, &at, square, &row);
        }
        for (ratio, square_max) in BETWEEN_RATIO.into_iter().zip(interval.square_max_between) {
            let at = weights(ratio, interval.length_lu)[0];
            let unit = before.squares[index].max(before.squares[index + 1]);
            let least = SLOWER_MIN_RATIO * square_at(grid, before, index, ratio);
            problem.at_most(&scale.row(index, at.map(|w| -w / unit)), -least / unit);
            if square_max.is_finite() {
                problem.at_most(&scale.row(index, at.map(|w| w / square_max)), 1.0);
            }
        }
        bulging(&mut problem, &interval.points, interval.length_lu, &|weights| scale.row(index, weights));
        for (ratio, share) in BOOLE {
            let square = square_at(grid, before, index, ratio);
            let weight = share * interval.length_lu / square.sqrt();
            let at = scale.row(index, weights(ratio, interval.length_lu)[0].map(|w| w / square));
            problem.cost(&at, linear * weight, quadratic * weight);
            if ratio > 0.0 && ratio < 1.0 {
                problem.at_most(&at.map(|(column, value)| (column, -value)), -SLOWER_MIN_RATIO);
            }
        }
    }
    let found = problem.solve()?;
    let squares = (0..places).map(|i| found[2 * i] * scale.squares[i]).collect();
    let slopes = (0..places).map(|i| found[2 * i + 1] * scale.slopes[i]).collect();
    let bend = |index: usize, last: usize| found[2 * places + 2 * index + last] * scale.bends[index];
    let bends = (0..grid.intervals.len()).map(|index| [bend(index, 0), bend(index, 1)]).collect();
    Some(Profile { squares, slopes, bends })
}

/// b̂ at a share of an interval.
fn square_at(grid: &Grid, before: &Profile, index: usize, ratio: f64) -> f64 {
    let least = SQUARE_MIN_RATIO * before.squares[index].max(before.squares[index + 1]);
    before.at(grid, index, ratio)[0].max(least)
}

/// b' where the constant jerk from and to a rest meets the grid, and the time that it takes.
fn ends(problem: &mut Problem, grid: &Grid, scale: &Scale, (linear, quadratic): (f64, f64)) {
    let last = grid.square_max.len() - 1;
    for (place, rest, sign) in [(0, &grid.rests[0], 1.0), (last, &grid.rests[1], -1.0)] {
        let slope = sign * rest.exponent_ratio * scale.squares[place] / scale.slopes[place] / rest.length_lu;
        problem.equal(&[(2 * place + 1, 1.0), (2 * place, -slope)], 0.0);
    }
    for (place, rest) in [(0, &grid.rests[0]), (last, &grid.rests[1])] {
        let weight = rest.weight() / scale.squares[place].sqrt();
        problem.cost(&[(2 * place, 1.0)], linear * weight, quadratic * weight);
    }
}

fn accelerations(problem: &mut Problem, point: &PathPoint, at: &Weights, row: &impl Fn([f64; 4]) -> [(usize, f64); 4]) {
    for [d1, d2] in &point.accelerations {
        let demand: [f64; 4] = std::array::from_fn(|k| d2 * at[0][k] + d1 * at[1][k] / 2.0);
        problem.at_most(&row(demand), 1.0);
        problem.at_most(&row(demand.map(|w| -w)), 1.0);
    }
}

/// The acceleration between the places: on a line its share of the limit is a parabola, which stays below the greatest of its three Bernstein
/// coefficients. (A parabola that is 1, 1 and -1 at start, middle and end is 1.25 between: where the acceleration turns without
/// a limit of jerk, no finer grid would end that.)
fn bulging(
    problem: &mut Problem,
    points: &[PathPoint; 3],
    length_lu: f64,
    row: &impl Fn([f64; 4]) -> [(usize, f64); 4],
) {
    let at = POINTS_RATIO.map(|ratio| weights(ratio, length_lu));
    let [start, middle, end] = points;
    // Axes that count are the same on the whole interval, but where one begins to move: then the middle alone is looked at.
    let same = start.accelerations.len() == middle.accelerations.len()
        && middle.accelerations.len() == end.accelerations.len();
    for (axis, own) in middle.accelerations.iter().enumerate() {
        let demand = |[d1, d2]: &[f64; 2], place: usize| -> [f64; 4] {
            std::array::from_fn(|k| d2 * at[place][0][k] + d1 * at[place][1][k] / 2.0)
        };
        let centre = demand(own, 1);
        let bulge = if same {
            let ends = [demand(&start.accelerations[axis], 0), demand(&end.accelerations[axis], 2)];
            std::array::from_fn(|k| 2.0 * centre[k] - 0.5 * (ends[0][k] + ends[1][k]))
        } else {
            centre
        };
        problem.at_most(&row(bulge), 1.0);
        problem.at_most(&row(bulge.map(|w| -w)), 1.0);
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

/// b and b' at the end of an interval follow from its start and its b''.
fn goes_on(problem: &mut Problem, scale: &Scale, index: usize, length_lu: f64) {
    let at = weights(1.0, length_lu);
    let place = index + 1;
    for (order, unit) in [scale.squares[place], scale.slopes[place]].into_iter().enumerate() {
        let row = scale.row(index, at[order]).map(|(column, value)| (column, value / unit));
        let [a, b, c, d] = row;
        problem.equal(&[a, b, c, d, (2 * place + order, -1.0)], 0.0);
    }
}

impl Scale {
    fn new(grid: &Grid, before: &Profile) -> Self {
        let squares = before.squares.clone();
        let greatest = |shares: &mut dyn Iterator<Item = f64>| shares.map(f64::abs).fold(0.0, f64::max);
        // What the acceleration allows, if that is less than what would take b to 0 over an interval.
        let slopes = (0..squares.len()).map(|place| {
            let near = [place.checked_sub(1), Some(place)].into_iter().flatten().filter_map(|i| grid.intervals.get(i));
            near.map(|interval| {
                let share = greatest(&mut interval.points[1].accelerations.iter().map(|[d1, _]| *d1));
                (squares[place] / interval.length_lu).min(2.0 / share)
            })
            .fold(f64::INFINITY, f64::min)
        });
        let slopes: Vec<f64> = slopes.collect();
        let bends = grid.intervals.iter().enumerate().map(|(index, interval)| {
            let share = greatest(&mut interval.points[1].jerks.iter().map(|[d1, ..]| *d1));
            let [square, slope] = [&squares, &slopes].map(|units| units[index].max(units[index + 1]));
            (slope / interval.length_lu).min(2.0 / (share * square.sqrt()))
        });
        let bends = bends.collect();
        Self { squares, slopes, bends }
    }

    /// Weights of b0, b0', b0'', b1'' of an interval as a row.
    fn row(&self, index: usize, weights: [f64; 4]) -> [(usize, f64); 4] {
        let bends = 2 * self.squares.len() + 2 * index;
        [
            (2 * index, weights[0] * self.squares[index]),
            (2 * index + 1, weights[1] * self.slopes[index]),
            (bends, weights[2] * self.bends[index]),
            (bends + 1, weights[3] * self.bends[index]),
        ]
    }
}
