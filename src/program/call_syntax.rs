//! The syntax tree of calls and headers of sub-programs, and of repeated parts.
//!
//! In: nothing (plain data). Out: [`Header`], [`Call`], [`Return`], [`RepeatBlocks`]. Nothing here is evaluated.

use super::codes::Columns;
use super::syntax::{Destination, Expr, VariableType};
use std::sync::Arc;

/// Repetition of a part of the program.
#[derive(Clone, Debug, PartialEq)]
pub struct RepeatBlocks {
    /// Its first block.
    pub first: Destination,
    /// Its last block, if it is named: otherwise the block ENDLABEL or the one before REPEAT.
    pub last: Option<Destination>,
    /// REPEATB: the first block alone.
    pub one_block: bool,
    /// P: how often; `None`: once.
    pub passes: Option<Expr>,
    /// Marked bytes of the labels.
    pub columns: Columns,
}

/// Name and parameters of a sub-program: PROC, EXTERN.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Name in capitals.
    pub name: Arc<str>,
    /// Marked bytes of the name.
    pub columns: Columns,
    /// In order.
    pub parameters: Vec<Parameter>,
    /// SAVE: modal G functions and frame of the caller come back at its end.
    pub save: bool,
}

/// A parameter of a sub-program.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name in capitals; EXTERN has none.
    pub name: Arc<str>,
    /// Marked bytes.
    pub columns: Columns,
    /// Type.
    pub variable_type: VariableType,
    /// VAR: what is assigned to it in the sub-program is assigned to the variable of the caller.
    pub by_reference: bool,
    /// Sizes of the dimensions; `None` for `[]` or a gap: as given.
    pub dimensions: Vec<Option<Expr>>,
    /// Value where the call gives none.
    pub default: Option<Expr>,
}

/// A call of a sub-program.
#[derive(Clone, Debug, PartialEq)]
pub struct Call {
    /// What is called.
    pub callee: Callee,
    /// Marked bytes of the name.
    pub columns: Columns,
    /// Values and variables, gaps included.
    pub arguments: Vec<Option<Expr>>,
    /// P: how often; `None`: once.
    pub passes: Option<Expr>,
    /// BLOCK first TO last: only this part of it.
    pub section: Option<(Destination, Destination)>,
}

/// How a sub-program is named in its call.
#[derive(Clone, Debug, PartialEq)]
pub enum Callee {
    /// NAME, L123: in capitals.
    Name(Arc<str>),
    /// PCALL: folders and name.
    Path(Arc<str>),
    /// CALL, EXTCALL: name, or folders and name, computed at run time.
    Text(Expr),
    /// CALL BLOCK: the program itself.
    Own,
}

/// RET.
#[derive(Clone, Debug, PartialEq)]
pub struct Return {
    /// Block in the caller where it goes on: label or block number as text; `None`: behind the call.
    pub target: Option<Expr>,
    /// Not 0: with the block behind that.
    pub behind: Option<Expr>,
    /// How many levels it returns; `None`: one.
    pub levels: Option<Expr>,
    /// Not 0, and it returns to the main program: from the start of it, if the block is not found.
    pub from_start: Option<Expr>,
    /// Marked bytes.
    pub columns: Columns,
}
