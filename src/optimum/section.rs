//! The fastest motion between two rests: rounds on grids that get finer.
//!
//! In: the [`Part`]s of a path. Out: [`Optimum`]. Each round begins with a motion that keeps all limits, and ends with a faster one. The first
//! motion is the control's, slowed until every limit holds at the places of the grid; or, where the control stands still on the way and where
//! this one is faster, that of the second-order problem, cut down to what the jerk allows at constant speed and slowed likewise.

use super::collect::{Part, Piece};
use super::grid::{Grid, Interval};
use super::profile::{Profile, Used};
use super::{NoOptimum, OptimalMotion, Optimum, SpeedPlace, round};

/// Pieces between two rests that are solved at once; more ask for more memory and time than the figure is worth.
const PIECES_MAX: usize = 5000;

/// Rounds end where one gains less than this share of the time. On a refined grid a few are enough: it begins near its optimum.
const ROUND_GAIN_RATIO: f64 = 1e-4;
const FIRST_ROUNDS_MAX: usize = 20;

/// Rounds at first that look for more speed wherever there is some to gain, whatever the time says: the first motion may be far too slow.
const FAR_ROUNDS: usize = 6;
const ROUNDS_MAX: usize = 4;

/// Grids end where one gains less than this share of the time.
const GRID_GAIN_RATIO: f64 = 3e-4;
const GRIDS_MAX: usize = 9;

/// An interval that uses less than this share of every limit, or more than is allowed by this share, is cut in two.
const UNUSED_RATIO: f64 = 0.97;
const EXCEEDED_RATIO: f64 = 1.003;
const EXCEEDED_VELOCITY_RATIO: f64 = 1.0005;

/// Places of an interval at which the result is looked at.
const CHECKED_PLACES: usize = 16;

/// All parts, one after another.
pub(super) fn solve(parts: Vec<Part>, progress: &mut dyn FnMut(usize, usize)) -> Result<Optimum, NoOptimum> {
    let count = |part: &Part| if let Part::Moves(pieces) = part { pieces.len() } else { 0 };
    let total: usize = parts.iter().map(count).sum();
    let mut done = 0;
    let mut optimum = Optimum::default();
    for part in parts {
        match part {
            Part::Rests { time_s } => {
                optimum.time_s += time_s;
                optimum.rest_s += time_s;
            }
            Part::Moves(pieces) => {
                if pieces.len() > PIECES_MAX {
                    return Err(NoOptimum::TooLong { pieces: pieces.len(), pieces_max: PIECES_MAX });
                }
                let motion = Section::new(&pieces).solved(&mut optimum, &mut || progress(done, total))?;
                done += pieces.len();
                optimum.time_s += motion.time_s;
                optimum.motions.push(motion);
            }
        }
    }
    Ok(optimum)
}

/// A motion from rest to rest that is being solved.
struct Section<'a> {
    pieces: &'a [Piece],
    grid: Grid,
    profile: Profile,
    /// The profile may be much slower than the optimum.
    far: bool,
}

impl<'a> Section<'a> {
    fn new(pieces: &'a [Piece]) -> Self {
        let grid = Grid::new(pieces);
        let slowed = |profile: Profile| {
            let slow_ratio = profile.stretch_ratio(&grid);
            let profile = profile.slowed(slow_ratio);
            let time_s = profile.time_s(&grid);
            (profile, if time_s.is_nan() { f64::INFINITY } else { time_s })
        };
        let driven = driven_profile(&grid, pieces);
        let smooth = Profile::new(&grid, driven.squares.clone(), slopes(&grid, &driven.squares));
        let (mut profile, mut time_s, mut far) = (driven.clone(), f64::INFINITY, false);
        for (candidate, is_far) in [(driven, false), (smooth, true), (first_profile(&grid), true)] {
            let (candidate, candidate_s) = slowed(candidate);
            if candidate_s < time_s {
                (profile, time_s, far) = (candidate, candidate_s, is_far);
            }
        }
        Self { pieces, grid, profile, far }
    }

    fn solved(mut self, optimum: &mut Optimum, progress: &mut dyn FnMut()) -> Result<OptimalMotion, NoOptimum> {
        let mut grid_s = f64::INFINITY;
        for number in 0..GRIDS_MAX {
            let slow_ratio = self.profile.stretch_ratio(&self.grid);
            self.profile = self.profile.slowed(slow_ratio);
            let mut time_s = self.profile.time_s(&self.grid);
            if !time_s.is_finite() {
                let line = self.pieces.first().map_or(0, |piece| piece.path.contour.block.line);
                return Err(NoOptimum::NotSolved { line });
            }
            for count in 0..if number == 0 { FIRST_ROUNDS_MAX } else { ROUNDS_MAX } {
                progress();
                optimum.rounds += 1;
                let far = self.far && number == 0 && count < FAR_ROUNDS;
                let Some(next) = round::solve(&self.grid, &self.profile, far) else { break };
                // What the solver was left with may be a little off.
                let slow_ratio = next.stretch_ratio(&self.grid);
                let next = next.slowed(slow_ratio);
                let next_s = next.time_s(&self.grid);
                let faster = next_s < time_s;
                if !faster {
                    break;
                }
                self.profile = next;
                let gained = time_s - next_s;
                time_s = next_s;
                if !far && gained <= ROUND_GAIN_RATIO * time_s {
                    break;
                }
            }
            let gained = grid_s - time_s;
            grid_s = time_s;
            let converged = gained.abs() <= GRID_GAIN_RATIO * time_s;
            let cut = self.to_cut(converged);
            if !cut.contains(&true) {
                break;
            }
            self.profile = self.profile.refined(&self.grid, &cut);
            self.grid = self.grid.refined(self.pieces, &cut);
        }
        optimum.grid_points += self.grid.intervals.len() + 1;
        Ok(self.motion())
    }

    /// Intervals that exceed limits inside, and unless the time has converged those that leave limits unused.
    fn to_cut(&self, converged: bool) -> Vec<bool> {
        let cut = |index: usize| {
            let eighths = (1..8).map(|i| self.used_at(index, f64::from(i) / 8.0));
            let most = eighths.fold(Used::default(), Used::most);
            if most.velocity_ratio > EXCEEDED_VELOCITY_RATIO || most.largest() > EXCEEDED_RATIO {
                return true;
            }
            !converged && [0.25, 0.5, 0.75].iter().any(|ratio| self.used_at(index, *ratio).largest() < UNUSED_RATIO)
        };
        (0..self.grid.intervals.len()).map(cut).collect()
    }

    fn used_at(&self, index: usize, ratio: f64) -> Used {
        let interval = &self.grid.intervals[index];
        let point = self.pieces[interval.piece].point(interval.from_lu + ratio * interval.length_lu);
        Used::at(&point, self.profile.at(&self.grid, index, ratio))
    }

    /// The motion, slowed by what it exceeds its limits between the places of the grid.
    fn motion(self) -> OptimalMotion {
        let Self { pieces, grid, profile, .. } = self;
        let used = (0..grid.intervals.len()).map(|index| profile.used(&grid, pieces, index, CHECKED_PLACES));
        let stretch_ratio = used.fold(Used::default(), Used::most).stretch_ratio();
        let place = |index: usize| {
            let place_lu = match grid.intervals.get(index) {
                Some(interval) => interval.place_lu,
                None => grid.intervals.last().map_or(0.0, |last| last.place_lu + last.length_lu),
            };
            let velocity_lu_s = profile.squares[index].sqrt() / stretch_ratio;
            let acceleration_lu_s2 = profile.slopes[index] / 2.0 / (stretch_ratio * stretch_ratio);
            SpeedPlace { place_lu, velocity_lu_s, acceleration_lu_s2 }
        };
        OptimalMotion {
            time_s: profile.time_s(&grid) * stretch_ratio,
            places: (0..profile.squares.len()).map(place).collect(),
            path: pieces.iter().map(|piece| piece.path.clone()).collect(),
        }
    }
}

/// The motion of the control.
fn driven_profile(grid: &Grid, pieces: &[Piece]) -> Profile {
    let at = |interval: &Interval, inside_lu: f64| pieces[interval.piece].driven_at(interval.from_lu + inside_lu);
    let starts = grid.intervals.iter().map(|interval| at(interval, 0.0));
    let end = grid.intervals.last().map(|last| at(last, last.length_lu));
    let (squares, mut slopes): (Vec<f64>, Vec<f64>) = starts.chain(end).map(|[square, slope]| (square, slope)).unzip();
    let last = squares.len() - 1;
    [slopes[0], slopes[last]] = rest_slopes(grid, &squares);
    Profile::new(grid, squares, slopes)
}

/// Slopes next to the rests.
fn rest_slopes(grid: &Grid, squares: &[f64]) -> [f64; 2] {
    let [first, last] = grid.rests.map(|rest| rest.exponent_ratio / rest.length_lu);
    [first * squares[0], -last * squares[squares.len() - 1]]
}

/// The fastest motion without a limit of jerk, below the speeds that the jerk allows where they are constant.
fn first_profile(grid: &Grid) -> Profile {
    let count = grid.square_max.len();
    let highest = f64::MAX.sqrt();
    let mut squares: Vec<f64> = grid.square_max.iter().map(|square| square.min(highest)).collect();
    for (i, interval) in grid.intervals.iter().enumerate() {
        for (point, place) in [
            (&interval.points[0], i),
            (&interval.points[1], i),
            (&interval.points[1], i + 1),
            (&interval.points[2], i + 1),
        ] {
            for [_, d2] in &point.accelerations {
                squares[place] = squares[place].min(1.0 / d2.abs());
            }
            for [.., d3] in &point.jerks {
                squares[place] = squares[place].min(d3.abs().powf(-2.0 / 3.0));
            }
        }
    }
    let slope_max = |index: usize| {
        let point = &grid.intervals[index].points[1];
        let weakest = point.accelerations.iter().map(|[d1, _]| d1.abs()).fold(0.0, f64::max);
        2.0 / weakest
    };
    for i in 1..count {
        squares[i] = squares[i].min(squares[i - 1] + slope_max(i - 1) * grid.intervals[i - 1].length_lu);
    }
    for i in (0..count - 1).rev() {
        squares[i] = squares[i].min(squares[i + 1] + slope_max(i) * grid.intervals[i].length_lu);
    }
    let slopes = slopes(grid, &squares);
    Profile::new(grid, squares, slopes)
}

/// Slopes with which the cubics between the places do not wave: the harmonic mean of those on either side, 0 at a summit or a valley.
fn slopes(grid: &Grid, squares: &[f64]) -> Vec<f64> {
    let chord = |index: usize| (squares[index + 1] - squares[index]) / grid.intervals[index].length_lu;
    let last = squares.len() - 1;
    (0..=last)
        .map(|place| match place {
            0 => rest_slopes(grid, squares)[0],
            _ if place == last => rest_slopes(grid, squares)[1],
            _ => {
                let (before, after) = (chord(place - 1), chord(place));
                if before * after > 0.0 { 2.0 * before * after / (before + after) } else { 0.0 }
            }
        })
        .collect()
}
