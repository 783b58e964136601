//! The room `interpolator`: time without rounding, exact ends, the fine interpolator.

use crate::support::{Program, Random, spinner, total_s};
use sollwert::base::{AxisId, TimeBase};
use sollwert::feed::PlannedPiece;
use sollwert::interpolator::{AxisSetpoint, FineInterpolator, Interpolator, Setpoint};
use sollwert::interpreter::Event;
use sollwert::machine::{FineInterpolation, Machine, PathMode};

const X: AxisId = AxisId::new(0);

fn last(setpoints: &[Setpoint]) -> &Setpoint {
    &setpoints[setpoints.len() - 1]
}

/// A line at a constant 50 mm/s but for its ramps: the middle set-points lie where the closed form says.
#[test]
fn positions_follow_the_closed_form() {
    let setpoints = Program::polyline(PathMode::G642, 3000.0, &[[100.0, 0.0]]).setpoints(&spinner());
    let (v, j) = (50.0_f64, 15_000.0_f64);
    let ramp_s = 2.0 * (v / j).sqrt();
    let total_s = 100.0 / v + ramp_s;
    assert_eq!(setpoints.len() - 1, (total_s * 1000.0).ceil() as usize);
    for (k, setpoint) in setpoints.iter().enumerate() {
        let t = k as f64 * 1e-3;
        let x = &setpoint.axes[X];
        if t <= ramp_s / 2.0 {
            assert!((x.position_lu - j * t * t * t / 6.0).abs() < 1e-12);
            assert!((x.velocity_lu_s - j * t * t / 2.0).abs() < 1e-9);
            assert!((x.acceleration_lu_s2 - j * t).abs() < 1e-9);
        } else if t > ramp_s && t < total_s - ramp_s {
            // A ramp takes half the way of the cruise.
            assert!((x.position_lu - v * (t - ramp_s / 2.0)).abs() < 1e-9);
            assert!((x.velocity_lu_s - v).abs() < 1e-9);
        }
        assert_eq!(setpoint.tick, spinner().cycle.time_base.setpoint_tick(k as u64));
        assert!((setpoint.path.path_length_mm - x.position_lu).abs() < 1e-9);
    }
    assert_eq!(last(&setpoints).axes[X].position_lu, 100.0);
    assert_eq!(last(&setpoints).axes[X].velocity_lu_s, 0.0);
}

/// 0.1 s of dwell are 100 cycles of 1 ms, not 101, and a hundred dwells of 0.3 ms are 30.
#[test]
fn dwells_last_their_time() {
    let dwells = |count: usize, time_s: f64| {
        let mut program = Program::new(PathMode::G642, 3000.0);
        (0..count).for_each(|_| program.dwell(time_s));
        program.setpoints(&spinner()).len() - 1
    };
    assert_eq!(dwells(1, 0.1), 100);
    assert_eq!(dwells(1, 0.1001), 101);
    assert_eq!(dwells(100, 0.0003), 30);
    assert_eq!(dwells(100_000, 0.001), 100_000);
}

/// Blocks far shorter than a cycle: the number of set-points is that of the sum of their times.
#[test]
fn no_block_is_rounded_to_cycles() {
    let mut machine = spinner();
    machine.cycle.time_base = TimeBase::new((8_000_000, 1), 8);
    for seed in 0..10 {
        let walk = Random::new(seed).walk(200, 0.05, 0.5);
        let planned = Program::polyline(PathMode::ExactStop, 3000.0, &walk).planned(&machine);
        let (time_s, end) = (total_s(&planned), walk[199]);
        let setpoints = crate::support::sample(&machine, planned);
        assert_eq!(setpoints.len() - 1, (time_s / 0.008 * (1.0 - 1e-9)).ceil() as usize);
        assert_eq!(last(&setpoints).axes[X].position_lu, end[0]);
    }
}

/// Each set-point is that of the piece in which its time lies, evaluated there: compared with a search from the start of the path.
#[test]
fn carried_time_equals_time_from_the_start() {
    let machine = spinner();
    for seed in 0..10 {
        let walk = Random::new(seed).walk(60, 0.01, 5.0);
        let planned = Program::polyline(PathMode::G642, 6000.0, &walk).planned(&machine);
        let setpoints = crate::support::sample(&machine, planned.clone());
        for (k, setpoint) in setpoints.iter().enumerate().take(setpoints.len() - 1) {
            let expected = position_mm(&planned, k as f64 * 1e-3);
            assert!((setpoint.axes[X].position_lu - expected).abs() < 1e-9, "seed {seed} tick {k}");
        }
    }
}

fn position_mm(planned: &[PlannedPiece], mut time_s: f64) -> f64 {
    for piece in planned {
        if time_s < piece.law.duration_s() {
            return piece.path.at(piece.law.at(time_s).position_lu).position.0[X];
        }
        time_s -= piece.law.duration_s();
    }
    f64::NAN
}

/// Every piece is reported once, in order, in the cycle at or after its beginning, with its events.
#[test]
fn what_begins_is_reported_once() {
    let machine = spinner();
    let mut program =
        Program::polyline(PathMode::G642, 3000.0, &[[0.02, 0.0], [0.04, 0.01], [20.0, 20.0], [30.0, 0.0]]);
    for (i, next) in program.moves.iter_mut().enumerate() {
        next.events.push(Event::MFunction(i as u32 + 10));
    }
    let planned = program.planned(&machine);
    let mut interpolator = Interpolator::new(&machine);
    let mut pieces = planned.clone().into_iter();
    let (mut m_functions, mut pieces_begun, mut start_s) = (Vec::new(), 0, 0.0);
    for k in 0.. {
        if interpolator.sample(k, &mut || pieces.next()).is_none() {
            break;
        }
        let tick_s = k as f64 * 1e-3;
        for begun in interpolator.begun() {
            let piece = &planned[pieces_begun];
            assert_eq!(begun.block, piece.path.contour.block);
            assert_eq!(begun.entry_feed_lu_s, piece.law.at(0.0).velocity_lu_s);
            assert!((tick_s - begun.before_tick_s - start_s).abs() < 1e-9);
            assert!(begun.before_tick_s >= 0.0 && begun.before_tick_s < 1e-3);
            assert_eq!(begun.corner.is_some(), piece.path.contour.blocks_begun == 0);
            m_functions.append(&mut begun.events);
            start_s += piece.law.duration_s();
            pieces_begun += 1;
        }
    }
    assert_eq!(pieces_begun, planned.len());
    assert_eq!(m_functions, (10..14).map(Event::MFunction).collect::<Vec<_>>());
}

#[test]
fn an_empty_path_has_no_setpoints_and_a_copy_goes_on_the_same() {
    let machine = spinner();
    assert!(Interpolator::new(&machine).sample(0, &mut || None).is_none());
    let planned = Program::polyline(PathMode::G642, 3000.0, &[[5.0, 0.0], [5.0, 5.0]]).planned(&machine);
    let mut interpolator = Interpolator::new(&machine);
    let mut pieces = planned.into_iter();
    for k in 0..100 {
        assert!(interpolator.sample(k, &mut || pieces.next()).is_some());
    }
    let rest = |mut interpolator: Interpolator, mut pieces: std::vec::IntoIter<PlannedPiece>| {
        (100..).map_while(|k| interpolator.sample(k, &mut || pieces.next())).collect::<Vec<_>>()
    };
    let (copy, copied) = (interpolator.clone(), pieces.clone());
    assert_eq!(rest(interpolator, pieces), rest(copy, copied));
}

/// t_s = 4 ms over a position cycle of 1 ms.
fn fine(law: FineInterpolation, position_cycle_ticks: u64) -> FineInterpolator {
    let mut machine: Machine = spinner();
    machine.cycle.time_base = TimeBase::new((4_000_000, 1), 4);
    machine.cycle.fine_interpolation = law;
    FineInterpolator::new(&machine, position_cycle_ticks)
}

fn polynomial(c: [f64; 4], t: f64) -> AxisSetpoint {
    AxisSetpoint {
        position_lu: c[0] + t * (c[1] + t * (c[2] + t * c[3])),
        velocity_lu_s: c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]),
        acceleration_lu_s2: 2.0 * c[2] + 6.0 * c[3] * t,
        jerk_lu_s3: 6.0 * c[3],
    }
}

fn assert_close(actual: &AxisSetpoint, expected: &AxisSetpoint) {
    let close = |a: f64, b: f64, tolerance: f64| assert!((a - b).abs() <= tolerance, "{actual:?} {expected:?}");
    // Rounding of positions of some mm, divided by 4 ms once a derivative.
    close(actual.position_lu, expected.position_lu, 1e-14);
    close(actual.velocity_lu_s, expected.velocity_lu_s, 1e-11);
    close(actual.acceleration_lu_s2, expected.acceleration_lu_s2, 1e-8);
    close(actual.jerk_lu_s3, expected.jerk_lu_s3, 1e-5);
}

#[test]
fn cubic_fine_interpolation_reproduces_a_cubic() {
    let fine = fine(FineInterpolation::Cubic, 1);
    assert_eq!(fine.steps(), 4);
    let c = [1.5, -20.0, 300.0, 2500.0];
    let (from, to) = (polynomial(c, 0.0), polynomial(c, 0.004));
    for step in 0..4 {
        assert_close(&fine.at(&from, &to, step), &polynomial(c, step as f64 * 1e-3));
    }
}

#[test]
fn linear_fine_interpolation_reproduces_a_line() {
    let fine = fine(FineInterpolation::Linear, 1);
    let c = [1.5, -20.0, 0.0, 0.0];
    let (from, to) = (polynomial(c, 0.0), polynomial(c, 0.004));
    for step in 0..4 {
        assert_close(&fine.at(&from, &to, step), &polynomial(c, step as f64 * 1e-3));
    }
    // On a curve it runs on the chord.
    let c = [0.0, 0.0, 100.0, 0.0];
    let (from, to) = (polynomial(c, 0.0), polynomial(c, 0.004));
    let middle = fine.at(&from, &to, 2);
    assert!((middle.position_lu - to.position_lu / 2.0).abs() < 1e-15);
    assert!((middle.acceleration_lu_s2 - 200.0).abs() < 1e-9);
}

#[test]
fn equal_periods_pass_unchanged() {
    for law in [FineInterpolation::Cubic, FineInterpolation::Linear] {
        let fine = fine(law, 4);
        assert_eq!(fine.steps(), 1);
        let (from, to) = (polynomial([1.0, 2.0, 3.0, 4.0], 0.1), polynomial([9.0, 8.0, 7.0, 6.0], 0.2));
        assert_eq!(fine.at(&from, &to, 0), from);
    }
}
