//! The smallest program that still fails.

use crate::program::Program;
use crate::settings::Settings;
use crate::times;
use crate::verdict::{Finding, Kind};

/// Runs that the search may take.
const RUNS_MAX: usize = 600;

/// Whether a program fails in the way that is looked for.
type Failing<'a> = &'a dyn Fn(&Program) -> Option<Finding>;

/// What is over the limit may shrink to this share of itself: what is left is to show the same fault, not any.
const EXCESS_RATIO: f64 = 0.3;

/// Drops blocks while the program still fails in the same way, and not by much less.
fn smallest(program: &Program, failing: Failing<'_>) -> Option<(Program, Finding)> {
    let mut best = (program.clone(), failing(program)?);
    let least = 1.0 + EXCESS_RATIO * (best.1.ratio - 1.0);
    let mut runs = 0;
    'again: loop {
        for smaller in best.0.clone().smaller() {
            runs += 1;
            if runs > RUNS_MAX {
                return Some(best);
            }
            if let Some(finding) = failing(&smaller).filter(|finding| finding.ratio >= least) {
                best = (smaller, finding);
                continue 'again;
            }
        }
        return Some(best);
    }
}

/// Prints the smallest program of a seed with its machine.
pub fn print(seed: u64, settings: &Settings, program: &Program, failing: Failing<'_>) {
    let Some((program, finding)) = smallest(program, failing) else {
        println!("seed {seed}: the finding is gone when it is run again: not deterministic");
        return;
    };
    let Finding { kind, ratio, text } = finding;
    println!("\nseed {seed}, {kind:?}, {ratio:.4} times what is allowed: {text}");
    println!("{}---\n{}---", program.text(settings), settings.text());
    if kind == Kind::Reversed
        && let Some([.., back]) = times::texts(settings, &program)
    {
        println!("reversed:\n{back}---");
    }
}
