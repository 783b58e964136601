//! Throughput of the importers (an Operate session of ten signals as text, the messages of a recording) and of a comparison.

// It finds `random` beside itself, as in the tests.
#[allow(dead_code)]
#[path = "../tests/trace/operate_session.rs"]
mod operate_session;
#[path = "../tests/random/mod.rs"]
mod random;
#[allow(dead_code)]
#[path = "../tests/recorder/support.rs"]
mod support;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use operate_session::{Session, Told, position};
use sollwert::compare::{CompareOptions, compare, prepare};
use sollwert::recorder::RecordingSetup;
use sollwert::trace::{ImportOptions, import};

/// Ten signals that change in every cycle: the most that a file can hold.
fn signals(value: fn(f64) -> f64) -> Vec<Told> {
    const NAMES: [&str; 10] = [
        "/Nck/!SD/nckServoDataCmdPos2ndEnc64 [u1, 1]",
        "/Nck/!SD/nckServoDataActPos2ndEnc64 [u1, 1]",
        "/Nck/!SD/nckServoDataCtrlDev64 [u1, 1]",
        "/Nck/!SD/nckServoDataFlwErr64 [u1, 1]",
        "/Nck/!SD/nckServoDataCmdVelCtrlIn64 [u1, 1]",
        "/Nck/!SD/nckServoDataActVelMot32 [u1, 1]",
        "/Nck/!SD/nckServoDataActCurr32 [u1, 1]",
        "/Nck/!SD/nckServoDataCmdTorque32 [u1, 1]",
        "/Nck/!SEMA/measPos1 [u1, 1]",
        "/Nck/!SEMA/measPos2 [u1, 1]",
    ];
    NAMES.iter().map(|name| Told { name, servo: !name.contains("measPos"), whole: false, value }).collect()
}

fn value(t: f64) -> f64 {
    position(t) + (t * 911.0).sin()
}

/// The same motion 3.25 s later.
fn later_value(t: f64) -> f64 {
    position(t - 3.25) + (t * 911.0).sin()
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("trace");
    group.sample_size(10);
    let session = Session { frames: vec![("2026-06-03T17:57:40.613Z", 100_000)], ..Session::new(signals(value)) };
    let text = session.text();
    let path = support::file("bench_session.xml", text.as_bytes());
    let named = ImportOptions { axis_names: vec![(1, "X".to_owned())], ..ImportOptions::default() };
    group.throughput(Throughput::Bytes(text.len() as u64));
    group.bench_function("bytes of an Operate session", |b| b.iter(|| import(&path, &named).expect("just written")));
    let machine = support::machine();
    let programs = support::programs();
    let setup = RecordingSetup::new(&machine, "bench.toml", "format = 1\n", &programs);
    let path = support::file("bench_trace.mcap", &support::recorded(&setup, 60 * support::TICKS_PER_S));
    let messages = sollwert::recorder::Recording::open(&path).expect("just written").message_count();
    group.throughput(Throughput::Elements(messages));
    group.bench_function("messages of a recording, all signals", |b| {
        b.iter(|| import(&path, &ImportOptions::default()).expect("just written"));
    });
    let only = ImportOptions { only: vec!["position_setpoint".to_owned()], ..ImportOptions::default() };
    group.bench_function("messages of a recording, positions", |b| {
        b.iter(|| import(&path, &only).expect("just written"));
    });
    let mut traces = [value, later_value].map(|value: fn(f64) -> f64| {
        let session = Session { frames: vec![("2026-06-03T17:57:40.613Z", 100_000)], ..Session::new(signals(value)) };
        let path = support::file("bench_compared.xml", session.text().as_bytes());
        import(&path, &named).expect("just written")
    });
    traces.iter_mut().for_each(prepare);
    let [trace, reference] = &traces;
    let samples: usize = trace.signals.iter().map(|signal| signal.values.len()).sum();
    group.throughput(Throughput::Elements(samples as u64));
    group.bench_function("samples compared", |b| {
        b.iter(|| compare(trace, reference, &CompareOptions::default()).expect("two traces of one axis"));
    });
    group.finish();
}

criterion_group!(trace, benches);
criterion_main!(trace);
