//! COMPON, COMPCURV, COMPCAD, COMPSURF: runs of short blocks become smooth curves.
//!
//! In: blocks in order. Out: the same blocks in order, each with its stretch of the curve, so that block numbers, feeds and events
//! stay. A polynomial of degree 5 spans as many blocks as the tolerance allows: `nodes` makes those of COMPON and COMPCURV, `spline`
//! those of COMPCAD and COMPSURF, `track` holds both to CTOL, OTOL and ATOL.
//!
//! | mode | curve | through programmed points | continuous |
//! |---|---|---|---|
//! | COMPON | degree 3, grown block by block | where one curve ends | direction |
//! | COMPCURV | degree 5, grown block by block | where one curve ends | curvature |
//! | COMPCAD | the smoothest spline of degree 5 | at the ends of the run | fourth derivative |
//! | COMPSURF | the same, from near points alone | at the ends of the run | fourth derivative |
//!
//! Lines are taken, with `compressor_blocks` also arcs and rapids. An arc becomes chords that it rises above by a tenth of the
//! tolerance at most (`chords`).
//!
//! A block goes on as it is where the compressor is off, and where it is of no kind that is taken, before an exact stop, of rotary
//! axes alone, or longer than `compressor_length_max_mm`. A run ends where one of these stands, where a block has something to put
//! out, where the modes change or feed and rapid meet, at corners of `compressor_corner_deg` or more, and where blocks are so long for
//! their turn that no smooth curve is in the tolerance. Corners between blocks shorter than five tolerances are noise up to a right
//! angle: the curve passes them.
//!
//! Memory: one window of points, a few hundred. Does not round what corners are left: that is `corner`.

mod basis;
mod chords;
mod nodes;
mod spline;
mod track;
mod window;

use super::corner::Rules;
use super::smoother::Held;
use crate::base::Portable;
use crate::geometry::Curve;
use crate::interpreter::{Compressor, Event, Feed};
use crate::machine::PathMode;
use chords::Chords;
use nodes::Nodes;
use spline::Spline;
use std::collections::VecDeque;
use track::Track;

/// Tolerances that a point may stand off the chord of its neighbours: four times what a curve rises above chords of equal length.
const HEIGHT_MAX_RATIO: f64 = 3.2;

/// Between blocks shorter than so many tolerances a corner is noise of the program.
const SHORT_TOLERANCES: f64 = 5.0;

/// Corners sharper than this are corners however short the blocks.
const SHARP_RAD: f64 = std::f64::consts::FRAC_PI_2;

/// The compressor: blocks in, blocks out.
#[derive(Clone, Debug, Default)]
pub(super) struct Compression {
    run: Option<Run>,
    ready: VecDeque<Held>,
}

/// Blocks that are being made one curve.
#[derive(Clone, Debug)]
struct Run {
    track: Track,
    curve: Fit,
    /// The last block: how it is cut depends on the next one.
    last: Option<(Held, Chords)>,
    /// Chord of the arc before that, if there is one.
    arc_chord_lu: Option<f64>,
}

#[derive(Clone, Debug)]
enum Fit {
    Nodes(Nodes),
    Spline(Spline),
}

impl Compression {
    /// Takes a block.
    pub(super) fn push(&mut self, block: Held, rules: &Rules) {
        let Some(chords) = eligible(&block, rules) else {
            self.flush();
            self.ready.push_back(block);
            return;
        };
        if !self.run.as_ref().is_some_and(|run| run.goes_on(&block, rules)) {
            self.flush();
        }
        let run = self.run.get_or_insert_with(|| Run::new(&block, rules));
        run.add(block, chords);
        run.hand_over(false, &mut self.ready);
    }

    /// The next block that is done.
    pub(super) fn pop(&mut self) -> Option<Held> {
        self.ready.pop_front()
    }

    /// Nothing waits in a run, and this block would not.
    pub(super) fn passes(&self, block: &Held) -> bool {
        self.run.is_none() && block.head.modes.compressor == Compressor::Off
    }

    /// Ends the run.
    pub(super) fn flush(&mut self) {
        let Some(mut run) = self.run.take() else { return };
        if !run.track.begun && run.track.blocks.is_empty() {
            self.ready.extend(run.last.map(|(block, _)| block));
            return;
        }
        run.take_last(None);
        run.hand_over(true, &mut self.ready);
    }
}

/// How a block is cut that may be compressed.
fn eligible(block: &Held, rules: &Rules) -> Option<Chords> {
    let (modes, settings) = (&block.head.modes, rules.settings());
    let asked = modes.compressor != Compressor::Off && modes.path_mode != PathMode::ExactStop;
    let short = block.curve.length_lu() <= settings.compressor_length_max_mm;
    let kind = match block.curve {
        Curve::Line(_) => block.head.feed != Feed::Rapid || settings.compressor_blocks.rapids(),
        Curve::Arc(_) | Curve::SpatialArc(_) => settings.compressor_blocks.arcs(),
        _ => false,
    };
    if !(asked && short && kind) || block.curve.rotary_only() || modes.thread.is_some() {
        return None;
    }
    Chords::new(&block.curve, &rules.own_tolerances(modes, &block.head.feed), rules.linear())
}

impl Run {
    fn new(block: &Held, rules: &Rules) -> Self {
        let modes = &block.head.modes;
        let start = block.curve.start();
        let spline = |style| Fit::Spline(Spline::new(style, start.0, 0.0));
        let curve = match modes.compressor {
            Compressor::Off | Compressor::On => Fit::Nodes(Nodes::new(false)),
            Compressor::Curvature => Fit::Nodes(Nodes::new(true)),
            Compressor::Cad => spline(spline::CAD),
            Compressor::Surface => spline(spline::SURFACE),
        };
        let tolerances = rules.own_tolerances(modes, &block.head.feed);
        Self { track: Track::new(start, tolerances, rules.linear()), curve, last: None, arc_chord_lu: None }
    }

    /// The block continues the curve.
    fn goes_on(&self, block: &Held, rules: &Rules) -> bool {
        let Some((last, _)) = &self.last else { return false };
        let before = &last.curve;
        let rapids = [&last.head.feed, &block.head.feed].map(|feed| *feed == Feed::Rapid);
        let same = block.head.modes == last.head.modes && rapids[0] == rapids[1];
        if !block.head.events.iter().all(Event::only_tells) || !same || before.end() != block.curve.start() {
            return false;
        }
        let ends = [before.at(f64::INFINITY), block.curve.at(0.0)];
        let [u, v] = ends.map(|state| state.first.masked(rules.linear()));
        let turn_rad = 2.0 * (v - u).norm().portable_atan2((v + u).norm());
        let (h, k) = (before.length_lu(), block.curve.length_lu());
        let tolerance_mm = self.track.tolerances.contour_mm;
        let corner = turn_rad >= rules.settings().compressor_corner_rad
            && (h.min(k) > SHORT_TOLERANCES * tolerance_mm || turn_rad > SHARP_RAD);
        let height_mm = turn_rad * h * k / (h + k);
        !corner && height_mm <= HEIGHT_MAX_RATIO * tolerance_mm
    }

    fn add(&mut self, block: Held, chords: Chords) {
        self.take_last(chords.arc_chord_lu);
        self.last = Some((block, chords));
    }

    /// The last block becomes part of the curve. `next_chord_lu`: that of the arc that comes next.
    fn take_last(&mut self, next_chord_lu: Option<f64>) {
        let Some((block, mut chords)) = self.last.take() else { return };
        chords.grade(block.curve.length_lu(), [self.arc_chord_lu, next_chord_lu]);
        self.arc_chord_lu = chords.arc_chord_lu;
        let count = self.track.add(block, &chords);
        if let Fit::Spline(spline) = &mut self.curve {
            let points = self.track.points.len();
            (points - count..points).for_each(|last| spline.push(&self.track, last));
        }
    }

    fn hand_over(&mut self, ending: bool, ready: &mut VecDeque<Held>) {
        match &mut self.curve {
            Fit::Nodes(nodes) => nodes.hand_over(&mut self.track, ending, ready),
            Fit::Spline(spline) => spline.hand_over(&mut self.track, ending, ready),
        }
    }
}
