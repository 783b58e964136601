//! Jerk-limited changes of speed along a straight parameter: how long, how far, how fast.
//!
//! In: two speeds, or a speed and a length, and the [`Dynamics`] of the piece. Out: the [`Ramp`] between two speeds, the highest
//! speed that a length allows ([`Dynamics::reachable`]) and the highest peak between two speeds ([`Dynamics::peak`]). A ramp
//! starts and ends without acceleration: with `d = |vb - va|` it takes `2 sqrt(d/J)` where `d <= A²/J` and `d/A + A/J` otherwise,
//! and its length is its mean speed times that (models/arcs.md section 6). Under BRISK there is no J: `d/A`.
//! Does not know axes, limits' names or curves.

use crate::base::Portable;
/// Differences of speed below this share of the speed are rounding, not ramps: jerk is no property of the last bits of a number.
const SAME_SPEED_RATIO: f64 = 1e-12;

/// Rounds after which a convex Newton iteration from above has reached the last bit (it takes about six).
const NEWTON_ROUNDS: usize = 60;

/// What the path may do along itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamics {
    /// A, positive.
    pub acceleration_lu_s2: f64,
    /// J, positive; `None` under BRISK.
    pub jerk_lu_s3: Option<f64>,
}

/// A change of speed: jerk, constant acceleration, jerk back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// Length of each of the two jerk phases.
    pub jerk_time_s: f64,
    /// Length of the phase of constant acceleration between them.
    pub hold_time_s: f64,
}

impl Ramp {
    /// From rest of acceleration to rest of acceleration.
    pub fn duration_s(&self) -> f64 {
        2.0 * self.jerk_time_s + self.hold_time_s
    }

    /// The same change of speed, slower or faster by a factor: the way scales with it.
    pub fn scaled(self, time_ratio: f64) -> Self {
        Self { jerk_time_s: self.jerk_time_s * time_ratio, hold_time_s: self.hold_time_s * time_ratio }
    }
}

/// True where the difference of two speeds is nothing but rounding.
pub fn same_speed(from_lu_s: f64, to_lu_s: f64) -> bool {
    (to_lu_s - from_lu_s).abs() <= SAME_SPEED_RATIO * from_lu_s.max(to_lu_s)
}

impl Dynamics {
    /// The quickest ramp between two speeds.
    pub fn ramp(&self, from_lu_s: f64, to_lu_s: f64) -> Ramp {
        if same_speed(from_lu_s, to_lu_s) {
            return Ramp { jerk_time_s: 0.0, hold_time_s: 0.0 };
        }
        self.ramp_over((to_lu_s - from_lu_s).abs())
    }

    /// Way that the quickest ramp between two speeds takes.
    pub fn ramp_length_lu(&self, from_lu_s: f64, to_lu_s: f64) -> f64 {
        (from_lu_s + to_lu_s) / 2.0 * self.ramp(from_lu_s, to_lu_s).duration_s()
    }

    /// Highest speed to which `length_lu` suffices from `from_lu_s`; by symmetry also the highest speed from which one can
    /// brake to exactly `from_lu_s` within it.
    pub fn reachable(&self, from_lu_s: f64, length_lu: f64) -> f64 {
        from_lu_s + self.gain(from_lu_s, length_lu)
    }

    /// Highest speed from which one can brake within `length_lu` to `to_lu_s` and to every other speed not above it: never less
    /// for a higher `to_lu_s`, as [`reachable`](Self::reachable) may be. A ramp ends without acceleration, so that braking to a
    /// third of a speed takes more way than braking to rest.
    pub fn brakeable(&self, to_lu_s: f64, length_lu: f64) -> f64 {
        let Some(j) = self.jerk_lu_s3 else { return self.reachable(to_lu_s, length_lu) };
        // Where d(reachable)/d(to) = 0: J x² / 2 with 2 J x³ = L, or A²/(2 J) with a phase of constant acceleration.
        let x = (length_lu / (2.0 * j)).portable_cbrt();
        let a = self.acceleration_lu_s2;
        let lowest_lu_s = (j * x * x / 2.0).min(a * a / (2.0 * j));
        self.reachable(to_lu_s.max(lowest_lu_s), length_lu)
    }

    /// Highest speed from which both ramps, `from -> peak -> to`, fit into `length_lu`; at least the higher one of the two.
    pub fn peak(&self, from_lu_s: f64, to_lu_s: f64, length_lu: f64) -> f64 {
        let (low, high) = (from_lu_s.min(to_lu_s), from_lu_s.max(to_lu_s));
        let difference = high - low;
        // With x² = peak - high both ramp lengths are convex and rise with x, so that Newton's method falls monotonically from
        // any upper bound: the peak that one of the two ramps alone would allow.
        let mut x = self.gain(high, if difference > 0.0 { length_lu } else { length_lu / 2.0 }).sqrt();
        for _ in 0..NEWTON_ROUNDS {
            let gain = x * x;
            let (upper_lu, upper_slope) = self.length_and_slope(high, gain);
            let (lower_lu, lower_slope) = self.length_and_slope(low, gain + difference);
            let step = (upper_lu + lower_lu - length_lu) / (2.0 * x * (upper_slope + lower_slope));
            let next = x - step;
            // Also ends on NaN (x = 0: no room at all).
            if !(step > 0.0 && next < x && next >= 0.0) {
                break;
            }
            x = next;
        }
        high + x * x
    }

    fn ramp_over(&self, difference_lu_s: f64) -> Ramp {
        let (d, a) = (difference_lu_s, self.acceleration_lu_s2);
        match self.jerk_lu_s3 {
            None => Ramp { jerk_time_s: 0.0, hold_time_s: d / a },
            Some(j) if d <= a * a / j => Ramp { jerk_time_s: (d / j).sqrt(), hold_time_s: 0.0 },
            Some(j) => Ramp { jerk_time_s: a / j, hold_time_s: d / a - a / j },
        }
    }

    /// Length of the ramp from `from_lu_s` up by `gain_lu_s`, and its derivative to the gain.
    fn length_and_slope(&self, from_lu_s: f64, gain_lu_s: f64) -> (f64, f64) {
        let (d, a) = (gain_lu_s, self.acceleration_lu_s2);
        let time_s = self.ramp_over(d).duration_s();
        let time_slope = match self.jerk_lu_s3 {
            Some(j) if d <= a * a / j => 1.0 / (j * d).sqrt(),
            _ => 1.0 / a,
        };
        let mean_lu_s = from_lu_s + d / 2.0;
        (mean_lu_s * time_s, time_s / 2.0 + mean_lu_s * time_slope)
    }

    /// Gain of speed that `length_lu` allows: the inverse of the ramp length.
    fn gain(&self, from_lu_s: f64, length_lu: f64) -> f64 {
        let (v, l, a) = (from_lu_s, length_lu, self.acceleration_lu_s2);
        let Some(j) = self.jerk_lu_s3 else {
            return rise(2.0 * v, 2.0 * a * l);
        };
        // The longest ramp without a phase of constant acceleration gains A²/J.
        if l <= (v + a * a / (2.0 * j)) * (2.0 * a / j) {
            // With x = sqrt(d/J) the length is J x³ + 2 v x.
            let x = cubic_root(2.0 * v / j, l / j);
            return j * x * x;
        }
        // d² + d (2 v + A²/J) = 2 A (L - v A/J)
        rise(2.0 * v + a * a / j, 2.0 * a * (l - v * a / j))
    }
}

/// Positive root of `d² + p d = q` for `p >= 0`, without cancellation.
fn rise(p: f64, q: f64) -> f64 {
    let half = p / 2.0;
    let divisor = half + (half * half + q.max(0.0)).sqrt();
    if divisor > 0.0 { q.max(0.0) / divisor } else { 0.0 }
}

/// Positive root of `x³ + p x = q` for `p, q >= 0`: Newton from above, where the cubic is convex and rising.
fn cubic_root(p: f64, q: f64) -> f64 {
    // Each of the two terms alone gives an upper bound; the smaller bound is at most about 1.5 times the root.
    let mut x = if p > 0.0 { q.portable_cbrt().min(q / p) } else { q.portable_cbrt() };
    for _ in 0..NEWTON_ROUNDS {
        let next = x - (x * x * x + p * x - q) / (3.0 * x * x + p);
        if !(next < x && next >= 0.0) {
            break;
        }
        x = next;
    }
    x
}
