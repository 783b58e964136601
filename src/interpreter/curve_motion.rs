//! CIP, CT, POLY, AR and polar coordinates: from words to a move.
//!
//! In: the words of a block, the frames, the move before. Out: words with Cartesian ends ([`Interpreter::resolved`]), or the kind of the
//! move. Circles are calculated in the workpiece system and placed by the frames.
//!
//! * AP counts from the first axis of the plane, absolute but for AP=IC(), which adds to the last AP; RP is modal. Without a G110 to G112
//!   the pole is the zero of the workpiece. G2 and G3 with AP or RP and without centre or radius turn about the pole.
//! * AR with an end point gives the radius, AR with a centre gives the end.
//! * CIP with an intermediate point on the straight line, and CT whose end lies straight ahead: the first is an alarm, the second a line.

use super::arc::RADIUS_TOLERANCE_MM;
use super::curve_state::CurveWords;
use super::modal::Motion;
use super::motion::{AxisWord, MotionWords, bounded};
use super::run::Interpreter;
use super::spline::polynomial;
use super::wire::{ArcGeometry, MoveKind, PolynomialGeometry, PolynomialPiece, SpatialArcGeometry};
use crate::base::Portable;
use crate::base::units::rad_from_deg;
use crate::base::{AxisId, AxisKind, AxisVector, PerAxis};
use crate::program::syntax::{Form, Typed};
use crate::program::words::CurveWord;
use crate::program::{Columns, Fault, Outcome, codes};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Points nearer than this are one.
const SAME_POINT_MM: f64 = 1e-6;

/// A normal that leaves an axis by less follows it; scales that differ by less are equal.
const SAME_RATIO: f64 = 1e-9;

impl Interpreter {
    /// The words with polar coordinates and AR turned into positions and radii; `None`: nothing to turn.
    pub(super) fn resolved(&mut self, words: &MotionWords) -> Outcome<Option<MotionWords>> {
        let Some(curve) = &words.curve else { return Ok(None) };
        self.check_curve_words(curve)?;
        let mut resolved = words.clone();
        let polar = curve.polar_angle.is_some() || curve.polar_radius.is_some();
        if polar {
            self.resolve_polar(curve, &mut resolved)?;
        }
        if let Some((angle, columns)) = &curve.opening_angle {
            self.resolve_opening(rad_from_deg(angle.0), columns, &mut resolved)?;
        } else if polar && self.turns() && !resolved.has_circle_words() {
            let (indices, plane) = self.plane(&curve.columns)?;
            for (index, axis) in indices.into_iter().zip(plane) {
                resolved.centre[index] = Some(self.at_mm(self.curves.pole_lu[axis], &curve.columns));
            }
        }
        Ok(Some(resolved))
    }

    fn turns(&self) -> bool {
        matches!(self.modal.motion, Motion::Clockwise | Motion::CounterClockwise)
    }

    fn check_curve_words(&self, curve: &CurveWords) -> Outcome<()> {
        let motion = self.modal.motion;
        let wrong = |what: &str, wanted: &str| {
            Err(Fault::new(codes::BAD_BLOCK, curve.columns.clone(), format!("{what} without {wanted}"))
                .label(format!("only for {wanted}")))
        };
        if curve.intermediate.iter().any(Option::is_some) && motion != Motion::Curve(CurveWord::ThreePoints) {
            return wrong("I1, J1 or K1", "CIP");
        }
        let polynomials = curve.denominator.is_some() || curve.polynomials.as_slice().iter().any(Option::is_some);
        if polynomials && motion != Motion::Curve(CurveWord::Polynomial) {
            return wrong("PO", "POLY");
        }
        if curve.opening_angle.is_some() && !self.turns() {
            return wrong("AR", "G2 or G3");
        }
        Ok(())
    }

    /// An absolute position of the workpiece system as a word.
    fn at_mm(&self, position_mm: f64, columns: &Columns) -> AxisWord {
        let typed = Typed(position_mm / self.modal.position_lu(AxisKind::Linear, Typed(1.0)));
        AxisWord { typed, form: Form::Absolute, columns: columns.clone() }
    }

    fn resolve_polar(&mut self, curve: &CurveWords, resolved: &mut MotionWords) -> Outcome<()> {
        let columns = &curve.columns;
        let (_, plane) = self.plane(columns)?;
        if plane.iter().any(|axis| resolved.axes[*axis].is_some()) {
            return Err(Fault::new(codes::BAD_BLOCK, columns.clone(), "polar and Cartesian coordinates in one plane")
                .label("expected one of the two"));
        }
        let here_lu = self.work_position_lu(resolved.suppression);
        let pole_lu = self.curves.pole_lu;
        let from_pole = plane.map(|axis| here_lu[axis] - pole_lu[axis]);
        let distance_mm = from_pole[0].portable_hypot(from_pole[1]);
        let radius_mm = match &curve.polar_radius {
            Some(word) => {
                let typed_mm = self.modal.position_lu(AxisKind::Linear, word.typed);
                let base_mm = if word.form == Form::Incremental {
                    self.curves.polar_radius_mm.unwrap_or(distance_mm)
                } else {
                    0.0
                };
                bounded(base_mm + typed_mm, &word.columns)?
            }
            None => self.curves.polar_radius_mm.unwrap_or(distance_mm),
        };
        if radius_mm < 0.0 {
            return Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), format!("a polar radius of {radius_mm}"))
                .label("expected 0 or more"));
        }
        let angle_rad = match &curve.polar_angle {
            Some(word) if word.form == Form::Incremental => self.curves.polar_angle_rad + rad_from_deg(word.typed.0),
            Some(word) => rad_from_deg(word.typed.0),
            None => from_pole[1].portable_atan2(from_pole[0]),
        };
        self.curves.polar_radius_mm = Some(radius_mm);
        self.curves.polar_angle_rad = angle_rad;
        let (sin, cos) = angle_rad.portable_sin_cos();
        for (axis, ratio) in plane.into_iter().zip([cos, sin]) {
            resolved.axes[axis] = Some(self.at_mm(pole_lu[axis] + radius_mm * ratio, columns));
        }
        Ok(())
    }

    /// AR: with an end the radius follows, with a centre the end.
    fn resolve_opening(&mut self, angle_rad: f64, columns: &Columns, resolved: &mut MotionWords) -> Outcome<()> {
        let (indices, plane) = self.plane(columns)?;
        let start_lu = self.work_position_lu(resolved.suppression);
        let start_mm = plane.map(|axis| start_lu[axis]);
        let has_end = plane.iter().any(|axis| resolved.axes[*axis].is_some());
        let has_centre = indices.iter().any(|index| resolved.centre[*index].is_some());
        if resolved.radius.is_some() || has_end == has_centre {
            return Err(Fault::new(codes::BAD_BLOCK, columns.clone(), "AR needs the end of the arc or its centre")
                .label("expected one of the two, and no CR"));
        }
        let turn = if self.modal.motion == Motion::CounterClockwise { 1.0 } else { -1.0 };
        if has_centre {
            let mut centre_mm = start_mm;
            for k in 0..2 {
                if let Some(word) = &resolved.centre[indices[k]] {
                    centre_mm[k] = self.centre_mm(word, start_mm[k]);
                }
            }
            let [x, y] = [start_mm[0] - centre_mm[0], start_mm[1] - centre_mm[1]];
            let (sin, cos) = (turn * angle_rad).portable_sin_cos();
            let end_mm = [centre_mm[0] + x * cos - y * sin, centre_mm[1] + x * sin + y * cos];
            for (axis, end_mm) in plane.into_iter().zip(end_mm) {
                resolved.axes[axis] = Some(self.at_mm(end_mm, columns));
            }
            return Ok(());
        }
        let mut way_mm = [0.0; 2];
        for k in 0..2 {
            if let Some(word) = &resolved.axes[plane[k]] {
                way_mm[k] = self.axis_target_lu(plane[k], word, resolved.suppression)? - start_mm[k];
            }
        }
        let half_chord_mm = way_mm[0].portable_hypot(way_mm[1]) / 2.0;
        let sin = (angle_rad / 2.0).portable_sin();
        if !(sin * 1e7 > half_chord_mm && half_chord_mm > SAME_POINT_MM) {
            return Err(Fault::new(codes::BAD_CURVE, columns.clone(), "AR and the end point give no circle")
                .label("expected an angle between 0 and 360, and an end away from the start"));
        }
        let radius_mm = half_chord_mm / sin;
        // A negative radius is the long way round.
        let signed_mm = if angle_rad > TAU / 2.0 { -radius_mm } else { radius_mm };
        let typed = Typed(signed_mm / self.modal.position_lu(AxisKind::Linear, Typed(1.0)));
        resolved.radius = Some((typed, columns.clone()));
        Ok(())
    }

    /// X, Y, Z of a position; 0 for an axis that the machine does not have.
    fn xyz(&self, position_lu: &AxisVector) -> [f64; 3] {
        self.geometry.map(|axis| axis.map_or(0.0, |axis| position_lu[axis]))
    }

    /// Where the geometry axes go, in the workpiece system.
    fn targets_lu(&self, words: &MotionWords) -> Outcome<AxisVector> {
        let mut target_lu = self.work_position_lu(words.suppression);
        for axis in self.machine.axis_ids() {
            if let Some(word) = &words.axes[axis] {
                target_lu[axis] = bounded(self.axis_target_lu(axis, word, words.suppression)?, &word.columns)?;
            }
        }
        Ok(target_lu)
    }

    /// CIP: the circle through the start, I1 J1 K1 and the end.
    pub(super) fn three_points(&mut self, words: &MotionWords) -> Outcome<MoveKind> {
        let curve = words.curve.as_deref();
        let columns = curve.map_or_else(|| words.columns(), |curve| curve.columns.clone());
        let Some(curve) = curve.filter(|curve| curve.intermediate.iter().any(Option::is_some)) else {
            return Err(Fault::new(codes::BAD_CURVE, columns, "CIP without an intermediate point")
                .label("expected I1, J1 or K1"));
        };
        let start_lu = self.work_position_lu(words.suppression);
        let mut middle_lu = start_lu;
        for (axis, word) in self.geometry.into_iter().zip(&curve.intermediate) {
            let (Some(axis), Some(word)) = (axis, word) else { continue };
            let typed_mm = self.modal.position_lu(AxisKind::Linear, word.typed);
            let incremental = word.form == Form::Incremental || (word.form == Form::Modal && !self.modal.absolute);
            middle_lu[axis] = bounded(if incremental { start_lu[axis] + typed_mm } else { typed_mm }, &word.columns)?;
        }
        let end_lu = self.targets_lu(words)?;
        let [start, middle, end] = [start_lu, middle_lu, end_lu].map(|point| self.xyz(&point));
        let Some(circle) = circle_through(start, middle, end) else {
            return Err(Fault::new(codes::BAD_CURVE, columns, "no circle through these three points")
                .label("they lie on a line, or two of them are one"));
        };
        let turns = TAU * f64::from(words.turns);
        self.placed_circle(&circle, circle.sweep_rad + turns, &start_lu, words, &columns)
    }

    /// A circle of the workpiece system, placed by the frames.
    fn placed_circle(
        &self,
        circle: &Circle,
        sweep_rad: f64,
        start_lu: &AxisVector,
        words: &MotionWords,
        columns: &Columns,
    ) -> Outcome<MoveKind> {
        let total = self.frames_of(words.suppression);
        let vector = |xyz: [f64; 3]| {
            let mut vector = AxisVector::zero();
            for (axis, value) in self.geometry.into_iter().zip(xyz) {
                if let Some(axis) = axis {
                    vector[axis] = value;
                }
            }
            vector
        };
        let [d1, d2] = circle.directions.map(|direction| total.frame.direction_outward(&vector(direction)));
        let (scale, other) = (d1.norm(), d2.norm());
        if (scale - other).abs() > SAME_RATIO * scale || d1.dot(&d2).abs() > SAME_RATIO * scale * other {
            return Err(Fault::new(
                codes::UNEQUAL_SCALE,
                columns.clone(),
                "the frames would make an ellipse of this circle",
            )
            .label("not a circle any more")
            .help("give SCALE the same factor for all axes of the circle"));
        }
        let (d1, d2) = (d1 * (1.0 / scale), d2 * (1.0 / scale));
        let mut centre_in_lu = *start_lu;
        for (axis, value) in self.geometry.into_iter().zip(circle.centre) {
            if let Some(axis) = axis {
                centre_in_lu[axis] = value;
            }
        }
        let outward_lu = total.frame.outward(&centre_in_lu);
        let radius_mm = circle.radius_mm * scale;
        let ids: [Option<AxisId>; 3] = self.geometry;
        if let [Some(x), Some(y), Some(z)] = ids {
            let (a, b) = (self.xyz(&d1), self.xyz(&d2));
            let normal = cross(a, b);
            let planes = [[y, z], [z, x], [x, y]];
            for (plane, along) in planes.into_iter().zip(normal) {
                if along.abs() >= 1.0 - SAME_RATIO {
                    let centre_mm = plane.map(|axis| outward_lu[axis]);
                    let sweep_rad = if along > 0.0 { sweep_rad } else { -sweep_rad };
                    return Ok(MoveKind::Arc(ArcGeometry { plane, centre_mm, radius_mm, sweep_rad }));
                }
            }
        }
        let centre_mm = vector(self.xyz(&outward_lu));
        let spatial = SpatialArcGeometry { directions: [d1, d2], centre_mm, radius_mm, sweep_rad };
        Ok(MoveKind::SpatialArc(Box::new(spatial)))
    }

    /// CT: the circle of the plane that goes on where the block before ended.
    pub(super) fn tangential(&mut self, words: &MotionWords) -> Outcome<MoveKind> {
        self.close_spline(None);
        let columns = words.columns();
        let (_, plane) = self.plane(&columns)?;
        let no_tangent = |columns: Columns| {
            Fault::new(codes::BAD_CURVE, columns, "CT has no direction to go on in")
                .label("expected a motion in the plane before it")
        };
        let Some(direction) = self.direction_behind(&self.position) else { return Err(no_tangent(columns)) };
        // In the workpiece system: the difference of two points of the way.
        let frame = &self.frames_of(words.suppression).frame;
        let ahead = frame.inward(&(self.position.0 + direction)) - frame.inward(&self.position.0);
        let tangent = plane.map(|axis| ahead[axis]);
        let length = tangent[0].portable_hypot(tangent[1]);
        if length < SAME_POINT_MM {
            return Err(no_tangent(columns));
        }
        let tangent = tangent.map(|component| component / length);
        let start_lu = self.work_position_lu(words.suppression);
        let end_lu = self.targets_lu(words)?;
        let way = plane.map(|axis| end_lu[axis] - start_lu[axis]);
        let ahead_mm = way[0] * tangent[0] + way[1] * tangent[1];
        let left_mm = way[1] * tangent[0] - way[0] * tangent[1];
        let chord_mm = way[0].portable_hypot(way[1]);
        let turns = TAU * f64::from(words.turns);
        if chord_mm <= SAME_POINT_MM {
            return Err(Fault::new(codes::BAD_CURVE, columns, "CT needs an end away from the start").label("no circle"));
        }
        if left_mm.abs() <= SAME_RATIO * chord_mm.max(1.0) {
            if ahead_mm > 0.0 {
                return Ok(MoveKind::Line);
            }
            return Err(Fault::new(codes::BAD_CURVE, columns, "the end of CT lies straight behind its start")
                .label("no circle leads there"));
        }
        // Signed to the left; the sweep is twice the angle between tangent and chord.
        let radius_mm = chord_mm * chord_mm / (2.0 * left_mm);
        bounded(radius_mm, &columns)?;
        let sweep_rad = 2.0 * left_mm.portable_atan2(ahead_mm);
        let centre_mm = [start_lu[plane[0]] - radius_mm * tangent[1], start_lu[plane[1]] + radius_mm * tangent[0]];
        let sweep_rad = sweep_rad + sweep_rad.signum() * turns;
        let arc = ArcGeometry { plane, centre_mm, radius_mm: radius_mm.abs(), sweep_rad };
        self.placed_arc(arc, &start_lu, words.suppression, &columns)
    }

    /// POLY.
    pub(super) fn polynomial_block(&mut self, words: &MotionWords) -> Outcome<MoveKind> {
        let columns = words.columns();
        let start_lu = self.work_position_lu(words.suppression);
        let end_lu = self.targets_lu(words)?;
        let curve = words.curve.as_deref();
        let width = curve.and_then(|curve| curve.interval_ratio).unwrap_or(1.0);
        let mut coefficients = PerAxis::splat(None);
        for axis in self.machine.axis_ids() {
            let typed = curve.and_then(|curve| curve.polynomials[axis]);
            let kind = self.machine.axis(axis).kind;
            coefficients[axis] =
                typed.map(|typed| typed.map(|coefficient| self.modal.position_lu(kind, Typed(coefficient))));
        }
        let denominator = curve.and_then(|curve| curve.denominator);
        let linear = self.machine.linear_mask();
        let made =
            if width > 0.0 { polynomial([start_lu, end_lu], &coefficients, denominator, width, &linear) } else { None };
        let Some(geometry) = made else {
            return Err(Fault::new(codes::BAD_CURVE, columns, "this polynomial is no curve")
                .label("its denominator is 0 on the way, or PL is")
                .help("the denominator begins with 1 and must stay above 0 up to PL"));
        };
        Ok(MoveKind::Polynomial(self.placed_polynomial(&geometry, words, &linear)))
    }

    /// N/D of the workpiece system through the frames: (M N + o D) / D.
    fn placed_polynomial(
        &self,
        geometry: &Arc<PolynomialGeometry>,
        words: &MotionWords,
        linear: &PerAxis<bool>,
    ) -> Arc<PolynomialGeometry> {
        let frame = &self.frames_of(words.suppression).frame;
        let offset_lu = frame.outward(&AxisVector::zero());
        let placed = geometry.pieces.iter().map(|piece| {
            let mut numerator_lu = piece.numerator_lu.map(|row| frame.outward(&row) - offset_lu);
            for (power, row) in numerator_lu.iter_mut().enumerate() {
                let d = piece.denominator_ratio[power];
                let constant = if power == 0 { 1.0 } else { 0.0 };
                *row += PerAxis::from_fn(|axis| offset_lu[axis] * if linear[axis] { d } else { constant });
            }
            PolynomialPiece { numerator_lu, ..piece.clone() }
        });
        Arc::new(PolynomialGeometry { pieces: placed.collect() })
    }
}

/// A circle in space: the sweep is positive from the first direction to the second.
struct Circle {
    centre: [f64; 3],
    directions: [[f64; 3]; 2],
    radius_mm: f64,
    sweep_rad: f64,
}

/// From `start` through `middle` to `end`.
fn circle_through(start: [f64; 3], middle: [f64; 3], end: [f64; 3]) -> Option<Circle> {
    let (a, b) = (difference(middle, start), difference(end, start));
    let normal = cross(a, b);
    let (aa, bb, nn) = (dot(a, a), dot(b, b), dot(normal, normal));
    let ab = difference(end, middle);
    let longest = aa.max(bb);
    // The middle less than a hundredth of a micrometre beside the chord, or two points in one.
    let distinct = aa.min(bb).min(dot(ab, ab)) > SAME_POINT_MM * SAME_POINT_MM;
    if !(distinct && nn > SAME_RATIO * SAME_RATIO * longest * longest) {
        return None;
    }
    // Centre from the start: ( |b|² n x a + |a|² b x n ) / (2 |n|²) with n = a x b.
    let to_centre = scaled(sum(scaled(cross(normal, a), bb), scaled(cross(b, normal), aa)), 1.0 / (2.0 * nn));
    let radius_mm = dot(to_centre, to_centre).sqrt();
    let first = scaled(to_centre, -1.0 / radius_mm);
    let unit_normal = scaled(normal, 1.0 / nn.sqrt());
    let second = cross(unit_normal, first);
    let centre = sum(start, to_centre);
    let out = difference(end, centre);
    // The normal is that of the triangle start, middle, end: the sweep is positive and passes the middle.
    let sweep_rad = dot(out, second).portable_atan2(dot(out, first)).rem_euclid(TAU);
    (radius_mm.is_finite() && radius_mm < 1e7 + RADIUS_TOLERANCE_MM).then_some(Circle {
        centre,
        directions: [first, second],
        radius_mm,
        sweep_rad,
    })
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn scaled(a: [f64; 3], factor: f64) -> [f64; 3] {
    a.map(|component| component * factor)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
