//! Up to N plain axes that step together: who they are, and what is done with one of them alone.
//!
//! In: drives; in every position cycle a set-point of each. Out: the signals of each, and at the end the drives again, all to the last bit what they
//! would be alone. While the axes are together, what they remember lies in arrays, one a wire ([`Columns`]), and nothing is copied from
//! cycle to cycle; [`Block::give_back`] brings it home. `outer_lanes` and `lanes` are the laws, side by side; the boxes between set-point and position
//! loop, which have memories of many shapes, work axis by axis.
//!
//! Compiled for any processor, for AVX2 and for AVX-512 ([`Instructions`]); which one runs is found when the program does, and no bit depends on it.

use super::axis_drive::{AxisDrive, DriveInput};
use super::encoder::PositionEncoder;
use super::feedforward::Feedforward;
use super::jerk_filter::JerkFilter;
use super::lanes::{InnerBoxes, Lanes, Laws, State, inner_cycle};
use super::outer_lanes::{FirstTick, Given, OuterBoxes, OuterLaws, OuterMemory, OuterWires};
use super::outer_lanes::{first_tick, outer_cycle, signals};
use super::plain::{Cycles, Inner};
use super::plant::Plant;
use super::reversal::Reversal;
use super::wire::AxisSignals;
use multiversion::multiversion;
use std::array::from_fn;
use std::mem::swap;

/// N axes, of which the last ones may be stand-ins (they do what the last true one does).
#[derive(Clone, Debug)]
pub(super) struct Block<const N: usize> {
    cycles: Cycles,
    /// Of the true axes.
    setpoint_boxes: Vec<SetpointBoxes>,
    /// For the ticks that need the whole plant.
    plants: [Plant; N],
    columns: Columns<N>,
    /// The columns and boxes hold what the axes remember, and not the drives.
    holds: bool,
    instructions: Instructions,
}

/// What a block may use of the processor. A fused multiply-add is in none of them: it rounds once where two instructions round twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instructions {
    /// All that is compiled for and that there is.
    Widest,
    /// AVX2, where there is that.
    Avx2,
    /// What every x86-64 has.
    Any,
}

/// The boxes in front of the position loop; those of a drive and of a block are swapped.
#[derive(Clone, Debug)]
struct SetpointBoxes {
    jerk_filter: JerkFilter,
    feedforward: Feedforward,
    reversal: Reversal,
    position_encoder: PositionEncoder,
}

/// All numbers of the axes.
#[derive(Clone, Debug)]
struct Columns<const N: usize> {
    outer: OuterLaws<N>,
    inner: Laws<N>,
    memory: OuterMemory<N>,
    given: Given<N>,
    wires: OuterWires<N>,
    state: State<N>,
    /// The state at the beginning of the position cycle.
    before: State<N>,
    first: FirstTick<N>,
    /// 1 for an axis that may not have gone on as it was in the last position cycle.
    happened: Lanes<N>,
}

impl<const N: usize> Block<N> {
    /// For the first N of `drives`, which are plain and have the same cycles. `None` without any.
    pub(super) fn new(drives: &[&AxisDrive]) -> Option<Self> {
        let last = drives.len().checked_sub(1)?;
        let drive: [&AxisDrive; N] = from_fn(|lane| drives[lane.min(last)]);
        let outer = drive.map(outer_boxes);
        let inner = drive.map(inner_boxes);
        Some(Self {
            cycles: drive.first()?.cycles(),
            setpoint_boxes: drives.iter().take(N).map(|drive| SetpointBoxes::of(drive)).collect(),
            plants: drive.map(|drive| drive.plant),
            columns: Columns {
                outer: OuterLaws::new(&from_fn(|lane| &outer[lane])),
                inner: Laws::new(&from_fn(|lane| &inner[lane])),
                memory: OuterMemory::empty(),
                given: Given::empty(),
                wires: OuterWires::empty(),
                state: State::empty(),
                before: State::empty(),
                first: FirstTick::empty(),
                happened: [0.0; N],
            },
            holds: false,
            instructions: Instructions::Widest,
        })
    }

    /// From now on with these instructions.
    pub(super) fn only_with(&mut self, instructions: Instructions) {
        self.instructions = instructions;
    }

    /// Whether the drives are out of date.
    pub(super) fn holds(&self) -> bool {
        self.holds
    }

    /// Takes over what the drive of an axis remembers. To be called for all of them.
    pub(super) fn take(&mut self, axis: usize, drive: &mut AxisDrive) {
        self.swap(axis, drive);
        for lane in self.lanes(axis) {
            let columns = &mut self.columns;
            columns.memory.keep(lane, &drive.monitor);
            columns.memory.current_mean_a[lane] = drive.current_mean_a;
            columns.state.keep(lane, &drive.memory());
            columns.inner.stands(lane, &self.plants[lane], drive.state);
        }
        self.holds = true;
    }

    /// Gives back to the drive of an axis what it remembers. To be called for all of them.
    pub(super) fn give_back(&mut self, axis: usize, drive: &mut AxisDrive) {
        self.swap(axis, drive);
        let columns = &self.columns;
        drive.monitor = columns.memory.monitor(axis, drive.monitor.law);
        drive.remember(&columns.state.memory(axis));
        drive.current_mean_a = columns.memory.current_mean_a[axis];
        drive.reference_before_lu = columns.given.reference_lu[axis];
        self.holds = false;
    }

    fn swap(&mut self, axis: usize, drive: &mut AxisDrive) {
        if let Some(boxes) = self.setpoint_boxes.get_mut(axis) {
            swap(&mut boxes.jerk_filter, &mut drive.jerk_filter);
            swap(&mut boxes.feedforward, &mut drive.feedforward);
            swap(&mut boxes.reversal, &mut drive.reversal);
        }
    }

    /// An axis and its stand-ins.
    fn lanes(&self, axis: usize) -> std::ops::Range<usize> {
        axis..if axis + 1 == self.setpoint_boxes.len() { N } else { axis + 1 }
    }

    /// The beginning of a position cycle for one axis: its set-point boxes and encoder.
    #[inline]
    pub(super) fn begin(&mut self, axis: usize, input: &DriveInput) {
        let Some(boxes) = self.setpoint_boxes.get_mut(axis) else { return };
        let filtered_lu = boxes.jerk_filter.step(input.position_setpoint_lu);
        let terms = boxes.feedforward.terms(filtered_lu, input.feedforward_active);
        let correction = boxes.reversal.step(terms.set_velocity_lu_s);
        let position_lu = self.columns.outer.position_lu(axis, self.columns.state.angle_rad[axis]);
        let measured_lu = boxes.position_encoder.measured_lu(position_lu) + correction.position_lu;
        let given = &mut self.columns.given;
        given.setpoint_lu[axis] = input.position_setpoint_lu;
        given.load_n_m[axis] = input.load_n_m;
        given.reference_lu[axis] = terms.reference_lu;
        given.velocity_feedforward_lu_s[axis] = terms.velocity_lu_s;
        given.torque_feedforward_n_m[axis] = terms.torque_n_m;
        given.velocity_added_lu_s[axis] = correction.velocity_lu_s;
        given.measured_lu[axis] = measured_lu;
    }

    /// All the rest of the position cycle; `show` gets the number of an axis and its signals at the first tick.
    #[inline]
    pub(super) fn step(&mut self, mut show: impl FnMut(usize, &AxisSignals)) {
        let count = self.setpoint_boxes.len();
        self.columns.given.fill(count);
        match self.instructions {
            // One register of AVX-512 full of axes is slower than two of AVX2: while the one is at work nothing else is there to do.
            Instructions::Widest if N > 8 => cycle(&mut self.columns, self.cycles),
            Instructions::Widest | Instructions::Avx2 => cycle_up_to_avx2(&mut self.columns, self.cycles),
            Instructions::Any => cycle_on_any(&mut self.columns, self.cycles),
        }
        let columns = &self.columns;
        for axis in 0..count {
            let wires = (&columns.given, &columns.wires);
            show(axis, &signals(axis, wires, (&columns.before, &columns.first), &columns.memory));
        }
        for axis in 0..count {
            if self.columns.happened[axis] != 0.0 {
                self.go_alone(axis);
            }
        }
        let Columns { state, memory, .. } = &mut self.columns;
        let ticks = f64::from(self.cycles.ticks());
        for (mean_a, sum_a) in memory.current_mean_a.iter_mut().zip(&state.current_sum_a) {
            *mean_a = sum_a / ticks;
        }
    }

    /// The current cycles of one axis with the whole plant.
    fn go_alone(&mut self, axis: usize) {
        let columns = &mut self.columns;
        let before = columns.before.memory(axis);
        let inner = Inner {
            cycles: self.cycles,
            speed_law: columns.inner.speed.law(axis, before.speed_integral_n_m),
            current_loop: columns.inner.current.law(axis, before.current_integral_v),
            plant: &self.plants[axis],
        };
        let after = inner.run(before.state, columns.wires.held(axis, &columns.given));
        for lane in self.lanes(axis) {
            self.columns.state.keep(lane, &after);
            self.columns.inner.stands(lane, &self.plants[lane], after.state);
        }
    }

    /// See [`AxisDrive::is_finite`].
    pub(super) fn is_finite(&self, axis: usize) -> bool {
        self.columns.state.memory(axis).is_finite()
    }
}

impl SetpointBoxes {
    fn of(drive: &AxisDrive) -> Self {
        Self {
            jerk_filter: drive.jerk_filter.clone(),
            feedforward: drive.feedforward.clone(),
            reversal: drive.reversal.clone(),
            position_encoder: drive.position_encoder.clone(),
        }
    }
}

fn outer_boxes(drive: &AxisDrive) -> OuterBoxes {
    OuterBoxes {
        position_loop: drive.position_loop.clone(),
        monitor: drive.monitor,
        friction: drive.plant.friction(),
        gravity_n_m: drive.plant.mechanics.gravity_n_m,
    }
}

fn inner_boxes(drive: &AxisDrive) -> InnerBoxes {
    InnerBoxes { speed_law: drive.speed_loop.law, current_loop: drive.current_loop, plant: drive.plant }
}

/// One position cycle behind the set-point boxes, every axis going on as it is.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw+avx512cd", "x86_64+avx2"))]
fn cycle<const N: usize>(columns: &mut Columns<N>, cycles: Cycles) {
    lanes_cycle(columns, cycles);
}

/// The same without AVX-512.
#[multiversion(targets("x86_64+avx2"))]
fn cycle_up_to_avx2<const N: usize>(columns: &mut Columns<N>, cycles: Cycles) {
    lanes_cycle(columns, cycles);
}

/// The same without anything that only some processors have.
fn cycle_on_any<const N: usize>(columns: &mut Columns<N>, cycles: Cycles) {
    lanes_cycle(columns, cycles);
}

#[inline(always)]
fn lanes_cycle<const N: usize>(columns: &mut Columns<N>, cycles: Cycles) {
    let Columns { outer, inner, memory, given, wires, state, before, first, happened } = columns;
    outer_cycle(outer, given, memory, wires);
    first_tick((outer, inner), (given, wires), state, first);
    before.clone_from(state);
    *happened = inner_cycle(inner, (given, wires), state, cycles);
}
