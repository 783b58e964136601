//! XML of measuring functions and auto servo tuning, with its base-85 arrays -> rows.
//!
//! In: serialised objects: `<float name="...">` and `<NumericArray format="base85"><raw name="m_pNumberArray"><![CDATA[...]]>`; short arrays
//! stand there as numbers with commas (`format="CSV"`). Out: one signal an array, two of a complex one; numbers with names as metadata, one
//! that comes again under the names of the objects around it. From value to value it is `m_TimeVector.end` of the same object over the number
//! of steps, else `m_dProcessUpdateTime`. Values beside an `m_FrequencyVector` of half their number are complex. Frequency responses, poles and
//! zeros have no time: their points are counted, and a note says so. Memory: all arrays, because they stand one behind the other and become
//! columns: at most 20 million values (160 MB), an array of at most 64 MB of text.

use super::faults::TIME_MAX_S;
use super::import::{About, ImportOptions};
use super::sink::{Head, Layout, Sink};
use super::source::Source;
use super::wire::{Meaning, Origin, TraceFormat};
use crate::base::Diagnostic;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::collections::BTreeMap;

/// Characters of the digits, in order. `.` stands for a word of zeros.
const DIGITS: &[u8; 85] = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ!#$`()*+-/:;=?@[]^_{|}~";
const UPDATE_TIME: &str = "m_dProcessUpdateTime";
/// Nesting, arrays, and named numbers of a file.
const DEPTH_MAX: usize = 200;
const ARRAYS_MAX: usize = 1000;
const NUMBERS_MAX: usize = 10_000;
/// Text of one array.
const TEXT_BYTES_MAX: usize = 64 << 20;
/// Values of all arrays.
const VALUES_MAX: usize = 20_000_000;
/// A shorter period is none.
const LEAST_PERIOD_S: f64 = 1e-9;
/// Period where the file gives none: the usual current-controller cycle.
const USUAL_PERIOD_S: f64 = 125e-6;

/// Time of the last value of a time series.
const TIME_END: &str = "m_TimeVector.end";
/// Frequencies of a response.
const FREQUENCIES: &str = "m_FrequencyVector";

/// An array of the file.
struct Array {
    name: String,
    /// Number of the object that it is part of.
    object: usize,
    values: Vec<f64>,
    complex: bool,
    /// From value to value.
    period_s: f64,
}

/// Reads all arrays into a sink.
pub(super) fn read_measuring(
    source: &Source,
    part: usize,
    _: &ImportOptions,
    sink: &mut dyn Sink,
) -> Result<About, Diagnostic> {
    let mut walk = Walk { source, part, ..Walk::new(source) };
    let complete = walk.run()?;
    let mut notes = Vec::new();
    if !complete {
        let message = format!("{} is cut off: its {} arrays are taken", source.part_name(part), walk.arrays.len());
        notes.push(Diagnostic::warning("T0007", message));
    }
    if walk.arrays.iter().all(|array| array.values.is_empty()) {
        let message = format!("{} has no array of numbers", source.part_name(part));
        return Err(Diagnostic::error("T0003", message));
    }
    let given = walk.numbers.get(UPDATE_TIME).and_then(|text| text.parse::<f64>().ok());
    let period_s = given.filter(|period_s| *period_s > 0.0 && period_s.is_finite()).unwrap_or(USUAL_PERIOD_S);
    let assumed = walk.settle(period_s);
    if given.is_none() && assumed {
        let message = format!("neither {UPDATE_TIME} nor {TIME_END} in the file: {period_s} s is assumed");
        notes.push(Diagnostic::warning("T0012", message));
    }
    if walk.arrays.iter().any(|array| array.complex) {
        let message = "complex arrays are frequency responses, poles or zeros: their points are counted, `time_s` means nothing for them";
        notes.push(Diagnostic::note("T0012", message));
    }
    hand_over(&walk.arrays, sink)?;
    let format = TraceFormat::MeasuringXml;
    Ok(About {
        origin: Origin { format, description: format.title().to_owned(), start_utc: None },
        metadata: BTreeMap::from([("measuring".to_owned(), walk.numbers)]),
        notes,
    })
}

/// Arrays as columns, each at its own period: a shorter one ends earlier.
fn hand_over(arrays: &[Array], sink: &mut dyn Sink) -> Result<(), Diagnostic> {
    let mut heads = Vec::new();
    let mut first_columns = Vec::new();
    for array in arrays {
        let parts: &[&str] = if array.complex { &[".re", ".im"] } else { &[""] };
        first_columns.push(heads.len());
        for part in parts {
            let remark = if array.complex { "no time series: its points are counted" } else { "" };
            heads.push(Head {
                original: format!("{}{part}", array.name),
                layout: Layout::Own,
                period_s: Some(array.period_s),
                meaning: Meaning { remark: remark.to_owned(), ..Meaning::default() },
                ..Head::default()
            });
        }
    }
    sink.begin(&heads)?;
    let mut next = vec![0_usize; arrays.len()];
    let mut row = Vec::new();
    loop {
        let due = arrays.iter().zip(&next).filter(|(array, k)| **k < array.points());
        let Some(now_s) = due.map(|(array, k)| array.time_s(*k)).min_by(f64::total_cmp) else { return Ok(()) };
        row.clear();
        for ((array, k), first) in arrays.iter().zip(&mut next).zip(&first_columns) {
            if *k < array.points() && array.time_s(*k) == now_s {
                let width = array.width();
                row.extend((0..width).map(|part| (first + part, array.values[*k * width + part])));
                *k += 1;
            }
        }
        sink.row(now_s, &row)?;
    }
}

impl Array {
    fn width(&self) -> usize {
        if self.complex { 2 } else { 1 }
    }

    fn points(&self) -> usize {
        self.values.len() / self.width()
    }

    fn time_s(&self, k: usize) -> f64 {
        k as f64 * self.period_s
    }
}

struct Walk<'a> {
    source: &'a Source<'a>,
    part: usize,
    /// The open elements.
    path: Vec<Element>,
    /// Elements so far.
    elements: usize,
    arrays: Vec<Array>,
    numbers: BTreeMap<String, String>,
    /// Ends of time series, by the number of their object.
    ends_s: BTreeMap<usize, f64>,
    values: usize,
}

/// An open element.
struct Element {
    number: usize,
    tag: String,
    name: String,
    /// It says that its numbers are complex.
    complex: bool,
    /// How it says that its numbers are written.
    format: String,
    /// What stands in it, as text or as CDATA, and where that begins.
    text: String,
    text_at: u64,
}

impl<'a> Walk<'a> {
    fn new(source: &'a Source<'a>) -> Self {
        Self {
            source,
            part: 0,
            path: Vec::new(),
            elements: 0,
            arrays: Vec::new(),
            numbers: BTreeMap::new(),
            ends_s: BTreeMap::new(),
            values: 0,
        }
    }

    /// Periods of all arrays, and which values are pairs. Whether the usual period had to be taken for any.
    fn settle(&mut self, usual_s: f64) -> bool {
        let frequencies = |array: &Array| array.name.ends_with(FREQUENCIES);
        let responses: BTreeMap<usize, usize> =
            self.arrays.iter().filter(|array| frequencies(array)).map(|array| (array.object, array.points())).collect();
        let mut assumed = false;
        for array in &mut self.arrays {
            let of_response = responses.get(&array.object);
            array.complex |= of_response.is_some_and(|points| *points > 0 && array.values.len() == 2 * points);
            let steps = array.points().saturating_sub(1);
            let end_s = self
                .ends_s
                .get(&array.object)
                .filter(|end_s| steps > 0 && **end_s < TIME_MAX_S && **end_s > LEAST_PERIOD_S * steps as f64);
            assumed |= end_s.is_none() && of_response.is_none();
            array.period_s = end_s.map_or(usual_s, |end_s| end_s / steps as f64);
        }
        assumed
    }

    /// Whether the file ends in good order.
    fn run(&mut self) -> Result<bool, Diagnostic> {
        // The text of an array is one item: megabytes are usual.
        let mut reader = Reader::from_reader(self.source.read(self.part)?.with_item_limit(TEXT_BYTES_MAX as u64));
        reader.config_mut().check_end_names = false;
        reader.config_mut().allow_unmatched_ends = true;
        let mut buffer = Vec::new();
        loop {
            buffer.clear();
            reader.get_mut().begin_item();
            let at = reader.buffer_position();
            match reader.read_event_into(&mut buffer) {
                Ok(Event::Start(tag)) => self.open(&tag, at)?,
                Ok(Event::End(_)) => {
                    self.close()?;
                    self.path.pop();
                }
                Ok(Event::Text(text)) => self.text(&text.into_inner(), at)?,
                Ok(Event::CData(text)) => self.text(&text.into_inner(), at)?,
                Ok(Event::DocType(_)) => {
                    let message = "a trace has no document type, and entities are not expanded";
                    return Err(self.at(Diagnostic::error("T0006", message), at));
                }
                Ok(Event::Eof) => return Ok(self.path.is_empty()),
                Ok(_) => {}
                Err(quick_xml::Error::Io(error)) => {
                    return Err(self.source.unreadable_at(self.part, at, &error));
                }
                Err(_) if !self.arrays.is_empty() => return Ok(false),
                Err(error) => {
                    let message = format!("{} is not well-formed XML: {error}", self.source.part_name(self.part));
                    return Err(self.at(Diagnostic::error("T0004", message), at));
                }
            }
        }
    }

    fn at(&self, finding: Diagnostic, byte: u64) -> Diagnostic {
        match self.source.place(self.part, byte, "here") {
            Some(place) => finding.at(place),
            None => finding,
        }
    }

    fn open(&mut self, tag: &BytesStart, at: u64) -> Result<(), Diagnostic> {
        if self.path.len() >= DEPTH_MAX {
            let message = format!("objects are nested more than {DEPTH_MAX} deep");
            return Err(self.at(Diagnostic::error("T0004", message), at));
        }
        let attribute = |wanted: &str| {
            let found =
                tag.attributes().with_checks(false).flatten().find(|attribute| attribute.key.as_ref() == wanted);
            found.map(|attribute| attribute.value.to_string()).unwrap_or_default()
        };
        let complex = attribute("elementtype").to_lowercase().contains("complex");
        self.elements += 1;
        self.path.push(Element {
            number: self.elements,
            tag: tag.name().as_ref().to_owned(),
            name: attribute("name"),
            complex,
            format: attribute("format"),
            text: String::new(),
            text_at: at,
        });
        Ok(())
    }

    /// Text may come in pieces: blanks around CDATA, several sections of it.
    fn text(&mut self, text: &str, at: u64) -> Result<(), Diagnostic> {
        let text = text.trim();
        let Some(element) = self.path.last_mut().filter(|_| !text.is_empty()) else { return Ok(()) };
        if element.text.is_empty() {
            element.text_at = at;
        }
        if element.text.len() + text.len() > TEXT_BYTES_MAX {
            let message = format!("the text of an array has more than {TEXT_BYTES_MAX} bytes");
            return Err(self.at(Diagnostic::error("T0005", message), at));
        }
        element.text.push_str(text);
        Ok(())
    }

    /// The innermost element ends: what stood in it is a number or an array.
    fn close(&mut self) -> Result<(), Diagnostic> {
        let Some(element) = self.path.last_mut() else { return Ok(()) };
        let (text, at) = (std::mem::take(&mut element.text), element.text_at);
        let (tag, name) = (element.tag.clone(), element.name.clone());
        if text.is_empty() {
            return Ok(());
        }
        if tag == "raw" {
            return self.array(&text, at);
        }
        if name == TIME_END && self.ends_s.len() < NUMBERS_MAX {
            let (object, end_s) = (self.around(1), text.parse().ok().filter(|end_s: &f64| end_s.is_finite()));
            self.ends_s.extend(end_s.map(|end_s| (object, end_s)));
        }
        if !name.is_empty() && text.len() < 200 && self.numbers.len() < NUMBERS_MAX {
            let first = !self.numbers.contains_key(&name);
            let key = if first { name } else { self.dotted() };
            self.numbers.entry(key).or_insert(text);
        }
        Ok(())
    }

    /// Number of the object so many levels around the innermost element.
    fn around(&self, levels: usize) -> usize {
        self.path.iter().rev().nth(levels).map_or(0, |element| element.number)
    }

    /// Names of the open elements.
    fn dotted(&self) -> String {
        let names = self.path.iter().map(|element| element.name.as_str());
        let names: Vec<&str> = names.filter(|name| !name.is_empty() && *name != "m_pNumberArray").collect();
        if names.is_empty() { "array".to_owned() } else { names.join(".") }
    }

    fn array(&mut self, text: &str, at: u64) -> Result<(), Diagnostic> {
        let format = self.path.iter().rev().map(|element| element.format.as_str()).find(|format| !format.is_empty());
        let values = match format {
            Some(format) if format.eq_ignore_ascii_case("csv") => commas(text),
            _ => base85(text),
        };
        let values = values.ok_or_else(|| {
            let format = format.unwrap_or("base85");
            let message = format!("an array is not written as it says (`{format}`)");
            let help = "known are the base-85 digits of the control (`base85`) and numbers with commas (`CSV`)";
            self.at(Diagnostic::error("T0004", message).help(help), at)
        })?;
        self.values += values.len();
        if self.arrays.len() >= ARRAYS_MAX || self.values > VALUES_MAX {
            let message = format!("more than {ARRAYS_MAX} arrays or {VALUES_MAX} values");
            return Err(self.at(Diagnostic::error("T0017", message), at));
        }
        // The object around the array around the raw text.
        let object = self.around(2);
        let complex = self.path.iter().any(|element| element.complex);
        let mut name = self.dotted();
        if self.arrays.iter().any(|array| array.name == name) {
            name = format!("{name} ({})", self.arrays.len() + 1);
        }
        self.arrays.push(Array { name, object, values, complex, period_s: USUAL_PERIOD_S });
        Ok(())
    }
}

/// Numbers with commas between them.
fn commas(text: &str) -> Option<Vec<f64>> {
    let filled = text.split(',').map(str::trim).filter(|word| !word.is_empty());
    filled.map(|word| word.parse().ok()).collect()
}

/// Groups of five digits are words of four bytes, `.` is a word of zeros, two words are a big-endian double.
fn base85(text: &str) -> Option<Vec<f64>> {
    let mut values = Vec::with_capacity(text.len() / 10);
    let (mut word, mut digits, mut upper) = (0_u64, 0, None);
    for byte in text.bytes().filter(|byte| !byte.is_ascii_whitespace()) {
        if byte == b'.' && digits == 0 {
            digits = 5;
        } else {
            word = word * 85 + DIGITS.iter().position(|digit| *digit == byte)? as u64;
            digits += 1;
        }
        if digits < 5 {
            continue;
        }
        let whole = u32::try_from(word).ok()?;
        match upper.take() {
            None => upper = Some(whole),
            Some(upper) => values.push(f64::from_bits(u64::from(upper) << 32 | u64::from(whole))),
        }
        (word, digits) = (0, 0);
    }
    (digits == 0 && upper.is_none()).then_some(values)
}
