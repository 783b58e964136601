//! The fastest motion between two rests: rounds on grids that get finer.
//!
//! In: the [`Part`]s of a path. Out: [`Optimum`]. Each round begins with a motion that keeps all limits, and ends with a faster one. The first
//! motion is the control's, slowed until every limit holds at the places of the grid; or, where the control stands still on the way and where
//! this one is faster, that of the second-order problem, cut down to what the jerk allows at constant speed and slowed likewise.

use super::collect::{Part, Piece};
use super::grid::{Grid, Interval};
use super::profile::{Profile, Used};
use super::{NoOptimum, OptimalMotion, Optimum, SpeedPlace, round};
use std::sync::Arc;

/// Pieces between two rests that are solved at once; more ask for more memory and time than the figure is worth.
const PIECES_MAX: usize = 5000;

/// Rounds end where one gains less than this share of the time.
const ROUND_GAIN_RATIO: f64 = 1e-4;
const ROUNDS_MAX: usize = 20;

/// On a refined grid a few are enough, unless they still gain more than this: it begins near its optimum.
const FEW_ROUNDS: usize = 4;
const FEW_GAIN_RATIO: f64 = 2e-3;

/// Rounds at first that look for more speed wherever there is some to gain, whatever the time says: the first motion may be far too slow.
const FAR_ROUNDS: usize = 6;

/// Grids end where one gains less than this share of the time.
const GRID_GAIN_RATIO: f64 = 3e-4;
const GRIDS_MAX: usize = 9;

/// An interval that uses less than this share of every limit, or more than is allowed by this share, is cut in two.
const UNUSED_RATIO: f64 = 0.97;
const EXCEEDED_RATIO: f64 = 1.003;
const EXCEEDED_VELOCITY_RATIO: f64 = 1.0005;

/// Intervals whose limits are exceeded between the places are solved again with less of them; so often, and if by more than this.
const TIGHTENINGS_MAX: usize = 4;
const ALLOWED_RATIO: f64 = 1.0003;

/// The control's motion is taken where it is faster by more than this share; so many places of each of its phases.
const DRIVEN_GAIN_RATIO: f64 = 1e-3;
const PHASE_PLACES: usize = 8;

/// Where b comes out negative it begins again at this share of the least beside it.
const DIP_RATIO: f64 = 0.1;

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
                let motion = Section::new(&pieces).solved(&mut optimum, &mut || progress(done, total));
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
    /// The last finer grid gained next to nothing.
    converged: bool,
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
        Self { pieces, grid, profile, far, converged: false }
    }

    fn solved(mut self, optimum: &mut Optimum, progress: &mut dyn FnMut()) -> OptimalMotion {
        let mut grid_s = f64::INFINITY;
        for number in 0..GRIDS_MAX {
            let coarser = (self.grid.clone(), self.profile.clone());
            if number > 0 {
                let cut = self.to_cut(self.converged);
                if !cut.contains(&true) {
                    break;
                }
                self.refine(&cut);
            }
            let Some(time_s) = self.rounds(number == 0, &mut optimum.rounds, progress) else {
                if number > 0 {
                    (self.grid, self.profile) = coarser;
                    break;
                }
                let line = self.pieces.first().map_or(0, |piece| piece.path.contour.block.line);
                optimum.unsolved_lines.push(line);
                let path = self.pieces.iter().map(|piece| piece.path.clone()).collect();
                return OptimalMotion { path, ..driven_motion(self.pieces) };
            };
            self.converged = (grid_s - time_s).abs() <= GRID_GAIN_RATIO * time_s;
            grid_s = time_s;
        }
        let mut best = self.slowed_everywhere();
        for _ in 0..TIGHTENINGS_MAX {
            let Some(grid) = self.grid.tightened(self.pieces, &self.used(), ALLOWED_RATIO) else { break };
            self.grid = grid;
            if self.rounds(false, &mut optimum.rounds, progress).is_none() {
                break;
            }
            let next = self.slowed_everywhere();
            if next.1 < best.1 {
                best = next;
            }
        }
        optimum.grid_points += self.grid.intervals.len() + 1;
        self.motion(best)
    }

    /// Some intervals cut in two.
    fn refine(&mut self, cut: &[bool]) {
        self.profile = self.profile.refined(&self.grid, cut);
        self.grid = self.grid.refined(self.pieces, cut);
        if self.profile.stretch_ratio(&self.grid).is_finite() {
            return;
        }
        // A cubic that is positive at its ends and its middle may be negative between them, at a deep dip: there it begins again, slower.
        let before = &self.profile.squares;
        let near = |place: usize| before[place.saturating_sub(1)..(place + 2).min(before.len())].iter();
        let least = |place: usize| near(place).copied().filter(|square| *square > 0.0).fold(f64::INFINITY, f64::min);
        let squares: Vec<f64> = (0..before.len()).map(|place| before[place].max(DIP_RATIO * least(place))).collect();
        let slopes = slopes(&self.grid, &squares);
        self.profile = Profile::new(&self.grid, squares, slopes);
    }

    /// Rounds on the grid as it is, while they gain; the time. `None` where the motion cannot be slowed into its limits.
    fn rounds(&mut self, first: bool, rounds: &mut usize, progress: &mut dyn FnMut()) -> Option<f64> {
        let slow_ratio = self.profile.stretch_ratio(&self.grid);
        self.profile = self.profile.clone().slowed(slow_ratio);
        let mut time_s = self.profile.time_s(&self.grid);
        if !time_s.is_finite() {
            return None;
        }
        for count in 0..ROUNDS_MAX {
            progress();
            *rounds += 1;
            let far = self.far && first && count < FAR_ROUNDS;
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
            let enough = !first && count + 1 >= FEW_ROUNDS && gained <= FEW_GAIN_RATIO * time_s;
            if !far && (enough || gained <= ROUND_GAIN_RATIO * time_s) {
                break;
            }
        }
        Some(time_s)
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

    /// What each interval uses of the limits of its machine, at many places.
    fn used(&self) -> Vec<Used> {
        let used = |index| self.profile.used(&self.grid, self.pieces, index, CHECKED_PLACES);
        (0..self.grid.intervals.len()).map(used).collect()
    }

    /// The motion, slowed by what it exceeds its limits between the places of the grid; its time.
    fn slowed_everywhere(&self) -> (Profile, f64) {
        let stretch_ratio = self.used().into_iter().fold(Used::default(), Used::most).stretch_ratio();
        (self.profile.clone().slowed(stretch_ratio), self.profile.time_s(&self.grid) * stretch_ratio)
    }

    fn motion(self, (profile, time_s): (Profile, f64)) -> OptimalMotion {
        let Self { pieces, grid, .. } = self;
        let path = pieces.iter().map(|piece| piece.path.clone()).collect();
        let driven = driven_motion(pieces);
        if driven.time_s < (1.0 - DRIVEN_GAIN_RATIO) * time_s {
            return OptimalMotion { path, ..driven };
        }
        let place = |index: usize| {
            let place_lu = match grid.intervals.get(index) {
                Some(interval) => interval.place_lu,
                None => grid.intervals.last().map_or(0.0, |last| last.place_lu + last.length_lu),
            };
            let velocity_lu_s = profile.squares[index].sqrt();
            SpeedPlace { place_lu, velocity_lu_s, acceleration_lu_s2: profile.slopes[index] / 2.0 }
        };
        // Where both are the same but for the grid nobody is faster than the other.
        let time_s = time_s.min(driven.time_s);
        OptimalMotion { time_s, places: (0..profile.squares.len()).map(place).collect(), path }
    }
}

/// The control's motion, without its path. Parts of a spline that was cut have one law.
fn driven_motion(pieces: &[Piece]) -> OptimalMotion {
    let (mut motion, mut start_lu) = (OptimalMotion::default(), 0.0);
    for (index, Piece { driven: (law, _), .. }) in pieces.iter().enumerate() {
        if index > 0 && Arc::ptr_eq(law, &pieces[index - 1].driven.0) {
            continue;
        }
        for phase in law.phases() {
            let places = (1..=PHASE_PLACES).map(|i| phase.at(phase.duration_s * i as f64 / PHASE_PLACES as f64));
            motion.places.extend(places.filter(|state| state.velocity_lu_s > 0.0).map(|state| SpeedPlace {
                place_lu: start_lu + state.position_lu,
                velocity_lu_s: state.velocity_lu_s,
                acceleration_lu_s2: state.acceleration_lu_s2,
            }));
        }
        motion.time_s += law.duration_s();
        start_lu += law.phases().last().map_or(0.0, |phase| phase.at(phase.duration_s).position_lu);
    }
    motion
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
