//! The page of `sollwert tune --report`: gains, figures, and maps of the objective around the new gains.
//!
//! In: what was found. Out: one HTML document, drawings inside it, light or dark as the reader's system is. Loads nothing, runs no script.

use super::tune_tables::{objective, tables};
use crate::base::units::UM_PER_MM;
use crate::report::escape;
use crate::tune::{Landscape, TuneOptions, Tuned};

const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#1b1f24;--paper:#fff;--grid:#d7dce1}\
@media(prefers-color-scheme:dark){:root{--ink:#e6e8ea;--paper:#14171a;--grid:#343a40}}\
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:60rem;margin:2rem auto;padding:0 1rem}\
pre{overflow-x:auto;border:1px solid var(--grid);padding:.6rem}svg{max-width:34rem;width:100%;height:auto;display:block}\
svg text{fill:var(--ink);font:11px system-ui,sans-serif}.cell text{fill:#10202c}";
const CELL: f64 = 40.0;
const LEFT: f64 = 76.0;
const BOTTOM: f64 = 46.0;

/// The whole document.
pub(super) fn page(machine: &str, tuned: &Tuned, options: &TuneOptions) -> String {
    let title = format!("{}: feed-forward", escape(machine));
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>{title}</title>\n<style>{STYLE}</style></head>\n<body>\n<h1>{title}</h1>\n<pre>{}</pre>\n",
        escape(&tables(tuned, options))
    );
    if !tuned.warnings.is_empty() {
        let items: String =
            tuned.warnings.iter().map(|warning| format!("<li>{}</li>", escape(&warning.message))).collect();
        text += &format!("<h2>What to know</h2>\n<ul>{items}</ul>\n");
    }
    text += "<h2>Around the new gains</h2>\n";
    text += &format!(
        "<p>{} on the courses for tuning, simulated at every point, all other gains as found. The new gains stand in the \
         middle unless a bound is near; a valley along a diagonal is a pair of gains that replace each other.</p>\n",
        objective(options)
    );
    for landscape in &tuned.landscapes {
        text += &drawing(landscape);
    }
    text + "</body></html>\n"
}

/// A map as coloured cells with their numbers.
fn drawing(landscape: &Landscape) -> String {
    let map = &landscape.map;
    let (columns, rows) = (map.values[0].len(), map.values[1].len());
    let all = || map.heights.iter().flatten().copied();
    let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max));
    let (width, height) = (LEFT + CELL * columns as f64, CELL * rows as f64 + BOTTOM);
    let unit = if map.unit == "mm" { "µm" } else { "thousandths of a degree" };
    let names = map.gains.map(|gain| gain.key(crate::base::AxisKind::Linear));
    let mut svg = format!(
        "<h3>{}: {} and {}, {unit}</h3>\n<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"map of {}\">\n",
        escape(&landscape.axis),
        names[0],
        names[1],
        escape(&landscape.axis)
    );
    for (row, heights) in map.heights.iter().enumerate() {
        let y = CELL * (rows - 1 - row) as f64;
        for (column, value) in heights.iter().enumerate() {
            let x = LEFT + CELL * column as f64;
            // The logarithm: the valley is what one looks for.
            let share = if high > low && low > 0.0 { (value / low).ln() / (high / low).ln() } else { 0.0 };
            let (lightness, hue) = (88.0 - 38.0 * share, 200.0 - 170.0 * share);
            svg += &format!(
                "<g class=\"cell\"><rect x=\"{x:.0}\" y=\"{y:.0}\" width=\"{CELL}\" height=\"{CELL}\" fill=\"hsl({hue:.0} 60% {lightness:.0}%)\"/>\
                 <text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{:.1}</text></g>",
                x + 0.5 * CELL,
                y + 0.6 * CELL,
                value * UM_PER_MM
            );
        }
        svg += &format!(
            "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"end\">{:.3}</text>\n",
            LEFT - 6.0,
            y + 0.6 * CELL,
            map.values[1][row]
        );
    }
    for (column, value) in map.values[0].iter().enumerate() {
        let x = LEFT + CELL * (column as f64 + 0.5);
        svg +=
            &format!("<text x=\"{x:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{value:.3}</text>", height - BOTTOM + 18.0);
    }
    svg += &format!(
        "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>\n",
        0.5 * (width + LEFT),
        height - 8.0,
        names[0]
    );
    svg + "</svg>\n"
}
