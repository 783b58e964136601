//! The feed override at run time: limits from outside, closed forms on a line, and that it changes nothing else.

use crate::support::{Program, Random, plan, plan_under, sample, spinner, test_machine_shipped};
use sollwert::base::AxisId;
use sollwert::feed::{LimitKind, OverrideSchedule, PlannedPiece};
use sollwert::interpolator::{Interpolator, Setpoint};
use sollwert::kernel::{PieceSource, Preparation};
use sollwert::kinematics::JointPath;
use sollwert::machine::{BlendShape, Machine, PathMode, TimeLawKind};
use sollwert::program::ProgramSource;

const T_S: f64 = 1e-3;

/// Blends without a step of curvature: no place is exempt from any limit.
fn machine() -> Machine {
    let mut machine = spinner();
    machine.feed.time_law = TimeLawKind::Continuous;
    machine.smoothing.shape = BlendShape::Quintic;
    machine.look_ahead_blocks = 60;
    machine
}

fn setpoints(machine: &Machine, program: &Program, overrides: &str) -> Vec<Setpoint> {
    sample(machine, plan_under(machine, overrides, program.paths(machine)))
}

/// Velocity, acceleration and jerk of every axis by differences of positions: means over a cycle of what must hold at each instant.
fn holds(machine: &Machine, rows: &[Setpoint], what: &str) {
    let q = |k: usize, axis: AxisId| rows[k].axes[axis].position_lu;
    for k in 1..rows.len() - 2 {
        for axis in machine.axis_ids() {
            let limits = &machine.axis(axis).limits;
            let v = (q(k + 1, axis) - q(k, axis)) / T_S;
            let a = (q(k + 1, axis) - 2.0 * q(k, axis) + q(k - 1, axis)) / T_S.powi(2);
            let j = (q(k + 2, axis) - 3.0 * q(k + 1, axis) + 3.0 * q(k, axis) - q(k - 1, axis)) / T_S.powi(3);
            let at = format!("{what}: tick {k} line {} axis {}", rows[k].path.block.line, axis.index());
            assert!(v.abs() <= limits.velocity_max_lu_s * (1.0 + 1e-9), "{at}: v {v}");
            assert!(a.abs() <= limits.acceleration_max_lu_s2 * (1.0 + 1e-6), "{at}: a {a}");
            assert!(j.abs() <= limits.jerk_max_lu_s3 * (1.0 + 1e-3) + 1.0, "{at}: j {j}");
        }
        assert!(rows[k].path.path_length_mm >= rows[k - 1].path.path_length_mm - 1e-9, "{what}: back at {k}");
    }
}

/// 500 mm along X at 100 mm/s.
fn line() -> Program {
    let mut program = Program::new(PathMode::G64, 6000.0);
    program.line(&[500.0]);
    program
}

/// Time and way of a jerk-limited change of speed without acceleration at its ends.
fn ramp(machine: &Machine, from_lu_s: f64, to_lu_s: f64) -> (f64, f64) {
    let limits = machine.axes[0].limits;
    let (a, j) = (limits.acceleration_max_lu_s2, limits.jerk_max_lu_s3);
    let d = (to_lu_s - from_lu_s).abs();
    let time_s = if d <= a * a / j { 2.0 * (d / j).sqrt() } else { d / a + a / j };
    (time_s, 0.5 * (from_lu_s + to_lu_s) * time_s)
}

/// A feed this near another one has reached it.
const REACHED_SHARE: f64 = 0.01;

/// The first set-point from `k` on from which the feed stays near `feed_lu_s` for ten cycles.
fn reaches(rows: &[Setpoint], k: usize, feed_lu_s: f64) -> usize {
    let there = |row: &Setpoint| (row.path.feed_lu_s - feed_lu_s).abs() <= REACHED_SHARE * feed_lu_s;
    (k..rows.len()).find(|k| rows[*k..].iter().take(10).all(there)).expect("the feed is reached")
}

/// Time and way of a change of speed until the new one is near: the end of the ramp has constant jerk.
fn ramp_to_near(machine: &Machine, from_lu_s: f64, to_lu_s: f64) -> (f64, f64) {
    let (time_s, way_lu) = ramp(machine, from_lu_s, to_lu_s);
    let near_s = (2.0 * REACHED_SHARE * to_lu_s / machine.axes[0].limits.jerk_max_lu_s3).sqrt();
    (time_s - near_s, way_lu - near_s * to_lu_s)
}

fn axes(rows: &[Setpoint]) -> Vec<sollwert::base::PerAxis<sollwert::interpolator::AxisSetpoint>> {
    rows.iter().map(|row| row.axes).collect()
}

#[test]
fn a_change_on_a_line_takes_the_time_and_the_way_of_the_closed_form() {
    let machine = machine();
    let plain = setpoints(&machine, &line(), "0=100");
    for percent in [5.0, 10.0, 50.0, 90.0, 110.0, 150.0, 200.0] {
        let rows = setpoints(&machine, &line(), &format!("1={percent}"));
        holds(&machine, &rows, &format!("{percent} %"));
        let (time_s, way_lu) = ramp_to_near(&machine, 100.0, percent);
        let (from, to) = (1000, reaches(&rows, 1000, percent));
        // Nothing knows of the change before it comes.
        assert!(axes(&rows[..=from]) == axes(&plain[..=from]), "{percent} %");
        let took_s = (to - from) as f64 * T_S;
        let went_lu = rows[to].path.path_length_mm - rows[from].path.path_length_mm;
        println!("{percent} %: {took_s} of {time_s} s, {went_lu} of {way_lu} mm");
        assert!((took_s - time_s).abs() < 0.05 * time_s + 1.5 * T_S, "{percent} %: {took_s} of {time_s} s");
        assert!((went_lu / way_lu - 1.0).abs() < 0.06, "{percent} %: {went_lu} of {way_lu} mm");
        // It does not fall below, or rise above, what it comes to.
        let beyond = |row: &Setpoint| (row.path.feed_lu_s - percent) * (percent - 100.0).signum();
        let most = rows[from..to + 300].iter().map(beyond).fold(0.0, f64::max);
        assert!(most < 0.005 * percent, "{percent} %: {most} mm/s beyond");
        assert_eq!([from - 1, from].map(|k| rows[k].path.override_ratio), [1.0, percent / 100.0]);
        // Exactly the new feed.
        let cruise = &rows[to + 200].path;
        assert!((cruise.feed_lu_s / percent - 1.0).abs() < 1e-3, "{}", cruise.feed_lu_s);
        assert_eq!(cruise.limit.kind, if percent < 100.0 { LimitKind::Override } else { LimitKind::Feed });
        assert_eq!(rows.last().unwrap().axes[AxisId::new(0)].position_lu, 500.0);
    }
}

#[test]
fn nothing_is_a_stop_and_a_wait_in_the_middle_of_a_block() {
    let machine = machine();
    let rows = setpoints(&machine, &line(), "1=0,3=100");
    holds(&machine, &rows, "0 %");
    let (time_s, way_lu) = ramp(&machine, 100.0, 0.0);
    let stands = |row: &&Setpoint| row.path.feed_lu_s < 1e-9;
    // At 3 s it starts again.
    let still: Vec<&Setpoint> = rows[1000..3000].iter().filter(stands).collect();
    let took_s = (2000 - still.len()) as f64 * T_S;
    let went_lu = still[0].path.path_length_mm - rows[1000].path.path_length_mm;
    println!("0 %: {took_s} of {time_s} s, {went_lu} of {way_lu} mm");
    assert!((took_s / time_s - 1.0).abs() < 0.08, "{took_s} of {time_s} s");
    assert!((went_lu / way_lu - 1.0).abs() < 0.05, "{went_lu} of {way_lu} mm");
    assert!(still[1..].iter().all(|row| row.path.limit.kind == LimitKind::Override));
    let again_s = (reaches(&rows, 3001, 100.0) - 3000) as f64 * T_S;
    assert!((again_s / ramp_to_near(&machine, 0.0, 100.0).0 - 1.0).abs() < 0.05, "{again_s} of {time_s} s");
    // The whole costs what the stop costs.
    let plain = setpoints(&machine, &line(), "0=100");
    let longer_s = (rows.len() - plain.len()) as f64 * T_S;
    assert!((longer_s - (2.0 + 0.5 * time_s - 0.5 * time_s)).abs() < 0.03, "{longer_s} s longer");
}

#[test]
fn the_programmed_feed_and_no_change_are_the_same_to_the_last_bit() {
    let mut random = Random::new(3);
    let program = Program::polyline(PathMode::G642, 4000.0, &random.walk(40, 0.1, 20.0));
    let machine = machine();
    let plain = plan(&machine, program.paths(&machine));
    for overrides in ["0=100", "100=100", "0.5=100,1=100,7.77=100", "1e5=20"] {
        let planned = plan_under(&machine, overrides, program.paths(&machine));
        assert_eq!(plain.len(), planned.len());
        for (before, after) in plain.iter().zip(&planned) {
            assert_eq!(before.law, after.law, "{overrides}");
        }
    }
}

/// Segments that turn so much that every corner is rounded: where a corner is too flat for a blend the velocity of an axis steps.
fn walk(random: &mut Random, longest_mm: f64) -> Vec<[f64; 2]> {
    let (mut at, mut direction_rad) = ([0.0, 0.0], random.between(0.0, 6.3));
    let mut step = || {
        let length_mm = random.logarithmic(0.05, longest_mm);
        at = [at[0] + length_mm * direction_rad.cos(), at[1] + length_mm * direction_rad.sin()];
        direction_rad += random.between(0.1, 2.6) * if random.unit() < 0.5 { -1.0 } else { 1.0 };
        at
    };
    (0..40).map(|_| step()).collect()
}

/// Times up to `end_s` with random percentages; the last one lets the path move.
fn schedule(random: &mut Random, end_s: f64) -> String {
    let mut changes = Vec::new();
    let mut time_s = random.between(0.0, 0.3);
    while time_s < end_s {
        let percent = match (random.unit() * 6.0) as u32 {
            0 => 0.0,
            1 => 100.0,
            2 => random.between(100.0, 200.0),
            3 => random.logarithmic(0.5, 20.0),
            _ => random.between(5.0, 120.0),
        };
        changes.push(format!("{time_s}={percent}"));
        time_s += random.logarithmic(0.003, 0.8);
    }
    changes.push(format!("{time_s}=100"));
    changes.join(",")
}

/// The path is that of the program, from end to end.
fn same_path(planned: &[PlannedPiece], paths: &[JointPath], what: &str) {
    assert_eq!(planned.len(), paths.len(), "{what}");
    for (piece, path) in planned.iter().zip(paths) {
        assert!(piece.path.contour.kind == path.contour.kind, "{what}");
        let (length_lu, law) = (path.length_lu(), &piece.law);
        let end_lu = law.at(law.duration_s()).position_lu;
        assert!((end_lu - length_lu).abs() < 1e-9 * (1.0 + length_lu), "{what}: ends at {end_lu} of {length_lu}");
    }
}

/// Programs of a test: more with `OVERRIDE_PROGRAMS=1000`.
fn programs(usual: u64) -> u64 {
    std::env::var("OVERRIDE_PROGRAMS").ok().and_then(|number| number.parse().ok()).unwrap_or(usual)
}

#[test]
fn every_limit_holds_through_random_changes_on_rounded_polylines() {
    // In program 195 a plan from a slow place would have turned back between two places.
    for seed in (0..programs(10)).chain([195]) {
        let mut random = Random::new(700 + seed);
        let machine = Machine { look_ahead_blocks: [2, 8, 60][seed as usize % 3], ..machine() };
        let walk = walk(&mut random, [40.0, 4.0][seed as usize % 2]);
        let program = Program::polyline(PathMode::G642, random.logarithmic(500.0, 12_000.0), &walk);
        let overrides = schedule(&mut random, 6.0);
        let what = format!("seed {seed} --override {overrides}");
        let planned = plan_under(&machine, &overrides, program.paths(&machine));
        same_path(&planned, &program.paths(&machine), &what);
        holds(&machine, &sample(&machine, planned), &what);
    }
}

/// Many blocks to an interval of the plan, and changes inside them.
#[test]
fn every_limit_holds_through_random_changes_on_dense_points() {
    let machine = machine();
    for seed in 0..programs(4) {
        let mut random = Random::new(800 + seed);
        let step_mm = random.logarithmic(0.02, 0.5);
        let points: Vec<[f64; 2]> =
            (1..=600).map(|i| [step_mm * f64::from(i), -0.5 * step_mm * f64::from(i)]).collect();
        let program = Program::polyline(PathMode::G64, random.logarithmic(1000.0, 9000.0), &points);
        let overrides = schedule(&mut random, 4.0);
        let what = format!("seed {seed} --override {overrides}");
        let planned = plan_under(&machine, &overrides, program.paths(&machine));
        same_path(&planned, &program.paths(&machine), &what);
        holds(&machine, &sample(&machine, planned), &what);
    }
}

#[test]
fn several_rapids_end_before_the_first_feed() {
    let machine = machine();
    let mut program = Program::new(PathMode::G64, 3000.0);
    for x in 1..=30 {
        program.rapid(&[10.0 * f64::from(x)]);
    }
    program.line(&[330.0]);
    for change_s in [0.05, 0.1, 0.2, 0.4, 0.6, 0.8] {
        let rows = setpoints(&machine, &program, &format!("{change_s}=0,4=100"));
        holds(&machine, &rows, &format!("0 % at {change_s} s"));
        let held = rows[3900].axes[AxisId::new(0)].position_lu;
        assert!((held - 300.0).abs() < 1e-9, "0 % at {change_s} s: held at {held}");
    }
}

/// A program as text, prepared and sampled.
fn sampled(machine: &Machine, text: &str, overrides: &str) -> Vec<Setpoint> {
    let source = ProgramSource::from_bytes("test.mpf", text.as_bytes());
    let schedule = OverrideSchedule::parse(overrides).unwrap();
    let mut preparation = Preparation::new(source, machine).with_overrides(&schedule);
    let mut interpolator = Interpolator::new(machine);
    let rows = (0..).map_while(|k| interpolator.sample(k, &mut || preparation.next_piece())).collect();
    let alarm = preparation.take_findings().alarm;
    assert!(alarm.is_none(), "{alarm:?}");
    rows
}

#[test]
fn every_limit_holds_through_random_changes_on_splines_and_compressed_blocks() {
    let machine = machine();
    for (seed, mode) in
        ["BSPLINE", "CSPLINE", "COMPCAD", "COMPCURV"].into_iter().cycle().take(programs(8) as usize).enumerate()
    {
        let mut random = Random::new(900 + seed as u64);
        let mut text = format!("G642 CTOL=0.05\nG1 X0 Y0 F{:.0}\n{mode}\n", random.logarithmic(1000.0, 9000.0));
        let step_mm = if mode.starts_with("COMP") { 0.7 } else { 9.0 };
        for i in 1..=80 {
            let s = step_mm * f64::from(i);
            let (x, y) = (s, 12.0 * (s / 9.0).sin() + random.between(-0.01, 0.01));
            text += &format!("X{x:.4} Y{y:.4} Z{:.4}\n", 0.3 * (s / 5.0).cos() - 0.3);
        }
        text += "M30\n";
        let overrides = schedule(&mut random, 8.0);
        holds(&machine, &sampled(&machine, &text, &overrides), &format!("{mode} {seed} --override {overrides}"));
    }
}

#[test]
fn rapids_are_left_alone() {
    let machine = machine();
    let mut program = Program::new(PathMode::G64, 3000.0);
    program.rapid(&[200.0]);
    let [plain, slow] = ["0=100", "0.1=20,0.2=0,0.3=10"].map(|overrides| setpoints(&machine, &program, overrides));
    assert!(axes(&plain) == axes(&slow));
    // With 0 % they end before the first block with a feed.
    program.line(&[260.0]);
    let rows = setpoints(&machine, &program, "0.1=0,4=100");
    holds(&machine, &rows, "rapid and feed");
    let held = rows[3900].axes[AxisId::new(0)].position_lu;
    assert!((held - 200.0).abs() < 1e-9, "{held}");
    // At 4 s both are true: what held it, and what holds it from there on.
    assert!(rows[3900..4000].iter().all(|row| row.path.limit.kind == LimitKind::Override));
}

/// A new plan whose start comes from a faster one lets the feed give way for a while: what it may not have are the velocities of the axes. Between
/// two rapids, too, that are left alone.
#[test]
fn axis_velocities_hold_while_the_feed_gives_way() {
    let mut machine = test_machine_shipped("xyzbc");
    machine.feed.time_law = TimeLawKind::Continuous;
    machine.smoothing.shape = BlendShape::Quintic;
    let t_s = machine.cycle.time_base.setpoint_period_s();
    let text = "G642\nG0 X0 Y0 Z0\nG1 F5000 X5 Y4\nG1 X16 Y6\nM30\n";
    for overrides in ["0.001=200,0.201=100", "0.001=200,0.15=80,0.2=120", "0.1=150,0.3=60"] {
        let rows = sampled(&machine, text, overrides);
        for axis in machine.axis_ids() {
            let most = rows.windows(2).fold(0.0_f64, |most, pair| {
                most.max((pair[1].axes[axis].position_lu - pair[0].axes[axis].position_lu).abs() / t_s)
            });
            let allowed = machine.axis(axis).limits.velocity_max_lu_s;
            assert!(most <= allowed * (1.0 + 1e-9), "--override {overrides}: axis {}: {most}", axis.index());
        }
    }
}

/// On an arc of chords with rounded corners what the corners take of the jerk makes a change longer than on a line. It comes nevertheless, without a stop on the
/// way: some were followed only after one, a second later.
#[test]
fn dense_rounded_blocks_follow_a_change_without_a_stop() {
    let mut program = Program::new(PathMode::G642, 3000.0);
    for i in 1..=400 {
        let turned = f64::from(i) * 0.004;
        program.line(&[50.0 * turned.sin(), 50.0 * (1.0 - turned.cos())]);
    }
    for shape in [BlendShape::Hermite3, BlendShape::Quintic] {
        let mut machine = machine();
        machine.smoothing.shape = shape;
        let t_s = machine.cycle.time_base.setpoint_period_s();
        for (change_s, percent) in [(0.6, 10.0), (0.9, 10.0), (0.9, 30.0), (1.2, 50.0)] {
            let rows = setpoints(&machine, &program, &format!("{change_s}={percent}"));
            let (from, feed_lu_s) = ((change_s / t_s) as usize, 0.5 * percent);
            let (line_s, _) = ramp_to_near(&machine, rows[from].path.feed_lu_s, feed_lu_s);
            let reached = reaches(&rows, from, feed_lu_s);
            let took_s = (reached - from) as f64 * t_s;
            assert!(took_s < 3.0 * line_s, "{shape:?}, {change_s} s to {percent} %: {took_s} s, on a line {line_s}");
            let after = &rows[from..reached + (0.1 / t_s) as usize];
            let slowest_lu_s = after.iter().fold(f64::INFINITY, |least, row| least.min(row.path.feed_lu_s));
            assert!(slowest_lu_s > 0.4 * feed_lu_s, "{shape:?}, {change_s} s to {percent} %: {slowest_lu_s} lu/s");
        }
    }
}

#[test]
fn what_is_no_schedule_is_refused_with_its_place() {
    let columns = |text: &str| {
        let fault = OverrideSchedule::parse(text).expect_err(text);
        let place = fault.place.expect("a place");
        assert!(!place.label.is_empty() && fault.help.is_some() && fault.code == "C0007");
        place.line_text[place.columns].to_owned()
    };
    for (text, marked) in [
        ("", ""),
        ("2.5", "2.5"),
        ("1=50,", ""),
        ("x=50", "x"),
        ("-1=50", "-1"),
        ("1=abc", "abc"),
        ("1=201", "201"),
        ("1=-5", "-5"),
        ("1=0.01", "0.01"),
        ("1=NaN", "NaN"),
        ("inf=50", "inf"),
        ("2=50,1=60", "1"),
        ("2=50,2=60", "2"),
        ("1=50,2=0", "0"),
        ("1=5=0", "5=0"),
    ] {
        assert_eq!(columns(text), marked, "{text}");
    }
    assert_eq!(OverrideSchedule::parse(" 1 = 50 , 2=0, 3=100").unwrap().changes().len(), 3);
}
