//! A comparison as tables for people.
//!
//! In: a [`Comparison`], checked limits. Out: text. Numbers are rounded for reading; `--json` has them whole.

use super::output::table;
use crate::base::units::{MS_PER_S, UM_PER_MM, US_PER_S};
use crate::compare::{Comparison, Figures, LimitCheck, Lines, PairFigures, Side};
use crate::trace::Trace;

/// Rows of a table of places.
const ROWS_MAX: usize = 8;

pub(super) fn tables(comparison: &Comparison, checks: &[LimitCheck], trace: &Trace) -> String {
    let lines = Lines::of(trace);
    let [a, b] = &comparison.sides;
    let mut text = format!("{} ({})\nagainst {} ({})\n\n", a.name, a.description, b.name, b.description);
    text += &table(&head(comparison));
    let at = |time_s: f64| match lines.at(time_s) {
        Some((_, line)) => format!("{time_s:.3} s, line {line}"),
        None => format!("{time_s:.3} s"),
    };
    if !comparison.pairs.is_empty() {
        text += "\ndifferences at equal times (trace - reference)\n";
        text += &table(&figures_rows(&comparison.pairs, |pair| pair.in_time.as_ref(), &at));
    }
    if comparison.pairs.iter().any(|pair| pair.along_path.is_some()) {
        text += "\ndifferences at equal places on the path, while the tool moves\n";
        text += &table(&figures_rows(&comparison.pairs, |pair| pair.along_path.as_ref(), &at));
    }
    text += &contour_text(comparison, &at);
    for side in &comparison.sides {
        text += &features_text(side);
        text += &budget_text(side);
    }
    text += &lines_text(comparison);
    text += &pairs_text(&comparison.pairs);
    if !checks.is_empty() {
        let row = |check: &LimitCheck| {
            let found = check.found.map_or("missing".to_owned(), significant);
            let verdict = if check.holds() { "holds" } else { "EXCEEDED" };
            vec![check.rule.name.clone(), found, format!("limit {}", check.rule.value), verdict.to_owned()]
        };
        text += "\nlimits\n";
        text += &table(&checks.iter().map(row).collect::<Vec<_>>());
    }
    text
}

fn head(comparison: &Comparison) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    let cell = |text: &str| text.to_owned();
    if let Some(at) = comparison.alignment {
        let error = if at.uncertainty_s.is_finite() && at.uncertainty_s > 0.0 {
            format!(" ± {} µs", significant(at.uncertainty_s * US_PER_S))
        } else {
            String::new()
        };
        let late = if at.offset_s > 0.0 { " (the reference is later)" } else { "" };
        rows.push(vec![cell("time offset"), format!("{:.6} s{error}{late}", at.offset_s)]);
        if at.drift_ratio != 0.0 {
            rows.push(vec![cell("drift of the clocks"), format!("{:.3} ppm", at.drift_ratio * 1e6)]);
        }
        if at.correlation_ratio.is_finite() {
            rows.push(vec![cell("correlation of the motions"), format!("{:.5}", at.correlation_ratio)]);
        }
        if !comparison.aligned_by.is_empty() {
            rows.push(vec![cell("aligned by"), comparison.aligned_by.join(", ")]);
        }
    }
    let [a, b] = &comparison.sides;
    if let (Some(one), Some(other)) = (a.cycle_time_s, b.cycle_time_s) {
        let text = format!("{one:.3} s against {other:.3} s: {:+.3} s ({})", one - other, a.cycle_time_basis);
        rows.push(vec![cell("cycle time"), text]);
    }
    for side in &comparison.sides {
        for (axis, delay_s, error_s) in &side.setpoint_delays_s {
            let text = format!(
                "set-point delayed by {:.3} ± {:.3} ms in the control deviation of {}",
                delay_s * MS_PER_S,
                error_s * MS_PER_S,
                side.name
            );
            rows.push(vec![axis.clone(), text]);
        }
    }
    rows
}

/// Three significant digits, more where the number is large.
fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = (2 - value.abs().log10().floor() as i64).clamp(0, 9) as usize;
    if value.abs() < 1e-7 { format!("{value:.2e}") } else { format!("{value:.digits$}") }
}

fn figures_rows(
    pairs: &[PairFigures],
    get: impl Fn(&PairFigures) -> Option<&Figures>,
    at: &dyn Fn(f64) -> String,
) -> Vec<Vec<String>> {
    let head = ["", "rms", "max", "at", "p95", "bias", "correlation", "delay", "unit"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for pair in pairs {
        let Some(figures) = get(pair) else { continue };
        rows.push(vec![
            pair.name.clone(),
            significant(figures.rms),
            significant(figures.max),
            at(figures.max_at_s),
            significant(figures.p95),
            significant(figures.bias),
            figures.correlation_ratio.map_or(String::new(), |r| format!("{r:.5}")),
            pair.delay_s.map_or(String::new(), |(delay_s, _)| format!("{:.3} ms", delay_s * MS_PER_S)),
            pair.unit.clone(),
        ]);
    }
    rows
}

fn contour_text(comparison: &Comparison, at: &dyn Fn(f64) -> String) -> String {
    let mut rows = Vec::new();
    let mut push = |name: String, figures: &Figures, place: String| {
        let um = |value_mm: f64| format!("{} µm", significant(value_mm * UM_PER_MM));
        rows.push(vec![name, um(figures.rms), um(figures.max), place, um(figures.p95), um(figures.bias)]);
    };
    if let Some(found) = &comparison.contour {
        let what = if found.in_part { " (tool tip in the part)" } else { "" };
        push(format!("{}{what}", found.against), &found.contour.space, at(found.contour.space.max_at_s));
        if let Some(plane) = &found.contour.plane {
            push(format!("the same in {}", found.plane), plane, at(plane.max_at_s));
        }
    }
    for (side, name) in comparison.sides.iter().zip(["trace", "reference"]) {
        if let Some(own) = &side.own {
            let space = &own.contour.space;
            push(format!("{name}: {}", own.against), space, format!("{:.3} s", space.max_at_s));
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    rows.insert(0, ["", "rms", "max", "at", "p95", "mean"].map(str::to_owned).to_vec());
    format!("\ncontour error\n{}", table(&rows))
}

fn features_text(side: &Side) -> String {
    let Some(own) = &side.own else { return String::new() };
    let mut text = String::new();
    if !own.features.circles.is_empty() {
        let head = ["", "R", "G", "G(b)", "F max", "F min", "F mean", "peaks behind 0, 90, 180, 270 deg"];
        let mut rows = vec![head.map(str::to_owned).to_vec()];
        for circle in own.features.circles.iter().take(ROWS_MAX) {
            let um = |value_um: f64| format!("{value_um:.2} µm");
            let way = if circle.counter_clockwise { "ccw" } else { "cw" };
            let peaks = circle.quadrant_peaks_um.map(|peak| peak.map_or("-".to_owned(), |peak| format!("{peak:.2}")));
            rows.push(vec![
                format!("{} {way} at {:.3} s", circle.plane.concat(), circle.start_s),
                format!("{:.3} mm", circle.radius_mm),
                um(circle.deviation_um),
                circle.bidirectional_um.map_or(String::new(), um),
                um(circle.radial_max_um),
                um(circle.radial_min_um),
                um(circle.radial_mean_um),
                peaks.join(", "),
            ]);
        }
        text +=
            &format!("\ncircles of {} (ISO 230-4), {} in all\n{}", side.name, own.features.circles.len(), table(&rows));
    }
    let mut worst: Vec<_> = own.features.corners.iter().collect();
    worst.sort_by(|a, b| b.overshoot_um.total_cmp(&a.overshoot_um).then(a.time_s.total_cmp(&b.time_s)));
    if !worst.is_empty() {
        let mut rows = vec![["", "angle", "overshoot", "cut", "at"].map(str::to_owned).to_vec()];
        for corner in worst.iter().take(ROWS_MAX) {
            rows.push(vec![
                format!("{:.3} s", corner.time_s),
                format!("{:.1} deg", corner.angle_deg),
                format!("{:.2} µm", corner.overshoot_um),
                format!("{:.2} µm", corner.cut_um),
                corner.point_mm.map(|x| format!("{x:.3}")).join(" "),
            ]);
        }
        text += &format!("\ncorners of {} that are overshot most, {} in all\n{}", side.name, worst.len(), table(&rows));
    }
    text
}

/// Where the error of one side comes from.
pub(super) fn budget_text(side: &Side) -> String {
    let Some(budget) = &side.budget else { return String::new() };
    let parts =
        [("chords of the program", &budget.chord), ("interpolator", &budget.interpolator), ("drives", &budget.drives)];
    let mut rows = vec![["", "rms", "max", "p95", "worst lines"].map(str::to_owned).to_vec()];
    for (name, part) in parts {
        let Some(part) = part else { continue };
        let um = |value_um: f64| format!("{} µm", significant(value_um));
        let worst =
            part.worst.iter().take(4).map(|((_, line), error_um)| format!("{line} ({})", significant(*error_um)));
        let f = &part.figures;
        rows.push(vec![name.to_owned(), um(f.rms), um(f.max), um(f.p95), worst.collect::<Vec<_>>().join(", ")]);
    }
    let mut text = format!("\nwhere the error of {} comes from\n{}", side.name, table(&rows));
    for note in &budget.missing {
        text += &format!("  {}\n", note.message);
    }
    text
}

fn lines_text(comparison: &Comparison) -> String {
    let differing = comparison.lines.iter().filter(|line| (line.trace_s - line.reference_s).abs() > 5e-4);
    let mut rows = vec![["line", "trace", "reference", "difference", "contour error max"].map(str::to_owned).to_vec()];
    for line in differing.take(ROWS_MAX) {
        rows.push(vec![
            format!("{} {}", line.program, line.line),
            format!("{:.3} s", line.trace_s),
            format!("{:.3} s", line.reference_s),
            format!("{:+.3} s", line.trace_s - line.reference_s),
            format!("{} µm", significant(line.contour_error_max_mm * UM_PER_MM)),
        ]);
    }
    if rows.len() == 1 {
        return String::new();
    }
    format!("\nNC lines whose time differs most\n{}", table(&rows))
}

fn pairs_text(pairs: &[PairFigures]) -> String {
    if pairs.is_empty() {
        return String::new();
    }
    let mut text = "\npairs\n".to_owned();
    for pair in pairs {
        let zero = if pair.zero == 0.0 {
            String::new()
        } else {
            format!("; zeros differ: {} {} taken off", significant(pair.zero), pair.unit)
        };
        text += &format!("  {} = {}: {}{zero}\n", pair.name, pair.reference_name, pair.reason);
    }
    text
}
