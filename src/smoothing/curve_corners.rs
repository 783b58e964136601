//! Corners inside a curve: cusps, places where it turns back, knots without a common tangent.
//!
//! In: a block. Out: its parts, between which the path rests. No blend leads through a corner inside a curve, so that outside G64 it is a
//! stop; under G64 the axes step in velocity there, as at a corner between blocks, and the block stays whole.
//! Does not look at what follows the block.

use super::corner::is_corner;
use super::smoother::{Head, Held};
use crate::base::PerAxis;
use crate::geometry::{Curve, DISPLACEMENT_MIN_LU};
use crate::interpreter::Feed;
use crate::machine::PathMode;

/// The parts of a block in order, at least one: the first begins what the block begins.
pub(super) fn parts(held: Held, linear: &PerAxis<bool>) -> impl Iterator<Item = Held> {
    let corners_lu = corners_lu(&held, linear);
    let whole_lu = held.curve.length_lu();
    let several = !corners_lu.is_empty();
    let mut from_lu = 0.0;
    let mut left = Some(held);
    let ends_lu = corners_lu.into_iter().chain([whole_lu]);
    ends_lu.filter_map(move |to_lu| {
        let part = if several { left.as_mut()?.cut(from_lu, to_lu) } else { left.take()? };
        from_lu = to_lu;
        Some(part)
    })
}

/// Places inside where the direction steps.
fn corners_lu(held: &Held, linear: &PerAxis<bool>) -> Vec<f64> {
    let curve = match &held.curve {
        Curve::Polynomial(curve) if held.head.modes.path_mode != PathMode::G64 => curve,
        _ => return Vec::new(),
    };
    let length_lu = curve.length_lu();
    let breaks_lu = if length_lu.is_finite() { curve.breaks_lu() } else { Vec::new() };
    let mut from_lu = 0.0;
    let mut corners_lu = Vec::new();
    for (n, at_lu) in breaks_lu.iter().copied().enumerate() {
        let to_lu = breaks_lu.get(n + 1).copied().unwrap_or(length_lu);
        // What is shorter than any motion is no part.
        if at_lu - from_lu < DISPLACEMENT_MIN_LU || length_lu - at_lu < DISPLACEMENT_MIN_LU {
            continue;
        }
        let [before, after] = [held.curve.trimmed(from_lu, at_lu), held.curve.trimmed(at_lu, to_lu)];
        let ends = [before.at(f64::INFINITY).first, after.at(0.0).first];
        let shorter_lu = before.length_lu().min(after.length_lu());
        if is_corner(ends.each_ref(), held.curve.rotary_only(), shorter_lu, linear) {
            corners_lu.push(at_lu);
            from_lu = at_lu;
        }
    }
    corners_lu
}

impl Held {
    /// The part from one place to another; what happens when the block begins goes with the first part that is taken.
    fn cut(&mut self, from_lu: f64, to_lu: f64) -> Self {
        let length_lu = self.curve.length_lu();
        let [from_ratio, to_ratio] = [from_lu, to_lu].map(|s_lu| s_lu / length_lu);
        let programmed = self.programmed.as_ref().map(|curve| {
            let programmed_lu = curve.length_lu();
            Box::new(curve.trimmed(from_ratio * programmed_lu, to_ratio * programmed_lu))
        });
        let Head { block, feed, modes, events, blocks_begun } = &mut self.head;
        let head = Head {
            block: *block,
            feed: feed_between(feed, from_ratio, to_ratio),
            modes: modes.clone(),
            events: std::mem::take(events),
            blocks_begun: std::mem::take(blocks_begun),
        };
        let curve = self.curve.trimmed(from_lu, to_lu);
        Self { curve, programmed, head_lu: 0.0, part_of_lu: Some(length_lu), head }
    }
}

/// Feeds that are spread over a block, as far as a part of it has them.
fn feed_between(feed: &Feed, from_ratio: f64, to_ratio: f64) -> Feed {
    let Feed::Varying { feeds_lu_s } = feed else { return feed.clone() };
    let count = feeds_lu_s.len();
    // `as` saturates; a part has one feed at least.
    let first = ((from_ratio * count as f64).floor() as usize).min(count.saturating_sub(1));
    let last = ((to_ratio * count as f64).ceil() as usize).clamp(first + 1, count.max(first + 1));
    Feed::Varying { feeds_lu_s: feeds_lu_s.get(first..last).unwrap_or(feeds_lu_s).into() }
}
