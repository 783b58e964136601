//! XML of measuring functions and auto servo tuning, with its base-85 arrays -> rows.
//!
//! In: serialised objects: `<float name="...">` and `<NumericArray format="base85"><raw name="m_pNumberArray">`. Out: one signal an array, two
//! of a complex one, at `m_dProcessUpdateTime` from value to value; numbers with names as metadata. Frequency responses have no time:
//! their points are counted, and a note says so. Memory: all arrays, because they stand one behind the other and become columns: at most
//! 20 million values (160 MB), an array of at most 64 MB of text.

use super::import::{About, ImportOptions};
use super::sink::{Head, Layout, Sink};
use super::source::{Source, unreadable};
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
/// Values of all arrays.
const VALUES_MAX: usize = 20_000_000;
/// Period where the file gives none: the usual current-controller cycle.
const USUAL_PERIOD_S: f64 = 125e-6;

/// An array of the file.
struct Array {
    name: String,
    values: Vec<f64>,
    complex: bool,
}

/// Reads all arrays into a sink.
pub(super) fn read_measuring(
    source: &Source,
    part: usize,
    _: &ImportOptions,
    sink: &mut dyn Sink,
) -> Result<About, Diagnostic> {
    let mut walk = Walk { source, part, path: Vec::new(), arrays: Vec::new(), numbers: BTreeMap::new(), values: 0 };
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
    if given.is_none() {
        let message = format!("no {UPDATE_TIME} in the file: {period_s} s is assumed");
        notes.push(Diagnostic::warning("T0012", message));
    }
    if walk.arrays.iter().any(|array| array.complex) {
        let message =
            "complex arrays are frequency responses: their points are counted, `time_s` means nothing for them";
        notes.push(Diagnostic::note("T0012", message));
    }
    hand_over(&walk.arrays, period_s, sink)?;
    let format = TraceFormat::MeasuringXml;
    Ok(About {
        origin: Origin { format, description: format.title().to_owned(), start_utc: None },
        metadata: BTreeMap::from([("measuring".to_owned(), walk.numbers)]),
        notes,
    })
}

/// Arrays as columns: a shorter one ends earlier.
fn hand_over(arrays: &[Array], period_s: f64, sink: &mut dyn Sink) -> Result<(), Diagnostic> {
    let mut heads = Vec::new();
    for array in arrays {
        let parts: &[&str] = if array.complex { &[".re", ".im"] } else { &[""] };
        for part in parts {
            let remark = if array.complex { "frequency response: its points are counted" } else { "" };
            heads.push(Head {
                original: format!("{}{part}", array.name),
                layout: Layout::Own,
                period_s: Some(period_s),
                meaning: Meaning { remark: remark.to_owned(), ..Meaning::default() },
                ..Head::default()
            });
        }
    }
    sink.begin(&heads)?;
    let width = |array: &Array| if array.complex { 2 } else { 1 };
    let rows = arrays.iter().map(|array| array.values.len() / width(array)).max().unwrap_or(0);
    let mut row = Vec::new();
    for k in 0..rows {
        row.clear();
        let mut column = 0;
        for array in arrays {
            let width = width(array);
            for part in 0..width {
                if let Some(value) =
                    array.values.get(k * width + part).filter(|_| (k + 1) * width <= array.values.len())
                {
                    row.push((column + part, *value));
                }
            }
            column += width;
        }
        sink.row(k as f64 * period_s, &row)?;
    }
    Ok(())
}

struct Walk<'a> {
    source: &'a Source<'a>,
    part: usize,
    /// Tag and name of the open elements, and whether they say that their numbers are complex.
    path: Vec<(String, String, bool)>,
    arrays: Vec<Array>,
    numbers: BTreeMap<String, String>,
    values: usize,
}

impl Walk<'_> {
    /// Whether the file ends in good order.
    fn run(&mut self) -> Result<bool, Diagnostic> {
        // The text of an array is one item: megabytes are usual.
        let mut reader = Reader::from_reader(self.source.read(self.part)?.with_item_limit(64 << 20));
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
                    self.path.pop();
                }
                Ok(Event::Text(text)) => self.text(&text.into_inner(), at)?,
                Ok(Event::DocType(_)) => {
                    let message = "a trace has no document type, and entities are not expanded";
                    return Err(self.at(Diagnostic::error("T0006", message), at));
                }
                Ok(Event::Eof) => return Ok(self.path.is_empty()),
                Ok(_) => {}
                Err(quick_xml::Error::Io(error)) => {
                    return Err(self.at(unreadable(self.source.part_name(self.part), &error), at));
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
        self.path.push((tag.name().as_ref().to_owned(), attribute("name"), complex));
        Ok(())
    }

    fn text(&mut self, text: &str, at: u64) -> Result<(), Diagnostic> {
        let text = text.trim();
        let Some((tag, name, _)) = self.path.last().filter(|_| !text.is_empty()) else { return Ok(()) };
        if tag != "raw" {
            if !name.is_empty() && text.len() < 200 && self.numbers.len() < NUMBERS_MAX {
                self.numbers.entry(name.clone()).or_insert_with(|| text.to_owned());
            }
            return Ok(());
        }
        let values = base85(text).ok_or_else(|| {
            let message = "an array is not written in the base-85 digits of the control";
            self.at(Diagnostic::error("T0004", message), at)
        })?;
        self.values += values.len();
        if self.arrays.len() >= ARRAYS_MAX || self.values > VALUES_MAX {
            let message = format!("more than {ARRAYS_MAX} arrays or {VALUES_MAX} values");
            return Err(self.at(Diagnostic::error("T0017", message), at));
        }
        let names = self.path.iter().map(|(_, name, _)| name.as_str());
        let names: Vec<&str> = names.filter(|name| !name.is_empty() && *name != "m_pNumberArray").collect();
        let complex = self.path.iter().any(|(_, _, complex)| *complex);
        let mut name = if names.is_empty() { "array".to_owned() } else { names.join(".") };
        if self.arrays.iter().any(|array| array.name == name) {
            name = format!("{name} ({})", self.arrays.len() + 1);
        }
        self.arrays.push(Array { name, values, complex });
        Ok(())
    }
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
