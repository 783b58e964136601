//! CSV: rows, columns, held values, numbers that read back.

use crate::support::*;
use sollwert::base::{AxisId, Tick};
use sollwert::recorder::*;
use std::collections::BTreeMap;
use std::path::Path;

fn table(path: &Path) -> (Vec<String>, Vec<BTreeMap<String, String>>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let header: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let rows = reader.records().map(|row| header.iter().cloned().zip(row.unwrap().iter().map(str::to_owned)).collect());
    let rows = rows.collect();
    (header, rows)
}

fn exported(name: &str, bytes: &[u8]) -> (Vec<String>, Vec<BTreeMap<String, String>>) {
    let output = temporary(&format!("{name}.csv"));
    let recording = Recording::open(&file(&format!("{name}.mcap"), bytes)).unwrap();
    let report = export(&recording, &output).unwrap();
    let (header, rows) = table(&output);
    assert_eq!((report.rows, report.columns), (rows.len() as u64, header.len()));
    assert_eq!(report.bytes, std::fs::metadata(&output).unwrap().len());
    (header, rows)
}

#[test]
fn every_tick_is_a_row_and_every_number_reads_back() {
    let machine = machine();
    let ticks = 100 * POSITION_TICKS;
    let programs = [program(0, "a,\"b\".mpf", b"M30\n")];
    let setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &programs);
    let (header, rows) = exported("rows", &recorded(&setup, ticks));
    assert_eq!(rows.len(), 101);
    assert_eq!(header[0], "time_s");
    let mut expected: Vec<String> = AXIS_FIELDS.iter().map(|field| format!("X.{}", field.linear)).collect();
    assert_eq!(header[1..=AXIS_FIELD_COUNT], expected[..]);
    expected = PATH_FIELDS.iter().map(|field| format!("path.{field}")).collect();
    assert_eq!(header[header.len() - PATH_FIELDS.len()..], expected[..]);
    assert!(header.contains(&"C.following_error_deg".to_owned()) && !header.contains(&"Y.current_a".to_owned()));

    for (k, row) in rows.iter().enumerate() {
        let tick = Tick(k as u64 * POSITION_TICKS);
        let number = |column: &str| row[column].parse::<f64>().unwrap();
        assert_eq!(number("time_s"), k as f64 / 1000.0);
        assert_eq!(number("X.position_setpoint_mm"), signal(tick, AxisId::new(0), 0));
        assert_eq!(number("Y.jerk_setpoint_mm_s3"), signal(tick, AxisId::new(1), 8));
        assert_eq!(row["X.flags"], (k % 16).to_string());
        // C has every second position cycle, the path every second: both are held.
        let held = Tick(tick.0 / (2 * POSITION_TICKS) * (2 * POSITION_TICKS));
        let degrees = 180.0 / std::f64::consts::PI;
        assert_eq!(number("C.position_actual_deg"), signal(held, AxisId::new(2), 2) * degrees);
        let sample = path_sample(held);
        assert_eq!(number("path.s_mm"), sample.path_length_mm);
        assert_eq!(row["path.line"], sample.block.line.to_string());
        assert_eq!(row["path.program"], "a,\"b\".mpf");
        assert_eq!(row["path.programmed_feed_mm_min"].is_empty(), sample.programmed_feed_lu_s.is_none());
    }
}

#[test]
fn numbers_are_short() {
    let machine = machine();
    let sink = Sink::default();
    let mut setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &[]);
    setup.signals = SignalChoice::parse("X.position_setpoint", &machine).unwrap();
    let mut recorder = Recorder::to_writer(sink.clone(), &setup).unwrap();
    let numbers = [0.0, -0.0, 1.0, 0.1, 1.0 / 3.0, 100_000.0, -7.25e-9, 5e-324, f64::MAX, f64::NAN];
    for (k, number) in numbers.into_iter().enumerate() {
        let mut setpoint = setpoint(Tick(0), AxisId::new(0));
        setpoint.position_lu = number;
        recorder.axis(Tick(k as u64 * 3), AxisId::new(0), &setpoint, &signals(Tick(0), AxisId::new(0)));
    }
    recorder.finish("{}").unwrap();
    let recording = Recording::open(&file("numbers.mcap", &sink.bytes())).unwrap();
    let mut csv = Vec::new();
    export_csv(&recording, &mut csv).unwrap();
    let expected = "time_s,X.position_setpoint_mm\n0,0\n0.00075,-0\n0.0015,1\n0.00225,0.1\n0.003,0.3333333333333333\n\
        0.00375,100000\n0.0045,-7.25e-9\n0.00525,5e-324\n0.006,1.7976931348623157e308\n0.00675,NaN\n";
    assert_eq!(String::from_utf8(csv).unwrap(), expected);
}

#[test]
fn a_recording_without_axes_has_a_row_for_each_set_point() {
    let machine = machine();
    let mut setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &[]);
    setup.signals = SignalChoice::parse("path", &machine).unwrap();
    let (header, rows) = exported("path-only", &recorded(&setup, 50 * TICKS_PER_SETPOINT));
    assert_eq!((header.len(), rows.len()), (1 + PATH_FIELDS.len(), 51));
    assert_eq!(rows[50]["time_s"], "0.1");
    assert_eq!(rows[50]["path.program"], "", "set-points that no program gave");
}

#[test]
fn what_cannot_be_exported_is_told_and_leaves_nothing() {
    let machine = machine();
    let setup = RecordingSetup::new(&machine, "test.toml", MACHINE_TEXT, &[]);
    let bytes = recorded(&setup, 3 * TICKS_PER_S);
    let path = file("refused.mcap", &bytes);
    let recording = Recording::open(&path).unwrap();
    // Parquet is written by the room `trace`.
    assert_eq!(export(&recording, &temporary("refused.parquet")).unwrap_err().code, "R0017");
    assert_eq!(export(&recording, &temporary("refused.xlsx")).unwrap_err().code, "R0017");
    assert_eq!(export(&recording, &temporary("no such folder").join("a.csv")).unwrap_err().code, "R0004");
    assert_eq!(export(&recording, &path).unwrap_err().code, "R0017".replace("17", "15"));

    // Damage behind the first chunk: the rows before it must not be taken for the whole.
    let mut damaged = bytes.clone();
    let chunks: Vec<_> = frames(&bytes).into_iter().filter(|frame| frame.0 == mcap::records::op::CHUNK).collect();
    damaged[(chunks[1].1 + chunks[1].2) / 2] ^= 1;
    let recording = Recording::open(&file("refused-damaged.mcap", &damaged)).unwrap();
    let output = temporary("refused-damaged.csv");
    let _ = std::fs::remove_file(&output);
    let fault = export(&recording, &output).unwrap_err();
    assert_eq!(fault.code, "R0012");
    assert!(fault.message.contains(&format!("byte {}", chunks[1].1)), "{}", fault.message);
    assert!(!output.exists() && !temporary("refused-damaged.csv.partial").exists());
}
