//! Points and vectors with one component per axis, and the types that keep spaces apart.
//!
//! In: components in mm (linear axes) and rad (rotary axes). Out: [`AxisVector`] arithmetic, [`PartPoint`], [`MachinePoint`].
//! Does not convert between spaces: only `kinematics` may.

use super::axes::PerAxis;
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A displacement or derivative with one component per axis: mm (or mm/s, mm per mm of path, ...) for linear axes, rad for
/// rotary ones. Unused places are 0.
pub type AxisVector = PerAxis<f64>;

/// A point in part space: the basic coordinate system after all frames, tool tip, with the rotary axes as programmed. mm, rad.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PartPoint(pub AxisVector);

/// A point in machine space: one position per machine axis. mm, rad.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct MachinePoint(pub AxisVector);

impl AxisVector {
    /// All components 0.
    pub fn zero() -> Self {
        Self::splat(0.0)
    }

    /// Scalar product over all components. Meaningful only where units agree: mask first in mixed spaces.
    pub fn dot(&self, other: &Self) -> f64 {
        self.as_slice().iter().zip(other.as_slice()).map(|(a, b)| a * b).sum()
    }

    /// Euclidean length.
    pub fn norm(&self) -> f64 {
        self.dot(self).sqrt()
    }

    /// The components for which `keep` holds, the others 0.
    pub fn masked(&self, keep: &PerAxis<bool>) -> Self {
        let mut masked = *self;
        for (value, keep) in masked.as_mut_slice().iter_mut().zip(keep.as_slice()) {
            if !keep {
                *value = 0.0;
            }
        }
        masked
    }
}

impl Add for AxisVector {
    type Output = Self;

    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}

impl AddAssign for AxisVector {
    fn add_assign(&mut self, other: Self) {
        for (a, b) in self.as_mut_slice().iter_mut().zip(other.as_slice()) {
            *a += b;
        }
    }
}

impl Sub for AxisVector {
    type Output = Self;

    fn sub(mut self, other: Self) -> Self {
        for (a, b) in self.as_mut_slice().iter_mut().zip(other.as_slice()) {
            *a -= b;
        }
        self
    }
}

impl Mul<f64> for AxisVector {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        self.map(|a| a * factor)
    }
}

impl Neg for AxisVector {
    type Output = Self;

    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}
