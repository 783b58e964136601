//! The one clock: integer ticks of a rational number of nanoseconds.
//!
//! In: the periods of the machine (t_s and the loops of every axis). Out: [`TimeBase`], from which every time in seconds or
//! nanoseconds is computed; nothing is ever summed up. 83.333... µs is representable: the tick is a ratio of integers.

use super::units::NS_PER_S;

/// Number of base ticks since the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Tick(pub u64);

/// Length of a tick: `numerator_ns / denominator` nanoseconds, in lowest terms, and the ticks of one interpolator cycle t_s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeBase {
    numerator_ns: u64,
    denominator: u64,
    ticks_per_setpoint: u64,
}

impl TimeBase {
    /// Splits the interpolator cycle of `setpoint_period_ns.0 / setpoint_period_ns.1` nanoseconds into `ticks_per_setpoint`
    /// equal ticks. Panics on zeros: machine files are checked before.
    pub fn new(setpoint_period_ns: (u64, u64), ticks_per_setpoint: u64) -> Self {
        let (numerator, denominator) = setpoint_period_ns;
        assert!(numerator > 0 && denominator > 0 && ticks_per_setpoint > 0, "a period of zero");
        let full = denominator.checked_mul(ticks_per_setpoint).expect("tick denominator fits 64 bits");
        let shared = gcd(numerator, full);
        Self { numerator_ns: numerator / shared, denominator: full / shared, ticks_per_setpoint }
    }

    /// Base ticks in one interpolator cycle t_s.
    pub fn ticks_per_setpoint(&self) -> u64 {
        self.ticks_per_setpoint
    }

    /// The instant of set-point `k`.
    pub fn setpoint_tick(&self, k: u64) -> Tick {
        Tick(k * self.ticks_per_setpoint)
    }

    /// Seconds of `ticks` ticks: one rounding, whatever the number.
    pub fn seconds(&self, ticks: u64) -> f64 {
        // u128 keeps the product exact; the division by 1e9 and the denominator is one correctly rounded operation on each side.
        (u128::from(ticks) * u128::from(self.numerator_ns)) as f64 / (self.denominator as f64 * NS_PER_S)
    }

    /// The time of a tick in seconds.
    pub fn time_s(&self, tick: Tick) -> f64 {
        self.seconds(tick.0)
    }

    /// The time of a tick in whole nanoseconds (rounded half up), as recorded.
    pub fn time_ns(&self, tick: Tick) -> u64 {
        let exact = u128::from(tick.0) * u128::from(self.numerator_ns);
        let denominator = u128::from(self.denominator);
        ((exact + denominator / 2) / denominator) as u64
    }

    /// Interpolator cycle t_s in seconds.
    pub fn setpoint_period_s(&self) -> f64 {
        self.seconds(self.ticks_per_setpoint)
    }

    /// Length of one tick in seconds.
    pub fn tick_period_s(&self) -> f64 {
        self.seconds(1)
    }
}

/// Greatest common divisor.
pub fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Least common multiple. Panics if it does not fit 64 bits.
pub fn lcm(a: u64, b: u64) -> u64 {
    (a / gcd(a, b)).checked_mul(b).expect("least common multiple fits 64 bits")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_third_of_a_quarter_millisecond_is_exact() {
        // 250 µs in three: 83.333... µs. Tick 3 must be 250 µs to the last bit, and a million hours must not drift.
        let base = TimeBase::new((250_000, 1), 3);
        assert_eq!(base.time_ns(Tick(3)), 250_000);
        assert_eq!(base.time_s(Tick(3)), 250e-6);
        let hours = 1_000_000_u64 * 3600 * 4000 * 3;
        assert_eq!(base.time_ns(Tick(hours)), 3_600_000_000_000_000_000);
    }
}
