//! What is in the file: units, times of events, poses, inputs; equal bytes from any folder; what fewer mantissa bits cost.

use crate::trace::{run, trace};

const FIVE_AXES: &str = "N10 T1 D1 S4000 M3
N20 G0 X10 Y20 Z30 A20 C40
MSG(\"contour\")
N30 G642 CTOL=0.05
N40 G1 X40 Y25 F3000 M8
N50 X42 Y40 A-15 C400
N60 G60 X0 C380
N70 G1 C20 F720
N80 G4 F0.1
N90 M30
";

#[test]
fn units_and_poses() {
    let trace = trace("units", FIVE_AXES, &["-m", "mikron_ucp710"]);
    let last = |axis: &str| *trace.column(axis, "position_setpoint").last().unwrap();
    assert!((last("X") - 0.0).abs() < 1e-12 && (last("Y") - 40.0).abs() < 1e-12);
    assert!((last("A") + 15.0).abs() < 1e-12 && (last("C") - 20.0).abs() < 1e-12, "degrees");
    // Not modulo 360.
    let most = trace.column("C", "position_setpoint").iter().fold(0.0, |most: f64, c| most.max(*c));
    assert!((most - 400.0).abs() < 0.5, "{most}");
    let fastest = trace.rows.iter().filter(|row| row.line == 5).map(|row| row.feed_mm_min).fold(0.0, f64::max);
    assert!((fastest - 3000.0).abs() < 1e-6, "{fastest} mm/min");
    // deg/min where only C moves.
    let turning = trace.rows.iter().filter(|row| row.line == 8).map(|row| row.feed_mm_min).fold(0.0, f64::max);
    assert!((turning - 720.0).abs() < 1e-6, "{turning} deg/min");

    // Poses every 10 ms, at the first 4 ms cycle of each: 0, 12, 20, 32 ms ...
    for (poses, field) in trace.poses.iter().zip(["position_setpoint", "position_actual"]) {
        let end_ns = trace.rows.last().unwrap().time_ns;
        assert_eq!(poses.len() as u64, end_ns / 10_000_000 + 1);
        for (n, pose) in poses.iter().enumerate() {
            assert_eq!(pose.time_ns, (n as u64 * 10_000_000).div_ceil(4_000_000) * 4_000_000);
            assert_eq!(pose.frame, "part");
            let value = |axis: &str| {
                let times = &trace.axes[axis].0;
                trace.column(axis, field)[times.partition_point(|time_ns| *time_ns < pose.time_ns)]
            };
            // XYZ = R_x(-A) R_z(-C) p, so that p = R_z(C) R_x(A) XYZ, and the tool axis is R_z(C) R_x(A) (0, 0, 1).
            let (sa, ca) = value("A").to_radians().sin_cos();
            let (sc, cc) = value("C").to_radians().sin_cos();
            let turn = |[x, y, z]: [f64; 3]| {
                let (y, z) = (ca * y - sa * z, sa * y + ca * z);
                [cc * x - sc * y, sc * x + cc * y, z]
            };
            let p = turn([value("X"), value("Y"), value("Z")]);
            let [x, y, z, w] = pose.quaternion;
            let axis = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)];
            let wanted = turn([0.0, 0.0, 1.0]);
            for i in 0..3 {
                assert!(
                    (pose.position_m[i] - 1e-3 * p[i]).abs() < 1e-12,
                    "{field} pose {n}: {:?} {p:?}",
                    pose.position_m
                );
                assert!((axis[i] - wanted[i]).abs() < 1e-12, "{field} pose {n}");
            }
        }
    }
}

#[test]
fn events_stand_at_the_first_row_of_their_block() {
    let trace = trace("events", FIVE_AXES, &["-m", "mikron_ucp710"]);
    let first = |block: u64| trace.rows.iter().find(|row| row.block >= block).unwrap().time_ns;
    for event in trace.events.iter().filter(|event| event.kind == "block_start") {
        assert_eq!(event.time_ns, first(event.block), "line {}", event.line);
    }
    let starts = trace.events.iter().filter(|event| event.kind == "block_start").count();
    assert_eq!(starts as u64, trace.recording.summary().unwrap()["blocks"].as_u64().unwrap());
    let one = |kind: &str, number: f64| {
        let found: Vec<_> = trace.events.iter().filter(|event| event.kind == kind && event.number == number).collect();
        assert_eq!(found.len(), 1, "{kind} {number}");
        found[0]
    };
    assert_eq!(one("s", 4000.0).time_ns, 0);
    assert_eq!(one("m", 3.0).time_ns, 0);
    let line_5 = trace.rows.iter().find(|row| row.line == 5).unwrap().time_ns;
    assert_eq!(one("m", 8.0).time_ns, line_5);
    assert_eq!(one("m", 30.0).time_ns, trace.rows.last().unwrap().time_ns);
    let message = trace.events.iter().find(|event| event.kind == "msg").unwrap();
    assert!(message.text.contains("contour") && message.time_ns <= line_5 && message.time_ns > 0);
    // The blend begins on the row at which, or just after which, line 2's ramp meets it: never at another block's.
    for corner in trace.events.iter().filter(|event| event.kind == "corner") {
        let at = trace.rows.iter().find(|row| row.time_ns == corner.time_ns).unwrap();
        assert!(at.block >= corner.block, "line {}", corner.line);
        assert!(corner.number > 0.0);
    }
}

#[test]
fn inputs_and_metadata_travel_along() {
    let trace = trace("inputs", FIVE_AXES, &["-m", "mikron_ucp710", "--set", "axes.X.jerk_max_m_s3=4.5"]);
    let attachment = |n: usize| {
        let info = &trace.recording.attachments()[n];
        (info.name.clone(), info.time_ns, String::from_utf8(trace.recording.attachment(info).unwrap()).unwrap())
    };
    assert_eq!(attachment(0), ("part.mpf".to_owned(), 0, FIVE_AXES.to_owned()));
    let (name, _, text) = attachment(1);
    assert!(name == "mikron_ucp710.toml" && text.contains("jerk_max_m_s3 = 4.5"), "{name}");
    for name in ["sollwert", "cycle", "axes", "units", "inputs", "summary"] {
        assert!(trace.recording.metadata(name).is_some_and(|entries| !entries.is_empty()), "{name}");
    }
    let bytes = std::fs::read(&trace.path).unwrap();
    let holds = |needle: &str| bytes.windows(needle.len()).any(|window| window == needle.as_bytes());
    assert!(!holds(env!("CARGO_TARGET_TMPDIR")), "a path in the recording");
}

#[test]
fn equal_bytes_from_any_folder_and_any_number_of_threads() {
    let read = |path| std::fs::read(path).unwrap();
    let one = read(run("folder_a", FIVE_AXES, &["-m", "mikron_ucp710", "--threads", "1"]));
    for (name, threads) in [("folder_b", "2"), ("folder b/c", "7")] {
        assert!(read(run(name, FIVE_AXES, &["-m", "mikron_ucp710", "--threads", threads])) == one, "{name}");
    }
}

/// n mantissa bits: off by half a unit in the last of them at most, 2^-(n+1) of the value (of the next power of two below it).
#[test]
fn fewer_bits_cost_what_they_say() {
    let whole = trace("bits_52", FIVE_AXES, &["-m", "mikron_ucp710"]);
    for bits in [10_i32, 36] {
        let cut = trace(
            &format!("bits_{bits}"),
            FIVE_AXES,
            &["-m", "mikron_ucp710", "--record-precision", &bits.to_string()],
        );
        let mut differs = false;
        for (axis, (times, columns)) in &whole.axes {
            assert_eq!(*times, cut.axes[axis].0);
            for (field, values) in columns {
                for (a, b) in values.iter().zip(cut.column(axis, field)) {
                    assert!((a - b).abs() <= a.abs() * 0.5_f64.powi(bits + 1), "{axis} {field} {bits} bits: {a} {b}");
                    differs |= a != b;
                }
            }
        }
        assert!(differs);
        let size = |path: &std::path::Path| std::fs::metadata(path).unwrap().len();
        assert!(size(&cut.path) < size(&whole.path));
    }
}

/// The CSV reads back to the same f64, in no more digits than that takes, rows at the position cycle.
#[test]
fn the_export_reads_back_to_the_same_numbers() {
    let trace = trace("export", FIVE_AXES, &["-m", "mikron_ucp710"]);
    let csv = trace.path.with_extension("csv");
    let export = std::process::Command::new(env!("CARGO_BIN_EXE_sollwert"))
        .arg("export")
        .arg(&trace.path)
        .arg("-o")
        .arg(&csv)
        .output()
        .unwrap();
    assert!(export.status.success(), "{}", String::from_utf8_lossy(&export.stderr));
    let text = std::fs::read_to_string(&csv).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let place = |name: &str| header.iter().position(|column| *column == name).unwrap_or_else(|| panic!("{name}"));
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let (x, a, time) = (place("X.position_setpoint_mm"), place("A.following_error_deg"), place("time_s"));
    let wanted = [(x, trace.column("X", "position_setpoint")), (a, trace.column("A", "following_error"))];
    assert_eq!(rows.len(), wanted[0].1.len());
    for (k, row) in rows.iter().enumerate() {
        assert_eq!(row[time].parse::<f64>().unwrap(), k as f64 * 2.0 / 1000.0, "2 ms rows");
        for (column, values) in wanted {
            assert_eq!(row[column].parse::<f64>().unwrap(), values[k]);
            let digits = |text: &str| {
                let mantissa = text.split(['e', 'E']).next().unwrap_or_default();
                let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
                digits.trim_matches('0').len()
            };
            assert_eq!(digits(row[column]), digits(&format!("{:e}", values[k])), "{}", row[column]);
        }
    }
}
