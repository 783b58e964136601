//! Exact stops that wait for the axes, from recordings: how long, judged by set-point and measured position alone; and in closed form.

use crate::trace::{Trace, trace};
use std::ops::RangeInclusive;

const SPINNER: [&str; 2] = ["-m", "spinner_mvc850"];
/// Slow enough to be seen: the lag at the end of a motion is some hundredths of a millimetre.
const SLOW: [&str; 4] =
    ["--set", "axes.X.drive.velocity_feedforward=0.8", "--set", "axes.Y.drive.position_gain_per_s=25"];
const FINE_MM: f64 = 0.010;
const COARSE_MM: f64 = 0.040;

/// Rows of the path that wait, as ranges.
fn waits(trace: &Trace) -> Vec<RangeInclusive<usize>> {
    let mut waits: Vec<RangeInclusive<usize>> = Vec::new();
    for (k, row) in trace.rows.iter().enumerate().filter(|(_, row)| row.limit_kind == "in_position") {
        match waits.last_mut() {
            // A wait begins with the row after the one at which its block has ended: between two waits a block moves.
            Some(last) if *last.end() + 1 == k => *last = *last.start()..=k,
            _ => waits.push(k..=k),
        }
        assert_eq!(row.feed_mm_min, 0.0);
    }
    waits
}

/// The time at which every axis was seen in position for the first time from `end_ns` on, each by its last row: its set-point has not moved
/// for a position cycle, and it is within `window_mm` (deg). Rows of axes with other cycles stand at other times.
fn seen_ns(trace: &Trace, end_ns: u64, window: f64) -> u64 {
    let mut times: Vec<u64> =
        trace.axes.values().flat_map(|(times, _)| times).copied().filter(|ns| *ns >= end_ns).collect();
    times.sort_unstable();
    let inside = |axis: &String, now_ns: u64| {
        let times = &trace.axes[axis].0;
        let k = times.partition_point(|ns| *ns <= now_ns) - 1;
        let (sent, measured) = (trace.column(axis, "position_setpoint"), trace.column(axis, "position_measured"));
        // The control's rest is 1e-9 mm or rad.
        let still = if ["A", "B", "C"].contains(&axis.as_str()) { 1e-9_f64.to_degrees() } else { 1e-9 };
        times[k] >= end_ns && (sent[k] - sent[k - 1]).abs() <= still && (sent[k] - measured[k]).abs() <= window
    };
    times.into_iter().find(|now_ns| trace.axes.keys().all(|axis| inside(axis, *now_ns))).expect("the axes arrive")
}

/// Each wait begins behind the row at which its block has ended, and the next block at the first set-point after all axes were seen in position.
fn waits_are_as_long_as_they_must(trace: &Trace, windows: &[(u32, Option<f64>)], at: &str) {
    let found = waits(trace);
    let lines: Vec<u32> = found.iter().map(|wait| trace.rows[*wait.start()].line).collect();
    let expected: Vec<u32> = windows.iter().filter(|(_, window)| window.is_some()).map(|(line, _)| *line).collect();
    assert_eq!(lines, expected, "{at}");
    for (wait, line) in found.iter().zip(&lines) {
        let window = windows.iter().find(|(of, _)| of == line).and_then(|(_, window)| *window).unwrap();
        let end = *wait.start() - 1;
        let seen_ns = seen_ns(trace, trace.rows[end].time_ns, window);
        let acts = trace.rows.partition_point(|row| row.time_ns <= seen_ns);
        assert_eq!(*wait.end(), acts, "{at}, line {line}: seen at {seen_ns} ns, waits {wait:?}");
        let (times, columns) = &trace.axes["X"];
        let of =
            |row: usize| columns["position_setpoint"][times.partition_point(|ns| *ns <= trace.rows[row].time_ns) - 1];
        assert!((end..=acts).all(|row| (of(row) - of(end)).abs() < 1e-9), "{at}, line {line}");
    }
    let shares = &trace.recording.summary().unwrap()["limits"];
    let share = found.iter().map(|wait| wait.clone().count()).sum::<usize>() as f64 / (trace.rows.len() - 1) as f64;
    assert!((shares["in_position"].as_f64().unwrap() - share).abs() < 1e-12);
}

/// Line by line which window ends the block; `None`: none.
const PROGRAM: &str = "\
G60 G1 X30 F4000
Y20
G602 X10
G603 X5
G601 G9 G641 X20
G642 X40
G602 Y10
G4 F0.02
X50 Y12
STOPRE
G60 X55
G64 POS[Z]=6
X60
Y0
X0 M30
";
const WINDOWS: [(u32, Option<f64>); 13] = [
    (1, Some(FINE_MM)),
    (2, Some(FINE_MM)),
    (3, Some(COARSE_MM)),
    (4, None),
    (5, Some(FINE_MM)),
    (6, None),
    (7, Some(COARSE_MM)),
    (9, Some(COARSE_MM)),
    (11, Some(COARSE_MM)),
    // A positioning axis comes to the fine window whatever G602 says.
    (12, Some(FINE_MM)),
    (13, None),
    (14, None),
    (15, None),
];

#[test]
fn a_block_ends_when_every_axis_is_in_its_window_and_not_a_cycle_later() {
    for law in ["seven-phase", "continuous"] {
        let law_set = ["--set".to_owned(), format!("feed.time_law=\"{law}\"")];
        let words: Vec<&str> = SPINNER.into_iter().chain(SLOW).chain(law_set.iter().map(String::as_str)).collect();
        let run = trace(&format!("in_position_{law}"), PROGRAM, &words);
        waits_are_as_long_as_they_must(&run, &WINDOWS, law);

        // Without drives nothing waits, and that is said; the difference is the waits, and the rest of a cycle that each of them rounds up.
        let plain = trace(&format!("not_waiting_{law}"), PROGRAM, &[&words[..], &["--no-drives"]].concat());
        assert!(waits(&plain).is_empty());
        let summary = plain.recording.summary().unwrap();
        let codes: Vec<&str> =
            summary["warnings"].as_array().unwrap().iter().map(|w| w["code"].as_str().unwrap()).collect();
        assert!(codes.contains(&"K0002"), "{codes:?}");
        let longer = run.rows.len() - plain.rows.len();
        let found = waits(&run);
        let waited: usize = found.iter().map(|wait| wait.clone().count()).sum();
        assert!(
            (waited..=waited + found.len()).contains(&longer),
            "{law}: {longer} rows longer, {waited} of them waits"
        );
    }
}

/// The Mikron: set-points at 4 ms, X, Y, Z and A at 2 ms, C at 4 ms; a rotary axis counts in degrees.
#[test]
fn axes_with_other_cycles_are_seen_at_their_own_ticks() {
    let text = "G60 G1 X30 A5 F4000\nC12\nX10 Y10 A0 C0\nG603 X0\nG601 Y0\nM30\n";
    let slow = ["--set", "axes.C.drive.position_gain_per_s=10", "--set", "axes.C.drive.velocity_feedforward=0.5"];
    let run = trace("in_position_mikron", text, &[&["-m", "mikron_ucp710"], &slow[..]].concat());
    assert!(run.rows[1].time_ns == 4_000_000 && run.axes["X"].0[1] == 2_000_000 && run.axes["C"].0[1] == 4_000_000);
    // 10 µm and 0.01 deg.
    waits_are_as_long_as_they_must(&run, &[1, 2, 3, 5].map(|line| (line, Some(FINE_MM))), "mikron");
}

/// P-control alone (no feed-forward, no delay), constant deceleration a from v to rest: the lag obeys e' = v(t) - Kv e, so that at the end of the
/// ramp it is a/Kv² (1 - (1 + Kv v/a) exp(-Kv v/a)) where the ramp began at the lag v/Kv: plus v/Kv exp(-Kv v/a) - and from there it dies out with
/// Kv: wait = ln(e / window) / Kv. The controller works at 1 ms: ln(1 / (1 - Kv T_p)) a cycle instead of Kv T_p, and the lag of a ramp is one of
/// sampled values, by T_p / 2 of speed.
#[test]
fn the_wait_of_a_p_controlled_axis_is_that_of_the_closed_form() {
    let (gain_per_s, v, a): (f64, f64, f64) = (1000.0 / 60.0, 60.0, 1000.0);
    let sets = [
        "axes.X.drive.position_gain_per_s=16.666666666666668",
        "axes.X.drive.velocity_feedforward=0",
        "axes.X.drive.torque_feedforward=0",
        "axes.X.drive.setpoint_delay_ms=0",
        "axes.X.mechanics.coulomb_friction_n_m=0",
        "axes.X.mechanics.breakaway_friction_n_m=0",
        "axes.X.drive.contour_monitoring_um=inf",
    ];
    let words: Vec<&str> = SPINNER.into_iter().chain(sets.iter().flat_map(|set| ["--set", *set])).collect();
    for (code, window_mm) in [("G601", FINE_MM), ("G602", COARSE_MM)] {
        // Long enough for the lag to settle: exp(-16.7 / s * 1 s).
        let text = format!("BRISK G60 {code} G1 X80 F3600\nX0\nM30\n");
        let run = trace(&format!("closed_wait_{code}"), &text, &words);
        let ramp = (-gain_per_s * v / a).exp();
        let lag_mm = v / gain_per_s * ramp + a / gain_per_s.powi(2) * (1.0 - (1.0 + gain_per_s * v / a) * ramp);
        let wanted_s = (lag_mm / window_mm).ln() / gain_per_s;
        for wait in waits(&run) {
            let waited_s = wait.count() as f64 * 1e-3;
            // Sampling: 0.8 % of the time constant, half a cycle of lag; the two cycles of the wire; the speed loop (a few ms of its own lag less).
            assert!(
                (waited_s - wanted_s).abs() < 0.02 * wanted_s + 3e-3,
                "{code}: waits {waited_s} s for {wanted_s} s"
            );
        }
        assert_eq!(waits(&run).len(), 2);
    }
}
