//! The cycle does not allocate: counted by an allocator around the system's, over thousands of cycles of a real program.
//!
//! Preparation may allocate (it has a thread of its own), so its pieces are made beforehand and handed over one by one, as the channel
//! does. One test only in this file: the counter sees all threads of the process.

mod test_machine;

use sollwert::feed::PlannedPiece;
use sollwert::kernel::{Findings, Kernel, PieceSource, Preparation, Status};
use sollwert::program::ProgramSource;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};
use std::alloc::System;
use std::collections::VecDeque;
use std::sync::Arc;

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Cycles in which buffers may grow to their size.
const WARM_UP_CYCLES: u32 = 500;

/// Pieces that are all there.
struct Prepared(VecDeque<PlannedPiece>);

impl PieceSource for Prepared {
    fn next_piece(&mut self) -> Option<PlannedPiece> {
        self.0.pop_front()
    }

    fn take_findings(&mut self) -> Findings {
        Findings::default()
    }
}

#[test]
fn the_cycle_does_not_allocate() {
    for (name, wanted_cycles) in [("spinner_mvc850", 20_000), ("mikron_ucp710", 10_000)] {
        let machine = Arc::new(test_machine::shipped(name, &[]));
        let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/programs/pocket.mpf")).unwrap();
        let mut preparation = Preparation::new(ProgramSource::from_bytes("pocket.mpf", bytes), &machine);
        let pieces = std::iter::from_fn(|| preparation.next_piece()).collect();
        let mut kernel = Kernel::with_source(machine, Prepared(pieces), true);
        for _ in 0..WARM_UP_CYCLES {
            assert_eq!(kernel.cycle().unwrap(), Status::Running);
        }
        let region = Region::new(ALLOCATOR);
        let mut cycles = 0;
        while kernel.cycle().unwrap() == Status::Running {
            cycles += 1;
        }
        let change = region.change();
        assert!(cycles > wanted_cycles, "{name}: {cycles} cycles are too few to tell");
        assert_eq!((change.allocations, change.reallocations), (0, 0), "{name}: {change:?} in {cycles} cycles");
    }
}
