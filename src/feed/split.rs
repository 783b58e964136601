//! Cuts a block whose bend varies into parts with a speed of their own.
//!
//! In: a piece of path. Out: its parts in order, each with the greatest demands on it: a line, arc or blend as it is, a spline or
//! polynomial (and any curve that the axes follow through a transformation) cut where its direction or curvature steps, and where the speed that it allows changes so much, and for so long, that
//! changing the speed pays. Parts belong to the same block: the first has its events and its count, the last its stop.
//!
//! A change of speed ends without acceleration where a part ends, so that many short parts are slower than one. Borders are taken away
//! until on each part that is faster than a neighbour there is room for the change.
//! Does not plan the speed.

use super::limits::{AxisRules, FeedCap, PieceLimits};
use super::scan::Scan;
use super::worst::Worst;
use crate::base::Portable;
use crate::geometry::Curve;
use crate::kinematics::JointPath;
use crate::smoothing::{ContourPiece, PieceKind};

/// Speeds of neighbouring stretches that differ by less than this factor are one.
const STEP_RATIO: f64 = 1.25;

/// Room on a faster part as share of the way that its changes of speed take: with less, its border is taken away.
const ROOM_RATIO: f64 = 0.7;

/// A part of a block.
#[derive(Debug)]
pub(super) struct Part {
    pub path: JointPath,
    /// `None`: the curve has closed forms.
    pub worst: Option<Worst>,
}

/// Stretch between two places of a scan with the lowest speed on it.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    first: usize,
    last: usize,
    speed_lu_s: f64,
}

/// The parts of a piece, at least one.
pub(super) fn parts(rules: &AxisRules, path: JointPath) -> Vec<Part> {
    let breaks_lu = match &path.contour.kind {
        PieceKind::Block(Curve::Polynomial(curve)) => curve.breaks_lu(),
        PieceKind::Block(_) if !path.is_contour() => Vec::new(),
        PieceKind::Blend(curve, _)
            if matches!(curve, Curve::Polynomial(_) | Curve::Quintic(_)) || !path.is_contour() =>
        {
            let scan = scan(rules, &path);
            let path_of = rules.path_limits.then_some(&rules.linear);
            let worst = Some(scan.worst(0, scan.places().len().saturating_sub(1), path_of));
            return vec![Part { path, worst }];
        }
        _ => return vec![Part { path, worst: None }],
    };
    let length_lu = path.length_lu();
    let mut borders = vec![0.0];
    borders.extend(breaks_lu);
    borders.push(length_lu);
    let mut parts = Vec::new();
    for range in borders.windows(2) {
        let smooth = cut(&path, range[0], range[1]);
        let scan = scan(rules, &smooth);
        for stretch in stretches(rules, &smooth, &scan) {
            let places = scan.places();
            let (from_lu, to_lu) = (places[stretch.first].s_lu, places[stretch.last].s_lu);
            let worst = Some(scan.worst(stretch.first, stretch.last, None));
            parts.push(Part { path: cut(&smooth, from_lu, to_lu), worst });
        }
    }
    named(parts, &path.contour, length_lu)
}

/// The parts of a piece between places where its direction or curvature steps, at least one.
pub(super) fn smooth_parts(path: JointPath) -> Vec<Part> {
    let PieceKind::Block(Curve::Polynomial(curve)) = &path.contour.kind else {
        return vec![Part { path, worst: None }];
    };
    let (length_lu, breaks_lu) = (curve.length_lu(), curve.breaks_lu());
    if breaks_lu.is_empty() {
        return vec![Part { path, worst: None }];
    }
    let borders: Vec<f64> = [0.0].into_iter().chain(breaks_lu).chain([length_lu]).collect();
    let part = |range: &[f64]| Part { path: cut(&path, range[0], range[1]), worst: None };
    named(borders.windows(2).map(part).collect(), &path.contour, length_lu)
}

/// Gives the first part what begins with the block and the last what ends with it.
pub(super) fn named(mut parts: Vec<Part>, whole: &ContourPiece, length_lu: f64) -> Vec<Part> {
    let several = parts.len() > 1;
    if let Some(first) = parts.first_mut() {
        first.path.contour.events = whole.events.clone();
        first.path.contour.blocks_begun = whole.blocks_begun;
    }
    if let Some(last) = parts.last_mut() {
        last.path.contour.stop_at_end = whole.stop_at_end;
    }
    for part in parts.iter_mut().filter(|_| several) {
        part.path.contour.block_length_lu = whole.block_length_lu.or(Some(length_lu));
    }
    parts
}

fn scan(rules: &AxisRules, path: &JointPath) -> Scan {
    Scan::new(rules, path, feed_of(rules, &path.contour))
}

fn feed_of(rules: &AxisRules, contour: &ContourPiece) -> FeedCap {
    contour.curve().map_or(FeedCap::Rapid, |curve| rules.feed_cap(&contour.feed, curve))
}

/// The stretch of a piece as a piece.
pub(super) fn cut(path: &JointPath, from_lu: f64, to_lu: f64) -> JointPath {
    let ContourPiece { block, kind, feed, modes, block_length_lu, .. } = &path.contour;
    let kind = match kind {
        PieceKind::Block(curve) => PieceKind::Block(curve.trimmed(from_lu, to_lu)),
        other => other.clone(),
    };
    JointPath {
        contour: ContourPiece {
            block: *block,
            kind,
            feed: feed.clone(),
            modes: modes.clone(),
            events: Vec::new(),
            blocks_begun: 0,
            block_length_lu: *block_length_lu,
            stop_at_end: false,
        },
        transformation: path.transformation.clone(),
    }
}

/// Stretches of about equal speed that are long enough to change it.
fn stretches(rules: &AxisRules, path: &JointPath, scan: &Scan) -> Vec<Stretch> {
    let last = scan.places().len().saturating_sub(1);
    let speeds = scan.speeds_lu_s(rules, feed_of(rules, &path.contour));
    let lowest_lu_s = speeds.iter().copied().fold(f64::INFINITY, f64::min);
    let highest_lu_s = speeds.iter().copied().fold(0.0, f64::max);
    let whole = Stretch { first: 0, last, speed_lu_s: lowest_lu_s };
    if !(highest_lu_s > STEP_RATIO * lowest_lu_s && lowest_lu_s > 0.0) {
        return vec![whole];
    }
    let level = |speed_lu_s: f64| ((speed_lu_s / lowest_lu_s).portable_ln() / STEP_RATIO.portable_ln()).floor();
    let mut stretches: Vec<Stretch> = Vec::new();
    for i in 0..last {
        let speed_lu_s = speeds[i].min(speeds[i + 1]);
        match stretches.last_mut() {
            Some(before) if level(before.speed_lu_s) == level(speed_lu_s) => {
                before.last = i + 1;
                before.speed_lu_s = before.speed_lu_s.min(speed_lu_s);
            }
            _ => stretches.push(Stretch { first: i, last: i + 1, speed_lu_s }),
        }
    }
    let dynamics = PieceLimits::rough_dynamics(rules, &scan.worst(0, last, None));
    let way_lu = |from: &Stretch, to: &Stretch| dynamics.ramp_length_lu(from.speed_lu_s, to.speed_lu_s);
    while let Some(tightest) = tightest(&stretches, scan, &way_lu) {
        let gone = stretches.remove(tightest + 1);
        let kept = &mut stretches[tightest];
        kept.last = gone.last;
        kept.speed_lu_s = kept.speed_lu_s.min(gone.speed_lu_s);
    }
    stretches
}

/// The border to take away: index of the stretch before it; `None` if all pay. Of the stretch with the least room either it becomes as
/// slow as a slower neighbour, or a faster neighbour becomes as slow as it is: what costs less time.
fn tightest(stretches: &[Stretch], scan: &Scan, way_lu: &impl Fn(&Stretch, &Stretch) -> f64) -> Option<usize> {
    let mut least = (ROOM_RATIO, None);
    for (i, stretch) in stretches.iter().enumerate() {
        let neighbours = [i.checked_sub(1), Some(i + 1)].into_iter().flatten().filter_map(|k| stretches.get(k));
        let slower = neighbours.filter(|other| other.speed_lu_s < stretch.speed_lu_s);
        let needed_lu: f64 = slower.map(|other| way_lu(other, stretch)).sum();
        let room = length_lu(stretch, scan) / needed_lu;
        // A stretch without a slower neighbour needs no room.
        if needed_lu > 0.0 && room < least.0 {
            least = (room, Some(i));
        }
    }
    let tight = least.1?;
    let cost_s = |before: usize| {
        let (a, b) = (stretches.get(before)?, stretches.get(before + 1)?);
        let (slow, fast) = if a.speed_lu_s < b.speed_lu_s { (a, b) } else { (b, a) };
        Some(length_lu(fast, scan) * (1.0 / slow.speed_lu_s - 1.0 / fast.speed_lu_s))
    };
    let borders = [tight.checked_sub(1), Some(tight)].into_iter().flatten();
    let costs = borders.filter_map(|before| Some((before, cost_s(before)?)));
    costs.reduce(|a, b| if b.1 < a.1 { b } else { a }).map(|(before, _)| before)
}

fn length_lu(stretch: &Stretch, scan: &Scan) -> f64 {
    let places = scan.places();
    places[stretch.last].s_lu - places[stretch.first].s_lu
}
