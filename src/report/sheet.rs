//! The page: everything in one HTML text.
//!
//! In: a trace with its figures, or two with their comparison. Out: HTML without any address on the net: uPlot (vendored, MIT), our script
//! and style, the data as base64 in a JSON element. Equal inputs give equal bytes. Does not write files.

use super::bands::packed;
use super::encode::{escape, script_json};
use super::path_view::{PathSource, path_json};
use super::plots::{Curve, plots};
use super::strip::Strip;
use super::tables::{comparison_tables, run_tables, side_tables};
use crate::compare::{ACTUAL_STEMS, Alignment, Comparison, Lines, Side, machine_of, track};
use crate::program::{OpenedProgram, ProgramSource};
use crate::trace::Trace;
use serde_json::{Value, json};

/// Bytes of all curves together, before base64 makes four of three.
const CURVES_BYTES: usize = 1_250_000;
/// Bytes of one curve at least and at most.
const CURVE_BYTES: (usize, usize) = (2_000, 48_000);
/// Text of programs in the page.
const PROGRAM_BYTES_MAX: usize = 300_000;
/// Text of the machine file in the page.
const MACHINE_BYTES_MAX: usize = 60_000;

const TEMPLATE: &str = include_str!("page/page.html");
const SCRIPT: &str = include_str!("page/page.js");
const PLOT_SCRIPT: &str = include_str!("page/plots.js");
const PATH_SCRIPT: &str = include_str!("page/path.js");
const STYLE: &str = include_str!("page/page.css");
const UPLOT_SCRIPT: &str = include_str!("vendor/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("vendor/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("vendor/LICENSE-uPlot");

/// What a page shows.
pub struct Sheet<'a> {
    /// The trace.
    pub trace: &'a Trace,
    /// Its own figures ([`crate::compare::examine`]).
    pub side: &'a Side,
    /// What it is compared with.
    pub reference: Option<(&'a Trace, &'a Comparison)>,
}

impl Sheet<'_> {
    /// The whole page.
    pub fn html(&self) -> String {
        let data = self.data();
        let parts = [
            ("{{title}}", escape(&self.title())),
            ("{{subtitle}}", self.subtitle()),
            ("{{tables}}", self.tables()),
            ("{{notes}}", self.notes()),
            ("{{machine}}", self.machine()),
            ("{{style}}", format!("{UPLOT_STYLE}\n{STYLE}")),
            ("{{licence}}", escape(UPLOT_LICENCE)),
            ("{{uplot}}", UPLOT_SCRIPT.to_owned()),
            ("{{script}}", format!("{SCRIPT}\n{PLOT_SCRIPT}\n{PATH_SCRIPT}")),
            ("{{data}}", script_json(&data)),
        ];
        fill(TEMPLATE, &parts)
    }

    fn title(&self) -> String {
        let base = |name: &str| name.rsplit(['/', '\\']).next().unwrap_or(name).to_owned();
        match self.reference {
            Some((other, _)) => format!("{} against {}", base(&self.trace.name), base(&other.name)),
            None => base(&self.trace.name),
        }
    }

    fn subtitle(&self) -> String {
        let mut parts = Vec::new();
        let of = |key: &str| self.trace.summary.as_ref().and_then(|s| s.get(key)).and_then(Value::as_str);
        parts.extend(of("program").map(|program| format!("program {}", escape(program))));
        parts.extend(of("machine").map(|machine| format!("machine {}", escape(machine))));
        parts.push(escape(&self.trace.origin.description));
        parts.extend(self.reference.map(|(other, _)| format!("reference: {}", escape(&other.origin.description))));
        parts.extend(self.trace.origin.start_utc.as_ref().map(|start| format!("recorded {}", escape(start))));
        parts.join(" · ")
    }

    fn tables(&self) -> String {
        match self.reference {
            Some((_, comparison)) => comparison_tables(comparison),
            None => {
                let run = self.trace.summary.as_ref().map_or_else(String::new, run_tables);
                run + &side_tables(self.side, "")
            }
        }
    }

    /// Warnings of the run and of the comparison, and of the import.
    fn notes(&self) -> String {
        let mut items: Vec<String> = Vec::new();
        let sides = [Some(self.trace), self.reference.map(|(other, _)| other)];
        for side in sides.into_iter().flatten() {
            let warnings = side.summary.as_ref().and_then(|s| s.get("warnings")).and_then(Value::as_array);
            for warning in warnings.into_iter().flatten() {
                let text = |key: &str| warning.get(key).and_then(Value::as_str).unwrap_or_default();
                items.push(format!("{} {}", text("code"), text("message")));
            }
            items.extend(side.notes.iter().map(|note| format!("{} {}", note.code, note.message)));
        }
        items.extend(
            self.reference.iter().flat_map(|(_, c)| &c.notes).map(|note| format!("{} {}", note.code, note.message)),
        );
        items.dedup();
        if items.is_empty() {
            return String::new();
        }
        let list: String = items.iter().take(50).map(|item| format!("<li>{}</li>", escape(item))).collect();
        format!(
            "<details class=\"notes\" open><summary>What to know ({})</summary><ul>{list}</ul></details>",
            items.len()
        )
    }

    fn machine(&self) -> String {
        let machine =
            self.trace.machine.as_ref().or_else(|| self.reference.and_then(|(other, _)| other.machine.as_ref()));
        let Some((name, text)) = machine else { return String::new() };
        let shown = cut(text, MACHINE_BYTES_MAX);
        let more = if shown.len() < text.len() { "\n… (cut)" } else { "" };
        format!(
            "<details class=\"machine\"><summary>Machine file {}</summary><pre>{}{more}</pre></details>",
            escape(name),
            escape(shown)
        )
    }

    fn data(&self) -> Value {
        let reference = self.reference;
        let at = reference.and_then(|(_, comparison)| comparison.alignment).unwrap_or_else(Alignment::none);
        let span_s = self.span_s(&at);
        let (plots, left_out) = plots(self.trace, self.side, reference);
        let shares: usize = plots.iter().flat_map(|plot| &plot.curves).map(Curve::room_share).sum();
        let room = |curve: &Curve<'_>| {
            let bytes = CURVES_BYTES * curve.room_share() / shares.max(1);
            bytes.clamp(CURVE_BYTES.0, CURVE_BYTES.1 * curve.room_share().max(1))
        };
        let mut banded = 0;
        let mut plots_json = Vec::new();
        for plot in &plots {
            let mut curves = Vec::new();
            for curve in &plot.curves {
                let place = |time_s: f64| if curve.of_reference { at.trace_s(time_s) } else { time_s };
                let mut document = packed(&curve.samples.series(), &place, span_s, room(curve));
                banded += usize::from(document["kind"] == "band");
                document["name"] = json!(curve.name);
                document["family"] = json!(curve.family);
                document["dashed"] = json!(curve.dashed);
                document["shown"] = json!(curve.shown);
                document["reference"] = json!(curve.of_reference);
                curves.push(document);
            }
            plots_json.push(json!({"title": plot.title, "unit": plot.unit, "curves": curves}));
        }
        let lines = Lines::of(self.trace).or(reference.map_or_else(Lines::default, |(other, _)| Lines::of(other)), at);
        let limits = Strip::of_limits(self.trace);
        // The reference may go on longer: what limits the feed, and which line is active, is known as long as the trace lasts.
        let end_of = |trace: &Trace, place: &dyn Fn(f64) -> f64| trace.span_s().map(|(_, end_s)| place(end_s));
        let end_s = end_of(self.trace, &|t| t).unwrap_or(span_s.1);
        let lines_end_s = match reference {
            Some((other, _)) if Lines::of(self.trace).is_empty() => {
                end_of(other, &|t| at.trace_s(t)).unwrap_or(span_s.1)
            }
            _ => end_s,
        };
        json!({
            "start": span_s.0, "end": span_s.1,
            "plots": plots_json,
            "banded": banded,
            "left_out": left_out,
            "limits": if limits.is_empty() { Value::Null } else { limits.json(end_s, true) },
            "lines": if lines.is_empty() { Value::Null } else { Strip::of_lines(&lines).json(lines_end_s, false) },
            "path": self.path(&at),
            "programs": self.programs(),
        })
    }

    fn span_s(&self, at: &Alignment) -> (f64, f64) {
        let own = self.trace.span_s().unwrap_or((0.0, 1.0));
        let other = self.reference.and_then(|(other, _)| other.span_s()).map(|(a, b)| (at.trace_s(a), at.trace_s(b)));
        let (from_s, to_s) = other.map_or(own, |other| (own.0.min(other.0), own.1.max(other.1)));
        if to_s > from_s { (from_s, to_s) } else { (from_s, from_s + 1.0) }
    }

    fn path(&self, _at: &Alignment) -> Value {
        let trace = self.trace;
        if let Some((_, comparison)) = self.reference
            && let Some(found) = &comparison.contour
        {
            let against = found.against.clone();
            return path_json(&PathSource {
                track: &found.track,
                matches: Some(&found.contour.matches),
                against,
                trace,
            });
        }
        if let Some(own) = &self.side.own {
            let against = own.against.clone();
            return path_json(&PathSource { track: &own.track, matches: Some(&own.contour.matches), against, trace });
        }
        let machine = machine_of(trace);
        match track(trace, machine.as_ref(), &ACTUAL_STEMS, true) {
            Some(track) => path_json(&PathSource { track: &track, matches: None, against: String::new(), trace }),
            None => Value::Null,
        }
    }

    /// Programs with their texts, as far as there is room.
    fn programs(&self) -> Value {
        let own = &self.trace.programs;
        let programs = match self.reference {
            Some((other, _)) if own.is_empty() => &other.programs,
            _ => own,
        };
        let mut room = PROGRAM_BYTES_MAX;
        let mut list = Vec::new();
        for program in programs {
            let text = beginning(program, room);
            let shown = cut(&text, room);
            room -= shown.len();
            list.push(json!({"name": *program.name, "text": shown, "cut": shown.len() < program.bytes.length()}));
            if room == 0 {
                break;
            }
        }
        Value::Array(list)
    }
}

/// The first bytes of a program, decoded as the control's file says.
fn beginning(program: &OpenedProgram, bytes: usize) -> String {
    let mut head: Vec<u8> = Vec::new();
    let taken = program.bytes.pass(0, |stretch| {
        head.extend_from_slice(&stretch[..stretch.len().min(bytes - head.len())]);
        head.len() < bytes
    });
    if taken.is_err() {
        return String::new();
    }
    let source = ProgramSource::from_bytes(&program.name, head.clone());
    source.decode(&head).into_owned()
}

/// At most `bytes` of a text, whole lines where it has any.
fn cut(text: &str, bytes: usize) -> &str {
    if text.len() <= bytes {
        return text;
    }
    let end = (0..=bytes).rev().find(|i| text.is_char_boundary(*i)).unwrap_or(0);
    let whole = &text[..end];
    whole.rfind('\n').map_or(whole, |line_end| &whole[..=line_end])
}

/// Puts parts into their places, each once; what is put in is not looked at again, so that no program text can be taken for a place.
fn fill(template: &str, parts: &[(&str, String)]) -> String {
    let mut page = String::with_capacity(template.len() + parts.iter().map(|part| part.1.len()).sum::<usize>());
    let mut rest = template;
    loop {
        let next =
            parts.iter().filter_map(|(name, text)| Some((rest.find(name)?, *name, text))).min_by_key(|(at, ..)| *at);
        let Some((at, name, text)) = next else { break };
        page += &rest[..at];
        page += text;
        rest = &rest[at + name.len()..];
    }
    page + rest
}
