//! Many drives in step are the same drives alone, to the last bit.

use crate::rig::{Random, Rig, input, mvc_x, mvc_y, ucp_a};
use sollwert::drive::{AxisDrive, AxisSignals, DriveBatch, DriveInput, Instructions};
use sollwert::machine::JerkFilterKind;

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

/// Rows that do not depend on who computes them: sines, rest, jumps and loads of their own for each drive.
fn inputs(rigs: &[Rig], k: u32) -> Vec<DriveInput> {
    (0..rigs.len())
        .map(|n| {
            let (t_s, phase) = (f64::from(k) * 1e-3, n as f64);
            let x = if k < 40 { 0.0 } else { 2.0 * (11.0 * t_s + phase).sin() - 2.0 * (0.44 + phase).sin() };
            let jump = if (200..260).contains(&k) { 3.0 } else { 0.0 };
            DriveInput {
                position_setpoint_lu: 0.2 + x + jump,
                load_n_m: if k > 300 { 0.3 } else { 0.0 },
                feedforward_active: k % 97 < 80,
            }
        })
        .collect()
}

/// What the processor can do must not be seen in a result: the instructions that every processor has give the same bits as AVX2 and as the widest ones of
/// the one that the test runs on, AVX-512 where there is that (a processor without them compares the former with itself; the single drive is compiled for
/// every processor, too). Blocks of every size take part: 16, 8 and 4 lanes, full and with lanes to spare.
#[test]
fn every_processor_gives_the_same_bits() {
    let mut random = Random(2);
    let rigs = rigs(&mut random);
    let single: Vec<AxisDrive> = rigs.iter().map(|rig| rig.drive(0.2)).collect();
    // How many of the 64 that go together are in each group of batches: 4 x 16; 16 + 16 + 16 and 13 with lanes to spare, 3; 8; 5; 4; 2.
    for sizes in [&[70][..], &[64, 6], &[16, 8, 20, 11, 5, 6, 4]] {
        let mut groups = Vec::new();
        let mut first = 0;
        for size in sizes {
            let drives = &single[first..first + size];
            let batches = [Instructions::Widest, Instructions::Avx2, Instructions::Any]
                .map(|only| DriveBatch::new(drives.to_vec()).only_with(only));
            groups.push((first, batches));
            first += size;
        }
        assert_eq!(first, rigs.len());
        let mut single = single.clone();
        for k in 0..110 {
            // Three times as fast, so that rest, reversals, jump and load are all in it.
            let inputs = inputs(&rigs, 3 * k);
            let bits = |signals: &AxisSignals| format!("{signals:?}");
            let alone: Vec<String> =
                single.iter_mut().zip(&inputs).map(|(drive, input)| bits(&drive.step(*input))).collect();
            for (first, batches) in &mut groups {
                for (which, batch) in batches.iter_mut().enumerate() {
                    batch.step(&inputs[*first..], |place, now| {
                        assert_eq!(bits(now), alone[*first + place], "drive {}, cycle {k}, {which}", *first + place);
                    });
                }
            }
        }
    }
}

/// The drives may be asked for at any time, and may then go alone: nothing of them is left in the batch, and nothing is lost on the way there and back.
#[test]
fn drives_come_and_go() {
    let mut random = Random(5);
    let mut rigs = rigs(&mut random);
    for (n, rig) in rigs.iter_mut().enumerate() {
        // Memories of many shapes in front of the position loop.
        rig.data.options.friction_pulse_lu_s = if n % 3 == 0 { 2.0 } else { 0.0 };
        rig.data.feedforward_delay_s = if n % 4 == 0 { 2.3e-3 } else { 0.0 };
        rig.data.encoder.position_resolution_lu = if n % 5 == 0 { 1e-4 } else { 0.0 };
        rig.data.options.backlash_compensation_lu = if n % 6 == 0 { 1e-3 } else { 0.0 };
        if n % 7 == 0 {
            let filter = &mut rig.data.options.jerk_filter;
            (filter.kind, filter.time_s) = (JerkFilterKind::MovingAverage, 5e-3);
        }
    }
    let mut single: Vec<AxisDrive> = rigs.iter().map(|rig| rig.drive(0.2)).collect();
    let mut batch = DriveBatch::new(single.clone());
    assert_eq!(batch.together(), 64, "none of these keeps an axis from going together");
    for k in 0..400_u32 {
        let inputs = inputs(&rigs, k);
        let mut together = vec![AxisSignals::default(); rigs.len()];
        match k % 10 {
            // One of them waits, so that its block goes one by one.
            3 => {
                let waits = k as usize % rigs.len();
                batch.step_some(|place| (place != waits).then(|| inputs[place]), |place, now| together[place] = *now);
                together[waits] = batch.drives_mut()[waits].step(inputs[waits]);
            }
            7 => {
                for (n, drive) in batch.drives_mut().iter_mut().enumerate() {
                    together[n] = drive.step(inputs[n]);
                }
            }
            8 => {
                batch = batch.clone();
                batch.step(&inputs, |place, now| together[place] = *now);
            }
            _ => batch.step(&inputs, |place, now| together[place] = *now),
        }
        for (n, drive) in single.iter_mut().enumerate() {
            assert_eq!(together[n], drive.step(inputs[n]), "drive {n}, cycle {k}");
        }
        if k == 250 {
            for drives in [&mut single[..], batch.drives_mut()] {
                drives[12].brake(30.0, 0.02);
                drives[13].brake(-30.0, 0.02);
            }
        }
    }
}

/// A drive that diverges is seen where it is, and only there.
#[test]
fn divergence_is_seen_in_a_batch() {
    let drives: Vec<AxisDrive> = (0..10).map(|_| mvc_x().drive(0.0)).collect();
    let mut batch = DriveBatch::new(drives);
    let mut inputs = vec![input(0.0); 10];
    batch.step(&inputs, |_, _| {});
    assert!((0..11).all(|place| batch.is_finite(place)));
    for bad in [f64::NAN, f64::INFINITY] {
        let mut batch = batch.clone();
        inputs[6] = input(bad);
        for _ in 0..3 {
            batch.step(&inputs, |_, _| {});
        }
        for place in 0..10 {
            assert_eq!(batch.is_finite(place), place != 6, "{bad}, place {place}");
        }
        let finite: Vec<bool> = batch.into_drives().iter().map(AxisDrive::is_finite).collect();
        assert_eq!(finite.iter().filter(|finite| !**finite).count(), 1);
        assert!(!finite[6]);
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
    assert_eq!(batch.drives_mut()[4].state(), alone.state());
    assert_eq!(batch.drives_mut()[5].state(), drives[5].state());
}
