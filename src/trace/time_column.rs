//! When the rows of a table were taken.
//!
//! In: names, units and first rows; `--time NAME`, `--time NAME:SECONDS` or `--time SECONDS`. Out: [`TimeColumn`], which gives each row a
//! time that is later than the one before, or passes the row over and counts it; a column that is called time and runs backwards is refused
//! instead of another one being taken. Says how it was found.

use super::delimited::Dialect;
use super::faults::{Faults, TIME_MAX_S};
use super::import::ImportOptions;
use super::instants::{DAY_S, instant_s, without_date};
use super::unit_words::{unit_and_factor, unit_in_name};
use crate::base::Diagnostic;
use crate::base::diagnostics::nearest;

/// Names of time columns, in lower case and without unit; the first that is there is taken.
const NAMES: [&str; 12] = [
    "time",
    "t",
    "zeit",
    "timestamp",
    "zeitstempel",
    "timestamps",
    "datetime",
    "date",
    "cycle",
    "hfprobecounter",
    "sample",
    "n",
];
/// Of these, names that mean nothing but the time: one that does not run forward is a fault of the table.
const CERTAIN: [&str; 6] = ["time", "zeit", "timestamp", "zeitstempel", "timestamps", "datetime"];
/// A counter of position cycles without a period: the usual one.
const CYCLE_S: f64 = 0.002;

/// What is said of a row that is left out.
pub(super) const NOT_LATER: &str = "a row is not later than the one before and is left out";

/// No time can be given to the rows.
pub(super) struct Refused {
    pub(super) finding: Diagnostic,
    /// Where it is seen: a row of the sample.
    pub(super) row: Option<usize>,
}

impl From<Diagnostic> for Refused {
    fn from(finding: Diagnostic) -> Self {
        Self { finding, row: None }
    }
}

/// Gives times to rows.
pub(super) struct TimeColumn {
    /// `None`: rows are counted.
    pub(super) cell: Option<usize>,
    scale_s: f64,
    dates: bool,
    start_s: Option<f64>,
    last_s: Option<f64>,
    /// Days that have passed since the first row, of times without a date.
    midnights_s: f64,
    row: u64,
    /// How it was found, for people.
    pub(super) description: String,
}

impl TimeColumn {
    pub(super) fn find(
        names: &[String],
        units: Option<&[String]>,
        sample: &[Vec<String>],
        dialect: &Dialect,
        options: &ImportOptions,
        shown: &str,
    ) -> Result<Self, Refused> {
        if let Some(period_s) = options.time_column.as_deref().and_then(|text| text.parse::<f64>().ok())
            && !names.iter().any(|name| Some(name.as_str()) == options.time_column.as_deref())
        {
            if !(period_s > 0.0 && period_s.is_finite()) {
                let message = format!("`--time {period_s}` is no distance of two rows in s");
                let help = "write --time 0.002, or the name of the time column";
                return Err(Diagnostic::error("T0019", message).help(help).into());
            }
            let description = format!("rows every {period_s} s, as given with --time");
            return Ok(Self { cell: None, ..Self::new(None, period_s, false, description) });
        }
        let (cell, given_s) = Self::choose(names, sample, dialect, options, shown)?;
        let name = &names[cell];
        let dates = sample.iter().filter_map(|row| row.get(cell)).any(|text| instant_s(text).is_some());
        if dates && sample.iter().filter_map(|row| row.get(cell)).any(|text| without_date(text)) {
            let description = format!("time column `{name}`, times of day");
            return Ok(Self::new(Some(cell), 1.0, true, description));
        }
        if dates {
            let description = format!("time column `{name}`, dates");
            return Ok(Self::new(Some(cell), 1.0, true, description));
        }
        let written = units.and_then(|units| units.get(cell)).filter(|unit| !unit.is_empty()).map(String::as_str);
        let said = written.or_else(|| unit_in_name(name)).and_then(unit_and_factor).filter(|(unit, _)| *unit == "s");
        let counter = matches!(stem(name).as_str(), "cycle" | "hfprobecounter");
        let (scale_s, how) = match (given_s, said) {
            (Some(scale_s), _) => (scale_s, format!("times {scale_s} s, as given")),
            (None, Some((_, scale_s))) => {
                (scale_s, format!("in {}", written.or_else(|| unit_in_name(name)).unwrap_or("s")))
            }
            (None, None) if counter => {
                (CYCLE_S, format!("position cycles of {CYCLE_S} s (else give --time {name}:SECONDS)"))
            }
            (None, None) => (1.0, format!("taken as s, because no unit is said (else give --time {name}:0.001)")),
        };
        Ok(Self::new(Some(cell), scale_s, false, format!("time column `{name}` {how}")))
    }

    fn new(cell: Option<usize>, scale_s: f64, dates: bool, description: String) -> Self {
        Self { cell, scale_s, dates, start_s: None, last_s: None, midnights_s: 0.0, row: 0, description }
    }

    /// The column, and the seconds that one of its units is, if the user said so.
    fn choose(
        names: &[String],
        sample: &[Vec<String>],
        dialect: &Dialect,
        options: &ImportOptions,
        shown: &str,
    ) -> Result<(usize, Option<f64>), Refused> {
        if let Some(asked) = &options.time_column {
            if let Some(cell) = names.iter().position(|name| name == asked) {
                return match Run::of(sample, cell, dialect) {
                    Run::Backward(row) => Err(backwards(asked, row, shown)),
                    _ => Ok((cell, None)),
                };
            }
            if let Some((name, scale)) = asked.rsplit_once(':')
                && let (Some(cell), Ok(scale_s)) = (names.iter().position(|known| known == name), scale.parse::<f64>())
                && scale_s > 0.0
                && scale_s.is_finite()
            {
                return Ok((cell, Some(scale_s)));
            }
            let near = nearest(asked, names.iter().map(String::as_str));
            let help =
                near.map_or_else(|| format!("it has {}", names.join(", ")), |near| format!("did you mean `{near}`?"));
            return Err(Diagnostic::error("T0015", format!("{shown} has no column `{asked}`")).help(help).into());
        }
        let stems: Vec<String> = names.iter().map(|name| stem(name)).collect();
        let run = |cell: usize| Run::of(sample, cell, dialect);
        let called = |known: &&str| (0..stems.len()).find(|cell| stems[*cell] == **known);
        // Times with few digits repeat: what is called so must only not run backwards.
        let forward = |cell: usize| matches!(run(cell), Run::Forward | Run::Repeats);
        let by_name =
            NAMES.iter().find_map(|known| (0..stems.len()).find(|cell| stems[*cell] == *known && forward(*cell)));
        if by_name.is_none()
            && let Some((cell, Run::Backward(row))) = CERTAIN.iter().find_map(called).map(|cell| (cell, run(cell)))
        {
            return Err(backwards(&names[cell], row, shown));
        }
        let found = by_name.or_else(|| (0..names.len()).find(|cell| run(*cell) == Run::Forward));
        found.map(|cell| (cell, None)).ok_or_else(|| {
            let message =
                format!("{shown} has no column that could be the time: none is called so, and none increases");
            let help = "name it with --time NAME, or give the distance of the rows in s with --time 0.002";
            Diagnostic::error("T0015", message).help(help).into()
        })
    }

    /// Time of a row; `None`: the row is passed over.
    pub(super) fn next(&mut self, row: &[String], dialect: &Dialect, at: u64, faults: &mut Faults) -> Option<f64> {
        self.row += 1;
        let Some(cell) = self.cell else {
            return Some((self.row - 1) as f64 * self.scale_s);
        };
        let text = row.get(cell).map_or("", String::as_str);
        let read = if self.dates { instant_s(text) } else { dialect.number(text) };
        let Some(mut time_s) = read.filter(|time| time.is_finite()) else {
            faults.count("T0009", "a row has no time and is left out", at);
            return None;
        };
        if self.dates {
            if without_date(text) {
                // At midnight the day begins again.
                time_s += self.midnights_s;
                if self.last_s.zip(self.start_s).is_some_and(|(last, start)| last + start - time_s > DAY_S / 2.0) {
                    self.midnights_s += DAY_S;
                    time_s += DAY_S;
                }
            }
            let start_s = *self.start_s.get_or_insert(time_s);
            // Dates have microseconds; the difference of two large numbers has more digits than that.
            time_s = ((time_s - start_s) * 1e6).round() / 1e6;
        } else if self.scale_s < 1.0 {
            // Division by a whole number of units a second is exact where multiplication is not: 3 ms is 0.003 s.
            let per_s = (1.0 / self.scale_s).round();
            let exact = (1.0 / per_s - self.scale_s).abs() < f64::EPSILON * self.scale_s;
            time_s = if exact { time_s / per_s } else { time_s * self.scale_s };
        } else {
            time_s *= self.scale_s;
        }
        if time_s.abs() >= TIME_MAX_S {
            faults.count("T0009", "a row has no sensible time and is left out", at);
            return None;
        }
        if self.last_s.is_some_and(|last_s| time_s <= last_s) {
            faults.count("T0009", NOT_LATER, at);
            return None;
        }
        self.last_s = Some(time_s);
        Some(time_s)
    }

    /// Distance of the first rows.
    pub(super) fn period_s(&self, sample: &[Vec<String>], dialect: &Dialect) -> Option<f64> {
        let cell = self.cell?;
        let times = sample.iter().filter_map(|row| {
            let text = row.get(cell)?;
            if self.dates { instant_s(text) } else { dialect.number(text).map(|value| value * self.scale_s) }
        });
        let times: Vec<f64> = times.filter(|time| time.is_finite()).collect();
        let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
        steps.sort_by(f64::total_cmp);
        steps.get(steps.len() / 2).copied()
    }
}

/// Name in lower case without unit: `Time [ms]`, `time_s` -> `time`.
fn stem(name: &str) -> String {
    let bare = match unit_in_name(name) {
        Some(unit) => name.trim().trim_end_matches([']', ')']).strip_suffix(unit).unwrap_or(name),
        None => name,
    };
    bare.trim_end_matches(['[', '(', '_', ' ']).trim_start_matches('#').trim().to_lowercase()
}

/// How the numbers or dates of a column run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Run {
    /// From row to row they increase, but for a step here and there, which is a fault of the file, not of the choice.
    Forward,
    /// They never decrease, but stay for some rows.
    Repeats,
    /// They do not increase; the row that is first not later than the one before, from 0.
    Backward(usize),
    /// They are no numbers.
    Nothing,
}

impl Run {
    fn of(sample: &[Vec<String>], cell: usize, dialect: &Dialect) -> Self {
        let read = |(place, row): (usize, &Vec<String>)| {
            let text = row.get(cell)?;
            let value = instant_s(text).or_else(|| dialect.number(text).filter(|value| value.is_finite()))?;
            Some((place, value))
        };
        let values: Vec<(usize, f64)> = sample.iter().enumerate().filter_map(read).collect();
        if values.is_empty() || values.len() * 10 < sample.len() * 9 {
            return Self::Nothing;
        }
        let steps = values.len() - 1;
        let forward = values.windows(2).filter(|pair| pair[1].1 > pair[0].1).count();
        let backward = values.windows(2).filter(|pair| pair[1].1 < pair[0].1).count();
        let first = values.windows(2).find(|pair| pair[1].1 <= pair[0].1).map_or(0, |pair| pair[1].0);
        match () {
            () if steps == 0 || (forward > 0 && forward * 10 >= steps * 9) => Self::Forward,
            () if backward == 0 && forward > 0 => Self::Repeats,
            () => Self::Backward(first),
        }
    }
}

/// A column that is called time does not run forward. `row` counts from the first row of numbers.
fn backwards(name: &str, row: usize, shown: &str) -> Refused {
    let message = format!("the time column `{name}` of {shown} does not run forward");
    let help = format!(
        "sort the rows by `{name}`, name another column with --time NAME, or give the distance of the rows in s with --time 0.002"
    );
    Refused { finding: Diagnostic::error("T0009", message).help(help), row: Some(row) }
}
