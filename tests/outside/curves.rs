//! Splines, polynomials and circles in space from NC text to set-points: limits of every axis by differences, points that are met.
//!
//! CSPLINE and BSPLINE SD=3 go on with their curvature from block to block, so that the limits hold across the borders of blocks as well,
//! without any allowance; all other blocks rest at their ends here.

use crate::replay::{MACHINES, machine, source};
use sollwert::kernel::{Kernel, Status};
use sollwert::machine::Machine;
use std::sync::Arc;

/// Positions of all axes at every set-point, with the line.
fn setpoints(machine: &Machine, text: &str) -> Vec<(u32, Vec<f64>)> {
    let mut kernel = Kernel::new(Arc::new(machine.clone()), source(text), false);
    let mut rows = Vec::new();
    while kernel.cycle().unwrap() == Status::Running {
        let setpoint = kernel.output().setpoint.unwrap();
        let q = machine.axis_ids().map(|axis| setpoint.axes[axis].position_lu).collect();
        rows.push((setpoint.path.block.line, q));
    }
    assert!(kernel.take_findings().alarm.is_none(), "{text}");
    rows
}

/// No axis beyond velocity, acceleration and jerk anywhere.
fn within_limits(machine: &Machine, rows: &[(u32, Vec<f64>)], text: &str) {
    let t_s = machine.cycle.time_base.setpoint_period_s();
    for (i, axis) in machine.axes.iter().enumerate() {
        let limits = &axis.limits;
        let q = |k: usize| rows[k].1[i];
        for (k, (line, _)) in rows.iter().enumerate().take(rows.len() - 2).skip(1) {
            let v = (q(k + 1) - q(k)) / t_s;
            let a = (q(k + 1) - 2.0 * q(k) + q(k - 1)) / t_s.powi(2);
            let j = (q(k + 2) - 3.0 * q(k + 1) + 3.0 * q(k) - q(k - 1)) / t_s.powi(3);
            let at = format!("{} in line {}, {} s\n{text}", axis.name, line, k as f64 * t_s);
            assert!(v.abs() <= limits.velocity_max_lu_s * (1.0 + 1e-9), "velocity {v} of {at}");
            assert!(a.abs() <= limits.acceleration_max_lu_s2 * (1.0 + 1e-6), "acceleration {a} of {at}");
            // Rounding of positions and of the arc length: 1e-12 mm.
            let noise = 8e-12 / t_s.powi(3);
            assert!(j.abs() <= limits.jerk_max_lu_s3 * (1.0 + 1e-3) + noise, "jerk {j} of {at}");
        }
    }
}

/// Points of a contour with long and short steps.
fn points() -> Vec<[f64; 3]> {
    let waves =
        |i: f64| [6.0 * i + (1.7 * i).sin(), 25.0 * (0.5 * i).sin() + (2.3 * i).cos(), 30.0 + 4.0 * (0.9 * i).cos()];
    (0..40).map(|i| waves(f64::from(i))).collect()
}

#[test]
fn smooth_splines_keep_all_limits_across_their_blocks() {
    let points = points();
    let lines: String = points[1..].iter().map(|[x, y, z]| format!("X{x:.4} Y{y:.4} Z{z:.4}\n")).collect();
    let [x, y, z] = points[0];
    for name in MACHINES {
        let machine = machine(name, &[]);
        for word in ["CSPLINE", "BSPLINE", "CSPLINE BAUTO EAUTO"] {
            let text = format!("G60 G0 X{x} Y{y} Z{z}\nG64 F9000\n{word}\n{lines}G9 X250 Y0\nG60 G1 X260\nM30\n");
            let rows = setpoints(&machine, &text);
            within_limits(&machine, &rows, &text);
            if word.starts_with('C') {
                // 150 mm/s and 2 to 4 ms: no set-point may be further from the nearest than half of a step.
                let step = 150.0 * machine.cycle.time_base.setpoint_period_s();
                for p in &points[1..] {
                    let nearest = rows.iter().map(|(_, q)| (0..3).map(|i| (q[i] - p[i]).powi(2)).sum::<f64>().sqrt());
                    let nearest = nearest.fold(f64::INFINITY, f64::min);
                    assert!(nearest <= 0.51 * step + 1e-4, "{name} {word}: {nearest} mm from {p:?}");
                }
            }
        }
    }
}

/// Two equal control points of a BSPLINE SD=3 leave the curvature continuous; at three the curve has a corner, where G60 rests at the
/// border of the blocks, and a block without a way; at the end it begins or stops with a speed of the parameter of 0.
#[test]
fn repeated_control_points_keep_all_limits() {
    let leg = |times: usize| "X30 Y25 Z12\n".repeat(times);
    for name in MACHINES {
        let machine = machine(name, &[]);
        for (mode, times) in [("G64", 2), ("G60", 2), ("G60", 3), ("G60", 5)] {
            let end = "X60 Y30\n".repeat(times - 1) + "G9 X60 Y30\n";
            let text = format!(
                "G60 G0 X0 Y0 Z10\n{mode} G1 F9000\nBSPLINE X10 Y20\n{}X45 Y-5 Z15\nX52 Y20\n{end}G60 G1 X70\nM30\n",
                leg(times)
            );
            let rows = setpoints(&machine, &text);
            within_limits(&machine, &rows, &text);
            let nearest = |point: [f64; 3]| {
                let away = rows.iter().map(|(_, q)| (0..3).map(|i| (q[i] - point[i]).powi(2)).sum::<f64>().sqrt());
                away.fold(f64::INFINITY, f64::min)
            };
            assert!(nearest([60.0, 30.0, 15.0]) < 1e-4, "{name} {mode}, {times} times: the last point");
            // Rests lie between two set-points. A curve of degree 3 passes a point that counts three times, and misses one that counts twice.
            let passes = nearest([30.0, 25.0, 12.0]) < 1e-4;
            assert_eq!(passes, times >= 3, "{name} {mode}, {times} times: {}", nearest([30.0, 25.0, 12.0]));
        }
    }
}

#[test]
fn polynomials_circles_in_space_and_akima_keep_all_limits() {
    let text = "\
G60 G0 X0 Y0 Z10
G1 F12000
POLY PO[X]=(40, 30, -20) PO[Y]=(10, -60, 80, 5) Z20
PO[X]=(0,-10) PO[Y]=(20) PO[]=(2,1) PL=1
X0 Y0 PO[Z]=(5, 3, -2, 1, 4) PL=2.5
CIP X10 Y10 Z25 I1=20 J1=-3 K1=9
CIP X0 Y0 Z5 I1=-5 J1=12 K1=30 TURN=1
ASPLINE X10 Y20
X30 Y10 Z0
X40 Y40
X70 Y0 Z8
G1 X80
CT X90 Y20
M30
";
    for name in MACHINES {
        let machine = machine(name, &[]);
        within_limits(&machine, &setpoints(&machine, text), text);
    }
}

/// Two equal points with SD=2 are a corner at the end of a block: G60 rests in it, and no axis steps.
#[test]
fn the_corner_of_a_quadratic_spline_is_the_end_of_a_block() {
    let text = "G60 G0 X0 Y0\nG1 F9000\nBSPLINE SD=2 X10 Y20\nX30 Y25\nX30 Y25\nX45 Y-5\nX52 Y20\nG1 X70\nM30\n";
    for name in MACHINES {
        let machine = machine(name, &[]);
        let t_s = machine.cycle.time_base.setpoint_period_s();
        let rows = setpoints(&machine, text);
        for (i, axis) in machine.axes.iter().enumerate() {
            let accelerations = rows.windows(3).map(|q| (q[2].1[i] - 2.0 * q[1].1[i] + q[0].1[i]) / t_s.powi(2));
            let most = accelerations.fold(0.0, |most: f64, a| most.max(a.abs()));
            assert!(most <= axis.limits.acceleration_max_lu_s2 * (1.0 + 1e-6), "{name} {}: {most}", axis.name);
        }
        let ends = rows.iter().rfind(|(line, _)| *line == 4).unwrap();
        assert!((ends.1[0] - 30.0).hypot(ends.1[1] - 25.0) < 1e-3, "{name}: {ends:?}");
    }
}

/// The alarm names the axis that the program sends out of all numbers, or holds still, and no other.
#[test]
fn an_axis_that_cannot_is_named() {
    let cases = [
        ("POLY PO[X]=(2, 1EX300, -1EX300) PO[Y]=(1, 2, 3)", "P0001", "axis X"),
        ("POLY PO[X]=(2, 1, 1) PO[Y]=(2, 1EX300, -1EX300)", "P0001", "axis Y"),
        ("G1 X10 Y10 VELOLIM[Y]=0.000000001", "P0002", "velocity of axis Y"),
    ];
    for name in MACHINES {
        for (block, code, named) in cases {
            for law in ["continuous", "seven-phase"] {
                let machine = machine(name, &[format!("feed.time_law={law}")]);
                let text = format!("G1 F1000\n{block}\nM30\n");
                let mut kernel = Kernel::new(Arc::new(machine), source(&text), false);
                while kernel.cycle().unwrap() == Status::Running {}
                let alarm = kernel.take_findings().alarm.expect(block);
                assert_eq!((alarm.code, alarm.line()), (code, 2), "{name} {law}: {alarm:?}");
                assert!(alarm.message.contains(named), "{name} {law}: {}", alarm.message);
            }
        }
    }
}
