//! Throughput of the recorder: five axes with all signals at 1 kHz, as the cycle hands them over, to a sink without a disk; and
//! back: reading and the CSV export. One simulated second is computed beforehand and recorded again and again.

#[allow(dead_code)]
#[path = "../tests/recorder/support.rs"]
mod support;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sollwert::base::{AxisId, Tick};
use sollwert::drive::AxisSignals;
use sollwert::interpolator::AxisSetpoint;
use sollwert::machine::Machine;
use sollwert::recorder::{Recorder, Recording, RecordingSetup, RecordingSummary, export_csv};
use std::hint::black_box;
use std::io::Write;

/// Simulated length of one recording.
const SECONDS: u64 = 4;

type Signals = Vec<(AxisId, AxisSetpoint, AxisSignals)>;

fn five_axes() -> Machine {
    let mut machine = support::machine();
    let (linear, rotary) = (machine.axes[0].clone(), machine.axes[2].clone());
    machine.axes = ["X", "Y", "Z", "A", "C"]
        .into_iter()
        .map(|name| {
            let mut axis = if name < "X" { rotary.clone() } else { linear.clone() };
            axis.name = name.to_owned();
            axis
        })
        .collect();
    machine
}

/// All signals of one second, tick by tick: smooth, as those of a machine are.
fn one_second(machine: &Machine) -> Vec<Signals> {
    let ticks = (0..support::TICKS_PER_S).step_by(support::POSITION_TICKS as usize).map(Tick);
    ticks
        .map(|tick| {
            let axes = machine.axis_ids();
            axes.map(|axis| (axis, support::setpoint(tick, axis), support::signals(tick, axis))).collect()
        })
        .collect()
}

fn record(setup: &RecordingSetup, second: &[Signals], output: impl Write + Send + 'static) -> RecordingSummary {
    let mut recorder = Recorder::to_writer(output, setup).expect("a sink takes everything");
    for start in 0..SECONDS {
        for (k, axes) in second.iter().enumerate() {
            let tick = Tick(start * support::TICKS_PER_S + k as u64 * support::POSITION_TICKS);
            if tick.0.is_multiple_of(support::TICKS_PER_SETPOINT) {
                recorder.path(tick, &support::path_sample(tick), Some(0.001));
            }
            for (axis, setpoint, signals) in axes {
                recorder.axis(tick, *axis, setpoint, signals);
            }
        }
    }
    recorder.finish("{}").expect("a sink takes everything")
}

fn benches(criterion: &mut Criterion) {
    let machine = five_axes();
    let programs = support::programs();
    let second = one_second(&machine);
    let mut group = criterion.benchmark_group("recorder");
    group.sample_size(20);
    for (name, mantissa_bits) in [("full", None), ("36-bits", Some(36))] {
        let mut setup = RecordingSetup::new(&machine, "bench.toml", "format = 1\n", &programs);
        setup.mantissa_bits = mantissa_bits;
        let size = record(&setup, &second, std::io::sink());
        let minute_mb = size.bytes as f64 * 60.0 / SECONDS as f64 / 1e6;
        eprintln!("{name}: {minute_mb:.1} MB a simulated minute of five axes");
        group.throughput(Throughput::Bytes(size.bytes));
        group.bench_function(format!("bytes written, {name}"), |b| {
            b.iter(|| record(&setup, black_box(&second), std::io::sink()));
        });
        group.throughput(Throughput::Elements(size.messages));
        group.bench_function(format!("messages written, {name}"), |b| {
            b.iter(|| record(&setup, black_box(&second), std::io::sink()));
        });
    }
    let setup = RecordingSetup::new(&machine, "bench.toml", "format = 1\n", &programs);
    let sink = support::Sink::default();
    let size = record(&setup, &second, sink.clone());
    let recording = Recording::open(&support::file("bench.mcap", &sink.bytes())).expect("just written");
    group.throughput(Throughput::Elements(size.messages));
    group.bench_function("messages read", |b| {
        b.iter(|| recording.messages().expect("just written").filter(|message| black_box(message).is_ok()).count());
    });
    group.throughput(Throughput::Elements(SECONDS * 1000));
    group.bench_function("rows exported to CSV", |b| {
        b.iter(|| export_csv(&recording, &mut std::io::sink()).expect("just written"));
    });
    group.finish();
}

criterion_group!(recorder, benches);
criterion_main!(recorder);
