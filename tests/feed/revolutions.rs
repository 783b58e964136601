//! F a revolution follows the ramp of the spindle: every set-point, seen from outside.

use sollwert::base::units::rpm_from_rad_s;
use sollwert::feed::LimitKind;
use sollwert::kernel::{Kernel, Status};
use sollwert::machine::{Machine, load};
use sollwert::program::ProgramSource;
use std::sync::Arc;

/// X: 20 m/min, 1 m/s², 15 m/s³. The spindle: 20 rev/s².
fn machine(law: &str, sets: &[&str]) -> Machine {
    let law = format!("feed.time_law={law}");
    let fixed = [law.as_str(), "spindle.acceleration_rot_s2=20", "spindle.speed_max_rpm=100000", "spindle.lag_ms=0"];
    let sets: Vec<String> = fixed.iter().chain(sets).map(|set| (*set).to_owned()).collect();
    load("spinner_mvc850", &sets).unwrap_or_else(|error| panic!("{error:?}")).machine
}

/// Time, X (position, velocity, acceleration, jerk), spindle speed in rpm, line, whether the path waits for the spindle.
#[derive(Clone, Copy, Debug)]
struct Row {
    t: f64,
    x: [f64; 4],
    rpm: f64,
    line: u32,
    waits: bool,
}

fn replay(machine: &Machine, text: &str) -> Vec<Row> {
    let source = ProgramSource::from_bytes("g95.mpf", text.as_bytes());
    let mut kernel = Kernel::new(Arc::new(machine.clone()), source, false);
    let x = machine.axis_by_name("X").expect("X");
    let mut rows = Vec::new();
    while kernel.cycle().expect("a cycle") == Status::Running {
        let s = kernel.output().setpoint.expect("a set-point");
        let q = s.axes[x];
        rows.push(Row {
            t: machine.cycle.time_base.time_s(s.tick),
            x: [q.position_lu, q.velocity_lu_s, q.acceleration_lu_s2, q.jerk_lu_s3],
            rpm: rpm_from_rad_s(s.spindle.speed_rad_s),
            line: s.path.block.line,
            waits: s.path.limit.kind == LimitKind::Spindle,
        });
    }
    let alarm = kernel.take_findings().alarm;
    assert!(alarm.is_none(), "{alarm:?}");
    within_limits(&rows);
    rows
}

/// X holds its limits, also where the feed steps from stretch to stretch.
fn within_limits(rows: &[Row]) {
    for pair in rows.windows(2) {
        let h = pair[1].t - pair[0].t;
        let [from, to] = [pair[0].x, pair[1].x];
        assert!(((to[0] - from[0]) / h).abs() <= 20_000.0 / 60.0 * (1.0 + 1e-9), "{pair:?}");
        assert!(((to[1] - from[1]) / h).abs() <= 1000.0 * (1.0 + 1e-6), "{pair:?}");
        assert!(
            ((to[2] - from[2]) / h).abs() <= 15_000.0 * (1.0 + 1e-6) && to[3].abs() <= 15_000.0 * (1.0 + 1e-9),
            "{pair:?}"
        );
    }
}

/// Speed of X in mm a revolution, from `from_s` behind the first motion of these lines until `to_s` before their last.
fn leads(rows: &[Row], lines: std::ops::RangeInclusive<u32>, [from_s, to_s]: [f64; 2]) -> Vec<(f64, f64)> {
    let moving: Vec<&Row> = rows.iter().filter(|row| lines.contains(&row.line) && !row.waits).collect();
    let (begin, end) = (moving[0].t + from_s, moving[moving.len() - 1].t - to_s);
    let lead = |row: &&&Row| row.t >= begin && row.t <= end;
    moving.iter().filter(lead).map(|row| (row.t, row.x[1].abs() * 60.0 / row.rpm.abs())).collect()
}

#[test]
fn the_feed_follows_the_spindle_up_from_the_edge_of_its_tolerance() {
    for law in ["continuous", "seven-phase"] {
        // 0.3 mm a turn; at S6000 the ramp from 5400 to 6000 rpm takes 0.5 s.
        let rows = replay(&machine(law, &[]), "G64 G95\nS6000 M3\nG1 X200 F0.3\nM30\n");
        let first = rows.iter().find(|row| row.x[1] > 0.0).expect("a motion");
        assert!((first.rpm - 5400.0).abs() < 5.0, "{first:?}");
        let leads = leads(&rows, 3..=3, [0.1, 0.1]);
        let ramping = rows.iter().filter(|row| row.line == 3 && !row.waits && row.rpm < 5999.0).count();
        assert!(ramping > 450, "{law}: {ramping}");
        for (t, lead_mm) in &leads {
            // Half a stretch of 0.8 %, and 20 ms for the start from rest, which `continuous` does not drive as quickly as can be: the spindle gains 20 of 92 rev/s in a second.
            assert!((lead_mm / 0.3 - 1.0).abs() < 0.004 + 0.02 * 20.0 / 92.0, "{law}: {t} s: {lead_mm}");
        }
        // At full speed it is exact, to what the optimiser of `continuous` leaves of its feed.
        let (t, lead_mm) = leads[leads.len() - 1];
        assert!((lead_mm - 0.3).abs() < 3e-8, "{law}: {t} s: {lead_mm}");
    }
}

#[test]
fn a_feed_that_starts_at_once_takes_the_turns_of_the_spindle() {
    for law in ["continuous", "seven-phase"] {
        let machine = machine(law, &["spindle.feed_starts_at_once=true"]);
        // 0.2 mm a turn from rest to S3000: 2.5 s of ramp, 62.5 turns, 12.5 mm. In one block and in many.
        let one = "G64 G95 S3000 M3\nG1 X20 F0.2\nM30\n".to_owned();
        let many: String = (1..=80).map(|i| format!("G1 X={}\n", f64::from(i) * 0.25)).collect();
        let many = format!("G64 G95 F0.2 S3000 M3\n{many}M30\n");
        for text in [one, many] {
            let rows = replay(&machine, &text);
            assert!(!rows.iter().any(|row| row.waits), "{law}");
            // t = T/2 + turns / n: the ramp takes twice the time of its turns.
            let end_s = rows.iter().find(|row| row.x[0] > 20.0 - 1e-9).expect("the end").t;
            // At its end X comes to rest from 10 mm/s at 15 m/s³, which takes half of 2 sqrt(v/j) longer.
            let wanted_s = 2.5 / 2.0 + 20.0 / 0.2 / 50.0 + (10.0_f64 / 15_000.0).sqrt();
            assert!((end_s - wanted_s).abs() < 0.01, "{law}: {end_s}, {wanted_s}");
            // A stretch has one feed: off by half of its change of speed, 0.4 %, or 2 cycles of the ramp near its rest, and by 2 cycles more at either end of its block,
            // where it is up to 4 cycles longer. A cycle for when the path starts.
            for (t, lead_mm) in leads(&rows, 2..=81, [0.05, 0.1]) {
                let half_step_share = 0.004_f64.max(0.002 / t) + 0.004 / t;
                let start_share = 0.001 / t;
                let ratio = lead_mm / 0.2;
                assert!((ratio - 1.0).abs() < half_step_share + start_share, "{law}: {t} s: {lead_mm}");
            }
        }
    }
}

#[test]
fn the_feed_follows_the_spindle_down() {
    for law in ["continuous", "seven-phase"] {
        let machine = machine(law, &["spindle.feed_starts_at_once=true"]);
        // At 3000 rpm, and down to 1200 in 1.5 s while the path moves on.
        let rows = replay(&machine, "G64 G95 F0.3 S3000 M3\nG0 X1\nG4 F3\nS1200\nG1 X60\nM30\n");
        let first = rows.iter().find(|row| row.line == 5 && row.x[1] > 0.0).expect("a motion");
        assert!((first.rpm - 3000.0).abs() < 5.0, "{first:?}");
        for (t, lead_mm) in leads(&rows, 5..=5, [0.1, 0.1]) {
            assert!((lead_mm / 0.3 - 1.0).abs() < 0.01, "{law}: {t} s: {lead_mm}");
        }
        // 3000 to 1200 takes 1.5 s and 52.5 turns: 15.75 mm; the rest at 6 mm/s. The ramps of the feed, 2 sqrt(v/j) long, lose half of their time
        // times their speed: at the start 15 mm/s, which is made up for at 6 mm/s, at the end 6 mm/s.
        let begin_s = first.t;
        let end_s = rows.iter().find(|row| row.x[0] > 60.0 - 1e-9).expect("the end").t;
        let jerk_lu_s3 = machine.axes[0].limits.jerk_max_lu_s3;
        let ramp_s = |v: f64| 2.0 * (v / jerk_lu_s3).sqrt();
        let wanted_s = 1.5 + (59.0 - 15.75 + 15.0 * ramp_s(15.0) / 2.0) / 6.0 + ramp_s(6.0) / 2.0;
        assert!((end_s - begin_s - wanted_s).abs() < 0.03, "{law}: {}", end_s - begin_s);
    }
}

#[test]
fn another_unit_of_f_ends_it_and_a_rest_begins_it_anew() {
    for law in ["continuous", "seven-phase"] {
        let machine = machine(law, &["spindle.feed_starts_at_once=true"]);
        let rows = replay(&machine, "G64 G95 S3000 M3\nG1 X1 F0.2\nG94 X2 F300\nG4 F0.2\nG95 F0.2 X8\nX12\nM30\n");
        for row in rows.iter().filter(|row| row.line == 3) {
            assert!(row.x[1] <= 5.0 * (1.0 + 1e-9), "{law}: {row:?}");
        }
        for (t, lead_mm) in leads(&rows, 5..=6, [0.1, 0.1]) {
            assert!((lead_mm / 0.2 - 1.0).abs() < 0.03, "{law}: {t} s: {lead_mm}");
        }
    }
}

#[test]
fn overrides_of_the_spindle_turn_it_and_the_feed_with_it() {
    let machine = machine("continuous", &[]);
    let rows = replay(&machine, "G95 S1000 M3\nG1 X10 F0.2\nOVRA[S1]=50\nX20\nOVRA[S1]=100\nX30\nM30\n");
    for (line, rpm) in [(2, 1000.0), (4, 500.0), (6, 1000.0)] {
        // The feed begins within the tolerance of the speed, before it is reached.
        let turns = rows.iter().filter(|row| row.line == line && (row.rpm - rpm).abs() < 1e-6);
        let fastest = turns.max_by(|a, b| a.x[1].total_cmp(&b.x[1])).expect("a motion");
        assert!((fastest.x[1] - 0.2 * rpm / 60.0).abs() < 1e-6, "{fastest:?}");
    }
}

#[test]
fn acc_of_the_spindle_makes_its_ramps_shorter_or_longer() {
    let rise_s = |text: &str| {
        let rows = replay(&machine("continuous", &[]), text);
        rows.iter().find(|row| row.rpm > 1200.0 - 1e-6).expect("the speed").t
    };
    // 20 rev/s in 1 s, with half the acceleration in 2 s.
    assert!((rise_s("S1200 M3\nG4 F5\nM30\n") - 1.0).abs() < 2e-3);
    assert!((rise_s("ACC[S1]=50\nS1200 M3\nG4 F5\nM30\n") - 2.0).abs() < 2e-3);
}
