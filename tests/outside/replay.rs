//! A program replayed without drives: one row a set-point, and the programmed elements to hold it against.

use sollwert::base::{AxisKind, PerAxis};
use sollwert::interpreter::{ArcGeometry, Feed, Interpreter, Modes, MoveKind};
use sollwert::kernel::{Kernel, RunSummary, Status};
use sollwert::machine::{Machine, load};
use sollwert::program::ProgramSource;
use std::collections::BTreeMap;
use std::sync::Arc;

pub const MACHINES: [&str; 5] = ["spinner_mvc850", "huron_kx10", "mikron_ucp710", "huron_kx8_five", "xyzbc"];

/// All axes of a posture; mm and rad.
pub type Posture = [f64; 5];

pub fn machine(name: &str, sets: &[String]) -> Machine {
    load(name, sets).unwrap_or_else(|error| panic!("{name}: {error:?}")).machine
}

pub fn source(text: &str) -> ProgramSource {
    ProgramSource::from_bytes("part.mpf", text.as_bytes())
}

/// One set-point.
#[derive(Clone, Debug)]
pub struct Row {
    pub q: Posture,
    pub velocity: Posture,
    pub block: u64,
    pub line: u32,
    pub s_mm: f64,
    pub feed: f64,
    pub programmed_feed: Option<f64>,
    pub rotary_only: bool,
    pub limit: String,
}

pub struct Replay {
    pub rows: Vec<Row>,
    pub summary: RunSummary,
    pub elements: Elements,
    pub t_s: f64,
}

/// What the program says, by running block number.
pub type Elements = BTreeMap<u64, Element>;

/// One programmed motion.
#[derive(Clone, Debug)]
pub struct Element {
    pub line: u32,
    pub start: Posture,
    pub end: Posture,
    pub arc: Option<ArcGeometry>,
    pub feed: Option<f64>,
    pub modes: Modes,
    /// Rests at its end because of what stands between it and the next motion (a dwell, M0, M30).
    pub waits_after: bool,
}

fn posture(values: &PerAxis<f64>) -> Posture {
    std::array::from_fn(|i| values.as_slice()[i])
}

/// The programmed motions; those without displacement are none.
pub fn elements(machine: &Machine, text: &str) -> Elements {
    let mut interpreter = Interpreter::new(source(text), machine);
    let mut at = home(machine);
    let mut elements = Elements::new();
    while let Some(next) = interpreter.next_move().unwrap_or_else(|alarm| panic!("{alarm:?}\n{text}")) {
        let end = posture(&next.end.0);
        let arc = match next.kind {
            MoveKind::Arc(arc) => Some(arc),
            MoveKind::Rapid | MoveKind::Line => None,
            MoveKind::Dwell { .. } | MoveKind::Function { stops: true } => {
                if let Some(mut last) = elements.last_entry() {
                    last.get_mut().waits_after = true;
                }
                continue;
            }
            MoveKind::Function { stops: false } => continue,
            other => panic!("not judged from outside here: {other:?}"),
        };
        let feed = match next.feed {
            Feed::Rapid => None,
            Feed::Path { feed_lu_s } => Some(feed_lu_s),
            Feed::Varying { .. } => panic!("not judged from outside here"),
        };
        let line = next.block.line;
        if end != at || arc.is_some() {
            let element = Element { line, start: at, end, arc, feed, modes: next.modes, waits_after: false };
            elements.insert(next.block.number, element);
        }
        at = end;
    }
    elements
}

pub fn home(machine: &Machine) -> Posture {
    std::array::from_fn(|i| machine.axes.get(i).map_or(0.0, |axis| axis.home_lu))
}

pub fn linear(machine: &Machine) -> [bool; 5] {
    std::array::from_fn(|i| machine.axes.get(i).is_some_and(|axis| axis.kind == AxisKind::Linear))
}

pub fn replay(machine: &Machine, text: &str) -> Replay {
    let mut kernel = Kernel::new(Arc::new(machine.clone()), source(text), false);
    let mut rows = Vec::new();
    while kernel.cycle().unwrap() == Status::Running {
        let setpoint = kernel.output().setpoint.unwrap();
        let path = &setpoint.path;
        rows.push(Row {
            q: posture(&setpoint.axes.map(|axis| axis.position_lu)),
            velocity: posture(&setpoint.axes.map(|axis| axis.velocity_lu_s)),
            block: path.block.number,
            line: path.block.line,
            s_mm: path.path_length_mm,
            feed: path.feed_lu_s,
            programmed_feed: path.programmed_feed_lu_s,
            rotary_only: path.rotary_only,
            limit: format!("{:?}", path.limit.kind),
        });
    }
    assert!(kernel.take_findings().alarm.is_none(), "{text}");
    Replay {
        rows,
        summary: RunSummary::new(machine, "part.mpf", kernel.figures(), false),
        elements: elements(machine, text),
        t_s: machine.cycle.time_base.setpoint_period_s(),
    }
}

pub fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

pub fn minus(a: &Posture, b: &Posture) -> Posture {
    std::array::from_fn(|i| a[i] - b[i])
}

impl Element {
    /// Distance of a posture from the programmed curve (mm and rad alike), and the place on it from 0 to 1.
    pub fn distance(&self, q: &Posture) -> (f64, f64) {
        let Some(arc) = self.arc else { return self.distance_of_line(q) };
        let [a, b] = arc.plane.map(|axis| axis.index());
        let angle = |p: &Posture| (p[b] - arc.centre_mm[1]).atan2(p[a] - arc.centre_mm[0]);
        let turn = std::f64::consts::TAU;
        let swept = ((angle(q) - angle(&self.start)) * arc.sweep_rad.signum()).rem_euclid(turn);
        let whole = (arc.sweep_rad.abs() / turn).ceil() as i32;
        let on_it = (-1..=whole).map(|k| {
            let share = ((swept + f64::from(k) * turn) / arc.sweep_rad.abs()).clamp(0.0, 1.0);
            let (sin, cos) = (angle(&self.start) + share * arc.sweep_rad).sin_cos();
            let mut p: Posture = std::array::from_fn(|i| self.start[i] + share * (self.end[i] - self.start[i]));
            p[a] = arc.centre_mm[0] + arc.radius_mm * cos;
            p[b] = arc.centre_mm[1] + arc.radius_mm * sin;
            (norm(&minus(q, &p)), share)
        });
        on_it.fold((f64::INFINITY, 0.0), |best, next| if next.0 < best.0 { next } else { best })
    }

    fn distance_of_line(&self, q: &Posture) -> (f64, f64) {
        let way = minus(&self.end, &self.start);
        let along: f64 = minus(q, &self.start).iter().zip(&way).map(|(x, w)| x * w).sum();
        let share = (along / norm(&way).powi(2)).clamp(0.0, 1.0);
        let p: Posture = std::array::from_fn(|i| self.start[i] + share * way[i]);
        (norm(&minus(q, &p)), share)
    }

    /// Length over the linear axes, mm; 0 where only rotary axes move.
    pub fn length_mm(&self, linear: &[bool; 5]) -> f64 {
        let mut way: Posture = std::array::from_fn(|i| if linear[i] { self.end[i] - self.start[i] } else { 0.0 });
        let Some(arc) = self.arc else { return norm(&way) };
        for axis in arc.plane {
            way[axis.index()] = 0.0;
        }
        (arc.radius_mm * arc.sweep_rad).hypot(norm(&way))
    }

    /// Direction of motion at its end (`true`) or start: per mm of the linear axes (per rad of the rotary ones).
    pub fn direction(&self, at_end: bool, linear: &[bool; 5]) -> Posture {
        let way = minus(&self.end, &self.start);
        let Some(arc) = self.arc else {
            let length = self.length_mm(linear);
            return way.map(|w| w / if length > 0.0 { length } else { norm(&way) });
        };
        let [a, b] = arc.plane.map(|axis| axis.index());
        let p = if at_end { &self.end } else { &self.start };
        let mut direction = way.map(|w| w / arc.sweep_rad.abs());
        let sense = arc.sweep_rad.signum();
        direction[a] = -sense * (p[b] - arc.centre_mm[1]);
        direction[b] = sense * (p[a] - arc.centre_mm[0]);
        let length = self.length_mm(linear) / arc.sweep_rad.abs();
        direction.map(|d| d / length)
    }
}
