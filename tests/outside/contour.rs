//! The contour: where the path goes, and where it rests. From the set-points and the program alone.

use crate::corners::{Transition, before_corner_mm, nearest_mm, transition};
use crate::replay::{MACHINES, Replay, Row, linear, machine, minus, norm, replay};
use crate::text::{Kind, dense, planes, program};
use sollwert::machine::{Machine, PathMode};

/// Points of programs are rounded to 1e-6 mm at arcs; the control spreads that over the arc.
const ON_CONTOUR_MM: f64 = 2e-6;

/// Largest acceleration of any axis, for how far a path bends or speeds up between two rows.
fn acceleration_max(machine: &Machine) -> f64 {
    machine.axes.iter().map(|axis| axis.limits.acceleration_max_lu_s2).fold(0.0, f64::max)
}

fn check(machine: &Machine, case: &str, run: &Replay) {
    let linear = linear(machine);
    let rows_of = |number: u64| {
        let from = run.rows.partition_point(|row| row.block < number);
        &run.rows[from..run.rows.partition_point(|row| row.block <= number)]
    };
    // A chord is off the curve by A t_s^2 / 8 at most.
    let chord_mm = acceleration_max(machine) * run.t_s.powi(2) / 8.0 * 3_f64.sqrt();
    let mut numbers: Vec<u64> = run.elements.keys().copied().collect();
    numbers.push(u64::MAX);
    let mut head_mm = 0.0;
    for pair in numbers.windows(2) {
        let (number, next) = (pair[0], pair[1]);
        let element = &run.elements[&number];
        let at = format!("{case} line {}", element.line);
        let after = run.elements.get(&next);
        let end = after.map_or(Transition::Stop, |after| transition(machine, element, after));
        let tail_mm = if let Transition::Blend(blend) = end { blend.t_mm } else { 0.0 };
        let mut last_share = 0.0;
        let rows = rows_of(number);
        for row in rows {
            let before_end = before_corner_mm(element, row, &linear);
            if tail_mm > 0.0 && before_end < tail_mm - 1e-9 {
                let Transition::Blend(blend) = end else { continue };
                let Some(after) = after else { continue };
                let off = element.distance(&row.q).0.min(after.distance(&row.q).0);
                assert!(off <= blend.tolerance_mm + 1e-9, "{at}: {off} mm off the contour in {blend:?}");
                continue;
            }
            let (off, share) = element.distance(&row.q);
            if let (Transition::Smooth, Some(after), true) = (end, after, share > 0.5 - 1e-6) {
                let off = off.min(after.distance(&row.q).0);
                assert!(off <= smooth_mm(machine, element), "{at}: {off} mm off the contour");
                continue;
            }
            assert!(off <= ON_CONTOUR_MM, "{at}: {off} mm off the block");
            assert!(share >= last_share - 1e-9 || element.arc.is_some(), "{at}: backwards on the block");
            last_share = share;
        }
        match end {
            Transition::Blend(blend) => {
                let ctol = element.modes.contour_tolerance_mm.unwrap_or(machine.smoothing.contour_tolerance_mm);
                let from = run.rows.partition_point(|row| row.block < number).saturating_sub(1);
                let to = (run.rows.partition_point(|row| row.block <= next) + 1).min(run.rows.len());
                let distance = nearest_mm(&run.rows[from..to], &element.end);
                if element.modes.path_mode == PathMode::G642 {
                    assert!(distance <= ctol + chord_mm, "{at}: corner at {distance} mm");
                }
                // The middle of the blend is at epsilon, no other point of it is nearer. Chords cut to the corner's side.
                let off = (distance - blend.tolerance_mm).abs();
                assert!(off <= chord_mm + 1e-9, "{at}: corner at {distance} mm, not at {}", blend.tolerance_mm);
            }
            Transition::Stop => rests(machine, &at, run, rows, &element.end),
            Transition::Pass | Transition::Smooth => {}
        }
        // What G641 takes begins at most ADIS before the corner; blends never take more than half of a block.
        let length_mm = element.length_mm(&linear);
        assert!(head_mm + tail_mm <= length_mm * (1.0 + 1e-9) || length_mm == 0.0, "{at}");
        head_mm = tail_mm;
    }
}

/// What a polynomial blend may be off the contour: CTOL (ADIS takes no more than it is long), and OTOL of two
/// rotary axes.
fn smooth_mm(machine: &Machine, element: &crate::replay::Element) -> f64 {
    let (modes, smoothing) = (&element.modes, &machine.smoothing);
    let linear_mm = match modes.path_mode {
        PathMode::G641 => modes.rounding_distance_mm.unwrap_or(0.0),
        _ => modes.contour_tolerance_mm.unwrap_or(smoothing.contour_tolerance_mm),
    };
    // ADIS says nothing of rotary axes.
    let rotary_rad = if modes.path_mode == PathMode::G641 { 10.0 } else { 2.0 * smoothing.orientation_tolerance_rad };
    linear_mm + rotary_rad
}

/// The path comes to rest in a point: within a cycle of it the motion is below what jerk makes of rest in that time.
fn rests(machine: &Machine, at: &str, run: &Replay, rows: &[Row], point: &[f64; 5]) {
    let Some(last) = rows.last() else { return };
    for (i, axis) in machine.axes.iter().enumerate() {
        let jerk = axis.limits.jerk_max_lu_s3;
        let near = (last.q[i] - point[i]).abs();
        assert!(near <= jerk * run.t_s.powi(3) / 6.0 + 1e-9, "{at}: last row {near} from the stop");
        let v = last.velocity[i].abs();
        assert!(v <= jerk * run.t_s.powi(2) / 2.0 + 1e-9, "{at}: last row at {v} before the stop");
    }
}

#[test]
fn random_programs_keep_to_the_contour() {
    for name in MACHINES {
        let machine = machine(name, &[]);
        for (offset, kind) in [(500, Kind::Rounded), (600, Kind::Continuous), (700, Kind::Mixed)] {
            for seed in offset..offset + 5 {
                let run = replay(&machine, &program(seed, kind, 60, &[]));
                check(&machine, &format!("{name} seed {seed}"), &run);
            }
        }
    }
}

#[test]
fn rotary_programs_keep_to_the_contour() {
    for (name, rotary) in [("mikron_ucp710", ["A", "C"]), ("xyzbc", ["B", "C"])] {
        let machine = machine(name, &[]);
        for seed in 800..806 {
            let run = replay(&machine, &program(seed, Kind::Mixed, 60, &rotary));
            check(&machine, &format!("{name} seed {seed}"), &run);
        }
    }
}

#[test]
fn shipped_and_dense_programs_keep_to_the_contour() {
    for name in MACHINES {
        let machine = machine(name, &[]);
        check(&machine, &format!("{name} pocket"), &replay(&machine, include_str!("../../programs/pocket.mpf")));
        check(&machine, &format!("{name} spline"), &replay(&machine, include_str!("../../programs/spline.mpf")));
        check(&machine, &format!("{name} planes"), &replay(&machine, &planes()));
        for mode in ["G64", "G60", "G642 CTOL=0.02", "G641 ADIS=0.1"] {
            let blocks = if mode == "G60" { 60 } else { 300 };
            check(&machine, &format!("{name} {mode}"), &replay(&machine, &dense(mode, 6000.0, blocks)));
        }
    }
}

/// A blend of G641 leaves the line ADIS before the corner, and no row before that is off the line.
#[test]
fn g641_begins_at_its_distance() {
    let machine = machine("spinner_mvc850", &[]);
    let run = replay(&machine, "G641 ADIS=0.75\nG1 X20 F3000\nX20 Y20\nM30\n");
    let off: Vec<&Row> = run.rows.iter().filter(|row| row.q[0] < 20.0 - 1e-9 && row.q[1] > 1e-9).collect();
    let first = off.iter().map(|row| row.q[0]).fold(f64::INFINITY, f64::min);
    assert!(first > 19.25 && first < 19.27, "{first}");
    assert!(run.rows.iter().all(|row| norm(&minus(&row.q, &[20.0, 0.0, 0.0, 0.0, 0.0])) > 0.1));
}
