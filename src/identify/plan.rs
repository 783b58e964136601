//! Motions that tell everything: NC programs for a machine to run while it is traced.
//!
//! In: the machine. Out: [`PlannedProgram`]s, one an axis, a circle for two linear axes and one for the control, each with `$AN_SLTRACE = 1` and `= 2` around
//! what is worth recording, and the signals to trace. All of it stays inside the middle of the travel. Does not run anything: the same programs
//! are for the machine and for `sollwert run`.

use super::plan_control::control;
use super::wire::has_linear_motor;
use crate::base::AxisKind;
use crate::base::units::{deg_from_rad, mm_min_from_mm_s};
use crate::machine::{Axis, Machine};

/// One program to run.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedProgram {
    /// File name.
    pub name: String,
    /// Axes that it moves.
    pub axes: Vec<String>,
    /// NC text.
    pub text: String,
    /// Time between start and stop of the trace, roughly.
    pub trace_s: f64,
    /// What it is for.
    pub purpose: String,
}

/// One signal to trace, by its name in each system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlannedSignal {
    /// Our field.
    pub ours: &'static str,
    /// SINUMERIK Operate.
    pub operate: &'static str,
    /// SINUMERIK Edge / Data Recorder.
    pub edge: &'static str,
    /// What it tells.
    pub tells: &'static str,
}

/// Signals to trace, the most needed first: a trace with few channels takes the first ones.
pub const PLANNED_SIGNALS: [PlannedSignal; 7] = [
    PlannedSignal {
        ours: "position_setpoint",
        operate: "nckServoDataCmdPos2ndEnc64",
        edge: "DES_POS",
        tells: "what the axis is asked: every controller constant, and the simulation",
    },
    PlannedSignal {
        ours: "position_measured",
        operate: "nckServoDataActPos2ndEnc64",
        edge: "ENC_POS",
        tells: "speed and acceleration: inertia and friction",
    },
    PlannedSignal {
        ours: "current_mean",
        operate: "nckServoDataActCurr32 (a sample; better the drive's own trace at its current cycle)",
        edge: "CURRENT",
        tells: "torque: inertia, friction, gravity",
    },
    PlannedSignal {
        ours: "control_deviation",
        operate: "nckServoDataCtrlDev64",
        edge: "CTRL_DIFF",
        tells: "set-point delay, position gain",
    },
    PlannedSignal {
        ours: "velocity_feedforward",
        operate: "not known to this program",
        edge: "VEL_FFW",
        tells: "velocity feed-forward and its delay",
    },
    PlannedSignal {
        ours: "velocity_command",
        operate: "not known to this program",
        edge: "CMD_SPEED, after its unit is checked",
        tells: "position gain",
    },
    PlannedSignal {
        ours: "torque_feedforward",
        operate: "not known to this program",
        edge: "TORQUE_FFW",
        tells: "torque feed-forward",
    },
];

/// Shares of the highest velocity for the runs of constant speed.
const SPEED_SHARES: [f64; 5] = [0.03, 0.1, 0.25, 0.5, 0.85];
/// Share of the travel that is used, around its middle.
const TRAVEL_SHARE: f64 = 0.8;
/// Ways without a given travel, to each side of home.
const REACH_MM: f64 = 50.0;
const REACH_DEG: f64 = 90.0;
/// Constant speed at least, and time of a run at most.
const CONSTANT_S: f64 = 0.4;
const RUN_S_MAX: f64 = 4.0;
/// Rest between two motions.
const REST_S: f64 = 0.3;
/// Short moves at full acceleration, and small reversals.
const MOVES: usize = 8;
const REVERSALS: usize = 8;
/// Diameter of the circle as a share of the smaller reach.
const CIRCLE_SHARE: f64 = 0.25;

/// Programs for the given axes (all with a drive if none is given).
pub fn plan(machine: &Machine, axes: &[crate::base::AxisId]) -> Vec<PlannedProgram> {
    let chosen: Vec<&Axis> =
        machine.axis_ids().filter(|id| axes.is_empty() || axes.contains(id)).map(|id| machine.axis(id)).collect();
    let mut programs: Vec<PlannedProgram> = chosen
        .iter()
        .filter(|axis| !axes.is_empty() || axis.drive.is_some())
        .map(|axis| of_axis(machine, axis))
        .collect();
    let linear: Vec<&Axis> = chosen.iter().copied().filter(|axis| axis.kind == AxisKind::Linear).collect();
    let plane = |one: &str, other: &str| {
        let find = |name: &str| linear.iter().copied().find(|axis| axis.name == name);
        Some([find(one)?, find(other)?])
    };
    programs.extend(plane("X", "Y").map(|axes| circle(machine, axes)));
    let vertical = linear.iter().copied().find(|axis| axis.name == "Z");
    programs.extend(plane("X", "Y").map(|axes| control(machine, axes, vertical)));
    programs
}

/// An axis in the units of a program: mm or deg, and per second.
pub(super) struct Reach {
    pub(super) middle: f64,
    pub(super) half: f64,
    pub(super) velocity: f64,
    acceleration: f64,
    jerk: f64,
    assumed: bool,
}

impl Reach {
    pub(super) fn of(axis: &Axis) -> Self {
        let border = |value: f64| if axis.kind == AxisKind::Rotary { deg_from_rad(value) } else { value };
        let (middle, half, assumed) = match axis.travel_lu {
            Some([low, high]) if !axis.modulo => {
                (border((low + high) / 2.0), border((high - low) / 2.0) * TRAVEL_SHARE, false)
            }
            _ => (border(axis.home_lu), if axis.kind == AxisKind::Rotary { REACH_DEG } else { REACH_MM }, true),
        };
        Self {
            middle,
            half,
            assumed,
            velocity: border(axis.limits.velocity_max_lu_s),
            acceleration: border(axis.limits.acceleration_max_lu_s2),
            jerk: border(axis.limits.jerk_max_lu_s3),
        }
    }

    /// Time of a jerk-limited ramp from rest to `speed`.
    fn ramp_s(&self, speed: f64) -> f64 {
        let full = self.acceleration * self.acceleration / self.jerk;
        if speed <= full {
            2.0 * (speed / self.jerk).sqrt()
        } else {
            speed / self.acceleration + self.acceleration / self.jerk
        }
    }

    /// Way with both ramps and the constant speed that is wanted.
    fn way(&self, speed: f64) -> f64 {
        speed * (self.ramp_s(speed) + CONSTANT_S)
    }

    /// The highest speed up to `speed` that finds its way.
    fn possible(&self, speed: f64) -> f64 {
        let (mut low, mut high) = (0.0, speed);
        if self.way(speed) <= 2.0 * self.half {
            return speed;
        }
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            if self.way(middle) <= 2.0 * self.half { low = middle } else { high = middle }
        }
        low
    }
}

/// Lines of a program, and the time that they take.
pub(super) struct Lines {
    pub(super) text: String,
    pub(super) seconds: f64,
}

impl Lines {
    pub(super) fn line(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    pub(super) fn rest(&mut self, seconds: f64) {
        self.line(&format!("G4 F{seconds}"));
        self.seconds += seconds;
    }
}

/// `X=12.5`: right for any axis name.
pub(super) fn word(axis: &Axis, position: f64) -> String {
    format!("{}={position:.4}", axis.name)
}

/// F: mm/min, deg/min.
pub(super) fn feed_word(speed: f64) -> String {
    format!("F{:.2}", mm_min_from_mm_s(speed))
}

fn opening(machine: &Machine, purpose: &str) -> String {
    format!(
        "; {purpose}, machine {}\n; written by sollwert identify --plan: check travel and clamping before you run it\n\
         ; trace from $AN_SLTRACE=1 to =2, all signals at the position cycle\nG90 G94 G60 G601 SOFT FFWON\n",
        machine.name
    )
}

fn of_axis(machine: &Machine, axis: &Axis) -> PlannedProgram {
    let reach = Reach::of(axis);
    let purpose = format!("friction, inertia and controller constants of axis {}", axis.name);
    let mut lines = Lines { text: opening(machine, &purpose), seconds: 0.0 };
    let travel_unit = if axis.kind == AxisKind::Rotary { "deg" } else { "mm" };
    if reach.assumed {
        let note = format!("; no travel is given: {:.0} {travel_unit} to each side of home are used", reach.half);
        lines.line(&note);
    }
    if has_linear_motor(axis) {
        lines.line("; linear motor: forces in N, masses in kg");
    }
    let slow = reach.possible(0.25 * reach.velocity);
    lines.line(&format!("G1 {} {}", word(axis, reach.middle), feed_word(slow)));
    lines.rest(1.0);
    lines.seconds = 0.0;
    lines.line("$AN_SLTRACE=1");
    lines.rest(0.5);
    lines.line("; constant speeds in both directions");
    let go = |lines: &mut Lines, to: f64, way: f64, speed: f64| {
        lines.line(&format!("G1 {} {}", word(axis, to), feed_word(speed)));
        lines.seconds += way.abs() / speed + reach.ramp_s(speed);
        lines.rest(REST_S);
    };
    for share in SPEED_SHARES {
        let speed = reach.possible(share * reach.velocity);
        let way = (RUN_S_MAX / 2.0 * speed).clamp(reach.way(speed).min(2.0 * reach.half), 2.0 * reach.half);
        let (from, to) = (reach.middle - way / 2.0, reach.middle + way / 2.0);
        go(&mut lines, from, way / 2.0, speed);
        go(&mut lines, to, way, speed);
        go(&mut lines, from, way, speed);
    }
    go(&mut lines, reach.middle, reach.half, slow);
    lines.line("; jerk-limited moves at full acceleration");
    let fast = reach.possible(0.85 * reach.velocity);
    let short = (fast * reach.ramp_s(fast)).min(reach.half);
    for place in 0..MOVES {
        // Of different lengths, so that nothing repeats exactly.
        let way = short * (1.0 - 0.08 * place as f64);
        let to = reach.middle + if place % 2 == 0 { way / 2.0 } else { -way / 2.0 };
        go(&mut lines, to, way, fast);
    }
    lines.line("; small reversals");
    let small = (reach.half / 200.0).min(reach.way(0.01 * reach.velocity));
    for place in 0..REVERSALS {
        let to = reach.middle + if place % 2 == 0 { small } else { -small };
        lines.line(&format!("G1 {} {}", word(axis, to), feed_word(0.02 * reach.velocity)));
        lines.seconds += 2.0 * small / (0.02 * reach.velocity) + reach.ramp_s(0.02 * reach.velocity);
    }
    lines.rest(0.5);
    closing(&mut lines);
    PlannedProgram {
        name: format!("identify_{}.mpf", axis.name.to_ascii_lowercase()),
        axes: vec![axis.name.clone()],
        text: lines.text,
        trace_s: lines.seconds,
        purpose,
    }
}

pub(super) fn closing(lines: &mut Lines) {
    lines.line("$AN_SLTRACE=2");
    lines.line("M30");
}

/// Circles in both senses: reversals of two axes at speed.
fn circle(machine: &Machine, axes: [&Axis; 2]) -> PlannedProgram {
    let reaches = axes.map(Reach::of);
    let radius = CIRCLE_SHARE / 2.0 * reaches[0].half.min(reaches[1].half);
    let purpose = format!("reversals of {} and {} on a circle", axes[0].name, axes[1].name);
    let mut lines = Lines { text: opening(machine, &purpose), seconds: 0.0 };
    let speed = (0.25 * reaches[0].velocity.min(reaches[1].velocity))
        .min((0.5 * radius * reaches[0].acceleration.min(reaches[1].acceleration)).sqrt());
    let start = [reaches[0].middle + radius, reaches[1].middle];
    lines.line(&format!("G17 G1 {} {} {}", word(axes[0], start[0]), word(axes[1], start[1]), feed_word(speed)));
    lines.rest(1.0);
    lines.seconds = 0.0;
    lines.line("$AN_SLTRACE=1");
    lines.rest(0.5);
    for sense in ["G3", "G2", "G3", "G2"] {
        lines.line(&format!("{sense} {} {} I={:.4} J=0", word(axes[0], start[0]), word(axes[1], start[1]), -radius));
        lines.seconds += std::f64::consts::TAU * radius / speed + reaches[0].ramp_s(speed);
        lines.rest(REST_S);
    }
    closing(&mut lines);
    PlannedProgram {
        name: "identify_circle.mpf".to_owned(),
        axes: axes.iter().map(|axis| axis.name.clone()).collect(),
        text: lines.text,
        trace_s: lines.seconds,
        purpose,
    }
}
