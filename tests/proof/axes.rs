//! Every axis within velocity, acceleration and jerk, by differences of the positions that were sent.
//!
//! The n-th difference of a curve over t_s^n is a weighted mean of its n-th derivative over n cycles (the weight is the B-spline of
//! degree n - 1, which is not negative and has the mean 1). So wherever the derivatives below the n-th are continuous
//!
//! ```text
//! |D1| <= max |q'|,   |D2| <= max |q''|,   |D3| <= max |q'''|
//! ```
//!
//! without any discretisation error: what is left is the rounding of positions, at most 2^n eps |q| / t_s^n for the positions themselves
//! and [`PLACE_LU`] / t_s^n for the place on the path (time and arc length are rounded as well). Where a lower derivative steps by
//! h at one instant, the same weight gives the step's share:
//!
//! ```text
//! step of the velocity:       |D2| <= A + h / t_s,      |D3| <= J + h / t_s²
//! step of the acceleration:   |D2| <= A (no exemption), |D3| <= J + 3/4 h / t_s
//! ```
//!
//! since the hat and the parabola have the heights 1 and 3/4; and summed over all windows that see the step its weight is exactly 1:
//!
//! ```text
//! |D2(k) + D2(k+1)| <= 2 A + h / t_s,    |D3(k) + D3(k+1) + D3(k+2)| <= 3 J + h / t_s
//! ```
//!
//! Under BRISK and DRIVE the jerk is not judged; under DRIVE, above the velocity of MD35220, the acceleration is judged by what MD35230 leaves.
//!
//! The rules that bound h: at a corner that is left (G64) the axis velocity steps by at most `corner_rule` allows; where only the
//! curvature steps the axis acceleration steps by at most J t_s, J the jerk of transitions where it is given.

use crate::run::{BORDER_LU, Posture, Run, TANGENT_RAD, Target};
use crate::settings::Law;
use crate::verdict::{Finding, Kind};
use sollwert::machine::{AccelerationMode, Machine};

/// Relative tolerance of a limit: rounding.
const RATIO: f64 = 1e-6;

/// Rounding of the place on the path: of a time of some 100 s times a speed of some 100 mm/s, and of the arc length of a spline.
const PLACE_LU: f64 = 2e-11;

/// Most steps of the path between one set-point and the next.
#[derive(Clone, Copy, Default)]
struct Steps {
    velocity: Posture,
    acceleration: Posture,
    corner: bool,
    /// The jerk is not limited somewhere on the way.
    brisk: bool,
    /// All of the way is under DRIVE.
    drive: bool,
}

/// The limits of one axis.
#[derive(Clone, Copy)]
struct Limits {
    velocity: f64,
    acceleration: f64,
    jerk: f64,
    /// J of a step of the acceleration.
    transition: f64,
    /// What a corner may step by.
    corner: f64,
    /// DRIVE: above this velocity this acceleration.
    reduced: [f64; 2],
}

pub fn check(machine: &Machine, law: Law, run: &Run, places: &[(usize, f64)]) -> Vec<Finding> {
    let limits: Vec<Limits> = machine
        .axes
        .iter()
        .map(|axis| Limits {
            velocity: axis.limits.velocity_max_lu_s,
            acceleration: axis.limits.acceleration_max_lu_s2,
            jerk: axis.limits.jerk_max_lu_s3,
            transition: axis.limits.transition_jerk_max_lu_s3,
            corner: (8.0 * axis.limits.acceleration_max_lu_s2 * axis.follow_up_tolerance_lu).sqrt(),
            reduced: [
                axis.acceleration_reduction.velocity_ratio * axis.limits.velocity_max_lu_s,
                (1.0 - axis.acceleration_reduction.reduction_ratio) * axis.limits.acceleration_max_lu_s2,
            ],
        })
        .collect();
    let share = machine.smoothing.radial_acceleration_share;
    let judge = Judge { law, run, places, limits: &limits, share };
    let steps: Vec<Steps> = (1..run.rows.len()).map(|k| judge.steps(k)).collect();
    (0..limits.len()).flat_map(|axis| judge.axis(axis, &machine.axes[axis].name, &steps)).collect()
}

struct Judge<'a> {
    law: Law,
    run: &'a Run,
    places: &'a [(usize, f64)],
    limits: &'a [Limits],
    /// R_A.
    share: f64,
}

impl Judge<'_> {
    /// Of the joints between row k - 1 and row k.
    fn steps(&self, k: usize) -> Steps {
        let (rows, stretches) = (&self.run.rows, &self.run.stretches);
        let ((mut from, from_lu), (mut to, to_lu)) = (self.places[k - 1], self.places[k]);
        // A row on a joint may stand on either side of it.
        if from_lu <= BORDER_LU {
            from = from.saturating_sub(1);
        }
        if to_lu >= stretches[to].length_lu - BORDER_LU {
            to += 1;
        }
        let joints = self.run.joints.get(from..to.min(self.run.joints.len())).unwrap_or(&[]);
        let targets = self.run.targets_of(&rows[k - 1], &rows[k]);
        let mut steps = Steps {
            brisk: targets.iter().any(Target::brisk),
            drive: targets.iter().all(|target| target.modes.acceleration_mode == AccelerationMode::Drive),
            ..Steps::default()
        };
        let most = self.limits.iter().map(|limits| limits.acceleration).fold(0.0, f64::max);
        for joint in joints.iter().filter(|joint| !joint.rests) {
            let turn = joint.turn.iter().map(|x| x * x).sum::<f64>().sqrt();
            // Feed between two rows may be a little above both.
            let feed = 1.2 * rows[k - 1].feed.max(rows[k].feed);
            steps.corner |= turn > TANGENT_RAD;
            for (i, limits) in self.limits.iter().enumerate() {
                steps.velocity[i] += limits.corner.min(feed * joint.turn[i].abs());
                let rule = if turn > TANGENT_RAD {
                    2.0 * limits.acceleration
                } else if joint.blend && self.law == Law::SevenPhase {
                    // The published feeds of a cubic blend rest on the step at its ends.
                    self.share * limits.acceleration
                } else {
                    limits.transition * self.run.t_s
                };
                let bend = feed * feed * joint.bend[i].abs();
                // The path accelerates by what the axis that does most of the way can: its share is at least 1 / sqrt 5.
                let tilt = 3.0 * most * joint.turn[i].abs();
                steps.acceleration[i] += rule.min(bend + if turn > TANGENT_RAD { rule } else { tilt });
            }
        }
        steps
    }

    fn axis(&self, i: usize, name: &str, steps: &[Steps]) -> Vec<Finding> {
        let (rows, t) = (&self.run.rows, self.run.t_s);
        let Limits { velocity, acceleration, jerk, transition, reduced, .. } = self.limits[i];
        // The jerk of transitions is a limit of its own: inside blends it holds, wherever it is the lower one it is not checked here.
        let jerk = jerk.max(transition);
        let largest = rows.iter().map(|row| row.q[i].abs()).fold(0.0, f64::max);
        let noise = |n: i32| 2_f64.powi(n) * (f64::EPSILON * largest + PLACE_LU) / t.powi(n);
        let mut worst = Worst { name, rows: self.run, worst: [None, None, None, None, None] };
        let q = |k: usize| rows[k].q[i];
        let d2 = |k: usize| (q(k + 1) - 2.0 * q(k) + q(k - 1)) / (t * t);
        let d3 = |k: usize| (q(k + 2) - 3.0 * q(k + 1) + 3.0 * q(k) - q(k - 1)) / (t * t * t);
        // steps[k] lies between row k and row k + 1.
        let v = |k: usize| steps[k].velocity[i];
        let a = |k: usize| steps[k].acceleration[i];
        let last = rows.len();
        for k in 0..last.saturating_sub(1) {
            worst.note(Kind::Velocity, k, (q(k + 1) - q(k)) / t, velocity * (1.0 + RATIO) + noise(1));
        }
        for k in 1..last.saturating_sub(1) {
            // A piece goes faster than that with the lower acceleration all along; the neighbours say that no piece begins here.
            let fast = |n: usize| n + 1 < last && steps[n].drive && (q(n + 1) - q(n)).abs() > reduced[0] * t;
            let lower = k > 1 && (k - 2..k + 2).all(fast);
            let allowed = if lower { reduced[1] } else { acceleration } * (1.0 + RATIO) + noise(2);
            worst.note(Kind::Acceleration, k, d2(k), allowed + (v(k - 1) + v(k)) / t);
            if k + 2 < last {
                let seen = v(k - 1) + v(k) + v(k + 1);
                let allowed = acceleration * (1.0 + RATIO) + noise(2);
                worst.note(Kind::VelocityStep, k, d2(k) + d2(k + 1), 2.0 * allowed + seen / t);
            }
        }
        for k in 1..last.saturating_sub(2) {
            let (corner, dv, da) = (
                (k - 1..k + 2).any(|n| steps[n].corner || steps[n].brisk),
                (k - 1..k + 2).map(v).sum::<f64>(),
                (k - 1..k + 2).map(a).sum::<f64>(),
            );
            if corner {
                continue;
            }
            let allowed = jerk * (1.0 + RATIO) + noise(3);
            worst.note(Kind::Jerk, k, d3(k), allowed + 0.75 * da / t + dv / (t * t));
            if k + 4 < last && !(k - 1..k + 4).any(|n| steps[n].corner || steps[n].brisk) {
                let (da, dv): (f64, f64) = ((k - 1..k + 4).map(a).sum(), (k - 1..k + 4).map(v).sum());
                let sum = d3(k) + d3(k + 1) + d3(k + 2);
                worst.note(Kind::AccelerationStep, k, sum, 3.0 * allowed + da / t + dv / (t * t));
            }
        }
        worst.worst.into_iter().flatten().collect()
    }
}

/// The worst place of each kind on one axis.
struct Worst<'a> {
    name: &'a str,
    rows: &'a Run,
    worst: [Option<Finding>; 5],
}

impl Worst<'_> {
    fn note(&mut self, kind: Kind, k: usize, value: f64, allowed: f64) {
        let ratio = value.abs() / allowed;
        let place = &mut self.worst[kind as usize];
        // A NaN is a finding.
        if ratio <= 1.0 || place.as_ref().is_some_and(|worst| worst.ratio >= ratio) {
            return;
        }
        let row = &self.rows.rows[k];
        let text = format!(
            "axis {} at tick {k} (line {}, feed {:.4}, limit {}): {value:.6e}, allowed {allowed:.6e}",
            self.name, row.line, row.feed, row.limit
        );
        *place = Some(Finding { kind, ratio, text });
    }
}
