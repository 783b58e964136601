//! The inner loops of N plain axes side by side, one array a wire, so that the processor takes several axes in one instruction.
//!
//! In: what each axis holds in a position cycle, and remembers. Out: what each remembers at its end. The laws are those of the boxes: a box is
//! made of the numbers of each axis and taken apart again, which costs nothing.
//!
//! The current cycles run as if every axis went on as it is: in motion in one direction, or at rest. Then it is asked whether that was so
//! ([`Watch`]); `block` takes care of an axis that may have stopped, reversed, or broken away.

use super::current_loop::CurrentLoop;
use super::outer_lanes::{Given, OuterWires};
use super::plain::{Cycles, Memory};
use super::plant::{Plant, PlantState};
use super::speed_loop::SpeedLaw;
use super::transition::{Slopes, Transition};

/// One number of each axis.
pub(super) type Lanes<const N: usize> = [f64; N];

/// What keeps the product of two speeds from underflow.
const SLOWEST_RAD_S: f64 = 1e-150;
/// An axis in motion keeps its direction, and has no minimum of speed on the other side of 0, when it is faster than this times the bound of
/// `Plant` for the largest torque: the change of torque in a tick is at most twice that, the rest is for rounding.
const DIP_FACTOR: f64 = 2.5;

/// What does not change in a position cycle.
#[derive(Clone, Debug)]
pub(super) struct Laws<const N: usize> {
    pub(super) speed: SpeedColumns<N>,
    pub(super) current: CurrentColumns<N>,
    motion: MotionColumns<N>,
    watch: Watch<N>,
}

/// Constants of the speed loops.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct SpeedColumns<const N: usize> {
    gain_n_m_s_per_rad: Lanes<N>,
    integral_gain_n_m_s_per_rad: Lanes<N>,
    torque_upper_n_m: Lanes<N>,
    torque_lower_n_m: Lanes<N>,
    pub(super) torque_constant_n_m_per_a: Lanes<N>,
}

/// Constants of the current loops.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct CurrentColumns<const N: usize> {
    gain_v_per_a: Lanes<N>,
    integral_gain_v_per_a: Lanes<N>,
    voltage_max_v: Lanes<N>,
}

/// The plants over a tick: [`Slopes`] and [`Transition`]. At rest the current alone runs, which is a transition without the rest of it.
#[derive(Clone, Debug)]
#[repr(align(64))]
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
#[repr(align(64))]
struct Watch<const N: usize> {
    /// 1 for an axis at rest, with dry friction; else 0.
    rest_share: Lanes<N>,
    dip_rad_s_per_n_m: Lanes<N>,
    slowest_rad_s: Lanes<N>,
    hold_n_m: Lanes<N>,
    coulomb_friction_n_m: Lanes<N>,
}

/// What runs.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct State<const N: usize> {
    pub(super) current_a: Lanes<N>,
    pub(super) speed_rad_s: Lanes<N>,
    pub(super) angle_rad: Lanes<N>,
    pub(super) speed_integral_n_m: Lanes<N>,
    pub(super) current_integral_v: Lanes<N>,
    /// Over the position cycle.
    pub(super) current_sum_a: Lanes<N>,
}

/// The inner boxes of one axis.
#[derive(Clone, Debug)]
pub(super) struct InnerBoxes {
    pub(super) speed_law: SpeedLaw,
    pub(super) current_loop: CurrentLoop,
    pub(super) plant: Plant,
}

impl<const N: usize> Laws<N> {
    pub(super) fn new(boxes: &[&InnerBoxes; N]) -> Self {
        let of = |value: fn(&InnerBoxes) -> f64| boxes.map(value);
        let slopes = boxes.map(|axis| Slopes::of(&axis.plant.motor, &axis.plant.mechanics));
        let nothing = [0.0; N];
        let mut laws = Self {
            speed: SpeedColumns {
                gain_n_m_s_per_rad: of(|axis| axis.speed_law.gain_n_m_s_per_rad),
                integral_gain_n_m_s_per_rad: of(|axis| axis.speed_law.integral_gain_n_m_s_per_rad),
                torque_upper_n_m: of(|axis| axis.speed_law.torque_upper_n_m),
                torque_lower_n_m: of(|axis| axis.speed_law.torque_lower_n_m),
                torque_constant_n_m_per_a: slopes.map(|slopes| slopes.torque_constant_n_m_per_a),
            },
            current: CurrentColumns {
                gain_v_per_a: of(|axis| axis.current_loop.gain_v_per_a),
                integral_gain_v_per_a: of(|axis| axis.current_loop.integral_gain_v_per_a),
                voltage_max_v: of(|axis| axis.current_loop.voltage_max_v),
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
        };
        for (lane, axis) in boxes.iter().enumerate() {
            laws.set_rest(lane, &axis.plant, false);
        }
        laws
    }

    /// B.
    #[inline(always)]
    pub(super) fn viscous_n_m_s_per_rad(&self, lane: usize) -> f64 {
        self.motion.viscous_friction_n_m_s_per_rad[lane]
    }

    /// The axis is in this state now: in motion or at rest.
    #[inline]
    pub(super) fn stands(&mut self, lane: usize, plant: &Plant, state: PlantState) {
        let rests = state.speed_rad_s == 0.0 && plant.has_dry_friction;
        if rests != (self.watch.rest_share[lane] > 0.0) {
            self.set_rest(lane, plant, rests);
        }
    }

    /// What holds for an axis at rest, or in motion.
    fn set_rest(&mut self, lane: usize, plant: &Plant, rests: bool) {
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
        self.motion.duration_s[lane] = tick.duration_s;
        self.motion.current_by_voltage_a_per_v[lane] = tick.current_by_voltage_a_per_v;
        self.motion.current_by_torque_a_per_n_m[lane] = tick.current_by_torque_a_per_n_m;
        self.motion.speed_by_voltage_rad_s_per_v[lane] = tick.speed_by_voltage_rad_s_per_v;
        self.motion.speed_by_torque_rad_s_per_n_m[lane] = tick.speed_by_torque_rad_s_per_n_m;
        self.motion.angle_by_voltage_rad_per_v[lane] = tick.angle_by_voltage_rad_per_v;
        self.motion.angle_by_torque_rad_per_n_m[lane] = tick.angle_by_torque_rad_per_n_m;
        let watch = &mut self.watch;
        watch.rest_share[lane] = if rests { 1.0 } else { 0.0 };
        let dry_motion = plant.has_dry_friction && !rests;
        watch.dip_rad_s_per_n_m[lane] = if dry_motion { DIP_FACTOR * plant.dip_rad_s_per_n_m } else { 0.0 };
        // Without dry friction nothing can happen in a tick.
        watch.slowest_rad_s[lane] = if dry_motion { SLOWEST_RAD_S } else { f64::NEG_INFINITY };
        watch.hold_n_m[lane] = if rests { plant.mechanics.breakaway_friction_n_m } else { f64::INFINITY };
        watch.coulomb_friction_n_m[lane] = if rests { 0.0 } else { plant.mechanics.coulomb_friction_n_m };
    }

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

/// One position cycle, every axis going on as it is. Returns 1 for an axis that may not have.
#[inline(always)]
pub(super) fn inner_cycle<const N: usize>(
    laws: &Laws<N>,
    (given, wires): (&Given<N>, &OuterWires<N>),
    state: &mut State<N>,
    cycles: Cycles,
) -> Lanes<N> {
    let mut now = state.clone();
    now.current_sum_a = [0.0; N];
    let mut seen = Seen::new(laws, wires, state);
    for _ in 0..cycles.speed_ticks {
        let current_reference_a = speed_control(laws, (given, wires), &mut now);
        // The usual numbers without a loop.
        match cycles.current_ticks {
            2 => current_cycles::<N, 2>(laws, &current_reference_a, &mut now, &mut seen),
            4 => current_cycles::<N, 4>(laws, &current_reference_a, &mut now, &mut seen),
            ticks => {
                for _ in 0..ticks {
                    current_cycle(laws, &current_reference_a, &mut now, &mut seen);
                }
            }
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
fn speed_control<const N: usize>(
    laws: &Laws<N>,
    (given, wires): (&Given<N>, &OuterWires<N>),
    now: &mut State<N>,
) -> Lanes<N> {
    let mut current_reference_a = [0.0; N];
    for lane in 0..N {
        let mut law = laws.speed.law(lane, now.speed_integral_n_m[lane]);
        let error_rad_s = wires.speed_reference_rad_s[lane] - now.speed_rad_s[lane];
        let (torque_n_m, _) = law.step(error_rad_s, error_rad_s, given.torque_feedforward_n_m[lane]);
        now.speed_integral_n_m[lane] = law.integral_n_m;
        current_reference_a[lane] = torque_n_m / laws.speed.torque_constant_n_m_per_a[lane];
    }
    current_reference_a
}

/// A known number of current cycles.
#[inline(always)]
fn current_cycles<const N: usize, const TICKS: usize>(
    laws: &Laws<N>,
    current_reference_a: &Lanes<N>,
    now: &mut State<N>,
    seen: &mut Seen<N>,
) {
    for _ in 0..TICKS {
        current_cycle(laws, current_reference_a, now, seen);
    }
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
        // A NaN is passed over: it stays in the state, and is seen at the end.
        let (torque_n_m, torque_max_n_m) = (excess.torque_n_m.abs(), seen.torque_max_n_m[lane]);
        seen.torque_max_n_m[lane] = if torque_n_m > torque_max_n_m { torque_n_m } else { torque_max_n_m };
        let along_rad_s = after.speed_rad_s * seen.side[lane];
        let slowest_rad_s = seen.slowest_rad_s[lane];
        seen.slowest_rad_s[lane] = if slowest_rad_s < along_rad_s { slowest_rad_s } else { along_rad_s };
        now.current_a[lane] = after.current_a;
        now.speed_rad_s[lane] = after.speed_rad_s;
        now.angle_rad[lane] = after.angle_rad;
    }
}

/// What is held, and what is seen, over a position cycle.
#[repr(align(64))]
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
    #[allow(clippy::needless_range_loop, reason = "several arrays side by side, one lane each")]
    #[inline(always)]
    fn new(laws: &Laws<N>, wires: &OuterWires<N>, state: &State<N>) -> Self {
        let watch = &laws.watch;
        let none = [0.0; N];
        let mut seen = Self { side: none, against_n_m: none, torque_max_n_m: none, slowest_rad_s: none };
        for lane in 0..N {
            let (w, gravity_n_m) = (state.speed_rad_s[lane], wires.gravity_n_m[lane]);
            // At rest the friction is 0, and not added: 0 would take the sign of -0 away.
            let moving_n_m = watch.coulomb_friction_n_m[lane].copysign(w) + gravity_n_m;
            seen.against_n_m[lane] = if watch.rest_share[lane] > 0.0 { gravity_n_m } else { moving_n_m };
            seen.side[lane] = 1f64.copysign(w);
            seen.slowest_rad_s[lane] = w.abs();
        }
        seen
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

impl<const N: usize> SpeedColumns<N> {
    #[inline(always)]
    pub(super) fn law(&self, lane: usize, integral_n_m: f64) -> SpeedLaw {
        SpeedLaw {
            gain_n_m_s_per_rad: self.gain_n_m_s_per_rad[lane],
            integral_gain_n_m_s_per_rad: self.integral_gain_n_m_s_per_rad[lane],
            torque_upper_n_m: self.torque_upper_n_m[lane],
            torque_lower_n_m: self.torque_lower_n_m[lane],
            integral_n_m,
        }
    }
}

impl<const N: usize> CurrentColumns<N> {
    #[inline(always)]
    pub(super) fn law(&self, lane: usize, integral_v: f64) -> CurrentLoop {
        CurrentLoop {
            gain_v_per_a: self.gain_v_per_a[lane],
            integral_gain_v_per_a: self.integral_gain_v_per_a[lane],
            voltage_max_v: self.voltage_max_v[lane],
            integral_v,
        }
    }
}

impl<const N: usize> State<N> {
    pub(super) const fn empty() -> Self {
        Self {
            current_a: [0.0; N],
            speed_rad_s: [0.0; N],
            angle_rad: [0.0; N],
            speed_integral_n_m: [0.0; N],
            current_integral_v: [0.0; N],
            current_sum_a: [0.0; N],
        }
    }

    /// i, w, th of one axis.
    #[inline(always)]
    pub(super) fn plant(&self, lane: usize) -> PlantState {
        PlantState {
            current_a: self.current_a[lane],
            speed_rad_s: self.speed_rad_s[lane],
            angle_rad: self.angle_rad[lane],
        }
    }

    /// All that one axis remembers.
    pub(super) fn memory(&self, lane: usize) -> Memory {
        Memory {
            state: self.plant(lane),
            speed_integral_n_m: self.speed_integral_n_m[lane],
            current_integral_v: self.current_integral_v[lane],
            current_sum_a: self.current_sum_a[lane],
        }
    }

    /// Takes what one axis remembers.
    pub(super) fn keep(&mut self, lane: usize, memory: &Memory) {
        let Memory { state, speed_integral_n_m, current_integral_v, current_sum_a } = *memory;
        self.current_a[lane] = state.current_a;
        self.speed_rad_s[lane] = state.speed_rad_s;
        self.angle_rad[lane] = state.angle_rad;
        self.speed_integral_n_m[lane] = speed_integral_n_m;
        self.current_integral_v[lane] = current_integral_v;
        self.current_sum_a[lane] = current_sum_a;
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
