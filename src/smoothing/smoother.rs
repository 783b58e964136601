//! Joins moves to a contour, one at a time.
//!
//! In: [`Move`]s in order, pushed. Out: [`ContourPiece`]s in order: every motion block once (cut where blends take its ends), the
//! blends, the waits. On its way a block passes three stages: what RND and CHF put between blocks (`insert`), the compressor
//! (`compressor`), the junctions (`corner`; `curve_corners` inside a block). One motion block is held back, because the next one decides how it ends, and more where
//! a corner is to be filled or blocks are compressed. Events of blocks without motion go to the next block; where none follows, to a
//! wait at the end.
//!
//! Moves without displacement make no piece and no junction: their events and their count go to the next block. Displacement below
//! [`DISPLACEMENT_MIN_LU`] is none; it is not lost, because the next block starts where the contour is.
//!
//! Does not decide how a corner is passed: that is `corner`.

use super::compressor::Compression;
use super::corner::{Junction, Rules, Side};
use super::curve_corners;
use super::insert::{Inserted, Omitted, inserted};
use super::programmed::{positioned, programmed};
use super::unrounded::{Reason, Unrounded};
use super::{ContourPiece, PieceKind};
use crate::base::{Diagnostic, PartPoint, PerAxis};
use crate::geometry::{Arc, Curve, DISPLACEMENT_MIN_LU, Line, PolynomialCurve, SpatialArc};
use crate::interpreter::{AxisPositioning, CornerInsert, Event, Feed, Modes, Move, MoveKind, Positioning};
use crate::machine::{Machine, PathMode};
use crate::program::BlockRef;

/// Moves in, contour out.
#[derive(Clone, Debug)]
pub struct Smoother {
    rules: Rules,
    position: PartPoint,
    /// Where the last move ended: a move without motion that ends elsewhere has another tool.
    told: PartPoint,
    /// A block with RND, CHF or CHR at its end.
    waiting: Option<Waiting>,
    /// A block with RND, CHF or CHR at whose end the path rests: whether that is a corner, the next motion tells.
    left: Option<Waiting>,
    compression: Compression,
    held: Option<Held>,
    /// Blocks without motion that wait for the next piece; `block`, `feed` and `modes` are those of the last of them, for the
    /// case that no piece follows.
    carried: Option<Head>,
    unrounded: Unrounded,
    /// Axes that POSA has sent away: the program ends when they have arrived.
    positioned: PerAxis<bool>,
    /// The block that did so last: what the wait at the end belongs to where nothing else is left.
    sent_away: Option<Head>,
    /// Every motion block tells what the program asks for.
    tells_programmed: bool,
}

/// The motion block whose end is not decided yet.
#[derive(Clone, Debug)]
pub(super) struct Held {
    pub curve: Curve,
    /// What the program says, where the compressor made the curve of it.
    pub programmed: Option<Box<Curve>>,
    /// Taken from its start by a blend.
    pub head_lu: f64,
    /// Length of the block that it is a part of.
    pub part_of_lu: Option<f64>,
    pub head: Head,
}

/// What a piece says about its block.
#[derive(Clone, Debug)]
pub(super) struct Head {
    pub block: BlockRef,
    pub feed: Feed,
    pub modes: Modes,
    pub events: Vec<Event>,
    pub blocks_begun: u32,
}

/// A block that waits for the one that leads away from its corner.
#[derive(Clone, Debug)]
struct Waiting {
    held: Held,
    insert: CornerInsert,
    /// Blocks without motion since.
    idle_blocks: u32,
}

/// More blocks without motion in the plane between two blocks leave their corner as it is.
const IDLE_BLOCKS_MAX: u32 = 3;

impl Smoother {
    /// At the machine's home posture, at rest.
    pub fn new(machine: &Machine) -> Self {
        let mut position = PartPoint::default();
        for axis in machine.axis_ids() {
            position.0[axis] = machine.axis(axis).home_lu;
        }
        Self {
            rules: Rules::new(machine),
            position,
            told: position,
            waiting: None,
            left: None,
            compression: Compression::default(),
            held: None,
            carried: None,
            unrounded: Unrounded::default(),
            positioned: PerAxis::splat(false),
            sent_away: None,
            tells_programmed: false,
        }
    }

    /// With an [`Event::Programmed`] for every motion block. Nothing else changes.
    pub fn telling_programmed(self) -> Self {
        Self { tells_programmed: true, ..self }
    }

    /// Takes the next move; hands over the pieces that it decides.
    pub fn push(&mut self, next: Move, out: &mut impl FnMut(ContourPiece)) {
        self.unrounded.watch(&next.events);
        self.follow_tip(&next, out);
        let linear = self.rules.linear();
        match &next.kind {
            MoveKind::Rapid | MoveKind::Line => {
                let line = Line::new(self.position, next.end, linear);
                self.push_motion(next, Curve::Line(line), out);
            }
            MoveKind::Arc(geometry) => {
                let arc = Arc::new(self.position, next.end, geometry, linear);
                self.push_motion(next, Curve::from(arc), out);
            }
            MoveKind::SpatialArc(geometry) => {
                let arc = SpatialArc::new(self.position, next.end, geometry, linear);
                self.push_motion(next, Curve::from(arc), out);
            }
            MoveKind::Spline(geometry) | MoveKind::Polynomial(geometry) => {
                let curve = PolynomialCurve::new(self.position, next.end, geometry, linear);
                self.push_motion(next, Curve::from(curve), out);
            }
            MoveKind::Dwell { time_s } => {
                let time_s = *time_s;
                self.push_wait(next, time_s, out);
            }
            MoveKind::Position(axes) => {
                let axes = axes.clone();
                self.push_positioning(next, axes);
            }
            MoveKind::WaitPositioned(axes) => {
                let axes = *axes;
                self.rest(out);
                let head = self.head(next, 0);
                out(self.wait_positioned(head, axes));
            }
            MoveKind::StopPreparation => self.push_wait(next, 0.0, out),
            MoveKind::Function { stops: true } => self.push_wait(next, 0.0, out),
            MoveKind::Function { stops: false } => self.carry(next, 0),
        }
    }

    /// The axes stand and the tip of another tool is elsewhere: the path ends here and goes on there.
    fn follow_tip(&mut self, next: &Move, out: &mut impl FnMut(ContourPiece)) {
        let before = std::mem::replace(&mut self.told, next.end);
        let stands = matches!(
            next.kind,
            MoveKind::Function { .. }
                | MoveKind::Dwell { .. }
                | MoveKind::WaitPositioned(_)
                | MoveKind::StopPreparation
        );
        if stands && next.end != before {
            self.rest(out);
            self.position.0 += next.end.0 - before.0;
        }
    }

    /// The program ends here, or an alarm stops it: hands over what is held back, the last piece at rest. Pushing may go on.
    pub fn finish(&mut self, out: &mut impl FnMut(ContourPiece)) {
        self.end_stages(out);
        self.rest(out);
        let carried = self.carried.take();
        let positioned = self.positioned;
        match self.sent_away.take().filter(|_| positioned.as_slice().contains(&true)) {
            Some(sent_away) => out(self.wait_positioned(carried.unwrap_or(sent_away), positioned)),
            None => carried.into_iter().for_each(|head| out(self.wait(head, 0.0))),
        }
    }

    /// The path goes on where the axes will arrive: what is missing on the way is added to the path by feed and interpolator.
    fn push_positioning(&mut self, next: Move, axes: std::sync::Arc<[AxisPositioning]>) {
        let from = self.position;
        for axis in axes.iter() {
            self.positioned[axis.axis] = true;
            self.position.0[axis.axis] = axis.end_lu;
        }
        let Move { block, feed, modes, .. } = &next;
        let (feed, modes) = (feed.clone(), modes.clone());
        self.sent_away = Some(Head { block: *block, feed, modes, events: Vec::new(), blocks_begun: 0 });
        let programmed = next.modes.programmed.clone();
        let start = Event::Position(std::sync::Arc::new(Positioning { axes, programmed }));
        let mut events = next.events.clone();
        events.push(start);
        if self.tells_programmed {
            events.push(positioned(&next, [from, self.position]));
        }
        self.carry(Move { events, ..next }, 1);
    }

    fn wait_positioned(&mut self, head: Head, axes: PerAxis<bool>) -> ContourPiece {
        for (positioned, waits) in self.positioned.as_mut_slice().iter_mut().zip(axes.as_slice()) {
            *positioned &= !waits;
        }
        head.piece(PieceKind::WaitPositioned { axes, at: self.position }, true)
    }

    /// Findings since the last call.
    pub fn take_warnings(&mut self) -> Vec<Diagnostic> {
        self.unrounded.take()
    }

    fn push_motion(&mut self, mut next: Move, curve: Curve, out: &mut impl FnMut(ContourPiece)) {
        let length_lu = curve.length_lu();
        // A length that is no number goes on: feed makes an alarm of it. To leave it out would make the axes jump.
        if length_lu < DISPLACEMENT_MIN_LU {
            if next.modes.path_mode == PathMode::ExactStop {
                self.rest(out);
            }
            self.carry(next, 1);
            return;
        }
        self.position = next.end;
        let corner = next.corner.take();
        let mut held = Held { curve, programmed: None, head_lu: 0.0, part_of_lu: None, head: self.head(next, 1) };
        self.tell_left_corner(&held);
        if let Some(waiting) = self.waiting.take()
            && !self.fill_corner(waiting, &mut held, corner.is_some(), out)
        {
            // The fillet takes the whole block: what it says goes to the next one.
            self.carried = Some(held.head);
            return;
        }
        match corner {
            Some(insert) => self.waiting = Some(Waiting { held, insert: *insert, idle_blocks: 0 }),
            None => self.compress(held, out),
        }
    }

    /// Puts RND, CHF or CHR between two blocks. False: nothing is left of the second one.
    fn fill_corner(
        &mut self,
        waiting: Waiting,
        after: &mut Held,
        corner_follows: bool,
        out: &mut impl FnMut(ContourPiece),
    ) -> bool {
        let Waiting { held: mut before, insert, idle_blocks } = waiting;
        let block = before.head.block;
        let found = if idle_blocks > IDLE_BLOCKS_MAX {
            Err(Omitted::Shape)
        } else {
            inserted(&before, after, &insert, corner_follows, self.rules.linear())
        };
        let Inserted { curve, tail_lu, head_lu, reduced } = match found {
            Ok(inserted) => inserted,
            Err(omitted) => {
                if omitted != Omitted::NoCorner {
                    self.unrounded.report(Reason::NoInsert, block);
                }
                self.compress(before, out);
                return true;
            }
        };
        if reduced {
            self.unrounded.report(Reason::SmallInsert, block);
        }
        let feed = match (insert.feed_mm_s, &after.head.feed) {
            (Some(feed_lu_s), _) => Feed::Path { feed_lu_s },
            // The feed with which the block begins.
            (None, Feed::Varying { feeds_lu_s }) => {
                feeds_lu_s.first().map_or(Feed::Rapid, |first| Feed::Path { feed_lu_s: *first })
            }
            (None, feed) => feed.clone(),
        };
        let modes = before.head.modes.clone();
        let mut head = Head { block, feed, modes, events: Vec::new(), blocks_begun: 0 };
        let left_lu = before.curve.length_lu() - tail_lu;
        if left_lu < DISPLACEMENT_MIN_LU {
            head.events = before.head.events;
            head.blocks_begun = before.head.blocks_begun;
        } else {
            before.curve = before.curve.trimmed(0.0, left_lu);
            self.compress(before, out);
        }
        self.compress(Held { curve, programmed: None, head_lu: 0.0, part_of_lu: None, head }, out);
        let remains = after.curve.length_lu() - head_lu >= DISPLACEMENT_MIN_LU;
        if remains {
            after.curve = after.curve.trimmed(head_lu, f64::INFINITY);
        }
        remains
    }

    /// The corner that waits gets nothing: the path rests in it.
    fn leave_corner(&mut self, out: &mut impl FnMut(ContourPiece)) {
        if let Some(waiting) = self.waiting.take() {
            self.left = Some(waiting.clone());
            self.compress(waiting.held, out);
        }
    }

    /// Says that the path rests in a corner that was to be filled, if `after` makes it one.
    fn tell_left_corner(&mut self, after: &Held) {
        let Some(Waiting { held, insert, .. }) = self.left.take() else { return };
        if !matches!(inserted(&held, after, &insert, false, self.rules.linear()), Err(Omitted::NoCorner)) {
            self.unrounded.report(Reason::NoInsert, held.head.block);
        }
    }

    /// The next block, through the compressor.
    fn compress(&mut self, mut block: Held, out: &mut impl FnMut(ContourPiece)) {
        if self.tells_programmed {
            block.head.events.push(programmed(&block.curve, &block.head));
        }
        if self.compression.passes(&block) {
            self.link(block, out);
            return;
        }
        self.compression.push(block, &self.rules);
        self.link_compressed(out);
    }

    fn link_compressed(&mut self, out: &mut impl FnMut(ContourPiece)) {
        while let Some(block) = self.compression.pop() {
            self.link(block, out);
        }
    }

    /// The next block as it is driven, but for its ends.
    fn link(&mut self, block: Held, out: &mut impl FnMut(ContourPiece)) {
        let mut parts = curve_corners::parts(block, self.rules.linear());
        let Some(mut first) = parts.next() else { return };
        let others: Vec<Held> = parts.collect();
        if let Some(before) = self.held.take() {
            self.join(before, &mut first, out);
        }
        let mut held = first;
        for next in others {
            out(std::mem::replace(&mut held, next).whole(true));
        }
        self.held = Some(held);
    }

    /// Decides the end of `before` and the start of `after`.
    fn join(&mut self, before: Held, after: &mut Held, out: &mut impl FnMut(ContourPiece)) {
        let free_lu = before.curve.length_lu() - before.head_lu;
        match self.rules.junction(&before.side(), &after.side(), free_lu) {
            Junction::Pass => out(before.whole(false)),
            Junction::Stop => out(before.whole(true)),
            Junction::Unrounded => {
                self.unrounded.report(Reason::NoBlend, before.head.block);
                out(before.whole(false));
            }
            Junction::Blend(blend, corner) => {
                let t = corner.transition_length_mm;
                after.head_lu = t;
                let Head { block, feed, modes, .. } = &before.head;
                let feed = lower(feed, &after.head.feed);
                let mut head = Head { block: *block, feed, modes: modes.clone(), events: Vec::new(), blocks_begun: 0 };
                let blend = if free_lu - t > 0.0 {
                    out(before.part(t, false));
                    blend
                } else {
                    // The blends take the whole block: this one begins where the last one ended, and with it the block.
                    let start = before.shortened(0.0).start();
                    head.events = before.head.events.clone();
                    head.blocks_begun = before.head.blocks_begun;
                    match blend {
                        Curve::Blend(blend) => Curve::from(blend.starting_at(start)),
                        Curve::Quintic(blend) => Curve::from(blend.starting_at(start)),
                        other => other,
                    }
                };
                out(head.piece(PieceKind::Blend(blend, corner), false));
            }
        }
    }

    /// Hands over what waits for a corner or for the compressor.
    fn end_stages(&mut self, out: &mut impl FnMut(ContourPiece)) {
        self.leave_corner(out);
        self.compression.flush();
        self.link_compressed(out);
    }

    /// Ends the motion here.
    fn rest(&mut self, out: &mut impl FnMut(ContourPiece)) {
        self.end_stages(out);
        if let Some(held) = self.held.take() {
            out(held.whole(true));
        }
    }

    fn push_wait(&mut self, next: Move, time_s: f64, out: &mut impl FnMut(ContourPiece)) {
        self.rest(out);
        let head = self.head(next, 0);
        out(self.wait(head, time_s));
    }

    fn wait(&self, head: Head, time_s: f64) -> ContourPiece {
        head.piece(PieceKind::Wait { time_s, at: self.position }, true)
    }

    fn carry(&mut self, next: Move, blocks: u32) {
        if let Some(waiting) = &mut self.waiting {
            waiting.idle_blocks += 1;
        }
        let head = self.head(next, blocks);
        // A block that neither moves nor says anything leaves no trace.
        self.carried = (head.blocks_begun > 0 || !head.events.is_empty()).then_some(head);
    }

    /// What the next piece says: its own, after what was carried to it.
    fn head(&mut self, next: Move, blocks: u32) -> Head {
        let Move { block, feed, modes, mut events, .. } = next;
        let mut blocks_begun = blocks;
        if let Some(mut carried) = self.carried.take() {
            // Words of one block may make several moves: they count as one.
            let shared = carried.block.number == block.number && carried.block.program == block.program;
            blocks_begun =
                if shared { blocks_begun.max(carried.blocks_begun) } else { blocks_begun + carried.blocks_begun };
            carried.events.append(&mut events);
            events = carried.events;
        }
        Head { block, feed, modes, events, blocks_begun }
    }
}

impl Held {
    fn side(&self) -> Side<'_> {
        let Self { curve, programmed, head_lu, head, .. } = self;
        Side { curve, programmed: programmed.as_deref(), head_lu: *head_lu, feed: &head.feed, modes: &head.modes }
    }

    /// The block up to its programmed end.
    fn whole(self, stop_at_end: bool) -> ContourPiece {
        self.part(0.0, stop_at_end)
    }

    /// The block without what blends take of it.
    fn part(self, tail_lu: f64, stop_at_end: bool) -> ContourPiece {
        let curve = self.shortened(tail_lu);
        let piece = self.head.piece(PieceKind::Block(curve), stop_at_end);
        ContourPiece { block_length_lu: self.part_of_lu, ..piece }
    }

    fn shortened(&self, tail_lu: f64) -> Curve {
        match &self.curve {
            // Nothing is taken off: the block as it is, whatever its length.
            whole if self.head_lu == 0.0 && tail_lu == 0.0 => whole.clone(),
            Curve::Line(line) => Curve::Line(line.shortened(self.head_lu, tail_lu)),
            curve => curve.trimmed(self.head_lu, curve.length_lu() - tail_lu),
        }
    }
}

impl Head {
    fn piece(self, kind: PieceKind, stop_at_end: bool) -> ContourPiece {
        let Self { block, feed, modes, events, blocks_begun } = self;
        ContourPiece { block, kind, feed, modes, events, blocks_begun, block_length_lu: None, stop_at_end }
    }
}

/// The lower of two feeds.
pub(super) fn lower(first: &Feed, second: &Feed) -> Feed {
    let near = |feed: &Feed, last: bool| match feed {
        Feed::Rapid => None,
        Feed::Path { feed_lu_s } => Some(*feed_lu_s),
        Feed::Varying { feeds_lu_s } => if last { feeds_lu_s.last() } else { feeds_lu_s.first() }.copied(),
    };
    match (near(first, true), near(second, false)) {
        (None, None) => Feed::Rapid,
        (Some(feed_lu_s), None) | (None, Some(feed_lu_s)) => Feed::Path { feed_lu_s },
        (Some(a), Some(b)) => Feed::Path { feed_lu_s: a.min(b) },
    }
}
