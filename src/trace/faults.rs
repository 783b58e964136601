//! Faults that are repaired and may come a million times: counted, and said once each with the place of the first.
//!
//! In: code, sentence, byte. Out: findings in the order of their first appearance. Does not decide what is a fault.

use crate::base::Diagnostic;

/// Times beyond 300 years are none: they would not fit the nanoseconds of a recording.
pub(super) const TIME_MAX_S: f64 = 1e10;
/// Sorts of faults that are kept apart.
const SORTS_MAX: usize = 32;

/// What is wrong with a file of which more is left out than taken, because its time does not run forward.
pub(super) fn against_time(left_out: u64, taken: u64, shown: &str) -> Option<Diagnostic> {
    (left_out > taken).then(|| {
        let all = left_out + taken;
        let message = format!(
            "{left_out} of {all} samples of {shown} are not later than the one before: its time runs backwards, or has too few digits"
        );
        Diagnostic::error("T0009", message).help("sort the samples by time; of a table --time 0.002 gives the distance of its rows in s instead")
    })
}

/// Counts.
#[derive(Debug, Default)]
pub(super) struct Faults {
    sorts: Vec<(&'static str, &'static str, u64, u64)>,
}

impl Faults {
    /// One more of its sort; `message` reads "a record ...".
    pub(super) fn count(&mut self, code: &'static str, message: &'static str, byte: u64) {
        if let Some(sort) = self.sorts.iter_mut().find(|sort| sort.0 == code && sort.1 == message) {
            sort.2 += 1;
        } else if self.sorts.len() < SORTS_MAX {
            self.sorts.push((code, message, 1, byte));
        }
    }

    /// How often one of a sort came, and where it came first.
    pub(super) fn of(&self, code: &str, message: &str) -> (u64, u64) {
        let sort = self.sorts.iter().find(|sort| sort.0 == code && sort.1 == message);
        sort.map_or((0, 0), |sort| (sort.2, sort.3))
    }

    /// What was counted; `finding` makes a diagnostic of code, message and byte.
    pub(super) fn findings(
        &self,
        finding: impl Fn(&'static str, String, u64) -> Diagnostic,
    ) -> impl Iterator<Item = Diagnostic> {
        let findings: Vec<Diagnostic> = self
            .sorts
            .iter()
            .map(|(code, message, count, byte)| {
                let times = if *count > 1 { format!(" ({count} times)") } else { String::new() };
                finding(code, format!("{message}{times}"), *byte)
            })
            .collect();
        findings.into_iter()
    }
}
