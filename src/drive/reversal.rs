//! What a control does when the set-point changes its direction: friction compensation (MD32490 to MD32540) and backlash
//! compensation (MD32450).
//!
//! In: the set velocity of a position cycle. Out: a pulse on the velocity command, and the correction of the measured position.
//! The pulse has one amplitude (MD32520): its adaptation to the acceleration (MD32510) is not modelled.

use crate::machine::DriveOptions;

/// Slower is standstill: rounding of the set-point must not count as a reversal.
const STANDSTILL_LU_S: f64 = 1e-9;

/// What holds in one position cycle.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Correction {
    /// Added to the velocity command.
    pub(super) velocity_lu_s: f64,
    /// Added to the measured position.
    pub(super) position_lu: f64,
}

/// The last direction, and the pulse that fades.
#[derive(Clone, Debug)]
pub(super) struct Reversal {
    active: bool,
    amplitude_lu_s: f64,
    /// exp(-T_p / T), MD32540.
    decay_ratio: f64,
    backlash_lu: f64,
    /// +1, -1; 0 before the first motion.
    direction: f64,
    pulse_lu_s: f64,
}

impl Reversal {
    pub(super) fn new(options: &DriveOptions, period_s: f64) -> Self {
        let (amplitude_lu_s, backlash_lu) = (options.friction_pulse_lu_s, options.backlash_compensation_lu);
        Self {
            active: amplitude_lu_s != 0.0 || backlash_lu != 0.0,
            amplitude_lu_s,
            decay_ratio: (-period_s / options.friction_pulse_time_s).exp(),
            backlash_lu,
            direction: 0.0,
            pulse_lu_s: 0.0,
        }
    }

    /// One position cycle.
    #[inline]
    pub(super) fn step(&mut self, velocity_lu_s: f64) -> Correction {
        if !self.active {
            return Correction::default();
        }
        self.pulse_lu_s *= self.decay_ratio;
        if velocity_lu_s.abs() > STANDSTILL_LU_S {
            let direction = 1f64.copysign(velocity_lu_s);
            if direction * self.direction < 0.0 {
                self.pulse_lu_s = direction * self.amplitude_lu_s;
            }
            self.direction = direction;
        }
        // The motor is half the play ahead of the load, in the direction of motion.
        Correction { velocity_lu_s: self.pulse_lu_s, position_lu: -0.5 * self.backlash_lu * self.direction }
    }
}
