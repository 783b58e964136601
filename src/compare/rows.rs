//! Figures as rows of text, the head first: for the tables of the command and of the page.
//!
//! In: circles, corners, budgets, lines, pairs. Out: cells. Numbers are rounded for reading; the JSON document has them whole. Does not lay out.

use super::budget::{Budget, Part, ROUNDING_UM};
use super::circle::CircleFigures;
use super::comparison::PairFigures;
use super::contour::Features;
use super::corner::CornerFigures;
use super::lines::LineTimes;
use super::statistics::Figures;
use crate::base::units::{MS_PER_S, UM_PER_MM};

/// Worst lines that a row of the budget names.
const WORST_SHOWN: usize = 5;
/// Lines whose times differ by less are not listed.
const DIFFERENT_S: f64 = 5e-4;

/// A figure that is smaller than this share of the largest difference is shown as 0.
const ROUNDING_SHARE: f64 = 1e-9;

/// Rows of cells.
pub type Rows = Vec<Vec<String>>;

fn head(cells: &[&str]) -> Rows {
    vec![cells.iter().map(|cell| (*cell).to_owned()).collect()]
}

/// Three significant digits, more where the number is large.
pub fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = (2 - value.abs().log10().floor() as i64).clamp(0, 9) as usize;
    if value.abs() < 1e-7 { format!("{value:.2e}") } else { format!("{value:.digits$}") }
}

/// A length in mm as micrometres.
pub fn um(value_mm: f64) -> String {
    micrometres(value_mm * UM_PER_MM)
}

/// Rounding of coordinates is shown as 0.
fn micrometres(value_um: f64) -> String {
    format!("{} µm", significant(if value_um.abs() < ROUNDING_UM { 0.0 } else { value_um }))
}

/// Circles by ISO 230-4.
pub fn circle_rows(circles: &[CircleFigures], most: usize) -> Rows {
    let mut rows = head(&[
        "circle",
        "R",
        "G",
        "G min. zone",
        "G(b)",
        "G(b) min. zone",
        "F max",
        "F min",
        "F mean",
        "peaks behind 0, 90, 180, 270°",
    ]);
    let um = |value_um: f64| format!("{value_um:.2} µm");
    let known = |value_um: Option<f64>| value_um.map_or("–".to_owned(), um);
    for circle in circles.iter().take(most) {
        let way = if circle.counter_clockwise { "ccw" } else { "cw" };
        let peaks = circle.quadrant_peaks_um.map(|peak| peak.map_or("–".to_owned(), |peak| format!("{peak:.2}")));
        rows.push(vec![
            format!("{} {way}, {:.3} s", circle.plane.concat(), circle.start_s),
            format!("{:.3} mm", circle.radius_mm),
            um(circle.deviation_um),
            um(circle.minimum_zone_um),
            known(circle.bidirectional_um),
            known(circle.bidirectional_minimum_zone_um),
            um(circle.radial_max_um),
            um(circle.radial_min_um),
            um(circle.radial_mean_um),
            format!("{} µm", peaks.join(", ")),
        ]);
    }
    rows
}

/// What is to be said beside the circles; `None` where there is nothing.
pub fn arcs_remark(features: &Features) -> Option<String> {
    let arcs = match features.arcs_total {
        0 => return None,
        1 => "1 arc of less than a full turn is".to_owned(),
        more => format!("{more} arcs of less than a full turn are"),
    };
    Some(format!(
        "{arcs} not judged by ISO 230-4: a part of a circle does not tell its centre; the contour error counts them"
    ))
}

/// Corners that are overshot most.
pub fn corner_rows(corners: &[CornerFigures], most: usize) -> Rows {
    let mut worst: Vec<&CornerFigures> = corners.iter().collect();
    worst.sort_by(|a, b| b.overshoot_um.total_cmp(&a.overshoot_um).then(a.time_s.total_cmp(&b.time_s)));
    let mut rows = head(&["corner at", "angle", "overshoot", "cut", "X Y Z"]);
    for corner in worst.into_iter().take(most) {
        rows.push(vec![
            format!("{:.3} s", corner.time_s),
            format!("{:.1}°", corner.angle_deg),
            format!("{:.2} µm", corner.overshoot_um),
            format!("{:.2} µm", corner.cut_um),
            corner.point_mm.map(|x| format!("{x:.3}")).join(" "),
        ]);
    }
    rows
}

/// Parts of a budget with their worst lines; the program is named where it is another than that of the line before.
pub fn budget_rows(budget: &Budget) -> Rows {
    let parts =
        [("chords of the program", &budget.chord), ("interpolator", &budget.interpolator), ("drives", &budget.drives)];
    let mut rows = head(&["error", "rms", "max", "p95", "worst NC lines (µm)"]);
    for (name, part) in parts {
        let Some(part) = part else { continue };
        let f = &part.figures;
        let [rms, max, p95] = [f.rms, f.max, f.p95].map(micrometres);
        rows.push(vec![name.to_owned(), rms, max, p95, worst_lines(part)]);
    }
    rows
}

fn worst_lines(part: &Part) -> String {
    let mut named: Option<&str> = None;
    let mut words = Vec::new();
    for ((program, line), error_um) in part.worst.iter().take(WORST_SHOWN) {
        let known = named == Some(program);
        named = Some(program);
        let place = if known || program.is_empty() { format!("{line}") } else { format!("{program} {line}") };
        words.push(format!("{place} ({})", significant(*error_um)));
    }
    words.join(", ")
}

/// NC lines whose time differs most.
pub fn line_rows(lines: &[LineTimes], most: usize) -> Rows {
    let mut rows = head(&["NC line", "trace", "reference", "difference", "contour error max"]);
    for line in lines.iter().filter(|line| (line.trace_s - line.reference_s).abs() > DIFFERENT_S).take(most) {
        rows.push(vec![
            format!("{} {}", line.program, line.line),
            format!("{:.3} s", line.trace_s),
            format!("{:.3} s", line.reference_s),
            format!("{:+.3} s", line.trace_s - line.reference_s),
            um(line.contour_error_max_mm),
        ]);
    }
    rows
}

/// Differences of pairs. `at`: how a place in time is told.
pub fn pair_rows(
    pairs: &[PairFigures],
    get: impl Fn(&PairFigures) -> Option<&Figures>,
    at: &dyn Fn(f64) -> String,
) -> Rows {
    let mut rows = head(&["signal", "rms", "max", "at", "p95", "bias", "correlation", "delay", "unit"]);
    for pair in pairs {
        let Some(figures) = get(pair) else { continue };
        // Rounding of large values is no figure: against the largest difference it is nothing.
        let told = |value: f64| significant(if value.abs() < ROUNDING_SHARE * figures.max { 0.0 } else { value });
        rows.push(vec![
            pair.name.clone(),
            significant(figures.rms),
            significant(figures.max),
            at(figures.max_at_s),
            told(figures.p95),
            told(figures.bias),
            figures.correlation_ratio.map_or(String::new(), |r| format!("{r:.5}")),
            pair.delay_s.map_or(String::new(), |(delay_s, _)| format!("{:.3} ms", delay_s * MS_PER_S)),
            pair.unit.clone(),
        ]);
    }
    rows
}
