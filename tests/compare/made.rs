//! Traces made by formula.
//!
//! In: functions of time. Out: [`Trace`]s with axis signals.

use crate::random::Random;
use sollwert::trace::{Signal, TimeGrid, Trace};

/// Times `k * step_s`, k = 0 .. count.
pub fn grid(step_s: f64, count: usize) -> TimeGrid {
    TimeGrid::Uniform { start_ns: 0.0, step_ns: step_s * 1e9, count }
}

pub fn signal(name: &str, unit: &str, times: &TimeGrid, value: impl FnMut(f64) -> f64) -> Signal {
    Signal {
        name: Some(name.to_owned()),
        original: name.to_owned(),
        unit: unit.to_owned(),
        clock: Default::default(),
        times: times.clone(),
        values: times.iter().map(value).collect(),
        labels: Vec::new(),
        discrete: false,
        meaning: Default::default(),
    }
}

pub fn trace(signals: Vec<Signal>) -> Trace {
    Trace { name: "made".into(), signals, ..Trace::default() }
}

/// Standard normal, by Box and Muller.
pub fn normal(random: &mut Random) -> f64 {
    let (u, v) = (1.0 - random.unit(), random.unit());
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// A motion with rests and moves that do not repeat: sums of smooth steps of given lengths at given times.
pub fn steps(time_s: f64) -> f64 {
    const MOVES: [(f64, f64, f64); 6] =
        [(1.0, 0.4, 12.0), (2.1, 0.25, -7.0), (2.9, 0.7, 21.0), (4.3, 0.3, 3.0), (5.2, 0.9, -30.0), (7.0, 0.2, 5.0)];
    MOVES.iter().map(|(start, length, way)| way * smooth((time_s - start) / length)).sum()
}

/// 10 u³ - 15 u⁴ + 6 u⁵, held outside 0..1.
pub fn smooth(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}
