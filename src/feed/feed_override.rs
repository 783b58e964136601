//! The feed override at run time: what the switch of the control panel is turned to, and when.
//!
//! In: `2.5=50,4=120` (time in s, percent), or the same as numbers. Out: an [`OverrideSchedule`], and for the planner an [`OverrideCourse`], which knows
//! what is in force at a time and what comes next. A change takes effect at the first set-point at or after its time, and nothing
//! before that knows of it. Does not change any feed: the planner does.

use super::OverrideStep;
use crate::base::units::{percent_from_ratio, ratio_from_percent};
use crate::base::{Diagnostic, SourceText, TimeBase};
use std::ops::Range;

/// Highest override: that of the programmed one and of all others together.
pub(super) const OVERRIDE_MAX_RATIO: f64 = 2.0;

/// Lowest override above 0, in percent.
const LOWEST_PERCENT: f64 = 0.1;

/// Latest change: a program of 11 days.
const TIME_MAX_S: f64 = 1e6;

/// A time this share before a set-point is that of the set-point: times are sums of rounded durations.
const SAME_TIME_RATIO: f64 = 1e-9;

/// One turn of the switch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverrideChange {
    /// Since the start of the program.
    pub time_s: f64,
    /// From then on: 1 is the programmed feed.
    pub override_ratio: f64,
}

/// All turns of the switch during a run, in order; before the first one the override is 100 %.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OverrideSchedule {
    changes: Vec<OverrideChange>,
}

impl OverrideSchedule {
    /// 100 % from end to end.
    pub fn none() -> Self {
        Self::default()
    }

    /// Reads `time=percent,...`. Errors mark the place in the text: no number, percent outside 0 and 0.1 to 200, times that do not rise, 0 % for
    /// ever.
    pub fn parse(text: &str) -> Result<Self, Diagnostic> {
        let source = SourceText::new("--override", text);
        let wrong = |span: Range<usize>, message: String, label: &str| {
            Diagnostic::error("C0007", message)
                .at(source.place(span, label))
                .help("write TIME=PERCENT,..., such as --override 2.5=50,4=120,6=100: seconds from the start of the program, and 0 to 200 %")
        };
        let mut changes: Vec<OverrideChange> = Vec::new();
        let mut start = 0;
        for part in text.split(',') {
            let span = start..start + part.len();
            start = span.end + 1;
            let Some((time, percent)) = part.split_once('=') else {
                return Err(wrong(span, format!("--override: {part:?} is no TIME=PERCENT"), "expected TIME=PERCENT"));
            };
            let time_span = span.start..span.start + time.len();
            let percent_span = time_span.end + 1..span.end;
            let Some(time_s) = number(time).filter(|time_s| (0.0..=TIME_MAX_S).contains(time_s)) else {
                let message = format!("--override: {time:?} is no time");
                return Err(wrong(time_span, message, "expected seconds from the start of the program, 0 to 1000000"));
            };
            let Some(percent) = number(percent).filter(|percent| is_allowed(*percent)) else {
                let message = format!("--override: {percent:?} is no override");
                return Err(wrong(percent_span, message, "expected percent: 0, or 0.1 to 200"));
            };
            if changes.last().is_some_and(|before| time_s <= before.time_s) {
                let message = format!("--override: {time} s is not after the change before it");
                return Err(wrong(time_span, message, "expected a later time"));
            }
            if span.end == text.len() && percent == 0.0 {
                let message = "--override: 0 % for ever: the program would never end".to_owned();
                return Err(wrong(percent_span, message, "expected a later change to more than 0 %"));
            }
            changes.push(OverrideChange { time_s, override_ratio: ratio_from_percent(percent) });
        }
        Ok(Self { changes })
    }

    /// The changes in order.
    pub fn changes(&self) -> &[OverrideChange] {
        &self.changes
    }
}

fn number(text: &str) -> Option<f64> {
    text.trim().parse::<f64>().ok().filter(|number| number.is_finite())
}

fn is_allowed(percent: f64) -> bool {
    percent == 0.0 || (LOWEST_PERCENT..=percent_from_ratio(OVERRIDE_MAX_RATIO)).contains(&percent)
}

/// A schedule on the set-points of a machine and what synchronised actions add to it, and how far both have come.
#[derive(Clone, Debug)]
pub(super) struct OverrideCourse {
    /// Times are those of set-points.
    changes: Vec<OverrideChange>,
    /// Changes that are in force or past.
    done: usize,
    /// $AC_OVR, and when it changes next to what.
    synchronised_ratio: f64,
    synchronised_next: Option<OverrideChange>,
    /// What came into force and has not been told of, and what was in force before that.
    untold: Vec<OverrideChange>,
    told_ratio: f64,
    time_base: TimeBase,
}

impl OverrideCourse {
    /// At the start of the program, before any change.
    pub fn new(schedule: &OverrideSchedule, time_base: TimeBase) -> Self {
        let setpoint_period_s = time_base.setpoint_period_s();
        let at_setpoint = |change: &OverrideChange| {
            let k = (change.time_s / setpoint_period_s * (1.0 - SAME_TIME_RATIO)).ceil().max(0.0) as u64;
            OverrideChange { time_s: time_base.time_s(time_base.setpoint_tick(k)), ..*change }
        };
        Self {
            changes: schedule.changes.iter().map(at_setpoint).collect(),
            done: 0,
            synchronised_ratio: 1.0,
            synchronised_next: None,
            untold: Vec::new(),
            told_ratio: 1.0,
            time_base,
        }
    }

    /// Everything up to this time has happened.
    pub fn advance(&mut self, time_s: f64) {
        let by_s = time_s + SAME_TIME_RATIO * time_s;
        loop {
            let next = self.changes.get(self.done).filter(|change| change.time_s <= by_s).copied();
            let added = self.synchronised_next.filter(|change| change.time_s <= by_s);
            let before_ratio = self.ratio();
            let time_s = match (next, added) {
                (Some(next), added) if added.is_none_or(|added| next.time_s <= added.time_s) => {
                    self.done += 1;
                    next.time_s
                }
                (_, Some(added)) => {
                    (self.synchronised_ratio, self.synchronised_next) = (added.override_ratio, None);
                    added.time_s
                }
                _ => return,
            };
            if self.ratio() != before_ratio {
                self.untold.push(OverrideChange { time_s, override_ratio: self.ratio() });
            }
        }
    }

    /// What is in force.
    pub fn ratio(&self) -> f64 {
        (self.panel_ratio() * self.synchronised_ratio).min(OVERRIDE_MAX_RATIO)
    }

    fn panel_ratio(&self) -> f64 {
        self.done.checked_sub(1).map_or(1.0, |last| self.changes[last].override_ratio)
    }

    /// When it changes next, as far as is known; infinite: never.
    pub fn next_s(&self) -> f64 {
        let now = self.panel_ratio();
        let panel = self.changes[self.done..].iter().find(|change| change.override_ratio != now);
        let next = [panel, self.synchronised_next.as_ref()].into_iter().flatten();
        next.map(|change| change.time_s).fold(f64::INFINITY, f64::min)
    }

    /// $AC_OVR as it is and, if that is decided, will be.
    pub fn synchronised_ratio(&self) -> (f64, bool) {
        (self.synchronised_ratio, self.synchronised_next.is_some())
    }

    /// $AC_OVR from set-point `k` on.
    pub fn synchronise(&mut self, k: u64, override_ratio: f64) {
        self.synchronised_next = Some(OverrideChange { time_s: self.setpoint_s(k), override_ratio });
    }

    /// What is in force from one time to another, counted from the first; empty: 100 %. Times asked for do not fall, and everything up to the second one
    /// has happened.
    pub fn steps(&mut self, from_s: f64, to_s: f64) -> Vec<OverrideStep> {
        self.advance(to_s);
        let mut steps = vec![];
        for change in self.untold.drain(..) {
            let after_s = change.time_s - SAME_TIME_RATIO * change.time_s - from_s;
            if after_s > 0.0 {
                if steps.is_empty() {
                    steps.push(OverrideStep { from_s: 0.0, override_ratio: self.told_ratio });
                }
                steps.push(OverrideStep { from_s: after_s, override_ratio: change.override_ratio });
            }
            self.told_ratio = change.override_ratio;
        }
        if steps.is_empty() && self.told_ratio != 1.0 {
            steps.push(OverrideStep { from_s: 0.0, override_ratio: self.told_ratio });
        }
        steps
    }

    /// Time of a set-point.
    pub fn setpoint_s(&self, k: u64) -> f64 {
        self.time_base.time_s(self.time_base.setpoint_tick(k))
    }

    /// t_s.
    pub fn setpoint_period_s(&self) -> f64 {
        self.time_base.setpoint_period_s()
    }
}
