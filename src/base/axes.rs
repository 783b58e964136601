//! Axis numbers and values per axis.
//!
//! In: nothing. Out: [`AxisId`], [`PerAxis`]. A machine has at most [`AXES_MAX`] axes; unused places of a `PerAxis` hold the
//! default and never take part in a sum or a limit. Names, limits and units of an axis live in `machine`.

use std::ops::{Index, IndexMut};

/// Most axes a machine may have (linear and rotary together).
pub const AXES_MAX: usize = 8;

/// Number of an axis inside the program: place in the machine file's list, from 0. Not the machine-data index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct AxisId(u8);

impl AxisId {
    /// Panics if `index` is not below [`AXES_MAX`]: machine files are checked before an `AxisId` is made.
    pub const fn new(index: usize) -> Self {
        assert!(index < AXES_MAX, "axis index out of range");
        Self(index as u8)
    }

    /// Place in the machine's list of axes, 0-based.
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// The first `count` axes in order.
    pub fn first(count: usize) -> impl DoubleEndedIterator<Item = AxisId> + ExactSizeIterator + Clone {
        assert!(count <= AXES_MAX, "more axes than AXES_MAX");
        (0..count as u8).map(AxisId)
    }
}

/// What an axis moves along: decides the unit of its positions (mm or rad inside, mm or deg at the borders).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AxisKind {
    /// Position in mm.
    Linear,
    /// Position in rad inside, deg at the borders.
    Rotary,
}

/// One value per axis, indexed by [`AxisId`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct PerAxis<T>([T; AXES_MAX]);

impl<T> PerAxis<T> {
    /// Value of axis i from `f(i)`, unused places included.
    pub fn from_fn(mut f: impl FnMut(AxisId) -> T) -> Self {
        Self(std::array::from_fn(|i| f(AxisId::new(i))))
    }

    /// The same value for every axis.
    pub fn splat(value: T) -> Self
    where
        T: Copy,
    {
        Self([value; AXES_MAX])
    }

    /// Applies `f` to each value.
    pub fn map<U>(self, f: impl FnMut(T) -> U) -> PerAxis<U> {
        PerAxis(self.0.map(f))
    }

    /// All [`AXES_MAX`] values in order.
    pub fn as_slice(&self) -> &[T] {
        &self.0
    }

    /// All [`AXES_MAX`] values in order.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.0
    }
}

impl<T> Index<AxisId> for PerAxis<T> {
    type Output = T;

    fn index(&self, axis: AxisId) -> &T {
        &self.0[axis.index()]
    }
}

impl<T> IndexMut<AxisId> for PerAxis<T> {
    fn index_mut(&mut self, axis: AxisId) -> &mut T {
        &mut self.0[axis.index()]
    }
}
