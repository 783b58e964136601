//! The control calibrated: traces made with other settings than those that the fit starts from.

use crate::made::machine;
use sollwert::base::AxisKind;
use sollwert::identify::{TracedProgram, calibrate};
use sollwert::interpreter::Setup;
use sollwert::kernel::{Kernel, Status};
use sollwert::machine::Machine;
use sollwert::program::ProgramSource;
use sollwert::trace::{Clock, Meaning, Signal, TimeGrid, Trace};
use std::sync::Arc;

/// Corners of many angles, with and without reversals.
const FITTED: &str = "G642 CTOL=0.08 SOFT\nG1 X12 F3000\nX20 Y6\nY16\nX14 Y22\nX2 Y20\nX-6 Y12\nX-2 Y4\nX6 Y8\nX10 Y14\nX4 Y16\nX0 Y10\nX8 Y2\nM30\n";
/// Another path at another feed.
const UNSEEN: &str = "G642 CTOL=0.05 SOFT\nG1 X9 Y3 F2400\nX15 Y12\nX8 Y18\nX-4 Y15\nX-8 Y5\nX0 Y-6\nX11 Y-4\nX16 Y4\nX7 Y9\nX1 Y4\nM30\n";

fn setup(text: &str) -> Setup {
    Setup::from(ProgramSource::from_bytes("test.mpf", text.as_bytes()))
}

/// Set-points of a program, as a trace.
fn traced(machine: &Machine, text: &str) -> Trace {
    let mut kernel = Kernel::new(Arc::new(machine.clone()), setup(text), false);
    let linear: Vec<_> = machine.axis_ids().filter(|id| machine.axis(*id).kind == AxisKind::Linear).collect();
    let mut columns = vec![Vec::new(); linear.len()];
    loop {
        let status = kernel.cycle().unwrap_or_else(|alarm| panic!("{}", alarm.render(false)));
        if let Some(setpoint) = kernel.output().setpoint {
            for (column, id) in columns.iter_mut().zip(&linear) {
                column.push(setpoint.axes[*id].position_lu);
            }
        }
        if status == Status::Finished {
            break;
        }
    }
    let time_base = &machine.cycle.time_base;
    let step_ns = time_base.seconds(time_base.ticks_per_setpoint()) * 1e9;
    let signal = |(id, values): (&sollwert::base::AxisId, Vec<f64>)| {
        let name = format!("{}.position_setpoint_mm", machine.axis(*id).name);
        Signal {
            name: Some(name.clone()),
            original: name,
            unit: "mm".to_owned(),
            clock: Clock::Servo,
            times: TimeGrid::Uniform { start_ns: 0.0, step_ns, count: values.len() },
            values,
            labels: Vec::new(),
            discrete: false,
            meaning: Meaning::default(),
        }
    };
    Trace { name: "made".to_owned(), signals: linear.iter().zip(columns).map(signal).collect(), ..Trace::default() }
}

#[test]
fn a_control_with_other_settings_is_found_and_predicts_an_unseen_program() {
    let truth = machine(
        "spinner_mvc850",
        &[
            "smoothing.alpha=2.1",
            "smoothing.tolerance_ratio=0.95",
            "smoothing.tolerance_ratio_reversal=0.75",
            "smoothing.radial_acceleration_share=0.45",
            "smoothing.radial_jerk_share=0.4",
            "axes.X.transition_jerk_max_m_s3=17",
            "axes.Y.transition_jerk_max_m_s3=17",
            "axes.Z.transition_jerk_max_m_s3=17",
        ],
    );
    let start = machine("spinner_mvc850", &[]);
    let (fitted, unseen) = (traced(&truth, FITTED), traced(&truth, UNSEEN));
    let pairs = [
        TracedProgram { trace: &fitted, setup: setup(FITTED) },
        TracedProgram { trace: &unseen, setup: setup(UNSEEN) },
    ];
    let result =
        calibrate(&pairs[0], &pairs[1..], &start, &mut |_| {}).unwrap_or_else(|d| panic!("{}", d.render(false)));
    for (key, value) in
        [("smoothing.alpha", 2.1), ("smoothing.tolerance_ratio", 0.95), ("smoothing.tolerance_ratio_reversal", 0.75)]
    {
        let estimate =
            result.estimates.iter().find(|e| e.key == key).unwrap_or_else(|| panic!("{key}: {:?}", result.refusals));
        assert!((estimate.value / value - 1.0).abs() < 0.02, "{estimate:?}, truth {value}");
    }
    // The path of the unseen program is met, and its time and feed come nearer than they were.
    let (before, after) = result.agreements[1];
    assert!(after.path_rms_mm < 0.05 * before.path_rms_mm, "{after:?}, before {before:?}");
    assert!(
        after.feed_rms_share < 0.03 && after.feed_rms_share < before.feed_rms_share,
        "{after:?}, before {before:?}"
    );
    let off = |agreement: &sollwert::identify::Agreement| (agreement.planned_s / agreement.traced_s - 1.0).abs();
    assert!(off(&after) < 0.5 * off(&before), "{after:?}, before {before:?}");
}

#[test]
fn a_trace_of_another_program_is_refused() {
    let start = machine("spinner_mvc850", &[]);
    let other = traced(&start, UNSEEN);
    let pair = TracedProgram { trace: &other, setup: setup(FITTED) };
    let finding = calibrate(&pair, &[], &start, &mut |_| {}).expect_err("another path");
    assert_eq!(finding.code, "T0208");
}
