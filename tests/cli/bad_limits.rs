//! Programs that no axis can follow, on the command line: file, line, the place marked, what to do, exit code 1.
//!
//! In: the built program, short bad programs. Out: a failure that names the program and the command.

use std::fs;
use std::path::Path;
use std::process::Command;

/// Program, the line that is wrong, and the words under the mark.
const BAD: [(&str, u32, &str); 12] = [
    ("G1 X10 F0\nM30\n", 1, "F0"),
    ("G1 X10\nM30\n", 1, "X10"),
    ("G93 F0\nG1 X20\nM30\n", 1, "F0"),
    ("G1 X10 F1000\nR1=0\nG1 X20 F=R1\nM30\n", 3, "F=R1"),
    ("G1 X10 F1000\nFL[X]=0\nG1 X20\nM30\n", 2, "FL[X]=0"),
    ("G1 X10 F1000\nG95 F0.1\nG1 X20\nM30\n", 3, "X20"),
    ("G1 X10 F1000\nJERKLIM[X]=0\nG1 X20\nM30\n", 2, "JERKLIM[X]=0"),
    ("G1 X10 F1000\nACC[Y]=0\nG1 X20\nM30\n", 2, "ACC[Y]=0"),
    ("G1 X10 F1000\nVELOLIM[Z]=0\nG1 X20\nM30\n", 2, "VELOLIM[Z]=0"),
    ("G1 X10 F1000\nOVR=0\nG1 X20\nM30\n", 2, "OVR=0"),
    ("G1 X10 F1000\nG2 X10 Y0 I0 J0\nM30\n", 2, "X10 Y0 I0 J0"),
    ("G1 X10 F1000\nG3 X20 CR=0\nM30\n", 2, "X20 CR=0"),
];

#[test]
fn each_names_line_place_and_way_out() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bad_limits");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a new folder");
    for (text, line, marked) in BAD {
        fs::write(folder.join("part.mpf"), text).expect("a file");
        let commands: [&[&str]; 3] =
            [&["check", "part.mpf"], &["time", "part.mpf"], &["run", "part.mpf", "--no-drives", "-o", "part.mcap"]];
        for arguments in commands {
            let mut command = Command::new(env!("CARGO_BIN_EXE_sollwert"));
            command.args(arguments).args(["-m", "spinner_mvc850"]).current_dir(&folder);
            let output = command.output().expect("the program starts");
            let errors = String::from_utf8_lossy(&output.stderr).into_owned();
            let case = format!("{} of {text:?}: {errors}", arguments[0]);
            assert_eq!(output.status.code(), Some(1), "{case}");
            assert!(errors.contains(&format!("part.mpf:{line}:")) && errors.contains("help: "), "{case}");
            let source = text.lines().nth(line as usize - 1).expect("the line");
            let shown = errors.lines().position(|shown| shown.ends_with(source)).expect(&case);
            let mark = errors.lines().nth(shown + 1).expect(&case);
            let carets = mark.matches('^').count();
            assert_eq!(carets, marked.len(), "{case}");
            // The mark stands under the words.
            let from = errors.lines().nth(shown).and_then(|shown| shown.rfind(marked)).expect(&case);
            assert_eq!(mark.find('^'), Some(from), "{case}");
        }
    }
}

/// A machine whose axis has no jerk is refused before anything moves.
#[test]
fn a_machine_without_jerk_is_refused_by_key() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sollwert"));
    command.args(["time", "programs/corners.mpf", "-m", "spinner_mvc850", "--set", "axes.Y.jerk_max_m_s3=0"]);
    let output = command.current_dir(env!("CARGO_MANIFEST_DIR")).output().expect("the program starts");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.code() == Some(1) && errors.contains("axes.Y.jerk_max_m_s3 = 0") && errors.contains("help: "),
        "{errors}"
    );
}
