//! Which spindle is told what: SETMS, S2=, overrides, limits, SAVE.

use crate::nc_machine::test_machine;
use sollwert::interpreter::{Event, Feed, Interpreter};
use sollwert::machine::Machine;
use sollwert::program::ProgramSource;

fn machine() -> Machine {
    test_machine::shipped("spinner_mvc850", &["spindle.speed_max_rpm=6000"])
}

/// What the simulated spindle is told, what is on record of others, the feeds (mm/min) of G1 blocks, and codes.
#[derive(Debug, Default, PartialEq)]
struct Told {
    simulated: Vec<String>,
    recorded: Vec<String>,
    feeds: Vec<f64>,
    codes: Vec<&'static str>,
}

fn told(text: &str) -> Told {
    let mut interpreter = Interpreter::new(ProgramSource::from_bytes("spindle.mpf", text.as_bytes()), &machine());
    let mut told = Told::default();
    loop {
        let next = match interpreter.next_move() {
            Ok(Some(next)) => next,
            Ok(None) => break,
            Err(alarm) => {
                told.codes.push(alarm.code);
                break;
            }
        };
        if let (Feed::Path { feed_lu_s }, true) = (&next.feed, next.kind == sollwert::interpreter::MoveKind::Line) {
            told.feeds.push((feed_lu_s * 60.0 * 1e6).round() / 1e6);
        }
        for event in next.events {
            match event {
                Event::SpindleSpeed { speed_rpm } => {
                    told.simulated.push(format!("S{}", (speed_rpm * 1e6).round() / 1e6))
                }
                Event::MFunction(function @ (3 | 4 | 5 | 19 | 70)) => told.simulated.push(format!("M{function}")),
                Event::SpindlePosition(positioning) => {
                    told.simulated.push(format!("at {:.0}", positioning.angle_rad.to_degrees()))
                }
                Event::SpindleAcceleration { ratio } => told.simulated.push(format!("acceleration {ratio}")),
                Event::Spindle(text) => told.recorded.push(text.to_string()),
                _ => {}
            }
        }
    }
    told.codes.extend(interpreter.take_warnings().iter().map(|warning| warning.code));
    told
}

#[test]
fn behind_setms_s_and_m_are_those_of_the_other_spindle() {
    let said =
        told("S1000 M3\nSETMS(2)\nS500 M4\nG95 G1 X5 F0.2\nM5\nM19\nSPOS=90\nS1=700 M1=4\nSETMS\nG1 X9 F0.1\nM30\n");
    assert_eq!(said.simulated, ["S1000", "M3", "S700", "M4"]);
    assert_eq!(said.recorded, ["SETMS(2)", "S2=500", "M2=4", "M2=5", "M2=19", "SPOS=90", "SETMS(1)"]);
    assert_eq!(said.feeds, [100.0, 70.0]);
    assert_eq!(said.codes, ["W0009", "W0008"]);
}

#[test]
fn the_master_spindle_by_its_number_is_the_master_spindle() {
    assert_eq!(told("S1=800 M1=3\nM1=19\nM30\n").simulated, ["S800", "M3", "M19", "at 0"]);
    // Under G96 its S is the cutting speed: 100 m/min at a radius of 50 mm.
    let cutting = told("G0 X50\nG96 S1=100 M1=3\nM30\n");
    assert_eq!(
        cutting.simulated,
        [format!("S{}", (1e5 / (std::f64::consts::TAU * 50.0) * 1e6).round() / 1e6), "M3".to_owned()]
    );
}

#[test]
fn overrides_and_limits_act_on_what_is_output() {
    let said = told("G95 S1000 M3\nG1 X1 F0.1\nOVRA[S1]=80\nG1 X2\nS2000\nG1 X3\nG26 S1200\nS2000\nG1 X4\nM30\n");
    assert_eq!(said.simulated, ["S1000", "M3", "S800", "S1600", "S1200"]);
    assert_eq!(said.feeds, [100.0, 80.0, 160.0, 120.0]);
    let said = told("S9000 M3\nVELOLIM[S1]=50\nACC[S1]=40\nS1=9000\nM30\n");
    assert_eq!(said.simulated, ["S6000", "M3", "S3000", "acceleration 0.4", "S3000"]);
    assert_eq!(said.codes, ["W0010"]);
    // G97 keeps the speed that G96 came to, and the override does not act twice.
    let said = told("OVRA[S1]=50\nG0 X50\nG96 S100 M3\nG1 X50 Y1 F0.1\nG97\nG1 Y2 F0.1\nM30\n");
    let half = 0.1 * 0.5 * 1e5 / (std::f64::consts::TAU * 50.0);
    assert_eq!(said.feeds.len(), 2, "{said:?}");
    assert!(said.feeds.iter().all(|feed| (feed - half).abs() < 1e-5), "{said:?}");
}

#[test]
fn impossible_values_are_errors() {
    for text in [
        "S-1 M3",
        "S1EX300 M3",
        "S2=-5",
        "OVRA[S1]=0",
        "OVRA[S1]=201",
        "ACC[S1]=0",
        "VELOLIM[S1]=101",
        "SPOS=1EX9",
        "DITS=5000",
    ] {
        assert_eq!(told(&format!("{text}\nM30\n")).codes, ["E0306"], "{text}");
    }
}
