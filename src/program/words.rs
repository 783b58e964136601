//! The one table of words: what each of them is, and how far it is built.
//!
//! In: a word. Out: its [`Role`]. Every word of the language that this crate knows stands here once: acted on, without effect
//! here, known but not acted on ([`NOT_ACTED_ON`], a warning once a run), or not built yet (an error that says so).

pub use super::not_acted_on::{NOT_ACTED_ON, NotActedOn};
use super::not_built::{FUNCTIONS_NOT_BUILT, NOT_BUILT};
use super::syntax::{Address, Direction};
use crate::machine::{AccelerationMode, DynamicsMode, PathMode};
use std::sync::OnceLock;

/// What a word is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// Stands alone and is acted on.
    Keyword(Keyword),
    /// NAME=value, acted on.
    Address(Address),
    /// NAME[axis]=value, acted on.
    Indexed(IndexedAddress),
    /// NAME(arguments), acted on.
    Procedure(Procedure),
    /// Opens a statement that fills the block.
    Control(Control),
    /// Function of an expression.
    Function(Function),
    /// Part of an expression, a DEF or an address value: cannot begin a word.
    Syntax,
    /// MSG.
    Message,
    /// Known, and true here without doing anything.
    Silent,
    /// Known, warned about.
    NotActedOn(&'static NotActedOn),
    /// Known, an error with this reason.
    NotBuilt(&'static str),
    /// A function that is known and not built: an error where it is called, a free name where it is not.
    FunctionNotBuilt(&'static str),
}

/// Words that stand alone and are acted on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keyword {
    /// SOFT, BRISK, DRIVE.
    Acceleration(AccelerationMode),
    /// DYNNORM and its kin.
    Dynamics(DynamicsMode),
    /// DYNPREC.
    DynamicsPrecision,
    /// FFWON.
    FeedforwardOn,
    /// FFWOF.
    FeedforwardOff,
    /// SUPA.
    SuppressFrames,
    /// TRANS, ROT, SCALE, MIRROR and their kin.
    Frame(FrameWord),
    /// WALIMON (true), WALIMOF.
    WorkArea(bool),
    /// CIP, CT, ASPLINE, BSPLINE, CSPLINE, POLY: G group 1.
    Curve(CurveWord),
    /// BAUTO, BNAT, BTAN.
    SplineStart(SplineEnd),
    /// EAUTO, ENAT, ETAN.
    SplineFinish(SplineEnd),
    /// UPATH (true), SPATH.
    PathParameter(bool),
    /// FNORM, FLIN, FCUB.
    FeedShape(FeedShape),
    /// CFC, CFTCP, CFIN.
    FeedCorrection(FeedCorrection),
    /// RTLION (true), RTLIOF.
    RapidLinear(bool),
    /// COMPOF, COMPON and its kin.
    Compressor(Compressor),
    /// STOPRE.
    StopPreparation,
}

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

/// NAME[axis]=value.
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

/// Words that open a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// DEF.
    Define,
    /// PROC.
    Procedure,
    /// EXTERN.
    External,
    /// RET.
    Return,
    /// CALL.
    Call,
    /// PCALL.
    PathCall,
    /// MCALL.
    ModalCall,
    /// EXTCALL.
    FileCall,
    /// ISOCALL: refused.
    IsoCall,
    /// CALLPATH.
    CallPath,
    /// REPEATB.
    RepeatBlock,
    /// IF.
    If,
    /// ELSE.
    Else,
    /// ENDIF.
    EndIf,
    /// FOR.
    For,
    /// ENDFOR.
    EndFor,
    /// WHILE.
    While,
    /// ENDWHILE.
    EndWhile,
    /// LOOP.
    Loop,
    /// ENDLOOP.
    EndLoop,
    /// REPEAT.
    Repeat,
    /// UNTIL.
    Until,
    /// GOTO and its kin.
    Jump(Direction),
    /// CASE.
    Case,
}

/// Functions of expressions; angles in degrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Function {
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan2,
    Sqrt,
    Pot,
    Abs,
    Trunc,
    Round,
    RoundUp,
    Ln,
    Exp,
    MinVal,
    MaxVal,
    Bound,
    ToUpper,
    ToLower,
    StrLen,
    Index,
    Rindex,
    Mindex,
    Match,
    Substr,
    Number,
    IsNumber,
    AxName,
    AxString,
    IsAxis,
    IsVar,
    Sprint,
    Ctrans,
    Cfine,
    Crot,
    Crots,
    Cscale,
    Cmirror,
}

impl Function {
    /// Functions whose names programs also use for variables: they are functions only before a bracket.
    pub fn leaves_its_name(self) -> bool {
        use Function::*;
        matches!(
            self,
            ToUpper
                | ToLower
                | StrLen
                | Index
                | Rindex
                | Mindex
                | Match
                | Substr
                | Number
                | IsNumber
                | AxName
                | AxString
                | IsAxis
                | IsVar
                | Sprint
        )
    }

    /// Fewest and most arguments.
    pub fn arity(self) -> (usize, usize) {
        match self {
            Self::Atan2 | Self::MinVal | Self::MaxVal | Self::Index | Self::Rindex | Self::Mindex | Self::Match => {
                (2, 2)
            }
            Self::Substr => (2, 3),
            Self::Bound => (3, 3),
            Self::Sprint => (1, 11),
            Self::Ctrans | Self::Cfine | Self::Crot | Self::Crots | Self::Cscale => (0, 16),
            Self::Cmirror => (0, 8),
            _ => (1, 1),
        }
    }
}

/// G functions that are acted on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GFunction {
    /// G0.
    Rapid,
    /// G1.
    Line,
    /// G2.
    Clockwise,
    /// G3.
    CounterClockwise,
    /// G4.
    Dwell,
    /// G9.
    ExactStopOnce,
    /// G17, G18, G19.
    Plane(Plane),
    /// G53, G153 (SUPA is a keyword).
    SuppressFrames(Suppression),
    /// G58, G59: programmable axial offset, coarse (true) or fine.
    AxialOffset(bool),
    /// G110, G111, G112.
    Pole(PoleOrigin),
    /// G25 (false), G26 (true): lower or upper limit of the work area or the spindle speed.
    Limit(bool),
    /// G601, G602, G603.
    ExactStopWindow(ExactStop),
    /// G93 to G97 and their kin.
    FeedType(FeedType),
    /// G500, G54 to G57, G505 to G599.
    ZeroOffset(u16),
    /// G60, G64, G641 to G645.
    PathMode(PathMode),
    /// G70, G71, G700, G710.
    Measure(Measure),
    /// G90 (true), G91.
    Absolute(bool),
    /// Known, and already so.
    Silent(u8),
    /// Known, warned about; its group.
    NotActedOn(&'static NotActedOn, u8),
}

/// Working plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// X, Y.
    G17,
    /// Z, X.
    G18,
    /// Y, Z.
    G19,
}

/// Unit of lengths in the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// G71, G710: mm.
    Metric,
    /// G70: positions in inch; feeds and tolerances stay metric.
    InchGeometry,
    /// G700: feeds and tolerances in inch too.
    Inch,
}

impl GFunction {
    /// Its G group: two of one group cannot stand in one block. 0: no group (G4, G9, suppression).
    pub fn group(&self) -> u8 {
        match self {
            Self::Rapid | Self::Line | Self::Clockwise | Self::CounterClockwise => 1,
            Self::Dwell | Self::ExactStopOnce | Self::SuppressFrames(_) => 0,
            Self::AxialOffset(_) | Self::Pole(_) | Self::Limit(_) => 3,
            Self::ExactStopWindow(_) => 12,
            Self::FeedType(_) => 15,
            Self::Plane(_) => 6,
            Self::ZeroOffset(_) => 8,
            Self::PathMode(_) => 10,
            Self::Measure(_) => 13,
            Self::Absolute(_) => 14,
            Self::Silent(group) | Self::NotActedOn(_, group) => *group,
        }
    }
}

/// The G function of that number; `Err` with the reason for a known one that is not built, `Err("")` for an unknown one.
pub fn g_function(number: u32) -> Result<GFunction, &'static str> {
    Ok(match number {
        0 => GFunction::Rapid,
        1 => GFunction::Line,
        2 => GFunction::Clockwise,
        3 => GFunction::CounterClockwise,
        4 => GFunction::Dwell,
        9 => GFunction::ExactStopOnce,
        17 => GFunction::Plane(Plane::G17),
        18 => GFunction::Plane(Plane::G18),
        19 => GFunction::Plane(Plane::G19),
        25 => GFunction::Limit(false),
        26 => GFunction::Limit(true),
        53 => GFunction::SuppressFrames(Suppression::Settable),
        153 => GFunction::SuppressFrames(Suppression::Basic),
        58 => GFunction::AxialOffset(true),
        59 => GFunction::AxialOffset(false),
        110 => GFunction::Pole(PoleOrigin::Position),
        111 => GFunction::Pole(PoleOrigin::Zero),
        112 => GFunction::Pole(PoleOrigin::Pole),
        54..=57 => GFunction::ZeroOffset((number - 53) as u16),
        500 => GFunction::ZeroOffset(0),
        505..=599 => GFunction::ZeroOffset((number - 500) as u16),
        60 => GFunction::PathMode(PathMode::ExactStop),
        64 => GFunction::PathMode(PathMode::G64),
        641 => GFunction::PathMode(PathMode::G641),
        642 => GFunction::PathMode(PathMode::G642),
        643 => GFunction::PathMode(PathMode::G643),
        644 => GFunction::PathMode(PathMode::G644),
        645 => GFunction::PathMode(PathMode::G645),
        70 => GFunction::Measure(Measure::InchGeometry),
        71 | 710 => GFunction::Measure(Measure::Metric),
        700 => GFunction::Measure(Measure::Inch),
        90 => GFunction::Absolute(true),
        91 => GFunction::Absolute(false),
        40 => GFunction::Silent(7),
        290 => GFunction::Silent(47),
        450 | 451 => GFunction::Silent(18),
        601 => GFunction::ExactStopWindow(ExactStop::Fine),
        602 => GFunction::ExactStopWindow(ExactStop::Coarse),
        603 => GFunction::ExactStopWindow(ExactStop::Setpoint),
        93 => GFunction::FeedType(FeedType::InverseTime),
        931 => GFunction::FeedType(FeedType::Time),
        94 => GFunction::FeedType(FeedType::PerMinute),
        95 => GFunction::FeedType(FeedType::PerRevolution),
        942 => GFunction::FeedType(FeedType::PerMinuteKept),
        952 => GFunction::FeedType(FeedType::PerRevolutionKept),
        96 => GFunction::FeedType(FeedType::CuttingSpeedPerRevolution),
        961 => GFunction::FeedType(FeedType::CuttingSpeedPerMinute),
        962 => GFunction::FeedType(FeedType::CuttingSpeed),
        97 => GFunction::FeedType(FeedType::SpeedPerRevolution),
        971 => GFunction::FeedType(FeedType::SpeedPerMinute),
        972 => GFunction::FeedType(FeedType::Speed),
        973 => GFunction::FeedType(FeedType::SpeedPerRevolutionFree),
        _ => return other_g_function(number),
    })
}

fn other_g_function(number: u32) -> Result<GFunction, &'static str> {
    let group = match number {
        41 | 42 => 7,
        _ => 57,
    };
    match role(&format!("G{number}")) {
        Some(Role::NotActedOn(entry)) => Ok(GFunction::NotActedOn(entry, group)),
        Some(Role::NotBuilt(reason)) => Err(reason),
        _ => Err(""),
    }
}

/// The role of a word, case-blind; `None` if the language does not have it.
pub fn role(word: &str) -> Option<Role> {
    let table = table();
    let compare = |known: &str| known.bytes().cmp(word.bytes().map(|byte| byte.to_ascii_uppercase()));
    table.binary_search_by(|(known, _)| compare(known)).ok().map(|found| table[found].1)
}

/// A word with that role: the first in alphabetical order.
pub fn spelling(wanted: Role) -> Option<&'static str> {
    table().iter().find(|(_, role)| *role == wanted).map(|(word, _)| *word)
}

/// True for a function that is one only before a bracket.
pub fn is_free_name(role: Role) -> bool {
    match role {
        Role::Function(function) => function.leaves_its_name(),
        Role::FunctionNotBuilt(_) => true,
        _ => false,
    }
}

/// Every word of the table, in alphabetical order: for help texts.
pub fn known_words() -> impl Iterator<Item = &'static str> + Clone {
    table().iter().map(|(word, _)| *word)
}

/// Help with the nearest known word, if one is near.
pub fn did_you_mean(word: &str) -> Option<String> {
    // Some entries stand for a whole family (`Sn=`, `$TC_`): nobody writes them.
    let written = known_words().filter(|known| known.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_'));
    crate::base::diagnostics::nearest(word, written).map(|near| format!("did you mean `{near}`?"))
}

fn table() -> &'static [(&'static str, Role)] {
    static TABLE: OnceLock<Vec<(&'static str, Role)>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let mut table: Vec<_> = ACTED_ON.to_vec();
        table.extend(SYNTAX.iter().map(|word| (*word, Role::Syntax)));
        table.extend(SILENT.iter().map(|word| (*word, Role::Silent)));
        table.extend(NOT_ACTED_ON.iter().map(|entry| (entry.word, Role::NotActedOn(entry))));
        table.extend(
            FUNCTIONS_NOT_BUILT.iter().map(|word| (*word, Role::FunctionNotBuilt("this function is not built yet"))),
        );
        table.extend(
            NOT_BUILT.iter().flat_map(|(words, reason)| words.iter().map(|word| (*word, Role::NotBuilt(reason)))),
        );
        table.sort_by_key(|(word, _)| *word);
        table
    })
}

const ACTED_ON: &[(&str, Role)] = &[
    ("SOFT", Role::Keyword(Keyword::Acceleration(AccelerationMode::Soft))),
    ("BRISK", Role::Keyword(Keyword::Acceleration(AccelerationMode::Brisk))),
    ("DRIVE", Role::Keyword(Keyword::Acceleration(AccelerationMode::Drive))),
    ("DYNNORM", Role::Keyword(Keyword::Dynamics(DynamicsMode::Norm))),
    ("DYNPOS", Role::Keyword(Keyword::Dynamics(DynamicsMode::Position))),
    ("DYNROUGH", Role::Keyword(Keyword::Dynamics(DynamicsMode::Rough))),
    ("DYNSEMIFIN", Role::Keyword(Keyword::Dynamics(DynamicsMode::SemiFinish))),
    ("DYNFINISH", Role::Keyword(Keyword::Dynamics(DynamicsMode::Finish))),
    ("DYNPREC", Role::Keyword(Keyword::DynamicsPrecision)),
    ("FFWON", Role::Keyword(Keyword::FeedforwardOn)),
    ("FFWOF", Role::Keyword(Keyword::FeedforwardOff)),
    ("SUPA", Role::Keyword(Keyword::SuppressFrames)),
    ("TRANS", Role::Keyword(Keyword::Frame(FrameWord::Trans))),
    ("ATRANS", Role::Keyword(Keyword::Frame(FrameWord::AddTrans))),
    ("ROT", Role::Keyword(Keyword::Frame(FrameWord::Rot))),
    ("AROT", Role::Keyword(Keyword::Frame(FrameWord::AddRot))),
    ("ROTS", Role::Keyword(Keyword::Frame(FrameWord::RotSolid))),
    ("AROTS", Role::Keyword(Keyword::Frame(FrameWord::AddRotSolid))),
    ("SCALE", Role::Keyword(Keyword::Frame(FrameWord::Scale))),
    ("ASCALE", Role::Keyword(Keyword::Frame(FrameWord::AddScale))),
    ("MIRROR", Role::Keyword(Keyword::Frame(FrameWord::Mirror))),
    ("AMIRROR", Role::Keyword(Keyword::Frame(FrameWord::AddMirror))),
    ("RPL", Role::Address(Address::PlaneRotation)),
    ("WALIMON", Role::Keyword(Keyword::WorkArea(true))),
    ("WALIMOF", Role::Keyword(Keyword::WorkArea(false))),
    ("CIP", Role::Keyword(Keyword::Curve(CurveWord::ThreePoints))),
    ("CT", Role::Keyword(Keyword::Curve(CurveWord::Tangential))),
    ("ASPLINE", Role::Keyword(Keyword::Curve(CurveWord::Akima))),
    ("BSPLINE", Role::Keyword(Keyword::Curve(CurveWord::BSpline))),
    ("CSPLINE", Role::Keyword(Keyword::Curve(CurveWord::Cubic))),
    ("POLY", Role::Keyword(Keyword::Curve(CurveWord::Polynomial))),
    ("BAUTO", Role::Keyword(Keyword::SplineStart(SplineEnd::Auto))),
    ("BNAT", Role::Keyword(Keyword::SplineStart(SplineEnd::Natural))),
    ("BTAN", Role::Keyword(Keyword::SplineStart(SplineEnd::Tangential))),
    ("EAUTO", Role::Keyword(Keyword::SplineFinish(SplineEnd::Auto))),
    ("ENAT", Role::Keyword(Keyword::SplineFinish(SplineEnd::Natural))),
    ("ETAN", Role::Keyword(Keyword::SplineFinish(SplineEnd::Tangential))),
    ("UPATH", Role::Keyword(Keyword::PathParameter(true))),
    ("SPATH", Role::Keyword(Keyword::PathParameter(false))),
    ("FNORM", Role::Keyword(Keyword::FeedShape(FeedShape::Constant))),
    ("FLIN", Role::Keyword(Keyword::FeedShape(FeedShape::Linear))),
    ("FCUB", Role::Keyword(Keyword::FeedShape(FeedShape::Cubic))),
    ("CFC", Role::Keyword(Keyword::FeedCorrection(FeedCorrection::Contour))),
    ("CFTCP", Role::Keyword(Keyword::FeedCorrection(FeedCorrection::Centre))),
    ("CFIN", Role::Keyword(Keyword::FeedCorrection(FeedCorrection::Inside))),
    ("RTLION", Role::Keyword(Keyword::RapidLinear(true))),
    ("RTLIOF", Role::Keyword(Keyword::RapidLinear(false))),
    ("COMPOF", Role::Keyword(Keyword::Compressor(Compressor::Off))),
    ("COMPON", Role::Keyword(Keyword::Compressor(Compressor::On))),
    ("COMPCURV", Role::Keyword(Keyword::Compressor(Compressor::Curvature))),
    ("COMPCAD", Role::Keyword(Keyword::Compressor(Compressor::Cad))),
    ("COMPSURF", Role::Keyword(Keyword::Compressor(Compressor::Surface))),
    ("AX", Role::Indexed(IndexedAddress::Axis)),
    ("ACC", Role::Indexed(IndexedAddress::Acceleration)),
    ("VELOLIM", Role::Indexed(IndexedAddress::Velocity)),
    ("JERKLIM", Role::Indexed(IndexedAddress::Jerk)),
    ("FL", Role::Indexed(IndexedAddress::SynchronousLimit)),
    ("FA", Role::Indexed(IndexedAddress::PositioningFeed)),
    ("FGREF", Role::Indexed(IndexedAddress::ReferenceRadius)),
    ("ATOL", Role::Indexed(IndexedAddress::AxisTolerance)),
    ("OVRA", Role::Indexed(IndexedAddress::AxisOverride)),
    ("POS", Role::Indexed(IndexedAddress::Position)),
    ("POSA", Role::Indexed(IndexedAddress::PositionAsync)),
    ("PO", Role::Indexed(IndexedAddress::Polynomial)),
    ("SPOS", Role::Indexed(IndexedAddress::SpindlePosition)),
    ("SPOSA", Role::Indexed(IndexedAddress::SpindlePositionAsync)),
    ("FGROUP", Role::Procedure(Procedure::FeedGroup)),
    ("WAITP", Role::Procedure(Procedure::WaitPositioned)),
    ("WAITS", Role::Procedure(Procedure::WaitSpindle)),
    ("SOFTA", Role::Procedure(Procedure::AxisAcceleration(AccelerationMode::Soft))),
    ("BRISKA", Role::Procedure(Procedure::AxisAcceleration(AccelerationMode::Brisk))),
    ("DRIVEA", Role::Procedure(Procedure::AxisAcceleration(AccelerationMode::Drive))),
    ("SPCON", Role::Procedure(Procedure::SpindleControl)),
    ("SPCOF", Role::Procedure(Procedure::SpindleControl)),
    ("SETMS", Role::Procedure(Procedure::MasterSpindle)),
    ("POSP", Role::Procedure(Procedure::PositionInParts)),
    ("SETAL", Role::Procedure(Procedure::RaiseAlarm)),
    ("CYCLE832", Role::Procedure(Procedure::HighSpeedSettings)),
    ("STOPRE", Role::Keyword(Keyword::StopPreparation)),
    ("CR", Role::Address(Address::Radius)),
    ("TURN", Role::Address(Address::Turn)),
    ("ADIS", Role::Address(Address::RoundingDistance)),
    ("ADISPOS", Role::Address(Address::RapidRoundingDistance)),
    ("CTOL", Role::Address(Address::ContourTolerance)),
    ("OTOL", Role::Address(Address::OrientationTolerance)),
    ("STOLF", Role::Address(Address::RapidToleranceFactor)),
    ("RND", Role::Address(Address::Fillet)),
    ("RNDM", Role::Address(Address::FilletModal)),
    ("CHF", Role::Address(Address::Chamfer)),
    ("CHR", Role::Address(Address::ChamferLeg)),
    ("FRC", Role::Address(Address::CornerFeed)),
    ("FRCM", Role::Address(Address::CornerFeedModal)),
    ("AR", Role::Address(Address::OpeningAngle)),
    ("AP", Role::Address(Address::PolarAngle)),
    ("RP", Role::Address(Address::PolarRadius)),
    ("I1", Role::Address(Address::Intermediate(0))),
    ("J1", Role::Address(Address::Intermediate(1))),
    ("K1", Role::Address(Address::Intermediate(2))),
    ("PW", Role::Address(Address::PointWeight)),
    ("SD", Role::Address(Address::SplineDegree)),
    ("PL", Role::Address(Address::ParameterLength)),
    ("FB", Role::Address(Address::BlockFeed)),
    ("LIMS", Role::Address(Address::SpindleLimit)),
    ("OVR", Role::Address(Address::Override)),
    ("OVRRAP", Role::Address(Address::RapidOverride)),
    ("MSG", Role::Message),
    ("DEF", Role::Control(Control::Define)),
    ("PROC", Role::Control(Control::Procedure)),
    ("EXTERN", Role::Control(Control::External)),
    ("RET", Role::Control(Control::Return)),
    ("CALL", Role::Control(Control::Call)),
    ("PCALL", Role::Control(Control::PathCall)),
    ("MCALL", Role::Control(Control::ModalCall)),
    ("EXTCALL", Role::Control(Control::FileCall)),
    ("ISOCALL", Role::Control(Control::IsoCall)),
    ("CALLPATH", Role::Control(Control::CallPath)),
    ("REPEATB", Role::Control(Control::RepeatBlock)),
    ("IF", Role::Control(Control::If)),
    ("ELSE", Role::Control(Control::Else)),
    ("ENDIF", Role::Control(Control::EndIf)),
    ("FOR", Role::Control(Control::For)),
    ("ENDFOR", Role::Control(Control::EndFor)),
    ("WHILE", Role::Control(Control::While)),
    ("ENDWHILE", Role::Control(Control::EndWhile)),
    ("LOOP", Role::Control(Control::Loop)),
    ("ENDLOOP", Role::Control(Control::EndLoop)),
    ("REPEAT", Role::Control(Control::Repeat)),
    ("UNTIL", Role::Control(Control::Until)),
    ("GOTO", Role::Control(Control::Jump(Direction::Both))),
    ("GOTOF", Role::Control(Control::Jump(Direction::Forward))),
    ("GOTOB", Role::Control(Control::Jump(Direction::Backward))),
    ("GOTOC", Role::Control(Control::Jump(Direction::BothQuiet))),
    ("GOTOS", Role::Control(Control::Jump(Direction::Start))),
    ("CASE", Role::Control(Control::Case)),
    ("SIN", Role::Function(Function::Sin)),
    ("COS", Role::Function(Function::Cos)),
    ("TAN", Role::Function(Function::Tan)),
    ("ASIN", Role::Function(Function::Asin)),
    ("ACOS", Role::Function(Function::Acos)),
    ("ATAN2", Role::Function(Function::Atan2)),
    ("SQRT", Role::Function(Function::Sqrt)),
    ("POT", Role::Function(Function::Pot)),
    ("ABS", Role::Function(Function::Abs)),
    ("TRUNC", Role::Function(Function::Trunc)),
    ("ROUND", Role::Function(Function::Round)),
    ("ROUNDUP", Role::Function(Function::RoundUp)),
    ("LN", Role::Function(Function::Ln)),
    ("EXP", Role::Function(Function::Exp)),
    ("MINVAL", Role::Function(Function::MinVal)),
    ("MAXVAL", Role::Function(Function::MaxVal)),
    ("BOUND", Role::Function(Function::Bound)),
    ("TOUPPER", Role::Function(Function::ToUpper)),
    ("TOLOWER", Role::Function(Function::ToLower)),
    ("STRLEN", Role::Function(Function::StrLen)),
    ("INDEX", Role::Function(Function::Index)),
    ("RINDEX", Role::Function(Function::Rindex)),
    ("MINDEX", Role::Function(Function::Mindex)),
    ("MATCH", Role::Function(Function::Match)),
    ("SUBSTR", Role::Function(Function::Substr)),
    ("NUMBER", Role::Function(Function::Number)),
    ("ISNUMBER", Role::Function(Function::IsNumber)),
    ("AXNAME", Role::Function(Function::AxName)),
    ("AXSTRING", Role::Function(Function::AxString)),
    ("ISAXIS", Role::Function(Function::IsAxis)),
    ("ISVAR", Role::Function(Function::IsVar)),
    ("SPRINT", Role::Function(Function::Sprint)),
    ("CTRANS", Role::Function(Function::Ctrans)),
    ("CFINE", Role::Function(Function::Cfine)),
    ("CROT", Role::Function(Function::Crot)),
    ("CROTS", Role::Function(Function::Crots)),
    ("CSCALE", Role::Function(Function::Cscale)),
    ("CMIRROR", Role::Function(Function::Cmirror)),
];

/// Words of expressions, definitions and address values.
const SYNTAX: &[&str] = &[
    "AC", "ACN", "ACP", "AND", "AXIS", "BOOL", "B_AND", "B_NOT", "B_OR", "B_XOR", "CHAR", "DC", "DEFAULT", "DIV",
    "FALSE", "FRAME", "IC", "INT", "MOD", "NOT", "OF", "OR", "PI", "QU", "REAL", "REP", "SET", "STRING", "TO", "TRUE",
    "XOR",
];

/// Words whose effect is already the state of this kernel, or that only matter together with words that are not built:
/// accepted without a warning, because the result is the same with and without them.
const SILENT: &[&str] = &[
    // Transformation: off, as it is.
    "TRAFOOF",
    "CP",
    "CPRECOF",
    "DIAMOF",
    "FENDNORM",
    "PAROTOF",
    "TOROTOF",
    "GWPSOF",
    "TCOABS",
    // Only with an orientation transformation.
    "ORIAXES",
    "ORIEULER",
    "ORIMKS",
    "ORIPLANE",
    "ORIRPY",
    "ORIRPY2",
    "ORISOF",
    "ORIVECT",
    "ORIWKS",
    // Only with tool radius compensation.
    "CUT2D",
    "CUT2DF",
    "KONT",
    "NORM",
    // Display, single block, search: nothing to see in a simulation.
    "ACTBLOCNO",
    "DISPLOF",
    "DISPLON",
    "GROUP_BEGIN",
    "GROUP_END",
    "IPTRLOCK",
    "IPTRUNLOCK",
    "SAVE",
    "SBLOF",
    "SBLON",
    "WORKPIECE",
];
