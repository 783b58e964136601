//! Data Recorder JSON: rows, wraps, gaps, block events, chains.

use super::operate::read;
use super::recorded;
use sollwert::trace::{ImportOptions, Method, Trace, TraceFormat, import};
use std::io::Write;

fn named() -> ImportOptions<'static> {
    ImportOptions { axis_names: vec![(1, "X".to_owned()), (6, "S".to_owned())], ..ImportOptions::default() }
}

fn header(cycle: &str) -> String {
    format!(
        "{{ \"Header\":{{\"Version\":{{\"Format\":\"DEFAULT\"}},{cycle}\"MachineInfo\":{{\"MachineName\":\"A \\\"b\\\" {{[\"}},\
         \"SignalListHFData\":[{{\"Axis\":\"\",\"Type\":\"INT\",\"Name\":\"Cycle\",\"Address\":\"CYCLE\"}},\
         {{\"Name\":\"Desired\",\"Type\":\"DOUBLE\",\"Axis\":\"\",\"Address\":\"DES_POS|1\"}},\
         {{\"Name\":\"Actual\",\"Type\":\"DOUBLE\",\"Axis\":\"\",\"Address\":\"ENC_POS|1\"}},\
         {{\"Name\":\"Ffw\",\"Type\":\"DOUBLE\",\"Axis\":\"\",\"Address\":\"VEL_FFW|1\"}}],\
         \"Initial\":{{\"Time\":\"2026-06-03T17:57:40.613Z\",\"HFProbeCounter\":100}}}},\n"
    )
}

fn position(counter: u64) -> f64 {
    counter as f64 * 0.25
}

/// Rows of counters, ten an element; counters are written modulo 2^31.
fn rows(counters: impl Iterator<Item = u64>) -> String {
    let counters: Vec<u64> = counters.collect();
    let element = |chunk: &[u64]| {
        let rows: Vec<String> = chunk
            .iter()
            .map(|c| format!("[{},{},{},125.0]", c % (1 << 31), position(*c), position(*c) - 0.01))
            .collect();
        format!("{{\"HFData\":[{}]}}", rows.join(", "))
    };
    counters.chunks(10).map(element).collect::<Vec<_>>().join(",\n")
}

fn block(counter: u64, line: u32, text: &str) -> String {
    format!(
        "{{\"HFBlockEvent\":{{\"GCode\":\"{text}\",\"Channel\":1,\"SeekOffset\":{line},\"HFProbeCounter\":{counter},\"laBuf\":12}}}}"
    )
}

fn file(cycle: &str, payload: &[String]) -> String {
    format!("{}\"Payload\":[{}],\n\"Footer\":{{}} }}\n", header(cycle), payload.join(","))
}

const CYCLE: &str = "\"CycleTimeMs\":2.0,";

fn assert_rows(trace: &Trace, first: u64, counters: impl Iterator<Item = u64>) {
    let setpoint = trace.signal("X.position_setpoint_mm").unwrap();
    for counter in counters {
        let time_s = (counter - first) as f64 * 0.002;
        assert_eq!(setpoint.value_at(time_s, Method::Hold), position(counter), "{counter}");
    }
}

#[test]
fn rows_events_and_lines_are_in_the_trace() {
    let payload = [
        block(95, 1, "N10 G0 X0"),
        rows(100..300),
        "{\"HFTimestamp\":{\"HFProbeCounter\":200,\"Time\":\"2026-06-03T17:57:40.813Z\"}}".to_owned(),
        "{\"LFData\":[{\"address\":\"a\",\"value\":[1,{\"b\":\"]}\"}]}]}".to_owned(),
        block(300, 7, "N20 G1 X=R1"),
        rows(300..500),
    ];
    let trace = read("edge.json", file(CYCLE, &payload).as_bytes(), &named()).unwrap();
    assert_eq!(trace.origin.format, TraceFormat::EdgeJson);
    assert_rows(&trace, 100, 100..500);
    let setpoint = trace.signal("DES_POS|1").unwrap();
    assert_eq!((setpoint.len(), setpoint.times.period_s()), (400, Some(0.002)));
    // mm/s in the file: nothing to convert.
    assert_eq!(trace.signal("X.velocity_feedforward_mm_s").unwrap().values[10], 125.0);
    let line = trace.signal("path.line").unwrap();
    assert_eq!((line.values[0], line.values[199], line.values[200]), (1.0, 1.0, 7.0));
    let events: Vec<_> = trace.events.iter().map(|e| (e.time_s, e.event.line, e.event.text.as_deref())).collect();
    assert_eq!(events, [(0.0, Some(1), Some("N10 G0 X0")), (0.4, Some(7), Some("N20 G1 X=R1"))]);
    assert_eq!(trace.origin.start_utc.as_deref(), Some("2026-06-03T17:57:40.613Z"));
}

#[test]
fn low_frequency_values_stand_at_their_counters_and_are_held() {
    let head = header(CYCLE).replace(
        "\"Initial\"",
        "\"SignalListLFData\":[{\"id\":\"1\",\"device\":\"NCU\",\"path\":\"/Channel/Spindle/speedOvr\",\"samplingPeriod\":100},\
         {\"id\":\"2\",\"path\":\"/Channel/State/actToolLength1\"}],\"Initial\"",
    );
    let low = |counter: u64, address: &str, value: &str, key: &str| {
        format!("{{\"address\":\"{address}\",\"value\":{value},\"value_type\":\"DOUBLE\",\"{key}\":{counter}}}")
    };
    let element = |values: &[String]| format!("{{\"LFData\":[{}]}}", values.join(","));
    let payload = [
        // Both ways of writing the counter; ahead of its row, and after it.
        element(&[low(120, "/Channel/Spindle/speedOvr", "100.0", "HFProbeCounter")]),
        element(&[low(160, "/Channel/State/actToolLength1", "\"81.5\"", "HfProbeCounter")]),
        rows(100..200),
        element(&[
            low(190, "/Channel/Spindle/speedOvr", "80", "HFProbeCounter"),
            low(200, "/x", "1", "HFProbeCounter"),
        ]),
        rows(200..300),
    ];
    let text = format!("{head}\"Payload\":[{}],\n\"Footer\":{{}} }}\n", payload.join(","));
    let trace = read("low.json", text.as_bytes(), &named()).unwrap();
    assert_rows(&trace, 100, 100..300);
    let at =
        |name: &str, counter: u32| trace.signal(name).unwrap().value_at(f64::from(counter - 100) * 0.002, Method::Hold);
    assert!(at("/Channel/Spindle/speedOvr", 119).is_nan());
    assert_eq!((at("/Channel/Spindle/speedOvr", 120), at("/Channel/Spindle/speedOvr", 199)), (100.0, 100.0));
    assert_eq!((at("/Channel/Spindle/speedOvr", 200), at("/Channel/State/actToolLength1", 160)), (80.0, 81.5));
    let told = |words: &str| trace.notes.iter().any(|note| note.message.contains(words));
    assert!(told("20 ms after their time") && told("belongs to no signal of the header"), "{:?}", trace.notes);
}

/// As a recorder writes it (seen in a published file): names of the axes in the header, texts in LFData, calls, rows that begin long after
/// the start of the job.
#[test]
fn the_header_names_the_axes_and_texts_and_calls_are_taken() {
    let low = |counter: u64, address: &str, sort: &str, value: &str| {
        format!(
            "{{\"HFProbeCounter\":{counter},\"address\":\"{address}\",\"value_type\":\"{sort}\",\"value\":{value}}}"
        )
    };
    let head = header(CYCLE)
        .replace("\"Axis\":\"\",\"Address\":\"DES_POS|1\"", "\"Axis\":\"X1\",\"Address\":\"DES_POS|1\"")
        .replace("ENC_POS|1", "ENC_POS|6")
        .replace("\"Axis\":\"\",\"Address\":\"ENC_POS|6\"", "\"Axis\":\"SP1\",\"Address\":\"ENC_POS|6\"")
        .replace("\"Initial\"", "\"SignalListLFData\":[{\"path\":\"/tool\"},{\"path\":\"/number\"}],\"Initial\"");
    let payload = [
        rows(2100..2200),
        format!("{{\"LFData\":[{}]}}", low(2200, "/tool", "String", "\"182437\"")),
        format!("{{\"LFData\":[{},{}]}}", low(2200, "/number", "UInt", "\"6\""), low(2210, "/tool", "String", "\"CUTTER\"")),
        "{\"HFCallEvent\":{\"HFProbeCounter\":2205,\"Channel\":1,\"SeekOffset\":390,\"Path\":\"/_N_MPF_DIR/_CUTTING\"}}".to_owned(),
        rows(2200..2300),
    ];
    let text = format!("{head}\"Payload\":[{}],\n\"Footer\":{{}} }}\n", payload.join(","));
    let trace = read("named.json", text.as_bytes(), &ImportOptions::default()).unwrap();
    assert_eq!(trace.signal("DES_POS|1").unwrap().name.as_deref(), Some("X.position_setpoint_mm"));
    assert_eq!(trace.signal("ENC_POS|6").unwrap().name.as_deref(), Some("SP1.position_measured_deg"));
    let told: Vec<_> = trace.notes.iter().filter(|note| note.code == "T0011").collect();
    assert!(told.len() == 1 && told[0].message.contains("1 = X (X1), 6 = SP1 (SP1)"), "{told:?}");
    let tool = trace.signal("/tool").unwrap();
    let place = |counter: u32| tool.times.index_at(f64::from(counter - 2100) * 0.002);
    assert_eq!(place(2199), None);
    assert_eq!(place(2200).and_then(|at| tool.label(at)), Some("182437"));
    assert_eq!(place(2250).and_then(|at| tool.label(at)), Some("CUTTER"));
    assert_eq!(trace.signal("/number").unwrap().value_at(0.2, Method::Hold), 6.0);
    let call = trace.events.iter().find(|event| event.event.kind.as_deref() == Some("call")).unwrap();
    assert_eq!(
        (call.time_s, call.event.line, call.event.program.as_deref()),
        (0.21, Some(390), Some("/_N_MPF_DIR/_CUTTING"))
    );
    // Counter 100 at 40.613 s: the first row, at counter 2100, is 4 s later.
    assert_eq!(trace.origin.start_utc.as_deref(), Some("2026-06-03T17:57:44.613Z"));
    // What the user says comes first.
    let own = ImportOptions { axis_names: vec![(1, "Y".to_owned())], ..ImportOptions::default() };
    let trace = read("renamed.json", text.as_bytes(), &own).unwrap();
    assert_eq!(trace.signal("DES_POS|1").unwrap().name.as_deref(), Some("Y.position_setpoint_mm"));
}

#[test]
fn a_gzip_is_read_whatever_its_name() {
    let packed = |bytes: &[u8]| {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    };
    let text = file(CYCLE, &[rows(100..300)]);
    let trace = read("edge.json.gz", &packed(text.as_bytes()), &named()).unwrap();
    assert_eq!(trace.origin.format, TraceFormat::EdgeJson);
    assert_rows(&trace, 100, 100..300);
    let table: String = (0..50).map(|k| format!("{},{k}\n", f64::from(k) * 0.002)).collect();
    let trace = read("table", &packed(format!("time_s,X_mm\n{table}").as_bytes()), &named()).unwrap();
    assert_eq!(trace.signal("X.position_setpoint_mm").unwrap().values[49], 49.0);
}

#[test]
fn the_counter_wraps_and_what_is_missing_is_a_gap() {
    let first = (1 << 31) - 50;
    let counters = || (first..first + 100).chain(first + 140..first + 200);
    let trace = read("wrap.json", file(CYCLE, &[rows(counters())]).as_bytes(), &named()).unwrap();
    assert_rows(&trace, first, counters());
    let setpoint = trace.signal("X.position_setpoint_mm").unwrap();
    assert!(setpoint.value_at(0.24, Method::Linear).is_nan());
    assert!(trace.notes.iter().any(|note| note.code == "T0013"));
}

#[test]
fn without_a_cycle_time_the_stamps_decide() {
    let stamp = |counter: u32, ms: u32| {
        format!("{{\"HFTimestamp\":{{\"HFProbeCounter\":{counter},\"Time\":\"2026-06-03T17:57:40.{ms:03}Z\"}}}}")
    };
    let payload = [stamp(100, 100), rows(100..200), stamp(200, 501), rows(200..300)];
    let trace = read("stamps.json", file("", &payload).as_bytes(), &named()).unwrap();
    assert_eq!(trace.signal("DES_POS|1").unwrap().times.period_s(), Some(0.004));
    assert!(trace.notes.iter().any(|note| note.code == "T0012" && note.message.contains("4 ms")));
}

#[test]
fn chained_files_in_a_zip_or_a_folder_are_one_trace() {
    let parts = [
        file(CYCLE, &[block(100, 1, "N1"), rows(100..200), block(150, 3, "N3")]),
        file(CYCLE, &[block(150, 3, "N3"), rows(200..300)]),
        file(CYCLE, &[rows(300..400)]),
    ];
    let folder = recorded::temporary("edge_chain");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let archive = recorded::temporary("edge_chain.zip");
    let mut zip = zip::ZipWriter::new(std::fs::File::create(&archive).unwrap());
    for (number, text) in [9, 10, 11].into_iter().zip(&parts) {
        std::fs::write(folder.join(format!("part_{number}.json")), text).unwrap();
        zip.start_file(format!("part_{number}.json"), zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(text.as_bytes()).unwrap();
    }
    zip.finish().unwrap();
    for path in [archive, folder] {
        let trace = import(&path, &named()).unwrap();
        assert_rows(&trace, 100, 100..400);
        assert_eq!(trace.events.len(), 2);
    }
}

#[test]
fn what_is_cut_off_is_taken_and_what_is_wrong_is_marked() {
    let text = file(CYCLE, &[rows(100..200)]);
    let cut = &text[..text.len() - 700];
    let trace = read("edge_cut.json", cut.as_bytes(), &named()).unwrap();
    assert!(trace.notes.iter().any(|note| note.code == "T0007"));
    assert!(trace.signal("DES_POS|1").unwrap().len() > 50);
    let wrong = text.replacen("[105,", "[{105,", 1);
    let finding = read("edge_wrong.json", wrong.as_bytes(), &named()).unwrap_err();
    assert_eq!(finding.code, "T0004");
    let place = finding.place.unwrap();
    assert!(place.line_text[place.columns.start..].starts_with('{'), "{place:?}");
    let nothing = file(CYCLE, &[]);
    assert_eq!(read("edge_nothing.json", nothing.as_bytes(), &named()).unwrap_err().code, "T0003");
    let odd = text.replacen("26.25", "null", 1);
    let trace = read("edge_null.json", odd.as_bytes(), &named()).unwrap();
    assert!(trace.signal("DES_POS|1").unwrap().values[5].is_nan());
}

#[test]
fn an_archive_that_unpacks_without_end_is_refused() {
    let archive = recorded::temporary("bomb.zip");
    let mut zip = zip::ZipWriter::new(std::fs::File::create(&archive).unwrap());
    let deflated = zip::write::SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated)
        .compression_level(Some(6));
    zip.start_file("a.json", deflated).unwrap();
    zip.write_all(header(CYCLE).as_bytes()).unwrap();
    // 120 MB of blanks make a tenth of one.
    let blanks = vec![b' '; 1 << 20];
    for _ in 0..120 {
        zip.write_all(&blanks).unwrap();
    }
    zip.finish().unwrap();
    let finding = import(&archive, &named()).unwrap_err();
    assert!(finding.code == "T0001" && finding.message.contains("bytes come out of one"), "{finding:?}");
}
