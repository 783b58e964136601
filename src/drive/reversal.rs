//! What a control does when the set-point changes its direction: friction compensation (MD32490 to MD32540) and backlash
//! compensation (MD32450).
//!
//! In: the set velocity of a position cycle. Out: a pulse on the velocity command, and the correction of the measured position.
//! With MD32510 the amplitude depends on the acceleration a of the set-point at the reversal:
//!
//! ```text
//! a < a1: max a / a1      a1 .. a2: max      a2 .. a3: max + (min - max)(a - a2) / (a3 - a2)      a >= a3: min
//! ```

use crate::machine::{DriveOptions, FrictionAdaptation};

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
    adaptation: Option<FrictionAdaptation>,
    period_s: f64,
    /// Set velocity of the cycle before.
    velocity_before_lu_s: f64,
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
            adaptation: options.friction_adaptation,
            period_s,
            velocity_before_lu_s: 0.0,
            decay_ratio: libm::exp(-period_s / options.friction_pulse_time_s),
            backlash_lu,
            direction: 0.0,
            pulse_lu_s: 0.0,
        }
    }

    /// Of the pulse, at an acceleration.
    fn amplitude(&self, acceleration_lu_s2: f64) -> f64 {
        let (a, most) = (acceleration_lu_s2, self.amplitude_lu_s);
        let Some(FrictionAdaptation { lowest_lu_s, accelerations_lu_s2: [a1, a2, a3] }) = self.adaptation else {
            return most;
        };
        if a < a1 {
            most * a / a1
        } else if a <= a2 {
            most
        } else if a < a3 {
            most + (lowest_lu_s - most) * ((a - a2) / (a3 - a2))
        } else {
            lowest_lu_s
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
                let acceleration_lu_s2 = (velocity_lu_s - self.velocity_before_lu_s).abs() / self.period_s;
                self.pulse_lu_s = direction * self.amplitude(acceleration_lu_s2);
            }
            self.direction = direction;
        }
        self.velocity_before_lu_s = velocity_lu_s;
        // The motor is half the play ahead of the load, in the direction of motion.
        Correction { velocity_lu_s: self.pulse_lu_s, position_lu: -0.5 * self.backlash_lu * self.direction }
    }
}
