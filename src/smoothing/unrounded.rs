//! Corners that the program wants rounded and that are not: said once each.
//!
//! In: program files as they are opened, blocks that end in such a corner. Out: one warning a reason, with the line marked. Does
//! not change the contour.

use super::OpenedPrograms;
use crate::base::Diagnostic;
use crate::interpreter::Event;
use crate::program::BlockRef;

/// What the program asks for and does not get.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reason {
    /// No blend of the corner keeps the tolerance.
    NoBlend,
    /// RND, CHF or CHR has no place there.
    NoInsert,
    /// RND, CHF or CHR is smaller than programmed.
    SmallInsert,
}

/// Warnings not yet taken, and what has been said.
#[derive(Clone, Debug, Default)]
pub(super) struct Unrounded {
    opened: OpenedPrograms,
    said: Vec<Reason>,
    warnings: Vec<Diagnostic>,
}

impl Unrounded {
    /// Remembers the texts that warnings will quote.
    pub(super) fn watch(&mut self, events: &[Event]) {
        self.opened.watch(events);
    }

    /// A corner at the end of `block` is passed as in G64.
    pub(super) fn report(&mut self, reason: Reason, block: BlockRef) {
        if self.said.contains(&reason) {
            return;
        }
        self.said.push(reason);
        let (code, what, help) = match reason {
            Reason::NoBlend => (
                "S0001",
                "is passed as in G64: no blend keeps the tolerance there",
                "reported once, for the first such corner",
            ),
            Reason::NoInsert => (
                "S0004",
                "stays as it is: there is no place for RND, CHF or CHR",
                "both blocks must be lines or circles of the working plane, with at most 3 blocks between them and no stop; reported once, for the first such corner",
            ),
            Reason::SmallInsert => (
                "S0005",
                "gets a smaller RND, CHF or CHR: one of its blocks is too short",
                "reported once, for the first such corner",
            ),
        };
        let message = format!("the corner at the end of line {} {what}", block.line);
        let warning = Diagnostic::warning(code, message).help(help);
        self.warnings.push(match self.opened.place(block) {
            Some(place) => warning.at(place),
            None => warning,
        });
    }

    /// Warnings since the last call.
    pub(super) fn take(&mut self) -> Vec<Diagnostic> {
        std::mem::take(&mut self.warnings)
    }
}
