//! Rules about words: units at the end of names, citations, what the library must not call, paths that must not be committed.
//!
//! In: a [`Repository`]. Out: [`Fault`]s. The units come from the table in the head of `src/base/units.rs`, the references from the
//! headings of `REFERENCES.md`: one place each.

use super::scan::{Fault, Repository, TextFile, Token, closing, code_only, split_at_commas, tokens};
use std::collections::BTreeSet;

/// Keys of machine files that have no unit: factors, weights and directions, as users know them.
const KEYS_WITHOUT_UNIT: [&str; 13] = [
    "format",
    "index",
    "blocks",
    "f_s",
    "alpha",
    "tolerance_ratio",
    "tolerance_ratio_reversal",
    "overload_factor",
    "direction",
    "velocity_feedforward",
    "torque_feedforward",
    "gear_ratio",
    "curve",
];
/// Names that say by themselves that the number is dimensionless.
const NAMES_WITHOUT_UNIT: [&str; 6] = ["u", "factor", "ratio", "share", "direction", "quaternion_xyzw"];
/// Rooms at a border, and names that are fine there: the unit comes from what stands beside the number (an NC word and the modes
/// that are active, a key of the machine file, a field of the schema).
const NAMES_AT_BORDERS: [(&[&str], &[&str]); 6] = [
    // An estimate of any key of the machine file: its unit stands beside it.
    (&["identify"], &["value", "low", "high", "friction_points"]),
    // Gains and errors of any axis: the gain, the axis and the objective say their unit.
    (
        &["tune"],
        &["value", "values", "before", "low", "high", "rms", "peak", "mean_square", "inside", "range", "of", "heights"],
    ),
    // A signal of a trace has its unit beside it, as text.
    (&["trace", "compare", "report"], &["value", "values", "limit", "offset"]),
    // Figures of any signal: the unit of the signal stands beside them.
    (
        &["compare", "report"],
        &[
            "value",
            "values",
            "low_values",
            "high_values",
            "rms",
            "max",
            "p95",
            "bias",
            "zero",
            "scale",
            "side_rms",
            "side_max",
            "found",
        ],
    ),
    (&["program", "interpreter", "machine", "recorder", "cli"], &["value", "values", "number"]),
    (&["program", "interpreter"], &["argument", "arguments", "left", "right", "feed"]),
];
/// Types that hold floats under one name.
const WRAPPERS: [&str; 5] = ["Option<", "Vec<", "Box<", "Spanned<", "std::ops::Range<"];

/// The closed list of units, from the table that opens `src/base/units.rs`: `mm_s2` and so on, without the first underscore.
pub fn units(repository: &Repository) -> BTreeSet<String> {
    let Some(file) = repository.file("src/base/units.rs") else { return BTreeSet::new() };
    let table = file.text.lines().map_while(|line| line.strip_prefix("//!"));
    table
        .flat_map(|line| line.split('`').skip(1).step_by(2))
        .filter_map(|word| word.strip_prefix('_').map(str::to_owned))
        .collect()
}

/// Whether a name ends in a unit of the list, or in a product or quotient of such: `speed_gain_n_m_s_per_rad`.
pub fn ends_in_unit(name: &str, units: &BTreeSet<String>) -> bool {
    let words: Vec<&str> = name.split('_').collect();
    // The first word is what is measured.
    (1..words.len()).any(|start| is_unit(&words[start..], units))
}

fn is_unit(words: &[&str], units: &BTreeSet<String>) -> bool {
    if units.contains(&words.join("_")) {
        return true;
    }
    match words.iter().position(|word| *word == "per") {
        Some(0) => words.len() > 1 && is_product(&words[1..], units),
        Some(at) => is_product(&words[..at], units) && is_product(&words[at + 1..], units),
        None => is_product(words, units),
    }
}

fn is_product(words: &[&str], units: &BTreeSet<String>) -> bool {
    words.is_empty()
        || (1..=words.len()).any(|n| units.contains(&words[..n].join("_")) && is_product(&words[n..], units))
}

/// Public fields and parameters of type `f64` end in their unit: a number without one is read wrongly sooner or later.
pub fn float_names(repository: &Repository) -> Vec<Fault> {
    let units = units(repository);
    let mut faults = Vec::new();
    for file in repository.sources() {
        let code = code_only(&file.text);
        let tokens = tokens(&code);
        for (name, offset) in public_floats(&tokens) {
            let fine = ends_in_unit(name, &units)
                || NAMES_WITHOUT_UNIT.contains(&name)
                || KEYS_WITHOUT_UNIT.contains(&name)
                || fine_at_border(file, name);
            if !fine {
                let reason = format!("`{name}: f64` does not end in a unit of the list in src/base/units.rs");
                faults.push(file.fault(offset, "unit", reason));
            }
        }
    }
    faults
}

fn fine_at_border(file: &TextFile, name: &str) -> bool {
    let room = file.room().unwrap_or_default();
    NAMES_AT_BORDERS.iter().any(|(rooms, names)| rooms.contains(&room) && names.contains(&name))
}

/// Names of public fields, of fields of public enums and of parameters of public functions that are floats.
fn public_floats<'a>(tokens: &[Token<'a>]) -> Vec<(&'a str, usize)> {
    let mut found = Vec::new();
    for i in 0..tokens.len() {
        if tokens[i].text != "pub" || tokens.get(i + 1).is_some_and(|next| next.text == "(") {
            continue;
        }
        let qualifiers = ["const", "async", "unsafe", "extern"];
        let at = (i + 1..tokens.len()).find(|at| !qualifiers.contains(&tokens[*at].text)).unwrap_or(tokens.len() - 1);
        let Some(body) = body_of(tokens, at) else { continue };
        match tokens[at].text {
            "struct" => found.extend(fields(body, true)),
            "enum" => {
                for variant in split_at_commas(body) {
                    if let Some(open) = variant.iter().position(|token| token.text == "{") {
                        found.extend(fields(&variant[open + 1..closing(variant, open)], false));
                    }
                }
            }
            "fn" => found.extend(fields(body, false)),
            _ => {}
        }
    }
    found
}

/// What stands in the braces of a struct or enum, or in the parentheses of a function, after name and generics.
fn body_of<'t, 'a>(tokens: &'t [Token<'a>], keyword: usize) -> Option<&'t [Token<'a>]> {
    let opens = match tokens[keyword].text {
        "struct" | "enum" => "{",
        "fn" => "(",
        _ => return None,
    };
    let mut at = keyword + 2;
    while let Some(token) = tokens.get(at) {
        match token.text {
            "<" => at = closing(tokens, at),
            text if text == opens => return Some(&tokens[at + 1..closing(tokens, at)]),
            ";" | "(" => return None,
            _ => {}
        }
        at += 1;
    }
    None
}

/// `name: type` parts whose type is a float.
fn fields<'a>(body: &[Token<'a>], only_public: bool) -> Vec<(&'a str, usize)> {
    let mut found = Vec::new();
    for mut part in split_at_commas(body) {
        while part.first().is_some_and(|token| token.text == "#") {
            part = &part[closing(part, 1) + 1..];
        }
        let public = part.first().is_some_and(|token| token.text == "pub");
        if public {
            part = &part[1..];
        }
        let restricted = part.first().is_some_and(|token| token.text == "(");
        let Some(colon) = part.iter().position(|token| token.text == ":") else { continue };
        if colon == 0 || restricted || (only_public && !public) {
            continue;
        }
        let name = part[colon - 1];
        let kind: String =
            part[colon + 1..].iter().filter(|token| !is_reference(token)).map(|token| token.text).collect();
        if name.is_word() && is_float(&kind) {
            found.push((name.text, name.offset));
        }
    }
    found
}

fn is_reference(token: &Token<'_>) -> bool {
    token.text == "&" || token.text == "mut" || token.text.starts_with('\'')
}

fn is_float(kind: &str) -> bool {
    if kind == "f64" || kind == "f32" {
        return true;
    }
    if let Some(inside) = kind.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
        return is_float(inside.split(';').next().unwrap_or(inside));
    }
    let inside = WRAPPERS.iter().find_map(|wrapper| kind.strip_prefix(wrapper));
    inside.and_then(|rest| rest.strip_suffix('>')).is_some_and(is_float)
}

/// A numeric key of a machine file ends in its unit, or is one of the few that have none.
pub fn machine_keys(repository: &Repository) -> Vec<Fault> {
    let units = units(repository);
    let mut faults = Vec::new();
    for file in repository.files.iter().filter(|f| f.path.starts_with("machines/") && f.path.ends_with(".toml")) {
        for (key, offset) in numeric_keys(&file.text) {
            if !ends_in_unit(key, &units) && !KEYS_WITHOUT_UNIT.contains(&key) {
                let reason = format!("`{key}` does not end in a unit of the list in src/base/units.rs");
                faults.push(file.fault(offset, "unit", reason));
            }
        }
    }
    faults
}

/// Keys in front of a number or a list of numbers, inline tables included.
fn numeric_keys(toml: &str) -> Vec<(&str, usize)> {
    let mut found = Vec::new();
    let mut line_start = 0;
    for line in toml.split_inclusive('\n') {
        let text = line.split('#').next().unwrap_or(line);
        for (at, _) in text.match_indices('=') {
            let key = text[..at].trim_end();
            let start = key.rfind(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).map_or(0, |place| place + 1);
            let value = text[at + 1..].trim_start().trim_start_matches('[').trim_start();
            if value.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+') || value.starts_with("inf") {
                found.push((&toml[line_start + start..line_start + key.len()], line_start + start));
            }
        }
        line_start += line.len();
    }
    found
}

/// Conversion factors stand in `base/units.rs` and nowhere else.
pub fn conversions(repository: &Repository) -> Vec<Fault> {
    let mut faults = Vec::new();
    for file in repository.sources().filter(|file| file.path != "src/base/units.rs") {
        let code = code_only(&file.text);
        let tokens = tokens(&code);
        for (i, token) in tokens.iter().enumerate() {
            let factor = token.text == "*" || token.text == "/";
            // `60.0` is three tokens here: `60`, `.`, `0`.
            let minutes = factor && tokens.get(i + 1).is_some_and(|next| next.text == "60") && dot(&tokens, i + 2);
            if token.text == "to_radians" || token.text == "to_degrees" || minutes {
                let reason = "convert through base::units: a factor that is written twice is wrong once";
                faults.push(file.fault(token.offset, "conversion", reason));
            }
        }
    }
    faults
}

fn dot(tokens: &[Token<'_>], at: usize) -> bool {
    tokens.get(at).is_some_and(|token| token.text == ".")
}

/// `[Author year...]` is a heading of `REFERENCES.md`, and so is a model that a comment names.
pub fn citations(repository: &Repository) -> Vec<Fault> {
    let references = repository.file("REFERENCES.md").map(|file| file.text.as_str()).unwrap_or_default();
    let headings: BTreeSet<&str> =
        references.lines().filter_map(|line| line.strip_prefix("## ")).map(str::trim).collect();
    let mut faults = Vec::new();
    for file in repository.files.iter().filter(|file| cites(file)) {
        for (key, offset) in cited_keys(&file.text) {
            if !headings.contains(key.as_str()) {
                faults.push(file.fault(offset, "citation", format!("`{key}` is no heading of REFERENCES.md")));
            }
        }
        for (name, offset) in cited_models(&file.text) {
            if !references.contains(&format!("`{name}`")) {
                faults.push(file.fault(offset, "citation", format!("`{name}` is not explained in REFERENCES.md")));
            }
        }
    }
    faults
}

fn cites(file: &TextFile) -> bool {
    let place = ["src/", "docs/", "machines/", "benches/", "README.md"];
    place.iter().any(|start| file.path.starts_with(start))
        || (file.path.starts_with("tests/") && !file.path.starts_with("tests/tidy"))
}

/// `Essid 2019` in `[Essid 2019, eq. 13]`.
fn cited_keys(text: &str) -> Vec<(String, usize)> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices('[') {
        let inside = &text[at + 1..];
        let mut words = inside.splitn(2, ' ');
        let (author, rest) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
        let is_author = author.chars().count() > 2
            && author.starts_with(char::is_uppercase)
            && author.chars().all(|c| c.is_alphabetic() || c == '-');
        let year: String = rest.chars().take_while(char::is_ascii_digit).collect();
        let ends = rest[year.len()..].starts_with([',', ']', ';', ' ', 'a', 'b']);
        if is_author && ends && year.len() == 4 && (year.starts_with("19") || year.starts_with("20")) {
            found.push((format!("{author} {year}"), at));
        }
    }
    found
}

/// `models/drive.md`.
fn cited_models(text: &str) -> Vec<(String, usize)> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("models/") {
        let name: String =
            text[at..].chars().take_while(|c| c.is_ascii_alphanumeric() || "/-_.".contains(*c)).collect();
        if let Some(end) = name.find(".md") {
            found.push((name[..end + 3].to_owned(), at));
        }
    }
    found
}

/// Where something may be called although the library must not: (call, rooms and files that may, reason).
const FORBIDDEN: [(&[&str], &[&str], &str); 4] = [
    (
        &["println !", "eprintln !", "print !", "eprint !", "dbg !"],
        &["cli", "src/main.rs"],
        "a signal is recorded, not printed: only the command line speaks",
    ),
    (&["env :: var", "env :: vars", "env :: var_os"], &["cli"], "no environment variable is an invisible switch"),
    (&["SystemTime"], &["cli"], "equal inputs give equal bytes: no wall clock"),
    (&["todo !", "unimplemented !"], &[], "what ships is real: no stubs"),
];

/// The library neither prints, nor reads the environment or the calendar, nor leaves stubs.
pub fn forbidden(repository: &Repository) -> Vec<Fault> {
    let mut faults = Vec::new();
    for file in repository.sources() {
        let code = code_only(&file.text);
        let tokens = tokens(&code);
        for (calls, allowed, reason) in FORBIDDEN {
            if allowed.contains(&file.path.as_str()) || file.room().is_some_and(|room| allowed.contains(&room)) {
                continue;
            }
            for call in calls {
                let words: Vec<&str> = call.split(' ').collect();
                for window in tokens.windows(words.len()).filter(|w| w.iter().map(|t| t.text).eq(words.iter().copied()))
                {
                    faults.push(file.fault(
                        window[0].offset,
                        "forbidden",
                        format!("`{}`: {reason}", call.replace(' ', "")),
                    ));
                }
            }
        }
    }
    faults
}

/// Rooms between a program and its recording.
const PORTABLE_ROOMS: [&str; 8] =
    ["interpreter", "geometry", "smoothing", "kinematics", "feed", "interpolator", "drive", "kernel"];
/// Frequency responses are shown, and stand in no recording.
const SHOWN_ONLY: &str = "src/drive/frequency.rs";
/// Methods of `f64` that the C library of the system computes, and what calls one of them.
const OF_THE_SYSTEM: &str = "sin cos tan asin acos atan atan2 sin_cos sinh cosh tanh asinh acosh atanh exp exp2 exp_m1 ln ln_1p log log2 log10 \
                             powf hypot cbrt from_axis_angle";

/// What the C library computes has other last bits on another processor: the way from a program to its recording takes `base::Portable`.
pub fn system_functions(repository: &Repository) -> Vec<Fault> {
    let mut faults = Vec::new();
    for file in repository.sources() {
        if !file.room().is_some_and(|room| PORTABLE_ROOMS.contains(&room)) || file.path == SHOWN_ONLY {
            continue;
        }
        let code = code_only(&file.text);
        for three in tokens(&code).windows(3) {
            let called = three[0].text == "." && three[2].text == "(";
            let named = ["f64", "UnitQuaternion"].contains(&three[0].text) && three[1].text == "::";
            let name = if called { three[1] } else { three[2] };
            if (called || named) && OF_THE_SYSTEM.split_whitespace().any(|word| word == name.text) {
                let reason = format!("`{}` has other last bits on another processor: take base::Portable", name.text);
                faults.push(file.fault(name.offset, "portable", reason));
            }
        }
    }
    faults
}

/// No path of the machine on which something was built or recorded: it means nothing to a reader, and tells what it should not.
pub fn machine_paths(repository: &Repository) -> Vec<Fault> {
    // Joined here, so that this file does not break its own rule.
    let starts = ["home", "root", "Users", "work", "tmp"].map(|folder| format!("/{folder}/"));
    let mut faults = Vec::new();
    for file in &repository.files {
        for start in &starts {
            for (at, _) in file.text.match_indices(start.as_str()) {
                let before = file.text[..at].chars().next_back();
                if before.is_none_or(|c| !(c.is_alphanumeric() || "./_-}$~".contains(c))) {
                    let reason = format!("`{start}...` is a path of the machine that it was written on");
                    faults.push(file.fault(at, "path", reason));
                }
            }
        }
    }
    faults
}
