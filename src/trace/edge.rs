//! SINUMERIK Edge / Data Recorder JSON -> rows and events.
//!
//! In: Header, Payload, Footer, in one file or in a chain of files (a folder, a zip). Out: one row a position cycle for a [`Sink`], the
//! block starts and calls as events, `path.line`, and the values of LFData, each held until the next. Names of axes are those of the header where
//! the user gave none. Time is the counter of position cycles times its period (`CycleTimeMs`, or as the time stamps say); a cycle that is
//! missing is a gap. Streams: memory holds one row, one event and what of LFData waits for its row. A low-frequency value whose row has passed
//! comes with the next one, and how late is said. External data are passed over.

use super::columns::taken_apart;
use super::edge_low::LowSignals;
use super::edge_payload::{Element, Payload, period_by_stamps, text_addresses};
use super::faults::{Faults, against_time};
use super::import::{About, ImportOptions};
use super::instants::shifted;
use super::naming::{NamedHead, Naming};
use super::sink::{Head, Layout, Sink};
use super::source::{Source, unreadable};
use super::time_column::NOT_LATER;
use super::wire::{Clock, Origin, TraceEvent, TraceFormat};
use crate::base::Diagnostic;
use crate::base::units::{MS_PER_S, NS_PER_S};
use crate::recorder::schema::proto::sollwert::Event;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Counters wrap here.
const COUNTER_WRAP: i64 = 1 << 31;
/// Column of the counter.
const CYCLE: &str = "CYCLE";
/// The usual position cycle.
const USUAL_PERIOD_S: f64 = 0.002;
/// Columns of a file.
const SIGNALS_MAX: usize = 10_000;

/// Reads a chain of files into a sink.
pub(super) fn read_edge(source: &Source, options: &ImportOptions, sink: &mut dyn Sink) -> Result<About, Diagnostic> {
    let mut recorder = Recorder {
        source,
        naming: Naming::new(TraceFormat::EdgeJson, options),
        sink,
        columns: Vec::new(),
        names: Vec::new(),
        line_column: 0,
        line: f64::NAN,
        low: LowSignals::default(),
        cycle_column: None,
        period_s: USUAL_PERIOD_S,
        first: None,
        unwrapped: 0,
        initial: None,
        last: None,
        stride: None,
        last_event: None,
        rows: 0,
        part: 0,
        faults: Faults::default(),
        metadata: BTreeMap::new(),
        cells: Vec::new(),
    };
    for part in 0..source.part_count() {
        recorder.part = part;
        recorder.read_part(part)?;
    }
    recorder.finish()
}

struct Recorder<'s> {
    source: &'s Source<'s>,
    naming: Naming<'s>,
    sink: &'s mut dyn Sink,
    /// Per column of the rows: signal and factor; `None` for the counter.
    columns: Vec<Option<(usize, f64)>>,
    names: Vec<String>,
    line_column: usize,
    line: f64,
    low: LowSignals,
    cycle_column: Option<usize>,
    period_s: f64,
    /// Counter of the first row, and what is to be added to counters since they wrapped.
    first: Option<i64>,
    unwrapped: i64,
    /// Counter at the start that the header tells.
    initial: Option<i64>,
    /// Counter of the last row.
    last: Option<i64>,
    /// Cycles from row to row.
    stride: Option<i64>,
    last_event: Option<(i64, Option<u32>)>,
    rows: u64,
    part: usize,
    faults: Faults,
    metadata: BTreeMap<String, String>,
    cells: Vec<(usize, f64)>,
}

impl Recorder<'_> {
    fn read_part(&mut self, part: usize) -> Result<(), Diagnostic> {
        let shown = self.source.part_name(part).clone();
        let reader = self.source.read(part)?;
        // Items of JSON have no length of their own: the reader's limit is for lines.
        let mut payload = Payload::new(reader.unlimited());
        loop {
            let element = payload.next().map_err(|fault| self.fault(part, &shown, &fault))?;
            match element {
                Some(Element::Header(header)) => self.header(part, &header)?,
                Some(Element::Row(row)) => self.row(&row)?,
                Some(Element::Block(block)) => self.block(&block)?,
                Some(Element::Call(call)) => self.call(&call)?,
                Some(Element::Low(values)) => self.low.take(&values, &mut self.faults, self.sink),
                Some(Element::Other(sort)) => {
                    if sort != "HFTimestamp" {
                        self.faults.count("T0008", "external data are passed over", 0);
                    }
                }
                None => break,
            }
        }
        if !payload.complete() {
            let message = format!("{shown} is cut off: its {} rows are taken", self.rows);
            let finding = Diagnostic::warning("T0007", message);
            self.naming.notes.push(finding.help("export the trace again if you need the rest"));
        }
        Ok(())
    }

    fn fault(&self, part: usize, shown: &str, fault: &super::edge_payload::Fault) -> Diagnostic {
        if let Some(error) = &fault.io {
            return unreadable(shown, error);
        }
        let message = format!("{shown} is not what a data recorder writes: {}", fault.reason);
        let finding = Diagnostic::error("T0004", message).help("expected Header, Payload and Footer; export it again");
        match self.source.place(part, fault.byte, "here") {
            Some(place) => finding.at(place),
            None => finding,
        }
    }

    fn header(&mut self, part: usize, header: &Value) -> Result<(), Diagnostic> {
        let names = signal_names(header);
        if !self.names.is_empty() {
            if names != self.names {
                let message = format!("{} has other signals than the first file", self.source.part_name(part));
                return Err(Diagnostic::error("T0008", message).help("read files of one job together"));
            }
            return Ok(());
        }
        if names.is_empty() || names.len() > SIGNALS_MAX {
            let message = format!("{} lists {} signals", self.source.part_name(part), names.len());
            return Err(Diagnostic::error("T0008", message).help("`SignalListHFData` should name the columns"));
        }
        self.remember(header);
        let given_ms = header.get("CycleTimeMs").and_then(Value::as_f64).filter(|ms| *ms > 0.0 && ms.is_finite());
        self.period_s = match given_ms {
            Some(period_ms) => period_ms / MS_PER_S,
            None => self.guess_period(part)?,
        };
        self.name_axes(header);
        let mut heads: Vec<NamedHead> = Vec::new();
        for name in &names {
            if name == CYCLE {
                self.cycle_column = Some(self.columns.len());
                self.columns.push(None);
                continue;
            }
            let (_, parts) = taken_apart(name);
            let mut head = self.naming.head(name, &parts, Some(self.period_s));
            head.head.clock = Clock::Servo;
            self.columns.push(Some((heads.len(), head.factor)));
            heads.push(head);
        }
        self.naming.settle(&mut heads);
        self.names = names;
        let mut heads: Vec<Head> = heads.into_iter().map(|named| named.head).collect();
        self.line_column = heads.len();
        heads.push(Head {
            name: Some("path.line".to_owned()),
            original: "HFBlockEvent.SeekOffset".to_owned(),
            discrete: true,
            layout: Layout::Dense,
            ..Head::default()
        });
        let low = header.get("SignalListLFData").and_then(Value::as_array).map_or(0, Vec::len);
        let texts = if low > 0 { text_addresses(self.source.read(part)?.unlimited(), low) } else { BTreeSet::new() };
        let low = self.low.begin(header, heads.len(), &texts, &mut self.naming);
        heads.extend(low);
        self.sink.begin(&heads)
    }

    /// The header tells names of axes: they hold where the user gives none.
    fn name_axes(&mut self, header: &Value) {
        let names = axis_names(header);
        let said: Vec<String> =
            names.iter().map(|(number, (said, name))| format!("{number} = {name} ({said})")).collect();
        self.naming.of_file = names.into_iter().map(|(number, (_, name))| (number, name)).collect();
        if !said.is_empty() {
            let message = format!("names of axes by the header of the file: {}", said.join(", "));
            self.naming.notes.push(Diagnostic::note("T0011", message).help("--axis-name 1=X gives others"));
        }
    }

    fn remember(&mut self, header: &Value) {
        let machine = header.get("MachineInfo");
        for key in ["MachineName", "CFCard"] {
            if let Some(value) = machine.and_then(|machine| machine.get(key)).and_then(Value::as_str) {
                self.metadata.insert(key.to_owned(), value.to_owned());
            }
        }
        let initial = header.get("Initial");
        if let Some(time) = initial.and_then(|initial| initial.get("Time")).and_then(Value::as_str) {
            self.metadata.insert("start".to_owned(), time.to_owned());
        }
        self.initial = initial.and_then(counter);
    }

    fn guess_period(&mut self, part: usize) -> Result<f64, Diagnostic> {
        let found = period_by_stamps(self.source.read(part)?.unlimited());
        let how = if found.is_some() { "by its time stamps" } else { "the usual one, for want of time stamps" };
        let period_s = found.unwrap_or(USUAL_PERIOD_S);
        let message =
            format!("the header has no CycleTimeMs: a position cycle is taken as {} ms, {how}", period_s * MS_PER_S);
        self.naming.notes.push(Diagnostic::note("T0012", message));
        Ok(period_s)
    }

    /// Counter since the first row, over all wraps.
    fn count(&mut self, counter: i64) -> i64 {
        let mut whole = counter + self.unwrapped;
        if let Some(last) = self.last
            && last - whole > COUNTER_WRAP / 2
        {
            self.unwrapped += COUNTER_WRAP;
            whole += COUNTER_WRAP;
        }
        whole - *self.first.get_or_insert(whole)
    }

    fn time_s(&self, count: i64) -> f64 {
        let period_ns = self.period_s * NS_PER_S;
        let whole = period_ns.round();
        let period_ns = if (whole - period_ns).abs() < 1e-3 { whole } else { period_ns };
        count as f64 * period_ns / NS_PER_S
    }

    fn row(&mut self, row: &[f64]) -> Result<(), Diagnostic> {
        if self.columns.is_empty() {
            return Err(Diagnostic::error("T0008", "rows come before the header that names their columns")
                .help("the header must be the first thing in the file"));
        }
        if row.len() != self.columns.len() {
            self.faults.count("T0008", "a row has not as many values as the header names", 0);
        }
        let counter = self.cycle_column.map(|column| row.get(column).copied().unwrap_or(f64::NAN));
        let count = match counter {
            Some(counter) if (0.0..COUNTER_WRAP as f64).contains(&counter) => self.count(counter as i64),
            Some(_) => {
                self.faults.count("T0009", "a row has no counter and is left out", 0);
                return Ok(());
            }
            None => self.last.map_or(0, |last| last + 1 - self.first.unwrap_or(0)),
        };
        let first = *self.first.get_or_insert(0);
        if let Some(last) = self.last.map(|last| last - first) {
            if count <= last {
                self.faults.count("T0009", NOT_LATER, 0);
                return Ok(());
            }
            let stride = *self.stride.get_or_insert(count - last);
            if count - last > stride + stride / 2 {
                self.faults.count("T0013", "position cycles are missing: a gap", 0);
                let gap: Vec<(usize, f64)> = (0..self.line_column).map(|signal| (signal, f64::NAN)).collect();
                self.sink.row(self.time_s(last + stride), &gap)?;
            }
        }
        self.last = Some(count + first);
        self.cells.clear();
        for (value, column) in row.iter().zip(&self.columns) {
            if let Some((signal, factor)) = column {
                self.cells.push((*signal, value * factor));
            }
        }
        self.cells.push((self.line_column, self.line));
        let counter = counter.unwrap_or(count as f64);
        self.low.hand_over(counter, &mut self.cells);
        self.rows += 1;
        self.sink.row(self.time_s(count), &self.cells)
    }

    fn block(&mut self, block: &Value) -> Result<(), Diagnostic> {
        let counter = counter(block);
        let line = block.get("SeekOffset").and_then(Value::as_u64).and_then(|line| u32::try_from(line).ok());
        let Some(counter) = counter else { return Ok(()) };
        // The last event of a file stands again at the beginning of the next.
        if self.last_event == Some((counter, line)) {
            return Ok(());
        }
        self.last_event = Some((counter, line));
        self.line = line.map_or(self.line, f64::from);
        let time_s = self.event_s(counter);
        let text = block.get("GCode").and_then(Value::as_str).map(str::to_owned);
        let event = Event { kind: Some("block_start".to_owned()), text, line, ..Event::default() };
        self.sink.event(TraceEvent { time_s, event })
    }

    /// Time of an event; one before the first row belongs to its time.
    fn event_s(&self, counter: i64) -> f64 {
        let count = self.first.map_or(0, |first| counter.saturating_add(self.unwrapped - first));
        self.time_s(count.max(0))
    }

    /// A program was called, or returned to.
    fn call(&mut self, call: &Value) -> Result<(), Diagnostic> {
        let Some(counter) = counter(call) else { return Ok(()) };
        let line = call.get("SeekOffset").and_then(Value::as_u64).and_then(|line| u32::try_from(line).ok());
        let path = call.get("Path").or_else(|| call.get("path")).and_then(Value::as_str).map(str::to_owned);
        let event = Event { kind: Some("call".to_owned()), program: path, line, ..Event::default() };
        let time_s = self.event_s(counter);
        self.sink.event(TraceEvent { time_s, event })
    }

    fn finish(mut self) -> Result<About, Diagnostic> {
        if self.rows == 0 {
            let message = format!("{} has no rows of HFData", self.source.shown);
            return Err(Diagnostic::error("T0003", message));
        }
        let (late, _) = self.faults.of("T0009", NOT_LATER);
        if let Some(finding) = against_time(late, self.rows, &self.source.shown) {
            return Err(finding);
        }
        let mut notes = std::mem::take(&mut self.naming.notes);
        notes.extend(self.faults.findings(|code, message, _| Diagnostic::warning(code, message)));
        notes.extend(self.low.late_by().map(|cycles| {
            let late_ms = cycles as f64 * self.period_s * MS_PER_S;
            Diagnostic::note(
                "T0009",
                format!("values of LFData came up to {late_ms:.0} ms after their time, and stand there"),
            )
        }));
        // The header tells the start of the job; rows begin when the trigger comes.
        let later_s = self.first.zip(self.initial).map_or(0.0, |(first, initial)| self.time_s(first - initial));
        let start_utc = self.metadata.get("start").and_then(|start| shifted(start, later_s).or(Some(start.clone())));
        let format = TraceFormat::EdgeJson;
        Ok(About {
            origin: Origin { format, description: format.title().to_owned(), start_utc },
            metadata: BTreeMap::from([("edge".to_owned(), self.metadata)]),
            notes,
        })
    }
}

fn counter(value: &Value) -> Option<i64> {
    value.get("HFProbeCounter").or_else(|| value.get("HfProbeCounter")).and_then(Value::as_i64)
}

/// Names of the axes by number: as the header has them (`X1`), and as they are called here. A geometry axis is called by its letter alone, as
/// programs do.
fn axis_names(header: &Value) -> BTreeMap<u32, (String, String)> {
    let mut said: BTreeMap<u32, String> = BTreeMap::new();
    for entry in header.get("SignalListHFData").and_then(Value::as_array).into_iter().flatten() {
        let text = |key: &str| entry.get(key).and_then(Value::as_str).map(str::trim).filter(|text| !text.is_empty());
        let number = text("Address").and_then(|address| address.rsplit_once('|')?.1.trim().parse::<u32>().ok());
        if let (Some(number), Some(name)) = (number, text("Axis")) {
            said.entry(number).or_insert_with(|| name.to_owned());
        }
    }
    let sane = |name: &str| {
        name.len() <= 16
            && name.starts_with(|c: char| c.is_ascii_alphabetic())
            && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
    };
    said.retain(|_, name| sane(name));
    let taken: BTreeSet<String> = said.values().cloned().collect();
    let called = |name: &str| {
        let letter = name.strip_suffix('1').filter(|letter| letter.len() == 1 && !taken.contains(*letter));
        letter.unwrap_or(name).to_owned()
    };
    said.iter().map(|(number, name)| (*number, (name.clone(), called(name)))).collect()
}

/// Addresses of the columns: `ENC_POS|1`; the name where there is no address.
fn signal_names(header: &Value) -> Vec<String> {
    let list = header.get("SignalListHFData").and_then(Value::as_array);
    let text = |entry: &Value, key: &str| {
        entry.get(key).and_then(Value::as_str).filter(|text| !text.is_empty()).map(str::to_owned)
    };
    let name = |entry: &Value| text(entry, "Address").or_else(|| text(entry, "Name")).unwrap_or_default();
    list.map_or_else(Vec::new, |list| list.iter().map(name).collect())
}
