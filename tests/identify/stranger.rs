//! The other plant: a load behind a spring with play, Stribeck friction, and controllers of its own, as tools/identify_reference.py has it.
//!
//! In: the numbers of a plant, a seed for the noise. Out: a trace at 2 ms. Shares nothing with the library but the type of a trace; a test holds it against
//! what the script (numpy) wrote. Controllers as in models/drive.md section 4; the plant by Runge and Kutta in steps of 12.5 us.

use crate::random::Random;
use sollwert::trace::{Clock, Meaning, Signal, TimeGrid, Trace};
use std::f64::consts::TAU;

/// The plant.
#[derive(Clone, Copy, Debug)]
pub struct Stranger {
    pub inertia: f64,
    pub viscous: f64,
    pub coulomb: f64,
    /// Friction at rest above Coulomb's, as a share of it, and the speed at which it goes.
    pub over: f64,
    pub stribeck: f64,
    /// Behind the spring.
    pub load: f64,
    pub stiffness: f64,
    pub damping: f64,
    pub play: f64,
}

/// The cases of the script.
pub const MILD: Stranger = Stranger {
    inertia: 0.0135,
    viscous: 0.012,
    coulomb: 1.6,
    over: 0.10,
    stribeck: 2.0,
    load: 0.0050,
    stiffness: 2500.0,
    damping: 0.35,
    play: 0.0003,
};
pub const STRONG: Stranger =
    Stranger { over: 0.80, stribeck: 25.0, load: 0.0070, stiffness: 350.0, damping: 0.20, play: 0.004, ..MILD };

const CYCLE: f64 = 2e-3;
const SPEED_CYCLES: usize = 16;
const SPEED_CYCLE: f64 = 125e-6;
const SUB_STEPS: usize = 10;
const PER_RAD: f64 = 20.0 / TAU;
const TORQUE_CONSTANT: f64 = 1.40;
const BACK_EMF: f64 = 0.47;
const RESISTANCE: f64 = 0.42;
const INDUCTANCE: f64 = 4.0e-3;
const POSITION_GAIN: f64 = 50.0;
const SPEED: (f64, f64) = (3.0, 0.012);
const CURRENT: (f64, f64) = (9.0, 2e-3);
const VOLTAGE_MAX: f64 = 245.0;
const CURRENT_MAX: f64 = 40.0;

/// Current of the motor, speed and angle of the motor, speed and angle of the load.
type State = [f64; 5];

impl Stranger {
    fn friction(&self, speed: f64) -> f64 {
        let over = 1.0 + self.over * (-(speed / self.stribeck).powi(2)).exp();
        (speed / 0.02).tanh() * self.coulomb * over + self.viscous * speed
    }

    fn slope(&self, [current, motor, motor_at, load, load_at]: State, voltage: f64) -> State {
        let twist = motor_at - load_at;
        let beyond = if twist.abs() > self.play / 2.0 { Some(twist - (self.play / 2.0).copysign(twist)) } else { None };
        let spring = beyond.map_or(0.0, |beyond| self.stiffness * beyond + self.damping * (motor - load));
        [
            (voltage - RESISTANCE * current - BACK_EMF * motor) / INDUCTANCE,
            (TORQUE_CONSTANT * current - spring) / (self.inertia - self.load),
            motor,
            (spring - self.friction(load)) / self.load,
            load,
        ]
    }

    fn step(&self, state: State, voltage: f64, h: f64) -> State {
        let at = |slope: &State, h: f64| std::array::from_fn(|k| state[k] + h * slope[k]);
        let k1 = self.slope(state, voltage);
        let k2 = self.slope(at(&k1, h / 2.0), voltage);
        let k3 = self.slope(at(&k2, h / 2.0), voltage);
        let k4 = self.slope(at(&k3, h), voltage);
        std::array::from_fn(|k| state[k] + h / 6.0 * (k1[k] + 2.0 * k2[k] + 2.0 * k3[k] + k4[k]))
    }

    /// Measured position and mean current at the ticks.
    fn run(&self, setpoints: &[f64]) -> Vec<(f64, f64)> {
        let mut state = [0.0; 5];
        let (mut of_speed, mut of_current, mut before, mut mean) = (0.0, 0.0, setpoints[0], 0.0);
        let mut rows = Vec::new();
        for (k, setpoint) in setpoints.iter().enumerate() {
            let measured = (PER_RAD * state[4] / 1e-3 + 0.5).floor() * 1e-3;
            // The balancing delay is one cycle.
            let deviation = setpoints[k.saturating_sub(1)] - measured;
            let wanted = (POSITION_GAIN * deviation + (setpoint - before) / CYCLE) / PER_RAD;
            before = *setpoint;
            rows.push((measured, mean));
            let mut total = 0.0;
            for _ in 0..SPEED_CYCLES {
                let off = wanted - state[1];
                let more = SPEED.0 * SPEED_CYCLE / SPEED.1 * off;
                let asked = SPEED.0 * off + of_speed + more;
                let torque = asked.clamp(-TORQUE_CONSTANT * CURRENT_MAX, TORQUE_CONSTANT * CURRENT_MAX);
                if torque == asked || off * asked < 0.0 {
                    of_speed += more;
                }
                let off = torque / TORQUE_CONSTANT - state[0];
                let more = CURRENT.0 * SPEED_CYCLE / CURRENT.1 * off;
                let asked = CURRENT.0 * off + of_current + more;
                let voltage = asked.clamp(-VOLTAGE_MAX, VOLTAGE_MAX);
                if voltage == asked || off * asked < 0.0 {
                    of_current += more;
                }
                total += state[0];
                for _ in 0..SUB_STEPS {
                    state = self.step(state, voltage, SPEED_CYCLE / SUB_STEPS as f64);
                }
            }
            mean = total / SPEED_CYCLES as f64;
        }
        rows
    }

    /// Its trace, with 0.05 A of noise and 0.02 A of quantum on the current; without for `None`.
    pub fn trace(&self, setpoints: &[f64], seed: Option<u64>) -> Trace {
        let mut random = Random::new(seed.unwrap_or(0));
        let mut normal = move || (-2.0 * random.unit().max(1e-300).ln()).sqrt() * (TAU * random.unit()).cos();
        let rows = self.run(setpoints);
        let noisy = |exact: f64| match seed {
            Some(_) => ((exact + 0.05 * normal()) / 0.02).round() * 0.02,
            None => exact,
        };
        let current = rows.iter().map(|row| row.1).map(noisy).collect();
        as_trace([setpoints.to_vec(), rows.iter().map(|row| row.0).collect(), current])
    }
}

/// Set-point, measured position and mean current of X.
pub fn as_trace(columns: [Vec<f64>; 3]) -> Trace {
    let names = ["X.position_setpoint_mm", "X.position_measured_mm", "X.current_mean_a"];
    let signal = |(name, values): (&str, Vec<f64>)| Signal {
        name: Some(name.to_owned()),
        original: name.to_owned(),
        unit: String::new(),
        clock: Clock::Servo,
        times: TimeGrid::Uniform { start_ns: 0.0, step_ns: CYCLE * 1e9, count: values.len() },
        values,
        labels: Vec::new(),
        discrete: false,
        meaning: Meaning::default(),
    };
    Trace {
        name: "stranger".to_owned(),
        signals: names.into_iter().zip(columns).map(signal).collect(),
        ..Trace::default()
    }
}
