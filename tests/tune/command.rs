//! Tuning from the command line: bounds that cannot be, refused with what to write instead.

use std::process::Command;

#[test]
fn bounds_that_cannot_be_are_refused_with_what_to_write() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("tune_bounds");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("t.mpf"), "G1 X2 F1000\nX0\nM30\n").unwrap();
    for (bounds, words) in [
        (
            &["--bound", "velocity=0.9..1.1", "--bound", "velocity=0.5..1"][..],
            ["has bounds already", "one --bound for each"],
        ),
        (&["--bound", "friction=0..1"], ["does not change", "add it to --gains"]),
        (&["--bound", "velocity=1.1..0.9"], ["are no bounds of a gain", "velocity=0.9..1.1"]),
        (&["--bound", "velocity=-0.1..1"], ["are no bounds of a gain", "not below 0"]),
        (&["--bound", "velocity=0.9..nan"], ["are no bounds of a gain", "velocity=0.9..1.1"]),
        (&["--bound", "speed=0..1"], ["are no bounds of a gain", "gains are velocity"]),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_sollwert"))
            .args([&["tune", "t.mpf"][..], bounds].concat())
            .current_dir(&folder)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{bounds:?}: {said}");
        assert!(said.contains("C0002") && words.iter().all(|word| said.contains(word)), "{bounds:?}: {said}");
        assert!(output.stdout.is_empty());
    }
}
