//! The feed override changes at run time: every limit holds, the path stays the same, and no feed is above F times the highest override so far.
//!
//! In: a case of `continuous` and a schedule from the same seed. Out: what is wrong with the motion. Times are not compared: a reversed path meets
//! the changes elsewhere.

use crate::program::Program;
use crate::random::Random;
use crate::run::{Run, places};
use crate::settings::{Law, Settings};
use crate::verdict::{Finding, Kind};
use crate::{axes, contour};
use sollwert::feed::OverrideSchedule;
use std::sync::Arc;

/// Time until which it changes: longer than most of these programs take.
const CHANGES_END_S: f64 = 6.0;

/// Seeds of schedules are not those of programs.
const SCHEDULE_SEED: u64 = 0x00DD_F00D;

/// Times and percentages, the last of which lets the program end.
pub fn schedule(seed: u64) -> String {
    let mut random = Random::new(seed ^ SCHEDULE_SEED);
    let mut logarithmic = |low: f64, high: f64| random.between(low.ln(), high.ln()).exp();
    let mut text = String::new();
    let mut time_s = logarithmic(0.001, 0.5);
    while time_s < CHANGES_END_S {
        let percent = match logarithmic(1.0, 7.0) {
            kind if kind < 1.4 => 0.0,
            kind if kind < 2.0 => 100.0,
            kind if kind < 3.0 => logarithmic(0.5, 20.0),
            _ => logarithmic(10.0, 200.0),
        };
        text += &format!("{time_s:.4}={percent:.1},");
        time_s += logarithmic(0.003, 1.0);
    }
    text + &format!("{time_s:.4}=100")
}

/// Everything that is wrong, the worst first.
pub fn judged(settings: &Settings, program: &Program, schedule: &str) -> Vec<Finding> {
    let machine = Arc::new(settings.machine());
    let overrides = OverrideSchedule::parse(schedule).unwrap_or_else(|error| panic!("{schedule}: {error:?}"));
    let mut run = match Run::overridden(&machine, &program.text(settings), &overrides) {
        Ok(run) => run,
        Err(text) => return vec![Finding { kind: Kind::Alarm, ratio: f64::INFINITY, text }],
    };
    let highest_ratio = overrides.changes().iter().fold(1.0_f64, |most, change| most.max(change.override_ratio));
    for target in &mut run.targets {
        target.feed = target.feed.map(|feed| feed * highest_ratio);
    }
    let mut findings = match places(&run) {
        Ok(places) => {
            let mut findings = axes::check(&machine, Law::Continuous, &run, &places);
            findings.extend(contour::check(&machine, &run, &places));
            findings
        }
        Err(text) => vec![Finding { kind: Kind::Path, ratio: f64::INFINITY, text }],
    };
    findings.sort_by(|a, b| b.ratio.total_cmp(&a.ratio));
    findings
}

/// Leaves out changes while the program still fails.
pub fn fewest(schedule: &str, fails: impl Fn(&str) -> bool) -> String {
    let mut changes: Vec<&str> = schedule.split(',').collect();
    let mut index = 0;
    while index < changes.len() {
        let mut fewer = changes.clone();
        fewer.remove(index);
        if !fewer.is_empty() && fails(&fewer.join(",")) {
            changes = fewer;
        } else {
            index += 1;
        }
    }
    changes.join(",")
}
