//! A recording as a table: CSV.
//!
//! In: a [`Recording`]. Out: one row for each instant at which an axis was recorded (each set-point in a recording without axes);
//! axes with a longer cycle, the path and the spindle are held. Numbers in the shortest form that reads back to the same f64; absent values
//! are empty. Memory holds one chunk and one row. Events and poses stay in the recording. Does not resample.

use super::decode::{AxisSample, TopicKind};
use super::reader::Recording;
use super::schema::proto::sollwert::{Path as PathMessage, Spindle as SpindleMessage};
use super::schema::{AXIS_FIELDS, FLAGS_FIELD, MONITORING_FIELD, PATH_FIELDS, SPINDLE_FIELDS, spindle_values};
use super::target::{Target, WholeFile};
use crate::base::Diagnostic;
use crate::base::units::NS_PER_S;
use prost::Message as _;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// What an export wrote.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExportReport {
    /// Rows below the header.
    pub rows: u64,
    /// Columns.
    pub columns: usize,
    /// Size of the file.
    pub bytes: u64,
}

/// Writes a table to a file, by the ending of its name. The file appears when it is complete.
pub fn export(recording: &Recording, output: &Path) -> Result<ExportReport, Diagnostic> {
    let ending = output.extension().and_then(|ending| ending.to_str()).unwrap_or("").to_ascii_lowercase();
    if ending != "csv" && !output.exists() {
        let message = format!("the format of {} is not known", output.display());
        return Err(Diagnostic::error("R0017", message).help("export to a name that ends in .csv"));
    }
    if super::recover::same_file(recording.path(), output) {
        let message = format!("{} cannot be exported onto itself", output.display());
        return Err(Diagnostic::error("R0015", message).help("give another name with -o"));
    }
    let (file, target) = WholeFile::create(output)?;
    let mut buffered: BufWriter<Target> = BufWriter::with_capacity(256 * 1024, target);
    let counts = write_csv(recording, &mut buffered).map_err(|fault| match fault {
        ExportFault::Recording(diagnostic) => diagnostic,
        ExportFault::Output(error) => file.fault(&error),
    })?;
    let target = buffered.into_inner().map_err(|error| file.fault(error.error()))?;
    Ok(ExportReport { bytes: file.commit(target)?, ..counts })
}

/// Writes a table to any writer.
pub fn export_csv(recording: &Recording, output: &mut impl Write) -> Result<ExportReport, Diagnostic> {
    write_csv(recording, output).map_err(|fault| match fault {
        ExportFault::Recording(diagnostic) => diagnostic,
        ExportFault::Output(error) => Diagnostic::error("R0004", format!("the export cannot be written: {error}")),
    })
}

enum ExportFault {
    Recording(Diagnostic),
    Output(io::Error),
}

impl From<Diagnostic> for ExportFault {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::Recording(diagnostic)
    }
}

impl From<io::Error> for ExportFault {
    fn from(error: io::Error) -> Self {
        Self::Output(error)
    }
}

fn write_csv(recording: &Recording, output: &mut impl Write) -> Result<ExportReport, ExportFault> {
    let mut table = Table::new(recording)?;
    output.write_all(table.header.as_bytes())?;
    let mut messages = recording.messages()?;
    while let Some((topic, kind, raw)) = messages.next_raw()? {
        let time_ns = raw.log_time_ns;
        if table.time_ns.is_some_and(|now| time_ns < now) {
            return Err(messages.refuse_message("it is earlier than the one before").into());
        }
        if table.time_ns != Some(time_ns) {
            table.end_row(output)?;
            table.time_ns = Some(time_ns);
        }
        if let Err(error) = table.take(topic, kind, raw.data) {
            return Err(messages.refuse_message(&error.to_string()).into());
        }
    }
    table.end_row(output)?;
    Ok(ExportReport { rows: table.rows, columns: table.columns, bytes: table.bytes })
}

/// The columns of one topic: their text is made when a message comes, and held until the next.
struct Cells {
    topic: usize,
    fields: Vec<usize>,
    /// Last value of each field of an axis: a field may be recorded less often than others.
    held: Vec<Option<f64>>,
    text: Vec<u8>,
}

/// A row in the making.
struct Table {
    header: String,
    cells: Vec<Cells>,
    /// Messages of these make a row due.
    axes_make_rows: bool,
    /// Instant of the row at work.
    time_ns: Option<u64>,
    due: bool,
    line: Vec<u8>,
    rows: u64,
    columns: usize,
    bytes: u64,
}

impl Table {
    fn new(recording: &Recording) -> Result<Self, Diagnostic> {
        let mut header = String::from("time_s");
        let mut cells = Vec::new();
        let mut columns = 1;
        for (place, topic) in recording.topics().iter().enumerate() {
            match &topic.kind {
                TopicKind::Axis { name, kind } => {
                    for field in &topic.fields {
                        header.push(',');
                        push_text(&mut header, &format!("{name}.{}", AXIS_FIELDS[*field].name(*kind)));
                    }
                    columns += topic.fields.len();
                    cells.push(Cells::empty(place, topic.fields.clone()));
                }
                TopicKind::Spindle if topic.messages > 0 => {
                    for field in &topic.fields {
                        header.push_str(",spindle.");
                        header.push_str(SPINDLE_FIELDS[*field]);
                    }
                    columns += topic.fields.len();
                    cells.push(Cells::empty(place, topic.fields.clone()));
                }
                TopicKind::Path if topic.messages > 0 => {
                    for field in PATH_FIELDS {
                        header.push_str(",path.");
                        header.push_str(field);
                    }
                    columns += PATH_FIELDS.len();
                    cells.push(Cells::empty(place, (0..PATH_FIELDS.len()).collect()));
                }
                _ => {}
            }
        }
        if cells.is_empty() {
            let message = format!("{} holds neither axes nor a path", recording.path().display());
            return Err(Diagnostic::error("R0018", message).help("only recordings of sollwert can be exported"));
        }
        header.push('\n');
        Ok(Self {
            bytes: header.len() as u64,
            header,
            cells,
            axes_make_rows: recording.axes().any(|(_, _, topic)| topic.messages > 0),
            time_ns: None,
            due: false,
            line: Vec::new(),
            rows: 0,
            columns,
        })
    }

    fn take(&mut self, topic: usize, kind: &TopicKind, data: &[u8]) -> Result<(), prost::DecodeError> {
        let Some(cells) = self.cells.iter_mut().find(|cells| cells.topic == topic) else { return Ok(()) };
        match kind {
            TopicKind::Axis { .. } => {
                cells.set_axis(&AxisSample::decode(data)?);
                self.due |= self.axes_make_rows;
            }
            TopicKind::Path => {
                cells.set_path(&PathMessage::decode(data)?);
                self.due |= !self.axes_make_rows;
            }
            TopicKind::Spindle => cells.set_spindle(&SpindleMessage::decode(data)?),
            _ => {}
        }
        Ok(())
    }

    fn end_row(&mut self, output: &mut impl Write) -> io::Result<()> {
        let Some(time_ns) = self.time_ns.filter(|_| self.due) else { return Ok(()) };
        self.line.clear();
        push_number(&mut self.line, time_ns as f64 / NS_PER_S);
        for cells in &self.cells {
            self.line.extend_from_slice(&cells.text);
        }
        self.line.push(b'\n');
        output.write_all(&self.line)?;
        self.bytes += self.line.len() as u64;
        self.rows += 1;
        self.due = false;
        Ok(())
    }
}

impl Cells {
    /// Empty until the first message.
    fn empty(topic: usize, fields: Vec<usize>) -> Self {
        Self { topic, text: vec![b','; fields.len()], held: vec![None; fields.len()], fields }
    }

    fn set_axis(&mut self, sample: &AxisSample) {
        self.text.clear();
        for (&field, held) in self.fields.iter().zip(&mut self.held) {
            self.text.push(b',');
            *held = sample.get(field).or(*held);
            match *held {
                Some(bits) if matches!(field, FLAGS_FIELD | MONITORING_FIELD) => {
                    push_integer(&mut self.text, bits as u64);
                }
                Some(value) => push_number(&mut self.text, value),
                None => {}
            }
        }
    }

    fn set_spindle(&mut self, spindle: &SpindleMessage) {
        self.text.clear();
        let values = spindle_values(spindle);
        for field in &self.fields {
            self.text.push(b',');
            if let Some(value) = values.get(*field).copied().flatten() {
                push_number(&mut self.text, value);
            }
        }
    }

    fn set_path(&mut self, path: &PathMessage) {
        self.text.clear();
        // In the order of `PATH_FIELDS`.
        let cells = [
            Cell::text(&path.program),
            Cell::Integer(path.block),
            Cell::Integer(path.line.map(u64::from)),
            Cell::Number(path.s_mm),
            Cell::Number(path.feed_mm_min),
            Cell::Number(path.programmed_feed_mm_min),
            Cell::Number(path.acceleration_mm_s2),
            Cell::Number(path.jerk_mm_s3),
            Cell::text(&path.limit_axis),
            Cell::text(&path.limit_kind),
            Cell::Integer(path.buffered_blocks.map(u64::from)),
            Cell::Number(path.contour_error_mm),
            Cell::Integer(path.rotary_only.map(u64::from)),
            Cell::Number(path.override_ratio),
        ];
        for cell in cells {
            self.text.push(b',');
            cell.push(&mut self.text);
        }
    }
}

/// One value of the path.
enum Cell<'a> {
    Text(Option<&'a str>),
    Integer(Option<u64>),
    Number(Option<f64>),
}

impl<'a> Cell<'a> {
    fn text(text: &'a Option<String>) -> Self {
        Self::Text(text.as_deref())
    }

    fn push(&self, line: &mut Vec<u8>) {
        match self {
            Self::Text(Some(text)) => {
                let mut quoted = String::new();
                push_text(&mut quoted, text);
                line.extend_from_slice(quoted.as_bytes());
            }
            Self::Integer(Some(value)) => push_integer(line, *value),
            Self::Number(Some(value)) => push_number(line, *value),
            Self::Text(None) | Self::Integer(None) | Self::Number(None) => {}
        }
    }
}

/// The shortest decimal that reads back to the same f64: without `.0`.
pub(crate) fn push_number(line: &mut Vec<u8>, value: f64) {
    let mut buffer = ryu::Buffer::new();
    let text = buffer.format(value);
    line.extend_from_slice(text.strip_suffix(".0").unwrap_or(text).as_bytes());
}

fn push_integer(line: &mut Vec<u8>, value: u64) {
    line.extend_from_slice(value.to_string().as_bytes());
}

/// A text as RFC 4180 has it: in quotation marks where it holds a comma, a quotation mark or a line end.
pub(crate) fn push_text(line: &mut String, text: &str) {
    if !text.contains([',', '"', '\n', '\r']) {
        line.push_str(text);
        return;
    }
    line.push('"');
    line.push_str(&text.replace('"', "\"\""));
    line.push('"');
}
