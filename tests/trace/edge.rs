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
