//! The master spindle as it turns: a delay of first order behind its set-point.
//!
//! In: the set-point of angle and speed, every t_s. Out: [`SpindleSignals`]. With the delay T (`lag_ms`) the actual speed follows `T d(omega)/dt = omega_set - omega`, and so does
//! the angle; between two set-points the acceleration is taken as constant, and the step is exact:
//!
//! ```text
//! y(h) = theta(h) - T omega(h) + T² m + (y(0) - theta(0) + T omega(0) - T² m) exp(-h/T)        omega(h) = omega(0) + m h
//! ```
//!
//! With T = 0 the actual values are the set-points. Knows no torque, load or friction.

use crate::interpolator::SpindleSetpoint;

/// The spindle at a set-point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpindleSignals {
    /// What the interpolator asks for.
    pub setpoint: SpindleSetpoint,
    /// Angle, all revolutions counted.
    pub angle_actual_rad: f64,
    /// Speed.
    pub speed_actual_rad_s: f64,
}

/// The delay.
#[derive(Clone, Copy, Debug)]
pub struct SpindleLag {
    lag_s: f64,
    period_s: f64,
    before: Option<SpindleSignals>,
}

impl SpindleLag {
    /// At rest; one step lasts `period_s`.
    pub fn new(lag_s: f64, period_s: f64) -> Self {
        Self { lag_s, period_s, before: None }
    }

    /// One set-point later.
    pub fn step(&mut self, setpoint: &SpindleSetpoint) -> SpindleSignals {
        let ideal = SpindleSignals {
            setpoint: *setpoint,
            angle_actual_rad: setpoint.angle_rad,
            speed_actual_rad_s: setpoint.speed_rad_s,
        };
        let signals = match &self.before {
            Some(before) if self.lag_s > 0.0 => self.delayed(before, ideal),
            _ => ideal,
        };
        self.before = Some(signals);
        signals
    }

    fn delayed(&self, before: &SpindleSignals, now: SpindleSignals) -> SpindleSignals {
        let (t, h) = (self.lag_s, self.period_s);
        let m = (now.setpoint.speed_rad_s - before.setpoint.speed_rad_s) / h;
        let settled = |point: &SpindleSetpoint| point.angle_rad - t * point.speed_rad_s + t * t * m;
        let off = before.angle_actual_rad - settled(&before.setpoint);
        let angle_actual_rad = settled(&now.setpoint) + off * libm::exp(-h / t);
        SpindleSignals { angle_actual_rad, speed_actual_rad_s: (now.setpoint.angle_rad - angle_actual_rad) / t, ..now }
    }
}
