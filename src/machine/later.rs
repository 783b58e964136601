//! Values of the file format that cannot be run together.
//!
//! In: a checked [`Machine`]. Out: one finding a value, by name, with what to write instead. `parse` shows them as warnings, `run` and
//! `time` refuse with them as errors: nothing is ever replaced in silence. They are the published models, which know the law with
//! acceleration zero at block ends only.

use super::checked::{ArcLimits, BlendLaw, BlendLimits, Machine, TimeLawKind};
use super::choices::Choice;
use crate::base::diagnostics::Diagnostic;

/// A value that the time law `continuous` has nothing for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Later {
    pub table: &'static str,
    pub key: &'static str,
    pub word: &'static str,
    pub instead: &'static str,
}

/// What a machine asks for that cannot be run, as errors.
pub fn unsupported(machine: &Machine) -> Vec<Diagnostic> {
    later_values(machine).iter().map(Later::error).collect()
}

pub(super) fn later_values(machine: &Machine) -> Vec<Later> {
    let (feed, smoothing) = (&machine.feed, &machine.smoothing);
    if feed.time_law != TimeLawKind::Continuous {
        return Vec::new();
    }
    let rows = [
        (feed.arc_limits != ArcLimits::Worst, "feed", "arc_limits", feed.arc_limits.word(), "worst"),
        (smoothing.blend_law != BlendLaw::Limits, "smoothing", "blend_law", smoothing.blend_law.word(), "limits"),
        (smoothing.limits != BlendLimits::Axis, "smoothing", "limits", smoothing.limits.word(), "axis"),
    ];
    let asked_for = rows.into_iter().filter(|(asked, ..)| *asked);
    asked_for.map(|(_, table, key, word, instead)| Later { table, key, word, instead }).collect()
}

impl Later {
    fn message(&self) -> String {
        format!("{}.{} = \"{}\" needs feed.time_law = \"seven-phase\"", self.table, self.key, self.word)
    }

    fn help(&self) -> String {
        let Self { table, key, instead, .. } = self;
        format!("give --set feed.time_law=seven-phase, or --set {table}.{key}={instead}")
    }

    fn error(&self) -> Diagnostic {
        Diagnostic::error("M0201", self.message()).help(self.help())
    }

    pub fn warning(&self) -> Diagnostic {
        Diagnostic::warning("M0201", format!("{}: `run` and `time` refuse it", self.message())).help(self.help())
    }
}
