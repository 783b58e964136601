//! The discrete model of an axis' loops as matrices: the drive's own boxes, with everything taken out that is not linear.
//!
//! In: drive data and clock. Out: [`StateSpace`] of an open or closed loop at the rate of that loop, x\[k+1\] = A x\[k\] + B u\[k\],
//! y\[k\] = C x\[k\] + D u\[k\]. The column of A that belongs to a memory is what one cycle of the boxes makes of a one in it: no law is
//! written a second time, and nothing is simulated beyond one cycle.
//!
//! A slower loop holds its output over whole cycles of the faster one, and every loop measures at its own instants. So each loop is
//! linear and time-invariant *at its own rate* (the lifted system, looked at where the loop samples): no alias term is dropped, what
//! the faster rates do in between is inside A and B.
//!
//! Left out: dry friction and stick, gravity, limits of speed, torque, current and voltage with their anti-windup, quanta of the
//! encoders, play, errors of the screw, friction pulse, backlash and screw compensation.

use super::current_loop::CurrentLoop;
use super::plant::{Plant, PlantState};
use super::second_mass::{TwoMass, TwoMassState};
use super::speed_loop::SpeedLoop;
use crate::base::TimeBase;
use crate::machine::{DriveData, ErrorTable, PositionSource};
use nalgebra::DMatrix;

/// A discrete linear system with scalar signals in the units of the wires.
#[derive(Clone, Debug)]
pub(super) struct StateSpace {
    pub(super) a: DMatrix<f64>,
    pub(super) b: DMatrix<f64>,
    pub(super) c: DMatrix<f64>,
    pub(super) d: DMatrix<f64>,
}

/// Motor, mechanics and the two inner controllers.
#[derive(Clone, Debug)]
struct Boxes {
    speed_loop: SpeedLoop,
    current_loop: CurrentLoop,
    motion: Motion,
}

#[derive(Clone, Debug)]
enum Motion {
    Rigid(Plant, PlantState),
    TwoMass(Box<TwoMass>, TwoMassState),
}

/// Which memories belong to a loop. Below the position loop nobody asks where the axis is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    Current,
    Speed,
    Position,
}

/// The axis without what is not linear.
#[derive(Clone, Debug)]
pub(super) struct LinearModel {
    rest: Boxes,
    gain_per_s: f64,
    transmission_lu_per_rad: f64,
    speed_ticks: u32,
    current_ticks: u32,
    stiffness_control: bool,
    motor_measures: bool,
}

/// What goes into a position cycle, in the order of the columns of B.
pub(super) const POSITION_INPUTS: usize = 5;

impl Boxes {
    fn memory(&mut self, level: Level) -> Vec<&mut f64> {
        let mut list = Vec::new();
        match &mut self.motion {
            Motion::Rigid(_, state) => {
                list.extend([&mut state.current_a, &mut state.speed_rad_s]);
                list.extend((level == Level::Position).then_some(&mut state.angle_rad));
            }
            Motion::TwoMass(_, state) => {
                list.extend([&mut state.current_a, &mut state.motor_speed_rad_s]);
                list.extend([&mut state.twist_rad, &mut state.load_speed_rad_s]);
                list.extend((level == Level::Position).then_some(&mut state.load_angle_rad));
            }
        }
        self.current_loop.memory(&mut list);
        if level >= Level::Speed {
            self.speed_loop.memory(&mut list);
        }
        list
    }

    /// i, w, th of the motor.
    fn motor(&self) -> PlantState {
        match &self.motion {
            Motion::Rigid(_, state) => *state,
            Motion::TwoMass(_, state) => state.motor(),
        }
    }

    fn load_angle_rad(&self) -> f64 {
        match &self.motion {
            Motion::Rigid(_, state) => state.angle_rad,
            Motion::TwoMass(_, state) => state.load_angle_rad,
        }
    }

    fn current_cycle(&mut self, current_error_a: f64, load_n_m: f64) {
        let voltage_v = self.current_loop.step(current_error_a).voltage_v;
        match &mut self.motion {
            Motion::Rigid(plant, state) => *state = plant.step(*state, voltage_v, load_n_m),
            Motion::TwoMass(plant, state) => *state = plant.step(*state, voltage_v, load_n_m),
        }
    }
}

impl LinearModel {
    pub(super) fn new(data: &DriveData, time_base: &TimeBase) -> Self {
        let data = &without_limits(data);
        let speed_period_s = time_base.seconds(data.speed_cycle_ticks);
        let current_period_s = time_base.seconds(data.current_cycle_ticks);
        let motion = match TwoMass::new(data, current_period_s) {
            Some(plant) => {
                let state = plant.held(0.0, 0.0, true);
                Motion::TwoMass(Box::new(plant), state)
            }
            None => {
                let state = PlantState { current_a: 0.0, speed_rad_s: 0.0, angle_rad: 0.0 };
                Motion::Rigid(Plant::new(data, current_period_s), state)
            }
        };
        Self {
            rest: Boxes {
                speed_loop: SpeedLoop::new(data, speed_period_s, 0.0),
                current_loop: CurrentLoop::new(data, current_period_s, 0.0),
                motion,
            },
            gain_per_s: data.position_gain_per_s,
            transmission_lu_per_rad: data.mechanics.transmission_lu_per_rad,
            speed_ticks: (data.position_cycle_ticks / data.speed_cycle_ticks.max(1)) as u32,
            current_ticks: (data.speed_cycle_ticks / data.current_cycle_ticks.max(1)) as u32,
            stiffness_control: data.options.stiffness_control,
            motor_measures: data.encoder.position_source == PositionSource::Motor,
        }
    }

    /// Speed cycles between two samples of the position controller: 1 with DSC.
    fn position_ticks(&self) -> u32 {
        if self.stiffness_control { 1 } else { self.speed_ticks }
    }

    /// From current error to current, at T_i.
    pub(super) fn current_open(&self) -> StateSpace {
        self.probe(Level::Current, 1, |boxes, inputs| {
            let current_a = boxes.motor().current_a;
            boxes.current_cycle(inputs[0], 0.0);
            vec![current_a]
        })
    }

    /// From i_ref to i, at T_i.
    pub(super) fn current_closed(&self) -> StateSpace {
        self.probe(Level::Current, 1, |boxes, inputs| {
            let current_a = boxes.motor().current_a;
            boxes.current_cycle(inputs[0] - current_a, 0.0);
            vec![current_a]
        })
    }

    /// From what is fed back (with its sign turned) to w, at T_v: the loop cut at the measured speed.
    pub(super) fn speed_open(&self) -> StateSpace {
        self.probe(Level::Speed, 1, |boxes, inputs| {
            let speed_rad_s = boxes.motor().speed_rad_s;
            self.speed_cycle(boxes, 0.0, -inputs[0], 0.0, 0.0);
            vec![speed_rad_s]
        })
    }

    /// From w_ref to w, at T_v.
    pub(super) fn speed_closed(&self) -> StateSpace {
        self.probe(Level::Speed, 1, |boxes, inputs| {
            let speed_rad_s = boxes.motor().speed_rad_s;
            self.speed_cycle(boxes, inputs[0], speed_rad_s, 0.0, 0.0);
            vec![speed_rad_s]
        })
    }

    /// From what is fed back (with its sign turned) to x_meas, at the rate of the position controller.
    pub(super) fn position_open(&self) -> StateSpace {
        self.probe(Level::Position, 1, |boxes, inputs| {
            let measured_lu = self.measured_lu(boxes);
            let w_ref_rad_s = self.gain_per_s * inputs[0] / self.transmission_lu_per_rad;
            for _ in 0..self.position_ticks() {
                let speed_rad_s = boxes.motor().speed_rad_s;
                self.speed_cycle(boxes, w_ref_rad_s, speed_rad_s, 0.0, 0.0);
            }
            vec![measured_lu]
        })
    }

    /// From x_ref, x_ref of the cycle before, v_ff, t_ff and outside torque to x, x_meas and e_fol, at T_p.
    pub(super) fn position_closed(&self) -> StateSpace {
        self.probe(Level::Position, POSITION_INPUTS, |boxes, inputs| {
            let &[reference_lu, before_lu, v_ff_lu_s, t_ff_n_m, load_n_m] = inputs else { return Vec::new() };
            let measured_lu = self.measured_lu(boxes);
            let load_lu = self.transmission_lu_per_rad * boxes.load_angle_rad();
            let reference_lu_at = |tick: u32| {
                let left_ratio = f64::from(self.speed_ticks - 1 - tick) / f64::from(self.speed_ticks);
                reference_lu + if self.stiffness_control { left_ratio * (before_lu - reference_lu) } else { 0.0 }
            };
            let command = |reference_lu: f64, measured_lu: f64| {
                (self.gain_per_s * (reference_lu - measured_lu) + v_ff_lu_s) / self.transmission_lu_per_rad
            };
            let deviation_lu = reference_lu_at(0) - measured_lu;
            let mut w_ref_rad_s = command(reference_lu_at(0), measured_lu);
            for tick in 0..self.speed_ticks {
                if self.stiffness_control {
                    w_ref_rad_s = command(reference_lu_at(tick), self.measured_lu(boxes));
                }
                let speed_rad_s = boxes.motor().speed_rad_s;
                self.speed_cycle(boxes, w_ref_rad_s, speed_rad_s, t_ff_n_m, load_n_m);
            }
            vec![load_lu, measured_lu, deviation_lu]
        })
    }

    fn measured_lu(&self, boxes: &Boxes) -> f64 {
        let angle_rad = if self.motor_measures { boxes.motor().angle_rad } else { boxes.load_angle_rad() };
        self.transmission_lu_per_rad * angle_rad
    }

    fn speed_cycle(&self, boxes: &mut Boxes, w_ref_rad_s: f64, w_rad_s: f64, t_ff_n_m: f64, load_n_m: f64) {
        let reference_a = boxes.speed_loop.step(w_ref_rad_s, w_rad_s, t_ff_n_m).current_a;
        for _ in 0..self.current_ticks {
            let current_a = boxes.motor().current_a;
            boxes.current_cycle(reference_a - current_a, load_n_m);
        }
    }

    /// The matrices of `cycle`, which gives the outputs and moves the boxes on: one call for every memory and every input.
    fn probe(&self, level: Level, inputs: usize, cycle: impl Fn(&mut Boxes, &[f64]) -> Vec<f64>) -> StateSpace {
        let column = |memory: Option<usize>, input: Option<usize>| {
            let mut boxes = self.rest.clone();
            if let Some(cell) = memory.and_then(|place| boxes.memory(level).into_iter().nth(place)) {
                *cell = 1.0;
            }
            let given: Vec<f64> = (0..inputs).map(|n| if input == Some(n) { 1.0 } else { 0.0 }).collect();
            let output = cycle(&mut boxes, &given);
            let after: Vec<f64> = boxes.memory(level).into_iter().map(|cell| *cell).collect();
            (after, output)
        };
        let order = self.rest.clone().memory(level).len();
        let by_memory: Vec<_> = (0..order).map(|place| column(Some(place), None)).collect();
        let by_input: Vec<_> = (0..inputs).map(|place| column(None, Some(place))).collect();
        let outputs = by_input.first().map_or(0, |(_, output)| output.len());
        StateSpace {
            a: DMatrix::from_fn(order, order, |row, column| by_memory[column].0[row]),
            b: DMatrix::from_fn(order, inputs, |row, column| by_input[column].0[row]),
            c: DMatrix::from_fn(outputs, order, |row, column| by_memory[column].1[row]),
            d: DMatrix::from_fn(outputs, inputs, |row, column| by_input[column].1[row]),
        }
    }
}

/// The same axis without limits, dry friction, gravity, quanta, play and what works against them.
fn without_limits(data: &DriveData) -> DriveData {
    let none: Option<ErrorTable> = None;
    let mut data = DriveData {
        speed_setpoint_max_lu_s: f64::INFINITY,
        current_max_a: f64::INFINITY,
        voltage_max_v: f64::INFINITY,
        pitch_error: none.clone(),
        encoder_compensation: none,
        ..data.clone()
    };
    data.options.torque_upper_n_m = f64::INFINITY;
    data.options.torque_lower_n_m = f64::NEG_INFINITY;
    data.encoder.position_resolution_lu = 0.0;
    data.encoder.motor_resolution_rad = 0.0;
    let mechanics = &mut data.mechanics;
    (mechanics.coulomb_friction_n_m, mechanics.breakaway_friction_n_m) = (0.0, 0.0);
    (mechanics.gravity_n_m, mechanics.gravity_sin_n_m, mechanics.gravity_cos_n_m) = (0.0, 0.0, 0.0);
    data
}
