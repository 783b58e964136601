//! The plain axis: speed loop, current loop and a rigid plant are all there is between two position cycles.
//!
//! In: a drive and the set-point of a position cycle. Out: the signals and the state that the whole diagram of `axis_drive` would give, to the
//! last bit, without asking in every tick for the boxes that are not there. Most axes are plain; `block` takes several of them at
//! once. Not plain is an axis with a filter around the speed loop, DSC, play, a second mass, a screw error, a coarse motor encoder or gravity
//! that turns, and one that brakes after an alarm.

use super::axis_drive::{AxisDrive, Beginning, DriveInput, Wires};
use super::current_loop::{CurrentLoop, VoltageCommand};
use super::plant::{Plant, PlantState};
use super::speed_loop::{SpeedLaw, TorqueCommand};
use super::wire::AxisSignals;

/// The inner boxes with what they remember, for the current cycles of one position cycle.
pub(super) struct Inner<'a> {
    pub(super) cycles: Cycles,
    pub(super) speed_law: SpeedLaw,
    pub(super) current_loop: CurrentLoop,
    pub(super) plant: &'a Plant,
}

/// What the inner boxes get, held for a position cycle.
#[derive(Clone, Copy)]
pub(super) struct Held {
    /// w_ref.
    pub(super) speed_reference_rad_s: f64,
    /// t_ff.
    pub(super) torque_feedforward_n_m: f64,
    /// Gravity and outside load.
    pub(super) gravity_n_m: f64,
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

/// What the inner boxes remember, and what they have seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Memory {
    pub(super) state: PlantState,
    /// Iv.
    pub(super) speed_integral_n_m: f64,
    /// Ii.
    pub(super) current_integral_v: f64,
    /// Of all current cycles of the position cycle.
    pub(super) current_sum_a: f64,
}

impl Cycles {
    /// Current cycles in a position cycle.
    pub(super) fn ticks(&self) -> u32 {
        self.speed_ticks * self.current_ticks
    }
}

impl Memory {
    /// See [`AxisDrive::is_finite`].
    #[inline]
    pub(super) fn is_finite(&self) -> bool {
        let PlantState { current_a, speed_rad_s, angle_rad } = self.state;
        let integrals = [self.speed_integral_n_m, self.current_integral_v];
        [current_a, speed_rad_s, angle_rad].iter().chain(&integrals).all(|value| value.is_finite())
    }
}

impl Inner<'_> {
    /// All current cycles of a position cycle, from `state`.
    #[inline(always)]
    pub(super) fn run(self, mut state: PlantState, held: Held) -> Memory {
        let Self { cycles, mut speed_law, mut current_loop, plant } = self;
        let kt = plant.motor.torque_constant_n_m_per_a;
        let mut current_sum_a = 0.0;
        for _ in 0..cycles.speed_ticks {
            let error_rad_s = held.speed_reference_rad_s - state.speed_rad_s;
            let (torque_n_m, _) = speed_law.step(error_rad_s, error_rad_s, held.torque_feedforward_n_m);
            let reference_a = torque_n_m / kt;
            for _ in 0..cycles.current_ticks {
                let voltage_v = current_loop.step(reference_a - state.current_a).voltage_v;
                current_sum_a += state.current_a;
                state = plant.step(state, voltage_v, held.gravity_n_m);
            }
        }
        Memory {
            state,
            speed_integral_n_m: speed_law.integral_n_m,
            current_integral_v: current_loop.integral_v,
            current_sum_a,
        }
    }
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
            && self.position_loop.braking.is_none()
    }

    /// How its cycles stand to each other.
    #[inline]
    pub(super) fn cycles(&self) -> Cycles {
        Cycles {
            position_period_s: self.position_period_s,
            speed_ticks: self.speed_ticks,
            current_ticks: self.current_ticks,
        }
    }

    /// One position cycle of a plain axis.
    pub(super) fn step_plain(&mut self, input: DriveInput) -> AxisSignals {
        let Beginning { terms, position, view, .. } = self.begin(&input);
        let gravity_n_m = self.plant.gravity_n_m(self.state.angle_rad) + input.load_n_m;
        let held = Held {
            speed_reference_rad_s: position.command.motor_speed_rad_s,
            torque_feedforward_n_m: terms.torque_n_m,
            gravity_n_m,
        };

        // The signals at the first tick: the loops say beforehand what they will command in it.
        let (mut speed_law, mut current_loop) = (self.speed_loop.law, self.current_loop);
        let error_rad_s = held.speed_reference_rad_s - self.state.speed_rad_s;
        let (torque_n_m, clamped) = speed_law.step(error_rad_s, error_rad_s, terms.torque_n_m);
        let current_a = torque_n_m / self.speed_loop.torque_constant_n_m_per_a;
        let voltage: VoltageCommand = current_loop.step(current_a - self.state.current_a);
        let torque = TorqueCommand { torque_n_m, current_a, clamped };
        let signals = self.signals(&Wires { input, terms, position, view, torque, gravity_n_m, voltage });

        let inner = Inner {
            cycles: self.cycles(),
            speed_law: self.speed_loop.law,
            current_loop: self.current_loop,
            plant: &self.plant,
        };
        let memory = inner.run(self.state, held);
        self.remember(&memory);
        self.reference_before_lu = terms.reference_lu;
        signals
    }

    /// What the inner boxes remember.
    pub(super) fn memory(&self) -> Memory {
        Memory {
            state: self.state,
            speed_integral_n_m: self.speed_loop.law.integral_n_m,
            current_integral_v: self.current_loop.integral_v,
            current_sum_a: 0.0,
        }
    }

    /// The end of a position cycle.
    #[inline]
    pub(super) fn remember(&mut self, memory: &Memory) {
        self.state = memory.state;
        self.speed_loop.law.integral_n_m = memory.speed_integral_n_m;
        self.current_loop.integral_v = memory.current_integral_v;
        self.current_mean_a = memory.current_sum_a / f64::from(self.ticks_per_step());
    }
}
