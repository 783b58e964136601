//! Numbers for the page: whole steps in 2, 3 or 4 bytes, as base64.
//!
//! In: values, NaN where there is none. Out: [`Packed`]: value = low + (code - 1) * step, code 0 = none. The step is said in the page.
//! Lower and upper ends of a band are rounded outwards, so that no peak gets smaller. Does not compress.

use serde_json::{Value, json};

/// How values are brought to steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounding {
    /// To the nearest step.
    Nearest,
    /// Never above the value.
    Down,
    /// Never below the value.
    Up,
}

/// Steps for a range of values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steps {
    low: f64,
    step: f64,
    bytes: usize,
}

impl Steps {
    /// For all values that are finite, in `bytes` (2, 3 or 4) a value.
    pub fn covering<'a>(values: impl Iterator<Item = &'a f64>, bytes: usize) -> Self {
        let bytes = bytes.clamp(2, 4);
        let finite = values.filter(|value| value.is_finite());
        let (low, high) = finite.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
        // Codes 1 ..= top - 1, so that rounding outwards stays inside.
        let top = ((1_u64 << (8 * bytes)) - 3) as f64;
        let range = high - low;
        if !range.is_finite() || range <= 0.0 {
            return Self { low: if low.is_finite() && low < f64::MAX { low } else { 0.0 }, step: 1.0, bytes };
        }
        Self { low, step: range / top, bytes }
    }

    /// One step, in the unit of the values.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// The values as a JSON object: `low`, `step`, `bytes`, `data`.
    pub fn pack(&self, values: &[f64], rounding: Rounding) -> Value {
        let mut raw = Vec::with_capacity(values.len() * self.bytes);
        for value in values {
            let code = self.code(*value, rounding);
            raw.extend_from_slice(&code.to_le_bytes()[..self.bytes]);
        }
        json!({"low": self.low, "step": self.step, "bytes": self.bytes, "data": base64(&raw)})
    }

    fn code(&self, value: f64, rounding: Rounding) -> u32 {
        if !value.is_finite() {
            return 0;
        }
        let steps = (value - self.low) / self.step;
        // A value that is a step but for rounding of the division must not move by a whole one.
        let near = steps.round();
        let whole = match rounding {
            _ if (steps - near).abs() < 1e-6 => near,
            Rounding::Nearest => near,
            Rounding::Down => steps.floor(),
            Rounding::Up => steps.ceil(),
        };
        let top = ((1_u64 << (8 * self.bytes)) - 2) as f64;
        whole.clamp(0.0, top) as u32 + 1
    }
}

/// Standard base64 with padding (RFC 4648).
pub fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let at = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let word = at(0) << 16 | at(1) << 8 | at(2);
        for i in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

/// Text for HTML, in elements and in quoted attributes.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            // Control characters are no HTML.
            c if c.is_control() && !matches!(c, '\n' | '\t') => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

/// A document for a `<script type="application/json">`: no `<` can end the element or open a comment.
pub fn script_json(document: &Value) -> String {
    document.to_string().replace('<', "\\u003c").replace('\u{2028}', "\\u2028").replace('\u{2029}', "\\u2029")
}
