//! The checked machine: what every later room reads. Internal units (mm, rad, s, SI); made only by the checks of this room.
//!
//! In: nothing (plain data). Out: [`Machine`] and its parts. Invariants, guaranteed by `machine::load`: at least one axis, names
//! unique, every limit finite and positive, every period a whole number of ticks.

use super::drive_options::{DriveOptions, PositionSource};
use super::error_table::ErrorTable;
use crate::base::{AxisId, AxisKind, PerAxis, TimeBase};

/// A machine whose every value has been checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Name for people, such as "Spinner MVC 850".
    pub name: String,
    /// Control, such as "SINUMERIK 840D".
    pub control: String,
    /// Clock and interpolator cycle.
    pub cycle: Cycle,
    /// Motion blocks that the look-ahead sees beyond the active one.
    pub look_ahead_blocks: usize,
    /// `[feed]`.
    pub feed: FeedSettings,
    /// `[smoothing]`.
    pub smoothing: SmoothingSettings,
    /// `[spindle]`; `None`: the master spindle is at its speed at once.
    pub spindle: Option<SpindleSettings>,
    /// Highest speed of the master spindle; `None`: no limit.
    pub spindle_speed_max_rpm: Option<f64>,
    /// `[kinematics]`.
    pub kinematics: KinematicsSettings,
    /// Axes in order of their `index`; [`AxisId`] is the place in this list.
    pub axes: Vec<Axis>,
}

/// How the master spindle comes to its speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpindleSettings {
    /// In speed control.
    pub acceleration_rad_s2: f64,
    /// A feed waits until the speed is this near, as a share of it.
    pub tolerance_share: f64,
    /// A feed does not wait for the speed.
    pub starts_at_once: bool,
    /// A feed behind M5 waits as well.
    pub waits_for_stop: bool,
    /// Speed of positioning, and at which a spindle that turns goes over to it.
    pub positioning_speed_rad_s: f64,
    /// Acceleration of positioning and of tapping.
    pub positioning_acceleration_rad_s2: f64,
    /// Delay of first order from the set-point of the speed to the actual one; 0: none.
    pub lag_s: f64,
}

impl Machine {
    /// All axes, in order.
    pub fn axis_ids(&self) -> impl DoubleEndedIterator<Item = AxisId> + ExactSizeIterator + Clone + use<> {
        AxisId::first(self.axes.len())
    }

    /// Data of one axis.
    pub fn axis(&self, id: AxisId) -> &Axis {
        &self.axes[id.index()]
    }

    /// The axis of that name, case-blind.
    pub fn axis_by_name(&self, name: &str) -> Option<AxisId> {
        self.axis_ids().find(|id| self.axis(*id).name.eq_ignore_ascii_case(name))
    }

    /// Axes whose drive holds representative values: every figure that depends on one of them says so.
    pub fn representative_drives(&self) -> impl Iterator<Item = AxisId> + '_ {
        self.axis_ids().filter(|id| self.axis(*id).drive.as_ref().is_some_and(|drive| !drive.identified))
    }

    /// Axes without a drive: actual = set-point.
    pub fn ideal_axes(&self) -> impl Iterator<Item = AxisId> + '_ {
        self.axis_ids().filter(|id| self.axis(*id).drive.is_none())
    }

    /// True for every linear axis: the mask of the path length in mm.
    pub fn linear_mask(&self) -> PerAxis<bool> {
        let mut mask = PerAxis::splat(false);
        for id in self.axis_ids() {
            mask[id] = self.axis(id).kind == AxisKind::Linear;
        }
        mask
    }
}

/// Clock of the control.
#[derive(Clone, Debug, PartialEq)]
pub struct Cycle {
    /// Ticks: every period below is a whole number of them.
    pub time_base: TimeBase,
    /// Cycle time of the control.
    pub control_cycle_s: f64,
    /// Sampling factor f_s, so that t_s = f_s * t_cyl.
    pub sampling_ratio: f64,
    /// From t_s to the position cycle, where they differ.
    pub fine_interpolation: FineInterpolation,
}

/// MD33000.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FineInterpolation {
    /// Straight between two set-points.
    Linear,
    /// Cubic through position and velocity of two set-points.
    Cubic,
}

/// Path mode, G group 10.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PathMode {
    /// G60 (or G9 for one block): stop at every block end.
    ExactStop,
    /// G64: continuous path, geometry unchanged.
    G64,
    /// G641: rounding within a distance (ADIS, ADISPOS).
    G641,
    /// G642: rounding within a contour tolerance.
    G642,
    /// G643: rounding inside the block.
    G643,
    /// G644: rounding with the best dynamics.
    G644,
    /// G645: as G642, and at tangential transitions too.
    G645,
}

/// G group 21.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AccelerationMode {
    /// Jerk-limited.
    Soft,
    /// Acceleration-limited only.
    Brisk,
    /// As `Brisk`, with less acceleration at high speed (MD35220).
    Drive,
}

/// `[feed] time_law`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeLawKind {
    /// Acceleration zero at piece ends, as published.
    SevenPhase,
    /// Acceleration carried over piece ends.
    Continuous,
}

/// `[feed] corner_rule`: the axis-velocity step that G64 allows at a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CornerRule {
    /// sqrt(8 A e) [Lavernhe 2008].
    FollowUp,
    /// overload_factor * A * t_s (MD32310).
    Overload,
}

/// "signed": curvature with its sense, as geometry has it; "printed": as the paper prints it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurvatureJump {
    /// |k1 - k2| with sign.
    Signed,
    /// | |k1| - |k2| | [Gassara 2013].
    Printed,
}

/// Limits on arcs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArcLimits {
    /// Worst direction met on the arc.
    Worst,
    /// Direction at the block entry only [Gassara 2013].
    Printed,
}

/// `[feed]`.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedSettings {
    /// How speed runs over a piece.
    pub time_law: TimeLawKind,
    /// Path mode before the program says otherwise.
    pub default_path_mode: PathMode,
    /// Acceleration mode before the program says otherwise.
    pub default_acceleration_mode: AccelerationMode,
    /// Corner speed in G64.
    pub corner_rule: CornerRule,
    /// MD32310, for `CornerRule::Overload`.
    pub overload_ratio: f64,
    /// Transition feed between arcs.
    pub curvature_jump: CurvatureJump,
    /// Feed limits of an arc.
    pub arc_limits: ArcLimits,
}

/// `[smoothing] blend_law`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlendLaw {
    /// All limits hold everywhere inside a blend.
    Limits,
    /// The feed that is allowed at the entry is held through the blend.
    Entry,
    /// The printed loop.
    Published,
}

/// `[smoothing] shape`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlendShape {
    /// The published cubic.
    Hermite3,
    /// Continuous curvature.
    Quintic,
}

/// `[smoothing] limits`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlendLimits {
    /// Per axis.
    Axis,
    /// Tangential and normal limits of the path.
    Path,
}

/// `[smoothing] compressor_blocks` (MD20482, hundreds): blocks that the compressor takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompressorBlocks {
    /// G1 (0).
    Lines,
    /// G1, G2, G3, CIP, CT (1).
    Arcs,
    /// G1 and G0 (2).
    Rapids,
    /// All of them (3).
    All,
}

impl CompressorBlocks {
    /// Circles and helices are taken.
    pub fn arcs(self) -> bool {
        matches!(self, Self::Arcs | Self::All)
    }

    /// Rapids are taken.
    pub fn rapids(self) -> bool {
        matches!(self, Self::Rapids | Self::All)
    }
}

/// `[smoothing]`, models/local-smoothing.md.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothingSettings {
    /// End tangents of the blend are alpha * T.
    pub alpha_ratio: f64,
    /// beta: executed over programmed tolerance.
    pub tolerance_ratio: f64,
    /// beta where an axis reverses.
    pub tolerance_reversal_ratio: f64,
    /// G642 without CTOL.
    pub contour_tolerance_mm: f64,
    /// G641 without ADIS; `None`: 0, which is G64.
    pub rounding_distance_mm: Option<f64>,
    /// R_A (MD20602).
    pub radial_acceleration_share: f64,
    /// R_J (MD20603).
    pub radial_jerk_share: f64,
    /// Feed inside a blend.
    pub blend_law: BlendLaw,
    /// Curve of a blend.
    pub shape: BlendShape,
    /// Which limits a blend is planned with.
    pub limits: BlendLimits,
    /// Rotary axes without OTOL (SD42466).
    pub orientation_tolerance_rad: f64,
    /// G645 at changes of curvature (MD33120).
    pub transition_tolerance_mm: f64,
    /// Between rapids without STOLF (MD20560).
    pub rapid_tolerance_ratio: f64,
    /// Blocks that the compressor takes (MD20482).
    pub compressor_blocks: CompressorBlocks,
    /// Longest block for the compressor (MD20170).
    pub compressor_length_max_mm: f64,
    /// Turning angle that the compressor leaves as a corner (SD42470).
    pub compressor_corner_rad: f64,
}

/// One rotary axis of the kinematic chain.
#[derive(Clone, Debug, PartialEq)]
pub struct RotaryJoint {
    /// The axis that turns.
    pub axis: AxisId,
    /// Unit vector; a positive angle turns what the axis carries right-handed about it.
    pub direction: [f64; 3],
    /// A point on the axis.
    pub point_mm: [f64; 3],
}

/// `[kinematics]`.
#[derive(Clone, Debug, PartialEq)]
pub enum KinematicsSettings {
    /// Linear axes only, or rotary axes without transformation.
    Cartesian,
    /// Rotary axes of the table, from the machine base to the part, and of the head, from the base to the tool.
    Rotary {
        /// Between machine base and part.
        table: Vec<RotaryJoint>,
        /// Between machine base and tool.
        head: Vec<RotaryJoint>,
    },
}

/// One axis. `lu` is mm for a linear axis, rad for a rotary one.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Name in programs and recordings.
    pub name: String,
    /// Linear or rotary.
    pub kind: AxisKind,
    /// Number of the machine axis in machine data and trace signals, from 1.
    pub index: u32,
    /// Name of the machine axis, such as "AX1".
    pub machine_axis: Option<String>,
    /// Velocity, acceleration, jerk.
    pub limits: AxisLimits,
    /// `[axes.*.dynamics.*]`: limits of DYNNORM .. DYNPREC where they differ.
    pub dynamics: AxisDynamics,
    /// DRIVE: what is taken off the acceleration at high speed.
    pub acceleration_reduction: AccelerationReduction,
    /// e of the corner rule.
    pub follow_up_tolerance_lu: f64,
    /// Software limits, if any.
    pub travel_lu: Option<[f64; 2]>,
    /// Position at program start.
    pub home_lu: f64,
    /// Endless rotary axis.
    pub modulo: bool,
    /// Drive, motor, mechanics, encoder; `None`: an ideal axis, actual = set-point.
    pub drive: Option<DriveData>,
}

/// Dynamic limits of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisLimits {
    /// V, MD32000.
    pub velocity_max_lu_s: f64,
    /// A, MD32300.
    pub acceleration_max_lu_s2: f64,
    /// J, MD32431.
    pub jerk_max_lu_s3: f64,
    /// Jtb, MD32432: jerk inside a blend.
    pub transition_jerk_max_lu_s3: f64,
}

/// DRIVE: less acceleration at high speed, as the torque of a motor falls there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccelerationReduction {
    /// MD35220: share of the velocity limit above which the acceleration is lower; 1: nowhere.
    pub velocity_ratio: f64,
    /// MD35230: share of the acceleration that is taken off there; 0: nothing.
    pub reduction_ratio: f64,
}

/// G group 59: what an axis may do in a kind of machining.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DynamicsMode {
    /// DYNNORM, `[axes.*.dynamics.norm]`.
    Norm,
    /// DYNPOS, `[axes.*.dynamics.position]`.
    Position,
    /// DYNROUGH, `[axes.*.dynamics.rough]`.
    Rough,
    /// DYNSEMIFIN, `[axes.*.dynamics.semifinish]`.
    SemiFinish,
    /// DYNFINISH, `[axes.*.dynamics.finish]`.
    Finish,
    /// DYNPREC, `[axes.*.dynamics.precision]`; where that is missing, as DYNFINISH.
    Precision,
}

impl DynamicsMode {
    /// All six, in the order of the machine-data index.
    pub const ALL: [Self; 6] =
        [Self::Norm, Self::Position, Self::Rough, Self::SemiFinish, Self::Finish, Self::Precision];

    /// Its name in a machine file.
    pub fn word(self) -> &'static str {
        match self {
            Self::Norm => "norm",
            Self::Position => "position",
            Self::Rough => "rough",
            Self::SemiFinish => "semifinish",
            Self::Finish => "finish",
            Self::Precision => "precision",
        }
    }
}

/// The six dynamics sets of an axis; the default is none, so that the limits of the axis hold in every mode.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct AxisDynamics([Option<AxisLimits>; 6]);

impl AxisDynamics {
    /// The limits given for a mode; `None`: those of the axis hold. DYNPREC without a set of its own is DYNFINISH: controls that
    /// have five sets know no more.
    pub fn get(&self, mode: DynamicsMode) -> Option<&AxisLimits> {
        let given = self.0[mode as usize].as_ref();
        if mode == DynamicsMode::Precision { given.or(self.0[DynamicsMode::Finish as usize].as_ref()) } else { given }
    }

    /// Gives a mode limits of its own.
    pub fn set(&mut self, mode: DynamicsMode, limits: AxisLimits) {
        self.0[mode as usize] = Some(limits);
    }
}

/// `[axes.*.drive]` with motor, mechanics and encoder; symbols of models/drive.md section 2 in brackets.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveData {
    /// False: representative values; every figure that depends on them says so.
    pub identified: bool,
    /// MD36000.
    pub in_position_coarse_lu: f64,
    /// MD36010.
    pub in_position_fine_lu: f64,
    /// What the control watches besides.
    pub monitoring: MonitoringData,
    /// T_p in ticks.
    pub position_cycle_ticks: u64,
    /// T_v in ticks.
    pub speed_cycle_ticks: u64,
    /// T_i in ticks.
    pub current_cycle_ticks: u64,
    /// `Kv`, MD32200.
    pub position_gain_per_s: f64,
    /// `kvff`, MD32610.
    pub velocity_feedforward_ratio: f64,
    /// `ktff`.
    pub torque_feedforward_ratio: f64,
    /// `J_ff`, MD32650.
    pub feedforward_inertia_kg_m2: f64,
    /// `d_pos`.
    pub setpoint_delay_s: f64,
    /// `d_ff`.
    pub feedforward_delay_s: f64,
    /// `v_max`; may be infinite.
    pub speed_setpoint_max_lu_s: f64,
    /// `Kp`, p1460.
    pub speed_gain_n_m_s_per_rad: f64,
    /// `Tn`, p1462; may be infinite (no integral part).
    pub speed_reset_time_s: f64,
    /// `Kpi`, p1715.
    pub current_gain_v_per_a: f64,
    /// `Tni`, p1717; may be infinite.
    pub current_reset_time_s: f64,
    /// `i_max`; may be infinite.
    pub current_max_a: f64,
    /// `u_max`; may be infinite.
    pub voltage_max_v: f64,
    /// Motor.
    pub motor: MotorData,
    /// Mechanics.
    pub mechanics: MechanicsData,
    /// Error of the screw: how much further the load is than `transmission_lu_per_rad` says.
    pub pitch_error: Option<ErrorTable>,
    /// Encoders.
    pub encoder: EncoderData,
    /// MD32700, $AA_ENC_COMP: added to the measured position.
    pub encoder_compensation: Option<ErrorTable>,
    /// Filters, compensations and limits besides the cascade.
    pub options: DriveOptions,
}

/// What the control watches; infinite: not watched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MonitoringData {
    /// MD36020.
    pub positioning_time_s: f64,
    /// MD36030.
    pub standstill_lu: f64,
    /// MD36040.
    pub standstill_delay_s: f64,
    /// MD36400.
    pub contour_lu: f64,
    /// MD36220: how long the speed set-point may be at its limit.
    pub speed_limit_time_s: f64,
    /// MD36050.
    pub clamping_lu: f64,
    /// M functions that clamp and release the axis.
    pub clamp_m_functions: Option<[u32; 2]>,
    /// MD36610: time in which an alarm brings the axis to rest.
    pub stop_time_s: f64,
}

/// `[axes.*.motor]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorData {
    /// `R`.
    pub resistance_ohm: f64,
    /// `L`.
    pub inductance_h: f64,
    /// `Ke`.
    pub back_emf_v_s_per_rad: f64,
    /// `Kt`.
    pub torque_constant_n_m_per_a: f64,
}

/// `[axes.*.mechanics]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MechanicsData {
    /// `r`: load motion per motor radian (mm/rad or rad/rad); may be negative, never 0.
    pub transmission_lu_per_rad: f64,
    /// `J`.
    pub inertia_kg_m2: f64,
    /// `B`.
    pub viscous_friction_n_m_s_per_rad: f64,
    /// `Tc`.
    pub coulomb_friction_n_m: f64,
    /// `Ts`.
    pub breakaway_friction_n_m: f64,
    /// `g0`.
    pub gravity_n_m: f64,
    /// `gs`.
    pub gravity_sin_n_m: f64,
    /// `gc`.
    pub gravity_cos_n_m: f64,
    /// Play between motor and load; 0 = none.
    pub backlash_lu: f64,
    /// `Jl`: share of `J` behind a spring; 0 = a rigid axis. Less than `J`.
    pub load_inertia_kg_m2: f64,
    /// `c`, between motor and load; positive where there is a load inertia.
    pub coupling_stiffness_n_m_per_rad: f64,
    /// `d`, between motor and load.
    pub coupling_damping_n_m_s_per_rad: f64,
}

/// `[axes.*.encoder]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderData {
    /// `q_pos`; 0 = ideal.
    pub position_resolution_lu: f64,
    /// `q_mot`; 0 = ideal.
    pub motor_resolution_rad: f64,
    /// MD31040.
    pub position_source: PositionSource,
}
