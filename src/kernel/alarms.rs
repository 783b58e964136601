//! The alarms of a drive: what its signals say, and what a person reads.
//!
//! In: the row of an axis at a position tick. Out: the alarm that ends the run, with the number that the control gives it. A `follow`
//! runs on with a warning: what its drives are given may well be what no control would. Does not stop the axes: `braking` does.

use super::cycle::AxisRow;
use super::in_position::{Apart, WAITS_MAX};
use crate::base::{AxisId, AxisKind, Diagnostic, Tick, units};
use crate::drive::monitoring;
use crate::interpreter::ExactStop;
use crate::machine::Machine;

/// What the control would stop for, if anything: the first of contour, speed-limit, positioning and standstill monitoring.
pub(super) fn monitored(machine: &Machine, line: Option<u32>, row: &AxisRow) -> Option<Diagnostic> {
    let AxisRow { tick, axis, signals, .. } = *row;
    let seen = signals.monitoring
        & (monitoring::CONTOUR | monitoring::POSITIONING | monitoring::STANDSTILL | monitoring::SPEED_LIMIT);
    let drive = machine.axis(axis).drive.as_ref().filter(|_| seen != 0)?;
    let name = &machine.axis(axis).name;
    let line = line.map_or(String::new(), |line| format!(", line {line}"));
    let unit = if machine.axis(axis).kind == AxisKind::Linear { "um" } else { "deg" };
    let shown = |value_lu: f64| length(machine.axis(axis).kind, value_lu);
    let time_s = machine.cycle.time_base.time_s(tick);
    let away = shown((signals.position_setpoint_lu - signals.position_measured_lu).abs());
    let (code, message, help) = if seen & monitoring::CONTOUR != 0 {
        let (off, allowed) = (shown(signals.contour_deviation_lu.abs()), shown(drive.monitoring.contour_lu));
        let message = format!(
            "axis {name} at {time_s:.4} s{line}: contour monitoring, {off} from where the control's model of the axis is, more than {allowed} \
             (alarm 25050, MD36400)"
        );
        let help = format!(
            "the drive saturates, sticks or is unstable: see `flags` and `contour_deviation` of the recording; lower the acceleration or \
             the gains, or give axes.{name}.drive.contour_monitoring_{unit}"
        );
        ("D0004", message, help)
    } else if seen & monitoring::SPEED_LIMIT != 0 {
        let (time_s_max, key) = (drive.monitoring.speed_limit_time_s, if unit == "um" { "mm_s" } else { "deg_s" });
        let message = format!(
            "axis {name} at {time_s:.4} s{line}: speed set-point at its limit for longer than {time_s_max} s (alarm 25060, MD36210, MD36220)"
        );
        let help = format!(
            "the axis is asked for more than its drive turns: see axes.{name}.drive.speed_setpoint_max_{key} and speed_limit_time_ms"
        );
        ("D0008", message, help)
    } else if seen & monitoring::POSITIONING != 0 {
        let (window, within_s) = (shown(drive.in_position_fine_lu), drive.monitoring.positioning_time_s);
        let message = format!(
            "axis {name} at {time_s:.4} s{line}: positioning monitoring, still {away} from its set-point and not within {window} after {within_s} s \
             (alarm 25080, MD36020, MD36010)"
        );
        let help = format!(
            "friction or a load holds it off, or the loop is too weak: see axes.{name}.drive.speed_reset_time_ms, in_position_fine_{unit} \
             and positioning_time_ms"
        );
        ("D0005", message, help)
    } else {
        let allowed = shown(drive.monitoring.standstill_lu);
        let message = format!(
            "axis {name} at {time_s:.4} s{line}: standstill monitoring, {away} from its set-point at rest, more than {allowed} (alarm 25040, MD36030)"
        );
        let help =
            format!("a load moves it, or it swings: see axes.{name}.drive.standstill_{unit} and standstill_delay_ms");
        ("D0006", message, help)
    };
    Some(Diagnostic::error(code, message).help(help))
}

/// The alarm of an axis that has left the place where it was clamped.
pub(super) fn unclamped(machine: &Machine, line: u32, row: &AxisRow, away_lu: f64) -> Diagnostic {
    let axis = machine.axis(row.axis);
    let unit = if axis.kind == AxisKind::Linear { "um" } else { "deg" };
    let allowed = axis.drive.as_ref().map_or(0.0, |drive| drive.monitoring.clamping_lu);
    let (name, time_s) = (&axis.name, machine.cycle.time_base.time_s(row.tick));
    let message = format!(
        "axis {name} at {time_s:.4} s, line {line}: clamping monitoring, {} from where it was clamped, more than {} (alarm 26000, MD36050)",
        length(axis.kind, away_lu),
        length(axis.kind, allowed)
    );
    let help =
        format!("release the axis before it moves, or look for what pushes it: see axes.{name}.drive.clamping_{unit}");
    Diagnostic::error("D0007", message).help(help)
}

/// The alarm of a block end whose axes have been in position in turn, but never all at once.
pub(super) fn never_together(machine: &Machine, line: u32, tick: Tick, apart: &Apart) -> Diagnostic {
    let Apart { waited_s, window, left, outside } = apart;
    let unsettled: Vec<AxisId> = machine.axis_ids().filter(|axis| left[*axis] > 0 || outside[*axis]).collect();
    let said = |axis: &AxisId| {
        let (name, now) = (&machine.axis(*axis).name, if outside[*axis] { ", is outside now" } else { "" });
        format!("{name} has left its window {} times{now}", left[*axis])
    };
    let (word, key) = match window {
        ExactStop::Coarse => ("coarse", "in_position_coarse"),
        ExactStop::Fine | ExactStop::Setpoint => ("fine", "in_position_fine"),
    };
    let list = unsettled.iter().map(said).collect::<Vec<String>>().join("; ");
    let names = unsettled.iter().map(|axis| machine.axis(*axis).name.as_str()).collect::<Vec<&str>>().join(", ");
    let time_s = machine.cycle.time_base.time_s(tick);
    let message = format!(
        "axes {names} at {time_s:.4} s, line {line}: the block end has waited for {waited_s:.1} s, and the axes were never in position ({word}) at the same \
         time: {list}"
    );
    let keys = unsettled.iter().map(|axis| {
        let unit = if machine.axis(*axis).kind == AxisKind::Linear { "um" } else { "deg" };
        format!("axes.{}.drive.{key}_{unit}", machine.axis(*axis).name)
    });
    let keys = keys.collect::<Vec<String>>().join(", ");
    let help = format!(
        "a control would wait on; here a block end waits for {WAITS_MAX} times the longest positioning_time_ms (MD36020), at most an hour. Axes hunt where \
         the breakaway friction is above the Coulomb friction and the integral part strong, and swing where the gains are high: widen {keys}, lower \
         position_gain_per_s, lengthen speed_reset_time_ms, or let the block end with its set-point (G603, G64)"
    );
    Diagnostic::error("D0009", message).help(help)
}

/// The alarm of a drive whose state is no longer finite.
pub(super) fn diverged(machine: &Machine, axis: AxisId, tick: Tick) -> Diagnostic {
    let name = &machine.axis(axis).name;
    let time_s = machine.cycle.time_base.time_s(tick);
    Diagnostic::error(
        "D0001",
        format!("axis {name} has left all bounds at {time_s:.4} s: its control loop is unstable"),
    )
    .help(format!("lower axes.{name}.drive.speed_gain_n_m_s_per_rad, current_gain_v_per_a or position_gain_per_s"))
}

/// A length of an axis for people.
fn length(kind: AxisKind, value_lu: f64) -> String {
    let (shown, unit) = match kind {
        AxisKind::Linear => (value_lu, "mm"),
        AxisKind::Rotary => (units::deg_from_rad(value_lu), "deg"),
    };
    // Longer is no place of a machine: an axis that diverges is told in powers of ten.
    if shown.abs() < 1e6 { format!("{shown:.4} {unit}") } else { format!("{shown:.1e} {unit}") }
}
