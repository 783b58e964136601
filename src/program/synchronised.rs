//! Synchronised actions on the feed override: `ID=1 WHENEVER $AA_IM[X] > 50 DO $AC_OVR=60`, `CANCEL(1)`.
//!
//! In: a [`Lexer`] behind the first word of the block. Out: [`Synchronised`], or nothing where the action is another one: that is reported and not
//! executed. Does not evaluate, and does not know whether the condition can be watched.

use super::codes::Columns;
use super::expression::{arguments, expression};
use super::lexer::{Lexer, Number, Token};
use super::not_acted_on::NotActedOn;
use super::syntax::Expr;

/// When the condition is looked at, and how often the action then happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cadence {
    /// No condition: in every cycle.
    Always,
    /// WHEN: once.
    When,
    /// WHENEVER: in every cycle in which it is true.
    Whenever,
    /// EVERY: in every cycle in which it has become true.
    Every,
    /// FROM: in every cycle after it has been true once.
    From,
}

/// An action on $AC_OVR.
#[derive(Clone, Debug, PartialEq)]
pub struct Synchronised {
    /// ID=, IDS=; `None`: for the next block with a motion only.
    pub id: Option<u32>,
    /// When.
    pub cadence: Cadence,
    /// On what.
    pub condition: Option<Expr>,
    /// $AC_OVR.
    pub override_percent: Expr,
    /// The word that opens it.
    pub columns: Columns,
}

impl Cadence {
    /// The word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Always => "",
            Self::When => "WHEN",
            Self::Whenever => "WHENEVER",
            Self::Every => "EVERY",
            Self::From => "FROM",
        }
    }

    fn of(word: &str) -> Option<Self> {
        let all = [Self::When, Self::Whenever, Self::Every, Self::From];
        all.into_iter().find(|cadence| word.eq_ignore_ascii_case(cadence.word()))
    }
}

/// The action of a block that begins with `entry`, if it is one on $AC_OVR.
pub(super) fn synchronised(entry: &'static NotActedOn, columns: Columns, mut lexer: Lexer) -> Option<Synchronised> {
    let lexer = &mut lexer;
    let mut word = entry.word;
    let mut id = None;
    if word.eq_ignore_ascii_case("ID") || word.eq_ignore_ascii_case("IDS") {
        if !lexer.take("=") {
            return None;
        }
        let Ok(Token::Number(Number::Int(number))) = lexer.token() else { return None };
        id = Some(u32::try_from(number).ok()?);
        word = lexer.name()?;
    }
    let (mut cadence, mut condition) = (Cadence::Always, None);
    if let Some(found) = Cadence::of(word) {
        (cadence, condition) = (found, Some(expression(lexer).ok()?));
        word = lexer.name()?;
    }
    if !word.eq_ignore_ascii_case("DO") || !lexer.name()?.eq_ignore_ascii_case("$AC_OVR") || !lexer.take("=") {
        return None;
    }
    let override_percent = expression(lexer).ok()?;
    lexer.at_end().then_some(Synchronised { id, cadence, condition, override_percent, columns })
}

/// The numbers of CANCEL.
pub(super) fn cancelled(lexer: &mut Lexer) -> Option<Vec<Expr>> {
    if !lexer.take("(") {
        return None;
    }
    let numbers = arguments(lexer, ")", false).ok()?.into_iter().collect::<Option<Vec<Expr>>>()?;
    (lexer.at_end() && !numbers.is_empty()).then_some(numbers)
}
