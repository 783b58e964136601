//! What the tool does at the corners of the path: how far it shoots past them, how much of them it cuts.
//!
//! In: the set-point line, and for every actual point the place on it where it belongs. Out: [`CornerFigures`], the worst first. A corner
//! is a place where the direction changes by 12 degrees or more within a millimetre, and hardly on either side of it. Overshoot is the
//! distance of the actual path from the outgoing leg to the outer side; the cut is that to the inner side. Does not judge whether a corner
//! is meant to be rounded: what the set-points round is no error here.

use super::heading::Heading;
use super::path::{Match, dot, norm};
use crate::base::units::{UM_PER_MM, deg_from_rad, rad_from_deg};

/// One corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerFigures {
    /// When the set-points pass it.
    pub time_s: f64,
    /// Way of the set-points there.
    pub s_mm: f64,
    /// Where it is.
    pub point_mm: [f64; 3],
    /// Turning angle: 0 = straight on.
    pub angle_deg: f64,
    /// Largest distance to the outer side of the outgoing leg.
    pub overshoot_um: f64,
    /// Largest distance to the inner side, on either leg.
    pub cut_um: f64,
}

/// Half the window within which the direction changes.
const HALF_WINDOW_MM: f64 = 0.5;
const ANGLE_MIN_DEG: f64 = 12.0;
/// Beside the corner the direction changes by less than this share of its angle over the same way.
const CALM_SHARE: f64 = 0.2;
/// Way behind the corner in which the tool swings in.
const SWING_MM: f64 = 5.0;

/// All corners of a line with their figures, in order of the way. `matches[k]`: where actual point k belongs, in order of time.
pub fn corners(heading: &Heading, line_time_s: &dyn Fn(f64) -> f64, matches: &[Option<Match>]) -> Vec<CornerFigures> {
    let places = places(heading);
    let half = half_window(heading);
    let mut found = Vec::with_capacity(places.len());
    let mut first = 0;
    for (n, &(at, angle_rad)) in places.iter().enumerate() {
        let s_mm = at as f64 * heading.step_mm;
        let (Some(incoming), Some(outgoing)) =
            (heading.direction(at - 2 * half, at - half), heading.direction(at + half, at + 2 * half))
        else {
            continue;
        };
        // To the outer side: what of the incoming direction the outgoing one does not have.
        let along = dot(incoming, outgoing);
        let side: [f64; 3] = std::array::from_fn(|i| incoming[i] - along * outgoing[i]);
        let length = norm(side);
        let turned_back = length < 1e-6;
        let outer = if turned_back { incoming } else { side.map(|x| x / length) };
        let next_mm = places.get(n + 1).map_or(f64::MAX, |next| next.0 as f64 * heading.step_mm - HALF_WINDOW_MM);
        let end_mm = (s_mm + SWING_MM).min(next_mm.max(s_mm + HALF_WINDOW_MM));
        let (mut overshoot_mm, mut cut_mm): (f64, f64) = (0.0, 0.0);
        while first < matches.len() && matches[first].is_none_or(|m| m.s_mm < s_mm - 2.0 * HALF_WINDOW_MM) {
            first += 1;
        }
        for m in matches[first..].iter().map_while(|m| m.filter(|m| m.s_mm <= end_mm)) {
            let outward_mm = dot(m.error_mm, outer);
            if m.s_mm >= s_mm - HALF_WINDOW_MM {
                overshoot_mm = overshoot_mm.max(outward_mm);
            }
            cut_mm = cut_mm.max(-outward_mm);
        }
        found.push(CornerFigures {
            time_s: line_time_s(s_mm),
            s_mm,
            point_mm: heading.points_mm[at],
            angle_deg: deg_from_rad(angle_rad),
            overshoot_um: overshoot_mm * UM_PER_MM,
            cut_um: cut_mm * UM_PER_MM,
        });
    }
    found
}

fn half_window(heading: &Heading) -> usize {
    ((HALF_WINDOW_MM / heading.step_mm).round() as usize).max(1)
}

/// Points of the heading in the middle of a corner, with its angle.
fn places(heading: &Heading) -> Vec<(usize, f64)> {
    let half = half_window(heading);
    let n = heading.points_mm.len();
    let least_rad = rad_from_deg(ANGLE_MIN_DEG);
    let mut found: Vec<(usize, f64)> = Vec::new();
    if n < 6 * half {
        return found;
    }
    let angle = |a: [f64; 3], b: [f64; 3]| dot(a, b).clamp(-1.0, 1.0).acos();
    let turn = |at: usize| {
        let (a, b) = (heading.direction(at - 2 * half, at - half), heading.direction(at + half, at + 2 * half));
        a.zip(b).map_or(0.0, |(a, b)| angle(a, b))
    };
    // Calm beside: the legs are straight, or at least bend much less.
    let calm = |at: usize, angle_rad: f64| {
        let bend = |from: usize| {
            let (a, b) = (heading.direction(from, from + half / 2), heading.direction(from + half / 2, from + half));
            a.zip(b).map_or(0.0, |(a, b)| angle(a, b))
        };
        bend(at - 2 * half) < CALM_SHARE * angle_rad && bend(at + half) < CALM_SHARE * angle_rad
    };
    let mut best: Option<(usize, f64, usize)> = None;
    for at in 2 * half..n - 2 * half {
        let turned = turn(at);
        let corner = turned >= least_rad && calm(at, turned);
        match (&mut best, corner) {
            // The turn is the same all over the window: the middle of the stretch is the corner.
            (Some((from, most, to)), true) => (*from, *most, *to) = (*from, most.max(turned), at),
            (None, true) => best = Some((at, turned, at)),
            (Some((from, most, to)), false) => {
                found.push((usize::midpoint(*from, *to), *most));
                best = None;
            }
            (None, false) => {}
        }
    }
    found.extend(best.map(|(from, most, to)| (usize::midpoint(from, to), most)));
    found
}
