//! The other plant: a load behind a spring with play, Stribeck friction, and controllers of its own, as tools/identify_reference.py has it.
//!
//! In: the numbers of a plant and of its controllers, a seed for the noise. Out: a trace at 2 ms, or at the speed cycle. Shares nothing with the library but the
//! type of a trace; a test holds it against what the script (numpy) wrote. Controllers as in models/drive.md section 4; the plant by Runge and Kutta in steps
//! of 12.5 us.

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
    /// A constant torque on the load; none in the script.
    pub gravity: f64,
}

/// What a machine file says of the controllers.
#[derive(Clone, Copy, Debug)]
pub struct Control {
    pub position_gain: f64,
    pub velocity_feedforward: f64,
    /// Balancing delay of the set-point.
    pub delay_s: f64,
    pub speed_gain: f64,
    pub speed_reset_s: f64,
}

/// Those of the script.
pub const CONTROL: Control =
    Control { position_gain: 50.0, velocity_feedforward: 1.0, delay_s: CYCLE, speed_gain: 3.0, speed_reset_s: 0.012 };

/// What can be traced at a tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Row {
    pub setpoint: f64,
    pub measured: f64,
    pub deviation: f64,
    pub feedforward: f64,
    pub command: f64,
    pub mean: f64,
    pub current: f64,
    pub speed_wanted: f64,
    pub speed: f64,
    pub torque: f64,
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
    gravity: 0.0,
};
pub const STRONG: Stranger =
    Stranger { over: 0.80, stribeck: 25.0, load: 0.0070, stiffness: 350.0, damping: 0.20, play: 0.004, ..MILD };

pub const CYCLE: f64 = 2e-3;
const SPEED_CYCLES: usize = 16;
pub const SPEED_CYCLE: f64 = 125e-6;
const SUB_STEPS: usize = 10;
const PER_RAD: f64 = 20.0 / TAU;
const TORQUE_CONSTANT: f64 = 1.40;
const BACK_EMF: f64 = 0.47;
const RESISTANCE: f64 = 0.42;
const INDUCTANCE: f64 = 4.0e-3;
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
            (spring - self.friction(load) - self.gravity) / self.load,
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

    /// From rest, with whatever holds the load there in the integrals; each row of a position tick, and to `fast` each one of a speed tick.
    pub fn run(&self, control: &Control, setpoints: &[f64], mut fast: impl FnMut(&Row)) -> Vec<Row> {
        let held = self.gravity / TORQUE_CONSTANT;
        let wound = self.gravity / self.stiffness + (self.play / 2.0).copysign(self.gravity);
        let mut state = [held, 0.0, if self.gravity == 0.0 { 0.0 } else { wound }, 0.0, 0.0];
        let (mut of_speed, mut of_current, mut mean) = (self.gravity, RESISTANCE * held, 0.0);
        let (whole, share) = ((control.delay_s / CYCLE) as usize, (control.delay_s / CYCLE).fract());
        let at = |k: usize, back: usize| setpoints[k.saturating_sub(back)] - setpoints[0];
        let mut rows = Vec::new();
        for (k, setpoint) in setpoints.iter().enumerate() {
            let measured = (PER_RAD * state[4] / 1e-3 + 0.5).floor() * 1e-3;
            let deviation = (1.0 - share) * at(k, whole) + share * at(k, whole + 1) - measured;
            let feedforward = control.velocity_feedforward * (at(k, 0) - at(k, 1)) / CYCLE;
            let command = control.position_gain * deviation + feedforward;
            let wanted = command / PER_RAD;
            let mut row = Row {
                setpoint: *setpoint,
                measured: setpoints[0] + measured,
                deviation,
                feedforward,
                command,
                mean,
                current: state[0],
                speed_wanted: wanted,
                ..Row::default()
            };
            rows.push(row);
            let mut total = 0.0;
            for _ in 0..SPEED_CYCLES {
                let off = wanted - state[1];
                let more = control.speed_gain * SPEED_CYCLE / control.speed_reset_s * off;
                let asked = control.speed_gain * off + of_speed + more;
                let torque = asked.clamp(-TORQUE_CONSTANT * CURRENT_MAX, TORQUE_CONSTANT * CURRENT_MAX);
                if torque == asked || off * asked < 0.0 {
                    of_speed += more;
                }
                (row.speed, row.torque, row.current) = (state[1], torque, state[0]);
                fast(&row);
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
        self.recorded(&CONTROL, setpoints, &["position_setpoint", "position_measured", "current_mean"], seed)
    }

    /// The same under other controllers, in some signals.
    pub fn recorded(&self, control: &Control, setpoints: &[f64], stems: &[&str], seed: Option<u64>) -> Trace {
        of_rows(&self.run(control, setpoints, |_| {}), CYCLE, stems, seed)
    }

    /// The same at the speed cycle.
    pub fn recorded_fast(&self, control: &Control, setpoints: &[f64], stems: &[&str]) -> Trace {
        let mut rows = Vec::new();
        self.run(control, setpoints, |row| rows.push(*row));
        of_rows(&rows, SPEED_CYCLE, stems, None)
    }
}

/// A trace of X.
fn of_rows(rows: &[Row], period_s: f64, stems: &[&str], seed: Option<u64>) -> Trace {
    let mut random = Random::new(seed.unwrap_or(0));
    let mut normal = move || (-2.0 * random.unit().max(1e-300).ln()).sqrt() * (TAU * random.unit()).cos();
    let mut noisy = |exact: f64| match seed {
        Some(_) => ((exact + 0.05 * normal()) / 0.02).round() * 0.02,
        None => exact,
    };
    let mut signals = Vec::new();
    for stem in stems {
        let (unit, values): (&str, Vec<f64>) = match *stem {
            "position_setpoint" => ("_mm", rows.iter().map(|row| row.setpoint).collect()),
            "position_measured" => ("_mm", rows.iter().map(|row| row.measured).collect()),
            "control_deviation" => ("_mm", rows.iter().map(|row| row.deviation).collect()),
            "velocity_feedforward" => ("_mm_s", rows.iter().map(|row| row.feedforward).collect()),
            "velocity_command" => ("_mm_s", rows.iter().map(|row| row.command).collect()),
            "motor_speed_reference" => ("_rad_s", rows.iter().map(|row| row.speed_wanted).collect()),
            "motor_speed" => ("_rad_s", rows.iter().map(|row| row.speed).collect()),
            "torque_reference" => ("_n_m", rows.iter().map(|row| row.torque).collect()),
            "current_mean" => ("_a", rows.iter().map(|row| noisy(row.mean)).collect()),
            "current" => ("_a", rows.iter().map(|row| noisy(row.current)).collect()),
            other => panic!("no signal {other}"),
        };
        signals.push(signal(format!("X.{stem}{unit}"), period_s, values));
    }
    Trace { name: "stranger".to_owned(), signals, ..Trace::default() }
}

fn signal(name: String, period_s: f64, values: Vec<f64>) -> Signal {
    Signal {
        name: Some(name.clone()),
        original: name,
        unit: String::new(),
        clock: Clock::Servo,
        times: TimeGrid::Uniform { start_ns: 0.0, step_ns: period_s * 1e9, count: values.len() },
        values,
        labels: Vec::new(),
        discrete: false,
        meaning: Meaning::default(),
    }
}

/// Set-point, measured position and mean current of X.
pub fn as_trace(columns: [Vec<f64>; 3]) -> Trace {
    let names = ["X.position_setpoint_mm", "X.position_measured_mm", "X.current_mean_a"];
    let signals = names.into_iter().zip(columns).map(|(name, values)| signal(name.to_owned(), CYCLE, values)).collect();
    Trace { name: "stranger".to_owned(), signals, ..Trace::default() }
}
