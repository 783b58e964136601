//! Operate sessions: what is in the file is in the trace, value by value; what is wrong is said or refused.

use super::operate_session::{SERVO_S, Session, Told, position, speed_per_s};
use sollwert::base::Severity;
use sollwert::trace::{Clock, ImportOptions, Method, TimeGrid, Trace, Zero, import};

pub fn linear() -> Vec<Told> {
    let servo = |name, value| Told { name, servo: true, whole: false, value };
    vec![
        servo("/Nck/!SD/nckServoDataCmdPos2ndEnc64 [u1, 1]", position),
        servo("/Nck/!SD/nckServoDataCmdVelCtrlIn64 [u1, 1]", |t| 60.0 * speed_per_s(t)),
        servo("/Nck/!SD/nckServoDataActPos1stEnc64 [u1, 1]", |t| position(t - 0.006) - 800.0),
        servo("$/Nck/!SD/nckServoDataCtrlDev64 [u1; 1]", |t| (t * 40.0).sin() * 1e-3),
        Told { name: "/Nck/!SEMA/measPos1 [u1, 1]", servo: false, whole: false, value: |t| position(t - 0.01) },
        Told { name: "/Channel/!SEMA/aaStat [u1, 1]", servo: false, whole: true, value: |t| (t * 5.0).floor() },
        Told { name: "/Channel/!RP/rpa [u1, 15]", servo: true, whole: false, value: |_| 7.5 },
    ]
}

fn named(axis: &str) -> ImportOptions<'static> {
    ImportOptions { axis_names: vec![(1, axis.to_owned())], ..ImportOptions::default() }
}

pub fn read(name: &str, bytes: &[u8], options: &ImportOptions) -> Result<Trace, sollwert::base::Diagnostic> {
    import(&super::recorded::file(name, bytes), options)
}

fn codes(trace: &Trace) -> Vec<&str> {
    trace.notes.iter().filter(|note| note.severity != Severity::Note).map(|note| note.code).collect()
}

fn rounded(value: f64) -> f64 {
    format!("{value:.6}").parse().unwrap()
}

#[test]
fn every_value_is_there_whatever_the_order_of_the_attributes() {
    for seed in 1..=6 {
        let session = Session { seed, v20: seed % 2 == 0, ..Session::new(linear()) };
        let trace = read(&format!("order{seed}.xml"), session.text().as_bytes(), &named("X")).unwrap();
        assert_eq!(codes(&trace), [""; 0], "{:?}", trace.notes);
        assert_eq!(trace.origin.start_utc.as_deref(), Some("2026-06-03T17:57:40.613Z"));
        let x = trace.signal("X.position_setpoint_mm").unwrap();
        assert_eq!(x.original, "/Nck/!SD/nckServoDataCmdPos2ndEnc64 [u1, 1]");
        assert_eq!(x.times, TimeGrid::Uniform { start_ns: 0.0, step_ns: 2e6, count: 501 });
        for (k, value) in x.values.iter().enumerate() {
            assert_eq!(*value, rounded(position(k as f64 * SERVO_S)), "{k}");
        }
        let speed = trace.signal("X.velocity_setpoint_mm_s").unwrap();
        assert_eq!(speed.unit, "mm/s");
        for (k, value) in speed.values.iter().enumerate() {
            assert!((value - speed_per_s(k as f64 * SERVO_S)).abs() < 1e-12);
        }
        let measured = trace.signal("X.position_measured_mm").unwrap();
        assert_eq!((measured.meaning.zero, measured.clock), (Zero::Encoder, Clock::Servo));
        // The interpolator's value of the same thing keeps its own name and its own instants.
        let late = trace.signal("/Nck/!SEMA/measPos1 [u1, 1]").unwrap();
        assert_eq!((late.name.as_deref(), late.clock), (None, Clock::Interpolator));
        assert_eq!(late.times, TimeGrid::Uniform { start_ns: 2e6, step_ns: 4e6, count: 250 });
        let status = trace.signal("/Channel/!SEMA/aaStat [u1, 1]").unwrap();
        assert!(status.discrete && status.natural_method() == Method::Hold);
        assert_eq!(status.values[249], (0.998_f64 * 5.0).floor());
        assert_eq!(trace.signal("/Channel/!RP/rpa [u1, 15]").unwrap().values, vec![7.5; 501]);
        let deviation = trace.axis_signal("X", "control_deviation").unwrap();
        assert!(deviation.original.starts_with('$') && deviation.meaning.remark.contains("late"));
    }
}

#[test]
fn a_rotary_axis_has_degrees_and_an_unnamed_axis_says_what_it_is() {
    let mut rotary = linear();
    rotary[1].value = |t| speed_per_s(t) / 6.0;
    let trace = read("rotary.xml", Session::new(rotary.clone()).text().as_bytes(), &named("A")).unwrap();
    let speed = trace.signal("A.velocity_setpoint_deg_s").unwrap();
    // rev/min in the file; 15 has no rounding.
    assert!(speed.values.iter().enumerate().all(|(k, value)| (value - speed_per_s(k as f64 * SERVO_S)).abs() < 1e-12));

    let trace = read("unnamed.xml", Session::new(rotary).text().as_bytes(), &ImportOptions::default()).unwrap();
    assert!(trace.signal("AX1.position_setpoint_deg").is_some());
    let note = trace.notes.iter().find(|note| note.code == "T0011").unwrap();
    assert!(note.message.contains("rotary") && note.help.as_ref().unwrap().contains("--axis-name 1="), "{note:?}");
    let trace = read("unnamed2.xml", Session::new(linear()).text().as_bytes(), &ImportOptions::default()).unwrap();
    assert_eq!(trace.signal("AX1.velocity_setpoint_mm_s").unwrap().values[150], 90.0);
}

#[test]
fn between_frames_there_is_nothing() {
    let frames = vec![("2026-06-03T23:59:59.500Z", 500), ("2026-06-04T00:00:01.500Z", 250)];
    let session = Session { frames, drop_outs: 3, ..Session::new(linear()) };
    let trace = read("frames.xml", session.text().as_bytes(), &named("X")).unwrap();
    let x = trace.signal("X.position_setpoint_mm").unwrap();
    assert_eq!(trace.span_s(), Some((0.0, 2.5)));
    assert_eq!(x.value_at(1.0, Method::Linear), position(1.0));
    assert!(x.value_at(1.5, Method::Linear).is_nan() && x.value_at(1.5, Method::Hold).is_nan());
    assert_eq!(x.value_at(2.0, Method::Linear), -300.0);
    assert!((x.value_at(2.4, Method::Linear) - position(0.4)).abs() < 1e-6);
    assert!(codes(&trace).contains(&"T0013"));
}

#[test]
fn what_is_broken_is_repaired_and_said() {
    let text = Session::new(linear()).text();
    let cut = &text[..text.rfind("<rec ").unwrap() + 12];
    let trace = read("cut.xml", cut.as_bytes(), &named("X")).unwrap();
    assert_eq!(codes(&trace), ["T0007"]);
    assert_eq!(trace.signal("X.position_setpoint_mm").unwrap().values[300], rounded(position(0.6)));

    let unclosed =
        read("unclosed.xml", text.replace("</dataFrame>\n</traceData>\n</traceSession>", "").as_bytes(), &named("X"));
    assert_eq!(codes(&unclosed.unwrap()), ["T0007"]);

    let backwards = text.replace("time=\"0.500000\"", "time=\"0.100000\"");
    let trace = read("backwards.xml", backwards.as_bytes(), &named("X")).unwrap();
    let note = trace.notes.iter().find(|note| note.code == "T0009").unwrap();
    let line = note.place.as_ref().unwrap().line as usize;
    assert!(backwards.lines().nth(line - 1).unwrap().contains("time=\"0.100000\""));

    let odd = text.replacen("\"-255.000000\"", "\"-1.#IND00\"", 1).replacen("\"-264.000000\"", "\"-264,0\"", 1);
    assert_ne!(odd, text);
    let trace = read("odd.xml", odd.as_bytes(), &named("X")).unwrap();
    let x = trace.signal("X.position_setpoint_mm").unwrap();
    assert!(x.values[350].is_nan() && x.values[349] == rounded(position(0.698)) && x.values[300] == -264.0);
    assert_eq!(trace.notes.iter().filter(|note| note.code == "T0010").count(), 2);

    let extra = text.replacen("\n<rec ", "\n<rec f99=\"1\" ", 1);
    assert_eq!(codes(&read("extra.xml", extra.as_bytes(), &named("X")).unwrap()), ["T0008"]);
    let short = text.replace("datapointCount=\"501\"", "datapointCount=\"700\"");
    assert_eq!(codes(&read("short.xml", short.as_bytes(), &named("X")).unwrap()), ["T0008"]);
}

#[test]
fn a_trace_that_runs_backwards_is_refused_and_no_index_is_no_axis() {
    let text = Session::new(linear()).text();
    let (mut records, other): (Vec<&str>, Vec<&str>) =
        text.lines().partition(|line| line.trim_start().starts_with("<rec "));
    let place = other.iter().position(|line| line.contains("</dataFrame>")).unwrap();
    let file = |records: &[&str]| {
        let (head, tail) = other.split_at(place);
        [head, records, tail].concat().join("\n")
    };
    records.reverse();
    let refused = read("reversed.xml", file(&records).as_bytes(), &named("X")).unwrap_err();
    assert!(refused.code == "T0009" && refused.message.contains("backwards"), "{refused:?}");
    assert_eq!(refused.place.unwrap().line as usize, place + 2);
    // A record that stands a thousand times counts once, with its first values.
    records.reverse();
    let many: Vec<&str> = records.iter().flat_map(|record| std::iter::repeat_n(*record, 100)).collect();
    let trace = read("repeated.xml", file(&many).as_bytes(), &named("X")).unwrap();
    let once = read("once.xml", file(&records).as_bytes(), &named("X")).unwrap();
    assert_eq!(trace.signals, once.signals);
    assert_eq!(codes(&trace), ["T0009"]);
    // The unit number is no axis.
    let odd = text.replace("[u1, 1]", "[u1, ?]");
    let trace = read("odd_index.xml", odd.as_bytes(), &named("X")).unwrap();
    let setpoint = trace.signals.iter().find(|signal| signal.original.contains("CmdPos")).unwrap();
    assert_eq!(setpoint.name, None, "{setpoint:?}");
}

#[test]
fn any_encoding_is_read() {
    let text = Session::new(linear()).text().replace("a &lt; b", "Lageistwert Achse für Prüfung");
    let mut latin: Vec<u8> = Vec::new();
    text.chars().for_each(|c| latin.push(u8::try_from(u32::from(c)).unwrap()));
    let trace = read("latin.xml", &latin, &named("X")).unwrap();
    assert!(trace.notes.iter().any(|note| note.code == "T0014"));
    assert!(trace.signals.iter().any(|signal| signal.meaning.remark.contains("für Prüfung")));
    let mut wide = vec![0xff, 0xfe];
    text.encode_utf16().for_each(|unit| wide.extend(unit.to_le_bytes()));
    let trace = read("wide.xml", &wide, &named("X")).unwrap();
    assert_eq!(trace.signal("X.position_setpoint_mm").unwrap().values[300], rounded(position(0.6)));
}

#[test]
fn bombs_and_nothing_are_refused() {
    let text = Session::new(linear()).text();
    let refused = |name: &str, text: &str| read(name, text.as_bytes(), &named("X")).unwrap_err().code;
    let bomb = "<!DOCTYPE a [<!ENTITY b \"cccccccc\"><!ENTITY d \"&b;&b;&b;&b;\">]>\n<traceSession";
    assert_eq!(refused("bomb.xml", &text.replacen("<traceSession", bomb, 1)), "T0006");
    let long = format!("\n<rec f1=\"{}\" ", "1".repeat(5 << 20));
    assert_eq!(refused("long.xml", &text.replacen("\n<rec ", &long, 1)), "T0005");
    let empty = Session { frames: vec![], ..Session::new(linear()) };
    assert_eq!(refused("no_records.xml", &empty.text()), "T0003");
    assert_eq!(refused("empty.xml", ""), "T0003");
    assert_eq!(refused("other.xml", "<?xml version=\"1.0\"?><html><body/></html>"), "T0002");
    let finding = read("broken.xml", text.replacen("\n<rec ", "\n<rec <", 1).as_bytes(), &named("X"));
    assert!(finding.is_ok() || finding.unwrap_err().code == "T0004");
}
