//! The time law `continuous`: acceleration carried over the ends of blocks, the limits of every axis kept everywhere.
//!
//! In: the pieces in the look-ahead window ([`Flow`]), front first. Out: the [`TimeLaw`] of the front piece. From the state that the front begins with the
//! fastest profile is planned that ends at rest inside the window (`chain`); as much of it is kept as the stop at its end does not touch,
//! and handed out piece by piece, so that a plan serves many pieces when the window is long. A plan that cannot be made, or does not keep every
//! limit, is not taken: the path goes on as planned before, to the stop at its end, which is why there is always a way to stop.
//! Does not know what a block is.

mod chain;
mod estimate;
mod grid;
mod held;
mod interior_point;
mod law;
mod refuge;
mod rows;

use super::limits::AxisRules;
use super::profile::SpeedCap;
use super::{Limit, LimitKind, TimeLaw};
use crate::kinematics::JointPath;
use chain::{Chain, Junction, Look, Planning, Profile, Start};
use grid::{Derivatives, End, Grid};
use std::collections::VecDeque;
use std::sync::Arc;

/// A plan reaches this many stopping distances beyond the piece that asks for it, if the window does.
const REACH_RATIO: f64 = 4.0;

/// Of a plan that ends in a stop which is not the program's, the last part is not kept: this many times the way from its last summit.
const DISTURBED_RATIO: f64 = 1.6;

/// Intervals of a plan at least, if the window has them.
const REACH_INTERVALS: usize = 24;

/// Where a plan begins or ends at rest in the middle of a path, its first and last interval are cut like this.
const CUTS_RATIO: [f64; 5] = [0.0, 0.08, 0.2, 0.5, 1.0];

/// A piece that moves, as this law sees it.
#[derive(Clone, Debug)]
pub(super) struct Flow {
    rules: Arc<AxisRules>,
    blend: bool,
    /// About the highest speeds at its ends.
    ends_lu_s: [f64; 2],
    grid: Option<Grid>,
}

/// A piece of the window.
pub(super) struct Piece<'a> {
    pub path: &'a JointPath,
    pub flow: &'a mut Flow,
    /// What the junction at its start allows.
    pub junction: SpeedCap,
    /// The path rests at its end.
    pub rests_after: bool,
}

/// Plans and hands out.
#[derive(Clone, Debug, Default)]
pub(super) struct Continuous {
    planning: Planning,
    chain: Chain,
    profile: Profile,
    /// Intervals of each piece that has not been handed out yet, front first.
    pieces: VecDeque<usize>,
    /// Interval with which the front begins.
    first: usize,
    /// Intervals from the start of the chain whose law is kept.
    kept: usize,
    /// Intervals before this one are those of the pieces as they are.
    uncut: usize,
    /// Intervals from here on brake for the end of the window, and from there on they feel it.
    braking: usize,
    disturbed: usize,
    /// The law of the front piece where there is no plan for it.
    refuge: Option<TimeLaw>,
}

impl Flow {
    /// A piece that moves; its curve has no step of direction or curvature inside.
    pub fn new(rules: Arc<AxisRules>, path: &JointPath, blend: bool) -> Self {
        let ends_lu_s = grid::end_speeds_lu_s(&rules, path);
        Self { rules, blend, ends_lu_s, grid: None }
    }

    /// Highest constant speeds at its ends; not positive or no number: nothing can move there.
    pub fn ends_lu_s(&self) -> [f64; 2] {
        self.ends_lu_s
    }
}

impl Continuous {
    /// The front piece has a law that stays.
    pub fn holds_front(&self) -> bool {
        self.pieces.front().is_some_and(|count| self.first + count <= self.kept)
    }

    /// Plans again from the start of the front piece. `pieces`: the window in order, without what does not move, up to a rest at most.
    pub fn plan(&mut self, pieces: &mut [Piece<'_>]) {
        let start = self.start();
        let count = cut_pieces(pieces, start);
        let pieces = &pieces[..count];
        let Some(last) = pieces.last() else { return };
        let rests = last.rests_after;
        let mut chain = Chain::default();
        let mut firsts = Vec::with_capacity(count);
        for (index, piece) in pieces.iter().enumerate() {
            firsts.push(chain.intervals.len());
            add_piece(&mut chain, piece, index == 0 && start == Start::Rest, index + 1 == count);
        }
        let ends = firsts.iter().skip(1).chain([&chain.intervals.len()]).copied().collect::<Vec<_>>();
        let counts: VecDeque<usize> = firsts.iter().zip(ends).map(|(first, end)| end - first).collect();
        let look = |index: usize, s_lu: f64| {
            let piece = firsts.partition_point(|first| *first <= index).saturating_sub(1);
            Derivatives::from(pieces[piece].path.at(s_lu))
        };
        let Some(profile) = self.attempt(&mut chain, start, &look) else {
            // What was planned before still stands, to its end.
            self.kept = self.chain.intervals.len();
            if self.pieces.is_empty() {
                self.refuge = pieces.first().and_then(|piece| piece.flow.grid.as_ref()).map(refuge::alone);
            }
            return;
        };
        let cut = if rests { 0 } else { CUTS_RATIO.len() - 1 };
        self.uncut = chain.intervals.len() - cut;
        (self.chain, self.profile, self.pieces, self.first) = (chain, profile, counts, 0);
        self.keep(rests);
    }

    /// A profile for `chain`. What is left of the plan before is a way that keeps every limit; where it does not brake for its own end it is about the
    /// fastest as well.
    fn attempt(&mut self, chain: &mut Chain, start: Start, look: &Look<'_>) -> Option<Profile> {
        let left = self.first..self.uncut.max(self.first);
        let points = self.profile.points.get(left).unwrap_or(&[]);
        let fast = points.get(..self.braking.saturating_sub(self.first)).unwrap_or(points);
        let planned = self.planning.plan(chain, start, fast, look);
        if planned.is_some() || points.len() <= fast.len() {
            return planned;
        }
        self.planning.plan(chain, start, points, look)
    }

    /// The law of the front piece, which is handed out.
    pub fn take_front(&mut self) -> Option<TimeLaw> {
        if let Some(law) = self.refuge.take() {
            return Some(law);
        }
        let count = self.pieces.pop_front()?;
        let range = self.first..self.first + count;
        self.first = range.end;
        let limit = |index| {
            let limit = self.profile.limit(&self.chain, index);
            let felt = index >= self.braking || (index >= self.disturbed && limit.axis.is_some());
            if felt { Limit { kind: LimitKind::LookAhead, axis: None } } else { limit }
        };
        Some(law::law(&self.chain, &self.profile, range, limit))
    }

    fn start(&self) -> Start {
        match self.profile.points.get(self.first) {
            Some(point) if point.speed_squared_lu2_s2 > 0.0 => Start::At(*point),
            _ => Start::Rest,
        }
    }

    /// Decides how much of a new plan stays.
    fn keep(&mut self, rests: bool) {
        let count = self.chain.intervals.len();
        (self.kept, self.braking, self.disturbed) = (count, count, count);
        if rests {
            return;
        }
        let ways: Vec<f64> = std::iter::once(0.0)
            .chain(self.chain.intervals.iter().scan(0.0, |way_lu, interval| {
                *way_lu += interval.length_lu();
                Some(*way_lu)
            }))
            .collect();
        let speed = |index: &usize| self.profile.points[*index].speed_squared_lu2_s2;
        let summit = (1..=count).rev().find(|index| speed(&(index - 1)) < speed(index)).unwrap_or(0);
        self.braking = summit;
        let kept_lu = ways[count] - DISTURBED_RATIO * (ways[count] - ways[summit]);
        self.kept = ways.partition_point(|way_lu| *way_lu <= kept_lu).saturating_sub(1);
        self.disturbed = self.kept;
    }
}

/// Cuts the pieces that a plan reaches into intervals; how many these are.
fn cut_pieces(pieces: &mut [Piece<'_>], start: Start) -> usize {
    let (mut beyond_ratio, mut intervals) = (0.0, 0);
    for index in 0..pieces.len() {
        let junction_lu_s = |piece: &Piece<'_>| piece.junction.velocity_lu_s;
        let before = index.checked_sub(1).map(|before| pieces[before].flow.ends_lu_s[1]);
        let after = pieces.get(index + 1).map(|next| (next.flow.ends_lu_s[0], junction_lu_s(next)));
        let piece = &mut pieces[index];
        let length_lu = piece.path.length_lu();
        if piece.flow.grid.is_none() {
            let own = piece.flow.ends_lu_s;
            let first = match before {
                Some(before_lu_s) => End::Speed(own[0].min(before_lu_s).min(piece.junction.velocity_lu_s)),
                None if start == Start::Rest => End::Rest,
                None => End::Speed(own[0]),
            };
            let last = match after {
                _ if piece.rests_after => End::Rest,
                Some((next_lu_s, junction_lu_s)) => End::Speed(own[1].min(next_lu_s).min(junction_lu_s)),
                None => End::Speed(own[1]),
            };
            piece.flow.grid = Some(Grid::new(&piece.flow.rules, piece.path, piece.flow.blend, [first, last]));
        }
        let Some(grid) = &piece.flow.grid else { continue };
        intervals += grid.intervals.len();
        if index > 0 {
            // Each way in stopping distances of its own speed.
            beyond_ratio += length_lu / grid.stop_lu;
        }
        if beyond_ratio >= REACH_RATIO && intervals >= REACH_INTERVALS {
            return index + 1;
        }
    }
    pieces.len()
}

/// Appends the intervals of a piece; where the plan begins or ends at rest there and the grid was not made for it, the first or last
/// interval is cut.
fn add_piece(chain: &mut Chain, piece: &Piece<'_>, starts_at_rest: bool, ends_at_rest: bool) {
    let Some(grid) = &piece.flow.grid else { return };
    let cut_first = starts_at_rest && !grid.rests[0];
    let cut_last = ends_at_rest && !grid.rests[1];
    let count = grid.intervals.len();
    let at_start = Junction {
        speed_squared_lu2_s2: piece.junction.velocity_lu_s * piece.junction.velocity_lu_s,
        limit: piece.junction.limit,
    };
    let free = Junction { speed_squared_lu2_s2: f64::INFINITY, limit: at_start.limit };
    let mut junction = if starts_at_rest { free } else { at_start };
    for (index, interval) in grid.intervals.iter().enumerate() {
        let mut borders = vec![];
        let h = interval.length_lu();
        if cut_first && index == 0 {
            borders.extend(CUTS_RATIO.map(|ratio| interval.start_lu + ratio * h));
        }
        if cut_last && index + 1 == count {
            let from = borders.pop().unwrap_or(interval.start_lu);
            let rest_lu = interval.end_lu - from;
            borders.extend(CUTS_RATIO.iter().rev().map(|ratio| interval.end_lu - ratio * rest_lu));
        }
        if borders.is_empty() {
            chain.intervals.push(interval.clone());
            chain.junctions.push(std::mem::replace(&mut junction, free));
            continue;
        }
        for pair in borders.windows(2).filter(|pair| pair[1] > pair[0]) {
            chain.intervals.push(interval.part(piece.path, pair[0], pair[1]));
            chain.junctions.push(std::mem::replace(&mut junction, free));
        }
    }
}
