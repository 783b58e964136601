//! Many drives in step: the axes of a machine, the parameter sets of a study.
//!
//! In: drives, one set-point each a position cycle. Out: the same signals, to the last bit, that each drive would give alone. What is done
//! once in T_p (set-point, position loop, signals) stays in the drive; the inner loops of plain axes with the same cycles run side by side in
//! a [`Block`]. One axis is bound by how long a number takes through the loops, several are bound by how many numbers the processor takes.
//!
//! An axis that is not plain (see `plain`) goes alone. Knows no threads: a caller has several batches.

use super::axis_drive::{AxisDrive, DriveInput};
use super::block::Block;
use super::choice::Drive;
use super::plain::{Cycles, PlainParts, Prepared};
use super::wire::AxisSignals;

/// Axes in a block of a study, and in one of a machine with few axes.
const WIDE: usize = 8;
const NARROW: usize = 4;

/// What a batch can hold.
pub trait Steps {
    /// One position cycle; the signals at its first tick.
    fn step(&mut self, input: DriveInput) -> AxisSignals;
    /// The cascade in it, if it has one.
    fn cascade(&self) -> Option<&AxisDrive>;
    /// The cascade in it, if it has one.
    fn cascade_mut(&mut self) -> Option<&mut AxisDrive>;
}

impl Steps for AxisDrive {
    fn step(&mut self, input: DriveInput) -> AxisSignals {
        self.step(input)
    }

    fn cascade(&self) -> Option<&AxisDrive> {
        Some(self)
    }

    fn cascade_mut(&mut self) -> Option<&mut AxisDrive> {
        Some(self)
    }
}

impl Steps for Drive {
    fn step(&mut self, input: DriveInput) -> AxisSignals {
        self.step(input)
    }

    fn cascade(&self) -> Option<&AxisDrive> {
        match self {
            Self::Ideal(_) => None,
            Self::Cascade(drive) => Some(drive),
        }
    }

    fn cascade_mut(&mut self) -> Option<&mut AxisDrive> {
        match self {
            Self::Ideal(_) => None,
            Self::Cascade(drive) => Some(drive),
        }
    }
}

/// Drives that are stepped together.
#[derive(Clone, Debug)]
pub struct DriveBatch<D = AxisDrive> {
    drives: Vec<D>,
    wide: Vec<Together<WIDE>>,
    narrow: Vec<Together<NARROW>>,
    /// Those that go alone, by place.
    alone: Vec<usize>,
}

/// A block and the places of its axes in the batch.
#[derive(Clone, Debug)]
struct Together<const N: usize> {
    places: Vec<usize>,
    block: Block<N>,
}

impl<D: Steps> DriveBatch<D> {
    /// Takes the drives; their order stays.
    pub fn new(drives: Vec<D>) -> Self {
        let mut groups: Vec<(Cycles, Vec<(usize, PlainParts)>)> = Vec::new();
        let mut alone = Vec::new();
        for (place, drive) in drives.iter().enumerate() {
            let Some(parts) = drive.cascade().and_then(AxisDrive::plain_parts) else {
                alone.push(place);
                continue;
            };
            match groups.iter_mut().find(|(cycles, _)| *cycles == parts.cycles) {
                Some((_, group)) => group.push((place, parts)),
                None => groups.push((parts.cycles, vec![(place, parts)])),
            }
        }
        let (mut wide, mut narrow) = (Vec::new(), Vec::new());
        for (_, group) in &groups {
            let (many, few) =
                group.split_at(group.len() - if group.len() % WIDE <= NARROW { group.len() % WIDE } else { 0 });
            wide.extend(many.chunks(WIDE).filter_map(Together::new));
            match few {
                [(place, _)] => alone.push(*place),
                few => narrow.extend(Together::new(few)),
            }
        }
        Self { drives, wide, narrow, alone }
    }

    /// The drives, as they stand.
    pub fn drives(&self) -> &[D] {
        &self.drives
    }

    /// The drives, for what one of them does by itself: a batch keeps nothing of them between two steps.
    pub fn drives_mut(&mut self) -> &mut [D] {
        &mut self.drives
    }

    /// Takes them apart again.
    pub fn into_drives(self) -> Vec<D> {
        self.drives
    }

    /// How many of them go together.
    pub fn together(&self) -> usize {
        self.drives.len() - self.alone.len()
    }

    /// One position cycle of every drive with its input (missing ones: the drive waits); `show` gets the place of a drive and its signals
    /// at the first tick, in no order that means anything.
    pub fn step(&mut self, inputs: &[DriveInput], show: impl FnMut(usize, &AxisSignals)) {
        self.step_some(|place| inputs.get(place).copied(), show);
    }

    /// One position cycle of every drive to which `input` gives one.
    pub fn step_some(
        &mut self,
        input: impl Fn(usize) -> Option<DriveInput>,
        mut show: impl FnMut(usize, &AxisSignals),
    ) {
        let Self { drives, wide, narrow, alone } = self;
        for place in alone {
            step_one(drives, *place, &input, &mut show);
        }
        for together in wide {
            together.step(drives, &input, &mut show);
        }
        for together in narrow {
            together.step(drives, &input, &mut show);
        }
    }
}

fn step_one<D: Steps>(
    drives: &mut [D],
    place: usize,
    input: &impl Fn(usize) -> Option<DriveInput>,
    show: &mut impl FnMut(usize, &AxisSignals),
) {
    if let (Some(drive), Some(input)) = (drives.get_mut(place), input(place)) {
        show(place, &drive.step(input));
    }
}

impl<const N: usize> Together<N> {
    /// `None` without any.
    fn new(group: &[(usize, PlainParts)]) -> Option<Self> {
        let parts: Vec<PlainParts> = group.iter().map(|(_, parts)| *parts).collect();
        let places = group.iter().map(|(place, _)| *place).collect();
        Some(Self { places, block: Block::new(&parts)? })
    }

    /// Together when all have an input, else one by one.
    fn step<D: Steps>(
        &mut self,
        drives: &mut [D],
        input: &impl Fn(usize) -> Option<DriveInput>,
        show: &mut impl FnMut(usize, &AxisSignals),
    ) {
        if !self.places.iter().all(|place| input(*place).is_some()) {
            for place in &self.places {
                step_one(drives, *place, input, show);
            }
            return;
        }
        let mut prepared: [Option<Prepared>; N] = [None; N];
        for (axis, place) in self.places.iter().enumerate() {
            if let (Some(drive), Some(input)) = (drives[*place].cascade_mut(), input(*place)) {
                let ready = drive.prepare(input);
                show(*place, &drive.first_signals(&ready));
                self.block.begin(axis, &ready, &drive.inner_memory());
                prepared[axis] = Some(ready);
            }
        }
        self.block.run();
        for (axis, (ready, place)) in prepared.iter().zip(&self.places).enumerate() {
            if let (Some(ready), Some(drive)) = (ready, drives[*place].cascade_mut()) {
                match self.block.end(axis) {
                    Some((memory, current_sum_a)) => drive.finish(ready, &memory, current_sum_a),
                    None => drive.go_alone(ready),
                }
            }
        }
    }
}
