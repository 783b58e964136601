//! What N plain axes do once in T_p behind their set-point boxes, side by side: position loop, monitoring, the signals of the first tick.
//!
//! In: what the set-point boxes of each axis give, its state. Out: what the inner loops hold for the position cycle, and [`AxisSignals`]. The laws
//! are those of the boxes, made of the numbers of each axis and taken apart again. Does not know who the axes are.

use super::current_loop::VoltageCommand;
use super::lanes::{Lanes, Laws, State};
use super::monitor::{Monitor, MonitorLaw};
use super::plain::Held;
use super::plant::Friction;
use super::position_loop::PositionLoop;
use super::wire::{AxisSignals, flags};

/// Constants.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct OuterLaws<const N: usize> {
    position_gain_per_s: Lanes<N>,
    velocity_max_lu_s: Lanes<N>,
    transmission_lu_per_rad: Lanes<N>,
    coulomb_n_m: Lanes<N>,
    breakaway_n_m: Lanes<N>,
    gravity_n_m: Lanes<N>,
    model_gain_per_s: Lanes<N>,
    model_velocity_max_lu_s: Lanes<N>,
    coarse_lu: Lanes<N>,
    fine_lu: Lanes<N>,
    contour_lu: Lanes<N>,
    speed_limit_time_s: Lanes<N>,
    positioning_time_s: Lanes<N>,
    standstill_delay_s: Lanes<N>,
    standstill_lu: Lanes<N>,
    period_s: Lanes<N>,
}

/// What is remembered from cycle to cycle.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct OuterMemory<const N: usize> {
    model_lu: Lanes<N>,
    setpoint_before_lu: Lanes<N>,
    rest_cycles: [u32; N],
    arrived: [u32; N],
    limited_cycles: [u32; N],
    /// i_avg.
    pub(super) current_mean_a: Lanes<N>,
}

/// What the set-point boxes give in a position cycle.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Given<const N: usize> {
    pub(super) setpoint_lu: Lanes<N>,
    pub(super) load_n_m: Lanes<N>,
    pub(super) reference_lu: Lanes<N>,
    pub(super) velocity_feedforward_lu_s: Lanes<N>,
    pub(super) torque_feedforward_n_m: Lanes<N>,
    /// Friction pulse.
    pub(super) velocity_added_lu_s: Lanes<N>,
    pub(super) measured_lu: Lanes<N>,
}

/// Wires of a position cycle behind those of [`Given`].
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct OuterWires<const N: usize> {
    deviation_lu: Lanes<N>,
    velocity_command_lu_s: Lanes<N>,
    pub(super) speed_reference_rad_s: Lanes<N>,
    speed_clamped: [u32; N],
    contour_deviation_lu: Lanes<N>,
    monitoring: [u32; N],
    pub(super) gravity_n_m: Lanes<N>,
}

/// Wires at the first tick.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct FirstTick<const N: usize> {
    torque_n_m: Lanes<N>,
    current_reference_a: Lanes<N>,
    voltage_v: Lanes<N>,
    position_lu: Lanes<N>,
    following_error_lu: Lanes<N>,
    velocity_lu_s: Lanes<N>,
    friction_n_m: Lanes<N>,
    flags: [u32; N],
}

/// The outer boxes of one axis.
#[derive(Clone, Debug)]
pub(super) struct OuterBoxes {
    pub(super) position_loop: PositionLoop,
    pub(super) monitor: Monitor,
    pub(super) friction: Friction,
    pub(super) gravity_n_m: f64,
}

impl<const N: usize> OuterLaws<N> {
    pub(super) fn new(boxes: &[&OuterBoxes; N]) -> Self {
        let of = |value: fn(&OuterBoxes) -> f64| boxes.map(value);
        Self {
            position_gain_per_s: of(|axis| axis.position_loop.gain_per_s),
            velocity_max_lu_s: of(|axis| axis.position_loop.velocity_max_lu_s),
            transmission_lu_per_rad: of(|axis| axis.position_loop.transmission_lu_per_rad),
            coulomb_n_m: of(|axis| axis.friction.coulomb_n_m),
            breakaway_n_m: of(|axis| axis.friction.breakaway_n_m),
            gravity_n_m: of(|axis| axis.gravity_n_m),
            model_gain_per_s: of(|axis| axis.monitor.law.gain_per_s),
            model_velocity_max_lu_s: of(|axis| axis.monitor.law.velocity_max_lu_s),
            coarse_lu: of(|axis| axis.monitor.law.coarse_lu),
            fine_lu: of(|axis| axis.monitor.law.fine_lu),
            contour_lu: of(|axis| axis.monitor.law.contour_lu),
            speed_limit_time_s: of(|axis| axis.monitor.law.speed_limit_time_s),
            positioning_time_s: of(|axis| axis.monitor.law.positioning_time_s),
            standstill_delay_s: of(|axis| axis.monitor.law.standstill_delay_s),
            standstill_lu: of(|axis| axis.monitor.law.standstill_lu),
            period_s: of(|axis| axis.monitor.law.period_s),
        }
    }

    #[inline(always)]
    fn position_loop(&self, lane: usize) -> PositionLoop {
        PositionLoop {
            gain_per_s: self.position_gain_per_s[lane],
            velocity_max_lu_s: self.velocity_max_lu_s[lane],
            transmission_lu_per_rad: self.transmission_lu_per_rad[lane],
            braking: None,
        }
    }

    /// r th.
    #[inline(always)]
    pub(super) fn position_lu(&self, lane: usize, angle_rad: f64) -> f64 {
        self.transmission_lu_per_rad[lane] * angle_rad
    }

    #[inline(always)]
    fn monitor_law(&self, lane: usize) -> MonitorLaw {
        MonitorLaw {
            gain_per_s: self.model_gain_per_s[lane],
            velocity_max_lu_s: self.model_velocity_max_lu_s[lane],
            coarse_lu: self.coarse_lu[lane],
            fine_lu: self.fine_lu[lane],
            contour_lu: self.contour_lu[lane],
            speed_limit_time_s: self.speed_limit_time_s[lane],
            positioning_time_s: self.positioning_time_s[lane],
            standstill_delay_s: self.standstill_delay_s[lane],
            standstill_lu: self.standstill_lu[lane],
            period_s: self.period_s[lane],
        }
    }
}

impl<const N: usize> OuterMemory<N> {
    pub(super) const fn empty() -> Self {
        Self {
            model_lu: [0.0; N],
            setpoint_before_lu: [0.0; N],
            rest_cycles: [0; N],
            arrived: [0; N],
            limited_cycles: [0; N],
            current_mean_a: [0.0; N],
        }
    }

    /// The monitor of one axis, as it stands.
    #[inline(always)]
    pub(super) fn monitor(&self, lane: usize, law: MonitorLaw) -> Monitor {
        Monitor {
            law,
            model_lu: self.model_lu[lane],
            setpoint_before_lu: self.setpoint_before_lu[lane],
            rest_cycles: self.rest_cycles[lane],
            arrived: self.arrived[lane] != 0,
            limited_cycles: self.limited_cycles[lane],
        }
    }

    /// Takes what a monitor remembers.
    #[inline(always)]
    pub(super) fn keep(&mut self, lane: usize, monitor: &Monitor) {
        self.model_lu[lane] = monitor.model_lu;
        self.setpoint_before_lu[lane] = monitor.setpoint_before_lu;
        self.rest_cycles[lane] = monitor.rest_cycles;
        self.arrived[lane] = u32::from(monitor.arrived);
        self.limited_cycles[lane] = monitor.limited_cycles;
    }
}

impl<const N: usize> Given<N> {
    pub(super) const fn empty() -> Self {
        Self {
            setpoint_lu: [0.0; N],
            load_n_m: [0.0; N],
            reference_lu: [0.0; N],
            velocity_feedforward_lu_s: [0.0; N],
            torque_feedforward_n_m: [0.0; N],
            velocity_added_lu_s: [0.0; N],
            measured_lu: [0.0; N],
        }
    }

    /// The lanes from `count` on get what the one before them has.
    #[inline]
    pub(super) fn fill(&mut self, count: usize) {
        let Some(last) = count.checked_sub(1) else { return };
        for lane in count..N {
            self.setpoint_lu[lane] = self.setpoint_lu[last];
            self.load_n_m[lane] = self.load_n_m[last];
            self.reference_lu[lane] = self.reference_lu[last];
            self.velocity_feedforward_lu_s[lane] = self.velocity_feedforward_lu_s[last];
            self.torque_feedforward_n_m[lane] = self.torque_feedforward_n_m[last];
            self.velocity_added_lu_s[lane] = self.velocity_added_lu_s[last];
            self.measured_lu[lane] = self.measured_lu[last];
        }
    }
}

impl<const N: usize> OuterWires<N> {
    pub(super) const fn empty() -> Self {
        Self {
            deviation_lu: [0.0; N],
            velocity_command_lu_s: [0.0; N],
            speed_reference_rad_s: [0.0; N],
            speed_clamped: [0; N],
            contour_deviation_lu: [0.0; N],
            monitoring: [0; N],
            gravity_n_m: [0.0; N],
        }
    }

    /// What an axis holds.
    #[inline(always)]
    pub(super) fn held(&self, lane: usize, given: &Given<N>) -> Held {
        Held {
            speed_reference_rad_s: self.speed_reference_rad_s[lane],
            torque_feedforward_n_m: given.torque_feedforward_n_m[lane],
            gravity_n_m: self.gravity_n_m[lane],
        }
    }
}

impl<const N: usize> FirstTick<N> {
    pub(super) const fn empty() -> Self {
        Self {
            torque_n_m: [0.0; N],
            current_reference_a: [0.0; N],
            voltage_v: [0.0; N],
            position_lu: [0.0; N],
            following_error_lu: [0.0; N],
            velocity_lu_s: [0.0; N],
            friction_n_m: [0.0; N],
            flags: [0; N],
        }
    }
}

/// Position loops and monitors.
#[inline(always)]
pub(super) fn outer_cycle<const N: usize>(
    laws: &OuterLaws<N>,
    given: &Given<N>,
    memory: &mut OuterMemory<N>,
    wires: &mut OuterWires<N>,
) {
    for lane in 0..N {
        let (reference_lu, measured_lu) = (given.reference_lu[lane], given.measured_lu[lane]);
        let feedforward_lu_s = given.velocity_feedforward_lu_s[lane];
        let added_lu_s = feedforward_lu_s + given.velocity_added_lu_s[lane];
        let command = laws.position_loop(lane).step(reference_lu, measured_lu, added_lu_s);
        let mut monitor = memory.monitor(lane, laws.monitor_law(lane));
        let view = monitor.watch(given.setpoint_lu[lane], measured_lu, command.clamped);
        monitor.advance(reference_lu, feedforward_lu_s, monitor.law.period_s);
        memory.keep(lane, &monitor);
        wires.deviation_lu[lane] = command.deviation_lu;
        wires.velocity_command_lu_s[lane] = command.velocity_lu_s;
        wires.speed_reference_rad_s[lane] = command.motor_speed_rad_s;
        wires.speed_clamped[lane] = u32::from(command.clamped);
        wires.contour_deviation_lu[lane] = view.contour_deviation_lu;
        wires.monitoring[lane] = view.bits;
        wires.gravity_n_m[lane] = laws.gravity_n_m[lane] + given.load_n_m[lane];
    }
}

/// What the inner loops will command in the first tick, and the state before it on the load side.
#[inline(always)]
pub(super) fn first_tick<const N: usize>(
    (outer, inner): (&OuterLaws<N>, &Laws<N>),
    (given, wires): (&Given<N>, &OuterWires<N>),
    state: &State<N>,
    first: &mut FirstTick<N>,
) {
    for lane in 0..N {
        let (held, plant) = (wires.held(lane, given), state.plant(lane));
        let mut speed_law = inner.speed.law(lane, state.speed_integral_n_m[lane]);
        let error_rad_s = held.speed_reference_rad_s - plant.speed_rad_s;
        let (torque_n_m, limited) = speed_law.step(error_rad_s, error_rad_s, held.torque_feedforward_n_m);
        let kt = inner.speed.torque_constant_n_m_per_a[lane];
        let reference_a = torque_n_m / kt;
        let mut current_loop = inner.current.law(lane, state.current_integral_v[lane]);
        let voltage: VoltageCommand = current_loop.step(reference_a - plant.current_a);
        let friction = Friction {
            torque_constant_n_m_per_a: kt,
            viscous_n_m_s_per_rad: inner.viscous_n_m_s_per_rad(lane),
            coulomb_n_m: outer.coulomb_n_m[lane],
            breakaway_n_m: outer.breakaway_n_m[lane],
        };
        let position_lu = outer.position_lu(lane, plant.angle_rad);
        first.torque_n_m[lane] = torque_n_m;
        first.current_reference_a[lane] = reference_a;
        first.voltage_v[lane] = voltage.voltage_v;
        first.position_lu[lane] = position_lu;
        first.following_error_lu[lane] = given.setpoint_lu[lane] - position_lu;
        first.velocity_lu_s[lane] = outer.transmission_lu_per_rad[lane] * plant.speed_rad_s;
        first.friction_n_m[lane] = friction.torque_n_m(plant, held.gravity_n_m);
        let sticks = friction.sticks(plant, held.gravity_n_m);
        first.flags[lane] = flags::of([wires.speed_clamped[lane] != 0, limited, voltage.clamped, sticks]);
    }
}

/// The signals of one axis.
#[inline(always)]
pub(super) fn signals<const N: usize>(
    lane: usize,
    (given, wires): (&Given<N>, &OuterWires<N>),
    (state, first): (&State<N>, &FirstTick<N>),
    memory: &OuterMemory<N>,
) -> AxisSignals {
    AxisSignals {
        position_setpoint_lu: given.setpoint_lu[lane],
        position_reference_lu: given.reference_lu[lane],
        position_actual_lu: first.position_lu[lane],
        position_measured_lu: given.measured_lu[lane],
        control_deviation_lu: wires.deviation_lu[lane],
        following_error_lu: first.following_error_lu[lane],
        velocity_command_lu_s: wires.velocity_command_lu_s[lane],
        velocity_feedforward_lu_s: given.velocity_feedforward_lu_s[lane],
        velocity_actual_lu_s: first.velocity_lu_s[lane],
        motor_speed_reference_rad_s: wires.speed_reference_rad_s[lane],
        motor_speed_rad_s: state.speed_rad_s[lane],
        torque_reference_n_m: first.torque_n_m[lane],
        torque_feedforward_n_m: given.torque_feedforward_n_m[lane],
        friction_torque_n_m: first.friction_n_m[lane],
        gravity_torque_n_m: wires.gravity_n_m[lane],
        current_reference_a: first.current_reference_a[lane],
        current_a: state.current_a[lane],
        current_mean_a: memory.current_mean_a[lane],
        voltage_v: first.voltage_v[lane],
        flags: first.flags[lane],
        contour_deviation_lu: wires.contour_deviation_lu[lane],
        monitoring: wires.monitoring[lane],
    }
}
