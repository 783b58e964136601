//! Gauss-Newton in the gains, from several starts side by side, and a look at the whole range.
//!
//! In: a group, starts. Out: the [`Point`] with the least mean square, with the affine model around it. Residuals are affine in the gains between
//! stick events: one simulation with each gain moved gives all derivatives, and the drive steps eight sets of gains together, so that two
//! starts with their derivatives are one run. Points spread over the bounds are tried at the end: a better valley elsewhere is gone down.

use super::gains::Gains;
use super::group::{Group, Residual, Score, score};
use super::normal::{Normal, Step, difference_steps};

/// Runs of points with their derivatives.
const PASSES: usize = 5;
/// A step smaller than this share of a step of the search is none.
const DONE_SHARE: f64 = 0.01;
/// Ends nearer than this share of a step of the search are the same.
const SAME_SHARE: f64 = 0.2;
/// The smallest share of a step that is tried.
const LEAST_SHARE: f64 = 0.2;
/// Points over the bounds.
const SCAN_POINTS: usize = 8;
/// Points nearer to the end than this, in steps of the search, should say the same of it.
const NEIGHBOUR_STEPS: f64 = 2.0;
/// Bases of the radical inverse, one for each gain: the points fill the box evenly [Halton 1960].
const PRIMES: [u32; 24] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89];

/// A set of gains, how good it is, and the affine model around it.
#[derive(Clone)]
pub(super) struct Point {
    pub gains: Vec<Gains>,
    pub score: Score,
    pub normal: Normal,
    /// Where the model around it has the least mean square, slot by slot.
    pub predicted: Vec<f64>,
    /// Mean square distance of what the models around it and its neighbours predict: 0 if residuals were affine.
    pub spread: Vec<f64>,
}

/// Bases with their derivatives, all in one run.
pub(super) fn points(group: &Group<'_>, bases: Vec<Vec<Gains>>, theory: &[Gains]) -> Vec<Point> {
    let mut candidates = Vec::new();
    for base in &bases {
        candidates.push(base.clone());
        for (slot, step) in group.slots.iter().zip(difference_steps(group, base)) {
            let (mut moved, value) = (base.clone(), group.value(base, slot) + step);
            for member in &slot.members {
                moved[*member] = moved[*member].with(slot.gain, value);
            }
            candidates.push(moved);
        }
    }
    let residuals = group.residuals(&candidates);
    let each = group.slots.len() + 1;
    let point = |(number, gains): (usize, Vec<Gains>)| {
        let own: Vec<&[Residual]> =
            residuals.iter().map(|course| &course[number * each..(number + 1) * each]).collect();
        let score = score(own.iter().filter_map(|course| course.first()));
        let normal = Normal::around(group, &gains, &own);
        let step = Step::new(group, &normal, &gains, theory).solve(&normal);
        let predicted = group.slots.iter().zip(&step).map(|(slot, part)| group.value(&gains, slot) + part).collect();
        Point { gains, score, normal, predicted, spread: step.iter().map(|part| part * part).collect() }
    };
    bases.into_iter().enumerate().map(point).collect()
}

/// A start on its way down.
struct Descent {
    best: Point,
    /// Of the step that the model around `best` proposes.
    share: f64,
}

impl Descent {
    /// Where to look next; `None` if it has arrived.
    fn next(&self, group: &Group<'_>) -> Option<Vec<Gains>> {
        let Point { gains, predicted, .. } = &self.best;
        let mut moved = gains.clone();
        for (slot, predicted) in group.slots.iter().zip(predicted) {
            let value = group.value(gains, slot);
            group.put(&mut moved, slot, value + self.share * (predicted - value));
        }
        (self.share >= LEAST_SHARE && !near(group, gains, &moved, DONE_SHARE)).then_some(moved)
    }

    fn take(&mut self, point: Point) {
        if point.score.mean_square < self.best.score.mean_square {
            *self = Self { best: point, share: 1.0 };
        } else {
            self.share *= 0.5;
        }
    }
}

fn near(group: &Group<'_>, one: &[Gains], other: &[Gains], share: f64) -> bool {
    group
        .slots
        .iter()
        .all(|slot| (group.value(one, slot) - group.value(other, slot)).abs() <= share * slot.gain.step(slot.range))
}

/// The first start, and the least mean square reached from any. `None` without a start.
pub(super) fn gauss_newton(group: &Group<'_>, starts: Vec<Vec<Gains>>, theory: &[Gains]) -> Option<(Point, Point)> {
    let found = points(group, starts, theory);
    let first = found.first()?.clone();
    let seen = |point: &Point| (point.gains.clone(), point.predicted.clone());
    let mut visited: Vec<(Vec<Gains>, Vec<f64>)> = found.iter().map(seen).collect();
    let mut on_way: Vec<Descent> = found.into_iter().map(|best| Descent { best, share: 1.0 }).collect();
    let mut arrived: Vec<Point> = Vec::new();
    for _ in 1..PASSES {
        // Of two that go to the same place the better one goes on.
        on_way.sort_by(|one, other| one.best.score.mean_square.total_cmp(&other.best.score.mean_square));
        let (mut going, mut bases) = (Vec::new(), Vec::<Vec<Gains>>::new());
        for descent in on_way {
            match descent.next(group) {
                Some(next) if bases.iter().all(|other| !near(group, other, &next, SAME_SHARE)) => {
                    bases.push(next);
                    going.push(descent);
                }
                Some(_) => {}
                None => arrived.push(descent.best),
            }
        }
        on_way = going;
        if bases.is_empty() {
            break;
        }
        let found = points(group, bases, theory);
        visited.extend(found.iter().map(seen));
        on_way.iter_mut().zip(found).for_each(|(descent, point)| descent.take(point));
    }
    let all = arrived.into_iter().chain(on_way.into_iter().map(|descent| descent.best));
    let mut best = all.min_by(|one, other| one.score.mean_square.total_cmp(&other.score.mean_square))?;
    visited.retain(|(gains, _)| near(group, gains, &best.gains, NEIGHBOUR_STEPS));
    for (place, slot) in group.slots.iter().enumerate() {
        let value = group.value(&best.gains, slot);
        let sum: f64 = visited.iter().map(|(_, predicted)| (predicted[place] - value).powi(2)).sum();
        best.spread[place] = sum / visited.len().max(1) as f64;
    }
    Some((first, best))
}

/// The best of points spread over the bounds, if it is better than `than`.
pub(super) fn scan(group: &Group<'_>, base: &[Gains], than: &Score) -> Option<Vec<Gains>> {
    let point = |number: usize| {
        let mut moved = base.to_vec();
        for (slot, prime) in group.slots.iter().zip(PRIMES.iter().cycle()) {
            let [low, high] = slot.range;
            group.put(&mut moved, slot, low + (high - low) * radical_inverse(number as u32 + 1, *prime));
        }
        moved
    };
    let candidates: Vec<Vec<Gains>> = (0..SCAN_POINTS).map(point).collect();
    let scores = group.scores(&candidates);
    let best = (0..SCAN_POINTS).min_by(|one, other| scores[*one].mean_square.total_cmp(&scores[*other].mean_square))?;
    (scores[best].mean_square < than.mean_square).then(|| candidates[best].clone())
}

/// The digits of a number in a base, mirrored at the point.
fn radical_inverse(mut number: u32, base: u32) -> f64 {
    let (mut inverse, mut place) = (0.0, 1.0);
    while number > 0 {
        place /= f64::from(base);
        inverse += place * f64::from(number % base);
        number /= base;
    }
    inverse
}
