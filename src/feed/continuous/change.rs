//! The feed override changes while the path moves.
//!
//! In: the window, the place and state where the front piece is, the new override. Out: a plan from there with the new feed, or the plan as it was. Where
//! the speed lies above the new feed nothing keeps it at once: over the shortest way for which there is a plan the speed may still be that of the plan before, and the
//! new feed holds from its end. That way is searched: too short a one has no plan, because some axis would exceed a limit. 0 % is the same with a rest
//! at its end, if need be inside a piece. Rapids go on; with 0 % they end before the first block with a feed.
//! Does not know when the override changes.

use super::chain::{Chain, Look, PathPoint, Profile, Start};
use super::grid::{self, End, Grid, Interval, Stretch};
use super::estimate::ray_exponent;
use super::{Continuous, Draft, Flow, Piece, add_piece, look};
use crate::base::AxisVector;
use crate::feed::PathState;
use crate::feed::limits::AxisRules;
use crate::feed::ramp::Dynamics;
use crate::kinematics::JointPath;
use std::sync::Arc;

/// The way to the new feed is found to this share of it.
const WAY_SHARE: f64 = 0.01;

/// Attempts to find it, and how much longer the next one is after one without a plan.
const WAYS_MAX: u32 = 14;
const LONGER_RATIO: f64 = 1.12;

/// A way that ends this share of an interval from its end ends with it.
const NEAR_END_SHARE: f64 = 0.05;

/// A stop this share of its way from the end of a piece is one at its end.
const NEAR_BORDER_SHARE: f64 = 2e-3;

/// By how much the speeds of the plan before may be exceeded on the way.
const LOOSE_RATIO: f64 = 1.002;

/// The override, and where the front piece stands under it.
#[derive(Clone, Debug)]
pub(super) struct Regime {
    /// In force.
    override_ratio: f64,
    /// The last one above 0: feeds are planned with it.
    moving_ratio: f64,
    /// So far from where the front stands the speed may still be that of the plan before.
    pub settling_lu: f64,
    /// Where the front piece stands.
    pub from_lu: f64,
    /// The state there, if it is not that at a border of the plan.
    pub point: Option<PathPoint>,
    /// The intervals of the plan are not those of the grids.
    pub recut: bool,
    /// Time and way that the change takes, about, while it is planned.
    transition: Option<[f64; 2]>,
    /// Rules under the override that were asked for last, with those that they come from.
    overridden: Option<(Arc<AxisRules>, f64, Arc<AxisRules>)>,
}

/// What came of a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::feed) enum Change {
    /// There is a new plan from where the front piece stands.
    Planned,
    /// It changes nothing: the plan before goes on.
    Nothing,
    /// There is no such plan yet: that before goes on.
    NotYet,
}

impl Default for Regime {
    fn default() -> Self {
        Self {
            override_ratio: 1.0,
            moving_ratio: 1.0,
            settling_lu: 0.0,
            from_lu: 0.0,
            point: None,
            recut: false,
            transition: None,
            overridden: None,
        }
    }
}

impl Regime {
    /// A change is being planned, or has not come to its end.
    pub fn changes(&self) -> bool {
        self.transition.is_some() || self.settling_lu > 0.0
    }

    /// The pieces over which the path may go: with 0 % the rapids before the first feed, with a rest at their end.
    pub fn allowed<'a, 'b>(&self, pieces: &'a mut [Piece<'b>]) -> &'a mut [Piece<'b>] {
        if self.override_ratio > 0.0 {
            return pieces;
        }
        let rapids = rapids(pieces);
        let stops = rapids < pieces.len();
        let allowed = &mut pieces[..rapids];
        if let Some(last) = allowed.last_mut() {
            last.rests_after |= stops;
        }
        allowed
    }

    /// Brings a piece under the override that feeds are planned with.
    pub fn look(&mut self, piece: &mut Piece<'_>) {
        let override_ratio = self.moving_ratio;
        if piece.flow.override_ratio == override_ratio {
            return;
        }
        piece.flow.override_ratio = override_ratio;
        if !piece.is_rapid() {
            let rules = self.overridden(&piece.flow.programmed);
            piece.flow.ends_lu_s = grid::end_speeds_lu_s(&rules, piece.path);
            (piece.flow.rules, piece.flow.grid) = (rules, None);
        }
    }

    fn overridden(&mut self, programmed: &Arc<AxisRules>) -> Arc<AxisRules> {
        if self.moving_ratio == 1.0 {
            return programmed.clone();
        }
        if let Some((from, ratio, rules)) = &self.overridden
            && Arc::ptr_eq(from, programmed)
            && *ratio == self.moving_ratio
        {
            return rules.clone();
        }
        let rules = Arc::new(programmed.overridden(self.moving_ratio));
        self.overridden = Some((programmed.clone(), self.moving_ratio, rules.clone()));
        rules
    }

    /// What is cut of a piece that begins so far after where the front stands; `None`: the front.
    pub fn stretch(&self, path: &JointPath, ends: [End; 2], ahead_lu: Option<f64>) -> Stretch {
        let settling_s = match self.transition {
            Some([time_s, way_lu]) if ahead_lu.unwrap_or(0.0) < way_lu => time_s,
            _ => 0.0,
        };
        let from_lu = if ahead_lu.is_none() { self.from_lu } else { 0.0 };
        Stretch { from_lu, ends, settling_s, ..Stretch::whole(path) }
    }
}

fn rapids(pieces: &[Piece<'_>]) -> usize {
    pieces.iter().take_while(|piece| piece.is_rapid()).count()
}

impl Continuous {
    /// In force since the last change that was planned.
    pub fn override_ratio(&self) -> f64 {
        self.regime.override_ratio
    }

    /// The front piece stands still until the override is above 0.
    pub fn is_held(&self, front: &Piece<'_>) -> bool {
        self.regime.override_ratio == 0.0 && self.start() == Start::Rest && !front.is_rapid()
    }

    /// Where the front piece stands.
    pub fn front_start_lu(&self) -> f64 {
        self.regime.from_lu
    }

    /// Where the law of the front piece ends.
    pub fn front_end_lu(&self, path: &JointPath) -> f64 {
        let planned = self.pieces.front().filter(|_| self.refuge.is_none());
        let last = planned.and_then(|count| self.chain.intervals.get((self.first + count).checked_sub(1)?));
        last.map_or(path.length_lu(), |last| last.end_lu)
    }

    /// The front piece has come so far when something changes.
    pub fn stand(&mut self, state: &PathState) {
        let v = state.velocity_lu_s;
        self.regime.from_lu = state.position_lu;
        self.regime.point =
            Some(PathPoint { speed_squared_lu2_s2: v * v, slope_lu_s2: 2.0 * state.acceleration_lu_s2 });
    }

    /// Plans again with a new override from where the front piece stands. `pieces` as for [`Continuous::plan`].
    pub fn change(&mut self, pieces: &mut [Piece<'_>], override_ratio: f64) -> Change {
        let start = self.start();
        let before = std::mem::replace(&mut self.regime.override_ratio, override_ratio);
        if start == Start::Rest {
            self.begin(pieces, override_ratio);
            return Change::Planned;
        }
        if rapids(pieces) == pieces.len() {
            // The plan before goes on; with 0 % it ends at rest among them.
            if override_ratio > 0.0 {
                self.regime.moving_ratio = override_ratio;
            }
            return Change::Nothing;
        }
        let planned =
            if override_ratio > 0.0 { self.slow_or_fast(pieces, start, override_ratio) } else { self.hold(pieces, start) };
        self.regime.transition = None;
        if planned {
            return Change::Planned;
        }
        self.regime.override_ratio = before;
        self.kept = self.chain.intervals.len();
        Change::NotYet
    }

    /// At rest: no plan before matters.
    fn begin(&mut self, pieces: &mut [Piece<'_>], override_ratio: f64) {
        let from_lu = self.regime.from_lu;
        self.pieces.clear();
        (self.chain, self.profile, self.first, self.kept) = (Chain::default(), Profile::default(), 0, 0);
        let regime = &mut self.regime;
        (regime.settling_lu, regime.recut, regime.point) = (0.0, false, None);
        if override_ratio > 0.0 {
            regime.moving_ratio = override_ratio;
        }
        let Some(front) = pieces.first_mut() else { return };
        if from_lu > 0.0 {
            front.flow.grid = None;
        }
        if !self.is_held(&pieces[0]) {
            self.plan(pieces);
        }
    }

    /// Another feed above 0.
    fn slow_or_fast(&mut self, pieces: &mut [Piece<'_>], start: Start, override_ratio: f64) -> bool {
        let before = std::mem::replace(&mut self.regime.moving_ratio, override_ratio);
        let (guess_lu, most_lu) = (self.expect(pieces, start, false), self.way_left_lu());
        let count = self.cut_pieces(pieces, start);
        let pieces = &pieces[..count];
        let draft = Draft { recut: true, ..self.draft(pieces, start) };
        let mut attempt = |way_lu: f64, longer: Option<&Trial>| {
            let mut draft = draft.clone();
            if way_lu > 0.0 {
                self.settle(&mut draft, pieces, way_lu);
            }
            self.trial(draft, pieces, start, way_lu, longer)
        };
        let found = attempt(0.0, None).or_else(|| shortest(guess_lu, most_lu, attempt));
        let Some(Trial { draft, profile, way_lu }) = found else {
            self.regime.moving_ratio = before;
            return false;
        };
        self.adopt(draft, profile);
        self.regime.settling_lu = way_lu;
        true
    }

    /// 0 %, while the path moves.
    fn hold(&mut self, pieces: &mut [Piece<'_>], start: Start) -> bool {
        let rapids = rapids(pieces);
        if rapids > 0 {
            if self.regime.from_lu > 0.0 {
                pieces[0].flow.grid = None;
            }
            let rested = std::mem::replace(&mut pieces[rapids - 1].rests_after, true);
            if self.lay(&mut pieces[..rapids]) {
                return true;
            }
            pieces[rapids - 1].rests_after = rested;
        }
        let (guess_lu, most_lu) = (self.expect(pieces, start, true), self.way_left_lu());
        let count = self.cut_pieces(pieces, start);
        let pieces = &pieces[..count];
        let found = shortest(guess_lu, most_lu, |way_lu, longer| {
            let draft = self.draft_to_stop(pieces, start, way_lu);
            self.trial(draft, pieces, start, way_lu, longer)
        });
        let Some(Trial { draft, profile, .. }) = found else { return false };
        self.adopt(draft, profile);
        self.regime.settling_lu = 0.0;
        true
    }

    /// A profile over a way, from scratch or from that over a longer one.
    fn trial(
        &mut self,
        mut draft: Draft,
        pieces: &[Piece<'_>],
        start: Start,
        way_lu: f64,
        longer: Option<&Trial>,
    ) -> Option<Trial> {
        let profile = match longer {
            None => self.attempt(&mut draft, pieces, start)?,
            Some(longer) => {
                let hints = longer.shortened(&draft.chain, way_lu);
                let firsts = draft.firsts.clone();
                let look = look(pieces, &firsts);
                self.planning.plan(&mut draft.chain, start, &hints, &look)?
            }
        };
        Some(Trial { draft, profile, way_lu })
    }

    /// A chain that ends at rest so far from where the front stands.
    fn draft_to_stop(&self, pieces: &[Piece<'_>], start: Start, way_lu: f64) -> Draft {
        let mut draft = Draft { rests: true, recut: true, ..Draft::default() };
        let mut left_lu = way_lu;
        for (index, piece) in pieces.iter().enumerate() {
            let from_lu = if index == 0 { self.regime.from_lu } else { 0.0 };
            let length_lu = piece.path.length_lu() - from_lu;
            let near_lu = NEAR_BORDER_SHARE * way_lu;
            let ends_here = left_lu <= length_lu + near_lu || index + 1 == pieces.len();
            draft.firsts.push(draft.chain.intervals.len());
            let Some(grid) = &piece.flow.grid else { continue };
            let joined = index > 0 || from_lu == 0.0;
            if !ends_here {
                add_piece(&mut draft.chain, piece, grid, joined, [false; 2]);
                left_lu -= length_lu;
                continue;
            }
            if left_lu >= length_lu - near_lu {
                add_piece(&mut draft.chain, piece, grid, joined, [false, true]);
                break;
            }
            let first = match start {
                Start::At(point) if index == 0 => End::Speed(point.speed_squared_lu2_s2.sqrt()),
                _ => End::Speed(piece.flow.ends_lu_s[0]),
            };
            let stretch = self.regime.stretch(piece.path, [first, End::Rest], (index > 0).then_some(way_lu - left_lu));
            let Flow { rules, blend, .. } = &*piece.flow;
            let stretch = Stretch { to_lu: from_lu + left_lu, ..stretch };
            let grid = Grid::of_stretch(rules, piece.path, *blend, &stretch);
            add_piece(&mut draft.chain, piece, &grid, joined, [false, true]);
            break;
        }
        draft
    }

    /// Prepares the grids for a change from where the front stands: the way that it will take, about.
    fn expect(&mut self, pieces: &mut [Piece<'_>], start: Start, stops: bool) -> f64 {
        let Some(front) = pieces.first_mut() else { return 0.0 };
        self.regime.look(front);
        front.flow.grid = None;
        let Start::At(point) = start else { return 0.0 };
        let (v, a) = (point.speed_squared_lu2_s2.sqrt(), 0.5 * point.slope_lu_s2);
        let target_lu_s = if stops { 0.0 } else { front.flow.ends_lu_s[0] };
        let dynamics = dynamics(&front.flow.rules, &front.path.at(self.regime.from_lu).first);
        let phase_s = dynamics.jerk_lu_s3.map_or(0.0, |jerk| a.abs() / jerk);
        // The speed that the acceleration leads to before it can be taken away.
        let led_lu_s = (v + 0.5 * a * phase_s).max(0.0);
        let full_s = dynamics.jerk_lu_s3.map_or(0.0, |jerk| dynamics.acceleration_lu_s2 / jerk);
        let time_s = dynamics.ramp(led_lu_s, target_lu_s).duration_s() + phase_s + full_s;
        self.regime.transition = Some([time_s, time_s * v.max(target_lu_s)]);
        (dynamics.ramp_length_lu(led_lu_s, target_lu_s) + a.signum() * v * phase_s).max(v * WAY_SHARE * full_s)
    }

    /// Way of the plan before from where the front stands.
    fn way_left_lu(&self) -> f64 {
        let left = self.chain.intervals.get(self.first..).unwrap_or(&[]);
        let way_lu: f64 = left.iter().map(Interval::length_lu).sum();
        left.first().map_or(0.0, |first| way_lu - (self.regime.from_lu - first.start_lu))
    }

    /// Over a way from where the front stands the caps give way to the speeds of the plan before; a border is made where it ends.
    pub(super) fn settle(&self, draft: &mut Draft, pieces: &[Piece<'_>], way_lu: f64) {
        let known = Known::new(self);
        let mut left_lu = way_lu;
        let mut index = 0;
        while index + 1 < draft.chain.intervals.len() && left_lu > 0.0 {
            let piece = draft.piece_of(index);
            let interval = &draft.chain.intervals[index];
            let (start_lu, end_lu, length_lu) = (interval.start_lu, interval.end_lu, interval.length_lu());
            if left_lu < NEAR_END_SHARE * length_lu {
                break;
            }
            if left_lu < (1.0 - NEAR_END_SHARE) * length_lu {
                let (path, border_lu) = (pieces[piece].path, start_lu + left_lu);
                let parts = [(start_lu, border_lu), (border_lu, end_lu)];
                let parts = parts.map(|(from_lu, to_lu)| interval.part(path, from_lu, to_lu));
                draft.cut(index, parts);
            }
            let interval = &mut draft.chain.intervals[index];
            left_lu -= interval.length_lu();
            if let Some(speed_lu_s) = known.highest_lu_s(piece, interval) {
                let speed_lu_s = LOOSE_RATIO * speed_lu_s;
                interval.cap.velocity_lu_s = interval.cap.velocity_lu_s.max(speed_lu_s);
            }
            index += 1;
        }
    }

    /// A profile for a chain that is not that of the plan before: first as if nothing were known, then with what is known of the plan before.
    pub(super) fn attempt_anew(&mut self, draft: &mut Draft, start: Start, look: &Look<'_>) -> Option<Profile> {
        let (mut hints, mut fast) = (Vec::new(), None);
        let known = Known::new(self);
        let mut before_lu_s = f64::INFINITY;
        for (index, interval) in draft.chain.intervals.iter().enumerate() {
            let Some((b, brakes)) = known.at(draft.piece_of(index), interval.start_lu) else { break };
            if brakes {
                fast.get_or_insert(hints.len());
            }
            let cap_lu_s = interval.cap.velocity_lu_s.min(before_lu_s);
            before_lu_s = interval.cap.velocity_lu_s;
            hints.push(PathPoint { speed_squared_lu2_s2: b.min(cap_lu_s * cap_lu_s), slope_lu_s2: 0.0 });
        }
        let fast = fast.unwrap_or(hints.len());
        let mut tried = usize::MAX;
        for count in [0, fast, hints.len()] {
            if std::mem::replace(&mut tried, count) == count {
                continue;
            }
            let mut chain = draft.chain.clone();
            if let Some(profile) = self.planning.plan(&mut chain, start, &hints[..count], look) {
                draft.chain = chain;
                return Some(profile);
            }
        }
        None
    }
}

impl Draft {
    /// The piece to which an interval belongs.
    fn piece_of(&self, index: usize) -> usize {
        self.firsts.partition_point(|first| *first <= index).saturating_sub(1)
    }

    /// Puts two parts in the place of an interval.
    fn cut(&mut self, index: usize, [before, after]: [Interval; 2]) {
        let free = super::Junction { speed_squared_lu2_s2: f64::INFINITY, limit: before.cap.limit };
        self.chain.intervals[index] = before;
        self.chain.intervals.insert(index + 1, after);
        self.chain.junctions.insert(index + 1, free);
        self.firsts.iter_mut().filter(|first| **first > index).for_each(|first| *first += 1);
        self.recut = true;
    }
}

/// b inside an interval of a profile, at a share of its length.
fn inside(interval: &Interval, profile: &Profile, index: usize, share: f64) -> Option<f64> {
    let [from, to] = [profile.points.get(index)?, profile.points.get(index + 1)?].map(|at| at.speed_squared_lu2_s2);
    let exponent = ray_exponent(interval);
    if from <= 0.0 {
        return Some(to * share.powf(exponent));
    }
    if to <= 0.0 {
        return Some(from * (1.0 - share).powf(exponent));
    }
    let x = share * interval.length_lu();
    Some(from + x * (profile.points[index].slope_lu_s2 + 0.5 * x * profile.bends_per_s2.get(index)?))
}

/// A plan over a way to another feed or to a rest.
struct Trial {
    draft: Draft,
    profile: Profile,
    way_lu: f64,
}

impl Trial {
    /// What it says about a chain with a shorter way: the same speeds sooner.
    fn shortened(&self, chain: &Chain, way_lu: f64) -> Vec<PathPoint> {
        let mine = &self.draft.chain.intervals;
        let (mut index, mut begin_lu, mut at_lu) = (0, 0.0, 0.0);
        let mut hints = Vec::with_capacity(chain.intervals.len());
        for interval in &chain.intervals {
            let sought_lu =
                if at_lu < way_lu { at_lu * self.way_lu / way_lu } else { at_lu + self.way_lu - way_lu };
            while index + 1 < mine.len() && begin_lu + mine[index].length_lu() < sought_lu {
                begin_lu += mine[index].length_lu();
                index += 1;
            }
            let Some(own) = mine.get(index) else { break };
            let share = ((sought_lu - begin_lu) / own.length_lu()).clamp(0.0, 1.0);
            let Some(b) = inside(own, &self.profile, index, share) else { break };
            hints.push(PathPoint { speed_squared_lu2_s2: b, slope_lu_s2: 0.0 });
            at_lu += interval.length_lu();
        }
        hints
    }
}

/// The plan before, by place on its pieces.
struct Known<'a> {
    plan: &'a Continuous,
    /// Interval with which each piece begins, and one more.
    firsts: Vec<usize>,
}

impl<'a> Known<'a> {
    fn new(plan: &'a Continuous) -> Self {
        let mut firsts = vec![plan.first];
        let mut end = plan.first;
        for count in &plan.pieces {
            end += count;
            firsts.push(end);
        }
        Self { plan, firsts }
    }

    /// b at a place, and whether it brakes there for the end of its window.
    fn at(&self, piece: usize, s_lu: f64) -> Option<(f64, bool)> {
        let range = *self.firsts.get(piece)?..*self.firsts.get(piece + 1)?;
        let Continuous { chain, profile, braking, .. } = self.plan;
        let intervals = chain.intervals.get(range.clone())?;
        let place = intervals.partition_point(|interval| interval.end_lu < s_lu);
        let interval = intervals.get(place)?;
        let (index, h) = (range.start + place, interval.length_lu());
        let b = inside(interval, profile, index, ((s_lu - interval.start_lu) / h).clamp(0.0, 1.0))?;
        (b > 0.0).then_some((b, index >= *braking))
    }

    /// Highest speed on an interval, its parabola's control point included.
    fn highest_lu_s(&self, piece: usize, interval: &Interval) -> Option<f64> {
        let middle_lu = 0.5 * (interval.start_lu + interval.end_lu);
        let places = [interval.start_lu, middle_lu, interval.end_lu];
        let [from, middle, to] = places.map(|s_lu| self.at(piece, s_lu).map(|(b, _)| b));
        let (from, middle, to) = (from?, middle?, to?);
        Some(from.max(to).max(2.0 * middle - 0.5 * (from + to)).sqrt())
    }
}

/// Tangential acceleration and jerk in a direction.
fn dynamics(rules: &AxisRules, first: &AxisVector) -> Dynamics {
    let acceleration = rules.largest(|axis, limits| first[axis].abs() / limits.acceleration_max_lu_s2);
    let jerk = rules.largest(|axis, limits| first[axis].abs() / limits.jerk_max_lu_s3);
    Dynamics {
        acceleration_lu_s2: 1.0 / acceleration.demand_ratio,
        jerk_lu_s3: rules.jerk_limited.then_some(1.0 / jerk.demand_ratio),
    }
}

/// The plan over the shortest way over which there is one, up to a share of it; `most_lu`: the longest way.
fn shortest(
    guess_lu: f64,
    most_lu: f64,
    mut attempt: impl FnMut(f64, Option<&Trial>) -> Option<Trial>,
) -> Option<Trial> {
    let mut low_lu = 0.0;
    let mut found: Option<Trial> = None;
    let (mut next_lu, mut longer_ratio) = (guess_lu.min(most_lu), LONGER_RATIO);
    for _ in 0..WAYS_MAX {
        match attempt(next_lu, found.as_ref()) {
            Some(trial) => found = Some(trial),
            None => low_lu = next_lu,
        }
        let Some(Trial { way_lu: high_lu, .. }) = &found else {
            if low_lu >= most_lu {
                return None;
            }
            next_lu = (longer_ratio * low_lu).min(most_lu);
            longer_ratio *= LONGER_RATIO;
            continue;
        };
        if high_lu - low_lu <= WAY_SHARE * high_lu {
            break;
        }
        // Near the guess first.
        next_lu = if low_lu > 0.0 { 0.5 * (low_lu + high_lu) } else { high_lu / LONGER_RATIO };
    }
    found
}
