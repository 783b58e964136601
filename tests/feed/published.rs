//! Published figures and hand calculations of feeds at corners, blends, arcs and short blocks.

use crate::support::{Program, Random, point, sample, spinner, with_rotary};
use sollwert::base::{AxisId, PartPoint};
use sollwert::feed::{LimitKind, PlannedPiece};
use sollwert::geometry::{Curve, HermiteBlend};
use sollwert::interpreter::MoveKind;
use sollwert::machine::{BlendLaw, CornerRule, CurvatureJump, Machine, PathMode};
use sollwert::smoothing::{Corner, PieceKind};

const CORNERS: [[f64; 2]; 4] = [[7.071, 7.071], [9.659, 16.73], [19.318, 14.142], [26.389, 21.213]];

fn blends(planned: &[PlannedPiece]) -> Vec<(Corner, f64)> {
    let entry = |piece: &PlannedPiece| match &piece.path.contour.kind {
        PieceKind::Blend(_, corner) => Some((*corner, piece.law.at(0.0).velocity_lu_s)),
        _ => None,
    };
    planned.iter().filter_map(entry).collect()
}

fn entry_speeds(planned: &[PlannedPiece]) -> Vec<f64> {
    planned.iter().map(|piece| piece.law.at(0.0).velocity_lu_s).collect()
}

/// [Essid 2019]: the 90° corner with epsilon 0.06, T 0.2263 is entered at 5.97 mm/s on the Spinner.
#[test]
fn the_published_corner_is_entered_with_the_published_feed() {
    let mut machine = spinner();
    machine.smoothing.blend_law = BlendLaw::Entry;
    let corners = blends(&Program::polyline(PathMode::G642, 3000.0, &CORNERS).planned(&machine));
    assert_eq!(corners.len(), 3);
    let (corner, feed_mm_s) = corners[1];
    assert!((corner.angle_rad.to_degrees() - 90.0).abs() < 0.01, "{corner:?}");
    assert!((corner.tolerance_mm - 0.06).abs() < 1e-9 && (corner.transition_length_mm - 0.2263).abs() < 5e-5);
    assert!((feed_mm_s - 5.97).abs() < 0.005, "{feed_mm_s}");
}

/// Published factors by which dk/ds inside a blend exceeds its value at the entry: 4.1 at 60°, 10.8 at 90°; the safe feed is lower
/// by their cube root, if N did not turn. N turns towards or away from an axis by half the angle at most.
#[test]
fn the_safe_feed_is_below_the_entry_feed_by_about_the_published_factor() {
    for (angle_deg, factor) in [(15.0_f64, 2.2_f64), (30.0, 2.5), (60.0, 4.1), (90.0, 10.8), (120.0, 59.0)] {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let points = [[50.0, 0.0], [50.0 + 50.0 * cos, 50.0 * sin]];
        let feed = |law| {
            let mut machine = spinner();
            machine.smoothing.blend_law = law;
            blends(&Program::polyline(PathMode::G642, 60_000.0, &points).planned(&machine))[0].1
        };
        let ratio = feed(BlendLaw::Entry) / feed(BlendLaw::Limits);
        let (low, high) = (factor.cbrt() * 0.75, factor.cbrt() * 1.35);
        assert!(ratio > low && ratio < high, "{angle_deg}: {ratio} against {}", factor.cbrt());
    }
}

/// The largest constant feed by brute force over 20,000 places, straight from the equations of models/local-smoothing.md section 2.
fn brute_force_feed(machine: &Machine, blend: &HermiteBlend) -> f64 {
    let (ra, rj) = (machine.smoothing.radial_acceleration_share, machine.smoothing.radial_jerk_share);
    let mut feed = f64::INFINITY;
    for i in 0..=20_000 {
        let p = blend.shape(f64::from(i) / 20_000.0);
        let (k, k_slope) = (p.curvature_per_mm, p.curvature_slope_per_mm_mm);
        for axis in machine.axis_ids() {
            let limits = &machine.axis(axis).limits;
            let (t, n) = (p.tangent[axis].abs(), p.normal[axis].abs());
            feed = feed.min(limits.velocity_max_lu_s / t);
            feed = feed.min((ra * limits.acceleration_max_lu_s2 / (k * n).abs()).sqrt());
            feed = feed.min((rj * limits.transition_jerk_max_lu_s3 / (k_slope * n).abs()).cbrt());
            feed = feed.min(((1.0 - rj) * limits.transition_jerk_max_lu_s3 / (k * k * t)).cbrt());
        }
    }
    feed
}

#[test]
fn the_safe_feed_is_safe_and_hardly_lower_than_it_must_be() {
    let mut random = Random::new(5);
    let mut machine = spinner();
    for _ in 0..300 {
        for axis in &mut machine.axes {
            axis.limits.transition_jerk_max_lu_s3 = random.logarithmic(500.0, 50_000.0);
            axis.limits.acceleration_max_lu_s2 = random.logarithmic(100.0, 5000.0);
        }
        // Turns from a degree to one just below a reversal.
        let angle_rad = (std::f64::consts::PI - random.logarithmic(0.03, 3.1)).max(0.002);
        let turn_rad = random.between(0.0, 6.3);
        let end = [50.0 * turn_rad.cos(), 50.0 * turn_rad.sin()];
        let after_rad = turn_rad + angle_rad;
        let points = [end, [end[0] + 50.0 * after_rad.cos(), end[1] + 50.0 * after_rad.sin()]];
        let planned = Program::polyline(PathMode::G642, 1e6, &points).planned(&machine);
        let Some(piece) = planned.iter().find(|piece| matches!(piece.path.contour.kind, PieceKind::Blend(..))) else {
            panic!("no blend at {angle_rad}")
        };
        let Some(Curve::Blend(blend)) = piece.path.contour.curve() else { panic!("not a Hermite blend") };
        let feed = piece.law.at(0.0).velocity_lu_s;
        let expected = brute_force_feed(&machine, blend);
        // A blend that the lines beside it cannot reach is slower.
        let reached = machine.axes.iter().all(|axis| expected * expected < axis.limits.acceleration_max_lu_s2 * 2.0);
        assert!(feed <= expected * (1.0 + 1e-9), "{angle_rad}: {feed} above {expected}");
        assert!(!reached || feed >= expected * 0.998, "{angle_rad}: {feed} below {expected}");
    }
}

/// G64: |T2 - T1| v <= sqrt(8 A e): at 90° from X to Y each axis steps by v; 8 * 1000 * 0.01 = 80.
#[test]
fn an_unrounded_corner_keeps_the_velocity_step() {
    let mut machine = spinner();
    let corner = |machine: &Machine| {
        let planned = Program::polyline(PathMode::G64, 3000.0, &[[50.0, 0.0], [50.0, 50.0]]).planned(machine);
        entry_speeds(&planned)[1]
    };
    assert!((corner(&machine) - 80.0_f64.sqrt()).abs() < 1e-12);
    // The weaker axis decides, and it is Y.
    machine.axes[1].follow_up_tolerance_lu = 0.0025;
    assert!((corner(&machine) - 20.0_f64.sqrt()).abs() < 1e-12);
    machine.feed.corner_rule = CornerRule::Overload;
    assert!((corner(&machine) - 1.2).abs() < 1e-12);
}

/// A stop at every block end: rest-to-rest times add up.
#[test]
fn exact_stop_rests_at_every_corner() {
    let planned = Program::polyline(PathMode::ExactStop, 3000.0, &[[50.0, 0.0], [50.0, 50.0]]).planned(&spinner());
    assert_eq!(entry_speeds(&planned), [0.0, 0.0]);
    let time_s = 50.0 / 50.0 + 2.0 * (50.0_f64 / 15_000.0).sqrt();
    for piece in &planned {
        assert!((piece.law.duration_s() - time_s).abs() < 1e-12);
    }
}

/// F3000 on R50: v²/R = 50 mm/s² and v³/R² = 50 mm/s³ are far below their shares: the feed is reached. R1 is held by R_A A = 200.
#[test]
fn an_arc_is_held_by_the_share_for_curvature() {
    let machine = spinner();
    let circle = |radius_mm: f64, feed_mm_min: f64| {
        let mut program = Program::new(PathMode::G64, feed_mm_min);
        program.arc([radius_mm, 0.0], std::f64::consts::TAU, 0.0);
        let planned = program.planned(&machine);
        let phases = planned[0].law.phases().to_vec();
        let cruise = phases.iter().find(|phase| phase.jerk_lu_s3 == 0.0 && phase.acceleration_lu_s2 == 0.0).copied();
        cruise.map(|phase| (phase.velocity_lu_s, phase.limit.kind))
    };
    assert_eq!(circle(50.0, 3000.0), Some((50.0, LimitKind::Feed)));
    let (feed, kind) = circle(1.0, 3000.0).unwrap_or_else(|| panic!("no cruise"));
    assert!((feed - 200.0_f64.sqrt()).abs() < 1e-9, "{feed}");
    assert_eq!(kind, LimitKind::RadialAcceleration);
    // v³/R² <= R_J J = 3000.
    let (feed, kind) = circle(0.01, 3000.0).unwrap_or_else(|| panic!("no cruise"));
    assert!((feed - (3000.0 * 1e-4_f64).cbrt()).abs() < 1e-9, "{feed}");
    assert_eq!(kind, LimitKind::RadialJerk);
}

/// models/arcs.md section 5: sqrt(J dt / |k1 - k2|), with the sum of the curvatures where the sense changes.
#[test]
fn a_change_of_curvature_keeps_the_step_of_acceleration() {
    let mut machine = spinner();
    let junctions = |machine: &Machine, second: f64| {
        let mut program = Program::new(PathMode::G64, 3000.0);
        program.line(&[100.0, 0.0]);
        program.arc([100.0, 20.0], 1.5, 0.0);
        // Tangential: the centre lies on the same normal, on either side.
        let (sin, cos) = 1.5_f64.sin_cos();
        let end = [100.0 + 20.0 * sin, 20.0 - 20.0 * cos];
        program.arc([end[0] - second * sin, end[1] + second * cos], 1.5_f64.copysign(second), 0.0);
        entry_speeds(&program.planned(machine))
    };
    let step = 10_000.0 * 1e-3;
    let (sin, cos) = 1.5_f64.sin_cos();
    let normal = sin.max(cos);
    for (radius, curvature) in [(40.0, 1.0 / 20.0 - 1.0 / 40.0), (-40.0, 1.0 / 20.0 + 1.0 / 40.0)] {
        let speeds = junctions(&machine, radius);
        assert!((speeds[1] - (step * 20.0_f64).sqrt()).abs() < 1e-9, "{speeds:?}");
        assert!((speeds[2] - (step / (curvature * normal)).sqrt()).abs() < 1e-6, "{speeds:?}");
    }
    machine.feed.curvature_jump = CurvatureJump::Printed;
    let speeds = junctions(&machine, -40.0);
    assert!((speeds[2] - (step / (normal / 40.0)).sqrt()).abs() < 1e-6, "{speeds:?}");
}

/// A block is not crossed in less than a cycle: L / t_s.
#[test]
fn a_short_block_takes_a_cycle() {
    let points: Vec<[f64; 2]> = (1..=4000).map(|i| [f64::from(i) * 0.01, 0.0]).collect();
    let mut machine = spinner();
    machine.look_ahead_blocks = 10_000;
    let planned = Program::polyline(PathMode::G64, 3000.0, &points).planned(&machine);
    let fastest = planned.iter().fold(0.0_f64, |most, piece| most.max(piece.law.at(0.0).velocity_lu_s));
    assert!((fastest - 10.0).abs() < 1e-9, "{fastest}");
    assert!(planned.iter().all(|piece| piece.law.duration_s() >= 1e-3 * (1.0 - 1e-9)));
    assert!(planned.iter().any(|piece| piece.law.phases().iter().any(|phase| phase.limit.kind == LimitKind::Cycle)));
}

/// A rapid goes at the limit of the axis that allows least along its direction.
#[test]
fn a_rapid_goes_at_the_limits_of_the_axes() {
    let mut machine = spinner();
    machine.axes[1].limits.velocity_max_lu_s = 100.0;
    let mut program = Program::new(PathMode::G64, 3000.0);
    program.rapid(&[300.0, 400.0]);
    let planned = program.planned(&machine);
    let cruise = planned[0].law.phases().iter().fold(0.0_f64, |most, phase| most.max(phase.velocity_lu_s));
    assert!((cruise - 125.0).abs() < 1e-9);
    let limit = planned[0].law.phases().iter().find(|phase| phase.limit.kind == LimitKind::Velocity);
    assert_eq!(limit.and_then(|phase| phase.limit.axis), Some(AxisId::new(1)));
}

/// A dwell lasts its time, at rest on both sides; where only a rotary axis moves the feed counts in rad/s and the path rests between.
#[test]
fn dwells_and_rotary_moves_begin_and_end_at_rest() {
    let machine = with_rotary();
    let mut program = Program::new(PathMode::G64, 600.0);
    program.line(&[5.0, 0.0, 0.0, 0.0]);
    program.dwell(0.1234);
    program.line(&[10.0, 0.0, 0.0, 0.0]);
    program.line(&[10.0, 0.0, 0.0, 0.5]);
    program.line(&[15.0, 0.0, 0.0, 0.0]);
    let planned = program.planned(&machine);
    assert_eq!(entry_speeds(&planned), [0.0; 5]);
    assert_eq!(planned[1].law.duration_s(), 0.1234);
    assert_eq!(planned[1].law.phases()[0].limit.kind, LimitKind::Dwell);
    // 10 rad/s are programmed, 15 rpm = pi/2 rad/s allowed.
    let fastest = planned[3].law.phases().iter().fold(0.0_f64, |most, phase| most.max(phase.velocity_lu_s));
    assert!(fastest <= std::f64::consts::FRAC_PI_2 * (1.0 + 1e-12) && fastest > 0.5, "{fastest}");
    let last = sample(&machine, planned).pop().unwrap_or_else(|| panic!("no set-points"));
    let end: PartPoint = point(&[15.0, 0.0, 0.0, 0.0]);
    assert!(machine.axis_ids().all(|axis| last.axes[axis].position_lu == end.0[axis]));
}

/// A helix: the pitch takes its share of speed and limits.
#[test]
fn a_helix_is_held_by_its_pitch_axis() {
    let mut machine = spinner();
    machine.axes[2].limits.velocity_max_lu_s = 1.0;
    let mut program = Program::new(PathMode::G64, 3000.0);
    program.arc([30.0, 0.0], std::f64::consts::TAU, 5.0);
    assert!(matches!(program.moves[0].kind, MoveKind::Arc(_)));
    let planned = program.planned(&machine);
    let fastest = planned[0].law.phases().iter().fold(0.0_f64, |most, phase| most.max(phase.velocity_lu_s));
    let length = (30.0 * std::f64::consts::TAU).hypot(5.0);
    assert!((fastest - length / 5.0).abs() < 1e-9, "{fastest}");
}
