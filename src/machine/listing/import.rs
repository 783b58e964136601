//! From machine data to a machine file.
//!
//! In: [`ListingFile`]s, the user's choice of names, a machine that fills gaps. Out: [`Imported`]: the text of a machine file that passes
//! its checks, and of every key where its value comes from. Order of trust: a datum; a comment of ours; what follows from data by a rule
//! that is not certain; the other machine; a value assumed. Writes no file.

use super::data::{Listing, Spot};
use super::{ListingFile, axes, beyond, drives, five_axis, lines, scalar, special, write};
use crate::base::Diagnostic;
use crate::base::diagnostics::SourceText;
use crate::machine::catalogue::tables;
use crate::machine::keys::{Accepts, Key, TableKeys};
use crate::machine::load::{Loaded, parse};
use std::collections::BTreeMap;

/// Where a value comes from, the surest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// A machine datum or drive parameter, converted.
    Datum,
    /// A comment of ours in the listing.
    Carried,
    /// Follows from data, by a rule that may be wrong.
    Derived,
    /// The other machine.
    Base,
    /// Neither data nor machine say so.
    Assumed,
}

/// A key of the new file.
#[derive(Clone, Debug, PartialEq)]
pub struct Sourced {
    /// As in the file.
    pub value: String,
    /// How sure it is.
    pub origin: Origin,
    /// What it was made of, for people.
    pub source: String,
}

/// Machine data without counterpart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unknown {
    /// As written, without index: `N11660 $MN_NUM_EG`.
    pub datum: String,
    /// Assignments.
    pub count: usize,
}

/// `AX1=X`: an axis of the control and its name in programs, or a drive object and its axis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AxisChoice {
    /// On the control.
    pub theirs: String,
    /// In the machine file.
    pub ours: String,
}

/// What the user decides.
#[derive(Clone, Debug, Default)]
pub struct ImportOptions {
    /// Names of axes, `AX1` or `X1` to `X`.
    pub axes: Vec<AxisChoice>,
    /// Drive objects of axes: `theirs` is p0199 or the name of the member.
    pub drives: Vec<AxisChoice>,
    /// A machine that fills gaps: its name and text.
    pub base: Option<(String, String)>,
    /// Name of the new machine.
    pub name: Option<String>,
    /// Its name if nothing else names it: that of the file.
    pub stand_in: Option<String>,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The machine file, with the source of every value beside it.
    pub text: String,
    /// The machine.
    pub loaded: Loaded,
    /// Every key of the file, by its path.
    pub values: BTreeMap<String, Sourced>,
    /// Most frequent first.
    pub unknown: Vec<Unknown>,
    /// What a person should know.
    pub warnings: Vec<Diagnostic>,
}

/// The machine in the making.
pub(super) struct Draft<'l> {
    pub listing: &'l mut Listing,
    pub options: &'l ImportOptions,
    pub values: BTreeMap<String, Sourced>,
    pub warnings: Vec<Diagnostic>,
}

/// Two numbers are the same datum: a listing rounds.
const SAME_RATIO: f64 = 1e-9;

/// Imports. Errors: unreadable files, listings in units of their own, values that make no machine.
pub fn import_listing(files: &[ListingFile], options: &ImportOptions) -> Result<Imported, Vec<Diagnostic>> {
    let mut listing = lines::read(files)?;
    let mut draft = Draft { listing: &mut listing, options, values: BTreeMap::new(), warnings: Vec::new() };
    for (key, (value, spot)) in draft.listing.carried.clone() {
        if key_row(&key).is_none() {
            let finding =
                Diagnostic::warning("M0308", format!("a comment names the key {key}, which no machine file has"));
            draft.warnings.push(spot.mark(finding, "passed over"));
            continue;
        }
        let source = format!("{}:{}", spot.file, spot.line);
        draft.put(&key, value, Origin::Carried, source);
    }
    let units = beyond::units(&mut draft).map_err(|finding| vec![finding])?;
    draft.fill(&units)?;
    beyond::passed_over(&mut draft);
    let Draft { values, mut warnings, .. } = draft;
    let text = write::text(&values);
    let name = options.name.as_ref().or(options.stand_in.as_ref()).map_or("imported machine", String::as_str);
    let loaded = parse(&SourceText::new(format!("{name}.toml"), text.as_str()), &[])?;
    warnings.extend(loaded.warnings.iter().cloned());
    let mut unknown: Vec<Unknown> =
        listing.unused().into_iter().map(|(datum, count)| Unknown { datum, count }).collect();
    unknown.sort_by(|one, other| other.count.cmp(&one.count).then(one.datum.cmp(&other.datum)));
    if !listing.binary.is_empty() {
        let message = format!("compiled members are not read: {}", listing.binary.join(", "));
        let help = "save the drives of the archive as ASCII to have their parameters";
        warnings.push(Diagnostic::warning("M0307", message).help(help));
    }
    Ok(Imported { text, loaded, values, unknown, warnings })
}

impl Draft<'_> {
    fn fill(&mut self, units: &beyond::Units) -> Result<(), Vec<Diagnostic>> {
        let axes = axes::find(self)?;
        if let Some(inch_mm) = units.inch_mm {
            beyond::from_inches(self, &axes, inch_mm);
        }
        scalar::control(self);
        special::control(self, &axes);
        for axis in &axes {
            scalar::axis(self, axis, units.gain_per_s);
            special::axis(self, axis);
        }
        five_axis::import(self, &axes);
        beyond::axes(self, &axes);
        drives::all(self, &axes);
        special::finish(self, &axes);
        if let Some((name, text)) = &self.options.base {
            // Axes that the control does not have stay away, and with them a kinematic chain that needs them.
            let known = |axis: &str| axes.iter().any(|found| found.ours == axis);
            let flat = write::flat(text);
            let axis_of =
                |key: &str| key.strip_prefix("axes.").and_then(|rest| rest.split('.').next()).map(str::to_owned);
            let whole = flat.iter().filter_map(|(key, _)| axis_of(key)).all(|axis| known(&axis));
            for (key, value) in flat {
                let fits = match axis_of(&key) {
                    Some(axis) => known(&axis) && !key.ends_with(".index") && !key.ends_with(".machine_axis"),
                    // The sampling factor belongs to its own control cycle.
                    None if key == "cycle.f_s" => !self.values.contains_key("cycle.t_cyl_ms"),
                    None => whole || !key.starts_with("kinematics."),
                };
                if fits {
                    self.put(&key, value, Origin::Base, format!("from {name}"));
                }
            }
        }
        special::assume(self, &axes);
        Ok(())
    }

    /// Sets a key unless something surer has set it. A carried number that agrees with a datum is the more exact one.
    pub fn put(&mut self, key: &str, value: String, origin: Origin, source: String) {
        match self.values.get_mut(key) {
            Some(old) if old.origin < origin => {}
            Some(old) if old.origin == Origin::Carried && origin == Origin::Datum => {
                if same(&old.value, &value) {
                    *old = Sourced { value: old.value.clone(), origin, source };
                } else {
                    let message = format!(
                        "{key}: {source} says {value}, the comment {} says {}: the datum counts",
                        old.source, old.value
                    );
                    self.warnings.push(Diagnostic::note("M0308", message));
                    *old = Sourced { value, origin, source };
                }
            }
            _ => {
                self.values.insert(key.to_owned(), Sourced { value, origin, source });
            }
        }
    }

    /// Sets a number, if the key allows it; else says so. `spot`: where the datum stands.
    pub fn put_number(&mut self, key: &str, value: f64, origin: Origin, source: &str, spot: Option<&Spot>) {
        let Some(row) = key_row(key) else { return };
        let fits = match row.accepts {
            Accepts::Number(range) => range.holds(value),
            Accepts::Whole(least, most) => {
                value.fract() == 0.0 && (f64::from(least)..=f64::from(most)).contains(&value)
            }
            _ => false,
        };
        if !fits {
            let message = format!("{source} makes {key} = {value}, which a machine file cannot hold: not used");
            let finding = Diagnostic::warning("M0306", message).help(format!("{key} is {}", row.describe_range()));
            self.warnings.push(match spot {
                Some(spot) => spot.mark(finding, ""),
                None => finding,
            });
            return;
        }
        let text = if matches!(row.accepts, Accepts::Whole(..)) { format!("{value:.0}") } else { write::number(value) };
        self.put(key, text, origin, source.to_owned());
    }

    /// Sets a word.
    pub fn put_word(&mut self, key: &str, word: &str, origin: Origin, source: &str) {
        self.put(key, format!("\"{}\"", word.escape_default()), origin, source.to_owned());
    }

    /// Sets `true` or `false`.
    pub fn put_flag(&mut self, key: &str, flag: bool, origin: Origin, source: &str) {
        self.put(key, flag.to_string(), origin, source.to_owned());
    }

    /// A number that is set already.
    pub fn number_of(&self, key: &str) -> Option<f64> {
        self.values.get(key)?.value.parse().ok()
    }

    /// A word that is set already, without quotes.
    pub fn word_of(&self, key: &str) -> Option<&str> {
        self.values.get(key).map(|sourced| sourced.value.trim_matches('"'))
    }
}

fn same(one: &str, other: &str) -> bool {
    match (one.parse::<f64>(), other.parse::<f64>()) {
        (Ok(one), Ok(other)) => one == other || (one - other).abs() <= SAME_RATIO * one.abs().max(other.abs()),
        _ => one == other,
    }
}

/// The table of the catalogue in which a key stands, and the key.
pub(super) fn table_and_key(path: &str) -> Option<(&'static TableKeys, &str)> {
    let (table, key) = path.rsplit_once('.').unwrap_or(("", path));
    let words: Vec<&str> = if table.is_empty() { Vec::new() } else { table.split('.').collect() };
    let found = tables().iter().find(|known| {
        let pattern: Vec<&str> = if known.path.is_empty() { Vec::new() } else { known.path.split('.').collect() };
        pattern.len() == words.len() && pattern.iter().zip(&words).all(|(one, other)| *one == "*" || one == other)
    })?;
    Some((found, key))
}

/// The row of the catalogue.
pub(super) fn key_row(path: &str) -> Option<&'static Key> {
    let (table, key) = table_and_key(path)?;
    table.keys.iter().find(|row| row.name == key)
}
