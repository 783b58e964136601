//! Lines of a table and how they are written: separator, decimal sign, where the data begin, which row has the units.
//!
//! In: the first lines of a text. Out: [`Dialect`]; cells of a line; numbers. A comma inside of brackets does not separate, because
//! names of signals hold some: `/Nck/!SD/nckServoDataFlwErr64 [u1, 7]`. Does not know signals.

/// Lines that are looked at before the reading begins.
pub(super) const LOOK_AHEAD_LINES: usize = 200;

/// How a table is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Dialect {
    pub(super) separator: char,
    pub(super) decimal_comma: bool,
    /// Line of the names, from 0; `None`: there is none.
    pub(super) header: Option<usize>,
    /// Line of the units.
    pub(super) units: Option<usize>,
    /// First line of numbers.
    pub(super) data: usize,
    pub(super) columns: usize,
}

impl Dialect {
    /// Finds out how a table is written; `None`: the lines are no table of numbers.
    pub(super) fn find(lines: &[String]) -> Option<Self> {
        let candidates = [';', '\t', ',', ' '].into_iter();
        let fits = candidates.filter_map(|separator| Self::with_separator(lines, separator));
        // The separator that explains most lines; of equals the first, so that `1,5;2,5` is not four numbers.
        fits.max_by_key(|(explained, dialect)| (*explained, std::cmp::Reverse(rank(dialect.separator))))
            .map(|(_, dialect)| dialect)
    }

    fn with_separator(lines: &[String], separator: char) -> Option<(usize, Self)> {
        let rows: Vec<Vec<String>> = lines.iter().map(|line| cells(line, separator)).collect();
        let data = (0..rows.len()).find(|at| {
            let width = rows[*at].len();
            let alike = rows[*at..].iter().take(3).all(|row| row.len().abs_diff(width) <= 1 && numeric(row, separator));
            alike && (width > 1 || separator == ',')
        })?;
        let columns = rows[data..].iter().map(Vec::len).max()?;
        let explained = rows[data..].iter().filter(|row| row.len() == columns && numeric(row, separator)).count();
        // One column needs no separator: lines of numbers, and nothing else, or any text with a number in it would be a table.
        let lonely =
            columns == 1 && (2 * explained < rows.len() || lines[data..].iter().any(|l| l.contains([';', '\t'])));
        if lonely {
            return None;
        }
        let decimal_comma = separator != ',' && rows[data..].iter().flatten().any(|cell| is_decimal_comma(cell));
        let above =
            |at: usize| at.checked_sub(1).filter(|at| rows[*at].len().abs_diff(columns) <= 1 && names(&rows[*at]));
        let (header, units) = match above(data) {
            Some(near) if unit_row(&rows[near]) => match above(near) {
                Some(far) => (Some(far), Some(near)),
                None => (Some(near), None),
            },
            other => (other, None),
        };
        Some((explained, Self { separator, decimal_comma, header, units, data, columns }))
    }

    /// For people.
    pub(super) fn description(&self) -> String {
        let separator = match self.separator {
            ';' => "semicolons",
            '\t' => "tabulators",
            ',' => "commas",
            _ => "blanks",
        };
        let decimal = if self.decimal_comma { "decimal comma" } else { "decimal point" };
        let header = match (self.header, self.units) {
            (Some(header), Some(units)) => format!("names in line {}, units in line {}", header + 1, units + 1),
            (Some(header), None) => format!("names in line {}, no units row", header + 1),
            (None, _) => "no names".to_owned(),
        };
        format!("separated by {separator}, {decimal}, {header}")
    }

    /// A number of a cell: NaN for an empty one, `None` for a word.
    pub(super) fn number(&self, cell: &str) -> Option<f64> {
        number(cell, self.decimal_comma)
    }
}

fn rank(separator: char) -> usize {
    [';', '\t', ',', ' '].iter().position(|known| *known == separator).unwrap_or(usize::MAX)
}

/// Cells of a line: in quotation marks anything may stand, and a doubled mark is one.
pub(super) fn cells(line: &str, separator: char) -> Vec<String> {
    if separator == ' ' {
        return line.split_whitespace().map(str::to_owned).collect();
    }
    let mut cells = Vec::new();
    let mut cell = String::new();
    let (mut quoted, mut brackets) = (false, 0_usize);
    let mut characters = line.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            '"' if quoted && characters.peek() == Some(&'"') => {
                cell.push('"');
                characters.next();
            }
            '"' => quoted = !quoted,
            '[' if !quoted => {
                brackets += 1;
                cell.push(character);
            }
            ']' if !quoted => {
                brackets = brackets.saturating_sub(1);
                cell.push(character);
            }
            _ if character == separator && !quoted && brackets == 0 => {
                cells.push(std::mem::take(&mut cell).trim().to_owned());
            }
            _ => cell.push(character),
        }
    }
    cells.push(cell.trim().to_owned());
    cells
}

/// A number: NaN for an empty cell, `None` for a word.
pub(super) fn number(cell: &str, decimal_comma: bool) -> Option<f64> {
    let cell = cell.trim();
    if cell.is_empty() {
        return Some(f64::NAN);
    }
    if decimal_comma && cell.contains(',') {
        return cell.replace(',', ".").parse().ok();
    }
    match cell.parse::<f64>() {
        Ok(value) => Some(value),
        Err(_) if matches!(cell, "True" | "true" | "TRUE") => Some(1.0),
        Err(_) if matches!(cell, "False" | "false" | "FALSE") => Some(0.0),
        Err(_) => None,
    }
}

fn is_decimal_comma(cell: &str) -> bool {
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let unsigned = cell.trim_start_matches(['-', '+']);
    unsigned
        .split_once(',')
        .is_some_and(|(whole, part)| digits(whole) && digits(part.split(['e', 'E']).next().unwrap_or(part)))
}

/// At least half of the filled cells are numbers or times of day.
fn numeric(row: &[String], separator: char) -> bool {
    let filled: Vec<&String> = row.iter().filter(|cell| !cell.is_empty()).collect();
    let numbers = filled
        .iter()
        .filter(|cell| {
            number(cell, separator != ',').is_some_and(f64::is_finite) || super::instants::instant_s(cell).is_some()
        })
        .count();
    numbers > 0 && 2 * numbers >= filled.len()
}

/// A row of names: no number in it.
fn names(row: &[String]) -> bool {
    let filled = row.iter().filter(|cell| !cell.is_empty());
    let words = filled.clone().filter(|cell| number(cell, true).is_none()).count();
    words > 0 && 2 * words > filled.count()
}

/// A row in which every filled cell is a unit.
fn unit_row(row: &[String]) -> bool {
    let mut filled = row.iter().filter(|cell| !cell.is_empty()).peekable();
    filled.peek().is_some() && filled.all(|cell| super::unit_words::is_unit(cell))
}
