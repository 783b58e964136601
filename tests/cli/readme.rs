//! The README is true: its commands run, as they stand there, in a folder that holds the shipped programs and machines.
//!
//! In: README.md, the built program. Out: a failure that names the command. Its Python is tried by `tools/test`, which has the readers.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn readme() -> String {
    fs::read_to_string(Path::new(ROOT).join("README.md")).expect("README.md")
}

/// Commands in the blocks of a shell, without their comments.
fn commands(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut block = None;
    for line in text.lines() {
        match (line.trim().strip_prefix("```"), block) {
            (Some(language), None) => block = Some(language),
            (Some(_), Some(_)) => block = None,
            (None, Some("" | "sh")) => found.push(line.split(" #").next().unwrap_or(line).trim().to_owned()),
            (None, _) => {}
        }
    }
    found.retain(|command| !command.is_empty());
    found
}

/// An empty folder with copies of the shipped programs and machines.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    for part in ["programs", "machines"] {
        fs::create_dir_all(folder.join(part)).expect("a new folder");
        for entry in fs::read_dir(Path::new(ROOT).join(part)).unwrap_or_else(|error| panic!("{part}: {error}")) {
            let entry = entry.expect("a file");
            if entry.path().is_dir() {
                continue;
            }
            fs::copy(entry.path(), folder.join(part).join(entry.file_name())).expect("a copy");
        }
    }
    folder
}

fn sollwert(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sollwert"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

#[test]
fn the_first_commands_are_the_promised_two() {
    let promised =
        ["cargo run --release -- run programs/spline.mpf -m machines/spinner_mvc850.toml -o spline.mcap", "tools/test"];
    assert_eq!(commands(&readme())[..2], promised);
}

#[test]
fn every_command_runs_as_it_stands() {
    let folder = folder("readme");
    // What the README leaves to its reader: set-points, and the recording of a run that was killed.
    let rows: String = (0..200).map(|k| format!("{},{},0\n", f64::from(k) / 1000.0, f64::from(k) / 100.0)).collect();
    fs::write(folder.join("setpoints.csv"), format!("time_s,X_mm,Y_mm\n{rows}")).expect("set-points");

    let mut tried = 0;
    for command in commands(&readme()) {
        let call = command.strip_prefix("cargo run --release -- ").or_else(|| command.strip_prefix("sollwert "));
        let Some(call) = call else {
            let program = command.split(' ').next().unwrap_or_default();
            assert!(Path::new(ROOT).join(program).is_file(), "`{command}`: there is no {program}");
            continue;
        };
        let arguments: Vec<&str> = call.split(' ').filter(|word| !word.is_empty()).collect();
        let output = sollwert(&folder, &arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "`{command}` says:\n{said}");
        if let Some(place) = arguments.iter().position(|argument| *argument == "-o") {
            let written = folder.join(arguments[place + 1]);
            assert!(fs::metadata(&written).is_ok_and(|file| file.len() > 0), "`{command}` writes nothing");
            if arguments[0] == "run" {
                let whole = fs::read(&written).expect("the recording");
                fs::write(folder.join("broken.mcap"), &whole[..whole.len() * 2 / 3]).expect("a broken recording");
                // And the two that it compares.
                for name in ["a.mcap", "b.mcap"] {
                    fs::write(folder.join(name), &whole).expect("a recording");
                }
            }
        }
        tried += 1;
    }
    assert!(tried >= 10, "{tried} commands found in README.md");
}

#[test]
fn commands_are_found_in_shell_blocks_only() {
    let text =
        "```sh\nsollwert time a.mpf   # why\n\n```\n```python\nnot_this()\n```\nnor this\n```\ntools/test\n```\n";
    assert_eq!(commands(text), ["sollwert time a.mpf", "tools/test"]);
}
