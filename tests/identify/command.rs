//! The command line as a user meets it: our own recordings, calibrated and identified, with pages and JSON; broken input with place and advice.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const FITTED: &str =
    "$AN_SLTRACE=1\nG642 CTOL=0.08 SOFT\nG1 X8 F3000\nX13 Y5\nX4 Y9\nX-2 Y3\nX3 Y0\n$AN_SLTRACE=2\nM30\n";
const UNSEEN: &str = "G642 CTOL=0.05 SOFT\nG1 X9 Y3 F2400\nX15 Y12\nX8 Y18\nX1 Y4\nM30\n";

/// A folder of its own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a new folder");
    folder
}

fn sollwert(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sollwert"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

fn good(folder: &Path, arguments: &[&str]) -> String {
    let output = sollwert(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn our_own_recordings_calibrate_a_machine_file() {
    let folder = folder("identify_calibrates");
    for (name, text) in [("fitted.mpf", FITTED), ("unseen.mpf", UNSEEN)] {
        std::fs::write(folder.join(name), text).expect("a file");
        let (program, trace) = (name, name.replace("mpf", "mcap"));
        let truth = ["--set", "smoothing.alpha=2.1", "--set", "smoothing.radial_jerk_share=0.5"];
        good(&folder, &[&["run", program, "-o", &trace][..], &truth].concat());
    }
    let call = ["identify", "--smoothing", "fitted.mcap", "fitted.mpf", "--validate", "unseen.mcap", "unseen.mpf"];
    let text = good(&folder, &[&call[..], &["-o", "new.toml", "--report", "page.html"]].concat());
    for part in ["smoothing.alpha", "unseen.mpf (not used)", "machine file: new.toml", "page: page.html"] {
        assert!(text.contains(part), "{part} is missing:\n{text}");
    }
    // The written file makes the same motion: its own trace agrees with nothing fitted.
    good(&folder, &["run", "unseen.mpf", "-m", "new.toml", "-o", "again.mcap", "--no-drives"]);
    let document = |arguments: &[&str]| -> serde_json::Value {
        serde_json::from_str(&good(&folder, arguments)).expect("one document")
    };
    let [wanted, got] = [&["time", "unseen.mpf", "--json"][..], &["time", "unseen.mpf", "-m", "new.toml", "--json"]]
        .map(|call| document(call)["cycle_time_s"].as_f64().expect("a time"));
    let truth = ["--set", "smoothing.alpha=2.1", "--set", "smoothing.radial_jerk_share=0.5"];
    let truth_s = document(&[&["time", "unseen.mpf", "--json"][..], &truth].concat())["cycle_time_s"].as_f64().unwrap();
    assert!((got / truth_s - 1.0).abs() < 0.01, "{got} s, the truth takes {truth_s} s, the file before {wanted} s");
    // The page: drawings of both programs, nothing loaded, everything escaped.
    let page = std::fs::read_to_string(folder.join("page.html")).expect("a page");
    assert_eq!(page.matches("<svg ").count(), 2);
    assert_eq!(page.matches("class=\"traced\"").count(), 2);
    assert!(page.contains("not used for the fit") && !page.contains("http") && !page.contains("<script"));
    // As a document.
    let result = document(&[&call[..], &["--json"]].concat());
    assert_eq!(result["programs"][1]["used"], false);
    assert!(result["control"]["smoothing.alpha"]["value"].as_f64().is_some(), "{result}");
}

#[test]
fn bad_input_is_refused_with_what_to_do() {
    let folder = folder("identify_refuses");
    std::fs::write(folder.join("good.mpf"), UNSEEN).expect("a file");
    std::fs::write(folder.join("no.csv"), "time_s,X.current_a\n0,1\n0.001,1.1\n0.002,1.2\n").expect("a file");
    std::fs::write(folder.join("empty.csv"), "").expect("a file");
    // A trace of three rows with a current only: read, and every value refused with what to record.
    let output = sollwert(&folder, &["identify", "no.csv"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("nothing could be identified") && text.contains("record the position"), "{text}");
    // Degrees of linear axes are nothing to read as millimetres.
    let degrees = "time_s,X.position_setpoint_deg,Y.position_setpoint_deg\n0,0,0\n0.001,0.1,0.1\n0.002,0.2,0.1\n";
    std::fs::write(folder.join("degrees.csv"), degrees).expect("a file");
    for call in [&["identify", "degrees.csv"][..], &["identify", "--smoothing", "degrees.csv", "good.mpf"]] {
        let output = sollwert(&folder, call);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(matches!(output.status.code(), Some(1 | 2)), "{call:?}: {:?} {errors}", output.status.code());
        assert!(errors.contains("T0209") && errors.contains("X is a linear axis"), "{call:?}: {errors}");
    }
    for call in [
        &["identify", "empty.csv"][..],
        &["identify", "missing.mcap"],
        &["identify", "--smoothing", "no.csv"],
        &["identify", "--smoothing", "no.csv", "good.mpf"],
    ] {
        let output = sollwert(&folder, call);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(matches!(output.status.code(), Some(1 | 2)), "{call:?}: {:?} {errors}", output.status.code());
        assert!(errors.contains("help:"), "{call:?}: {errors}");
    }
}
