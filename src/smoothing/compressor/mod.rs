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
//! A block goes on as it is where the compressor is off, and where it is no line with feed, before an exact stop, of rotary axes
//! alone, or longer than `compressor_length_max_mm`. A run ends where one of these stands, where a block has something to put out,
//! where the modes change or feed and rapid meet, at corners of `compressor_corner_deg` or more, and where blocks are so long for
//! their turn that no smooth curve is in the tolerance. Corners between blocks shorter than five tolerances are noise up to a right
//! angle: the curve passes them.
//!
//! Memory: one window of points, a few hundred. Does not round what corners are left: that is `corner`.

mod basis;
mod nodes;
mod spline;
mod track;
mod window;

use super::corner::Rules;
use super::smoother::Held;
use crate::geometry::Curve;
use crate::interpreter::{Compressor, Feed};
use crate::machine::PathMode;
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
}

#[derive(Clone, Debug)]
enum Fit {
    Nodes(Nodes),
    Spline(Spline),
}

impl Compression {
    /// Takes a block.
    pub(super) fn push(&mut self, block: Held, rules: &Rules) {
        if !eligible(&block, rules) {
            self.flush();
            self.ready.push_back(block);
            return;
        }
        if !self.run.as_ref().is_some_and(|run| run.goes_on(&block, rules)) {
            self.flush();
        }
        let run = self.run.get_or_insert_with(|| Run::new(&block, rules));
        run.add(block);
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
        if !run.track.begun && run.track.blocks.len() == 1 {
            self.ready.extend(run.track.blocks);
            return;
        }
        run.hand_over(true, &mut self.ready);
    }
}

/// The block may be compressed.
fn eligible(block: &Held, rules: &Rules) -> bool {
    let modes = &block.head.modes;
    let asked = modes.compressor != Compressor::Off && modes.path_mode != PathMode::ExactStop;
    let short = block.curve.length_lu() <= rules.compressor_length_max_mm();
    let kind = matches!(block.curve, Curve::Line(_)) && block.head.feed != Feed::Rapid;
    asked && short && kind && !block.curve.rotary_only()
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
        Self { track: Track::new(start, rules.own_tolerances(modes), rules.linear()), curve }
    }

    /// The block continues the curve.
    fn goes_on(&self, block: &Held, rules: &Rules) -> bool {
        let Some(last) = self.track.blocks.back() else { return false };
        let before = &last.curve;
        if !block.head.events.is_empty() || block.head.modes != last.head.modes || before.end() != block.curve.start() {
            return false;
        }
        let ends = [before.at(f64::INFINITY), block.curve.at(0.0)];
        let [u, v] = ends.map(|state| state.first.masked(rules.linear()));
        let turn_rad = 2.0 * (v - u).norm().atan2((v + u).norm());
        let (h, k) = (before.length_lu(), block.curve.length_lu());
        let tolerance_mm = self.track.tolerances.contour_mm;
        let corner = turn_rad >= rules.compressor_corner_rad()
            && (h.min(k) > SHORT_TOLERANCES * tolerance_mm || turn_rad > SHARP_RAD);
        let height_mm = turn_rad * h * k / (h + k);
        !corner && height_mm <= HEIGHT_MAX_RATIO * tolerance_mm
    }

    fn add(&mut self, block: Held) {
        self.track.add(block, 1, 0.0);
        if let Fit::Spline(spline) = &mut self.curve {
            spline.push(&self.track);
        }
    }

    fn hand_over(&mut self, ending: bool, ready: &mut VecDeque<Held>) {
        match &mut self.curve {
            Fit::Nodes(nodes) => nodes.hand_over(&mut self.track, ending, ready),
            Fit::Spline(spline) => spline.hand_over(&mut self.track, ending, ready),
        }
    }
}
