//! Play between motor and load.
//!
//! In: the position of the motor on the load side. Out: that of the load, which the motor drags along at either end of the play.
//! The load has no inertia of its own here and stays where it was left (its friction holds it): that is the play of a screw
//! measured by hand. A load that swings behind its play is not modelled.

/// The play operator.
#[derive(Clone, Debug)]
pub(super) struct Backlash {
    half_lu: f64,
    load_lu: f64,
}

impl Backlash {
    /// The motor stands in the middle of the play.
    pub(super) fn new(width_lu: f64, position_lu: f64) -> Option<Self> {
        (width_lu > 0.0).then_some(Self { half_lu: 0.5 * width_lu, load_lu: position_lu })
    }

    /// The motor has moved to `motor_lu`.
    #[inline]
    pub(super) fn follow(&mut self, motor_lu: f64) {
        let (low_lu, high_lu) = (motor_lu - self.half_lu, motor_lu + self.half_lu);
        if self.load_lu < low_lu || motor_lu.is_nan() {
            self.load_lu = low_lu;
        } else if self.load_lu > high_lu {
            self.load_lu = high_lu;
        }
    }

    /// Where the load is.
    pub(super) fn load_lu(&self) -> f64 {
        self.load_lu
    }
}
