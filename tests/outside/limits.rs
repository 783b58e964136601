//! Every axis within velocity, acceleration and jerk, by differences of the positions that were sent.
//!
//! The n-th difference of a curve over t_s^n is a weighted mean of its n-th derivative over the span, so that it obeys the limit
//! exactly (but for rounding of positions, 1e-13 mm / t_s^n) wherever the lower derivatives are continuous. Where the path itself
//! steps, the rule that limits the step gives the allowance, once for each such place in the span:
//! * unrounded corner: the axis velocity steps by at most sqrt(8 A e);
//! * tangential change of curvature: the acceleration steps by at most Jtb * t_s;
//! * end of a blend: the acceleration steps by at most R_A * A.

use crate::corners::{Blend, Transition, before_corner_mm, transition};
use crate::replay::{Element, MACHINES, Replay, Row, linear, machine, minus, norm, replay};
use crate::text::{Kind, dense, planes, program};
use sollwert::machine::Machine;
use std::collections::BTreeMap;

/// What the path may step by between two neighbouring rows: per axis.
#[derive(Clone, Copy, Default)]
struct Steps {
    velocity: [f64; 5],
    acceleration: [f64; 5],
}

struct Judge<'a> {
    machine: &'a Machine,
    run: &'a Replay,
    linear: [bool; 5],
    transitions: BTreeMap<u64, (Transition, &'a Element)>,
}

impl<'a> Judge<'a> {
    fn new(machine: &'a Machine, run: &'a Replay) -> Self {
        let pairs = run.elements.iter().zip(run.elements.values().skip(1));
        let transitions =
            pairs.map(|((number, before), after)| (*number, (transition(machine, before, after), after))).collect();
        Self { machine, run, linear: linear(machine), transitions }
    }

    fn blend_after(&self, number: u64) -> Option<Blend> {
        match self.transitions.get(&number) {
            Some((Transition::Blend(blend), _)) => Some(*blend),
            _ => None,
        }
    }

    /// The row stands on the blend at the end of its block. Cut points are rounded: 1e-9 mm count as the blend.
    fn on_blend(&self, row: &Row, margin_mm: f64) -> bool {
        let Some(blend) = self.blend_after(row.block) else { return false };
        before_corner_mm(&self.run.elements[&row.block], row, &self.linear) < blend.t_mm + margin_mm
    }

    /// The path's own steps on the way from one row to the next.
    fn steps(&self, a: &Row, b: &Row) -> Steps {
        let mut steps = Steps::default();
        let mut blend_ends = 0;
        let begins = !self.on_blend(a, -1e-9) && (b.block > a.block || self.on_blend(b, 1e-9));
        blend_ends += u32::from(begins && self.blend_after(a.block).is_some());
        for (number, (transition, after)) in self.transitions.range(a.block..b.block) {
            match transition {
                Transition::Blend(_) => blend_ends += if *number == a.block { 1 } else { 2 },
                Transition::Stop | Transition::Smooth => {}
                Transition::Pass => self.pass(&self.run.elements[number], after, a.feed.max(b.feed), &mut steps),
            }
        }
        for (i, axis) in self.machine.axes.iter().enumerate() {
            let share = self.machine.smoothing.radial_acceleration_share;
            steps.acceleration[i] += f64::from(blend_ends) * share * axis.limits.acceleration_max_lu_s2;
        }
        steps
    }

    fn pass(&self, before: &Element, after: &Element, feed: f64, steps: &mut Steps) {
        let turn = minus(&after.direction(false, &self.linear), &before.direction(true, &self.linear));
        for (i, axis) in self.machine.axes.iter().enumerate() {
            let (limits, e) = (&axis.limits, axis.follow_up_tolerance_lu);
            let allowed = (8.0 * limits.acceleration_max_lu_s2 * e).sqrt();
            // Feed between two rows may be a little above both.
            steps.velocity[i] += allowed.min(1.2 * feed * turn[i].abs() + 1e-9);
            let curvature = limits.transition_jerk_max_lu_s3 * self.run.t_s;
            steps.acceleration[i] += if norm(&turn) > 1e-3 { 2.0 * limits.acceleration_max_lu_s2 } else { curvature };
        }
    }

    fn check(&self, case: &str) {
        let (rows, t) = (&self.run.rows, self.run.t_s);
        for k in 1..rows.len().saturating_sub(2) {
            let between: [Steps; 3] = std::array::from_fn(|i| self.steps(&rows[k - 1 + i], &rows[k + i]));
            let inside = (0..4).all(|i| rows[k - 1 + i].block == rows[k].block && self.on_blend(&rows[k - 1 + i], 0.0));
            for (i, axis) in self.machine.axes.iter().enumerate() {
                let q = |n: usize| rows[k + n - 1].q[i];
                let limits = &axis.limits;
                let at = || {
                    let row = &rows[k];
                    format!(
                        "{case} tick {k} line {} axis {} feed {} limit {}",
                        row.line, axis.name, row.feed, row.limit
                    )
                };
                let v = (q(2) - q(1)) / t;
                assert!(v.abs() <= limits.velocity_max_lu_s * (1.0 + 1e-9) + 1e-10, "{}: v {v}", at());
                let a = (q(2) - 2.0 * q(1) + q(0)) / (t * t);
                let dv = between[0].velocity[i] + between[1].velocity[i];
                assert!(
                    a.abs() <= limits.acceleration_max_lu_s2 * (1.0 + 1e-6) + 1e-6 + dv / t,
                    "{}: a {a}, allowed {} + {}",
                    at(),
                    limits.acceleration_max_lu_s2,
                    dv / t
                );
                let j = (q(3) - 3.0 * q(2) + 3.0 * q(1) - q(0)) / (t * t * t);
                let dv: f64 = between.iter().map(|steps| steps.velocity[i]).sum();
                let da: f64 = between.iter().map(|steps| steps.acceleration[i]).sum();
                let jerk = if inside { limits.transition_jerk_max_lu_s3 } else { limits.jerk_max_lu_s3 };
                let jerk = jerk.max(if inside { 0.0 } else { limits.transition_jerk_max_lu_s3 });
                let rounding = 4e-13 / (t * t * t);
                assert!(
                    j.abs() <= jerk * (1.0 + 1e-4) + rounding + da / t + dv / (t * t),
                    "{}: j {j}, allowed {jerk} + {} + {}",
                    at(),
                    da / t,
                    dv / (t * t)
                );
            }
        }
    }
}

fn judge(machine: &Machine, case: &str, text: &str) {
    let run = replay(machine, text);
    Judge::new(machine, &run).check(case);
}

#[test]
fn shipped_programs_on_shipped_machines() {
    for name in MACHINES {
        let machine = machine(name, &[]);
        for (program, text) in [
            ("spline", include_str!("../../programs/spline.mpf")),
            ("corners", include_str!("../../programs/corners.mpf")),
            ("circle", include_str!("../../programs/circle.mpf")),
            ("pocket", include_str!("../../programs/pocket.mpf")),
        ] {
            judge(&machine, &format!("{name} {program}"), text);
        }
    }
}

#[test]
fn random_programs() {
    for name in MACHINES {
        let machine = machine(name, &[]);
        for (offset, kind) in [(0, Kind::Rounded), (100, Kind::Continuous), (200, Kind::Mixed)] {
            for seed in offset..offset + 8 {
                judge(&machine, &format!("{name} seed {seed}"), &program(seed, kind, 60, &[]));
            }
        }
    }
}

/// G643, G644 and G645, RND and the compressor.
#[test]
fn random_programs_of_every_path_mode() {
    for (n, name) in MACHINES.into_iter().enumerate() {
        let machine = machine(name, &[]);
        for seed in 900..904 {
            let seed = seed + 10 * n as u64;
            judge(&machine, &format!("{name} seed {seed}"), &program(seed, Kind::Smoothed, 60, &[]));
        }
        for mode in ["G643 CTOL=0.02", "G644", "G645 CTOL=0.02", "G642 COMPON CTOL=0.02", "G645 COMPCAD CTOL=0.02"] {
            judge(&machine, &format!("{name} {mode}"), &dense(mode, 8000.0, 300));
        }
    }
}

#[test]
fn random_programs_with_rotary_axes() {
    for (name, rotary) in [("mikron_ucp710", ["A", "C"]), ("xyzbc", ["B", "C"]), ("huron_kx8_five", ["A", "C"])] {
        let machine = machine(name, &[]);
        for seed in 300..308 {
            let kind = [Kind::Rounded, Kind::Continuous, Kind::Mixed][seed as usize % 3];
            judge(&machine, &format!("{name} seed {seed}"), &program(seed, kind, 60, &rotary));
        }
    }
}

/// One axis ten times weaker than the others, each in turn, and in turn in each limit.
#[test]
fn one_axis_ten_times_weaker() {
    let whole = machine("spinner_mvc850", &[]);
    let mut seed = 400;
    for (i, axis) in whole.axes.iter().enumerate() {
        let limits = &axis.limits;
        let weaker = [
            ("velocity_max_m_min", limits.velocity_max_lu_s * 0.06),
            ("acceleration_max_m_s2", limits.acceleration_max_lu_s2 * 1e-3),
            ("jerk_max_m_s3", limits.jerk_max_lu_s3 * 1e-3),
            ("transition_jerk_max_m_s3", limits.transition_jerk_max_lu_s3 * 1e-3),
        ];
        for (n, (key, value)) in weaker.iter().enumerate() {
            let set = format!("axes.{}.{key}={}", axis.name, value / 10.0);
            let machine = machine("spinner_mvc850", &[set]);
            let kind = [Kind::Rounded, Kind::Continuous, Kind::Mixed][(i + n) % 3];
            judge(&machine, &format!("weak {} {key} seed {seed}", axis.name), &program(seed, kind, 40, &[]));
            seed += 1;
        }
    }
}

#[test]
fn dense_paths_and_arcs_in_all_planes() {
    for name in MACHINES {
        let machine = machine(name, &[]);
        for mode in ["G64", "G642 CTOL=0.01", "G642 CTOL=0.1", "G641 ADIS=0.1"] {
            judge(&machine, &format!("{name} {mode}"), &dense(mode, 8000.0, 400));
        }
        judge(&machine, &format!("{name} planes"), &planes());
    }
}
