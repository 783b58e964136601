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

/// What a drive has besides, on one axis or another: filters, averages, compensations, DSC, a second mass, a screw with errors.
const OPTIONS: &[&str] = &[
    r#"axes.X.drive.jerk_filter="fir_low_pass""#,
    "axes.X.drive.jerk_filter_time_ms=21",
    "axes.X.drive.jerk_filter_frequency_hz=25",
    r#"axes.Y.drive.jerk_filter="double_moving_average""#,
    "axes.Y.drive.jerk_filter_time_ms=12",
    "axes.Y.drive.jerk_filter_time_add_ms=9",
    "axes.X.drive.stiffness_control=true",
    r#"axes.X.drive.speed_filter="pt2""#,
    "axes.X.drive.speed_filter_frequency_hz=300",
    r#"axes.Y.drive.current_filter_1="second_order""#,
    "axes.Y.drive.current_filter_1_frequency_hz=900",
    "axes.Y.drive.current_filter_1_numerator_frequency_hz=800",
    "axes.Y.drive.reference_model_frequency_hz=150",
    "axes.Y.drive.friction_compensation_mm_s=3",
    "axes.X.mechanics.backlash_um=5",
    "axes.X.drive.backlash_compensation_um=4",
    "axes.Z.mechanics.load_inertia_kg_m2=0.004",
    "axes.Z.mechanics.coupling_stiffness_n_m_per_rad=2500",
    "axes.Z.mechanics.coupling_damping_n_m_s_per_rad=0.05",
    r#"axes.Z.drive.feedforward_balancing="pt1""#,
    "axes.X.mechanics.pitch_error_um=[0.0, 5.0, -2.0]",
    "axes.X.mechanics.pitch_error_step_mm=50",
];

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
    for (name, sets, wanted_cycles) in
        [("spinner_mvc850", &[][..], 20_000), ("mikron_ucp710", &[], 10_000), ("spinner_mvc850", OPTIONS, 20_000)]
    {
        let machine = Arc::new(test_machine::shipped(name, sets));
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
