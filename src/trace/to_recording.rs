//! Rows -> a recording: what a controller exported, in the form in which this program records.
//!
//! In: heads and rows. Out: MCAP. Signals of an axis that ours correspond to become `/axis/<NAME>`, sampled at their own period; all
//! others `/signal/<name in the file>`. The metadata record `trace` keeps original names, units, delays and zeros. Memory: one
//! chunk.

use super::export::Written;
use super::import::About;
use super::recording::{TRACE_METADATA, Told};
use super::sink::{Head, Layout, Sink};
use super::wire::{AxisSignal, TraceEvent};
use crate::base::units::NS_PER_S;
use crate::base::{AxisKind, Diagnostic};
use crate::recorder::schema::proto::sollwert::Sample;
use crate::recorder::schema::{
    AXIS_TOPIC_PREFIX, EVENT, EVENT_TOPIC, FLAGS_FIELD, LINEAR_AXIS, MONITORING_FIELD, RECORDING_FORMAT, ROTARY_AXIS,
    SAMPLE, SIGNAL_TOPIC_PREFIX,
};
use crate::recorder::{ABOUT_METADATA, AXES_METADATA, Compression, Target, write_fault, write_options};
use mcap::McapResult;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use prost::Message as _;
use std::collections::BTreeMap;

/// Messages that may be added where a file leaves out what has not changed.
const FILLED_MAX: u64 = 50_000_000;
/// The same for one row of a file: an hour of a signal that stands.
const FILLED_AT_ONCE_MAX: u64 = 4_000_000;
/// Times of a file may miss its grid by this share of a period.
const OFF_GRID_SHARE: f64 = 0.01;
/// Bytes after which a chunk ends.
const CHUNK_BYTES: usize = 1 << 20;

/// Writes a recording.
pub(super) struct ToRecording {
    /// `None` only while it is being closed.
    mcap: Option<mcap::Writer<NoSeek<Target>>>,
    name: String,
    heads: Vec<Head>,
    groups: Vec<Group>,
    /// Group of each signal, and its place there.
    place_of: Vec<(usize, usize)>,
    words: Vec<Vec<String>>,
    event_channel: Option<u16>,
    start_s: Option<f64>,
    last_ns: u64,
    filled: u64,
    chunk_bytes: usize,
    buffer: Vec<u8>,
    messages: u64,
}

/// Signals that share messages.
struct Group {
    channel: u16,
    sequence: u32,
    /// Place in `AXIS_FIELDS`; `None`: a signal of its own.
    fields: Vec<Option<usize>>,
    signals: Vec<usize>,
    values: Vec<f64>,
    held: bool,
    period_s: Option<f64>,
    last_s: Option<f64>,
    touched: bool,
}

impl ToRecording {
    pub(super) fn new(target: Target, name: &str) -> Self {
        Self {
            mcap: write_options(Compression::Zstd).create(NoSeek::new(target)).ok(),
            name: name.to_owned(),
            heads: Vec::new(),
            groups: Vec::new(),
            place_of: Vec::new(),
            words: Vec::new(),
            event_channel: None,
            start_s: None,
            last_ns: 0,
            filled: 0,
            chunk_bytes: 0,
            buffer: Vec::new(),
            messages: 0,
        }
    }

    fn with<T>(
        &mut self,
        act: impl FnOnce(&mut mcap::Writer<NoSeek<Target>>) -> McapResult<T>,
    ) -> Result<T, Diagnostic> {
        match &mut self.mcap {
            Some(mcap) => act(mcap).map_err(|error| write_fault(&self.name, &error)),
            None => Err(Diagnostic::error("R0002", "the recording cannot be written: it did not begin")),
        }
    }

    /// Writes what is known in the end, and the index.
    pub(super) fn finish(mut self, about: &About) -> Result<(Target, Written), Diagnostic> {
        let mut entries = about.metadata.clone();
        let origin = BTreeMap::from([
            ("format".to_owned(), RECORDING_FORMAT.to_string()),
            ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
            ("imported_from".to_owned(), about.origin.description.clone()),
        ]);
        entries.insert(ABOUT_METADATA.to_owned(), origin);
        entries.insert(AXES_METADATA.to_owned(), self.axes());
        entries.insert(TRACE_METADATA.to_owned(), self.told());
        let columns = self.groups.len();
        for (name, metadata) in entries {
            self.with(|mcap| mcap.write_metadata(&Metadata { name, metadata }))?;
        }
        self.with(|mcap| mcap.finish())?;
        let Some(mcap) = self.mcap.take() else {
            return Err(Diagnostic::error("R0002", "the recording cannot be written: it did not begin"));
        };
        let written = Written { rows: self.messages, columns, bytes: 0 };
        Ok((mcap.into_inner().into_inner(), written))
    }

    fn axes(&self) -> BTreeMap<String, String> {
        let mut axes = BTreeMap::new();
        let mut order: Vec<&str> = Vec::new();
        for signal in self.heads.iter().filter_map(|head| AxisSignal::parse(head.name.as_deref()?)) {
            if !order.contains(&signal.axis) {
                order.push(signal.axis);
            }
            if signal.kind == AxisKind::Rotary {
                axes.insert(format!("{}.kind", signal.axis), "rotary".to_owned());
            }
            axes.entry(format!("{}.kind", signal.axis)).or_insert_with(|| "linear".to_owned());
        }
        axes.insert("order".to_owned(), order.join(","));
        axes
    }

    fn told(&self) -> BTreeMap<String, String> {
        let mut told = BTreeMap::new();
        for (head, (group, place)) in self.heads.iter().zip(&self.place_of) {
            let of_axis = self.groups[*group].fields[*place].is_some();
            let key = match (&head.name, of_axis) {
                (Some(name), true) => name.clone(),
                _ => format!("{SIGNAL_TOPIC_PREFIX}{}", head.original),
            };
            if let Ok(text) = serde_json::to_string(&Told::of(head)) {
                told.insert(key, text);
            }
        }
        told
    }

    /// Time of a sample; samples come in order of time.
    fn sample_ns(&mut self, time_s: f64) -> u64 {
        let time_ns = self.time_ns(time_s);
        self.last_ns = self.last_ns.max(time_ns);
        time_ns
    }

    /// Time in the recording: from 0 on where the trace begins before.
    fn time_ns(&mut self, time_s: f64) -> u64 {
        let start_s = *self.start_s.get_or_insert(time_s.min(0.0));
        ((time_s - start_s) * NS_PER_S).round().max(0.0) as u64
    }

    /// A message of a group at an instant, with the values that hold.
    fn write(&mut self, group: usize, time_s: f64) -> Result<(), Diagnostic> {
        let time_ns = self.sample_ns(time_s);
        let Group { channel, sequence, fields, signals, values, .. } = &mut self.groups[group];
        self.buffer.clear();
        for ((field, signal), value) in
            fields.iter().zip(signals.iter()).zip(values.iter()).filter(|(_, v)| !v.is_nan())
        {
            match field {
                Some(field) if matches!(*field, FLAGS_FIELD | MONITORING_FIELD) => {
                    prost::encoding::uint32::encode(*field as u32 + 1, &(*value as u32), &mut self.buffer);
                }
                Some(field) => prost::encoding::double::encode(*field as u32 + 1, value, &mut self.buffer),
                None => {
                    let text = self.words[*signal].get(*value as usize).cloned();
                    let number = if text.is_none() { Some(*value) } else { None };
                    Sample { value: number, text }.encode_raw(&mut self.buffer);
                }
            }
        }
        let header =
            MessageHeader { channel_id: *channel, sequence: *sequence, log_time: time_ns, publish_time: time_ns };
        *sequence = sequence.wrapping_add(1);
        let data = std::mem::take(&mut self.buffer);
        let written = self.with(|mcap| mcap.write_to_known_channel(&header, &data));
        self.messages += 1;
        self.chunk_bytes += data.len() + 31;
        self.buffer = data;
        written?;
        self.end_chunk()
    }

    fn end_chunk(&mut self) -> Result<(), Diagnostic> {
        if self.chunk_bytes < CHUNK_BYTES {
            return Ok(());
        }
        self.chunk_bytes = 0;
        self.with(|mcap| mcap.flush())
    }

    /// Puts back what the file left out because it did not change, for all groups in order of time: messages stand in order.
    fn fill(&mut self, time_s: f64) -> Result<(), Diagnostic> {
        let mut due: Vec<(f64, usize)> = Vec::new();
        for (place, group) in self.groups.iter().enumerate() {
            let (true, Some(period_s), Some(last_s)) = (group.held, group.period_s, group.last_s) else { continue };
            let steps = ((time_s - last_s) / period_s - OFF_GRID_SHARE).ceil() - 1.0;
            if steps.is_nan() || steps < 1.0 {
                continue;
            }
            let missing = steps as u64;
            if missing > FILLED_MAX - self.filled.min(FILLED_MAX) || missing > FILLED_AT_ONCE_MAX {
                due.push((time_s - period_s, place));
                continue;
            }
            self.filled += missing;
            due.extend((1..=missing).map(|step| (last_s + step as f64 * period_s, place)));
        }
        due.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        for (at_s, group) in due {
            self.groups[group].last_s = Some(at_s);
            self.write(group, at_s)?;
        }
        // A group whose next instant this is has a message now, changed or not.
        for group in &mut self.groups {
            let (true, Some(period_s), Some(last_s)) = (group.held, group.period_s, group.last_s) else { continue };
            group.touched |= ((time_s - last_s) / period_s - 1.0).abs() <= OFF_GRID_SHARE;
        }
        Ok(())
    }

    fn add_channels(&mut self) -> Result<(), Diagnostic> {
        let mut by_axis: BTreeMap<String, usize> = BTreeMap::new();
        for (place, head) in self.heads.clone().iter().enumerate() {
            let signal = head.name.as_deref().and_then(AxisSignal::parse);
            let shared = signal.filter(|_| head.layout != Layout::Own);
            let known = shared.and_then(|signal| by_axis.get(signal.axis).copied());
            let group = match known {
                Some(group) => group,
                None => {
                    let group = self.add_group(head, shared)?;
                    if let Some(signal) = shared {
                        by_axis.insert(signal.axis.to_owned(), group);
                    }
                    group
                }
            };
            let entry = &mut self.groups[group];
            self.place_of.push((group, entry.signals.len()));
            entry.fields.push(shared.map(|signal| signal.field));
            entry.signals.push(place);
            entry.values.push(f64::NAN);
            entry.held |= head.layout == Layout::Held;
            entry.period_s = match (entry.period_s, head.period_s) {
                (Some(one), Some(other)) => Some(one.min(other)),
                (one, other) => one.or(other),
            };
        }
        Ok(())
    }

    fn add_group(&mut self, head: &Head, shared: Option<AxisSignal>) -> Result<usize, Diagnostic> {
        let mut metadata = BTreeMap::new();
        let (topic, schema) = match shared {
            Some(signal) => {
                let of_axis = |head: &&Head| {
                    let own = head.name.as_deref().and_then(AxisSignal::parse);
                    head.layout != Layout::Own && own.is_some_and(|own| own.axis == signal.axis)
                };
                let names: Vec<&str> = self
                    .heads
                    .iter()
                    .filter(of_axis)
                    .filter_map(|head| head.name.as_deref()?.split_once('.'))
                    .map(|(_, field)| field)
                    .collect();
                let kinds =
                    self.heads.iter().filter(of_axis).filter_map(|head| AxisSignal::parse(head.name.as_deref()?));
                let rotary = kinds.into_iter().any(|own| own.kind == AxisKind::Rotary);
                metadata.insert("axis".to_owned(), signal.axis.to_owned());
                metadata.insert("kind".to_owned(), if rotary { "rotary" } else { "linear" }.to_owned());
                metadata.insert("fields".to_owned(), names.join(","));
                (format!("{AXIS_TOPIC_PREFIX}{}", signal.axis), if rotary { ROTARY_AXIS } else { LINEAR_AXIS })
            }
            None => (format!("{SIGNAL_TOPIC_PREFIX}{}", head.original), SAMPLE),
        };
        let channel = self.with(|mcap| {
            let schema = mcap.add_schema(schema.name, "protobuf", schema.descriptors)?;
            mcap.add_channel(schema, &topic, "protobuf", &metadata)
        })?;
        self.groups.push(Group {
            channel,
            sequence: 0,
            fields: Vec::new(),
            signals: Vec::new(),
            values: Vec::new(),
            held: false,
            period_s: None,
            last_s: None,
            touched: false,
        });
        Ok(self.groups.len() - 1)
    }
}

impl Sink for ToRecording {
    fn begin(&mut self, heads: &[Head]) -> Result<(), Diagnostic> {
        self.heads = heads.to_vec();
        self.words = vec![Vec::new(); heads.len()];
        self.add_channels()
    }

    fn word(&mut self, signal: usize, word: &str) {
        if let Some(words) = self.words.get_mut(signal) {
            words.push(word.to_owned());
        }
    }

    fn row(&mut self, time_s: f64, cells: &[(usize, f64)]) -> Result<(), Diagnostic> {
        self.fill(time_s)?;
        for (signal, _) in cells {
            let Some((group, _)) = self.place_of.get(*signal).copied() else { continue };
            let entry = &mut self.groups[group];
            if !entry.touched && !entry.held {
                entry.values.fill(f64::NAN);
            }
            entry.touched = true;
        }
        for (signal, value) in cells {
            if let Some((group, place)) = self.place_of.get(*signal).copied() {
                self.groups[group].values[place] = *value;
            }
        }
        for group in 0..self.groups.len() {
            if std::mem::take(&mut self.groups[group].touched) {
                self.groups[group].last_s = Some(time_s);
                self.write(group, time_s)?;
            }
        }
        Ok(())
    }

    fn event(&mut self, event: TraceEvent) -> Result<(), Diagnostic> {
        let channel = match self.event_channel {
            Some(channel) => channel,
            None => {
                let channel = self.with(|mcap| {
                    let schema = mcap.add_schema(EVENT.name, "protobuf", EVENT.descriptors)?;
                    mcap.add_channel(schema, EVENT_TOPIC, "protobuf", &BTreeMap::new())
                })?;
                *self.event_channel.insert(channel)
            }
        };
        // Messages stand in order of time; an event may be told late.
        let time_ns = self.time_ns(event.time_s).max(self.last_ns);
        self.last_ns = time_ns;
        let data = event.event.encode_to_vec();
        let header = MessageHeader { channel_id: channel, sequence: 0, log_time: time_ns, publish_time: time_ns };
        self.messages += 1;
        self.chunk_bytes += data.len() + 31;
        self.with(|mcap| mcap.write_to_known_channel(&header, &data))?;
        self.end_chunk()
    }
}
