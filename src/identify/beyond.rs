//! How far values move when the law of `friction` gets a term that it does not have.
//!
//! In: normal equations with columns for such terms, the solution of the law. Out: [`Beyond`]: for each value the lowest and the highest that the law
//! with one more term gives, and what the terms mean. With a term of coefficient γ the value is θ(γ) = θ + r γ; where γ is known to ±h only, so much
//! of it may be there unseen, whether or not the trace shows it:
//!
//! ```text
//! low = min (θ, θ(γ) - half)      high = max (θ, θ(γ) + half)      half: of the fit with the term
//! ```
//! Friction that falls with speed (Stribeck) is part of every guideway, and its coefficient is never negative: it moves a value to one side only, and on that side
//! the interval always reaches as far as the fit with it does, seen or not. Other terms, and that one beyond its room, count from [`SIGNIFICANT`] standard
//! errors on; how far such a fit lies from the law counts as one standard error of what the law leaves out: to both sides for terms of friction, which stand for
//! a curve of unknown shape, to its own side for the spring, which is the next term of a known series. Does not correct values: a drive model that has no place
//! for a term could not hold them.

use super::friction::{B, J, ONE_SIDED, SPRING, SQUARE, STRIBECK, TC};
use super::normal::{Blocks, Solution};
use crate::base::units::percent_from_ratio;

/// A term beside the law: its column, what it means, and whether its coefficient is never negative.
struct Term {
    column: usize,
    meaning: &'static str,
    positive: bool,
}

const FALLING: &str = "friction is higher at low speed (Stribeck)";
const TERMS: [Term; 6] = [
    Term { column: STRIBECK[0], meaning: FALLING, positive: true },
    Term { column: STRIBECK[1], meaning: FALLING, positive: true },
    Term { column: STRIBECK[2], meaning: FALLING, positive: true },
    Term { column: SQUARE, meaning: "friction bends with speed", positive: false },
    Term { column: ONE_SIDED, meaning: "friction grows differently in the two directions", positive: false },
    Term { column: SPRING, meaning: "motor and scale do not move as one body (elastic drive train)", positive: false },
];
/// Standard errors from which a term counts: six are tried, and in one trace of twenty that follows the law one of them may count by
/// chance (0.05 / 6 two-sided).
const SIGNIFICANT: f64 = 2.64;
/// Standard errors on each side of a 95 % interval.
const HALF_95: f64 = 1.96;
/// Shift of a value from which its term is said.
const SAID_SHARE: f64 = 0.01;

/// Where values may lie that the law with one more term gives, in the order of the columns.
pub(super) struct Beyond {
    pub(super) low: Vec<f64>,
    pub(super) high: Vec<f64>,
    /// Largest shift by significant terms.
    pub(super) shifts: Vec<f64>,
}

impl Beyond {
    fn take(&mut self, place: usize, value: f64, half: f64, upwards: bool) {
        if upwards {
            self.high[place] = self.high[place].max(value + half);
        } else {
            self.low[place] = self.low[place].min(value - half);
        }
    }

    /// A fit with significant terms.
    fn significant(&mut self, columns: &[usize], law: &Solution, with: &Solution, both_sides: bool) -> f64 {
        let mut largest = 0.0_f64;
        for (place, column) in columns.iter().enumerate() {
            let by = with.theta[place] - law.theta[place];
            self.shifts[place] = self.shifts[place].max(by.abs());
            let (value, half) = with.value(place);
            self.take(place, value, half, by > 0.0);
            self.take(place, law.theta[place] + HALF_95 * by, 0.0, by > 0.0);
            if both_sides {
                self.take(place, law.theta[place] - HALF_95 * by, 0.0, by < 0.0);
            }
            if matches!(*column, J | B | TC) {
                largest = largest.max(by.abs() / law.theta[place].abs());
            }
        }
        largest
    }
}

/// What terms beside the law make of the values; what significant ones mean goes into `verdicts`.
pub(super) fn beyond(blocks: &Blocks, columns: &[usize], law: &Solution, verdicts: &mut Vec<String>) -> Beyond {
    let theta: Vec<f64> = law.theta.iter().copied().collect();
    let mut all = Beyond { low: theta.clone(), high: theta, shifts: vec![0.0; columns.len()] };
    let mut with = columns.to_vec();
    let mut said: Vec<&str> = Vec::new();
    for term in TERMS.iter().filter(|term| !columns.contains(&term.column)) {
        let mut one = columns.to_vec();
        one.push(term.column);
        let Some(solution) = blocks.solve(&one) else { continue };
        let (gamma, half) = solution.value(columns.len());
        let counts = gamma.abs() > SIGNIFICANT / HALF_95 * half;
        if term.positive && gamma != 0.0 && gamma + half > 0.0 {
            for place in 0..columns.len() {
                // θ(γ) is straight in γ: the side does not depend on the sign that chance gave it.
                let upwards = (solution.theta[place] - law.theta[place]) / gamma > 0.0;
                let (value, half) = solution.value(place);
                all.take(place, value, half, upwards);
            }
        }
        if !counts {
            continue;
        }
        let largest = all.significant(columns, law, &solution, term.column != SPRING);
        with.push(term.column);
        if largest > SAID_SHARE && !said.contains(&term.meaning) {
            said.push(term.meaning);
            let (meaning, percent) = (term.meaning, percent_from_ratio(largest));
            verdicts.push(format!("{meaning}: that moves a value by {percent:.1} %, and the intervals take it in"));
        }
    }
    if with.len() > columns.len() + 1
        && let Some(together) = blocks.solve(&with)
    {
        all.significant(columns, law, &together, with[columns.len()..] != [SPRING]);
    }
    all
}
