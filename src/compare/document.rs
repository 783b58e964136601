//! The document of `compare --json`.
//!
//! In: a [`Comparison`]. Out: JSON with the keys of docs/compare.md; a number that is not finite is null. Holds no path but the names of the
//! files as the user gave them. Does not print.

use super::budget::{Budget, Part};
use super::circle::CircleFigures;
use super::comparison::{Comparison, OwnContour, PairFigures, Side};
use super::corner::CornerFigures;
use super::statistics::Figures;
use serde_json::{Map, Value, json};

/// Corners and lines that the document lists; the numbers of all stand beside.
const LISTED_MAX: usize = 100;

/// The whole document, without limits.
pub fn document(comparison: &Comparison) -> Value {
    let at = comparison.alignment;
    let [a, b] = &comparison.sides;
    let contour = comparison.contour.as_ref();
    let space = contour.map(|found| found.contour.space);
    let plane = contour.and_then(|found| found.contour.plane);
    let signals: Map<String, Value> =
        comparison.pairs.iter().map(|pair| (pair.name.clone(), pair_json(pair))).collect();
    let difference_s = a.cycle_time_s.zip(b.cycle_time_s).map(|(a, b)| a - b);
    let warnings: Vec<Value> = comparison
        .notes
        .iter()
        .map(|note| json!({"code": note.code, "line": note.line(), "message": note.message}))
        .collect();
    json!({
        "format": 1,
        "trace": a.name,
        "reference": b.name,
        "offset_s": at.map(|at| at.offset_s),
        "offset_uncertainty_s": at.and_then(|at| finite(at.uncertainty_s)),
        "drift_ratio": at.map(|at| at.drift_ratio),
        "correlation": at.and_then(|at| finite(at.correlation_ratio)),
        "aligned_by": comparison.aligned_by,
        "signals": signals,
        "contour_error_rms_mm": space.map(|f| f.rms),
        "contour_error_max_mm": space.map(|f| f.max),
        "contour_error_p95_mm": space.map(|f| f.p95),
        "contour_error_max_at_s": space.map(|f| f.max_at_s),
        "contour_error_plane_rms_mm": plane.map(|f| f.rms),
        "contour_error_plane_max_mm": plane.map(|f| f.max),
        "contour_error_plane_bias_mm": plane.map(|f| f.bias),
        "plane": contour.map(|found| found.plane),
        "contour_of": contour.map(|found| found.against.clone()),
        "contour_in_part": contour.map(|found| found.in_part),
        "contour_matched_share": contour.map(|found| found.contour.matched_share),
        "cycle_time_s": [a.cycle_time_s, b.cycle_time_s],
        "cycle_time_of": a.cycle_time_basis,
        "cycle_time_difference_s": difference_s,
        "sides": [side_json(a), side_json(b)],
        "lines_total": comparison.lines.len(),
        "lines": comparison.lines.iter().take(LISTED_MAX).map(|line| json!({
            "program": *line.program, "line": line.line, "trace_s": line.trace_s, "reference_s": line.reference_s,
            "contour_error_max_mm": line.contour_error_max_mm,
        })).collect::<Vec<_>>(),
        "warnings": warnings,
    })
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn pair_json(pair: &PairFigures) -> Value {
    let time = |get: fn(&Figures) -> f64| pair.in_time.as_ref().map(get);
    let path = |get: fn(&Figures) -> f64| pair.along_path.as_ref().map(get);
    json!({
        "unit": pair.unit,
        "reference": pair.reference_name,
        "pair": pair.reason,
        "samples": pair.in_time.map(|f| f.samples),
        "rms": time(|f| f.rms),
        "max": time(|f| f.max),
        "max_at_s": time(|f| f.max_at_s),
        "p95": time(|f| f.p95),
        "bias": time(|f| f.bias),
        "zero_taken_off": pair.zero,
        "correlation": pair.in_time.and_then(|f| f.correlation_ratio),
        "delay_s": pair.delay_s.map(|(delay_s, _)| delay_s),
        "delay_uncertainty_s": pair.delay_s.map(|(_, error_s)| error_s),
        "rms_path": path(|f| f.rms),
        "max_path": path(|f| f.max),
        "max_path_at_s": path(|f| f.max_at_s),
        "p95_path": path(|f| f.p95),
        "bias_path": path(|f| f.bias),
        "trace_rms": finite(pair.side_rms[0]),
        "reference_rms": finite(pair.side_rms[1]),
        "trace_max": pair.side_max[0],
        "reference_max": pair.side_max[1],
    })
}

/// One side: duration, delays, its own contour error, circles and corners.
pub fn side_json(side: &Side) -> Value {
    let delays: Map<String, Value> = side
        .setpoint_delays_s
        .iter()
        .map(|(axis, delay_s, error_s)| (axis.clone(), json!({"delay_s": delay_s, "uncertainty_s": finite(*error_s)})))
        .collect();
    let mut document = json!({
        "name": side.name,
        "format": side.description,
        "cycle_time_s": side.cycle_time_s,
        "setpoint_delay": delays,
    });
    if let Some(budget) = &side.budget {
        document["budget"] = budget_json(budget);
    }
    if let Some(own) = &side.own
        && let Some(fields) = document.as_object_mut()
    {
        fields.extend(own_json(own));
    }
    document
}

fn own_json(own: &OwnContour) -> Map<String, Value> {
    let mut worst: Vec<&CornerFigures> = own.features.corners.iter().collect();
    worst.sort_by(|a, b| b.overshoot_um.total_cmp(&a.overshoot_um).then(a.time_s.total_cmp(&b.time_s)));
    let plane = own.contour.plane;
    let fields = json!({
        "contour_of": own.against,
        "contour_error_rms_mm": own.contour.space.rms,
        "contour_error_max_mm": own.contour.space.max,
        "contour_error_p95_mm": own.contour.space.p95,
        "contour_error_max_at_s": own.contour.space.max_at_s,
        "contour_error_plane_bias_mm": plane.map(|f| f.bias),
        "circles": own.features.circles.iter().map(circle_json).collect::<Vec<_>>(),
        "arcs_not_judged": own.features.arcs_total,
        "corners_total": own.features.corners.len(),
        "corners": worst.into_iter().take(LISTED_MAX).map(corner_json).collect::<Vec<_>>(),
    });
    match fields {
        Value::Object(fields) => fields,
        _ => Map::new(),
    }
}

/// The error budget: three parts, null where one is missing.
pub fn budget_json(budget: &Budget) -> Value {
    let part = |part: &Option<Part>| {
        part.as_ref().map(|part| {
            let worst: Vec<Value> = part
                .worst
                .iter()
                .map(|((program, line), error_um)| json!({"program": **program, "line": line, "error_um": error_um}))
                .collect();
            let f = &part.figures;
            json!({"rms_um": f.rms, "max_um": f.max, "p95_um": f.p95, "mean_um": f.bias, "samples": f.samples, "worst": worst})
        })
    };
    let missing: Vec<&str> = budget.missing.iter().map(|note| note.message.as_str()).collect();
    json!({
        "chord": part(&budget.chord),
        "interpolator": part(&budget.interpolator),
        "drives": part(&budget.drives),
        "program_of_other": budget.program_of_other,
        "missing": missing,
    })
}

fn circle_json(circle: &CircleFigures) -> Value {
    json!({
        "plane": circle.plane.concat(),
        "centre_mm": circle.centre_mm,
        "radius_mm": circle.radius_mm,
        "direction": if circle.counter_clockwise { "counter-clockwise" } else { "clockwise" },
        "start_s": circle.start_s,
        "end_s": circle.end_s,
        "circular_deviation_um": circle.deviation_um,
        "circular_deviation_minimum_zone_um": circle.minimum_zone_um,
        "bidirectional_deviation_um": circle.bidirectional_um,
        "bidirectional_deviation_minimum_zone_um": circle.bidirectional_minimum_zone_um,
        "radial_max_um": circle.radial_max_um,
        "radial_min_um": circle.radial_min_um,
        "radial_mean_um": circle.radial_mean_um,
        "quadrant_peaks_um": circle.quadrant_peaks_um,
    })
}

fn corner_json(corner: &CornerFigures) -> Value {
    json!({
        "time_s": corner.time_s,
        "s_mm": corner.s_mm,
        "point_mm": corner.point_mm,
        "angle_deg": corner.angle_deg,
        "overshoot_um": corner.overshoot_um,
        "cut_um": corner.cut_um,
    })
}
