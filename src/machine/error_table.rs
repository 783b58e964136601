//! An error over the position, at equidistant points: that of a screw, and the compensation of it (MD38000, $AA_ENC_COMP).
//!
//! In: keys of `[axes.*.mechanics]` or `encoder`. Out: [`ErrorTable`] in internal units. Refuses a table so steep that a position would
//! no longer belong to one place: the error may change by at most half of the distance of two points.

use super::axis::lu;
use super::section::Section;
use crate::base::AxisKind;
use crate::base::diagnostics::Diagnostic;
use crate::base::units::mm_from_um;

/// Steepest table: with a slope below 1 position and error determine each other; no screw is worse than this.
const SLOPE_MAX_RATIO: f64 = 0.5;

/// Errors at `start_lu + n * step_lu`, linear in between. At least two, step positive.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorTable {
    /// Position of the first point.
    pub start_lu: f64,
    /// Distance of two points.
    pub step_lu: f64,
    /// The error at each point.
    pub errors_lu: Vec<f64>,
    /// The last point is the first again; else the ends hold outside.
    pub periodic: bool,
}

/// The names of its keys: values, start, step, periodic.
pub(super) struct TableNames {
    pub values: [&'static str; 2],
    pub start: [&'static str; 2],
    pub step: [&'static str; 2],
    pub periodic: &'static str,
}

/// Reads the keys (those of a linear axis, those of a rotary one); `None` without values or after a report.
pub(super) fn error_table(section: &Section<'_>, names: &TableNames) -> Option<ErrorTable> {
    let kind = section.kind().unwrap_or(AxisKind::Linear);
    let place = usize::from(kind == AxisKind::Rotary);
    let (values, start, step) = (names.values[place], names.start[place], names.step[place]);
    // Every key is read, so that a wrong one is reported even without values.
    let start_lu = lu(kind, section.number(start));
    let step_lu = section.optional_number(step).map(|distance| lu(kind, distance));
    let periodic = section.flag(names.periodic);
    let errors = section.values(values);
    if errors.is_none() && !section.has(values) && (section.has(step) || section.has(start)) {
        let message = format!("{} stands without {}", section.full(step), section.full(values));
        section.report_at(step, "", Diagnostic::error("M0004", message).help(format!("add {values} = [...]")));
    }
    let errors = errors?;
    let Some(step_lu) = step_lu else {
        section.missing(step, &format!("add {step} = ..., the distance of the points of {values}"));
        return None;
    };
    let small = |value: f64| if kind == AxisKind::Linear { mm_from_um(value) } else { lu(kind, value) };
    let errors_lu: Vec<f64> = errors.into_iter().map(small).collect();
    let steep = errors_lu.windows(2).position(|two| (two[1] - two[0]).abs() > SLOPE_MAX_RATIO * step_lu);
    if let Some(at) = steep {
        let message =
            format!("{} changes from point {at} to {} by more than half of {step}", section.full(values), at + 1);
        let help = "such an error is no longer one of a screw: check the units of both keys";
        section.report_at(values, "", Diagnostic::error("M0008", message).help(help));
    }
    let (first, last) = (errors_lu.first().copied(), errors_lu.last().copied());
    if periodic && first != last {
        let message = format!("{} is periodic, and its last point is not the first", section.full(values));
        let help = "the last point stands one period behind the first: give it the same value";
        section.report_at(values, "", Diagnostic::error("M0008", message).help(help));
    }
    Some(ErrorTable { start_lu, step_lu, errors_lu, periodic })
}
