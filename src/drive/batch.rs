//! Many drives in step: the axes of a machine, the parameter sets of a study.
//!
//! In: drives, one set-point each a position cycle. Out: the same signals, to the last bit, that each drive would give alone. Plain axes with the
//! same cycles run side by side in a [`Block`], which holds what they remember until somebody asks for the drives. One axis is bound by how long a number takes through the loops, several are bound by how many numbers the processor takes.
//!
//! An axis that is not plain (see `plain`) goes alone. Knows no threads: a caller has several batches.

use super::axis_drive::{AxisDrive, DriveInput};
use super::block::{Block, Instructions};
use super::choice::Drive;
use super::plain::Cycles;
use super::wire::AxisSignals;

/// Axes in a block of a study, and in one of a machine. One step of an axis waits for the one before, so that a processor has time for several registers
/// full of axes at once: 16 are two of AVX-512, or four of AVX2. Lanes without an axis cost as much as those with one.
const WIDE: usize = 16;
const MIDDLE: usize = 8;
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
    middle: Vec<Together<MIDDLE>>,
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
        let mut groups: Vec<(Cycles, Vec<usize>)> = Vec::new();
        let mut alone = Vec::new();
        for (place, drive) in drives.iter().enumerate() {
            let Some(plain) = drive.cascade().filter(|drive| drive.is_plain()) else {
                alone.push(place);
                continue;
            };
            let cycles = plain.cycles();
            match groups.iter_mut().find(|(others, _)| *others == cycles) {
                Some((_, group)) => group.push(place),
                None => groups.push((cycles, vec![place])),
            }
        }
        let (mut wide, mut middle, mut narrow) = (Vec::new(), Vec::new(), Vec::new());
        for (_, group) in &groups {
            let rest = group.len() % WIDE;
            let (many, few) = group.split_at(group.len() - if rest <= MIDDLE { rest } else { 0 });
            wide.extend(many.chunks(WIDE).filter_map(|places| Together::new(&drives, places)));
            match few {
                [place] => alone.push(*place),
                few if few.len() <= NARROW => narrow.extend(Together::new(&drives, few)),
                few => middle.extend(Together::new(&drives, few)),
            }
        }
        Self { drives, wide, middle, narrow, alone }
    }

    /// From now on with these instructions and no others. Slower; not a bit of a result changes, which a test holds.
    pub fn only_with(mut self, instructions: Instructions) -> Self {
        self.wide.iter_mut().for_each(|together| together.block.only_with(instructions));
        self.middle.iter_mut().for_each(|together| together.block.only_with(instructions));
        self.narrow.iter_mut().for_each(|together| together.block.only_with(instructions));
        self
    }

    /// The drives as they stand, for what one of them does by itself.
    pub fn drives_mut(&mut self) -> &mut [D] {
        let Self { drives, wide, middle, narrow, .. } = self;
        wide.iter_mut().for_each(|together| together.part(drives));
        middle.iter_mut().for_each(|together| together.part(drives));
        narrow.iter_mut().for_each(|together| together.part(drives));
        drives
    }

    /// Takes them apart again.
    pub fn into_drives(mut self) -> Vec<D> {
        self.drives_mut();
        self.drives
    }

    /// How many of them go together.
    pub fn together(&self) -> usize {
        self.drives.len() - self.alone.len()
    }

    /// One of them has a cascade: not all are ideal.
    pub fn has_cascade(&self) -> bool {
        self.drives.iter().any(|drive| drive.cascade().is_some())
    }

    /// See [`AxisDrive::is_finite`]. A place without a cascade is.
    pub fn is_finite(&self, place: usize) -> bool {
        let held = self.wide.iter().find_map(|together| together.is_finite(place));
        let held = held.or_else(|| self.middle.iter().find_map(|together| together.is_finite(place)));
        let held = held.or_else(|| self.narrow.iter().find_map(|together| together.is_finite(place)));
        let drive = self.drives.get(place).and_then(Steps::cascade);
        held.unwrap_or_else(|| drive.is_none_or(AxisDrive::is_finite))
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
        let Self { drives, wide, middle, narrow, alone } = self;
        for place in alone {
            step_one(drives, *place, &input, &mut show);
        }
        for together in wide {
            together.step(drives, &input, &mut show);
        }
        for together in middle {
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
    fn new<D: Steps>(drives: &[D], places: &[usize]) -> Option<Self> {
        let plain: Vec<&AxisDrive> = places.iter().filter_map(|place| drives[*place].cascade()).collect();
        Some(Self { places: places.to_vec(), block: Block::new(&plain)? })
    }

    /// Brings home what the block holds.
    fn part<D: Steps>(&mut self, drives: &mut [D]) {
        if self.block.holds() {
            for (axis, place) in self.places.iter().enumerate() {
                if let Some(drive) = drives[*place].cascade_mut() {
                    self.block.give_back(axis, drive);
                }
            }
        }
    }

    /// All of them into the block, if they can go together.
    fn join<D: Steps>(&mut self, drives: &mut [D]) -> bool {
        let plain = |place: &usize| drives[*place].cascade().is_some_and(AxisDrive::is_plain);
        if self.block.holds() {
            return true;
        }
        if !self.places.iter().all(plain) {
            return false;
        }
        for (axis, place) in self.places.iter().enumerate() {
            if let Some(drive) = drives[*place].cascade_mut() {
                self.block.take(axis, drive);
            }
        }
        true
    }

    /// Together when all have an input, else one by one.
    #[inline]
    fn step<D: Steps>(
        &mut self,
        drives: &mut [D],
        input: &impl Fn(usize) -> Option<DriveInput>,
        show: &mut impl FnMut(usize, &AxisSignals),
    ) {
        if !self.places.iter().all(|place| input(*place).is_some()) || !self.join(drives) {
            self.part(drives);
            for place in &self.places {
                step_one(drives, *place, input, show);
            }
            return;
        }
        let Self { places, block } = self;
        for (axis, place) in places.iter().enumerate() {
            if let Some(input) = input(*place) {
                block.begin(axis, &input);
            }
        }
        block.step(|axis, signals| {
            if let Some(place) = places.get(axis) {
                show(*place, signals);
            }
        });
    }

    /// Of a drive whose state is here.
    fn is_finite(&self, place: usize) -> Option<bool> {
        if !self.block.holds() {
            return None;
        }
        self.places.iter().position(|other| *other == place).map(|axis| self.block.is_finite(axis))
    }
}
