//! TwinCAT Scope, halscope, halsampler.

use super::operate::read;
use sollwert::trace::{ImportOptions, Method, TraceFormat, Zero};

#[test]
fn a_scope_file_has_channels_on_their_own_grids() {
    let rows = |comma: bool| {
        let mut text = String::new();
        for k in 0..100 {
            // The second channel is ten times slower: its pairs end early.
            let fast = format!("{k}\t{:.1}", f64::from(k) * 0.5);
            let slow = if k < 10 { format!("{}\t{:.2}", 10 * k, f64::from(k) * 0.25) } else { "\t".to_owned() };
            text += &format!("{fast}\t{slow}\r\n");
        }
        if comma { text.replace('.', ",") } else { text }
    };
    for comma in [false, true] {
        let head = "Name\tProject\r\nFile\tscope.svdx\r\nStarttime of export\t132549876543210000\r\nEndtime of export\t132549876544210000\r\n\r\n\
            Name\tAxes.X.ActPos\tName\tSetVelo\r\nSymbolComment\t\tSymbolComment\t\r\nSampleTime[ms]\t1\tSampleTime[ms]\t10\r\n\
            SymbolName\tAxes.X.ActPos\tSymbolName\tAxes.Y.SetVelo\r\n\r\n";
        let trace =
            read("scope.csv", format!("{head}{}EOF\r\n", rows(comma)).as_bytes(), &ImportOptions::default()).unwrap();
        assert_eq!(trace.origin.format, TraceFormat::TwinCatCsv);
        let fast = trace.signal("X.position_measured_mm").unwrap();
        assert_eq!((fast.len(), fast.times.period_s(), fast.meaning.zero), (100, Some(0.001), Zero::Encoder));
        assert_eq!(fast.values[99], 49.5);
        let slow = trace.signal("Axes.Y.SetVelo").unwrap();
        assert_eq!((slow.len(), slow.times.period_s(), slow.values[9]), (10, Some(0.01), 2.25));
        assert_eq!(slow.name.as_deref(), Some("Y.velocity_setpoint_mm_s"));
    }
}

/// The scope's own way: channels of one task share a column of time, the key stands again where the next group begins.
#[test]
fn groups_of_channels_share_a_column_of_time() {
    for (separator, quote) in [('\t', ""), (';', ""), (':', ""), (' ', "\"")] {
        let line = |cells: &[&str]| {
            let shown =
                |cell: &&str| if cell.contains(' ') { format!("{quote}{cell}{quote}") } else { (*cell).to_owned() };
            cells.iter().map(shown).collect::<Vec<_>>().join(&separator.to_string()) + "\r\n"
        };
        let mut text =
            line(&["Name", "Project"]) + &line(&["Starttime of export", "132959733843760000", "Monday"]) + "\r\n\r\n";
        text += &line(&["Name", "ActPos", "SetVelo", "Name", "load", ""]);
        text += &line(&["Data-Type", "REAL64", "REAL64", "Data-Type", "REAL32"]);
        text += &line(&["SampleTime[ms]", "2", "2", "SampleTime[ms]", "0.5"]);
        text += &line(&["SymbolName", "Axes.X.ActPos", "Axes.X.SetVelo", "SymbolName", ""]);
        text += &line(&["Unit", "(None)", "(None)", "Unit", "% (Ratio)"]);
        text += "\r\n";
        for k in 0..40 {
            // The slow group ends after a quarter of its lines; the clock of the other starts before.
            let fast = [format!("{}", f64::from(k) * 0.5 - 3.0), format!("{k}")];
            let slow = match k {
                0..10 => [format!("{}", 2 * k), format!("{}", f64::from(k) * 0.25), format!("{}", 10 * k)],
                _ => [String::new(), String::new(), String::new()],
            };
            let cells: Vec<&str> = slow.iter().chain(&fast).map(String::as_str).collect();
            text += &line(&cells);
        }
        text += "EOF\r\n";
        let trace = read("groups.csv", text.as_bytes(), &ImportOptions::default()).unwrap();
        assert_eq!(trace.origin.format, TraceFormat::TwinCatCsv, "{separator:?}");
        assert_eq!(trace.origin.start_utc.as_deref(), Some("2022-05-02T13:56:24.376Z"));
        assert_eq!(trace.signals.len(), 3, "{separator:?}");
        let position = trace.signal("X.position_measured_mm").unwrap();
        assert_eq!((position.len(), position.times.start_s(), position.times.period_s()), (10, Some(0.0), Some(0.002)));
        let velocity = trace.signal("X.velocity_setpoint_mm_s").unwrap();
        assert_eq!((velocity.values[9], velocity.times.end_s()), (90.0, Some(0.018)));
        let load = trace.signal("load").unwrap();
        assert_eq!((load.len(), load.unit.as_str(), load.values[39]), (40, "%", 39.0));
        assert_eq!((load.times.start_s(), load.times.period_s()), (Some(-0.003), Some(0.0005)));
    }
}

#[test]
fn halscope_says_its_period() {
    let mut text = String::from("# Sampling period is 1000000 ns\njoint.0.motor-pos-cmd;joint.0.f-error;spindle\n");
    text += "# Position: 0; 0; 0;\n# Scale: 1; 1; 1;\n";
    (0..50).for_each(|k| text += &format!("{};{:e};1\n", f64::from(k) * 0.25, 1e-3));
    let trace = read("hal.txt", text.as_bytes(), &ImportOptions::default()).unwrap();
    assert_eq!(trace.origin.format, TraceFormat::Halscope);
    let setpoint = trace.signal("X.position_setpoint_mm").unwrap();
    assert_eq!((setpoint.times.period_s(), setpoint.values[49]), (Some(0.001), 12.25));
    assert_eq!(trace.signal("X.following_error_mm").unwrap().values[3], 1e-3);
}

/// As halscope of LinuxCNC up to 2.8 saves it (seen in published files): a name before every value, decimal comma by locale, a pin twice.
#[test]
fn halscope_of_older_versions_has_a_name_before_every_value() {
    let mut text = String::from("Sampling period is 100000 nSec \n\n");
    for k in 0..60 {
        let value = format!("{:+.14}", f64::from(k) * 0.25 - 4.0).replace('.', ",");
        text += &format!("arc-ok {:+.14} joint.2.motor-pos-cmd {value} arc-ok +1,00000000000000 \n", f64::from(k / 30));
    }
    text += "arc-ok +1,0 joint.1.motor-pos-cmd +1,0 arc-ok +1,0\n";
    let trace = read("old.log", text.as_bytes(), &ImportOptions::default()).unwrap();
    assert_eq!(trace.origin.format, TraceFormat::Halscope);
    assert_eq!(trace.signals.len(), 3);
    let setpoint = trace.signal("Z.position_setpoint_mm").unwrap();
    assert_eq!((setpoint.len(), setpoint.times.period_s(), setpoint.times.end_s()), (60, Some(1e-4), Some(0.0059)));
    assert_eq!((setpoint.values[0], setpoint.values[59]), (-4.0, 10.75));
    assert_eq!((trace.signals[0].values[29], trace.signals[0].values[30]), (0.0, 1.0));
    assert!(
        trace.notes.iter().any(|note| note.code == "T0008" && note.message.contains("left out")),
        "{:?}",
        trace.notes
    );
}

#[test]
fn halsampler_counts_and_an_overrun_is_a_gap() {
    let row = |k: i32| format!("{k} {} {}\n", f64::from(k) * 0.5, 7);
    let text: String = (100..150).map(row).collect::<String>() + "overrun\n" + &(160..200).map(row).collect::<String>();
    let options = ImportOptions {
        time_column: Some("0.002".to_owned()),
        signal_map: vec![("column 1".to_owned(), "X.position_setpoint_mm".to_owned())],
        ..ImportOptions::default()
    };
    let trace = read("sampler.txt", text.as_bytes(), &options).unwrap();
    assert_eq!(trace.origin.format, TraceFormat::Halsampler);
    let signal = trace.signal("X.position_setpoint_mm").unwrap();
    assert_eq!(signal.value_at(0.0, Method::Hold), 50.0);
    assert_eq!(signal.value_at(0.12, Method::Linear), 80.0);
    assert!(signal.value_at(0.11, Method::Linear).is_nan());
    assert!(trace.notes.iter().any(|note| note.code == "T0013"));
    let unsaid = read("sampler2.txt", text.as_bytes(), &ImportOptions::default()).unwrap();
    assert!(unsaid.notes.iter().any(|note| note.code == "T0015"));
}
