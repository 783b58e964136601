//! What goes wrong, said so that a stranger can mend it: code, file, line, the marked place, what was expected, what to do.
//!
//! In: findings of any room. Out: [`Diagnostic`], which renders itself (annotate-snippets behind our own type, so that no other
//! room knows the library). A diagnostic carries the one source line that it marks, not the file: programs are streamed.
//! Does not decide what happens next: that is the caller's.

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use std::ops::Range;
use std::sync::Arc;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Worth knowing; the result is right.
    Note,
    /// The result may not be what the user wants: a word not acted on, a representative drive.
    Warning,
    /// The work cannot go on from here.
    Error,
}

/// The marked place in one line of a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// File as the user named it (never made absolute: recordings must not depend on the folder).
    pub file: Arc<str>,
    /// Line number, from 1.
    pub line: u32,
    /// The whole line, without its line end.
    pub line_text: String,
    /// Marked bytes within `line_text`; empty = point at one place.
    pub columns: Range<usize>,
    /// What to write under the mark, such as "expected a number"; may be empty.
    pub label: String,
}

/// A text with a name, and the line and column of any byte in it.
#[derive(Clone, Debug)]
pub struct SourceText {
    /// File name as the user gave it.
    pub name: Arc<str>,
    /// Decoded text.
    pub text: Arc<str>,
}

/// Bytes `start..end` of a [`SourceText`].
pub type Span = Range<usize>;

impl SourceText {
    /// Wraps a decoded text.
    pub fn new(name: impl Into<Arc<str>>, text: impl Into<Arc<str>>) -> Self {
        Self { name: name.into(), text: text.into() }
    }

    /// The line that holds byte `span.start`, with the part of `span` that lies in it marked.
    pub fn place(&self, span: Span, label: impl Into<String>) -> Place {
        let start = span.start.min(self.text.len());
        let line_start = self.text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line_end = self.text[start..].find('\n').map_or(self.text.len(), |i| start + i);
        let line_text = self.text[line_start..line_end].trim_end_matches('\r').to_owned();
        let columns_start = (start - line_start).min(line_text.len());
        let columns_end = span.end.saturating_sub(line_start).clamp(columns_start, line_text.len());
        let line = self.text[..line_start].bytes().filter(|b| *b == b'\n').count() as u32 + 1;
        Place { file: self.name.clone(), line, line_text, columns: columns_start..columns_end, label: label.into() }
    }
}

/// One finding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Stable code, such as `E0123` (program), `M0004` (machine file), `R0002` (recording), `D0001` (drive), `A...` (alarm).
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// What is wrong, in one sentence without a full stop, with the value and its unit.
    pub message: String,
    /// Where; `None` for findings about the whole (a missing file).
    pub place: Option<Place>,
    /// What to do, in one sentence; the nearest known word, the allowed range.
    pub help: Option<String>,
    /// File and line of the calls that led to the place, innermost first; empty in a main program.
    pub called_from: Vec<(Arc<str>, u32)>,
}

impl Diagnostic {
    /// A new error.
    pub fn error(code: &'static str, message: impl Into<String>) -> Self {
        Self {
            code,
            severity: Severity::Error,
            message: message.into(),
            place: None,
            help: None,
            called_from: Vec::new(),
        }
    }

    /// A new warning.
    pub fn warning(code: &'static str, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, message) }
    }

    /// A new note.
    pub fn note(code: &'static str, message: impl Into<String>) -> Self {
        Self { severity: Severity::Note, ..Self::error(code, message) }
    }

    /// Marks the place.
    pub fn at(mut self, place: Place) -> Self {
        self.place = Some(place);
        self
    }

    /// Says what to do.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Line of the place, 0 without one.
    pub fn line(&self) -> u32 {
        self.place.as_ref().map_or(0, |place| place.line)
    }

    /// The finding as shown to a person, in rustc's manner; `colour` = terminal escapes.
    pub fn render(&self, colour: bool) -> String {
        let level = match self.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
            Severity::Note => Level::NOTE,
        };
        let mut group = Group::with_title(level.primary_title(self.message.as_str()).id(self.code));
        if let Some(place) = &self.place {
            let mut annotation = AnnotationKind::Primary.span(visible_columns(place));
            if !place.label.is_empty() {
                annotation = annotation.label(place.label.as_str());
            }
            group = group.element(
                Snippet::source(place.line_text.as_str())
                    .line_start(place.line as usize)
                    .path(place.file.as_ref())
                    .annotation(annotation),
            );
        }
        if let Some(help) = &self.help {
            group = group.element(Level::HELP.message(help.as_str()));
        }
        for (file, line) in &self.called_from {
            group = group.element(Level::NOTE.message(format!("called from {file}:{line}")));
        }
        let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
        renderer.render(&[group])
    }
}

/// An empty mark is widened to one character, so that there is something to see; marks keep to character borders.
fn visible_columns(place: &Place) -> Range<usize> {
    let text = &place.line_text;
    let floor = |mut i: usize| {
        i = i.min(text.len());
        while !text.is_char_boundary(i) {
            i -= 1;
        }
        i
    };
    let start = floor(place.columns.start);
    let mut end = floor(place.columns.end);
    if end <= start {
        end = text[start..].chars().next().map_or(start, |c| start + c.len_utf8());
    }
    start..end
}

/// The known word nearest to `word` (Damerau-free edit distance, case-blind), if it is near enough to be a typo.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_ascii_lowercase();
    known
        .into_iter()
        .map(|candidate| (edit_distance(&word, &candidate.to_ascii_lowercase()), candidate))
        .filter(|(distance, candidate)| *distance <= 1 + candidate.len().min(word.len()) / 4)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// Edit distance with insertion, deletion, replacement and exchange of neighbours (optimal string alignment).
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows: Vec<Vec<usize>> = vec![(0..=b.len()).collect()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replace = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut least = replace.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(rows[i - 2][j - 2] + 1);
            }
            row.push(least);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_typo_finds_its_word() {
        assert_eq!(nearest("ptich_mm", ["pitch_mm", "gear_ratio"]), Some("pitch_mm"));
        assert_eq!(nearest("zzz", ["pitch_mm", "gear_ratio"]), None);
    }

    #[test]
    fn a_place_knows_its_line_with_any_line_end() {
        let source = SourceText::new("a.mpf", "N10 G1\r\nN20 Y=\r\nN30");
        let place = source.place(12..14, "expected a value");
        assert_eq!((place.line, place.line_text.as_str(), place.columns.clone()), (2, "N20 Y=", 4..6));
        let shown = Diagnostic::error("E0001", "no value").at(place).help("write Y=10").render(false);
        assert!(
            shown.contains("a.mpf:2:5") && shown.contains("expected a value") && shown.contains("write Y=10"),
            "{shown}"
        );
    }
}
