//! The plant: balances of models/drive.md section 7 number 7, split ticks, odd parameters.

use crate::rig::{Random, Rig, input, machines, mvc_x, mvc_y};
use nalgebra::Matrix5;
use sollwert::drive::{AxisSignals, Piece, Plant, PlantState, flags};
use sollwert::machine::DriveData;
use std::f64::consts::TAU;

/// A name and a change of the drive data.
type Case = (&'static str, fn(&mut DriveData));

/// The plant of a rig, and the same without dry friction: within a piece that is the whole law.
fn plants(rig: &Rig) -> (Plant, Plant) {
    let smooth = rig.clone().friction(0.0, 0.0);
    (Plant::new(&rig.data, rig.current_period_s()), Plant::new(&smooth.data, rig.current_period_s()))
}

/// State inside a piece.
fn inside(
    data: &DriveData,
    smooth: &Plant,
    piece: &Piece,
    voltage_v: f64,
    gravity_n_m: f64,
    time_s: f64,
) -> PlantState {
    match piece.dry_friction_n_m {
        Some(friction_n_m) => smooth.pieces(piece.start, voltage_v, gravity_n_m + friction_n_m, time_s, |_| {}),
        None => {
            let final_a = voltage_v / data.motor.resistance_ohm;
            let decay = (-time_s * data.motor.resistance_ohm / data.motor.inductance_h).exp();
            PlantState { current_a: final_a + (piece.start.current_a - final_a) * decay, ..piece.start }
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

/// Integrals over a run of the terms of the three balances of 7.7, signed and absolute, and what the run held.
#[derive(Default)]
struct Balances {
    sums: [f64; 3],
    sizes: [f64; 3],
    pieces: usize,
    stuck_pieces: usize,
}

impl Balances {
    /// Adds one tick: its pieces again from state, voltage and gravity, each integrated by Gauss points.
    fn add(&mut self, rig: &Rig, (plant, smooth): &(Plant, Plant), tick: &AxisSignals) {
        let (motor, mechanics) = (&rig.data.motor, &rig.data.mechanics);
        let (kt, ke, r) = (motor.torque_constant_n_m_per_a, motor.back_emf_v_s_per_rad, motor.resistance_ohm);
        let (u, tg) = (tick.voltage_v, tick.gravity_torque_n_m);
        let mut pieces = Vec::new();
        plant.pieces(state_of(tick), u, tg, rig.current_period_s(), |piece| pieces.push(piece));
        self.pieces += pieces.len();
        for piece in &pieces {
            self.stuck_pieces += usize::from(piece.dry_friction_n_m.is_none());
            for (place, weight) in GAUSS {
                let PlantState { current_a: i, speed_rad_s: w, .. } =
                    inside(&rig.data, smooth, piece, u, tg, place * piece.duration_s);
                let viscous = mechanics.viscous_friction_n_m_s_per_rad * w;
                let friction = piece.dry_friction_n_m.map_or(kt * i - tg, |dry| dry + viscous);
                let terms =
                    [[kt * i, -friction, -tg], [u * i, -r * i * i, -ke * w * i], [kt * i * w, -friction * w, -tg * w]];
                for (n, balance) in terms.iter().enumerate() {
                    self.sums[n] += weight * piece.duration_s * balance.iter().sum::<f64>();
                    self.sizes[n] += weight * piece.duration_s * balance.iter().map(|term| term.abs()).sum::<f64>();
                }
            }
        }
    }
}

/// State at a tick; the angle plays no part where gravity is given.
fn state_of(tick: &AxisSignals) -> PlantState {
    PlantState { current_a: tick.current_a, speed_rad_s: tick.motor_speed_rad_s, angle_rad: 0.0 }
}

/// 7.7: momentum and both energy balances over a run with stick-slip, reversals and saturation. The integrals run over the pieces
/// of every tick, by Gauss points of order 10: with rate times duration below 0.03 their error is far below rounding. So the
/// balances must hold to the rounding of some 50,000 summed terms: 1e-12 of the sum of absolute values.
#[test]
fn form_7_balances() {
    for (name, rig) in machines() {
        let rig = rig.clone().friction(0.8, 2.0).with(|data| data.voltage_max_v = 30.0);
        let data = &rig.data;
        let amplitude_lu = 0.02 * data.speed_setpoint_max_lu_s.min(100.0);
        let signals = rig.run_each((0..1000).map(|k| {
            let t_s = f64::from(k) * rig.position_period_s();
            // Two sines with a hold, and a jump that saturates.
            let jump_lu = if k > 800 { 2.0 * amplitude_lu } else { 0.0 };
            input(amplitude_lu * (TAU * 1.3 * t_s).sin() * (TAU * 0.3 * t_s).sin().max(0.0) + jump_lu)
        }));
        let plants = plants(&rig);
        let mut balances = Balances::default();
        for tick in &signals {
            balances.add(&rig, &plants, tick);
        }
        // The end state is one plant step behind the last signals.
        let last = signals.last().expect("signals");
        let end = plants.0.step(state_of(last), last.voltage_v, last.gravity_torque_n_m);
        let (l, j, i0) = (data.motor.inductance_h, data.mechanics.inertia_kg_m2, signals[0].current_a);
        let stored = [
            j * end.speed_rad_s,
            0.5 * l * (end.current_a * end.current_a - i0 * i0),
            0.5 * j * end.speed_rad_s * end.speed_rad_s,
        ];
        for (n, stored) in stored.into_iter().enumerate() {
            let (error, size) = ((balances.sums[n] - stored).abs(), balances.sizes[n]);
            assert!(error < 1e-12 * size, "{name}: balance {n} is off by {error:e} of {size:e}");
        }
        assert!(balances.stuck_pieces > 100, "{name}: the run must hold rest");
        assert!(balances.pieces > signals.len() + 5, "{name}: the run must hold split ticks");
        assert!(signals.iter().any(|s| s.flags & flags::VOLTAGE_LIMIT != 0), "{name}: the run must saturate");
    }
}

/// A tick in one go, or cut at any instant, is the same motion: true only if stops and breakaways are found where they are.
#[test]
fn a_tick_may_be_cut_anywhere() {
    let mut random = Random(11);
    let mut with_events = 0;
    let rigs = [mvc_x().friction(0.6, 0.9), mvc_y()].map(|rig| (plants(&rig).0, rig));
    for round in 0..20_000 {
        let (plant, rig) = &rigs[round % 2];
        let h = rig.current_period_s();
        // Near rest and near the breakaway torque, where the events are.
        let breakaway_a = rig.data.mechanics.breakaway_friction_n_m / rig.data.motor.torque_constant_n_m_per_a;
        let state = PlantState {
            current_a: breakaway_a * (random.signed().signum() + 0.3 * random.signed()),
            speed_rad_s: if round % 5 == 0 { 0.0 } else { 0.01 * random.signed() },
            angle_rad: random.signed(),
        };
        let (u, tg) = (60.0 * random.signed(), 0.2 * random.signed());
        let mut pieces = 0;
        let whole = plant.pieces(state, u, tg, h, |_| pieces += 1);
        with_events += usize::from(pieces > 1);
        let cut_s = h * (0.5 + 0.5 * random.signed());
        let half = plant.pieces(state, u, tg, cut_s, |_| {});
        let parts = plant.pieces(half, u, tg, h - cut_s, |_| {});
        assert!((whole.current_a - parts.current_a).abs() < 1e-13, "seed 11, round {round}: {whole:?} {parts:?}");
        // At a tangent zero the speed decides by rounding whether it stops: sqrt(1e-16) of what the tick adds.
        assert!((whole.speed_rad_s - parts.speed_rad_s).abs() < 1e-12, "seed 11, round {round}: {whole:?} {parts:?}");
        assert!((whole.angle_rad - parts.angle_rad).abs() < 1e-15, "seed 11, round {round}: {whole:?} {parts:?}");
        let step = plant.step(state, u, tg);
        assert!(
            (whole.speed_rad_s - step.speed_rad_s).abs() < 1e-14 && (whole.current_a - step.current_a).abs() < 1e-13
        );
    }
    assert!(with_events > 2000, "only {with_events} ticks with an event");
}

/// The map against nalgebra's exponential of the 5×5 matrix, also where A is singular (Ke = 0, B = 0) and where a tick is long
/// against the electrical time constant.
#[test]
fn the_map_is_the_matrix_exponential() {
    let base = mvc_x().friction(0.0, 0.0);
    let changes: [Case; 6] = [
        ("as it is", |_| {}),
        ("Ke = 0", |data| data.motor.back_emf_v_s_per_rad = 0.0),
        ("B = 0", |data| data.mechanics.viscous_friction_n_m_s_per_rad = 0.0),
        ("Ke = B = 0", |data| {
            data.motor.back_emf_v_s_per_rad = 0.0;
            data.mechanics.viscous_friction_n_m_s_per_rad = 0.0;
        }),
        ("L / R = 2 µs", |data| data.motor.inductance_h = 1.5e-6),
        ("little inertia", |data| data.mechanics.inertia_kg_m2 = 1e-6),
    ];
    for (name, change) in changes {
        let rig = base.clone().with(change);
        let (motor, mechanics) = (rig.data.motor, rig.data.mechanics);
        let h = rig.current_period_s();
        let mut a = Matrix5::zeros();
        let (l, j) = (motor.inductance_h, mechanics.inertia_kg_m2);
        (a[(0, 0)], a[(0, 1)], a[(0, 3)]) = (-motor.resistance_ohm / l, -motor.back_emf_v_s_per_rad / l, 1.0 / l);
        (a[(1, 0)], a[(1, 1)]) = (motor.torque_constant_n_m_per_a / j, -mechanics.viscous_friction_n_m_s_per_rad / j);
        (a[(1, 4)], a[(2, 1)]) = (1.0 / j, 1.0);
        let map = (a * h).exp();
        let (plant, _) = plants(&rig);
        let mut random = Random(3);
        for _ in 0..100 {
            let (i, w, u, c) =
                (20.0 * random.signed(), 50.0 * random.signed(), 200.0 * random.signed(), 5.0 * random.signed());
            let got = plant.step(PlantState { current_a: i, speed_rad_s: w, angle_rad: 0.0 }, u, -c);
            for (row, got) in [got.current_a, got.speed_rad_s, got.angle_rad].into_iter().enumerate() {
                let terms = [map[(row, 0)] * i, map[(row, 1)] * w, map[(row, 3)] * u, map[(row, 4)] * c];
                let expected: f64 = terms.iter().sum();
                // nalgebra rounds to 1e-16 of the largest entry of its argument, which the scaling steps double.
                let size = (a * h).norm().max(1.0) * (i.abs() + w.abs() + u.abs() + c.abs());
                assert!((got - expected).abs() < 1e-14 * size, "{name}, row {row}: {got} for {expected}");
            }
        }
    }
}

/// Against Runge-Kutta steps of 20 ns with the friction law applied at each: slow, plain, and knows nothing of events.
#[test]
fn stops_and_reversals_against_tiny_steps() {
    for (name, breakaway_n_m) in [("Ts = Tc", 0.6), ("Ts > Tc", 0.8)] {
        let rig = mvc_x().friction(0.6, breakaway_n_m);
        let (plant, _) = plants(&rig);
        let (motor, mechanics) = (rig.data.motor, rig.data.mechanics);
        let mut state = PlantState { current_a: 1.5, speed_rad_s: 0.4, angle_rad: 0.0 };
        let (mut i, mut w, mut th) = (state.current_a, state.speed_rad_s, state.angle_rad);
        let mut rested = 0;
        for tick in 0..800 {
            let (u, tg) = (1.35 * (f64::from(tick) * 0.0157).cos(), 0.1);
            state = plant.step(state, u, tg);
            rested += u32::from(state.speed_rad_s == 0.0);
            let steps = 3125;
            let h = rig.current_period_s() / f64::from(steps);
            for _ in 0..steps {
                // Exponential decay of the current within 20 ns is linear to 1e-12; the midpoint rule takes care of the rest.
                let current_slope = |i: f64, w: f64| {
                    (u - motor.resistance_ohm * i - motor.back_emf_v_s_per_rad * w) / motor.inductance_h
                };
                let drive = motor.torque_constant_n_m_per_a * i - tg;
                if w == 0.0 && drive.abs() <= breakaway_n_m {
                    i += h * current_slope(i + 0.5 * h * current_slope(i, 0.0), 0.0);
                    continue;
                }
                let side = if w == 0.0 { drive } else { w };
                let friction = 0.6_f64.copysign(side);
                let speed_slope = |i: f64, w: f64| {
                    (motor.torque_constant_n_m_per_a * i - mechanics.viscous_friction_n_m_s_per_rad * w - friction - tg)
                        / mechanics.inertia_kg_m2
                };
                let (im, wm) = (i + 0.5 * h * current_slope(i, w), w + 0.5 * h * speed_slope(i, w));
                let w_next = w + h * speed_slope(im, wm);
                i += h * current_slope(im, wm);
                th += h * wm;
                w = if w_next * side <= 0.0 { 0.0 } else { w_next };
            }
        }
        // The plain method errs by one 20 ns step at an event: w' dt = 150 rad/s² * 20 ns = 3e-6 rad/s, and that times the run.
        assert!((10..700).contains(&rested), "{name}: the run must rest and move, not rest in {rested} ticks");
        assert!((state.angle_rad - th).abs() < 3e-7, "{name}: {} for {th}", state.angle_rad);
        assert!((state.speed_rad_s - w).abs() < 3e-5, "{name}: {} for {w}", state.speed_rad_s);
    }
}

/// Infinite or missing parts and odd signs: the axis still arrives, whatever the gains leave in.
#[test]
fn odd_parameters_still_arrive() {
    let cases: [Case; 9] = [
        ("B = 0", |data| data.mechanics.viscous_friction_n_m_s_per_rad = 0.0),
        ("Ke = 0", |data| data.motor.back_emf_v_s_per_rad = 0.0),
        ("no friction", |data| {
            data.mechanics.coulomb_friction_n_m = 0.0;
            data.mechanics.breakaway_friction_n_m = 0.0;
        }),
        ("Tc = 0, Ts > 0", |data| data.mechanics.coulomb_friction_n_m = 0.0),
        ("r < 0", |data| data.mechanics.transmission_lu_per_rad *= -1.0),
        ("no limits", |data| {
            data.speed_setpoint_max_lu_s = f64::INFINITY;
            data.current_max_a = f64::INFINITY;
            data.voltage_max_v = f64::INFINITY;
        }),
        ("Tni = infinity", |data| data.current_reset_time_s = f64::INFINITY),
        ("gravity with the angle", |data| data.mechanics.gravity_sin_n_m = 1.0),
        ("coarse encoders", |data| {
            data.encoder.position_resolution_lu = 1e-3;
            data.encoder.motor_resolution_rad = 1e-4;
        }),
    ];
    for (name, change) in cases {
        let rig = mvc_x().with(change);
        let signals = rig.follow(2.0, |t_s| 10.0 * t_s.min(1.0));
        let last = signals.last().expect("signals");
        assert!(last.following_error_lu.abs() < 2e-3, "{name}: {} mm left", last.following_error_lu);
    }
}
