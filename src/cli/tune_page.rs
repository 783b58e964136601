//! The page of `sollwert tune --report`: gains, figures, and maps of the objective around the new gains.
//!
//! In: what was found. Out: one HTML document, drawings inside it, light or dark as the reader's system is. Loads nothing, runs no script.

use super::tune_tables::{objective, remark, share_percent, shown};
use crate::report::escape;
use crate::tune::{CourseFigures, Landscape, Measure, Pair, TuneOptions, Tuned, TunedAxis};

const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#1b1f24;--paper:#fff;--grid:#d7dce1;--soft:#5b6670}\
@media(prefers-color-scheme:dark){:root{--ink:#e6e8ea;--paper:#14171a;--grid:#343a40;--soft:#9aa5b1}}\
body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:76rem;margin:2rem auto;padding:0 1rem}\
.table{overflow-x:auto;margin:0 0 1.2rem}table{border-collapse:collapse}\
td,th{padding:.15rem .7rem .15rem 0;text-align:left;border-bottom:1px solid var(--grid);white-space:nowrap}\
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}tr.sum td{font-weight:600}td.in{padding-left:1rem}\
.soft,caption{color:var(--soft)}caption{text-align:left;white-space:normal;padding-bottom:.3rem}\
.maps{display:flex;flex-wrap:wrap;gap:1.5rem}figure{margin:0;flex:1 1 26rem;max-width:34rem}\
svg{width:100%;height:auto;display:block}svg text{fill:var(--ink);font:11px system-ui,sans-serif}.cell text{fill:#10202c}\
.new{fill:none;stroke:#10202c;stroke-width:3}.old{fill:none;stroke:#10202c;stroke-width:2;stroke-dasharray:4 3}";
const CELL: f64 = 40.0;
const LEFT: f64 = 92.0;
const BOTTOM: f64 = 76.0;

/// The whole document.
pub(super) fn page(machine: &str, tuned: &Tuned, options: &TuneOptions) -> String {
    let title = format!("{}: feed-forward", escape(machine));
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>{title}</title>\n<style>{STYLE}</style></head>\n<body>\n<h1>{title}</h1>\n\
         <p>What was to be small: {}, over the programs for tuning.</p>\n",
        objective(options).to_lowercase().replace("rms", "RMS")
    );
    text += &gains(tuned);
    if !tuned.warnings.is_empty() {
        let items: String =
            tuned.warnings.iter().map(|warning| format!("<li>{}</li>", escape(&warning.message))).collect();
        text += &format!("<h2>What to know</h2>\n<ul>{items}</ul>\n");
    }
    text += &errors(&tuned.courses);
    text += &sensitivities(tuned, options);
    if !tuned.landscapes.is_empty() {
        text += &format!(
            "<h2>Around the new gains</h2>\n<p>{}, over the programs for tuning, simulated at every point, all other gains as found. \
             The framed cell is the new setting, the dashed one the old, where it lies inside the map. A valley along a diagonal is a pair of \
             gains that replace each other; a map that changes in one direction only says nothing of the other gain.</p>\n<div class=\"maps\">\n",
            objective(options)
        );
        for landscape in &tuned.landscapes {
            if let Some(axis) = tuned.axes.iter().find(|axis| axis.name == landscape.axis) {
                text += &drawing(landscape, axis);
            }
        }
        text += "</div>\n";
    }
    text + "</body></html>\n"
}

/// A table with its heading row; cells behind the first are numbers.
fn html_table(caption: &str, head: &[&str], rows: &[(&str, Vec<String>)]) -> String {
    let cell = |tag: &str, place: usize, text: &str| {
        let class = if place == 0 { "" } else { " class=\"n\"" };
        format!("<{tag}{class}>{}</{tag}>", escape(text))
    };
    let heading: String = head.iter().enumerate().map(|(place, text)| cell("th", place, text)).collect();
    let body: String = rows
        .iter()
        .map(|(class, cells)| {
            let cells: String = cells.iter().enumerate().map(|(place, text)| cell("td", place, text)).collect();
            let cells = if *class == "in" { cells.replacen("<td>", "<td class=\"in\">", 1) } else { cells };
            format!("<tr class=\"{class}\">{cells}</tr>\n")
        })
        .collect();
    format!("<div class=\"table\"><table><caption>{caption}</caption>\n<tr>{heading}</tr>\n{body}</table></div>\n")
}

fn gains(tuned: &Tuned) -> String {
    let mut rows = Vec::new();
    for axis in &tuned.axes {
        for gain in &axis.gains {
            let unit = gain.gain.unit(axis.kind);
            let number =
                |value: f64| if unit.is_empty() { format!("{value:.4}") } else { format!("{value:.4} {unit}") };
            let cells = [
                format!("{} {}", axis.name, gain.gain.key(axis.kind)),
                number(gain.before),
                number(gain.value),
                format!("{:.4} to {:.4}", gain.low, gain.high),
                remark(gain, axis),
            ];
            rows.push(("", cells.to_vec()));
        }
    }
    let caption = "The interval holds the scatter of the programs, not an error of the model.";
    html_table(caption, &["Gain", "Before", "After", "95 % interval", ""], &rows)
}

fn errors(courses: &[CourseFigures]) -> String {
    let mut rows = Vec::new();
    let cells = |name: String, pairs: &[Pair; 3], unit: &str| {
        let mut cells = vec![name];
        for figure in [|pair: &Pair| pair.rms, |pair: &Pair| pair.peak] {
            cells.extend([shown(figure(&pairs[0]), unit), shown(figure(&pairs[1]), unit)]);
            cells.push(share_percent(figure(&pairs[0]), figure(&pairs[1])));
            cells.push(shown(figure(&pairs[2]), unit));
        }
        cells
    };
    for course in courses {
        let kind = if course.validates { ", never used for tuning" } else { "" };
        let measured = if course.measured { ", measured" } else { "" };
        let name = format!("{}{kind}{measured} ({:.1} s)", course.name, course.duration_s);
        rows.push(("sum", cells(name, &course.objective, course.unit)));
        for axis in course.axes.iter().filter(|axis| axis.moves) {
            rows.push(("in", cells(format!("{} control deviation", axis.name), &axis.deviation, axis.unit)));
            rows.push(("in", cells(format!("{} following error", axis.name), &axis.following, axis.unit)));
        }
        rows.push(("in", cells("contour error".to_owned(), &course.contour_mm, "mm")));
    }
    let head = ["", "RMS before", "after", "change", "floor", "Peak before", "after", "change", "floor"];
    let caption = "Bold: what was to be small. Floor: the new gains without dry friction; what is above it is what friction leaves.";
    format!("<h2>Before and after</h2>\n{}", html_table(caption, &head, &rows))
}

fn sensitivities(tuned: &Tuned, options: &TuneOptions) -> String {
    let figure = |pair: &Pair| if options.measure == Measure::Rms { pair.rms } else { pair.peak };
    let mut rows: Vec<(&str, Vec<String>)> = Vec::new();
    for one in &tuned.sensitivities {
        let name = format!("{} {}", one.axis, one.what);
        let share = share_percent(figure(&one.objective[0]), figure(&one.objective[1]));
        match rows.last_mut().filter(|(_, cells)| cells[0] == name) {
            Some((_, cells)) => cells.push(share),
            None => rows.push(("", vec![name, share])),
        }
    }
    let caption = format!("{} if the machine is another than the file says, with the new gains", objective(options));
    format!("<h2>Sensitivity</h2>\n{}", html_table(&caption, &["", "10 % less", "10 % more"], &rows))
}

/// A map as coloured cells with their numbers.
fn drawing(landscape: &Landscape, axis: &TunedAxis) -> String {
    let map = &landscape.map;
    let (columns, rows) = (map.values[0].len(), map.values[1].len());
    let all = || map.heights.iter().flatten().copied();
    let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max));
    let (width, height) = (LEFT + CELL * columns as f64 + 4.0, CELL * rows as f64 + BOTTOM);
    let unit = if map.unit == "mm" { "µm" } else { "thousandths of a degree" };
    let names = map.gains.map(|gain| gain.key(axis.kind));
    let name = escape(&landscape.axis);
    let mut svg = format!(
        "<figure><figcaption><strong>{name}</strong>: {} up, {} across; cells in {unit}</figcaption>\n\
         <svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"map of {name}\">\n",
        names[1], names[0]
    );
    for (row, heights) in map.heights.iter().enumerate() {
        let y = CELL * (rows - 1 - row) as f64;
        for (column, value) in heights.iter().enumerate() {
            svg += &cell([LEFT + CELL * column as f64, y], *value, colour(*value, low, high));
        }
        let (x, y) = (LEFT - 6.0, y + 0.6 * CELL);
        svg += &format!("<text x=\"{x:.0}\" y=\"{y:.0}\" text-anchor=\"end\">{:.3}</text>\n", map.values[1][row]);
    }
    let (floor, middle) = (CELL * rows as f64, 0.5 * CELL * rows as f64);
    for (column, value) in map.values[0].iter().enumerate() {
        let (x, y) = (LEFT + CELL * (column as f64 + 0.5), floor + 18.0);
        svg += &format!("<text x=\"{x:.0}\" y=\"{y:.0}\" text-anchor=\"middle\">{value:.3}</text>");
    }
    for (class, inset, old) in [("old", 4.0, true), ("new", 2.0, false)] {
        if let Some([column, row]) = place(landscape, axis, old) {
            let (x, y) = (LEFT + CELL * column as f64 + inset, CELL * (rows - 1 - row) as f64 + inset);
            let size = CELL - 2.0 * inset;
            svg += &format!("<rect class=\"{class}\" x=\"{x}\" y=\"{y}\" width=\"{size}\" height=\"{size}\"/>\n");
        }
    }
    let centre = 0.5 * (width + LEFT);
    svg += &format!("<text x=\"{centre:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>\n", floor + 36.0, names[0]);
    svg += &format!(
        "<text transform=\"translate(14 {middle:.0}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
        names[1]
    );
    svg + &legend(floor + 50.0, low, high, unit) + "</svg></figure>\n"
}

fn cell([x, y]: [f64; 2], value: f64, fill: String) -> String {
    let (text_x, text_y) = (x + 0.5 * CELL, y + 0.6 * CELL);
    format!(
        "<g class=\"cell\"><rect x=\"{x:.0}\" y=\"{y:.0}\" width=\"{CELL}\" height=\"{CELL}\" fill=\"{fill}\"/>\
         <text x=\"{text_x:.0}\" y=\"{text_y:.0}\" text-anchor=\"middle\">{:.1}</text></g>",
        crate::base::units::UM_PER_MM * value
    )
}

/// By the logarithm: the valley is what one looks for.
fn colour(value: f64, low: f64, high: f64) -> String {
    let share = if high > low && low > 0.0 { (value / low).ln() / (high / low).ln() } else { 0.0 };
    format!("hsl({:.0} 60% {:.0}%)", 200.0 - 170.0 * share, 88.0 - 38.0 * share)
}

/// Colours from the lowest value to the highest.
fn legend(y: f64, low: f64, high: f64, unit: &str) -> String {
    const STEPS: u32 = 22;
    let mut svg = String::new();
    for step in 0..STEPS {
        let value = if low > 0.0 { low * (high / low).powf(f64::from(step) / f64::from(STEPS - 1)) } else { low };
        let x = LEFT + 60.0 + 8.0 * f64::from(step);
        svg += &format!(
            "<rect x=\"{x:.0}\" y=\"{y:.0}\" width=\"8.5\" height=\"12\" fill=\"{}\"/>",
            colour(value, low, high)
        );
    }
    let end = LEFT + 68.0 + 8.0 * f64::from(STEPS);
    let (text_y, [low, high]) = (y + 10.0, [low, high].map(|value| crate::base::units::UM_PER_MM * value));
    svg += &format!("<text x=\"{:.0}\" y=\"{text_y:.0}\" text-anchor=\"end\">{low:.1}</text>", LEFT + 54.0);
    svg + &format!("<text x=\"{end:.0}\" y=\"{text_y:.0}\">{high:.1} {unit}</text>\n")
}

/// The cell of the setting before or after, if it lies on the map.
fn place(landscape: &Landscape, axis: &TunedAxis, old: bool) -> Option<[usize; 2]> {
    let mut found = [0, 0];
    for (across, (gain, values)) in landscape.map.gains.iter().zip(&landscape.map.values).enumerate() {
        let gain = axis.gains.iter().find(|known| known.gain == *gain)?;
        let value = if old { gain.before } else { gain.value };
        let half = 0.5 * (values.get(1)? - values.first()?) * (1.0 + 1e-9);
        found[across] = values.iter().position(|known| (known - value).abs() <= half)?;
    }
    Some(found)
}
