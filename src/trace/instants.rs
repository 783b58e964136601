//! Points in time as text.
//!
//! In: `2026-06-03T17:57:40.613Z`, `2026-06-03 17:57:40,613`, `03.06.2026 17:57:40.613`. Out: seconds from a fixed day, of which only
//! differences mean something. Time zones other than Z are passed over: within one trace they do not change.

use crate::base::units::S_PER_MIN;

/// Days are counted from 1 March 2000: seconds of our time then keep a tenth of a microsecond in an f64.
const DAY_ZERO: i64 = 730_486;

/// Seconds of a date with a time of day; `None` for anything else.
pub(super) fn instant_s(text: &str) -> Option<f64> {
    let text = text.trim().trim_end_matches('Z');
    let (date, time) = text.split_once(['T', ' '])?;
    let days = days(date)?;
    let time = time.find(['+']).map_or(time, |zone| &time[..zone]);
    let mut parts = time.trim().splitn(3, ':');
    let hour: f64 = parts.next()?.parse().ok()?;
    let minute: f64 = parts.next()?.parse().ok()?;
    let second: f64 = parts.next()?.replace(',', ".").parse().ok()?;
    let sane = (0.0..24.5).contains(&hour) && (0.0..60.0).contains(&minute) && (0.0..62.0).contains(&second);
    sane.then_some(((days as f64 * 24.0 + hour) * S_PER_MIN + minute) * S_PER_MIN + second)
}

/// Days of `2026-06-03` or `03.06.2026`.
fn days(date: &str) -> Option<i64> {
    let (year, month, day) = match date.split_once('-') {
        Some((year, rest)) => {
            let (month, day) = rest.split_once('-')?;
            (year, month, day)
        }
        None => {
            let (day, rest) = date.split_once('.')?;
            let (month, year) = rest.split_once('.')?;
            (year, month, day)
        }
    };
    let (year, month, day): (i64, i64, i64) = (year.parse().ok()?, month.parse().ok()?, day.parse().ok()?);
    if !(0..=9999).contains(&year) || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // Years begin in March, so that the leap day is the last.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    Some(365 * year + leap_days + (153 * month + 2) / 5 + day - DAY_ZERO)
}
