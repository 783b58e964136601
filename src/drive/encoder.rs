//! The two encoders: position scale and motor encoder (models/drive.md section 4).
//!
//! In: load position, motor angle and speed. Out: what the controllers measure. A quantum of 0 is an ideal encoder. Does not
//! model interpolation errors or noise.

use super::plant::PlantState;
use crate::machine::DriveData;

/// Q(x, q) = q floor(x/q + 1/2), in the unit of both.
fn quantised(value: f64, quantum: f64) -> f64 {
    quantum * (value / quantum + 0.5).floor()
}

/// Scale at the load.
#[derive(Clone, Debug)]
pub(super) struct PositionEncoder {
    resolution_lu: f64,
}

impl PositionEncoder {
    pub(super) fn new(data: &DriveData) -> Self {
        Self { resolution_lu: data.encoder.position_resolution_lu }
    }

    /// x_meas, at the position cycle.
    pub(super) fn measured_lu(&self, position_lu: f64) -> f64 {
        if self.resolution_lu == 0.0 { position_lu } else { quantised(position_lu, self.resolution_lu) }
    }
}

/// Encoder at the motor, from which the drive takes the speed.
#[derive(Clone, Debug)]
pub(super) struct MotorEncoder {
    resolution_rad: f64,
    speed_period_s: f64,
    angle_before_rad: f64,
}

impl MotorEncoder {
    /// Standing at `angle_rad` before the first reading: the first speed is 0.
    pub(super) fn new(data: &DriveData, speed_period_s: f64, angle_rad: f64) -> Self {
        let resolution_rad = data.encoder.motor_resolution_rad;
        let angle_before_rad = if resolution_rad == 0.0 { angle_rad } else { quantised(angle_rad, resolution_rad) };
        Self { resolution_rad, speed_period_s, angle_before_rad }
    }

    /// It measures the speed as it is, and remembers nothing.
    pub(super) fn is_ideal(&self) -> bool {
        self.resolution_rad == 0.0
    }

    /// w_meas, at the speed cycle: the true speed, or the difference quotient of the quantised angle.
    #[inline]
    pub(super) fn measured_speed_rad_s(&mut self, state: PlantState) -> f64 {
        if self.resolution_rad == 0.0 {
            return state.speed_rad_s;
        }
        let angle_rad = quantised(state.angle_rad, self.resolution_rad);
        let travelled_rad = angle_rad - self.angle_before_rad;
        self.angle_before_rad = angle_rad;
        travelled_rad / self.speed_period_s
    }
}
