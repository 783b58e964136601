//! The language by example: every program in `programs/language/` against the moves beside it.
//!
//! The `.moves` were written by hand from the rules that the head of each program states, not by running it. A program names its
//! machine in its first line, and behind it what lies around it (`; gud: FILE`, `; skip: 2`). A difference is shown line by line, so that one reads which rule is broken.

use sollwert::interpreter::{Interpreter, Listing, Setup};
use sollwert::program::ProgramSource;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Moves after which a program of one idea certainly does something else than it says.
const MOVES_MAX: usize = 1000;

/// Programs whose words are being built at this very moment: compared and reported, but no failure yet.
const WAITING: [&str; 0] = [];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("programs/language")
}

/// The main programs, in order.
fn programs() -> Vec<PathBuf> {
    let files = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path());
    let mut programs: Vec<_> = files.filter(|path| path.extension().is_some_and(|ending| ending == "mpf")).collect();
    programs.sort();
    programs
}

/// The word behind `; KEY: ` in the head of a program.
fn head<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let lines = text.lines().take_while(|line| line.starts_with([';', '%']));
    lines.filter_map(|line| line.strip_prefix("; ")?.strip_prefix(key)?.strip_prefix(": ")).map(str::trim).next()
}

/// Moves of a program, and below them what was reported: there should be nothing.
fn listing(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let machine = crate::nc_machine::test_machine::shipped(
        head(&text, "machine").expect("the first line names the machine"),
        &[],
    );
    let open = |name: &str| ProgramSource::from_file(&folder().join(name)).unwrap();
    let mut setup = Setup::from(ProgramSource::from_file(path).unwrap());
    setup.definitions = head(&text, "gud").map(open).into_iter().collect();
    setup.skip_levels = head(&text, "skip").map_or(0, |level| 1 << level.parse::<u16>().unwrap());
    let mut interpreter = Interpreter::new(setup, &machine);
    let mut listing = Listing::new(&machine);
    let mut found = String::new();
    for _ in 0..MOVES_MAX {
        match interpreter.next_move() {
            Ok(Some(next)) => writeln!(found, "{}", listing.line(&next)).unwrap(),
            Ok(None) => break,
            Err(alarm) => {
                writeln!(found, "{}", alarm.render(false)).unwrap();
                break;
            }
        }
    }
    let warns = head(&text, "warns");
    let warnings = interpreter.take_warnings();
    assert!(warns.is_none_or(|code| warnings.iter().any(|warning| warning.code == code)), "{}", path.display());
    for warning in warnings.iter().filter(|warning| Some(warning.code) != warns) {
        writeln!(found, "{}", warning.render(false)).unwrap();
    }
    found
}

/// Both texts, line beside line, where they differ.
fn differences(found: &str, wanted: &str) -> String {
    let (found, wanted): (Vec<_>, Vec<_>) = (found.lines().collect(), wanted.lines().collect());
    let mut text = String::new();
    for i in 0..found.len().max(wanted.len()) {
        match (found.get(i), wanted.get(i)) {
            (Some(found), Some(wanted)) if found == wanted => writeln!(text, "    {found}").unwrap(),
            (found, wanted) => {
                wanted.iter().for_each(|line| writeln!(text, "  - {line}").unwrap());
                found.iter().for_each(|line| writeln!(text, "  + {line}").unwrap());
            }
        }
    }
    text
}

#[test]
fn every_program_does_what_its_moves_say() {
    let mut report = String::new();
    let mut broken = 0;
    for path in programs() {
        let wanted = std::fs::read_to_string(path.with_extension("moves")).unwrap();
        let found = listing(&path);
        let name = path.file_name().unwrap().to_string_lossy();
        if found != wanted && WAITING.contains(&&name[..3]) {
            eprintln!("{name} waits: - by the rules, + found\n{}", differences(&found, &wanted));
        } else if found != wanted {
            broken += 1;
            writeln!(report, "{name}: - by the rules, + found\n{}", differences(&found, &wanted)).unwrap();
        }
    }
    assert!(broken == 0, "{broken} of {} programs differ:\n{report}", programs().len());
}

#[test]
fn there_are_enough_programs_and_no_stray_moves() {
    assert!(programs().len() >= 40);
    let moves = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path());
    for path in moves.filter(|path| path.extension().is_some_and(|ending| ending == "moves")) {
        assert!(path.with_extension("mpf").exists(), "{} has no program", path.display());
    }
}
