//! The wire out of a drive: every signal of the diagram in models/drive.md section 1.

/// All wires of one axis at one instant: state before the plant step together with the commands of the tick.
/// `lu` is mm or rad.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct AxisSignals {
    /// x_set: set-point as sent by the interpolator.
    pub position_setpoint_lu: f64,
    /// x_ref: set-point after the balancing delay.
    pub position_reference_lu: f64,
    /// x: load side.
    pub position_actual_lu: f64,
    /// x_meas: as the position encoder gives it.
    pub position_measured_lu: f64,
    /// e_fol = x_ref - x_meas.
    pub control_deviation_lu: f64,
    /// e_trk = x_set - x.
    pub following_error_lu: f64,
    /// v_cmd: output of the position controller with feed-forward, clamped.
    pub velocity_command_lu_s: f64,
    /// v_ff (VFFWS).
    pub velocity_feedforward_lu_s: f64,
    /// v.
    pub velocity_actual_lu_s: f64,
    /// w_ref.
    pub motor_speed_reference_rad_s: f64,
    /// w.
    pub motor_speed_rad_s: f64,
    /// t_ref.
    pub torque_reference_n_m: f64,
    /// t_ff (TFFWS).
    pub torque_feedforward_n_m: f64,
    /// t_fric: Tc sgn w + B w; at rest clamp(Kt i - Tg, ±Ts).
    pub friction_torque_n_m: f64,
    /// t_grav, outside load included.
    pub gravity_torque_n_m: f64,
    /// i_ref.
    pub current_reference_a: f64,
    /// i.
    pub current_a: f64,
    /// i_avg: mean over the position period that ends at this tick.
    pub current_mean_a: f64,
    /// u.
    pub voltage_v: f64,
    /// Bits of [`flags`].
    pub flags: u32,
    /// Contour deviation: lag of the axis minus the lag that the control's model of it has (CONT_DEV, trackErrDiff).
    pub contour_deviation_lu: f64,
    /// Bits of [`monitoring`].
    pub monitoring: u32,
}

/// Bits of [`AxisSignals::monitoring`]: what the control sees at the position tick.
pub mod monitoring {
    /// The set-point rests and the axis is in the coarse window (MD36000).
    pub const IN_POSITION_COARSE: u32 = 1;
    /// The set-point rests and the axis is in the fine window (MD36010).
    pub const IN_POSITION_FINE: u32 = 2;
    /// The contour deviation is larger than MD36400.
    pub const CONTOUR: u32 = 4;
    /// The axis has not come into the fine window within MD36020.
    pub const POSITIONING: u32 = 8;
    /// MD36040 after the end of a motion the axis is away by more than MD36030.
    pub const STANDSTILL: u32 = 16;
    /// The speed set-point has been at its limit for longer than MD36220.
    pub const SPEED_LIMIT: u32 = 32;
    /// `follow`: the set-point is faster than the axis may be. This bit and the next three are not a drive's: who sends the set-points sets them.
    pub const SETPOINT_VELOCITY: u32 = 64;
    /// `follow`: its acceleration is beyond that of the axis.
    pub const SETPOINT_ACCELERATION: u32 = 128;
    /// `follow`: its jerk is beyond that of the axis.
    pub const SETPOINT_JERK: u32 = 256;
    /// `follow`: it is outside the travel.
    pub const SETPOINT_TRAVEL: u32 = 512;
}

/// Bits of [`AxisSignals::flags`].
pub mod flags {
    /// Speed set-point clamped.
    pub const SPEED_CLAMP: u32 = 1;
    /// Current limit reached.
    pub const CURRENT_LIMIT: u32 = 2;
    /// Voltage limit reached.
    pub const VOLTAGE_LIMIT: u32 = 4;
    /// The axis sticks.
    pub const STUCK: u32 = 8;

    /// The bits for which the limits hold: speed, current, voltage; and stuck.
    #[inline(always)]
    pub(crate) fn of(holds: [bool; 4]) -> u32 {
        let [speed, current, voltage, stuck] = holds;
        let bit = |holds: bool, flag: u32| if holds { flag } else { 0 };
        bit(speed, SPEED_CLAMP) | bit(current, CURRENT_LIMIT) | bit(voltage, VOLTAGE_LIMIT) | bit(stuck, STUCK)
    }
}

/// How a drive starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Start {
    /// Balanced: integrators hold the axis under gravity exactly still.
    #[default]
    Held,
    /// Brake released with empty integrators.
    Cold,
}
