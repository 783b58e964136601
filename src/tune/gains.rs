//! The gains of an axis as numbers that a search can move.
//!
//! In: drive data. Out: [`Gains`], and drive data with other gains. Bounds are those of the contract unless the user has his own.

use super::TuneOptions;
use crate::base::AxisKind;
use crate::base::units::{MS_PER_S, deg_from_rad};
use crate::machine::{Axis, DriveData};

/// A gain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gain {
    /// kvff.
    Velocity,
    /// ktff.
    Torque,
    /// d_pos.
    Delay,
    /// Amplitude of the pulse at a reversal.
    Friction,
    /// Time in which that pulse fades.
    FrictionTime,
}

impl Gain {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Velocity, Self::Torque, Self::Delay, Self::Friction, Self::FrictionTime];

    /// On the command line.
    pub fn word(self) -> &'static str {
        match self {
            Self::Velocity => "velocity",
            Self::Torque => "torque",
            Self::Delay => "delay",
            Self::Friction => "friction",
            Self::FrictionTime => "friction-time",
        }
    }

    /// Its key in the table `drive`.
    pub fn key(self, kind: AxisKind) -> &'static str {
        match (self, kind) {
            (Self::Velocity, _) => "velocity_feedforward",
            (Self::Torque, _) => "torque_feedforward",
            (Self::Delay, _) => "setpoint_delay_ms",
            (Self::Friction, AxisKind::Linear) => "friction_compensation_mm_s",
            (Self::Friction, AxisKind::Rotary) => "friction_compensation_deg_s",
            (Self::FrictionTime, _) => "friction_compensation_time_ms",
        }
    }

    /// Unit of the key.
    pub fn unit(self, kind: AxisKind) -> &'static str {
        match (self, kind) {
            (Self::Velocity | Self::Torque, _) => "",
            (Self::Delay | Self::FrictionTime, _) => "ms",
            (Self::Friction, AxisKind::Linear) => "mm/s",
            (Self::Friction, AxisKind::Rotary) => "deg/s",
        }
    }

    /// From inside to the unit of the key.
    pub(super) fn shown(self, kind: AxisKind, inside: f64) -> f64 {
        match (self, kind) {
            (Self::Velocity | Self::Torque, _) | (Self::Friction, AxisKind::Linear) => inside,
            (Self::Delay | Self::FrictionTime, _) => inside * MS_PER_S,
            (Self::Friction, AxisKind::Rotary) => deg_from_rad(inside),
        }
    }

    /// From the unit of the key to inside.
    pub(super) fn inside(self, kind: AxisKind, shown: f64) -> f64 {
        shown / self.shown(kind, 1.0)
    }

    /// Digits behind the point that are worth writing.
    pub(super) fn rounded(self, kind: AxisKind, inside: f64) -> f64 {
        let steps = self.written_steps();
        self.inside(kind, (self.shown(kind, inside) * steps).round() / steps)
    }

    /// Steps of a written value in one unit of its key: 1e-4 of a weight, 1 µs.
    pub(super) fn written_steps(self) -> f64 {
        if matches!(self, Self::Delay | Self::FrictionTime) { 1e3 } else { 1e4 }
    }

    /// First step of a search; the width of the preference for theory is three of them, of the torque six.
    pub(super) fn step(self, range: [f64; 2]) -> f64 {
        match self {
            Self::Velocity => 0.02,
            Self::Torque => 0.05,
            Self::Delay => 0.2 / MS_PER_S,
            Self::Friction => 0.1 * (range[1] - range[0]),
            Self::FrictionTime => 2.0 / MS_PER_S,
        }
    }
}

/// One value for each gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gains([f64; 5]);

impl Gains {
    pub fn of(data: &DriveData) -> Self {
        Self([
            data.velocity_feedforward_ratio,
            data.torque_feedforward_ratio,
            data.setpoint_delay_s,
            data.options.friction_pulse_lu_s,
            data.options.friction_pulse_time_s,
        ])
    }

    pub fn get(&self, gain: Gain) -> f64 {
        self.0[gain as usize]
    }

    pub fn with(mut self, gain: Gain, inside: f64) -> Self {
        self.0[gain as usize] = inside;
        self
    }

    /// Drive data with these gains.
    pub fn applied(&self, data: &DriveData) -> DriveData {
        let mut data = data.clone();
        let [velocity, torque, delay_s, pulse_lu_s, pulse_time_s] = self.0;
        data.velocity_feedforward_ratio = velocity;
        data.torque_feedforward_ratio = torque;
        data.setpoint_delay_s = delay_s;
        data.options.friction_pulse_lu_s = pulse_lu_s;
        data.options.friction_pulse_time_s = pulse_time_s;
        data
    }

    /// What theory says: weight 1, the inertia of the model, the delay that balances it (models/drive.md section 7.2).
    pub fn of_theory(data: &DriveData, position_cycle_s: f64, speed_cycle_s: f64, wanted: &[Gain]) -> Self {
        let mut gains = Self::of(data);
        let friction_s =
            data.mechanics.viscous_friction_n_m_s_per_rad * data.speed_reset_time_s / data.speed_gain_n_m_s_per_rad;
        let delay_s = position_cycle_s - 0.5 * speed_cycle_s
            + if friction_s.is_finite() { friction_s } else { 0.0 }
            + data.feedforward_delay_s;
        for gain in wanted {
            let value = match gain {
                Gain::Velocity => 1.0,
                Gain::Torque if data.feedforward_inertia_kg_m2 > 0.0 => {
                    data.mechanics.inertia_kg_m2 / data.feedforward_inertia_kg_m2
                }
                Gain::Torque => continue,
                Gain::Delay => delay_s,
                Gain::Friction | Gain::FrictionTime => continue,
            };
            gains = gains.with(*gain, value);
        }
        gains
    }
}

/// Lower and upper bound of a gain, inside. The delay of theory is about one position cycle and what the feed-forward waits.
pub(super) fn range(
    options: &TuneOptions,
    gain: Gain,
    axis: &Axis,
    data: &DriveData,
    position_cycle_s: f64,
) -> [f64; 2] {
    if let Some((_, bounds)) = options.bounds.iter().find(|(bounded, _)| *bounded == gain) {
        return bounds.map(|bound| gain.inside(axis.kind, bound));
    }
    match gain {
        Gain::Velocity => [0.5, 1.5],
        Gain::Torque => [0.0, 2.0],
        Gain::Delay => [0.0, (4.0 / MS_PER_S).max(2.0 * (position_cycle_s + data.feedforward_delay_s))],
        Gain::FrictionTime => [1.0 / MS_PER_S, 50.0 / MS_PER_S],
        // The speed that the speed controller lacks while it integrates from -Tc to Tc, twice over.
        Gain::Friction => {
            let mechanics = &data.mechanics;
            let lack_rad_s = 2.0 * mechanics.breakaway_friction_n_m / data.speed_gain_n_m_s_per_rad;
            [0.0, 2.0 * lack_rad_s * mechanics.transmission_lu_per_rad.abs()]
        }
    }
}
