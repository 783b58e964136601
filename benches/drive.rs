//! Drive sub-steps: current cycles of an axis per second, the axis under sinusoidal motion with reversals and with rest.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sollwert::base::{AxisKind, TimeBase};
use sollwert::drive::{AxisDrive, DriveInput, Start};
use sollwert::machine::{Axis, AxisLimits, DriveData, EncoderData, MechanicsData, MotorData};
use std::f64::consts::TAU;
use std::hint::black_box;

/// Position cycles in one sample.
const CYCLES: u32 = 1000;

/// "mvc x" of models/drive.md section 2: 1 ms, 125 µs, 62.5 µs.
fn axis(gravity_sin_n_m: f64) -> (Axis, TimeBase) {
    let drive = DriveData {
        identified: false,
        in_position_coarse_lu: 0.04,
        in_position_fine_lu: 0.01,
        position_cycle_ticks: 16,
        speed_cycle_ticks: 2,
        current_cycle_ticks: 1,
        position_gain_per_s: 50.0,
        velocity_feedforward_ratio: 1.0,
        torque_feedforward_ratio: 1.0,
        feedforward_inertia_kg_m2: 0.0085,
        setpoint_delay_s: 1.2e-3,
        feedforward_delay_s: 0.0,
        speed_setpoint_max_lu_s: 400.0,
        speed_gain_n_m_s_per_rad: 2.0,
        speed_reset_time_s: 0.010,
        current_gain_v_per_a: 22.0,
        current_reset_time_s: 0.002,
        current_max_a: 28.0,
        voltage_max_v: 245.0,
        motor: MotorData {
            resistance_ohm: 0.75,
            inductance_h: 6.5e-3,
            back_emf_v_s_per_rad: 0.43,
            torque_constant_n_m_per_a: 1.30,
        },
        mechanics: MechanicsData {
            transmission_lu_per_rad: 12.0 / TAU,
            inertia_kg_m2: 0.0085,
            viscous_friction_n_m_s_per_rad: 0.010,
            coulomb_friction_n_m: 0.6,
            breakaway_friction_n_m: 0.6,
            gravity_n_m: 0.0,
            gravity_sin_n_m,
            gravity_cos_n_m: 0.0,
        },
        encoder: EncoderData { position_resolution_lu: 0.0, motor_resolution_rad: 0.0 },
    };
    let axis = Axis {
        name: "X".to_owned(),
        kind: AxisKind::Linear,
        index: 1,
        machine_axis: None,
        limits: AxisLimits {
            velocity_max_lu_s: 333.0,
            acceleration_max_lu_s2: 1000.0,
            jerk_max_lu_s3: 15_000.0,
            transition_jerk_max_lu_s3: 10_000.0,
        },
        follow_up_tolerance_lu: 0.01,
        travel_lu: None,
        home_lu: 0.0,
        modulo: false,
        dynamics: Default::default(),
        drive: Some(drive),
    };
    (axis, TimeBase::new((1_000_000, 1), 16))
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
        ("3 axes interleaved", 3, 0.0, false),
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

criterion_group!(benches, drives);
criterion_main!(benches);
