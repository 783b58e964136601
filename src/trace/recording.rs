//! Our own recordings as traces.
//!
//! In: a [`Recording`]. Out: a [`Trace`] with one signal a recorded field, events, programs, machine file, metadata and figures.
//! Tool poses stay in the recording. Memory: 8 bytes a value; `only` keeps what is asked for.

use super::import::ImportOptions;
use super::programmed::ProgrammedPath;
use super::sink::{Head, Layout};
use super::source::Progress;
use super::wire::{Clock, Meaning, Origin, Signal, TimeGrid, Trace, TraceEvent, TraceFormat, Zero};
use crate::base::units::NS_PER_S;
use crate::base::{AXES_MAX, AxisKind, Diagnostic};
use crate::recorder::schema::proto::sollwert::{Path as PathMessage, Sample, Spindle};
use crate::recorder::schema::{FLAGS_FIELD, MONITORING_FIELD, SIGNAL_TOPIC_PREFIX};
use crate::recorder::{
    ABOUT_METADATA, AXES_METADATA, AXIS_FIELDS, AxisSample, Content, Message, PATH_FIELDS, Recording, SPINDLE_FIELDS,
    TopicKind, UNITS_METADATA, spindle_values,
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Messages after which the progress is told.
const PROGRESS_MESSAGES: u64 = 1 << 16;
/// Times of a recording are whole nanoseconds.
const TIME_TOLERANCE_S: f64 = 1e-9;

/// Reads the wanted signals of a recording.
pub fn import_recording(recording: &Recording, options: &ImportOptions) -> Result<Trace, Diagnostic> {
    let mut tracks: Vec<Option<Track>> =
        recording.topics().iter().map(|topic| Track::new(&topic.kind, &topic.fields, options)).collect();
    let mut events = Vec::new();
    let mut programmed = ProgrammedPath::new(machine_axes(recording));
    let total = recording.message_count();
    for (done, message) in (0_u64..).zip(recording.messages()?) {
        let Message { topic, time_ns, content, .. } = message?;
        if let (true, Progress(Some(tell))) = (done.is_multiple_of(PROGRESS_MESSAGES), options.progress) {
            tell(done, total);
        }
        let track = tracks.get_mut(topic).and_then(Option::as_mut);
        match (content, track) {
            (Content::Axis(sample), Some(track)) => track.push_axis(time_ns, &sample),
            (Content::Path(path), Some(track)) => track.push_path(time_ns, &path),
            (Content::Sample(sample), Some(track)) => track.push_sample(time_ns, &sample),
            (Content::Spindle(spindle), Some(track)) => track.push_spindle(time_ns, &spindle),
            (Content::Programmed(message), _) if options.programmed => {
                programmed.push(time_ns as f64 / NS_PER_S, &message);
            }
            (Content::Event(event), _) => events.push(TraceEvent { time_s: time_ns as f64 / NS_PER_S, event: *event }),
            _ => {}
        }
    }
    let mut signals: Vec<Signal> = tracks.into_iter().flatten().flat_map(Track::finish).collect();
    retold(recording, &mut signals);
    let about = recording.metadata(ABOUT_METADATA);
    let version = about.and_then(|about| about.get("version")).map_or("", String::as_str);
    Ok(Trace {
        name: recording.path().display().to_string(),
        origin: Origin {
            format: TraceFormat::Recording,
            description: format!("{} {version}", TraceFormat::Recording.title()).trim_end().to_owned(),
            start_utc: None,
        },
        signals,
        events,
        programs: recording.programs()?,
        programmed,
        machine: recording.machine_text()?,
        metadata: metadata(recording),
        summary: recording.summary(),
        notes: Vec::new(),
    })
}

/// Axes of the machine in its order, with their kinds.
fn machine_axes(recording: &Recording) -> Vec<(String, AxisKind)> {
    let Some(axes) = recording.metadata(AXES_METADATA) else { return Vec::new() };
    let kind = |name: &str| match axes.get(&format!("{name}.kind")).map(String::as_str) {
        Some("rotary") => AxisKind::Rotary,
        _ => AxisKind::Linear,
    };
    let order = axes.get("order").map_or("", String::as_str);
    order.split(',').filter(|name| !name.is_empty()).take(AXES_MAX).map(|name| (name.to_owned(), kind(name))).collect()
}

fn metadata(recording: &Recording) -> BTreeMap<String, BTreeMap<String, String>> {
    let names = recording.metadata_names().filter(|name| *name != UNITS_METADATA);
    names.filter_map(|name| Some((name.to_owned(), recording.metadata(name)?.clone()))).collect()
}

/// Metadata record that tells what the signals of an imported trace are: by our name or by topic, as JSON.
pub(super) const TRACE_METADATA: &str = "trace";

/// What the metadata record says of a signal.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Told {
    name: Option<String>,
    original: String,
    unit: String,
    clock: String,
    discrete: bool,
    words: bool,
    delay_s: f64,
    encoder_zero: bool,
    remark: String,
}

impl Told {
    pub(super) fn of(head: &Head) -> Self {
        let clock = match head.clock {
            Clock::Servo => "servo",
            Clock::Interpolator => "interpolator",
            Clock::Other => "",
        };
        Self {
            name: head.name.clone(),
            original: head.original.clone(),
            unit: head.unit.clone(),
            clock: clock.to_owned(),
            discrete: head.discrete,
            words: head.words,
            delay_s: head.meaning.delay_s,
            encoder_zero: head.meaning.zero == Zero::Encoder,
            remark: head.meaning.remark.clone(),
        }
    }

    fn tell(self, signal: &mut Signal) {
        signal.name = self.name;
        signal.original = self.original;
        signal.unit = self.unit;
        signal.discrete = self.discrete;
        signal.clock = match self.clock.as_str() {
            "servo" => Clock::Servo,
            "interpolator" => Clock::Interpolator,
            _ => Clock::Other,
        };
        let zero = if self.encoder_zero { Zero::Encoder } else { Zero::Same };
        signal.meaning = Meaning { delay_s: self.delay_s, zero, remark: self.remark };
    }
}

/// Signals of an imported trace get back what the recording kept of them.
fn retold(recording: &Recording, signals: &mut [Signal]) {
    let Some(record) = recording.metadata(TRACE_METADATA) else { return };
    for signal in signals {
        let told = record.get(&signal.original).and_then(|text| serde_json::from_str::<Told>(text).ok());
        if let Some(told) = told {
            told.tell(signal);
        }
    }
}

/// Wanted fields of one topic.
struct Track {
    clock: Clock,
    times_ns: Vec<u64>,
    columns: Vec<Column>,
}

/// One signal in the making.
struct Column {
    /// Place in `AXIS_FIELDS`, `PATH_FIELDS` or `SPINDLE_FIELDS`.
    field: usize,
    name: String,
    unit: String,
    values: Vec<f64>,
    labels: Labels,
    discrete: bool,
}

/// Words by number, in the order of their first appearance.
#[derive(Default)]
pub(super) struct Labels {
    words: Vec<String>,
    places: BTreeMap<String, usize>,
}

impl Labels {
    pub(super) fn len(&self) -> usize {
        self.words.len()
    }

    pub(super) fn word(&self, place: usize) -> Option<&str> {
        self.words.get(place).map(String::as_str)
    }

    fn place(&mut self, word: &str) -> usize {
        if let Some(place) = self.places.get(word) {
            return *place;
        }
        self.words.push(word.to_owned());
        self.places.insert(word.to_owned(), self.words.len() - 1);
        self.words.len() - 1
    }
}

impl Track {
    fn new(kind: &TopicKind, fields: &[usize], options: &ImportOptions) -> Option<Self> {
        let columns: Vec<Column> = match kind {
            TopicKind::Axis { name, kind } => fields.iter().map(|field| Column::of_axis(name, *kind, *field)).collect(),
            TopicKind::Path => (0..PATH_FIELDS.len()).map(Column::of_path).collect(),
            TopicKind::Signal { original } => vec![Column::of_sample(original)],
            TopicKind::Spindle => fields.iter().map(|field| Column::of_spindle(*field)).collect(),
            _ => return None,
        };
        let per_setpoint = matches!(kind, TopicKind::Path | TopicKind::Spindle);
        let clock = if per_setpoint { Clock::Interpolator } else { Clock::Servo };
        let columns: Vec<Column> = columns.into_iter().filter(|column| options.wants(&column.name)).collect();
        (!columns.is_empty()).then_some(Self { clock, times_ns: Vec::new(), columns })
    }

    /// False for a message that is not later than the one before: it cannot be placed.
    fn push_time(&mut self, time_ns: u64) -> bool {
        let later = self.times_ns.last().is_none_or(|last| time_ns > *last);
        if later {
            self.times_ns.push(time_ns);
        }
        later
    }

    fn push_axis(&mut self, time_ns: u64, sample: &AxisSample) {
        if self.push_time(time_ns) {
            for column in &mut self.columns {
                column.values.push(sample.get(column.field).unwrap_or(f64::NAN));
            }
        }
    }

    fn push_sample(&mut self, time_ns: u64, sample: &Sample) {
        if self.push_time(time_ns) {
            for column in &mut self.columns {
                let value = sample_value(sample, &mut column.labels);
                column.values.push(value);
            }
        }
    }

    fn push_spindle(&mut self, time_ns: u64, spindle: &Spindle) {
        if self.push_time(time_ns) {
            let values = spindle_values(spindle);
            for column in &mut self.columns {
                column.values.push(values.get(column.field).copied().flatten().unwrap_or(f64::NAN));
            }
        }
    }

    fn push_path(&mut self, time_ns: u64, path: &PathMessage) {
        if self.push_time(time_ns) {
            for column in &mut self.columns {
                column.push_path(path);
            }
        }
    }

    fn finish(self) -> Vec<Signal> {
        let times_s: Vec<f64> = self.times_ns.iter().map(|time_ns| *time_ns as f64 / NS_PER_S).collect();
        let times = TimeGrid::from_times(times_s, TIME_TOLERANCE_S);
        let clock = self.clock;
        self.columns.into_iter().map(|column| column.finish(clock, times.clone())).collect()
    }
}

impl Column {
    fn of_axis(axis: &str, kind: AxisKind, field: usize) -> Self {
        let entry = &AXIS_FIELDS[field];
        Self {
            field,
            name: format!("{axis}.{}", entry.name(kind)),
            unit: entry.unit_name(kind).to_owned(),
            values: Vec::new(),
            labels: Labels::default(),
            discrete: matches!(field, FLAGS_FIELD | MONITORING_FIELD),
        }
    }

    /// Known by its topic until the metadata say more.
    fn of_sample(original: &str) -> Self {
        Self {
            field: 0,
            name: format!("{SIGNAL_TOPIC_PREFIX}{original}"),
            unit: String::new(),
            values: Vec::new(),
            labels: Labels::default(),
            discrete: false,
        }
    }

    fn of_path(field: usize) -> Self {
        let name = PATH_FIELDS[field];
        Self {
            field,
            name: format!("path.{name}"),
            unit: path_unit(name).to_owned(),
            values: Vec::new(),
            labels: Labels::default(),
            discrete: matches!(name, "block" | "line" | "buffered_blocks" | "rotary_only"),
        }
    }

    fn of_spindle(field: usize) -> Self {
        let name = SPINDLE_FIELDS[field];
        Self {
            field,
            name: format!("{SPINDLE_PREFIX}{name}"),
            unit: spindle_unit(name).to_owned(),
            values: Vec::new(),
            labels: Labels::default(),
            discrete: false,
        }
    }

    fn push_path(&mut self, path: &PathMessage) {
        let value = path_value(path, self.field, &mut self.labels);
        self.values.push(value);
    }

    fn head(self) -> Head {
        Head {
            original: self.name.clone(),
            words: matches!(self.name.as_str(), "path.program" | "path.limit_axis" | "path.limit_kind"),
            name: Some(self.name),
            unit: self.unit,
            discrete: self.discrete,
            layout: Layout::Held,
            ..Head::default()
        }
    }

    fn finish(self, clock: Clock, times: TimeGrid) -> Signal {
        Signal {
            original: self.name.clone(),
            name: Some(self.name),
            unit: self.unit,
            clock,
            times,
            values: self.values,
            labels: self.labels.words,
            discrete: self.discrete,
            meaning: Meaning::default(),
        }
    }
}

/// What our names of the signals of the spindle begin with.
pub(super) const SPINDLE_PREFIX: &str = "spindle.";

pub(super) fn spindle_unit(field: &str) -> &'static str {
    let units = [("_deg", "deg"), ("_rpm", "rpm"), ("_rot_s2", "rot/s^2")];
    units.iter().find(|(ending, _)| field.ends_with(ending)).map_or("", |(_, unit)| unit)
}

pub(super) fn path_unit(field: &str) -> &'static str {
    let units = [("_mm_min", "mm/min"), ("_mm_s2", "mm/s^2"), ("_mm_s3", "mm/s^3"), ("_mm", "mm")];
    units.iter().find(|(ending, _)| field.ends_with(ending)).map_or("", |(_, unit)| unit)
}

/// Field `field` of `PATH_FIELDS`; a word is told by its place among `labels`.
pub(super) fn path_value(path: &PathMessage, field: usize, labels: &mut Labels) -> f64 {
    let mut word = |text: &Option<String>| text.as_deref().map_or(f64::NAN, |text| labels.place(text) as f64);
    match field {
        0 => word(&path.program),
        1 => path.block.map_or(f64::NAN, |block| block as f64),
        2 => path.line.map_or(f64::NAN, f64::from),
        3 => path.s_mm.unwrap_or(f64::NAN),
        4 => path.feed_mm_min.unwrap_or(f64::NAN),
        5 => path.programmed_feed_mm_min.unwrap_or(f64::NAN),
        6 => path.acceleration_mm_s2.unwrap_or(f64::NAN),
        7 => path.jerk_mm_s3.unwrap_or(f64::NAN),
        8 => word(&path.limit_axis),
        9 => word(&path.limit_kind),
        10 => path.buffered_blocks.map_or(f64::NAN, f64::from),
        11 => path.contour_error_mm.unwrap_or(f64::NAN),
        12 => path.rotary_only.map_or(f64::NAN, |only| f64::from(u8::from(only))),
        _ => path.override_ratio.unwrap_or(f64::NAN),
    }
}

/// A number, or a word by its place among `labels`.
pub(super) fn sample_value(sample: &Sample, labels: &mut Labels) -> f64 {
    let word = sample.text.as_deref().map(|text| labels.place(text) as f64);
    sample.value.or(word).unwrap_or(f64::NAN)
}

/// Heads get back what the recording kept of an imported trace.
pub(super) fn retold_heads(recording: &Recording, heads: &mut [Head]) {
    let Some(record) = recording.metadata(TRACE_METADATA) else { return };
    for head in heads {
        let told = record.get(&head.original).and_then(|text| serde_json::from_str::<Told>(text).ok());
        if let Some(told) = told {
            head.words = told.words;
            (head.name, head.original, head.unit) = (told.name, told.original, told.unit);
        }
    }
}

/// Heads of the fields of a topic.
pub(super) fn field_heads(kind: &TopicKind, fields: &[usize]) -> Vec<Head> {
    match kind {
        TopicKind::Axis { name, kind } => {
            fields.iter().map(|field| Column::of_axis(name, *kind, *field).head()).collect()
        }
        TopicKind::Path => (0..PATH_FIELDS.len()).map(|field| Column::of_path(field).head()).collect(),
        TopicKind::Spindle => fields.iter().map(|field| Column::of_spindle(*field).head()).collect(),
        TopicKind::Signal { original } => {
            vec![Head { layout: Layout::Own, name: None, ..Column::of_sample(original).head() }]
        }
        _ => Vec::new(),
    }
}
