//! Cycle times in closed form, through the whole chain: N = ceil(T / t_s).

use crate::replay::{MACHINES, Replay, machine, replay};

/// The run took the time of the closed form, rounded up to the next cycle.
fn takes(run: &Replay, wanted_s: f64, case: &str) {
    let cycles = (wanted_s / run.t_s * (1.0 - 1e-9)).ceil();
    assert_eq!(run.summary.setpoints as f64, cycles, "{case}: {wanted_s} s in cycles of {} s", run.t_s);
}

/// models/feed-prediction-and-surface.md section 2.
fn rest_to_rest_s(length: f64, v: f64, a: f64, j: f64) -> f64 {
    let reaches_a = v > a * a / j;
    let ramp = if reaches_a { v / a + a / j } else { 2.0 * (v / j).sqrt() };
    if length >= v * ramp {
        return length / v + ramp;
    }
    let short = 4.0 * (length / (2.0 * j)).cbrt();
    // The peak speed of the jerk-only profile must not ask for more than a.
    let peak = length / (short / 2.0);
    if peak <= a * a / j {
        return short;
    }
    // peak ramp: v (v/a + a/j) = length
    let b = a * a / j;
    let peak = 0.5 * (-b + (b * b + 4.0 * a * length).sqrt());
    2.0 * (peak / a + a / j)
}

#[test]
fn a_line_from_rest_to_rest() {
    for name in MACHINES {
        let machine = machine(name, &[]);
        let x = &machine.axes[0];
        let limits = &x.limits;
        for feed in [100.0, 1000.0, 3000.0, 10000.0, 100_000.0] {
            for length in [0.01, 0.1, 1.0, 10.0, 123.0] {
                let end = x.home_lu + length;
                let text = format!("G60 G1 X={end} F{feed}\nM30\n");
                let v = (feed / 60.0_f64).min(limits.velocity_max_lu_s);
                let (a, j) = (limits.acceleration_max_lu_s2, limits.jerk_max_lu_s3);
                let length = end - x.home_lu;
                // A block lasts a cycle at least: v <= L / t_s.
                let run = replay(&machine, &text);
                let v = v.min(length / run.t_s);
                takes(&run, rest_to_rest_s(length, v, a, j), &format!("{name} {text}"));
            }
        }
    }
}

/// A diagonal: each axis sees its share, so that the path has 1/cos of the limits of the weaker one.
#[test]
fn a_diagonal_from_rest_to_rest() {
    let machine = machine("mikron_ucp710", &[]);
    let run = replay(&machine, "G60 G0 X30 Y40\nM30\n");
    let (x, y) = (&machine.axes[0].limits, &machine.axes[1].limits);
    let both = |x: f64, y: f64| (x / 0.6).min(y / 0.8);
    let v = both(x.velocity_max_lu_s, y.velocity_max_lu_s);
    let a = both(x.acceleration_max_lu_s2, y.acceleration_max_lu_s2);
    let j = both(x.jerk_max_lu_s3, y.jerk_max_lu_s3);
    takes(&run, rest_to_rest_s(50.0, v, a, j), "diagonal");
}

/// Only a rotary axis moves: F is in deg/min.
#[test]
fn a_rotation_from_rest_to_rest() {
    let machine = machine("mikron_ucp710", &[]);
    let run = replay(&machine, "G60 G1 C90 F1800\nM30\n");
    let limits = &machine.axes[machine.axis_by_name("C").unwrap().index()].limits;
    let v = 30_f64.to_radians();
    takes(
        &run,
        rest_to_rest_s(90_f64.to_radians(), v, limits.acceleration_max_lu_s2, limits.jerk_max_lu_s3),
        "rotation",
    );
    assert!((run.rows[run.rows.len() / 2].feed - v).abs() < 1e-9);
    assert_eq!(run.summary.path_length_mm, 0.0);
}

/// A circle in the middle of a tangential path is passed at F: 2 pi R / F, whatever the phase.
#[test]
fn a_circle_at_constant_feed() {
    for name in MACHINES {
        let machine = machine(name, &[]);
        let [x, y] = [machine.axes[0].home_lu, machine.axes[1].home_lu];
        let sense = if x < 0.0 { 1.0 } else { -1.0 };
        let word = if sense > 0.0 { "G3" } else { "G2" };
        let [x1, x2] = [x + sense * 40.0, x + sense * 80.0];
        let text = format!("G64 G1 X={x1} F600\n{word} X={x1} Y={y} J=30\nG1 X={x2}\nM30\n");
        let run = replay(&machine, &text);
        let on_it: Vec<_> = run.rows.iter().filter(|row| row.line == 2).collect();
        let feed = 10.0;
        assert!(on_it.iter().all(|row| (row.feed - feed).abs() < 1e-9), "{name}");
        let wanted = 60.0 * std::f64::consts::PI / feed;
        assert!((on_it.len() as f64 * run.t_s - wanted).abs() <= run.t_s + 1e-9, "{name}");
        let centre = [x1, y + 30.0];
        let off = on_it.iter().map(|row| (row.q[0] - centre[0]).hypot(row.q[1] - centre[1]) - 30.0);
        assert!(off.fold(0.0, |most: f64, off| most.max(off.abs())) < 1e-9, "{name}");
        // Two ramps, and all the way at F between.
        let limits = &machine.axes[0].limits;
        let line = rest_to_rest_s(80.0, feed, limits.acceleration_max_lu_s2, limits.jerk_max_lu_s3);
        takes(&run, line + wanted, name);
    }
}

/// A dwell stands still for its time, and nothing around it is rounded to cycles.
#[test]
fn dwells() {
    let machine = machine("spinner_mvc850", &[]);
    let limits = &machine.axes[0].limits;
    for time_s in [0.0004, 0.001, 0.0105, 0.7] {
        let text = format!("G1 X10 F3000\nG4 F={time_s}\nX20\nG4 F={time_s}\nM30\n");
        let run = replay(&machine, &text);
        let line = rest_to_rest_s(10.0, 50.0, limits.acceleration_max_lu_s2, limits.jerk_max_lu_s3);
        takes(&run, 2.0 * (line + time_s), &text);
        let waits = run.rows.iter().filter(|row| row.line == 2).count() as f64;
        assert!((waits * run.t_s - time_s).abs() < run.t_s, "{text}");
    }
    let run = replay(&machine, "G4 F0.25\nM30\n");
    takes(&run, 0.25, "nothing but a dwell");
}

/// The times of blocks add up as they are: a hundred lines at exact stop last a hundred times one line.
#[test]
fn nothing_is_rounded_to_cycles() {
    let machine = machine("huron_kx10", &[]);
    let limits = &machine.axes[0].limits;
    let text: String = (1..=100).map(|n| format!("X={}\n", f64::from(n) * 1.37)).collect();
    let run = replay(&machine, &format!("G60 G1 F2000\n{text}M30\n"));
    let one = rest_to_rest_s(1.37, 2000.0 / 60.0, limits.acceleration_max_lu_s2, limits.jerk_max_lu_s3);
    takes(&run, 100.0 * one, "a hundred lines");
}
