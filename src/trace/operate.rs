//! SINUMERIK Operate trace sessions (XML) -> rows. The format is described in docs/traces.md.
//!
//! In: the text of a session, read as a stream; no entity is expanded. Out: heads and rows for a [`Sink`], notes about what was repaired.
//! Attributes are found by name, records are sparse, frames follow one another with a gap between. Memory: one tag and one row.

use super::faults::{Faults, TIME_MAX_S, against_time};
use super::import::{About, ImportOptions};
use super::instants::instant_s;
use super::naming::{NamedHead, Naming, operate_name};
use super::operate_frame::{Declared, Frame};
use super::sink::{Layout, Memory, Sink};
use super::source::{PartReader, Source};
use super::wire::{Clock, Origin, TraceFormat};
use crate::base::Diagnostic;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::collections::BTreeMap;

/// The event number of signals of the servo clock.
const SERVO_EVENT: &str = "255";
/// Columns of a file.
const SIGNALS_MAX: usize = 10_000;
/// Rows that are looked at to know whether an axis is linear or rotary.
const SURVEY_ROWS: usize = 200_000;
/// What is said of a record that is left out.
const EARLIER: &str = "a record is earlier than the one before and is left out";
/// Times that differ by less are one instant: the file has microseconds.
const SAME_INSTANT_S: f64 = 1e-9;

/// Reads a session into a sink.
pub(super) fn read_operate(
    source: &Source,
    part: usize,
    options: &ImportOptions,
    sink: &mut dyn Sink,
) -> Result<About, Diagnostic> {
    Session::new(source, part, options, sink, true).read()
}

struct Session<'s, 'o> {
    source: &'s Source<'o>,
    part: usize,
    options: &'s ImportOptions<'s>,
    naming: Naming<'s>,
    sink: &'s mut dyn Sink,
    /// Whether the sort of unnamed axes may be found by reading ahead.
    may_survey: bool,
    begun: bool,
    /// Whether the records of the last frame are complete.
    closed: bool,
    declared: Vec<Declared>,
    heads: Vec<NamedHead>,
    /// Column of `f7` at place 7.
    by_number: Vec<Option<usize>>,
    by_id: BTreeMap<String, usize>,
    frame: Frame,
    pending: Vec<(usize, f64)>,
    pending_s: Option<f64>,
    /// Instant of the last row that was handed on; later rows must be later.
    floor_s: f64,
    /// Row in which a column last had a value: an attribute may stand twice.
    stamp: Vec<u64>,
    rows: u64,
    faults: Faults,
    metadata: BTreeMap<String, String>,
    version: String,
}

impl<'s, 'o> Session<'s, 'o> {
    fn new(
        source: &'s Source<'o>,
        part: usize,
        options: &'s ImportOptions<'s>,
        sink: &'s mut dyn Sink,
        may_survey: bool,
    ) -> Self {
        Self {
            source,
            part,
            options,
            naming: Naming::new(TraceFormat::OperateXml, options),
            sink,
            may_survey,
            begun: false,
            closed: false,
            declared: Vec::new(),
            heads: Vec::new(),
            by_number: Vec::new(),
            by_id: BTreeMap::new(),
            frame: Frame::default(),
            pending: Vec::new(),
            pending_s: None,
            floor_s: f64::NEG_INFINITY,
            stamp: Vec::new(),
            rows: 0,
            faults: Faults::default(),
            metadata: BTreeMap::new(),
            version: String::new(),
        }
    }

    fn read(mut self) -> Result<About, Diagnostic> {
        let mut reader = Reader::from_reader(self.source.read(self.part)?);
        let config = reader.config_mut();
        config.check_end_names = false;
        config.allow_unmatched_ends = true;
        config.check_comments = false;
        let mut buffer = Vec::new();
        loop {
            buffer.clear();
            reader.get_mut().begin_item();
            let at = reader.buffer_position();
            match reader.read_event_into(&mut buffer) {
                Ok(Event::Start(tag) | Event::Empty(tag)) => self.tag(&tag, at)?,
                Ok(Event::End(tag)) => self.end_tag(tag.name().as_ref())?,
                Ok(Event::DocType(_)) => return Err(self.document_type(at)),
                Ok(Event::Eof) => break,
                Ok(_) => {}
                Err(error) => {
                    if self.stops(&mut reader, at, &error)? {
                        break;
                    }
                }
            }
        }
        let remark = reader.get_ref().encoding_remark();
        self.finish(remark)
    }

    /// A fault of the XML: at the end of the file after some records the trace is cut off, elsewhere it is an error.
    fn stops(
        &mut self,
        reader: &mut Reader<PartReader>,
        at: u64,
        error: &quick_xml::Error,
    ) -> Result<bool, Diagnostic> {
        if let quick_xml::Error::Io(error) = error {
            return Err(self.source.unreadable_at(self.part, at, error));
        }
        let at_end = std::io::BufRead::fill_buf(reader.get_mut()).is_ok_and(|left| left.is_empty());
        if at_end && self.rows > 0 {
            return Ok(true);
        }
        let message = format!("{} is not well-formed XML: {error}", self.source.part_name(self.part));
        let finding = Diagnostic::error("T0004", message).help("export the trace again; a copy may have been cut off");
        Err(self.at(finding, at, "here"))
    }

    fn at(&self, finding: Diagnostic, byte: u64, label: &str) -> Diagnostic {
        match self.source.place(self.part, byte, label) {
            Some(place) => finding.at(place),
            None => finding,
        }
    }

    fn document_type(&self, at: u64) -> Diagnostic {
        let message = "a trace has no document type, and entities are not expanded";
        self.at(Diagnostic::error("T0006", message), at, "not allowed").help("export the trace again from the control")
    }

    fn tag(&mut self, tag: &BytesStart, at: u64) -> Result<(), Diagnostic> {
        match tag.name().as_ref() {
            "rec" => self.record(tag, at),
            "traceSession" => {
                self.version = attribute(tag, "version").unwrap_or_default();
                Ok(())
            }
            "sessionSettings" => {
                self.remember(tag, &["sessionName"]);
                Ok(())
            }
            "sampleRateSettings" => {
                let names = ["servoSampleRate", "ipo1SampleRate", "ipo2SampleRate", "driveSampleRate1"];
                self.remember(tag, &names);
                Ok(())
            }
            "dataFrame" => {
                self.declared.clear();
                Ok(())
            }
            "frameHeader" => self.frame_header(tag),
            "dataSignal" => self.declare(tag, at),
            _ => Ok(()),
        }
    }

    fn end_tag(&mut self, name: &str) -> Result<(), Diagnostic> {
        self.closed |= name == "dataFrame" || name == "traceData";
        if name == "dataFrame" { self.flush() } else { Ok(()) }
    }

    fn remember(&mut self, tag: &BytesStart, names: &[&str]) {
        for name in names {
            if let Some(value) = attribute(tag, name) {
                self.metadata.insert((*name).to_owned(), value);
            }
        }
    }

    fn frame_header(&mut self, tag: &BytesStart) -> Result<(), Diagnostic> {
        self.closed = false;
        if self.frame.number == 0 {
            self.remember(tag, &["startTime", "dropOuts", "stopInc"]);
        }
        let start_s = attribute(tag, "startTime").as_deref().and_then(instant_s);
        let drop_outs = attribute(tag, "dropOuts").and_then(|text| text.parse().ok()).unwrap_or(0_u64);
        self.frame.drop_outs += drop_outs;
        let gap = self.frame.begin(start_s, self.period_s());
        if let Some(message) = gap.message {
            self.naming.notes.push(Diagnostic::warning("T0013", message));
        }
        if let (Some(gap_s), true) = (gap.at_s, self.begun) {
            self.flush()?;
            let nothing: Vec<(usize, f64)> = (0..self.heads.len()).map(|column| (column, f64::NAN)).collect();
            if gap_s > self.floor_s {
                self.sink.row(gap_s, &nothing)?;
                self.floor_s = gap_s;
            }
            self.pending_s = None;
        }
        Ok(())
    }

    /// The shortest sampling period.
    fn period_s(&self) -> f64 {
        let periods = self.heads.iter().filter_map(|head| head.head.period_s);
        periods.min_by(f64::total_cmp).unwrap_or(0.002)
    }

    fn declare(&mut self, tag: &BytesStart, at: u64) -> Result<(), Diagnostic> {
        if self.declared.len() >= SIGNALS_MAX {
            let message = format!("{} has more than {SIGNALS_MAX} signals", self.source.part_name(self.part));
            return Err(self.at(Diagnostic::error("T0008", message), at, "one too many"));
        }
        let text = |name: &str| attribute(tag, name).unwrap_or_default();
        let number = |name: &str| attribute(tag, name).and_then(|text| text.trim().parse::<f64>().ok());
        let declared = Declared {
            id: text("id"),
            name: text("name"),
            servo: text("event") == SERVO_EVENT,
            interval_s: number("interval").filter(|interval| *interval > 0.0 && interval.is_finite()),
            points: number("datapointCount"),
            whole: matches!(text("dataType").as_str(), "uword" | "dword" | "word" | "ubyte" | "byte" | "bool"),
            description: text("description"),
        };
        if declared.id.is_empty() || declared.name.is_empty() {
            let finding = Diagnostic::warning("T0008", "a signal without id or name is left out");
            let finding = self.at(finding, at, "expected id=\"f1\" and name=\"...\"");
            self.naming.notes.push(finding);
            return Ok(());
        }
        if self.begun {
            // Another frame: the same signals, perhaps with other ids.
            match self.heads.iter().position(|head| head.head.original == declared.name) {
                Some(column) => self.connect(&declared.id, column),
                None => self.faults.count("T0008", "a signal that the first frame does not have is left out", at),
            }
            return Ok(());
        }
        self.declared.push(declared);
        Ok(())
    }

    fn connect(&mut self, id: &str, column: usize) {
        match id_number(id) {
            Some(number) => {
                if self.by_number.len() <= number {
                    self.by_number.resize(number + 1, None);
                }
                self.by_number[number] = Some(column);
            }
            None => {
                self.by_id.insert(id.to_owned(), column);
            }
        }
    }

    fn begin(&mut self) -> Result<(), Diagnostic> {
        self.begun = true;
        if self.may_survey {
            self.survey();
        }
        for declared in std::mem::take(&mut self.declared) {
            let named = operate_name(&declared.name);
            let mut head = self.naming.head(&declared.name, &named, declared.interval_s);
            head.head.clock = if declared.servo { Clock::Servo } else { Clock::Interpolator };
            head.head.layout = if declared.servo { Layout::Held } else { Layout::Own };
            head.head.discrete = declared.whole;
            if head.head.meaning.remark.is_empty() {
                head.head.meaning.remark = declared.description.clone();
            }
            self.connect(&declared.id, self.heads.len());
            self.frame.points.push(declared.points);
            self.heads.push(head);
        }
        self.naming.settle(&mut self.heads);
        self.stamp = vec![u64::MAX; self.heads.len()];
        self.frame.counts = vec![0; self.heads.len()];
        let heads: Vec<_> = self.heads.iter().map(|head| head.head.clone()).collect();
        self.sink.begin(&heads)
    }

    /// Finds out whether axes that nobody named are linear or rotary: the control writes mm/min or rev/min.
    fn survey(&mut self) {
        let numbers = self.declared.iter().map(|declared| operate_name(&declared.name).axis);
        let open = numbers.filter_map(|mark| match mark {
            super::naming::AxisMark::Number(number) if self.naming.is_open(number) => Some(number),
            _ => None,
        });
        let open: std::collections::BTreeSet<u32> = open.collect();
        if open.is_empty() {
            return;
        }
        let mut survey = Survey { memory: Memory::new(&[]), rows: 0 };
        let silent = ImportOptions { progress: super::source::Progress(None), ..self.options.clone() };
        // What is wrong with the file is found, and said, by the reading that follows.
        let _ = Session::new(self.source, self.part, &silent, &mut survey, false).read();
        let (signals, _) = survey.memory.finish();
        for number in open {
            let Some((axis, _)) = self.naming.axis(&super::naming::AxisMark::Number(number)) else { continue };
            if let Some(kind) = super::operate_frame::kind_by_signals(&signals, &axis) {
                self.naming.guessed.insert(number, kind);
            }
        }
    }

    fn record(&mut self, tag: &BytesStart, at: u64) -> Result<(), Diagnostic> {
        if !self.begun {
            self.begin()?;
        }
        let mut time_s = None;
        let first = self.pending.len();
        for attribute in tag.attributes().with_checks(false) {
            let Ok(attribute) = attribute else {
                self.faults.count("T0004", "a record has an attribute that cannot be read", at);
                continue;
            };
            let key = attribute.key.as_ref();
            if key == "time" {
                time_s = attribute.value.trim().parse::<f64>().ok().filter(|time| time.abs() < TIME_MAX_S);
                continue;
            }
            let column = match id_number(key) {
                Some(number) => self.by_number.get(number).copied().flatten(),
                None => self.by_id.get(key).copied(),
            };
            match column {
                Some(column) => {
                    let value = self.value(&attribute.value, column, at);
                    self.pending.push((column, value));
                }
                None => self.faults.count("T0008", "a record has a value of a signal that is not in the list", at),
            }
        }
        let Some(time_s) = time_s else {
            self.pending.truncate(first);
            self.faults.count("T0009", "a record has no time and is left out", at);
            return Ok(());
        };
        self.place_record(self.frame.offset_s + time_s, first, at)
    }

    /// Puts the cells from `first` on into the row of their instant.
    fn place_record(&mut self, time_s: f64, first: usize, at: u64) -> Result<(), Diagnostic> {
        match self.pending_s {
            Some(pending_s) if (time_s - pending_s).abs() <= SAME_INSTANT_S => {
                if first > 0 {
                    self.faults.count("T0009", "two records have one time and are joined", at);
                }
                // The first value of a signal counts; a million records of one instant must not pile up.
                if self.pending.len() > 2 * self.heads.len() {
                    self.pending.sort_by_key(|cell| cell.0);
                    self.pending.dedup_by_key(|cell| cell.0);
                }
                return Ok(());
            }
            _ if time_s <= self.floor_s || self.pending_s.is_some_and(|pending_s| time_s < pending_s) => {
                self.pending.truncate(first);
                self.faults.count("T0009", EARLIER, at);
                return Ok(());
            }
            _ => {}
        }
        let next: Vec<(usize, f64)> = self.pending.drain(first..).collect();
        self.flush()?;
        self.pending.extend(next);
        self.pending_s = Some(time_s);
        Ok(())
    }

    fn value(&mut self, text: &str, column: usize, at: u64) -> f64 {
        let factor = self.heads[column].factor;
        if let Ok(value) = text.parse::<f64>() {
            if !value.is_finite() {
                self.faults.count("T0010", "a value is no finite number: a gap", at);
                return f64::NAN;
            }
            return if factor == 1.0 { value } else { value * factor };
        }
        match text.trim().replace(',', ".").parse::<f64>() {
            Ok(value) if value.is_finite() => {
                self.faults.count("T0010", "a value has a decimal comma or blanks, and is taken", at);
                value * factor
            }
            _ => {
                self.faults.count("T0010", "a value is no number: a gap", at);
                f64::NAN
            }
        }
    }

    /// Hands the pending row on.
    fn flush(&mut self) -> Result<(), Diagnostic> {
        let Some(time_s) = self.pending_s.take() else { return Ok(()) };
        if !self.pending.is_empty() {
            self.frame.row(time_s);
            let (stamp, counts, row) = (&mut self.stamp, &mut self.frame.counts, self.rows);
            self.pending.retain(|(column, _)| {
                let fresh = stamp[*column] != row;
                stamp[*column] = row;
                counts[*column] += u64::from(fresh);
                fresh
            });
            self.sink.row(time_s, &self.pending)?;
            self.floor_s = time_s;
            self.rows += 1;
        }
        self.pending.clear();
        Ok(())
    }

    fn finish(mut self, encoding: Option<String>) -> Result<About, Diagnostic> {
        self.flush()?;
        if self.rows == 0 {
            let message = format!("{} has no records", self.source.part_name(self.part));
            return Err(Diagnostic::error("T0003", message).help("was the trace started before it was exported?"));
        }
        let (earlier, at) = self.faults.of("T0009", EARLIER);
        if let Some(finding) = against_time(earlier, self.rows, self.source.part_name(self.part)) {
            return Err(match self.source.place(self.part, at, "the first one") {
                Some(place) => finding.at(place),
                None => finding,
            });
        }
        let mut notes = std::mem::take(&mut self.naming.notes);
        if let Some(remark) = encoding {
            notes.push(Diagnostic::note("T0014", format!("{}: {remark}", self.source.part_name(self.part))));
        }
        if !self.closed {
            let message = format!(
                "{} is cut off: its {} records up to {:.3} s are taken",
                self.source.part_name(self.part),
                self.rows,
                self.frame.last_s.unwrap_or(0.0)
            );
            notes.push(Diagnostic::warning("T0007", message).help("export the trace again if you need the rest"));
        }
        let names: Vec<(&str, bool, Option<f64>)> = self
            .heads
            .iter()
            .map(|head| (head.head.original.as_str(), head.head.layout == Layout::Held, head.head.period_s))
            .collect();
        notes.extend(self.frame.findings(&names, self.closed));
        let at = |code: &'static str, message: String, byte: u64| {
            let finding = Diagnostic::warning(code, message);
            match self.source.place(self.part, byte, "the first one") {
                Some(place) => finding.at(place),
                None => finding,
            }
        };
        notes.extend(self.faults.findings(at));
        let start_utc = self.metadata.get("startTime").cloned();
        let description = format!("{}, version {}", TraceFormat::OperateXml.title(), self.version);
        Ok(About {
            origin: Origin { format: TraceFormat::OperateXml, description, start_utc },
            metadata: BTreeMap::from([("operate".to_owned(), self.metadata)]),
            notes,
        })
    }
}

/// `f7` -> 7.
fn id_number(id: &str) -> Option<usize> {
    let digits = id.strip_prefix('f')?;
    if digits.is_empty() || digits.len() > 5 || digits.starts_with('0') {
        return None;
    }
    digits.bytes().try_fold(0, |number, byte| byte.is_ascii_digit().then(|| number * 10 + usize::from(byte - b'0')))
}

/// An attribute with the five predefined entities resolved; others stay as they are written.
fn attribute(tag: &BytesStart, name: &str) -> Option<String> {
    let found = tag.attributes().with_checks(false).flatten().find(|attribute| attribute.key.as_ref() == name)?;
    let value = quick_xml::escape::unescape(&found.value).map(|text| text.into_owned());
    Some(value.unwrap_or_else(|_| found.value.to_string()))
}

/// Takes the first rows, then stops.
struct Survey {
    memory: Memory,
    rows: usize,
}

impl Sink for Survey {
    fn begin(&mut self, heads: &[super::sink::Head]) -> Result<(), Diagnostic> {
        self.memory.begin(heads)
    }

    fn word(&mut self, signal: usize, word: &str) {
        self.memory.word(signal, word);
    }

    fn row(&mut self, time_s: f64, cells: &[(usize, f64)]) -> Result<(), Diagnostic> {
        self.rows += 1;
        if self.rows > SURVEY_ROWS {
            return Err(Diagnostic::note("T0012", "enough is read"));
        }
        self.memory.row(time_s, cells)
    }

    fn event(&mut self, _: super::wire::TraceEvent) -> Result<(), Diagnostic> {
        Ok(())
    }
}
