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

/// Every axis at row `k`: the set-point has not moved for a position cycle, and the axis is within `window_mm`.
fn in_position(trace: &Trace, k: usize, window_mm: f64) -> bool {
    ["X", "Y", "Z"].iter().all(|axis| {
        let (sent, measured) = (trace.column(axis, "position_setpoint"), trace.column(axis, "position_measured"));
        (sent[k] - sent[k - 1]).abs() <= 1e-9 && (sent[k] - measured[k]).abs() <= window_mm
    })
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
G64 X60
Y0
X0 M30
";
const WINDOWS: [(u32, Option<f64>); 11] = [
    (1, Some(FINE_MM)),
    (2, Some(FINE_MM)),
    (3, Some(COARSE_MM)),
    (4, None),
    (5, Some(FINE_MM)),
    (6, None),
    (7, Some(COARSE_MM)),
    (9, Some(COARSE_MM)),
    (11, Some(COARSE_MM)),
    (13, None),
    (14, None),
];

#[test]
fn a_block_ends_when_every_axis_is_in_its_window_and_not_a_cycle_later() {
    for law in ["seven-phase", "continuous"] {
        let law_set = ["--set".to_owned(), format!("feed.time_law=\"{law}\"")];
        let words: Vec<&str> = SPINNER.into_iter().chain(SLOW).chain(law_set.iter().map(String::as_str)).collect();
        let run = trace(&format!("in_position_{law}"), PROGRAM, &words);
        let found = waits(&run);
        let lines: Vec<u32> = found.iter().map(|wait| run.rows[*wait.start()].line).collect();
        let expected: Vec<u32> = WINDOWS.iter().filter(|(_, window)| window.is_some()).map(|(line, _)| *line).collect();
        assert_eq!(lines, expected, "{law}");
        for (wait, line) in found.iter().zip(&lines) {
            let window_mm = WINDOWS.iter().find(|(of, _)| of == line).and_then(|(_, window)| *window).unwrap();
            // The first row at the end of the block is the one before; the next block begins one set-point after all were seen in position.
            let end = *wait.start() - 1;
            let seen = (end..).find(|k| in_position(&run, *k, window_mm)).unwrap();
            assert_eq!(*wait.end(), seen + 1, "{law}, line {line}: seen at row {seen}, waits {wait:?}");
            let sent = run.column("X", "position_setpoint");
            assert!((end..=*wait.end()).all(|k| (sent[k] - sent[end]).abs() < 1e-9));
        }
        let shares = &run.recording.summary().unwrap()["limits"];
        let share = found.iter().map(|wait| wait.clone().count()).sum::<usize>() as f64 / (run.rows.len() - 1) as f64;
        assert!((shares["in_position"].as_f64().unwrap() - share).abs() < 1e-12);

        // Without drives nothing waits, and that is said; the difference is the waits, and the rest of a cycle that each of them rounds up.
        let plain = trace(&format!("not_waiting_{law}"), PROGRAM, &[&words[..], &["--no-drives"]].concat());
        assert!(waits(&plain).is_empty());
        let summary = plain.recording.summary().unwrap();
        let codes: Vec<&str> =
            summary["warnings"].as_array().unwrap().iter().map(|w| w["code"].as_str().unwrap()).collect();
        assert!(codes.contains(&"K0002"), "{codes:?}");
        let longer = run.rows.len() - plain.rows.len();
        let waited: usize = found.iter().map(|wait| wait.clone().count()).sum();
        assert!(
            (waited..=waited + found.len()).contains(&longer),
            "{law}: {longer} rows longer, {waited} of them waits"
        );
    }
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
