//! Joins moves to a contour, one at a time.
//!
//! In: [`Move`]s in order, pushed. Out: [`ContourPiece`]s in order: every motion block once (cut where blends take its ends), the
//! blends, the waits. One motion block is held back, because the next one decides how it ends. Events of blocks without motion go
//! to the next block; where none follows, to a wait at the end.
//!
//! Moves without displacement make no piece and no junction: their events and their count go to the next block. Displacement below
//! [`DISPLACEMENT_MIN_LU`] is none; it is not lost, because the next block starts where the contour is.
//!
//! Does not decide how a corner is passed: that is `corner`.

use super::corner::{Junction, Rules, Side};
use super::unrounded::Unrounded;
use super::{ContourPiece, PieceKind};
use crate::base::diagnostics::Place;
use crate::base::{Diagnostic, PartPoint, PerAxis};
use crate::geometry::{Arc, Curve, DISPLACEMENT_MIN_LU, Line};
use crate::interpreter::{AxisPositioning, Event, Feed, Modes, Move, MoveKind, Positioning};
use crate::machine::{Machine, PathMode};
use crate::program::BlockRef;

/// Moves in, contour out.
#[derive(Clone, Debug)]
pub struct Smoother {
    rules: Rules,
    position: PartPoint,
    /// Where the last move ended: a move without motion that ends elsewhere has another tool.
    told: PartPoint,
    held: Option<Held>,
    /// Blocks without motion that wait for the next piece; `block`, `feed` and `modes` are those of the last of them, for the
    /// case that no piece follows.
    carried: Option<Head>,
    unrounded: Unrounded,
    /// Axes that POSA has sent away: the program ends when they have arrived.
    positioned: PerAxis<bool>,
}

/// The motion block whose end is not decided yet.
#[derive(Clone, Debug)]
struct Held {
    curve: Curve,
    /// Taken from its start by a blend.
    head_lu: f64,
    head: Head,
}

/// What a piece says about its block.
#[derive(Clone, Debug)]
struct Head {
    block: BlockRef,
    feed: Feed,
    modes: Modes,
    events: Vec<Event>,
    blocks_begun: u32,
}

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
            held: None,
            carried: None,
            unrounded: Unrounded::default(),
            positioned: PerAxis::splat(false),
        }
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
                self.push_motion(next, Curve::Arc(arc), out);
            }
            MoveKind::SpatialArc(_) | MoveKind::Spline(_) | MoveKind::Polynomial(_) => {
                let line = Line::new(self.position, next.end, linear);
                self.push_motion(next, Curve::Line(line), out);
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
        let last = self.held.as_ref().map(|held| Head { events: Vec::new(), blocks_begun: 0, ..held.head.clone() });
        self.rest(out);
        let carried = self.carried.take();
        let waits = self.positioned.as_slice().contains(&true);
        match carried.or(last.filter(|_| waits)) {
            Some(head) if waits => {
                let positioned = self.positioned;
                out(self.wait_positioned(head, positioned));
            }
            Some(head) => out(self.wait(head, 0.0)),
            None => {}
        }
    }

    /// The path goes on where the axes will arrive: what is missing on the way is added to the path by feed and interpolator.
    fn push_positioning(&mut self, next: Move, axes: std::sync::Arc<[AxisPositioning]>) {
        for axis in axes.iter() {
            self.positioned[axis.axis] = true;
            self.position.0[axis.axis] = axis.end_lu;
        }
        let programmed = next.modes.programmed.clone();
        let start = Event::Position(std::sync::Arc::new(Positioning { axes, programmed }));
        let mut events = next.events.clone();
        events.push(start);
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

    /// An alarm of a later stage, with the line of its block marked.
    pub fn marked(&self, alarm: Diagnostic, block: BlockRef) -> Diagnostic {
        match self.unrounded.place(block) {
            Some(place) => alarm.at(Place { label: "this motion".to_owned(), ..place }),
            None => alarm,
        }
    }

    fn push_motion(&mut self, next: Move, curve: Curve, out: &mut impl FnMut(ContourPiece)) {
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
        let mut held = Held { curve, head_lu: 0.0, head: self.head(next, 1) };
        if let Some(before) = self.held.take() {
            self.join(before, &mut held, out);
        }
        self.held = Some(held);
    }

    /// Decides the end of `before` and the start of `after`.
    fn join(&mut self, before: Held, after: &mut Held, out: &mut impl FnMut(ContourPiece)) {
        let free_lu = before.curve.length_lu() - before.head_lu;
        match self.rules.junction(&before.side(), &after.side(), free_lu) {
            Junction::Pass => out(before.whole(false)),
            Junction::Stop => out(before.whole(true)),
            Junction::Unrounded(reason) => {
                self.unrounded.report(reason, before.head.block);
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
                    blend.starting_at(start)
                };
                out(head.piece(PieceKind::Blend(Curve::Blend(blend), corner), false));
            }
        }
    }

    /// Ends the motion here.
    fn rest(&mut self, out: &mut impl FnMut(ContourPiece)) {
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
        Side { curve: &self.curve, feed: &self.head.feed, modes: &self.head.modes }
    }

    /// The block up to its programmed end.
    fn whole(self, stop_at_end: bool) -> ContourPiece {
        self.part(0.0, stop_at_end)
    }

    /// The block without what blends take of it.
    fn part(self, tail_lu: f64, stop_at_end: bool) -> ContourPiece {
        let curve = self.shortened(tail_lu);
        self.head.piece(PieceKind::Block(curve), stop_at_end)
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
        ContourPiece { block, kind, feed, modes, events, blocks_begun, stop_at_end }
    }
}

/// The lower of two feeds.
fn lower(first: &Feed, second: &Feed) -> Feed {
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
