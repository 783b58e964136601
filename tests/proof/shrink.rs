//! The smallest program that still fails.

use crate::judged;
use crate::program::Program;
use crate::random::Random;
use crate::settings::Settings;
use crate::times;
use crate::verdict::{Finding, Kind};

/// Runs that the search may take.
const RUNS_MAX: usize = 600;

/// The finding of a kind, if a program has it.
fn failing(settings: &Settings, program: &Program, kind: Kind, random: &Random) -> Option<Finding> {
    if kind == Kind::Split {
        // Which block is split depends on how many there are: any will do.
        let mut random = random.clone();
        return (0..4).find_map(|_| times::split(settings, program, &mut random));
    }
    judged(settings, program, None).into_iter().find(|finding| finding.kind == kind)
}

/// Drops blocks while the program still fails in the same way.
fn smallest(settings: &Settings, program: &Program, kind: Kind, random: &Random) -> Option<(Program, Finding)> {
    let mut best = (program.clone(), failing(settings, program, kind, random)?);
    let mut runs = 0;
    'again: loop {
        for smaller in best.0.clone().smaller() {
            runs += 1;
            if runs > RUNS_MAX {
                return Some(best);
            }
            if let Some(finding) = failing(settings, &smaller, kind, random) {
                best = (smaller, finding);
                continue 'again;
            }
        }
        return Some(best);
    }
}

/// Prints the smallest program of a seed with its machine.
pub fn print(seed: u64, kind: Kind, settings: &Settings, program: &Program, random: &Random) {
    let Some((program, finding)) = smallest(settings, program, kind, random) else {
        println!("seed {seed}: {kind:?} is gone when it is run again: not deterministic");
        return;
    };
    println!("\nseed {seed}, {kind:?}, {:.4} times what is allowed: {}", finding.ratio, finding.text);
    println!("{}---\n{}---", program.text(settings), settings.text());
}
