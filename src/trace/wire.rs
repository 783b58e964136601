//! What every importer makes and every comparison reads: a [`Trace`] of [`Signal`]s.
//!
//! In: samples of an importer. Out: plain data with times in seconds from the start of the trace. A value that is not there is NaN:
//! from its instant to the next sample the signal has no value. Does not read files.

use super::programmed::ProgrammedPath;
use crate::base::units::NS_PER_S;
use crate::base::{AxisKind, Diagnostic};
use crate::program::OpenedProgram;
use crate::recorder::schema::proto::sollwert::Event;
use crate::recorder::{AXIS_FIELDS, axis_field};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Signals of one machine over one stretch of time.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// File as the user named it.
    pub name: String,
    /// Where it comes from.
    pub origin: Origin,
    /// Signals in the order of the file.
    pub signals: Vec<Signal>,
    /// What happened: of a recording all events, of a controller's trace the block starts if it has them. In order of time.
    pub events: Vec<TraceEvent>,
    /// NC programs that travelled with the trace: the first is the main program.
    pub programs: Vec<OpenedProgram>,
    /// What the program asks of the path; empty unless it was asked for ([`ImportOptions::programmed`](super::ImportOptions)) and is known.
    pub programmed: ProgrammedPath,
    /// Name and text of the machine file that travelled with the trace.
    pub machine: Option<(String, String)>,
    /// Other things that the file says about itself, record by record, key by key.
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
    /// Figures of the run, as `run --json` gave them; only of a recording.
    pub summary: Option<serde_json::Value>,
    /// What the import repaired, left out or is not sure of.
    pub notes: Vec<Diagnostic>,
}

/// Where a trace comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// Format, by the content of the file.
    pub format: TraceFormat,
    /// For people: "SINUMERIK Operate trace, version 01.00.03.02".
    pub description: String,
    /// Start by the clock of the control (UTC, ISO 8601), as the file says; that clock may be wrong.
    pub start_utc: Option<String>,
}

/// Formats that can be imported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum TraceFormat {
    /// A recording of this program.
    #[default]
    Recording,
    /// SINUMERIK Operate trace session, XML.
    OperateXml,
    /// XML of measuring functions and auto servo tuning.
    MeasuringXml,
    /// SINUMERIK Edge / Data Recorder, JSON.
    EdgeJson,
    /// A table: CSV of any dialect, our own export too.
    Csv,
    /// TwinCAT Scope CSV.
    TwinCatCsv,
    /// LinuxCNC halscope.
    Halscope,
    /// LinuxCNC halsampler.
    Halsampler,
}

impl TraceFormat {
    /// For people.
    pub fn title(self) -> &'static str {
        match self {
            Self::Recording => "recording of sollwert",
            Self::OperateXml => "SINUMERIK Operate trace",
            Self::MeasuringXml => "SINUMERIK measuring function",
            Self::EdgeJson => "SINUMERIK Edge / Data Recorder",
            Self::Csv => "CSV",
            Self::TwinCatCsv => "TwinCAT Scope CSV",
            Self::Halscope => "LinuxCNC halscope",
            Self::Halsampler => "LinuxCNC halsampler",
        }
    }
}

/// An event with its time.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceEvent {
    /// From the start of the trace.
    pub time_s: f64,
    /// What; the fields of `/event` (docs/recording.md).
    pub event: Event,
}

/// One signal on its own grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// Our name, `X.position_setpoint_mm` or `path.feed_mm_min`, if the signal map has one.
    pub name: Option<String>,
    /// Name in the file, whole: `/Nck/!SD/nckServoDataCmdPos2ndEnc64 [u1, 1]`, `ENC_POS|1`.
    pub original: String,
    /// Unit of `values`: `mm`, `deg/s`, `N m`; empty if it is not known or there is none.
    pub unit: String,
    /// Which clock takes the samples.
    pub clock: Clock,
    /// When each value was taken; as many instants as values.
    pub times: TimeGrid,
    /// Values; NaN where there is none. Of a signal with `labels` the place of the label.
    pub values: Vec<f64>,
    /// Words that the values stand for (`path.limit_kind`); empty for numbers.
    pub labels: Vec<String>,
    /// A whole-number signal (status, flags, line): it is held, not interpolated.
    pub discrete: bool,
    /// How it relates to our signal of the same name.
    pub meaning: Meaning,
}

impl Signal {
    /// Our name if there is one, the original otherwise: what tables and `export` show.
    pub fn shown_name(&self) -> &str {
        self.name.as_deref().unwrap_or(&self.original)
    }

    /// Axis and field, if it is one of our axis signals.
    pub fn axis_signal(&self) -> Option<AxisSignal<'_>> {
        AxisSignal::parse(self.name.as_deref()?)
    }

    /// Whether `name` names it: ours, the original, or ours without the unit (`X.position_setpoint`).
    pub fn is_named(&self, name: &str) -> bool {
        self.original == name
            || self.name.as_deref().is_some_and(|own| {
                own == name || AxisSignal::parse(own).is_some_and(|signal| name == signal.name_without_unit())
            })
    }

    /// The word at place `index`; `None` for numbers and gaps.
    pub fn label(&self, index: usize) -> Option<&str> {
        let value = *self.values.get(index)?;
        if value.is_nan() {
            return None;
        }
        self.labels.get(value as usize).map(String::as_str)
    }

    /// Number of samples, gaps included.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }
}

/// An axis signal, taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisSignal<'a> {
    /// Name of the axis.
    pub axis: &'a str,
    /// Place of the field in [`AXIS_FIELDS`].
    pub field: usize,
    /// By the unit of the name; fields of the motor side are the same for both sorts and count as linear.
    pub kind: AxisKind,
}

impl<'a> AxisSignal<'a> {
    /// Takes `X.position_setpoint_mm` apart; `None` for a name that is not of an axis.
    pub fn parse(name: &'a str) -> Option<Self> {
        let (axis, field_name) = name.split_once('.')?;
        let field = axis_field(field_name)?;
        let entry = &AXIS_FIELDS[field];
        let rotary = entry.rotary == field_name && entry.linear != field_name;
        Some(Self { axis, field, kind: if rotary { AxisKind::Rotary } else { AxisKind::Linear } })
    }

    /// Field without unit: `position_setpoint`.
    pub fn stem(&self) -> &'static str {
        AXIS_FIELDS[self.field].stem
    }

    pub(super) fn name_without_unit(&self) -> String {
        format!("{}.{}", self.axis, self.stem())
    }
}

/// Our name of a field of an axis, with the unit that the sort of the axis asks for. `None` if there is no such field.
pub fn axis_signal_name(axis: &str, kind: AxisKind, stem: &str) -> Option<String> {
    Some(format!("{axis}.{}", AXIS_FIELDS[axis_field(stem)?].name(kind)))
}

/// Which clock of the control takes the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Clock {
    /// Position controller.
    Servo,
    /// Interpolator: its signals come later than those of the position controller.
    Interpolator,
    /// Not known, or another.
    #[default]
    Other,
}

/// When samples were taken, in seconds from the start of the trace.
#[derive(Clone, Debug, PartialEq)]
pub enum TimeGrid {
    /// Sample k at `start_ns + k * step_ns`: whole nanoseconds give the decimal seconds of the file exactly.
    Uniform {
        /// Instant of the first sample.
        start_ns: f64,
        /// Distance of two samples; above 0.
        step_ns: f64,
        /// Samples.
        count: usize,
    },
    /// Times in seconds, strictly increasing. Signals that were taken together share them.
    Explicit(Arc<[f64]>),
}

impl TimeGrid {
    /// Number of instants.
    pub fn len(&self) -> usize {
        match self {
            Self::Uniform { count, .. } => *count,
            Self::Explicit(times) => times.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Instant of sample `index`; NaN beyond the end.
    pub fn time_s(&self, index: usize) -> f64 {
        match self {
            Self::Uniform { start_ns, step_ns, count } if index < *count => {
                (start_ns + index as f64 * step_ns) / NS_PER_S
            }
            Self::Uniform { .. } => f64::NAN,
            Self::Explicit(times) => times.get(index).copied().unwrap_or(f64::NAN),
        }
    }

    /// All instants in order.
    pub fn iter(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.len()).map(|index| self.time_s(index))
    }

    /// First instant.
    pub fn start_s(&self) -> Option<f64> {
        (!self.is_empty()).then(|| self.time_s(0))
    }

    /// Last instant.
    pub fn end_s(&self) -> Option<f64> {
        self.len().checked_sub(1).map(|last| self.time_s(last))
    }

    /// The last sample at or before `time_s`; `None` before the first.
    pub fn index_at(&self, time_s: f64) -> Option<usize> {
        match self {
            Self::Uniform { start_ns, step_ns, count } => {
                let place = (time_s * NS_PER_S - start_ns) / step_ns;
                // Rounding must not put an instant of the grid in front of itself.
                let near = place.round();
                let place = if (place - near).abs() < 1e-6 { near } else { place.floor() };
                (place >= 0.0 && *count > 0).then(|| (place as usize).min(count - 1))
            }
            Self::Explicit(times) => times.partition_point(|time| *time <= time_s).checked_sub(1),
        }
    }

    /// Distance of the samples: of an irregular grid the median of the first thousand distances. `None` below two samples.
    pub fn period_s(&self) -> Option<f64> {
        match self {
            Self::Uniform { step_ns, count, .. } => (*count > 1).then(|| step_ns / NS_PER_S),
            Self::Explicit(times) => {
                let mut steps: Vec<f64> = times.windows(2).take(1000).map(|pair| pair[1] - pair[0]).collect();
                steps.sort_by(f64::total_cmp);
                steps.get(steps.len() / 2).copied()
            }
        }
    }

    /// The grid of given times: uniform where they all lie within `tolerance_s` of one, explicit otherwise.
    pub fn from_times(times_s: Vec<f64>, tolerance_s: f64) -> Self {
        match uniform(&times_s, tolerance_s) {
            Some((start_ns, step_ns)) => Self::Uniform { start_ns, step_ns, count: times_s.len() },
            None => Self::Explicit(times_s.into()),
        }
    }
}

/// Start and step in ns of a grid on which all times lie. The step is brought to whole nanoseconds where that fits.
fn uniform(times: &[f64], tolerance_s: f64) -> Option<(f64, f64)> {
    let (first, last) = (*times.first()?, *times.last()?);
    let steps = times.len().checked_sub(2)? + 1;
    let start_ns = first * NS_PER_S;
    let exact = (last - first) * NS_PER_S / steps as f64;
    let whole = exact.round();
    // Over the whole length a rounded step may drift by what the times are good for, not more.
    let fits = (whole - exact).abs() * steps as f64 <= tolerance_s * NS_PER_S;
    let step_ns = if fits && whole > 0.0 { whole } else { exact };
    let start_ns = if (start_ns - start_ns.round()).abs() < 1e-3 { start_ns.round() } else { start_ns };
    let on_grid = |(index, time): (usize, &f64)| {
        ((start_ns + index as f64 * step_ns) / NS_PER_S - time).abs() <= tolerance_s + time.abs() * f64::EPSILON
    };
    // Below the last bit of the times the instants of a grid would fall together.
    let finest_ns = 64.0 * f64::EPSILON * (last * NS_PER_S).abs().max(start_ns.abs());
    (step_ns > finest_ns && times.iter().enumerate().all(on_grid)).then_some((start_ns, step_ns))
}

/// How an imported signal relates to our signal of the same name: our value at t - `delay_s`, plus the difference of the zeros.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Meaning {
    /// So much later than our signal it shows the same thing; 0 where nothing else is known.
    pub delay_s: f64,
    /// Where its zero lies.
    pub zero: Zero,
    /// For people: what it is exactly, and what to keep in mind.
    pub remark: String,
}

/// Zero of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Zero {
    /// The same as of our signal.
    #[default]
    Same,
    /// That of an encoder: a constant difference means nothing.
    Encoder,
}

impl Trace {
    /// A signal by its name: ours, the original, or ours without unit. The first that fits.
    pub fn signal(&self, name: &str) -> Option<&Signal> {
        self.signals.iter().find(|signal| signal.is_named(name))
    }

    /// A signal of an axis by field without unit, such as `position_setpoint`.
    pub fn axis_signal(&self, axis: &str, stem: &str) -> Option<&Signal> {
        let fits = |signal: &&Signal| signal.axis_signal().is_some_and(|own| own.axis == axis && own.stem() == stem);
        self.signals.iter().find(fits)
    }

    /// Axes of which there is at least one signal, in the order of the file.
    pub fn axes(&self) -> Vec<&str> {
        let mut axes: Vec<&str> = Vec::new();
        for signal in self.signals.iter().filter_map(Signal::axis_signal) {
            if !axes.contains(&signal.axis) {
                axes.push(signal.axis);
            }
        }
        axes
    }

    /// First and last instant of any signal; `None` without samples.
    pub fn span_s(&self) -> Option<(f64, f64)> {
        let starts = self.signals.iter().filter_map(|signal| signal.times.start_s());
        let ends = self.signals.iter().filter_map(|signal| signal.times.end_s());
        Some((starts.min_by(f64::total_cmp)?, ends.max_by(f64::total_cmp)?))
    }
}
