//! Contour error: how far one path is from another, in space and in a plane, along the way.
//!
//! In: the track of a tool and a line to hold it against. Out: [`Contour`]: figures, the match of every sample, circles and corners. The
//! distance of a sample is that to the nearest point on the segments of the line (chord error of the line's samples: v² T² / 8 R).
//! Samples beyond the ends of the line, and in gaps, do not count. Does not compare in time: a pure lag along the path is no error here.

use super::circle::{Actual, CircleFigures, circles};
use super::corner::{CornerFigures, corners};
use super::geometry::{Track, flat};
use super::heading::Heading;
use super::path::{Follower, Line, Match, dot};
use super::statistics::{Figures, Gathering};

/// A track against a line.
#[derive(Clone, Debug)]
pub struct Contour {
    /// Distance in space, mm.
    pub space: Figures,
    /// Distance in the plane, mm; left positive, right negative, seen against the axis that is left out.
    pub plane: Option<Figures>,
    /// Where each sample of the track belongs; `None` in gaps and beyond the ends.
    pub matches: Vec<Option<Match>>,
    /// Share of the samples that belong to the line.
    pub matched_share: f64,
}

/// Names of the planes, by the coordinate that they leave out.
pub const PLANES: [&str; 3] = ["YZ", "ZX", "XY"];

/// Matches every sample of `track` with `line`. `start_s`: when the line's own clock shows the first sample of the track.
pub fn follow(track: &Track, line: &Line, start_s: f64, plane: Option<usize>) -> Vec<Option<Match>> {
    let Some(mut follower) = Follower::new(line, start_s) else { return vec![None; track.points_mm.len()] };
    let points = track.points_mm.iter().map(|point| flat(*point, plane));
    points.map(|point_mm| follower.next(point_mm).filter(|found| !found.beyond_end)).collect()
}

/// Contour error of a track. `plane`: the coordinate that the error in the plane leaves out. `None` where nothing matches.
pub fn contour(track: &Track, line: &Line, flat_line: &Line, start_s: f64, plane: usize) -> Option<Contour> {
    let matches = follow(track, line, start_s, None);
    let mut space = Gathering::default();
    let mut matched = 0;
    for (k, found) in matches.iter().enumerate() {
        if let Some(found) = found {
            space.push(track.time_s(k), found.distance_mm);
            matched += 1;
        }
    }
    let flat_matches = follow(track, flat_line, start_s, Some(plane));
    let mut in_plane = Gathering::default();
    for (k, found) in flat_matches.iter().enumerate() {
        if let Some(found) = found {
            in_plane.push(track.time_s(k), signed_distance(found, plane));
        }
    }
    let matched_share = f64::from(matched) / matches.len().max(1) as f64;
    Some(Contour { space: space.finish()?, plane: in_plane.finish(), matches, matched_share })
}

/// Distance with a sign: left of the direction of travel is positive, seen against the axis that is left out.
fn signed_distance(found: &Match, plane: usize) -> f64 {
    let (u, v) = ((plane + 1) % 3, (plane + 2) % 3);
    let mut left = [0.0; 3];
    (left[u], left[v]) = (-found.direction[v], found.direction[u]);
    if dot(left, found.error_mm) < 0.0 { -found.distance_mm } else { found.distance_mm }
}

/// Circles and corners of a line, with what the tool does on them.
#[derive(Clone, Debug, Default)]
pub struct Features {
    /// Full circles in order of time.
    pub circles: Vec<CircleFigures>,
    /// Arcs of 45 degrees and more that are no full circle: counted, not judged.
    pub arcs_total: usize,
    /// Corners in order of the way.
    pub corners: Vec<CornerFigures>,
}

/// Finds circles and corners. `matches`: of the track against this line.
pub fn features(line: &Line, track: &Track, matches: &[Option<Match>]) -> Features {
    let heading = Heading::new(line);
    let times: Vec<(f64, f64)> = line.vertices().map(|(s_mm, _, time_s)| (s_mm, time_s)).collect();
    let time_s = |s_mm: f64| {
        let i = times.partition_point(|(s, _)| *s <= s_mm).saturating_sub(1);
        times.get(i).map_or(f64::NAN, |(_, time_s)| *time_s)
    };
    let actual = Actual { points_mm: &track.points_mm, matches, line_time_s: &time_s };
    let (circles, arcs_total) = circles(&heading, &actual);
    Features { circles, arcs_total, corners: corners(&heading, &time_s, matches) }
}
