//! Cuts a block whose F changes along it (FLIN, FCUB, G95 under G96) into stretches of constant F.
//!
//! In: a piece of path with [`Feed::Varying`]. Out: its stretches in order, each with one [`Feed::Path`]. The feeds are spread evenly
//! over the piece: where blends have taken its ends, over what is left. Neighbours of equal feed are one stretch, and so are stretches
//! that would take less than [`CYCLES_MIN`] cycles each, with the lowest of their feeds: the feed is nowhere above what is
//! programmed. Does not plan the speed.

use super::split::{self, Part};
use crate::interpreter::Feed;
use crate::kinematics::JointPath;
use crate::smoothing::PieceKind;

/// Cycles of the interpolator that a stretch takes at least: a change of speed takes a few.
const CYCLES_MIN: f64 = 4.0;

/// The stretches of a piece, at least one.
pub(super) fn stretches(path: JointPath, setpoint_period_s: f64) -> Vec<JointPath> {
    let (PieceKind::Block(curve), Feed::Varying { feeds_lu_s }) = (&path.contour.kind, &path.contour.feed) else {
        return vec![path];
    };
    let (length_lu, feeds_lu_s) = (curve.length_lu(), feeds_lu_s.clone());
    let count = feeds_lu_s.len();
    let fastest_lu_s = feeds_lu_s.iter().copied().fold(0.0, f64::max);
    let room = (length_lu / (fastest_lu_s * setpoint_period_s * CYCLES_MIN)).floor();
    // Numbers that are none, and short blocks, stay whole.
    let groups = if room >= 1.0 { (room as usize).min(count) } else { 1 };
    if groups < 2 {
        return vec![path];
    }
    // Places between feeds, each with the feed that begins there.
    let mut borders: Vec<(usize, f64)> = Vec::new();
    for group in 0..groups {
        let (from, to) = (group * count / groups, (group + 1) * count / groups);
        let feed_lu_s = feeds_lu_s[from..to].iter().copied().fold(f64::INFINITY, f64::min);
        if borders.last().is_none_or(|(_, before_lu_s)| *before_lu_s != feed_lu_s) {
            borders.push((from, feed_lu_s));
        }
    }
    let place_lu = |index: usize| length_lu * index as f64 / count as f64;
    let ends = borders.iter().skip(1).map(|(from, _)| place_lu(*from)).chain([length_lu]);
    let stretch = |((from, feed_lu_s), end_lu): (&(usize, f64), f64)| {
        let mut stretch = split::cut(&path, place_lu(*from), end_lu);
        stretch.contour.feed = Feed::Path { feed_lu_s: *feed_lu_s };
        Part { path: stretch, worst: None }
    };
    let parts = borders.iter().zip(ends).map(stretch).collect();
    split::named(parts, &path.contour, length_lu).into_iter().map(|part| part.path).collect()
}
