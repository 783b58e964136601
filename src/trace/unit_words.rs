//! Units as people write them, and what brings their numbers into ours.
//!
//! In: `[mm/min]`, `(ms)`, `Nm`. Out: our unit and a factor. Unknown words stay what they are. Does not know signals.

use crate::base::units::{
    MM_PER_M, MS_PER_S, NS_PER_S, S_PER_MIN, US_PER_S, deg_from_rad, mm_from_inch, mm_from_um, mm_s_from_m_min,
    mm_s_from_mm_min,
};

/// Written units in lower case without brackets, ours, and the factor.
fn table() -> [(&'static [&'static str], &'static str, f64); 24] {
    [
        (&["s", "sec", "sek", "second", "seconds", "sekunden"], "s", 1.0),
        (&["ms", "msec", "millisec"], "s", 1.0 / MS_PER_S),
        (&["us", "µs", "μs"], "s", 1.0 / US_PER_S),
        (&["ns"], "s", 1.0 / NS_PER_S),
        (&["mm"], "mm", 1.0),
        (&["m"], "mm", MM_PER_M),
        (&["um", "µm", "μm"], "mm", mm_from_um(1.0)),
        (&["inch", "in"], "mm", mm_from_inch(1.0)),
        (&["mm/s"], "mm/s", 1.0),
        (&["m/s"], "mm/s", MM_PER_M),
        (&["mm/min"], "mm/s", mm_s_from_mm_min(1.0)),
        (&["m/min"], "mm/s", mm_s_from_m_min(1.0)),
        (&["mm/s^2", "mm/s2", "mm/s²"], "mm/s^2", 1.0),
        (&["m/s^2", "m/s2", "m/s²"], "mm/s^2", MM_PER_M),
        (&["deg", "°", "grad", "degree", "degrees"], "deg", 1.0),
        (&["rad"], "deg", deg_from_rad(1.0)),
        (&["deg/s", "°/s"], "deg/s", 1.0),
        (&["deg/min", "°/min"], "deg/s", 1.0 / S_PER_MIN),
        (&["deg/s^2", "deg/s2", "deg/s²", "°/s²"], "deg/s^2", 1.0),
        (&["nm", "n m", "n·m", "n*m"], "N m", 1.0),
        (&["a", "arms", "amp"], "A", 1.0),
        (&["v", "volt"], "V", 1.0),
        (&["%", "percent"], "%", 1.0),
        (&["w", "watt"], "W", 1.0),
    ]
}

/// Units that are known and stay as they are.
const KEPT: [&str; 10] = ["rpm", "1/min", "rev/min", "u/min", "hz", "rad/s", "kw", "-", "bits", "mm/s^3"];

/// Our unit and the factor that brings a number into it.
pub(super) fn unit_and_factor(written: &str) -> Option<(&'static str, f64)> {
    let word = bare(written);
    table().into_iter().find(|(words, _, _)| words.contains(&word.as_str())).map(|(_, unit, factor)| (unit, factor))
}

/// Whether a word is a unit.
pub(super) fn is_unit(written: &str) -> bool {
    let word = bare(written);
    word.is_empty() || KEPT.contains(&word.as_str()) || unit_and_factor(&word).is_some()
}

/// The unit in a name: `Time [ms]`, `Zeit (s)`, `time_s`.
pub(super) fn unit_in_name(name: &str) -> Option<&str> {
    let name = name.trim();
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let (Some(start), true) = (name.rfind(open), name.ends_with(close)) {
            return Some(&name[start + 1..name.len() - 1]).filter(|unit| is_unit(unit));
        }
    }
    let ending = name.rsplit(['_', ' ']).next().filter(|ending| *ending != name);
    ending.filter(|ending| matches!(*ending, "s" | "ms" | "us" | "ns"))
}

fn bare(written: &str) -> String {
    written.trim().trim_matches(|c| "[]()".contains(c)).trim().to_lowercase()
}
