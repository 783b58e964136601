//! Tables of figures as HTML.
//!
//! In: the figures of a run, one side of a comparison, a comparison. Out: HTML with every text escaped. Does not compute figures.

use super::encode::escape;
use crate::base::units::{MS_PER_S, US_PER_S, percent_from_ratio};
use crate::compare::{
    Comparison, Figures, LineTimes, PairFigures, Side, arcs_remark, budget_rows, circle_rows, corner_rows, line_rows,
    pair_rows, significant, um,
};
use serde_json::Value;
use std::fmt::Write as _;

/// Rows of a table of places at most.
const ROWS_MAX: usize = 20;

/// A table; the first row is the head, the first column holds names. Cells are escaped here.
pub fn table(caption: &str, rows: &[Vec<String>]) -> String {
    if rows.len() < 2 {
        return String::new();
    }
    let mut html = format!("<figure class=\"table\"><figcaption>{}</figcaption><table>", escape(caption));
    for (i, row) in rows.iter().enumerate() {
        html += "<tr>";
        for (k, cell) in row.iter().enumerate() {
            let tag = if i == 0 || k == 0 { "th" } else { "td" };
            let _ = write!(html, "<{tag}>{}</{tag}>", escape(cell));
        }
        html += "</tr>";
    }
    html + "</table></figure>"
}

fn row(cells: &[&str]) -> Vec<String> {
    cells.iter().map(|cell| (*cell).to_owned()).collect()
}

/// Figures of a run as its recording has them.
pub fn run_tables(summary: &Value) -> String {
    let number = |key: &str| summary.get(key).and_then(Value::as_f64);
    let mut rows = vec![row(&["run", ""])];
    let mut push = |name: &str, text: Option<String>| rows.extend(text.map(|text| vec![name.to_owned(), text]));
    push("cycle time", number("cycle_time_s").map(|t| format!("{t:.3} s")));
    push("at programmed feed (CAM time)", number("cam_time_s").map(|t| format!("{t:.3} s")));
    push("cycle time / CAM time", number("time_ratio").map(|r| format!("{r:.3}")));
    push("time at programmed feed", number("programmed_feed_share").map(|r| format!("{:.1} %", percent_from_ratio(r))));
    push("path length", number("path_length_mm").map(|l| format!("{l:.3} mm")));
    push("blocks", number("blocks").map(|n| format!("{n}")));
    push("blended corners", number("corners_total").map(|n| format!("{n}")));
    let alarm = summary.get("alarm").and_then(|alarm| alarm.get("message")).and_then(Value::as_str);
    push("ended early by alarm", alarm.map(str::to_owned));
    let mut html = table("Run", &rows);
    if let Some(limits) = summary.get("limits").and_then(Value::as_object) {
        let mut shares: Vec<(&String, f64)> = limits.iter().filter_map(|(k, v)| Some((k, v.as_f64()?))).collect();
        shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut rows = vec![row(&["limit", "share of the time"])];
        rows.extend(
            shares.into_iter().map(|(name, share)| vec![name.clone(), format!("{:.1} %", percent_from_ratio(share))]),
        );
        html += &table("What limits the feed", &rows);
    }
    html + &axes_table(summary)
}

fn axes_table(summary: &Value) -> String {
    let Some(axes) = summary.get("axes").and_then(Value::as_object) else { return String::new() };
    let prefixes = [
        ("velocity_max_", "velocity max"),
        ("acceleration_max_", "acceleration max"),
        ("jerk_max_", "jerk max"),
        ("control_deviation_max_", "control deviation max"),
        ("control_deviation_rms_", "rms"),
        ("following_error_max_", "following error max"),
        ("following_error_rms_", "rms"),
    ];
    let has = |prefix: &str| {
        axes.values().any(|f| f.as_object().is_some_and(|fields| fields.keys().any(|k| k.starts_with(prefix))))
    };
    let shown: Vec<_> = prefixes.iter().filter(|(prefix, _)| has(prefix)).collect();
    let mut rows =
        vec![std::iter::once(String::new()).chain(shown.iter().map(|(_, title)| (*title).to_owned())).collect()];
    for (name, figures) in axes {
        let cell = |prefix: &str| {
            let field = figures.as_object().and_then(|fields| fields.iter().find(|(key, _)| key.starts_with(prefix)));
            field.and_then(|(key, value)| {
                Some(format!("{} {}", significant(value.as_f64()?), unit(&key[prefix.len()..])))
            })
        };
        let cells = shown.iter().map(|(prefix, _)| cell(prefix).unwrap_or_default());
        rows.push(std::iter::once(name.clone()).chain(cells).collect());
    }
    table("Axes", &rows)
}

fn unit(suffix: &str) -> String {
    suffix.replacen("_s", "/s", 1).replace("s2", "s²").replace("s3", "s³")
}

fn contour_row(name: String, figures: &Figures) -> Vec<String> {
    let at = format!("{:.3} s", figures.max_at_s);
    vec![name, um(figures.rms), um(figures.max), at, um(figures.p95), um(figures.bias)]
}

/// Contour error, circles and corners of one side. `whose`: stands in the captions, empty for a report of one trace.
pub fn side_tables(side: &Side, whose: &str) -> String {
    let mut rows = vec![row(&["", "rms", "max", "at", "p95", "mean"])];
    if let Some(own) = &side.own {
        rows.push(contour_row(own.against.replace('_', " "), &own.contour.space));
        rows.extend(own.contour.plane.iter().map(|plane| contour_row("in the plane, left +".to_owned(), plane)));
    }
    let mut html = table(&format!("Contour error{whose}"), &rows);
    let mut delays = vec![row(&["axis", "delay of the set-point in the control deviation"])];
    for (axis, delay_s, error_s) in &side.setpoint_delays_s {
        delays.push(vec![axis.clone(), format!("{:.3} ± {:.3} ms", delay_s * MS_PER_S, error_s * MS_PER_S)]);
    }
    html += &table(&format!("Delays{whose}"), &delays);
    html + &budget_table(side, whose) + &circle_table(side, whose) + &corner_table(side, whose)
}

fn budget_table(side: &Side, whose: &str) -> String {
    let Some(budget) = &side.budget else { return String::new() };
    let against = if budget.program_of_other { ", against the program of the other file" } else { "" };
    let html = table(&format!("Where the error comes from{whose}{against}"), &budget_rows(budget));
    let missing = budget.missing.iter().map(|note| format!("<p class=\"remark\">{}</p>", escape(&note.message)));
    html + &missing.collect::<String>()
}

fn circle_table(side: &Side, whose: &str) -> String {
    let Some(own) = &side.own else { return String::new() };
    let html = table(&format!("Circles (ISO 230-4){whose}"), &circle_rows(&own.features.circles, ROWS_MAX));
    let remark = arcs_remark(&own.features).map(|remark| format!("<p class=\"remark\">{}</p>", escape(&remark)));
    html + &remark.unwrap_or_default()
}

fn corner_table(side: &Side, whose: &str) -> String {
    let Some(own) = &side.own else { return String::new() };
    let corners = &own.features.corners;
    let caption = format!("Corners that are overshot most, {} in all{whose}", corners.len());
    table(&caption, &corner_rows(corners, ROWS_MAX))
}

/// Everything that a comparison says.
pub fn comparison_tables(comparison: &Comparison) -> String {
    let [a, b] = &comparison.sides;
    let mut rows = vec![row(&["comparison", ""])];
    if let Some(at) = comparison.alignment {
        let error = if at.uncertainty_s > 0.0 {
            format!(" ± {} µs", significant(at.uncertainty_s * US_PER_S))
        } else {
            String::new()
        };
        rows.push(vec!["time offset (reference − trace)".to_owned(), format!("{:.6} s{error}", at.offset_s)]);
        if at.drift_ratio != 0.0 {
            rows.push(vec!["drift of the clocks".to_owned(), format!("{:.3} ppm", at.drift_ratio * 1e6)]);
        }
        if !comparison.aligned_by.is_empty() {
            rows.push(vec!["aligned by".to_owned(), comparison.aligned_by.join(", ")]);
        }
    }
    if let (Some(one), Some(other)) = (a.cycle_time_s, b.cycle_time_s) {
        let text = format!("{one:.3} s against {other:.3} s: {:+.3} s ({})", one - other, a.cycle_time_basis);
        rows.push(vec!["cycle time".to_owned(), text]);
    }
    let mut html = table("Comparison", &rows);
    if let Some(found) = &comparison.contour {
        let mut rows = vec![row(&["", "rms", "max", "at", "p95", "mean"])];
        let name = if found.in_part { "tool tip in the part" } else { "in space" };
        rows.push(contour_row(format!("{name}: {}", found.against.replace('_', " ")), &found.contour.space));
        rows.extend(found.contour.plane.iter().map(|plane| contour_row(format!("in {}, left +", found.plane), plane)));
        html += &table("Contour error, trace against reference", &rows);
    }
    // What is short and says most comes first; recordings share a hundred signals.
    html += &(side_tables(a, ", trace") + &side_tables(b, ", reference"));
    html += &line_table(&comparison.lines);
    html += &pair_table("Differences at equal times (trace − reference)", &comparison.pairs, |p| p.in_time.as_ref());
    html += &pair_table("Differences at equal places on the path", &comparison.pairs, |p| p.along_path.as_ref());
    let mut why = vec![row(&["signal of the trace", "signal of the reference", "why they are a pair"])];
    why.extend(comparison.pairs.iter().map(|p| vec![p.name.clone(), p.reference_name.clone(), p.reason.clone()]));
    let summary = format!("Pairs of signals ({})", comparison.pairs.len());
    html + &format!("<details><summary>{summary}</summary>{}</details>", table("", &why))
}

fn pair_table(caption: &str, pairs: &[PairFigures], get: impl Fn(&PairFigures) -> Option<&Figures>) -> String {
    let mut rows = pair_rows(pairs, get, &|time_s| format!("{time_s:.3} s"));
    for unit in rows.iter_mut().filter_map(|row| row.last_mut()) {
        *unit = unit.replace("^2", "²").replace("^3", "³");
    }
    table(caption, &rows)
}

fn line_table(lines: &[LineTimes]) -> String {
    table("NC lines whose time differs most", &line_rows(lines, ROWS_MAX))
}
