//! Motor and mechanics: R-L, inertia, viscous and dry friction, gravity (models/drive.md section 5).
//!
//! In: voltage and gravity torque, constant over a tick. Out: the state after the tick. The solution is the exact one of the
//! hybrid system: a tick in which the axis stops, reverses or breaks away is split at that instant ([`Plant::pieces`]).
//! Rigid: a load behind a spring is `second_mass`, play is `backlash`; what is not modelled is absorbed by the balancing delay.
//!
//! Assumes that a tick is shorter than half a period of the electro-mechanical oscillation sqrt(Kt Ke / (L J)), which is some
//! hundred ticks in any real drive: then the acceleration changes its sign at most once in a tick and no stop is overlooked.

use super::integral::{Course, falling_zero};
use super::limit::limited;
use super::transition::{Excess, Slopes, Transition, law};
use crate::machine::{DriveData, MechanicsData, MotorData};

/// More stops and breakaways than one tick can hold. They cannot follow each other closely, because u is constant in a tick and
/// the current tends to one value; the bound only ends the loop where rounding makes the axis rest and move in turn.
const PIECES_MAX: u32 = 16;

/// i, w, th.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantState {
    /// i.
    pub current_a: f64,
    /// w, motor speed; exactly 0 while the axis sticks.
    pub speed_rad_s: f64,
    /// th, motor angle; keeps its bits while the axis sticks.
    pub angle_rad: f64,
}

/// A part of a tick with one linear law: what [`Plant::pieces`] shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// State at its start.
    pub start: PlantState,
    /// Its length.
    pub duration_s: f64,
    /// ±Tc while moving, `None` while stuck (dry friction then balances Kt i - Tg).
    pub dry_friction_n_m: Option<f64>,
}

/// Constants of the plant and the map over one tick.
#[derive(Clone, Copy, Debug)]
pub struct Plant {
    pub(super) motor: MotorData,
    pub(super) mechanics: MechanicsData,
    pub(super) has_dry_friction: bool,
    pub(super) gravity_turns: bool,
    /// Map over a tick in motion.
    pub(super) tick: Transition,
    /// (1 - exp(-R h / L)) / R: current by voltage over a tick at rest.
    pub(super) rest_gain_a_per_v: f64,
    /// Bound on 2 h / J: no speed minimum inside a tick lies deeper below its ends than this times the change of torque.
    pub(super) dip_rad_s_per_n_m: f64,
    pub(super) period_s: f64,
}

impl Plant {
    /// The plant of a drive with ticks of `period_s` (T_i).
    pub fn new(data: &DriveData, period_s: f64) -> Self {
        let (motor, mechanics) = (data.motor, data.mechanics);
        let decay_per_s = motor.resistance_ohm / motor.inductance_h
            + mechanics.viscous_friction_n_m_s_per_rad / mechanics.inertia_kg_m2
            + (motor.back_emf_v_s_per_rad * motor.torque_constant_n_m_per_a
                / (motor.inductance_h * mechanics.inertia_kg_m2))
                .sqrt();
        // Where a tick is short against every time constant, the slope of the speed inside it is within twice its end values.
        let short = decay_per_s * period_s < 0.5;
        Self {
            motor,
            mechanics,
            has_dry_friction: mechanics.breakaway_friction_n_m > 0.0,
            gravity_turns: mechanics.gravity_sin_n_m != 0.0 || mechanics.gravity_cos_n_m != 0.0,
            tick: Transition::over(&motor, &mechanics, period_s),
            rest_gain_a_per_v: rest_gain_a_per_v(&motor, period_s),
            dip_rad_s_per_n_m: if short { 2.0 * period_s / mechanics.inertia_kg_m2 } else { f64::INFINITY },
            period_s,
        }
    }

    /// Tg(x) = g0 + gs sin x + gc cos x at the motor, without outside load.
    #[inline(always)]
    pub fn gravity_n_m(&self, angle_rad: f64) -> f64 {
        let MechanicsData { gravity_n_m: g0, gravity_sin_n_m: gs, gravity_cos_n_m: gc, .. } = self.mechanics;
        if !self.gravity_turns {
            return g0;
        }
        // A rotary axis: the load position is the axis angle in rad.
        let (sin, cos) = libm::sincos(self.mechanics.transmission_lu_per_rad * angle_rad);
        g0 + gs * sin + gc * cos
    }

    /// The axis sticks: at rest, and motor and gravity do not overcome the breakaway torque. Without dry friction never.
    #[inline(always)]
    pub fn sticks(&self, state: PlantState, gravity_n_m: f64) -> bool {
        self.friction().sticks(state, gravity_n_m)
    }

    /// t_fric: Tc sgn w + B w; at rest what balances motor and gravity, up to ±Ts.
    #[inline(always)]
    pub fn friction_n_m(&self, state: PlantState, gravity_n_m: f64) -> f64 {
        self.friction().torque_n_m(state, gravity_n_m)
    }

    #[inline(always)]
    pub(super) fn friction(&self) -> Friction {
        Friction {
            torque_constant_n_m_per_a: self.motor.torque_constant_n_m_per_a,
            viscous_n_m_s_per_rad: self.mechanics.viscous_friction_n_m_s_per_rad,
            coulomb_n_m: self.mechanics.coulomb_friction_n_m,
            breakaway_n_m: self.mechanics.breakaway_friction_n_m,
        }
    }

    /// The state one tick later.
    #[inline(always)]
    pub fn step(&self, state: PlantState, voltage_v: f64, gravity_n_m: f64) -> PlantState {
        let w = state.speed_rad_s;
        if w == 0.0 && self.has_dry_friction {
            return self.step_from_rest(state, voltage_v, gravity_n_m);
        }
        let (next, usual) = self.usual_step(state, voltage_v, gravity_n_m);
        if usual {
            return next;
        }
        self.pieces(state, voltage_v, gravity_n_m, self.period_s, |_| {})
    }

    /// The map over a tick in motion, and whether nothing happened in it (`block` has a coarser condition for many ticks). Not for an
    /// axis at rest with dry friction.
    #[inline(always)]
    fn usual_step(&self, state: PlantState, voltage_v: f64, gravity_n_m: f64) -> (PlantState, bool) {
        let w = state.speed_rad_s;
        let against_n_m = self.mechanics.coulomb_friction_n_m.copysign(w) + gravity_n_m;
        let excess = self.excess(state, voltage_v, against_n_m);
        let next = self.tick.apply(state, excess);
        // The usual tick: the speed keeps its sign at the end, and had no minimum on the other side of zero in between.
        let keeps_sign = next.speed_rad_s * w > 0.0;
        let (before_n_m, after_n_m) = (excess.torque_n_m, self.excess(next, voltage_v, against_n_m).torque_n_m);
        let may_dip = (before_n_m * w < 0.0)
            & (after_n_m * w > 0.0)
            & (w.abs() < self.dip_rad_s_per_n_m * (after_n_m - before_n_m).abs());
        // A state that has left the range of f64 is passed on as it is: the search for instants would hide it.
        (next, (keeps_sign & !may_dip) | !self.has_dry_friction | !next.speed_rad_s.is_finite())
    }

    /// A tick that starts at rest with dry friction: mostly it stays there.
    #[inline]
    fn step_from_rest(&self, state: PlantState, voltage_v: f64, gravity_n_m: f64) -> PlantState {
        let excess_v = voltage_v - self.motor.resistance_ohm * state.current_a;
        let next = PlantState { current_a: state.current_a + self.rest_gain_a_per_v * excess_v, ..state };
        // The current runs monotonically from one end to the other: if it holds the axis at both, it does in between.
        if self.sticks(state, gravity_n_m) && self.sticks(next, gravity_n_m) {
            return next;
        }
        self.pieces(state, voltage_v, gravity_n_m, self.period_s, |_| {})
    }

    /// The exact solution over `duration_s`, split at every stop, reversal and breakaway; `show` gets each part before it runs.
    /// Returns the state at the end.
    #[inline(never)]
    pub fn pieces(
        &self,
        mut state: PlantState,
        voltage_v: f64,
        gravity_n_m: f64,
        duration_s: f64,
        mut show: impl FnMut(Piece),
    ) -> PlantState {
        if !self.has_dry_friction {
            show(Piece { start: state, duration_s, dry_friction_n_m: Some(0.0) });
            let excess = self.excess(state, voltage_v, gravity_n_m);
            return Transition::over(&self.motor, &self.mechanics, duration_s).apply(state, excess);
        }
        let kt = self.motor.torque_constant_n_m_per_a;
        let MechanicsData { coulomb_friction_n_m: tc, breakaway_friction_n_m: ts, .. } = self.mechanics;
        let (a, norm_per_s) = law(&self.motor, &self.mechanics);
        let mut remaining_s = duration_s;
        let mut broke_away: Option<f64> = None;
        for _ in 0..PIECES_MAX {
            let drive_n_m = kt * state.current_a - gravity_n_m;
            let at_rest = state.speed_rad_s == 0.0;
            if at_rest && broke_away.is_none() && self.sticks(state, gravity_n_m) {
                let (held_s, side) = self.rest_time(state, voltage_v, gravity_n_m, remaining_s);
                show(Piece { start: state, duration_s: held_s, dry_friction_n_m: None });
                let Some(side) = side else { return self.at_rest(state, voltage_v, held_s) };
                state.current_a = (gravity_n_m + ts.copysign(side)) / kt;
                remaining_s -= held_s;
                broke_away = Some(side);
                continue;
            }
            let side = broke_away.unwrap_or(if at_rest { drive_n_m } else { state.speed_rad_s });
            let friction_n_m = tc.copysign(side);
            let mut excess = self.excess(state, voltage_v, friction_n_m + gravity_n_m);
            if broke_away.take().is_some() {
                // At breakaway Kt i - Tg = ±Ts by definition; where Ts = Tc the motion must start with exactly no acceleration.
                excess.torque_n_m = (ts - tc).copysign(side);
            }
            let rates = [excess.voltage_v / self.motor.inductance_h, excess.torque_n_m / self.mechanics.inertia_kg_m2];
            let course = Course::new(&a, norm_per_s, rates, remaining_s);
            let moving = Moving { start_rad_s: state.speed_rad_s, side: 1f64.copysign(side), course };
            let stop_s = moving.time_to_stop(remaining_s);
            let run_s = stop_s.unwrap_or(remaining_s);
            show(Piece { start: state, duration_s: run_s, dry_friction_n_m: Some(friction_n_m) });
            state = Transition::over(&self.motor, &self.mechanics, run_s).apply(state, excess);
            if stop_s.is_none() {
                return state;
            }
            state.speed_rad_s = 0.0;
            remaining_s -= run_s;
        }
        self.at_rest(state, voltage_v, remaining_s)
    }

    /// How long the current holds the axis at rest, and the sign of Kt i - Tg with which it breaks away before `limit_s`.
    fn rest_time(&self, state: PlantState, voltage_v: f64, gravity_n_m: f64, limit_s: f64) -> (f64, Option<f64>) {
        let MotorData { resistance_ohm: r, inductance_h: l, torque_constant_n_m_per_a: kt, .. } = self.motor;
        let excess_v = voltage_v - r * state.current_a;
        let end = self.at_rest(state, voltage_v, limit_s);
        if self.sticks(end, gravity_n_m) || end.speed_rad_s != 0.0 || excess_v == 0.0 {
            return (limit_s, None);
        }
        // i(t) = i + (u/R - i)(1 - exp(-R t / L)) reaches (Tg ± Ts)/Kt at t.
        let border_a = (gravity_n_m + self.mechanics.breakaway_friction_n_m.copysign(excess_v)) / kt;
        let share = r * (border_a - state.current_a) / excess_v;
        let held_s = -libm::log1p(-share) * l / r;
        if held_s.is_nan() { (limit_s, None) } else { (held_s.clamp(0.0, limit_s), Some(excess_v)) }
    }

    /// The axis at rest for `duration_s`: only the current runs.
    fn at_rest(&self, state: PlantState, voltage_v: f64, duration_s: f64) -> PlantState {
        let excess_v = voltage_v - self.motor.resistance_ohm * state.current_a;
        PlantState { current_a: state.current_a + rest_gain_a_per_v(&self.motor, duration_s) * excess_v, ..state }
    }

    /// Voltage and torque left over for L i' and J w'; `against_n_m` = dry friction and gravity.
    #[inline(always)]
    fn excess(&self, state: PlantState, voltage_v: f64, against_n_m: f64) -> Excess {
        Slopes::of(&self.motor, &self.mechanics).excess(state, voltage_v, against_n_m)
    }
}

/// What the friction of an axis is made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Friction {
    /// Kt.
    pub(super) torque_constant_n_m_per_a: f64,
    /// B.
    pub(super) viscous_n_m_s_per_rad: f64,
    /// Tc.
    pub(super) coulomb_n_m: f64,
    /// Ts.
    pub(super) breakaway_n_m: f64,
}

impl Friction {
    /// See [`Plant::sticks`].
    #[inline(always)]
    pub(super) fn sticks(&self, state: PlantState, gravity_n_m: f64) -> bool {
        let drive_n_m = self.torque_constant_n_m_per_a * state.current_a - gravity_n_m;
        (state.speed_rad_s == 0.0) & (self.breakaway_n_m > 0.0) & (drive_n_m.abs() <= self.breakaway_n_m)
    }

    /// See [`Plant::friction_n_m`].
    #[inline(always)]
    pub(super) fn torque_n_m(&self, state: PlantState, gravity_n_m: f64) -> f64 {
        let w = state.speed_rad_s;
        let at_rest_n_m = limited(self.torque_constant_n_m_per_a * state.current_a - gravity_n_m, self.breakaway_n_m);
        let moving_n_m = self.coulomb_n_m.copysign(w) + self.viscous_n_m_s_per_rad * w;
        if w == 0.0 { at_rest_n_m } else { moving_n_m }
    }
}

/// (1 - exp(-R t / L)) / R.
fn rest_gain_a_per_v(motor: &MotorData, duration_s: f64) -> f64 {
    let MotorData { resistance_ohm: r, inductance_h: l, .. } = *motor;
    -libm::expm1(-r * duration_s / l) / r
}

/// Motion in one direction with constant dry friction.
struct Moving<'a> {
    start_rad_s: f64,
    /// +1 or -1: sense of the motion.
    side: f64,
    /// Of (i, w).
    course: Course<'a, 2>,
}

impl Moving<'_> {
    /// Speed in the sense of the motion, with its first two derivatives.
    fn speed(&self, time_s: f64) -> [f64; 3] {
        let at = self.course.at(time_s);
        [(self.start_rad_s + at.change[1]) * self.side, at.rates[1] * self.side, at.bends[1] * self.side]
    }

    /// First instant in (0, `limit_s`] at which the speed comes down to 0.
    fn time_to_stop(&self, limit_s: f64) -> Option<f64> {
        let ([end_rad_s, end_rate, _], [_, start_rate, _]) = (self.speed(limit_s), self.speed(0.0));
        let zero = |low_s, high_s| {
            falling_zero(low_s, high_s, |time_s| {
                let [value, slope, _] = self.speed(time_s);
                (value, slope)
            })
        };
        // The instant at which the acceleration changes its sign.
        let turning = |sense: f64| {
            falling_zero(0.0, limit_s, |time_s| {
                let [_, value, slope] = self.speed(time_s);
                (value * sense, slope * sense)
            })
        };
        if end_rad_s > 0.0 {
            // A minimum in between may lie below 0.
            if !(start_rate < 0.0 && end_rate > 0.0) {
                return None;
            }
            let lowest_s = turning(-1.0);
            return (self.speed(lowest_s)[0] <= 0.0).then(|| zero(0.0, lowest_s));
        }
        if self.start_rad_s != 0.0 {
            return Some(zero(0.0, limit_s));
        }
        // From rest there is a zero at the start, too: look behind the highest speed. Without one the motion has not begun.
        (start_rate >= 0.0 && end_rate < 0.0).then(|| zero(turning(1.0), limit_s))
    }
}
