//! Drive sub-steps: current cycles of an axis per second, the axis under sinusoidal motion with reversals and with rest.

#[path = "../tests/test_machine/mod.rs"]
mod test_machine;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sollwert::base::TimeBase;
use sollwert::drive::{AxisDrive, DriveBatch, DriveInput, Start};
use sollwert::machine::Axis;
use std::f64::consts::TAU;
use std::hint::black_box;

/// Position cycles in one sample.
const CYCLES: u32 = 1000;

/// X of the Spinner MVC 850 with full torque feed-forward: 1 ms, 125 µs, 62.5 µs.
fn axis(gravity_sin_n_m: f64) -> (Axis, TimeBase) {
    let mut machine = test_machine::shipped("spinner_mvc850", &["axes.X.drive.torque_feedforward=1"]);
    let mut axis = machine.axes.remove(0);
    if let Some(drive) = &mut axis.drive {
        drive.mechanics.gravity_sin_n_m = gravity_sin_n_m;
    }
    (axis, machine.cycle.time_base)
}

/// Set-point of cycle k: 20 mm amplitude at 2 Hz, so that a sample holds four reversals.
fn setpoints(phase_rad: f64) -> Vec<DriveInput> {
    (0..CYCLES)
        .map(|k| DriveInput {
            position_setpoint_lu: 20.0 * (TAU * 2.0 * f64::from(k) * 1e-3 + phase_rad).sin(),
            load_n_m: 0.0,
            feedforward_active: true,
        })
        .collect()
}

fn drives(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("axis current-steps");
    for (name, count, gravity_sin_n_m, standing) in [
        ("1 axis moving", 1_u32, 0.0, false),
        ("1 axis standing", 1, 0.0, true),
        ("1 axis moving, gravity with the angle", 1, 1.0, false),
        ("3 axes one after the other", 3, 0.0, false),
    ] {
        let (axis, time_base) = axis(gravity_sin_n_m);
        let inputs: Vec<Vec<DriveInput>> = (0..count)
            .map(|i| {
                let inputs = setpoints(f64::from(i));
                if standing { vec![inputs[0]; inputs.len()] } else { inputs }
            })
            .collect();
        let start: Vec<AxisDrive> = inputs
            .iter()
            .filter_map(|inputs| AxisDrive::new(&axis, &time_base, Start::Held, inputs[0].position_setpoint_lu))
            .collect();
        let steps = start.iter().map(|drive| u64::from(drive.ticks_per_step() * CYCLES)).sum();
        group.throughput(Throughput::Elements(steps));
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter_batched(
                || start.clone(),
                |mut drives| {
                    for k in 0..CYCLES as usize {
                        for (drive, inputs) in drives.iter_mut().zip(&inputs) {
                            black_box(drive.step(inputs[k]));
                        }
                    }
                    drives
                },
                criterion::BatchSize::SmallInput,
            );
        });
    }
    group.finish();
}

/// The axes of a machine as the kernel steps them.
fn machine(criterion: &mut Criterion) {
    let (axis, time_base) = axis(0.0);
    let mut group = criterion.benchmark_group("axis current-steps");
    for count in [3_u32, 5] {
        let inputs: Vec<Vec<DriveInput>> = (0..count).map(|i| setpoints(f64::from(i))).collect();
        let drives: Vec<AxisDrive> = inputs
            .iter()
            .filter_map(|inputs| AxisDrive::new(&axis, &time_base, Start::Held, inputs[0].position_setpoint_lu))
            .collect();
        group.throughput(Throughput::Elements(
            drives.iter().map(|drive| u64::from(drive.ticks_per_step() * CYCLES)).sum(),
        ));
        let start = DriveBatch::new(drives);
        group.bench_function(BenchmarkId::from_parameter(format!("{count} axes of a machine")), |bencher| {
            bencher.iter_batched(
                || start.clone(),
                |mut batch| {
                    let cycles = 0..CYCLES as usize;
                    cycles.for_each(|k| {
                        batch.step_some(
                            |place| Some(inputs[place][k]),
                            |_, signals| {
                                black_box(signals);
                            },
                        );
                    });
                    batch
                },
                criterion::BatchSize::SmallInput,
            );
        });
    }
    group.finish();
}

/// Sixty-four parameter sets of one axis in step.
fn batch(criterion: &mut Criterion) {
    const LANES: u32 = 64;
    let (axis, time_base) = axis(0.0);
    let drives: Vec<AxisDrive> = (0..LANES)
        .filter_map(|n| {
            let mut axis = axis.clone();
            if let Some(drive) = &mut axis.drive {
                drive.position_gain_per_s *= 1.0 + 0.005 * f64::from(n);
                drive.mechanics.coulomb_friction_n_m *= 1.0 + 0.01 * f64::from(n);
            }
            AxisDrive::new(&axis, &time_base, Start::Held, 0.0)
        })
        .collect();
    let inputs = setpoints(0.0);
    // As a study has it: one row of inputs, filled for every cycle.
    let mut row = vec![inputs[0]; LANES as usize];
    let steps = drives.iter().map(|drive| u64::from(drive.ticks_per_step() * CYCLES)).sum();
    let start = DriveBatch::new(drives);
    let mut group = criterion.benchmark_group("axis current-steps");
    group.throughput(Throughput::Elements(steps)).sample_size(20);
    group.bench_function("64 parameter sets in step", |bencher| {
        bencher.iter_batched(
            || start.clone(),
            |mut batch| {
                for input in &inputs {
                    row.fill(*input);
                    batch.step(&row, |_, signals| {
                        black_box(signals);
                    });
                }
                batch
            },
            criterion::BatchSize::LargeInput,
        );
    });
    group.finish();
}

criterion_group!(benches, drives, machine, batch);
criterion_main!(benches);
