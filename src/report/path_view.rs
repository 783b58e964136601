//! The path as the page draws it.
//!
//! In: a track with the places on the line where its samples belong, feed and limit over time. Out: JSON: at most [`POINTS_MAX`] points with
//! time, place on the line, error from there, feed; of each stretch the first sample and that with the largest error, so that no peak is
//! hidden. Does not project and does not colour.

use super::encode::{Rounding, Steps};
use crate::base::units::mm_min_from_mm_s;
use crate::compare::{Match, Series, Track};
use crate::trace::Trace;
use serde_json::{Value, json};

/// Points of the page at most.
pub const POINTS_MAX: usize = 16_000;

/// What is drawn as a path.
pub struct PathSource<'a> {
    /// The path that is judged.
    pub track: &'a Track,
    /// Where its samples belong; `None`: there is nothing to hold it against.
    pub matches: Option<&'a [Option<Match>]>,
    /// What it is held against, for people.
    pub against: String,
    /// The trace that knows feed and limits.
    pub trace: &'a Trace,
}

/// The path of a page.
pub fn path_json(source: &PathSource<'_>) -> Value {
    let kept = kept(source);
    let n = kept.len();
    let mut columns: [Vec<f64>; 8] = std::array::from_fn(|_| Vec::with_capacity(n));
    let feed_signal = source.trace.signal("path.feed_mm_min").filter(|signal| !signal.is_empty());
    let mut feed = feed_signal.map(|signal| Series::of(signal).cursor());
    for &k in &kept {
        let point = source.track.points_mm[k];
        let error = source.matches.and_then(|matches| matches[k]).map_or([0.0; 3], |found| found.error_mm);
        let time_s = source.track.time_s(k);
        columns[0].push(time_s);
        for i in 0..3 {
            columns[1 + i].push(point[i] - error[i]);
            columns[4 + i].push(error[i]);
        }
        let from_signal = feed.as_mut().map(|cursor| cursor.value(time_s));
        columns[7].push(from_signal.filter(|value| value.is_finite()).unwrap_or_else(|| own_feed(source.track, k)));
    }
    let bytes = [3, 3, 3, 3, 2, 2, 2, 2];
    let pack = |column: usize| {
        Steps::covering(columns[column].iter(), bytes[column]).pack(&columns[column], Rounding::Nearest)
    };
    json!({
        "count": n,
        "samples": source.track.points_mm.len(),
        "against": source.against,
        "stem": source.track.stem,
        "in_part": source.track.in_part,
        "axes": source.track.axes,
        "judged": source.matches.is_some(),
        "time": pack(0), "x": pack(1), "y": pack(2), "z": pack(3), "ex": pack(4), "ey": pack(5), "ez": pack(6), "feed": pack(7),
    })
}

/// Feed by the track itself, mm/min.
fn own_feed(track: &Track, k: usize) -> f64 {
    let (from, to) = (k.saturating_sub(1), (k + 1).min(track.points_mm.len() - 1));
    let (p, q) = (track.points_mm[from], track.points_mm[to]);
    let way_mm = (0..3).map(|i| (q[i] - p[i]).powi(2)).sum::<f64>().sqrt();
    mm_min_from_mm_s(way_mm / (track.time_s(to) - track.time_s(from)))
}

/// Samples to keep, in order.
fn kept(source: &PathSource<'_>) -> Vec<usize> {
    let points = &source.track.points_mm;
    let finite = |k: &usize| points[*k].iter().all(|x| x.is_finite());
    let all: Vec<usize> = (0..points.len()).filter(finite).collect();
    if all.len() <= POINTS_MAX {
        return all;
    }
    let error2 = |k: usize| {
        let found = source.matches.and_then(|matches| matches[k]);
        found.map_or(0.0, |found| found.error_mm.iter().map(|e| e * e).sum::<f64>())
    };
    let mut kept = Vec::with_capacity(POINTS_MAX + 1);
    for chunk in all.chunks(all.len().div_ceil(POINTS_MAX / 2)) {
        let Some(&first) = chunk.first() else { continue };
        let worst = chunk.iter().copied().fold(first, |a, b| if error2(b) > error2(a) { b } else { a });
        kept.push(first);
        if worst != first {
            kept.push(worst);
        }
    }
    kept.extend(all.last().copied().filter(|last| kept.last() != Some(last)));
    kept
}
