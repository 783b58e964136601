//! The intervals on which the square of the speed is a cubic.
//!
//! In: the pieces of a motion from rest to rest. Out: [`Grid`]: intervals in order, each with the derivatives of the path at its start, middle
//! and end, and what the feed and the velocities of the axes allow there. Near a rest intervals shrink with the distance from it, down
//! to the way of the first jerk, which is no interval. Does not know the speed.

use super::collect::Piece;
use super::profile::Used;
use crate::base::AxisId;
use crate::feed::PieceRules;
use crate::geometry::Curve;
use crate::kinematics::JointState;

/// An interval near a rest or a slow junction takes at most this share of its distance from it.
const NEAR_RATIO: f64 = 0.6;

/// Share of a motion that is left to the constant jerk from a rest, at most.
const REST_SHARE: f64 = 0.01;

/// On an arc an interval turns by this at most; a piece without closed form has so many intervals between two of its nodes.
const ARC_STEP_RAD: f64 = 0.2;
const PANEL_INTERVALS: usize = 2;

/// Intervals of a line or blend to begin with.
const PIECE_INTERVALS: usize = 6;

/// Collocation points of an interval: its ends and its middle.
pub(super) const POINTS_RATIO: [f64; 3] = [0.0, 0.5, 1.0];

/// Places between them at which only the speed is looked at.
pub(super) const BETWEEN_RATIO: [f64; 2] = [0.25, 0.75];

/// The third derivative may step between two intervals: their ends are looked at from inside.
const INSIDE_RATIO: f64 = 1e-6;

/// A share of an interval that is not its end.
pub(super) fn inside(ratio: f64) -> f64 {
    ratio.clamp(INSIDE_RATIO, 1.0 - INSIDE_RATIO)
}

/// The least that [`Share`] leaves.
const SHARE_MIN_RATIO: f64 = 0.3;

/// What does not move an axis: less than this per unit of s.
const STILL_RATIO: f64 = 1e-14;

/// An interval.
#[derive(Clone, Debug)]
pub(super) struct Interval {
    /// Index of its piece.
    pub piece: usize,
    /// Where it begins: in its piece, and in the motion.
    pub from_lu: f64,
    pub place_lu: f64,
    pub length_lu: f64,
    /// At [`POINTS_RATIO`].
    pub points: [PathPoint; 3],
    /// Highest v² half-way between these, where a cubic would else wave about a constant speed.
    pub square_max_between: [f64; 2],
    /// What may be used of the limits here: less where a motion exceeded them between the places.
    pub share: Share,
}

/// Shares of limits, all 1 to begin with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    pub square_ratio: f64,
    pub acceleration_ratio: f64,
    pub jerk_ratio: f64,
}

impl Share {
    const WHOLE: Self = Self { square_ratio: 1.0, acceleration_ratio: 1.0, jerk_ratio: 1.0 };

    /// Less by what is used beyond the limits.
    fn without(self, used: &Used) -> Self {
        let less = |share: f64, used_ratio: f64| (share / used_ratio.max(1.0)).max(SHARE_MIN_RATIO);
        Self {
            square_ratio: less(self.square_ratio, used.velocity_ratio * used.velocity_ratio),
            acceleration_ratio: less(self.acceleration_ratio, used.acceleration_ratio),
            jerk_ratio: less(self.jerk_ratio, used.jerk_ratio),
        }
    }
}

/// The path at a place, in shares of what the axes allow.
#[derive(Clone, Debug)]
pub(super) struct PathPoint {
    /// Highest v² by the feed and the velocities of the axes.
    pub square_max: f64,
    /// Per axis q', q'' over A and q', q'', q''' over J; only axes that count.
    pub accelerations: Vec<[f64; 2]>,
    pub jerks: Vec<[f64; 3]>,
}

/// A motion's intervals and what holds between them.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub intervals: Vec<Interval>,
    /// Highest v² at every place between two intervals and at both ends.
    pub square_max: Vec<f64>,
    /// Way from the rest at the start to the first interval, and from the last one to the rest at the end.
    pub rests: [RestWay; 2],
}

/// The way next to a rest, on which b = c s^exponent.
#[derive(Clone, Copy, Debug)]
pub(super) struct RestWay {
    pub length_lu: f64,
    /// 4/3 with constant jerk, 1 with constant acceleration.
    pub exponent_ratio: f64,
    /// Highest b at its end.
    pub square_max: f64,
}

impl RestWay {
    /// Time on the way if b is `square` at its end: ∫ ds/√(c s^e) = 2 / (2 - e) · s/√b.
    pub(super) fn time_s(&self, square: f64) -> f64 {
        self.weight() / square.sqrt()
    }

    pub(super) fn weight(&self) -> f64 {
        2.0 / (2.0 - self.exponent_ratio) * self.length_lu
    }
}

impl PathPoint {
    pub(super) fn new(state: &JointState, rules: &PieceRules) -> Self {
        let mut square_max = rules.feed_lu_s.map_or(f64::INFINITY, |feed_lu_s| feed_lu_s * feed_lu_s);
        let (mut accelerations, mut jerks) = (Vec::new(), Vec::new());
        let mut steepest: [Option<[f64; 3]>; 2] = [None; 2];
        for (axis, caps) in AxisId::first(rules.axes.len()).zip(&rules.axes) {
            let [d1, d2, d3] = [state.first[axis], state.second[axis], state.third[axis]];
            if d1.abs() > STILL_RATIO {
                square_max = square_max.min((caps.velocity_max_lu_s / d1).powi(2));
            }
            let (a, j) = (caps.acceleration_max_lu_s2, caps.jerk_max_lu_s3);
            if d2 == 0.0 && d3 == 0.0 {
                // Of the axes that go straight only the weakest counts.
                for (steepest, demand) in steepest.iter_mut().zip([d1 / a, d1 / j]) {
                    let most = steepest.map_or(STILL_RATIO / a, |[most, ..]| most.abs());
                    if demand.abs() > most {
                        *steepest = Some([demand, 0.0, 0.0]);
                    }
                }
                continue;
            }
            accelerations.push([d1 / a, d2 / a]);
            jerks.push([d1 / j, d2 / j, d3 / j]);
        }
        accelerations.extend(steepest[0].map(|[d1, d2, _]| [d1, d2]));
        jerks.extend(steepest[1]);
        if !rules.jerk_limited {
            jerks.clear();
        }
        Self { square_max, accelerations, jerks }
    }

    /// The same with less of the limits.
    fn within(mut self, share: Share) -> Self {
        self.square_max *= share.square_ratio;
        self.accelerations.as_flattened_mut().iter_mut().for_each(|demand| *demand /= share.acceleration_ratio);
        self.jerks.as_flattened_mut().iter_mut().for_each(|demand| *demand /= share.jerk_ratio);
        self
    }

    /// Largest share of an acceleration limit that is used.
    pub(super) fn acceleration_ratio(&self, square: f64, slope: f64) -> f64 {
        self.accelerations.iter().map(|[d1, d2]| (d2 * square + d1 * slope / 2.0).abs()).fold(0.0, f64::max)
    }

    /// Largest share of a jerk limit that is used.
    pub(super) fn jerk_ratio(&self, square: f64, slope: f64, bend: f64) -> f64 {
        let of = |[d1, d2, d3]: &[f64; 3]| (d3 * square + 1.5 * d2 * slope + 0.5 * d1 * bend).abs();
        square.max(0.0).sqrt() * self.jerks.iter().map(of).fold(0.0, f64::max)
    }
}

impl Grid {
    /// The first grid of a motion.
    pub(super) fn new(pieces: &[Piece]) -> Self {
        let whole_lu: f64 = pieces.iter().map(|piece| piece.length_lu).sum();
        let rests = [rest_way(pieces, whole_lu, true), rest_way(pieces, whole_lu, false)];
        let end_lu = whole_lu - rests[1].length_lu;
        let slow = slow_places(pieces, whole_lu, &rests);
        let mut intervals = Vec::new();
        let mut start_lu = 0.0;
        let mut passed = 0;
        for (index, piece) in pieces.iter().enumerate() {
            let own_end_lu = piece.length_lu.min(end_lu - start_lu);
            for range in borders(piece).windows(2) {
                let (mut at_lu, to_lu) = (range[0].max(rests[0].length_lu - start_lu), range[1].min(own_end_lu));
                // What rounding leaves between two borders is no interval.
                let least_lu = 1e-9 * piece.length_lu;
                while to_lu - at_lu > least_lu {
                    let place_lu = start_lu + at_lu;
                    while slow.get(passed + 1).is_some_and(|next| next.place_lu <= place_lu * (1.0 + 1e-12)) {
                        passed += 1;
                    }
                    let left_lu = to_lu - at_lu;
                    let step_lu = step_lu(&slow, passed, place_lu).max(1e-6 * left_lu);
                    let length_lu = match (left_lu / step_lu).ceil() {
                        steps if steps <= 1.0 => left_lu,
                        _ => step_lu.min(left_lu / 2.0),
                    };
                    intervals.push(Interval::new(pieces, index, [at_lu, start_lu, length_lu], Share::WHOLE));
                    at_lu = if length_lu == left_lu { to_lu } else { at_lu + length_lu };
                }
            }
            start_lu += piece.length_lu;
        }
        Self::joined(pieces, intervals, rests)
    }

    fn joined(pieces: &[Piece], intervals: Vec<Interval>, rests: [RestWay; 2]) -> Self {
        let mut square_max = vec![f64::INFINITY; intervals.len() + 1];
        let mut piece = None;
        for (i, interval) in intervals.iter().enumerate() {
            let (start, end) = (&interval.points[0], &interval.points[2]);
            if piece.is_some_and(|before| before != interval.piece) {
                // Pieces too short for an interval have junctions too.
                let between = pieces.get(piece.unwrap_or(0) + 1..=interval.piece).unwrap_or(&[]);
                for passed in between {
                    square_max[i] = square_max[i].min(passed.rules.junction_lu_s.powi(2));
                }
            }
            piece = Some(interval.piece);
            square_max[i] = square_max[i].min(start.square_max);
            square_max[i + 1] = square_max[i + 1].min(end.square_max);
        }
        if let (Some(first), Some(last)) = (square_max.first_mut(), rests.first()) {
            *first = first.min(last.square_max);
        }
        if let Some(last) = square_max.last_mut() {
            *last = last.min(rests[1].square_max);
        }
        Self { intervals, square_max, rests }
    }

    /// The same with some intervals cut in two.
    pub(super) fn refined(&self, pieces: &[Piece], cut: &[bool]) -> Self {
        let mut intervals = Vec::with_capacity(2 * self.intervals.len());
        for (interval, cut) in self.intervals.iter().zip(cut) {
            if !*cut {
                intervals.push(interval.clone());
                continue;
            }
            let half_lu = interval.length_lu / 2.0;
            let start_lu = interval.place_lu - interval.from_lu;
            for from_lu in [interval.from_lu, interval.from_lu + half_lu] {
                intervals.push(Interval::new(pieces, interval.piece, [from_lu, start_lu, half_lu], interval.share));
            }
        }
        Self::joined(pieces, intervals, self.rests)
    }

    /// The same, with less of the limits where a motion uses more than there is; `None` where it uses no more than `allowed_ratio`.
    pub(super) fn tightened(&self, pieces: &[Piece], used: &[Used], allowed_ratio: f64) -> Option<Self> {
        if used.iter().all(|used| used.largest() <= allowed_ratio) {
            return None;
        }
        let tighter = |(interval, used): (&Interval, &Used)| {
            let Interval { piece, from_lu, place_lu, length_lu, .. } = *interval;
            let share = interval.share.without(used);
            Interval::new(pieces, piece, [from_lu, place_lu - from_lu, length_lu], share)
        };
        Some(Self::joined(pieces, self.intervals.iter().zip(used).map(tighter).collect(), self.rests))
    }
}

impl Interval {
    /// Where it begins in its piece, where the piece begins, and how long it is.
    fn new(pieces: &[Piece], index: usize, [from_lu, start_lu, length_lu]: [f64; 3], share: Share) -> Self {
        let piece = &pieces[index];
        let points = POINTS_RATIO.map(|ratio| piece.point(from_lu + inside(ratio) * length_lu).within(share));
        let square_max_between =
            BETWEEN_RATIO.map(|ratio| share.square_ratio * piece.point(from_lu + ratio * length_lu).square_max);
        Self { piece: index, from_lu, place_lu: start_lu + from_lu, length_lu, points, square_max_between, share }
    }
}

impl Piece {
    pub(super) fn point(&self, s_lu: f64) -> PathPoint {
        PathPoint::new(&self.path.at(s_lu), &self.rules)
    }
}

/// A place where the speed may be low, and the way next to it on which it grows to a multiple.
#[derive(Clone, Copy, Debug)]
struct SlowPlace {
    place_lu: f64,
    way_lu: f64,
}

/// Rests and junctions, in order; the first and the last are the rests.
fn slow_places(pieces: &[Piece], whole_lu: f64, rests: &[RestWay; 2]) -> Vec<SlowPlace> {
    let mut slow = vec![SlowPlace { place_lu: 0.0, way_lu: rests[0].length_lu }];
    let mut start_lu = 0.0;
    for pair in pieces.windows(2) {
        start_lu += pair[0].length_lu;
        let v = pair[1].rules.junction_lu_s;
        let sharpest = |point: PathPoint| {
            let jerk = point.jerks.iter().map(|[d1, ..]| d1.abs()).fold(0.0, f64::max);
            let acceleration = point.accelerations.iter().map(|[d1, _]| d1.abs()).fold(0.0, f64::max);
            // From v the speed doubles after v √(2 v / j), or 3/2 v² / a.
            if pair[1].rules.jerk_limited { v * (2.0 * v * jerk).sqrt() } else { 1.5 * v * v * acceleration }
        };
        let way_lu = sharpest(pair[1].point(0.0)).min(sharpest(pair[0].point(pair[0].length_lu)));
        if way_lu > 0.0 && way_lu.is_finite() {
            slow.push(SlowPlace { place_lu: start_lu, way_lu });
        }
    }
    slow.push(SlowPlace { place_lu: whole_lu, way_lu: rests[1].length_lu });
    slow
}

/// Length of an interval that begins at a place, the last slow place passed being `passed`.
fn step_lu(slow: &[SlowPlace], passed: usize, place_lu: f64) -> f64 {
    let behind =
        slow.get(passed).map_or(f64::INFINITY, |slow| NEAR_RATIO * (place_lu - slow.place_lu).max(slow.way_lu));
    let ahead = slow.get(passed + 1).map_or(f64::INFINITY, |slow| {
        let distance_lu = slow.place_lu - place_lu;
        (NEAR_RATIO / (1.0 + NEAR_RATIO) * distance_lu).max(NEAR_RATIO * slow.way_lu)
    });
    behind.min(ahead)
}

/// Borders of the first intervals of a piece, ends included.
fn borders(piece: &Piece) -> Vec<f64> {
    let even = |count: usize| (0..=count).map(|i| piece.length_lu * i as f64 / count as f64).collect();
    match piece.path.contour.curve() {
        Some(Curve::Arc(arc)) => {
            let turn_rad = (arc.angle_end_rad() - arc.angle_start_rad()).abs();
            even(((turn_rad / ARC_STEP_RAD).ceil() as usize).clamp(PIECE_INTERVALS, 1000))
        }
        Some(Curve::SpatialArc(arc)) => {
            let [from, to] = arc.angles_rad();
            even((((to - from).abs() / ARC_STEP_RAD).ceil() as usize).clamp(PIECE_INTERVALS, 1000))
        }
        Some(Curve::Polynomial(curve)) => {
            let nodes: Vec<f64> = [0.0].into_iter().chain(curve.nodes_lu()).chain([piece.length_lu]).collect();
            let panels = nodes.len() - 1;
            let steps = PANEL_INTERVALS.max(PIECE_INTERVALS.div_ceil(panels));
            let inside = nodes.windows(2).flat_map(|panel| {
                let (from, to) = (panel[0], panel[1]);
                (0..steps).map(move |i| from + (to - from) * i as f64 / steps as f64)
            });
            inside.chain([piece.length_lu]).collect()
        }
        _ => even(PIECE_INTERVALS),
    }
}

/// The way of the first jerk at the start or the end of a motion.
fn rest_way(pieces: &[Piece], whole_lu: f64, at_start: bool) -> RestWay {
    let piece = if at_start { pieces.first() } else { pieces.last() };
    let still = RestWay { length_lu: REST_SHARE * whole_lu, exponent_ratio: 1.0, square_max: f64::INFINITY };
    let Some(piece) = piece else { return still };
    let near = |distance_lu: f64| piece.point(if at_start { distance_lu } else { piece.length_lu - distance_lu });
    let weakest = |demands: &mut dyn Iterator<Item = f64>| demands.map(f64::abs).fold(0.0, f64::max);
    let at_rest = near(0.0);
    let a = 1.0 / weakest(&mut at_rest.accelerations.iter().map(|demand| demand[0]));
    let j = 1.0 / weakest(&mut at_rest.jerks.iter().map(|demand| demand[0]));
    let jerk_limited = piece.rules.jerk_limited;
    // The way on which the acceleration grows to its limit, and that on which the speed grows to its own.
    let (growth_lu, speeding_lu) = if jerk_limited {
        (a.powi(3) / (6.0 * j * j), (4.0 / 9.0 * at_rest.square_max.powf(1.5) / j).sqrt())
    } else {
        (f64::INFINITY, at_rest.square_max / (2.0 * a))
    };
    let scale_lu = whole_lu.min(piece.length_lu).min(growth_lu).min(speeding_lu);
    let mut length_lu = REST_SHARE * scale_lu;
    if !(length_lu > 0.0 && length_lu.is_finite()) {
        length_lu = REST_SHARE * whole_lu;
    }
    // b = c s^(4/3) with c = (9 j / 2)^(2/3), or 2 a s; less where the path bends so much that this is too fast.
    let exponent_ratio = if jerk_limited { 4.0 / 3.0 } else { 1.0 };
    let mut c = if jerk_limited { (4.5 * j).powf(2.0 / 3.0) } else { 2.0 * a };
    for _ in 0..40 {
        let fits = [0.25, 0.5, 0.75, 1.0].into_iter().all(|share| {
            let s = share * length_lu;
            let (square, slope) = (c * s.powf(exponent_ratio), c * exponent_ratio * s.powf(exponent_ratio - 1.0));
            let bend = c * exponent_ratio * (exponent_ratio - 1.0) * s.powf(exponent_ratio - 2.0);
            let point = near(s);
            // Towards the rest the slope is negative: the same as backwards on the mirrored path.
            let slope = if at_start { slope } else { -slope };
            point.acceleration_ratio(square, slope) <= 1.0 + 1e-9 && point.jerk_ratio(square, slope, bend) <= 1.0 + 1e-6
        });
        if fits {
            break;
        }
        c *= 0.98;
    }
    RestWay { length_lu, exponent_ratio, square_max: c * length_lu.powf(exponent_ratio) }
}
