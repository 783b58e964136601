//! A search without derivatives behind Gauss-Newton: it sees stick events, bends of the delay, and peaks.
//!
//! In: a group, gains, their score. Out: gains that are no worse. A pattern of one gain up or down at a time, all at once as candidates of a
//! batch; steps are halved where none is better.

use super::Measure;
use super::gains::Gains;
use super::group::{Group, Score};

/// Rounds for the mean square, which Gauss-Newton has found but for stick events, and for the peak, which it does not see.
const ROUNDS_RMS: usize = 4;
const ROUNDS_PEAK: usize = 24;
/// Steps are halved this often at most.
const HALVINGS: i32 = 5;
/// An improvement smaller than this share is none.
const LEAST_SHARE: f64 = 1e-4;

/// The best gains found.
pub(super) fn search(group: &Group<'_>, start: Vec<Gains>, score: Score) -> Vec<Gains> {
    let (rounds, mut scale) = match group.measure {
        Measure::Rms => (ROUNDS_RMS, 0.25),
        Measure::Peak => (ROUNDS_PEAK, 1.0),
    };
    let least = scale * 0.5_f64.powi(HALVINGS);
    let (mut gains, mut best) = (start, group.figure(&score));
    let mut heading: Option<(usize, f64)> = None;
    for _ in 0..rounds {
        let mut moves: Vec<(usize, f64)> = Vec::new();
        for (place, slot) in group.slots.iter().enumerate() {
            let step = scale * slot.gain.step(slot.range);
            moves.extend([(place, step), (place, -step)]);
        }
        // The way that was good last time, twice as far.
        moves.extend(heading.map(|(place, step)| (place, 2.0 * step)));
        let candidates: Vec<Vec<Gains>> = moves
            .iter()
            .map(|(place, step)| {
                let mut moved = gains.clone();
                let slot = &group.slots[*place];
                let inside = group.value(&gains, slot) + step;
                group.put(&mut moved, slot, inside);
                moved
            })
            .collect();
        let scores = group.scores(&candidates);
        let found = (0..candidates.len())
            .min_by(|one, other| group.figure(&scores[*one]).total_cmp(&group.figure(&scores[*other])));
        match found {
            Some(place) if group.figure(&scores[place]) < best * (1.0 - LEAST_SHARE) => {
                best = group.figure(&scores[place]);
                gains.clone_from(&candidates[place]);
                heading = Some(moves[place]);
            }
            _ => {
                heading = None;
                scale *= 0.5;
                if scale < least {
                    break;
                }
            }
        }
    }
    gains
}
