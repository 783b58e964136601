//! Frames: how a position of one coordinate system is expressed in the system around it.
//!
//! In: components (coarse and fine translation, rotation, scale, mirror). Out: [`Frame`]: points and directions from the inside to
//! the outside and back, chains of frames, components of a chain. Does not know which frames are active.
//!
//! With the components of one frame, a point p inside is at
//!
//! ```text
//! p_outside = translation + fine + R S M p        (order TRANS, ROT, SCALE, MIRROR)
//! R = R_z(c) R_y(b) R_x(a)                         (RPY: Z, Y', X''; MD10600 = 1)
//! ```
//!
//! outside. Only X, Y and Z turn; every other axis is translated, scaled and mirrored by itself. A positive angle turns the
//! coordinate system counter-clockwise for one who looks against the axis.
//!
//! A chain of frames is again translation + matrix. Its matrix is kept as it is; components are read out of it: rotation in
//! -180 < a <= 180, -90 <= b <= 90, -180 < c <= 180. They are exact unless a rotation stands inside an unequal scale: such a matrix
//! shears, which no components express; points are then still exact, and components are those of the nearest frame that keeps the
//! direction of X.

use crate::base::Portable;
use crate::base::{AxisId, AxisVector, PerAxis};
use crate::machine::ZeroOffset;
use std::f64::consts::FRAC_PI_2;

/// X, Y, Z where the machine has them as linear axes.
pub type GeometryAxes = [Option<AxisId>; 3];

/// Rows of a matrix of direction cosines and factors, dimensionless.
pub type Matrix = [[f64; 3]; 3];

/// Angles nearer than this to a quarter turn are one: its sine and cosine are then exact.
const QUARTER_TOLERANCE_RAD: f64 = 1e-12;
/// Cosine of b below which a and c turn about the same line.
const GIMBAL_RATIO: f64 = 1e-12;
/// Cell of a product, relative to the largest, that is rounding of 0.
const NOISE_RATIO: f64 = 1e-14;
/// Relative difference up to which two scale factors are the same.
const SAME_SCALE_RATIO: f64 = 1e-12;

const UNIT: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    axes: GeometryAxes,
    translation_lu: AxisVector,
    fine_lu: AxisVector,
    /// About X, Y, Z.
    rotation_rad: [f64; 3],
    scale_ratio: AxisVector,
    mirror: PerAxis<bool>,
    /// R S M of the geometry axes, or the product of a chain.
    matrix: Matrix,
}

/// One kind of component: TR, FI, RT, SC, MI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// Coarse translation.
    Translation,
    /// Fine translation.
    Fine,
    /// Angle about the axis.
    Rotation,
    /// Scale factor.
    Scale,
    /// 1 where the axis is mirrored, 0 where not.
    Mirror,
}

impl Frame {
    /// Changes nothing.
    pub fn identity(axes: GeometryAxes) -> Self {
        Self {
            axes,
            translation_lu: AxisVector::zero(),
            fine_lu: AxisVector::zero(),
            rotation_rad: [0.0; 3],
            scale_ratio: PerAxis::splat(1.0),
            mirror: PerAxis::splat(false),
            matrix: UNIT,
        }
    }

    /// A zero offset of a file.
    pub fn from_offset(axes: GeometryAxes, offset: &ZeroOffset) -> Self {
        let mut frame = Self {
            translation_lu: offset.translation_lu,
            fine_lu: offset.fine_lu,
            rotation_rad: axes.map(|axis| axis.map_or(0.0, |axis| offset.rotation_rad[axis])),
            scale_ratio: offset.scale_ratio,
            mirror: offset.mirror,
            ..Self::identity(axes)
        };
        frame.rebuild();
        frame
    }

    /// Rotation by angles about X, Y, Z in RPY order.
    pub fn rotation(axes: GeometryAxes, rotation_rad: [f64; 3]) -> Self {
        let mut frame = Self::identity(axes);
        frame.rotation_rad = rotation_rad;
        frame.rebuild();
        frame
    }

    /// Rotation by solid angles: the two programmed axes span a plane. Each angle turns the other axis of the plane about this one,
    /// into the line in which the new plane cuts the old plane of that other axis and the third. The new first axis lies in the old plane of the third
    /// and the first. One angle is a rotation about its axis; three are none.
    pub fn solid_angles(axes: GeometryAxes, angles_rad: [Option<f64>; 3]) -> Option<Self> {
        let (first, second) = match angles_rad {
            [Some(_), Some(_), Some(_)] => return None,
            [Some(_), Some(_), None] => (0, 1),
            [Some(_), None, Some(_)] => (2, 0),
            [None, Some(_), Some(_)] => (1, 2),
            single => return Some(Self::rotation(axes, single.map(|angle_rad| angle_rad.unwrap_or(0.0)))),
        };
        let third = 3 - first - second;
        let [about_first_rad, about_second_rad] = [first, second].map(|axis| angles_rad[axis].unwrap_or(0.0));
        // Directions by place in (first, second, third), which is a right-handed order.
        let (sin_2, cos_2) = sin_cos(about_second_rad);
        let (sin_1, cos_1) = sin_cos(about_first_rad);
        let new_first = [cos_2, 0.0, -sin_2];
        let in_plane = [0.0, cos_1, sin_1];
        let normal = unit(cross(new_first, in_plane))?;
        let new_second = cross(normal, new_first);
        let mut matrix = [[0.0; 3]; 3];
        for (row, place) in [first, second, third].into_iter().enumerate() {
            matrix[place][first] = new_first[row];
            matrix[place][second] = new_second[row];
            matrix[place][third] = normal[row];
        }
        let mut frame = Self::identity(axes);
        frame.rotation_rad = angles_of(&matrix);
        frame.matrix = matrix;
        Some(frame)
    }

    /// The axes that turn.
    pub fn axes(&self) -> GeometryAxes {
        self.axes
    }

    /// Place of an axis among X, Y, Z.
    pub fn place(&self, axis: AxisId) -> Option<usize> {
        self.axes.iter().position(|known| *known == Some(axis))
    }

    /// A component of an axis: mm, rad, or a number. The rotation of an axis that does not turn is 0.
    pub fn component_lu(&self, axis: AxisId, component: Component) -> f64 {
        match component {
            Component::Translation => self.translation_lu[axis],
            Component::Fine => self.fine_lu[axis],
            Component::Rotation => self.place(axis).map_or(0.0, |place| self.rotation_rad[place]),
            Component::Scale => self.scale_ratio[axis],
            Component::Mirror => f64::from(u8::from(self.mirror[axis])),
        }
    }

    /// Sets a component; the mirror is on unless 0. A shear that a chain has left is dropped with its rotation, scale or mirror.
    /// The scale must not be 0.
    pub fn set_component_lu(&mut self, axis: AxisId, component: Component, value_lu: f64) {
        match component {
            Component::Translation => self.translation_lu[axis] = value_lu,
            Component::Fine => self.fine_lu[axis] = value_lu,
            Component::Rotation => {
                if let Some(place) = self.place(axis) {
                    self.rotation_rad[place] = value_lu;
                }
            }
            Component::Scale => self.scale_ratio[axis] = value_lu,
            Component::Mirror => self.mirror[axis] = value_lu != 0.0,
        }
        if !matches!(component, Component::Translation | Component::Fine) {
            self.rebuild();
        }
    }

    /// What the inside's zero has outside: coarse and fine translation.
    pub fn offset_lu(&self) -> AxisVector {
        self.translation_lu + self.fine_lu
    }

    /// Rotation, scale and mirror of the geometry axes: column k is the image of axis k.
    pub fn matrix(&self) -> &Matrix {
        &self.matrix
    }

    /// Scale with the sign of the mirror of an axis that does not turn.
    pub fn factor_ratio(&self, axis: AxisId) -> f64 {
        if self.mirror[axis] { -self.scale_ratio[axis] } else { self.scale_ratio[axis] }
    }

    /// A point inside, as a point outside.
    pub fn outward(&self, inside_lu: &AxisVector) -> AxisVector {
        self.direction_outward(inside_lu) + self.offset_lu()
    }

    /// A displacement or derivative inside, as one outside.
    pub fn direction_outward(&self, inside_lu: &AxisVector) -> AxisVector {
        let scaled = PerAxis::from_fn(|axis| self.factor_ratio(axis) * inside_lu[axis]);
        self.with_geometry(scaled, multiplied(&self.matrix, self.geometry(inside_lu)))
    }

    /// A point outside, as a point inside.
    pub fn inward(&self, outside_lu: &AxisVector) -> AxisVector {
        let free_lu = *outside_lu - self.offset_lu();
        let scaled = PerAxis::from_fn(|axis| free_lu[axis] / self.factor_ratio(axis));
        self.with_geometry(scaled, multiplied(&inverted(&self.matrix), self.geometry(&free_lu)))
    }

    /// The chain self : inner. A point of `inner` goes through `inner` first.
    pub fn chained(&self, inner: &Self) -> Self {
        let mut chain = Self {
            axes: self.axes,
            // The fine part of the inner frame is lost as such: it is part of a point.
            translation_lu: self.translation_lu + self.direction_outward(&inner.offset_lu()),
            fine_lu: self.fine_lu,
            rotation_rad: self.rotation_rad,
            scale_ratio: PerAxis::from_fn(|axis| self.scale_ratio[axis] * inner.scale_ratio[axis]),
            mirror: PerAxis::from_fn(|axis| self.mirror[axis] != inner.mirror[axis]),
            matrix: without_noise(product(&self.matrix, &inner.matrix)),
        };
        if inner.is_without_rotation() {
            // R1 S1 M1 S2 M2: the rotation is that of the outer frame.
        } else if self.matrix == UNIT {
            chain.rotation_rad = inner.rotation_rad;
        } else if self.scales_equally() {
            chain.resolve();
        } else {
            chain.decompose();
        }
        chain
    }

    /// The frame that undoes this one.
    pub fn inverse(&self) -> Self {
        let mut inverse = Self {
            scale_ratio: self.scale_ratio.map(|scale_ratio| 1.0 / scale_ratio),
            matrix: without_noise(inverted(&self.matrix)),
            mirror: self.mirror,
            ..Self::identity(self.axes)
        };
        // The inverse of R s M is M R^-1 / s = (M R^-1 M) M / s.
        if self.is_without_rotation() {
            inverse.rotation_rad = [0.0; 3];
        } else if self.scales_equally() {
            inverse.resolve();
        } else {
            inverse.decompose();
        }
        inverse.translation_lu = -inverse.direction_outward(&self.offset_lu());
        inverse
    }

    /// True if positions inside and outside differ by a translation at most.
    pub fn only_translates(&self) -> bool {
        self.matrix == UNIT && AxisId::first(crate::base::AXES_MAX).all(|axis| self.factor_ratio(axis) == 1.0)
    }

    /// True if every axis goes its own way: no rotation, or one by half turns.
    pub fn keeps_axes(&self) -> bool {
        let row_is_free = |row: usize| (0..3).all(|column| row == column || self.matrix[row][column] == 0.0);
        (0..3).all(row_is_free)
    }

    /// Adds a displacement of the outside to the fine translation.
    pub fn add_fine(&mut self, outside_lu: &AxisVector) {
        self.fine_lu += *outside_lu;
    }

    fn is_without_rotation(&self) -> bool {
        self.rotation_rad == [0.0; 3] && self.keeps_axes()
    }

    /// Rotation of the chain's matrix where the outer frame has one scale s in all directions:
    /// R1 s M1 R2 S2 M2 = R1 (M1 R2 M1) s S2 M1 M2, and M1 R2 M1 is a rotation.
    fn resolve(&mut self) {
        let mut turned = self.matrix;
        for row in &mut turned {
            for (cell, axis) in row.iter_mut().zip(self.axes) {
                *cell /= axis.map_or(1.0, |axis| self.factor_ratio(axis));
            }
        }
        self.rotation_rad = angles_of(&turned);
    }

    fn scales_equally(&self) -> bool {
        let mut scales = self.axes.iter().flatten().map(|axis| self.scale_ratio[*axis]);
        let first_ratio = scales.next().unwrap_or(1.0);
        scales.all(|ratio| (ratio - first_ratio).abs() <= SAME_SCALE_RATIO * first_ratio.abs())
    }

    /// Components from the matrix alone: columns made orthogonal in order, a left-handed matrix mirrored in X.
    fn decompose(&mut self) {
        let [x, y, z] = [0, 1, 2].map(|column| [0, 1, 2].map(|row: usize| self.matrix[row][column]));
        let without = |a: [f64; 3], along: [f64; 3]| {
            let share = dot(a, along);
            [a[0] - share * along[0], a[1] - share * along[1], a[2] - share * along[2]]
        };
        let (Some(mut first), Some(second)) = (unit(x), unit(x).and_then(|first| unit(without(y, first)))) else {
            return;
        };
        let mut third = cross(first, second);
        let scales_ratio = [dot(x, first), dot(y, second), dot(z, third)];
        let is_left_handed = scales_ratio[2] < 0.0;
        if is_left_handed {
            first = first.map(|c| -c);
            third = third.map(|c| -c);
        }
        let mut turned = [[0.0; 3]; 3];
        for (row, cells) in turned.iter_mut().enumerate() {
            *cells = [first[row], second[row], third[row]];
        }
        self.rotation_rad = angles_of(&turned);
        for (place, axis) in self.axes.iter().enumerate() {
            if let Some(axis) = axis {
                self.scale_ratio[*axis] = scales_ratio[place].abs();
                self.mirror[*axis] = place == 0 && is_left_handed;
            }
        }
    }

    /// The matrix from the components.
    fn rebuild(&mut self) {
        let factors = self.axes.map(|axis| axis.map_or(1.0, |axis| self.factor_ratio(axis)));
        self.matrix = rotation_matrix(self.rotation_rad);
        for row in &mut self.matrix {
            for (cell, factor) in row.iter_mut().zip(factors) {
                *cell *= factor;
            }
        }
    }

    fn geometry(&self, point_lu: &AxisVector) -> [f64; 3] {
        self.axes.map(|axis| axis.map_or(0.0, |axis| point_lu[axis]))
    }

    fn with_geometry(&self, mut point_lu: AxisVector, values: [f64; 3]) -> AxisVector {
        for (axis, value) in self.axes.iter().zip(values) {
            if let Some(axis) = axis {
                point_lu[*axis] = value;
            }
        }
        point_lu
    }
}

/// R_z(c) R_y(b) R_x(a).
fn rotation_matrix([a, b, c]: [f64; 3]) -> Matrix {
    let ((sa, ca), (sb, cb), (sc, cc)) = (sin_cos(a), sin_cos(b), sin_cos(c));
    [
        [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
        [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
        [-sb, cb * sa, cb * ca],
    ]
}

/// Angles about X, Y, Z of a rotation, each in its range.
fn angles_of(r: &Matrix) -> [f64; 3] {
    let cos_b = r[0][0].portable_hypot(r[1][0]);
    // A negative zero would make -180 degrees of 180.
    let angle_rad = |sine: f64, cosine: f64| (sine + 0.0).portable_atan2(cosine);
    let b = angle_rad(-r[2][0], cos_b);
    if cos_b < GIMBAL_RATIO {
        return [0.0, b, angle_rad(-r[0][1], r[1][1])];
    }
    [angle_rad(r[2][1], r[2][2]), b, angle_rad(r[1][0], r[0][0])]
}

/// Sine and cosine, exact at quarter turns.
fn sin_cos(angle_rad: f64) -> (f64, f64) {
    let quarters = (angle_rad / FRAC_PI_2).round();
    if (angle_rad - quarters * FRAC_PI_2).abs() > QUARTER_TOLERANCE_RAD {
        return angle_rad.portable_sin_cos();
    }
    match quarters.rem_euclid(4.0) as u8 {
        0 => (0.0, 1.0),
        1 => (1.0, 0.0),
        2 => (0.0, -1.0),
        _ => (-1.0, 0.0),
    }
}

fn multiplied(matrix: &Matrix, vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| dot(row, vector))
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    a.map(|row| [0, 1, 2].map(|column| row[0] * b[0][column] + row[1] * b[1][column] + row[2] * b[2][column]))
}

/// Cells that are 0 but for rounding, as 0: two turns by 45 degrees keep X on an axis.
fn without_noise(matrix: Matrix) -> Matrix {
    let largest = matrix.iter().flatten().fold(0.0_f64, |largest, cell| largest.max(cell.abs()));
    matrix.map(|row| row.map(|cell| if cell.abs() <= NOISE_RATIO * largest { 0.0 } else { cell }))
}

/// Inverse by cofactors; frames have scales other than 0, so that there is one.
fn inverted(m: &Matrix) -> Matrix {
    let [r0, r1, r2] = *m;
    let columns = [cross(r1, r2), cross(r2, r0), cross(r0, r1)];
    let determinant = dot(r0, columns[0]);
    let mut inverse = [[0.0; 3]; 3];
    for (row, cells) in inverse.iter_mut().enumerate() {
        *cells = [columns[0][row] / determinant, columns[1][row] / determinant, columns[2][row] / determinant];
    }
    inverse
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let length = dot(a, a).sqrt();
    (length > 0.0).then(|| a.map(|c| c / length))
}
