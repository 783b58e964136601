//! From the wires of a cycle to the recorder.
//!
//! In: [`CycleOutput`], rows of `follow`. Out: calls of the [`Recorder`] in order of ticks: events, path, tool, axes. Decides what is
//! recorded when (tool poses at 100 Hz); does not encode.

use super::cycle::{AxisRow, CycleOutput};
use crate::base::{Diagnostic, Tick, TimeBase};
use crate::kinematics::ToolPose as Pose;
use crate::machine::Machine;
use crate::program::BlockRef;
use crate::recorder::{EventRecord, Recorder, ToolPose};

/// Distance of tool poses: 100 Hz.
const POSE_PERIOD_NS: u64 = 10_000_000;

/// One row of `follow`.
pub(super) struct FollowRow<'a> {
    /// When.
    pub(super) tick: Tick,
    /// Axes that stepped at this tick.
    pub(super) rows: &'a [AxisRow],
    /// Tool by set-points and by actual positions, in the part frame.
    pub(super) tools: [Pose; 2],
}

/// Records one cycle. Errors: the disk is full or gone.
pub(super) fn record_cycle(recorder: &mut Recorder, machine: &Machine, output: &CycleOutput) -> Result<(), Diagnostic> {
    let Some(setpoint) = &output.setpoint else { return Ok(()) };
    let tick = setpoint.tick;
    for begun in &output.begun {
        if begun.blocks_begun > 0 {
            recorder.event(tick, Some(begun.block), EventRecord::BlockStart);
        }
        for event in &begun.events {
            recorder.program_event(tick, begun.block, event);
        }
        if let Some(corner) = begun.corner {
            let event = EventRecord::Corner {
                angle_rad: corner.angle_rad,
                tolerance_mm: corner.tolerance_mm,
                transition_length_mm: corner.transition_length_mm,
                feed_mm_s: begun.entry_feed_lu_s,
            };
            recorder.event(tick, Some(begun.block), event);
        }
    }
    recorder.path(tick, &setpoint.path, output.contour_error_mm);
    if machine.spindle.is_some() {
        recorder.spindle(tick, &output.spindle);
    }
    let cycle_ticks = machine.cycle.time_base.ticks_per_setpoint();
    record_poses(recorder, &machine.cycle.time_base, tick, cycle_ticks, [output.tool_setpoint, output.tool_actual]);
    record_rows(recorder, &output.rows);
    recorder.check()
}

/// Records one row of `follow`.
pub(super) fn record_follow(
    recorder: &mut Recorder,
    time_base: &TimeBase,
    row_ticks: u64,
    row: &FollowRow<'_>,
) -> Result<(), Diagnostic> {
    record_poses(recorder, time_base, row.tick, row_ticks, row.tools);
    record_rows(recorder, row.rows);
    recorder.check()
}

/// Records how the axes brake after an alarm, and the spindle at a set-point tick.
pub(super) fn record_braking(
    recorder: &mut Recorder,
    machine: &Machine,
    output: &CycleOutput,
) -> Result<(), Diagnostic> {
    let tick = output.rows.first().map(|row| row.tick);
    let period = machine.cycle.time_base.ticks_per_setpoint();
    if let Some(tick) = tick.filter(|tick| machine.spindle.is_some() && tick.0.is_multiple_of(period)) {
        recorder.spindle(tick, &output.spindle);
    }
    record_rows(recorder, &output.rows);
    recorder.check()
}

/// Records the alarm that ends the run, at the last tick that was executed, and the block of a drive's alarm.
pub(super) fn record_alarm(recorder: &mut Recorder, tick: Tick, block: Option<BlockRef>, alarm: &Diagnostic) {
    recorder.event(tick, block, alarm.into());
}

fn record_rows(recorder: &mut Recorder, rows: &[AxisRow]) {
    for row in rows {
        recorder.axis(row.tick, row.axis, &row.setpoint, &row.signals);
    }
}

/// Poses at the first cycle in every 10 ms of simulated time.
fn record_poses(
    recorder: &mut Recorder,
    time_base: &TimeBase,
    tick: Tick,
    cycle_ticks: u64,
    [sent, actual]: [Pose; 2],
) {
    let period = |tick: Tick| time_base.time_ns(tick) / POSE_PERIOD_NS;
    if tick.0 > 0 && period(tick) == period(Tick(tick.0.saturating_sub(cycle_ticks))) {
        return;
    }
    recorder.pose(tick, ToolPose::Setpoint, sent.position_mm, sent.orientation_quaternion_xyzw);
    recorder.pose(tick, ToolPose::Actual, actual.position_mm, actual.orientation_quaternion_xyzw);
}
