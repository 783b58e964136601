//! Which format a text is, by its first bytes.
//!
//! In: the first 64 KiB, decoded. Out: a [`TraceFormat`], or a finding that says what the file is instead. Does not read on.

use super::wire::TraceFormat;
use crate::base::Diagnostic;

/// Lines that are looked at.
const LINES_MAX: usize = 50;

/// What a text is.
pub(super) fn format_of(text: &str, shown: &str) -> Result<TraceFormat, Diagnostic> {
    let start = text.trim_start();
    if start.is_empty() {
        return Err(Diagnostic::error("T0003", format!("{shown} holds nothing but blanks")).help("export it again"));
    }
    if let Some(binary) = binary(text) {
        return Err(unknown(shown, binary));
    }
    if start.starts_with('<') {
        return xml(start, shown);
    }
    if start.starts_with('{') || start.starts_with('[') {
        return if start.contains("\"Header\"") || start.contains("\"Payload\"") {
            Ok(TraceFormat::EdgeJson)
        } else {
            Err(unknown(shown, "JSON without `Header` and `Payload`"))
        };
    }
    if start.starts_with("# Sampling period") || start.starts_with("Sampling period is") {
        return Ok(TraceFormat::Halscope);
    }
    if twincat(start) {
        return Ok(TraceFormat::TwinCatCsv);
    }
    if halsampler(start) {
        return Ok(TraceFormat::Halsampler);
    }
    if start.lines().take(LINES_MAX).any(|line| line.contains([',', ';', '\t'])) {
        return Ok(TraceFormat::Csv);
    }
    let blanks = |line: &&str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        words.len() > 1 && words.iter().all(|word| word.parse::<f64>().is_ok())
    };
    if start.lines().take(LINES_MAX).filter(blanks).count() > 2 {
        return Ok(TraceFormat::Csv);
    }
    // A table of one column needs no separator.
    let numbers = start.lines().take(LINES_MAX).filter(|line| line.trim().parse::<f64>().is_ok()).count();
    if numbers > 2 { Ok(TraceFormat::Csv) } else { Err(unknown(shown, "text, but no table")) }
}

fn binary(text: &str) -> Option<&'static str> {
    if text.starts_with("PAR1") {
        return Some("Parquet, which is written but not read");
    }
    let odd = text.chars().take(4096).filter(|c| c.is_control() && !matches!(c, '\n' | '\r' | '\t')).count();
    (odd > 0 && text.chars().take(4096).any(|c| c == '\0')).then_some("binary data")
}

fn xml(start: &str, shown: &str) -> Result<TraceFormat, Diagnostic> {
    // Declaration, comments and a document type stand before the root.
    let mut root = "";
    let mut rest = start;
    while let Some(open) = rest.find('<') {
        rest = &rest[open + 1..];
        if let Some(comment) = rest.strip_prefix("!--") {
            rest = comment.find("-->").map_or("", |end| &comment[end + 3..]);
        } else if rest.starts_with('!') && !rest.contains("<traceSession") && rest.contains("ENTITY") {
            // Refused by the reader, which knows how to say it.
            return Ok(TraceFormat::OperateXml);
        } else if !rest.starts_with(['?', '!']) {
            root = rest.split(|c: char| c.is_whitespace() || c == '>' || c == '/').next().unwrap_or("");
            break;
        }
    }
    match root {
        "traceSession" | "traceData" => Ok(TraceFormat::OperateXml),
        _ if start.contains("DynamicModelAxisController")
            || start.contains("ResponseTestCustom")
            || start.contains("m_pNumberArray") =>
        {
            Ok(TraceFormat::MeasuringXml)
        }
        _ => Err(unknown(shown, &format!("XML, but its root is `{}`", root.chars().take(40).collect::<String>()))),
    }
}

/// `Name<TAB>...`, and soon the keys of channels.
fn twincat(start: &str) -> bool {
    let lines: Vec<&str> = start.lines().take(LINES_MAX).collect();
    // Any of several letters separates, quotation marks may stand around a key.
    let begins = |line: &str, word: &str| {
        let rest = line.trim_start_matches('"').strip_prefix(word).map(|rest| rest.trim_start_matches('"'));
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['\t', ';', ',', ':', ' ']))
    };
    let known = ["SampleTime[ms]", "Starttime of export", "SymbolName", "NetID", "VariableSize", "SymbolComment"];
    let first = lines.first().is_some_and(|line| begins(line, "Name") || begins(line, "File"));
    first && lines.iter().any(|line| known.iter().any(|word| begins(line, word)))
}

/// Rows of numbers, separated by blanks, without a head.
fn halsampler(start: &str) -> bool {
    let lines: Vec<&str> = start.lines().take(LINES_MAX).collect();
    // The last line may be cut off by the end of the head.
    let whole = &lines[..lines.len().saturating_sub(usize::from(lines.len() > 1))];
    let numbers = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        line.trim() == "overrun" || (words.len() > 1 && words.iter().all(|word| word.parse::<f64>().is_ok()))
    };
    !whole.is_empty() && !start.contains(['\t', ';', ',']) && whole.iter().all(|line| numbers(line))
}

fn unknown(shown: &str, what: &str) -> Diagnostic {
    Diagnostic::error("T0002", format!("{shown} is no trace that can be read: it is {what}")).help(
        "known are recordings (.mcap), SINUMERIK Operate traces, Edge JSON, CSV, TwinCAT Scope CSV, halscope and halsampler",
    )
}
