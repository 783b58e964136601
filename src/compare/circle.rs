//! Circles in a path, and how round the tool goes on them (ISO 230-4).
//!
//! In: the set-point line, and for every actual point the place on it where it belongs. Out: [`CircleFigures`] of each full circle in a
//! plane of two axes: circular deviation G, radial deviations F, the peaks behind the quadrants, and G(b) over both directions.
//!
//! * G: width of the narrowest ring that holds the actual path (minimum zone), which is how ISO 230-4 defines it, and the width about the
//!   centre of the least-squares circle, by which the norm lets it be evaluated and which most instruments show. The latter is never smaller.
//! * F max, F min: distance from the nominal centre minus the nominal radius, both of the set-points. Outside counts positive.
//! * G(b): the same two widths for a circle and the circle in the other direction with the same centre and radius, together.
//! * Quadrant peak: largest outward distance within 20 degrees behind the place where an axis turns back, over the mean of the 15 degrees before it.
//!
//! Arcs of less than a full turn are counted and not judged: on a part of a circle the centre is hardly determined, and G would say more
//! about it than about the machine. Does not look for circles in oblique planes.

use super::heading::Heading;
use super::path::Match;
use super::round::{fit_circle, minimum_zone, ring};
use crate::base::units::{UM_PER_MM, deg_from_rad, rad_from_deg};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// One full circle (or several turns of it) in one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct CircleFigures {
    /// The two axes of its plane, such as X and Y.
    pub plane: [&'static str; 2],
    /// Centre by the set-points, in these axes.
    pub centre_mm: [f64; 2],
    /// Radius by the set-points.
    pub radius_mm: f64,
    /// True: from the first axis of the plane to the second.
    pub counter_clockwise: bool,
    /// When the set-points enter it.
    pub start_s: f64,
    /// When they leave it.
    pub end_s: f64,
    /// Circular deviation G about the centre of the least-squares circle.
    pub deviation_um: f64,
    /// Circular deviation G by the minimum zone.
    pub minimum_zone_um: f64,
    /// Largest and smallest radial deviation F.
    pub radial_max_um: f64,
    /// See above.
    pub radial_min_um: f64,
    /// Mean radial deviation: a circle that is too small as a whole, as the drives make it.
    pub radial_mean_um: f64,
    /// Bi-directional circular deviation G(b), with the circle of the other direction; `None` without one.
    pub bidirectional_um: Option<f64>,
    /// The same by the minimum zone.
    pub bidirectional_minimum_zone_um: Option<f64>,
    /// Peaks behind the quadrants at 0, 90, 180 and 270 degrees; `None` where the circle was not passed with enough samples around.
    pub quadrant_peaks_um: [Option<f64>; 4],
}

/// Actual path of a circle: angle and distance from the nominal centre.
struct Round {
    figures: CircleFigures,
    /// Actual points in the plane, from the nominal centre.
    points_mm: Vec<[f64; 2]>,
    /// Some of them, at equal ways: a place where the tool is slow must not pull the centre.
    spread_mm: Vec<[f64; 2]>,
}

/// Planes by the coordinate that is left out: Z, Y, X.
const PLANES: [([usize; 2], [&str; 2]); 3] = [([0, 1], ["X", "Y"]), ([2, 0], ["Z", "X"]), ([1, 2], ["Y", "Z"])];
/// A run of equal curvature that turns less than this is no full circle.
const TURN_MIN_RAD: f64 = TAU * 0.95;
/// A run that turns by less than this is no arc.
const ARC_MIN_RAD: f64 = FRAC_PI_2 * 0.5;
/// Curvature may differ from that of the run by this share.
const CURVATURE_SHARE: f64 = 0.05;
/// Way over which the curvature is measured at least.
const WINDOW_MM: f64 = 0.5;
/// Smallest radius that is looked for.
const RADIUS_MIN_MM: f64 = 1.0;
/// Set-points may leave their own circle by this share of its radius.
const ROUND_SHARE: f64 = 2e-3;
/// Circles are the same within this.
const SAME_MM: f64 = 0.2;

/// What circles are judged by: actual points, where each belongs, and when the set-points are where.
#[derive(Clone, Copy)]
pub struct Actual<'a> {
    /// Points of the tool, `[n]`.
    pub points_mm: &'a [[f64; 3]],
    /// Where each belongs on the line, `[n]`.
    pub matches: &'a [Option<Match>],
    /// Time of a place of the line.
    pub line_time_s: &'a dyn Fn(f64) -> f64,
}

/// All full circles of a line, in order of time, and the number of shorter arcs.
pub fn circles(heading: &Heading, actual: &Actual<'_>) -> (Vec<CircleFigures>, usize) {
    let mut rounds: Vec<Round> = Vec::new();
    let mut arcs = 0;
    for (axes, plane) in PLANES {
        let found = runs(heading, axes);
        arcs += found.arcs;
        for (from, to) in found.full {
            rounds.extend(judge(heading, axes, plane, from..to, actual));
        }
    }
    rounds.sort_by(|a, b| a.figures.start_s.total_cmp(&b.figures.start_s));
    for i in 0..rounds.len() {
        let partner = (0..rounds.len()).filter(|j| opposite(&rounds[i].figures, &rounds[*j].figures));
        let nearest = partner.min_by_key(|j| j.abs_diff(i));
        let both = nearest.and_then(|j| both_ways(&rounds[i], &rounds[j]));
        rounds[i].figures.bidirectional_um = both.map(|[about_mean, _]| about_mean);
        rounds[i].figures.bidirectional_minimum_zone_um = both.map(|[_, narrowest]| narrowest);
    }
    (rounds.into_iter().map(|round| round.figures).collect(), arcs)
}

fn opposite(a: &CircleFigures, b: &CircleFigures) -> bool {
    let near = |x: f64, y: f64| (x - y).abs() < SAME_MM;
    a.plane == b.plane
        && a.counter_clockwise != b.counter_clockwise
        && near(a.radius_mm, b.radius_mm)
        && near(a.centre_mm[0], b.centre_mm[0])
        && near(a.centre_mm[1], b.centre_mm[1])
}

/// G(b) about the centre of both, and by the minimum zone.
fn both_ways(a: &Round, b: &Round) -> Option<[f64; 2]> {
    let shift: [f64; 2] = std::array::from_fn(|i| b.figures.centre_mm[i] - a.figures.centre_mm[i]);
    let both = |a: &[[f64; 2]], b: &[[f64; 2]]| -> Vec<[f64; 2]> {
        a.iter().copied().chain(b.iter().map(|p| [p[0] + shift[0], p[1] + shift[1]])).collect()
    };
    let (centre, _) = fit_circle(&both(&a.spread_mm, &b.spread_mm))?;
    let points_mm = both(&a.points_mm, &b.points_mm);
    Some([um(ring(&points_mm, centre)), um(minimum_zone(&points_mm, centre))])
}

fn um(length_mm: f64) -> f64 {
    length_mm * UM_PER_MM
}

/// Stretches of constant curvature in a plane.
#[derive(Default)]
struct Runs {
    /// Those that turn fully: `from..to` in points of the heading.
    full: Vec<(usize, usize)>,
    /// Number of those that turn by [`ARC_MIN_RAD`] and more, but not fully.
    arcs: usize,
}

fn runs(heading: &Heading, axes: [usize; 2]) -> Runs {
    let points = &heading.points_mm;
    let half = ((WINDOW_MM / heading.step_mm).ceil() as usize).max(2);
    let n = points.len();
    if n < 4 * half {
        return Runs::default();
    }
    let other = 3 - axes[0] - axes[1];
    let angle = |i: usize| {
        let (p, q) = (&points[i - half], &points[i + half]);
        (q[axes[1]] - p[axes[1]]).atan2(q[axes[0]] - p[axes[0]])
    };
    // Over half a window the angle turns by far more than the chords of the set-points make it uncertain.
    let stride = half.div_ceil(2);
    let mut found = Runs::default();
    let (mut start, mut turned, mut steps, mut last): (usize, f64, f64, Option<f64>) = (half, 0.0, 0.0, None);
    let mut close = |start: usize, end: usize, turned: f64| {
        // The window shortens a run at both ends by half of itself: that much of the circle lies outside.
        let end = end.max(start);
        let mean = turned.abs() / (end - start).max(1) as f64;
        let whole = turned.abs() + 2.0 * half as f64 * mean;
        if whole >= TURN_MIN_RAD {
            found.full.push((start, end));
        } else if whole >= ARC_MIN_RAD && end - start >= 2 * half {
            found.arcs += 1;
        }
    };
    for i in (half..n - half).step_by(stride) {
        let here = angle(i);
        let step_rad = last.map_or(0.0, |before| wrapped(here - before));
        last = Some(here);
        let mean = if steps > 0.0 { turned / steps } else { step_rad };
        let flat = (points[i][other] - points[start][other]).abs() < 0.5 * SAME_MM;
        // The first steps of a run settle its mean.
        let alike = steps < 2.0 || (step_rad - mean).abs() <= CURVATURE_SHARE * mean.abs();
        let bent = step_rad.abs() > 1e-6 && step_rad.abs() < stride as f64 * heading.step_mm / RADIUS_MIN_MM;
        if alike && flat && bent && step_rad * mean >= 0.0 {
            turned += step_rad;
            steps += 1.0;
        } else {
            close(start, i - stride, turned);
            (start, turned, steps) = (i, 0.0, 0.0);
        }
    }
    close(start, n - half, turned);
    found
}

fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

fn judge(
    heading: &Heading,
    axes: [usize; 2],
    plane: [&'static str; 2],
    run: std::ops::Range<usize>,
    actual: &Actual<'_>,
) -> Option<Round> {
    let nominal: Vec<[f64; 2]> = heading.points_mm[run.clone()].iter().map(|p| [p[axes[0]], p[axes[1]]]).collect();
    let (centre, radius_mm) = fit_circle(&nominal)?;
    if ring(&nominal, centre) > (ROUND_SHARE * radius_mm).max(0.01) {
        return None;
    }
    let turning: f64 = nominal.windows(3).map(cross).sum();
    let run = extended(heading, axes, &run, (centre, radius_mm), turning.signum());
    let way = |i: usize| i as f64 * heading.step_mm;
    let (from_mm, to_mm) = (way(run.start), way(run.end));
    let inside = |m: &Match| m.s_mm >= from_mm && m.s_mm <= to_mm;
    let place =
        |(k, _): (usize, &Match)| -> [f64; 2] { std::array::from_fn(|i| actual.points_mm[k][axes[i]] - centre[i]) };
    let on_circle =
        || actual.matches.iter().enumerate().filter_map(|(k, m)| Some((k, m.as_ref()?))).filter(|(_, m)| inside(m));
    let points_mm: Vec<[f64; 2]> = on_circle().map(place).collect();
    let spread_mm = spread(on_circle().map(|(_, m)| m), &points_mm, radius_mm);
    let (actual_centre, _) = fit_circle(&spread_mm)?;
    let radial = |p: &[f64; 2]| p[0].hypot(p[1]) - radius_mm;
    let span = points_mm.iter().map(radial).fold((f64::MAX, f64::MIN), |(a, b), r| (a.min(r), b.max(r)));
    let mean_mm = spread_mm.iter().map(radial).sum::<f64>() / spread_mm.len() as f64;
    let counter_clockwise = turning > 0.0;
    let figures = CircleFigures {
        plane,
        centre_mm: centre,
        radius_mm,
        counter_clockwise,
        start_s: (actual.line_time_s)(from_mm),
        end_s: (actual.line_time_s)(to_mm),
        deviation_um: um(ring(&points_mm, actual_centre)),
        minimum_zone_um: um(minimum_zone(&points_mm, actual_centre)),
        radial_max_um: um(span.1),
        radial_min_um: um(span.0),
        radial_mean_um: um(mean_mm),
        bidirectional_um: None,
        bidirectional_minimum_zone_um: None,
        quadrant_peaks_um: std::array::from_fn(|q| {
            quadrant_peak([&points_mm, &spread_mm], radius_mm, q as f64 * FRAC_PI_2, counter_clockwise)
        }),
    };
    Some(Round { figures, points_mm, spread_mm })
}

/// A run with what the window left out at its ends: as far as the line stays on the circle and goes on in its direction.
fn extended(
    heading: &Heading,
    axes: [usize; 2],
    run: &std::ops::Range<usize>,
    (centre, radius_mm): ([f64; 2], f64),
    sign: f64,
) -> std::ops::Range<usize> {
    let most = (3.0 * WINDOW_MM / heading.step_mm).ceil() as usize;
    let slack_mm = (1e-4 * radius_mm).max(2e-4);
    let from_centre = |i: usize| heading.points_mm.get(i).map(|p| [p[axes[0]] - centre[0], p[axes[1]] - centre[1]]);
    // Whether point `to` lies on the circle and ahead of point `from`.
    let goes_on = |from: usize, to: usize| {
        let Some((a, b)) = from_centre(from).zip(from_centre(to)) else { return false };
        (b[0].hypot(b[1]) - radius_mm).abs() <= slack_mm && sign * (a[0] * b[1] - a[1] * b[0]) > 0.0
    };
    let (mut start, mut end) = (run.start, run.end);
    for _ in 0..most {
        // Backwards: the point before must see the run's first one ahead of it.
        let on = start > 0 && from_centre(start - 1).is_some_and(|p| (p[0].hypot(p[1]) - radius_mm).abs() <= slack_mm);
        if on && goes_on(start - 1, start) {
            start -= 1;
        }
        if goes_on(end, end + 1) {
            end += 1;
        }
    }
    // Where the line turns back on itself, points near the turn fit both ways: there the run stays as it was found.
    let on = |i: usize| from_centre(i).is_some_and(|p| (p[0].hypot(p[1]) - radius_mm).abs() <= slack_mm);
    if on(end + 1) && !goes_on(end, end + 1) {
        end = run.end;
    }
    if start > 0 && on(start - 1) && !goes_on(start - 1, start) {
        start = run.start;
    }
    start..end
}

/// Of the points those that are half a degree of way apart.
fn spread<'a>(places: impl Iterator<Item = &'a Match>, points_mm: &[[f64; 2]], radius_mm: f64) -> Vec<[f64; 2]> {
    let least_mm = rad_from_deg(0.5) * radius_mm;
    let mut last_mm = f64::NEG_INFINITY;
    let mut kept = Vec::new();
    for (place, point_mm) in places.zip(points_mm) {
        if place.s_mm - last_mm >= least_mm {
            last_mm = place.s_mm;
            kept.push(*point_mm);
        }
    }
    kept
}

fn cross(w: &[[f64; 2]]) -> f64 {
    (w[1][0] - w[0][0]) * (w[2][1] - w[1][1]) - (w[1][1] - w[0][1]) * (w[2][0] - w[1][0])
}

/// Peak behind a quadrant over the level before it, in um; outward positive. `points_mm`: all, and those at equal ways.
fn quadrant_peak(points_mm: [&[[f64; 2]]; 2], radius_mm: f64, at_rad: f64, counter_clockwise: bool) -> Option<f64> {
    let sign = if counter_clockwise { 1.0 } else { -1.0 };
    let place = |p: &[f64; 2]| {
        let behind_deg = deg_from_rad(sign * wrapped(p[1].atan2(p[0]) - at_rad));
        (behind_deg, p[0].hypot(p[1]) - radius_mm)
    };
    let [all, spread] = points_mm.map(|points| points.iter().map(place));
    let (before, count) = spread
        .filter(|(behind_deg, _)| (-15.0..-2.0).contains(behind_deg))
        .fold((0.0, 0.0), |(sum, count), (_, radial_mm)| (sum + radial_mm, count + 1.0));
    let behind = all.filter(|(behind_deg, _)| (-2.0..20.0).contains(behind_deg));
    let peak = behind.fold(f64::MIN, |peak, (_, radial_mm)| peak.max(radial_mm));
    (count >= 3.0 && peak > f64::MIN).then(|| um(peak - before / count))
}
