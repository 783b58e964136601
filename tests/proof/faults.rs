//! The harness sees what is wrong: runs that are right, judged by limits that are a little tighter, or with a set-point that was moved.

use crate::run::{Run, places};
use crate::settings::{Law, Settings};
use crate::verdict::Kind;
use crate::{axes, case, contour};
use sollwert::machine::{AccelerationMode, Machine};
use std::collections::BTreeSet;
use std::sync::{Arc, LazyLock};

/// Seeds that are looked at: each fault has to be seen in some of them.
const SEEDS: std::ops::Range<u64> = 0..40;

/// The runs as they are.
static RUNS: LazyLock<Vec<(Machine, Run)>> = LazyLock::new(|| {
    let run = |seed| {
        let (settings, program, _) = case(seed, LAW);
        let settings = Settings { look_ahead_blocks: 50, ..settings };
        let machine = settings.machine();
        let run = Run::new(&Arc::new(machine.clone()), &program.text(&settings)).unwrap();
        (machine, run)
    };
    SEEDS.map(run).collect()
});

const LAW: Law = Law::SevenPhase;

/// The kinds of findings after a change of machine or run.
fn seen(change: impl Fn(&mut Machine, &mut Run)) -> Vec<BTreeSet<Kind>> {
    let mut all = Vec::new();
    for (machine, run) in RUNS.iter() {
        let (mut machine, mut run) = (machine.clone(), run.clone());
        change(&mut machine, &mut run);
        all.push(match places(&run) {
            Ok(places) => {
                let mut findings = axes::check(&machine, LAW, &run, &places);
                findings.extend(contour::check(&machine, &run, &places));
                findings.into_iter().map(|finding| finding.kind).collect()
            }
            Err(_) => BTreeSet::from([Kind::Path]),
        });
    }
    all
}

fn count(seen: &[BTreeSet<Kind>], kind: Kind) -> usize {
    seen.iter().filter(|kinds| kinds.contains(&kind)).count()
}

#[test]
fn limits_that_are_a_little_tighter() {
    let untouched = seen(|_, _| {});
    assert!(untouched.iter().all(BTreeSet::is_empty), "{untouched:?}");
    let limits = |change: fn(&mut sollwert::machine::AxisLimits)| {
        seen(move |machine, _| machine.axes.iter_mut().for_each(|axis| change(&mut axis.limits)))
    };
    // Most programs are held by other limits.
    let velocity = limits(|limits| limits.velocity_max_lu_s *= 0.99);
    assert!(count(&velocity, Kind::Velocity) >= 2, "{velocity:?}");
    let acceleration = limits(|limits| limits.acceleration_max_lu_s2 *= 0.98);
    assert!(count(&acceleration, Kind::Acceleration) >= 10, "{acceleration:?}");
    let jerk = limits(|limits| {
        limits.jerk_max_lu_s3 *= 0.98;
        limits.transition_jerk_max_lu_s3 *= 0.98;
    });
    assert!(count(&jerk, Kind::Jerk) >= 10, "{jerk:?}");
}

#[test]
fn corners_that_are_taken_too_fast() {
    // A corner step that is two thirds of what was planned with: only where G64 leaves a corner.
    let steps = seen(|machine, _| {
        machine.axes.iter_mut().for_each(|axis| axis.follow_up_tolerance_lu *= 0.4);
    });
    assert!(count(&steps, Kind::VelocityStep) + count(&steps, Kind::Acceleration) >= 5, "{steps:?}");
}

#[test]
fn tolerances_feeds_ends_and_rests() {
    let tolerances = seen(|machine, run| {
        machine.smoothing.contour_tolerance_mm *= 0.3;
        for target in &mut run.targets {
            let modes = &mut target.modes;
            modes.contour_tolerance_mm = modes.contour_tolerance_mm.map(|tolerance| 0.3 * tolerance);
        }
    });
    assert!(count(&tolerances, Kind::Tolerance) >= 5, "{tolerances:?}");
    let feeds = seen(|_, run| {
        for target in &mut run.targets {
            target.feed = target.feed.map(|feed| 0.99 * feed);
        }
    });
    assert!(count(&feeds, Kind::Feed) >= 10, "{feeds:?}");
    let rests = seen(|_, run| run.joints.iter_mut().for_each(|joint| joint.rests = true));
    assert!(count(&rests, Kind::Rest) >= 10, "{rests:?}");
    let ends = seen(|_, run| drop(run.rows.pop()));
    // A dwell at the end leaves the position as it is.
    assert!(count(&ends, Kind::CycleTime) == ends.len() && count(&ends, Kind::Rest) + 3 >= ends.len(), "{ends:?}");
    let moved = seen(|_, run| {
        let middle = run.rows.len() / 2;
        run.rows[middle].q[0] += 1e-7;
    });
    assert_eq!(count(&moved, Kind::Path), moved.len());
}

#[test]
fn jerk_without_limit_and_acceleration_at_high_speed() {
    let soft = seen(|_, run| {
        run.targets.iter_mut().for_each(|target| target.modes.acceleration_mode = AccelerationMode::Soft);
    });
    assert!(count(&soft, Kind::Jerk) >= 4, "{soft:?}");
    let reduced = seen(|machine, run| {
        let drive = |target: &crate::run::Target| target.modes.acceleration_mode == AccelerationMode::Drive;
        if run.targets.iter().any(drive) {
            for axis in &mut machine.axes {
                axis.acceleration_reduction.reduction_ratio = 0.95;
                axis.acceleration_reduction.velocity_ratio *= 0.5;
            }
        }
    });
    assert!(count(&reduced, Kind::Acceleration) >= 1, "{reduced:?}");
}
