//! One table of a machine file, read key by key against the catalogue.
//!
//! In: a [`Node`] and the [`Key`]s that it may have. Out: values that keep their ranges, and a diagnostic for each that does not.
//! A value that is missing or wrong is reported and a stand-in returned (NaN, 0, the first word), so that one pass finds all
//! faults of a file; a machine is only handed out when nothing was reported.

use super::catalogue;
use super::choices::Choice;
use super::document::{Entry, Mark, Node, Texts, Value};
use super::keys::{Absent, Accepts, Key, MotorKind, Range, TableKeys, quoted_list};
use crate::base::AxisKind;
use crate::base::diagnostics::{Diagnostic, Severity, nearest};
use std::cell::RefCell;

/// Gathers what is wrong with a file.
pub(super) struct Findings<'t> {
    pub texts: &'t Texts,
    list: RefCell<Vec<(Mark, Diagnostic)>>,
}

impl<'t> Findings<'t> {
    pub fn new(texts: &'t Texts) -> Self {
        Self { texts, list: RefCell::new(Vec::new()) }
    }

    /// Reports at a place.
    pub fn report(&self, mark: &Mark, label: &str, diagnostic: Diagnostic) {
        self.list.borrow_mut().push((mark.clone(), diagnostic.at(self.texts.place(mark, label))));
    }

    pub fn any_error(&self) -> bool {
        self.list.borrow().iter().any(|(_, diagnostic)| diagnostic.severity == Severity::Error)
    }

    /// In the order of the file.
    pub fn into_sorted(self) -> Vec<Diagnostic> {
        let mut list = self.list.into_inner();
        list.sort_by_key(|(mark, _)| (mark.source, mark.span.start));
        list.into_iter().map(|(_, diagnostic)| diagnostic).collect()
    }
}

/// A table being read.
#[derive(Clone)]
pub(super) struct Section<'f> {
    findings: &'f Findings<'f>,
    keys: &'static TableKeys,
    kind: Option<AxisKind>,
    motor: Option<MotorKind>,
    /// The table is missing, and that was reported: its keys need no report of their own.
    quiet: bool,
    /// Dotted path as a person writes it, such as `axes.X.drive`.
    pub path: String,
    entries: &'f [Entry],
    /// Where the table begins.
    pub mark: Mark,
}

impl<'f> Section<'f> {
    /// The table at the top of the file; reports its unknown keys.
    pub fn root(findings: &'f Findings<'f>, node: &'f Node) -> Self {
        let mark = node.mark.clone();
        let (keys, path) = (table_keys(""), String::new());
        let root = Self { findings, keys, kind: None, motor: None, quiet: false, path, entries: &[], mark };
        root.filled(node)
    }

    /// The table `name` inside this one; without it, an empty one. `pattern` is its path in the catalogue.
    pub fn table(&self, name: &str, pattern: &'static str) -> Self {
        let empty = Self {
            findings: self.findings,
            keys: table_keys(pattern),
            kind: self.kind,
            motor: self.motor,
            quiet: false,
            path: self.full(name),
            entries: &[],
            mark: self.mark.clone(),
        };
        match self.entry(name) {
            Some(entry) => Self { mark: entry.key_mark.clone(), ..empty }.filled(&entry.node),
            None => empty,
        }
    }

    /// As `table`, for a table whose absence has been reported already.
    pub fn table_reported_if_missing(&self, name: &str, pattern: &'static str) -> Self {
        Self { quiet: !self.has(name), ..self.table(name, pattern) }
    }

    /// A table that stands in a list.
    pub fn item(&self, name: &str, place: usize, node: &'f Node, pattern: &'static str) -> Self {
        let path = format!("{}[{place}]", self.full(name));
        Self { keys: table_keys(pattern), path, entries: &[], mark: node.mark.clone(), ..self.clone() }.filled(node)
    }

    fn filled(mut self, node: &'f Node) -> Self {
        match node.entries() {
            Some(entries) => {
                self.entries = entries;
                // An axis' keys depend on its kind, which is not known yet: `with_kind` checks them.
                if self.keys.path != "axes.*" {
                    self.check_keys();
                }
            }
            None => {
                let message = format!("{} must be a table, found {}", self.path, node.value.describe());
                self.report(&node.mark, "expected a table", Diagnostic::error("M0005", message));
            }
        }
        self
    }

    /// The axis' kind decides which keys it may have; reports the others.
    pub fn with_kind(mut self, kind: AxisKind) -> Self {
        self.kind = Some(kind);
        self.check_keys();
        self
    }

    /// The kind of the axis' motor decides which keys the tables of its drive may have.
    pub fn with_motor(mut self, motor: MotorKind) -> Self {
        self.motor = Some(motor);
        self
    }

    /// Kind of the axis' motor.
    pub fn motor(&self) -> MotorKind {
        self.motor.unwrap_or_default()
    }

    /// Kind of the axis that the table is about.
    pub fn kind(&self) -> Option<AxisKind> {
        self.kind
    }

    pub fn has(&self, name: &str) -> bool {
        self.entry(name).is_some()
    }

    pub fn entry(&self, name: &str) -> Option<&'f Entry> {
        self.entries.iter().find(|entry| entry.key == name)
    }

    /// Entries in the order of the file.
    pub fn entries(&self) -> &'f [Entry] {
        self.entries
    }

    /// Full dotted name of a key.
    pub fn full(&self, name: &str) -> String {
        if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) }
    }

    /// Reports at the value of a key, or at the table if it is not there.
    pub fn report_at(&self, name: &str, label: &str, diagnostic: Diagnostic) {
        let mark = self.entry(name).map_or(&self.mark, |entry| &entry.node.mark);
        self.report(mark, label, diagnostic);
    }

    pub fn report(&self, mark: &Mark, label: &str, diagnostic: Diagnostic) {
        self.findings.report(mark, label, diagnostic);
    }

    /// A number in the unit of the key, its default if it is missing; NaN after a report.
    pub fn number(&self, name: &str) -> f64 {
        self.optional_number(name).unwrap_or(f64::NAN)
    }

    /// As `number`; `None` if it is missing and has no number as default.
    pub fn optional_number(&self, name: &str) -> Option<f64> {
        let key = self.key(name);
        let Some(entry) = self.entry(name) else { return self.absent_number(key) };
        let Accepts::Number(range) = key.accepts else { return None };
        Some(self.number_in(&entry.node, &self.full(name), range, key))
    }

    fn absent_number(&self, key: &Key) -> Option<f64> {
        match key.absent {
            Absent::Number(value) => Some(value),
            Absent::Required => {
                self.missing_key(key);
                None
            }
            _ => None,
        }
    }

    /// A number of a list or of a key.
    fn number_in(&self, node: &Node, full: &str, range: Range, key: &Key) -> f64 {
        let Value::Number { value, text, .. } = &node.value else {
            self.wrong_type(node, full, "a number");
            return f64::NAN;
        };
        if range.holds(*value) {
            return *value;
        }
        let unit = if key.unit.is_empty() { String::new() } else { format!(" {}", key.unit) };
        let message = format!("{full} = {text}{unit} is out of range, allowed: {}", range.describe(key.unit));
        let machine_data = if key.machine_data.is_empty() { String::new() } else { format!(" ({})", key.machine_data) };
        let help = format!("{}: {}{machine_data}", key.name, key.help);
        let diagnostic = Diagnostic::error("M0006", message).help(help);
        self.report(&node.mark, "out of range", diagnostic);
        f64::NAN
    }

    /// A whole number; its default if it is missing, `None` after a report or without a default.
    pub fn whole(&self, name: &str) -> Option<u32> {
        let key = self.key(name);
        let Some(entry) = self.entry(name) else { return self.absent_number(key).map(|value| value as u32) };
        let Accepts::Whole(least, most) = key.accepts else { return None };
        let full = self.full(name);
        let Value::Number { value, text, whole } = &entry.node.value else {
            self.wrong_type(&entry.node, &full, "a whole number");
            return None;
        };
        if *whole && (f64::from(least)..=f64::from(most)).contains(value) {
            return Some(*value as u32);
        }
        let message = format!("{full} = {text} is out of range, allowed: {}", key.describe_range());
        self.report(&entry.node.mark, "out of range", Diagnostic::error("M0006", message).help(key.help));
        None
    }

    /// `true` or `false`.
    pub fn flag(&self, name: &str) -> bool {
        match self.entry(name).map(|entry| (&entry.node, &entry.node.value)) {
            Some((_, Value::Flag(flag))) => *flag,
            Some((node, _)) => {
                self.wrong_type(node, &self.full(name), "true or false");
                false
            }
            None => false,
        }
    }

    /// A text; its default if it is missing, `None` after a report or without a default.
    pub fn text(&self, name: &str) -> Option<&'f str> {
        let key = self.key(name);
        match self.entry(name).map(|entry| (&entry.node, &entry.node.value)) {
            Some((node, Value::Text(text))) if text.trim().is_empty() => {
                let message = format!("{} is an empty text", self.full(name));
                self.report(&node.mark, "expected a text", Diagnostic::error("M0006", message).help(key.help));
                None
            }
            Some((_, Value::Text(text))) => Some(text),
            Some((node, _)) => {
                self.wrong_type(node, &self.full(name), "a text in quotes");
                None
            }
            None => {
                if let Absent::Word(word) = key.absent {
                    return Some(word);
                }
                if key.absent == Absent::Required {
                    self.missing_key(key);
                }
                None
            }
        }
    }

    /// One of some words; the first word after a report.
    pub fn choice<T: Choice>(&self, name: &str) -> T {
        let words = || T::WORDS.iter().map(|(word, _)| *word);
        let fallback = T::WORDS[0].1;
        let key = self.key(name);
        let Some(word) = self.text(name) else { return fallback };
        if let Some((_, value)) = T::WORDS.iter().find(|(known, _)| *known == word) {
            return *value;
        }
        let all: Vec<&str> = words().collect();
        let help = match nearest(word, words()) {
            Some(near) => format!("did you mean \"{near}\"? It is {}", quoted_list(&all)),
            None => format!("{}: {}", key.help, quoted_list(&all)),
        };
        let message = format!("{} = \"{word}\" is not known, allowed: {}", self.full(name), quoted_list(&all));
        self.report_at(name, "unknown word", Diagnostic::error("M0007", message).help(help));
        fallback
    }

    /// `[lower, upper]`, lower < upper.
    pub fn interval(&self, name: &str) -> Option<[f64; 2]> {
        let [lower, upper] = self.numbers::<2>(name)?;
        if lower >= upper {
            let unit = self.key(name).unit;
            let message =
                format!("{} = [{lower}, {upper}] {unit}: the lower limit is not below the upper one", self.full(name));
            let help = format!("write [lower, upper] in {unit}, lower < upper");
            self.report_at(name, "lower < upper?", Diagnostic::error("M0006", message).help(help));
        }
        Some([lower, upper])
    }

    /// `N` numbers; `None` if the key is missing, NaN where a report was made.
    pub fn numbers<const N: usize>(&self, name: &str) -> Option<[f64; N]> {
        let key = self.key(name);
        let Some(entry) = self.entry(name) else {
            if key.absent == Absent::Required {
                self.missing_key(key);
            }
            return None;
        };
        let full = self.full(name);
        match &entry.node.value {
            Value::List(items) if items.len() == N => {
                Some(std::array::from_fn(|i| self.number_in(&items[i], &format!("{full}[{i}]"), Range::Any, key)))
            }
            Value::List(items) => {
                let message = format!("{full} has {} numbers, expected {N}", items.len());
                let help = format!("write {}", key.describe_range());
                self.report(&entry.node.mark, "", Diagnostic::error("M0005", message).help(help));
                Some([f64::NAN; N])
            }
            _ => {
                self.wrong_type(&entry.node, &full, &format!("a list of {N} numbers"));
                Some([f64::NAN; N])
            }
        }
    }

    /// A list of numbers; `None` if the key is missing, NaN where a report was made.
    pub fn values(&self, name: &str) -> Option<Vec<f64>> {
        let key = self.key(name);
        let entry = self.entry(name)?;
        let full = self.full(name);
        let Accepts::Values(most) = key.accepts else { return None };
        let Value::List(items) = &entry.node.value else {
            self.wrong_type(&entry.node, &full, "a list of numbers");
            return None;
        };
        if !(2..=most as usize).contains(&items.len()) {
            let message = format!("{full} has {} numbers, allowed: 2 to {most}", items.len());
            self.report(&entry.node.mark, "", Diagnostic::error("M0006", message).help(key.help));
            return None;
        }
        let number = |(n, item)| self.number_in(item, &format!("{full}[{n}]"), Range::Any, key);
        Some(items.iter().enumerate().map(number).collect())
    }

    /// Tables of a list; `None` if the key is missing.
    pub fn list(&self, name: &str) -> Option<&'f [Node]> {
        let entry = self.entry(name)?;
        match &entry.node.value {
            Value::List(items) => Some(items),
            _ => {
                self.wrong_type(&entry.node, &self.full(name), "a list");
                Some(&[])
            }
        }
    }

    fn wrong_type(&self, node: &Node, full: &str, expected: &str) {
        let message = format!("{full}: expected {expected}, found {}", node.value.describe());
        let mut diagnostic = Diagnostic::error("M0005", message);
        match &node.value {
            Value::Text(text) if text.trim().parse::<f64>().is_ok() => {
                diagnostic = diagnostic.help(format!("write {} without quotes", text.trim()));
            }
            Value::Text(text) if text.replacen(',', ".", 1).trim().parse::<f64>().is_ok() => {
                diagnostic =
                    diagnostic.help(format!("write {}, with a decimal point", text.replacen(',', ".", 1).trim()));
            }
            _ => {}
        }
        self.report(&node.mark, &format!("expected {expected}"), diagnostic);
    }

    /// Reports a required key that is not there.
    pub fn missing(&self, name: &str, help: &str) {
        let key = self.key(name);
        // A misspelt key, or that of the other kind of axis, has its own report.
        let elsewhere = self.has(key.counterpart) && self.known().all(|known| known != key.counterpart);
        if self.quiet || elsewhere || self.entries.iter().any(|entry| self.misspells(entry, name)) {
            return;
        }
        let table = if self.path.is_empty() { "the machine file".to_owned() } else { format!("[{}]", self.path) };
        let unit = if key.unit.is_empty() { String::new() } else { format!(" ({})", key.unit) };
        let message = format!("{table} has no {name}{unit}: {}", key.help);
        let label = format!("{name} is missing here");
        self.report(&self.mark, &label, Diagnostic::error("M0004", message).help(help));
    }

    fn missing_key(&self, key: &Key) {
        self.missing(key.name, &format!("add {} = ..., {}", key.name, key.describe_range()));
    }

    fn key(&self, name: &str) -> &'static Key {
        let found = self.keys.keys.iter().find(|key| key.name == name && key.fits(self.kind, self.motor));
        found.unwrap_or_else(|| unreachable!("{name} is not in the catalogue of {}", self.keys.path))
    }

    /// Reports keys that the table does not have.
    fn check_keys(&self) {
        if self.keys.path == "axes" || self.keys.path == "axes.*.dynamics" {
            return;
        }
        for entry in self.entries {
            let name = entry.key.as_str();
            if self.keys.tables.contains(&name) {
                continue;
            }
            match self.keys.keys.iter().find(|key| key.name == name) {
                Some(key) if key.fits(self.kind, self.motor) => {}
                Some(key) => self.wrong_kind(entry, key),
                None => self.unknown(entry),
            }
        }
    }

    fn wrong_kind(&self, entry: &Entry, key: &Key) {
        if key.fits(self.kind, None) {
            return self.wrong_motor(entry, key);
        }
        let (is, other) = match self.kind {
            Some(AxisKind::Rotary) => ("a rotary axis", "linear"),
            _ => ("a linear axis", "rotary"),
        };
        let message = format!("{} belongs to a {other} axis, and this is {is}", self.full(&entry.key));
        let help = match key.counterpart {
            "" => format!("remove it, or write kind = \"{other}\" if the axis is one"),
            counterpart => format!("use {counterpart}, or write kind = \"{other}\" if the axis is one"),
        };
        self.report(&entry.key_mark, "not for this kind of axis", Diagnostic::error("M0003", message).help(help));
    }

    fn wrong_motor(&self, entry: &Entry, key: &Key) {
        let other = if self.motor() == MotorKind::Linear { "rotary" } else { "linear" };
        let message = format!("{} belongs to a {other} motor", self.full(&entry.key));
        let motor = self.on_this_axis("axes.*.motor");
        let fits = |name: &str| self.known().any(|known| known == name);
        let help = match key.counterpart {
            name if !fits(name) => format!("remove it, or write kind = \"{other}\" in [{motor}] if the motor is one"),
            counterpart => format!("use {counterpart}, or write kind = \"{other}\" in [{motor}] if the motor is one"),
        };
        self.report(&entry.key_mark, "not for this kind of motor", Diagnostic::error("M0003", message).help(help));
    }

    /// Keys and tables that may stand here.
    fn known(&self) -> impl Iterator<Item = &'static str> + use<> {
        let (kind, motor) = (self.kind, self.motor);
        let keys = self.keys.keys.iter().filter(move |key| key.fits(kind, motor)).map(|key| key.name);
        keys.chain(self.keys.tables.iter().copied())
    }

    fn misspells(&self, entry: &Entry, name: &str) -> bool {
        self.known().all(|known| known != entry.key) && nearest(&entry.key, self.known()) == Some(name)
    }

    fn unknown(&self, entry: &Entry) {
        let table = if self.path.is_empty() { "the top of the file".to_owned() } else { format!("[{}]", self.path) };
        let elsewhere = catalogue::tables().iter().find(|t| t.keys.iter().any(|key| key.name == entry.key));
        let help = match (nearest(&entry.key, self.known()), elsewhere) {
            (Some(near), _) => format!("did you mean {near}?"),
            (None, Some(TableKeys { path: "", .. })) => "it belongs to the top of the file".to_owned(),
            (None, Some(table)) => format!("it belongs to [{}]", self.on_this_axis(table.path)),
            (None, None) => format!("{table} has {}", self.known().collect::<Vec<_>>().join(", ")),
        };
        let message = format!("unknown key {} in {table}", self.full(&entry.key));
        self.report(&entry.key_mark, "unknown key", Diagnostic::error("M0003", message).help(help));
    }

    /// `axes.*.drive` as `axes.X.drive` where this table belongs to X.
    fn on_this_axis(&self, pattern: &str) -> String {
        let axis = self.path.strip_prefix("axes.").and_then(|rest| rest.split('.').next());
        axis.map_or_else(|| pattern.to_owned(), |axis| pattern.replacen('*', axis, 1))
    }
}

/// Tables whose keys are names given by the user.
const NAMED: &[TableKeys] = &[
    TableKeys { path: "axes", keys: &[], tables: &[] },
    TableKeys { path: "axes.*.dynamics", keys: &[], tables: &[] },
];

fn table_keys(path: &'static str) -> &'static TableKeys {
    let found = catalogue::tables().iter().chain(NAMED).find(|table| table.path == path);
    found.unwrap_or_else(|| unreachable!("{path} is not in the catalogue"))
}
