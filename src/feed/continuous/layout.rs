//! Where the pieces of a window lie in a chain of intervals.
//!
//! In: a chain that is known and the pieces after it. Out: a longer [`Chain`] with the [`Place`] of each piece in it and the piece with which each
//! interval begins. A piece has one or more intervals, or shares one with its neighbours (`group`). The chain ends at rest.
//! Does not plan.

use super::Piece;
use super::chain::{Chain, Junction, PathPoint};
use super::group::{Stretch, fitting_ratio};
use super::interval::Interval;
use std::collections::VecDeque;
use std::ops::Range;

/// Where a plan begins or ends at rest in the middle of a path, its first and last interval are cut like this.
const CUTS_RATIO: [f64; 5] = [0.0, 0.08, 0.2, 0.5, 1.0];

/// An interval is at most so many times as long as the way from it to the stop, as those of [`CUTS_RATIO`] are; it is cut if it is longer by more than the
/// slack.
const GRADE_RATIO: f64 = 1.5;
const GRADE_SLACK_RATIO: f64 = 1.5;

/// One piece of so many is handed out at least before the next plan.
const STALE_PIECES: usize = 20;

/// A block has so many blends at its end at most.
const BLENDS_MAX: usize = 2;

/// Where a plan begins with rising speed its first interval has at least this share of its length.
const RISE_MIN_SHARE: f64 = 1e-3;

/// Intervals of a plan that are handed out before the next one in any case. Where all of a plan brakes, planning again for each piece would cost more
/// than a window that is a little shorter. The front is handed out always, and with it all that share its interval: a plan begins where an
/// interval does. So are the blends behind it that belong to its block: the window gets no further before the next block begins.
pub(super) fn handed_out(places: &VecDeque<Place>) -> usize {
    let stale = (places.len() / STALE_PIECES).saturating_sub(1);
    let goes_on = |index: usize| index + 1 < places.len() && !places[index].begins_block;
    let same_block = (stale + 1..).take(BLENDS_MAX).take_while(|index| goes_on(*index)).count();
    places.get(stale + same_block).map_or(0, |place| place.intervals.end)
}

/// Where a piece is in a chain.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub intervals: Range<usize>,
    /// What it has of the one interval that it shares, from the start of that; `None`: all of its intervals.
    pub part_lu: Option<[f64; 2]>,
    /// A motion block begins with the piece.
    pub begins_block: bool,
}

impl Place {
    /// Way of the piece, of its plan at least.
    pub fn way_lu(&self, chain: &Chain) -> f64 {
        match self.part_lu {
            Some([from_lu, to_lu]) => to_lu - from_lu,
            None => chain.intervals[self.intervals.clone()].iter().map(Interval::length_lu).sum(),
        }
    }
}

/// A chain and what its intervals belong to.
#[derive(Clone, Debug, Default)]
pub(super) struct Layout {
    pub chain: Chain,
    pub places: VecDeque<Place>,
    /// The piece with which each interval begins.
    pub owners: Vec<usize>,
    /// Intervals from here on are there for the stop at the end only.
    pub uncut: usize,
    /// The state that the chain begins with, if it moves and its first piece is not known yet.
    pub entry: Option<PathPoint>,
}

impl Layout {
    /// The intervals of the pieces at `places`, which follow each other.
    pub fn continued<'a>(chain: &Chain, places: impl Iterator<Item = &'a Place>) -> Self {
        let mut layout = Self { uncut: usize::MAX, ..Self::default() };
        let mut shift = None;
        for (piece, place) in places.enumerate() {
            let shift = *shift.get_or_insert(place.intervals.start);
            let known = layout.chain.intervals.len();
            let (start, end) = (place.intervals.start - shift, place.intervals.end - shift);
            for index in known.max(start)..end {
                layout.chain.intervals.push(chain.intervals[shift + index].clone());
                layout.chain.junctions.push(chain.junctions[shift + index]);
                layout.owners.push(piece);
            }
            layout.places.push_back(Place { intervals: start..end, ..place.clone() });
        }
        layout
    }

    /// Appends `pieces[from..]`, which are these stretches, with a stop at their end.
    pub fn extend(&mut self, pieces: &[Piece<'_>], from: usize, stretches: Vec<Stretch>, starts_at_rest: bool) {
        let mut first = from;
        for stretch in stretches {
            match stretch {
                Stretch::Cut => {
                    let last = first + 1 == pieces.len();
                    self.cut(&pieces[first], first, starts_at_rest && first == 0, last);
                    first += 1;
                }
                Stretch::Group(count, interval) => {
                    let index = self.chain.intervals.len();
                    self.chain.intervals.push(*interval);
                    self.chain.junctions.push(junction(&pieces[first]));
                    self.owners.push(first);
                    let mut from_lu = 0.0;
                    for piece in &pieces[first..first + count] {
                        let to_lu = from_lu + piece.path.length_lu();
                        let part_lu = (count > 1).then_some([from_lu, to_lu]);
                        let begins_block = begins_block(piece);
                        self.places.push_back(Place { intervals: index..index + 1, part_lu, begins_block });
                        from_lu = to_lu;
                    }
                    first += count;
                }
            }
        }
        self.uncut = self.uncut.min(self.chain.intervals.len());
    }

    /// Intervals of a grid whose limits had to be tightened begin the next plan with that.
    pub fn remember(&self, pieces: &mut [Piece<'_>]) {
        for (index, interval) in self.chain.intervals.iter().enumerate().filter(|(_, interval)| interval.tightened) {
            let Some(grid) = &mut pieces[self.owners[index]].flow.grid else { continue };
            let at = grid.intervals.partition_point(|own| own.start_lu < interval.start_lu);
            if let Some(own) = grid.intervals.get_mut(at).filter(|own| own.end_lu == interval.end_lu) {
                (own.reserve_ratio, own.tightened) = (own.reserve_ratio.min(interval.reserve_ratio), true);
            }
        }
    }

    /// The plan begins inside a piece: what its start allows is no matter.
    pub fn frees_start(&mut self) {
        if let Some(junction) = self.chain.junctions.first_mut() {
            junction.speed_squared_lu2_s2 = f64::INFINITY;
        }
    }

    /// The plan begins somewhere inside an interval of the plan before, with the speed rising: the first interval ends before that goes on beyond its
    /// cap, which planning knows at its border only.
    pub fn cut_rise(&mut self, point: &PathPoint, pieces: &[Piece<'_>]) {
        let Some(first) = self.chain.intervals.first().filter(|_| self.chain.intervals.len() > 1) else { return };
        let rise_lu2_s2 = first.cap.velocity_lu_s.powi(2) - point.speed_squared_lu2_s2;
        // b + h b'/2 is not below b anywhere in between, if b'' is negative.
        let way_lu = 2.0 * rise_lu2_s2 / point.slope_lu_s2;
        let length_lu = first.length_lu();
        if point.slope_lu_s2 > 0.0 && rise_lu2_s2 > 0.0 && way_lu < length_lu {
            self.split(0, way_lu.max(RISE_MIN_SHARE * length_lu), pieces);
        }
    }

    /// Cuts what is long beside its way to the stop at the end, which may lie in a piece that is next to nothing: the speed comes down over all of it, and in
    /// one interval it cannot. The first `known` pieces stay as they are.
    pub fn grade_stop(&mut self, known: usize, pieces: &[Piece<'_>]) {
        let first = self.places.get(known).map_or(usize::MAX, |place| place.intervals.start);
        let (mut way_lu, mut index) = (0.0, self.chain.intervals.len());
        while index > first {
            let length_lu = self.chain.intervals[index - 1].length_lu();
            let part_lu = GRADE_RATIO * way_lu;
            if way_lu > 0.0 && length_lu > GRADE_SLACK_RATIO * part_lu && self.is_whole(index - 1) {
                self.split(index - 1, length_lu - part_lu, pieces);
                self.uncut = self.uncut.min(index - 1);
                way_lu += part_lu;
            } else {
                way_lu += length_lu;
                index -= 1;
            }
        }
    }

    /// No pieces share the interval.
    fn is_whole(&self, index: usize) -> bool {
        !self.places.iter().any(|place| place.part_lu.is_some() && place.intervals.start == index)
    }

    /// Cuts an interval in two, `way_lu` from its start; not if pieces share it.
    pub fn split(&mut self, index: usize, way_lu: f64, pieces: &[Piece<'_>]) {
        if !self.is_whole(index) {
            return;
        }
        let interval = &self.chain.intervals[index];
        let path = pieces[self.owners[index]].path;
        let border_lu = interval.start_lu + way_lu;
        let parts = [(interval.start_lu, border_lu), (border_lu, interval.end_lu)];
        let [before, after] = parts.map(|(from_lu, to_lu)| interval.part(path, from_lu, to_lu));
        let free = Junction { speed_squared_lu2_s2: f64::INFINITY, limit: before.cap.limit };
        self.chain.intervals[index] = before;
        self.chain.intervals.insert(index + 1, after);
        self.chain.junctions.insert(index + 1, free);
        let floors = &mut self.chain.floors_lu2_s2;
        if let [from, to, ..] = floors[index.min(floors.len())..] {
            floors.insert(index + 1, from.min(to));
        }
        self.owners.insert(index + 1, self.owners[index]);
        for Place { intervals, .. } in &mut self.places {
            intervals.start += usize::from(intervals.start > index);
            intervals.end += usize::from(intervals.end > index);
        }
        self.uncut += usize::from(self.uncut > index);
    }

    /// Puts each interval in so many equal parts; those that pieces share stay whole. There are no floors.
    pub fn divide(&mut self, parts: &[usize], pieces: &[Piece<'_>]) {
        let old = std::mem::take(&mut self.chain);
        let owners = std::mem::take(&mut self.owners);
        // Where each interval begins now.
        let mut starts = Vec::with_capacity(parts.len() + 1);
        for (index, (interval, junction)) in old.intervals.into_iter().zip(old.junctions).enumerate() {
            starts.push(self.chain.intervals.len());
            let free = Junction { speed_squared_lu2_s2: f64::INFINITY, limit: interval.cap.limit };
            self.chain.junctions.push(junction);
            self.chain.junctions.resize(starts[index] + parts[index], free);
            self.owners.resize(starts[index] + parts[index], owners[index]);
            if parts[index] == 1 {
                self.chain.intervals.push(interval);
                continue;
            }
            let Piece { path, flow, .. } = &pieces[owners[index]];
            let rules = flow.rules.throughout(path);
            let border_lu = |part: usize| interval.start_lu + interval.length_lu() * part as f64 / parts[index] as f64;
            for part in 0..parts[index] {
                let to_lu = if part + 1 == parts[index] { interval.end_lu } else { border_lu(part + 1) };
                self.chain.intervals.push(interval.part_by_itself(rules, path, border_lu(part), to_lu));
            }
        }
        starts.push(self.chain.intervals.len());
        for Place { intervals, .. } in &mut self.places {
            *intervals = starts[intervals.start]..starts[intervals.end];
        }
        self.uncut = starts.get(self.uncut).copied().unwrap_or(self.uncut);
    }

    /// Appends the grid of a piece; where the plan begins or ends at rest there and the grid was not made for it, the first or last interval is cut.
    fn cut(&mut self, piece: &Piece<'_>, owner: usize, starts_at_rest: bool, ends_at_rest: bool) {
        let start = self.chain.intervals.len();
        let grid = piece.flow.grid.as_ref();
        let count = grid.map_or(0, |grid| grid.intervals.len());
        let rests = grid.map_or([false; 2], |grid| grid.rests);
        let (cut_first, cut_last) = (starts_at_rest && !rests[0], ends_at_rest && !rests[1]);
        let rules = piece.flow.rules.throughout(piece.path);
        let at_start = junction(piece);
        let free = Junction { speed_squared_lu2_s2: f64::INFINITY, limit: at_start.limit };
        let mut junction = if starts_at_rest { free } else { at_start };
        for (index, interval) in grid.into_iter().flat_map(|grid| grid.intervals.iter().enumerate()) {
            let mut borders = vec![];
            let h = interval.length_lu();
            if cut_first && index == 0 {
                borders.extend(CUTS_RATIO.map(|ratio| interval.start_lu + ratio * h));
            }
            let entry = self.entry.filter(|_| start == 0 && index == 0);
            let part = |to_lu| interval.part_by_itself(rules, piece.path, interval.start_lu, to_lu);
            let cap_lu_s = |ratio: f64| {
                let whole = ratio == 1.0;
                if whole { interval.cap.velocity_lu_s } else { part(interval.start_lu + ratio * h).cap.velocity_lu_s }
            };
            let fitting = entry.map_or(1.0, |entry| fitting_ratio(&entry, h, cap_lu_s));
            if fitting < 1.0 && !(cut_first && index == 0) {
                borders.push(interval.start_lu);
                let parts =
                    std::iter::successors(Some(fitting), |ratio| Some(2.0 * ratio)).take_while(|ratio| *ratio <= 1.0);
                borders.extend(parts.map(|ratio| interval.start_lu + ratio * h));
            }
            if cut_last && index + 1 == count {
                let from = borders.pop().unwrap_or(interval.start_lu);
                let rest_lu = interval.end_lu - from;
                self.uncut = self.chain.intervals.len();
                borders.extend(CUTS_RATIO.iter().rev().map(|ratio| interval.end_lu - ratio * rest_lu));
            }
            if borders.is_empty() {
                self.chain.intervals.push(interval.clone());
                self.chain.junctions.push(std::mem::replace(&mut junction, free));
                continue;
            }
            for pair in borders.windows(2).filter(|pair| pair[1] > pair[0]) {
                let part = if fitting < 1.0 {
                    interval.part_by_itself(rules, piece.path, pair[0], pair[1])
                } else {
                    interval.part(piece.path, pair[0], pair[1])
                };
                self.chain.intervals.push(part);
                self.chain.junctions.push(std::mem::replace(&mut junction, free));
            }
        }
        let end = self.chain.intervals.len();
        self.owners.resize(end, owner);
        let begins_block = begins_block(piece);
        self.places.push_back(Place { intervals: start..end, part_lu: None, begins_block });
    }
}

fn begins_block(piece: &Piece<'_>) -> bool {
    piece.path.contour.blocks_begun > 0
}

fn junction(piece: &Piece<'_>) -> Junction {
    Junction {
        speed_squared_lu2_s2: piece.junction.velocity_lu_s * piece.junction.velocity_lu_s,
        limit: piece.junction.limit,
    }
}
