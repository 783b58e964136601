//! The document of `tune --json`.
//!
//! In: [`Tuned`]. Out: JSON: gains by axis and key of the machine file, figures by program. Does not print.

use super::figures::{AxisFigures, CourseFigures, Pair, Sensitivity};
use super::group::{Tuned, TunedAxis};
use super::{Measure, Objective, TuneOptions};
use serde_json::{Map, Value, json};

/// The whole document.
pub fn document(machine: &str, tuned: &Tuned, options: &TuneOptions) -> Value {
    let axes: Map<String, Value> = tuned.axes.iter().map(|axis| (axis.name.clone(), axis_json(axis))).collect();
    json!({
        "format": 1,
        "machine": machine,
        "objective": match options.objective {
            Objective::Deviation => "deviation",
            Objective::Following => "following",
            Objective::Contour => "contour",
        },
        "measure": match options.measure { Measure::Rms => "rms", Measure::Peak => "peak" },
        "axes": axes,
        "programs": tuned.courses.iter().map(course_json).collect::<Vec<_>>(),
        "sensitivity": tuned.sensitivities.iter().map(sensitivity_json).collect::<Vec<_>>(),
        "simulations": tuned.simulations,
    })
}

fn axis_json(axis: &TunedAxis) -> Value {
    let gains: Map<String, Value> = axis
        .gains
        .iter()
        .map(|gain| {
            let document = json!({
                "value": gain.value, "unit": gain.gain.unit(axis.kind), "low": gain.low, "high": gain.high,
                "before": gain.before, "at_bound": gain.at_bound, "certain": gain.certain,
            });
            (format!("drive.{}", gain.gain.key(axis.kind)), document)
        })
        .collect();
    let mut document = Value::Object(gains);
    if axis.together.len() > 1 {
        document["shares_delay_with"] =
            json!(axis.together.iter().filter(|name| **name != axis.name).collect::<Vec<_>>());
    }
    document
}

fn pair_json(pair: &Pair, unit: &str) -> Value {
    json!({"rms": pair.rms, "peak": pair.peak, "unit": unit})
}

/// before, after and floor.
fn three(pairs: &[Pair; 3], unit: &str) -> Map<String, Value> {
    ["before", "after", "friction_floor"]
        .iter()
        .zip(pairs)
        .map(|(name, pair)| ((*name).to_owned(), pair_json(pair, unit)))
        .collect()
}

fn course_json(course: &CourseFigures) -> Value {
    let mut document = three(&course.objective, course.unit);
    document.insert("program".to_owned(), json!(course.name));
    document.insert("validates".to_owned(), json!(course.validates));
    document.insert("measured".to_owned(), json!(course.measured));
    document.insert("duration_s".to_owned(), json!(course.duration_s));
    document.insert("contour".to_owned(), Value::Object(three(&course.contour_mm, "mm")));
    let axis = |axis: &AxisFigures| {
        let errors = json!({"control_deviation": three(&axis.deviation, axis.unit), "following_error": three(&axis.following, axis.unit)});
        (axis.name.clone(), errors)
    };
    document.insert("axes".to_owned(), Value::Object(course.axes.iter().map(axis).collect()));
    Value::Object(document)
}

fn sensitivity_json(sensitivity: &Sensitivity) -> Value {
    let [tuned, changed] = &sensitivity.objective;
    json!({
        "axis": sensitivity.axis, "what": sensitivity.what, "change_percent": sensitivity.change_percent,
        "rms_ratio": changed.rms / tuned.rms.max(f64::MIN_POSITIVE), "peak_ratio": changed.peak / tuned.peak.max(f64::MIN_POSITIVE),
    })
}
