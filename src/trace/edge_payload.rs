//! The JSON of a data recorder as a stream of its elements.
//!
//! In: bytes. Out: the header as a value, rows of numbers one by one, block events. A small scanner of its own: the elements of a
//! payload are read one at a time whatever their number, and what is cut off ends the stream instead of failing. Values other than
//! rows are handed to serde_json, at most [`VALUE_BYTES_MAX`] long.

use serde_json::Value;
use std::collections::BTreeSet;
use std::io::{self, BufRead};

/// Longest value that is read whole: a header with thousands of signals has some 100 KB.
const VALUE_BYTES_MAX: usize = 16 << 20;
/// Bytes that are looked at to know which signals are texts.
const LOOK_AHEAD_BYTES: u64 = 32 << 20;
/// Values of a row.
const ROW_MAX: usize = 100_000;
/// Nesting of values that are passed over.
const DEPTH_MAX: usize = 64;

/// One thing of the file.
#[derive(Debug)]
pub(super) enum Element {
    /// The header.
    Header(Value),
    /// A row of HFData.
    Row(Vec<f64>),
    /// HFBlockEvent.
    Block(Value),
    /// HFCallEvent.
    Call(Value),
    /// LFData.
    Low(Value),
    /// Anything else, by its key.
    Other(String),
}

/// What is wrong, and where.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) byte: u64,
    pub(super) reason: String,
    pub(super) io: Option<io::Error>,
}

/// Where the scanner stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Before a key of the file.
    Top,
    /// Before an element of the payload.
    Payload,
    /// Before a key of an element.
    Element,
    /// Before a row of HFData.
    Rows,
    Done,
}

/// Reads elements.
pub(super) struct Payload<R> {
    reader: R,
    byte: u64,
    state: State,
    complete: bool,
    text: Vec<u8>,
}

type Scanned<T> = Result<T, Fault>;

impl<R: BufRead> Payload<R> {
    pub(super) fn new(reader: R) -> Self {
        Self { reader, byte: 0, state: State::Done, complete: false, text: Vec::new() }.begun()
    }

    fn begun(mut self) -> Self {
        self.state = State::Top;
        self
    }

    /// Whether the end of the file was reached in good order.
    pub(super) fn complete(&self) -> bool {
        self.complete
    }

    /// The next element; `None` at the end, or where the file is cut off.
    pub(super) fn next(&mut self) -> Scanned<Option<Element>> {
        match self.scan() {
            // Cut off: what was there is taken.
            Err(fault) if fault.io.as_ref().is_some_and(|error| error.kind() == io::ErrorKind::UnexpectedEof) => {
                self.state = State::Done;
                Ok(None)
            }
            other => other,
        }
    }

    fn scan(&mut self) -> Scanned<Option<Element>> {
        loop {
            let state = self.state;
            let found = match state {
                State::Top => self.top()?,
                State::Payload => self.payload()?,
                State::Element => self.element()?,
                State::Rows => self.rows()?,
                State::Done => return Ok(None),
            };
            if found.is_some() {
                return Ok(found);
            }
        }
    }

    fn top(&mut self) -> Scanned<Option<Element>> {
        match self.token()? {
            b'{' | b',' => Ok(None),
            b'}' => {
                self.complete = true;
                self.state = State::Done;
                Ok(None)
            }
            b'"' => {
                let key = self.string()?;
                self.expect(b':')?;
                match key.as_str() {
                    "Header" => Ok(Some(Element::Header(self.value()?))),
                    "Payload" => {
                        self.expect(b'[')?;
                        self.state = State::Payload;
                        Ok(None)
                    }
                    _ => {
                        self.skip()?;
                        Ok(None)
                    }
                }
            }
            other => Err(self.unexpected(other, "a key such as \"Header\"")),
        }
    }

    fn payload(&mut self) -> Scanned<Option<Element>> {
        match self.token()? {
            b',' => {}
            b'{' => self.state = State::Element,
            b']' => self.state = State::Top,
            other => return Err(self.unexpected(other, "an element of the payload, in braces")),
        }
        Ok(None)
    }

    fn element(&mut self) -> Scanned<Option<Element>> {
        match self.token()? {
            b',' => Ok(None),
            b'}' => {
                self.state = State::Payload;
                Ok(None)
            }
            b'"' => {
                let key = self.string()?;
                self.expect(b':')?;
                match key.as_str() {
                    "HFData" => {
                        self.expect(b'[')?;
                        self.state = State::Rows;
                        Ok(None)
                    }
                    "HFBlockEvent" => Ok(Some(Element::Block(self.value()?))),
                    "HFCallEvent" => Ok(Some(Element::Call(self.value()?))),
                    "LFData" => Ok(Some(Element::Low(self.value()?))),
                    "HFTimestamp" | "HfTimestamp" => Ok(Some(Element::Other(self.stamp()?))),
                    _ => {
                        self.skip()?;
                        Ok(Some(Element::Other(key)))
                    }
                }
            }
            other => Err(self.unexpected(other, "a key such as \"HFData\"")),
        }
    }

    fn stamp(&mut self) -> Scanned<String> {
        self.skip()?;
        Ok("HFTimestamp".to_owned())
    }

    fn rows(&mut self) -> Scanned<Option<Element>> {
        match self.token()? {
            b',' => Ok(None),
            b']' => {
                self.state = State::Element;
                Ok(None)
            }
            b'[' => Ok(Some(Element::Row(self.row()?))),
            other => Err(self.unexpected(other, "a row of numbers, in brackets")),
        }
    }

    fn row(&mut self) -> Scanned<Vec<f64>> {
        let mut row = Vec::new();
        loop {
            match self.token()? {
                b',' => {}
                b']' => return Ok(row),
                b'"' => {
                    let text = self.string()?;
                    row.push(text.trim().parse().unwrap_or(f64::NAN));
                }
                first if first == b'-' || first == b'+' || first.is_ascii_alphanumeric() => {
                    row.push(self.number(first)?)
                }
                other => return Err(self.unexpected(other, "a number")),
            }
            if row.len() > ROW_MAX {
                return Err(self.fault(format!("a row has more than {ROW_MAX} values")));
            }
        }
    }

    /// A number, or a word such as null: no value.
    fn number(&mut self, first: u8) -> Scanned<f64> {
        self.text.clear();
        self.text.push(first);
        loop {
            let byte = self.peek()?;
            if !(byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'-' | b'+')) || self.text.len() > 64 {
                break;
            }
            self.text.push(byte);
            self.consume();
        }
        let text = std::str::from_utf8(&self.text).unwrap_or("");
        match text {
            "true" => Ok(1.0),
            "false" => Ok(0.0),
            text => Ok(text.parse::<f64>().ok().filter(|value| value.is_finite()).unwrap_or(f64::NAN)),
        }
    }

    /// A string after its opening mark; escapes stay as they are written, because no key has any.
    fn string(&mut self) -> Scanned<String> {
        self.text.clear();
        loop {
            let byte = self.peek()?;
            self.consume();
            match byte {
                b'"' => break,
                b'\\' => {
                    let next = self.peek()?;
                    self.consume();
                    self.text.extend([b'\\', next]);
                }
                other => self.text.push(other),
            }
            if self.text.len() > VALUE_BYTES_MAX {
                return Err(self.fault("a text has more than 16 MiB".to_owned()));
            }
        }
        Ok(String::from_utf8_lossy(&self.text).into_owned())
    }

    /// A whole value by serde_json.
    fn value(&mut self) -> Scanned<Value> {
        let mut raw = Vec::new();
        self.copy(Some(&mut raw))?;
        serde_json::from_slice(&raw).map_err(|error| self.fault(error.to_string()))
    }

    fn skip(&mut self) -> Scanned<()> {
        self.copy(None)
    }

    /// Passes over a value, and copies it if wanted.
    fn copy(&mut self, mut into: Option<&mut Vec<u8>>) -> Scanned<()> {
        let (mut depth, mut quoted, mut escaped, mut begun) = (0_usize, false, false, false);
        loop {
            let byte = self.peek()?;
            if !quoted && depth == 0 && begun && matches!(byte, b',' | b'}' | b']') {
                return Ok(());
            }
            self.consume();
            begun |= !byte.is_ascii_whitespace();
            if let Some(into) = into.as_deref_mut() {
                into.push(byte);
                if into.len() > VALUE_BYTES_MAX {
                    return Err(self.fault("a value has more than 16 MiB".to_owned()));
                }
            }
            match byte {
                _ if escaped => escaped = false,
                b'\\' if quoted => escaped = true,
                b'"' => quoted = !quoted,
                b'{' | b'[' if !quoted => depth += 1,
                b'}' | b']' if !quoted => depth = depth.saturating_sub(1),
                _ => {}
            }
            if depth > DEPTH_MAX {
                return Err(self.fault(format!("values are nested more than {DEPTH_MAX} deep")));
            }
            if depth == 0 && !quoted && matches!(byte, b'}' | b']' | b'"') {
                return Ok(());
            }
        }
    }

    fn expect(&mut self, wanted: u8) -> Scanned<()> {
        match self.token()? {
            byte if byte == wanted => Ok(()),
            other => Err(self.unexpected(other, &format!("`{}`", char::from(wanted)))),
        }
    }

    /// The next byte that is no blank.
    fn token(&mut self) -> Scanned<u8> {
        loop {
            let byte = self.peek()?;
            self.consume();
            if !byte.is_ascii_whitespace() {
                return Ok(byte);
            }
        }
    }

    fn peek(&mut self) -> Scanned<u8> {
        let byte = self.byte;
        match self.reader.fill_buf() {
            Ok([first, ..]) => Ok(*first),
            Ok([]) => {
                let io = Some(io::ErrorKind::UnexpectedEof.into());
                Err(Fault { byte, reason: "it ends too early".to_owned(), io })
            }
            Err(error) => Err(Fault { byte, reason: error.to_string(), io: Some(error) }),
        }
    }

    fn consume(&mut self) {
        self.reader.consume(1);
        self.byte += 1;
    }

    fn unexpected(&self, found: u8, wanted: &str) -> Fault {
        self.fault(format!("`{}` where {wanted} is expected", char::from(found).escape_default()))
    }

    fn fault(&self, reason: String) -> Fault {
        Fault { byte: self.byte.saturating_sub(1), reason, io: None }
    }
}

/// Period of the position cycle by the time stamps of a file: counter against clock over the first thousand stamps, brought to the
/// nearest 0.05 ms where that is within a percent.
pub(super) fn period_by_stamps(reader: impl BufRead) -> Option<f64> {
    let mut stamps: Vec<(f64, f64)> = Vec::new();
    let mut payload = Stamps { scanner: Payload::new(reader) };
    while stamps.len() < 1000 {
        let Some(stamp) = payload.next() else { break };
        stamps.push(stamp);
    }
    let (first, last) = (stamps.first()?, stamps.last()?);
    let period_s = (last.1 - first.1) / (last.0 - first.0);
    let rounded_s = (period_s / 50e-6).round() * 50e-6;
    let near = (rounded_s - period_s).abs() < 0.01 * period_s;
    let period_s = if near { rounded_s } else { period_s };
    (period_s.is_finite() && (1e-5..10.0).contains(&period_s)).then_some(period_s)
}

/// Addresses of LFData whose values are texts. Reads until each of so many addresses has come once, or so many bytes.
pub(super) fn text_addresses(reader: impl BufRead, addresses: usize) -> BTreeSet<String> {
    let mut payload = Payload::new(reader);
    let (mut seen, mut texts) = (BTreeSet::new(), BTreeSet::new());
    while seen.len() < addresses && payload.byte < LOOK_AHEAD_BYTES {
        // What is wrong with the file is said by the reading that follows.
        let Ok(Some(element)) = payload.next() else { break };
        let Element::Low(values) = element else { continue };
        for entry in values.as_array().map_or(std::slice::from_ref(&values), Vec::as_slice) {
            let address = entry.get("address").or_else(|| entry.get("Address")).and_then(Value::as_str);
            seen.extend(address.map(str::to_owned));
            texts.extend(super::edge_low::text_address(entry).map(str::to_owned));
        }
    }
    texts
}

struct Stamps<R> {
    scanner: Payload<R>,
}

impl<R: BufRead> Stamps<R> {
    /// Counter and time of the next stamp.
    fn next(&mut self) -> Option<(f64, f64)> {
        loop {
            match self.scanner.state {
                State::Element => match self.scanner.token().ok()? {
                    b'"' => {
                        let key = self.scanner.string().ok()?;
                        self.scanner.expect(b':').ok()?;
                        if key != "HFTimestamp" && key != "HfTimestamp" {
                            self.scanner.skip().ok()?;
                            continue;
                        }
                        let stamp = self.scanner.value().ok()?;
                        let counter = stamp.get("HFProbeCounter").or_else(|| stamp.get("HfProbeCounter"));
                        let counter = counter.and_then(Value::as_f64);
                        let time = stamp.get("Time").and_then(Value::as_str).and_then(super::instants::instant_s);
                        if let Some(stamp) = counter.zip(time) {
                            return Some(stamp);
                        }
                    }
                    b'}' => self.scanner.state = State::Payload,
                    _ => {}
                },
                State::Done => return None,
                _ => {
                    self.scanner.next_state()?;
                }
            }
        }
    }
}

impl<R: BufRead> Payload<R> {
    /// One step outside of elements.
    fn next_state(&mut self) -> Option<()> {
        match self.state {
            State::Top => self.top().ok().map(|_| ()),
            State::Payload => self.payload().ok().map(|_| ()),
            _ => None,
        }
    }
}
