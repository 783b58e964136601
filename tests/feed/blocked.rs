//! Paths that an axis cannot follow at all: an alarm with line and axis, and only where that axis moves.

use crate::support::{Program, spinner};
use sollwert::base::Diagnostic;
use sollwert::feed::Planner;
use sollwert::machine::{AxisLimits, Machine, PathMode, TimeLawKind};

/// The first alarm of a program, and how many pieces were taken before it.
fn alarm(machine: &Machine, program: &Program) -> Option<(usize, Diagnostic)> {
    let mut planner = Planner::new(machine);
    let pushed = program.paths(machine).into_iter().map(|path| planner.push(path));
    pushed.enumerate().find_map(|(taken, pushed)| pushed.err().map(|alarm| (taken, *alarm)))
}

#[test]
fn an_axis_without_a_limit_left_is_named() {
    type Limit = fn(&mut AxisLimits) -> &mut f64;
    let limits: [(Limit, &str); 3] = [
        (|limits| &mut limits.velocity_max_lu_s, "velocity"),
        (|limits| &mut limits.acceleration_max_lu_s2, "acceleration"),
        (|limits| &mut limits.jerk_max_lu_s3, "jerk"),
    ];
    for time_law in [TimeLawKind::SevenPhase, TimeLawKind::Continuous] {
        for (limit, name) in limits {
            let mut machine = spinner();
            machine.feed.time_law = time_law;
            *limit(&mut machine.axes[1].limits) = 0.0;
            let program = Program::polyline(PathMode::ExactStop, 3000.0, &[[50.0, 0.0], [50.0, 20.0]]);
            let case = format!("{time_law:?} {name}");
            let Some((taken, alarm)) = alarm(&machine, &program) else { panic!("{case}: no alarm") };
            // Line 1 moves X alone, and goes.
            assert_eq!((taken, alarm.code), (1, "P0001"), "{case}: {alarm:?}");
            assert!(
                alarm.message.contains("line 2") && alarm.message.contains(&format!("axis Y has no {name}")),
                "{case}: {alarm:?}"
            );
            assert!(alarm.help.is_some(), "{case}");
            let along_x = Program::polyline(PathMode::ExactStop, 3000.0, &[[50.0, 0.0], [70.0, 0.0]]);
            assert!(self::alarm(&machine, &along_x).is_none(), "{case}");
        }
    }
}

/// A feed of next to nothing would take for ever.
#[test]
fn a_motion_of_many_days_is_an_alarm() {
    let program = Program::polyline(PathMode::ExactStop, 1e-7, &[[50.0, 0.0]]);
    let Some((0, alarm)) = alarm(&spinner(), &program) else { panic!("no alarm") };
    assert!(alarm.code == "P0002" && alarm.message.contains("line 1") && alarm.help.is_some(), "{alarm:?}");
}

/// The axis whose limit makes it slow is named, and no axis where the feed does: 1 mm in 1e6 s is 1e-6 mm/s.
#[test]
fn an_axis_that_holds_a_motion_for_days_is_named() {
    for time_law in [TimeLawKind::SevenPhase, TimeLawKind::Continuous] {
        let mut machine = spinner();
        machine.feed.time_law = time_law;
        let program = Program::polyline(PathMode::ExactStop, 3000.0, &[[50.0, 0.0], [50.0, 20.0]]);
        machine.axes[1].limits.velocity_max_lu_s = 20.0 * 1e-6 * 1.01;
        assert!(alarm(&machine, &program).is_none(), "{time_law:?}");
        machine.axes[1].limits.velocity_max_lu_s = 20.0 * 1e-6 * 0.99;
        let Some((1, alarm)) = alarm(&machine, &program) else { panic!("{time_law:?}: no alarm") };
        assert_eq!(alarm.code, "P0002");
        assert!(alarm.message.contains("line 2") && alarm.message.contains("velocity of axis Y"), "{alarm:?}");
        let slow = Program::polyline(PathMode::ExactStop, 1e-7, &[[50.0, 0.0]]);
        let Some((0, alarm)) = self::alarm(&spinner(), &slow) else { panic!("no alarm") };
        assert!(!alarm.message.contains("axis"), "{alarm:?}");
    }
}
