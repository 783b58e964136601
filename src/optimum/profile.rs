//! The square of the speed along a grid.
//!
//! In: its value and slope between intervals. Out: what it is inside them, the time that it takes, how much of the limits it uses. Does not
//! solve.

use super::collect::Piece;
use super::grid::{Grid, Interval, POINTS_RATIO, PathPoint, inside};

/// b and b' at every place between two intervals and at both ends, b'' at the start and the end of every interval.
///
/// (b'' would follow from b and b', as a small difference times a large factor where intervals are short.)
#[derive(Clone, Debug)]
pub(super) struct Profile {
    pub squares: Vec<f64>,
    pub slopes: Vec<f64>,
    pub bends: Vec<[f64; 2]>,
}

/// Weights of (b0, b0', b0'', b1'') of an interval for b, b' and b'' at a place in it.
pub(super) type Weights = [[f64; 4]; 3];

/// Nodes and weights of the five-point rule of Gauss and Legendre on 0 .. 1.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_4, 0.239_314_335_249_683_3),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_3),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// b below this share of its neighbours is none: the time would not be a number.
const SQUARE_MIN_RATIO: f64 = 1e-9;

/// Weights of the cubic at `ratio` of an interval of length h.
pub(super) fn weights(ratio: f64, h: f64) -> Weights {
    let (t, t2, t3) = (ratio, ratio * ratio, ratio * ratio * ratio);
    [
        [1.0, t * h, h * h * (t2 / 2.0 - t3 / 6.0), h * h * t3 / 6.0],
        [0.0, 1.0, h * (t - t2 / 2.0), h * t2 / 2.0],
        [0.0, 0.0, 1.0 - t, t],
    ]
}

/// Shares of limits that are used.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Used {
    pub velocity_ratio: f64,
    pub acceleration_ratio: f64,
    pub jerk_ratio: f64,
}

impl Used {
    pub(super) fn at(point: &PathPoint, [square, slope, bend]: [f64; 3]) -> Self {
        Self {
            velocity_ratio: (square.max(0.0) / point.square_max).sqrt(),
            acceleration_ratio: point.acceleration_ratio(square, slope),
            jerk_ratio: point.jerk_ratio(square, slope, bend),
        }
    }

    pub(super) fn most(self, other: Self) -> Self {
        Self {
            velocity_ratio: self.velocity_ratio.max(other.velocity_ratio),
            acceleration_ratio: self.acceleration_ratio.max(other.acceleration_ratio),
            jerk_ratio: self.jerk_ratio.max(other.jerk_ratio),
        }
    }

    /// By how much time has to be stretched so that all limits hold.
    pub(super) fn stretch_ratio(self) -> f64 {
        self.velocity_ratio.max(self.acceleration_ratio.sqrt()).max(self.jerk_ratio.cbrt()).max(1.0)
    }

    /// Largest share.
    pub(super) fn largest(self) -> f64 {
        self.velocity_ratio.powi(2).max(self.acceleration_ratio).max(self.jerk_ratio)
    }
}

impl Profile {
    /// The cubics with these values and slopes.
    pub(super) fn new(grid: &Grid, squares: Vec<f64>, slopes: Vec<f64>) -> Self {
        let bends = grid.intervals.iter().enumerate().map(|(i, interval)| {
            let h = interval.length_lu;
            let chord = (squares[i + 1] - squares[i]) / h;
            let [m, n] = [slopes[i], slopes[i + 1]];
            [(6.0 * chord - 4.0 * m - 2.0 * n) / h, (2.0 * m + 4.0 * n - 6.0 * chord) / h]
        });
        let bends = bends.collect();
        Self { squares, slopes, bends }
    }

    /// b, b' and b'' at a share of an interval.
    pub(super) fn at(&self, grid: &Grid, index: usize, ratio: f64) -> [f64; 3] {
        let [first, last] = self.bends[index];
        let nodes = [self.squares[index], self.slopes[index], first, last];
        weights(ratio, grid.intervals[index].length_lu).map(|row| row.iter().zip(nodes).map(|(w, x)| w * x).sum())
    }

    /// Time of an interval.
    pub(super) fn interval_s(&self, grid: &Grid, index: usize) -> f64 {
        let least = SQUARE_MIN_RATIO * self.squares[index].max(self.squares[index + 1]);
        let rate = |ratio: f64| 1.0 / self.at(grid, index, ratio)[0].max(least).sqrt();
        grid.intervals[index].length_lu * GAUSS.iter().map(|(ratio, weight)| weight * rate(*ratio)).sum::<f64>()
    }

    /// Time of the whole motion.
    pub(super) fn time_s(&self, grid: &Grid) -> f64 {
        let last = self.squares.len() - 1;
        let inside_s: f64 = (0..grid.intervals.len()).map(|i| self.interval_s(grid, i)).sum();
        grid.rests[0].time_s(self.squares[0]) + inside_s + grid.rests[1].time_s(self.squares[last])
    }

    /// Limits used at some places of an interval, its ends included.
    pub(super) fn used(&self, grid: &Grid, pieces: &[Piece], index: usize, places: usize) -> Used {
        let Interval { piece, from_lu, length_lu, .. } = &grid.intervals[index];
        let look = |i: usize| {
            let ratio = i as f64 / places as f64;
            Used::at(&pieces[*piece].point(from_lu + inside(ratio) * length_lu), self.at(grid, index, ratio))
        };
        (0..=places).map(look).fold(Used::default(), Used::most)
    }

    /// By how much time has to be stretched so that all limits hold at the places of the grid; infinite where the speed is no number.
    pub(super) fn stretch_ratio(&self, grid: &Grid) -> f64 {
        let places = self.squares.iter().zip(&grid.square_max).map(|(square, most)| (square / most).sqrt());
        let inside = (0..grid.intervals.len()).flat_map(|index| {
            let points = POINTS_RATIO.iter().zip(&grid.intervals[index].points);
            points.map(move |(ratio, point)| {
                let state = self.at(grid, index, *ratio);
                if state[0] > 0.0 { Used::at(point, state).stretch_ratio() } else { f64::INFINITY }
            })
        });
        places.chain(inside).fold(1.0, |most, ratio| if ratio.is_nan() { f64::INFINITY } else { most.max(ratio) })
    }

    /// The same motion, slower.
    pub(super) fn slowed(mut self, stretch_ratio: f64) -> Self {
        let factor = 1.0 / (stretch_ratio * stretch_ratio);
        let all = self.squares.iter_mut().chain(&mut self.slopes).chain(self.bends.as_flattened_mut());
        all.for_each(|value| *value *= factor);
        self
    }

    /// The same motion on a grid with intervals cut in two.
    pub(super) fn refined(&self, grid: &Grid, cut: &[bool]) -> Self {
        let (mut squares, mut slopes, mut bends) = (vec![self.squares[0]], vec![self.slopes[0]], Vec::new());
        for (i, cut) in cut.iter().enumerate() {
            let [first, last] = self.bends[i];
            if *cut {
                let [square, slope, bend] = self.at(grid, i, 0.5);
                squares.push(square);
                slopes.push(slope);
                bends.extend([[first, bend], [bend, last]]);
            } else {
                bends.push([first, last]);
            }
            squares.push(self.squares[i + 1]);
            slopes.push(self.slopes[i + 1]);
        }
        Self { squares, slopes, bends }
    }
}
