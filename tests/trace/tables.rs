//! Tables: every dialect says the same thing, and what was understood is said.

use super::operate::read;
use sollwert::trace::{Clock, ImportOptions, Method, TimeGrid, Trace};

const ROWS: usize = 300;

fn position(k: usize) -> f64 {
    (k as f64 * 0.05).sin() * 12.5
}

fn options(time: Option<&str>) -> ImportOptions<'static> {
    ImportOptions { time_column: time.map(str::to_owned), ..ImportOptions::default() }
}

fn said(trace: &Trace) -> String {
    trace.notes.iter().find(|note| note.code == "T0016").unwrap().message.clone()
}

fn assert_position(trace: &Trace, name: &str) {
    let signal = trace.signal(name).unwrap_or_else(|| panic!("{name} in {:?}", trace.signals));
    assert_eq!(signal.len(), ROWS);
    for (k, value) in signal.values.iter().enumerate() {
        assert!((value - position(k)).abs() < 1e-9, "{name} {k}: {value}");
        assert!((signal.times.time_s(k) - k as f64 * 0.002).abs() < 1e-9, "{name} {k}");
    }
}

/// Name, heads, separator, decimal comma, units of the time in a second, what is said.
type Dialect<'a> = (&'a str, &'a [&'a str], &'a str, bool, f64, &'a str);

/// A table with a separator, a decimal sign and heads.
fn table(heads: &[&str], separator: &str, comma: bool, time_scale: f64) -> String {
    let mut text = heads.iter().map(|head| format!("{head}\r\n")).collect::<String>();
    for k in 0..ROWS {
        let cells =
            [format!("{:.3}", k as f64 * 0.002 * time_scale), format!("{:.12}", position(k)), format!("{}", k / 100)];
        let row = cells.join(separator);
        text += &if comma { row.replace('.', ",") } else { row };
        text += "\r\n";
    }
    text
}

#[test]
fn the_dialect_is_found_and_said() {
    let cases: [Dialect; 6] = [
        ("own.csv", &["time_s,X.position_setpoint_mm,path.line"], ",", false, 1.0, "commas, decimal point"),
        ("german.csv", &["Zeit [ms];X_mm;Satz"], ";", true, 1000.0, "semicolons, decimal comma"),
        ("units.csv", &["t;X_mm;line", "ms;mm;"], ";", false, 1000.0, "units in line 2"),
        ("tab.txt", &["# a head", "# of two lines", "time\tX_mm\tn"], "\t", false, 1.0, "tabulators"),
        ("blanks.dat", &["time X_mm n"], "  ", false, 1.0, "blanks"),
        (
            "siemens.csv",
            &["Time, /Nck/!SD/nckServoDataCmdPos2ndEnc64 [u1, 1], /Nck/!SD/x [u1, 1]"],
            ", ",
            false,
            1.0,
            "commas",
        ),
    ];
    for (name, heads, separator, comma, scale, expected) in cases {
        let named = ImportOptions { axis_names: vec![(1, "X".to_owned())], ..ImportOptions::default() };
        let trace = read(name, table(heads, separator, comma, scale).as_bytes(), &named).unwrap();
        assert!(said(&trace).contains(expected), "{name}: {}", said(&trace));
        assert_position(&trace, "X.position_setpoint_mm");
        assert_eq!(trace.signals.len(), 2);
    }
}

#[test]
fn the_time_column_is_found_or_given() {
    let heads = ["value,clock,n"];
    let text: String = (0..ROWS).map(|k| format!("{},{},{}\n", position(k), 2 * k, k)).collect();
    let text = format!("{}\n{text}", heads[0]);
    for (time, expected) in [("clock:0.001", "clock"), ("n:0.002", "n")] {
        let trace = read("given.csv", text.as_bytes(), &options(Some(time))).unwrap();
        assert_position(&trace, "value");
        assert!(said(&trace).contains(&format!("`{expected}`")), "{}", said(&trace));
    }
    assert_position(&read("rows.csv", text.as_bytes(), &options(Some("0.002"))).unwrap(), "value");
    let missing = read("missing.csv", text.as_bytes(), &options(Some("clokc"))).unwrap_err();
    assert!(missing.code == "T0015" && missing.help.unwrap().contains("`clock`"));
    let none: String = (0..9).map(|k| format!("{},{}\n", k % 3, k % 2)).collect();
    assert_eq!(read("none.csv", none.as_bytes(), &options(None)).unwrap_err().code, "T0015");
}

#[test]
fn dates_are_times() {
    let rows: String = (0..ROWS)
        .map(|k| format!("2026-06-03T23:59:{:02}.{:03}Z;{}\n", 59 * usize::from(k < 500), 2 * k, position(k)))
        .collect();
    let trace = read("dates.csv", format!("Timestamp;value\n{rows}").as_bytes(), &options(None)).unwrap();
    assert_position(&trace, "value");
}

#[test]
fn a_time_that_runs_backwards_is_refused_with_its_place() {
    // Another column increases, but is not the time.
    let rows = |time: &dyn Fn(usize) -> String| {
        (0..ROWS).map(|k| format!("{};{};{k}\n", time(k), position(k))).collect::<String>()
    };
    let read_rows = |head: &str, given: Option<&str>, time: &dyn Fn(usize) -> String| {
        read("backwards.csv", format!("{head};X_mm;count\n{}", rows(time)).as_bytes(), &options(given))
    };
    let down = |k: usize| format!("{:.3}", (ROWS - k) as f64 * 0.002);
    let still = |_: usize| "4".to_owned();
    let up_then_down = |k: usize| format!("{:.3}", (k as f64 - 20.0).abs() * -0.002);
    let cases: [(&dyn Fn(usize) -> String, u32); 3] = [(&down, 3), (&still, 3), (&up_then_down, 23)];
    for (time, line) in cases {
        for (head, given) in [("time", None), ("Zeit [s]", None), ("clock", Some("clock"))] {
            let refused = read_rows(head, given, time).unwrap_err();
            let place = refused.place.as_ref().unwrap();
            assert_eq!((refused.code, place.line), ("T0009", line), "{head}: {refused:?}");
        }
        // The user knows better.
        assert_position(&read_rows("time", Some("0.002"), time).unwrap(), "X_mm");
    }
    // Few digits: a time that stands twice is taken once, and said; where most would be lost, the table is refused.
    let coarse = |k: usize| format!("{:.3}", (k / 2) as f64 * 0.004);
    let trace = read_rows("time", None, &coarse).unwrap();
    assert!(said(&trace).contains("time column `time`"), "{}", said(&trace));
    assert_eq!(trace.signal("X_mm").unwrap().len(), ROWS / 2);
    assert!(
        trace.notes.iter().any(|note| note.code == "T0009" && note.message.contains("150 times")),
        "{:?}",
        trace.notes
    );
    let refused = read_rows("time", None, &|k| format!("{:.2}", k as f64 * 0.002)).unwrap_err();
    assert!(refused.code == "T0009" && refused.message.contains("of 300 samples"), "{refused:?}");
}

#[test]
fn rows_of_any_length_are_no_table_of_one_column() {
    let rows: String = (0..400).map(|k| format!("{}{}\n", k as f64 * 0.002, ";1".repeat(k % 9))).collect();
    assert_eq!(read("ragged.csv", format!("t;a;b\n{rows}").as_bytes(), &options(None)).unwrap_err().code, "T0016");
    let column: String = (0..400).map(|k| format!("{}\n", k as f64 * 0.5)).collect();
    let trace = read("column.csv", format!("X_mm\n{column}").as_bytes(), &options(Some("0.002"))).unwrap();
    assert_eq!((trace.signals.len(), trace.signals[0].values[399]), (1, 199.5));
}

#[test]
fn times_of_day_go_on_over_midnight() {
    let clock = |k: usize| {
        let ms = 2 * k as u64 + 86_399_700;
        let (s, ms) = (ms / 1000 % 86_400, ms % 1000);
        format!("{:02}:{:02}:{:02},{ms:03}", s / 3600, s / 60 % 60, s % 60)
    };
    let rows: String = (0..ROWS).map(|k| format!("{};{}\n", clock(k), position(k))).collect();
    let trace = read("clock.csv", format!("Zeit;X_mm\n{rows}").as_bytes(), &options(None)).unwrap();
    assert_position(&trace, "X_mm");
    assert!(said(&trace).contains("times of day"), "{}", said(&trace));
}

#[test]
fn a_slow_signal_is_not_one_with_gaps_and_a_hole_is() {
    let row = |k: usize| {
        let slow = if k % 2 == 1 { position(k).to_string() } else { String::new() };
        let holed = if (40..50).contains(&k) { String::new() } else { position(k).to_string() };
        format!("{},{slow},{holed},state {}\n", k as f64 * 0.002, k / 100)
    };
    let text = format!("time_s,slow,holed,word\n{}", (0..ROWS).map(row).collect::<String>());
    let trace = read("slow.csv", text.as_bytes(), &options(None)).unwrap();
    let slow = trace.signal("slow").unwrap();
    assert_eq!(slow.times, TimeGrid::Uniform { start_ns: 2e6, step_ns: 4e6, count: ROWS / 2 });
    assert_eq!(slow.clock, Clock::Interpolator);
    assert!(slow.values.iter().enumerate().all(|(k, value)| *value == position(2 * k + 1)));
    let holed = trace.signal("holed").unwrap();
    assert!(holed.value_at(0.0805, Method::Linear).is_nan() && holed.value_at(0.1, Method::Linear) == position(50));
    let word = trace.signal("word").unwrap();
    assert_eq!((word.label(0), word.label(250)), (Some("state 0"), Some("state 2")));
    assert_eq!(word.natural_method(), Method::Hold);
}

#[test]
fn bad_rows_are_said() {
    let mut text = table(&["time_s,X_mm,n"], ",", false, 1.0);
    text = text.replacen("\r\n0.100,", "\r\n0.010,", 1);
    text = text.replacen(&format!("{:.12}", position(70)), "n/a", 1);
    let trace = read("bad.csv", text.as_bytes(), &options(None)).unwrap();
    let codes: Vec<&str> = trace.notes.iter().map(|note| note.code).filter(|code| *code != "T0016").collect();
    assert_eq!(codes, ["T0009", "T0010"]);
    let x = trace.signal("X.position_setpoint_mm").unwrap();
    assert_eq!(x.len(), ROWS - 1);
    assert!(x.value_at(0.14, Method::Hold).is_nan());
    // Latin-1: a degree sign and an umlaut.
    let mut latin = b"Zeit_s;Lage in \xb0;Pr\xfcfung\n".to_vec();
    (0..20).for_each(|k| latin.extend(format!("{};{k};1\n", f64::from(k) * 0.1).bytes()));
    let trace = read("latin.csv", &latin, &options(None)).unwrap();
    assert!(trace.signal("Prüfung").is_some() && said(&trace).contains("Windows-1252"));
}

#[test]
fn said_units_are_brought_into_ours() {
    let head = "t [s];Axes.X.ActPos [m];Axes.X.ActVelo [m/min];Moment [Nm];Axes.C.SetPos [rad]";
    let rows: String = (0..9).map(|k| format!("{};0.5;6;3;{}\n", f64::from(k) * 0.1, std::f64::consts::PI)).collect();
    let trace = read("si.csv", format!("{head}\n{rows}").as_bytes(), &options(None)).unwrap();
    let value = |name: &str| (trace.signal(name).unwrap().values[3], trace.signal(name).unwrap().unit.clone());
    assert_eq!(value("X.position_measured_mm"), (500.0, "mm".to_owned()));
    assert!((value("X.velocity_actual_mm_s").0 - 100.0).abs() < 1e-9);
    assert_eq!(value("Moment [Nm]"), (3.0, "N m".to_owned()));
    assert!((value("C.position_setpoint_deg").0 - 180.0).abs() < 1e-9);
}

#[test]
fn flattened_recorder_data_have_cycles_for_a_time() {
    let head = "CYCLE,DES_POS|1,ENC_POS|1,CTRL_DIFF|1,LOAD|6";
    let rows: String =
        (0..ROWS).map(|k| format!("{},{},{},0.001,5\n", 81_000 + k, position(k), position(k) - 0.001)).collect();
    let named = ImportOptions { axis_names: vec![(1, "X".to_owned())], ..ImportOptions::default() };
    let trace = read("hfdata.csv", format!("{head}\n{rows}").as_bytes(), &named).unwrap();
    let setpoint = trace.signal("X.position_setpoint_mm").unwrap();
    assert_eq!(setpoint.original, "DES_POS|1");
    assert_eq!(setpoint.times.period_s(), Some(0.002));
    assert_eq!(trace.signal("X.control_deviation_mm").unwrap().values[7], 0.001);
    assert!(said(&trace).contains("0.002"));
}
