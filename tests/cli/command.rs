//! The command as scripts and strangers meet it: one JSON document whatever happens, exit codes, files that must not be destroyed.
//!
//! In: the built program, broken input. Out: a failure that names the arguments. Figures are not looked at: the rooms' tests do that.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const PROGRAM: &str = "N10 G1 X10 F3000 G642\nN20 Y10\nN30 M30\n";

/// A folder of its own with a good program, a machine, and broken files.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("directory")).expect("a new folder");
    let machine = include_str!("../../machines/spinner_mvc850.toml");
    for (file, text) in
        [("good.mpf", PROGRAM), ("machine.toml", machine), ("empty", ""), ("junk", "\u{1}\u{2}junk\u{3}")]
    {
        fs::write(folder.join(file), text).expect("a file");
    }
    folder
}

fn sollwert(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sollwert"));
    command.args(arguments).current_dir(folder).output().expect("the program starts")
}

fn errors_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn json_is_one_document_whatever_is_wrong_with_the_input() {
    let folder = folder("command_json");
    for input in ["missing", "directory", "empty", "junk"] {
        let calls: [&[&str]; 12] = [
            &["run", input, "-o", "x.mcap"],
            &["run", "good.mpf", "-o", "x.mcap", "-m", input],
            &["time", input],
            &["check", input],
            &["moves", input],
            &["follow", input, "-o", "x.mcap"],
            &["export", input, "-o", "x.csv"],
            &["recover", input, "-o", "x.mcap"],
            &["machine", "check", input],
            &["compare", input, "good.mpf"],
            &["report", input, "-o", "x.html"],
            &["machine", "bode", input],
        ];
        for call in calls {
            let output = sollwert(&folder, &[call, &["--json"]].concat());
            let document: Result<serde_json::Value, _> = serde_json::from_slice(&output.stdout);
            let document = document.unwrap_or_else(|error| panic!("{call:?}: {error}"));
            assert_eq!(document["format"], 1, "{call:?}");
            let code = output.status.code();
            assert!(matches!(code, Some(0..=2)), "{call:?}: {code:?} {}", errors_of(&output));
            if input == "missing" || input == "directory" {
                assert_eq!(code, Some(2), "{call:?}");
                assert!(!document["errors"][0]["message"].as_str().unwrap_or_default().is_empty(), "{call:?}");
            }
        }
    }
}

/// The page of `machine bode` stands alone; the document has every loop; a wrong axis is wrong usage with the right ones.
#[test]
fn frequency_responses_as_document_and_page() {
    let folder = folder("command_bode");
    let output = sollwert(&folder, &["machine", "bode", "machine.toml", "--axis", "x", "-o", "bode.html", "--json"]);
    let document: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    for of_loop in ["current", "speed", "position"] {
        let of_loop = &document["axes"]["X"][of_loop];
        let points = of_loop["closed"]["frequency_hz"].as_array().map_or(0, Vec::len);
        assert!(points > 50 && of_loop["stable"] == true, "{of_loop}");
        assert_eq!(
            of_loop["open"]["phase_deg"].as_array().map(Vec::len),
            of_loop["open"]["amplitude"].as_array().map(Vec::len)
        );
    }
    let page = fs::read_to_string(folder.join("bode.html")).expect("the page");
    assert!(page.contains("<svg") && page.contains("prefers-color-scheme:dark"));
    assert!(!page.contains("http") && !page.contains("<script") && !page.contains("NaN"));
    let table = sollwert(&folder, &["machine", "bode", "machine.toml"]);
    assert!(String::from_utf8_lossy(&table.stdout).contains("Z position"), "all axes without --axis");
    for wrong in [&["--axis", "Q"][..], &["--from-hz", "-1"], &["-o", "machine.toml"], &["-o", "no/folder/x.html"]] {
        let output = sollwert(&folder, &[&["machine", "bode", "machine.toml"], wrong].concat());
        assert_eq!(output.status.code(), Some(2), "{wrong:?}: {}", errors_of(&output));
    }
    assert!(errors_of(&sollwert(&folder, &["machine", "bode", "machine.toml", "--axis", "Q"])).contains("X, Y, Z"));
}

#[test]
fn shipped_programs_and_machines_work_in_an_empty_folder() {
    let folder = folder("command_shipped");
    for entry in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("programs")).expect("programs") {
        let name = entry.expect("a file").file_name().to_string_lossy().into_owned();
        if name.ends_with(".mpf") {
            let output = sollwert(&folder, &["check", &name, "-m", "xyzbc", "--json"]);
            assert_ne!(output.status.code(), Some(2), "{name}: {}", errors_of(&output));
        }
    }
}

#[test]
fn moves_say_in_json_what_ended_them() {
    let folder = folder("command_moves");
    fs::write(folder.join("wrong.mpf"), "G1 X1 F100\nG1 X=(2\n").expect("a program");
    let output = sollwert(&folder, &["moves", "wrong.mpf", "--json"]);
    let document: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one document");
    assert_eq!((output.status.code(), document["alarm"]["line"].as_u64()), (Some(1), Some(2)));
}

#[test]
fn an_output_never_destroys_an_input() {
    let folder = folder("command_same");
    fs::hard_link(folder.join("good.mpf"), folder.join("link.mpf")).expect("a hard link");
    for output in ["machine.toml", "good.mpf", "link.mpf", "./directory/../good.mpf"] {
        let done = sollwert(&folder, &["run", "good.mpf", "-m", "machine.toml", "-o", output]);
        assert_eq!(done.status.code(), Some(2), "{output}");
        assert!(errors_of(&done).contains("both input and output"), "{output}");
    }
    assert_eq!(fs::read_to_string(folder.join("good.mpf")).expect("the program"), PROGRAM);
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_behind_stdout_is_no_success() {
    let folder = folder("command_full");
    for call in
        [&["check", "good.mpf"][..], &["moves", "good.mpf"], &["time", "good.mpf", "--json"], &["machine", "list"]]
    {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("/dev/full");
        let mut command = Command::new(env!("CARGO_BIN_EXE_sollwert"));
        let output = command.args(call).current_dir(&folder).stdout(Stdio::from(full)).stderr(Stdio::piped()).output();
        let output = output.expect("the program starts");
        assert_eq!(output.status.code(), Some(2), "{call:?}");
        assert!(errors_of(&output).contains("cannot be written"), "{call:?}");
    }
}

#[test]
fn what_would_never_end_is_an_alarm() {
    let folder = folder("command_endless");
    for program in
        ["G1 F1000 X1EX15", "G1 F0.0000001 X10", "G4 F1EX9", "WHILE 1\nM8\nENDWHILE", "WHILE 1\nG4 F0\nENDWHILE"]
    {
        fs::write(folder.join("endless.mpf"), program).expect("a program");
        let output = sollwert(&folder, &["run", "endless.mpf", "-o", "x.mcap"]);
        assert_eq!(output.status.code(), Some(1), "{program}: {}", errors_of(&output));
        assert!(errors_of(&output).contains("endless.mpf:"), "{program}: no place");
    }
}

#[test]
fn a_word_that_stands_in_every_line_does_not_flood_the_terminal() {
    let folder = folder("command_flood");
    fs::write(folder.join("flood.mpf"), "G1 F100 X1 A3=1 B3=0 C3=0\n".repeat(50)).expect("a program");
    let output = sollwert(&folder, &["check", "flood.mpf"]);
    let shown = errors_of(&output).matches("error[").count();
    assert!((1..10).contains(&shown), "{shown} errors shown");
    let output = sollwert(&folder, &["check", "flood.mpf", "--json"]);
    let document: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one document");
    assert_eq!(document["errors"].as_array().map(Vec::len), Some(50));
}

#[test]
fn an_override_that_cannot_be_followed_is_wrong_usage_with_its_place() {
    let folder = folder("command_override");
    let continuous = ["--set", "feed.time_law=continuous"];
    let calls: [(&[&str], &str); 4] = [
        (&["time", "good.mpf", "--override", "1=abc"], "C0007"),
        (&["run", "good.mpf", "-o", "x.mcap", "--override", "2=50,1=60"], "C0007"),
        (&["time", "good.mpf", "--override", "1=50", "--optimal"], "C0008"),
        (&["time", "good.mpf", "--override", "1=50"], "K0008"),
    ];
    for (call, code) in calls {
        let set: &[&str] = if code == "K0008" { &["--set", "feed.time_law=seven-phase"] } else { &continuous };
        let output = sollwert(&folder, &[call, set, &["--json"]].concat());
        let document: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one document");
        assert_eq!((output.status.code(), document["errors"][0]["code"].as_str()), (Some(2), Some(code)), "{call:?}");
    }
    let marked = errors_of(&sollwert(&folder, &["time", "good.mpf", "--override", "1=50,2=abc"]));
    assert!(marked.contains("1=50,2=abc") && marked.contains("^^^") && marked.contains("0.1 to 200"), "{marked}");
}
