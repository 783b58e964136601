//! A machine file as a tree in which every key and value knows where it was written.
//!
//! In: TOML text, and the arguments of `--set`. Out: [`Node`]s with [`Mark`]s, and diagnostics for what is no TOML. Does not know
//! which keys exist or what they mean.

use crate::base::diagnostics::{Diagnostic, Place, SourceText, Span};
use toml::de::{DeTable, DeValue};

/// Where a key or value was written: in the file (`source` 0) or in the n-th `--set` (`source` n).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mark {
    pub source: usize,
    pub span: Span,
}

/// A value with its place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    pub mark: Mark,
    pub value: Value,
}

/// A value of TOML.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Text(String),
    /// Also an integer; the text is as typed, for messages.
    Number {
        value: f64,
        text: String,
        whole: bool,
    },
    Flag(bool),
    Date(String),
    List(Vec<Node>),
    Table(Vec<Entry>),
}

/// A key and its value, in the order of the file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    pub key: String,
    pub key_mark: Mark,
    pub node: Node,
}

impl Value {
    /// What it is, for "expected a number, found ...".
    pub fn describe(&self) -> String {
        match self {
            Self::Text(text) => format!("the text \"{text}\""),
            Self::Number { text, .. } => format!("the number {text}"),
            Self::Flag(flag) => format!("{flag}"),
            Self::Date(date) => format!("the date {date}"),
            Self::List(_) => "a list".to_owned(),
            Self::Table(_) => "a table".to_owned(),
        }
    }
}

impl Node {
    /// Entries of a table.
    pub fn entries(&self) -> Option<&[Entry]> {
        match &self.value {
            Value::Table(entries) => Some(entries),
            _ => None,
        }
    }

    /// The value at a path of keys, if it is there.
    pub fn at<'n>(&'n self, path: &[&str]) -> Option<&'n Node> {
        path.iter().try_fold(self, |node, key| node.entries()?.iter().find(|entry| entry.key == *key).map(|e| &e.node))
    }
}

/// The texts that marks point into: the file, then each `--set`.
#[derive(Clone, Debug)]
pub(super) struct Texts {
    pub sources: Vec<SourceText>,
}

impl Texts {
    /// The marked place.
    pub fn place(&self, mark: &Mark, label: impl Into<String>) -> Place {
        let source = self.sources.get(mark.source).unwrap_or(&self.sources[0]);
        source.place(mark.span.clone(), label)
    }
}

/// Reads TOML as far as it can be read; `source` is the number of the text in its [`Texts`].
pub(super) fn read(text: &SourceText, source: usize) -> (Node, Vec<Diagnostic>) {
    let (table, errors) = DeTable::parse_recoverable(&text.text);
    let found = errors.iter().map(|error| syntax_error(text, error)).collect();
    let entries = entries(table.get_ref(), source);
    (Node { mark: Mark { source, span: 0..0 }, value: Value::Table(entries) }, found)
}

fn syntax_error(text: &SourceText, error: &toml::de::Error) -> Diagnostic {
    let place = text.place(error.span().unwrap_or(0..0), "here");
    let help = if error.message().contains("duplicate") {
        "write each key and each table once"
    } else {
        "a line is `key = value`, a comment after #, or a table such as [axes.X]; a text stands in \"quotes\""
    };
    Diagnostic::error("M0002", format!("this is no TOML: {}", error.message())).at(place).help(help)
}

fn entries(table: &DeTable<'_>, source: usize) -> Vec<Entry> {
    let mut entries: Vec<Entry> = table
        .iter()
        .map(|(key, value)| Entry {
            key: key.get_ref().to_string(),
            key_mark: Mark { source, span: key.span() },
            node: node(value.get_ref(), value.span(), source),
        })
        .collect();
    // The parser sorts by name; a person reads by place.
    entries.sort_by_key(|entry| entry.key_mark.span.start);
    entries
}

fn node(value: &DeValue<'_>, span: Span, source: usize) -> Node {
    let value = match value {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Integer(integer) => {
            // A number too long for 64 bits is still a number: the range check of its key will say so.
            let digits = integer.as_str();
            let value = match i64::from_str_radix(digits, integer.radix()) {
                Ok(whole) => whole as f64,
                Err(_) => digits.parse().unwrap_or(f64::INFINITY),
            };
            Value::Number { value, text: integer.to_string(), whole: true }
        }
        DeValue::Float(float) => {
            let text = float.as_str().to_owned();
            Value::Number { value: float_value(&text), text, whole: false }
        }
        DeValue::Boolean(flag) => Value::Flag(*flag),
        DeValue::Datetime(date) => Value::Date(date.to_string()),
        DeValue::Array(items) => {
            Value::List(items.iter().map(|item| node(item.get_ref(), item.span(), source)).collect())
        }
        DeValue::Table(table) => Value::Table(entries(table, source)),
    };
    Node { mark: Mark { source, span }, value }
}

/// 1e999 overflows to infinity in f64, and only the word `inf` may mean that: NaN, which no key accepts, stands for the former.
fn float_value(text: &str) -> f64 {
    match text.parse::<f64>() {
        Ok(value) if value.is_infinite() && !text.contains("inf") => f64::NAN,
        Ok(value) => value,
        Err(_) => f64::NAN,
    }
}
