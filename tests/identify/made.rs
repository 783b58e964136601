//! Synthetic traces: the drives of the library on a motion, with the noise and the quanta of a real trace put on.

use crate::random::Random;
use sollwert::base::{TimeBase, units::deg_from_rad};
use sollwert::drive::{AxisDrive, AxisSignals, DriveInput, Start};
use sollwert::machine::{Axis, Machine};
use sollwert::trace::{Clock, Meaning, Signal, TimeGrid, Trace};
use std::f64::consts::TAU;

/// Noise of a trace.
#[derive(Clone, Copy)]
pub struct Noise {
    pub scale_lu: f64,
    pub current_a: f64,
    pub current_step_a: f64,
    pub seed: u64,
}

impl Noise {
    /// That of the issue: 1 um scale, 0.05 A noise, 0.02 A quantum.
    pub fn usual(seed: u64) -> Self {
        Self { scale_lu: 1e-3, current_a: 0.05, current_step_a: 0.02, seed }
    }
}

/// A machine with one axis replaced.
pub fn machine(name: &str, sets: &[&str]) -> Machine {
    crate::test_machine::shipped(name, sets)
}

/// x(t) of a jerk-limited move in the shape of a raised cosine in acceleration: from rest over `way` at at most `speed`.
pub fn moves(period_s: f64, legs: &[(f64, f64, f64)]) -> Vec<f64> {
    let mut x = vec![0.0; (0.1 / period_s) as usize];
    for (way, speed, acceleration) in legs {
        let start: f64 = *x.last().unwrap();
        // Time of a ramp with the mean acceleration of a raised cosine: half of its peak.
        let ramp_s = (2.0 * speed / acceleration).max(0.02);
        let constant_s = (way.abs() / speed - ramp_s).max(0.0);
        let peak = (way.abs() / (ramp_s + constant_s)).copysign(*way);
        let total_s = 2.0 * ramp_s + constant_s;
        // Integral of the speed of a raised-cosine acceleration.
        let lift = |t: f64| t * t / (2.0 * ramp_s) + ramp_s / (TAU * TAU) * ((TAU * t / ramp_s).cos() - 1.0);
        let steps = (total_s / period_s).ceil() as usize;
        for k in 1..=steps {
            let t = (k as f64 * period_s).min(total_s);
            let left = total_s - t;
            let place = if t < ramp_s {
                peak * lift(t)
            } else if left < ramp_s {
                way - peak * lift(left)
            } else {
                peak * (lift(ramp_s) + t - ramp_s)
            };
            x.push(start + place);
        }
        let end = start + way;
        x.extend(std::iter::repeat_n(end, (0.05 / period_s) as usize));
    }
    x
}

/// Signals at every position tick.
pub fn simulate(axis: &Axis, time_base: &TimeBase, setpoints: &[f64], scale_lu: f64) -> Vec<AxisSignals> {
    let mut axis = axis.clone();
    if let Some(drive) = &mut axis.drive {
        drive.encoder.position_resolution_lu = scale_lu;
    }
    let mut drive = AxisDrive::new(&axis, time_base, Start::Held, setpoints[0]).expect("a drive");
    let input = |x: &f64| DriveInput { position_setpoint_lu: *x, load_n_m: 0.0, feedforward_active: true };
    setpoints.iter().map(|x| drive.step(input(x))).collect()
}

/// The trace of such signals.
pub fn trace(axis: &Axis, period_s: f64, signals: &[AxisSignals], stems: &[&str], noise: Noise) -> Trace {
    let mut random = Random::new(noise.seed);
    let mut normal = move || (-2.0 * random.unit().max(1e-300).ln()).sqrt() * (TAU * random.unit()).cos();
    let rotary = axis.kind == sollwert::base::AxisKind::Rotary;
    let length = |value: f64| if rotary { deg_from_rad(value) } else { value };
    let mut trace = Trace { name: "made".to_owned(), ..Trace::default() };
    for stem in stems {
        let values: Vec<f64> = signals
            .iter()
            .map(|s| match *stem {
                "position_setpoint" => length(s.position_setpoint_lu),
                "position_measured" => length(s.position_measured_lu),
                "position_reference" => length(s.position_reference_lu),
                "control_deviation" => length(s.control_deviation_lu),
                "velocity_command" => length(s.velocity_command_lu_s),
                "velocity_feedforward" => length(s.velocity_feedforward_lu_s),
                "torque_feedforward" => s.torque_feedforward_n_m,
                "torque_reference" => s.torque_reference_n_m,
                "current" | "current_mean" => {
                    let exact = if *stem == "current" { s.current_a } else { s.current_mean_a };
                    let noisy = exact + noise.current_a * normal();
                    let step = noise.current_step_a;
                    if step > 0.0 { (noisy / step).round() * step } else { noisy }
                }
                other => panic!("no signal {other}"),
            })
            .collect();
        let name = sollwert::trace::axis_signal_name(&axis.name, axis.kind, stem).expect("a known field");
        trace.signals.push(Signal {
            original: name.clone(),
            name: Some(name),
            unit: String::new(),
            clock: Clock::Servo,
            times: TimeGrid::Uniform { start_ns: 0.0, step_ns: period_s * 1e9, count: values.len() },
            values,
            labels: Vec::new(),
            discrete: false,
            meaning: Meaning::default(),
        });
    }
    trace
}

/// Five seconds with four speeds in both directions.
pub fn legs() -> Vec<(f64, f64, f64)> {
    vec![
        (8.0, 15.0, 1000.0),
        (-8.0, 15.0, 1000.0),
        (30.0, 80.0, 1000.0),
        (-30.0, 80.0, 1000.0),
        (80.0, 200.0, 1500.0),
        (-80.0, 200.0, 1500.0),
        (90.0, 320.0, 1500.0),
        (-90.0, 320.0, 1500.0),
    ]
}

/// All signals that an identification can use.
pub const ALL: [&str; 8] = [
    "position_setpoint",
    "position_measured",
    "control_deviation",
    "velocity_command",
    "velocity_feedforward",
    "torque_feedforward",
    "current_mean",
    "torque_reference",
];
