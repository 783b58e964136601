//! The command: exit codes and documents.

use std::path::Path;
use std::process::Command;

pub fn sollwert(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_sollwert")).args(arguments).current_dir(folder).output().expect("it starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn two_runs_differ_by_what_was_changed_and_limits_decide_the_exit_code() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("compare_command");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let program = "N10 G1 X20 F3000 G642 CTOL=0.02 FFWON\nN20 Y20\nN30 X0\nN40 M30\n";
    std::fs::write(folder.join("a.mpf"), program).expect("a program");
    for (name, set) in [("a.mcap", "0.9"), ("b.mcap", "1.0")] {
        let set = ["X", "Y"].map(|axis| format!("axes.{axis}.drive.velocity_feedforward={set}"));
        let call = ["run", "a.mpf", "-m", "spinner_mvc850", "-o", name, "--set", &set[0], "--set", &set[1]];
        let (code, _, errors) = sollwert(&folder, &call);
        assert_eq!(code, Some(0), "{errors}");
    }
    let (code, text, errors) =
        sollwert(&folder, &["compare", "a.mcap", "a.mcap", "--json", "--limit", "contour_error_max_mm=1e-9"]);
    assert_eq!(code, Some(0), "{errors}");
    let same: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(same["offset_s"].as_f64().map(|s| s.abs() < 1e-9), Some(true), "{}", same["offset_s"]);
    let call = ["compare", "a.mcap", "b.mcap", "--json", "--limit", "X.control_deviation_mm.max=0.001"];
    let (code, text, errors) = sollwert(&folder, &call);
    assert_eq!(code, Some(1), "{errors}");
    let document: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(document["limits"][0]["holds"], false);
    // Set-points are equal; a tenth of the feed-forward missing at 50 mm/s and Kv = 50 1/s is a deviation of 0.1 mm.
    assert!(document["signals"]["X.position_setpoint_mm"]["max"].as_f64().is_some_and(|x| x < 1e-9));
    let deviation = document["signals"]["X.control_deviation_mm"]["max"].as_f64().expect("a figure");
    assert!((0.09..0.12).contains(&deviation), "{deviation}");
    let (code, text, errors) = sollwert(&folder, &["compare", "a.mcap", "b.mcap"]);
    assert!(
        code == Some(0) && text.contains("contour error") && text.contains("X.control_deviation_mm"),
        "{text}{errors}"
    );
    let (code, _, errors) = sollwert(&folder, &["compare", "a.mcap", "b.mcap", "--map", "X.nothing=X.current_a"]);
    assert!(code == Some(2) && errors.contains("X.nothing"), "{errors}");
}
