//! Synchronised actions on $AC_OVR: at which set-point they act, for how long, and that limits hold.

use crate::support::spinner;
use sollwert::base::AxisId;
use sollwert::feed::{LimitKind, OverrideSchedule};
use sollwert::interpolator::{Interpolator, Setpoint};
use sollwert::kernel::{Findings, PieceSource, Preparation};
use sollwert::machine::{Machine, TimeLawKind};
use sollwert::program::ProgramSource;

const X: AxisId = AxisId::new(0);

fn machine() -> Machine {
    let mut machine = spinner();
    machine.feed.time_law = TimeLawKind::Continuous;
    machine
}

fn run(machine: &Machine, text: &str, overrides: &str) -> (Vec<Setpoint>, Findings) {
    let source = ProgramSource::from_bytes("test.mpf", text.as_bytes());
    let mut preparation = Preparation::new(source, machine);
    if !overrides.is_empty() {
        preparation = preparation.with_overrides(&OverrideSchedule::parse(overrides).unwrap());
    }
    let mut interpolator = Interpolator::new(machine);
    let rows = (0..).map_while(|k| interpolator.sample(k, &mut || preparation.next_piece())).collect();
    (rows, preparation.take_findings())
}

fn rows(text: &str) -> Vec<Setpoint> {
    let (rows, findings) = run(&machine(), text, "");
    assert!(findings.alarm.is_none() && findings.warnings.is_empty(), "{findings:?}");
    holds(&rows);
    rows
}

/// Jerk and acceleration of X by differences.
fn holds(rows: &[Setpoint]) {
    let limits = machine().axes[0].limits;
    let q = |k: usize| rows[k].axes[X].position_lu;
    for k in 1..rows.len() - 2 {
        let a = (q(k + 1) - 2.0 * q(k) + q(k - 1)) / 1e-6;
        let j = (q(k + 2) - 3.0 * q(k + 1) + 3.0 * q(k) - q(k - 1)) / 1e-9;
        assert!(a.abs() <= limits.acceleration_max_lu_s2 * (1.0 + 1e-6), "tick {k}: a {a}");
        assert!(j.abs() <= limits.jerk_max_lu_s3 * (1.0 + 1e-3) + 1.0, "tick {k}: j {j}");
    }
}

fn x(row: &Setpoint) -> f64 {
    row.axes[X].position_lu
}

/// The set-points with this override, which must follow each other: first and last.
fn span(rows: &[Setpoint], override_ratio: f64) -> (usize, usize) {
    let is = |row: &&Setpoint| (row.path.override_ratio - override_ratio).abs() < 1e-12;
    let first = rows.iter().position(|row| is(&row)).expect("in force somewhere");
    let count = rows.iter().filter(is).count();
    assert!(rows[first..first + count].iter().all(|row| is(&row)), "in one piece");
    (first, first + count - 1)
}

#[test]
fn whenever_acts_from_the_set_point_after_the_one_that_shows_it_to_the_one_after_it_ends() {
    let condition = "ID=1 WHENEVER ($AA_IM[X] > 100) AND (200 >= $AA_IM[X]) DO $AC_OVR=50\n";
    let with = rows(&format!("{condition}G1 X400 F6000\nM30\n"));
    let plain = rows("G1 X400 F6000\nM30\n");
    let (first, last) = span(&with, 0.5);
    assert!(x(&with[first - 1]) > 100.0 && x(&with[first - 2]) <= 100.0);
    assert!(x(&with[last]) > 200.0 && x(&with[last - 1]) <= 200.0);
    assert!(with[..=first].iter().zip(&plain).all(|(a, b)| a.axes[X] == b.axes[X]), "nothing is foreseen");
    let slow = with[last].path;
    assert!((slow.feed_lu_s - 50.0).abs() < 0.05 && slow.limit.kind == LimitKind::Override, "{slow:?}");
    let again = with.iter().rev().find(|row| x(row) < 380.0).unwrap();
    assert!((again.path.feed_lu_s - 100.0).abs() < 0.1, "{}", again.path.feed_lu_s);
}

#[test]
fn when_and_every_act_in_one_cycle_from_in_all_that_follow() {
    let program = |action: &str| rows(&format!("{action}\nG1 X200 F6000\nX0\nX200\nM30\n"));
    let counts = |rows: &[Setpoint]| rows.iter().filter(|row| row.path.override_ratio == 0.75).count();
    assert_eq!(counts(&program("ID=1 WHEN $AA_IM[X] > 100 DO $AC_OVR=75")), 1);
    assert_eq!(counts(&program("ID=1 EVERY $AA_IM[X] > 100 DO $AC_OVR=75")), 2);
    let from = program("IDS=7 FROM $AA_IM[X] > 100 DO $AC_OVR=75");
    let (first, last) = span(&from, 0.75);
    assert!(x(&from[first - 1]) > 100.0 && last + 1 == from.len());
    let always = program("ID=1 DO $AC_OVR=75");
    assert_eq!(span(&always, 0.75), (1, always.len() - 1));
}

#[test]
fn an_action_without_a_number_lasts_for_a_block_and_cancel_ends_one_with_a_number() {
    let lines = |rows: &[Setpoint]| {
        let (first, last) = span(rows, 0.5);
        [first, last].map(|k| rows[k].path.block.line)
    };
    assert_eq!(lines(&rows("G1 X50 F6000\nWHENEVER TRUE DO $AC_OVR=50\nX100\nX150\nM30\n")), [3, 4]);
    let block = rows("G1 X50 F6000\nDO $AC_OVR=50\nX100\nX150\nM30\n");
    let (first, last) = span(&block, 0.5);
    // From the set-point after the first of its block to the first of the next block, whose own override comes after it.
    assert!(x(&block[first]) > 50.0 && x(&block[first - 2]) <= 50.0, "{}", x(&block[first]));
    assert!(x(&block[last]) >= 100.0 && x(&block[last - 1]) < 100.0 + 0.1);
    let cancelled = rows("ID=3 DO $AC_OVR=50\nG1 X50 F6000\nX100\nCANCEL(3)\nX150\nM30\n");
    let (first, last) = span(&cancelled, 0.5);
    assert!(first == 1 && (99.9..100.2).contains(&x(&cancelled[last])), "{}", x(&cancelled[last]));
}

#[test]
fn both_overrides_multiply_and_the_value_may_be_an_expression() {
    let text = "R1=40\nID=1 DO $AC_OVR=R1*2\nG1 X300 F6000\nM30\n";
    let (rows, findings) = run(&machine(), text, "1=50,3=200");
    assert!(findings.alarm.is_none());
    holds(&rows);
    let ratios = [900, 1100, 3100].map(|k| rows[k].path.override_ratio);
    assert!(ratios.iter().zip([0.8, 0.4, 1.6]).all(|(is, should)| (is - should).abs() < 1e-12), "{ratios:?}");
    assert!((rows[2500].path.feed_lu_s - 40.0).abs() < 0.05, "{}", rows[2500].path.feed_lu_s);
}

#[test]
fn the_path_is_held_while_an_action_says_so_and_stops_for_good_where_it_never_ends() {
    let held = rows("ID=1 WHENEVER ($AC_TIME > 1) AND ($AC_TIME < 2) DO $AC_OVR=0\nG1 X200 F6000\nM30\n");
    let still = held.iter().filter(|row| row.path.feed_lu_s == 0.0 && row.path.limit.kind == LimitKind::Override);
    let still_s = still.count() as f64 * 1e-3;
    // A second less the stop from 100 mm/s, which takes a sixth of one.
    assert!((still_s - (1.0 - 1.0 / 6.0)).abs() < 0.02, "{still_s}");
    assert_eq!(x(held.last().unwrap()), 200.0);
    let (rows, findings) = run(&machine(), "ID=1 WHENEVER $AA_IM[X] >= 50 DO $AC_OVR=0\nG1 X200 F6000\nX0\nM30\n", "");
    let alarm = findings.alarm.expect("it never ends");
    assert!(alarm.code == "P0005" && alarm.line() == 2, "{alarm:?}");
    let end = x(rows.last().unwrap());
    // The way of the stop, and a cycle or two.
    assert!((58.2..59.5).contains(&end) && rows.iter().all(|row| x(row) <= end), "{end}");
    holds(&rows);
}

#[test]
fn other_actions_are_reported_and_not_executed() {
    for action in ["WHEN $A_IN[1] == 1 DO M8", "ID=1 WHENEVER $AA_IW[X] > 5 DO $AC_OVR=50", "ID=2 DO POS[X]=5"] {
        let (rows, findings) = run(&machine(), &format!("{action}\nG1 X20 F3000\nM30\n"), "");
        assert!(findings.alarm.is_none() && findings.warnings.len() == 1, "{action}: {findings:?}");
        assert!(rows.iter().all(|row| row.path.override_ratio == 1.0));
    }
    let seven_phase = Machine { feed: spinner().feed, ..machine() };
    let (rows, findings) = run(&seven_phase, "ID=1 DO $AC_OVR=50\nG1 X20 F3000\nM30\n", "");
    assert_eq!(findings.warnings.len(), 1);
    assert!(rows.iter().all(|row| row.path.override_ratio == 1.0));
}
