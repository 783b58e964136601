//! Throughput of planning and interpolation: pieces of path planned per second, set-points per second.
//!
//! In: a dense polyline of 0.5 mm segments, and one of 5 mm, both rounded, and under `continuous` one of 0.3 mm as lines and compressed. Out:
//! criterion's report. Does not assert times.

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use sollwert::feed::Planner;
use sollwert::interpolator::Interpolator;
use sollwert::interpreter::Compressor;
use sollwert::kinematics::JointPath;
use sollwert::machine::{BlendShape, Machine, PathMode, TimeLawKind};
use std::hint::black_box;

#[path = "../tests/feed/support.rs"]
mod support;

const BLOCKS: u32 = 4000;

/// So many that start and end of the path count for little, also where a window of 1000 is planned to the end of the path at once.
const LONG_BLOCKS: u32 = 40_000;

fn program(segment_mm: f64, blocks: u32) -> support::Program {
    // A closed curve of varying curvature.
    let radius_mm = f64::from(blocks) * segment_mm / std::f64::consts::TAU;
    let points: Vec<[f64; 2]> = (1..=blocks)
        .map(|i| {
            let angle = f64::from(i) / f64::from(blocks) * std::f64::consts::TAU;
            let r = radius_mm * (1.0 + 0.2 * (7.0 * angle).sin());
            [r * angle.cos() - radius_mm, r * angle.sin()]
        })
        .collect();
    support::Program::polyline(PathMode::G642, 3000.0, &points)
}

fn plan(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("blocks planned");
    group.sample_size(20);
    group.throughput(Throughput::Elements(u64::from(BLOCKS)));
    for (segment_mm, window) in [(0.5, 8), (0.5, 100), (0.5, 1000), (5.0, 8), (5.0, 100)] {
        let mut machine = support::spinner();
        machine.look_ahead_blocks = window;
        let paths = program(segment_mm, BLOCKS).paths(&machine);
        group.bench_function(format!("{segment_mm} mm, window {window}"), |bencher| {
            bencher.iter_batched(|| paths.clone(), |paths| plan_all(&machine, paths), BatchSize::LargeInput);
        });
    }
    group.finish();
}

/// The same under `continuous`: lines as they are, and what the compressor makes of them; one window is ten times the other.
fn plan_continuous(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("blocks planned, continuous");
    group.sample_size(10);
    for (name, mode, compressor, blocks) in [
        ("lines", PathMode::G64, Compressor::Off, LONG_BLOCKS),
        ("compressed", PathMode::G642, Compressor::Cad, LONG_BLOCKS),
        ("blends", PathMode::G642, Compressor::Off, BLOCKS),
    ] {
        group.throughput(Throughput::Elements(u64::from(blocks)));
        for window in [100, 1000] {
            let mut machine = support::spinner();
            machine.look_ahead_blocks = window;
            machine.feed.time_law = TimeLawKind::Continuous;
            machine.smoothing.shape = BlendShape::Quintic;
            let mut program = program(0.3, blocks);
            for motion in &mut program.moves {
                motion.modes.path_mode = mode;
                motion.modes.compressor = compressor;
            }
            let paths = program.paths(&machine);
            group.bench_function(format!("{name}, window {window}"), |bencher| {
                bencher.iter_batched(|| paths.clone(), |paths| plan_all(&machine, paths), BatchSize::LargeInput);
            });
        }
    }
    group.finish();
}

fn plan_all(machine: &Machine, paths: Vec<JointPath>) {
    let mut planner = Planner::new(machine);
    for path in paths {
        planner.push(path).unwrap();
        while let Some(piece) = planner.pop() {
            black_box(piece);
        }
    }
    planner.finish();
    while let Some(piece) = planner.pop() {
        black_box(piece);
    }
}

fn sample(criterion: &mut Criterion) {
    let machine = support::spinner();
    let mut group = criterion.benchmark_group("set-points");
    group.sample_size(20);
    for segment_mm in [0.5, 5.0] {
        let planned = program(segment_mm, BLOCKS).planned(&machine);
        let count = support::sample(&machine, planned.clone()).len() as u64;
        group.throughput(Throughput::Elements(count));
        group.bench_function(format!("{segment_mm} mm segments"), |bencher| {
            bencher.iter_batched(
                || planned.clone().into_iter(),
                |mut pieces| {
                    let mut interpolator = Interpolator::new(&machine);
                    let mut next = || pieces.next();
                    for k in 0.. {
                        let Some(setpoint) = interpolator.sample(k, &mut next) else { break };
                        black_box(setpoint);
                    }
                },
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, plan, plan_continuous, sample);
criterion_main!(benches);
