//! Frames of an Operate trace: where they lie in time, and whether they hold what their heads promise.
//!
//! In: heads of frames, times of rows. Out: the offset of a frame, gaps between frames, findings at the end; the sort of an axis from
//! its position and speed. Does not read XML.

use super::wire::{Signal, TimeGrid};
use crate::base::{AxisKind, Diagnostic};

/// A `dataSignal`.
#[derive(Clone, Debug)]
pub(super) struct Declared {
    pub(super) id: String,
    pub(super) name: String,
    pub(super) servo: bool,
    pub(super) interval_s: Option<f64>,
    pub(super) points: Option<f64>,
    pub(super) whole: bool,
    pub(super) description: String,
}

/// The frame at work, and what is counted over all.
#[derive(Clone, Debug, Default)]
pub(super) struct Frame {
    /// Frames begun.
    pub(super) number: u32,
    /// Added to the times of the frame.
    pub(super) offset_s: f64,
    pub(super) last_s: Option<f64>,
    pub(super) drop_outs: u64,
    /// Values of each signal, and what its head says.
    pub(super) counts: Vec<u64>,
    pub(super) points: Vec<Option<f64>>,
    first_s: Option<f64>,
    first_start_s: Option<f64>,
}

/// What lies between two frames.
#[derive(Clone, Debug, Default)]
pub(super) struct Gap {
    /// Where values end.
    pub(super) at_s: Option<f64>,
    pub(super) message: Option<String>,
}

impl Frame {
    pub(super) fn row(&mut self, time_s: f64) {
        self.first_s = self.first_s.or(Some(time_s));
        self.last_s = Some(time_s);
    }

    /// A new frame begins: its offset comes from the clock of the control, if that runs forward.
    pub(super) fn begin(&mut self, start_s: Option<f64>, period_s: f64) -> Gap {
        self.number += 1;
        let Some(last_s) = self.last_s else {
            self.first_start_s = start_s;
            return Gap::default();
        };
        let by_clock = start_s.zip(self.first_start_s).map(|(start, first)| start - first);
        match by_clock.filter(|offset| *offset > last_s) {
            Some(offset) => {
                self.offset_s = offset;
                let gap = offset - last_s > 1.5 * period_s;
                Gap { at_s: gap.then_some(last_s + period_s.min((offset - last_s) / 2.0)), message: None }
            }
            None => {
                self.offset_s = last_s + 2.0 * period_s;
                let message = format!(
                    "frame {} has no start time after the frame before it: it is put {period_s} s behind its end",
                    self.number
                );
                Gap { at_s: Some(last_s + period_s), message: Some(message) }
            }
        }
    }

    /// What does not fit at the end. Signals: name, held between changes, period.
    pub(super) fn findings(&self, signals: &[(&str, bool, Option<f64>)], closed: bool) -> Vec<Diagnostic> {
        let mut findings = Vec::new();
        if self.drop_outs > 0 {
            let message = format!("the control lost {} samples while it recorded (dropOuts)", self.drop_outs);
            let help = "where they are missing a value looks as if it had not changed";
            findings.push(Diagnostic::warning("T0013", message).help(help));
        }
        if self.number > 1 {
            let message = format!("{} frames, with gaps between them", self.number);
            findings.push(Diagnostic::note("T0013", message));
        }
        let silent: Vec<&str> =
            signals.iter().zip(&self.counts).filter(|(_, count)| **count == 0).map(|(signal, _)| signal.0).collect();
        if !silent.is_empty() {
            let message = format!("without a value in the file: `{}`", silent.join("`, `"));
            findings.push(Diagnostic::warning("T0008", message));
        }
        if self.number <= 1 && closed {
            findings.extend(self.short(signals));
        }
        findings
    }

    /// A signal that has clearly more or fewer points than its head says.
    fn short(&self, signals: &[(&str, bool, Option<f64>)]) -> Option<Diagnostic> {
        let length_s = self.last_s? - self.first_s?;
        for (((name, held, period_s), count), points) in signals.iter().zip(&self.counts).zip(&self.points) {
            let (Some(points), Some(period_s)) = (points, period_s) else { continue };
            let there = if *held { (length_s / period_s).round() + 1.0 } else { *count as f64 };
            if *count > 0 && (there - points).abs() > 2.0 {
                let message = format!("`{name}` should have {points} points by its head, and has {there}");
                return Some(Diagnostic::warning("T0008", message).help("records may be missing"));
            }
        }
        None
    }
}

/// Linear or rotary: the control writes the speed in mm/min or in rev/min. The signals were read as those of a linear axis.
pub(super) fn kind_by_signals(signals: &[Signal], axis: &str) -> Option<AxisKind> {
    let of = |stem: &str| {
        signals.iter().find(|signal| signal.axis_signal().is_some_and(|own| own.axis == axis && own.stem() == stem))
    };
    let position = of("position_setpoint").or_else(|| of("position_measured"))?;
    let speed = of("velocity_setpoint").or_else(|| of("velocity_actual"))?;
    let travelled: f64 =
        position.values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| step.is_finite()).sum();
    let TimeGrid::Uniform { .. } = speed.times else { return None };
    let period_s = speed.times.period_s()?;
    let read: f64 = speed.values.iter().map(|value| value.abs() * period_s).filter(|step| step.is_finite()).sum();
    let ratio = read / travelled;
    // 1 for a linear axis, 1/360 for a rotary one.
    match ratio {
        _ if travelled <= 0.0 || !ratio.is_finite() => None,
        ratio if (0.3..3.0).contains(&ratio) => Some(AxisKind::Linear),
        ratio if (0.3 / 360.0..3.0 / 360.0).contains(&ratio) => Some(AxisKind::Rotary),
        _ => None,
    }
}
