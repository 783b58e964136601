//! One interpolator cycle: set-point, drives, figures.
//!
//! In: planned pieces. Out: [`CycleOutput`] per t_s, in a buffer that is reused: the cycle does not allocate once it has grown. The
//! set-point of the next cycle is sampled one cycle early, because the fine interpolator runs between two known set-points. Does not
//! record, print or wait: the caller does.

use super::contour_error::ContourErrorMeter;
use super::figures::Figures;
use super::preparation::{Findings, PieceSource, Preparation};
use crate::base::clock::gcd;
use crate::base::{AxisId, Diagnostic, MachinePoint, PerAxis, Tick};
use crate::drive::{AxisSignals, Drive, DriveInput, IdealDrive, Start};
use crate::interpolator::{AxisSetpoint, Begun, FineInterpolator, Interpolator, Setpoint};
use crate::interpreter::Setup;
use crate::kinematics::{Kinematics, ToolPose};
use crate::machine::{Axis, Machine};
use std::sync::Arc;

/// How a cycle ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The output holds this cycle.
    Running,
    /// There was no cycle left: the path has ended.
    Finished,
}

/// One axis at one position tick.
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
}

impl PositionCycle {
    /// Without a drive an axis steps once a set-point.
    fn new(machine: &Machine, axis: &Axis, drives: bool) -> Self {
        let drive = axis.drive.as_ref().filter(|_| drives);
        let ticks = drive.map_or(machine.cycle.time_base.ticks_per_setpoint(), |drive| drive.position_cycle_ticks);
        Self { ticks, fine: FineInterpolator::new(machine, ticks) }
    }
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
    drives: Vec<Drive>,
    kinematics: Kinematics,
    contour_error: ContourErrorMeter,
    figures: Figures,
    ahead: Sampled,
    output: CycleOutput,
    next_setpoint: u64,
}

impl Kernel<Preparation> {
    /// At the start of `program`. With `drives` false every axis is ideal. The caller sees to it that [`unsupported`](crate::machine::unsupported)
    /// has nothing against the machine, as [`run`](super::run) does: a value that is not built yet would be passed over.
    pub fn new(machine: Arc<Machine>, program: impl Into<Setup>, drives: bool) -> Self {
        let source = Preparation::new(program, &machine);
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
        let row_ticks = position_cycles.iter().map(|cycle| cycle.ticks).fold(time_base.ticks_per_setpoint(), gcd);
        Self {
            source,
            interpolator: Interpolator::new(&machine),
            position_cycles,
            row_ticks,
            drives: stages,
            kinematics,
            contour_error: ContourErrorMeter::new(),
            figures: Figures::default(),
            ahead: Sampled { setpoint: None, begun: Vec::with_capacity(BEGUN_USUAL) },
            output,
            next_setpoint: 0,
            machine,
        }
    }

    /// Steps one cycle of t_s. `Running`: [`Kernel::output`] holds it. Errors: the alarm of a drive that has left all bounds.
    pub fn cycle(&mut self) -> Result<Status, Diagnostic> {
        if self.next_setpoint == 0 {
            self.sample_ahead();
        }
        std::mem::swap(&mut self.output.begun, &mut self.ahead.begun);
        self.output.setpoint = self.ahead.setpoint.take();
        let Some(setpoint) = self.output.setpoint else { return Ok(Status::Finished) };
        self.sample_ahead();
        for begun in &self.output.begun {
            self.figures.piece(begun);
        }
        self.figures.setpoint(&setpoint);
        self.step_drives(&setpoint)?;
        self.measure(&setpoint);
        Ok(Status::Running)
    }

    fn sample_ahead(&mut self) {
        let Self { interpolator, source, .. } = self;
        self.ahead.begun.clear();
        self.ahead.setpoint = interpolator.sample(self.next_setpoint, &mut || source.next_piece());
        interpolator.swap_begun(&mut self.ahead.begun);
        self.next_setpoint += 1;
    }

    /// All position ticks from this set-point up to the next one (only the first after the last set-point).
    fn step_drives(&mut self, setpoint: &Setpoint) -> Result<(), Diagnostic> {
        self.output.rows.clear();
        let last = self.ahead.setpoint.is_none();
        let next = self.ahead.setpoint.unwrap_or(*setpoint);
        let ticks = if last { 1 } else { self.machine.cycle.time_base.ticks_per_setpoint() };
        for offset in (0..ticks).step_by(self.row_ticks as usize) {
            for axis in self.machine.axis_ids() {
                let cycle = &self.position_cycles[axis.index()];
                if !offset.is_multiple_of(cycle.ticks) {
                    continue;
                }
                let sent = cycle.fine.at(&setpoint.axes[axis], &next.axes[axis], offset / cycle.ticks);
                let input = DriveInput {
                    position_setpoint_lu: sent.position_lu,
                    load_n_m: 0.0,
                    feedforward_active: setpoint.feedforward_active,
                };
                let drive = &mut self.drives[axis.index()];
                let signals = drive.step(input);
                let tick = Tick(setpoint.tick.0 + offset);
                if !drive.is_finite() {
                    return Err(diverged(&self.machine, axis, tick));
                }
                self.figures.drive(axis, &signals);
                self.output.rows.push(AxisRow { tick, axis, setpoint: sent, signals });
            }
        }
        Ok(())
    }

    /// Tool poses and contour error at the set-point.
    fn measure(&mut self, setpoint: &Setpoint) {
        let sent = MachinePoint(PerAxis::from_fn(|axis| setpoint.axes[axis].position_lu));
        let mut actual = sent;
        for row in self.output.rows.iter().filter(|row| row.tick == setpoint.tick) {
            actual.0[row.axis] = row.signals.position_actual_lu;
        }
        self.output.tool_setpoint = self.kinematics.tip_pose(&sent, &setpoint.tool_length);
        self.output.tool_actual = self.kinematics.tip_pose(&actual, &setpoint.tool_length);
        self.contour_error.push(self.output.tool_setpoint.position_mm);
        if self.drives.iter().any(|drive| matches!(drive, Drive::Cascade(_))) {
            self.output.contour_error_mm = self.contour_error.distance_mm(self.output.tool_actual.position_mm);
        }
    }

    /// What the last cycle produced.
    pub fn output(&self) -> &CycleOutput {
        &self.output
    }

    /// Figures of all cycles so far.
    pub fn figures(&self) -> &Figures {
        &self.figures
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

/// The alarm of a drive whose state is no longer finite.
pub(super) fn diverged(machine: &Machine, axis: AxisId, tick: Tick) -> Diagnostic {
    let name = &machine.axis(axis).name;
    let time_s = machine.cycle.time_base.time_s(tick);
    Diagnostic::error(
        "D0001",
        format!("axis {name} has left all bounds at {time_s:.4} s: its control loop is unstable"),
    )
    .help(format!("lower axes.{name}.drive.speed_gain_n_m_s_per_rad, current_gain_v_per_a or position_gain_per_s"))
}
