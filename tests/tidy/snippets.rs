//! Every rule on a snippet that breaks it and on one that keeps it: a rule that cannot fail is no rule.
//!
//! In: snippets of sources and documents, written here. Out: the lines at which each rule finds a fault.

use super::scan::{Fault, Repository, code_only};
use super::{documents, house, words};

const LIB: (&str, &str) = ("src/lib.rs", "pub mod base;\npub mod feed;\npub mod drive;\npub mod cli;\n");
const UNITS: (&str, &str) = (
    "src/base/units.rs",
    "//! | `_mm`, `_mm_s2` | length |\n//! | `_rad`, `_s`, `_n_m`, `_v`, `_a`, `_per_s`, `_ratio` | more |\n",
);

/// Lines at which `rule` finds a fault in one file beside `src/lib.rs` and the table of units.
fn lines(rule: fn(&Repository) -> Vec<Fault>, path: &str, text: &str) -> Vec<usize> {
    let faults = rule(&Repository::of(&[LIB, UNITS, (path, text)]));
    faults.iter().filter(|fault| fault.path == path).map(|fault| fault.line).collect()
}

#[test]
fn a_room_may_not_look_down() {
    let path = "src/feed/profile.rs";
    assert_eq!(lines(house::imports, path, "use crate::base::Tick;\nuse crate::drive::Gain;\n"), [2]);
    assert_eq!(lines(house::imports, path, "use crate::{\n    base,\n    cli::run,\n};\n"), [3]);
    assert_eq!(lines(house::imports, path, "fn f() {\n    crate::drive::g();\n}\n"), [2]);
    assert_eq!(
        lines(house::imports, path, "// crate::drive\n/// [`crate::drive`]\nconst A: &str = \"crate::drive\";\n"),
        [0; 0]
    );
    assert_eq!(lines(house::imports, path, "use super::Phase;\nuse super::super::drive;\n"), [2]);
    assert_eq!(lines(house::imports, "src/feed/mod.rs", "use super::base;\nmod tests {\n    use super::*;\n}\n"), [1]);
    assert_eq!(lines(house::imports, "src/feed/mod.rs", "pub(super) fn f() {}\npub(crate) fn g() {}\n"), [0; 0]);
}

#[test]
fn a_file_without_a_head_is_found() {
    let head = "//! In: joint paths, one after the other. Out: the time law of each, fixed for good.\n";
    assert_eq!(lines(house::headers, "src/feed/mod.rs", "use std::fmt;\n"), [1]);
    assert_eq!(lines(house::headers, "src/feed/mod.rs", "//! placeholder\n"), [1]);
    assert_eq!(lines(house::headers, "src/feed/mod.rs", head), [0; 0]);
    let vague = "//! This room does all sorts of things that have to do with the speed along the path.\n";
    assert_eq!(lines(house::headers, "src/feed/mod.rs", vague), [1]);
    assert_eq!(lines(house::headers, "src/feed/profile.rs", vague), [0; 0]);
}

#[test]
fn what_is_too_long_is_found() {
    let body = "    f();\n".repeat(79);
    let long = format!("fn a() {{}}\nfn b() where [u8; 3]: Sized {{\n{body}}}\n");
    assert_eq!(lines(house::lengths, "src/feed/mod.rs", &long), [2]);
    assert_eq!(lines(house::lengths, "src/feed/mod.rs", &long.replacen("    f();\n", "", 1)), [0; 0]);
    assert_eq!(lines(house::lengths, "tests/feed.rs", &"//\n".repeat(601)), [1]);
    assert_eq!(lines(house::lengths, "tests/feed.rs", &"//\n".repeat(600)), [0; 0]);
    // A brace in a string or a character does not end a function.
    let braces = format!("fn a() {{\n    g(\"}}\", '}}', r#\"}}\"}}\"#);\n{body}}}\n");
    assert_eq!(lines(house::lengths, "src/feed/mod.rs", &braces), [1]);
}

#[test]
fn leftovers_and_dead_files_are_found() {
    assert_eq!(lines(house::names, "src/feed/helpers.rs", ""), [1]);
    assert_eq!(lines(house::names, "src/util/mod.rs", ""), [1]);
    assert_eq!(lines(house::names, "src/feed/types_of_limit.rs", ""), [0; 0]);
    let files = [
        LIB,
        ("src/feed/mod.rs", "mod ramp;\n// mod old;\n"),
        ("src/feed/ramp.rs", "mod table;"),
        ("src/feed/ramp/table.rs", ""),
        ("src/feed/old.rs", ""),
        ("src/table.rs", ""),
    ];
    let dead: Vec<String> = house::dead_files(&Repository::of(&files)).into_iter().map(|fault| fault.path).collect();
    assert_eq!(dead, ["src/feed/old.rs", "src/table.rs"]);
}

#[test]
fn floats_without_a_unit_are_found() {
    let path = "src/feed/wire.rs";
    let fields = "pub struct A<T: Fn(f64) -> f64> {\n    pub speed: f64,\n    pub speed_mm_s2: f64,\n    #[serde(default)]\n    \
                  pub list: Option<Vec<f64>>,\n    hidden: f64,\n    pub all: PerAxis<f64>,\n    pub f: T,\n}\n";
    assert_eq!(lines(words::float_names, path, fields), [2, 5]);
    let function =
        "pub fn f<'a>(\n    &self,\n    time: &'a mut [f64],\n    step_s: f64,\n    pair: [f64; 2],\n) -> f64 {}\n";
    assert_eq!(lines(words::float_names, path, function), [3, 5]);
    assert_eq!(lines(words::float_names, path, "fn f(x: f64) {}\npub(crate) fn g(x: f64) {}\n"), [0; 0]);
    assert_eq!(
        lines(words::float_names, path, "pub enum E {\n    A { wait: f64 },\n    B(f64),\n    C { wait_s: f64 },\n}\n"),
        [2]
    );
    let quotients = "pub fn f(gain_n_m_s_per_rad: f64, gain_v_per_a: f64, gain_per_s: f64, a_ratio: f64, u: f64) {}\n";
    assert_eq!(lines(words::float_names, path, quotients), [0; 0]);
    // A unit needs something that is measured in it, and a unit of the list.
    assert_eq!(lines(words::float_names, path, "pub fn f(mm: f64) {}\npub fn g(x_furlong: f64) {}\n"), [1, 2]);
    assert_eq!(lines(words::float_names, "src/interpreter/value.rs", "pub fn f(value: f64) {}\n"), [0; 0]);
    assert_eq!(lines(words::float_names, path, "pub fn f(value: f64) {}\n"), [1]);
}

#[test]
fn machine_keys_without_a_unit_are_found() {
    let toml = "format = 1\n[axes.X]\nname = \"X\"\nvelocity_max = 20.0 # = 3\ntravel_mm = [-1.0, 1.0]\nhome = -1\n\
                rotary = [{ axis = \"A\", direction = [-1, 0, 0], point = [0, 0, 0] }]\nspeed_max = inf\nmodulo = true\n";
    assert_eq!(lines(words::machine_keys, "machines/a.toml", toml), [4, 6, 7, 8]);
}

#[test]
fn conversions_elsewhere_are_found() {
    let code = "fn f() {\n    a.to_radians();\n    b * 60.0;\n    c / 60.0;\n    d * 0.60;\n    n * 60;\n}\n";
    assert_eq!(lines(words::conversions, "src/feed/a.rs", code), [2, 3, 4]);
    assert_eq!(lines(words::conversions, "src/base/units.rs", code), [0; 0]);
}

#[test]
fn citations_without_a_reference_are_found() {
    let references = ("REFERENCES.md", "## Essid 2019\n\n## Prévost 2009\n\n`models/drive.md`\n");
    let code = "// [Essid 2019, eq. 13] [Prévost 2009]\n// [Nobody 2001, fig. 2]\n// [Kv], [J 2]\n// models/drive.md section 2\n\
                // models/magic.md\n";
    let faults = words::citations(&Repository::of(&[references, ("src/drive/a.rs", code)]));
    assert_eq!(faults.iter().map(|fault| fault.line).collect::<Vec<_>>(), [2, 5]);
}

#[test]
fn what_the_library_must_not_call_is_found() {
    let code = "fn f() {\n    println!(\"a\");\n    std::env::var(\"A\");\n    todo!();\n    SystemTime::now();\n    env!(\"A\");\n    \
                writeln!(a);\n}\n";
    assert_eq!(lines(words::forbidden, "src/feed/a.rs", code), [2, 3, 5, 4]);
    assert_eq!(lines(words::forbidden, "src/cli/run.rs", code), [4]);
    assert_eq!(lines(words::forbidden, "src/main.rs", code), [3, 5, 4]);
}

#[test]
fn functions_of_the_system_are_found() {
    let code = "let (s, c) = a.sin_cos();\n// a.sin()\nlet b = libm::sin(a) + a.portable_cos().sqrt();\nf(f64::hypot, \"x.ln()\", a.powi(2));\n";
    assert_eq!(lines(words::system_functions, "src/feed/a.rs", code), [1, 4]);
    for path in ["src/report/page.rs", "src/drive/frequency.rs", "tests/feed/a.rs"] {
        assert!(lines(words::system_functions, path, code).is_empty(), "{path}");
    }
}

#[test]
fn paths_of_a_build_machine_are_found() {
    let text = format!(
        "see {slash}home{slash}anna{slash}x\nsee docs{slash}home{slash}x\n\"{slash}work{slash}a\"\n",
        slash = '/'
    );
    assert_eq!(lines(words::machine_paths, "docs/a.md", &text), [1, 3]);
}

#[test]
fn links_to_nowhere_are_found() {
    let text = "[a](b.md) [c](../README.md#top)\n[d](gone.md)\n<img src=\"gone.svg\">\n```\n[e](gone.md)\n```\n`[f](gone.md)`\n\
                [g](https://example.org/x) [h](#here) [i](.)\n";
    let faults = documents::links(&Repository::of(&[("docs/a.md", text), ("docs/b.md", ""), ("README.md", "")]));
    assert_eq!(faults.iter().map(|fault| fault.line).collect::<Vec<_>>(), [2, 3]);
}

#[test]
fn a_document_beside_the_index_is_found() {
    let index = ("docs/README.md", "[a](a.md)\n");
    let faults = documents::index(&Repository::of(&[index, ("docs/a.md", ""), ("docs/b.md", "")]));
    assert_eq!(faults.iter().map(|fault| fault.path.as_str()).collect::<Vec<_>>(), ["docs/b.md"]);
}

#[test]
fn code_is_told_from_comments_and_strings() {
    let text = "a /* b /* c */ d */ e // f\n'g' 'h: 'loop r\"i\" br#\"j\"k\"# \"l\\\"m\" '\\'' '\u{b5}' n";
    let code = code_only(text);
    assert_eq!(code.len(), text.len());
    assert_eq!(code.split_whitespace().collect::<Vec<_>>(), ["a", "e", "'h:", "'loop", "n"]);
}
