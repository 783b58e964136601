//! `--set axes.X.drive.velocity_feedforward=0.95`: one value of one run.
//!
//! In: the arguments. Out: the tree with them applied (each value still knows that it came from `--set`), and the text of the
//! machine file with them applied, comments kept, which a recording attaches. The last of two `--set` for one key counts.
//! Adds no axes: it changes a machine, it does not make one.

use super::document::{Entry, Mark, Node, Texts, Value, read};
use crate::base::diagnostics::{Diagnostic, SourceText, nearest};
use toml_edit::{DocumentMut, InlineTable, Item, Key, Table, TableLike};

/// The name under which a diagnostic shows the argument.
pub(super) const SET: &str = "--set";

/// Most parts of a dotted key: the deepest of the format has five (axes.X.dynamics.finish.jerk_max_m_s3).
const DEPTH_MAX: usize = 8;

/// One argument, read.
#[derive(Clone, Debug)]
pub(super) struct Override {
    path: Vec<String>,
    key_mark: Mark,
    node: Node,
    /// For the text: the value as toml_edit has it.
    written: toml_edit::Value,
}

/// Reads the `number`-th argument (from 1).
pub(super) fn parse(argument: &str, number: usize) -> Result<Override, Box<Diagnostic>> {
    let whole = SourceText::new(SET, argument);
    let wrong = |message: String| {
        let place = whole.place(0..argument.len(), "");
        let help = "write KEY=VALUE, such as --set axes.X.drive.velocity_feedforward=0.95";
        Box::new(Diagnostic::error("M0010", message).at(place).help(help))
    };
    let Some((key_text, value_text)) = argument.split_once('=') else {
        return Err(wrong(format!("--set {argument}: there is no =")));
    };
    if argument.contains(['\n', '\r']) {
        return Err(wrong("--set: the argument has more than one line".to_owned()));
    }
    let path: Vec<String> = match Key::parse(key_text) {
        Ok(keys) if (1..=DEPTH_MAX).contains(&keys.len()) => keys.iter().map(|key| key.get().to_owned()).collect(),
        _ => return Err(wrong(format!("--set {argument}: {key_text:?} is no key"))),
    };
    let key_mark = Mark { source: number, span: 0..key_text.trim_end().len() };
    let Some((node, written)) = value(argument, &path, number).or_else(|| bare_word(key_text, value_text, number))
    else {
        return Err(wrong(format!("--set {argument}: {value_text:?} is neither a value of TOML nor a word")));
    };
    Ok(Override { path, key_mark, node, written })
}

/// The argument is a line of TOML.
fn value(argument: &str, path: &[String], number: usize) -> Option<(Node, toml_edit::Value)> {
    let (root, errors) = read(&SourceText::new(SET, argument), number);
    if !errors.is_empty() {
        return None;
    }
    let path: Vec<&str> = path.iter().map(String::as_str).collect();
    let node = root.at(&path)?.clone();
    let document: DocumentMut = argument.parse().ok()?;
    let mut item = document.as_item();
    for key in path {
        item = item.get(key)?;
    }
    let mut written = item.as_value()?.clone();
    written.decor_mut().clear();
    Some((node, written))
}

/// A word without quotes, such as G641: the shell eats quotes.
fn bare_word(key_text: &str, value_text: &str, number: usize) -> Option<(Node, toml_edit::Value)> {
    let word = value_text.trim();
    let start = key_text.len() + 1 + (value_text.len() - value_text.trim_start().len());
    if word.is_empty() || word.contains(['"', '\'', '[', ']', '{', '}', '#', '=']) || word.chars().any(char::is_control)
    {
        return None;
    }
    let mark = Mark { source: number, span: start..start + word.len() };
    Some((Node { mark, value: Value::Text(word.to_owned()) }, word.into()))
}

/// Puts the value into the tree.
pub(super) fn apply(root: &mut Node, set: &Override, texts: &Texts) -> Result<(), Box<Diagnostic>> {
    let marked = |message: String, help: String| {
        Box::new(Diagnostic::error("M0010", message).at(texts.place(&set.key_mark, "")).help(help))
    };
    if let Some((message, help)) = unknown_axis(root, &set.path) {
        return Err(marked(message, help));
    }
    let mut node = root;
    for (depth, key) in set.path.iter().enumerate() {
        let found = node.value.describe();
        let Value::Table(entries) = &mut node.value else {
            let message =
                format!("--set: {} is {found}, not a table: it has no key {key}", set.path[..depth].join("."));
            return Err(marked(message, "name a key of a table, such as axes.X.jerk_max_m_s3".to_owned()));
        };
        let place = entries.iter().position(|entry| entry.key == *key).unwrap_or_else(|| {
            let node = Node { mark: set.key_mark.clone(), value: Value::Table(Vec::new()) };
            entries.push(Entry { key: key.clone(), key_mark: set.key_mark.clone(), node });
            entries.len() - 1
        });
        if depth + 1 == set.path.len() {
            entries[place].key_mark = set.key_mark.clone();
        }
        node = &mut entries[place].node;
    }
    *node = set.node.clone();
    Ok(())
}

/// A `--set` for an axis that the file does not have: message and help.
fn unknown_axis(root: &Node, path: &[String]) -> Option<(String, String)> {
    let ["axes", axis] = [path.first()?.as_str(), path.get(1)?.as_str()] else { return None };
    let axes = root.at(&["axes"]).and_then(Node::entries).unwrap_or(&[]);
    let names = || axes.iter().map(|entry| entry.key.as_str());
    if names().any(|name| name == axis) {
        return None;
    }
    let all = names().collect::<Vec<_>>().join(", ");
    let help = match nearest(axis, names()) {
        Some(name) => format!("did you mean axes.{name}? The axes are {all}"),
        None => format!("the axes are {all}"),
    };
    Some((format!("--set: the machine has no axis {axis}"), help))
}

/// The file with the values set: a comment beside a replaced value is kept, with a word that the value is no longer the file's.
/// `None` if the text cannot hold them (it was checked before, so it can).
pub(super) fn text_with(text: &str, sets: &[Override], by: &str) -> Option<String> {
    if sets.is_empty() {
        return Some(text.to_owned());
    }
    let mut document: DocumentMut = text.parse().ok()?;
    for set in sets {
        let (last, parents) = set.path.split_last()?;
        write(document.as_table_mut(), Line { inline: false, by }, parents, last, &set.written)?;
    }
    Some(document.to_string())
}

/// A machine file with values replaced, comments and order kept; `by` stands in front of the comment beside each. `sets` are those of `--set`.
pub fn edited(text: &str, sets: &[String], by: &str) -> Result<String, Vec<Diagnostic>> {
    let mut read = Vec::new();
    for (place, argument) in sets.iter().enumerate() {
        read.push(parse(argument, place + 1).map_err(|finding| vec![*finding])?);
    }
    let no_text = || vec![Diagnostic::error("M0002", "the machine file does not take these values")];
    text_with(text, &read, by).ok_or_else(no_text)
}

/// Where a value is written, and who writes it.
#[derive(Clone, Copy)]
struct Line<'b> {
    /// The table stands in braces on one line, where no comment can stand.
    inline: bool,
    by: &'b str,
}

fn write(
    table: &mut dyn TableLike,
    line: Line<'_>,
    parents: &[String],
    key: &str,
    value: &toml_edit::Value,
) -> Option<()> {
    if let Some((parent, deeper)) = parents.split_first() {
        if table.get(parent).is_none() {
            table.insert(parent, new_table(line.inline, table.is_dotted()));
        }
        let item = table.get_mut(parent)?;
        let line = Line { inline: item.is_inline_table(), ..line };
        return write(item.as_table_like_mut()?, line, deeper, key, value);
    }
    let in_lines = !line.inline;
    let mut value = value.clone();
    match table.get(key).and_then(Item::as_value) {
        Some(old) => {
            let suffix = old.decor().suffix().and_then(|raw| raw.as_str()).unwrap_or("").to_owned();
            let prefix = old.decor().prefix().and_then(|raw| raw.as_str()).unwrap_or(" ").to_owned();
            let mut bare = old.clone();
            bare.decor_mut().clear();
            let suffix = if in_lines { comment(line.by, Some(bare.to_string()), &suffix) } else { suffix };
            *value.decor_mut() = toml_edit::Decor::new(prefix, suffix);
        }
        None if in_lines => *value.decor_mut() = toml_edit::Decor::new(" ", comment(line.by, None, "")),
        None => {}
    }
    // In place: an insert would take the comments before the key along.
    match table.get_mut(key) {
        Some(item) => *item = Item::Value(value),
        None => {
            table.insert(key, Item::Value(value));
        }
    }
    Some(())
}

/// `  # --set, was 20.0; published, [Essid 2019, Table 2]`
fn comment(by: &str, old_value: Option<String>, old_suffix: &str) -> String {
    let was = match old_value {
        Some(old) if !old.contains(['\n', '\r']) => format!(", was {}", old.trim()),
        _ => String::new(),
    };
    let kept = old_suffix.trim().trim_start_matches('#').trim_start();
    let separator = if kept.is_empty() { "" } else { "; " };
    format!("  # {by}{was}{separator}{kept}")
}

fn new_table(inline: bool, dotted: bool) -> Item {
    if inline {
        return Item::Value(toml_edit::Value::InlineTable(InlineTable::new()));
    }
    let mut table = Table::new();
    table.set_implicit(true);
    table.set_dotted(dotted);
    Item::Table(table)
}
