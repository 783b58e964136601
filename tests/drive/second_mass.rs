//! The load behind a spring: natural frequencies, balances, rest, wind-up, and the rigid axis as its limit.

use crate::rig::{Random, Rig, input, machines, mvc_x, mvc_y};
use sollwert::drive::{TwoMass, TwoMassPiece, TwoMassState, flags};
use sollwert::machine::{DriveData, PositionSource};
use std::f64::consts::TAU;

/// Six tenths of the inertia behind a spring with a resonance of `resonance_hz` and a damping ratio of 0.02 of that mode.
fn split(data: &mut DriveData, resonance_hz: f64, damping_ratio: f64) {
    let mechanics = &mut data.mechanics;
    let (jl, jm) = (0.6 * mechanics.inertia_kg_m2, 0.4 * mechanics.inertia_kg_m2);
    let (reduced, w) = (jl * jm / (jl + jm), TAU * resonance_hz);
    mechanics.load_inertia_kg_m2 = jl;
    mechanics.coupling_stiffness_n_m_per_rad = reduced * w * w;
    mechanics.coupling_damping_n_m_s_per_rad = 2.0 * damping_ratio * reduced * w;
}

fn two_mass(rig: &Rig) -> TwoMass {
    TwoMass::new(&rig.data, rig.current_period_s()).expect("a second mass")
}

const AT_REST: TwoMassState =
    TwoMassState { current_a: 0.0, motor_speed_rad_s: 0.0, twist_rad: 0.0, load_speed_rad_s: 0.0, load_angle_rad: 0.3 };

/// Without current and friction the twist rings at the resonance, w² = c/Jm + c/Jl, damped by d (1/Jm + 1/Jl) / 2; behind a load that
/// sticks at w² = c/Jm, and the load keeps its bits.
#[test]
fn natural_frequencies() {
    for (resonance_hz, damping_ratio) in [(35.0, 0.0), (180.0, 0.03), (900.0, 0.01), (7000.0, 0.3)] {
        for stuck in [false, true] {
            let rig = mvc_x().friction(0.0, if stuck { 1e9 } else { 0.0 }).with(|data| {
                data.motor.back_emf_v_s_per_rad = 0.0;
                data.mechanics.viscous_friction_n_m_s_per_rad = 0.0;
                split(data, resonance_hz, damping_ratio);
            });
            let plant = two_mass(&rig);
            let mechanics = &rig.data.mechanics;
            let (jl, jm) = (mechanics.load_inertia_kg_m2, mechanics.inertia_kg_m2 - mechanics.load_inertia_kg_m2);
            let per_inertia = if stuck { 1.0 / jm } else { 1.0 / jm + 1.0 / jl };
            let w2 = mechanics.coupling_stiffness_n_m_per_rad * per_inertia;
            let decay = 0.5 * mechanics.coupling_damping_n_m_s_per_rad * per_inertia;
            let w = (w2 - decay * decay).sqrt();
            let mut state = TwoMassState { twist_rad: 1e-3, ..AT_REST };
            for k in 1..=400 {
                state = plant.step(state, 0.0, 0.0);
                let t_s = f64::from(k) * rig.current_period_s();
                let expected_rad = 1e-3 * (-decay * t_s).exp() * ((w * t_s).cos() + decay / w * (w * t_s).sin());
                // Rounding of 400 ticks of up to 30 stretches, each 1e-16 of 1e-3.
                assert!(
                    (state.twist_rad - expected_rad).abs() < 1e-14,
                    "{resonance_hz} Hz, stuck {stuck}, tick {k}: {} for {expected_rad}",
                    state.twist_rad
                );
                let momentum = jm * state.motor_speed_rad_s + jl * state.load_speed_rad_s;
                assert!(stuck || momentum.abs() < 1e-14, "no torque from outside: {momentum:e}");
                assert!(!stuck || state.load_angle_rad.to_bits() == 0.3_f64.to_bits(), "a stuck load keeps its bits");
            }
        }
    }
}

/// Five-point Gauss-Legendre on [0, 1].
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668_0, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_5, 0.239_314_335_249_683_2),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// Sums and absolute sums of momentum, electrical energy and mechanical energy.
#[derive(Default)]
struct Balances {
    sums: [f64; 3],
    sizes: [f64; 3],
    stuck_pieces: usize,
    pieces: usize,
}

impl Balances {
    fn add(&mut self, data: &DriveData, smooth: &TwoMass, stuck: &TwoMass, piece: &TwoMassPiece, u: f64, tg: f64) {
        let (motor, mechanics) = (&data.motor, &data.mechanics);
        let (kt, ke, r) = (motor.torque_constant_n_m_per_a, motor.back_emf_v_s_per_rad, motor.resistance_ohm);
        self.pieces += 1;
        self.stuck_pieces += usize::from(piece.dry_friction_n_m.is_none());
        for (place, weight) in GAUSS {
            let (time_s, share) = (place * piece.duration_s, weight * piece.duration_s);
            // Within a piece one linear law holds: that of an axis without dry friction, or that of a load that never leaves.
            let (s, friction) = match piece.dry_friction_n_m {
                Some(friction_n_m) => {
                    let s = smooth.pieces(piece.start, u, tg + friction_n_m, time_s, |_| {});
                    (s, friction_n_m + mechanics.viscous_friction_n_m_s_per_rad * s.load_speed_rad_s)
                }
                None => {
                    let s = stuck.pieces(piece.start, u, tg, time_s, |_| {});
                    // The friction that was applied: what holds the load.
                    (s, smooth.spring_n_m(&s) - tg)
                }
            };
            let slip = s.motor_speed_rad_s - s.load_speed_rad_s;
            let terms: [&[f64]; 3] = [
                &[kt * s.current_a, -friction, -tg],
                &[u * s.current_a, -r * s.current_a * s.current_a, -ke * s.motor_speed_rad_s * s.current_a],
                &[
                    kt * s.current_a * s.motor_speed_rad_s,
                    -friction * s.load_speed_rad_s,
                    -tg * s.load_speed_rad_s,
                    -mechanics.coupling_damping_n_m_s_per_rad * slip * slip,
                ],
            ];
            for (n, terms) in terms.into_iter().enumerate() {
                for term in terms {
                    self.sums[n] += share * term;
                    self.sizes[n] += share * term.abs();
                }
            }
        }
    }
}

/// 7.7 for two masses: what is not lost in R, d and friction is in L, spring and masses, to the rounding of the summed terms, over a
/// run with stops, breakaways and reversals; the friction is the one applied, also in a tick that stops.
#[test]
fn momentum_and_energy_balances() {
    for (name, rig) in machines() {
        let rig = rig.friction(0.8, 1.1).with(|data| split(data, 130.0, 0.02));
        let (data, h) = (&rig.data, rig.current_period_s());
        let plant = two_mass(&rig);
        let smooth = two_mass(&rig.clone().friction(0.0, 0.0));
        let stuck = two_mass(&rig.clone().friction(0.0, 1e9));
        let (start, mut balances) = (TwoMassState { current_a: 0.4, ..AT_REST }, Balances::default());
        let mut state = start;
        let mut stops = 0;
        for tick in 0..6000 {
            let t_s = f64::from(tick) * h;
            let amplitude_v = 2.0 * data.motor.resistance_ohm / data.motor.torque_constant_n_m_per_a;
            let u = amplitude_v * (TAU * 14.0 * t_s).sin() + if tick % 1000 > 900 { amplitude_v } else { 0.0 };
            let before = state;
            let mut in_tick = 0;
            let end = plant.pieces(state, u, 0.2, h, |piece| {
                in_tick += 1;
                balances.add(data, &smooth, &stuck, &piece, u, 0.2);
            });
            state = plant.step(state, u, 0.2);
            let apart = (state.load_speed_rad_s - end.load_speed_rad_s).abs();
            assert!(apart < 1e-10, "{name}, tick {tick}: step and pieces differ by {apart:e}, {before:?}");
            stops += usize::from(in_tick > 1 && end.load_speed_rad_s == 0.0);
        }
        let mechanics = &data.mechanics;
        let (jl, jm) = (mechanics.load_inertia_kg_m2, mechanics.inertia_kg_m2 - mechanics.load_inertia_kg_m2);
        let stored = |s: &TwoMassState| {
            let half_c = 0.5 * mechanics.coupling_stiffness_n_m_per_rad;
            [
                jm * s.motor_speed_rad_s + jl * s.load_speed_rad_s,
                0.5 * data.motor.inductance_h * s.current_a * s.current_a,
                0.5 * jm * s.motor_speed_rad_s * s.motor_speed_rad_s
                    + 0.5 * jl * s.load_speed_rad_s * s.load_speed_rad_s
                    + half_c * s.twist_rad * s.twist_rad,
            ]
        };
        let (first, last) = (stored(&start), stored(&state));
        for n in 0..3 {
            let (error, size) = ((balances.sums[n] - (last[n] - first[n])).abs(), balances.sizes[n]);
            assert!(error < 1e-12 * size, "{name}: balance {n} is off by {error:e} of {size:e}");
        }
        assert!(balances.stuck_pieces > 200 && stops > 2, "{name}: {} at rest, {stops} stops", balances.stuck_pieces);
    }
}

/// A tick in one go or cut anywhere is the same motion.
#[test]
fn a_tick_may_be_cut_anywhere() {
    let mut random = Random(23);
    let mut with_events = 0;
    for round in 0..4000 {
        let rig = if round % 2 == 0 { mvc_x().friction(0.6, 0.9) } else { mvc_y() };
        let rig = rig.with(|data| split(data, if round % 3 == 0 { 90.0 } else { 1500.0 }, 0.05));
        let (plant, h) = (two_mass(&rig), rig.current_period_s());
        let mechanics = &rig.data.mechanics;
        let breakaway_rad = mechanics.breakaway_friction_n_m / mechanics.coupling_stiffness_n_m_per_rad;
        let state = TwoMassState {
            current_a: 2.0 * random.signed(),
            motor_speed_rad_s: 0.5 * random.signed(),
            twist_rad: breakaway_rad * (random.signed().signum() + 0.02 * random.signed()),
            load_speed_rad_s: if round % 5 == 0 { 0.0 } else { 3e-4 * random.signed() },
            load_angle_rad: random.signed(),
        };
        let (u, tg) = (20.0 * random.signed(), 0.02 * random.signed());
        let mut laws = Vec::new();
        let whole = plant.pieces(state, u, tg, h, |piece| laws.push(piece.dry_friction_n_m));
        laws.dedup();
        with_events += usize::from(laws.len() > 1);
        let cut_s = h * (0.5 + 0.5 * random.signed());
        let parts = plant.pieces(plant.pieces(state, u, tg, cut_s, |_| {}), u, tg, h - cut_s, |_| {});
        for (what, a, b, tolerance) in [
            ("i", whole.current_a, parts.current_a, 1e-12),
            ("wm", whole.motor_speed_rad_s, parts.motor_speed_rad_s, 1e-11),
            ("phi", whole.twist_rad, parts.twist_rad, 1e-14),
            // At a tangent zero rounding decides whether it stops: sqrt(1e-16) of what a tick adds.
            ("wl", whole.load_speed_rad_s, parts.load_speed_rad_s, 1e-10),
            ("thl", whole.load_angle_rad, parts.load_angle_rad, 1e-14),
        ] {
            assert!((a - b).abs() < tolerance, "seed 23, round {round}: {what} {a} {b}");
        }
    }
    assert!(with_events > 300, "only {with_events} ticks with an event");
}

/// Steady wind-up: measured at the motor, the load is (Tc sgn w + B w + Tg) r / c behind; measured at the load it is not.
#[test]
fn wind_up_of_the_spring() {
    for source in [PositionSource::Motor, PositionSource::Load] {
        for side in [1.0, -1.0] {
            let rig = mvc_x().friction(0.6, 0.6).with(|data| {
                split(data, 200.0, 0.05);
                data.encoder.position_source = source;
                data.velocity_feedforward_ratio = 1.0;
                data.mechanics.gravity_n_m = 0.3;
            });
            let v = side * 50.0;
            let last = rig.follow(1.5, |t_s| v * t_s).pop().expect("signals");
            let mechanics = &rig.data.mechanics;
            let w = v / mechanics.transmission_lu_per_rad;
            let friction_n_m = 0.6 * side + mechanics.viscous_friction_n_m_s_per_rad * w;
            assert!((last.friction_torque_n_m - friction_n_m).abs() < 1e-9, "{}", last.friction_torque_n_m);
            let wound_lu =
                (friction_n_m + 0.3) / mechanics.coupling_stiffness_n_m_per_rad * mechanics.transmission_lu_per_rad;
            let expected_lu = if source == PositionSource::Motor { wound_lu } else { 0.0 };
            assert!((last.position_reference_lu - last.position_actual_lu - expected_lu).abs() < 1e-9, "{source:?}");
            assert!((last.current_a * 1.3 - friction_n_m - 0.3).abs() < 1e-8, "all friction is carried by the motor");
        }
    }
}

/// As the spring stiffens the axis becomes the rigid one: what is between them is the wind-up, so that it falls as 1/c.
#[test]
fn the_rigid_axis_is_the_limit() {
    for friction_n_m in [0.0, 0.6] {
        let rig = mvc_x().friction(friction_n_m, friction_n_m);
        let motion = |t_s: f64| 3.0 * (1.0 - (TAU * 2.0 * t_s).cos());
        let rigid = rig.follow(0.6, motion);
        let apart = |resonance_hz: f64| {
            let split = rig.clone().with(|data| split(data, resonance_hz, 0.4)).follow(0.6, motion);
            split
                .iter()
                .zip(&rigid)
                .map(|(a, b)| (a.position_actual_lu - b.position_actual_lu).abs())
                .fold(0.0, f64::max)
        };
        let (soft_lu, stiff_lu) = (apart(800.0), apart(8000.0));
        assert!(stiff_lu < 2e-2 * soft_lu && soft_lu < 0.05, "{friction_n_m}: {soft_lu:e} to {stiff_lu:e}");
    }
}

/// Springs that no loop sees: damped or not, the axis is the rigid one but for a wind-up of nanometres, and a tick costs what it costs elsewhere
/// (with a search in every stretch these 160,000 ticks would take minutes).
#[test]
fn a_spring_that_is_as_good_as_rigid() {
    let rig = mvc_x();
    let motion = |t_s: f64| 3.0 * (1.0 - (TAU * 2.0 * t_s).cos());
    let rigid = rig.follow(1.0, motion);
    for resonance_hz in [1e5, 1e6, 1e8] {
        for damping_ratio in [0.0, 0.1, 3.0] {
            let stiff = rig.clone().with(|data| split(data, resonance_hz, damping_ratio)).follow(1.0, motion);
            for (k, (a, b)) in stiff.iter().zip(&rigid).enumerate() {
                // At a reversal a stop may be found a fraction of a tick late: some tens of nanometres.
                let apart_lu = (a.position_actual_lu - b.position_actual_lu).abs();
                assert!(apart_lu < 1e-4, "{resonance_hz} Hz, {damping_ratio}, {k}: {apart_lu:e}");
            }
        }
    }
}

/// Held under gravity it stays still with load and motor; hunting with Ts > Tc rests without chatter.
#[test]
fn rest_without_chatter() {
    for source in [PositionSource::Motor, PositionSource::Load] {
        let held = mvc_x().friction(0.6, 0.9).with(|data| {
            split(data, 120.0, 0.02);
            data.mechanics.gravity_n_m = 2.0;
            data.encoder.position_source = source;
        });
        for s in held.run_each((0..300).map(|_| input(0.3))) {
            assert_eq!(s.flags, flags::STUCK);
            let off_lu = if source == PositionSource::Motor {
                2.0 / held.data.mechanics.coupling_stiffness_n_m_per_rad * held.data.mechanics.transmission_lu_per_rad
            } else {
                0.0
            };
            assert!((s.position_actual_lu - 0.3 + off_lu).abs() < 1e-14, "{}", s.position_actual_lu);
        }
    }
    let rig = mvc_y().friction(1.2, 2.4).with(|data| split(data, 150.0, 0.03));
    let signals = rig.run_each((0..2000).map(|k| input(if k == 0 { 0.0 } else { 0.01 })));
    let breakaways = signals.windows(2).filter(|two| two[0].flags & flags::STUCK > two[1].flags & flags::STUCK).count();
    let changes =
        signals.windows(2).filter(|two| two[0].velocity_actual_lu_s * two[1].velocity_actual_lu_s < 0.0).count();
    assert!((3..200).contains(&breakaways), "{breakaways} breakaways in 32,000 ticks");
    // The load may ring across zero while it slips, a few times a slip: not a tick.
    assert!(changes <= 4 * breakaways, "{changes} changes of sign in {breakaways} slips");
    for two in signals.windows(2).filter(|two| two[0].flags & two[1].flags & flags::STUCK != 0) {
        assert!(two[1].velocity_actual_lu_s == 0.0 && two[0].position_actual_lu == two[1].position_actual_lu);
    }
}
