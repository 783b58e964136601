//! Ramps and seven-phase laws against closed forms and, with random numbers, from outside.

use crate::support::Random;
use sollwert::feed::profile::{Bounds, SpeedCap, Stretch, seven_phases};
use sollwert::feed::ramp::Dynamics;
use sollwert::feed::{Limit, LimitKind, TimeLaw};

const fn limit(kind: LimitKind) -> Limit {
    Limit { kind, axis: None }
}

fn cap(velocity_lu_s: f64) -> SpeedCap {
    SpeedCap { velocity_lu_s, limit: limit(LimitKind::Feed) }
}

fn law(length_lu: f64, [v0, v1]: [f64; 2], v_max: f64, dynamics: Dynamics) -> TimeLaw {
    let bounds = Bounds {
        cruise: cap(v_max),
        dynamics,
        acceleration: limit(LimitKind::Acceleration),
        jerk: limit(LimitKind::Jerk),
    };
    let junction = |velocity_lu_s| SpeedCap { velocity_lu_s, limit: limit(LimitKind::Corner) };
    seven_phases(&Stretch { length_lu, entry: junction(v0), exit: junction(v1) }, &bounds)
}

fn soft(a: f64, j: f64) -> Dynamics {
    Dynamics { acceleration_lu_s2: a, jerk_lu_s3: Some(j) }
}

fn close(actual: f64, expected: f64) {
    assert!((actual - expected).abs() <= 1e-12 * expected.abs().max(1e-3), "{actual} instead of {expected}");
}

/// models/feed-prediction-and-surface.md section 2, rest to rest.
#[test]
fn rest_to_rest_takes_the_published_times() {
    let (a, j) = (1000.0, 15_000.0);
    // v <= A²/J = 66.7, reached within the length.
    let (l, v) = (100.0_f64, 50.0_f64);
    close(law(l, [0.0, 0.0], v, soft(a, j)).duration_s(), l / v + 2.0 * (v / j).sqrt());
    let (l, v) = (200.0, 300.0);
    close(law(l, [0.0, 0.0], v, soft(a, j)).duration_s(), l / v + v / a + a / j);
    let l = 2.0_f64;
    close(law(l, [0.0, 0.0], v, soft(a, j)).duration_s(), 4.0 * (l / (2.0 * j)).cbrt());
    // Without jerk limit: L/v + v/A, and 2 sqrt(L/A) where v is not reached.
    let brisk = Dynamics { acceleration_lu_s2: a, jerk_lu_s3: None };
    close(law(100.0, [0.0, 0.0], 50.0, brisk).duration_s(), 100.0 / 50.0 + 50.0 / a);
    close(law(2.0, [0.0, 0.0], 50.0, brisk).duration_s(), 2.0 * (2.0_f64 / a).sqrt());
}

/// Between the two cases, with A reached but not v: the length is (v/2)(v/A + A/J) twice, a quadratic for the peak.
#[test]
fn a_middle_length_peaks_where_the_quadratic_says() {
    let (a, j, l) = (1000.0_f64, 15_000.0_f64, 20.0_f64);
    let v = -a * a / (2.0 * j) + ((a * a / (2.0 * j)).powi(2) + a * l).sqrt();
    assert!(v > a * a / j);
    close(law(l, [0.0, 0.0], 1e9, soft(a, j)).duration_s(), 2.0 * (v / a + a / j));
}

#[test]
fn reachable_is_the_inverse_of_the_ramp_length() {
    let mut random = Random::new(1);
    for _ in 0..20_000 {
        let dynamics = soft(random.logarithmic(1.0, 1e5), random.logarithmic(10.0, 1e7));
        let v0 = if random.unit() < 0.2 { 0.0 } else { random.logarithmic(1e-3, 1e3) };
        let length_lu = random.logarithmic(1e-4, 1e3);
        let v1 = dynamics.reachable(v0, length_lu);
        if v1 - v0 <= 1e-11 * v0 {
            continue;
        }
        // The root of a rounded difference of speeds: its error grows as the gain gets small beside the speed.
        let error = 1e-12 + 1e-15 * v1 / (v1 - v0).max(1e-300);
        let back_lu = dynamics.ramp_length_lu(v0, v1);
        assert!((back_lu - length_lu).abs() <= error * length_lu, "{dynamics:?} {v0} {length_lu}: {back_lu}");
    }
}

/// From the brakeable speed every lower one can be met, and from one 1 % higher some cannot.
#[test]
fn brakeable_speeds_can_be_braked_to_anything() {
    let mut random = Random::new(4);
    for _ in 0..2000 {
        let dynamics = soft(random.logarithmic(10.0, 1e4), random.logarithmic(100.0, 1e6));
        let length_lu = random.logarithmic(1e-3, 1e3);
        let to = random.unit() * dynamics.reachable(0.0, length_lu);
        let from = dynamics.brakeable(to, length_lu);
        let longest_lu = |v: f64| {
            let ramp_lu = |i: u32| dynamics.ramp_length_lu(v, to + (v - to) * f64::from(i) / 1000.0);
            (0..=1000).map(ramp_lu).fold(0.0, f64::max)
        };
        assert!(longest_lu(from) <= length_lu * (1.0 + 1e-9), "{dynamics:?} {length_lu} {to}");
        assert!(longest_lu(from * 1.01) > length_lu, "{dynamics:?} {length_lu} {to}");
    }
}

#[test]
fn laws_of_random_stretches_are_smooth_keep_their_limits_and_end_exactly() {
    let mut random = Random::new(2);
    for round in 0..20_000 {
        let (a, j) = (random.logarithmic(1.0, 1e5), random.logarithmic(10.0, 1e7));
        let brisk = random.unit() < 0.2;
        let dynamics = Dynamics { acceleration_lu_s2: a, jerk_lu_s3: (!brisk).then_some(j) };
        let length_lu = random.logarithmic(1e-9, 1e4);
        let v_max = random.logarithmic(1e-2, 1e3);
        let v0 = if random.unit() < 0.3 { 0.0 } else { v_max * random.unit() };
        let [v0, v1] = match round % 4 {
            // Accelerating and braking all along, and both with room.
            0 => [v0, dynamics.reachable(v0, length_lu).min(v_max)],
            1 => [dynamics.reachable(v0, length_lu).min(v_max), v0],
            2 => [v0, random.between(v0, dynamics.reachable(v0, length_lu).min(v_max))],
            _ => [random.between(v0, dynamics.reachable(v0, length_lu).min(v_max)), v0],
        };
        let case = format!("round {round}: L {length_lu} v {v0} -> {v1} of {v_max}, {dynamics:?}");
        check(&law(length_lu, [v0, v1], v_max, dynamics), length_lu, [v0, v1, v_max], &dynamics, &case);
    }
}

fn check(law: &TimeLaw, length_lu: f64, [v0, v1, v_max]: [f64; 3], dynamics: &Dynamics, case: &str) {
    let v_scale = v0.max(v1).max(law.phases().iter().fold(0.0_f64, |v, phase| v.max(phase.velocity_lu_s)));
    let (mut s, mut v, mut a) = (0.0, v0, 0.0);
    for phase in law.phases() {
        assert!(phase.duration_s > 0.0 && phase.duration_s.is_finite(), "{case}");
        assert!((phase.start_lu - s).abs() <= 1e-12 * length_lu, "{case}: gap {} at {s}", phase.start_lu - s);
        assert!((phase.velocity_lu_s - v).abs() <= 2e-12 * v_scale, "{case}");
        if let Some(j) = dynamics.jerk_lu_s3 {
            assert!((phase.acceleration_lu_s2 - a).abs() <= 1e-9 * dynamics.acceleration_lu_s2, "{case}");
            // The jerk of a ramp over the last bits of a speed is a quotient of rounding errors.
            assert!(phase.jerk_lu_s3.abs() <= j * (1.0 + 1e-3), "{case}: {} of {j}", phase.jerk_lu_s3);
        } else {
            assert!(phase.jerk_lu_s3 == 0.0);
        }
        let end = phase.at(phase.duration_s);
        (s, v, a) = (end.position_lu, end.velocity_lu_s, end.acceleration_lu_s2);
        assert!(a.abs().max(phase.acceleration_lu_s2.abs()) <= dynamics.acceleration_lu_s2 * (1.0 + 1e-3), "{case}");
        assert!(v <= v_max.max(v0).max(v1) * (1.0 + 1e-12) && v >= -1e-12 * v_scale, "{case}");
    }
    assert!((s - length_lu).abs() <= 1e-12 * length_lu, "{case}: ends at {s}");
    assert!((v - v1).abs() <= 2e-12 * v_scale, "{case}: ends with {v}");
    let end = law.at(law.duration_s());
    assert!((end.position_lu - length_lu).abs() <= 1e-12 * length_lu, "{case}");
}

/// No law can be faster than one without any jerk limit, and a little less time never suffices: a peak 1 % higher does not fit.
#[test]
fn no_higher_peak_fits() {
    let mut random = Random::new(3);
    for _ in 0..5000 {
        let dynamics = soft(random.logarithmic(10.0, 1e4), random.logarithmic(100.0, 1e6));
        let length_lu = random.logarithmic(1e-3, 1e3);
        let v0 = random.between(0.0, 0.9 * dynamics.reachable(0.0, length_lu));
        let v1 = random.between(0.0, dynamics.reachable(v0, length_lu));
        if dynamics.ramp_length_lu(v0, v1) > length_lu {
            continue;
        }
        let peak = dynamics.peak(v0, v1, length_lu);
        let both_lu = |v| dynamics.ramp_length_lu(v0, v) + dynamics.ramp_length_lu(v, v1);
        assert!(both_lu(peak) <= length_lu * (1.0 + 1e-6));
        assert!(both_lu(peak * 1.01) > length_lu, "{dynamics:?} {v0} {v1} {length_lu} {peak}");
    }
}

#[test]
fn every_phase_says_what_holds_it() {
    let kinds = |law: &TimeLaw| law.phases().iter().map(|phase| phase.limit.kind).collect::<Vec<_>>();
    use LimitKind::{Acceleration, Corner, Feed, Jerk};
    let full = law(200.0, [0.0, 0.0], 300.0, soft(1000.0, 15_000.0));
    assert_eq!(kinds(&full), [Jerk, Acceleration, Jerk, Feed, Jerk, Acceleration, Jerk]);
    // Nothing but a cruise at the speed of the junctions.
    assert_eq!(kinds(&law(1e-9, [20.0, 20.0], 20.0, soft(1000.0, 15_000.0))), [Corner]);
}
