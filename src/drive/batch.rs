//! Many drives in step, for studies and tuning: the two inner loops and the plant of eight axes at once.
//!
//! In: drives as [`AxisDrive::new`] makes them, one set-point each a position cycle. Out: the same signals, to the last bit, that each
//! drive would give alone. What is done once in T_p (set-point, position loop, signals) stays in the drive; speed loop, current loop and plant of
//! a [`Block`] of axes lie side by side, one array a wire, so that the compiler takes several axes in one instruction. The laws are those of
//! the boxes: a box is made of the block's numbers for each axis and taken apart again, which costs nothing.
//!
//! A tick in which an axis rests, stops or breaks away is left to its [`Plant`]. An axis with a filter around the speed loop, DSC, play, a
//! second mass, a screw error, a coarse motor encoder or gravity that turns goes alone. Knows no threads: a caller has several batches.

use super::axis_drive::{AxisDrive, DriveInput, PlainParts, Prepared};
use super::current_loop::{CurrentLoop, VoltageCommand};
use super::plant::{Plant, PlantState};
use super::speed_loop::{SpeedLaw, TorqueCommand};
use super::transition::Transition;
use super::wire::AxisSignals;

/// Axes in a block.
const LANES: usize = 8;
type Lanes = [f64; LANES];

/// Drives that are stepped together.
#[derive(Clone, Debug)]
pub struct DriveBatch {
    drives: Vec<AxisDrive>,
    blocks: Vec<Block>,
    /// Those that go alone, by place.
    alone: Vec<usize>,
}

/// The inner loops of up to eight axes with the same cycle ratios.
#[derive(Clone, Debug)]
struct Block {
    /// Their places in the batch.
    places: Vec<usize>,
    speed_ticks: u32,
    current_ticks: u32,
    /// Constants as the boxes have them, for the ticks that need the whole plant.
    plants: [Plant; LANES],
    speed_law: SpeedColumns,
    current_law: CurrentColumns,
    plant: PlantColumns,
    wires: WireColumns,
}

#[derive(Clone, Debug, Default)]
struct SpeedColumns {
    gain_n_m_s_per_rad: Lanes,
    integral_gain_n_m_s_per_rad: Lanes,
    torque_upper_n_m: Lanes,
    torque_lower_n_m: Lanes,
    integral_n_m: Lanes,
}

#[derive(Clone, Debug, Default)]
struct CurrentColumns {
    gain_v_per_a: Lanes,
    integral_gain_v_per_a: Lanes,
    voltage_max_v: Lanes,
    integral_v: Lanes,
}

#[derive(Clone, Debug, Default)]
struct PlantColumns {
    resistance_ohm: Lanes,
    back_emf_v_s_per_rad: Lanes,
    torque_constant_n_m_per_a: Lanes,
    viscous_friction_n_m_s_per_rad: Lanes,
    coulomb_friction_n_m: Lanes,
    /// 1 with dry friction, else 0.
    dry_share: Lanes,
    current_by_voltage_a_per_v: Lanes,
    current_by_torque_a_per_n_m: Lanes,
    speed_by_voltage_rad_s_per_v: Lanes,
    speed_by_torque_rad_s_per_n_m: Lanes,
    angle_by_voltage_rad_per_v: Lanes,
    angle_by_torque_rad_per_n_m: Lanes,
    duration_s: Lanes,
    dip_rad_s_per_n_m: Lanes,
}

/// Memories of the plant and wires that are held.
#[derive(Clone, Debug, Default)]
struct WireColumns {
    current_a: Lanes,
    speed_rad_s: Lanes,
    angle_rad: Lanes,
    speed_reference_rad_s: Lanes,
    torque_feedforward_n_m: Lanes,
    torque_n_m: Lanes,
    current_reference_a: Lanes,
    gravity_n_m: Lanes,
    voltage_v: Lanes,
    current_sum_a: Lanes,
    /// 1 where the torque limit holds, and where the voltage limit does.
    torque_clamped: Lanes,
    voltage_clamped: Lanes,
}

impl DriveBatch {
    /// Takes the drives; their order stays.
    pub fn new(drives: Vec<AxisDrive>) -> Self {
        let mut blocks: Vec<Block> = Vec::new();
        let mut alone = Vec::new();
        for (place, drive) in drives.iter().enumerate() {
            let Some(parts) = drive.plain_parts() else {
                alone.push(place);
                continue;
            };
            let fits = |block: &Block| {
                block.places.len() < LANES
                    && (block.speed_ticks, block.current_ticks) == (parts.speed_ticks, parts.current_ticks)
            };
            match blocks.iter_mut().find(|block| fits(block)) {
                Some(block) => block.add(place, &parts),
                None => blocks.push(Block::new(place, &parts)),
            }
        }
        Self { drives, blocks, alone }
    }

    /// The drives, as they stand.
    pub fn drives(&self) -> &[AxisDrive] {
        &self.drives
    }

    /// Takes them apart again.
    pub fn into_drives(self) -> Vec<AxisDrive> {
        self.drives
    }

    /// How many of them go together.
    pub fn together(&self) -> usize {
        self.drives.len() - self.alone.len()
    }

    /// One position cycle of every drive with its input (missing ones: the drive waits); `show` gets the place of a drive and its signals
    /// at the first tick, in no order that means anything.
    pub fn step(&mut self, inputs: &[DriveInput], mut show: impl FnMut(usize, &AxisSignals)) {
        for place in &self.alone {
            if let (Some(drive), Some(input)) = (self.drives.get_mut(*place), inputs.get(*place)) {
                show(*place, &drive.step(*input));
            }
        }
        for block in &mut self.blocks {
            if block.places.iter().all(|place| *place < inputs.len()) {
                block.step(&mut self.drives, inputs, &mut show);
            } else {
                for place in block.places.iter().filter(|place| **place < inputs.len()) {
                    show(*place, &self.drives[*place].step(inputs[*place]));
                }
            }
        }
    }
}

impl Block {
    fn new(place: usize, parts: &PlainParts) -> Self {
        let mut block = Self {
            places: Vec::with_capacity(LANES),
            speed_ticks: parts.speed_ticks,
            current_ticks: parts.current_ticks,
            plants: [parts.plant; LANES],
            speed_law: SpeedColumns::default(),
            current_law: CurrentColumns::default(),
            plant: PlantColumns::default(),
            wires: WireColumns::default(),
        };
        block.add(place, parts);
        block
    }

    fn add(&mut self, place: usize, parts: &PlainParts) {
        let lane = self.places.len();
        self.places.push(place);
        self.plants[lane] = parts.plant;
        self.speed_law.put(lane, &parts.speed_law);
        self.current_law.put(lane, &parts.current_loop);
        self.plant.put(lane, &parts.plant);
    }

    fn step(&mut self, drives: &mut [AxisDrive], inputs: &[DriveInput], show: &mut impl FnMut(usize, &AxisSignals)) {
        let mut prepared: [Option<Prepared>; LANES] = [None; LANES];
        for (lane, place) in self.places.iter().enumerate() {
            let drive = &mut drives[*place];
            let ready = drive.prepare(inputs[*place]);
            self.wires.speed_reference_rad_s[lane] = ready.position.command.motor_speed_rad_s;
            self.wires.torque_feedforward_n_m[lane] = ready.terms.torque_n_m;
            self.wires.gravity_n_m[lane] = ready.gravity_n_m;
            self.wires.current_sum_a[lane] = 0.0;
            prepared[lane] = Some(ready);
            let (state, speed_integral_n_m, current_integral_v) = drive.memories();
            self.wires.put_state(lane, state);
            self.speed_law.integral_n_m[lane] = speed_integral_n_m;
            self.current_law.integral_v[lane] = current_integral_v;
        }
        for speed_tick in 0..self.speed_ticks {
            self.speed_control();
            for current_tick in 0..self.current_ticks {
                self.current_control();
                if (speed_tick, current_tick) == (0, 0) {
                    for (lane, ready) in prepared.iter().enumerate() {
                        if let (Some(ready), Some(place)) = (ready, self.places.get(lane)) {
                            let (torque, voltage) = self.wires.commands(lane);
                            show(*place, &drives[*place].signals_of(ready, torque, voltage));
                        }
                    }
                }
                self.move_on();
            }
        }
        for (lane, (ready, place)) in prepared.iter().zip(&self.places).enumerate() {
            let memories =
                (self.wires.state(lane), self.speed_law.integral_n_m[lane], self.current_law.integral_v[lane]);
            if let Some(ready) = ready {
                drives[*place].finish(ready, memories, self.wires.current_sum_a[lane]);
            }
        }
    }

    /// All speed controllers.
    fn speed_control(&mut self) {
        let (wires, laws) = (&mut self.wires, &mut self.speed_law);
        for lane in 0..LANES {
            let mut law = laws.law(lane);
            let error_rad_s = wires.speed_reference_rad_s[lane] - wires.speed_rad_s[lane];
            let (torque_n_m, clamped) = law.step(error_rad_s, error_rad_s, wires.torque_feedforward_n_m[lane]);
            laws.integral_n_m[lane] = law.integral_n_m;
            wires.torque_n_m[lane] = torque_n_m;
            wires.torque_clamped[lane] = if clamped { 1.0 } else { 0.0 };
            wires.current_reference_a[lane] = torque_n_m / self.plant.torque_constant_n_m_per_a[lane];
        }
    }

    /// All current controllers.
    fn current_control(&mut self) {
        let (wires, laws) = (&mut self.wires, &mut self.current_law);
        for lane in 0..LANES {
            let mut law = laws.law(lane);
            let command = law.step(wires.current_reference_a[lane] - wires.current_a[lane]);
            laws.integral_v[lane] = law.integral_v;
            wires.voltage_v[lane] = command.voltage_v;
            wires.voltage_clamped[lane] = if command.clamped { 1.0 } else { 0.0 };
            wires.current_sum_a[lane] += wires.current_a[lane];
        }
    }

    /// All plants; where something happens, or an axis rests, the whole plant.
    fn move_on(&mut self) {
        let wires = &mut self.wires;
        let (mut current_a, mut speed_rad_s, mut angle_rad, mut happens) =
            ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let state = wires.state(lane);
            let plant = self.plant.plant(lane, &self.plants[lane]);
            let (after, usual) = plant.usual_step(state, wires.voltage_v[lane], wires.gravity_n_m[lane]);
            let rests = plant.has_dry_friction & (state.speed_rad_s == 0.0);
            happens[lane] = if usual & !rests { 0.0 } else { 1.0 };
            current_a[lane] = after.current_a;
            speed_rad_s[lane] = after.speed_rad_s;
            angle_rad[lane] = after.angle_rad;
        }
        if happens.iter().sum::<f64>() > 0.0 {
            for lane in (0..self.places.len()).filter(|lane| happens[*lane] > 0.0) {
                let after = self.plants[lane].step(wires.state(lane), wires.voltage_v[lane], wires.gravity_n_m[lane]);
                current_a[lane] = after.current_a;
                speed_rad_s[lane] = after.speed_rad_s;
                angle_rad[lane] = after.angle_rad;
            }
        }
        (wires.current_a, wires.speed_rad_s, wires.angle_rad) = (current_a, speed_rad_s, angle_rad);
    }
}

impl SpeedColumns {
    fn put(&mut self, lane: usize, law: &SpeedLaw) {
        self.gain_n_m_s_per_rad[lane] = law.gain_n_m_s_per_rad;
        self.integral_gain_n_m_s_per_rad[lane] = law.integral_gain_n_m_s_per_rad;
        self.torque_upper_n_m[lane] = law.torque_upper_n_m;
        self.torque_lower_n_m[lane] = law.torque_lower_n_m;
    }

    #[inline(always)]
    fn law(&self, lane: usize) -> SpeedLaw {
        SpeedLaw {
            gain_n_m_s_per_rad: self.gain_n_m_s_per_rad[lane],
            integral_gain_n_m_s_per_rad: self.integral_gain_n_m_s_per_rad[lane],
            torque_upper_n_m: self.torque_upper_n_m[lane],
            torque_lower_n_m: self.torque_lower_n_m[lane],
            integral_n_m: self.integral_n_m[lane],
        }
    }
}

impl CurrentColumns {
    fn put(&mut self, lane: usize, law: &CurrentLoop) {
        self.gain_v_per_a[lane] = law.gain_v_per_a;
        self.integral_gain_v_per_a[lane] = law.integral_gain_v_per_a;
        self.voltage_max_v[lane] = law.voltage_max_v;
    }

    #[inline(always)]
    fn law(&self, lane: usize) -> CurrentLoop {
        CurrentLoop {
            gain_v_per_a: self.gain_v_per_a[lane],
            integral_gain_v_per_a: self.integral_gain_v_per_a[lane],
            voltage_max_v: self.voltage_max_v[lane],
            integral_v: self.integral_v[lane],
        }
    }
}

impl PlantColumns {
    fn put(&mut self, lane: usize, plant: &Plant) {
        self.resistance_ohm[lane] = plant.motor.resistance_ohm;
        self.back_emf_v_s_per_rad[lane] = plant.motor.back_emf_v_s_per_rad;
        self.torque_constant_n_m_per_a[lane] = plant.motor.torque_constant_n_m_per_a;
        self.viscous_friction_n_m_s_per_rad[lane] = plant.mechanics.viscous_friction_n_m_s_per_rad;
        self.coulomb_friction_n_m[lane] = plant.mechanics.coulomb_friction_n_m;
        self.dry_share[lane] = if plant.has_dry_friction { 1.0 } else { 0.0 };
        self.dip_rad_s_per_n_m[lane] = plant.dip_rad_s_per_n_m;
        let tick = &plant.tick;
        self.duration_s[lane] = tick.duration_s;
        self.current_by_voltage_a_per_v[lane] = tick.current_by_voltage_a_per_v;
        self.current_by_torque_a_per_n_m[lane] = tick.current_by_torque_a_per_n_m;
        self.speed_by_voltage_rad_s_per_v[lane] = tick.speed_by_voltage_rad_s_per_v;
        self.speed_by_torque_rad_s_per_n_m[lane] = tick.speed_by_torque_rad_s_per_n_m;
        self.angle_by_voltage_rad_per_v[lane] = tick.angle_by_voltage_rad_per_v;
        self.angle_by_torque_rad_per_n_m[lane] = tick.angle_by_torque_rad_per_n_m;
    }

    /// The plant with the numbers that a tick in motion needs from the columns, all others from `whole`.
    #[inline(always)]
    fn plant(&self, lane: usize, whole: &Plant) -> Plant {
        let mut plant = *whole;
        plant.motor.resistance_ohm = self.resistance_ohm[lane];
        plant.motor.back_emf_v_s_per_rad = self.back_emf_v_s_per_rad[lane];
        plant.motor.torque_constant_n_m_per_a = self.torque_constant_n_m_per_a[lane];
        plant.mechanics.viscous_friction_n_m_s_per_rad = self.viscous_friction_n_m_s_per_rad[lane];
        plant.mechanics.coulomb_friction_n_m = self.coulomb_friction_n_m[lane];
        plant.has_dry_friction = self.dry_share[lane] > 0.0;
        plant.dip_rad_s_per_n_m = self.dip_rad_s_per_n_m[lane];
        plant.tick = Transition {
            duration_s: self.duration_s[lane],
            current_by_voltage_a_per_v: self.current_by_voltage_a_per_v[lane],
            current_by_torque_a_per_n_m: self.current_by_torque_a_per_n_m[lane],
            speed_by_voltage_rad_s_per_v: self.speed_by_voltage_rad_s_per_v[lane],
            speed_by_torque_rad_s_per_n_m: self.speed_by_torque_rad_s_per_n_m[lane],
            angle_by_voltage_rad_per_v: self.angle_by_voltage_rad_per_v[lane],
            angle_by_torque_rad_per_n_m: self.angle_by_torque_rad_per_n_m[lane],
        };
        plant
    }
}

impl WireColumns {
    fn put_state(&mut self, lane: usize, state: PlantState) {
        self.current_a[lane] = state.current_a;
        self.speed_rad_s[lane] = state.speed_rad_s;
        self.angle_rad[lane] = state.angle_rad;
    }

    #[inline(always)]
    fn state(&self, lane: usize) -> PlantState {
        PlantState {
            current_a: self.current_a[lane],
            speed_rad_s: self.speed_rad_s[lane],
            angle_rad: self.angle_rad[lane],
        }
    }

    /// Commands of this tick, as the boxes of one axis give them.
    fn commands(&self, lane: usize) -> (TorqueCommand, VoltageCommand) {
        let torque = TorqueCommand {
            torque_n_m: self.torque_n_m[lane],
            current_a: self.current_reference_a[lane],
            clamped: self.torque_clamped[lane] > 0.0,
        };
        (torque, VoltageCommand { voltage_v: self.voltage_v[lane], clamped: self.voltage_clamped[lane] > 0.0 })
    }
}
