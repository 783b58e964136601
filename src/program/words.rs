//! The one table of words: what each of them is, and how far it is built.
//!
//! In: a word. Out: its [`Role`]. Every word of the language that this crate knows stands here once: acted on, without effect
//! here, known but not acted on ([`NOT_ACTED_ON`], a warning once a run), or not built yet (an error that says so).

pub use super::g_functions::{GFunction, Measure, Plane, g_function};
pub use super::not_acted_on::{NOT_ACTED_ON, NotActedOn};
use super::not_built::{FUNCTIONS_NOT_BUILT, NOT_BUILT};
use super::syntax::{Address, Direction};
pub use super::word_kinds::*;
use super::word_table::{ACTED_ON, SILENT, SYNTAX};
use crate::machine::{AccelerationMode, DynamicsMode};
use std::sync::OnceLock;

/// What a word is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// Stands alone and is acted on.
    Keyword(Keyword),
    /// NAME=value, acted on.
    Address(Address),
    /// `NAME[axis]=value`, acted on.
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
