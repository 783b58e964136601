//! The time law `continuous`: acceleration carried over the ends of blocks, the limits of every axis kept everywhere.
//!
//! In: the pieces in the look-ahead window ([`Flow`]), front first. Out: the [`TimeLaw`] of the front piece. From the state that the front begins with the
//! fastest profile is planned that ends at rest inside the window (`chain`); as much of it is kept as the stop at its end does not touch,
//! and handed out piece by piece, so that a plan serves many pieces when the window is long. A plan that cannot be made, or does not keep every
//! limit, is not taken: the path goes on as planned before, to the stop at its end unless the next piece finds a plan, which is why there is always a
//! way to stop.
//! A change of the feed override while the front piece moves is a new plan from where it is (`change`).
//! Does not know what a block is.

mod along;
mod chain;
mod change;
mod estimate;
mod further;
mod grid;
mod group;
mod held;
mod interval;
mod interior_point;
mod law;
mod layout;
mod limit_lanes;
mod refuge;
mod regime;
mod rows;
mod sharpen;

use super::limits::AxisRules;
use super::profile::SpeedCap;
use super::{Limit, LimitKind, TimeLaw};
use crate::interpreter::Feed;
use crate::kinematics::{JointPath, JointState};
use chain::{Chain, PathPoint, Planning, Profile, Start};
pub(super) use change::Change;
use grid::{End, Grid};
use group::{Brief, NEAR_PIECES, Stretch};
use interval::{Derivatives, Tangent};
use layout::{Layout, Place};
use regime::Regime;
use std::collections::VecDeque;
use std::sync::Arc;

/// A plan reaches this many stopping distances beyond the piece that asks for it, if the window does.
const REACH_RATIO: f64 = 8.0;

/// Intervals of a plan at least, if the window has them.
const REACH_INTERVALS: f64 = 24.0;

/// A path that rests within so many intervals is planned to its end at once. The problem is not convex: what is the fastest in a blend hangs on what is
/// planned before and after it, and so a little on where plans end, which is another place on the reversed path and on one with a block in two. No part of
/// the path is planned twice, so that it costs no more. The number bounds memory (about 60 MB) and is chosen, not derived.
const WHOLE_INTERVALS_MAX: f64 = 2000.0;

/// A grid for an end about which nothing was known yet serves an end that is slower, down to this share.
const SLOWER_RATIO: f64 = 0.8;

/// So many pieces more than the plan before looked at are in sight of a plan at first.
const MORE_PIECES: usize = 2 * NEAR_PIECES;

/// Places nearer to each other than this share of an interval are one.
const SAME_PLACE_RATIO: f64 = 1e-9;

/// A piece that moves, as this law sees it.
#[derive(Clone, Debug)]
pub(super) struct Flow {
    /// Those of its modes.
    programmed: Arc<AxisRules>,
    /// The same under the override that it was looked at with last.
    rules: Arc<AxisRules>,
    override_ratio: f64,
    /// Of those that the path may still be as fast as under (`Regime`).
    fastest_ratio: f64,
    blend: bool,
    /// About the highest speeds at its ends.
    ends_lu_s: [f64; 2],
    tangent: Tangent,
    /// All of it as one interval, where it is that short and smooth.
    brief: Option<Box<Brief>>,
    grid: Option<Grid>,
}

/// A piece that moves, before a plan looks at it. Most of a long window waits long for that: what a plan needs is made when it gets there.
#[derive(Clone, Debug)]
pub(super) struct Flowing {
    rules: Arc<AxisRules>,
    blend: bool,
    /// Highest constant speeds at its ends, of these places alone.
    places_lu_s: [f64; 2],
    flow: Option<Box<Flow>>,
}

/// What of the window a plan is given: its pieces in order, without what does not move, up to a rest at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sight {
    All,
    /// The first ones of them only; `rests`: the path rests somewhere in the window.
    Part {
        rests: bool,
    },
}

/// The part of the window that a plan was given ends before what it needs.
#[derive(Clone, Copy, Debug)]
struct TooShort;

/// How many pieces of the window a plan reaches.
struct Reach {
    /// As far as the stop at its end does not touch what is handed out next.
    usual: usize,
    /// To the rest of the path, where that is near enough; else the usual.
    whole: usize,
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

/// Plans and hands out.
#[derive(Clone, Debug, Default)]
pub(super) struct Continuous {
    planning: Planning,
    chain: Chain,
    profile: Profile,
    /// Where in the chain the pieces are that have not been handed out yet, front first.
    places: VecDeque<Place>,
    /// Interval with which the front begins.
    first: usize,
    /// Intervals from the start of the chain whose law is kept.
    kept: usize,
    /// Intervals from here on are there for the stop at the end of the window only.
    uncut: usize,
    /// Intervals from here on brake for the end of the window, and from there on they feel it.
    braking: usize,
    disturbed: usize,
    /// Since the last rest no plan of the whole path was found: it is not looked for again.
    usual_only: bool,
    /// The law of the front piece where there is no plan for it.
    refuge: Option<TimeLaw>,
    /// The feed override, and where the front piece stands under it.
    regime: Regime,
    /// How many pieces the last plan looked at.
    looked_at: usize,
}

impl Flowing {
    /// Its curve has no step of direction or curvature inside. `ends`: the states there.
    pub fn new(rules: Arc<AxisRules>, path: &JointPath, blend: bool, ends: [&JointState; 2]) -> Self {
        let places_lu_s = place_speeds_lu_s(&rules, path, ends);
        Self { rules, blend, places_lu_s, flow: None }
    }

    /// Highest constant speeds at its ends; not positive or no number: nothing can move there.
    pub fn ends_lu_s(&self) -> [f64; 2] {
        self.places_lu_s
    }

    /// As plans need it.
    pub fn look(&mut self, path: &JointPath) -> &mut Flow {
        let Self { rules, blend, places_lu_s, flow } = self;
        flow.get_or_insert_with(|| {
            let ends = [path.at(0.0), path.at(path.length_lu())];
            Box::new(Flow::new(rules.clone(), path, *blend, ends.each_ref(), *places_lu_s))
        })
    }
}

/// Highest constant speeds at the ends of a piece.
fn place_speeds_lu_s(rules: &AxisRules, path: &JointPath, ends: [&JointState; 2]) -> [f64; 2] {
    let rules = rules.throughout(path);
    let speed_at = |state: &JointState| grid::constant_speed_lu_s(rules, path, &Derivatives::from(*state));
    let first_lu_s = speed_at(ends[0]);
    [first_lu_s, if path.is_straight() { first_lu_s } else { speed_at(ends[1]) }]
}

impl Flow {
    /// `places_lu_s`: the highest constant speeds at its ends.
    fn new(
        rules: Arc<AxisRules>,
        path: &JointPath,
        blend: bool,
        ends: [&JointState; 2],
        places_lu_s: [f64; 2],
    ) -> Self {
        let ends = ends.map(|state| Derivatives::from(*state));
        let tangent = Tangent::between(rules.throughout(path), blend, [&ends[0].first, &ends[1].first]);
        let brief = if blend { None } else { Brief::new(&rules, path, &tangent, ends, places_lu_s).map(Box::new) };
        let ends_lu_s = match &brief {
            Some(brief) => [brief.speed_lu_s; 2],
            None => grid::end_speeds_lu_s(&rules, path, ends[0], places_lu_s),
        };
        let (override_ratio, fastest_ratio) = (1.0, 1.0);
        Self {
            programmed: rules.clone(),
            rules,
            override_ratio,
            fastest_ratio,
            blend,
            ends_lu_s,
            tangent,
            brief,
            grid: None,
        }
    }

    /// The same under other rules.
    fn follow(&mut self, rules: Arc<AxisRules>, path: &JointPath) {
        let ends = [path.at(0.0), path.at(path.length_lu())];
        let places_lu_s = place_speeds_lu_s(&rules, path, ends.each_ref());
        let new = Self::new(rules, path, self.blend, ends.each_ref(), places_lu_s);
        let Self { override_ratio, fastest_ratio, .. } = *self;
        *self = Self { programmed: self.programmed.clone(), override_ratio, fastest_ratio, ..new };
    }

    /// The way that a stop from its highest speed takes, about.
    fn stop_lu(&self) -> Option<f64> {
        let brief = self.brief.as_ref().map(|brief| self.tangent.stop_lu(brief.speed_lu_s));
        brief.or_else(|| self.grid.as_ref().map(|grid| grid.stop_lu))
    }
}

impl Continuous {
    /// The front piece has a law that stays.
    pub fn holds_front(&self) -> bool {
        self.places.front().is_some_and(|place| place.intervals.end <= self.kept)
    }

    /// How many pieces of the window the next plan will probably look at, at least; a plan for an override of 0 % must know all.
    pub fn looks_at(&self) -> usize {
        if self.override_ratio() == 0.0 { usize::MAX } else { self.looked_at.max(self.places.len()) + MORE_PIECES }
    }

    /// Plans again from the start of the front piece; false: it must see more of the window.
    pub fn plan(&mut self, pieces: &mut [Piece<'_>], sight: Sight) -> bool {
        let pieces = self.regime.allowed(pieces);
        match self.lay(pieces, sight) {
            Ok(true) => {}
            Ok(false) => {
                // What was planned before still stands, to its end; the next piece, with more of the window in sight, tries again.
                self.kept = layout::handed_out(&self.places);
                if self.places.is_empty() {
                    self.refuge = pieces.first().and_then(|piece| piece.flow.grid.as_ref()).map(refuge::alone);
                }
            }
            Err(TooShort) => return false,
        }
        true
    }

    /// A new plan, if there is one.
    fn lay(&mut self, pieces: &mut [Piece<'_>], sight: Sight) -> Result<bool, TooShort> {
        // From inside the front everything is cut again.
        let (changes, all) = (self.regime.point.is_some(), self.places.len());
        if sight != Sight::All && pieces.len() <= all {
            return Err(TooShort);
        }
        let known = if changes { 0 } else { self.known() };
        if self.lay_after(pieces, sight, known)? {
            return Ok(true);
        }
        // What is left of the plan before is a way that keeps every limit, but not on every other grid: so on its own.
        Ok(!changes && known < all && all < pieces.len() && self.lay_after(pieces, sight, all)?)
    }

    /// A new plan in which the first `known` pieces are cut as before.
    fn lay_after(&mut self, pieces: &mut [Piece<'_>], sight: Sight, known: usize) -> Result<bool, TooShort> {
        let start = self.start();
        let known = known.min(pieces.len().saturating_sub(1));
        let Reach { usual, whole } = self.reach(pieces, sight, known, start)?;
        self.usual_only &= start != Start::Rest;
        if whole > usual && !self.usual_only {
            if self.lay_so_far(pieces, known, whole) {
                return Ok(true);
            }
            self.usual_only = true;
        }
        Ok(self.lay_so_far(pieces, known, usual))
    }

    /// A new plan of the first `count` pieces.
    fn lay_so_far(&mut self, pieces: &mut [Piece<'_>], known: usize, count: usize) -> bool {
        let start = self.start();
        let mut layout = self.layout(pieces, count, known, start);
        let whole = pieces;
        let pieces = &whole[..count];
        let settles = self.regime.settling_lu > 0.0;
        if settles {
            self.settle(&mut layout, pieces, start, self.regime.settling_lu);
        }
        let planned = if settles {
            self.attempt_settling(&mut layout, pieces, start)
        } else {
            self.attempt(&mut layout, pieces, start)
        };
        let Some(mut profile) = planned else { return false };
        layout.remember(&mut whole[..count]);
        let pieces = &whole[..count];
        // Finer intervals would have the caps of their own again.
        if !settles {
            (layout, profile) = self.sharpened(layout, profile, pieces, start);
        }
        let rests = pieces.last().is_some_and(|last| last.rests_after);
        self.adopt(layout, profile, rests);
        true
    }

    /// The chain of the first `count` pieces; the first `known` ones have their places already.
    fn layout(&mut self, pieces: &mut [Piece<'_>], count: usize, known: usize, start: Start) -> Layout {
        let entry_lu2_s2 = match (start, self.places.get(known)) {
            (Start::At(point), _) if known == 0 => point.speed_squared_lu2_s2,
            (_, Some(place)) => self.profile.points[place.intervals.start].speed_squared_lu2_s2,
            (_, None) => self.profile.points.get(self.first).map_or(0.0, |point| point.speed_squared_lu2_s2),
        };
        let speeds_lu_s = group::border_speeds(&pieces[..count], known, entry_lu2_s2.sqrt());
        let cut_first = start == Start::Rest || self.regime.from_lu > 0.0;
        let entry = match start {
            Start::At(point) if known == 0 => Some(point),
            _ => None,
        };
        let stretches = group::stretches(&pieces[..count], known, &speeds_lu_s, cut_first, entry);
        let mut first = known;
        for stretch in &stretches {
            if let Stretch::Cut = stretch {
                self.cut_piece(pieces, first, start);
            }
            first += stretch.pieces();
        }
        let mut layout = Layout::continued(&self.chain, self.places.range(..known));
        layout.entry = entry;
        layout.extend(&pieces[..count], known, stretches, start == Start::Rest);
        if !pieces[..count].last().is_some_and(|last| last.rests_after) {
            layout.grade_stop(known, pieces);
        }
        if self.regime.from_lu > 0.0 && known == 0 {
            layout.frees_start();
        }
        if let (Start::At(point), 0) = (start, known) {
            layout.cut_rise(&point, pieces);
        }
        layout
    }

    /// Takes a plan over.
    fn adopt(&mut self, layout: Layout, profile: Profile, rests: bool) {
        let Layout { chain, places, uncut, .. } = layout;
        (self.chain, self.profile, self.places) = (chain, profile, places);
        (self.first, self.uncut) = (0, uncut);
        self.regime.point = None;
        self.keep(rests);
    }

    /// How many pieces from the front on stay cut as they are: those that do not brake for the end of the window or, where all do, all but the last,
    /// whose intervals are those of a stop.
    fn known(&self) -> usize {
        let braking = if self.braking > self.first { self.braking } else { usize::MAX };
        let known = self.places.iter().take_while(|place| place.intervals.end <= braking).count();
        let known = known.min(self.places.len().saturating_sub(1));
        // All pieces of an interval, or none.
        let shared = |known: usize| known > 0 && self.places[known - 1].intervals == self.places[known].intervals;
        (0..=known).rev().find(|known| !shared(*known)).unwrap_or(0)
    }

    /// A profile for `chain`. What is left of the plan before is a way that keeps every limit; where it does not brake for its own end it is about the
    /// fastest as well.
    fn attempt(&mut self, layout: &mut Layout, pieces: &[Piece<'_>], start: Start) -> Option<Profile> {
        let handed_out = layout::handed_out(&layout.places);
        let Layout { chain, owners, .. } = layout;
        let (points, fast) = self.hints(chain);
        let look = look(pieces, owners);
        self.planning.is_last = pieces.last().is_some_and(|last| last.rests_after);
        self.planning.handed_out = handed_out;
        let planned = self.planning.plan(chain, start, &points[..fast], &look);
        if planned.is_some() || points.len() <= fast {
            return planned;
        }
        let further = self.stop_further_on(chain);
        self.planning.plan(chain, start, &further, &look).or_else(|| self.planning.plan(chain, start, &points, &look))
    }

    /// What was planned before, at the borders of a new chain from the front on; how many of them do not brake for the end of the window.
    fn hints(&self, chain: &Chain) -> (Vec<PathPoint>, usize) {
        // The last interval is that of a stop: what it knows is its start.
        let end = self.chain.intervals.len().saturating_sub(1).max(self.first);
        let (mut points, mut fast) = (Vec::with_capacity(chain.intervals.len()), 0);
        let (mut index, mut way_lu) = (self.first, self.offset_lu());
        for interval in &chain.intervals {
            while index < end && way_lu >= self.chain.intervals[index].length_lu() * (1.0 - SAME_PLACE_RATIO) {
                way_lu -= self.chain.intervals[index].length_lu();
                index += 1;
            }
            if index >= end {
                break;
            }
            let share = (way_lu / self.chain.intervals[index].length_lu()).max(0.0);
            points.push(if share <= SAME_PLACE_RATIO {
                self.profile.points[index]
            } else {
                self.profile.inside(&self.chain, index, share).0
            });
            if index < self.braking.min(self.uncut) {
                fast = points.len();
            }
            way_lu += interval.length_lu();
        }
        (points, fast)
    }

    /// The law of the front piece from where it stands, up to its end or to a stop inside.
    pub fn front_law(&self) -> Option<TimeLaw> {
        if let Some(law) = &self.refuge {
            return Some(law.clone());
        }
        let limit = |index| {
            let (used_ratio, limit) = self.profile.limit(&self.chain, index);
            let own = limit.axis.is_none() && used_ratio > 0.0;
            let felt = index >= self.braking || (index >= self.disturbed && !own);
            if felt { Limit { kind: LimitKind::LookAhead, axis: None } } else { limit }
        };
        Some(law::law(&self.chain, &self.profile, self.places.front()?, limit))
    }

    /// The front piece is handed out, or has come to rest inside at this place.
    pub fn pass_front(&mut self, rest_lu: Option<f64>) {
        if self.refuge.take().is_none()
            && let Some(place) = self.places.pop_front()
        {
            self.regime.settling_lu -= place.way_lu(&self.chain);
            self.first = self.places.front().map_or(place.intervals.end, |next| next.intervals.start);
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
        self.braking = self.profile.summit(&self.chain);
        self.kept = self.profile.kept(&self.chain);
        self.disturbed = self.kept;
        self.kept = self.kept.max(layout::handed_out(&self.places));
    }

    /// How far a plan reaches; pieces that are no intervals by themselves get their grids. The first `known` ones have places already.
    fn reach(&mut self, pieces: &mut [Piece<'_>], sight: Sight, known: usize, start: Start) -> Result<Reach, TooShort> {
        let rests = match sight {
            Sight::All => pieces.last().is_some_and(|last| last.rests_after),
            Sight::Part { rests } => rests,
        };
        let (mut beyond_ratio, mut intervals, mut beyond_lu) = (0.0, 0.0, 0.0);
        let mut usual = None;
        for index in 0..pieces.len() {
            self.looked_at = index + 1;
            // How a piece is cut hangs on those after it, and whether the path rests after the last one is not known.
            if sight != Sight::All && index + NEAR_PIECES + 1 >= pieces.len() {
                return Err(TooShort);
            }
            pieces[index..].iter_mut().take(2).for_each(|piece| self.regime.look(piece));
            let length_lu = pieces[index].path.length_lu();
            // A piece at a rest is cut by its own grid.
            let at_rest = (index == 0 && start == Start::Rest) || pieces[index].rests_after;
            let flow = &pieces[index].flow;
            if index >= known && (at_rest || flow.brief.is_none()) {
                self.cut_piece(pieces, index, start);
            }
            let flow = &pieces[index].flow;
            let Some(stop_lu) = flow.stop_lu() else { continue };
            intervals += match (&flow.grid, &flow.brief) {
                (_, Some(brief)) => length_lu / (brief.speed_lu_s * flow.tangent.step_s),
                (Some(grid), None) => grid.intervals.len() as f64,
                (None, None) => 0.0,
            };
            if index > 0 {
                // Each way in stopping distances of its own speed.
                beyond_ratio += length_lu / stop_lu;
                beyond_lu += length_lu;
            }
            let enough = beyond_ratio >= REACH_RATIO && intervals >= REACH_INTERVALS;
            if usual.is_none() && enough && index >= known && beyond_lu >= self.regime.reach_lu() {
                usual = Some(index + 1);
            }
            if let Some(usual) = usual
                && (!rests || intervals > WHOLE_INTERVALS_MAX)
            {
                return Ok(Reach { usual, whole: usual });
            }
        }
        let whole = pieces.len();
        Ok(Reach { usual: usual.unwrap_or(whole), whole })
    }

    /// The usual reach in a window that is known whole.
    fn usual_reach(&mut self, pieces: &mut [Piece<'_>], start: Start) -> usize {
        self.reach(pieces, Sight::All, 0, start).map_or(pieces.len(), |reach| reach.usual)
    }

    /// Makes the grid of a piece, if it has none, or one for the end of a window that has moved on to a slow place.
    fn cut_piece(&self, pieces: &mut [Piece<'_>], index: usize, start: Start) {
        let is_last = index + 1 == pieces.len();
        if let Some(grid) = &pieces[index].flow.grid {
            let again = !is_last
                && index > 0
                && grid.open_lu_s.is_some_and(|v| group::speed_after_lu_s(pieces, index) < SLOWER_RATIO * v);
            // It has come to rest inside since, or something changed there.
            let elsewhere =
                index == 0 && grid.intervals.first().is_some_and(|first| first.start_lu != self.regime.from_lu);
            if !again && !elsewhere {
                return;
            }
        }
        let ends = self.ends(pieces, index, start);
        let ahead_lu = match self.regime.transition {
            Some(_) => pieces[..index].iter().map(|piece| piece.path.length_lu()).sum(),
            None => 0.0,
        };
        let stretch = self.regime.stretch(pieces[index].path, ends, (index > 0).then_some(ahead_lu));
        let Piece { path, flow, .. } = &mut pieces[index];
        let open_lu_s = if let (End::Speed(v), true) = (ends[1], is_last) { Some(v) } else { None };
        flow.grid = Some(Grid { open_lu_s, ..Grid::new(&flow.rules, path, flow.blend, stretch) });
    }

    /// About the speeds at the ends of a piece.
    fn ends(&self, pieces: &[Piece<'_>], index: usize, start: Start) -> [End; 2] {
        let piece = &pieces[index];
        let first = match (index, start) {
            (0, Start::Rest) => End::Rest,
            (0, Start::At(point)) if self.regime.from_lu > 0.0 => End::Speed(point.speed_squared_lu2_s2.sqrt()),
            (0, Start::At(_)) => End::Speed(piece.flow.ends_lu_s[0]),
            _ => End::Speed(group::speed_before_lu_s(pieces, index, start == Start::Rest)),
        };
        let last = if piece.rests_after { End::Rest } else { End::Speed(group::speed_after_lu_s(pieces, index)) };
        [first, last]
    }
}

/// Derivatives on the curve of an interval; `owners`: the piece with which each begins.
fn look<'a>(pieces: &'a [Piece<'_>], owners: &'a [usize]) -> impl Fn(usize, f64) -> Derivatives + use<'a> {
    move |index, s_lu| {
        let paths = pieces[owners[index]..].iter().map(|piece| piece.path);
        let place = group::place(paths, s_lu).unwrap_or((pieces[owners[index]].path, s_lu));
        Derivatives::from(place.0.at(place.1))
    }
}
