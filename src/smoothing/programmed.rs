//! What the program asks of the path, as points: for recordings, so that blends, compressor and drives can be held against it.
//!
//! In: the curve of a block before it is rounded or compressed. Out: an [`Event::Programmed`]. Does not know what becomes of the curve.

use super::smoother::Head;
use crate::base::{AxisVector, PartPoint};
use crate::geometry::Curve;
use crate::interpreter::{Event, Feed, Move, ProgrammedBlock, ProgrammedMotion};
use std::sync::Arc;

/// A curve is no farther than this from the straight lines between its points.
const SAGITTA_MM: f64 = 2e-5;
/// Points of one block at most: a circle of 8 m radius keeps the sagitta.
const POINTS_MAX: usize = 20_000;
/// Places at which the curvature between two nodes of a curve is looked at.
const LOOKS: usize = 5;

/// Of a motion block.
pub(super) fn programmed(curve: &Curve, head: &Head) -> Event {
    let motion = match (curve, &head.feed) {
        (Curve::Line(_), Feed::Rapid) => ProgrammedMotion::Rapid,
        (Curve::Line(_), _) => ProgrammedMotion::Line,
        _ => ProgrammedMotion::Curve,
    };
    let tool_length = head.modes.tool.as_ref().map_or(AxisVector::zero(), |tool| tool.length);
    let points = if matches!(curve, Curve::Line(_)) { vec![curve.start(), curve.end()] } else { points(curve) };
    Event::Programmed(Arc::new(ProgrammedBlock { block: head.block, motion, points, tool_length }))
}

/// Of axes that set out on their own: where the path is before and after.
pub(super) fn positioned(next: &Move, ends: [PartPoint; 2]) -> Event {
    let tool_length = next.modes.tool.as_ref().map_or(AxisVector::zero(), |tool| tool.length);
    let motion = ProgrammedMotion::Positioning;
    Event::Programmed(Arc::new(ProgrammedBlock { block: next.block, motion, points: ends.to_vec(), tool_length }))
}

/// So many that the curve bends by at most [`SAGITTA_MM`] between two of them: c² k / 8 for a chord c.
fn points(curve: &Curve) -> Vec<PartPoint> {
    let mut borders_lu = vec![0.0];
    if let Curve::Polynomial(curve) = curve {
        borders_lu.extend(curve.nodes_lu());
    }
    borders_lu.push(curve.length_lu());
    let mut points = vec![curve.start()];
    for pair in borders_lu.windows(2) {
        let (from_lu, length_lu) = (pair[0], pair[1] - pair[0]);
        let bend = |i: usize| curve.at(from_lu + length_lu * i as f64 / (LOOKS - 1) as f64).second.norm();
        let bend_per_mm = (0..LOOKS).map(bend).fold(0.0, f64::max);
        // `as` saturates, and NaN is 0: a curve without length is refused elsewhere.
        let chords = (length_lu * (bend_per_mm / (8.0 * SAGITTA_MM)).sqrt()).ceil() as usize;
        let left = POINTS_MAX.saturating_sub(points.len()).max(1);
        let chords = chords.clamp(1, left);
        points.extend((1..=chords).map(|i| curve.at(from_lu + length_lu * i as f64 / chords as f64).position));
    }
    points
}
