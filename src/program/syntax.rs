//! The syntax tree of one block: what the parser makes and the interpreter executes.
//!
//! In: nothing (plain data). Out: [`Block`], [`Statement`], [`Word`], [`Expr`]. Columns are bytes of the decoded line; a block does
//! not know its line. Nothing here is evaluated.

pub use super::call_syntax::{Call, Callee, Header, Parameter, RepeatBlocks, Return};
use super::codes::Columns;
use super::synchronised::Synchronised;
use super::words::{Function, GFunction, IndexedAddress, Keyword, NotActedOn, Procedure};
use crate::base::AxisId;
use std::sync::Arc;

/// One line of a program.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// `/` or `/n`: skip level. Skip levels are not active, so the block is executed.
    pub skip: Option<u8>,
    /// `N` or `:` with the number.
    pub number: Option<BlockNumber>,
    /// `NAME:`, in capitals.
    pub label: Option<Arc<str>>,
    /// What it does.
    pub statement: Statement,
    /// It reads what only the main run knows: the look-ahead is emptied before it.
    pub reads_main_run: bool,
}

/// Number of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockNumber {
    /// The number.
    pub number: u64,
    /// `:` instead of `N`: a main block.
    pub main: bool,
}

/// What a block does.
#[derive(Clone, Debug, PartialEq)]
pub enum Statement {
    /// Addresses, G functions, keywords, assignments, calls; empty for comments.
    Words(Vec<Word>),
    /// DEF.
    Define(Definition),
    /// IF ... (to ELSE or ENDIF).
    If(Expr),
    /// IF ... GOTOF ..., also several in one block: the first that is true leads away.
    IfJump(Vec<(Expr, Jump)>),
    /// ELSE.
    Else,
    /// ENDIF.
    EndIf,
    /// FOR variable = first TO last.
    For(Box<ForLoop>),
    /// ENDFOR.
    EndFor,
    /// WHILE.
    While(Expr),
    /// ENDWHILE.
    EndWhile,
    /// LOOP.
    Loop,
    /// ENDLOOP.
    EndLoop,
    /// REPEAT (to UNTIL).
    Repeat,
    /// UNTIL.
    Until(Expr),
    /// GOTO and its kin.
    Jump(Jump),
    /// CASE ... OF ... DEFAULT.
    Case(Box<Case>),
    /// REPEAT label, REPEATB label.
    RepeatBlocks(Box<RepeatBlocks>),
    /// PROC.
    Procedure(Arc<Header>),
    /// EXTERN.
    External(Arc<Header>),
    /// A call of a sub-program.
    Call(Box<Call>),
    /// MCALL; `None` ends it.
    ModalCall(Option<Arc<Call>>),
    /// CALLPATH: a folder to search; `None` forgets it.
    CallPath(Option<Expr>),
    /// RET.
    Return(Box<Return>),
    /// A synchronised action on $AC_OVR.
    Synchronised(Box<Synchronised>),
    /// CANCEL: the actions of these numbers end.
    Cancel(Vec<Expr>),
    /// A whole line that is known but not acted on (other synchronised actions).
    NotActedOn(&'static NotActedOn, Columns),
}

/// FOR.
#[derive(Clone, Debug, PartialEq)]
pub struct ForLoop {
    /// The counter.
    pub counter: Target,
    /// Marked bytes of the counter.
    pub counter_columns: Columns,
    /// Its first value.
    pub first: Expr,
    /// Its last value: read again on every pass.
    pub last: Expr,
}

/// CASE.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// What is compared.
    pub selector: Expr,
    /// Values and where they lead.
    pub branches: Vec<(Expr, Jump)>,
    /// Where everything else leads.
    pub default: Option<Jump>,
}

/// A jump.
#[derive(Clone, Debug, PartialEq)]
pub struct Jump {
    /// Where it searches.
    pub direction: Direction,
    /// What it searches; `None` for GOTOS.
    pub destination: Option<Destination>,
    /// Marked bytes of the destination.
    pub columns: Columns,
}

/// Where a jump searches its destination.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Direction {
    /// GOTOF: towards the end.
    Forward,
    /// GOTOB: towards the start.
    Backward,
    /// GOTO: towards the end, then towards the start.
    Both,
    /// GOTOC: as GOTO, and no alarm if there is none.
    BothQuiet,
    /// GOTOS: to the start of the program.
    Start,
}

/// What a jump searches.
#[derive(Clone, Debug, PartialEq)]
pub enum Destination {
    /// A label, in capitals, or a STRING variable that holds one.
    Name(Arc<str>),
    /// A block number: N or `:`.
    Number(u64),
    /// A text computed at run time.
    Text(Expr),
}

/// DEF.
#[derive(Clone, Debug, PartialEq)]
pub struct Definition {
    /// NCK or CHAN: known to all programs. Only in definition files.
    pub global: bool,
    /// Type of all its variables.
    pub variable_type: VariableType,
    /// The variables.
    pub variables: Vec<DefinedVariable>,
}

/// One variable of a DEF.
#[derive(Clone, Debug, PartialEq)]
pub struct DefinedVariable {
    /// Name in capitals.
    pub name: Arc<str>,
    /// Marked bytes.
    pub columns: Columns,
    /// Sizes of the dimensions; empty for a plain variable.
    pub dimensions: Vec<Expr>,
    /// Values.
    pub initial: Initial,
}

/// What stands behind the equals sign of a DEF or of an assignment to an array.
#[derive(Clone, Debug, PartialEq)]
pub enum Initial {
    /// Nothing: 0, FALSE or an empty text.
    None,
    /// One value: for all elements.
    One(Expr),
    /// SET(a, , b): one after another, gaps untouched.
    Set(Vec<Option<Expr>>),
    /// REP(a) or REP(a, n).
    Repeat(Expr, Option<Expr>),
}

/// Type of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VariableType {
    /// TRUE or FALSE.
    Bool,
    /// 0 to 255.
    Char,
    /// 32 bits with sign.
    Int,
    /// 64-bit floating point.
    Real,
    /// Text of at most so many characters.
    Text(u16),
    /// Name of an axis.
    Axis,
    /// A frame.
    Frame,
}

impl VariableType {
    /// Name in programs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bool => "BOOL",
            Self::Char => "CHAR",
            Self::Int => "INT",
            Self::Real => "REAL",
            Self::Text(_) => "STRING",
            Self::Axis => "AXIS",
            Self::Frame => "FRAME",
        }
    }
}

/// One word of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Word {
    /// Marked bytes.
    pub columns: Columns,
    /// What it is.
    pub kind: WordKind,
}

/// What a word is.
#[derive(Clone, Debug, PartialEq)]
pub enum WordKind {
    /// A G function by number.
    G(GFunction),
    /// An address with its value.
    Address(Address, AddressValue),
    /// A word that stands alone.
    Keyword(Keyword),
    /// `NAME[index]=value`; without index where the word allows it.
    Indexed {
        /// Which.
        address: IndexedAddress,
        /// Axis or spindle.
        index: Option<Expr>,
        /// Value, or a list of them for PO.
        values: IndexedValue,
    },
    /// NAME(arguments) of the control itself.
    Procedure(Procedure, Vec<Option<Expr>>),
    /// MSG.
    Message(Option<Expr>),
    /// Variable or R parameter = value.
    Assign(Target, Expr),
    /// Array element = SET(...) or REP(...).
    Fill(Target, Initial),
    /// Known, without effect on the result here.
    Silent,
    /// Known, with an effect that is not simulated.
    NotActedOn(&'static NotActedOn),
}

/// Value of an indexed address.
#[derive(Clone, Debug, PartialEq)]
pub enum IndexedValue {
    /// One value.
    One(AddressValue),
    /// (a, b, c): coefficients of PO.
    List(Vec<Option<AddressValue>>),
}

/// An address that is acted on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Address {
    /// An axis of the machine.
    Axis(AxisId),
    /// I, J, K: 0, 1, 2.
    Centre(u8),
    /// CR.
    Radius,
    /// TURN.
    Turn,
    /// SF.
    StartAngle,
    /// DITS: way in which a thread comes to its speed; DITE: in which it leaves it.
    ThreadRun {
        /// DITE.
        leaves: bool,
    },
    /// F.
    Feed,
    /// S.
    SpindleSpeed,
    /// T.
    Tool,
    /// D.
    Edge,
    /// M.
    M,
    /// ADIS.
    RoundingDistance,
    /// ADISPOS.
    RapidRoundingDistance,
    /// CTOL.
    ContourTolerance,
    /// OTOL.
    OrientationTolerance,
    /// STOLF.
    RapidToleranceFactor,
    /// RND.
    Fillet,
    /// RNDM.
    FilletModal,
    /// CHF.
    Chamfer,
    /// CHR.
    ChamferLeg,
    /// FRC.
    CornerFeed,
    /// FRCM.
    CornerFeedModal,
    /// AR.
    OpeningAngle,
    /// AP.
    PolarAngle,
    /// RP.
    PolarRadius,
    /// I1, J1, K1: 0, 1, 2.
    Intermediate(u8),
    /// PW.
    PointWeight,
    /// SD.
    SplineDegree,
    /// PL.
    ParameterLength,
    /// RPL.
    PlaneRotation,
    /// FB.
    BlockFeed,
    /// LIMS.
    SpindleLimit,
    /// OVR.
    Override,
    /// OVRRAP.
    RapidOverride,
    /// H.
    H,
    /// S2 and so on.
    SpindleSpeedOf(u32),
    /// M2= and so on: an M function of a spindle other than spindle 1.
    MOf(u32),
}

/// Value of an address.
#[derive(Clone, Debug, PartialEq)]
pub struct AddressValue {
    /// AC, IC, DC, ACP, ACN.
    pub form: Form,
    /// The value.
    pub value: Expr,
}

/// How the value of an axis word is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// As G90 or G91 says.
    Modal,
    /// AC().
    Absolute,
    /// IC().
    Incremental,
    /// DC(): the shorter way round.
    Shortest,
    /// ACP(): in positive direction.
    Positive,
    /// ACN(): in negative direction.
    Negative,
}

/// Left side of an assignment.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// R with a number or an expression.
    Parameter(Expr),
    /// Variable or array element.
    Variable {
        /// Name in capitals.
        name: Arc<str>,
        /// Indices; of a FRAME or a STRING also the component or the place.
        indices: Vec<Expr>,
    },
    /// System variable.
    System(SystemName),
}

/// A system variable with its indices.
#[derive(Clone, Debug, PartialEq)]
pub struct SystemName {
    /// Name in capitals, with its `$`.
    pub name: Arc<str>,
    /// Numbers, axes, components of frames.
    pub indices: Vec<Expr>,
}

/// A number as it stands in the program, in the unit that its address and G70/G700 give it: mm, inch, degrees, mm/min and so on.
/// Only the interpreter makes a quantity of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Typed(pub f64);

/// An expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Expr {
    /// Marked bytes.
    pub columns: Columns,
    /// What it is.
    pub kind: ExprKind,
}

/// What an expression is.
#[derive(Clone, Debug, PartialEq)]
pub enum ExprKind {
    /// TRUE, FALSE.
    Bool(bool),
    /// A whole number that fits 32 bits.
    Int(i32),
    /// Any other number.
    Real(f64),
    /// "text".
    Text(Arc<str>),
    /// R5, R[...].
    Parameter(Box<Expr>),
    /// Variable or array element.
    Variable {
        /// Name in capitals.
        name: Arc<str>,
        /// Indices.
        indices: Vec<Expr>,
    },
    /// `$P_EP[X]` and so on.
    System(SystemName),
    /// -a, +a, NOT a, B_NOT a.
    Unary(Unary, Box<Expr>),
    /// a + b and so on.
    Binary(Binary, Box<(Expr, Expr)>),
    /// SIN(a) and so on.
    Call(Function, Vec<Expr>),
}

/// Operators with one operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unary {
    /// -
    Minus,
    /// +
    Plus,
    /// NOT
    Not,
    /// B_NOT
    BitNot,
}

/// Operators with two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binary {
    /// `:` between frames
    Chain,
    /// *
    Multiply,
    /// /
    Divide,
    /// DIV
    IntegerDivide,
    /// MOD
    Modulo,
    /// +
    Add,
    /// -
    Subtract,
    /// B_AND
    BitAnd,
    /// B_XOR
    BitXor,
    /// B_OR
    BitOr,
    /// AND
    And,
    /// XOR
    Xor,
    /// OR
    Or,
    /// <<
    Join,
    /// ==
    Equal,
    /// <>
    Unequal,
    /// >
    Greater,
    /// <
    Less,
    /// >=
    GreaterEqual,
    /// <=
    LessEqual,
}

impl Binary {
    /// ==, <> and so on.
    pub fn compares(self) -> bool {
        self.priority() == 1
    }

    /// How tightly it binds: the control's order (programming manual 12/2019, p. 444). AND binds tighter than ==.
    pub fn priority(self) -> u8 {
        match self {
            Self::Chain => 11,
            Self::Multiply | Self::Divide | Self::IntegerDivide | Self::Modulo => 10,
            Self::Add | Self::Subtract => 9,
            Self::BitAnd => 8,
            Self::BitXor => 7,
            Self::BitOr => 6,
            Self::And => 5,
            Self::Xor => 4,
            Self::Or => 3,
            Self::Join => 2,
            Self::Equal | Self::Unequal | Self::Greater | Self::Less | Self::GreaterEqual | Self::LessEqual => 1,
        }
    }
}
