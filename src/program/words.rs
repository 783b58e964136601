//! The one table of words: what each of them is, and how far it is built.
//!
//! In: a word. Out: its [`Role`]. Every word of the language that this crate knows stands here once: acted on, without effect
//! here, known but not acted on ([`NOT_ACTED_ON`], a warning once a run), or not built yet (an error that says so).

pub use super::not_acted_on::{NOT_ACTED_ON, NotActedOn};
use super::not_built::{FUNCTIONS_NOT_BUILT, NOT_BUILT};
use super::syntax::{Address, Direction};
use crate::machine::PathMode;
use std::sync::OnceLock;

/// What a word is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// Stands alone and is acted on.
    Keyword(Keyword),
    /// NAME=value, acted on.
    Address(Address),
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
    /// SOFT.
    Soft,
    /// BRISK.
    Brisk,
    /// FFWON.
    FeedforwardOn,
    /// FFWOF.
    FeedforwardOff,
    /// SUPA.
    SuppressFrames,
    /// TRANS.
    Trans,
    /// ATRANS.
    AddTrans,
    /// ROT, SCALE or MIRROR alone: delete the programmable frame, as TRANS alone does.
    ClearFrame,
    /// STOPRE.
    StopPreparation,
    /// RET.
    Return,
}

/// Words that open a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// DEF.
    Define,
    /// PROC, EXTERN: declarations, without effect until sub-programs are built.
    Declaration,
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
}

impl Function {
    /// Number of arguments.
    pub fn arity(self) -> usize {
        match self {
            Self::Atan2 | Self::MinVal | Self::MaxVal => 2,
            Self::Bound => 3,
            _ => 1,
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
    SuppressFrames,
    /// G500, G54 to G57, G505 to G599.
    ZeroOffset(u16),
    /// G60, G64, G641, G642.
    PathMode(PathMode),
    /// G643, G644, G645: known, executed as G642.
    PathModeAsG642(&'static NotActedOn),
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
            Self::Dwell | Self::ExactStopOnce | Self::SuppressFrames => 0,
            Self::Plane(_) => 6,
            Self::ZeroOffset(_) => 8,
            Self::PathMode(_) | Self::PathModeAsG642(_) => 10,
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
        53 | 153 => GFunction::SuppressFrames,
        54..=57 => GFunction::ZeroOffset((number - 53) as u16),
        500 => GFunction::ZeroOffset(0),
        505..=599 => GFunction::ZeroOffset((number - 500) as u16),
        60 => GFunction::PathMode(PathMode::ExactStop),
        64 => GFunction::PathMode(PathMode::G64),
        641 => GFunction::PathMode(PathMode::G641),
        642 => GFunction::PathMode(PathMode::G642),
        70 => GFunction::Measure(Measure::InchGeometry),
        71 | 710 => GFunction::Measure(Measure::Metric),
        700 => GFunction::Measure(Measure::Inch),
        90 => GFunction::Absolute(true),
        91 => GFunction::Absolute(false),
        40 => GFunction::Silent(7),
        94 => GFunction::Silent(15),
        290 => GFunction::Silent(47),
        450 | 451 => GFunction::Silent(18),
        601 => GFunction::Silent(12),
        _ => return other_g_function(number),
    })
}

fn other_g_function(number: u32) -> Result<GFunction, &'static str> {
    let group = match number {
        41 | 42 => 7,
        62 | 621 => 57,
        602 | 603 => 12,
        _ => 10,
    };
    match role(&format!("G{number}")) {
        Some(Role::NotActedOn(entry)) if group == 10 => Ok(GFunction::PathModeAsG642(entry)),
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
    ("SOFT", Role::Keyword(Keyword::Soft)),
    ("BRISK", Role::Keyword(Keyword::Brisk)),
    ("FFWON", Role::Keyword(Keyword::FeedforwardOn)),
    ("FFWOF", Role::Keyword(Keyword::FeedforwardOff)),
    ("SUPA", Role::Keyword(Keyword::SuppressFrames)),
    ("TRANS", Role::Keyword(Keyword::Trans)),
    ("ATRANS", Role::Keyword(Keyword::AddTrans)),
    ("ROT", Role::Keyword(Keyword::ClearFrame)),
    ("SCALE", Role::Keyword(Keyword::ClearFrame)),
    ("MIRROR", Role::Keyword(Keyword::ClearFrame)),
    ("STOPRE", Role::Keyword(Keyword::StopPreparation)),
    ("RET", Role::Keyword(Keyword::Return)),
    ("CR", Role::Address(Address::Radius)),
    ("TURN", Role::Address(Address::Turn)),
    ("ADIS", Role::Address(Address::RoundingDistance)),
    ("ADISPOS", Role::Address(Address::RapidRoundingDistance)),
    ("CTOL", Role::Address(Address::ContourTolerance)),
    ("MSG", Role::Message),
    ("DEF", Role::Control(Control::Define)),
    ("PROC", Role::Control(Control::Declaration)),
    ("EXTERN", Role::Control(Control::Declaration)),
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
];

/// Words of expressions, definitions and address values.
const SYNTAX: &[&str] = &[
    "AC", "ACN", "ACP", "AND", "BOOL", "B_AND", "B_NOT", "B_OR", "B_XOR", "CHAR", "DC", "DEFAULT", "DIV", "FALSE",
    "IC", "INT", "MOD", "NOT", "OF", "OR", "QU", "REAL", "REP", "SET", "STRING", "TO", "TRUE", "XOR",
];

/// Words whose effect is already the state of this kernel, or that only matter together with words that are not built:
/// accepted without a warning, because the result is the same with and without them.
const SILENT: &[&str] = &[
    // Transformation, compressor, feed profile: off, as they are.
    "COMPOF",
    "FNORM",
    "TRAFOOF",
    "CP",
    "CPRECOF",
    "DIAMOF",
    "FENDNORM",
    "DYNNORM",
    "PAROTOF",
    "TOROTOF",
    "GWPSOF",
    "TCOABS",
    // G0 as a straight line is what is done.
    "RTLION",
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
    "CFC",
    "CFIN",
    "CFTCP",
    "CUT2D",
    "CUT2DF",
    "KONT",
    "NORM",
    // Only with splines.
    "BAUTO",
    "BNAT",
    "BTAN",
    "EAUTO",
    "ENAT",
    "ETAN",
    "SPATH",
    "UPATH",
    // No working-area limits are set.
    "WALIMOF",
    "WALIMON",
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
