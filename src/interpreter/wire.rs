//! The wire out of the interpreter: a small machine-independent vocabulary of moves, as a canonical listing shows it.
//!
//! In: nothing (plain data). Out: [`Move`].

use crate::base::{AxisId, AxisVector, PartPoint, PerAxis};
use crate::machine::{AccelerationMode, DynamicsMode, PathMode};
pub use crate::program::words::{Compressor, ExactStop};
use crate::program::{BlockRef, Cadence, OpenedProgram};
use std::sync::Arc;

/// One executed block that moves, waits or does something.
#[derive(Clone, Debug, PartialEq)]
pub struct Move {
    /// Where it comes from.
    pub block: BlockRef,
    /// What it does.
    pub kind: MoveKind,
    /// All axes at its end, after all frames, without tool length (mm, rad). Equals the start for waits and functions.
    pub end: PartPoint,
    /// Programmed feed.
    pub feed: Feed,
    /// Modes in force.
    pub modes: Modes,
    /// RND, RNDM, CHF, CHR: what is put into the corner at its end.
    pub corner: Option<Box<CornerInsert>>,
    /// What happens at its start, in order of output. Empty for most blocks (an empty `Vec` does not allocate).
    pub events: Vec<Event>,
}

/// What a move does.
#[derive(Clone, Debug, PartialEq)]
pub enum MoveKind {
    /// G0: straight line at the axes' limits.
    Rapid,
    /// G1.
    Line,
    /// G2, G3, CIP, CT with the circle in a plane of two axes, also as helix.
    Arc(ArcGeometry),
    /// The same with the circle in any other plane.
    SpatialArc(Box<SpatialArcGeometry>),
    /// ASPLINE, BSPLINE, CSPLINE.
    Spline(Arc<PolynomialGeometry>),
    /// POLY.
    Polynomial(Arc<PolynomialGeometry>),
    /// Axes that move on their own, outside the path: POS, POSA, G0 under RTLIOF. All others stand.
    Position(Arc<[AxisPositioning]>),
    /// G4: stands still.
    Dwell {
        /// Length of the wait.
        time_s: f64,
    },
    /// No motion: only its events. `end` differs from the end of the move before where the tool has changed: the axes stand, and the
    /// tip of another tool is elsewhere.
    Function {
        /// The path must come to rest before it (M0, M1, M2, M30, M6).
        stops: bool,
    },
    /// WAITP, and the end of a block with POS: the path rests until these axes have reached what POS or POSA gave them.
    WaitPositioned(PerAxis<bool>),
    /// STOPRE or the reading of a main-run variable: the path comes to rest, and preparation goes on only when the interpreter has
    /// been told the time of the main run.
    StopPreparation,
}

/// An arc or helix that starts where the move before ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArcGeometry {
    /// First and second axis of the plane (G17: X, Y; G18: Z, X; G19: Y, Z).
    pub plane: [AxisId; 2],
    /// Centre in these two axes, absolute, after frames; start and end lie on the circle to rounding.
    pub centre_mm: [f64; 2],
    /// Radius.
    pub radius_mm: f64,
    /// Swept angle, positive from the first axis towards the second (G3), full circles included. All other axes move linearly with it.
    pub sweep_rad: f64,
}

/// An arc or helix in a plane that no two axes span, from where the move before ended.
#[derive(Clone, Debug, PartialEq)]
pub struct SpatialArcGeometry {
    /// Unit vectors of the plane, at right angles, components of the linear axes: the angle counts from the first to the second.
    pub directions: [AxisVector; 2],
    /// A point on the axis of rotation; components of axes that do not take part are 0.
    pub centre_mm: AxisVector,
    /// Radius.
    pub radius_mm: f64,
    /// Swept angle, positive from the first direction towards the second, full circles included. What start and end differ in across
    /// the plane, and all other axes, move linearly with it.
    pub sweep_rad: f64,
}

/// Polynomials of the parameter u, one after another; start and end of the move are on them to rounding.
#[derive(Clone, Debug, PartialEq)]
pub struct PolynomialGeometry {
    /// In order, at least one; each begins where the one before ends.
    pub pieces: Vec<PolynomialPiece>,
}

/// q(u) = numerator(u) / denominator(u), 0 <= u <= parameter_end_ratio.
#[derive(Clone, Debug, PartialEq)]
pub struct PolynomialPiece {
    /// Last u; the parameter has no unit.
    pub parameter_end_ratio: f64,
    /// Coefficients of u^0 .. u^5 of every axis (mm, rad).
    pub numerator_lu: [AxisVector; 6],
    /// Coefficients of u^0 .. u^5 common to all geometry axes; [1, 0, 0, 0, 0, 0] for a plain polynomial. Rotary axes are not divided.
    pub denominator_ratio: [f64; 6],
}

/// One axis that moves on its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisPositioning {
    /// Which axis.
    pub axis: AxisId,
    /// From where it was told to go last.
    pub start_lu: f64,
    /// Where to.
    pub end_lu: f64,
    /// FA with OVRA; `None`: as fast as it can.
    pub feed_lu_s: Option<f64>,
    /// SOFTA; false: BRISKA or DRIVEA.
    pub jerk_limited: bool,
}

/// Axes that set out on their own, with what then held about their limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Positioning {
    /// Each axis once.
    pub axes: Arc<[AxisPositioning]>,
    /// ACC, VELOLIM, JERKLIM.
    pub programmed: Option<Arc<ProgrammedLimits>>,
}

/// What RND, RNDM, CHF or CHR put into a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerInsert {
    /// Fillet or chamfer.
    pub shape: CornerShape,
    /// Plane in which the corner lies: first and second axis.
    pub plane: [AxisId; 2],
    /// Where frames tilt the plane: unit vectors in it, at right angles, components of the linear axes.
    pub directions: Option<[AxisVector; 2]>,
    /// FRC or FRCM; `None`: the feed of the block that leads away.
    pub feed_mm_s: Option<f64>,
}

/// Fillet or chamfer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CornerShape {
    /// RND, RNDM.
    Fillet {
        /// Radius.
        radius_mm: f64,
    },
    /// CHF: length of the chamfer.
    ChamferBase {
        /// Across the corner.
        length_mm: f64,
    },
    /// CHR: what it takes of each block.
    ChamferLeg {
        /// Along the motion.
        length_mm: f64,
    },
}

/// Feed of a move.
#[derive(Clone, Debug, PartialEq)]
pub enum Feed {
    /// As fast as the axes can.
    Rapid,
    /// Along the path of the linear axes, mm/s; of the rotary axes, rad/s, where no linear axis moves.
    Path {
        /// F word.
        feed_lu_s: f64,
    },
    /// Along the path as `Path`, but changing: highest feed on each of as many stretches of equal length as there are values
    /// (FLIN, FCUB, G96).
    Varying {
        /// One value a stretch, in order; at least one.
        feeds_lu_s: Arc<[f64]>,
    },
}

/// Modes that later rooms act on.
#[derive(Clone, Debug, PartialEq)]
pub struct Modes {
    /// How the end of this block meets the next (G9 is `ExactStop` for its one block).
    pub path_mode: PathMode,
    /// CTOL; `None`: the machine's `contour_tolerance_mm`.
    pub contour_tolerance_mm: Option<f64>,
    /// ADIS (or ADISPOS for rapids); `None`: the machine's default.
    pub rounding_distance_mm: Option<f64>,
    /// What an exact stop waits for.
    pub exact_stop: ExactStop,
    /// COMPON and its kin.
    pub compressor: Compressor,
    /// SOFT, BRISK or DRIVE.
    pub acceleration_mode: AccelerationMode,
    /// DYNNORM and its kin: which limits of the axes hold.
    pub dynamics: DynamicsMode,
    /// ACC, VELOLIM, JERKLIM, FL, ATOL, OVR and so on; `None` where nothing of it is programmed.
    pub programmed: Option<Arc<ProgrammedLimits>>,
    /// Active tool edge; `None`: no tool, length 0.
    pub tool: Option<Arc<ToolOffset>>,
    /// FFWON or FFWOF; starts on, as the machine file's weights say (MD32630 and docs).
    pub feedforward_active: bool,
    /// G33 and its kin: this block and the master spindle are one motion.
    pub thread: Option<Arc<Thread>>,
    /// G96 and its kin: the master spindle follows the distance from its axis.
    pub cutting: Option<Arc<CuttingSpeed>>,
    /// G95 and its kin: F counts revolutions of the simulated spindle at this speed, rad/s, and follows it while it changes.
    pub revolution_rad_s: Option<f64>,
}

/// A constant cutting speed: the speed of the spindle is `speed / radius`, within limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CuttingSpeed {
    /// S under G96.
    pub speed_mm_s: f64,
    /// Its distance from 0 in the part is the radius.
    pub axis: AxisId,
    /// Lowest and highest speed: G25 S, LIMS and G26 S.
    pub limits_rad_s: [f64; 2],
}

impl CuttingSpeed {
    /// Speed of the spindle at a place, positive.
    pub fn speed_rad_s(&self, position_mm: f64) -> f64 {
        let [low_rad_s, high_rad_s] = self.limits_rad_s;
        (self.speed_mm_s / position_mm.abs()).max(low_rad_s).min(high_rad_s)
    }
}

/// How a block and the master spindle move together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thread {
    /// Which of the two leads.
    pub coupling: ThreadCoupling,
    /// Path in one revolution of the spindle, where the block begins; positive.
    pub rise_mm: f64,
    /// By how much that grows from one revolution to the next (G34; negative: G35).
    pub rise_change_mm: f64,
    /// Programmed speed of the spindle, positive.
    pub speed_rad_s: f64,
    /// DITS and DITE: path in which the axis comes to the speed of the thread, and leaves it; `None`: as its limits allow.
    pub runs_mm: [Option<f64>; 2],
    /// The spindle is the one of the machine file; if not (SETMS), nothing waits for its angle, and it does not turn with the path.
    pub simulated: bool,
}

/// Which of axis and spindle leads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ThreadCoupling {
    /// G33, G34, G35: the path follows the spindle.
    Cut {
        /// SF: angle of the spindle at which the block begins; `None`: it goes on from the thread before.
        start_angle_rad: Option<f64>,
    },
    /// G331, G332: the spindle follows the path, from rest to rest.
    Tap {
        /// 1: as with M3 while the path goes on; -1: as with M4.
        sense_ratio: f64,
    },
}

impl Thread {
    /// Path in one revolution of the spindle where `length_mm` of the block are done; not a number where it turns back before that.
    pub fn rise_at_mm(&self, length_mm: f64) -> f64 {
        (self.rise_mm * self.rise_mm + 2.0 * self.rise_change_mm * length_mm).sqrt()
    }

    /// True for G33, G34, G35.
    pub fn is_cut(&self) -> bool {
        matches!(self.coupling, ThreadCoupling::Cut { .. })
    }
}

/// What the program says about limits and tolerances of single axes, and factors of all.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgrammedLimits {
    /// ACC: share of the axis acceleration.
    pub acceleration_ratio: PerAxis<f64>,
    /// VELOLIM: share of the axis velocity.
    pub velocity_ratio: PerAxis<f64>,
    /// JERKLIM: share of the axis jerk.
    pub jerk_ratio: PerAxis<f64>,
    /// FL: highest velocity of a synchronous axis (one outside FGROUP) in feed motions.
    pub synchronous_max_lu_s: PerAxis<Option<f64>>,
    /// OVR: share of the programmed feed.
    pub override_ratio: f64,
    /// Overrides of the feed act: not on G63.
    pub override_acts: bool,
    /// OVRRAP: share of the rapid velocity; more than 1 is 1.
    pub rapid_override_ratio: f64,
    /// OTOL: tolerance of rotary axes.
    pub orientation_tolerance_rad: Option<f64>,
    /// ATOL: tolerance of single axes.
    pub axis_tolerance_lu: PerAxis<Option<f64>>,
    /// STOLF: factor of the tolerances between rapids (MD20560).
    pub rapid_tolerance_ratio: Option<f64>,
    /// Axes of FGROUP; `None`: the linear axes. The path of these axes runs at the programmed feed.
    pub feed_group: Option<PerAxis<bool>>,
    /// FGREF: radius at which a rotary axis of FGROUP counts.
    pub reference_radius_mm: PerAxis<f64>,
}

impl Default for ProgrammedLimits {
    fn default() -> Self {
        Self {
            acceleration_ratio: PerAxis::splat(1.0),
            velocity_ratio: PerAxis::splat(1.0),
            jerk_ratio: PerAxis::splat(1.0),
            synchronous_max_lu_s: PerAxis::splat(None),
            override_ratio: 1.0,
            override_acts: true,
            rapid_override_ratio: 1.0,
            orientation_tolerance_rad: None,
            axis_tolerance_lu: PerAxis::splat(None),
            rapid_tolerance_ratio: None,
            feed_group: None,
            // 1 mm a radian: with FGREF = 180 / pi a degree counts as a millimetre, the control's start value.
            reference_radius_mm: PerAxis::splat(crate::base::units::DEG_PER_RAD),
        }
    }
}

/// The active edge of the active tool.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolOffset {
    /// T word, number or name.
    pub tool: Arc<str>,
    /// D.
    pub edge: u32,
    /// Position of the axes minus position of the tip, in part space (with the plane of the tool applied, wear included).
    pub length: AxisVector,
    /// Radius with wear.
    pub radius_mm: f64,
}

impl Modes {
    /// A path mode, and nothing else said: SOFT, FFWON, no tool.
    pub fn new(path_mode: PathMode) -> Self {
        Self {
            path_mode,
            contour_tolerance_mm: None,
            rounding_distance_mm: None,
            exact_stop: ExactStop::Fine,
            compressor: Compressor::Off,
            acceleration_mode: AccelerationMode::Soft,
            dynamics: DynamicsMode::Norm,
            programmed: None,
            tool: None,
            feedforward_active: true,
            thread: None,
            cutting: None,
            revolution_rad_s: None,
        }
    }
}

/// What the main run tells the interpreter when the path has come to rest for a `StopPreparation`.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct MainRun {
    /// Time since the program began.
    pub time_s: f64,
    /// Of it, time in feed motions.
    pub cutting_time_s: f64,
}

/// A synchronised action on $AC_OVR.
#[derive(Clone, Debug, PartialEq)]
pub struct SynchronisedAction {
    /// ID; `None`: it ends with the block that it begins with.
    pub id: Option<u32>,
    /// How often it happens.
    pub cadence: Cadence,
    /// On what.
    pub condition: Condition,
    /// $AC_OVR, for the cycles in which it happens.
    pub override_ratio: f64,
}

/// A condition of the main run.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// Known beforehand.
    Constant(bool),
    /// A value of the main run against one that is known beforehand, in the unit of [`Watched`].
    Compare(Watched, Relation, f64),
    /// NOT.
    Not(Box<Condition>),
    /// AND.
    All(Box<[Condition; 2]>),
    /// OR.
    Any(Box<[Condition; 2]>),
}

/// What can be watched at each set-point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watched {
    /// $AA_IM: mm or rad.
    Position(AxisId),
    /// $AC_TIME: s since the block began.
    BlockTime,
    /// $AC_TIMEC: cycles since then.
    BlockCycles,
    /// $AC_PATHN: done of the block, 0 to 1.
    PathShare,
    /// $AC_DTBB: way since the block began, mm.
    WayDone,
    /// $AC_DTEB: way to its end, mm.
    WayLeft,
    /// $AC_VACTB: speed on the path, mm/s.
    PathVelocity,
}

/// How two values are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// ==
    Equal,
    /// <>
    Unequal,
    /// <
    Less,
    /// <=
    NotGreater,
    /// >
    Greater,
    /// >=
    NotLess,
}

impl Relation {
    /// With its sides exchanged.
    pub fn turned(self) -> Self {
        match self {
            Self::Less => Self::Greater,
            Self::NotGreater => Self::NotLess,
            Self::Greater => Self::Less,
            Self::NotLess => Self::NotGreater,
            same => same,
        }
    }

    /// Whether it holds.
    pub fn holds(self, left: f64, right: f64) -> bool {
        match self {
            Self::Equal => left == right,
            Self::Unequal => left != right,
            Self::Less => left < right,
            Self::NotGreater => left <= right,
            Self::Greater => left > right,
            Self::NotLess => left >= right,
        }
    }
}

/// What is output at the start of a block.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A program file was opened for the first time.
    ProgramOpened(OpenedProgram),
    /// M function.
    MFunction(u32),
    /// Spindle speed word.
    SpindleSpeed {
        /// S word.
        speed_rpm: f64,
    },
    /// Tool word, number or name as text.
    Tool(Arc<str>),
    /// Tool edge.
    Edge(u32),
    /// MSG("..."); empty clears.
    Message(Arc<str>),
    /// $AN_SLTRACE = 1 (true): the trace starts; = 2: it stops.
    Trace(bool),
    /// H function.
    HFunction(f64),
    /// Axes set out on their own (smoothing makes it of a `MoveKind::Position`).
    Position(Arc<Positioning>),
    /// A synchronised action that begins.
    Synchronised(Arc<SynchronisedAction>),
    /// CANCEL: the actions of these numbers end.
    CancelSynchronised(Arc<[u32]>),
    /// S, M, SPOS of a spindle other than the master spindle: as text, such as "S2=500".
    Spindle(Arc<str>),
    /// SPOS, SPOSA, M19 of the master spindle.
    SpindlePosition(Arc<SpindlePositioning>),
    /// The path rests until the master spindle is at its speed or position.
    SpindleWait,
    /// ACC of the spindle, for the ramps that begin from here on.
    SpindleAcceleration {
        /// 1: that of the machine.
        ratio: f64,
    },
    /// What the program asks of the path from here on (smoothing makes it of a motion block, for recordings).
    Programmed(Arc<ProgrammedBlock>),
}

impl Event {
    /// It only tells what the program says: nothing depends on it.
    pub fn only_tells(&self) -> bool {
        matches!(self, Self::Programmed(_))
    }
}

/// The contour of one block as the program asks for it: RND and CHF are in it, blends and the compressor are not.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgrammedBlock {
    /// Where it comes from.
    pub block: BlockRef,
    /// How it is driven.
    pub motion: ProgrammedMotion,
    /// Points of all axes from start to end, without the length of the tool; straight in between, to 0.02 um.
    pub points: Vec<PartPoint>,
    /// Position of the axes minus position of the tip.
    pub tool_length: AxisVector,
}

/// How the points of a [`ProgrammedBlock`] are driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProgrammedMotion {
    /// G0.
    Rapid,
    /// G1.
    Line,
    /// A curve: the points in between are none of the program.
    Curve,
    /// Every axis on its own: there is no contour in between.
    Positioning,
}

impl ProgrammedMotion {
    /// As recordings have it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Rapid => "rapid",
            Self::Line => "line",
            Self::Curve => "curve",
            Self::Positioning => "positioning",
        }
    }
}

/// Where the master spindle is sent.
#[derive(Clone, Debug, PartialEq)]
pub struct SpindlePositioning {
    /// Angle, or with `SpindleApproach::By` the way.
    pub angle_rad: f64,
    /// Which way round.
    pub approach: SpindleApproach,
    /// As programmed, such as "SPOS=90"; empty for M19, which is an event of its own.
    pub text: Arc<str>,
}

/// Which way round the spindle goes to its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpindleApproach {
    /// As it turns; from rest the shorter way (plain, AC, DC).
    Onward,
    /// ACP.
    Positive,
    /// ACN.
    Negative,
    /// IC: by this way, from where it stands or comes to rest.
    By,
}
