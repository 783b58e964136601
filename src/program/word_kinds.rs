//! What words of the language stand for, where one word is one of several of a kind.
//!
//! In: nothing (plain data). Out: the kinds. Which spelling belongs to which is [`words`](super::words)' business.

use crate::machine::AccelerationMode;

/// Words of the programmable frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameWord {
    /// TRANS.
    Trans,
    /// ATRANS.
    AddTrans,
    /// ROT.
    Rot,
    /// AROT.
    AddRot,
    /// ROTS: solid angles.
    RotSolid,
    /// AROTS.
    AddRotSolid,
    /// SCALE.
    Scale,
    /// ASCALE.
    AddScale,
    /// MIRROR.
    Mirror,
    /// AMIRROR.
    AddMirror,
}

/// Curves of G group 1 that are words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveWord {
    /// CIP: circle through an intermediate point.
    ThreePoints,
    /// CT: tangential circle.
    Tangential,
    /// ASPLINE.
    Akima,
    /// BSPLINE.
    BSpline,
    /// CSPLINE.
    Cubic,
    /// POLY.
    Polynomial,
}

/// How a spline begins or ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum SplineEnd {
    /// BAUTO, EAUTO: from the first or last points.
    Auto,
    /// BNAT, ENAT: no curvature.
    #[default]
    Natural,
    /// BTAN, ETAN: tangential to the block before or after.
    Tangential,
}

/// G group 37: how F changes over the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum FeedShape {
    /// FNORM: constant in a block.
    #[default]
    Constant,
    /// FLIN: linear.
    Linear,
    /// FCUB: cubic.
    Cubic,
}

/// G group 16: what F means on a circle under tool radius compensation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum FeedCorrection {
    /// CFC: at the contour.
    #[default]
    Contour,
    /// CFTCP: at the tool centre.
    Centre,
    /// CFIN: as CFC at inside contours only.
    Inside,
}

/// G group 12: what an exact stop waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum ExactStop {
    /// G601: actual values inside STOP_LIMIT_FINE.
    #[default]
    Fine,
    /// G602: inside STOP_LIMIT_COARSE.
    Coarse,
    /// G603: the set-point has arrived.
    Setpoint,
}

/// G group 30.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Compressor {
    /// COMPOF.
    #[default]
    Off,
    /// COMPON: velocity continuous.
    On,
    /// COMPCURV: curvature continuous.
    Curvature,
    /// COMPCAD: optimised for the surface.
    Cad,
    /// COMPSURF: Top Surface.
    Surface,
}

/// G group 15: unit of F, and of S where the cutting speed is constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum FeedType {
    /// G93: F is the inverse of the time of the block, 1/min.
    InverseTime,
    /// G931: F is the time of the block, s.
    Time,
    /// G94: F in mm/min.
    #[default]
    PerMinute,
    /// G95: F in mm a revolution.
    PerRevolution,
    /// G942: F as before in mm/min, constant cutting speed off and S kept.
    PerMinuteKept,
    /// G952: as G942, mm a revolution.
    PerRevolutionKept,
    /// G96: constant cutting speed, F in mm a revolution.
    CuttingSpeedPerRevolution,
    /// G961: constant cutting speed, F in mm/min.
    CuttingSpeedPerMinute,
    /// G962: constant cutting speed, F as before.
    CuttingSpeed,
    /// G97: cutting speed off, F in mm a revolution.
    SpeedPerRevolution,
    /// G971: cutting speed off, F in mm/min.
    SpeedPerMinute,
    /// G972: cutting speed off, F as before.
    Speed,
    /// G973: G97 without spindle-speed limit.
    SpeedPerRevolutionFree,
}

/// G functions of group 1 that tie the path to the master spindle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ThreadWord {
    /// G33: constant lead.
    Constant,
    /// G34: the lead grows by F a revolution.
    Rising,
    /// G35: the lead shrinks by F a revolution.
    Falling,
    /// G331: tapping, the spindle is positioned with the axis.
    Tap,
    /// G332: back out of the thread.
    Retract,
}

/// From where polar coordinates count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoleOrigin {
    /// G110: from the last programmed position.
    Position,
    /// G111: from the zero point of the workpiece.
    Zero,
    /// G112: from the last pole.
    Pole,
}

/// Which frames are suppressed in a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Suppression {
    /// G53: settable and programmable.
    Settable,
    /// G153: basic too.
    Basic,
    /// SUPA: all offsets.
    All,
}

/// `NAME[axis]=value`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexedAddress {
    /// AX: an axis word whose axis is computed.
    Axis,
    /// ACC.
    Acceleration,
    /// VELOLIM.
    Velocity,
    /// JERKLIM.
    Jerk,
    /// FL.
    SynchronousLimit,
    /// FA.
    PositioningFeed,
    /// FGREF.
    ReferenceRadius,
    /// ATOL.
    AxisTolerance,
    /// OVRA.
    AxisOverride,
    /// POS.
    Position,
    /// POSA.
    PositionAsync,
    /// PO: a list of coefficients, or the denominator without an axis.
    Polynomial,
    /// SPOS: also without index.
    SpindlePosition,
    /// SPOSA.
    SpindlePositionAsync,
}

/// NAME(arguments) of the control itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Procedure {
    /// FGROUP.
    FeedGroup,
    /// WAITP.
    WaitPositioned,
    /// WAITS.
    WaitSpindle,
    /// SOFTA, BRISKA, DRIVEA.
    AxisAcceleration(AccelerationMode),
    /// SPCON, SPCOF.
    SpindleControl,
    /// SETMS.
    MasterSpindle,
    /// POSP.
    PositionInParts,
    /// CYCLE832.
    HighSpeedSettings,
    /// SETAL.
    RaiseAlarm,
}
