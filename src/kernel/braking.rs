//! After the alarm of a drive: the axes brake, and what they do is recorded.
//!
//! In: a kernel whose last cycle raised an alarm. Out: one t_s after another, until all axes stand. As on the control every axis goes over to speed control, and
//! its speed set-point goes from what it was to 0 along a ramp (MD36610); the position set-point stays where the alarm caught it. The spindle
//! goes to rest with its own acceleration; how far it gets is recorded as long as an axis moves. The figures of the run do not count it. Does not raise further alarms; an axis that has diverged cannot brake.

use super::cycle::{AxisRow, CycleOutput, Kernel};
use super::preparation::PieceSource;
use crate::base::{PerAxis, Tick};
use crate::drive::DriveInput;
use crate::interpolator::{AxisSetpoint, SpindleSetpoint};

/// After the longest ramp an axis has so many times its length to come to rest.
const RAMPS_MAX: f64 = 4.0;

/// An axis that is slower, as a share of its highest velocity, stands.
const REST_SHARE: f64 = 1e-6;

/// How far the braking is.
#[derive(Clone, Debug)]
pub struct Braking {
    setpoints: PerAxis<AxisSetpoint>,
    spindle: SpindleSetpoint,
    /// What its speed loses each second; `None`: it stands at once.
    spindle_rad_s2: Option<f64>,
    /// First position tick that is still to be stepped.
    next: Tick,
    end: Tick,
}

impl<S: PieceSource> Kernel<S> {
    /// Begins to brake; `None` where nothing has been stepped yet, or an axis has diverged.
    pub fn brake(&mut self) -> Option<Braking> {
        let (setpoint, last) = (self.output().setpoint?, *self.output().rows.last()?);
        if !self.drives_mut().iter().all(|drive| drive.is_finite()) {
            return None;
        }
        let machine = self.machine().clone();
        let commands = PerAxis::from_fn(|axis| {
            let row = self.output().rows.iter().rev().find(|row| row.axis == axis);
            row.map_or(0.0, |row| row.signals.velocity_command_lu_s)
        });
        let held = |axis| {
            let row = self.output().rows.iter().rev().find(|row| row.axis == axis);
            let position_lu = row.map_or(setpoint.axes[axis].position_lu, |row| row.setpoint.position_lu);
            AxisSetpoint { position_lu, ..AxisSetpoint::default() }
        };
        let setpoints = PerAxis::from_fn(held);
        let mut longest_s: f64 = 0.0;
        for axis in machine.axis_ids() {
            let Some(drive) = &machine.axis(axis).drive else { continue };
            longest_s = longest_s.max(drive.monitoring.stop_time_s);
            self.drives_mut()[axis.index()].brake(commands[axis], drive.monitoring.stop_time_s);
        }
        let row_ticks = self.row_ticks();
        let cycles = (RAMPS_MAX * longest_s / machine.cycle.time_base.seconds(row_ticks)).ceil() as u64;
        let next = Tick(last.tick.0 + row_ticks);
        Some(Braking {
            setpoints,
            spindle: setpoint.spindle,
            spindle_rad_s2: machine.spindle.map(|spindle| spindle.acceleration_rad_s2),
            next,
            end: Tick(next.0 + cycles.saturating_mul(row_ticks)),
        })
    }

    /// Steps all axes up to the next set-point tick; false: all stand, or the time is up. The output holds the rows, and the spindle at the first of
    /// these ticks.
    pub fn brake_on(&mut self, braking: &mut Braking) -> bool {
        let (machine, row_ticks) = (self.machine().clone(), self.row_ticks());
        let period = machine.cycle.time_base.ticks_per_setpoint();
        if braking.next.0.is_multiple_of(period) {
            braking.spindle = slower(&braking.spindle, braking.spindle_rad_s2, machine.cycle.time_base.seconds(period));
            self.step_spindle(&braking.spindle);
        }
        let until = (braking.next.0 / period + 1) * period;
        let mut rows: Vec<AxisRow> = std::mem::take(&mut self.output_mut().rows);
        rows.clear();
        let mut stands = true;
        while braking.next.0 < until {
            for axis in machine.axis_ids() {
                if !braking.next.0.is_multiple_of(self.position_ticks(axis)) {
                    continue;
                }
                let setpoint = braking.setpoints[axis];
                let input =
                    DriveInput { position_setpoint_lu: setpoint.position_lu, load_n_m: 0.0, feedforward_active: false };
                let signals = self.drives_mut()[axis.index()].step(input);
                let fastest_lu_s = machine.axis(axis).limits.velocity_max_lu_s;
                stands &= signals.velocity_command_lu_s == 0.0
                    && signals.velocity_actual_lu_s.abs() <= REST_SHARE * fastest_lu_s;
                rows.push(AxisRow { tick: braking.next, axis, setpoint, signals });
            }
            braking.next = Tick(braking.next.0 + row_ticks);
        }
        let output: &mut CycleOutput = self.output_mut();
        output.rows = rows;
        output.begun.clear();
        !stands && braking.next < braking.end
    }
}

/// A spindle on its way to rest, `time_s` later.
fn slower(spindle: &SpindleSetpoint, rate_rad_s2: Option<f64>, time_s: f64) -> SpindleSetpoint {
    let (speed_rad_s, sense) = (spindle.speed_rad_s.abs(), spindle.speed_rad_s.signum());
    let left_rad_s = rate_rad_s2.map_or(0.0, |rate| (speed_rad_s - rate * time_s).max(0.0));
    // In the cycle in which it comes to rest it takes the way that is left.
    let way_rad = match rate_rad_s2 {
        Some(rate) if left_rad_s == 0.0 => speed_rad_s * speed_rad_s / (2.0 * rate),
        _ => 0.5 * (speed_rad_s + left_rad_s) * time_s,
    };
    SpindleSetpoint {
        angle_rad: spindle.angle_rad + sense * way_rad,
        speed_rad_s: sense * left_rad_s,
        acceleration_rad_s2: if left_rad_s == 0.0 { 0.0 } else { -sense * rate_rad_s2.unwrap_or(0.0) },
    }
}
