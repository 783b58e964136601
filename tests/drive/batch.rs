//! Many drives in step are the same drives alone, to the last bit.

use crate::rig::{Random, Rig, input, mvc_x, mvc_y, ucp_a};
use sollwert::drive::{AxisDrive, AxisSignals, DriveBatch, DriveInput};

/// Sixty-four parameter sets around the two Spinner axes, friction and limits included, and others that go alone.
fn rigs(random: &mut Random) -> Vec<Rig> {
    (0..70)
        .map(|n| {
            if n == 11 {
                return ucp_a();
            }
            let rig = if n % 2 == 0 { mvc_x() } else { mvc_y() };
            let mut scaled = |middle: f64| middle * (1.0 + 0.4 * random.signed());
            rig.with(|data| {
                data.position_gain_per_s = scaled(50.0);
                data.speed_gain_n_m_s_per_rad = scaled(2.0);
                data.velocity_feedforward_ratio = scaled(0.7);
                data.setpoint_delay_s = scaled(1.5e-3);
                data.mechanics.inertia_kg_m2 = scaled(0.009);
                data.mechanics.coulomb_friction_n_m = if n % 7 == 0 { 0.0 } else { scaled(0.8) };
                data.mechanics.breakaway_friction_n_m = data.mechanics.coulomb_friction_n_m * (1.0 + scaled(0.1));
                data.current_max_a = scaled(6.0);
                data.voltage_max_v = scaled(60.0);
                data.mechanics.gravity_n_m = scaled(0.2);
                match n {
                    20 => data.options.stiffness_control = true,
                    33 => data.mechanics.backlash_lu = 0.01,
                    41 => data.encoder.motor_resolution_rad = 1e-5,
                    // More speed cycles than the others, in a block of its own.
                    50 => data.speed_cycle_ticks = data.current_cycle_ticks,
                    _ => {}
                }
            })
        })
        .collect()
}

#[test]
fn a_batch_is_every_drive_alone() {
    let mut random = Random(64);
    let rigs = rigs(&mut random);
    let mut single: Vec<AxisDrive> = rigs.iter().map(|rig| rig.drive(0.2)).collect();
    let mut batch = DriveBatch::new(single.clone());
    assert_eq!(
        batch.together(),
        64,
        "tilting table, DSC, play, coarse encoder, other cycles, and the 65th of the others go alone"
    );
    let (mut flags, mut moved) = (0, 0);
    for k in 0..600_u32 {
        let inputs: Vec<DriveInput> = (0..rigs.len())
            .map(|n| {
                let (t_s, phase) = (f64::from(k) * 1e-3, n as f64);
                // Rest, a slow sine with reversals, a jump that saturates.
                let x = if k < 40 { 0.0 } else { 2.0 * (9.0 * t_s + phase).sin() - 2.0 * (0.36 + phase).sin() };
                let jump = if (300..420).contains(&k) { 3.0 } else { 0.0 };
                DriveInput { load_n_m: if k > 500 { 0.3 } else { 0.0 }, ..input(0.2 + x + jump) }
            })
            .collect();
        let mut together = vec![AxisSignals::default(); rigs.len()];
        batch.step(&inputs, |place, signals| together[place] = *signals);
        for (n, (drive, input)) in single.iter_mut().zip(&inputs).enumerate() {
            let alone = drive.step(*input);
            assert_eq!(together[n], alone, "drive {n}, cycle {k}");
            flags |= alone.flags;
            moved += u32::from(alone.motor_speed_rad_s != 0.0);
        }
    }
    assert_eq!(flags & 0b1110, 0b1110, "limits and rest must occur");
    assert!(moved > 30_000);
    for (a, b) in batch.into_drives().iter().zip(&single) {
        assert_eq!((a.state(), a.is_finite()), (b.state(), b.is_finite()));
    }
}

/// Fewer inputs than drives: those without one wait.
#[test]
fn drives_without_an_input_wait() {
    let drives: Vec<AxisDrive> = (0..10).map(|_| mvc_x().drive(0.0)).collect();
    let mut batch = DriveBatch::new(drives.clone());
    let mut shown = 0;
    batch.step(&[input(1.0); 5], |place, _| {
        assert!(place < 5);
        shown += 1;
    });
    assert_eq!(shown, 5);
    let mut alone = drives[0].clone();
    alone.step(input(1.0));
    assert_eq!(batch.drives()[4].state(), alone.state());
    assert_eq!(batch.drives()[5].state(), drives[5].state());
}
