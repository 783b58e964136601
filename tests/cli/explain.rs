//! Every code has a page, every page a code, and the command finds it.
//!
//! In: the sources as text, the pages as text, the built program. Out: codes without a page or the other way round.

use sollwert::program::codes::CODES;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn sollwert(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sollwert")).args(arguments).output().expect("the program starts")
}

fn stdout(arguments: &[&str]) -> String {
    let output = sollwert(arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Code and title of each page, as the files have them.
fn headings() -> Vec<(String, String)> {
    let texts = ["program", "other"].map(|name| {
        std::fs::read_to_string(Path::new(ROOT).join("docs/errors").join(name).with_extension("md")).unwrap()
    });
    let headings = texts.iter().flat_map(|text| text.lines()).filter_map(|line| line.strip_prefix("## "));
    headings.map(|line| line.split_once(": ").unwrap_or_else(|| panic!("no title: {line}"))).map(owned).collect()
}

fn owned((code, title): (&str, &str)) -> (String, String) {
    (code.to_owned(), title.to_owned())
}

fn sources(folder: PathBuf, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
}

/// Every text of the form "E0104" in the sources.
fn codes_in_use() -> BTreeSet<String> {
    let mut files = Vec::new();
    sources(Path::new(ROOT).join("src"), &mut files);
    let is_code = |text: &str| {
        text.len() == 5
            && text.as_bytes()[0].is_ascii_uppercase()
            && text[1..].bytes().all(|byte| byte.is_ascii_digit())
    };
    let texts = files.iter().map(|path| std::fs::read_to_string(path).unwrap());
    texts.flat_map(|text| text.split('"').filter(|part| is_code(part)).map(str::to_owned).collect::<Vec<_>>()).collect()
}

#[test]
fn every_code_has_a_page_and_every_page_a_code() {
    let pages: BTreeSet<String> = headings().into_iter().map(|(code, _)| code).collect();
    assert_eq!(pages.len(), headings().len(), "a page stands twice");
    let used = codes_in_use();
    assert!(used.len() > 90, "{used:?}");
    let missing: Vec<_> = used.difference(&pages).collect();
    let stray: Vec<_> = pages.difference(&used).collect();
    assert!(missing.is_empty() && stray.is_empty(), "without a page: {missing:?}; without a code: {stray:?}");
}

#[test]
fn the_titles_are_those_of_the_codes() {
    let headings = headings();
    for (code, title) in CODES {
        assert!(headings.contains(&owned((code, title))), "{code}: {title}");
    }
}

#[test]
fn a_page_is_printed_as_it_stands_in_the_folder() {
    let page = stdout(&["explain", "e0504"]);
    assert!(page.starts_with("E0504: The end of an arc is not on its circle\n\n"), "{page}");
    assert!(page.contains("Wrong:") && page.contains("N20 G3 X0 Y10 I=AC(0) J=AC(0)") && !page.contains("E0505"));
    let document: serde_json::Value = serde_json::from_str(&stdout(&["explain", "E0504", "--json"])).unwrap();
    assert_eq!((document["format"].as_u64(), document["code"].as_str()), (Some(1), Some("E0504")));
    for (code, title) in headings() {
        assert!(stdout(&["explain", &code]).starts_with(&format!("{code}: {title}\n")));
    }
}

#[test]
fn the_list_has_all_codes() {
    let list = stdout(&["explain"]);
    assert_eq!(
        list.lines().map(|line| line[..5].to_owned()).collect::<Vec<_>>(),
        headings().into_iter().map(|(code, _)| code).collect::<Vec<_>>()
    );
}

#[test]
fn an_unknown_code_names_the_nearest() {
    let output = sollwert(&["explain", "E0194"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("C0005") && said.contains("did you mean `E0104`"), "{said}");
    let output = sollwert(&["explain", "x", "--json"]);
    let document: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((output.status.code(), document["errors"][0]["code"].as_str()), (Some(2), Some("C0005")));
}

#[test]
fn an_error_names_the_command_that_explains_it() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("explain");
    std::fs::create_dir_all(&folder).unwrap();
    let program = folder.join("typo.mpf");
    std::fs::write(&program, "N10 G1 X F100\n").unwrap();
    let output = sollwert(&["check", program.to_str().unwrap(), "-m", "spinner_mvc850"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains("error[E0104]") && said.trim_end().ends_with("`sollwert explain E0104` says more about this.")
    );
}
