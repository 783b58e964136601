//! The plain axis: speed loop, current loop and a rigid plant are all there is between two position cycles.
//!
//! In: a drive and the set-point of a position cycle. Out: the signals and the state that the whole diagram of `axis_drive` would give, to the
//! last bit, without asking in every tick for the boxes that are not there. Most axes are plain; `block` takes several of them at
//! once. Not plain is an axis with a filter around the speed loop, DSC, play, a second mass, a screw error, a coarse motor encoder or gravity
//! that turns.

use super::axis_drive::{AxisDrive, Beginning, DriveInput, Position, Wires};
use super::current_loop::{CurrentLoop, VoltageCommand};
use super::feedforward::Terms;
use super::monitor::View;
use super::plant::{Plant, PlantState};
use super::speed_loop::{SpeedLaw, TorqueCommand};
use super::wire::AxisSignals;

/// What holds in a position cycle.
#[derive(Clone, Copy)]
pub(super) struct Prepared {
    input: DriveInput,
    pub(super) terms: Terms,
    pub(super) position: Position,
    view: View,
    /// Gravity and outside load.
    pub(super) gravity_n_m: f64,
}

/// The inner boxes.
#[derive(Clone, Copy)]
pub(super) struct PlainParts {
    pub(super) cycles: Cycles,
    pub(super) speed_law: SpeedLaw,
    pub(super) current_loop: CurrentLoop,
    pub(super) plant: Plant,
}

/// How the cycles of an axis stand to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cycles {
    /// T_p.
    pub(super) position_period_s: f64,
    /// n_p.
    pub(super) speed_ticks: u32,
    /// n_v.
    pub(super) current_ticks: u32,
}

/// What the inner boxes remember.
#[derive(Clone, Copy, Debug)]
pub(super) struct Memory {
    pub(super) state: PlantState,
    /// Iv.
    pub(super) speed_integral_n_m: f64,
    /// Ii.
    pub(super) current_integral_v: f64,
}

impl AxisDrive {
    /// Nothing between two position cycles but the inner loops and a rigid plant.
    #[inline]
    pub(super) fn is_plain(&self) -> bool {
        self.speed_loop.is_plain()
            && self.motor_encoder.is_ideal()
            && !self.stiffness_control
            && !self.plant.gravity_turns
            && self.second_mass.is_none()
            && self.pitch_error.is_none()
            && self.backlash.is_none()
    }

    /// The inner boxes; `None`: the axis is not plain.
    pub(super) fn plain_parts(&self) -> Option<PlainParts> {
        self.is_plain().then_some(PlainParts {
            cycles: Cycles {
                position_period_s: self.position_period_s,
                speed_ticks: self.speed_ticks,
                current_ticks: self.current_ticks,
            },
            speed_law: self.speed_loop.law,
            current_loop: self.current_loop,
            plant: self.plant,
        })
    }

    /// One position cycle of a plain axis.
    pub(super) fn step_plain(&mut self, input: DriveInput) -> AxisSignals {
        let ready = self.prepare(input);
        let signals = self.first_signals(&ready);
        self.go_alone(&ready);
        signals
    }

    /// The current cycles of a position cycle, and its end.
    pub(super) fn go_alone(&mut self, ready: &Prepared) {
        let (mut speed_law, mut current_loop, plant) = (self.speed_loop.law, self.current_loop, &self.plant);
        let kt = self.speed_loop.torque_constant_n_m_per_a;
        let (mut state, mut current_sum_a) = (self.state, 0.0);
        for _ in 0..self.speed_ticks {
            let error_rad_s = ready.position.command.motor_speed_rad_s - state.speed_rad_s;
            let (torque_n_m, _) = speed_law.step(error_rad_s, error_rad_s, ready.terms.torque_n_m);
            let reference_a = torque_n_m / kt;
            for _ in 0..self.current_ticks {
                let voltage_v = current_loop.step(reference_a - state.current_a).voltage_v;
                current_sum_a += state.current_a;
                state = plant.step(state, voltage_v, ready.gravity_n_m);
            }
        }
        let memory =
            Memory { state, speed_integral_n_m: speed_law.integral_n_m, current_integral_v: current_loop.integral_v };
        self.finish(ready, &memory, current_sum_a);
    }

    /// The beginning of a position cycle.
    #[inline]
    pub(super) fn prepare(&mut self, input: DriveInput) -> Prepared {
        let Beginning { terms, position, view, .. } = self.begin(&input);
        let gravity_n_m = self.plant.gravity_n_m(self.state.angle_rad) + input.load_n_m;
        Prepared { input, terms, position, view, gravity_n_m }
    }

    /// The signals at the first tick: the loops say beforehand what they will command in it.
    #[inline]
    pub(super) fn first_signals(&self, ready: &Prepared) -> AxisSignals {
        let (mut speed_law, mut current_loop) = (self.speed_loop.law, self.current_loop);
        let error_rad_s = ready.position.command.motor_speed_rad_s - self.state.speed_rad_s;
        let (torque_n_m, clamped) = speed_law.step(error_rad_s, error_rad_s, ready.terms.torque_n_m);
        let current_a = torque_n_m / self.speed_loop.torque_constant_n_m_per_a;
        let voltage: VoltageCommand = current_loop.step(current_a - self.state.current_a);
        let Prepared { input, terms, position, view, gravity_n_m } = *ready;
        let torque = TorqueCommand { torque_n_m, current_a, clamped };
        self.signals(&Wires { input, terms, position, view, torque, gravity_n_m, voltage })
    }

    /// What the inner boxes remember.
    #[inline]
    pub(super) fn inner_memory(&self) -> Memory {
        Memory {
            state: self.state,
            speed_integral_n_m: self.speed_loop.law.integral_n_m,
            current_integral_v: self.current_loop.integral_v,
        }
    }

    /// The end of a position cycle.
    #[inline]
    pub(super) fn finish(&mut self, ready: &Prepared, memory: &Memory, current_sum_a: f64) {
        self.state = memory.state;
        self.speed_loop.law.integral_n_m = memory.speed_integral_n_m;
        self.current_loop.integral_v = memory.current_integral_v;
        self.reference_before_lu = ready.terms.reference_lu;
        self.current_mean_a = current_sum_a / f64::from(self.ticks_per_step());
    }
}
