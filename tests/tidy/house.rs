//! Rules about the house: which room may use which, how a file begins, how long it gets, what it is called, whether it is used.
//!
//! In: a [`Repository`]. Out: [`Fault`]s.

use super::scan::{Fault, Repository, TextFile, Token, closing, code_only, declared_modules, tokens};
use std::collections::BTreeSet;

/// A ratchet: may be lowered, is never raised for one file. 500 is what one reads in one sitting.
const FILE_LINES_MAX: usize = 600;
/// A ratchet, likewise: a function fits on one screen.
const FUNCTION_LINES_MAX: usize = 80;
/// Words below which the head of a file cannot say what goes in and what comes out.
const HEADER_WORDS_MIN: usize = 12;
/// Names that mean "no room fits": the code belongs into the room of its stage.
const NAMES_OF_NO_ROOM: [&str; 9] =
    ["util", "utils", "common", "helper", "helpers", "types", "manager", "managers", "misc"];

/// Data flows down the list of `src/lib.rs`: a room imports only rooms above it.
pub fn imports(repository: &Repository) -> Vec<Fault> {
    const RULE: &str = "room order";
    let rooms = repository.rooms();
    let place = |room: &str| rooms.iter().position(|name| name == room);
    let mut faults = Vec::new();
    for file in repository.sources() {
        let Some(own_room) = file.room() else { continue };
        let code = code_only(&file.text);
        let tokens = tokens(&code);
        let Some(own_place) = place(own_room) else {
            // `src/lib.rs` lists the rooms: a file in a room that it does not list is a dead file, which is another rule.
            continue;
        };
        for (offset, used) in rooms_used(&tokens) {
            if place(used).is_some_and(|used_place| used_place > own_place) {
                faults.push(file.fault(
                    offset,
                    RULE,
                    format!(
                        "`{own_room}` uses `{used}`, which stands below it in src/lib.rs: data flows downwards only"
                    ),
                ));
            }
        }
        for offset in climbs_out(file, &tokens) {
            faults.push(file.fault(
                offset,
                RULE,
                "`super` leaves the room: write `crate::room`, so that the use is seen",
            ));
        }
    }
    faults
}

/// Rooms named in `crate::room` and `crate::{room, room::Thing}`.
fn rooms_used<'a>(tokens: &[Token<'a>]) -> Vec<(usize, &'a str)> {
    let mut used = Vec::new();
    for (i, pair) in tokens.windows(2).enumerate() {
        if pair[0].text != "crate" || pair[1].text != "::" {
            continue;
        }
        match tokens.get(i + 2) {
            Some(open) if open.text == "{" => {
                let end = closing(tokens, i + 2);
                let inside = &tokens[i + 3..end];
                used.extend(super::scan::split_at_commas(inside).iter().map(|part| (part[0].offset, part[0].text)));
            }
            Some(word) => used.push((word.offset, word.text)),
            None => {}
        }
    }
    used
}

/// Chains of `super` that reach the crate root.
fn climbs_out(file: &TextFile, tokens: &[Token<'_>]) -> Vec<usize> {
    let inline: Vec<(usize, usize)> = tokens
        .windows(3)
        .enumerate()
        .filter(|(_, w)| w[0].text == "mod" && w[1].is_word() && w[2].text == "{")
        .map(|(i, _)| (i, closing(tokens, i + 2)))
        .collect();
    let mut found = Vec::new();
    for (i, token) in tokens.iter().enumerate() {
        let chained = i >= 2 && tokens[i - 1].text == "::" && tokens[i - 2].text == "super";
        let visibility = i >= 1 && tokens[i - 1].text == "(" && tokens.get(i + 1).is_some_and(|next| next.text == ")");
        if token.text != "super" || chained || visibility {
            continue;
        }
        let length = tokens[i..].chunks(2).take_while(|pair| pair[0].text == "super").count();
        let nesting = inline.iter().filter(|(start, end)| (*start..=*end).contains(&i)).count();
        if length >= module_depth(&file.path) + nesting {
            found.push(token.offset);
        }
    }
    found
}

/// Length of a file's module path: 0 for the crate root, 1 for the face of a room.
fn module_depth(path: &str) -> usize {
    let inside = path.trim_start_matches("src/").trim_end_matches(".rs");
    inside.split('/').filter(|part| !["lib", "main", "mod"].contains(part)).count()
}

/// A file opens with `//!`: what goes in, what comes out, what it deliberately does not do. The face of a room says it in these
/// words, or as an arrow `X -> Y`; `base` is vocabulary, through which nothing flows.
pub fn headers(repository: &Repository) -> Vec<Fault> {
    const RULE: &str = "file header";
    let mut faults = Vec::new();
    for file in repository.sources() {
        let header: Vec<&str> = file.text.lines().map_while(|line| line.strip_prefix("//!")).collect();
        let header = header.join(" ");
        let words = header.split_whitespace().filter(|word| word.chars().any(char::is_alphanumeric)).count();
        if words == 0 {
            faults.push(file.fault(0, RULE, "the file does not open with `//!`: what goes in, what comes out"));
        } else if words < HEADER_WORDS_MIN {
            let reason = format!("{words} words do not say what goes in, what comes out and what the file does not do");
            faults.push(file.fault(0, RULE, reason));
        }
        let is_face = file.room().is_some_and(|room| room != "base" && file.path == format!("src/{room}/mod.rs"));
        let says_flow = (header.contains("In:") && header.contains("Out:")) || header.contains("->");
        if is_face && words >= HEADER_WORDS_MIN && !says_flow {
            faults.push(file.fault(0, RULE, "the face of a room says `In: ... Out: ...`, or `X -> Y`"));
        }
    }
    faults
}

/// Files and functions that can be read in one sitting.
pub fn lengths(repository: &Repository) -> Vec<Fault> {
    const RULE: &str = "length";
    let mut faults = Vec::new();
    for file in repository.files.iter().filter(|file| file.path.ends_with(".rs")) {
        let lines = file.text.lines().count();
        if lines > FILE_LINES_MAX {
            let reason = format!("{lines} lines; {FILE_LINES_MAX} at most, so that the file is read in one sitting");
            faults.push(file.fault(0, RULE, reason));
        }
        let code = code_only(&file.text);
        for (name, offset, lines) in function_lengths(file, &tokens(&code)) {
            if lines > FUNCTION_LINES_MAX {
                let reason = format!("`{name}` has {lines} lines; {FUNCTION_LINES_MAX} at most: one screen");
                faults.push(file.fault(offset, RULE, reason));
            }
        }
    }
    faults
}

/// Name, place and lines of every function with a body.
fn function_lengths<'a>(file: &TextFile, tokens: &[Token<'a>]) -> Vec<(&'a str, usize, usize)> {
    let mut found = Vec::new();
    for (i, pair) in tokens.windows(2).enumerate() {
        if pair[0].text != "fn" || !pair[1].is_word() {
            continue;
        }
        let mut at = i + 2;
        let mut depth = 0_i32;
        let body = loop {
            match tokens.get(at).map(|token| token.text) {
                Some("(" | "[") => depth += 1,
                Some(")" | "]") => depth -= 1,
                Some("{") if depth == 0 => break Some(at),
                Some(";") if depth == 0 => break None,
                None => break None,
                _ => {}
            }
            at += 1;
        };
        if let Some(open) = body {
            let end = tokens[closing(tokens, open)].offset;
            found.push((pair[1].text, pair[0].offset, file.line_at(end) - file.line_at(pair[0].offset) + 1));
        }
    }
    found
}

/// No `util`, `common`, `helpers`, `types`, `manager`: such a room collects what nobody thought about.
pub fn names(repository: &Repository) -> Vec<Fault> {
    let mut faults = Vec::new();
    for file in repository.sources() {
        let parts = file.path.trim_end_matches(".rs").split('/').skip(1);
        for part in parts.filter(|part| NAMES_OF_NO_ROOM.contains(part)) {
            let reason = format!("`{part}` says nothing: put the code into the room of its stage");
            faults.push(file.fault(0, "name", reason));
        }
    }
    faults
}

/// Every file under `src/` is reached from `lib.rs` or `main.rs` through `mod`: a dead file is neither compiled nor tested.
pub fn dead_files(repository: &Repository) -> Vec<Fault> {
    let mut reached = BTreeSet::new();
    let mut open: Vec<String> = ["src/lib.rs", "src/main.rs"].map(str::to_owned).to_vec();
    while let Some(path) = open.pop() {
        let Some(file) = repository.file(&path) else { continue };
        if !reached.insert(path.clone()) {
            continue;
        }
        let (folder, name) = path.rsplit_once('/').expect("a path in src/");
        let stem = name.trim_end_matches(".rs");
        let inside =
            if ["lib", "main", "mod"].contains(&stem) { folder.to_owned() } else { format!("{folder}/{stem}") };
        for module in declared_modules(&tokens(&code_only(&file.text))) {
            open.push(format!("{inside}/{module}.rs"));
            open.push(format!("{inside}/{module}/mod.rs"));
        }
    }
    repository
        .sources()
        .filter(|file| !reached.contains(&file.path))
        .map(|file| file.fault(0, "dead file", "no `mod` leads here: the file is neither compiled nor tested"))
        .collect()
}
