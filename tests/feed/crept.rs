//! Blends that `seven-phase` crosses more slowly than a stop would take: it says so, with the right figures (P0010).

use crate::support::{spinner, test_machine_shipped};
use sollwert::base::Diagnostic;
use sollwert::kernel::{Kernel, Status};
use sollwert::machine::{Machine, TimeLawKind};
use sollwert::program::ProgramSource;
use std::sync::Arc;

/// 20 mm there and 20 mm back, turning by an angle, some times over.
fn text(mode: &str, turn_deg: f64, times: usize) -> String {
    let back_rad = (180.0 - turn_deg).to_radians();
    let (x, y) = (20.0 - 20.0 * back_rad.cos(), 20.0 * back_rad.sin());
    let there = format!("{mode}\nG1 X20 F3000\nG1 X{x:.6} Y{y:.6}\nG60\nG1 X0 Y0\n");
    format!("G17 G90 G71 G94\nG0 X0 Y0\n{}M30\n", there.repeat(times))
}

/// Cycle time and warnings.
fn run(machine: &Machine, text: &str) -> (f64, Vec<Diagnostic>) {
    let source = ProgramSource::from_bytes("crept.mpf", text.as_bytes());
    let mut kernel = Kernel::new(Arc::new(machine.clone()), source, false);
    let mut setpoints = 0;
    while kernel.cycle().unwrap() == Status::Running {
        setpoints += 1;
    }
    let findings = kernel.take_findings();
    assert!(findings.alarm.is_none(), "{findings:?}");
    (f64::from(setpoints) * machine.cycle.time_base.setpoint_period_s(), findings.warnings)
}

fn told(warnings: &[Diagnostic]) -> Option<&str> {
    let mut messages = warnings.iter().filter(|warning| warning.code == "P0010").map(|warning| &warning.message[..]);
    let message = messages.next();
    assert!(messages.next().is_none(), "{warnings:?}");
    message
}

/// The numbers of a message in seconds.
fn seconds(message: &str) -> Vec<f64> {
    let words: Vec<&str> = message.split_whitespace().collect();
    let times = words.windows(2).filter(|pair| pair[1].trim_end_matches([',', ';']) == "s");
    times.map(|pair| pair[0].parse().unwrap()).collect()
}

/// What the warning says is lost is what the program with exact stops takes less, but for what the estimate of the stop is too long by.
#[test]
fn a_blend_slower_than_a_stop_is_told_with_its_cost() {
    for machine in [spinner(), test_machine_shipped("spinner_mvc850")] {
        assert_eq!(machine.feed.time_law, TimeLawKind::SevenPhase);
        for (turn_deg, times) in [(178.0, 1), (178.0, 3), (170.0, 2)] {
            let (blended_s, warnings) = run(&machine, &text("G642", turn_deg, times));
            let (stops_s, others) = run(&machine, &text("G60", turn_deg, times));
            assert!(told(&others).is_none());
            let message = told(&warnings).unwrap_or_else(|| panic!("{turn_deg} degrees, {blended_s} s: no warning"));
            let figures = seconds(message);
            let lost_s = if times == 1 { figures[0] - figures[1] } else { figures[0] };
            let really_s = blended_s - stops_s;
            assert!(lost_s <= really_s + 0.01 && lost_s > really_s - 0.4 * times as f64, "{really_s} s: {message}");
            assert!(message.contains("line 4:"), "{message}");
        }
    }
}

/// Nothing is said of corners that a blend makes quicker, or not much slower, and of the law that follows the bend.
#[test]
fn other_blends_are_not_told_of() {
    let machine = spinner();
    assert!(told(&run(&machine, &text("G642", 90.0, 2)).1).is_none());
    let mut machine = spinner();
    machine.feed.time_law = TimeLawKind::Continuous;
    let (time_s, warnings) = run(&machine, &text("G642", 178.0, 2));
    let (stops_s, _) = run(&machine, &text("G60", 178.0, 2));
    assert!(told(&warnings).is_none() && time_s < 1.1 * stops_s, "{time_s} s, {stops_s} s with stops");
}
