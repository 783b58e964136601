//! The feed override changes while the path moves.
//!
//! In: the window, the place and state where the front piece is, the new override. Out: a plan from there with the new feed, or the plan as it was. Where
//! the speed lies above the new feed nothing keeps it at once: over the shortest way for which there is a plan the speed may still be that of the plan
//! before, and the new feed holds from its end. That way is searched: too short a one has no plan, because some axis would exceed a limit. 0 % is
//! the same with a rest at its end, if need be inside a piece. Rapids go on; with 0 % they end before the first block with a feed.
//! Does not know when the override changes.

use super::along::Along;
use super::chain::{Chain, PathPoint, Profile, Start};
use super::grid::{Grid, Settling, Stretch};
use super::interval::{Interval, Tangent};
use super::layout::{self, Layout};
use super::regime::rapids;
use super::{Continuous, Piece, Sight, look};
use crate::feed::PathState;
use crate::feed::ramp::Dynamics;

/// The way to the new feed is found to this share of it.
const WAY_SHARE: f64 = 0.01;

/// Attempts to find it, how much longer than expected the first one is, and how much longer the next one after one without a plan.
const WAYS_MAX: u32 = 14;
const FIRST_RATIO: f64 = 1.04;
const LONGER_RATIO: f64 = 1.15;

/// A way that ends this share of an interval from its end ends with it.
const NEAR_END_SHARE: f64 = 0.05;

/// A stop this share of its way from the end of a piece is one at its end.
const NEAR_BORDER_SHARE: f64 = 2e-3;

/// On the way, and this many times as far, the speed stays above this share of the new feed: it does not fall below what it is to come to.
const FLOOR_RATIO: f64 = 0.997;
const FLOOR_WAYS: f64 = 1.5;

/// A stop from the new feed may take so many times the way that it takes on a line.
const STOP_WAYS: f64 = 2.0;

/// What curves take of acceleration and jerk makes the way to the new feed longer than on a line, so many times where no plan is found.
const WIDER_RATIOS: [f64; 3] = [1.0, 2.0, 4.0];

/// By how much the speeds of the plan before may be exceeded on the way.
const LOOSE_RATIO: f64 = 1.002;

/// Plans at most with caps that become lower where axes would be too fast.
const SLOWER_ATTEMPTS_MAX: u32 = 6;

/// What rounding makes of the velocity of an axis.
const VELOCITY_ROUNDING_RATIO: f64 = 1e-9;

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

/// What a change will take, about.
#[derive(Clone, Copy, Debug, Default)]
struct Expected {
    way_lu: f64,
    /// The way from the new feed to a stop.
    stop_lu: f64,
    /// So far before the plan before comes down to the new feed a plan with that may have to leave it.
    landing_lu: f64,
}

/// A plan over a way to another feed or to a rest.
struct Trial {
    layout: Layout,
    profile: Profile,
    way_lu: f64,
}

/// A plan to another feed.
struct Settled {
    trial: Trial,
    /// How many pieces it reaches.
    count: usize,
    /// It settles before its end; one that only does with its stop has not looked far enough.
    lands: bool,
    /// On its way it nowhere falls below the feed that it comes to.
    floors_hold: bool,
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

    /// Where the law of the front piece ends; `None`: where the piece does.
    pub fn front_end_lu(&self) -> Option<f64> {
        let place = self.places.front().filter(|place| self.refuge.is_none() && place.part_lu.is_none());
        let last = place.and_then(|place| self.chain.intervals.get(place.intervals.end.checked_sub(1)?));
        last.map(|last| last.end_lu)
    }

    /// The front piece has come so far when something changes.
    pub fn stand(&mut self, state: &PathState) {
        let v = state.velocity_lu_s;
        self.regime.from_lu = state.position_lu;
        self.regime.point =
            Some(PathPoint { speed_squared_lu2_s2: v * v, slope_lu_s2: 2.0 * state.acceleration_lu_s2 });
    }

    /// From the start of the plan's first interval to where the front piece stands.
    pub(super) fn offset_lu(&self) -> f64 {
        let Some(place) = self.places.front().filter(|_| self.regime.point.is_some()) else { return 0.0 };
        match place.part_lu {
            Some([from_lu, _]) => from_lu + self.regime.from_lu,
            None => self.regime.from_lu - self.chain.intervals[self.first].start_lu,
        }
    }

    /// Plans again with a new override from where the front piece stands. `pieces` as for [`Continuous::plan`].
    pub fn change(&mut self, pieces: &mut [Piece<'_>], override_ratio: f64) -> Change {
        self.stand_in_group();
        let start = self.start();
        let before = std::mem::replace(&mut self.regime.override_ratio, override_ratio);
        if start == Start::Rest {
            self.begin(pieces, override_ratio);
            return Change::Planned;
        }
        if rapids(pieces) == pieces.len() {
            // With 0 % too: the plan before ends at rest among them.
            if override_ratio > 0.0 {
                self.regime.move_to(override_ratio);
            }
            return Change::Nothing;
        }
        let planned = if override_ratio > 0.0 {
            self.slow_or_fast(pieces, start, override_ratio)
        } else {
            self.hold(pieces, start)
        };
        self.regime.transition = None;
        if planned {
            return Change::Planned;
        }
        self.regime.override_ratio = before;
        if override_ratio < before {
            // No other plan with the feed before: that which is there brakes for the end of its window, and the slower the path is the sooner there is one.
            self.kept = layout::handed_out(&self.places);
        }
        Change::NotYet
    }

    /// A piece that shares an interval with those before it begins inside that.
    fn stand_in_group(&mut self) {
        let Some(place) = self.places.front().filter(|_| self.regime.point.is_none() && self.refuge.is_none()) else {
            return;
        };
        if let Some([from_lu, _]) = place.part_lu.filter(|[from_lu, _]| *from_lu > 0.0) {
            let index = place.intervals.start;
            let share = from_lu / self.chain.intervals[index].length_lu();
            self.regime.point = Some(self.profile.inside(&self.chain, index, share).0);
        }
    }

    /// At rest: no plan before matters.
    fn begin(&mut self, pieces: &mut [Piece<'_>], override_ratio: f64) {
        self.places.clear();
        (self.chain, self.profile) = (Chain::default(), Profile::default());
        (self.first, self.kept, self.uncut, self.braking, self.disturbed) = (0, 0, 0, 0, 0);
        let regime = &mut self.regime;
        (regime.settling_lu, regime.point) = (0.0, None);
        if override_ratio > 0.0 {
            regime.begin_at(override_ratio);
        }
        let Some(front) = pieces.first_mut() else { return };
        if regime.from_lu > 0.0 {
            front.flow.grid = None;
        }
        if !self.is_held(&pieces[0]) {
            self.plan(pieces, Sight::All);
        }
    }

    /// Another feed above 0.
    fn slow_or_fast(&mut self, pieces: &mut [Piece<'_>], start: Start, override_ratio: f64) -> bool {
        let before = self.regime.move_to(override_ratio);
        let mut found: Option<Settled> = None;
        let mut seen = 0;
        for wider_ratio in WIDER_RATIOS {
            let expected = self.expect(pieces, start, false, wider_ratio);
            let count = self.usual_reach(pieces, start);
            if count <= seen {
                // The window has no more.
                break;
            }
            seen = count;
            found = self.settled(&mut pieces[..count], start, &expected).or(found);
            if found.as_ref().is_some_and(|found| found.lands) {
                break;
            }
        }
        let Some(Settled { trial: Trial { layout, profile, way_lu }, count, floors_hold, .. }) = found else {
            [self.regime.moving_ratio, self.regime.fastest_ratio] = before;
            return false;
        };
        let pieces = &pieces[..count];
        self.regime.settling_lu = way_lu;
        let (layout, profile) = self.refined(layout, profile, pieces, start);
        self.adopt(layout, profile, pieces.last().is_some_and(|last| last.rests_after));
        if !floors_hold {
            // With the next block it will have to slow down less.
            self.kept = layout::handed_out(&self.places);
        }
        true
    }

    /// A plan of all pieces that comes to the feed in force as soon as it can.
    fn settled(&mut self, pieces: &mut [Piece<'_>], start: Start, expected: &Expected) -> Option<Settled> {
        let count = pieces.len();
        let layout = self.layout(pieces, count, 0, start);
        let most_lu = self.above_lu(&layout.chain);
        let length_lu: f64 = layout.chain.intervals.iter().map(Interval::length_lu).sum();
        let floors_end_lu = floors_end_lu(length_lu, most_lu, expected);
        let mut attempt = |way_lu: f64, longer: Option<&Trial>| {
            let mut layout = layout.clone();
            if way_lu > 0.0 {
                layout.chain.floors_lu2_s2 = self.floors(&layout.chain, (FLOOR_WAYS * way_lu).min(floors_end_lu));
                self.settle(&mut layout, pieces, start, way_lu);
            }
            let mut trial = self.trial(layout, pieces, start, way_lu, longer)?;
            for _ in 0..SLOWER_ATTEMPTS_MAX {
                if keeps_velocities(&mut trial.layout, &trial.profile, pieces, way_lu) {
                    return Some(trial);
                }
                trial = self.trial(trial.layout, pieces, start, way_lu, longer)?;
            }
            None
        };
        let trial = attempt(0.0, None).or_else(|| shortest(expected.way_lu, most_lu, attempt))?;
        let rests = pieces[count - 1].rests_after;
        let lands = rests || trial.way_lu < (1.0 - WAY_SHARE) * length_lu;
        Some(Settled { count, lands, floors_hold: rests || trial.way_lu <= floors_end_lu, trial })
    }

    /// 0 %, while the path moves.
    fn hold(&mut self, pieces: &mut [Piece<'_>], start: Start) -> bool {
        let rapids = rapids(pieces);
        if rapids > 0 {
            if self.regime.from_lu > 0.0 {
                pieces[0].flow.grid = None;
            }
            let rested = std::mem::replace(&mut pieces[rapids - 1].rests_after, true);
            if self.lay(&mut pieces[..rapids], Sight::All).unwrap_or(false) {
                return true;
            }
            pieces[rapids - 1].rests_after = rested;
        }
        let (guess_lu, most_lu) = (self.expect(pieces, start, true, 1.0).way_lu, self.way_left_lu());
        let count = self.usual_reach(pieces, start);
        let pieces = &mut pieces[..count];
        let found = shortest(guess_lu, most_lu, |way_lu, longer| {
            let (layout, count) = self.layout_to_stop(pieces, start, way_lu);
            self.trial(layout, &pieces[..count], start, way_lu, longer)
        });
        let Some(Trial { layout, profile, .. }) = found else { return false };
        self.adopt(layout, profile, true);
        self.regime.settling_lu = 0.0;
        true
    }

    /// A profile over a way, from scratch or from that over a longer one.
    fn trial(
        &mut self,
        mut layout: Layout,
        pieces: &[Piece<'_>],
        start: Start,
        way_lu: f64,
        longer: Option<&Trial>,
    ) -> Option<Trial> {
        let hints = match longer {
            None => vec![Vec::new(), self.hints(&layout.chain).0],
            Some(longer) => vec![longer.shortened(&layout.chain, way_lu)],
        };
        // Of a plan to a stop all is gone along; of one to another feed the tangents fit further than they need to.
        (self.planning.hurries, self.planning.is_last) = (true, true);
        let profile = {
            let look = look(pieces, &layout.owners);
            hints.iter().find_map(|hints| self.planning.plan(&mut layout.chain, start, hints, &look))
        };
        self.planning.hurries = false;
        Some(Trial { profile: profile?, layout, way_lu })
    }

    /// The same plan without haste, if it can be improved.
    fn refined(&mut self, layout: Layout, profile: Profile, pieces: &[Piece<'_>], start: Start) -> (Layout, Profile) {
        let mut again = layout.clone();
        let better = self.planning.plan(&mut again.chain, start, &profile.points, &look(pieces, &layout.owners));
        match better {
            Some(better) if keeps_velocities(&mut again, &better, pieces, self.regime.settling_lu) => (again, better),
            _ => (layout, profile),
        }
    }

    /// A chain that ends at rest so far from where the front stands, and how many pieces it reaches.
    fn layout_to_stop(&mut self, pieces: &mut [Piece<'_>], start: Start, way_lu: f64) -> (Layout, usize) {
        let near_lu = NEAR_BORDER_SHARE * way_lu;
        let (mut last, mut left_lu, mut from_lu) = (0, way_lu, self.regime.from_lu);
        while last + 1 < pieces.len() && left_lu > pieces[last].path.length_lu() - from_lu + near_lu {
            left_lu -= pieces[last].path.length_lu() - from_lu;
            (last, from_lu) = (last + 1, 0.0);
        }
        let pieces = &mut pieces[..=last];
        let rested = std::mem::replace(&mut pieces[last].rests_after, true);
        let grid = pieces[last].flow.grid.take();
        let ends = self.ends(pieces, last, start);
        let stretch = self.regime.stretch(pieces[last].path, ends, (last > 0).then_some(way_lu - left_lu));
        let whole = left_lu >= stretch.to_lu - from_lu - near_lu;
        let stretch = if whole { stretch } else { Stretch { to_lu: from_lu + left_lu, ..stretch } };
        let Piece { path, flow, .. } = &mut pieces[last];
        flow.grid = Some(Grid::new(&flow.rules, path, flow.blend, stretch));
        let layout = self.layout(pieces, last + 1, 0, start);
        pieces[last].flow.grid = grid;
        pieces[last].rests_after = rested;
        (layout, last + 1)
    }

    /// Prepares the grids for a change from where the front stands.
    fn expect(&mut self, pieces: &mut [Piece<'_>], start: Start, stops: bool, wider_ratio: f64) -> Expected {
        let (Some(front), Start::At(point)) = (pieces.first_mut(), start) else { return Expected::default() };
        self.regime.look(front);
        front.flow.grid = None;
        let (v, a) = (point.speed_squared_lu2_s2.sqrt(), 0.5 * point.slope_lu_s2);
        let target_lu_s = if stops { 0.0 } else { front.flow.ends_lu_s[0] };
        let first = front.path.at(self.regime.from_lu).first;
        let Tangent { acceleration_lu_s2, jerk_lu_s3, jerk_limited, .. } =
            Tangent::new(&front.flow.rules, front.flow.blend, &first);
        let dynamics = Dynamics { acceleration_lu_s2, jerk_lu_s3: jerk_limited.then_some(jerk_lu_s3) };
        let [phase_s, full_s] = [a.abs(), acceleration_lu_s2].map(|a| if jerk_limited { a / jerk_lu_s3 } else { 0.0 });
        // The speed that the acceleration leads to before it can be taken away.
        let led_lu_s = (v + 0.5 * a * phase_s).max(0.0);
        let way_lu = dynamics.ramp_length_lu(led_lu_s, target_lu_s) + a.signum() * v * phase_s;
        let way_lu = wider_ratio * way_lu.max(WAY_SHARE * v * full_s);
        self.regime.transition = Some(Settling { way_lu, speed_lu_s: v });
        let stop_lu = dynamics.ramp_length_lu(target_lu_s, 0.0);
        Expected { way_lu: FIRST_RATIO * way_lu, stop_lu, landing_lu: 2.0 * target_lu_s * full_s }
    }

    /// Way of the plan before from where the front stands.
    fn way_left_lu(&self) -> f64 {
        let left = self.chain.intervals.get(self.first..).unwrap_or(&[]);
        left.iter().map(Interval::length_lu).sum::<f64>() - self.offset_lu()
    }

    /// The speeds of the plan before from where the front stands on. Where it brakes for the end of its window it does not say how fast the path may be: one that
    /// has to brake less would have to be slower than the hardest braking there is.
    fn before(&self) -> Along<'_> {
        Along::new(&self.chain, &self.profile, self.first, self.offset_lu()).held_from(self.braking)
    }

    /// Way from where the front stands to where the plan before comes down to the caps of a new chain.
    fn above_lu(&self, chain: &Chain) -> f64 {
        let mut before = self.before();
        let (mut at_lu, mut above) = (0.0, false);
        for interval in &chain.intervals {
            let Some(b) = before.at(at_lu) else { break };
            let over = b > interval.cap.velocity_lu_s * interval.cap.velocity_lu_s;
            if above && !over {
                return at_lu;
            }
            above |= over;
            at_lu += interval.length_lu();
        }
        if above { at_lu } else { 0.0 }
    }

    /// b at the borders of a chain up to a way that must not be fallen below: what the new feed and the plan before have in common.
    fn floors(&self, chain: &Chain, way_lu: f64) -> Vec<f64> {
        let mut before = self.before();
        let (mut at_lu, mut cap_lu_s) = (0.0, f64::INFINITY);
        let floor = |interval: &Interval| {
            if at_lu > way_lu {
                return None;
            }
            let lower_lu_s =
                interval.cap.velocity_lu_s.min(std::mem::replace(&mut cap_lu_s, interval.cap.velocity_lu_s));
            let b = before.at(at_lu)?.min(lower_lu_s * lower_lu_s);
            at_lu += interval.length_lu();
            Some(FLOOR_RATIO * FLOOR_RATIO * b)
        };
        chain.intervals.iter().map_while(floor).collect()
    }

    /// Over a way from where the front stands the caps give way to the speeds of the plan before; a border is made where it ends.
    pub(super) fn settle(&self, layout: &mut Layout, pieces: &[Piece<'_>], start: Start, way_lu: f64) {
        let mut before = self.before();
        let mut at_lu = 0.0;
        let mut index = 0;
        while index + 1 < layout.chain.intervals.len() {
            let (length_lu, left_lu) = (layout.chain.intervals[index].length_lu(), way_lu - at_lu);
            if left_lu < NEAR_END_SHARE * length_lu {
                break;
            }
            if left_lu < (1.0 - NEAR_END_SHARE) * length_lu {
                layout.split(index, left_lu, pieces);
            }
            let Piece { path, flow, .. } = &pieces[layout.owners[index]];
            let highest_lu_s = flow.programmed.feed_under_lu_s(path, self.regime.fastest_ratio);
            let interval = &mut layout.chain.intervals[index];
            let end_lu = at_lu + interval.length_lu();
            let [Some(from), Some(middle), Some(to)] = [at_lu, 0.5 * (at_lu + end_lu), end_lu].map(|at| before.at(at))
            else {
                break;
            };
            // The control point of the parabola through the three as well.
            let b = from.max(to).max(2.0 * middle - 0.5 * (from + to));
            // Room for the solver, but not above any feed that has been in force.
            let [v, reached_lu_s] = [b, from.max(middle).max(to)].map(f64::sqrt);
            let allowed_lu_s = (LOOSE_RATIO * v).min(highest_lu_s.max(reached_lu_s));
            interval.cap.velocity_lu_s = interval.cap.velocity_lu_s.max(allowed_lu_s);
            (at_lu, index) = (end_lu, index + 1);
        }
        if let Start::At(point) = start {
            // Under the caps before it may have been too fast anyway.
            layout.cut_rise(&point, pieces);
        }
    }

    /// The same as [`Continuous::attempt`] where caps gave way: what they gave of the feed they may not give of the velocities of the axes.
    pub(super) fn attempt_settling(
        &mut self,
        layout: &mut Layout,
        pieces: &[Piece<'_>],
        start: Start,
    ) -> Option<Profile> {
        for _ in 0..SLOWER_ATTEMPTS_MAX {
            let profile = self.attempt(layout, pieces, start)?;
            if keeps_velocities(layout, &profile, pieces, self.regime.settling_lu) {
                return Some(profile);
            }
        }
        None
    }
}

/// True if the axes keep their velocities up to a place; else the caps become lower where they do not.
fn keeps_velocities(layout: &mut Layout, profile: &Profile, pieces: &[Piece<'_>], way_lu: f64) -> bool {
    let Layout { chain, owners, .. } = layout;
    let look = look(pieces, owners);
    let (mut keeps, mut at_lu) = (true, 0.0);
    for index in 0..chain.intervals.len() {
        // The first interval begins with a state that is given.
        if index > 0 && at_lu >= way_lu {
            break;
        }
        let (start_lu, length_lu) = (chain.intervals[index].start_lu, chain.intervals[index].length_lu());
        let piece = &pieces[owners[index]];
        let rules = piece.flow.rules.throughout(piece.path);
        let mut most = 0.0_f64;
        for eighth in 0..=8 {
            let share = 0.125 * f64::from(eighth);
            let b = profile.inside(chain, index, share).0.speed_squared_lu2_s2;
            let first = look(index, start_lu + share * length_lu).first;
            let allowed = rules.axes_cap(piece.is_rapid(), |axis| first[axis].abs());
            most = most.max(b.max(0.0).sqrt() / allowed.velocity_lu_s);
        }
        if most > 1.0 + VELOCITY_ROUNDING_RATIO {
            keeps = false;
            let cap = &mut chain.intervals[index].cap;
            cap.velocity_lu_s /= most * (1.0 + VELOCITY_ROUNDING_RATIO);
        }
        at_lu += length_lu;
    }
    keeps
}

/// Up to where the speed must not fall below the new feed and the plan before: where that slows down for a place of the path, a plan with the new feed leaves it
/// sooner; else up to its own stop.
fn floors_end_lu(length_lu: f64, most_lu: f64, expected: &Expected) -> f64 {
    let landed = most_lu < (1.0 - WAY_SHARE) * length_lu;
    if landed { most_lu - expected.landing_lu } else { length_lu - STOP_WAYS * expected.stop_lu }
}

impl Trial {
    /// What it says about a chain with a shorter way: the same speeds sooner.
    fn shortened(&self, chain: &Chain, way_lu: f64) -> Vec<PathPoint> {
        let mut own = Along::new(&self.layout.chain, &self.profile, 0, 0.0);
        let mut hints = Vec::with_capacity(chain.intervals.len());
        let mut at_lu = 0.0;
        for interval in &chain.intervals {
            let longer_lu = self.way_lu - way_lu;
            let Some(b) = own.at(if at_lu < way_lu { at_lu * self.way_lu / way_lu } else { at_lu + longer_lu }) else {
                break;
            };
            hints.push(PathPoint { speed_squared_lu2_s2: b, slope_lu_s2: 0.0 });
            at_lu += interval.length_lu();
        }
        hints
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
    if most_lu.is_nan() || most_lu <= 0.0 {
        return None;
    }
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
