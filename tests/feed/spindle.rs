//! A feed waits for the spindle: how long, and when it does not.

use crate::support::spinner;
use sollwert::feed::{LimitKind, PlannedPiece};
use sollwert::kernel::{PieceSource, Preparation};
use sollwert::machine::{Machine, SpindleSettings, TimeLawKind};
use sollwert::program::ProgramSource;
use std::f64::consts::TAU;

/// 30 rev/s², within 10 %.
fn machine(time_law: TimeLawKind) -> Machine {
    let mut machine = spinner();
    machine.feed.time_law = time_law;
    machine.spindle = Some(SpindleSettings {
        acceleration_rad_s2: 30.0 * TAU,
        tolerance_share: 0.1,
        starts_at_once: false,
        waits_for_stop: false,
        positioning_speed_rad_s: 5.0 * TAU,
        positioning_acceleration_rad_s2: 30.0 * TAU,
        lag_s: 0.0,
    });
    machine
}

fn planned(machine: &Machine, text: &str) -> Vec<PlannedPiece> {
    let mut preparation = Preparation::new(ProgramSource::from_bytes("test.mpf", text.as_bytes()), machine);
    let pieces = std::iter::from_fn(|| preparation.next_piece()).collect();
    let alarm = preparation.take_findings().alarm;
    assert!(alarm.is_none(), "{alarm:?}");
    pieces
}

/// Line, time since the start of the program and length of every wait for the spindle.
fn waits(pieces: &[PlannedPiece]) -> Vec<(u32, f64, f64)> {
    let mut time_s = 0.0;
    let mut waits = Vec::new();
    for piece in pieces {
        let duration_s = piece.law.duration_s();
        if piece.law.phases().iter().any(|phase| phase.limit.kind == LimitKind::Spindle) {
            waits.push((piece.path.contour.block.line, time_s, duration_s));
        }
        time_s += duration_s;
    }
    waits
}

#[test]
fn a_feed_waits_until_the_spindle_is_near_its_speed() {
    for law in [TimeLawKind::SevenPhase, TimeLawKind::Continuous] {
        let machine = machine(law);
        // From 0 to 90 % of 3000 rpm in 1.5 s, the rapid among it; from there on, at 3000, to 5400; from -900 back to 2700.
        let text = "G0 X50 S3000 M3\nG1 X60 F1000\nX100 S6000\nS1000 M4\nX110\nS3000 M3\nG4 F10\nX120\nM30\n";
        let waits = waits(&planned(&machine, text));
        let lines: Vec<u32> = waits.iter().map(|(line, ..)| *line).collect();
        assert_eq!(lines, [2, 3, 5], "{waits:?}");
        let (_, begin_s, time_s) = waits[0];
        assert!((begin_s + time_s - 0.9 * 50.0 / 30.0).abs() < 1e-9, "{waits:?}");
        // The first change begins with its block; the spindle has gone on to 3000 rpm since, if there was time.
        let reached_rps = (30.0 * waits[1].1).min(50.0);
        assert!((waits[1].2 - (90.0 - reached_rps) / 30.0).abs() < 1e-9, "{waits:?}");
        let from_s = waits[2].1;
        let begun_s = waits[1].1 + waits[1].2;
        // At least 90 rev/s by then, at most 100: it goes through 0 to -15.
        let reached_rps = (90.0 + 30.0 * (from_s - begun_s)).min(100.0);
        assert!((waits[2].2 - (reached_rps + 15.0) / 30.0).abs() < 1e-9, "{waits:?}, {reached_rps}");
    }
}

#[test]
fn nothing_waits_without_a_change_or_without_a_spindle() {
    let with = machine(TimeLawKind::Continuous);
    let without = Machine { spindle: None, ..with.clone() };
    let careless = SpindleSettings { tolerance_share: 1.0, acceleration_rad_s2: 1.0, ..with.spindle.unwrap() };
    let careless = Machine { spindle: Some(careless), ..with.clone() };
    let text = "G0 X50 S3000 M3\nG4 F5\nG1 X60 F1000\nM3 S3000 X100\nM5\nX110\nM30\n";
    // The first feed comes late enough; the same speed again is no change, and a spindle at rest is not waited for.
    assert_eq!(waits(&planned(&with, text)), []);
    for machine in [without, careless] {
        assert_eq!(waits(&planned(&machine, "G1 X60 F1000 S3000 M3\nM30\n")), []);
    }
}

#[test]
fn the_path_rests_while_it_waits_and_events_come_first() {
    let pieces = planned(&machine(TimeLawKind::Continuous), "G64\nG1 X10 F6000\nX20 S2000 M3\nX30\nM30\n");
    let wait = pieces.iter().position(|piece| piece.law.phases().iter().any(|p| p.limit.kind == LimitKind::Spindle));
    let wait = wait.expect("a wait");
    assert_eq!(pieces[wait].path.contour.events.len(), 2);
    let before = &pieces[wait - 1].law;
    assert!(before.at(before.duration_s()).velocity_lu_s < 1e-9);
    assert_eq!(pieces[wait + 1].law.at(0.0).velocity_lu_s, 0.0);
    assert!(pieces[wait + 1].path.contour.events.is_empty() && pieces[wait + 1].path.contour.blocks_begun == 1);
}

#[test]
fn a_feed_behind_m5_waits_where_the_machine_says_so() {
    let mut machine = machine(TimeLawKind::Continuous);
    let text = "G1 X1 F1000 S3000 M3\nM5\nX2\nM30\n";
    assert_eq!(waits(&planned(&machine, text)).len(), 1);
    machine.spindle = machine.spindle.map(|spindle| SpindleSettings { waits_for_stop: true, ..spindle });
    let waits = waits(&planned(&machine, text));
    // From whatever speed it had reached back to rest, at 30 rev/s².
    let (ramp_s, driven_s) = (0.9 * 50.0 / 30.0, waits[1].1 - waits[0].2);
    let reached_rps = (30.0 * (ramp_s + driven_s)).min(50.0);
    assert!((waits[1].2 - reached_rps / 30.0).abs() < 1e-9, "{waits:?}");
}
