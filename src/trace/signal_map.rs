//! Which signal of ours a controller's signal is: one table, printed in docs/traces.md (a test compares).
//!
//! In: the name of a signal in a file. Out: the [`Rule`] for it. A rule says what the signal is, in which units the controller writes
//! it, how late it is and where its zero lies. A signal without a rule keeps its own name and nothing else. Does not know axes.

use super::wire::{TraceFormat, Zero};

/// What is measured, in which convention of units the file has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// mm or deg.
    Position,
    /// mm/s or deg/s.
    Velocity,
    /// mm/min of a linear axis, rev/min of a rotary one.
    VelocityPerMinute,
    /// mm/s^2 or deg/s^2.
    Acceleration,
    /// rev/min of a motor.
    MotorSpeed,
    /// N m.
    Torque,
    /// A.
    Current,
    /// %.
    Percent,
    /// W.
    Power,
    /// Not known, or none.
    Unknown,
}

/// One row of the signal map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rule {
    /// Format that the name belongs to.
    pub format: TraceFormat,
    /// Name without path, width and axis: `CmdPos2ndEnc`, `ENC_POS`, `ActPos`.
    pub controller: &'static str,
    /// Our field without unit; empty if none of ours is the same thing.
    pub ours: &'static str,
    /// Units of the file.
    pub quantity: Quantity,
    /// So many cycles of its own clock later than our signal.
    pub delay_cycles: u8,
    /// Where its zero lies.
    pub zero: Zero,
    /// What to keep in mind.
    pub remark: &'static str,
}

const fn rule(
    format: TraceFormat,
    controller: &'static str,
    ours: &'static str,
    quantity: Quantity,
    remark: &'static str,
) -> Rule {
    Rule { format, controller, ours, quantity, delay_cycles: 0, zero: Zero::Same, remark }
}

impl Rule {
    const fn encoder_zero(self) -> Self {
        Self { zero: Zero::Encoder, ..self }
    }
}

use Quantity::*;
use TraceFormat::{EdgeJson as E, Halscope as H, OperateXml as O, TwinCatCsv as T};

const DELAYED: &str =
    "formed against the set-point after the filters, which is some cycles late: not set-point minus actual";
const BEFORE_FILTERS: &str = "before the filters of the position controller";
const FILTERED: &str = "after the filters: later than the set-point, some 5.5 ms in the trace that was looked at";
const IPO_LATE: &str = "interpolator clock: 1 to 4 ms late in the traces that were looked at";

/// The signal map. Of several rows for one of our signals the first that the file has gets our name.
pub const SIGNAL_MAP: &[Rule] = &[
    rule(O, "CmdPos2ndEnc", "position_setpoint", Position, BEFORE_FILTERS),
    rule(O, "CmdPos1stEnc", "position_setpoint", Position, BEFORE_FILTERS),
    rule(O, "CmdPos1stEncM", "position_setpoint", Position, BEFORE_FILTERS),
    rule(O, "ActPos2ndEnc", "position_measured", Position, "second measuring system").encoder_zero(),
    rule(O, "ActPos1stEnc", "position_measured", Position, "first measuring system").encoder_zero(),
    rule(O, "measPos2", "position_measured", Position, IPO_LATE).encoder_zero(),
    rule(O, "measPos1", "position_measured", Position, IPO_LATE).encoder_zero(),
    rule(O, "CtrlDev", "control_deviation", Position, DELAYED),
    rule(O, "FlwErr", "following_error", Position, "set-point before the filters minus actual: the whole lag"),
    rule(
        O,
        "ContDev",
        "contour_deviation",
        Position,
        "lag minus the control's own model of the lag; its sign is not verified",
    ),
    rule(O, "CmdVelCtrlIn", "velocity_setpoint", VelocityPerMinute, FILTERED),
    rule(O, "ActVel2ndEnc", "velocity_actual", VelocityPerMinute, "noisy: differences of the encoder"),
    rule(O, "ActVel1stEnc", "velocity_actual", VelocityPerMinute, "noisy: differences of the encoder"),
    rule(O, "ActVelMot", "velocity_actual", VelocityPerMinute, "motor encoder, on the load side; about a cycle late"),
    rule(O, "ActVelMotorSide", "", Unknown, "unit not known"),
    rule(O, "CmdAccCtrlIn", "acceleration_setpoint", Acceleration, FILTERED),
    rule(O, "CmdTorque", "torque_reference", Torque, "after the limits"),
    rule(O, "ActCurr", "current", Current, "torque-producing"),
    rule(O, "DrvLoad", "", Percent, "utilisation of the drive"),
    rule(E, "DES_POS", "position_setpoint", Position, "after the fine interpolator, before filters and compensations"),
    rule(E, "CTRL_POS", "position_reference", Position, "input of the position controller, after the filters"),
    rule(E, "ENC_POS", "position_measured", Position, "active measuring system").encoder_zero(),
    rule(E, "ENC1_POS", "position_measured", Position, "first measuring system").encoder_zero(),
    rule(E, "ENC2_POS", "position_measured", Position, "second measuring system").encoder_zero(),
    rule(E, "CTRL_DIFF", "control_deviation", Position, DELAYED),
    rule(E, "CTRL_DIFF2", "", Position, "deviation without dynamic stiffness control"),
    rule(
        E,
        "CONT_DEV",
        "contour_deviation",
        Position,
        "lag minus the control's own model of the lag; its sign is not verified",
    ),
    rule(E, "VEL_FFW", "velocity_feedforward", Velocity, ""),
    rule(E, "TORQUE_FFW", "torque_feedforward", Torque, ""),
    rule(E, "CMD_SPEED", "", Unknown, "unit not verified"),
    rule(E, "TORQUE", "", Torque, "unit not verified"),
    rule(E, "CURRENT", "current", Current, "unit not verified"),
    rule(E, "POWER", "", Power, ""),
    rule(E, "LOAD", "", Percent, ""),
    rule(T, "SetPos", "position_setpoint", Position, ""),
    rule(T, "ActPos", "position_measured", Position, "").encoder_zero(),
    rule(T, "PosDiff", "following_error", Position, ""),
    rule(T, "SetVelo", "velocity_setpoint", Velocity, ""),
    rule(T, "ActVelo", "velocity_actual", Velocity, ""),
    rule(T, "SetAcc", "acceleration_setpoint", Acceleration, ""),
    rule(H, "motor-pos-cmd", "position_setpoint", Position, "with backlash and screw compensation"),
    rule(H, "pos-cmd", "position_setpoint", Position, ""),
    rule(H, "motor-pos-fb", "position_measured", Position, "").encoder_zero(),
    rule(H, "pos-fb", "position_measured", Position, "").encoder_zero(),
    rule(H, "f-error", "following_error", Position, ""),
    rule(H, "vel-cmd", "velocity_setpoint", Velocity, ""),
    rule(H, "acc-cmd", "acceleration_setpoint", Acceleration, ""),
];

/// The rule for a name without path, width and axis. Halsampler shares the rules of halscope.
pub fn rule_for(format: TraceFormat, controller: &str) -> Option<&'static Rule> {
    let format = if format == TraceFormat::Halsampler { TraceFormat::Halscope } else { format };
    SIGNAL_MAP.iter().find(|rule| rule.format == format && rule.controller == controller)
}
