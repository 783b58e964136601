//! Contour error, circles and corners on paths with closed forms.

use crate::made::{grid, normal, signal, smooth, trace};
use crate::random::Random;
use sollwert::compare::{CompareOptions, Follower, Line, compare, examine, prepare};
use sollwert::trace::Trace;
use std::f64::consts::{PI, TAU};

/// A trace whose set-points are `path(s(t))` and whose actual positions are `actual(t, set-point)`.
fn moved(
    step_s: f64,
    count: usize,
    setpoint: impl Fn(f64) -> [f64; 2],
    mut actual: impl FnMut(f64, [f64; 2]) -> [f64; 2],
) -> Trace {
    let times = grid(step_s, count);
    let real: Vec<[f64; 2]> = times.iter().map(|t| actual(t, setpoint(t))).collect();
    let at = |t: f64| real[(t / step_s).round() as usize];
    trace(vec![
        signal("X.position_setpoint_mm", "mm", &times, |t| setpoint(t)[0]),
        signal("Y.position_setpoint_mm", "mm", &times, |t| setpoint(t)[1]),
        signal("X.position_actual_mm", "mm", &times, |t| at(t)[0]),
        signal("Y.position_actual_mm", "mm", &times, |t| at(t)[1]),
    ])
}

/// Angle of a full circle in 4 s with soft ends, from a rest.
fn round(time_s: f64) -> f64 {
    TAU * smooth((time_s - 0.5) / 4.0)
}

fn on_circle(radius_mm: f64, angle_rad: f64) -> [f64; 2] {
    [radius_mm * angle_rad.cos(), radius_mm * angle_rad.sin()]
}

#[test]
fn a_circle_that_is_too_small_is_off_by_its_radius_error() {
    let (radius_mm, error_mm) = (20.0, 0.037);
    let a =
        moved(0.001, 5000, |t| on_circle(radius_mm, round(t)), |t, _| on_circle(radius_mm - error_mm, round(t - 0.01)));
    let side = examine(&a, None).expect("figures");
    let own = side.own.expect("a contour");
    // Chord error of the set-points at 60 mm/s: 0.06² / 160 = 2e-5 mm.
    let space = own.contour.space;
    assert!((space.rms - error_mm).abs() < 5e-5 && (space.max - error_mm).abs() < 5e-5, "{space:?}");
    // Counter-clockwise and too small: all of it on the left.
    let plane = own.contour.plane.expect("XY");
    assert!((plane.bias - error_mm).abs() < 5e-5, "{plane:?}");
    assert_eq!(own.features.circles.len(), 1, "{:?}", own.features.circles);
    let circle = &own.features.circles[0];
    assert!(circle.counter_clockwise && (circle.radius_mm - radius_mm).abs() < 1e-4, "{circle:?}");
    assert!((circle.radial_mean_um + 37.0).abs() < 0.1 && (circle.radial_max_um + 37.0).abs() < 0.1, "{circle:?}");
    // Round, though too small.
    assert!(circle.deviation_um < 0.1, "{circle:?}");
}

#[test]
fn the_circular_deviation_of_an_ellipse_is_twice_its_amplitude() {
    let (radius_mm, e_mm) = (15.0, 0.02);
    let oval = |t: f64| {
        let angle = round(t);
        on_circle(radius_mm + e_mm * (2.0 * angle).cos(), angle)
    };
    let a = moved(0.001, 5000, |t| on_circle(radius_mm, round(t)), |t, _| oval(t));
    let own = examine(&a, None).expect("figures").own.expect("a contour");
    let circle = &own.features.circles[0];
    // The window that finds the circle leaves out 2 degrees on either side of its start, the place of the largest radius: that moves the
    // least-squares centre by 0.02 mm * 2 sin(2 deg) / pi = 0.45 um, and the width of the ring by as much.
    assert!((circle.deviation_um - 40.0).abs() < 0.7, "{circle:?}");
    assert!((circle.radial_max_um - 20.0).abs() < 0.1 && (circle.radial_min_um + 20.0).abs() < 0.1, "{circle:?}");
    assert!(circle.bidirectional_um.is_none());
}

#[test]
fn both_directions_together_show_what_each_alone_hides() {
    // A circle forth and back; X is off by +5 um one way and by -5 um the other: each alone is round about a shifted centre.
    let angle = |t: f64| if t < 5.0 { round(t) } else { TAU - round(t - 5.0) };
    let shift_mm = 0.005;
    let a = moved(
        0.001,
        10_000,
        |t| on_circle(25.0, angle(t)),
        |t, p| [p[0] + if t < 5.0 { shift_mm } else { -shift_mm }, p[1]],
    );
    let own = examine(&a, None).expect("figures").own.expect("a contour");
    let circles = &own.features.circles;
    assert_eq!(circles.len(), 2, "{circles:?}");
    assert!(circles[0].counter_clockwise && !circles[1].counter_clockwise);
    for circle in circles {
        assert!(circle.deviation_um < 0.2, "{circle:?}");
        // About the centre of both the radii run from R - 5 um to R + 5 um.
        let both = circle.bidirectional_um.expect("a partner");
        assert!((both - 10.0).abs() < 0.3, "{both}");
    }
}

#[test]
fn a_circle_that_is_driven_back_at_once_is_two_circles() {
    // The path runs back over itself, and the tool lags behind by 20 ms and stays 3 um inside: each way keeps its own samples.
    let angle = |t: f64| TAU * (smooth((t - 0.5) / 4.0) - smooth((t - 4.5) / 4.0));
    let a = moved(0.001, 9500, |t| on_circle(25.0, angle(t)), |t, _| on_circle(24.997, angle(t - 0.02)));
    let circles = examine(&a, None).expect("figures").own.expect("a contour").features.circles;
    assert_eq!(circles.len(), 2, "{circles:?}");
    assert!(circles[0].counter_clockwise && !circles[1].counter_clockwise, "{circles:?}");
    for circle in &circles {
        assert!((circle.radial_mean_um + 3.0).abs() < 0.1 && circle.deviation_um < 0.2, "{circle:?}");
        assert!(circle.bidirectional_um.is_some_and(|both| both < 0.2), "{circle:?}");
    }
}

#[test]
fn a_peak_behind_a_quadrant_is_found_there_and_only_there() {
    // 8 um outward, a half sine from 0 to 8 degrees behind 90 degrees.
    let peak_mm = |angle: f64| {
        let behind = (angle - PI / 2.0) / (8.0 * PI / 180.0);
        if (0.0..1.0).contains(&behind) { 0.008 * (PI * behind).sin() } else { 0.0 }
    };
    let a = moved(0.001, 5000, |t| on_circle(30.0, round(t)), |t, _| on_circle(30.0 + peak_mm(round(t)), round(t)));
    let own = examine(&a, None).expect("figures").own.expect("a contour");
    let peaks = own.features.circles[0].quadrant_peaks_um;
    assert!((peaks[1].expect("a peak") - 8.0).abs() < 0.1, "{peaks:?}");
    for quadrant in [2, 3] {
        assert!(peaks[quadrant].expect("a level").abs() < 0.1, "{peaks:?}");
    }
}

#[test]
fn a_lag_along_the_path_is_no_contour_error_even_where_it_crosses_itself() {
    // A lemniscate: crosses itself at right angles, and the point lags by 15 ms: 3 mm at 200 mm/s.
    let eight = |t: f64| {
        let w = TAU * smooth((t - 0.3) / 3.0);
        let d = 1.0 + w.sin().powi(2);
        [60.0 * w.cos() / d, 60.0 * w.sin() * w.cos() / d]
    };
    let a = moved(0.0005, 8000, eight, |t, _| eight(t - 0.015));
    let own = examine(&a, None).expect("figures").own.expect("a contour");
    // Chords of 0.1 mm on a radius of 20 mm at least: 0.01 / 160.
    assert!(own.contour.space.max < 1e-4, "{:?}", own.contour.space);
    assert!(own.contour.matched_share > 0.99);
    assert!(own.features.circles.is_empty());
}

#[test]
fn a_pass_beside_the_path_does_not_catch_the_point() {
    // There and back, 0.2 mm beside: each point is 0.12 mm off its own leg, towards the other one.
    let legs = |s: f64| match s {
        s if s <= 50.0 => [s, 0.0],
        s if s <= 50.2 => [50.0, s - 50.0],
        s => [100.2 - s, 0.2],
    };
    let line = Line::new(
        (0..=10_020).map(|k| (f64::from(k), legs(f64::from(k) * 0.01))).map(|(t, p)| (t, [p[0], p[1], 0.0])),
        1e-6,
    );
    let mut follower = Follower::new(&line, 0.0).expect("a line");
    let mut worst: (f64, f64) = (0.0, 1.0);
    for k in 0..=4800 {
        let found = follower.next([f64::from(k) * 0.01, 0.12, 0.0]).expect("a match");
        worst = (worst.0.max(found.distance_mm), worst.1.min(found.distance_mm));
        assert!((found.s_mm - f64::from(k) * 0.01).abs() < 1e-9, "{k}: {found:?}");
    }
    assert!((worst.0 - 0.12).abs() < 1e-12 && (worst.1 - 0.12).abs() < 1e-12, "{worst:?}");
}

#[test]
fn another_feed_smears_the_view_in_time_and_not_the_one_along_the_path() {
    // The same square, at half the feed between 2 s and 4 s of the reference; the signal is a function of the place.
    let square = |s: f64| {
        let s = s.clamp(0.0, 80.0);
        match s {
            s if s <= 20.0 => [s, 0.0],
            s if s <= 40.0 => [20.0, s - 20.0],
            s if s <= 60.0 => [60.0 - s, 20.0],
            s => [0.0, 80.0 - s],
        }
    };
    let way_a = |t: f64| 80.0 * smooth((t - 0.5) / 5.0);
    let slow = |t: f64| {
        if t < 2.0 {
            t
        } else if t < 4.0 {
            2.0 + 0.5 * (t - 2.0)
        } else {
            t - 1.0
        }
    };
    let make = |way: &dyn Fn(f64) -> f64, count: usize| {
        let mut made = moved(0.001, count, |t| square(way(t)), |t, _| square(way(t)));
        let times = grid(0.001, count);
        made.signals.push(signal("X.torque_reference_n_m", "N m", &times, |t| 3.0 * (way(t) / 5.0).sin()));
        prepare(&mut made);
        made
    };
    let a = make(&way_a, 6500);
    let b = make(&|t| way_a(slow(t)), 7500);
    let comparison = compare(&a, &b, &CompareOptions::default()).expect("figures");
    let torque = comparison.pairs.iter().find(|p| p.name == "X.torque_reference_n_m").expect("a pair");
    assert!(torque.in_time.expect("overlap").rms > 0.5, "{torque:?}");
    assert!(torque.along_path.expect("overlap").max < 0.01, "{torque:?}");
    let contour = comparison.contour.expect("paths");
    assert!(contour.contour.space.max < 1e-6, "{:?}", contour.contour.space);
    let [Some(one), Some(other)] = comparison.sides.map(|side| side.cycle_time_s) else { panic!("durations") };
    assert!((other - one - 1.0).abs() < 0.05, "{one} {other}");
}

#[test]
fn the_minimum_zone_is_narrower_where_the_least_squares_centre_stays_behind() {
    // A narrow bump on one side and a narrow dent on the other: a shift of h / 2 makes a ring of width h of them, and least squares hardly sees
    // them: its first harmonic is 2 h w sqrt(pi) / pi for a width w of the bells.
    let (h_mm, w_rad) = (0.02, 0.05);
    let bell = |angle: f64, at: f64| (-((angle - at + PI).rem_euclid(TAU) - PI).powi(2) / (w_rad * w_rad)).exp();
    let radius = |angle: f64| 30.0 + h_mm * (bell(angle, 0.8) - bell(angle, 0.8 + PI));
    let a = moved(0.0005, 10_000, |t| on_circle(30.0, round(t)), |t, _| on_circle(radius(round(t)), round(t)));
    let circle = examine(&a, None).expect("figures").own.expect("a contour").features.circles[0].clone();
    let least_squares_um = 1000.0 * 2.0 * h_mm * (1.0 - 2.0 * w_rad * PI.sqrt() / PI);
    assert!((circle.deviation_um - least_squares_um).abs() < 0.4, "{circle:?} {least_squares_um}");
    // The bells are not points: beside their tops the shifted circle shows a little more.
    assert!(
        circle.minimum_zone_um > 0.99 * 1000.0 * h_mm && circle.minimum_zone_um < 1.05 * 1000.0 * h_mm,
        "{circle:?}"
    );
}

#[test]
fn arcs_of_less_than_a_full_turn_are_counted_and_not_judged() {
    // A straight way, half a circle of 10 mm, a straight way back.
    let half = |t: f64| -> [f64; 2] {
        let s_mm = 60.0 * smooth(t / 4.0);
        let turned = (s_mm - 14.0).clamp(0.0, 10.0 * PI) / 10.0;
        let [x, y] = [10.0 * turned.sin(), 10.0 - 10.0 * turned.cos()];
        [x + s_mm.min(14.0) - (s_mm - 14.0 - 10.0 * PI).max(0.0), y]
    };
    let own = examine(&moved(0.001, 4000, half, |_, p| p), None).expect("figures").own.expect("a contour");
    assert!(own.features.circles.is_empty() && own.features.arcs_total == 1, "{:?}", own.features);
}

#[test]
fn a_corner_knows_its_overshoot_and_its_cut() {
    // Along X, then along Y; the actual path runs 12 um past the corner and swings back.
    let corner = |t: f64| if t < 1.0 { [30.0 * t, 0.0] } else { [30.0, 30.0 * (t - 1.0)] };
    let past_mm = |t: f64| if t < 1.0 { 0.0 } else { 0.012 * (-(t - 1.0) / 0.05).exp() * ((t - 1.0) / 0.002).min(1.0) };
    let a = moved(0.001, 2000, corner, |t, p| [p[0] + past_mm(t), p[1]]);
    let own = examine(&a, None).expect("figures").own.expect("a contour");
    assert_eq!(own.features.corners.len(), 1, "{:?}", own.features.corners);
    let found = own.features.corners[0];
    assert!((found.angle_deg - 90.0).abs() < 0.5, "{found:?}");
    assert!((found.s_mm - 30.0).abs() < 0.1 && (found.time_s - 1.0).abs() < 0.01, "{found:?}");
    // exp(-0.002 / 0.05) of the 12 um are left when the ramp is over.
    let most_um = 12.0 * (-0.04_f64).exp();
    assert!((found.overshoot_um - most_um).abs() < 0.1, "{found:?}, {most_um}");
    assert!(found.cut_um < 0.01, "{found:?}");
}

#[test]
fn noise_of_the_encoders_does_not_move_along_the_path_at_a_rest() {
    let mut random = Random::new(11);
    let sigma_mm = 0.001;
    // 3 s of rest, a line of 40 mm, 3 s of rest; noise of 1 um on both axes.
    let line = |t: f64| [40.0 * smooth((t - 3.0) / 2.0), 0.0];
    let make = |random: &mut Random| {
        moved(0.001, 8000, line, |_, p| [p[0] + sigma_mm * normal(random), p[1] + sigma_mm * normal(random)])
    };
    let (a, b) = (make(&mut random), make(&mut random));
    let comparison = compare(&a, &b, &CompareOptions::default()).expect("figures");
    let found = comparison.contour.expect("paths").contour;
    // Both are noisy, but a point and a segment of noise are never farther apart than a few standard deviations.
    assert!(found.space.max < 8.0 * sigma_mm, "{:?}", found.space);
    assert!(found.matched_share > 0.999, "{}", found.matched_share);
}
