//! Export: what goes out comes back the same.

use super::operate::{linear, read};
use super::operate_session::Session;
use super::recorded::{self, temporary};
use sollwert::recorder::RecordingSetup;
use sollwert::trace::{ColumnNames, ExportForm, ImportOptions, Trace, export_trace, import};
use std::path::{Path, PathBuf};

fn options() -> ImportOptions<'static> {
    ImportOptions { axis_names: vec![(1, "X".to_owned())], ..ImportOptions::default() }
}

fn session(name: &str) -> (PathBuf, Trace) {
    let bytes = Session::new(linear()).text();
    (recorded::file(name, bytes.as_bytes()), read(name, bytes.as_bytes(), &options()).unwrap())
}

fn records(session: &Path) -> usize {
    std::fs::read_to_string(session).unwrap().matches("\n<rec ").count()
}

fn exported(input: &Path, form: ExportForm, name: &str) -> PathBuf {
    let output = temporary(name);
    let outcome = export_trace(input, form, ColumnNames::Original, &options(), &output).unwrap();
    assert_eq!(outcome.written.bytes, std::fs::metadata(&output).unwrap().len());
    output
}

#[test]
fn a_table_has_the_original_names_holds_servo_signals_and_leaves_ipo_signals_their_instants() {
    let (input, trace) = session("table.xml");
    let output = exported(&input, ExportForm::Csv, "table.csv");
    let mut reader = csv::Reader::from_path(&output).unwrap();
    let header: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let mut expected = vec!["time_s"];
    expected.extend(trace.signals.iter().map(|signal| signal.original.as_str()));
    assert_eq!(header, expected);
    let mut before_s = -1.0;
    let mut rows = 0;
    for row in reader.records().map(Result::unwrap) {
        let time_s: f64 = row[0].parse().unwrap();
        assert!(time_s > before_s);
        before_s = time_s;
        rows += 1;
        for (signal, text) in trace.signals.iter().zip(row.iter().skip(1)) {
            let place = signal.times.index_at(time_s).filter(|k| (signal.times.time_s(*k) - time_s).abs() < 1e-9);
            match place {
                Some(k) => assert_eq!(text.parse::<f64>().unwrap(), signal.values[k], "{} {time_s}", signal.original),
                None => assert_eq!(text, "", "{} {time_s}", signal.original),
            }
        }
    }
    // One row a record: where nothing changed there is none.
    assert_eq!(rows, records(&input));
}

#[test]
fn a_recording_of_a_trace_is_the_trace() {
    let (input, trace) = session("to_recording.xml");
    let output = exported(&input, ExportForm::Recording, "to_recording.mcap");
    let back = import(&output, &ImportOptions::default()).unwrap();
    assert_eq!(back.signals.len(), trace.signals.len());
    for signal in &trace.signals {
        let same = back.signals.iter().find(|other| other.original == signal.original).unwrap();
        assert_eq!(same, signal);
    }
    // A table is made of it too, with one row an instant and every signal by its original name.
    let table = exported(&output, ExportForm::Csv, "to_recording.csv");
    let back = import(&table, &options()).unwrap();
    assert_eq!(std::fs::read_to_string(table).unwrap().lines().count(), 502);
    for signal in &trace.signals {
        let same = back.signals.iter().find(|other| other.original == signal.original).unwrap();
        let values: Vec<f64> = same.resampled_on(&signal.times, sollwert::trace::Method::Hold);
        assert_eq!(values, signal.values, "{}", signal.original);
    }
    // The same bytes each time.
    let again = exported(&input, ExportForm::Recording, "to_recording2.mcap");
    assert_eq!(std::fs::read(output).unwrap(), std::fs::read(again).unwrap());
}

#[test]
fn a_session_that_is_written_is_read_back() {
    let (input, trace) = session("to_session.xml");
    let output = exported(&input, ExportForm::OperateXml, "to_session_back.xml");
    let back = import(&output, &options()).unwrap();
    assert_eq!(back.signals.len(), trace.signals.len());
    for (signal, same) in trace.signals.iter().zip(&back.signals) {
        assert_eq!((&signal.original, &signal.name, &signal.times), (&same.original, &same.name, &same.times));
        for (one, other) in signal.values.iter().zip(&same.values) {
            // Six decimals of the unit of the control.
            assert!((one - other).abs() <= 0.51e-6, "{}: {one} {other}", signal.original);
        }
    }
}

#[test]
fn a_recording_becomes_a_session_with_the_names_of_the_control() {
    let machine = recorded::machine();
    let programs = recorded::programs();
    let setup = RecordingSetup::new(&machine, "test.toml", recorded::MACHINE_TEXT, &programs);
    let input = recorded::file("simulated.mcap", &recorded::recorded(&setup, 400));
    let recording = import(&input, &ImportOptions::default()).unwrap();
    let output = temporary("simulated.xml");
    let named = ImportOptions { machine: Some(&machine), ..ImportOptions::default() };
    let outcome = export_trace(&input, ExportForm::OperateXml, ColumnNames::Original, &named, &output).unwrap();
    assert!(outcome.notes.iter().any(|note| note.code == "T0022" && note.message.contains("X.torque_feedforward_n_m")));
    let back = import(&output, &named).unwrap();
    for (axis, stem) in
        [("X", "position_setpoint"), ("X", "following_error"), ("C", "velocity_setpoint"), ("C", "current")]
    {
        let (one, other) = (recording.axis_signal(axis, stem).unwrap(), back.axis_signal(axis, stem).unwrap());
        assert_eq!(one.name, other.name);
        for (k, value) in one.values.iter().enumerate() {
            let same = other.value_at(one.times.time_s(k), sollwert::trace::Method::Hold);
            // Six decimals of rev/min are 6e-6 deg/s.
            assert!((value - same).abs() < 3.1e-6, "{axis}.{stem} {k}: {value} {same}");
        }
    }
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_has_the_columns_of_the_table() {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;
    let (input, trace) = session("columns.xml");
    let output = exported(&input, ExportForm::Parquet, "columns.parquet");
    let reader = SerializedFileReader::new(std::fs::File::open(output).unwrap()).unwrap();
    let mut rows = 0;
    for row in reader.get_row_iter(None).unwrap() {
        let row = row.unwrap();
        let columns: Vec<(&String, &Field)> = row.get_column_iter().collect();
        let Field::Double(time_s) = columns[0].1 else { panic!("time_s is a double") };
        assert_eq!((columns[0].0.as_str(), columns.len()), ("time_s", trace.signals.len() + 1));
        for (signal, (name, field)) in trace.signals.iter().zip(&columns[1..]) {
            assert_eq!(**name, signal.original);
            let place = signal.times.index_at(*time_s).filter(|k| (signal.times.time_s(*k) - time_s).abs() < 1e-9);
            match (place, field) {
                (Some(k), Field::Double(value)) => assert_eq!(*value, signal.values[k]),
                (None, Field::Null) => {}
                other => panic!("{name} at {time_s}: {other:?}"),
            }
        }
        rows += 1;
    }
    // One row a record: where nothing changed there is none.
    assert_eq!(rows, records(&input));
}

#[test]
fn the_drives_follow_the_set_points_of_a_trace() {
    let (input, _) = session("followed.xml");
    let output = temporary("followed.mcap");
    let arguments = ["follow", input.to_str().unwrap(), "-m", "spinner_mvc850", "--axis-name", "1=X", "-o"];
    let done = std::process::Command::new(env!("CARGO_BIN_EXE_sollwert"))
        .args(arguments)
        .arg(&output)
        .output()
        .expect("the program starts");
    assert!(output.exists(), "{}", String::from_utf8_lossy(&done.stderr));
    let followed = import(&output, &ImportOptions::default()).unwrap();
    let x = followed.signal("X.position_setpoint_mm").unwrap();
    // 1 s at the position cycle of 1 ms; between two samples of the trace a straight line, which the motion is.
    assert_eq!((x.len(), x.times.period_s()), (1001, Some(0.001)));
    for (k, value) in x.values.iter().enumerate() {
        let expected = super::operate_session::position(k as f64 / 1000.0);
        assert!((value - expected).abs() < 1e-6, "{k}: {value} {expected}");
    }
}

/// A run with a spindle that comes to 600 rpm at 20 rev/s² and is at rest again at 90 deg.
fn spindle_run(name: &str, choice: &str) -> PathBuf {
    let sets = ["spindle.acceleration_rot_s2=20".to_owned(), "spindle.lag_ms=0".to_owned()];
    let loaded = sollwert::machine::load("spinner_mvc850", &sets).unwrap();
    let text = "S600 M3\nG4 F1\nG1 X2 F600\nM30\n";
    let path = temporary(name);
    let options = sollwert::kernel::RunOptions {
        machine: &loaded,
        setup: sollwert::program::ProgramSource::from_bytes("s.mpf", text.as_bytes()).into(),
        overrides: sollwert::feed::OverrideSchedule::none(),
        drives: true,
        recording: Some(&path),
        mantissa_bits: None,
        signals: sollwert::recorder::SignalChoice::parse(choice, &loaded.machine).unwrap(),
        threads: 1,
        pace_ratio: None,
    };
    sollwert::kernel::run(options, &mut |_| {}).unwrap_or_else(|error| panic!("{error:?}"));
    path
}

#[test]
fn the_spindle_is_in_tables_with_its_names() {
    let path = spindle_run("spindle.mcap", "X.position_setpoint,spindle.angle_setpoint,spindle.speed_actual");
    let columns = ["spindle.angle_setpoint_deg", "spindle.speed_actual_rpm"];
    // Parquet is written and not read: X, the path and the two of the spindle.
    exported(&path, ExportForm::Parquet, "spindle.parquet");
    {
        let table = exported(&path, ExportForm::Csv, "spindle.csv");
        let back = import(&table, &ImportOptions::default()).unwrap();
        let names: Vec<&str> = back.signals.iter().filter_map(|signal| signal.name.as_deref()).collect();
        assert!(columns.iter().all(|name| names.contains(name)), "{names:?}");
        assert_eq!(names.iter().filter(|name| name.starts_with("spindle.")).count(), 2, "{names:?}");
        let [angle, speed] = columns.map(|name| back.signal(name).unwrap());
        assert_eq!((angle.unit.as_str(), speed.unit.as_str()), ("deg", "rpm"));
        for (k, (angle_deg, speed_rpm)) in angle.values.iter().zip(&speed.values).enumerate() {
            // Half a second of ramp, 10 rev/s from there on.
            let t = angle.times.time_s(k);
            let turns = if t < 0.5 { 10.0 * t * t } else { 2.5 + 10.0 * (t - 0.5) };
            assert!((angle_deg - 360.0 * turns).abs() < 1e-6 && (speed_rpm - 1200.0 * t.min(0.5)).abs() < 1e-6, "{t}");
        }
    }
}
