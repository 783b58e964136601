//! Where the path goes and where it rests: tolerance at every programmed point, exact ends, rest at start, end and exact stops, the
//! programmed feed, the cycle time.
//!
//! Between two set-points the path is a parabola through three of them but for
//!
//! ```text
//! |q - parabola| <= J t_s³ / (9 sqrt 3)  +  A_step t_s² / 16
//! ```
//!
//! (Lagrange's remainder; A_step is what the acceleration steps by), so that a point can be looked for between set-points. Without a limit
//! of jerk the difference has no second derivative above 2 A: it is at most `A t_s² / 4`.

use crate::run::{Posture, Run, Target, distance, posture};
use crate::verdict::{Finding, Kind};
use sollwert::base::AxisKind;
use sollwert::interpreter::Compressor;
use sollwert::machine::{BlendShape, Machine, PathMode};

/// Places looked at between two set-points.
const LOOKS: usize = 16;

/// A path that goes through a programmed point: points of arcs are rounded to 1e-6 mm.
const MET_LU: f64 = 3e-6;

/// Steps of the direction below this are rounding.
const TURN_MIN: f64 = 1e-6;

/// What a programmed point may be missed by.
#[derive(Clone, Copy, Debug)]
struct Tolerance {
    linear_mm: f64,
    rotary_rad: f64,
}

pub fn check(machine: &Machine, run: &Run, places: &[(usize, f64)]) -> Vec<Finding> {
    let mut findings: Vec<Finding> = points(machine, run).into_iter().collect();
    findings.extend(feeds(run));
    findings.extend(rests(machine, run, places));
    findings.extend(ends(machine, run, places));
    findings
}

fn finding(kind: Kind, value: f64, allowed: f64, text: String) -> Option<Finding> {
    let ratio = value / allowed;
    // A NaN is a finding.
    (ratio.is_nan() || ratio > 1.0).then(|| Finding {
        kind,
        ratio,
        text: format!("{text}: {value:.6e}, allowed {allowed:.6e}"),
    })
}

fn tolerance(machine: &Machine, target: &Target, next: Option<&Target>) -> Tolerance {
    let smoothing = &machine.smoothing;
    let modes = &target.modes;
    let contour_mm = modes.contour_tolerance_mm.unwrap_or(smoothing.contour_tolerance_mm);
    let rotary_rad = smoothing.orientation_tolerance_rad;
    let linear = machine.axes.iter().filter(|axis| axis.kind == AxisKind::Linear).count() as f64;
    let mut tolerance = match modes.path_mode {
        PathMode::ExactStop | PathMode::G64 => Tolerance { linear_mm: 0.0, rotary_rad: 0.0 },
        // ADIS says nothing of rotary axes.
        PathMode::G641 => {
            // Beside a rapid the other block says it.
            let own = [Some(target), next].map(|target| target.and_then(|target| target.modes.rounding_distance_mm));
            Tolerance { linear_mm: own.iter().flatten().fold(0.0, |a, b| b.max(a)), rotary_rad: 10.0 }
        }
        PathMode::G642 => Tolerance { linear_mm: contour_mm, rotary_rad },
        // Every axis has its own.
        PathMode::G643 => Tolerance { linear_mm: contour_mm * linear.sqrt(), rotary_rad: rotary_rad.max(contour_mm) },
        PathMode::G644 => Tolerance { linear_mm: smoothing.contour_tolerance_mm * linear.sqrt(), rotary_rad },
        PathMode::G645 => Tolerance { linear_mm: contour_mm.max(smoothing.transition_tolerance_mm), rotary_rad },
    };
    if modes.compressor != Compressor::Off {
        tolerance.linear_mm = tolerance.linear_mm.max(contour_mm);
        tolerance.rotary_rad = tolerance.rotary_rad.max(rotary_rad);
    }
    tolerance
}

/// The worst of the programmed points.
fn points(machine: &Machine, run: &Run) -> Option<Finding> {
    let mut worst: Option<Finding> = None;
    for (n, target) in run.targets.iter().enumerate() {
        let first = run.targets[n.saturating_sub(1)].block;
        let last = run.targets.get(n + 2).map_or(u64::MAX, |target| target.block);
        let met = run.stretches.iter().filter(|stretch| (first..=last).contains(&stretch.block)).any(|stretch| {
            let end = stretch.path.as_ref().map_or(stretch.at, |path| posture(&path.at(f64::INFINITY).position.0));
            distance(&end, &target.end) <= MET_LU || distance(&stretch.at, &target.end) <= MET_LU
        });
        if met {
            continue;
        }
        let tolerance = tolerance(machine, target, run.targets.get(n + 1));
        let miss = missed(machine, run, [first, last], (target, tolerance));
        let text = format!("line {} is missed, over its tolerance by the factor", target.line);
        let next = finding(Kind::Tolerance, miss, 1.0, text);
        if next.as_ref().is_some_and(|next| worst.as_ref().is_none_or(|worst| worst.ratio < next.ratio)) {
            worst = next;
        }
    }
    worst
}

/// How near the path comes to a point, over the tolerance.
fn missed(machine: &Machine, run: &Run, blocks: [u64; 2], (target, tolerance): (&Target, Tolerance)) -> f64 {
    let t = run.t_s;
    let stepped =
        if machine.smoothing.shape == BlendShape::Quintic { 0.0 } else { machine.smoothing.radial_acceleration_share };
    let off: Vec<f64> = machine
        .axes
        .iter()
        .map(|axis| {
            let limits = &axis.limits;
            let jerk = limits.jerk_max_lu_s3.max(limits.transition_jerk_max_lu_s3);
            if run.brisk() {
                return limits.acceleration_max_lu_s2 * t * t / 4.0;
            }
            jerk * t.powi(3) * (1.0 / (9.0 * 3_f64.sqrt()) + 1.0 / 16.0)
                + stepped * limits.acceleration_max_lu_s2 * t * t / 16.0
        })
        .collect();
    let rows = &run.rows;
    let from = rows.partition_point(|row| row.block < blocks[0]).max(2) - 1;
    let to = rows.partition_point(|row| row.block <= blocks[1]).min(rows.len() - 1);
    let mut least = f64::INFINITY;
    for k in from..to {
        for look in 0..LOOKS {
            let u = look as f64 / LOOKS as f64;
            let (mut squared, mut slack, mut rotary) = (0.0, 0.0, 0.0_f64);
            for (i, axis) in machine.axes.iter().enumerate() {
                let [a, b, c] = [rows[k - 1].q[i], rows[k].q[i], rows[k + 1].q[i]];
                let q = b + 0.5 * u * (c - a) + 0.5 * u * u * (a - 2.0 * b + c);
                let step = (c - b).abs() / LOOKS as f64 / 2.0;
                let miss = (q - target.end[i]).abs();
                if axis.kind == AxisKind::Linear {
                    squared += miss * miss;
                    slack += (off[i] + step).powi(2);
                } else {
                    rotary = rotary.max(miss / (tolerance.rotary_rad + off[i] + step + MET_LU));
                }
            }
            let linear = squared.sqrt() / (tolerance.linear_mm + slack.sqrt() + MET_LU);
            least = least.min(linear.max(rotary));
        }
    }
    least
}

/// No faster along the path than the fastest F of the blocks that two set-points belong to.
fn feeds(run: &Run) -> Option<Finding> {
    let mut worst: Option<Finding> = None;
    for pair in run.rows.windows(2) {
        let targets = run.targets_of(&pair[0], &pair[1]);
        let fastest = targets.iter().map(|target| target.feed.unwrap_or(f64::INFINITY)).fold(0.0, f64::max);
        let feed = (pair[1].s_mm - pair[0].s_mm) / run.t_s;
        let text = format!("feed in line {}", pair[1].line);
        let next = finding(Kind::Feed, feed, fastest * (1.0 + 1e-6) + 1e-9 / run.t_s, text);
        if next.as_ref().is_some_and(|next| worst.as_ref().is_none_or(|worst| worst.ratio < next.ratio)) {
            worst = next;
        }
    }
    worst
}

/// Within a cycle of a rest every axis is no further from it than jerk (without its limit: acceleration) makes of rest in that time.
pub fn rests(machine: &Machine, run: &Run, places: &[(usize, f64)]) -> Option<Finding> {
    for k in 1..run.rows.len() {
        let (from, to) = (places[k - 1].0, places[k].0);
        let rests = (from..to).find(|n| run.joints[*n].rests);
        let Some(point) = rests.map(|n| run.stretches[n + 1].at) else { continue };
        // A corner on the way (G64): beyond it an axis may still be fast.
        if run.joints[from..to].iter().any(|joint| !joint.rests && joint.turn.iter().any(|turn| turn.abs() > TURN_MIN))
        {
            continue;
        }
        for row in [&run.rows[k - 1], &run.rows[k]] {
            let text = format!("exact stop before line {}, distance of a set-point", run.rows[k].line);
            let found = far(machine, run, &row.q, &point, false, &text);
            // Two rests in one cycle: only the way between them is short.
            if found.is_some() && (from..to).filter(|n| run.joints[*n].rests).count() == 1 {
                return found;
            }
        }
    }
    None
}

/// An axis that is further from `point` than jerk makes of rest in one cycle; `corner`: and the step of its velocity at a corner.
fn far(machine: &Machine, run: &Run, q: &Posture, point: &Posture, corner: bool, text: &str) -> Option<Finding> {
    machine.axes.iter().enumerate().find_map(|(i, axis)| {
        let jerk = axis.limits.jerk_max_lu_s3.max(axis.limits.transition_jerk_max_lu_s3);
        let soft = jerk * run.t_s.powi(3) / 6.0;
        let moved = if run.brisk() { axis.limits.acceleration_max_lu_s2 * run.t_s.powi(2) / 2.0 } else { soft };
        let step = (8.0 * axis.limits.acceleration_max_lu_s2 * axis.follow_up_tolerance_lu).sqrt();
        let left = if corner { step * run.t_s } else { 0.0 };
        let allowed = (moved + left) * (1.0 + 1e-6) + 1e-9;
        finding(Kind::Rest, (q[i] - point[i]).abs(), allowed, format!("{text}, axis {}", axis.name))
    })
}

/// Start, end, cycle time.
fn ends(machine: &Machine, run: &Run, places: &[(usize, f64)]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let (rows, home): (_, Posture) = (&run.rows, [0.0; 5]);
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return vec![Finding { kind: Kind::Rest, ratio: f64::INFINITY, text: "no set-points".into() }];
    };
    let end = run.targets.last().map_or(home, |target| target.end);
    findings.extend(finding(Kind::Rest, distance(&first.q, &home), 1e-12, "the first set-point is off home".into()));
    findings.extend(finding(
        Kind::Rest,
        distance(&last.q, &end),
        1e-12,
        "the last set-point is off the last point".into(),
    ));
    if rows.len() > 1 {
        let before = rows.len() - 2;
        let corners =
            [0..places[1].0, places[before].0..places[before + 1].0].map(|joints| run.turns(joints).count() > 0);
        findings.extend(far(machine, run, &rows[1].q, &home, corners[0], "start, distance of set-point 1"));
        let text = "end, distance of the last set-point but one";
        findings.extend(far(machine, run, &rows[before].q, &end, corners[1], text));
    }
    let cycles = (rows.len() - 1) as f64;
    if let Some(summary) = &run.summary {
        let off = (summary.cycle_time_s - cycles * run.t_s).abs() + (summary.setpoints as f64 - cycles).abs();
        findings.extend(finding(Kind::CycleTime, off, 1e-9, "cycle time and set-points".into()));
    }
    findings
}
