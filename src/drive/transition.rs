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

use super::integral::{Matrix, integrals};
use super::plant::PlantState;
use crate::machine::{MechanicsData, MotorData};

/// Constant map over `duration_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transition {
    pub(super) duration_s: f64,
    /// F(h) with the columns divided by L and J.
    pub(super) current_by_voltage_a_per_v: f64,
    pub(super) current_by_torque_a_per_n_m: f64,
    pub(super) speed_by_voltage_rad_s_per_v: f64,
    pub(super) speed_by_torque_rad_s_per_n_m: f64,
    /// G(h) with the columns divided by L and J.
    pub(super) angle_by_voltage_rad_per_v: f64,
    pub(super) angle_by_torque_rad_per_n_m: f64,
}

/// What drives the state at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Excess {
    /// L i' = u - R i - Ke w.
    pub(super) voltage_v: f64,
    /// J w' = Kt i - B w - Tdry - Tg.
    pub(super) torque_n_m: f64,
}

/// What the slopes are made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slopes {
    /// R.
    pub(super) resistance_ohm: f64,
    /// Ke.
    pub(super) back_emf_v_s_per_rad: f64,
    /// Kt.
    pub(super) torque_constant_n_m_per_a: f64,
    /// B.
    pub(super) viscous_friction_n_m_s_per_rad: f64,
}

impl Slopes {
    #[inline(always)]
    pub(super) fn of(motor: &MotorData, mechanics: &MechanicsData) -> Self {
        Self {
            resistance_ohm: motor.resistance_ohm,
            back_emf_v_s_per_rad: motor.back_emf_v_s_per_rad,
            torque_constant_n_m_per_a: motor.torque_constant_n_m_per_a,
            viscous_friction_n_m_s_per_rad: mechanics.viscous_friction_n_m_s_per_rad,
        }
    }

    /// `against_n_m` = dry friction and gravity.
    #[inline(always)]
    pub(super) fn excess(&self, state: PlantState, voltage_v: f64, against_n_m: f64) -> Excess {
        let PlantState { current_a: i, speed_rad_s: w, .. } = state;
        Excess {
            voltage_v: (voltage_v - self.resistance_ohm * i) - self.back_emf_v_s_per_rad * w,
            torque_n_m: (self.torque_constant_n_m_per_a * i - against_n_m) - self.viscous_friction_n_m_s_per_rad * w,
        }
    }
}

/// A, and its size after the diagonal scaling that balances its two off-diagonal entries.
pub(super) fn law(motor: &MotorData, mechanics: &MechanicsData) -> (Matrix<2>, f64) {
    let (l, j) = (motor.inductance_h, mechanics.inertia_kg_m2);
    let a = [
        [-motor.resistance_ohm / l, -motor.back_emf_v_s_per_rad / l],
        [motor.torque_constant_n_m_per_a / j, -mechanics.viscous_friction_n_m_s_per_rad / j],
    ];
    (a, a[0][0].abs().max(a[1][1].abs()) + (a[0][1] * a[1][0]).abs().sqrt())
}

impl Transition {
    /// The map over `duration_s`.
    pub(super) fn over(motor: &MotorData, mechanics: &MechanicsData, duration_s: f64) -> Self {
        let (l, j) = (motor.inductance_h, mechanics.inertia_kg_m2);
        let (a, norm_per_s) = law(motor, mechanics);
        let (f, g) = integrals(&a, norm_per_s, 1, duration_s);
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
