//! Threads, tapping and spindle positions from program to set-point, against closed forms: every tick, seen from outside.

use sollwert::base::units::rpm_from_rad_s;
use sollwert::feed::LimitKind;
use sollwert::kernel::{Kernel, Status};
use sollwert::machine::{Machine, load};
use sollwert::program::ProgramSource;
use std::f64::consts::TAU;
use std::sync::Arc;

/// 20 rev/s² to a speed, 10 rev/s² and 300 rpm in position control; X: 20 m/min, 1 m/s², 15 m/s³.
const SETS: [&str; 3] = [
    "spindle.acceleration_rot_s2=20",
    "spindle.positioning_acceleration_rot_s2=10",
    "spindle.positioning_speed_rpm=300",
];
const ALPHA: f64 = 20.0 * TAU;
const ALPHA_P: f64 = 10.0 * TAU;
const OMEGA_P: f64 = 5.0 * TAU;
/// Z has 15 m/min, 0.8 m/s², 12 m/s³.
const Z_LIMITS: [f64; 3] = [250.0, 800.0, 12_000.0];
const V: f64 = 20_000.0 / 60.0;
const A: f64 = 1000.0;
const J: f64 = 15_000.0;

/// A set-point: time, position, velocity, acceleration, jerk of X and Z, the spindle, what holds, line.
#[derive(Clone, Copy, Debug)]
struct Row {
    t: f64,
    x: [f64; 4],
    z: [f64; 4],
    angle: f64,
    speed: f64,
    acceleration: f64,
    limit: LimitKind,
    line: u32,
}

fn machine(sets: &[&str]) -> Machine {
    let sets: Vec<String> = SETS.iter().chain(sets).map(|set| (*set).to_owned()).collect();
    load("spinner_mvc850", &sets).unwrap_or_else(|error| panic!("{error:?}")).machine
}

fn laws() -> [Machine; 2] {
    ["continuous", "seven-phase"].map(|law| machine(&[&format!("feed.time_law={law}")]))
}

/// All set-points, and the codes of warnings and alarm.
fn replay(machine: &Machine, text: &str, drives: bool) -> (Vec<Row>, Vec<String>) {
    let source = ProgramSource::from_bytes("thread.mpf", text.as_bytes());
    let mut kernel = Kernel::new(Arc::new(machine.clone()), source, drives);
    let [x, z] = ["X", "Z"].map(|name| machine.axis_by_name(name).unwrap());
    let mut rows = Vec::new();
    while kernel.cycle().unwrap() == Status::Running {
        let s = kernel.output().setpoint.unwrap();
        let of = |axis| {
            let q: sollwert::interpolator::AxisSetpoint = s.axes[axis];
            [q.position_lu, q.velocity_lu_s, q.acceleration_lu_s2, q.jerk_lu_s3]
        };
        let (limit, line) = (s.path.limit.kind, s.path.block.line);
        let t = machine.cycle.time_base.time_s(s.tick);
        let (angle, speed) = (s.spindle.angle_rad, s.spindle.speed_rad_s);
        let acceleration = s.spindle.acceleration_rad_s2;
        rows.push(Row { t, x: of(x), z: of(z), angle, speed, acceleration, limit, line });
    }
    let findings = kernel.take_findings();
    let said = findings.warnings.iter().chain(&findings.alarm).map(|said| format!("{} {}", said.code, said.message));
    (rows, said.filter(|said| !said.starts_with('W') && !said.starts_with('K')).collect())
}

/// Limits of X and Z, the analytic values and the differences of positions alike; `jerk_limited`: SOFT.
fn within_limits(rows: &[Row], jerk_limited: bool) {
    for pair in rows.windows(2) {
        let h = pair[1].t - pair[0].t;
        for ([from, to], [v, a, j]) in [([pair[0].x, pair[1].x], [V, A, J]), ([pair[0].z, pair[1].z], Z_LIMITS)] {
            assert!((to[0] - from[0]).abs() / h <= v * (1.0 + 1e-9), "{pair:?}");
            assert!((to[1] - from[1]).abs() / h <= a * (1.0 + 1e-6) && to[2].abs() <= a * (1.0 + 1e-9), "{pair:?}");
            let j = if jerk_limited { j * (1.0 + 1e-6) } else { f64::INFINITY };
            assert!(to[3].abs() <= j && (to[2] - from[2]).abs() / h <= j, "{pair:?}");
        }
    }
}

/// Difference of two angles or positions within a period, nearest to 0.
fn off(a: f64, b: f64, period: f64) -> f64 {
    let d = (a - b).rem_euclid(period);
    d.min(period - d)
}

#[test]
fn g33_is_on_the_line_of_its_start_angle_at_every_tick_after_the_run_in() {
    for machine in laws() {
        for (mode, sense) in [("SOFT", "M3"), ("BRISK", "M4")] {
            // Three passes of different speed over the same thread: the same turns of the screw.
            let pass = |s: u32, sf: u32| format!("S{s}\nG33 Z-40 K1.5 SF={sf}\nG0 X1\nZ0\nX0\n");
            let text = format!("{mode} {sense}\n{}{}{}M30\n", pass(600, 0), pass(300, 0), pass(450, 90));
            let (rows, said) = replay(&machine, &text, false);
            assert_eq!(said, Vec::<String>::new());
            let turn = if sense == "M3" { 1.0 } else { -1.0 };
            for (line, sf, rpm) in [(3, 0.0, 600.0), (8, 0.0, 300.0), (13, TAU / 4.0, 450.0)] {
                let on_line: Vec<&Row> = rows
                    .iter()
                    .filter(|row| row.line == line && row.limit == LimitKind::Feed && row.z[2] == 0.0)
                    .collect();
                assert!(on_line.len() as f64 > 30.0 / (1.5 * rpm / 60.0) * 1000.0, "{line}: {}", on_line.len());
                for row in on_line {
                    assert!((rpm_from_rad_s(row.speed) - turn * rpm).abs() < 1e-9);
                    // 0 at the start angle, 1.5 mm a turn towards minus: 1e-9 mm.
                    let away = off(-1.5 * turn * (row.angle - sf) / TAU, row.z[0], 1.5);
                    assert!(away < 1e-9, "{row:?}: {away}");
                }
            }
            within_limits(&rows, mode == "SOFT");
        }
    }
}

#[test]
fn threads_in_a_row_go_on_without_a_rest_and_a_new_start_angle_begins_anew() {
    for machine in laws() {
        let text = "G64 S300 M3\nG33 Z-10 K2\nZ-20 K2\nX1 Z-30 K2\nG0 X5\nM30\n";
        let (rows, said) = replay(&machine, text, false);
        assert_eq!(said, Vec::<String>::new());
        let cut: Vec<&Row> = rows.iter().filter(|row| (2..=4).contains(&row.line)).collect();
        let on_line: Vec<&&Row> = cut.iter().filter(|row| row.limit == LimitKind::Feed && row.z[2] == 0.0).collect();
        for row in &on_line {
            assert!(off(-2.0 * row.angle / TAU, row.z[0], 2.0) < 1e-9, "{row:?}");
        }
        // From the end of the run-in to the start of the run-out without a gap.
        let ticks = ((on_line.last().unwrap().t - on_line[0].t) * 1000.0).round() as usize;
        assert_eq!(on_line.len(), ticks + 1);
        assert!(on_line.iter().any(|row| row.line == 4) && on_line.iter().any(|row| row.line == 2));
        let (rows, _) = replay(&machine, &text.replace("Z-20 K2", "Z-20 K2 SF=90"), false);
        let rests = rows.iter().filter(|row| row.line == 3 && row.limit == LimitKind::Spindle && row.z[1] == 0.0);
        assert!(rests.count() > 10);
        for row in rows.iter().filter(|row| (3..=4).contains(&row.line) && row.limit == LimitKind::Feed) {
            let at_start = 10.0 - 2.0 * 0.25;
            assert!(off(-2.0 * row.angle / TAU - at_start, row.z[0], 2.0) < 1e-9, "{row:?}");
        }
    }
}

#[test]
fn g34_and_g35_change_the_lead_by_f_a_revolution() {
    for machine in laws() {
        for (word, change) in [("G34", 0.1), ("G35", -0.1)] {
            let text = format!("S240 M3\n{word} Z-15 K2 F0.1\nG0 X5\nM30\n");
            let (rows, said) = replay(&machine, &text, false);
            assert_eq!(said, Vec::<String>::new());
            let mut seen = 0;
            for row in rows.iter().filter(|row| row.line == 2 && row.limit == LimitKind::Feed) {
                // Whole turns since the start: the one that fits.
                let within = (row.angle / TAU).rem_euclid(1.0);
                let way = |n: f64| 2.0 * n + change * n * n / 2.0;
                let turns = (0..30).map(|whole| f64::from(whole) + within);
                let best = turns.map(|n| (way(n) + row.z[0]).abs()).fold(f64::INFINITY, f64::min);
                assert!(best < 1e-9, "{row:?}: {best}");
                seen += 1;
            }
            assert!(seen > 1000, "{seen}");
            within_limits(&rows, true);
        }
    }
}

#[test]
fn tapping_turns_the_spindle_with_the_axis_and_back() {
    for machine in laws() {
        for (lead, sense) in [("1.25", 1.0), ("-1.25", -1.0)] {
            let text = format!("G0 Z5\nSPOS=30\nG331 Z-15 K{lead} S600\nG332 Z5 K{lead}\nG0 X1\nM30\n");
            let (rows, said) = replay(&machine, &text, false);
            assert_eq!(said, Vec::<String>::new());
            let cut: Vec<&Row> = rows.iter().filter(|row| (3..=4).contains(&row.line)).collect();
            for row in &cut {
                let angle = TAU / 12.0 + sense * TAU * (5.0 - row.z[0]) / 1.25;
                assert!((row.angle - angle).abs() < 1e-9, "{row:?}, {angle}");
                assert!(row.speed.abs() <= 10.0 * TAU * (1.0 + 1e-9), "{row:?}");
                assert!((row.speed + sense * TAU / 1.25 * row.z[1]).abs() < 1e-9);
                assert!(row.acceleration.abs() <= ALPHA_P * (1.0 + 1e-9), "{row:?}");
            }
            assert!(cut.iter().any(|row| (row.speed.abs() - 10.0 * TAU).abs() < 1e-9), "S is reached");
            // Down and up are one motion seen forward and backward: both take the same time and the spindle ends where it began.
            let time = |line: u32| {
                let of: Vec<f64> =
                    cut.iter().filter(|row| row.line == line && row.z[1] != 0.0).map(|row| row.t).collect();
                of[of.len() - 1] - of[0]
            };
            assert!((time(3) - time(4)).abs() < 1.5e-3, "{} {}", time(3), time(4));
            assert!((rows[rows.len() - 1].angle - TAU / 12.0).abs() < 1e-9, "{:?}", rows.last());
            let lowest = cut.iter().map(|row| row.z[0]).fold(f64::INFINITY, f64::min);
            // It turns back between two set-points, at 12.5 mm/s².
            assert!((-15.0 - 1e-9..-15.0 + 1e-5).contains(&lowest), "{lowest}");
        }
    }
}

#[test]
fn the_spindle_ramps_and_spos_takes_the_time_of_its_motion() {
    let machine = machine(&[]);
    // 600 rpm = 10 rev/s in 0.5 s; from there to 5 rev/s in 0.25 s, on to the angle, and 5 rev/s in 0.5 s to rest.
    let (rows, said) = replay(&machine, "S600 M3\nG4 F1\nSPOS=90\nG0 X10\nM30\n", false);
    assert_eq!(said, Vec::<String>::new());
    for row in rows.iter().filter(|row| row.line == 2) {
        let t = row.t.min(0.5);
        assert!((row.speed - ALPHA * t).abs() < 1e-9, "{row:?}");
        assert!((row.angle - (ALPHA * t * t / 2.0 + 10.0 * TAU * (row.t - t))).abs() < 1e-9, "{row:?}");
    }
    // At 1 s: 2.5 + 5 rev. The ramp takes 1.875 rev to 9.375, braking 1.25 rev: the first 0.25 behind 10.625 is 11.25 rev.
    let cruise = (11.25 - 1.25 - 9.375) / 5.0;
    let arrival = 1.0 + 0.25 + cruise + 0.5;
    let positioned = rows.iter().filter(|row| row.line == 3);
    for row in positioned.clone() {
        let left = arrival - row.t;
        let speed = if left < 0.5 { ALPHA_P * left.max(0.0) } else { OMEGA_P.max(10.0 * TAU - ALPHA * (row.t - 1.0)) };
        assert!((row.speed - speed).abs() < 1e-8, "{row:?} {speed}");
        assert!(row.x[0] == 0.0 && row.limit == LimitKind::Spindle);
    }
    let begins = rows.iter().find(|row| row.line == 4).unwrap();
    assert!((begins.t - arrival).abs() <= 1e-3 + 1e-9, "{begins:?}, {arrival}");
    assert!((begins.angle - 11.25 * TAU).abs() < 1e-9 && begins.speed == 0.0);
    // From rest the shorter way: 90 deg back at 10 rev/s², 2 sqrt(0.25 / 10) s; ACP goes round: 0.75 rev.
    for (word, end, time) in [
        ("SPOS=0", 11.0, 2.0 * (0.25_f64 / 10.0).sqrt()),
        ("SPOS=ACP(0)", 12.0, 2.0 * (0.75_f64 / 10.0).sqrt()),
        ("SPOS=ACN(180)", 10.5, 2.0 * (0.75_f64 / 10.0).sqrt()),
        ("SPOS=IC(-3600)", 1.25, 2.0 * 0.5 + (10.0 - 2.5) / 5.0),
        ("M19", 11.0, 2.0 * (0.25_f64 / 10.0).sqrt()),
    ] {
        let text = format!("S600 M3\nG4 F1\nSPOS=90\nG4 F0.1\n{word}\nG0 X10\nM30\n");
        let (rows, _) = replay(&machine, &text, false);
        let last = rows[rows.len() - 1];
        assert!((last.angle - end * TAU).abs() < 1e-9, "{word}: {}", last.angle / TAU);
        let moves: Vec<f64> = rows.iter().filter(|row| row.line == 5).map(|row| row.t).collect();
        assert!(
            (moves[moves.len() - 1] - moves[0] - time).abs() <= 2e-3,
            "{word}: {}",
            moves[moves.len() - 1] - moves[0]
        );
    }
    // SPOSA goes on beside the path; WAITS waits for it.
    let (rows, _) = replay(&machine, "S600 M3\nG4 F1\nSPOSA=90\nG0 X10\nWAITS(1)\nX20\nM30\n", false);
    assert!(rows.iter().any(|row| row.line == 4 && row.speed > 0.0 && row.x[1] > 0.0));
    let begins = rows.iter().find(|row| row.line == 6).unwrap();
    assert!((begins.t - arrival).abs() <= 1e-3 + 1e-9, "{begins:?}");
}

/// The speed that an alarm names, rounded down to a tenth.
fn highest(message: &str) -> f64 {
    let (_, behind) = message.split_once("allows S").unwrap_or_else(|| panic!("{message}"));
    behind.split(' ').next().and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("{message}"))
}

#[test]
fn a_speed_that_an_axis_cannot_follow_is_an_alarm_with_the_highest_possible_one() {
    let machine = machine(&[]);
    // Z allows 250 mm/s: 15 000 mm/min over 4 mm are 3750 rpm. On a taper of 45 deg Z is the slower one of both.
    for (block, prepared) in [
        ("G33 Z-40 K4", "M3 S4100"),
        ("G33 X40 Z-40 K4", "M3 S4100"),
        ("G331 Z-40 K4", "SPOS=0 S4100"),
        ("G35 Z-100 K4 F0.01", "M3 S4100"),
    ] {
        let (_, said) = replay(&machine, &format!("{prepared}\n{block}\nM30\n"), false);
        assert_eq!(said.len(), 1, "{block}");
        assert!(said[0].starts_with("P0006 the thread of line 2 at S4100.0"), "{said:?}");
        assert!(said[0].contains("velocity") && (highest(&said[0]) - 3750.0).abs() < 0.11, "{said:?}");
    }
    // 2 mm/rev² at S at most sqrt(800 / 2) rev/s = 1200 rpm; both are then possible.
    let (_, said) = replay(&machine, "M3 S1400\nG34 Z-10 K2 F2\nM30\n", false);
    assert!(said[0].contains("acceleration") && (highest(&said[0]) - 1200.0).abs() < 0.11, "{said:?}");
    let (_, said) = replay(&machine, "M3 S3750\nG33 Z-400 K4\nM30\n", false);
    assert_eq!(said, Vec::<String>::new());
    // From one lead to another the axis would step by 10 mm/s; its corner step is sqrt(8 A e) = 8 mm/s.
    let (_, said) = replay(&machine, "G64 M3 S600\nG33 Z-20 K1\nZ-40 K2\nM30\n", false);
    assert!(said[0].contains("line 3") && said[0].contains("step of velocity"), "{said:?}");
}

#[test]
fn a_thread_without_room_for_its_run_in_says_so() {
    let machine = machine(&[]);
    let (rows, said) = replay(&machine, "M3 S1200\nG33 Z-1 K2\nM30\n", false);
    assert!(said[0].starts_with("P0007 the thread of line 2 is too short"), "{said:?}");
    within_limits(&rows, true);
    assert!((rows[rows.len() - 1].z[0] + 1.0).abs() < 1e-12);
}

#[test]
fn waits_for_the_axes_do_not_move_the_thread_off_its_angle() {
    // With drives an exact stop waits: all times behind it are later, and the spindle has turned on.
    for machine in laws() {
        let text = "S300 M3\nG0 X10\nG60 G1 X20 F5000\nX10\nX20\nG33 Z-20 K1.5 SF=45\nG0 X0\nM30\n";
        let (rows, said) = replay(&machine, text, true);
        assert_eq!(said, Vec::<String>::new());
        assert!(rows.iter().filter(|row| row.limit == LimitKind::InPosition).count() > 6);
        let on_line: Vec<&Row> =
            rows.iter().filter(|row| row.line == 6 && row.limit == LimitKind::Feed && row.z[2] == 0.0).collect();
        assert!(on_line.len() > 1000);
        for row in on_line {
            assert!(off(-1.5 * (row.angle / TAU - 0.125), row.z[0], 1.5) < 1e-9, "{row:?}");
        }
    }
}

#[test]
fn under_g96_the_spindle_follows_the_radius_and_g97_keeps_its_speed() {
    for machine in laws() {
        let (rows, said) = replay(&machine, "G0 X50\nG96 S200 M3 LIMS=1500\nG1 X10 F0.2\nG97 X20\nM30\n", false);
        assert_eq!(said, Vec::<String>::new());
        // 200 m/min over the radius, at most 1500 rpm.
        let wanted = |x: f64| (200_000.0 / 60.0 / x).min(25.0 * TAU);
        let facing: Vec<&Row> = rows.iter().filter(|row| row.line == 3 && row.x[1] != 0.0).collect();
        let near = facing.iter().position(|row| (row.speed - wanted(row.x[0])).abs() < 1e-3).unwrap();
        assert!(near < 200, "{near}: the ramp at the start ends soon");
        for row in &facing[near..] {
            assert!((row.speed / wanted(row.x[0]) - 1.0).abs() < 1e-4, "{row:?}");
            assert!(row.acceleration.abs() <= ALPHA * (1.0 + 1e-9));
        }
        let last = rows[rows.len() - 1];
        assert!((last.speed - 25.0 * TAU).abs() < 1e-9 && last.line >= 4, "{last:?}");
        for pair in rows.windows(2) {
            let mean = (pair[1].angle - pair[0].angle) / (pair[1].t - pair[0].t);
            let between = [pair[0].speed.min(pair[1].speed) - 0.2, pair[0].speed.max(pair[1].speed) + 0.2];
            assert!(mean >= between[0] && mean <= between[1], "{pair:?}");
        }
    }
    // At LIMS=6000 the spindle would have to speed up by more than 20 rev/s² near the axis.
    let (_, said) = replay(&laws()[0], "G0 X50\nG96 S200 M3 LIMS=6000\nG1 X3 F0.3\nM30\n", false);
    assert!(said.len() == 1 && said[0].starts_with("P0008 "), "{said:?}");
}

#[test]
fn the_actual_spindle_lags_by_its_delay() {
    let machine = machine(&["spindle.lag_ms=40"]);
    let source = ProgramSource::from_bytes("lag.mpf", "S600 M3\nG4 F1\nM30\n".as_bytes());
    let mut kernel = Kernel::new(Arc::new(machine), source, true);
    while kernel.cycle().unwrap() == Status::Running {
        let output = kernel.output();
        let t = output.setpoint.unwrap().tick;
        let t = kernel.machine().cycle.time_base.time_s(t);
        // A ramp of 0.5 s and a constant speed behind a delay T of first order.
        let lag = 0.04;
        let ramp = |t: f64| if t <= 0.0 { 0.0 } else { ALPHA * (t - lag * (1.0 - (-t / lag).exp())) };
        let wanted = ramp(t) - ramp(t - 0.5);
        let actual = output.spindle.speed_actual_rad_s;
        assert!((actual - wanted).abs() < 1e-6 * 10.0 * TAU, "{t}: {actual} {wanted}");
        let behind = output.spindle.setpoint.angle_rad - output.spindle.angle_actual_rad;
        assert!((behind - lag * actual).abs() < 1e-9, "{t}");
    }
}

#[test]
fn dits_and_dite_are_the_ways_of_run_in_and_run_out() {
    for machine in laws() {
        for mode in ["SOFT", "BRISK"] {
            let text = format!(
                "{mode} M3 S300\nDITS=4 DITE=2\nG33 Z-20 K1.5 SF=0\nG0 X1\nDITS=-1 DITE=-1\nG33 Z-40 K1.5\nM30\n"
            );
            let (rows, said) = replay(&machine, &text, false);
            assert_eq!(said, Vec::<String>::new());
            let on_line = |line: u32| {
                let rows: Vec<&Row> = rows
                    .iter()
                    .filter(|row| row.line == line && row.limit == LimitKind::Feed && row.z[2] == 0.0)
                    .collect();
                [rows[0].z[0], rows[rows.len() - 1].z[0]]
            };
            // 7.5 mm/s: a set-point is 0.0075 mm from the next.
            let [first, last] = on_line(3);
            assert!((first + 4.0).abs() < 0.0076 && (last + 18.0).abs() < 0.0076, "{mode}: {first} {last}");
            let [first, last] = on_line(6);
            assert!((first + 20.0).abs() < 0.3 && (last + 40.0).abs() < 0.3, "{mode}: {first} {last}");
            within_limits(&rows, mode == "SOFT");
            for row in
                rows.iter().filter(|row| [3, 6].contains(&row.line) && row.limit == LimitKind::Feed && row.z[2] == 0.0)
            {
                let start = if row.line == 3 { 0.0 } else { -20.0 };
                assert!(off(-1.5 * row.angle / TAU + start, row.z[0], 1.5) < 1e-9, "{row:?}");
            }
        }
    }
    // What the axes cannot do is told, and their limits hold.
    let (rows, said) = replay(&laws()[0], "M3 S600\nDITS=0.001\nG33 Z-20 K2 SF=0\nM30\n", false);
    assert!(said.len() == 1 && said[0].starts_with("P0009 DITS of the thread of line 3"), "{said:?}");
    within_limits(&rows, true);
}

#[test]
fn g63_is_a_straight_line_in_its_block_alone() {
    let machine = &laws()[0];
    let (rows, said) = replay(machine, "G0 X5\nS300 M3\nG63 Z-10 F300\nG63 Z0 M4\nX10\nM30\n", false);
    assert_eq!(said, Vec::<String>::new());
    for (line, sense) in [(3, 1.0), (4, -1.0)] {
        let cruising: Vec<&Row> =
            rows.iter().filter(|row| row.line == line && row.z[2].abs() < 1e-6 && row.z[1].abs() > 1.0).collect();
        assert!(cruising.len() > 1500, "{line}: {}", cruising.len());
        // 300 mm/min at 300 rpm: 1 mm a turn.
        assert!(cruising.iter().all(|row| (row.z[1].abs() - 5.0).abs() < 1e-6), "{line}");
        assert!(cruising.iter().all(|row| row.speed * sense > 0.85 * 5.0 * TAU), "{line}");
    }
    // G0 holds again behind them.
    assert!(rows.iter().any(|row| row.line == 5 && row.x[1] > 10.0));
}

#[test]
fn a_spindle_that_is_started_behind_sposa_turns() {
    for text in ["S600 M3\nG4 F1\nSPOSA=90\nS300 M4\nG4 F3\nM30\n", "S600 M3\nG4 F1\nSPOSA=90 S300 M4\nG4 F3\nM30\n"] {
        let (rows, _) = replay(&laws()[0], text, false);
        let last = rows[rows.len() - 1];
        assert!((rpm_from_rad_s(last.speed) + 300.0).abs() < 1e-9, "{text}: {last:?}");
        for pair in rows.windows(2) {
            let h = pair[1].t - pair[0].t;
            assert!((pair[1].speed - pair[0].speed).abs() <= ALPHA * h * (1.0 + 1e-9), "{text}: {pair:?}");
            assert!(
                (pair[1].angle - pair[0].angle - 0.5 * h * (pair[1].speed + pair[0].speed)).abs() < 1e-4,
                "{text}: {pair:?}"
            );
        }
    }
}

#[test]
fn the_spindle_turns_on_behind_the_last_setpoint() {
    let machine = machine(&["axes.X.drive.jerk_filter=moving_average", "axes.X.drive.jerk_filter_time_ms=40"]);
    let source = ProgramSource::from_bytes("on.mpf", "S600 M3\nG1 X20 F9000\nS300\nM30\n".as_bytes());
    let mut kernel = Kernel::new(Arc::new(machine), source, true).until_rest(true);
    let mut angles = Vec::new();
    while kernel.cycle().unwrap() == Status::Running {
        let spindle = kernel.output().setpoint.unwrap().spindle;
        angles.push((spindle.angle_rad, spindle.speed_rad_s, kernel.output().setpoint.unwrap().path.limit.kind));
    }
    assert!(angles.iter().filter(|(.., kind)| *kind == LimitKind::InPosition).count() > 20);
    for pair in angles.windows(2) {
        let [(from, before, _), (to, after, _)] = [pair[0], pair[1]];
        assert!((to - from - 0.5e-3 * (before + after)).abs() < 1e-4 && after > 0.0 || before == 0.0, "{pair:?}");
        assert!((after - before).abs() <= ALPHA * 1e-3 * (1.0 + 1e-9), "{pair:?}");
    }
}
