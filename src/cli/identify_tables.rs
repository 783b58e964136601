//! What `sollwert identify` prints: tables for people, one document for machines.
//!
//! In: results. Out: text, JSON. In the document an axis is a key of the top level, and below it stand the keys of the machine file. Does not
//! compute anything.

use super::output::table;
use crate::identify::{AxisResult, Estimate, Parameter};
use crate::machine::{Axis, Machine};
use serde_json::{Map, Value, json};
use std::path::PathBuf;

pub(super) fn axis_of<'m>(result: &AxisResult, machine: &'m Machine) -> Option<&'m Axis> {
    machine.axis_by_name(&result.axis).map(|id| machine.axis(id))
}

/// All axes.
pub(super) fn tables(results: &[AxisResult], machine: &Machine) -> String {
    let mut text = String::new();
    for (place, result) in results.iter().enumerate() {
        let Some(axis) = axis_of(result, machine) else { continue };
        if place > 0 {
            text.push('\n');
        }
        text += &format!("axis {}\n", result.axis);
        text += &values(result, axis);
        text += &refused(result);
        text += &figures(result);
        for verdict in &result.verdicts {
            text += &format!("  * {verdict}\n");
        }
    }
    text
}

fn values(result: &AxisResult, axis: &Axis) -> String {
    if result.estimates.is_empty() {
        return "  nothing could be identified\n".to_owned();
    }
    let mut rows = vec![["", "value", "95 %: from", "to", "unit", "by", "other ways"].map(str::to_owned).to_vec()];
    for estimate in &result.estimates {
        let others: Vec<String> = result
            .others
            .iter()
            .filter(|other| other.parameter == estimate.parameter && other.means != estimate.means)
            .map(|other| format!("{} {}", other.means.title(), number(other.value, other.high - other.low)))
            .collect();
        let width = estimate.high - estimate.low;
        rows.push(vec![
            estimate.parameter.title().to_owned(),
            number(estimate.value, width),
            number(estimate.low, width),
            number(estimate.high, width),
            estimate.parameter.unit(axis).to_owned(),
            estimate.means.title().to_owned(),
            others.join("; "),
        ]);
    }
    table(&rows)
}

/// So many digits as the width of the interval leaves a meaning, and one more.
pub(super) fn number(value: f64, width: f64) -> String {
    let digits = if width > 0.0 { (2 - width.log10().floor() as i32).clamp(0, 9) } else { 6 };
    format!("{value:.*}", digits as usize)
}

fn refused(result: &AxisResult) -> String {
    if result.refusals.is_empty() {
        return String::new();
    }
    let mut text = "  not to be told from these traces:\n".to_owned();
    let mut said: Vec<(&str, &str, Vec<Parameter>)> = Vec::new();
    for refusal in &result.refusals {
        match said.iter_mut().find(|(reason, remedy, _)| *reason == refusal.reason && *remedy == refusal.remedy) {
            Some((_, _, parameters)) => parameters.push(refusal.parameter),
            None => said.push((&refusal.reason, &refusal.remedy, vec![refusal.parameter])),
        }
    }
    for (reason, remedy, parameters) in said {
        let names: Vec<&str> = parameters.iter().map(|parameter| parameter.title()).collect();
        text += &format!("  - {}: {reason}\n      {remedy}\n", names.join(", "));
    }
    text
}

fn figures(result: &AxisResult) -> String {
    let row = |figure: &crate::identify::Figure| {
        vec![figure.title.clone(), format!("{:.4}", figure.value), figure.unit.to_owned()]
    };
    let rows: Vec<Vec<String>> = result.figures.iter().map(row).collect();
    table(&rows)
}

/// The document.
pub(super) fn document(results: &[AxisResult], machine: &Machine, traces: &[PathBuf]) -> Value {
    let names: Vec<String> = traces.iter().map(|path| path.display().to_string()).collect();
    let mut document = json!({"format": 1, "machine": machine.name, "traces": names});
    let (mut refusals, mut figures, mut verdicts, mut others) = (Map::new(), Map::new(), Map::new(), Map::new());
    for result in results {
        let Some(axis) = axis_of(result, machine) else { continue };
        let entry = |estimate: &Estimate| {
            let unit = estimate.parameter.unit(axis);
            let (value, low, high) = (estimate.value, estimate.low, estimate.high);
            json!({"value": value, "unit": unit, "low": low, "high": high, "method": estimate.means.title()})
        };
        let of_axis: Map<String, Value> = result
            .estimates
            .iter()
            .map(|estimate| (estimate.parameter.key(axis).to_owned(), entry(estimate)))
            .collect();
        document[&result.axis] = Value::Object(of_axis);
        let of_axis = result.refusals.iter().map(|refusal| {
            let value = json!({"reason": refusal.reason, "remedy": refusal.remedy});
            (refusal.parameter.key(axis).to_owned(), value)
        });
        refusals.insert(result.axis.clone(), Value::Object(of_axis.collect()));
        let of_axis = result.figures.iter().map(|figure| (figure.key.to_owned(), json!(figure.value)));
        figures.insert(result.axis.clone(), Value::Object(of_axis.collect()));
        verdicts.insert(result.axis.clone(), json!(result.verdicts));
        let of_axis: Vec<Value> = result
            .others
            .iter()
            .map(|estimate| {
                let mut entry = entry(estimate);
                entry["key"] = json!(estimate.parameter.key(axis));
                entry
            })
            .collect();
        others.insert(result.axis.clone(), Value::Array(of_axis));
    }
    document["refused"] = Value::Object(refusals);
    document["figures"] = Value::Object(figures);
    document["verdicts"] = Value::Object(verdicts);
    document["other_ways"] = Value::Object(others);
    document
}
