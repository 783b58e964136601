//! One interpolator cycle: set-point, drives, figures.
//!
//! In: planned pieces. Out: [`CycleOutput`] per t_s, in a buffer that is reused: the cycle does not allocate once it has grown. The
//! set-point of the next cycle is sampled one cycle early, because the fine interpolator runs between two known set-points. Does not
//! record, print or wait: the caller does.

use super::alarms::{diverged, monitored, never_together};
use super::clamping::Clamping;
use super::contour_error::ContourErrorMeter;
use super::figures::Figures;
use super::in_position::InPositionWire;
use super::inner_rows::InnerRows;
use super::preparation::{Findings, PieceSource, Preparation};
use crate::base::clock::gcd;
use crate::base::{AxisId, Diagnostic, MachinePoint, PerAxis, Tick};
use crate::drive::{AxisSignals, Drive, DriveBatch, DriveInput, IdealDrive, SpindleLag, SpindleSignals, Start};
use crate::feed::{Limit, LimitKind};
use crate::interpolator::{
    AxisSetpoint, Begun, ExactStopWait, FineInterpolator, Interpolator, Setpoint, SpindleSetpoint,
};
use crate::interpreter::{ExactStop, Setup};
use crate::kinematics::{Kinematics, ToolPose};
use crate::machine::{Axis, Machine};
use crate::recorder::{RecordRate, SignalChoice};
use std::sync::Arc;

/// How a cycle ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The output holds this cycle.
    Running,
    /// There was no cycle left: the path has ended.
    Finished,
}

/// One axis at one position tick, or at a tick of its inner loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisRow {
    /// When.
    pub tick: Tick,
    /// Which axis.
    pub axis: AxisId,
    /// What the (fine) interpolator sent.
    pub setpoint: AxisSetpoint,
    /// All wires of the drive; for a run without drives those of an ideal axis.
    pub signals: AxisSignals,
}

/// Everything that one cycle of t_s produced.
#[derive(Clone, Debug)]
pub struct CycleOutput {
    /// The set-point of this cycle; `None` before the first one.
    pub setpoint: Option<Setpoint>,
    /// Pieces that began in the cycle that ends here.
    pub begun: Vec<Begun>,
    /// Rows of all axes, by tick, then by axis.
    pub rows: Vec<AxisRow>,
    /// Tool in the part frame, by set-points.
    pub tool_setpoint: ToolPose,
    /// Tool in the part frame, by actual positions.
    pub tool_actual: ToolPose,
    /// The master spindle at the set-point.
    pub spindle: SpindleSignals,
    /// Distance of the actual tool point from the path of the set-points; `None` where every axis is ideal.
    pub contour_error_mm: Option<f64>,
}

/// Pieces that may begin in one cycle before the list of them has to grow.
const BEGUN_USUAL: usize = 64;

/// Position cycle of an axis, and how it is reached from t_s.
#[derive(Clone, Copy)]
struct PositionCycle {
    ticks: u64,
    fine: FineInterpolator,
    rows: InnerRows,
}

impl PositionCycle {
    /// Without a drive an axis steps once a set-point.
    fn new(machine: &Machine, axis: &Axis, drives: bool) -> Self {
        let drive = axis.drive.as_ref().filter(|_| drives);
        let ticks = drive.map_or(machine.cycle.time_base.ticks_per_setpoint(), |drive| drive.position_cycle_ticks);
        let fine = FineInterpolator::new(machine, ticks);
        Self { ticks, fine, rows: InnerRows::default() }
    }
}

/// What the axes get at a row's tick, and what their drives say to it.
#[derive(Clone)]
struct Step {
    sent: PerAxis<AxisSetpoint>,
    /// `None`: the position cycle of the axis does not begin at this tick.
    inputs: PerAxis<Option<DriveInput>>,
    signals: PerAxis<AxisSignals>,
}

/// A set-point sampled ahead, with the pieces that begin on the way to it.
#[derive(Clone)]
struct Sampled {
    setpoint: Option<Setpoint>,
    begun: Vec<Begun>,
}

/// The running simulation. Its clone is a snapshot: a clone continues to the same bytes.
#[derive(Clone)]
pub struct Kernel<S = Preparation> {
    machine: Arc<Machine>,
    source: S,
    interpolator: Interpolator,
    /// Per axis.
    position_cycles: Vec<PositionCycle>,
    /// Ticks between rows: the greatest common divisor of the position cycles.
    row_ticks: u64,
    /// Goes on behind the last set-point until the axes are in position.
    until_rest: bool,
    /// The last set-point, once it stands behind its tick.
    resting: Option<ExactStopWait>,
    /// An axis gives more than one row a position cycle.
    sorts_rows: bool,
    drives: DriveBatch<Drive>,
    step: Step,
    in_position: InPositionWire,
    clamping: Clamping,
    spindle: SpindleLag,
    kinematics: Kinematics,
    contour_error: ContourErrorMeter,
    /// Tool poses and the contour error are looked at.
    poses: bool,
    figures: Figures,
    ahead: Sampled,
    output: CycleOutput,
    next_setpoint: u64,
}

impl Kernel<Preparation> {
    /// At the start of `program`. With `drives` false every axis is ideal. The caller sees to it that [`unsupported`](crate::machine::unsupported)
    /// has nothing against the machine, as [`run`](super::run) does: a value that is not built yet would be passed over.
    pub fn new(machine: Arc<Machine>, program: impl Into<Setup>, drives: bool) -> Self {
        let source = Preparation::new(program, &machine).waiting_in_position(drives);
        Self::with_source(machine, source, drives)
    }
}

impl<S: PieceSource> Kernel<S> {
    /// As [`Kernel::new`], with preparation wherever it runs.
    pub fn with_source(machine: Arc<Machine>, source: S, drives: bool) -> Self {
        let time_base = machine.cycle.time_base;
        let kinematics = Kinematics::new(&machine);
        let home =
            MachinePoint(PerAxis::from_fn(|axis| machine.axes.get(axis.index()).map_or(0.0, |axis| axis.home_lu)));
        let tool = kinematics.tool_pose(&home);
        let output = CycleOutput {
            setpoint: None,
            begun: Vec::with_capacity(BEGUN_USUAL),
            rows: Vec::new(),
            tool_setpoint: tool,
            tool_actual: tool,
            spindle: SpindleSignals::default(),
            contour_error_mm: None,
        };
        let stages: Vec<Drive> = machine
            .axes
            .iter()
            .map(|axis| match drives {
                true => Drive::new(axis, &time_base, Start::Held, axis.home_lu),
                false => Drive::Ideal(IdealDrive::new(&time_base, axis.home_lu)),
            })
            .collect();
        let position_cycles: Vec<PositionCycle> =
            machine.axes.iter().map(|axis| PositionCycle::new(&machine, axis, drives)).collect();
        let driven = PerAxis::from_fn(|axis| matches!(stages.get(axis.index()), Some(Drive::Cascade(_))));
        let in_position = InPositionWire::new(&machine, driven);
        let interpolator = Interpolator::new(&machine);
        let interpolator = if in_position.connected() { interpolator.waiting_in_position() } else { interpolator };
        let row_ticks = position_cycles.iter().map(|cycle| cycle.ticks).fold(time_base.ticks_per_setpoint(), gcd);
        Self {
            source,
            interpolator,
            position_cycles,
            row_ticks,
            until_rest: false,
            resting: None,
            sorts_rows: false,
            drives: DriveBatch::new(stages),
            step: Step { sent: PerAxis::default(), inputs: PerAxis::splat(None), signals: PerAxis::default() },
            in_position,
            clamping: Clamping::new(&machine),
            spindle: SpindleLag::new(
                machine.spindle.filter(|_| drives).map_or(0.0, |spindle| spindle.lag_s),
                time_base.setpoint_period_s(),
            ),
            kinematics,
            contour_error: ContourErrorMeter::new(),
            poses: true,
            figures: Figures::default(),
            ahead: Sampled { setpoint: None, begun: Vec::with_capacity(BEGUN_USUAL) },
            output,
            next_setpoint: 0,
            machine,
        }
    }

    /// Without tool poses and contour error, where nobody looks at the output of a cycle: no figure needs them.
    pub fn without_poses(self) -> Self {
        Self { poses: false, ..self }
    }

    /// With the rows that a recording asks for.
    pub fn asked_for(self, signals: &SignalChoice) -> Self {
        self.with_rows_at(signals.rate()).until_rest(signals.ends_at_rest())
    }

    /// With cycles behind the last set-point, in which it stands until every axis is in position: what delays, filters and lags still hold
    /// back is seen. They count in no figure but those of the drives.
    pub fn until_rest(mut self, until_rest: bool) -> Self {
        self.until_rest = until_rest && self.in_position.connected();
        self
    }

    /// With rows of every axis at the rate of its speed or current loop. Figures count position ticks in any case.
    pub fn with_rows_at(mut self, rate: RecordRate) -> Self {
        let drives = self.machine.axes.iter().zip(self.drives.drives_mut());
        for (cycle, (axis, drive)) in self.position_cycles.iter_mut().zip(drives) {
            let driven = matches!(drive, Drive::Cascade(_));
            cycle.rows = InnerRows::new(axis.drive.as_ref().filter(|_| driven), rate);
        }
        self.sorts_rows = rate != RecordRate::Position;
        self
    }

    /// Steps one cycle of t_s. `Running`: [`Kernel::output`] holds it. Errors: the alarm of a drive, which ends the run; the output holds
    /// what the cycle gave up to there.
    pub fn cycle(&mut self) -> Result<Status, Diagnostic> {
        if self.next_setpoint == 0 {
            self.sample_ahead();
        }
        std::mem::swap(&mut self.output.begun, &mut self.ahead.begun);
        // Set-points are large: here and below they are looked at where they are.
        self.output.setpoint = self.ahead.setpoint;
        if self.output.setpoint.is_none() {
            return Ok(Status::Finished);
        }
        let counts = self.resting.is_none();
        self.sample_ahead();
        for begun in &self.output.begun {
            self.figures.piece(begun);
        }
        self.clamping.begin(&self.machine, &self.output.begun);
        if let Some(setpoint) = &self.output.setpoint {
            if counts {
                self.figures.setpoint(setpoint);
            }
            self.output.spindle = self.spindle.step(&setpoint.spindle);
        }
        let stepped = self.step_drives();
        if self.sorts_rows {
            self.output.rows.sort_unstable_by_key(|row| (row.tick, row.axis));
        }
        self.measure();
        stepped.map(|()| Status::Running)
    }

    fn sample_ahead(&mut self) {
        let Self { interpolator, source, .. } = self;
        // What the drives said before the set-point that stands now acts from there on.
        let mut arrived = false;
        if let Some(before) = self.next_setpoint.checked_sub(1)
            && self.in_position.take(self.machine.cycle.time_base.setpoint_tick(before)).is_some()
        {
            interpolator.release(before);
            source.waited(interpolator.waited_s());
            arrived = true;
        }
        self.ahead.begun.clear();
        self.ahead.setpoint = interpolator.sample(self.next_setpoint, &mut || source.next_piece());
        interpolator.swap_begun(&mut self.ahead.begun);
        if self.ahead.setpoint.is_none() && self.until_rest {
            self.stand(arrived);
        }
        self.next_setpoint += 1;
    }

    /// Behind the last set-point: it stands for another cycle, unless all axes have arrived.
    fn stand(&mut self, arrived: bool) {
        let Some(last) = self.output.setpoint else { return };
        let tick = self.machine.cycle.time_base.setpoint_tick(self.next_setpoint);
        match self.resting {
            Some(_) if arrived => return,
            Some(_) => {}
            None => {
                self.resting =
                    Some(ExactStopWait { since: last.tick, window: ExactStop::Fine, elsewhere: PerAxis::splat(false) });
            }
        }
        let stands = |axis| AxisSetpoint { position_lu: last.axes[axis].position_lu, ..AxisSetpoint::default() };
        let spindle = self.interpolator.spindle_behind_end(self.next_setpoint);
        let mut standing = Setpoint { tick, axes: PerAxis::from_fn(stands), spindle, ..last };
        standing.path.limit = Limit { kind: LimitKind::InPosition, axis: None };
        standing.path.programmed_feed_lu_s = None;
        self.ahead.setpoint = Some(standing);
    }

    /// All position ticks from this set-point up to the next one (only the first after the last set-point).
    fn step_drives(&mut self) -> Result<(), Diagnostic> {
        self.output.rows.clear();
        let wait = self.resting.or(self.interpolator.exact_stop_wait());
        let last = self.ahead.setpoint.is_none();
        let ticks = if last { 1 } else { self.machine.cycle.time_base.ticks_per_setpoint() };
        for offset in (0..ticks).step_by(self.row_ticks as usize) {
            let Some((tick, line)) = self.send(offset) else { return Ok(()) };
            if self.sorts_rows && !last {
                self.step_with_rows(tick);
            } else {
                let Self { drives, step, .. } = self;
                let (inputs, signals) = (step.inputs.as_slice(), step.signals.as_mut_slice());
                drives.step_some(|place| inputs.get(place).copied().flatten(), |place, now| signals[place] = *now);
            }
            // All axes have stepped: behind an alarm of one the others have their rows, too, and brake from what they were told.
            let Self { machine, drives, step, figures, output, in_position, clamping, .. } = self;
            let mut alarm = None;
            for axis in machine.axis_ids() {
                if step.inputs[axis].is_none() {
                    continue;
                }
                let signals = &step.signals[axis];
                if !drives.is_finite(axis.index()) {
                    alarm = alarm.or_else(|| Some(diverged(machine, axis, tick)));
                    continue;
                }
                figures.drive(axis, signals);
                output.rows.push(AxisRow { tick, axis, setpoint: step.sent[axis], signals: *signals });
                if let Some(wait) = &wait {
                    in_position.hear(tick, axis, wait, signals);
                }
                let Some(row) = output.rows.last() else { continue };
                alarm = alarm
                    .or_else(|| monitored(machine, Some(line), row))
                    .or_else(|| clamping.watch(machine, line, row));
            }
            let apart = wait.as_ref().and_then(|wait| in_position.apart(tick, wait));
            let alarm = alarm.or_else(|| apart.map(|apart| never_together(machine, line, tick, &apart)));
            if let Some(alarm) = alarm {
                return Err(alarm);
            }
        }
        Ok(())
    }

    /// What the axes get `offset` ticks behind the set-point; when that is, and its line.
    fn send(&mut self, offset: u64) -> Option<(Tick, u32)> {
        let Self { machine, position_cycles, step, output, ahead, .. } = self;
        let setpoint = output.setpoint.as_ref()?;
        let next = ahead.setpoint.as_ref().unwrap_or(setpoint);
        for axis in machine.axis_ids() {
            let cycle = &position_cycles[axis.index()];
            if !offset.is_multiple_of(cycle.ticks) {
                step.inputs[axis] = None;
                continue;
            }
            let sent = cycle.fine.at(&setpoint.axes[axis], &next.axes[axis], offset / cycle.ticks);
            step.sent[axis] = sent;
            step.inputs[axis] = Some(DriveInput {
                position_setpoint_lu: sent.position_lu,
                load_n_m: 0.0,
                feedforward_active: setpoint.feedforward_active,
            });
        }
        Some((Tick(setpoint.tick.0 + offset), setpoint.path.block.line))
    }

    /// Every drive alone, with the rows between its position ticks.
    fn step_with_rows(&mut self, tick: Tick) {
        let Self { drives, step, position_cycles, output, .. } = self;
        for ((axis, cycle), drive) in self.machine.axis_ids().zip(position_cycles).zip(drives.drives_mut()) {
            let (setpoint, rows) = (step.sent[axis], &mut output.rows);
            if let Some(input) = step.inputs[axis] {
                step.signals[axis] = cycle
                    .rows
                    .step(drive, input, tick, |tick, signals| rows.push(AxisRow { tick, axis, setpoint, signals }));
            }
        }
    }

    /// Tool poses and contour error at the set-point.
    fn measure(&mut self) {
        let Self { output, kinematics, contour_error, drives, poses, .. } = self;
        let Some(setpoint) = output.setpoint.as_ref().filter(|_| *poses) else { return };
        let sent = MachinePoint(PerAxis::from_fn(|axis| setpoint.axes[axis].position_lu));
        output.tool_setpoint = kinematics.tip_pose(&sent, &setpoint.tool_length);
        output.tool_actual = output.tool_setpoint;
        if !drives.has_cascade() {
            return;
        }
        let mut actual = sent;
        for row in output.rows.iter().filter(|row| row.tick == setpoint.tick) {
            actual.0[row.axis] = row.signals.position_actual_lu;
        }
        output.tool_actual = kinematics.tip_pose(&actual, &setpoint.tool_length);
        contour_error.push(output.tool_setpoint.position_mm);
        output.contour_error_mm = contour_error.distance_mm(output.tool_actual.position_mm);
    }

    /// The spindle one t_s later.
    pub(super) fn step_spindle(&mut self, setpoint: &SpindleSetpoint) {
        self.output.spindle = self.spindle.step(setpoint);
    }

    /// The drives, for [`braking`](super::braking).
    pub(super) fn drives_mut(&mut self) -> &mut [Drive] {
        self.drives.drives_mut()
    }

    /// Ticks between rows.
    pub(super) fn row_ticks(&self) -> u64 {
        self.row_ticks
    }

    /// Ticks of the position cycle of an axis.
    pub(super) fn position_ticks(&self, axis: AxisId) -> u64 {
        self.position_cycles[axis.index()].ticks
    }

    /// Where what a cycle gives is put.
    pub(super) fn output_mut(&mut self) -> &mut CycleOutput {
        &mut self.output
    }

    /// What the last cycle produced.
    pub fn output(&self) -> &CycleOutput {
        &self.output
    }

    /// Figures of all cycles so far.
    pub fn figures(&self) -> &Figures {
        &self.figures
    }

    /// Time that exact stops have waited for the axes.
    pub fn waited_s(&self) -> f64 {
        self.interpolator.waited_s()
    }

    /// The machine.
    pub fn machine(&self) -> &Arc<Machine> {
        &self.machine
    }

    /// Warnings and alarm of preparation; complete when the path has ended.
    pub fn take_findings(&mut self) -> Findings {
        self.source.take_findings()
    }
}
