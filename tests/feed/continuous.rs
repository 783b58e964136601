//! The time law `continuous`: closed forms of its phases and of lines, the window, what BRISK and DRIVE leave of the limits.

use crate::support::{Program, Random, modes, plan, spinner, total_s};
use sollwert::base::AxisId;
use sollwert::feed::{Limit, LimitKind, Phase, PlannedPiece};
use sollwert::kinematics::JointPath;
use sollwert::machine::{AccelerationMode, AccelerationReduction, Machine, PathMode, TimeLawKind};
use sollwert::smoothing::PieceKind;

fn machine() -> Machine {
    let mut machine = spinner();
    machine.feed.time_law = TimeLawKind::Continuous;
    machine.look_ahead_blocks = 100;
    machine
}

/// Runge-Kutta of fourth order for `s'' = a + k s`: another way to the same motion.
fn integrated(phase: &Phase, time_s: f64) -> [f64; 2] {
    const STEPS: u32 = 2000;
    let h = time_s / f64::from(STEPS);
    let slope = |[s, v]: [f64; 2]| [v, phase.acceleration_lu_s2 + phase.rate_per_s2 * s];
    let mut state = [0.0, phase.velocity_lu_s];
    for _ in 0..STEPS {
        let ahead = |slope: [f64; 2], h: f64| [state[0] + h * slope[0], state[1] + h * slope[1]];
        let k1 = slope(state);
        let k2 = slope(ahead(k1, h / 2.0));
        let k3 = slope(ahead(k2, h / 2.0));
        let k4 = slope(ahead(k3, h));
        state = std::array::from_fn(|i| state[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
    }
    state
}

#[test]
fn a_phase_of_linear_acceleration_is_the_solution_of_its_equation() {
    let mut random = Random::new(11);
    for _ in 0..200 {
        let duration_s = random.logarithmic(1e-4, 2.0);
        let z = random.between(-6.0, 6.0) * random.logarithmic(1e-6, 1.0);
        let phase = Phase {
            duration_s,
            start_lu: 0.0,
            velocity_lu_s: random.between(1.0, 100.0),
            acceleration_lu_s2: random.between(-50.0, 50.0),
            jerk_lu_s3: 0.0,
            rate_per_s2: z / (duration_s * duration_s),
            limit: Limit { kind: LimitKind::Feed, axis: None },
        };
        let (state, [s_lu, v_lu_s]) = (phase.at(duration_s), integrated(&phase, duration_s));
        let (way_lu, speed_lu_s) = (100.0 * duration_s + 50.0 * duration_s * duration_s, 100.0 + 50.0 * duration_s);
        assert!((state.position_lu - s_lu).abs() < 1e-10 * way_lu * z.abs().exp(), "{phase:?}");
        assert!((state.velocity_lu_s - v_lu_s).abs() < 1e-10 * speed_lu_s * z.abs().exp(), "{phase:?}");
        let acceleration_lu_s2 = phase.acceleration_lu_s2 + phase.rate_per_s2 * state.position_lu;
        let scale = 50.0 + (phase.rate_per_s2 * state.position_lu).abs();
        assert!((state.acceleration_lu_s2 - acceleration_lu_s2).abs() < 1e-12 * scale * z.abs().exp(), "{phase:?}");
        assert!((state.jerk_lu_s3 - phase.rate_per_s2 * state.velocity_lu_s).abs() <= 1e-12 * state.jerk_lu_s3.abs());
    }
}

/// One line along X from rest to rest.
fn line_s(machine: &Machine, length_mm: f64, feed_mm_s: f64, brisk: bool) -> f64 {
    let mut program = Program::new(PathMode::G64, feed_mm_s * 60.0);
    if brisk {
        program.modes.acceleration_mode = AccelerationMode::Brisk;
    }
    program.line(&[length_mm]);
    total_s(&program.planned(machine))
}

/// The optimum is known; the law keeps a reserve of 0.2 % and changes its jerk at the places of its grid only.
#[test]
fn a_line_takes_about_the_time_of_the_closed_form_and_never_less() {
    let machine = machine();
    let limits = machine.axes[0].limits;
    let (a, j) = (limits.acceleration_max_lu_s2, limits.jerk_max_lu_s3);
    let mut random = Random::new(12);
    for _ in 0..60 {
        let (length_mm, feed_mm_s) = (random.logarithmic(1e-3, 300.0), random.logarithmic(0.05, 300.0));
        let ramp_s = |v: f64| if v <= a * a / j { 2.0 * (v / j).sqrt() } else { v / a + a / j };
        // Both ramps take v times their time: bisection for the highest speed that fits.
        let (mut low, mut high) = (0.0, feed_mm_s);
        for _ in 0..200 {
            let v = 0.5 * (low + high);
            if v * ramp_s(v) <= length_mm { low = v } else { high = v }
        }
        let least_s = 2.0 * ramp_s(low) + (length_mm - low * ramp_s(low)) / low;
        let time_s = line_s(&machine, length_mm, feed_mm_s, false);
        let ratio = time_s / least_s;
        assert!((1.0 - 1e-9..1.025).contains(&ratio), "{length_mm} mm at {feed_mm_s} mm/s: {time_s} of {least_s} s");
        let brisk_v = feed_mm_s.min((a * length_mm).sqrt());
        let least_s = 2.0 * brisk_v / a + (length_mm - brisk_v * brisk_v / a) / brisk_v;
        let ratio = line_s(&machine, length_mm, feed_mm_s, true) / least_s;
        assert!((1.0 - 1e-9..1.02).contains(&ratio), "BRISK, {length_mm} mm at {feed_mm_s} mm/s: {ratio}");
    }
}

/// From one phase to the next, over block ends too, speed and acceleration go on; at rest both are 0.
fn goes_on(planned: &[PlannedPiece], what: &str) {
    let mut before: Option<(f64, f64)> = None;
    for piece in planned {
        let phases = piece.law.phases();
        for phase in phases {
            let at = (phase.velocity_lu_s, phase.acceleration_lu_s2);
            if let Some((v, a)) = before {
                assert!((v - at.0).abs() < 1e-6 * (1.0 + v), "{what}: speed steps from {v} to {}", at.0);
                assert!((a - at.1).abs() < 1e-5 * (100.0 + a.abs()), "{what}: acceleration from {a} to {}", at.1);
            }
            let end = phase.at(phase.duration_s);
            assert!(end.velocity_lu_s > -1e-9, "{what}: speed {}", end.velocity_lu_s);
            before = Some((end.velocity_lu_s, end.acceleration_lu_s2));
        }
        if let (Some(last), length_lu) = (phases.last(), piece.path.length_lu()) {
            let end_lu = last.at(last.duration_s).position_lu;
            assert!((end_lu - length_lu).abs() < 1e-9 * (1.0 + length_lu), "{what}: ends at {end_lu} of {length_lu}");
        }
    }
    let (v, a) = before.unwrap();
    assert!(v.abs() < 1e-6 && a.abs() < 1e-2, "{what}: ends with {v} mm/s, {a} mm/s²");
}

fn goes_on_in_windows(windows: [usize; 2]) {
    for seed in 0..12 {
        let mut random = Random::new(100 + seed);
        let points = random.walk(40, 0.05, 8.0);
        for blocks in windows {
            let machine = Machine { look_ahead_blocks: blocks, ..machine() };
            let program = Program::polyline(PathMode::G642, 6000.0, &points);
            goes_on(&program.planned(&machine), &format!("seed {seed}, {blocks} blocks"));
        }
    }
}

// Two tests, so that they run at the same time.
#[test]
fn acceleration_goes_on_over_block_ends_in_short_windows() {
    goes_on_in_windows([1, 2]);
}

#[test]
fn acceleration_goes_on_over_block_ends_in_longer_windows() {
    goes_on_in_windows([8, 100]);
}

/// A longer window sees more, so that it is not slower but for the tolerance of the planner; a short one brakes for its end and says so.
#[test]
fn a_short_window_costs_time_and_says_so() {
    let points: Vec<[f64; 2]> = (1..=200).map(|i| [0.2 * f64::from(i), 0.0]).collect();
    let program = Program::polyline(PathMode::G64, 6000.0, &points);
    let mut before_s = f64::INFINITY;
    for blocks in [1, 3, 10, 30, 100] {
        let planned = program.planned(&Machine { look_ahead_blocks: blocks, ..machine() });
        let time_s = total_s(&planned);
        assert!(time_s < before_s * 1.002, "{blocks} blocks: {time_s} s after {before_s} s");
        before_s = time_s;
        let held =
            |kind| planned.iter().flat_map(|piece| piece.law.phases()).filter(move |phase| phase.limit.kind == kind);
        let ends = held(LimitKind::LookAhead).count();
        assert_eq!(ends > 0, blocks < 100, "{blocks} blocks: {ends} phases brake for the end of the window");
        for phase in held(LimitKind::Feed) {
            let speed_mm_s = phase.at(0.5 * phase.duration_s).velocity_lu_s;
            assert!(speed_mm_s > 0.98 * 100.0, "{blocks} blocks: {speed_mm_s} mm/s, and F is said to hold it");
        }
    }
}

/// MD35220, MD35230: above half of its velocity X has 60 % of its acceleration.
#[test]
fn drive_keeps_the_lower_acceleration_at_high_speed() {
    let mut machine = machine();
    machine.axes[0].acceleration_reduction = AccelerationReduction { velocity_ratio: 0.5, reduction_ratio: 0.4 };
    let limits = machine.axes[0].limits;
    for (share, lower) in [(0.4, false), (0.9, true)] {
        let mut program = Program::new(PathMode::G64, share * limits.velocity_max_lu_s * 60.0);
        program.modes = modes(PathMode::G64);
        program.modes.acceleration_mode = AccelerationMode::Drive;
        program.line(&[150.0]);
        let x = AxisId::new(0);
        let most = |of: fn(&sollwert::interpolator::AxisSetpoint) -> f64| {
            program.setpoints(&machine).iter().map(|row| of(&row.axes[x]).abs()).fold(0.0, f64::max)
        };
        let (fastest, hardest) = (most(|axis| axis.velocity_lu_s), most(|axis| axis.acceleration_lu_s2));
        let allowed = limits.acceleration_max_lu_s2 * if lower { 0.6 } else { 1.0 };
        assert!(fastest > 0.95 * share * limits.velocity_max_lu_s, "{fastest}");
        assert!(hardest <= allowed * (1.0 + 1e-9) && hardest > 0.97 * allowed, "{hardest} of {allowed}");
    }
}

/// Every plan that begins at rest in the middle of a path, as after a stop at the end of a window that then grows, starts there.
#[test]
fn a_path_that_is_handed_over_block_by_block_is_planned_to_its_end() {
    let mut random = Random::new(7);
    let program = Program::polyline(PathMode::G642, 3000.0, &random.walk(120, 0.02, 2.0));
    let machine = Machine { look_ahead_blocks: 1, ..machine() };
    let paths = program.paths(&machine);
    let length_lu: f64 = paths.iter().map(sollwert::kinematics::JointPath::length_lu).sum();
    let planned = plan(&machine, paths);
    let driven_lu: f64 = planned.iter().map(|piece| piece.path.length_lu()).sum();
    assert!((driven_lu - length_lu).abs() < 1e-9);
    assert!(planned.iter().all(|piece| piece.path.length_lu() == 0.0 || piece.law.duration_s() > 0.0));
}

/// An arc into a line that all but turns back (178.3°): the blend between them has a place with next to no radius. The path has to crawl there, but no axis
/// has to rest, as each has to with exact stops; and it must not creep along all of the blend at the speed that this place allows.
#[test]
fn a_blend_that_all_but_turns_back_is_not_crept_along() {
    let mut program = Program::new(PathMode::G642, 1430.0);
    program.line(&[-0.9823, 2.7093]);
    program.arc([-1.13745, 2.653044], 4.31353, 0.0);
    // Two micrometres beside the cusp, where the path would stop.
    program.line(&[-1.199154, 2.494531]);
    let machine = machine();
    let behind_arc =
        |path: &JointPath| matches!(path.contour.kind, PieceKind::Blend(..)) && path.contour.block.number == 2;
    assert!(program.paths(&machine).iter().any(behind_arc), "no blend behind the arc");
    let time_s = total_s(&program.planned(&machine));
    // From rest to rest over the line, the arc and the line, with stops between them.
    let mut stops = program.clone();
    stops.moves.iter_mut().for_each(|one| one.modes.path_mode = PathMode::ExactStop);
    let stops_s = total_s(&stops.planned(&machine));
    assert!(time_s < stops_s, "{time_s} s, with exact stops {stops_s} s");
}

/// An arc of chords with rounded corners, from rest to rest.
fn chords(count: u32, chord_mm: f64, radius_mm: f64) -> Program {
    let mut program = Program::new(PathMode::G642, 3000.0);
    for i in 1..=count {
        let turned = f64::from(i) * chord_mm / radius_mm;
        let rounded = |mm: f64| (mm * 1e4).round() / 1e4;
        program.line(&[rounded(radius_mm * turned.sin()), rounded(radius_mm * (1.0 - turned.cos()))]);
    }
    program
}

/// Where the window ends in a hair of a line between two blends the path still brakes for its end over all that is before it: it went from 50 mm/s to a stop in the
/// middle of an arc of chords, for a window of several times the way that it takes.
#[test]
fn a_window_that_ends_in_next_to_nothing_stops_nobody() {
    for (chord_mm, radius_mm, blocks, slower_max_ratio) in
        [(0.2, 50.0, 8, 1.15), (0.2, 50.0, 10, 1.08), (2.0, 100.0, 10, 1.005)]
    {
        let program = chords(20, chord_mm, radius_mm);
        let time_s = |blocks| total_s(&program.planned(&Machine { look_ahead_blocks: blocks, ..machine() }));
        let (short_s, long_s) = (time_s(blocks), time_s(2 * blocks));
        assert!(short_s < slower_max_ratio * long_s, "{chord_mm} mm: {short_s} s, with a longer window {long_s} s");
    }
}

/// In a window of w blocks of length h the path is about as fast as stops within the w - 1 behind the block at hand, with the jerk J all along: from v that takes the
/// way v √(v/J), so that v = ∛(J (w - 1)² h²). A plan that was not found was followed to its stop, and dense paths took twice that and more.
#[test]
fn dense_blocks_flow_as_fast_as_a_short_window_can_stop() {
    const COUNT: u32 = 100;
    for chord_mm in [0.2, 0.5] {
        let program = chords(COUNT, chord_mm, 250.0 * chord_mm);
        let time_s = |blocks| total_s(&program.planned(&Machine { look_ahead_blocks: blocks, ..machine() }));
        let length_mm = f64::from(COUNT) * chord_mm;
        let jerk = spinner().axis(AxisId::new(0)).limits.jerk_max_lu_s3;
        let unhindered_s = time_s(50);
        for blocks in [2_u8, 3, 5, 8] {
            let stop_mm = f64::from(blocks - 1) * chord_mm;
            let expected_s = unhindered_s.max(length_mm / (jerk * stop_mm * stop_mm).cbrt());
            let window_s = time_s(usize::from(blocks));
            assert!(
                window_s < 1.25 * expected_s,
                "{chord_mm} mm, {blocks} blocks: {window_s} s, expected {expected_s}"
            );
        }
    }
}
