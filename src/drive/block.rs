//! The inner loops of up to N plain axes side by side, one array a wire, so that the processor takes several axes in one instruction.
//!
//! In: the plain parts of the axes; in every position cycle what each holds and remembers. Out: what each remembers at its end, to the last
//! bit what it would alone: the laws are those of the boxes, a box is made of the block's numbers for each axis and taken apart again,
//! which costs nothing. Compiled twice, for any x86-64 and for AVX2; which one runs is found when the program does, and no bit depends on it.
//!
//! The current cycles of a position cycle run as if every axis went on as it is: in motion in one direction, or at rest. Then it is asked
//! whether that was so ([`Watch`]); an axis that may have stopped, reversed, or broken away goes through them again alone, with the whole
//! [`Plant`]. Does not know position loops, signals or threads.

use super::current_loop::CurrentLoop;
use super::plain::{Cycles, Memory, PlainParts, Prepared};
use super::plant::{Plant, PlantState};
use super::speed_loop::SpeedLaw;
use super::transition::{Slopes, Transition};
use multiversion::multiversion;
use std::array::from_fn;

type Lanes<const N: usize> = [f64; N];

/// What keeps the product of two speeds from underflow.
const SLOWEST_RAD_S: f64 = 1e-150;
/// An axis in motion keeps its direction, and has no minimum of speed on the other side of 0, when it is faster than this times the bound of
/// `Plant` for the largest torque: the change of torque in a tick is at most twice that, the rest is for rounding.
const DIP_FACTOR: f64 = 2.5;

/// N axes, of which the last ones may be stand-ins (they do what the last true one does).
#[derive(Clone, Debug)]
pub(super) struct Block<const N: usize> {
    cycles: Cycles,
    count: usize,
    /// Constants as the boxes have them, for the ticks that need the whole plant.
    plants: [Plant; N],
    laws: Laws<N>,
    held: Held<N>,
    state: State<N>,
    /// 1 for an axis that may not have gone on as it was in the last position cycle.
    happened: Lanes<N>,
}

/// What does not change in a position cycle.
#[derive(Clone, Debug)]
struct Laws<const N: usize> {
    speed: SpeedColumns<N>,
    current: CurrentColumns<N>,
    motion: MotionColumns<N>,
    watch: Watch<N>,
}

/// Constants of the speed loops.
#[derive(Clone, Debug)]
struct SpeedColumns<const N: usize> {
    gain_n_m_s_per_rad: Lanes<N>,
    integral_gain_n_m_s_per_rad: Lanes<N>,
    torque_upper_n_m: Lanes<N>,
    torque_lower_n_m: Lanes<N>,
    torque_constant_n_m_per_a: Lanes<N>,
}

/// Constants of the current loops.
#[derive(Clone, Debug)]
struct CurrentColumns<const N: usize> {
    gain_v_per_a: Lanes<N>,
    integral_gain_v_per_a: Lanes<N>,
    voltage_max_v: Lanes<N>,
}

/// The plants over a tick: [`Slopes`] and [`Transition`]. At rest the current alone runs, which is a transition without the rest of it.
#[derive(Clone, Debug)]
struct MotionColumns<const N: usize> {
    resistance_ohm: Lanes<N>,
    back_emf_v_s_per_rad: Lanes<N>,
    viscous_friction_n_m_s_per_rad: Lanes<N>,
    current_by_voltage_a_per_v: Lanes<N>,
    current_by_torque_a_per_n_m: Lanes<N>,
    speed_by_voltage_rad_s_per_v: Lanes<N>,
    speed_by_torque_rad_s_per_n_m: Lanes<N>,
    angle_by_voltage_rad_per_v: Lanes<N>,
    angle_by_torque_rad_per_n_m: Lanes<N>,
    duration_s: Lanes<N>,
}

/// When an axis went on as it was: in motion, slowest speed >= `dip` x largest torque + `slowest`; at rest, largest torque <= `hold`.
#[derive(Clone, Debug)]
struct Watch<const N: usize> {
    /// 1 for an axis at rest, with dry friction; else 0.
    rest_share: Lanes<N>,
    dip_rad_s_per_n_m: Lanes<N>,
    slowest_rad_s: Lanes<N>,
    hold_n_m: Lanes<N>,
    coulomb_friction_n_m: Lanes<N>,
}

/// Wires that are held for a position cycle.
#[derive(Clone, Debug)]
struct Held<const N: usize> {
    speed_reference_rad_s: Lanes<N>,
    torque_feedforward_n_m: Lanes<N>,
    gravity_n_m: Lanes<N>,
}

/// What runs.
#[derive(Clone, Debug)]
struct State<const N: usize> {
    current_a: Lanes<N>,
    speed_rad_s: Lanes<N>,
    angle_rad: Lanes<N>,
    speed_integral_n_m: Lanes<N>,
    current_integral_v: Lanes<N>,
    /// Over the position cycle.
    current_sum_a: Lanes<N>,
}

impl<const N: usize> Block<N> {
    /// Of the first N of `parts`, which have the same cycles. `None` without any.
    pub(super) fn new(parts: &[PlainParts]) -> Option<Self> {
        let last = parts.len().checked_sub(1)?;
        let part: [&PlainParts; N] = from_fn(|lane| &parts[lane.min(last)]);
        let slopes = part.map(|part| Slopes::of(&part.plant.motor, &part.plant.mechanics));
        let nothing = [0.0; N];
        let mut block = Self {
            cycles: part.first()?.cycles,
            count: parts.len().min(N),
            plants: part.map(|part| part.plant),
            laws: Laws {
                speed: SpeedColumns {
                    gain_n_m_s_per_rad: part.map(|part| part.speed_law.gain_n_m_s_per_rad),
                    integral_gain_n_m_s_per_rad: part.map(|part| part.speed_law.integral_gain_n_m_s_per_rad),
                    torque_upper_n_m: part.map(|part| part.speed_law.torque_upper_n_m),
                    torque_lower_n_m: part.map(|part| part.speed_law.torque_lower_n_m),
                    torque_constant_n_m_per_a: slopes.map(|slopes| slopes.torque_constant_n_m_per_a),
                },
                current: CurrentColumns {
                    gain_v_per_a: part.map(|part| part.current_loop.gain_v_per_a),
                    integral_gain_v_per_a: part.map(|part| part.current_loop.integral_gain_v_per_a),
                    voltage_max_v: part.map(|part| part.current_loop.voltage_max_v),
                },
                motion: MotionColumns {
                    resistance_ohm: slopes.map(|slopes| slopes.resistance_ohm),
                    back_emf_v_s_per_rad: slopes.map(|slopes| slopes.back_emf_v_s_per_rad),
                    viscous_friction_n_m_s_per_rad: slopes.map(|slopes| slopes.viscous_friction_n_m_s_per_rad),
                    current_by_voltage_a_per_v: nothing,
                    current_by_torque_a_per_n_m: nothing,
                    speed_by_voltage_rad_s_per_v: nothing,
                    speed_by_torque_rad_s_per_n_m: nothing,
                    angle_by_voltage_rad_per_v: nothing,
                    angle_by_torque_rad_per_n_m: nothing,
                    duration_s: nothing,
                },
                watch: Watch {
                    rest_share: nothing,
                    dip_rad_s_per_n_m: nothing,
                    slowest_rad_s: nothing,
                    hold_n_m: nothing,
                    coulomb_friction_n_m: nothing,
                },
            },
            held: Held { speed_reference_rad_s: nothing, torque_feedforward_n_m: nothing, gravity_n_m: nothing },
            state: State {
                current_a: nothing,
                speed_rad_s: nothing,
                angle_rad: nothing,
                speed_integral_n_m: nothing,
                current_integral_v: nothing,
                current_sum_a: nothing,
            },
            happened: nothing,
        };
        for lane in 0..N {
            block.set_rest(lane, false);
        }
        Some(block)
    }

    /// The beginning of a position cycle for one axis.
    #[inline]
    pub(super) fn begin(&mut self, axis: usize, ready: &Prepared, memory: &Memory) {
        let stand_ins = if axis + 1 == self.count { N } else { axis + 1 };
        for lane in axis..stand_ins {
            self.held.speed_reference_rad_s[lane] = ready.position.command.motor_speed_rad_s;
            self.held.torque_feedforward_n_m[lane] = ready.terms.torque_n_m;
            self.held.gravity_n_m[lane] = ready.gravity_n_m;
            self.state.current_sum_a[lane] = 0.0;
            self.state.speed_integral_n_m[lane] = memory.speed_integral_n_m;
            self.state.current_integral_v[lane] = memory.current_integral_v;
            self.put(lane, memory.state);
        }
    }

    /// All current cycles of the position cycle.
    #[inline]
    pub(super) fn run(&mut self) {
        self.happened = run(&self.laws, &self.held, &mut self.state, self.cycles);
    }

    /// What an axis remembers, and the sum of its current over the current cycles. `None`: it has to go through them alone.
    #[inline]
    pub(super) fn end(&self, axis: usize) -> Option<(Memory, f64)> {
        let memory = Memory {
            state: self.state.plant(axis),
            speed_integral_n_m: self.state.speed_integral_n_m[axis],
            current_integral_v: self.state.current_integral_v[axis],
        };
        (self.happened[axis] == 0.0).then_some((memory, self.state.current_sum_a[axis]))
    }

    #[inline]
    fn put(&mut self, lane: usize, state: PlantState) {
        self.state.current_a[lane] = state.current_a;
        self.state.speed_rad_s[lane] = state.speed_rad_s;
        self.state.angle_rad[lane] = state.angle_rad;
        let rests = state.speed_rad_s == 0.0 && self.plants[lane].has_dry_friction;
        if rests != (self.laws.watch.rest_share[lane] > 0.0) {
            self.set_rest(lane, rests);
        }
    }

    /// What holds for an axis at rest, or in motion.
    fn set_rest(&mut self, lane: usize, rests: bool) {
        let plant = &self.plants[lane];
        let nothing = 0.0;
        let tick = if rests {
            Transition {
                duration_s: nothing,
                current_by_voltage_a_per_v: plant.rest_gain_a_per_v,
                current_by_torque_a_per_n_m: nothing,
                speed_by_voltage_rad_s_per_v: nothing,
                speed_by_torque_rad_s_per_n_m: nothing,
                angle_by_voltage_rad_per_v: nothing,
                angle_by_torque_rad_per_n_m: nothing,
            }
        } else {
            plant.tick
        };
        self.laws.motion.duration_s[lane] = tick.duration_s;
        self.laws.motion.current_by_voltage_a_per_v[lane] = tick.current_by_voltage_a_per_v;
        self.laws.motion.current_by_torque_a_per_n_m[lane] = tick.current_by_torque_a_per_n_m;
        self.laws.motion.speed_by_voltage_rad_s_per_v[lane] = tick.speed_by_voltage_rad_s_per_v;
        self.laws.motion.speed_by_torque_rad_s_per_n_m[lane] = tick.speed_by_torque_rad_s_per_n_m;
        self.laws.motion.angle_by_voltage_rad_per_v[lane] = tick.angle_by_voltage_rad_per_v;
        self.laws.motion.angle_by_torque_rad_per_n_m[lane] = tick.angle_by_torque_rad_per_n_m;
        let watch = &mut self.laws.watch;
        watch.rest_share[lane] = if rests { 1.0 } else { 0.0 };
        let dry_motion = plant.has_dry_friction && !rests;
        watch.dip_rad_s_per_n_m[lane] = if dry_motion { DIP_FACTOR * plant.dip_rad_s_per_n_m } else { 0.0 };
        // Without dry friction nothing can happen in a tick.
        watch.slowest_rad_s[lane] = if dry_motion { SLOWEST_RAD_S } else { f64::NEG_INFINITY };
        watch.hold_n_m[lane] = if rests { plant.mechanics.breakaway_friction_n_m } else { f64::INFINITY };
        watch.coulomb_friction_n_m[lane] = if rests { 0.0 } else { plant.mechanics.coulomb_friction_n_m };
    }
}

/// One position cycle, every axis going on as it is. Returns 1 for an axis that may not have.
#[multiversion(targets("x86_64+avx2"))]
fn run<const N: usize>(laws: &Laws<N>, held: &Held<N>, state: &mut State<N>, cycles: Cycles) -> Lanes<N> {
    let mut now = state.clone();
    let mut seen = Seen::new(laws, held, state);
    for _ in 0..cycles.speed_ticks {
        let current_reference_a = speed_control(laws, held, &mut now);
        for _ in 0..cycles.current_ticks {
            current_cycle(laws, &current_reference_a, &mut now, &mut seen);
        }
    }
    for lane in 0..N {
        // At rest nothing has moved; a sum with 0 would lose the sign of -0.
        let rests = laws.watch.rest_share[lane] > 0.0;
        now.speed_rad_s[lane] = if rests { state.speed_rad_s[lane] } else { now.speed_rad_s[lane] };
        now.angle_rad[lane] = if rests { state.angle_rad[lane] } else { now.angle_rad[lane] };
    }
    let happened = seen.happened(laws, &now);
    *state = now;
    happened
}

/// All speed controllers: i_ref.
#[allow(clippy::needless_range_loop, reason = "several arrays side by side, one lane each")]
#[inline(always)]
fn speed_control<const N: usize>(laws: &Laws<N>, held: &Held<N>, now: &mut State<N>) -> Lanes<N> {
    let mut current_reference_a = [0.0; N];
    for lane in 0..N {
        let speed = &laws.speed;
        let mut law = SpeedLaw {
            gain_n_m_s_per_rad: speed.gain_n_m_s_per_rad[lane],
            integral_gain_n_m_s_per_rad: speed.integral_gain_n_m_s_per_rad[lane],
            torque_upper_n_m: speed.torque_upper_n_m[lane],
            torque_lower_n_m: speed.torque_lower_n_m[lane],
            integral_n_m: now.speed_integral_n_m[lane],
        };
        let error_rad_s = held.speed_reference_rad_s[lane] - now.speed_rad_s[lane];
        let (torque_n_m, _) = law.step(error_rad_s, error_rad_s, held.torque_feedforward_n_m[lane]);
        now.speed_integral_n_m[lane] = law.integral_n_m;
        current_reference_a[lane] = torque_n_m / speed.torque_constant_n_m_per_a[lane];
    }
    current_reference_a
}

/// All current controllers and plants.
#[allow(clippy::needless_range_loop, reason = "several arrays side by side, one lane each")]
#[inline(always)]
fn current_cycle<const N: usize>(
    laws: &Laws<N>,
    current_reference_a: &Lanes<N>,
    now: &mut State<N>,
    seen: &mut Seen<N>,
) {
    for lane in 0..N {
        let mut law = laws.current.law(lane, now.current_integral_v[lane]);
        let before = now.plant(lane);
        let voltage_v = law.step(current_reference_a[lane] - before.current_a).voltage_v;
        now.current_integral_v[lane] = law.integral_v;
        now.current_sum_a[lane] += before.current_a;
        let excess = laws.slopes(lane).excess(before, voltage_v, seen.against_n_m[lane]);
        let after = laws.motion.tick(lane).apply(before, excess);
        seen.torque_max_n_m[lane] = larger(seen.torque_max_n_m[lane], excess.torque_n_m.abs());
        let along_rad_s = after.speed_rad_s * seen.side[lane];
        let slowest_rad_s = seen.slowest_rad_s[lane];
        seen.slowest_rad_s[lane] = if slowest_rad_s < along_rad_s { slowest_rad_s } else { along_rad_s };
        now.current_a[lane] = after.current_a;
        now.speed_rad_s[lane] = after.speed_rad_s;
        now.angle_rad[lane] = after.angle_rad;
    }
}

/// What is held, and what is seen, over a position cycle.
struct Seen<const N: usize> {
    /// +1 or -1: sense of the motion.
    side: Lanes<N>,
    /// Dry friction and gravity.
    against_n_m: Lanes<N>,
    torque_max_n_m: Lanes<N>,
    /// In the sense of the motion.
    slowest_rad_s: Lanes<N>,
}

impl<const N: usize> Seen<N> {
    #[inline(always)]
    fn new(laws: &Laws<N>, held: &Held<N>, state: &State<N>) -> Self {
        let watch = &laws.watch;
        // At rest the friction is 0, and not added: 0 would take the sign of -0 away.
        let against_n_m = from_fn(|lane| {
            let friction_n_m = watch.coulomb_friction_n_m[lane].copysign(state.speed_rad_s[lane]);
            let moving_n_m = friction_n_m + held.gravity_n_m[lane];
            if watch.rest_share[lane] > 0.0 { held.gravity_n_m[lane] } else { moving_n_m }
        });
        Self {
            side: from_fn(|lane| 1f64.copysign(state.speed_rad_s[lane])),
            against_n_m,
            torque_max_n_m: [0.0; N],
            slowest_rad_s: from_fn(|lane| state.speed_rad_s[lane].abs()),
        }
    }

    /// 1 for an axis that may not have gone on as it was.
    #[allow(clippy::needless_range_loop, reason = "several arrays side by side, one lane each")]
    #[inline(always)]
    fn happened(&self, laws: &Laws<N>, now: &State<N>) -> Lanes<N> {
        let mut happened = [0.0; N];
        for lane in 0..N {
            let (end, watch) = (now.plant(lane), &laws.watch);
            let torque_n_m = laws.slopes(lane).excess(end, 0.0, self.against_n_m[lane]).torque_n_m;
            let torque_n_m = larger(self.torque_max_n_m[lane], torque_n_m.abs());
            let enough_rad_s = watch.dip_rad_s_per_n_m[lane] * torque_n_m + watch.slowest_rad_s[lane];
            // The speed at the end is asked for by itself: a NaN stays in it.
            let goes_on = (self.slowest_rad_s[lane] >= enough_rad_s)
                & (end.speed_rad_s * self.side[lane] >= enough_rad_s)
                & (torque_n_m <= watch.hold_n_m[lane]);
            happened[lane] = if goes_on { 0.0 } else { 1.0 };
        }
        happened
    }
}

/// The larger of two, in the unit of both; NaN when the second is.
#[inline(always)]
fn larger(first: f64, second: f64) -> f64 {
    if first >= second { first } else { second }
}

impl<const N: usize> Laws<N> {
    #[inline(always)]
    fn slopes(&self, lane: usize) -> Slopes {
        Slopes {
            resistance_ohm: self.motion.resistance_ohm[lane],
            back_emf_v_s_per_rad: self.motion.back_emf_v_s_per_rad[lane],
            torque_constant_n_m_per_a: self.speed.torque_constant_n_m_per_a[lane],
            viscous_friction_n_m_s_per_rad: self.motion.viscous_friction_n_m_s_per_rad[lane],
        }
    }
}

impl<const N: usize> CurrentColumns<N> {
    #[inline(always)]
    fn law(&self, lane: usize, integral_v: f64) -> CurrentLoop {
        CurrentLoop {
            gain_v_per_a: self.gain_v_per_a[lane],
            integral_gain_v_per_a: self.integral_gain_v_per_a[lane],
            voltage_max_v: self.voltage_max_v[lane],
            integral_v,
        }
    }
}

impl<const N: usize> State<N> {
    #[inline(always)]
    fn plant(&self, lane: usize) -> PlantState {
        PlantState {
            current_a: self.current_a[lane],
            speed_rad_s: self.speed_rad_s[lane],
            angle_rad: self.angle_rad[lane],
        }
    }
}

impl<const N: usize> MotionColumns<N> {
    #[inline(always)]
    fn tick(&self, lane: usize) -> Transition {
        Transition {
            duration_s: self.duration_s[lane],
            current_by_voltage_a_per_v: self.current_by_voltage_a_per_v[lane],
            current_by_torque_a_per_n_m: self.current_by_torque_a_per_n_m[lane],
            speed_by_voltage_rad_s_per_v: self.speed_by_voltage_rad_s_per_v[lane],
            speed_by_torque_rad_s_per_n_m: self.speed_by_torque_rad_s_per_n_m[lane],
            angle_by_voltage_rad_per_v: self.angle_by_voltage_rad_per_v[lane],
            angle_by_torque_rad_per_n_m: self.angle_by_torque_rad_per_n_m[lane],
        }
    }
}
