//! One mistake a program, one finding each: the programs in `tests/language/errors/`.
//!
//! Below the block with the mistake stands a comment that marks the place and names the code, and what the finding says:
//! `;       ^^^ E0104 expected a number`. `;^all` marks the whole block. `check` must report this and nothing else, and a run must end
//! there or, where the mistake can be seen only by reading, earlier.

use crate::nc_machine::{run_bytes, xyz};
use sollwert::base::Diagnostic;
use sollwert::interpreter::check;
use sollwert::program::ProgramSource;
use std::fmt::Write;
use std::path::Path;

/// What a program says about itself.
#[derive(Debug, PartialEq)]
struct Wanted<'a> {
    line: u32,
    /// First marked character; `None`: the whole block.
    start: Option<usize>,
    /// Number of carets.
    width: usize,
    code: &'a str,
    phrase: &'a str,
}

fn wanted(text: &str) -> Vec<Wanted<'_>> {
    let mut found = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let Some(start) =
            line.strip_prefix(';').and_then(|rest| rest.trim_start().starts_with('^').then(|| line.find('^')))
        else {
            continue;
        };
        let (mark, rest) = line[start.unwrap_or(0)..].split_once(' ').expect("a code behind the mark");
        let (code, phrase) = rest.split_once(' ').unwrap_or((rest, ""));
        let start = start.filter(|_| mark != "^all");
        found.push(Wanted { line: index as u32, start, width: mark.len(), code, phrase });
    }
    found
}

/// What is wrong with a finding, if anything.
fn compare(found: &Diagnostic, wanted: &Wanted) -> Option<&'static str> {
    let Some(place) = &found.place else { return Some("no place") };
    let characters = |bytes: usize| place.line_text[..bytes].chars().count();
    let (start, end) = (characters(place.columns.start), characters(place.columns.end));
    let marked = match wanted.start {
        None => start == 0 && end == place.line_text.trim_end().chars().count(),
        // An empty mark points at what is missing.
        Some(at) => start == at && (end - start).max(1) == wanted.width,
    };
    match () {
        () if found.code != wanted.code => Some("another code"),
        () if found.line() != wanted.line => Some("another line"),
        () if !marked => Some("another place"),
        () if !found.render(false).contains(wanted.phrase) => Some("other words"),
        () => None,
    }
}

#[test]
fn one_mistake_is_one_finding_at_its_place() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/language/errors");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert!(paths.len() >= 20);
    let mut report = String::new();
    for path in paths {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).unwrap();
        let wanted = wanted(&text);
        assert_eq!(wanted.len(), 1, "{name}");
        let found = check(ProgramSource::from_bytes(&name, text.as_bytes()), &xyz());
        let fault = match &found[..] {
            [one] => compare(one, &wanted[0]),
            [] => Some("no finding"),
            _ => Some("more than one finding"),
        };
        if let Some(fault) = fault {
            writeln!(report, "{name}: {fault}, wanted {:?}", wanted[0]).unwrap();
            found.iter().for_each(|finding| writeln!(report, "{}", finding.render(false)).unwrap());
        }
        let run = run_bytes(text.as_bytes(), &xyz());
        let raised = run.alarm.as_ref().map(|alarm| (alarm.line(), alarm.code));
        if raised != Some((wanted[0].line, wanted[0].code)) {
            writeln!(report, "{name}: the run raised {raised:?}").unwrap();
        }
    }
    assert!(report.is_empty(), "{report}");
}
