//! Definition files beside the program, as the command finds them.
//!
//! In: a folder with a program and files as they lie in the control's memory. Out: nothing; asserts what the command says and lists.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn folder(name: &str, files: &[(&str, &str)]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("definition_files").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    for (name, text) in files {
        std::fs::write(folder.join(name), text).expect("a file");
    }
    folder
}

fn moves(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sollwert"));
    command.current_dir(folder).args(["moves", "main.mpf", "-m", "spinner_mvc850"]).args(arguments);
    command.output().expect("the command runs")
}

const PROGRAM: &str = "G0 X=DEPTH Y=_COUNT[1]\nM30\n";

#[test]
fn they_are_found_by_the_names_of_the_control_and_named() {
    let folder = folder(
        "found",
        &[
            ("main.mpf", PROGRAM),
            ("UGUD.DEF", "DEF CHAN REAL DEPTH=FACTOR*2\nM17\n"),
            (
                "_N_SGUD_DEF",
                "%_N_SGUD_DEF\n;$PATH=/_N_DEF_DIR\nDEF NCK SYNR APR 2 REAL FACTOR=1.5\nDEF NCK INT _COUNT[2]=SET(4,5)\nM17\n",
            ),
            ("OTHER.DEF", "this is none\n"),
        ],
    );
    let output = moves(&folder, &[]);
    let (listed, said) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}");
    // SGUD comes before UGUD, which needs its factor: 1.5 * 2 = 3.
    assert!(listed.contains("rapid X3 Y5"), "{listed}");
    assert!(said.contains("C0006") && said.contains("UGUD.DEF") && said.contains("_N_SGUD_DEF"), "{said}");
    assert!(!said.contains("OTHER"), "{said}");
}

#[test]
fn those_that_are_given_replace_them() {
    let folder = folder(
        "given",
        &[
            ("main.mpf", PROGRAM),
            ("UGUD.DEF", "DEF CHAN REAL DEPTH=3\nDEF CHAN INT _COUNT[2]\n"),
            ("mine.def", "DEF CHAN REAL DEPTH=7\nDEF CHAN INT _COUNT[2]\n"),
        ],
    );
    let output = moves(&folder, &["--gud", "mine.def"]);
    let (listed, said) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(listed.contains("rapid X7 Y0") && !said.contains("C0006"), "{listed}{said}");
}
