//! Splines, polynomials and arcs in any plane: every limit of every axis, from outside, and time that is not wasted.

use crate::support::{Program, Random, point, sample, spinner, total_s, with_rotary};
use sollwert::base::{AxisVector, PartPoint, PerAxis};
use sollwert::interpreter::{MoveKind, PolynomialGeometry, PolynomialPiece, SpatialArcGeometry};
use sollwert::machine::{AccelerationMode, Machine, PathMode};
use std::sync::Arc;

fn vector(values: &[f64]) -> AxisVector {
    point(values).0
}

/// Coefficients of u^0, u^1, ..., for u from 0 to 1.
fn geometry(rows: &[AxisVector], denominator: [f64; 6]) -> Arc<PolynomialGeometry> {
    let mut numerator_lu = [AxisVector::zero(); 6];
    numerator_lu[..rows.len()].copy_from_slice(rows);
    let piece = PolynomialPiece { parameter_end_ratio: 1.0, numerator_lu, denominator_ratio: denominator };
    Arc::new(PolynomialGeometry { pieces: vec![piece] })
}

/// Adds a polynomial from where the program stands: its coefficients from u^1 on.
fn polynomial(program: &mut Program, higher: &[AxisVector], denominator: [f64; 6], linear: &PerAxis<bool>) {
    let start = program.end().0;
    let d_end: f64 = denominator.iter().sum();
    let sum = higher.iter().fold(start, |sum, row| sum + *row);
    let end = PerAxis::from_fn(|axis| if linear[axis] { sum[axis] / d_end } else { sum[axis] });
    let rows: Vec<AxisVector> = [start].iter().chain(higher).copied().collect();
    program.push(MoveKind::Polynomial(geometry(&rows, denominator)), PartPoint(end));
}

/// Everything at every tick: differences of positions, and what the set-point says itself.
fn check(program: &Program, machine: &Machine, case: &str) {
    let setpoints = sample(machine, program.planned(machine));
    let t_s = machine.cycle.time_base.setpoint_period_s();
    let last = &setpoints[setpoints.len() - 1];
    assert!(setpoints.len() > 10, "{case}");
    for axis in machine.axis_ids() {
        assert_eq!(last.axes[axis].position_lu, program.end().0[axis], "{case}");
        let limits = &machine.axis(axis).limits;
        let q = |i: usize| setpoints[i].axes[axis].position_lu;
        for (k, setpoint) in setpoints.iter().enumerate().take(setpoints.len() - 2).skip(1) {
            let at = format!("{case} tick {k} line {} axis {}", setpoint.path.block.line, axis.index());
            let v = (q(k + 1) - q(k)) / t_s;
            let a = (q(k + 1) - 2.0 * q(k) + q(k - 1)) / (t_s * t_s);
            let j = (q(k + 2) - 3.0 * q(k + 1) + 3.0 * q(k) - q(k - 1)) / (t_s * t_s * t_s);
            assert!(v.abs() <= limits.velocity_max_lu_s * (1.0 + 1e-9), "{at}: v {v}");
            assert!(a.abs() <= limits.acceleration_max_lu_s2 * (1.0 + 1e-6), "{at}: a {a}");
            // Rounding of positions of up to 100 mm: 1e-14 mm / t_s³, a few times; the arc length is good to 1e-12.
            assert!(j.abs() <= limits.jerk_max_lu_s3 * (1.0 + 1e-3) + 10.0, "{at}: j {j}");
            let exact = &setpoint.axes[axis];
            assert!(exact.velocity_lu_s.abs() <= limits.velocity_max_lu_s * (1.0 + 1e-9), "{at}");
            assert!(exact.acceleration_lu_s2.abs() <= limits.acceleration_max_lu_s2 * (1.0 + 1e-6), "{at}");
            assert!(exact.jerk_lu_s3.abs() <= limits.jerk_max_lu_s3 * (1.0 + 1e-6), "{at}: {}", exact.jerk_lu_s3);
        }
    }
}

fn machines() -> [Machine; 3] {
    let mut uneven = spinner();
    let weak = &mut uneven.axes[1].limits;
    weak.velocity_max_lu_s /= 10.0;
    weak.acceleration_max_lu_s2 /= 10.0;
    weak.jerk_max_lu_s3 /= 10.0;
    [spinner(), uneven, with_rotary()]
}

#[test]
fn polynomials_keep_all_limits_of_all_axes() {
    const ONE: [f64; 6] = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for (m, machine) in machines().into_iter().enumerate() {
        let linear = machine.linear_mask();
        let rotary = machine.axes.len() > 3;
        for seed in 0..12 {
            let mut random = Random::new(7000 + seed);
            let mut program = Program::new(PathMode::ExactStop, random.logarithmic(500.0, 20_000.0));
            for _ in 0..3 {
                let size = random.logarithmic(0.1, 60.0);
                let degree = 2 + (random.unit() * 4.0) as usize;
                let rows: Vec<AxisVector> = (0..degree)
                    .map(|_| {
                        let mut row = [0.0; 4].map(|_| random.between(-size, size));
                        row[3] = if rotary { random.between(-0.5, 0.5) } else { 0.0 };
                        vector(&row)
                    })
                    .collect();
                let mut denominator = ONE;
                if seed % 3 == 2 {
                    denominator[1] = random.between(-0.4, 0.6);
                    denominator[2] = random.between(0.0, 0.4);
                }
                polynomial(&mut program, &rows, denominator, &linear);
            }
            check(&program, &machine, &format!("machine {m} seed {seed}"));
        }
    }
}

#[test]
fn arcs_in_any_plane_keep_all_limits() {
    for (m, machine) in machines().into_iter().enumerate() {
        for seed in 0..8 {
            let mut random = Random::new(7100 + seed);
            let mut program = Program::new(PathMode::ExactStop, random.logarithmic(500.0, 20_000.0));
            for _ in 0..4 {
                let [a, b] = [random.between(0.0, 6.3), random.between(-1.5, 1.5)];
                let normal = vector(&[a.cos() * b.cos(), a.sin() * b.cos(), b.sin()]);
                let d1 = vector(&[-a.sin(), a.cos(), 0.0]);
                let d2 = vector(&[-a.cos() * b.sin(), -a.sin() * b.sin(), b.cos()]);
                let (r, from) = (random.logarithmic(0.05, 60.0), random.between(0.0, 6.3));
                let sweep = random.between(-7.0, 7.0);
                let outward = |angle: f64| d1 * (angle.cos() * r) + d2 * (angle.sin() * r);
                let start = program.end().0;
                let centre = start - outward(from);
                let pitch = if seed % 2 == 0 { random.between(0.0, r) } else { 0.0 };
                let end = centre + outward(from + sweep) + normal * pitch;
                let arc =
                    SpatialArcGeometry { directions: [d1, d2], centre_mm: centre, radius_mm: r, sweep_rad: sweep };
                program.push(MoveKind::SpatialArc(Box::new(arc)), PartPoint(end));
            }
            check(&program, &machine, &format!("machine {m} seed {seed}"));
        }
    }
}

/// BRISK: no jerk, but acceleration and velocity hold; the cusp of x = t², y = t³ is passed.
#[test]
fn brisk_and_cusps() {
    let machine = spinner();
    let mut program = Program::new(PathMode::ExactStop, 6000.0);
    let size = 20.0;
    // t = 2u - 1: t² - 1 and t³ + 1.
    let rows = [vector(&[-4.0 * size, 6.0 * size]), vector(&[4.0 * size, -12.0 * size]), vector(&[0.0, 8.0 * size])];
    polynomial(&mut program, &rows, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], &machine.linear_mask());
    program.line(&[100.0, 100.0]);
    for mode in [AccelerationMode::Soft, AccelerationMode::Brisk] {
        program.modes.acceleration_mode = mode;
        for next in &mut program.moves {
            next.modes.acceleration_mode = mode;
        }
        let planned = program.planned(&machine);
        // 58 mm of curve and 117 mm of line at 100 mm/s, 1 m/s² and 15 m/s³: about 2 s; to creep past the cusp would take more.
        assert!(total_s(&planned) < 4.0, "{mode:?}: {}", total_s(&planned));
        for setpoint in sample(&machine, planned) {
            for axis in machine.axis_ids() {
                let (limits, exact) = (&machine.axis(axis).limits, &setpoint.axes[axis]);
                assert!(exact.velocity_lu_s.abs() <= limits.velocity_max_lu_s * (1.0 + 1e-9));
                assert!(exact.acceleration_lu_s2.abs() <= limits.acceleration_max_lu_s2 * (1.0 + 1e-6));
            }
        }
    }
}

/// A block that is nearly straight but for one tight place is not held to the speed of that place all along.
#[test]
fn a_tight_place_holds_only_what_is_near() {
    let machine = spinner();
    let mut program = Program::new(PathMode::ExactStop, 12_000.0);
    // x = 400 u, and a hump of 4 mm that is 40 mm wide: rational, so that it stays flat elsewhere.
    // y = 4 / (1 + ((x - 200)/10)²), as polynomial over the denominator 1 + (40 u - 20)².
    let denominator = [401.0, -1600.0, 1600.0, 0.0, 0.0, 0.0];
    let x = [0.0, 400.0 * 401.0, -400.0 * 1600.0, 400.0 * 1600.0];
    let y0 = 4.0 / 401.0;
    program.line(&[0.0, y0]);
    let rows = [vector(&[x[0], 4.0]), vector(&[x[1], 0.0]), vector(&[x[2], 0.0]), vector(&[x[3], 0.0])];
    let end = point(&[400.0, 4.0 / 401.0]);
    program.push(MoveKind::Polynomial(geometry(&rows, denominator)), end);
    check(&program, &machine, "hump");
    let planned = program.planned(&machine);
    let block: Vec<_> = planned.iter().filter(|piece| piece.path.contour.block.line == 2).collect();
    assert!(block.len() > 2, "{} parts", block.len());
    // One block, whose parts follow each other on the same curve.
    assert_eq!(block.iter().map(|piece| piece.path.contour.blocks_begun).sum::<u32>(), 1);
    assert!(block[..block.len() - 1].iter().all(|piece| !piece.path.contour.stop_at_end));
    for pair in block.windows(2) {
        let curve = |at: usize| pair[at].path.contour.curve().cloned();
        assert_eq!(curve(0).map(|curve| curve.end()), curve(1).map(|curve| curve.start()));
    }
    let speeds: Vec<f64> = block.iter().map(|piece| piece.law.at(piece.law.duration_s() / 2.0).velocity_lu_s).collect();
    let (low, high) =
        (speeds.iter().copied().fold(f64::INFINITY, f64::min), speeds.iter().copied().fold(0.0, f64::max));
    assert!(high > 2.0 * low, "{speeds:?}");
    let time_s: f64 = block.iter().map(|piece| piece.law.duration_s()).sum();
    let length: f64 = block.iter().map(|piece| piece.path.length_lu()).sum();
    assert!(time_s < 0.75 * length / low, "{time_s} s, {} s at the lowest speed", length / low);
}
