//! Where in a program a datum binds, and what of the program has to be planned again to see what it costs.
//!
//! In: how long a datum binds in each move of a program. Out: [`Stretch`]es. A stretch is what is counted, with so much of the program around it that a
//! motion which begins and ends at rest there is, where it is counted, the one of the whole program. Does not plan.

/// A motion from rest is as it would be without the rest after this time, and so before a rest: several ramps.
pub(super) const PAD_S: f64 = 1.0;

/// A stretch counts this much beyond the moves in which the datum binds: the ramps to and from them change too.
const COUNTED_S: f64 = PAD_S / 2.0;

/// Moves of one stretch, so that samples of long programs are spread.
const MOVES_MAX: usize = 500;

/// The time of a program, move by move.
#[derive(Clone, Debug, Default)]
pub(super) struct Timing {
    /// When each move begins, and the end.
    pub starts_s: Vec<f64>,
    /// The path rests after the move, whatever follows.
    pub rests_after: Vec<bool>,
}

/// A part of a program to plan again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stretch {
    /// First and last move that are planned.
    pub planned: [usize; 2],
    /// First and last move that are counted.
    pub counted: [usize; 2],
}

impl Timing {
    /// Stretches around the moves in `binding`, which are in order.
    pub fn stretches(&self, binding: &[usize]) -> Vec<Stretch> {
        let mut cores: Vec<([usize; 2], [bool; 2])> = Vec::new();
        for &index in binding {
            match cores.last_mut() {
                Some((core, _)) if index - core[0] < MOVES_MAX && self.near(core[1], index) => core[1] = index,
                Some((core, open)) if self.near(core[1], index) => {
                    // Both count up to the border between them.
                    open[1] = false;
                    core[1] = index - 1;
                    cores.push(([index, index], [false, true]));
                }
                _ => cores.push(([index, index], [true, true])),
            }
        }
        cores.into_iter().map(|(core, open)| self.stretch(core, open)).collect()
    }

    /// Two moves between which a motion does not forget.
    fn near(&self, before: usize, after: usize) -> bool {
        let gap_s = self.starts_s[after] - self.starts_s[before + 1];
        let rests = self.rests_after[before..after].contains(&true);
        !rests && gap_s < 2.0 * PAD_S
    }

    fn stretch(&self, core: [usize; 2], open: [bool; 2]) -> Stretch {
        let mut counted = core;
        if open[0] {
            counted[0] = self.back(core[0], COUNTED_S);
        }
        if open[1] {
            counted[1] = self.on(core[1], COUNTED_S);
        }
        let planned = [self.back(core[0], COUNTED_S + PAD_S), self.on(core[1], COUNTED_S + PAD_S)];
        Stretch { planned, counted }
    }

    /// The move that begins so much time before another, or after the rest before it.
    fn back(&self, from: usize, time_s: f64) -> usize {
        let mut index = from;
        while index > 0 && !self.rests_after[index - 1] && self.starts_s[from] - self.starts_s[index] < time_s {
            index -= 1;
        }
        index
    }

    /// The move that ends so much time after another, or at the rest after it.
    fn on(&self, from: usize, time_s: f64) -> usize {
        let mut index = from;
        let last = self.rests_after.len().saturating_sub(1);
        while index < last && !self.rests_after[index] && self.starts_s[index + 1] - self.starts_s[from + 1] < time_s {
            index += 1;
        }
        index
    }
}
