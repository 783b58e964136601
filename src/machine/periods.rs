//! The clock of a machine: every period as a whole number of ticks.
//!
//! In: t_cyl, f_s and the cycles of the axes, as numbers of a machine file. Out: whole ratios, and the tick as an exact fraction of
//! a nanosecond. A number that is cut off, such as 0.0833333333, is taken as the simple fraction that it stands for (1/12).
//! Does not report: the callers know the keys.

use crate::base::TimeBase;
use crate::base::clock::gcd;
use crate::base::units::NS_PER_MS;

/// How far a ratio of two cycles may be from a whole number, relatively (models/drive.md section 8).
pub(super) const RATIO_TOLERANCE: f64 = 1e-9;
/// Largest whole ratio of two cycles: a control cycle of a second over a current cycle of a microsecond.
pub(super) const RATIO_MAX: u64 = 1_000_000;
/// Largest denominator of the simple fractions that a cut-off decimal may stand for.
const SIMPLE_DENOMINATOR_MAX: u64 = 1000;

/// The whole number that a ratio of two cycles is, if it is one.
pub(super) fn whole_ratio(period_ratio: f64) -> Option<u64> {
    let whole = period_ratio.round();
    let is_whole = whole >= 1.0 && whole <= RATIO_MAX as f64 && (period_ratio - whole).abs() <= RATIO_TOLERANCE * whole;
    is_whole.then_some(whole as u64)
}

/// Least common multiple, if it stays within [`RATIO_MAX`].
pub(super) fn common_multiple(a: u64, b: u64) -> Option<u64> {
    (a / gcd(a, b)).checked_mul(b).filter(|multiple| *multiple <= RATIO_MAX)
}

/// The clock with `ticks_per_setpoint` ticks in f_s * t_cyl; `None` if that has more digits than 64 bits hold.
pub(super) fn time_base(t_cyl_ms: f64, f_s: f64, ticks_per_setpoint: u64) -> Option<TimeBase> {
    let cycle = Fraction::of(t_cyl_ms)?.times(Fraction::of(f_s)?)?;
    let period_ns = cycle.times(Fraction { numerator: NS_PER_MS as u128, denominator: 1 })?;
    let numerator = u64::try_from(period_ns.numerator).ok()?;
    let denominator = u64::try_from(period_ns.denominator).ok()?;
    denominator.checked_mul(ticks_per_setpoint)?;
    Some(TimeBase::new((numerator, denominator), ticks_per_setpoint))
}

/// A positive rational number in lowest terms.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Fraction {
    numerator: u128,
    denominator: u128,
}

impl Fraction {
    fn reduced(numerator: u128, denominator: u128) -> Option<Self> {
        if numerator == 0 || denominator == 0 {
            return None;
        }
        let (mut a, mut b) = (numerator, denominator);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        Some(Self { numerator: numerator / a, denominator: denominator / a })
    }

    fn times(self, other: Self) -> Option<Self> {
        let numerator = self.numerator.checked_mul(other.numerator)?;
        Self::reduced(numerator, self.denominator.checked_mul(other.denominator)?)
    }

    /// The number that a person meant: a simple fraction next to it, or the decimal as written.
    fn of(value: f64) -> Option<Self> {
        if !(value.is_finite() && value > 0.0) {
            return None;
        }
        Self::simple(value).or_else(|| Self::decimal(value))
    }

    /// The first convergent of the continued fraction that is near enough.
    fn simple(value: f64) -> Option<Self> {
        let (mut before, mut now) = ((0_u64, 1_u64), (1_u64, 0_u64));
        let mut rest = value;
        loop {
            let whole = rest.floor();
            if whole > 1e9 {
                return None;
            }
            let next = |now: u64, before: u64| (whole as u64).checked_mul(now)?.checked_add(before);
            let (p, q) = (next(now.0, before.0)?, next(now.1, before.1)?);
            if q > SIMPLE_DENOMINATOR_MAX {
                return None;
            }
            if (p as f64 / q as f64 - value).abs() <= RATIO_TOLERANCE * value {
                return Self::reduced(p.into(), q.into());
            }
            (before, now) = (now, (p, q));
            rest = 1.0 / (rest - whole);
        }
    }

    /// The shortest decimal that reads back as this number, exactly.
    fn decimal(value: f64) -> Option<Self> {
        let text = value.to_string();
        let (whole, part) = text.split_once('.').unwrap_or((&text, ""));
        let numerator = format!("{whole}{part}").parse().ok()?;
        Self::reduced(numerator, 10_u128.checked_pow(u32::try_from(part.len()).ok()?)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_off_decimal_is_the_fraction_it_stands_for() {
        assert_eq!(Fraction::of(0.083_333_333_33), Some(Fraction { numerator: 1, denominator: 12 }));
        assert_eq!(Fraction::of(0.125), Some(Fraction { numerator: 1, denominator: 8 }));
        assert_eq!(Fraction::of(8.0), Some(Fraction { numerator: 8, denominator: 1 }));
        assert_eq!(Fraction::of(1.234_567), Some(Fraction { numerator: 1_234_567, denominator: 1_000_000 }));
        assert_eq!(Fraction::of(f64::NAN), None);
    }

    #[test]
    fn three_current_cycles_of_83_us_are_a_speed_cycle_of_250_us() {
        assert_eq!(whole_ratio(250.0 / 83.333_333_333_333), Some(3));
        assert_eq!(whole_ratio(250.0 / 83.333), None);
        assert_eq!(whole_ratio(0.5), None);
        assert_eq!(whole_ratio(f64::NAN), None);
    }
}
