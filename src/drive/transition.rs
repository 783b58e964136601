//! The exact step of motor and mechanics over any time with constant voltage and constant dry torque.
//!
//! In: motor, mechanics, duration. Out: [`Transition`], which takes a state to the state that follows. With z = (i, w),
//!
//! ```text
//! z' = A z + b    A = [ -R/L  -Ke/L ]    z(h) = z + F(h) z'(0)            F(h) = ∫ exp(A s) ds
//!                     [ Kt/J   -B/J ]    th(h) = th + h w + G(h) z'(0)    G(h) = (0 1) ∫ F(s) ds
//! ```
//!
//! This is the zero-order-hold map of models/drive.md section 5 written with the slopes at the start of the tick. It needs no
//! inverse of A, so that Ke = 0 and B = 0 are ordinary cases, and a state in balance (z' = 0) stays where it is to the last bit.
//! Does not know dry friction: that is the plant's.

use super::plant::PlantState;
use crate::machine::{MechanicsData, MotorData};

/// Bound on |A| h for the series; a longer step is halved until it holds, then doubled again.
const SERIES_NORM_MAX: f64 = 0.25;
/// Terms of the series: the first one left out is below 0.25^13 / 14!, 2e-19 of the first.
const SERIES_TERMS: u32 = 13;
/// More halvings than any finite ratio of step and time constant needs; it only ends the loop on infinite input.
const HALVINGS_MAX: u32 = 2200;

/// Constant map over `duration_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transition {
    duration_s: f64,
    /// F(h) with the columns divided by L and J.
    current_by_voltage_a_per_v: f64,
    current_by_torque_a_per_n_m: f64,
    speed_by_voltage_rad_s_per_v: f64,
    speed_by_torque_rad_s_per_n_m: f64,
    /// G(h) with the columns divided by L and J.
    angle_by_voltage_rad_per_v: f64,
    angle_by_torque_rad_per_n_m: f64,
}

/// What drives the state at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Excess {
    /// L i' = u - R i - Ke w.
    pub(super) voltage_v: f64,
    /// J w' = Kt i - B w - Tdry - Tg.
    pub(super) torque_n_m: f64,
}

impl Transition {
    /// The map over `duration_s`.
    pub(super) fn over(motor: &MotorData, mechanics: &MechanicsData, duration_s: f64) -> Self {
        let (l, j) = (motor.inductance_h, mechanics.inertia_kg_m2);
        let a = [
            [-motor.resistance_ohm / l, -motor.back_emf_v_s_per_rad / l],
            [motor.torque_constant_n_m_per_a / j, -mechanics.viscous_friction_n_m_s_per_rad / j],
        ];
        let (f, g) = integrals(a, duration_s);
        Self {
            duration_s,
            current_by_voltage_a_per_v: f[0][0] / l,
            current_by_torque_a_per_n_m: f[0][1] / j,
            speed_by_voltage_rad_s_per_v: f[1][0] / l,
            speed_by_torque_rad_s_per_n_m: f[1][1] / j,
            angle_by_voltage_rad_per_v: g[0] / l,
            angle_by_torque_rad_per_n_m: g[1] / j,
        }
    }

    /// The state after the step.
    #[inline(always)]
    pub(super) fn apply(&self, state: PlantState, excess: Excess) -> PlantState {
        let Excess { voltage_v: a, torque_n_m: b } = excess;
        PlantState {
            current_a: state.current_a + (self.current_by_voltage_a_per_v * a + self.current_by_torque_a_per_n_m * b),
            speed_rad_s: state.speed_rad_s
                + (self.speed_by_voltage_rad_s_per_v * a + self.speed_by_torque_rad_s_per_n_m * b),
            angle_rad: state.angle_rad
                + (self.duration_s * state.speed_rad_s
                    + (self.angle_by_voltage_rad_per_v * a + self.angle_by_torque_rad_per_n_m * b)),
        }
    }
}

type Matrix = [[f64; 2]; 2];

fn product(a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|row| std::array::from_fn(|column| a[row][0] * b[0][column] + a[row][1] * b[1][column]))
}

/// F(h) and G(h): series for a short step, then doubling. Every entry keeps its relative accuracy, also the tiny ones (angle by
/// voltage is of order h³), which a matrix exponential of the whole 5×5 system would round against its ones.
fn integrals(a: Matrix, duration_s: f64) -> (Matrix, [f64; 2]) {
    // Size of A after the diagonal scaling that balances its two off-diagonal entries.
    let norm_per_s = a[0][0].abs().max(a[1][1].abs()) + (a[0][1] * a[1][0]).abs().sqrt();
    let mut h = duration_s;
    let mut halvings = 0;
    while norm_per_s * h > SERIES_NORM_MAX && halvings < HALVINGS_MAX {
        h *= 0.5;
        halvings += 1;
    }

    // F = Σ A^k h^(k+1)/(k+1)!, G = Σ (second row of A^k) h^(k+2)/(k+2)!
    let mut term: Matrix = [[h, 0.0], [0.0, h]];
    let (mut f, mut g) = (term, [0.0, 0.5 * h * h]);
    for k in 1..SERIES_TERMS {
        let scale_s = h / f64::from(k + 1);
        term = product(a, term).map(|row| row.map(|value| value * scale_s));
        for row in 0..2 {
            for column in 0..2 {
                f[row][column] += term[row][column];
            }
            g[row] += term[1][row] * h / f64::from(k + 2);
        }
    }

    // F(2h) = F + E F and G(2h) = G + h (second row of F) + G E with E = exp(A h) = 1 + A F.
    for _ in 0..halvings {
        let mut e = product(a, f);
        e[0][0] += 1.0;
        e[1][1] += 1.0;
        let later = product(e, f);
        g = std::array::from_fn(|column| g[column] + h * f[1][column] + (g[0] * e[0][column] + g[1] * e[1][column]));
        for row in 0..2 {
            for column in 0..2 {
                f[row][column] += later[row][column];
            }
        }
        h *= 2.0;
    }
    (f, g)
}
