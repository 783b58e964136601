//! A drive of either sort, so that the kernel treats both alike.
//!
//! In: the checked axis. Out: [`Drive`]: the cascade where the machine file has drive data, an ideal axis where not.

use super::axis_drive::{AxisDrive, DriveInput};
use super::ideal::IdealDrive;
use super::wire::{AxisSignals, Start};
use crate::base::TimeBase;
use crate::machine::Axis;

/// The drive of one axis.
#[derive(Clone, Debug)]
pub enum Drive {
    /// No drive data: actual = set-point, one step an interpolator cycle.
    Ideal(IdealDrive),
    /// The cascade, one step a position cycle of the axis. Boxed: it is ten times the size of the other.
    Cascade(Box<AxisDrive>),
}

impl Drive {
    /// Standing at `position_lu`, the first set-point.
    pub fn new(axis: &Axis, time_base: &TimeBase, start: Start, position_lu: f64) -> Self {
        match AxisDrive::new(axis, time_base, start, position_lu) {
            Some(drive) => Self::Cascade(Box::new(drive)),
            None => Self::Ideal(IdealDrive::new(time_base, position_lu)),
        }
    }

    /// One position cycle; the signals at its first tick.
    pub fn step(&mut self, input: DriveInput) -> AxisSignals {
        match self {
            Self::Ideal(drive) => drive.step(input),
            Self::Cascade(drive) => drive.step(input),
        }
    }

    /// One position cycle; `each` gets the signals at every current tick (an ideal drive has one).
    pub fn step_each(&mut self, input: DriveInput, mut each: impl FnMut(u32, &AxisSignals)) {
        match self {
            Self::Ideal(drive) => each(0, &drive.step(input)),
            Self::Cascade(drive) => drive.step_each(input, each),
        }
    }

    /// See [`AxisDrive::brake`]; an ideal axis stands where its set-point does.
    pub fn brake(&mut self, velocity_lu_s: f64, time_s: f64) {
        if let Self::Cascade(drive) = self {
            drive.brake(velocity_lu_s, time_s);
        }
    }

    /// False when the axis has diverged: see [`AxisDrive::is_finite`].
    pub fn is_finite(&self) -> bool {
        match self {
            Self::Ideal(drive) => drive.is_finite(),
            Self::Cascade(drive) => drive.is_finite(),
        }
    }
}
