//! Our own recordings as traces: every value, every time.

use crate::recorded::{self, POSITION_TICKS, TICKS_PER_SETPOINT};
use sollwert::base::{AxisId, Tick};
use sollwert::recorder::RecordingSetup;
use sollwert::trace::{Clock, ImportOptions, TimeGrid, Trace, TraceFormat, import};

const TICKS: u64 = 100 * POSITION_TICKS;

fn trace(name: &str, options: &ImportOptions) -> Trace {
    let machine = recorded::machine();
    let programs = recorded::programs();
    let setup = RecordingSetup::new(&machine, "test.toml", recorded::MACHINE_TEXT, &programs);
    import(&recorded::file(name, &recorded::recorded(&setup, TICKS)), options).unwrap()
}

#[test]
fn every_field_is_a_signal_on_its_own_grid() {
    let trace = trace("trace_fields.mcap", &ImportOptions::default());
    assert_eq!(trace.origin.format, TraceFormat::Recording);
    assert_eq!(trace.axes(), ["X", "Y", "C"]);
    let x = trace.signal("X.position_setpoint_mm").unwrap();
    assert_eq!(x.times, TimeGrid::Uniform { start_ns: 0.0, step_ns: 1e6, count: 101 });
    for (k, value) in x.values.iter().enumerate() {
        assert_eq!(*value, recorded::signal(Tick(k as u64 * POSITION_TICKS), AxisId::new(0), 0));
        assert_eq!(x.times.time_s(k), k as f64 / 1000.0);
    }
    // C has every second position cycle: its own grid, nothing is held.
    let c = trace.axis_signal("C", "position_actual").unwrap();
    assert_eq!((c.shown_name(), c.unit.as_str(), c.clock), ("C.position_actual_deg", "deg", Clock::Servo));
    assert_eq!(c.times.period_s(), Some(0.002));
    assert_eq!(c.values.len(), 51);
    assert_eq!(trace.span_s(), Some((0.0, 0.1)));
    assert!(trace.machine.is_some() && trace.summary.is_some() && trace.programs.len() == 1);
    let starts = trace.events.iter().filter(|entry| entry.event.kind.as_deref() == Some("block_start"));
    assert_eq!(starts.map(|entry| (entry.time_s, entry.event.line)).collect::<Vec<_>>(), [(0.0, Some(1))]);
}

#[test]
fn words_are_labels_and_what_is_absent_is_nan() {
    let trace = trace("trace_words.mcap", &ImportOptions::default());
    let axis = trace.signal("path.limit_axis").unwrap();
    let feed = trace.signal("path.programmed_feed_mm_min").unwrap();
    let line = trace.signal("path.line").unwrap();
    for k in 0..axis.len() {
        let sample = recorded::path_sample(Tick(k as u64 * TICKS_PER_SETPOINT));
        assert_eq!(axis.label(k), sample.limit.axis.map(|_| "C"));
        assert_eq!(feed.values[k].is_nan(), sample.programmed_feed_lu_s.is_none());
        assert_eq!(line.values[k], f64::from(sample.block.line));
    }
    assert!(line.discrete);
}

#[test]
fn only_what_is_asked_for_is_kept() {
    let only = ["following_error", "path.line", "Y.position_setpoint_mm"].map(str::to_owned).to_vec();
    let trace = trace("trace_only.mcap", &ImportOptions { only, ..ImportOptions::default() });
    let names: Vec<&str> = trace.signals.iter().map(|signal| signal.shown_name()).collect();
    let expected = [
        "X.following_error_mm",
        "Y.position_setpoint_mm",
        "Y.following_error_mm",
        "C.following_error_deg",
        "path.line",
    ];
    assert_eq!(names, expected);
}
