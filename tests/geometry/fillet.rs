//! The rounding of corners between arcs (models/arcs.md sections 2 and 3): published rows, every pair of senses from outside, and what
//! cannot be rounded.

use sollwert::geometry::{ArcCorner, Fillet, Junction, NoFillet, PlaneArc, Sense};
use std::f64::consts::{FRAC_PI_2, PI};

use crate::random::Random;

use Sense::{Clockwise, CounterClockwise};

type Point = [f64; 2];

fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn arc(start: Point, end: Point, radius: f64, sense: Sense) -> PlaneArc {
    PlaneArc::new(start, end, radius, sense).unwrap()
}

/// Centre of a minor arc, from its chord: to the left of it for a left-hand arc.
fn centre(start: Point, end: Point, radius: f64, sense: f64) -> Point {
    let chord = distance(start, end);
    let rise = (radius * radius - chord * chord / 4.0).max(0.0).sqrt() * sense / chord;
    let (dx, dy) = (end[0] - start[0], end[1] - start[1]);
    [(start[0] + end[0]) / 2.0 - dy * rise, (start[1] + end[1]) / 2.0 + dx * rise]
}

/// The two published contours: all arcs to the left, 80° each.
fn published(row: usize) -> ArcCorner {
    let ([c, d, e], [r1, r2]) = match row {
        0 => ([[10.0, 20.0], [46.36, 56.36], [109.54, 100.60]], [40.0, 60.0]),
        _ => ([[10.0, 20.0], [67.85, 20.0], [143.81, 6.6]], [45.0, 60.0]),
    };
    ArcCorner::new(arc(c, d, r1, CounterClockwise), arc(d, e, r2, CounterClockwise)).unwrap()
}

#[test]
fn the_published_rows() {
    let first = published(0);
    assert!((first.orientation_rad().to_degrees() - 90.0).abs() < 0.01, "{}", first.orientation_rad().to_degrees());
    let fillet = first.fillet_with_deviation(0.2).unwrap();
    assert!(
        (fillet.radius_mm - 0.49).abs() < 0.005 && (fillet.rounding_distance_mm - 0.48).abs() < 0.005,
        "{fillet:?}"
    );
    assert!(fillet.is_rounding_distance());

    let second = published(1);
    assert!((second.orientation_rad().to_degrees() - 90.0).abs() < 0.02);
    let fillet = second.fillet_with_deviation(0.02).unwrap();
    assert!(
        (fillet.radius_mm - 0.05).abs() < 0.002 && (fillet.rounding_distance_mm - 0.05).abs() < 0.002,
        "{fillet:?}"
    );
    // The print's 0.51 and 0.5 are those of straight sides; the arcs give these, and 3.47 where the print has 4.
    let fillet = second.fillet_with_deviation(0.213).unwrap();
    assert!(
        (fillet.radius_mm - 0.523).abs() < 5e-4 && (fillet.rounding_distance_mm - 0.513).abs() < 5e-4,
        "{fillet:?}"
    );
    assert!(!fillet.is_rounding_distance());
    let straight = 0.213 / (1.0 / (PI / 4.0).cos() - 1.0);
    assert!((straight - 0.51).abs() < 0.005);
    let fillet = second.fillet_with_deviation(1.29).unwrap();
    assert!((fillet.radius_mm - 3.47).abs() < 0.005, "{fillet:?}");
}

/// A corner at D with a given turn (positive: right), and what an outside view of it needs.
struct Case {
    points: [Point; 3],
    radii: [f64; 2],
    senses: [f64; 2],
    turn: f64,
}

impl Case {
    fn random(random: &mut Random, senses: [f64; 2], right: bool) -> Self {
        let logarithmic = |random: &mut Random, low: f64, high: f64| random.between(f64::ln(low), f64::ln(high)).exp();
        let d = [random.between(-100.0, 100.0), random.between(-100.0, 100.0)];
        let radii = [logarithmic(random, 0.5, 500.0), logarithmic(random, 0.5, 500.0)];
        let angles = [random.between(0.02, 3.1), random.between(0.02, 3.1)];
        let turn = random.between(0.01, 3.1) * if right { 1.0 } else { -1.0 };
        let reached = random.between(-3.0, 3.0);
        let left = reached - turn;
        // From D along the circle of each arc: back on the first, on along the second.
        let on_circle = |direction: f64, sense: f64, radius: f64, angle: f64| {
            let o = [d[0] - sense * radius * direction.sin(), d[1] + sense * radius * direction.cos()];
            let (sin, cos) = (sense * angle).sin_cos();
            let (x, y) = (d[0] - o[0], d[1] - o[1]);
            [o[0] + x * cos - y * sin, o[1] + x * sin + y * cos]
        };
        let c = on_circle(reached, senses[0], radii[0], -angles[0]);
        let e = on_circle(left, senses[1], radii[1], angles[1]);
        Self { points: [c, d, e], radii, senses, turn }
    }

    fn corner(&self) -> ArcCorner {
        let [c, d, e] = self.points;
        let sense = |sign: f64| if sign > 0.0 { CounterClockwise } else { Clockwise };
        let first = arc(c, d, self.radii[0], sense(self.senses[0]));
        ArcCorner::new(first, arc(d, e, self.radii[1], sense(self.senses[1]))).unwrap()
    }

    /// Section 3 from outside: tangent to both circles, eps from D on the inner side, contacts on the arcs.
    fn check(&self, fillet: &Fillet, name: &str) {
        let [c, d, e] = self.points;
        let fillet_sense = -self.turn.signum();
        assert_eq!(fillet.sense.sign(), fillet_sense, "{name}");
        let size = fillet.radius_mm + self.radii[0] + self.radii[1];
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * size;
        assert!(near(distance(fillet.centre_mm, d), fillet.radius_mm + fillet.deviation_mm), "{name} {fillet:?}");
        let arcs = [(c, d), (d, e)];
        for (i, (start, end)) in arcs.into_iter().enumerate() {
            let (r, s) = (self.radii[i], self.senses[i]);
            let o = centre(start, end, r, s);
            let same = s * fillet_sense;
            assert!(near(distance(fillet.centre_mm, o), r - same * fillet.radius_mm), "{name} arc {i} {fillet:?}");
            // The contact is on both circles, and on the part of the arc's circle between its ends.
            let m = fillet.contacts_mm[i];
            assert!(
                near(distance(m, o), r) && near(distance(m, fillet.centre_mm), fillet.radius_mm),
                "{name} radii {:?} off {} {}",
                self.radii,
                distance(m, o) - r,
                distance(m, fillet.centre_mm) - fillet.radius_mm
            );
            let swept = |from: Point, to: Point| {
                let angle = |p: Point| (p[1] - o[1]).atan2(p[0] - o[0]);
                (s * (angle(to) - angle(from))).rem_euclid(2.0 * PI)
            };
            let taken = if i == 0 { swept(m, d) } else { swept(d, m) };
            assert!(taken <= swept(start, end) + 1e-7, "{name} arc {i}: {taken}");
            assert!(near(taken * r, fillet.taken_mm[i]), "{name} arc {i}: {taken} {fillet:?}");
        }
        self.check_turn(fillet, fillet_sense, name);
    }

    /// The fillet leads from M to N without a step of direction, around the side of D that is inside the turn.
    fn check_turn(&self, fillet: &Fillet, fillet_sense: f64, name: &str) {
        let [c, d, e] = self.points;
        let (first, second) =
            (centre(c, d, self.radii[0], self.senses[0]), centre(d, e, self.radii[1], self.senses[1]));
        let direction = |p: Point, o: Point, sense: f64| (p[1] - o[1]).atan2(p[0] - o[0]) + sense * FRAC_PI_2;
        let [m, n] = fillet.contacts_mm;
        let start = direction(m, fillet.centre_mm, fillet_sense);
        let end = direction(n, fillet.centre_mm, fillet_sense);
        let same = |a: f64, b: f64| ((a - b + PI).rem_euclid(2.0 * PI) - PI).abs() < 1e-6;
        assert!(same(start, direction(m, first, self.senses[0])), "{name} {fillet:?}");
        assert!(same(end, direction(n, second, self.senses[1])), "{name} {fillet:?}");
        let swept = (fillet_sense * (end - start)).rem_euclid(2.0 * PI);
        assert!((swept - fillet.angle_rad).abs() < 1e-6 && swept < PI + 1e-6, "{name} {fillet:?}");
        // D lies outside the circle, seen from its centre between M and N: the deviation is measured on the fillet.
        let towards = direction(d, fillet.centre_mm, fillet_sense);
        let part = (fillet_sense * (towards - start)).rem_euclid(2.0 * PI);
        assert!(part > -1e-6 && part < swept + 1e-6, "{name} {fillet:?}");
        // TIT: the tangents at M and N meet at that distance of both.
        // (Towards half a turn they become parallel.)
        if swept > 3.0 {
            return;
        }
        let tip = |p: Point, direction: f64, way: f64| [p[0] + way * direction.cos(), p[1] + way * direction.sin()];
        let (from_m, from_n) = (tip(m, start, fillet.rounding_distance_mm), tip(n, end, -fillet.rounding_distance_mm));
        assert!(distance(from_m, from_n) < 1e-6 * (1.0 + fillet.rounding_distance_mm), "{name} {fillet:?}");
    }
}

#[test]
fn every_pair_of_senses_and_both_turns() {
    let mut fitted = [0; 8];
    for seed in 0..4000 {
        let mut random = Random::new(7000 + seed);
        let combination = (seed % 8) as usize;
        let sign = |bit: usize| if combination >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let case = Case::random(&mut random, [sign(0), sign(1)], combination >> 2 == 1);
        let corner = case.corner();
        let name = format!("seed {seed} {:?} turn {}", case.senses, case.turn);
        assert!((corner.orientation_rad() - case.turn).abs() < 1e-9, "{name}: {}", corner.orientation_rad());
        let largest = corner.largest_fillet().unwrap();
        case.check(&largest, &format!("{name} largest"));
        for share in [1e-4, 0.02, 0.5, 0.97] {
            let fillet = corner.fillet_with_radius(largest.radius_mm * share).unwrap();
            case.check(&fillet, &format!("{name} share {share}"));
            // The deviation grows with the radius, and each gives the other.
            assert!(fillet.deviation_mm < largest.deviation_mm, "{name}");
            let back = corner.fillet_with_deviation(fillet.deviation_mm).unwrap();
            let error = (back.radius_mm / fillet.radius_mm - 1.0).abs();
            assert!(error < 1e-5, "{name} share {share}: {error}");
            case.check(&back, &format!("{name} back from {share}"));
            fitted[combination] += 1;
        }
        // Beyond the largest there is none, and the alarm says how far it would go.
        let Err(NoFillet::TooLarge { largest: said }) = corner.fillet_with_deviation(largest.deviation_mm * 1.001)
        else {
            panic!("{name}: beyond the largest")
        };
        assert!((said.deviation_mm / largest.deviation_mm - 1.0).abs() < 1e-9, "{name}");
    }
    assert!(fitted.iter().all(|count| *count >= 1900), "{fitted:?}");
}

/// Straight sides: R_c = eps / (1/cos(gamma/2) - 1), TIT = R_c tan(gamma/2). Arcs of ever less bend go there.
#[test]
fn without_bend_it_is_the_fillet_of_lines() {
    for turn in [-2.5_f64, -1.0, 0.3, FRAC_PI_2, 2.9] {
        let (d, eps) = ([30.0, -5.0], 0.07);
        let e = [d[0] + 50.0 * turn.cos(), d[1] - 50.0 * turn.sin()];
        let radius_mm = eps / (1.0 / (turn / 2.0).cos() - 1.0);
        let distance_mm = radius_mm * (turn.abs() / 2.0).tan();
        for (radius, tolerance) in [(f64::INFINITY, 1e-12), (1e9, 1e-6)] {
            let corner =
                ArcCorner::new(arc([-20.0, -5.0], d, radius, Clockwise), arc(d, e, radius, CounterClockwise)).unwrap();
            let fillet = corner.fillet_with_deviation(eps).unwrap();
            assert!((fillet.radius_mm / radius_mm - 1.0).abs() < tolerance, "{turn} {radius}: {fillet:?}");
            assert!((fillet.rounding_distance_mm / distance_mm - 1.0).abs() < tolerance);
            assert!((fillet.taken_mm[0] / distance_mm - 1.0).abs() < tolerance.max(1e-9));
            assert!((fillet.angle_rad - turn.abs()).abs() < tolerance.max(1e-9));
        }
    }
}

#[test]
fn what_cannot_be_rounded_says_why() {
    let (c, d) = ([0.0, 0.0], [10.0, 0.0]);
    let no_arc = |end: Point, radius: f64| PlaneArc::new(c, end, radius, Clockwise).unwrap_err();
    assert_eq!(no_arc(c, 5.0), NoFillet::NoChord);
    assert_eq!(no_arc(d, 4.9), NoFillet::ChordTooLong { chord_mm: 10.0, diameter_mm: 9.8 });
    assert!(
        matches!(no_arc(d, -5.0), NoFillet::ChordTooLong { .. })
            && matches!(no_arc(d, f64::NAN), NoFillet::ChordTooLong { .. })
    );
    assert_eq!(no_arc([f64::NAN, 0.0], 5.0), NoFillet::NoChord);
    // Half a turn is an arc still.
    assert!((PlaneArc::new(c, d, 5.0, Clockwise).unwrap().angle_rad() - PI).abs() < 1e-7);

    let line = |from: Point, to: Point| arc(from, to, f64::INFINITY, Clockwise);
    assert!(matches!(ArcCorner::new(line(c, d), line([11.0, 0.0], [20.0, 5.0])), Err(NoFillet::Apart { .. })));
    let straight = ArcCorner::new(line(c, d), line(d, [20.0, 0.005])).unwrap();
    assert_eq!(
        (straight.junction(), straight.fillet_with_deviation(0.1)),
        (Junction::Tangential, Err(NoFillet::Tangential))
    );
    let cusp = ArcCorner::new(line(c, d), line(d, c)).unwrap();
    assert_eq!((cusp.junction(), cusp.fillet_with_radius(0.1)), (Junction::Cusp, Err(NoFillet::Cusp)));
    assert!((cusp.orientation_rad() - PI).abs() < 1e-12);
    let corner = ArcCorner::new(line(c, d), line(d, [10.0, 10.0])).unwrap();
    assert_eq!(corner.junction(), Junction::Corner);
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(corner.fillet_with_deviation(size), Err(NoFillet::NotPositive));
        assert_eq!(corner.fillet_with_radius(size), Err(NoFillet::NotPositive));
    }
    // Lines of 10 mm at 90°: the largest fillet takes them whole, R = 10, eps = 10 (sqrt 2 - 1).
    let largest = corner.largest_fillet().unwrap();
    assert!(
        (largest.radius_mm - 10.0).abs() < 1e-9 && (largest.deviation_mm - 10.0 * (2.0_f64.sqrt() - 1.0)).abs() < 1e-9
    );
    let message = corner.fillet_with_radius(10.1).unwrap_err().to_string();
    assert!(message.contains("too short") && message.contains("radius 10"), "{message}");
    // Contact inside an arc of 1 mm radius: no fillet of 1 mm or more, however long the arc is.
    let inside = ArcCorner::new(arc([9.0, 1.0], d, 1.0, CounterClockwise), line(d, [10.0, 10.0])).unwrap();
    assert!(inside.largest_fillet().unwrap().radius_mm < 1.0);
}

/// Two fillets on one short arc: what both take more than there is.
#[test]
fn two_fillets_on_a_short_arc_overlap() {
    let line = |from: Point, to: Point| arc(from, to, f64::INFINITY, Clockwise);
    let [a, b, c] = [line([0.0, 0.0], [10.0, 0.0]), line([10.0, 0.0], [10.0, 1.0]), line([10.0, 1.0], [20.0, 1.0])];
    let (first, second) = (ArcCorner::new(a, b).unwrap(), ArcCorner::new(b, c).unwrap());
    let fillet = |corner: &ArcCorner, radius| corner.fillet_with_radius(radius).unwrap();
    assert_eq!(b.overlap_mm(&fillet(&first, 0.4), &fillet(&second, 0.6)), None);
    let over = b.overlap_mm(&fillet(&first, 0.5), &fillet(&second, 0.75)).unwrap();
    assert!((over - 0.25).abs() < 1e-9);
}
