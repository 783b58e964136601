//! models/drive.md section 7, number 5: without friction the drive is an exact linear discrete system, with its poles inside the
//! unit circle; as all periods go to 0 it becomes the continuous cascade. The discrete system is built here on its own, from
//! nalgebra's matrix exponential.

use crate::rig::{Random, Rig, input, machines, mvc_x};
use nalgebra::{Matrix5, SMatrix};

/// i, w, th, Iv, Ii, then the held wires w_ref, i_ref, and the input x_ref.
type Lifted = SMatrix<f64, 8, 8>;
const I: usize = 0;
const W: usize = 1;
const TH: usize = 2;
const IV: usize = 3;
const II: usize = 4;
const W_REF: usize = 5;
const I_REF: usize = 6;
const X_REF: usize = 7;

/// One position cycle as one matrix.
fn lifted(rig: &Rig) -> Lifted {
    let data = &rig.data;
    let (motor, mechanics) = (&data.motor, &data.mechanics);
    let (r, l, ke, kt) =
        (motor.resistance_ohm, motor.inductance_h, motor.back_emf_v_s_per_rad, motor.torque_constant_n_m_per_a);
    let (j, b) = (mechanics.inertia_kg_m2, mechanics.viscous_friction_n_m_s_per_rad);

    let mut position = Lifted::identity();
    let per_motor = data.position_gain_per_s / mechanics.transmission_lu_per_rad;
    position[(W_REF, W_REF)] = 0.0;
    position[(W_REF, X_REF)] = per_motor;
    position[(W_REF, TH)] = -per_motor * mechanics.transmission_lu_per_rad;

    let kp = data.speed_gain_n_m_s_per_rad;
    let integral = kp * rig.speed_period_s() / data.speed_reset_time_s;
    let mut speed = Lifted::identity();
    for (column, sign) in [(W_REF, 1.0), (W, -1.0)] {
        speed[(IV, column)] = sign * integral;
        speed[(I_REF, column)] = sign * (kp + integral) / kt;
    }
    speed[(I_REF, IV)] = 1.0 / kt;
    speed[(I_REF, I_REF)] = 0.0;

    // [[A, Bu, Bc], [0]] for (i, w, th, u, c).
    let mut a = Matrix5::zeros();
    (a[(0, 0)], a[(0, 1)], a[(0, 3)]) = (-r / l, -ke / l, 1.0 / l);
    (a[(1, 0)], a[(1, 1)], a[(1, 4)]) = (kt / j, -b / j, 1.0 / j);
    a[(2, 1)] = 1.0;
    let hold = (a * rig.current_period_s()).exp();
    let kpi = data.current_gain_v_per_a;
    let integral = kpi * rig.current_period_s() / data.current_reset_time_s;
    let mut tick = Lifted::identity();
    for (column, sign) in [(I_REF, 1.0), (I, -1.0)] {
        tick[(II, column)] = sign * integral;
    }
    for row in [I, W, TH] {
        for column in [I, W, TH] {
            tick[(row, column)] = hold[(row, column)];
        }
        tick[(row, I)] -= hold[(row, 3)] * (kpi + integral);
        tick[(row, I_REF)] = hold[(row, 3)] * (kpi + integral);
        tick[(row, II)] = hold[(row, 3)];
    }

    let current_ticks = (data.speed_cycle_ticks / data.current_cycle_ticks) as u32;
    let speed_ticks = (data.position_cycle_ticks / data.speed_cycle_ticks) as u32;
    let one_speed = power(tick, current_ticks) * speed;
    power(one_speed, speed_ticks) * position
}

fn power(matrix: Lifted, exponent: u32) -> Lifted {
    (0..exponent).fold(Lifted::identity(), |product, _| matrix * product)
}

fn frictionless(rig: Rig) -> Rig {
    rig.friction(0.0, 0.0).with(|data| {
        (data.mechanics.gravity_n_m, data.mechanics.gravity_sin_n_m, data.mechanics.gravity_cos_n_m) = (0.0, 0.0, 0.0);
        data.current_max_a = f64::INFINITY;
        data.voltage_max_v = f64::INFINITY;
        data.speed_setpoint_max_lu_s = f64::INFINITY;
    })
}

#[test]
fn form_5_lifted_system() {
    for (name, rig) in machines() {
        let rig = frictionless(rig);
        let matrix = lifted(&rig);
        let poles = matrix.fixed_view::<5, 5>(0, 0).into_owned().complex_eigenvalues();
        assert!(poles.iter().all(|pole| pole.norm() < 1.0), "{name}: poles {poles}");

        let mut random = Random(5);
        let mut state = SMatrix::<f64, 8, 1>::zeros();
        let mut drive = rig.drive(0.0);
        let scale_lu = rig.data.mechanics.transmission_lu_per_rad;
        let mut setpoint_lu = 0.0;
        for k in 0..2000 {
            // A random walk with jumps: all modes are excited all the time.
            setpoint_lu += 0.1 * scale_lu * random.signed();
            let signals = drive.step(input(setpoint_lu));
            for (what, got, expected) in [
                ("x", signals.position_actual_lu / scale_lu, state[TH]),
                ("w", signals.motor_speed_rad_s, state[W]),
                ("i", signals.current_a, state[I]),
            ] {
                // Two routes through 16 ticks of some 20 roundings each, forgotten within 100 cycles.
                assert!((got - expected).abs() < 1e-10, "{name}, k {k}: {what} {got} for {expected}");
            }
            state[X_REF] = setpoint_lu;
            state = matrix * state;
        }
    }
}

/// The continuous cascade by Runge-Kutta steps of 1 µs: x(t) after a smooth motion.
fn continuous_lu(rig: &Rig, duration_s: f64, setpoint_lu: impl Fn(f64) -> f64) -> f64 {
    let data = &rig.data;
    let (motor, mechanics) = (&data.motor, &data.mechanics);
    let slope = |t_s: f64, y: [f64; 5]| -> [f64; 5] {
        let [i, w, th, iv, ii] = y;
        let r = mechanics.transmission_lu_per_rad;
        let w_error = data.position_gain_per_s * (setpoint_lu(t_s) - r * th) / r - w;
        let i_error = (data.speed_gain_n_m_s_per_rad * w_error + iv) / motor.torque_constant_n_m_per_a - i;
        let u = data.current_gain_v_per_a * i_error + ii;
        [
            (u - motor.resistance_ohm * i - motor.back_emf_v_s_per_rad * w) / motor.inductance_h,
            (motor.torque_constant_n_m_per_a * i - mechanics.viscous_friction_n_m_s_per_rad * w)
                / mechanics.inertia_kg_m2,
            w,
            data.speed_gain_n_m_s_per_rad / data.speed_reset_time_s * w_error,
            data.current_gain_v_per_a / data.current_reset_time_s * i_error,
        ]
    };
    let h = 1e-6;
    let add = |y: [f64; 5], k: [f64; 5], h: f64| std::array::from_fn(|n| y[n] + h * k[n]);
    let mut y = [0.0; 5];
    for n in 0..(duration_s / h).round() as u32 {
        let t_s = f64::from(n) * h;
        let k1 = slope(t_s, y);
        let k2 = slope(t_s + h / 2.0, add(y, k1, h / 2.0));
        let k3 = slope(t_s + h / 2.0, add(y, k2, h / 2.0));
        let k4 = slope(t_s + h, add(y, k3, h));
        y = std::array::from_fn(|n| y[n] + h / 6.0 * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n]));
    }
    y[2] * mechanics.transmission_lu_per_rad
}

#[test]
fn form_5_continuous_limit() {
    let motion = |t_s: f64| 200.0 * t_s * t_s;
    let duration_s = 0.05;
    let rig = frictionless(mvc_x());
    let exact_lu = continuous_lu(&rig, duration_s, motion);
    // T_p = T_v = T_i = 125, 62.5, 31.25 µs: sampling is a delay of order T, so that the error halves with T.
    let errors: Vec<f64> = [125_000_u64, 62_500, 31_250]
        .into_iter()
        .map(|period_ns| {
            let mut rig = rig.clone();
            rig.time_base = sollwert::base::TimeBase::new((period_ns, 1), 1);
            let data = &mut rig.data;
            (data.position_cycle_ticks, data.speed_cycle_ticks, data.current_cycle_ticks) = (1, 1, 1);
            rig.follow(duration_s, motion).last().expect("signals").position_actual_lu - exact_lu
        })
        .collect();
    for two in errors.windows(2) {
        let ratio = two[1] / two[0];
        assert!((ratio - 0.5).abs() < 0.05, "errors {errors:?} do not halve");
    }
    assert!(errors[2].abs() < 1e-3 * exact_lu, "errors {errors:?} of {exact_lu}");
}
