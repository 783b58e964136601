//! Position controller: P with velocity feed-forward and clamp (models/drive.md section 4, step 1).
//!
//! In: reference and measured position, velocity feed-forward. Out: [`SpeedCommand`], held for a position cycle.

use super::limit::limited;
use crate::machine::DriveData;

/// Output of the position controller.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpeedCommand {
    /// e_fol: what a control displays.
    pub(super) deviation_lu: f64,
    /// v_cmd.
    pub(super) velocity_lu_s: f64,
    /// w_ref.
    pub(super) motor_speed_rad_s: f64,
    /// The speed clamp holds.
    pub(super) clamped: bool,
}

/// The boxes "Kv", "clamp ±v_max" and "/r".
#[derive(Clone, Debug)]
pub(super) struct PositionLoop {
    /// Kv.
    pub(super) gain_per_s: f64,
    /// v_max.
    pub(super) velocity_max_lu_s: f64,
    /// r.
    pub(super) transmission_lu_per_rad: f64,
    /// After an alarm: the speed set-point, and what it loses each second. In place of the position.
    pub(super) braking: Option<[f64; 2]>,
}

impl PositionLoop {
    pub(super) fn new(data: &DriveData) -> Self {
        Self {
            gain_per_s: data.position_gain_per_s,
            velocity_max_lu_s: data.speed_setpoint_max_lu_s,
            transmission_lu_per_rad: data.mechanics.transmission_lu_per_rad,
            braking: None,
        }
    }

    /// From now on a ramp from `velocity_lu_s` to 0 within `time_s`, in speed control.
    pub(super) fn brake(&mut self, velocity_lu_s: f64, time_s: f64) {
        self.braking = Some([velocity_lu_s, velocity_lu_s / time_s]);
    }

    /// The ramp goes on by one position cycle.
    #[inline(always)]
    pub(super) fn brake_on(&mut self, period_s: f64) {
        if let Some([velocity_lu_s, rate]) = &mut self.braking {
            let left_lu_s = *velocity_lu_s - *rate * period_s;
            *velocity_lu_s = if left_lu_s * *rate > 0.0 { left_lu_s } else { 0.0 };
        }
    }

    /// One position cycle.
    #[inline(always)]
    pub(super) fn step(&self, reference_lu: f64, measured_lu: f64, velocity_feedforward_lu_s: f64) -> SpeedCommand {
        let deviation_lu = reference_lu - measured_lu;
        let wanted_lu_s = self.gain_per_s * deviation_lu + velocity_feedforward_lu_s;
        let (wanted_lu_s, deviation_lu) = match self.braking {
            None => (wanted_lu_s, deviation_lu),
            // The control follows up: there is no deviation.
            Some([velocity_lu_s, _]) => (velocity_lu_s, 0.0),
        };
        let velocity_lu_s = limited(wanted_lu_s, self.velocity_max_lu_s);
        SpeedCommand {
            deviation_lu,
            velocity_lu_s,
            motor_speed_rad_s: velocity_lu_s / self.transmission_lu_per_rad,
            clamped: wanted_lu_s.abs() > self.velocity_max_lu_s,
        }
    }
}
