//! The time law `continuous`: acceleration carried over the ends of blocks, the limits of every axis kept everywhere.
//!
//! In: the pieces in the look-ahead window ([`Flow`]), front first. Out: the [`TimeLaw`] of the front piece. From the state that the front begins with the
//! fastest profile is planned that ends at rest inside the window (`chain`); as much of it is kept as the stop at its end does not touch,
//! and handed out piece by piece, so that a plan serves many pieces when the window is long. A plan that cannot be made, or does not keep every
//! limit, is not taken: the path goes on as planned before, to the stop at its end, which is why there is always a way to stop.
//! A change of the feed override while the front piece moves is a new plan from there (`change`).
//! Does not know what a block is.

mod chain;
mod change;
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
use crate::interpreter::Feed;
use crate::kinematics::JointPath;
use chain::{Chain, Junction, Planning, Profile, Start};
pub(super) use change::Change;
use change::Regime;
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
    /// Those of its modes.
    programmed: Arc<AxisRules>,
    /// The same under the override that it was looked at with last.
    rules: Arc<AxisRules>,
    override_ratio: f64,
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

impl Piece<'_> {
    /// The feed override leaves it alone.
    fn is_rapid(&self) -> bool {
        self.path.contour.feed == Feed::Rapid
    }
}

/// A window as a chain.
#[derive(Clone, Debug, Default)]
struct Draft {
    chain: Chain,
    /// Interval with which each piece begins.
    firsts: Vec<usize>,
    /// It ends where the path rests.
    rests: bool,
    /// Its intervals are not those of the grids.
    recut: bool,
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
    /// The feed override, and where the front piece stands under it.
    regime: Regime,
}

impl Flow {
    /// A piece that moves; its curve has no step of direction or curvature inside.
    pub fn new(rules: Arc<AxisRules>, path: &JointPath, blend: bool) -> Self {
        let ends_lu_s = grid::end_speeds_lu_s(&rules, path);
        Self { programmed: rules.clone(), rules, override_ratio: 1.0, blend, ends_lu_s, grid: None }
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

    /// Plans again from where the front piece stands. `pieces`: the window in order, without what does not move, up to a rest at most.
    pub fn plan(&mut self, pieces: &mut [Piece<'_>]) {
        let pieces = self.regime.allowed(pieces);
        if !self.lay(pieces) {
            // What was planned before still stands, to its end.
            self.kept = self.chain.intervals.len();
            if self.pieces.is_empty() {
                self.refuge = pieces.first().and_then(|piece| piece.flow.grid.as_ref()).map(refuge::alone);
            }
        }
    }

    /// A new plan, if there is one.
    fn lay(&mut self, pieces: &mut [Piece<'_>]) -> bool {
        let start = self.start();
        let count = self.cut_pieces(pieces, start);
        let pieces = &pieces[..count];
        let mut draft = self.draft(pieces, start);
        if self.regime.settling_lu > 0.0 {
            self.settle(&mut draft, pieces, self.regime.settling_lu);
        }
        let Some(profile) = self.attempt(&mut draft, pieces, start) else { return false };
        self.adopt(draft, profile);
        true
    }

    /// The pieces as a chain.
    fn draft(&self, pieces: &[Piece<'_>], start: Start) -> Draft {
        let mut draft = Draft { rests: pieces.last().is_some_and(|last| last.rests_after), ..Draft::default() };
        for (index, piece) in pieces.iter().enumerate() {
            draft.firsts.push(draft.chain.intervals.len());
            let Some(grid) = &piece.flow.grid else { continue };
            let joined = index > 0 || self.regime.from_lu == 0.0;
            let rests = [index == 0 && start == Start::Rest, index + 1 == pieces.len()];
            add_piece(&mut draft.chain, piece, grid, joined, rests);
        }
        draft
    }

    /// Takes a plan over; how much of it stays.
    fn adopt(&mut self, draft: Draft, profile: Profile) {
        let Draft { chain, firsts, rests, recut } = draft;
        let ends = firsts.iter().skip(1).copied().chain([chain.intervals.len()]);
        self.pieces = firsts.iter().zip(ends).map(|(first, end)| end - first).collect();
        let cut = if rests { 0 } else { CUTS_RATIO.len() - 1 };
        self.uncut = chain.intervals.len() - cut;
        (self.chain, self.profile, self.first) = (chain, profile, 0);
        (self.regime.point, self.regime.recut) = (None, recut);
        self.keep(rests);
    }

    /// A profile for `chain`. What is left of the plan before is a way that keeps every limit; where it does not brake for its own end it is about the
    /// fastest as well.
    fn attempt(&mut self, draft: &mut Draft, pieces: &[Piece<'_>], start: Start) -> Option<Profile> {
        let firsts = draft.firsts.clone();
        let look = look(pieces, &firsts);
        if self.regime.recut || draft.recut {
            return self.attempt_anew(draft, start, &look);
        }
        let chain = &mut draft.chain;
        let left = self.first..self.uncut.max(self.first);
        let points = self.profile.points.get(left).unwrap_or(&[]);
        let fast = points.get(..self.braking.saturating_sub(self.first)).unwrap_or(points);
        let planned = self.planning.plan(chain, start, fast, &look);
        if planned.is_some() || points.len() <= fast.len() {
            return planned;
        }
        self.planning.plan(chain, start, points, &look)
    }

    /// The law of the front piece from where it stands, up to its end or to a stop inside.
    pub fn front_law(&self) -> Option<TimeLaw> {
        if let Some(law) = &self.refuge {
            return Some(law.clone());
        }
        let range = self.first..self.first + self.pieces.front()?;
        let limit = |index| {
            let limit = self.profile.limit(&self.chain, index);
            let felt = index >= self.braking || (index >= self.disturbed && limit.axis.is_some());
            if felt { Limit { kind: LimitKind::LookAhead, axis: None } } else { limit }
        };
        Some(law::law(&self.chain, &self.profile, range, limit))
    }

    /// The front piece is handed out, or has come to rest inside at this place.
    pub fn pass_front(&mut self, rest_lu: Option<f64>) {
        let refuge = self.refuge.take().is_some();
        if let Some(count) = self.pieces.pop_front().filter(|_| !refuge) {
            let range = self.first..self.first + count;
            let way_lu: f64 = self.chain.intervals[range.clone()].iter().map(grid::Interval::length_lu).sum();
            self.regime.settling_lu -= way_lu;
            self.first = range.end;
        }
        (self.regime.from_lu, self.regime.point) = (rest_lu.unwrap_or(0.0), None);
    }

    fn start(&self) -> Start {
        match self.regime.point.as_ref().or_else(|| self.profile.points.get(self.first)) {
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

/// Derivatives on the curve of an interval.
fn look<'a>(pieces: &'a [Piece<'_>], firsts: &'a [usize]) -> impl Fn(usize, f64) -> Derivatives + use<'a> {
    let paths: Vec<&JointPath> = pieces.iter().map(|piece| piece.path).collect();
    move |index, s_lu| {
        let piece = firsts.partition_point(|first| *first <= index).saturating_sub(1);
        Derivatives::from(paths[piece].at(s_lu))
    }
}

impl Continuous {
    /// Cuts the pieces that a plan reaches into intervals; how many these are.
    fn cut_pieces(&mut self, pieces: &mut [Piece<'_>], start: Start) -> usize {
        let (mut beyond_ratio, mut intervals, mut ahead_lu) = (0.0, 0, 0.0);
        // A way as planned before has its stop where that ends, however slow the new plan is.
        let least = if self.regime.changes() { self.pieces.len() } else { 0 };
        for index in 0..pieces.len() {
            self.regime.look(&mut pieces[index]);
            if let Some(next) = pieces.get_mut(index + 1) {
                self.regime.look(next);
            }
            let junction_lu_s = |piece: &Piece<'_>| piece.junction.velocity_lu_s;
            let before = index.checked_sub(1).map(|before| pieces[before].flow.ends_lu_s[1]);
            let after = pieces.get(index + 1).map(|next| (next.flow.ends_lu_s[0], junction_lu_s(next)));
            let piece = &mut pieces[index];
            let length_lu = piece.path.length_lu();
            if piece.flow.grid.is_none() {
                let own = piece.flow.ends_lu_s;
                let first = match (before, start) {
                    (Some(before_lu_s), _) => End::Speed(own[0].min(before_lu_s).min(piece.junction.velocity_lu_s)),
                    (None, Start::Rest) => End::Rest,
                    (None, Start::At(point)) if self.regime.from_lu > 0.0 => {
                        End::Speed(point.speed_squared_lu2_s2.sqrt())
                    }
                    (None, Start::At(_)) => End::Speed(own[0]),
                };
                let last = match after {
                    _ if piece.rests_after => End::Rest,
                    Some((next_lu_s, junction_lu_s)) => End::Speed(own[1].min(next_lu_s).min(junction_lu_s)),
                    None => End::Speed(own[1]),
                };
                let ends = [first, last];
                let stretch = self.regime.stretch(piece.path, ends, (index > 0).then_some(ahead_lu));
                let Flow { rules, blend, .. } = &*piece.flow;
                piece.flow.grid = Some(Grid::of_stretch(rules, piece.path, *blend, &stretch));
            }
            ahead_lu += length_lu - if index == 0 { self.regime.from_lu } else { 0.0 };
            let Some(grid) = &piece.flow.grid else { continue };
            intervals += grid.intervals.len();
            if index > 0 {
                // Each way in stopping distances of its own speed.
                beyond_ratio += length_lu / grid.stop_lu;
            }
            if beyond_ratio >= REACH_RATIO && intervals >= REACH_INTERVALS && index + 1 >= least {
                return index + 1;
            }
        }
        pieces.len()
    }
}

/// Appends the intervals of a piece; where the plan begins or ends at rest there and the grid was not made for it, the first or last
/// interval is cut. `joined`: it begins where the piece does.
fn add_piece(chain: &mut Chain, piece: &Piece<'_>, grid: &Grid, joined: bool, rests: [bool; 2]) {
    let [cut_first, cut_last] = [rests[0] && !grid.rests[0], rests[1] && !grid.rests[1]];
    let count = grid.intervals.len();
    let at_start = Junction {
        speed_squared_lu2_s2: piece.junction.velocity_lu_s * piece.junction.velocity_lu_s,
        limit: piece.junction.limit,
    };
    let free = Junction { speed_squared_lu2_s2: f64::INFINITY, limit: at_start.limit };
    let mut junction = if rests[0] || !joined { free } else { at_start };
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
