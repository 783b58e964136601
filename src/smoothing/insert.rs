//! RND, RNDM, CHF and CHR: an arc or a chamfer between two blocks.
//!
//! In: the block that leads to a corner, the block that leads away, what is to be put between them. Out: both blocks cut, and the
//! curve between them ([`Inserted`]), or why there is none ([`Omitted`]).
//!
//! Everything happens in the projection on the plane (models/arcs.md section 3, with the radius given): the fillet turns to the
//! side of the corner, `s_f`; its centre is `R` beside a straight block and `|O_c - O| = r - s s_f R` from the centre of an arc;
//! among such places the one nearest to the corner counts. It touches a straight block in the foot of the perpendicular, an arc on
//! the line through both centres. All other axes go linearly from one touching point to the other. A chamfer cuts the same way off
//! both blocks: CHR along the blocks, CHF so that the chamfer is that long.
//!
//! A block that is too short makes the fillet or chamfer smaller, as far as it fits. A block with a corner of its own at its end
//! leaves half of itself to it: the control does not document its rule.
//!
//! Does not choose the feed, and does not round the corners of a chamfer: those are corners like any other.

use super::smoother::Held;
use crate::base::Portable;
use crate::base::{AxisId, AxisVector, PartPoint, PerAxis};
use crate::geometry::{Arc, Curve, DISPLACEMENT_MIN_LU, Line, SpatialArc};
use crate::interpreter::{ArcGeometry, CornerInsert, CornerShape, SpatialArcGeometry};
use std::f64::consts::TAU;

/// Turning angles below this, and those that near a reversal, are no corners.
const ANGLE_MIN_RAD: f64 = 1e-3;

/// Rounds of bisection for the largest radius that fits, and for the length of a chamfer on arcs.
const BISECTIONS: usize = 60;

/// Directions whose share in the plane differs from 1 by more are not parallel to it.
const PARALLEL_RATIO: f64 = 1e-9;

/// Share of the plane in the direction of a block below which it does not move in the plane.
const PLANE_MIN_RATIO: f64 = 1e-9;

/// What stands between two blocks.
pub(super) struct Inserted {
    /// Fillet or chamfer.
    pub curve: Curve,
    /// Taken from the end of the first block.
    pub tail_lu: f64,
    /// Taken from the start of the second block.
    pub head_lu: f64,
    /// Smaller than programmed.
    pub reduced: bool,
}

/// Why nothing stands there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Omitted {
    /// The blocks go on tangentially: there is no corner.
    NoCorner,
    /// A block does not move in the plane, or is no line and no circle of the plane, or the path turns back.
    Shape,
    /// No radius fits.
    TooShort,
}

type Point = [f64; 2];

/// A block in the projection on the plane, seen from the corner.
struct Side<'a> {
    curve: &'a Curve,
    /// Direction of motion in the corner, unit length.
    tangent: Point,
    kind: Kind,
    /// Length of the block that may be taken.
    free_lu: f64,
    /// Ends in the corner.
    leads_to: bool,
}

enum Kind {
    /// d(projected length)/ds.
    Straight {
        plane_ratio: f64,
    },
    Circle {
        centre_mm: Point,
        radius_mm: f64,
        sense: f64,
        turn_rate_per_mm: f64,
    },
}

/// The fillet or chamfer between `before` and `after`; `corner_follows`: the second block has one at its end, too.
pub(super) fn inserted(
    before: &Held,
    after: &Held,
    insert: &CornerInsert,
    corner_follows: bool,
    linear: &PerAxis<bool>,
) -> Result<Inserted, Omitted> {
    let share = if corner_follows { 0.5 } else { 1.0 };
    // An axis that POSA has sent elsewhere is on its way.
    if before.curve.end() != after.curve.start() {
        return Err(Omitted::Shape);
    }
    // A thread stays whole.
    if before.head.modes.thread.is_some() || after.head.modes.thread.is_some() {
        return Err(Omitted::Shape);
    }
    let plane = Basis::new(insert);
    let corner = plane.projected(&before.curve.end().0);
    let first = Side::new(&before.curve, &plane, before.curve.length_lu() - before.head_lu, true)?;
    let second = Side::new(&after.curve, &plane, share * after.curve.length_lu(), false)?;
    let (u, v) = (first.tangent, second.tangent);
    let turn_rad = cross(u, v).portable_atan2(dot(u, v));
    if turn_rad.abs() < ANGLE_MIN_RAD {
        return Err(Omitted::NoCorner);
    }
    if turn_rad.abs() > std::f64::consts::PI - ANGLE_MIN_RAD {
        return Err(Omitted::Shape);
    }
    let sides = Sides { first, second, corner, sense: turn_rad.signum(), turn_rad, plane };
    match insert.shape {
        CornerShape::Fillet { radius_mm } => sides.fillet(radius_mm, linear),
        CornerShape::ChamferLeg { length_mm } => sides.chamfer(length_mm, false, linear),
        CornerShape::ChamferBase { length_mm } => sides.chamfer(length_mm, true, linear),
    }
}

/// The plane: of two axes, or tilted.
struct Basis {
    axes: [AxisId; 2],
    tilted: bool,
    directions: [AxisVector; 2],
}

impl Basis {
    fn new(insert: &CornerInsert) -> Self {
        let along = |axis: AxisId| PerAxis::from_fn(|other| f64::from(u8::from(other == axis)));
        let directions = insert.directions.unwrap_or(insert.plane.map(along));
        Self { axes: insert.plane, tilted: insert.directions.is_some(), directions }
    }

    fn projected(&self, vector: &AxisVector) -> Point {
        self.directions.map(|direction| direction.dot(vector))
    }

    /// A circle, if it lies in the plane or parallel to it.
    fn circle(&self, curve: &Curve) -> Option<Kind> {
        match curve {
            Curve::Arc(arc) if !self.tilted && arc.plane() == self.axes => Some(Kind::Circle {
                centre_mm: arc.centre_mm(),
                radius_mm: arc.radius_mm(),
                sense: arc.sweep_rad().signum(),
                turn_rate_per_mm: arc.turn_rate_per_mm().abs(),
            }),
            Curve::SpatialArc(arc) => {
                let own = arc.directions();
                let [first, second] = own.map(|direction| self.projected(&direction));
                let outside = |flat: Point| (dot(flat, flat) - 1.0).abs() > PARALLEL_RATIO;
                if outside(first) || outside(second) {
                    return None;
                }
                let (sin, cos) = arc.angles_rad()[0].portable_sin_cos();
                let radius_mm = arc.radius_mm();
                let centre = arc.start().0 - (own[0] * cos + own[1] * sin) * radius_mm;
                Some(Kind::Circle {
                    centre_mm: self.projected(&centre),
                    radius_mm,
                    sense: (cross(first, second) * arc.turn_rate_per_mm()).signum(),
                    turn_rate_per_mm: arc.turn_rate_per_mm().abs(),
                })
            }
            _ => None,
        }
    }

    /// The fillet as a curve.
    fn arc(
        &self,
        [start, end]: [PartPoint; 2],
        centre_mm: Point,
        radius_mm: f64,
        sweep_rad: f64,
        linear: &PerAxis<bool>,
    ) -> Curve {
        if !self.tilted {
            let geometry = ArcGeometry { plane: self.axes, centre_mm, radius_mm, sweep_rad };
            return Curve::from(Arc::new(start, end, &geometry, linear));
        }
        let centre_mm = self.directions[0] * centre_mm[0] + self.directions[1] * centre_mm[1];
        let geometry = SpatialArcGeometry { directions: self.directions, centre_mm, radius_mm, sweep_rad };
        Curve::from(SpatialArc::new(start, end, &geometry, linear))
    }
}

impl<'a> Side<'a> {
    fn new(curve: &'a Curve, plane: &Basis, free_lu: f64, leads_to: bool) -> Result<Self, Omitted> {
        let state = curve.at(if leads_to { f64::INFINITY } else { 0.0 });
        let projected = plane.projected(&state.first);
        let plane_ratio = projected[0].portable_hypot(projected[1]);
        let moves = plane_ratio > PLANE_MIN_RATIO;
        if curve.rotary_only() || !moves {
            return Err(Omitted::Shape);
        }
        let kind = match curve {
            Curve::Line(_) => Kind::Straight { plane_ratio },
            other => plane.circle(other).ok_or(Omitted::Shape)?,
        };
        Ok(Self { curve, tangent: projected.map(|component| component / plane_ratio), kind, free_lu, leads_to })
    }

    /// Length of the block from the corner to the point where a circle about `centre_mm` touches it.
    fn taken_lu(&self, corner: Point, centre_mm: Point) -> f64 {
        let away = if self.leads_to { -1.0 } else { 1.0 };
        match &self.kind {
            Kind::Straight { plane_ratio } => away * dot(minus(centre_mm, corner), self.tangent) / plane_ratio,
            Kind::Circle { centre_mm: own, sense, turn_rate_per_mm, .. } => {
                let angle = |point: Point| (point[1] - own[1]).portable_atan2(point[0] - own[0]);
                let turned_rad = away * sense * (angle(centre_mm) - angle(corner));
                turned_rad.rem_euclid(TAU) / turn_rate_per_mm
            }
        }
    }

    /// The place on the block that far from the corner.
    fn place_lu(&self, taken_lu: f64) -> f64 {
        if self.leads_to { self.curve.length_lu() - taken_lu } else { taken_lu }
    }

    /// Where the centre of a fillet may be: beside the line, or on a circle.
    fn locus(&self, corner: Point, side: f64, radius_mm: f64) -> Option<Locus> {
        match &self.kind {
            Kind::Straight { .. } => {
                let [x, y] = self.tangent;
                Some(Locus::Line {
                    point: [corner[0] - side * radius_mm * y, corner[1] + side * radius_mm * x],
                    direction: self.tangent,
                })
            }
            Kind::Circle { centre_mm, radius_mm: own_mm, sense, .. } => {
                let distance_mm = own_mm - sense * side * radius_mm;
                (distance_mm > 0.0).then_some(Locus::Circle { centre_mm: *centre_mm, radius_mm: distance_mm })
            }
        }
    }
}

enum Locus {
    Line { point: Point, direction: Point },
    Circle { centre_mm: Point, radius_mm: f64 },
}

struct Sides<'a> {
    first: Side<'a>,
    second: Side<'a>,
    corner: Point,
    /// Of the fillet: 1 turns from the first axis of the plane to the second.
    sense: f64,
    turn_rad: f64,
    plane: Basis,
}

impl Sides<'_> {
    fn fillet(&self, radius_mm: f64, linear: &PerAxis<bool>) -> Result<Inserted, Omitted> {
        let programmed = self.fillet_of(radius_mm);
        let reduced = programmed.is_none();
        let (radius_mm, found) = match programmed {
            Some(found) => (radius_mm, found),
            None => self.largest_fillet(radius_mm).ok_or(Omitted::TooShort)?,
        };
        let (centre_mm, [tail_lu, head_lu]) = found;
        let start = self.first.curve.trimmed(0.0, self.first.place_lu(tail_lu)).end();
        let end = self.second.curve.trimmed(self.second.place_lu(head_lu), f64::INFINITY).start();
        let angle = |point: &PartPoint| {
            let [x, y] = minus(self.plane.projected(&point.0), centre_mm);
            y.portable_atan2(x)
        };
        let sweep_rad = self.sense * (self.sense * (angle(&end) - angle(&start))).rem_euclid(TAU);
        let curve = self.plane.arc([start, end], centre_mm, radius_mm, sweep_rad, linear);
        self.checked(curve, [tail_lu, head_lu], reduced)
    }

    /// Centre and what is taken of both blocks, if a fillet of this radius fits.
    fn fillet_of(&self, radius_mm: f64) -> Option<(Point, [f64; 2])> {
        let first = self.first.locus(self.corner, self.sense, radius_mm)?;
        let second = self.second.locus(self.corner, self.sense, radius_mm)?;
        let centre_mm = nearest_crossing(&first, &second, self.corner)?;
        let taken = [&self.first, &self.second].map(|side| side.taken_lu(self.corner, centre_mm));
        let fits =
            taken[0] > 0.0 && taken[0] <= self.first.free_lu && taken[1] > 0.0 && taken[1] <= self.second.free_lu;
        fits.then_some((centre_mm, taken))
    }

    fn largest_fillet(&self, radius_mm: f64) -> Option<(f64, (Point, [f64; 2]))> {
        let (mut low, mut high) = (0.0, radius_mm);
        let mut found = None;
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            match self.fillet_of(middle) {
                Some(fillet) => {
                    found = Some((middle, fillet));
                    low = middle;
                }
                None => high = middle,
            }
        }
        found
    }

    fn chamfer(&self, length_mm: f64, base: bool, linear: &PerAxis<bool>) -> Result<Inserted, Omitted> {
        let free_lu = self.first.free_lu.min(self.second.free_lu);
        let line = |taken_lu: f64| {
            let start = self.first.curve.trimmed(0.0, self.first.place_lu(taken_lu)).end();
            let end = self.second.curve.trimmed(self.second.place_lu(taken_lu), f64::INFINITY).start();
            Line::new(start, end, linear)
        };
        let straight = matches!((&self.first.kind, &self.second.kind), (Kind::Straight { .. }, Kind::Straight { .. }));
        let wanted_lu = match (base, straight) {
            (false, _) => length_mm,
            (true, true) => 0.5 * length_mm / (0.5 * self.turn_rad).portable_cos(),
            (true, false) => {
                let (mut low, mut high) = (0.0, free_lu);
                for _ in 0..BISECTIONS {
                    let middle = 0.5 * (low + high);
                    if line(middle).length_lu() < length_mm { low = middle } else { high = middle }
                }
                if line(free_lu).length_lu() < length_mm { f64::INFINITY } else { high }
            }
        };
        let taken_lu = wanted_lu.min(free_lu);
        self.checked(Curve::Line(line(taken_lu)), [taken_lu; 2], wanted_lu > free_lu)
    }

    fn checked(&self, curve: Curve, [tail_lu, head_lu]: [f64; 2], reduced: bool) -> Result<Inserted, Omitted> {
        if curve.length_lu() >= DISPLACEMENT_MIN_LU {
            return Ok(Inserted { curve, tail_lu, head_lu, reduced });
        }
        Err(Omitted::TooShort)
    }
}

/// Where two loci cross, nearest to a point.
fn nearest_crossing(first: &Locus, second: &Locus, near: Point) -> Option<Point> {
    let candidates = match (first, second) {
        (Locus::Line { point: p, direction: d }, Locus::Line { point: q, direction: e }) => {
            let t = cross(minus(*q, *p), *e) / cross(*d, *e);
            let crossing = [p[0] + t * d[0], p[1] + t * d[1]];
            [crossing, crossing]
        }
        (Locus::Line { point, direction }, Locus::Circle { centre_mm, radius_mm })
        | (Locus::Circle { centre_mm, radius_mm }, Locus::Line { point, direction }) => {
            let to_centre = minus(*centre_mm, *point);
            let (along, across) = (dot(to_centre, *direction), cross(*direction, to_centre));
            let half = (radius_mm * radius_mm - across * across).sqrt();
            [along - half, along + half].map(|t| [point[0] + t * direction[0], point[1] + t * direction[1]])
        }
        (Locus::Circle { centre_mm: a, radius_mm: r }, Locus::Circle { centre_mm: b, radius_mm: q }) => {
            let apart = minus(*b, *a);
            let distance = dot(apart, apart).sqrt();
            let along = (distance * distance + r * r - q * q) / (2.0 * distance);
            let across = (r * r - along * along).sqrt();
            let [x, y] = apart.map(|component| component / distance);
            [across, -across].map(|h| [a[0] + along * x - h * y, a[1] + along * y + h * x])
        }
    };
    let distance = |point: &Point| dot(minus(*point, near), minus(*point, near));
    let finite = candidates.into_iter().filter(|point| point.iter().all(|component| component.is_finite()));
    finite.min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
