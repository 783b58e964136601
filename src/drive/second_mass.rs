//! Motor and load on either side of a spring: the first resonance of a mechanical axis.
//!
//! In: voltage, gravity torque (outside load included), constant over a tick. Out: the state after the tick. z = (i, wm, phi, wl):
//!
//! ```text
//! L i'   = u - R i - Ke wm                       phi' = wm - wl           twist of the spring
//! Jm wm' = Kt i - s                              s    = c phi + d phi'    torque in the spring
//! Jl wl' = s - B wl - Tdry(wl) - Tg              thl' = wl                th = thl + phi: the motor's angle
//! ```
//!
//! All friction, gravity and outside load act on the load: guide-ways and weight are there, and the lost motion Tc/c at a reversal is
//! what a direct measuring system shows and an indirect one does not. Everything is counted at the motor shaft, Jm + Jl = J. At rest
//! (wl = 0, |s - Tg| <= Ts) the load keeps its bits while motor and spring may swing.
//!
//! The solution is exact as in `plant`: a stretch with a stop, reversal or breakaway is split at that instant. A tick is cut into
//! stretches that are short against the resonance, so that speed and spring torque turn at most once in each. Does not know shafts
//! with more masses.

use super::integral::{Course, Instant, Matrix, falling_zero, integrals};
use super::plant::PlantState;
use crate::machine::{DriveData, MechanicsData, MotorData};

/// Stops and breakaways in one stretch: as in `plant`.
const PIECES_MAX: u32 = 16;
/// Stretches are so short that |A| h stays below this.
const STRETCH_NORM_MAX: f64 = 0.4;
/// Stretches of a tick at most: a spring that would need more (resonance above some ten times the sampling frequency) is
/// integrated exactly all the same, but a stop between two of its swings may be found a fraction of a tick late.
const STRETCHES_MAX: f64 = 64.0;
/// Places of wm, phi, wl in z.
const MOTOR: usize = 1;
const TWIST: usize = 2;
const LOAD: usize = 3;

/// State of motor, spring and load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoMassState {
    /// i.
    pub current_a: f64,
    /// wm.
    pub motor_speed_rad_s: f64,
    /// phi.
    pub twist_rad: f64,
    /// wl; exactly 0 while the load sticks.
    pub load_speed_rad_s: f64,
    /// thl; keeps its bits while the load sticks.
    pub load_angle_rad: f64,
}

/// A part of a tick with one linear law: what [`TwoMass::pieces`] shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoMassPiece {
    /// State at its start.
    pub start: TwoMassState,
    /// Its length.
    pub duration_s: f64,
    /// ±Tc while the load moves, `None` while it sticks (dry friction then balances s - Tg).
    pub dry_friction_n_m: Option<f64>,
}

/// Constants of the two masses and the maps over a stretch.
#[derive(Clone, Debug)]
pub struct TwoMass {
    motor: MotorData,
    mechanics: MechanicsData,
    motor_inertia_kg_m2: f64,
    norm_per_s: f64,
    has_dry_friction: bool,
    stretches: u32,
    stretch_s: f64,
    moving: Map,
    resting: Map,
}

/// Exact map over a duration, load in motion or at rest.
#[derive(Clone, Debug)]
struct Map {
    duration_s: f64,
    slope: Matrix<4>,
    rate: Matrix<4>,
    angle: [f64; 4],
}

/// z and its derivative, in the order i, wm, phi, wl.
type Vector = [f64; 4];

impl TwoMassState {
    fn vector(&self) -> Vector {
        [self.current_a, self.motor_speed_rad_s, self.twist_rad, self.load_speed_rad_s]
    }

    /// i, wm, th: what the drive sees.
    pub fn motor(&self) -> PlantState {
        PlantState {
            current_a: self.current_a,
            speed_rad_s: self.motor_speed_rad_s,
            angle_rad: self.load_angle_rad + self.twist_rad,
        }
    }

    /// All of it is a number.
    pub fn is_finite(&self) -> bool {
        self.vector().iter().all(|value| value.is_finite()) && self.load_angle_rad.is_finite()
    }
}

impl Map {
    #[inline]
    fn apply(&self, state: &TwoMassState, rates: &Vector) -> TwoMassState {
        let z = state.vector();
        let sum = |row: &Vector| (1..4).fold(row[0] * rates[0], |sum, k| sum + row[k] * rates[k]);
        TwoMassState {
            current_a: z[0] + sum(&self.rate[0]),
            motor_speed_rad_s: z[MOTOR] + sum(&self.rate[MOTOR]),
            twist_rad: z[TWIST] + sum(&self.rate[TWIST]),
            load_speed_rad_s: z[LOAD] + sum(&self.rate[LOAD]),
            load_angle_rad: state.load_angle_rad + (self.duration_s * z[LOAD] + sum(&self.angle)),
        }
    }
}

impl TwoMass {
    /// The two masses of a drive with ticks of `period_s` (T_i); `None`: the axis is rigid.
    pub fn new(data: &DriveData, period_s: f64) -> Option<Self> {
        let (motor, mechanics) = (data.motor, data.mechanics);
        let load_kg_m2 = mechanics.load_inertia_kg_m2;
        if load_kg_m2 <= 0.0 {
            return None;
        }
        let motor_inertia_kg_m2 = mechanics.inertia_kg_m2 - load_kg_m2;
        let per_inertia = 1.0 / motor_inertia_kg_m2 + 1.0 / load_kg_m2;
        let (c, d) = (mechanics.coupling_stiffness_n_m_per_rad, mechanics.coupling_damping_n_m_s_per_rad);
        let emf_n_m_s_per_rad = motor.back_emf_v_s_per_rad * motor.torque_constant_n_m_per_a;
        let norm_per_s = (motor.resistance_ohm / motor.inductance_h).max(d * per_inertia)
            + mechanics.viscous_friction_n_m_s_per_rad / load_kg_m2
            + (c * per_inertia).sqrt()
            + (emf_n_m_s_per_rad / (motor.inductance_h * motor_inertia_kg_m2)).sqrt();
        let stretches = (norm_per_s * period_s / STRETCH_NORM_MAX).ceil().clamp(1.0, STRETCHES_MAX);
        let stretch_s = period_s / stretches;
        let mut new = Self {
            motor,
            mechanics,
            motor_inertia_kg_m2,
            norm_per_s,
            has_dry_friction: mechanics.breakaway_friction_n_m > 0.0,
            stretches: stretches as u32,
            stretch_s,
            moving: Map { duration_s: 0.0, slope: [[0.0; 4]; 4], rate: [[0.0; 4]; 4], angle: [0.0; 4] },
            resting: Map { duration_s: 0.0, slope: [[0.0; 4]; 4], rate: [[0.0; 4]; 4], angle: [0.0; 4] },
        };
        new.moving = new.map(stretch_s, false);
        new.resting = new.map(stretch_s, true);
        Some(new)
    }

    /// Held by `torque_n_m` in motor and spring. The place where the position is measured stands at `angle_rad`: the motor, or the load.
    pub fn held(&self, torque_n_m: f64, angle_rad: f64, at_motor: bool) -> TwoMassState {
        let twist_rad = torque_n_m / self.mechanics.coupling_stiffness_n_m_per_rad;
        TwoMassState {
            current_a: torque_n_m / self.motor.torque_constant_n_m_per_a,
            motor_speed_rad_s: 0.0,
            twist_rad,
            load_speed_rad_s: 0.0,
            load_angle_rad: if at_motor { angle_rad - twist_rad } else { angle_rad },
        }
    }

    /// A and the integrals of its exponential.
    fn map(&self, duration_s: f64, resting: bool) -> Map {
        let MotorData { resistance_ohm: r, inductance_h: l, back_emf_v_s_per_rad: ke, torque_constant_n_m_per_a: kt } =
            self.motor;
        let MechanicsData {
            coupling_stiffness_n_m_per_rad: c,
            coupling_damping_n_m_s_per_rad: d,
            viscous_friction_n_m_s_per_rad: b,
            load_inertia_kg_m2: jl,
            ..
        } = self.mechanics;
        let jm = self.motor_inertia_kg_m2;
        // At rest the load's speed neither changes nor, being 0, matters.
        let load = if resting { [0.0; 4] } else { [0.0, d / jl, c / jl, -(d + b) / jl] };
        let slope = [
            [-r / l, -ke / l, 0.0, 0.0],
            [kt / jm, -d / jm, -c / jm, d / jm],
            [0.0, 1.0, 0.0, if resting { 0.0 } else { -1.0 }],
            load,
        ];
        let (rate, angle) = integrals(&slope, self.norm_per_s, LOAD, duration_s);
        Map { duration_s, slope, rate, angle }
    }

    /// s.
    #[inline]
    pub fn spring_n_m(&self, state: &TwoMassState) -> f64 {
        self.mechanics.coupling_stiffness_n_m_per_rad * state.twist_rad
            + self.mechanics.coupling_damping_n_m_s_per_rad * (state.motor_speed_rad_s - state.load_speed_rad_s)
    }

    /// s' of a load at rest.
    #[inline]
    fn spring_rate_n_m_per_s(&self, rates: &Vector) -> f64 {
        self.mechanics.coupling_stiffness_n_m_per_rad * rates[TWIST]
            + self.mechanics.coupling_damping_n_m_s_per_rad * rates[MOTOR]
    }

    /// The load sticks: at rest, and spring and gravity do not overcome the breakaway torque.
    #[inline]
    pub fn sticks(&self, state: &TwoMassState, gravity_n_m: f64) -> bool {
        let drive_n_m = self.spring_n_m(state) - gravity_n_m;
        state.load_speed_rad_s == 0.0
            && self.has_dry_friction
            && drive_n_m.abs() <= self.mechanics.breakaway_friction_n_m
    }

    /// t_fric on the load: Tc sgn wl + B wl; at rest what balances spring and gravity, up to ±Ts.
    pub fn friction_n_m(&self, state: &TwoMassState, gravity_n_m: f64) -> f64 {
        let w = state.load_speed_rad_s;
        if w == 0.0 {
            let drive_n_m = self.spring_n_m(state) - gravity_n_m;
            super::limit::limited(drive_n_m, self.mechanics.breakaway_friction_n_m)
        } else {
            self.mechanics.coulomb_friction_n_m.copysign(w) + self.mechanics.viscous_friction_n_m_s_per_rad * w
        }
    }

    /// z'; `against_n_m` = dry friction and gravity, `None` for a load that is held.
    #[inline]
    fn rates(&self, state: &TwoMassState, voltage_v: f64, against_n_m: Option<f64>) -> Vector {
        let MotorData { resistance_ohm: r, inductance_h: l, back_emf_v_s_per_rad: ke, torque_constant_n_m_per_a: kt } =
            self.motor;
        let spring_n_m = self.spring_n_m(state);
        let (wm, wl) = (state.motor_speed_rad_s, state.load_speed_rad_s);
        let load_n_m = |against_n_m| (spring_n_m - against_n_m) - self.mechanics.viscous_friction_n_m_s_per_rad * wl;
        [
            ((voltage_v - r * state.current_a) - ke * wm) / l,
            (kt * state.current_a - spring_n_m) / self.motor_inertia_kg_m2,
            wm - wl,
            against_n_m.map_or(0.0, |against_n_m| load_n_m(against_n_m) / self.mechanics.load_inertia_kg_m2),
        ]
    }

    /// The state one tick later.
    pub fn step(&self, mut state: TwoMassState, voltage_v: f64, gravity_n_m: f64) -> TwoMassState {
        for _ in 0..self.stretches {
            state = self.stretch(state, voltage_v, gravity_n_m);
        }
        state
    }

    /// One stretch: the plain map where nothing happens in it.
    fn stretch(&self, state: TwoMassState, voltage_v: f64, gravity_n_m: f64) -> TwoMassState {
        let wl = state.load_speed_rad_s;
        if wl == 0.0 && self.has_dry_friction {
            if self.sticks(&state, gravity_n_m) {
                let rates = self.rates(&state, voltage_v, None);
                let next = self.resting.apply(&state, &rates);
                // Between two ends that hold the load the torque leaves the band only if it turns.
                let turns = self.spring_rate_n_m_per_s(&rates)
                    * self.spring_rate_n_m_per_s(&self.rates(&next, voltage_v, None))
                    < 0.0;
                if self.sticks(&next, gravity_n_m) && !turns {
                    return next;
                }
            }
            return self.events(state, voltage_v, gravity_n_m, self.stretch_s, &mut |_| {});
        }
        let against_n_m = self.mechanics.coulomb_friction_n_m.copysign(wl) + gravity_n_m;
        let rates = self.rates(&state, voltage_v, Some(against_n_m));
        let next = self.moving.apply(&state, &rates);
        if !self.has_dry_friction || !next.is_finite() {
            return next;
        }
        let after = self.rates(&next, voltage_v, Some(against_n_m));
        // The slope of the speed turns at most once in a stretch, so that it is nowhere in a dip steeper than at the ends.
        let lowest_rad_s = wl.abs().min(next.load_speed_rad_s.abs());
        let may_dip = rates[LOAD] * wl < 0.0
            && after[LOAD] * wl > 0.0
            && lowest_rad_s <= self.stretch_s * rates[LOAD].abs().max(after[LOAD].abs());
        if next.load_speed_rad_s * wl > 0.0 && !may_dip {
            return next;
        }
        self.events(state, voltage_v, gravity_n_m, self.stretch_s, &mut |_| {})
    }

    /// The exact solution over `duration_s`, split at every stop, reversal and breakaway; `show` gets each part before it runs.
    pub fn pieces(
        &self,
        mut state: TwoMassState,
        voltage_v: f64,
        gravity_n_m: f64,
        duration_s: f64,
        mut show: impl FnMut(TwoMassPiece),
    ) -> TwoMassState {
        let count = (duration_s / self.stretch_s * (1.0 - f64::EPSILON)).ceil().clamp(1.0, STRETCHES_MAX);
        for _ in 0..count as u32 {
            state = self.events(state, voltage_v, gravity_n_m, duration_s / count, &mut show);
        }
        state
    }

    #[inline(never)]
    fn events(
        &self,
        mut state: TwoMassState,
        voltage_v: f64,
        gravity_n_m: f64,
        duration_s: f64,
        show: &mut dyn FnMut(TwoMassPiece),
    ) -> TwoMassState {
        let MechanicsData { coulomb_friction_n_m: tc, breakaway_friction_n_m: ts, .. } = self.mechanics;
        let mut remaining_s = duration_s;
        let mut broke_away: Option<f64> = None;
        for _ in 0..PIECES_MAX {
            if broke_away.is_none() && self.sticks(&state, gravity_n_m) {
                let part = self.part(state, self.rates(&state, voltage_v, None), true, remaining_s);
                let leaves = part.time_to_leave(gravity_n_m, ts, remaining_s);
                let held_s = leaves.map_or(remaining_s, |(time_s, _)| time_s);
                show(TwoMassPiece { start: state, duration_s: held_s, dry_friction_n_m: None });
                state = part.after(held_s);
                let Some((_, side)) = leaves else { return state };
                remaining_s -= held_s;
                broke_away = Some(side);
                continue;
            }
            let drive_n_m = self.spring_n_m(&state) - gravity_n_m;
            let at_rest = state.load_speed_rad_s == 0.0;
            let side = broke_away.unwrap_or(if at_rest { drive_n_m } else { state.load_speed_rad_s });
            let friction_n_m = tc.copysign(side);
            let mut rates = self.rates(&state, voltage_v, Some(friction_n_m + gravity_n_m));
            if broke_away.take().is_some() {
                // At breakaway s - Tg = ±Ts by definition: where Ts = Tc the motion starts with exactly no acceleration.
                rates[LOAD] = (ts - tc).copysign(side) / self.mechanics.load_inertia_kg_m2;
            }
            let part = self.part(state, rates, false, remaining_s);
            let stop_s = if self.has_dry_friction { part.time_to_stop(1f64.copysign(side), remaining_s) } else { None };
            let run_s = stop_s.unwrap_or(remaining_s);
            show(TwoMassPiece { start: state, duration_s: run_s, dry_friction_n_m: Some(friction_n_m) });
            state = part.after(run_s);
            if stop_s.is_none() {
                return state;
            }
            state.load_speed_rad_s = 0.0;
            remaining_s -= run_s;
        }
        self.part(state, self.rates(&state, voltage_v, None), true, remaining_s).after(remaining_s)
    }

    /// One law from `start` on, for up to `limit_s`.
    fn part(&self, start: TwoMassState, rates: Vector, resting: bool, limit_s: f64) -> Part<'_> {
        let map = if resting { &self.resting } else { &self.moving };
        let course = Course::new(&map.slope, self.norm_per_s, rates, limit_s);
        Part { plant: self, start, rates, resting, course }
    }
}

/// One linear law, from `start` with the rates there.
struct Part<'a> {
    plant: &'a TwoMass,
    start: TwoMassState,
    rates: Vector,
    resting: bool,
    /// Of z.
    course: Course<'a, 4>,
}

impl Part<'_> {
    fn after(&self, time_s: f64) -> TwoMassState {
        self.plant.map(time_s, self.resting).apply(&self.start, &self.rates)
    }

    /// State, rates and their change after `time_s`; the load's angle plays no part.
    fn at(&self, time_s: f64) -> (TwoMassState, Vector, Vector) {
        let Instant { change, rates, bends } = self.course.at(time_s);
        let state = TwoMassState {
            current_a: self.start.current_a + change[0],
            motor_speed_rad_s: self.start.motor_speed_rad_s + change[MOTOR],
            twist_rad: self.start.twist_rad + change[TWIST],
            load_speed_rad_s: self.start.load_speed_rad_s + change[LOAD],
            load_angle_rad: self.start.load_angle_rad,
        };
        (state, rates, bends)
    }

    /// First instant in (0, `limit_s`] at which the load's speed comes down to 0; `side` is the sense of the motion.
    fn time_to_stop(&self, side: f64, limit_s: f64) -> Option<f64> {
        let speed = |time_s: f64| {
            let (state, rates, _) = self.at(time_s);
            (state.load_speed_rad_s * side, rates[LOAD] * side)
        };
        let turning = |sense: f64| {
            falling_zero(0.0, limit_s, |time_s| {
                let (_, rates, change) = self.at(time_s);
                (rates[LOAD] * side * sense, change[LOAD] * side * sense)
            })
        };
        let (end, end_rate) = speed(limit_s);
        let start_rate = self.rates[LOAD] * side;
        if end > 0.0 {
            // A minimum in between may lie below 0.
            if !(start_rate < 0.0 && end_rate > 0.0) {
                return None;
            }
            let lowest_s = turning(-1.0);
            return (speed(lowest_s).0 <= 0.0).then(|| falling_zero(0.0, lowest_s, speed));
        }
        if self.start.load_speed_rad_s != 0.0 {
            return Some(falling_zero(0.0, limit_s, speed));
        }
        // From rest there is a zero at the start, too: look behind the highest speed. Without one the motion has not begun.
        (start_rate >= 0.0 && end_rate < 0.0).then(|| falling_zero(turning(1.0), limit_s, speed))
    }

    /// When, within `limit_s`, the spring overcomes the breakaway torque of a load at rest, and in which sense.
    fn time_to_leave(&self, gravity_n_m: f64, breakaway_n_m: f64, limit_s: f64) -> Option<(f64, f64)> {
        // s - Tg with its first two derivatives.
        let drive = |time_s: f64| {
            let (state, rates, change) = self.at(time_s);
            let value = self.plant.spring_n_m(&state) - gravity_n_m;
            (value, self.plant.spring_rate_n_m_per_s(&rates), self.plant.spring_rate_n_m_per_s(&change))
        };
        let leaves = |by_s: f64, value: f64| {
            let side = 1f64.copysign(value);
            let time_s = falling_zero(0.0, by_s, |time_s| {
                let (value, rate, _) = drive(time_s);
                (breakaway_n_m - value * side, -rate * side)
            });
            (time_s, side)
        };
        let ((_, start_rate, _), (end, end_rate, _)) = (drive(0.0), drive(limit_s));
        if start_rate * end_rate < 0.0 {
            let sense = 1f64.copysign(start_rate);
            let turning_s = falling_zero(0.0, limit_s, |time_s| {
                let (_, rate, change) = drive(time_s);
                (rate * sense, change * sense)
            });
            let turned = drive(turning_s).0;
            if turned.abs() > breakaway_n_m {
                return Some(leaves(turning_s, turned));
            }
        }
        (end.abs() > breakaway_n_m).then(|| leaves(limit_s, end))
    }
}
