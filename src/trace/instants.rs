//! Points in time as text.
//!
//! In: `2026-06-03T17:57:40.613Z`, `2026-06-03 17:57:40,613`, `03.06.2026 17:57:40.613`, `17:57:40.613`. Out: seconds from a fixed day, of
//! which only differences mean something; of a time without a date seconds of the day. Time zones other than Z are passed over: within one
//! trace they do not change.

use crate::base::units::{MS_PER_S, S_PER_MIN};

/// Days are counted from 1 March 2000: seconds of our time then keep a tenth of a microsecond in an f64.
const DAY_ZERO: i64 = 730_486;
/// Seconds of a day.
pub(super) const DAY_S: f64 = 24.0 * S_PER_MIN * S_PER_MIN;

/// Seconds of a date with a time of day, or of a time of day; `None` for anything else.
pub(super) fn instant_s(text: &str) -> Option<f64> {
    let text = text.trim().trim_end_matches('Z');
    match text.split_once(['T', ' ']) {
        Some((date, time)) => {
            let time = time.find(['+']).map_or(time, |zone| &time[..zone]);
            Some(days(date)? as f64 * DAY_S + time_of_day_s(time)?)
        }
        None => time_of_day_s(text),
    }
}

/// Whether an instant has no date: it goes back to 0 at midnight.
pub(super) fn without_date(text: &str) -> bool {
    time_of_day_s(text.trim()).is_some()
}

/// An instant in UTC so much later, to the millisecond; `None` if the text is none with a date.
pub(super) fn shifted(text: &str, later_s: f64) -> Option<String> {
    if without_date(text) || !later_s.is_finite() {
        return None;
    }
    let whole_ms = ((instant_s(text)? + later_s) * MS_PER_S).round();
    let day = (whole_ms / (DAY_S * MS_PER_S)).floor();
    let (year, month, day_of_month) = calendar(day as i64)?;
    let ms = whole_ms - day * DAY_S * MS_PER_S;
    let second_ms = ms % (S_PER_MIN * MS_PER_S);
    let minute = (ms / (S_PER_MIN * MS_PER_S)).floor();
    let (hour, minute) = ((minute / S_PER_MIN).floor(), minute % S_PER_MIN);
    let second = second_ms / MS_PER_S;
    Some(format!("{year:04}-{month:02}-{day_of_month:02}T{hour:02}:{minute:02}:{second:06.3}Z"))
}

fn time_of_day_s(time: &str) -> Option<f64> {
    let mut parts = time.trim().splitn(3, ':');
    let hour: f64 = parts.next()?.parse().ok()?;
    let minute: f64 = parts.next()?.parse().ok()?;
    let second: f64 = parts.next()?.replace(',', ".").parse().ok()?;
    let sane = (0.0..24.5).contains(&hour) && (0.0..60.0).contains(&minute) && (0.0..62.0).contains(&second);
    sane.then_some((hour * S_PER_MIN + minute) * S_PER_MIN + second)
}

/// Year, month and day of a day, the inverse of [`days`].
fn calendar(day: i64) -> Option<(i64, i64, i64)> {
    // Years begin in March; 400 of them have 146,097 days.
    let mut rest = day + DAY_ZERO - 1;
    let mut year = rest.div_euclid(146_097) * 400;
    rest = rest.rem_euclid(146_097);
    let century = (rest / 36_524).min(3);
    rest -= century * 36_524;
    let four = rest / 1461;
    rest -= four * 1461;
    let single = (rest / 365).min(3);
    rest -= single * 365;
    year += century * 100 + four * 4 + single;
    let month = (5 * rest + 2) / 153;
    let day_of_month = rest - (153 * month + 2) / 5 + 1;
    let (year, month) = if month < 10 { (year, month + 3) } else { (year + 1, month - 9) };
    (0..=9999).contains(&year).then_some((year, month, day_of_month))
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
