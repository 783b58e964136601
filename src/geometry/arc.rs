//! A circular arc or helix.
//!
//! In: start, end and the [`ArcGeometry`] of the move. Out: [`Arc`]:
//! `q(s) = origin + slope * s + r (cos, sin)(phi_0 + omega s)`, the last term in the plane, with `omega = sweep / length`. The axes
//! outside the plane move linearly with the swept angle; the linear ones among them (the pitch) count as path length.
//!
//! Programmed points lie on the circle only to rounding. What is missing at either end is spread linearly over the arc, so that
//! both ends are met and the derivatives are those of the curve that is driven.
//!
//! Does not find centres or sweeps: that is the interpreter's.

use super::CurveState;
use super::curve::{length_over, parameter_length};
use crate::base::Portable;
use crate::base::{AxisId, AxisVector, PartPoint, PerAxis};
use crate::interpreter::ArcGeometry;

/// Circle in two axes, linear in the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Arc {
    start: PartPoint,
    end: PartPoint,
    origin: AxisVector,
    slope: AxisVector,
    geometry: ArcGeometry,
    angle_start_rad: f64,
    turn_rate_per_mm: f64,
    length_lu: f64,
    rotary_only: bool,
}

impl Arc {
    /// From `start` to `end` along `geometry`; `linear` says which axes count as path length. An arc without displacement has
    /// length 0.
    pub fn new(start: PartPoint, end: PartPoint, geometry: &ArcGeometry, linear: &PerAxis<bool>) -> Self {
        let [first, second] = geometry.plane;
        let centre =
            |point: &PartPoint| [point.0[first] - geometry.centre_mm[0], point.0[second] - geometry.centre_mm[1]];
        let [x_mm, y_mm] = centre(&start);
        let angle_start_rad = y_mm.portable_atan2(x_mm);

        let mut outside = end.0 - start.0;
        outside[first] = 0.0;
        outside[second] = 0.0;
        let pitch_mm = length_over(&outside, linear);
        let linear_mm = (geometry.radius_mm * geometry.sweep_rad).portable_hypot(pitch_mm);
        let (length_lu, rotary_only) = parameter_length(linear_mm, &outside, linear);

        let on_circle = |angle_rad: f64| in_plane(geometry, angle_rad.portable_sin_cos(), geometry.radius_mm);
        let origin = start.0 - on_circle(angle_start_rad);
        let slope_times_length = end.0 - on_circle(angle_start_rad + geometry.sweep_rad) - origin;
        let per_length = |value: f64| if length_lu > 0.0 { value / length_lu } else { 0.0 };
        Self {
            start,
            end,
            origin,
            slope: slope_times_length.map(per_length),
            geometry: *geometry,
            angle_start_rad,
            turn_rate_per_mm: per_length(geometry.sweep_rad),
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

    /// First and second axis of the plane.
    pub fn plane(&self) -> [AxisId; 2] {
        self.geometry.plane
    }

    /// Centre in the two axes of the plane.
    pub fn centre_mm(&self) -> [f64; 2] {
        self.geometry.centre_mm
    }

    /// Radius of the circle in the plane.
    pub fn radius_mm(&self) -> f64 {
        self.geometry.radius_mm
    }

    /// Polar angle of the start about the centre, from the first axis of the plane towards the second.
    pub fn angle_start_rad(&self) -> f64 {
        self.angle_start_rad
    }

    /// Polar angle of the end, not reduced: the start angle plus the sweep.
    pub fn angle_end_rad(&self) -> f64 {
        self.angle_start_rad + self.sweep_rad()
    }

    /// Swept angle, positive from the first axis towards the second.
    pub fn sweep_rad(&self) -> f64 {
        self.geometry.sweep_rad
    }

    /// d(angle)/ds, signed: 1/r for a plane arc, less for a helix.
    pub fn turn_rate_per_mm(&self) -> f64 {
        self.turn_rate_per_mm
    }

    /// Curvature in space, not negative: 1/r for a plane arc, r/(r² + (pitch/2π)²) for a helix.
    pub fn curvature_per_mm(&self) -> f64 {
        self.geometry.radius_mm.abs() * self.turn_rate_per_mm * self.turn_rate_per_mm
    }

    /// Curvature with the sense of the arc [Gassara 2013]: positive from the first axis towards the second (G3).
    pub fn signed_curvature_per_mm(&self) -> f64 {
        self.curvature_per_mm().copysign(self.geometry.sweep_rad)
    }

    /// dq/ds at s.
    pub fn tangent_at(&self, s_lu: f64) -> AxisVector {
        self.at(s_lu).first
    }

    /// The arc at s, clamped to its ends.
    pub fn at(&self, s_lu: f64) -> CurveState {
        let s_lu = s_lu.max(0.0).min(self.length_lu);
        let (r, w) = (self.geometry.radius_mm, self.turn_rate_per_mm);
        let (sin, cos) = (self.angle_start_rad + w * s_lu).portable_sin_cos();
        let position = if s_lu >= self.length_lu {
            self.end
        } else if s_lu > 0.0 {
            PartPoint(self.origin + self.slope * s_lu + in_plane(&self.geometry, (sin, cos), r))
        } else {
            self.start
        };
        CurveState {
            position,
            first: self.slope + in_plane(&self.geometry, (cos, -sin), r * w),
            second: in_plane(&self.geometry, (-sin, -cos), r * w * w),
            third: in_plane(&self.geometry, (-cos, sin), r * w * w * w),
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
        part.geometry.sweep_rad = self.turn_rate_per_mm * part.length_lu;
        part
    }
}

/// `factor * (cos, sin)` on the two axes of the plane, zero elsewhere.
fn in_plane(geometry: &ArcGeometry, (sin, cos): (f64, f64), factor_mm: f64) -> AxisVector {
    let [first, second] = geometry.plane;
    let mut vector = AxisVector::zero();
    vector[first] = cos * factor_mm;
    vector[second] = sin * factor_mm;
    vector
}
