//! A machine file, from a path or the name of a shipped machine to a checked [`Machine`].
//!
//! In: a path or name, `--set` arguments. Out: [`Loaded`], or all that is wrong with the file at once. Reads one file, writes none.

use super::checked::{Axis, Machine};
use super::document::{Node, Texts, read};
use super::later::later_values;
use super::overrides::{self, Override};
use super::section::{Findings, Section};
use super::shipped::{shipped, shipped_text};
use super::{axis, clock, control};
use crate::base::diagnostics::{Diagnostic, Severity, SourceText, nearest};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

/// Largest machine file: eight axes with comments are some 20 kB.
const FILE_SIZE_MAX: u64 = 4 << 20;

/// A machine with what a recording keeps of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The machine, every value checked.
    pub machine: Machine,
    /// File name without folders; of a shipped machine its name and `.toml`.
    pub name: Arc<str>,
    /// The file as used: `--set` applied, comments kept.
    pub text_as_used: String,
    /// What a person should know.
    pub warnings: Vec<Diagnostic>,
}

/// Why there is no machine.
#[derive(Clone, Debug, PartialEq)]
pub enum LoadError {
    /// No such file or machine, or no text.
    Unreadable(Diagnostic),
    /// All that is wrong with the file, or with the `--set` arguments.
    Invalid(Vec<Diagnostic>),
}

impl LoadError {
    /// The findings of either kind.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        match self {
            Self::Unreadable(diagnostic) => std::slice::from_ref(diagnostic),
            Self::Invalid(diagnostics) => diagnostics,
        }
    }
}

/// Loads a machine file, or a shipped machine by its name where no file of that name exists.
#[allow(clippy::result_large_err, reason = "once a run")]
pub fn load(path_or_shipped_name: &str, sets: &[String]) -> Result<Loaded, LoadError> {
    let path = Path::new(path_or_shipped_name);
    if !path.exists()
        && let Some((name, text)) = shipped_text(path_or_shipped_name)
    {
        let source = SourceText::new(format!("{name}.toml"), text);
        return parse(&source, sets).map_err(LoadError::Invalid);
    }
    let text = read_file(path).map_err(|reason| LoadError::Unreadable(unreadable(path_or_shipped_name, &reason)))?;
    parse(&SourceText::new(path_or_shipped_name, text), sets).map_err(LoadError::Invalid)
}

pub(super) fn read_file(path: &Path) -> Result<String, String> {
    let file = File::open(path).map_err(|error| error.to_string())?;
    let mut bytes = Vec::new();
    file.take(FILE_SIZE_MAX + 1).read_to_end(&mut bytes).map_err(|error| error.to_string())?;
    if bytes.len() as u64 > FILE_SIZE_MAX {
        return Err(format!("it is longer than {FILE_SIZE_MAX} bytes, which no machine file is"));
    }
    String::from_utf8(bytes).map_err(|error| format!("it is not UTF-8 from byte {}", error.utf8_error().valid_up_to()))
}

fn unreadable(name: &str, reason: &str) -> Diagnostic {
    let names = || shipped().iter().map(|(name, _)| *name);
    let all = names().collect::<Vec<_>>().join(", ");
    let help = match nearest(name.trim_end_matches(".toml"), names()) {
        Some(near) => format!("did you mean {near}? The shipped machines are {all}"),
        None => format!("give a path or the name of a shipped machine: {all}"),
    };
    Diagnostic::error("M0001", format!("cannot read the machine {name}: {reason}")).help(help)
}

/// Checks the text of a machine file with `--set` arguments applied. All findings at once, in the order of the file.
pub fn parse(source: &SourceText, sets: &[String]) -> Result<Loaded, Vec<Diagnostic>> {
    // A byte-order mark is no part of the file, and would shift the columns of line 1.
    let text = source.text.strip_prefix('\u{feff}').unwrap_or(&source.text);
    let mut texts = Texts { sources: vec![SourceText::new(source.name.clone(), text)] };
    texts.sources.extend(sets.iter().map(|set| SourceText::new(overrides::SET, set.as_str())));

    let (mut root, syntax_errors) = read(&texts.sources[0], 0);
    if !syntax_errors.is_empty() {
        return Err(with_recovered(&root, &texts, syntax_errors));
    }
    let applied = apply_sets(&mut root, sets, &texts)?;
    let (machine, findings) = check(&root, &texts);
    let (Some(machine), Some(text_as_used)) = (machine, overrides::text_with(text, &applied, overrides::SET)) else {
        return Err(findings);
    };
    let name = source.name.rsplit(['/', '\\']).next().unwrap_or(&source.name);
    Ok(Loaded { machine, name: name.into(), text_as_used, warnings: findings })
}

/// What else is wrong in a file that is not all TOML: only findings about values and keys that were read, since a missing key may
/// stand in the part that was not.
fn with_recovered(root: &Node, texts: &Texts, mut errors: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let broken_lines: Vec<u32> = errors.iter().map(Diagnostic::line).collect();
    let (_, findings) = check(root, texts);
    errors.extend(findings.into_iter().filter(|finding| {
        matches!(finding.code, "M0003" | "M0006" | "M0007") && !broken_lines.contains(&finding.line())
    }));
    errors.sort_by_key(Diagnostic::line);
    errors
}

fn apply_sets(root: &mut Node, sets: &[String], texts: &Texts) -> Result<Vec<Override>, Vec<Diagnostic>> {
    let (mut applied, mut wrong) = (Vec::new(), Vec::new());
    for (place, argument) in sets.iter().enumerate() {
        let done = overrides::parse(argument, place + 1).and_then(|set| {
            overrides::apply(root, &set, texts)?;
            Ok(set)
        });
        match done {
            Ok(set) => applied.push(set),
            Err(diagnostic) => wrong.push(*diagnostic),
        }
    }
    if wrong.is_empty() { Ok(applied) } else { Err(wrong) }
}

/// The machine, unless an error was found, and all findings.
fn check(root: &Node, texts: &Texts) -> (Option<Machine>, Vec<Diagnostic>) {
    let findings = Findings::new(texts);
    let machine = machine(&Section::root(&findings, root));
    let failed = findings.any_error();
    if !failed {
        for later in later_values(&machine) {
            let node = root.at(&[later.table, later.key]).unwrap_or(root);
            findings.report(&node.mark, "not under this time law", later.warning());
        }
    }
    let list = findings.into_sorted();
    debug_assert_eq!(failed, list.iter().any(|finding| finding.severity == Severity::Error));
    ((!failed).then_some(machine), list)
}

/// Reads every table. With errors the machine holds stand-ins, and nobody sees it.
fn machine(root: &Section<'_>) -> Machine {
    let _format = root.whole("format");
    let name = root.text("name").unwrap_or_default().to_owned();
    let control = root.text("control").unwrap_or_default().to_owned();
    let mut drafts = axis::axes(root);
    let cycle = clock::cycle(root, &mut drafts);
    let axes: Vec<Axis> = drafts.into_iter().map(|draft| draft.axis).collect();
    Machine {
        name,
        control,
        cycle,
        look_ahead_blocks: control::look_ahead_blocks(root),
        feed: control::feed(root),
        smoothing: control::smoothing(root),
        spindle: control::spindle(root),
        spindle_speed_max_rpm: root.table("spindle", "spindle").optional_number("speed_max_rpm"),
        kinematics: control::kinematics(root, &axes),
        axes,
    }
}
