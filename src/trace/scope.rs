//! LinuxCNC halscope and halsampler -> rows.
//!
//! In: a text. Out: heads and rows for a [`Sink`]. halscope says its period, in the form of today (`# Sampling period is 1000000 ns`, a row of
//! names, rows of values) and in that of LinuxCNC up to 2.8 (`Sampling period is 100000 nSec`, every value behind its name). halsampler does
//! not: `--time SECONDS` gives it, 1 ms is assumed else. Streams: memory holds one row.

use super::columns::named_head;
use super::delimited::{cells, number};
use super::faults::Faults;
use super::import::{About, ImportOptions};
use super::naming::{NamedHead, Naming};
use super::sink::{Head, Sink};
use super::source::{PartReader, Source};
use super::wire::{Clock, Origin, TraceFormat};
use crate::base::Diagnostic;
use crate::base::units::NS_PER_S;

/// The usual servo thread of LinuxCNC.
const SERVO_THREAD_S: f64 = 0.001;

/// A text line by line.
pub(super) struct Lines<'a> {
    source: &'a Source<'a>,
    part: usize,
    reader: PartReader<'a>,
    pub(super) line: String,
    /// Byte at which the line begins.
    pub(super) at: u64,
}

impl<'a> Lines<'a> {
    pub(super) fn new(source: &'a Source<'a>, part: usize) -> Result<Self, Diagnostic> {
        Ok(Self { source, part, reader: source.read(part)?, line: String::new(), at: 0 })
    }

    pub(super) fn advance(&mut self) -> Result<bool, Diagnostic> {
        self.at = self.reader.consumed();
        let Self { source, part, reader, line, at } = self;
        reader.line(line).map_err(|error| source.unreadable_at(*part, *at, &error))
    }

    pub(super) fn notes(&self, faults: &Faults, naming: &mut Naming) -> Vec<Diagnostic> {
        let mut notes = std::mem::take(&mut naming.notes);
        if let Some(remark) = self.reader.encoding_remark() {
            notes.push(Diagnostic::note("T0014", remark));
        }
        let finding = |code: &'static str, message: String, byte: u64| {
            let finding = Diagnostic::warning(code, message);
            match self.source.place(self.part, byte, "the first one") {
                Some(place) => finding.at(place),
                None => finding,
            }
        };
        notes.extend(faults.findings(finding));
        notes
    }

    pub(super) fn nothing(&self) -> Diagnostic {
        Diagnostic::error("T0003", format!("{} has no samples", self.source.part_name(self.part)))
    }
}

fn origin(format: TraceFormat) -> Origin {
    Origin { format, description: format.title().to_owned(), start_utc: None }
}

/// Reads what halscope saved.
pub(super) fn read_halscope(
    source: &Source,
    part: usize,
    options: &ImportOptions,
    sink: &mut dyn Sink,
) -> Result<About, Diagnostic> {
    let mut lines = Lines::new(source, part)?;
    let (mut period_s, mut paired) = (None, false);
    let names: Vec<String> = loop {
        if !lines.advance()? {
            return Err(lines.nothing());
        }
        let line = lines.line.trim();
        if let Some(rest) = line.trim_start_matches(['#', ' ']).strip_prefix("Sampling period is") {
            paired = !line.starts_with('#');
            let digits = rest.split_whitespace().next().and_then(|text| text.parse::<f64>().ok());
            period_s = digits.filter(|period| *period > 0.0).map(|period_ns| period_ns / NS_PER_S);
        } else if !line.is_empty() && !line.starts_with('#') {
            break if paired { pairs(line).map(|(name, _)| name.to_owned()).collect() } else { cells(line, ';') };
        }
    };
    let Some(period_s) = period_s else {
        let message = format!("{} does not say its sampling period in ns", source.part_name(part));
        return Err(
            Diagnostic::error("T0015", message).help("its first line should be `# Sampling period is 1000000 ns`")
        );
    };
    let mut naming = Naming::new(TraceFormat::Halscope, options);
    let named = begin_columns(&names, period_s, &mut naming, sink)?;
    let mut faults = Faults::default();
    let mut rows = 0_u64;
    let mut row = Vec::new();
    // Names and values of the older form stand in one line, so that the first one counts too.
    let mut more = if paired { true } else { lines.advance()? };
    while more {
        let line = lines.line.trim().to_owned();
        let at = lines.at;
        more = lines.advance()?;
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let texts = if paired { values_of(&line, &names) } else { Some(cells(&line, ';')) };
        let Some(texts) = texts.filter(|texts| texts.len() <= names.len()) else {
            faults.count("T0008", "a row has not the values that the first one has, and is left out", at);
            continue;
        };
        row.clear();
        for (place, (text, named)) in texts.iter().zip(&named).enumerate() {
            let value = number(text, true).unwrap_or_else(|| {
                faults.count("T0010", "a value is no number: a gap", at);
                f64::NAN
            });
            row.push((place, value * named.factor));
        }
        sink.row(at_row(rows, period_s), &row)?;
        rows += 1;
    }
    if rows == 0 {
        return Err(lines.nothing());
    }
    let notes = lines.notes(&faults, &mut naming);
    Ok(About { origin: origin(TraceFormat::Halscope), notes, ..About::default() })
}

/// Names and values of a line of the older form.
fn pairs(line: &str) -> impl Iterator<Item = (&str, &str)> {
    let mut words = line.split_whitespace();
    std::iter::from_fn(move || Some((words.next()?, words.next()?)))
}

/// Values of a line that has the names it should have.
fn values_of(line: &str, names: &[String]) -> Option<Vec<String>> {
    let fits = pairs(line).map(|(name, _)| name).eq(names.iter().map(String::as_str));
    fits.then(|| pairs(line).map(|(_, value)| value.to_owned()).collect())
}

/// Whole nanoseconds where the period is one.
fn at_row(row: u64, period_s: f64) -> f64 {
    let period_ns = period_s * NS_PER_S;
    let whole = period_ns.round();
    if (whole - period_ns).abs() < 1e-3 { row as f64 * whole / NS_PER_S } else { row as f64 * period_s }
}

fn begin_columns(
    names: &[String],
    period_s: f64,
    naming: &mut Naming,
    sink: &mut dyn Sink,
) -> Result<Vec<NamedHead>, Diagnostic> {
    let mut named: Vec<NamedHead> = names.iter().map(|name| named_head(name, None, false, naming)).collect();
    naming.settle(&mut named);
    let head = |named: &NamedHead| Head { clock: Clock::Servo, period_s: Some(period_s), ..named.head.clone() };
    let heads: Vec<Head> = named.iter().map(head).collect();
    sink.begin(&heads)?;
    Ok(named)
}

/// Reads what halsampler wrote.
pub(super) fn read_halsampler(
    source: &Source,
    part: usize,
    options: &ImportOptions,
    sink: &mut dyn Sink,
) -> Result<About, Diagnostic> {
    let given = options.time_column.as_deref().and_then(|text| text.parse::<f64>().ok());
    let period_s = given.filter(|period| *period > 0.0 && period.is_finite()).unwrap_or(SERVO_THREAD_S);
    let mut naming = Naming::new(TraceFormat::Halsampler, options);
    if given.is_none() {
        let message = format!("halsampler does not say its period: {period_s} s is assumed");
        naming.notes.push(Diagnostic::warning("T0015", message).help("give it with --time 0.001"));
    }
    let numbered = has_numbers(source, part)?;
    let mut lines = Lines::new(source, part)?;
    let (mut columns, mut next, mut rows) = (Vec::new(), 0_u64, 0_u64);
    let mut first = None;
    let mut faults = Faults::default();
    while lines.advance()? {
        let line = lines.line.trim().to_owned();
        if line == "overrun" {
            faults.count("T0013", "samples were lost (overrun): a gap", lines.at);
            if !numbered && rows > 0 {
                let gap: Vec<(usize, f64)> = (0..columns.len()).map(|column| (column, f64::NAN)).collect();
                sink.row(at_row(next, period_s), &gap)?;
                next += 1;
            }
            continue;
        }
        let values: Vec<f64> = line.split_whitespace().map(|text| text.parse().unwrap_or(f64::NAN)).collect();
        let (place, values) = match values.split_first() {
            None => continue,
            Some((number, rest)) if numbered => {
                let number = number.max(0.0) as u64;
                (number - *first.get_or_insert(number).min(&mut number.clone()), rest.to_vec())
            }
            Some(_) => (next, values),
        };
        if columns.is_empty() {
            let names: Vec<String> = (1..=values.len()).map(|column| format!("column {column}")).collect();
            columns = begin_columns(&names, period_s, &mut naming, sink)?;
        }
        if rows > 0 && place < next {
            faults.count("T0009", "a sample is not later than the one before and is left out", lines.at);
            continue;
        }
        if rows > 0 && place > next {
            let gap: Vec<(usize, f64)> = (0..columns.len()).map(|column| (column, f64::NAN)).collect();
            sink.row(at_row(next, period_s), &gap)?;
        }
        let row: Vec<(usize, f64)> = values.into_iter().take(columns.len()).enumerate().collect();
        sink.row(at_row(place, period_s), &row)?;
        next = place + 1;
        rows += 1;
    }
    if rows == 0 {
        return Err(lines.nothing());
    }
    let notes = lines.notes(&faults, &mut naming);
    Ok(About { origin: origin(TraceFormat::Halsampler), notes, ..About::default() })
}

/// Whether the first column counts the samples (`halsampler -t`).
fn has_numbers(source: &Source, part: usize) -> Result<bool, Diagnostic> {
    let mut lines = Lines::new(source, part)?;
    let mut numbers: Vec<f64> = Vec::new();
    while numbers.len() < 20 && lines.advance()? {
        let mut words = lines.line.split_whitespace();
        if let (Some(first), Some(_)) = (words.next().and_then(|text| text.parse::<f64>().ok()), words.next()) {
            numbers.push(first);
        }
    }
    let counts = numbers.windows(2).filter(|pair| pair[1] - pair[0] == 1.0).count();
    Ok(numbers.len() > 1 && numbers.iter().all(|number| number.fract() == 0.0) && 2 * counts >= numbers.len() - 1)
}
