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
const TERMS: [Term; 7] = [
    Term { column: STRIBECK[0], meaning: FALLING, positive: true },
    Term { column: STRIBECK[1], meaning: FALLING, positive: true },
    Term { column: STRIBECK[2], meaning: FALLING, positive: true },
    Term { column: STRIBECK[3], meaning: FALLING, positive: true },
    Term { column: SQUARE, meaning: "friction bends with speed", positive: false },
    Term { column: ONE_SIDED, meaning: "friction grows differently in the two directions", positive: false },
    Term { column: SPRING, meaning: "motor and scale do not move as one body (elastic drive train)", positive: false },
];
/// Standard errors from which a term counts: seven are tried, and in one trace of twenty that follows the law one of them may count by
/// chance (0.05 / 7 two-sided).
const SIGNIFICANT: f64 = 2.69;
/// Standard errors on each side of a 95 % interval.
const HALF_95: f64 = 1.96;
/// Coulomb friction that turns out to be falling, as a share of it, from which no end is seen.
const OPEN_SHARE: f64 = 0.05;
/// Share of the noise of a value below which an unseen term does not count: as squares it is half a percent.
const HARDLY_SHARE: f64 = 0.1;
/// Shift of a value from which its term is said.
const SAID_SHARE: f64 = 0.01;

/// Where values may lie that the law with one more term gives, in the order of the columns.
pub(super) struct Beyond {
    pub(super) low: Vec<f64>,
    pub(super) high: Vec<f64>,
    /// Largest shift by significant terms.
    pub(super) shifts: Vec<f64>,
    /// Friction falls over the widest range of speeds that is tried, and by much: a wider one would move the values further, and no end is seen.
    pub(super) open: bool,
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
            let half = law.value(place).1.hypot(HALF_95 * by);
            self.take(place, law.theta[place], half, by > 0.0);
            if both_sides {
                self.take(place, law.theta[place], half, by < 0.0);
            }
            if matches!(*column, J | B | TC) {
                largest = largest.max(by.abs() / law.theta[place].abs());
            }
        }
        largest
    }
}

/// A fit with one more term: its standard errors, coefficient, half width of that, all values.
fn tried(blocks: &Blocks, columns: &[usize], term: &Term) -> Option<(f64, f64, f64, Solution)> {
    let with: Vec<usize> = columns.iter().copied().chain([term.column]).collect();
    let solution = blocks.solve(&with)?;
    let (gamma, half) = solution.value(columns.len());
    Some((HALF_95 * gamma.abs() / half, gamma, half, solution))
}

/// What terms beside the law make of the values; what significant ones mean goes into `verdicts`.
pub(super) fn beyond(blocks: &Blocks, columns: &[usize], law: &Solution, verdicts: &mut Vec<String>) -> Beyond {
    let theta: Vec<f64> = law.theta.iter().copied().collect();
    let mut all = Beyond { low: theta.clone(), high: theta, shifts: vec![0.0; columns.len()], open: false };
    let mut found: Vec<(f64, &Term, Solution)> = Vec::new();
    let missing: Vec<&Term> = TERMS.iter().filter(|term| !columns.contains(&term.column)).collect();
    for term in &missing {
        let Some((errors, gamma, half, solution)) = tried(blocks, columns, term) else { continue };
        if term.positive && gamma != 0.0 && gamma + half > 0.0 {
            for place in 0..columns.len() {
                // θ(γ) is straight in γ: the side does not depend on the sign that chance gave it.
                let slope = (solution.theta[place] - law.theta[place]) / gamma;
                // What hardly moves a value does not widen its interval by what chance makes of two fits.
                if slope.abs() * half > HARDLY_SHARE * law.value(place).1 {
                    let (value, half) = solution.value(place);
                    all.take(place, value, half, slope > 0.0);
                }
            }
        }
        if errors > SIGNIFICANT {
            found.push((errors, term, solution));
        }
    }
    let falling = found.iter().filter(|(_, term, _)| term.positive);
    if let Some((_, term, solution)) = falling.max_by(|one, other| one.0.total_cmp(&other.0)) {
        let share = columns.iter().position(|column| *column == TC).map_or(0.0, |place| {
            // Less Coulomb friction with the term: it falls.
            (law.theta[place] - solution.theta[place]) / law.theta[place].abs()
        });
        all.open = term.column == STRIBECK[STRIBECK.len() - 1] && share > OPEN_SHARE;
    }
    let mut said: Vec<&str> = Vec::new();
    for (_, term, solution) in &found {
        let largest = all.significant(columns, law, solution, term.column != SPRING);
        if largest > SAID_SHARE && !said.contains(&term.meaning) {
            said.push(term.meaning);
            let (meaning, percent) = (term.meaning, percent_from_ratio(largest));
            verdicts.push(format!("{meaning}: that moves a value by {percent:.1} %, and the intervals take it in"));
        }
    }
    // Together: the best term first, then what is significant beside it. Terms that stand for the same are not fitted side by side.
    let mut with = columns.to_vec();
    let mut best = found.into_iter().max_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, term, _)| term);
    while let Some(term) = best {
        with.push(term.column);
        let beside = missing.iter().filter(|term| !with.contains(&term.column));
        let tried =
            beside.filter_map(|term| tried(blocks, &with, term).map(|(errors, _, _, fit)| (errors, *term, fit)));
        let next = tried.filter(|(errors, ..)| *errors > SIGNIFICANT).max_by(|one, other| one.0.total_cmp(&other.0));
        if let Some((_, _, solution)) = &next {
            all.significant(columns, law, solution, true);
        }
        best = next.map(|(_, term, _)| term);
    }
    all
}
