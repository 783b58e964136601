//! Test machines of models/drive.md section 2, and a bench to run one axis on.

#[path = "../test_machine/mod.rs"]
pub mod test_machine;

use sollwert::base::TimeBase;
use sollwert::drive::{AxisDrive, AxisSignals, DriveInput, Start};
use sollwert::machine::{Axis, DriveData};
use test_machine::{shipped, with_axes};

/// Drive data with their clock.
#[derive(Clone, Debug)]
pub struct Rig {
    pub data: DriveData,
    pub time_base: TimeBase,
    pub start: Start,
}

/// A shipped axis: plain control without feed-forward and delays, its torque feed-forward that of "MVC850 X".
fn rig(machine: &str, axis: &str, sets: &[&str]) -> Rig {
    let machine = shipped(machine, sets);
    let axis = machine.axis_by_name(axis).expect("a shipped axis");
    let data = DriveData {
        velocity_feedforward_ratio: 0.0,
        feedforward_inertia_kg_m2: 0.0085,
        setpoint_delay_s: 0.0,
        feedforward_delay_s: 0.0,
        ..machine.axis(axis).drive.clone().expect("a shipped axis has a drive")
    };
    Rig { data, time_base: machine.cycle.time_base, start: Start::Held }
}

/// "MVC850 X": 1 ms, 125 µs, 62.5 µs.
pub fn mvc_x() -> Rig {
    rig("spinner_mvc850", "X", &[])
}

/// "MVC850 Y".
pub fn mvc_y() -> Rig {
    rig("spinner_mvc850", "Y", &[])
}

/// The cycles of the axis C would make the ticks shorter than the current cycle of the others.
const UCP_CYCLES: &[&str] = &[
    "cycle.t_cyl_ms=2",
    "axes.C.drive.position_cycle_ms=2",
    "axes.C.drive.speed_cycle_us=125",
    "axes.C.drive.current_cycle_us=125",
];

/// "UCP710 Z": 2 ms, 125 µs, 125 µs; vertical.
pub fn ucp_z() -> Rig {
    rig("mikron_ucp710", "Z", UCP_CYCLES)
}

/// "UCP710 A": a tilting table of gear ratio 120, positions in rad.
pub fn ucp_a() -> Rig {
    rig("mikron_ucp710", "A", UCP_CYCLES)
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
    Axis { drive, ..with_axes(&["X"], &[]).axes.remove(0) }
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
