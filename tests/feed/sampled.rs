//! Limits from outside: differences of the sampled positions of random paths, and the analytic values at the ticks.

use crate::support::{Program, Random, spinner};
use sollwert::base::AxisId;
use sollwert::feed::{LimitKind, PlannedPiece};
use sollwert::interpolator::Setpoint;
use sollwert::machine::{AccelerationMode, BlendShape, Machine, PathMode};
use sollwert::smoothing::PieceKind;

/// Central differences: velocity, acceleration and jerk of one axis around tick k.
fn differences(setpoints: &[Setpoint], k: usize, axis: AxisId, t_s: f64) -> [f64; 3] {
    let q = |i: usize| setpoints[i].axes[axis].position_lu;
    [
        (q(k + 1) - q(k)) / t_s,
        (q(k + 1) - 2.0 * q(k) + q(k - 1)) / (t_s * t_s),
        (q(k + 2) - 3.0 * q(k + 1) + 3.0 * q(k) - q(k - 1)) / (t_s * t_s * t_s),
    ]
}

/// Times at which the path itself steps: the acceleration (ends of blends), or the velocity (corners too flat for a blend).
fn steps(program: &Program, machine: &Machine) -> [Vec<f64>; 2] {
    let mut time_s = 0.0;
    let (mut accelerations, mut velocities) = (Vec::new(), Vec::new());
    let planned = program.planned(machine);
    for (before, after) in planned.iter().zip(&planned[1..]) {
        time_s += before.law.duration_s();
        let blend = |piece: &PlannedPiece| matches!(piece.path.contour.kind, PieceKind::Blend(..));
        if after.law.at(0.0).velocity_lu_s == 0.0 {
            continue;
        }
        let times = if blend(before) || blend(after) { &mut accelerations } else { &mut velocities };
        times.push(time_s);
    }
    [accelerations, velocities]
}

/// True if one of the ordered times lies within the cycles that the differences around tick k span.
fn near(times: &[f64], k: usize, t_s: f64) -> bool {
    let next = times.partition_point(|time_s| *time_s < (k as f64 - 1.0) * t_s - 1e-9);
    times.get(next).is_some_and(|time_s| *time_s <= (k as f64 + 2.0) * t_s + 1e-9)
}

/// Starts and ends of the blends, in order.
fn blends(program: &Program, machine: &Machine) -> Vec<[f64; 2]> {
    let mut time_s = 0.0;
    let mut blends = Vec::new();
    for piece in program.planned(machine) {
        let end_s = time_s + piece.law.duration_s();
        if matches!(piece.path.contour.kind, PieceKind::Blend(..)) {
            blends.push([time_s, end_s]);
        }
        time_s = end_s;
    }
    blends
}

/// True if the differences around tick k lie in one blend.
fn inside_blend(blends: &[[f64; 2]], k: usize, t_s: f64) -> bool {
    let (first_s, last_s) = ((k as f64 - 1.0) * t_s, (k as f64 + 2.0) * t_s);
    let at = blends.partition_point(|[_, end_s]| *end_s < last_s);
    blends.get(at).is_some_and(|[start_s, _]| *start_s <= first_s)
}

fn check(program: &Program, machine: &Machine, case: &str) {
    let setpoints = program.setpoints(machine);
    let t_s = machine.cycle.time_base.setpoint_period_s();
    let [mut accelerations, velocities] = steps(program, machine);
    if machine.smoothing.shape == BlendShape::Quintic {
        // The path has no step of curvature: nothing is exempt.
        accelerations.clear();
    }
    let blends = blends(program, machine);
    let time_s: f64 = program.planned(machine).iter().map(|piece| piece.law.duration_s()).sum();
    assert_eq!(setpoints.len() - 1, (time_s / t_s * (1.0 - 1e-9)).ceil() as usize, "{case}");

    let (first, last) = (&setpoints[0], &setpoints[setpoints.len() - 1]);
    for axis in machine.axis_ids() {
        assert_eq!(first.axes[axis].velocity_lu_s, 0.0);
        assert_eq!(first.axes[axis].position_lu, machine.axis(axis).home_lu);
        assert_eq!(last.axes[axis].velocity_lu_s, 0.0);
        assert_eq!(last.axes[axis].position_lu, program.end().0[axis], "{case}");
    }
    for k in 1..setpoints.len() - 2 {
        let corner = near(&velocities, k, t_s);
        let curvature = near(&accelerations, k, t_s);
        for axis in machine.axis_ids() {
            let limits = &machine.axis(axis).limits;
            let at = format!("{case} tick {k} line {} axis {}", setpoints[k].path.block.line, axis.index());
            let [v, a, j] = differences(&setpoints, k, axis, t_s);
            // A difference of positions of up to 1 m carries rounding: 1e-13 mm / t_s^n.
            assert!(v.abs() <= limits.velocity_max_lu_s * (1.0 + 1e-9), "{at}: v {v}");
            assert!(corner || a.abs() <= limits.acceleration_max_lu_s2 * (1.0 + 1e-6), "{at}: a {a}");
            let inside = inside_blend(&blends, k, t_s);
            let jerk_max = if inside { limits.transition_jerk_max_lu_s3 } else { limits.jerk_max_lu_s3 };
            assert!(corner || curvature || j.abs() <= jerk_max * (1.0 + 1e-3) + 1.0, "{at}: j {j}");
            let exact = &setpoints[k].axes[axis];
            assert!(exact.position_lu.is_finite());
            assert!(exact.velocity_lu_s.abs() <= limits.velocity_max_lu_s * (1.0 + 1e-9), "{at}");
            assert!(exact.acceleration_lu_s2.abs() <= limits.acceleration_max_lu_s2 * (1.0 + 1e-6), "{at}");
            assert!(exact.jerk_lu_s3.abs() <= limits.jerk_max_lu_s3 * (1.0 + 1e-3), "{at}: {}", exact.jerk_lu_s3);
            // The analytic derivatives are those of the positions, up to what jerk does in a cycle.
            assert!(corner || (exact.velocity_lu_s - v).abs() <= limits.acceleration_max_lu_s2 * t_s, "{at}");
        }
        let programmed = setpoints[k].path.programmed_feed_lu_s;
        assert!(programmed.is_none_or(|f| setpoints[k].path.feed_lu_s <= f * (1.0 + 1e-9)), "{case}");
        assert!(setpoints[k].path.path_length_mm >= setpoints[k - 1].path.path_length_mm - 1e-9, "{case}");
    }
}

fn machines() -> [Machine; 3] {
    let plain = spinner();
    let mut uneven = spinner();
    let weak = &mut uneven.axes[1].limits;
    weak.velocity_max_lu_s /= 10.0;
    weak.acceleration_max_lu_s2 /= 10.0;
    weak.jerk_max_lu_s3 /= 10.0;
    weak.transition_jerk_max_lu_s3 /= 10.0;
    let mut quick = spinner();
    quick.look_ahead_blocks = 100;
    quick.smoothing.radial_acceleration_share = 0.5;
    quick.smoothing.radial_jerk_share = 0.5;
    [plain, uneven, quick]
}

#[test]
fn rounded_polylines_keep_all_limits() {
    for (m, machine) in machines().into_iter().enumerate() {
        for seed in 0..12 {
            let mut random = Random::new(200 + seed);
            let walk = random.walk(40, 0.01, [50.0, 2.0][seed as usize % 2]);
            let program = Program::polyline(PathMode::G642, random.logarithmic(500.0, 15_000.0), &walk);
            check(&program, &machine, &format!("machine {m} seed {seed}"));
        }
    }
}

#[test]
fn corners_rounded_without_a_step_of_curvature_keep_all_limits_at_their_ends_too() {
    for (m, mut machine) in machines().into_iter().enumerate() {
        machine.smoothing.shape = BlendShape::Quintic;
        for seed in 0..12 {
            let mut random = Random::new(700 + seed);
            let walk = random.walk(40, 0.01, [50.0, 2.0][seed as usize % 2]);
            let program = Program::polyline(PathMode::G642, random.logarithmic(500.0, 15_000.0), &walk);
            check(&program, &machine, &format!("machine {m} seed {seed}"));
        }
    }
}

#[test]
fn exact_stops_keep_all_limits_jerk_included_everywhere() {
    for (m, machine) in machines().into_iter().enumerate() {
        for seed in 0..6 {
            let walk = Random::new(300 + seed).walk(15, 0.01, 50.0);
            let program = Program::polyline(PathMode::ExactStop, 10_000.0, &walk);
            check(&program, &machine, &format!("machine {m} seed {seed}"));
        }
    }
}

#[test]
fn arcs_and_helices_keep_all_limits() {
    for (m, machine) in machines().into_iter().enumerate() {
        for seed in 0..12 {
            let mut random = Random::new(400 + seed);
            let mut program = Program::new(PathMode::ExactStop, random.logarithmic(500.0, 20_000.0));
            for _ in 0..6 {
                let end = program.end().0;
                let (radius, angle) = (random.logarithmic(0.05, 60.0), random.between(0.0, 6.3));
                let centre = [end.as_slice()[0] + radius * angle.cos(), end.as_slice()[1] + radius * angle.sin()];
                program.arc(
                    centre,
                    random.between(-7.0, 7.0),
                    if seed % 2 == 0 { random.between(0.0, radius) } else { 0.0 },
                );
            }
            check(&program, &machine, &format!("machine {m} seed {seed}"));
        }
    }
}

/// BRISK: acceleration steps, but not beyond its limit.
#[test]
fn brisk_paths_keep_velocity_and_acceleration() {
    for (m, machine) in machines().into_iter().enumerate() {
        for seed in 0..6 {
            let mut random = Random::new(600 + seed);
            let walk = random.walk(30, 0.05, 50.0);
            let mut program = Program::new(PathMode::G642, random.logarithmic(500.0, 15_000.0));
            program.modes.acceleration_mode = AccelerationMode::Brisk;
            walk.iter().for_each(|p| program.line(p));
            let setpoints = program.setpoints(&machine);
            for (k, setpoint) in setpoints.iter().enumerate() {
                for axis in machine.axis_ids() {
                    let (limits, exact) = (&machine.axis(axis).limits, &setpoint.axes[axis]);
                    assert!(exact.velocity_lu_s.abs() <= limits.velocity_max_lu_s * (1.0 + 1e-9));
                    let a = exact.acceleration_lu_s2.abs();
                    assert!(a <= limits.acceleration_max_lu_s2 * (1.0 + 1e-6), "machine {m} seed {seed} tick {k}: {a}");
                }
            }
            assert_eq!(setpoints[setpoints.len() - 1].axes[AxisId::new(0)].position_lu, walk[29][0]);
        }
    }
}

/// In G64 only the corners themselves break the limits: between them everything holds.
#[test]
fn unrounded_paths_keep_all_limits_between_corners() {
    let machine = spinner();
    for seed in 0..6 {
        let walk = Random::new(500 + seed).walk(30, 0.5, 50.0);
        let program = Program::polyline(PathMode::G64, 6000.0, &walk);
        let setpoints = program.setpoints(&machine);
        for axis in machine.axis_ids() {
            for k in 1..setpoints.len() - 2 {
                if setpoints[k - 1].path.block != setpoints[k + 2].path.block {
                    continue;
                }
                let [v, a, j] = differences(&setpoints, k, axis, 1e-3);
                let limits = &machine.axis(axis).limits;
                assert!(v.abs() <= limits.velocity_max_lu_s * (1.0 + 1e-9));
                assert!(a.abs() <= limits.acceleration_max_lu_s2 * (1.0 + 1e-6), "seed {seed}: {a}");
                assert!(j.abs() <= limits.jerk_max_lu_s3 * (1.0 + 1e-3) + 1.0, "seed {seed}: {j}");
            }
        }
    }
}

/// Every set-point names a limit, and the one that a long line at the programmed feed names is the feed.
#[test]
fn limits_are_named() {
    let machine = spinner();
    let setpoints = Program::polyline(PathMode::G642, 3000.0, &[[100.0, 0.0]]).setpoints(&machine);
    let share = |kind| setpoints[1..].iter().filter(|setpoint| setpoint.path.limit.kind == kind).count() as f64;
    let n = (setpoints.len() - 1) as f64;
    // Two ramps of 2 sqrt(50/15000) s, all of it jerk phases.
    let ramp_s = 2.0 * (50.0_f64 / 15_000.0).sqrt();
    assert!((share(LimitKind::Jerk) - 2.0 * ramp_s * 1000.0).abs() <= 3.0);
    assert!((share(LimitKind::Feed) - (n - 2.0 * ramp_s * 1000.0)).abs() <= 3.0);
    assert_eq!(share(LimitKind::Jerk) + share(LimitKind::Feed), n);
}
