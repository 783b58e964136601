//! The cascade of one axis: the block diagram of models/drive.md section 1 as code, in the update order of section 4.
//!
//! In: one position set-point a position cycle. Out: [`AxisSignals`], every wire of the diagram. All controllers act without
//! computing delay on the state sampled at the start of the tick. Does not check its data (`machine` does), nor the set-point
//! against the limits of the axis: a set-point that is too fast saturates, is flagged, and recovers.

use super::backlash::Backlash;
use super::current_loop::{CurrentLoop, VoltageCommand};
use super::encoder::{MotorEncoder, PositionEncoder};
use super::feedforward::{Feedforward, Terms};
use super::jerk_filter::JerkFilter;
use super::monitor::{Monitor, View};
use super::pitch_error::PitchError;
use super::plant::{Plant, PlantState};
use super::position_loop::{PositionLoop, SpeedCommand};
use super::reversal::{Correction, Reversal};
use super::second_mass::{TwoMass, TwoMassState};
use super::speed_loop::{SpeedLoop, TorqueCommand};
use super::wire::{AxisSignals, Start, flags};
use crate::base::TimeBase;
use crate::machine::{Axis, PositionSource};

/// What a drive gets in one position cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveInput {
    /// x_set.
    pub position_setpoint_lu: f64,
    /// Text: outside torque at the motor shaft, counted like gravity.
    pub load_n_m: f64,
    /// FFWON; `false` sets both feed-forward weights to 0 for this cycle.
    pub feedforward_active: bool,
}

/// Drive, motor and mechanics of one axis. Holds all of its state: a clone is a snapshot.
#[derive(Clone, Debug)]
pub struct AxisDrive {
    pub(super) jerk_filter: JerkFilter,
    pub(super) feedforward: Feedforward,
    pub(super) reversal: Reversal,
    pub(super) position_encoder: PositionEncoder,
    pub(super) position_loop: PositionLoop,
    pub(super) motor_encoder: MotorEncoder,
    pub(super) speed_loop: SpeedLoop,
    pub(super) current_loop: CurrentLoop,
    pub(super) plant: Plant,
    /// i, w, th of the motor.
    pub(super) state: PlantState,
    /// The load behind a spring; boxed, as most axes have none.
    pub(super) second_mass: Option<Box<SecondMass>>,
    /// Boxed as the second mass is.
    pub(super) pitch_error: Option<Box<PitchError>>,
    pub(super) backlash: Option<Backlash>,
    pub(super) monitor: Monitor,
    /// MD31040 = 0: the position is that of the motor.
    motor_measures: bool,
    /// MD32640.
    pub(super) stiffness_control: bool,
    /// x_ref of the position cycle before.
    pub(super) reference_before_lu: f64,
    /// r.
    pub(super) transmission_lu_per_rad: f64,
    /// n_p = T_p / T_v.
    pub(super) speed_ticks: u32,
    /// T_p.
    pub(super) position_period_s: f64,
    /// n_v = T_v / T_i.
    pub(super) current_ticks: u32,
    /// Mean of the current over the last position cycle.
    pub(super) current_mean_a: f64,
}

/// Motor, spring and load, and their state.
#[derive(Clone, Debug)]
pub(super) struct SecondMass {
    plant: TwoMass,
    state: TwoMassState,
}

/// Wires around the position loop.
#[derive(Clone, Copy)]
pub(super) struct Position {
    /// x_ref.
    reference_lu: f64,
    /// x_meas.
    measured_lu: f64,
    pub(super) command: SpeedCommand,
}

/// What a position cycle begins with.
pub(super) struct Beginning {
    pub(super) terms: Terms,
    pub(super) correction: Correction,
    pub(super) position: Position,
    pub(super) view: View,
}

/// All wires at one tick, by the box that drives them.
pub(super) struct Wires {
    pub(super) input: DriveInput,
    pub(super) terms: Terms,
    pub(super) position: Position,
    pub(super) view: View,
    pub(super) torque: TorqueCommand,
    pub(super) gravity_n_m: f64,
    pub(super) voltage: VoltageCommand,
}

impl AxisDrive {
    /// The drive of `axis`, standing at `position_lu` (the first set-point); `None` for an axis without drive data.
    pub fn new(axis: &Axis, time_base: &TimeBase, start: Start, position_lu: f64) -> Option<Self> {
        let data = axis.drive.as_ref()?;
        let position_period_s = time_base.seconds(data.position_cycle_ticks);
        let speed_period_s = time_base.seconds(data.speed_cycle_ticks);
        let current_period_s = time_base.seconds(data.current_cycle_ticks);
        let transmission_lu_per_rad = data.mechanics.transmission_lu_per_rad;
        let plant = Plant::new(data, current_period_s);
        let pitch_error = PitchError::new(data).map(Box::new);
        // The axis measures the first set-point when it starts.
        let nominal_lu = pitch_error.as_ref().map_or(position_lu, |error| error.nominal_lu(position_lu));
        let angle_rad = nominal_lu / transmission_lu_per_rad;
        // Held: motor torque, both integrators and the current balance gravity. Cold: all of them are empty.
        let torque_n_m = match start {
            Start::Held => plant.gravity_n_m(angle_rad),
            Start::Cold => 0.0,
        };
        let current_a = torque_n_m / data.motor.torque_constant_n_m_per_a;
        let motor_measures = data.encoder.position_source == PositionSource::Motor;
        let second_mass = TwoMass::new(data, current_period_s).map(|plant| {
            let state = plant.held(torque_n_m, angle_rad, motor_measures);
            Box::new(SecondMass { plant, state })
        });
        let state = match &second_mass {
            Some(second) => second.state.motor(),
            None => PlantState { current_a, speed_rad_s: 0.0, angle_rad },
        };
        Some(Self {
            jerk_filter: JerkFilter::new(&data.options.jerk_filter, position_period_s, position_lu),
            feedforward: Feedforward::new(data, position_period_s, position_lu),
            reversal: Reversal::new(&data.options, position_period_s),
            position_encoder: PositionEncoder::new(data),
            position_loop: PositionLoop::new(data),
            motor_encoder: MotorEncoder::new(data, speed_period_s, state.angle_rad),
            speed_loop: SpeedLoop::new(data, speed_period_s, torque_n_m),
            current_loop: CurrentLoop::new(data, current_period_s, data.motor.resistance_ohm * current_a),
            plant,
            state,
            second_mass,
            backlash: Backlash::new(
                data.mechanics.backlash_lu,
                pitch_error.as_ref().map_or(position_lu, |error| error.load_lu(nominal_lu)),
            ),
            pitch_error,
            monitor: Monitor::new(data, position_period_s, position_lu),
            motor_measures,
            stiffness_control: data.options.stiffness_control,
            reference_before_lu: position_lu,
            transmission_lu_per_rad,
            speed_ticks: whole_ratio(data.position_cycle_ticks, data.speed_cycle_ticks),
            position_period_s,
            current_ticks: whole_ratio(data.speed_cycle_ticks, data.current_cycle_ticks),
            current_mean_a: current_a,
        })
    }

    /// One position cycle. Returns the signals at its first tick: the state before the plant step with the commands of that tick.
    pub fn step(&mut self, input: DriveInput) -> AxisSignals {
        if self.is_plain() {
            return self.step_plain(input);
        }
        let mut first = AxisSignals::default();
        self.cycle(input, |tick, drive, wires| {
            if tick == 0 {
                first = drive.signals(wires);
            }
        });
        first
    }

    /// One position cycle; `each` gets the number of the current tick within it, from 0, and the signals at that tick.
    pub fn step_each(&mut self, input: DriveInput, mut each: impl FnMut(u32, &AxisSignals)) {
        self.cycle(input, |tick, drive, wires| each(tick, &drive.signals(wires)));
    }

    /// The diagram, from left to right.
    #[inline(always)]
    fn cycle(&mut self, input: DriveInput, mut observe: impl FnMut(u32, &Self, &Wires)) {
        let Beginning { terms, correction, mut position, view } = self.begin(&input);
        let speed_period_s = self.position_period_s / f64::from(self.speed_ticks);

        let mut tick = 0;
        let mut current_sum_a = 0.0;
        for speed_tick in 0..self.speed_ticks {
            if self.stiffness_control {
                position = self.position_control(self.reference_lu(speed_tick, &terms), &terms, &correction);
                self.monitor.advance(position.reference_lu, terms.velocity_lu_s, speed_period_s);
            }
            let measured_rad_s = self.motor_encoder.measured_speed_rad_s(self.state);
            let speed_rad_s = position.command.motor_speed_rad_s;
            let torque = self.speed_loop.step(speed_rad_s, measured_rad_s, terms.torque_n_m);

            for _ in 0..self.current_ticks {
                let voltage = self.current_loop.step(torque.current_a - self.state.current_a);
                let gravity_n_m = self.plant.gravity_n_m(self.load_angle_rad()) + input.load_n_m;
                observe(tick, self, &Wires { input, terms, position, view, torque, gravity_n_m, voltage });
                current_sum_a += self.state.current_a;
                self.move_on(voltage.voltage_v, gravity_n_m);
                tick += 1;
            }
        }
        self.reference_before_lu = terms.reference_lu;
        self.current_mean_a = current_sum_a / f64::from(tick);
    }

    /// From now on the speed set-point goes from `velocity_lu_s` to 0 within `time_s`, whatever the position: as after an alarm.
    pub fn brake(&mut self, velocity_lu_s: f64, time_s: f64) {
        self.position_loop.brake(velocity_lu_s, time_s);
    }

    /// What stands before the speed loop: set-point preparation, position loop, monitoring.
    #[inline(always)]
    pub(super) fn begin(&mut self, input: &DriveInput) -> Beginning {
        self.position_loop.brake_on(self.position_period_s);
        let filtered_lu = self.jerk_filter.step(input.position_setpoint_lu);
        let terms = self.feedforward.terms(filtered_lu, input.feedforward_active);
        let correction = self.reversal.step(terms.set_velocity_lu_s);
        let position = self.position_control(terms.reference_lu, &terms, &correction);
        let view = self.monitor.watch(input.position_setpoint_lu, position.measured_lu, position.command.clamped);
        if !self.stiffness_control {
            self.monitor.advance(position.reference_lu, terms.velocity_lu_s, self.position_period_s);
        }
        Beginning { terms, correction, position, view }
    }

    /// Encoder, position loop and what is added to its output.
    #[inline(always)]
    fn position_control(&self, reference_lu: f64, terms: &Terms, correction: &Correction) -> Position {
        let from_lu = if self.motor_measures { self.motor_lu() } else { self.load_lu() };
        let mut measured_lu = self.position_encoder.measured_lu(from_lu) + correction.position_lu;
        if let Some(error) = &self.pitch_error {
            measured_lu += error.correction_lu(measured_lu);
        }
        let added_lu_s = terms.velocity_lu_s + correction.velocity_lu_s;
        Position { reference_lu, measured_lu, command: self.position_loop.step(reference_lu, measured_lu, added_lu_s) }
    }

    /// DSC: the reference on its way from that of the cycle before to that of this one, which it reaches in the last speed cycle.
    fn reference_lu(&self, speed_tick: u32, terms: &Terms) -> f64 {
        let left_ratio = f64::from(self.speed_ticks - 1 - speed_tick) / f64::from(self.speed_ticks);
        terms.reference_lu + left_ratio * (self.reference_before_lu - terms.reference_lu)
    }

    /// Motor and mechanics over one current cycle.
    #[inline(always)]
    fn move_on(&mut self, voltage_v: f64, gravity_n_m: f64) {
        match &mut self.second_mass {
            None => self.state = self.plant.step(self.state, voltage_v, gravity_n_m),
            Some(second) => {
                second.state = second.plant.step(second.state, voltage_v, gravity_n_m);
                self.state = second.state.motor();
            }
        }
        if self.backlash.is_some() {
            let before_play_lu = self.before_play_lu();
            if let Some(backlash) = &mut self.backlash {
                backlash.follow(before_play_lu);
            }
        }
    }

    /// Where the nut is, or the gear: behind spring and screw.
    #[inline(always)]
    fn before_play_lu(&self) -> f64 {
        let nominal_lu = self.transmission_lu_per_rad * self.load_angle_rad();
        match &self.pitch_error {
            None => nominal_lu,
            Some(error) => error.load_lu(nominal_lu),
        }
    }

    /// The load's angle at the motor shaft: behind the spring, if there is one.
    #[inline(always)]
    fn load_angle_rad(&self) -> f64 {
        match &self.second_mass {
            None => self.state.angle_rad,
            Some(second) => second.state.load_angle_rad,
        }
    }

    /// r th: the motor on the load side.
    #[inline(always)]
    fn motor_lu(&self) -> f64 {
        self.transmission_lu_per_rad * self.state.angle_rad
    }

    /// x: where the load is.
    #[inline(always)]
    fn load_lu(&self) -> f64 {
        match &self.backlash {
            Some(backlash) => backlash.load_lu(),
            None => self.before_play_lu(),
        }
    }

    /// False once the axis has diverged: a set-point that was not a number, or gains so high that the sampled loop is unstable
    /// and has left the range of f64. Every signal after that is NaN or infinite; nothing panics. The kernel raises an alarm.
    pub fn is_finite(&self) -> bool {
        let PlantState { current_a, speed_rad_s, angle_rad } = self.state;
        current_a.is_finite()
            && speed_rad_s.is_finite()
            && angle_rad.is_finite()
            && self.second_mass.as_ref().is_none_or(|second| second.state.is_finite())
            && self.speed_loop.is_finite()
            && self.current_loop.is_finite()
    }

    /// Motor and mechanics alone.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// State of motor, spring and load at the start of the next tick; `None` for a rigid axis.
    pub fn two_mass_state(&self) -> Option<TwoMassState> {
        self.second_mass.as_ref().map(|second| second.state)
    }

    /// i, w, th of the motor at the start of the next tick.
    pub fn state(&self) -> PlantState {
        self.state
    }

    /// Current ticks in a position cycle: calls of `each` in one [`AxisDrive::step_each`].
    pub fn ticks_per_step(&self) -> u32 {
        self.speed_ticks * self.current_ticks
    }

    /// The wires in the units of the load side.
    #[inline]
    pub(super) fn signals(&self, wires: &Wires) -> AxisSignals {
        let Wires { input, terms, position, view, torque, gravity_n_m, voltage } = wires;
        let (speed, position_lu) = (&position.command, self.load_lu());
        let (sticks, friction_torque_n_m, load_speed_rad_s) = match &self.second_mass {
            None => {
                let friction_n_m = self.plant.friction_n_m(self.state, *gravity_n_m);
                (self.plant.sticks(self.state, *gravity_n_m), friction_n_m, self.state.speed_rad_s)
            }
            Some(second) => {
                let friction_n_m = second.plant.friction_n_m(&second.state, *gravity_n_m);
                (second.plant.sticks(&second.state, *gravity_n_m), friction_n_m, second.state.load_speed_rad_s)
            }
        };
        let nominal_lu = self.transmission_lu_per_rad * self.load_angle_rad();
        let slope_ratio = self.pitch_error.as_ref().map_or(1.0, |error| error.velocity_ratio(nominal_lu));
        let bits = flags::of([speed.clamped, torque.clamped, voltage.clamped, sticks]);
        AxisSignals {
            position_setpoint_lu: input.position_setpoint_lu,
            position_reference_lu: position.reference_lu,
            position_actual_lu: position_lu,
            position_measured_lu: position.measured_lu,
            control_deviation_lu: speed.deviation_lu,
            following_error_lu: input.position_setpoint_lu - position_lu,
            velocity_command_lu_s: speed.velocity_lu_s,
            velocity_feedforward_lu_s: terms.velocity_lu_s,
            velocity_actual_lu_s: self.transmission_lu_per_rad * load_speed_rad_s * slope_ratio,
            motor_speed_reference_rad_s: speed.motor_speed_rad_s,
            motor_speed_rad_s: self.state.speed_rad_s,
            torque_reference_n_m: torque.torque_n_m,
            torque_feedforward_n_m: terms.torque_n_m,
            friction_torque_n_m,
            gravity_torque_n_m: *gravity_n_m,
            current_reference_a: torque.current_a,
            current_a: self.state.current_a,
            current_mean_a: self.current_mean_a,
            voltage_v: voltage.voltage_v,
            flags: bits,
            contour_deviation_lu: view.contour_deviation_lu,
            monitoring: view.bits,
        }
    }
}

/// Ratio of two cycles: whole and at least 1, which the checks of the machine file guarantee.
fn whole_ratio(longer_ticks: u64, shorter_ticks: u64) -> u32 {
    u32::try_from(longer_ticks / shorter_ticks.max(1)).unwrap_or(u32::MAX).max(1)
}
