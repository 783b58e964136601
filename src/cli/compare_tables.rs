//! A comparison as tables for people.
//!
//! In: a [`Comparison`], checked limits. Out: text. Numbers are rounded for reading; `--json` has them whole.

use super::output::table;
use crate::base::units::{MS_PER_S, US_PER_S};
use crate::compare::{
    Comparison, Features, Figures, LimitCheck, Lines, PairFigures, Side, arcs_remark, budget_rows, circle_rows,
    corner_rows, line_rows, pair_rows, significant, um,
};
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
        text += &table(&pair_rows(&comparison.pairs, |pair| pair.in_time.as_ref(), &at));
    }
    if comparison.pairs.iter().any(|pair| pair.along_path.is_some()) {
        text += "\ndifferences at equal places on the path, while the tool moves\n";
        text += &table(&pair_rows(&comparison.pairs, |pair| pair.along_path.as_ref(), &at));
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

fn contour_text(comparison: &Comparison, at: &dyn Fn(f64) -> String) -> String {
    let mut rows = Vec::new();
    let mut push = |name: String, figures: &Figures, place: String| {
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
    let Features { circles, corners, .. } = &own.features;
    if !circles.is_empty() {
        let rows = table(&circle_rows(circles, ROWS_MAX));
        text += &format!("\ncircles of {} (ISO 230-4), {} in all\n{rows}", side.name, circles.len());
    }
    if let Some(remark) = arcs_remark(&own.features) {
        text += &format!("\n{}: {remark}\n", side.name);
    }
    if !corners.is_empty() {
        let rows = table(&corner_rows(corners, ROWS_MAX));
        text += &format!("\ncorners of {} that are overshot most, {} in all\n{rows}", side.name, corners.len());
    }
    text
}

/// Where the error of one side comes from.
pub(super) fn budget_text(side: &Side) -> String {
    let Some(budget) = &side.budget else { return String::new() };
    let whose = if budget.program_of_other { " (against the program of the other file)" } else { "" };
    let mut text = format!("\nwhere the error of {} comes from{whose}\n{}", side.name, table(&budget_rows(budget)));
    for note in &budget.missing {
        text += &format!("  {}\n", note.message);
    }
    text
}

fn lines_text(comparison: &Comparison) -> String {
    let rows = line_rows(&comparison.lines, ROWS_MAX);
    if rows.len() == 1 {
        return String::new();
    }
    format!("\nNC lines whose time differs most\n{}", table(&rows))
}

/// Pairs by name that are listed; more are counted.
const PAIRS_LISTED_MAX: usize = 12;

fn pairs_text(pairs: &[PairFigures]) -> String {
    if pairs.is_empty() {
        return String::new();
    }
    let mut text = "\npairs\n".to_owned();
    // Two recordings share a hundred signals: what is a pair by its name alone is counted, --json and the page list it.
    let by_name = |pair: &&PairFigures| pair.name == pair.reference_name && pair.zero == 0.0;
    let mut reasons: Vec<(&str, usize)> = Vec::new();
    for pair in pairs.iter().filter(by_name) {
        match reasons.iter_mut().find(|(reason, _)| *reason == pair.reason) {
            Some((_, count)) => *count += 1,
            None => reasons.push((&pair.reason, 1)),
        }
    }
    let counted = |reason: &str| reasons.iter().any(|(known, count)| *known == reason && *count > PAIRS_LISTED_MAX);
    for (reason, count) in reasons.iter().filter(|(_, count)| *count > PAIRS_LISTED_MAX) {
        text += &format!("  {count} signals of one name in both: {reason}\n");
    }
    for pair in pairs.iter().filter(|pair| !(by_name(pair) && counted(&pair.reason))) {
        let zero = if pair.zero == 0.0 {
            String::new()
        } else {
            format!("; zeros differ: {} {} taken off", significant(pair.zero), pair.unit)
        };
        text += &format!("  {} = {}: {}{zero}\n", pair.name, pair.reference_name, pair.reason);
    }
    text
}
