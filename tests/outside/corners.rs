//! What happens where two programmed motions meet, from the contract's definitions; and that the run did it: `corners` is the list of
//! the blends that ought to be there, with angle, tolerance, T and the feed at the entry.

use crate::replay::{Element, Elements, MACHINES, Posture, Replay, Row, linear, machine, minus, norm, replay};
use crate::text::{Kind, dense, program};
use sollwert::interpreter::Compressor;
use sollwert::machine::{Machine, PathMode};

/// Transition between two elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transition {
    Stop,
    Pass,
    Blend(Blend),
    /// A polynomial: direction and curvature go on, and its length is the control's affair.
    Smooth,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    pub angle_rad: f64,
    pub tolerance_mm: f64,
    pub t_mm: f64,
}

fn moves_rotary(element: &Element, linear: &[bool; 5]) -> bool {
    (0..5).any(|i| !linear[i] && element.start[i] != element.end[i])
}

/// CONTRACT section 4 (`corners`), models/local-smoothing.md section 1.
pub fn transition(machine: &Machine, before: &Element, after: &Element) -> Transition {
    let linear = linear(machine);
    let mode = before.modes.path_mode;
    let [length_before, length_after] = [before.length_mm(&linear), after.length_mm(&linear)];
    if before.waits_after || mode == PathMode::ExactStop || (length_before == 0.0) != (length_after == 0.0) {
        return Transition::Stop;
    }
    let curved = before.arc.is_some() || after.arc.is_some();
    if mode == PathMode::G64 {
        return Transition::Pass;
    }
    match (before.modes.compressor, curved) {
        (Compressor::Off, _) | (_, true) => {}
        // Curvature steps.
        (Compressor::On, _) => return Transition::Pass,
        _ => return Transition::Smooth,
    }
    let [u, v] = [before.direction(true, &linear), after.direction(false, &linear)];
    let own_shape = matches!(mode, PathMode::G643 | PathMode::G644);
    if own_shape || curved || moves_rotary(before, &linear) || moves_rotary(after, &linear) {
        return polynomial_transition(machine, [before, after], [u, v]);
    }
    let cos: f64 = u.iter().zip(&v).map(|(a, b)| a * b).sum();
    // The angle by another formula than the program's; good to 1e-8 rad near 0 and 180 deg.
    let angle_rad = (norm(&minus(&v, &(u.map(|x| x * cos))))).atan2(cos);
    let smoothing = &machine.smoothing;
    let wanted_mm = if mode == PathMode::G641 {
        rounding_distance_mm(machine, before, after)
    } else {
        let reverses = u.iter().zip(&v).any(|(a, b)| a * b < 0.0 && a.abs() > 1e-9 && b.abs() > 1e-9);
        let beta = if reverses { smoothing.tolerance_reversal_ratio } else { smoothing.tolerance_ratio };
        let programmed_mm = before.modes.contour_tolerance_mm.unwrap_or(smoothing.contour_tolerance_mm);
        4.0 * beta * programmed_mm / ((4.0 - smoothing.alpha_ratio) * (angle_rad / 2.0).sin())
    };
    if !(wanted_mm > 0.0 && angle_rad >= 1e-3) {
        return Transition::Pass;
    }
    if angle_rad > 2.0 * 0.01_f64.acos() {
        return Transition::Stop;
    }
    let t_mm = wanted_mm.min(length_before / 2.0).min(length_after / 2.0);
    let tolerance_mm = t_mm * (4.0 - smoothing.alpha_ratio) * (angle_rad / 2.0).sin() / 4.0;
    Transition::Blend(Blend { angle_rad, tolerance_mm, t_mm })
}

/// ADIS; next to one rapid it is said by the other block.
fn rounding_distance_mm(machine: &Machine, before: &Element, after: &Element) -> f64 {
    let modes = if before.feed.is_none() && after.feed.is_some() { &after.modes } else { &before.modes };
    modes.rounding_distance_mm.or(machine.smoothing.rounding_distance_mm).unwrap_or(0.0)
}

/// Where arcs or rotary axes take part, and in G643 and G644. Directions of all axes.
fn polynomial_transition(machine: &Machine, [before, after]: [&Element; 2], [u, v]: [Posture; 2]) -> Transition {
    let linear = linear(machine);
    let rotary_only = before.length_mm(&linear) == 0.0;
    let angle = |counts: &dyn Fn(usize) -> bool| {
        let [u, v] = [u, v].map(|w| -> Posture {
            let counted: Posture = std::array::from_fn(|i| if counts(i) { w[i] } else { 0.0 });
            counted.map(|component| component / norm(&counted))
        });
        2.0 * norm(&minus(&v, &u)).atan2(norm(&std::array::from_fn::<f64, 5, _>(|i| u[i] + v[i])))
    };
    let unrounded = before.modes.path_mode == PathMode::G641 && rounding_distance_mm(machine, before, after) <= 0.0;
    if unrounded || angle(&|_| true) < 1e-3 {
        return Transition::Pass;
    }
    if angle(&|i| linear[i] != rotary_only) > 2.0 * 0.01_f64.acos() {
        return Transition::Stop;
    }
    Transition::Smooth
}

/// All transitions, by the number of the block that ends there.
pub fn transitions(machine: &Machine, elements: &Elements) -> Vec<(u64, Transition)> {
    let pairs = elements.iter().zip(elements.iter().skip(1));
    pairs.map(|((number, before), (_, after))| (*number, transition(machine, before, after))).collect()
}

/// How far before the corner at the end of its block a row stands, along the block; on a blend this is less than T.
pub fn before_corner_mm(element: &Element, row: &Row, linear: &[bool; 5]) -> f64 {
    let u = element.direction(true, linear);
    minus(&element.end, &row.q).iter().zip(&u).map(|(d, u)| d * u).sum()
}

fn check(machine: &Machine, case: &str, run: &Replay) {
    let linear = linear(machine);
    let wanted: Vec<(u64, Blend)> = transitions(machine, &run.elements)
        .into_iter()
        .filter_map(|(number, transition)| match transition {
            Transition::Blend(blend) => Some((number, blend)),
            _ => None,
        })
        .collect();
    let lines: Vec<u32> = wanted.iter().map(|(number, _)| run.elements[number].line).collect();
    let listed: Vec<_> = run.summary.corners.iter().filter(|corner| lines.contains(&corner.line)).collect();
    assert_eq!(listed.len(), wanted.len(), "{case}: corners");
    let smooth = transitions(machine, &run.elements).iter().filter(|(_, at)| *at == Transition::Smooth).count();
    assert_eq!(run.summary.corners_total, (wanted.len() + smooth) as u64, "{case}");
    for (corner, (number, blend)) in listed.iter().zip(&wanted) {
        let element = &run.elements[number];
        let at = format!("{case} line {} {corner:?} {blend:?}", element.line);
        assert_eq!(corner.line, element.line, "{at}");
        assert!((corner.angle_deg - blend.angle_rad.to_degrees()).abs() < 1e-6, "{at}");
        assert!((corner.transition_length_mm - blend.t_mm).abs() <= 1e-7 * blend.t_mm, "{at}");
        assert!((corner.tolerance_mm - blend.tolerance_mm).abs() <= 1e-7 * blend.tolerance_mm, "{at}");
        assert!(corner.feed_mm_s > 0.0, "{at}");
        // The entry lies between two rows; between them the feed is monotone but for one peak, and a <= the largest axis limit.
        let before = run.rows.iter().rposition(|row| {
            row.block < *number || row.block == *number && before_corner_mm(element, row, &linear) >= blend.t_mm
        });
        let before = before.unwrap_or(0);
        let (a, b) = (run.rows[before].feed, run.rows[(before + 1).min(run.rows.len() - 1)].feed);
        let slack = 0.25 * run.t_s * 5_f64.sqrt() * acceleration_max(machine);
        assert!(corner.feed_mm_s >= a.min(b) - slack && corner.feed_mm_s <= a.max(b) + slack, "{at}: rows {a} {b}");
    }
}

fn acceleration_max(machine: &Machine) -> f64 {
    let linear = machine.axes.iter().filter(|axis| axis.kind == sollwert::base::AxisKind::Linear);
    linear.map(|axis| axis.limits.acceleration_max_lu_s2).fold(0.0, f64::max)
}

#[test]
fn corners_are_those_of_the_contract() {
    for name in MACHINES {
        let machine = machine(name, &[]);
        for seed in 0..12 {
            let kind = if seed % 3 == 2 { Kind::Mixed } else { Kind::Rounded };
            let run = replay(&machine, &program(seed, kind, 60, &[]));
            check(&machine, &format!("{name} seed {seed}"), &run);
        }
        check(&machine, &format!("{name} dense"), &replay(&machine, &dense("G642 CTOL=0.02", 6000.0, 400)));
    }
}

/// The corner that the contract shows: 90 deg at which Y reverses, so that epsilon = 0.06 and T = 8 * 0.06 / (3 sin 45 deg).
#[test]
fn the_corner_of_the_contract() {
    let machine = machine("spinner_mvc850", &[String::from("smoothing.blend_law=\"entry\"")]);
    let run = replay(&machine, include_str!("../../programs/corners.mpf"));
    let corner = &run.summary.corners[1];
    // Its points are rounded to a micron.
    assert!((corner.angle_deg - 90.0).abs() < 0.02, "{corner:?}");
    assert!((corner.tolerance_mm - 0.06).abs() < 1e-12, "{corner:?}");
    assert!((corner.transition_length_mm - 0.2263).abs() < 1e-4, "{corner:?}");
    assert!((corner.feed_mm_s - 5.97).abs() < 0.005, "{corner:?}");
}

/// For the other rooms of this test: the smallest distance of the sampled contour from a point.
pub fn nearest_mm(rows: &[Row], point: &Posture) -> f64 {
    let distance = |a: &Posture, b: &Posture| {
        let way = minus(b, a);
        let squared = norm(&way).powi(2);
        let along: f64 = minus(point, a).iter().zip(&way).map(|(x, w)| x * w).sum();
        let share = if squared > 0.0 { (along / squared).clamp(0.0, 1.0) } else { 0.0 };
        norm(&std::array::from_fn::<f64, 5, _>(|i| point[i] - a[i] - share * way[i]))
    };
    rows.windows(2).map(|pair| distance(&pair[0].q, &pair[1].q)).fold(f64::INFINITY, f64::min)
}
