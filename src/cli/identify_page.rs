//! The page of `sollwert identify --report`: values with their intervals, refusals, friction over speed.
//!
//! In: results. Out: one HTML document, drawings inside it, light or dark as the reader's system is. Loads nothing, runs no script.

use super::identify_tables::{axis_of, number};
use crate::identify::{AxisResult, Estimate, Parameter};
use crate::machine::{Axis, Machine};
use crate::report::escape;
use std::path::PathBuf;

/// Width of a drawing in its own units, and its borders.
pub(super) const WIDTH: f64 = 720.0;
pub(super) const LEFT: f64 = 70.0;
pub(super) const MARGIN: f64 = 14.0;
pub(super) const BOTTOM: f64 = 34.0;
const HEIGHT: f64 = 260.0;
/// Half of the longest label below a drawing.
const LABEL: f64 = 40.0;

/// Of every page of identify: three colours of lines, a, b and c.
const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#1b1f24;--paper:#fff;--grid:#d7dce1;--a:#0b61a4;--b:#c2410c;--c:#8a9099}\
@media(prefers-color-scheme:dark){:root{--ink:#e6e8ea;--paper:#14171a;--grid:#343a40;--a:#6cb6ff;--b:#ff9d5c;--c:#7b828a}}\
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:66rem;margin:2rem auto;padding:0 1rem}\
svg{width:100%;height:auto;display:block}svg text{fill:var(--ink);font:11px system-ui,sans-serif}.grid{stroke:var(--grid);stroke-width:1}";
const OF_AXES: &str = "\
.law{fill:none;stroke:var(--b);stroke-width:1.8}.point{fill:var(--a)}.table{overflow-x:auto}table{border-collapse:collapse}\
td,th{padding:.15rem .9rem .15rem 0;text-align:left}.n.n{text-align:right;font-variant-numeric:tabular-nums}";

/// A document with that style and more of it; the title is escaped already.
pub(super) fn whole(title: &str, style: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>{title}</title>\n<style>{STYLE}{style}</style></head>\n<body>\n<h1>{title}</h1>\n{body}</body></html>\n"
    )
}

/// The whole document.
pub(super) fn page(results: &[AxisResult], machine: &Machine, traces: &[PathBuf]) -> String {
    let title = format!("{}: identified", escape(&machine.name));
    let names: Vec<String> = traces.iter().map(|path| escape(&path.display().to_string())).collect();
    let mut text = format!(
        "<p>Traces: {}. Intervals are those of 95 %. Torque constant, transmission and cycles are those of the machine file.</p>\n",
        names.join(", ")
    );
    for result in results {
        if let Some(axis) = axis_of(result, machine) {
            text += &section(result, axis);
        }
    }
    whole(&title, OF_AXES, &text)
}

fn section(result: &AxisResult, axis: &Axis) -> String {
    let mut text = format!("<h2>Axis {}</h2>\n", escape(&result.axis));
    if result.estimates.is_empty() {
        text += "<p>Nothing could be identified.</p>\n";
    } else {
        text += "<div class=\"table\"><table><tr><th></th><th class=\"n\">value</th><th class=\"n\">from</th><th class=\"n\">to</th><th>unit</th><th>by</th></tr>\n";
        for estimate in &result.estimates {
            text += &row(estimate, axis);
        }
        text += "</table></div>\n";
    }
    if !result.refusals.is_empty() {
        text += "<h3>Not to be told from these traces</h3>\n<ul>\n";
        for refusal in &result.refusals {
            let (title, reason, remedy) = (refusal.parameter.title(), escape(&refusal.reason), escape(&refusal.remedy));
            text += &format!("<li>{title}: {reason}. <em>{remedy}</em></li>\n");
        }
        text += "</ul>\n";
    }
    if !result.verdicts.is_empty() {
        let items: String = result.verdicts.iter().map(|verdict| format!("<li>{}</li>\n", escape(verdict))).collect();
        text += &format!("<h3>Verdict</h3>\n<ul>\n{items}</ul>\n");
    }
    if result.friction_points.len() > 1 {
        text += "<h3>Friction and gravity over the speed of the motor</h3>\n";
        text += "<p>Points: mean torque of the trace without that of the inertia. Line: the law that was fitted.</p>\n";
        text += &drawing(&result.friction_points, Parameter::Coulomb.unit(axis));
    }
    text
}

fn row(estimate: &Estimate, axis: &Axis) -> String {
    let width = estimate.high - estimate.low;
    let cell = |value: f64| format!("<td class=\"n\">{}</td>", number(value, width));
    format!(
        "<tr><th>{}</th>{}{}{}<td>{}</td><td>{}</td></tr>\n",
        estimate.parameter.title(),
        cell(estimate.value),
        cell(estimate.low),
        cell(estimate.high),
        estimate.parameter.unit(axis),
        estimate.means.title()
    )
}

/// Where a label below a drawing stands: in the middle below its place, the last one inside the page.
pub(super) fn label_below(x: f64) -> (f64, &'static str) {
    if x > WIDTH - LABEL { (WIDTH - 1.0, "end") } else { (x, "middle") }
}

/// Torque over speed: points and law. With a linear motor these are N over m/s.
fn drawing(points: &[[f64; 3]], unit: &str) -> String {
    let speed_unit = if unit == "N" { "m/s" } else { "rad/s" };
    let bounds = |of: &dyn Fn(&[f64; 3]) -> [f64; 2]| {
        let all = || points.iter().flat_map(of).filter(|value| value.is_finite());
        let (low, high) = (all().fold(0.0, f64::min), all().fold(0.0, f64::max));
        if high > low { (low, high) } else { (low - 1.0, low + 1.0) }
    };
    let (slowest, fastest) = bounds(&|point| [point[0]; 2]);
    let (lowest, highest) = bounds(&|point| [point[1], point[2]]);
    let x = |speed: f64| LEFT + (WIDTH - LEFT - MARGIN) * (speed - slowest) / (fastest - slowest);
    let y = |torque: f64| MARGIN + (HEIGHT - MARGIN - BOTTOM) * (highest - torque) / (highest - lowest);
    let mut svg = format!("<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"torque over speed\">\n");
    for torque in [lowest, 0.0, highest] {
        let at = y(torque);
        svg += &format!("<line class=\"grid\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{at:.1}\" y2=\"{at:.1}\"/>", WIDTH - MARGIN);
        svg += &format!(
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{torque:.3} {unit}</text>\n",
            LEFT - 6.0,
            at + 4.0
        );
    }
    for speed in [slowest, 0.0, fastest] {
        let at = x(speed);
        svg +=
            &format!("<line class=\"grid\" x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{MARGIN}\" y2=\"{}\"/>", HEIGHT - BOTTOM);
        let ((at, anchor), below) = (label_below(at), HEIGHT - 14.0);
        svg += &format!("<text x=\"{at:.1}\" y=\"{below}\" text-anchor=\"{anchor}\">{speed:.1} {speed_unit}</text>\n");
    }
    // The law jumps at a standstill.
    for side in [-1.0, 1.0] {
        let line: Vec<String> = points
            .iter()
            .filter(|point| point[0] * side > 0.0)
            .map(|point| format!("{:.1},{:.1}", x(point[0]), y(point[2])))
            .collect();
        svg += &format!("<polyline class=\"law\" points=\"{}\"/>\n", line.join(" "));
    }
    for point in points {
        svg += &format!("<circle class=\"point\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\"/>\n", x(point[0]), y(point[1]));
    }
    svg + "</svg>\n"
}
