//! A circular arc or helix in a plane that no two axes span.
//!
//! In: start, end and the [`SpatialArcGeometry`] of the move. Out: [`SpatialArc`]:
//! `q(s) = origin + slope * s + r (d1 cos + d2 sin)(phi_0 + omega s)`, `omega = sweep / length`. What start and end differ in across
//! the plane (the pitch) counts as path length; all other axes move linearly with the swept angle. As with [`Arc`](super::Arc), what
//! the programmed points miss of the circle is spread linearly.
//!
//! Does not find centres or sweeps: that is the interpreter's.

use super::CurveState;
use super::curve::{length_over, parameter_length};
use crate::base::Portable;
use crate::base::{AxisVector, PartPoint, PerAxis};
use crate::interpreter::SpatialArcGeometry;

/// Circle in any plane, linear in what is across it.
#[derive(Clone, Debug, PartialEq)]
pub struct SpatialArc {
    start: PartPoint,
    end: PartPoint,
    origin: AxisVector,
    slope: AxisVector,
    directions: [AxisVector; 2],
    radius_mm: f64,
    angle_start_rad: f64,
    turn_rate_per_mm: f64,
    length_lu: f64,
    rotary_only: bool,
}

impl SpatialArc {
    /// From `start` to `end` along `geometry`; `linear` says which axes count as path length. An arc without displacement has
    /// length 0.
    pub fn new(start: PartPoint, end: PartPoint, geometry: &SpatialArcGeometry, linear: &PerAxis<bool>) -> Self {
        let SpatialArcGeometry { directions, centre_mm, radius_mm, sweep_rad } = geometry;
        let [d1, d2] = directions;
        let from_centre = start.0 - *centre_mm;
        let angle_start_rad = from_centre.dot(d2).portable_atan2(from_centre.dot(d1));
        let travel = end.0 - start.0;
        let across = travel - *d1 * travel.dot(d1) - *d2 * travel.dot(d2);
        let pitch_mm = length_over(&across, linear);
        let (length_lu, rotary_only) =
            parameter_length((radius_mm * sweep_rad).portable_hypot(pitch_mm), &across, linear);

        let on_circle = |angle_rad: f64| (*d1 * angle_rad.portable_cos() + *d2 * angle_rad.portable_sin()) * *radius_mm;
        let origin = start.0 - on_circle(angle_start_rad);
        let slope_times_length = end.0 - on_circle(angle_start_rad + sweep_rad) - origin;
        let per_length = |value: f64| if length_lu > 0.0 { value / length_lu } else { 0.0 };
        Self {
            start,
            end,
            origin,
            slope: slope_times_length.map(per_length),
            directions: *directions,
            radius_mm: *radius_mm,
            angle_start_rad,
            turn_rate_per_mm: per_length(*sweep_rad),
            length_lu,
            rotary_only,
        }
    }

    /// Length of the parameter range, pitch included.
    pub fn length_lu(&self) -> f64 {
        self.length_lu
    }

    /// True where no linear axis moves: lengths are then in rad.
    pub fn rotary_only(&self) -> bool {
        self.rotary_only
    }

    /// First point.
    pub fn start(&self) -> PartPoint {
        self.start
    }

    /// Last point.
    pub fn end(&self) -> PartPoint {
        self.end
    }

    /// Unit vectors of the plane: the angle counts from the first to the second.
    pub fn directions(&self) -> &[AxisVector; 2] {
        &self.directions
    }

    /// dq/ds without the part of the circle, the same all along.
    pub fn slope(&self) -> &AxisVector {
        &self.slope
    }

    /// Radius of the circle in its plane.
    pub fn radius_mm(&self) -> f64 {
        self.radius_mm
    }

    /// Polar angles of start and end, not reduced: the end is the start plus the sweep.
    pub fn angles_rad(&self) -> [f64; 2] {
        [self.angle_start_rad, self.angle_start_rad + self.turn_rate_per_mm * self.length_lu]
    }

    /// d(angle)/ds, signed.
    pub fn turn_rate_per_mm(&self) -> f64 {
        self.turn_rate_per_mm
    }

    /// The arc at s, clamped to its ends.
    pub fn at(&self, s_lu: f64) -> CurveState {
        let s_lu = s_lu.max(0.0).min(self.length_lu);
        let (r, w) = (self.radius_mm, self.turn_rate_per_mm);
        let (sin, cos) = (self.angle_start_rad + w * s_lu).portable_sin_cos();
        let [d1, d2] = &self.directions;
        let (outward, along) = (*d1 * cos + *d2 * sin, *d2 * cos - *d1 * sin);
        let position = if s_lu >= self.length_lu {
            self.end
        } else if s_lu > 0.0 {
            PartPoint(self.origin + self.slope * s_lu + outward * r)
        } else {
            self.start
        };
        CurveState {
            position,
            first: self.slope + along * (r * w),
            second: outward * (-r * w * w),
            third: along * (-r * w * w * w),
        }
    }

    /// The part from `start_lu` to `end_lu`, both inside the arc and in order.
    pub(super) fn trimmed(&self, start_lu: f64, end_lu: f64) -> Self {
        let mut part = self.clone();
        part.start = self.at(start_lu).position;
        part.end = self.at(end_lu).position;
        part.origin = self.origin + self.slope * start_lu;
        part.angle_start_rad = self.angle_start_rad + self.turn_rate_per_mm * start_lu;
        part.length_lu = end_lu - start_lu;
        part
    }
}
