//! Test machines of models/drive.md section 2, and a bench to run one axis on.

use sollwert::base::{AxisKind, TimeBase};
use sollwert::drive::{AxisDrive, AxisSignals, DriveInput, Start};
use sollwert::machine::{Axis, AxisLimits, DriveData, EncoderData, MechanicsData, MotorData};
use std::f64::consts::TAU;

/// Drive data with their clock.
#[derive(Clone, Debug)]
pub struct Rig {
    pub data: DriveData,
    pub time_base: TimeBase,
    pub start: Start,
}

/// "MVC850 X": 1 ms, 125 µs, 62.5 µs.
pub fn mvc_x() -> Rig {
    let data = DriveData {
        identified: false,
        in_position_coarse_lu: 0.04,
        in_position_fine_lu: 0.01,
        position_cycle_ticks: 16,
        speed_cycle_ticks: 2,
        current_cycle_ticks: 1,
        position_gain_per_s: 50.0,
        velocity_feedforward_ratio: 0.0,
        torque_feedforward_ratio: 0.0,
        feedforward_inertia_kg_m2: 0.0085,
        setpoint_delay_s: 0.0,
        feedforward_delay_s: 0.0,
        speed_setpoint_max_lu_s: 400.0,
        speed_gain_n_m_s_per_rad: 2.0,
        speed_reset_time_s: 0.010,
        current_gain_v_per_a: 22.0,
        current_reset_time_s: 0.002,
        current_max_a: 28.0,
        voltage_max_v: 245.0,
        motor: MotorData {
            resistance_ohm: 0.75,
            inductance_h: 6.5e-3,
            back_emf_v_s_per_rad: 0.43,
            torque_constant_n_m_per_a: 1.30,
        },
        mechanics: MechanicsData {
            transmission_lu_per_rad: 12.0 / TAU,
            inertia_kg_m2: 0.0085,
            viscous_friction_n_m_s_per_rad: 0.010,
            coulomb_friction_n_m: 0.6,
            breakaway_friction_n_m: 0.6,
            gravity_n_m: 0.0,
            gravity_sin_n_m: 0.0,
            gravity_cos_n_m: 0.0,
        },
        encoder: EncoderData { position_resolution_lu: 0.0, motor_resolution_rad: 0.0 },
    };
    Rig { data, time_base: TimeBase::new((1_000_000, 1), 16), start: Start::Held }
}

/// "MVC850 Y".
pub fn mvc_y() -> Rig {
    let mut rig = mvc_x();
    rig.data.speed_gain_n_m_s_per_rad = 2.2;
    rig.data.speed_reset_time_s = 0.011;
    rig.data.mechanics.inertia_kg_m2 = 0.0110;
    rig.data.mechanics.viscous_friction_n_m_s_per_rad = 0.012;
    rig.friction(1.2, 1.2)
}

/// "UCP710 Z": 2 ms, 125 µs, 125 µs; vertical.
pub fn ucp_z() -> Rig {
    let mut rig = mvc_x();
    rig.time_base = TimeBase::new((2_000_000, 1), 16);
    let data = &mut rig.data;
    (data.position_cycle_ticks, data.speed_cycle_ticks, data.current_cycle_ticks) = (16, 1, 1);
    data.speed_setpoint_max_lu_s = 550.0;
    data.speed_gain_n_m_s_per_rad = 2.8;
    data.speed_reset_time_s = 0.012;
    data.current_gain_v_per_a = 8.0;
    data.current_max_a = 45.0;
    data.motor = MotorData {
        resistance_ohm: 0.35,
        inductance_h: 3.6e-3,
        back_emf_v_s_per_rad: 0.50,
        torque_constant_n_m_per_a: 1.50,
    };
    data.mechanics.transmission_lu_per_rad = 20.0 / TAU;
    data.mechanics.inertia_kg_m2 = 0.0120;
    data.mechanics.gravity_n_m = 4.0;
    rig.friction(1.4, 1.4)
}

/// "UCP710 A": a tilting table of gear ratio 120, positions in rad.
pub fn ucp_a() -> Rig {
    let mut rig = ucp_z();
    let data = &mut rig.data;
    data.position_gain_per_s = 33.33;
    data.speed_setpoint_max_lu_s = 95_f64.to_radians();
    data.speed_gain_n_m_s_per_rad = 0.6;
    data.speed_reset_time_s = 0.015;
    data.current_gain_v_per_a = 20.0;
    data.current_reset_time_s = 0.003;
    data.current_max_a = 15.0;
    data.motor = MotorData {
        resistance_ohm: 1.1,
        inductance_h: 9.0e-3,
        back_emf_v_s_per_rad: 0.45,
        torque_constant_n_m_per_a: 1.35,
    };
    data.mechanics = MechanicsData {
        transmission_lu_per_rad: 1.0 / 120.0,
        inertia_kg_m2: 0.0032,
        viscous_friction_n_m_s_per_rad: 0.004,
        coulomb_friction_n_m: 0.7,
        breakaway_friction_n_m: 0.7,
        gravity_n_m: 0.0,
        gravity_sin_n_m: 1.1,
        gravity_cos_n_m: 0.25,
    };
    rig
}

/// The three sets of every closed form.
pub fn machines() -> [(&'static str, Rig); 3] {
    [("mvc x", mvc_x()), ("mvc y", mvc_y()), ("ucp a", ucp_a())]
}

/// Input without load, feed-forward on.
pub fn input(position_setpoint_lu: f64) -> DriveInput {
    DriveInput { position_setpoint_lu, load_n_m: 0.0, feedforward_active: true }
}

/// An axis around drive data (or none).
pub fn axis(drive: Option<DriveData>) -> Axis {
    Axis {
        name: "X".to_owned(),
        kind: AxisKind::Linear,
        index: 1,
        machine_axis: None,
        limits: AxisLimits {
            velocity_max_lu_s: 333.0,
            acceleration_max_lu_s2: 1000.0,
            jerk_max_lu_s3: 15_000.0,
            transition_jerk_max_lu_s3: 10_000.0,
        },
        follow_up_tolerance_lu: 0.01,
        travel_lu: None,
        home_lu: 0.0,
        modulo: false,
        dynamics: Default::default(),
        drive,
    }
}

impl Rig {
    /// Coulomb and breakaway torque.
    pub fn friction(mut self, coulomb_n_m: f64, breakaway_n_m: f64) -> Self {
        self.data.mechanics.coulomb_friction_n_m = coulomb_n_m;
        self.data.mechanics.breakaway_friction_n_m = breakaway_n_m;
        self
    }

    /// Any other change.
    pub fn with(mut self, change: impl FnOnce(&mut DriveData)) -> Self {
        change(&mut self.data);
        self
    }

    /// Empty integrators.
    pub fn cold(mut self) -> Self {
        self.start = Start::Cold;
        self
    }

    /// T_p.
    pub fn position_period_s(&self) -> f64 {
        self.time_base.seconds(self.data.position_cycle_ticks)
    }

    /// T_v.
    pub fn speed_period_s(&self) -> f64 {
        self.time_base.seconds(self.data.speed_cycle_ticks)
    }

    /// T_i.
    pub fn current_period_s(&self) -> f64 {
        self.time_base.seconds(self.data.current_cycle_ticks)
    }

    /// The drive at `position_lu`.
    pub fn drive(&self, position_lu: f64) -> AxisDrive {
        AxisDrive::new(&axis(Some(self.data.clone())), &self.time_base, self.start, position_lu)
            .expect("the rig has drive data")
    }

    /// Signals at every position tick.
    pub fn run(&self, inputs: impl IntoIterator<Item = DriveInput>) -> Vec<AxisSignals> {
        let mut inputs = inputs.into_iter().peekable();
        let first = inputs.peek().expect("at least one set-point");
        let mut drive = self.drive(first.position_setpoint_lu);
        inputs.map(|input| drive.step(input)).collect()
    }

    /// Signals at every position tick for x_set(t), `duration_s` long.
    pub fn follow(&self, duration_s: f64, setpoint_lu: impl Fn(f64) -> f64) -> Vec<AxisSignals> {
        let period_s = self.position_period_s();
        let count = (duration_s / period_s).round() as u32;
        self.run((0..=count).map(|k| input(setpoint_lu(f64::from(k) * period_s))))
    }

    /// Signals at every current tick.
    pub fn run_each(&self, inputs: impl IntoIterator<Item = DriveInput>) -> Vec<AxisSignals> {
        let mut inputs = inputs.into_iter().peekable();
        let first = inputs.peek().expect("at least one set-point");
        let mut drive = self.drive(first.position_setpoint_lu);
        let mut all = Vec::new();
        for input in inputs {
            drive.step_each(input, |_, signals| all.push(*signals));
        }
        all
    }
}

/// Seeded pseudo-random numbers (SplitMix64).
pub struct Random(pub u64);

impl Random {
    /// Uniform in [-1, 1).
    pub fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}
