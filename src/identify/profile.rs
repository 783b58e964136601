//! A motion along its path: where, and when, at equal shares of the path.
//!
//! In: set-points of a trace, or of a program planned here. Out: [`PathProfile`]: positions, times and mean feeds on [`CELLS`] stretches of
//! equal length, standstill in front and behind left out; of a program that starts and stops a trace ($AN_SLTRACE), what lies between. Where a trace has
//! the feed along the path alone, that is all there is. Two motions along nearly the same path are held against each other stretch by
//! stretch, however different their times are. Does not fit.

use crate::base::units::mm_s_from_mm_min;
use crate::base::{AxisId, AxisKind};
use crate::interpolator::Interpolator;
use crate::interpreter::{Event, Setup};
use crate::kernel::{PieceSource, Preparation};
use crate::machine::Machine;
use crate::trace::{Clock, Method, Signal, TimeGrid, Trace, TraceEvent};
use std::sync::Arc;

/// Stretches of a path.
pub(super) const CELLS: usize = 3000;
/// Stretches that a speed is the mean of: in one alone the grain of the set-points is seen.
const FEW: usize = 5;
/// Stretches of it in a picture.
const DRAWN: usize = 750;
/// Set-points at most: five hours at 1 ms.
const SETPOINTS_MAX: usize = 20_000_000;
/// A program that goes on longer outside of its trace is endless.
const ENDLESS_S: f64 = 3600.0;
/// A step below this is standstill.
const STEP_MIN_MM: f64 = 1e-7;

/// Feed along the path.
pub(super) const FEED: &str = "path.feed_mm_min";

/// Linear axes of a machine.
pub(super) fn linear_axes(machine: &Machine) -> Vec<AxisId> {
    machine.axis_ids().filter(|id| machine.axis(*id).kind == AxisKind::Linear).collect()
}

/// Between the events of $AN_SLTRACE = 1 and = 2 of a recording.
fn traced_between_s(trace: &Trace) -> Option<[f64; 2]> {
    let of = |text: &str| {
        let fits = |event: &&TraceEvent| {
            event.event.kind.as_deref() == Some("trace") && event.event.text.as_deref() == Some(text)
        };
        trace.events.iter().rev().find(fits).map(|event| event.time_s)
    };
    let from_s = of("start")?;
    Some([from_s, of("stop").filter(|to_s| *to_s > from_s).unwrap_or(f64::INFINITY)])
}

/// Rows are missing: one alone is bridged, more are not.
fn has_gap(times: &TimeGrid) -> bool {
    if matches!(times, TimeGrid::Uniform { .. }) {
        return false;
    }
    let all: Vec<f64> = times.iter().collect();
    let longest_s = all.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    times.period_s().is_some_and(|period_s| longest_s > 2.5 * period_s)
}

/// A motion on equal stretches of its path.
#[derive(Clone, Debug)]
pub(super) struct PathProfile {
    /// Positions of the linear axes at the borders of the stretches, `CELLS + 1`.
    pub(super) places_mm: Vec<Vec<f64>>,
    /// Mean feed in each stretch.
    pub(super) feeds_mm_s: Vec<f64>,
    /// Length of the path.
    pub(super) length_mm: f64,
    /// From the first to the last motion.
    pub(super) time_s: f64,
    /// Mean programmed feed of the motion; 0 where it is not known.
    pub(super) programmed_mm_s: f64,
}

/// Linear axes that both the machine and the trace have.
pub(super) fn shared_axes(trace: &Trace, machine: &Machine) -> Vec<AxisId> {
    let has = |id: &AxisId| {
        let axis = machine.axis(*id);
        axis.kind == AxisKind::Linear && trace.axis_signal(&axis.name, "position_setpoint").is_some_and(|s| s.len() > 1)
    };
    machine.axis_ids().filter(has).collect()
}

impl PathProfile {
    /// Set-points of a trace a period apart, and the period; `None` with gaps.
    pub(super) fn rows(trace: &Trace, machine: &Machine, axes: &[AxisId]) -> Option<(Vec<Vec<f64>>, f64)> {
        let signals: Option<Vec<&Signal>> =
            axes.iter().map(|id| trace.axis_signal(&machine.axis(*id).name, "position_setpoint")).collect();
        let signals = signals?;
        let grid = &signals.first()?.times;
        let (mut start_s, mut end_s, period_s) = (grid.start_s()?, grid.end_s()?, grid.period_s()?);
        if has_gap(grid) {
            return None;
        }
        if let Some([from_s, to_s]) = traced_between_s(trace) {
            (start_s, end_s) = (start_s.max(from_s), end_s.min(to_s));
        }
        let rows = ((end_s - start_s) / period_s).round();
        if !(1.0..SETPOINTS_MAX as f64).contains(&rows) {
            return None;
        }
        let times: Vec<f64> = (0..=rows as usize).map(|k| start_s + k as f64 * period_s).collect();
        let column = |signal: &&Signal| {
            let method = if signal.clock == Clock::Servo { Method::Hold } else { Method::Linear };
            signal.resampled(&times, method)
        };
        let columns: Vec<Vec<f64>> = signals.iter().map(column).collect();
        let places: Vec<Vec<f64>> =
            (0..times.len()).map(|k| columns.iter().map(|column| column[k]).collect()).collect();
        let complete = places.iter().flatten().all(|value| value.is_finite());
        complete.then_some((places, period_s))
    }

    /// Of the set-points of a trace; `None` without motion.
    pub(super) fn of_rows((places, period_s): &(Vec<Vec<f64>>, f64)) -> Option<Self> {
        Self::of(places, *period_s, 0.0)
    }

    /// Of the feed along the path of a trace; `None` without it.
    pub(super) fn of_feed(trace: &Trace) -> Option<Self> {
        let signal = trace.signal(FEED)?;
        let (start_s, end_s, period_s) = (signal.times.start_s()?, signal.times.end_s()?, signal.times.period_s()?);
        let [start_s, end_s] =
            traced_between_s(trace).map_or([start_s, end_s], |[from_s, to_s]| [start_s.max(from_s), end_s.min(to_s)]);
        let rows = ((end_s - start_s) / period_s).round();
        if !(1.0..SETPOINTS_MAX as f64).contains(&rows) {
            return None;
        }
        let times: Vec<f64> = (0..=rows as usize).map(|k| start_s + k as f64 * period_s).collect();
        // Where there is no path there is no feed.
        let feeds = signal.resampled(&times, Method::Linear);
        let mut way_mm = 0.0;
        let mut ways = vec![vec![0.0]];
        for pair in feeds.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|feed| if feed.is_finite() { mm_s_from_mm_min(feed) } else { 0.0 });
            way_mm += (from + to) / 2.0 * period_s;
            ways.push(vec![way_mm]);
        }
        let mut profile = Self::of(&ways, period_s, 0.0)?;
        profile.places_mm.clear();
        Some(profile)
    }

    /// Of a program as this machine plans it; `None` after an alarm, and where it goes on for an hour and four times as long as the trace did.
    pub(super) fn planned(machine: &Arc<Machine>, setup: &Setup, axes: &[AxisId], traced_s: f64) -> Option<Self> {
        // Set-points alone: what a kernel adds to them (tool, drives, rows) takes twice as long as they do.
        let mut source = Preparation::new(setup.clone(), machine);
        let mut interpolator = Interpolator::new(machine);
        let period_s = machine.cycle.time_base.seconds(machine.cycle.time_base.ticks_per_setpoint());
        let mut places = Vec::new();
        let (mut feed_sum, mut feed_count) = (0.0, 0.0_f64);
        // Until the program says otherwise all of it is.
        let mut traced = true;
        let cycles_max = ((ENDLESS_S + 4.0 * traced_s) / period_s) as u64;
        for cycle in 0.. {
            if cycle > cycles_max || places.len() > SETPOINTS_MAX {
                return None;
            }
            let setpoint = interpolator.sample(cycle, &mut || source.next_piece());
            for event in interpolator.begun().iter().flat_map(|begun| &begun.events) {
                let Event::Trace(starts) = event else { continue };
                if *starts {
                    places.clear();
                    (feed_sum, feed_count) = (0.0, 0.0);
                }
                traced = *starts;
            }
            let Some(setpoint) = setpoint else { break };
            if traced {
                places.push(axes.iter().map(|id| setpoint.axes[*id].position_lu).collect());
                if let (Some(feed), false) = (setpoint.path.programmed_feed_lu_s, setpoint.path.rotary_only) {
                    feed_sum += feed;
                    feed_count += 1.0;
                }
            }
        }
        if source.take_findings().alarm.is_some() {
            return None;
        }
        Self::of(&places, period_s, feed_sum / feed_count.max(1.0))
    }

    fn of(places: &[Vec<f64>], period_s: f64, programmed_mm_s: f64) -> Option<Self> {
        let step = |pair: &[Vec<f64>]| pair[0].iter().zip(&pair[1]).map(|(a, b)| (b - a).powi(2)).sum::<f64>().sqrt();
        let steps: Vec<f64> = places.windows(2).map(step).collect();
        let first = steps.iter().position(|step| *step > STEP_MIN_MM)?;
        let last = steps.iter().rposition(|step| *step > STEP_MIN_MM)?;
        let mut lengths = vec![0.0];
        for step in &steps[first..=last] {
            lengths.push(lengths[lengths.len() - 1] + step);
        }
        let length_mm = lengths[lengths.len() - 1];
        let places = &places[first..=last + 1];
        let (mut borders, mut times) = (Vec::with_capacity(CELLS + 1), Vec::with_capacity(CELLS + 1));
        let mut at = 0;
        for cell in 0..=CELLS {
            let wanted = length_mm * cell as f64 / CELLS as f64;
            // The last sample that has come no further: a standstill belongs to the stretch behind it.
            while at + 2 < lengths.len() && lengths[at + 1] < wanted {
                at += 1;
            }
            let way = lengths[at + 1] - lengths[at];
            let share = if way > 0.0 { ((wanted - lengths[at]) / way).clamp(0.0, 1.0) } else { 0.0 };
            times.push((at as f64 + share) * period_s);
            borders.push(between(places, at, share));
        }
        let cell_mm = length_mm / CELLS as f64;
        let feeds_mm_s = times.windows(2).map(|pair| cell_mm / (pair[1] - pair[0]).max(1e-9)).collect();
        let time_s = (last + 1 - first) as f64 * period_s;
        Some(Self { places_mm: borders, feeds_mm_s, length_mm, time_s, programmed_mm_s })
    }

    /// Highest speed of each axis, as means of [`FEW`] stretches; nothing without a path.
    pub(super) fn speeds_mm_s(&self) -> Vec<f64> {
        let columns = self.places_mm.first().map_or(0, Vec::len);
        let cell_mm = self.length_mm / CELLS as f64;
        let mut speeds = vec![0.0_f64; columns];
        for (places, feeds) in self.places_mm.windows(FEW + 1).zip(self.feeds_mm_s.windows(FEW)) {
            let time_s: f64 = feeds.iter().map(|feed| cell_mm / feed).sum();
            for (column, speed) in speeds.iter_mut().enumerate() {
                *speed = speed.max((places[FEW][column] - places[0][column]).abs() / time_s);
            }
        }
        speeds
    }

    /// Sideways distances from `reference` at equal shares of the path, one vector a border.
    pub(super) fn sideways_mm(&self, reference: &Self) -> Vec<f64> {
        if self.places_mm.is_empty() || reference.places_mm.is_empty() {
            return Vec::new();
        }
        let mut all = Vec::with_capacity(self.places_mm.len() * 3);
        let shift: Vec<f64> = reference.places_mm[0].iter().zip(&self.places_mm[0]).map(|(a, b)| a - b).collect();
        for cell in 0..=CELLS {
            let (before, after) = (cell.saturating_sub(1), (cell + 1).min(CELLS));
            let tangent: Vec<f64> =
                reference.places_mm[after].iter().zip(&reference.places_mm[before]).map(|(b, a)| b - a).collect();
            let size = tangent.iter().map(|t| t * t).sum::<f64>().sqrt().max(1e-12);
            let own = self.places_mm[cell].iter().zip(&shift).map(|(place, shift)| place + shift);
            let off: Vec<f64> = own.zip(&reference.places_mm[cell]).map(|(a, b)| a - b).collect();
            let along = off.iter().zip(&tangent).map(|(d, t)| d * t / size).sum::<f64>();
            all.extend(off.iter().zip(&tangent).map(|(d, t)| d - along * t / size));
        }
        all
    }

    /// Mean feeds of [`DRAWN`] stretches, for a picture.
    pub(super) fn coarse_feeds_mm_s(&self) -> Vec<f64> {
        // Equal ways: the mean feed is the harmonic one.
        let mean = |feeds: &[f64]| feeds.len() as f64 / feeds.iter().map(|feed| 1.0 / feed.max(1e-9)).sum::<f64>();
        self.feeds_mm_s.chunks(CELLS / DRAWN).map(mean).collect()
    }

    /// RMS of the differences of feed over the path.
    pub(super) fn feed_rms_mm_s(&self, reference: &Self) -> f64 {
        let square: f64 = self.feeds_mm_s.iter().zip(&reference.feeds_mm_s).map(|(a, b)| (a - b).powi(2)).sum();
        (square / CELLS as f64).sqrt()
    }

    /// RMS of the sideways distances; NaN without a path.
    pub(super) fn sideways_rms_mm(&self, reference: &Self) -> f64 {
        if reference.places_mm.is_empty() {
            return f64::NAN;
        }
        let square: f64 = self.sideways_mm(reference).iter().map(|off| off * off).sum();
        (square / (CELLS + 1) as f64).sqrt()
    }
}

/// The place at a share of the time from one set-point to the next: a cubic through both with the slopes of their neighbours. The straight line between them
/// cuts a bend by as much as the shapes of corners differ (1 um at 50 mm/s and 1 ms in a radius of 0.3 mm), and by another amount at another feed.
fn between(places: &[Vec<f64>], at: usize, share: f64) -> Vec<f64> {
    let (Some(from), Some(to)) = (places.get(at), places.get(at + 1)) else {
        return places.last().cloned().unwrap_or_default();
    };
    let before = at.checked_sub(1).and_then(|k| places.get(k)).unwrap_or(from);
    let after = places.get(at + 2).unwrap_or(to);
    let u = share;
    let cubic = |(((a, b), c), d): (((&f64, &f64), &f64), &f64)| {
        let (slope, bend) = (0.5 * (c - a), a - 2.5 * b + 2.0 * c - 0.5 * d);
        b + u * (slope + u * (bend + u * (1.5 * (b - c) + 0.5 * (d - a))))
    };
    before.iter().zip(from).zip(to).zip(after).map(cubic).collect()
}
